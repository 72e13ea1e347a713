//! # unknown-package
//!
//! A `use` names neither a library of the project nor a known message package: one that is installed
//! (`ROS_PACKAGE_PATH`, `AMENT_PREFIX_PATH`, `CMAKE_PREFIX_PATH`) or one of the common ones. Its types are not checked.
//!
//! ```mauve
//! library a {
//!   use robot_msgs   // hint
//!   use geometry_msgs
//!   use b
//! }
//! library b { }
//! ```
//!
//! A name that is similar to a known one has the warning `misspelt-name` instead.

use super::*;

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    at: Location<'db>,
    name: &str,
) -> Diagnostic<'db> {
    if let Some(near) = misspelt_name::similar_package(db, project, name) {
        return misspelt_name::of_package(db, project, at, name, near);
    }
    let message = format!(
        "no library or message package `{name}`: its types are not checked; packages are searched along `ROS_PACKAGE_PATH`, \
         `AMENT_PREFIX_PATH` and `CMAKE_PREFIX_PATH`, which the setup file of a workspace of ROS sets"
    );
    Diagnostic::new(&UNKNOWN_PACKAGE, at, message)
}
