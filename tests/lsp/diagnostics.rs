//! Diagnostics for a client that asks for them, and an analysis that the user stops, over the real binary.

use mauve_tests::{Client, Text, address, is_publication, long_analysis, scratch, write};
use serde_json::{Value, json};

use super::{MAUVE, start};

const PARTS: &str = "\
codel plan(): int
shell S { }
core C(S) { update = { plan(); } }
component P(S, C)
";

const ROBOT: &str = "\
include \"parts.mal\"
architecture A { instance pilot: P }
deployment D { architecture A  activity pilot { priority = 1 period = 100 } }
";

/// A robot in two files whose codel takes 40 ms, and a client that asks.
fn asking(name: &str, client_name: &str) -> (Client, Text, Text, Value) {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
    write(
        &folder,
        &[
            ("parts.mal", PARTS),
            ("robot.mal", ROBOT),
            (
                "mauve.toml",
                "[project]\nroot = \"robot.mal\"\n[timing]\ntables = [\"t.toml\"]\n[platform]\nrt_throttling = false\n",
            ),
            ("t.toml", "[codel]\nplan = 40\n"),
        ],
    );
    let mut client = Client::start(MAUVE, &[]);
    let server = client.call(
        "initialize",
        json!({
            "processId": null, "rootUri": null, "clientInfo": {"name": client_name},
            "workspaceFolders": [{"uri": address(&folder), "name": "robot"}],
            "capabilities": {
                "workspace": {"diagnostics": {"refreshSupport": true}},
                "textDocument": {"diagnostic": {}},
            },
        }),
    );
    client.notify("initialized", json!({}));
    let parts = client.open_file(&folder.join("parts.mal"));
    let robot = client.open_file(&folder.join("robot.mal"));
    (client, parts, robot, server.unwrap()["capabilities"]["diagnosticProvider"].clone())
}

/// Asks what is wrong in a file, as often as the server says to; gives the codes and the result id.
fn ask(client: &mut Client, text: &Text, known: Option<&str>) -> (Option<Vec<String>>, String) {
    loop {
        let params = json!({"textDocument": {"uri": text.uri}, "previousResultId": known});
        match client.call("textDocument/diagnostic", params) {
            Ok(report) => {
                let id = report["resultId"].as_str().unwrap().to_owned();
                return (codes(&report), id);
            }
            Err(error) => {
                assert_eq!(
                    (&error["code"], &error["data"]["retriggerRequest"]),
                    (&json!(-32802), &json!(true))
                );
            }
        }
    }
}

/// The codes of a report; none where it says that nothing is new.
fn codes(report: &Value) -> Option<Vec<String>> {
    let items = report["items"].as_array().filter(|_| report["kind"] == "full");
    assert!(items.is_some() || report["kind"] == "unchanged", "{report}");
    Some(items?.iter().map(|item| item["code"].as_str().unwrap().to_owned()).collect())
}

fn wait_for_refresh(client: &mut Client) {
    client.wait("a refresh", |it| it["method"] == "workspace/diagnostic/refresh");
}

#[test]
fn who_asks_is_not_told() {
    let (mut client, mut parts, _, provider) = asking("pull_document", "an editor");
    let expected =
        json!({"identifier": "mauve", "interFileDependencies": true, "workspaceDiagnostics": true});
    assert_eq!(provider, expected);
    let (found, first) = ask(&mut client, &parts, None);
    assert_eq!(found.unwrap(), [] as [&str; 0]);
    assert_eq!(ask(&mut client, &parts, Some(&first)).0, None, "nothing is new");
    client.edit(&mut parts, "plan(); }", "pla(); }");
    let (found, second) = ask(&mut client, &parts, Some(&first));
    assert_eq!(found.unwrap(), ["unresolved-codel"]);
    assert_ne!(first, second);
    client.idle();
    assert_eq!(client.count(|it| it["method"] == "textDocument/publishDiagnostics"), 0);
}

#[test]
fn an_edit_in_one_file_has_it_ask_again_about_another() {
    let (mut client, mut parts, robot, _) = asking("pull_refresh", "an editor");
    let (_, id) = ask(&mut client, &robot, None);
    ask(&mut client, &parts, None);
    client.idle();
    client.forget();
    client.edit(&mut parts, "plan(); }", "plan(); plan(); plan(); }");
    ask(&mut client, &parts, None);
    wait_for_refresh(&mut client);
    assert_eq!(ask(&mut client, &robot, Some(&id)).0.unwrap(), ["deadline-missed"]);
    ask(&mut client, &parts, None);
    client.idle();
    client.forget();
    // What has the same findings as before is not to be asked for.
    client.edit(&mut parts, "shell S { }", "shell S {  }");
    ask(&mut client, &parts, None);
    client.idle();
    assert_eq!(client.count(|it| it["method"] == "workspace/diagnostic/refresh"), 0);
}

#[test]
fn who_asks_about_all_files_is_told_of_none() {
    let (mut client, mut parts, robot, _) = asking("pull_workspace", "an editor");
    client.edit(&mut parts, "plan(); }", "plan(); plan(); plan(); }");
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": robot.uri}}));
    // It is closed, and nobody has asked about it.
    client.wait("its diagnostics", |it| {
        is_publication(it, &robot.uri) && it["params"]["diagnostics"] != json!([])
    });
    client.forget();
    let all = |client: &mut Client, known: Value| {
        let report = client.call("workspace/diagnostic", json!({"previousResultIds": known})).unwrap();
        let items = report["items"].as_array().unwrap().clone();
        let shown = |it: &Value| (it["uri"].as_str().unwrap().to_owned(), codes(it));
        (items.iter().map(shown).collect::<Vec<_>>(), items)
    };
    let (shown, items) = all(&mut client, json!([]));
    let owned = |all: &[&str]| Some(all.iter().map(|&it| it.to_owned()).collect::<Vec<_>>());
    let table = parts.uri.replace("parts.mal", "t.toml");
    let overloaded = (table.clone(), owned(&["overloading-times"]));
    let missed = (robot.uri.clone(), owned(&["deadline-missed"]));
    assert_eq!(shown, [(parts.uri.clone(), owned(&[])), missed, overloaded]);
    client.wait("that it is told nothing", |it| {
        is_publication(it, &robot.uri) && it["params"]["diagnostics"] == json!([])
    });
    let known: Vec<Value> =
        items.iter().map(|it| json!({"uri": it["uri"], "value": it["resultId"]})).collect();
    assert!(all(&mut client, json!(known)).0.iter().all(|(_, codes)| codes.is_none()));
    client.edit(&mut parts, "plan(); plan(); plan(); }", "plan(); }");
    let (shown, _) = all(&mut client, json!(known));
    let solved = [robot.uri.clone(), table].map(|uri| (uri, owned(&[])));
    assert_eq!(shown, [&[(parts.uri.clone(), None)][..], &solved].concat(), "what is solved is said");
    client.idle();
    assert_eq!(client.count(|it| is_publication(it, &robot.uri)), 0);
}

#[test]
fn a_client_that_asks_wrongly_about_all_files_is_not_invited_to() {
    let (mut client, parts, _, provider) = asking("pull_neovim", "Neovim");
    assert_eq!(provider["workspaceDiagnostics"], false);
    assert_eq!(ask(&mut client, &parts, None).0.unwrap(), [] as [&str; 0]);
}

#[test]
fn a_question_that_is_cancelled_does_not_keep_the_next_refresh_away() {
    let (mut client, mut parts, robot, _) = asking("pull_cancel", "an editor");
    ask(&mut client, &parts, None);
    ask(&mut client, &robot, None);
    for _ in 0..20 {
        let id = client.request("textDocument/diagnostic", json!({"textDocument": {"uri": robot.uri}}));
        client.notify("$/cancelRequest", json!({"id": id}));
        let _ = client.answer(id);
    }
    client.idle();
    ask(&mut client, &robot, None);
    client.idle();
    client.forget();
    client.edit(&mut parts, "plan(); }", "plan(); plan(); plan(); }");
    wait_for_refresh(&mut client);
}

#[test]
fn a_file_that_is_opened_does_not_wait_for_a_long_analysis() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_first");
    let mut files = long_analysis(400);
    files[0].1 += "include \"parts.mal\"\n";
    // Whether the comment is needed is known after all files were checked.
    let parts = "codel spare(): int   // mauve: allow(unused-codel) for the next robot\ncore Z(S) { update = { g(1); } }\n";
    files.push(("/parts.mal".to_owned(), parts.to_owned()));
    write(&folder, &files);
    let (mut client, _) = start(&folder, &json!({}));
    let text = client.open_file(&folder.join("parts.mal"));
    client.wait_for_diagnostics(&text);
    let own = client.published()[&text.uri].clone();
    assert_eq!(own.as_array().unwrap().iter().map(|it| &it["code"]).collect::<Vec<_>>(), ["argument-count"]);
    let of_deployment = address(&folder.join("a.mal"));
    assert_eq!(client.count(|it| is_publication(it, &of_deployment)), 0, "the analysis takes longer");
}

#[test]
fn an_analysis_that_the_user_stops_leaves_nothing_that_may_not_hold() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_stop");
    write(&folder, &long_analysis(400));
    let (mut client, _) = start(&folder, &json!({"window": {"workDoneProgress": true}}));
    let mut text = client.open_file(&folder.join("a.mal"));
    let (_, create) = client.wait("a progress", |it| it["method"] == "window/workDoneProgress/create");
    let begins = |it: &Value| it["method"] == "$/progress" && it["params"]["value"]["kind"] == "begin";
    let (_, begin) = client.wait("its beginning", begins);
    assert_eq!(begin["params"]["value"]["cancellable"], true);
    client.notify("window/workDoneProgress/cancel", json!({"token": create["params"]["token"]}));
    assert_eq!(client.codes(&text), ["analysis-stopped"]);
    // Nobody analyses it behind the user's back.
    let hint = json!({
        "textDocument": {"uri": text.uri},
        "range": {"start": {"line": 0, "character": 0}, "end": {"line": 9, "character": 0}},
    });
    assert_eq!(client.call("textDocument/inlayHint", hint).unwrap(), json!([]));
    client.edit(&mut text, "period = 1 }", "period = 2 }");
    assert_eq!(client.codes(&text), [] as [&str; 0], "the next edit is analysed");
}

#[test]
fn who_asks_is_told_that_the_analysis_was_stopped_and_left_in_peace() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_stop_pull");
    write(&folder, &long_analysis(400));
    let (mut client, _) = start(
        &folder,
        &json!({
            "window": {"workDoneProgress": true},
            "workspace": {"diagnostics": {"refreshSupport": true}, "inlayHint": {"refreshSupport": true}},
            "textDocument": {"diagnostic": {}},
        }),
    );
    let text = client.open_file(&folder.join("a.mal"));
    let (_, create) = client.wait("a progress", |it| it["method"] == "window/workDoneProgress/create");
    client
        .wait("its beginning", |it| it["method"] == "$/progress" && it["params"]["value"]["kind"] == "begin");
    client.notify("window/workDoneProgress/cancel", json!({"token": create["params"]["token"]}));
    assert_eq!(ask(&mut client, &text, None).0.unwrap(), ["analysis-stopped"]);
    wait_for_hint_refresh(&mut client);
    client.idle();
    client.forget();
    assert_eq!(ask(&mut client, &text, None).0.unwrap(), ["analysis-stopped"]);
    client.idle();
    assert_eq!(client.count(|it| it["method"] == "workspace/diagnostic/refresh"), 0);
}

fn wait_for_hint_refresh(client: &mut Client) {
    client.wait("that hints are to be asked for again", |it| it["method"] == "workspace/inlayHint/refresh");
}

#[test]
fn what_is_mended_in_a_file_that_is_not_open_is_to_be_asked_for() {
    let (mut client, mut parts, robot, _) = asking("pull_mended", "an editor");
    client.edit(&mut parts, "plan(); }", "plan(); plan(); plan(); }");
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": robot.uri}}));
    client.call("workspace/diagnostic", json!({"previousResultIds": []})).unwrap();
    ask(&mut client, &parts, None);
    client.idle();
    client.forget();
    client.edit(&mut parts, "plan(); plan(); plan(); }", "plan(); }");
    ask(&mut client, &parts, None);
    wait_for_refresh(&mut client);
}
