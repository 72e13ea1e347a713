//! What the programs of a core take, and what a period takes at most in each state and with each transition.

use mauve_model::item_tree::{Kind, Name, Part};
use mauve_model::{Decl, ModelDb, Place, Project, Query, core, core_of, names_of, parse, psm_of};
use mauve_syntax::{SyntaxKind, SyntaxNode, TextRange, TextSize};
use mauve_timing::{Level, Time};
use rustc_hash::FxHashMap;

use super::InlayHint;

/// The hints of a core: nothing of programs that take no time, of those that are never executed, and where a time is not
/// known.
pub(super) fn of_core<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    range: TextRange,
    hints: &mut Vec<InlayHint>,
) {
    let Some(data) = core(db, of) else { return };
    let level = Query::shown(db, project).level;
    let mut all: Vec<(Decl<'db>, &'db Costs)> = Vec::new();
    for &component in components_of(db, project, of) {
        // Of components of which one has no times, the other's would seem to be those of both.
        let Some(costs) = costs_of(db, project, component, level) else { return };
        all.push((component, costs));
    }
    let root = parse(db, of.file(db)).syntax();
    let mut add = |part: Part, before: &str, after: &str, time: &dyn Fn(&Costs) -> Option<&Time>| {
        let node = node_of(&root, Place::Part(of, part).range(db));
        let node = node.filter(|node| node.text_range().intersect(range).is_some());
        let offset = node.and_then(|node| behind_head(&node)).filter(|it| range.contains_inclusive(*it));
        let Some(offset) = offset else { return };
        if let Some((times, assumed)) = label(db, &all, time) {
            let label = format!("{before}{times}{after}{assumed}");
            hints.push(InlayHint { offset, label, explained_at: None });
        }
    };
    let at = format!(" at {level}");
    for hook in data.hooks.iter().filter(|hook| hook.kind.keyword() == "update") {
        add(hook.part, "", &at, &|costs| costs.programs.get("update"));
    }
    for state in data.machines.iter().flat_map(|machine| &machine.states) {
        let name = &state.name.name;
        add(state.name.part, "takes ≤ ", &format!(" a period{at}"), &|costs| costs.states.get(name));
        for method in &state.methods {
            let key = format!("{name}.{}", method.kind.keyword());
            add(method.part, "", "", &|costs| costs.programs.get(&key));
        }
        for transition in &state.transitions {
            let of = (name.clone(), transition.name.name.clone());
            add(transition.name.part, "takes ", " a period", &|costs| costs.transitions.get(&of));
        }
    }
}

/// What a component takes.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
struct Costs {
    /// Each program that some period executes and that takes time, by its key.
    programs: FxHashMap<String, Time>,
    /// The longest period that begins in a state.
    states: FxHashMap<Name, Time>,
    /// The longest with a transition, by its state and its name.
    transitions: FxHashMap<(Name, Name), Time>,
    /// Do assumed times count?
    assumed: bool,
}

#[salsa::tracked(returns(as_ref))]
fn costs_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
    level: Level,
) -> Option<Costs> {
    let psm = psm_of(db, project, component, level).as_ref().ok()?;
    let mut costs = Costs { assumed: !psm.assumed.is_empty(), ..Costs::default() };
    // Of two states of one name, the first is meant.
    let mut numbers: FxHashMap<&Name, usize> = FxHashMap::default();
    for (number, name) in psm.states.iter().enumerate() {
        numbers.entry(name).or_insert(number);
    }
    let longer = |known: &mut Time, cost: Time| *known = (*known).max(cost);
    for (edge, described) in psm.machine.edges().iter().zip(&psm.edges) {
        for (key, time) in described.programs.iter().filter_map(|&program| psm.programs.get(program)) {
            if *time > Time::ZERO && !costs.programs.contains_key(key) {
                costs.programs.insert(key.clone(), *time);
            }
        }
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

/// The components of a project that have this core.
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
    let all = names_of(db, project).all.iter().copied();
    for component in all.filter(|decl| decl.kind(db) == Kind::Component) {
        if let Some(core) = core_of(db, project, component) {
            found.entry(core).or_default().push(component);
        }
    }
    found
}

/// The time in every component, or where they differ, in each; and what is to be said behind it.
fn label(
    db: &dyn ModelDb,
    all: &[(Decl<'_>, &Costs)],
    time: &dyn Fn(&Costs) -> Option<&Time>,
) -> Option<(String, &'static str)> {
    let times: Option<Vec<(&str, Time, bool)>> = all
        .iter()
        .map(|(component, costs)| Some((component.name(db).as_str(), *time(costs)?, costs.assumed)))
        .collect();
    let times = times?;
    let (_, first, _) = *times.first()?;
    let assumed = if times.iter().any(|(_, _, assumed)| *assumed) { " · times assumed" } else { "" };
    if times.iter().all(|(_, time, _)| *time == first) {
        return Some((first.to_string(), assumed));
    }
    let each: Vec<String> = times.iter().map(|(name, time, _)| format!("{time} ({name})")).collect();
    Some((each.join(", "), assumed))
}

/// What has this name, or begins with this keyword.
fn node_of(root: &SyntaxNode, place: TextRange) -> Option<SyntaxNode> {
    use SyntaxKind::{HOOK, METHOD, STATE, TRANSITION};
    let token = root.token_at_offset(place.start()).right_biased()?;
    token.parent_ancestors().find(|node| matches!(node.kind(), HOOK | METHOD | STATE | TRANSITION))
}

/// Behind what stands on one line; otherwise behind the first brace in it.
fn behind_head(node: &SyntaxNode) -> Option<TextSize> {
    if !node.text().contains_char('\n') {
        return Some(node.text_range().end());
    }
    let mut tokens = node.descendants_with_tokens().filter_map(mauve_syntax::NodeOrToken::into_token);
    Some(tokens.find(|token| token.kind() == SyntaxKind::L_CURLY)?.text_range().end())
}
