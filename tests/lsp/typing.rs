//! What people see while they type: older figures where the text has none, and no diagnostics at the cursor.

use std::time::{Duration, Instant};

use mauve_tests::{Random, Text, char_boundary, search};
use serde_json::{Value, json};

use super::{MAUVE, copied_robot, robot};

/// Whether a text has an older figure.
fn has_older(text: &str) -> bool {
    text.split("… ").skip(1).any(|rest| rest.starts_with(|it: char| it.is_ascii_digit() || "≤C".contains(it)))
}

#[test]
fn figures_stay_while_an_activity_is_typed() {
    let mut client = robot();
    let mut text = client.open_file(&mauve_tests::models().join("p3dx/deployment.mal"));
    client.idle();
    let count = |hints: &[(u64, String)]| hints.iter().filter(|(_, label)| label.contains(" ms")).count();
    let before = client.hints(&text.uri);
    let at = text.text.find("period = 1000").unwrap() + "period = ".len();
    // The period is removed and typed again.
    client.replace(&mut text, at..at + 4, "");
    client.idle();
    let hints = client.hints(&text.uri);
    assert_eq!(count(&hints), count(&before), "{hints:?}");
    assert_eq!(client.hint(&text, "activity navigation"), "… 997 / 1000 ms");
    for (index, key) in "1000".chars().enumerate() {
        client.replace(&mut text, at + index..at + index, &key.to_string());
        let hints = client.hints(&text.uri);
        assert!(hints.iter().all(|(_, label)| !label.starts_with("? ")), "{hints:?}");
    }
    assert_eq!(client.hints(&text.uri), before);
}

/// Types an activity, a program and a declaration, key by key: each activity of the deployment has a figure all the time.
#[test]
fn every_activity_has_a_figure_while_a_text_is_typed() {
    let folder = copied_robot("lsp_typing_figures");
    let mut client = mauve_tests::Client::of_folder(MAUVE, &folder);
    let deployment = client.open_file(&folder.join("deployment.mal"));
    let mut texts: Vec<Text> = ["deployment.mal", "components/control.mal", "timing/p3dx.toml", "mauve.toml"]
        .iter()
        .map(|name| client.open_file(&folder.join(name)))
        .collect();
    client.idle();
    let control = deployment.text.lines().find(|line| line.contains("activity control")).unwrap().to_owned();
    let typed = [
        (0, control.as_str(), "    activity control { affinity = 1 priority = 5 period = 50 deadline = 50 }"),
        (0, "architecture ExplorationP3dxArchitecture", "architecture ExplorationP3dxArchitecture"),
        (
            1,
            "write(command, velocity);",
            "write(command, standstill(base_frame)); if a > 1 then { } else { }",
        ),
        (1, "component Control(ControlShell, ControlCore)", "component Control(ControlShell, ControlCore)"),
        (2, "\"drivers.aria_halt\"     = 0.3", "\"drivers.aria_halt\" = 0.35"),
        (3, "significance = 1e-4", "significance = 1e-4"),
    ];
    for (index, old, new) in typed {
        let whole = texts[index].text.clone();
        let start = whole.find(old).unwrap_or_else(|| panic!("no `{old}`"));
        client.replace(&mut texts[index], start..start + old.len(), "");
        for at in 0..=new.len() {
            let shown = client.hints(&texts[0].uri);
            let without: Vec<&str> = texts[0]
                .text
                .lines()
                .enumerate()
                .filter(|(_, line)| {
                    line.trim().starts_with("activity ") && !new.starts_with(line.get(..12).unwrap_or(""))
                })
                .filter(|(number, _)| !shown.iter().any(|(line, _)| *line as usize == *number))
                .map(|(_, line)| line)
                .collect();
            assert_eq!(without, [] as [&str; 0], "after `{}`", &new[..at]);
            if let Some(key) = new.get(at..=at) {
                client.replace(&mut texts[index], start + at..start + at, key);
            }
        }
        let length = texts[index].text.len();
        client.replace(&mut texts[index], 0..length, &whole);
        client.idle();
    }
}

/// The comparison of a text with the one before may not have ended when its figures are shown, and the next edit cancels it.
#[test]
fn older_figures_are_those_that_were_shown_last() {
    let mut client = robot();
    let mut text = client.open_file(&mauve_tests::models().join("p3dx/deployment.mal"));
    for _ in 0..5 {
        client.edit(&mut text, "deadline = 1000", "deadline = 990");
        client.idle();
        client.edit(&mut text, "deadline = 990", "deadline = 1000");
        assert_eq!(client.hint(&text, "activity navigation"), "! 997 / 1000 ms");
        client.edit(&mut text, "period = 1000", "period = /* */");
        assert_eq!(client.hint(&text, "activity navigation"), "… 997 / 1000 ms");
        client.edit(&mut text, "period = /* */", "period = 1000");
    }
}

#[test]
fn the_reason_follows_when_the_text_stays_incomplete() {
    let mut client = robot();
    let mut text = client.open_file(&mauve_tests::models().join("p3dx/deployment.mal"));
    client.idle();
    client.edit(&mut text, "period = 1000", "period = /* */");
    assert_eq!(client.hint(&text, "activity navigation"), "… 997 / 1000 ms");
    client.wait_for_hint(&text, "activity navigation", |hint| hint.starts_with("? syn"));
    client.edit(&mut text, "period = /* */", "period = 1000");
    assert_eq!(client.hint(&text, "activity navigation"), "! 997 / 1000 ms");
    // The user saves an incomplete text.
    client.edit(&mut text, "period = 1000", "period = /* */");
    client.idle();
    client.notify("textDocument/didSave", json!({"textDocument": {"uri": text.uri}, "text": text.text}));
    client.idle();
    assert!(client.hint(&text, "activity navigation").starts_with("? syn"));
}

#[test]
fn diagnostics_at_the_cursor_wait_for_a_pause() {
    let folder = copied_robot("lsp_typing_pause");
    let mut client = mauve_tests::Client::of_folder(MAUVE, &folder);
    let mut text = client.open_file(&folder.join("deployment.mal"));
    assert_eq!(client.diagnostics(&text), [] as [Value; 0]);
    let end = text.text.find("period = 1000").unwrap() + "period = 1000".len();
    let key = |client: &mut mauve_tests::Client, text: &mut Text, at: usize, key: &str| {
        client.replace(text, at..at, key);
        client.diagnostics(text)
    };
    let began = Instant::now();
    for (index, letter) in " foo = ".chars().enumerate() {
        let found = key(&mut client, &mut text, end + index, &letter.to_string());
        if began.elapsed() < Duration::from_millis(300) {
            assert!(
                !found.iter().any(|it| it["code"] == "syntax-error" || it["code"] == "unknown-field"),
                "{found:?}"
            );
        }
    }
    client.wait("the diagnostics of what was typed", |it| {
        it["method"] == "textDocument/publishDiagnostics" && it.to_string().contains("syntax-error")
    });
    // A change that is not typed is checked at once.
    client.edit(&mut text, " foo = ", "");
    assert_eq!(client.diagnostics(&text), [] as [Value; 0]);
    client.edit(&mut text, "period = 1000", "period = /* */");
    assert!(client.diagnostics(&text).iter().any(|it| it["code"] == "syntax-error"));
}

/// Types at random places of the robot. Older figures are in no diagnostic, no title, no lens, no hover of a name, no answer about
/// figures, and no exported file.
#[test]
fn older_figures_are_in_hints_only() {
    let folder = copied_robot("lsp_typing_leaks");
    let mut client = mauve_tests::Client::of_folder(MAUVE, &folder);
    let mut texts: Vec<Text> = ["deployment.mal", "timing/p3dx.toml", "mauve.toml"]
        .iter()
        .map(|name| client.open_file(&folder.join(name)))
        .collect();
    client.idle();
    let mut random = Random::of_seed(5 + search::seed());
    let mut older = 0_u64;
    for _ in 0..search::cases("MAUVE_TYPED", 60) {
        let index = random.below(texts.len());
        let text = &mut texts[index];
        let start = char_boundary(&text.text, random.below(text.text.len()));
        let end = char_boundary(&text.text, start + 1 + random.below(12));
        let removed = text.text[start..end].to_owned();
        client.replace(text, start..end, "");
        let mut at = start;
        for letter in removed.chars() {
            check_for_leaks(&mut client, &texts[0], &mut random);
            older += client.hints(&texts[0].uri).iter().filter(|(_, label)| has_older(label)).count() as u64;
            client.replace(&mut texts[index], at..at, &letter.to_string());
            at += letter.len_utf8();
        }
    }
    assert!(older > search::share(100), "{older}");
    client.idle();
    let hints = client.hints(&texts[0].uri);
    assert!(hints.iter().all(|(_, label)| !has_older(label)), "{hints:?}");
}

fn check_for_leaks(client: &mut mauve_tests::Client, text: &Text, random: &mut Random) {
    let document = json!({"uri": text.uri});
    let at = text.position(char_boundary(&text.text, random.below(text.text.len())));
    let range = json!({"start": at, "end": at});
    let context = json!({"diagnostics": []});
    let requests = [
        ("textDocument/hover", json!({"textDocument": document, "position": at})),
        ("textDocument/codeAction", json!({"textDocument": document, "range": range, "context": context})),
        ("textDocument/codeLens", json!({"textDocument": document})),
        ("textDocument/completion", json!({"textDocument": document, "position": at})),
        ("mauve/analysis", json!({"textDocument": document})),
        ("mauve/graph", json!({"textDocument": document})),
    ];
    for (method, params) in requests {
        let answer = client.call(method, params).map_or_else(|error| error.to_string(), |it| it.to_string());
        assert!(!has_older(&answer), "{method}: {answer}");
    }
    for (uri, found) in client.published() {
        assert!(!has_older(&found.to_string()), "{uri}: {found}");
    }
}
