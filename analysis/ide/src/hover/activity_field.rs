//! The affinity and the priority of an activity in words: the CPUs of the mask and their utilisation, and the activities of a
//! higher or equal priority.

use mauve_diagnostics::known_utilisation;
use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, Hosts, PERIODS, declaration_at, hosts_of};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::keywords::ActivityField;
use mauve_timing::{Task, Time, name_of_other};
use mauve_wcrt::{Priority, Query, ResolvedActivity, response_times, system_of};

use super::format::{Hover, HoverContext, and_more};

/// Names at most this many activities of higher or equal priority.
const MOST_ACTIVITIES: usize = 12;

/// Returns the hover of a field of an activity, or of its value. Its range is that of the field.
pub(super) fn of_field(cx: &HoverContext<'_, '_>) -> Option<Hover> {
    let HoverContext { db, project, file, .. } = *cx;
    let tokens = cx.tokens().filter(|token| !token.kind().is_trivia());
    let fields = tokens.filter_map(|it| it.parent_ancestors().find_map(ast::Field::cast));
    let field = fields.last()?;
    let kind = field.field()?;
    let whole = field.syntax().ancestors().find_map(ast::Activity::cast)?.syntax().text_range();
    let deployment = declaration_at(db, file, whole).filter(|decl| decl.kind(db) == Kind::Deployment)?;
    let activities = &system_of(db, project, deployment).activities;
    let is_here =
        |it: &&ResolvedActivity<'_>| it.at.range_in(db, file).is_some_and(|at| whole.contains_range(at));
    let activity = activities.iter().find(is_here)?;
    let markdown = match kind {
        ActivityField::Affinity | ActivityField::Cpus => affinity(cx, deployment, activity)?,
        ActivityField::Rate => computed("A period of", activity.period?, activity.is_exact),
        ActivityField::Deadline if is_quotient(&field) => computed("A deadline of", activity.deadline?, true),
        _ if is_quotient(&field) && PERIODS.contains(&kind) => {
            computed("A period of", activity.period?, activity.is_exact)
        }
        ActivityField::Priority => {
            let report = response_times(db, project, deployment, Query::shown(db, project, deployment));
            priority(&report.hosts, activity, activities, report.others())?
        }
        _ => return None,
    };
    Some(Hover { range: field.syntax().text_range(), markdown })
}

fn is_quotient(field: &ast::Field) -> bool {
    matches!(field.expr(), Some(ast::Expr::BinaryExpr(_)))
}

/// `A period of 33.333333 ms, rounded down.`
fn computed(what: &str, time: Time, is_exact: bool) -> String {
    format!("{what} {time}{}.\n", if is_exact { "" } else { ", rounded down" })
}

/// `CPUs 1 and 3 (mask 5 = 1 + 4). Utilisation: CPU 1 62.0 %, CPU 3 40.0 %.`
fn affinity<'db>(
    cx: &HoverContext<'_, 'db>,
    deployment: Decl<'db>,
    activity: &ResolvedActivity<'db>,
) -> Option<String> {
    let HoverContext { db, project, .. } = *cx;
    let hosts = hosts_of(db, project.workspace(db));
    let cpus = activity.cpus.filter(|cpus| !cpus.is_empty())?;
    let (_, written) = hosts.local(cpus);
    let sum: Vec<String> = written.each().map(|cpu| cpu.0.to_string()).collect();
    let sum = if sum.len() > 1 { format!(" = {}", sum.join(" + ")) } else { String::new() };
    let known = &response_times(db, project, deployment, Query::shown(db, project, deployment)).cpus;
    // CPUs that activities use alternatively have one utilisation.
    let used = known
        .iter()
        .filter(|cpu| cpu.cpus.meets(cpus))
        .map(|cpu| format!("{} {}", hosts.names(cpu.cpus), known_utilisation(cpu)));
    let used: Vec<String> = used.collect();
    let used = if used.is_empty() { "unknown".to_owned() } else { used.join(", ") };
    Some(format!("{} (mask {}{sum}). Utilisation: {used}.\n", hosts.names(cpus), written.0))
}

/// `Higher or equal priority on CPU 1: laser 30, pilot 20 (equal).`
fn priority(
    hosts: &Hosts,
    activity: &ResolvedActivity<'_>,
    activities: &[ResolvedActivity<'_>],
    others: &[Task],
) -> Option<String> {
    let own = activity.priority.real_time()?;
    let cpus = activity.cpus?;
    let others = others.iter().filter(|it| it.cpus.is_some_and(|other| other.meets(cpus)));
    let others = others.filter_map(|it| Some((it.priority.real_time()?, name_of_other(&it.name))));
    let mut above: Vec<(u32, String)> = others.filter(|(priority, _)| *priority >= own).collect();
    let mut unknown: Vec<String> = Vec::new();
    for other in activities.iter().filter(|it| it.cpus.is_none_or(|other| other.meets(cpus))) {
        let name = other.instance.to_string();
        match other.priority {
            _ if other.at == activity.at => {}
            _ if other.thread.is_some() && other.thread == activity.thread => {}
            Priority::RealTime(priority) if priority >= own => above.push((priority, name)),
            Priority::Unknown => unknown.push(format!("{name} (unknown)")),
            Priority::RealTime(_) | Priority::Background => {}
        }
    }
    above.sort_by_key(|(priority, _)| std::cmp::Reverse(*priority));
    let cpus = hosts.names(cpus);
    let above = above.into_iter().map(|(priority, name)| {
        format!("{name} {priority}{}", if priority == own { " (equal)" } else { "" })
    });
    let names: Vec<String> = above.chain(unknown).collect();
    if names.is_empty() {
        return Some(format!("Highest priority on {cpus}.\n"));
    }
    let names = and_more(names, MOST_ACTIVITIES);
    Some(format!("Higher or equal priority on {cpus}: {}.\n", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};

    fn check(mark: &str, expected: Expect) {
        let model = "
codel work(): int
shell S { }
core K(S) { update = { work(); } }
component C(S, K)
architecture A { instance laser: C  instance pilot: C  instance arm: C  instance camera: C }
deployment D {
  architecture A
  activity laser { affinity = 1 priority = 30 period = 10 }
  activity pilot { affinity = 1 priority = 20 period = 20 }
  activity arm { affinity = 1 priority = 20 period = 40 }
  activity camera { affinity = 5 priority = 10 period = 40 }
}
//- /mauve.toml
assume.codel = \"2 ms\"
platform.rt_throttling = false
platform.cpus = 4
";
        let offset = model.find(mark).unwrap();
        let text = format!("{}$0{}", &model[..offset], &model[offset..]);
        let fixture = Fixture::new(&text);
        let shown = fixture.hover().unwrap();
        let text = fixture.file.text(&fixture.db);
        expected.assert_eq(&format!("{}\n---\n{}", &text[shown.range], shown.markdown));
    }

    #[test]
    fn an_affinity_in_words() {
        check(
            "affinity = 1 priority = 30",
            expect![[r#"
                affinity
                ---
                `affinity`: The CPUs on which the activity may run, as a bit mask: 1 is CPU 1, 2 is CPU 2, 3 is both, 4 is CPU 3. With 0, or without affinity: any CPU.

                CPU 1 (mask 1). Utilisation: CPUs 1 and 3 40.0 % of 200 %.
            "#]],
        );
        check(
            "5 priority",
            expect![[r#"
                affinity = 5
                ---
                CPUs 1 and 3 (mask 5 = 1 + 4). Utilisation: CPUs 1 and 3 40.0 % of 200 %.
            "#]],
        );
    }

    #[test]
    fn the_activities_that_preempt() {
        check(
            "priority = 30",
            expect![[r#"
            priority
            ---
            `priority`: The priority of the activity, from 1 (lowest) to 99 (highest), or `background`. An activity preempts all activities of lower priority on its CPU.

            Highest priority on CPU 1.
        "#]],
        );
        check(
            "20 period = 20",
            expect![[r#"
            priority = 20
            ---
            Higher or equal priority on CPU 1: laser 30, arm 20 (equal).
        "#]],
        );
        check(
            "10 period = 40",
            expect![[r#"
            priority = 10
            ---
            Higher or equal priority on CPUs 1 and 3: laser 30, pilot 20, arm 20.
        "#]],
        );
    }

    #[test]
    fn rates_lists_and_quotients() {
        let check = |mark: &str, expected: Expect| {
            let model = "
codel work(): int
shell S { input port scan: int  output port track: int }
core K(S) { update = { write(track, work()); } }
component C(S, K)
architecture A { instance laser: C  instance pilot: C  instance arm: C  instance camera: C  connection laser.track -> camera.scan }
deployment D {
  architecture A
  activity pair { cpus = [1, 3] instances = [laser, pilot] priority = 30 rate = 30 Hz deadline = 100/7 }
  activity arm { cpus = big priority = 20 period = 1000/40 }
  activity camera { priority = 10 trigger = scan least = 40 }
}
//- /mauve.toml
assume.codel = \"2 ms\"
platform.rt_throttling = false
platform.cpus = 4
platform.cpu_sets.big = [2]
";
            let offset = model.find(mark).unwrap();
            let text = format!("{}$0{}", &model[..offset], &model[offset..]);
            let fixture = Fixture::new(&text);
            let shown = fixture.hover().unwrap();
            let text = fixture.file.text(&fixture.db);
            expected.assert_eq(&format!("{}\n---\n{}", &text[shown.range], shown.markdown));
        };
        check(
            "30 Hz",
            expect![[r#"
            rate = 30 Hz
            ---
            A period of 33.333333 ms, rounded down.
        "#]],
        );
        check(
            "100/7",
            expect![[r#"
            deadline = 100/7
            ---
            A deadline of 14.285714 ms.
        "#]],
        );
        check(
            "1000/40",
            expect![[r#"
            period = 1000/40
            ---
            A period of 25 ms.
        "#]],
        );
        check(
            "[1, 3]",
            expect![[r#"
            cpus = [1, 3]
            ---
            CPUs 1 and 3 (mask 5 = 1 + 4). Utilisation: CPUs 1, 2, 3 and 4 25.0 % of 400 %.
        "#]],
        );
        check(
            "big priority",
            expect![[r#"
            cpus = big
            ---
            CPU 2 (mask 2). Utilisation: CPUs 1, 2, 3 and 4 25.0 % of 400 %.
        "#]],
        );
        check(
            "priority = 30",
            expect![[r#"
            priority
            ---
            `priority`: The priority of the activity, from 1 (lowest) to 99 (highest), or `background`. An activity preempts all activities of lower priority on its CPU.

            Highest priority on CPUs 1 and 3.
        "#]],
        );
        check(
            "scan least",
            expect![[r#"
            scan
            ---
            ```mauve
            input port scan: int
            ```

            ```text
            laser.scan is not connected
            pilot.scan is not connected
            arm.scan is not connected
            laser.track -> camera.scan
            ```
        "#]],
        );
        check(
            "pilot] priority",
            expect![[r#"
                pilot
                ---
                **✓ 4 / 14.2857 ms** ▰▱▱▱▱▱ 29 %, slack 10.285714 ms at 1e-4, with assumed times

                |                                                      | priority |     jobs | time |            |
                | :--------------------------------------------------- | :------: | -------: | ---: | :--------- |
                | own time                                             | 30       | 1 × 2 ms | 2 ms | ██████████ |
                | [`laser`](file:///model.mal#L8) (before it in its thread) (with assumed times) | 30       | 1 × 2 ms | 2 ms | ██████████ |
                | **response time**                                        |          |          | **4 ms** |            |

                costliest period: 2 ms, `update`

                - `update` 2 ms: `work` 2 ms (assumed)

                ---

                - component `C`, period 33.333333 ms, deadline 14.285714 ms, method exact
                - on CPUs 1 and 3 as if they were one CPU: activities have different affinities with several CPUs there

                ```mauve
                instance pilot: C
                ```

            "#]],
        );
    }
}
