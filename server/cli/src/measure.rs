//! `mauve measure CODEL…`: builds a program that calls codels alone, runs it, and adds the executions to a sample file.
//!
//! A codel that runs once in a mission has too few executions in a recording. Alone, it runs as often as wanted; but with the caches
//! and the inputs of this program, so its samples are marked, and shown beside those of the robot.

use std::fs;
use std::os::fd::AsFd as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Decl, Project, names_of};
use mauve_orocos::{InputProblem, MEASURE, Shape, is_empty_stub, measuring, problems};
use mauve_projects::destination::destination;
use mauve_projects::disk;
use mauve_projects::generate::{Out, read};
use mauve_projects::load::Outside;
use mauve_projects::load::load;
use mauve_projects::output::Output;
use mauve_projects::signals::stop_on_signal;
use mauve_pwcet::samples::{Samples, is_alone};
use toml::Table;

use super::generate::refusal_text;
use super::run::build::{Build, check_tools, status_of};
use super::run::built_packages;
use super::sample_file::{samples_error, unreadable_samples};
use super::trace::import_recordings;
use crate::errors::only_deployment;
use crate::text::{argument, duration};

#[derive(Debug, clap::Args)]
pub struct Measure {
    /// The codels, such as motion.steer.
    #[arg(value_name = "CODEL", required = true)]
    names: Vec<String>,
    /// The model, its folder or its mauve.toml; the current folder when left out.
    #[arg(long, value_name = "PATH", default_value = ".", hide_default_value = true)]
    project: PathBuf,
    #[command(flatten)]
    outside: Outside,
    /// A deployment that needs the packages of the codels; by default the only one.
    #[arg(long, value_name = "NAME")]
    deployment: Option<String>,
    /// The folder in which `mauve generate` wrote the packages, with your codels.
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    codels: PathBuf,
    /// The inputs in TOML: for each codel a table with a list of values for each parameter, which are combined row by row, such as
    /// `["motion.steer"]` and `gap = [0.5, 1.0]`; or a file of `mauve run --trace DIR --inputs`.
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    inputs: Option<PathBuf>,
    /// The number of executions with warm caches; as many as a hundredth of them, and at least 200, follow with cold ones.
    #[arg(short = 'n', value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    count: u64,
    /// The sample file: the executions are added to those that it has.
    #[arg(short, long, value_name = "SAMPLES", value_hint = clap::ValueHint::FilePath)]
    output: PathBuf,
}

impl Measure {
    pub(crate) fn run(self) -> Result<Output, String> {
        let inputs = self.inputs()?;
        // Before minutes of work: that it can get the executions.
        if destination(&self.output)?.exists() {
            Samples::open(&self.output).map_err(|error| samples_error(&self.output, &error))?;
        }
        let mut db = Database::default();
        let workspaces = load(&mut db, std::slice::from_ref(&self.project), self.outside.allow_outside)?;
        let (project, deployment) =
            only_deployment(&db, &workspaces, self.deployment.as_deref(), "measure codels of")?;
        let problems = problems(&db, project);
        if !problems.is_empty() {
            let text = refusal_text(&db, &workspaces, &problems);
            anstream::eprint!("{text}");
            return Ok(Output::verbatim("", 1));
        }
        let codels = self.found(&db, project)?;
        check_tools()?;
        let out = built_packages(&db, project, deployment, &self.codels, &self.project)?;
        let (package, files) = measuring(&db, project, deployment, &codels, &inputs)
            .map_err(|(codel, problem)| self.message(&codel.qualified(&db), problem))?;
        check_are_written(&out, &files)?;
        let root = project.root(&db).path(&db);
        let build = Build::open(root, Some(&out.real))?;
        let program = build.build(&[package], MEASURE, &self.names.join(", "))?;
        let recording = build.folder.join(format!("measured-{}", std::process::id()));
        let imported = self
            .execute(&program, &recording)
            .and_then(|()| import_recordings(std::slice::from_ref(&recording), &self.output));
        let _ = fs::remove_dir_all(&recording);
        let mut output = imported?;
        let samples =
            Samples::open(&self.output).map_err(|error| unreadable_samples(&self.output, &error))?;
        let samples = [samples];
        let compared = self.names.iter().filter_map(|name| alone_and_in_robot(name, &samples));
        compared.for_each(|line| output.text += &(line + "\n"));
        Ok(output)
    }

    fn inputs(&self) -> Result<Table, String> {
        let Some(path) = &self.inputs else { return Ok(Table::new()) };
        let shown = path.display();
        let bytes =
            disk::read(path, disk::LONGEST).map_err(|error| format!("cannot read `{shown}`: {error}"))?;
        let text = String::from_utf8(bytes).map_err(|_| format!("`{shown}` is not UTF-8 text"))?;
        text.parse().map_err(|error: toml::de::Error| {
            format!("`{shown}` is not a file of inputs: {}", error.to_string().trim_end())
        })
    }

    /// Returns the codels that were named.
    fn found<'db>(&self, db: &'db Database, project: Project<'db>) -> Result<Vec<Decl<'db>>, String> {
        let all: Vec<Decl<'db>> = names_of(db, project).of_kind(db, Kind::Codel).collect();
        let find = |name: &String| {
            all.iter().find(|it| it.qualified(db) == *name).copied().ok_or_else(|| {
                let known: Vec<String> = all.iter().take(10).map(|it| it.qualified(db)).collect();
                format!("the model has no codel `{name}`; it has: {}", known.join(", "))
            })
        };
        self.names.iter().map(find).collect()
    }

    /// Runs the program, which records into a folder.
    fn execute(&self, program: &Path, recording: &Path) -> Result<(), String> {
        // What codels print is no result.
        let messages =
            std::io::stderr().as_fd().try_clone_to_owned().map_or_else(|_| Stdio::null(), Stdio::from);
        let mut command = Command::new(program);
        command.arg(recording).arg(self.count.to_string()).stdout(messages);
        let stop = Arc::new(AtomicBool::new(false));
        stop_on_signal(stop.clone())?;
        match status_of(&mut command, &stop) {
            Ok(None) => Err(format!(
                "the measurement was ended by a signal: `{}` gets nothing of it",
                self.output.display()
            )),
            // A codel may end the program, and with success.
            Ok(Some(status)) if status.success() && recording.join("executions.csv").is_file() => Ok(()),
            Ok(Some(status)) => Err(format!(
                "the program ended early ({status}), in the codel that it named last: `{}` gets nothing; correct that codel, or measure \
                 the others without it",
                self.output.display()
            )),
            Err(error) => Err(format!("cannot run `{}`: {error}", program.display())),
        }
    }

    fn message(&self, codel: &str, problem: InputProblem) -> String {
        let file =
            self.inputs.as_ref().map_or("a file for --inputs".to_owned(), |it| format!("`{}`", it.display()));
        match problem {
            InputProblem::NotThere => {
                format!(
                    "the deployment does not need the package of `{codel}`: name another one with --deployment"
                )
            }
            InputProblem::Opaque(parameter, ty) => format!(
                "`{codel}` cannot run alone: values of its parameter `{parameter}`, of type {ty}, exist only in the robot; measure it there, \
                 with `mauve run --trace DIR --codels {}`",
                argument(&self.codels)
            ),
            InputProblem::Missing(place, example) => format!(
                "`{codel}` has no value for `{place}`: its time may depend on it, so none is assumed; write it into {file}, in this form, or \
                 record it with `mauve run --codels {} --trace DIR --inputs`, then measure with --inputs DIR/inputs.toml:\n\n{example}",
                argument(&self.codels)
            ),
            InputProblem::Unknown(place) => {
                format!("{file}: `{codel}` has no input `{place}`: remove it, or correct its name")
            }
            InputProblem::Rows(one, other) => format!(
                "{file}: of `{codel}`, `{one}` and `{other}` have different numbers of values, which are combined row by row: give both as \
                 many values, or one of them a single value"
            ),
            InputProblem::TooMany(rows) => format!(
                "{file}: `{codel}` has {rows} rows, more values than a program should have: keep some of them, spread over all"
            ),
            InputProblem::Wrong(place, shape) => {
                let what = match shape {
                    Shape::Bool => "`true` or `false`".to_owned(),
                    Shape::Integer(integer) => {
                        let (low, high) = integer.ends();
                        format!("an integer from {low} to {high}")
                    }
                    Shape::Float(_) => "a number of its type".to_owned(),
                    Shape::Text => "a text in quotes".to_owned(),
                    Shape::List(_, size) => {
                        format!("a list of {}values", size.map_or(String::new(), |it| format!("{it} ")))
                    }
                    Shape::Fields(_) => "a table of fields, such as { x = 0.0 }".to_owned(),
                };
                format!("{file}: of `{codel}`, `{place}` is not {what}")
            }
        }
    }
}

/// Says how the executions of a codel alone differ from those in the robot, if sample files have both.
pub(super) fn alone_and_in_robot(codel: &str, samples: &[Samples]) -> Option<String> {
    let greatest = |alone| {
        let all = samples.iter().flat_map(Samples::series);
        let all = all.filter(|it| it.key == codel && is_alone(&it.instance) == alone);
        all.map(|it| it.greatest).max().map(duration)
    };
    let (alone, robot) = (greatest(true)?, greatest(false)?);
    Some(format!("{codel}: alone {alone}, in the robot {robot} (greatest)"))
}

/// Refuses codels that are not written: their times would be those of nothing.
fn check_are_written(out: &Out, files: &[String]) -> Result<(), String> {
    for path in files {
        if read(out, path)?.is_some_and(|text| is_empty_stub(&text)) {
            let shown = out.shown.join(path);
            return Err(format!(
                "`{}` is the stub that `mauve generate` wrote: write the codel, then measure it",
                shown.display()
            ));
        }
    }
    Ok(())
}
