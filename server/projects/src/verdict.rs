//! The verdict on deployments in one line: for status lines, trees and reports.
//!
//! ```text
//! ✗ 1 late · 2 unknown · 9 measured    ! 9 met · 1 tight · 24 measured    ✓ 9 met · 21 measured · 3 assumed
//! ```
//!
//! The mark is that of the worst part: missed before not analysed before tight before met. A project with errors proves nothing.

use mauve_diagnostics::figure::{HintStatus, met};
use mauve_timing::Status;
use mauve_wcrt::Basis;
use mauve_wcrt::chains::chains_of;
use serde_json::{Value, json};

use crate::analysis_document::Deployed;

/// The verdict on all deployments, at their first levels.
#[derive(Debug, Default)]
pub struct Verdict {
    /// Projects' errors: with one, no deadline is proved.
    errors: usize,
    /// Deadlines that are missed, or for which there is no bound.
    late: usize,
    /// Chains of `mauve.toml` whose latency exceeds the limit.
    late_chains: usize,
    /// Activities and limits of chains that are not analysed.
    unknown: usize,
    met: usize,
    /// Those that are met with little slack.
    tight: usize,
    basis: Basis,
}

impl Verdict {
    /// Counts what is in the reports. Slack below `tight_slack` percent of the deadline is little.
    pub fn of(deployed: &[Deployed<'_>], tight_slack: u32) -> Verdict {
        let mut sum = Verdict::default();
        for it in deployed {
            // An error of a project is one, however many deployments the project has.
            sum.errors = sum.errors.max(it.errors);
            it.basis().into_iter().for_each(|basis| sum.basis.add(basis));
            let Some(&(query, report)) = it.reports.first() else { continue };
            // A reason for all activities is that of each of them.
            sum.unknown += if report.activities.is_empty() { report.not_analysed.len() } else { 0 };
            for activity in &report.activities {
                let is_tight = |it: HintStatus| it == HintStatus::Tight;
                match activity.verdict {
                    Status::Background => {}
                    Status::NotAnalysed => sum.unknown += 1,
                    Status::Met => {
                        sum.met += 1;
                        let figure = activity.response.zip(activity.deadline);
                        let status =
                            figure.map(|(response, deadline)| met(response, deadline, tight_slack).1);
                        sum.tight += usize::from(status.is_some_and(is_tight));
                    }
                    Status::Missed | Status::Unbounded | Status::NoBound => sum.late += 1,
                }
            }
            let Some((project, declared)) = it.model() else { continue };
            let chains = chains_of(it.db, project, declared, query).all.iter();
            for chain in chains.filter(|chain| !chain.is_within_limit()) {
                let count = if chain.latency.is_some() { &mut sum.late_chains } else { &mut sum.unknown };
                *count += 1;
            }
        }
        sum
    }

    /// Its worst part; [`HintStatus::Time`] where there is no deadline.
    pub fn status(&self) -> HintStatus {
        match self {
            _ if self.late + self.late_chains > 0 => HintStatus::Missed,
            _ if self.errors + self.unknown > 0 => HintStatus::Unknown,
            _ if self.tight > 0 => HintStatus::Tight,
            _ if self.met > 0 => HintStatus::Met,
            _ => HintStatus::Time,
        }
    }

    /// Returns it in words, with its mark.
    pub fn words(&self) -> String {
        let mark = match self.status() {
            HintStatus::Missed => "✗ ",
            HintStatus::Unknown => "? ",
            HintStatus::Tight => "! ",
            HintStatus::Met => "✓ ",
            _ => return "no deadlines".to_owned(),
        };
        let is_all_right = self.late + self.late_chains + self.unknown == 0;
        let parts = [
            (self.errors, if self.errors == 1 { "error" } else { "errors" }),
            (self.late, "late"),
            (self.late_chains, if self.late_chains == 1 { "chain late" } else { "chains late" }),
            (self.unknown, "unknown"),
            (if is_all_right { self.met } else { 0 }, "met"),
            (self.tight, "tight"),
            (self.basis.measured, "measured"),
            (self.basis.extrapolated, "extrapolated"),
            (self.basis.assumed, "assumed"),
        ];
        let said = parts.iter().filter(|(count, _)| *count > 0);
        mark.to_owned() + &said.map(|(count, what)| format!("{count} {what}")).collect::<Vec<_>>().join(" · ")
    }

    /// Returns it for editors: `status` is a name of [`HintStatus`]. Where files are `unwatched`, it may be outdated for some seconds.
    pub fn document(&self, unwatched: Option<&str>) -> Value {
        let why = unwatched.map_or_else(String::new, |why| format!(" · files not watched: {why}"));
        json!({ "status": self.status().name(), "text": self.words() + &why })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mark_is_that_of_the_worst_part() {
        let basis = Basis { times: 24, measured: 9, ..Default::default() };
        let all_right = || Verdict { met: 9, basis: basis.clone(), ..Default::default() };
        assert_eq!(all_right().words(), "✓ 9 met · 9 measured");
        assert_eq!(Verdict { tight: 1, ..all_right() }.words(), "! 9 met · 1 tight · 9 measured");
        assert_eq!(
            Verdict { unknown: 2, tight: 1, ..all_right() }.words(),
            "? 2 unknown · 1 tight · 9 measured"
        );
        let late = Verdict { late: 1, unknown: 2, ..all_right() };
        assert_eq!(late.words(), "✗ 1 late · 2 unknown · 9 measured");
        assert_eq!(Verdict { errors: 1, ..all_right() }.words(), "? 1 error · 9 met · 9 measured");
        assert_eq!(Verdict { late_chains: 2, ..Default::default() }.words(), "✗ 2 chains late");
        assert_eq!(Verdict::default().words(), "no deadlines");
        assert_eq!(late.document(None)["status"], "missed");
        assert_eq!(
            all_right().document(Some("raise the limit"))["text"],
            "✓ 9 met · 9 measured · files not watched: raise the limit"
        );
    }
}
