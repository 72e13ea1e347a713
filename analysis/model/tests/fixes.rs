//! Every fix that is offered for the models on the pages mends what it is offered for, and breaks nothing.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

use std::collections::BTreeMap;
use std::path::PathBuf;

use mauve_model::diagnostics::{Finding, Fix, Severity, codes, page, workspace_diagnostics};
use mauve_model::{Database, Workspace};

type Texts = BTreeMap<PathBuf, String>;

#[test]
fn a_fix_mends_what_it_is_offered_for_and_breaks_nothing() {
    let mut offered: BTreeMap<&str, usize> = BTreeMap::new();
    for code in codes() {
        let page = page(code.name).unwrap();
        for model in page.split("```mauve\n").skip(1).map(|rest| rest.split("```").next().unwrap()) {
            let texts: Texts =
                mauve_tests::fixture(model).into_iter().map(|(path, text)| (path.into(), text)).collect();
            let db = Database::default();
            let findings = found(&db, &texts);
            for finding in findings.iter().filter(|finding| finding.diagnostic.code.name == code.name) {
                for fix in &finding.diagnostic.fixes {
                    *offered.entry(code.name).or_default() += 1;
                    let fixed = applied(&db, &texts, fix);
                    let fixed_db = Database::default();
                    let after = found(&fixed_db, &fixed);
                    let count = |all: &[Finding<'_>]| {
                        all.iter().filter(|it| it.diagnostic.code.name == code.name).count()
                    };
                    let what = format!("{}: {}\n{model}\n{fixed:#?}\n{after:#?}", code.name, fix.title);
                    assert!(count(&after) < count(&findings), "it is still there: {what}");
                    let errors =
                        |all: &[Finding<'_>]| all.iter().filter(|it| it.severity == Severity::Error).count();
                    assert!(errors(&after) <= errors(&findings), "there are more errors: {what}");
                }
            }
        }
    }
    assert!(offered.len() >= 20, "codes with fixes: {offered:?}");
}

fn found<'db>(db: &'db Database, texts: &Texts) -> Vec<Finding<'db>> {
    let workspace = Workspace::of_texts(db, "/".into(), texts.clone());
    workspace_diagnostics(db, workspace)
}

fn applied(db: &Database, texts: &Texts, fix: &Fix<'_>) -> Texts {
    let mut texts = texts.clone();
    let mut edits: Vec<_> =
        fix.edits.iter().map(|(at, text)| (at.file(db).path(db).clone(), at.range(db), text)).collect();
    edits.sort_by_key(|(path, range, _)| (path.clone(), std::cmp::Reverse(range.start())));
    for (path, range, text) in edits {
        texts.get_mut(&path).unwrap().replace_range(std::ops::Range::<usize>::from(range), text);
    }
    texts
}
