//! Other names over the protocol: the sample robot stays what it is, but for the name.

use std::path::{Path, PathBuf};

use mauve_tests::{Client, Text, address, all_texts_in, mauve, scratch, write};
use serde_json::{Value, json};

use super::{MAUVE, copied_robot, start};

fn good_editor() -> Value {
    json!({
        "workspace": {
            "workspaceEdit": {"documentChanges": true, "changeAnnotationSupport": {}},
            "fileOperations": {"willRename": true},
        },
        "textDocument": {"rename": {"prepareSupport": true}},
    })
}

/// A copy of the sample robot, and a table with keys of programs too.
fn robot(name: &str) -> PathBuf {
    let folder = copied_robot(name);
    let programs = "unit = \"ms\"\n[program]\n\"Navigation/Waiting.run\" = 0.5\n\
                    \"navigation.Navigation/Waiting.asked.guard\" = 0.1\n\"Navigation/Planning.given_up.guard\" = 0.1\n";
    write(&folder, &[("timing/programs.toml", programs)]);
    folder
}

/// Writes what an edit says; gives what was replaced, by file: lines and columns, and the new text.
fn apply(edit: &Value) -> Vec<(PathBuf, usize)> {
    let mut changed = Vec::new();
    for of_file in edit["documentChanges"].as_array().unwrap() {
        let path =
            PathBuf::from(of_file["textDocument"]["uri"].as_str().unwrap().strip_prefix("file://").unwrap());
        let text = std::fs::read_to_string(&path).unwrap();
        let text = Text { uri: String::new(), version: 1, text, columns: mauve_tests::Columns::Utf16 };
        let edits = &of_file["edits"];
        let new = text.applied(edits);
        changed.push((path.clone(), edits.as_array().unwrap().len()));
        std::fs::write(&path, new).unwrap();
    }
    changed
}

/// What the command line says of the folder: everything that is wrong, and all response times.
fn says(folder: &Path) -> Value {
    let check = mauve(MAUVE, folder, &["check", "--format", "json"]);
    let times = mauve(MAUVE, folder, &["wcrt", "--format", "json"]);
    let parse = |text: &str| serde_json::from_str::<Value>(text).unwrap();
    json!([parse(&check.out), parse(&times.out)])
}

fn rename(client: &mut Client, text: &Text, at: &str, new_name: &str) -> Result<Value, Value> {
    let piece = at.replace("$0", "");
    let offset = text.text.find(&piece).unwrap() + at.find("$0").unwrap();
    let position = text.position(offset);
    let params = json!({"textDocument": {"uri": text.uri}, "position": position, "newName": new_name});
    loop {
        match client.call("textDocument/rename", params.clone()) {
            Err(error) if error["code"] == -32801 => {}
            answer => return answer,
        }
    }
}

#[test]
fn the_robot_stays_what_it_is() {
    const ARCHITECTURE: &str = "navigation_architecture.mal";
    const EXPLORATION: &str = "exploration_architecture.mal";
    const NAVIGATION: &str = "components/navigation.mal";
    const TIMES: &str = "timing/p3dx.toml";
    const PROGRAMS: &str = "timing/programs.toml";
    type Renamed<'a> = (&'a str, &'a str, &'a str, &'a str, &'a [(&'a str, usize)]);
    let renamed: [Renamed<'_>; 8] = [
        (
            "port",
            "components/hokuyo.mal",
            "output port sc$0an",
            "scan",
            &[("components/hokuyo.mal", 2), (EXPLORATION, 3), (TIMES, 1)],
        ),
        (
            "property",
            "components/control.mal",
            "property max_sp$0eed",
            "max_speed",
            &[("components/control.mal", 2), ("deployment.mal", 1), (ARCHITECTURE, 1)],
        ),
        (
            "component",
            NAVIGATION,
            "component Navi$0gation(",
            "Navigation",
            &[(NAVIGATION, 1), (ARCHITECTURE, 1), (TIMES, 2), (PROGRAMS, 3)],
        ),
        ("state", NAVIGATION, "initial state Wai$0ting", "Waiting", &[(NAVIGATION, 2), (PROGRAMS, 2)]),
        (
            "codel",
            NAVIGATION,
            "ast$0ar(here",
            "astar",
            &[(NAVIGATION, 1), ("components/navigation_shell.mal", 1), (TIMES, 1)],
        ),
        (
            "instance",
            "deployment.mal",
            "activity navi$0gation ",
            "navigation",
            &[("deployment.mal", 1), (EXPLORATION, 1), (ARCHITECTURE, 4)],
        ),
        (
            "library",
            NAVIGATION,
            "library navi$0gation",
            "navigation",
            &[
                (NAVIGATION, 1),
                ("components/navigation_shell.mal", 1),
                (EXPLORATION, 1),
                (ARCHITECTURE, 1),
                (TIMES, 3),
                (PROGRAMS, 1),
            ],
        ),
        ("transition", NAVIGATION, "transition giv$0en_up", "given_up", &[(NAVIGATION, 1), (PROGRAMS, 1)]),
    ];
    for (what, file, at, old, counts) in renamed {
        let folder = robot(&format!("lsp_rename_{what}"));
        let (before, said) = (all_texts_in(&folder), says(&folder));
        let (mut client, server) = start(&folder, &good_editor());
        assert_eq!(server["renameProvider"], json!({"prepareProvider": true}));
        let text = client.open_file(&folder.join(file));
        let edit = rename(&mut client, &text, at, "quite_another").unwrap();
        let changed = apply(&edit);
        let after = all_texts_in(&folder);
        // Nothing else is replaced, and there and back is where it was.
        let mut shown = Vec::new();
        for (path, old_text) in &before {
            let new_text = &after[path];
            let count = new_text.matches("quite_another").count();
            assert_eq!(&new_text.replace("quite_another", old), old_text, "{what}");
            let edits = changed.iter().find(|(of, _)| of == path).map_or(0, |(_, count)| *count);
            assert_eq!(count, edits, "{what} in {}", path.display());
            if count > 0 {
                let below = path.strip_prefix(&folder).unwrap().display().to_string();
                shown.push((below, count));
            }
        }
        let counts: Vec<(String, usize)> =
            counts.iter().map(|(file, count)| ((*file).to_owned(), *count)).collect();
        assert_eq!(shown, counts, "{what}");
        let new_said = says(&folder).to_string().replace("quite_another", old);
        assert_eq!(serde_json::from_str::<Value>(&new_said).unwrap(), said, "{what}");
        // What is open has the version that the edit is for; what is not, none. Each group says what it is.
        for of_file in edit["documentChanges"].as_array().unwrap() {
            let is_open = of_file["textDocument"]["uri"] == *text.uri;
            assert_eq!(of_file["textDocument"]["version"], if is_open { json!(1) } else { Value::Null });
            for it in of_file["edits"].as_array().unwrap() {
                let note = edit["changeAnnotations"][it["annotationId"].as_str().unwrap()]["label"].as_str();
                let place = match of_file["textDocument"]["uri"].as_str().unwrap().ends_with(".mal") {
                    true => "models",
                    false => "timing tables",
                };
                assert_eq!(note, Some(&*format!("Rename `{old}` to `quite_another` in {place}")));
            }
        }
    }
}

#[test]
fn what_can_be_renamed_is_said_and_why_not() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_rename_refused");
    let model = "codel shoot(): int\n/* 🦀 é */ core C(S) { update = { shoot(); lost }\ncodel other(): int\n";
    write(&folder, &[("a.mal", model)]);
    let (mut client, _) = start(&folder, &good_editor());
    let mut text = client.open_file(&folder.join("a.mal"));
    let prepare =
        |client: &mut Client, text: &Text, at: &str| client.call("textDocument/prepareRename", text.at(at));
    // In columns of UTF-16, while another line is broken.
    let found = prepare(&mut client, &text, "shoot(); lost").unwrap();
    let range = json!({"start": {"line": 1, "character": 34}, "end": {"line": 1, "character": 39}});
    assert_eq!(found, json!({"range": range, "placeholder": "shoot"}));
    let error = prepare(&mut client, &text, "int").unwrap_err();
    assert_eq!(error["code"], -32803);
    assert!(error["message"].as_str().unwrap().contains("`int` is built in"), "{error}");
    for (name, why) in [
        ("other", "codel `other` already exists (a.mal, line 3)"),
        ("1", "`1` is not a name"),
        ("true", "a built-in value"),
    ] {
        let error = rename(&mut client, &text, "codel sho$0ot", name).unwrap_err();
        assert!(error["message"].as_str().unwrap().contains(why), "{error}");
    }
    let edit = rename(&mut client, &text, "codel sho$0ot", "look").unwrap();
    assert_eq!(edit["documentChanges"][0]["edits"].as_array().unwrap().len(), 2);
    // The text that was edited is the one that is renamed in.
    client.edit(&mut text, "lost", "shoot();");
    let edit = rename(&mut client, &text, "codel sho$0ot", "look").unwrap();
    assert_eq!(edit["documentChanges"][0]["textDocument"]["version"], 2);
    assert_eq!(edit["documentChanges"][0]["edits"].as_array().unwrap().len(), 3);

    // A client that knows none of this.
    let (mut client, server) = start(&folder, &json!({}));
    assert_eq!(server["renameProvider"], true);
    let text = client.open_file(&folder.join("a.mal"));
    let edit = rename(&mut client, &text, "codel sho$0ot", "look").unwrap();
    assert_eq!(edit["changes"][&text.uri].as_array().unwrap().len(), 2);
}

#[test]
fn includes_follow_renamed_files() {
    let folder = robot("lsp_rename_files");
    let said = says(&folder);
    let (mut client, server) = start(&folder, &good_editor());
    let filters = &server["workspace"]["fileOperations"]["willRename"]["filters"];
    assert_eq!(filters[1]["pattern"], json!({"glob": "**", "matches": "folder"}));
    let text = client.open_file(&folder.join("exploration.mal"));
    client.diagnostics(&text);
    for (old, new) in
        [("components", "parts"), ("exploration.mal", "robot.mal"), ("parts/hokuyo.mal", "laser.mal")]
    {
        let (old, new) = (folder.join(old), folder.join(new));
        let files = json!({"files": [{"oldUri": address(&old), "newUri": address(&new)}]});
        let edit = loop {
            match client.call("workspace/willRenameFiles", files.clone()) {
                Err(error) if error["code"] == -32801 => {}
                answer => break answer.unwrap(),
            }
        };
        apply(&edit);
        std::fs::rename(&old, &new).unwrap();
        // The next question is about the files as they are.
        let uris = [address(&old), address(&new)];
        let changes: Vec<Value> =
            uris.iter().zip([3, 1]).map(|(uri, kind)| json!({"uri": uri, "type": kind})).collect();
        client.notify("workspace/didChangeWatchedFiles", json!({"changes": changes}));
        client.shut_down();
        client = start(&folder, &good_editor()).0;
    }
    let check = mauve(MAUVE, &folder, &["check"]);
    assert_eq!(check.code, 0, "{}", check.err);
    // Everything is said as before, of the files as they are called now.
    let now = says(&folder)[1].to_string();
    assert_eq!(
        now.replace("robot.mal", "exploration.mal").replace("parts/", "components/"),
        said[1].to_string()
    );
    // What nobody names needs no change.
    let files = json!({"files": [{"oldUri": address(&folder.join("README.md")), "newUri": address(&folder.join("R.md"))}]});
    assert_eq!(client.call("workspace/willRenameFiles", files).unwrap(), Value::Null);
}
