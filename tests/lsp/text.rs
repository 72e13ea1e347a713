//! What an editor does with the text itself, through the binary: white space, folds, selections, colours.

use std::path::PathBuf;

use mauve_tests::{Client, Columns, Text, copy, mauve, models, scratch, write};
use serde_json::{Value, json};

use super::{MAUVE, start};

fn options() -> Value {
    json!({"tabSize": 8, "insertSpaces": false, "trimTrailingWhitespace": false, "insertFinalNewline": false})
}

fn range<'a>(text: &'a str, range: &Value) -> &'a str {
    let offset = |end: &str| Columns::Utf16.offset(text, &range[end]);
    &text[offset("start")..offset("end")]
}

/// A folder with this model in it.
fn model(name: &str, text: &str) -> (PathBuf, PathBuf) {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
    write(&folder, &[("a.mal", text)]);
    (folder.clone(), folder.join("a.mal"))
}

const UNTIDY: &str = "/* 🦀 é */ codel f( a:int ):int\r\nshell S{property p:int // é\r\n}\r\n\r\n\r\ncore C(S) {\r\nupdate={ x=1;y  =  2; }\r\nvar x:\r\n}";

#[test]
fn a_document_is_formatted_as_the_command_line_does() {
    let (folder, path) = model("lsp_formatting", UNTIDY);
    let (mut client, can) = start(&folder, &json!({}));
    assert_eq!(can["documentOnTypeFormattingProvider"]["firstTriggerCharacter"], "}");
    let text = client.open_file(&path);
    let of = json!({"uri": text.uri});
    let edits =
        client.call("textDocument/formatting", json!({"textDocument": of, "options": options()})).unwrap();
    let tidy = text.applied(&edits);
    assert_ne!(tidy, UNTIDY);
    assert_eq!(mauve(MAUVE, &folder, &["fmt", "a.mal"]).code, 0);
    assert_eq!(tidy, std::fs::read_to_string(&path).unwrap());
    // Only what the lines of a range need.
    let line = json!({"start": {"line": 0, "character": 14}, "end": {"line": 1, "character": 0}});
    let params = json!({"textDocument": of, "range": line, "options": options()});
    let first = text.applied(&client.call("textDocument/rangeFormatting", params).unwrap());
    let (line, rest) = UNTIDY.split_once('\n').unwrap();
    assert_eq!(first, format!("{}\n{rest}", line.replace("f( a:int ):int", "f(a: int): int")));
}

#[test]
fn a_text_is_formatted_while_it_is_typed() {
    let (folder, path) = model("lsp_on_type", "core C(S) {\n  update = {\n    f( 1 )\n  }\n}\n");
    let (mut client, _) = start(&folder, &json!({}));
    let mut text = client.open_file(&path);
    let typed = |client: &mut Client, text: &Text, at: usize, letter: &str| {
        let params = json!({
            "textDocument": {"uri": text.uri}, "position": text.position(at), "ch": letter, "options": options(),
        });
        text.applied(&client.call("textDocument/onTypeFormatting", params).unwrap())
    };
    client.edit(&mut text, "f( 1 )", "f( 1 );");
    let at = text.text.find(';').unwrap() + 1;
    assert_eq!(typed(&mut client, &text, at, ";"), "core C(S) {\n  update = {\n    f(1);\n  }\n}\n");
    // A line break, and the tabs that an editor has put behind it.
    client.edit(&mut text, ";", ";\n\t\t");
    let at = text.text.find('\t').unwrap() + 2;
    assert_eq!(typed(&mut client, &text, at, "\n"), "core C(S) {\n  update = {\n    f(1);\n    \n  }\n}\n");
}

#[test]
fn nothing_is_formatted_that_is_not_ours() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_not_ours");
    write(
        &folder,
        &[("a.mal", "#id:  \"org\"\ncategory  C {\n}\n"), ("mauve.toml", "[project]\nroot  =  \"b.mal\"\n")],
    );
    let (mut client, _) = start(&folder, &json!({}));
    for name in ["a.mal", "mauve.toml"] {
        let text = client.open_file(&folder.join(name));
        let params = json!({"textDocument": {"uri": text.uri}, "options": options()});
        let edits = client.call("textDocument/formatting", params).unwrap();
        assert!(edits.as_array().is_none_or(Vec::is_empty), "{edits}");
    }
}

const BLOCKS: &str = "include \"b.mal\"\ninclude \"c.mal\"\n\n// One.\n// 🦀 Two.\nlibrary l { /* é */ shell S {\n    property p: int\n  }\n}\n";

fn folds(client: &mut Client, text: &Text) -> Vec<Value> {
    let params = json!({"textDocument": {"uri": text.uri}});
    client.call("textDocument/foldingRange", params).unwrap().as_array().unwrap().clone()
}

#[test]
fn folds_are_of_the_kind_that_a_client_knows() {
    let (folder, path) = model("lsp_folding", BLOCKS);
    let (mut plain, can) = start(&folder, &json!({}));
    assert_eq!(can["foldingRangeProvider"], true);
    let text = plain.open_file(&path);
    let found = folds(&mut plain, &text);
    let kinds: Vec<&Value> = found.iter().map(|fold| &fold["kind"]).collect();
    assert_eq!(kinds, [&json!("imports"), &json!("comment"), &Value::Null, &Value::Null]);
    assert_eq!(
        found[3],
        json!({"startLine": 5, "startCharacter": 29, "endLine": 7, "endCharacter": 2}),
        "behind the brace, up to the other"
    );
    let able = json!({"textDocument": {"foldingRange": {
        "lineFoldingOnly": true, "foldingRange": {"collapsedText": true},
    }}});
    let (mut lines, _) = start(&folder, &able);
    let text = lines.open_file(&path);
    let shown: Vec<String> = folds(&mut lines, &text)
        .iter()
        .map(|fold| {
            assert!(fold.get("startCharacter").is_none());
            format!("{}–{} {}", fold["startLine"], fold["endLine"], fold["collapsedText"].as_str().unwrap())
        })
        .collect();
    let expected =
        ["0–1 include \"b.mal\" … 1 lines …", "3–4 // One. … 1 lines …", "5–7 library l { … 2 lines … }"];
    assert_eq!(shown, expected);
}

#[test]
fn selections_grow_from_a_word_to_the_file() {
    let source = "core C(S) { update = { /* 🦀 é */ go(a, b + 1); } }\n";
    let (folder, path) = model("lsp_selection", source);
    let (mut client, _) = start(&folder, &json!({}));
    let text = client.open_file(&path);
    let positions =
        [text.position(source.find("b +").unwrap()), text.position(0), json!({"line": 99, "character": 9})];
    let params = json!({"textDocument": {"uri": text.uri}, "positions": positions});
    let found = client.call("textDocument/selectionRange", params).unwrap();
    assert_eq!(found.as_array().unwrap().len(), 3);
    let mut levels = Vec::new();
    let mut open = &found[0];
    while !open.is_null() {
        levels.push(range(source, &open["range"]));
        open = &open["parent"];
    }
    assert_eq!(levels[..5], ["b", "b + 1", "a, b + 1", "(a, b + 1)", "go(a, b + 1)"]);
    assert_eq!(levels.last(), Some(&source));
    assert_eq!(range(source, &found[1]["range"]), "core");
}

#[test]
fn selections_in_a_text_of_many_levels_can_be_read() {
    let source = format!("core C(S) {{ update = {{ x = {}1{}; }} }}\n", "(".repeat(200), ")".repeat(200));
    let (folder, path) = model("lsp_deep_selection", &source);
    let (mut client, _) = start(&folder, &json!({}));
    let text = client.open_file(&path);
    let params =
        json!({"textDocument": {"uri": text.uri}, "positions": [text.position(source.find('1').unwrap())]});
    // The reader of these tests takes 128 levels.
    let found = client.call("textDocument/selectionRange", params).unwrap();
    let (mut open, mut last) = (&found[0], Value::Null);
    while !open.is_null() {
        last = open["range"].clone();
        open = &open["parent"];
    }
    assert_eq!(range(&source, &last), source);
}

/// What a client says that knows all of the types and modifiers that ours has.
fn colours(types: &[&str], modifiers: &[&str]) -> Value {
    json!({
        "workspace": {"semanticTokens": {"refreshSupport": true}},
        "textDocument": {"semanticTokens": {
            "requests": {"range": true, "full": {"delta": true}}, "formats": ["relative"],
            "tokenTypes": types, "tokenModifiers": modifiers,
        }},
    })
}

const STANDARD: [&str; 10] = [
    "namespace",
    "type",
    "class",
    "interface",
    "struct",
    "variable",
    "property",
    "enumMember",
    "event",
    "function",
];

/// The tokens of a text, in words: `Laser interface declaration`.
fn shown(text: &str, legend: &Value, data: &[Value]) -> Vec<String> {
    let numbers: Vec<u64> = data.iter().map(|number| number.as_u64().unwrap()).collect();
    let (mut line, mut column) = (0, 0);
    let tokens = numbers.chunks_exact(5).map(|token| {
        column = if token[0] == 0 { column + token[1] } else { token[1] };
        line += token[0];
        let at = |column: u64| Columns::Utf16.offset(text, &json!({"line": line, "character": column}));
        let mut shown = text[at(column)..at(column + token[2])].to_owned();
        shown += &format!(" {}", legend["tokenTypes"][token[3] as usize].as_str().unwrap());
        for (bit, name) in legend["tokenModifiers"].as_array().unwrap().iter().enumerate() {
            if token[4] >> bit & 1 == 1 {
                shown += &format!(" {}", name.as_str().unwrap());
            }
        }
        shown
    });
    tokens.collect()
}

fn tokens(client: &mut Client, method: &str, params: Value) -> Value {
    loop {
        match client.call(&format!("textDocument/semanticTokens/{method}"), params.clone()) {
            Ok(found) => return found,
            Err(error) => assert_eq!(error["code"], -32801, "{error}"),
        }
    }
}

#[test]
fn names_have_the_colours_that_a_client_knows() {
    let source =
        "shell S { /* 🦀 é */ output port out: int }\ncore C(S) { update = { write(out, 1); nothing(); } }\n";
    let (folder, path) = model("lsp_colours", source);
    let all = ["S interface", "out property", "int type", "C class", "S interface", "out property"];
    let (mut plain, can) = start(&folder, &colours(&STANDARD, &[]));
    let text = plain.open_file(&path);
    let legend = &can["semanticTokensProvider"]["legend"];
    let found = tokens(&mut plain, "full", json!({"textDocument": {"uri": text.uri}}));
    assert_eq!(shown(source, legend, found["data"].as_array().unwrap()), all);
    // A part of the text, from within a name on.
    let at = source.find("out:").unwrap() + 1;
    let part = json!({"start": text.position(at), "end": text.position(source.find("(S)").unwrap())});
    let found = tokens(&mut plain, "range", json!({"textDocument": {"uri": text.uri}, "range": part}));
    assert_eq!(shown(source, legend, found["data"].as_array().unwrap()), all[1..4]);

    let (mut able, can) = start(&folder, &colours(&["core", "shell", "port"], &["output", "modification"]));
    let text = able.open_file(&path);
    let legend = &can["semanticTokensProvider"]["legend"];
    let found = tokens(&mut able, "full", json!({"textDocument": {"uri": text.uri}}));
    assert_eq!(
        shown(source, legend, found["data"].as_array().unwrap()),
        ["S shell", "out port output", "C core", "S shell", "out port modification output"]
    );
    let (_, can) = start(&folder, &json!({}));
    assert!(can["semanticTokensProvider"].is_null());
}

#[test]
fn what_has_changed_is_all_that_is_sent() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_delta");
    copy(&models().join("p3dx"), &folder);
    let (mut client, _) = start(&folder, &colours(&STANDARD, &["declaration", "modification"]));
    let mut text = client.open_file(&folder.join("components/navigation.mal"));
    let of = json!({"uri": text.uri});
    let full = tokens(&mut client, "full", json!({"textDocument": of}));
    let mut data = full["data"].as_array().unwrap().clone();
    let mut id = full["resultId"].clone();
    for (from, to) in [
        ("var found: bool", "var found: bool = true; var 🦀 more: int"),
        ("// Plans", "\n\n// Plans"),
        ("astar(", "unknown("),
        ("state Planning", "state"),
        ("core NavigationCore(NavigationShell)", "core NavigationCore("),
        ("core NavigationCore(", "core NavigationCore(NavigationShell)"),
    ] {
        client.edit(&mut text, from, to);
        let change = tokens(&mut client, "full/delta", json!({"textDocument": of, "previousResultId": id}));
        for edit in change["edits"].as_array().unwrap() {
            let (start, count) = (edit["start"].as_u64().unwrap(), edit["deleteCount"].as_u64().unwrap());
            let new = edit["data"].as_array().cloned().unwrap_or_default();
            data.splice(start as usize..(start + count) as usize, new);
        }
        let full = tokens(&mut client, "full", json!({"textDocument": of}));
        assert_eq!(&data, full["data"].as_array().unwrap(), "{from} -> {to}");
        assert_eq!(change["resultId"], full["resultId"]);
        id = full["resultId"].clone();
    }
    // Nothing has changed; and of something else, everything is sent.
    let none = tokens(&mut client, "full/delta", json!({"textDocument": of, "previousResultId": id}));
    assert_eq!(none["edits"], json!([]));
    let all = tokens(&mut client, "full/delta", json!({"textDocument": of, "previousResultId": "another"}));
    assert_eq!(all["data"].as_array().unwrap(), &data);
}

#[test]
fn another_meaning_by_an_edit_elsewhere_is_to_be_asked_for() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_token_refresh");
    let shell = "shell S {\n  output port out: int\n}\n";
    let core = "include \"shell.mal\"\ncore C(S) { update = { write(out, 1); } }\ncomponent P(S, C)\n";
    write(&folder, &[("shell.mal", shell), ("core.mal", core)]);
    let (mut client, _) = start(&folder, &colours(&STANDARD, &[]));
    let mut core = client.open_file(&folder.join("core.mal"));
    let mut shell = client.open_file(&folder.join("shell.mal"));
    client.diagnostics(&shell);
    let of = json!({"textDocument": {"uri": core.uri}});
    let before = tokens(&mut client, "full", of.clone());
    let is_refresh = |message: &Value| message["method"] == "workspace/semanticTokens/refresh";
    // Neither an edit that changes no meaning, nor one of the text itself.
    client.edit(&mut shell, "output", "// why\n  output");
    client.diagnostics(&shell);
    client.edit(&mut core, "update", "var n: int update");
    client.diagnostics(&core);
    let own = tokens(&mut client, "full", of.clone());
    assert_ne!(own["data"], before["data"]);
    client.idle();
    assert_eq!(client.count(is_refresh), 0);
    client.edit(&mut shell, "port out", "port other");
    client.wait("that colours are to be asked for again", is_refresh);
    let after = tokens(&mut client, "full", of);
    assert_eq!(after["data"].as_array().unwrap().len() + 5, own["data"].as_array().unwrap().len());
    // Told once.
    client.edit(&mut shell, "// why", "// why not");
    client.diagnostics(&shell);
    client.idle();
    assert_eq!(client.count(is_refresh), 0);
}

/// The types and modifiers of ours that no protocol has: what the server gives to a client that knows them all.
#[test]
fn the_editors_know_every_colour_of_ours() {
    let editors = models().join("../../editors");
    let package = std::fs::read_to_string(editors.join("vscode/package.json")).unwrap();
    let package: Value = serde_json::from_str(&package).unwrap();
    let ids = |what: &str| -> Vec<String> {
        let all = package["contributes"][what].as_array().unwrap();
        all.iter().map(|it| it["id"].as_str().unwrap().to_owned()).collect()
    };
    let (types, modifiers) = (ids("semanticTokenTypes"), ids("semanticTokenModifiers"));
    let lua = std::fs::read_to_string(editors.join("nvim/lua/mauve/colours.lua")).unwrap();
    let source =
        std::fs::read_to_string(models().join("../../server/lsp/src/handlers/semantic_tokens.rs")).unwrap();
    let strings = |of: &str| -> Vec<String> {
        let list = source.split_once(of).unwrap().1.split_once(";\n").unwrap().0;
        let words = list.split('"').skip(1).step_by(2).flat_map(str::split_whitespace);
        words.filter(|word| *word != "\\").map(str::to_owned).collect()
    };
    let standard_types = [
        "namespace",
        "type",
        "class",
        "interface",
        "struct",
        "parameter",
        "variable",
        "property",
        "enumMember",
        "event",
        "function",
        "method",
        "keyword",
        "comment",
        "string",
        "number",
        "operator",
    ];
    let standard_modifiers = ["declaration", "definition", "readonly", "modification", "defaultLibrary"];
    let own = |all: Vec<String>, standard: &[&str]| -> Vec<String> {
        all.into_iter().filter(|name| !standard.contains(&name.as_str())).collect()
    };
    assert_eq!(own(strings("const TYPES"), &standard_types), types);
    assert_eq!(own(strings("const MODIFIERS"), &standard_modifiers), modifiers);
    for name in types.iter().chain(&modifiers) {
        assert!(lua.contains(&format!("{name} = ")), "{name} in colours.lua");
    }
    let scopes = package["contributes"]["semanticTokenScopes"][0]["scopes"].as_object().unwrap();
    assert!(types.iter().all(|name| scopes.contains_key(name)), "{scopes:?}");
}
