//! The two states that `mauve diff` compares, from its arguments.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use mauve_hir::{CONFIG_FILE, Database, Workspace, is_model, normalised};
use mauve_projects::git::Repository;
use mauve_projects::load::{canonical_path, load};
use mauve_projects::output::say;
use mauve_projects::revision::{LoadedCommit, load_commit};

/// A state of models: as they are on the disk, or in a commit.
#[derive(Debug)]
pub(super) enum ModelState {
    Disk(PathBuf),
    Commit(Commit),
}

#[derive(Debug)]
pub(super) struct Commit {
    repository: Box<Repository>,
    /// How the user calls it.
    name: String,
    commit: String,
    /// Below the top of the repository.
    path: PathBuf,
    /// Whether the name has the path.
    has_path: bool,
}

/// The workspaces of a state, the folder that paths are relative to, and what was left out, with the reasons.
type InState = (Vec<Workspace>, PathBuf, BTreeMap<PathBuf, String>);

/// An argument.
enum Argument {
    Path(PathBuf),
    Revision(String),
    /// `A..B`; with three dots, A is the common ancestor of both.
    Range {
        from: String,
        to: String,
        is_from_merge_base: bool,
    },
}

/// The prefix of a revision that is called like a file.
const GIT: &str = "git:";

const RANGE: &str = "a range such as `main..HEAD` names both states: only a PATH may follow";

/// Returns whether the repository of the current folder has this revision.
fn is_revision(text: &str, allows_outside: bool) -> bool {
    Repository::around(Path::new("."), allows_outside).is_ok_and(|it| it.commit(text).is_some())
}

impl Argument {
    fn new(text: &str, allows_outside: bool) -> Result<Argument, String> {
        let (revision, is_path) = match text.strip_prefix(GIT) {
            Some(revision) => (revision, false),
            None => (text, Path::new(text).symlink_metadata().is_ok()),
        };
        if is_path {
            // As git does, since either may be meant.
            if !text.starts_with(['.', '/']) && is_revision(text, allows_outside) {
                return Err(format!(
                    "`{text}` is a path and a revision: write `./{text}` for the path, `{GIT}{text}` for the revision"
                ));
            }
            return Ok(Argument::Path(PathBuf::from(text)));
        }
        let range = |dots: &str| {
            let (from, to) = revision.split_once(dots)?;
            let or_head = |name: &str| if name.is_empty() { "HEAD" } else { name }.to_owned();
            Some(Argument::Range {
                from: or_head(from),
                to: or_head(to),
                is_from_merge_base: dots.len() == 3,
            })
        };
        // A path of a commit may have dots: `HEAD:../robot`.
        let is_range =
            |text: &str| text.find(':').is_none_or(|colon| text.find("..").is_some_and(|it| it < colon));
        let range = if is_range(revision) { range("...").or_else(|| range("..")) } else { None };
        Ok(range.unwrap_or_else(|| Argument::Revision(revision.to_owned())))
    }
}

/// Returns the states that the arguments name, the older one first.
///
/// # Errors
///
/// An argument is neither a path nor a revision, or is both, in words for the user.
pub(super) fn states(
    first: Option<&str>,
    second: Option<&str>,
    allows_outside: bool,
) -> Result<[ModelState; 2], String> {
    let argument = |text: &str| Argument::new(text, allows_outside);
    let [first, second] = [first, second].map(|it| it.map(argument).transpose());
    let (first, second) = (first?, second?);
    let here = || PathBuf::from(".");
    if let Some(Argument::Range { from, to, is_from_merge_base }) = first {
        let path = match second {
            None => here(),
            Some(Argument::Path(path)) => path,
            // Both commits may have a path that the disk does not have.
            Some(Argument::Revision(path)) if !is_revision(&path, allows_outside) => PathBuf::from(path),
            Some(_) => return Err(RANGE.to_owned()),
        };
        let (mut old, new) =
            (Commit::new(&from, &path, allows_outside)?, Commit::new(&to, &path, allows_outside)?);
        if is_from_merge_base {
            old.commit = old.repository.merge_base([&old.commit, &new.commit])?;
            old.name = format!("the common ancestor of {} and {}", old.name, new.name);
            old.has_path = false;
        }
        return Ok([ModelState::Commit(old), ModelState::Commit(new)]);
    }
    let head = || Argument::Revision("HEAD".to_owned());
    let both = match (first, second) {
        (None, _) => [head(), Argument::Path(here())],
        (Some(path @ Argument::Path(_)), None) => [head(), path],
        (Some(first), second) => [first, second.unwrap_or_else(|| Argument::Path(here()))],
    };
    // A commit has the path of the other state.
    let path =
        both.iter().find_map(|it| if let Argument::Path(path) = it { Some(path.clone()) } else { None });
    let path = path.unwrap_or_else(here);
    let [old, new] = both.map(|it| match it {
        Argument::Path(path) => Ok(ModelState::Disk(path)),
        Argument::Revision(name) => Commit::new(&name, &path, allows_outside).map(ModelState::Commit),
        Argument::Range { .. } => Err(RANGE.to_owned()),
    });
    Ok([old?, new?])
}

impl Commit {
    /// The state of a path in a revision, which may name another path after a colon.
    fn new(name: &str, path: &Path, allows_outside: bool) -> Result<Commit, String> {
        // The disk may not have it any more.
        let absolute = std::path::absolute(path).map_err(|error| error.to_string())?;
        let above = absolute.ancestors().find(|it| it.is_dir()).unwrap_or(Path::new("/"));
        let below = absolute.strip_prefix(above).unwrap_or(Path::new(""));
        let repository = Box::new(Repository::around(&canonical_path(above), allows_outside)?);
        let own: PathBuf = repository.prefix.join(below).components().collect();
        let whole = repository.commit(name).map(|commit| (commit, own, false));
        // From the top, or from here if it begins with a dot, as for git.
        let with_path = || {
            let (revision, path) = name.split_once(':')?;
            let is_from_here = path.split('/').next().is_some_and(|it| it == "." || it == "..");
            let from = if is_from_here { repository.prefix.as_path() } else { Path::new("") };
            let path = normalised(&from.join(path)).components().collect();
            Some((repository.commit(revision)?, path, true))
        };
        let Some((commit, path, has_path)) = whole.or_else(with_path) else {
            if repository.commit("HEAD").is_none() {
                return Err(format!("`{name}`: the repository has no commit yet"));
            }
            let hint = repository.shallow_hint().unwrap_or_default();
            return Err(format!("`{name}` is neither a path nor a revision{hint}"));
        };
        Ok(Commit { repository, name: name.to_owned(), commit, path, has_path })
    }
}

impl ModelState {
    /// Returns how it is called in results.
    pub(super) fn name(&self) -> String {
        match self {
            ModelState::Disk(path) if path.as_os_str() == "." => "the working folder".to_owned(),
            ModelState::Disk(path) => path.display().to_string(),
            ModelState::Commit(Commit { name, commit, .. }) => {
                let short = commit.get(..10).unwrap_or(commit);
                if name.starts_with(short) || commit.starts_with(name) {
                    name.clone()
                } else {
                    format!("{name} ({short})")
                }
            }
        }
    }

    /// Loads its workspaces, the folder that paths are relative to, and what was left out, with the reasons.
    ///
    /// # Errors
    ///
    /// Files cannot be read, in words for the user.
    pub(super) fn load(&self, db: &mut Database, allows_outside: bool) -> Result<InState, String> {
        match self {
            ModelState::Disk(path) => {
                let workspaces = load(db, std::slice::from_ref(path), allows_outside)?;
                let real = canonical_path(path);
                let folder = if real.is_dir() { real.as_path() } else { real.parent().unwrap_or(&real) };
                Ok((workspaces, folder.to_owned(), BTreeMap::new()))
            }
            ModelState::Commit(Commit { repository, name, commit, path, has_path }) => {
                let LoadedCommit { workspaces, top, left_out } =
                    load_commit(db, repository, (name, commit), path)?;
                let said = left_out.iter().filter(|(it, _)| it.starts_with(path)).map(|(_, why)| why);
                // A link to a submodule has the same reason.
                said.collect::<BTreeSet<_>>().into_iter().for_each(|why| say(&format!("{name}: {why}")));
                if workspaces.is_empty() {
                    let place = if path.as_os_str().is_empty() {
                        String::new()
                    } else {
                        format!(" in `{}`", path.display())
                    };
                    let why = format!("there is no model and no mauve.toml{place}");
                    if *has_path {
                        return Err(format!("`{name}`: {why}"));
                    }
                    say(&format!("{name}: {why}"));
                }
                let left_out = left_out.into_iter().map(|(it, why)| (top.join(it), why)).collect();
                let path = top.join(path);
                let is_file = is_model(&path) || path.ends_with(CONFIG_FILE);
                let folder = if is_file { path.parent().unwrap_or(&top) } else { &path };
                Ok((workspaces, folder.to_owned(), left_out))
            }
        }
    }
}
