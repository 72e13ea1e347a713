//! Measures the CPU seconds of tests, and compares them with `tests/costs.txt`.
//!
//! ```text
//! cost run COMMAND…        runs a test for nextest, and appends its CPU seconds to the file $MAUVE_COSTS
//! cost report FILE TABLE   prints the sums of each group beside the table, and names those that cost half as much again
//! ```
//!
//! Machines differ, and one is slower while it does something else. So each test also runs a fixed loop of some milliseconds, and the
//! table is in units: a unit is 500 times the median of all loops of the run, about a second. Memory, caches and what runs beside the
//! tests still change a group by a factor of two: a cost is for people to read, and no run fails for it.
//!
//! A group is a program of tests, or a module of its `main.rs`. Those below [`SMALL`] units count together.

#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used, reason = "it fails as a test does")]

use std::collections::BTreeMap;
use std::env::args;
use std::fmt::Write as _;
use std::fs::read_to_string;
use std::process::exit;

#[cfg(target_os = "linux")]
use measured::run;

/// Groups that cost less, in units, are one.
const SMALL: f64 = 4.0;

/// The greatest cost that is not named, as a multiple of the cost in the table.
const NAMED: f64 = 1.5;

/// The group of those that are small.
const OTHERS: &str = "(others)";

fn main() {
    let arguments: Vec<String> = args().skip(1).collect();
    let code = match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["run", command @ ..] if !command.is_empty() => run(command),
        ["report", costs, table] => {
            let (costs, table) = (read_to_string(costs).unwrap(), read_to_string(table).unwrap());
            print!("{}", report(&costs, &table));
            0
        }
        _ => {
            println!("usage: cost run COMMAND… | report FILE TABLE");
            2
        }
    };
    exit(code);
}

/// Runs a test; returns its exit code. Other systems than Linux do not say what its processes cost.
#[cfg(not(target_os = "linux"))]
fn run(command: &[&str]) -> i32 {
    let status = std::process::Command::new(command[0]).args(&command[1..]).status();
    status.expect("a test can be started").code().unwrap_or(1)
}

/// The group of a test: `mauve::main cli`.
fn group(program: &str, test: &str) -> String {
    match test.split_once("::").filter(|_| program.ends_with("::main")) {
        Some((module, _)) => format!("{} {module}", program.trim_end_matches("::main")),
        None => program.to_owned(),
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Returns the costs of a run beside those of a table.
fn report(costs: &str, table: &str) -> String {
    let lines: Vec<Vec<&str>> = costs.lines().map(|line| line.splitn(4, ' ').collect()).collect();
    let loops = lines.iter().filter_map(|line| line[1].parse().ok()).collect();
    let unit = median(loops).map_or(1.0, |median| median * 500.0);
    let mut tests: Vec<(f64, &str)> = Vec::new();
    let mut sums: BTreeMap<String, f64> = BTreeMap::new();
    for line in &lines {
        let seconds: f64 = line[0].parse().unwrap();
        // A step of `tests/run` is no test, and has no loop.
        if line[1] != "-" {
            tests.push((seconds, line[3]));
        }
        *sums.entry(group(line[2], line[3])).or_default() += seconds;
    }
    let expected: BTreeMap<&str, f64> = table
        .lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| {
            let (units, name) = line.trim().split_once(' ')?;
            Some((name.trim(), units.parse().ok()?))
        })
        .collect();
    let mut groups: BTreeMap<&str, f64> = BTreeMap::new();
    for (name, seconds) in &sums {
        let is_own = expected.contains_key(name.as_str()) || seconds / unit >= SMALL;
        *groups.entry(if is_own { name } else { OTHERS }).or_default() += seconds;
    }
    let mut ordered: Vec<(&str, f64)> = groups.into_iter().collect();
    ordered.sort_by(|one, other| other.1.total_cmp(&one.1));
    let all: f64 = sums.values().sum();
    let mut out = format!(
        "CPU seconds of the tests: {all:.0}, or {:.0} units of {unit:.2} s\n  seconds   units  expected  group\n",
        all / unit
    );
    let mut named = String::new();
    for (name, seconds) in ordered {
        let units = seconds / unit;
        let wanted = expected.get(name).copied().unwrap_or(SMALL).max(SMALL);
        let _ = writeln!(out, "{seconds:9.1} {units:7.1} {wanted:9.1}  {name}");
        if units > wanted * NAMED {
            let _ =
                writeln!(named, "costs more than before: {name}: {units:.1} units, {wanted:.1} are expected");
        }
    }
    tests.sort_by(|one, other| other.0.total_cmp(&one.0));
    out += "The ten dearest:\n";
    for (seconds, name) in tests.iter().take(10) {
        let _ = writeln!(out, "{seconds:9.1}  {name}");
    }
    out + &named
}

#[cfg(target_os = "linux")]
mod measured {
    use std::env::{var, var_os};
    use std::fs::{OpenOptions, read_to_string};
    use std::io::Write as _;
    use std::process::Command;
    use std::time::Instant;

    use rustix::process::{WaitOptions, getpid, set_child_subreaper, wait};

    /// Runs a test with all that it leaves behind, and notes its cost; returns its exit code.
    pub(crate) fn run(command: &[&str]) -> i32 {
        // What a daemon of the test has cost is known when it ends, if it is ours then.
        set_child_subreaper(Some(getpid())).expect("Linux has it");
        let unit = fixed_loop();
        #[expect(clippy::zombie_processes, reason = "the loop waits for all processes")]
        let child = Command::new(command[0]).args(&command[1..]).spawn().expect("a test can be started");
        let code = loop {
            match wait(WaitOptions::empty()) {
                Ok(Some((pid, status))) if pid.as_raw_nonzero().get() as u32 == child.id() => {
                    break status
                        .exit_status()
                        .unwrap_or_else(|| 128 + status.terminating_signal().unwrap_or(0));
                }
                Ok(_) | Err(rustix::io::Errno::INTR) => {}
                Err(_) => break 1,
            }
        };
        while let Ok(Some(_)) = wait(WaitOptions::NOHANG) {}
        let Some(path) = var_os("MAUVE_COSTS") else { return code };
        let name = |variable: &str| var(variable).unwrap_or_else(|_| "?".to_owned());
        let line = format!(
            "{:.2} {unit:.6} {} {}\n",
            of_children(),
            name("NEXTEST_BINARY_ID"),
            name("NEXTEST_TEST_NAME")
        );
        // One call: lines of several tests are not mixed.
        OpenOptions::new().append(true).create(true).open(path).unwrap().write_all(line.as_bytes()).unwrap();
        code
    }

    /// Returns the seconds that always the same work takes.
    fn fixed_loop() -> f64 {
        let begin = Instant::now();
        let mut sum = 1_u64;
        for step in 0..2_000_000_u64 {
            sum = std::hint::black_box(sum.rotate_left(5) ^ step).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
        std::hint::black_box(sum);
        begin.elapsed().as_secs_f64()
    }

    /// Returns the CPU seconds of all processes that were waited for, in hundredths.
    fn of_children() -> f64 {
        let stat = read_to_string("/proc/self/stat").unwrap();
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
        // `cutime` and `cstime`, fields 16 and 17 of proc(5): two stand before the `)`. Linux counts them in hundredths.
        fields[13..15].iter().map(|ticks| ticks.parse::<f64>().unwrap() / 100.0).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "# units  group\n10 mauve-timing search\n 40 mauve cli\n5 mauve-ide\n";

    fn costs(search: f64, cli: f64) -> String {
        format!(
            "{search} 0.001 mauve-timing::main search::all\n{cli} 0.001 mauve::main cli::builds::one\n2 0.0011 mauve-ide hover::tests::one\n\
             0.1 0.0009 mauve-hir names::tests::one\n"
        )
    }

    #[test]
    fn a_group_that_doubles_is_named() {
        // A unit is half a second here.
        assert!(!report(&costs(6.5, 20.0), TABLE).contains("more than before"));
        let text = report(&costs(10.0, 20.0), TABLE);
        let named = "costs more than before: mauve-timing search: 20.0 units, 10.0 are expected\n";
        assert!(text.ends_with(named), "{text}");
        // The dearest test is the first.
        assert!(text.contains("dearest:\n     20.0  cli::builds::one\n     10.0  search::all\n"), "{text}");
    }

    #[test]
    fn a_slow_machine_has_longer_units() {
        let slow = costs(20.0, 80.0)
            .replace(" 0.001 ", " 0.004 ")
            .replace("2 0.0011", "8 0.0044")
            .replace("0.0009", "0.0036");
        assert!(!report(&slow, TABLE).contains("more than before"));
    }

    #[test]
    fn a_new_group_needs_a_line_in_the_table() {
        let text = report(&(costs(5.0, 20.0) + "9 0.001 mauve::main new::one\n"), TABLE);
        assert!(text.contains("costs more than before: mauve new: 18.0 units"), "{text}");
    }
}
