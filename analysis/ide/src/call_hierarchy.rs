//! Call hierarchy: the callers of a codel or an operation, and the calls of a program. Calls of a required operation lead to the
//! operations that are connected to it in any architecture.
//!
//! A node is a [`Definition`]: a codel; an operation of a shell, if it is required or has no definition in a core; or a program
//! of a core, which is an operation, a hook, a method or a transition.

use mauve_hir::item_tree::{FeatureKind, Kind, Name, SourceId};
use mauve_hir::{
    Decl, File, Location, ModelDb, Project, core, declarations, flat_of, names_of, node_around, shell,
};
use mauve_syntax::{TextRange, TextSize};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::document_symbols::SymbolKind;
use crate::hierarchy::{HierarchyItem, declaration_of, id_of, item_of};
use crate::occurrences::{
    Definition, FoundName, OccurrenceRole, each_once, grouped, in_declaration, names_at, occurrences_of,
};

/// The calls between two items.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HierarchyCalls {
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
        let mut programs = cores.flat_map(|&core| members_of(db, core));
        if let Some(program) = programs.find(|it| it.place().range(db).contains_inclusive(offset)) {
            return program.item(db).into_iter().collect();
        }
    }
    let names = names_at(db, project, file, offset);
    let nodes = names.iter().flat_map(|name| nodes_of(db, project, name));
    each_once(nodes.filter_map(|node| item(db, &node)))
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
pub fn incoming_calls(db: &dyn ModelDb, project: Project<'_>, file: File, id: &str) -> Vec<HierarchyCalls> {
    let Some(node) = node(db, file, id) else { return Vec::new() };
    let own = program(db, &node);
    let called = match own {
        // Not every program can be called.
        Some((core, id)) => definitions_in(db, project, core).iter().find(|it| it.1 == id).map(|it| &it.0),
        None => Some(&node),
    };
    let Some(called) = called else { return Vec::new() };
    // Calls in any core, and in its own core.
    let pairs = connected_operations(db, project).iter();
    let requirers = pairs.filter(|(_, provided)| provided == called).map(|(required, _)| required);
    let mut anywhere: FxHashSet<&Definition<'_>> = requirers.collect();
    anywhere.extend(own.is_none().then_some(called));
    let mut found = Vec::new();
    for core in names_of(db, project).of_kind(db, Kind::Core) {
        db.unwind_if_revision_cancelled();
        let is_own = own.is_some_and(|(own, _)| own == core);
        let is_it = |it: &Definition<'_>| is_own && it == called || anywhere.contains(it);
        let mut calls = in_declaration(db, project, core);
        calls.retain(|it| it.role == OccurrenceRole::Call && is_it(&it.definition));
        if calls.is_empty() {
            continue;
        }
        let programs = members_of(db, core);
        for call in calls {
            let before = programs.partition_point(|it| it.place().range(db).end() <= call.range.start());
            let last = programs[..before].last().map(CallNode::place);
            let caller = last.filter(|it| range_of(db, it).is_some_and(|it| it.contains_range(call.range)));
            // Otherwise it is in the initial value of a variable.
            found.push((caller.map_or(Definition::Declaration(core), Definition::At), call.range));
        }
    }
    calls(db, &found)
}

/// Returns the calls in an item.
pub fn outgoing_calls(db: &dyn ModelDb, project: Project<'_>, file: File, id: &str) -> Vec<HierarchyCalls> {
    let mut found = Vec::new();
    let Some(node) = node(db, file, id) else { return Vec::new() };
    let Definition::At(place) = &node else { return Vec::new() };
    let range = range_of(db, place).unwrap_or_default();
    if let Some((core, _)) = program(db, &node) {
        let mut calls = in_declaration(db, project, core);
        calls.retain(|it| it.role == OccurrenceRole::Call && range.contains_range(it.range));
        for call in calls {
            let callees = called(db, project, core, &call.definition);
            found.extend(callees.into_iter().map(|callee| (callee, call.range)));
        }
    } else {
        let callees = providers(db, project, &node).flat_map(|it| provided(db, project, it));
        found.extend(callees.map(|callee| (callee, range)));
    }
    calls(db, &found)
}

/// Returns calls by their callers or callees, each once, in order.
fn calls<'db>(db: &'db dyn ModelDb, found: &[(Definition<'db>, TextRange)]) -> Vec<HierarchyCalls> {
    let mut known = FxHashSet::default();
    let once = found.iter().filter(|it| known.insert(*it)).map(|(node, range)| (node, *range));
    let calls = grouped(once).into_iter();
    calls.filter_map(|(node, ranges)| Some(HierarchyCalls { item: item(db, node)?, ranges })).collect()
}

/// A node inside a declaration: a program of a core, or an operation of a shell.
struct CallNode<'db> {
    of: Decl<'db>,
    /// Its name or keyword.
    id: SourceId,
    /// `f`, `update`, `Idle.run`, `Idle.go`: unique in a core.
    name: String,
    kind: SymbolKind,
    /// `core`, or how a shell has the operation.
    container: &'static str,
}

impl<'db> CallNode<'db> {
    fn place(&self) -> Location<'db> {
        Location::Source(self.of, self.id)
    }

    fn item(&self, db: &dyn ModelDb) -> Option<HierarchyItem> {
        Some(HierarchyItem {
            name: self.name.clone(),
            kind: self.kind,
            detail: format!("{} {}", self.container, self.of.name(db)),
            file: self.of.file(db),
            range: range_of(db, &self.place())?,
            name_range: self.place().range(db),
            id: format!("{} {}", id_of(db, self.of), self.name),
        })
    }
}

/// Returns the full range of a program, and the name of an operation of a shell.
fn range_of(db: &dyn ModelDb, place: &Location<'_>) -> Option<TextRange> {
    match place {
        Location::Source(of, _) if of.kind(db) == Kind::Core => {
            node_around(db, place.file(db), place.range(db)).map(|it| it.text_range())
        }
        _ => Some(place.range(db)),
    }
}

/// Returns the programs of a core, in text order, or the operations of a shell.
fn members_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Vec<CallNode<'db>> {
    let mut found = Vec::new();
    let mut add = |id, name: String, kind, container| found.push(CallNode { of, id, name, kind, container });
    for feature in shell(db, of).into_iter().flat_map(|data| &data.features) {
        let container = match feature.kind {
            FeatureKind::Required => "required by shell",
            FeatureKind::Provided => "provided by shell",
            _ => continue,
        };
        add(feature.name.id, feature.name.name.to_string(), SymbolKind::Operation, container);
    }
    let Some(data) = core(db, of) else { return found };
    for it in &data.operations {
        add(it.name.id, it.name.name.to_string(), SymbolKind::Operation, "core");
    }
    for it in &data.hooks {
        add(it.id, it.kind.keyword().to_owned(), SymbolKind::Hook, "core");
    }
    for state in data.states() {
        let name = |name: &str| format!("{}.{name}", state.name.name);
        for it in &state.methods {
            add(it.id, name(it.kind.keyword()), SymbolKind::Hook, "core");
        }
        for it in &state.transitions {
            add(it.name.id, name(&it.name.name), SymbolKind::Transition, "core");
        }
    }
    found.retain(|it| !it.name.starts_with('.') && !it.name.ends_with('.') && !it.name.is_empty());
    found.sort_by_key(|it| it.id);
    found
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
        it.kind == SymbolKind::Operation
            && matches!(it.role, OccurrenceRole::Declaration | OccurrenceRole::Definition)
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

/// Returns the core of a program, and the name or keyword of the program there.
fn program<'db>(db: &'db dyn ModelDb, node: &Definition<'db>) -> Option<(Decl<'db>, SourceId)> {
    match node {
        Definition::At(Location::Source(of, id)) if of.kind(db) == Kind::Core => Some((*of, *id)),
        _ => None,
    }
}

fn item(db: &dyn ModelDb, node: &Definition<'_>) -> Option<HierarchyItem> {
    match node {
        Definition::Declaration(decl) => item_of(db, *decl),
        Definition::At(Location::Source(of, id)) => {
            members_of(db, *of).into_iter().find(|it| it.id == *id)?.item(db)
        }
        _ => None,
    }
}

/// Returns the node of the item with this key, or `None` if it no longer exists.
fn node<'db>(db: &'db dyn ModelDb, file: File, id: &str) -> Option<Definition<'db>> {
    let (decl, rest) = declaration_of(db, file, id)?;
    if decl.kind(db) == Kind::Codel {
        return Some(Definition::Declaration(decl));
    }
    let named = members_of(db, decl).into_iter().find(|it| rest == it.name);
    named.map(|it| Definition::At(it.place()))
}

/// Returns the nodes of a name: a codel, or the definitions of an operation.
fn nodes_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, name: &FoundName<'db>) -> Vec<Definition<'db>> {
    match &name.definition {
        Definition::Declaration(decl) if decl.kind(db) == Kind::Codel => vec![name.definition.clone()],
        Definition::At(_) if name.kind == SymbolKind::Operation => match name.of {
            Some(of) if of.kind(db) == Kind::Core => called(db, project, of, &name.definition),
            _ => provided(db, project, &name.definition),
        },
        // A method, a hook or a transition in the key of a timing table.
        it if program(db, it).is_some() => vec![it.clone()],
        _ => Vec::new(),
    }
}

/// Returns the callees of a call: the definition of an own operation, or the operations connected to a required one.
fn called<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    core: Decl<'db>,
    callee: &Definition<'db>,
) -> Vec<Definition<'db>> {
    if let Definition::Declaration(_) = callee {
        return vec![callee.clone()];
    }
    let mut own = provided(db, project, callee);
    own.retain(|it| program(db, it).is_some_and(|(of, _)| of == core));
    if !own.is_empty() {
        return own;
    }
    let providers = providers(db, project, callee);
    let connected: Vec<Definition<'db>> = providers.flat_map(|it| provided(db, project, it)).collect();
    if connected.is_empty() { provided(db, project, callee) } else { connected }
}

/// Returns the definitions of an operation, or without any, the operation itself.
fn provided<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    operation: &Definition<'db>,
) -> Vec<Definition<'db>> {
    match (definitions(db, project).get(operation), operation) {
        (Some(places), _) => places.iter().cloned().map(Definition::At).collect(),
        (None, Definition::At(Location::Source(of, _))) if of.kind(db) == Kind::Shell => {
            vec![operation.clone()]
        }
        (None, _) => Vec::new(),
    }
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
            // The other direction is an error with its own diagnostic.
            let ((Some((FeatureKind::Provided, provided)), Some((FeatureKind::Required, required)))
            | (Some((FeatureKind::Required, required)), Some((FeatureKind::Provided, provided)))) =
                (end(&link.source), end(&link.target))
            else {
                continue;
            };
            let pair = (required, provided);
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
