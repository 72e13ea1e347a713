//! Skeletons of missing definitions.

use crate::item_tree::{Direction, Feature, Parameter};
use crate::types::{Type, built_in_type};

/// Returns a definition of an operation that a shell declares, with a `return` as its only statement; `None` if the
/// declaration is incomplete.
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
