//! Mistakes put into random good models: for each kind of mistake that errors report, exactly that diagnostic at exactly
//! that place, and nothing that follows from it.
//!
//! An operator changes a model as a value and marks where its diagnostic is to stand (`mauve_tests::model`); it does nothing
//! where the model has no place for the mistake.
//!
//! `MAUVE_SEEDS=500 cargo test --release -p mauve-diagnostics --test main seeding::` tries more models,
//! `MAUVE_OPERATOR=two-writers` one kind of mistake.

use std::collections::{BTreeSet, HashSet};
use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

use mauve_diagnostics::{Severity, codes, workspace_diagnostics};
use mauve_hir::{Database, Workspace};
use mauve_tests::model::*;
use mauve_tests::{Random, plain, random_model};

/// The kinds of mistake: the code, and what makes one.
const OPERATORS: &[(&str, Operator)] = &[
    ("ambiguous-name", ambiguous_name),
    ("argument-count", argument_count),
    ("argument-type", argument_type),
    ("assignment-type", assignment_type),
    ("blocking-call", blocking_call),
    ("buffer-size", buffer_size),
    ("condition-type", condition_type),
    ("conflicting-fields", conflicting_fields),
    ("connection-direction", connection_direction),
    ("connection-type", connection_type),
    ("constant-expression", constant_expression),
    ("deadline-missed", deadline_missed),
    ("deployment-target", deployment_target),
    ("duplicate-activity", duplicate_activity),
    ("duplicate-definition", duplicate_definition),
    ("duplicate-field", duplicate_field),
    ("duplicate-hook", duplicate_hook),
    ("empty-interval", empty_interval),
    ("import-cycle", import_cycle),
    ("inheritance-cycle", inheritance_cycle),
    ("initial-state", initial_state),
    ("invalid-configuration", invalid_configuration),
    ("invalid-field", invalid_field),
    ("invalid-table", invalid_table),
    ("invalid-type", invalid_type),
    ("missing-activity", missing_activity),
    ("missing-field", missing_field),
    ("missing-value", missing_value),
    ("never-triggered", never_triggered),
    ("no-effect", no_effect),
    ("not-assignable", not_assignable),
    ("operation-definition", operation_definition),
    ("operation-signature", operation_signature),
    ("operator-type", operator_type),
    ("out-argument", out_argument),
    ("outside-interval", outside_interval),
    ("port-direction", port_direction),
    ("recursive-operation", recursive_operation),
    ("refuted-time", refuted_time),
    ("return-type", return_type),
    ("syntax-error", syntax_error),
    ("two-writers", two_writers),
    ("undeclared-lock", undeclared_lock),
    ("undeclared-operation", undeclared_operation),
    ("undefined-operation", undefined_operation),
    ("unknown-field", unknown_field),
    ("unresolved-architecture", unresolved_architecture),
    ("unresolved-codel", unresolved_codel),
    ("unresolved-component", unresolved_component),
    ("unresolved-core", unresolved_core),
    ("unresolved-feature", unresolved_feature),
    ("unresolved-include", unresolved_include),
    ("unresolved-instance", unresolved_instance),
    ("unresolved-operation", unresolved_operation),
    ("unresolved-shell", unresolved_shell),
    ("unresolved-state", unresolved_state),
    ("unresolved-variable", unresolved_variable),
    ("update-or-statemachine", update_or_statemachine),
    ("waiting-codel", waiting_codel),
    ("work-elsewhere", work_elsewhere),
    ("wrong-shell", wrong_shell),
    // Warnings.
    ("equal-priorities", equal_priorities),
    ("lost-write", lost_write),
    ("never-taken", never_taken),
    ("not-strongly-connected", not_strongly_connected),
    ("read-before-assignment", read_before_assignment),
    ("unconnected-operation", unconnected_operation),
    ("unknown-timing-key", unknown_timing_key),
    ("unreachable-state", unreachable_state),
];

/// Errors that no text of a model has.
const EXCEPTIONS: &[(&str, &str)] = &[
    ("unreadable-file", "it is about a file that is no text"),
    ("too-large", "no mistake makes a model so large"),
    ("chain-late", "the models declare no chain"),
    ("invalid-topic", "the models have no topic"),
    ("across-hosts", "the models have no host"),
];

type Operator = fn(&mut Seed) -> Option<()>;

#[test]
fn random_models_have_no_error_and_no_warning() {
    for seed in 0..5 * models() {
        let written = random_model(seed).written();
        let found = noticed(&written, &mut None);
        assert!(found.is_empty(), "seed {seed}: {found:#?}\n{}", shown(&written));
    }
}

#[test]
fn every_error_has_an_operator() {
    let errors = codes().filter(|code| code.severity == Severity::Error).map(|code| code.name);
    let excepted = EXCEPTIONS.iter().map(|(code, _)| *code);
    let seeded: BTreeSet<&str> = OPERATORS.iter().map(|(code, _)| *code).chain(excepted).collect();
    let left: Vec<&str> = errors.filter(|code| !seeded.contains(code)).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn one_mistake_is_one_diagnostic_at_its_place() {
    let only = std::env::var("MAUVE_OPERATOR").ok();
    let is_tried = |code: &str| only.as_deref().is_none_or(|only| only == code);
    let mut all: Vec<_> =
        OPERATORS.iter().filter(|it| is_tried(it.0)).map(|it| (it, Tried::default())).collect();
    // Not every model has a place for every mistake.
    for seed in 0..100 * models() {
        let mut left = all.iter_mut().filter(|(_, it)| it.models < models()).peekable();
        if left.peek().is_none() {
            break;
        }
        let model = random_model(seed);
        // The mistakes are edits of one database.
        let mut opened = None;
        for ((code, operator), tried) in left {
            let random = Random((seed + 1).wrapping_mul(0xd134_2543_de82_ef95) | 1);
            let mut seeded = Seed { model: model.clone(), random };
            if operator(&mut seeded).is_none() {
                continue;
            }
            tried.models += 1;
            let written = seeded.model.written();
            let expected: BTreeSet<_> = written
                .marks
                .iter()
                .map(|(path, at)| ((*code).to_owned(), path.clone(), at.start, at.end))
                .collect();
            assert!(!expected.is_empty(), "{code}: nothing is marked");
            let mut found = noticed(&written, &mut opened);
            // The table says what the deployment says.
            found.retain(|(code, ..)| code != "overloading-times");
            let places: BTreeSet<_> = found
                .iter()
                .map(|(code, path, at, _)| (code.clone(), path.clone(), at.start, at.end))
                .collect();
            if places != expected || found.len() != expected.len() {
                if tried.failed.is_empty() {
                    tried.first = format!("=== {code}, seed {seed}\n{}", differs(&written, &found));
                }
                tried.failed.push(seed);
            }
        }
    }
    let mut failures = String::new();
    for ((code, _), Tried { models: tried, failed, first }) in &all {
        assert!(*tried == models(), "{code}: a place was found in {tried} models only");
        if !failed.is_empty() {
            let count = failed.len();
            let _ = writeln!(failures, "{first}\n=== {code}: {count} of {tried} failed: seeds {failed:?}\n");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// The models in which a kind of mistake was put.
#[derive(Default)]
struct Tried {
    models: u64,
    /// The seeds of those with other diagnostics, and the report of the first one.
    failed: Vec<u64>,
    first: String,
}

fn models() -> u64 {
    std::env::var("MAUVE_SEEDS").map_or(20, |count| count.parse().unwrap())
}

/// An error or a warning: code, file, what is marked, message.
type Noticed = (String, String, Range<usize>, String);

/// Returns the errors and warnings of a model. The database that is opened, if any, has a similar model.
fn noticed(written: &Written, opened: &mut Option<(Database, Workspace)>) -> Vec<Noticed> {
    let has_same_files = |(db, workspace): &(Database, Workspace)| {
        let files = workspace.files(db);
        files.len() == written.files.len()
            && written.files.iter().all(|(path, _)| files.contains_key(Path::new(path)))
    };
    if !opened.as_ref().is_some_and(has_same_files) {
        let db = Database::default();
        let texts = written.files.iter().map(|(path, text)| (PathBuf::from(path), text.clone()));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        *opened = Some((db, workspace));
    }
    let (db, workspace) = opened.as_mut().unwrap();
    for (path, text) in &written.files {
        let file = workspace.file(db, path.as_ref()).unwrap();
        if **file.text(db) != **text {
            file.set_text(db, text.as_str().into());
        }
    }
    let (db, workspace) = (&*db, *workspace);
    let found = workspace_diagnostics(db, workspace);
    let found = found.iter().map(|it| &it.diagnostic).filter(|it| it.code.severity != Severity::Hint);
    // The periods and buffers of the models are random.
    let found = found.filter(|it| it.code.name != "buffer-stays-full");
    found
        .map(|it| {
            let range = it.at.range(db);
            let path = it.at.file(db).path(db).display().to_string();
            (it.code.name.to_owned(), path, range.start().into()..range.end().into(), it.message.clone())
        })
        .collect()
}

fn shown(written: &Written) -> String {
    written.files.iter().map(|(path, text)| format!("//- {path}\n{text}")).collect()
}

/// What was expected and what was found, with the lines, then the files in which that is.
fn differs(written: &Written, found: &[Noticed]) -> String {
    let text = |path: &str| written.files.iter().find(|it| it.0 == path).map_or("", |it| &it.1);
    let line = |path: &str, at: &Range<usize>| {
        let text = text(path);
        let start = text[..at.start].rfind('\n').map_or(0, |it| it + 1);
        let end = text[at.end..].find('\n').map_or(text.len(), |it| at.end + it);
        format!("{path}: {} >>{}<< {}", &text[start..at.start], &text[at.clone()], &text[at.end..end])
    };
    let mut out = String::new();
    let mut files = HashSet::new();
    for (path, at) in &written.marks {
        files.insert(path.clone());
        let _ = writeln!(out, "expected {}", line(path, at));
    }
    for (code, path, at, message) in found {
        files.insert(path.clone());
        let _ = writeln!(out, "found {code}: {}\n      {message}", line(path, at));
    }
    if std::env::var("MAUVE_OPERATOR").is_ok() { format!("{out}{}", shown(written)) } else { out }
}

/// A model in which a mistake is put.
struct Seed {
    model: Model,
    random: Random,
}

/// Where a core stands: file, library, declaration.
type Site = (usize, usize, usize);

impl Seed {
    /// One of these, where there are any.
    fn of<T>(&mut self, mut all: Vec<T>) -> Option<T> {
        if all.is_empty() { None } else { Some(all.swap_remove(self.random.below(all.len()))) }
    }

    fn coin(&mut self) -> bool {
        self.random.below(2) == 0
    }

    /// Where the declarations stand that are such.
    fn sites(&self, is: impl Fn(&Declaration) -> bool) -> Vec<Site> {
        let mut sites = Vec::new();
        for (file, of) in self.model.files.iter().enumerate() {
            for (library, (_, declarations)) in of.libraries.iter().enumerate() {
                let all = declarations.iter().enumerate().filter(|(_, it)| is(it));
                sites.extend(all.map(|(declaration, _)| (file, library, declaration)));
            }
        }
        sites
    }

    fn site(&mut self, is: impl Fn(&Declaration) -> bool) -> Option<Site> {
        let sites = self.sites(is);
        self.of(sites)
    }

    fn at(&mut self, (file, library, declaration): Site) -> &mut Declaration {
        &mut self.model.files[file].libraries[library].1[declaration]
    }

    fn library_at(&self, (file, library, _): Site) -> Option<String> {
        self.model.files[file].libraries[library].0.clone()
    }

    /// The declarations of the library that the site is in, in this file.
    fn beside(&mut self, (file, library, _): Site) -> &mut Vec<Declaration> {
        &mut self.model.files[file].libraries[library].1
    }

    fn in_library(&self, library: Option<&str>) -> Vec<Declaration> {
        let all = self.model.files.iter().flat_map(|file| &file.libraries);
        all.filter(|(name, _)| name.as_deref() == library).flat_map(|(_, all)| all.clone()).collect()
    }

    /// A random core that has what is asked for.
    fn core(&mut self, fits: impl Fn(&Core) -> bool) -> Option<Site> {
        self.site(|it| matches!(it, Declaration::Core(core) if fits(core)))
    }

    fn core_at(&mut self, site: Site) -> Option<&mut Core> {
        match self.at(site) {
            Declaration::Core(core) => Some(core),
            _ => None,
        }
    }

    /// The shell of that name as it is seen in a library, with what it inherits.
    fn shell_of(&self, library: Option<&str>, name: &str) -> Option<Shell> {
        let (library, name) = name.split_once('.').map_or((library, name), |(of, name)| (Some(of), name));
        let is = |it: &Declaration| match it {
            Declaration::Shell(shell) if shell.name == name => Some(shell.clone()),
            _ => None,
        };
        let own = self.in_library(library).iter().find_map(is);
        let mut shell = own.or_else(|| self.in_library(Some("common")).iter().find_map(is))?;
        for base in shell.bases.clone() {
            let base = self.shell_of(library, &base)?;
            shell.values.extend(base.values);
            shell.ports.extend(base.ports);
            shell.required.extend(base.required);
            shell.provided.extend(base.provided);
        }
        Some(shell)
    }

    /// A core, and all features of its shell, with what is asked for.
    fn core_and_shell(&mut self, fits: impl Fn(&Core, &Shell) -> bool) -> Option<(Site, Shell)> {
        let mut all = Vec::new();
        for site in self.sites(|it| matches!(it, Declaration::Core(_))) {
            let core = self.core_at(site)?.clone();
            let library = self.library_at(site);
            let shell = self.shell_of(library.as_deref(), &core.shell)?;
            if fits(&core, &shell) {
                all.push((site, shell));
            }
        }
        self.of(all)
    }

    fn deployment(&mut self) -> Option<&mut Deployment> {
        declarations(&mut self.model).find_map(|it| match it {
            Declaration::Deployment(deployment) => Some(deployment),
            _ => None,
        })
    }

    fn architectures(&mut self) -> Vec<&mut Architecture> {
        let all = declarations(&mut self.model).filter_map(|it| match it {
            Declaration::Architecture(architecture) => Some(architecture),
            _ => None,
        });
        all.collect()
    }

    /// The instances of all architectures, with their shells.
    fn instances(&mut self) -> Vec<(String, Shell)> {
        let all: Vec<(String, String)> =
            self.architectures().into_iter().flat_map(|it| it.instances.clone()).collect();
        all.into_iter()
            .filter_map(|(name, component)| Some((name, self.shell_of_component(&component)?)))
            .collect()
    }

    fn shell_of_component(&self, component: &str) -> Option<Shell> {
        let (library, component) = component.split_once('.')?;
        let shell = self.in_library(Some(library)).into_iter().find_map(|it| match it {
            Declaration::Component(name, shell, _) if name == component => Some(shell),
            _ => None,
        })?;
        self.shell_of(Some(library), &shell)
    }

    /// A random program, or a block in one, of a core.
    fn block(&mut self, site: Site) -> Option<&mut Block> {
        let random = &mut self.random;
        let declaration = &mut self.model.files[site.0].libraries[site.1].1[site.2];
        let Declaration::Core(core) = declaration else { return None };
        let mut all = blocks(core);
        let all_len = all.len();
        let mut block = if all_len == 0 { return None } else { all.swap_remove(random.below(all_len)) };
        while random.below(2) == 0 {
            let inner: Vec<usize> = (0..block.len())
                .filter(|&at| matches!(block[at], Statement::Block(_) | Statement::If(..)))
                .collect();
            if inner.is_empty() {
                break;
            }
            block = match &mut block[*random.of(&inner)] {
                Statement::Block(inner) | Statement::If(_, inner, _) => inner,
                _ => return None,
            };
        }
        Some(block)
    }

    /// Puts statements somewhere into a program of a core.
    fn insert(&mut self, site: Site, statements: Block) -> Option<()> {
        let at = self.random.below(1 << 16);
        let block = self.block(site)?;
        let at = at % (block.len() + 1);
        block.splice(at..at, statements);
        Some(())
    }

    /// Puts statements somewhere into a program of some core.
    fn insert_anywhere(&mut self, statements: Block) -> Option<()> {
        let site = self.core(|_| true)?;
        self.insert(site, statements)
    }

    /// A random expression in a program that is such, to be changed.
    fn expr(&mut self, fits: impl Fn(&Expr) -> bool) -> Option<&mut Expr> {
        let mut found = Vec::new();
        for core in declarations(&mut self.model).filter_map(core_of) {
            exprs_of_core(core, &fits, &mut found);
        }
        if found.is_empty() { None } else { Some(found.swap_remove(self.random.below(found.len()))) }
    }

    /// A call of a codel with literals and variables of its own, which are declared before it: those statements, then the
    /// call's arguments. None where that cannot be written down.
    fn call_of(&mut self, codel: &Signature) -> Option<(Block, Vec<Expr>)> {
        let (mut declared, mut arguments) = (Block::new(), Vec::new());
        for (number, Parameter { direction, ty, .. }) in codel.parameters.iter().enumerate() {
            if matches!(*direction, "" | "in ") {
                arguments.push(value_of(ty)?);
                continue;
            }
            let name = format!("seeded{number}");
            let value = if *direction == "inout " { Some(value_of(ty)?) } else { None };
            declared.push(Statement::Variable(Variable { name: name.clone(), ty: ty.clone(), value }));
            arguments.push(name_of(&name));
        }
        Some((declared, arguments))
    }

    /// A codel that can be called so, with a core of its library.
    fn callable(&mut self, fits: impl Fn(&Signature) -> bool) -> Option<(Site, Signature, Block, Vec<Expr>)> {
        let site = self.core(|_| true)?;
        let library = self.library_at(site);
        let mut found = Vec::new();
        for declaration in self.in_library(library.as_deref()) {
            if let Declaration::Codel(codel) = declaration
                && fits(&codel)
                && let Some((declared, arguments)) = self.call_of(&codel)
            {
                found.push((site, codel, declared, arguments));
            }
        }
        self.of(found)
    }
}

fn declarations(model: &mut Model) -> impl Iterator<Item = &mut Declaration> {
    model.files.iter_mut().flat_map(|file| &mut file.libraries).flat_map(|(_, all)| all)
}

fn core_of(declaration: &mut Declaration) -> Option<&mut Core> {
    match declaration {
        Declaration::Core(core) => Some(core),
        _ => None,
    }
}

/// The programs of a core.
fn blocks(core: &mut Core) -> Vec<&mut Block> {
    let mut blocks: Vec<&mut Block> = core.operations.iter_mut().map(|it| &mut it.body).collect();
    blocks.extend(core.hooks.iter_mut().map(|it| &mut it.body));
    for state in core.machines.iter_mut().flat_map(|it| &mut it.states) {
        blocks.extend(state.methods.iter_mut().map(|it| &mut it.body));
        blocks.extend(state.transitions.iter_mut().filter_map(|it| it.effect.as_mut()));
    }
    blocks
}

/// The programs that every period may execute, where ports are written.
fn periodic(core: &mut Core) -> Vec<&mut Block> {
    let mut blocks: Vec<&mut Block> =
        core.hooks.iter_mut().filter(|it| it.keyword == "update").map(|it| &mut it.body).collect();
    for state in core.machines.iter_mut().flat_map(|it| &mut it.states) {
        blocks.extend(state.methods.iter_mut().filter(|it| it.keyword == "run").map(|it| &mut it.body));
    }
    blocks
}

fn exprs_of_core<'a>(core: &'a mut Core, fits: &dyn Fn(&Expr) -> bool, found: &mut Vec<&'a mut Expr>) {
    for state in core.machines.iter_mut().flat_map(|it| &mut it.states) {
        for transition in &mut state.transitions {
            transition.guard.iter_mut().for_each(|it| exprs(it, fits, found));
            exprs_of_block(transition.effect.iter_mut().flatten(), fits, found);
        }
        state.methods.iter_mut().for_each(|it| exprs_of_block(it.body.iter_mut(), fits, found));
    }
    core.operations.iter_mut().for_each(|it| exprs_of_block(it.body.iter_mut(), fits, found));
    core.hooks.iter_mut().for_each(|it| exprs_of_block(it.body.iter_mut(), fits, found));
}

fn exprs_of_block<'a>(
    block: impl Iterator<Item = &'a mut Statement>,
    fits: &dyn Fn(&Expr) -> bool,
    found: &mut Vec<&'a mut Expr>,
) {
    for statement in block {
        match statement {
            Statement::Variable(Variable { value: Some(value), .. })
            | Statement::Assign(_, value)
            | Statement::Expr(value)
            | Statement::Return(_, Some(value)) => exprs(value, fits, found),
            Statement::If(condition, then, otherwise) => {
                exprs(condition, fits, found);
                exprs_of_block(then.iter_mut(), fits, found);
                exprs_of_block(otherwise.iter_mut().flatten(), fits, found);
            }
            Statement::Block(inner) => exprs_of_block(inner.iter_mut(), fits, found),
            Statement::Variable(_) | Statement::Return(..) => {}
        }
    }
}

/// The innermost expressions that are such.
fn exprs<'a>(expr: &'a mut Expr, fits: &dyn Fn(&Expr) -> bool, found: &mut Vec<&'a mut Expr>) {
    if fits(expr) && !inside(expr).into_iter().any(|it| contains(it, fits)) {
        found.push(expr);
        return;
    }
    match &mut expr.form {
        Form::Literal(_) | Form::Name(_) => {}
        Form::Unary(_, inner) | Form::Parens(inner) => exprs(inner, fits, found),
        Form::Binary(left, _, right) => {
            exprs(left, fits, found);
            exprs(right, fits, found);
        }
        Form::Call(_, arguments) => arguments.iter_mut().for_each(|it| exprs(it, fits, found)),
    }
}

fn inside(expr: &Expr) -> Vec<&Expr> {
    match &expr.form {
        Form::Literal(_) | Form::Name(_) => Vec::new(),
        Form::Unary(_, inner) | Form::Parens(inner) => vec![inner],
        Form::Binary(left, _, right) => vec![left, right],
        Form::Call(_, arguments) => arguments.iter().collect(),
    }
}

fn contains(expr: &Expr, fits: &dyn Fn(&Expr) -> bool) -> bool {
    fits(expr) || inside(expr).into_iter().any(|it| contains(it, fits))
}

/// An expression that changes nothing, so that it can be taken out.
fn is_pure(expr: &Expr) -> bool {
    !contains(expr, &|it| matches!(it.form, Form::Call(..)))
}

fn is_built_in(callee: &str) -> bool {
    matches!(callee, "read" | "write" | "status" | "send" | "collect")
}

fn name_of(name: &str) -> Expr {
    Expr { ty: String::new(), form: Form::Name(name.to_owned()) }
}

fn call(callee: &str, arguments: Vec<Expr>) -> Statement {
    Statement::Expr(Expr { ty: String::new(), form: Form::Call(callee.to_owned(), arguments) })
}

fn variable(name: &str, ty: &str, value: Option<Expr>) -> Statement {
    Statement::Variable(Variable { name: name.to_owned(), ty: ty.to_owned(), value })
}

/// A value of the type, where one can be written down.
fn value_of(ty: &str) -> Option<Expr> {
    let text = match plain(ty) {
        "int" | "uint8" | "int16" => "7",
        "double" | "float" => "7.5",
        "bool" => "true",
        "string" => "\"seven\"",
        _ => return None,
    };
    Some(Expr::literal(plain(ty), text))
}

/// A value that is never taken for one of the type.
fn wrong_value(ty: &str) -> Expr {
    match plain(ty) {
        "bool" => Expr::literal("int", "3"),
        "string" => Expr::literal("bool", "true"),
        _ => Expr::literal("string", "\"three\""),
    }
}

// Names that mean nothing.

const NOBODY: &str = "quxquux";

fn ambiguous_name(seed: &mut Seed) -> Option<()> {
    let shells = seed.sites(|it| matches!(it, Declaration::Shell(_)));
    let of = |name: &str| shells.iter().copied().find(|site| seed.library_at(*site).as_deref() == Some(name));
    let (first, second) = (of("part0")?, of("part1")?);
    let declared = if seed.coin() {
        seed.model.files[0].libraries.push((
            None,
            vec![Declaration::Shell(Shell {
                name: "Outer".to_owned(),
                bases: vec![marked("Twin")],
                ..Shell::default()
            })],
        ));
        Declaration::Shell(Shell { name: "Twin".to_owned(), ..Shell::default() })
    } else {
        let body = vec![call(&marked("twin"), Vec::new())];
        let hooks = vec![Program { keyword: "update".to_owned(), body }];
        let core =
            Core { name: "Outer".to_owned(), shell: "common.Base".to_owned(), hooks, ..Core::default() };
        seed.model.files[0].libraries.push((None, vec![Declaration::Core(core)]));
        Declaration::Codel(Signature {
            name: "twin".to_owned(),
            parameters: Vec::new(),
            result: "void".to_owned(),
        })
    };
    seed.beside(first).push(declared.clone());
    seed.beside(second).push(declared);
    Some(())
}

fn unresolved_architecture(seed: &mut Seed) -> Option<()> {
    if seed.coin() {
        let architectures = seed.architectures();
        let import = architectures.into_iter().find_map(|it| it.imports.first_mut())?;
        *import = marked(NOBODY);
    } else {
        seed.deployment()?.targets = vec![marked(NOBODY)];
    }
    Some(())
}

fn unresolved_codel(seed: &mut Seed) -> Option<()> {
    let expr = seed.expr(|it| matches!(&it.form, Form::Call(callee, _) if !is_built_in(callee)))?;
    let Form::Call(callee, _) = &mut expr.form else { return None };
    *callee = marked(NOBODY);
    Some(())
}

fn unresolved_component(seed: &mut Seed) -> Option<()> {
    let site = seed.site(|it| matches!(it, Declaration::Architecture(it) if !it.instances.is_empty()))?;
    let random = seed.random.below(1 << 16);
    let Declaration::Architecture(architecture) = seed.at(site) else { return None };
    let count = architecture.instances.len();
    architecture.instances[random % count].1 = marked(NOBODY);
    Some(())
}

fn unresolved_core(seed: &mut Seed) -> Option<()> {
    let site = seed.site(|it| matches!(it, Declaration::Component(..)))?;
    let Declaration::Component(_, _, core) = seed.at(site) else { return None };
    *core = marked(NOBODY);
    Some(())
}

fn unresolved_shell(seed: &mut Seed) -> Option<()> {
    let is = |it: &Declaration| match it {
        Declaration::Component(..) | Declaration::Core(_) => true,
        Declaration::Shell(shell) => !shell.bases.is_empty(),
        _ => false,
    };
    let site = seed.site(is)?;
    match seed.at(site) {
        Declaration::Component(_, shell, _) => *shell = marked(NOBODY),
        Declaration::Core(core) => core.shell = marked(NOBODY),
        Declaration::Shell(shell) => shell.bases[0] = marked(NOBODY),
        _ => return None,
    }
    Some(())
}

fn unresolved_feature(seed: &mut Seed) -> Option<()> {
    let kind = seed.random.below(4);
    let mut found: Vec<&mut String> = Vec::new();
    match kind {
        0 => found.extend(seed.deployment()?.settings.iter_mut().map(|it| &mut it.feature)),
        _ => {
            for architecture in seed.architectures() {
                match kind {
                    1 => found.extend(architecture.settings.iter_mut().map(|it| &mut it.feature)),
                    2 => found.extend(architecture.operations.iter_mut().map(|it| &mut it.target.1)),
                    _ => found.extend(architecture.connections.iter_mut().map(|it| &mut it.source.1)),
                }
            }
        }
    }
    *found.into_iter().next_back()? = marked(NOBODY);
    Some(())
}

fn unresolved_include(seed: &mut Seed) -> Option<()> {
    let random = seed.random.below(1 << 16);
    let mut includes: Vec<&mut String> =
        seed.model.files.iter_mut().flat_map(|it| it.includes.iter_mut()).collect();
    let at = random % includes.len();
    *includes.swap_remove(at) = marked("\"nowhere/to_be_found.mal\"");
    Some(())
}

fn unresolved_instance(seed: &mut Seed) -> Option<()> {
    match seed.random.below(3) {
        0 => {
            let fields =
                vec![("priority".to_owned(), "1".to_owned()), ("period".to_owned(), "900".to_owned())];
            seed.deployment()?.activities.push(Activity { instance: marked(NOBODY), fields });
        }
        1 => {
            let settings = &mut seed.deployment()?.settings;
            let setting = settings.last()?.clone();
            settings.push(Setting { instance: marked(NOBODY), ..setting });
        }
        _ => {
            let connection = seed.architectures().into_iter().find_map(|it| it.connections.first_mut())?;
            connection.source.0 = marked(NOBODY);
        }
    }
    Some(())
}

fn unresolved_operation(seed: &mut Seed) -> Option<()> {
    let site = seed.core(|core| !core.handlers.is_empty())?;
    seed.core_at(site)?.handlers[0].1 = marked(NOBODY);
    Some(())
}

fn unresolved_state(seed: &mut Seed) -> Option<()> {
    let site = seed.core(|core| !core.machines.is_empty())?;
    let (state, transition) = (seed.random.below(9), seed.random.below(9));
    let states = &mut seed.core_at(site)?.machines[0].states;
    let count = states.len();
    let transitions = &mut states[state % count].transitions;
    let count = transitions.len();
    transitions[transition % count].target = marked(NOBODY);
    Some(())
}

fn unresolved_variable(seed: &mut Seed) -> Option<()> {
    let is_value = |it: &Expr| !matches!(it.ty.as_str(), "port" | "operation" | "handler");
    let expr = seed.expr(|it| matches!(it.form, Form::Name(_)) && is_value(it))?;
    expr.form = Form::Name(marked(NOBODY));
    Some(())
}

// Definitions.

fn duplicate_definition(seed: &mut Seed) -> Option<()> {
    match seed.random.below(9) {
        0 => {
            let site = seed.site(|it| matches!(it, Declaration::Codel(_)))?;
            let Declaration::Codel(mut codel) = seed.at(site).clone() else { return None };
            codel.name = marked(&codel.name);
            seed.beside(site).push(Declaration::Codel(codel));
        }
        1 => {
            let site = seed.site(|it| matches!(it, Declaration::Shell(shell) if !shell.ports.is_empty()))?;
            let Declaration::Shell(shell) = seed.at(site) else { return None };
            let mut port = shell.ports[0].clone();
            port.name = marked(&port.name);
            shell.ports.push(port);
        }
        2 => {
            let site = seed.core(|core| !core.variables.is_empty())?;
            let variables = &mut seed.core_at(site)?.variables;
            let mut variable = variables[0].clone();
            variable.name = marked(&variable.name);
            variables.push(variable);
        }
        3 => {
            let site = seed.core(|core| core.machines.iter().any(|it| !it.variables.is_empty()))?;
            let variables = &mut seed.core_at(site)?.machines[0].variables;
            let mut variable = variables[0].clone();
            variable.name = marked(&variable.name);
            variables.push(variable);
        }
        4 => {
            let site = seed.core(|core| !core.machines.is_empty())?;
            let states = &mut seed.core_at(site)?.machines[0].states;
            let mut state = states[0].clone();
            state.name = marked(&state.name);
            state.is_initial = false;
            states.push(state);
        }
        5 => {
            let site = seed.core(|core| !core.machines.is_empty())?;
            let transitions = &mut seed.core_at(site)?.machines[0].states[0].transitions;
            let mut transition = transitions[0].clone();
            transition.name = marked(&transition.name);
            // Before that which always fires.
            let last = transitions.len() - usize::from(transitions[transitions.len() - 1].guard.is_none());
            if last == 0 {
                return None;
            }
            transitions.insert(last, transition);
        }
        6 => {
            let architecture = seed.architectures().into_iter().next_back()?;
            let mut instance = architecture.instances.first()?.clone();
            instance.0 = marked(&instance.0);
            architecture.instances.push(instance);
        }
        7 => {
            let site = seed.core(|core| !core.operations.is_empty())?;
            let operations = &mut seed.core_at(site)?.operations;
            let mut operation = operations[0].clone();
            operation.signature.name = marked(&operation.signature.name);
            operations.push(operation);
        }
        _ => {
            let settings = &mut seed.deployment()?.settings;
            let mut setting = settings.first()?.clone();
            setting.feature = marked(&setting.feature);
            settings.push(setting);
        }
    }
    Some(())
}

fn duplicate_hook(seed: &mut Seed) -> Option<()> {
    let site = seed.core(|core| !core.hooks.is_empty() || !core.machines.is_empty())?;
    let core = seed.core_at(site)?;
    let programs = match core.machines.first_mut() {
        Some(machine) => &mut machine.states[0].methods,
        None => &mut core.hooks,
    };
    let first = programs.first()?.keyword.clone();
    programs.push(Program { keyword: marked(&first), body: Block::new() });
    Some(())
}

fn inheritance_cycle(seed: &mut Seed) -> Option<()> {
    let with_own_base = |it: &Declaration| matches!(it, Declaration::Shell(shell) if shell.bases.last().is_some_and(|it| !it.ends_with("Base") || it != "common.Base" && it != "Base"));
    if seed.coin() {
        let site = seed.site(|it| matches!(it, Declaration::Shell(_)))?;
        let Declaration::Shell(shell) = seed.at(site) else { return None };
        shell.bases.push(shell.name.clone());
        shell.name = marked(&shell.name);
    } else {
        let site = seed.site(with_own_base)?;
        let library = seed.library_at(site);
        let Declaration::Shell(shell) = seed.at(site) else { return None };
        let (name, base) = (shell.name.clone(), shell.bases.last()?.clone());
        shell.name = marked(&name);
        let of_library = seed.model.files.iter_mut().flat_map(|it| &mut it.libraries);
        let all = of_library.filter(|(it, _)| *it == library).flat_map(|(_, all)| all);
        for declaration in all {
            if let Declaration::Shell(shell) = declaration
                && shell.name == base
            {
                shell.bases.push(name.clone());
                shell.name = marked(&base);
            }
        }
    }
    Some(())
}

fn import_cycle(seed: &mut Seed) -> Option<()> {
    let mut architectures = seed.architectures();
    let last = architectures.len() - 1;
    let name = architectures[last].name.clone();
    architectures[0].imports.push(marked(&name));
    if last > 0 {
        let import = architectures[last].imports.first_mut()?;
        *import = marked(import);
    }
    Some(())
}

fn initial_state(seed: &mut Seed) -> Option<()> {
    if seed.coin() {
        let site = seed.core(|core| !core.machines.is_empty())?;
        let machine = &mut seed.core_at(site)?.machines[0];
        machine.states[0].is_initial = false;
        machine.keyword = marked(&machine.keyword);
    } else {
        let site = seed.core(|core| core.machines.iter().any(|it| it.states.len() > 1))?;
        let state = seed.core_at(site)?.machines[0].states.last_mut()?;
        state.is_initial = true;
        state.name = marked(&state.name);
    }
    Some(())
}

fn update_or_statemachine(seed: &mut Seed) -> Option<()> {
    let site = seed.core(|_| true)?;
    if seed.coin() {
        let core = seed.core_at(site)?;
        core.name = marked(&core.name);
        core.machines.clear();
        core.hooks.retain(|it| it.keyword != "update");
    } else {
        let core = seed.core_at(site)?;
        if core.machines.is_empty() {
            let state = State { is_initial: true, name: "Only".to_owned(), ..State::default() };
            core.machines.push(Machine {
                keyword: marked("statemachine"),
                variables: Vec::new(),
                states: vec![state],
            });
        } else {
            let machine = &mut core.machines[0];
            machine.keyword = marked(&machine.keyword);
            core.hooks.push(Program { keyword: "update".to_owned(), body: Block::new() });
        }
    }
    Some(())
}

fn wrong_shell(seed: &mut Seed) -> Option<()> {
    let site = seed.site(|it| matches!(it, Declaration::Component(..)))?;
    let body = Block::new();
    let hooks = vec![Program { keyword: "update".to_owned(), body }];
    let core = Core { name: "Stray".to_owned(), shell: "StrayShell".to_owned(), hooks, ..Core::default() };
    let Declaration::Component(_, _, of) = seed.at(site) else { return None };
    *of = marked("Stray");
    let shell = Shell { name: "StrayShell".to_owned(), ..Shell::default() };
    seed.beside(site).extend([Declaration::Shell(shell), Declaration::Core(core)]);
    Some(())
}

// Operations.

fn undeclared_operation(seed: &mut Seed) -> Option<()> {
    let site = seed.core(|_| true)?;
    let signature = Signature { name: marked(NOBODY), parameters: Vec::new(), result: "void".to_owned() };
    seed.core_at(site)?.operations.push(Operation { signature, body: Block::new() });
    Some(())
}

fn undefined_operation(seed: &mut Seed) -> Option<()> {
    let site = seed.core(|core| !core.operations.is_empty())?;
    let core = seed.core_at(site)?;
    core.name = marked(&core.name);
    core.operations.pop();
    Some(())
}

fn recursive_operation(seed: &mut Seed) -> Option<()> {
    let site = seed.core(|core| !core.operations.is_empty())?;
    let Operation { signature, body } = seed.core_at(site)?.operations.last_mut()?;
    let arguments = signature.parameters.iter().map(|it| name_of(&it.name)).collect();
    body.insert(0, call(&signature.name, arguments));
    signature.name = marked(&signature.name);
    Some(())
}

fn operation_definition(seed: &mut Seed) -> Option<()> {
    // A call of it has the arguments that it says.
    let is_called = |core: &Core, name: &str| {
        let mut core = core.clone();
        let mut found = Vec::new();
        exprs_of_core(
            &mut core,
            &|it| matches!(&it.form, Form::Call(callee, _) if callee == name),
            &mut found,
        );
        !found.is_empty()
    };
    let site = seed.core(|core| core.operations.iter().any(|it| !is_called(core, &it.signature.name)))?;
    let core = seed.core_at(site)?;
    let of = core.clone();
    let operation = core.operations.iter_mut().find(|it| !is_called(&of, &it.signature.name))?;
    let signature = &mut operation.signature;
    signature.parameters.push(Parameter { direction: "in ", name: NOBODY.to_owned(), ty: "int".to_owned() });
    signature.name = marked(&signature.name);
    Some(())
}

fn blocking_call(seed: &mut Seed) -> Option<()> {
    let fits = |_: &Core, shell: &Shell| {
        shell.required.iter().any(|it| it.parameters.iter().all(|it| value_of(&it.ty).is_some()))
    };
    let (site, shell) = seed.core_and_shell(fits)?;
    let required =
        shell.required.iter().find(|it| it.parameters.iter().all(|it| value_of(&it.ty).is_some()))?;
    let (mut statements, arguments) = seed.call_of(required)?;
    statements.push(call(&marked(&required.name), arguments));
    seed.insert(site, vec![Statement::Block(statements)])
}

fn operation_signature(seed: &mut Seed) -> Option<()> {
    // Who serves it is background before and after.
    let instances = seed.instances();
    let mut links: Vec<(String, String, (String, String))> = Vec::new();
    for link in seed.architectures().into_iter().flat_map(|it| it.operations.clone()) {
        let (_, shell) = instances.iter().find(|(name, _)| *name == link.source.0)?;
        let now = shell.provided.iter().find(|it| it.name == link.source.1)?;
        let differs = |it: &&Signature| {
            it.parameters.len() != now.parameters.len() || plain(&it.result) != plain(&now.result)
        };
        let other = shell.provided.iter().find(differs);
        links.extend(other.map(|other| (link.source.0.clone(), other.name.clone(), link.target.clone())));
    }
    let (instance, operation, target) = seed.of(links)?;
    for link in seed.architectures().into_iter().flat_map(|it| &mut it.operations) {
        if link.target == target {
            link.source = (instance.clone(), operation.clone());
            link.target.1 = marked(&target.1);
        }
    }
    Some(())
}

// Types.

fn argument_count(seed: &mut Seed) -> Option<()> {
    // `collect` may leave out its variables.
    let fits =
        |it: &Expr| matches!(&it.form, Form::Call(callee, all) if callee != "collect" || all.len() > 1);
    let takes_away = seed.coin();
    let expr = seed.expr(fits)?;
    let Form::Call(callee, arguments) = &mut expr.form else { return None };
    let last_is_value = arguments.last().is_some_and(|it| is_pure(it) && !matches!(it.form, Form::Name(_)));
    if takes_away && last_is_value {
        arguments.pop();
    } else {
        arguments.push(Expr::literal("int", "3"));
    }
    *callee = marked(callee);
    Some(())
}

fn argument_type(seed: &mut Seed) -> Option<()> {
    if seed.coin() {
        let (site, codel, mut statements, mut arguments) =
            seed.callable(|it| it.parameters.iter().any(|it| it.direction == "out "))?;
        let at = codel.parameters.iter().position(|it| it.direction == "out ")?;
        let name = arguments[at].to_string();
        for statement in &mut statements {
            if let Statement::Variable(variable) = statement
                && variable.name == name
            {
                variable.ty =
                    if plain(&variable.ty) == "bool" { "string".to_owned() } else { "bool".to_owned() };
            }
        }
        arguments[at] = arguments[at].marked();
        statements.push(call(&codel.name, arguments));
        return seed.insert(site, vec![Statement::Block(statements)]);
    }
    let is_input = |it: &Expr| is_pure(it) && !matches!(it.form, Form::Name(_)) && !it.ty.is_empty();
    let is_of_codel = |callee: &str| !is_built_in(callee) || callee == "send";
    let fits = |it: &Expr| matches!(&it.form, Form::Call(callee, all) if is_of_codel(callee) && all.iter().any(is_input));
    let Form::Call(_, arguments) = &mut seed.expr(fits)?.form else { return None };
    let argument = arguments.iter_mut().find(|it| is_input(it))?;
    *argument = wrong_value(&argument.ty).marked();
    Some(())
}

fn out_argument(seed: &mut Seed) -> Option<()> {
    let is_output = |it: &Parameter| matches!(it.direction, "out " | "inout ");
    let (site, codel, mut statements, mut arguments) =
        seed.callable(|it| it.parameters.iter().any(is_output))?;
    let at = codel.parameters.iter().position(is_output)?;
    arguments[at] = value_of(&codel.parameters[at].ty).unwrap_or_else(|| Expr::literal("", "3")).marked();
    statements.push(call(&codel.name, arguments));
    seed.insert(site, vec![Statement::Block(statements)])
}

fn assignment_type(seed: &mut Seed) -> Option<()> {
    match seed.random.below(5) {
        0 => {
            let ty = *seed.random.of(&["int", "double", "bool", "string", "uint8"]);
            let value = Some(wrong_value(ty).marked());
            seed.insert_anywhere(vec![variable(NOBODY, ty, value)])
        }
        1 => {
            let ty = *seed.random.of(&["int", "double", "bool", "string"]);
            let statements = vec![
                variable(NOBODY, ty, value_of(ty)),
                Statement::Assign(NOBODY.to_owned(), wrong_value(ty).marked()),
            ];
            seed.insert_anywhere(statements)
        }
        2 => {
            let is_write = |it: &Expr| matches!(&it.form, Form::Call(callee, all) if callee == "write" && is_pure(&all[1]));
            let Form::Call(_, arguments) = &mut seed.expr(is_write)?.form else { return None };
            arguments[1] = wrong_value(&arguments[1].ty.clone()).marked();
            Some(())
        }
        3 => {
            let is = |it: &Declaration| matches!(it, Declaration::Shell(it) if it.values.iter().any(|it| it.value.is_some()));
            let site = seed.site(is)?;
            let Declaration::Shell(shell) = seed.at(site) else { return None };
            let value = shell.values.iter_mut().rfind(|it| it.value.is_some())?;
            value.value = Some(wrong_value(&value.ty).marked());
            Some(())
        }
        _ => {
            let instances = seed.instances();
            let setting = seed.deployment()?.settings.first_mut()?;
            let (_, shell) = instances.iter().find(|(name, _)| *name == setting.instance)?;
            let value = shell.values.iter().find(|it| it.name == setting.feature)?;
            setting.value = wrong_value(&value.ty).marked();
            Some(())
        }
    }
}

fn return_type(seed: &mut Seed) -> Option<()> {
    match seed.random.below(4) {
        // A value where there is none to give.
        0 => {
            let site = seed.core(|_| true)?;
            let core = seed.core_at(site)?;
            let program =
                core.hooks.iter_mut().find(|it| matches!(it.keyword.as_str(), "update" | "stop" | "cleanup"));
            let methods =
                core.machines.iter_mut().flat_map(|it| &mut it.states).flat_map(|it| &mut it.methods);
            let program = program.or(methods.last())?;
            program
                .body
                .push(Statement::Return("return".to_owned(), Some(Expr::literal("int", "3").marked())));
        }
        1 => {
            let site = seed.core(|_| true)?;
            let core = seed.core_at(site)?;
            let program =
                core.hooks.iter_mut().find(|it| matches!(it.keyword.as_str(), "configure" | "start"))?;
            let Statement::Return(keyword, value) = program.body.last_mut()? else { return None };
            if !value.as_ref().is_some_and(is_pure) {
                return None;
            }
            (*keyword, *value) = (marked("return"), None);
        }
        2 => {
            let site = seed.core(|core| !core.operations.is_empty())?;
            let operation = seed.core_at(site)?.operations.last_mut()?;
            let ty = operation.signature.result.clone();
            let Statement::Return(_, value) = operation.body.last_mut()? else { return None };
            if !value.as_ref().is_some_and(is_pure) {
                return None;
            }
            *value = Some(wrong_value(&ty).marked());
        }
        _ => {
            let site = seed.core(|core| !core.operations.is_empty())?;
            let operation = seed.core_at(site)?.operations.last_mut()?;
            if matches!(operation.signature.result.as_str(), "void" | "") {
                return None;
            }
            operation.body.pop();
            operation.signature.name = marked(&operation.signature.name);
        }
    }
    Some(())
}

fn condition_type(seed: &mut Seed) -> Option<()> {
    let condition = Expr::literal("", *seed.random.of(&["1", "\"yes\"", "new_data", "2.5 + 1"])).marked();
    if seed.coin() {
        let site = seed.core(|core| !core.machines.is_empty())?;
        let states = &mut seed.core_at(site)?.machines[0].states;
        let mut transitions = states.iter_mut().flat_map(|it| &mut it.transitions);
        let guard = transitions.find_map(|it| it.guard.as_mut().filter(|it| is_pure(it)))?;
        *guard = condition;
        Some(())
    } else {
        seed.insert_anywhere(vec![Statement::If(condition, Block::new(), Some(Block::new()))])
    }
}

fn operator_type(seed: &mut Seed) -> Option<()> {
    if seed.coin() {
        let text = *seed.random.of(&[
            "1 + true",
            "\"a\" - \"b\"",
            "!1",
            "-\"a\"",
            "1.5 % 2",
            "\"a\" < \"b\"",
            "true && 1",
            "new_data == success",
            "true == 1",
        ]);
        let is_bool = ["<", "==", "&&", "!"].iter().any(|it| text.contains(it));
        let is_string = text.starts_with(['"', '-']);
        let ty = if is_bool {
            "bool"
        } else if is_string {
            "string"
        } else {
            "double"
        };
        let value = Some(Expr::literal("", text).marked());
        return seed.insert_anywhere(vec![variable(NOBODY, ty, value)]);
    }
    let fits = |it: &Expr| matches!(&it.form, Form::Binary(_, _, right) if is_pure(right));
    let expr = seed.expr(fits)?;
    let Form::Binary(_, _, right) = &mut expr.form else { return None };
    **right = match right.ty.as_str() {
        "bool" => Expr::literal("int", "3"),
        "status" => Expr::literal("call", "success"),
        "call" => Expr::literal("status", "new_data"),
        _ => Expr::literal("bool", "true"),
    };
    // The brackets keep the order of what is around it.
    let inner = Box::new(expr.marked());
    expr.form = Form::Parens(inner);
    Some(())
}

fn invalid_type(seed: &mut Seed) -> Option<()> {
    let void = marked("void");
    match seed.random.below(4) {
        0 => seed.insert_anywhere(vec![variable(NOBODY, &void, None)]),
        1 => {
            let site = seed.site(|it| matches!(it, Declaration::Shell(_)))?;
            let is_input = seed.coin();
            let Declaration::Shell(shell) = seed.at(site) else { return None };
            shell.ports.push(Port { is_input, name: NOBODY.to_owned(), ty: void });
            Some(())
        }
        2 => {
            let site = seed.site(|it| matches!(it, Declaration::Codel(_)))?;
            let parameters = vec![Parameter { direction: "in ", name: "nothing".to_owned(), ty: void }];
            let codel = Signature { name: NOBODY.to_owned(), parameters, result: "int".to_owned() };
            seed.beside(site).push(Declaration::Codel(codel));
            Some(())
        }
        _ => {
            let is_text = |it: &Value| matches!(it.ty.as_str(), "string" | "bool");
            let site =
                seed.site(|it| matches!(it, Declaration::Shell(it) if it.values.iter().any(is_text)))?;
            let Declaration::Shell(shell) = seed.at(site) else { return None };
            let value = shell.values.iter_mut().find(|it| is_text(it))?;
            value.ty = marked(&value.ty);
            value.interval = Some("[0; 1]".to_owned());
            Some(())
        }
    }
}

fn no_effect(seed: &mut Seed) -> Option<()> {
    let text = *seed.random.of(&["3", "\"text\"", "true", "new_data"]);
    seed.insert_anywhere(vec![Statement::Expr(Expr::literal("", text).marked())])
}

fn not_assignable(seed: &mut Seed) -> Option<()> {
    let of = |shell: &Shell| -> Vec<(String, String)> {
        let values = shell.values.iter().map(|it| (it.name.clone(), it.ty.clone()));
        let ports = shell.ports.iter().map(|it| (it.name.clone(), it.ty.clone()));
        values.chain(ports).filter(|(_, ty)| value_of(ty).is_some()).collect()
    };
    let (site, shell) = seed.core_and_shell(|_, shell| !of(shell).is_empty())?;
    let (name, ty) = seed.of(of(&shell))?;
    // In a program of which the parameters have other names.
    let core = seed.core_at(site)?;
    core.operations.retain(|it| !it.signature.parameters.iter().any(|it| it.name == name));
    let has_all = core.operations.len() == shell.provided.len();
    if !has_all {
        return None;
    }
    seed.insert(site, vec![Statement::Assign(marked(&name), value_of(&ty)?)])
}

fn port_direction(seed: &mut Seed) -> Option<()> {
    let of = |shell: &Shell| -> Vec<Port> {
        shell.ports.iter().filter(|it| value_of(&it.ty).is_some()).cloned().collect()
    };
    let (site, shell) = seed.core_and_shell(|_, shell| !of(shell).is_empty())?;
    let port = seed.of(of(&shell))?;
    let name = name_of(&marked(&port.name));
    let statements = match port.is_input {
        true => vec![call("write", vec![name, value_of(&port.ty)?])],
        false if seed.coin() => {
            vec![variable(NOBODY, &port.ty, value_of(&port.ty)), call("read", vec![name, name_of(NOBODY)])]
        }
        false => vec![call("status", vec![name])],
    };
    seed.insert(site, statements)
}

// Values.

fn constant_expression(seed: &mut Seed) -> Option<()> {
    let (text, before) = *seed.random.of(&[
        ("1 / 0", ""),
        ("2147483647 + 1", ""),
        ("2147483648", ""),
        (NOBODY, "1 + "),
        ("7 % (3 - 3)", ""),
        ("0x80000000", ""),
    ]);
    let value = Expr::literal("int", format!("{before}{}", marked(text)));
    if seed.coin() {
        let is = |it: &Value| it.ty == "int" && it.value.is_some();
        let site = seed.site(|it| matches!(it, Declaration::Shell(it) if it.values.iter().any(is)))?;
        let Declaration::Shell(shell) = seed.at(site) else { return None };
        shell.values.iter_mut().find(|it| is(it))?.value = Some(value);
    } else {
        let instances = seed.instances();
        let is_int = |it: &&mut Setting| {
            let (_, shell) = instances.iter().find(|(name, _)| *name == it.instance)?;
            shell.values.iter().find(|of| of.name == it.feature && of.ty == "int")
        };
        seed.deployment()?.settings.iter_mut().find(|it| is_int(it).is_some())?.value = value;
    }
    Some(())
}

fn outside_interval(seed: &mut Seed) -> Option<()> {
    let value = |ty: &str| Expr::literal(ty, marked(if ty == "double" { "1e6" } else { "200" }));
    if seed.coin() {
        let is = |it: &Value| it.bounds.is_some() && it.value.is_some();
        let site = seed.site(|it| matches!(it, Declaration::Shell(it) if it.values.iter().any(is)))?;
        let Declaration::Shell(shell) = seed.at(site) else { return None };
        let of = shell.values.iter_mut().find(|it| is(it))?;
        of.value = Some(value(&of.ty));
    } else {
        let instances = seed.instances();
        for setting in &mut seed.deployment()?.settings {
            let (_, shell) = instances.iter().find(|(name, _)| *name == setting.instance)?;
            let of = shell.values.iter().find(|of| of.name == setting.feature)?;
            if of.bounds.is_some() {
                setting.value = value(&of.ty);
                return Some(());
            }
        }
        return None;
    }
    Some(())
}

fn empty_interval(seed: &mut Seed) -> Option<()> {
    let is = |it: &Value| matches!(it.ty.as_str(), "int" | "double");
    let site = seed.site(|it| matches!(it, Declaration::Shell(it) if it.values.iter().any(is)))?;
    let Declaration::Shell(shell) = seed.at(site) else { return None };
    shell.values.iter_mut().find(|it| is(it))?.interval = Some(marked("[9; 3]"));
    Some(())
}

fn missing_value(seed: &mut Seed) -> Option<()> {
    let instances = seed.instances();
    let is_needed = |it: &Setting| {
        let (_, shell) = instances.iter().find(|(name, _)| *name == it.instance)?;
        shell.values.iter().find(|of| of.name == it.feature && of.value.is_none())
    };
    let settings = &mut seed.deployment()?.settings;
    let at = settings.iter().position(|it| is_needed(it).is_some())?;
    let instance = settings.remove(at).instance;
    let activity = seed.deployment()?.activities.iter_mut().find(|it| it.instance == instance)?;
    activity.instance = marked(&instance);
    Some(())
}

// Architectures.

fn buffer_size(seed: &mut Seed) -> Option<()> {
    let connection = seed.architectures().into_iter().find_map(|it| it.connections.last_mut())?;
    connection.buffer = Some(marked("0"));
    Some(())
}

fn connection_direction(seed: &mut Seed) -> Option<()> {
    let of_ports = seed.coin();
    for architecture in seed.architectures() {
        let links = if of_ports { &mut architecture.connections } else { &mut architecture.operations };
        if let Some(link) = links.first_mut() {
            std::mem::swap(&mut link.source, &mut link.target);
            link.source.1 = marked(&link.source.1);
            return Some(());
        }
    }
    None
}

/// The inputs of all instances that nothing is connected to, with their types.
fn open_inputs(seed: &mut Seed) -> Vec<(String, Port)> {
    let instances = seed.instances();
    let connected: HashSet<(String, String)> = seed
        .architectures()
        .into_iter()
        .flat_map(|it| it.connections.iter().map(|it| it.target.clone()).collect::<Vec<_>>())
        .collect();
    let all = instances.iter().flat_map(|(name, shell)| {
        shell.ports.iter().filter(|it| it.is_input).map(|it| (name.clone(), it.clone()))
    });
    all.filter(|(name, port)| !connected.contains(&(name.clone(), port.name.clone()))).collect()
}

fn connection_type(seed: &mut Seed) -> Option<()> {
    let open = open_inputs(seed);
    let (target, input) = seed.of(open)?;
    let outputs = seed.instances().into_iter().flat_map(|(name, shell)| {
        let outputs = shell.ports.into_iter().filter(|it| !it.is_input);
        outputs.map(move |it| (name.clone(), it)).collect::<Vec<_>>()
    });
    let outputs = outputs.filter(|(_, it)| plain(&it.ty) != plain(&input.ty)).collect();
    let (source, output) = seed.of(outputs)?;
    let link = Link { source: (source, output.name), buffer: None, target: (target, marked(&input.name)) };
    seed.architectures().pop()?.connections.push(link);
    Some(())
}

fn two_writers(seed: &mut Seed) -> Option<()> {
    let all: Vec<Link> = seed.architectures().into_iter().flat_map(|it| it.connections.clone()).collect();
    let mut link = seed.of(all)?;
    link.target.1 = marked(&link.target.1);
    seed.architectures().pop()?.connections.push(link);
    Some(())
}

// Deployments.

fn deployment_target(seed: &mut Seed) -> Option<()> {
    let second = seed.coin();
    let deployment = seed.deployment()?;
    if second {
        let target = marked(&deployment.targets[0]);
        deployment.targets.push(target);
    } else {
        deployment.targets.clear();
        deployment.name = marked(&deployment.name);
    }
    Some(())
}

/// A random activity, real-time where that is asked for.
fn activity(seed: &mut Seed, real_time: bool) -> Option<&mut Activity> {
    let random = seed.random.below(1 << 16);
    let is = |it: &&mut Activity| !real_time || it.fields.iter().all(|it| it.1 != "background");
    let mut all: Vec<&mut Activity> = seed.deployment()?.activities.iter_mut().filter(is).collect();
    if all.is_empty() { None } else { Some(all.swap_remove(random % all.len())) }
}

fn duplicate_activity(seed: &mut Seed) -> Option<()> {
    let mut second = activity(seed, false)?.clone();
    second.instance = marked(&second.instance);
    seed.deployment()?.activities.push(second);
    Some(())
}

fn missing_activity(seed: &mut Seed) -> Option<()> {
    let deployment = seed.deployment()?;
    deployment.activities.pop();
    deployment.name = marked(&deployment.name);
    Some(())
}

fn missing_field(seed: &mut Seed) -> Option<()> {
    let name = *seed.random.of(&["priority", "period"]);
    let activity = activity(seed, true)?;
    activity.fields.retain(|it| it.0 != name);
    activity.instance = marked(&activity.instance);
    if name == "period" {
        activity.fields.retain(|it| it.0 != "deadline");
    }
    Some(())
}

fn unknown_field(seed: &mut Seed) -> Option<()> {
    activity(seed, false)?.fields.push((marked("colour"), "3".to_owned()));
    Some(())
}

fn duplicate_field(seed: &mut Seed) -> Option<()> {
    let activity = activity(seed, false)?;
    let (name, value) = activity.fields[0].clone();
    activity.fields.push((marked(&name), value));
    Some(())
}

fn invalid_field(seed: &mut Seed) -> Option<()> {
    let values = [
        ("priority", "100"),
        ("priority", "0"),
        ("priority", "high"),
        ("period", "0"),
        ("period", "\"soon\""),
        ("affinity", "1.5"),
        ("affinity", "0x40000"),
        ("affinity", "[1]"),
        ("cpus", "[0]"),
        ("cpus", "big"),
    ];
    let (name, value) = *seed.random.of(&values);
    let activity = activity(seed, true)?;
    activity.fields.retain(|it| it.0 != name && (name != "cpus" || it.0 != "affinity"));
    activity.fields.push((name.to_owned(), marked(value)));
    Some(())
}

fn conflicting_fields(seed: &mut Seed) -> Option<()> {
    let (with, without) = *seed.random.of(&[
        (["affinity = 1", "cpus = [1]"], ""),
        (["period = 20", "rate = 30 Hz"], ""),
        (["rate = 30 Hz", "period = 20"], ""),
        (["burst = 2", ""], "trigger"),
        (["least = 2", ""], "period"),
    ]);
    let activity = activity(seed, true)?;
    let fields = with.iter().filter_map(|it| it.split_once(" = "));
    let fields: Vec<(String, String)> =
        fields.map(|(name, value)| (name.to_owned(), value.to_owned())).collect();
    activity.fields.retain(|it| it.0 != without && fields.iter().all(|field| field.0 != it.0));
    activity.fields.extend(fields);
    let last = activity.fields.last_mut()?;
    last.0 = marked(&last.0);
    Some(())
}

/// Data releases an activity, at a port whose connection is missing.
fn never_triggered(seed: &mut Seed) -> Option<()> {
    let all: Vec<Link> = seed.architectures().into_iter().flat_map(|it| it.connections.clone()).collect();
    let Link { target: (instance, port), .. } = seed.of(all)?;
    let is_it = |it: &Link| it.target.0 == instance && it.target.1 == port;
    let activity = seed.deployment()?.activities.iter_mut().find(|it| it.instance == instance)?;
    activity.fields.retain(|it| !matches!(it.0.as_str(), "offset" | "rate"));
    activity.fields.iter_mut().find(|it| it.0 == "period")?.0 = "least".to_owned();
    activity.fields.push(("trigger".to_owned(), marked(&port)));
    seed.architectures().into_iter().for_each(|it| it.connections.retain(|it| !is_it(it)));
    Some(())
}

fn deadline_missed(seed: &mut Seed) -> Option<()> {
    // The least urgent of all delays nobody but itself.
    let priority = |it: &Activity| it.fields.iter().find(|it| it.0 == "priority")?.1.parse::<u32>().ok();
    let all = seed.deployment()?.activities.clone();
    let least =
        all.iter().filter(|it| priority(it).is_some()).min_by_key(|it| priority(it))?.instance.clone();
    let instances: Vec<(String, String)> =
        seed.architectures().into_iter().flat_map(|it| it.instances.clone()).collect();
    let (_, component) = instances.iter().find(|it| it.0 == least)?.clone();
    if instances.iter().filter(|it| it.1 == component).count() > 1 {
        return None;
    }
    let (library, name) = component.split_once('.')?;
    let core = seed.in_library(Some(library)).into_iter().find_map(|it| match it {
        Declaration::Core(core) if core.name == format!("{name}Core") => Some(core),
        _ => None,
    })?;
    let key = match core.machines.first() {
        Some(machine) => format!("\"{component}/{}.run\"", machine.states.first()?.name),
        None => format!("\"{component}/update\""),
    };
    let sections = &mut seed.model.tomls.last_mut()?.sections;
    sections.retain(|(header, _)| header != "program");
    let enormous = vec![(key, "7000000".to_owned())];
    sections.push(("program".to_owned(), enormous));
    let activity = seed.deployment()?.activities.iter_mut().find(|it| it.instance == least)?;
    activity.instance = marked(&least);
    Some(())
}

// Configuration and tables.

fn section<'a>(toml: &'a mut Toml, header: &str) -> &'a mut Vec<(String, String)> {
    let at = toml.sections.iter().position(|it| it.0 == header).unwrap_or_else(|| {
        toml.sections.push((header.to_owned(), Vec::new()));
        toml.sections.len() - 1
    });
    &mut toml.sections[at].1
}

fn invalid_configuration(seed: &mut Seed) -> Option<()> {
    let kind = seed.random.below(4);
    let config = &mut seed.model.tomls[0];
    match kind {
        0 => section(config, "platform").push((marked("colour"), "3".to_owned())),
        1 => section(config, "assume").push(("codel".to_owned(), marked("5"))),
        2 => section(config, "lints").push(("lost-write".to_owned(), marked("\"never\""))),
        _ => config.sections.push((marked("colours"), vec![("red".to_owned(), "1".to_owned())])),
    }
    Some(())
}

fn invalid_table(seed: &mut Seed) -> Option<()> {
    let table = seed.model.tomls.last_mut()?;
    let entry = section(table, "codel").last_mut()?;
    entry.1 = marked("[1, 2, 3]");
    Some(())
}

fn unknown_timing_key(seed: &mut Seed) -> Option<()> {
    let table = seed.model.tomls.last_mut()?;
    section(table, "codel").push((marked("quxquux"), "1".to_owned()));
    Some(())
}

/// Adds a file with what was observed of the codel of the last entry, whose key is returned.
fn observe(seed: &mut Seed, header: impl Fn(&str) -> String, entries: &[(&str, &str)]) -> Option<String> {
    let key = section(seed.model.tomls.last_mut()?, "codel").last()?.0.clone();
    let entries = entries.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    let observed = Toml { path: "/robot.observed.toml".to_owned(), sections: vec![(header(&key), entries)] };
    section(&mut seed.model.tomls[0], "timing")
        .push(("observed".to_owned(), "\"robot.observed.toml\"".to_owned()));
    seed.model.tomls.insert(1, observed);
    Some(key)
}

/// Marks the last entry of the last table, which has one time for every level.
fn mark_time(seed: &mut Seed, key: &str) -> Option<()> {
    let entry = section(seed.model.tomls.last_mut()?, "codel").last_mut()?;
    *entry = (marked(key), "1".to_owned());
    Some(())
}

fn refuted_time(seed: &mut Seed) -> Option<()> {
    let key = observe(seed, |key| format!("codel.{key}"), &[("executions", "9"), ("greatest", "7000000")])?;
    mark_time(seed, &key)
}

fn waiting_codel(seed: &mut Seed) -> Option<()> {
    let times = [("executions", "9"), ("greatest", "0"), ("wait", "8.1")];
    let key = observe(seed, |key| format!("codel.{key}"), &times)?;
    mark_time(seed, &key)
}

fn undeclared_lock(seed: &mut Seed) -> Option<()> {
    let header = |key: &str| format!("lock.bus.{}", marked(key));
    observe(seed, header, &[("executions", "9"), ("held", "0.1")]).map(drop)
}

fn work_elsewhere(seed: &mut Seed) -> Option<()> {
    observe(seed, |_| format!("work.{}", marked("pool")), &[("per_second", "45")]).map(drop)
}

// Text that is no model.

fn syntax_error(seed: &mut Seed) -> Option<()> {
    let kind = seed.random.below(4);
    match kind {
        0 => seed.insert_anywhere(vec![
            variable(NOBODY, "int", value_of("int")),
            Statement::Assign(NOBODY.to_owned(), Expr::literal("", marked("§"))),
        ]),
        1 => {
            let is = |it: &Declaration| matches!(it, Declaration::Shell(_));
            let site = seed.site(is)?;
            let Declaration::Shell(shell) = seed.at(site) else { return None };
            shell.name += &format!(" {}", marked("§"));
            Some(())
        }
        2 => {
            let architecture = seed.architectures().pop()?;
            architecture.instances.last_mut()?.1 += &format!(" {}", marked("?"));
            Some(())
        }
        _ => {
            let activity = activity(seed, false)?;
            activity.fields.push((marked("\"colour\""), "3".to_owned()));
            Some(())
        }
    }
}

// Warnings.

fn unreachable_state(seed: &mut Seed) -> Option<()> {
    let site = seed.core(|core| !core.machines.is_empty())?;
    let states = &mut seed.core_at(site)?.machines[0].states;
    let target = states[0].name.clone();
    let back = Transition { name: "back".to_owned(), guard: None, target, effect: None };
    let state =
        State { is_initial: false, name: marked("Nowhere"), transitions: vec![back], ..State::default() };
    states.push(state);
    Some(())
}

fn never_taken(seed: &mut Seed) -> Option<()> {
    let always = |state: &State| state.transitions.last().is_some_and(|it| it.guard.is_none());
    let site = seed.core(|core| core.machines.iter().flat_map(|it| &it.states).any(always))?;
    let state = seed.core_at(site)?.machines[0].states.iter_mut().find(|it| always(it))?;
    let target = state.name.clone();
    state.transitions.push(Transition { name: marked("never"), guard: None, target, effect: None });
    Some(())
}

fn not_strongly_connected(seed: &mut Seed) -> Option<()> {
    let site = seed.core(|core| !core.machines.is_empty())?;
    let machine = &mut seed.core_at(site)?.machines[0];
    machine.keyword = marked(&machine.keyword);
    let guard = Some(Expr::literal("bool", "1 < 2"));
    let target = "ForGood".to_owned();
    machine.states[0]
        .transitions
        .insert(0, Transition { name: "stop".to_owned(), guard, target, effect: None });
    machine.states.push(State { name: "ForGood".to_owned(), ..State::default() });
    Some(())
}

fn read_before_assignment(seed: &mut Seed) -> Option<()> {
    let value = Some(name_of(&marked(NOBODY)));
    seed.insert_anywhere(vec![variable(NOBODY, "int", None), variable("seeded", "int", value)])
}

fn lost_write(seed: &mut Seed) -> Option<()> {
    let of = |shell: &Shell| -> Vec<Port> {
        shell.ports.iter().filter(|it| !it.is_input && value_of(&it.ty).is_some()).cloned().collect()
    };
    let (site, shell) = seed.core_and_shell(|_, shell| !of(shell).is_empty())?;
    let port = seed.of(of(&shell))?;
    let buffered = |it: &Link| it.source.1 == port.name && it.buffer.is_some();
    if seed.architectures().into_iter().any(|it| it.connections.iter().any(buffered)) {
        return None;
    }
    let core = seed.core_at(site)?;
    // Where it is not written otherwise.
    let mut probe = core.clone();
    let mut writes = Vec::new();
    let writes_it = |it: &Expr| matches!(&it.form, Form::Call(callee, all) if callee == "write" && all[0].to_string() == port.name);
    exprs_of_core(&mut probe, &writes_it, &mut writes);
    if !writes.is_empty() {
        return None;
    }
    let block = periodic(core).pop()?;
    let write = |callee: &str, value: Expr| call(callee, vec![name_of(&port.name), value]);
    let value = value_of(&port.ty)?;
    block.splice(0..0, [write(&marked("write"), value.clone()), write("write", value)]);
    Some(())
}

fn equal_priorities(seed: &mut Seed) -> Option<()> {
    let cpu = |it: &Activity| it.fields.iter().find(|it| it.0 == "affinity").map(|it| it.1.replace("0x", ""));
    let priority = |it: &Activity| it.fields.iter().find(|it| it.0 == "priority")?.1.parse::<u32>().ok();
    let activities = &mut seed.deployment()?.activities;
    for second in 1..activities.len() {
        for first in 0..second {
            let pair = [&activities[first], &activities[second]];
            let (Some(one), Some(other)) = (priority(pair[0]), priority(pair[1])) else { continue };
            // Next to one another, so that no other is between.
            let between =
                |it: &Activity| priority(it).is_some_and(|it| it > one.min(other) && it < one.max(other));
            if cpu(pair[0]) == cpu(pair[1]) && cpu(pair[0]).is_some() && !activities.iter().any(between) {
                let field = activities[second].fields.iter_mut().find(|it| it.0 == "priority")?;
                field.1 = marked(&one.to_string());
                return Some(());
            }
        }
    }
    None
}

fn unconnected_operation(seed: &mut Seed) -> Option<()> {
    let link = seed.architectures().into_iter().find_map(|it| it.operations.pop())?;
    let activity = seed.deployment()?.activities.iter_mut().find(|it| it.instance == link.target.0)?;
    activity.instance = marked(&activity.instance);
    Some(())
}
