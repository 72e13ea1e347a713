//! The models on the pages of the diagnostics: each marked line has the diagnostic, and no other line has.

use std::path::PathBuf;

use mauve_diagnostics::{codes, page, workspace_diagnostics};
use mauve_hir::{Database, Workspace};

#[test]
fn the_models_of_the_pages_have_what_their_marks_say() {
    for code in codes() {
        let page = page(code.name).unwrap();
        assert!(
            page.starts_with(&format!("# {}\n", code.name)),
            "the page of {} has another title",
            code.name
        );
        let models: Vec<&str> =
            page.split("```mauve\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
        assert!(
            !models.is_empty() || ["unreadable-file", "too-large"].contains(&code.name),
            "{} has no example",
            code.name
        );
        for model in models {
            let mut expected = Vec::new();
            let files = mauve_tests::fixture(model);
            for (path, text) in &files {
                for (line, content) in text.lines().enumerate() {
                    let mark = format!(" {}", code.severity.name());
                    if content.ends_with(&format!("//{mark}")) || content.ends_with(&format!("#{mark}")) {
                        expected.push((path.clone(), line + 1));
                    }
                }
            }
            assert!(!expected.is_empty(), "{}: no line is marked", code.name);
            let found = lines_with(code.name, files);
            assert_eq!(found, expected, "{}:\n{model}", code.name);
        }
    }
}

fn lines_with(code: &str, files: Vec<(String, String)>) -> Vec<(String, usize)> {
    let db = Database::default();
    let texts = files.into_iter().map(|(path, text)| (PathBuf::from(path), text));
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let mut found: Vec<(String, usize)> = Vec::new();
    for finding in workspace_diagnostics(&db, workspace) {
        let diagnostic = finding.diagnostic;
        if diagnostic.code.name == code {
            let file = diagnostic.at.file(&db);
            let start: usize = diagnostic.at.range(&db).start().into();
            let line = file.text(&db)[..start].lines().count().max(1);
            let line = if file.text(&db)[..start].ends_with('\n') { line + 1 } else { line };
            found.push((file.path(&db).display().to_string(), line));
        }
    }
    found.sort_by_key(|(path, line)| (path != "/model.mal", path.clone(), *line));
    found.dedup();
    found
}
