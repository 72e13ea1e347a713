//! The models above the grammar's rules, each against the tree that it should give (`test_data/<name>.txt`).

use std::fs;
use std::path::Path;

use expect_test::expect_file;

#[test]
fn the_models_above_the_rules_give_their_trees() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut models = models_of(&root.join("src/grammar.rs"));
    for entry in fs::read_dir(root.join("src/grammar")).unwrap() {
        models.extend(models_of(&entry.unwrap().path()));
    }
    assert!(models.len() > 15, "the comments were not found");
    for Model { name, fails, text } in &models {
        let parse = mauve_syntax::parse(text);
        let mut dump = parse.debug_dump();
        for error in parse.errors() {
            dump += &format!("error {:?}: {:?}\n", error.range, error.kind);
        }
        assert_eq!(!parse.errors().is_empty(), *fails, "{name}:\n{text}\n{dump}");
        expect_file![root.join("test_data").join(format!("{name}.txt"))]
            .assert_eq(&format!("{text}\n{dump}"));
    }
    let kept = fs::read_dir(root.join("test_data")).unwrap().count();
    assert_eq!(kept, models.len(), "test_data/ has files that no rule's comment names");
}

struct Model {
    name: String,
    fails: bool,
    text: String,
}

/// The comments that begin with `// test NAME` or `// test_err NAME`.
fn models_of(path: &Path) -> Vec<Model> {
    let mut found: Vec<Model> = Vec::new();
    let mut open = false;
    for line in fs::read_to_string(path).unwrap().lines() {
        let Some(comment) = line.strip_prefix("// ") else {
            open = false;
            continue;
        };
        let named = comment.strip_prefix("test ").map(|name| (name, false));
        if let Some((name, fails)) = named.or(comment.strip_prefix("test_err ").map(|name| (name, true))) {
            found.push(Model { name: name.to_owned(), fails, text: String::new() });
            open = true;
        } else if let Some(model) = found.last_mut().filter(|_| open) {
            model.text += comment;
            model.text.push('\n');
        }
    }
    found
}
