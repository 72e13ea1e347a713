//! How data passes through cores: in how many periods, what overwrites it, and why it may never pass.

use std::fmt::Write as _;

use expect_test::{Expect, expect};
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Assumption, Cost, CostGraph, Database, Decl, Execution, PassageEnd, Project, Skip, Workspace,
    behaviour_of, core_of, names_of, passages_of, projects,
};

use crate::common::{sample, workspace};

/// What is assumed: states, codels that answer, ports with new data, and whether data passes through handles.
#[derive(Default, Clone, Copy)]
struct Assumed<'a> {
    states: &'a [&'a str],
    answers: &'a [&'a str],
    new_data: &'a [&'a str],
    through_handles: bool,
    decides: bool,
}

/// A line for each passage, then one for each port.
fn passages(db: &Database, workspace: Workspace, component: &str, assumed: Assumed<'_>) -> String {
    let project = projects(db, workspace)[0];
    let decl = names_of(db, project).anywhere(Kind::Component, component)[0];
    let core = core_of(db, project, decl).expect("it has a core");
    let names = |all: &[&str]| all.iter().map(|it| Name::from(*it)).collect::<Vec<_>>();
    let codel = |name: &&str| names_of(db, project).anywhere(Kind::Codel, name)[0];
    let answers: Vec<Decl<'_>> = assumed.answers.iter().map(codel).collect();
    let (states, new_data) = (names(assumed.states), names(assumed.new_data));
    let assumption = Assumption::new(db, states, answers, new_data, assumed.through_handles, assumed.decides);
    let found = passages_of(db, project, core, assumption);
    let mut out = String::new();
    for it in &found.all {
        let _ = write!(out, "{} -> {}: {}", end(db, &it.from), end(db, &it.to), releases(db, &it.releases));
        let _ = write!(out, ", age {}", it.periods.map_or("∞".to_owned(), |it| it.to_string()));
        if let Some(by) = &it.overwritten {
            let what = if by.is_older { "older" } else { "less" };
            let _ = write!(out, ", {what} in {} of {}", by.program, by.state);
        }
        let written = it.written.iter().map(|it| written(db, project, core, it.edge, it.programs, &it.part));
        let written = written.collect::<Vec<_>>().join(" | ");
        let _ = write!(out, ", written {}", if written.is_empty() { "at the end" } else { &written });
        out += if it.to_handle { ", to a handle\n" } else { "\n" };
    }
    for (kind, all) in [("writes", &found.writes), ("reads", &found.reads)] {
        for (port, gap) in all {
            let _ = writeln!(out, "{kind} {port}: {}", releases(db, gap));
        }
    }
    out
}

fn end(db: &Database, end: &PassageEnd<'_>) -> String {
    match end {
        PassageEnd::Port(name) => name.to_string(),
        PassageEnd::Codel(codel) => format!("{}()", codel.name(db)),
        PassageEnd::Operation(name) => format!("operation {name}"),
    }
}

fn releases(db: &Database, releases: &Result<u32, Skip<'_>>) -> String {
    match releases {
        Ok(releases) => releases.to_string(),
        Err(skip) => {
            let cause = match &skip.cause {
                mauve_hir::SkipCause::Answer(codel) => format!("Answer({})", codel.name(db)),
                cause => format!("{cause:?}"),
            };
            let states: Vec<&str> = skip.states.iter().map(|it| it.as_str()).collect();
            format!("∞ [{}] {cause}", states.join(", "))
        }
    }
}

fn written(
    db: &Database,
    project: Project<'_>,
    core: Decl<'_>,
    edge: usize,
    programs: usize,
    part: &CostGraph<'_>,
) -> String {
    let behaviour = behaviour_of(db, project, core);
    let edge = &behaviour.edges.all[edge];
    let (source, target) = (&behaviour.states[edge.source], &behaviour.states[edge.target]);
    let program = behaviour.edges.programs(edge).nth(programs).expect("the edge has the program");
    let id = &behaviour.programs[program].id;
    format!("{source} to {target} {id} {}", cost(db, part))
}

fn cost(db: &Database, of: &CostGraph<'_>) -> String {
    let text = of.folded(|part, known: &[String]| {
        let known = |index: &u32| known[*index as usize].clone();
        match part {
            Cost::Nothing => String::new(),
            Cost::One(Execution::Codel(codel)) => codel.name(db).to_string(),
            Cost::One(Execution::Operation(index)) => format!("operation {index}"),
            Cost::One(Execution::Send(name) | Execution::Access(name)) => name.to_string(),
            Cost::Sum(one, other) => format!("{} + {}", known(one), known(other)),
            Cost::Greatest(one, other) => format!("max({}, {})", known(one), known(other)),
            Cost::Program(_, inner) | Cost::Operation(_, inner) => known(inner),
        }
    });
    text.unwrap()
}

/// Checks the lines that begin with one of these, with each of the assumptions.
fn check_sample(component: &str, lines: &[&str], assumed: &[Assumed<'_>], expected: Expect) {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, mauve_tests::models().join("p3dx"), sample());
    let all: Vec<String> = assumed.iter().map(|it| passages(&db, workspace, component, *it)).collect();
    let is_shown = |line: &&str| lines.iter().any(|it| line.starts_with(it));
    let shown = |all: &String| all.lines().filter(is_shown).map(|line| format!("{line}\n")).collect();
    let shown: Vec<String> = all.iter().map(shown).collect();
    expected.assert_eq(&shown.join("\n"));
}

fn check(core: &str, expected: Expect) {
    check_assumed(core, Assumed::default(), expected);
}

fn check_assumed(core: &str, assumed: Assumed<'_>, expected: Expect) {
    let db = Database::default();
    let workspace = workspace(
        &db,
        &format!(
            "{SHELL}{}",
            if core.contains("component D") { core.to_owned() } else { format!("component C(S, K) {core}") }
        ),
    );
    let component = if core.contains("component D") { "D" } else { "C" };
    expected.assert_eq(&passages(&db, workspace, component, assumed));
}

const NOTHING: Assumed<'_> =
    Assumed { states: &[], answers: &[], new_data: &[], through_handles: false, decides: false };

const SHELL: &str = "
codel plan(in from: int): int
codel ready(): bool
codel act(in order: int): void
shell S { input port a: int  input port b: int  output port q: int }
";

/// A state of a random machine: whether it writes before it reads, reads, and writes then; whether `entry` writes; and its transitions,
/// each with a guard of the data, of the opposite, or of nothing that is known.
type DecidingState = ([bool; 3], bool, Vec<(usize, usize)>);

const GUARDS: [&str; 3] = ["late(v)", "!late(v)", "ready()"];

fn deciding_core(states: &[DecidingState]) -> String {
    let write = |is: bool| if is { "write(q, 1);" } else { "" };
    let state = |(number, ([before, reads, after], entry, transitions)): (usize, &DecidingState)| {
        let initial = if number == 0 { "initial " } else { "" };
        let read = if *reads { "read(a, v);" } else { "" };
        let run = format!("run = {{ {} {read} {} }}", write(*before), write(*after));
        let to = |(index, (guard, target)): (usize, &(usize, usize))| {
            format!("transition t{index} if {} to S{target} ", GUARDS[*guard])
        };
        let transitions: String = transitions.iter().enumerate().map(to).collect();
        format!("{initial}state S{number} {{ entry = {{ {} }} {run} {transitions} }}\n", write(*entry))
    };
    let all: String = states.iter().enumerate().map(state).collect();
    format!("codel late(in v: int): bool\ncore K(S) {{ var v: int = 0  statemachine {{ {all} }} }}")
}

/// Executes jobs until the first write that the data decides, along all paths; the data is late from its arrival on, or is not. Adds the
/// numbers of ends of jobs between.
fn decided_after(
    states: &[DecidingState],
    is_late: bool,
    (state, is_new, is_decided): (usize, bool, bool),
    from: usize,
    ends: u32,
    found: &mut Vec<u32>,
) {
    let ([before, reads, after], _, transitions) = &states[state];
    if from == 0 && (ends > 7 || (*before && is_decided)) {
        found.extend((ends <= 7).then_some(ends));
        return;
    }
    let is_new = is_new || from == 0 && *reads;
    if from == 0 && *after && is_decided {
        return found.push(ends);
    }
    // Old data says anything.
    let outcomes = |guard: usize| match (guard, is_new) {
        (0, true) => vec![is_late],
        (1, true) => vec![!is_late],
        _ => vec![true, false],
    };
    let next = from.max(1) - 1;
    match transitions.get(next) {
        None => decided_after(states, is_late, (state, is_new, is_decided), 0, ends + 1, found),
        Some((guard, target)) => {
            for holds in outcomes(*guard) {
                if !holds {
                    decided_after(states, is_late, (state, is_new, is_decided), next + 2, ends, found);
                    continue;
                }
                let is_decided = is_new && *guard < 2;
                if states[*target].1 && is_decided {
                    found.push(ends);
                } else {
                    decided_after(states, is_late, (*target, is_new, is_decided), 0, ends + 1, found);
                }
            }
        }
    }
}

#[test]
fn no_decision_takes_longer_in_a_random_machine() {
    let (mut bounded, mut attained) = (0, 0);
    let mut seed = 1_u64;
    let mut below = |most: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % most
    };
    for _ in 0..1500 {
        let count = 2 + below(2);
        let state = |_| {
            let transitions = (0..below(3)).map(|_| ([0, 0, 1, 1, 2][below(5)], below(count))).collect();
            ([below(6) == 0, below(5) > 0, below(4) == 0], below(2) == 0, transitions)
        };
        let states: Vec<DecidingState> = (0..count).map(state).collect();
        let mut reached = vec![0];
        let mut next = 0;
        while let Some(&state) = reached.get(next) {
            states[state].2.iter().for_each(|(_, to)| {
                if !reached.contains(to) {
                    reached.push(*to)
                }
            });
            next += 1;
        }
        let text = format!("{SHELL}component C(S, K) {}", deciding_core(&states));
        let db = Database::default();
        let workspace = workspace(&db, &text);
        let project = projects(&db, workspace)[0];
        let decl = names_of(&db, project).anywhere(Kind::Component, "C")[0];
        let core = core_of(&db, project, decl).unwrap();
        let assumption = Assumption::new(&db, Vec::new(), Vec::new(), Vec::new(), false, true);
        let all = passages_of(&db, project, core, assumption).all.iter();
        let is_it = |it: &&mauve_hir::Passage<'_>| {
            [&it.from, &it.to] == [&PassageEnd::Port("a".into()), &PassageEnd::Port("q".into())]
        };
        let mut found = Vec::new();
        for &state in &reached {
            for is_late in [false, true] {
                // Before a job, and behind its program.
                for from in [0, 1] {
                    decided_after(&states, is_late, (state, false, false), from, 0, &mut found);
                }
            }
        }
        match (all.clone().find(is_it).map(|it| &it.releases), found.into_iter().max()) {
            (Some(Ok(bound)), greatest) => {
                let greatest = greatest.unwrap_or_default().max(1);
                assert!(greatest <= *bound, "{greatest} > {bound}\n{text}");
                bounded += 1;
                attained += u32::from(greatest == *bound);
            }
            (Some(Err(_)), _) | (None, None) => {}
            (None, greatest) => panic!("{greatest:?}\n{text}"),
        }
    }
    assert!(bounded > 300 && attained * 10 > bounded * 9, "{attained} of {bounded}");
}

#[test]
fn a_sensor_that_may_not_answer_may_never_write() {
    let answers = Assumed { answers: &["hokuyo_sweep"], ..NOTHING };
    check_sample(
        "Hokuyo",
        &["hokuyo_sweep() -> scan", "drop_veils() -> scan", "writes"],
        &[NOTHING, answers],
        expect![[r#"
            hokuyo_sweep() -> scan: ∞ [update] Answer(hokuyo_sweep), age 0, written update to update update hokuyo_sweep + drop_veils + mask_robot + scan
            drop_veils() -> scan: ∞ [update] Answer(hokuyo_sweep), age 0, written update to update update hokuyo_sweep + drop_veils + mask_robot + scan
            writes scan: ∞ [update] Answer(hokuyo_sweep)

            hokuyo_sweep() -> scan: 1, age 0, written update to update update hokuyo_sweep + drop_veils + mask_robot + scan
            drop_veils() -> scan: 1, age 0, written update to update update hokuyo_sweep + drop_veils + mask_robot + scan
            writes scan: 1
        "#]],
    );
}

#[test]
fn a_machine_that_waits_may_never_write_and_overwrites_by_a_constant() {
    let steering = Assumed { states: &["Steering"], ..NOTHING };
    check_sample(
        "Guidance",
        &["wanted -> command", "scan -> command", "writes", "reads"],
        &[NOTHING, steering],
        expect![[r#"
            wanted -> command: ∞ [Waiting] OtherPort("scan"), age 0, less in Waiting.entry of Steering, written Steering to Steering Steering.handle steer + command | Turning to Turning Turning.handle turn + command
            scan -> command: ∞ [Waiting, Steering] Condition, age 0, less in Waiting.entry of Steering, written Steering to Steering Steering.handle steer + command | Turning to Turning Turning.handle turn + command
            writes command: ∞ [Waiting] OtherPort("wanted")
            reads wanted: 1
            reads scan: 1

            wanted -> command: 1, age 0, written Steering to Steering Steering.handle steer + command
            scan -> command: 1, age 0, written Steering to Steering Steering.handle steer + command
            writes command: 1
            reads wanted: 1
            reads scan: 1
        "#]],
    );
}

#[test]
fn a_switch_passes_the_new_order_of_the_assumed_state() {
    let automatic = Assumed { states: &["Automatic"], ..NOTHING };
    check_sample(
        "Switch",
        &["automatic -> command", "manual -> command", "scan -> command", "writes", "reads"],
        &[NOTHING, automatic],
        expect![[r#"
            manual -> command: 1, age 0, less in Stopped.entry of Automatic, written Stopped to Manual Stopped.take_over.effect slow_down + command | Automatic to Manual Automatic.take_over.effect slow_down + command | Manual to Automatic Manual.run scan + max(clearance + manual + slow_down + command, manual + slow_down + command) | Manual to Manual Manual.run scan + max(clearance + manual + slow_down + command, manual + slow_down + command)
            scan -> command: ∞ [Stopped] OtherPort("manual"), age ∞, less in Stopped.entry of Automatic, written Stopped to Manual Stopped.take_over.effect slow_down + command | Automatic to Manual Automatic.take_over.effect slow_down + command | Automatic to Automatic Automatic.handle automatic + slow_down + command | Manual to Automatic Manual.run scan + max(clearance + manual + slow_down + command, manual + slow_down + command) | Manual to Manual Manual.run scan + max(clearance + manual + slow_down + command, manual + slow_down + command)
            automatic -> command: ∞ [Manual] OtherPort("scan"), age 0, less in Automatic.take_over.effect of Automatic, written Automatic to Automatic Automatic.handle automatic + slow_down + command
            writes command: ∞ [Automatic] OtherPort("manual")
            reads manual: 1
            reads scan: 1
            reads automatic: ∞ [Manual] Condition

            manual -> command: ∞ [Automatic] NoWrite, age ∞, written at the end
            scan -> command: ∞ [Automatic] OtherPort("automatic"), age ∞, written Automatic to Automatic Automatic.handle automatic + slow_down + command
            automatic -> command: 1, age 0, written Automatic to Automatic Automatic.handle automatic + slow_down + command
            writes command: ∞ [Automatic] OtherPort("automatic")
            reads manual: 1
            reads scan: 1
            reads automatic: 1
        "#]],
    );
}

#[test]
fn a_codel_with_a_handle_is_a_sink() {
    check_sample(
        "P3dxDriver",
        &[""],
        &[NOTHING],
        expect![[r#"
            command -> aria_drive(): 1, age 0, written update to update update command + aria_drive, to a handle
            aria_odometry() -> odometry: 1, age 0, written update to update update command + max(aria_drive + aria_loop + aria_odometry + odometry, max(aria_loop + aria_odometry + odometry, aria_halt + aria_loop + aria_odometry + odometry))
            writes odometry: 1
            reads command: 1
        "#]],
    );
}

#[test]
fn data_passes_through_handles_if_that_is_assumed() {
    let through = Assumed { through_handles: true, ..NOTHING };
    check_sample(
        "Gmapping",
        &["scan ->", "odometry -> map", "slam_map", "reads"],
        &[NOTHING, through],
        expect![[r#"
            scan -> slam_match(): ∞ [Waiting] OtherPort("odometry"), age 0, written Mapping to Waiting Mapping.run odometry + slam_predict + scan + slam_match | Mapping to Resting Mapping.run odometry + slam_predict + scan + slam_match | Mapping to Mapping Mapping.run odometry + slam_predict + scan + slam_match, to a handle
            slam_map() -> map: ∞ [Waiting] OtherPort("scan"), age 0, written Mapping to Waiting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map | Mapping to Resting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map | Mapping to Mapping Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map
            reads scan: ∞ [Resting] Condition
            reads odometry: 1

            scan -> slam_predict(): ∞ [Waiting] OtherPort("odometry"), age ∞, written Mapping to Waiting Mapping.run odometry + slam_predict | Mapping to Resting Mapping.run odometry + slam_predict | Mapping to Mapping Mapping.run odometry + slam_predict | Resting to Mapping Resting.run odometry + slam_predict | Resting to Resting Resting.run odometry + slam_predict, to a handle
            scan -> slam_match(): ∞ [Waiting] OtherPort("odometry"), age 0, written Mapping to Waiting Mapping.run odometry + slam_predict + scan + slam_match | Mapping to Resting Mapping.run odometry + slam_predict + scan + slam_match | Mapping to Mapping Mapping.run odometry + slam_predict + scan + slam_match, to a handle
            scan -> slam_resample(): ∞ [Waiting] OtherPort("odometry"), age 0, written Mapping to Waiting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample | Mapping to Resting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample | Mapping to Mapping Mapping.run odometry + slam_predict + scan + slam_match + slam_resample, to a handle
            scan -> slam_correction(): ∞ [Waiting] OtherPort("odometry"), age 0, written Mapping to Waiting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction | Mapping to Resting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction | Mapping to Mapping Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction, to a handle
            scan -> correction: ∞ [Waiting] OtherPort("odometry"), age 0, written Mapping to Waiting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction | Mapping to Resting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction | Mapping to Mapping Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction
            scan -> slam_map(): ∞ [Waiting] OtherPort("odometry"), age 0, written Mapping to Waiting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map | Mapping to Resting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map | Mapping to Mapping Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map, to a handle
            scan -> map: ∞ [Waiting] OtherPort("odometry"), age 0, written Mapping to Waiting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map | Mapping to Resting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map | Mapping to Mapping Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map
            odometry -> map: ∞ [Mapping, Waiting] OtherPort("scan"), age 0, written Mapping to Waiting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map | Mapping to Resting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map | Mapping to Mapping Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map
            slam_map() -> map: ∞ [Waiting] OtherPort("scan"), age 0, written Mapping to Waiting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map | Mapping to Resting Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map | Mapping to Mapping Mapping.run odometry + slam_predict + scan + slam_match + slam_resample + slam_correction + correction + slam_map + map
            reads scan: ∞ [Resting] Condition
            reads odometry: 1
        "#]],
    );
}

#[test]
fn a_port_may_wait_for_another_port() {
    check_sample(
        "Pose",
        &[""],
        &[NOTHING, Assumed { new_data: &["odometry"], ..NOTHING }],
        expect![[r#"
            odometry -> odometry_pose(): ∞ [update] OtherPort("correction"), age 0, written update to update update odometry + correction + odometry_pose
            odometry -> pose: 1, age 0, written update to update update odometry + correction + max(odometry_pose + pose, corrected_pose + pose)
            odometry -> corrected_pose(): ∞ [update] OtherPort("correction"), age 0, written update to update update odometry + correction + corrected_pose
            correction -> pose: ∞ [update] OtherPort("odometry"), age 0, written update to update update odometry + correction + corrected_pose + pose
            correction -> corrected_pose(): ∞ [update] OtherPort("odometry"), age 0, written update to update update odometry + correction + corrected_pose
            odometry_pose() -> pose: ∞ [update] OtherPort("odometry"), age 0, less in update of update, written update to update update odometry + correction + odometry_pose + pose
            corrected_pose() -> pose: ∞ [update] OtherPort("odometry"), age 0, less in update of update, written update to update update odometry + correction + corrected_pose + pose
            writes pose: ∞ [update] OtherPort("odometry")
            reads odometry: 1
            reads correction: ∞ [update] OtherPort("odometry")

            odometry -> odometry_pose(): ∞ [update] OtherPort("correction"), age 0, written update to update update odometry + correction + odometry_pose
            odometry -> pose: 1, age 0, written update to update update odometry + correction + max(odometry_pose + pose, corrected_pose + pose)
            odometry -> corrected_pose(): ∞ [update] OtherPort("correction"), age 0, written update to update update odometry + correction + corrected_pose
            correction -> pose: 1, age 0, written update to update update odometry + correction + corrected_pose + pose
            correction -> corrected_pose(): 1, age 0, written update to update update odometry + correction + corrected_pose
            odometry_pose() -> pose: ∞ [update] OtherPort("correction"), age 0, less in update of update, written update to update update odometry + correction + odometry_pose + pose
            corrected_pose() -> pose: ∞ [update] OtherPort("correction"), age 0, less in update of update, written update to update update odometry + correction + corrected_pose + pose
            writes pose: 1
            reads odometry: 1
            reads correction: 1
        "#]],
    );
}

#[test]
fn data_of_several_periods_is_planned_with() {
    check_sample(
        "Navigation",
        &["goal -> next", "map -> next", "astar() -> next", "reads"],
        &[NOTHING, Assumed { states: &["Planning"], ..NOTHING }],
        expect![[r#"
            goal -> next: ∞ [Waiting] OtherPort("pose"), age ∞, written Planning to Arrived Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Planning to Navigating Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Planning to Waiting Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Planning to Planning Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Navigating to Navigating Navigating.reached.effect waypoint + next
            map -> next: ∞ [Waiting] OtherPort("goal"), age ∞, written Planning to Arrived Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Planning to Navigating Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Planning to Waiting Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Planning to Planning Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Navigating to Navigating Navigating.reached.effect waypoint + next
            astar() -> next: ∞ [Waiting] OtherPort("pose"), age ∞, written Planning to Arrived Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Planning to Navigating Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Planning to Waiting Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Planning to Planning Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next | Navigating to Navigating Navigating.reached.effect waypoint + next
            reads goal: 1
            reads pose: 1
            reads map: ∞ [Arrived] OtherPort("goal")

            goal -> next: ∞ [Planning] Answer(astar), age 0, written Planning to Planning Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next
            map -> next: ∞ [Planning] Answer(astar), age 0, written Planning to Planning Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next
            astar() -> next: ∞ [Planning] Answer(astar), age 0, written Planning to Planning Planning.run goal + pose + map + planar_distance + astar + simplify + waypoint + next
            reads goal: 1
            reads pose: 1
            reads map: 1
        "#]],
    );
}

#[test]
fn an_operator_drives_in_one_state() {
    let driving = Assumed { states: &["Driving"], answers: &["joystick_poll"], ..NOTHING };
    check_sample(
        "Teleop",
        &["joystick_poll() -> command", "standstill", "writes"],
        &[NOTHING, driving],
        expect![[r#"
            joystick_poll() -> command: ∞ [Released] Answer(joystick_poll), age 0, less in Driving.exit of Driving, written Driving to Driving Driving.handle stick_order + command
            standstill() -> command: ∞ [Driving] Answer(joystick_poll), age 0, less in Driving.handle of Driving, written Driving to Unplugged Driving.exit standstill + command | Driving to Released Driving.exit standstill + command
            writes command: ∞ [Released] Answer(joystick_poll)

            joystick_poll() -> command: 1, age 0, written Driving to Driving Driving.handle stick_order + command
            standstill() -> command: ∞ [Driving] NoWrite, age ∞, written at the end
            writes command: 1
        "#]],
    );
}

#[test]
fn a_second_read_takes_the_data_from_the_first_read_of_the_next_period() {
    check(
        "core K(S) { var x: int = 0  update = { if (read(a, x) == new_data) then { write(q, x); } else { } read(a, x); } }",
        expect![[r#"
            a -> q: ∞ [update] AlreadyRead, age 0, written update to update update a + q
            writes q: ∞ [update] OtherPort("a")
            reads a: 1
        "#]],
    );
}

#[test]
fn a_second_read_may_be_what_the_next_period_writes() {
    check(
        "core K(S) { var x: int = 0  update = { write(q, x); read(a, x); } }",
        expect![[r#"
        a -> q: 2, age 1, written update to update update q
        writes q: 1
        reads a: 1
    "#]],
    );
}

#[test]
fn a_write_of_a_constant_overwrites() {
    check(
        "core K(S) { var x: int = 0  update = { if (read(a, x) == new_data) then { write(q, x); } else { write(q, 0); } } }",
        expect![[r#"
            a -> q: 1, age 0, less in update of update, written update to update update a + q
            writes q: 1
            reads a: 1
        "#]],
    );
}

#[test]
fn a_machine_may_write_one_period_later() {
    check(
        "core K(S) { var x: int = 0  statemachine {
           initial state Read { run = { read(a, x); } transition go to Write }
           state Write { run = { write(q, x); } transition go to Read } } }",
        expect![[r#"
            a -> q: 3, age 1, written Write to Read Write.run q
            writes q: 2
            reads a: 2
        "#]],
    );
}

#[test]
fn a_machine_may_write_older_data_after_newer_data() {
    check(
        "core K(S) { var x: int = 0  var y: int = 0  statemachine {
           initial state First { run = { read(a, x); } transition go to Second }
           state Second { run = { read(a, y); write(q, y); } transition go to Third }
           state Third { run = { write(q, x); } transition go to First } } }",
        expect![[r#"
            a -> q: 3, age 2, older in Third.run of Third, written Second to Third Second.run a + q | Third to First Third.run q
            writes q: 2
            reads a: 2
        "#]],
    );
}

#[test]
fn clients_call_operations_between_periods() {
    let check = |core: &str, expected: Expect| {
        let db = Database::default();
        let shell = "shell S { input port a: int  output port q: int  provide stop(): void  provide next(): void } component C(S, K)";
        let workspace = workspace(&db, &format!("{shell}{core}"));
        expected.assert_eq(&passages(&db, workspace, "C", NOTHING));
    };
    // `stop` may take away what was read, and `next` overwrite what was written.
    check(
        "core K(S) { var x: int = 0
           provide stop(): void = { x = 0; }  provide next(): void = { write(q, 0); }
           statemachine {
             initial state Read { run = { read(a, x); } transition go to Write }
             state Write { run = { write(q, x); } transition go to Read } } }",
        expect![[r#"
            a -> q: ∞ [Write, Read] Condition, age 1, less in next of Read, written Write to Read Write.run q
            writes q: 2
            reads a: 2
        "#]],
    );
    // One operation reads, and the other one writes: both may be called between two periods, in any order, or never.
    check(
        "core K(S) { var x: int = 0
           provide stop(): void = { read(a, x); }  provide next(): void = { write(q, x); }
           update = { if (read(a, x) == new_data) then { write(q, x); } else { } } }",
        expect![[r#"
            a -> q: ∞ [update] Condition, age 1, written at the end
            writes q: ∞ [update] Condition
            reads a: 1
        "#]],
    );
}

#[test]
fn an_operation_that_others_may_call_takes_what_a_later_period_would_write() {
    check(
        "core K(T) { var x: int = 0  provide hold(in to: int) = { x = to; }
           update = { write(q, x); read(a, x); } }
         shell T extends S { provide hold(in to: int): void }
         component D(T, K)",
        expect![[r#"
            a -> q: ∞ [update] Condition, age 1, older in update of update, written update to update update q
            writes q: 1
            reads a: 1
        "#]],
    );
}

#[test]
fn an_operation_of_the_core_writes_for_its_caller() {
    check(
        "core K(T) { var x: int = 0  provide hold(in to: int): int = { write(q, to); return to + 1; }
           update = { read(a, x); act(hold(x)); } }
         shell T extends S { provide hold(in to: int): int }
         component D(T, K)",
        expect![[r#"
            a -> q: 1, age 0, less in hold of update, written update to update update a + operation 0
            a -> act(): 1, age 0, written update to update update a + operation 0 + act
            writes q: 1
            reads a: 1
        "#]],
    );
}

#[test]
fn calls_and_results_of_operations_are_ends() {
    check(
        "core K(T) { var x: int = 0  handler h: plan_for
           update = { if (read(a, x) == new_data) then { h = send(plan_for, x); } else { }
             if (collect(h, x) == success) then { write(q, x); } else { } } }
         shell T extends S { require plan_for(in from: int): int }
         component D(T, K)",
        expect![[r#"
            a -> operation plan_for: 1, age 0, written update to update update a + plan_for
            a -> q: ∞ [update] NoWrite, age ∞, written update to update update a + max(plan_for + q, q)
            operation plan_for -> q: 1, age 0, written update to update update a + max(plan_for + q, q)
            writes q: ∞ [update] Condition
            reads a: 1
        "#]],
    );
}

#[test]
fn a_state_that_each_period_leaves_bounds_nothing() {
    check_assumed(
        "core K(S) { var x: int = 0  statemachine {
           initial state Read { run = { read(a, x); write(q, x); } transition go to Rest }
           state Rest { transition go to Read } } }",
        Assumed { states: &["Read"], ..NOTHING },
        expect![[r#"
            a -> q: ∞ [Read] Leaves, age 0, written at the end
            writes q: ∞ [Read] Leaves
            reads a: ∞ [Read] Leaves
        "#]],
    );
}

#[test]
fn a_counter_that_writes_in_every_tenth_period_has_a_bound() {
    let update =
        "update = { if left == 0 then { read(a, x); write(q, x); left = 9; } else { left = left - 1; } }";
    check(
        &format!("core K(S) {{ var x: int = 0  var left: int = 0  {update} }}"),
        expect![[r#"
            a -> q: 10, age 0, written update to update update a + q
            writes q: 10
            reads a: 10
        "#]],
    );
    // What clients set between two periods is not known.
    check(
        &format!(
            "core K(T) {{ var x: int = 0  var left: int = 0  provide later(): void = {{ left = 5; }}  {update} }}
             component D(T, K)  shell T extends S {{ provide later(): void }}"
        ),
        expect![[r#"
            a -> q: ∞ [update] Condition, age 0, written update to update update a + q
            writes q: ∞ [update] Condition
            reads a: ∞ [update] Condition
        "#]],
    );
}

#[test]
fn a_restart_may_keep_a_counter_that_then_passes_its_limit() {
    // Started again in `Done`, it counts from 3 on.
    let text = "core K(S) {
        var x: int = 0  var n: int = 0
        statemachine {
          initial state Busy { run = { read(a, x); n = n + 1; }  transition done if n == 3 to Done }
          state Done { run = { write(q, x); n = 0; }  transition again to Busy }
        }
      }";
    check(
        text,
        expect![[r#"
            a -> q: ∞ [Busy] Condition, age 1, written Done to Busy Done.run q
            writes q: ∞ [Busy] Condition
            reads a: 2
        "#]],
    );
    check_assumed(
        text,
        Assumed { states: &["Busy"], ..NOTHING },
        expect![[r#"
            a -> q: ∞ [Busy] NoWrite, age ∞, written at the end
            writes q: ∞ [Busy] NoWrite
            reads a: 1
        "#]],
    );
}

#[test]
fn a_counter_that_a_stop_sets_counts_from_there_after_a_restart() {
    check(
        "core K(S) { var x: int = 0  var left: int = 0  stop = { left = 7; }
           update = { if left == 0 then { read(a, x); write(q, x); left = 2; } else { left = left - 1; } } }",
        expect![[r#"
            a -> q: 7, age 0, written update to update update a + q
            writes q: 7
            reads a: 7
        "#]],
    );
}

/// How often jobs are searched with the values of counters.
fn searches_with_values(update: &str) -> usize {
    let db = Database::with_log();
    let core = format!("core K(S) {{ var x: int = 0  var left: int = 0  update = {{ {update} }} }}");
    let workspace = workspace(&db, &format!("{SHELL}{core} component C(S, K)"));
    passages(&db, workspace, "C", NOTHING);
    db.take_log().executed.iter().filter(|it| **it == "reached_with_values").count()
}

#[test]
fn the_values_of_a_counter_are_followed_only_where_they_may_change_a_passage() {
    let pass = "read(a, x); write(q, x);";
    let counting = "if left == 0 then { left = 9; } else { left = left - 1; }";
    assert_eq!(searches_with_values(&format!("if left == 0 then {{ {pass} }} {counting}")), 1);
    assert_eq!(searches_with_values(&format!("{pass} {counting}")), 0);
    // The codel may refuse in each period, whatever the counter is.
    assert_eq!(searches_with_values(&format!("if ready() then {{ {pass} }} {counting}")), 0);
    // Once it is 3, it is 3 for ever.
    assert_eq!(searches_with_values(&format!("if left < 3 then {{ {pass} left = left + 1; }}")), 0);
}

#[test]
fn a_mode_may_let_each_period_leave_a_state() {
    check_assumed(
        "core K(S) { var x: int = 0  statemachine { var mode: int = 0
           initial state Read { run = { mode = 1; read(a, x); write(q, x); }  transition go if mode == 1 to Rest }
           state Rest { transition go to Read } } }",
        Assumed { states: &["Read"], ..NOTHING },
        expect![[r#"
            a -> q: ∞ [Read] Leaves, age 0, written Read to Read Read.run a + q
            writes q: ∞ [Read] Leaves
            reads a: ∞ [Read] Leaves
        "#]],
    );
}

#[test]
fn a_client_may_call_an_operation_with_another_value_than_the_core() {
    check(
        "core K(T) { var x: int = 0  var n: int = 0  provide later(in k: int): void = { if k == 3 then { write(q, 0); } }
           update = { read(a, x); write(q, x); later(0); if n == 0 then { n = 1; } else { n = 0; } } }
         shell T extends S { provide later(in k: int): void }
         component D(T, K)",
        expect![[r#"
            a -> q: 1, age 0, less in later of update, written update to update update a + q
            writes q: 1
            reads a: 1
        "#]],
    );
}
