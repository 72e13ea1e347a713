//! What a hover shows of the names of deployments, architectures, components and instances: a summary of each fact that stands in
//! another place, with the name of the deployment where deployments differ.

use mauve_diagnostics::activity_figure::figure;
use mauve_diagnostics::figure::TIGHT_SLACK;
use mauve_diagnostics::{supported, times_of};
use mauve_hir::item_tree::{Kind, Name, SourceId};
use mauve_hir::{Decl, FlatInstance, Location, ModelDb, Project, architecture, core_of, flat_of, shell_of};
use mauve_timing::Status;
use mauve_wcrt::{
    ActivityReport, Deadlines, Footing, Query, TableSet, level_shown, psm_of, response_times, support,
    table_sets,
};

use super::format::{HoverContext, HoverFormat, and_more};
use crate::connections::deployments;
use crate::cpu_budget::drawn_budget;
use crate::markdown::code;
use crate::occurrences::{each_once, grouped};
use crate::project::instances_by_component;

/// Names at most this many things in a line.
const MOST_NAMES: usize = 6;

/// Returns the summary of a declaration as a list; empty for other kinds.
pub(super) fn of_declaration<'db>(cx: &HoverContext<'_, 'db>, decl: Decl<'db>) -> String {
    let lines = match decl.kind(cx.db) {
        Kind::Deployment => deployment(cx, decl),
        Kind::Architecture => of_architecture(cx, decl),
        Kind::Component => component(cx, decl),
        _ => Vec::new(),
    };
    list(&lines)
}

fn list(lines: &[String]) -> String {
    let mut out: String = lines.iter().map(|line| format!("- {line}\n")).collect();
    if !out.is_empty() {
        out.push('\n');
    }
    out
}

/// Returns `a, b, c`; of many, the number of the others.
fn enumerated(names: Vec<String>) -> String {
    and_more(names, MOST_NAMES).join(", ")
}

fn link_to(cx: &HoverContext<'_, '_>, decl: Decl<'_>) -> String {
    cx.link(decl.name(cx.db), &Location::name_of(decl))
}

fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

/// The deadlines, the utilisation of each CPU, and the activity with the least slack.
fn deployment<'db>(cx: &HoverContext<'_, 'db>, of: Decl<'db>) -> Vec<String> {
    let HoverContext { db, project, .. } = *cx;
    let query = Query::shown(db, project, of);
    let report = response_times(db, project, of, query);
    let Deadlines { met, unknown, all } = report.deadlines();
    if all == 0 {
        return Vec::new();
    }
    let with_assumptions = report.with_assumptions();
    let assumed = if with_assumptions.contains(&true) { ", with assumed times" } else { "" };
    let of_which = times_of(report.times.as_deref());
    let unknown = if unknown > 0 { format!(", {unknown} not analysed") } else { String::new() };
    let mut lines =
        vec![format!("{met} of {all} deadlines met at {}{unknown}{assumed}{of_which}", query.level)];
    lines.extend(support(db, project, of, query.level).map(supported));
    let budget = drawn_budget(db, (project, of, query), TIGHT_SLACK);
    lines.extend(budget.cpus.iter().map(|cpu| cpu.line(code)));
    let name = |it: &ActivityReport<'_>| match &it.at {
        Some(at) => cx.link(&it.instance, at),
        None => code(&it.instance),
    };
    let bounded = report.activities.iter().zip(report.footings());
    let bounded = bounded.filter_map(|(it, footing)| Some((it.used()?, it, footing)));
    let least = bounded.max_by(|one, other| one.0.total_cmp(&other.0));
    lines.extend(
        least.map(|(_, it, footing)| format!("least slack: {}, {}", name(it), verdict(db, it, footing))),
    );
    let unbounded = report.activities.iter().filter(|it| it.verdict != Status::Background);
    let unbounded: Vec<String> = unbounded.filter(|it| it.response.is_none()).map(name).collect();
    if !unbounded.is_empty() {
        lines.push(format!("no response time: {}", enumerated(unbounded)));
    }
    lines
}

/// Returns `✓ 53 / 100 ms ▰▰▰▱▱▱ 53 %`, or why there is no such figure.
fn verdict(db: &dyn ModelDb, it: &ActivityReport<'_>, footing: Footing) -> String {
    figure(db, it, footing, TIGHT_SLACK).full()
}

/// The number of instances and connections, and the deployments.
fn of_architecture<'db>(cx: &HoverContext<'_, 'db>, of: Decl<'db>) -> Vec<String> {
    let HoverContext { db, project, .. } = *cx;
    let flat = flat_of(db, project, of);
    let imported = flat.instances.iter().filter(|it| it.declared.0 != of).count();
    let imported = if imported > 0 { format!(" ({imported} imported)") } else { String::new() };
    let at_least = |is_incomplete: bool| if is_incomplete { "at least " } else { "" };
    let size = format!(
        "{}{}{imported}, {}{}",
        at_least(!flat.refusals.is_empty()),
        counted(flat.instances.len(), "instance"),
        at_least(flat.link_completeness.is_incomplete()),
        counted(flat.links.len(), "connection")
    );
    let using = deployments(db, project).into_iter().filter(|(_, flat)| flat.architectures.contains(&of));
    let using: Vec<String> = using.map(|(deployment, _)| link_to(cx, deployment)).collect();
    let using = match using.is_empty() {
        true => "in no deployment".to_owned(),
        false => format!("deployed by {}", enumerated(using)),
    };
    vec![size, using]
}

/// The shell and the core, the instances, and the greatest execution time of a period.
fn component<'db>(cx: &HoverContext<'_, 'db>, of: Decl<'db>) -> Vec<String> {
    let HoverContext { db, project, .. } = *cx;
    let mut lines = Vec::new();
    // The declaration has the names already.
    if let (HoverFormat::Markdown(_), Some(shell), Some(core)) =
        (cx.format, shell_of(db, project, of), core_of(db, project, of))
    {
        lines.push(format!("shell {}, core {}", link_to(cx, shell), link_to(cx, core)));
    }
    let instances = instances_by_component(db, project).get(&of).into_iter().flatten();
    let instances: Vec<String> = instances
        .filter_map(|(name, at)| {
            let Location::Source(of, _) = at else { return None };
            Some(format!("{} in {}", cx.link(name, at), code(of.name(db))))
        })
        .collect();
    lines.push(match instances.is_empty() {
        true => "no instance".to_owned(),
        false => format!("instances: {}", enumerated(instances)),
    });
    let level = level_shown(db, project);
    for (time, of_which) in by_tables(db, project, |tables| {
        let psm = psm_of(db, tables, of, level).as_ref().ok();
        psm.map_or_else(String::new, |psm| {
            let assumed = if psm.assumed.is_empty() { "" } else { ", with assumed times" };
            format!("execution time ≤ {} per period at {level}{assumed}", psm.machine.greatest_cost())
        })
    }) {
        if !time.is_empty() {
            lines.push(time + &of_which);
        }
    }
    lines
}

/// Returns the connections of an instance, and its response time in each deployment except `explained`, which the hover explains.
pub(super) fn of_instance<'db>(
    cx: &HoverContext<'_, 'db>,
    (of, id): (Decl<'db>, SourceId),
    explained: Option<Decl<'db>>,
) -> (Vec<String>, String) {
    let HoverContext { db, project, .. } = *cx;
    let declared = architecture(db, of).into_iter().flat_map(|data| data.instances.iter().enumerate());
    let Some((index, instance)) = declared.into_iter().find(|(_, it)| it.name.id == id) else {
        return Default::default();
    };
    let name = &instance.name.name;
    let is_it = |it: &FlatInstance<'db>| it.declared == (of, index);
    let deployed = deployments(db, project).into_iter();
    let deployed: Vec<_> = deployed.filter(|(_, flat)| flat.instances.iter().any(is_it)).collect();
    let roots = if deployed.is_empty() { vec![(of, flat_of(db, project, of))] } else { deployed.clone() };
    let connections = roots.iter().map(|(root, flat)| {
        let links = flat.links.iter().filter(|link| link.source.0 == *name || link.target.0 == *name);
        (*root, links.map(ToString::to_string).collect::<Vec<String>>())
    });
    let connections = where_they_differ(db, connections.collect());
    let mut lines = Vec::new();
    for (deployment, _) in deployed.into_iter().filter(|(deployment, _)| Some(*deployment) != explained) {
        let query = Query::shown(db, project, deployment);
        let report = response_times(db, project, deployment, query);
        let activity = report.activities.iter().zip(report.footings()).find(|(it, _)| it.instance == **name);
        let of_which = times_of(report.times.as_deref());
        let (at, said) = match activity {
            Some((it, footing)) => {
                let at = it.at.clone().unwrap_or_else(|| Location::name_of(deployment));
                let level =
                    if it.response.is_some() { format!(" at {}", query.level) } else { String::new() };
                (at, format!("{}{level}{of_which}", verdict(db, it, footing)))
            }
            None => (Location::name_of(deployment), "no activity".to_owned()),
        };
        lines.push(format!("{}: {said}", cx.link(deployment.name(db), &at)));
    }
    (connections, list(&lines))
}

/// Returns the lines of several deployments or architectures once, with the names of those that have a line where not all have it.
pub(super) fn where_they_differ(db: &dyn ModelDb, of_each: Vec<(Decl<'_>, Vec<String>)>) -> Vec<String> {
    let lines = each_once(of_each.iter().flat_map(|(_, lines)| lines.iter().cloned()));
    let shown = lines.into_iter().map(|line| {
        let having: Vec<&Name> = of_each
            .iter()
            .filter(|(_, lines)| lines.contains(&line))
            .map(|(root, _)| root.name(db))
            .collect();
        match having.len() == of_each.len() {
            true => line,
            false => {
                let names: Vec<&str> = having.iter().map(|name| name.as_str()).collect();
                format!("{line} in {}", names.join(", "))
            }
        }
    });
    shown.collect()
}

/// Returns each text for the timing tables of a project once, with the names of these tables, to be appended.
pub(super) fn by_tables<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    text: impl Fn(TableSet<'db>) -> String,
) -> Vec<(String, String)> {
    let found = grouped(table_sets(db, project).iter().map(|&tables| (text(tables), tables.label(db))));
    let named = found.into_iter().map(|(text, labels)| {
        let names: Option<Vec<String>> = labels.into_iter().collect();
        (text, times_of(names.map(|names| names.join(", ")).as_deref()))
    });
    named.collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use mauve_hir::{Database, Workspace, is_model, parse};
    use mauve_syntax::SyntaxKind;

    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};

    const MODEL: &str = "
codel work(): int
shell S { input port goal: int  output port next: int }
core K(S) { update = { work(); } }
component C$3(S, K)
architecture Base { instance front: C  connection front.next -> back.goal  instance back: C }
architecture A$2 { import Base  instance arm$4: C  connection back.next -> arm.goal }
architecture B { import Base  connection back.next -> front.goal }
deployment Land$1 {
  architecture A
  activity front { priority = 3 period = 10 } activity back$6 { priority = 2 period = 20 } activity arm$5 { priority = 1 period = 12 }
}
deployment Sea { architecture B  activity front { priority = background } activity back { priority = 2 period = 20 } }
//- /mauve.toml
timing.tables = [\"t.toml\"]
platform.rt_throttling = false
//- /t.toml
codel.work = 3
";

    fn check(cursor: &str, expected: Expect) {
        let text = MODEL.replace(cursor, "$0");
        let text = (1..=6).fold(text, |text, mark| text.replace(&format!("${mark}"), ""));
        expected.assert_eq(&Fixture::new(&text).hover().unwrap().markdown);
    }

    #[test]
    fn a_deployment_has_its_deadlines_and_utilisations() {
        check(
            "$1",
            expect![[r#"
                ```mauve
                deployment Land
                ```

                - 3 of 3 deadlines met at 1e-4
                - ███░░▏ ✓ CPU 1: 70.0 % used, 30.0 % left: `front` 30.0 %, `arm` 25.0 %, `back` 15.0 %
                - least slack: [`arm`](file:///model.mal#L10), ✓ 9 / 12 ms ▰▰▰▰▱▱ 75 %

            "#]],
        );
    }

    #[test]
    fn an_architecture_has_its_size_and_its_deployments() {
        check(
            "$2",
            expect![[r#"
                ```mauve
                architecture A
                ```

                - 3 instances (2 imported), 2 connections
                - deployed by [`Land`](file:///model.mal#L8)

            "#]],
        );
    }

    #[test]
    fn a_component_has_its_instances_and_its_execution_time() {
        check(
            "$3",
            expect![[r#"
            ```mauve
            component C(S, K)
            ```

            - shell [`S`](file:///model.mal#L2), core [`K`](file:///model.mal#L3)
            - instances: [`front`](file:///model.mal#L5) in `Base`, [`back`](file:///model.mal#L5) in `Base`, [`arm`](file:///model.mal#L6) in `A`
            - execution time ≤ 3 ms per period at 1e-4

        "#]],
        );
    }

    #[test]
    fn an_instance_has_its_connections_and_response_times() {
        check(
            "$4",
            expect![[r#"
                ```mauve
                instance arm: C
                ```

                ```text
                back.next -> arm.goal
                ```

                - [`Land`](file:///model.mal#L10): ✓ 9 / 12 ms ▰▰▰▰▱▱ 75 % at 1e-4

            "#]],
        );
        // Its connections differ.
        check(
            "$6",
            expect![[r#"
                **✓ 6 / 20 ms** ▰▱▱▱▱▱ 30 %, slack 14 ms at 1e-4

                |               | priority |     jobs | time |            |
                | :------------ | :------: | -------: | ---: | :--------- |
                | own time      | 2        | 1 × 3 ms | 3 ms | ██████████ |
                | [`front`](file:///model.mal#L10)         | 3        | 1 × 3 ms | 3 ms | ██████████ |
                | **response time** |          |          | **6 ms** |            |

                costliest period: 3 ms, `update`

                - `update` 3 ms: `work` 3 ms

                ---

                - component `C`, period 20 ms, deadline 20 ms, method exact

                ```mauve
                instance back: C
                ```

                ```text
                back.next -> arm.goal in Land
                front.next -> back.goal
                back.next -> front.goal in Sea
                ```

                - [`Sea`](file:///model.mal#L12): ✓ 3 / 20 ms ▰▱▱▱▱▱ 15 % at 1e-4

            "#]],
        );
        check(
            "$5",
            expect![[r#"
                **✓ 9 / 12 ms** ▰▰▰▰▱▱ 75 %, slack 3 ms at 1e-4

                |               | priority |     jobs | time |         |
                | :------------ | :------: | -------: | ---: | :------ |
                | own time      | 1        | 1 × 3 ms | 3 ms | ██████▋ |
                | [`front`](file:///model.mal#L10)         | 3        | 1 × 3 ms | 3 ms | ██████▋ |
                | [`back`](file:///model.mal#L10)          | 2        | 1 × 3 ms | 3 ms | ██████▋ |
                | **response time** |          |          | **9 ms** |         |

                costliest period: 3 ms, `update`

                - `update` 3 ms: `work` 3 ms

                ---

                - component `C`, period 12 ms, deadline 12 ms, method exact

                ```mauve
                instance arm: C
                ```

                ```text
                back.next -> arm.goal
                ```
            "#]],
        );
    }

    #[test]
    fn no_hover_of_the_sample_robot_repeats_a_line() {
        let folder = mauve_tests::models().join("p3dx");
        let files = mauve_tests::files_in(&folder).into_iter();
        let texts = files.filter_map(|path| Some((path.clone(), std::fs::read_to_string(path).ok()?)));
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, folder.clone(), texts);
        let mut shown = BTreeSet::new();
        for &file in workspace.files(&db).values().filter(|file| is_model(file.path(&db))) {
            let tokens = parse(&db, file).syntax().descendants_with_tokens();
            for token in tokens.filter_map(|it| it.into_token()).filter(|it| !it.kind().is_trivia()) {
                let offset = token.text_range().start();
                let Some(hover) = (Fixture { db: db.clone(), workspace, file, offset }).hover() else {
                    continue;
                };
                let is_text =
                    |line: &&str| line.chars().any(char::is_alphanumeric) && !line.starts_with("```");
                let lines: Vec<&str> = hover.markdown.lines().filter(is_text).collect();
                let different: BTreeSet<&&str> = lines.iter().collect();
                assert_eq!(different.len(), lines.len(), "{}:\n{}", token.text(), hover.markdown);
                assert!(!hover.markdown.contains("00000000"), "{}", hover.markdown);
                if token.kind() == SyntaxKind::IDENT {
                    shown.insert(hover.markdown);
                }
            }
        }
        assert!(shown.len() > 100);
    }
}
