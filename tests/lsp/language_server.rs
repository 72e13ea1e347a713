//! The language server over its standard streams: what a client sees while a deployment is edited.

use std::path::Path;
use std::time::Duration;

use mauve_tests::{Client, Columns, address, is_publication, mauve, scratch, wait_for_watcher, write};
use serde_json::{Value, json};

use super::{MAUVE, copied_robot, is_unknown, start};

#[test]
fn hints_and_warnings_follow_an_edit() {
    let folder = copied_robot("lsp_edit");
    let mut client = Client::of_folder(MAUVE, &folder);
    let mut text = client.open_file(&folder.join("deployment.mal"));
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    assert_eq!(client.hint(&text, "activity navigation"), "! 997 / 1000 ms");
    client.edit(
        &mut text,
        "priority = 2   period = 1000  deadline = 1000",
        "priority = 2   period = 1000  deadline = 996",
    );
    assert_eq!(client.codes(&text), ["deadline-missed"]);
    assert_eq!(client.hint(&text, "activity navigation"), "✗ 997 / 996 ms");
    client.wait("that hints are to be asked for again", |it| it["method"] == "workspace/inlayHint/refresh");
    client.edit(&mut text, "deadline = 996", "deadline = 1000");
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    assert_eq!(client.hint(&text, "activity navigation"), "! 997 / 1000 ms");
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn a_hover_explains_an_activity() {
    let folder = copied_robot("lsp_hover");
    let mut client = Client::of_folder(MAUVE, &folder);
    let mut text = client.open_file(&folder.join("deployment.mal"));
    client.edit(&mut text, "period = 1000  deadline = 1000", "period = 1000  deadline = 700");
    let hover = client.call("textDocument/hover", text.at("navigation  {")).unwrap();
    let shown = hover["contents"]["value"].as_str().unwrap();
    for part in [
        "**✗ 997 / 700 ms** ▰▰▰▰▰▰ 143 %, missed by 297 ms at 1e-4\n",
        "| own time      | 2        | 1 × 297 ms | 297 ms | ██████    |\n",
        " | 9        | 10 × 43 ms | 430 ms | ████████▋ |\n",
        "| **response time** |          |            | **997 ms** |",
        "exceeds the deadline",
    ] {
        assert!(shown.contains(part), "{part} in {shown}");
    }
    // The name of an activity leads to it.
    let link = format!("| [`hokuyo`]({}#L9,14)        |", address(&folder.join("deployment.mal")));
    assert!(shown.contains(&link), "{link} in {shown}");
    // The same stands behind the hint.
    let range = json!({"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}});
    let hints = client
        .call("textDocument/inlayHint", json!({"textDocument": {"uri": text.uri}, "range": range}))
        .unwrap();
    let hint = hints
        .as_array()
        .unwrap()
        .iter()
        .find(|hint| hint["label"].as_str().unwrap().contains("997 / 700 ms"))
        .unwrap();
    let resolved = client.call("inlayHint/resolve", hint.clone()).unwrap();
    assert_eq!(resolved["tooltip"]["value"], shown);
    // In another text, something else may stand there.
    client.edit(&mut text, "library", "// A line more.\nlibrary");
    assert_eq!(client.call("inlayHint/resolve", hint.clone()).unwrap_err()["code"], -32801);
}

#[test]
fn definitions_cross_files() {
    let folder = copied_robot("lsp_definition");
    let mut client = Client::of_folder(MAUVE, &folder);
    let text = client.open_file(&folder.join("deployment.mal"));
    let found = client.call("textDocument/definition", text.at("navigation  {")).unwrap();
    assert_eq!(found[0]["targetUri"], address(&folder.join("navigation_architecture.mal")));
    let architecture = client.open_file(&folder.join("navigation_architecture.mal"));
    let found = client.call("textDocument/definition", architecture.at("Navigation\n")).unwrap();
    assert_eq!(found[0]["targetUri"], address(&folder.join("components/navigation.mal")));
    let symbols =
        client.call("textDocument/documentSymbol", json!({"textDocument": {"uri": text.uri}})).unwrap();
    assert_eq!(symbols[0]["name"], "exploration");
    assert_eq!(symbols[0]["children"][0]["children"][7]["name"], "navigation");
}

#[test]
fn diagnostics_are_those_of_the_command_line() {
    let folder = copied_robot("lsp_command_line");
    let path = folder.join("components/navigation.mal");
    let broken = std::fs::read_to_string(&path).unwrap().replace("astar(", "astra(");
    std::fs::write(&path, &broken).unwrap();
    let mut client = Client::of_folder(MAUVE, &folder);
    let deployment = client.open_file(&folder.join("deployment.mal"));
    client.diagnostics(&deployment);
    let run = mauve(MAUVE, &folder, &["check", "--format", "json"]);
    let expected: Value = serde_json::from_str(&run.out).unwrap();
    let expected: Vec<(&str, &str)> = expected["diagnostics"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|it| it["severity"] != "hint")
        .map(|it| (it["code"].as_str().unwrap(), it["message"].as_str().unwrap()))
        .collect();
    assert!(!expected.is_empty());
    let mut expected = expected;
    expected.sort_unstable();
    client.wait_for_published(|published| {
        let all = published.values().flat_map(|found| found.as_array().unwrap());
        let mut found: Vec<(&str, &str)> =
            all.map(|it| (it["code"].as_str().unwrap(), it["message"].as_str().unwrap())).collect();
        found.sort_unstable();
        found == expected
    });
}

#[test]
fn tables_and_models_that_change_on_the_disk_are_seen() {
    let folder = copied_robot("lsp_disk");
    let mut client = Client::of_folder(MAUVE, &folder);
    let text = client.open_file(&folder.join("deployment.mal"));
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    let table = folder.join("timing/p3dx.toml");
    let old = std::fs::read_to_string(&table).unwrap();
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    client.forget();

    // A table that another tool writes; the client is told to ask for its hints again.
    let astar = old.lines().find(|line| line.contains("astar")).unwrap();
    let faster = old.replace(astar, "\"navigation.astar\" = 1");
    let is_as_before = |hint: &str| hint.contains("! 997 / 1000 ms");
    let is_shorter = |hint: &str| hint.ends_with(" / 1000 ms") && !hint.contains("997");
    client.idle();
    client.forget();
    std::fs::write(&table, &faster).unwrap();
    client.wait("a refresh", |it| it["method"] == "workspace/inlayHint/refresh");
    client.wait_for_hint(&text, "activity navigation", is_shorter);
    std::fs::write(&table, &old).unwrap();
    client.wait_for_hint(&text, "activity navigation", is_as_before);

    // A model that goes away and comes back.
    let model = folder.join("components/navigation.mal");
    let model_text = std::fs::read_to_string(&model).unwrap();
    std::fs::remove_file(&model).unwrap();
    client.wait("an unresolved include", |it| it.to_string().contains("unresolved-include"));
    client.wait_for_hint(&text, "activity navigation", is_unknown);
    std::fs::write(&model, model_text).unwrap();
    client.wait_for_hint(&text, "activity navigation", is_as_before);

    // A folder that is taken away and put back, as another branch does.
    std::fs::rename(folder.join("timing"), folder.join("elsewhere")).unwrap();
    client.wait_for_hint(&text, "activity navigation", is_unknown);
    std::fs::rename(folder.join("elsewhere"), folder.join("timing")).unwrap();
    client.wait_for_hint(&text, "activity navigation", is_as_before);
    // Another one at once in its place, in which somebody writes later.
    write(&folder, &[("another/p3dx.toml", &faster)]);
    std::fs::rename(folder.join("timing"), folder.join("elsewhere")).unwrap();
    std::fs::rename(folder.join("another"), folder.join("timing")).unwrap();
    client.wait_for_hint(&text, "activity navigation", is_shorter);
    std::fs::write(&table, &old).unwrap();
    client.wait_for_hint(&text, "activity navigation", is_as_before);
    std::fs::remove_dir_all(folder.join("elsewhere")).unwrap();

    // The configuration: another level.
    let config = folder.join("mauve.toml");
    let config_text = std::fs::read_to_string(&config).unwrap();
    std::fs::write(&config, config_text.replace("significance = 1e-4", "significance = 1e-1")).unwrap();
    wait_for_watcher(Duration::from_secs(20), || {
        let hints = client.hints(&text.uri);
        if hints.iter().any(|(_, label)| label.starts_with("? no time")) { Ok(()) } else { Err(hints) }
    })
    .unwrap();

    // A table by another name, which the pattern of the configuration takes too.
    std::fs::write(folder.join("timing/more.toml"), "codel.nothing = 5\n").unwrap();
    client.wait("a key that means nothing", |it| it.to_string().contains("unknown-timing-key"));
}

#[test]
fn a_table_is_followed_while_it_is_typed() {
    let folder = copied_robot("lsp_table");
    let mut client = Client::of_folder(MAUVE, &folder);
    let text = client.open_file(&folder.join("deployment.mal"));
    let mut table = client.open_file(&folder.join("timing/p3dx.toml"));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    let line = table.text.lines().find(|line| line.contains("astar")).unwrap().to_owned();
    client.edit(&mut table, &line, "\"navigation.astar\" = 1");
    let hint = client.hint(&text, "activity navigation");
    assert!(hint.ends_with(" / 1000 ms") && !hint.contains("997"), "{hint}");
    // Half typed, nothing is known; and the disk's text counts again when the editor closes it.
    client.edit(&mut table, "\"navigation.astar\" = 1", "\"navigation.astar\" = ");
    assert!(is_unknown(&client.hint(&text, "activity navigation")));
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": table.uri}}));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
}

#[test]
fn includes_are_followed_while_they_are_typed() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_include");
    let outside = folder.join("outside/part.mal");
    write(
        &folder,
        &[
            (".git/HEAD", ""),
            ("outside/part.mal", "codel f(): int\n"),
            ("robot/mauve.toml", ""),
            ("robot/root.mal", ""),
        ],
    );
    let mut client = Client::of_folder(MAUVE, &folder.join("robot"));
    let mut text = client.open(&folder.join("robot/root.mal"), "include \"../outside/par.mal\"\n");
    assert_eq!(client.codes(&text), ["unresolved-include"]);
    client.edit(&mut text, "par.mal", "part.mal");
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    // What was read then is followed too.
    std::fs::write(&outside, "codel f(): \n").unwrap();
    client.wait("an error outside", |it| {
        is_publication(it, &address(&outside)) && it.to_string().contains("syntax-error")
    });
}

#[test]
fn a_file_by_itself_and_a_text_that_is_no_file() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_alone");
    let mut client = Client::start(MAUVE, &[]);
    client.initialize(None, &json!({}));
    let file = client.open(&folder.join("new.mal"), "codel f(: int\n");
    assert_eq!(client.codes(&file), ["syntax-error"]);
    let mut untitled = client.open_at("untitled:Untitled-1", "codel f(: int\n");
    assert_eq!(client.codes(&untitled), ["syntax-error"]);
    client.edit(&mut untitled, "f(:", "f():");
    assert_eq!(client.codes(&untitled), [] as [&str; 0]);
    // What is closed has no diagnostics any more.
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": file.uri}}));
    client.wait("no diagnostics", |it| {
        is_publication(it, &file.uri) && it["params"]["diagnostics"] == json!([])
    });
}

#[test]
fn a_text_that_is_no_file_includes_nothing() {
    let mut client = Client::start(MAUVE, &[]);
    client.initialize(None, &json!({}));
    // There is such a file where the server was started, and that is nobody's business.
    let mut untitled = client.open_at("untitled:Untitled-1", "include \"Cargo.toml\"\n");
    assert_eq!(client.codes(&untitled), ["unresolved-include"]);
    client.edit(&mut untitled, "include \"Cargo.toml\"", "codel f(");
    assert_eq!(client.codes(&untitled), ["syntax-error"]);
}

#[test]
fn nothing_is_remembered_that_nobody_watched() {
    let folder = copied_robot("lsp_reopen");
    let mut client = Client::start(MAUVE, &[]);
    client.initialize(None, &json!({}));
    let text = client.open_file(&folder.join("deployment.mal"));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": text.uri}}));
    client.call("mauve/status", Value::Null).unwrap();
    let table = folder.join("timing/p3dx.toml");
    let old = std::fs::read_to_string(&table).unwrap();
    let astar = old.lines().find(|line| line.contains("astar")).unwrap();
    std::fs::write(&table, old.replace(astar, "\"navigation.astar\" = 1")).unwrap();
    let text = client.open_file(&folder.join("deployment.mal"));
    assert!(!client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
}

#[test]
fn one_file_by_two_addresses() {
    let folder = copied_robot("lsp_links");
    let link = folder.join("link.mal");
    std::os::unix::fs::symlink(folder.join("deployment.mal"), &link).unwrap();
    let mut client = Client::of_folder(MAUVE, &folder);
    let mut text = client.open_file(&folder.join("deployment.mal"));
    let mut linked = client.open_file(&link);
    client.edit(&mut text, "deadline = 1000", "deadline = 700");
    assert_eq!(client.codes(&text), ["deadline-missed"]);
    // The text that was changed last is analysed; beside the other, nothing is claimed.
    client.wait("the message about the other text", |it| {
        is_publication(it, &linked.uri) && it.to_string().contains("under another URI")
    });
    assert_eq!(client.hints(&linked.uri), []);
    client.edit(&mut linked, "deadline = 1000", "deadline = 700");
    assert_eq!(client.codes(&linked), ["deadline-missed"]);
    // What is closed by one address is still open by the other.
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": linked.uri}}));
    assert_eq!(client.hint(&text, "activity navigation"), "✗ 997 / 700 ms");
}

#[test]
fn a_text_that_is_closed_and_opened_at_once_has_its_diagnostics() {
    let folder = copied_robot("lsp_close_open");
    let mut client = Client::of_folder(MAUVE, &folder);
    let broken = std::fs::read_to_string(folder.join("deployment.mal"))
        .unwrap()
        .replace("deadline = 1000", "deadline = 7");
    let text = client.open(&folder.join("deployment.mal"), &broken);
    let expected = ["deadline-missed", "deadline-missed"];
    assert_eq!(client.codes(&text), expected);
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": text.uri}}));
    let text = client.open(&folder.join("deployment.mal"), &broken);
    assert_eq!(client.codes(&text), expected);
}

#[test]
fn columns_are_counted_as_agreed() {
    let text = "/* é \u{1f916} */ deployment D { architecture A  activity pilot { priority = 1 period = 5 deadline = 9 } }\n";
    for (name, columns) in [("utf-8", Columns::Utf8), ("utf-16", Columns::Utf16), ("utf-32", Columns::Utf32)]
    {
        let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_columns");
        let (mut client, server) = start(&folder, &json!({"general": {"positionEncodings": [name]}}));
        assert_eq!(server["positionEncoding"], name);
        let mut open = client.open(&folder.join("a.mal"), text);
        open.columns = columns;
        client.edit(&mut open, "deadline = 9", "deadline = 8");
        client.edit(&mut open, "\u{1f916}", "\u{1f916}\u{1f916}");
        let found = client.diagnostics(&open);
        let unknown = found.iter().find(|it| it["code"] == "unresolved-architecture").unwrap();
        assert_eq!(unknown["range"]["start"], open.position(open.text.find("A ").unwrap()), "{name}");
    }
}

#[test]
fn a_code_leads_to_its_page() {
    let folder = copied_robot("lsp_pages");
    let cache = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_pages_cache");
    let mut client = Client::start_where(MAUVE, &[], &[("XDG_CACHE_HOME", cache.to_str().unwrap())]);
    let publish = json!({"textDocument": {"publishDiagnostics": {"codeDescriptionSupport": true}}});
    client.initialize(Some(&folder), &publish);
    let mut text = client.open_file(&folder.join("deployment.mal"));
    client.edit(&mut text, "deadline = 1000", "deadline = 700");
    let found = client.diagnostics(&text);
    let page = found[0]["codeDescription"]["href"].as_str().unwrap().strip_prefix("file://").unwrap();
    assert!(page.starts_with(cache.to_str().unwrap()), "{page}");
    assert!(std::fs::read_to_string(page).unwrap().starts_with("# deadline-missed\n"));
}

#[test]
fn a_plain_client_is_served_too() {
    let folder = copied_robot("lsp_plain");
    let (mut client, _) = start(&folder, &json!({}));
    let mut text = client.open_file(&folder.join("deployment.mal"));
    client.edit(&mut text, "deadline = 1000", "deadline = 700");
    let found = client.diagnostics(&text);
    assert_eq!(found[0]["code"], "deadline-missed");
    assert_eq!(found[0].get("relatedInformation"), None);
    let hover = client.call("textDocument/hover", text.at("navigation  {")).unwrap();
    assert_eq!(hover["contents"]["kind"], "plaintext");
    let shown = hover["contents"]["value"].as_str().unwrap();
    assert!(shown.contains("✗ 997 / 700 ms ▰▰▰▰▰▰ 143 %, missed by 297 ms at 1e-4\n"), "{shown}");
    assert!(!shown.contains("```") && !shown.contains('|') && !shown.contains("](file"), "{shown}");
    let found = client.call("textDocument/definition", text.at("navigation  {")).unwrap();
    assert_eq!(found[0]["uri"], address(&folder.join("navigation_architecture.mal")));
    let symbols =
        client.call("textDocument/documentSymbol", json!({"textDocument": {"uri": text.uri}})).unwrap();
    let navigation = symbols.as_array().unwrap().iter().find(|it| it["name"] == "navigation").unwrap();
    assert_eq!(navigation["containerName"], "P3dxDeployment");
    client.idle();
    assert_eq!(client.count(|it| it["method"] == "workspace/inlayHint/refresh"), 0);
}

/// Hovers, tooltips of hints, documentation of completions and signatures: for a client that names plain text, or names nothing.
#[test]
fn plain_text_has_no_signs_of_markdown() {
    let folder = copied_robot("lsp_plain_text");
    let comment = "// Finds `a_way` of **few** turns, see [0; 1] and a\\_b <b>.\n  codel astar(";
    let signs = ["```", "**", "\\_", "\\*", "&lt;", "&nbsp;", "](", "| ---", "|--"];
    let format = json!(["plaintext"]);
    let plain = json!({"textDocument": {
        "hover": {"contentFormat": format},
        "completion": {"completionItem": {"documentationFormat": format}},
        "signatureHelp": {"signatureInformation": {"documentationFormat": format}},
    }});
    for capabilities in [plain, json!({})] {
        let (mut client, _) = start(&folder, &capabilities);
        let mut shown: Vec<String> = Vec::new();
        let mut of_astar = 0;
        for name in [
            "components/navigation.mal",
            "components/navigation_shell.mal",
            "deployment.mal",
            "timing/p3dx.toml",
        ] {
            let mut text = client.open_file(&folder.join(name));
            let is_commented = text.text.contains("  codel astar(");
            if is_commented {
                client.edit(&mut text, "codel astar(", comment);
            }
            client.diagnostics(&text);
            let words = text.text.match_indices(|it: char| !it.is_alphanumeric()).map(|(at, _)| at + 1);
            for at in words.filter(|&at| text.text.is_char_boundary(at)).step_by(7).collect::<Vec<_>>() {
                let params = json!({"textDocument": {"uri": text.uri}, "position": text.position(at)});
                let hover = client.call("textDocument/hover", params).unwrap();
                let Some(said) = hover["contents"]["value"].as_str() else { continue };
                assert_eq!(hover["contents"]["kind"], "plaintext");
                shown.push(said.to_owned());
            }
            if is_commented {
                let hover = client.call("textDocument/hover", text.at("astar(")).unwrap();
                let said = hover["contents"]["value"].as_str().unwrap();
                assert!(said.contains("Finds a_way of few turns, see [0; 1] and a_b <b>."), "{said}");
                of_astar += 1;
            }
            let range = json!({"start": text.position(0), "end": text.position(text.text.len())});
            let params = json!({"textDocument": {"uri": text.uri}, "range": range});
            let hints = client.call("textDocument/inlayHint", params).unwrap();
            for hint in hints.as_array().unwrap().iter().take(12) {
                let resolved = client.call("inlayHint/resolve", hint.clone()).unwrap();
                shown.extend(resolved["tooltip"]["value"].as_str().map(str::to_owned));
            }
        }
        assert_eq!(of_astar, 1);
        assert!(shown.len() > 40, "{}", shown.len());
        for said in &shown {
            let found = signs.iter().find(|sign| said.contains(**sign));
            assert!(found.is_none() && !said.contains('`'), "{found:?} in {said}");
            assert!(!said.lines().any(|line| line.starts_with('|')), "{said}");
        }
    }
}

/// A file is told apart by its address: a client that writes it otherwise gets its own, and every other one that of RFC 3986.
#[test]
fn addresses_are_those_of_the_client_or_of_the_standard() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_addresses_out");
    let model =
        "include \"[b]^|.mal\"\ncodel f(): int\nshell S { }\ncore C(S) { update = { f(); plna(); } }\n";
    write(&folder, &[("a[1].mal", model), ("[b]^|.mal", "core D(S) { update = { g(); } }\n")]);
    let (mut client, _) = start(&folder, &json!({}));
    let base = address(&folder);
    client.wait_for_published(|all| {
        all.contains_key(&format!("{base}/%5Bb%5D%5E%7C.mal"))
            && all.contains_key(&format!("{base}/a%5B1%5D.mal"))
    });
    // As VS Code, as a client that encodes more, and as one that encodes less.
    for uri in ["a%5B1%5D.mal", "%61%5b1%5d.mal", "a[1].mal"] {
        let text = client.open_at(&format!("{base}/{uri}"), model);
        let found = client.diagnostics(&text);
        assert!(found.iter().any(|it| it["code"] == "unresolved-codel"), "{uri}: {found:?}");
        let target = client.call("textDocument/definition", text.at("f(); plna")).unwrap();
        assert_eq!(target[0]["uri"], json!(text.uri), "{uri}");
        client.notify("textDocument/didClose", json!({"textDocument": {"uri": text.uri}}));
    }
}

#[test]
fn folders_come_and_go() {
    let folder = copied_robot("lsp_folders");
    let mut client = Client::start(MAUVE, &[]);
    client.initialize(None, &json!({}));
    let workspaces =
        |client: &mut Client| client.call("mauve/status", Value::Null).unwrap()["workspaces"].clone();
    assert_eq!(workspaces(&mut client), json!([]));
    let change = |added: &[&Path], removed: &[&Path]| {
        let folders = |paths: &[&Path]| -> Vec<Value> {
            paths.iter().map(|path| json!({"uri": address(path), "name": ""})).collect()
        };
        json!({"event": {"added": folders(added), "removed": folders(removed)}})
    };
    client.notify("workspace/didChangeWorkspaceFolders", change(&[&folder], &[]));
    assert_eq!(workspaces(&mut client)[0]["roots"], json!([folder.join("exploration.mal")]));
    client.notify("workspace/didChangeWorkspaceFolders", change(&[], &[&folder]));
    assert_eq!(workspaces(&mut client), json!([]));
    // A text that is open when its folder is taken away is there as long as it is open.
    client.notify("workspace/didChangeWorkspaceFolders", change(&[&folder], &[]));
    let mut text = client.open_file(&folder.join("deployment.mal"));
    client.edit(&mut text, "deadline = 1000", "deadline = 990");
    client.wait_for_published(|published| published.contains_key(&text.uri));
    client.notify("workspace/didChangeWorkspaceFolders", change(&[], &[&folder]));
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": text.uri}}));
    client.wait_for_published(|published| published.is_empty());
    assert_eq!(workspaces(&mut client), json!([]));
}

#[test]
fn a_session_is_recorded() {
    let folder = copied_robot("lsp_mirror");
    let (mirror, log) = (folder.join("session.jsonl"), folder.join("session.log"));
    let mut client =
        Client::start(MAUVE, &["--mirror", mirror.to_str().unwrap(), "--log", log.to_str().unwrap()]);
    client.initialize(Some(&folder), &json!({}));
    let mut text = client.open_file(&folder.join("deployment.mal"));
    client.wait_for_diagnostics(&text);
    client.edit(&mut text, "deadline = 1000", "deadline = 700");
    client.diagnostics(&text);
    assert_eq!(client.hint(&text, "activity navigation"), "✗ 997 / 700 ms");
    assert_eq!(client.shut_down(), Some(0));
    assert!(std::fs::read_to_string(&log).unwrap().contains("workspaces loaded"));
    // They have the texts of the models.
    for path in [&mirror, &log] {
        use std::os::unix::fs::PermissionsExt as _;
        assert_eq!(
            std::fs::metadata(path).unwrap().permissions().mode() & 0o777,
            0o600,
            "{}",
            path.display()
        );
    }

    // Each message of both sides is a line, in their order.
    let record = std::fs::read_to_string(&mirror).unwrap();
    let lines: Vec<Value> = record.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let methods = |side: &str| {
        let of_side = lines.iter().filter(|line| line["from"] == side);
        of_side.filter_map(|line| line["message"]["method"].as_str()).collect::<Vec<_>>()
    };
    let client = methods("client");
    assert_eq!(client[..3], ["initialize", "initialized", "textDocument/didOpen"]);
    assert_eq!(client[client.len() - 2..], ["shutdown", "exit"]);
    assert!(methods("server").contains(&"textDocument/publishDiagnostics"));
    let seconds = lines.iter().map(|line| line["seconds"].as_f64().unwrap());
    assert!(seconds.is_sorted());
}
