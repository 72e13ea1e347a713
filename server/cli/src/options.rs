//! The options of several commands.

use std::path::PathBuf;

use clap::ValueEnum;
use mauve_diagnostics::{errors_of_text, time_error_message};
use mauve_hir::{Database, Decl, Project};
use mauve_ide::Drawing;
use mauve_projects::analysis_document::deployments;
use mauve_projects::load::{Outside, load};
use mauve_projects::output::terminal_columns;
use mauve_timing::task_set::Notation;
use mauve_timing::{Level, Rounding, Time};

use crate::errors::nothing_to;

/// The paths that most commands take.
#[derive(Debug, clap::Args)]
pub(super) struct Paths {
    /// A model, a folder or a mauve.toml; the current folder when left out.
    #[arg(value_name = "PATH", default_value = ".", hide_default_value = true)]
    pub(super) paths: Vec<PathBuf>,
}

/// The deployments of models, and the number of errors in the texts.
type DeploymentsOf<'db> = (&'db Database, Vec<(Project<'db>, Decl<'db>)>, usize);

/// The models that a command analyses.
#[derive(Debug, clap::Args)]
pub(super) struct Models {
    #[command(flatten)]
    pub(super) paths: Paths,
    #[command(flatten)]
    outside: Outside,
    /// Only this deployment.
    #[arg(long, value_name = "NAME")]
    pub(super) deployment: Option<String>,
}

impl Models {
    /// Loads the models, and returns their deployments, at least one, and the number of errors in the texts.
    ///
    /// # Errors
    ///
    /// A path cannot be read, or there is nothing to do, such as to `analyse`, in words for the user.
    pub(super) fn deployments<'db>(
        &self,
        db: &'db mut Database,
        doing: &str,
    ) -> Result<DeploymentsOf<'db>, String> {
        let workspaces = load(db, &self.paths.paths, self.outside.allow_outside)?;
        let db: &'db Database = db;
        let found = deployments(db, &workspaces, self.deployment.as_deref())?;
        let errors = errors_of_text(db, &workspaces);
        if found.is_empty() { Err(nothing_to(doing, errors)) } else { Ok((db, found, errors)) }
    }

    /// Returns whether a path is that of a task set.
    pub(super) fn are_task_sets(&self) -> bool {
        self.paths.paths.iter().any(|path| Notation::of(path).is_some())
    }
}

/// Reads the significance level of an option.
pub(super) fn level(text: &str) -> Result<Level, String> {
    let level = text.parse().ok().and_then(Level::from_f64);
    level.ok_or_else(|| "expected a number between 0 and 1, such as 1e-4".to_owned())
}

/// Reads the time of an option such as `--for`.
pub(super) fn time(text: &str) -> Result<Time, String> {
    // A run takes minutes and hours, which no model has.
    let long = [("min", 60), ("m", 60), ("h", 3600)].into_iter().find_map(|(unit, seconds)| {
        let number = text.strip_suffix(unit)?.trim_end();
        Time::parse_with_unit(&format!("{number}s"), Rounding::Exact).ok()?.checked_mul(seconds)
    });
    let time = long.map_or_else(|| Time::parse_with_unit(text, Rounding::Exact), Ok);
    let time =
        time.map_err(|error| format!("expected a time such as 10s or 5min: {}", time_error_message(error)))?;
    if time == Time::ZERO { Err("expected a time greater than 0".to_owned()) } else { Ok(time) }
}

/// How to show figures that are one table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum TableFormat {
    /// For people.
    Table,
    /// One document.
    Json,
}

/// How to show a graph or a state machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum DrawingFormat {
    /// A drawing for terminals.
    Text,
    /// A drawing for browsers.
    Svg,
    /// A drawing for Graphviz.
    Dot,
    /// One document.
    Json,
}

impl DrawingFormat {
    /// Returns the kind of drawing; none for a document.
    pub(super) fn drawing(self) -> Option<Drawing> {
        match self {
            DrawingFormat::Text => Some(Drawing::Text(terminal_columns())),
            DrawingFormat::Svg => Some(Drawing::Svg),
            DrawingFormat::Dot => Some(Drawing::Dot),
            DrawingFormat::Json => None,
        }
    }
}

/// How the analysis bounds the demand of several jobs of one activity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum MethodName {
    /// Every job of a component takes its worst-case execution time.
    Classic,
    /// The state machine of a component limits which jobs follow each other.
    Psm,
    /// As psm; the last job of an interfering component executes no longer than since its release.
    Ibf,
    /// All combinations of paths of the state machines, as far as a budget allows.
    Exact,
    /// The best of these for each activity that a small budget allows.
    Best,
}

impl MethodName {
    /// Returns the method of the analysis.
    pub(super) fn analysed(self) -> mauve_timing::Method {
        match self {
            MethodName::Classic => mauve_timing::Method::Classic,
            MethodName::Psm => mauve_timing::Method::Psm,
            MethodName::Ibf => mauve_timing::Method::Ibf,
            MethodName::Exact => mauve_timing::Method::Exact,
            MethodName::Best => mauve_timing::Method::Best,
        }
    }
}
