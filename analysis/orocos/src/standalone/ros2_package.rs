//! The folder of the programs as a package of ROS 2, which colcon builds with CMake.
//!
//! ```text
//! package.xml                  the name, by which `ros2 run` and `ros2 launch` find it
//! launch/Base.launch.py        starts the program of a deployment
//! launch/Base-eyes.launch.py   starts that of one of several hosts, instead
//! ```
//!
//! The packages of components beside it are parts of it, and have a file `COLCON_IGNORE`.

use crate::build::about_package;
use crate::deployment::RunnableDeployment;
use crate::generated_file::{GeneratedFile, STANDALONE_MARK};
use crate::library::Model;
use crate::template::filled;

/// A program, and how its launch file is called.
pub(super) struct Started {
    program: String,
    launch: String,
}

impl Started {
    pub(super) fn of(deployed: &RunnableDeployment, program: String) -> Started {
        // A host has letters, digits and `_` in the name of its program.
        let host = deployed.host.as_ref().and_then(|_| program.rsplit('-').next());
        let host = host.map_or_else(String::new, |host| format!("-{host}"));
        Started { launch: format!("{}{host}", deployed.name), program }
    }
}

/// Returns the name of the package by the rules of ROS 2: that of the library that needs the others.
pub(super) fn name(models: &[Model<'_, '_>]) -> String {
    let library = models.last().map_or("robot", |model| model.library.package.as_str());
    let name: String =
        library.to_lowercase().split('_').filter(|it| !it.is_empty()).collect::<Vec<_>>().join("_");
    let start = if name.starts_with(|it: char| it.is_ascii_lowercase()) { "" } else { "robot_" };
    format!("{start}{name}_ros2")
}

/// Returns the files by which ROS 2 finds and starts the programs.
pub(super) fn files(model: Model<'_, '_>, name: &str, programs: &[Started]) -> Vec<GeneratedFile> {
    let (maintainer, license) = about_package(model);
    let values = [
        ("mark", STANDALONE_MARK.to_owned()),
        ("name", name.to_owned()),
        ("maintainer", maintainer),
        ("license", license),
    ];
    let package = filled(include_str!("../../templates/ros2_package.xml"), &values);
    let launch = programs.iter().map(|it| {
        let command = format!("[FindPackagePrefix('{name}'), 'lib', '{name}', '{}']", it.program);
        let values = [("mark", STANDALONE_MARK.to_owned()), ("command", command)];
        let text = filled(include_str!("../../templates/ros2.launch.py"), &values);
        GeneratedFile::generated(format!("launch/{}.launch.py", it.launch), text)
    });
    std::iter::once(GeneratedFile::generated("package.xml".to_owned(), package)).chain(launch).collect()
}
