//! The limits of times and periods are those of the analysis: with the limit in the timing table, or in the deployment, every
//! deadline is proved that was proved before, and with one nanosecond more (for a period, less) one of them is not.
//!
//! `MAUVE_LIMITS=2000 cargo test --release -p mauve-diagnostics --test main sensitivity::` tries more models.

use std::collections::BTreeSet;
use std::path::PathBuf;

use mauve_hir::{Database, Workspace};
use mauve_syntax::keywords::ActivityField;
use mauve_tests::model::Model;
use mauve_tests::{Random, random_model};
use mauve_timing::{Level, Method, Time};
use mauve_wcrt::{
    ActivitySensitivity, Limit, Query, Report, Sensitivity, WhatIfField, response_times, response_times_if,
    sensitivity, system_of,
};

use crate::common::deployments;

/// The limits that were compared with the analysis.
#[derive(Debug, Default)]
struct Counted {
    growing: usize,
    shrinking: usize,
    any: usize,
    not_found: usize,
    periods: usize,
    longer_periods: usize,
    exhausted: usize,
}

/// The instances whose deadline is proved, background activities included.
fn met(report: &Report<'_>) -> BTreeSet<String> {
    let met = report.activities.iter().filter(|it| it.verdict.is_met());
    met.map(|it| it.instance.to_string()).collect()
}

fn workspace(db: &Database, texts: Vec<(PathBuf, String)>) -> Workspace {
    Workspace::of_texts(db, "/".into(), texts)
}

/// The proved deadlines of the only deployment of a model.
fn met_in(model: &Model, query: Query) -> BTreeSet<String> {
    let db = Database::default();
    let all = deployments(&db, workspace(&db, model.texts()));
    let [(project, deployment)] = all[..] else { panic!("one deployment") };
    met(response_times(&db, project, deployment, query))
}

/// A model where execution times matter: those of the tables are milliseconds, `scale` times as many.
fn model_of(seed: u64, scale: u64) -> Model {
    let mut model = random_model(seed);
    for (header, entries) in model.tomls.iter_mut().skip(1).flat_map(|toml| &mut toml.sections) {
        for (key, value) in entries {
            if key == "unit" {
                *value = "\"ms\"".to_owned();
            } else if !header.is_empty() {
                let numbers = value.trim_matches(['[', ']']).split(", ");
                let scaled: Vec<String> =
                    numbers.map(|it| (it.parse::<u64>().unwrap() * scale).to_string()).collect();
                *value =
                    if value.starts_with('[') { format!("[{}]", scaled.join(", ")) } else { scaled.concat() };
            }
        }
    }
    model
}

/// The model with another time in its table; none where no table has one.
fn with_time(model: &Model, of: &str, time: Time) -> Option<Model> {
    let mut model = model.clone();
    let sections = model.tomls.iter_mut().skip(1).flat_map(|toml| &mut toml.sections);
    let mut entries = sections.flat_map(|(_, entries)| entries);
    let (_, value) = entries.find(|(key, _)| {
        let key = key.trim_matches('"');
        of == key || of.ends_with(&format!(".{key}"))
    })?;
    *value = time.number();
    Some(model)
}

fn nanos(time: Time, more: i64) -> Time {
    Time::from_nanos(time.as_nanos().checked_add_signed(more).unwrap())
}

fn check_times(
    model: &Model,
    query: Query,
    found: &Sensitivity<'_>,
    keys: &[String],
    random: &mut Random,
    counted: &mut Counted,
) {
    let now = met_in(model, query);
    for _ in 0..3 {
        if found.times.is_empty() {
            return;
        }
        let index = random.below(found.times.len());
        let (key, of) = (&keys[index], &found.times[index]);
        let what = format!("{key} {of:?}");
        let met_with = |time: Time| Some(met_in(&with_time(model, key, time)?, query));
        match &of.limit {
            Limit::Last(limit) | Limit::Proved(limit) => {
                let Some(at) = met_with(*limit) else { continue };
                assert!(at.is_superset(&now), "{what}");
                assert!(of.unproved.iter().all(|name| at.contains(name.as_str())), "{what}");
                assert_eq!(of.unproved.is_some(), Some(*limit) < of.time, "{what}");
                if matches!(of.limit, Limit::Last(_)) {
                    assert!(!met_with(nanos(*limit, 1)).unwrap().is_superset(&at), "{what}");
                } else {
                    counted.exhausted += 1;
                }
                counted.growing += usize::from(of.unproved.is_none());
                counted.shrinking += usize::from(of.unproved.is_some());
            }
            Limit::Any => {
                let Some(at) = met_with(Time::from_nanos(1 << 50)) else { continue };
                assert!(at.is_superset(&now), "{what}");
                counted.any += 1;
            }
            Limit::NotFound => {
                let Some(at) = met_with(Time::ZERO) else { continue };
                assert!(at.len() < found.activities.len(), "{what}");
                counted.not_found += 1;
            }
            Limit::NotAnalysed(_) | Limit::Exhausted => {}
        }
    }
}

#[test]
fn limits_of_random_models_are_the_last_good_values() {
    let count = std::env::var("MAUVE_LIMITS").map_or(60, |count| count.parse().expect("a number"));
    let mut counted = Counted::default();
    for seed in 0..count {
        let mut random = Random::of_seed(seed);
        let model = model_of(seed, *random.of(&[1, 1, 2, 5]));
        let method = *random.of(&[Method::Exact, Method::Exact, Method::Ibf, Method::Psm, Method::Classic]);
        let query = Query { level: Level::TEN_TO_MINUS_FOUR, method };
        let db = Database::default();
        let all = deployments(&db, workspace(&db, model.texts()));
        let [(project, deployment)] = all[..] else { continue };
        let found = sensitivity(&db, project, deployment, query);
        let keys: Vec<String> = found.times.iter().map(|it| it.key(&db)).collect();
        check_times(&model, query, &found, &keys, &mut random, &mut counted);
        let now = met(response_times(&db, project, deployment, query));
        let met_with = |of: &ActivitySensitivity, period: Time| {
            let data = mauve_hir::deployment(&db, deployment).unwrap();
            let written = data.activities.iter().find(|it| it.executes(&of.instance)).unwrap();
            let system = system_of(&db, project, deployment);
            let activity = system.activities.iter().find(|it| it.instance == of.instance).unwrap();
            let field = |field, time: Time| WhatIfField {
                instance: of.instance.clone(),
                field,
                value: time.number().into(),
            };
            let mut fields = vec![field(ActivityField::Period, period)];
            // A written deadline is at most the period.
            if written.fields.iter().any(|it| it.name.name == "deadline")
                && activity.deadline.is_some_and(|deadline| deadline > period)
            {
                fields.push(field(ActivityField::Deadline, period));
            }
            met(&response_times_if(&db, project, deployment, query, &fields))
        };
        for of in &found.activities {
            let what = format!("seed {seed}: {of:?}");
            let (Limit::Last(limit) | Limit::Proved(limit)) = of.limit else { continue };
            let at = met_with(of, limit);
            assert!(at.is_superset(&now), "{what}");
            assert!(of.unproved.iter().all(|name| at.contains(name.as_str())), "{what}");
            assert_eq!(of.unproved.is_some(), Some(limit) > of.period, "{what}");
            if matches!(of.limit, Limit::Last(_)) && limit.as_nanos() > 1 {
                assert!(!met_with(of, nanos(limit, -1)).is_superset(&at), "{what}");
            }
            counted.periods += usize::from(of.unproved.is_none());
            counted.longer_periods += usize::from(of.unproved.is_some());
        }
    }
    println!("{counted:?}");
    assert!(counted.growing > 10 && counted.shrinking > 3 && counted.periods > 10, "{counted:?}");
}
