//! The actions at a location.

use std::cell::{OnceCell, RefCell};

use mauve_hir::{ModelDb, Project, Workspace};
use rustc_hash::FxHashMap;

use super::{
    ActionQuestion, Actions, CodeAction, fixes, skeleton, sorted_fields, timing, tune, update, uses,
};
use crate::project::projects_with;

/// The modules that offer actions, in the order of display.
const OFFERS: &[fn(&mut Actions<'_, '_>)] = &[
    fixes::offer,
    timing::offer,
    tune::offer,
    skeleton::offer,
    update::offer,
    sorted_fields::offer,
    uses::offer,
];

/// Returns the actions at a location. `project` answers for the file; the workspaces have its diagnostics, and the other projects
/// in which a refactoring must be right.
///
/// ```
/// use mauve_ide::{ActionKind, ActionQuestion, Changes, code_actions};
/// use mauve_hir::{Database, Workspace, projects};
///
/// let db = Database::default();
/// let text = "codel plan(): int\nshell S { }\ncore C(S) { update = { plna(); } }\n";
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/model.mal".into(), text.to_owned())]);
/// let file = workspace.file(&db, "/model.mal".as_ref()).unwrap();
/// let offset = text.find("plna").unwrap() as u32;
/// let question = ActionQuestion {
///     file,
///     range: mauve_syntax::TextRange::empty(offset.into()),
///     diagnostics: &[],
///     kinds: &[ActionKind::QuickFix],
///     changes: Changes::All,
/// };
/// let action = &code_actions(&db, &[workspace], Some(projects(&db, workspace)[0]), question)[0];
/// assert_eq!(action.title, "Change to `plan`");
/// assert!(action.change.as_ref().unwrap().applied(&db, file).contains("update = { plan(); }"));
/// ```
pub fn code_actions<'db>(
    db: &'db dyn ModelDb,
    workspaces: &[Workspace],
    project: Option<Project<'db>>,
    question: ActionQuestion<'_>,
) -> Vec<CodeAction<'db>> {
    let projects = projects_with(db, workspaces, question.file);
    let mut actions = Actions {
        db,
        workspaces,
        project,
        projects,
        question,
        findings: OnceCell::new(),
        programs: RefCell::default(),
        found: Vec::new(),
        known: FxHashMap::default(),
    };
    for offer in OFFERS {
        offer(&mut actions);
    }
    actions.found
}
