//! `mauve platform check`: which assumptions about the computer hold, by the files of the kernel.
//!
//! ```text
//! good     kernel     PREEMPT_RT (6.1.0-rt5-amd64)
//! bad      throttling real-time threads get 950 ms of each 1000 ms: run `sysctl -w kernel.sched_rt_runtime_us=-1`, or …
//! unknown  frequency  the kernel does not show a governor
//! ```

use std::fmt::Write as _;
use std::fs::File;
use std::io::Read as _;
use std::path::PathBuf;

use mauve_projects::json::{self, object};
use mauve_projects::output::Output;
use mauve_timing::{CpuSet, Time};

use crate::options::TableFormat;
use crate::text::wrapped;

#[derive(Debug, clap::Args)]
pub struct PlatformCheck {
    /// How to show the properties.
    #[arg(long, value_enum, default_value = "table")]
    format: TableFormat,
    /// Read the files of the kernel below this folder, for tests.
    #[arg(long, hide = true, default_value = "/")]
    root: PathBuf,
}

impl PlatformCheck {
    pub(crate) fn run(self) -> Result<Output, String> {
        let properties = properties(&Kernel { root: self.root });
        let code = u8::from(properties.iter().any(|(_, it)| it.state == PropertyState::Bad));
        match self.format {
            TableFormat::Table => Ok(Output::escaped(table(&properties), code)),
            TableFormat::Json => {
                let checks = properties.iter().map(|(name, it)| {
                    object! { property: *name, state: it.state.word(), found: it.found.clone(), mend: it.mend }
                });
                Ok(Output::verbatim(json::text(&object! { checks: checks.collect::<Vec<_>>() })?, code))
            }
        }
    }
}

/// Returns the CPUs that this process, and so a program that it starts, may use.
pub(crate) fn available_cpus() -> Option<CpuSet> {
    let status = Kernel { root: "/".into() }.text("proc/self/status")?;
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"))?;
    let part = |part: &str| {
        let (first, last) = part.trim().split_once('-').unwrap_or((part.trim(), part.trim()));
        let end = last.parse::<u32>().ok()?.saturating_add(1);
        Some(CpuSet::first_few(end) - CpuSet::first_few(first.parse().ok()?))
    };
    list.split(',').map(part).collect()
}

fn table(properties: &[(&str, Property)]) -> String {
    let mut out = String::new();
    for (name, it) in properties {
        let fix = it.mend.map_or_else(String::new, |fix| format!(": {fix}"));
        let _ = writeln!(out, "{:<8} {:<12} {}{fix}", it.state.word(), name, it.found);
    }
    wrapped(&out)
}

/// A property of the computer.
struct Property {
    state: PropertyState,
    /// What was found.
    found: String,
    /// What to do.
    mend: Option<&'static str>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PropertyState {
    Good,
    Bad,
    Unknown,
}

impl PropertyState {
    fn word(self) -> &'static str {
        match self {
            PropertyState::Good => "good",
            PropertyState::Bad => "bad",
            PropertyState::Unknown => "unknown",
        }
    }
}

fn good(found: String) -> Property {
    Property { state: PropertyState::Good, found, mend: None }
}

fn bad(found: String, mend: &'static str) -> Property {
    Property { state: PropertyState::Bad, found, mend: Some(mend) }
}

fn unknown(found: &str, mend: Option<&'static str>) -> Property {
    Property { state: PropertyState::Unknown, found: found.to_owned(), mend }
}

/// The files of the kernel.
struct Kernel {
    root: PathBuf,
}

impl Kernel {
    /// Returns the text of a file without the white space around it; `None` if it cannot be read.
    fn text(&self, path: &str) -> Option<String> {
        Some(String::from_utf8_lossy(&self.bytes(path)?).trim().to_owned())
    }

    fn bytes(&self, path: &str) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        File::open(self.root.join(path)).ok()?.take(1 << 16).read_to_end(&mut bytes).ok()?;
        Some(bytes)
    }

    /// Returns the entries of a folder that have this name and a number, in the order of their numbers.
    fn numbered(&self, folder: &str, name: &str) -> Vec<(u32, String)> {
        let entries = self.root.join(folder).read_dir().into_iter().flatten().flatten();
        let number = |entry: std::fs::DirEntry| {
            let file = entry.file_name().into_string().ok()?;
            Some((file.strip_prefix(name)?.parse().ok()?, format!("{folder}/{file}")))
        };
        let mut found: Vec<(u32, String)> = entries.filter_map(number).collect();
        found.sort_unstable();
        found
    }
}

const CPUS: &str = "sys/devices/system/cpu";

fn properties(of: &Kernel) -> [(&'static str, Property); 8] {
    [
        ("kernel", kernel(of)),
        ("throttling", throttling(of)),
        ("frequency", frequency(of)),
        ("sleep", sleep(of)),
        ("SMT", siblings(of)),
        ("priorities", right(of, "Max realtime priority", CAP_SYS_NICE, RTPRIO)),
        ("memory lock", right(of, "Max locked memory", CAP_IPC_LOCK, MEMLOCK)),
        ("clock", clock(of)),
    ]
}

fn kernel(of: &Kernel) -> Property {
    let Some(version) = of.text("proc/sys/kernel/version") else {
        return unknown("the kernel does not show its version", None);
    };
    let release = of.text("proc/sys/kernel/osrelease").unwrap_or_default();
    // The patch had the file, and the mainline kernel (6.12) has the word.
    if of.text("sys/kernel/realtime").as_deref() == Some("1") || version.contains("PREEMPT_RT") {
        return good(format!("PREEMPT_RT ({release})"));
    }
    bad(
        format!("no PREEMPT_RT ({release}): its latency has no bound"),
        "install a kernel with PREEMPT_RT (Debian: linux-image-rt-amd64; Ubuntu: `pro enable realtime-kernel`), or measure the latency under load, and read it with `mauve platform import`",
    )
}

/// Reads how much of a period ordinary threads have for themselves. From Linux 6.12 on it is a deadline server of each CPU, which
/// `sched_rt_runtime_us` does not change (`Documentation/scheduler/sched-deadline.rst`); before, throttling of real-time threads.
fn throttling(of: &Kernel) -> Property {
    let servers: Vec<String> = of
        .numbered("sys/kernel/debug/sched/fair_server", "cpu")
        .into_iter()
        .filter_map(|(_, path)| of.text(&format!("{path}/runtime")))
        .collect();
    if let Some(time) = servers.iter().find(|time| *time != "0") {
        return bad(
            format!("the deadline server of ordinary threads takes {time} ns of each second"),
            "write 0 to `runtime` of each CPU in /sys/kernel/debug/sched/fair_server, or write `rt_throttling = true` in [platform]",
        );
    }
    let release = of.text("proc/sys/kernel/osrelease").unwrap_or_default();
    let mut numbers = release.split(|it: char| !it.is_ascii_digit()).map_while(|it| it.parse::<u32>().ok());
    if servers.is_empty() && (numbers.next(), numbers.next()) >= (Some(6), Some(12)) {
        let status = of.text("proc/self/status").unwrap_or_default();
        let users = status.lines().find_map(|line| line.strip_prefix("Uid:"));
        if users.and_then(|users| users.split_whitespace().nth(1)) == Some("0") {
            return unknown(
                "the kernel does not show its deadline server of ordinary threads",
                Some(
                    "run `mount -t debugfs none /sys/kernel/debug`, on the computer and not in a container, or write `rt_throttling = true` in [platform]",
                ),
            );
        }
        return unknown(
            "the deadline server of ordinary threads is visible to root only",
            Some("run this check with sudo, or write `rt_throttling = true` in [platform]"),
        );
    }
    let number = |path: &str| of.text(path)?.parse::<i64>().ok();
    match (number("proc/sys/kernel/sched_rt_runtime_us"), number("proc/sys/kernel/sched_rt_period_us")) {
        (Some(runtime), _) if runtime < 0 => good("off: real-time threads get all of the time".to_owned()),
        (Some(runtime), Some(period)) if runtime >= period => {
            good("real-time threads get all of the time".to_owned())
        }
        (Some(runtime), Some(period)) => bad(
            format!("real-time threads get {} of each {}", microseconds(runtime), microseconds(period)),
            "run `sysctl -w kernel.sched_rt_runtime_us=-1`, or write `rt_throttling = true` in [platform]",
        ),
        _ if !servers.is_empty() => good("off: no deadline server takes time".to_owned()),
        _ => unknown("the kernel does not show it", None),
    }
}

fn microseconds(time: i64) -> Time {
    Time::from_nanos(time.unsigned_abs().saturating_mul(1000))
}

fn frequency(of: &Kernel) -> Property {
    let governors = of
        .numbered(CPUS, "cpu")
        .into_iter()
        .filter_map(|(number, path)| Some((number, of.text(&format!("{path}/cpufreq/scaling_governor"))?)));
    let governors: Vec<(u32, String)> = governors.collect();
    match governors.iter().find(|(_, governor)| governor != "performance") {
        Some((cpu, governor)) => bad(
            format!("CPU {} has the governor `{governor}`", cpu + 1),
            "run `cpupower frequency-set -g performance` (Debian: linux-cpupower; Ubuntu: linux-tools-common; Fedora: kernel-tools): execution times are those of one frequency",
        ),
        None if governors.is_empty() => unknown(
            "the kernel shows no governor",
            Some("on a virtual machine, ask its host; elsewhere, fix the frequency in the firmware"),
        ),
        None => good("all CPUs have the governor `performance`".to_owned()),
    }
}

/// A sleep with a longer way back delays the first thread after it noticeably, in microseconds.
const LONGEST_EXIT: u64 = 10;

fn sleep(of: &Kernel) -> Property {
    let mut deepest: Option<(u64, u32, String)> = None;
    let mut has_states = false;
    // A process may hold the file open, so that no CPU sleeps deeper.
    let request = of.bytes("dev/cpu_dma_latency").and_then(|bytes| bytes.first_chunk::<4>().copied());
    let most = request.map(i32::from_le_bytes).and_then(|most| u64::try_from(most).ok()).unwrap_or(u64::MAX);
    for (cpu, path) in of.numbered(CPUS, "cpu") {
        for (_, state) in of.numbered(&format!("{path}/cpuidle"), "state") {
            has_states = true;
            let text = |file: &str| of.text(&format!("{state}/{file}")).unwrap_or_default();
            let exit = text("latency").parse::<u64>().unwrap_or(u64::MAX);
            let is_used = text("disable") != "1" && exit <= most;
            if is_used && deepest.as_ref().is_none_or(|(longest, ..)| exit > *longest) {
                deepest = Some((exit, cpu, text("name")));
            }
        }
    }
    let driver = of.text(&format!("{CPUS}/cpuidle/current_driver"));
    match deepest {
        Some((exit, cpu, name)) if exit > LONGEST_EXIT => bad(
            format!("CPU {} may sleep in `{name}`, from which it wakes within {exit} µs", cpu + 1),
            "keep /dev/cpu_dma_latency open with a 0 in it, or boot with `processor.max_cstate=1 intel_idle.max_cstate=0`",
        ),
        None if !has_states && driver.as_deref() != Some("none") => {
            unknown("the kernel does not show its states of sleep", None)
        }
        _ => good(format!("CPUs wake within {LONGEST_EXIT} µs")),
    }
}

fn siblings(of: &Kernel) -> Property {
    match of.text(&format!("{CPUS}/smt/active")).as_deref() {
        Some("0") => good("off: no two CPUs share a core".to_owned()),
        Some("1") => bad(
            "two CPUs share a core, so that each slows the other down".to_owned(),
            "run `echo off > /sys/devices/system/cpu/smt/control`, or switch it off in the firmware",
        ),
        _ => unknown("the kernel does not show it", None),
    }
}

/// The bits of capabilities that replace a limit (`include/uapi/linux/capability.h`).
const CAP_SYS_NICE: u32 = 23;
const CAP_IPC_LOCK: u32 = 14;

const RTPRIO: &str = "add `@realtime - rtprio 99` to /etc/security/limits.conf, and yourself to the group: `groupadd -f realtime; usermod -aG realtime $USER`";
const MEMLOCK: &str = "add `@realtime - memlock unlimited` to /etc/security/limits.conf, and yourself to the group: `groupadd -f realtime; usermod -aG realtime $USER`";

/// Reads a limit of this process: its line in `/proc/self/limits` has the name, the limit, and the greatest one.
fn right(of: &Kernel, limit: &str, capability: u32, mend: &'static str) -> Property {
    let status = of.text("proc/self/status").unwrap_or_default();
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    let mask = effective.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    if mask.is_some_and(|mask| mask >> capability & 1 == 1) {
        return good("allowed, by a capability".to_owned());
    }
    let limits = of.text("proc/self/limits").unwrap_or_default();
    let line = limits.lines().find_map(|line| line.strip_prefix(limit));
    let greatest = line.and_then(|line| line.split_whitespace().nth(1));
    match greatest {
        Some("unlimited") => good("allowed".to_owned()),
        // Activities have priorities up to 99.
        Some("99") if capability == CAP_SYS_NICE => good("allowed, up to 99".to_owned()),
        Some(most) => bad(format!("allowed up to {most} only"), mend),
        None => unknown("the kernel does not show the limit", None),
    }
}

fn clock(of: &Kernel) -> Property {
    let source = of.text("sys/devices/system/clocksource/clocksource0/current_clocksource");
    match source.as_deref() {
        Some(fast @ ("tsc" | "arch_sys_counter" | "kvm-clock" | "riscv_clocksource")) => {
            good(format!("`{fast}`, which is read within nanoseconds"))
        }
        Some(slow @ ("hpet" | "acpi_pm" | "jiffies" | "refined-jiffies")) => bad(
            format!("`{slow}`, which is slow or coarse: measured times have its steps"),
            "boot with `tsc=reliable` if the processor has a stable counter",
        ),
        Some(other) => unknown(other, None),
        None => unknown("the kernel does not show it", None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A computer with these files.
    fn computer(name: &str, files: &[(&str, &str)]) -> [(&'static str, Property); 8] {
        let root = std::env::temp_dir().join(format!("mauve-platform-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&root);
        std::fs::create_dir_all(&root).unwrap();
        for (path, text) in files {
            let path = root.join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        let found = properties(&Kernel { root: root.clone() });
        std::fs::remove_dir_all(root).unwrap();
        found
    }

    fn states(properties: &[(&'static str, Property)]) -> Vec<(&'static str, PropertyState)> {
        properties.iter().map(|(name, it)| (*name, it.state)).collect()
    }

    const GOOD: [(&str, &str); 14] = [
        ("proc/sys/kernel/version", "#1 SMP PREEMPT_RT Debian 6.1.99-1\n"),
        ("proc/sys/kernel/osrelease", "6.1.0-rt5-amd64\n"),
        ("proc/sys/kernel/sched_rt_runtime_us", "-1\n"),
        ("proc/sys/kernel/sched_rt_period_us", "1000000\n"),
        ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n"),
        ("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "performance\n"),
        ("sys/devices/system/cpu/cpu0/cpuidle/state0/latency", "1\n"),
        ("sys/devices/system/cpu/cpu0/cpuidle/state1/latency", "133\n"),
        ("sys/devices/system/cpu/cpu0/cpuidle/state1/disable", "1\n"),
        ("sys/devices/system/cpu/cpu0/cpuidle/state1/name", "C6\n"),
        ("sys/devices/system/cpu/smt/active", "0\n"),
        ("proc/self/status", "Name:\tmauve\nCapEff:\t0000000000000000\n"),
        (
            "proc/self/limits",
            "Limit                     Soft Limit           Hard Limit           Units     \n\
             Max locked memory         65536                unlimited            bytes     \n\
             Max realtime priority     0                    99                   \n",
        ),
        ("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n"),
    ];

    /// The same computer with other texts in some files.
    fn changed(name: &str, changes: &[(&str, &str)]) -> [(&'static str, Property); 8] {
        let mut files = GOOD.to_vec();
        for (path, text) in changes {
            files.retain(|(known, _)| known != path);
            files.push((path, text));
        }
        computer(name, &files)
    }

    #[test]
    fn a_good_computer_and_an_empty_one() {
        let found = changed("good", &[]);
        assert!(found.iter().all(|(_, it)| it.state == PropertyState::Good), "{:?}", states(&found));
        let found = computer("empty", &[]);
        assert!(found.iter().all(|(_, it)| it.state == PropertyState::Unknown), "{:?}", states(&found));
    }

    #[test]
    fn each_property_may_be_bad() {
        for (name, path, text, said) in [
            (
                "kernel",
                "proc/sys/kernel/version",
                "#1 SMP PREEMPT_DYNAMIC",
                "no PREEMPT_RT (6.1.0-rt5-amd64)",
            ),
            ("throttling", "proc/sys/kernel/sched_rt_runtime_us", "950000", "950 ms of each 1000 ms"),
            ("throttling", "sys/kernel/debug/sched/fair_server/cpu1/runtime", "50000000", "50000000 ns"),
            (
                "frequency",
                "sys/devices/system/cpu/cpu1/cpufreq/scaling_governor",
                "schedutil",
                "CPU 2 has the governor `schedutil`",
            ),
            (
                "sleep",
                "sys/devices/system/cpu/cpu0/cpuidle/state1/disable",
                "0",
                "`C6`, from which it wakes within 133",
            ),
            ("SMT", "sys/devices/system/cpu/smt/active", "1", "share a core"),
            ("priorities", "proc/self/limits", "Max realtime priority     0      0\n", "up to 0 only"),
            (
                "memory lock",
                "proc/self/limits",
                "Max locked memory  65536   8388608   bytes\n",
                "up to 8388608 only",
            ),
            (
                "clock",
                "sys/devices/system/clocksource/clocksource0/current_clocksource",
                "hpet",
                "`hpet`, which is slow or coarse",
            ),
        ] {
            let found = changed("bad", &[(path, text)]);
            let bad: Vec<_> = found.iter().filter(|(_, it)| it.state == PropertyState::Bad).collect();
            let [(property, bad)] = &bad[..] else { panic!("{path}: {:?}", states(&found)) };
            assert!(
                *property == name && bad.found.contains(said) && bad.mend.is_some(),
                "{path}: {}",
                bad.found
            );
        }
    }

    #[test]
    fn other_forms_of_good() {
        let deep = ("sys/devices/system/cpu/cpu0/cpuidle/state1/disable", "0");
        for changes in [
            &[("proc/sys/kernel/version", "#1 SMP"), ("sys/kernel/realtime", "1")][..],
            // A process keeps the CPUs awake.
            &[deep, ("dev/cpu_dma_latency", "\u{5}\0\0\0")],
            &[("proc/self/limits", ""), ("proc/self/status", "CapEff:\t0000000000804000\n")],
            &[("proc/sys/kernel/sched_rt_runtime_us", "1000000")],
        ] {
            let found = changed("forms", changes);
            assert!(
                found.iter().all(|(_, it)| it.state == PropertyState::Good),
                "{changes:?}: {:?}",
                states(&found)
            );
        }
        // The server of a newer kernel is not visible.
        let found = changed("newer", &[("proc/sys/kernel/osrelease", "6.12.3")]);
        assert_eq!(states(&found)[1], ("throttling", PropertyState::Unknown));
        assert!(found[1].1.found.contains("root only"));
        let root = ("proc/self/status", "Uid:\t0\t0\t0\t0\nCapEff:\t0000000000804000\n");
        let found = changed("root", &[("proc/sys/kernel/osrelease", "6.12.3"), root]);
        assert_eq!(states(&found)[1], ("throttling", PropertyState::Unknown));
        assert!(!found[1].1.found.contains("root") && found[1].1.mend.is_some_and(|it| it.contains("mount")));
        for (runtime, said) in [("0", "get 0 ms of each 1000 ms"), ("500", "get 0.5 ms of each 1000 ms")] {
            let found = changed("short", &[("proc/sys/kernel/sched_rt_runtime_us", runtime)]);
            assert!(found[1].1.found.contains(said), "{}", found[1].1.found);
        }
        let server = ("sys/kernel/debug/sched/fair_server/cpu0/runtime", "0");
        let found = changed("newest", &[("proc/sys/kernel/osrelease", "7.0"), server]);
        assert_eq!(states(&found)[1], ("throttling", PropertyState::Good));
    }
}
