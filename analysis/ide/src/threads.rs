//! The threads in a file of `[platform] threads`, with the activities that they execute: for hints, hovers and code actions there.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, File, ModelDb, Project, names_of};
use mauve_syntax::TextRange;
use mauve_wcrt::{declared_threads, system_of, thread_files, threads_in};

use crate::occurrences::range_of;

/// A thread in a file, and what a deployment executes in it.
pub(crate) struct ThreadAt<'db> {
    pub(crate) deployment: Decl<'db>,
    /// The indices of its activities in the system of the deployment.
    pub(crate) activities: Vec<usize>,
    /// The range of the entry.
    pub(crate) range: TextRange,
    /// The range of its id.
    pub(crate) id: TextRange,
}

/// Returns the threads of a file that activities of a project name, in the order of the deployments and activities.
pub(crate) fn threads_with_activities<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
) -> Vec<ThreadAt<'db>> {
    let workspace = project.workspace(db);
    if !thread_files(db, workspace).files.contains(&file) {
        return Vec::new();
    }
    let (declared, read) = (declared_threads(db, workspace), threads_in(db, file));
    let mut found: Vec<ThreadAt<'db>> = Vec::new();
    for deployment in names_of(db, project).of_kind(db, Kind::Deployment) {
        let first = found.len();
        for (index, activity) in system_of(db, project, deployment).activities.iter().enumerate() {
            let thread = activity.declared_thread.as_ref().and_then(|(id, _)| declared.find(id));
            let Some(entry) = thread.filter(|it| it.file == file).and_then(|it| read.entry(it.place)) else {
                continue;
            };
            let (range, id) = (range_of(&entry.range), range_of(entry.id.range().unwrap_or(&entry.range)));
            match found.iter_mut().skip(first).find(|it| it.range == range) {
                Some(known) => known.activities.push(index),
                None => found.push(ThreadAt { deployment, activities: vec![index], range, id }),
            }
        }
    }
    found
}
