//! # unknown-package
//!
//! No library of the project has this name, nor any message package that is known: those of the environment
//! (`ROS_PACKAGE_PATH`, `AMENT_PREFIX_PATH`, `CMAKE_PREFIX_PATH`) and the common ones. What it declares is not checked.
//!
//! ```mauve
//! library a {
//!   use robot_msgs   // hint
//!   use geometry_msgs
//!   use b
//! }
//! library b { }
//! ```

use super::*;
use mauve_hir::catalogue;

code!(UNKNOWN_PACKAGE, Hint, "unknown-package");

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    at: Location<'db>,
    name: &str,
) -> Diagnostic<'db> {
    let candidates = names_of(db, project).libraries().chain(catalogue().keys());
    let near = similar(name, candidates);
    let message = format!("no library and no message package `{name}`: its types are not checked");
    Diagnostic::new(&UNKNOWN_PACKAGE, at, message).did_you_mean(near)
}
