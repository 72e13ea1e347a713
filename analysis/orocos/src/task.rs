//! The base class of all components of a package, derived from `RTT::TaskContext`:
//! `include/<package>/<package>-task.hpp`.
//!
//! | what | why |
//! |---|---|
//! | `mauve_runs_as(priority, cpus)` | RTT lowers a scheduler or a priority that it cannot have, and keeps the CPUs of a thread where it cannot set them: the thread itself looks what it has |
//! | `mauve_released_by(port, least, burst, needs_all)` | RTT's event ports know no gap between releases |
//! | `mauve_is_not_preempted()` | RTT gives a thread one priority for good |
//! | `mauve_executes(peer)` | a slave activity of RTT executes nothing until its master's component calls it |
//! | `MauveCall` | RTT's owner of an operation executes it whenever it is asked to, also while the deployer's thread executes its `configure`, `start` or `stop` |
//! | `mauve_send`, `mauve_collect` | RTT throws in the caller where an operation throws in its owner |
//! | `mauve_parse` | RTT's scripts cannot set properties of some types |
//! | `state`, `period` | what a running component does, for those who watch |
//!
//! Each package has its own: two packages that were generated at different times are loaded into one deployer.

use crate::generated_file::GeneratedFile;
use crate::library::Library;

/// Returns the header; none for a library without components.
pub(crate) fn task_files(library: &Library<'_>) -> Vec<GeneratedFile> {
    if library.components.is_empty() {
        return Vec::new();
    }
    vec![GeneratedFile::from_template(
        &library.package,
        "include/{lib}/{lib}-task.hpp",
        include_str!("../templates/task.hpp"),
    )]
}
