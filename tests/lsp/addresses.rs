//! Which addresses are files on the disk, and what becomes of the texts at other ones.

use std::path::{Path, PathBuf};

use mauve_tests::{Client, Text, address, is_publication, whole_text};
use serde_json::{Value, json};

use super::{MAUVE, copied_robot, is_unknown};

const FIGURE: &str = "activity navigation";

/// A robot whose open text misses a deadline, which its saved text meets.
fn late(name: &str) -> (PathBuf, Client, Text) {
    let folder = copied_robot(name);
    let mut client = Client::of_folder(MAUVE, &folder);
    let mut text = client.open_file(&folder.join("deployment.mal"));
    client.edit(&mut text, "deadline = 1000", "deadline = 700");
    assert_eq!(client.codes(&text), ["deadline-missed"]);
    (folder, client, text)
}

fn is_late(client: &mut Client, text: &Text) -> bool {
    client.hint(text, FIGURE) == "✗ 997 / 700 ms"
}

/// Addresses by which editors show another text than that of the file.
fn addresses_of_others(path: &Path) -> Vec<String> {
    let path = path.to_str().unwrap();
    vec![
        format!("git:{path}?%7B%22path%22%3A%22{path}%22%2C%22ref%22%3A%22HEAD%22%7D"),
        format!("git:{path}?{{\"path\":\"{path}\",\"ref\":\"~\"}}"),
        format!("GIT:{path}"),
        format!("gitlens://localhost{path}?ref=main"),
        format!("http://localhost{path}"),
        format!("https:{path}"),
        format!("review:{path}?commentId=1"),
        format!("vscode-local-history:{path}"),
        format!("vscode-userdata:{path}"),
        format!("vscode-remote://ssh-remote%2Brobot{path}"),
        format!("fugitive://{path}"),
        format!("untitled:{path}"),
        format!("filesystem:{path}"),
        format!("file://server{path}"),
        format!("file://{path}?ref=HEAD"),
        format!("file://{path}?"),
        format!("file://{path}#L3"),
    ]
}

fn close(client: &mut Client, uri: &str) {
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": uri}}));
}

fn change(client: &mut Client, uri: &str, text: &str) {
    let document = json!({"uri": uri, "version": 2});
    client.notify(
        "textDocument/didChange",
        json!({"textDocument": document, "contentChanges": [{"text": text}]}),
    );
}

#[test]
fn a_text_beside_the_file_changes_no_figure() {
    let (folder, mut client, text) = late("lsp_addresses_beside");
    let path = folder.join("deployment.mal");
    let saved = std::fs::read_to_string(&path).unwrap();
    for other in addresses_of_others(&path) {
        let shown = client.open_at(&other, &saved);
        assert!(is_late(&mut client, &text), "{other}");
        client.idle();
        let published = client.published();
        let is_alone = |uri: &str| uri == text.uri || uri.starts_with("untitled:");
        assert!(published.keys().all(|uri| is_alone(uri)), "{other}: {published:?}");
        // Its own names, and no figure.
        let of = json!({"textDocument": {"uri": shown.uri}});
        let symbols = client.call("textDocument/documentSymbol", of.clone()).unwrap();
        assert!(symbols.to_string().contains("P3dxDeployment"), "{other}: {symbols}");
        assert!(!client.call("textDocument/foldingRange", of.clone()).unwrap().is_null(), "{other}");
        let hints = client.call("textDocument/inlayHint", whole_text(&shown.uri)).unwrap().to_string();
        assert!(!hints.contains("997") && !hints.contains(" / "), "{other}: {hints}");
        let hover = client.call("textDocument/hover", shown.at("navigation  {")).unwrap().to_string();
        assert!(!hover.contains("997"), "{other}: {hover}");
        change(&mut client, &other, &saved.replace("period = 1000", "period = 5000"));
        assert!(is_late(&mut client, &text), "{other}, changed");
        client.notify("textDocument/didSave", json!({"textDocument": {"uri": other}, "text": saved}));
        close(&mut client, &other);
        assert!(is_late(&mut client, &text), "{other}, closed");
        client.idle();
        let published = client.published();
        assert_eq!(published.keys().collect::<Vec<_>>(), [&text.uri], "{other}");
        client.forget();
    }
}

/// Whatever is asked about such a text is answered, and without a figure or a place of the project.
#[test]
fn every_question_about_a_text_beside_the_files_is_answered() {
    let (folder, mut client, text) = late("lsp_addresses_asked");
    let shown = client.open_at(&format!("git:{}?HEAD", text.uri.trim_start_matches("file://")), &text.text);
    let at = shown.at("navigation  {");
    for method in [
        "codeLens",
        "completion",
        "declaration",
        "definition",
        "diagnostic",
        "documentHighlight",
        "documentLink",
        "hover",
        "implementation",
        "prepareCallHierarchy",
        "prepareRename",
        "prepareTypeHierarchy",
        "references",
        "rename",
        "semanticTokens/full",
        "signatureHelp",
        "typeDefinition",
        "codeAction",
        "inlayHint",
        "formatting",
    ] {
        let mut params = at.clone();
        if method != "completion" && method != "signatureHelp" {
            params["context"] = json!({"includeDeclaration": true, "diagnostics": []});
        }
        params["newName"] = json!("n");
        params["options"] = json!({"tabSize": 2, "insertSpaces": true});
        params["range"] = whole_text(&shown.uri)["range"].clone();
        let answer = client.call(&format!("textDocument/{method}"), params);
        // What cannot be renamed is said.
        let code = answer.as_ref().err().map(|error| error["code"].as_i64());
        assert!(code.is_none_or(|code| code == Some(-32803)), "{method}: {answer:?}");
        let answer = format!("{answer:?}");
        assert!(!answer.contains("997") && !answer.contains("file://"), "{method}: {answer}");
    }
    let found = client.call("textDocument/references", {
        let mut params = text.at("navigation  {");
        params["context"] = json!({"includeDeclaration": true});
        params
    });
    let found = found.unwrap().to_string();
    assert!(found.contains(&text.uri) && !found.contains("git:"), "{found}");
    assert!(is_late(&mut client, &text) && folder.exists());
}

/// A closed file is read from the disk, whatever else is shown of it.
#[test]
fn a_text_beside_a_closed_file_is_not_the_file() {
    let (folder, mut client, text) = late("lsp_addresses_closed");
    let closed = ["components/navigation.mal", "mauve.toml", "timing/p3dx.toml"].map(|it| folder.join(it));
    let before = client.call("mauve/status", Value::Null).unwrap()["workspaces"].clone();
    for other in closed.iter().flat_map(|path| addresses_of_others(path)) {
        client.open_at(&other, "codel f(");
        assert!(is_late(&mut client, &text), "{other}");
        // A question about a closed text is an error: the file on the disk is not that text.
        close(&mut client, &other);
        let of = json!({"textDocument": {"uri": other}});
        let error = client.call("textDocument/documentSymbol", of).unwrap_err();
        assert_eq!(error["code"], -32602, "{other}: {error}");
    }
    assert_eq!(client.call("mauve/status", Value::Null).unwrap()["workspaces"], before);
}

#[test]
fn a_file_has_an_address_in_many_spellings() {
    let folder = copied_robot("lsp_addresses_spelled");
    let path = folder.join("deployment.mal").to_str().unwrap().to_owned();
    let wrong = std::fs::read_to_string(&path).unwrap().replace("deadline = 1000", "deadline = 700");
    for spelled in [
        format!("file://{path}"),
        format!("file:{path}"),
        format!("FILE://{path}"),
        format!("file://localhost{path}"),
        format!("file://LocalHost{path}"),
        format!("file://{}", path.replace("deployment", "%64eploymen%74")),
        format!("file://{}", path.replace("/deployment", "/components/../deployment")),
    ] {
        let mut client = Client::of_folder(MAUVE, &folder);
        let text = client.open_at(&spelled, &wrong);
        assert!(is_late(&mut client, &text), "{spelled}");
        close(&mut client, &spelled);
        let plain = client.open_file(Path::new(&path));
        assert!(client.hint(&plain, FIGURE).contains("! 997 / 1000 ms"), "{spelled}");
    }
}

#[test]
fn an_address_that_is_none_is_ignored() {
    let (folder, mut client, mut text) = late("lsp_addresses_none");
    let path = folder.join("deployment.mal").to_str().unwrap().to_owned();
    let saved = std::fs::read_to_string(&path).unwrap();
    client.idle();
    client.forget();
    for none in
        [format!("_diff_right:{path}"), path.clone(), String::new(), "a b".to_owned(), "//".to_owned()]
    {
        client.open_at(&none, &saved);
        assert!(is_late(&mut client, &text), "{none}: opened");
        client.edit(&mut text, "deadline = 700", "deadline = 1000");
        change(&mut client, &none, "codel f(");
        assert!(client.hint(&text, FIGURE).contains("! 997 / 1000 ms"), "{none}: changed");
        client.notify("textDocument/didSave", json!({"textDocument": {"uri": none}, "text": "codel"}));
        client.edit(&mut text, "deadline = 1000", "deadline = 700");
        let asked = json!({"textDocument": {"uri": none}, "position": {"line": 0, "character": 0}});
        assert_eq!(client.call("textDocument/hover", asked).unwrap_err()["code"], -32602);
        close(&mut client, &none);
        assert!(is_late(&mut client, &text), "{none}: closed");
        client.idle();
        assert_eq!(client.published().keys().collect::<Vec<_>>(), [&text.uri], "{none}");
        assert_eq!(client.count(|it| is_publication(it, &none)), 0, "{none}");
        assert_eq!(client.count(|it| it["method"] == "window/showMessage"), 0, "{none}");
    }
}

#[test]
fn folders_commands_and_renames_take_files_alone() {
    let (folder, mut client, text) = late("lsp_addresses_folders");
    let other = copied_robot("lsp_addresses_other");
    let of = |uri: String| json!([{"uri": uri, "name": "x"}]);
    let before = client.call("mauve/status", Value::Null).unwrap()["workspaces"].clone();
    for scheme in ["git:", "http://localhost", "vscode-vfs://github", "_none:", "file://server"] {
        let event = json!({
            "added": of(format!("{scheme}{}", other.display())),
            "removed": of(format!("{scheme}{}", folder.display())),
        });
        client.notify("workspace/didChangeWorkspaceFolders", json!({"event": event}));
        assert_eq!(client.call("mauve/status", Value::Null).unwrap()["workspaces"], before, "{scheme}");
        let core = folder.join("navigation_architecture.mal");
        let renamed = |to: &str| format!("{scheme}{}{to}", core.display());
        let files = json!({"files": [{"oldUri": renamed(""), "newUri": renamed("x.mal")}]});
        assert_eq!(client.call("workspace/willRenameFiles", files).unwrap(), Value::Null, "{scheme}");
        let core = format!("{scheme}{}", core.display());
        let command = json!({"command": "mauve.generateOrocos", "arguments": [core]});
        assert!(client.call("workspace/executeCommand", command).is_err(), "{scheme}");
        let asked = json!({"textDocument": {"uri": core}});
        assert!(client.call("mauve/analysis", asked).is_err(), "{scheme}");
    }
    let core = address(&folder.join("navigation_architecture.mal"));
    let files = json!({"files": [{"oldUri": core, "newUri": core.replace("navigation_", "n")}]});
    let edit = client.call("workspace/willRenameFiles", files).unwrap().to_string();
    assert!(edit.contains("narchitecture.mal"), "{edit}");
    assert!(is_late(&mut client, &text));
}

/// An editor that shows a hundred diffs has no folder searched.
#[test]
fn a_text_beside_the_files_has_nothing_loaded() {
    let folder = copied_robot("lsp_addresses_loads");
    let log = folder.join("server.log");
    let mut client = Client::start(MAUVE, &["--log", log.to_str().unwrap()]);
    client.initialize(Some(&folder), &json!({}));
    let text = client.open_file(&folder.join("deployment.mal"));
    client.diagnostics(&text);
    client.idle();
    let loads = || std::fs::read_to_string(&log).unwrap().matches("workspaces loaded").count();
    let before = loads();
    assert!(before > 0);
    for commit in 0..20 {
        let side = format!("git:{}?{commit}", folder.join("exploration.mal").display());
        client.open_at(&side, "codel f(): int\n");
        client.idle();
        change(&mut client, &side, "#id: \"another language\"\ncategory C {}\n");
        client.idle();
        close(&mut client, &side);
        client.idle();
    }
    assert_eq!(loads(), before);
}

/// The two sides of a diff and the file, opened, changed and closed in any order.
#[test]
fn a_diff_is_shown_while_the_file_is_edited() {
    let folder = copied_robot("lsp_addresses_diff");
    let path = folder.join("deployment.mal");
    let saved = std::fs::read_to_string(&path).unwrap();
    let mut client = Client::of_folder(MAUVE, &folder);
    let sides = [format!("git:{}?ref=HEAD", path.display()), format!("_diff_right:{}", path.display())];
    let mut are_open = [false; 2];
    let mut file: Option<Text> = None;
    let mut seed = 7_u64;
    let mut next = |below: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) % below
    };
    for step in 0..60 {
        let side = next(4) as usize;
        match (sides.get(side).zip(are_open.get_mut(side)), &mut file) {
            (Some((uri, is_open)), _) => {
                if !*is_open {
                    client.open_at(uri, &saved);
                } else if next(2) == 0 {
                    change(&mut client, uri, &saved.replace("deadline = 1000", "deadline = 7"));
                    continue;
                } else {
                    close(&mut client, uri);
                }
                *is_open = !*is_open;
            }
            (None, None) => file = Some(client.open_file(&path)),
            (None, Some(text)) if next(4) == 0 => {
                close(&mut client, &text.uri);
                file = None;
            }
            (None, Some(text)) => {
                let (from, to) = match text.text.contains("deadline = 700") {
                    true => ("deadline = 700", "deadline = 1000"),
                    false => ("deadline = 1000", "deadline = 700"),
                };
                client.edit(text, from, to);
            }
        }
        let is_missed = file.as_ref().is_some_and(|text| text.text.contains("deadline = 700"));
        if let Some(text) = &file {
            let hint = client.hint(text, FIGURE);
            assert!(!is_unknown(&hint) && hint.starts_with('✗') == is_missed, "{step}: {hint}");
        }
        client.idle();
        let published: Vec<String> = client.published().into_keys().collect();
        let expected: Vec<String> = file.iter().filter(|_| is_missed).map(|text| text.uri.clone()).collect();
        assert_eq!(published, expected, "{step}");
        client.forget();
    }
}
