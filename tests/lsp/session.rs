//! How a session of the language server goes whatever its client does: order, load, panics, cancellation, the end; and what
//! a client must never do.

use std::collections::HashMap;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use mauve_tests::{Client, Text, address, long_analysis, models, scratch, write};
use serde_json::{Value, json};

use super::{MAUVE, is_unknown, robot, start};

const SOON: Duration = Duration::from_secs(10);

#[test]
fn exit_ends_the_server_while_its_input_is_open() {
    let mut client = robot();
    client.call("shutdown", Value::Null).unwrap();
    client.notify("exit", Value::Null);
    assert_eq!(client.wait_for_end(SOON), Some(0));
}

#[test]
fn exit_without_shutdown_is_a_failure() {
    let mut client = robot();
    client.notify("exit", Value::Null);
    assert_eq!(client.wait_for_end(SOON), Some(1));
    // Even before anything else.
    let mut client = Client::start(MAUVE, &[]);
    client.notify("exit", Value::Null);
    assert_eq!(client.wait_for_end(SOON), Some(1));
}

#[test]
fn a_shutdown_that_is_refused_ends_nothing() {
    let mut client = Client::start(MAUVE, &[]);
    assert_eq!(client.call("shutdown", Value::Null).unwrap_err()["code"], -32002);
    client.notify("shutdown", Value::Null);
    client.initialize(Some(&models().join("p3dx")), &json!({}));
    let mut text = client.open_file(&models().join("p3dx/deployment.mal"));
    client.diagnostics(&text);
    client.edit(&mut text, "period = 1000", "period = x");
    assert!(!client.codes(&text).is_empty());
}

#[test]
fn the_end_of_the_input_ends_the_server() {
    let mut client = robot();
    client.hang_up();
    assert_eq!(client.wait_for_end(SOON), Some(1));
    let mut client = robot();
    client.call("shutdown", Value::Null).unwrap();
    client.hang_up();
    assert_eq!(client.wait_for_end(SOON), Some(0));
}

#[test]
fn the_end_of_the_input_within_a_message_ends_the_server() {
    let mut client = robot();
    client.write(b"Content-Length: 100\r\n\r\n{\"jsonrpc\"");
    client.hang_up();
    assert_eq!(client.wait_for_end(SOON), Some(1));
}

#[test]
fn a_client_that_dies_without_a_word_ends_the_server() {
    let mut other = Command::new("sleep").arg("60").stdin(Stdio::null()).spawn().unwrap();
    let mut client = Client::start(MAUVE, &[]);
    client.call("initialize", json!({"processId": other.id(), "capabilities": {}})).unwrap();
    other.kill().unwrap();
    other.wait().unwrap();
    assert_eq!(client.wait_for_end(SOON), Some(1));
}

#[test]
fn two_hundred_requests_in_flight_are_all_answered() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    let methods = ["textDocument/hover", "textDocument/definition", "textDocument/documentSymbol"];
    let ids: Vec<u64> =
        (0..200).map(|index| client.request(methods[index % 3], text.at("navigation  {"))).collect();
    for id in ids.into_iter().rev() {
        client.answer(id).unwrap();
    }
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn requests_that_wait_starve_no_other() {
    let mut client = robot();
    let working: Vec<u64> = (0..8).map(|_| client.request("mauve/debug/work", Value::Null)).collect();
    let mut text = client.open_file(&models().join("p3dx/deployment.mal"));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    client.edit(&mut text, "deadline = 1000", "deadline = 999");
    for id in working {
        assert_eq!(client.answer(id).unwrap_err()["code"], -32801);
    }
}

#[test]
fn four_hundred_edits_are_made_in_order() {
    let mut client = robot();
    let mut text = client.open_file(&models().join("p3dx/deployment.mal"));
    let line = text.text.find("period = 1000").unwrap() + "period = ".len();
    // Digits in, digits out, a question between them now and then; in the end it is another number.
    for index in 0..200 {
        let digit = (1 + index % 9).to_string();
        client.replace(&mut text, line..line, &digit);
        if index % 10 == 0 {
            client.request("textDocument/hover", text.at("navigation  {"));
        }
        client.replace(&mut text, line + 1..line + 2, "");
    }
    let number: String = text.text[line..].chars().take_while(char::is_ascii_digit).collect();
    assert_eq!((number.as_str(), text.version), ("2000", 401));
    let found = client.diagnostics(&text);
    let hint = client.hint(&text, "activity navigation");
    let mut fresh = robot();
    let again = fresh.open(&models().join("p3dx/deployment.mal"), &text.text);
    assert_eq!(found, fresh.diagnostics(&again));
    assert_eq!(hint, fresh.hint(&again, "activity navigation"));
    assert!(hint.contains("997 / "), "{hint}");
}

#[test]
fn two_texts_edited_in_one_burst() {
    let folder = models().join("p3dx");
    let mut client = robot();
    let mut deployment = client.open_file(&folder.join("deployment.mal"));
    let mut table = client.open_file(&folder.join("timing/p3dx.toml"));
    let line = table.text.lines().find(|line| line.contains("astar")).unwrap().to_owned();
    client.edit(&mut table, &line, "\"navigation.astar\" = 1");
    client.edit(&mut deployment, "deadline = 1000", "deadline = 1");
    client.edit(&mut table, "\"navigation.astar\" = 1", &line);
    client.edit(&mut deployment, "deadline = 1 }", "deadline = 1000 }");
    assert_eq!(client.codes(&deployment), [] as [&str; 0]);
    assert!(client.hint(&deployment, "activity navigation").contains("! 997 / 1000 ms"));
}

#[test]
fn a_panic_costs_one_answer() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    for _ in 0..3 {
        let error = client.call("mauve/debug/panic", Value::Null).unwrap_err();
        assert_eq!(error["code"], -32603);
        assert_eq!(error["message"], "a defect of mauve: asked for");
    }
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    assert_eq!(client.shut_down(), Some(0));
}

/// The jobs that run, when those that were told to stop have had a moment for it.
fn jobs(client: &mut Client) -> Value {
    let end = Instant::now() + SOON;
    loop {
        let jobs = client.call("mauve/status", Value::Null).unwrap()["jobs"].clone();
        if jobs == 0 || Instant::now() > end {
            return jobs;
        }
    }
}

#[test]
fn a_cancelled_request_stops_its_work() {
    let mut client = robot();
    let id = client.request("mauve/debug/work", Value::Null);
    let status = client.call("mauve/status", Value::Null).unwrap();
    assert!(status["jobs"].as_u64().unwrap() >= 1, "{status}");
    client.notify("$/cancelRequest", json!({"id": id}));
    assert_eq!(client.answer(id).unwrap_err()["code"], -32800);
    assert_eq!(jobs(&mut client), 0);
    // What is not running any more cannot be cancelled, and what never was neither.
    client.notify("$/cancelRequest", json!({"id": id}));
    client.notify("$/cancelRequest", json!({"id": "unknown"}));
    client.notify("$/cancelRequest", json!({}));
    assert_eq!(client.shut_down(), Some(0));
}

/// Waits until a request is computed beside the check.
fn wait_for_jobs(client: &mut Client) {
    let end = Instant::now() + SOON;
    while client.call("mauve/status", Value::Null).unwrap()["jobs"].as_u64() < Some(2) {
        assert!(Instant::now() < end, "the analysis does not take long");
    }
}

#[test]
fn an_edit_ends_a_long_analysis() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_long");
    write(&folder, &long_analysis(200));
    let mut client = Client::of_folder(MAUVE, &folder);
    let mut text = client.open_file(&folder.join("a.mal"));
    let params = json!({"textDocument": {"uri": text.uri}, "range": {
        "start": {"line": 0, "character": 0}, "end": {"line": 9999, "character": 0},
    }});
    let id = client.request("textDocument/inlayHint", params);
    wait_for_jobs(&mut client);
    client.edit(&mut text, "period = 1 }", "period = 2 }");
    assert_eq!(client.answer(id).unwrap_err()["code"], -32801);
    // Half of the CPU is free now, and the bounds are found at once.
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    assert_eq!(jobs(&mut client), 0);
}

#[test]
fn a_request_begins_again_after_a_change_elsewhere() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_long_again");
    write(&folder, &long_analysis(200));
    let mut client = Client::of_folder(MAUVE, &folder);
    let text = client.open_file(&folder.join("a.mal"));
    let id = client.request("textDocument/hover", text.at("p { priority"));
    wait_for_jobs(&mut client);
    let mut times = client.open_file(&folder.join("times.toml"));
    client.edit(&mut times, "999999", "5");
    let hover = client.answer(id).unwrap().to_string();
    assert!(hover.contains("**✓ 0.000005 / 1 ms**"), "{hover}");
}

#[test]
fn a_request_ends_with_its_text_whatever_the_version() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_long_version");
    write(&folder, &long_analysis(200));
    let mut client = Client::of_folder(MAUVE, &folder);
    // The client spells the address in two ways.
    let path = folder.join("a.mal");
    let spelled = address(&path).replace("a.mal", "%61.mal");
    let mut text = client.open_at(&spelled, &std::fs::read_to_string(&path).unwrap());
    let mut hover = text.at("p { priority");
    hover["textDocument"]["uri"] = json!(address(&path));
    let id = client.request("textDocument/hover", hover);
    wait_for_jobs(&mut client);
    text.version -= 1;
    client.edit(&mut text, "codel f", "// A line more.\ncodel f");
    assert_eq!(client.answer(id).unwrap_err()["code"], -32801);
}

#[test]
fn a_request_that_waits_for_a_cancelled_one_is_answered() {
    let mut client = robot();
    let mut text = client.open_file(&models().join("p3dx/deployment.mal"));
    let all = json!({"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}});
    let mut ids = Vec::new();
    for round in 0..500 {
        let (old, new) = if round % 2 == 0 { ("= 1000 }", "= 900 }") } else { ("= 900 }", "= 1000 }") };
        client.edit(&mut text, old, new);
        let document = json!({"uri": text.uri});
        let hints = json!({"textDocument": document, "range": all});
        // They ask for the same analysis, as the check does that follows the edit.
        let of_round = [
            client.request("textDocument/inlayHint", hints.clone()),
            client.request("textDocument/hover", text.at("navigation  {")),
            client.request("textDocument/inlayHint", hints),
        ];
        // Each round cancels at another moment of the work.
        std::thread::sleep(Duration::from_micros(100 * (round % 10)));
        client.notify("$/cancelRequest", json!({"id": of_round[round as usize % 3]}));
        ids.extend(of_round);
    }
    for id in ids {
        if let Err(error) = client.answer(id) {
            assert!([-32800, -32801].contains(&error["code"].as_i64().unwrap()), "{error}");
        }
    }
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    assert_eq!(client.count(|it| it.to_string().contains("defect")), 0);
}

#[test]
fn an_analysis_that_takes_long_says_so() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_progress");
    write(&folder, &long_analysis(400));
    let (mut client, _) = start(&folder, &json!({"window": {"workDoneProgress": true}}));
    let mut text = client.open_file(&folder.join("a.mal"));
    let (_, create) = client.wait("a progress", |it| it["method"] == "window/workDoneProgress/create");
    let of_this = |it: &Value, kind: &str| {
        it["method"] == "$/progress"
            && it["params"]["token"] == create["params"]["token"]
            && it["params"]["value"]["kind"] == kind
    };
    client.wait("its beginning", |it| of_this(it, "begin"));
    client.edit(&mut text, "period = 1 }", "period = 2 }");
    client.wait("its end", |it| of_this(it, "end"));
    assert_eq!(client.codes(&text), [] as [&str; 0]);
}

#[test]
fn requests_before_initialize_and_after_shutdown_are_refused() {
    let mut client = Client::start(MAUVE, &[]);
    assert_eq!(client.call("textDocument/hover", json!({})).unwrap_err()["code"], -32002);
    client.notify(
        "textDocument/didOpen",
        json!({"textDocument": {"uri": "file:///a.mal", "languageId": "mauve", "version": 1, "text": ""}}),
    );
    client.initialize(None, &json!({}));
    assert_eq!(client.call("initialize", json!({"capabilities": {}})).unwrap_err()["code"], -32600);
    client.call("shutdown", Value::Null).unwrap();
    assert_eq!(client.call("textDocument/hover", json!({})).unwrap_err()["code"], -32600);
    client.notify("exit", Value::Null);
    assert_eq!(client.wait_for_end(SOON), Some(0));
}

#[test]
fn nothing_is_said_unasked_after_shutdown() {
    let mut client = robot();
    let mut text = client.open_file(&models().join("p3dx/deployment.mal"));
    client.diagnostics(&text);
    // The answer to `shutdown` comes before the check of this is done.
    client.edit(&mut text, "deadline = 1000", "deadline = 700");
    client.call("shutdown", Value::Null).unwrap();
    client.forget();
    // No request is answered any more that could tell when the check has ended.
    client.settle(Duration::from_millis(200));
    assert_eq!(client.count(|it| it.get("method").is_some()), 0);
    client.notify("exit", Value::Null);
    assert_eq!(client.wait_for_end(SOON), Some(0));
}

#[test]
fn messages_that_are_none_cost_an_error_each() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    let bad: [&[u8]; 5] = [
        b"Content-Length: 5\r\n\r\n{\"a\":",
        b"Content-Length: 2\r\n\r\n\xff\xfe",
        b"Content-Length: 2\r\n\r\n[]",
        b"Content-Length: 7\r\n\r\n{\"a\":1}",
        b"Content-Length: 37\r\n\r\n{\"jsonrpc\":\"1.0\",\"id\":9,\"method\":\"x\"}",
    ];
    for bytes in bad {
        client.write(bytes);
        let (_, error) = client.wait("an error", |it| it.get("error").is_some());
        assert!([-32700, -32600].contains(&error["error"]["code"].as_i64().unwrap()), "{error}");
    }
    for unknown in ["no/such/method", "$/such/method"] {
        assert_eq!(client.call(unknown, json!({})).unwrap_err()["code"], -32601);
    }
    assert_eq!(client.call("textDocument/hover", json!({"textDocument": 5})).unwrap_err()["code"], -32602);
    client.notify("no/such/notification", json!({}));
    // An answer that nobody has asked for.
    client.send(&json!({"jsonrpc": "2.0", "id": 4711, "result": null}));
    // One of them may have been a change: the text that is saved is known again.
    assert!(is_unknown(&client.hint(&text, "activity navigation")));
    client.notify("textDocument/didSave", json!({"textDocument": {"uri": text.uri}, "text": text.text}));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn unknown_files_and_places_outside_a_text() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    let start = json!({"line": 0, "character": 0});
    for uri in ["file:///no/such/file.mal", "untitled:x", "git:/a.mal", "file:///"] {
        let error =
            client.call("textDocument/hover", json!({"textDocument": {"uri": uri}, "position": start}));
        assert_eq!(error.unwrap_err()["code"], -32602, "{uri}");
    }
    for (line, character) in [(0, u32::MAX), (u32::MAX, 0), (u32::MAX, u32::MAX), (16, 9999)] {
        let position = json!({"line": line, "character": character});
        let at = json!({"textDocument": {"uri": text.uri}, "position": position});
        client.call("textDocument/hover", at.clone()).unwrap();
        client.call("textDocument/definition", at).unwrap();
        let range = json!({"start": position, "end": start});
        client
            .call("textDocument/inlayHint", json!({"textDocument": {"uri": text.uri}, "range": range}))
            .unwrap();
    }
    // A file of the workspace need not be open.
    let uri = address(&models().join("p3dx/exploration.mal"));
    client.call("textDocument/documentSymbol", json!({"textDocument": {"uri": uri}})).unwrap();
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn versions_and_openings_that_are_wrong() {
    let path = models().join("p3dx/deployment.mal");
    let mut client = robot();
    let change = |uri: &str, version: i64, text: &str| json!({"textDocument": {"uri": uri, "version": version}, "contentChanges": [{"text": text}]});
    // A text that is not open, closed twice, saved.
    client.notify("textDocument/didChange", change("file:///no.mal", 2, "codel"));
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": "file:///no.mal"}}));
    client
        .notify("textDocument/didSave", json!({"textDocument": {"uri": "file:///no.mal"}, "text": "codel"}));
    // Opened twice; versions that fall: what came last counts.
    client.open(&path, "codel f(");
    let mut text = client.open_file(&path);
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    client.notify("textDocument/didChange", change(&text.uri, -5, "codel f(): int\n"));
    text.version = -5;
    assert_eq!(client.hints(&text.uri), []);
    client.diagnostics(&text);
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn a_change_that_means_nothing_leaves_nothing_to_trust() {
    let mut client = robot();
    let mut text = client.open_file(&models().join("p3dx/deployment.mal"));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    let range = json!({"start": {"line": -1, "character": 0}, "end": {"line": 0, "character": 0}});
    let change = json!({"range": range, "text": "x"});
    let document = json!({"uri": text.uri, "version": 2});
    let params = json!({"textDocument": document, "contentChanges": [change]});
    let change = json!({"jsonrpc": "2.0", "method": "textDocument/didChange", "params": params}).to_string();
    // Half of a surrogate pair, as JavaScript writes it, is no JSON to others.
    let half = change.replace("-1", "0").replace("\"x\"", r#""\ud83e""#);
    // A method is no number.
    let none = change.replace("\"2.0\"", "2");
    for bad in [change, half, none] {
        client.write(format!("Content-Length: {}\r\n\r\n{bad}", bad.len()).as_bytes());
        let hint = client.hint(&text, "activity navigation");
        assert!(is_unknown(&hint), "{hint}");
        client.wait_for_published(|published| {
            published.get(&text.uri).is_some_and(|found| found.to_string().contains("unreadable-file"))
        });
        // The text that is saved is known.
        client.notify("textDocument/didSave", json!({"textDocument": {"uri": text.uri}, "text": text.text}));
        assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    }
    client.edit(&mut text, "deadline = 1000", "deadline = 700");
    assert_eq!(client.codes(&text), ["deadline-missed"]);
}

#[test]
fn a_client_that_does_not_read_is_waited_for_and_left() {
    let path = models().join("p3dx/deployment.mal");
    let mut client = robot();
    let mut text = client.open_file(&path);
    client.diagnostics(&text);
    client.stop_reading();
    // Far more than a pipe holds.
    let document = json!({"textDocument": {"uri": text.uri}});
    let ids: Vec<u64> =
        (0..100).map(|_| client.request("textDocument/documentSymbol", document.clone())).collect();
    let line = text.text.find("period = 1000").unwrap() + "period = ".len();
    for _ in 0..2000 {
        client.replace(&mut text, line..line, "1");
        client.replace(&mut text, line..line + 1, "");
    }
    client.read_on();
    for id in ids {
        let answer = client.answer(id);
        assert!(answer.is_ok() || answer.is_err_and(|error| error["code"] == -32801));
    }
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    // Nor does it keep the server from its end.
    client.stop_reading();
    for _ in 0..100 {
        client.request("textDocument/documentSymbol", document.clone());
    }
    client.notify("exit", Value::Null);
    assert_eq!(client.wait_for_end(SOON), Some(1));
}

/// A session in which the response time of navigation is shown, and a file on the disk that it rests on.
fn with_figures() -> (Client, Text, std::path::PathBuf) {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    (client, text, models().join("p3dx/components/navigation.mal"))
}

#[test]
fn a_text_that_cannot_be_understood_is_unknown_until_it_is_known() {
    let (mut client, text, other) = with_figures();
    let uri = address(&other);
    let saved = std::fs::read_to_string(&other).unwrap();
    let open = |document: Value| json!({"jsonrpc": "2.0", "method": "textDocument/didOpen", "params": {"textDocument": document}});
    let document =
        |version: Value| json!({"uri": uri, "languageId": "mauve", "version": version, "text": saved});
    let without = |field: &str| {
        let mut document = document(1.into());
        document.as_object_mut().unwrap().remove(field);
        open(document).to_string()
    };
    let change = json!({"range": {"start": {"line": 0, "character": 0}, "end": {"line": 0, "character": 0}}, "text": " "});
    let params = json!({"textDocument": {"uri": uri, "version": 2}, "contentChanges": [change]});
    let not_open =
        json!({"jsonrpc": "2.0", "method": "textDocument/didChange", "params": params}).to_string();
    let bad = [
        without("languageId"),
        without("version"),
        without("text"),
        open(document("1".into())).to_string(),
        open(document((1_u64 << 40).into())).to_string(),
        not_open,
        // A notification is no request.
        open(document(1.into())).to_string().replacen('{', r#"{"id":null,"#, 1),
    ];
    for bad in bad {
        client.write(format!("Content-Length: {}\r\n\r\n{bad}", bad.len()).as_bytes());
        // No figure of the disk stays, and the client is told.
        client.wait_for_hint(&text, "activity navigation", is_unknown);
        client.wait_for_published(|published| {
            published.get(&uri).is_some_and(|found| found.to_string().contains("unreadable-file"))
        });
        // The whole text is known; and then the disk's is.
        client.open(&other, &saved);
        client.wait_for_hint(&text, "activity navigation", |hint| hint.contains("! 997 / 1000 ms"));
        client.notify("textDocument/didClose", json!({"textDocument": {"uri": uri}}));
        client.wait_for_published(HashMap::is_empty);
        assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    }
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn a_text_is_unknown_by_each_of_its_addresses() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "session_addresses");
    mauve_tests::copy(&models().join("p3dx"), &folder.join("robot"));
    std::os::unix::fs::symlink("robot", folder.join("link")).unwrap();
    let mut client = Client::of_folder(MAUVE, &folder.join("robot"));
    let mut first = client.open_file(&folder.join("robot/deployment.mal"));
    let second = client.open_file(&folder.join("link/deployment.mal"));
    client.wait_for_hint(&first, "activity navigation", |hint| hint.contains("! 997 / 1000 ms"));
    let bad =
        json!({"textDocument": {"uri": second.uri, "version": "x"}, "contentChanges": [{"text": "lost"}]});
    client.notify("textDocument/didChange", bad);
    client.wait_for_hint(&first, "activity navigation", is_unknown);
    // A change of the first does not make the text of the second known.
    client.edit(&mut first, "period = 1000", "period = 1001");
    client.edit(&mut first, "period = 1001", "period = 1000");
    client.diagnostics(&first);
    assert!(is_unknown(&client.hint(&first, "activity navigation")));
    client.notify("textDocument/didSave", json!({"textDocument": {"uri": second.uri}, "text": second.text}));
    client.wait_for_hint(&first, "activity navigation", |hint| hint.contains("! 997 / 1000 ms"));
}

#[test]
fn what_is_lost_of_a_folder_is_no_text() {
    let (mut client, text, _) = with_figures();
    let folder = address(&models().join("p3dx"));
    let params = json!({"event": {"added": [{"uri": folder, "name": "robot"}, {"uri": 5}], "removed": []}});
    client.notify("workspace/didChangeWorkspaceFolders", params);
    let document = json!({"uri": folder, "languageId": "mauve", "version": 1, "text": ""});
    client.notify("textDocument/didOpen", json!({"textDocument": document}));
    client.notify("textDocument/didChange", json!({"textDocument": {"uri": folder}, "contentChanges": []}));
    client.idle();
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    let status = client.call("mauve/status", Value::Null).unwrap();
    assert_eq!(status["workspaces"].as_array().map(Vec::len), Some(1), "{status}");
}

/// Nobody knows where the next message begins: the client starts the server again.
#[test]
fn a_message_of_a_wrong_length_ends_the_session() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "session_wrong_length");
    let log = folder.join("log");
    let next = "Content-Length: 2\r\n\r\n{}";
    for (sent, reason) in [
        (format!("Content-Length: 9\r\n\r\n{{}}{next}"), "a message without Content-Length"),
        (format!("Content-Length: 1\r\n\r\n{{}}{next}"), "is not a header"),
        (format!("Content-Length: x\r\n\r\n{{}}{next}"), "is not a valid Content-Length"),
        (format!("{{}}\n{next}"), "is not a header"),
    ] {
        let mut client = Client::start(MAUVE, &["--log", log.to_str().unwrap()]);
        client.initialize(None, &json!({}));
        client.write(sent.as_bytes());
        assert_eq!(client.wait_for_end(SOON), Some(1), "{sent}");
        let logged = std::fs::read_to_string(&log).unwrap();
        assert!(
            logged.lines().any(|line| line.contains("the client's stream") && line.contains(reason)),
            "{logged}"
        );
        std::fs::remove_file(&log).unwrap();
    }
}

#[test]
fn a_client_that_sends_no_message_is_left() {
    let mut client = robot();
    client.write(b"{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"shutdown\"}\n");
    assert_eq!(client.wait_for_end(Duration::from_secs(30)), Some(1));
}
