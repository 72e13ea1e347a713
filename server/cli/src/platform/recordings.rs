//! What `rtla` and `cyclictest` print.
//!
//! The formats are those of `tools/tracing/rtla/src/*_top.c` and `*_hist.c` in the sources of Linux, and of `cyclictest.c` in
//! rt-tests:
//!
//! ```text
//!                                          Operating System Noise
//! duration:   0 00:01:00 | time is in us
//! CPU Period       Runtime        Noise  % CPU Aval   Max Noise   Max Single          HW          NMI          IRQ …
//!   0 #58         52200000         1031    99.99802          91           60           0            0        52285 …
//! ```
//! ```text
//!                                      Timer Latency
//!   0 00:00:10   |          IRQ Timer Latency (us)        |         Thread Timer Latency (us)
//! CPU COUNT      |      cur       min       avg       max |      cur       min       avg       max
//!   0 #9876      |        0         0         1        15 |        5         2         6        31
//! ```
//! ```text
//! # RTLA timerlat histogram
//! # Time unit is microseconds (us)
//! Index   IRQ-000   Thr-000
//! 0          9000         0
//! over:         0         0
//! count:     9876      9876
//! max:         15        31
//! ```
//! ```text
//! # Total: 000100000 000100000
//! # Max Latencies: 00027 00015
//! # Histogram Overflows: 00000 00000
//! ```

use std::collections::BTreeMap;
use std::str::FromStr;

use serde_json::Value;

/// What a file has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum PlatformRecording {
    /// `rtla osnoise top`: for each CPU, what interrupted a thread.
    Noise(Vec<Noise>),
    /// `rtla hwnoise`: the same with interrupts off, so that only the hardware did.
    HardwareNoise(Vec<Noise>),
    /// `rtla osnoise hist`: single interruptions, without the time between them.
    SingleNoise,
    /// The greatest latency of a wake-up in nanoseconds, and the number of wake-ups.
    Latency { greatest: u64, count: u64 },
}

/// The noise of one CPU.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Noise {
    /// The number of the CPU, from 0.
    pub(super) cpu: u32,
    /// The length of a sample, in nanoseconds.
    pub(super) sample: u64,
    /// The greatest noise in a sample, in nanoseconds.
    pub(super) greatest: u64,
    /// The longest noise without a break, in nanoseconds.
    pub(super) single: u64,
    /// How many samples there were.
    pub(super) count: u64,
}

/// A time of more than this many units is none.
const MOST: u64 = 1 << 50;

/// Reads a file; `Err` says why it is not a recording.
pub(super) fn read(text: &str) -> Result<PlatformRecording, &'static str> {
    let has = |words: &str| text.contains(words);
    match () {
        () if has("Operating System Noise") => noise(text).map(PlatformRecording::Noise),
        () if has("Hardware-related Noise") => noise(text).map(PlatformRecording::HardwareNoise),
        () if has("RTLA osnoise histogram") => Ok(PlatformRecording::SingleNoise),
        () if has("RTLA timerlat histogram") => timerlat_histogram(text),
        () if has("Timer Latency") => timerlat_top(text),
        () if has("\"resolution_in_ns\"") => cyclictest_json(text),
        () if has("# Max Latencies:") || has(" Max:") => cyclictest(text),
        () => Err(
            "it is none of the outputs of `rtla osnoise top`, `rtla hwnoise`, `rtla timerlat top` or `hist`, and `cyclictest`",
        ),
    }
}

/// How many nanoseconds the unit of a file has.
fn unit(text: &str) -> u64 {
    let is_nano =
        ["time is in ns", "Time unit is nanoseconds", "Latency (ns)"].iter().any(|it| text.contains(it));
    if is_nano { 1 } else { 1000 }
}

fn number<T: FromStr>(word: &str) -> Option<T> {
    word.parse().ok()
}

/// Reads a time, and returns it in nanoseconds.
fn time(word: &str, unit: u64) -> Option<u64> {
    number::<u64>(word).filter(|time| *time < MOST)?.checked_mul(unit)
}

fn noise(text: &str) -> Result<Vec<Noise>, &'static str> {
    let unit = unit(text);
    let row = |line: &str| {
        let mut words = line.split_whitespace();
        let cpu = number(words.next()?)?;
        let count = number::<u64>(words.next()?.strip_prefix('#')?).filter(|count| *count > 0)?;
        let runtime = time(words.next()?, unit)?;
        // Noise, and the share of the CPU.
        let greatest = time(words.nth(2)?, unit)?;
        let single = time(words.next()?, unit)?;
        Some((cpu, Noise { cpu, sample: runtime / count, greatest, single, count }))
    };
    // Without -q, the table is printed again and again, and its values grow.
    let found: BTreeMap<u32, Noise> = text.lines().filter_map(row).collect();
    match found.values().all(|it| it.sample > 0) {
        _ if found.is_empty() => Err("it has no line of a CPU: let `rtla osnoise top` end, with -q and -d"),
        false => Err("a sample has no length: it is not an output of `rtla osnoise top`"),
        true => Ok(found.into_values().collect()),
    }
}

fn latency(
    rows: impl Iterator<Item = (u64, u64)>,
    missing: &'static str,
) -> Result<PlatformRecording, &'static str> {
    let of_all = rows.reduce(|(count, greatest), row| (count.saturating_add(row.0), greatest.max(row.1)));
    let (count, greatest) = of_all.ok_or(missing)?;
    Ok(PlatformRecording::Latency { greatest, count })
}

fn timerlat_top(text: &str) -> Result<PlatformRecording, &'static str> {
    let unit = unit(text);
    let row = |line: &str| {
        let mut parts = line.split('|');
        let mut words = parts.next()?.split_whitespace();
        let cpu = number::<u32>(words.next()?)?;
        let count = number::<u64>(words.next()?.strip_prefix('#')?)?;
        // Of the interrupt, the thread, and with -u the return to the user's program: current, least, mean and greatest.
        let greatest = parts.filter_map(|part| time(part.split_whitespace().nth(3)?, unit)).max()?;
        Some((cpu, (count, greatest)))
    };
    let found: BTreeMap<u32, (u64, u64)> = text.lines().filter_map(row).collect();
    latency(found.into_values(), "it has no line of a CPU: let `rtla timerlat top` end, with -q and -d")
}

fn timerlat_histogram(text: &str) -> Result<PlatformRecording, &'static str> {
    const MISSING: &str =
        "it has no lines `count:` and `max:`: let `rtla timerlat hist` end, without --no-summary";
    let unit = unit(text);
    // The sums of all CPUs follow.
    let of_cpus = text.split("ALL:").next().unwrap_or_default();
    let values = |name: &str| {
        let line = of_cpus.lines().find_map(|line| line.trim_start().strip_prefix(name));
        line.map(|line| line.split_whitespace().collect::<Vec<_>>())
    };
    let (Some(counts), Some(greatest)) = (values("count:"), values("max:")) else { return Err(MISSING) };
    // A column without a wake-up has a dash.
    let row = |(count, greatest): (&&str, &&str)| Some((number::<u64>(count)?, time(greatest, unit)?));
    let rows: Vec<(u64, u64)> = counts.iter().zip(&greatest).filter_map(row).collect();
    // Each wake-up is in several columns.
    let of_all = rows.into_iter().reduce(|one, other| (one.0.max(other.0), one.1.max(other.1)));
    let (count, greatest) = of_all.ok_or(MISSING)?;
    Ok(PlatformRecording::Latency { greatest, count })
}

fn cyclictest(text: &str) -> Result<PlatformRecording, &'static str> {
    const MISSING: &str = "it has no latency: let `cyclictest` end, with -q";
    let values = |name: &str| {
        let line = text.lines().find_map(|line| line.trim_start().strip_prefix(name));
        line.into_iter().flat_map(str::split_whitespace)
    };
    if text.contains("# Max Latencies:") {
        let count = values("# Total:").filter_map(number::<u64>).fold(0, u64::saturating_add);
        let greatest = values("# Max Latencies:").map(|word| time(word, 1000)).collect::<Option<Vec<u64>>>();
        let greatest = greatest.and_then(|all| all.into_iter().max()).ok_or(MISSING)?;
        return Ok(PlatformRecording::Latency { greatest, count });
    }
    // T: 0 ( 1234) P:99 I:1000 C: 100000 Min:      3 Act:    5 Avg:    4 Max:      27
    let row = |line: &str| {
        let (thread, line) = line.split_once("T:")?.1.split_once('(')?;
        let after = |name: &str| line.split_once(name)?.1.split_whitespace().next();
        Some((number::<u32>(thread.trim())?, (number(after(" C:")?)?, time(after(" Max:")?, 1000)?)))
    };
    // Without -q, the line of a thread is printed again and again, and its values grow.
    let mut threads: BTreeMap<u32, (u64, u64)> = BTreeMap::new();
    for (thread, (count, greatest)) in text.lines().filter_map(row) {
        let known = threads.entry(thread).or_default();
        *known = (known.0.max(count), known.1.max(greatest));
    }
    latency(threads.into_values(), MISSING)
}

/// Reads the file of `cyclictest --json`, which says its unit.
fn cyclictest_json(text: &str) -> Result<PlatformRecording, &'static str> {
    const MISSING: &str = "it has no latency: let `cyclictest --json` end";
    let document: Value = serde_json::from_str(text).map_err(|_| MISSING)?;
    let unit = if document["resolution_in_ns"] == 1 { 1 } else { 1000 };
    let row = |thread: &Value| Some((thread["cycles"].as_u64()?, time(&thread["max"].to_string(), unit)?));
    let threads = document["thread"].as_object().ok_or(MISSING)?;
    // A thread that cannot be read may be the one with the greatest latency.
    let rows: Option<Vec<(u64, u64)>> = threads.values().map(row).collect();
    latency(rows.ok_or(MISSING)?.into_iter(), MISSING)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_noise_of_each_cpu() {
        let text = "                Operating System Noise\n\
            duration:   0 00:00:03 | time is in us\n\
            CPU Period       Runtime        Noise  % CPU Aval   Max Noise   Max Single          HW          NMI          IRQ      Softirq       Thread\n\
            \x20 0 #1          1000000           20    99.99802           9            6           0            0         1000            0            3\n\
            \x20 0 #3          2700000         1031    99.99802          91           60           0            0        52285            0          101\n\
            \x20 2 #3          2700000            5    99.99999           5            5           0            9        53122            0           18\n";
        let of = |cpu, greatest, single| Noise { cpu, sample: 900_000_000, greatest, single, count: 3 };
        let found = vec![of(0, 91_000, 60_000), of(2, 5000, 5000)];
        assert_eq!(read(text), Ok(PlatformRecording::Noise(found.clone())));
        let hardware = text.replace("Operating System Noise", "Hardware-related Noise");
        assert_eq!(read(&hardware), Ok(PlatformRecording::HardwareNoise(found)));
        let nanoseconds = text.replace("time is in us", "time is in ns");
        let Ok(PlatformRecording::Noise(found)) = read(&nanoseconds) else { panic!() };
        assert_eq!((found[0].sample, found[0].greatest), (900_000, 91));
        assert!(read(&text[..120]).is_err());
    }

    #[test]
    fn latencies_of_rtla() {
        let top = "                Timer Latency\n\
            \x20 0 00:00:10   |          IRQ Timer Latency (us)        |         Thread Timer Latency (us)\n\
            CPU COUNT      |      cur       min       avg       max |      cur       min       avg       max\n\
            \x20 0 #9876      |        0         0         1        15 |        5         2         6        31\n\
            \x20 1 #9875      |        0         0         1        45 |        5         2         6        29\n\
            ---------------|----------------------------------------|---------------------------------------\n\
            ALL #19751  e0 |                  0         1        45 |                  2         6        31\n";
        assert_eq!(read(top), Ok(PlatformRecording::Latency { greatest: 45_000, count: 19_751 }));
        let histogram = "# RTLA timerlat histogram\n# Time unit is microseconds (us)\n# Duration:   0 00:00:10\n\
            Index   IRQ-000   Thr-000   IRQ-001   Thr-001\n\
            0          9000         0         0         0\n\
            20            0      9876         0         0\n\
            over:         1         0         0         0\n\
            count:     9876      9876         0         0\n\
            min:          0         2         -         -\n\
            avg:          1         6         -         -\n\
            max:        260        31         -         -\n\
            ALL:        IRQ       Thr\n\
            count:    99999     99999\n\
            max:        260        31\n";
        assert_eq!(read(histogram), Ok(PlatformRecording::Latency { greatest: 260_000, count: 9876 }));
        let cut = histogram.split("max:").next().unwrap();
        assert!(read(cut).is_err_and(|why| why.contains("`max:`")));
        assert_eq!(read("# RTLA osnoise histogram\nIndex   CPU-000\n"), Ok(PlatformRecording::SingleNoise));
    }

    #[test]
    fn latencies_of_cyclictest() {
        let histogram = "# /dev/cpu_dma_latency set to 0us\n# Histogram\n000007 000005\t000002\n000008 000095\t000098\n\
            # Total: 000000100 000000101\n# Min Latencies: 00007 00007\n# Avg Latencies: 00007 00008\n\
            # Max Latencies: 00008 00431\n# Histogram Overflows: 00000 00001\n# Thread 1: 00099\n";
        assert_eq!(read(histogram), Ok(PlatformRecording::Latency { greatest: 431_000, count: 201 }));
        let quiet = "# /dev/cpu_dma_latency set to 0us\n\
            T: 0 ( 3431) P:99 I:1000 C: 100000 Min:      5 Act:   10 Avg:   14 Max:      39242\n\
            T: 1 ( 3432) P:99 I:1500 C:  66934 Min:      4 Act:   10 Avg:   17 Max:         57\n";
        assert_eq!(read(quiet), Ok(PlatformRecording::Latency { greatest: 39_242_000, count: 166_934 }));
        // On a terminal, each line is printed again: the counts are those since the begin.
        let header = "policy: fifo: loadavg: 0.10 0.10 0.10 1/220 4242          \n\n";
        let threads = |count, most| {
            format!(
                "{header}T: 0 ( 4242) P:90 I:1000 C:{count:7} Min:      3 Act:    4 Avg:    4 Max:{most:8}\n\
                 T: 1 ( 4243) P:90 I:1500 C:{:7} Min:      3 Act:    4 Avg:    4 Max:      12\n",
                count / 2
            )
        };
        let live = format!("{}\u{1b}[4A{}\u{1b}[4A{}", threads(20, 41), threads(40, 41), threads(60, 55));
        assert_eq!(read(&live), Ok(PlatformRecording::Latency { greatest: 55_000, count: 90 }));
        // A cut line is no figure.
        assert!(read("# Max Latencies: 00008 00x").is_err());
        assert!(read("some text").is_err());
    }

    #[test]
    fn latencies_of_cyclictest_in_json() {
        let text = r#"{ "file_version": 1, "num_threads": 2, "resolution_in_ns": 0, "thread": {
            "0": { "histogram": {"3": 99, "41": 1}, "cycles": 100, "min": 3, "max": 41, "avg": 4.00, "cpu": 0 },
            "1": { "histogram": {}, "cycles": 66, "min": 3, "max": 57, "avg": 4.00, "cpu": 1 } } }"#;
        let latency = |greatest| Ok(PlatformRecording::Latency { greatest, count: 166 });
        assert_eq!(read(text), latency(57_000));
        assert_eq!(read(&text.replace("ns\": 0", "ns\": 1")), latency(57));
        // Of an unknown resolution, the greater unit.
        assert_eq!(read(&text.replace("ns\": 0", "ns\": \"0\"")), latency(57_000));
        assert!(read(&text.replace("\"max\": 57", "\"max\": \"x\"")).is_err());
        assert!(read(&text[..150]).is_err());
    }

    proptest! {
        #[test]
        fn any_text_is_read_without_a_panic(
            text in "(Operating System Noise|Timer Latency|RTLA timerlat histogram|# Max Latencies:|count:|max:|T: 0 C: | Max:|[ #|0-9-]{1,30}|\n){0,30}",
        ) {
            let _ = read(&text);
        }
    }
}
