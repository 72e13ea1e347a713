//! Files, folders and links that come, go and become others under a running server: afterwards it knows what a fresh one
//! does.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use mauve_tests::{Client, Text, address, copy, scratch, write};
use serde_json::json;

use super::{MAUVE, is_unknown};

const MODEL: &str = "codel plan(): int
shell S { }
core C(S) { update = { plan(); } }
component Pilot(S, C)
architecture A { instance pilot: Pilot }
deployment D { architecture A
  activity pilot { priority = 1 period = 100 }
}
";

/// A server for `robot` below a folder, in which the model is open.
struct Session {
    top: PathBuf,
    client: Client,
    text: Text,
}

impl Session {
    /// The folder has a model, its configuration and a table, or what `files` say instead.
    fn new(name: &str, files: &[(&str, &str)], prepare: impl FnOnce(&Path)) -> Session {
        let top = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("disk_{name}"));
        write(&top, &[("robot/robot.mal", MODEL), ("robot/mauve.toml", &config("times/*.toml"))]);
        write(&top, &[("robot/times/plan.toml", table(17).as_str()), (".git/HEAD", "")]);
        write(&top, files);
        prepare(&top);
        let mut client = Client::of_folder(MAUVE, &top.join("robot"));
        let text = client.open_file(&top.join("robot/robot.mal"));
        client.diagnostics(&text);
        Session { top, client, text }
    }

    fn path(&self, path: &str) -> PathBuf {
        self.top.join(path)
    }

    fn put(&self, path: &str, text: &str) {
        write(&self.top, &[(path, text)]);
    }

    fn rename(&self, from: &str, to: &str) {
        fs::rename(self.path(from), self.path(to)).unwrap();
    }

    /// Puts a link in the place of another, at once.
    fn link(&self, target: &str, link: &str) {
        let new = self.path("new_link");
        symlink(target, &new).unwrap();
        fs::rename(new, self.path(link)).unwrap();
    }

    /// Waits until the response time of the model is as a fresh server says, which says `expected`.
    fn expect(&mut self, expected: &str) {
        let mut fresh = Client::of_folder(MAUVE, &self.top.join("robot"));
        let text = fresh.open(&self.path("robot/robot.mal"), &self.text.text);
        fresh.diagnostics(&text);
        let hint = fresh.hint(&text, "activity");
        assert!(hint.contains(expected), "{hint}");
        self.client.wait_for_hint(&self.text, "activity", |it| it == hint);
        fresh.idle();
        let expected = fresh.published();
        self.client.wait_for_published(|published| *published == expected);
    }
}

/// Waits until the server has noticed what has changed on the disk. It learns of changes in their order: this one is the last.
fn notice_changes(client: &mut Client, folder: &Path) {
    let path = folder.join("last.mal");
    fs::write(&path, "codel f(\n").unwrap();
    client.wait_for_published(|published| published.contains_key(&address(&path)));
    fs::remove_file(&path).unwrap();
    client.wait_for_published(|published| !published.contains_key(&address(&path)));
}

fn config(tables: &str) -> String {
    format!("[timing]\ntables = [\"{tables}\"]\n[platform]\nrt_throttling = false\n")
}

fn table(plan: u32) -> String {
    format!("[codel]\nplan = {plan}\n")
}

#[test]
fn what_was_taken_away_comes_back() {
    let mut it = Session::new("back", &[("robot/times/more.toml", "[overhead]\ndispatch = 20\n")], |_| {});
    it.expect(" 37 / ");
    fs::remove_file(it.path("robot/times/more.toml")).unwrap();
    it.expect(" 17 / ");
    it.put("robot/times/more.toml", "[overhead]\ndispatch = 30\n");
    it.expect(" 47 / ");
    fs::remove_file(it.path("robot/mauve.toml")).unwrap();
    it.expect("? ");
    it.put("robot/mauve.toml", &config("times/plan.toml"));
    it.expect(" 17 / ");
}

#[test]
fn the_tables_of_a_deployment() {
    let own =
        |tables: &str| config("times/*.toml") + &format!("[timing.deployment.D]\ntables = [\"{tables}\"]\n");
    let files = [("robot/mauve.toml", own("sea/*.toml")), ("robot/sea/plan.toml", table(30))];
    let files: Vec<(&str, &str)> = files.iter().map(|(path, text)| (*path, text.as_str())).collect();
    let mut it = Session::new("own_tables", &files, |_| {});
    it.expect(" 30 / ");
    // No deployment uses this table.
    it.put("robot/times/plan.toml", &table(50));
    it.put("robot/sea/plan.toml", &table(31));
    it.expect(" 31 / ");
    it.put("robot/sea/more.toml", "[overhead]\ndispatch = 9\n");
    it.expect(" 40 / ");
    it.put("robot/mauve.toml", &own("lake/*.toml"));
    it.expect("? ");
    it.put("robot/lake/plan.toml", &table(8));
    it.expect(" 8 / ");
    it.put("robot/mauve.toml", &config("times/*.toml"));
    it.expect(" 50 / ");
}

#[test]
fn links_that_lead_to_others() {
    let files = [
        ("slow/plan.toml", table(80)),
        ("fast/plan.toml", table(5)),
        ("robot/mauve.toml", config("../now/*.toml")),
    ];
    let files: Vec<(&str, &str)> = files.iter().map(|(path, text)| (*path, text.as_str())).collect();
    let mut it = Session::new("links", &files, |top| symlink("slow", top.join("now")).unwrap());
    it.expect(" 80 / ");
    it.link("fast", "now");
    it.expect(" 5 / ");
    // Both have been read before.
    it.link("slow", "now");
    it.expect(" 80 / ");
    it.put("slow/plan.toml", &table(70));
    it.expect(" 70 / ");
    // What it leads to goes away, and comes back; and another folder takes its place.
    it.rename("slow", "away");
    it.expect("? ");
    it.rename("away", "slow");
    it.expect(" 70 / ");
    it.put("other/plan.toml", &table(60));
    it.rename("slow", "away");
    it.rename("other", "slow");
    it.expect(" 60 / ");
    // A file by a link of its own.
    it.put("robot/mauve.toml", &config("plan_now.toml"));
    it.link("../slow/plan.toml", "robot/plan_now.toml");
    it.expect(" 60 / ");
    it.link("../fast/plan.toml", "robot/plan_now.toml");
    it.expect(" 5 / ");
    it.link("../slow/plan.toml", "robot/plan_now.toml");
    it.expect(" 60 / ");
}

#[test]
fn one_folder_by_two_names() {
    let mut it = Session::new("two_names", &[("robot/mauve.toml", &config("link/plan.toml"))], |top| {
        symlink("times", top.join("robot/link")).unwrap();
    });
    it.expect(" 17 / ");
    it.put("robot/mauve.toml", &config("times/plan.toml"));
    it.expect(" 17 / ");
    it.put("robot/times/plan.toml", &table(18));
    it.expect(" 18 / ");
}

#[test]
fn an_open_file_behind_a_link_that_leads_elsewhere() {
    let model = MODEL.replace("100 }", "50 }");
    let config = "assume.codel = \"1 ms\"\n";
    let texts = [
        ("one/other.mal", MODEL),
        ("one/mauve.toml", config),
        ("two/other.mal", &model),
        ("two/mauve.toml", config),
    ];
    let mut it = Session::new("open_link", &texts, |top| {
        symlink("../one", top.join("robot/link")).unwrap();
    });
    let path = it.path("robot/link/other.mal");
    let mut other = it.client.open_file(&path);
    it.client.edit(&mut other, "100 }", "90 }");
    assert!(it.client.hint(&other, "activity").starts_with("✓ 1 / 90 ms"));
    it.link("../two", "robot/link");
    it.client.edit(&mut other, "90 }", "80 }");
    it.client.wait_for_hint(&other, "activity", |hint| hint.starts_with("✓ 1 / 80 ms"));
    it.client.notify("textDocument/didClose", json!({"textDocument": {"uri": other.uri}}));
    // What was never saved is nobody's text any more.
    let other = it.client.open_file(&path);
    it.client.wait_for_hint(&other, "activity", |hint| hint.starts_with("✓ 1 / 50 ms"));
    it.link("../one", "robot/link");
    it.client.notify("textDocument/didClose", json!({"textDocument": {"uri": other.uri}}));
    let other = it.client.open_file(&path);
    it.client.wait_for_hint(&other, "activity", |hint| hint.starts_with("✓ 1 / 100 ms"));
}

#[test]
fn what_stands_outside_of_the_folder() {
    // A root and an include that are not there yet.
    let root = "[project]\nroot = \"../roots/root.mal\"\n".to_owned() + &config("times/*.toml");
    let mut it = Session::new("outside", &[("robot/mauve.toml", &root)], |_| {});
    it.client.idle();
    let unknown = it.client.published();
    assert!(format!("{unknown:?}").contains("../roots/root.mal"), "{unknown:?}");
    it.put("roots/root.mal", "include \"../robot/robot.mal\"\ninclude \"more.mal\"\n");
    it.expect(" 17 / ");
    assert!(format!("{:?}", it.client.published()).contains("unresolved-include"));
    it.put("roots/more.mal", "codel more(): int\n");
    it.expect(" 17 / ");
    assert!(it.client.published().is_empty());
    // A table that is no `.toml`.
    it.put("robot/mauve.toml", &root.replace("times/*.toml", "tables/*.wcet"));
    it.expect("? ");
    it.put("robot/tables/plan.wcet", &table(19));
    it.expect(" 19 / ");
    it.put("robot/tables/plan.wcet", &table(20));
    it.expect(" 20 / ");
    it.put("robot/tables/more.wcet", "[overhead]\ndispatch = 1\n");
    it.expect(" 21 / ");
    fs::remove_file(it.path("robot/tables/more.wcet")).unwrap();
    it.expect(" 20 / ");
    fs::remove_file(it.path("robot/tables/plan.wcet")).unwrap();
    it.expect("? ");
}

#[test]
fn a_configuration_above_the_folder_and_one_behind_a_link() {
    let mut it = Session::new("above", &[("times/plan.toml", &table(23))], |top| {
        fs::remove_file(top.join("robot/mauve.toml")).unwrap();
    });
    it.expect("? ");
    it.put("mauve.toml", &config("times/*.toml"));
    it.expect(" 23 / ");
    it.put("elsewhere.toml", &config("times/none.toml"));
    it.link("../elsewhere.toml", "robot/mauve.toml");
    it.expect("? ");
    it.put("elsewhere.toml", &config("times/plan.toml"));
    it.expect(" 17 / ");
}

#[test]
fn folders_that_are_copied_swapped_and_ignored() {
    let mut it = Session::new("folders", &[], |_| {});
    copy(&it.path("robot/times"), &it.path("robot/copy"));
    it.put("robot/copy/plan.toml", &table(29));
    it.rename("robot/times", "robot/old");
    it.rename("robot/copy", "robot/times");
    it.expect(" 29 / ");
    it.put("robot/times/plan.toml", &table(30));
    it.expect(" 30 / ");
    // The whole folder, under the server.
    it.rename("robot", "away");
    it.client.wait_for_hint(&it.text, "activity", is_unknown);
    it.rename("away", "robot");
    it.expect(" 30 / ");
    it.put("robot/sub/broken.mal", "codel f(\n");
    it.expect(" 30 / ");
    assert!(format!("{:?}", it.client.published()).contains("broken.mal"));
    it.put(".gitignore", "sub\n");
    it.expect(" 30 / ");
    assert!(!format!("{:?}", it.client.published()).contains("broken.mal"));
    // Files of the other language that has this extension are nobody's business, until they are ours.
    it.put("robot/their.mal", "category System { }\n");
    it.expect(" 30 / ");
    it.put("robot/their.mal", "codel f(\n");
    it.expect(" 30 / ");
    assert!(format!("{:?}", it.client.published()).contains("their.mal"));
    it.put("robot/their.mal", "category System { }\n");
    it.expect(" 30 / ");
}

#[test]
fn a_nearer_folder_of_the_model_path() {
    let top = scratch(env!("CARGO_TARGET_TMPDIR"), "disk_model_path");
    let model = MODEL.replace("codel plan(): int", "include \"plan.mal\"");
    let files = [
        ("robot/robot.mal", model.as_str()),
        ("robot/mauve.toml", &config("plan.toml")),
        ("robot/plan.toml", &table(17)),
        ("far/plan.mal", "codel plan(): int\n"),
    ];
    write(&top, &files);
    fs::create_dir(top.join("near")).unwrap();
    let models = format!("{}:{}", top.join("near").display(), top.join("far").display());
    let mut client = Client::start_with_models(MAUVE, &[], &models);
    client.initialize(Some(&top.join("robot")), &json!({}));
    let text = client.open_file(&top.join("robot/robot.mal"));
    assert!(client.hint(&text, "activity").contains(" 17 / "));
    // It declares something else.
    write(&top, &[("near/plan.mal", "codel another(): int\n")]);
    client.wait_for_hint(&text, "activity", is_unknown);
    fs::remove_file(top.join("near/plan.mal")).unwrap();
    client.wait_for_hint(&text, "activity", |hint| hint.contains(" 17 / "));
    fs::rename(top.join("far"), top.join("away")).unwrap();
    client.wait_for_hint(&text, "activity", is_unknown);
    fs::rename(top.join("away"), top.join("far")).unwrap();
    client.wait_for_hint(&text, "activity", |hint| hint.contains(" 17 / "));
}

#[test]
fn an_open_file_of_a_folder_without_a_configuration_is_checked_once() {
    let top = scratch(env!("CARGO_TARGET_TMPDIR"), "disk_once");
    write(&top, &[("robot.mal", MODEL), ("sub/a.mal", MODEL.replace("= 100", "= ten").as_str())]);
    let mut client = Client::of_folder(MAUVE, &top);
    let text = client.open_file(&top.join("sub/a.mal"));
    let document = json!({"textDocument": {"uri": text.uri}});
    let projects = |client: &mut Client| {
        client.idle();
        client.call("mauve/analysis", document.clone()).unwrap().as_array().map(Vec::len)
    };
    assert_eq!(projects(&mut client), Some(1));
    let found = client.diagnostics(&text).len();
    for _ in 0..3 {
        fs::write(top.join("sub/other"), "").unwrap();
        fs::remove_file(top.join("sub/other")).unwrap();
        notice_changes(&mut client, &top);
        assert_eq!(projects(&mut client), Some(1));
        assert_eq!(client.published()[&text.uri].as_array().map(Vec::len), Some(found));
    }
    // A client's folder within another folder belongs to that one.
    let folder = json!({"uri": address(&top.join("sub")), "name": "sub"});
    client
        .notify("workspace/didChangeWorkspaceFolders", json!({"event": {"added": [folder], "removed": []}}));
    assert_eq!(projects(&mut client), Some(1));
}

#[test]
fn links_on_the_way_that_lead_elsewhere() {
    // A model and a table of a pattern, each a link that goes through a link to a folder.
    let slower = MODEL.replace("100 }", "50 }");
    let files = [
        ("v1/a.mal", MODEL),
        ("v2/a.mal", slower.as_str()),
        ("v1/t.toml", &table(10)),
        ("v2/t.toml", &table(40)),
    ];
    let mut it = Session::new("on_the_way", &files, |top| {
        fs::remove_file(top.join("robot/times/plan.toml")).unwrap();
        symlink("v1", top.join("current")).unwrap();
        symlink("../../current/t.toml", top.join("robot/times/t.toml")).unwrap();
    });
    it.expect(" 10 / ");
    it.link("v2", "current");
    it.expect(" 40 / ");
    it.put("v2/t.toml", &table(41));
    it.expect(" 41 / ");
    // The client's folder itself.
    let top = it.top.clone();
    symlink("v1", top.join("ws")).unwrap();
    let config = config("t.toml");
    write(&top, &[("v1/mauve.toml", config.as_str()), ("v2/mauve.toml", config.as_str())]);
    let mut client = Client::of_folder(MAUVE, &top.join("ws"));
    let text = client.open(&top.join("ws/a.mal"), MODEL);
    client.wait_for_hint(&text, "activity", |hint| hint.contains(" 10 / "));
    it.link("v2", "ws");
    client.wait_for_hint(&text, "activity", |hint| hint.contains(" 41 / "));
}

#[test]
fn a_folder_that_is_touched_is_watched_on() {
    let mut it = Session::new("touched", &[("robot/mauve.toml", &config("../shared/times/*.toml"))], |top| {
        fs::create_dir(top.join("shared")).unwrap();
    });
    it.expect("? ");
    for again in [false, true] {
        if again {
            // Another folder of its name.
            fs::remove_dir_all(it.path("shared")).unwrap();
            fs::create_dir(it.path("shared")).unwrap();
        } else {
            fs::File::open(it.path("shared"))
                .unwrap()
                .set_modified(std::time::SystemTime::UNIX_EPOCH)
                .unwrap();
        }
        notice_changes(&mut it.client, &it.top.join("robot"));
        it.put("shared/times/t.toml", &table(37));
        it.expect(" 37 / ");
    }
    // Nor does what a client tells of all folders at once end it.
    let change = json!({"uri": "file:///", "type": 2});
    it.client.notify("workspace/didChangeWatchedFiles", json!({"changes": [change]}));
    it.put("shared/times/t.toml", &table(38));
    it.expect(" 38 / ");
}

#[test]
fn an_open_file_that_is_included_is_no_project_by_itself() {
    let part = "codel far(): int\narchitecture B { instance other: Pilot }\n\
                deployment E { architecture B\n activity other { priority = 1 period = 200 } }\n";
    let model = format!("include \"../part/part.mal\"\n{MODEL}");
    let files = [("robot/robot.mal", model.as_str()), ("part/part.mal", part)];
    let mut it = Session::new("included", &files, |_| {});
    let part = it.client.open_file(&it.path("part/part.mal"));
    it.client.wait_for_hint(&part, "activity", |hint| hint.contains(" 17 / "));
    let hints = it.client.hints(&part.uri);
    // Whatever has the folders looked through again.
    it.put("robot/more.mal", "codel more(): int\n");
    fs::remove_file(it.path("robot/more.mal")).unwrap();
    let event = json!({"event": {"added": [], "removed": []}});
    it.client.notify("workspace/didChangeWorkspaceFolders", event);
    it.client.idle();
    assert_eq!(it.client.hints(&part.uri), hints);
    // Where nothing includes it any more, it is.
    it.client.edit(&mut it.text, "include \"../part/part.mal\"\n", "");
    it.client.wait_for_hint(&part, "activity", is_unknown);
}

#[test]
fn an_open_file_of_another_repository_is_read_from_the_editor() {
    let model = format!("include \"../part/part.mal\"\n{MODEL}");
    let (model, part) = (model.replace("codel plan(): int\n", ""), "codel plan(): int\n");
    let files = [("robot/.git/HEAD", ""), ("robot/robot.mal", &model), ("part/part.mal", part)];
    let mut it = Session::new("repository", &files, |_| {});
    let event =
        json!({"event": {"added": [{"uri": address(&it.path("part")), "name": "part"}], "removed": []}});
    it.client.notify("workspace/didChangeWorkspaceFolders", event);
    it.client.wait_for_hint(&it.text, "activity", is_unknown);
    let part = it.client.open_file(&it.path("part/part.mal"));
    it.client.wait_for_hint(&it.text, "activity", |hint| hint.contains(" 17 / "));
    it.client.notify("textDocument/didClose", json!({"textDocument": {"uri": part.uri}}));
    it.client.wait_for_hint(&it.text, "activity", is_unknown);
}

#[test]
fn of_a_file_that_is_open_under_two_names_the_newer_text_is_analysed() {
    let mut it =
        Session::new("newer_text", &[], |top| symlink("robot.mal", top.join("robot/as.mal")).unwrap());
    let (file, link) = (it.path("robot/robot.mal"), it.path("robot/as.mal"));
    let mut other = it.client.open_file(&link);
    it.client.edit(&mut other, "period = 100", "period = 90");
    it.client.edit(&mut it.text, "period = 100", "period = 80");
    let analysed = |it: &mut Session, newer: &Text, older: &Text| {
        it.client.idle();
        assert!(it.client.hint(newer, "activity pilot").starts_with('✓'));
        assert_eq!(it.client.hints(&older.uri), []);
    };
    let text = it.text.clone();
    analysed(&mut it, &text, &other);
    // The link leads nowhere, and then to the same file again: no text has changed.
    for kind in [3, 1] {
        match kind {
            3 => fs::rename(&file, it.path("away")).unwrap(),
            _ => fs::rename(it.path("away"), &file).unwrap(),
        }
        let change = json!({"changes": [{"uri": address(&file), "type": kind}]});
        it.client.notify("workspace/didChangeWatchedFiles", change);
        it.client.idle();
    }
    analysed(&mut it, &text, &other);
    it.client.edit(&mut other, "period = 90", "period = 70");
    analysed(&mut it, &other, &text);
    // The link leads nowhere, which the server sees by an edit before the watcher tells it.
    fs::rename(&file, it.path("away")).unwrap();
    it.client.edit(&mut other, "period = 70", "period = 60");
    it.client.wait_for_hint(&text, "activity pilot", |hint| hint.starts_with("✓ 17 / 80 ms"));
    it.client.wait_for_hint(&other, "activity pilot", |hint| hint.starts_with("✓ 17 / 60 ms"));
}

/// The texts with which the plugins for editors are tested, too.
#[test]
fn an_open_file_of_another_language_has_neither_diagnostics_nor_hints() {
    let top = scratch(env!("CARGO_TARGET_TMPDIR"), "disk_language");
    let models = [
        ("robot/robot.mal", MODEL),
        ("robot/mauve.toml", &config("plan.toml")),
        ("robot/plan.toml", &table(17)),
    ];
    let theirs = [
        "#id: \"org.example.lang\"\n#version: \"1.0.0\"\n",
        "\u{feff}// a comment\n/* another\n   one */\ninclude \"core.mal\"\r\n\r\n#id : \"x\"",
        "category System {\n  abstract asset Machine {\n    | connect\n      -> access\n  }\n}\n",
        "associations {\n  Network [networks] * <-- Access --> * [machines] Machine\n}",
        "// Licence\ninclude \"core.mal\"\ncategory System {\n  asset Host {",
    ];
    for folder in [Some("robot"), None] {
        write(&top, &models);
        let mut client = Client::start(MAUVE, &[]);
        client.initialize(folder.map(|folder| top.join(folder)).as_deref(), &json!({}));
        for (number, text) in theirs.iter().enumerate() {
            let path = top.join("robot").join(format!("their{number}.mal"));
            for is_saved in [false, true] {
                if is_saved {
                    fs::write(&path, text).unwrap();
                }
                let mut their = client.open(&path, text);
                assert_eq!(client.diagnostics(&their), Vec::<serde_json::Value>::new(), "{folder:?} {text}");
                assert_eq!(client.hints(&their.uri), [], "{text}");
                // A text that becomes ours is checked.
                client.replace(&mut their, 0..text.len(), "codel f(\n");
                assert_ne!(client.diagnostics(&their), Vec::<serde_json::Value>::new(), "{folder:?} {text}");
                client.replace(&mut their, 0.."codel f(\n".len(), text);
                assert_eq!(client.diagnostics(&their), Vec::<serde_json::Value>::new(), "{folder:?} {text}");
                client.notify("textDocument/didClose", json!({"textDocument": {"uri": their.uri}}));
            }
            fs::remove_file(&path).unwrap();
        }
        // The project is analysed as without these files.
        let robot = client.open_file(&top.join("robot/robot.mal"));
        assert!(client.hint(&robot, "activity").contains(" 17 / "), "{folder:?}");
    }
}
