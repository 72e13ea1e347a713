//! How far a test searches at random: a fifth of its cases for each commit, always the same, and all of them each night.
//!
//! | variable | of `tests/run` | meaning |
//! |---|---|---|
//! | `MAUVE_SEED` | with `--all`, from the commit | begins elsewhere; 0 if it is not set. A failure prints it |
//! | `MAUVE_ALL` | with `--all` | searches all cases |
//!
//! Each search has a variable of its own for another number of cases.

use std::env::{var, var_os};
use std::ops::Range;
use std::str::FromStr;

/// Returns a fifth of what a full run has, or all of it in a full run: what a search finds is in proportion to its cases.
pub fn share(all: u64) -> u64 {
    if is_full() { all } else { all.div_ceil(5) }
}

/// Returns the number of cases of a search that has `all` cases in a full run; the variable overrides it.
pub fn cases<N: FromStr + TryFrom<u64>>(variable: &str, all: u64) -> N {
    let number = share(all);
    setting(variable)
        .unwrap_or_else(|| N::try_from(number).unwrap_or_else(|_| panic!("{number} is too large")))
}

/// Returns the seeds of such a search, one for each case.
pub fn seeds(variable: &str, all: u64) -> Range<u64> {
    let first = seed() * 10_000;
    first..first + cases::<u64>(variable, all)
}

/// Returns whether a place with this number is searched, where a search goes over all places of a text: one in five of them.
pub fn is_searched(place: usize) -> bool {
    is_full() || (place as u64 + setting("MAUVE_SEED").unwrap_or(0)).is_multiple_of(5)
}

/// Returns the seed of this run. The report of a failure shows it.
pub fn seed() -> u64 {
    let seed = setting("MAUVE_SEED").unwrap_or(0);
    eprintln!("MAUVE_SEED={seed}");
    seed
}

/// Returns whether all cases are searched.
pub fn is_full() -> bool {
    var_os("MAUVE_ALL").is_some()
}

fn setting<N: FromStr>(variable: &str) -> Option<N> {
    let text = var(variable).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{variable}={text} is not a number of cases")))
}
