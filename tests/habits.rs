//! What other programs do to a project while somebody types: version control, builds, package managers, and how editors write
//! files. While each works and after it, an edit has its diagnostics; when it has ended, the server knows what a first start does.
//!
//! `MAUVE_HABITS=10 cargo test --release -p mauve --test main habits::` does each so many times, with greater floods, and prints from
//! an edit to its diagnostics: the times while the program works, and of the first edit behind it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use mauve_tests::{Client, Text, Times, address, generated_project, mauve, scratch, wait_for_watcher, write};
use serde_json::{Value, json};

use crate::MAUVE;

/// What is noticed later on the disk is not noticed.
const PATIENCE: Duration = Duration::from_secs(20);

/// So long is the pause between two edits.
const KEY: Duration = Duration::from_millis(15);

/// The habits, each with a name and scripts. After each script, the test compares the server with a first start. Each line of a script
/// begins in the folder of the repository, whose project is in `robot`. The line `flood FOLDER` writes many files in nested folders there.
const HABITS: [(&str, &[&str]); 36] = [
    ("git checkout of 60 changed models, and back", &["git checkout -q other", "git checkout -q main"]),
    (
        "git stash, git stash pop",
        &["sed -i s/sense/senses/ robot/part*.mal; git stash -q", "git stash pop -q"],
    ),
    ("git rebase with a conflict, --abort", &["! git rebase -q other", "git rebase --abort"]),
    ("git rebase with a conflict, --skip", &["! git rebase -q other", "git rebase --skip"]),
    ("git merge with a conflict, --abort", &["! git merge -q other", "git merge --abort"]),
    (
        "git merge with a conflict, checkout --theirs",
        &["! git merge -q other", "git checkout --theirs . && git commit -qam merged"],
    ),
    ("git worktree add, remove", &["git worktree add -q tree other", "git worktree remove tree"]),
    (
        "git clean -fdx",
        &["mkdir -p robot/new/deep && cp robot/part1.mal robot/new/deep/x.mal", "git clean -qfdx"],
    ),
    ("git rm -r, git reset --hard", &["git rm -qr robot", "git reset -q --hard"]),
    ("git cherry-pick, git revert", &["git cherry-pick easy", "git revert --no-edit HEAD"]),
    ("git checkout of a commit", &["git checkout -q main~1", "git checkout -q main"]),
    ("cp -r of the project", &["cp -r robot again", "rm -r again"]),
    ("mv of a folder", &["mv robot/parts robot/moved", "mv robot/moved robot/parts"]),
    ("mv of the project", &["mv robot away", "mv away robot"]),
    ("mkdir -p and cp", &["mkdir -p robot/a/b/c/d && cp robot/part1.mal robot/a/b/c/d/x.mal"]),
    ("npm install", &["flood robot/node_modules"]),
    ("npm install into a folder of another name", &["flood robot/vendor", "rm -r robot/vendor"]),
    ("cargo build", &["mkdir robot/target && cp CACHEDIR.TAG robot/target\nflood robot/target"]),
    (
        "colcon build --symlink-install",
        &["mkdir -p build install/share log; ln -s ../../robot install/share/robot; touch log/x.mal\n\
           flood build\nflood install/share/deep"],
    ),
    (
        "python -m venv",
        &["mkdir .venv\nflood .venv", "mkdir venv; echo '*' > venv/.gitignore\nflood venv/lib"],
    ),
    (
        "a formatter that renames",
        &["sed s/sense/senses/ robot/part3.mal > robot/.part3.tmp; mv robot/.part3.tmp robot/part3.mal"],
    ),
    (
        "vim: backup, write, remove",
        &[
            "cd robot; touch 4913; rm 4913; mv part3.mal part3.mal~; sed s/act/acts/ part3.mal~ > part3.mal; rm part3.mal~",
        ],
    ),
    ("VS Code: writes in place", &["cd robot; sed s/sense/senses/ part3.mal > x; cat x > part3.mal; rm x"]),
    (
        "JetBrains: safe write",
        &[
            "cd robot; sed s/act/acts/ part3.mal > part3.mal___jb_tmp___; mv part3.mal part3.mal___jb_old___; \
           mv part3.mal___jb_tmp___ part3.mal; rm part3.mal___jb_old___",
        ],
    ),
    (
        "Emacs: lock and autosave",
        &[
            "cd robot; ln -s me@host.123 .#part3.mal; cp part3.mal '#part3.mal#'; cp part3.mal part3.mal~",
            "cd robot; echo '// more' >> part3.mal; rm .#part3.mal '#part3.mal#'",
        ],
    ),
    ("sed -i", &["sed -i 's/value > 0/value > 7/' robot/part*.mal"]),
    (
        "two editors of one file",
        &["for i in 1 2 3 4 5 6; do echo '// one' >> robot/root.mal; sed -i '$d' robot/root.mal; done"],
    ),
    (
        "rsync",
        &[
            "cd robot; for i in 1 2 3 4; do sed s/act/acts/ part$i.mal > .part$i.mal.Xy12; mv .part$i.mal.Xy12 part$i.mal; done",
        ],
    ),
    (
        "a file that is removed and made again",
        &[
            "cd robot; cp part3.mal x; rm part3.mal; cp x part3.mal",
            "rm robot/part3.mal",
            "mv robot/x robot/part3.mal",
        ],
    ),
    ("a name in another case", &["mv robot/part3.mal robot/Part3.mal", "mv robot/Part3.mal robot/part3.mal"]),
    ("touch of all", &["find . -path ./.git -prune -o -exec touch {} +"]),
    (
        "a script that changes the configuration and a table",
        &[
            "cd robot; sed -i 's/= 1$/= 9/' times.toml; sed -i s/times.toml/*.toml/ mauve.toml",
            "cd robot; sed -i 's/\"\\*.toml\"/\"none.toml\"/' mauve.toml",
        ],
    ),
    ("unzip", &["tar cf x.tar robot; mkdir unzipped; tar xf x.tar -C unzipped", "tar xf x.tar"]),
    (
        "a link to another folder",
        &[
            "cp -r robot/parts far; ln -s far now; ln -s ../now/extra.mal robot/linked.mal",
            "ln -sfn robot/parts now",
        ],
    ),
    (
        "new ignore rules",
        &["echo parts > robot/.gitignore", "rm robot/.gitignore", "echo robot >> .gitignore"],
    ),
    (
        "a project in the project",
        &["touch robot/parts/mauve.toml", "rm robot/parts/mauve.toml", "git init -q robot"],
    ),
];

/// A repository with two branches in conflict, and a server that has its root open.
struct Desk {
    top: PathBuf,
    client: Client,
    root: Text,
    flood: usize,
}

impl Desk {
    fn new(name: &str, flood: usize) -> Desk {
        let top = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("habits_{name}"));
        write(&top.join("robot"), &generated_project(61, 600));
        write(
            &top,
            &[("robot/parts/extra.mal", "library extra { codel more(): int }\n"), (".gitignore", "*.tar\n")],
        );
        write(&top, &[("CACHEDIR.TAG", "Signature: 8a477f597d28d172789f06886806bc55\n")]);
        let commit = |what: &str| format!("{what}; git add -A; git commit -qm changed");
        let change = |from, to| format!("sed -i 's/{from}/{to}/' robot/part*.mal");
        run(&top, "git init -q -b main");
        run(&top, &commit(":"));
        run(&top, &format!("git checkout -q -b other; {}", commit(&change("gain: double)", "gain: int)"))));
        run(&top, &commit(&change("Part \\(.*\\) of a", "Piece \\1 of a")));
        run(
            &top,
            &format!("git checkout -q main; {}", commit(&change("Part \\(.*\\) of a", "Section \\1 of a"))),
        );
        run(
            &top,
            &format!("git checkout -q -b easy; {}; git checkout -q main", commit("echo >> robot/part7.mal")),
        );
        run(&top, "git tag base");
        let mut client = Client::of_folder(MAUVE, &top);
        let root = client.open_file(&top.join("robot/root.mal"));
        client.diagnostics(&root);
        // A diff view: another text of a file of the project.
        let old = format!("git:{}?%7B%22ref%22%3A%22HEAD%22%7D", top.join("robot/part1.mal").display());
        client.open_at(&old, "library part1 { codel sense(");
        client.idle();
        Desk { top, client, root, flood }
    }

    /// Types a digit, and waits for its diagnostics.
    fn edit(&mut self, times: &mut Times) {
        let at = self.root.text.find("period = 1").map_or(0, |at| at + "period = 1".len());
        let digit = if self.root.text[at..].starts_with('0') { "1" } else { "0" };
        let begin = Instant::now();
        self.client.replace(&mut self.root, at..at + 1, digit);
        times.add(self.client.wait_for_diagnostics(&self.root) - begin);
    }

    /// Runs a script while somebody types; afterwards, somebody goes on typing, and then takes the text of the disk.
    fn work(&mut self, script: &str, during: &mut Times, behind: &mut Times) {
        let (top, script, flood) = (self.top.clone(), script.to_owned(), self.flood);
        let program = std::thread::spawn(move || {
            for line in script.lines().map(str::trim) {
                match line.strip_prefix("flood ") {
                    Some(folder) => pour(&top.join(folder), flood),
                    None => run(&top, line),
                }
            }
        });
        while !program.is_finished() {
            self.edit(during);
            std::thread::sleep(KEY);
        }
        program.join().unwrap();
        self.edit(behind);
        // The client watches too.
        let change =
            |file: usize| json!({"uri": address(&self.top.join(format!("robot/part{file}.mal"))), "type": 2});
        let changes: Vec<Value> = (0..60).map(change).collect();
        self.client.notify("workspace/didChangeWatchedFiles", json!({"changes": changes}));
        // The editor shows the file that has changed.
        if let Ok(text) = fs::read_to_string(self.top.join("robot/root.mal")) {
            let end = self.root.text.len();
            self.client.replace(&mut self.root, 0..end, &text);
        }
    }

    /// Waits until the server says of this disk what a first run does; where the open file is gone or ignored, a first server.
    fn compare(&mut self, what: &str) {
        let root = self.top.join("robot/root.mal");
        let output = mauve(MAUVE, &self.top, &["check", "--format", "json", "."]).out;
        let report: Value = serde_json::from_str(&output).unwrap_or_default();
        let of_root = |all: &Value| -> Vec<Value> {
            let all = all.as_array().into_iter().flatten().filter(|it| it["root"] == json!(root));
            all.map(|it| it["results"].clone()).collect()
        };
        let (mut expected, figures) =
            (places_of_report(&report["diagnostics"]), of_root(&report["deployments"]));
        if figures.is_empty() {
            let mut fresh = Client::of_folder(MAUVE, &self.top);
            fresh.open(&root, &self.root.text);
            fresh.idle();
            expected = places(&fresh);
        }
        let question = json!({"textDocument": {"uri": self.root.uri}});
        let found = wait_for_watcher(PATIENCE, || {
            self.client.idle();
            let seen = places(&self.client);
            let answer = self.client.call("mauve/analysis", question.clone()).unwrap_or_default();
            let difference: Vec<_> = seen.symmetric_difference(&expected).take(5).cloned().collect();
            let is_same = difference.is_empty() && (figures.is_empty() || of_root(&answer) == figures);
            if is_same { Ok(()) } else { Err((difference, of_root(&answer))) }
        });
        found.unwrap_or_else(|found| panic!("after {what}: {found:#?}, and a first run says {figures:#?}"));
    }
}

/// A diagnostic: the file, the line and the column from 1, the code and the message.
type Place = (String, u64, u64, String, String);

/// What is published of files.
fn places(client: &Client) -> BTreeSet<Place> {
    let published = client.published();
    let all =
        published.iter().flat_map(|(uri, all)| all.as_array().into_iter().flatten().map(move |it| (uri, it)));
    let number = |it: &Value| it.as_u64().unwrap_or_default() + 1;
    let place = |(uri, it): (&String, &Value)| {
        let start = &it["range"]["start"];
        let (line, column) = (number(&start["line"]), number(&start["character"]));
        (uri.clone(), line, column, it["code"].to_string(), it["message"].to_string())
    };
    all.filter(|(uri, _)| uri.starts_with("file:")).map(place).collect()
}

/// What `mauve check` reports, apart from hints.
fn places_of_report(report: &Value) -> BTreeSet<Place> {
    let all = report.as_array().into_iter().flatten().filter(|it| it["severity"] != "hint");
    let number = |it: &Value| it.as_u64().unwrap_or_default();
    let place = |it: &Value| {
        let (uri, start) =
            (address(Path::new(it["file"].as_str().unwrap_or_default())), &it["range"]["start"]);
        (
            uri,
            number(&start["line"]),
            number(&start["column"]),
            it["code"].to_string(),
            it["message"].to_string(),
        )
    };
    all.map(place).collect()
}

/// Runs a script of the shell, with git as for a new user.
fn run(folder: &Path, script: &str) {
    let status = Command::new("sh")
        .args(["-ec", script])
        .current_dir(folder)
        .envs([("GIT_CONFIG_GLOBAL", "/dev/null"), ("GIT_EDITOR", "true"), ("HOME", "/nonexistent")])
        .envs([("GIT_AUTHOR_NAME", "a"), ("GIT_AUTHOR_EMAIL", "a@b"), ("GIT_COMMITTER_NAME", "a")])
        .envs([("GIT_COMMITTER_EMAIL", "a@b"), ("GIT_CONFIG_NOSYSTEM", "1")])
        .output()
        .unwrap();
    assert!(status.status.success(), "{script}: {}", String::from_utf8_lossy(&status.stderr));
}

/// Writes so many files in nested folders, and some links.
fn pour(folder: &Path, files: usize) {
    for file in 0..files {
        let inner = folder.join(format!("p{}/lib/q{}/src", file / 50, file / 5 % 10));
        if file % 5 == 0 {
            fs::create_dir_all(&inner).unwrap();
            let _ = std::os::unix::fs::symlink("..", inner.join("up"));
        }
        fs::write(inner.join(format!("f{file}.{}", if file % 100 == 7 { "mal" } else { "js" })), "\n")
            .unwrap();
    }
}

/// Everything as in the beginning.
const RESET: &str = "rm -rf robot/.git; git rebase --abort; git merge --abort; git stash clear; git checkout -qf main; \
                     git reset -q --hard base; git clean -qffdx; git worktree prune";

/// One of the tests that share the habits.
fn share(of: usize, number: usize) {
    let rounds: usize = std::env::var("MAUVE_HABITS").map_or(0, |rounds| rounds.parse().unwrap());
    let mut desk = Desk::new(&number.to_string(), if rounds > 0 { 10_000 } else { 300 });
    if rounds > 0 {
        println!("{}", Times::HEAD);
    }
    for (name, scripts) in HABITS.iter().skip(number).step_by(of) {
        let (mut during, mut behind) = (Times::default(), Times::default());
        for round in 0..rounds.max(1) {
            for script in *scripts {
                desk.work(script, &mut during, &mut behind);
                if round == 0 {
                    desk.compare(&format!("{name}: {script}"));
                }
                desk.client.forget();
            }
            run(&desk.top, &RESET.replace(';', " || true;"));
        }
        if rounds > 0 {
            println!("{}\n{}", during.row(name), behind.row(&format!("{name}: the edit behind it")));
        }
    }
    desk.compare("all");
    assert_eq!(desk.client.shut_down(), Some(0));
    fs::remove_dir_all(desk.top).unwrap();
}

#[test]
fn habits_of_other_programs() {
    share(3, 0);
}

#[test]
fn the_second_third_of_the_habits_of_other_programs() {
    share(3, 1);
}

#[test]
fn the_last_third_of_the_habits_of_other_programs() {
    share(3, 2);
}
