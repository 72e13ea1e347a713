//! The reference of generated code (`tests/spec/generated-code.md`): what it shows stands in the packages of its first model.

use mauve_hir::{Database, Workspace, projects};

/// The languages of the excerpts that are looked for.
const CHECKED: [&str; 2] = ["cpp", "json"];

#[test]
fn excerpts_are_generated() {
    let page = mauve_tests::models().join("../spec/generated-code.md");
    let page = std::fs::read_to_string(page).unwrap();
    let blocks: Vec<&str> = page.split("```").skip(1).step_by(2).collect();
    let of = |language: &str| -> Vec<&str> {
        blocks.iter().filter_map(|block| block.strip_prefix(language)?.strip_prefix('\n')).collect()
    };
    let db = Database::default();
    let texts = mauve_tests::fixture(of("mauve")[0]).into_iter().map(|(path, text)| (path.into(), text));
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let [project] = projects(&db, workspace)[..] else { panic!("one project") };
    let packages = mauve_orocos::packages(&db, project, None).unwrap();
    let without = |line: &str| line.trim().trim_end_matches(',').to_owned();
    let lines = packages.iter().flat_map(|package| &package.files).flat_map(|file| file.text.lines());
    let known: Vec<String> = lines.map(without).collect();
    for language in CHECKED {
        let excerpts = of(language);
        assert!(!excerpts.is_empty(), "{language}");
        for line in excerpts.iter().flat_map(|block| block.lines()).filter(|line| !line.trim().is_empty()) {
            assert!(known.contains(&without(line)), "nothing generated has this line:\n{line}");
        }
    }
}
