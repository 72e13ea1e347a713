//! Files that change without an event: on an overlay file system whose lower folder others change, and where the system refuses
//! to watch.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use mauve_tests::{Client, Text, address, scratch, wait_for_watcher, write};
use serde_json::{Value, json};

use crate::MAUVE;

const MODEL: &str = "codel plan(): int
shell S { }
core C(S) { update = { plan(); } }
component Pilot(S, C)
architecture A { instance pilot: Pilot }
deployment D { architecture A
  activity pilot { priority = 1 period = 100 }
}
";
const CONFIG: &str = "[timing]\ntables = [\"times/*.toml\"]\n[platform]\nrt_throttling = false\n";

/// The time after which the server looks at files by itself.
const POLL: Duration = Duration::from_secs(5);

/// A server that a shell script prepares, for the folder `robot`; the test changes the files of `disk`.
struct Session {
    top: PathBuf,
    disk: PathBuf,
    client: Client,
    text: Text,
}

impl Session {
    /// `isolated` runs a shell in namespaces of its own, where `prepare` sets what the server meets.
    fn new(name: &str, disk: &str, isolated: &str, prepare: &str) -> Session {
        let top = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("unwatched_{name}"));
        let disk = top.join(disk);
        fs::create_dir_all(top.join("robot")).unwrap();
        write(&disk, &[("robot.mal", MODEL), ("mauve.toml", CONFIG), ("times/plan.toml", &table(17))]);
        write(&disk, &[("more.mal", "codel more(): int\n")]);
        let server = top.join("server");
        let folder = top.display();
        let script =
            format!("#!/bin/sh\nexec {isolated} sh -ec '{prepare}\nexec {MAUVE} \"$@\"' {folder} \"$@\"\n");
        fs::write(&server, script).unwrap();
        fs::set_permissions(&server, fs::Permissions::from_mode(0o755)).unwrap();
        let mut client = Client::of_folder(server.to_str().unwrap(), &top.join("robot"));
        let text = client.open(&top.join("robot/robot.mal"), MODEL);
        client.diagnostics(&text);
        Session { top, disk, client, text }
    }

    fn put(&self, path: &str, text: &str) {
        write(&self.disk, &[(path, text)]);
    }

    fn expect(&mut self, time: u32) {
        self.client.wait_for_hint(&self.text, "activity", |it| it.contains(&format!(" {time} / ")));
    }

    /// Each of these messages has the server notice what has changed before it.
    fn expect_after_messages(&mut self) {
        let text = json!({"uri": self.text.uri});
        let other = address(&self.top.join("robot/more.mal"));
        let opened =
            json!({"uri": other, "languageId": "mauve", "version": 1, "text": "codel more(): int\n"});
        let table_uri = address(&self.top.join("robot/times/plan.toml"));
        let messages = [
            ("textDocument/didSave", json!({"textDocument": text})),
            ("textDocument/didOpen", json!({"textDocument": opened})),
            ("mauve/focus", json!({})),
            ("workspace/didChangeWatchedFiles", json!({"changes": [{"uri": table_uri, "type": 2}]})),
            ("textDocument/didSave", json!({"textDocument": text})),
            ("textDocument/didSave", json!({"textDocument": {"uri": other}})),
        ];
        let begin = Instant::now();
        for (time, (method, params)) in (20..).zip(messages) {
            self.put("times/plan.toml", &table(time));
            self.client.notify(method, params);
            self.expect(time);
        }
        // One of them may be noticed without a message.
        assert!(begin.elapsed() < 3 * POLL, "{:?}", begin.elapsed());
    }

    /// The verdict, when the server has one: it looks at files at any time.
    fn verdict(&mut self) -> String {
        let text = wait_for_watcher(Duration::from_secs(60), || {
            let status = self.client.call("mauve/status", Value::Null).unwrap();
            status["verdict"]["text"].as_str().map(str::to_owned).ok_or(status)
        });
        text.unwrap()
    }
}

fn table(plan: u32) -> String {
    format!("[codel]\nplan = {plan}\n")
}

/// Returns the first of these commands that runs `test` in a shell.
fn way(ways: &[&'static str], test: &str, folder: &Path) -> &'static str {
    let works = |way: &&&str| {
        let words: Vec<&str> = way.split(' ').chain(["sh", "-ec", test]).collect();
        let output = Command::new(words[0]).args(&words[1..]).arg(folder).output();
        output.is_ok_and(|output| output.status.success())
    };
    ways.iter().find(works).unwrap_or_else(|| panic!("none of {ways:?} can do this here: {test}"))
}

#[test]
fn an_overlay_whose_lower_folder_changes() {
    let mount = r#"cd "$0"
mkdir -p lower robot over
mount -t tmpfs none over
mkdir over/upper over/work
mount -t overlay -o lowerdir=lower,upperdir=over/upper,workdir=over/work none robot"#;
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "unwatched_way");
    let way = way(&["unshare --mount", "unshare --user --map-root-user --mount"], mount, &folder);
    let mut it = Session::new("overlay", "lower", way, mount);
    it.expect(17);
    it.expect_after_messages();
    // Without a message.
    it.put("times/plan.toml", &table(40));
    it.expect(40);
    it.put("mauve.toml", &CONFIG.replace("times/*.toml", "none.toml"));
    it.client.wait_for_hint(&it.text, "activity", super::is_unknown);
    it.put("mauve.toml", CONFIG);
    it.expect(40);
    // Nor while the user types.
    it.put("times/plan.toml", &table(41));
    it.client.edit(&mut it.text, "period = 100", "period = 90");
    it.expect(41);
    // The system watches: what changes in the overlay itself has events.
    let verdict = it.verdict();
    assert!(!verdict.contains("watched"), "{verdict}");
}

#[test]
fn a_limit_of_inotify_that_is_reached() {
    for (limit, value) in [("instances", 0), ("watches", 1)] {
        let set = format!("echo {value} >/proc/sys/user/max_inotify_{limit}");
        let mut it = Session::new(limit, "robot", "unshare --user --map-root-user", &set);
        it.expect(17);
        let remedy = format!("raise fs.inotify.max_user_{limit}");
        let said = format!(" · files not watched: {remedy}");
        let verdict = it.verdict();
        assert!(verdict.starts_with('✓') && verdict.ends_with(&said), "{verdict}");
        it.expect_after_messages();
        // Without a message: a table, one that is new, one that goes away, and a model.
        it.put("times/plan.toml", &table(40));
        it.expect(40);
        it.put("times/more.toml", "[overhead]\ndispatch = 7\n");
        it.expect(47);
        fs::remove_file(it.disk.join("times/more.toml")).unwrap();
        it.expect(40);
        it.put("sub/broken.mal", "codel f(\n");
        it.client.wait_for_published(|published| format!("{published:?}").contains("broken.mal"));
        let verdict = it.verdict();
        assert!(verdict.ends_with(&said), "{verdict}");
        let is_warning = |it: &Value| {
            it["method"] == "window/showMessage" && it["params"]["message"].to_string().contains(&remedy)
        };
        assert_eq!(it.client.count(is_warning), 1);
    }
}
