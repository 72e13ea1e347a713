//! What `mauve generate` does to a folder, as one edit of the client's: for the code action, the command and the lens.
//!
//! The packages go to the folder that `[generate] out` names, from the folder of `mauve.toml`; where it is not said, to
//! `generated` there. It must be in that folder or in one of the client's, behind all links. Texts that the client has
//! open count as what the files hold.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, File, ModelDb, Project, Workspace, config_of, names_of, normalised, projects};
use mauve_ide::projects_with;
use mauve_orocos::{MANIFEST, Package, Plan, Problem, Step, packages, plan, problems};
use mauve_syntax::similar;
use salsa::Database as _;
use tower_lsp::lsp_types::Url;

use super::position::{Encoding, line_index};
use super::snapshot::{Document, Snapshot};
use crate::generate::{Out, behind_links, left_packages, merged, read, refuse_hidden, target};
use crate::harmless::harmless_line;
use crate::load::place;

/// The folder of the packages, where `mauve.toml` does not say it.
const FOLDER: &str = "generated";

/// What is to be generated. What may be asked for several deployments at once is found out once: what is wrong, and where
/// folders are behind links.
#[derive(Debug, Clone)]
pub(crate) struct Meant<'db> {
    /// The projects of one workspace that have it, at least one, with what is wrong in each.
    projects: Vec<(Project<'db>, Vec<Problem<'db>>)>,
    /// The folder that the packages go to, behind all links, and as the user knows it; or why they go nowhere.
    folder: Result<(PathBuf, String), String>,
    /// The packages of this deployment, named with its library; none: all.
    deployment: Option<String>,
}

/// What would be done.
#[derive(Debug, Clone)]
pub(crate) struct Generated {
    /// The folder of the packages, behind all links.
    pub(crate) folder: PathBuf,
    /// The same for the user, from the workspace's folder.
    pub(crate) shown_folder: String,
    /// Nothing in it was edited.
    pub(crate) plan: Plan,
    /// What stood in the files that were read, by their paths in the plan.
    pub(crate) before: HashMap<String, String>,
    /// Packages in the folder that the models make no more, as far as that is known.
    pub(crate) left_packages: Vec<String>,
}

impl Generated {
    /// Where the file of a step is.
    pub(crate) fn path(&self, step: &Step) -> PathBuf {
        self.folder.join(&step.path)
    }

    /// What the user must know whatever else is done: files of his, and packages, that the model has left behind.
    pub(crate) fn warning(&self) -> Option<String> {
        let plan = &self.plan;
        let changed = plan.changed_codels.iter().map(|it| match it.before.as_str() {
            "" => format!("{} is to define `{}`", it.path, it.now),
            before => format!("{} is to define `{}`, and was written for `{before}`", it.path, it.now),
        });
        let left = plan.left_codels.iter().map(|path| format!("{path} is of no codel of the model any more"));
        let files = plan.left_files.iter();
        let files =
            files.map(|path| format!("{path} is listed as generated, made no more, and may be yours"));
        let all: Vec<String> = changed.chain(left).chain(files).collect();
        let mut said = Vec::new();
        if !all.is_empty() {
            said.push(format!(
                "Your own files in {} stay as they are: {}.",
                self.shown_folder,
                all.join("; ")
            ));
        }
        if !self.left_packages.is_empty() {
            said.push(format!(
                "The models make these packages in {} no more; remove what nobody needs: {}.",
                self.shown_folder,
                self.left_packages.join(", ")
            ));
        }
        (!said.is_empty()).then(|| harmless_line(&said.join(" ")))
    }

    /// That there is nothing to do, if there is not.
    pub(crate) fn nothing(&self) -> Option<String> {
        let is_done = self.plan.steps.is_empty();
        is_done.then(|| format!("The Orocos packages in {} are as they should be.", self.shown_folder))
    }
}

/// All that can be generated from the projects of a file.
///
/// # Errors
///
/// That it has none, for the user.
pub(crate) fn meant(snapshot: &Snapshot, file: File) -> Result<Meant<'_>, String> {
    let db = &snapshot.db;
    let mut projects = projects_with(db, &snapshot.workspaces, file);
    // A file of several workspaces counts where it stands nearest.
    let nearness = |workspace: Workspace| {
        let folder = workspace.folder(db);
        (file.path(db).starts_with(folder), folder.components().count())
    };
    let Some(nearest) = projects.iter().map(|it| it.workspace(db)).max_by_key(|&it| nearness(it)) else {
        return Err("this file is part of no project".to_owned());
    };
    projects.retain(|project| project.workspace(db) == nearest);
    Ok(Meant {
        projects: projects.into_iter().map(|project| (project, problems(db, project))).collect(),
        folder: out_folder(snapshot, nearest),
        deployment: None,
    })
}

fn deployments<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> impl Iterator<Item = Decl<'db>> + use<'db> {
    names_of(db, project).all.iter().copied().filter(move |decl| decl.kind(db) == Kind::Deployment)
}

impl<'db> Meant<'db> {
    /// What is meant by the name of a deployment.
    ///
    /// # Errors
    ///
    /// Why nothing is, for the user.
    pub(crate) fn only(&self, db: &'db dyn ModelDb, name: &str) -> Result<Meant<'db>, String> {
        let mut names: Vec<String> = self
            .projects
            .iter()
            .flat_map(|(project, _)| deployments(db, *project))
            .filter(|decl| decl.qualified(db) == name || **decl.name(db) == *name)
            .map(|decl| decl.qualified(db))
            .collect();
        names.sort();
        names.dedup();
        match names.as_slice() {
            [only] => {
                let has = |project| deployments(db, project).any(|decl| decl.qualified(db) == *only);
                let projects = self.projects.iter().filter(|(project, _)| has(*project)).cloned().collect();
                Ok(Meant { projects, folder: self.folder.clone(), deployment: Some(only.clone()) })
            }
            [] => {
                let all: Vec<String> = self
                    .projects
                    .iter()
                    .flat_map(|(project, _)| deployments(db, *project).map(|decl| decl.qualified(db)))
                    .collect();
                let near = similar(name, all.iter().map(String::as_str));
                let near = near.map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
                Err(format!("no deployment `{}` in the projects of this file{near}", harmless_line(name)))
            }
            several => Err(format!("`{name}` may be {}", several.join(" or "))),
        }
    }

    /// Why it cannot be generated, as far as nothing on the disk is read.
    pub(crate) fn refusal(&self, snapshot: &'db Snapshot) -> Option<String> {
        let mut found: Vec<&Problem<'db>> = Vec::new();
        for problem in self.projects.iter().flat_map(|(_, problems)| problems) {
            if !found.contains(&problem) {
                found.push(problem);
            }
        }
        self.mend(snapshot, &found).or_else(|| self.folder.clone().err())
    }

    fn mend(&self, snapshot: &Snapshot, problems: &[&Problem<'db>]) -> Option<String> {
        let db = &snapshot.db;
        let first = problems.first()?;
        let file = first.at.file(db);
        let start = line_index(db, file).position(first.at.range(db).start(), Encoding::Utf32);
        let path = match self.projects.first() {
            Some((project, _)) => shown(db, project.workspace(db), file.path(db)),
            None => harmless_line(&file.path(db).display().to_string()),
        };
        let at = format!("{path}:{}:{}", start.line + 1, start.character + 1);
        Some(match problems.len() {
            1 => format!("1 error is to be mended first: {at}: {}", first.message),
            count => format!("{count} errors are to be mended first. The first one: {at}: {}", first.message),
        })
    }

    /// What it is called, with the folder that it goes to.
    pub(crate) fn title(&self) -> String {
        let what = match &self.deployment {
            Some(deployment) => format!("Generate Orocos packages of `{deployment}`"),
            None => "Generate all Orocos packages".to_owned(),
        };
        match &self.folder {
            Ok((_, shown)) => format!("{what} in {shown}"),
            Err(_) => what,
        }
    }

    /// The packages, each once.
    fn packages(&self, snapshot: &'db Snapshot) -> Result<Vec<Package>, String> {
        let db = &snapshot.db;
        let of_project = |project: Project<'db>| {
            let mut found = deployments(db, project);
            let of = self.deployment.as_ref().and_then(|name| found.find(|it| it.qualified(db) == *name));
            let made = packages(db, project, of).map_err(|problems| {
                let problems: Vec<&Problem<'db>> = problems.iter().collect();
                self.mend(snapshot, &problems).unwrap_or_default()
            });
            Ok((project, made?))
        };
        merged(
            db,
            self.projects.iter().map(|(project, _)| of_project(*project)).collect::<Result<_, String>>()?,
        )
    }

    /// Is this all that is generated into a folder, as far as the client has it open?
    fn is_whole(&self, snapshot: &'db Snapshot, folder: &Path) -> bool {
        let db = &snapshot.db;
        let is_all = |workspace: Workspace| {
            workspace.only(db).is_empty() && projects(db, workspace).len() == self.projects.len()
        };
        let Some((project, _)) = self.projects.first() else { return false };
        let own = project.workspace(db);
        let mut others = snapshot.workspaces.iter().filter(|&&it| it != own);
        let is_shared = others.any(|&it| out_folder(snapshot, it).is_ok_and(|(other, _)| other == *folder));
        self.deployment.is_none() && is_all(own) && !is_shared
    }

    /// What would be done.
    ///
    /// # Errors
    ///
    /// Why nothing is, for the user: what is wrong in the models, a folder that is elsewhere, files that somebody edited.
    pub(crate) fn generated(&self, snapshot: &'db Snapshot) -> Result<Generated, String> {
        if let Some(refusal) = self.refusal(snapshot) {
            return Err(refusal);
        }
        let (folder, shown_folder) = self.folder.clone()?;
        let packages = self.packages(snapshot)?;
        let out = Out { shown: folder.clone(), real: folder.clone() };
        let before = RefCell::new(HashMap::new());
        let read = |path: &str| {
            // A disk may be slow, and an edit waits for this.
            snapshot.db.unwind_if_revision_cancelled();
            let text = match open(snapshot, &folder.join(path)) {
                Some((_, document)) => Some(document.file.text(&snapshot.db).to_string()),
                None => read(&out, path)?,
            };
            before.borrow_mut().extend(text.clone().map(|text| (path.to_owned(), text)));
            Ok(text)
        };
        let mut plan = plan(&packages, &read)?;
        if !plan.edited.is_empty() {
            let edited: Vec<String> =
                plan.edited.iter().map(|it| format!("{shown_folder}/{}", harmless_line(it))).collect();
            return Err(format!(
                "these generated files were edited, and would lose that: {}. `mauve generate --force` writes them anew",
                edited.join(", ")
            ));
        }
        for step in &plan.steps {
            // The command line puts a file in the place of a link; an editor writes where the link leads.
            if target(&folder, step)?.is_symlink() {
                return Err(format!(
                    "{shown_folder}/{} is a link, and what it leads to would be written: put a file in its place, or run \
                     `mauve generate`, which does",
                    harmless_line(&step.path)
                ));
            }
        }
        // A manifest says what was written: last, since whoever writes may be stopped.
        plan.steps.sort_by_key(|step| step.path.ends_with(MANIFEST));
        let left_packages = match self.is_whole(snapshot, &folder) {
            true => left_packages(&out, &packages),
            false => Vec::new(),
        };
        Ok(Generated { folder, shown_folder, plan, before: before.into_inner(), left_packages })
    }
}

/// A path as the user knows it: from the workspace's folder.
fn shown(db: &dyn ModelDb, workspace: Workspace, path: &Path) -> String {
    harmless_line(&path.strip_prefix(workspace.folder(db)).unwrap_or(path).display().to_string())
}

/// The folder that the packages of a workspace go to, behind all links, and as the user knows it.
fn out_folder(snapshot: &Snapshot, workspace: Workspace) -> Result<(PathBuf, String), String> {
    let db = &snapshot.db;
    let home = workspace.folder(db);
    if home.as_os_str().is_empty() {
        return Err("this text is no file yet: save it first".to_owned());
    }
    let out = config_of(db, workspace).out.as_ref().map_or(FOLDER, |(out, _)| out);
    let asked = normalised(&home.join(out));
    let folder = behind_links(&asked)?;
    let shown = shown(db, workspace, &asked);
    let mut homes = std::iter::once(home).chain(snapshot.folders.iter());
    let holder = homes.find_map(|home| home.canonicalize().ok().filter(|home| folder.starts_with(home)));
    let Some(holder) = holder else {
        return Err(format!(
            "`[generate] out` in mauve.toml leads to {}, which is not in the folder of the workspace: `mauve generate \
             --out` may write there",
            folder.display()
        ));
    };
    refuse_hidden(home, out, [(home, &asked), (&holder, &folder)])?;
    if folder.exists() && !folder.is_dir() {
        return Err(format!("{shown} is a file, and not the folder that the packages would go to"));
    }
    Ok((folder, if shown.is_empty() { ".".to_owned() } else { shown }))
}

/// The document that the client has open of a file.
pub(crate) fn open<'a>(snapshot: &'a Snapshot, path: &Path) -> Option<(&'a Url, &'a Document)> {
    let path = place(path);
    snapshot.documents.iter().find(|(_, document)| *document.file.path(&snapshot.db) == path)
}
