//! Programs of deployments that need neither Orocos nor ROS: the folder `standalone`, next to the packages.
//!
//! ```text
//! CMakeLists.txt        builds the runtime, the packages, and the programs
//! robot-Bench.cpp       the main of a deployment                              program.rs
//! robot-Bench-eyes.cpp  the same of one of several hosts, instead
//! runtime/              what the components use of RTT, for Linux             runtime.rs
//! mauve-measure.cpp     the main of `mauve measure`, in its build alone         measure.rs
//! messages/             the messages of ROS, for machines without its headers messages.rs
//! ```
//!
//! The packages are the same with and without this folder: one component code, two runtimes.

mod cpu_set;
mod inputs;
mod measure;
mod messages;
mod program;
mod recorded_inputs;
mod ros2_package;
mod topics;

use mauve_hir::{Decl, ModelDb, Project, Topic, ros2_of};

use crate::codels::headers_of;
use crate::cpp_name::host_name;
use crate::deployment::{RunnableDeployment, deployed};
use crate::generated_file::{GeneratedFile, GeneratedPackage, STANDALONE, STANDALONE_MARK, ends, is_name};
use crate::library::{GenerationProblem, Model, models};
use crate::runtime::{is_runtime_path, runtime_files};
use crate::template::{filled, lines};
use messages::MessageHeaders;

pub use inputs::{InputProblem, Shape};
pub use measure::{MEASURE, measuring};
pub use recorded_inputs::record_inputs;

/// Which programs a folder has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Programs {
    /// One of each deployment.
    Whole,
    /// That of a host, by its index in [`mauve_hir::Ros2::hosts`].
    OfHost(usize),
    /// Those of all hosts of each deployment, in a package of ROS 2.
    OfEachHost,
}

/// Returns the folder of standalone programs: those of a deployment, or of all deployments of a project; with the topics of ROS 2,
/// if `has_topics`. It is a package in the sense of [`crate::plan()`].
///
/// # Errors
///
/// The problems that prevent generation.
pub fn standalone<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Option<Decl<'db>>,
    has_topics: bool,
    of: Programs,
) -> Result<GeneratedPackage, Vec<GenerationProblem<'db>>> {
    let models = models(db, project, deployment)?;
    let mut messages = MessageHeaders::new(db, project.workspace(db), has_topics);
    models.iter().for_each(|&model| messages.add(headers_of(model).messages));
    let mut programs = Vec::new();
    let mut files = Vec::new();
    let mut started = Vec::new();
    for &model in &models {
        for &decl in &model.library.deployments {
            if deployment.is_some_and(|only| only != decl) {
                continue;
            }
            let hosts: Vec<Option<usize>> = match (of, ros2_of(db, project, decl).hosts.len()) {
                (Programs::OfHost(host), _) => vec![Some(host)],
                (Programs::Whole, _) | (Programs::OfEachHost, 0) => vec![None],
                (Programs::OfEachHost, hosts) => (0..hosts).map(Some).collect(),
            };
            for host in hosts {
                let Some(deployed) = deployed(model, decl, host, str::to_owned) else { continue };
                let program = program_name(&deployed);
                let topics: Vec<&Topic> =
                    ros2_of(db, project, decl).topics_of(host.unwrap_or_default()).collect();
                let has_topics = has_topics && !topics.is_empty();
                if has_topics {
                    let types = topics.into_iter().map(|it| &it.ty).filter(|it| !it.is_wrapped);
                    messages.add(types.map(|it| (it.package.clone(), it.message.clone())));
                }
                let topics_of = has_topics.then_some(host.unwrap_or_default());
                let text = program::main_file(model, decl, &deployed, topics_of);
                files.push(GeneratedFile::generated(format!("{program}.cpp"), text));
                started.push(ros2_package::Started::of(&deployed, program.clone()));
                programs.push((program, deployed.packages));
            }
        }
    }
    let package = (of == Programs::OfEachHost).then(|| ros2_package::name(&models));
    files.push(GeneratedFile::generated(
        "CMakeLists.txt".to_owned(),
        cmake_lists(&models, &messages, &programs, has_topics, package.as_deref()),
    ));
    if let (Some(name), Some(&model)) = (package, models.last()) {
        files.extend(ros2_package::files(model, &name, &started));
    }
    files.extend(messages.files());
    files.extend(runtime_files(has_topics));
    Ok(GeneratedPackage { name: STANDALONE.to_owned(), files })
}

/// Returns the name of the program of a deployment, which is also a target of CMake: no target of a package has it.
fn program_name(deployed: &RunnableDeployment) -> String {
    let is_target = matches!(deployed.name.trim_end_matches('_'), "codels" | "components");
    let program = format!("{}-{}{}", deployed.package, deployed.name, if is_target { "_" } else { "" });
    match &deployed.host {
        Some(host) => format!("{program}-{}", host_name(host)),
        None => program,
    }
}

/// Returns whether a path has the form of a file of [`standalone`].
pub(crate) fn is_standalone_path(path: &str) -> bool {
    match *path.split('/').collect::<Vec<&str>>().as_slice() {
        ["CMakeLists.txt" | "package.xml"] => true,
        ["launch", file] => {
            let parts = file.strip_suffix(".launch.py").map(|it| it.split('-').collect::<Vec<_>>());
            parts.is_some_and(|it| it.len() <= 2 && it.iter().all(|it| is_name(it)))
        }
        [file] => {
            let parts: Option<Vec<&str>> = file.strip_suffix(".cpp").map(|it| it.split('-').collect());
            parts.is_some_and(|it| (2..=3).contains(&it.len()) && it.iter().all(|it| is_name(it)))
        }
        ["messages", "include", package, file] => is_name(package) && ends(file, &[".h"]),
        ["messages", package, file] => {
            is_name(package) && file.strip_prefix(package).is_some_and(|rest| rest == "Config.cmake")
        }
        ["runtime", ref path @ ..] => is_runtime_path(path),
        _ => false,
    }
}

/// Returns the build file. `programs` are the programs with the packages of their components.
fn cmake_lists(
    models: &[Model<'_, '_>],
    messages: &MessageHeaders<'_>,
    programs: &[(String, Vec<String>)],
    has_topics: bool,
    ros2_package: Option<&str>,
) -> String {
    let has_targets =
        |model: &&Model<'_, '_>| !model.library.codels.is_empty() || !model.library.components.is_empty();
    let libraries = models.iter().map(|it| format!("{0}-codels {0}-components", it.library.package));
    let packages = models.iter().filter(has_targets).map(|model| model.library.package.as_str());
    let added = programs.iter().map(|(program, packages)| {
        let libraries: String = packages.iter().map(|package| format!(" {package}-components")).collect();
        format!("add_program({program}{libraries})")
    });
    let excluded = if ros2_package.is_some() { " EXCLUDE_FROM_ALL" } else { "" };
    let values = [
        ("mark", STANDALONE_MARK.to_owned()),
        ("first_program", programs.first().map_or_else(String::new, |(program, _)| program.clone())),
        ("ros2_headers", lines(messages.installed_headers().map(|header| format!("  {header}")))),
        ("headers", lines(messages.headers().map(|header| format!("  {header}")))),
        ("message_packages", messages.packages().join(" ")),
        ("packages", packages.collect::<Vec<_>>().join(" ")),
        ("programs", lines(added)),
        ("libraries", libraries.collect::<Vec<_>>().join(" ")),
        ("ros2_package", ros2_package.unwrap_or_default().to_owned()),
        ("runtime", if has_topics { "mauve-ros2" } else { "mauve-rtt" }.to_owned()),
        (
            "ros2",
            if has_topics { format!("add_subdirectory(runtime/ros2{excluded})") } else { String::new() },
        ),
        ("excluded", excluded.to_owned()),
        ("has_ros", if has_topics { "OFF" } else { "${MAUVE_ROS_MESSAGES}" }.to_owned()),
    ];
    filled(include_str!("../templates/standalone.cmake"), &values)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use expect_test::{Expect, expect};
    use mauve_hir::{Database, Workspace, projects};

    use super::*;

    /// A file of the standalone programs of a fixture.
    fn check(fixture: &str, path: &str, expected: Expect) {
        let texts = mauve_tests::fixture(fixture).into_iter().map(|(path, text)| (PathBuf::from(path), text));
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let standalone = standalone(&db, projects(&db, workspace)[0], None, false, Programs::Whole).unwrap();
        expected.assert_eq(&standalone.files.iter().find(|file| file.path == path).unwrap().text);
    }

    const ROBOT: &str = r#"
//- /robot.mal
library motion {
  use std_msgs
  codel steer(in gap: double): Float64
  codel map(in text: string): double
  codel wait(): void
  shell PilotShell {
    property device: string = "/dev/a"
    property gain: double = 0.5
    constant half: double = gain / 2.0
    property on: bool = false
    input port gap: double
    output port command: Float64
    require where(): double
  }
  core PilotCore(PilotShell) {
    statemachine {
      initial state Idle { run = { write(command, steer(0.0)); } transition go to Busy }
      state Busy { run = { wait(); } }
    }
  }
  component Pilot(PilotShell, PilotCore)
  shell MapShell { provide where(): double  output port gap: double }
  core MapCore(MapShell) { provide where(): double = { return map("a"); }  update = { write(gap, map("b")); } }
  component Map(MapShell, MapCore)
}
library robot {
  use motion
  architecture Robot {
    instance true_pilot: Pilot
    instance map: Map
    connection map.gap -> [4] true_pilot.gap
    operation map.where -> true_pilot.where
  }
  deployment codels {
    architecture Robot
    activity true_pilot { affinity = 1  priority = 10  period = 100  deadline = 80  offset = 5 }
    activity map { priority = background }
    property true_pilot.device = "\"/dev/\t?"
    property true_pilot.gain = 2
    property true_pilot.on = true
  }
}
//- /mauve.toml
timing = { tables = "times.toml" }
clocks = { synchronised = ["true_pilot"] }
[platform]
rt_throttling = false
[[platform.other]]
name = "network"
period = "5 ms"
time = "200 us"
priority = 50
cpus = [1]
//- /times.toml
unit = "ms"
overhead = { dispatch = 0.01 }
codel = { "motion.steer" = 3 }
program = { "Pilot/Busy.run" = 4 }
"#;

    #[test]
    fn a_thread_with_several_activities_is_a_queue() {
        let model = "library l { shell S { input port p: int  output port q: int }
            core K(S) { update = { write(q, 1); } } component C(S, K)
            architecture A { instance a: C  instance b: C  instance c: C  connection c.q -> b.p }
            deployment D { architecture A
            activity a { affinity = 1  priority = 5  period = 10  thread = both  preemptive = false }
            activity b { affinity = 1  priority = 5  trigger = p  least = 20  burst = 2  thread = both  preemptive = false }
            activity c { affinity = 1  priority = 4  period = 30 } } }";
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), [("/l.mal".into(), model.to_owned())]);
        let standalone = standalone(&db, projects(&db, workspace)[0], None, false, Programs::Whole).unwrap();
        let main = &standalone.files.iter().find(|file| file.path == "l-D.cpp").unwrap().text;
        let calls = ["robot.activity", "robot.release_by", "robot.queue_in", "robot.not_preempted"];
        let of_threads: Vec<&str> = main
            .lines()
            .map(str::trim)
            .filter(|line| calls.iter().any(|call| line.starts_with(call)))
            .collect();
        assert_eq!(
            of_threads,
            [
                "robot.activity(\"a\", 10000000, 5, 0x1, 0, 10000000, 1);",
                "robot.not_preempted(\"a\");",
                "robot.activity(\"b\", 20000000, 5, 0x1, 0, 20000000, 1);",
                "robot.release_by(\"b\", \"p\", 2, false);",
                "robot.not_preempted(\"b\");",
                "robot.queue_in(\"b\", \"a\");",
                "robot.activity(\"c\", 30000000, 4, 0x1, 0, 30000000, 1);",
            ]
        );
    }

    #[test]
    fn a_main_says_what_a_script_says() {
        check(
            ROBOT,
            "robot-codels_.cpp",
            expect![[r#"
                // Generated by `mauve generate` from library robot: change the model, not this file.
                //
                // Deployment `robot.codels` of architecture `robot.Robot` (robot.mal:34), without Orocos.

                #include <mauve/robot.hpp>

                int main(int argc, char** argv) {
                  mauve::Robot robot("robot.codels");

                  // Creates the instances; a provider of operations comes before the instances that call it.
                  robot.instance("map", "motion", "motion::Map");
                  robot.instance("true_pilot", "motion", "motion::Pilot");

                  // Sets values of the model, and values that depend on them.
                  robot.value("true_pilot", "device", "\"/dev/\t\077");
                  robot.value("true_pilot", "gain", "2.0");
                  robot.value("true_pilot", "half", "1.0");
                  robot.value("true_pilot", "on", "true");

                  // Connects outputs to inputs. An input keeps the last value, or as many values as its buffer has.
                  robot.connect("map.gap", "true_pilot.gap", 4);

                  // Connects the operations: required operation, provided operation.
                  robot.operation("true_pilot.where", "map.where");

                  // Creates the activities: period in ns, priority (0: background), CPUs (one bit for each; 0: any),
                  // offset, deadline and response time in ns.
                  robot.activity("true_pilot", 100000000, 10, 0x1, 5000000, 80000000, 4210000);
                  // A background activity without a period: it runs again 10 ms after it began, or when it has
                  // ended. Set `period` in its activity to change that.
                  robot.activity("map", 10000000, 0, 0, 0, mauve::no_bound, mauve::no_bound);

                  // Real-time work that is not in the model: period and execution time in ns, priority, CPUs.
                  robot.other_work("network", 5000000, 200000, 50, 0x1);

                  // Execution times in ns at the significance level 1e-4, for the virtual clock and for stubs.
                  robot.codel_time("motion.steer", 3000000);
                  robot.program_time("motion.Pilot", "Busy", "", "run", 4000000);
                  robot.overhead(10000);

                  // These codels have no execution time: motion.map, motion.wait.

                  return robot.run(argc, argv);
                }
            "#]],
        );
    }

    #[test]
    fn one_project_builds_all() {
        check(
            ROBOT,
            "CMakeLists.txt",
            expect![[r##"
                # Generated by `mauve generate` for standalone programs: change the model, not this file.
                #
                # Builds a program for each deployment, without Orocos:
                #
                #   cmake -S standalone -B build && cmake --build build && build/robot-codels_

                cmake_minimum_required(VERSION 3.10...3.25)
                project(standalone LANGUAGES C CXX)

                if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
                  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "The build type" FORCE)
                endif()
                if(NOT CMAKE_CXX_STANDARD)
                  set(CMAKE_CXX_STANDARD 14)
                endif()
                set(CMAKE_CXX_STANDARD_REQUIRED ON)
                set(CMAKE_CXX_EXTENSIONS OFF)

                set(MAUVE_PACKAGES "${CMAKE_CURRENT_SOURCE_DIR}/.." CACHE PATH "The folder of the packages")

                # The packages find the runtime in place of Orocos.
                set(ORO_USE_CATKIN OFF)
                set(OROCOS_TARGET gnulinux)
                add_subdirectory(runtime)
                set(OROCOS-RTT_DIR "${CMAKE_CURRENT_SOURCE_DIR}/runtime/lib/cmake/orocos-rtt")

                # The messages: the headers of ROS 1 if all of them are installed; otherwise those in the folder `messages`.
                option(MAUVE_ROS_MESSAGES "Use the messages of ROS 1 if they are installed" ON)
                set(ros_include_dirs)
                set(ros_libraries)
                set(has_ros ${MAUVE_ROS_MESSAGES})
                foreach(header
                  ros/serialization.h
                  std_msgs/Float64.h
                )
                  get_filename_component(package ${header} DIRECTORY)
                  find_path(MAUVE_INCLUDE_${package} ${header})
                  mark_as_advanced(MAUVE_INCLUDE_${package})
                  list(APPEND ros_include_dirs ${MAUVE_INCLUDE_${package}})
                  if(NOT EXISTS "${MAUVE_INCLUDE_${package}}/${header}")
                    set(has_ros OFF)
                  endif()
                endforeach()
                foreach(package std_msgs)
                  set(${package}_DIR "${CMAKE_CURRENT_SOURCE_DIR}/messages/${package}")
                endforeach()
                foreach(library roscpp_serialization rostime)
                  find_library(MAUVE_LIBRARY_${library} ${library})
                  mark_as_advanced(MAUVE_LIBRARY_${library})
                  list(APPEND ros_libraries ${MAUVE_LIBRARY_${library}})
                  if(NOT MAUVE_LIBRARY_${library})
                    set(has_ros OFF)
                  endif()
                endforeach()
                if(has_ros)
                  list(REMOVE_DUPLICATES ros_include_dirs)
                  message(STATUS "Messages of ROS: ${ros_include_dirs}")
                else()
                  # An installed package cannot refer to this folder.
                  set(ros_include_dirs "$<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/messages/include>")
                  set(ros_libraries)
                  message(STATUS "Messages without ROS: ${CMAKE_CURRENT_SOURCE_DIR}/messages")
                endif()

                # The packages; those that others call come first.
                foreach(package motion)
                  add_subdirectory("${MAUVE_PACKAGES}/${package}" "packages/${package}")
                endforeach()

                # What recordings say of the programs: with another compiler or other flags, execution times are others.
                string(TOUPPER "${CMAKE_BUILD_TYPE}" type)
                string(REGEX REPLACE "[ \t\r\n]+" " " flags "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${type}}")
                string(STRIP "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION} ${CMAKE_SYSTEM_PROCESSOR} ${flags}" built_by)
                file(GENERATE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/mauve-build.hpp" CONTENT "#define MAUVE_BUILD R\"mauve(${built_by})mauve\"\n")

                # A program loads its components by their names, so it is linked with them although it calls none of them.
                function(add_program program)
                  add_executable(${program} ${program}.cpp)
                  target_link_libraries(${program} PRIVATE mauve-rtt ${ARGN})
                  target_compile_options(${program} PRIVATE -include "${CMAKE_CURRENT_BINARY_DIR}/mauve-build.hpp")
                  set_target_properties(${program} PROPERTIES
                    LINK_FLAGS "-Wl,--no-as-needed"
                    RUNTIME_OUTPUT_DIRECTORY "$<1:${CMAKE_BINARY_DIR}>"
                  )
                endfunction()

                add_program(robot-codels_ motion-components)
            "##]],
        );
    }

    const HOSTS: &str = r#"
//- /robot.mal
library rig {
  shell EyeShell { output port frame: double }
  core EyeCore(EyeShell) { update = { write(frame, 1.0); } }
  component Eye(EyeShell, EyeCore)
  shell BrainShell { input port frame: double  input port near: double  output port out: double }
  core BrainCore(BrainShell) { update = { write(out, 1.0); } }
  component Brain(BrainShell, BrainCore)
  architecture Robot {
    instance eye: Eye  instance brain: Brain  instance arm: Brain
    connection eye.frame -> [4] brain.frame
    connection brain.out -> arm.near
  }
  deployment Base {
    architecture Robot
    activity eye { priority = 1  period = 100  affinity = 2 }
    activity brain { priority = 2  period = 100 }
    activity arm { priority = 3  period = 100 }
  }
}
//- /mauve.toml
[ros2]
discovery = "subnet"
gateway = { priority = 20, period = "1 ms", cpus = [1] }
[host.brain]
cpus = 2
activities = ["brain", "arm"]
[host.l-eye]
cpus = 2
activities = ["eye"]
[link."l-eye-brain"]
latency = "2 ms"
"#;

    #[test]
    fn each_host_has_a_program_of_its_part() {
        let texts = mauve_tests::fixture(HOSTS).into_iter().map(|(path, text)| (PathBuf::from(path), text));
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let project = projects(&db, workspace)[0];
        let deployment = mauve_hir::names_of(&db, project)
            .of_kind(&db, mauve_hir::item_tree::Kind::Deployment)
            .next()
            .unwrap();
        let folder = standalone(&db, project, Some(deployment), true, Programs::OfEachHost).unwrap();
        let launch = |it: &&GeneratedFile| it.path.starts_with("launch/");
        let launch: Vec<&str> = folder.files.iter().filter(launch).map(|it| it.path.as_str()).collect();
        assert_eq!(launch, ["launch/Base-brain.launch.py", "launch/Base-l_u2d_eye.launch.py"]);
        assert!(folder.files.iter().all(|it| is_standalone_path(&it.path)));
        let paths = ["rig-Base-brain.cpp", "rig-Base-l_u2d_eye.cpp"];
        let calls = paths.into_iter().map(|path| {
            let text = &folder.files.iter().find(|file| file.path == path).unwrap().text;
            let is_call = |line: &&str| {
                line.starts_with("  robot.") || line.contains("ros2(") || line.contains("ros2.")
            };
            text.lines().filter(is_call).map(|it| it.to_owned() + "\n").collect::<String>()
        });
        expect![[r##"
            #include <mauve/ros2.hpp>
              robot.instance("brain", "rig", "rig::Brain");
              robot.instance("arm", "rig", "rig::Brain");
              robot.connect("brain.out", "arm.near");
              robot.activity("brain", 100000000, 2, 0x3, 0, 100000000, mauve::no_bound);
              robot.activity("arm", 100000000, 3, 0x3, 0, 100000000, mauve::no_bound);
              mauve::Ros2 ros2(robot, "/", "rig_Base_brain");
              ros2.domain(0);
              ros2.discovery(mauve::Ros2::Subnet);
              ros2.gateway(1000000, 20, 0x1, 1000000, mauve::no_bound, "ros2@brain");
              ros2.subscribe<double>({"brain.frame", "brain", "frame", "/eye/frame", "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a", "std_msgs::msg::dds_::Float64_", 4, true, false, 1048576, "host l-eye"});

            #include <mauve/ros2.hpp>
              robot.instance("eye", "rig", "rig::Eye");
              robot.activity("eye", 100000000, 1, 0x2, 0, 100000000, 1);
              mauve::Ros2 ros2(robot, "/", "rig_Base_l_u2d_eye");
              ros2.domain(0);
              ros2.discovery(mauve::Ros2::Subnet);
              ros2.gateway(1000000, 20, 0x1, 1000000, mauve::no_bound, "ros2@l-eye");
              ros2.publish<double>({"eye.frame", "eye", "frame", "/eye/frame", "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a", "std_msgs::msg::dds_::Float64_", 4, true, false, 1048576, "host brain"});
        "##]]
        .assert_eq(&calls.collect::<Vec<_>>().join("\n"));
    }

    #[test]
    fn codels_alone_have_no_program() {
        check(
            "library l { codel look(): int }",
            "CMakeLists.txt",
            expect![[r##"
            # Generated by `mauve generate` for standalone programs: change the model, not this file.

            cmake_minimum_required(VERSION 3.10...3.25)
            project(standalone LANGUAGES C CXX)

            if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
              set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "The build type" FORCE)
            endif()
            if(NOT CMAKE_CXX_STANDARD)
              set(CMAKE_CXX_STANDARD 14)
            endif()
            set(CMAKE_CXX_STANDARD_REQUIRED ON)
            set(CMAKE_CXX_EXTENSIONS OFF)

            set(MAUVE_PACKAGES "${CMAKE_CURRENT_SOURCE_DIR}/.." CACHE PATH "The folder of the packages")

            # The packages find the runtime in place of Orocos.
            set(ORO_USE_CATKIN OFF)
            set(OROCOS_TARGET gnulinux)
            add_subdirectory(runtime)
            set(OROCOS-RTT_DIR "${CMAKE_CURRENT_SOURCE_DIR}/runtime/lib/cmake/orocos-rtt")

            # The packages; those that others call come first.
            foreach(package l)
              add_subdirectory("${MAUVE_PACKAGES}/${package}" "packages/${package}")
            endforeach()
        "##]],
        );
    }

    #[test]
    fn the_runtime_has_the_mark_of_the_generator() {
        let first_lines = |path: &str| {
            let found = runtime_files(false).into_iter().find(|file| file.path == path).unwrap();
            found.text.lines().take(2).collect::<Vec<_>>().join("|")
        };
        let mark = "Generated by `mauve generate` for standalone programs: do not change this file.";
        assert_eq!(first_lines("runtime/README.md"), format!("<!-- {mark} -->|"));
        assert_eq!(first_lines("runtime/CMakeLists.txt"), format!("# {mark}|"));
        assert_eq!(first_lines("runtime/include/mauve/robot.hpp"), format!("// {mark}|"));
    }
}
