//! `mauve platform import FILE…`: what interrupts the activities of a robot on this computer, as entries to paste.
//!
//! **Noise.** `rtla osnoise` measures the time for which a thread is interrupted in each sample of P (its runtime). A busy window
//! may touch two samples of which each has the greatest noise N, so the entry has `time` N, `period` P and `jitter` P: at most 2 N
//! in any time up to P, and one N more for each further P.
//!
//! **Latency.** `rtla timerlat` and `cyclictest` measure the time from a timer to its thread. As the overhead of each job it delays
//! the activity itself, and counts again in each job that interferes: safe, and longer than necessary.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use mauve_projects::disk;
use mauve_projects::output::Output;
use mauve_timing::{CpuSet, Time};

use super::recordings::{Noise, PlatformRecording, read};
use crate::text::{counted, duration};

#[derive(Debug, clap::Args)]
pub struct PlatformImport {
    /// Outputs of `rtla osnoise top`, `rtla timerlat` and `cyclictest`.
    #[arg(value_name = "FILE", required = true, value_hint = clap::ValueHint::FilePath)]
    files: Vec<PathBuf>,
}

impl PlatformImport {
    pub(crate) fn run(self) -> Result<Output, String> {
        let mut found = MeasuredPlatform::default();
        for path in &self.files {
            let shown = path.display();
            let bytes =
                disk::read(path, disk::LONGEST).map_err(|error| format!("cannot read `{shown}`: {error}"))?;
            let recording = read(&String::from_utf8_lossy(&bytes))
                .map_err(|why| format!("cannot read `{shown}`: {why}"))?;
            found.add(recording);
        }
        Ok(Output::escaped(found.text(), 0))
    }
}

/// The greatest values of all files.
#[derive(Debug, Default)]
struct MeasuredPlatform {
    noise: BTreeMap<u32, Noise>,
    /// The greatest latency, and the number of wake-ups.
    latency: Option<(u64, u64)>,
    has_single_noise: bool,
}

impl MeasuredPlatform {
    fn add(&mut self, recording: PlatformRecording) {
        match recording {
            PlatformRecording::Noise(all) => {
                for it in all {
                    let known = self.noise.entry(it.cpu).or_insert_with(|| it.clone());
                    known.greatest = known.greatest.max(it.greatest);
                    known.sample = known.sample.min(it.sample);
                    known.count = known.count.max(it.count);
                }
            }
            PlatformRecording::SingleNoise => self.has_single_noise = true,
            PlatformRecording::Latency { greatest, count } => {
                let (longest, all) = self.latency.unwrap_or_default();
                self.latency = Some((longest.max(greatest), all.saturating_add(count)));
            }
        }
    }

    fn text(&self) -> String {
        let mut out = String::new();
        let noisy = self.noise.values().filter(|it| it.greatest > 0 && it.cpu < CpuSet::MOST);
        for (index, it) in noisy.enumerate() {
            let heading = if index == 0 { "# For mauve.toml:\n" } else { "" };
            let (sample, greatest) = (quoted(it.sample), quoted(it.greatest));
            let cpu = it.cpu + 1;
            let _ = write!(
                out,
                "{heading}[[platform.other]] # {} of CPU {} of Linux\nname = \"noise of CPU {cpu}\"\npriority = 99\n\
                 period = {sample}\ntime = {greatest}\njitter = {sample} # two samples may meet\ncpus = [{cpu}]\n\n",
                counted(usize::try_from(it.count).unwrap_or(usize::MAX), "sample"),
                it.cpu
            );
        }
        if let Some((greatest, count)) = self.latency {
            let _ = write!(
                out,
                "# For a timing table with unit = \"ms\": the greatest latency of {count} wake-ups\n[overhead]\ndispatch = {}\n\n",
                Time::from_nanos(greatest).number()
            );
        }
        out += "# Not covered:\n";
        for line in self.not_covered() {
            let _ = writeln!(out, "# - {line}");
        }
        out
    }

    fn not_covered(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.noise.is_empty() {
            lines.push("interrupts and threads that are not in the model: `rtla osnoise top -q -P F:1 -d 1h > noise.txt` measures them".to_owned());
        } else {
            let cpus: Vec<String> = self.noise.keys().map(|cpu| (u64::from(*cpu) + 1).to_string()).collect();
            lines.push(format!("CPUs other than {}", cpus.join(", ")));
            lines.push("noise between the samples, if the runtime of `rtla osnoise` (-r) was shorter than its period (-p)".to_owned());
        }
        if self.noise.keys().any(|cpu| *cpu >= CpuSet::MOST) {
            lines.push(format!("CPUs beyond the {} that an activity may use", CpuSet::MOST));
        }
        if self.has_single_noise {
            lines.push("the noise of `rtla osnoise hist`, which does not record the time between two interruptions: use `rtla osnoise top -q`".to_owned());
        }
        match self.latency {
            None => lines.push("the latency of wake-ups: `rtla timerlat top -q -d 1h > latency.txt` or `cyclictest -mq -p 98 -D 1h` measure it".to_owned()),
            Some((_, count)) => {
                lines.push(format!(
                    "a latency that is rarer than 1 in {} wake-ups, or that needs a load which the robot had not", count / 3
                ));
                lines.push("the cost of a context switch: `context_switch` of [overhead] stays as it is".to_owned());
                lines.push(format!(
                    "`cyclictest -N`, whose nanoseconds are read as microseconds: {} would be {}",
                    duration(self.latency.unwrap_or_default().0), duration(self.latency.unwrap_or_default().0 / 1000)
                ));
            }
        }
        lines.push(
            "caches and memory that other CPUs use: measure execution times while the robot does its mission"
                .to_owned(),
        );
        lines
    }
}

/// Returns a time for `mauve.toml`: `"91 us"`.
fn quoted(nanoseconds: u64) -> String {
    let (number, unit) = match nanoseconds {
        it if it.is_multiple_of(1_000_000) => (it / 1_000_000, "ms"),
        it if it.is_multiple_of(1000) => (it / 1000, "us"),
        it => (it, "ns"),
    };
    format!("\"{number} {unit}\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_files_give_the_greatest_values() {
        let mut found = MeasuredPlatform::default();
        let noise = |cpu, sample, greatest| Noise { cpu, sample, greatest, count: 60 };
        found
            .add(PlatformRecording::Noise(vec![noise(0, 1_000_000_000, 91_000), noise(1, 1_000_000_000, 0)]));
        found.add(PlatformRecording::Noise(vec![noise(0, 950_000_000, 7000), noise(140, 1_000_000_000, 5)]));
        found.add(PlatformRecording::Latency { greatest: 27_000, count: 3000 });
        found.add(PlatformRecording::Latency { greatest: 15_500, count: 3000 });
        let text = found.text();
        let entry = "name = \"noise of CPU 1\"\npriority = 99\nperiod = \"950 ms\"\ntime = \"91 us\"\njitter = \"950 ms\"";
        assert!(text.contains(entry) && text.contains("cpus = [1]\n"), "{text}");
        // No noise is no entry, whose time would be 0.
        assert_eq!(text.matches("[[platform.other]]").count(), 1, "{text}");
        assert!(text.contains("[overhead]\ndispatch = 0.027\n"), "{text}");
        assert!(text.contains("# - CPUs other than 1, 2, 141\n"), "{text}");
        assert!(text.contains("rarer than 1 in 2000 wake-ups") && text.contains("beyond the 128"), "{text}");
    }
}
