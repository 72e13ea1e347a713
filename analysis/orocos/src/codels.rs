//! The C++ side of codels: the types of a library, the prototypes of its codels, and stubs for the user to write.
//!
//! ```text
//! include/motion/motion-types.hpp    the headers of all types that the library names
//! include/motion/motion-codels.hpp   double clearance(const ::sensor_msgs::LaserScan& scan, double width);
//! src/codels/clearance.cpp           the user's: a stub that compiles, until there is more
//! ```

use mauve_model::item_tree::{Direction, Parameter, TypeRef};
use mauve_model::{
    Decl, ModelDb, Place, Project, Type, codel, core, core_of, external_types, features_of, shell_of, type_of,
};

use crate::cpp_name::CppNames;
use crate::cpp_type::{Headers, cpp_type, parameter_type};
use crate::library::Library;
use crate::origin::{origin, origin_file, words_of};
use crate::package::{GeneratedFile, Owner};

/// The longest line of generated code.
const WIDTH: usize = 100;

/// The headers of a library's types and codels, and a stub for each codel.
pub(crate) fn codel_files<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    library: &Library<'db>,
) -> Vec<GeneratedFile> {
    let package = &library.package;
    let mut files = Vec::new();
    if !library.codels.is_empty() || !library.components.is_empty() {
        let path = format!("include/{package}/{package}-types.hpp");
        let text = types_header(&headers_of(db, project, library), package);
        files.push(GeneratedFile { path, text, owner: Owner::Generator });
    }
    let signatures = library.codels.iter().filter_map(|(decl, name)| Signature::of(db, project, *decl, name));
    let signatures: Vec<Signature<'db>> = signatures.collect();
    if !signatures.is_empty() {
        let path = format!("include/{package}/{package}-codels.hpp");
        let text = codels_header(db, project, &signatures, package);
        files.push(GeneratedFile { path, text, owner: Owner::Generator });
    }
    for signature in &signatures {
        let path = format!("src/codels/{}.cpp", signature.name);
        let text = stub(db, project, signature, package);
        files.push(GeneratedFile { path, text, owner: Owner::User { prototype: signature.prototype() } });
    }
    files
}

/// The headers of all types that the codels and the components of a library name.
pub(crate) fn headers_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    library: &Library<'db>,
) -> Headers {
    let workspace = project.workspace(db);
    let mut headers = Headers::default();
    let mut add = |of: Decl<'db>, ty: Option<&TypeRef>, parameters: &[Parameter]| {
        for ty in parameters.iter().filter_map(|it| it.ty.as_ref()).chain(ty) {
            headers.add(db, workspace, &type_of(db, project, of, Some(ty)));
        }
    };
    for &(of, _) in &library.codels {
        if let Some(data) = codel(db, of) {
            add(of, data.result.as_ref(), &data.parameters);
        }
    }
    for &(component, _) in &library.components {
        let shell = shell_of(db, project, component);
        let features = shell.map(|shell| features_of(db, project, shell).by_name.values().flatten());
        for feature in features.into_iter().flatten() {
            if let Some(data) = feature.data(db) {
                add(feature.shell, data.ty.as_ref(), &data.parameters);
            }
        }
        let core = core_of(db, project, component).and_then(|of| Some((of, core(db, of)?)));
        if let Some((of, data)) = core {
            data.all_variables().iter().for_each(|variable| add(of, variable.ty.as_ref(), &[]));
            data.operations.iter().for_each(|it| add(of, it.result.as_ref(), &it.parameters));
        }
    }
    headers
}

/// A codel as C++ declares it.
struct Signature<'db> {
    codel: Decl<'db>,
    /// In the namespace of its library.
    name: String,
    result: String,
    parameters: Vec<CppParameter>,
}

struct CppParameter {
    direction: Direction,
    /// With its `const` and `&`.
    ty: String,
    name: String,
}

impl<'db> Signature<'db> {
    fn of(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, name: &str) -> Option<Signature<'db>> {
        let data = codel(db, of)?;
        let workspace = project.workspace(db);
        let mut names = CppNames::of_namespace();
        // A parameter hides a type of its own name from those that follow.
        for parameter in &data.parameters {
            if let Type::External(ty) = type_of(db, project, of, parameter.ty.as_ref())
                && let Some(external) = external_types(db, workspace).get(&ty)
            {
                let words = external.cpp.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
                words.filter(|word| !word.is_empty()).for_each(|word| names.take(word));
            }
        }
        let mut parameters = Vec::new();
        for parameter in &data.parameters {
            let ty = type_of(db, project, of, parameter.ty.as_ref());
            let cpp = cpp_type(db, workspace, &ty)?;
            parameters.push(CppParameter {
                direction: parameter.direction,
                ty: parameter_type(&cpp, &ty, parameter.direction),
                name: names.declare(&parameter.name.name),
            });
        }
        let result = match &data.result {
            Some(result) => cpp_type(db, workspace, &type_of(db, project, of, Some(result)))?,
            None => "void".to_owned(),
        };
        Some(Signature { codel: of, name: name.to_owned(), result, parameters })
    }

    /// `double clearance(const ::sensor_msgs::LaserScan& scan, double width)`
    fn prototype(&self) -> String {
        let parameters: Vec<String> =
            self.parameters.iter().map(|it| format!("{} {}", it.ty, it.name)).collect();
        format!("{} {}({})", self.result, self.name, parameters.join(", "))
    }

    /// The same with `end` behind it, on as many lines as it needs.
    fn lines(&self, end: &str) -> String {
        let whole = self.prototype() + end;
        if whole.len() <= WIDTH {
            return whole;
        }
        let head = format!("{} {}(", self.result, self.name);
        let parameter = |(index, it): (usize, &CppParameter)| {
            let sign = if index + 1 == self.parameters.len() { ")" } else { "," };
            format!("{} {}{sign}", it.ty, it.name)
        };
        let parameters: Vec<String> = self.parameters.iter().enumerate().map(parameter).collect();
        let longest = parameters.iter().map(String::len).max().unwrap_or_default() + end.len();
        // Below the first of them, where there is room; otherwise on lines of their own.
        let (indent, mut out) = match head.len() + longest <= WIDTH {
            true => (head.len(), head),
            false => (4, head + "\n    "),
        };
        let mut column = out.rsplit('\n').next().unwrap_or_default().len();
        for (index, parameter) in parameters.iter().enumerate() {
            let end = if index + 1 == parameters.len() { end.len() } else { 0 };
            let is_first = column == indent;
            if !is_first && column + 1 + parameter.len() + end > WIDTH {
                out += &format!("\n{:indent$}", "");
                column = indent;
            } else if !is_first {
                out.push(' ');
                column += 1;
            }
            out += parameter;
            column += parameter.len();
        }
        out + end
    }
}

fn types_header(headers: &Headers, package: &str) -> String {
    let mut out = format!(
        "// Generated by `mauve generate` from library {package}: change the model, not this file.\n//\n\
         // The types of its codels and components.\n\n#pragma once\n"
    );
    // Those of the standard library have neither a folder nor an ending.
    let (own, standard): (Vec<&String>, Vec<&String>) =
        headers.paths.iter().partition(|path| path.contains(['/', '.']));
    for block in [standard, own] {
        if !block.is_empty() {
            out.push('\n');
        }
        block.iter().for_each(|path| out += &format!("#include <{path}>\n"));
    }
    out
}

fn codels_header<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    codels: &[Signature<'db>],
    package: &str,
) -> String {
    let mut out = format!(
        "// Generated by `mauve generate` from library {package}: change the model, not this file.\n//\n\
         // Its codels. What they do is written in src/codels, by hand.\n\n#pragma once\n\n\
         #include <{package}/{package}-types.hpp>\n\nnamespace {package} {{\n\n"
    );
    for signature in codels {
        let words = words_of(db, signature.codel);
        words.iter().for_each(|line| out += &line_comment("///", line));
        if !words.is_empty() {
            out += "///\n";
        }
        let origin = origin(db, project.workspace(db), &Place::name_of(signature.codel));
        out += &format!("/// `{}`, {origin}\n", signature.codel.qualified(db));
        out += &format!("{}\n\n", signature.lines(";"));
    }
    out + &format!("}}  // namespace {package}\n")
}

fn stub<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    signature: &Signature<'db>,
    package: &str,
) -> String {
    let codel = signature.codel;
    let file = origin_file(db, project.workspace(db), &Place::name_of(codel));
    let mut out = format!(
        "// This file is yours: `mauve generate` wrote it once, and never overwrites it.\n//\n// Codel `{}` of {file}:\n",
        codel.qualified(db)
    );
    match words_of(db, codel).as_slice() {
        [] => out += "// the model does not say what it is for.\n",
        words => words.iter().for_each(|line| out += &line_comment("//", line)),
    }
    out += &format!(
        "\n#include <{package}/{package}-codels.hpp>\n\nnamespace {package} {{\n\n{}\n",
        signature.lines(" {")
    );
    out += "  // TODO: write this codel. Until then it does nothing.\n";
    for parameter in &signature.parameters {
        match parameter.direction {
            Direction::Out => out += &format!("  {} = {{}};\n", parameter.name),
            Direction::In | Direction::InOut => out += &format!("  static_cast<void>({});\n", parameter.name),
        }
    }
    if signature.result != "void" {
        out += "  return {};\n";
    }
    out + &format!("}}\n\n}}  // namespace {package}\n")
}

fn line_comment(mark: &str, line: &str) -> String {
    if line.is_empty() { format!("{mark}\n") } else { format!("{mark} {line}\n") }
}
