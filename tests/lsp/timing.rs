//! Response times where an editor shows them: code actions, code lenses, hints and hovers, through the binary.

use std::path::Path;

use mauve_tests::{Client, Text, models, scratch, write};
use serde_json::{Value, json};

use super::start;

/// One that can do what good editors can.
fn good(folder: &Path) -> Client {
    let action = json!({
        "codeActionLiteralSupport": {"codeActionKind": {"valueSet": ["", "quickfix", "refactor"]}},
        "dataSupport": true, "resolveSupport": {"properties": ["edit"]}, "disabledSupport": true,
    });
    let capabilities = json!({
            "workspace": {"codeLens": {"refreshSupport": true}, "inlayHint": {"refreshSupport": true}},
            "textDocument": {"codeAction": action, "hover": {"contentFormat": ["markdown"]}},
            "experimental": {"commands": ["mauve.showReferences"]},
    });
    start(folder, &capabilities).0
}

const MODEL: &str = "
/* 🦀 é */ codel plan(): int  codel drive(): int
shell S { }
core C(S) { update = { plan(); } }  core E(S) { update = { drive(); } }
component Planner(S, C)  component Driver(S, E)
architecture A { instance planner: Planner  instance driver: Driver }
deployment D {
  architecture A
  activity planner { affinity = 1 priority = 2 period = 100 deadline = 100 }
  /* 🦀 é */ activity driver { affinity = 1 priority = 1 period = 50 deadline = 50 }
}
";
const CONFIG: &str = "
[timing]
tables = [\"times.toml\"]
[platform]
cpus = 2
rt_throttling = false
";
const TIMES: &str = "
levels = [1e-3, 1e-4]
[codel]
plan = [30, 40]
drive = 20
";

fn robot(name: &str) -> std::path::PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
    write(&folder, &[("robot.mal", MODEL), ("mauve.toml", CONFIG), ("times.toml", TIMES)]);
    folder
}

fn actions(client: &mut Client, text: &Text, at: &str) -> Vec<Value> {
    let place = text.at(at);
    let (document, start) = (&place["textDocument"], &place["position"]);
    let params = json!({
        "textDocument": document, "range": {"start": start, "end": start}, "context": {"diagnostics": []},
    });
    client.call("textDocument/codeAction", params).unwrap().as_array().unwrap().clone()
}

/// Makes the edits of an action.
fn apply(client: &mut Client, text: &mut Text, edit: &Value) {
    let changes = edit.pointer(&format!("/changes/{}", text.uri.replace('~', "~0").replace('/', "~1")));
    for (range, new) in text.edits(changes.unwrap_or_else(|| panic!("{edit}"))) {
        client.replace(text, range, new);
    }
}

#[test]
fn what_an_action_says_is_what_it_gives() {
    let folder = robot("lsp_timing_actions");
    let mut client = good(&folder);
    let mut text = client.open_file(&folder.join("robot.mal"));
    assert!(client.hint(&text, "activity driver").starts_with("✗ 60 / 50 ms"));
    let found = actions(&mut client, &text, "driver { affinity");
    let titles: Vec<&str> = found.iter().map(|action| action["title"].as_str().unwrap()).collect();
    let timing = |title: &&&str| title.ends_with(" met");
    assert_eq!(
        titles.iter().filter(timing).collect::<Vec<_>>(),
        [
            &"Give driver priority 3: ✓ 60 → 20 / 50 ms, 2 of 2 met",
            &"Move driver to CPU 2: ✓ 60 → 20 / 50 ms, 2 of 2 met",
            &"Swap the priorities of driver and planner: driver ✓ 60 → 20 / 50 ms, 2 of 2 met",
            &"Relax the period and deadline of driver to 60.1 ms: ! 60 / 60.1 ms, 2 of 2 met",
        ]
    );
    let chosen = found.iter().find(|action| action["title"] == *titles[0]).unwrap().clone();
    let by_deadline = found.iter().find(|it| it["title"].as_str().unwrap().starts_with("Swap")).unwrap();
    // The action fixes the diagnostic there.
    assert_eq!(by_deadline["kind"], "quickfix");
    assert_eq!(by_deadline["diagnostics"][0]["code"], "deadline-missed");
    assert!(chosen["edit"].is_null());
    let resolved = client.call("codeAction/resolve", by_deadline.clone()).unwrap();
    apply(&mut client, &mut text, &resolved["edit"]);
    assert!(text.text.contains("activity planner { affinity = 1 priority = 1 period"), "{}", text.text);
    assert!(client.hint(&text, "activity driver").starts_with("✓ 20 / 50 ms"));
    assert!(client.hint(&text, "activity planner").starts_with("✓ 80 / 100 ms"));
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    // What was offered for another text is not done.
    let error = client.call("codeAction/resolve", by_deadline.clone()).unwrap_err();
    assert_eq!(error["code"], -32801);
}

#[test]
fn what_an_action_says_holds_at_the_level_that_is_shown() {
    let folder = robot("lsp_timing_level");
    let mut client = good(&folder);
    let text = client.open_file(&folder.join("robot.mal"));
    let found = actions(&mut client, &text, "planner { affinity");
    let params = json!({"command": "mauve.setSignificance", "arguments": [1e-3]});
    client.call("workspace/executeCommand", params).unwrap();
    let titles = |found: &[Value]| {
        let titles = found.iter().map(|action| action["title"].as_str().unwrap().to_owned());
        titles.filter(|title| title.ends_with(" met")).collect::<Vec<_>>()
    };
    let now = actions(&mut client, &text, "planner { affinity");
    let move_at_1e_4 = "Move planner to CPU 2: driver ✓ 60 → 20 / 50 ms, 2 of 2 met";
    assert!(titles(&found).iter().any(|it| it == move_at_1e_4), "{found:?}");
    assert_eq!(titles(&now), ["Shorten the period and deadline of planner to 50 ms: 2 of 2 met"]);
    // An action of another level is outdated.
    let timing = found.iter().find(|it| it["title"] == move_at_1e_4).unwrap();
    assert_eq!(client.call("codeAction/resolve", timing.clone()).unwrap_err()["code"], -32801);
}

#[test]
fn files_for_a_lone_model_are_created_where_the_client_can() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_timing_lone");
    write(&folder, &[("robot.mal", MODEL)]);
    let literal = json!({"codeActionKind": {"valueSet": ["", "quickfix"]}});
    let can_create = |operations: &[&str]| {
        let action = json!({
            "codeActionLiteralSupport": literal, "dataSupport": true, "resolveSupport": {"properties": ["edit"]},
        });
        let edits = json!({"documentChanges": true, "resourceOperations": operations});
        let capabilities =
            json!({"workspace": {"workspaceEdit": edits}, "textDocument": {"codeAction": action}});
        let (mut client, _) = start(&folder, &capabilities);
        let text = client.open_file(&folder.join("robot.mal"));
        let found = actions(&mut client, &text, "D {\n");
        let found = found.into_iter().find(|it| it["title"] == "Create mauve.toml and timing.toml");
        found.map(|action| client.call("codeAction/resolve", action).unwrap())
    };
    assert_eq!(can_create(&["rename"]), None);
    let action = can_create(&["create"]).unwrap();
    let operations = action["edit"]["documentChanges"].as_array().unwrap();
    let created: Vec<&str> = operations.iter().filter_map(|it| it["uri"].as_str()).collect();
    assert!(created[0].ends_with("/mauve.toml") && created[1].ends_with("/timing.toml"), "{action}");
    assert!(operations.iter().all(|it| it["options"]["overwrite"] != true), "{action}");
    let table = operations.last().unwrap()["edits"][0]["newText"].as_str().unwrap();
    assert!(
        table.contains("[codel]\ndrive = 1 # assumed") && table.contains("\nplan  = 1 # assumed"),
        "{table}"
    );
}

#[test]
fn a_plain_client_gets_edits_at_once_and_no_refusals() {
    let folder = robot("lsp_timing_plain");
    let literal = json!({"codeActionKind": {"valueSet": []}});
    let (mut client, _) =
        start(&folder, &json!({"textDocument": {"codeAction": {"codeActionLiteralSupport": literal}}}));
    let mut text = client.open_file(&folder.join("robot.mal"));
    client.edit(&mut text, "driver { affinity = 1 ", "driver { ");
    let found = actions(&mut client, &text, "driver { priority");
    assert!(
        found.iter().all(|action| action["disabled"].is_null() && !action["edit"].is_null()),
        "{found:?}"
    );
    let longer =
        found.iter().find(|it| it["title"].as_str().unwrap().starts_with("Move driver to CPU 2")).unwrap();
    apply(&mut client, &mut text, &longer["edit"]);
    assert!(text.text.contains("affinity = 2"), "{}", text.text);
    assert!(client.hint(&text, "activity driver").starts_with("✓ 20 / 50 ms"));
}

fn lenses(client: &mut Client, uri: &str) -> Vec<Value> {
    let all = client.call("textDocument/codeLens", json!({"textDocument": {"uri": uri}})).unwrap();
    all.as_array().unwrap().clone()
}

#[test]
fn lenses_above_declarations() {
    let folder = robot("lsp_timing_lenses");
    let parts = "/* 🦀 é */ library parts { codel scan(): int }\n";
    let scan = "generated/parts/src/codels/scan.cpp";
    write(&folder, &[("parts.mal", parts), (scan, "int scan() { return 1; }\n")]);
    let mut client = good(&folder);
    let text = client.open_file(&folder.join("robot.mal"));
    let found = lenses(&mut client, &text.uri);
    let titles: Vec<&str> = found.iter().map(|lens| lens["command"]["title"].as_str().unwrap()).collect();
    let driver = "driver: ✗ 60 / 50 ms";
    let delays = format!("delays {driver}");
    let used = "used in 1 instance";
    assert_eq!(titles, [used, delays.as_str(), used, driver, "at 1e-3", "Architecture"]);
    let shown = |lens: &Value| (lens["command"]["command"].clone(), lens["command"]["arguments"].clone());
    let (command, arguments) = shown(&found[0]);
    assert_eq!((command, &arguments[0]), (json!("mauve.showReferences"), &json!(text.uri)));
    assert_eq!(arguments[2][0]["range"]["start"], json!({"line": 5, "character": 26}));
    assert_eq!(shown(&found[4]), (json!("mauve.setSignificance"), json!([1e-3])));
    assert_eq!(shown(&found[5]).1[2][0]["range"]["start"], json!({"line": 5, "character": 13}));
    // A click does what it says, and everything is asked for again.
    client.call("workspace/executeCommand", found[4]["command"].clone()).unwrap();
    client.wait("a refresh", |message| message["method"] == "workspace/codeLens/refresh");
    let found = lenses(&mut client, &text.uri);
    assert_eq!(found[2]["command"]["title"], "at 1e-4");
    assert!(client.hints(&text.uri).iter().any(|(_, label)| label == "2 of 2 met at 1e-3"));
    // The file of a codel, while it is there.
    let text = client.open_file(&folder.join("parts.mal"));
    let found = lenses(&mut client, &text.uri);
    let (command, arguments) = shown(&found[0]);
    assert_eq!((command, &found[0]["command"]["title"]), (json!("mauve.showReferences"), &json!("scan.cpp")));
    assert!(arguments[2][0]["uri"].as_str().unwrap().ends_with(scan), "{arguments}");
    // The name of the codel, behind what has other lengths in UTF-16.
    assert_eq!(found[0]["range"]["start"], json!({"line": 0, "character": 33}));
    std::fs::remove_file(folder.join(scan)).unwrap();
    assert_eq!(lenses(&mut client, &text.uri), [] as [Value; 0]);
}

#[test]
fn lenses_depend_on_the_commands_of_the_client() {
    let folder = robot("lsp_timing_plain_lenses");
    let (mut client, _) = start(&folder, &json!({}));
    let text = client.open_file(&folder.join("robot.mal"));
    let found = lenses(&mut client, &text.uri);
    assert_eq!(found[0]["command"], json!({"title": "used in 1 instance", "command": ""}));
    let commands = json!({"commands": ["mauve.chooseSignificance"]});
    let (mut client, _) = start(&folder, &json!({"experimental": commands}));
    let text = client.open_file(&folder.join("robot.mal"));
    let found = lenses(&mut client, &text.uri);
    let title = "at 1e-4, about 3.6 executions an hour may exceed their times ▾";
    let command = json!({"title": title, "command": "mauve.chooseSignificance", "arguments": []});
    assert_eq!(found[4]["command"], command);
}

#[test]
fn of_the_robot_navigation_may_run_a_little_more_often_and_nowhere_else() {
    let folder = models().join("p3dx");
    let mut client = good(&folder);
    let text = client.open_file(&folder.join("deployment.mal"));
    let found = actions(&mut client, &text, "navigation  {");
    let titles = found.iter().map(|action| action["title"].as_str().unwrap());
    let titles: Vec<&str> = titles.filter(|title| title.ends_with(" met")).collect();
    assert_eq!(titles, ["Shorten the period and deadline of navigation to 998 ms: 9 of 9 met"]);
}

#[test]
fn a_timing_table_shows_the_limit_of_each_time() {
    let folder = robot("limits_in_tables");
    let mut client = good(&folder);
    let mut table = client.open_file(&folder.join("times.toml"));
    // A limit is searched for: the client is told to ask again.
    client.wait_for_hint(&table, "plan = ", |hint| hint == "✗ ≤ 30 ms · 1 use");
    client.wait_for_hint(&table, "drive = ", |hint| hint == "✗ ≤ 10 ms · 1 use");
    client.edit(&mut table, "[30, 40]", "[20, 28]");
    client.wait_for_hint(&table, "plan = ", |hint| hint == "! ≤ 30 ms · 1 use");
    // The limit changes with a period in another text.
    let mut model = client.open_file(&folder.join("robot.mal"));
    client.hint(&model, "activity planner");
    client.edit(&mut model, "deadline = 100", "deadline = 25");
    client.wait("a refresh", |message| message["method"] == "workspace/inlayHint/refresh");
    client.wait_for_hint(&table, "plan = ", |hint| hint == "✗ ≤ 25 ms · 1 use");
}
