//! The threads in a file of `[platform] threads`, with the activities that they execute: for hints, hovers and code actions there.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, File, ModelDb, Project, names_of};
use mauve_syntax::TextRange;
use mauve_wcrt::{declared_threads, system_of, thread_files, threads_in};

use crate::occurrences::range_of;

/// Returns the deployments that may have the threads of a file, each with its project.
pub fn deployments_with_threads<'db>(
    db: &'db dyn ModelDb,
    projects: &[Project<'db>],
    file: File,
) -> Vec<(Project<'db>, Decl<'db>)> {
    let has_it = |it: &&Project<'db>| thread_files(db, it.workspace(db)).files.contains(&file);
    let deployments = |&project: &Project<'db>| {
        names_of(db, project).of_kind(db, Kind::Deployment).map(move |it| (project, it))
    };
    projects.iter().filter(has_it).flat_map(deployments).collect()
}

/// Returns the activities of a deployment whose threads are in a file: the index of each, and the ranges of the entry of its thread and of
/// the id there.
pub(crate) fn activities_with_threads<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    file: File,
) -> Vec<(usize, [TextRange; 2])> {
    let workspace = project.workspace(db);
    if !thread_files(db, workspace).files.contains(&file) {
        return Vec::new();
    }
    let (declared, read) = (declared_threads(db, workspace), threads_in(db, file));
    let activities = system_of(db, project, deployment).activities.iter().enumerate();
    let in_file = activities.filter_map(|(index, activity)| {
        let thread = declared.all.get(activity.declared_thread?.0).filter(|it| it.file == file)?;
        Some((index, read.ranges(thread.place)?.map(range_of)))
    });
    in_file.collect()
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use mauve_syntax::TextSize;

    use crate::code_actions::{ActionKind, ActionQuestion, Changes, code_actions};
    use crate::document_links::document_links;
    use crate::fixture::{Fixture, project_with};
    use crate::inlay_hints::{EarlierFigures, HintOptions, table_hints};
    use crate::project::projects_with;
    use mauve_diagnostics::figure::HintStatus;
    use mauve_hir::Database;
    use mauve_syntax::TextRange;
    use salsa::Durability;

    use super::deployments_with_threads;

    const ROBOT: &str = "codel see(): int
codel plan(): int
shell S { }
core See(S) { update = { see(); } }
core Plan(S) { update = { plan(); } }
component Eye(S, See)
component Planner(S, Plan)
architecture A { instance eye: Eye  instance planner: Planner  instance slow: Planner }
deployment D {
  architecture A
  activity eye { thread = \"/eye@Timer(10000000)\"  period = 10 }
  activity planner { thread = \"/planner@Timer(100000000)\"  order = any  period = 100 }
  activity slow { thread = \"/planner@Timer(200000000)\"  order = any  period = 200 }
}
//- /mauve.toml
timing.tables = [\"t.toml\"]
platform = { cpus = 2, threads = [\"threads.yaml\"], rt_throttling = false }
//- /t.toml
[codel]
see = 4
plan = 7
//- /threads.yaml
# é
callback_groups:
  - id: /eye@Timer(10000000) # fast
    policy: SCHED_FIFO$0
    priority: 20
    affinity: [0]
  - {id: /planner@Timer(100000000)@Timer(200000000), policy: SCHED_FIFO, priority: 90, affinity: [0]}
  - {id: /log@Service(/x), policy: SCHED_OTHER, nice: 0}
";

    #[test]
    fn hints_and_hovers_stand_beside_the_groups() {
        let Fixture { db, workspace, file, .. } = &Fixture::new(ROBOT);
        let project = project_with(db, *workspace, *file).unwrap();
        let earlier = &EarlierFigures::default();
        let text = file.text(db);
        let all = TextRange::up_to(TextSize::of(&**text));
        let (hints, _) = table_hints(db, &[project], *file, all, HintOptions::default(), earlier, None);
        let shown: Vec<_> = hints
            .iter()
            .map(|it| (text[..usize::from(it.offset)].lines().last().unwrap().trim(), it.label.as_str()))
            .collect();
        let group = "- {id: /planner@Timer(100000000)@Timer(200000000), policy: SCHED_FIFO, priority: 90, affinity: [0]}";
        assert_eq!(
            shown,
            [
                ("- id: /eye@Timer(10000000) # fast", "✗ 18 / 10 ms"),
                (group, "planner: ✓ 14 / 100 ms"),
                (group, "slow: ✓ 14 / 200 ms"),
            ]
        );
        let hover = Fixture::new(ROBOT).hover().unwrap().markdown;
        assert!(hover.contains("18") && hover.contains("planner"), "{hover}");
        assert!(Fixture::new(&ROBOT.replace("$0", "").replace("/log", "$0/log")).hover().is_none());
    }

    #[test]
    fn the_last_figures_stay_while_a_value_is_missing() {
        let Fixture { mut db, workspace, file, .. } = Fixture::new(ROBOT);
        let options = HintOptions::default();
        let figures = |db: &Database, earlier: &EarlierFigures| {
            let projects = projects_with(db, &[workspace], file);
            let deployments = deployments_with_threads(db, &projects, file);
            earlier.updated(db, &[], &deployments, options, false)
        };
        let known = figures(&db, &EarlierFigures::default());
        let text = file.text(&db).replacen("priority: 20", "priority: ", 1);
        file.set_text_with(&mut db, text.as_str().into(), Durability::LOW);
        let earlier = figures(&db, &known);
        let project = project_with(&db, workspace, file).unwrap();
        let all = TextRange::up_to(TextSize::of(text.as_str()));
        let (hints, _) = table_hints(&db, &[project], file, all, options, &earlier, None);
        let shown: Vec<_> = hints.iter().map(|it| (it.label.as_str(), it.status)).collect();
        assert_eq!(shown[0], ("… 18 / 10 ms", HintStatus::Older), "{shown:?}");
        assert_eq!(shown.len(), 3);
    }

    #[test]
    fn actions_change_the_file() {
        let Fixture { db, workspace, file, offset } = &Fixture::new(ROBOT);
        let project = project_with(db, *workspace, *file);
        let range = TextRange::empty(*offset);
        let kinds = &[ActionKind::Rewrite, ActionKind::QuickFix];
        let question = ActionQuestion { file: *file, range, diagnostics: &[], kinds, changes: Changes::All };
        let actions = code_actions(db, &[*workspace], project, question);
        let titles: Vec<_> = actions.iter().map(|it| it.title.as_str()).collect();
        let swap = actions
            .iter()
            .find(|it| it.title.starts_with("Move eye"))
            .unwrap_or_else(|| panic!("{titles:?}"));
        let edited = swap.change.as_ref().unwrap().applied(db, *file);
        assert_eq!(edited, file.text(db).replacen("affinity: [0]", "affinity: [1]", 1), "{titles:?}");
    }

    #[test]
    fn the_id_leads_to_its_entry() {
        let Fixture { db, workspace, file, .. } = &Fixture::new(ROBOT);
        let model = workspace.file(db, "/model.mal".as_ref()).unwrap();
        let project = project_with(db, *workspace, model);
        let links = document_links(db, *workspace, project, model);
        assert_eq!(links.len(), 3);
        assert!(links.iter().all(|it| it.target == *file));
        let at = usize::from(links[0].at.unwrap());
        assert!(file.text(db)[at..].starts_with("/eye@Timer(10000000) # fast"));
        assert_eq!(&model.text(db)[Range::<usize>::from(links[1].range)], "/planner@Timer(100000000)");
    }
}
