//! Lists and CPUs in messages.

use std::hash::Hash;

use mauve_timing::CpuLoad;
use rustc_hash::FxHashMap;

/// Returns the utilisation of a CPU: `62.0 %`. That of several CPUs together: `131.0 % of 200 %`.
pub fn utilisation(load: &CpuLoad) -> String {
    let percent = format!("{:.1} %", load.utilisation.as_f64() * 100.0);
    match load.cpus.len() {
        0 | 1 => percent,
        cpus => format!("{percent} of {cpus}00 %"),
    }
}

/// The same, with `at least` where an activity of the CPU has an unknown demand.
pub fn known_utilisation(load: &CpuLoad) -> String {
    let at_least = if load.complete { "" } else { "at least " };
    format!("{at_least}{}", utilisation(load))
}

/// Removes duplicates, keeping the order.
pub fn each_once<T: PartialEq>(all: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for it in all {
        if !found.contains(&it) {
            found.push(it);
        }
    }
    found
}

/// Groups values by their keys, in the order of the first value of each key.
pub fn grouped<K: Eq + Hash + Clone, V>(all: impl IntoIterator<Item = (K, V)>) -> Vec<(K, Vec<V>)> {
    let mut found: Vec<(K, Vec<V>)> = Vec::new();
    let mut numbers: FxHashMap<K, usize> = FxHashMap::default();
    for (key, value) in all {
        let number = *numbers.entry(key.clone()).or_insert(found.len());
        match found.get_mut(number) {
            Some((_, values)) => values.push(value),
            None => found.push((key, vec![value])),
        }
    }
    found
}

/// `a`, `a and b`, `a, b and c`; long lists are truncated.
pub fn enumerated<S: std::borrow::Borrow<str>>(names: &[S]) -> String {
    const SHOWN: usize = 5;
    match names {
        [] => "nothing".to_owned(),
        names if names.len() <= SHOWN => all_of(names),
        _ => format!("{} and {} more", names[..SHOWN - 1].join(", "), names.len() - SHOWN + 1),
    }
}

/// `a`, `a or b`, `a, b or c`
pub(crate) fn alternatives<S: std::borrow::Borrow<str>>(names: &[S]) -> String {
    joined(names, "or")
}

/// `a`, `a and b`, `a, b and c`
pub fn all_of<S: std::borrow::Borrow<str>>(names: &[S]) -> String {
    joined(names, "and")
}

fn joined<S: std::borrow::Borrow<str>>(names: &[S], word: &str) -> String {
    match names {
        [rest @ .., last] if !rest.is_empty() => format!("{} {word} {}", rest.join(", "), last.borrow()),
        names => names.concat(),
    }
}
