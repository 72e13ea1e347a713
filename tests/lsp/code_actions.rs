//! Code actions over the server's standard streams: what is offered, and what it changes.

use std::path::PathBuf;

use mauve_tests::{Client, Text, address, scratch, write};
use serde_json::{Value, json};

use super::{MAUVE, copied_robot, start};

/// A folder with nothing in it.
fn empty(name: &str) -> PathBuf {
    scratch(env!("CARGO_TARGET_TMPDIR"), name)
}

/// What an editor can do that knows everything about actions.
fn good_editor() -> Value {
    json!({
        "workspace": {"workspaceEdit": {
            "documentChanges": true, "resourceOperations": ["create"],
            "changeAnnotationSupport": {"groupsOnLabel": true},
        }},
        "textDocument": {"codeAction": {
            "codeActionLiteralSupport": {"codeActionKind": {"valueSet": ["", "quickfix", "refactor", "source"]}},
            "isPreferredSupport": true, "disabledSupport": true, "dataSupport": true,
            "resolveSupport": {"properties": ["edit"]}, "honorsChangeAnnotations": true,
        }},
    })
}

/// The actions where `at` stands; `context` says more than that no diagnostics are shown.
fn actions(client: &mut Client, text: &Text, at: &str, length: usize, context: Value) -> Vec<Value> {
    let start = text.text.find(at).unwrap();
    let mut context = context;
    if context.get("diagnostics").is_none() {
        context["diagnostics"] = json!([]);
    }
    let params = json!({
        "textDocument": {"uri": text.uri}, "context": context,
        "range": {"start": text.position(start), "end": text.position(start + length)},
    });
    let found = client.call("textDocument/codeAction", params).unwrap();
    found.as_array().unwrap().clone()
}

fn named<'a>(actions: &'a [Value], title: &str) -> &'a Value {
    let found = actions.iter().find(|action| action["title"].as_str().unwrap().starts_with(title));
    found.unwrap_or_else(|| panic!("no `{title}` in {actions:#?}"))
}

#[test]
fn a_fix_is_offered_with_what_it_mends_and_made_when_it_is_chosen() {
    let folder = copied_robot("action_fix");
    let (mut client, server) = start(&folder, &good_editor());
    assert_eq!(server["codeActionProvider"]["resolveProvider"], true);
    let kinds = server["codeActionProvider"]["codeActionKinds"].as_array().unwrap();
    assert!(kinds.contains(&json!("source.fixAll.mauve")), "{kinds:?}");
    assert!(kinds.contains(&json!("quickfix")) && kinds.contains(&json!("source.organizeImports")));
    let mut text = client.open_file(&folder.join("components/navigation.mal"));
    client.edit(&mut text, "astar(", "/* 🦀 é */ astra(");
    // The first is the codel's own declaration.
    client.edit(&mut text, "/* 🦀 é */ astra(", "astar(");
    let call = text.text.rfind("astar(").unwrap();
    client.replace(&mut text, call..call, "/* 🦀 é */ ");
    let call = text.text.rfind("astar(").unwrap();
    client.replace(&mut text, call..call + 5, "astra");
    let published = client.diagnostics(&text);
    let found = actions(&mut client, &text, "astra(", 0, json!({"diagnostics": published}));
    let fix = named(&found, "Change to `astar`");
    // A guess is nothing that an editor may do unasked.
    assert_eq!((&fix["kind"], &fix["isPreferred"]), (&json!("quickfix"), &Value::Null));
    assert_eq!(fix["diagnostics"], json!([published[0]]));
    assert!(fix.get("edit").is_none(), "{fix}");
    let resolved = client.call("codeAction/resolve", fix.clone()).unwrap();
    let change = &resolved["edit"]["documentChanges"][0];
    assert_eq!(change["textDocument"], json!({"uri": text.uri, "version": text.version}));
    assert_eq!(change["edits"][0]["annotationId"], "Change to `astar`");
    assert_eq!(resolved["edit"]["changeAnnotations"]["Change to `astar`"]["label"], "Change to `astar`");
    assert_eq!(text.applied(&change["edits"]), text.text.replace("astra(", "astar("));
    // Only what is asked for.
    let refactorings = actions(&mut client, &text, "astra(", 0, json!({"only": ["refactor"]}));
    assert_eq!(refactorings, [] as [Value; 0]);
    // In another text something else may stand there.
    client.edit(&mut text, "library", "// A line more.\nlibrary");
    assert_eq!(client.call("codeAction/resolve", fix.clone()).unwrap_err()["code"], -32801);
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn a_refactoring_is_offered_or_says_why_not() {
    let folder = empty("action_refactor");
    let (mut client, _) = start(&folder, &good_editor());
    let mut text = client.open(
        &folder.join("own.mal"),
        "codel plan(): void\nshell S { }\ncore C(S) {\n  /* 🦀 é */ update = { plan(); }\n}\n",
    );
    client.diagnostics(&text);
    let invoked = |only: &str| json!({"only": [only], "triggerKind": 1});
    let found = actions(&mut client, &text, "update", 0, invoked("refactor"));
    let convert = named(&found, "Convert to a state machine");
    assert_eq!(convert["kind"], "refactor.rewrite");
    let resolved = client.call("codeAction/resolve", convert.clone()).unwrap();
    let edits = &resolved["edit"]["documentChanges"][0]["edits"];
    let after = text.applied(edits);
    assert!(after.contains("/* 🦀 é */ statemachine {"), "{after}");
    let two = "statemachine { initial state A { transition t if true to B } state B { } }";
    client.edit(&mut text, "update = { plan(); }", two);
    client.diagnostics(&text);
    let found = actions(&mut client, &text, "statemachine", 0, json!({"triggerKind": 1}));
    let reason = &named(&found, "Convert to `update`")["disabled"]["reason"];
    assert_eq!(reason, "the state machine has several states");
    // Nobody asked for it.
    let found = actions(&mut client, &text, "statemachine", 0, json!({"triggerKind": 2}));
    assert!(found.iter().all(|action| action.get("disabled").is_none()), "{found:#?}");
    client.edit(&mut text, two, "update = { if true then { } }");
    client.diagnostics(&text);
    let found = actions(&mut client, &text, "if true", 0, json!({"only": ["quickfix"]}));
    assert_eq!(named(&found, "Write `else { }`")["isPreferred"], true);
}

#[test]
fn a_table_is_mended() {
    let folder = copied_robot("action_files");
    let (mut client, _) = start(&folder, &good_editor());
    let text = client.open_file(&folder.join("timing/p3dx.toml"));
    client.diagnostics(&text);
    let mut text = text;
    client.edit(&mut text, "astar", "astra");
    client.diagnostics(&text);
    let found = actions(&mut client, &text, "navigation.astra", 3, json!({"only": ["quickfix"]}));
    let resolved = client.call("codeAction/resolve", named(&found, "Change to").clone()).unwrap();
    let edits = &resolved["edit"]["documentChanges"][0]["edits"];
    assert_eq!(text.applied(edits), text.text.replace("astra", "astar"));
}

#[test]
fn a_plain_client_gets_edits_at_once_and_one_without_actions_nothing() {
    let plain = json!({"textDocument": {"codeAction": {
        "codeActionLiteralSupport": {"codeActionKind": {"valueSet": ["quickfix"]}},
    }}});
    let folder = empty("action_plain");
    let (mut client, _) = start(&folder, &plain);
    let path = folder.join("own.mal");
    let text = client.open(&path, "codel plan(): int\nshell S { }\ncore C(S) { update = { plna(); } }\n");
    client.diagnostics(&text);
    let found = actions(&mut client, &text, "plna", 2, json!({}));
    let fix = named(&found, "Change to `plan`");
    assert!(fix.get("data").is_none() && fix.get("isPreferred").is_none(), "{fix}");
    let edits = &fix["edit"]["changes"][&address(&path)];
    assert_eq!(text.applied(edits), text.text.replace("plna", "plan"));
    assert!(found.iter().all(|action| action.get("disabled").is_none()));

    let folder = empty("action_none");
    let (mut client, server) = start(&folder, &json!({}));
    assert!(server.get("codeActionProvider").is_none());
    let text = client.open(&folder.join("own.mal"), "shell S { }\ncore C(S) { update = { plna(); } }\n");
    client.diagnostics(&text);
    assert_eq!(actions(&mut client, &text, "plna", 0, json!({})), [] as [Value; 0]);
}

#[test]
fn what_is_done_when_a_file_is_saved() {
    let folder = empty("action_save");
    let (mut client, _) = start(&folder, &good_editor());
    let text = client.open(
        &folder.join("own.mal"),
        "library own {\n  use std_msgs\n  use geometry_msgs\n  shell S { input port p: Pose }\n  core C(S): { update = { } }\n}\n",
    );
    client.diagnostics(&text);
    let mut done = |asked: &str, kind: &str| {
        let found = actions(&mut client, &text, "library", 0, json!({"only": [asked]}));
        let [action] = found.as_slice() else { panic!("{found:#?}") };
        assert_eq!(action["kind"], kind);
        let resolved = client.call("codeAction/resolve", action.clone()).unwrap();
        text.applied(&resolved["edit"]["documentChanges"][0]["edits"])
    };
    let organized = done("source.organizeImports", "source.organizeImports");
    assert_eq!(organized, text.text.replace("  use std_msgs\n", ""));
    // Editors name the server in the setting for a save, or all servers.
    for asked in ["source.fixAll", "source.fixAll.mauve"] {
        assert_eq!(done(asked, "source.fixAll.mauve"), text.text.replace("C(S):", "C(S)"), "{asked}");
    }
    for other in ["source.fix", "source.fixAll.m", "source.fixAll.mauve.more", "source.fixAll.eslint"] {
        let found = actions(&mut client, &text, "library", 0, json!({"only": [other]}));
        assert_eq!(found, [] as [Value; 0], "{other}");
    }
    let several = json!({"only": ["refactor.extract", "source"]});
    let found = actions(&mut client, &text, "library", 0, several);
    let kinds: Vec<&str> = found.iter().map(|it| it["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["source.fixAll.mauve", "source.organizeImports", "source.generate.mauve"]);
    // Nobody looks for that wherever a cursor goes.
    let found = actions(&mut client, &text, "C(S)", 0, json!({}));
    assert!(found.iter().all(|action| !action["kind"].as_str().unwrap().starts_with("source")), "{found:#?}");
}

/// All fixes for a save, in one edit: those that guess nothing and leave every figure as it is.
#[test]
fn a_save_fixes_what_changes_no_figure() {
    let folder = empty("action_save_figures");
    let (mut client, _) = start(&folder, &good_editor());
    let model = "codel plan(in n: int): int\nshell S { input port i: int  output port o: int }\n\
        core K(S): {\n  var n: int = 1\n    - 2\n  var old: int = 3\n  update = {\n    if n > 0 then { n = plan(n); }\n    \
        if n > 1 then { n = plna(n); }\n  }\n}\ncomponent C(S, K)\narchitecture A { instance a: C  instance b: C  \
        connection b.i -> a.o }\ndeployment D { architecture A\n  activity a { priority = 1 period = 10 deadline = 20 }\n  \
        activity b { priority = 1 } }\n";
    let text = client.open(&folder.join("own.mal"), model);
    client.diagnostics(&text);
    let found = actions(&mut client, &text, "codel", 0, json!({"only": ["source.fixAll.mauve"]}));
    assert_eq!(found.len(), 1, "{found:#?}");
    let resolved = client.call("codeAction/resolve", found[0].clone()).unwrap();
    let changes = resolved["edit"]["documentChanges"].as_array().unwrap();
    assert_eq!(changes.len(), 1, "{changes:#?}");
    // The misspelt codel, the unused variable and the fields of the activities are the user's.
    let expected = model
        .replace("core K(S): {", "core K(S) {")
        .replace("1\n    - 2", "1 - 2")
        .replace("plan(n); }", "plan(n); } else { }")
        .replace("plna(n); }", "plna(n); } else { }")
        .replace("b.i -> a.o", "a.o -> b.i");
    assert_eq!(text.applied(&changes[0]["edits"]), expected);
}

/// The time of the actions grows in proportion to the errors of a file: the server may run for some seconds only, in which
/// nothing quadratic ends.
#[test]
fn actions_of_a_file_with_thousands_of_errors() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = empty("actions-of-many-errors");
    let axis = mauve_tests::axes::Axis::named("diagnostics");
    write(&folder, &(axis.project)(4_000));
    let limited = folder.join("limited");
    std::fs::write(&limited, format!("#!/bin/sh\nulimit -t 6\nexec '{MAUVE}' \"$@\"\n")).unwrap();
    std::fs::set_permissions(&limited, std::fs::Permissions::from_mode(0o755)).unwrap();
    let mut client = Client::start(&limited.to_string_lossy(), &[]);
    client.initialize(Some(&folder), &good_editor());
    let text = client.open_file(&folder.join(&axis.file[1..]));
    assert!(client.diagnostics(&text).len() >= 1_000, "the rest of them is counted, not shown");
    let range = json!({"start": text.position(0), "end": text.position(text.text.len())});
    let context = json!({"diagnostics": [], "only": ["source.fixAll"]});
    let params = json!({"textDocument": {"uri": text.uri}, "range": range, "context": context});
    assert_eq!(client.call("textDocument/codeAction", params), Ok(json!([])));
}
