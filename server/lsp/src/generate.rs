//! The changes of `mauve generate` as one workspace edit, for the code action, the command and the lens.
//!
//! The packages go to the folder `[generate] out`, relative to the folder of `mauve.toml`; the default is
//! `generated`. With links resolved, it must be in that folder or in a workspace folder of the client. The texts of
//! open documents are used instead of the files.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

use mauve_hir::{File, ModelDb, Workspace, config_of, normalised, projects};
use mauve_orocos::{MANIFEST, PlanStep};
use mauve_projects::analysis_document::deployments_of;
use mauve_projects::destination::behind_links;
use mauve_projects::generate::{
    GenerateRefusal, GenerateRequest, Generated, Out, Selected, generate, problem_message, read,
    refuse_hidden, target,
};
use mauve_projects::harmless::harmless_line;
use mauve_projects::load::canonical_path;
use mauve_syntax::similar;
use salsa::Database as _;
use tower_lsp::lsp_types::Url;

use super::position::{Encoding, LineIndex};
use super::snapshot::{Document, Snapshot};

/// The default folder of the packages.
const FOLDER: &str = "generated";

/// What an answered request would do to the client's files.
pub(crate) struct Preview {
    /// No file of its plan was edited.
    pub(crate) generated: Generated,
    /// The folder of the packages for the user, from the workspace's folder.
    pub(crate) shown_folder: String,
    /// The contents of the files that were read, by their paths in the plan.
    pub(crate) before: HashMap<String, String>,
}

impl Preview {
    /// Where the file of a step is.
    pub(crate) fn path(&self, step: &PlanStep) -> PathBuf {
        self.generated.out.real.join(&step.path)
    }

    /// Returns the warning about the user's files and packages that the model no longer has.
    pub(crate) fn warning(&self) -> Option<String> {
        let folder = &self.shown_folder;
        let changed = self.generated.plan.changed_codels.iter().map(|it| {
            let before =
                if it.before.is_empty() { String::new() } else { format!("; it was `{}`", it.before) };
            format!("the prototype of the codel in {folder}/{} is now `{}`{before}", it.path, it.now)
        });
        let left = self.generated.left().map(|(path, why)| format!("{folder}/{path}: {why}"));
        let all: Vec<String> = changed.chain(left).collect();
        (!all.is_empty()).then(|| harmless_line(&(all.join(". ") + ".")))
    }

    /// Returns the message that nothing changes, if nothing does.
    pub(crate) fn nothing(&self) -> Option<String> {
        let is_done = self.generated.plan.steps.is_empty();
        is_done.then(|| format!("The Orocos packages in {} are up to date.", self.shown_folder))
    }
}

/// Returns the request for all packages of the projects of a file in its nearest workspace.
pub(crate) fn request(snapshot: &Snapshot, file: File) -> Result<GenerateRequest<'_>, String> {
    let db = &snapshot.db;
    let mut projects = snapshot.projects(file);
    let nearest = projects.first().ok_or_else(|| NO_PROJECT.to_owned())?.workspace(db);
    projects.retain(|project| project.workspace(db) == nearest);
    let out = out_folder(snapshot, nearest);
    let selected = projects.into_iter().map(|project| Selected::new(db, project, None, out.clone()));
    Ok(GenerateRequest { selected: selected.collect(), ..GenerateRequest::default() })
}

const NO_PROJECT: &str = "this file does not belong to a project";

/// Returns the part of a request that a deployment needs, by its name with its library or without.
///
/// # Errors
///
/// The request has no such deployment, or several, in words for the user.
pub(crate) fn only<'db>(
    db: &'db dyn ModelDb,
    request: &GenerateRequest<'db>,
    name: &str,
) -> Result<GenerateRequest<'db>, String> {
    let of_project = |it: &Selected<'db>| {
        let it = it.clone();
        let found = deployments_of(db, it.project).filter(|decl| decl.is_called(db, name));
        found.map(move |decl| Selected { deployment: Some(decl), ..it.clone() })
    };
    let selected: Vec<Selected<'db>> = request.selected.iter().flat_map(of_project).collect();
    let mut names: Vec<String> =
        selected.iter().filter_map(|it| it.deployment.map(|decl| decl.qualified(db))).collect();
    names.sort();
    names.dedup();
    match names.as_slice() {
        [_] => Ok(GenerateRequest { selected, ..*request }),
        [] => {
            let all = request.selected.iter().flat_map(|it| deployments_of(db, it.project));
            let all: Vec<String> = all.map(|decl| decl.qualified(db)).collect();
            let near = similar(name, all.iter().map(String::as_str));
            let near = near.map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
            Err(format!("no deployment `{}` in the projects of this file{near}", harmless_line(name)))
        }
        several => Err(format!("`{name}` may be {}", several.join(" or "))),
    }
}

fn refusal_text(snapshot: &Snapshot, request: &GenerateRequest<'_>, refusal: GenerateRefusal<'_>) -> String {
    let db = &snapshot.db;
    let problems = match refusal {
        GenerateRefusal::Problems(problems) => problems,
        GenerateRefusal::Other(why) => return why,
    };
    let Some(first) = problems.first() else { return String::new() };
    let file = first.at.file(db);
    let start = LineIndex::new(db, file, Encoding::Utf32).position(first.at.range(db).start());
    let path = match request.selected.first() {
        Some(it) => shown(db, it.project.workspace(db), file.path(db)),
        None => harmless_line(&file.path(db).display().to_string()),
    };
    let at = format!("{path}:{}:{}", start.line + 1, start.character + 1);
    let message = problem_message(&first.kind);
    match problems.len() {
        1 => format!("fix 1 error first: {at}: {message}"),
        count => format!("fix {count} errors first. The first is: {at}: {message}"),
    }
}

/// Returns why a request is refused, as far as that is known without reading files.
pub(crate) fn refusal(snapshot: &Snapshot, request: &GenerateRequest<'_>) -> Option<String> {
    request.refusal().map(|refusal| refusal_text(snapshot, request, refusal))
}

/// Returns the title of the action that answers a request, with the folder of the packages.
pub(crate) fn title(db: &dyn ModelDb, request: &GenerateRequest<'_>) -> String {
    let first = request.selected.first();
    let what = match first.and_then(|it| it.deployment) {
        Some(deployment) => format!("Generate Orocos packages of `{}`", deployment.qualified(db)),
        None => "Generate all Orocos packages".to_owned(),
    };
    match first.filter(|it| it.out.is_ok()) {
        Some(it) => format!("{what} in {}", shown_out(db, it.project.workspace(db))),
        None => what,
    }
}

/// Returns whether a request selects all packages of its folder, as far as the client has their workspaces open.
fn is_whole(snapshot: &Snapshot, request: &GenerateRequest<'_>) -> bool {
    let db = &snapshot.db;
    let Some(Selected { project, deployment: None, out: Ok(out), .. }) = request.selected.first() else {
        return false;
    };
    let own = project.workspace(db);
    let mut others = snapshot.workspaces.iter().filter(|&&it| it != own);
    own.only(db).is_empty()
        && projects(db, own).len() == request.selected.len()
        && !others.any(|&it| out_folder(snapshot, it).is_ok_and(|other| other.real == out.real))
}

/// Returns what a request would do to the client's files. The texts of open documents count as the contents of their files.
///
/// # Errors
///
/// The request is refused; a file cannot be read, was edited, or is a link; in words for the user.
pub(crate) fn preview(snapshot: &Snapshot, request: &GenerateRequest<'_>) -> Result<Preview, String> {
    let db = &snapshot.db;
    let before = RefCell::new(HashMap::new());
    let read = |out: &Out, path: &str| {
        // An edit waits for this job, and the disk may be slow.
        db.unwind_if_revision_cancelled();
        let text = match open(snapshot, &out.real.join(path)) {
            Some((_, document)) => Some(document.file.text(db).to_string()),
            None => read(out, path)?,
        };
        before.borrow_mut().extend(text.clone().map(|text| (path.to_owned(), text)));
        Ok(text)
    };
    let request = GenerateRequest { is_whole: is_whole(snapshot, request), ..request.clone() };
    let generated =
        generate(db, &request, &read).map_err(|refusal| refusal_text(snapshot, &request, refusal))?;
    // All projects are of one workspace, so there is one folder.
    let (Some(mut generated), Some(first)) = (generated.into_iter().next(), request.selected.first()) else {
        return Err(NO_PROJECT.to_owned());
    };
    let shown_folder = shown_out(db, first.project.workspace(db));
    let Generated { out, plan, .. } = &mut generated;
    if !plan.edited.is_empty() {
        let edited: Vec<String> =
            plan.edited.iter().map(|it| format!("{shown_folder}/{}", harmless_line(it))).collect();
        return Err(format!(
            "these generated files were edited: {}. `mauve generate --force` overwrites them",
            edited.join(", ")
        ));
    }
    for step in &plan.steps {
        db.unwind_if_revision_cancelled();
        // The command line replaces a link by a file; an editor writes to the target of the link.
        if target(&out.real, step)?.is_symlink() {
            return Err(format!(
                "{shown_folder}/{} is a link, and the editor would write to its target: replace it by a file, \
                 or run `mauve generate`, which does that",
                harmless_line(&step.path)
            ));
        }
    }
    // The manifest lists the written files, so it is written last: the client may stop before.
    plan.steps.sort_by_key(|step| step.path.ends_with(MANIFEST));
    Ok(Preview { generated, shown_folder, before: before.into_inner() })
}

/// Returns a path relative to the workspace's folder.
fn shown(db: &dyn ModelDb, workspace: Workspace, path: &Path) -> String {
    harmless_line(&path.strip_prefix(workspace.folder(db)).unwrap_or(path).display().to_string())
}

/// Returns what `[generate] out` of a workspace is, or the default, and the path that it names.
fn asked_out(db: &dyn ModelDb, workspace: Workspace) -> (&str, PathBuf) {
    let out = config_of(db, workspace).out.as_ref().map_or(FOLDER, |(out, _)| out);
    (out, normalised(&workspace.folder(db).join(out)))
}

fn shown_out(db: &dyn ModelDb, workspace: Workspace) -> String {
    let shown = shown(db, workspace, &asked_out(db, workspace).1);
    if shown.is_empty() { ".".to_owned() } else { shown }
}

fn out_folder(snapshot: &Snapshot, workspace: Workspace) -> Result<Out, String> {
    let db = &snapshot.db;
    let home = workspace.folder(db);
    if home.as_os_str().is_empty() {
        return Err("this text has no file yet: save it first".to_owned());
    }
    let (out, asked) = asked_out(db, workspace);
    let folder = behind_links(&asked)?;
    let mut homes = std::iter::once(home).chain(snapshot.folders.iter());
    let holder = homes.find_map(|home| home.canonicalize().ok().filter(|home| folder.starts_with(home)));
    let Some(holder) = holder else {
        return Err(format!(
            "`[generate] out` in mauve.toml leads to {}, which is outside the workspace folder: use `mauve \
             generate --out` to write there",
            folder.display()
        ));
    };
    refuse_hidden(home, out, [(home, &asked), (&holder, &folder)])?;
    if folder.exists() && !folder.is_dir() {
        let shown = shown_out(db, workspace);
        return Err(format!("{shown} is a file; the packages need a folder there"));
    }
    Ok(Out { shown: folder.clone(), real: folder })
}

/// The document that the client has open of a file.
pub(crate) fn open<'a>(snapshot: &'a Snapshot, path: &Path) -> Option<(&'a Url, &'a Document)> {
    let path = canonical_path(path);
    snapshot.documents.iter().find(|(_, document)| *document.file.path(&snapshot.db) == path)
}
