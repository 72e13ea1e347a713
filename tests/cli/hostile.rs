//! Projects of strangers: each is opened, checked, formatted, generated and served by a user without rights, in 1 GB of
//! address space and 5 s of a processor's time (10 s for a debug build, which needs more than twice as much). No crash,
//! nothing of other files on the screen, nothing written elsewhere, no program of the project started, and the exit codes that are
//! documented. `PATH` begins with an empty folder, and has relative ones.
//!
//! A project is a text in `hostile/`, since no checkout has such files:
//!
//! ```text
//! run check = 1              a command, and its exit code
//! //- a.mal                  a file with the lines that follow; `\u{1b}` is one character
//! //^ cmake                  the same, and it is a program
//! //+ a.mal }                one more line of it
//! //* a.mal 9 shell S{0} { } nine more, `{0}` is the number of each and `{1}` the next; HASH is that of `mine`
//! //x a.mal 9 (              the same text nine times, in one line
//! //0 a.mal 9                nine zeros that take no room
//! //> a.mal /dev/zero        a link; `../user` has files of the user, which he may write
//! //| a.mal                  a pipe
//! //! a                      nobody may look into this folder
//! //~ a                      nor enter this one, whose names may be read
//! ```
//!
//! Projects whose names begin with `run-` are built: their test begins with `orocos_`, since it needs CMake and a compiler.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Write as _;
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::time::Duration;

use mauve_tests::{Client, Run, mauve, scratch, write};
use serde_json::json;

use crate::MAUVE;

/// What stands in files that no project has any business with.
const SECRET: &str = "4d6f1ec2";

/// The hash of a file of the user's, which a forged manifest knows.
const HASH_OF_MINE: &str = "fcbc800db3f1867000b852f1ce0044b8f1584f76ade1ed6e65189824f95c3cda";

struct Project {
    name: String,
    top: PathBuf,
    folder: PathBuf,
    runs: Vec<(String, i32)>,
    /// The first model, which an editor opens.
    model: Option<PathBuf>,
}

impl Project {
    fn new(path: &Path) -> Project {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let top = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("hostile_{name}"));
        let folder = top.join("project");
        let secret = format!("{SECRET} codel {SECRET}(): {SECRET}\n");
        for file in ["secret/s.mal", "secret/s.toml", "secret/s.json", "home/.keep", "project/.git/HEAD"] {
            write(&top, &[(file, secret.as_str())]);
        }
        // The links of a project may lead there.
        let (mine, page) = (format!("mine {SECRET}\n"), format!("<!doctype html>{SECRET}\n"));
        write(&top, &[("user/mine", &mine), ("user/page.html", &page), ("user/empty", "")]);
        let mut project = Project { name, top, folder, runs: Vec::new(), model: None };
        let text = fs::read_to_string(path).unwrap();
        let mut open: Option<PathBuf> = None;
        for line in text.split_inclusive('\n').skip(1) {
            let Some(made) = line
                .strip_prefix("//")
                .filter(|it| it.starts_with(['-', '^', '+', '*', 'x', '0', '>', '|', '!', '~']))
            else {
                match (line.strip_prefix("run "), &open) {
                    (_, Some(path)) => append(path, &unescaped(line)),
                    (Some(run), None) => {
                        let (command, code) = run.trim().rsplit_once(" = ").unwrap();
                        project.runs.push((command.to_owned(), code.parse().unwrap()));
                    }
                    _ => panic!("{}: {line}", project.name),
                }
                continue;
            };
            open = project.make(made.trim_end_matches('\n'));
        }
        project
    }

    /// Makes what a line says; gives the file whose text follows.
    fn make(&mut self, line: &str) -> Option<PathBuf> {
        let (sign, rest) = line.split_at(1);
        let rest = rest.strip_prefix(' ').unwrap();
        let (path, more) = match sign {
            "-" | "^" | "|" | "!" | "~" => (rest, ""),
            _ => rest.split_once(' ').unwrap(),
        };
        let path = self.folder.join(unescaped(path));
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        let count = || -> (usize, &str) {
            let (count, text) = more.split_once(' ').unwrap_or((more, ""));
            (count.parse().unwrap(), text)
        };
        match sign {
            "-" | "^" => {
                append(&path, "");
                if sign == "^" {
                    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
                }
                if path.extension().is_some_and(|it| it == "mal") && self.model.is_none() {
                    self.model = Some(path.clone());
                }
                return Some(path);
            }
            "+" => append(&path, &format!("{more}\n")),
            "*" => {
                let (count, text) = count();
                let line =
                    |it: usize| text.replace("{0}", &it.to_string()).replace("{1}", &(it + 1).to_string());
                append(&path, &(0..count).map(|it| line(it) + "\n").collect::<String>());
            }
            "x" => {
                let (count, text) = count();
                append(&path, &text.repeat(count));
            }
            "0" => fs::File::create(&path).unwrap().set_len(count().0 as u64).unwrap(),
            ">" => symlink(more, &path).unwrap(),
            "|" => assert!(Command::new("mkfifo").arg(&path).status().unwrap().success()),
            "~" => fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).unwrap(),
            _ => fs::set_permissions(&path, fs::Permissions::from_mode(0o000)).unwrap(),
        }
        None
    }

    /// A program that runs `mauve` with the limits, as nobody.
    fn limited(&self) -> PathBuf {
        let script = self.top.join("home/limited");
        let (binary, home) = (MAUVE, self.top.join("home"));
        let (home, seconds) = (home.display(), if cfg!(debug_assertions) { 10 } else { 5 });
        // The launchers of compilers that the tests use keep files of this user. Each arena of glibc's reserves 64 MB of addresses:
        // with one for each thread, they take all the address space of a server that uses 150 MB.
        let text = format!(
            "#!/bin/sh\nulimit -v 1048576\nulimit -t {seconds}\nexport MALLOC_ARENA_MAX=4\nexport HOME='{home}'\n\
             export CMAKE_BUILD_TYPE=None\nunset XDG_CACHE_HOME XDG_CONFIG_HOME XDG_DATA_HOME CMAKE_C_COMPILER_LAUNCHER CMAKE_CXX_COMPILER_LAUNCHER\n\
             set -- env PATH=\":.:bin:./bin:$PATH\" '{binary}' \"$@\"\n\
             [ \"$(id -u)\" != 0 ] || set -- setpriv --reuid 65534 --regid 65534 --clear-groups \"$@\"\nexec \"$@\"\n"
        );
        write(&self.top, &[("home/limited", text.as_str())]);
        fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).unwrap();
        for path in ["project", "home", "user"] {
            let status =
                Command::new("chown").args(["-R", "-h", "65534:65534"]).arg(self.top.join(path)).output();
            assert!(status.is_ok(), "{}: chown", self.name);
        }
        script
    }

    /// Everything that stands outside of the project.
    fn outside(&self) -> BTreeMap<PathBuf, String> {
        let mut found = BTreeMap::new();
        let mut open = vec![self.top.clone()];
        while let Some(folder) = open.pop() {
            for entry in fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap()) {
                let path = entry.path();
                if entry.file_type().unwrap().is_dir() {
                    let is_own = path == self.folder || path == self.top.join("home");
                    open.extend(Some(path).filter(|_| !is_own));
                } else {
                    found.insert(path.clone(), fs::read_to_string(&path).unwrap_or_default());
                }
            }
        }
        found
    }

    /// The files below `out` that the project came with: nothing in them is the generator's.
    fn own(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let out = self.folder.join("out");
        if !out.is_dir() {
            return BTreeMap::new();
        }
        let files =
            mauve_tests::files_in(&out).into_iter().filter(|path| !path.ends_with(".mauve-manifest.json"));
        files.filter(|path| !path.is_symlink()).map(|path| (path.clone(), fs::read(&path).unwrap())).collect()
    }

    /// What is wrong with it, a line each.
    fn problems(&self) -> Vec<String> {
        let mut problems = Vec::new();
        let mut say = |what: String| problems.push(format!("{}: {what}", self.name));
        let (outside, own) = (self.outside(), self.own());
        let limited = self.limited();
        for (command, code) in &self.runs {
            let arguments: Vec<&str> = command.split(' ').collect();
            let run: Run = mauve(limited.to_str().unwrap(), &self.folder, &arguments);
            let end: String = run.err.chars().take(300).collect();
            if run.code != *code {
                say(format!("`{command}` ends with {}, and not with {code}: {end}", run.code));
            }
            for text in [&run.out, &run.err] {
                if text.contains(SECRET) {
                    say(format!("`{command}` shows what stands in another file"));
                }
                let is_obeyed = |c: char| c.is_control() && !matches!(c, '\n' | '\t') || c == '\u{202e}';
                let is_raw = arguments.contains(&"json") || arguments.contains(&"sarif");
                if !is_raw && (text.contains(is_obeyed) || text.contains("##vso[") || text.contains("##[")) {
                    say(format!("`{command}` gives a terminal something to obey"));
                }
            }
        }
        if let Err(why) = self.served(limited.to_str().unwrap()) {
            say(why);
        }
        if self.outside() != outside {
            say("something outside was written".to_owned());
        }
        for (path, text) in own {
            if fs::read(&path).ok().as_ref() != Some(&text) {
                say(format!("{} was the user's", path.display()));
            }
        }
        problems
    }

    /// What an editor does with it.
    fn served(&self, limited: &str) -> Result<(), String> {
        let mut client = Client::of_folder(limited, &self.folder);
        if let Some(text) =
            self.model.as_ref().and_then(|model| Some((model, fs::read_to_string(model).ok()?)))
        {
            let open = client.open(text.0, &text.1);
            client.diagnostics(&open);
            client.hints(&open.uri);
            for method in
                ["textDocument/documentSymbol", "textDocument/semanticTokens/full", "textDocument/codeLens"]
            {
                let _ = client.call(method, json!({"textDocument": {"uri": open.uri}}));
            }
            let position = json!({"line": 1, "character": 8});
            let at = json!({"textDocument": {"uri": open.uri}, "position": position});
            let hover = client.call("textDocument/hover", at);
            if format!("{hover:?}").contains("](https:") {
                return Err("a hover loads a picture".to_owned());
            }
            let _ = client.call("mauve/generate", json!({"textDocument": {"uri": open.uri}}));
        }
        client.idle();
        let said = format!("{:?} {:?}", client.published(), client.take(Duration::ZERO));
        if said.contains(SECRET) {
            return Err("the server shows what stands in another file".to_owned());
        }
        match client.shut_down() {
            Some(0) => Ok(()),
            code => Err(format!("the server ends with {code:?}")),
        }
    }
}

fn append(path: &Path, text: &str) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let mut file = fs::File::options().create(true).append(true).open(path).unwrap();
    file.write_all(text.replace("HASH", HASH_OF_MINE).as_bytes()).unwrap();
}

/// `\u{1b}` is one character.
fn unescaped(text: &str) -> String {
    let mut parts = text.split("\\u{");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (code, rest) = part.split_once('}').unwrap();
        out.push(char::from_u32(u32::from_str_radix(code, 16).unwrap()).unwrap());
        out += rest;
    }
    out
}

/// Names of files, of keys in quotes, and in task sets are shown harmlessly in every drawing, page and table.
#[test]
fn no_drawing_or_table_obeys_a_name() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &mauve_tests::test_name());
    let bad = "n\u{202e}\r\u{1b}[2J\u{200b}";
    let key = "n\\u202e\\r\\u001b[2J\\u200b";
    let model = "codel f(): int\ncodel g(in n: int): void\nshell S { output port p: int }\nshell R { input port q: int }\n\
        core K(S) { update = { write(p, f()); } }\ncore L(R) { var n: int; update = { read(q, n); g(n); } }\n\
        component C(S, K)\ncomponent D(R, L)\narchitecture A { instance a: C instance b: D connection a.p -> b.q }\n\
        deployment D { architecture A activity a { priority = 2 period = 20 cpus = [1] }\n\
        activity b { priority = 1 period = 50 deadline = 30 cpus = [1] } }\n";
    let config = format!(
        "project.root = \"{key}.mal\"\ntiming.tables = [\"t.toml\"]\nplatform.rt_throttling = false\n\
         platform.other = [{{ name = \"n\\u202e\", priority = 9, period = \"10 ms\", time = \"1 ms\", cpus = [1] }}]\n\
         [chains.\"{key}\"]\nfrom = \"a.p\"\nto = \"g\"\nlatency = \"500 ms\"\n[locks.\"{key}\"]\ncodels = [\"f\", \"g\"]\nprotocol = \"inheritance\"\n\
         [deployment.D]\naccept = {{ b = \"{key}\" }}\n[platform.cpu_sets]\n\"{key}\" = [1]\n"
    );
    // A task set has no control characters.
    let (task, of_set) = ("n\\u202e\\u200b", "n\u{202e}\u{200b}");
    let set = format!(
        "{{\"name\": \"{task}\", \"task\": [{{\"name\": \"{task}\", \"component\": \"{task}\", \"period\": 20, \"time\": 5, \"priority\": 3, \"cpus\": [1]}}, \
         {{\"name\": \"b\", \"period\": 50, \"time\": 9, \"priority\": 2, \"cpus\": [1]}}]}}"
    );
    for (place, table) in [("", "codel.f = 5\ncodel.g = 8\n"), ("old", "codel.f = 4\ncodel.g = 8\n")] {
        let place = if place.is_empty() { folder.clone() } else { folder.join(format!("{place}{bad}")) };
        let model = (format!("{bad}.mal"), model.to_owned());
        let others = [("mauve.toml", &*config), ("t.toml", table), ("set.json", &*set)];
        write(&place, &[model]);
        write(&place, &others);
    }
    let (page, model) = (format!("{bad}.html"), format!("{bad}.mal"));
    let old = format!("old{bad}");
    let commands: Vec<Vec<&str>> = vec![
        vec!["check", &model],
        vec!["wcrt", &model],
        vec!["wcrt", &model, "--explain", "b"],
        vec!["wcrt", &model, "--sensitivity"],
        vec!["wcrt", &model, "--probability"],
        vec!["wcrt", &model, "--set", "f=7ms"],
        vec!["chains", &model],
        vec!["chains", &model, "--format", "svg"],
        vec!["chains", &model, "--format", "text"],
        vec!["graph", &model, "--deployment", "D"],
        vec!["graph", &model, "--deployment", "D", "--format", "svg"],
        vec!["graph", &model, "--format", "dot"],
        vec!["graph", &model, "--format", "text"],
        vec!["psm", &model, "C", "--format", "svg"],
        vec!["psm", &model, "C", "--format", "dot"],
        vec!["psm", &model, "C"],
        vec!["simulate", &model],
        vec!["simulate", &model, "--format", "svg"],
        vec!["simulate", &model, "--format", "text"],
        vec!["simulate", &model, "--worst", "b", "--format", "svg"],
        vec!["tune", &model, "--priorities"],
        vec!["diff", &old, "."],
        vec!["diff", &old, ".", "--format", "markdown"],
        vec!["report", &model, "-o", &page],
        vec!["wcrt", "set.json"],
        vec!["wcrt", "set.json", "--explain", of_set],
        vec!["simulate", "set.json"],
        vec!["simulate", "set.json", "--format", "svg"],
        vec!["simulate", "set.json", "--format", "text"],
        vec!["simulate", "set.json", "--worst", of_set, "--format", "svg"],
        vec!["fmt", "--check"],
        vec!["analysis-stats"],
        vec!["check", "--format", "human", bad],
    ];
    let is_obeyed = |letter: char| {
        (letter.is_control() && letter != '\n' && letter != '\t') || "\u{202e}\u{200b}".contains(letter)
    };
    let mut seen = 0;
    for command in &commands {
        let run = mauve(MAUVE, &folder, command);
        assert!(run.code < 2 || command.ends_with(&[bad]), "{command:?}: {run:?}");
        for text in [&run.out, &run.err] {
            assert!(!text.contains(is_obeyed), "{command:?}: {text:?}");
            seen += usize::from(text.contains("\\u{202e}") || text.contains('\u{fffd}'));
        }
    }
    assert!(seen > 10, "{seen}");
    let text = fs::read_to_string(folder.join(&page)).unwrap();
    assert!(!text.contains(is_obeyed) && text.contains('\u{fffd}'));
}

#[test]
fn strangers_projects_are_harmless() {
    all_are_harmless(|name| !name.starts_with("run-"));
}

/// One build for all of them, by a user who may write nothing but his home.
#[test]
fn orocos_strangers_projects_are_built_and_run() {
    all_are_harmless(|name| name.starts_with("run-"));
}

fn all_are_harmless(is_of_test: impl Fn(&str) -> bool) {
    // Only root can become another user. `tests/run` says the same at its end.
    if !rustix::process::geteuid().is_root() {
        eprintln!(
            "NOT RUN as a user without rights, since this is not root: projects of strangers run as this user"
        );
    }
    let only = std::env::var("MAUVE_HOSTILE").ok();
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/hostile"));
    let all: BTreeSet<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    let is_wanted = |path: &&PathBuf| {
        let name = path.file_stem().unwrap().to_str().unwrap();
        is_of_test(name) && only.as_ref().is_none_or(|only| name == only)
    };
    let wanted: Vec<&PathBuf> = all.iter().filter(is_wanted).collect();
    assert!(!wanted.is_empty() || only.is_some());
    let (next, problems) = (Mutex::new(wanted.iter()), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let path = next.lock().unwrap().next();
                    let Some(path) = path else { return };
                    let name = path.display().to_string();
                    let found = std::panic::catch_unwind(|| Project::new(path).problems());
                    problems
                        .lock()
                        .unwrap()
                        .extend(found.unwrap_or_else(|_| vec![format!("{name}: no end")]));
                }
            });
        }
    });
    let problems = problems.into_inner().unwrap();
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}
