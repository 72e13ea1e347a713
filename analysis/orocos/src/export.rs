//! What the analysis reads of a model, as files of a package: `models/<Component>.psm.json`, a state machine with its times,
//! and `models/<Deployment>.json`, a task set. `mauve wcrt` computes the same response times from it as from the model;
//! [`mauve_timing::task_set`] defines the format.

use mauve_diagnostics::PROSE;
use mauve_timing::task_set::Exported;
use mauve_wcrt::{exported_component, first_tables, task_set_of};

use crate::cpp_name::file_name;
use crate::generated_file::GeneratedFile;
use crate::library::Model;

/// Returns the exported analyses of a package, at all levels of the timing tables.
pub(crate) fn export_files(model: Model<'_, '_>) -> Vec<GeneratedFile> {
    let Model { db, project, library, .. } = model;
    let components = library.components.iter().map(|&(component, _)| {
        db.unwind_if_revision_cancelled();
        // A component belongs to no deployment.
        let tables = first_tables(db, project, component);
        let content = Exported::Component(exported_component(db, tables, component, &PROSE));
        (format!("models/{}.psm.json", file_name(component.name(db))), content)
    });
    let deployments = library.deployments.iter().map(|&deployment| {
        db.unwind_if_revision_cancelled();
        let content = Exported::Deployment(task_set_of(db, project, deployment, &PROSE));
        (format!("models/{}.json", file_name(deployment.name(db))), content)
    });
    let contents = components.chain(deployments);
    contents.map(|(path, content)| GeneratedFile::generated(path, content.to_json())).collect()
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};
    use mauve_hir::{Database, Workspace, projects};

    use super::*;
    use crate::packages;

    /// The exported files of the only package of a project.
    fn check(fixture: &str, expected: Expect) {
        let db = Database::default();
        let texts = mauve_tests::fixture(fixture).into_iter().map(|(path, text)| (path.into(), text));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let [project] = projects(&db, workspace)[..] else { panic!("one project") };
        let packages = packages(&db, project, None).unwrap();
        let files = packages
            .iter()
            .flat_map(|package| &package.files)
            .filter(|file| file.path.starts_with("models/"));
        let shown: String = files
            .map(|file| {
                assert_eq!(Exported::parse(&file.text).unwrap().content.to_json(), file.text);
                format!("//- {}\n{}", file.path, file.text)
            })
            .collect();
        expected.assert_eq(&shown);
    }

    #[test]
    fn a_machine_and_the_task_set_that_runs_it() {
        check(
            r#"
codel look(): int
codel turn(): int
shell S { }
core K(S) {
  statemachine {
    initial state Idle { run = { look(); } transition go if look() > 0 to Busy }
    state Busy { entry = { turn(); } transition back to Idle }
  }
}
component C(S, K)
architecture A { instance front: C  instance rear: C }
deployment D {
  architecture A
  activity front { affinity = 1 priority = 2 period = 100 deadline = 50.5 }
  activity rear { priority = background }
}
//- /mauve.toml
timing = { tables = "times.toml", significance = 1e-6 }
platform = { cpus = 2, rt_throttling = false }
//- /times.toml
levels = [1e-3, 1e-6]
codel = { look = [1.25, 2], turn = 7 }
overhead.dispatch = 0.001
component.C = [9, 12]
"#,
            expect![[r#"
                //- models/C.psm.json
                {
                  "format": "mauve-3",
                  "unit": "ns",
                  "digest": "3b9bed266d365c25",
                  "component": {
                    "name": "C",
                    "levels": [0.001, 1e-6],
                    "not_analysed": [],
                    "machine": {
                      "states": [
                        { "state": "Idle", "first": ["Idle.run", "Idle.go.guard"] },
                        { "state": "Busy", "first": [] }
                      ],
                      "initial": "Idle",
                      "overhead": [1000, 1000],
                      "component_time": [9000000, 12000000],
                      "assumed": [],
                      "programs": [
                        { "program": "Idle.run", "time": [1250000, 2000000] },
                        { "program": "Idle.go.guard", "time": [1250000, 2000000] },
                        { "program": "Busy.entry", "time": [7000000, 7000000] }
                      ],
                      "edges": [
                        { "source": "Idle", "target": "Busy", "transition": "go", "first": 2, "then": ["Busy.entry"], "cost": [9501000, 11001000] },
                        { "source": "Idle", "target": "Idle", "transition": null, "first": 2, "then": [], "cost": [2501000, 4001000] },
                        { "source": "Busy", "target": "Idle", "transition": "back", "first": 0, "then": [], "cost": [1000, 1000] }
                      ]
                    }
                  }
                }
                //- models/D.json
                {
                  "format": "mauve-3",
                  "unit": "ns",
                  "digest": "e3148346e9f14fda",
                  "deployment": {
                    "name": "D",
                    "levels": [0.001, 1e-6],
                    "significance": 1e-6,
                    "cpus": 3,
                    "rt_throttling": false,
                    "not_analysed": [],
                    "other": [],
                    "operations": [],
                    "activities": [
                      {
                        "instance": "front",
                        "component": "C",
                        "affinity": 1,
                        "priority": 2,
                        "period": 100000000,
                        "deadline": 50500000,
                        "jitter": 0,
                        "offset": null,
                        "not_analysed": [],
                        "doubt": null,
                        "machine": {
                          "states": [
                            { "state": "Idle", "first": ["Idle.run", "Idle.go.guard"] },
                            { "state": "Busy", "first": [] }
                          ],
                          "initial": "Idle",
                          "overhead": [1000, 1000],
                          "component_time": [9000000, 12000000],
                          "assumed": [],
                          "programs": [
                            { "program": "Idle.run", "time": [1250000, 2000000] },
                            { "program": "Idle.go.guard", "time": [1250000, 2000000] },
                            { "program": "Busy.entry", "time": [7000000, 7000000] }
                          ],
                          "edges": [
                            { "source": "Idle", "target": "Busy", "transition": "go", "first": 2, "then": ["Busy.entry"], "cost": [9501000, 11001000] },
                            { "source": "Idle", "target": "Idle", "transition": null, "first": 2, "then": [], "cost": [2501000, 4001000] },
                            { "source": "Busy", "target": "Idle", "transition": "back", "first": 0, "then": [], "cost": [1000, 1000] }
                          ]
                        }
                      },
                      {
                        "instance": "rear",
                        "component": "C",
                        "affinity": 3,
                        "priority": "background",
                        "period": null,
                        "deadline": null,
                        "jitter": 0,
                        "offset": null,
                        "not_analysed": [],
                        "doubt": null,
                        "machine": null
                      }
                    ]
                  }
                }
            "#]],
        );
    }

    #[test]
    fn what_is_not_analysed_is_there_with_its_reason() {
        check(
            r#"
codel look(): int
shell S { }
core K(S) { update = { look(); } }
component C(S, K)
architecture A { instance front: C }
deployment D { architecture A  activity front { affinity = 3 priority = 2 period = 100 } }
"#,
            expect![[r#"
                //- models/C.psm.json
                {
                  "format": "mauve-3",
                  "unit": "ns",
                  "digest": "d8938a41a3f92a04",
                  "component": {
                    "name": "C",
                    "levels": [0.0001],
                    "not_analysed": [
                      { "reason": "no time for codel `look`", "levels": null, "classic_only": false }
                    ],
                    "machine": null
                  }
                }
                //- models/D.json
                {
                  "format": "mauve-3",
                  "unit": "ns",
                  "digest": "4f381af8e340bd6f",
                  "deployment": {
                    "name": "D",
                    "levels": [0.0001],
                    "significance": 0.0001,
                    "cpus": 3,
                    "rt_throttling": null,
                    "not_analysed": [],
                    "other": [],
                    "operations": [],
                    "activities": [
                      {
                        "instance": "front",
                        "component": "C",
                        "affinity": 3,
                        "priority": 2,
                        "period": 100000000,
                        "deadline": 100000000,
                        "jitter": 0,
                        "offset": null,
                        "not_analysed": [
                          { "reason": "no time for codel `look`", "levels": null, "classic_only": false }
                        ],
                        "doubt": null,
                        "machine": null
                      }
                    ]
                  }
                }
            "#]],
        );
    }
}
