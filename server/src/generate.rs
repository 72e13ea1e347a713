//! Generates packages: selects them for a request, finds their folder, compares them with its files, and writes them.
//!
//! Another process may replace the output folder, or a folder in it, by a link at any time. So its path is resolved
//! once, and then opened without following links (`folder.rs`).

mod problem;
mod write;

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};

use mauve_hir::{CONFIG_FILE, Database, Decl, Project, Workspace, config_of, normalised};
use mauve_orocos::{
    GeneratedFile, MANIFEST, Package, Plan, Problem, STANDALONE, packages, plan, problems, standalone,
};

use crate::disk::{LONGEST, bytes_of, is_hidden};
use crate::folder::{Folder, Folders, Kind};
use problem::plan_message;

pub(crate) use problem::problem_message;
pub(crate) use write::{Site, target};

/// The folder that packages go to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Out {
    /// The path that is shown to the user.
    pub(crate) shown: PathBuf,
    /// The path with links resolved, which was checked and is opened.
    pub(crate) real: PathBuf,
}

impl Out {
    /// Returns the folder that the user has named, which may be anywhere.
    pub(crate) fn named(path: &Path) -> Result<Out, String> {
        Ok(Out { shown: path.to_owned(), real: behind_links(path)? })
    }
}

/// Returns the folder that `[generate] out` names, if it is set.
pub(crate) fn configured_out(db: &Database, workspace: Workspace) -> Result<Option<Out>, String> {
    let Some((out, _)) = &config_of(db, workspace).out else { return Ok(None) };
    let folder = workspace.folder(db);
    let shown = normalised(&folder.join(out));
    let outside = || {
        format!(
            "`[generate] out` of {} is {out:?}, which is outside its folder: a configuration file may not \
             choose where else files are written; to write there, use `--out {}`",
            folder.join(CONFIG_FILE).display(),
            shown.display(),
        )
    };
    if out.is_empty() || !shown.starts_with(folder) {
        return Err(outside());
    }
    let [home, real] = [behind_links(folder)?, behind_links(&shown)?];
    if !real.starts_with(&home) {
        return Err(outside());
    }
    refuse_hidden(folder, out, [(folder, &shown), (&home, &real)])?;
    Ok(Some(Out { shown, real }))
}

/// Refuses `[generate] out` if one of `ways`, each from a folder to a folder below it, leads through a hidden folder:
/// tools execute files in hidden folders, such as `.git/hooks` and `.github`.
pub(crate) fn refuse_hidden(folder: &Path, out: &str, ways: [(&Path, &Path); 2]) -> Result<(), String> {
    let is_hidden_way = |(from, to): (&Path, &Path)| to.strip_prefix(from).is_ok_and(is_hidden);
    if !ways.into_iter().any(is_hidden_way) {
        return Ok(());
    }
    Err(format!(
        "`[generate] out` of {} is {out:?}, which is in a hidden folder: name another folder, or use `--out`",
        folder.join(CONFIG_FILE).display()
    ))
}

/// Resolves the links of a path, whether or not a file exists there.
///
/// # Errors
///
/// A folder cannot be read, or the target of a link does not exist.
pub(crate) fn behind_links(path: &Path) -> Result<PathBuf, String> {
    let path = std::path::absolute(path).map_err(|error| not_read(path, &error))?;
    let mut rest = Vec::new();
    for above in path.ancestors() {
        match above.canonicalize() {
            Ok(found) => {
                let path = rest.iter().rev().fold(found, |path, part| path.join(part));
                // A `..` after a missing component leads back to a path that may be a link.
                let leads_back = rest.contains(&Component::ParentDir);
                return if leads_back { behind_links(&normalised(&path)) } else { Ok(path) };
            }
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(not_read(above, &error)),
            Err(_) if above.is_symlink() => return Err(leads_nowhere(above)),
            Err(_) => rest.extend(above.components().next_back()),
        }
    }
    Ok(path)
}

/// Returns the text of a file below a folder, if it exists. Bytes that are not UTF-8 are replaced: the generator
/// writes only UTF-8, and only searches the user's files for definitions.
pub(crate) fn read(out: &Out, path: &str) -> Result<Option<String>, String> {
    let shown = out.shown.join(path);
    let Some(file) = open(out, path)? else { return Ok(None) };
    let bytes = bytes_of(file, LONGEST).map_err(|error| not_read(&shown, &error))?;
    Ok(Some(String::from_utf8_lossy(&bytes).into_owned()))
}

/// Opens a file below a folder, if it exists; follows links that stay in the folder.
fn open(out: &Out, path: &str) -> Result<Option<File>, String> {
    let Out { mut shown, real: mut at } = out.clone();
    let mut folders = match Folder::open(&at) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        root => Folders::below(root.map_err(|error| not_read(&shown, &error))?),
    };
    let mut parts = path.split('/').peekable();
    while let Some(part) = parts.next() {
        if !is_name(part) {
            return Err(no_path(path));
        }
        at.push(part);
        shown.push(part);
        let mut kind = match folders.kind(&at) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            kind => kind.map_err(|error| not_read(&shown, &error))?,
        };
        if kind == Kind::Link {
            at = inside(out, &at, &shown)?;
            kind = folders.kind(&at).map_err(|error| not_read(&shown, &error))?;
        }
        match (parts.peek(), kind) {
            (None, Kind::File) | (Some(_), Kind::Folder) => {}
            (None, Kind::Folder) => return Err(not_a_file(&shown)),
            (None, _) => return Err(not_generated(&shown)),
            (Some(_), _) => return Err(not_a_folder(&shown)),
        }
    }
    match folders.above(&at).and_then(|(folder, name)| folder.open_read(name)) {
        // The file was removed in the meantime.
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        file => file.map(Some).map_err(|error| not_read(&shown, &error)),
    }
}

fn inside(out: &Out, link: &Path, shown: &Path) -> Result<PathBuf, String> {
    let real = link.canonicalize().map_err(|error| match error.kind() {
        ErrorKind::NotFound => leads_nowhere(shown),
        _ => not_read(shown, &error),
    })?;
    if !real.starts_with(&out.real) {
        return Err(format!(
            "`{}` is a link that leads out of `{}`, and is not read: replace it by a file",
            shown.display(),
            out.shown.display()
        ));
    }
    Ok(real)
}

/// Returns whether a text is a plain path component on every system.
fn is_name(part: &str) -> bool {
    !matches!(part, "" | "." | "..") && !part.contains(['\\', ':'])
}

fn no_path(path: &str) -> String {
    format!("{path:?} is not a path of a generated file")
}

fn not_read(path: &Path, error: &io::Error) -> String {
    format!("`{}` cannot be read: {error}", path.display())
}

fn not_generated(path: &Path) -> String {
    format!("`{}` is neither a regular file nor a folder, so it was not generated", path.display())
}

fn not_a_folder(path: &Path) -> String {
    format!("`{}` is not a folder, and a folder is needed there: move the file", path.display())
}

fn not_a_file(path: &Path) -> String {
    format!("`{}` is a folder, and a file is needed there: move the folder", path.display())
}

fn leads_nowhere(path: &Path) -> String {
    format!("`{}` is a link that leads nowhere: remove it", path.display())
}

/// A request to generate packages, from the command line or from an editor.
#[derive(Debug, Clone)]
pub(crate) struct GenerateRequest<'db> {
    /// What to generate and where to.
    pub(crate) selected: Vec<Selected<'db>>,
    /// Whether these are all packages of their folders. Then [`Generated::left_packages`] lists any others there.
    pub(crate) is_whole: bool,
    /// Whether to generate programs that need no Orocos, too.
    pub(crate) is_standalone: bool,
    /// Whether the folders will be written: they are created, and locked until [`Generated`] is dropped.
    pub(crate) is_written: bool,
}

/// A project of a request.
#[derive(Debug, Clone)]
pub(crate) struct Selected<'db> {
    pub(crate) project: Project<'db>,
    /// Selects the packages that this deployment needs; without one, all packages of the project.
    pub(crate) deployment: Option<Decl<'db>>,
    /// What must be corrected in the project before anything is generated.
    pub(crate) problems: Vec<Problem<'db>>,
    /// The folder of the packages, or why there is none, in words for the user.
    pub(crate) out: Result<Out, String>,
}

impl<'db> Selected<'db> {
    /// Selects packages of a project, to be generated into `out`.
    pub(crate) fn new(
        db: &'db Database,
        project: Project<'db>,
        deployment: Option<Decl<'db>>,
        out: Result<Out, String>,
    ) -> Selected<'db> {
        Selected { project, deployment, problems: problems(db, project), out }
    }
}

/// Why a request is refused.
pub(crate) enum Refusal<'db> {
    /// These must be corrected in the models first. Each is listed once.
    Problems(Vec<Problem<'db>>),
    /// Another reason, in words for the user.
    Other(String),
}

impl From<String> for Refusal<'_> {
    fn from(why: String) -> Self {
        Refusal::Other(why)
    }
}

/// The packages of a folder, and how its files must change.
pub(crate) struct Generated {
    pub(crate) out: Out,
    pub(crate) packages: Vec<Package>,
    pub(crate) plan: Plan,
    /// Packages in the folder that the models do not have, where all are known.
    pub(crate) left_packages: Vec<String>,
    /// Where the plan is written, if the request says that it will be.
    pub(crate) site: Option<Site>,
}

impl<'db> GenerateRequest<'db> {
    /// Returns why the request is refused, as far as that does not depend on the files in the folders.
    pub(crate) fn refusal(&self) -> Option<Refusal<'db>> {
        let mut seen: HashSet<&Problem<'db>> = HashSet::new();
        let all = self.selected.iter().flat_map(|it| &it.problems);
        let problems: Vec<Problem<'db>> = all.filter(|problem| seen.insert(problem)).cloned().collect();
        if !problems.is_empty() {
            return Some(Refusal::Problems(problems));
        }
        self.selected.iter().find_map(|it| it.out.clone().err()).map(Refusal::Other)
    }
}

/// Reads a file below a folder of packages; nothing where there is none.
pub(crate) type ReadFile<'a> = dyn Fn(&Out, &str) -> Result<Option<String>, String> + 'a;

/// Answers a request: generates its packages, and compares them with the files in their folders, as `read` returns them.
/// Writes nothing.
///
/// # Errors
///
/// The request is refused; two projects have different packages of one name; a folder or a file cannot be read or locked.
pub(crate) fn generate<'db>(
    db: &'db Database,
    request: &GenerateRequest<'db>,
    read: &ReadFile<'_>,
) -> Result<Vec<Generated>, Refusal<'db>> {
    if let Some(refusal) = request.refusal() {
        return Err(refusal);
    }
    let mut folders: Vec<(Out, Made<'db>)> = Vec::new();
    for Selected { project, deployment, out, .. } in &request.selected {
        let out = out.clone()?;
        // The project has no problems: it would have been refused.
        let mut made = packages(db, *project, *deployment).unwrap_or_default();
        if request.is_standalone && !made.is_empty() {
            made.extend(standalone(db, *project, *deployment));
        }
        match folders.iter_mut().find(|(known, _)| known.real == out.real) {
            Some((_, all)) => all.push((*project, made)),
            None => folders.push((out, vec![(*project, made)])),
        }
    }
    let merged = folders.into_iter().map(|(out, made)| Ok((out, merged(db, made)?)));
    let merged: Vec<(Out, Vec<Package>)> = merged.collect::<Result<_, String>>()?;
    let mut all = Vec::new();
    for (out, packages) in merged {
        // The lock keeps other runs from writing there.
        let site = if request.is_written { Some(Site::open(&out)?) } else { None };
        let plan = plan(&packages, &|path| read(&out, path)).map_err(|error| plan_message(&error))?;
        let left_packages = if request.is_whole { left_packages(&out, &packages) } else { Vec::new() };
        all.push(Generated { out, packages, plan, left_packages, site });
    }
    Ok(all)
}

/// The packages of each project that go to one folder.
type Made<'db> = Vec<(Project<'db>, Vec<Package>)>;

/// Merges the packages of several projects that go to one folder, each once.
fn merged<'db>(db: &'db Database, made: Made<'db>) -> Result<Vec<Package>, String> {
    let mut all: Vec<(Project<'db>, Package)> = Vec::new();
    let mut numbers: HashMap<String, usize> = HashMap::new();
    for (project, packages) in made {
        for package in packages {
            let number = numbers.get(&package.name);
            let Some((other, known)) = number.and_then(|&number| all.get(number)) else {
                numbers.insert(package.name.clone(), all.len());
                all.push((project, package));
                continue;
            };
            if let Some(path) = difference(known, &package) {
                let root = |project: Project<'db>| project.root(db).path(db).display().to_string();
                return Err(format!(
                    "package `{}` differs between the projects of `{}` and `{}`, in {path}; a folder can hold \
                     only one of the two, so generate each project by itself (`mauve generate ROOT.mal --out \
                     DIR`), or name one of them as `[project] root` in mauve.toml",
                    package.name,
                    root(*other),
                    root(project)
                ));
            }
        }
    }
    Ok(all.into_iter().map(|(_, package)| package).collect())
}

fn difference<'a>(a: &'a Package, b: &'a Package) -> Option<&'a str> {
    let only = |a: &'a Package, b: &Package| {
        let others: HashMap<&str, &GeneratedFile> =
            b.files.iter().map(|file| (file.path.as_str(), file)).collect();
        a.files.iter().find(|file| others.get(file.path.as_str()) != Some(file))
    };
    only(a, b).or_else(|| only(b, a)).map(|file| file.path.as_str())
}

/// Returns the names of the packages in a folder that are not among `packages`. Standalone programs are not a package.
fn left_packages(out: &Out, packages: &[Package]) -> Vec<String> {
    let ours: BTreeSet<&str> = packages.iter().map(|package| package.name.as_str()).collect();
    let Ok(folder) = Folder::open(&out.real) else { return Vec::new() };
    let is_held = |name: &OsString| {
        let manifest = folder.folder(name).and_then(|package| package.kind(MANIFEST.as_ref()));
        manifest.is_ok_and(|kind| kind == Kind::File)
    };
    let held = folder.names().unwrap_or_default().into_iter().filter(is_held);
    let names = held.filter_map(|name| name.into_string().ok());
    let mut left: Vec<String> =
        names.filter(|name| !ours.contains(name.as_str()) && name != STANDALONE).collect();
    left.sort();
    left
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;
    use std::process::Command;

    use super::*;

    fn scratch(name: &str) -> PathBuf {
        mauve_tests::own_scratch(&format!("generate-{name}"))
    }

    #[test]
    fn a_path_is_found_behind_links_and_beyond_what_is_there() {
        let top = scratch("behind");
        fs::create_dir_all(top.join("real/deep")).unwrap();
        fs::write(top.join("file"), "").unwrap();
        symlink("real/deep", top.join("link")).unwrap();
        symlink("nowhere", top.join("dangling")).unwrap();
        for (path, found) in [
            ("real", "real"),
            ("link", "real/deep"),
            ("link/..", "real"),
            ("link/new/one", "real/deep/new/one"),
            ("link/new/../other", "real/deep/other"),
            ("new/../link/x", "real/deep/x"),
            ("new/one/../../../no-such-folder/x", "../no-such-folder/x"),
            ("./link/./new/.", "real/deep/new"),
        ] {
            assert_eq!(behind_links(&top.join(path)), Ok(normalised(&top.join(found))), "{path}");
        }
        for (path, message) in
            [("dangling", "leads nowhere"), ("dangling/new", "leads nowhere"), ("file/new", "cannot be read")]
        {
            assert!(behind_links(&top.join(path)).unwrap_err().contains(message), "{path}");
        }
        assert!(behind_links(Path::new("")).is_err());
        let here = std::env::current_dir().unwrap().canonicalize().unwrap();
        assert_eq!(behind_links(Path::new("no-such-folder/new")), Ok(here.join("no-such-folder/new")));
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn hidden_folders_are_refused() {
        let refused = |out: &str, real: &str| {
            let [home, behind] = [Path::new("/.home/robot"), Path::new("/.real/robot")];
            refuse_hidden(home, out, [(home, &normalised(&home.join(out))), (behind, Path::new(real))])
        };
        for (out, real) in
            [("out", "/.real/robot/out"), (".", "/.real/robot"), ("a/.b/../c", "/.real/robot/a/c")]
        {
            assert_eq!(refused(out, real), Ok(()), "{out}");
        }
        for (out, real) in [
            (".git/hooks", "/.real/robot/.git/hooks"),
            ("a/.github", "/.real/robot/a/.github"),
            ("link", "/.real/robot/.git"),
            (".link", "/.real/robot/out"),
        ] {
            let why = refused(out, real).unwrap_err();
            assert_eq!(
                why,
                format!(
                    "`[generate] out` of /.home/robot/mauve.toml is {out:?}, which is in a hidden folder: \
                     name another folder, or use `--out`"
                )
            );
        }
    }

    #[test]
    fn what_is_read_is_a_file_in_the_folder() {
        let top = scratch("read");
        fs::create_dir_all(top.join("out/p/deep")).unwrap();
        fs::create_dir_all(top.join("elsewhere")).unwrap();
        fs::write(top.join("elsewhere/secret"), "secret").unwrap();
        fs::write(top.join("out/p/deep/file"), "text \u{e9}").unwrap();
        fs::write(top.join("out/p/bytes"), b"\xff").unwrap();
        File::create(top.join("out/p/longest")).unwrap().set_len(LONGEST).unwrap();
        File::create(top.join("out/p/longer")).unwrap().set_len(LONGEST + 1).unwrap();
        symlink("deep", top.join("out/p/folder")).unwrap();
        symlink("../p/folder/file", top.join("out/p/link")).unwrap();
        symlink("../../elsewhere/secret", top.join("out/p/outside")).unwrap();
        symlink("/dev/zero", top.join("out/p/device")).unwrap();
        symlink(top.join("elsewhere"), top.join("out/q")).unwrap();
        symlink("nowhere", top.join("out/p/dangling")).unwrap();
        assert!(Command::new("mkfifo").arg(top.join("out/p/pipe")).status().unwrap().success());
        symlink("out", top.join("named")).unwrap();
        let out = Out::named(&top.join("named")).unwrap();
        assert_eq!(out.real, top.join("out"));
        for (path, text) in [
            ("p/deep/file", Some("text \u{e9}")),
            ("p/folder/file", Some("text \u{e9}")),
            ("p/link", Some("text \u{e9}")),
            ("p/bytes", Some("\u{fffd}")),
            ("p/nothing", None),
            ("nothing/deep/file", None),
        ] {
            assert_eq!(read(&out, path), Ok(text.map(str::to_owned)), "{path}");
        }
        assert_eq!(read(&out, "p/longest").unwrap().map(|text| text.len() as u64), Some(LONGEST));
        for (path, message) in [
            ("p/outside", "outside` is a link that leads out of"),
            ("p/device", "is a link that leads out of"),
            ("q/secret", "q` is a link that leads out of"),
            ("p/dangling", "is a link that leads nowhere"),
            ("p/longer", "this file is longer than"),
            ("p/pipe", "is neither a regular file nor a folder"),
            ("p/deep", "is a folder"),
            ("p/bytes/file", "bytes` is not a folder"),
            ("../elsewhere/secret", "is not a path of a generated file"),
            ("p//bytes", "is not a path of a generated file"),
        ] {
            let why = read(&out, path).unwrap_err();
            assert!(why.contains(message), "{why}");
        }
        // It becomes a link after it was looked at.
        fs::rename(top.join("out"), top.join("real")).unwrap();
        symlink("real", top.join("out")).unwrap();
        let why = read(&out, "p/deep/file").unwrap_err();
        assert!(why.contains("is not a folder, or has become a link"), "{why}");
        assert_eq!(left_packages(&out, &[]), Vec::<String>::new());
        let missing = Out { shown: top.join("missing"), real: top.join("missing") };
        assert_eq!(read(&missing, "p/file"), Ok(None));
        fs::remove_dir_all(&top).unwrap();
    }
}
