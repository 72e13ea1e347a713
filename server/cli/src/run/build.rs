//! The folder of a program in the user's cache, and its build with CMake.
//!
//! ```text
//! ~/.cache/mauve/run/<hash>/generated/    packages with stubs, and `standalone`
//! ~/.cache/mauve/run/<hash>/build/        the build folder of CMake
//! ~/.cache/mauve/run/<hash>/build.log     the output of the last build
//! ```
//!
//! Other users can neither read nor change the folder. Only files that change are written, so only they are compiled again.

use std::env;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, IsTerminal as _, Write as _};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use mauve_orocos::{Action, GeneratedPackage, PlanStep};
use mauve_projects::cache::cache_folder;
use mauve_projects::generate::{Out, Site, read};
use mauve_projects::harmless::harmless_line;
use mauve_projects::signals::stop_on_signal;
use mauve_pwcet::program::{command, program as on_path};
use rustix::process::{Pid, Signal, kill_process_group, test_kill_process_group};
use sha2::{Digest as _, Sha256};

/// The number of lines of the log that are shown when a build fails.
const LAST_LINES: usize = 20;

/// The time between two looks at a build, and how long one may take to end.
const PAUSE: Duration = Duration::from_millis(10);
const PATIENCE: Duration = Duration::from_secs(5);

/// The variable for the number of compilers at a time.
const PARALLEL: &str = "CMAKE_BUILD_PARALLEL_LEVEL";

/// The variables that compilers, and CMake for them, read.
const COMPILERS_READ: &str = "CC CXX CFLAGS CXXFLAGS CPPFLAGS LDFLAGS CPATH C_INCLUDE_PATH CPLUS_INCLUDE_PATH LIBRARY_PATH \
                              COMPILER_PATH GCC_EXEC_PREFIX";

/// Checks that a program can be built here.
pub(crate) fn check_tools() -> Result<(), String> {
    if !cfg!(target_os = "linux") {
        return Err("`mauve run` needs Linux: its programs use the real-time scheduler of Linux".to_owned());
    }
    let has = |names: &[&str]| names.iter().any(|name| on_path(name).is_some());
    let is_set = |variable: &str| env::var_os(variable).is_some_and(|value| !value.is_empty());
    let missing = [
        ("CMake", has(&["cmake"])),
        ("a C++ compiler", is_set("CXX") || has(&["c++", "g++", "clang++"])),
        ("make", is_set("CMAKE_GENERATOR") || has(&["make", "gmake"])),
    ];
    let missing: Vec<&str> =
        missing.into_iter().filter(|(_, is_there)| !is_there).map(|(name, _)| name).collect();
    match missing.as_slice() {
        [] => Ok(()),
        missing => Err(format!(
            "`mauve run` builds a program, and does not find on PATH: {}; install the missing tools, on Debian with \
             `apt-get install cmake g++ make`",
            missing.join(", ")
        )),
    }
}

/// Returns what a program is compiled with: what the user has set for the compilers and CMake, and which compilers these are. A
/// program of other flags has other execution times, so it is another program, in a folder of its own; CMake reads them once.
fn toolchain() -> Vec<u8> {
    let is_set = |(name, _): &(OsString, OsString)| {
        let name = name.to_string_lossy();
        COMPILERS_READ.split(' ').any(|it| it == name) || (name.starts_with("CMAKE_") && name != PARALLEL)
    };
    let mut set: Vec<(OsString, OsString)> = env::vars_os().filter(is_set).collect();
    set.sort();
    let mut all = format!("{set:?}").into_bytes();
    all.extend(env::var_os("CMAKE_TOOLCHAIN_FILE").and_then(|file| fs::read(file).ok()).unwrap_or_default());
    for (variable, defaults) in [("CC", ["cc", "gcc", "clang"]), ("CXX", ["c++", "g++", "clang++"])] {
        // It may have arguments, as `ccache g++`.
        let named = env::var(variable).unwrap_or_default();
        let mut words = named.split_whitespace();
        let found = match words.next() {
            Some(name) => on_path(name),
            None => defaults.into_iter().find_map(on_path),
        };
        let Some(compiler) = found.and_then(|path| path.canonicalize().ok()) else { continue };
        all.extend(compiler.as_os_str().as_encoded_bytes());
        let version = command(compiler).args(words).arg("--version").stdin(Stdio::null()).output();
        all.extend(version.map(|it| it.stdout).unwrap_or_default());
    }
    all
}

/// The folder of a program in the cache.
pub(crate) struct Build {
    pub(crate) folder: PathBuf,
    /// The folder of the packages with the user's codels.
    codels: Option<PathBuf>,
}

impl Build {
    /// Creates the folder for a project and the packages of its codels.
    pub(crate) fn open(root: &Path, codels: Option<&Path>) -> Result<Build, String> {
        let cache =
            cache_folder().ok_or("no folder for the build: set XDG_CACHE_HOME to the path of a folder")?;
        let mut digest = Sha256::new();
        digest.update(root.as_os_str().as_encoded_bytes());
        digest.update([0]);
        digest.update(codels.unwrap_or(Path::new("")).as_os_str().as_encoded_bytes());
        digest.update([0]);
        digest.update(toolchain());
        let hash: String = digest.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        let runs = cache.join("run");
        let folder = runs.join(hash);
        for folder in [&cache, &runs, &folder] {
            make_private(folder)
                .map_err(|error| format!("cannot build in `{}`: {error}", folder.display()))?;
        }
        Ok(Build { folder, codels: codels.map(Path::to_owned) })
    }

    /// Writes the packages, builds the program, and returns its path.
    pub(crate) fn build(
        &self,
        packages: &[GeneratedPackage],
        program: &str,
        deployment: &str,
    ) -> Result<PathBuf, String> {
        let out = Out::named(&self.folder.join("generated"))?;
        // The lock keeps other runs from building there.
        let site = Site::open(&out)?;
        site.write(&steps(&out, packages)?)?;
        let (source, build) = (out.real.join("standalone"), self.folder.join("build"));
        let packages = self.codels.as_ref().unwrap_or(&out.real);
        let log = self.folder.join("build.log");
        let mut setting = OsStr::new("-DMAUVE_PACKAGES=").to_owned();
        setting.push(packages);
        let cmake = on_path("cmake").ok_or("CMake is not on PATH")?;
        let mut configure = command(&cmake);
        configure.arg("-S").arg(source).arg("-B").arg(&build).arg(setting);
        let mut make = command(&cmake);
        make.arg("--build").arg(&build).args(["--target", program]);
        if env::var_os(PARALLEL).is_none() {
            let count = std::thread::available_parallelism().map_or(1, usize::from);
            make.args(["--parallel", &count.to_string()]);
        }
        let stop = Arc::new(AtomicBool::new(false));
        stop_on_signal(stop.clone())?;
        show_progress(&format!("building {deployment}"));
        let built = File::create(&log).and_then(|file| {
            Ok(succeeds(&mut configure, &file, &stop)? && succeeds(&mut make, &file, &stop)?)
        });
        show_progress("");
        if stop.load(Ordering::Relaxed) {
            return Err(format!(
                "the build of {deployment} was ended by a signal: nothing runs; the next run continues it"
            ));
        }
        match built {
            Ok(true) => Ok(build.join(program)),
            Ok(false) => Err(format!(
                "cannot build the program of {deployment}; the log is `{}`, and its last lines are:\n{}",
                log.display(),
                last_lines(&log)
            )),
            Err(error) => Err(format!("cannot build in `{}`: {error}", self.folder.display())),
        }
    }
}

/// Returns the steps that update the files of packages. There are no files of the user among them.
fn steps(out: &Out, packages: &[GeneratedPackage]) -> Result<Vec<PlanStep>, String> {
    let mut steps = Vec::new();
    for package in packages {
        for file in &package.files {
            let path = format!("{}/{}", package.name, file.path);
            let action = match read(out, &path)? {
                None => Action::Create(file.text.clone()),
                Some(text) if text == file.text => continue,
                Some(_) => Action::Change(file.text.clone()),
            };
            steps.push(PlanStep { path, action });
        }
    }
    Ok(steps)
}

/// Runs a command with its output in the log, and returns whether it succeeds.
fn succeeds(command: &mut Command, log: &File, stop: &AtomicBool) -> io::Result<bool> {
    let (out, err) = (log.try_clone()?, log.try_clone()?);
    Ok(status_of(command.stdout(out).stderr(err), stop)?.is_some_and(|it| it.success()))
}

/// Runs a command to its end. When this process is told to end, all processes of the command end first, and there is no status: they
/// would write into the folder of the next build, and use a CPU.
pub(crate) fn status_of(command: &mut Command, stop: &AtomicBool) -> io::Result<Option<ExitStatus>> {
    let mut child = command.process_group(0).stdin(Stdio::null()).spawn()?;
    while !stop.load(Ordering::Relaxed) {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        sleep(PAUSE);
    }
    let group = Pid::from_child(&child);
    for signal in [Signal::TERM, Signal::KILL] {
        let _ = kill_process_group(group, signal);
        let begun = Instant::now();
        // The child stays in the group until it is waited for.
        while child.try_wait()?.is_none() || test_kill_process_group(group).is_ok() {
            if begun.elapsed() > PATIENCE {
                break;
            }
            sleep(PAUSE);
        }
    }
    Ok(None)
}

fn last_lines(log: &Path) -> String {
    let text = fs::read(log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let lines: Vec<&str> = text.lines().collect();
    let first = lines.len().saturating_sub(LAST_LINES);
    lines.get(first..).unwrap_or_default().join("\n")
}

/// Shows the present step on a terminal, in place of the step before.
fn show_progress(doing: &str) {
    let mut err = io::stderr();
    if err.is_terminal() {
        let text =
            if doing.is_empty() { String::new() } else { format!("mauve: {}…", harmless_line(doing)) };
        let _ = write!(err, "\r\x1b[K{text}").and_then(|()| err.flush());
    }
}

/// Creates a folder that only the user can read and write. An existing one must be the user's.
fn make_private(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, PermissionsExt as _};
    fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    let data = fs::symlink_metadata(folder)?;
    if !data.is_dir() || data.uid() != rustix::process::geteuid().as_raw() {
        let why =
            "it is a link, or belongs to another user; set XDG_CACHE_HOME to the path of another folder";
        return Err(io::Error::other(why));
    }
    match data.mode() & 0o077 {
        0 => Ok(()),
        _ => fs::set_permissions(folder, fs::Permissions::from_mode(0o700)),
    }
}
