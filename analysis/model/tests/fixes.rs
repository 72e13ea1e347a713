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

#[test]
fn a_sign_that_is_missing_is_written_where_it_was() {
    let models = mauve_tests::models().join("p3dx/components");
    let mut texts: Vec<String> = std::fs::read_dir(models)
        .unwrap()
        .map(|entry| std::fs::read_to_string(entry.unwrap().path()).unwrap())
        .collect();
    texts.sort();
    let (mut mended, mut same) = (0, 0);
    for text in texts {
        let tree = mauve_syntax::parse(&text);
        let tokens =
            tree.syntax().descendants_with_tokens().filter_map(mauve_syntax::NodeOrToken::into_token);
        for token in tokens.filter(|it| [";", "then", "}", ")", ":", "=", "->", "to"].contains(&it.text())) {
            let mut damaged = text.clone();
            damaged.replace_range(std::ops::Range::<usize>::from(token.text_range()), "");
            let texts: Texts = [("/model.mal".into(), damaged)].into();
            let errors =
                |texts: &Texts| mauve_syntax::parse(&texts[&PathBuf::from("/model.mal")]).errors().len();
            let db = Database::default();
            let findings = found(&db, &texts);
            let fixes = findings.iter().filter(|it| it.diagnostic.code.name == "syntax-error");
            for fix in fixes.flat_map(|it| &it.diagnostic.fixes) {
                let fixed = applied(&db, &texts, fix);
                assert!(errors(&fixed) < errors(&texts), "{}\n{texts:#?}\n{fixed:#?}", fix.title);
                mended += 1;
                let bare = |text: &str| text.split_whitespace().collect::<String>();
                same += usize::from(bare(&fixed[&PathBuf::from("/model.mal")]) == bare(&text));
            }
        }
    }
    // A brace may be missing in several places.
    assert!(mended > 250 && same * 5 > mended * 4, "{same} of {mended} as it was");
}
