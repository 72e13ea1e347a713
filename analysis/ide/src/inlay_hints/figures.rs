//! The figures of a declaration in an earlier text, in the place of unknown ones.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use super::{HintFigure, HintOf, HintSubject, InlayHint};
use mauve_diagnostics::figure::HintStatus;

/// How long a text is incomplete before hints say why a figure is unknown, beside the older figure.
pub(super) const PATIENCE: Duration = Duration::from_secs(3);

/// The figures of a declaration.
#[derive(Debug, Clone, Default)]
pub(super) struct LastFigures {
    pub(super) of: HashMap<HintSubject, HintFigure>,
    /// The hash of the hints that they were taken from.
    pub(super) hash: u64,
    /// When the first of them became older than the text, and whether hints say why.
    pub(super) older: Option<(Instant, bool)>,
}

impl LastFigures {
    pub(super) fn get(&self, subject: &HintSubject) -> Option<&HintFigure> {
        self.of.get(subject)
    }

    /// Whether hints say why a figure is unknown, beside the older one.
    pub(super) fn are_reasons_shown(&self) -> bool {
        self.older.is_some_and(|(since, is_saved)| is_saved || since.elapsed() >= PATIENCE)
    }
}

/// Whether a figure replaces an earlier one: it includes as much.
pub(super) fn is_newer(figure: Option<&HintFigure>, earlier: Option<&HintFigure>) -> bool {
    match (figure, earlier) {
        (_, None) => true,
        (None, Some(_)) => false,
        (Some(figure), Some(earlier)) => figure.missing <= earlier.missing,
    }
}

/// Returns a hint, or in its place the older one of its subject. After a while, the new one stands beside the older; a count, which
/// says no reason, replaces it.
pub(super) fn with_earlier(found: HintOf, earlier: Option<&LastFigures>) -> Vec<HintOf> {
    let shown = earlier.zip(found.subject.as_ref()).and_then(|(figures, subject)| {
        let earlier =
            figures.get(subject).filter(|earlier| !is_newer(found.figure.as_ref(), Some(*earlier)))?;
        Some((older(&found, earlier), figures.are_reasons_shown()))
    });
    match shown {
        None if found.hint.label.is_empty() => Vec::new(),
        None => vec![found],
        Some((_, true)) if matches!(found.subject, Some(HintSubject::Deadlines | HintSubject::Cpus(_))) => {
            vec![found]
        }
        Some((hint, are_reasons_shown)) => {
            let beside = (are_reasons_shown && !found.hint.label.is_empty()).then(|| found.clone());
            [HintOf { hint, ..found }].into_iter().chain(beside).collect()
        }
    }
}

/// Returns the earlier utilisations of CPUs that the hints of a deployment lack: where no time is known, no CPU has any.
pub(super) fn missing_loads(found: &[HintOf], earlier: Option<&LastFigures>) -> Vec<HintOf> {
    let is_deadlines = |it: &&HintOf| it.subject == Some(HintSubject::Deadlines);
    let Some((figures, deadlines)) = earlier.zip(found.iter().find(is_deadlines)) else { return Vec::new() };
    let is_missing = |subject: &&HintSubject| {
        matches!(subject, HintSubject::Cpus(_))
            && !found.iter().any(|it| it.subject.as_ref() == Some(*subject))
    };
    let mut missing: Vec<(&HintSubject, &HintFigure)> =
        figures.of.iter().filter(|(subject, _)| is_missing(subject)).collect();
    missing.sort_by_key(|(_, figure)| &figure.texts);
    let load = |(subject, figure): (&HintSubject, &HintFigure)| HintOf {
        hint: older(deadlines, figure),
        subject: Some(subject.clone()),
        figure: None,
        room: deadlines.room,
    };
    missing.into_iter().map(load).collect()
}

/// Returns the hint of an earlier figure.
pub(super) fn older(HintOf { hint, room, .. }: &HintOf, figure: &HintFigure) -> InlayHint {
    InlayHint::new(hint.offset, figure.texts.as_older(), *room, HintStatus::Older, hint.explained_at)
}
