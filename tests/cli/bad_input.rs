//! Files that are no models, or hardly: a clear diagnostic at the place, everything else still read, no panic.

use mauve_tests::{Run, mauve, scratch, write};
use serde_json::Value;

use crate::MAUVE;

fn check(name: &str, files: &[(&str, &[u8])]) -> (Run, Vec<(String, u64, String)>) {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
    for (path, bytes) in files {
        write(&folder, &[(*path, "")]);
        std::fs::write(folder.join(path), bytes).unwrap();
    }
    let run = mauve(MAUVE, &folder, &["check", "--format", "json"]);
    assert!(run.code == 0 || run.code == 1, "{name}: {} {}", run.code, run.err);
    let shown = mauve(MAUVE, &folder, &["check"]);
    assert_eq!(shown.code, run.code, "{name}: {}", shown.err);
    let document: Value = serde_json::from_str(&run.out).unwrap();
    let diagnostics = document["diagnostics"].as_array().unwrap();
    let found = diagnostics.iter().filter(|it| it["severity"] != "hint").map(|it| {
        let line = it["range"]["start"]["line"].as_u64().unwrap();
        (it["code"].as_str().unwrap().to_owned(), line, it["message"].as_str().unwrap().to_owned())
    });
    let found = found.collect();
    (run, found)
}

fn codes(found: &[(String, u64, String)]) -> Vec<(&str, u64)> {
    found.iter().map(|(code, line, _)| (code.as_str(), *line)).collect()
}

#[test]
fn binary_files_are_errors() {
    let (_, found) = check(
        "binary",
        &[("a.mal", b"shell S { }\n\xff\xfe\x00core"), ("b.mal", b"\x7fELF\x02\x01\x01\x00")],
    );
    assert_eq!(codes(&found), [("unreadable-file", 2), ("syntax-error", 1)], "{found:?}");
    assert!(found[0].2.contains("not UTF-8 text from byte 12 on"), "{found:?}");
    let (_, found) = check(
        "binary-table",
        &[
            ("a.mal", b"codel f(): int\n"),
            ("mauve.toml", b"timing.tables = [\"t.toml\"]\n"),
            ("t.toml", b"[codel]\nf = 1\n\xff"),
        ],
    );
    assert_eq!(codes(&found), [("invalid-table", 1)], "{found:?}");
}

#[test]
fn nesting_without_end() {
    let deep = format!(
        "core C(S) {{ update = {{ {}{} }} }}\nshell S {{ }}\n",
        "{".repeat(10_000),
        "}".repeat(10_000)
    );
    let sum = format!("core D(S) {{ update = {{ x = {}a; }} }}\n", "a + ".repeat(100_000));
    let chain = format!("core E(S) {{ update = {{ {}{{ }} }} }}\n", "if a then { } else ".repeat(100_000));
    let (_, found) = check("deep", &[("a.mal", format!("{deep}{sum}{chain}").as_bytes())]);
    assert_eq!(codes(&found), [("syntax-error", 1), ("syntax-error", 3), ("syntax-error", 4)], "{found:?}");
}

#[test]
fn the_whole_analysis_fits_into_a_small_stack() {
    // As deep as the parser lets it be.
    let program = format!(
        "{}x = {}f(){};{}",
        "{ if f() > 0 then {".repeat(60),
        "-(".repeat(40),
        ")".repeat(40),
        "} else { } }".repeat(60)
    );
    let sum = format!("y = {}f();", "f() + ".repeat(200));
    let model = format!(
        "codel f(): int\nshell S {{ }}\ncore K(S) {{ var x: int  var y: int  update = {{ {program} {sum} }} }}\ncomponent C(S, K)\n\
         architecture A {{ instance a: C }}\ndeployment D {{ architecture A  activity a {{ priority = 1 period = 999 }} }}\n"
    );
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "small-stack");
    write(&folder, &[("a.mal", &model), ("mauve.toml", "assume.codel = \"1 ms\"\n")]);
    let limited = format!("ulimit -s 2048; exec {} wcrt --format csv", MAUVE);
    let output =
        std::process::Command::new("sh").args(["-c", &limited]).current_dir(&folder).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    // 60 conditions, the call inside, and 201 in the sum.
    assert!(text.contains(",262,262,262,met"), "{text}{}", String::from_utf8_lossy(&output.stderr));
}

/// A megabyte that is as deep as it can be, in an address space of a gigabyte.
#[test]
fn a_megabyte_of_brackets() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "brackets");
    let program =
        |text: &str| format!("core C(S) {{ update = {{ x = {}", text.repeat(1_000_000 / text.len()));
    write(
        &folder,
        &[("round.mal", program("(")), ("blocks.mal", program("{"))]
            .map(|(path, text)| (path.to_owned(), text)),
    );
    for path in ["round.mal", "blocks.mal"] {
        let limited = format!("ulimit -v 1048576; exec {MAUVE} parse {path} >made");
        let output =
            std::process::Command::new("sh").args(["-c", &limited]).current_dir(&folder).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{path}: {}", String::from_utf8_lossy(&output.stderr));
        let made = std::fs::read(folder.join("made")).unwrap();
        // Behind a tree that is cut are the errors.
        let is_bounded = String::from_utf8_lossy(&made).contains("\n…\nerror ") && made.len() < 150_000_000;
        assert!(is_bounded, "{path}: {} bytes", made.len());
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Names of 60,000 letters: what quotes them is cut, so that output does not grow with each use of a name.
#[test]
fn long_names_are_cut_where_they_are_shown() {
    let long = "x".repeat(60_000);
    let model = format!(
        "codel f{long}(): int\nshell S {{ output port o{long}: int  input port i{long}: int }}\n\
         core C(S) {{ statemachine {{ initial state A{long} {{ transition t{long} if (f{long}() > 0) to B{long} }}  state B{long} {{ transition u{long} to A{long} }} }} }}\n\
         component K{long}(S, C)\narchitecture A {{ instance a{long}: K{long}  instance b{long}: K{long}  connection a{long}.o{long} -> b{long}.i{long} }}\n\
         deployment D{long} {{ architecture A  activity a{long} {{ priority = 1 period = 10 deadline = 0.1 }}  activity b{long} {{ priority = 2 period = 10 }} }}\n"
    );
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "long-names");
    write(&folder, &[("a.mal", model.as_str()), ("mauve.toml", "assume.codel = \"0.3 ms\"\n")]);
    let drawings = ["svg", "text", "dot"];
    let component = format!("K{long}");
    // A title and a reason have the name once.
    let mut all = vec![(vec!["wcrt"], 400_000), (vec!["simulate", "--for", "100ms"], 400_000)];
    all.extend(drawings.map(|it| (vec!["graph", "--format", it], 10_000)));
    all.extend(drawings.map(|it| (vec!["psm", ".", &component, "--format", it], 10_000)));
    for (arguments, most) in all {
        let run = mauve(MAUVE, &folder, &arguments);
        let shown = arguments.iter().map(|it| it.get(..8).unwrap_or(it)).collect::<Vec<_>>().join(" ");
        assert!(
            run.out.len() > 100 && run.out.len() < most,
            "{shown}: {} bytes {:.300}",
            run.out.len(),
            run.err
        );
    }
    let found: Value =
        serde_json::from_str(&mauve(MAUVE, &folder, &["check", "--format", "json"]).out).unwrap();
    let findings = found["diagnostics"].as_array().unwrap();
    assert!(!findings.is_empty());
    for it in findings {
        let message = it["message"].as_str().unwrap();
        assert!(message.chars().count() <= 2_000, "{} letters", message.chars().count());
    }
}

#[test]
fn a_file_of_five_megabytes() {
    let mut text = String::new();
    let mut part = 0;
    while text.len() < 5_000_000 {
        text += &format!(
            "library l{part} {{\n  codel f(in a: int): int\n  shell S {{ input port i: int }}\n  core K(S) {{ var v: int = 0; update = {{ v = f(v + 1); }} }}\n  component C(S, K)\n}}\n"
        );
        part += 1;
    }
    text += "codel f(\n";
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "megabytes");
    write(&folder, &[("a.mal", text.as_str())]);
    let run = mauve(MAUVE, &folder, &["check", "--format", "json"]);
    let document: Value = serde_json::from_str(&run.out).unwrap();
    let diagnostics = document["diagnostics"].as_array().unwrap();
    let shown: Vec<_> = diagnostics.iter().filter(|it| it["severity"] != "hint").collect();
    assert!(run.code == 1 && shown.len() == 1 && shown[0]["code"] == "syntax-error", "{:?}", shown.first());
}

#[test]
fn includes_that_go_wrong() {
    let (_, found) = check("includes", &[
        ("mauve.toml", b"project.root = \"a.mal\"\n"),
        ("a.mal", b"include \"b.mal\"\ninclude \"nothing.mal\"\ninclude \"folder\"\ninclude \"/dev/zero\"\ninclude \"\"\n"),
        ("b.mal", b"include \"a.mal\"\n"),
        ("folder/c.mal", b""),
    ]);
    assert_eq!(
        codes(&found),
        [
            ("include-cycle", 1),
            ("unresolved-include", 2),
            ("unresolved-include", 3),
            ("unresolved-include", 4),
            ("unresolved-include", 5),
            ("include-cycle", 1)
        ],
        "{found:?}"
    );
}

#[test]
fn tables_and_configurations_that_go_wrong() {
    let model = b"codel f(): int\ncodel g(): int\n";
    for (table, line, message) in [
        ("[codel\nf = 1\n", 1, "not TOML"),
        ("[codel]\nf = -1\n", 2, "negative"),
        ("[codel]\nf = 1e40\n", 2, "too"),
        ("levels = [1e-3]\n[codel]\nf = [1, 2]\n", 3, "2"),
        ("[codell]\nf = 1\n", 1, "codell"),
        ("unit = \"hours\"\n[codel]\nf = 1\n", 1, "hours"),
        ("levels = [2]\n[codel]\nf = 1\n", 1, "level"),
        ("[codel]\nf = true\n", 2, "boolean"),
    ] {
        let files: [(&str, &[u8]); 3] = [
            ("a.mal", model),
            ("mauve.toml", b"timing.tables = [\"t.toml\"]\n"),
            ("t.toml", table.as_bytes()),
        ];
        let (_, found) = check("tables", &files);
        assert_eq!(codes(&found), [("invalid-table", line)], "{table}: {found:?}");
        assert!(found[0].2.contains(message), "{table}: {found:?}");
    }
    let (_, found) = check("config", &[("a.mal", model), ("mauve.toml", b"[project]\nroot = \"b.mal\"\n[timing]\ntables = [\"[\", \"t/*.toml\"]\nlevel = 3\n[platform]\ncpus = -1\n")]);
    assert!(found.len() >= 4 && found.iter().all(|(code, ..)| code == "invalid-configuration"), "{found:?}");
}

#[test]
fn tables_that_cannot_be_reached_are_not_ignored() {
    let model = "codel f(): int\nshell S { }\ncore K(S) { update = { f(); } }\ncomponent C(S, K)\n\
                 architecture A { instance a: C }\ndeployment D { architecture A  activity a { priority = 1 period = 999 } }\n";
    let wcrt = |name: &str, pattern: &str, prepare: &dyn Fn(&std::path::Path)| {
        let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
        let config = format!("timing.tables = [\"{pattern}\"]\n");
        write(&folder, &[("a.mal", model), ("mauve.toml", &config), ("t/a.toml", "[codel]\nf = 1\n")]);
        prepare(&folder);
        mauve(MAUVE, &folder, &["wcrt", "--format", "csv"]).out
    };
    assert!(wcrt("tables-plain", "t/*.toml", &|_| ()).contains(",1,1,1,met"));
    // The name of a folder is no pattern, and the configuration is no table.
    assert!(wcrt("tables-[1]*", "t/*.toml", &|_| ()).contains(",1,1,1,met"));
    assert!(wcrt("tables-config", "**/*.toml", &|_| ()).contains(",1,1,1,met"));
    let broken = wcrt("tables-broken-link", "t/*.toml", &|folder| {
        std::os::unix::fs::symlink("/nowhere", folder.join("t/b.toml")).unwrap();
    });
    assert!(broken.contains("not-analysed"), "{broken}");
    let linked = wcrt("tables-linked", "t/**/*.toml", &|folder| {
        write(folder, &[("elsewhere/b.toml", "[program]\n\"C/update\" = 500\n")]);
        std::os::unix::fs::symlink("../elsewhere", folder.join("t/more")).unwrap();
    });
    assert!(linked.contains(",500,500,500,met"), "{linked}");
}

#[test]
fn large_rings_chains_and_fans_end_soon() {
    let files: Vec<(String, String)> = (0..150)
        .map(|file| {
            let includes: String = (0..150).map(|other| format!("include \"f{other}.mal\"\n")).collect();
            (format!("f{file}.mal"), includes)
        })
        .collect();
    let files: Vec<(&str, &[u8])> =
        files.iter().map(|(path, text)| (path.as_str(), text.as_bytes())).collect();
    let (_, found) = check("rings", &files);
    assert_eq!(found.len(), 150, "one warning a file");
    let chain: String = (0..3000)
        .map(|it| {
            format!("architecture A{it} {{ import A{} }}\nshell S{it} extends S{} {{ }}\n", it + 1, it + 1)
        })
        .collect();
    let (_, found) = check(
        "chains",
        &[("a.mal", format!("{chain}architecture A3000 {{ }} shell S3000 {{ }}").as_bytes())],
    );
    let codes: Vec<&str> = found.iter().map(|(code, ..)| code.as_str()).collect();
    assert_eq!(codes, ["too-large"], "9 million features and architectures are not expanded");
    let calls: String =
        (0..40).map(|it| format!("provide f{it}() = {{ f{}(); f{}(); }}\n", it + 1, it + 1)).collect();
    let shell: String = (0..41).map(|it| format!("provide f{it}(): void\n")).collect();
    let model = format!(
        "codel c(): int\nshell S {{ {shell} }}\ncore K(S) {{ {calls} provide f40() = {{ c(); }} update = {{ f0(); }} }}\n\
         component C(S, K)\narchitecture A {{ instance a: C }}\ndeployment D {{ architecture A  activity a {{ priority = 1 period = 999 }} }}\n"
    );
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "calls");
    write(&folder, &[("a.mal", &model), ("mauve.toml", "assume.codel = \"0 ms\"\n")]);
    let explained = mauve(MAUVE, &folder, &["wcrt", "--explain", "a"]);
    assert_eq!(explained.code, 0, "{}", explained.err);
}
