//! Generated packages are built by their own `CMakeLists.txt`, as a user builds them: without a warning, with gcc and with
//! clang, one by one, all at once, and in a workspace of catkin.
//!
//! RTT is the stand-in `rtt-shim/`, or the one at `MAUVE_RTT_PREFIX`; messages, catkin and its tools are Debian's. `tests/run`
//! installs them; without them these tests fail, and say so.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};

use mauve_model::{Database, Workspace, projects};
use mauve_orocos::{Package, packages};
use mauve_tests::{fixture, models, scratch};

/// What every build is given: no warning is let pass, and nothing is optimised, since most of it is not run.
const FLAGS: &str = "-O0 -Wall -Wextra -Werror";

/// One after the other: each of them keeps all processors busy.
static BUILD: Mutex<()> = Mutex::new(());

/// The packages of the first project among these texts, and what they are written into.
fn generate(texts: Vec<(PathBuf, String)>, folder: &Path) -> Vec<Package> {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let project = projects(&db, workspace)[0];
    let found = packages(&db, project, None);
    let found = found
        .unwrap_or_else(|problems| panic!("{:?}", problems.iter().map(|it| &it.message).collect::<Vec<_>>()));
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

fn generate_fixture(text: &str, folder: &Path) -> Vec<Package> {
    generate(fixture(text).into_iter().map(|(path, text)| (path.into(), text)).collect(), folder)
}

/// The sample robot, with what its owner adds: where the headers of its devices are.
fn generate_robot(folder: &Path) -> Vec<Package> {
    let mut texts = Vec::new();
    let mut open = vec![models().join("p3dx")];
    while let Some(inner) = open.pop() {
        for entry in std::fs::read_dir(inner).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => open.push(path),
                false => {
                    let text = std::fs::read_to_string(&path).unwrap();
                    texts
                        .push((Path::new("/").join(path.strip_prefix(models().join("p3dx")).unwrap()), text));
                }
            }
        }
    }
    let found = generate(texts, folder);
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

/// Runs a program, which has to succeed; gives what it said.
fn run(program: &str, arguments: &[&str], folder: &Path) -> String {
    let (said, fine) = try_run(program, arguments, folder);
    assert!(fine, "{program} {}: {said}", arguments.join(" "));
    said
}

fn try_run(program: &str, arguments: &[&str], folder: &Path) -> (String, bool) {
    let output = Command::new(program)
        .args(arguments)
        .current_dir(folder)
        .env_remove("CMAKE_PREFIX_PATH")
        .env_remove("ROS_PACKAGE_PATH")
        .env_remove("OROCOS_TARGET")
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|error| panic!("{program} does not run: {error}; tests/orocos/install installs it"));
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout) + &text(&output.stderr), output.status.success())
}

/// How something is built.
struct Build<'a> {
    /// Where builds and what they install are put.
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
        let rtt = std::env::var("MAUVE_RTT_PREFIX").map_or_else(|_| here("rtt-shim"), PathBuf::from);
        let prefix = self.folder.join("prefix");
        let (c, cxx) = self.compilers;
        let all = [
            format!("-DCMAKE_INSTALL_PREFIX={}", prefix.display()),
            format!("-DCMAKE_PREFIX_PATH={};{}", prefix.display(), rtt.display()),
            format!("-DCMAKE_C_COMPILER={c}"),
            format!("-DCMAKE_CXX_COMPILER={cxx}"),
            format!("-DCMAKE_C_FLAGS={FLAGS}"),
            format!("-DCMAKE_CXX_FLAGS={FLAGS}"),
            // Debian's catkin is a module of Debian's Python.
            "-DPYTHON_EXECUTABLE=/usr/bin/python3".to_owned(),
        ];
        let source = source.display().to_string();
        let mut arguments = vec!["--no-warn-unused-cli", "-G", "Ninja", "-S", &source, "-B", name];
        arguments.extend(all.iter().map(String::as_str));
        arguments.extend(self.settings);
        let said = run("cmake", &arguments, self.folder);
        assert!(!said.contains("CMake Warning"), "{said}");
        said
    }

    fn make(&self, name: &str, target: &str) -> String {
        run("cmake", &["--build", name, "--target", target, "-j2"], self.folder)
    }

    /// The paths below the prefix.
    fn installed(&self) -> Vec<String> {
        let said = run("find", &["prefix", "!", "-type", "d", "-printf", "%P\\n"], self.folder);
        let mut paths: Vec<String> = said.lines().map(str::to_owned).collect();
        paths.sort();
        paths
    }
}

const GCC: (&str, &str) = ("gcc", "g++");

/// Messages need catkin; the packages do not.
const WITHOUT_CATKIN: &str = "-DORO_USE_CATKIN=OFF";

fn robot_builds_one_by_one(name: &str, compilers: (&str, &str)) {
    let _alone = BUILD.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder(name);
    let packages = generate_robot(&folder.join("packages"));
    let build = Build { folder: &folder, compilers, settings: &[WITHOUT_CATKIN] };
    for package in &packages {
        build.install(&folder.join("packages").join(&package.name));
    }
    assert_installed(
        &build,
        &[
            "include/motion/motion-codels.hpp",
            "include/motion/motion-types.hpp",
            "lib/libmotion-codels.so",
            "lib/orocos/gnulinux/motion/libmotion-components-gnulinux.so",
            "share/motion/package.xml",
            "share/motion/cmake/motionConfig.cmake",
            "lib/libkinematics-codels.so",
        ],
    );
}

#[test]
fn orocos_robot_builds_with_gcc() {
    robot_builds_one_by_one("gcc", GCC);
}

#[test]
fn orocos_robot_builds_with_clang() {
    robot_builds_one_by_one("clang", ("clang", "clang++"));
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
fn all_at_once(folder: &Path, packages: &[Package]) -> PathBuf {
    let all: Vec<String> =
        packages.iter().map(|package| format!("add_subdirectory({})\n", package.name)).collect();
    let text = format!("cmake_minimum_required(VERSION 3.10...3.25)\nproject(all C CXX)\n{}", all.concat());
    mauve_tests::write(folder, &[("packages/CMakeLists.txt".to_owned(), text)]);
    folder.join("packages")
}

const SMALL_INSTALLED: [&str; 4] = [
    "include/kinematics/kinematics-codels.hpp",
    "lib/libkinematics-codels.so",
    "lib/orocos/gnulinux/motion/libmotion-components-gnulinux.so",
    "share/robot/package.xml",
];

fn assert_installed(build: &Build<'_>, expected: &[&str]) {
    let installed = build.installed();
    for path in expected {
        assert!(installed.iter().any(|it| it == path), "no {path} in {installed:#?}");
    }
}

#[test]
fn orocos_packages_build_without_ros() {
    let _alone = BUILD.lock().unwrap_or_else(PoisonError::into_inner);
    for one_by_one in [true, false] {
        let folder = folder("without_ros");
        let packages = generate_fixture(SMALL, &folder.join("packages"));
        let names: Vec<&str> = packages.iter().map(|package| package.name.as_str()).collect();
        assert_eq!(names, ["kinematics", "motion", "robot"]);
        let settings = ["-DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON"];
        let build = Build { folder: &folder, compilers: GCC, settings: &settings };
        match one_by_one {
            true => names.iter().for_each(|name| drop(build.install(&folder.join("packages").join(name)))),
            false => drop(build.install(&all_at_once(&folder, &packages))),
        }
        assert_installed(&build, &SMALL_INSTALLED);
        assert_installed(&build, &["share/kinematics/cmake/kinematicsConfig.cmake"]);
    }
}

/// As `catkin_make_isolated`, `catkin_make` and CMake do it.
#[test]
fn orocos_packages_build_as_packages_of_catkin() {
    let _alone = BUILD.lock().unwrap_or_else(PoisonError::into_inner);
    for way in ["isolated", "workspace", "project"] {
        let folder = folder("catkin");
        let packages = generate_fixture(SMALL, &folder.join("packages"));
        let build = Build { folder: &folder, compilers: GCC, settings: &[] };
        let said = match way {
            "isolated" => {
                let install = |it: &Package| build.install(&folder.join("packages").join(&it.name));
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
        assert_installed(&build, &SMALL_INSTALLED);
        // What catkin says of a package is not what CMake alone would.
        let config = folder.join("prefix/share/kinematics/cmake/kinematicsConfig.cmake");
        let config = std::fs::read_to_string(config).unwrap();
        assert!(config.contains("kinematics_FOUND_CATKIN_PROJECT TRUE"), "{config}");
    }
}
