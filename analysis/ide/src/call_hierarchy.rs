//! Call hierarchy: the callers of a codel or an operation, and the calls of a program. Calls of a required operation lead to the
//! operations that are connected to it in any architecture.

use mauve_hir::item_tree::{FeatureKind, Kind, Name, SourceId};
use mauve_hir::{
    Decl, File, Location, ModelDb, Project, core, declarations, flat_of, names_of, parse, shell,
};
use mauve_syntax::SyntaxKind::{HOOK, METHOD, OPERATION_DEFINITION, TRANSITION};
use mauve_syntax::{TextRange, TextSize};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::document_symbols::SymbolKind;
use crate::hierarchy::{HierarchyItem, declaration_of, id_of, item_of};
use crate::occurrences::{Definition, FoundName, Role, each_once, in_declaration, names_at, occurrences_of};

/// The calls between two items.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Calls {
    /// The caller or the callee.
    pub item: HierarchyItem,
    /// The locations of the calls, in the caller's file.
    pub ranges: Vec<TextRange>,
}

/// Returns the codel, the operation or the program at `offset`; for an operation, its definitions in cores.
pub fn call_items(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    offset: TextSize,
) -> Vec<HierarchyItem> {
    if mauve_hir::is_model(file.path(db)) {
        let cores = declarations(db, file).all.iter().filter(|decl| decl.kind(db) == Kind::Core);
        let mut programs = cores.flat_map(|&core| programs_of(db, core));
        if let Some(program) = programs.find(|it| it.place().range(db).contains_inclusive(offset)) {
            return program.item(db).into_iter().collect();
        }
    }
    let names = names_at(db, project, file, offset);
    let nodes = names.iter().flat_map(|name| nodes_of(db, project, name));
    each_once(nodes.filter_map(|node| node.item(db)))
}

/// Returns the callers of an item.
///
/// ```
/// use mauve_hir::{Database, Workspace, projects};
/// let db = Database::default();
/// let text = "codel f(): int core C(S) { update = { f(); } }".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let (project, file) = (projects(&db, workspace)[0], workspace.file(&db, "/a.mal".as_ref()).unwrap());
/// let codel = &mauve_ide::call_items(&db, project, file, 6.into())[0];
/// let caller = &mauve_ide::incoming_calls(&db, project, file, &codel.id)[0].item;
/// assert_eq!((caller.name.as_str(), caller.detail.as_str()), ("update", "core C"));
/// assert_eq!(&mauve_ide::outgoing_calls(&db, project, file, &caller.id)[0].item, codel);
/// ```
pub fn incoming_calls(db: &dyn ModelDb, project: Project<'_>, file: File, id: &str) -> Vec<Calls> {
    let mut found = Collected::default();
    let Some(node) = node(db, file, id) else { return found.calls };
    let Some(called) = node.definition(db, project) else { return found.calls };
    // Calls in any core, and in its own core.
    let mut anywhere: FxHashSet<&Definition<'_>> = requirers(db, project, &called).collect();
    let own = match &node {
        Node::Program(program) => Some(program.core),
        Node::Codel(_) | Node::Operation(..) => {
            anywhere.insert(&called);
            None
        }
    };
    for core in names_of(db, project).of_kind(db, Kind::Core) {
        db.unwind_if_revision_cancelled();
        let is_it = |it: &Definition<'_>| own == Some(core) && *it == called || anywhere.contains(it);
        let mut calls = in_declaration(db, project, core);
        calls.retain(|it| it.role == Role::Call && is_it(&it.definition));
        if calls.is_empty() {
            continue;
        }
        let programs = programs_of(db, core);
        for call in calls {
            let before = programs.partition_point(|it| it.place().range(db).end() <= call.range.start());
            let last = before.checked_sub(1).and_then(|last| programs.get(last)?.item(db));
            // Otherwise it is in the initial value of a variable.
            let caller = last.filter(|it| it.range.contains_range(call.range));
            found.add(caller.or_else(|| item_of(db, core, SymbolKind::Core)), call.range);
        }
    }
    found.calls
}

/// Returns the calls in an item.
pub fn outgoing_calls(db: &dyn ModelDb, project: Project<'_>, file: File, id: &str) -> Vec<Calls> {
    let mut found = Collected::default();
    match node(db, file, id) {
        Some(Node::Codel(_)) | None => {}
        Some(Node::Operation(shell, id)) => {
            let place = Location::Source(shell, id);
            let range = place.range(db);
            for provider in providers(db, project, &Definition::At(place)) {
                provided(db, project, provider).iter().for_each(|node| found.add(node.item(db), range));
            }
        }
        Some(Node::Program(program)) => {
            let range = program.range(db).unwrap_or_default();
            let mut calls = in_declaration(db, project, program.core);
            calls.retain(|it| it.role == Role::Call && range.contains_range(it.range));
            for call in calls {
                let nodes = called(db, project, program.core, &call);
                nodes.iter().for_each(|node| found.add(node.item(db), call.range));
            }
        }
    }
    found.calls
}

#[derive(Default)]
struct Collected {
    calls: Vec<Calls>,
    index: FxHashMap<(File, TextRange, String), usize>,
    known: FxHashSet<(usize, TextRange)>,
}

impl Collected {
    fn add(&mut self, item: Option<HierarchyItem>, range: TextRange) {
        let Some(item) = item else { return };
        let key = (item.file, item.name_range, item.id.clone());
        let index = *self.index.entry(key).or_insert(self.calls.len());
        if self.known.insert((index, range)) {
            match self.calls.get_mut(index) {
                Some(calls) => calls.ranges.push(range),
                None => self.calls.push(Calls { item, ranges: vec![range] }),
            }
        }
    }
}

enum Node<'db> {
    Codel(Decl<'db>),
    /// An operation of a shell, by its name: a required one, or one without a definition.
    Operation(Decl<'db>, SourceId),
    Program(Program<'db>),
}

/// An operation, a hook, a method or a transition of a core.
#[derive(Clone)]
struct Program<'db> {
    core: Decl<'db>,
    /// Its name or keyword.
    id: SourceId,
    /// `f`, `update`, `Idle.run`, `Idle.go`: unique in the core.
    name: String,
    kind: SymbolKind,
}

impl<'db> Program<'db> {
    /// Returns the location of its name or keyword.
    fn place(&self) -> Location<'db> {
        Location::Source(self.core, self.id)
    }

    /// Returns its full range.
    fn range(&self, db: &dyn ModelDb) -> Option<TextRange> {
        let (name, root) = (self.place().range(db), parse(db, self.core.file(db)).syntax());
        let element = root.text_range().contains_range(name).then(|| root.covering_element(name))?;
        let is_program = |kind| matches!(kind, OPERATION_DEFINITION | HOOK | METHOD | TRANSITION);
        element.ancestors().find(|node| is_program(node.kind())).map(|node| node.text_range())
    }

    fn item(&self, db: &dyn ModelDb) -> Option<HierarchyItem> {
        Some(HierarchyItem {
            name: self.name.clone(),
            kind: self.kind,
            detail: format!("core {}", self.core.name(db)),
            file: self.core.file(db),
            range: self.range(db)?,
            name_range: self.place().range(db),
            id: format!("{} {}", id_of(db, self.core), self.name),
        })
    }
}

/// Returns the programs of a core, in text order.
fn programs_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Vec<Program<'db>> {
    let Some(data) = core(db, of) else { return Vec::new() };
    let program = |id, name: String, kind| Program { core: of, id, name, kind };
    let hooks = data.hooks.iter();
    let hooks = hooks.map(|it| program(it.id, it.kind.keyword().to_owned(), SymbolKind::Hook));
    let mut found: Vec<Program<'db>> = operations_of(db, of).chain(hooks).collect();
    for state in data.states() {
        let name = |name: &str| format!("{}.{name}", state.name.name);
        let methods = state.methods.iter();
        found.extend(methods.map(|it| program(it.id, name(it.kind.keyword()), SymbolKind::Hook)));
        let transitions = state.transitions.iter();
        found.extend(transitions.map(|it| program(it.name.id, name(&it.name.name), SymbolKind::Transition)));
    }
    found.retain(|it| !it.name.starts_with('.') && !it.name.ends_with('.') && !it.name.is_empty());
    found.sort_by_key(|it| it.id);
    found
}

fn operations_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> impl Iterator<Item = Program<'db>> {
    let all = core(db, of).into_iter().flat_map(|data| &data.operations);
    all.map(move |it| Program {
        core: of,
        id: it.name.id,
        name: it.name.name.to_string(),
        kind: SymbolKind::Operation,
    })
}

#[salsa::tracked(returns(ref))]
fn definitions_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<(Definition<'db>, SourceId)> {
    if core(db, of).is_none_or(|data| data.operations.is_empty()) {
        return Vec::new();
    }
    let all = occurrences_of(db, project, of).iter();
    let defined = all.filter(|it| {
        it.kind == SymbolKind::Operation && matches!(it.role, Role::Declaration | Role::Definition)
    });
    defined.map(|it| (it.definition.clone(), it.id)).collect()
}

/// Returns the names of the programs that define operations, by the operations.
#[salsa::tracked(returns(ref))]
pub(crate) fn definitions<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> FxHashMap<Definition<'db>, Vec<Location<'db>>> {
    let mut found: FxHashMap<Definition<'db>, Vec<Location<'db>>> = FxHashMap::default();
    for core in names_of(db, project).of_kind(db, Kind::Core) {
        for (operation, id) in definitions_in(db, project, core) {
            found.entry(operation.clone()).or_default().push(Location::Source(core, *id));
        }
    }
    found
}

impl<'db> Node<'db> {
    /// Returns the codel or the operation that is called; `None` for a program that cannot be called.
    fn definition(&self, db: &'db dyn ModelDb, project: Project<'db>) -> Option<Definition<'db>> {
        match self {
            Node::Codel(codel) => Some(Definition::Declaration(*codel)),
            Node::Operation(of, id) => Some(Definition::At(Location::Source(*of, *id))),
            Node::Program(Program { core, id, .. }) => {
                let mut defined = definitions_in(db, project, *core).iter();
                defined.find(|(_, name)| name == id).map(|(operation, _)| operation.clone())
            }
        }
    }

    fn item(&self, db: &dyn ModelDb) -> Option<HierarchyItem> {
        match self {
            Node::Codel(codel) => item_of(db, *codel, SymbolKind::Codel),
            Node::Program(program) => program.item(db),
            Node::Operation(of, id) => {
                let feature = shell(db, *of)?.features.iter().find(|feature| feature.name.id == *id)?;
                let range = Location::Source(*of, *id).range(db);
                let word = if feature.kind == FeatureKind::Required { "required" } else { "provided" };
                Some(HierarchyItem {
                    name: feature.name.name.to_string(),
                    kind: SymbolKind::Operation,
                    detail: format!("{word} by shell {}", of.name(db)),
                    file: of.file(db),
                    range,
                    name_range: range,
                    id: format!("{} {}", id_of(db, *of), feature.name.name),
                })
            }
        }
    }
}

/// Returns the item with this key, or `None` if it no longer exists.
fn node<'db>(db: &'db dyn ModelDb, file: File, id: &str) -> Option<Node<'db>> {
    let (decl, rest) = declaration_of(db, file, id)?;
    match decl.kind(db) {
        Kind::Codel => Some(Node::Codel(decl)),
        Kind::Shell => {
            let mut features = shell(db, decl)?.features.iter();
            let named = features.find(|it| it.kind.is_operation() && rest == [it.name.name.as_str()]);
            named.map(|it| Node::Operation(decl, it.name.id))
        }
        Kind::Core => {
            programs_of(db, decl).into_iter().find(|it| rest == [it.name.as_str()]).map(Node::Program)
        }
        _ => None,
    }
}

/// Returns the items of a name: a codel, or the definitions of an operation.
fn nodes_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, name: &FoundName<'db>) -> Vec<Node<'db>> {
    match &name.definition {
        Definition::Declaration(decl) if decl.kind(db) == Kind::Codel => vec![Node::Codel(*decl)],
        Definition::At(_) if name.kind == SymbolKind::Operation => match name.of {
            Some(of) if of.kind(db) == Kind::Core => called(db, project, of, name),
            _ => provided(db, project, &name.definition),
        },
        // A method, a hook or a transition in the key of a timing table.
        Definition::At(Location::Source(core, id)) if core.kind(db) == Kind::Core => {
            programs_of(db, *core).into_iter().filter(|it| it.id == *id).map(Node::Program).collect()
        }
        _ => Vec::new(),
    }
}

/// Returns the callees of a call: the definition of an own operation, or the operations connected to a required one.
fn called<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    core: Decl<'db>,
    call: &FoundName<'db>,
) -> Vec<Node<'db>> {
    let operation = match &call.definition {
        Definition::Declaration(codel) => return vec![Node::Codel(*codel)],
        operation => operation,
    };
    let own = provided_by(db, project, operation).filter(|it| it.core == core).map(Node::Program);
    let own: Vec<Node<'db>> = own.collect();
    if !own.is_empty() {
        return own;
    }
    let providers = providers(db, project, operation);
    let connected: Vec<Node<'db>> = providers.flat_map(|it| provided(db, project, it)).collect();
    if connected.is_empty() { provided(db, project, operation) } else { connected }
}

/// Returns the definitions of an operation, or without any, the operation itself.
fn provided<'db>(db: &'db dyn ModelDb, project: Project<'db>, operation: &Definition<'db>) -> Vec<Node<'db>> {
    let nodes: Vec<Node<'db>> = provided_by(db, project, operation).map(Node::Program).collect();
    match operation {
        Definition::At(Location::Source(of, id)) if nodes.is_empty() && of.kind(db) == Kind::Shell => {
            vec![Node::Operation(*of, *id)]
        }
        _ => nodes,
    }
}

fn provided_by<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    operation: &Definition<'db>,
) -> impl Iterator<Item = Program<'db>> {
    let names = definitions(db, project).get(operation).into_iter().flatten();
    names.filter_map(|name| match *name {
        Location::Source(core, id) => operations_of(db, core).find(|it| it.id == id),
        _ => None,
    })
}

/// Returns the provided operations that are connected to a required one, in any architecture of the project.
pub(crate) fn providers<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    required: &Definition<'db>,
) -> impl Iterator<Item = &'db Definition<'db>> {
    let pairs = connected_operations(db, project).iter();
    pairs.filter(move |(of, _)| of == required).map(|(_, provided)| provided)
}

fn requirers<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    provided: &Definition<'db>,
) -> impl Iterator<Item = &'db Definition<'db>> {
    let pairs = connected_operations(db, project).iter();
    pairs.filter(move |(_, of)| of == provided).map(|(required, _)| required)
}

/// Returns the required and the provided operations that are connected, each pair once.
#[salsa::tracked(returns(ref))]
fn connected_operations<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> Vec<(Definition<'db>, Definition<'db>)> {
    let mut found = Vec::new();
    let mut known = FxHashSet::default();
    for of in names_of(db, project).of_kind(db, Kind::Architecture) {
        let flat = flat_of(db, project, of);
        let end = |(instance, operation): &(Name, Name)| {
            let feature = flat.instance(instance)?.features(db, project)?.get(operation)?;
            Some((feature.kind, Definition::At(feature.name(db)?)))
        };
        for link in flat.links.iter().filter(|link| link.operation) {
            let pair = match (end(&link.source), end(&link.target)) {
                (Some((FeatureKind::Provided, provided)), Some((FeatureKind::Required, required))) => {
                    (required, provided)
                }
                // That is an error with its own diagnostic.
                (Some((FeatureKind::Required, required)), Some((FeatureKind::Provided, provided))) => {
                    (required, provided)
                }
                _ => continue,
            };
            if known.insert(pair.clone()) {
                found.push(pair);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of, with_cursor};
    use expect_test::{Expect, expect};

    /// Each item at the cursor, who calls it and what it calls.
    fn check(fixture: &str, expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let mut shown = String::new();
        let line = |file: File, range: TextRange| {
            let before = &file.text(&db)[..range.start().into()];
            format!("{}:{}", file.path(&db).display(), before.matches('\n').count() + 1)
        };
        let say = |item: &HierarchyItem| {
            assert!(item.range.contains_range(item.name_range));
            format!("{} ({}) {}", item.name, item.detail, line(item.file, item.name_range))
        };
        for item in call_items(&db, project_of(&db, workspace, file), file, offset) {
            shown += &format!("{}\n", say(&item));
            for calls in incoming_calls(&db, project_of(&db, workspace, item.file), item.file, &item.id) {
                let text = calls.item.file.text(&db);
                let words: Vec<&str> = calls.ranges.iter().map(|range| &text[*range]).collect();
                assert!(calls.ranges.iter().all(|range| calls.item.range.contains_range(*range)));
                shown += &format!("  < {} {}\n", say(&calls.item), words.join(" "));
            }
            for calls in outgoing_calls(&db, project_of(&db, workspace, item.file), item.file, &item.id) {
                let words: Vec<&str> =
                    calls.ranges.iter().map(|range| &item.file.text(&db)[*range]).collect();
                assert!(calls.ranges.iter().all(|range| item.range.contains_range(*range)));
                shown += &format!("  > {} {}\n", say(&calls.item), words.join(" "));
            }
        }
        expected.assert_eq(&shown);
    }

    const ROBOT: &str = r#"
//- /robot.mal
include "parts.mal"
architecture A { instance laser: parts.Sick instance map: Gmapping operation map.clear -> laser.wipe }
component Gmapping(parts.Map, parts.Slam)
//- /parts.mal
library parts {
  codel shoot(out n: int): int
  codel first(): int
  shell Laser { require wipe(): int require other(): int }
  shell Map { provide clear(): int provide idle(): int }
  core Sweep(Laser) {
    var n: int = first()
    handler h: wipe
    handler o: other
    update = { /* 🦀 é */ shoot(n); shoot(n); h = send(wipe);
      o = send(other); }
  }
  component Sick(Laser, Sweep)
  core Slam(Map) {
    provide clear(): int = { return helper(); }
    provide helper(): int = { return first(); }
    var n: int
    statemachine {
      initial state Idle { run = { shoot(n); } transition go if first() > 1 to Idle { clear(); } }
    }
  }
}
//- /mauve.toml
project.root = "robot.mal"
timing.tables = ["t.toml"]
//- /t.toml
[program]
"Gmapping/Idle.run" = 1
"#;

    fn at(from: &str, expected: Expect) {
        check(&with_cursor(ROBOT, from), expected);
    }

    #[test]
    fn codels_and_programs() {
        at(
            "codel sho$0ot",
            expect![[r#"
            shoot (library parts) /parts.mal:2
              < update (core Sweep) /parts.mal:10 shoot shoot
              < Idle.run (core Slam) /parts.mal:19 shoot
        "#]],
        );
        at(
            "sho$0ot(n); h",
            expect![[r#"
            shoot (library parts) /parts.mal:2
              < update (core Sweep) /parts.mal:10 shoot shoot
              < Idle.run (core Slam) /parts.mal:19 shoot
        "#]],
        );
        at(
            "codel fir$0st",
            expect![[r#"
            first (library parts) /parts.mal:3
              < Sweep (library parts) /parts.mal:6 first
              < helper (core Slam) /parts.mal:16 first
              < Idle.go (core Slam) /parts.mal:19 first
        "#]],
        );
        at(
            "upd$0ate =",
            expect![[r#"
            update (core Sweep) /parts.mal:10
              > shoot (library parts) /parts.mal:2 shoot shoot
              > clear (core Slam) /parts.mal:15 wipe
              > other (required by shell Laser) /parts.mal:4 other
        "#]],
        );
        at(
            "transition g$0o",
            expect![[r#"
            Idle.go (core Slam) /parts.mal:19
              > first (library parts) /parts.mal:3 first
              > clear (core Slam) /parts.mal:15 clear
        "#]],
        );
        at(
            "{ ru$0n =",
            expect![[r#"
            Idle.run (core Slam) /parts.mal:19
              > shoot (library parts) /parts.mal:2 shoot
        "#]],
        );
        at(
            "Idle.ru$0n",
            expect![[r#"
            Idle.run (core Slam) /parts.mal:19
              > shoot (library parts) /parts.mal:2 shoot
        "#]],
        );
        at("core Swe$0ep", expect![[r#""#]]);
    }

    #[test]
    fn operations_over_connections() {
        at(
            "require wi$0pe",
            expect![[r#"
            wipe (required by shell Laser) /parts.mal:4
              < update (core Sweep) /parts.mal:10 wipe
              > clear (core Slam) /parts.mal:15 wipe
        "#]],
        );
        at(
            "send(wi$0pe)",
            expect![[r#"
            clear (core Slam) /parts.mal:15
              < update (core Sweep) /parts.mal:10 wipe
              < Idle.go (core Slam) /parts.mal:19 clear
              > helper (core Slam) /parts.mal:16 helper
        "#]],
        );
        at(
            "send(oth$0er)",
            expect![[r#"
            other (required by shell Laser) /parts.mal:4
              < update (core Sweep) /parts.mal:10 other
        "#]],
        );
        at(
            "provide cle$0ar(): int p",
            expect![[r#"
            clear (core Slam) /parts.mal:15
              < update (core Sweep) /parts.mal:10 wipe
              < Idle.go (core Slam) /parts.mal:19 clear
              > helper (core Slam) /parts.mal:16 helper
        "#]],
        );
        at(
            "map.cle$0ar",
            expect![[r#"
            clear (core Slam) /parts.mal:15
              < update (core Sweep) /parts.mal:10 wipe
              < Idle.go (core Slam) /parts.mal:19 clear
              > helper (core Slam) /parts.mal:16 helper
        "#]],
        );
        at(
            "provide cle$0ar(): int =",
            expect![[r#"
            clear (core Slam) /parts.mal:15
              < update (core Sweep) /parts.mal:10 wipe
              < Idle.go (core Slam) /parts.mal:19 clear
              > helper (core Slam) /parts.mal:16 helper
        "#]],
        );
        at(
            "return hel$0per",
            expect![[r#"
            helper (core Slam) /parts.mal:16
              < clear (core Slam) /parts.mal:15 helper
              > first (library parts) /parts.mal:3 first
        "#]],
        );
        at(
            "provide id$0le",
            expect![[r#"
            idle (provided by shell Map) /parts.mal:5
        "#]],
        );
    }

    #[test]
    fn while_the_text_is_broken() {
        check(
            "codel f(): int core C(S) { update = { if (f$0( }",
            expect![[r#"
            f () /model.mal:1
              < update (core C) /model.mal:1 f
        "#]],
        );
        check("core $0C(S) {", expect![[r#""#]]);
        check("$0", expect![[r#""#]]);
    }

    #[test]
    fn an_item_of_another_text() {
        let text = "codel f(): int core C(S) { update = { f(); } }";
        let Fixture { db, workspace, file, .. } = Fixture::new(&format!("/* new */ {text}"));
        assert_eq!(incoming_calls(&db, project_of(&db, workspace, file), file, "codel - f 0").len(), 1);
        assert_eq!(outgoing_calls(&db, project_of(&db, workspace, file), file, "core - C 0 update").len(), 1);
        for id in
            ["codel - g 0", "core - C 0 stop", "core - C 0", "core - C 0 hook update", "shell - S 0 f", ""]
        {
            assert_eq!(incoming_calls(&db, project_of(&db, workspace, file), file, id), [], "{id}");
            assert_eq!(outgoing_calls(&db, project_of(&db, workspace, file), file, id), [], "{id}");
        }
    }
}
