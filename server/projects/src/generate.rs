//! Generates packages: selects them for a request, finds their folder, compares them with its files, and writes them.
//!
//! Another process may replace the output folder, or a folder in it, by a link at any time. So its path is resolved
//! once, and then opened without following links (`folder.rs`).

mod out;
mod problem;
mod write;

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ffi::OsString;

use mauve_hir::{Database, Decl, Project};
use mauve_orocos::{
    GeneratedFile, GeneratedPackage, GenerationProblem, MANIFEST, Plan, Programs, STANDALONE, packages, plan,
    problems, ros2_packages, standalone,
};

use crate::folder::{Folder, FolderEntryKind};
use problem::plan_message;

pub use out::{Out, configured_out, read, refuse_hidden};
pub use problem::problem_message;
pub use write::{Site, target};

/// A request to generate packages, from the command line or from an editor.
#[derive(Debug, Clone, Default)]
pub struct GenerateRequest<'db> {
    /// What to generate and where to.
    pub selected: Vec<Selected<'db>>,
    /// Whether these are all packages of their folders. Then [`Generated::left_packages`] lists any others there.
    pub is_whole: bool,
    /// Whether to generate programs that need no Orocos, too.
    pub is_standalone: bool,
    /// Whether these are a package of ROS 2.
    pub is_ros2: bool,
    /// Whether the folders will be written: they are created, and locked until [`Generated`] is dropped.
    pub is_written: bool,
}

/// A project of a request.
#[derive(Debug, Clone)]
pub struct Selected<'db> {
    /// The project.
    pub project: Project<'db>,
    /// Selects the packages that this deployment needs; without one, all packages of the project.
    pub deployment: Option<Decl<'db>>,
    /// What must be corrected in the project before anything is generated.
    pub problems: Vec<GenerationProblem<'db>>,
    /// The folder of the packages, or why there is none, in words for the user.
    pub out: Result<Out, String>,
}

impl<'db> Selected<'db> {
    /// Selects packages of a project, to be generated into `out`.
    pub fn new(
        db: &'db Database,
        project: Project<'db>,
        deployment: Option<Decl<'db>>,
        out: Result<Out, String>,
    ) -> Selected<'db> {
        Selected { project, deployment, problems: problems(db, project), out }
    }
}

/// Why a request is refused.
pub enum GenerateRefusal<'db> {
    /// These must be corrected in the models first. Each is listed once.
    Problems(Vec<GenerationProblem<'db>>),
    /// Another reason, in words for the user.
    Other(String),
}

impl From<String> for GenerateRefusal<'_> {
    fn from(why: String) -> Self {
        GenerateRefusal::Other(why)
    }
}

/// The packages of a folder, and how its files must change.
pub struct Generated {
    /// The folder.
    pub out: Out,
    /// The packages, with all their files.
    pub packages: Vec<GeneratedPackage>,
    /// How the files of the folder must change.
    pub plan: Plan,
    /// Packages in the folder that the models do not have, where all are known.
    pub left_packages: Vec<String>,
    /// Where the plan is written, if the request says that it will be.
    pub site: Option<Site>,
}

impl Generated {
    /// Returns the paths of the user's files and of packages that the models no longer have, each with a sentence about it.
    pub fn left(&self) -> impl Iterator<Item = (&str, &'static str)> {
        let Plan { left_codels, left_files, .. } = &self.plan;
        let codels =
            left_codels.iter().map(|it| (it, "the model no longer has this codel; your file is kept"));
        let files = left_files.iter().map(|it| {
            let kept = "the manifest lists this file, and it is no longer generated; it is kept because you may have written \
                        it: remove it if you do not need it";
            (it, kept)
        });
        let packages = self.left_packages.iter().map(|it| {
            let kept =
                "this package is no longer generated from these models; remove it if you do not need it";
            (it, kept)
        });
        codels.chain(files).chain(packages).map(|(path, why)| (path.as_str(), why))
    }
}

impl<'db> GenerateRequest<'db> {
    /// Returns why the request is refused, as far as that does not depend on the files in the folders.
    pub fn refusal(&self) -> Option<GenerateRefusal<'db>> {
        let mut seen: HashSet<&GenerationProblem<'db>> = HashSet::new();
        let all = self.selected.iter().flat_map(|it| &it.problems);
        let problems: Vec<GenerationProblem<'db>> =
            all.filter(|problem| seen.insert(problem)).cloned().collect();
        if !problems.is_empty() {
            return Some(GenerateRefusal::Problems(problems));
        }
        self.selected.iter().find_map(|it| it.out.clone().err()).map(GenerateRefusal::Other)
    }
}

/// Reads a file below a folder of packages; nothing where there is none.
pub type ReadFile<'a> = dyn Fn(&Out, &str) -> Result<Option<String>, String> + 'a;

/// Answers a request: generates its packages, and compares them with the files in their folders, as `read` returns them.
/// Writes nothing.
///
/// # Errors
///
/// The request is refused; two projects have different packages of one name; a folder or a file cannot be read or locked.
pub fn generate<'db>(
    db: &'db Database,
    request: &GenerateRequest<'db>,
    read: &ReadFile<'_>,
) -> Result<Vec<Generated>, GenerateRefusal<'db>> {
    if let Some(refusal) = request.refusal() {
        return Err(refusal);
    }
    let mut folders: Vec<(Out, MadePackages<'db>)> = Vec::new();
    for Selected { project, deployment, out, .. } in &request.selected {
        let out = out.clone()?;
        // The project has no problems: it would have been refused.
        let mut made = match request.is_ros2 {
            true => ros2_packages(db, *project, *deployment),
            false => packages(db, *project, *deployment),
        }
        .unwrap_or_default();
        if request.is_standalone && !made.is_empty() {
            made.extend(standalone(db, *project, *deployment, false, Programs::Whole));
        }
        match folders.iter_mut().find(|(known, _)| known.real == out.real) {
            Some((_, all)) => all.push((*project, made)),
            None => folders.push((out, vec![(*project, made)])),
        }
    }
    let merged = folders.into_iter().map(|(out, made)| Ok((out, merged(db, made)?)));
    let merged: Vec<(Out, Vec<GeneratedPackage>)> = merged.collect::<Result<_, String>>()?;
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
type MadePackages<'db> = Vec<(Project<'db>, Vec<GeneratedPackage>)>;

/// Merges the packages of several projects that go to one folder, each once.
fn merged<'db>(db: &'db Database, made: MadePackages<'db>) -> Result<Vec<GeneratedPackage>, String> {
    let mut all: Vec<(Project<'db>, GeneratedPackage)> = Vec::new();
    for (project, packages) in made {
        for package in packages {
            let Some((other, known)) = all.iter().find(|(_, known)| known.name == package.name) else {
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

fn difference<'a>(a: &'a GeneratedPackage, b: &'a GeneratedPackage) -> Option<&'a str> {
    let only = |a: &'a GeneratedPackage, b: &GeneratedPackage| {
        let others: HashMap<&str, &GeneratedFile> =
            b.files.iter().map(|file| (file.path.as_str(), file)).collect();
        a.files.iter().find(|file| others.get(file.path.as_str()) != Some(file))
    };
    only(a, b).or_else(|| only(b, a)).map(|file| file.path.as_str())
}

/// Returns the names of the packages in a folder that are not among `packages`. Standalone programs are not a package.
fn left_packages(out: &Out, packages: &[GeneratedPackage]) -> Vec<String> {
    let ours: BTreeSet<&str> = packages.iter().map(|package| package.name.as_str()).collect();
    let Ok(folder) = Folder::open(&out.real) else { return Vec::new() };
    let is_held = |name: &OsString| {
        let manifest = folder.folder(name).and_then(|package| package.kind(MANIFEST.as_ref()));
        manifest.is_ok_and(|kind| kind == FolderEntryKind::File)
    };
    let held = folder.names().unwrap_or_default().into_iter().filter(is_held);
    let names = held.filter_map(|name| name.into_string().ok());
    let mut left: Vec<String> =
        names.filter(|name| !ours.contains(name.as_str()) && name != STANDALONE).collect();
    left.sort();
    left
}
