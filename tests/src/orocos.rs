//! Builds packages of components with CMake, against the runtime for Linux or the RTT at `MAUVE_RTT_PREFIX`.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use crate::files_in;

/// With which generated code has to compile.
pub const COMPILERS: [&str; 2] = ["g++", "clang++"];

/// Variables for `mauve run` of a robot that only runs once: to optimise it would take longer than it runs, and gcc takes longer
/// than clang.
pub const RUNS_ONCE: [(&str, &str); 2] = [("CMAKE_BUILD_TYPE", "None"), ("CXX", COMPILERS[1])];

/// Returns the folder of RTT: `MAUVE_RTT_PREFIX`, otherwise the installed runtime.
pub fn rtt() -> PathBuf {
    std::env::var_os("MAUVE_RTT_PREFIX").map_or_else(runtime, PathBuf::from)
}

/// Returns whether RTT is a real one: the tests then pass with Orocos.
pub fn is_real() -> bool {
    std::env::var_os("MAUVE_RTT_PREFIX").is_some()
}

/// Returns the folder of the runtime's sources.
pub fn runtime_sources() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../analysis/orocos/runtime"))
}

/// Builds the runtime, and returns the folder that it is installed in: the same one for all tests, next to their programs.
pub fn runtime() -> PathBuf {
    static RUNTIME: OnceLock<PathBuf> = OnceLock::new();
    let install = || {
        let program = std::env::current_exe().unwrap_or_else(|error| panic!("no path of this test: {error}"));
        let target = program.ancestors().nth(3).unwrap_or_else(|| panic!("{} is no test", program.display()));
        let folder = target.join("tmp/mauve-runtime");
        let (built, installed) = (folder.join("build"), folder.join("prefix"));
        // Tests are processes: the first builds it, and the others wait.
        let lock = std::fs::create_dir_all(&folder).and_then(|()| File::create(folder.join("lock")));
        let lock = lock.and_then(|lock| lock.lock().map(|()| lock));
        let _lock = lock.unwrap_or_else(|error| panic!("cannot lock {}: {error}", folder.display()));
        let mut configuration = Command::new("cmake");
        configuration.arg("-S").arg(runtime_sources()).arg("-B").arg(&built);
        run(configuration.args([
            format!("-DCMAKE_INSTALL_PREFIX={}", installed.display()),
            format!("-DCMAKE_CXX_COMPILER={}", COMPILERS[0]),
        ]));
        run(build(&built).args(["--target", "install"]));
        installed
    };
    RUNTIME.get_or_init(install).clone()
}

/// The library of components that a package built below `folder`: `build` itself has it, or a folder for Orocos in there.
pub fn component_library(folder: &Path, name: &str) -> PathBuf {
    let file = format!("lib{name}-gnulinux.so");
    let found = files_in(folder).into_iter().find(|path| path.ends_with(&file));
    found.unwrap_or_else(|| panic!("no {file} below {}", folder.display()))
}

/// Runs a command, and returns its output.
///
/// # Errors
///
/// Both outputs of a command that fails.
pub fn try_run(command: &mut Command) -> Result<String, String> {
    let Output { status, stdout, stderr } =
        command.output().unwrap_or_else(|error| panic!("{command:?} does not run: {error}"));
    let (out, err) = (String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
    if status.success() { Ok(out.into_owned()) } else { Err(format!("{command:?}: {status}\n{out}\n{err}")) }
}

/// Runs a command, and returns its output; the test fails if the command fails.
pub fn run(command: &mut Command) -> String {
    try_run(command).unwrap_or_else(|failure| panic!("{failure}"))
}

/// The command that configures `source` in the folder `build`: plain CMake without a build type, as a user's own call would.
pub fn configure(source: &Path, build: &Path, compiler: &str, prefixes: &[&Path]) -> Command {
    let mut command = Command::new("cmake");
    let mut prefix = rtt().display().to_string();
    for more in prefixes {
        prefix += &format!(";{}", more.display());
    }
    command.arg("-S").arg(source).arg("-B").arg(build).args([
        format!("-DCMAKE_CXX_COMPILER={compiler}"),
        format!("-DCMAKE_PREFIX_PATH={prefix}"),
        "-DOROCOS_TARGET=gnulinux".to_owned(),
    ]);
    for variable in
        ["CMAKE_PREFIX_PATH", "OROCOS_TARGET", "CXXFLAGS", "CPLUS_INCLUDE_PATH", "LD_LIBRARY_PATH"]
    {
        command.env_remove(variable);
    }
    command
}

/// The command that builds what [`configure`] has configured.
pub fn build(build: &Path) -> Command {
    let mut command = Command::new("cmake");
    command.arg("--build").arg(build).arg("-j2");
    command
}
