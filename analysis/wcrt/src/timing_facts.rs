//! Facts about the response times of a deployment: missed deadlines and overloaded CPUs.

use std::cell::LazyCell;

use mauve_timing::{CpuLoad, CpuSet, Level, Status, Task, Time, name_of_other};

use crate::basis::unmeasured_ports;
use crate::fact::{InterferenceReport, Missed, Overload, TimingFact, TimingFactKind, Unbounded};
use crate::psm::entry_of_greatest_time;
use crate::reason::{Reason, Refusal, Share};
use crate::report::{ActivityReport, Query, Report};
use crate::response::response_times;
use crate::system::{System, system_of};
use crate::threads::{DeclaredThreads, declared_threads, place_of_thread};
use mauve_hir::{Decl, Location, ModelDb, Project};

/// Returns missed deadlines, overloaded CPUs, and activities that are not analysed for a reason that no other fact
/// reports.
pub fn timing_facts<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Vec<TimingFact<'db>> {
    let mut found = Vec::new();
    let report = response_times(db, project, deployment, query);
    // Only background activities ask for it.
    let (full, hosts) = (LazyCell::new(|| full_cpus(report)), &report.hosts);
    let reports = &report.activities;
    let declared = declared_threads(db, project.workspace(db));
    let interrupt = || db.unwind_if_revision_cancelled();
    let mut breakdown = report.breakdown(&interrupt);
    let activities = system_of(db, project, deployment).activities.iter().zip(reports);
    for (index, (activity, report)) in activities.enumerate() {
        let instance = activity.instance.clone();
        let kind = match report.verdict {
            // One fact for each CPU, below.
            Status::Unbounded => continue,
            Status::Missed | Status::NoBound => {
                let deadline = activity.deadline.unwrap_or_default();
                TimingFactKind::DeadlineMissed {
                    instance,
                    deadline,
                    missed: missed(report, || breakdown.of(index)),
                }
            }
            Status::NotAnalysed => {
                let unreported = report.reasons.iter().filter(|it| !it.reason.is_reported());
                let reasons: Vec<Refusal<'db>> = unreported.cloned().collect();
                // Another error of the activity comes first.
                if reasons.is_empty() || activity.refusals.iter().any(|it| it.reason.is_reported()) {
                    continue;
                }
                TimingFactKind::NotAnalysed { instance, reasons }
            }
            Status::Background => match activity.task.cpus.filter(|cpus| (*cpus - *full).is_empty()) {
                Some(cpus) => TimingFactKind::StarvedBackground { instance, cpus: hosts.names(cpus).into() },
                None => continue,
            },
            Status::Met => continue,
        };
        // In a file of threads, the priority stands there.
        let of_thread = activity.declared_thread.and_then(|(index, _)| declared.all.get(index));
        let of_thread = of_thread.and_then(|it| place_of_thread(db, it));
        found.push(TimingFact::new(of_thread.unwrap_or_else(|| activity.at.clone()), kind));
    }
    let ports = unmeasured_ports(db, project, deployment);
    // Without any time, there is nothing that an access could add to.
    if !ports.is_empty() && reports.iter().any(|report| report.response.is_some()) {
        let kind = TimingFactKind::UnmeasuredAccess { ports };
        found.push(TimingFact::new(Location::name_of(deployment), kind));
    }
    found.extend(overloads(db, (system_of(db, project, deployment), declared), report, query.level));
    found
}

/// Returns the CPUs that real-time work may use fully, without throttling, which would leave time for others. An overloaded CPU has
/// another fact, and is not returned.
fn full_cpus(report: &Report<'_>) -> CpuSet {
    let is_full = |load: &&CpuLoad| match load.cpus.len() {
        1 => load.utilisation.compare_with_one().is_eq(),
        // Rounded: there, no overload is an exact comparison either.
        cpus => (load.utilisation.as_f64() - f64::from(cpus)).abs() < 1e-9,
    };
    let throttled = report.others().iter().filter(|it| it.is_throttling);
    let throttled: CpuSet = throttled.map(|it| it.cpus.unwrap_or(CpuSet::ALL)).collect();
    let full: CpuSet = report.cpus.iter().filter(is_full).map(|load| load.cpus).collect();
    full - throttled
}

/// Returns a fact for each overloaded CPU.
fn overloads<'db>(
    db: &'db dyn ModelDb,
    (system, declared): (&System<'db>, &DeclaredThreads),
    report: &Report<'db>,
    level: Level,
) -> Vec<TimingFact<'db>> {
    let reports = &report.activities;
    let mut found: Vec<(Overload<'db>, Option<Location<'db>>)> = Vec::new();
    for (report, activity) in reports.iter().zip(&system.activities) {
        let Some(at) = report.at.clone() else { continue };
        let of_thread = activity.declared_thread.and_then(|(index, _)| declared.all.get(index));
        let at = of_thread.and_then(|it| place_of_thread(db, it)).unwrap_or(at);
        for Refusal { reason, .. } in &report.reasons {
            let Reason::Overloaded { cpu, named, priority, utilisation } = reason else { continue };
            let (cpu, priority, utilisation) = (*cpu, *priority, *utilisation);
            let alone = report.own.zip(report.deadline).filter(|(own, deadline)| own > deadline);
            let unbounded = Unbounded { instance: report.instance.clone(), at: at.clone(), alone };
            match found.iter_mut().find(|(overload, _)| overload.cpu == cpu) {
                Some((overload, highest)) => {
                    overload.unbounded.push(unbounded);
                    if priority > overload.priority {
                        (overload.priority, overload.utilisation) = (priority, utilisation);
                        *highest = Some(at.clone());
                    }
                }
                None => {
                    let unbounded = vec![unbounded];
                    let greatest = report.instance.clone();
                    let overload = Overload {
                        cpu,
                        named: named.clone(),
                        priority,
                        utilisation,
                        greatest,
                        share: None,
                        alone: None,
                        table: None,
                        unbounded,
                    };
                    found.push((overload, Some(at.clone())));
                }
            }
        }
    }
    for (overload, at) in &mut found {
        let contributes = |it: &&ActivityReport<'db>| {
            it.priority.real_time() >= Some(overload.priority) && it.cpus == Some(overload.cpu)
        };
        let share = |it: &ActivityReport<'db>| it.share.map_or(0.0, |share| share.0);
        let contributing = reports.iter().enumerate().filter(|(_, it)| contributes(it));
        let Some((index, greatest)) = contributing.max_by(|a, b| share(a.1).total_cmp(&share(b.1))) else {
            continue;
        };
        (overload.greatest, overload.share) = (greatest.instance.clone(), greatest.share);
        let share_of = |it: &&Task| {
            let (time, period) = it.greatest_cost().zip(it.period)?;
            let time = time.checked_mul(it.burst())?;
            Some((time.as_nanos() as f64 / period.as_nanos() as f64, time, period))
        };
        let contributing = report
            .others()
            .iter()
            .filter(|it| it.priority.real_time() >= Some(overload.priority) && it.cpus == Some(overload.cpu));
        let others = contributing.filter_map(|it| Some((it, share_of(&it)?)));
        let other = others.max_by(|(_, a), (_, b)| a.0.total_cmp(&b.0));
        if let Some((other, (share_of_other, time, period))) = other.filter(|(_, it)| it.0 > share(greatest))
        {
            overload.greatest = name_of_other(&other.name).into();
            overload.share = Some(Share(share_of_other));
            overload.alone = (share_of_other > 1.0).then_some((time, period));
            continue;
        }
        let tables = system.activities.get(index).map(|it| it.tables);
        let component = greatest.component.zip(tables);
        overload.table = component.and_then(|(it, tables)| entry_of_greatest_time(db, tables, it, level));
        let of_burst = greatest.own.and_then(|own| own.checked_mul(greatest.burst()));
        if let Some(alone) = of_burst.zip(greatest.period).filter(|_| share(greatest) > 1.0) {
            *at = greatest.at.clone();
            overload.alone = Some(alone);
        }
    }
    let fact = |(overload, at)| Some(TimingFact::new(at?, TimingFactKind::Overloaded(overload)));
    found.into_iter().filter_map(fact).collect()
}

fn missed<'db>(
    activity: &ActivityReport<'db>,
    interference: impl FnOnce() -> Vec<InterferenceReport>,
) -> Missed<'db> {
    let Some(response) = activity.response else { return Missed::NoBound(activity.reasons.clone()) };
    if let Some(own) = activity.own.filter(|&own| activity.deadline.is_some_and(|deadline| own > deadline)) {
        return Missed::Alone { own, wait: activity.task.wait() };
    }
    // The window of a later job is longer than its response time.
    let later = activity.window.as_ref().filter(|window| window.job > 1);
    Missed::Late {
        response,
        heaviest: interference().into_iter().max_by_key(|it| it.time),
        blocking: activity.window.as_ref().map_or(Time::ZERO, |window| window.blocking),
        window: later.map(|window| (window.job, window.length)),
    }
}
