//! Models in which a span is deleted, duplicated, moved or swapped with another: tokens, lines, bracketed groups, within a
//! file and across files. A figure may be lower afterwards, since the text may be another model; but then nothing that the
//! figure rests on has an error: neither the deployment, its architectures, the components that may run in its window, nor
//! any table or `mauve.toml`; of warnings, these may only have one about a key that names nothing.
//!
//! `MAUVE_DAMAGES=200000 cargo test --release -p mauve-diagnostics --test main spans:: -- --nocapture` tries more, and
//! prints the kinds of damage that make a figure lower.

use mauve_timing::CpuSet;
use std::collections::{BTreeMap, BTreeSet, HashSet};

use mauve_diagnostics::{Finding, Severity};
use mauve_hir::item_tree::Kind;
use mauve_hir::{
    Database, Decl, Project as HirProject, Workspace, core_of, declaration_at, features_of, flat_of,
    names_of, parse, shell_of,
};
use mauve_syntax::{SyntaxKind, SyntaxNode, TextRange};
use mauve_wcrt::system_of;

use crate::common::deployments;
use mauve_tests::search;

use crate::damaged::{self, Activity, Project, span};

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
    damage(&Project::sample("p3dx"), (damages(), 0));
}

#[test]
fn nor_one_of_two_architectures() {
    damage(&Project::fixture(TWO), (damages(), 1));
}

#[test]
fn nor_where_everything_stands_on_one_line() {
    damage(&Project::fixture(TWO).on_one_line(), (damages(), 2));
}

#[test]
fn nor_one_of_random_models() {
    let projects = (0..).map(|seed| (seed, Project::random(seed)));
    // In some, one served operation takes all figures.
    let with_figures =
        projects.filter(|(_, project)| project.responses(|_| false).values().flatten().count() > 2);
    for (seed, project) in with_figures.take(MODELS) {
        damage(&project, (damages() / MODELS as u64, seed + 3));
    }
}

const MODELS: usize = 10;

fn damages() -> u64 {
    search::cases("MAUVE_DAMAGES", 600)
}

fn damage(project: &Project, cases: (u64, u64)) {
    let whole = project.responses(|it| it.diagnostic.code.is_of_text());
    assert!(whole.values().flatten().count() > 2, "there are figures");
    let (mut lost, mut kept) = (0, 0);
    let mut lower: BTreeMap<String, u64> = BTreeMap::new();
    project.damage(
        cases,
        false,
        |texts, random| vec![span(texts, random)],
        |damaged| {
            let (db, now) = (damaged.db, damaged.responses());
            let has_figure = |activity: &Activity| now.get(activity).is_some_and(Option::is_some);
            lost += whole.iter().filter(|(activity, old)| old.is_some() && !has_figure(activity)).count();
            kept += now.values().flatten().count();
            let fallen = now.iter().filter(|(activity, response)| {
                let old = whole.get(*activity).copied().flatten();
                response.is_some_and(|response| old.is_some_and(|old| response < old))
            });
            let fallen: Vec<&Activity> = fallen.map(|(activity, _)| activity).collect();
            if fallen.is_empty() {
                return;
            }
            let found = damaged.findings();
            let mut warnings = BTreeSet::new();
            for activity in fallen {
                for finding in found.iter().filter(|it| rests_on(db, damaged.workspace, activity, it)) {
                    let code = finding.diagnostic.code;
                    assert!(
                        code.severity == Severity::Warning
                            && (!is_table(db, finding)
                                || ["unknown-timing-key", "overloading-times"].contains(&code.name)),
                        "{activity:?} was {:?}, is {:?}, and there is {}: {}",
                        whole[activity],
                        now[activity],
                        code.name,
                        finding.diagnostic.message
                    );
                    warnings.insert(code.name);
                }
            }
            // What has an error elsewhere was moved there.
            let is_error = |it: &&Finding<'_>| it.diagnostic.code.severity == Severity::Error;
            let elsewhere = found.iter().filter(is_error).map(|it| it.diagnostic.code.name);
            let elsewhere: BTreeSet<&str> = elsewhere.filter(|code| *code != "deadline-missed").collect();
            let kind: Vec<&str> = warnings.into_iter().collect();
            let kind = if kind.is_empty() { "another model".to_owned() } else { kind.join(", ") };
            let kind = if elsewhere.is_empty() { kind } else { format!("{kind}, and an error elsewhere") };
            if !elsewhere.is_empty() && std::env::var_os("MAUVE_SHOW").is_some() {
                println!("{}: {elsewhere:?}", damaged.done[0]);
            }
            *lower.entry(kind).or_default() += 1;
        },
    );
    println!(
        "{cases:?}: figures: {lost} gone, {kept} there; damages with a lower one, by warning: {lower:?}"
    );
    let count = cases.0 as usize;
    assert!(lost > count / 4 && kept > count / 8, "{lost} lost, {kept} kept");
}

fn is_table(db: &Database, finding: &Finding<'_>) -> bool {
    damaged::is_table(finding.diagnostic.at.file(db).path(db))
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
    let is_own = |(_, decl): &(HirProject<'_>, Decl<'_>)| *decl.name(db) == **deployment;
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
    project: HirProject<'db>,
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
    let meets =
        |a: Option<CpuSet>, b: Option<CpuSet>| a.unwrap_or(CpuSet::ALL).meets(b.unwrap_or(CpuSet::ALL));
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
