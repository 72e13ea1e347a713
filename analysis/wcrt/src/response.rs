//! The response times of a deployment, of a model or of an exported file.

use mauve_timing::task_set::{TaskSet, TaskSetError};
use mauve_timing::{
    Blocking, Bound, CpuLoad, CpuSet, Order, Priority, Response, SetAnalysis, Status, Task, TaskOperation,
    Time,
};
use rustc_hash::FxHashSet;

use crate::fact::TimingFact;
use crate::locks::lock_reason;
use crate::priorities::priority_facts;
use crate::reason::{CallsReason, Reason, Refusal, Share, UnknownPriority};
use crate::report::{ActivityReport, CallsReport, Query, Report};
use crate::system::{System, system_of};
use crate::table_set::tables_of;
use crate::task_set::DeployedTasks;
use crate::what_if::{WhatIfField, system_if};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, ModelDb, Project};

/// Computes the response times of a deployment.
#[salsa::tracked(returns(ref))]
pub fn response_times<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Report<'db> {
    report_of(db, project, deployment, query, system_of(db, project, deployment))
}

/// Computes the response times of a deployment with other values in its activities: what [`response_times`] would return
/// after that edit. Every value is read, checked and analysed like one in the text.
pub fn response_times_if<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
    what_if: &[WhatIfField],
) -> Report<'db> {
    db.unwind_if_revision_cancelled();
    report_of(db, project, deployment, query, &system_if(db, project, deployment, what_if))
}

fn report_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
    system: &System<'db>,
) -> Report<'db> {
    let deployed = DeployedTasks::of_model(db, tables_of(db, project, deployment), system, query);
    report(&deployed, query, &|| db.unwind_if_revision_cancelled())
}

/// Returns the facts about the activities of a deployment after a change to these values.
pub fn facts_if<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    what_if: &[WhatIfField],
) -> Vec<TimingFact<'db>> {
    let system = system_if(db, project, deployment, what_if);
    let of_priorities = priority_facts(db, project, deployment, &system.activities);
    system.facts.into_iter().chain(of_priorities).collect()
}

/// Computes the response times of a task set of a file.
///
/// # Errors
///
/// The file has no times at the level.
pub fn response_times_of<'db>(set: &TaskSet, query: Query) -> Result<Report<'db>, TaskSetError> {
    Ok(report(&DeployedTasks::of_file(set, query.level, query.method)?, query, &|| ()))
}

fn report<'db>(deployed: &DeployedTasks<'db>, query: Query, interrupt: &dyn Fn()) -> Report<'db> {
    let options = query.options(false);
    let analysis = deployed.tasks.response_times(&options, interrupt);
    let cpus = analysis.cpus.iter().cloned();
    Report {
        times: deployed.times.clone(),
        activities: (0..deployed.reports.len())
            .filter_map(|it| deployed.activity_report(it, &analysis))
            .collect(),
        cpus: cpus
            .map(|it| CpuLoad { complete: it.complete && deployed.not_analysed.is_empty(), ..it })
            .collect(),
        not_analysed: deployed.not_analysed.clone(),
        hosts: deployed.hosts.clone(),
        tasks: analysis.tasks,
        options,
    }
}

impl<'db> DeployedTasks<'db> {
    fn activity_report(&self, index: usize, analysis: &SetAnalysis) -> Option<ActivityReport<'db>> {
        let mut report = self.reports.get(index)?.clone();
        let response = analysis.responses.get(index)?;
        if response.bound == Bound::Background {
            report.reasons.clear();
            report.assumed.clear();
            report.is_extrapolated = false;
            return Some(report);
        }
        report.own = response.own.or(report.own);
        report.share = analysis.share(index).map(Share);
        report.reasons.extend_from_slice(&self.not_analysed);
        if self.not_analysed.is_empty() {
            if report.reasons.is_empty() {
                report.reasons.extend(self.unknown_calls(index, analysis));
                report.reasons.extend(self.locked(index, analysis));
            }
            report.reasons.extend(self.delayed_by(&report.instance, response));
        }
        if !report.reasons.is_empty() {
            report.verdict = Status::NotAnalysed;
            return Some(report);
        }
        report.verdict = response.status(report.deadline);
        report.first_job = response.first_job;
        report.task.arrivals = analysis.tasks.all().get(index).and_then(|it| it.arrivals.clone());
        report.window = response.window.clone();
        report.rule = Some(response.rule);
        report.calls = self.calls(index, analysis);
        let no_bound = match &response.bound {
            Bound::Response(time) => {
                report.response = Some(*time);
                report.method = Some((response.method, response.is_exhausted));
                None
            }
            Bound::Unbounded { cpu } => {
                let utilisation = Share(analysis.utilisation_above(index).unwrap_or_default());
                // An unknown priority counts as the highest.
                let priority = report.priority.real_time().unwrap_or(99);
                let cpu = CpuSet::of(*cpu);
                let named = self.hosts.names(cpu).into();
                Some(Reason::Overloaded { cpu, named, priority, utilisation })
            }
            Bound::NoBound(why) => Some(Reason::NoBound(*why)),
            Bound::NotAnalysed { .. } | Bound::Background => None,
        };
        report.reasons.extend(no_bound.map(|reason| Refusal { reason, at: report.at.clone() }));
        Some(report)
    }

    /// Returns the operations that an activity executes, with their names, their clients, and the numbers of calls in each job.
    fn served_by<'a>(
        &'a self,
        index: usize,
        analysis: &'a SetAnalysis,
    ) -> impl Iterator<Item = (&'a TaskOperation, Name, Name, Option<u64>)> {
        let all = self.tasks.operations.iter().zip(&self.operations).zip(&analysis.calls);
        let served = all.filter(move |((operation, _), _)| operation.provider == index);
        served.filter_map(|((operation, name), calls)| {
            let client = self.reports.get(operation.client)?.instance.clone();
            Some((operation, name.clone(), client, *calls))
        })
    }

    /// Returns the calls that each job of an activity executes.
    fn calls(&self, index: usize, analysis: &SetAnalysis) -> Vec<CallsReport> {
        let known = self.served_by(index, analysis).filter_map(|(of, operation, client, calls)| {
            let time = of.time.checked_mul(calls?).filter(|time| *time > Time::ZERO)?;
            Some(CallsReport { operation, client, calls: calls?, time })
        });
        known.collect()
    }

    /// Returns the operations that an activity executes an unknown number of times, as reasons.
    fn unknown_calls(&self, index: usize, analysis: &SetAnalysis) -> Vec<Refusal<'db>> {
        let at = self.reports.get(index).and_then(|it| it.at.clone());
        let served = self.served_by(index, analysis);
        let unknown = served.filter(|(of, _, _, calls)| of.time > Time::ZERO && calls.is_none());
        let is_served = |it: &Task| it.is_periodic() && it.order == Order::List;
        let is_periodic = self.tasks.all().get(index).is_some_and(is_served);
        let refusal = |(_, operation, client, _)| {
            let reason = Reason::Calls(match is_periodic {
                true => CallsReason::NoResponse { operation, client },
                false => CallsReason::ReleasedByData { operation, client },
            });
            Refusal { reason, at: at.clone() }
        };
        unknown.map(refusal).collect()
    }

    /// Returns the lock that delays an activity for an unknown time, as a reason; with why that is unknown of an activity in the
    /// background, which has no reasons of its own.
    fn locked(&self, index: usize, analysis: &SetAnalysis) -> Vec<Refusal<'db>> {
        let name = |task: usize| self.tasks.name(task).into();
        let blocking = analysis.blocking.get(index);
        let reason = blocking.and_then(|it| lock_reason(it, &self.tasks.locks, &name));
        let at = self.reports.get(index).and_then(|it| it.at.clone());
        let own = reason.map(|reason| Refusal { reason: Reason::Lock(reason), at });
        let because = match blocking {
            Some(Blocking::UnknownTime { because, .. }) => self.reports.get(*because),
            _ => None,
        };
        let because = because.filter(|it| it.priority == Priority::Background);
        own.into_iter().chain(because.into_iter().flat_map(|it| it.reasons.clone())).collect()
    }

    /// Returns the activities that are not analysed and may delay that of `instance`, as a reason.
    fn delayed_by(&self, instance: &Name, response: &Response) -> Option<Refusal<'db>> {
        let Bound::NotAnalysed { because } = &response.bound else { return None };
        // A second activity of its own instance is a reason already.
        let others = because.iter().filter_map(|&index| Some((index, self.reports.get(index)?)));
        let others: Vec<(usize, &ActivityReport<'db>)> =
            others.filter(|(_, it)| it.instance != *instance).collect();
        let &(first, ActivityReport { at, .. }) = others.first()?;
        let others = others.iter().map(|(_, it)| *it).collect::<Vec<_>>();
        // Two activities of one instance have one name.
        let mut seen = FxHashSet::default();
        let instances = others.iter().map(|it| &it.instance).filter(|name| seen.insert(*name));
        let instances: Vec<Name> = instances.cloned().collect();
        let unknown_priority = unknown_priority_of(&others, instances.len() == 1);
        Some(Refusal { reason: Reason::DelayedBy { first, instances, unknown_priority }, at: at.clone() })
    }
}

/// Returns why the priorities of `others` are unknown: they may be higher than that of the activity that is delayed.
fn unknown_priority_of(others: &[&ActivityReport<'_>], is_one_instance: bool) -> Option<UnknownPriority> {
    let written = others.first().and_then(|it| it.unknown_priority.as_ref());
    if let Some(written) = written.filter(|_| is_one_instance) {
        return Some(written.clone());
    }
    if others.iter().any(|it| it.priority != Priority::Unknown) {
        return None;
    }
    Some(match others.iter().any(|it| it.unknown_priority.is_some()) {
        true => UnknownPriority::SeveralOrCpus,
        false if is_one_instance => UnknownPriority::One,
        false => UnknownPriority::Several,
    })
}
