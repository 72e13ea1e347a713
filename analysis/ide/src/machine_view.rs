//! A component's state machine for a panel: states and edges with their times and declarations, and the consecutive periods with
//! the greatest total execution time.

use mauve_diagnostics::timing_reason;
use mauve_hir::item_tree::{HookKind, Kind, Name, State, Transition};
use mauve_hir::{
    Decl, File, Location, ModelDb, ProgramId, Project, architecture, behaviour_of, core, core_of,
    declaration_at, is_model, names_of, parse, resolve_type,
};
use mauve_syntax::{SyntaxKind, TextRange, TextSize};
use mauve_timing::{Level, Time, worst_trace};
use mauve_wcrt::{Psm, TableSet, first_tables, psm_of, system_of};
use rustc_hash::FxHashMap;

/// The number of periods in the worst trace.
const TRACE: usize = 12;

/// A component's state machine.
#[derive(Debug, Clone, Default)]
pub struct MachineView<'db> {
    /// The reachable states, in text order.
    pub states: Vec<MachineState<'db>>,
    /// The edges, without duplicates.
    pub edges: Vec<MachineEdge<'db>>,
    /// The worst consecutive periods, as numbers of edges; empty without times.
    pub worst_trace: Vec<usize>,
    /// The state machine with its times, for drawings.
    pub psm: Option<&'db Psm<'db>>,
    /// The reasons why times, or even edges, are missing.
    pub reasons: Vec<String>,
}

/// A state.
#[derive(Debug, Clone)]
pub struct MachineState<'db> {
    /// Its name; of a core without a state machine, `update`.
    pub name: Name,
    /// Whether it is the initial state.
    pub initial: bool,
    /// The programs that its periods execute first, in order; an edge executes as many of them as its `first` says.
    pub first: Vec<(ProgramId, Option<Time>)>,
    /// Its declaration.
    pub at: Option<Location<'db>>,
}

/// An edge: one possible period.
#[derive(Debug, Clone)]
pub struct MachineEdge<'db> {
    /// The number of the state at the start of the period.
    pub source: usize,
    /// The number of the state at its end.
    pub target: usize,
    /// The transition that fires, or `None` if the state stays the same.
    pub transition: Option<Name>,
    /// Its greatest execution time.
    pub time: Option<Time>,
    /// The number of programs that it executes of the `first` of its source.
    pub first: usize,
    /// The programs that it executes after those, in order.
    pub then: Vec<(ProgramId, Option<Time>)>,
    /// The declaration of the transition.
    pub at: Option<Location<'db>>,
}

/// Returns the state machine of a component with the times of these tables.
pub fn state_machine<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
    level: Level,
) -> MachineView<'db> {
    let mut view = MachineView::default();
    let project = tables.project(db);
    let Some(of) = core_of(db, project, component) else {
        view.reasons.push("the component's core is unknown".to_owned());
        return view;
    };
    let behaviour = behaviour_of(db, project, of);
    match psm_of(db, tables, component, level) {
        Ok(psm) => view.psm = Some(psm),
        Err(refusals) => {
            view.reasons = refusals.iter().map(|it| timing_reason(db, &it.reason)).collect();
        }
    }
    if !behaviour.refusals.is_empty() {
        return view;
    }
    let data = core(db, of);
    let mut declared: FxHashMap<&Name, &State> = FxHashMap::default();
    let mut transitions: FxHashMap<(&Name, &Name), &Transition> = FxHashMap::default();
    // If two states or transitions have one name, the first counts.
    for state in data.into_iter().flat_map(|data| &data.machines).flat_map(|machine| &machine.states).rev() {
        declared.insert(&state.name.name, state);
        let of_state = state.transitions.iter().rev();
        transitions.extend(of_state.map(|it| ((&state.name.name, &it.name.name), it)));
    }
    // A core without a state machine has an `update`.
    let update = data.and_then(|data| data.hooks.iter().find(|hook| hook.kind == HookKind::Update));
    let update = update.map(|hook| Location::Source(of, hook.id));
    let psm = view.psm;
    let programs = |indices: &[usize]| -> Vec<(ProgramId, Option<Time>)> {
        let program = |&index: &usize| {
            let time = psm.and_then(|psm| Some(psm.programs.get(index)?.1));
            Some((behaviour.programs.get(index)?.id.clone(), time))
        };
        indices.iter().filter_map(program).collect()
    };
    for (index, (name, first)) in behaviour.states.iter().zip(&behaviour.edges.first).enumerate() {
        let at = declared.get(name).map(|state| Location::Source(of, state.name.id));
        view.states.push(MachineState {
            name: name.clone(),
            initial: index == behaviour.initial,
            first: programs(first),
            at: at.or_else(|| update.clone()),
        });
    }
    let times: Vec<_> = view.psm.into_iter().flat_map(Psm::longest_times).collect();
    for (index, edge) in behaviour.edges.all.iter().enumerate() {
        let source = behaviour.states.get(edge.source);
        let declared = source.zip(edge.transition.as_ref()).and_then(|name| transitions.get(&name));
        view.edges.push(MachineEdge {
            source: edge.source,
            target: edge.target,
            transition: edge.transition.clone(),
            time: times.get(index).copied().flatten(),
            first: edge.first,
            then: programs(&edge.then),
            at: declared.map(|transition| Location::Source(of, transition.name.id)),
        });
    }
    if let Some(psm) = view.psm {
        let trace = worst_trace(&psm.machine, TRACE).unwrap_or_default();
        view.worst_trace = trace.into_iter().filter_map(|edge| psm.text_edge(edge)).collect();
    }
    view
}

/// Returns the end of the activity or the instance at `offset`, otherwise `offset`: a location in it is that of its name, which a
/// keyword precedes.
pub fn end_of_item(db: &dyn ModelDb, file: File, offset: TextSize) -> TextSize {
    if !is_model(file.path(db)) {
        return offset;
    }
    let root = parse(db, file).syntax();
    let token =
        (offset <= root.text_range().end()).then(|| root.token_at_offset(offset).right_biased()).flatten();
    let mut around = token.into_iter().flat_map(|token| token.parent_ancestors());
    let item = around.find(|node| matches!(node.kind(), SyntaxKind::ACTIVITY | SyntaxKind::INSTANCE));
    item.map_or(offset, |item| item.text_range().end())
}

/// Returns the component at `offset`, with its timing tables: the declaration at `offset` is the
/// component, its core, an instance of it, or an activity of such an instance. The tables are those of the deployment of the
/// activity, otherwise [the first of those that execute it](first_tables).
pub fn component_at<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    offset: TextSize,
) -> Option<(TableSet<'db>, Decl<'db>)> {
    let decl = declaration_at(db, file, TextRange::empty(offset))?;
    // The last one that begins before the end of the item at `offset`.
    let offset = end_of_item(db, file, offset);
    let is_before = |place: &Location<'_>| place.range_in(db, file).is_some_and(|it| it.start() <= offset);
    let names = names_of(db, project);
    let component = match decl.kind(db) {
        Kind::Component => decl,
        Kind::Core => {
            names.of_kind(db, Kind::Component).find(|&it| core_of(db, project, it) == Some(decl))?
        }
        Kind::Architecture => {
            let instances = &architecture(db, decl)?.instances;
            let instance = instances.iter().rfind(|it| is_before(&Location::Source(decl, it.name.id)))?;
            resolve_type(db, project, decl, Kind::Component, instance.component.as_ref()).ok()?
        }
        Kind::Deployment => {
            let activities = &system_of(db, project, decl).activities;
            let own = activities.iter().filter(|it| it.at != Location::name_of(decl) && is_before(&it.at));
            let own = own.max_by_key(|it| it.at.range(db).start())?;
            return Some((own.tables, own.component?));
        }
        Kind::Use | Kind::Codel | Kind::Shell => return None,
    };
    Some((first_tables(db, project, component), component))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of};
    use expect_test::{Expect, expect};

    fn shown(fixture: &str) -> String {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let mut shown = String::new();
        if let Some((tables, component)) = component_at(&db, project_of(&db, workspace, file), file, offset) {
            let view = state_machine(&db, tables, component, Level::TEN_TO_MINUS_FOUR);
            let place = |at: &Option<Location<'_>>| {
                at.as_ref().map_or("?".to_owned(), |at| at.file(&db).text(&db)[at.range(&db)].to_owned())
            };
            let timed = |programs: &[(ProgramId, Option<Time>)]| {
                let programs: Vec<_> = programs.iter().map(|(id, time)| (id.to_string(), time)).collect();
                format!("{programs:?}")
            };
            shown += &format!("{}\n", component.name(&db));
            for state in &view.states {
                shown += &format!(
                    "{} @{}{} {}\n",
                    state.name,
                    place(&state.at),
                    if state.initial { " initial" } else { "" },
                    timed(&state.first)
                );
            }
            for edge in &view.edges {
                let MachineEdge { source, target, transition, time, first, then, at } = edge;
                let (at, then) = (place(at), timed(then));
                shown += &format!("{source} -> {target} {transition:?} @{at} {time:?} {first} {then}\n");
            }
            shown += &format!("{:?} {:?}\n", view.worst_trace, view.reasons);
        }
        shown
    }

    fn check(fixture: &str, expected: Expect) {
        expected.assert_eq(&shown(fixture));
    }

    const MODEL: &str = "
/* 🦀 é */ codel plan(): int
shell S { }
core C(S) {
  statemachine {
    initial state Waiting { transition go if (plan() > 0) to Moving }
    state Moving { run = { plan(); plan(); }  transition done to Wai$2ting }
  }
}
core U(S) { update = { plan(); } }
component Pilot(S, C)  component Upd$3ater(S, U)
architecture A { instance pilot: Pi$1lot  instance u: Updater }
deployment D { architecture A activity pilot { priority = 1 period = 10 } activity u { pri$4ority = 2 period = 10 } }
//- /mauve.toml
[assume]
codel = \"1.5 ms\"
";

    fn at(cursor: &str, model: &str) -> String {
        let model = model.replace(cursor, "$0");
        ["$1", "$2", "$3", "$4"].iter().fold(model, |text, mark| text.replace(mark, ""))
    }

    #[test]
    fn from_an_instance_and_from_a_core() {
        check(
            &at("$1", MODEL),
            expect![[r#"
            Pilot
            Waiting @Waiting initial [("Waiting.go.guard", Some(Time(1500000)))]
            Moving @Moving [("Moving.run", Some(Time(3000000)))]
            0 -> 1 Some("go") @go Some(Time(1500000)) 1 []
            0 -> 0 None @? Some(Time(1500000)) 1 []
            1 -> 0 Some("done") @done Some(Time(3000000)) 1 []
            [0, 2, 0, 2, 0, 2, 0, 2, 0, 2, 0, 2] []
        "#]],
        );
        assert_eq!(shown(&at("$1", MODEL)), shown(&at("$2", MODEL)));
    }

    #[test]
    fn a_component_without_states_is_its_update() {
        check(
            &at("$3", MODEL),
            expect![[r#"
            Updater
            update @update initial []
            0 -> 0 None @? Some(Time(1500000)) 0 [("update", Some(Time(1500000)))]
            [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0] []
        "#]],
        );
        assert_eq!(shown(&at("$3", MODEL)), shown(&at("$4", MODEL)));
    }

    #[test]
    fn without_times_there_are_states_all_the_same() {
        let model = MODEL.replace("codel = \"1.5 ms\"", "");
        check(
            &at("$1", &model),
            expect![[r#"
            Pilot
            Waiting @Waiting initial [("Waiting.go.guard", None)]
            Moving @Moving [("Moving.run", None)]
            0 -> 1 Some("go") @go None 1 []
            0 -> 0 None @? None 1 []
            1 -> 0 Some("done") @done None 1 []
            [] ["no time for codel `plan`"]
        "#]],
        );
        check(
            "component $0C(S, Unknown)",
            expect![[r#"
                C
                [] ["the component's core is unknown"]
            "#]],
        );
        check("shell $0S { }", expect![[""]]);
    }
}
