//! Checks a rename: all references to the renamed definition are known, and in the changed texts every name refers to the same
//! definition as before.

use std::path::Path;

use mauve_diagnostics::{Diagnostic, render};
use mauve_hir::config_keys::SECTIONS;
use mauve_hir::fact::Fact;
use mauve_hir::item_tree::{Data, Endpoint, Kind, NameRef};
use mauve_hir::{
    Builtin, Database, Decl, Features, File, Location, ModelDb, Project, behaviour_of, config_file,
    config_of, data, declaration_at, declaration_facts, declarations, features_of, flat_of, includes,
    inference_of_core, is_model, line_of, names_of, parse, project_files, projects, shell_of, target_of,
};
use mauve_syntax::{SyntaxKind, TextRange, TextSize, next_significant, tokens_at};
use mauve_timing::table_keys::KEYS;
use mauve_timing::toml_key::key_named;
use mauve_wcrt::table;
use rustc_hash::{FxHashMap, FxHashSet};

use super::{Renaming, shown, text_of};
use crate::change::{Change, FileChange};
use crate::document_symbols::SymbolKind;
use crate::occurrences::{Definition, FoundName, OccurrenceRole, in_toml, is_of_value, names_in};
use crate::project::projects_with;
use crate::references::files_of;

impl<'db> Renaming<'_, 'db> {
    pub(super) fn check_known(&self, all: &[(Project<'db>, FoundName<'db>)]) -> Result<(), String> {
        let (db, old) = (self.db, self.old_name);
        let home = self.home();
        let mut seen: FxHashSet<File> = FxHashSet::default();
        let mut known: FxHashMap<File, FxHashSet<TextRange>> = FxHashMap::default();
        for (_, it) in all {
            known.entry(it.file).or_default().insert(it.range);
        }
        for &project in self.concerned {
            let workspace = project.workspace(db);
            let unreadable = project_files(db, project).iter().find(|&&file| {
                file.problem(db).is_some() || includes(db, workspace, file).iter().any(Option::is_none)
            });
            if let Some(&file) = unreadable.filter(|_| home.is_none()) {
                let why = match file.problem(db) {
                    Some(problem) => problem.message().to_owned(),
                    None => "the file includes a file that is not found".to_owned(),
                };
                return Err(format!("not all uses of `{old}` are known: {}: {why}", shown(db, file)));
            }
            let is_incomplete = names_of(db, project).incomplete_file.is_some()
                || names_of(db, project).completeness.is_incomplete();
            for file in files_of(db, project) {
                db.unwind_if_revision_cancelled();
                // A string with escapes does not contain the word itself.
                let mut escaped = in_toml(db, project, file).escaped.iter();
                if let Some(it) = escaped.find(|it| it.definition == self.thing.definition) {
                    let line = self.line(file, it.range);
                    return Err(format!(
                        "{line}: `{old}` is written with escapes: write it without them first"
                    ));
                }
                if file.text(db).contains(old) && seen.insert(file) {
                    self.check_words(file, known.remove(&file).unwrap_or_default(), is_incomplete)?;
                }
            }
        }
        Ok(())
    }

    /// Checks that for each word in a file that may refer to the definition, it is known whether it does. `known` are the
    /// references.
    fn check_words(
        &self,
        file: File,
        mut known: FxHashSet<TextRange>,
        is_incomplete: bool,
    ) -> Result<(), String> {
        let (db, text) = (self.db, file.text(self.db));
        let is_model = is_model(file.path(db));
        if !is_model && !self.may_have_unknown_names(file, is_incomplete) {
            return Ok(());
        }
        let around = match self.home() {
            Some(home) if is_model && home.file(db) != file => return Ok(()),
            Some(home) if is_model => {
                let name = Location::name_of(home).range(db);
                let maps = &mauve_hir::source_map(db, file).declarations;
                maps.iter().find(|map| map.range.contains_range(name)).map(|map| map.range)
            }
            _ => None,
        };
        let mut all_known = false;
        for (start, word) in text.match_indices(self.old_name) {
            let range = TextRange::at(TextSize::new(start as u32), TextSize::of(word));
            let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
            let is_cut = text[..start].ends_with(is_part) || text[start + word.len()..].starts_with(is_part);
            let is_here = around.is_none_or(|around| around.contains_range(range));
            if is_cut || !is_here || known.contains(&range) {
                continue;
            }
            let may_be = if is_model { self.may_refer(file, range) } else { in_key(&text[..start], word) };
            if may_be && !all_known {
                all_known = true;
                for project in projects_with(db, self.workspaces, file) {
                    known.extend(names_in(db, project, file).into_iter().map(|it| it.range));
                }
            }
            if may_be && !known.contains(&range) && !self.is_error(file, range) {
                let line = self.line(file, range);
                return Err(format!("{line}: it is unknown whether this `{word}` is the same"));
            }
        }
        Ok(())
    }

    fn may_have_unknown_names(&self, file: File, is_incomplete: bool) -> bool {
        let db = self.db;
        let mut workspaces = self.concerned.iter().map(|project| project.workspace(db));
        match workspaces.find(|&workspace| config_file(db, workspace) == Some(file)) {
            Some(workspace) => is_incomplete || config_of(db, workspace).completeness.is_incomplete(),
            None => is_incomplete || table(db, file).lost,
        }
    }

    /// Returns whether an unresolved word of a model may be this name.
    fn may_refer(&self, file: File, range: TextRange) -> bool {
        let tokens = tokens_at(&parse(self.db, file).syntax(), range.start());
        let Some(token) = tokens.into_iter().find(|token| token.text_range() == range) else { return false };
        let Some(parent) = token.parent() else { return false };
        if !token.kind().is_word() {
            return false;
        }
        if token.kind() != SyntaxKind::IDENT {
            return parent.ancestors().any(|node| node.kind() == SyntaxKind::ERROR);
        }
        let is_call = || next_significant(&token).is_some_and(|next| next.kind() == SyntaxKind::L_PAREN);
        if Builtin::of_name(token.text()).is_some() && is_call() {
            return false;
        }
        // Types of values are declared by message packages.
        let ty = parent.parent().filter(|node| node.kind() == SyntaxKind::TYPE);
        !ty.is_some_and(|ty| is_of_value(&ty)) || matches!(self.thing.definition, Definition::Library(_))
    }

    /// Returns whether a word of a model refers to nothing in every project: all that it could refer to is known, and the
    /// renamed definition is not among it.
    fn is_error(&self, file: File, range: TextRange) -> bool {
        let db = self.db;
        if !is_model(file.path(db)) {
            return false;
        }
        let Some(of) = declaration_at(db, file, range) else { return false };
        let around = parse(db, file).syntax().covering_element(range);
        let is_broken = around.ancestors().any(|node| node.kind() == SyntaxKind::ERROR);
        let mut projects = projects_with(db, self.workspaces, file).into_iter();
        !is_broken && projects.all(|project| self.is_error_in(project, of, range))
    }

    fn is_error_in(&self, project: Project<'db>, of: Decl<'db>, range: TextRange) -> bool {
        let (db, thing) = (self.db, self.thing);
        let is_feature = match &thing.definition {
            Definition::At(Location::Source(shell, _)) => {
                shell.kind(db) == Kind::Shell && thing.kind != SymbolKind::Parameter
            }
            _ => false,
        };
        let lacks = |features: &Features<'db>| {
            features.completeness.is_complete() && features.get(self.old_name).is_none()
        };
        let mut ends: Vec<&Endpoint> = Vec::new();
        let mut instances: Vec<&NameRef> = Vec::new();
        let target = match data(db, of).as_deref() {
            Some(Data::Shell(_)) => return is_feature && lacks(features_of(db, project, of)),
            Some(Data::Core(_)) => {
                return is_feature
                    && shell_of(db, project, of).is_some_and(|it| lacks(features_of(db, project, it)));
            }
            Some(Data::Architecture(data)) => {
                let links = data.connections.iter().chain(&data.operations);
                ends.extend(links.flat_map(|link| [&link.source, &link.target]).flatten());
                ends.extend(data.settings.iter().filter_map(|it| it.endpoint.as_ref()));
                of
            }
            Some(Data::Deployment(data)) => {
                let Some(target) = target_of(db, project, of) else { return false };
                ends.extend(data.settings.iter().filter_map(|it| it.endpoint.as_ref()));
                instances.extend(data.activities.iter().flat_map(|activity| &activity.instances));
                target
            }
            _ => return false,
        };
        let flat = flat_of(db, project, target);
        let is_here = |name: &NameRef| Location::Source(of, name.id).range(db) == range;
        instances.extend(ends.iter().map(|end| &end.instance));
        if instances.into_iter().any(is_here) {
            let is_complete = flat.refusals.is_empty() && flat.instance(self.old_name).is_none();
            return thing.kind != SymbolKind::Instance || is_complete;
        }
        let Some(end) = ends.into_iter().find(|end| end.feature.as_ref().is_some_and(is_here)) else {
            return false;
        };
        let instance = flat.instance(&end.instance.name).filter(|instance| !instance.repeated);
        !is_feature || instance.and_then(|it| it.features(db, project)).is_some_and(lacks)
    }

    pub(super) fn check_definitions(&self, change: &Change) -> Result<(), String> {
        let db = self.db;
        let (scratch, pairs) = change.scratch(self.db, self.workspaces);
        let home = self.home().map(|home| home.file(db));
        let shift = Shift::of(change);
        for (workspace, changed) in pairs {
            for (&before, &after) in projects(db, workspace).iter().zip(projects(&scratch, changed)) {
                let files = files_of(db, before).into_iter().zip(files_of(&scratch, after));
                for (file, changed) in files {
                    db.unwind_if_revision_cancelled();
                    let text = file.text(db);
                    let has_one = text.contains(self.old_name) || text.contains(self.new_name);
                    // Names inside a declaration are not visible in other models.
                    if has_one && home.is_none_or(|home| home == file || !is_model(file.path(db))) {
                        self.check_file((before, file), (&scratch, after, changed), &shift)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn check_file<'new>(
        &self,
        (project, file): (Project<'db>, File),
        (scratch, new_project, new_file): (&'new Database, Project<'new>, File),
        shift: &Shift,
    ) -> Result<(), String> {
        let db = self.db;
        let mut before: Vec<(CheckedName<'_>, TextRange)> = Vec::new();
        let names = names_in(db, project, file);
        for name in &names {
            let mut key = DefinitionKey::of(db, &name.definition, &|file, at| shift.moved(file, at));
            if name.definition == self.thing.definition
                && let DefinitionKey::Library(library) = &mut key
            {
                *library = self.new_name;
            }
            before.push(((shift.moved(file, name.range.start()), key, name.role), name.range));
        }
        let new_names = names_in(scratch, new_project, new_file);
        let after = new_names.iter().map(|name| {
            let key = DefinitionKey::of(scratch, &name.definition, &|_, at| at);
            ((name.range.start(), key, name.role), name.range)
        });
        let after: Vec<(CheckedName<'_>, TextRange)> = after.collect();
        let old: FxHashSet<&CheckedName<'_>> = before.iter().map(|(seen, _)| seen).collect();
        let new: FxHashSet<&CheckedName<'_>> = after.iter().map(|(seen, _)| seen).collect();
        if let Some((_, range)) = before.iter().find(|(seen, _)| !new.contains(seen)) {
            let (line, word) = (self.line(file, *range), text_of(db, file, *range));
            return Err(format!("{line}: `{word}` would refer to another definition"));
        }
        if let Some((_, range)) = after.iter().find(|(seen, _)| !old.contains(seen)) {
            let line = line_of(scratch, new_file, range.start());
            let word = text_of(scratch, new_file, *range);
            return Err(format!("{}, line {line}: `{word}` would refer to a definition", shown(db, file)));
        }
        let known: FxHashSet<(&str, File, TextSize)> = errors(db, project, file)
            .map(|it| {
                let (file, start) = (it.at.file(db), it.at.range(db).start());
                (it.code.name, file, shift.moved(file, start))
            })
            .collect();
        for error in errors(scratch, new_project, new_file) {
            let (at, start) = (error.at.file(scratch), error.at.range(scratch).start());
            if at == new_file && !known.contains(&(error.code.name, file, start)) {
                let line = line_of(scratch, new_file, start);
                return Err(format!("{}, line {line}: {}", shown(db, file), error.message));
            }
        }
        let errors = |db: &dyn ModelDb, file: File| match is_model(file.path(db)) {
            true => parse(db, file).errors().len(),
            false => table(db, file).errors.len(),
        };
        let is_config = config_file(db, project.workspace(db)) == Some(file);
        if !is_config && errors(db, file) != errors(scratch, new_file) {
            return Err(format!("the errors of {} would change", shown(db, file)));
        }
        Ok(())
    }
}

/// Returns the errors in the declarations of a file, except deployments: they declare no names, and response times take long.
/// Data flow through the states of a core is omitted, because it gives no errors.
fn errors<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
) -> impl Iterator<Item = Diagnostic<'db>> {
    let facts = move |&decl: &Decl<'db>| -> Vec<&'db Fact<'db>> {
        match decl.kind(db) {
            Kind::Deployment => Vec::new(),
            Kind::Core => {
                let behaviour = behaviour_of(db, project, decl).facts.iter();
                behaviour.chain(inference_of_core(db, project, decl).facts()).collect()
            }
            _ => declaration_facts(db, project, decl).iter().collect(),
        }
    };
    let found = declarations(db, file).all.iter().flat_map(facts);
    found.filter(|fact| fact.is_error()).map(move |fact| render(db, project, fact))
}

type CheckedName<'a> = (TextSize, DefinitionKey<'a>, OccurrenceRole);

/// The definition of a name, comparable between two databases.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum DefinitionKey<'a> {
    Location(&'a Path, TextSize),
    Library(&'a str),
    Package(&'a str),
    Message(&'a str, &'a str),
    Type(&'a str),
}

impl<'a> DefinitionKey<'a> {
    fn of(
        db: &'a dyn ModelDb,
        definition: &'a Definition<'a>,
        moved: &dyn Fn(File, TextSize) -> TextSize,
    ) -> DefinitionKey<'a> {
        let at = |place: &Location<'a>| {
            let file = place.file(db);
            DefinitionKey::Location(file.path(db), moved(file, place.range(db).start()))
        };
        match definition {
            Definition::Declaration(decl) => at(&Location::name_of(*decl)),
            Definition::At(place) => at(place),
            Definition::Library(name) => DefinitionKey::Library(name),
            Definition::File(file) => DefinitionKey::Location(file.path(db), 0.into()),
            Definition::Package(name) => DefinitionKey::Package(name),
            Definition::Message(package, name) => DefinitionKey::Message(package, name),
            Definition::Type(name) => DefinitionKey::Type(name),
        }
    }
}

/// The positions that a change moves: of each file the ends of its edits, with the sum of their changes of the length.
struct Shift(FxHashMap<File, Vec<(TextSize, i64)>>);

impl Shift {
    fn of(change: &Change) -> Shift {
        let of_file = |it: &FileChange| {
            let sums = it.edits.iter().scan(0, |sum, edit| {
                *sum += edit.text.len() as i64 - i64::from(u32::from(edit.range.len()));
                Some((edit.range.end(), *sum))
            });
            (it.file, sums.collect())
        };
        Shift(change.files.iter().map(of_file).collect())
    }

    fn moved(&self, file: File, at: TextSize) -> TextSize {
        let edits = self.0.get(&file).map_or(&[][..], Vec::as_slice);
        let before = edits.partition_point(|(end, _)| *end <= at);
        let sum = before.checked_sub(1).and_then(|last| edits.get(last)).map_or(0, |(_, sum)| *sum);
        TextSize::new((i64::from(u32::from(at)) + sum) as u32)
    }
}

/// Returns whether a word of `mauve.toml` or of a timing table may be a name of the model: it is not in a comment, and not the
/// header of a section.
fn in_key(before: &str, word: &str) -> bool {
    let line = before.rsplit('\n').next().unwrap_or_default();
    let is_section = key_named(&SECTIONS, word).is_some() || key_named(&KEYS, word).is_some();
    let is_header = line.trim_start() == "[" && is_section;
    !line.contains('#') && !is_header
}

#[cfg(test)]
mod tests {
    use super::super::rename;
    use super::super::tests::check;
    use crate::fixture::Fixture;
    use expect_test::expect;

    #[test]
    fn unreadable_files_refuse_a_rename() {
        const MODEL: &str = "//- /a.mal\ncodel $0f(): int codel g(): int\n\
             //- /mauve.toml\nproject.root = 'a.mal'\ntiming.tables = ['t.toml']\n//- /t.toml\n";
        check(
            &format!("{MODEL}codel.\"\\u0066\" = 1\n"),
            "h",
            expect![[r#"
                t.toml, line 1: `f` is written with escapes: write it without them first
            "#]],
        );
        check(
            &format!("{MODEL}[codel]\nf = 1\n[program\n"),
            "h",
            expect![[r#"
            /a.mal: codel h(): int codel g(): int
            /t.toml: h = 1
        "#]],
        );
        check(
            &format!("{MODEL}[codel]\ng = 1 # f\n[program\n"),
            "h",
            expect![[r#"
            /a.mal: codel h(): int codel g(): int
        "#]],
        );
        check(
            &format!("include \"no.mal\"\n{}", "codel $0f(): int"),
            "h",
            expect![[r#"
                not all uses of `f` are known: model.mal: the file includes a file that is not found
            "#]],
        );
        check(
            "include \"no.mal\" core C(S) { var $0f: int update = { f = 1; } }",
            "h",
            expect![[r#"
            /model.mal: include "no.mal" core C(S) { var h: int update = { h = 1; } }
        "#]],
        );
        check(
            "codel $0f(): int codel f(): int core C(S) { update = { f(); } }",
            "h",
            expect![[r#"
                model.mal, line 1: it is unknown whether this `f` is the same
            "#]],
        );
        check(
            &format!("{MODEL}[codel\nf = 1\n"),
            "h",
            expect![[r#"
                t.toml, line 2: it is unknown whether this `f` is the same
            "#]],
        );
        check(
            &format!("{MODEL}[codel]\nf = [\n"),
            "h",
            expect![[r#"
            /a.mal: codel h(): int codel g(): int
            /t.toml: h = [
        "#]],
        );
        // A key that is one for several things.
        check(
            "//- /a.mal\nlibrary a { codel $0f(): int } library b { codel f(): int }\n\
             //- /mauve.toml\ntiming.tables = ['t.toml']\n//- /t.toml\ncodel.f = 1\n",
            "h",
            expect![[r#"
                t.toml, line 1: `f` would refer to another definition
            "#]],
        );
    }

    #[test]
    fn an_unresolved_name_is_not_renamed() {
        const MODEL: &str = "shell S { property $0force: int }\nshell T { property gain: int }\ncore C(T) { }\n\
             component M(T, C)\n";
        let expected = || {
            expect![[r#"
                /model.mal: shell S { property power: int }
            "#]]
        };
        let with = |text: &str| check(&format!("{MODEL}{text}"), "power", expected());
        with("architecture A { instance m: M  property m.force = 2 }");
        with("architecture A { instance m: M } deployment D { architecture A property m.force = 2 }");
        with("architecture A { instance m: M instance n: M connection m.force -> n.force }");
        with("architecture A { instance force: M property fore.gain = 2 }");
        with("architecture A { instance m: M property force.gain = 2 }");
        with("core D(T) { update = { var n: int; n = force; } }");
        with("shell U extends T { constant c: int = force }");
        let refused = |text: &str| {
            let Fixture { db, workspace, file, offset } = Fixture::new(&format!("{MODEL}{text}"));
            let why = rename(&db, &[workspace], file, offset, "power").unwrap_err();
            assert!(why.ends_with("it is unknown whether this `force` is the same"), "{text}: {why}");
        };
        // A fix of one of these may let it refer to the renamed definition.
        refused("architecture A { instance m: Unknown property m.force = 2 }");
        refused("architecture A { property m.force = 2 }");
        refused("architecture A { instance m: M instance m: M property m.force = 2 }");
        refused(
            "component N(U, C) shell U extends V { } architecture A { instance m: N property m.force = 2 }",
        );
        refused("core D(Unknown) { update = { var n: int; n = force; } }");
        let instance =
            "architecture B { instance $0b: M } architecture A { instance a: M property b.gain = 2 }";
        let text = format!("{}{instance}", MODEL.replace("$0", ""));
        check(
            &text,
            "d",
            expect![[r#"
                /model.mal: architecture B { instance d: M } architecture A { instance a: M property b.gain = 2 }
            "#]],
        );
    }

    #[test]
    fn while_the_text_is_broken() {
        let shell = "shell S { output port p: int }\n/* 🦀 é */ core C(S) { update = { write($0p, 1); } }\n";
        check(
            &format!("{shell}core D(S) {{ update = {{ if (x  }}"),
            "q",
            expect![[r#"
            /model.mal: shell S { output port q: int }
            /model.mal: /* 🦀 é */ core C(S) { update = { write(q, 1); } }
        "#]],
        );
        check(
            &format!("{shell}core D(S) {{ update = {{ write(p"),
            "q",
            expect![[r#"
            /model.mal: shell S { output port q: int }
            /model.mal: /* 🦀 é */ core C(S) { update = { write(q, 1); } }
            /model.mal: core D(S) { update = { write(q
        "#]],
        );
        check(
            &format!("{shell}core D(S) {{ wri p"),
            "q",
            expect![[r#"
                model.mal, line 3: it is unknown whether this `p` is the same
            "#]],
        );
        check(
            &format!("{shell}core D(T) {{ update = {{ write(p, 2); }} }}"),
            "q",
            expect![[r#"
                model.mal, line 3: it is unknown whether this `p` is the same
            "#]],
        );
        check(
            "$0",
            "q",
            expect![[r#"
                no name here, or its definition is unknown
            "#]],
        );
    }
}
