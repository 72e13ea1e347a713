//! Execution times from measurements, while an editor shows a model: hints, hovers and diagnostics follow the command line.

use std::fmt::Write as _;

use mauve_tests::{Client, is_publication, mauve, scratch, write};
use serde_json::{Value, json};

use crate::MAUVE;

const MODEL: &str = "codel scan(): int
shell S { }
core C(S) { update = { scan(); } }
component Laser(S, C)
architecture A { instance laser: Laser }
deployment D {
  architecture A
  activity laser { priority = 1 period = 100 deadline = 60 }
}
";

/// 1000 executions of 10 ms and more: exponential with this mean, in milliseconds.
fn executions(mean: f64) -> String {
    let mut lines = String::from("codel,execution_ns,instance\n");
    for index in 0..1000_u32 {
        let share = f64::from(index * 613 % 1000) / 1000.0 + 0.000_5;
        let _ = writeln!(lines, "scan,{:.0},laser", 1e7 - mean * 1e6 * share.ln());
    }
    lines
}

#[test]
fn the_editor_follows_measurements() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_measured");
    let config = "[timing]\ntables = [\"timing.toml\"]\n[platform]\nrt_throttling = false\n";
    write(
        &folder,
        &[
            ("robot.mal", MODEL),
            ("mauve.toml", config),
            ("timing.toml", "levels = [1e-4]\n[codel]\nscan = 55\n"),
            ("day.csv", &executions(1.0)),
            ("night.csv", &executions(5.0)),
        ],
    );
    let run = |arguments: &[&str]| {
        let run = mauve(MAUVE, &folder, arguments);
        assert!(run.code < 2, "{}", run.err);
    };
    let measure = || run(&["pwcet", "robot.samples", "-o", "timing.toml", "--replace"]);
    let mut client = Client::of_folder(MAUVE, &folder);
    let text = client.open_file(&folder.join("robot.mal"));
    assert!(client.hint(&text, "activity laser").contains("! 55 / 60 ms"));

    // The first measurement replaces the time by hand.
    run(&["trace", "import", "day.csv", "-o", "robot.samples"]);
    measure();
    client.wait_for_hint(&text, "activity laser", |it| it.starts_with("✓ 2"));
    let hover = client.call("textDocument/hover", text.at("scan()")).unwrap();
    let shown = hover["contents"]["value"].as_str().unwrap();
    assert!(shown.contains("1000 executions"), "{shown}");

    // More executions: the table is older than they are, until it is updated. Then the response time is too long.
    let table = client.open_file(&folder.join("timing.toml"));
    let is_outdated = |it: &Value| it.to_string().contains("outdated-measurement");
    let (_, found) = client.wait("the diagnostics of the table", |it| is_publication(it, &table.uri));
    assert!(!is_outdated(&found), "{found}");
    run(&["trace", "import", "night.csv", "-o", "robot.samples"]);
    client.wait("an outdated measurement", |it| is_publication(it, &table.uri) && is_outdated(it));
    client.notify("textDocument/didClose", json!({"textDocument": {"uri": table.uri}}));
    measure();
    client.wait_for_hint(&text, "activity laser", |it| it.starts_with('✗'));
    client.idle();
    client.forget();
    let table = client.open_file(&folder.join("timing.toml"));
    let (_, found) = client.wait("the diagnostics of the table", |it| is_publication(it, &table.uri));
    assert!(!is_outdated(&found), "{found}");
    assert_eq!(client.shut_down(), Some(0));
}
