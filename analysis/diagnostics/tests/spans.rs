//! Models in which a span is deleted, duplicated, moved or swapped with another: tokens, lines, bracketed groups, within a
//! file and across files. A figure may be lower afterwards, since the text may be another model; but then nothing that the
//! figure rests on has an error: neither the deployment, its architectures, the components that may run in its window, nor
//! any table or `mauve.toml`; of warnings, these may only have one about a key that names nothing.
//!
//! `MAUVE_DAMAGES=200000 cargo test --release -p mauve-diagnostics --test main spans:: -- --nocapture` tries more, and prints the kinds
//! of damage that make a figure lower.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

use mauve_diagnostics::{Finding, Severity, workspace_diagnostics};
use mauve_hir::item_tree::Kind;
use mauve_hir::{
    Database, Decl, Project, Workspace, core_of, declaration_at, features_of, flat_of, names_of, parse,
    shell_of,
};
use mauve_syntax::{SyntaxKind, SyntaxNode, TextRange};
use mauve_tests::{Random, random_model};
use mauve_timing::{Level, Method, Time};
use mauve_wcrt::{Query, response_times, system_of};

use crate::common::{deployments, sample};

/// Two architectures of one library, in two deployments; operations with arguments, values of every type, calls in calls;
/// what no table has is assumed to take next to nothing.
const TWO: &str = r#"
include "parts.mal"
architecture Small {
  instance eye: parts.Eye
  instance hand: parts.Hand
  connection eye.seen -> hand.goal
  property eye.rate = 4
}
architecture Large {
  import Small
  instance arm: parts.Hand
  instance log: parts.Log
  connection eye.far -> log.depth
  connection eye.seen -> [3] arm.goal
  property arm.gain = 1.5
  constant log.name = "large"
}
deployment Bench {
  architecture Small
  activity eye { affinity = 1 priority = 20 period = 200 deadline = 150 }
  activity hand { affinity = 1 priority = 10 period = 400 deadline = 300 }
}
deployment Field {
  architecture Large
  activity eye { affinity = 1 priority = 30 period = 250 deadline = 200 }
  activity hand { affinity = 1 priority = 20 period = 500 }
  activity arm { affinity = 2 priority = 25 period = 250 }
  activity log { affinity = 2 priority = 5 period = 1000 }
  property hand.gain = 0.5
}
//- /parts.mal
library parts {
  use cheap
  codel see(in rate: int, out near: bool): int
  codel filter(in x: int): int
  codel depth(in x: int): double
  codel grip(in force: double, inout tries: int): bool
  codel plan(): int
  codel note(in text: string, in value: double): void
  shell EyeShell {
    output port seen: int
    output port far: double
    property rate: int [1; 9] = 2
  }
  shell Holder { provide hold(in hard: bool, out tries: int): bool  provide relax(): void }
  shell HandShell extends Holder {
    input port goal: int
    property gain: double = 1.0
  }
  shell LogShell { input port depth: double  constant name: string = "log" }
  core EyeCore(EyeShell) {
    var near: bool = false
    var x: int
    update = {
      x = filter(filter(see(rate, near)));
      if near && plan() > 2 then { write(far, depth(x + 1)); } else { write(seen, filter(x)); }
      if x > 5 then { return; } else { }
      x = plan() + filter(plan());
    }
  }
  core HandCore(HandShell) {
    var tries: int = 0
    var at: int = 0
    provide hold(in hard: bool, out tries: int): bool = {
      var ok: bool = grip(2.5, tries);
      if hard then { ok = grip(depth(tries), tries); } else { }
      return ok;
    }
    provide relax() = { note("relaxed", 0.0); }
    start = { relax(); return true; }
    statemachine {
      var last: int = 0
      initial state Open {
        run = { last = filter(at); }
        transition close if read(goal, at) == new_data && plan() > last to Closed { hold(true, tries); }
        handle = { relax(); }
      }
      state Closed {
        entry = { note("closed", gain * depth(at)); }
        run = { at = plan(); }
        transition open if !hold(false, tries) || tries > 3 to Open
        transition slip if filter(at) < 1 to Closed { relax(); relax(); }
        exit = { last = filter(last); }
      }
    }
  }
  core LogCore(LogShell) {
    var d: double = 0.0
    var n: int = 0
    update = {
      n = filter(plan());
      if n > 1 then { note(name, 2.0); n = filter(n); }
      else { note("far", d); n = plan(); }
      if read(depth, d) == new_data then { note(name, d); } else { note("none", 1.0); }
    }
  }
  component Eye(EyeShell, EyeCore)
  component Hand(HandShell, HandCore)
  component Log(LogShell, LogCore)
}
library cheap {
  codel see(in rate: int, out near: bool): int
  codel plan(): int
  shell EyeShell { output port seen: int  output port far: double  property rate: int = 1 }
  core EyeCore(EyeShell) { var near: bool = false  update = { see(rate, near); plan(); } }
  component Eye(EyeShell, EyeCore)
}
//- /mauve.toml
[project]
root = "model.mal"
[timing]
tables = ["eye.toml", "hand.toml", "whole.toml"]
significance = 1e-3
[assume]
codel = "10 us"
[platform]
cpus = 2
rt_throttling = true
[generate]
out = "gen"
license = "MIT"
//- /eye.toml
levels = [1e-3, 1e-4]
[codel]
"parts.see" = [20, 21]
"parts.filter" = [3, 4]
"parts.depth" = 7
"cheap.see" = 0.5
"cheap.plan" = 0.25
//- /hand.toml
unit = "us"
levels = [1e-4, 1e-3]
[codel]
"parts.grip" = [9500, 9000]
"parts.plan" = [
  5100,
  5000,
]
[program]
"parts.Hand/Open.close.guard" = [31000, 30000]
"parts.Hand/relax" = 2000
//- /whole.toml
[component]
"parts.Hand" = 80
[program]
"parts.Hand/Closed.entry" = 12
[overhead]
dispatch = 0.125
context_switch = 0.0625
"#;

#[test]
fn no_figure_of_the_sample_falls_where_an_error_stands() {
    damage(&mauve_tests::models().join("p3dx"), &sample(), 0);
}

#[test]
fn nor_one_of_two_architectures() {
    let texts = mauve_tests::fixture(TWO).into_iter();
    damage(Path::new("/"), &texts.map(|(path, text)| (path.into(), text)).collect::<Vec<_>>(), 1);
}

#[test]
fn nor_where_everything_stands_on_one_line() {
    let one_line = |(path, text): (String, String)| {
        let text = if path.ends_with(".mal") { text.replace('\n', " ") } else { text };
        (PathBuf::from(path), text)
    };
    damage(Path::new("/"), &mauve_tests::fixture(TWO).into_iter().map(one_line).collect::<Vec<_>>(), 2);
}

#[test]
fn nor_one_of_random_models() {
    let texts = (0..).map(|seed| (seed, random_model(seed).texts()));
    // In some, one served operation takes all figures.
    let with_figures = texts.filter(|(_, texts)| {
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), texts.iter().cloned());
        responses(&db, workspace).values().flatten().count() > 2
    });
    for (seed, texts) in with_figures.take(MODELS) {
        damage_times(Path::new("/"), &texts, seed + 3, damages() / MODELS as u64);
    }
}

const MODELS: usize = 10;

fn damages() -> u64 {
    std::env::var("MAUVE_DAMAGES").map_or(600, |count| count.parse().expect("a number"))
}

fn damage(folder: &Path, texts: &[(PathBuf, String)], seed: u64) {
    damage_times(folder, texts, seed, damages());
}

fn damage_times(folder: &Path, texts: &[(PathBuf, String)], seed: u64, damages: u64) {
    let mut db = Database::default();
    let workspace = Workspace::of_texts(&db, folder.to_owned(), texts.iter().cloned());
    let whole = responses(&db, workspace);
    let findings = workspace_diagnostics(&db, workspace);
    let errors: Vec<_> = findings.iter().filter(|it| it.diagnostic.code.is_of_text()).collect();
    assert!(errors.is_empty(), "{errors:?}");
    assert!(whole.values().flatten().count() > 2, "there are figures");
    let (mut lost, mut kept) = (0, 0);
    let mut lower: BTreeMap<String, u64> = BTreeMap::new();
    for number in 0..damages {
        let start = 0x9e37_79b9_7f4a_7c15 ^ ((seed << 40) + number + 1).wrapping_mul(0xd134_2543_de82_ef95);
        let mut random = Random(start);
        let (damaged, what) = damage_once(texts, &mut random);
        for (path, text) in texts.iter().zip(&damaged).filter(|((_, old), new)| old != *new) {
            let file = workspace.file(&db, &path.0).unwrap();
            file.set_text(&mut db, text.as_str().into());
        }
        let now = responses(&db, workspace);
        let fallen = now.iter().filter(|(activity, response)| {
            let old = whole.get(*activity).copied().flatten();
            response.is_some_and(|response| old.is_some_and(|old| response < old))
        });
        let fallen: Vec<&Activity> = fallen.map(|(activity, _)| activity).collect();
        lost += whole
            .iter()
            .filter(|(activity, old)| old.is_some() && now.get(*activity).is_none_or(Option::is_none))
            .count();
        kept += now.values().flatten().count();
        if !fallen.is_empty() {
            let found = workspace_diagnostics(&db, workspace);
            let mut warnings = BTreeSet::new();
            for activity in fallen {
                for finding in found.iter().filter(|finding| rests_on(&db, workspace, activity, finding)) {
                    let (code, is_table) = (finding.diagnostic.code, is_table(&db, finding));
                    assert!(
                        code.severity == Severity::Warning
                            && (!is_table || code.name == "unknown-timing-key"),
                        "seed {seed}, damage {number}: {what}\n{activity:?} was {:?}, is {:?}, and there is {}: {}\n{}",
                        whole[activity],
                        now[activity],
                        code.name,
                        finding.diagnostic.message,
                        shown(texts, &damaged)
                    );
                    warnings.insert(code.name);
                }
            }
            // What has an error elsewhere was moved there.
            let is_error = |it: &&Finding<'_>| it.diagnostic.code.severity == Severity::Error;
            let elsewhere = found.iter().filter(is_error).map(|it| it.diagnostic.code.name);
            let kind: Vec<&str> = warnings.into_iter().collect();
            let kind = if kind.is_empty() { "another model".to_owned() } else { kind.join(", ") };
            let elsewhere: BTreeSet<&str> = elsewhere.filter(|code| *code != "deadline-missed").collect();
            let kind = if elsewhere.is_empty() { kind } else { format!("{kind}, and an error elsewhere") };
            if kind.contains("elsewhere") && std::env::var_os("MAUVE_SHOW").is_some() {
                println!("{what}: {elsewhere:?}");
            }
            *lower.entry(kind).or_default() += 1;
        }
        for (path, text) in
            texts.iter().zip(&damaged).filter(|((_, old), new)| old != *new).map(|(old, _)| old)
        {
            let file = workspace.file(&db, path).unwrap();
            file.set_text(&mut db, text.as_str().into());
        }
    }
    println!(
        "{}: {damages} damages; figures: {lost} gone, {kept} there; damages with a lower one, by warning: {lower:?}",
        folder.display()
    );
    assert!(lost > damages as usize / 4 && kept > damages as usize / 8, "{lost} lost, {kept} kept");
}

/// What has changed in a damaged text.
fn shown(texts: &[(PathBuf, String)], damaged: &[String]) -> String {
    let changed = texts.iter().zip(damaged).filter(|((_, old), new)| old != *new);
    changed.map(|((path, _), new)| format!("//- {}\n{new}\n", path.display())).collect()
}

fn is_table(db: &Database, finding: &Finding<'_>) -> bool {
    finding.diagnostic.at.file(db).path(db).extension().is_some_and(|it| it == "toml")
}

/// A deployment, an instance, a method.
type Activity = (String, String, &'static str);

const METHODS: [(Method, &str); 2] = [(Method::Psm, "psm"), (Method::Classic, "classic")];

fn responses(db: &Database, workspace: Workspace) -> BTreeMap<Activity, Option<Time>> {
    let mut responses = BTreeMap::new();
    for (project, deployment) in deployments(db, workspace) {
        for (method, name) in METHODS {
            let query = Query { level: Level::from_f64(1e-3).unwrap(), method, horizon: None };
            for activity in &response_times(db, project, deployment, query).activities {
                let key = (deployment.name(db).to_string(), activity.instance.to_string(), name);
                responses.insert(key, activity.response);
            }
        }
    }
    responses
}

/// Does the figure of an activity rest on the place of an error or a warning?
fn rests_on(
    db: &Database,
    workspace: Workspace,
    (deployment, instance, _): &Activity,
    finding: &Finding<'_>,
) -> bool {
    let diagnostic = &finding.diagnostic;
    // Of figures, it is a consequence.
    let of_figures = ["deadline-missed", "missing-time", "not-analysed"].contains(&diagnostic.code.name);
    if diagnostic.code.severity == Severity::Hint || of_figures {
        return false;
    }
    if is_table(db, finding) {
        return true;
    }
    let (file, start) = (diagnostic.at.file(db), diagnostic.at.range(db).start());
    let Some(decl) = declaration_at(db, file, TextRange::empty(start)) else { return true };
    // What stands in an item is about the instances that it names.
    let token = parse(db, file).syntax().token_at_offset(start).right_biased();
    let is_item = |node: &SyntaxNode| {
        let list = node.parent().map(|list| list.kind());
        matches!(list, Some(SyntaxKind::ARCHITECTURE | SyntaxKind::DEPLOYMENT))
    };
    let item = token.and_then(|token| token.parent_ancestors().find(is_item));
    let tokens = item.into_iter().flat_map(|item| item.descendants_with_tokens());
    let words: HashSet<String> = tokens.filter_map(|it| Some(it.into_token()?.text().to_owned())).collect();
    let is_own = |(_, decl): &(Project<'_>, Decl<'_>)| *decl.name(db) == **deployment;
    deployments(db, workspace).into_iter().filter(is_own).any(|(project, deployment)| {
        let (places, delaying) = resting_places(db, project, deployment, instance);
        let activities = &system_of(db, project, deployment).activities;
        let mut named = activities.iter().filter(|it| words.contains(it.instance.as_str())).peekable();
        let is_about = named.peek().is_none() || named.any(|it| delaying.contains(it.instance.as_str()));
        places.contains(&decl) && is_about
    })
}

/// The declarations that the figure of an activity rests on, and the activities that may run in its window.
fn resting_places<'db>(
    db: &'db Database,
    project: Project<'db>,
    deployment: Decl<'db>,
    instance: &str,
) -> (HashSet<Decl<'db>>, HashSet<&'db str>) {
    let system = system_of(db, project, deployment);
    let mut places = HashSet::from([deployment]);
    let names = names_of(db, project);
    places.extend(names.all.iter().filter(|decl| decl.kind(db) == Kind::Codel));
    if let Some(architecture) =
        mauve_hir::deployment(db, deployment).and_then(|data| data.targets.first()).and_then(|target| {
            mauve_hir::resolve_type(db, project, deployment, Kind::Architecture, Some(target)).ok()
        })
    {
        places.extend(&flat_of(db, project, architecture).architectures);
    }
    let mut activities = HashSet::new();
    let Some(of) = system.activities.iter().find(|it| it.instance == instance) else {
        return (places, activities);
    };
    let key = |priority| match priority {
        mauve_wcrt::Priority::RealTime(priority) => priority,
        mauve_wcrt::Priority::Background => 0,
        mauve_wcrt::Priority::Unknown => u32::MAX,
    };
    let meets = |a: Option<u64>, b: Option<u64>| a.unwrap_or(u64::MAX) & b.unwrap_or(u64::MAX) != 0;
    for other in system
        .activities
        .iter()
        .filter(|other| key(other.priority) >= key(of.priority) && meets(other.cpus, of.cpus))
    {
        activities.insert(other.instance.as_str());
        let Some(component) = other.component else { continue };
        places.insert(component);
        places.extend(core_of(db, project, component));
        if let Some(shell) = shell_of(db, project, component) {
            places.insert(shell);
            places.extend(&features_of(db, project, shell).shells);
        }
    }
    (places, activities)
}

// Damage.

/// The texts with one span of one of them deleted, duplicated, moved or swapped with another; and what was done.
fn damage_once(texts: &[(PathBuf, String)], random: &mut Random) -> (Vec<String>, String) {
    let mut damaged: Vec<String> = texts.iter().map(|(_, text)| text.clone()).collect();
    let file = random.below(texts.len());
    let other = if random.below(4) == 0 { random.below(texts.len()) } else { file };
    let unit = random.below(3);
    let span = span(&texts[file].1, unit, random);
    let piece = texts[file].1[span.clone()].to_owned();
    let name = |file: usize| texts[file].0.file_name().unwrap().to_string_lossy().into_owned();
    let place = |file: usize, at: usize| {
        let line = texts[file].1[..at].matches('\n').count() + 1;
        format!("{}:{line}", name(file))
    };
    let from = place(file, span.start);
    let what = match random.below(4) {
        0 => {
            damaged[file].replace_range(span, "");
            format!("{from}: {piece:?} is gone")
        }
        kind @ (1 | 2) => {
            let lexed = mauve_syntax::lex(&texts[other].1);
            let at = lexed.range(random.below(lexed.len().max(1))).start;
            let inside = other == file && span.start < at && at < span.end;
            let at = if inside { span.end } else { at };
            let put = format!(" {piece} ");
            // What stands further behind first.
            if kind == 2 && other == file && at <= span.start {
                damaged[file].replace_range(span, "");
                damaged[file].insert_str(at, &put);
            } else {
                damaged[other].insert_str(at, &put);
                if kind == 2 {
                    damaged[file].replace_range(span, "");
                }
            }
            let verb = if kind == 1 { "also stands" } else { "stands" };
            format!("{from}: {piece:?} {verb} at {}", place(other, at))
        }
        _ => {
            let second = self::span(&texts[other].1, unit, random);
            let put = texts[other].1[second.clone()].to_owned();
            let overlap = other == file && span.start < second.end && second.start < span.end;
            let what = format!("{from}: {piece:?} and {}: {put:?} are swapped", place(other, second.start));
            match (other == file, overlap) {
                (true, true) => damaged[file].replace_range(span, ""),
                (true, false) if second.start < span.start => {
                    damaged[file].replace_range(span, &put);
                    damaged[file].replace_range(second, &piece);
                }
                _ => {
                    damaged[other].replace_range(second, &piece);
                    damaged[file].replace_range(span, &put);
                }
            }
            what
        }
    };
    (damaged, what)
}

/// Some tokens, some lines, or what brackets enclose, at times without them.
fn span(text: &str, unit: usize, random: &mut Random) -> Range<usize> {
    let lexed = mauve_syntax::lex(text);
    if lexed.is_empty() {
        return 0..0;
    }
    let first = random.below(lexed.len());
    let tokens = |count: usize| {
        let last = (first + count).min(lexed.len() - 1);
        lexed.range(first).start..lexed.range(last).end
    };
    match unit {
        0 => tokens(random.below(6)),
        1 => {
            let at = lexed.range(first).start;
            let start = text[..at].rfind('\n').map_or(0, |at| at + 1);
            let count = 1 + random.below(4);
            let end =
                text[start..].match_indices('\n').nth(count - 1).map_or(text.len(), |(at, _)| start + at + 1);
            start..end
        }
        _ => {
            let bracket = |index: usize| &text[lexed.range(index)];
            let Some(open) = (first..lexed.len()).find(|&it| matches!(bracket(it), "{" | "(" | "[")) else {
                return tokens(1);
            };
            let mut depth = 0;
            let close = (open..lexed.len()).find(|&it| {
                match bracket(it) {
                    "{" | "(" | "[" => depth += 1,
                    "}" | ")" | "]" => depth -= 1,
                    _ => {}
                }
                depth == 0
            });
            let Some(close) = close else { return tokens(2) };
            let (open, close) = (lexed.range(open), lexed.range(close));
            match random.below(3) {
                0 => open.end..close.start,
                1 => open.start..close.end,
                // With what stands before it, such as `f(…)` or `state A { … }`.
                _ => {
                    let before = (0..first).rev().find(|&it| matches!(bracket(it), ";" | "{" | "}" | "\n"));
                    before.map_or(open.start, |it| lexed.range(it).end).min(open.start)..close.end
                }
            }
        }
    }
}
