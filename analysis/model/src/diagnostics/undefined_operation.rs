//! # undefined-operation
//!
//! The shell provides an operation, and the core does not define it. Where a program calls it, the core is not analysed.
//!
//! ```mauve
//! shell S { provide reset(): void  provide stop(): void }
//! core C(S) {   // error
//!   provide reset() = { }
//!   update = { reset(); }
//! }
//! core D(S) {
//!   provide reset() = { }
//!   provide stop() = { reset(); }
//!   update = { stop(); }
//! }
//! ```
//!
//! Fix: define it, with nothing in it but a value to return.

use super::*;
use crate::item_tree::{Direction, Feature, Parameter};
use crate::types::built_in_type;

code!(UNDEFINED_OPERATION, Error, "undefined-operation");

pub(crate) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Place<'db>,
    core: Decl<'db>,
    name: &str,
    declared: &FeatureOf<'db>,
) -> Diagnostic<'db> {
    let message = format!("the operation `{name}` is not defined: write `provide {name}(…) = {{ … }}`");
    let found = Diagnostic::new(&UNDEFINED_OPERATION, at, message);
    let Some(data) = declared.data(db) else { return found };
    let found = found.related(Place::Part(declared.shell, data.name.part), "declared here");
    match operation_skeleton(name, data) {
        Some(skeleton) => found.add_item(db, core, format!("Define `{name}`"), &skeleton),
        None => found,
    }
}

/// The definition of an operation that a shell declares, with nothing in it but a value to return; none while something in
/// the declaration is missing.
pub fn operation_skeleton(name: &str, data: &Feature) -> Option<String> {
    let parameter = |it: &Parameter| {
        let direction = match it.direction {
            Direction::In => "",
            Direction::Out => "out ",
            Direction::InOut => "inout ",
        };
        Some(format!("{direction}{}: {}", it.name.name, it.ty.as_ref()?))
    };
    let parameters: Option<Vec<String>> = data.parameters.iter().map(parameter).collect();
    let (parameters, result) = (parameters?, data.ty.as_ref()?.to_string());
    let body = match result.as_str() {
        "void" => String::new(),
        "bool" => "  return false;\n".to_owned(),
        "double" | "float" => "  return 0.0;\n".to_owned(),
        "string" => "  return \"\";\n".to_owned(),
        _ if matches!(built_in_type(&result), Some(Type::Integer(_))) => "  return 0;\n".to_owned(),
        _ => format!("  var result: {result};\n  return result;\n"),
    };
    Some(format!("provide {name}({}): {result} = {{\n{body}}}", parameters.join(", ")))
}
