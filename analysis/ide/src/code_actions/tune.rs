//! Code actions of a deployment that change priorities, CPUs or periods of all its activities: `Assign CPUs and priorities: 9 of 9 met`.
//!
//! [`mauve_wcrt::tune`] finds the values, within a small budget: `mauve tune` searches longer. An action is offered on the header of a
//! deployment, if it meets every deadline and improves something: more deadlines, more slack, or shorter periods. It is dropped if it
//! loses a deadline that is met in another project with the file.

use mauve_hir::{Decl, ModelDb, Project};
use mauve_syntax::ast;
use mauve_wcrt::better_timing::is_no_worse;
use mauve_wcrt::tune::{TuneAim, TuneRequest, Tuned, tune};
use mauve_wcrt::{Query, Report, response_times, response_times_if, system_of};

use super::timing::deployment_at;
use super::{ActionKind, Actions, CodeAction};
use crate::what_if::edit_of_fields;

/// Offers the values that meet every deadline.
pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    if !actions.wants(ActionKind::Rewrite) || actions.node::<ast::Activity>().is_some() {
        return;
    }
    let (Some(of), Some(project)) = (deployment_at(actions), actions.project) else { return };
    let db = actions.db;
    let now = response_times(db, project, of, Query::shown(db, project, of));
    let has_cpus = system_of(db, project, of).cpus.len() > 1;
    let mut known = Vec::new();
    for (title, request) in requests(now, has_cpus) {
        let Some(found) = tuned(db, project, of, Query::shown(db, project, of), request) else { continue };
        if !found.is_met || found.fields.is_empty() || known.contains(&&found.fields) {
            continue;
        }
        let after =
            |project| response_times_if(db, project, of, Query::shown(db, project, of), &found.fields);
        let before = |project| response_times(db, project, of, Query::shown(db, project, of));
        let mut projects = actions.projects.iter().copied();
        if !projects.all(|project| is_no_worse(before(project), &after(project))) {
            continue;
        }
        known.push(&found.fields);
        let deadlines = after(project).deadlines();
        let title = format!("{title}: {} of {} met", deadlines.met, deadlines.all);
        let action = CodeAction::new(ActionKind::Rewrite, title);
        actions.push(action, || edit_of_fields(db, project, of, &found.fields).ok());
    }
}

/// Returns what may be asked of a deployment, with the titles.
fn requests(now: &Report<'_>, has_cpus: bool) -> Vec<(&'static str, TuneRequest)> {
    let all = TuneRequest { most_steps: TuneRequest::STEPS_OF_EDITOR, ..TuneRequest::default() };
    let priorities = TuneRequest { priorities: true, ..all.clone() };
    if now.schedulable() {
        return vec![
            ("Balance the slack", TuneRequest { aim: TuneAim::Slack, ..priorities }),
            ("Shorten all periods", TuneRequest { periods: true, ..all }),
        ];
    }
    let cpus = TuneRequest { cpus: true, ..priorities.clone() };
    let cpus = has_cpus.then_some(("Assign CPUs and priorities", cpus));
    [("Assign priorities", priorities)].into_iter().chain(cpus).collect()
}

/// Searches once, although editors ask at every movement of the cursor.
#[salsa::tracked(returns(ref))]
fn tuned<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
    request: TuneRequest,
) -> Option<Tuned> {
    tune(db, project, of, query, &request).ok()
}

#[cfg(test)]
mod tests {
    use crate::fixture::{Fixture, project_with};
    use crate::{ActionKind, ActionQuestion, Changes, code_actions};
    use expect_test::expect;
    use mauve_syntax::TextRange;

    /// Returns the titles at the header of a deployment, and the text after the last of the actions.
    fn offered(activities: &str) -> String {
        let model = format!(
            "shell S {{ }} codel look(): int codel plan(): int
            core L(S) {{ update = {{ look(); }} }} core P(S) {{ update = {{ plan(); }} }}
            component Look(S, L) component Plan(S, P)
            architecture A {{ instance eye: Look instance brain: Plan }}
deployment $0D {{ architecture A
{activities}}}
//- /mauve.toml
[timing]
tables = [\"t.toml\"]
[platform]
cpus = 2
rt_throttling = false
//- /t.toml
codel.look = 4
codel.plan = 20
"
        );
        let Fixture { db, workspace, file, offset } = Fixture::new(&model);
        let kinds = &[ActionKind::Rewrite];
        let range = TextRange::empty(offset);
        let question = ActionQuestion { file, range, diagnostics: &[], kinds, changes: Changes::All };
        let actions = code_actions(&db, &[workspace], project_with(&db, workspace, file), question);
        let mut out = String::new();
        for action in &actions {
            let change = action.change.as_ref().map(|it| it.applied(&db, file)).unwrap_or_default();
            let activities = change.split("architecture A\n").nth(1).unwrap_or_default();
            out += &format!("{}\n{activities}", action.title);
        }
        out
    }

    #[test]
    fn values_are_offered_where_none_are_written() {
        expect![[r#"
            Assign priorities: 2 of 2 met
              activity eye { priority = 2 period = 10 }
              activity brain { priority = 1 period = 22 }
            }
            Assign CPUs and priorities: 2 of 2 met
              activity eye { affinity = 2 priority = 2 period = 10 }
              activity brain { affinity = 1 priority = 1 period = 22 }
            }
        "#]]
        .assert_eq(&offered("  activity eye { period = 10 }\n  activity brain { period = 22 }\n"));
    }

    #[test]
    fn more_room_is_offered_where_all_deadlines_are_met() {
        let activities = "  activity eye { affinity = 1 priority = 1 period = 100 }
  activity brain { affinity = 1 priority = 2 period = 200 }\n";
        expect![[r#"
            Order priorities by deadline: eye ✓ 24 → 4 / 100 ms, 2 of 2 met
              activity eye { affinity = 1 priority = 2 period = 100 }
              activity brain { affinity = 1 priority = 1 period = 200 }
            }
            Balance the slack: 2 of 2 met
              activity eye { affinity = 1 priority = 2 period = 100 }
              activity brain { affinity = 1 priority = 1 period = 200 }
            }
            Shorten all periods: 2 of 2 met
              activity eye { affinity = 1 priority = 1 period = 25 }
              activity brain { affinity = 1 priority = 2 period = 24 }
            }
        "#]]
        .assert_eq(&offered(activities));
    }
}
