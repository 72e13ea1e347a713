//! The files of a package.

use mauve_hir::{Decl, ModelDb, Project};

use crate::build::build_files;
use crate::codels::codel_files;
use crate::component::component_files;
use crate::cpp_name::task_name;
use crate::deployment::deployed;
use crate::export::export_files;
use crate::generated_file::{GeneratedFile, GeneratedPackage, MARK, STANDALONE, ends, is_name};
use crate::library::{GenerationProblem, Model, models};
use crate::standalone::{Programs, is_standalone_path, standalone};
use crate::task::task_files;
use crate::trace::trace_files;
use crate::{launch, script};

/// Returns whether a path has the form of a generated file of this package. A manifest that lists other paths is
/// invalid.
///
/// Listed files that are no longer generated are removed, so this check limits which files a forged manifest can
/// remove.
pub(crate) fn is_generated_path(package: &str, path: &str) -> bool {
    if package == STANDALONE {
        return is_standalone_path(path);
    }
    let is_header_of = |package: &str, file: &str| {
        let end = file.strip_prefix(package).and_then(|rest| rest.strip_prefix('-')?.strip_suffix(".hpp"));
        is_name(package) && end.is_some_and(is_name)
    };
    let is_class_of = |component: &str, file: &str| {
        is_name(component)
            && matches!(file.strip_prefix(component), Some("-component.hpp" | "-component.cpp"))
    };
    match *path.split('/').collect::<Vec<&str>>().as_slice() {
        ["CMakeLists.txt" | "package.xml" | IGNORED] => true,
        ["include", package, file] => is_header_of(package, file),
        // A component may have the name of one of these folders.
        [folder, file] => {
            is_class_of(folder, file)
                || match folder {
                    "src" => ends(file, &["-components.cpp"]),
                    "tracing" => ends(file, &["-tp.c", "-tp.h"]),
                    // Earlier versions wrote a second script, which an update removes.
                    "scripts" => ends(file, &[".lua", ".ops"]),
                    "launch" => ends(file, &[".launch"]),
                    "models" => ends(file, &[".psm.json", ".json"]),
                    _ => false,
                }
        }
        _ => false,
    }
}

/// Returns whether a path is that of a codel's file of this package, which belongs to the user.
pub(crate) fn is_codel_path(package: &str, path: &str) -> bool {
    let name = path.strip_prefix("src/codels/").and_then(|file| file.strip_suffix(".cpp"));
    package != STANDALONE && name.is_some_and(is_name)
}

/// The file with which colcon finds no package in a folder.
const IGNORED: &str = "COLCON_IGNORE";

/// Returns the packages that a deployment needs, or all packages of a project, in build order.
///
/// # Errors
///
/// The problems that prevent generation.
pub fn packages<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Option<Decl<'db>>,
) -> Result<Vec<GeneratedPackage>, Vec<GenerationProblem<'db>>> {
    Ok(models(db, project, deployment)?.into_iter().map(package).collect())
}

/// Returns the packages that a deployment needs, or all of a project, and the folder of the programs as a package of ROS 2, which builds
/// them.
///
/// # Errors
///
/// The problems that prevent generation.
pub fn ros2_packages<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Option<Decl<'db>>,
) -> Result<Vec<GeneratedPackage>, Vec<GenerationProblem<'db>>> {
    let mut all = packages(db, project, deployment)?;
    for package in &mut all {
        let text = format!("# {MARK} {}: the folder `standalone` builds it.\n", package.name);
        package.files.push(GeneratedFile::generated(IGNORED.to_owned(), text));
    }
    all.push(standalone(db, project, deployment, true, Programs::OfEachHost)?);
    Ok(all)
}

/// Returns the package of a library.
pub(crate) fn package(model: Model<'_, '_>) -> GeneratedPackage {
    let mut files = codel_files(model);
    files.extend(component_files(model));
    files.extend(task_files(model.library));
    files.extend(trace_files(model.library));
    files.extend(deployment_files(model));
    files.extend(export_files(model));
    // The build files come last, since they install the other files.
    let build = build_files(model, &files);
    files.extend(build);
    GeneratedPackage { name: model.library.package.clone(), files }
}

/// Returns the scripts and the launch files of a library's deployments.
fn deployment_files(model: Model<'_, '_>) -> Vec<GeneratedFile> {
    let mut files = Vec::new();
    for &decl in &model.library.deployments {
        let Some(deployed) = deployed(model, decl, None, task_name) else { continue };
        let name = &deployed.name;
        let texts = [
            (format!("scripts/{name}.lua"), script::script(&deployed)),
            (format!("launch/{name}.launch"), launch::launch_file(&deployed)),
        ];
        files.extend(texts.map(|(path, text)| GeneratedFile::generated(path, text)));
    }
    files
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use mauve_hir::{Database, Workspace, projects};

    use super::*;
    use crate::codels::is_stub;
    use crate::generated_file::{FileOwner, is_marked};

    /// The packages of the sample robot, and of random models.
    fn samples() -> Vec<GeneratedPackage> {
        let robot = mauve_tests::models().join("p3dx");
        let robot_texts = mauve_tests::texts_in(&robot);
        let random = (0..30).map(|seed| {
            let files = mauve_tests::random_model(seed).written().files;
            (PathBuf::from("/"), files.into_iter().map(|(path, text)| (PathBuf::from(path), text)).collect())
        });
        let mut all = Vec::new();
        for (folder, texts) in random.chain([(robot, robot_texts)]) {
            let db = Database::default();
            let texts: Vec<(PathBuf, String)> = texts;
            let workspace = Workspace::of_texts(&db, folder, texts);
            for &project in projects(&db, workspace) {
                all.extend(packages(&db, project, None).unwrap());
                all.push(standalone(&db, project, None, false, Programs::Whole).unwrap());
            }
        }
        all
    }

    #[test]
    fn all_that_is_generated_is_known_for_it() {
        let samples = samples();
        let files =
            samples.iter().flat_map(|package| package.files.iter().map(|file| (&*package.name, file)));
        for (package, GeneratedFile { path, text, owner }) in files {
            let is_generators = *owner == FileOwner::Generator;
            assert_eq!(
                (is_generated_path(package, path), is_codel_path(package, path)),
                (is_generators, !is_generators),
                "{path}"
            );
            assert_eq!((is_marked(text), is_stub(text)), (is_generators, !is_generators), "{path}\n{text}");
        }
        let count = |end: &str| {
            samples.iter().flat_map(|package| &package.files).filter(|file| file.path.ends_with(end)).count()
        };
        for end in [
            "package.xml",
            "CMakeLists.txt",
            "-types.hpp",
            "-codels.hpp",
            "-task.hpp",
            "-trace.hpp",
            "-lock.hpp",
            "-tp.c",
            "-tp.h",
            "-component.hpp",
            "-component.cpp",
            ".lua",
            ".launch",
            ".psm.json",
        ] {
            assert!(count(end) > 0, "{end}");
        }
    }

    #[test]
    fn other_paths_are_nobodys_but_the_users() {
        for path in [
            "include/p/p-types.hpp",
            "src/p-components.cpp",
            "src/src-component.hpp",
            "models/C.psm.json",
            "scripts/scripts-component.cpp",
            "scripts/a.lua",
            // A script that earlier versions generated: it is removed.
            "scripts/a.ops",
        ] {
            assert!(is_generated_path("p", path) && !is_generated_path(STANDALONE, path), "{path}");
        }
        for path in [
            "",
            "main.cpp",
            "src/main.cpp",
            "src/-components.cpp",
            "src/p-components.hpp",
            "src/codels/f.cpp",
            "SRC/codels/f.cpp",
            "cmakelists.txt",
            "package.xml/a",
            "user.cmake",
            "include/p/q-types.hpp",
            "include/p/p-a.b.hpp",
            "include/p-types.hpp",
            "C/D-component.hpp",
            "C/C-component.h",
            "a b/a b-component.hpp",
            "models/.json",
            "models/a.b.json",
            "models/robot.mal",
            "scripts/a-b.lua",
            "launch/deep/a.launch",
            "\u{e9}/\u{e9}-component.hpp",
        ] {
            assert!(!is_generated_path("p", path) && !is_generated_path(STANDALONE, path), "{path}");
        }
        for path in [
            "p-D.cpp",
            "runtime/README.md",
            "runtime/CMakeLists.txt",
            "runtime/lib/cmake/orocos-rtt/UseOROCOS-RTT.cmake",
            "runtime/include/rtt/os/fosi.h",
            "runtime/include/mauve/robot.hpp",
            "runtime/src/robot.cpp",
            "messages/include/std_msgs/Header.h",
            "messages/std_msgs/std_msgsConfig.cmake",
        ] {
            assert!(is_generated_path(STANDALONE, path) && !is_generated_path("p", path), "{path}");
        }
        for path in [
            "main.cpp",
            "-D.cpp",
            "a-b-c-d.cpp",
            "p-D.hpp",
            "src/p-D.cpp",
            "user.cmake",
            "runtime/user.cmake",
            "runtime/main.cpp",
            "runtime/src/deep/robot.cpp",
            "runtime/src/a.b.cpp",
            "runtime/include/boost/robot.hpp",
            "runtime/include/rtt/os/deep/fosi.h",
            "runtime/include/rtt/fosi.cpp",
            "runtime/lib/cmake/orocos-rtt/.cmake",
            "messages/Header.h",
            "messages/include/Header.h",
            "messages/include/std_msgs/Header.hpp",
            "messages/include/std_msgs/deep/Header.h",
            "messages/std_msgs/tfConfig.cmake",
        ] {
            assert!(!is_generated_path(STANDALONE, path), "{path}");
        }
        for path in
            ["src/codels/f.h", "src/codels/.cpp", "src/codels/a/f.cpp", "src/f.cpp", "src/codels/f.cpp.new"]
        {
            assert!(!is_codel_path("p", path), "{path}");
        }
        assert!(is_codel_path("p", "src/codels/f.cpp") && !is_codel_path(STANDALONE, "src/codels/f.cpp"));
    }
}
