//! The C++ around a generated package: codels that record their arguments, and the program that runs the components.

use std::fmt::Write as _;

use super::{Library, TICKS, Value};
use crate::model::{Parameter, Port, Signature};

/// The C++ type of a type.
fn cpp_type(ty: &str) -> &str {
    match ty {
        "uint8" => "std::uint8_t",
        "string" => "std::string",
        ty => ty,
    }
}

impl Value {
    fn cpp(&self) -> String {
        match self {
            Value::Int(number) | Value::Status(number) => number.to_string(),
            Value::Float(number) => format!("{number:?}f"),
            Value::Double(number) => format!("{number:?}"),
            Value::Bool(value) => value.to_string(),
            Value::Text(text) => {
                let bytes: String = text.bytes().map(|byte| format!("\\{byte:03o}")).collect();
                format!("\"{bytes}\"")
            }
            Value::Unknown => panic!("the rig knows its values"),
        }
    }
}

/// All codels, each by its prototype in the generated package: `double plan(int a0, double& a1)`.
pub fn codels_source(library: &Library, prototype: &dyn Fn(&str) -> String) -> String {
    let mut out = String::from(
        "#include <machines/machines-codels.hpp>\n\n#include <recorder.hpp>\n\nnamespace machines {\n",
    );
    for codel in &library.codels {
        let prototype = prototype(&codel.name);
        let names: Vec<&str> = prototype
            .split_once('(')
            .and_then(|(_, rest)| rest.strip_suffix(')'))
            .map(|all| all.split(", ").filter(|it| !it.is_empty()).collect::<Vec<_>>())
            .unwrap_or_default()
            .into_iter()
            .filter_map(|it| it.rsplit([' ', '&']).next())
            .collect();
        let shown = |fits: fn(&Parameter) -> bool| -> Vec<String> {
            let all = codel.parameters.iter().zip(&names).filter(|(parameter, _)| fits(parameter));
            all.map(|(_, name)| format!("rig::show({name})")).collect()
        };
        let (ins, mut outs) = (shown(Parameter::is_given), shown(Parameter::returns));
        let _ = writeln!(
            out,
            "\n{prototype} {{\n  const std::string rig_ins = rig::join({{{}}});",
            ins.join(", ")
        );
        if let Some(ty) = codel.returned().map(cpp_type) {
            let _ = writeln!(out, "  const {ty} rig_result = rig::drawn<{ty}>(rig::results());");
            outs.insert(0, "rig::show(rig_result)".to_owned());
        }
        for (parameter, name) in codel.parameters.iter().zip(&names) {
            if parameter.returns() {
                let _ = writeln!(out, "  rig::draw(rig::results(), {name});");
            }
        }
        let _ = writeln!(
            out,
            "  rig::line(\"{}(\" + rig_ins + \") -> \" + rig::join({{{}}}));",
            codel.name,
            outs.join(", ")
        );
        out += if codel.returned().is_some() { "  return rig_result;\n}\n" } else { "}\n" };
    }
    out + "\n}  // namespace machines\n"
}

/// The C++ type of an operation, and a letter for the direction of each parameter.
fn signature(of: &Signature) -> (String, String) {
    let parameters = of.parameters.iter().map(|it| {
        let reference = if it.returns() { "&" } else { "" };
        format!("{}{reference}", cpp_type(&it.ty))
    });
    let directions = of.parameters.iter().map(|it| match (it.is_given(), it.returns()) {
        (true, false) => 'i',
        (false, _) => 'o',
        (true, true) => 'b',
    });
    let result = of.returned().map_or("void", cpp_type);
    (format!("{result}({})", parameters.collect::<Vec<_>>().join(", ")), directions.collect())
}

/// A program that runs each component of a library that is given to it.
pub fn program_source(library: &Library) -> String {
    let mut out =
        String::from("#include <cstdint>\n\n#include <rig.hpp>\n#include <main.hpp>\n\nnamespace {\n");
    for it in &library.components {
        let scenario = &it.scenario;
        let _ = writeln!(out, "\nvoid {}(const rig::ComponentLibrary& library) {{", it.name);
        let _ = writeln!(out, "  rig::Rig rig(library, \"{}\", {}u);", it.name, scenario.seed);
        for (Port { name, ty, .. }, buffer) in it.inputs().zip(&scenario.buffers) {
            let _ = writeln!(out, "  rig.input<{}>(\"{name}\", {buffer});", cpp_type(ty));
        }
        for Port { name, ty, .. } in it.outputs() {
            let _ = writeln!(out, "  rig.output<{}>(\"{name}\");", cpp_type(ty));
        }
        for (of, (first, later)) in it.shell.values.iter().zip(&scenario.values) {
            let (ty, first, later) = (cpp_type(&of.ty), first.cpp(), later.cpp());
            let _ = writeln!(out, "  rig.property<{ty}>(\"{}\", {first}, {later});", of.name);
        }
        for of in &it.shell.provided {
            let (signature, directions) = signature(of);
            let _ = writeln!(out, "  rig.provided<{signature}>(\"{}\", \"{directions}\");", of.name);
        }
        let connected =
            it.shell.required.iter().zip(&scenario.connected).filter(|(_, is_connected)| **is_connected);
        for (of, _) in connected {
            let (signature, directions) = signature(of);
            let _ = writeln!(out, "  rig.required<{signature}>(\"{}\", \"{directions}\");", of.name);
        }
        let _ = writeln!(out, "  rig.go({TICKS});\n}}");
    }
    let names: Vec<&str> = library.components.iter().map(|it| it.name.as_str()).collect();
    let _ = writeln!(
        out,
        "\n}}  // namespace\n\nint ORO_main(int argc, char** argv) {{\n  \
         return rig::run_components(argc, argv, {{{}}});\n}}",
        names.join(", ")
    );
    out
}
