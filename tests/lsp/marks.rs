//! Byte order marks: an editor takes the mark off when it opens a file, and writes it again when it saves the file. So
//! a server that reads closed files counts as if they had none, and the edits of a project do not depend on its marks.

use std::collections::BTreeMap;
use std::path::Path;

use mauve_tests::{Client, Columns, Text, address, scratch, test_name, write};
use serde_json::{Value, json};

use super::{MAUVE, start};

const MARK: &str = "\u{feff}";

const FILES: [(&str, &str); 4] = [
    ("core.mal", "codel labour(a: int): int shell é { } codel lost(): Nothing\nshell S { }\n"),
    (
        "robot.mal",
        "include \"core.mal\" core K(S) { update = { labour(1); laobur(2); } }\ncomponent C(S, K)\n",
    ),
    ("mauve.toml", "[timing]  tables = [\"times.toml\"]\n"),
    ("times.toml", "codel.labour = [1, 2]\n[codel]\n"),
];

/// What a server for the folder says and does, by the name of the question.
fn answers(folder: &Path, encoding: &str, opened: &str) -> BTreeMap<&'static str, Value> {
    let (mut client, _) = start(
        folder,
        &json!({
            "general": {"positionEncodings": [encoding]},
            "workspace": {"workspaceEdit": {"documentChanges": true}, "fileOperations": {"willRename": true}},
        }),
    );
    let columns = match encoding {
        "utf-8" => Columns::Utf8,
        "utf-16" => Columns::Utf16,
        _ => Columns::Utf32,
    };
    let robot = Text { columns, ..client.open(&folder.join("robot.mal"), opened) };
    client.diagnostics(&robot);
    client.idle();
    let mut found: BTreeMap<&str, Value> = BTreeMap::new();
    found.insert("diagnostics", json!(client.published()));
    let mut ask = |client: &mut Client, name, method: &str, params: Value| {
        let answer = client.call(method, params).unwrap_or_else(|error| panic!("{method}: {error}"));
        assert!(!answer.is_null(), "{method}");
        found.insert(name, answer.clone());
        answer
    };
    let at = robot.at("labour");
    ask(&mut client, "hover", "textDocument/hover", at.clone());
    ask(&mut client, "definition", "textDocument/definition", at.clone());
    let renamed = json!({"textDocument": at["textDocument"], "position": at["position"], "newName": "work"});
    let edit = ask(&mut client, "rename", "textDocument/rename", renamed);
    found.insert("renamed", applied(folder, columns, &edit));
    let files = json!({"files": [{"oldUri": address(&folder.join("core.mal")),
        "newUri": address(&folder.join("centre.mal"))}]});
    let edit = client.call("workspace/willRenameFiles", files).unwrap();
    found.insert("moved", applied(folder, columns, &edit));
    found
}

/// The texts of the files after an edit. An editor opens each without its mark.
fn applied(folder: &Path, columns: Columns, edit: &Value) -> Value {
    let mut texts = BTreeMap::new();
    for of in edit["documentChanges"].as_array().unwrap() {
        let uri = of["textDocument"]["uri"].as_str().unwrap().to_owned();
        let name = uri.rsplit('/').next().unwrap();
        let text = std::fs::read_to_string(folder.join(name)).unwrap().trim_start_matches(MARK).to_owned();
        let text = Text { uri: uri.clone(), version: 1, text, columns };
        texts.insert(uri, text.applied(&of["edits"]));
    }
    json!(texts)
}

#[test]
fn answers_and_edits_do_not_depend_on_the_marks_of_files() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let opened = FILES[1].1;
    let put = |marked: usize| {
        for (index, (path, text)) in FILES.iter().enumerate() {
            let mark = if marked >> index & 1 == 1 { MARK } else { "" };
            write(&folder, &[(*path, &format!("{mark}{text}"))]);
        }
    };
    for (encoding, subsets) in [("utf-8", [1, 2, 15]), ("utf-16", [4, 5, 15]), ("utf-32", [8, 3, 15])] {
        put(0);
        let expected = answers(&folder, encoding, opened);
        assert!(expected["renamed"].to_string().contains("codel work(a"), "{expected:?}");
        assert!(expected["moved"].to_string().contains("include \\\"centre.mal\\\" core"), "{expected:?}");
        for marked in subsets {
            put(marked);
            let found = answers(&folder, encoding, opened);
            for (what, expected) in &expected {
                assert_eq!(&found[what], expected, "{what}, {encoding}, marks: {marked:b}");
            }
        }
    }
}

#[test]
fn a_mark_that_the_client_has_is_a_column() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    write(&folder, &[("a.mal", "")]);
    let mut client = Client::of_folder(MAUVE, &folder);
    let mut text = client.open(&folder.join("a.mal"), &format!("{MARK}shell S  {{ }}\r\n"));
    assert!(client.codes(&text).is_empty());
    let of = json!({"uri": text.uri});
    let options = json!({"tabSize": 2, "insertSpaces": true});
    let edits = client.call("textDocument/formatting", json!({"textDocument": of, "options": options}));
    assert_eq!(text.applied(&edits.unwrap()), format!("{MARK}shell S {{}}\r\n"));
    client.edit(&mut text, "shell", "shel");
    let found = client.diagnostics(&text);
    assert_eq!(found[0]["range"]["start"], text.position(MARK.len()), "{found:?}");
    assert_eq!(text.position(MARK.len())["character"], 1);
}
