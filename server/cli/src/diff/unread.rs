//! What a state cannot read, and the projects whose figures depend on it: they have none there.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use mauve_hir::{
    CONFIG_FILE, Database, File, Workspace, config_file, config_of, include_candidates, includes,
    project_files, projects, relative_path,
};
use mauve_ide::{Comparison, Figures};
use mauve_wcrt::{input_files, table_pattern};

/// Why the figures of the deployments of a project are not known.
#[derive(Debug, Clone)]
pub(super) struct Unread {
    /// The root of the project, or a path around it.
    path: PathBuf,
    pub(super) why: String,
    is_project: bool,
}

/// Returns what cannot be read in a state: the files that its projects need. Of what was `left_out`, as much as projects need, and
/// what may have projects. Paths are relative to `folder`.
pub(super) fn unread(
    db: &Database,
    workspaces: &[Workspace],
    folder: &Path,
    left_out: &BTreeMap<PathBuf, String>,
) -> Vec<Unread> {
    let left_out_at = |path: &Path| Some(left_out.iter().find(|(it, _)| path.starts_with(it))?.1.clone());
    let relative = |path: &Path| relative_path(folder, path);
    let problem = |file: File| {
        let (path, problem) = (file.path(db), file.problem(db).as_ref()?);
        Some(
            left_out_at(path)
                .unwrap_or_else(|| format!("`{}`: {}", relative(path).display(), problem.message())),
        )
    };
    // Which projects there are depends on a configuration.
    let around = |path: &Path| {
        let is_config = path.ends_with(CONFIG_FILE);
        relative(path.parent().filter(|_| is_config).unwrap_or(path))
    };
    let outside = |path: &Path, why: String| Unread { path: around(path), why, is_project: false };
    let mut found: Vec<Unread> = left_out.iter().map(|(path, why)| outside(path, why.clone())).collect();
    for &workspace in workspaces {
        let config = config_file(db, workspace);
        found.extend(config.and_then(|file| Some(outside(file.path(db), problem(file)?))));
        let patterns = || config_of(db, workspace).all_patterns().map(|(pattern, _)| pattern);
        let is_named = |path: &Path| patterns().any(|it| may_name(workspace.folder(db), it, path));
        let named = left_out.iter().filter(|(path, _)| is_named(path)).map(|(_, why)| why.clone());
        let mut shared: Vec<String> = workspace.unreadable(db).iter().cloned().chain(named).collect();
        shared.extend(input_files(db, workspace).0.filter_map(problem));
        for &project in projects(db, workspace) {
            let files = project_files(db, project);
            let missing = files.iter().flat_map(|&file| {
                let all = file.outline(db).includes.iter().zip(includes(db, workspace, file));
                let missing = all.filter(|(_, found)| found.is_none()).filter_map(|(text, _)| text.as_ref());
                missing.flat_map(move |text| include_candidates(db, workspace, file, text))
            });
            let reasons = missing.filter_map(|path| left_out_at(&path));
            let reasons = reasons.chain(files.iter().filter_map(|file| problem(*file))).chain(shared.clone());
            let root = relative(project.root(db).path(db));
            found.extend(reasons.map(|why| Unread { path: root.clone(), why, is_project: true }));
        }
    }
    found
}

/// Returns why the figures of a deployment are not known in one of its states, since `all` cannot be read in them.
pub(super) fn unread_of(all: &[Unread], of: &Comparison) -> Vec<String> {
    // `..` is around all of them.
    let is_above = |path: &Path| path.components().all(|it| it == Component::ParentDir);
    let is_in =
        |path: &Path| [&of.before, &of.after].into_iter().flatten().any(|it| it.root.starts_with(path));
    let reasons = all.iter().filter(|it| is_above(&it.path) || is_in(&it.path)).map(|it| it.why.clone());
    reasons.collect::<BTreeSet<String>>().into_iter().collect()
}

/// Returns a comparison for each project without deployments in both states, since files cannot be read.
pub(super) fn lone_projects(all: &[Unread], known: &[Comparison]) -> Vec<Comparison> {
    let roots: BTreeSet<&PathBuf> = all.iter().filter(|it| it.is_project).map(|it| &it.path).collect();
    let is_known = |path: &Path| {
        known.iter().any(|it| [&it.before, &it.after].into_iter().flatten().any(|it| it.root == path))
    };
    let lone = roots.into_iter().filter(|path| !is_known(path)).map(|root| {
        let deployment = root.display().to_string();
        let level = "an unknown level".to_owned();
        Comparison::of(Some(Figures { deployment, level, root: root.clone(), ..Figures::default() }), None)
    });
    lone.collect()
}

/// Returns whether a pattern of tables names a link, or may name a file in a submodule: one that is called like the last parts of the
/// pattern, since a star matches a star.
fn may_name(folder: &Path, pattern: &str, path: &Path) -> bool {
    let Ok(glob) = table_pattern(folder, pattern) else { return false };
    let pattern = Path::new(pattern);
    let mut ends = pattern.ancestors().filter_map(|head| pattern.strip_prefix(head).ok());
    glob.is_match(path) || ends.any(|end| glob.is_match(path.join(end)))
}
