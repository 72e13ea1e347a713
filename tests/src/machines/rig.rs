//! The C++ around a generated package: codels that write down what they are given, and the program that runs the components.

use std::fmt::Write as _;

use super::*;

impl Ty {
    fn cpp(self) -> &'static str {
        match self {
            Ty::Int => "int",
            Ty::Byte => "std::uint8_t",
            Ty::Float => "float",
            Ty::Double => "double",
            Ty::Bool => "bool",
            Ty::Text => "std::string",
            Ty::PortStatus | Ty::CallStatus => unreachable!("nothing is declared with it"),
        }
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
        let of = |fits: &dyn Fn(Way) -> bool| -> Vec<String> {
            let all = codel.parameters.iter().zip(&names).filter(|((way, _), _)| fits(*way));
            all.map(|(_, name)| format!("rig::show({name})")).collect()
        };
        let (ins, mut outs) = (of(&|way| way != Way::Out), of(&|way| way != Way::In));
        let _ = writeln!(
            out,
            "\n{prototype} {{\n  const std::string rig_ins = rig::join({{{}}});",
            ins.join(", ")
        );
        if let Some(ty) = codel.result {
            let ty = ty.cpp();
            let _ = writeln!(out, "  const {ty} rig_result = rig::drawn<{ty}>(rig::results());");
            outs.insert(0, "rig::show(rig_result)".to_owned());
        }
        for ((way, _), name) in codel.parameters.iter().zip(&names) {
            if *way != Way::In {
                let _ = writeln!(out, "  rig::draw(rig::results(), {name});");
            }
        }
        let _ = writeln!(
            out,
            "  rig::line(\"{}(\" + rig_ins + \") -> \" + rig::join({{{}}}));",
            codel.name,
            outs.join(", ")
        );
        out += if codel.result.is_some() { "  return rig_result;\n}\n" } else { "}\n" };
    }
    out + "\n}  // namespace machines\n"
}

/// How RTT sees it, and the ways of its parameters.
fn signature(of: &Signature) -> (String, String) {
    let parameters = of.parameters.iter().map(|(way, ty)| match way {
        Way::In => ty.cpp().to_owned(),
        Way::Out | Way::InOut => format!("{}&", ty.cpp()),
    });
    let ways = of.parameters.iter().map(|(way, _)| match way {
        Way::In => 'i',
        Way::Out => 'o',
        Way::InOut => 'b',
    });
    let result = of.result.map_or("void", Ty::cpp);
    (format!("{result}({})", parameters.collect::<Vec<_>>().join(", ")), ways.collect())
}

/// A program that runs each component of a library that is given to it.
pub fn program_source(library: &Library) -> String {
    let mut out = String::from(
        "#include <cstdint>\n#include <exception>\n#include <iostream>\n\n#include <rig.hpp>\n#include <main.hpp>\n\nnamespace {\n",
    );
    for it in &library.components {
        let _ = writeln!(out, "\nvoid {}(const rig::ComponentLibrary& library) {{", it.name);
        let _ = writeln!(out, "  rig::Rig rig(library, \"{}\", {}u);", it.name, it.seed);
        for port in &it.inputs {
            let _ = writeln!(out, "  rig.input<{}>(\"{}\", {});", port.ty.cpp(), port.name, port.size);
        }
        for port in &it.outputs {
            let _ = writeln!(out, "  rig.output<{}>(\"{}\");", port.ty.cpp(), port.name);
        }
        for property in &it.properties {
            let _ = writeln!(
                out,
                "  rig.property<{}>(\"{}\", {}, {});",
                property.ty.cpp(),
                property.name,
                property.first.cpp(),
                property.later.cpp()
            );
        }
        for (of, _, _) in &it.provided {
            let (signature, ways) = signature(of);
            let _ = writeln!(out, "  rig.provided<{signature}>(\"{}\", \"{ways}\");", of.name);
        }
        for required in it.required.iter().filter(|it| it.is_connected) {
            let (signature, ways) = signature(&required.signature);
            let _ =
                writeln!(out, "  rig.required<{signature}>(\"{}\", \"{ways}\");", required.signature.name);
        }
        let _ = writeln!(out, "  rig.go({TICKS});\n}}");
    }
    out += "\n}  // namespace\n\nint ORO_main(int argc, char** argv) {\n  if (argc != 2) return 2;\n  try {\n    \
        const rig::ComponentLibrary library(argv[1]);\n";
    for it in &library.components {
        let _ = writeln!(out, "    {}(library);", it.name);
    }
    out + "  } catch (const std::exception& thrown) {\n    std::cerr << thrown.what() << std::endl;\n    return 1;\n  }\n  \
        return 0;\n}\n"
}
