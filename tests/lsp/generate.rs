//! Orocos packages from an editor, over the server's standard streams: what is offered, the edit that it is, and what is
//! refused.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mauve_tests::{Client, Text, address, all_texts_in, copy, mauve, models, scratch, write};
use serde_json::{Value, json};

use super::{MAUVE, start};

const MODEL: &str = "\
library parts {
  codel scan(out n: int): int

  shell S { output port echo: int }
  core C(S) {
    var n: int = 0
    update = { /* 🦀 é */ scan(n); write(echo, n); }
  }
  component Laser(S, C)
  architecture A { instance laser: Laser }
  deployment D { architecture A  activity laser { priority = 1 period = 100 } }
  deployment E { architecture A  activity laser { priority = 2 period = 200 } }
}
";

const CODEL: &str = "generated/parts/src/codels/scan.cpp";
const HEADER: &str = "generated/parts/include/parts/parts-codels.hpp";

/// What an editor can do that knows everything about changes.
fn good_editor() -> Value {
    json!({
        "workspace": {"applyEdit": true, "workspaceEdit": {
            "documentChanges": true, "resourceOperations": ["create", "rename", "delete"],
            "changeAnnotationSupport": {"groupsOnLabel": true},
        }},
        "textDocument": {"codeAction": {
            "codeActionLiteralSupport": {"codeActionKind": {"valueSet": ["", "quickfix", "refactor", "source"]}},
            "disabledSupport": true, "dataSupport": true, "resolveSupport": {"properties": ["edit"]},
        }},
    })
}

/// The same, but for what a JSON pointer names.
fn editor(pointer: &str, value: Value) -> Value {
    let mut capabilities = good_editor();
    match capabilities.pointer_mut(pointer) {
        Some(known) => *known = value,
        None => capabilities["experimental"] = value,
    }
    capabilities
}

fn project(name: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("lsp_generate_{name}"));
    write(&folder, &[("robot.mal", MODEL), ("mauve.toml", "[project]\nroot = \"robot.mal\"\n")]);
    folder
}

/// A session with the model open.
fn opened(folder: &Path, capabilities: &Value) -> (Client, Text) {
    let (mut client, _) = start(folder, capabilities);
    let text = client.open_file(&folder.join("robot.mal"));
    client.diagnostics(&text);
    (client, text)
}

/// The actions at a place that generate packages.
fn actions(client: &mut Client, text: &Text, at: &str, context: Value) -> Vec<Value> {
    let position = text.at(at)["position"].clone();
    let mut context = context;
    context["diagnostics"] = json!([]);
    let params = json!({
        "textDocument": {"uri": text.uri}, "context": context, "range": {"start": position, "end": position},
    });
    let found = client.call("textDocument/codeAction", params).unwrap();
    let is_it = |it: &&Value| it["title"].as_str().unwrap().starts_with("Generate");
    found.as_array().unwrap().iter().filter(is_it).cloned().collect()
}

fn titles(actions: &[Value]) -> Vec<&str> {
    actions.iter().map(|it| it["title"].as_str().unwrap()).collect()
}

/// What would be done for all packages.
fn generate(client: &mut Client, uri: &str) -> Result<Value, String> {
    loop {
        match client.call("mauve/generate", json!({"textDocument": {"uri": uri}})) {
            Ok(found) => return Ok(found),
            Err(error) if error["code"] == -32801 => {}
            Err(error) => return Err(error["message"].as_str().unwrap().to_owned()),
        }
    }
}

fn execute(client: &mut Client, arguments: Value) -> Result<Value, Value> {
    client
        .call("workspace/executeCommand", json!({"command": "mauve.generateOrocos", "arguments": arguments}))
}

/// Files and their actions.
fn files(found: &Value) -> Vec<(&str, &str)> {
    let all = found["files"].as_array().unwrap().iter();
    all.map(|it| (it["path"].as_str().unwrap(), it["action"].as_str().unwrap())).collect()
}

fn path_of(uri: &Value) -> PathBuf {
    PathBuf::from(uri.as_str().unwrap().strip_prefix("file://").unwrap())
}

/// Does to the disk what an edit says, as strictly as the specification; gives what was done to which file.
fn apply(edit: &Value) -> Vec<(String, PathBuf)> {
    let mut done = Vec::new();
    for operation in edit["documentChanges"].as_array().unwrap() {
        match operation["kind"].as_str() {
            Some("create") => {
                let path = path_of(&operation["uri"]);
                if path.exists() {
                    assert_eq!(operation["options"]["ignoreIfExists"], true, "{} is there", path.display());
                    continue;
                }
                std::fs::create_dir_all(path.parent().unwrap()).unwrap();
                std::fs::write(&path, "").unwrap();
                done.push(("create".to_owned(), path));
            }
            Some("delete") => {
                let path = path_of(&operation["uri"]);
                std::fs::remove_file(&path).unwrap();
                done.push(("delete".to_owned(), path));
            }
            Some(other) => panic!("{other}"),
            None => {
                let path = path_of(&operation["textDocument"]["uri"]);
                let text = std::fs::read_to_string(&path).unwrap();
                let lines = text.matches('\n').count();
                let last = text.rsplit('\n').next().unwrap().encode_utf16().count();
                let [edit] = operation["edits"].as_array().unwrap().as_slice() else { panic!("{operation}") };
                // All of it.
                assert_eq!(edit["range"]["start"], json!({"line": 0, "character": 0}));
                assert_eq!(
                    edit["range"]["end"],
                    json!({"line": lines, "character": last}),
                    "{}",
                    path.display()
                );
                std::fs::write(&path, edit["newText"].as_str().unwrap()).unwrap();
                done.push(("write".to_owned(), path));
            }
        }
    }
    done
}

/// Generates all packages.
fn generated(client: &mut Client, uri: &str) {
    let found = generate(client, uri).unwrap();
    apply(&found["edit"]);
}

fn said(client: &mut Client) -> String {
    let (_, message) = client.wait("a message", |it| it["method"] == "window/showMessage");
    message["params"]["message"].as_str().unwrap().to_owned()
}

#[test]
fn the_action_on_a_deployment_is_an_edit_that_makes_its_packages() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_generate_robot");
    copy(&models().join("p3dx"), &folder);
    let (mut client, _) = start(&folder, &good_editor());
    let text = client.open_file(&folder.join("deployment.mal"));
    client.diagnostics(&text);
    let found = actions(&mut client, &text, "activity pose", json!({}));
    let [action] = found.as_slice() else { panic!("{found:#?}") };
    assert_eq!(action["title"], "Generate Orocos packages of `exploration.P3dxDeployment` in generated");
    assert_eq!(action["kind"], "source.generate.mauve");
    assert!(action.get("edit").is_none() && action.get("command").is_none(), "{action:#}");
    assert!(!folder.join("generated").exists(), "nothing is done before it is chosen");

    let resolved = client.call("codeAction/resolve", action.clone()).unwrap();
    let edit = &resolved["edit"];
    let operations = edit["documentChanges"].as_array().unwrap();
    let annotations = edit["changeAnnotations"].as_object().unwrap();
    // What is to be confirmed is one thing, which does nothing: the rest is done unless the user leaves it out.
    let confirmed: Vec<&Value> = operations
        .iter()
        .filter(|it| {
            it["annotationId"].as_str().is_some_and(|id| annotations[id]["needsConfirmation"] == true)
        })
        .collect();
    assert_eq!(confirmed.len(), 1);
    assert_eq!(confirmed[0]["uri"], text.uri.as_str());
    assert_eq!(confirmed[0]["options"], json!({"ignoreIfExists": true}));
    assert_eq!(annotations["Create files"]["description"], "in generated");
    let before = all_texts_in(&folder);
    let done = apply(edit);
    assert!(
        done.len() > 50 && done.iter().all(|(_, path)| path.starts_with(folder.join("generated"))),
        "{done:?}"
    );
    // The texts of the models stay what they are.
    assert!(before.iter().all(|(path, text)| std::fs::read_to_string(path).unwrap() == *text));
    assert!(folder.join("generated/motion/src/codels/clearance.cpp").is_file());
    // A manifest says what was written: it comes behind that.
    let is_manifest = |path: &Path| path.ends_with(".mauve-manifest.json");
    let first = done.iter().position(|(_, path)| is_manifest(path)).unwrap();
    assert!(done[first..].iter().all(|(_, path)| is_manifest(path)), "{done:?}");

    let check = mauve(MAUVE, &folder, &["generate", "--check", "--out", "generated"]);
    assert_eq!(check.code, 0, "{}{}", check.out, check.err);
    // Now nothing is left to do, which is said.
    let found = actions(&mut client, &text, "activity pose", json!({}));
    let resolved = client.call("codeAction/resolve", found[0].clone()).unwrap();
    assert_eq!(resolved["edit"]["documentChanges"], json!([]));
    assert_eq!(said(&mut client), "The Orocos packages in generated are up to date.");
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn generation_is_offered_for_the_package_at_the_cursor() {
    let folder = project("offers");
    let (mut client, text) = opened(&folder, &good_editor());
    let of = |name: &str| format!("Generate Orocos packages of `parts.{name}` in generated");
    let all = "Generate all Orocos packages in generated";
    assert_eq!(titles(&actions(&mut client, &text, "deployment E", json!({}))), [of("E")]);
    // Elsewhere only where somebody asks for it.
    assert_eq!(titles(&actions(&mut client, &text, "component Laser", json!({}))), [""; 0]);
    for kind in ["", "source", "source.generate", "source.generate.mauve"] {
        let found = actions(&mut client, &text, "component Laser", json!({"only": [kind]}));
        assert_eq!(titles(&found), [&*of("D"), &*of("E"), all], "{kind}");
        let found = actions(&mut client, &text, "deployment E", json!({"only": [kind]}));
        assert_eq!(titles(&found), [&*of("E"), all], "{kind}");
    }
    for kind in ["source.fixAll", "source.generateAll", "refactor", "quickfix"] {
        assert_eq!(titles(&actions(&mut client, &text, "deployment E", json!({"only": [kind]}))), [""; 0]);
    }
    // And above each deployment.
    let lenses = client.call("textDocument/codeLens", json!({"textDocument": {"uri": text.uri}})).unwrap();
    let commands: Vec<&Value> = lenses.as_array().unwrap().iter().map(|lens| &lens["command"]).collect();
    let shown: Vec<&&Value> = commands.iter().filter(|it| it["title"] == "Generate Orocos").collect();
    let expected = |name: &str| {
        json!({
            "title": "Generate Orocos", "command": "mauve.generateOrocos",
            "arguments": [text.uri, format!("parts.{name}")],
        })
    };
    assert_eq!(shown, [&&expected("D"), &&expected("E")]);
}

#[test]
fn the_command_has_the_client_make_the_edit() {
    let folder = project("command");
    // Where the client cannot ask later, the action is the command: no disk is read wherever a cursor goes.
    let plain = editor("/textDocument/codeAction/resolveSupport", Value::Null);
    let (mut client, text) = opened(&folder, &plain);
    let found = actions(&mut client, &text, "deployment D", json!({}));
    let command = &found[0]["command"];
    assert_eq!(command["arguments"], json!([text.uri, "parts.D"]));
    let result = client.call("workspace/executeCommand", command.clone()).unwrap();
    assert_eq!((&result["changed"], &result["removed"]), (&json!(0), &json!(0)));
    let count = result["created"].as_u64().unwrap() as usize;
    let (_, asked) = client.wait("an edit", |it| it["method"] == "workspace/applyEdit");
    let done = apply(&asked["params"]["edit"]);
    assert_eq!(done.iter().filter(|(what, _)| what == "create").count(), count);
    assert!(folder.join(CODEL).is_file());
    // The client of this test has not said that it has made it.
    assert_eq!(said(&mut client), "Nothing was generated: this client has no files.");

    let result = execute(&mut client, json!([text.uri])).unwrap();
    assert_eq!(result["created"], 0);
    assert_eq!(said(&mut client), "The Orocos packages in generated are up to date.");
    client.idle();
    assert_eq!(client.count(|it| it["method"] == "workspace/applyEdit"), 0);
}

#[test]
fn clients_that_can_do_less_or_more() {
    let folder = project("clients");
    let lenses = |client: &mut Client, uri: &str| {
        let found = client.call("textDocument/codeLens", json!({"textDocument": {"uri": uri}})).unwrap();
        found.to_string().contains("mauve.generateOrocos")
    };
    // Without files that a change makes, there is nothing but a word.
    let (mut client, text) =
        opened(&folder, &editor("/workspace/workspaceEdit/resourceOperations", json!([])));
    assert_eq!(actions(&mut client, &text, "deployment D", json!({})), [] as [Value; 0]);
    let found = actions(&mut client, &text, "deployment D", json!({"only": ["source"]}));
    assert!(found[0].get("data").is_none() && found[0].get("edit").is_none(), "{found:#?}");
    let error = client.call("workspace/executeCommand", found[0]["command"].clone()).unwrap_err();
    assert_eq!(
        (error["code"].as_i64(), error["message"].as_str().unwrap().contains("run `mauve generate`")),
        (Some(-32803), true)
    );
    assert!(generate(&mut client, &text.uri).unwrap_err().contains("run `mauve generate`"));
    assert!(!lenses(&mut client, &text.uri));
    // One that makes no change that it is told to can still ask for one.
    let (mut client, text) = opened(&folder, &editor("/workspace/applyEdit", json!(false)));
    assert!(
        execute(&mut client, json!([text.uri])).unwrap_err()["message"]
            .as_str()
            .unwrap()
            .contains("run `mauve generate`")
    );
    let found = actions(&mut client, &text, "deployment D", json!({}));
    assert!(
        client.call("codeAction/resolve", found[0].clone()).unwrap()["edit"]["documentChanges"].is_array()
    );
    assert!(!lenses(&mut client, &text.uri));
    // Neovim says that it makes files, and not that it takes changes of documents, which they are.
    let (mut client, text) =
        opened(&folder, &editor("/workspace/workspaceEdit/documentChanges", json!(false)));
    let found = generate(&mut client, &text.uri).unwrap();
    assert!(
        found["edit"]["documentChanges"].as_array().unwrap().len() > 5
            && found["edit"].get("changes").is_none()
    );
    // Nothing is called anything for one that does not show that.
    let (mut client, text) =
        opened(&folder, &editor("/workspace/workspaceEdit/changeAnnotationSupport", Value::Null));
    let found = generate(&mut client, &text.uri).unwrap();
    assert!(!found.to_string().contains("nnotation"), "{found:#}");
    // One that has the command does everything itself.
    let own = editor("/experimental", json!({"commands": ["mauve.generateOrocos"]}));
    let (mut client, text) = opened(&folder, &own);
    let found = actions(&mut client, &text, "deployment D", json!({}));
    assert_eq!(found[0]["command"]["arguments"], json!([text.uri, "parts.D"]));
    assert!(found[0].get("data").is_none() && lenses(&mut client, &text.uri));
    let resolved = client.call("codeAction/resolve", found[0].clone()).unwrap();
    assert_eq!(resolved, found[0]);
}

#[test]
fn nothing_is_generated_from_a_model_with_errors() {
    let folder = project("errors");
    let (mut client, mut text) = opened(&folder, &good_editor());
    client.edit(&mut text, "scan(n)", "scna(n)");
    client.diagnostics(&text);
    let found = actions(&mut client, &text, "deployment D", json!({"triggerKind": 1}));
    let reason = found[0]["disabled"]["reason"].as_str().unwrap().to_owned();
    assert!(reason.starts_with("fix 1 error first: robot.mal:7:26: "), "{reason}");
    assert!(found[0].get("data").is_none(), "{found:#?}");
    // Nobody asked for it.
    assert_eq!(actions(&mut client, &text, "deployment D", json!({"triggerKind": 2})), [] as [Value; 0]);
    assert_eq!(generate(&mut client, &text.uri).unwrap_err(), reason);
    let error = execute(&mut client, json!([text.uri, "D"])).unwrap_err();
    assert_eq!((&error["code"], &error["message"]), (&json!(-32803), &json!(reason)));
    client.edit(&mut text, "period = 100", "period = 100 jitter = -1");
    client.diagnostics(&text);
    let error = execute(&mut client, json!([text.uri, "D"])).unwrap_err().to_string();
    assert!(error.contains("errors first. The first is: robot.mal:"), "{error}");
    // A client that shows no reasons is told when it asks.
    let (mut client, mut text) =
        opened(&folder, &editor("/textDocument/codeAction/disabledSupport", json!(false)));
    client.edit(&mut text, "scan(n)", "scna(n)");
    client.diagnostics(&text);
    assert_eq!(actions(&mut client, &text, "deployment D", json!({"triggerKind": 2})), [] as [Value; 0]);
    let found = actions(&mut client, &text, "deployment D", json!({"triggerKind": 1}));
    let error = client.call("workspace/executeCommand", found[0]["command"].clone()).unwrap_err();
    assert_eq!(error["message"], reason);
    assert!(!folder.join("generated").exists());
}

#[test]
fn what_users_wrote_stays() {
    let folder = project("edited");
    let (mut client, mut text) = opened(&folder, &good_editor());
    generated(&mut client, &text.uri);
    std::fs::write(folder.join(CODEL), "namespace parts { int scan(int& n) { return n = 1; } }\n").unwrap();
    assert_eq!(files(&generate(&mut client, &text.uri).unwrap()), []);

    // A prototype that is another one: the file stays, and that is said.
    client.edit(&mut text, "codel scan(out n: int): int", "codel scan(inout n: int): void");
    client.edit(&mut text, "var n: int = 0", "var n: int = 1");
    let errors = client.diagnostics(&text);
    assert!(errors.iter().all(|it| it["severity"] != 1), "{errors:#?}");
    let found = generate(&mut client, &text.uri).unwrap();
    let action = actions(&mut client, &text, "deployment D", json!({})).remove(0);
    let resolved = client.call("codeAction/resolve", action).unwrap();
    let warning = said(&mut client);
    assert_eq!(found["warning"], warning);
    assert!(
        warning.contains("scan.cpp is now `void scan(") && warning.contains("it was `int scan("),
        "{warning}"
    );
    let done = apply(&resolved["edit"]);
    assert!(!done.iter().any(|(_, path)| path.ends_with("scan.cpp")), "{done:?}");
    assert!(done.contains(&("write".to_owned(), folder.join(HEADER))), "{done:?}");
    assert!(folder.join("generated/parts/src/codels/scan.cpp.new").is_file(), "{done:?}");

    // A generated file that was edited, on the disk or in the editor.
    let header = std::fs::read_to_string(folder.join(HEADER)).unwrap();
    std::fs::write(folder.join(HEADER), format!("{header}// Mine.\n")).unwrap();
    let refused = generate(&mut client, &text.uri).unwrap_err();
    assert!(
        refused.contains(&format!("were edited: {HEADER}.")) && refused.contains("`mauve generate --force`"),
        "{refused}"
    );
    let action = actions(&mut client, &text, "deployment D", json!({})).remove(0);
    assert_eq!(client.call("codeAction/resolve", action).unwrap_err()["message"], refused);
    assert_eq!(execute(&mut client, json!([text.uri])).unwrap_err()["message"], refused);
    let mut open = client.open(&folder.join(HEADER), &header);
    assert!(generate(&mut client, &text.uri).is_ok(), "what is open counts");
    std::fs::write(folder.join(HEADER), &header).unwrap();
    client.edit(&mut open, "#", "// Mine.\n#");
    assert_eq!(generate(&mut client, &text.uri).unwrap_err(), refused);
    client.edit(&mut open, "// Mine.\n", "");
    // What is open is changed in the version that it has.
    client.edit(&mut text, "inout n: int", "inout m: int");
    let found = generate(&mut client, &text.uri).unwrap();
    let edits = found["edit"]["documentChanges"].as_array().unwrap();
    let versions: BTreeMap<String, Value> = edits
        .iter()
        .filter_map(|it| it.get("textDocument"))
        .map(|it| (it["uri"].as_str().unwrap().to_owned(), it["version"].clone()))
        .collect();
    assert_eq!(versions[&address(&folder.join(HEADER))], 3, "{versions:?}");
    assert!(
        versions.iter().all(|(uri, version)| uri.ends_with("codels.hpp") || version.is_null()),
        "{versions:?}"
    );
}

#[test]
fn nothing_is_written_through_a_link_to_a_file() {
    let folder = project("links");
    let (mut client, mut text) = opened(&folder, &good_editor());
    generated(&mut client, &text.uri);
    let (header, shared) = (folder.join(HEADER), folder.join("generated/parts/shared.hpp"));
    std::fs::rename(&header, &shared).unwrap();
    std::os::unix::fs::symlink(&shared, &header).unwrap();
    assert_eq!(files(&generate(&mut client, &text.uri).unwrap()), [], "it holds what it should");
    let before = std::fs::read_to_string(&shared).unwrap();
    client.edit(&mut text, "out n: int", "out m: int");
    let refused = generate(&mut client, &text.uri).unwrap_err();
    assert!(refused.starts_with(&format!("{HEADER} is a link")), "{refused}");
    // A folder may be one, as long as it leads to somewhere in the package.
    std::fs::rename(&shared, &header).unwrap();
    let include = folder.join("generated/parts/include");
    std::fs::rename(&include, folder.join("generated/parts/headers")).unwrap();
    std::os::unix::fs::symlink("headers", &include).unwrap();
    let found = generate(&mut client, &text.uri).unwrap();
    apply(&found["edit"]);
    assert!(include.is_symlink());
    assert_ne!(
        std::fs::read_to_string(folder.join("generated/parts/headers/parts/parts-codels.hpp")).unwrap(),
        before
    );
    assert_eq!(files(&generate(&mut client, &text.uri).unwrap()), []);
}

#[test]
fn what_is_not_generated_any_more_is_removed() {
    let folder = project("removed");
    let (mut client, mut text) = opened(&folder, &good_editor());
    generated(&mut client, &text.uri);
    let before = all_texts_in(&folder.join("generated"));
    // No codel, so no header for codels.
    client.edit(&mut text, "  codel scan(out n: int): int\n", "");
    client.edit(&mut text, "scan(n); ", "");
    client.diagnostics(&text);
    let found = generate(&mut client, &text.uri).unwrap();
    let removed: Vec<&str> =
        files(&found).iter().filter(|(_, it)| *it == "remove").map(|(path, _)| *path).collect();
    assert!(removed.contains(&"parts/include/parts/parts-codels.hpp"), "{found:#}");
    // One that removes nothing gets nothing.
    let unable = editor("/workspace/workspaceEdit/resourceOperations", json!(["create"]));
    let (mut other, _) = start(&folder, &unable);
    let mine = other.open(&folder.join("robot.mal"), &text.text);
    let refused = generate(&mut other, &mine.uri).unwrap_err();
    assert!(
        refused.contains("is no longer generated") && refused.contains("run `mauve generate`"),
        "{refused}"
    );
    apply(&found["edit"]);
    assert!(!folder.join(HEADER).exists());
    // But for the codel, which is the user's.
    assert_eq!(std::fs::read_to_string(folder.join(CODEL)).unwrap(), before[&folder.join(CODEL)]);
    let found = generate(&mut client, &text.uri).unwrap();
    assert_eq!(files(&found), []);
}

#[test]
fn the_server_writes_all_or_nothing() {
    let folder = project("written");
    let (mut client, text) = opened(&folder, &good_editor());
    let planned = generate(&mut client, &text.uri).unwrap();
    let params = json!({"textDocument": {"uri": text.uri}, "write": planned["edit"]});
    // Of another plan, nothing.
    let mut other = params.clone();
    other["write"]["documentChanges"].as_array_mut().unwrap().pop();
    assert_eq!(client.call("mauve/generate", other).unwrap(), planned);
    assert!(!folder.join("generated").exists());
    // It is not the server's.
    write(&folder, &[("generated/.mauve-staging", "Mine.")]);
    let refused = client.call("mauve/generate", params.clone()).unwrap_err();
    assert!(refused["message"].as_str().unwrap().ends_with("nothing was written"), "{refused}");
    assert!(!folder.join(HEADER).exists());
    std::fs::remove_file(folder.join("generated/.mauve-staging")).unwrap();
    let written = client.call("mauve/generate", params).unwrap();
    assert_eq!(written, planned);
    assert!(folder.join(HEADER).is_file() && folder.join(CODEL).is_file());
    let found = generate(&mut client, &text.uri).unwrap();
    assert_eq!(
        (files(&found).len(), &found["nothing"]),
        (0, &json!("The Orocos packages in generated are up to date."))
    );
}

#[test]
fn what_the_models_make_no_more_is_said() {
    let folder = project("left");
    let (mut client, mut text) = opened(&folder, &good_editor());
    generated(&mut client, &text.uri);
    assert_eq!(generate(&mut client, &text.uri).unwrap()["warning"], json!(null));
    client.edit(&mut text, "library parts", "library pieces");
    client.diagnostics(&text);
    let found = generate(&mut client, &text.uri).unwrap();
    execute(&mut client, json!([text.uri])).unwrap();
    let warning = said(&mut client);
    assert_eq!(
        warning,
        "generated/parts: this package is no longer generated from these models; remove it if you do not need it."
    );
    assert_eq!(found["warning"], warning);
    // A deployment is not all of them.
    let params = json!({"textDocument": {"uri": text.uri}, "deployment": "D"});
    assert_eq!(client.call("mauve/generate", params).unwrap()["warning"], json!(null));
    // Nor is a workspace where another one that is open puts its packages as well.
    write(
        &folder,
        &[("inner/mauve.toml", "[project]\nroot = \"it.mal\"\n[generate]\nout = \"../generated\"\n")],
    );
    write(&folder, &[("inner/it.mal", &MODEL.replace("library parts", "library other"))]);
    let (mut client, text) = opened(&folder, &good_editor());
    let inner = client.open_file(&folder.join("inner/it.mal"));
    client.diagnostics(&inner);
    generated(&mut client, &inner.uri);
    assert_eq!(generate(&mut client, &text.uri).unwrap()["warning"], json!(null));
}

#[test]
fn the_folder_is_in_that_of_the_workspace() {
    let folder = project("folder");
    let out = |text: &str| {
        let config = format!("[project]\nroot = \"robot.mal\"\n[generate]\nout = {text:?}\n");
        std::fs::write(folder.join("mauve.toml"), config).unwrap();
    };
    let elsewhere = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_generate_elsewhere");
    std::os::unix::fs::symlink(&elsewhere, folder.join("link")).unwrap();
    std::os::unix::fs::symlink(elsewhere.join("nothing"), folder.join("dangling")).unwrap();
    write(&folder, &[("file", "")]);
    let absolute = elsewhere.join("out").display().to_string();
    for (path, why) in [
        ("..", "which is outside the workspace folder"),
        ("../out", "which is outside the workspace folder"),
        ("inner/../../out", "which is outside the workspace folder"),
        (&absolute, "which is outside the workspace folder"),
        ("link", "which is outside the workspace folder"),
        ("link/inner", "which is outside the workspace folder"),
        (".git/hooks", "which is in a hidden folder"),
        ("inner/.github", "which is in a hidden folder"),
        ("dangling/inner", "is a link that leads nowhere"),
        ("dangling", "is a link that leads nowhere"),
        ("file", "file is a file"),
        ("file/inner", "cannot be read"),
    ] {
        out(path);
        let (mut client, text) = opened(&folder, &good_editor());
        let found = actions(&mut client, &text, "deployment D", json!({"triggerKind": 1}));
        let reason = found[0]["disabled"]["reason"].as_str().unwrap_or_else(|| panic!("{path}: {found:#?}"));
        assert!(reason.contains(why), "{path}: {reason}");
        assert_eq!(generate(&mut client, &text.uri).unwrap_err(), reason);
    }
    assert_eq!(all_texts_in(&elsewhere), BTreeMap::new());
    // A package that leads out of it.
    out("cpp/robot");
    std::fs::create_dir_all(folder.join("cpp/robot")).unwrap();
    std::os::unix::fs::symlink(&elsewhere, folder.join("cpp/robot/parts")).unwrap();
    let (mut client, text) = opened(&folder, &good_editor());
    let refused = generate(&mut client, &text.uri).unwrap_err();
    assert!(refused.contains("is a link that leads out of"), "{refused}");
    std::fs::remove_file(folder.join("cpp/robot/parts")).unwrap();
    let found = generate(&mut client, &text.uri).unwrap();
    assert_eq!(found["folder"], folder.join("cpp/robot").display().to_string());
    assert!(apply(&found["edit"]).iter().all(|(_, path)| path.starts_with(folder.join("cpp/robot/parts"))));

    // Beside the models, where the editor has that folder open too.
    let whole = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_generate_whole");
    let config = "[project]\nroot = \"robot.mal\"\n[generate]\nout = \"../src\"\n";
    write(&whole, &[("models/robot.mal", MODEL), ("models/mauve.toml", config)]);
    for (folder, is_fine) in [(whole.clone(), true), (whole.join("models"), false)] {
        let (mut client, _) = start(&folder, &good_editor());
        let text = client.open_file(&whole.join("models/robot.mal"));
        let found = generate(&mut client, &text.uri);
        assert_eq!(found.is_ok(), is_fine, "{found:?}");
    }
}

#[test]
fn arguments_that_mean_nothing() {
    let folder = project("arguments");
    let (mut client, text) = opened(&folder, &good_editor());
    let uri = text.uri.as_str();
    let deep = (0..100).fold(json!("x"), |inner, _| json!([inner]));
    for arguments in [
        Value::Null,
        json!([]),
        json!([null]),
        json!([7]),
        json!([{"uri": uri}]),
        json!([uri, 7]),
        json!([uri, ["D"]]),
        json!([uri, "D", "E"]),
        json!([[uri]]),
        json!([""]),
        json!(["no address"]),
        json!(["file:///no/such/file.mal"]),
        json!(["untitled:x"]),
        json!(["file:///%00%ff"]),
        json!([uri, ""]),
        json!([uri, "No"]),
        json!([uri, "parts.D.E"]),
        json!([uri, "../../D"]),
        json!([uri, "D\u{0}\n\u{202e}"]),
        json!([uri, "D".repeat(100_000)]),
        deep,
    ] {
        let error = execute(&mut client, arguments.clone()).unwrap_err();
        assert!([-32602, -32803].contains(&error["code"].as_i64().unwrap()), "{arguments}: {error}");
        assert!(!error["message"].as_str().unwrap().chars().any(char::is_control), "{arguments}: {error}");
    }
    let near = execute(&mut client, json!([uri, "parts.DD"])).unwrap_err();
    assert!(near["message"].as_str().unwrap().ends_with("did you mean `parts.D`?"), "{near}");
    for params in [
        json!(null),
        json!({}),
        json!({"textDocument": 7}),
        json!({"textDocument": {"uri": uri}, "deployment": 7}),
    ] {
        assert_eq!(client.call("mauve/generate", params.clone()).unwrap_err()["code"], -32602, "{params}");
    }
    // What an action brings back may be anything.
    let action = actions(&mut client, &text, "deployment D", json!({})).remove(0);
    for (pointer, value) in [
        ("/data/generate", json!(7)),
        ("/data/generate", json!({"deployment": {}})),
        ("/data/document", json!({"uri": "file:///no/such/file.mal"})),
        ("/data/generate/deployment", json!("No")),
        ("/data/version", json!(-7)),
    ] {
        let mut broken = action.clone();
        *broken.pointer_mut(pointer).unwrap() = value;
        let answer = client.call("codeAction/resolve", broken);
        assert!(answer.as_ref().is_err() || answer.as_ref().unwrap().get("edit").is_none(), "{answer:?}");
    }
    assert!(!folder.join("generated").exists());
    // An untitled text has no folder.
    let text = client.open_at("untitled:Untitled-1", MODEL);
    client.diagnostics(&text);
    let refused = generate(&mut client, &text.uri).unwrap_err();
    assert!(refused.contains("save it first"), "{refused}");
    assert_eq!(client.shut_down(), Some(0));
}

#[test]
fn an_edit_overtakes_an_action_and_not_a_command() {
    let folder = project("overtaken");
    let (mut client, mut text) = opened(&folder, &good_editor());
    let action = actions(&mut client, &text, "deployment D", json!({})).remove(0);
    client.edit(&mut text, "library", "// A line more.\nlibrary");
    assert_eq!(client.call("codeAction/resolve", action).unwrap_err()["code"], -32801);
    // Edits that come while it is worked on.
    for round in 0..5 {
        let action = actions(&mut client, &text, "deployment D", json!({})).remove(0);
        let resolved = client.request("codeAction/resolve", action);
        let command = json!({"command": "mauve.generateOrocos", "arguments": [text.uri, "D"]});
        let executed = client.request("workspace/executeCommand", command);
        client.edit(&mut text, "library", &format!("// {round}\nlibrary"));
        if let Err(error) = client.answer(resolved) {
            assert_eq!(error["code"], -32801);
        }
        assert!(client.answer(executed).unwrap()["created"].as_u64() > Some(5));
    }
    client.idle();
    assert!(!folder.join("generated").exists());
}
