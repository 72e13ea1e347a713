//! The program of `mauve measure`: a main that calls codels alone, with inputs that were written or recorded.
//!
//! ```text
//! std::deque<double> in_0(2);
//! in_0[0] = 0.5;
//! measurement.run("motion.steer", 2, [&](std::size_t row) {
//!   double argument_0 = in_0[row % in_0.size()];
//!   measurement.prepare();
//!   ::mauve::execute_codel("motion.steer", [&] { return ::motion::steer(argument_0); });
//! });
//! ```
//!
//! `execute_codel` is what the components of a robot call, too: both executions are measured in the same way.

use mauve_hir::{Decl, ModelDb, Project};
use toml::{Table, Value};

use super::inputs::{InputProblem, inputs_of};
use super::{Programs, standalone};
use crate::codels::{CodelSignature, codel_path};
use crate::generated_file::{GeneratedFile, GeneratedPackage, STANDALONE_MARK};
use crate::library::{Model, models};
use crate::template::{filled, lines};
use crate::trace::codel_key;

/// The program, which is also its target of CMake.
pub const MEASURE: &str = "mauve-measure";

/// The statements with the inputs of a codel, and their bytes: a compiler takes seconds for so many, and hours for ten times as many.
const MOST_VALUES: usize = 10_000;
const MOST_BYTES: usize = 1 << 22;

/// Returns the folder of standalone programs of a deployment, with one that calls these codels alone; and the paths of the codels'
/// files, relative to the folder of the packages. `inputs` has a table for each codel: a list of values for each parameter, which are
/// combined row by row; one value is that of all rows.
///
/// # Errors
///
/// A codel that has not all its inputs.
pub fn measuring<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    codels: &[Decl<'db>],
    inputs: &Table,
) -> Result<(GeneratedPackage, Vec<String>), (Decl<'db>, InputProblem)> {
    let models = models(db, project, Some(deployment)).unwrap_or_default();
    let (mut functions, mut calls, mut paths) = (Vec::new(), Vec::new(), Vec::new());
    let mut libraries: Vec<&str> = Vec::new();
    for (index, &of) in codels.iter().enumerate() {
        let found = models.iter().find_map(|it| {
            let (_, name) = it.library.codels.iter().find(|(decl, _)| *decl == of)?;
            Some((*it, name))
        });
        let (model, name) = found.ok_or((of, InputProblem::NotThere))?;
        functions.push(function(model, of, name, index, inputs).map_err(|problem| (of, problem))?);
        calls.push(format!("  measure_{index}(measurement);"));
        paths.push(format!("{}/{}", model.library.package, codel_path(name)));
        libraries.push(&model.library.package);
    }
    libraries.sort_unstable();
    libraries.dedup();
    let values = [
        ("mark", STANDALONE_MARK.to_owned()),
        ("headers", headers(&libraries)),
        ("functions", functions.join("\n\n")),
        ("calls", lines(calls)),
    ];
    let text = filled(include_str!("../../templates/measure.cpp"), &values);
    let linked: String = libraries.iter().map(|it| format!(" {it}-codels")).collect();
    // The caller has reported the problems of the project.
    let package = standalone(db, project, Some(deployment), false, Programs::Whole);
    let mut package = package.map_err(|_| (deployment, InputProblem::NotThere))?;
    package.files.push(GeneratedFile::generated(format!("{MEASURE}.cpp"), text));
    add_to_build(&mut package, &format!("\nadd_program({MEASURE}{linked})\n"));
    Ok((package, paths))
}

/// Returns the lines that include the prototypes of codels.
pub(super) fn headers(libraries: &[&str]) -> String {
    lines(libraries.iter().map(|it| format!("#include <{it}/{it}-codels.hpp>")))
}

/// Appends lines to the build file.
pub(super) fn add_to_build(package: &mut GeneratedPackage, text: &str) {
    let build = package.files.iter_mut().find(|file| file.path == "CMakeLists.txt");
    build.into_iter().for_each(|file| file.text += text);
}

/// Returns the function that runs a codel.
fn function(
    model: Model<'_, '_>,
    of: Decl<'_>,
    name: &str,
    index: usize,
    inputs: &Table,
) -> Result<String, InputProblem> {
    let key = codel_key(model.db, of);
    let shapes = inputs_of(model, of)?;
    let none = Table::new();
    let given = inputs.get(&of.qualified(model.db)).and_then(Value::as_table).unwrap_or(&none);
    if let Some(other) = given.keys().find(|key| shapes.iter().flatten().all(|(name, _)| name != *key)) {
        return Err(InputProblem::Unknown(other.clone()));
    }
    let signature = CodelSignature::of(model, of, name).ok_or(InputProblem::NotThere)?;
    let (mut body, mut values_of_row, mut arguments) = (Vec::new(), Vec::new(), Vec::new());
    let mut longest = (String::new(), 1);
    for (index, (parameter, input)) in signature.parameters.iter().zip(&shapes).enumerate() {
        let ty = format!("std::decay_t<{}>", parameter.ty);
        arguments.push(format!("argument_{index}"));
        let Some((name, shape)) = input else {
            values_of_row.push(format!("  {ty} argument_{index}{{}};"));
            continue;
        };
        let values = given.get(name).and_then(Value::as_array).filter(|it| !it.is_empty());
        let values = values.ok_or_else(|| {
            let all =
                shapes.iter().flatten().map(|(name, shape)| format!("{name} = [{}]\n", shape.example()));
            let example = format!("[{:?}]\n{}", of.qualified(model.db), all.collect::<String>());
            InputProblem::Missing(name.clone(), example)
        })?;
        match values.len() {
            1 => {}
            rows if longest.1 == 1 => longest = (name.clone(), rows),
            rows if rows != longest.1 => return Err(InputProblem::Rows(longest.0, name.clone())),
            _ => {}
        }
        body.push(format!("std::deque<{ty}> in_{index}({});", values.len()));
        for (row, value) in values.iter().enumerate() {
            shape.assign(&format!("in_{index}[{row}]"), value, &format!("{name}[{row}]"), &mut body)?;
        }
        values_of_row.push(format!("  {ty} argument_{index} = in_{index}[row % in_{index}.size()];"));
    }
    if body.len() > MOST_VALUES || body.iter().map(String::len).sum::<usize>() > MOST_BYTES {
        return Err(InputProblem::TooMany(longest.1));
    }
    let callee = model.libraries.qualified(of).unwrap_or_default();
    body.push(format!("measurement.run({key}, {}, [&](std::size_t row) {{", longest.1));
    body.push("  static_cast<void>(row);".to_owned());
    body.extend(values_of_row);
    body.push("  measurement.prepare();".to_owned());
    body.push(format!(
        "  ::mauve::execute_codel({key}, [&] {{ return {callee}({}); }});\n  }});",
        arguments.join(", ")
    ));
    let body = lines(body.iter().map(|line| format!("  {line}")));
    Ok(format!("static void measure_{index}(mauve::Measurement& measurement) {{\n{body}\n}}"))
}
