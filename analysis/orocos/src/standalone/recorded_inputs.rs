//! What `mauve run --inputs` adds to the program of a deployment: a function for each codel, which records some inputs, and then calls
//! the codel.
//!
//! The functions have the names of the codels. A program comes before its libraries when functions are looked up, so components call
//! these functions; `next_definition` finds those of the user. Packages are built as they are.

use mauve_hir::{Decl, ModelDb, Project};

use super::inputs::{InputProblem, inputs_of};
use super::measure::{add_to_build, headers};
use crate::codels::CodelSignature;
use crate::escape::cpp_string;
use crate::generated_file::{GeneratedFile, GeneratedPackage, STANDALONE_MARK};
use crate::library::{Model, models};
use crate::template::{filled, lines};
use crate::trace::codel_key;

/// The file, in the folder of standalone programs.
const FILE: &str = "inputs/codels.cpp";

/// Adds the functions to the folder with the program of a deployment. Returns the codels whose inputs are not recorded, each with a
/// parameter whose values exist only in the robot.
pub fn record_inputs<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    program: &str,
    package: &mut GeneratedPackage,
) -> Vec<(Decl<'db>, String)> {
    let (mut libraries, mut functions, mut left) = (Vec::new(), Vec::new(), Vec::new());
    for model in models(db, project, Some(deployment)).unwrap_or_default() {
        for (of, name) in &model.library.codels {
            match function(model, *of, name) {
                Ok(function) => functions.push(function),
                Err(InputProblem::Opaque(parameter, _)) => left.push((*of, parameter)),
                Err(_) => {}
            }
        }
        if !model.library.codels.is_empty() {
            libraries.push(model.library.package.as_str());
        }
    }
    let values = [
        ("mark", STANDALONE_MARK.to_owned()),
        ("headers", headers(&libraries)),
        ("functions", functions.join("\n\n")),
    ];
    let text = filled(include_str!("../../templates/inputs.cpp"), &values);
    package.files.push(GeneratedFile::generated(FILE.to_owned(), text));
    let linked: String = libraries.iter().map(|it| format!(" {it}-codels")).collect();
    let added = format!(
        "\ntarget_sources({program} PRIVATE {FILE})\ntarget_link_libraries({program} PRIVATE{linked})\n\
         set_target_properties({program} PROPERTIES ENABLE_EXPORTS ON)\n"
    );
    add_to_build(package, &added);
    left
}

/// Returns the function for a codel.
fn function(model: Model<'_, '_>, of: Decl<'_>, name: &str) -> Result<String, InputProblem> {
    let library = &model.library.package;
    let shapes = inputs_of(model, of)?;
    let signature = CodelSignature::of(model, of, name).ok_or(InputProblem::NotThere)?;
    let parameters = signature.parameters.iter().zip(&shapes);
    let records = parameters.filter_map(|(parameter, input)| {
        let record = input.as_ref()?.1.record(&parameter.name, 0);
        Some(format!("    mauve_row.parameter(); {record}"))
    });
    let names: Vec<String> = shapes.iter().flatten().map(|(name, _)| cpp_string(name)).collect();
    let arguments: Vec<&str> = signature.parameters.iter().map(|it| it.name.as_str()).collect();
    Ok(format!(
        "namespace {library} {{\n\n{} {{\n  static ::mauve::Inputs mauve_inputs({}, {{{}}});\n  \
         if (::mauve::InputRow mauve_row{{mauve_inputs}}) {{\n{}\n  }}\n  \
         static auto* const mauve_next = ::mauve::next_definition(&::{library}::{name});\n  return mauve_next({});\n}}\n\n\
         }}  // namespace {library}",
        signature.prototype(),
        codel_key(model.db, of),
        names.join(", "),
        lines(records),
        arguments.join(", ")
    ))
}
