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
use mauve_hir::{LANGUAGE_TYPES, catalogue, external_types, package, used_packages};

code!(UNKNOWN_TYPE, Hint, "unknown-type");

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    at: Location<'db>,
    of: Decl<'db>,
    ty: &TypeRef,
) -> Diagnostic<'db> {
    let message = format!("nobody knows the type `{ty}`, so that its use is not checked");
    let found = Diagnostic::new(&UNKNOWN_TYPE, at, message);
    match ty.path.as_slice() {
        [name] => of_name(db, project, found, of, name),
        [package_name, .., name] => {
            let package = package(db, project.workspace(db), package_name);
            let near = similar(name, package.into_iter().flat_map(|it| it.messages.keys()));
            found.did_you_mean(near.map(|near| format!("{package_name}.{near}").into()))
        }
        [] => found,
    }
}

/// Suggests a package with a type of this name, or a type with a similar name.
fn of_name<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    mut found: Diagnostic<'db>,
    of: Decl<'db>,
    name: &Name,
) -> Diagnostic<'db> {
    let workspace = project.workspace(db);
    let is_language = |(built_in, _): &&(&str, Type)| name.eq_ignore_ascii_case(built_in);
    // `String` is more likely the language's `string` than a message of that name.
    if let Some((built_in, _)) = LANGUAGE_TYPES.iter().find(is_language) {
        return found.did_you_mean(Some((*built_in).into()));
    }
    let declares = |of: &&Name| package(db, workspace, of).is_some_and(|it| it.messages.contains_key(name));
    if of.library(db).is_some()
        && let Some(package) = catalogue().keys().find(declares)
    {
        found.message += &format!("; `{package}` has one: add `use {package}`");
        return found.add_use(of, package);
    }
    let used = used_packages(db, project).get(of.library(db)).into_iter().flatten();
    let messages = used.filter_map(|of| package(db, workspace, of)).flat_map(|it| it.messages.keys());
    let own: Vec<Name> = LANGUAGE_TYPES.iter().map(|(name, _)| (*name).into()).collect();
    let candidates = messages.chain(external_types(db, workspace).keys()).chain(&own);
    match similar(name, candidates) {
        None => found.message += &format!("; `[types.{name}]` in mauve.toml would declare it"),
        near => return found.did_you_mean(near),
    }
    found
}
