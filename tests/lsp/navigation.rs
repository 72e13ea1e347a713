//! Where names lead, over the protocol: to declarations, types and what is made of them, to their uses, to callers and to
//! shells that extend one another.

use std::path::{Path, PathBuf};

use mauve_tests::{Client, Text, address, scratch, write};
use serde_json::{Value, json};

use crate::MAUVE;

const ROBOT: &[(&str, &str)] = &[
    (
        "robot.mal",
        "include \"parts.mal\"\narchitecture A {\n  instance laser: parts.Sick\n  instance map: Gmapping\n  \
         operation map.clear -> laser.wipe\n}\ncomponent Gmapping(parts.Map, parts.Slam)\n\
         deployment D { architecture A  activity laser { priority = 1 period = 100 } }\n",
    ),
    (
        "parts.mal",
        "library parts {\n  use std_msgs\n  codel shoot(out n: Int32): int\n  shell Sensor { property rate: int }\n  \
         shell Laser extends Sensor { require wipe(): int }\n  shell Map { provide clear(): int }\n  \
         core Sweep(Laser) {\n    var n: Int32\n    handler h: wipe\n    \
         update = { /* 🦀 é */ shoot(n); h = send(wipe); }\n  }\n  component Sick(Laser, Sweep)\n  \
         core Slam(Map) {\n    provide clear(): int = { return 1; }\n    update = { clear(); }\n  }\n}\n",
    ),
    ("mauve.toml", "[timing]\ntables = [\"t.toml\"]\n[generate]\nout = \"cpp\"\n"),
    ("t.toml", "[codel]\n\"parts.shoot\" = 1\n"),
    ("cpp/parts/src/codels/shoot.cpp", "// The user's.\n"),
    ("ros/std_msgs/package.xml", "<package><name>std_msgs</name></package>"),
    ("ros/std_msgs/msg/Int32.msg", "int32 data\n"),
];

fn robot(name: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
    write(&folder, ROBOT);
    folder
}

/// A client that can do this, and a server for the folder, with its packages.
fn open(folder: &Path, capabilities: &Value) -> (Client, Value) {
    let packages = folder.join("ros").display().to_string();
    let mut client = Client::start_where(MAUVE, &[], &[("ROS_PACKAGE_PATH", &packages)]);
    let result = client.initialize(Some(folder), capabilities);
    (client, result)
}

/// Asks about the place of `$0` in `at`, which is a piece of the text.
fn ask(client: &mut Client, method: &str, text: &Text, at: &str, more: Value) -> Value {
    let piece = at.replace("$0", "");
    let offset = text.text.find(&piece).unwrap() + at.find("$0").unwrap();
    let mut params = json!({"textDocument": {"uri": text.uri}, "position": text.position(offset)});
    params.as_object_mut().unwrap().extend(more.as_object().cloned().unwrap_or_default());
    loop {
        match client.call(method, params.clone()) {
            // Something is still being read.
            Err(error) if error["code"] == -32801 => {}
            answer => return answer.unwrap(),
        }
    }
}

/// File, line from 1, and columns of a range.
fn shown(uri: &Value, range: &Value) -> String {
    let file = uri.as_str().unwrap().rsplit('/').next().unwrap();
    let number = |at: &str, what: &str| range[at][what].as_u64().unwrap();
    let (start, end) = (number("start", "character"), number("end", "character"));
    format!("{file}:{} {start}-{end}", number("start", "line") + 1)
}

fn places(answer: &Value) -> Vec<String> {
    let all = answer.as_array().map_or(&[] as &[Value], Vec::as_slice);
    all.iter()
        .map(|it| match it.get("uri") {
            Some(uri) => shown(uri, &it["range"]),
            None => shown(&it["targetUri"], &it["targetSelectionRange"]),
        })
        .collect()
}

#[test]
fn names_lead_four_ways() {
    let folder = robot("lsp_go_to");
    // With links and without.
    for links in [true, false] {
        let one = json!({"linkSupport": links});
        let capabilities = json!({"textDocument": {
            "definition": one, "declaration": one, "typeDefinition": one, "implementation": one,
        }});
        let (mut client, server) = open(&folder, &capabilities);
        for provider in
            ["definitionProvider", "declarationProvider", "typeDefinitionProvider", "implementationProvider"]
        {
            assert_eq!(server["capabilities"][provider], true, "{provider}");
        }
        let text = client.open_file(&folder.join("parts.mal"));
        for (method, at, expected) in [
            ("definition", "{ cle$0ar();", &["parts.mal:14 12-17"][..]),
            ("declaration", "{ cle$0ar();", &["parts.mal:6 22-27"]),
            ("declaration", "sho$0ot(n); h", &["parts.mal:3 8-13"]),
            ("typeDefinition", "shoot($0n); h", &["Int32.msg:1 0-0"]),
            ("typeDefinition", "$0h = send", &["parts.mal:5 39-43"]),
            ("implementation", "shell Las$0er", &["parts.mal:7 7-12", "parts.mal:12 12-16"]),
            ("implementation", "sho$0ot(n); h", &["t.toml:2 7-12", "shoot.cpp:1 0-0"]),
            ("implementation", "send(wi$0pe)", &["parts.mal:14 12-17"]),
            ("implementation", "var $0n", &[]),
        ] {
            let found = ask(&mut client, &format!("textDocument/{method}"), &text, at, json!({}));
            assert_eq!(places(&found), expected, "{method} {at}");
            if !expected.is_empty() {
                assert_eq!(found[0].get("targetUri").is_some(), links);
                // The crab is two columns wide.
                let origin = &found[0]["originSelectionRange"];
                let is_shoot = links && at.starts_with("sho$0ot");
                assert!(
                    !is_shoot
                        || *origin
                            == json!({"start": {"line": 9, "character": 26}, "end": {"line": 9, "character": 31}}),
                    "{origin}"
                );
            }
        }
        // A file that is not there is not offered.
        if !links {
            std::fs::remove_file(folder.join("cpp/parts/src/codels/shoot.cpp")).unwrap();
            let found = ask(&mut client, "textDocument/implementation", &text, "codel sho$0ot", json!({}));
            assert_eq!(places(&found), ["t.toml:2 7-12"]);
        }
    }
}

#[test]
fn uses_are_found_in_all_files() {
    let folder = robot("lsp_references");
    let (mut client, server) = open(&folder, &json!({}));
    assert_eq!(server["capabilities"]["referencesProvider"], true);
    let text = client.open_file(&folder.join("parts.mal"));
    let mut uses = |at: &str, declaration: bool| {
        let more = json!({"context": {"includeDeclaration": declaration}});
        places(&ask(&mut client, "textDocument/references", &text, at, more))
    };
    assert_eq!(uses("codel sho$0ot", true), ["parts.mal:3 8-13", "parts.mal:10 26-31", "t.toml:2 7-12"]);
    assert_eq!(uses("codel sho$0ot", false), ["parts.mal:10 26-31", "t.toml:2 7-12"]);
    assert_eq!(
        uses("provide cl$0ear(): int }", false),
        ["parts.mal:14 12-17", "parts.mal:15 15-20", "robot.mal:5 16-21"]
    );
    assert_eq!(uses("lib$0rary", true), [] as [&str; 0]);

    // From a table, of which the client has no text open in another file.
    let table = client.open_file(&folder.join("t.toml"));
    let more = json!({"context": {"includeDeclaration": true}});
    let found = ask(&mut client, "textDocument/references", &table, "parts.sho$0ot", more);
    assert_eq!(places(&found).len(), 3);
}

#[test]
fn reads_and_writes_are_lit_up() {
    let folder = robot("lsp_highlight");
    let (mut client, _) = open(&folder, &json!({}));
    let text = client.open_file(&folder.join("parts.mal"));
    let found = ask(&mut client, "textDocument/documentHighlight", &text, "$0h = send", json!({}));
    let uri = json!(text.uri);
    let found = found.as_array().unwrap().iter();
    let found: Vec<(String, u64)> =
        found.map(|it| (shown(&uri, &it["range"]), it["kind"].as_u64().unwrap())).collect();
    assert_eq!(found, [("parts.mal:9 12-13".to_owned(), 3), ("parts.mal:10 36-37".to_owned(), 3)]);
    let found = ask(&mut client, "textDocument/documentHighlight", &text, "{ cle$0ar();", json!({}));
    let kinds: Vec<&Value> = found.as_array().unwrap().iter().map(|it| &it["kind"]).collect();
    assert_eq!(kinds, [3, 3, 2]);
}

#[test]
fn calls_lead_over_connections() {
    let folder = robot("lsp_calls");
    let (mut client, server) = open(&folder, &json!({}));
    assert_eq!(server["capabilities"]["callHierarchyProvider"], true);
    let mut text = client.open_file(&folder.join("parts.mal"));
    let items = ask(&mut client, "textDocument/prepareCallHierarchy", &text, "codel sho$0ot", json!({}));
    let calls = client.call("callHierarchy/incomingCalls", json!({"item": items[0]})).unwrap();
    let update = &calls[0]["from"];
    assert_eq!((&update["name"], &update["detail"]), (&json!("update"), &json!("core Sweep")));
    assert_eq!(shown(&update["uri"], &calls[0]["fromRanges"][0]), "parts.mal:10 26-31");
    let called = |calls: &Value| -> Vec<String> {
        let all = calls.as_array().unwrap().iter();
        all.map(|it| {
            format!(
                "{} {}",
                it["to"]["name"].as_str().unwrap(),
                shown(&it["to"]["uri"], &it["to"]["selectionRange"])
            )
        })
        .collect()
    };
    let calls = client.call("callHierarchy/outgoingCalls", json!({"item": update})).unwrap();
    assert_eq!(called(&calls), ["shoot parts.mal:3 8-13", "clear parts.mal:14 12-17"]);

    // What was asked about is found again after an edit, and not where it is gone.
    client.edit(&mut text, "library parts {", "library parts {\n  // A line more.\n");
    let calls = client.call("callHierarchy/outgoingCalls", json!({"item": update})).unwrap();
    assert_eq!(called(&calls), ["shoot parts.mal:5 8-13", "clear parts.mal:16 12-17"]);
    client.edit(&mut text, "core Sweep", "core Swoop");
    let calls = client.call("callHierarchy/outgoingCalls", json!({"item": update})).unwrap();
    assert_eq!(calls, json!([]));
    let mut foreign = update.clone();
    foreign["data"] = json!({"other": 1});
    assert_eq!(client.call("callHierarchy/outgoingCalls", json!({"item": foreign})).unwrap(), Value::Null);
}

#[test]
fn shells_lead_to_those_that_they_extend() {
    let folder = robot("lsp_types");
    let (mut client, server) = open(&folder, &json!({}));
    assert_eq!(server["capabilities"]["typeHierarchyProvider"], true);
    let text = client.open_file(&folder.join("parts.mal"));
    let items = ask(&mut client, "textDocument/prepareTypeHierarchy", &text, "core Sweep(Las$0er", json!({}));
    assert_eq!(items[0]["name"], "Laser");
    let above = client.call("typeHierarchy/supertypes", json!({"item": items[0]})).unwrap();
    assert_eq!(
        (&above[0]["name"], above[0]["uri"].as_str()),
        (&json!("Sensor"), Some(&*address(&folder.join("parts.mal"))))
    );
    let below = client.call("typeHierarchy/subtypes", json!({"item": above[0]})).unwrap();
    assert_eq!(below, items);
    assert_eq!(
        ask(&mut client, "textDocument/prepareTypeHierarchy", &text, "codel sho$0ot", json!({})),
        Value::Null
    );
}
