//! Builds packages of components with CMake, against the substitute for RTT or the RTT at `MAUVE_RTT_PREFIX`.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::files_in;

/// With which generated code has to compile.
pub const COMPILERS: [&str; 2] = ["g++", "clang++"];

/// Returns the folder of RTT: `MAUVE_RTT_PREFIX`, otherwise the substitute.
pub fn rtt() -> PathBuf {
    std::env::var_os("MAUVE_RTT_PREFIX").map_or_else(shim, PathBuf::from)
}

/// Returns the folder of the substitute.
pub fn shim() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/rtt-shim"))
}

/// Returns whether RTT is a real one: the tests then pass with Orocos.
pub fn is_real() -> bool {
    rtt() != shim()
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
    command.arg("--build").arg(build);
    command
}
