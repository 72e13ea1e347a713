//! `mauve platform import FILE…`: what interrupts the activities of a robot on this computer, as entries to paste.
//!
//! **Noise.** `rtla osnoise` measures the time for which a thread is interrupted in each sample of P (its runtime). A busy window
//! may touch two samples of which each has the greatest noise N, so the entry has `time` N, `period` P and `jitter` P: at most 2 N
//! in any time up to P, and one N more for each further P. Nothing says how close together the noise of a sample was, so a long sample
//! gives a long job, however short each interruption was: of several recordings of a CPU, the one with the shortest samples counts,
//! with as much noise as the others need.
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

/// Measures noise in short samples, and each interruption. A tenth of each is left to ordinary threads.
const MEASURE_NOISE: &str = "rtla osnoise top -q -P F:1 -T 1 -p 1000 -r 900 -d 1h > noise.txt";

/// Longer samples say little of activities with short periods, in nanoseconds.
const LONG_SAMPLE: u64 = 10_000_000;

/// The greatest values of all files.
#[derive(Debug, Default)]
struct MeasuredPlatform {
    noise: BTreeMap<u32, Vec<Noise>>,
    /// The greatest latency, and the number of wake-ups.
    latency: Option<(u64, u64)>,
    has_single_noise: bool,
    has_software_noise: bool,
}

impl MeasuredPlatform {
    fn add(&mut self, recording: PlatformRecording) {
        self.has_software_noise |= matches!(&recording, PlatformRecording::Noise(all) if !all.is_empty());
        match recording {
            PlatformRecording::HardwareNoise(all) | PlatformRecording::Noise(all) => {
                all.into_iter().for_each(|it| self.noise.entry(it.cpu).or_default().push(it));
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
        let noise: Vec<Noise> = self.noise.values().filter_map(|it| covering(it)).collect();
        let noisy = noise.iter().filter(|it| it.greatest > 0 && it.cpu < CpuSet::MOST);
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
        let is_coarse = |it: &&Noise| it.sample > LONG_SAMPLE && it.greatest > it.single.saturating_mul(2);
        let coarse = noise.iter().filter(is_coarse).map(|it| {
            let (greatest, single, sample) =
                (duration(it.greatest), duration(it.single), duration(it.sample));
            format!(
                "#   CPU {}: {greatest} in {sample}, at most {single} at once\n",
                it.cpu.saturating_add(1)
            )
        });
        let coarse: String = coarse.collect();
        if !coarse.is_empty() {
            let _ = write!(
                out,
                "# How close together this noise was is not recorded, so that an entry has all of a sample at once:\n{coarse}\
                 # Samples of 1 ms show it: `{MEASURE_NOISE}`\n\n"
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
        if !self.has_software_noise {
            lines.push(format!(
                "interrupts and threads that are not in the model: `{MEASURE_NOISE}` measures them"
            ));
        }
        if !self.noise.is_empty() {
            let cpus: Vec<String> = self.noise.keys().map(|cpu| (u64::from(*cpu) + 1).to_string()).collect();
            lines.push(format!("CPUs other than {}", cpus.join(", ")));
            lines.push("interruptions of less than 5 µs, if `rtla` ran without `-T 1`".to_owned());
            lines.push("noise between the samples, if the runtime of `rtla osnoise` (-r) was shorter than its period (-p)".to_owned());
        }
        // Of a longer sample, only the average counts.
        let is_longer = |all: &Vec<Noise>| {
            let shortest = all.iter().map(|it| it.sample).min();
            all.iter().any(|it| Some(it.sample) > shortest && it.greatest > it.single)
        };
        if self.noise.values().any(is_longer) {
            lines.push(
                "noise that is closer together in long samples than in the short ones: record the short ones as long"
                    .to_owned(),
            );
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

/// Returns the noise of a CPU that covers what each of its recordings showed.
fn covering(recordings: &[Noise]) -> Option<Noise> {
    let mut found = recordings.iter().min_by_key(|it| it.sample)?.clone();
    for it in recordings {
        // In the time of a longer sample, the entry releases a job for each short sample, and one more. No job is shorter than a noise.
        let jobs =
            if it.sample > found.sample { it.sample.div_ceil(found.sample).saturating_add(1) } else { 1 };
        found.greatest = found.greatest.max(it.greatest.div_ceil(jobs)).max(it.single);
        found.single = found.single.max(it.single);
    }
    Some(found)
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
        let noise = |cpu, sample, greatest| Noise { cpu, sample, greatest, single: greatest / 2, count: 60 };
        found
            .add(PlatformRecording::Noise(vec![noise(0, 1_000_000_000, 91_000), noise(1, 1_000_000_000, 0)]));
        found.add(PlatformRecording::Noise(vec![noise(0, 950_000_000, 7000), noise(140, 1_000_000_000, 5)]));
        found.add(PlatformRecording::Latency { greatest: 27_000, count: 3000 });
        found.add(PlatformRecording::Latency { greatest: 15_500, count: 3000 });
        let text = found.text();
        // Three jobs of 950 ms in the two samples of a second, and a single noise of 45.5 µs.
        let entry = "name = \"noise of CPU 1\"\npriority = 99\nperiod = \"950 ms\"\ntime = \"45500 ns\"\njitter = \"950 ms\"";
        assert!(text.contains(entry) && text.contains("cpus = [1]\n"), "{text}");
        // No noise is no entry, whose time would be 0.
        assert_eq!(text.matches("[[platform.other]]").count(), 1, "{text}");
        assert!(text.contains("[overhead]\ndispatch = 0.027\n"), "{text}");
        assert!(text.contains("# - CPUs other than 1, 2, 141\n"), "{text}");
        assert!(text.contains("rarer than 1 in 2000 wake-ups") && text.contains("beyond the 128"), "{text}");
    }

    /// The jobs of an entry in any window are at least what a recording shows there: the sum of a sample in a window as long, and a
    /// single noise in the shortest one. The number of jobs is counted here, at the releases.
    #[test]
    fn an_entry_covers_each_recording() {
        let recordings = [
            (900_000_000, 90_000_000, 56_000),
            (900_000, 61_000, 50_000),
            (900_000, 62_000, 12_000),
            (9_000_000, 90_000, 80_000),
        ];
        for order in [[0, 1, 2, 3], [3, 2, 1, 0], [1, 3, 0, 2], [2, 0, 3, 1]] {
            let mut found = MeasuredPlatform::default();
            for (sample, greatest, single) in order.map(|index| recordings[index]) {
                found.add(PlatformRecording::Noise(vec![Noise {
                    cpu: 0,
                    sample,
                    greatest,
                    single,
                    count: 9,
                }]));
            }
            let it = covering(&found.noise[&0]).unwrap();
            assert_eq!((it.sample, it.greatest), (900_000, 89_911), "{order:?}");
            for (sample, greatest, single) in recordings {
                // The first job is late by a jitter of a period, so that it meets the second.
                let releases =
                    1 + (0..).map(|job| job * it.sample).take_while(|at| *at < sample).count() as u64;
                assert!(it.greatest >= single && releases * it.greatest >= greatest);
            }
            assert!(!found.text().contains("at once"), "{}", found.text());
            assert!(found.text().contains("# - noise that is closer together in long samples"));
        }
        let mut long = MeasuredPlatform::default();
        let noise = Noise { cpu: 0, sample: 900_000_000, greatest: 6_978_000, single: 56_000, count: 59 };
        long.add(PlatformRecording::HardwareNoise(vec![noise]));
        let text = long.text();
        assert!(text.contains("time = \"6978 us\"") && text.contains("-p 1000 -r 900"), "{text}");
        assert!(text.contains("# - interrupts and threads that are not in the model"), "{text}");
        assert!(!text.contains("closer together"), "{text}");
    }
}
