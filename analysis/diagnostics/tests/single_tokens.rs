//! One mistake gives one message: each token of a complete model is deleted, and duplicated. The text then has at most one
//! error or warning, and no deletion that is noticed gives an activity a shorter response time.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use mauve_diagnostics::{Severity, workspace_diagnostics};
use mauve_hir::{Database, Workspace};
use mauve_syntax::lex;
use mauve_tests::search;
use mauve_timing::{Method, Time};
use mauve_wcrt::{Query, response_times};

use crate::common::{LEVEL, deployments, sample};

#[test]
fn in_the_project_of_mauve_new() {
    let files = [
        ("mauve.toml", include_str!("../../../server/cli/src/new/mauve.toml")),
        ("robot.mal", include_str!("../../../server/cli/src/new/robot.mal")),
        ("timing.toml", include_str!("../../../server/cli/src/new/timing.toml")),
    ];
    let files = files.map(|(path, text)| (Path::new("/").join(path), text.to_owned()));
    let several = with_several_messages(Path::new("/"), &files, 1);
    let count = several.lines().filter(|line| !line.starts_with(' ')).count();
    // Without `out` or its name, the parameter of `scan` is an input: a variable has no value, and a chain loses its data.
    assert!(count <= 2 && count == several.matches("robot.mal:10: ").count(), "{several}");
}

#[test]
fn in_the_sample_robot() {
    let several = with_several_messages(&mauve_tests::models().join("p3dx"), &sample(), 5);
    let count = several.lines().filter(|line| !line.starts_with(' ')).count();
    // This bound may only shrink.
    assert!(count <= 7, "{count} tokens with several messages:\n{several}");
}

/// Returns the deletions and duplications of a token of the models after which there are several errors and warnings, with
/// their messages. Only every `step`th token is changed.
fn with_several_messages(folder: &Path, texts: &[(PathBuf, String)], step: usize) -> String {
    let mut db = Database::default();
    let workspace = Workspace::of_texts(&db, folder.to_owned(), texts.iter().cloned());
    assert_eq!(messages(&db, workspace), Vec::<String>::new());
    let complete = proved(&db, workspace);
    assert!(!complete.is_empty());
    let mut out = String::new();
    for (path, text) in texts.iter().filter(|(path, _)| path.extension().is_some_and(|it| it == "mal")) {
        let file = workspace.file(&db, path).unwrap();
        let tokens = lex(text);
        for index in (0..tokens.len())
            .filter(|&index| !tokens.kind(index).is_trivia())
            .step_by(step)
            .filter(|index| search::is_searched(index / step))
        {
            let range = tokens.range(index);
            let (before, token, after) = (&text[..range.start], &text[range.clone()], &text[range.end..]);
            let line = before.matches('\n').count() + 1;
            for (what, changed) in [
                ("deleted", format!("{before}{after}")),
                ("duplicated", format!("{before}{token} {token}{after}")),
            ] {
                file.set_text(&mut db, changed.as_str().into());
                let found = messages(&db, workspace);
                let what = format!("{}:{line}: {token:?} {what}", path.display());
                if found.len() > 1 {
                    let _ = writeln!(out, "{what}\n  {}", found.join("\n  "));
                }
                for (activity, response) in proved(&db, workspace).into_iter().filter(|_| !found.is_empty()) {
                    let old = complete.get(&activity).copied();
                    assert!(
                        old.is_none_or(|old| response >= old),
                        "{what}: {activity}: {old:?}, {response:?}"
                    );
                }
            }
        }
        file.set_text(&mut db, text.as_str().into());
    }
    out
}

/// Returns the errors and warnings.
fn messages(db: &Database, workspace: Workspace) -> Vec<String> {
    let found = workspace_diagnostics(db, workspace);
    let shown = found.iter().filter(|finding| finding.severity != Severity::Hint);
    shown.map(|it| format!("{}: {}", it.diagnostic.code.name, it.diagnostic.message)).collect()
}

/// Returns the response times of the activities that meet their deadlines.
fn proved(db: &Database, workspace: Workspace) -> BTreeMap<String, Time> {
    let query = Query { level: LEVEL, method: Method::Psm };
    let mut proved = BTreeMap::new();
    for (project, deployment) in deployments(db, workspace) {
        for activity in &response_times(db, project, deployment, query).activities {
            let response = activity.response.filter(|_| activity.verdict.name() == "met");
            proved.extend(response.map(|response| (activity.instance.to_string(), response)));
        }
    }
    proved
}
