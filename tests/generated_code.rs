//! Generated packages are built by their own `CMakeLists.txt`, as a user builds them: without a warning, with gcc and with
//! clang, one by one, all at once, and in a workspace of catkin.
//!
//! RTT is the runtime for Linux, or the one at `MAUVE_RTT_PREFIX`; messages, catkin and its tools are Debian's. `tests/run`
//! installs them; without them these tests fail with a message.

use std::path::{Path, PathBuf};
use std::process::Command;

use mauve_hir::{Database, Workspace, projects};
use mauve_orocos::{GeneratedPackage, packages};
use mauve_tests::orocos::{build, configure};
use mauve_tests::{fixture, models, scratch, texts_moved};

/// The flags of all builds: warnings are errors, and there is no optimisation, unless the build has a type.
const FLAGS: &str = "-O0 -Wall -Wextra -Werror";

/// Writes the packages of the first project among these texts into a folder.
fn generate(texts: Vec<(PathBuf, String)>, folder: &Path) -> Vec<GeneratedPackage> {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let project = projects(&db, workspace)[0];
    let found = packages(&db, project, None);
    let found = found
        .unwrap_or_else(|problems| panic!("{:?}", problems.iter().map(|it| &it.kind).collect::<Vec<_>>()));
    for package in &found {
        let files: Vec<(String, String)> = package
            .files
            .iter()
            .map(|file| (format!("{}/{}", package.name, file.path), file.text.clone()))
            .collect();
        mauve_tests::write(folder, &files);
    }
    found
}

fn generate_fixture(text: &str, folder: &Path) -> Vec<GeneratedPackage> {
    generate(fixture(text).into_iter().map(|(path, text)| (path.into(), text)).collect(), folder)
}

/// The sample robot, with what its owner adds: where the headers of its devices are.
fn generate_robot(folder: &Path) -> Vec<GeneratedPackage> {
    let found = generate(texts_moved(&models().join("p3dx"), "/"), folder);
    for package in ["drivers", "localisation"] {
        let text = format!("include_directories(SYSTEM \"{}\")\n", here("orocos/include").display());
        mauve_tests::write(&folder.join(package), &[("user.cmake".to_owned(), text)]);
    }
    found
}

/// Below the folder of these tests.
fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests").join(path)
}

/// A folder of this test's own.
fn folder(name: &str) -> PathBuf {
    scratch(env!("CARGO_TARGET_TMPDIR"), &format!("generated_code/{name}"))
}

/// Runs a command, and returns all of its output.
fn run(command: &mut Command) -> String {
    let output = command.output();
    let output = output.unwrap_or_else(|error| {
        panic!("{command:?} does not run: {error}; tests/orocos/install installs what is missing")
    });
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {said}");
    said.into_owned()
}

/// How something is built.
struct Build<'a> {
    /// The folder of builds and installations.
    folder: &'a Path,
    compilers: (&'a str, &'a str),
    /// For CMake.
    settings: &'a [&'a str],
}

impl Build<'_> {
    /// Configures the package in `source`, builds it and installs it into `prefix` in the folder. Gives what CMake said.
    fn install(&self, source: &Path) -> String {
        let name = source.file_name().unwrap().to_str().unwrap();
        let said = self.configure(source, name);
        said + &self.make(name, "install")
    }

    fn configure(&self, source: &Path, name: &str) -> String {
        let prefix = self.folder.join("prefix");
        let (c, cxx) = self.compilers;
        let mut command = configure(source, &self.folder.join(name), cxx, &[&prefix]);
        command.args(["-G", "Ninja", "--no-warn-unused-cli", &format!("-DCMAKE_C_COMPILER={c}")]);
        command.args([format!("-DCMAKE_C_FLAGS={FLAGS}"), format!("-DCMAKE_CXX_FLAGS={FLAGS}")]);
        // Debian's catkin is a module of Debian's Python.
        command.arg("-DPYTHON_EXECUTABLE=/usr/bin/python3");
        command.arg(format!("-DCMAKE_INSTALL_PREFIX={}", prefix.display()));
        let said = run(command.args(self.settings).env_remove("ROS_PACKAGE_PATH"));
        assert!(!said.contains("CMake Warning"), "{said}");
        said
    }

    fn make(&self, name: &str, target: &str) -> String {
        run(build(&self.folder.join(name)).args(["--target", target]))
    }

    /// The paths below the prefix.
    fn installed(&self) -> Vec<String> {
        let mut command = Command::new("find");
        let said = run(command.arg(self.folder.join("prefix")).args(["!", "-type", "d", "-printf", "%P\\n"]));
        let mut paths: Vec<String> = said.lines().map(str::to_owned).collect();
        paths.sort();
        paths
    }
}

const GCC: (&str, &str) = ("gcc", "g++");
const CLANG: (&str, &str) = ("clang", "clang++");

/// Messages need catkin; the packages do not.
const WITHOUT_CATKIN: &str = "-DORO_USE_CATKIN=OFF";

/// Builds the robot, and looks for what is installed of it.
fn robot_builds(name: &str, compilers: (&str, &str), settings: &[&str], one_by_one: bool) {
    let folder = folder(name);
    let packages = generate_robot(&folder.join("packages"));
    // `documents::orocos_the_robot_of_the_readme_runs` builds each file by itself.
    let settings = [&[WITHOUT_CATKIN, "-DCMAKE_UNITY_BUILD=ON"], settings].concat();
    let build = Build { folder: &folder, compilers, settings: &settings };
    match one_by_one {
        true => packages.iter().for_each(|it| drop(build.install(&folder.join("packages").join(&it.name)))),
        false => drop(build.install(&all_at_once(&folder, &packages))),
    }
    assert_installed(
        &build,
        &packages,
        &[
            "include/motion/motion-codels.hpp",
            "include/motion/motion-types.hpp",
            "lib/libmotion-codels.so",
            "lib/orocos/gnulinux/motion/libmotion-components-gnulinux.so",
            "share/motion/cmake/motionConfig.cmake",
            "lib/libkinematics-codels.so",
        ],
    );
}

#[test]
fn orocos_robot_builds_with_gcc() {
    // Some warnings are found by what optimises.
    robot_builds("gcc", GCC, &["-DCMAKE_BUILD_TYPE=Release"], true);
}

#[test]
fn orocos_robot_builds_with_clang() {
    robot_builds("clang", CLANG, &[], false);
}

/// A library with codels alone, one with a component that calls them, one with a deployment alone, which needs both; and
/// nothing that only ROS has.
const SMALL: &str = "\
//- /motion.mal
library kinematics {
  // The distance to the next obstacle.
  codel clearance(in bearing: double, out gap: double): bool
}
library motion {
  use kinematics
  shell PilotShell {
    property reach: double [0.1; 1.0] = 0.5
    output port gap: double
  }
  core PilotCore(PilotShell) {
    var nearest: double = 0.0;
    update = {
      if (clearance(reach, nearest)) then { write(gap, nearest); } else {}
    }
  }
  component Pilot(PilotShell, PilotCore)
}
library robot {
  use motion
  architecture Robot { instance pilot: Pilot }
  deployment Slow { architecture Robot  activity pilot { priority = 1 period = 100 } }
}
";

/// All packages as folders of one project of CMake.
fn all_at_once(folder: &Path, packages: &[GeneratedPackage]) -> PathBuf {
    let all: Vec<String> =
        packages.iter().map(|package| format!("add_subdirectory({})\n", package.name)).collect();
    let text = format!("cmake_minimum_required(VERSION 3.10...3.25)\nproject(all C CXX)\n{}", all.concat());
    mauve_tests::write(folder, &[("packages/CMakeLists.txt".to_owned(), text)]);
    folder.join("packages")
}

const SMALL_INSTALLED: [&str; 3] = [
    "include/kinematics/kinematics-codels.hpp",
    "lib/libkinematics-codels.so",
    "lib/orocos/gnulinux/motion/libmotion-components-gnulinux.so",
];

/// These are installed, and what deployments and analyses are made of.
fn assert_installed(build: &Build<'_>, packages: &[GeneratedPackage], expected: &[&str]) {
    let installed = build.installed();
    let is_installed =
        |path: &str| assert!(installed.iter().any(|it| it == path), "no {path} in {installed:#?}");
    expected.iter().for_each(|path| is_installed(path));
    for package in packages {
        is_installed(&format!("share/{}/package.xml", package.name));
        let folders = ["launch/", "models/", "scripts/"];
        let files = package.files.iter().filter(|file| folders.iter().any(|it| file.path.starts_with(it)));
        files.for_each(|file| is_installed(&format!("share/{}/{}", package.name, file.path)));
    }
}

#[test]
fn orocos_packages_build_without_ros() {
    for one_by_one in [true, false] {
        let folder = folder("without_ros");
        let packages = generate_fixture(SMALL, &folder.join("packages"));
        let names: Vec<&str> = packages.iter().map(|package| package.name.as_str()).collect();
        assert_eq!(names, ["kinematics", "motion", "robot"]);
        // Without a target that somebody has chosen, too.
        let settings = ["-DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON", "-UOROCOS_TARGET"];
        let build = Build { folder: &folder, compilers: GCC, settings: &settings };
        match one_by_one {
            true => names.iter().for_each(|name| drop(build.install(&folder.join("packages").join(name)))),
            false => drop(build.install(&all_at_once(&folder, &packages))),
        }
        assert_installed(&build, &packages, &SMALL_INSTALLED);
        assert_installed(&build, &packages, &["share/kinematics/cmake/kinematicsConfig.cmake"]);
    }
}

/// As `catkin_make_isolated`, `catkin_make` and CMake do it.
#[test]
fn orocos_packages_build_as_packages_of_catkin() {
    for way in ["isolated", "workspace", "project"] {
        let folder = folder("catkin");
        let packages = generate_fixture(SMALL, &folder.join("packages"));
        let settings: &[&str] = if way == "project" { &["-DORO_USE_CATKIN=ON"] } else { &[] };
        let build = Build { folder: &folder, compilers: GCC, settings };
        let said = match way {
            "isolated" => {
                let install = |it: &GeneratedPackage| build.install(&folder.join("packages").join(&it.name));
                packages.iter().map(install).collect()
            }
            "workspace" => {
                let toplevel = std::fs::read_to_string("/usr/share/catkin/cmake/toplevel.cmake").unwrap();
                mauve_tests::write(&folder, &[("packages/CMakeLists.txt".to_owned(), toplevel)]);
                build.install(&folder.join("packages"))
            }
            _ => build.install(&all_at_once(&folder, &packages)),
        };
        assert!(said.contains("Using CATKIN_DEVEL_PREFIX"), "{said}");
        assert_installed(&build, &packages, &SMALL_INSTALLED);
        // The configuration of catkin differs from that of CMake alone.
        let config = folder.join("prefix/share/kinematics/cmake/kinematicsConfig.cmake");
        let config = std::fs::read_to_string(config).unwrap();
        assert!(config.contains("kinematics_FOUND_CATKIN_PROJECT TRUE"), "{config}");
    }
}

#[test]
fn orocos_tracing_is_an_option() {
    // Clang builds the robot without it.
    for (compilers, tracing) in [(GCC, "ON"), (GCC, "OFF"), (CLANG, "ON")] {
        let folder = folder("tracing");
        let packages = generate_fixture(SMALL, &folder.join("packages"));
        let option = format!("-DMAUVE_TRACING={tracing}");
        let build = Build { folder: &folder, compilers, settings: &[WITHOUT_CATKIN, &option] };
        build.install(&all_at_once(&folder, &packages));
        let library = folder.join("prefix/lib/orocos/gnulinux/motion/libmotion-components-gnulinux.so");
        let needed = run(Command::new("readelf").arg("--dynamic").arg(&library));
        assert_eq!(needed.contains("liblttng-ust.so"), tracing == "ON", "{needed}");
        let symbols = run(Command::new("nm").arg(&library));
        assert_eq!(symbols.contains("mauve_motion"), tracing == "ON", "{symbols}");
        assert_eq!(symbols.contains("lttng"), tracing == "ON", "{symbols}");
    }
}

/// Names and comments that would break out of their places, if anything could.
const HOSTILE: &str = "\
//- /mauve.toml
[types.Robot]
cpp = \"ArRobot*\"
header = \"Aria/Aria.h\"
[types.Grid]
cpp = \"std::map<int, double>\"
header = \"map\"
[types.Status]
cpp = \"RTT::FlowStatus\"
header = \"rtt/FlowStatus.hpp\"
[generate]
maintainer = 'A & B \") message(FATAL_ERROR) (\"]]> $ENV{HOME}\\ <a+b@c-d.org>'
license = '</license><evil a=\"&lt;\"/> -- ${CMAKE_COMMAND} $(id)\\'
//- /class.mal
// *\\/ #error \\
codel main(in class: int, in delete: string, out this: bool): void
// ??/
codel auto(inout main: int): double
codel ArRobot(in ArRobot: Robot, inout map: Grid, out std: Robot, in ArRobot_: Robot): Grid
// \u{202e} /* #error
codel signed(in Grid: Grid, in class_: int, in class: int, in of_no_use_at_all: int, in longer_than_the_others: string): bool
library CMAKE {
  /* #error */
  codel CMAKE(in RTT: Status, out old: Status): Status
}
library rtt { codel rtt(in rtt: string): string }
library test { codel all(): void codel install(): void codel test(): string }
library _Package { codel _f(in _X: int, in __y: size_t): uint8 }
library catkin { codel catkin(): float }
library include { codel include(in include: int64): char }
library Threads { codel find(): bool }
library system { codel random(): int }
library tm { codel time(in stat: int, in EOF: bool): int }
library select {
  use system
  shell S { property M_PI: double = 3.0 output port EAGAIN: int }
  core C(S) {
    var errno: int = 0
    statemachine {
      initial state EAGAIN { run = { write(EAGAIN, random()); } transition SIGINT if errno == 0 to TRUE }
      state TRUE { transition PATH_MAX to CLOCK_REALTIME }
      state CLOCK_REALTIME { transition BOOST_FOREACH if M_PI > 3.0 to EAGAIN }
    }
  }
  component DIR(S, C)
}
";

#[test]
fn orocos_nothing_breaks_out() {
    for compilers in [GCC, CLANG] {
        let folder = folder("hostile");
        let packages = generate_fixture(HOSTILE, &folder.join("packages"));
        let text = format!("include_directories(SYSTEM \"{}\")\n", here("orocos/include").display());
        mauve_tests::write(&folder, &[("packages/class_/user.cmake".to_owned(), text)]);
        let build = Build { folder: &folder, compilers, settings: &[] };
        build.install(&all_at_once(&folder, &packages));
    }
}

/// Returns the contents of a `package.xml` according to catkin's reader: name, maintainer, licence, dependencies; and
/// its warnings.
fn manifest(path: &Path) -> String {
    let program = "import sys; from catkin_pkg.package import parse_package; w = []; \
        p = parse_package(sys.argv[1], warnings=w); \
        print(p.package_format, p.name, p.version, '|'.join(map(str, p.maintainers)), '|'.join(p.licenses), sep='\\n'); \
        print('build', *sorted(map(str, p.build_depends))); print('exec', *sorted(map(str, p.exec_depends))); \
        print(*w, sep='\\n', end='')";
    run(Command::new("/usr/bin/python3").args(["-c", program]).arg(path))
}

#[test]
fn orocos_manifests_are_read_by_catkin() {
    let folder = folder("manifests");
    generate_robot(&folder);
    assert_eq!(
        manifest(&folder.join("exploration/package.xml")),
        "2\nexploration\n0.0.0\nuser <user@todo.todo>\nTODO\n\
         build geometry_msgs kinematics nav_msgs rtt std_msgs\n\
         exec drivers geometry_msgs kinematics localisation motion nav_msgs navigation ocl rtt rtt_geometry_msgs \
         rtt_nav_msgs rtt_ros rtt_roscomm rtt_rosnode rtt_std_msgs std_msgs\n"
    );
    let small =
        "[generate]\nros_streams = false\nmaintainer = 'Ada Lovelace <ada@example.org>'\nlicense = 'BSD'\n";
    generate_fixture(&format!("//- /mauve.toml\n{small}{SMALL}"), &folder);
    assert_eq!(
        manifest(&folder.join("robot/package.xml")),
        "2\nrobot\n0.0.0\nAda Lovelace <ada@example.org>\nBSD\nbuild\nexec motion ocl rtt_ros\n"
    );
    for package in generate_fixture(HOSTILE, &folder) {
        let said = manifest(&folder.join(&package.name).join("package.xml"));
        let lines: Vec<&str> = said.lines().collect();
        assert_eq!(lines[1], package.name);
        assert_eq!(lines[3], "A & B ') message(FATAL_ERROR) (']]> /ENV{HOME}/ <a+b@c-d.org>");
        assert_eq!(lines[4], "</license><evil a=\"&lt;\"/> -- ${CMAKE_COMMAND} $(id)\\");
        // The warning of catkin about capitals, which a library may have.
        let has_capitals = package.name.contains(|c: char| c.is_ascii_uppercase());
        assert_eq!(lines.len(), 7 + usize::from(has_capitals), "{said}");
    }
}
