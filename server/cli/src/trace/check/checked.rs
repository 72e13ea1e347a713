//! What a check of recordings has found.

use std::path::PathBuf;

use mauve_pwcet::trace::Totals;
use mauve_timing::Level;
use mauve_wcrt::Report;
use mauve_wcrt::observed::{ExpectedDeployment, ObservedDeployment};

/// Recordings beside a model.
pub(super) struct Checked<'db> {
    pub(super) name: String,
    pub(super) level: Level,
    pub(super) traces: Vec<PathBuf>,
    pub(super) report: Report<'db>,
    pub(super) expected: ExpectedDeployment,
    pub(super) observed: ObservedDeployment,
    pub(super) summary: Totals,
}

impl Checked<'_> {
    /// Whether the recordings agree with the model.
    pub(super) fn is_fine(&self) -> bool {
        self.observed.findings.is_empty()
    }

    /// Returns the time since the first event.
    pub(super) fn since_begin(&self, at: u64) -> u64 {
        at.saturating_sub(self.summary.first.unwrap_or_default())
    }
}
