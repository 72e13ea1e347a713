//! `mauve wcrt --certificate`, `mauve verify` and `mauve check --verify`.

use std::fs;
use std::path::{Path, PathBuf};

use mauve_tests::{Run, mauve, models, scratch, test_name, write};

use crate::MAUVE;

fn run(folder: &Path, arguments: &[&str]) -> Run {
    mauve(MAUVE, folder, arguments)
}

/// Writes the certificate of a model of the repository, and returns its folder.
fn certified(model: &str, options: &[&str]) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{model}", test_name()));
    let path = models().join(model).display().to_string();
    let found = run(&folder, &[&["wcrt", &path, "--certificate", "proof.json"], options].concat());
    assert!(found.code <= 1 && found.err.is_empty(), "{}", found.err);
    folder
}

#[test]
fn each_model_of_the_repository_is_proved() {
    for (model, options, proved) in [
        ("p3dx", &[][..], " 9 deadlines proved\n"),
        ("p3dx", &["--significance", "1e-7"], " 8 deadlines proved\n"),
        ("p3dx_entry", &[], " 9 deadlines proved\n"),
        ("shared_cpus", &[], " 6 deadlines proved\n"),
    ] {
        let folder = certified(model, options);
        let found = run(&folder, &["verify", "proof.json"]);
        // A deadline that is missed has no proof.
        let (code, verdict) = match proved.starts_with(" 8") {
            true => (1, "proof.json: accepted in part\n"),
            false => (0, "proof.json: accepted\n"),
        };
        assert_eq!((found.code, found.err.as_str()), (code, ""), "{}", found.out);
        assert!(found.out.starts_with(verdict) && found.out.contains(proved), "{}", found.out);
        assert!(found.has("the execution times and the model are taken from the file.\n"));
    }
}

/// Its deadline is met only by a search over combinations of paths.
#[test]
fn what_is_not_certified_is_said() {
    let folder = certified("sorter", &[]);
    let found = run(&folder, &["verify", "proof.json"]);
    assert!(
        found.out.contains("monitor: not certified: it is met only by combinations of paths"),
        "{}",
        found.out
    );
    assert_eq!((found.code, run(&folder, &["verify", "--allow-partial", "proof.json"]).code), (1, 0));
}

#[test]
fn the_claim_that_fails_is_named() {
    let folder = certified("p3dx", &[]);
    let text = fs::read_to_string(folder.join("proof.json")).unwrap();
    for (from, to, why) in [
        // The execution time of hokuyo.
        (
            ",43000000,",
            ",44000000,",
            "P3dxDeployment: closed form: state 0 gains 44000000, more than 43000000",
        ),
        (
            "\"period\":100000000",
            "\"period\":90000000",
            "`navigation` of P3dxDeployment: job 1 has not ended after",
        ),
        (
            "\"deadline\":1000000000",
            "\"deadline\":900000000",
            "the response time 997000000 ns exceeds the deadline",
        ),
        ("\"met\":true", "\"met\":true,\"sure\":true", ""),
    ] {
        assert!(text.contains(from), "{from}");
        fs::write(folder.join("other.json"), text.replace(from, to)).unwrap();
        let found = run(&folder, &["verify", "proof.json", "other.json"]);
        let code = if why.is_empty() { 2 } else { 1 };
        assert_eq!(found.code, code, "{}{}", found.out, found.err);
        assert!(found.out.contains(why), "{}", found.out);
    }
    let found = run(&folder, &["verify", "none.json"]);
    assert_eq!((found.code, found.out.as_str()), (2, ""));
}

#[test]
fn check_says_what_the_checker_found() {
    let folder = models().join("p3dx");
    let found = run(&folder, &["check", "--verify"]);
    assert!(found.out.contains("\ncertificate: accepted, 9 deadlines proved\n"), "{}", found.out);
    assert_eq!(found.code, 0);
    let found = run(&folder, &["check", "--verify", "--format", "json"]);
    assert!(found.out.contains("\"certificate\": \"accepted, 9 deadlines proved\""), "{}", found.out);
}

/// A base follows what a camera and a guide say, which may write nothing for ever.
const ROBOT: &str = "
codel sweep(out n: int): bool
codel steer(in n: int): int
codel halt(): int
codel drive(in n: int): void
shell Laser { output port scan: int }
shell Guide { input port scan: int  output port speed: int }
shell Base { input port speed: int }
core LaserCore(Laser) { var n: int = 0  update = { if (sweep(n)) then { write(scan, n); } else { } } }
core GuideCore(Guide) { var n: int = 0
  statemachine {
    initial state Waiting { run = { write(speed, halt()); }  transition go to Steering }
    state Steering { run = { read(scan, n); write(speed, steer(n)); }  transition stop if (n < 0) to Waiting }
  }
}
core BaseCore(Base) { var n: int = 0  update = { read(speed, n); drive(n); } }
component Scanner(Laser, LaserCore)
component Guidance(Guide, GuideCore)
component Wheels(Base, BaseCore)
architecture A {
  instance laser: Scanner  instance guidance: Guidance  instance wheels: Wheels
  connection laser.scan -> guidance.scan  connection guidance.speed -> wheels.speed
}
deployment Robot {
  architecture A
  activity laser { affinity = 1  priority = 3  period = 100 }
  activity guidance { affinity = 1  priority = 2  period = 100 }
  activity wheels { affinity = 1  priority = 1  period = 100 }
}
";

/// The certificate of the robot with these chains, and what is said of it.
fn chained(name: &str, chains: &str) -> (PathBuf, Run) {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()));
    let config = format!("assume.codel = \"1 ms\"\nplatform.rt_throttling = false\n{chains}");
    write(&folder, &[("robot.mal", ROBOT), ("mauve.toml", &config)]);
    let written = run(&folder, &["wcrt", "--certificate", "proof.json"]);
    assert_eq!((written.code, written.err.as_str()), (0, ""));
    let found = run(&folder, &["verify", "proof.json"]);
    (folder, found)
}

const SEE: &str = "from = 'sweep'\nto = 'drive'\nwhile = ['guidance.Steering']\nanswers = ['sweep']\n";

#[test]
fn what_is_assumed_of_a_chain_is_said() {
    let (folder, found) = chained("met", &format!("[chains.see]\n{SEE}latency = '400 ms'\n"));
    let said = "    `see`: 303 ms within 400 ms, while the states are guidance.Steering, and if there is an answer of sweep\n";
    assert!(found.out.contains(said) && found.code == 0, "{}", found.out);
    let text = fs::read_to_string(folder.join("proof.json")).unwrap();
    let conditions = "\"while\":[\"guidance.Steering\"]";
    assert!(text.contains(conditions) && text.contains("\"answers\":[\"sweep\"]"), "{text}");
    // Without a limit, its latency holds under the same conditions.
    let (_, found) = chained("no-limit", &format!("[chains.see]\n{SEE}"));
    let said =
        "    `see`: 303 ms, while the states are guidance.Steering, and if there is an answer of sweep\n";
    assert!(found.out.contains(said) && found.code == 0, "{}", found.out);
}

/// As a missed deadline, a chain that misses its limit, or has no latency, is not proved.
#[test]
fn a_chain_that_is_not_proved_is_named() {
    let late = format!("[chains.see]\n{SEE}latency = '300 ms'\n");
    let skipped = "[chains.blind]\nfrom = 'sweep'\nto = 'drive'\n";
    for (name, chains, why) in [
        (
            "late",
            late.as_str(),
            "    chain see: not certified: its latency of 303 ms exceeds its limit of 300 ms\n",
        ),
        (
            "skipped",
            skipped,
            "    chain blind: not certified: it has no latency: `laser` may never pass the data on in update: `sweep` may not return `true`; \
             `guidance` may overwrite the data before it is read: Waiting.run writes a value that does not come from it\n",
        ),
    ] {
        let (folder, found) = chained(name, chains);
        assert!(found.out.starts_with("proof.json: accepted in part\n"), "{}", found.out);
        assert!(found.has(" 3 deadlines proved\n") && found.has(why), "{}", found.out);
        assert_eq!((found.code, run(&folder, &["verify", "--allow-partial", "proof.json"]).code), (1, 0));
        let checked = run(&folder, &["check", "--verify"]);
        let why = why.trim().replace(": not certified: ", ", ");
        assert!(checked.has(&format!("; not certified: {why}")), "{}", checked.out);
    }
}

/// A certificate has no form for releases by data: it says that, and no vague reason.
#[test]
fn a_chain_that_data_releases_is_named_with_its_reason() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let model = ROBOT.replace("priority = 1  period = 100", "priority = 1  trigger = speed  least = 100");
    let config = format!("assume.codel = \"1 ms\"\nplatform.rt_throttling = false\n[chains.see]\n{SEE}");
    write(&folder, &[("robot.mal", &*model), ("mauve.toml", &config)]);
    assert_eq!(run(&folder, &["wcrt", "--certificate", "proof.json"]).code, 0);
    let found = run(&folder, &["verify", "proof.json"]);
    let said = "chain see: not certified: data releases an activity on its way (`trigger`)";
    assert!(found.out.contains(said), "{}", found.out);
}

/// Whoever writes a certificate chooses its names: none of them begins a line of its own.
#[test]
fn no_name_of_a_certificate_forges_a_line() {
    let (folder, _) = chained("names", &format!("[chains.see]\n{SEE}latency = '400 ms'\n"));
    let text = fs::read_to_string(folder.join("proof.json")).unwrap();
    let forged = "\\nother.json: accepted\\n";
    for (from, to) in [
        ("\"deployment\":\"Robot\"", format!("\"deployment\":\"Robot{forged}\"")),
        ("\"significance\":\"1e-4\"", format!("\"significance\":\"1e-4{forged}\"")),
        ("\"name\":\"see\"", format!("\"name\":\"see{forged}\"")),
        ("\"guidance.Steering\"", format!("\"guidance.Steering{forged}\"")),
        ("\"answers\":[\"sweep\"]", format!("\"answers\":[\"sweep{forged}\"]")),
        ("\"not_certified\":[]", format!("\"not_certified\":[[\"a{forged}\",\"b{forged}\"]]")),
        // The name of a task in the reason why it is refused, and a key that is not known.
        ("\"met\":true,\"response\":1000000,\"task\":0", "\"met\":true,\"response\":1,\"task\":0".to_owned()),
        ("\"met\":true", format!("\"met\":true,\"sure{forged}\":true")),
    ] {
        assert!(text.contains(from), "{from} in {text}");
        let other =
            text.replacen(from, &to, 1).replace("\"name\":\"laser\"", &format!("\"name\":\"laser{forged}\""));
        fs::write(folder.join("proof.json"), &other).unwrap();
        let found = run(&folder, &["verify", "proof.json"]);
        let said = format!("{}{}", found.out, found.err);
        assert!(!said.lines().any(|line| line.starts_with("other.json")), "{from}: {said}");
        let is_shown = said.contains("\\u{a}other.json: accepted");
        assert!(is_shown, "{from}: {said}");
    }
}
