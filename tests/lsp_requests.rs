//! Commands, and the requests that are ours alone, through the binary.

#![allow(clippy::unwrap_used, clippy::panic)]

use mauve_tests::{Client, models};
use serde_json::{Value, json};

const MAUVE: &str = env!("CARGO_BIN_EXE_mauve");

fn robot() -> Client {
    Client::of_folder(MAUVE, &models().join("p3dx"))
}

fn set_significance(client: &mut Client, arguments: Value) -> Result<Value, String> {
    let params = json!({"command": "mauve.setSignificance", "arguments": arguments});
    let answer = client.call("workspace/executeCommand", params);
    answer.map_err(|error| error["message"].as_str().unwrap().to_owned())
}

#[test]
fn another_level_is_shown_everywhere_until_it_is_taken_back() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    assert!(client.hint(&text, "activity navigation").starts_with("R 997"));
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    assert_eq!(set_significance(&mut client, json!([1e-5])), Ok(json!(1e-5)));
    // What is asked from here on is of that level, and what was shown is to be asked for again.
    assert!(client.hint(&text, "activity navigation").starts_with("unbounded"));
    assert_eq!(client.codes(&text), ["deadline-missed"]);
    client.wait("a refresh", |message| message["method"] == "workspace/inlayHint/refresh");
    let hover = client.call("textDocument/hover", text.at("navigation  {")).unwrap();
    assert!(hover["contents"]["value"].as_str().unwrap().contains("at 1e-5"), "{hover}");
    // As text too; null takes it back.
    assert_eq!(set_significance(&mut client, json!(["1e-3"])), Ok(json!(1e-3)));
    assert_eq!(set_significance(&mut client, json!([null])), Ok(Value::Null));
    assert!(client.hint(&text, "activity navigation").starts_with("R 997"));
    client.wait_for_published(|published| published.is_empty());
}

#[test]
fn a_level_that_is_none_is_refused_and_changes_nothing() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    for arguments in [
        json!([0]),
        json!([-1e-4]),
        json!([1]),
        json!(["NaN"]),
        json!(["inf"]),
        json!(["often"]),
        json!([]),
        json!([1e-4, 1e-5]),
        json!([{"level": 1e-4}]),
    ] {
        let error = set_significance(&mut client, arguments.clone()).unwrap_err();
        assert!(error.starts_with("mauve.setSignificance takes one level"), "{arguments}: {error}");
    }
    let error = set_significance(&mut client, json!([3e-4])).unwrap_err();
    assert!(error.starts_with("no time is known at 3e-4: the tables have 1e-3, 1e-4"), "{error}");
    assert!(client.hint(&text, "activity navigation").starts_with("R 997"));
}

#[test]
fn unknown_commands_are_refused() {
    let mut client = robot();
    let error = client.call("workspace/executeCommand", json!({"command": "mauve.fly"})).unwrap_err();
    assert_eq!(error["code"], -32602);
    assert_eq!(error["message"], "no command `mauve.fly`: there is mauve.setSignificance");
}
