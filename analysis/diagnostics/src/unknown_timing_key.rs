//! # unknown-timing-key
//!
//! A key of a timing table is unknown: no model of the workspace declares what it names, or several do. Keys are
//! `library.codel` or `codel`; `Component/update`, `Component/state.run`, `Component/state.transition.guard`,
//! `Component/state.transition.effect`, `Component/operation`; `Component`; `Component.port`, and `ros2.instance.port` of a topic, under `[access]`.
//!
//! ```mauve
//! codel plan(): int
//! codel land(): int
//! //- /mauve.toml
//! timing.tables = ["times.toml"]
//! //- /times.toml
//! [codel]
//! land = 1
//! plna = 2   # warning
//! ```
//!
//! Until the key is corrected, the analysis gives no response time that its entry could change: of activities that execute a
//! codel or a program without an entry of its own whose key is similar (at most two letters differ), or is in the library that
//! the key names. All other activities keep their response times. A key of `[overhead]` in another section leaves all of them
//! without one.
//!
//! Fix: replace the key by the similar one. Where several keys name the same unknown library, that is one message.

use super::*;

/// See [`report`] for `fixed`. `known`: all topics, which are named where none is similar.
pub(super) fn of_topic<'db>(
    at: Location<'db>,
    topic: &str,
    near: &Option<Name>,
    fixed: &Option<String>,
    known: &[Name],
) -> Diagnostic<'db> {
    let known: Vec<String> = known.iter().map(|it| format!("`{it}`")).collect();
    let which = near.as_ref().map_or_else(|| format!("; the topics are {}", enumerated(&known)), |_| String::new());
    report(at, &format!("no deployment has a topic at `{topic}`{which}"), near, fixed)
}

/// `fixed`: the corrected key, for a fix that replaces this one.
pub(super) fn report<'db>(
    at: Location<'db>,
    what: &str,
    near: &Option<Name>,
    fixed: &Option<String>,
) -> Diagnostic<'db> {
    let near = near.as_ref().map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    let found = Diagnostic::new(&UNKNOWN_TIMING_KEY, at.clone(), format!("{what}{near}"));
    match fixed {
        Some(fixed) => found.fix(format!("Change to `{fixed}`"), at, format!("\"{fixed}\"")),
        None => found,
    }
}

/// One diagnostic for all keys of an unknown library. `written`: where its name stands in the keys.
pub(super) fn library<'db>(
    at: Location<'db>,
    library: &str,
    keys: usize,
    near: Option<&Name>,
    written: &[Location<'db>],
) -> Diagnostic<'db> {
    let advice = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    let message = format!("no library `{library}`, which {keys} keys name{advice}");
    let mut found = Diagnostic::new(&UNKNOWN_TIMING_KEY, at, message);
    if let Some(near) = near.filter(|_| written.len() == keys) {
        let edits = written.iter().map(|at| (at.clone(), near.to_string()));
        found.fixes.push(Fix { title: format!("Change to `{near}`"), edits: edits.collect() });
    }
    found
}

pub(super) fn wrong_section<'db>(at: Location<'db>, key: &str, section: &str) -> Diagnostic<'db> {
    Diagnostic::new(&UNKNOWN_TIMING_KEY, at, format!("`{key}` is a key of {section}: move it to that section"))
}

pub(super) fn ambiguous<'db>(at: Location<'db>, key: &str, hint: &str) -> Diagnostic<'db> {
    let message = format!("`{key}` is ambiguous: write the library before it, as in `{hint}`");
    Diagnostic::new(&UNKNOWN_TIMING_KEY, at, message)
}
