//! Settings, by each of the three ways in which clients give them, over the real binary.

use mauve_tests::{Client, Text, address, scratch, write};
use serde_json::{Value, json};

use crate::MAUVE;

const ROBOT: &str = "\
codel plan(): int
shell S { }
core C(S) { update = { plan(); } }
component P(S, C)
architecture A { instance pilot: P }
deployment D { architecture A
  activity pilot { priority = 1 period = 100 }
}
";

/// A robot whose codel takes 20 ms at 1e-3, 30 at 1e-4 (which `mauve.toml` shows) and 50 at 1e-6.
fn start(name: &str, capabilities: Value, options: Value, settings: Value) -> (Client, Text) {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
    let project = "[timing]\ntables = [\"t.toml\"]\nsignificance = 1e-4\n[platform]\nrt_throttling = false\n";
    let table = "levels = [1e-3, 1e-4, 1e-6]\n[codel]\nplan = [20, 30, 50]\n";
    write(&folder, &[("robot.mal", ROBOT), ("mauve.toml", project), ("t.toml", table)]);
    let mut client = Client::start(MAUVE, &[]);
    client.settings = settings;
    let initialize = json!({
        "processId": null, "rootUri": address(&folder), "capabilities": capabilities, "initializationOptions": options,
    });
    client.call("initialize", initialize).unwrap();
    client.notify("initialized", json!({}));
    let robot = client.open_file(&folder.join("robot.mal"));
    (client, robot)
}

fn wait_for(client: &mut Client, robot: &Text, time: &str) {
    client.wait_for_hint(robot, "activity pilot", |hint| hint.contains(&format!(" {time} / ")));
}

fn warning(client: &mut Client) -> String {
    let (_, message) = client.wait("a warning", |it| it["method"] == "window/showMessage");
    message["params"]["message"].as_str().unwrap().to_owned()
}

#[test]
fn as_initialization_options() {
    let (mut client, robot) =
        start("settings_options", json!({}), json!({"timing": {"significance": 1e-6}}), json!(null));
    wait_for(&mut client, &robot, "50");
}

#[test]
fn settings_are_asked_of_the_client() {
    let capabilities = json!({"workspace": {
        "configuration": true, "didChangeConfiguration": {"dynamicRegistration": true},
    }});
    let set = json!({"timing": {"significance": 1e-3}, "server": {"path": "/elsewhere"}});
    let (mut client, robot) =
        start("settings_asked", capabilities, json!({"timing": {"significance": 1e-6}}), set);
    wait_for(&mut client, &robot, "20");
    let (_, registration) = client.wait("a registration", |it| it["method"] == "client/registerCapability");
    assert_eq!(registration["params"]["registrations"][0]["method"], "workspace/didChangeConfiguration");
    // What it is told then is not what holds: it asks.
    client.settings = json!({"timing": {"significance": null}});
    client.notify("workspace/didChangeConfiguration", json!({"settings": null}));
    wait_for(&mut client, &robot, "30");
    client.settings = json!({"timing": {"significance": 1e-6}});
    client.notify(
        "workspace/didChangeConfiguration",
        json!({"settings": {"mauve": {"timing": {"significance": 1}}}}),
    );
    wait_for(&mut client, &robot, "50");
}

#[test]
fn a_question_is_asked_whatever_says_that_there_is_one() {
    let capabilities = json!({"workspace": {"configuration": true}});
    let set = json!({"timing": {"significance": 1e-3}});
    let (mut client, robot) = start("settings_whatever", capabilities, json!({}), set);
    wait_for(&mut client, &robot, "20");
    for (params, level, time) in [(json!({}), 1e-6, "50"), (json!(null), 1e-3, "20"), (json!([]), 1e-6, "50")]
    {
        client.settings = json!({"timing": {"significance": level}});
        client.notify("workspace/didChangeConfiguration", params);
        wait_for(&mut client, &robot, time);
    }
}

#[test]
fn the_newest_answer_counts() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "settings_newest");
    let table = "levels = [1e-3, 1e-4, 1e-6]\n[codel]\nplan = [20, 30, 50]\n";
    write(
        &folder,
        &[("robot.mal", ROBOT), ("mauve.toml", "timing.tables = [\"t.toml\"]\n"), ("t.toml", table)],
    );
    let mut client = Client::start(MAUVE, &[]);
    client.answers_itself = false;
    client.initialize(Some(&folder), &json!({"workspace": {"configuration": true}}));
    let robot = client.open_file(&folder.join("robot.mal"));
    let question = |client: &mut Client| {
        client.wait("a question", |it| it["method"] == "workspace/configuration").1["id"].clone()
    };
    // Questions that are asked at once may arrive in any order.
    let first = question(&mut client);
    client.notify("workspace/didChangeConfiguration", json!({"settings": null}));
    let second = question(&mut client);
    for (id, level) in [(second, 1e-6), (first, 1e-3)] {
        client.send(&json!({"jsonrpc": "2.0", "id": id, "result": [{"timing": {"significance": level}}]}));
        client.idle();
        wait_for(&mut client, &robot, "50");
    }
}

#[test]
fn settings_that_the_client_sends_are_used() {
    let (mut client, robot) = start("settings_told", json!({}), json!(null), json!(null));
    wait_for(&mut client, &robot, "30");
    client.notify(
        "workspace/didChangeConfiguration",
        json!({"settings": {"mauve": {"timing": {"significance": 1e-3}}}}),
    );
    wait_for(&mut client, &robot, "20");
    client.notify("workspace/didChangeConfiguration", json!({"settings": {"timing.significance": null}}));
    wait_for(&mut client, &robot, "30");
}

#[test]
fn what_was_chosen_stays_until_another_is_set() {
    let (mut client, robot) =
        start("settings_chosen", json!({}), json!({"timing": {"significance": 1e-3}}), json!(null));
    wait_for(&mut client, &robot, "20");
    let command = json!({"command": "mauve.setSignificance", "arguments": [1e-6]});
    client.call("workspace/executeCommand", command).unwrap();
    wait_for(&mut client, &robot, "50");
    client.notify("workspace/didChangeConfiguration", json!({"settings": {"codeLens": {"enable": false}}}));
    wait_for(&mut client, &robot, "50");
    client
        .notify("workspace/didChangeConfiguration", json!({"settings": {"timing": {"significance": 1e-4}}}));
    wait_for(&mut client, &robot, "30");
}

#[test]
fn what_is_unknown_is_said_once() {
    let (mut client, robot) =
        start("settings_unknown", json!({}), json!({"timing": {"significense": 1e-6}}), json!(null));
    assert!(
        warning(&mut client)
            .contains("`mauve.timing.significense` is unknown; did you mean `mauve.timing.significance`")
    );
    wait_for(&mut client, &robot, "30");
    for _ in 0..2 {
        client.notify(
            "workspace/didChangeConfiguration",
            json!({"settings": {"timing": {"significance": "high"}}}),
        );
    }
    assert!(warning(&mut client).contains("`mauve.timing.significance` is \"high\": expected a number"));
    wait_for(&mut client, &robot, "30");
    assert_eq!(client.count(|it| it["method"] == "window/showMessage"), 0);
}

#[test]
fn what_is_switched_off_is_not_shown() {
    let off = json!({"inlayHints": {"responseTimes": false}, "codeLens": {"enable": false}});
    let (mut client, robot) = start("settings_off", json!({}), off, json!(null));
    let labels = |client: &mut Client| -> Vec<String> {
        client.hints(&robot.uri).into_iter().map(|(_, label)| label).collect()
    };
    assert!(labels(&mut client).iter().all(|label| !label.contains(" / ")));
    let lenses = json!({"textDocument": {"uri": robot.uri}});
    assert_eq!(client.call("textDocument/codeLens", lenses.clone()).unwrap(), json!([]));
    let on = json!({"inlayHints": {"responseTimes": true}, "codeLens": {"enable": true}});
    client.notify("workspace/didChangeConfiguration", json!({"settings": {"mauve": on}}));
    wait_for(&mut client, &robot, "30");
    assert_ne!(client.call("textDocument/codeLens", lenses).unwrap(), json!([]));
}
