//! The C++ side of codels: the types of a library, the prototypes of its codels, and stubs for the user to write.
//!
//! ```text
//! include/motion/motion-types.hpp    the headers of all types that the library names
//! include/motion/motion-codels.hpp   double clearance(const ::sensor_msgs::LaserScan& scan, double width);
//! src/codels/clearance.cpp           the user's: a stub that compiles, until there is more
//! ```

use mauve_hir::item_tree::Direction;
use mauve_hir::{Decl, Location, Type, codel, external_types};

use crate::cpp_name::CppNames;
use crate::cpp_type::{Headers, cpp_type, included, parameter_type};
use crate::generated_file::{FileOwner, GeneratedFile, generated_from};
use crate::library::{Model, types_of_codel, types_of_component};
use crate::origin::{WIDTH, origin, origin_file, words_of, wrapped};
use crate::template::{filled, lines};

pub(crate) fn codel_files(model: Model<'_, '_>) -> Vec<GeneratedFile> {
    let library = model.library;
    let package = &library.package;
    let mut files = Vec::new();
    if !library.codels.is_empty() || !library.components.is_empty() {
        let path = format!("include/{package}/{package}-types.hpp");
        let text = types_header(&headers_of(model), package);
        files.push(GeneratedFile::generated(path, text));
    }
    let signatures = signatures(model);
    if !signatures.is_empty() {
        let path = format!("include/{package}/{package}-codels.hpp");
        let text = codels_header(model, &signatures);
        files.push(GeneratedFile::generated(path, text));
    }
    for signature in &signatures {
        let path = codel_path(&signature.name);
        let text = stub(model, signature);
        files.push(GeneratedFile { path, text, owner: FileOwner::User { prototype: signature.prototype() } });
    }
    files
}

/// Returns the headers of all types that the codels and components of a library use.
pub(crate) fn headers_of(model: Model<'_, '_>) -> Headers {
    let Model { db, project, library, .. } = model;
    let mut headers = Headers::default();
    let codels = library.codels.iter().flat_map(|(of, _)| types_of_codel(db, *of));
    let components = library.components.iter().flat_map(|(of, _)| types_of_component(db, project, *of));
    for (of, ty) in codels.chain(components) {
        headers.add(db, model.workspace(), &model.type_of(of, Some(ty)));
    }
    headers
}

/// The C++ declaration of a codel.
pub(crate) struct CodelSignature<'db> {
    codel: Decl<'db>,
    /// The name in the namespace of its library.
    name: String,
    result: String,
    pub(crate) parameters: Vec<CppParameter>,
}

pub(crate) struct CppParameter {
    pub(crate) direction: Direction,
    pub(crate) ty: String,
    pub(crate) name: String,
}

impl<'db> CodelSignature<'db> {
    pub(crate) fn of(model: Model<'_, 'db>, of: Decl<'db>, name: &str) -> Option<CodelSignature<'db>> {
        let (db, workspace) = (model.db, model.workspace());
        db.unwind_if_revision_cancelled();
        let data = codel(db, of)?;
        let mut names = CppNames::of_namespace();
        // A parameter hides a type of the same name from the parameters that follow.
        let types = model.parameters(of, &data.parameters);
        for (_, ty) in &types {
            if let Type::External(ty) = ty
                && let Some(external) = external_types(db, workspace).get(ty)
            {
                names.take_type(&external.cpp);
            }
        }
        let mut parameters = Vec::new();
        for (parameter, (direction, ty)) in data.parameters.iter().zip(types) {
            let cpp = cpp_type(db, workspace, &ty)?;
            parameters.push(CppParameter {
                direction,
                ty: parameter_type(&cpp, &ty, direction),
                name: names.declare(&parameter.name.name),
            });
        }
        let result = match &data.result {
            Some(result) => cpp_type(db, workspace, &model.type_of(of, Some(result)))?,
            None => "void".to_owned(),
        };
        Some(CodelSignature { codel: of, name: name.to_owned(), result, parameters })
    }

    /// `double clearance(const ::sensor_msgs::LaserScan& scan, double width)`
    pub(crate) fn prototype(&self) -> String {
        let parameters: Vec<String> =
            self.parameters.iter().map(|it| format!("{} {}", it.ty, it.name)).collect();
        format!("{} {}({})", self.result, self.name, parameters.join(", "))
    }

    /// Returns the prototype followed by `end`, wrapped into lines.
    fn lines(&self, end: &str) -> String {
        let one_line = self.prototype() + end;
        let Some((last, others)) = self.parameters.split_last().filter(|_| one_line.len() > WIDTH) else {
            return one_line;
        };
        let head = format!("{} {}(", self.result, self.name);
        let others = others.iter().map(|it| format!("{} {},", it.ty, it.name));
        let mut parameters: Vec<String> = others.chain([format!("{} {})", last.ty, last.name)]).collect();
        let longest = parameters.iter().map(String::len).max().unwrap_or_default() + end.len();
        parameters.last_mut().into_iter().for_each(|last| *last += end);
        // Aligned with the first parameter if they fit; otherwise one per line.
        let (indent, head) = match head.len() + longest <= WIDTH {
            true => (head.len(), head),
            false => (4, head + "\n    "),
        };
        let lines = wrapped(parameters.iter().map(String::as_str), WIDTH - indent);
        head + &lines.join(&format!("\n{:indent$}", ""))
    }
}

fn types_header(headers: &Headers, package: &str) -> String {
    let [standard, own] = included(&headers.paths);
    let values = [("generated", generated_from(package)), ("standard", standard), ("own", own)];
    filled(include_str!("../templates/types.hpp"), &values)
}

fn codels_header<'db>(model: Model<'_, 'db>, codels: &[CodelSignature<'db>]) -> String {
    let (db, package) = (model.db, &model.library.package);
    let declared = codels.iter().map(|signature| {
        let mut words = words_of(db, signature.codel);
        if !words.is_empty() {
            words.push(String::new());
        }
        let origin = origin(db, model.workspace(), &Location::name_of(signature.codel));
        words.push(format!("`{}`, {origin}", signature.codel.qualified(db)));
        let about = lines(words.iter().map(|line| line_comment("///", line)));
        format!("{about}\n{}", signature.lines(";"))
    });
    let values = [
        ("generated", generated_from(package)),
        ("lib", package.clone()),
        ("codels", declared.collect::<Vec<_>>().join("\n\n")),
    ];
    filled(include_str!("../templates/codels.hpp"), &values)
}

/// The first line of a stub. A file with another first line was written by the user.
pub(crate) const STUB: &str =
    "// This file is yours: `mauve generate` never overwrites it once you have edited it.";

/// The first line of a stub of earlier versions.
const EARLIER_STUB: &str = "// This file is yours: `mauve generate` wrote it once, and never overwrites it.";

pub(crate) fn is_stub(text: &str) -> bool {
    text.lines().next().is_some_and(|line| [STUB, EARLIER_STUB].contains(&line))
}

/// Returns whether a text is a stub that does nothing: only results that are empty, and comments. A manifest may be a stranger's,
/// and list the hash of a codel that somebody has written.
pub fn is_empty_stub(text: &str) -> bool {
    let is_empty = |line: &str| {
        let line = line.trim();
        let starts = ["//", "}  // namespace ", "static_cast<void>("].iter().any(|it| line.starts_with(it));
        starts || matches!(line, "" | "}" | "return {};") || line.ends_with(" = {};")
    };
    let text = text.replace("\r\n", "\n");
    is_stub(&text)
        && match text.rsplit_once("{\n") {
            // A block within a body is the last one, too.
            Some((head, body)) => {
                let has_no_code = |line: &str| match line.strip_suffix('{') {
                    Some(opened) => opened.starts_with("namespace "),
                    None => line.starts_with("//") || !line.contains([';', '}']),
                };
                body.lines().all(is_empty) && head.lines().all(has_no_code)
            }
            None => text.trim_end().ends_with("{ }"),
        }
}

/// Returns the signatures of the codels of a library.
fn signatures<'db>(model: Model<'_, 'db>) -> Vec<CodelSignature<'db>> {
    let codels = model.library.codels.iter();
    codels.filter_map(|(decl, name)| CodelSignature::of(model, *decl, name)).collect()
}

/// Returns a file for each codel of a library, which lets the codel return any values. The runtime of standalone programs
/// gives the values (`mauve/stub.hpp`).
pub(crate) fn run_stubs(model: Model<'_, '_>) -> Vec<GeneratedFile> {
    let file = |signature: &CodelSignature<'_>| {
        let results =
            signature.parameters.iter().map(|CppParameter { direction, name, .. }| match direction {
                Direction::In => format!("  static_cast<void>({name});"),
                Direction::Out | Direction::InOut => format!("  ::mauve::stub({name});"),
            });
        let result = signature.result.as_str();
        let returned = (result != "void").then(|| format!("  return ::mauve::stub<{result}>();"));
        let values = [
            ("codel", signature.codel.qualified(model.db)),
            ("lib", model.library.package.clone()),
            ("head", signature.lines(" {")),
            ("results", lines(results.chain(returned))),
        ];
        let text = filled(include_str!("../templates/run_codel.cpp"), &values);
        GeneratedFile::generated(codel_path(&signature.name), text)
    };
    signatures(model).iter().map(file).collect()
}

pub(crate) fn codel_path(name: &str) -> String {
    format!("src/codels/{name}.cpp")
}

fn stub<'db>(model: Model<'_, 'db>, signature: &CodelSignature<'db>) -> String {
    let db = model.db;
    db.unwind_if_revision_cancelled();
    let codel = signature.codel;
    let file = origin_file(db, model.workspace(), &Location::name_of(codel));
    let words = words_of(db, codel);
    let end = if words.is_empty() { "." } else { ":" };
    let results = signature.parameters.iter().map(|CppParameter { direction, name, .. }| match direction {
        Direction::Out => format!("  {name} = {{}};"),
        Direction::In | Direction::InOut => format!("  static_cast<void>({name});"),
    });
    let returned = (signature.result != "void").then(|| "  return {};".to_owned());
    let values = [
        ("stub", STUB.to_owned()),
        ("about", format!("Codel `{}` of {file}{end}", codel.qualified(db))),
        ("words", lines(words.iter().map(|line| line_comment("//", line)))),
        ("lib", model.library.package.clone()),
        ("head", signature.lines(" {")),
        ("results", lines(results.chain(returned))),
    ];
    filled(include_str!("../templates/codel.cpp"), &values)
}

/// Returns a text as comment lines, wrapped.
fn line_comment(mark: &str, text: &str) -> String {
    match wrapped(text.split_whitespace(), WIDTH.saturating_sub(mark.len() + 1)).as_slice() {
        [] => mark.to_owned(),
        all => lines(all.iter().map(|line| format!("{mark} {line}"))),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use expect_test::{Expect, expect};
    use mauve_hir::{Database, Workspace, projects};

    use super::*;
    use crate::packages;

    /// The files of the first package below a folder.
    fn check(fixture: &str, folder: &str, expected: Expect) {
        let db = Database::default();
        let texts = mauve_tests::fixture(fixture).into_iter().map(|(path, text)| (PathBuf::from(path), text));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let packages = packages(&db, projects(&db, workspace)[0], None).unwrap();
        let mut text = String::new();
        for file in packages[0].files.iter().filter(|file| file.path.starts_with(folder)) {
            text += &format!("---- {}\n{}", file.path, file.text);
            if let FileOwner::User { prototype } = &file.owner {
                text += &format!("---- {prototype}\n");
            }
        }
        expected.assert_eq(&text);
    }

    #[test]
    fn a_long_prototype_without_parameters_is_closed() {
        let db = Database::default();
        let name = "n".repeat(100);
        let model = [(PathBuf::from("/m.mal"), format!("library m {{ codel {name}(): int }}"))];
        let workspace = Workspace::of_texts(&db, "/".into(), model);
        let packages = packages(&db, projects(&db, workspace)[0], None).unwrap();
        let has = |text: String| packages[0].files.iter().any(|file| file.text.contains(&text));
        assert!(has(format!("int {name}();\n")) && has(format!("int {name}() {{\n")));
    }

    const MODEL: &str = "\
//- /mauve.toml
[types.Base]
cpp = \"ArRobot*\"
header = \"Aria/Aria.h\"
//- /models/motion.mal
library motion {
  use geometry_msgs

  /*
   * Bends the order towards the nearest opening.
   */
  // The robot does not come nearer to anything than this: it is a distance from its hull, and not from its middle.
  codel bend(in base: Base, in frame: string, inout order: TwistStamped, out class: double, in width: uint8): bool

  codel stop(out base: Base): void
}
";

    #[test]
    fn headers_say_what_the_model_says() {
        check(
            MODEL,
            "include/",
            expect![[r#"
                ---- include/motion/motion-types.hpp
                // Generated by `mauve generate` from library motion: change the model, not this file.
                //
                // The types of the library's codels and components.

                #pragma once

                #include <cstdint>
                #include <string>

                #include <Aria/Aria.h>
                #include <geometry_msgs/TwistStamped.h>
                ---- include/motion/motion-codels.hpp
                // Generated by `mauve generate` from library motion: change the model, not this file.
                //
                // The prototypes of the library's codels. You write their definitions in src/codels.

                #pragma once

                #include <motion/motion-types.hpp>

                namespace motion {

                /// Bends the order towards the nearest opening.
                /// The robot does not come nearer to anything than this: it is a distance from its hull, and not
                /// from its middle.
                ///
                /// `motion.bend`, models/motion.mal:8
                bool bend(ArRobot* base, const std::string& frame, ::geometry_msgs::TwistStamped& order,
                          double& class_, std::uint8_t width);

                /// `motion.stop`, models/motion.mal:10
                void stop(ArRobot*& base);

                }  // namespace motion
            "#]],
        );
    }

    #[test]
    fn stubs_give_something() {
        check(
            MODEL,
            "src/",
            expect![[r#"
                ---- src/codels/bend.cpp
                // This file is yours: `mauve generate` never overwrites it once you have edited it.
                //
                // Codel `motion.bend` of models/motion.mal:
                // Bends the order towards the nearest opening.
                // The robot does not come nearer to anything than this: it is a distance from its hull, and not
                // from its middle.

                #include <motion/motion-codels.hpp>

                namespace motion {

                bool bend(ArRobot* base, const std::string& frame, ::geometry_msgs::TwistStamped& order,
                          double& class_, std::uint8_t width) {
                  // TODO: write this codel. Until then, its results are zero or empty. It must not wait, for a device, a lock,
                  // another thread or a sleep, unless [wait] or [locks] say so: no response time counts it otherwise.
                  static_cast<void>(base);
                  static_cast<void>(frame);
                  static_cast<void>(order);
                  class_ = {};
                  static_cast<void>(width);
                  return {};
                }

                }  // namespace motion
                ---- bool bend(ArRobot* base, const std::string& frame, ::geometry_msgs::TwistStamped& order, double& class_, std::uint8_t width)
                ---- src/codels/stop.cpp
                // This file is yours: `mauve generate` never overwrites it once you have edited it.
                //
                // Codel `motion.stop` of models/motion.mal.

                #include <motion/motion-codels.hpp>

                namespace motion {

                void stop(ArRobot*& base) {
                  // TODO: write this codel. Until then, its results are zero or empty. It must not wait, for a device, a lock,
                  // another thread or a sleep, unless [wait] or [locks] say so: no response time counts it otherwise.
                  base = {};
                }

                }  // namespace motion
                ---- void stop(ArRobot*& base)
            "#]],
        );
    }

    #[test]
    fn long_prototypes_have_several_lines() {
        check(
            "library a_library_with_a_long_name { use geometry_msgs\n\
             codel a_codel_whose_name_is_about_as_long_as_a_line_with_all_that_stands_before(in first: PoseStamped, in \
             second: PoseStamped, in third: double): TwistStamped }",
            "include/a_library_with_a_long_name/a_library_with_a_long_name-codels",
            expect![[r#"
                ---- include/a_library_with_a_long_name/a_library_with_a_long_name-codels.hpp
                // Generated by `mauve generate` from library a_library_with_a_long_name: change the model, not this file.
                //
                // The prototypes of the library's codels. You write their definitions in src/codels.

                #pragma once

                #include <a_library_with_a_long_name/a_library_with_a_long_name-types.hpp>

                namespace a_library_with_a_long_name {

                /// `a_library_with_a_long_name.a_codel_whose_name_is_about_as_long_as_a_line_with_all_that_stands_before`,
                /// model.mal:2
                ::geometry_msgs::TwistStamped a_codel_whose_name_is_about_as_long_as_a_line_with_all_that_stands_before(
                    const ::geometry_msgs::PoseStamped& first, const ::geometry_msgs::PoseStamped& second,
                    double third);

                }  // namespace a_library_with_a_long_name
            "#]],
        );
    }
}
