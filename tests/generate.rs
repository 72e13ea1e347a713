//! `mauve generate` on real folders: it writes only changed files, keeps the user's files, and after an error leaves
//! all files unchanged.

use std::collections::BTreeMap;
use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mauve_tests::{Run, copy, mauve, models, scratch, write};
use serde_json::{Value, json};

use crate::MAUVE;

const CONFIG: &str = "assume.codel = \"1 ms\"\nplatform.rt_throttling = false\n[generate]\nout = \"out\"\n";

const MODEL: &str = "library maths {
  codel half(in x: double): double
  codel limit(in x: double, in most: double): double
}
library motion {
  use maths
  codel clearance(in width: double): double
  shell S { property gain: double = 0.5  output port speed: double }
  core C(S) {
    var v: double = 0.0
    update = { v = clearance(gain); v = half(v); write(speed, v); }
  }
  component Guide(S, C)
}
library robot {
  architecture A { instance guide: motion.Guide }
  deployment D { architecture A  activity guide { priority = 1 period = 100 } }
}
";

const CODEL: &str = "out/motion/src/codels/clearance.cpp";
const STUB: &str = "out/motion/src/codels/clearance.cpp.new";
const HEADER: &str = "out/motion/include/motion/motion-codels.hpp";

/// A file or a folder: its text, the file it is, the time of its last change, its mode.
type Entry = (String, u64, (i64, i64), u32);

/// A folder with a model.
struct Project(PathBuf);

impl Project {
    fn new(name: &str) -> Project {
        Project::of(name, &[("robot.mal", MODEL), ("mauve.toml", CONFIG)])
    }

    fn of(name: &str, files: &[(&str, &str)]) -> Project {
        let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("generate_{name}"));
        write(&folder, files);
        Project(folder)
    }

    /// One that has been generated.
    fn generated(name: &str) -> Project {
        let it = Project::new(name);
        it.expect(0, &[]);
        it
    }

    fn run(&self, arguments: &[&str]) -> Run {
        let all: Vec<&str> = ["generate"].iter().chain(arguments).copied().collect();
        mauve(MAUVE, &self.0, &all)
    }

    /// Runs a command, and returns its standard output and standard error.
    fn expect(&self, code: i32, arguments: &[&str]) -> String {
        let run = self.run(arguments);
        assert_eq!(run.code, code, "{arguments:?}: {}{}", run.out, run.err);
        run.out + &run.err
    }

    fn json(&self, code: i32, arguments: &[&str]) -> Value {
        let arguments: Vec<&str> = arguments.iter().chain(&["--format", "json"]).copied().collect();
        serde_json::from_str(&self.expect(code, &arguments)).unwrap()
    }

    fn text(&self, path: &str) -> String {
        fs::read_to_string(self.0.join(path)).unwrap()
    }

    fn put(&self, path: &str, text: &str) {
        write(&self.0, &[(path, text)]);
    }

    fn change(&self, path: &str, from: &str, to: &str) {
        let text = self.text(path);
        assert!(text.contains(from), "{from:?} in {text}");
        self.put(path, &text.replace(from, to));
    }

    fn everything(&self) -> BTreeMap<PathBuf, Entry> {
        everything(&self.0)
    }

    /// The texts of the generated files.
    fn texts(&self, out: &str) -> BTreeMap<PathBuf, String> {
        let out = self.0.join(out);
        let all = everything(&out).into_iter();
        all.map(|(path, (text, ..))| (path.strip_prefix(&out).unwrap().to_owned(), text)).collect()
    }
}

/// Returns the contents of a folder. A folder itself has no entry.
fn everything(folder: &Path) -> BTreeMap<PathBuf, Entry> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let data = path.symlink_metadata().unwrap();
            let bytes = if path.is_file() { fs::read(&path).unwrap_or_default() } else { Vec::new() };
            let text = String::from_utf8_lossy(&bytes).into_owned();
            let time = if data.is_dir() { (0, 0) } else { (data.mtime(), data.mtime_nsec()) };
            open.extend(Some(&path).filter(|_| data.is_dir()).cloned());
            found.insert(path, (text, data.ino(), time, data.mode()));
        }
    }
    found
}

#[test]
fn the_second_time_nothing_changes_and_no_time_stamp_moves() {
    let robot = Project::of("twice", &[]);
    copy(&models().join("p3dx"), &robot.0.join("p3dx"));
    let first = robot.expect(0, &["p3dx", "--out", "out"]);
    assert!(first.starts_with("created       out/kinematics (") && first.contains(" created\n"), "{first}");
    let before = robot.everything();
    assert!(before.keys().any(|path| path.ends_with("out/navigation/src/codels/astar.cpp")));
    let second = "6 packages in out: nothing changed\n";
    assert_eq!(robot.expect(0, &["p3dx", "--out", "out"]), second);
    assert_eq!(robot.expect(0, &["p3dx/mauve.toml", "--out", "./out/", "--force"]), second);
    assert_eq!(
        robot.expect(0, &["p3dx", "--out", "out", "--check"]),
        "6 packages in out: nothing to be changed\n"
    );
    assert_eq!(robot.everything(), before);
    // Elsewhere the same comes out.
    robot.expect(0, &["p3dx", "--out", "a/b/../c"]);
    assert_eq!(robot.texts("a/c"), robot.texts("out"));
}

#[test]
fn only_the_files_that_change_are_written() {
    let it = Project::generated("only");
    let before = it.everything();
    it.change(
        "robot.mal",
        "codel half(in x: double): double\n",
        "codel half(in x: double): double\n  // New.\n  codel twice(in x: int): int\n",
    );
    let said = it.expect(0, &[]);
    assert!(said.contains("created       out/maths/src/codels/twice.cpp\n"), "{said}");
    assert!(said.contains("changed       out/maths/include/maths/maths-codels.hpp\n"), "{said}");
    let after = it.everything();
    let moved: Vec<&PathBuf> = before.keys().filter(|path| before.get(*path) != after.get(*path)).collect();
    for path in &moved {
        let name = path.strip_prefix(&it.0).unwrap().display().to_string();
        assert!(name == "robot.mal" || said.contains(&format!("changed       {name}\n")), "{name}: {said}");
    }
    assert_eq!(said.matches("changed   ").count(), moved.len() - 1, "{said}");
    // Modes stay.
    fs::set_permissions(it.0.join("out/maths/include/maths/maths-codels.hpp"), Permissions::from_mode(0o600))
        .unwrap();
    it.change("robot.mal", "twice(in x: int)", "twice(in x: long)");
    it.expect(0, &[]);
    let mode = fs::metadata(it.0.join("out/maths/include/maths/maths-codels.hpp")).unwrap().mode();
    assert_eq!(mode & 0o777, 0o600);
}

#[test]
fn a_codel_that_the_user_wrote_stays_whatever_the_model_does() {
    let it = Project::generated("codel");
    let mine = "#include <motion/motion-codels.hpp>\n// Mine: \u{e9}.\nnamespace motion {\ndouble clearance(double width) { return width; }\n}\n";
    it.put(CODEL, mine);
    assert_eq!(it.expect(0, &["--check"]), "3 packages in out: nothing to be changed\n");
    // Its prototype changes.
    it.change("robot.mal", "clearance(in width: double)", "clearance(in width: double, in n: int)");
    it.change("robot.mal", "clearance(gain)", "clearance(gain, 2)");
    let diff = "--- out/motion/src/codels/clearance.cpp\n+++ out/motion/src/codels/clearance.cpp.new\n@@ -1 +1 @@\n\
                -double clearance(double width)\n+double clearance(double width, int n)\n";
    let before = it.everything();
    let said = it.expect(1, &["--check"]);
    assert!(
        said.contains(diff) && said.contains("to be created out/motion/src/codels/clearance.cpp.new\n"),
        "{said}"
    );
    assert!(said.ends_with("; the prototype of 1 codel has changed\n"), "{said}");
    assert_eq!(it.everything(), before, "--check writes nothing");
    let document = it.json(1, &["--check"]);
    let expected = json!([{
        "file": "motion/src/codels/clearance.cpp",
        "before": "double clearance(double width)",
        "now": "double clearance(double width, int n)",
    }]);
    assert_eq!((&document["folders"][0]["changed_codels"], &document["written"]), (&expected, &false.into()));
    let said = it.expect(0, &[]);
    assert!(
        said.contains(diff) && said.contains("created       out/motion/src/codels/clearance.cpp.new\n"),
        "{said}"
    );
    assert!(it.text(STUB).contains("double clearance(double width, int n) {"));
    assert!(it.text(HEADER).contains("double clearance(double width, int n);"));
    assert_eq!(it.text(CODEL), mine);
    // Nobody has done anything yet.
    let said = it.expect(0, &["--force"]);
    assert_eq!(
        said,
        format!("{diff}\n3 packages in out: nothing changed; the prototype of 1 codel has changed\n")
    );
    assert_eq!(
        it.expect(1, &["--check"]),
        format!("{diff}\n3 packages in out: nothing to be changed; the prototype of 1 codel has changed\n")
    );
    // The user writes it, in his own words.
    let mine = mine.replace("double width)", "const double w,\n  int /* how many */)");
    it.put(CODEL, &mine);
    let said = it.expect(0, &[]);
    assert!(said.contains("removed       out/motion/src/codels/clearance.cpp.new\n"), "{said}");
    assert_eq!((it.text(CODEL), it.0.join(STUB).exists()), (mine.clone(), false));
    assert_eq!(it.expect(0, &["--check"]), "3 packages in out: nothing to be changed\n");
    // Or he knows better.
    it.change("robot.mal", "in n: int", "in n: double");
    it.expect(0, &[]);
    fs::remove_file(it.0.join(STUB)).unwrap();
    assert!(it.expect(0, &[]).contains("changed       out/motion/.mauve-manifest.json\n"));
    assert_eq!((it.text(CODEL), it.0.join(STUB).exists()), (mine.clone(), false));
    it.expect(0, &["--check"]);
    // It leaves the model, and its package too; the user removes those.
    it.put("robot.mal", "library maths { codel limit(in x: double, in most: double): double }\n");
    let said = it.expect(0, &[]);
    assert!(
        said.contains(
            "out/maths/src/codels/half.cpp: the model no longer has this codel; your file is \
        kept\n"
        ),
        "{said}"
    );
    assert!(
        said.contains(
            "out/motion: this package is no longer generated from these models; remove it if you do \
            not need it\n"
        ),
        "{said}"
    );
    assert_eq!(it.text(CODEL), mine);
    assert!(it.0.join("out/maths/src/codels/half.cpp").exists());
    assert_eq!(it.json(0, &[])["folders"][0]["left_packages"], json!(["motion", "robot"]));
}

/// Errors that only a compiler or only the linker would find.
#[test]
fn what_a_codels_file_defines_is_compared_with_the_model() {
    let it = Project::generated("defines");
    it.change(
        "robot.mal",
        "codel limit(in x: double, in most: double)",
        "codel limit(in x: double, in y: double)",
    );
    it.expect(0, &["--force"]);
    const LIMIT: &str = "out/maths/src/codels/limit.cpp";
    it.put(LIMIT, "double limit(double x, double y) { return x; }\n");
    it.expect(0, &[]);
    assert_eq!(it.expect(0, &["--check"]), "3 packages in out: nothing to be changed\n");
    // Two parameters of one type change places, in the model.
    it.change("robot.mal", "in x: double, in y: double", "in y: double, in x: double");
    let said = it.expect(0, &[]);
    assert!(
        said.contains("-double limit(double x, double y)\n+double limit(double y, double x)\n"),
        "{said}"
    );
    it.put(LIMIT, "double limit(double y, double x) { return x; }\n");
    it.expect(0, &[]);
    it.expect(0, &["--check"]);
    // Somebody's own words, which would not link.
    it.put(LIMIT, "double limit(const double& y, double x) { return x; }\n");
    let said = it.expect(1, &["--check"]);
    assert!(
        said.contains("-double limit(const double& y, double x)\n+double limit(double y, double x)\n"),
        "{said}"
    );
}

#[test]
fn a_generated_file_that_was_edited_is_overwritten_by_force_alone() {
    let it = Project::generated("edited");
    let fresh = it.texts("out");
    it.put(HEADER, &(it.text(HEADER) + "// Where does it fail?\n"));
    it.change("robot.mal", "codel half", "codel halved(in x: double): double\n  codel half");
    let before = it.everything();
    for arguments in [&[][..], &["--check"]] {
        let said = it.expect(1, arguments);
        assert!(said.contains("edited        out/motion/include/motion/motion-codels.hpp\n"), "{said}");
        assert!(
            said.contains(": 1 generated file was edited, or was not written by the generator, so nothing w"),
            "{said}"
        );
        let document = it.json(1, arguments);
        assert_eq!(document["folders"][0]["edited"], json!(["motion/include/motion/motion-codels.hpp"]));
        assert_eq!(document["written"], false);
        assert_eq!(it.everything(), before);
    }
    assert!(
        it.expect(0, &["--force"]).contains("changed       out/motion/include/motion/motion-codels.hpp\n")
    );
    it.change("robot.mal", "codel halved(in x: double): double\n  codel half", "codel half");
    it.expect(0, &[]);
    fs::remove_file(it.0.join("out/maths/src/codels/halved.cpp")).unwrap();
    assert_eq!(it.texts("out"), fresh);
    assert_eq!(it.run(&["--check", "--force"]).code, 2, "they contradict each other");
}

#[test]
fn files_that_no_manifest_knows() {
    let it = Project::generated("manifest");
    it.put(CODEL, "DEFINE_CLEARANCE\n");
    let before = it.everything();
    // It was lost: nothing else was.
    let manifest = "out/motion/.mauve-manifest.json";
    let known = it.text(manifest);
    fs::remove_file(it.0.join(manifest)).unwrap();
    let said = it.expect(0, &[]);
    assert!(said.contains("@@ -0,0 +1 @@\n+double clearance(double width)\n"), "{said}");
    fs::remove_file(it.0.join(STUB)).unwrap();
    it.expect(0, &[]);
    // But for what the user has said of that file.
    assert!(it.text(manifest).contains("\"is_right\": true"));
    let said = |text: &str| -> Vec<String> {
        let lines = text.lines().filter(|it| !it.contains("\"is_right\"") && !it.contains("\"stub\""));
        lines.map(|it| it.trim_end_matches(',').to_owned()).collect()
    };
    assert_eq!(said(&it.text(manifest)), said(&known));
    it.put(manifest, &known);
    let texts = |all: &BTreeMap<PathBuf, Entry>| -> Vec<_> {
        all.iter().map(|(path, it)| (path.clone(), it.0.clone())).collect()
    };
    assert_eq!(texts(&it.everything()), texts(&before));
    // Two people have changed it, or it came from elsewhere.
    for (text, why) in [
        ("<<<<<<< HEAD\n", "is invalid: expected value at line 1"),
        (
            "{\"format\":1,\"files\":{\"../../robot.mal\":\"0\"},\"codels\":{}}",
            "\"../../robot.mal\" is not a path in the package",
        ),
        ("{\"format\":9}", "its format is 9, and this version of mauve reads format 1"),
        (
            "{\"format\":1,\"files\":{\"mine.txt\":\"0\"},\"codels\":{}}",
            "\"mine.txt\" is not a file that the generator writes",
        ),
    ] {
        it.put(manifest, text);
        let before = it.everything();
        let said = it.expect(2, &[]);
        assert!(
            said.starts_with("mauve: the manifest `motion/.mauve-manifest.json` is invalid: ")
                && said.contains(why),
            "{said}"
        );
        assert_eq!(it.everything(), before);
    }
    // A file of the user has the path of a generated file.
    it.put(manifest, &known);
    it.put("out/motion/mine.txt", "mine\n");
    it.put("here/motion/CMakeLists.txt", "mine\n");
    let said = it.expect(1, &["--out", "here"]);
    assert!(said.contains("edited        here/motion/CMakeLists.txt\n"), "{said}");
    assert_eq!(it.texts("here").len(), 2, "the file and its folder");
    it.expect(0, &[]);
    assert_eq!(it.text("out/motion/mine.txt"), "mine\n");
}

/// A folder of packages may come from a stranger, whose manifest knows the hash of any file.
#[test]
fn a_manifest_from_elsewhere_takes_nothing_of_the_users() {
    let it = Project::generated("forged");
    let manifest = "out/motion/.mauve-manifest.json";
    let mine = "out/motion/launch/mine.launch";
    let hash = "fcbc800db3f1867000b852f1ce0044b8f1584f76ade1ed6e65189824f95c3cda";
    let cases: [(&str, &[&str]); 4] = [(hash, &[]), ("0", &[]), (hash, &["--force"]), ("0", &["--force"])];
    for (known, arguments) in cases {
        it.put(mine, "mine\n");
        let listed = format!("\"files\": {{\n    \"launch/mine.launch\": {known:?},");
        it.change(manifest, "\"files\": {", &listed);
        let document = it.json(1, &["--check"]);
        let folder = &document["folders"][0];
        assert_eq!(folder["left_files"], json!(["motion/launch/mine.launch"]));
        assert_eq!((&folder["edited"], &folder["removed"]), (&json!([]), &json!([])));
        let said = it.expect(0, arguments);
        assert!(
            said.contains(
                "out/motion/launch/mine.launch: the manifest lists this file, and it is no longer \
                generated"
            ),
            "{said}"
        );
        assert_eq!(it.text(mine), "mine\n");
        assert_eq!(it.expect(0, &[]), "3 packages in out: nothing changed\n", "it is said once");
    }
    // A generated file that was edited is not overwritten without `--force` either.
    let path = "out/motion/CMakeLists.txt";
    let (made, text) = (it.text(path), it.text(manifest));
    let known = text.split("\"CMakeLists.txt\": \"").nth(1).unwrap().split('"').next().unwrap();
    it.put(path, "mine\n");
    it.put(manifest, &text.replace(known, hash));
    assert!(it.expect(1, &[]).contains("edited        out/motion/CMakeLists.txt\n"));
    it.expect(0, &["--force"]);
    assert_eq!(it.text(path), made);
}

#[test]
fn a_checkout_with_other_line_ends_is_no_edit() {
    let it = Project::generated("crlf");
    for (path, (text, _, _, mode)) in it.everything() {
        if path.starts_with(it.0.join("out")) && mode & 0o170000 == 0o100000 {
            fs::write(path, text.replace('\n', "\r\n")).unwrap();
        }
    }
    let before = it.everything();
    assert_eq!(it.expect(0, &[]), "3 packages in out: nothing changed\n");
    assert_eq!(it.everything(), before);
    it.change("robot.mal", "codel limit", "codel more(in x: double): double\n  codel limit");
    it.expect(0, &[]);
}

#[test]
fn a_model_with_errors_generates_nothing() {
    let it = Project::new("errors");
    it.change("robot.mal", "clearance(gain)", "clearence(gain)");
    it.change("robot.mal", "speed: double", "speed: Speed");
    let before = it.everything();
    for arguments in [&[][..], &["--check"], &["--force"]] {
        let said = it.expect(1, arguments);
        for part in [
            "error[unresolved-codel]: no codel or operation `clearence`; did you mean `clearance`?\n",
            "--> robot.mal:11:",
            "v = clearence(gain); v = half(v);",
            "fix 1 error first: nothing was generated\n",
        ] {
            assert!(said.contains(part), "{part} in {said}");
        }
    }
    let document = it.json(1, &[]);
    let problem = document["problems"].as_array().unwrap().iter();
    let problem = problem.clone().find(|it| it["message"].as_str().unwrap().contains("clearence")).unwrap();
    assert_eq!((&problem["range"]["start"]["line"], &document["folders"]), (&11.into(), &json!([])));
    assert_eq!(it.everything(), before);
    // An error without a code is shown in the same way.
    it.change("robot.mal", "clearence(gain)", "clearance(gain)");
    let said = it.expect(1, &[]);
    assert!(
        said.contains("error: ") && said.contains("robot.mal:8:") && said.contains("fix 1 error first"),
        "{said}"
    );
    assert!(it.expect(2, &["nowhere.mal"]).contains("nowhere.mal"));
}

#[test]
fn a_root_that_does_not_exist_is_an_error() {
    let it = Project::new("no_root");
    it.change("mauve.toml", "assume", "project.root = \"robt.mal\"\nassume");
    for arguments in [&[][..], &["--check"], &["--standalone"]] {
        let said = it.expect(1, arguments);
        assert!(said.contains("robt.mal") && said.contains("fix 1 error first"), "{said}");
    }
    for command in ["psm", "graph", "run"] {
        let found = mauve(MAUVE, &it.0, &[command]);
        assert!(found.code == 2 && found.err.contains("the project has 1 error"), "{command}: {}", found.err);
    }
}

#[test]
fn late_robots_are_generated_with_a_warning() {
    let it = Project::new("late");
    it.change("mauve.toml", "1 ms", "60 ms");
    let run = it.run(&[]);
    assert_eq!(run.code, 0, "{}", run.err);
    assert_eq!(run.err, "mauve: warning: the deadline of robot.D is not proved (`mauve wcrt` shows why)\n");
    it.change("mauve.toml", "assume.codel = \"60 ms\"\n", "");
    let run = it.run(&["--check", "--format", "json"]);
    assert!(run.code == 1 && run.err.contains("not proved"), "{}{}", run.out, run.err);
    // The exported analyses are others, and nothing else is.
    let stale = serde_json::from_str::<Value>(&run.out).unwrap();
    let stale = stale["folders"][0]["changed"].as_array().unwrap().clone();
    assert!(stale.iter().all(|path| path.as_str().unwrap().ends_with(".json")), "{stale:?}");
    assert_eq!(it.run(&[]).code, 0);
    let run = it.run(&["--check", "--format", "json"]);
    assert!(run.code == 0 && run.err.contains("not proved"), "{}{}", run.out, run.err);
    assert!(serde_json::from_str::<Value>(&run.out).is_ok());
}

#[test]
fn the_packages_of_one_deployment() {
    let it = Project::new("deployment");
    it.change("robot.mal", "library robot {", "library other { codel f(): int }\nlibrary robot {");
    let document = it.json(0, &["--deployment", "D"]);
    assert_eq!(document["folders"][0]["packages"], json!(["maths", "motion", "robot"]));
    assert!(!it.0.join("out/other").exists());
    let all = it.json(0, &[]);
    assert_eq!(all["folders"][0]["packages"].as_array().unwrap().len(), 4);
    let again = it.json(0, &["robot.mal", "--deployment", "robot.D"]);
    assert_eq!(
        (&again["folders"][0]["created"], &again["folders"][0]["left_packages"]),
        (&json!([]), &json!([]))
    );
    assert_eq!(it.expect(2, &["--deployment", "E"]), "mauve: no deployment `E`: there is robot.D\n");
}

#[test]
fn packages_of_several_projects() {
    let shared = "library maths { codel half(in x: double): double }\n";
    let root = |name: &str, more: &str| {
        format!("include \"maths.mal\"\nlibrary {name} {{ codel go(): int }}\n{more}")
    };
    let (a, b) = (root("a", ""), root("b", ""));
    let it = Project::of("several", &[("maths.mal", shared), ("a.mal", &a), ("b.mal", &b)]);
    assert!(it.expect(2, &[]).starts_with("mauve: no output folder: use `--out DIR`, or"));
    assert_eq!(it.json(0, &["--out", "out"])["folders"][0]["packages"], json!(["a", "maths", "b"]));
    assert!(it.expect(0, &["--out", "out"]).ends_with("3 packages in out: nothing changed\n"));
    // One of them adds to what both have.
    let before = it.texts("out");
    it.put("b.mal", &root("b", "library maths { codel twice(in x: double): double }\n"));
    let said = it.expect(2, &["--out", "out"]);
    for part in
        ["package `maths` differs between the projects of `", "/a.mal` and `", "/b.mal`", "[project] root"]
    {
        assert!(said.contains(part), "{part} in {said}");
    }
    assert_eq!(it.texts("out"), before);
    it.expect(0, &["a.mal", "--out", "out_a"]);
    it.expect(0, &["b.mal", "--out", "out_b"]);
    // Several configurations, each with a folder of its own.
    let it = Project::of(
        "workspaces",
        &[("a/a.mal", shared), ("a/mauve.toml", CONFIG), ("b/b.mal", shared), ("b/mauve.toml", CONFIG)],
    );
    it.expect(0, &[]);
    assert_eq!(it.texts("a/out").len(), it.texts("b/out").len());
    assert_eq!(
        it.expect(0, &[]),
        "1 package in a/out: nothing changed\n1 package in b/out: nothing changed\n"
    );
}

#[test]
fn mauve_toml_does_not_choose_a_folder_elsewhere() {
    let it = Project::new("configured");
    fs::create_dir(it.0.join("elsewhere")).unwrap();
    write(&it.0, &[("robot/robot.mal", MODEL)]);
    symlink("../elsewhere", it.0.join("robot/link")).unwrap();
    fs::remove_file(it.0.join("robot.mal")).unwrap();
    fs::remove_file(it.0.join("mauve.toml")).unwrap();
    let absolute = it.0.join("elsewhere").display().to_string();
    for out in ["../elsewhere", "link", "link/deeper", "", &absolute, "a/../../elsewhere"] {
        it.put("robot/mauve.toml", &CONFIG.replace("\"out\"", &format!("{out:?}")));
        let before = it.everything();
        let said = it.expect(2, &["robot"]);
        assert!(said.contains("which is outside its folder") && said.contains("use `--out "), "{said}");
        assert_eq!(it.everything(), before);
    }
    assert_eq!(it.json(0, &["robot", "--out", "elsewhere"])["written"], true);
    // `out` may not be a hidden folder either: tools execute files there.
    fs::create_dir_all(it.0.join("robot/.git/hooks")).unwrap();
    symlink(".git", it.0.join("robot/seen")).unwrap();
    for out in [".git/hooks", ".github", "a/.b/c", "seen", "seen/hooks"] {
        it.put("robot/mauve.toml", &CONFIG.replace("\"out\"", &format!("{out:?}")));
        let before = it.everything();
        let said = it.expect(2, &["robot"]);
        assert!(said.contains("which is in a hidden folder: name another folder, or use `--out`"), "{said}");
        assert_eq!(it.everything(), before);
    }
    it.expect(0, &["robot", "--out", ".hidden"]);
    for out in ["generated/deep", ".", "a/../b"] {
        it.put("robot/mauve.toml", &CONFIG.replace("\"out\"", &format!("{out:?}")));
        it.expect(0, &["robot"]);
        assert!(it.0.join("robot").join(out.replace("a/../", "")).join("motion/package.xml").is_file());
    }
}

#[test]
fn what_stands_in_the_way() {
    let it = Project::generated("in_the_way");
    let at = |path: &str| it.0.join(path);
    // So that there is something to write everywhere.
    it.change("robot.mal", "clearance(in width: double)", "clearance(in wide: double, in more: double)");
    it.change("robot.mal", "clearance(gain)", "clearance(gain, gain)");
    fs::rename(at(CODEL), at("mine.cpp")).unwrap();
    let cases: [(&str, &dyn Fn(), &str); 7] = [
        ("out", &|| it.put("out", "file"), "out` is not a folder"),
        ("out/motion", &|| it.put("out/motion", "file"), "out/motion` is not a folder"),
        ("out/motion/src", &|| it.put("out/motion/src", "file"), "out/motion/src` is not a folder"),
        (HEADER, &|| fs::create_dir(at(HEADER)).unwrap(), "motion-codels.hpp` is a folder"),
        (HEADER, &|| symlink("/nowhere", at(HEADER)).unwrap(), "is a link that leads nowhere"),
        (
            HEADER,
            &|| assert!(Command::new("mkfifo").arg(at(HEADER)).status().unwrap().success()),
            "is neither a regular file nor a folder",
        ),
        (
            "out/motion/.mauve-manifest.json",
            &|| fs::create_dir(at("out/motion/.mauve-manifest.json")).unwrap(),
            "is a folder",
        ),
    ];
    for (path, prepare, message) in cases {
        fs::rename(at(path), at("aside")).unwrap();
        prepare();
        let before = it.everything();
        for arguments in [&[][..], &["--force"]] {
            let said = it.expect(2, arguments);
            assert!(said.contains(message), "{message} in {said}");
            assert_eq!(it.everything(), before, "{message}");
        }
        if at(path).is_dir() && !at(path).is_symlink() {
            fs::remove_dir(at(path)).unwrap()
        } else {
            fs::remove_file(at(path)).unwrap()
        }
        fs::rename(at("aside"), at(path)).unwrap();
    }
    it.expect(0, &[]);
}

#[test]
fn a_stub_that_nobody_edited_follows_the_model() {
    let it = Project::generated("follows");
    it.change("robot.mal", "clearance(in width: double)", "clearance(in wide: double, in more: double)");
    it.change("robot.mal", "clearance(gain)", "clearance(gain, gain)");
    it.expect(0, &[]);
    assert!(!it.0.join(STUB).exists());
    assert!(it.text(CODEL).contains("double wide, double more"), "{}", it.text(CODEL));
    it.expect(0, &["--check"]);
}

#[test]
fn links_lead_nobody_out_of_the_folder() {
    let it = Project::generated("links");
    it.change("robot.mal", "clearance(in width: double)", "clearance(in wide: double, in more: double)");
    it.change("robot.mal", "clearance(gain)", "clearance(gain, gain)");
    for path in ["out/motion", "out/motion/src", "out/motion/src/codels", "out/motion/include/motion", HEADER]
    {
        fs::rename(it.0.join(path), it.0.join("elsewhere")).unwrap();
        symlink(it.0.join("elsewhere"), it.0.join(path)).unwrap();
        let before = it.everything();
        for arguments in [&[][..], &["--force"]] {
            let said = it.expect(2, arguments);
            assert!(
                said.contains("is a link that leads out of")
                    && said.contains(
                        "and is not read: replace it by \
                    a file"
                    ),
                "{said}"
            );
            assert_eq!(it.everything(), before);
        }
        it.expect(2, &["--check"]);
        fs::remove_file(it.0.join(path)).unwrap();
        fs::rename(it.0.join("elsewhere"), it.0.join(path)).unwrap();
    }
    // Nor does it show a text from there.
    fs::rename(it.0.join(CODEL), it.0.join("mine.cpp")).unwrap();
    symlink("../../../../mine.cpp", it.0.join(CODEL)).unwrap();
    let before = it.everything();
    let said = it.expect(2, &[]);
    assert!(
        said.contains("clearance.cpp` is a link that leads out of") && !said.contains("double"),
        "{said}"
    );
    assert_eq!(it.everything(), before);
    fs::remove_file(it.0.join(CODEL)).unwrap();
    // A codel elsewhere in the folder is only read; a link to the folder itself is allowed.
    fs::rename(it.0.join("mine.cpp"), it.0.join("out/mine.cpp")).unwrap();
    symlink("../../../mine.cpp", it.0.join(CODEL)).unwrap();
    it.change("out/mine.cpp", "return {};", "return 7;");
    fs::rename(it.0.join("out"), it.0.join("real")).unwrap();
    symlink("real", it.0.join("out")).unwrap();
    it.expect(0, &["--out", "out"]);
    assert!(it.0.join(CODEL).is_symlink() && it.0.join(STUB).is_file());
}

#[test]
fn a_file_that_cannot_be_written_in_full_leaves_everything_as_it_was() {
    let it = Project::generated("full");
    it.change(CODEL, "return {};", "return 7;");
    it.change("robot.mal", "clearance(in width: double)", "clearance(in wide: double, in more: double)");
    it.change("robot.mal", "clearance(gain)", "clearance(gain, gain)");
    let before = it.everything();
    let limited = |blocks: usize, out: &str| {
        // The signal that would kill the process is then an error, as on a full disk.
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" generate --out {out}");
        let mut command = Command::new("sh");
        command.args(["-c", &script, MAUVE]).current_dir(&it.0).stdin(Stdio::null()).output().unwrap()
    };
    for out in ["new/deep", "out"] {
        let mut refused = 0;
        loop {
            let output = limited(refused, out);
            if output.status.success() {
                break;
            }
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(said.contains("too large") && said.ends_with("; nothing was changed\n"), "{said}");
            assert_eq!(it.everything(), before);
            refused += 1;
        }
        assert!(refused > 1, "{out}");
        let _ = fs::remove_dir_all(it.0.join("new"));
    }
    assert!(it.0.join(STUB).exists());
}

/// Runs a script, whose `$0` is the binary, where it may mount file systems, and returns what it prints.
fn with_mounts(folder: &Path, script: &str) -> String {
    let ways = ["unshare --mount", "unshare --user --map-root-user --mount", "sudo -n unshare --mount"];
    let run = |way: &str, command: &[&str]| {
        let words: Vec<&str> = way.split(' ').chain(command.iter().copied()).collect();
        Command::new(words[0]).args(&words[1..]).current_dir(folder).stdin(Stdio::null()).output()
    };
    let works = |way: &&str| run(way, &["true"]).is_ok_and(|output| output.status.success());
    let way = ways.into_iter().find(works);
    let way = way.unwrap_or_else(|| panic!("nothing can be mounted here: none of {ways:?} works"));
    let output = run(way, &["sh", "-c", script, MAUVE]).unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    said
}

/// The formatted text is longer: there is room for it beside the file, or not even that, before there is room for both.
#[test]
fn a_full_disk_leaves_a_file_with_hard_links_as_it_was() {
    let it = Project::generated("disk-links");
    let instances: String = (1000..4000).map(|at| format!("instance a{at}:C\n")).collect();
    it.put("long.mal", &format!("architecture A {{\n{instances}}}\n"));
    let script = r#"
set -e
only=--options-mode=ignore
mkdir -p disk
mount -t tmpfs -o "size=16m" none disk
cp long.mal disk/a.mal
ln disk/a.mal disk/b.mal
for more in $(seq 0 40); do
  used=$(df --output=used -k disk | tail -1)
  mount $only -o "remount,size=$((used + 4 * more))k" disk
  code=0; "$0" fmt disk/a.mal >/dev/null 2>said || code=$?
  if cmp -s long.mal disk/b.mal; then same=same; else same=changed; fi
  echo "$code $same $(stat -c %h disk/a.mal) $(ls -A disk | tr '\n' ' ')"
  [ $code != 0 ] || break
done
"#;
    let said = with_mounts(&it.0, script);
    let mut results: Vec<&str> = said.lines().collect();
    assert_eq!(results.pop(), Some("0 changed 2 a.mal b.mal "), "{said}");
    assert!(results.len() > 10 && results.iter().all(|it| *it == "2 same 2 a.mal b.mal "), "{said}");
}

/// On a file system of its own, with little room.
#[test]
fn a_full_disk_leaves_everything_as_it_was() {
    let it = Project::generated("disk");
    it.put("old.mal", MODEL);
    it.change("robot.mal", "clearance(in width: double)", "clearance(in wide: double, in more: double)");
    it.change("robot.mal", "clearance(gain)", "clearance(gain, gain)");
    it.change("robot.mal", "component Guide(S, C)", "component Guide(S, C)\n  component Another(S, C)");
    it.change("robot.mal", "codel half(in x: double): double\n", "");
    it.change("robot.mal", "v = half(v);", "v = limit(v, v);");
    // The second time there is room for so many files, or so many pages, more than there are.
    let script = r#"
set -e
# Whose the root is has another number for the user that this may be.
only=--options-mode=ignore
mkdir -p disk
mount -t tmpfs -o "size=16m" none disk
state() { (cd disk && find . -type f -exec stat -c '%n %i %Y %a' {} + | sort && find . -type d | sort && find . -type f -exec sha256sum {} + | sort); }
"$0" generate old.mal --out disk/out >/dev/null
state >before
for more in 0 1 2 3 4 5 6 8 10 12 14 16 18 20 30 1000; do
  for kind in files pages; do
    if [ $kind = files ]; then
      # A tmpfs counts what it has, and the root.
      used=$(df --output=iused disk | tail -1)
      limit="nr_inodes=$((used + more)),size=16m"
    else
      used=$(df --output=used -k disk | tail -1)
      limit="nr_inodes=100000,size=$((used + 4 * more))k"
    fi
    mount $only -o "remount,$limit" disk
    code=0; "$0" generate robot.mal --out disk/out >/dev/null 2>said || code=$?
    state >after
    if cmp -s before after; then same=same; else same=changed; fi
    echo "$more $kind $code $same $(tr '\n' ' ' <said)"
    if [ $code = 0 ]; then
      mount $only -o "remount,nr_inodes=100000,size=16m" disk
      rm -rf disk/out; "$0" generate old.mal --out disk/out >/dev/null; state >before
    fi
  done
done
"#;
    let said = with_mounts(&it.0, script);
    let results: Vec<Vec<&str>> = said.lines().map(|line| line.splitn(5, ' ').collect()).collect();
    for result in &results {
        match result[..4] {
            [_, _, "0", "changed"] => assert_eq!(result[4], "", "{result:?}"),
            [_, _, "2", "same"] => {
                assert!(
                    result[4].contains("No space left") && result[4].contains("nothing was changed"),
                    "{result:?}"
                );
            }
            _ => panic!("{result:?}"),
        }
    }
    for kind in ["files", "pages"] {
        let codes: Vec<&str> = results.iter().filter(|it| it[1] == kind).map(|it| it[2]).collect();
        assert!(codes.first() == Some(&"2") && codes.last() == Some(&"0"), "{said}");
        assert!(codes.iter().filter(|code| **code == "2").count() > 3, "{said}");
    }
}

/// Runs as somebody whom permissions bind, which they do not where root runs the tests.
fn bound(it: &Project, arguments: &[&str]) -> (Option<i32>, String) {
    let id = Command::new("id").arg("-u").output().unwrap();
    let is_root = id.stdout == b"0\n";
    let mut command = if is_root { Command::new("setpriv") } else { Command::new(MAUVE) };
    if is_root {
        command.args(["--bounding-set", "-dac_override,-dac_read_search", "--", MAUVE]);
    }
    let output = command.arg("generate").args(arguments).current_dir(&it.0).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn a_folder_that_may_not_be_written_to_stays_as_it_is() {
    let it = Project::generated("read_only");
    it.change("robot.mal", "codel half(in x: double)", "codel half(in x: double, in y: double)");
    it.change("robot.mal", "half(v)", "half(v, v)");
    it.change("robot.mal", "clearance(in width: double)", "clearance(in wide: double, in more: double)");
    it.change("robot.mal", "clearance(gain)", "clearance(gain, gain)");
    fs::create_dir(it.0.join("closed")).unwrap();
    for (folder, out) in [
        ("out", "out"),
        // The other package is written before.
        ("out/motion", "out"),
        ("out/motion/include/motion", "out"),
        ("out/motion/src/codels", "out"),
        ("closed", "closed/new"),
    ] {
        let closed = it.0.join(folder);
        fs::set_permissions(&closed, Permissions::from_mode(0o555)).unwrap();
        let before = it.everything();
        let (code, said) = bound(&it, &["--out", out]);
        assert_eq!(it.everything(), before, "{folder}");
        fs::set_permissions(&closed, Permissions::from_mode(0o755)).unwrap();
        assert!(code == Some(2) && said.contains("Permission denied"), "{folder}: {code:?} {said}");
    }
    // A file that may not be written, in a folder that may; and one that may not be read.
    for (mode, what) in [(0o444, "cannot write"), (0o000, "cannot be read")] {
        fs::set_permissions(it.0.join(HEADER), Permissions::from_mode(mode)).unwrap();
        let before = it.everything();
        let (code, said) = bound(&it, &[]);
        assert!(
            code == Some(2) && said.contains(what) && said.contains("Permission denied"),
            "{code:?} {said}"
        );
        assert_eq!(it.everything(), before);
    }
    fs::set_permissions(it.0.join(HEADER), Permissions::from_mode(0o644)).unwrap();
    assert_eq!(bound(&it, &[]).0, Some(0));
}

#[test]
fn several_at_once_leave_what_one_of_them_makes() {
    let it = Project::of("at_once", &[("a/robot.mal", MODEL), ("b/robot.mal", MODEL)]);
    it.change("b/robot.mal", "clearance(in width: double)", "clearance(in wide: double, in more: double)");
    it.change("b/robot.mal", "clearance(gain)", "clearance(gain, gain)");
    for model in ["a", "b"] {
        it.expect(0, &[model, "--out", &format!("only_{model}")]);
    }
    for _ in 0..5 {
        let runs = ["a", "b", "a", "b", "a", "b", "a", "b"].map(|model| {
            let mut command = Command::new(MAUVE);
            command.args(["generate", model, "--out", "deep/out"]).current_dir(&it.0);
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
        });
        for run in runs {
            let output = run.wait_with_output().unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        }
        let is_header = |path: &Path| {
            !path.ends_with(".mauve-manifest.json") && !path.display().to_string().contains("src/codels")
        };
        let generated = |out: &str| -> BTreeMap<PathBuf, String> {
            it.texts(out).into_iter().filter(|(path, _)| is_header(path)).collect()
        };
        let found = generated("deep/out");
        assert!(found == generated("only_a") || found == generated("only_b"));
        fs::remove_dir_all(it.0.join("deep")).unwrap();
    }
}

#[test]
fn a_run_that_was_killed_is_mended_by_the_next_one() {
    let it = Project::generated("killed");
    it.change("robot.mal", "clearance(in width: double)", "clearance(in wide: double, in more: double)");
    it.change("robot.mal", "clearance(gain)", "clearance(gain, gain)");
    copy(&it.0.join("out"), &it.0.join("before"));
    it.expect(0, &["--out", "out"]);
    let after = it.texts("out");
    // So far it came, in the order in which files are put in their places: manifests last.
    let steps: Vec<&PathBuf> = after.keys().filter(|path| it.0.join("out").join(path).is_file()).collect();
    for done in 0..steps.len() {
        let out = format!("killed_{done}");
        copy(&it.0.join("before"), &it.0.join(&out));
        let others = steps.iter().filter(|path| !path.ends_with(".mauve-manifest.json"));
        for path in others.take(done) {
            fs::copy(it.0.join("out").join(path), it.0.join(&out).join(path)).unwrap();
        }
        it.put(&format!("{out}/.mauve-staging/0"), "half of it");
        it.expect(0, &["--out", &out]);
        assert_eq!(it.texts(&out), after, "after {done}");
    }
}

#[test]
fn shells_complete_it_and_help_explains_it() {
    let it = Project::new("help");
    let help = mauve(MAUVE, &it.0, &["help", "generate"]).out;
    for part in ["--out <DIR>", "--check", "--force", "--deployment <NAME>", "CODEL.cpp.new", "Exit codes:"] {
        assert!(help.contains(part), "{part} in {help}");
    }
    for shell in ["bash", "zsh", "fish"] {
        let text = mauve(MAUVE, &it.0, &["completions", shell]).out;
        assert!(text.contains("generate") && text.contains("force"), "{shell}");
    }
}
