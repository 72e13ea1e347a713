//! Resolves links, and says where an output goes that the user has named.
//!
//! A project may be a stranger's, and so may its links. In a project, no output is written through a link that is the output itself,
//! or that leads out of the project. Elsewhere, links are the user's, and are followed. A project is a repository, else a folder with
//! a `mauve.toml`, else the current folder.
//!
//! ```text
//! mauve run --trace rec               rec -> /home/me      refused: name /home/me
//! mauve run --trace rec               rec -> build/rec     follows the link
//! mauve pwcet … --report page.html    page.html -> …       refused
//! mauve pwcet … --report /dev/stdout                       a device, and not a link of a project
//! ```

use std::env::current_dir;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf, absolute};

use mauve_hir::CONFIG_FILE;

use crate::disk::is_made_up;

/// The number of links that are followed, as by Linux.
const MOST_LINKS: usize = 40;

/// Returns the path with links resolved to which a file is written; the file may not exist.
///
/// # Errors
///
/// It would be written through a link of a project; or a link leads nowhere.
pub fn destination(path: &Path) -> Result<PathBuf, String> {
    let folder = path.parent().map_or_else(|| Ok(PathBuf::new()), destination_folder)?;
    let at = folder
        .join(path.file_name().ok_or_else(|| format!("`{}` is not the path of a file", path.display()))?);
    match at.is_symlink() && project_of(&folder).is_some() {
        true => Err(refusal(path, &at)),
        false => destination_folder(&at),
    }
}

/// The same for a folder: a link to a folder of the same project is followed.
pub fn destination_folder(path: &Path) -> Result<PathBuf, String> {
    let absolute = absolute(path.join(".")).map_err(|error| not_read(path, &error))?;
    follow(path, &absolute, &mut 0, &project_of)
}

/// Resolves the links of a path of the user's, whether or not a file exists there.
///
/// # Errors
///
/// A folder cannot be read, or the target of a link does not exist.
pub fn behind_links(path: &Path) -> Result<PathBuf, String> {
    let absolute = absolute(path).map_err(|error| not_read(path, &error))?;
    follow(path, &absolute, &mut 0, &|_| None)
}

/// Resolves link after link. None of a project leads out of it.
fn follow(
    shown: &Path,
    path: &Path,
    links: &mut usize,
    project_of: &dyn Fn(&Path) -> Option<PathBuf>,
) -> Result<PathBuf, String> {
    let mut at = PathBuf::new();
    for part in path.components() {
        let link = at.join(part);
        match link.read_link() {
            _ if part == Component::ParentDir => drop(at.pop()),
            // It is not a link, or is not there.
            Err(error) if matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::NotFound) => at = link,
            Err(error) => return Err(not_read(&link, &error)),
            Ok(_) if *links == MOST_LINKS || !link.exists() => return Err(leads_nowhere(&link)),
            Ok(target) => {
                *links += 1;
                let real = follow(shown, &at.join(target), links, project_of)?;
                if project_of(&at).is_some_and(|project| !real.starts_with(project)) {
                    return Err(refusal(shown, &link));
                }
                at = real;
            }
        }
    }
    Ok(at)
}

/// Says that a path cannot be read, and why.
pub fn not_read(path: &Path, error: &io::Error) -> String {
    format!("`{}` cannot be read: {error}", path.display())
}

fn refusal(path: &Path, link: &Path) -> String {
    let target = link.canonicalize().or_else(|_| link.read_link()).unwrap_or_default();
    format!(
        "`{}` would be written through `{}`, which is a link in a project, to `{}`: name that path if it is the right one, or remove the link",
        path.display(),
        link.display(),
        target.display()
    )
}

/// Says that nothing can be written through a link whose target does not exist.
pub fn leads_nowhere(link: &Path) -> String {
    format!("`{}` is a link that leads nowhere: remove it", link.display())
}

/// Returns the project around a folder.
fn project_of(folder: &Path) -> Option<PathBuf> {
    let with = |name: &str| folder.ancestors().find(|above| above.join(name).symlink_metadata().is_ok());
    let named = with(".git").or_else(|| with(CONFIG_FILE)).map(Path::to_owned);
    named.or_else(|| current_dir().ok()?.canonicalize().ok().filter(|here| folder.starts_with(here)))
}

/// Returns whether a path is one of the system's for devices, such as `/dev/stdout`, which is a link on Linux.
pub fn is_device(path: &Path) -> bool {
    absolute(path).is_ok_and(|path| is_made_up(&path))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn links_of_a_project_do_not_lead_out_of_it() {
        let top = mauve_tests::own_scratch("destination");
        for folder in ["repo/.git", "repo/inner", "archive/inner", "mine"] {
            fs::create_dir_all(top.join(folder)).unwrap();
        }
        fs::write(top.join("archive/mauve.toml"), "").unwrap();
        fs::write(top.join("mine/file"), "").unwrap();
        for project in ["repo", "archive"] {
            for (link, target) in [
                ("out", "../mine"),
                ("up", "inner/.."),
                ("around", "../mine/back"),
                ("inner/file", "../../mine/file"),
                ("inner/own", "../of"),
                ("none", "../mine/none"),
                ("loop", "loop"),
            ] {
                symlink(target, top.join(project).join(link)).unwrap();
            }
            fs::write(top.join(project).join("of"), "").unwrap();
        }
        symlink("../repo", top.join("mine/back")).unwrap();
        symlink("repo/inner", top.join("mine/../current")).unwrap();
        symlink("file", top.join("mine/latest")).unwrap();
        for project in ["repo", "archive"] {
            let of = |path: &str| destination(&top.join(project).join(path));
            for path in [
                "out/new",
                "out/../repo/new",
                "inner/file",
                "inner/own",
                "none",
                "none/new",
                "loop",
                "loop/new",
                "no/../out/new",
            ] {
                assert!(of(path).is_err(), "{project}/{path}");
            }
            assert!(of("inner/file").unwrap_err().contains("which is a link in a project, to `"));
            for (path, real) in
                [("new", "new"), ("up/inner/new", "inner/new"), ("no/new", "no/new"), ("inner/../of", "of")]
            {
                assert_eq!(of(path).unwrap(), top.join(project).join(real));
            }
            assert!(destination_folder(&top.join(project).join("out")).is_err());
            assert_eq!(destination_folder(&top.join(project).join("up")).unwrap(), top.join(project));
        }
        // A link of the project that leads out of it and back.
        assert!(destination(&top.join("archive/around/new")).is_err());
        // Links of the user.
        assert_eq!(destination(&top.join("current/new")).unwrap(), top.join("repo/inner/new"));
        assert!(destination(&top.join("current/file")).is_err());
        assert_eq!(destination(&top.join("mine/latest")).unwrap(), top.join("mine/file"));
        assert!(destination(Path::new("/")).is_err() && destination(Path::new("")).is_err());
        assert!(is_device(Path::new("/dev/stdout")) && !is_device(Path::new("/dev/shm/file")));
        fs::remove_dir_all(&top).unwrap();
    }
}
