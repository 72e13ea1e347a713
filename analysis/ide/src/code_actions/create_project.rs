//! Creates `mauve.toml` and a timing table for models without any: the table lists all codels, with times that are assumed.

use std::fmt::Write as _;

use mauve_diagnostics::Finding;
use mauve_hir::item_tree::Kind;
use mauve_hir::{CONFIG_FILE, ModelDb, Project, config_file, names_of, projects, toml_key};

use super::{ActionKind, Actions, CodeAction};
use crate::Change;

/// The table beside `mauve.toml`.
const TABLE_FILE: &str = "timing.toml";

pub(super) fn offer<'db>(actions: &mut Actions<'_, 'db>, finding: &Finding<'db>) {
    let db = actions.db;
    let Some(project) = finding.only_in.or(actions.project) else { return };
    let workspace = project.workspace(db);
    let folder = workspace.folder(db);
    let [config_path, table_path] = [CONFIG_FILE, TABLE_FILE].map(|name| folder.join(name));
    if config_file(db, workspace).is_some() || workspace.file(db, &table_path).is_some() {
        return;
    }
    let action = CodeAction {
        fixed: vec![finding.clone()],
        creates_files: true,
        ..CodeAction::new(ActionKind::QuickFix, format!("Create {CONFIG_FILE} and {TABLE_FILE}"))
    };
    actions.push(action, || Change {
        files: Vec::new(),
        created: vec![(config_path, config(db, project)), (table_path, table(db, project))],
    });
}

/// Returns a configuration. Without a root, all models of the folder that no other includes are roots.
fn config(db: &dyn ModelDb, project: Project<'_>) -> String {
    let workspace = project.workspace(db);
    let root = project.root(db).path(db).strip_prefix(workspace.folder(db)).ok().and_then(|it| it.to_str());
    let root = root.filter(|_| projects(db, workspace).len() == 1);
    let root = root.map_or_else(String::new, |root| {
        let root = root.replace('\\', "/").replace('"', "\\\"");
        format!("[project]\nroot = \"{root}\"\n\n")
    });
    format!(
        "{root}[timing]\ntables = [\"{TABLE_FILE}\"]\n\
         # The column of the timing tables that is used: the probability that an execution takes longer than its time there.\n\
         significance = 1e-4\n\n\
         [platform]\n\
         # The number of CPUs.\n\
         # cpus = 2\n\
         # True: Linux reserves 50 ms of each second for other threads. False with `sysctl kernel.sched_rt_runtime_us=-1`.\n\
         # rt_throttling = false\n"
    )
}

/// Returns a table with all codels of a project.
fn table(db: &dyn ModelDb, project: Project<'_>) -> String {
    let mut keys: Vec<String> =
        names_of(db, project).of_kind(db, Kind::Codel).map(|it| toml_key(&it.qualified(db))).collect();
    keys.sort_unstable();
    keys.dedup();
    let width = keys.iter().map(|key| key.chars().count()).max().unwrap_or_default();
    let mut text = "# The worst-case execution time of each codel, in milliseconds.\n\
                    # `mauve pwcet … -o timing.toml` replaces assumed times with measured ones.\n\
                    unit = \"ms\"\n\n[codel]\n"
        .to_owned();
    for key in keys {
        let _ = writeln!(text, "{key:width$} = 1 # assumed: measure it");
    }
    text
}

#[cfg(test)]
mod tests {
    use expect_test::expect;
    use mauve_diagnostics::workspace_diagnostics;
    use mauve_hir::{Database, Workspace};
    use mauve_syntax::TextRange;

    use crate::fixture::{Fixture, project_with};
    use crate::{ActionKind, ActionQuestion, Changes, code_actions};

    const MODEL: &str = "library nav { codel plan(): int  codel turn_to(): int\n  shell S { }\n\
                         core C(S) { update = { plan(); } }\n  component K(S, C)\n\
                         architecture A { instance pilot: K }\n\
                         deployment $0D { architecture A activity pilot { priority = 1 period = 100 } } }\n";

    /// The texts of the created files.
    fn created(fixture: &str) -> Option<String> {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let (range, kinds) = (TextRange::empty(offset), &[ActionKind::QuickFix]);
        let question = ActionQuestion { file, range, diagnostics: &[], kinds, changes: Changes::All };
        let actions = code_actions(&db, &[workspace], project_with(&db, workspace, file), question);
        let action = actions.into_iter().find(|it| it.creates_files)?;
        assert_eq!(action.title, "Create mauve.toml and timing.toml");
        assert!(!action.preferred);
        let created = action.change?.created;
        let texts =
            workspace.files(&db).iter().map(|(path, file)| (path.clone(), file.text(&db).to_string()));
        let texts: Vec<_> = texts.chain(created.clone()).collect();
        // The model is analysed then.
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let codes: Vec<_> =
            workspace_diagnostics(&db, workspace).iter().map(|it| it.diagnostic.code.name).collect();
        assert_eq!(codes, ["unused-codel"]);
        Some(created.iter().map(|(path, text)| format!("--- {}\n{text}", path.display())).collect())
    }

    #[test]
    fn a_lone_model_gets_a_table_of_all_codels() {
        expect![[r#"
            --- /mauve.toml
            [project]
            root = "model.mal"

            [timing]
            tables = ["timing.toml"]
            # The column of the timing tables that is used: the probability that an execution takes longer than its time there.
            significance = 1e-4

            [platform]
            # The number of CPUs.
            # cpus = 2
            # True: Linux reserves 50 ms of each second for other threads. False with `sysctl kernel.sched_rt_runtime_us=-1`.
            # rt_throttling = false
            --- /timing.toml
            # The worst-case execution time of each codel, in milliseconds.
            # `mauve pwcet … -o timing.toml` replaces assumed times with measured ones.
            unit = "ms"

            [codel]
            "nav.plan"    = 1 # assumed: measure it
            "nav.turn_to" = 1 # assumed: measure it
        "#]]
        .assert_eq(&created(MODEL).unwrap());
    }

    #[test]
    fn nothing_is_created_beside_a_configuration() {
        assert_eq!(created(&format!("{MODEL}//- /mauve.toml\n[timing]\ntables = [\"none.toml\"]\n")), None);
    }
}
