//! Projects: the roots of a workspace, and the files that each includes.

#![allow(missing_docs, reason = "salsa writes constructors without any")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mauve_timing::{CpuSet, StateMachine, Task, Time};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::activity_field::{FieldValue, PLACES, field_entry};
use crate::completeness::Completeness;
use crate::config::{self, Config, ExternalType, OtherConfig};
use crate::db::has_outline;
use crate::graph::{closure, components};
use crate::item_tree::{Activity, Field, Name};
use crate::{File, ModelDb, Workspace, normalised};
use mauve_syntax::keywords::ActivityField;

/// A root file and the files that it includes, directly or indirectly.
#[salsa::interned(debug)]
pub struct Project<'db> {
    #[returns(copy)]
    pub workspace: Workspace,
    #[returns(copy)]
    pub root: File,
}

pub const CONFIG_FILE: &str = "mauve.toml";

/// Returns the workspace's `mauve.toml`, if it exists.
pub fn config_file(db: &dyn ModelDb, workspace: Workspace) -> Option<File> {
    workspace.files(db).get(&workspace.folder(db).join(CONFIG_FILE)).copied()
}

/// Returns the configuration in the workspace's `mauve.toml`.
#[salsa::tracked(returns(ref))]
pub fn config_of(db: &dyn ModelDb, workspace: Workspace) -> Config {
    let Some(file) = config_file(db, workspace) else { return Config::default() };
    let mut config = config::read(file.text(db));
    if let Some(problem) = file.problem(db) {
        let kind = config::MistakeKind::Unreadable(problem.message().to_owned());
        config.errors.push(config::Mistake { kind, span: 0..0, near: None });
        config.completeness = Completeness::Incomplete;
    }
    config
}

/// Returns the types that `mauve.toml` declares, without ranges: a comment does not change the result.
#[salsa::tracked(returns(ref))]
pub fn external_types(db: &dyn ModelDb, workspace: Workspace) -> BTreeMap<Name, ExternalType> {
    config_of(db, workspace).types.iter().map(|it| (it.name.clone(), it.clone())).collect()
}

/// The configuration that response times depend on, without ranges: a comment does not change it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Platform {
    /// `[[platform.other]]`: the tasks of the complete entries, each with its host, if it has one. If one is incomplete, nothing is
    /// analysed.
    pub others: Vec<(Task, Option<Name>)>,
    pub cpus: Option<u32>,
    /// `[platform.cpu_sets]`: the CPUs of each set.
    pub cpu_sets: BTreeMap<Name, CpuSet>,
    pub rt_throttling: Option<bool>,
    /// The numbers of the clocks of instances that have one in common.
    pub clocks: BTreeMap<String, u32>,
    /// `[clocks] ptp`: by how much the clocks of two hosts differ, at most.
    pub ptp: Option<Time>,
    /// Whether no error in the configuration hides a value of these.
    pub is_complete: bool,
}

impl Platform {
    /// Returns the field that says where an activity may run, and the CPUs: none for any CPU. None where an
    /// activity has no such field, or an invalid one.
    pub fn cpus_of<'a>(&self, activity: &'a Activity) -> Option<(&'a Field, CpuSet)> {
        let field = PLACES.into_iter().find_map(|it| activity.field(it))?;
        let of = ActivityField::from_keyword(&field.name.name)?;
        match field_entry(of).kind.read(field).ok()? {
            FieldValue::Cpus(cpus) => Some((field, cpus)),
            FieldValue::CpuSet(set) => Some((field, *self.cpu_sets.get(&set.name)?)),
            _ => None,
        }
    }
}

#[salsa::tracked(returns(ref))]
pub fn platform_of(db: &dyn ModelDb, workspace: Workspace) -> Platform {
    let config = config_of(db, workspace);
    let Config { cpus, cpu_sets, rt_throttling, completeness, others, .. } = config;
    let other = |it: &OtherConfig| {
        let task = Task {
            name: it.name.as_ref()?.0.as_str().into(),
            jitter: it.jitter.unwrap_or_default(),
            cpus: it.cpus.as_ref().map(|(cpus, _)| *cpus),
            burst: it.burst.unwrap_or(1).into(),
            ..Task::new(it.priority?, it.period.or(it.rate)?, StateMachine::single(it.time?))
        };
        Some((task, it.host.as_ref().map(|(host, _)| host.as_str().into())))
    };
    Platform {
        others: others.iter().filter_map(other).collect(),
        cpus: *cpus,
        cpu_sets: cpu_sets
            .iter()
            .filter_map(|it| Some((it.name.as_str().into(), it.cpus.as_ref()?.0)))
            .collect(),
        rt_throttling: *rt_throttling,
        clocks: config.on_clocks().map(|(clock, (name, _))| (name.clone(), clock)).collect(),
        ptp: config.ptp,
        is_complete: completeness.is_complete(),
    }
}

/// Returns the candidate paths of an include of `file`: in its own folder, then in the folders of the model path.
pub fn include_candidates(db: &dyn ModelDb, workspace: Workspace, file: File, include: &str) -> Vec<PathBuf> {
    let beside = file.path(db).parent().unwrap_or(Path::new("/"));
    let folders = std::iter::once(beside).chain(workspace.model_path(db).iter().map(PathBuf::as_path));
    folders.map(|folder| normalised(&folder.join(include))).collect()
}

/// Returns the files that `file` includes, in the order of its lines; `None` for an unresolved include.
#[salsa::tracked(returns(ref))]
pub fn includes(db: &dyn ModelDb, workspace: Workspace, file: File) -> Vec<Option<File>> {
    let files = workspace.files(db);
    let find = |include: &String| {
        let candidates = include_candidates(db, workspace, file, include);
        candidates.iter().find_map(|path| files.get(path)).copied()
    };
    file.outline(db).includes.iter().map(|include| include.as_ref().and_then(find)).collect()
}

/// Returns whether the path has the extension of a model.
pub fn is_model(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "mal")
}

/// Returns the projects of a workspace: one for each root.
///
/// The roots are those of `mauve.toml`. Without any, the roots are the models of the folder that no other model includes and,
/// for each include cycle that no root reaches, the model with the first path.
#[salsa::tracked(returns(ref))]
pub fn projects<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Vec<Project<'db>> {
    let mut roots = all_roots(db, workspace).clone();
    let only = workspace.only(db);
    if !only.is_empty() {
        // A file of several projects belongs to all of them; a file of no project is a root.
        let files: Vec<Vec<File>> = roots.iter().map(|&root| files_from(db, workspace, root)).collect();
        let alone = only.iter().filter(|file| !files.iter().any(|files| files.contains(file)));
        let alone: Vec<File> = alone.copied().collect();
        let has_one = |files: &Vec<File>| only.iter().any(|file| files.contains(file));
        roots =
            roots.into_iter().zip(&files).filter(|(_, files)| has_one(files)).map(|(root, _)| root).collect();
        roots.extend(alone);
    }
    roots.into_iter().map(|root| Project::new(db, workspace, root)).collect()
}

/// Returns the file of a root in `mauve.toml`.
pub fn root_file(db: &dyn ModelDb, workspace: Workspace, path: &str) -> Option<File> {
    workspace.file(db, &normalised(&workspace.folder(db).join(path)))
}

pub(crate) fn roots_exist(db: &dyn ModelDb, workspace: Workspace) -> bool {
    config_of(db, workspace).roots.iter().all(|(path, _)| root_file(db, workspace, path).is_some())
}

/// Returns all roots of a workspace, without the restriction to [`Workspace::only`].
#[salsa::tracked(returns(ref))]
pub fn all_roots(db: &dyn ModelDb, workspace: Workspace) -> Vec<File> {
    let config = config_of(db, workspace);
    if !config.roots.is_empty() {
        let mut seen = FxHashSet::default();
        let roots = config.roots.iter().filter_map(|(path, _)| root_file(db, workspace, path));
        return roots.filter(|root| seen.insert(*root)).collect();
    }
    let folder = workspace.folder(db);
    // By the path in this folder, which may be a symbolic link to another folder.
    let files = workspace.files(db).iter();
    let mut seen = FxHashSet::default();
    let models: Vec<File> = files
        .filter(|(path, _)| is_model(path) && path.starts_with(folder))
        .map(|(_, &file)| file)
        .filter(|file| seen.insert(*file))
        .collect();
    let included: FxHashSet<File> = models
        .iter()
        .flat_map(|&file| includes(db, workspace, file).iter().flatten().filter(move |&&it| it != file))
        .copied()
        .collect();
    let mut roots: Vec<File> = models.iter().copied().filter(|file| !included.contains(file)).collect();
    let mut reached: FxHashSet<File> = FxHashSet::default();
    for &root in &roots {
        reached.extend(files_from(db, workspace, root));
    }
    for file in models {
        if !reached.contains(&file) {
            reached.extend(files_from(db, workspace, file));
            roots.push(file);
        }
    }
    roots
}

/// Returns `root` and the files that it includes, directly or indirectly.
fn files_from(db: &dyn ModelDb, workspace: Workspace, root: File) -> Vec<File> {
    closure([root], |file| includes(db, workspace, file).iter().flatten().copied())
}

/// Returns the files of a project, the root first.
#[salsa::tracked(returns(ref))]
pub fn project_files<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<File> {
    files_from(db, project.workspace(db), project.root(db))
}

/// The number of files in a group.
const GROUP: usize = 32;

/// Returns the numbers of the groups of files of a project. A query about all files depends on one query for each group instead of
/// one for each file: after an edit, salsa verifies a group of closed files in one step.
pub fn file_groups<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> impl Iterator<Item = u32> + use<> {
    groups_of(project_files(db, project))
}

/// Returns the files of a group, see [`file_groups`].
pub fn files_in_group<'db>(db: &'db dyn ModelDb, project: Project<'db>, group: u32) -> &'db [File] {
    group_in(project_files(db, project), group)
}

/// Returns the numbers of the groups of `files`.
pub(crate) fn groups_of(files: &[File]) -> std::ops::Range<u32> {
    0..files.len().div_ceil(GROUP) as u32
}

/// Returns a group of `files`.
pub(crate) fn group_in(files: &[File], group: u32) -> &[File] {
    files.chunks(GROUP).nth(group as usize).unwrap_or_default()
}

/// Returns the files in include cycles, each with the number of its strongly connected component.
#[salsa::tracked(returns(ref))]
pub fn include_rings(db: &dyn ModelDb, workspace: Workspace) -> FxHashMap<File, usize> {
    let files: BTreeMap<&Path, File> =
        workspace.files(db).values().map(|&file| (file.path(db).as_path(), file)).collect();
    let files: Vec<File> = files.into_values().filter(|file| has_outline(file.path(db))).collect();
    let numbers: FxHashMap<File, usize> = files.iter().copied().zip(0..).collect();
    let included = |&file: &File| {
        let included = includes(db, workspace, file).iter().flatten();
        included.filter_map(|it| numbers.get(it).copied()).collect()
    };
    let successors: Vec<Vec<usize>> = files.iter().map(included).collect();
    let mut rings = FxHashMap::default();
    for (number, ring) in components(&successors).into_iter().enumerate() {
        if ring.len() > 1 || ring.iter().any(|it| successors[*it].contains(it)) {
            rings.extend(ring.into_iter().map(|it| (files[it], number)));
        }
    }
    rings
}
