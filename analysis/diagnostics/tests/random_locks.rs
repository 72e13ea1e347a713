//! Tests on random models with locks, waits, operations, throttling and activities in the background.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Decl, Project, Workspace, names_of, projects};
use mauve_timing::{Level, Method, Status, Time};

use mauve_wcrt::{
    ActivityReport, Limit, LockReason, Query, Reason, Refusal, Report, response_times, sensitivity,
};

const MS: u64 = 1_000_000;

/// An activity, with its codels: the time of each, and its wait; none is 0.
#[derive(Debug, Clone)]
struct Activity {
    codels: Vec<[u64; 2]>,
    /// None in the background.
    priority: Option<u64>,
    period: u64,
    deadline: u64,
    mask: u64,
}

/// A lock, with the codels that take it as activity and codel.
#[derive(Debug, Clone)]
struct Locked {
    protocol: &'static str,
    held: Option<u64>,
    codels: BTreeSet<(usize, usize)>,
}

#[derive(Debug, Clone)]
struct Model {
    activities: Vec<Activity>,
    locks: Vec<Locked>,
    is_throttled: bool,
    /// The second activity sends a call to the first one, which executes a codel of this time for it.
    operation: Option<u64>,
    /// Mistakes: the text, what is in it, and what is there instead.
    mistakes: Vec<(&'static str, String, String)>,
}

fn below(random: &mut mauve_timing::Random, limit: u64) -> u64 {
    random.up_to(limit - 1)
}

impl Model {
    fn random(random: &mut mauve_timing::Random) -> Model {
        let mut below = |limit| below(random, limit);
        let mut activity = |_| {
            let period = (20 + below(60)) * MS;
            let codels = (0..1 + below(2)).map(|_| {
                let wait = if below(5) == 0 { 1 + below(3) } else { 0 };
                [(1 + below(4)) * MS, wait * MS]
            });
            Activity {
                codels: codels.collect(),
                priority: Some(below(4)).filter(|it| *it > 0),
                period,
                deadline: period - below(period / 2),
                mask: if below(4) == 0 { 1 + below(3) } else { 1 },
            }
        };
        let activities: Vec<Activity> = (0..3).map(&mut activity).collect();
        let codels: Vec<(usize, usize)> =
            (0..3).flat_map(|it| (0..activities[it].codels.len()).map(move |codel| (it, codel))).collect();
        let has_ceilings = below(2) == 0;
        let mut lock = |_| Locked {
            protocol: if has_ceilings {
                "ceiling"
            } else {
                ["inheritance", "none"][usize::from(below(5) == 0)]
            },
            held: (below(3) == 0).then(|| (1 + below(2)) * MS),
            codels: codels.iter().copied().filter(|_| below(2) == 0).collect(),
        };
        let mut locks: Vec<Locked> = (0..2).map(&mut lock).collect();
        // Without ceilings, no codel takes two.
        if !has_ceilings {
            let first = locks[0].codels.clone();
            locks[1].codels.retain(|it| !first.contains(it));
        }
        let operation = (below(3) == 0).then(|| (1 + below(3)) * MS);
        Model { activities, locks, is_throttled: below(4) == 0, operation, mistakes: Vec::new() }
    }

    /// The texts of the model, the configuration, the table, and what a recording showed.
    fn texts(&self) -> [String; 4] {
        let mut model =
            "shell S { } shell P { provide help(): int } shell Q { require help(): int }\n".to_owned();
        let (mut instances, mut deployment) = (String::new(), String::new());
        let (mut codels, mut waits) = (String::new(), String::new());
        let serves = self.operation.is_some();
        if let Some(time) = self.operation {
            model.push_str("codel served(): int\n");
            let _ = writeln!(codels, "served = {}", milliseconds(time));
        }
        for (index, it) in self.activities.iter().enumerate() {
            let (shell, first) = match index {
                0 if serves => ("P", "provide help() = { return served(); }"),
                1 if serves => ("Q", "handler h: help"),
                _ => ("S", ""),
            };
            let sends = if serves && index == 1 { "h = send(help); " } else { "" };
            let mut calls = String::new();
            for (codel, [time, wait]) in it.codels.iter().enumerate() {
                let name = format!("c{index}_{codel}");
                let _ = writeln!(model, "codel {name}(): int");
                let _ = write!(calls, "{name}(); ");
                let _ = writeln!(codels, "{name} = {}", milliseconds(*time));
                if *wait > 0 {
                    let _ = writeln!(waits, "{name} = {{ time = {}, times = 1 }}", milliseconds(*wait));
                }
            }
            let _ = writeln!(model, "core K{index}({shell}) {{ {first} update = {{ {sends}{calls}}} }}");
            let _ = writeln!(model, "component C{index}({shell}, K{index})");
            let _ = write!(instances, " instance i{index}: C{index}");
            let _ = match it.priority {
                None => writeln!(
                    deployment,
                    "activity i{index} {{ priority = background affinity = {} }}",
                    it.mask
                ),
                Some(priority) => writeln!(
                    deployment,
                    "activity i{index} {{ priority = {priority} period = {} deadline = {} affinity = {} }}",
                    milliseconds(it.period),
                    milliseconds(it.deadline),
                    it.mask
                ),
            };
        }
        let operation = if serves { " operation i0.help -> i1.help" } else { "" };
        let _ = writeln!(
            model,
            "architecture A {{{instances}{operation} }}\ndeployment D {{ architecture A\n{deployment}}}"
        );
        let mut config = format!(
            "timing = {{ tables = [\"t.toml\"], observed = [\"o.toml\"] }}\nplatform = {{ cpus = 2, rt_throttling = {} }}\n",
            self.is_throttled
        );
        for (index, lock) in self.locks.iter().enumerate() {
            let names: Vec<String> =
                lock.codels.iter().map(|(of, codel)| format!("\"c{of}_{codel}\"")).collect();
            let held =
                lock.held.map_or_else(String::new, |it| format!("held = \"{} ms\"\n", milliseconds(it)));
            let _ = writeln!(
                config,
                "[locks.l{index}]\nprotocol = \"{}\"\ncodels = [{}]\n{held}",
                lock.protocol,
                names.join(", ")
            );
        }
        let table = format!("[codel]\n{codels}[wait]\n{waits}");
        let mut texts = [model, config, table, "# nothing\n".to_owned()];
        for (of, from, to) in &self.mistakes {
            let text =
                &mut texts[["model", "config", "table", "recording"].iter().position(|it| it == of).unwrap()];
            assert!(text.contains(from.as_str()), "{from} in {text}");
            *text = text.replacen(from.as_str(), to, 1);
        }
        texts
    }

    fn project<'db>(&self, db: &'db Database) -> (Project<'db>, Decl<'db>) {
        let [model, config, table, recording] = self.texts();
        let files =
            [("/robot.mal", model), ("/mauve.toml", config), ("/t.toml", table), ("/o.toml", recording)];
        let files = files.map(|(path, text)| (path.into(), text));
        let project = projects(db, Workspace::of_texts(db, "/".into(), files))[0];
        (project, names_of(db, project).anywhere(Kind::Deployment, "D")[0])
    }

    fn report<R>(&self, found: impl FnOnce(&Report<'_>) -> R) -> R {
        let db = Database::default();
        let (project, of) = self.project(&db);
        found(response_times(&db, project, of, QUERY))
    }

    /// The activities whose deadlines are met.
    fn met(&self) -> BTreeSet<usize> {
        self.report(|report| {
            let met =
                |(index, it): (usize, &ActivityReport<'_>)| (it.verdict == Status::Met).then_some(index);
            report.activities.iter().enumerate().filter_map(met).collect()
        })
    }
}

const QUERY: Query = Query { level: Level::TEN_TO_MINUS_FOUR, method: Method::Exact };

fn milliseconds(nanoseconds: u64) -> String {
    format!("{}.{:06}", nanoseconds / MS, nanoseconds % MS)
}

/// The number of models, unless the environment says otherwise.
fn models_or(number: u64) -> u64 {
    std::env::var("MAUVE_LOCKED").ok().and_then(|number| number.parse().ok()).unwrap_or(number)
}

/// The oracle analyses the model with the limit and with the next value, as a user would: with the limit, every deadline that is met
/// now is met; with the next value, one is not.
#[test]
fn each_limit_is_the_last_value_with_which_deadlines_are_met() {
    let mut random = mauve_timing::Random::new(3);
    let (mut last, mut any, mut of_periods, mut in_background) = (0, 0, 0, 0);
    let models = models_or(150);
    for round in 0..models {
        let model = Model::random(&mut random);
        let now = model.met();
        let db = Database::default();
        let (project, of) = model.project(&db);
        let found = sensitivity(&db, project, of, QUERY);
        for it in &found.times {
            let key = it.key(&db);
            let with = |value: u64| {
                let mut model = model.clone();
                match key.strip_prefix('c').and_then(|it| it.split_once('_')) {
                    Some((of, codel)) => {
                        let codel: usize = codel.parse().unwrap();
                        model.activities[of.parse::<usize>().unwrap()].codels[codel][0] = value;
                    }
                    None => model.operation = Some(value),
                }
                model.met()
            };
            let shown = || format!("{round}: {key} {:?}\n{}", it.limit, model.texts().concat());
            match &it.limit {
                Limit::Last(limit) => {
                    let at = with(limit.as_nanos());
                    assert!(now.is_subset(&at), "a met deadline is missed with the limit: {}", shown());
                    assert!(
                        !at.is_subset(&with(limit.as_nanos() + 1)),
                        "nothing is missed beyond: {}",
                        shown()
                    );
                    last += 1;
                    in_background += u64::from(key.strip_prefix('c').is_some_and(|it| {
                        let of = it.split_once('_').and_then(|it| it.0.parse::<usize>().ok());
                        of.is_some_and(|of| model.activities[of].priority.is_none())
                    }));
                }
                Limit::Proved(limit) => {
                    assert!(now.is_subset(&with(limit.as_nanos())), "with what is proved: {}", shown());
                }
                Limit::Any => {
                    assert!(now.is_subset(&with(1000 * MS)), "with any time: {}", shown());
                    any += 1;
                }
                _ => {}
            }
        }
        for (index, it) in found.activities.iter().enumerate() {
            let with = |period: u64| {
                let mut model = model.clone();
                let activity = &mut model.activities[index];
                (activity.period, activity.deadline) = (period, activity.deadline.min(period));
                model.met()
            };
            let shown = || format!("{round}: {} {:?}\n{}", it.instance, it.limit, model.texts().concat());
            match &it.limit {
                Limit::Last(limit) => {
                    let at = with(limit.as_nanos());
                    assert!(now.is_subset(&at), "a met deadline is missed with the limit: {}", shown());
                    if limit.as_nanos() > 1 && !it.serves {
                        let next = with(limit.as_nanos() - 1);
                        assert!(!at.is_subset(&next), "nothing is missed beyond: {}", shown());
                    }
                    of_periods += 1;
                }
                Limit::Proved(limit) => {
                    assert!(now.is_subset(&with(limit.as_nanos())), "with what is proved: {}", shown());
                }
                _ => {}
            }
        }
    }
    println!(
        "{models} models: {last} limits of times, {in_background} of them in the background, {any} of any time; {of_periods} of periods"
    );
    assert!(last > models && any * 4 > models && of_periods * 2 > models && in_background * 20 > models);
}

/// Whatever an activity delays is refused where it is refused, for each reason. What it delays is what ends later if its codels
/// take far longer.
#[test]
fn what_a_refused_activity_delays_is_refused() {
    let mut random = mauve_timing::Random::new(5);
    let (mut refused, mut by_locks) = (0, 0);
    let models = models_or(150);
    for round in 0..models {
        let model = Model::random(&mut random);
        let of = below(&mut random, 3) as usize;
        let responses = |model: &Model| -> Vec<Option<Time>> {
            model.report(|report| report.activities.iter().map(|it| it.response).collect())
        };
        let now = responses(&model);
        let mut longer = model.clone();
        longer.activities[of].codels.iter_mut().for_each(|[time, _]| *time += 500 * MS);
        longer.operation = longer.operation.map(|it| if of == 0 { it + 500 * MS } else { it });
        let delayed: Vec<usize> = responses(&longer)
            .iter()
            .zip(&now)
            .enumerate()
            .filter(|(_, (later, now))| now.is_some() && (later.is_none() || later > now))
            .map(|(index, _)| index)
            .collect();
        let Activity { codels, priority, period, .. } = &model.activities[of];
        let its_locks =
            model.locks.iter().filter(|it| it.held.is_none() && it.codels.iter().any(|it| it.0 == of));
        let locked = its_locks
            .flat_map(|lock| &lock.codels)
            .find(|it| it.0 == of)
            .map(|it| format!("c{}_{}", it.0, it.1));
        let mut mistakes = vec![
            ("an error in the core", "model", format!("core K{of}("), format!("core K{of} ?(")),
            (
                "an error in a program",
                "model",
                "c0_0(); ".replace("c0", &format!("c{of}")),
                "1 + ; ".to_owned(),
            ),
            ("an unknown component", "model", format!(": C{of}"), format!(": Unknown{of}")),
        ];
        if priority.is_some() {
            // In the background, only the times of locks count.
            let time = format!("c{of}_0 = {}\n", milliseconds(codels[0][0]));
            mistakes.push(("no time", "table", time, String::new()));
            let written = format!("period = {}", milliseconds(*period));
            let at = format!("activity i{of} {{ priority = {} {written}", priority.unwrap_or(0));
            mistakes.push(("no period", "model", at.clone(), at.replace(&written, "")));
        }
        if let Some(codel) = locked {
            mistakes.push((
                "a wait within its lock",
                "table",
                "[wait]\n".into(),
                format!("[wait]\n\"{codel}\" = 1\n"),
            ));
            let other =
                format!("[locks.other]\nprotocol = \"inheritance\"\ncodels = [\"{codel}\"]\n[locks.l0]");
            mistakes.push(("two locks", "config", "[locks.l0]".into(), other));
        }
        let lock = format!("[lock.other.\"c{of}_0\"]\nexecutions = 10\nheld = 0.05\n");
        mistakes.push(("a lock in a recording", "recording", "# nothing\n".into(), lock));
        for (why, text, from, to) in mistakes {
            // It waits already.
            if why == "a wait within its lock"
                && model.texts()[2].split("[wait]").nth(1).is_some_and(|it| it.contains(&format!("c{of}_")))
            {
                continue;
            }
            let mut wrong = model.clone();
            wrong.mistakes.push((text, from, to));
            wrong.report(|report| {
                for &index in &delayed {
                    let it = &report.activities[index];
                    let is_refused = it.response.is_none() && it.verdict != Status::Met;
                    assert!(
                        is_refused,
                        "{round}: {why} in i{of} leaves i{index} {:?}\n{}",
                        it.response,
                        wrong.texts().concat()
                    );
                    refused += 1;
                    let is_lock =
                        |it: &Refusal<'_>| matches!(it.reason, Reason::Lock(LockReason::UnknownTime { .. }));
                    by_locks += u64::from(it.reasons.iter().any(is_lock));
                }
            });
        }
    }
    println!("{models} models: {refused} refused, {by_locks} by locks");
    assert!(refused > models && by_locks * 3 > models);
}

/// A codel that goes from one ceiling to the next, or takes one within the other: a job of higher priority that is released at any
/// instant waits until the first instant without them.
#[test]
fn no_job_waits_longer_for_ceilings_than_is_counted() {
    let mut random = mauve_timing::Random::new(9);
    let (mut attained, mut together) = (0, 0);
    let models = models_or(150);
    for round in 0..models {
        let mut below = |limit| below(&mut random, limit);
        let whole = 2 + below(8);
        // From when to when the codel holds each lock.
        let sections = [0, 1].map(|_| {
            let from = below(whole);
            (from, from + 1 + below(whole - from))
        });
        let has_lock = |instant: u64| sections.iter().any(|(from, to)| (*from..*to).contains(&instant));
        let waits = (0..whole).map(|released| (released..).take_while(|it| has_lock(*it)).count() as u64);
        let longest = waits.max().unwrap();
        let simple = |priority, time: u64| Activity {
            codels: vec![[time * MS, 0]],
            priority: Some(priority),
            period: 100 * MS,
            deadline: 100 * MS,
            mask: 1,
        };
        let locks = sections.map(|(from, to)| Locked {
            protocol: "ceiling",
            held: Some((to - from) * MS),
            codels: BTreeSet::from([(0, 0), (1, 0)]),
        });
        let model = Model {
            activities: vec![simple(2, 1), simple(1, whole), simple(1, 1)],
            locks: locks.to_vec(),
            is_throttled: false,
            operation: None,
            mistakes: Vec::new(),
        };
        let found = model.report(|report| report.activities[0].response).unwrap();
        let needed = Time::from_nanos((1 + longest) * MS);
        assert!(found >= needed, "{round}: {found} for {needed}, {sections:?} of {whole}");
        attained += u64::from(found == needed);
        together += u64::from(sections.iter().all(|(from, to)| to - from < longest));
    }
    println!("{models} models: {attained} attained, {together} longer than each lock");
    assert!(attained * 4 > models && together * 10 > models);
}
