//! Hovers: on an activity, how its response time is composed; on a connection, how long data takes there; on a name, its
//! declaration; on the type of a value, the fields of the message; on a key of `mauve.toml` or of
//! a timing table, what it means. Further details of a name are in `hover/details.rs`, the words
//! of the language in `hover/words.rs`.

mod activity_field;
mod configuration;
mod connection;
mod details;
mod format;
mod summary;
mod words;

use format::HoverContext;
pub use format::{Hover, HoverFormat};

use std::fmt::Write as _;

use mauve_diagnostics::{
    late_at_most, miss_conditions, miss_rule, not_independent, supported, unusable_time,
};
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, File, Message, ModelDb, Package, Project, message_of, node_around};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{SyntaxNode, TextRange, TextSize, comment_above};
use mauve_wcrt::{
    ActivityReport, Lookup, Query, TableSet, level_shown, probabilities_of, response_times, support,
    system_of, timetable_of,
};

use crate::definition::definition_of;
use crate::exceedance::measurements;
use crate::explanation::explain_response;
use crate::markdown;
use crate::occurrences::{Definition, is_of_value, names_at};
use crate::threads::{activities_with_threads, deployments_with_threads};
use summary::by_tables;

const MOST_LINES: usize = 60;

/// Returns the hover at `offset`; without a project, only that of a word of the language.
pub fn hover(
    db: &dyn ModelDb,
    project: Option<Project<'_>>,
    file: File,
    offset: TextSize,
    format: HoverFormat<'_>,
) -> Option<Hover> {
    let Some(project) = project else { return words::of_word(db, file, offset) };
    let cx = &HoverContext { db, project, file, offset, format };
    let explained = of_activity(cx);
    let deployment = explained.as_ref().map(|(_, deployment, _)| *deployment);
    let explained = explained
        .map(|(range, _, text)| (range, text))
        .or_else(|| connection::of_connection(cx))
        .or_else(|| of_thread(cx));
    let of_name = of_name(cx, deployment)
        .or_else(|| of_message(cx))
        .or_else(|| of_word(cx))
        .or_else(|| configuration::of_key(db, project, file, offset));
    let Some((range, markdown)) = explained else { return of_name };
    match of_name {
        Some(name) => Some(Hover { range: name.range, markdown: markdown + &name.markdown }),
        None => Some(Hover { range, markdown }),
    }
}

/// What a word of the language means, and for a field of an activity, what its value means.
fn of_word(cx: &HoverContext<'_, '_>) -> Option<Hover> {
    match (words::of_word(cx.db, cx.file, cx.offset), activity_field::of_field(cx)) {
        (Some(word), Some(field)) => {
            Some(Hover { markdown: format!("{}\n{}", word.markdown, field.markdown), ..word })
        }
        (word, field) => word.or(field),
    }
}

/// The greatest number of activities in a table.
const MOST_ROWS: usize = 16;

/// Returns the explanation of the activity whose name or keyword is at `offset`, with its deployment.
fn of_activity<'db>(cx: &HoverContext<'_, 'db>) -> Option<(TextRange, Decl<'db>, String)> {
    let HoverContext { db, project, file, offset, .. } = *cx;
    let token = cx.word()?;
    let activity = token.parent_ancestors().find_map(ast::Activity::cast)?;
    let name = activity.name_ref()?.syntax().text_range();
    let whole = activity.syntax().text_range();
    let is_head = name.contains_inclusive(offset) || token.text_range().start() == whole.start();
    let deployment =
        mauve_hir::declaration_at(db, file, name).filter(|decl| decl.kind(db) == Kind::Deployment)?;
    let report = response_times(db, project, deployment, Query::shown(db, project, deployment));
    // On its name, all instances that it executes; on that of an instance in its list, this one.
    let is_here = |it: &ActivityReport<'_>| {
        let at = it.at.as_ref().and_then(|at| at.range_in(db, file)).filter(|at| whole.contains_range(*at));
        at.is_some_and(|at| is_head || at == token.text_range())
    };
    let activities = report.activities.iter().enumerate().filter(|(_, it)| is_here(it));
    let activities: Vec<usize> = activities.map(|(index, _)| index).collect();
    let markdown = explained(cx, deployment, &activities)?;
    // On the keyword, an editor marks the keyword.
    let range = if name.contains_inclusive(offset) { name } else { token.text_range() };
    Some((range, deployment, markdown))
}

/// Returns the explanation of the activities of a thread in a file of threads.
fn of_thread(cx: &HoverContext<'_, '_>) -> Option<(TextRange, String)> {
    let (mut at, mut text) = (None, String::new());
    for (project, deployment) in deployments_with_threads(cx.db, &[cx.project], cx.file) {
        let all = activities_with_threads(cx.db, project, deployment, cx.file).into_iter();
        let here = all.filter(|(_, [entry, _])| entry.contains_inclusive(cx.offset));
        let (activities, ids): (Vec<usize>, Vec<TextRange>) =
            here.map(|(index, [_, id])| (index, id)).unzip();
        at = at.or(ids.first().copied());
        text.extend(explained(cx, deployment, &activities));
    }
    Some((at?, text)).filter(|(_, text)| !text.is_empty())
}

/// Returns the explanation of these activities of a deployment; none where there is nothing to say.
fn explained<'db>(cx: &HoverContext<'_, 'db>, deployment: Decl<'db>, activities: &[usize]) -> Option<String> {
    let HoverContext { db, project, format, .. } = *cx;
    let query = Query::shown(db, project, deployment);
    let report = response_times(db, project, deployment, query);
    let system = system_of(db, project, deployment);
    let explanations = activities.iter().filter_map(|&activity| {
        let tables = system.activities.get(activity)?.tables;
        let doc = explain_response(db, tables, report, activity, query, MOST_ROWS)?;
        let explanation = match format {
            HoverFormat::Markdown(links) => doc.markdown(db, links),
            HoverFormat::Text => markdown::block("text", &doc.text()),
        };
        let probability = probabilities_of(db, project, deployment).get(activity).and_then(Option::as_ref);
        let late = |it| {
            let conditions = miss_conditions(it).join(", and ");
            let why = not_independent(it).map(|why| format!("; {why}")).unwrap_or_default();
            format!("{} ({}), if {conditions}{why}\n\n", late_at_most(it), miss_rule(it))
        };
        Some(explanation + "\n" + &probability.map(late).unwrap_or_default())
    });
    let mut markdown: String = explanations.collect();
    if let Some(support) = support(db, project, deployment, query.level).filter(|_| !markdown.is_empty()) {
        let _ = writeln!(markdown, "{}\n", supported(support));
    }
    Some(markdown).filter(|it| !it.is_empty())
}

fn of_name<'db>(cx: &HoverContext<'_, 'db>, explained: Option<Decl<'db>>) -> Option<Hover> {
    let HoverContext { db, project, .. } = *cx;
    let names = names_at(db, project, cx.file, cx.offset);
    let found = definition_of(db, project, &names)?;
    let mut markdown = String::new();
    for target in found.targets.iter().filter(|target| !target.name.is_empty()) {
        let Some(node) = node_around(db, target.file, target.name) else { continue };
        // The blocks of a library have the same head, and comments of their own.
        let (head, comment) = head_and_comment(&node);
        for part in [head, comment] {
            if !part.is_empty() && !markdown.contains(&part) {
                let _ = writeln!(markdown, "{part}");
            }
        }
    }
    for name in names {
        if let Definition::Declaration(codel) = name.definition
            && codel.kind(db) == Kind::Codel
        {
            let times = times(db, project, codel);
            if !markdown.contains(&times) {
                markdown += &times;
            }
        }
        let details = details::details(cx, &name, &markdown, explained);
        if !markdown.contains(&details) {
            markdown += &details;
        }
    }
    (!markdown.is_empty()).then_some(Hover { range: found.origin, markdown })
}

fn of_message(cx: &HoverContext<'_, '_>) -> Option<Hover> {
    let token = cx.word()?;
    let ty = token.parent_ancestors().find_map(ast::Type::cast)?;
    if !is_of_value(ty.syntax()) {
        return None;
    }
    let library = token.parent_ancestors().find_map(ast::Library::cast).and_then(|it| it.name());
    let library = library.map(|name| Name::from(name.syntax().text().to_string()));
    let path: Vec<Name> = ty.name_refs().map(|it| it.syntax().text().to_string().into()).collect();
    let (package, message) = message_of(cx.db, cx.project, library.as_ref(), &path)?;
    Some(Hover { range: ty.syntax().text_range(), markdown: fields(package, path.last()?, message) })
}

pub(crate) fn fields(package: &Package, name: &str, message: &Message) -> String {
    let fields = message.fields.iter().map(ToString::to_string);
    let lines: Vec<String> = fields.chain(message.constants.iter().map(ToString::to_string)).collect();
    let mut out = format!("# {}/{name}\n", package.name);
    for line in lines.iter().take(MOST_LINES) {
        let _ = writeln!(out, "{line}");
    }
    if let Some(more) = lines.len().checked_sub(MOST_LINES).filter(|more| *more > 0) {
        let _ = writeln!(out, "# and {more} more");
    }
    let out = markdown::block("msg", &out);
    match &message.path {
        Some(path) => format!("{out}\nfrom {}\n", markdown::code(&path.display().to_string())),
        None => out + "\nbuilt-in definition: the package is not installed on this machine\n",
    }
}

/// Returns a declaration up to its block on one line, and the comment above it.
pub(crate) fn shown(declaration: &SyntaxNode) -> String {
    let (head, comment) = head_and_comment(declaration);
    if comment.is_empty() { head } else { format!("{head}\n{comment}") }
}

/// Returns a declaration up to its block on one line, and the comment above it, which may be empty.
pub(crate) fn head_and_comment(declaration: &SyntaxNode) -> (String, String) {
    let text = declaration.text().to_string();
    let head = text.split('{').next().unwrap_or_default();
    let head = markdown::block("mauve", &head.split_whitespace().collect::<Vec<_>>().join(" "));
    let comment = markdown::comment(&comment_above(declaration));
    (head, if comment.is_empty() { comment } else { comment + "\n" })
}

/// Returns the times of a codel, those of other tables of a deployment only where they differ.
fn times<'db>(db: &'db dyn ModelDb, project: Project<'db>, codel: Decl<'db>) -> String {
    let mut out = String::new();
    for (found, of_which) in by_tables(db, project, |tables| times_in(db, tables, codel)) {
        out.extend(found.lines().map(|line| format!("{line}{of_which}\n")));
    }
    markdown::block("text", &out)
}

/// Returns a line for each level of the tables.
fn times_in<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>, codel: Decl<'db>) -> String {
    let table = timetable_of(db, tables);
    let shown = level_shown(db, tables.project(db));
    let mut levels = table.levels.clone();
    if !levels.contains(&shown) {
        levels.push(shown);
    }
    let mut out = String::new();
    for level in levels {
        let time = match table.codel_time(db, codel, level) {
            Lookup::Known(time) => time.to_string(),
            Lookup::Assumed(time) => format!("{time} (assumed: in no timing table)"),
            Lookup::Absent => "no time".to_owned(),
            Lookup::Unusable(why) => unusable_time(db, &why),
        };
        let mark = if level == shown { " (current level)" } else { "" };
        let _ = writeln!(out, "{time} at {level}{mark}");
    }
    out.extend(measurements(db, tables, codel).map(|line| line + "\n"));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};

    fn check(fixture: &str, expected: Expect) {
        let fixture = Fixture::new(fixture);
        let shown = match fixture.hover() {
            Some(hover) => {
                format!("{}\n---\n{}", &fixture.file.text(&fixture.db)[hover.range], hover.markdown)
            }
            None => String::new(),
        };
        expected.assert_eq(&shown);
    }

    const TABLES: &str = r#"
//- /mauve.toml
[timing]
tables = ["times.toml"]
[platform]
rt_throttling = false
//- /times.toml
levels = [1e-3, 1e-4]
[codel]
plan = [60, 70]
drive = 17
"#;

    const PARTS: &str = "
// Finds a way.
// Slowly.
codel plan(in goal: int,
  out path: int): int
codel drive(): int
shell S { }
core Planning(S) { var goal: int; var path: int; update = { pl$1an(goal, path); } }
core Driving(S) { update = { drive(); } }
component Planner(S, Planning)
component Driver(S, Driving)
architecture A { instance planner: Planner  instance driver: Driver }
deployment D {
  architecture A
  activity driver { priority = 2 period = 50 }
  activity plan$2ner { priority = 1 period = 100 }
}
";

    fn robot(cursor: &str) -> String {
        let parts = PARTS.replace(cursor, "$0");
        ["$1", "$2"].iter().fold(parts, |text, mark| text.replace(mark, "")) + TABLES
    }

    #[test]
    fn an_activity_explains_its_response_time() {
        check(
            &robot("$2"),
            expect![[r#"
                planner
                ---
                **CPU 1 overloaded (104.0 % at priority ≥ 1)**: no bounded response time at 1e-4

                |                     | priority |   execution time | utilisation |                |
                | :------------------ | :------: | ---------------: | ----------: | :------------- |
                | [`planner`](file:///model.mal#L15)             | 1        | 70 ms per 100 ms |      70.0 % | █████████████▌ |
                | [`driver`](file:///model.mal#L14)              | 2        |  17 ms per 50 ms |      34.0 % | ██████▌        |
                | **CPU 1, priority ≥ 1** |          |                  |     **104.0 %** |                |

                costliest period: 70 ms, `update`

                - `update` 70 ms: `plan` 70 ms

                ---

                - component `Planner`, period 100 ms, deadline 100 ms, method best
                - response time at the critical instant: 121 ms

                may be late in each hour (the deadline is met at 1e-3), if the hour begins without unfinished jobs, and each execution exceeds its times at most as probably as the tables say, whatever was executed before, and for one job, late ones right after a late one do not count

                at 1e-4, about 3.6 executions an hour may exceed their times

                ```mauve
                instance planner: Planner
                ```

            "#]],
        );
    }

    #[test]
    fn an_activity_without_an_instance_has_no_component() {
        let other = robot("$2").replace("instance planner", "instance other");
        check(
            &other,
            expect![[r#"
                planner
                ---
                **Not analysed**: its instance is unknown

                - architecture A has no instance `planner`: one may be missing in it

                ---

                - period 100 ms, deadline 100 ms, method best

            "#]],
        );
    }

    #[test]
    fn what_is_assumed_of_the_platform_is_said_where_it_counts() {
        let assumed = "assumes real-time throttling off";
        let fixture = robot("$2");
        let text = |fixture: &str| Fixture::new(fixture).hover().unwrap().markdown;
        assert!(!text(&fixture).contains(assumed));
        let unset = fixture.replace("rt_throttling = false", "");
        assert_eq!(text(&unset).matches(assumed).count(), 1);
        // Of what is not analysed, nothing is claimed that would rest on it.
        assert!(!text(&unset.replace("plan = [60, 70]", "")).contains(assumed));
    }

    #[test]
    fn a_comment_of_a_stranger_is_text() {
        let fixture =
            robot("$1").replace("// Slowly.", "/* ![x](https://e.org/x.png) <b>[x](command:evil)\n```` */");
        check(
            &fixture.replace("times.toml", "ti`mes.toml"),
            expect![[r#"
                plan
                ---
                ```mauve
                codel plan(in goal: int, out path: int): int
                ```

                Finds a way.
                ![x]\(https://e.org/x.png) &lt;b>[x]\(command:evil)
                ```

                ```

                ```text
                60 ms at 1e-3
                70 ms at 1e-4 (current level)
                ```
                from ``ti`mes.toml``, line 3

                must take at most 66 ms in `D` (now 70 ms, -5.8 %): the deadline of `planner` is not met

            "#]],
        );
    }

    #[test]
    fn a_codel_shows_its_comment_and_its_times() {
        check(
            &robot("$1"),
            expect![[r#"
                plan
                ---
                ```mauve
                codel plan(in goal: int, out path: int): int
                ```

                Finds a way.
                Slowly.

                ```text
                60 ms at 1e-3
                70 ms at 1e-4 (current level)
                ```
                from `times.toml`, line 3

                must take at most 66 ms in `D` (now 70 ms, -5.8 %): the deadline of `planner` is not met

            "#]],
        );
    }

    #[test]
    fn a_comment_behind_something_else_is_not_about_what_follows() {
        check(
            "codel f(): int // about f\ncodel $0g(): int",
            expect![[r#"
                g
                ---
                ```mauve
                codel g(): int
                ```

                ```text
                no time at 1e-4 (current level)
                ```
            "#]],
        );
        check(
            "codel f(): int // about f\n\n// about g\ncodel $0g(): int",
            expect![[r#"
                g
                ---
                ```mauve
                codel g(): int
                ```

                about g

                ```text
                no time at 1e-4 (current level)
                ```
            "#]],
        );
    }

    const MESSAGES: &str = "
library a {
  use b use std_msgs use geometry_msgs
  shell S { input port pose: $1Pose property many: nav_msgs::O$2dometry require o(in x: Strin$3g): int }
  core C($4Pose) { handler h: $5Pose var x: $6Missing }
}
library b { use sensor_msgs codel f(): $7Joy }
library c { codel f(in x: $8Joy): int }
codel f(): $9Joy
";

    fn messages(cursor: &str) -> String {
        let text = MESSAGES.replace(cursor, "$0");
        (1..=9).fold(text, |text, mark| text.replace(&format!("${mark}"), ""))
    }

    #[test]
    fn the_type_of_a_value_shows_the_fields_of_the_message() {
        check(
            &messages("$1"),
            expect![[r#"
                Pose
                ---
                ```msg
                # geometry_msgs/Pose
                Point position
                Quaternion orientation
                ```

                built-in definition: the package is not installed on this machine
            "#]],
        );
        check(
            &messages("$2"),
            expect![[r#"
                nav_msgs::Odometry
                ---
                ```msg
                # nav_msgs/Odometry
                std_msgs/Header header
                string child_frame_id
                geometry_msgs/PoseWithCovariance pose
                geometry_msgs/TwistWithCovariance twist
                ```

                built-in definition: the package is not installed on this machine
            "#]],
        );
        check(
            &messages("$3"),
            expect![[r#"
                String
                ---
                ```msg
                # std_msgs/String
                string data
                ```

                built-in definition: the package is not installed on this machine
            "#]],
        );
        check(
            &messages("$7"),
            expect![[r#"
                Joy
                ---
                ```msg
                # sensor_msgs/Joy
                std_msgs/Header header
                float32[] axes
                int32[] buttons
                ```

                built-in definition: the package is not installed on this machine
            "#]],
        );
        check(
            &messages("$9"),
            expect![[r#"
                Joy
                ---
                ```msg
                # sensor_msgs/Joy
                std_msgs/Header header
                float32[] axes
                int32[] buttons
                ```

                built-in definition: the package is not installed on this machine
            "#]],
        );
    }

    #[test]
    fn what_is_no_type_of_a_value_or_not_used_is_no_message() {
        for cursor in ["$4", "$5", "$6", "$8"] {
            check(&messages(cursor), expect![""]);
        }
    }

    #[test]
    fn a_long_message_is_cut() {
        let message = mauve_hir::read_message(&"int8 x\n".repeat(MOST_LINES + 2));
        let shown = fields(&Package { name: "p".into(), ..Package::default() }, "Long", &message);
        assert_eq!(shown.matches("int8 x\n").count(), MOST_LINES);
        assert!(shown.contains("# and 2 more\n"), "{shown}");
    }

    /// A robot with `$0` in place of the mark that is asked for.
    fn details(cursor: &str) -> String {
        let text = "
shell Sensor { constant base: int = 2  property ra$1te: int = base * 3  output port sc$2an: int  output port spare: int }
shell Taker { input port scan: int }
core Sensing(Sensor) {
  var n$8: ctypes.uint8 = 0;
  statemachine {
    initial state Id$3le { run = { shoot(n); write(scan, ra$4te); }  transition g$5o if (shoot(n) > 0) to Busy }
    state Busy { transition back to Idle }
    state Never { }
  }
}
core Taking(Taker) { update = { } }
component Laser(Sensor, Sensing)  component Map(Taker, Taking)
architecture A {
  instance left: Laser  instance right: Laser  instance map: Map
  connection left.scan -> map.sc$6an
  property left.rate = 5
}
deployment D { architecture A  property right.rate = 7
  activity left { priority = 1 period = 10 } activity right { priority = 2 period = 10 } activity map { priority = 3 period = 10 } }
codel sho$7ot(out n: ctypes.uint8): int
//- /mauve.toml
timing.tables = [\"times/*.toml\"]
//- /times/a.toml
# é
levels = [1e-3, 1e-4]
[codel]
shoot = [1, 2]
";
        let text = text.replace(cursor, "$0");
        (1..9).fold(text, |text, mark| text.replace(&format!("${mark}"), ""))
    }

    #[test]
    fn a_property_has_the_values_of_its_instances() {
        check(
            &details("$1"),
            expect![[r#"
            rate
            ---
            ```mauve
            property rate: int = base * 3
            ```

            ```text
            left.rate = 5 in D
            right.rate = 7 in D
            ```
        "#]],
        );
        let shown = Fixture::new(&details("$4")).hover().unwrap().markdown;
        assert!(shown.contains("right.rate = 7 in D"));
    }

    #[test]
    fn a_port_has_its_topic() {
        let robot = "use std_msgs
shell S { output port sta$0te: String  input port goal: double }
core C(S) { update = { } }
component Driver(S, C)
architecture A { instance left: Driver }
deployment D { architecture A  activity left { priority = 1  period = 100 } }
//- /mauve.toml
[ros2]
namespace = \"/uav\"
gateway = { priority = 20, period = \"1 ms\" }
[host.eyes]
activities = [\"left\"]
";
        check(
            robot,
            expect![[r#"
                state
                ---
                ```mauve
                output port state: String
                ```

                ```text
                left.state is not connected
                left.state publishes /uav/left/state: std_msgs/msg/String, reliable, volatile, depth 1, at most 1048576 bytes, on host eyes
                ```
            "#]],
        );
        let without = robot.split("//- /mauve.toml").next().unwrap();
        assert!(!Fixture::new(without).hover().unwrap().markdown.contains("publishes"));
    }

    #[test]
    fn a_port_has_its_connections() {
        check(
            &details("$2"),
            expect![[r#"
            scan
            ---
            ```mauve
            output port scan: int
            ```

            ```text
            left.scan -> map.scan
            right.scan is not connected
            ```
        "#]],
        );
        check(
            &details("$6"),
            expect![[r#"
                scan
                ---
                ```text
                left.scan -> map.scan: no latency: `map` may never read the port
                map reads before left writes, in each period
                ```

                ```mauve
                input port scan: int
                ```

                ```text
                left.scan -> map.scan
                ```
            "#]],
        );
    }

    #[test]
    fn a_state_and_a_transition_have_their_times() {
        check(
            &details("$3"),
            expect![[r#"
                Idle
                ---
                ```mauve
                initial state Idle
                ```

                ```text
                Laser at 1e-4
                          2 ms  Idle.run
                          2 ms  Idle.go.guard
                          4 ms  longest period
                ```
            "#]],
        );
        check(
            &details("$5"),
            expect![[r#"
                go
                ---
                ```mauve
                transition go if (shoot(n) > 0) to Busy
                ```

                ```text
                Laser at 1e-4
                          2 ms  Idle.go.guard
                          4 ms  longest period
                ```
            "#]],
        );
    }

    const TWO_COMPUTERS: &str = "
codel plan$1(): int
codel drive$2(): int
shell S { }
core K(S) { statemachine { initial state Idle$3 { run = { plan(); drive(); } transition t to Idle } } }
component C(S, K)
architecture A { instance pilot: C }
deployment Land { architecture A  activity pilot { priority = 1 period = 100 } }
deployment Sea { architecture A  activity pi$4lot { priority = 1 period = 100 } }
//- /mauve.toml
timing.tables = [\"land.toml\"]
timing.deployment.Sea.tables = [\"sea.toml\"]
platform.rt_throttling = false
//- /land.toml
codel.plan = 3
codel.drive = 4
//- /sea.toml
codel.plan = 8
codel.drive = 4
";

    #[test]
    fn the_times_of_all_deployments_where_they_differ() {
        let at = |cursor: &str| {
            let text = TWO_COMPUTERS.replace(cursor, "$0");
            ["$1", "$2", "$3", "$4"].iter().fold(text, |text, mark| text.replace(mark, ""))
        };
        check(
            &at("$1"),
            expect![[r#"
            plan
            ---
            ```mauve
            codel plan(): int
            ```

            ```text
            3 ms at 1e-4 (current level)
            8 ms at 1e-4 (current level), times of Sea
            ```
            from `land.toml`, line 1

            from `sea.toml`, line 1 (times of Sea)

            may take at most 96 ms in `Land` (now 3 ms, +3100 %)

            may take at most 96 ms in `Sea` (now 8 ms, +1100 %)

        "#]],
        );
        check(
            &at("$2"),
            expect![[r#"
            drive
            ---
            ```mauve
            codel drive(): int
            ```

            ```text
            4 ms at 1e-4 (current level)
            ```
            from `land.toml`, line 2

            from `sea.toml`, line 2 (times of Sea)

            may take at most 97 ms in `Land` (now 4 ms, +2325 %)

            may take at most 92 ms in `Sea` (now 4 ms, +2200 %)

        "#]],
        );
        check(
            &at("$3"),
            expect![[r#"
            Idle
            ---
            ```mauve
            initial state Idle
            ```

            ```text
            C at 1e-4
                      7 ms  Idle.run
                      7 ms  longest period
            C at 1e-4, times of Sea
                     12 ms  Idle.run
                     12 ms  longest period
            ```
        "#]],
        );
        check(
            &at("$4"),
            expect![[r#"
                pilot
                ---
                **✓ 12 / 100 ms** ▰▱▱▱▱▱ 12 %, slack 88 ms at 1e-4, times of Sea

                |               | priority |      jobs |  time |                      |
                | :------------ | :------: | --------: | ----: | :------------------- |
                | own time      | 1        | 1 × 12 ms | 12 ms | ████████████████████ |
                | **response time** |          |           | **12 ms** |                      |

                costliest period: 12 ms, `Idle —t→ Idle`

                - `Idle.run` 12 ms: `plan` 8 ms, `drive` 4 ms

                ---

                - component `C`, period 100 ms, deadline 100 ms, method exact

                ```mauve
                instance pilot: C
                ```


                - [`Land`](file:///model.mal#L7): ✓ 7 / 100 ms ▰▱▱▱▱▱ 7 % at 1e-4

            "#]],
        );
    }

    #[test]
    fn tables_that_no_deployment_uses() {
        let text = TWO_COMPUTERS.replace(
            "timing.deployment.Sea",
            "timing.deployment.Land.tables = 'sea.toml'\ntiming.deployment.Sea",
        );
        let text = text.replace("codel.drive = 4\n", "").replace("plan$1", "plan$0");
        let text = ["$2", "$3", "$4"].iter().fold(text, |text, mark| text.replace(mark, ""));
        check(
            &text,
            expect![[r#"
                plan
                ---
                ```mauve
                codel plan(): int
                ```

                ```text
                8 ms at 1e-4 (current level), times of Land, Sea
                ```
                from `land.toml`, line 1 (used by no deployment)

                from `sea.toml`, line 1 (times of Land, Sea)

                how much it may take in `Land` is unknown: `pilot` is not analysed

                how much it may take in `Sea` is unknown: `pilot` is not analysed

            "#]],
        );
    }

    #[test]
    fn a_measured_codel_shows_its_measurement() {
        let record = "executions = 300\ngreatest = 7.5\ntimes = 9\nmethod = \"\"\ndate = 2026-11-23\nsamples = \"\"\n\
                      files = []\nbytes = 0\nwarnings = [\"only 300 executions: measure at least 500\", \"heavy-tail\"]\n";
        check(
            &format!(
                "codel pl$0an(): int\n//- /mauve.toml\ntiming.tables = [\"times.toml\"]\n//- /times.toml\n\
                      codel.plan = 9\n[measured.plan]\n{record}"
            ),
            expect![[r#"
                plan
                ---
                ```mauve
                codel plan(): int
                ```

                ```text
                9 ms at 1e-4 (current level)
                measured on 2026-11-23: 300 executions, the longest 7.5 ms
                warnings: only 300 executions: measure at least 500, heavy-tail
                ```
                from `times.toml`, line 1

            "#]],
        );
    }

    #[test]
    fn a_codel_says_which_table_has_its_times() {
        check(
            &details("$7"),
            expect![[r#"
                shoot
                ---
                ```mauve
                codel shoot(out n: ctypes.uint8): int
                ```

                ```text
                1 ms at 1e-3
                2 ms at 1e-4 (current level)
                ```
                from `times/a.toml`, line 4

                may take at most 2.5 ms in `D` (now 2 ms, +25 %)

            "#]],
        );
    }

    #[test]
    fn a_variable_says_its_type() {
        check(
            &details("$8"),
            expect![[r#"
            n
            ---
            ```mauve
            var n: ctypes.uint8 = 0
            ```

        "#]],
        );
    }

    #[test]
    fn a_variable_that_is_followed_says_its_values() {
        let model = "codel f(): void shell S { } core K(S) { var le$0ft: int = 0
            update = { if left == 0 then { f(); left = 9; } else { left = left - 1; } } }";
        check(
            model,
            expect![[r#"
            left
            ---
            ```mauve
            var left: int = 0
            ```

            values: 0 … 9

        "#]],
        );
    }

    #[test]
    fn white_space_and_comments_have_no_hover() {
        check("codel f(): int $0 // here", expect![[r#""#]]);
    }
}
