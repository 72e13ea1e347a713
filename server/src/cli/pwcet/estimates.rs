//! The estimates of codels and programs, with what they are compared with.

use mauve_diagnostics::{measurement_refusal, measurement_warning, no_bound};
use mauve_pwcet::{Measurement, Options};
use mauve_timing::{Level, Time};

use super::budgets::Budgets;

/// The estimates of all codels, with what they are compared with.
pub(super) struct Estimates {
    pub(super) options: Options,
    pub(super) levels: Vec<Level>,
    pub(super) measurements: Vec<Measured>,
    /// The level of the budgets, and their project; none without a project.
    pub(super) budgets: Option<Budgets>,
    /// The index of the level of the budgets.
    pub(super) budget_level: Option<usize>,
    /// What the recordings lack, in words.
    pub(super) recording: Vec<String>,
}

/// A codel, a program or a port.
pub(super) struct Measured {
    /// What was measured, in words.
    pub(super) name: String,
    pub(super) measurement: Measurement,
    /// The time of each level, rounded up to four digits; none for a level that the executions do not support.
    pub(super) times: Vec<Option<Time>>,
    /// The greatest time with which all deadlines are met.
    pub(super) budget: Option<Time>,
    /// Whether its time at the level of the budgets is longer.
    pub(super) is_over_budget: bool,
}

impl Measured {
    /// Returns the times if each level has one: those of a timing table.
    pub(super) fn all_times(&self) -> Option<Vec<Time>> {
        self.times.iter().copied().collect()
    }

    /// Returns whether no level has a time.
    pub(super) fn is_refused(&self) -> bool {
        self.times.iter().all(Option::is_none)
    }

    /// Returns what is wrong with the measurement, in words; the instance is named if there are several.
    pub(super) fn remarks(&self) -> Vec<String> {
        let several = self.measurement.instances.len() > 1;
        let mut remarks = Vec::new();
        for instance in &self.measurement.instances {
            let of = if several { format!("in `{}`, ", instance.instance) } else { String::new() };
            match &instance.result {
                Ok(estimate) => {
                    let warnings = estimate.warnings.iter().map(measurement_warning);
                    remarks.extend(warnings.map(|warning| format!("{of}{warning}")));
                    let first = estimate.levels.iter().find_map(|it| Some((it.level, it.bound.err()?)));
                    remarks.extend(
                        first.map(|(level, why)| format!("{of}no time at {level:e}: {}", no_bound(&why))),
                    );
                }
                Err(refused) => {
                    let is_withheld = |level| self.measurement.withheld_by(level) == Some(instance);
                    let has_none = refused.bounds.iter().all(Result::is_err);
                    let then = match () {
                        () if (0..self.times.len()).any(is_withheld) => {
                            ": the codel has no time, since its time there is unknown"
                        }
                        () if has_none && !self.is_refused() => {
                            ": it is taken to be no slower there than elsewhere"
                        }
                        () => "",
                    };
                    remarks.push(format!("{of}{}{then}", measurement_refusal(&refused.refusal)));
                }
            }
        }
        remarks
    }
}
