//! # unknown-type
//!
//! Nobody knows this type: it is not built in, in no message package that is used here, and `mauve.toml` does not declare it.
//! It can be used all the same, and fits everywhere: what it is used for is not checked.
//!
//! ```mauve
//! library a {
//!   use geometry_msgs
//!   codel f(in here: Pose, in robot: ArRobotPtr, in there: Psoe): void   // hint
//! }
//! //- /mauve.toml
//! [types.ArRobotPtr]
//! cpp = "ArRobot*"
//! header = "Aria/Aria.h"
//! ```

use super::*;

code!(UNKNOWN_TYPE, Hint, "unknown-type");

pub(crate) fn report<'db>(at: Place<'db>, path: &[Name], package: Option<&Name>, near: Option<Name>) -> Diagnostic<'db> {
    let name = path.iter().map(Name::as_str).collect::<Vec<_>>().join(".");
    let advice = match (package, path) {
        (Some(package), [_]) => format!("; `{package}` has one: add `use {package}`"),
        (None, [name]) if near.is_none() => format!("; `[types.{name}]` in mauve.toml would declare it"),
        _ => String::new(),
    };
    let message = format!("nobody knows the type `{name}`, so that its use is not checked{advice}");
    Diagnostic::new(&UNKNOWN_TYPE, at.clone(), message).did_you_mean(at, near.filter(|_| advice.is_empty()))
}
