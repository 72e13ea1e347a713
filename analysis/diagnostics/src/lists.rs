//! Lists and CPUs in messages.

use mauve_timing::{CpuLoad, CpuSet};

/// Above this number of CPUs, those in a row are shown as `3 to 9`.
const MOST_CPUS: u32 = 8;

/// Returns the CPUs of a set for a user, numbered from 1.
///
/// ```
/// use mauve_diagnostics::cpu_names;
/// use mauve_timing::CpuSet;
///
/// assert_eq!(cpu_names(CpuSet(0b1)), "CPU 1");
/// assert_eq!(cpu_names(CpuSet(0b1011)), "CPUs 1, 2 and 4");
/// assert_eq!(cpu_names(CpuSet::first_few(96) - CpuSet::of(1)), "CPUs 1 and 3 to 96");
/// ```
pub fn cpu_names(cpus: CpuSet) -> String {
    let numbers: Vec<u32> = cpus.iter().map(|cpu| cpu + 1).collect();
    let is_short = cpus.len() <= MOST_CPUS;
    let rows = numbers.chunk_by(|one, next| !is_short && one + 1 == *next);
    let numbers: Vec<String> = rows
        .map(|row| match row {
            [first, .., last] => format!("{first} to {last}"),
            row => row.iter().map(u32::to_string).collect(),
        })
        .collect();
    match numbers.as_slice() {
        [one] if cpus.is_one() => format!("CPU {one}"),
        [row] => format!("CPUs {row}"),
        [rest @ .., last] => format!("CPUs {} and {last}", rest.join(", ")),
        [] => "no CPU".to_owned(),
    }
}

/// Returns the utilisation of a CPU: `62.0 %`. That of several CPUs together: `131.0 % of 200 %`.
pub fn utilisation(load: &CpuLoad) -> String {
    let percent = format!("{:.1} %", load.utilisation.as_f64() * 100.0);
    match load.cpus.len() {
        0 | 1 => percent,
        cpus => format!("{percent} of {cpus}00 %"),
    }
}

/// `a`, `a and b`, `a, b and c`; long lists are truncated.
pub(crate) fn enumerated<S: std::borrow::Borrow<str>>(names: &[S]) -> String {
    const SHOWN: usize = 5;
    match names {
        [] => "nothing".to_owned(),
        [one] => one.borrow().to_owned(),
        [rest @ .., last] if rest.len() < SHOWN => format!("{} and {}", rest.join(", "), last.borrow()),
        _ => format!("{} and {} more", names[..SHOWN - 1].join(", "), names.len() - SHOWN + 1),
    }
}

/// `a`, `a or b`, `a, b or c`
pub(crate) fn alternatives<S: std::borrow::Borrow<str>>(names: &[S]) -> String {
    match names {
        [rest @ .., last] if !rest.is_empty() => format!("{} or {}", rest.join(", "), last.borrow()),
        names => names.concat(),
    }
}
