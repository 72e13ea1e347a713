//! Hints with the execution times of programs, and the longest period of each state and each transition.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use mauve_diagnostics::times_of;
use mauve_hir::item_tree::{HookKind, Kind, Name, SourceId};
use mauve_hir::{
    Decl, Location, ModelDb, ProgramId, Project, core_of, declarations, file_groups, files_in_group, parse,
    structure_of,
};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{SyntaxNode, SyntaxToken, TextRange, TextSize, tokens_at};
use mauve_timing::{Level, Time};
use mauve_wcrt::{Query, TableSet, psm_of, tables_for};
use rustc_hash::FxHashMap;

use super::InlayHint;

/// Adds the hints of a core in `range`.
pub(super) fn of_core<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    range: TextRange,
    hints: &mut Vec<InlayHint>,
) {
    let labels = labels_of(db, project, of);
    if labels.is_empty() {
        return;
    }
    let heads = heads(db, of, range);
    for (id, label) in labels {
        let offset = heads.get(&Location::Source(of, *id).range(db).start());
        let Some(&offset) = offset.filter(|offset| range.contains_inclusive(**offset)) else { continue };
        hints.push(InlayHint { offset, label: label.clone(), explained_at: None });
    }
}

/// Returns a hash of the labels in a core.
#[salsa::tracked(returns(copy))]
pub(super) fn hash_of_labels<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> u64 {
    let mut hasher = DefaultHasher::new();
    labels_of(db, project, of).hash(&mut hasher);
    hasher.finish()
}

/// Returns the labels of the programs, states and transitions of a core: none for programs without codels, for programs that are
/// never executed, and if a time is unknown.
#[salsa::tracked(returns(ref))]
fn labels_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<(SourceId, String)> {
    let level = Query::shown(db, project).level;
    let mut all: Vec<(String, &'db Costs)> = Vec::new();
    for &component in components_of(db, project, of) {
        for &tables in tables_for(db, project, component) {
            // If one component has no times, the times of another would seem to hold for both; those of other tables likewise.
            let Some(costs) = costs_of(db, tables, component, level) else { return Vec::new() };
            let of_which = times_of(tables.section(db).as_deref());
            all.push((format!("{}{of_which}", component.name(db)), costs));
        }
    }
    let mut labels = Vec::new();
    let mut add = |id: SourceId, before: &str, after: &str, time: &dyn Fn(&Costs) -> Option<&Time>| {
        if let Some((times, assumed)) = label(&all, time) {
            labels.push((id, format!("{before}{times}{after}{assumed}")));
        }
    };
    let at = format!(" at {level}");
    for (id, place) in places_of(db, of) {
        match place {
            Place::Update => add(*id, "", &at, &|costs| costs.programs.get(&ProgramId::UPDATE)),
            Place::State(name) => {
                add(*id, "≤ ", &format!(" per period{at}"), &|costs| costs.states.get(name));
            }
            Place::Method(program) => add(*id, "", "", &|costs| costs.programs.get(program)),
            Place::Transition(of) => add(*id, "≤ ", " per period", &|costs| costs.transitions.get(of)),
        }
    }
    labels
}

/// What a label of a core is about.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
enum Place {
    Update,
    State(Name),
    Method(ProgramId),
    /// The names of its state and of itself.
    Transition((Name, Name)),
}

/// Returns what the labels of a core are about. A query of its own: most edits of a program do not change it, and build no label.
#[salsa::tracked(returns(ref))]
fn places_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Vec<(SourceId, Place)> {
    let Some(core) = structure_of(db, of) else { return Vec::new() };
    let updates = core.hooks.iter().filter(|(kind, _)| *kind == HookKind::Update);
    let mut places: Vec<(SourceId, Place)> = updates.map(|(_, id)| (*id, Place::Update)).collect();
    for state in core.states() {
        let name = &state.name.name;
        places.push((state.name.id, Place::State(name.clone())));
        places.extend(
            state
                .methods
                .iter()
                .map(|&(kind, id)| (id, Place::Method(ProgramId::Method { state: name.clone(), kind }))),
        );
        places.extend(state.transitions.iter().map(|transition| {
            let of = (name.clone(), transition.name.name.clone());
            (transition.name.id, Place::Transition(of))
        }));
    }
    places
}

#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
struct Costs {
    /// Each program that some period executes and that takes time.
    programs: FxHashMap<ProgramId, Time>,
    /// The longest period that begins in a state.
    states: FxHashMap<Name, Time>,
    /// The longest period that ends with a transition, by its state and its name.
    transitions: FxHashMap<(Name, Name), Time>,
    assumed: bool,
}

#[salsa::tracked(returns(as_ref))]
fn costs_of<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
    level: Level,
) -> Option<Costs> {
    let psm = psm_of(db, tables, component, level).as_ref().ok()?;
    let mut costs = Costs { assumed: !psm.assumed.is_empty(), ..Costs::default() };
    // If two states have one name, the first counts.
    let mut numbers: FxHashMap<&Name, usize> = FxHashMap::default();
    for (number, name) in psm.states.iter().enumerate() {
        numbers.entry(name).or_insert(number);
    }
    let longer = |known: &mut Time, cost: Time| *known = (*known).max(cost);
    for (program, time) in psm.edges.executed().filter_map(|index| psm.programs.get(index)) {
        if *time > Time::ZERO && !costs.programs.contains_key(program) {
            costs.programs.insert(program.clone(), *time);
        }
    }
    for (edge, described) in psm.machine.edges().iter().zip(&psm.edges.all) {
        let source = edge.source as usize;
        let Some(state) = psm.states.get(source).filter(|state| numbers.get(state) == Some(&source)) else {
            continue;
        };
        longer(costs.states.entry(state.clone()).or_default(), edge.cost);
        if let Some(transition) = &described.transition {
            let of = (state.clone(), transition.clone());
            longer(costs.transitions.entry(of).or_default(), edge.cost);
        }
    }
    Some(costs)
}

pub(crate) fn components_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> &'db [Decl<'db>] {
    components_by_core(db, project).get(&of).map_or(&[], Vec::as_slice)
}

#[salsa::tracked(returns(ref))]
fn components_by_core<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> FxHashMap<Decl<'db>, Vec<Decl<'db>>> {
    let mut found: FxHashMap<Decl<'db>, Vec<Decl<'db>>> = FxHashMap::default();
    for group in file_groups(db, project) {
        for &(component, core) in cores_in_group(db, project, group) {
            found.entry(core).or_default().push(component);
        }
    }
    found
}

/// Returns the components in a group of files with their cores.
#[salsa::tracked(returns(ref))]
fn cores_in_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    group: u32,
) -> Vec<(Decl<'db>, Decl<'db>)> {
    let all = files_in_group(db, project, group).iter().flat_map(|&file| &declarations(db, file).all);
    let components = all.filter(|decl| decl.kind(db) == Kind::Component);
    components.filter_map(|&it| Some((it, core_of(db, project, it)?))).collect()
}

/// Returns the common time of all components and tables, or the time of each if they differ, and a suffix for assumed times.
fn label(all: &[(String, &Costs)], time: &dyn Fn(&Costs) -> Option<&Time>) -> Option<(String, &'static str)> {
    let times: Option<Vec<(&str, Time, bool)>> =
        all.iter().map(|(name, costs)| Some((name.as_str(), *time(costs)?, costs.assumed))).collect();
    let times = times?;
    let (_, first, _) = *times.first()?;
    let assumed = if times.iter().any(|(_, _, assumed)| *assumed) { " · times assumed" } else { "" };
    if times.iter().all(|(_, time, _)| *time == first) {
        return Some((first.to_string(), assumed));
    }
    let each: Vec<String> = times.iter().map(|(name, time, _)| format!("{time} ({name})")).collect();
    Some((each.join(", "), assumed))
}

/// Returns the offsets of the hints of a core's programs, states and transitions in `range`, by the start of their names or
/// keywords: at the end of an item on one line, otherwise after its first brace. Visits the core once, because finding a node
/// takes long in a large tree.
fn heads(db: &dyn ModelDb, of: Decl<'_>, range: TextRange) -> FxHashMap<TextSize, TextSize> {
    let mut heads = FxHashMap::default();
    let root = parse(db, of.file(db)).syntax();
    let name = tokens_at(&root, Location::name_of(of).range(db).start()).right_biased();
    let Some(core) = name.and_then(|name| name.parent_ancestors().find_map(ast::Core::cast)) else {
        return heads;
    };
    let text = of.file(db).text(db);
    let mut add = |node: &SyntaxNode, begins: Option<TextRange>, brace: &dyn Fn() -> Option<SyntaxToken>| {
        let whole = node.text_range();
        let Some(begins) = begins.filter(|_| whole.intersect(range).is_some()) else { return };
        let is_one_line =
            text.get(std::ops::Range::<usize>::from(whole)).is_some_and(|it| !it.contains('\n'));
        let offset =
            if is_one_line { Some(whole.end()) } else { brace().map(|brace| brace.text_range().end()) };
        heads.extend(offset.map(|offset| (begins.start(), offset)));
    };
    let brace_of = |block: Option<ast::Block>| block.and_then(|block| block.l_curly_token());
    let of_name = |name: Option<ast::Name>| name.map(|name| name.syntax().text_range());
    let of_keyword = |keyword: Option<SyntaxToken>| keyword.map(|keyword| keyword.text_range());
    for item in core.core_items() {
        match item {
            ast::CoreItem::Hook(hook) => {
                add(hook.syntax(), of_keyword(hook.keyword()), &|| brace_of(hook.block()));
            }
            ast::CoreItem::StateMachine(machine) => {
                for item in machine.state_machine_items() {
                    let ast::StateMachineItem::State(state) = item else { continue };
                    add(state.syntax(), of_name(state.name()), &|| state.l_curly_token());
                    if state.syntax().text_range().intersect(range).is_none() {
                        continue;
                    }
                    for item in state.state_items() {
                        match item {
                            ast::StateItem::Method(it) => {
                                add(it.syntax(), of_keyword(it.keyword()), &|| brace_of(it.block()));
                            }
                            ast::StateItem::Transition(it) => {
                                add(it.syntax(), of_name(it.name()), &|| brace_of(it.block()));
                            }
                        }
                    }
                }
            }
            _ => {}
        }
    }
    heads
}
