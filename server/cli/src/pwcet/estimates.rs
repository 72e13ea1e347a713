//! The estimates of codels and programs, with what they are compared with.

use std::collections::HashSet;

use mauve_diagnostics::{measurement_refusal, measurement_warning, no_bound, refusal_kind, warning_kind};
use mauve_pwcet::samples::is_alone;
use mauve_pwcet::trace::{SpanKind, port_of};
use mauve_pwcet::{EstimateOptions, EstimateRefusal, LEAST_EXECUTIONS, Measurement, NoBound, Warning};
use mauve_timing::{Level, Time};
use mauve_wcrt::PREFIX_OF_TOPICS;

use super::budgets::Budgets;

/// The accesses of a port that take longer are not left without a time.
const SHORT_ACCESS: u64 = 20_000;

/// The warning about a codel that takes longer than its budget. It is not one of the measurement.
pub(super) const OVER_BUDGET: &str = "over-budget";

/// The estimates of all codels, with what they are compared with.
pub(super) struct Estimates {
    pub(super) options: EstimateOptions,
    pub(super) levels: Vec<Level>,
    /// The indices of the levels that a time is needed for: those of the table that is written, otherwise those that are shown.
    pub(super) needed: Vec<usize>,
    /// The indices of the levels that a terminal shows.
    pub(super) shown: Vec<usize>,
    pub(super) measurements: Vec<MeasuredEntry>,
    /// The level of the budgets, and their project; none without a project.
    pub(super) budgets: Option<Budgets>,
    /// The index of the level of the budgets.
    pub(super) budget_level: Option<usize>,
    /// What the recordings lack, in words.
    pub(super) recording: Vec<String>,
}

/// A codel, a program or a port.
pub(super) struct MeasuredEntry {
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

/// Why a level has no time, and how many executions it needs.
pub(super) struct Lack {
    pub(super) kind: &'static str,
    /// How many executions are needed.
    pub(super) needed: u64,
    /// How many of them are missing.
    pub(super) more: u64,
    /// The instance that lacks them.
    pub(super) instance: String,
}

impl Estimates {
    /// Puts those first that exceed their budget, then those without a time, then those with warnings.
    pub(super) fn sort(&mut self) {
        let mut all = std::mem::take(&mut self.measurements);
        all.sort_by_cached_key(|it| match () {
            () if it.is_over_budget => 0,
            () if self.lack(it).is_some() => 1,
            () if !self.kinds(it).is_empty() => 2,
            () => 3,
        });
        self.measurements = all;
    }

    /// Returns whether a codel lacks a time or exceeds its budget.
    pub(super) fn are_incomplete(&self) -> bool {
        let lacks = |it: &MeasuredEntry| self.lack(it).is_some() && !it.is_short_access();
        self.measurements.iter().any(|it| it.is_over_budget || lacks(it))
    }

    /// Returns the levels that a time is needed for.
    pub(super) fn needed_levels(&self) -> Vec<Level> {
        self.needed.iter().filter_map(|&index| self.levels.get(index).copied()).collect()
    }

    /// Returns the times of a timing table, if each level has one.
    pub(super) fn table_times(&self, it: &MeasuredEntry) -> Option<Vec<Time>> {
        self.needed.iter().map(|&index| it.time(index)).collect()
    }

    /// Returns why a level that needs a time has none: of the strictest such level.
    pub(super) fn lack(&self, it: &MeasuredEntry) -> Option<Lack> {
        let lacks = self.needed.iter().filter(|&&index| it.time(index).is_none());
        let strictest = lacks.min_by_key(|&&index| self.levels.get(index))?;
        it.lack(*strictest)
    }

    /// Returns the kinds of warnings about a measurement, each once: those of levels that need a time.
    pub(super) fn kinds(&self, it: &MeasuredEntry) -> Vec<&'static str> {
        let mut kinds = if it.is_over_budget { vec![OVER_BUDGET] } else { Vec::new() };
        if let Some(lack) = self.lack(it) {
            kinds.push(lack.kind);
            return kinds;
        }
        let warnings = self.needed.iter().flat_map(|&level| it.warnings_at(level));
        kinds.extend(warnings.map(|it| warning_kind(&it)));
        let mut refused = it.measurement.instances.iter().filter_map(|it| it.result.as_ref().err());
        if refused.any(|it| it.bounds.iter().all(Result::is_err)) {
            kinds.push("unmeasured-instance");
        }
        if !self.recording.is_empty() {
            kinds.push("incomplete-recording");
        }
        if it.measurement.instances.iter().all(|it| is_alone(&it.instance)) {
            kinds.push("alone");
        }
        let mut seen = HashSet::new();
        kinds.retain(|kind| seen.insert(*kind));
        kinds
    }
}

impl MeasuredEntry {
    /// Returns the warnings about the time of a level, of all instances.
    pub(super) fn warnings_at(&self, level: usize) -> Vec<Warning> {
        let estimates = self.measurement.instances.iter().filter_map(|it| it.result.as_ref().ok());
        estimates.flat_map(|it| it.warnings_at(level)).collect()
    }

    /// Returns whether no execution confirms the time of a level.
    pub(super) fn is_extrapolated(&self, level: usize) -> bool {
        self.warnings_at(level).iter().any(|it| matches!(it, Warning::Extrapolated { .. }))
    }

    /// Returns the times if each level has one.
    pub(super) fn all_times(&self) -> Option<Vec<Time>> {
        self.times.iter().copied().collect()
    }

    /// Returns the time of a level.
    pub(super) fn time(&self, level: usize) -> Option<Time> {
        self.times.get(level).copied().flatten()
    }

    /// Returns whether no level has a time.
    pub(super) fn is_refused(&self) -> bool {
        self.times.iter().all(Option::is_none)
    }

    /// Returns whether it is a short access of a port: a part of the overhead, with a time of its own or without. Each topic needs
    /// one.
    pub(super) fn is_short_access(&self) -> bool {
        let is_port = self.kind() == SpanKind::Access && !self.key().starts_with(PREFIX_OF_TOPICS);
        is_port && self.measurement.greatest() < SHORT_ACCESS
    }

    /// Returns the key of the timing table.
    pub(super) fn key(&self) -> &str {
        port_of(&self.measurement.key).unwrap_or(&self.measurement.key)
    }

    pub(super) fn kind(&self) -> SpanKind {
        SpanKind::of(&self.measurement.key)
    }

    /// Returns why a level has no time, by the instance that withholds it, otherwise by that with the most executions.
    fn lack(&self, level: usize) -> Option<Lack> {
        let most = || self.measurement.instances.iter().max_by_key(|it| it.executions.len());
        let instance = self.measurement.withheld_by(level).or_else(most)?;
        let NoBound { refusal, needed } = instance.bound(level)?.err()?;
        let needed = match refusal {
            EstimateRefusal::TooFew { .. } => LEAST_EXECUTIONS as u64,
            _ => needed,
        };
        let more = needed.saturating_sub(instance.executions.len() as u64);
        Some(Lack { kind: refusal_kind(&refusal), needed, more, instance: instance.instance.clone() })
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
