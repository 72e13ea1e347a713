//! Deadlines without a proof: under which code each is reported, and which of them the user accepts.

use mauve_hir::{Acceptance, accepted};
use mauve_timing::Status;
use mauve_wcrt::{ActivityReport, Missed, Reason, Timed, TimingFactKind, UnusableTime, response_times};

use super::*;

/// Returns the code that reports why the deadline of an activity is not proved; `None` if it is proved, or there is none.
///
/// This is `missing-time` if only times of its own codels are missing. An activity that is not analysed because of an error, or
/// because of other activities that are not analysed, has `not-analysed`.
pub fn missing_proof(activity: &ActivityReport<'_>) -> Option<&'static Code> {
    let is_missing_time = |reason: &Reason<'_>| match reason {
        Reason::NoTime(_) => true,
        Reason::Table(UnusableTime::OtherLevels(of, ..)) => matches!(of, Timed::Codel(_)),
        _ => false,
    };
    let own = || activity.reasons.iter().filter(|it| !matches!(it.reason, Reason::DelayedBy { .. }));
    match activity.verdict {
        Status::Background | Status::Met => None,
        Status::Missed | Status::Unbounded | Status::NoBound => Some(&DEADLINE_MISSED),
        Status::NotAnalysed if own().count() > 0 && own().all(|it| is_missing_time(&it.reason)) => {
            Some(&MISSING_TIME)
        }
        Status::NotAnalysed => Some(&NOT_ANALYSED),
    }
}

/// Returns whether a diagnostic of this code reports that a deadline is not proved.
pub fn is_missing_proof(code: &Code) -> bool {
    [&DEADLINE_MISSED, &MISSING_TIME, &NOT_ANALYSED].contains(&code)
}

/// Returns whether `[lints]` sets a severity below an error for this code. The severity that a code has without an entry does
/// not count: a missing proof fails `mauve check` unless the user says otherwise.
pub fn is_lowered(config: &Config, code: &Code) -> bool {
    severity_set(config, code).is_some_and(|severity| severity != Some(Severity::Error))
}

/// Returns whether a fact reports the priority of an activity that misses its deadline with any priority.
pub(crate) fn is_moot(fact: &TimingFact<'_>, of_timing: &[TimingFact<'_>]) -> bool {
    let TimingFactKind::NotDeadlineMonotonic { activity, .. } = &fact.kind else { return false };
    of_timing.iter().any(|it| match &it.kind {
        TimingFactKind::DeadlineMissed { instance, missed: Missed::Alone { .. }, .. } => {
            *instance == activity.instance
        }
        _ => false,
    })
}

/// Returns why the user accepts what a fact reports, if it reports missing proofs, all of accepted activities. The error says which
/// acceptance holds no longer.
pub(crate) fn acceptance<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    fact: &TimingFact<'db>,
) -> Result<Option<String>, String> {
    let instances: Vec<&Name> = match &fact.kind {
        TimingFactKind::DeadlineMissed { instance, .. } | TimingFactKind::NotAnalysed { instance, .. } => {
            vec![instance]
        }
        TimingFactKind::Overloaded(overload) => overload.unbounded.iter().map(|it| &it.instance).collect(),
        _ => Vec::new(),
    };
    let mut reasons: Vec<&str> = Vec::new();
    for instance in instances {
        let Some(acceptance) = accepted(db, project, deployment, instance) else { return Ok(None) };
        if let Some(ceiling) = exceeded(acceptance, || {
            let report = response_times(db, project, deployment, Query::shown(db, project, deployment));
            report.activities.iter().find(|it| it.instance == *instance)?.response
        }) {
            return Err(ceiling);
        }
        reasons.push(&acceptance.reason);
    }
    Ok((!reasons.is_empty()).then(|| each_once(reasons).join("; ")))
}

/// Returns what to say of an acceptance that does not hold with this response time: `accepted until 30 ms only`.
pub fn exceeded(acceptance: &Acceptance, response: impl FnOnce() -> Option<Time>) -> Option<String> {
    let until = acceptance.until?;
    (!acceptance.holds(response())).then(|| format!("accepted until {until} only"))
}
