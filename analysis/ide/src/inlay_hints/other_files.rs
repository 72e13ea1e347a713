//! Hints of activities in other files than models: beside the gateways that a `mauve.toml` declares, and beside the threads in a file of
//! `[platform] threads`.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, File, ModelDb, Project, config_file, names_of};
use mauve_syntax::TextRange;
use mauve_wcrt::system_of;

use super::deployment::activity_hints;
use super::earlier::{EarlierFigures, FigureOwner};
use super::figures::with_earlier;
use super::{HintOf, HintOptions, HintSubject, end_of_line};
use crate::threads::activities_with_threads;

/// Returns the hints of activities in other files than models: of the gateways that a `mauve.toml` declares, and of threads in a file
/// of `[platform] threads`.
pub(super) fn in_other_file(
    db: &dyn ModelDb,
    projects: &[Project<'_>],
    file: File,
    options: HintOptions,
    earlier: &EarlierFigures,
) -> Vec<HintOf> {
    let (text, mut found) = (file.text(db), Vec::new());
    for &project in projects.iter().filter(|_| options.response_times) {
        let deployments = names_of(db, project).of_kind(db, Kind::Deployment);
        let here = deployments.map(|it| (it, activities_in(db, project, it, file)));
        let here: Vec<(Decl<'_>, Vec<(usize, TextRange)>)> = here.filter(|(_, of)| !of.is_empty()).collect();
        for (deployment, activities) in &here {
            let shown = activity_hints(db, project, *deployment, options.tight_slack);
            let last = earlier.of(&FigureOwner::of(db, project, *deployment));
            let system = &system_of(db, project, *deployment).activities;
            for &(index, at) in activities {
                let (Some(shown), Some(activity)) = (shown.get(index), system.get(index)) else { continue };
                let subject = HintSubject::Activity(activity.instance.clone());
                let shown = shown.clone().at(text, end_of_line(text, at.end()), subject, at.start());
                let deployment = deployment.name(db).as_str();
                let name = match activity.gateway {
                    // With hosts, `D@left` and `D@right`.
                    Some(_) => Some(activity.instance.replacen("ros2", deployment, 1)),
                    None => (here.len() > 1).then(|| format!("{deployment}.{}", activity.instance)),
                };
                let subject = name.map(|it| HintSubject::Activity(it.into()));
                found.extend(
                    with_earlier(shown, last)
                        .into_iter()
                        .map(|of| HintOf { subject: subject.clone().or(of.subject), ..of }),
                );
            }
        }
    }
    found
}

/// Returns the activities of a deployment that are in this file, with their places: of gateways, and of threads.
fn activities_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    file: File,
) -> Vec<(usize, TextRange)> {
    if config_file(db, project.workspace(db)) == Some(file) {
        let all = system_of(db, project, deployment).activities.iter().enumerate();
        return all.filter_map(|(index, it)| Some((index, it.at.range_in(db, file)?))).collect();
    }
    let all = activities_with_threads(db, project, deployment, file).into_iter();
    all.map(|(index, [_, id])| (index, id)).collect()
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use mauve_syntax::TextSize;

    use super::*;
    use crate::fixture::{Fixture, project_of};
    use crate::inlay_hints::{EarlierFigures, inlay_hints, table_hints};

    /// The offset of the gateway in `mauve.toml` is within a letter of two bytes here, for one of two comments above it.
    const ROBOT: &str = "//- /robot.mal
use std_msgs
/* éééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééé */ codel say(): String
shell S { output port state: String }
core C(S) { update = { write(state, say()); } }
component Driver(S, C)
architecture A { instance driver: Driver }
deployment D {
  architecture A
  activity driver { priority = 1  period = 100  cpus = [1] }
}
//- /mauve.toml
";

    /// Returns the hints of the model and those of `mauve.toml`, each behind its line.
    fn shown(more: &str, config: &str) -> (String, String) {
        let fixture =
            Fixture::new(&ROBOT.replace("//- /mauve.toml\n", &format!("{more}//- /mauve.toml\n{config}")));
        let (db, options) = (&fixture.db, HintOptions::default());
        let shown = |path: &str| {
            let file = fixture.workspace.file(db, path.as_ref()).unwrap();
            let (text, project) = (file.text(db), project_of(db, fixture.workspace, file));
            let all = TextRange::up_to(TextSize::of(&**text));
            let mut hints = inlay_hints(db, project, file, all, options, &EarlierFigures::default());
            hints.extend(table_hints(db, &[project], file, all, options, &EarlierFigures::default(), None).0);
            let shown = hints.iter().map(|hint| {
                let line = text[..usize::from(hint.offset)].lines().last().unwrap().trim();
                format!("{line} ⟨{}⟩\n", hint.label)
            });
            shown.collect()
        };
        (shown("/robot.mal"), shown("/mauve.toml"))
    }

    const GATEWAY: &str = "platform.rt_throttling = false\nassume.codel = \"1 ms\"\n[ros2]\n\
                           gateway = { priority = 20, period = \"5 ms\", cpus = [2] }\n";

    #[test]
    fn the_hint_of_a_gateway_is_in_its_file() {
        let expected = expect![[r#"
            core C(S) { update = { write(state, say()); } } ⟨1 ms · assumed⟩
            deployment D { ⟨2 of 2 met at 1e-4⟩
            deployment D { ⟨CPU 1 1.0 %⟩
            deployment D { ⟨CPU 2 20.0 %⟩
            activity driver { priority = 1  period = 100  cpus = [1] } ⟨✓ 1 / 100 ms · assumed⟩
        "#]];
        for comment in ["# é\n", "# éééééééééééééééééééééééééé\n"] {
            let (in_model, in_config) = shown("", &format!("{comment}{GATEWAY}"));
            expected.assert_eq(&in_model);
            assert_eq!(
                in_config,
                "gateway = { priority = 20, period = \"5 ms\", cpus = [2] } ⟨✓ 1 / 5 ms · assumed⟩\n"
            );
        }
    }

    #[test]
    fn the_gateways_of_two_deployments_have_their_names() {
        let sea = "deployment Sea { architecture A\n activity driver { priority = 1  period = 100  cpus = [2] }\n}\n";
        expect![[r#"
            gateway = { priority = 20, period = "5 ms", cpus = [2] } ⟨D: ✓ 1 / 5 ms · assumed⟩
            gateway = { priority = 20, period = "5 ms", cpus = [2] } ⟨Sea: ✓ 1 / 5 ms · assumed⟩
        "#]]
        .assert_eq(&shown(sea, GATEWAY).1);
    }
}
