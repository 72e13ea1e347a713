//! The tests of editor features on the sample robots and on random models: one program, a module for each subject.
//!
//! | module | what it tests |
//! |---|---|
//! | [`code_actions`] | the edits of each action at random places |
//! | [`completion`] | completion and signature help everywhere in the sample robot |
//! | [`drawings`] | the geometry of drawings of random models |
//! | [`explanations`] | the sums in explanations and hovers |
//! | [`inlay_hints`] | hints of random deployments, and while a model is typed |
//! | [`ranges`] | ranges contain the cursor and each other |
//! | [`renames`] | random renames keep the meaning of a model |
//! | [`tune`] | priorities and CPUs are found wherever brute force finds some |

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod code_actions;
mod completion;
mod drawings;
mod explanations;
mod inlay_hints;
mod ranges;
mod renames;
mod tune;

use mauve_hir::{File, ModelDb, Project, Workspace};

/// Returns the first project with a file.
fn project_with(db: &dyn ModelDb, workspace: Workspace, file: File) -> Option<Project<'_>> {
    mauve_ide::projects_with(db, &[workspace], file).into_iter().next()
}

/// Returns the first project with a file; without any, the file is the root of its own.
fn project_of(db: &dyn ModelDb, workspace: Workspace, file: File) -> Project<'_> {
    project_with(db, workspace, file).unwrap_or_else(|| Project::new(db, workspace, file))
}
