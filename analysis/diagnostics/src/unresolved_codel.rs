//! # unresolved-codel
//!
//! A program calls a name that is neither a codel, nor an operation of its own component, nor a built-in function (`read`,
//! `write`, `status`, `send`, `collect`).
//!
//! ```mauve
//! codel plan(): int
//! shell S { input port goal: int }
//! core C(S) {
//!   var here: int
//!   update = {
//!     plna();   // error
//!     goal();   // error
//!     status(here);   // error
//!     plan();
//!   }
//! }
//! ```

use super::*;
use mauve_hir::fact::Hidden;
use mauve_hir::{Builtin, codel, core};

pub(super) fn report<'db>(
    scope: Scope<'db>,
    at: Location<'db>,
    (name, arguments): (&Name, usize),
    builtin: Option<Builtin>,
) -> Diagnostic<'db> {
    let diagnostic = Diagnostic::new(&UNRESOLVED_CODEL, at.clone(), format!("no codel or operation `{name}`"));
    if let Some(builtin) = builtin {
        return diagnostic.did_you_mean(Some(builtin.name().into()));
    }
    let near = similar_callee(scope, name, arguments);
    let found = diagnostic.look_elsewhere(scope, (Kind::Codel, std::slice::from_ref(name)), near);
    let (message, written) = match name.as_str() {
        "not" => ("MAUVE writes `!` instead of `not`", Some("!")),
        "publish" => ("MAUVE writes `write(PORT, VALUE)` to send a value to an output port", None),
        _ => return found,
    };
    match found.fixes.is_empty() {
        true => Diagnostic::new(&UNRESOLVED_CODEL, at, message).writing(written),
        false => found,
    }
}

/// Returns the codel or the own operation that `name` is most likely a misspelling of: one that takes as many arguments, if
/// there is one.
fn similar_callee(scope: Scope<'_>, name: &Name, arguments: usize) -> Option<Name> {
    let Scope { db, project, of } = scope;
    let visible = names_of(db, project).visible_of_kind(db, of.library(db).as_ref(), Kind::Codel);
    // `similar` compares with no more names.
    let visible = visible.take(500);
    let parameters = |it: Decl<'_>| codel(db, it).map_or(0, |it| it.parameters.len());
    let codels = visible.map(|it| (it.name(db), parameters(it)));
    let operations = core(db, of).into_iter().flat_map(|it| &it.operations);
    let operations = operations.map(|it| (&it.name.name, it.parameters.len()));
    let all: Vec<(&Name, usize)> = codels.chain(operations).collect();
    let fitting = all.iter().filter(|(_, parameters)| *parameters == arguments).map(|(name, _)| *name);
    similar(name, fitting).or_else(|| similar(name, all.iter().map(|(name, _)| *name)))
}

pub(super) fn built_in<'db>(
    at: Location<'db>,
    function: Builtin,
    first: Option<&(Name, Option<FeatureKind>)>,
    swapped: Option<&[NameRef; 2]>,
    instead: Option<&NameRef>,
) -> Diagnostic<'db> {
    let (form, takes) = match function {
        Builtin::Read => ("read(port, variable)", "an input port"),
        Builtin::Write => ("write(port, value)", "an output port"),
        Builtin::Status => ("status(port)", "an input port"),
        Builtin::Send => ("send(operation, …)", "a required operation"),
        Builtin::Collect => ("collect(handler, …)", "a handler"),
    };
    let new = |message: String| Diagnostic::new(&UNRESOLVED_CODEL, at.clone(), message);
    if let Some([one, other]) = swapped {
        let edits = vec![
            (beside(&at, one.id), other.name.to_string()),
            (beside(&at, other.id), one.name.to_string()),
        ];
        let found = new(format!("the arguments of `{function}` are swapped: write `{form}`"));
        return Diagnostic { fixes: vec![Fix { title: "Swap the arguments".to_owned(), edits }], ..found };
    }
    let Some((name, is)) = first else {
        return new(format!("the first argument of `{function}` is {takes}: write `{form}`"));
    };
    let is = is.map_or("a variable", types::feature_kind);
    let found = new(format!("`{function}` takes {takes}, and `{name}` is {is}"));
    let Some(instead) = instead else { return found };
    let found = Diagnostic { message: format!("{}; did you mean `{}`?", found.message, instead.name), ..found };
    found.fix(format!("Change to `{}`", instead.name), beside(&at, instead.id), instead.name.to_string())
}

pub(super) fn not_callable<'db>(
    at: Location<'db>,
    name: &str,
    is: Option<FeatureKind>,
    hides: Option<Hidden>,
) -> Diagnostic<'db> {
    let what = match is {
        None => "a variable",
        Some(kind) if kind.is_port() => "a port",
        Some(_) => "a property",
    };
    let hidden = hides.map(|hidden| match hidden {
        Hidden::Codel => "codel",
        Hidden::Builtin => "built-in function",
    });
    let message = match hidden {
        Some(hidden) => format!("`{name}` is {what} here, which hides the {hidden} of that name: rename one of them"),
        None => format!("`{name}` is {what}: only codels and operations are called"),
    };
    Diagnostic::new(&UNRESOLVED_CODEL, at, message)
}
