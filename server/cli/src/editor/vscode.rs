//! VS Code: runs its command line to install the package that is beside this program.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use mauve_projects::output::Output;
use mauve_pwcet::program::{command, program as program_on_path};

use super::options::InstallOptions;

/// The identifier of the extension: publisher and name.
const EXTENSION: &str = "mauve.mauve";

/// The commands of VS Code and of programs like it.
const PROGRAMS: [&str; 5] = ["code", "codium", "code-insiders", "vscodium", "code-server"];

/// The package, from the folder of the program: of an installed package, and of an archive that was unpacked.
const PACKAGES: [&str; 2] = ["../share/mauve/mauve.vsix", "mauve.vsix"];

pub(super) fn install(options: &InstallOptions) -> Result<Output, String> {
    let program = program(options)?;
    let package = match &options.vsix {
        Some(path) => path.clone(),
        None => packaged()?,
    };
    let package =
        package.canonicalize().map_err(|error| format!("cannot read `{}`: {error}", package.display()))?;
    let installed = installed(&program)?;
    let is_current = installed.as_deref() == Some(env!("CARGO_PKG_VERSION"));
    if is_current && !options.force {
        let version = env!("CARGO_PKG_VERSION");
        return Ok(Output::escaped(format!("{EXTENSION} {version} is up to date: nothing was changed\n"), 0));
    }
    let (program_name, package_name) = (program.display(), package.display());
    if options.dry_run {
        return Ok(Output::escaped(format!("would install {package_name} with {program_name}\n"), 0));
    }
    let argument = package.to_str().ok_or_else(|| format!("`{package_name}` is not UTF-8: rename it"))?;
    run(&program, &["--install-extension", argument, "--force"])?;
    Ok(Output::escaped(format!("installed {package_name} with {program_name}\n"), 0))
}

fn program(options: &InstallOptions) -> Result<PathBuf, String> {
    let found = match &options.program {
        Some(program) => return Ok(program.clone()),
        None => PROGRAMS.into_iter().find_map(program_on_path),
    };
    found.ok_or_else(|| {
        let package = options.vsix.clone().or_else(|| packaged().ok());
        let package = package.map_or("mauve.vsix".to_owned(), |path| format!("`{}`", path.display()));
        format!(
            "none of {} is on PATH: name the command of VS Code with --program, or install {package} with \
             \"Extensions: Install from VSIX…\" in VS Code",
            PROGRAMS.join(", ")
        )
    })
}

/// Returns the package beside this program. The path of the program may be a link.
fn packaged() -> Result<PathBuf, String> {
    let own =
        std::env::current_exe().map_err(|error| format!("the path of this program is unknown: {error}"))?;
    let folders = [
        own.parent().map(Path::to_owned),
        own.canonicalize().ok().and_then(|it| Some(it.parent()?.to_owned())),
    ];
    let paths = folders.iter().flatten().flat_map(|folder| PACKAGES.map(|package| folder.join(package)));
    paths.into_iter().find(|path| path.is_file()).ok_or_else(|| {
        format!(
            "there is no mauve.vsix beside `{}`: name it with --vsix FILE; `npm ci && npm run package` in \
             editors/vscode of the sources makes it",
            own.display()
        )
    })
}

/// Returns the version of the extension that is installed.
fn installed(program: &Path) -> Result<Option<String>, String> {
    let list = run(program, &["--list-extensions", "--show-versions"])?;
    let mut extensions = list.lines().filter_map(|line| line.trim().split_once('@'));
    Ok(extensions.find(|(name, _)| *name == EXTENSION).map(|(_, version)| version.to_owned()))
}

/// Runs VS Code, and returns its standard output.
fn run(program: &Path, arguments: &[&str]) -> Result<String, String> {
    let shown = program.display();
    let output = command(program).args(arguments).stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("`{shown}` cannot be started: {error}"))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    match output.status.success() {
        true => Ok(text(&output.stdout)),
        false => {
            let said = [text(&output.stderr), text(&output.stdout)].join("\n");
            Err(format!("`{shown} {}` failed: {}", arguments.join(" "), said.trim()))
        }
    }
}
