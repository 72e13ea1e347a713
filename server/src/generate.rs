//! Generated packages on the disk: where they go, what is there already, how they are written.

mod write;

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use mauve_model::{Database, Project, Workspace, config_of, normalised};
use mauve_orocos::{MANIFEST, Package};

pub(crate) use write::{Site, target};

/// A file that is longer is nothing that the generator wrote, nor a codel.
const LONGEST: u64 = 1 << 28;

/// The folder that `[generate] out` names; nothing where it does not.
///
/// # Errors
///
/// Why nothing may be written there.
pub(crate) fn configured_out(db: &Database, workspace: Workspace) -> Result<Option<PathBuf>, String> {
    let Some((out, _)) = &config_of(db, workspace).out else { return Ok(None) };
    let folder = workspace.folder(db);
    let path = normalised(&folder.join(out));
    let home = behind_links(folder)?;
    if out.is_empty() || !path.starts_with(folder) || !behind_links(&path)?.starts_with(&home) {
        return Err(format!(
            "`[generate] out` of {} is {out:?}, which leads out of its folder: a model that came from elsewhere shall \
             not choose where files are written; if that is what you want, say `--out {}`",
            folder.join(mauve_model::CONFIG_FILE).display(),
            path.display(),
        ));
    }
    Ok(Some(path))
}

/// Where a path is behind all links, be there a file or not.
///
/// # Errors
///
/// Why nobody knows: a folder that cannot be read, a link that leads nowhere.
pub(crate) fn behind_links(path: &Path) -> Result<PathBuf, String> {
    let mut rest = Vec::new();
    for above in path.ancestors() {
        match above.canonicalize() {
            Ok(found) => return Ok(rest.iter().rev().fold(found, |path, name| path.join(name))),
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(format!("`{}` cannot be read: {error}", above.display()));
            }
            Err(_) if above.is_symlink() => return Err(leads_nowhere(above)),
            Err(_) => rest.extend(above.file_name()),
        }
    }
    Ok(path.to_owned())
}

/// The text of a file below a folder; nothing where there is none. What is not UTF-8 in it is replaced: the generator writes
/// no such file, and of the user's it only asks what they define.
///
/// # Errors
///
/// Why it cannot be read, in words for the user.
pub(crate) fn read(folder: &Path, path: &str) -> Result<Option<String>, String> {
    let file = folder.join(path);
    let failed = |error: std::io::Error| format!("`{}` cannot be read: {error}", file.display());
    let data = match std::fs::metadata(&file) {
        Ok(data) => data,
        Err(error) => {
            let mut above = file.ancestors().skip(1).take_while(|above| above.starts_with(folder));
            return match above.find(|above| above.symlink_metadata().is_ok_and(|data| !data.is_dir())) {
                Some(above) if !above.is_dir() => Err(not_a_folder(above)),
                _ if error.kind() == ErrorKind::NotFound && file.is_symlink() => Err(leads_nowhere(&file)),
                _ if error.kind() == ErrorKind::NotFound => Ok(None),
                _ => Err(failed(error)),
            };
        }
    };
    if data.is_dir() {
        return Err(not_a_file(&file));
    }
    if !data.is_file() || data.len() > LONGEST {
        return Err(format!("`{}` is no file that could have been generated", file.display()));
    }
    let bytes = std::fs::read(&file).map_err(failed)?;
    Ok(Some(String::from_utf8_lossy(&bytes).into_owned()))
}

fn not_a_folder(path: &Path) -> String {
    format!("`{}` is no folder, and one is needed there: move it away", path.display())
}

fn not_a_file(path: &Path) -> String {
    format!("`{}` is a folder, and a file is needed there: move it away", path.display())
}

fn leads_nowhere(path: &Path) -> String {
    format!("`{}` is a link that leads nowhere: remove it", path.display())
}

/// What projects that go into one folder make.
pub(crate) type Made<'db> = Vec<(Project<'db>, Vec<Package>)>;

/// A text without what a terminal would obey: a manifest may have come from anywhere.
pub(crate) fn clean(text: &str) -> String {
    text.replace(char::is_control, "\u{fffd}")
}

/// The packages of several projects that go into one folder, each once.
///
/// # Errors
///
/// Two projects have different packages of one name.
pub(crate) fn merged<'db>(db: &'db Database, made: Made<'db>) -> Result<Vec<Package>, String> {
    let mut all: Vec<(Project<'db>, Package)> = Vec::new();
    for (project, packages) in made {
        for package in packages {
            let Some((other, known)) = all.iter().find(|(_, known)| known.name == package.name) else {
                all.push((project, package));
                continue;
            };
            if let Some(path) = difference(known, &package) {
                let root = |project: Project<'db>| project.root(db).path(db).display().to_string();
                return Err(format!(
                    "package `{}` is not the same in the projects of `{}` and `{}`: they differ in {path}; one folder can \
                     have one of them, so generate each project by itself (`mauve generate ROOT.mal --out DIR`), or name \
                     one of them as `[project] root` in mauve.toml",
                    package.name,
                    root(*other),
                    root(project)
                ));
            }
        }
    }
    Ok(all.into_iter().map(|(_, package)| package).collect())
}

/// A file in which two packages differ.
fn difference<'a>(a: &'a Package, b: &'a Package) -> Option<&'a str> {
    let only = |a: &'a Package, b: &Package| a.files.iter().find(|file| !b.files.contains(file));
    only(a, b).or_else(|| only(b, a)).map(|file| file.path.as_str())
}

/// Folders below `folder` that hold a package, none of which is among `packages`: their names.
pub(crate) fn left_packages(folder: &Path, packages: &[Package]) -> Vec<String> {
    let ours: BTreeSet<&str> = packages.iter().map(|package| package.name.as_str()).collect();
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let held = entries.filter(|entry| entry.path().join(MANIFEST).is_file());
    let names = held.filter_map(|entry| entry.file_name().into_string().ok());
    let mut left: Vec<String> = names.filter(|name| !ours.contains(name.as_str())).collect();
    left.sort();
    left
}
