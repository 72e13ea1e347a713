//! What the programs of a core take, and what a period takes at most in each state and with each transition.

use mauve_model::item_tree::{Kind, Name};
use mauve_model::{
    Decl, ModelDb, Place, Project, Psm, Query, behaviour_of, core, core_of, names_of, parse, psm_of,
};
use mauve_syntax::{SyntaxKind, SyntaxNode, TextRange, TextSize};
use mauve_timing::Time;

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
    let mut psms: Vec<(Decl<'db>, &'db Psm)> = Vec::new();
    for &component in components_of(db, project, of) {
        // Of components of which one has no times, the other's would seem to be those of both.
        let Ok(psm) = psm_of(db, project, component, level) else { return };
        psms.push((component, psm));
    }
    let behaviour = behaviour_of(db, project, of);
    let root = parse(db, of.file(db)).syntax();
    let mut add = |place: Place<'db>, before: &str, after: &str, time: &dyn Fn(&Psm) -> Option<Time>| {
        let place = place.range(db);
        let Some(label) = label(db, &psms, time) else { return };
        if let Some(offset) = node_of(&root, place)
            .and_then(|node| behind_head(&node))
            .filter(|it| range.contains_inclusive(*it))
        {
            hints.push(InlayHint { offset, label: format!("{before}{label}{after}"), explained_at: None });
        }
    };
    let program = |key: String| {
        move |psm: &Psm| {
            let index = psm.programs.iter().position(|(known, _)| *known == key)?;
            let is_executed = psm.edges.iter().any(|edge| edge.programs.contains(&index));
            psm.programs.get(index).map(|(_, time)| *time).filter(|time| is_executed && *time > Time::ZERO)
        }
    };
    for hook in data.hooks.iter().filter(|hook| hook.kind.keyword() == "update") {
        add(Place::Part(of, hook.part), "", &format!(" at {level}"), &program("update".to_owned()));
    }
    for state in data.machines.iter().flat_map(|machine| &machine.states) {
        let name = &state.name.name;
        let Some(number) = behaviour.states.iter().position(|known| known == name) else { continue };
        let period = |transition: Option<Name>| {
            move |psm: &Psm| {
                let edges = psm.machine.edges().iter().zip(&psm.edges);
                let edges = edges.filter(|(edge, described)| {
                    edge.source as usize == number
                        && (transition.is_none() || described.transition == transition)
                });
                edges.map(|(edge, _)| edge.cost).max()
            }
        };
        add(Place::Part(of, state.name.part), "a period ≤ ", &format!(" at {level}"), &period(None));
        for method in &state.methods {
            let key = format!("{name}.{}", method.kind.keyword());
            add(Place::Part(of, method.part), "", "", &program(key));
        }
        for transition in &state.transitions {
            let place = Place::Part(of, transition.name.part);
            add(place, "a period ", "", &period(Some(transition.name.name.clone())));
        }
    }
}

/// The components of a project that have this core.
fn components_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> &'db [Decl<'db>] {
    components_by_core(db, project).iter().find(|(core, _)| *core == of).map_or(&[], |(_, found)| found)
}

#[salsa::tracked(returns(ref))]
fn components_by_core<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<(Decl<'db>, Vec<Decl<'db>>)> {
    let mut found: Vec<(Decl<'db>, Vec<Decl<'db>>)> = Vec::new();
    let all = names_of(db, project).all.iter().copied();
    for component in all.filter(|decl| decl.kind(db) == Kind::Component) {
        let Some(core) = core_of(db, project, component) else { continue };
        match found.iter_mut().find(|(known, _)| *known == core) {
            Some((_, components)) => components.push(component),
            None => found.push((core, vec![component])),
        }
    }
    found
}

/// The time in every component, or where they differ, in each.
fn label(db: &dyn ModelDb, psms: &[(Decl<'_>, &Psm)], time: &dyn Fn(&Psm) -> Option<Time>) -> Option<String> {
    let times: Option<Vec<(&str, Time, bool)>> = psms
        .iter()
        .map(|(component, psm)| Some((component.name(db).as_str(), time(psm)?, !psm.assumed.is_empty())))
        .collect();
    let times = times?;
    let (_, first, _) = *times.first()?;
    let assumed = if times.iter().any(|(_, _, assumed)| *assumed) { " · times assumed" } else { "" };
    if times.iter().all(|(_, time, _)| *time == first) {
        return Some(format!("{first}{assumed}"));
    }
    let each: Vec<String> = times.iter().map(|(name, time, _)| format!("{time} ({name})")).collect();
    Some(each.join(", ") + assumed)
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
