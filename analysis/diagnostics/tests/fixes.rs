//! Fixes, by example: what they write, and which are not offered. `each_fix.rs` tests all of them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use mauve_diagnostics::{Finding, Fix, workspace_diagnostics};
use mauve_hir::{Database, Workspace};

type Texts = BTreeMap<PathBuf, String>;

fn found<'db>(db: &'db Database, texts: &Texts) -> Vec<Finding<'db>> {
    let workspace = Workspace::of_texts(db, "/".into(), texts.clone());
    workspace_diagnostics(db, workspace)
}

fn applied(db: &Database, texts: &Texts, fix: &Fix<'_>) -> Texts {
    let mut texts = texts.clone();
    let mut edits: Vec<_> =
        fix.edits.iter().map(|(at, text)| (at.file(db).path(db).clone(), at.range(db), text)).collect();
    edits.sort_by_key(|(path, range, _)| (path.clone(), std::cmp::Reverse(range.start())));
    for (path, range, text) in edits {
        texts.get_mut(&path).unwrap().replace_range(std::ops::Range::<usize>::from(range), text);
    }
    texts
}

#[test]
fn a_sign_that_is_missing_is_written_where_it_was() {
    let models = mauve_tests::models().join("p3dx/components");
    let mut texts: Vec<String> = std::fs::read_dir(models)
        .unwrap()
        .map(|entry| std::fs::read_to_string(entry.unwrap().path()).unwrap())
        .collect();
    texts.sort();
    let (mut mended, mut same) = (0, 0);
    for text in texts {
        let tree = mauve_syntax::parse(&text);
        let tokens =
            tree.syntax().descendants_with_tokens().filter_map(mauve_syntax::NodeOrToken::into_token);
        for token in tokens.filter(|it| [";", "then", "}", ")", ":", "=", "->", "to"].contains(&it.text())) {
            let mut damaged = text.clone();
            damaged.replace_range(std::ops::Range::<usize>::from(token.text_range()), "");
            let texts: Texts = [("/model.mal".into(), damaged)].into();
            let errors =
                |texts: &Texts| mauve_syntax::parse(&texts[&PathBuf::from("/model.mal")]).errors().len();
            let db = Database::default();
            let findings = found(&db, &texts);
            let fixes = findings.iter().filter(|it| it.diagnostic.code.name == "syntax-error");
            for fix in fixes.flat_map(|it| &it.diagnostic.fixes) {
                let fixed = applied(&db, &texts, fix);
                assert!(errors(&fixed) < errors(&texts), "{}\n{texts:#?}\n{fixed:#?}", fix.title);
                mended += 1;
                let bare = |text: &str| text.split_whitespace().collect::<String>();
                same += usize::from(bare(&fixed[&PathBuf::from("/model.mal")]) == bare(&text));
            }
        }
    }
    // A brace may be missing in several places.
    assert!(mended > 250 && same * 5 > mended * 4, "{same} of {mended} as it was");
}

/// The texts of `/model.mal` after each fix for the diagnostics of that code in `model`, with the titles of the fixes.
fn after_fixes(code: &str, model: &str) -> Vec<(String, String)> {
    let texts: Texts =
        mauve_tests::fixture(model).into_iter().map(|(path, text)| (path.into(), text)).collect();
    let db = Database::default();
    let findings = found(&db, &texts).into_iter().filter(|it| it.diagnostic.code.name == code);
    let fixes = findings.flat_map(|it| it.diagnostic.fixes.clone());
    fixes
        .map(|it| (it.title.clone(), applied(&db, &texts, &it)[&PathBuf::from("/model.mal")].clone()))
        .collect()
}

#[test]
fn a_chain_gets_the_states_and_answers_that_it_needs() {
    const MODEL: &str = "
codel look(out n: int): bool
codel steer(in n: int): int
codel use(in n: int): void
shell Eye { output port seen: int }
shell Guide { input port goal: int  output port speed: int }
shell Leg { input port speed: int }
core EyeCore(Eye) { var n: int = 0  update = { if (look(n)) then { write(seen, n); } else { } } }
core GuideCore(Guide) { var n: int = 0
  statemachine {
    initial state Waiting { run = { write(speed, 0); }  transition go to Going }
    state Going {
      run = { if (read(goal, n) == new_data) then { write(speed, steer(n)); } else { write(speed, steer(n)); } }
      transition stop if (n < 0) to Resting
    }
    state Resting { run = { read(goal, n); }  transition on if (n > 0) to Waiting }
  }
}
core LegCore(Leg) { var n: int = 0  update = { read(speed, n); use(n); } }
component Camera(Eye, EyeCore)
component Pilot(Guide, GuideCore)
component Base(Leg, LegCore)
architecture Robot { instance camera: Camera  instance pilot: Pilot  instance base: Base
  connection camera.seen -> pilot.goal
  connection pilot.speed -> base.speed
}
deployment Bench {
  architecture Robot
  activity camera { priority = 3  period = 10 }
  activity pilot { priority = 2  period = 10 }
  activity base { priority = 1  period = 10 }
}
//- /mauve.toml
assume.codel = \"1 ms\"
";
    for (chain, fixed) in [
        (
            "[chains.a] # all\nfrom = 'look'\nto = 'use' # wheels\nlatency = '1 s'\n",
            "[chains.a] # all\nfrom = 'look'\nto = 'use' # wheels\nwhile = [\"pilot.Going\"]\nanswers = [\"look\"]\nlatency = '1 s'\n",
        ),
        (
            "[chains.a]\nfrom = 'look'\nwhile = ['pilot.Waiting', 'pilot.Resting', 'pilot.Going']\nto = 'use'\n",
            "[chains.a]\nfrom = 'look'\nwhile = [\"pilot.Going\"]\nto = 'use'\nanswers = [\"look\"]\n",
        ),
    ] {
        let files = mauve_tests::fixture(&format!("{MODEL}{chain}"));
        let texts: Texts = files.into_iter().map(|(path, text)| (path.into(), text)).collect();
        let db = Database::default();
        let findings = found(&db, &texts);
        let broken = findings.iter().filter(|it| it.diagnostic.code.name == "chain-broken");
        let fixes: Vec<&Fix<'_>> = broken.flat_map(|it| &it.diagnostic.fixes).collect();
        let [fix] = fixes.as_slice() else { panic!("one fix: {findings:#?}") };
        let after = applied(&db, &texts, fix);
        let text = &after[&PathBuf::from("/mauve.toml")];
        assert_eq!(text.split_once("ms\"\n").unwrap().1, fixed);
        let db = Database::default();
        let left = found(&db, &after);
        assert!(left.iter().all(|it| it.diagnostic.code.name != "chain-broken"), "{left:#?}");
    }
    // An inline table has no lines for keys, and neither a name that is wrong nor a missing activity is mended by an assumption.
    for chain in [
        "[chains]\na = { from = 'camera.seen', to = 'base.speed' }\n",
        "[chains.a]\nfrom = 'use'\nto = 'look'\n",
    ] {
        let fixes = after_fixes("chain-broken", &format!("{MODEL}{chain}"));
        assert_eq!(fixes, [], "{chain}");
    }
}

#[test]
fn the_chain_of_the_sample_robot_gets_its_assumptions() {
    let folder = mauve_tests::models().join("p3dx");
    let mut texts: Texts = BTreeMap::new();
    for (path, text) in mauve_tests::all_texts_in(&folder) {
        texts.insert(PathBuf::from("/").join(path.strip_prefix(&folder).unwrap()), text);
    }
    let config = texts.get_mut(&PathBuf::from("/mauve.toml")).unwrap();
    let (before, _) = config.split_once("while = ").unwrap();
    *config = format!("{before}latency = '500 ms'\n");
    let db = Database::default();
    let findings = found(&db, &texts);
    let broken: Vec<_> = findings.iter().filter(|it| it.diagnostic.code.name == "chain-broken").collect();
    let [broken] = broken.as_slice() else { panic!("{findings:#?}") };
    let why = &broken.diagnostic.message;
    for blocks in ["`hokuyo` may never pass", "`guidance` may never pass", "`switch` may never pass"] {
        assert!(why.contains(blocks), "{blocks}: {why}");
    }
    let [fix] = broken.diagnostic.fixes.as_slice() else { panic!("{why}") };
    let written = "Write `while = [\"guidance.Steering\", \"switch.Automatic\"]` and `answers = [\"drivers.hokuyo_sweep\"]`";
    assert_eq!(fix.title, written);
    let after = applied(&db, &texts, fix);
    let db = Database::default();
    let left = found(&db, &after);
    let of_chains = left.iter().filter(|it| it.diagnostic.code.name.starts_with("chain-"));
    let messages: Vec<&str> = of_chains.map(|it| it.diagnostic.message.as_str()).collect();
    let late = "chain `avoid` is too slow: ✗ ≤ 526 / 500 ms; largest part: `guidance`, 160 ms of 526 ms \
                (hokuyo 100 ms, guidance 160 ms, switch 156 ms, p3dx_driver 110 ms): release it more often, as with a shorter period";
    assert_eq!(messages, [late]);
}

#[track_caller]
fn check_after(code: &str, model: &str, expected: &[(&str, &str)]) {
    let after = after_fixes(code, model);
    let after: Vec<(&str, &str)> =
        after.iter().map(|(title, text)| (title.as_str(), text.as_str())).collect();
    assert_eq!(after, expected, "{code}");
}

#[test]
fn what_is_removed_leaves_no_gap() {
    let user = "core C(S) { update = { f(); } }\n";
    let model = |unused: &str| format!("shell S {{ }}\n{unused}codel f(): int\n{user}");
    for unused in [
        "codel old(): int\n",
        "// It was once.\n/* é */\ncodel old(): int // and is no more\n",
        "  codel old(\n    in a: int\n  ): int;  \n",
        "codel old(): int ",
    ] {
        check_after("unused-codel", &model(unused), &[("Remove the unused codel `old`", &model(""))]);
    }
    // A comment that is of something else stays.
    let model = |unused: &str| format!("shell S {{ }} // one\n{unused}\n// two\ncodel f(): int\n{user}");
    check_after(
        "unused-codel",
        &model("codel old(): int\n"),
        &[("Remove the unused codel `old`", &model(""))],
    );

    let model = |unused: &str| {
        format!(
            "codel f(): int\nshell S {{ }}\ncore C(S) {{\n  var n: int = 0;{unused}\n  update = {{ f(); if n > 0 then {{ }} else {{ }} }}\n}}\n"
        )
    };
    for unused in ["\n  var old: int = 3;", " var old: int", "\n  // It was.\n  var old: int = n + 1"] {
        check_after("unused-variable", &model(unused), &[("Remove the unused variable `old`", &model(""))]);
    }
    check_after("unused-variable", &model("\n  var old: int = f();"), &[]);
}

#[test]
fn a_file_that_is_not_included_is_included_behind_the_others() {
    let model = |includes: &str| {
        format!(
            "{includes}core C(GripperShell) {{ update = {{ }} }}\n//- /lib/gripper.mal\nshell GripperShell {{ }}\n//- /other.mal\n//- /mauve.toml\nproject.root = \"model.mal\"\n"
        )
    };
    let after = |includes: &str| format!("{includes}core C(GripperShell) {{ update = {{ }} }}\n");
    let title = "Add `include \"lib/gripper.mal\"`";
    for (before, then) in [
        ("", "include \"lib/gripper.mal\"\n"),
        ("include \"other.mal\" // é\n", "include \"other.mal\"\ninclude \"lib/gripper.mal\" // é\n"),
    ] {
        check_after("unresolved-shell", &model(before), &[(title, &after(then))]);
    }
}

#[test]
fn a_field_that_is_missing_is_written_with_a_value_that_is_free() {
    let model = |one: &str, other: &str| {
        format!(
            "shell S {{ }}\ncore C(S) {{ update = {{ }} }}\ncomponent K(S, C)\narchitecture A {{ instance a: K  instance b: K }}\ndeployment D {{\n  architecture A\n  activity a {{{one}}}\n  activity b {{{other}}}\n}}\n"
        )
    };
    for (one, other, priority) in [
        (" priority = 7 period = 10 ", " ", 6),
        (" priority = 1 period = 10 ", " ", 2),
        (" priority = background ", " ", 1),
        (" priority = 7 period = 10 affinity = 1 ", " affinity = 2 ", 1),
    ] {
        let title = format!("Write `priority = {priority}`, to be changed");
        let after = format!(" priority = {priority}{other}");
        check_after("missing-field", &model(one, other), &[(&title, &model(one, &after))]);
    }
    let (one, other) = (" priority = 7 period = 10 ", " priority = 3 // é\n  ");
    let after = " priority = 3 period = 100 // é\n  ";
    check_after(
        "missing-field",
        &model(one, other),
        &[("Write `period = 100`, to be changed", &model(one, after))],
    );
}

#[test]
fn a_definition_takes_the_signature_of_its_shell_and_keeps_its_names() {
    let model = |signature: &str| {
        format!(
            "shell S {{ provide near(in far: int, out at: int): bool }}\ncore C(S) {{\n  provide near{signature} = {{ return true; }}\n  update = {{ }}\n}}\n"
        )
    };
    for (before, after) in [
        ("(in a: double, out at: int): bool", "(in a: int, out at: int): bool"),
        ("(in a: int)", "(in a: int, out at: int): bool"),
        ("()", "(in far: int, out at: int): bool"),
    ] {
        let title = "Change to the signature in the shell";
        check_after("operation-definition", &model(before), &[(title, &model(after))]);
    }
    // Its program may use what would go.
    check_after("operation-definition", &model("(in a: int, out b: int, in c: int): bool"), &[]);
}

/// What is missing on the line of what follows it has an empty error in the tree there.
#[test]
fn a_sign_that_is_missing_within_a_line_is_written() {
    for (body, title) in [
        ("n = 1 }", "Write `;`"),
        ("n = 1 n = 2; }", "Write `;`"),
        ("return }", "Write `;`"),
        ("if n > 0 { } else { } }", "Write `then`"),
        ("if (n > 0 then { } else { } }", "Write `)`"),
        ("if (n = 10) then { } else { } }", "Write `==`"),
        ("if n = 10 then { } else { } }", "Write `==`"),
    ] {
        let model = format!("shell S {{ }}\ncore C(S) {{\n  var n: int = 0\n  update = {{ {body}\n}}\n");
        let after = after_fixes("syntax-error", &model);
        assert_eq!(after.len(), 1, "{body}: {after:?}");
        assert!(
            after.iter().all(|(it, text)| it == title && mauve_syntax::parse(text).errors().is_empty()),
            "{after:?}"
        );
    }
}

/// A deployment on two CPUs: for each activity its fields.
fn deployed(activities: &[&str]) -> String {
    let names = || (0..activities.len()).map(|number| format!("i{number}"));
    let instances: String = names().map(|name| format!("instance {name}: C  ")).collect();
    let activities: String =
        names().zip(activities).map(|(name, fields)| format!("activity {name} {{ {fields} }}\n")).collect();
    format!(
        "codel f(): int\nshell S {{ }}\ncore K(S) {{ update = {{ f(); }} }}\ncomponent C(S, K)\n\
         architecture A {{ {instances} }}\ndeployment D {{ architecture A\n{activities}}}\n"
    )
}

#[test]
fn a_priority_that_is_set_is_free_and_in_order() {
    let titles = |activities: &[&str]| -> Vec<String> {
        let after = after_fixes("not-deadline-monotonic", &deployed(activities));
        after.into_iter().map(|(title, _)| title).collect()
    };
    // Above 6, where the deadline is later, and below 10; two activities have 7, and 8 is on another CPU only.
    let late = [
        "affinity = 2 priority = 10 period = 10",
        "affinity = 2 priority = 7 period = 15",
        "affinity = 2 priority = 7 period = 15",
        "affinity = 2 priority = 6 period = 18",
        "affinity = 2 priority = 5 period = 20",
        "affinity = 1 priority = 8 period = 15",
        "affinity = 2 priority = 1 period = 15",
    ];
    assert_eq!(titles(&late), ["Give i6 priority 8"]);
    // Below 7, where the deadline is earlier.
    let early = [
        "affinity = 2 priority = 7 period = 10",
        "affinity = 2 priority = 8 period = 10",
        "affinity = 2 priority = 9 period = 20",
        "affinity = 1 priority = 6 period = 20",
    ];
    assert_eq!(titles(&early), ["Give i2 priority 6"]);
    // No priority is below 1.
    let least = ["priority = 1 period = 10", "priority = 2 period = 10", "priority = 3 period = 20"];
    assert_eq!(titles(&least), [] as [&str; 0]);
}

#[test]
fn a_key_is_replaced_where_the_table_has_no_other_of_that_name() {
    let titles = |entries: &str| -> Vec<String> {
        let model = format!(
            "codel one(): int\nlibrary near {{ codel two(): int }}\n//- /mauve.toml\ntiming.tables = [\"t.toml\"]\n//- /t.toml\n[codel]\n{entries}"
        );
        after_fixes("unknown-timing-key", &model).into_iter().map(|(title, _)| title).collect()
    };
    for key in ["oen", "\"oen\"", "'oen'"] {
        assert_eq!(titles(&format!("{key} = 1\n")), ["Change to `one`"], "{key}");
        assert_eq!(titles(&format!("{key} = 1\none = 2\n")), [] as [&str; 0], "{key}");
    }
    // A key of several tokens.
    assert_eq!(titles("near.tow = 1\n"), [] as [&str; 0]);
}

/// A name that is declared already, the declaration itself, a priority that is taken, a value of a wrong type, a sign that is not
/// the missing one.
#[test]
fn a_fix_that_is_the_next_mistake_is_not_offered() {
    const ROBOT: &str =
        "shell S { }\ncore C(S) { update = { } }\ncomponent K(S, C)\narchitecture A { instance front: K }\n";
    let in_update =
        |text: &str| format!("shell S {{ }}\ncore C(S) {{ var n: int = 0; update = {{ {text} }} }}\n");
    let with_config = |model: &str, config: &str| format!("{model}//- /mauve.toml\n{config}");
    let activity = |name: &str, number: u32| format!("activity {name} {{ priority = {number} period = 10 }}");
    for (code, model) in [
        (
            "unresolved-instance",
            format!("{ROBOT}deployment D {{ architecture A {} {} }}\n", activity("front", 1), activity("frnot", 2)),
        ),
        ("unresolved-architecture", "architecture Robot1 { import Robot2 }\n".to_owned()),
        ("unresolved-shell", "shell Laser1 extends Laser2 { }\n".to_owned()),
        (
            "operation-definition",
            "shell S { provide park(): void }\ncore C(S) { provide park(): bool = { return true; } update = { } }\n".to_owned(),
        ),
        (
            "operation-definition",
            "shell S { provide at(): int }\ncore C(S) { provide at(): string = { return \"\"; } update = { } }\n".to_owned(),
        ),
        ("unused-codel", with_config("codel bus(): int\n", "[locks.b]\ncodels = [\"bus\"]\nprotocol = \"inheritance\"\n")),
        ("invalid-configuration", with_config(ROBOT, "[platfrom]\ncpus = 1\n[platform]\ncpus = 2\n")),
        ("invalid-configuration", with_config(ROBOT, "[platform]\ncups = 1\ncpus = 2\n")),
        ("misspelt-name", "shell S { property p: none }\n".to_owned()),
        ("misspelt-name", "codel plan(in goal: viod): int\n".to_owned()),
        ("syntax-error", in_update("n = 1.2.0;")),
        ("syntax-error", in_update("n = 1..2;")),
        ("syntax-error", in_update("n = (1,5 + 2);")),
        ("syntax-error", in_update("fi (n > 2) then { } else { }")),
        ("syntax-error", in_update("vra m: int = 3;")),
        ("syntax-error", "codel plan(ni goal: int): int\n".to_owned()),
        ("syntax-error", format!("{ROBOT}deployment D {{ architecture A activity front {{ transition period = 5 }} }}\n")),
        ("syntax-error", "shell S { }\ncore C(S) { statemachine { initial State A { } } }\n".to_owned()),
    ] {
        let db = Database::default();
        let texts: Texts = mauve_tests::fixture(&model).into_iter().map(|(path, text)| (path.into(), text)).collect();
        let all = found(&db, &texts);
        let reported: Vec<_> = all.iter().filter(|it| it.diagnostic.code.name == code).collect();
        assert!(!reported.is_empty(), "no {code} in {model}");
        let titles: Vec<&str> =
            reported.iter().flat_map(|it| &it.diagnostic.fixes).map(|it| it.title.as_str()).collect();
        assert_eq!(titles, [] as [&str; 0], "{code} in {model}");
    }
}

#[test]
fn all_signs_that_are_missing_at_one_place_are_written_at_once() {
    let model = "shell S { }\ncore C(S) {\n  var n: int = 0\n  update = { n = ((n + 1) * (n + 2; }\n}\n";
    check_after("syntax-error", model, &[("Write `))`", &model.replace("2;", "2));"))]);
    let model = "shell S { }\ncore C(S) {\n  update = { }\n  stop = {\n    { ";
    let after = format!("{model}\n    }}\n  }}\n}}");
    let after = after_fixes("syntax-error", model).pop().zip(Some(after)).unwrap();
    assert!(mauve_syntax::parse(&after.0.1).errors().is_empty(), "{after:?}");
}
