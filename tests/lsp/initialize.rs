//! What a client says of itself: one field that is odd costs that field.

use std::process::{Command, Stdio};
use std::time::Duration;

use mauve_tests::{Client, address, scratch};
use serde_json::{Value, json};

use super::{MAUVE, copied_robot};

/// What a client says that is all right, but for what it is.
fn good() -> Value {
    json!({
        "workspace": {"inlayHint": {"refreshSupport": true}, "symbol": {"symbolKind": {"valueSet": [1, 2]}}},
        "textDocument": {
            "hover": {"contentFormat": ["markdown"]},
            "completion": {"completionItemKind": {"valueSet": [1, 25]}},
            "semanticTokens": {
                "requests": {"range": true, "full": true}, "formats": ["relative"],
                "tokenTypes": ["class", "variable"], "tokenModifiers": [],
            },
        },
    })
}

/// Starts a session with these parameters; returns the server's capabilities.
fn began(client: &mut Client, params: Value) -> Value {
    let begun = client.call("initialize", params.clone()).unwrap_or_else(|error| panic!("{params}: {error}"));
    client.notify("initialized", json!({}));
    begun["capabilities"].clone()
}

fn roots(client: &mut Client) -> Vec<String> {
    let status = client.call("mauve/status", Value::Null).unwrap();
    let workspaces = status["workspaces"].as_array().unwrap();
    workspaces.iter().map(|it| it["folder"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn an_odd_field_costs_that_field() {
    let folder = copied_robot("initialize_odd");
    let params = json!({
        "processId": std::process::id(), "capabilities": good(),
        "workspaceFolders": [{"uri": address(&folder), "name": "robot"}],
    });
    let expected = began(&mut Client::start(MAUVE, &[]), params.clone());
    assert_eq!(expected["semanticTokensProvider"]["legend"]["tokenTypes"], json!(["class", "variable"]));
    let all_odd = [
        ("/capabilities/textDocument/semanticTokens/requests/range", json!({})),
        ("/capabilities/textDocument/semanticTokens/requests", Value::Null),
        ("/capabilities/textDocument/semanticTokens/formats", json!(["relative", "absolute", 7])),
        ("/capabilities/textDocument/semanticTokens/tokenModifiers", json!(["own", {}, 3])),
        ("/capabilities/textDocument/semanticTokens/tokenTypes", json!(["class", 9, null, "variable"])),
        (
            "/capabilities/textDocument/completion/completionItemKind/valueSet",
            json!(["text", 1, 25, 999, -1, {}]),
        ),
        ("/capabilities/workspace/symbol/symbolKind/valueSet", json!(["File", 4096, 1.5])),
        ("/capabilities/workspace/symbol", json!(7)),
        ("/capabilities/workspace/didChangeConfiguration", Value::Null),
        (
            "/capabilities/workspace/workspaceEdit",
            json!({"failureHandling": "retry", "resourceOperations": [1]}),
        ),
        ("/capabilities/general", json!({"positionEncodings": "utf-16", "staleRequestSupport": []})),
        ("/capabilities/window", json!([{"workDoneProgress": "yes"}])),
        ("/capabilities/experimental", json!("all")),
        ("/capabilities/notebookDocument", json!(1)),
        ("/trace", json!("compact")),
        ("/processId", json!("4711")),
        ("/processId", json!(-1.5e300)),
        ("/clientInfo", json!("editor 9")),
        ("/clientInfo", json!({"version": 9})),
        ("/locale", json!({"language": "en"})),
        ("/rootUri", json!(7)),
        ("/rootUri", json!("no address")),
        ("/rootPath", json!({})),
        ("/workDoneToken", json!({})),
        ("/initializationOptions", json!("fast")),
        ("/initializationOptions", json!([1, null])),
        ("/initializationOptions", json!({"mauve": 7})),
        (
            "/workspaceFolders",
            json!([{"uri": 5}, {"name": "x"}, null, {"uri": "no address"}, {"uri": address(&folder)}, "x"]),
        ),
    ];
    let set = |params: &mut Value, pointer: &str, odd: &Value| {
        let (parent, name) = pointer.rsplit_once('/').unwrap();
        params.pointer_mut(parent).unwrap()[name] = odd.clone();
    };
    let mut together = params.clone();
    for (pointer, odd) in &all_odd {
        let mut params = params.clone();
        set(&mut params, pointer, odd);
        set(&mut together, pointer, odd);
        let mut client = Client::start(MAUVE, &[]);
        assert_eq!(began(&mut client, params), expected, "{pointer}: {odd}");
        assert_eq!(roots(&mut client), [folder.to_str().unwrap()], "{pointer}: {odd}");
    }
    let mut client = Client::start(MAUVE, &[]);
    assert_eq!(began(&mut client, together), expected);
    assert_eq!(roots(&mut client), [folder.to_str().unwrap()]);
    let text = client.open_file(&folder.join("deployment.mal"));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
}

#[test]
fn no_capabilities_are_few_capabilities() {
    let folder = copied_robot("initialize_none");
    for capabilities in [Value::Null, json!([]), json!("all"), json!({"textDocument": 7, "workspace": []})] {
        let mut client = Client::start(MAUVE, &[]);
        began(&mut client, json!({"capabilities": capabilities, "rootUri": address(&folder)}));
        assert_eq!(roots(&mut client), [folder.to_str().unwrap()], "{capabilities}");
    }
    for params in [json!({"rootUri": address(&folder)}), json!({}), Value::Null, json!([])] {
        began(&mut Client::start(MAUVE, &[]), params);
    }
}

/// The server asks for settings whatever the parameters of `initialized` are.
#[test]
fn a_session_begins_whatever_initialized_has_with_it() {
    for params in [json!({}), Value::Null, json!([]), json!("yes")] {
        let mut client = Client::start(MAUVE, &[]);
        let capabilities = json!({"workspace": {"configuration": true}});
        client.call("initialize", json!({"capabilities": capabilities})).unwrap();
        client.notify("initialized", params.clone());
        client.wait("a question about settings", |it| it["method"] == "workspace/configuration");
        client.notify("workspace/didChangeConfiguration", params);
        client.wait("a second question about settings", |it| it["method"] == "workspace/configuration");
    }
}

#[test]
fn a_folder_may_be_a_path() {
    let folder = copied_robot("initialize_path");
    let empty = scratch(env!("CARGO_TARGET_TMPDIR"), "initialize_empty");
    let path = folder.to_str().unwrap();
    for (params, expected) in [
        (json!({"rootPath": path}), vec![path]),
        (json!({"rootPath": path, "rootUri": null, "workspaceFolders": null}), vec![path]),
        (json!({"rootPath": empty, "rootUri": address(&folder)}), vec![path]),
        (json!({"rootPath": empty, "workspaceFolders": [{"uri": address(&folder)}]}), vec![path]),
        (json!({"workspaceFolders": {}, "rootUri": address(&folder)}), vec![path]),
        // It is the path of another computer's folder.
        (json!({"rootPath": path, "rootUri": format!("vscode-vfs://github{path}")}), vec![]),
        (json!({"rootPath": path, "workspaceFolders": [{"uri": format!("git:{path}"), "name": ""}]}), vec![]),
        (json!({"rootUri": format!("http://localhost{path}")}), vec![]),
        (json!({"rootPath": path, "workspaceFolders": []}), vec![]),
        (json!({"rootPath": "p3dx"}), vec![]),
    ] {
        let mut params = params;
        params["capabilities"] = json!({});
        let mut client = Client::start(MAUVE, &[]);
        began(&mut client, params.clone());
        assert_eq!(roots(&mut client), expected, "{params}");
    }
}

#[test]
fn the_server_ends_with_the_process_of_its_command_line() {
    for form in [["--stdio", "--clientProcessId=N"].as_slice(), &["--clientProcessId", "N", "--stdio"]] {
        let mut other = Command::new("sleep").arg("60").stdin(Stdio::null()).spawn().unwrap();
        let process = other.id().to_string();
        let arguments: Vec<String> = form.iter().map(|it| it.replace('N', &process)).collect();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let mut client = Client::start(MAUVE, &arguments);
        // The other one that it is told of lives.
        began(&mut client, json!({"processId": std::process::id(), "capabilities": {}}));
        other.kill().unwrap();
        other.wait().unwrap();
        assert_eq!(client.wait_for_end(Duration::from_secs(10)), Some(1), "{form:?}");
    }
    // A process that is gone before the server starts does not end the server.
    let mut other = Command::new("sleep").arg("0").stdin(Stdio::null()).spawn().unwrap();
    let process = format!("--clientProcessId={}", other.id());
    other.wait().unwrap();
    let mut client = Client::start(MAUVE, &[&process]);
    began(&mut client, json!({"capabilities": {}}));
    assert_eq!(client.shut_down(), Some(0));
}

/// What a notification says beside what it is for.
#[test]
fn an_odd_field_of_a_notification_costs_no_text() {
    let folder = copied_robot("initialize_notified");
    let mut client = Client::of_folder(MAUVE, &folder);
    let text = client.open_file(&folder.join("deployment.mal"));
    let (start, end) = (text.text.find("1000").unwrap(), text.text.find("period = 1000").unwrap());
    assert!(start > end);
    let range = json!({"start": text.position(start), "end": text.position(start + 4)});
    for length in [json!(-1), json!("4"), Value::Null, json!(4.5)] {
        let change = json!({"range": range, "rangeLength": length, "text": "1000"});
        let document = json!({"uri": text.uri, "version": 2});
        client
            .notify("textDocument/didChange", json!({"textDocument": document, "contentChanges": [change]}));
        assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"), "{length}");
    }
    // What was saved is not known: neither is the text.
    client.notify("textDocument/didSave", json!({"textDocument": {"uri": text.uri}, "text": 5}));
    client.wait_for_published(|published| {
        published.get(&text.uri).is_some_and(|found| found.to_string().contains("unreadable-file"))
    });
    client.notify("textDocument/didSave", json!({"textDocument": {"uri": text.uri}, "text": text.text}));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    // A folder is one without a name, and beside an odd one.
    let event = json!({"added": [{"uri": 5}], "removed": [null, {"uri": address(&folder)}]});
    client.notify("workspace/didChangeWorkspaceFolders", json!({"event": event}));
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": text.uri}}));
    assert_eq!(roots(&mut client), [] as [&str; 0]);
}

#[test]
fn a_client_that_can_watch_files_is_asked_to() {
    let top = scratch(env!("CARGO_TARGET_TMPDIR"), "initialize_watching");
    for can_watch in [true, false] {
        let capabilities =
            json!({"workspace": {"didChangeWatchedFiles": {"dynamicRegistration": can_watch}}});
        let (mut client, _) = super::start(&top, &capabilities);
        client.idle();
        let said = client.take(Duration::ZERO);
        let asked = said.iter().filter(|it| it["method"] == "client/registerCapability");
        let asked: Vec<&Value> = asked.map(|it| &it["params"]["registrations"][0]).collect();
        assert_eq!(asked.len(), usize::from(can_watch));
        for asked in asked {
            assert_eq!(asked["method"], "workspace/didChangeWatchedFiles");
            let pattern = &asked["registerOptions"]["watchers"][0]["globPattern"];
            assert_eq!(pattern, "**/*.{mal,toml,samples,msg,yaml,yml}");
        }
    }
}
