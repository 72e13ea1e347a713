//! What is declared in a document and in all of them, and the files that one names, through the binary.

use mauve_tests::{Client, address, generated_project, scratch, write};
use serde_json::{Value, json};

use super::{MAUVE, copied_robot, start};

fn found(client: &mut Client, query: &str) -> Vec<Value> {
    client.call("workspace/symbol", json!({"query": query})).unwrap().as_array().unwrap().clone()
}

#[test]
fn symbols_of_all_files_are_found_by_a_few_letters() {
    let folder = copied_robot("lsp_workspace_symbols");
    let mut client = Client::of_folder(MAUVE, &folder);
    let best = &found(&mut client, "navC")[0];
    assert_eq!(best["name"], "NavigationCore");
    assert_eq!(best["containerName"], "navigation");
    assert_eq!(best["location"]["uri"], address(&folder.join("components/navigation.mal")));
    let text = std::fs::read_to_string(folder.join("components/navigation.mal")).unwrap();
    let start = &best["location"]["range"]["start"];
    let line = text.lines().nth(start["line"].as_u64().unwrap() as usize).unwrap();
    assert!(line[start["character"].as_u64().unwrap() as usize..].starts_with("NavigationCore("));
    // A state, by the core around it; and what is typed and not saved.
    let best = &found(&mut client, "NavigationCore.planning")[0];
    assert_eq!(
        (best["name"].as_str(), best["containerName"].as_str()),
        (Some("Planning"), Some("navigation.NavigationCore"))
    );
    let mut open = client.open_file(&folder.join("components/navigation.mal"));
    client.edit(&mut open, "state Planning", "state Pondering");
    assert_eq!(found(&mut client, "pondering")[0]["name"], "Pondering");
    assert_eq!(found(&mut client, "no such thing"), [] as [Value; 0]);
}

#[test]
fn of_many_symbols_some_are_given_the_best_first() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_many_symbols");
    let files = generated_project(200, 30);
    let files: Vec<(&str, &str)> =
        files.iter().map(|(path, text)| (path.trim_start_matches('/'), text.as_str())).collect();
    write(&folder, &files);
    let mut client = Client::of_folder(MAUVE, &folder);
    assert_eq!(found(&mut client, "").len(), 512);
    let some = found(&mut client, "o");
    assert_eq!(some.len(), 512);
}

/// The kinds after the eighteenth came later.
#[test]
fn kinds_are_those_that_a_client_knows() {
    let folder = copied_robot("lsp_symbol_kinds");
    let kinds = |capabilities: Value| {
        let (mut client, _) = start(&folder, &capabilities);
        let text = client.open_file(&folder.join("components/navigation.mal"));
        let of_document =
            client.call("textDocument/documentSymbol", json!({"textDocument": {"uri": text.uri}})).unwrap();
        let all = found(&mut client, "").into_iter().chain(of_document.as_array().unwrap().clone());
        all.map(|symbol| symbol["kind"].as_u64().unwrap()).max().unwrap()
    };
    assert!(kinds(json!({})) <= 18);
    let all = json!({"symbolKind": {"valueSet": (1..27).collect::<Vec<u32>>()}});
    assert!(kinds(json!({"workspace": {"symbol": all}, "textDocument": {"documentSymbol": all}})) > 18);
}

#[test]
fn links_lead_to_the_files_that_are_named() {
    let folder = copied_robot("lsp_document_links");
    let (mut client, _) =
        start(&folder, &json!({"textDocument": {"documentLink": {"tooltipSupport": true}}}));
    let links = |client: &mut Client, uri: &str| {
        let links = client.call("textDocument/documentLink", json!({"textDocument": {"uri": uri}})).unwrap();
        links.as_array().unwrap().clone()
    };
    // A place in a file.
    let path = folder.join("exploration_architecture.mal");
    let text = client.open_file(&path);
    let found = links(&mut client, &text.uri);
    let import = found.iter().find(|link| link["target"].as_str().unwrap().contains("#L")).unwrap();
    let target = import["target"].as_str().unwrap();
    let (file, place) = target.split_once("#L").unwrap();
    let source = std::fs::read_to_string(file.trim_start_matches("file://")).unwrap();
    let (line, column) = place.split_once(',').unwrap();
    let line = source.lines().nth(line.parse::<usize>().unwrap() - 1).unwrap();
    let name = import["tooltip"].as_str().unwrap().rsplit(['.', ' ']).next().unwrap();
    assert!(line[column.parse::<usize>().unwrap() - 1..].starts_with(name), "{line}");
    let mut text = client.open_file(&folder.join("components/navigation.mal"));
    client.edit(&mut text, "include", "/* 🦀 é */ include \"nowhere.mal\" include");
    let found = links(&mut client, &text.uri);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0]["target"], address(&folder.join("components/navigation_shell.mal")));
    assert_eq!(found[0]["tooltip"], "components/navigation_shell.mal");
    assert_eq!(found[0]["range"]["start"], text.position(text.text.find("navigation_shell").unwrap()));
    let config = client.open_file(&folder.join("mauve.toml"));
    let found = links(&mut client, &config.uri);
    let targets: Vec<&Value> = found.iter().map(|link| &link["target"]).collect();
    let expected = [address(&folder.join("exploration.mal")), address(&folder.join("timing/p3dx.toml"))];
    assert_eq!(targets, expected.each_ref().map(|it| json!(it)).iter().collect::<Vec<_>>());
}
