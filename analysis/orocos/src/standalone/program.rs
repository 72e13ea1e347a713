//! The main of a deployment: it gives the runtime what a script gives the deployer of Orocos, the response times, and the
//! execution times.
//!
//! ```text
//! robot.instance("pilot", "motion", "motion::Pilot");
//! robot.connect("laser.scan", "pilot.scan");
//! robot.activity("pilot", 100000000, 10, 0x1, 0, 80000000, 7400000);
//! ```

use mauve_hir::{Decl, Value};
use mauve_timing::Time;
use mauve_wcrt::{Query, execution_times, response_times};
use rustc_hash::FxHashMap;

use crate::cpp_name::task_name;
use crate::deployment::{BACKGROUND, CONNECTIONS, Deployed, OPERATIONS, PROVIDERS_FIRST, SET, Task};
use crate::escape::cpp_string;
use crate::generated_file::generated_from;
use crate::library::Model;
use crate::origin::comment_lines;
use crate::trace::{codel_key, program_key};

/// Returns the main of a deployment.
pub(super) fn main_file<'db>(model: Model<'_, 'db>, of: Decl<'db>, deployed: &Deployed) -> String {
    let mut main = Main { text: String::new() };
    let about = deployed.description.trim_end_matches('.');
    main.text += &format!("// {}\n//\n", generated_from(&deployed.package));
    comment_lines(&format!("{about}, without Orocos."))
        .iter()
        .for_each(|line| main.text += &format!("// {line}\n"));
    main.text += "\n#include <mauve/robot.hpp>\n\nint main(int argc, char** argv) {\n";
    main.call("mauve::Robot robot", &[cpp_string(&deployed.qualified)]);
    connected_instances(&mut main, deployed);
    activities(&mut main, model, of, deployed);
    times(&mut main, model, of);
    main.text += "\n  return robot.run(argc, argv);\n}\n";
    main.text
}

/// The text of a main.
struct Main {
    text: String,
}

impl Main {
    /// Writes an empty line and a comment about the next lines.
    fn section(&mut self, about: &str) {
        self.text.push('\n');
        self.comment(about);
    }

    fn comment(&mut self, text: &str) {
        comment_lines(text).iter().for_each(|line| self.text += &format!("  // {line}\n"));
    }

    fn call(&mut self, function: &str, arguments: &[String]) {
        self.text += &format!("  {function}({});\n", arguments.join(", "));
    }
}

fn connected_instances(main: &mut Main, deployed: &Deployed) {
    main.section(PROVIDERS_FIRST);
    for Task { name, class, .. } in deployed.in_order() {
        let package = class.split("::").next().unwrap_or_default();
        main.call("robot.instance", &[name, package, class].map(cpp_string));
    }
    if deployed.tasks.iter().any(|task| !task.values.is_empty()) {
        main.section(SET);
    }
    for task in &deployed.tasks {
        for (property, value, _) in &task.values {
            main.call("robot.value", &[cpp_string(&task.name), cpp_string(property), value_text(value)]);
        }
    }
    if !deployed.connections.is_empty() {
        main.section(CONNECTIONS);
    }
    for ([from, to], buffer) in &deployed.connections {
        let ends = [from, to].map(|end| cpp_string(end)).into_iter();
        main.call("robot.connect", &ends.chain(buffer.map(|size| size.to_string())).collect::<Vec<_>>());
    }
    if !deployed.operations.is_empty() {
        main.section(OPERATIONS);
    }
    for operations in &deployed.operations {
        main.call("robot.operation", &operations.each_ref().map(|end| cpp_string(end)));
    }
}

/// Returns a value as the runtime reads it: a number as C++ writes it, `true` or `false`, or a string as it is.
fn value_text(value: &Value) -> String {
    match value {
        Value::String(text) if text.contains('\0') => {
            format!("std::string({}, {})", cpp_string(text), text.len())
        }
        Value::String(text) => cpp_string(text),
        other => cpp_string(&other.text()),
    }
}

fn activities<'db>(main: &mut Main, model: Model<'_, 'db>, of: Decl<'db>, deployed: &Deployed) {
    let Model { db, project, .. } = model;
    let report = response_times(db, project, of, Query::shown(db, project));
    let bounds: FxHashMap<String, Option<Time>> =
        report.activities.iter().rev().map(|it| (task_name(&it.instance), it.response)).collect();
    main.section(
        "Creates the activities: period in ns, priority (0: background), CPUs (one bit for each; 0: any), offset, \
         deadline and response time in ns.",
    );
    let nanoseconds =
        |time: Option<Time>| time.map_or("mauve::no_bound".to_owned(), |it| it.as_nanos().to_string());
    for Task { name, activity, .. } in &deployed.tasks {
        if activity.assumed {
            main.comment(BACKGROUND);
        }
        let arguments = [
            cpp_string(name),
            activity.period.as_nanos().to_string(),
            activity.priority.unwrap_or_default().to_string(),
            activity.affinity.map_or("0".to_owned(), |cpus| format!("{cpus:#x}")),
            activity.offset.as_nanos().to_string(),
            nanoseconds(activity.deadline),
            nanoseconds(bounds.get(name).copied().flatten()),
        ];
        main.call("robot.activity", &arguments);
    }
    if !report.others.is_empty() {
        main.section(
            "Real-time work that is not in the model: period and execution time in ns, priority, CPUs.",
        );
    }
    for other in &report.others {
        let arguments = [
            cpp_string(&other.name),
            other.period.as_nanos().to_string(),
            other.time.as_nanos().to_string(),
            other.priority.to_string(),
            format!("{:#x}", other.cpus),
        ];
        main.call("robot.other_work", &arguments);
    }
}

fn times<'db>(main: &mut Main, model: Model<'_, 'db>, of: Decl<'db>) {
    let Model { db, project, .. } = model;
    let level = Query::shown(db, project).level;
    let times = execution_times(db, project, of, level);
    let codels: Vec<(Decl<'db>, Time)> =
        times.codels.iter().filter_map(|(codel, time)| Some((*codel, (*time)?))).collect();
    if !codels.is_empty() || !times.programs.is_empty() || times.overhead > Time::ZERO {
        main.section(&format!(
            "Execution times in ns at the significance level {level}, for the virtual clock and for stubs."
        ));
    }
    for (codel, time) in codels {
        main.call("robot.codel_time", &[codel_key(db, codel), time.as_nanos().to_string()]);
    }
    for (component, program, time) in &times.programs {
        let key = program_key(db, *component, program);
        main.call("robot.program_time", &[key, time.as_nanos().to_string()]);
    }
    if times.overhead > Time::ZERO {
        main.call("robot.overhead", &[times.overhead.as_nanos().to_string()]);
    }
    let unknown = times.codels.iter().filter(|(_, time)| time.is_none());
    let unknown: Vec<String> = unknown.map(|(codel, _)| codel.qualified(db)).collect();
    if !unknown.is_empty() {
        main.section(&format!("These codels have no execution time: {}.", unknown.join(", ")));
    }
}
