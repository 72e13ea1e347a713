//! Inlay hints: response times and default deadlines of activities, the utilisation of CPUs, execution times of programs
//! (`inlay_hints/programs.rs`), and values in effect (`inlay_hints/values.rs`).

mod programs;
mod values;

pub(crate) use programs::components_of;

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use mauve_diagnostics::{cpu_names, timing_reason, utilisation};
use mauve_hir::item_tree::Kind;
use mauve_hir::{
    Decl, File, Location, ModelDb, Project, Workspace, config_of, declarations, is_model, parse, source_map,
};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{SyntaxKind, SyntaxNode, TextRange, TextSize, tokens_at};
use mauve_timing::{CpuLoad, Status, Time};
use mauve_wcrt::{
    ActivityReport, Deadlines, Query, Reason, Refusal, Report, TableSet, Verdict, budgets, psm_of,
    response_times, system_of, tables_of,
};

use crate::project::{name_of_root, projects_with};

/// A label that an editor shows inside the text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InlayHint {
    /// Its position.
    pub offset: TextSize,
    /// Its text.
    pub label: String,
    /// The offset at which a [`hover`](crate::hover()) explains it, if one does.
    pub explained_at: Option<TextSize>,
}

/// The requested kinds of hints; by default all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct HintKinds {
    /// Response times beside activities, and how many deadlines are met beside deployments.
    pub response_times: bool,
    /// The utilisation of the CPUs beside deployments.
    pub loads: bool,
    /// Default deadlines of activities without one.
    pub defaults: bool,
    /// Execution times of programs, states and transitions.
    pub program_times: bool,
    /// The values of properties and constants beside instances and settings.
    pub values: bool,
}

impl Default for HintKinds {
    fn default() -> HintKinds {
        HintKinds { response_times: true, loads: true, defaults: true, program_times: true, values: true }
    }
}

/// Returns the hints in `range`, in text order.
///
/// ```
/// use mauve_ide::HintKinds;
/// use mauve_hir::{Database, Workspace};
/// use mauve_syntax::{TextRange, TextSize};
///
/// let model = "codel plan(): int  shell S { }  core C(S) { update = { plan(); } }  component P(S, C)
///     architecture A { instance pilot: P }
///     deployment D { architecture A  activity pilot { priority = 1 period = 100 } }";
/// let db = Database::default();
/// let files = [
///     ("/robot.mal".into(), model.to_owned()),
///     ("/mauve.toml".into(), "timing.tables = [\"times.toml\"]".to_owned()),
///     ("/times.toml".into(), "codel.plan = 17".to_owned()),
/// ];
/// let workspace = Workspace::of_texts(&db, "/".into(), files);
/// let file = workspace.file(&db, "/robot.mal".as_ref()).unwrap();
/// let range = TextRange::up_to(TextSize::of(model));
/// let hints = mauve_ide::inlay_hints(&db, &[workspace], file, range, HintKinds::default());
/// assert!(hints.iter().any(|hint| hint.label == "R 17 ms ≤ 100 ms · slack 83 ms"));
/// ```
pub fn inlay_hints(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    range: TextRange,
    kinds: HintKinds,
) -> Vec<InlayHint> {
    if !is_model(file.path(db)) {
        return Vec::new();
    }
    let projects = projects_with(db, workspaces, file);
    let declared = declarations(db, file).all.iter().zip(&source_map(db, file).declarations);
    let declared = declared.filter(|(_, map)| map.range.intersect(range).is_some());
    let mut found: Vec<(InlayHint, Project<'_>)> = Vec::new();
    for (&decl, _) in declared {
        for &project in &projects {
            let mut hints = Vec::new();
            match decl.kind(db) {
                Kind::Core if kinds.program_times => programs::of_core(db, project, decl, range, &mut hints),
                Kind::Architecture | Kind::Deployment => {
                    let all = of_declaration(db, project, decl, kinds).iter();
                    hints.extend(all.filter(|hint| range.contains_inclusive(hint.offset)).cloned());
                }
                _ => {}
            }
            found.extend(hints.into_iter().map(|hint| (hint, project)));
        }
    }
    found.sort_by(|(one, _), (other, _)| (one.offset, &one.label).cmp(&(other.offset, &other.label)));
    // If projects differ, all hints are shown, with their projects.
    let of_hint =
        found.chunk_by(|(one, _), (other, _)| one.offset == other.offset && one.label == other.label);
    let hints = of_hint.filter_map(|having| {
        let mut hint = having.first()?.0.clone();
        if having.len() < projects.len() {
            let roots: Vec<String> = having.iter().map(|&(_, project)| name_of_root(db, project)).collect();
            hint.label += &format!(" (in the project of {})", roots.join(", "));
        }
        Some(hint)
    });
    hints.collect()
}

/// Returns the hints of an architecture or a deployment. salsa keeps them: an edit of another file that changes none of them does
/// not build them again.
#[salsa::tracked(returns(ref))]
fn of_declaration<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    decl: Decl<'db>,
    kinds: HintKinds,
) -> Box<[InlayHint]> {
    let mut hints = Vec::new();
    if decl.kind(db) == Kind::Deployment {
        of_deployment(db, project, decl, kinds, &mut hints);
    }
    if kinds.values {
        values::of_values(db, project, decl, &mut hints);
    }
    hints.into_boxed_slice()
}

/// Returns a value that changes whenever the label of a hint in a file changes, whatever its position. The labels of cores are
/// not built for it again.
pub fn hash_of_hints(db: &dyn ModelDb, workspaces: &[Workspace], file: File, kinds: HintKinds) -> u64 {
    let mut hasher = DefaultHasher::new();
    for project in projects_with(db, workspaces, file) {
        for &decl in &declarations(db, file).all {
            match decl.kind(db) {
                Kind::Core if kinds.program_times => {
                    programs::hash_of_labels(db, project, decl).hash(&mut hasher);
                }
                Kind::Architecture | Kind::Deployment => {
                    let hints = of_declaration(db, project, decl, kinds);
                    hints.iter().for_each(|hint| hint.label.hash(&mut hasher));
                }
                _ => {}
            }
        }
    }
    hasher.finish()
}

fn of_deployment<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    kinds: HintKinds,
    hints: &mut Vec<InlayHint>,
) {
    if !kinds.response_times && !kinds.loads && !kinds.defaults {
        return;
    }
    let Some(node) = deployment_at(db, &Location::name_of(deployment)) else { return };
    let query = Query::shown(db, project);
    let (report, tables) =
        (response_times(db, project, deployment, query), tables_of(db, project, deployment));
    let text = deployment.file(db).text(db);
    if let Some(offset) = beside(text, node.syntax())
        && report.activities.iter().any(|activity| activity.verdict != Verdict::Background)
    {
        let mut labels = Vec::new();
        if kinds.response_times {
            labels.push(of_all(report, query));
        }
        if kinds.loads {
            labels.extend(loads(report));
        }
        let is_shown = !labels.is_empty();
        labels.extend(report.times.as_ref().map(|section| format!("times of {section}")));
        if report.activities.iter().any(|activity| !activity.assumed.is_empty()) {
            labels.push("times assumed".to_owned());
        }
        if config_of(db, project.workspace(db)).rt_throttling.is_none() {
            labels.push("assumes real-time throttling off".to_owned());
        }
        if report.assumes_clocks() {
            labels.push("assumes synchronised clocks".to_owned());
        }
        // There may be nothing to show: only utilisations, and no CPU.
        if is_shown {
            hints.push(InlayHint { offset, label: labels.join(" · "), explained_at: None });
        }
    }
    let nodes = node.deployment_items().filter_map(|item| match item {
        ast::DeploymentItem::Activity(it) => Some((it.name_ref()?.syntax().text_range().start(), it)),
        _ => None,
    });
    let nodes: HashMap<TextSize, ast::Activity> = nodes.collect();
    let activities = &system_of(db, project, deployment).activities;
    let with_assumptions = report.with_assumptions();
    let reports = report.activities.iter().zip(with_assumptions);
    for (resolved, (activity, assumes)) in activities.iter().zip(reports) {
        let name = resolved.at.range(db).start();
        // A duplicate, or an instance without an activity, has a diagnostic instead.
        let Some(node) = nodes.get(&name) else { continue };
        let budget = missing_codel(db, tables, activity, query).and_then(|codel| {
            let budgets = budgets(db, project, deployment, query).iter();
            // If other codels lack a time as well, the budget is not a guarantee.
            budgets.filter(|budget| budget.alone).find(|budget| budget.codel == codel)?.time
        });
        let mut label = label(db, activity, assumes, budget);
        if resolved.has_late_deadline {
            label += " (compared with the period: the deadline exceeds it)";
        }
        if let Some(offset) = beside(text, node.syntax()).filter(|_| kinds.response_times) {
            hints.push(InlayHint { offset, label, explained_at: Some(name) });
        }
        hints.extend(default_deadline(activity, node).filter(|_| kinds.defaults));
    }
}

/// Returns the hint of an activity: its response time, or why there is none.
fn label<'db>(
    db: &'db dyn ModelDb,
    activity: &ActivityReport<'db>,
    assumes: bool,
    budget: Option<Time>,
) -> String {
    let because = || {
        let first = activity.reasons.first();
        let first = first.map_or_else(String::new, |it| timing_reason(db, &it.reason));
        match activity.reasons.len() {
            0 | 1 => first,
            count => format!("{first} (and {} more)", count - 1),
        }
    };
    let deadline = activity.deadline.unwrap_or_default();
    let assumed = if assumes { " · times assumed" } else { "" };
    match (activity.verdict, activity.response) {
        (Verdict::Background, _) => "not real-time".to_owned(),
        (Verdict::RealTime(Status::Met), Some(response)) => {
            let slack = deadline.checked_sub(response).unwrap_or_default();
            format!("R {response} ≤ {deadline} · slack {slack}{assumed}")
        }
        (Verdict::RealTime(Status::Missed), Some(response)) => {
            format!("R {response} > {deadline} ✗{assumed}")
        }
        (Verdict::RealTime(Status::Unbounded), _) => format!("unbounded ✗: {}", because()),
        (Verdict::RealTime(Status::NotAnalysed), _) => {
            let budget = budget.map_or_else(String::new, |time| format!(" · all deadlines met if ≤ {time}"));
            format!("not analysed: {}{budget}", because())
        }
        (Verdict::RealTime(_), _) => format!("no bound ✗: {}", because()),
    }
}

/// Returns the codel without a time, if that is the only reason why an activity is not analysed.
fn missing_codel<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    activity: &ActivityReport<'db>,
    query: Query,
) -> Option<Decl<'db>> {
    let component = activity.component.filter(|_| activity.reasons.len() == 1)?;
    match psm_of(db, tables, component, query.level).as_ref().err()?.as_slice() {
        [Refusal { reason: Reason::NoTime(codel), .. }] => Some(*codel),
        _ => None,
    }
}

/// Returns how many deadlines of a deployment are met.
fn of_all(report: &Report<'_>, query: Query) -> String {
    let Deadlines { met, unknown, all: count } = report.deadlines();
    let mut label = format!("{met} of {count} deadlines met at {}", query.level);
    for (others, what) in [(count - unknown - met, "missed"), (unknown, "not analysed")] {
        if others > 0 {
            label += &format!(", {others} {what}");
        }
    }
    label
}

/// Returns the utilisation of each CPU.
fn loads(report: &Report<'_>) -> Vec<String> {
    let load = |cpu: &CpuLoad| {
        // Activities that are not analysed are not included.
        let at_least = if cpu.complete { "" } else { "≥ " };
        format!("{} {at_least}{}", cpu_names(cpu.mask), utilisation(cpu))
    };
    report.cpus.iter().map(load).collect()
}

/// Returns the hint ` deadline = 100` of an activity without a deadline.
fn default_deadline(activity: &ActivityReport<'_>, node: &ast::Activity) -> Option<InlayHint> {
    let fields: Vec<ast::Field> = node.fields().collect();
    let is_deadline =
        |field: &ast::Field| field.name_ref().is_some_and(|name| name.syntax().text() == "deadline");
    if activity.verdict == Verdict::Background || fields.iter().any(is_deadline) {
        return None;
    }
    let deadline: Time = activity.deadline?;
    let offset = fields.last()?.syntax().text_range().end();
    // Without a unit, as in a model.
    let label = format!(" deadline = {}", deadline.number());
    Some(InlayHint { offset, label, explained_at: None })
}

/// Returns the syntax node of the deployment with this name.
fn deployment_at(db: &dyn ModelDb, name: &Location<'_>) -> Option<ast::Deployment> {
    let root: SyntaxNode = parse(db, name.file(db)).syntax();
    let token = tokens_at(&root, name.range(db).start()).right_biased()?;
    token.parent_ancestors().find_map(ast::Deployment::cast)
}

/// Returns the end of `node` if it is on one line of the text, otherwise the end of its opening brace.
fn beside(text: &str, node: &SyntaxNode) -> Option<TextSize> {
    let range = node.text_range();
    if !text.get(std::ops::Range::<usize>::from(range))?.contains('\n') {
        return Some(range.end());
    }
    let mut tokens = node.children_with_tokens().filter_map(mauve_syntax::NodeOrToken::into_token);
    Some(tokens.find(|token| token.kind() == SyntaxKind::L_CURLY)?.text_range().end())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};

    /// The text of the first file with the hints in it, in `⟨…⟩`.
    fn check(fixture: &str, expected: Expect) {
        check_kinds(fixture, HintKinds::default(), expected);
    }

    fn check_kinds(fixture: &str, kinds: HintKinds, expected: Expect) {
        let fixture = Fixture::new(fixture);
        let file = fixture.file;
        let text = file.text(&fixture.db);
        let hints = inlay_hints(
            &fixture.db,
            &[fixture.workspace],
            file,
            TextRange::up_to(TextSize::of(&**text)),
            kinds,
        );
        let mut shown = String::new();
        let mut done = 0;
        for hint in hints {
            let offset = usize::from(hint.offset);
            shown += &format!("{}⟨{}⟩", &text[done..offset], hint.label);
            done = offset;
        }
        let shown = shown + &text[done..];
        let lines: Vec<&str> = shown.lines().filter(|line| line.contains('⟨')).map(str::trim).collect();
        expected.assert_eq(&(lines.join("\n") + "\n"));
    }

    const PARTS: &str = "
codel plan(): int
codel drive(): int
shell S { }
core Planning(S) { update = { plan(); } }
core Driving(S) { update = { drive(); } }
component Planner(S, Planning)
component Driver(S, Driving)
architecture A { instance planner: Planner  instance driver: Driver }
";

    fn robot(deployment: &str, times: &str) -> String {
        format!(
            "{PARTS}{deployment}\n//- /mauve.toml\n[timing]\ntables = [\"times.toml\"]\n[platform]\nrt_throttling = false\n\
             //- /times.toml\n{times}\n"
        )
    }

    #[test]
    fn times_of_several_tables() {
        let deployments = "deployment D { architecture A activity driver { priority = 2 period = 50 } activity planner { priority = \
                           background } }\ndeployment Sea { architecture A activity driver { priority = 2 period = 50 } activity \
                           planner { priority = background } }";
        let text = robot(deployments, "codel.plan = 70\ncodel.drive = 17");
        let sea = "[timing.deployment.Sea]\ntables = [\"sea.toml\"]\n[platform]";
        let text =
            text.replacen("[platform]", sea, 1) + "\n//- /sea.toml\ncodel.plan = 70\ncodel.drive = 19\n";
        check(
            &text,
            expect![[r#"
            core Planning(S) { update = { plan(); }⟨70 ms at 1e-4⟩ }
            core Driving(S) { update = { drive(); }⟨17 ms (Driver), 19 ms (Driver, times of Sea) at 1e-4⟩ }
            deployment D { architecture A activity driver { priority = 2 period = 50⟨ deadline = 50⟩ }⟨R 17 ms ≤ 50 ms · slack 33 ms⟩ activity planner { priority = background }⟨not real-time⟩ }⟨1 of 1 deadlines met at 1e-4 · CPU 1 34.0 %⟩
            deployment Sea { architecture A activity driver { priority = 2 period = 50⟨ deadline = 50⟩ }⟨R 19 ms ≤ 50 ms · slack 31 ms⟩ activity planner { priority = background }⟨not real-time⟩ }⟨1 of 1 deadlines met at 1e-4 · CPU 1 38.0 % · times of Sea⟩
        "#]],
        );
    }

    #[test]
    fn met_and_missed_and_what_is_left_out() {
        check(
            &robot(
                "deployment D {\n architecture A\n activity driver { priority = 2 period = 50 deadline = 20 }\n \
                 activity planner {\n  priority = 1\n  period = 100\n }\n}",
                "codel.plan = 70\ncodel.drive = 17",
            ),
            expect![[r#"
                core Planning(S) { update = { plan(); }⟨70 ms at 1e-4⟩ }
                core Driving(S) { update = { drive(); }⟨17 ms at 1e-4⟩ }
                deployment D {⟨1 of 2 deadlines met at 1e-4, 1 missed · CPU 1 104.0 %⟩
                activity driver { priority = 2 period = 50 deadline = 20 }⟨R 17 ms ≤ 20 ms · slack 3 ms⟩
                activity planner {⟨unbounded ✗: CPU 1 overloaded (104.0 % at priority ≥ 1)⟩
                period = 100⟨ deadline = 100⟩
            "#]],
        );
        check(
            &robot(
                "deployment D { architecture A activity driver { priority = 2 period = 50 deadline = 16 } \
                 activity planner { priority = background } }",
                "codel.plan = 70\ncodel.drive = 17",
            ),
            expect![[r#"
                core Planning(S) { update = { plan(); }⟨70 ms at 1e-4⟩ }
                core Driving(S) { update = { drive(); }⟨17 ms at 1e-4⟩ }
                deployment D { architecture A activity driver { priority = 2 period = 50 deadline = 16 }⟨R 17 ms > 16 ms ✗⟩ activity planner { priority = background }⟨not real-time⟩ }⟨0 of 1 deadlines met at 1e-4, 1 missed · CPU 1 34.0 %⟩
            "#]],
        );
    }

    #[test]
    fn what_is_not_analysed_says_why_and_what_it_may_take() {
        check(
            &robot(
                "deployment D {\n architecture A\n activity driver { priority = 1 period = 50 deadline = 50 }\n \
                 activity planner { priority = 2 period = 100 deadline = 100 }\n}",
                "codel.drive = 17",
            ),
            expect![[r#"
                core Driving(S) { update = { drive(); }⟨17 ms at 1e-4⟩ }
                deployment D {⟨0 of 2 deadlines met at 1e-4, 2 not analysed · CPU 1 ≥ 34.0 %⟩
                activity driver { priority = 1 period = 50 deadline = 50 }⟨not analysed: `planner` may preempt it and is not analysed⟩
                activity planner { priority = 2 period = 100 deadline = 100 }⟨not analysed: no time for codel `plan` · all deadlines met if ≤ 33 ms⟩
            "#]],
        );
    }

    #[test]
    fn while_the_text_is_broken() {
        check(
            &robot(
                "deployment D {\n architecture A\n activity driver { priority = 2 period = }\n \
                 activity planner { priority = 1 period = 100 }\n",
                "codel.plan = 70\ncodel.drive = 17",
            ),
            expect![[r#"
                core Planning(S) { update = { plan(); }⟨70 ms at 1e-4⟩ }
                core Driving(S) { update = { drive(); }⟨17 ms at 1e-4⟩ }
                deployment D {⟨0 of 2 deadlines met at 1e-4, 2 not analysed · CPU 1 ≥ 70.0 %⟩
                activity driver { priority = 2 period = }⟨not analysed: its period has a syntax error (and 1 more)⟩
                activity planner { priority = 1 period = 100⟨ deadline = 100⟩ }⟨not analysed: deployment D has a syntax error: an activity may be missing in it⟩
            "#]],
        );
    }

    #[test]
    fn a_deadline_that_does_not_count_is_said_to() {
        check(
            &robot(
                "deployment D {\n architecture A\n activity driver { priority = 2 period = 10 deadline = 100 }\n \
                 activity planner { priority = 1 period = 1000 deadline = 1000.0 }\n}",
                "codel.plan = 70\ncodel.drive = 9",
            ),
            expect![[r#"
                core Planning(S) { update = { plan(); }⟨70 ms at 1e-4⟩ }
                core Driving(S) { update = { drive(); }⟨9 ms at 1e-4⟩ }
                deployment D {⟨2 of 2 deadlines met at 1e-4 · CPU 1 97.0 %⟩
                activity driver { priority = 2 period = 10 deadline = 100 }⟨R 9 ms ≤ 10 ms · slack 1 ms (compared with the period: the deadline exceeds it)⟩
                activity planner { priority = 1 period = 1000 deadline = 1000.0 }⟨R 700 ms ≤ 1000 ms · slack 300 ms⟩
            "#]],
        );
    }

    #[test]
    fn projects_that_differ_are_told_apart() {
        let parts = PARTS.replace("codel plan(): int\n", "");
        let deployment = "deployment D { architecture A activity driver { priority = 2 period = 50 deadline = 20 }\n\
                          activity planner { priority = 1 period = 100 deadline = 100 } }";
        let root = |times: &str| format!("include \"shared.mal\"\ncodel plan(): int\n{times}");
        check(
            &format!(
                "//- /shared.mal\n{parts}{deployment}\n//- /one.mal\n{}\n//- /two.mal\n{}\n//- /mauve.toml\n[project]\n\
                 roots = [\"one.mal\", \"two.mal\"]\n[timing]\ntables = [\"times.toml\"]\n[platform]\nrt_throttling = false\n\
                 //- /times.toml\ncodel.drive = 17\ncodel.plan = 20\n",
                root(""),
                root("codel plan(): int\n"),
            ),
            expect![[r#"
                core Planning(S) { update = { plan(); }⟨20 ms at 1e-4 (in the project of one.mal)⟩ }
                core Driving(S) { update = { drive(); }⟨17 ms at 1e-4⟩ }
                deployment D {⟨1 of 2 deadlines met at 1e-4, 1 not analysed · CPU 1 ≥ 34.0 % (in the project of two.mal)⟩⟨2 of 2 deadlines met at 1e-4 · CPU 1 54.0 % (in the project of one.mal)⟩ architecture A activity driver { priority = 2 period = 50 deadline = 20 }⟨R 17 ms ≤ 20 ms · slack 3 ms⟩
                activity planner { priority = 1 period = 100 deadline = 100 }⟨R 37 ms ≤ 100 ms · slack 63 ms (in the project of one.mal)⟩⟨not analysed: core Planning: codel `plan` is declared twice (in the project of two.mal)⟩ }
            "#]],
        );
    }

    #[test]
    fn assumed_times_are_marked() {
        check(
            "
codel plan(): int
shell S { }
core Planning(S) { update = { plan(); } }
component Planner(S, Planning)
architecture A { instance planner: Planner }
deployment D { architecture A
  activity planner { priority = 2 period = 100 deadline = 100 }
}
//- /mauve.toml
[assume]
codel = \"5 ms\"
",
            expect![[r#"
                core Planning(S) { update = { plan(); }⟨5 ms at 1e-4 · times assumed⟩ }
                deployment D {⟨1 of 1 deadlines met at 1e-4 · CPU 1 5.0 % · times assumed · assumes real-time throttling off⟩ architecture A
                activity planner { priority = 2 period = 100 deadline = 100 }⟨R 5 ms ≤ 100 ms · slack 95 ms · times assumed⟩
            "#]],
        );
    }

    #[test]
    fn synchronised_clocks_are_said() {
        check(
            "
codel plan(): int
shell S { }
core K(S) { update = { plan(); } }
component C(S, K)
architecture A { instance first: C  instance second: C }
deployment D { architecture A
  activity first { priority = 2 period = 100 }
  activity second { priority = 1 period = 100 offset = 50 }
}
//- /mauve.toml
assume.codel = \"5 ms\"
platform.rt_throttling = false
clocks.synchronised = [\"first\", \"second\"]
",
            expect![[r#"
                core K(S) { update = { plan(); }⟨5 ms at 1e-4 · times assumed⟩ }
                deployment D {⟨2 of 2 deadlines met at 1e-4 · CPU 1 10.0 % · times assumed · assumes synchronised clocks⟩ architecture A
                activity first { priority = 2 period = 100⟨ deadline = 100⟩ }⟨R 5 ms ≤ 100 ms · slack 95 ms · times assumed⟩
                activity second { priority = 1 period = 100 offset = 50⟨ deadline = 100⟩ }⟨R 5 ms ≤ 100 ms · slack 95 ms · times assumed⟩
            "#]],
        );
    }

    const MACHINE: &str = "
/* 🦀 é */ codel plan(): int  codel look(): int
shell S { }
core C(S) {
  statemachine {
    initial state Waiting {
      transition go if (look() > 0) to Moving
    }
    state Moving { entry = { look(); }  run = {
        plan();
      } exit = { }  transition done to Waiting { look(); } }
    state Never { run = { plan(); } }
  }
}
core U(S) { update = { plan(); } }
component Pilot(S, C)  component Quick(S, U)  component Slow(S, U)
//- /mauve.toml
timing.tables = [\"t.toml\"]
//- /t.toml
codel.plan = 20
codel.look = 1
program.\"Quick/update\" = 5
";

    #[test]
    fn programs_states_and_transitions_have_their_times() {
        check(
            MACHINE,
            expect![[r#"
                initial state Waiting {⟨≤ 2 ms per period at 1e-4⟩
                transition go if (look() > 0) to Moving⟨≤ 2 ms per period⟩
                state Moving {⟨≤ 21 ms per period at 1e-4⟩ entry = { look(); }⟨1 ms⟩  run = {⟨20 ms⟩
                } exit = { }  transition done to Waiting { look(); }⟨≤ 21 ms per period⟩ }
                core U(S) { update = { plan(); }⟨5 ms (Quick), 20 ms (Slow) at 1e-4⟩ }
            "#]],
        );
        // Where the time of one component is unknown, nothing is said that may be taken for it.
        check(&MACHINE.replace("codel.plan = 20\n", ""), expect!["\n\n"]);
        let off = HintKinds { program_times: false, ..HintKinds::default() };
        check_kinds(MACHINE, off, expect!["\n\n"]);
    }

    const VALUES: &str = "
shell S { constant base: int = 2  property rate: int = base * 3  property name: string  property x: double = 1  property y: int = 1 }
core C(S) { update = { } }
component P(S, C)
architecture A {
  instance a: P
  instance b: P
  instance c: Unknown
  property a.rate = 4 + 4
  property b.name = \"é\"
}
deployment D {
  architecture A
  activity a { priority = 2 period = 10 }
  property a.rate = 9
  property b.rate = 6
  property b.x = 2
  property b.nothing = 2
}
";

    #[test]
    fn the_values_that_count() {
        let only = HintKinds {
            response_times: false,
            loads: false,
            defaults: false,
            program_times: false,
            values: true,
        };
        check_kinds(
            VALUES,
            only,
            expect![[r#"
                instance a: P⟨base = 2, rate = 8, x = 1 and 1 more⟩
                instance b: P⟨base = 2, name = "é", rate = 6 and 2 more⟩
                property a.rate = 4 + 4⟨= 8⟩
                property a.rate = 9⟨overrides 8⟩
                property b.x = 2⟨overrides 1⟩
            "#]],
        );
        check_kinds(VALUES, HintKinds { values: false, ..only }, expect!["\n\n"]);
    }

    #[test]
    fn each_kind_can_be_left_out() {
        let text = robot(
            "deployment D {\n architecture A\n activity driver { priority = 2 period = 50 }\n \
             activity planner { priority = 1 period = 200 } }",
            "codel.plan = 70\ncodel.drive = 17",
        );
        let none = HintKinds {
            response_times: false,
            loads: false,
            defaults: false,
            program_times: false,
            values: false,
        };
        check_kinds(&text, none, expect!["\n\n"]);
        check_kinds(
            &text,
            HintKinds { response_times: true, ..none },
            expect![[r#"
            deployment D {⟨2 of 2 deadlines met at 1e-4⟩
            activity driver { priority = 2 period = 50 }⟨R 17 ms ≤ 50 ms · slack 33 ms⟩
            activity planner { priority = 1 period = 200 }⟨R 121 ms ≤ 200 ms · slack 79 ms⟩ }
        "#]],
        );
        check_kinds(
            &text,
            HintKinds { loads: true, ..none },
            expect![[r#"
            deployment D {⟨CPU 1 69.0 %⟩
        "#]],
        );
        // Where no CPU is known, there is no load, and no hint without words.
        let lost = text.replace("codel.plan = 70", "codel.plan = ");
        check_kinds(&lost, HintKinds { loads: true, ..none }, expect!["\n\n"]);
        check_kinds(
            &text,
            HintKinds { defaults: true, ..none },
            expect![[r#"
            activity driver { priority = 2 period = 50⟨ deadline = 50⟩ }
            activity planner { priority = 1 period = 200⟨ deadline = 200⟩ } }
        "#]],
        );
    }

    #[test]
    fn an_edit_of_another_file_builds_no_hints_again() {
        let deployment = "include \"parts.mal\"\ndeployment D { architecture A  \
            activity driver { priority = 2 period = 50 }  activity planner { priority = 1 period = 200 } }";
        let files = [
            ("/robot.mal".into(), deployment.to_owned()),
            ("/parts.mal".into(), PARTS.to_owned()),
            ("/mauve.toml".into(), "timing.tables = [\"times.toml\"]".to_owned()),
            ("/times.toml".into(), "codel.plan = 70\ncodel.drive = 17".to_owned()),
        ];
        let mut db = mauve_hir::Database::with_log();
        let workspace = Workspace::of_texts(&db, "/".into(), files);
        let [file, parts] =
            ["/robot.mal", "/parts.mal"].map(|path| workspace.file(&db, path.as_ref()).unwrap());
        let all = TextRange::up_to(TextSize::of(deployment));
        let hash = |db: &mauve_hir::Database| hash_of_hints(db, &[workspace], file, HintKinds::default());
        let before = (hash(&db), inlay_hints(&db, &[workspace], file, all, HintKinds::default()));
        assert!(db.take_log().executed.iter().any(|query| query == "of_declaration"));
        for (from, to, is_same) in [
            ("shell S", "// a comment\nshell S", true),
            ("{ plan(); }", "{ plan(); if 1 > 2 then { } else { } }", true),
            ("{ plan(); }", "{ plan(); plan(); }", false),
        ] {
            parts.set_text(&mut db, PARTS.replace(from, to).into());
            assert_eq!(hash(&db) == before.0, is_same, "{to}");
            let hints = inlay_hints(&db, &[workspace], file, all, HintKinds::default());
            assert_eq!(hints == before.1, is_same, "{to}");
            let executed = db.take_log().executed;
            let count = executed.iter().filter(|query| *query == "of_declaration").count();
            assert_eq!(count, usize::from(!is_same), "{to}: {executed:?}");
        }
    }

    #[test]
    fn an_edit_that_changes_no_time_builds_no_labels_again() {
        let text = "codel plan(in goal: int): int\nshell S { }\ncore K(S) { var goal: int = 0; statemachine {\n\
            initial state A { run = { goal = 1; goal = plan(goal); } } } }\ncomponent C(S, K)\n";
        let files = [
            ("/robot.mal".into(), text.to_owned()),
            ("/mauve.toml".into(), "timing.tables = [\"times.toml\"]".to_owned()),
            ("/times.toml".into(), "codel.plan = 70".to_owned()),
        ];
        let mut db = mauve_hir::Database::with_log();
        let workspace = Workspace::of_texts(&db, "/".into(), files);
        let file = workspace.file(&db, "/robot.mal".as_ref()).unwrap();
        let mut built = |text: String| {
            file.set_text(&mut db, text.into());
            hash_of_hints(&db, &[workspace], file, HintKinds::default());
            db.take_log().executed.iter().filter(|query| *query == "labels_of").count()
        };
        assert_eq!(built(text.to_owned()), 1);
        assert_eq!(built(text.replace("goal = 1;", "goal = 2;")), 0);
        assert_eq!(built(text.replace("goal = 1;", "goal = plan(1);")), 1);
    }
}
