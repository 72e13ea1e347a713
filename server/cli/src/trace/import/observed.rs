//! The file beside a sample file that keeps what recordings showed, `robot.observed.toml` beside `robot.samples`; and what an import
//! says of waits.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mauve_hir::{CONFIG_FILE, Database, File, toml_key};
use mauve_projects::disk;
use mauve_projects::load::load;
use mauve_projects::output::say;
use mauve_projects::replace::put;
use mauve_pwcet::trace::{Observation, SeenName, SpanKind, TraceReader, Wait, lock_of, port_of};
use mauve_timing::{
    LEAST_WORK, Observed, ObservedTimes, Recording, Table, UNSUSPICIOUS, Unit, digest_of, entry_for, unit_in,
};
use mauve_wcrt::table_files;
use toml_edit::{DocumentMut, Item};

use super::messages::{self, work_elsewhere};
use crate::date::today;
use crate::text::{duration, two_digits, two_digits_in, wait_entry, wrapped};

/// What the traces of one command showed.
#[derive(Debug, Default)]
pub(super) struct Memory {
    /// Each trace on its own: those that the file has are not counted again.
    traces: Vec<Observed>,
    /// The waits of each codel, of all traces, and how often it was executed.
    waits: BTreeMap<String, (Wait, u64)>,
}

impl Memory {
    /// Adds what a trace showed, whose runs have these digests.
    pub(super) fn add(
        &mut self,
        trace: &Path,
        observation: Observation,
        reader: &TraceReader,
        digests: &[String],
    ) {
        if digests.is_empty() {
            return;
        }
        let samples = match digests {
            [one] => one.clone(),
            several => digest_of(several.join(" ").as_bytes()),
        };
        let mut observed = Observed {
            recordings: vec![Recording {
                span: 0..0,
                source: trace.display().to_string(),
                date: today(),
                host: host(),
                samples,
                build: observation.build.clone().unwrap_or_default(),
            }],
            ..Observed::default()
        };
        for (thread, &per_second) in observation.work() {
            let work = ObservedTimes { greatest: per_second, ..ObservedTimes::default() };
            observed.work.insert(thread.clone(), work);
            if per_second >= LEAST_WORK {
                say(&format!("`{}`: {}", trace.display(), work_elsewhere(thread, per_second)));
            }
        }
        for it in observation.finish(reader.names()) {
            let SeenName { name, executions, greatest, wait, later } = it;
            let key = name.key;
            let times = ObservedTimes {
                span: 0..0,
                executions,
                greatest,
                later,
                wait: wait.greatest,
                times: wait.times,
                is_wait_known: !wait.is_unknown,
            };
            let all = match name.kind {
                SpanKind::Codel => {
                    let (waits, all) = self.waits.entry(key.clone()).or_default();
                    waits.add(&wait);
                    *all += executions;
                    observed.codels.entry(key).or_default()
                }
                SpanKind::Program => observed.programs.entry(key).or_default(),
                SpanKind::Access => {
                    observed.accesses.entry(port_of(&key).unwrap_or_default().to_owned()).or_default()
                }
                SpanKind::Lock => match lock_of(&key) {
                    Some((lock, codel)) if codel != "-" => {
                        observed.locks.entry((lock.to_owned(), codel.to_owned())).or_default()
                    }
                    _ => continue,
                },
                SpanKind::Period => observed.responses.entry(name.instance).or_default(),
            };
            all.add(&times);
        }
        self.traces.push(observed);
    }

    /// Writes the file. Returns what the command prints of it.
    pub(super) fn write(&self, samples: &Path) -> Result<String, String> {
        if self.traces.is_empty() {
            return Ok(String::new());
        }
        let path = samples.with_extension("observed.toml");
        let mut all = match path.try_exists() {
            Ok(false) => Observed::default(),
            _ => read(&path)?,
        };
        let mut is_new = false;
        for trace in &self.traces {
            if let Some((recording, other)) = other_builds(trace, &all) {
                say(&messages::other_build(&path, recording, other));
            }
            is_new |= all.merge(trace.clone());
        }
        if is_new {
            put(&path, &all.text())?;
        }
        let mut seen = Observed::default();
        for trace in &self.traces {
            seen.merge(trace.clone());
        }
        let tables = PasteTables::beside(&path);
        let mut out = self.waits(&tables);
        out += &accesses(&seen, &tables);
        let config = std::path::absolute(&path).ok().and_then(|path| next_config(&path));
        out += &sections(&seen, config.as_ref().map(|(_, config)| config));
        let name = || path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // Without a mauve.toml, one in the folder of this file is assumed.
        let missing = configured(&path, config)
            .unwrap_or_else(|| Some(format!("[timing]\nobserved = [\"{}\"]", name())));
        let end = match missing {
            None => "",
            Some(_) => "; in mauve.toml, so that `mauve check` compares it with the timing tables:",
        };
        out += &wrapped(&format!("`{}` has what was observed{end}\n", path.display()));
        out.extend(missing.map(|missing| missing + "\n"));
        Ok(out)
    }

    /// Says which codels waited, and what to write.
    fn waits(&self, tables: &PasteTables) -> String {
        let mut lines = String::new();
        for (codel, (wait, executions)) in self.waits.iter().filter(|(_, (wait, _))| wait.greatest > 0) {
            let of = format!("{} of {executions} executions", wait.executions);
            let greatest = duration(wait.greatest);
            if wait.is_unknown {
                say(&format!(
                    "codel `{codel}` was off the CPU for up to {greatest}, in {of}, and no period of the recording explains it: it waited, \
                     or something that the recording does not have preempted it; a recording with the column `waits` tells \
                     which (`mauve run --trace`, or packages of this version); if it waited, the timing table needs, in {}, [wait] {}",
                    tables.unit,
                    wait_entry(codel, wait.greatest, wait.times, tables.unit)
                ));
            } else {
                lines += &format!("codel `{codel}` waited for up to {greatest}, in {of}\n");
            }
        }
        let known = self.waits.iter().filter(|(_, (wait, _))| wait.greatest > 0 && !wait.is_unknown);
        let entries = known.map(|(codel, (wait, _))| PasteEntry {
            key: codel,
            time: wait.greatest,
            times: wait.times,
            line: wait_entry(codel, wait.greatest, wait.times, tables.unit),
        });
        let why = "no bound counts a wait that is not in a timing table; each has its wake-up latency in it";
        lines + &tables.lacking("wait", why, entries)
    }
}

/// Returns the lines for ports whose accesses took long.
fn accesses(seen: &Observed, tables: &PasteTables) -> String {
    let long = seen.accesses.iter().filter(|(_, it)| it.greatest > UNSUSPICIOUS);
    let entries = long.map(|(port, it)| PasteEntry {
        key: port,
        time: it.greatest,
        times: 0,
        line: format!("\"{port}\" = {}", two_digits_in(it.greatest, tables.unit)),
    });
    let why = "a port without an entry in a timing table costs nothing; unless `mauve pwcet` estimates it";
    tables.lacking("access", why, entries)
}

/// An entry to paste into a timing table: its key, what was observed, and its line.
struct PasteEntry<'a> {
    key: &'a str,
    time: u64,
    /// How often a codel waits in one execution; 0 where that is not known.
    times: u64,
    line: String,
}

/// The timing tables of the next mauve.toml. Entries are printed for the first one, in its unit.
#[derive(Default)]
struct PasteTables {
    all: Vec<(String, Table)>,
    /// The text of the first one.
    first: DocumentMut,
    unit: Unit,
}

impl PasteTables {
    fn beside(path: &Path) -> PasteTables {
        let mut db = Database::default();
        let config = std::path::absolute(path).ok().and_then(|path| next_config(&path));
        let workspaces =
            config.and_then(|(folder, _)| load(&mut db, &[folder.join(CONFIG_FILE)], false).ok());
        let Some(&workspace) = workspaces.iter().flatten().next() else { return PasteTables::default() };
        let files = &table_files(&db, workspace).files;
        let name =
            |file: &File| file.path(&db).file_name().unwrap_or_default().to_string_lossy().into_owned();
        let all = files.iter().map(|file| (name(file), Table::parse(file.text(&db)))).collect();
        let text = files.first().map_or("", |file| file.text(&db));
        PasteTables { all, first: text.parse().unwrap_or_default(), unit: unit_in(text) }
    }

    /// Returns the entries that no table has, to paste, and those that a table has with a shorter time, to replace.
    fn lacking<'a>(&self, section: &str, why: &str, entries: impl Iterator<Item = PasteEntry<'a>>) -> String {
        let (mut new, mut others) = (String::new(), String::new());
        for PasteEntry { key, time, times, line } in entries {
            let found = self.all.iter().find_map(|(file, table)| {
                let is_port = section == "access";
                let all = if is_port { &table.accesses } else { &table.waits };
                Some((file, entry_for(all, key, is_port)?))
            });
            let Some((file, entry)) = found else {
                new += &format!("{line}\n");
                continue;
            };
            let known = entry.value.as_ref().map_or(0, |it| it.greatest().as_nanos());
            if time > known || entry.waits.is_some_and(|it| times > it) {
                others += &format!("in `{file}`, replace `{}`: {line}\n", entry.key);
            }
        }
        let mut out = String::new();
        if !new.is_empty() {
            let table = self.all.first().map_or("a table".to_owned(), |(file, _)| format!("`{file}`"));
            // A section may be written once.
            let header = match self.first.contains_key(section) {
                true => format!("under [{section}]"),
                false => format!("[{section}]"),
            };
            out += &format!("{why}; for {table} in {}:\n{header}\n{new}", self.unit);
        }
        out + &others
    }
}

/// Returns the sections that mauve.toml lacks.
fn sections(seen: &Observed, config: Option<&DocumentMut>) -> String {
    let mut locks: BTreeMap<&str, (Vec<String>, u64)> = BTreeMap::new();
    for ((lock, codel), it) in &seen.locks {
        let (codels, held) = locks.entry(lock).or_default();
        codels.push(format!("\"{codel}\""));
        *held = it.greatest.max(*held);
    }
    let mut out = String::new();
    let is_declared = |lock: &str| config.and_then(|it| it.get("locks")?.get(lock)).is_some();
    for (lock, (codels, held)) in locks.into_iter().filter(|(lock, _)| !is_declared(lock)) {
        out += &format!(
            "[locks.{}]\ncodels = [{}]\nprotocol = \"inheritance\"   # \"ceiling\", if the lock has a ceiling\nheld = \"{} ms\"\n",
            toml_key(lock),
            codels.join(", "),
            two_digits(held)
        );
    }
    let others = config.and_then(|it| it.get("platform")?.get("other")?.as_array_of_tables());
    let is_other = |thread: &str| {
        let mut names = others.iter().flat_map(|all| all.iter()).filter_map(|it| it.get("name")?.as_str());
        names.any(|name| name == thread)
    };
    let work = seen.work.iter().filter(|(_, it)| it.greatest >= LEAST_WORK);
    for (thread, it) in work.filter(|(thread, _)| !is_other(thread)) {
        out += &format!(
            "[[platform.other]]\nname = {}\npriority = 99   # that of the threads; 99 is safe, and ordinary threads may have 1\n\
             period = \"1 s\"   # the least time between two pieces of work\ntime = \"{} ms\"   # the greatest time of one; this is what one second had, on average\n",
            toml_edit::value(thread).to_string().trim(),
            two_digits(it.greatest)
        );
    }
    if out.is_empty() { out } else { format!("in mauve.toml, if it is so:\n{out}") }
}

/// Returns the recordings whose program was built otherwise than an earlier one, with the latest of these. Of recordings of other tools
/// and earlier versions, it is not known.
fn other_builds<'a>(trace: &'a Observed, all: &'a Observed) -> Option<(&'a Recording, &'a Recording)> {
    let recording = trace.recordings.iter().find(|it| !it.build.is_empty())?;
    let mut earlier = all.recordings.iter().rev().filter(|it| !it.build.is_empty());
    earlier.find(|it| it.build != recording.build).map(|other| (recording, other))
}

/// Reads the file, which must be one that this command has written.
fn read(path: &Path) -> Result<Observed, String> {
    let shown = path.display();
    let bytes = disk::read(path, disk::LONGEST).map_err(|error| format!("cannot read `{shown}`: {error}"))?;
    let text = String::from_utf8_lossy(&bytes);
    let (observed, errors) = Observed::parse(&text);
    match errors.first() {
        None => Ok(observed),
        Some(error) => {
            let line = text.get(..error.span.start).unwrap_or_default().lines().count().max(1);
            Err(format!(
                "`{shown}`, line {line}, is not as this command writes it, so that nothing was added to this file: correct the line, or \
                 remove the file and import all recordings again"
            ))
        }
    }
}

/// Returns the lines that mauve.toml lacks to name the file, or none. None without a mauve.toml.
fn configured(path: &Path, config: Option<(PathBuf, DocumentMut)>) -> Option<Option<String>> {
    let path = std::path::absolute(path).ok()?;
    let (folder, config) = config?;
    let (timing, hosts) = (config.get("timing"), config.get("host").and_then(Item::as_table_like));
    let observed = |of: &Item| of.get("observed").and_then(Item::as_array).cloned().unwrap_or_default();
    let deployments = timing.and_then(|it| it.get("deployment")).and_then(Item::as_table_like);
    let of_parts = [deployments, hosts].into_iter().flatten().flat_map(|it| it.iter()).map(|(_, it)| it);
    let names = timing.into_iter().chain(of_parts).flat_map(|it| observed(it).into_iter());
    let mut named = names.filter_map(|it| Some(folder.join(it.as_str()?)));
    if named.any(|it| {
        it == path || it.canonicalize().is_ok_and(|it| path.canonicalize().is_ok_and(|path| path == it))
    }) {
        return Some(None);
    }
    let relative = path.strip_prefix(&folder).unwrap_or(&path).display().to_string();
    if hosts.is_some() {
        return Some(Some(format!("under the [host.NAME] that was recorded:\nobserved = [\"{relative}\"]")));
    }
    let observed = timing.map(observed).unwrap_or_default();
    let mut all: Vec<&str> = observed.iter().filter_map(|it| it.as_str()).collect();
    all.push(&relative);
    let all: Vec<String> = all.iter().map(|it| format!("\"{it}\"")).collect();
    // A section may be written once.
    let header = if timing.is_some() { "under [timing]:\n" } else { "[timing]\n" };
    Some(Some(format!("{header}observed = [{}]", all.join(", "))))
}

/// Returns the next mauve.toml of a file, with its folder.
fn next_config(path: &Path) -> Option<(PathBuf, DocumentMut)> {
    let folder = path.ancestors().skip(1).find(|it| it.join(CONFIG_FILE).is_file())?;
    let text = disk::read(&folder.join(CONFIG_FILE), disk::LONGEST).ok()?;
    Some((folder.to_owned(), str::from_utf8(&text).ok()?.parse().ok()?))
}

/// Returns the name of this computer.
fn host() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    name.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_section_that_names_a_file_is_found() {
        let asked = |config: &str| {
            let config = (PathBuf::from("/robot"), config.parse().unwrap());
            configured(Path::new("/robot/eyes.observed.toml"), Some(config)).unwrap()
        };
        let named = "observed = [\"eyes.observed.toml\"]\n";
        for section in ["timing", "timing.deployment.Sea", "host.eyes"] {
            assert_eq!(asked(&format!("[{section}]\n{named}")), None, "{section}");
        }
        assert_eq!(asked("").unwrap().lines().next(), Some("[timing]"));
        let both = asked("[timing]\nobserved = [\"a.toml\"]\n").unwrap();
        assert_eq!(both, "under [timing]:\nobserved = [\"a.toml\", \"eyes.observed.toml\"]");
        let of_host = asked("[timing]\nobserved = [\"a.toml\"]\n[host.eyes]\ncpus = 1\n").unwrap();
        assert_eq!(of_host, "under the [host.NAME] that was recorded:\nobserved = [\"eyes.observed.toml\"]");
    }
}
