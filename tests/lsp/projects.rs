//! Files of several projects: which of them answers, and how the others are named.

use std::path::Path;

use mauve_tests::{Client, Text, write};
use serde_json::{Value, json};

use super::start;

const ARM: &str = "library arm {
  codel lift(): int
  shell Arm { }
  core Arm(Arm) { update = { lift(); } }
  component Arm(Arm, Arm)
}
";

/// Two robots in one folder, with the arm in a folder of its own: a workspace with another time.
fn two_robots(name: &str) -> std::path::PathBuf {
    let folder = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), name);
    let robot = |name: &str| {
        format!(
            "include \"arm/arm.mal\"\ninclude \"shared.mal\"\ncodel {name}(): int\nshell {name} extends Base {{ }}\n"
        )
    };
    let (one, two) = (robot("one"), robot("two"));
    write(
        &folder,
        &[
            ("one.mal", &one),
            ("two.mal", &two),
            ("shared.mal", "shell Base { }\n"),
            ("mauve.toml", "project.roots = [\"one.mal\", \"two.mal\"]\ntiming.tables = \"times.toml\"\n"),
            ("times.toml", "[codel]\none = 10\ntwo = 20\n\"arm.lift\" = 30\n"),
            ("arm/arm.mal", ARM),
            ("arm/mauve.toml", "timing.tables = \"times.toml\"\n"),
            ("arm/times.toml", "codel.\"arm.lift\" = 40\n"),
        ],
    );
    folder
}

fn open(folder: &Path) -> Client {
    let tokens =
        json!({"requests": {"full": true}, "tokenTypes": ["function"], "tokenModifiers": [], "formats": []});
    let capabilities = json!({
        "textDocument": {"hover": {"contentFormat": ["markdown"]}, "semanticTokens": tokens},
        "experimental": {"commands": ["mauve.showReferences"]},
    });
    start(folder, &capabilities).0
}

fn lenses(client: &mut Client, text: &Text) -> Vec<(String, Value)> {
    let found = client.call("textDocument/codeLens", json!({"textDocument": {"uri": text.uri}})).unwrap();
    let lenses = found.as_array().unwrap().iter().map(|lens| &lens["command"]);
    lenses.map(|it| (it["title"].as_str().unwrap().to_owned(), it["arguments"].clone())).collect()
}

fn hover(client: &mut Client, text: &Text, at: &str) -> String {
    let found = client.call("textDocument/hover", text.at(at)).unwrap();
    found["contents"]["value"].as_str().unwrap_or_default().to_owned()
}

#[test]
fn the_nearest_configuration_answers_and_a_lens_names_the_other_projects() {
    let folder = two_robots("lsp_projects_nearest");
    let mut client = open(&folder);
    let arm = client.open_file(&folder.join("arm/arm.mal"));
    // The arm's own table has another time than the table of the robots.
    assert!(client.hint(&arm, "core Arm").contains("40 ms"));
    let shown = hover(&mut client, &arm, "lift(): int");
    assert!(shown.contains("40 ms at") && !shown.contains("30 ms"), "{shown}");
    assert!(shown.ends_with("Project `arm.mal`, also in `one.mal`, `two.mal`\n"), "{shown}");
    // A word of the language means the same in all of them.
    let word = hover(&mut client, &arm, "update");
    assert!(!word.is_empty() && !word.contains("Project"), "{word}");
    let (title, arguments) = lenses(&mut client, &arm).remove(0);
    assert_eq!(title, "Project arm.mal, also in one.mal, two.mal");
    let shown = |path: &str| json!(mauve_tests::address(&folder.join(path)));
    let uris: Vec<&Value> = arguments[2].as_array().unwrap().iter().map(|it| &it["uri"]).collect();
    assert_eq!(uris, [&shown("one.mal"), &shown("two.mal")]);
    // Of one folder, the first root answers.
    let shared = client.open_file(&folder.join("shared.mal"));
    assert_eq!(lenses(&mut client, &shared)[0].0, "Project one.mal, also in two.mal");
    // A file of one project has no such lens.
    let one = client.open_file(&folder.join("one.mal"));
    let shown = hover(&mut client, &one, "one(): int");
    assert!(!shown.is_empty() && !shown.contains("Project"), "{shown}");
    assert!(!lenses(&mut client, &one).iter().any(|(title, _)| title.starts_with("Project")));
    // References are those of all projects.
    let params = arm.at("lift(): int");
    let params = json!({
        "textDocument": params["textDocument"], "position": params["position"],
        "context": {"includeDeclaration": false},
    });
    let found = client.call("textDocument/references", params).unwrap();
    let uris = found.as_array().unwrap().iter().map(|it| it["uri"].as_str().unwrap());
    let names: Vec<&str> =
        uris.map(|uri| uri.strip_prefix(&mauve_tests::address(&folder)).unwrap()).collect();
    assert_eq!(names, ["/arm/arm.mal", "/arm/times.toml", "/times.toml"]);
}

#[test]
fn a_root_that_another_root_includes_answers_for_itself() {
    let folder = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_projects_root");
    write(
        &folder,
        &[
            ("all.mal", "include \"base.mal\"\n"),
            ("base.mal", "shell Base { }\n"),
            ("mauve.toml", "project.roots = [\"all.mal\", \"base.mal\"]\n"),
        ],
    );
    let mut client = open(&folder);
    let base = client.open_file(&folder.join("base.mal"));
    assert_eq!(lenses(&mut client, &base)[0].0, "Project base.mal, also in all.mal");
}

#[test]
fn in_a_table_the_project_that_knows_the_name_answers() {
    let folder = two_robots("lsp_projects_table");
    let mut client = open(&folder);
    let table = client.open_file(&folder.join("times.toml"));
    for (key, file) in [("one = 10", "one.mal"), ("two = 20", "two.mal")] {
        let found = client.call("textDocument/definition", table.at(key)).unwrap();
        assert!(found.to_string().contains(&mauve_tests::address(&folder.join(file))), "{key}: {found}");
        let shown = hover(&mut client, &table, key);
        assert!(shown.contains(&format!("codel {}", &key[..3])), "{key}: {shown}");
    }
    // The tables have no levels, so that any can be shown.
    assert_eq!(client.call("mauve/status", Value::Null).unwrap()["levels"], json!([]));
    // All names have colours.
    let tokens = json!({"textDocument": {"uri": table.uri}});
    let found = client.call("textDocument/semanticTokens/full", tokens).unwrap();
    assert_eq!(found["data"].as_array().map(Vec::len), Some(3 * 5), "{found}");
}

#[test]
fn a_hierarchy_stays_in_the_project_in_which_it_begins() {
    let folder = two_robots("lsp_projects_hierarchy");
    let mut client = open(&folder);
    let below = |client: &mut Client, path: &str, at: &str| -> Vec<String> {
        let text = client.open_file(&folder.join(path));
        let items = client.call("textDocument/prepareTypeHierarchy", text.at(at)).unwrap();
        let found = client.call("typeHierarchy/subtypes", json!({"item": items[0]})).unwrap();
        let name = |it: &Value| {
            let uri = it["uri"].as_str().unwrap();
            format!("{} of {}", it["name"].as_str().unwrap(), Path::new(uri).file_name().unwrap().display())
        };
        found.as_array().unwrap().iter().map(name).collect()
    };
    assert_eq!(below(&mut client, "two.mal", "Base {"), ["two of two.mal"]);
    assert_eq!(below(&mut client, "one.mal", "Base {"), ["one of one.mal"]);
    assert_eq!(below(&mut client, "shared.mal", "Base {"), ["one of one.mal"]);
}
