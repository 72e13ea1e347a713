//! Completion and signature help through the protocol, for an editor that can do everything and for one that can do nothing.

use mauve_tests::Text;
use serde_json::{Value, json};

use super::{copied_robot, start};

fn able() -> Value {
    json!({
        "general": {"positionEncodings": ["utf-16"]},
        "textDocument": {
            "completion": {"completionItem": {
                "snippetSupport": true, "insertReplaceSupport": true, "labelDetailsSupport": true,
                "commitCharactersSupport": true, "documentationFormat": ["markdown"],
                "insertTextModeSupport": {"valueSet": [1, 2]},
            }},
            "signatureHelp": {"signatureInformation": {
                "documentationFormat": ["markdown"], "parameterInformation": {"labelOffsetSupport": true},
            }},
        },
    })
}

/// What a request about the end of the first `before` needs.
fn behind(text: &Text, before: &str) -> Value {
    let offset = text.text.find(before).unwrap() + before.len();
    json!({"textDocument": {"uri": text.uri}, "position": text.position(offset)})
}

fn item<'a>(list: &'a Value, label: &str) -> &'a Value {
    let items = list["items"].as_array().unwrap();
    let found = items.iter().find(|item| item["label"] == label);
    found.unwrap_or_else(|| panic!("no {label} in {items:?}"))
}

#[test]
fn an_able_editor_gets_snippets_details_and_documentation() {
    let folder = copied_robot("lsp_completion_able");
    let (mut client, _) = start(&folder, &able());
    let mut text = client.open_file(&folder.join("exploration_architecture.mal"));
    client.edit(
        &mut text,
        "connection hokuyo.scan -> gmapping.scan",
        "/* 🦀 é */ connection hokuyo.scan -> gm",
    );
    let list = client.call("textDocument/completion", behind(&text, "hokuyo.scan -> gm")).unwrap();
    let port = item(&list, "gmapping.scan");
    assert_eq!(port["labelDetails"]["detail"], ": LaserScan");
    let place = behind(&text, "é */ connection hokuyo.scan -> ")["position"].clone();
    assert_eq!(port["textEdit"]["insert"]["start"], place);
    assert_eq!(port["textEdit"]["replace"]["start"], place);
    assert_eq!(port["textEdit"]["newText"], "gmapping.scan");
    assert!(port["documentation"].is_null());
    // While the list is open, the user types on.
    client.edit(&mut text, "-> gm\n", "-> gma\n");
    let resolved = client.call("completionItem/resolve", port.clone()).unwrap();
    assert_eq!(resolved["documentation"]["value"], "```mauve\ninput port scan: LaserScan\n```\n");

    let mut deployment = client.open_file(&folder.join("deployment.mal"));
    client.edit(
        &mut deployment,
        "    activity gmapping    { affinity = 2  priority = 3   period = 1000  deadline = 1000 }",
        "    act",
    );
    let list = client.call("textDocument/completion", behind(&deployment, "    act")).unwrap();
    let activity = item(&list, "activity gmapping");
    assert_eq!(activity["insertTextFormat"], 2);
    assert_eq!(
        activity["textEdit"]["newText"],
        "activity gmapping { affinity = ${1:2} priority = ${2:1} period = ${3:100} }"
    );
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn a_type_brings_its_use() {
    let folder = copied_robot("lsp_completion_use");
    let (mut client, _) = start(&folder, &able());
    let mut text = client.open_file(&folder.join("components/hokuyo.mal"));
    client.edit(&mut text, "output port scan: LaserScan", "output port scan: MarkerA");
    let list = client.call("textDocument/completion", behind(&text, "port scan: MarkerA")).unwrap();
    assert_eq!(list["isIncomplete"], true);
    let message = item(&list, "MarkerArray");
    let more = message["additionalTextEdits"][0]["newText"].as_str().unwrap();
    assert_eq!(more, "\n  use visualization_msgs");
    let resolved = client.call("completionItem/resolve", message.clone()).unwrap();
    assert!(resolved["documentation"]["value"].as_str().unwrap().contains("Marker[] markers"));
}

#[test]
fn a_plain_editor_gets_text() {
    let folder = copied_robot("lsp_completion_plain");
    let (mut client, _) = start(&folder, &json!({}));
    let mut text = client.open_file(&folder.join("components/navigation.mal"));
    client.edit(&mut text, "found = astar(here, destination, grid, resolution, route);", "found = as");
    let list = client.call("textDocument/completion", behind(&text, "found = as")).unwrap();
    let codel = item(&list, "astar");
    assert_eq!(codel["textEdit"]["newText"], "astar");
    assert!(codel["insertTextFormat"].is_null() && codel["labelDetails"].is_null());
    assert!(codel["detail"].as_str().unwrap().starts_with("(in origin: PoseStamped"));
    let resolved = client.call("completionItem/resolve", codel.clone()).unwrap();
    let said = resolved["documentation"].as_str().unwrap();
    assert!(said.starts_with("codel astar(") && said.contains("A shortest path"), "{said}");
    // A comparison is no connection.
    let mut at = behind(&text, "if (gap >");
    at["context"] = json!({"triggerKind": 2, "triggerCharacter": ">"});
    assert_eq!(client.call("textDocument/completion", at).unwrap(), Value::Null);
}

#[test]
fn a_signature_follows_the_arguments() {
    let folder = copied_robot("lsp_signature");
    for (capabilities, label) in
        [(able(), json!([30, 57])), (json!({}), json!("in destination: PoseStamped"))]
    {
        let (mut client, _) = start(&folder, &capabilities);
        let mut text = client.open_file(&folder.join("components/navigation.mal"));
        client.edit(
            &mut text,
            "astar(here, destination, grid, resolution, route);",
            "/* é 🦀 */ astar(here, ",
        );
        let help = client.call("textDocument/signatureHelp", behind(&text, "astar(here, ")).unwrap();
        let signature = &help["signatures"][0];
        assert!(
            signature["label"].as_str().unwrap().starts_with("astar(in origin: PoseStamped, in destination")
        );
        assert_eq!(help["activeParameter"], 1);
        assert_eq!(signature["parameters"][1]["label"], label);
        let said = signature["documentation"].to_string();
        assert!(said.contains("A shortest path"), "{said}");
        let nothing =
            client.call("textDocument/signatureHelp", behind(&text, "library navigation {")).unwrap();
        assert_eq!(nothing, Value::Null);
    }
}
