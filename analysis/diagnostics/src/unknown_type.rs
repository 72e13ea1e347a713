//! # unknown-type
//!
//! A type is not built in, not a message of a package that its library uses, and not declared in `mauve.toml`. A model may
//! use it: it is compatible with every type, and its use is not checked. It is reported where its library first names it.
//!
//! ```mauve
//! library a {
//!   use geometry_msgs
//!   codel f(in here: Pose, in robot: ArRobotPtr, in map: GridMap): void   // hint
//! }
//! //- /mauve.toml
//! [types.ArRobotPtr]
//! cpp = "ArRobot*"
//! header = "Aria/Aria.h"
//! ```
//!
//! A name that is similar to a known one has the warning `misspelt-name` instead.

use super::*;
use mauve_hir::{catalogue_of, package};

pub(super) fn report<'db>(scope: Scope<'db>, at: Location<'db>, ty: &TypeRef) -> Diagnostic<'db> {
    let Scope { db, project, of } = scope;
    let message = format!("unknown type `{ty}`: its use is not checked");
    let mut found = Diagnostic::new(&UNKNOWN_TYPE, at.clone(), message);
    if let [name] = ty.path.as_slice()
        && of.library(db).is_some()
    {
        let workspace = project.workspace(db);
        let declares = |it: &&Name| package(db, workspace, it).is_some_and(|it| it.messages.contains_key(name));
        if !misspelt_name::is_built_in(name)
            && let Some(package) = catalogue_of(db, workspace).keys().find(declares)
        {
            found.message += &format!("; `{package}` has one: add `use {package}`");
            return found.add_use(of, package);
        }
    }
    if let Some(near) = scope.similar_type(&ty.path) {
        return misspelt_name::of_type(scope, at, ty, &near);
    }
    if let [name] = ty.path.as_slice() {
        found.message += &format!("; `[types.{name}]` in mauve.toml declares it");
    }
    found
}
