//! # unknown-type
//!
//! Nobody knows this type: it is not built in, in no message package that is used here, and `mauve.toml` does not declare it.
//! It can be used all the same, and fits everywhere: what it is used for is not checked. It is reported where its library
//! first names it.
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

/// `package` has a type of this name, and is not used; `near` is one that is known.
pub(crate) fn report<'db>(
    of: Decl<'db>,
    at: Place<'db>,
    path: &[Name],
    package: Option<&Name>,
    near: Option<Name>,
) -> Diagnostic<'db> {
    let name = path.iter().map(Name::as_str).collect::<Vec<_>>().join(".");
    let message = format!("nobody knows the type `{name}`, so that its use is not checked");
    let new = |advice: String| Diagnostic::new(&UNKNOWN_TYPE, at.clone(), message.clone() + &advice);
    match (package, path) {
        (Some(package), [_]) => new(format!("; `{package}` has one: add `use {package}`")).add_use(of, package),
        (None, [name]) if near.is_none() => new(format!("; `[types.{name}]` in mauve.toml would declare it")),
        _ => new(String::new()).did_you_mean(at.clone(), near),
    }
}
