//! `mauve trace check TRACE… [PATH]`: recordings beside the model, and which assumption of the analysis fails.

mod checked;
mod document;
mod findings;
mod overhead;
mod table;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use mauve_diagnostics::errors_of;
use mauve_hir::{CONFIG_FILE, Database, Decl, Project};
use mauve_orocos::task_name;
use mauve_projects::json;
use mauve_projects::load::Outside;
use mauve_projects::load::load;
use mauve_projects::output::{Output, say};
use mauve_pwcet::trace::{Source, Totals, TraceError, TraceReader};
use mauve_timing::Level;
use mauve_wcrt::observed::{ExpectedDeployment, FindingKind, Observer, TraceFinding, expected};
use mauve_wcrt::{Query, Report, response_times};

use self::checked::Checked;
use self::overhead::Overheads;
use super::import::messages::{still_recording, trace_error};
use crate::errors::{host_called, only_deployment, say_errors};
use crate::options::{TableFormat, level};

/// Recordings, and the model that they are compared with.
#[derive(Debug, clap::Args)]
pub(super) struct RecordingArguments {
    /// Recordings of one deployment, and then, optionally, its model: a file *.mal, a folder or a mauve.toml; the current folder
    /// when left out.
    #[arg(value_name = "TRACE> [PATH", required = true, value_hint = clap::ValueHint::AnyPath)]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) outside: Outside,
    /// The deployment that was recorded; needed if the model has several.
    #[arg(long, value_name = "NAME")]
    pub(super) deployment: Option<String>,
    /// The host that was recorded; needed if the robot has several.
    #[arg(long, value_name = "NAME")]
    pub(super) host: Option<String>,
    /// The significance level of the times; by default that of mauve.toml, else 1e-4.
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    pub(super) significance: Option<Level>,
}

#[derive(Debug, clap::Args)]
pub struct TraceCheck {
    #[command(flatten)]
    recorded: RecordingArguments,
    /// How to show the comparison.
    #[arg(long, value_enum, default_value = "table")]
    format: TableFormat,
}

impl TraceCheck {
    pub(crate) fn run(self) -> Result<Output, String> {
        let (traces, model) = self.recorded.traces_and_model();
        let mut known = BTreeSet::new();
        if let Some(twice) =
            traces.iter().find(|it| !known.insert(it.canonicalize().unwrap_or(it.to_path_buf())))
        {
            return Err(format!("`{}` is given twice: its periods would count twice", twice.display()));
        }
        let mut db = Database::default();
        let workspaces = load(&mut db, &[model], self.recorded.outside.allow_outside)?;
        let name = self.recorded.deployment.as_deref();
        let (project, deployment) = only_deployment(&db, &workspaces, name, "compare the recording with")?;
        let (query, report, expected) =
            model_of(&db, project, deployment, self.recorded.host.as_deref(), self.recorded.significance)?;
        let mut observer = Observer::new(expected.clone());
        let mut reader = reader_of(&expected);
        let mut summary = Totals::default();
        for trace in &traces {
            read(trace, &mut reader, &mut observer)?;
            summary.add(&reader.finish());
            observer.end_recording();
        }
        let mut observed = observer.finish(reader.names());
        let is_untimed = |it: &TraceFinding| matches!(it.kind, FindingKind::Untimed { .. });
        if summary.clock_errors > 0 && !observed.findings.iter().any(is_untimed) {
            let (kind, count) = (FindingKind::Clock, summary.clock_errors);
            observed.findings.push(TraceFinding { instance: None, kind, at: None, count });
        }
        let errors = errors_of(&db, project);
        let name = deployment.name(&db).to_string();
        let checked = Checked { name, level: query.level, traces, report, expected, observed, summary };
        let mut text = match self.format {
            TableFormat::Table => table::text(&checked),
            TableFormat::Json => json::text(&document::document(&checked))?,
        };
        say_errors(errors);
        let code = u8::from(!checked.is_fine() || errors > 0);
        let (overheads, level) = (Overheads::of(&checked), checked.level);
        // The analysis with another table ends the present one.
        drop(checked);
        if self.format == TableFormat::Table {
            let recorded = (self.recorded.deployment.as_deref(), self.recorded.host.as_deref());
            text.extend(overheads.advice(&mut db, &workspaces, recorded, level));
        }
        Ok(Output::escaped(text, code))
    }
}

impl RecordingArguments {
    /// Splits the paths: the last one is a model if it cannot be a recording.
    pub(super) fn traces_and_model(&self) -> (Vec<PathBuf>, PathBuf) {
        if let [traces @ .., last] = self.paths.as_slice()
            && !traces.is_empty()
            && is_model(last)
        {
            return (traces.to_vec(), last.clone());
        }
        (self.paths.clone(), PathBuf::from("."))
    }
}

fn is_model(path: &Path) -> bool {
    let is_text = path.extension().is_some_and(|it| it == "mal" || it == "toml");
    // A project may contain recordings.
    let is_project = || {
        let mut entries = path.read_dir().into_iter().flatten().flatten().map(|it| it.path());
        path.join(CONFIG_FILE).is_file() || entries.any(|it| it.extension().is_some_and(|it| it == "mal"))
    };
    is_text || is_project() || matches!(Source::of(path), Err(TraceError::NotATrace))
}

/// Returns what the model of a deployment promises.
pub(super) fn model_of<'db>(
    db: &'db Database,
    project: Project<'db>,
    deployment: Decl<'db>,
    host: Option<&str>,
    level: Option<Level>,
) -> Result<(Query, Report<'db>, ExpectedDeployment), String> {
    let host = host_called(db, (project, deployment), host)?;
    let query = Query::at_level(db, project, deployment, level);
    let report = response_times(db, project, deployment, query).clone();
    let expected = expected(db, project, deployment, host, query, &report);
    Ok((query, report, expected))
}

/// Returns a reader of recordings of a deployment. Orocos and earlier versions of `mauve run` record the names that instances have in
/// scripts.
pub(super) fn reader_of(expected: &ExpectedDeployment) -> TraceReader {
    let names: BTreeSet<&str> = expected.instances.iter().map(|it| it.instance.as_str()).collect();
    let recorded = names.iter().map(|it| (task_name(it), (*it).to_owned()));
    TraceReader::renaming(recorded.filter(|(recorded, _)| !names.contains(recorded.as_str())).collect())
}

/// Reads a recording.
pub(super) fn read(
    trace: &Path,
    reader: &mut TraceReader,
    visitor: &mut dyn mauve_pwcet::trace::Visitor,
) -> Result<(), String> {
    let said = |error: TraceError| trace_error(trace, &error);
    let source = Source::of(trace).map_err(said)?;
    if let Source::Ctf { chunks, is_recording: true } = &source {
        if chunks.is_empty() {
            return Err(said(TraceError::Recording));
        }
        say(&still_recording(trace));
    }
    reader.read(&source, visitor).map_err(said)
}
