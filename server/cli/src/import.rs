//! `mauve import RECORDING… -o DIR`: a system of ROS 2 that runs, as a project: what its callbacks took, and what is not known.

mod control;
mod model;
mod names;
mod recorded;
mod threads;
mod unknown;

use std::path::{Path, PathBuf};

use mauve_diagnostics::file_problem;
use mauve_hir::ros2_files::{
    ControllersFile, NamedPath, ThreadsFile, read_controllers, read_named_paths, read_threads,
};
use mauve_hir::{normalised, relative_path};
use mauve_projects::destination::{destination, destination_folder};
use mauve_projects::disk::text_of;
use mauve_projects::output::{Output, say};
use mauve_projects::replace::create;
use mauve_pwcet::trace::{Ros2Release, Source, TraceError, TraceReader};
use mauve_wcrt::pattern_of_path;

use crate::text::{Sheet, argument, counted, duration, wrapped};
use crate::trace::{import_recordings, recording_warnings, trace_error};
use recorded::{System, Times, released_by};
use threads::{THREADS, Threads};

#[derive(Debug, clap::Args)]
pub struct Import {
    /// A folder that LTTng has recorded with the events of `ros2_tracing`; an `architecture.yaml` of CARET, whose paths become chains; the
    /// `threads.yaml` of the callback-isolated executor, or the `controllers.yaml` of ros2_control, which have the priorities and CPUs.
    #[arg(value_name = "PATH", required = true, value_hint = clap::ValueHint::AnyPath)]
    paths: Vec<PathBuf>,
    /// The folder of the project. Files that it has are kept; without it, nothing is written.
    #[arg(short, long, value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    output: Option<PathBuf>,
}

/// The file with the executions of all recordings.
const SAMPLES: &str = "recorded.samples";

impl Import {
    pub(crate) fn run(self) -> Result<Output, String> {
        let mut reader = TraceReader::default();
        let mut times = Times::default();
        let is_yaml = |path: &PathBuf| path.extension().is_some_and(|it| it == "yaml" || it == "yml");
        let mut paths = self.paths;
        paths.sort();
        paths.dedup();
        let (files, recordings): (Vec<PathBuf>, Vec<PathBuf>) = paths.into_iter().partition(is_yaml);
        for recording in &recordings {
            let said = |error: &TraceError| trace_error(recording, error);
            let source = Source::of(recording).map_err(|error| said(&error))?;
            reader.read(&source, &mut times).map_err(|error| said(&error))?;
            let of = reader.finish();
            recording_warnings(&recording.display().to_string(), &of).iter().for_each(|warning| say(warning));
        }
        let ReadFiles { paths, threads, controllers } = read_files(&files, self.output.as_deref())?;
        let (path, file) = threads.map_or((THREADS.to_owned(), None), |(path, file)| (path, Some(file)));
        let graph = reader.ros2();
        let threads = Threads::new(graph, path, file);
        let system = System { graph, times: times.0, paths, threads, controllers };
        match recordings.first() {
            Some(first) if !system.has_recording() => {
                return Err(format!("{}: no callback of ROS 2 was executed in it", first.display()));
            }
            None if system.controllers.is_empty() => {
                return Err("name a recording, too: a folder that `ros2 trace` has written".to_owned());
            }
            _ => {}
        }
        let mut text = String::new();
        if system.has_recording() {
            text += &(table(&system) + &counts(&system));
        }
        text.extend(unknown::lines(&system).into_iter().map(|line| line + "\n"));
        let mut code = 0;
        if let Some(folder) = &self.output {
            text += &written(folder, &system)?;
            let added =
                (!recordings.is_empty()).then(|| import_recordings(&recordings, &folder.join(SAMPLES)));
            match added.transpose() {
                Ok(added) => {
                    let controllers = system.controllers.iter().map(|it| &it.0);
                    let mut all = std::iter::once(&system.threads.path).chain(controllers);
                    if added.is_some() {
                        text += &format!("added the executions to {}\n", folder.join(SAMPLES).display());
                    }
                    let of = match all.find(|it| it.starts_with("..")) {
                        Some(path) => {
                            text += &format!(
                                "`{path}` is not in the project: unless both are in one repository, commands read it only with --allow-outside\n"
                            );
                            format!("--allow-outside {}", argument(folder))
                        }
                        None => argument(folder),
                    };
                    text += &format!("Next: mauve check {of}; mauve tune --priorities --cpus {of}\n");
                }
                Err(message) => {
                    say(&message);
                    code = 2;
                }
            }
        } else {
            text += "Next: -o DIR writes a project with these callbacks, which the other commands and the editors understand\n";
        }
        Ok(Output::escaped(wrapped(&text), code))
    }
}

/// What files beside recordings say. The paths are from the folder of the project.
#[derive(Default)]
struct ReadFiles {
    paths: Vec<NamedPath>,
    threads: Option<(String, ThreadsFile)>,
    controllers: Vec<(String, ControllersFile)>,
}

/// Reads files of CARET, of threads and of ros2_control.
fn read_files(files: &[PathBuf], folder: Option<&Path>) -> Result<ReadFiles, String> {
    let mut found = ReadFiles::default();
    let path_of = |file: &Path| {
        let path = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        let folder = folder.and_then(|it| std::path::absolute(it).ok()).unwrap_or_default();
        let path = relative_path(&normalised(&folder), &normalised(&path)).display().to_string();
        pattern_of_path(&path)
    };
    for file in files {
        let shown = file.display();
        let (text, problem) = text_of(file);
        if let Some(problem) = problem {
            return Err(format!("cannot read `{shown}`: {problem}"));
        }
        let read = read_threads(&text);
        let is_of_threads = !read.groups.is_empty() || !read.others.is_empty();
        let controllers = read_controllers(&text);
        let (paths, of_paths) = read_named_paths(&text);
        let (kind, problems) = match (is_of_threads, controllers.managers.is_empty()) {
            (true, _) => ("a `threads.yaml`", &read.problems),
            (false, false) => ("a `controllers.yaml`", &controllers.problems),
            (false, true) => ("an `architecture.yaml` of CARET", &of_paths),
        };
        if let Some(problem) = problems.iter().find(|it| it.kind.is_error()) {
            let line = text.get(..problem.range.start).map_or(1, |before| before.matches('\n').count() + 1);
            return Err(format!("{shown}:{line}: in {kind}: {}", file_problem(&problem.kind)));
        }
        if is_of_threads {
            if found.threads.is_some() {
                return Err(format!("`{shown}`: name one `threads.yaml`"));
            }
            found.threads = Some((path_of(file), read));
        } else if !controllers.managers.is_empty() {
            found.controllers.push((path_of(file), controllers));
        } else if paths.is_empty() {
            return Err(format!(
                "`{shown}` has no `callback_groups`, no controller manager and no `named_paths`"
            ));
        }
        found.paths.extend(paths);
    }
    Ok(found)
}

/// Writes the files that a folder does not have. Returns what to print.
fn written(folder: &Path, system: &System<'_>) -> Result<String, String> {
    let failed = |error: std::io::Error| format!("cannot create `{}`: {error}", folder.display());
    std::fs::create_dir_all(destination_folder(folder)?).map_err(failed)?;
    if folder.join("mauve.toml").exists() && !folder.join("system.mal").exists() {
        return Err(format!(
            "`{}` has another project: name a folder without `mauve.toml`",
            folder.display()
        ));
    }
    let mut text = String::new();
    for (name, content) in model::files(system) {
        let path = folder.join(name);
        let place = destination(&path)?;
        if place.exists() {
            text += &format!("kept {}\n", path.display());
            continue;
        }
        create(&place, &content).map_err(|error| format!("cannot write `{}`: {error}", path.display()))?;
        text += &format!("wrote {}\n", path.display());
    }
    Ok(text)
}

fn table(system: &System<'_>) -> String {
    let all: Vec<_> = system.executed().collect();
    let has_priority = all.iter().any(|(_, it, _)| it.priority.is_some());
    let time = if system.has_elapsed() { "greatest (elapsed)" } else { "greatest (CPU)" };
    Sheet::of(&all)
        .column("callback", |(_, it, _)| it.name.clone())
        .column("released by", |(_, it, _)| released_by(&it.release))
        .column("executions", |(.., times)| times.count.to_string())
        .column("mean", |(.., times)| duration(times.mean()))
        .column(time, |(.., times)| duration(times.greatest))
        .column("threads", |(_, it, _)| it.threads.len().to_string())
        .column_if(has_priority, "priority", |(_, it, _)| match it.priority {
            Some(0) => "background".to_owned(),
            Some(priority) => priority.to_string(),
            None => "unknown".to_owned(),
        })
        .text()
}

/// Counts the callbacks.
fn counts(system: &System<'_>) -> String {
    let executions: u64 = system.executed().map(|(.., times)| times.count).sum();
    format!(
        "{} in {}, {executions} executions; {} of timers\n",
        counted(system.executed().count(), "callback"),
        counted(system.graph.nodes.len(), "node"),
        system.executed().filter(|(_, it, _)| matches!(it.release, Ros2Release::Timer(_))).count(),
    )
}
