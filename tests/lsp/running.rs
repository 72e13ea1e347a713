//! What the server says of its own work (progress, traces, status), and how it begins again (reload, defects).

use mauve_tests::{Client, Text, address, copy, long_analysis, models, scratch, wait_for_watcher, write};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{MAUVE, copied_robot, is_unknown, robot, start};

const SOON: Duration = Duration::from_secs(10);

fn shown(client: &mut Client, text: &str) -> Value {
    let is_it = |it: &Value| it["method"] == "window/showMessage" && it.to_string().contains(text);
    client.wait(text, is_it).1["params"].clone()
}

/// Opens the robot's deployment, with a text that is not saved.
fn edited(client: &mut Client) -> Text {
    let mut text = client.open_file(&models().join("p3dx/deployment.mal"));
    client.edit(&mut text, "deadline = 1000", "deadline = 999");
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    text
}

#[test]
fn a_defect_of_the_main_loop_costs_the_requests_in_flight() {
    let mut client = robot();
    let text = edited(&mut client);
    let working = client.request("mauve/debug/work", Value::Null);
    client.forget();
    client.call("mauve/debug/panicMainLoop", Value::Null).unwrap();
    let told = shown(&mut client, "A defect of mauve: asked for. All files are read again");
    assert_eq!(told["type"], 2);
    client.answer(working).unwrap_err();
    // The text is the client's, and its diagnostics are published again.
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 999 ms"));
    let status = client.call("mauve/status", Value::Null).unwrap();
    assert_eq!((&status["documents"], &status["workspaces"][0]["files"]), (&json!(1), &json!(18)));
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn a_second_defect_of_the_main_loop_ends_the_server() {
    let mut client = robot();
    edited(&mut client);
    for _ in 0..2 {
        client.request("mauve/debug/panicMainLoop", Value::Null);
    }
    let told = shown(&mut client, "mauve ends after a second defect: asked for");
    assert_eq!(told["type"], 1);
    assert_eq!(client.wait_for_end(SOON), Some(101));
}

#[test]
fn a_text_whose_change_has_a_defect_is_unknown_until_it_is_saved() {
    let mut client = robot();
    let mut text = edited(&mut client);
    // The text of the change asks for the defect, in a build for tests.
    let end = text.text.len();
    client.replace(&mut text, end..end, "// mauve/debug/panicMainLoop");
    shown(&mut client, "A defect of mauve: asked for");
    assert!(is_unknown(&client.hint(&text, "activity navigation")));
    client.notify("textDocument/didSave", json!({"textDocument": {"uri": text.uri}, "text": text.text}));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 999 ms"));
}

#[test]
fn a_reload_reads_all_files_again() {
    let folder = copied_robot("lsp_reload");
    let mut client = Client::of_folder(MAUVE, &folder);
    let mut text = client.open_file(&folder.join("deployment.mal"));
    client.edit(&mut text, "deadline = 1000", "deadline = 900");
    let before = client.diagnostics(&text);
    assert_eq!(before.len(), 1);
    client.idle();
    let level = json!({"command": "mauve.setSignificance", "arguments": [1e-3]});
    client.call("workspace/executeCommand", level).unwrap();
    client.idle();
    client.forget();
    let waiting = client.request("mauve/debug/work", Value::Null);
    let reload =
        |client: &mut Client| client.call("workspace/executeCommand", json!({"command": "mauve.reload"}));
    assert_eq!(reload(&mut client), Ok(Value::Null));
    assert_eq!(client.answer(waiting).unwrap_err()["code"], -32801);
    // Published again, of the same version; the unsaved text and the chosen level stay.
    client.codes(&text);
    let status = client.call("mauve/status", Value::Null).unwrap();
    assert_eq!(status["workspaces"][0]["significance"], json!(1e-3));
    assert_eq!(client.hint(&text, "activity navigation"), "! 882 / 900 ms");
    let with_argument = json!({"command": "mauve.reload", "arguments": [1]});
    assert_eq!(client.call("workspace/executeCommand", with_argument).unwrap_err()["code"], -32602);
    for _ in 0..20 {
        reload(&mut client).unwrap();
    }
    client.idle();
    assert_eq!(client.hint(&text, "activity navigation"), "! 882 / 900 ms");
    assert_eq!(client.shut_down(), Some(0));
}

/// Waits for a progress; returns its token.
fn progress(client: &mut Client) -> Value {
    let (_, create) = client.wait("a progress", |it| it["method"] == "window/workDoneProgress/create");
    create["params"]["token"].clone()
}

/// Waits for a kind of report about a progress; returns its message.
fn reported(client: &mut Client, token: &Value, kind: &str, message: &str) -> Value {
    let is_it = |it: &Value| {
        it["method"] == "$/progress"
            && it["params"]["token"] == *token
            && it["params"]["value"]["kind"] == kind
            && it["params"]["value"]["message"].as_str().unwrap_or_default().contains(message)
    };
    client.wait(kind, is_it).1["params"]["value"].clone()
}

/// Starts a server whose search for models lasts while the returned file is there.
fn searching(folder: &Path) -> (Client, PathBuf) {
    let hold = folder.with_extension("hold");
    std::fs::write(&hold, "").unwrap();
    let mut client = Client::start_where(MAUVE, &[], &[("MAUVE_DEBUG_HOLD", hold.to_str().unwrap())]);
    client.initialize(Some(folder), &json!({"window": {"workDoneProgress": true}}));
    (client, hold)
}

#[test]
fn a_long_start_says_what_it_does() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_start");
    write(&folder, &long_analysis(400));
    let (mut client, hold) = searching(&folder);
    let token = progress(&mut client);
    let begin = reported(&mut client, &token, "begin", "searching for models");
    assert_eq!((&begin["title"], &begin["cancellable"]), (&json!("MAUVE"), &json!(true)));
    std::fs::remove_file(&hold).unwrap();
    reported(&mut client, &token, "report", "analysing 3 files");
    // Neither another progress nor one that never was is this one.
    for other in [json!("mauve/analysis/7"), json!(1)] {
        client.notify("window/workDoneProgress/cancel", json!({"token": other}));
    }
    client.notify("window/workDoneProgress/cancel", json!({"token": token}));
    reported(&mut client, &token, "end", "");
    client.idle();
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn a_request_that_waits_for_the_search_is_about_its_own_text() {
    let folder = copied_robot("lsp_search_and_edit");
    let (mut client, hold) = searching(&folder);
    let mut text = client.open_file(&folder.join("deployment.mal"));
    let mut rename = text.at("navigation  {");
    rename["newName"] = json!("planner");
    let before = client.request("textDocument/rename", rename);
    client.edit(&mut text, "library", "// A line more.\nlibrary");
    let after = client.request("textDocument/hover", text.at("navigation  {"));
    std::fs::remove_file(&hold).unwrap();
    assert_eq!(client.answer(before).unwrap_err()["code"], -32801);
    assert!(client.answer(after).unwrap().to_string().contains("997 ms"));
}

#[test]
fn an_edit_does_not_wait_for_a_search_of_what_others_have_made() {
    let folder = copied_robot("lsp_search_of_others");
    let (mut client, hold) = searching(&folder);
    std::fs::remove_file(&hold).unwrap();
    let mut text = client.open_file(&folder.join("deployment.mal"));
    client.diagnostics(&text);
    client.idle();
    std::fs::write(&hold, "").unwrap();
    std::fs::create_dir(folder.join("new")).unwrap();
    std::fs::write(folder.join("new/broken.mal"), "codel f(\n").unwrap();
    let settled = |client: &mut Client| client.call("mauve/status", Value::Null).unwrap()["settled"].clone();
    wait_for_watcher(SOON, || if settled(&mut client).is_null() { Ok(()) } else { Err(()) }).unwrap();
    for _ in 0..3 {
        client.edit(&mut text, "deadline = 1000", "deadline = 900");
        assert_eq!(client.codes(&text), ["deadline-missed"]);
        client.edit(&mut text, "deadline = 900", "deadline = 1000");
        assert_eq!(client.codes(&text), [] as [&str; 0]);
    }
    assert!(settled(&mut client).is_null());
    std::fs::remove_file(&hold).unwrap();
    client.wait_for_published(|published| published.contains_key(&address(&folder.join("new/broken.mal"))));
}

#[test]
fn a_file_has_its_project_while_a_whole_disk_is_searched() {
    let top = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_whole_disk");
    let robot = top.join("home/robot");
    std::fs::create_dir_all(&robot).unwrap();
    copy(&models().join("p3dx"), &robot);
    std::fs::write(top.join("broken.mal"), "codel f(\n").unwrap();
    let (mut client, hold) = searching(&top);
    std::fs::write(&hold, "whole").unwrap();
    let mut text = client.open_file(&robot.join("deployment.mal"));
    for deadline in ["999", "998"] {
        client.edit(&mut text, "deadline = 1000", &format!("deadline = {deadline}"));
        assert_eq!(client.codes(&text), [] as [&str; 0]);
        client.edit(&mut text, &format!("deadline = {deadline}"), "deadline = 1000");
    }
    assert!(client.hint(&text, "activity navigation").contains("997 / 1000 ms"));
    assert!(client.published().is_empty());
    std::fs::remove_file(&hold).unwrap();
    client.wait_for_published(|published| published.contains_key(&address(&top.join("broken.mal"))));
    assert!(client.hint(&text, "activity navigation").contains("997 / 1000 ms"));
    let found = client.call("mauve/analysis", json!({"textDocument": {"uri": text.uri}})).unwrap();
    assert_eq!(found.as_array().map(Vec::len), Some(1));
}

#[test]
fn a_search_that_is_cancelled_begins_again_after_a_change() {
    let folder = copied_robot("lsp_cancelled_search");
    let (mut client, hold) = searching(&folder);
    let mut text = client.open_file(&folder.join("deployment.mal"));
    let hover = client.request("textDocument/hover", text.at("navigation  {"));
    let token = progress(&mut client);
    reported(&mut client, &token, "begin", "searching for models");
    client.notify("window/workDoneProgress/cancel", json!({"token": token}));
    reported(&mut client, &token, "end", "");
    assert_eq!(client.codes(&text), ["analysis-stopped"]);
    let _ = client.answer(hover);
    std::fs::remove_file(&hold).unwrap();
    client.edit(&mut text, "deadline = 1000", "deadline = 999");
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 999 ms"));
}

#[test]
fn a_status_has_the_memory() {
    let folder = models().join("p3dx");
    let (mut client, _) = start(&folder, &json!({}));
    client.open_file(&folder.join("deployment.mal"));
    client.idle();
    let status = client.call("mauve/status", Value::Null).unwrap();
    if cfg!(target_os = "linux") {
        assert!(status["memory"].as_u64().unwrap() > 1_000_000, "{status}");
    }
}

/// The verdict is that of all deployments, also where no file of them is open.
#[test]
fn the_status_has_the_verdict_of_closed_files() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_status_verdict");
    let model = "codel f(): int  shell S { }  core C(S) { update = { f(); } }  component K(S, C)
architecture A { instance a: K  instance b: K }
deployment D { architecture A  activity a { priority = 2 period = 10 }  activity b { priority = 1 period = 10 } }
";
    let files =
        [("robot.mal", model), ("mauve.toml", "timing.tables = [\"t.toml\"]\n"), ("t.toml", "codel.f = 6\n")];
    write(&folder, &files);
    let mut client = start(&folder, &json!({})).0;
    // While the server works, there is none.
    let verdict = |client: &mut Client| loop {
        client.idle();
        let status = client.call("mauve/status", Value::Null).unwrap();
        if !status["verdict"].is_null() {
            return status["verdict"]["text"].clone();
        }
    };
    let mut table = client.open_file(&folder.join("t.toml"));
    assert_eq!(verdict(&mut client), "✗ 1 late");
    client.edit(&mut table, "6", "30");
    assert_eq!(verdict(&mut client), "✗ 2 late");
    client.edit(&mut table, "30", "5");
    assert_eq!(verdict(&mut client), "! 2 met · 1 tight");
    client.edit(&mut table, "f = 5", "f = ");
    assert_eq!(verdict(&mut client), "? 1 error · 2 unknown");
}
