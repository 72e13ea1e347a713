//! What else a deployment could be: other priorities, another CPU, another period, each offered with the response times
//! that it gives.
//!
//! [`mauve_wcrt::better_timing`] finds them. A file may be part of several projects, in which other times count: what is
//! found in one of them is analysed in every one. Nothing is offered with which a deadline is lost that is proved now, in any
//! of them; where they differ, the title says what comes out of each. It says also which warnings there are then that there
//! are not now.

use std::collections::BTreeSet;

use mauve_diagnostics::{Diagnostic, Finding, cpu_names, diagnostics_if};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Location, ModelDb, Project, declaration_at, deployment};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::{Level, Status};
use mauve_wcrt::better_timing::{
    BetterTiming, TimingChange, better_activity, better_priorities, is_no_worse, least_slack,
};
use mauve_wcrt::{
    Deadlines, Query, Report, Verdict, WhatIfField, response_times, response_times_if, system_of,
};

use crate::Change;
use crate::code_actions::{ActionKind, Actions, CodeAction};
use crate::project::name_of_root;

/// What the search for optimal priorities is called.
const OPTIMAL: &str = "Optimal priorities (Audsley's)";

/// In so many projects something better is looked for; a deployment is rarely part of more than one.
const MOST_PROJECTS: usize = 4;

/// Offers what there is at the cursor.
pub(crate) fn offer(actions: &mut Actions<'_, '_>) {
    if !actions.wants(ActionKind::Rewrite) && !actions.wants(ActionKind::QuickFix) {
        return;
    }
    let Some(node) = actions.node::<ast::Deployment>() else { return };
    let Some(deployment) = deployment_of(actions, node.syntax().text_range().start()) else { return };
    let activity = actions.node::<ast::Activity>();
    let name = activity.as_ref().and_then(|it| it.name_ref()).map(|name| name.syntax().text_range());
    let db = actions.db;
    let projects = actions.projects.clone();
    let mut found: Vec<(&BetterTiming, Vec<Project<'_>>)> = Vec::new();
    for &project in projects.iter().take(MOST_PROJECTS) {
        let query = Query::shown(db, project);
        let activities = &system_of(db, project, deployment).activities;
        let index = name.and_then(|at| activities.iter().position(|it| it.at.range(db) == at));
        let of_activity = index.map(|index| better_activity(db, project, deployment, index, query));
        let offers = better_priorities(db, project, deployment, query).iter();
        for offer in offers.chain(of_activity.into_iter().flatten()) {
            match found.iter_mut().find(|(known, _)| is_same(known, offer)) {
                Some((_, having)) => having.push(project),
                None => found.push((offer, vec![project])),
            }
        }
    }
    let wrong = activity.map_or_else(Vec::new, |it| wrong_in(actions, it.syntax().text_range()));
    for (offer, having) in found {
        match offer {
            BetterTiming::NoPriorities(names) => {
                let title = match having.len() < projects.len() {
                    true => format!("{OPTIMAL} {}", in_projects(db, &having)),
                    false => OPTIMAL.to_owned(),
                };
                actions.refuse(ActionKind::Rewrite, title, no_priorities(names));
            }
            BetterTiming::Change(what, fields) => {
                let outcomes: Vec<(Project<'_>, &Outcome<'_>)> = projects
                    .iter()
                    .map(|&project| {
                        let query = Query::shown(db, project);
                        (project, outcome_of(db, project, deployment, query, fields.clone()))
                    })
                    .collect();
                if outcomes.iter().any(|(_, outcome)| outcome.loses) {
                    continue;
                }
                let is_left = |it: &&Finding<'_>| {
                    let what = (it.diagnostic.code.name, it.diagnostic.at.clone());
                    outcomes.iter().any(|(_, outcome)| outcome.wrong.contains(&what))
                };
                let mends: Vec<Finding<'_>> = wrong.iter().filter(|it| !is_left(it)).cloned().collect();
                let action = CodeAction {
                    title: format!("{}: {}", title(what), said(db, &outcomes)),
                    kind: if mends.is_empty() { ActionKind::Rewrite } else { ActionKind::QuickFix },
                    preferred: false,
                    mends,
                    disabled: None,
                    change: None,
                };
                actions.push(action, || change(db, deployment, fields));
            }
        }
    }
}

/// What comes out in all projects, or where they differ, in each.
fn said(db: &dyn ModelDb, outcomes: &[(Project<'_>, &Outcome<'_>)]) -> String {
    let mut said: Vec<(&str, Vec<Project<'_>>)> = Vec::new();
    for (project, outcome) in outcomes {
        match said.iter_mut().find(|(known, _)| *known == outcome.said) {
            Some((_, having)) => having.push(*project),
            None => said.push((&outcome.said, vec![*project])),
        }
    }
    let differ = said.len() > 1;
    let each = said.into_iter().map(|(said, having)| match differ {
        true => format!("{said} {}", in_projects(db, &having)),
        false => said.to_owned(),
    });
    each.collect::<Vec<_>>().join("; ")
}

fn in_projects(db: &dyn ModelDb, projects: &[Project<'_>]) -> String {
    let roots: Vec<String> = projects.iter().map(|&project| name_of_root(db, project)).collect();
    format!("(in the project of {})", roots.join(", "))
}

/// The deployment that begins there.
fn deployment_of<'db>(actions: &Actions<'_, 'db>, start: TextSize) -> Option<Decl<'db>> {
    let found = declaration_at(actions.db, actions.question.file, TextRange::empty(start))?;
    deployment(actions.db, found).map(|_| found)
}

/// What is wrong with the timing of an activity, as it is shown.
fn wrong_in<'db>(actions: &Actions<'_, 'db>, activity: TextRange) -> Vec<Finding<'db>> {
    const CODES: [&str; 4] =
        ["deadline-missed", "not-deadline-monotonic", "equal-priorities", "deadline-exceeds-period"];
    if !actions.wants(ActionKind::QuickFix) {
        return Vec::new();
    }
    let is_it = |diagnostic: &Diagnostic<'db>| {
        CODES.contains(&diagnostic.code.name) && activity.contains_range(diagnostic.at.range(actions.db))
    };
    actions.findings().iter().filter(|it| is_it(&it.diagnostic)).cloned().collect()
}

/// Whether two findings set the same values, or are the same.
fn is_same(one: &BetterTiming, other: &BetterTiming) -> bool {
    match (one, other) {
        (BetterTiming::Change(_, one), BetterTiming::Change(_, other)) => {
            one.len() == other.len() && one.iter().all(|field| other.contains(field))
        }
        _ => one == other,
    }
}

/// What a change is called.
fn title(change: &TimingChange) -> String {
    match change {
        TimingChange::SwapPriorities(one, other) => format!("Swap the priorities of {one} and {other}"),
        TimingChange::PrioritiesByDeadline => "Priorities by deadline (deadline-monotonic)".to_owned(),
        TimingChange::OptimalPriorities => OPTIMAL.to_owned(),
        TimingChange::PeriodAsDeadline(text) => format!("Period {text} ms, as the deadline"),
        TimingChange::DeadlineAsPeriod(period) => format!("Deadline {period}, as the period"),
        TimingChange::Cpu(cpu) => format!("Move to {}", cpu_names(*cpu)),
        TimingChange::Period { is_longer, with_deadline, period, step } => {
            let which = if *is_longer { "Longer" } else { "Shorter" };
            let and = if *with_deadline { " and deadline" } else { "" };
            format!("{which} period{and}, {period} (the shortest found, in steps of {step})")
        }
    }
}

fn no_priorities(names: &[Name]) -> String {
    format!(
        "no order of priorities is found with which every deadline is proved: below the others, none of {} would meet its \
         own",
        names.join(", ")
    )
}

/// What some values give in one project, as far as it is shown.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
struct Outcome<'db> {
    /// In words.
    said: String,
    /// Is a deadline not proved then that is now, or a response time without a bound?
    loses: bool,
    /// What is wrong then.
    wrong: Vec<(&'static str, Location<'db>)>,
}

#[salsa::tracked(returns(ref))]
fn outcome_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
    fields: Vec<WhatIfField>,
) -> Outcome<'db> {
    let now = response_times(db, project, of, query);
    let then = response_times_if(db, project, of, query, &fields);
    let code = |it: Diagnostic<'db>| (it.code.name, it.at);
    let wrong_now: Vec<_> = diagnostics_if(db, project, of, &[]).into_iter().map(code).collect();
    let mut wrong: Vec<_> = diagnostics_if(db, project, of, &fields).into_iter().map(code).collect();
    let new: BTreeSet<&str> =
        wrong.iter().filter(|it| !wrong_now.contains(it)).map(|(code, _)| *code).collect();
    let mut said = outcome(&then, query.level);
    if !new.is_empty() {
        said += &format!(", with a new warning, {}", new.into_iter().collect::<Vec<_>>().join(", "));
    }
    let late = then.activities.iter().filter(|it| !it.verdict.is_met());
    wrong.extend(late.filter_map(|it| Some(("deadline-missed", it.at.clone()?))));
    Outcome { said, loses: !is_no_worse(now, &then), wrong }
}

/// What a deployment gives, in a few words.
fn outcome(report: &Report<'_>, level: Level) -> String {
    const SHOWN: usize = 2;
    let Deadlines { met, all, .. } = report.deadlines();
    let assumed =
        if report.activities.iter().any(|it| !it.assumed.is_empty()) { ", times assumed" } else { "" };
    if met == all
        && let Some((slack, name)) = least_slack(report)
    {
        return match all {
            1 => format!("{name} meets its deadline at {level}, slack {slack}{assumed}"),
            _ => format!("all {all} meet their deadlines at {level}, worst slack {slack} ({name}){assumed}"),
        };
    }
    let failing = report.activities.iter().filter(|it| !it.verdict.is_met());
    let said: Vec<String> = failing
        .map(|it| {
            let name = &it.instance;
            match (it.verdict, it.response, it.deadline) {
                (Verdict::RealTime(Status::Missed), Some(response), Some(deadline)) => {
                    format!("{name} R {response} > {deadline}")
                }
                (Verdict::RealTime(Status::NotAnalysed), ..) => format!("{name} not analysed"),
                (Verdict::RealTime(Status::Unbounded), ..) => format!("{name} unbounded"),
                _ => format!("{name} no bound"),
            }
        })
        .collect();
    let more = match said.len().checked_sub(SHOWN).filter(|more| *more > 0) {
        Some(more) => format!(" and {more} more"),
        None => String::new(),
    };
    let shown: Vec<&str> = said.iter().map(String::as_str).take(SHOWN).collect();
    format!("{}{more} ({met} of {all} deadlines met at {level}{assumed})", shown.join(", "))
}

/// What writes these values into the text.
fn change(db: &dyn ModelDb, of: Decl<'_>, fields: &[WhatIfField]) -> Change {
    let mut change = Change::default();
    let Some(data) = deployment(db, of) else { return change };
    let place = |id| Location::Source(of, id);
    for WhatIfField { instance, field, value } in fields {
        let Some(activity) = data.activities.iter().find(|it| it.instance.name == *instance) else {
            continue;
        };
        if let Some(known) = activity.fields.iter().find(|it| it.name.name == field.keyword()) {
            let at = place(known.value_id);
            change.replace(at.file(db), Replacement { range: at.range(db), text: value.to_string() });
        } else if let Some(last) = activity.fields.last() {
            let (name, end) = (place(last.name.id), place(last.value_id).range(db).end());
            let file = name.file(db);
            let before = indentation(file.text(db), name.range(db).start());
            let text = format!("{before}{} = {value}", field.keyword());
            change.replace(file, Replacement { range: TextRange::empty(end), text });
        }
    }
    change
}

/// What stands between two fields: where the one that begins at `offset` has a line of its own, so has the next.
fn indentation(text: &str, offset: TextSize) -> String {
    let before = text.get(..usize::from(offset)).unwrap_or_default();
    let line = before.rsplit('\n').next().unwrap_or_default();
    let is_alone = line.len() < before.len() && line.trim().is_empty();
    if is_alone { format!("\n{line}") } else { " ".to_owned() }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::PathBuf;

    use super::*;
    use crate::fixture::Fixture;
    use crate::{ActionQuestion, Changes, code_actions};
    use expect_test::{Expect, expect};
    use mauve_diagnostics::workspace_diagnostics;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};
    use mauve_tests::Random;
    use mauve_wcrt::ActivityReport;
    use salsa::Setter as _;

    /// The first file of a robot with a component for each instance: `(name, cost)`.
    fn robot(costs: &[(&str, &str)], deployment: &str, config: &str) -> String {
        let mut model = String::from("shell S { }\n");
        let mut architecture = String::from("architecture A {");
        let mut table = String::new();
        for (name, cost) in costs {
            let _ = writeln!(model, "codel {name}_run(): int");
            let _ = writeln!(
                model,
                "core C_{name}(S) {{ update = {{ {name}_run(); }} }}  component K_{name}(S, C_{name})"
            );
            let _ = write!(architecture, " instance {name}: K_{name}");
            let _ = writeln!(table, "codel.{name}_run = {cost}");
        }
        format!(
            "{model}{architecture} }}\n{deployment}\n//- /mauve.toml\n[timing]\ntables = [\"times.toml\"]\n[platform]\n\
             rt_throttling = false\n{config}\n//- /times.toml\n{table}"
        )
    }

    /// What matters of a report, wherever it stands.
    fn figures(report: &Report<'_>) -> String {
        let mut out = format!("{:?}\n", report.cpus);
        for it in &report.activities {
            let ActivityReport { instance, priority, cpus, period, deadline, .. } = it;
            let activity = (instance, priority, cpus, period, deadline);
            let _ = writeln!(
                out,
                "{activity:?} {:?} {:?} {:?} {:?} {:?} {:?}",
                it.own, it.first_job, it.response, it.verdict, it.window, it.interference
            );
        }
        out
    }

    fn codes(db: &Database, workspace: Workspace) -> Vec<&'static str> {
        workspace_diagnostics(db, workspace).iter().map(|it| it.diagnostic.code.name).collect()
    }

    /// Every offer at the cursor, each applied to the text and analysed anew: it gives what was said.
    fn offered(fixture: &str) -> Vec<String> {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let activities = &system_of(&db, project, deployment).activities;
        let index = activities.iter().position(|it| it.at.range(&db).contains_inclusive(offset));
        let query = Query::shown(&db, project);
        let mut offers = better_priorities(&db, project, deployment, query).clone();
        let of_activity = index.map(|index| better_activity(&db, project, deployment, index, query));
        offers.extend(of_activity.into_iter().flatten().cloned());
        let question = ActionQuestion {
            file,
            range: TextRange::empty(offset),
            diagnostics: &[],
            kinds: &[ActionKind::Rewrite, ActionKind::QuickFix],
            changes: Changes::All,
        };
        let actions = code_actions(&db, &[workspace], question);
        let met =
            |report: &Report<'_>| report.activities.iter().map(|it| it.verdict.is_met()).collect::<Vec<_>>();
        let is_no_worse_than =
            |now: &[bool], then: &[bool]| now.iter().zip(then).all(|(now, then)| !now || *then);
        let now = met(response_times(&db, project, deployment, query));
        let before = codes(&db, workspace);
        let mut said = Vec::new();
        for offer in offers.clone() {
            let (what, fields) = match &offer {
                BetterTiming::Change(what, fields) => (what, fields),
                BetterTiming::NoPriorities(names) => {
                    assert!(actions.iter().any(|action| action.title == OPTIMAL), "{fixture}");
                    said.push(format!("{OPTIMAL} ✗ {}", no_priorities(names)));
                    continue;
                }
            };
            let outcome_now = outcome_of(&db, project, deployment, query, fields.clone());
            let title = format!("{}: {}", title(what), outcome_now.said);
            let Some(action) = actions.iter().find(|action| action.title == title) else {
                // Two may do the same, and some would cost a deadline.
                let is_twin = |it: &&BetterTiming| is_same(it, &offer);
                assert!(outcome_now.loses || offers.iter().filter(is_twin).count() > 1, "{title}\n{fixture}");
                continue;
            };
            let report = response_times_if(&db, project, deployment, query, fields);
            let change = action.change.as_ref().unwrap();
            let texts =
                workspace.files(&db).iter().map(|(path, file)| (path.clone(), change.applied(&db, *file)));
            let texts: Vec<(PathBuf, String)> = texts.collect();
            let new = Database::default();
            let workspace = Workspace::of_texts(&new, "/".into(), texts);
            let project = projects(&new, workspace)[0];
            let deployment = names_of(&new, project).anywhere(Kind::Deployment, "D")[0];
            let query = Query::shown(&new, project);
            let applied = response_times(&new, project, deployment, query);
            assert_eq!(figures(applied), figures(&report), "{title}\n{fixture}");
            assert!(title.contains(&outcome(applied, query.level)), "{title}\n{fixture}");
            // No deadline is lost, and no warning comes unsaid.
            assert!(is_no_worse_than(&now, &met(applied)), "{title}\n{fixture}");
            let after = codes(&new, workspace);
            for code in
                ["not-deadline-monotonic", "equal-priorities", "stale-data", "deadline-exceeds-period"]
            {
                let is_new = after.iter().filter(|it| **it == code).count()
                    > before.iter().filter(|it| **it == code).count();
                assert!(!is_new || title.contains(code), "{code}: {title}\n{fixture}");
            }
            let kind = if action.kind == ActionKind::QuickFix { " (mends)" } else { "" };
            said.push(format!("{title}{kind}"));
        }
        said
    }

    fn check(fixture: &str, expected: Expect) {
        expected.assert_eq(&(offered(fixture).join("\n") + "\n"));
    }

    #[test]
    fn priorities_by_deadline() {
        let costs = [("laser", "40"), ("pilot", "20")];
        let deployment = "deployment D { architecture A $0
            activity laser { priority = 9 period = 100 }
            activity pilot { priority = 5 period = 50 deadline = 40 }
        }";
        check(
            &robot(&costs, deployment, ""),
            expect![[r#"
                Priorities by deadline (deadline-monotonic): all 2 meet their deadlines at 1e-4, worst slack 20 ms (laser)
            "#]],
        );
    }

    #[test]
    fn priorities_are_swapped_where_no_deadline_is_lost() {
        let costs = [("a", "5"), ("b", "10"), ("c", "20")];
        let deployment = "deployment D { architecture A
            activity a { affinity = 1 priority = 3 period = 100 deadline = 50 }
            activity b { priority = 2 period = 100 deadline = 20 }
            activity c { priority = 1 period = 100 deadline = 40 }
        }";
        let at = |name: &str| {
            robot(&costs, &deployment.replace(&format!("activity {name}"), &format!("activity $0{name}")), "")
        };
        // With the most urgent below, b would miss its deadline: 30 > 20.
        check(
            &at("c"),
            expect![[r#"
                Priorities by deadline (deadline-monotonic): all 3 meet their deadlines at 1e-4, worst slack 10 ms (b)
                Deadline 100 ms, as the period: all 3 meet their deadlines at 1e-4, worst slack 5 ms (b), with a new warning, not-deadline-monotonic
                Shorter period and deadline, 35 ms (the shortest found, in steps of 1 ms): all 3 meet their deadlines at 1e-4, worst slack 0 ms (c)
            "#]],
        );
        check(
            &at("b"),
            expect![[r#"
                Priorities by deadline (deadline-monotonic): all 3 meet their deadlines at 1e-4, worst slack 10 ms (b)
                Swap the priorities of b and a: all 3 meet their deadlines at 1e-4, worst slack 5 ms (c), with a new warning, not-deadline-monotonic
                Deadline 100 ms, as the period: all 3 meet their deadlines at 1e-4, worst slack 5 ms (c), with a new warning, not-deadline-monotonic
                Shorter period, 35 ms (the shortest found, in steps of 1 ms): all 3 meet their deadlines at 1e-4, worst slack 5 ms (b)
            "#]],
        );
        check(
            &at("a"),
            expect![[r#"
                Priorities by deadline (deadline-monotonic): all 3 meet their deadlines at 1e-4, worst slack 10 ms (b) (mends)
                Deadline 100 ms, as the period: all 3 meet their deadlines at 1e-4, worst slack 5 ms (b)
                Shorter period and deadline, 20 ms (the shortest found, in steps of 1 ms): all 3 meet their deadlines at 1e-4, worst slack 0 ms (c) (mends)
            "#]],
        );
    }

    #[test]
    fn a_deadline_later_than_the_period_may_be_the_period() {
        let deployment = "deployment D { architecture A
            activity $0laser { priority = 2 period = 50 deadline = 80 }
            activity pilot { priority = 1 period = 200 deadline = 150 }
        }";
        check(
            &robot(&[("laser", "40"), ("pilot", "30")], deployment, ""),
            expect![[r#"
            Period 80 ms, as the deadline: all 2 meet their deadlines at 1e-4, worst slack 40 ms (laser) (mends)
        "#]],
        );
    }

    /// What is offered at `$0` of a file that two projects have, in which other times count.
    fn offered_in_two(deployment: &str, one: [&str; 2], two: [&str; 2]) -> String {
        let shared = "shell S { }\ncomponent Laser(S, C)  component Pilot(S, E)\n\
                      architecture A { instance laser: Laser  instance pilot: Pilot }\n";
        let root = |[laser, pilot]: [&str; 2]| {
            format!(
                "include \"shared.mal\"\ncodel short(): int  codel long(): int\ncore C(S) {{ update = {{ {laser}(); }} }}\n\
                 core E(S) {{ update = {{ {pilot}(); }} }}"
            )
        };
        let fixture = format!(
            "//- /shared.mal\n{shared}{deployment}\n//- /one.mal\n{}\n//- /two.mal\n{}\n//- /mauve.toml\n[project]\n\
             roots = [\"one.mal\", \"two.mal\"]\n[timing]\ntables = [\"times.toml\"]\n[platform]\n\
             rt_throttling = false\ncpus = 2\n//- /times.toml\n[codel]\nshort = 10\nlong = 60\n",
            root(one),
            root(two),
        );
        let Fixture { db, workspace, file, offset } = Fixture::new(&fixture);
        let kinds = &[ActionKind::Rewrite, ActionKind::QuickFix];
        let range = TextRange::empty(offset);
        let question = ActionQuestion { file, range, diagnostics: &[], kinds, changes: Changes::None };
        let actions = code_actions(&db, &[workspace], question);
        let titles = actions.into_iter().map(|action| action.title).filter(|title| title.contains("1e-4"));
        titles.map(|title| title + "\n").collect()
    }

    #[test]
    fn what_is_offered_is_known_of_every_project_that_has_the_file() {
        let deployment = "deployment D { architecture A
            activity $0laser { affinity = 1 priority = 2 period = 100 }
            activity pilot { affinity = 2 priority = 1 period = 100 } }";
        // On one CPU, the two of the second project ask for more than it has; 10 ms are too short in it.
        expect![[r#"
            Shorter period, 60 ms (the shortest found, in steps of 1 ms): all 2 meet their deadlines at 1e-4, worst slack 50 ms (laser) (in the project of one.mal); all 2 meet their deadlines at 1e-4, worst slack 0 ms (laser) (in the project of two.mal)
        "#]].assert_eq(&offered_in_two(deployment, ["short", "short"], ["long", "long"]));
        let alike = offered_in_two(deployment, ["short", "long"], ["short", "long"]);
        assert!(alike.contains("Move to CPU 2") && !alike.contains("in the project"), "{alike}");
        // What is missed in one of them may be mended where nothing is lost in the other.
        let deployment = "deployment D { architecture A
            activity laser { affinity = 1 priority = 2 period = 100 }
            activity $0pilot { affinity = 1 priority = 1 period = 100 deadline = 50 } }";
        expect![[r#"
            Priorities by deadline (deadline-monotonic): all 2 meet their deadlines at 1e-4, worst slack 40 ms (pilot) (in the project of one.mal); all 2 meet their deadlines at 1e-4, worst slack 30 ms (laser) (in the project of two.mal)
            Deadline 100 ms, as the period: all 2 meet their deadlines at 1e-4, worst slack 80 ms (pilot) (in the project of one.mal); all 2 meet their deadlines at 1e-4, worst slack 30 ms (pilot) (in the project of two.mal)
            Move to CPU 2: all 2 meet their deadlines at 1e-4, worst slack 40 ms (pilot) (in the project of one.mal); all 2 meet their deadlines at 1e-4, worst slack 40 ms (laser) (in the project of two.mal)
        "#]].assert_eq(&offered_in_two(deployment, ["short", "short"], ["long", "short"]));
    }

    #[test]
    fn where_no_order_of_priorities_helps_that_is_said() {
        let costs = [("laser", "40"), ("pilot", "20"), ("arm", "1")];
        let deployment = "deployment D { architecture A
            activity arm { priority = 9 period = 10 }
            activity la$0ser { priority = 8 period = 60 }
            activity pilot { priority = 5 period = 60 }
        }";
        check(
            &robot(&costs, deployment, ""),
            expect![[r#"
                Optimal priorities (Audsley's) ✗ no order of priorities is found with which every deadline is proved: below the others, none of arm, laser, pilot would meet its own
            "#]],
        );
    }

    #[test]
    fn a_missed_deadline_has_other_cpus_and_longer_periods() {
        let costs = [("laser", "40"), ("pilot", "20"), ("arm", "30")];
        let deployment = "deployment D { architecture A
            activity laser { priority = 9 affinity = 1 period = 100 deadline = 100 }
            activity arm { priority = 8 affinity = 2 period = 60 deadline = 60 }
            activity $0pilot {
                priority = 5
                affinity = 1
                period = 50
                deadline = 50
            }
        }";
        check(
            &robot(&costs, deployment, "cpus = 3"),
            expect![[r#"
            Priorities by deadline (deadline-monotonic): all 3 meet their deadlines at 1e-4, worst slack 20 ms (laser) (mends)
            Longer period and deadline, 60 ms (the shortest found, in steps of 0.1 ms): all 3 meet their deadlines at 1e-4, worst slack 0 ms (pilot) (mends)
            Move to CPU 3: all 3 meet their deadlines at 1e-4, worst slack 30 ms (arm) (mends)
            Move to CPU 2: all 3 meet their deadlines at 1e-4, worst slack 0 ms (pilot) (mends)
        "#]],
        );
    }

    #[test]
    fn while_all_is_well_the_shortest_period_is_offered() {
        let costs = [("laser", "40"), ("pilot", "20")];
        let deployment = "deployment D { architecture A
            activity $0laser { priority = 9 period = 100 }
            activity pilot { priority = 5 period = 200 deadline = 150 }
        }";
        check(
            &robot(&costs, deployment, ""),
            expect![[r#"
            Shorter period, 47 ms (the shortest found, in steps of 1 ms): all 2 meet their deadlines at 1e-4, worst slack 7 ms (laser)
        "#]],
        );
        let deployment = "deployment D { architecture A
            activity laser { priority = 9 period = 100 }
            activity $0pilot { priority = 5 period = 200 deadline = 150 }
        }";
        check(
            &robot(&costs, deployment, ""),
            expect![[r#"
                Deadline 200 ms, as the period: all 2 meet their deadlines at 1e-4, worst slack 60 ms (laser)
                Shorter period and deadline, 60 ms (the shortest found, in steps of 1 ms): all 2 meet their deadlines at 1e-4, worst slack 0 ms (pilot), with a new warning, not-deadline-monotonic
            "#]],
        );
    }

    #[test]
    fn nothing_is_offered_where_nothing_is_known() {
        let costs = [("laser", "40"), ("pilot", "20")];
        for deployment in [
            "deployment D { architecture A activity $0laser { priority = 9 period = 100 } activity pilot { priority = } }",
            "deployment D { architecture B activity $0laser { priority = 9 period = 100 } }",
            "deployment D { architecture A activity $0 { priority = 9 period = 100 } }",
        ] {
            assert_eq!(offered(&robot(&costs, deployment, "")), [] as [&str; 0], "{deployment}");
        }
    }

    #[test]
    fn a_field_that_is_left_out_is_written_behind_the_last() {
        let text = "deployment D { architecture A activity a { priority = 1\n  period = 100 /* é */\n} }";
        assert_eq!(indentation(text, TextSize::new(text.find("period").unwrap() as u32)), "\n  ");
        assert_eq!(indentation(text, TextSize::new(text.find("priority").unwrap() as u32)), " ");
    }

    #[test]
    fn a_question_that_is_repeated_is_not_searched_for_again() {
        let costs = [("laser", "40"), ("pilot", "20")];
        let text = robot(
            &costs,
            "deployment D { architecture A activity laser { priority = 9 period = 100 } \
             activity pilot { priority = 5 period = 90 } }\n//- /other.mal\nshell Other { }",
            "",
        );
        let Fixture { mut db, workspace, .. } = Fixture::new(&text);
        // What is kept stays where it is.
        let found = |db: &Database| {
            let project = projects(db, workspace)[0];
            let of = names_of(db, project).anywhere(Kind::Deployment, "D")[0];
            let query = Query::shown(db, project);
            let of_row = better_activity(db, project, of, 1, query);
            let of_all = better_priorities(db, project, of, query);
            assert!(!of_all.is_empty() && !of_row.is_empty());
            [of_all.as_ptr(), of_row.as_ptr()]
        };
        let first = found(&db);
        assert_eq!(found(&db), first);
        let other = workspace.file(&db, "/other.mal".as_ref()).unwrap();
        other.set_text(&mut db).to("shell Other { /* é */ }".into());
        assert_eq!(found(&db), first);
    }

    #[test]
    fn what_is_said_is_what_comes_out_of_random_deployments() {
        let mut count = 0;
        for seed in 0..60 {
            let mut random = Random(0x9E37 + seed * 7919);
            let names = ["a", "b", "c", "d", "e"];
            let tasks = 1 + random.below(names.len());
            let mut costs = Vec::new();
            let mut activities = String::new();
            let cursor = random.below(tasks);
            for (index, name) in names.iter().take(tasks).enumerate() {
                let period = *random.of(&[10, 20, 25, 50, 100]);
                costs.push((*name, format!("{}.{}", random.below(period / 2), random.below(10))));
                let mark = if index == cursor { "$0" } else { "" };
                let _ = write!(
                    activities,
                    "activity {mark}{name} {{ priority = {} period = {period}",
                    1 + random.below(6)
                );
                match random.below(4) {
                    0 => {}
                    1 => activities += &format!(" deadline = {period}"),
                    2 => activities += &format!(" deadline = {}", 1 + random.below(period)),
                    _ => activities += &format!(" deadline = {}", period + 5),
                }
                match random.below(6) {
                    0 => {}
                    1 => activities += " affinity = 3",
                    other => activities += &format!(" affinity = {}", 1 + other % 2),
                }
                activities += " }\n";
            }
            let costs: Vec<(&str, &str)> = costs.iter().map(|(name, cost)| (*name, cost.as_str())).collect();
            let config = random.of(&["", "cpus = 2", "cpus = 3"]);
            let fixture = robot(&costs, &format!("deployment D {{ architecture A\n{activities}}}"), config);
            count += offered(&fixture).len();
        }
        assert!(count > 100, "{count}");
    }
}
