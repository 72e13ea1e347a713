//! Damaged models: one token of the sample robot, and of a smaller one, is taken away, put in, or replaced by a word that
//! means nothing, or a line loses its end. Where that is an error, whatever still has a response time has at least that of
//! the whole model: nothing is analysed that rests on what was lost. And the database says what a new one would say.
//!
//! `MAUVE_DAMAGES=20000 cargo test --release -p mauve-diagnostics --test main damage::` tries more.

use mauve_diagnostics::{Finding, Severity};
use mauve_tests::search;

use crate::damaged::{Project, token};

/// Everything that costs has a cheap namesake in another library; operations, overrides and overhead have their part.
pub(crate) const NAMESAKES: &str = r#"
include "parts.mal"
library far {
  architecture Base { }
}
architecture Base {
  instance a: near.C
  instance d: C2
}
architecture A {
  import Base
  instance b: far.C
  instance c: far.C
  connection a.out1 -> a.in1
  property a.p = 2
}
component C2(near.S, near.K)
deployment D {
  architecture A
  activity a { affinity = 1 priority = 5 period = 500 deadline = 400 }
  activity b { affinity = 1 priority = 9 period = 500 }
  activity c { priority = 3 affinity = 2 period = 500 }
  activity d { priority = background }
  property a.p = 3
}
//- /parts.mal
library near {
  use far
  codel f(in x: int): int
  codel g(): int
  shell Base { input port in1: int  output port out1: int }
  shell S extends Base {
    property p: int = 1
    provide help(): int
  }
  core K(S) {
    var v: int = 0;
    provide help() = { v = g(); return v; }
    start = { v = 1; }
    statemachine {
      var n: int = 0;
      initial state A {
        run = { if f(v) > 1 then { help(); } else { v = f(2); } }
        transition t if g() > 0 && v < 3 to B { write(out1, v); }
      }
      state B {
        entry = { f(v); }
        exit = { g(); }
        transition back to A
      }
    }
  }
  component C(S, K)
}
library far {
  codel f(in x: int): int
  codel g(): int
  shell S { }
  core K(S) { update = { f(1); g(); } }
  component C(S, K)
}
component C(far.S, far.K)
//- /mauve.toml
[project]
root = "model.mal"
[timing]
tables = ["times.toml", "more.toml"]
significance = 1e-3
[assume]
codel = "1 us"
[lints]
not-deadline-monotonic = "allow"
[platform]
cpus = 2
//- /times.toml
unit = "ms"
levels = [1e-3, 1e-4]
[codel]
"near.f" = [20, 21]
"near.g" = 5
"far.f" = 0.5
"far.g" = 0.25
[overhead]
dispatch = 0.125
context_switch = 0.0625
//- /more.toml
[program]
"near.C/B.entry" = 90
[component]
"near.C" = 120
"#;

/// All fields of activities: releases by data, rates, lists of CPUs, a thread of several instances, two clocks.
const FIELDS: &str = r#"
codel look(out n: int): bool
codel plan(in n: int): int
codel far(in n: int): int
shell Eye { output port seen: int }
shell Leg { input port goal: int  output port done: int }
core EyeCore(Eye) { var n: int = 0  update = { if look(n) then { write(seen, n); } } }
core LegCore(Leg) {
  var n: int = 0
  var left: int = 0
  update = {
    if read(goal, n) == new_data then { write(done, plan(n)); }
    if left == 0 then { n = far(n); left = 4; } else { left = left - 1; }
  }
}
component Camera(Eye, EyeCore)
component Base(Leg, LegCore)
architecture Robot {
  instance camera: Camera
  instance rear: Camera
  instance base: Base
  instance arm: Base
  instance log: Base
  connection camera.seen -> base.goal
  connection base.done -> arm.goal
  connection rear.seen -> log.goal
}
deployment D {
  architecture Robot
  activity eyes { instances = [camera, rear]  priority = 9  rate = 50 Hz  cpus = [1] }
  activity base { trigger = goal  least = 20  burst = 2  priority = 8  deadline = 90  cpus = big }
  activity arm { trigger = goal  least = 50  priority = 7 }
  activity log { period = 1000/10  jitter = 1/4  deadline = 250  offset = 5  priority = 5  cpus = [1, 2] }
}
//- /mauve.toml
[timing]
tables = ["times.toml"]
[platform]
cpus = 2
cpu_sets.big = [1]
rt_throttling = false
[[platform.other]]
name = "lan"
priority = 10
cpus = [1]
rate = "10 Hz"
time = "1 ms"
burst = 2
[lints]
deadline-exceeds-period = "allow"
[clocks]
synchronised = ["camera", "rear"]
[clocks.drive]
instances = ["log"]
//- /times.toml
[codel]
look = 2
plan = 3
far = 4
"#;

#[test]
fn what_still_has_a_bound_has_at_least_the_old_one() {
    damage(&Project::sample("p3dx"), 18);
}

#[test]
fn a_namesake_is_never_taken_instead() {
    damage(&Project::fixture(NAMESAKES), 6);
}

#[test]
fn nor_where_everything_stands_on_one_line() {
    damage(&Project::fixture(NAMESAKES).on_one_line(), 6);
}

#[test]
fn nor_a_figure_of_any_field_of_an_activity() {
    damage(&Project::fixture(FIELDS), 10);
}

fn damage(project: &Project, analysed: usize) {
    let damages: u64 = search::cases("MAUVE_DAMAGES", 600);
    let whole = project.responses(|it| it.severity == Severity::Error);
    assert_eq!(whole.values().flatten().count(), analysed, "activities, for both methods");
    let (mut lost, mut kept) = (0, 0);
    project.damage(
        (damages, 0),
        false,
        |texts, random| {
            // Several of them may make another model that means something: then nothing is said of its figures.
            let more = if random.below(8) == 0 { 1 + random.below(4) } else { 0 };
            (0..=more).map(|_| token(texts, random)).collect()
        },
        |damaged| {
            let (found, now) = (damaged.findings(), damaged.responses());
            damaged.compare_with_new_database();
            // A codel with another name is another codel, which is no error; in a table everything that is noticed counts.
            let is_error = |it: &Finding<'_>| it.diagnostic.code.severity == Severity::Error;
            let is_noticed = found.iter().any(is_error)
                || damaged.is_in_table && found.iter().any(|it| it.severity != Severity::Hint);
            if !is_noticed || damaged.done.len() > 1 {
                return;
            }
            lost += now.values().filter(|response| response.is_none()).count();
            for (activity, response) in now.iter().filter_map(|(it, response)| Some((it, (*response)?))) {
                kept += 1;
                let old = whole.get(activity).copied().flatten();
                let is_at_least = old.is_some_and(|old| response >= old);
                assert!(is_at_least, "{activity:?} was {old:?}, is {response:?}");
            }
        },
    );
    assert!(
        lost > damages as usize / 4 && kept > damages as usize / 8,
        "damage costs something, and not everything: {lost} lost, {kept} kept"
    );
}
