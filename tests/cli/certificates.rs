//! `mauve wcrt --certificate`, `mauve verify` and `mauve check --verify`.

use std::fs;
use std::path::{Path, PathBuf};

use mauve_tests::{Run, mauve, models, scratch, test_name};

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
        assert!(found.out.ends_with("the execution times and the model are taken from the file.\n"));
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
