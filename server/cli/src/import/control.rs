//! The threads of ros2_control in an imported system: control loops, and asynchronous controllers.

use std::collections::BTreeSet;

use mauve_hir::ros2_files::{Controller, ControllersFile};
use mauve_pwcet::trace::ros2_identifier;

use super::names::{camel_case, unique};

/// A thread, and what it executes in a cycle.
pub(super) struct ControlThread {
    /// The name of its instance.
    name: String,
    component: String,
    /// Its name in the file.
    thread: String,
    codels: Vec<String>,
}

impl ControlThread {
    /// Returns the threads of a file, with names that are not known yet. A loop has each controller in each cycle: one with a lower rate
    /// is due in some, and in none more often.
    pub(super) fn of(file: &ControllersFile, known: &mut BTreeSet<String>) -> Vec<ControlThread> {
        let mut found = Vec::new();
        let mut new = |name: &str| {
            let name = unique(name, |it| known.contains(it));
            known.insert(name.clone());
            name
        };
        let mut add = |thread: String, name: &str, codels: &[String]| {
            // A file may have any text; what is no name, no program of ROS 2 has.
            let is_name = |it: char| it.is_ascii_graphic() && !['"', '\\'].contains(&it);
            if thread.chars().all(is_name) {
                let codels = codels.iter().map(|it| new(&ros2_identifier(it))).collect();
                let (component, name) = (new(&camel_case(name)), new(name));
                found.push(ControlThread { name, component, thread, codels });
            }
        };
        for manager in &file.managers {
            let thread = |it: &Controller| format!("{}/{}", manager.namespace(), it.name);
            let (apart, in_loop): (Vec<&Controller>, Vec<_>) =
                manager.controllers.iter().partition(|it| it.has_thread());
            let [read, write] = ["read", "write"].map(|it| format!("{}_{it}", manager.name));
            let updates = in_loop.into_iter().map(|it| thread(it) + "_update");
            let codels: Vec<String> = std::iter::once(read).chain(updates).chain([write]).collect();
            add(manager.name.clone(), &ros2_identifier(&manager.name), &codels);
            for it in apart {
                // A name alone may be a keyword.
                add(thread(it), &ros2_identifier(&(thread(it) + "_async")), &[thread(it) + "_update"]);
            }
        }
        found
    }

    /// Returns its codels, shell, core and component.
    pub(super) fn component(&self) -> String {
        let ControlThread { component, thread, codels, .. } = self;
        let declared: String = codels.iter().map(|it| format!("  codel {it}(): void\n")).collect();
        let calls: String = codels.iter().map(|it| format!(" {it}();")).collect();
        format!(
            "  // The thread {thread} of ros2_control.\n{declared}  shell {component}Shell {{ }}\n  \
             core {component}Core({component}Shell) {{ update = {{{calls} }} }}\n  \
             component {component}({component}Shell, {component}Core)\n\n"
        )
    }

    pub(super) fn instance(&self) -> String {
        format!("    instance {}: {}\n", self.name, self.component)
    }

    /// Returns its activity: the file has its period, priority and CPUs.
    pub(super) fn activity(&self) -> String {
        format!("    activity {} {{ thread = \"{}\" }}\n", self.name, self.thread)
    }
}
