//! `tune` finds values wherever brute force does, and the figures that it promises are those of the edited text.
//!
//! The systems are random: two to seven activities with state machines, threads, locks, waits, operations, sets of CPUs, jitter, deadlines
//! beyond the period, other work. Brute force shares nothing with the search but the analysis of one deployment with given values.
//!
//! `MAUVE_TUNED=5000 cargo test --release -p mauve-ide --test main tune::` tries more systems.

use std::fmt::Write as _;
use std::path::PathBuf;

use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Decl, Project, Workspace, names_of, projects};
use mauve_ide::{compared, edit_of_fields};
use mauve_syntax::keywords::ActivityField;
use mauve_tests::{Random, search};
use mauve_timing::Status;
use mauve_wcrt::tune::{SearchKind, TuneAim, TuneRequest, tune};
use mauve_wcrt::{Query, WhatIfField, response_times_if};

const NAMES: [&str; 7] = ["a", "b", "c", "d", "e", "f", "g"];

/// A random system.
struct Robot {
    texts: Vec<(PathBuf, String)>,
    /// The activities, by the instance that names them in an edit.
    activities: Vec<String>,
    cpus: usize,
}

/// Returns the system of a seed.
fn robot(seed: u64) -> Robot {
    let mut random = Random::of_seed(seed);
    let count = *random.of(&[2, 3, 3, 4, 4, 4, 5, 5, 5, 6, 7]);
    let cpus = *random.of(&[1, 1, 1, 2, 2, 3]);
    // The utilisation that the activities have together, in percent of all CPUs: about where some orders meet all deadlines.
    let all = (40 + random.below(45)) * cpus;
    let (mut model, mut table) = (String::new(), String::from("unit = \"ms\"\n[codel]\n"));
    let (mut waits, mut deployment) = (String::new(), String::new());
    let mut architecture = String::from("architecture A {");
    let mut operations = Vec::new();
    let mut periods: Vec<usize> = Vec::new();
    let has_waits = random.below(4) == 0;
    let has_operations = random.below(4) == 0;
    let has_threads = random.below(4) == 0;
    for (index, name) in NAMES.iter().take(count).enumerate() {
        let period = *random.of(&[10, 20, 20, 25, 40, 50, 100]);
        let share = all * (50 + random.below(100)) / 100 / count;
        let cost = (period * share * 10 / 100).clamp(1, period * 10);
        let _ = write!(architecture, " instance {name}: K_{name}");
        let _ =
            writeln!(model, "codel {name}_run(): bool\ncodel {name}_less(): bool\ncodel {name}_call(): int");
        let _ = writeln!(
            table,
            "{name}_run = {}.{}\n{name}_less = {}.{}",
            cost / 10,
            cost % 10,
            cost / 30,
            cost / 3 % 10
        );
        let _ = writeln!(table, "{name}_call = 0.{}", 1 + random.below(9));
        if has_waits && random.below(3) == 0 {
            let _ = writeln!(waits, "{name}_less = {}.{}", cost / 50, 1 + random.below(9));
        }
        // An earlier instance provides an operation; a later one calls it.
        let client_of = (has_operations && index > 0 && random.below(2) == 0).then(|| random.below(index));
        let required = if client_of.is_some() { format!("require {name}_of(): int") } else { String::new() };
        let _ = writeln!(model, "shell S_{name} {{ provide {name}_op(): int {required} }}");
        let call = if client_of.is_some() { "asked = send(called); " } else { "" };
        let handler = if client_of.is_some() { format!("handler asked: {name}_of;") } else { String::new() };
        let call = call.replace("called", &format!("{name}_of"));
        let body = match random.below(3) {
            0 => format!(
                "statemachine {{ initial state First {{ run = {{ done = {name}_run(); {call}}} transition on if (done) to Second }}
                 state Second {{ run = {{ done = {name}_less(); }} transition back to First }} }}"
            ),
            _ => format!("update = {{ done = {name}_run(); {call}if (done) then {{ done = {name}_less(); }} else {{}} }}"),
        };
        let _ = writeln!(
            model,
            "core C_{name}(S_{name}) {{ var done: bool = false; {handler} provide {name}_op(): int = {{ return {name}_call(); }} {body} }}
             component K_{name}(S_{name}, C_{name})"
        );
        operations.extend(
            client_of.map(|of| format!("operation {}.{}_op -> {name}.{name}_of", NAMES[of], NAMES[of])),
        );
        periods.push(period);
    }
    for operation in operations {
        let _ = write!(architecture, " {operation}");
    }
    let mut activities = Vec::new();
    let mut index = 0;
    while index < count {
        let members = if has_threads && index + 1 < count && random.below(3) == 0 { 2 } else { 1 };
        let period = periods[index];
        let first = NAMES[index];
        let mut fields = format!("period = {period}");
        match random.below(8) {
            0 => fields += &format!(" deadline = {}", period * 3 / 2),
            1 | 2 => fields += &format!(" deadline = {}", (period * (60 + random.below(40)) / 100).max(1)),
            _ => {}
        }
        if random.below(8) == 0 {
            fields += " jitter = 0.5";
        }
        if random.below(6) > 0 {
            fields = format!("priority = {} {fields}", 1 + random.below(count + 1));
        }
        match random.below(5) {
            0 => {}
            1 => fields = format!("affinity = {} {fields}", (1 << cpus) - 1),
            _ => fields = format!("affinity = {} {fields}", 1 << random.below(cpus)),
        }
        let list =
            if members > 1 { format!("instances = [{first}, {}] ", NAMES[index + 1]) } else { String::new() };
        let name = if members > 1 { format!("thread_{first}") } else { first.to_owned() };
        let _ = writeln!(deployment, "  activity {name} {{ {list}{fields} }}");
        activities.push(first.to_owned());
        index += members;
    }
    let mut config = format!(
        "[timing]\ntables = [\"times.toml\"]\n[platform]\ncpus = {cpus}\nrt_throttling = {}\n",
        random.below(6) == 0
    );
    if random.below(6) == 0 {
        let _ = writeln!(
            config,
            "[[platform.other]]\nname = \"net\"\npriority = {}\nperiod = \"10 ms\"\ntime = \"0.5 ms\"\ncpus = [1]",
            1 + random.below(8)
        );
    }
    if random.below(3) == 0 {
        let users: Vec<String> = NAMES
            .iter()
            .take(count)
            .filter(|_| random.below(2) == 0)
            .map(|it| format!("\"{it}_run\""))
            .collect();
        if !users.is_empty() {
            let protocol = random.of(&["inheritance", "ceiling", "ceiling", "none"]);
            let _ = writeln!(
                config,
                "[locks.bus]\ncodels = [{}]\nprotocol = \"{protocol}\"\nheld = \"0.{} ms\"",
                users.join(", "),
                1 + random.below(9)
            );
        }
    }
    let files = [
        ("/robot.mal", format!("{model}{architecture} }}\ndeployment D {{ architecture A\n{deployment}}}\n")),
        ("/mauve.toml", config),
        ("/times.toml", if waits.is_empty() { table } else { format!("{table}[wait]\n{waits}") }),
    ];
    Robot { texts: files.map(|(path, text)| (path.into(), text)).into(), activities, cpus }
}

/// What is analysed with given values.
struct Analysed<'db> {
    db: &'db Database,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
}

impl Analysed<'_> {
    fn is_met(&self, fields: &[WhatIfField]) -> bool {
        response_times_if(self.db, self.project, self.of, self.query, fields).schedulable()
    }
}

fn field(instance: &str, field: ActivityField, value: usize) -> WhatIfField {
    WhatIfField { instance: instance.into(), field, value: value.to_string().into() }
}

/// Returns the first order of priorities from `low` on that meets every deadline, of all orders.
fn order_by_force(
    it: &Analysed<'_>,
    left: &mut Vec<&str>,
    chosen: &mut Vec<WhatIfField>,
    numbers: &[usize],
) -> bool {
    let Some((number, numbers)) = numbers.split_first() else { return left.is_empty() && it.is_met(chosen) };
    for index in 0..left.len() {
        let name = left.remove(index);
        chosen.push(field(name, ActivityField::Priority, *number));
        if order_by_force(it, left, chosen, numbers) {
            return true;
        }
        chosen.pop();
        left.insert(index, name);
    }
    false
}

/// Returns whether a placement of the activities on CPUs meets every deadline, of all placements.
fn placement_by_force(
    it: &Analysed<'_>,
    left: &[String],
    chosen: &mut Vec<WhatIfField>,
    cpus: usize,
) -> bool {
    let Some((name, left)) = left.split_first() else { return it.is_met(chosen) };
    for cpu in 0..cpus {
        chosen.push(field(name, ActivityField::Affinity, 1 << cpu));
        if placement_by_force(it, left, chosen, cpus) {
            return true;
        }
        chosen.pop();
    }
    false
}

/// The systems that were compared with brute force.
#[derive(Debug, Default)]
struct Counted {
    met_before: usize,
    orders: usize,
    no_orders: usize,
    placements: usize,
    no_placements: usize,
    conflicts: usize,
    applied: usize,
}

#[test]
fn what_brute_force_finds_is_found() {
    let mut counted = Counted::default();
    for seed in search::seeds("MAUVE_TUNED", 40) {
        let Robot { texts, activities, cpus } = robot(seed);
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), texts.clone());
        let project = projects(&db, workspace)[0];
        let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let query = Query::shown(&db, project, of);
        let it = Analysed { db: &db, project, of, query };
        let text = || texts.iter().map(|(_, text)| text.as_str()).collect::<Vec<_>>().join("\n");
        let request = |priorities, cpus| TuneRequest {
            priorities,
            cpus,
            periods: false,
            aim: TuneAim::Deadlines,
            pins: Vec::new(),
            partly: false,
            most_steps: TuneRequest::STEPS_OF_COMMAND,
        };
        counted.met_before += usize::from(it.is_met(&[]));
        let found = tune(&db, project, of, query, &request(true, false));
        let found = found.unwrap_or_else(|why| panic!("seed {seed}: {why:?}\n{}", text()));
        assert_eq!(it.is_met(&found.fields), found.is_met, "seed {seed}\n{}", text());
        if found.is_met {
            counted.orders += 1;
        } else {
            counted.no_orders += 1;
            // Around other work of a fixed priority, there are more orders: its number is between any two of these.
            let other = texts[1]
                .1
                .split("priority = ")
                .nth(1)
                .and_then(|it| it.lines().next()?.parse::<usize>().ok());
            for below in 0..=other.map_or(0, |_| activities.len()) {
                let numbers: Vec<usize> = match other {
                    None => (1..=activities.len()).collect(),
                    Some(other) if other <= below => continue,
                    Some(other) => (1..=below).chain(other + 1..).take(activities.len()).collect(),
                };
                let mut left: Vec<&str> = activities.iter().map(String::as_str).collect();
                let mut chosen = Vec::new();
                let is_found = order_by_force(&it, &mut left, &mut chosen, &numbers);
                assert!(!is_found, "seed {seed}: {chosen:?}\n{found:?}\n{}", text());
            }
            assert_ne!(found.search, SearchKind::Exhausted, "seed {seed}");
        }
        counted.conflicts += usize::from(found.conflict.is_some());
        if seed % 10 == 0 {
            counted.applied += usize::from(!found.fields.is_empty());
            promised(&it, &found.fields, &text());
        }
        if cpus == 1 {
            continue;
        }
        let both = tune(&db, project, of, query, &request(true, true)).unwrap();
        assert_eq!(it.is_met(&both.fields), both.is_met, "seed {seed}\n{}", text());
        if seed % 10 == 0 {
            promised(&it, &both.fields, &text());
        }
        // With the priorities that are found, or written, also without others.
        let placed = tune(&db, project, of, query, &request(false, true)).unwrap();
        assert_eq!(it.is_met(&placed.fields), placed.is_met, "seed {seed}\n{}", text());
        if placed.is_met {
            counted.placements += 1;
            continue;
        }
        counted.no_placements += 1;
        let is_found = placement_by_force(&it, &activities, &mut Vec::new(), cpus);
        assert!(!is_found, "seed {seed}: {placed:?}\n{}", text());
    }
    println!("{counted:?}");
    let is_all = counted.orders > 0 && counted.no_orders > 0 && counted.no_placements > 0;
    assert!(is_all || !search::is_full(), "{counted:?}");
}

/// The figures of the edited text are those that the search promises.
fn promised(it: &Analysed<'_>, fields: &[WhatIfField], text: &str) {
    let promised = response_times_if(it.db, it.project, it.of, it.query, fields);
    let change = edit_of_fields(it.db, it.project, it.of, fields).unwrap();
    let applied = compared(it.db, (it.project, it.of, it.query), &change).expect(text);
    let after = applied.after.expect("the deployment is still there");
    assert_eq!(after.activities.len(), promised.activities.len());
    for (figure, promised) in after.activities.iter().zip(&promised.activities) {
        let status = |status| if status == Status::Background { Status::Met } else { status };
        assert_eq!(
            (figure.name.as_str(), figure.time, status(figure.status)),
            (promised.instance.as_str(), promised.response, status(promised.verdict)),
            "{fields:?}\n{text}"
        );
    }
}
