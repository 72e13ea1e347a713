//! What may change in a deployment, and the analysis of the deployment with other values.

use std::cell::Cell;
use std::cmp::Reverse;
use std::sync::Arc;

use mauve_hir::{Decl, Hosts, ModelDb, PERIODS, PLACES, Project, deployment, hosts_of};
use mauve_syntax::keywords::ActivityField;
use mauve_timing::{
    Bound, CpuSet, Demand, Edge, Priority, Protocol, Response, StateMachine, Task, Tasks, Time, Utilisation,
    Waits,
};

use super::{SearchKind, TuneAim, TuneRequest, Untunable};
use crate::chains::{LimitedLatency, latencies_of};
use crate::reason::Reason;
use crate::system::{ResolvedActivity, System, activities_of, others_of};
use crate::task_set::DeployedTasks;
use crate::threads::{DeclaredThread, declared_threads};
use crate::variants::Variants;
use crate::what_if::{WhatIfField, least_period, other_period};

/// What changes together: an activity, with all instances of its thread.
#[derive(Debug, Clone)]
pub(super) struct TuneUnit<'db> {
    /// The first instance, which names the activity in an edit.
    pub(super) of: &'db ResolvedActivity<'db>,
    /// Indices into [`System::activities`].
    pub(super) members: Vec<usize>,
    /// Whether its deadline is written, and follows the period because it equals the period now.
    has_deadline: bool,
    /// The priority that is written.
    pub(super) priority: Option<u32>,
    /// The CPUs on which it may run now.
    pub(super) cpus: CpuSet,
    /// Whether its CPUs are written.
    pub(super) is_placed: bool,
    /// Whether the user wants it to stay as it is.
    pub(super) is_pinned: bool,
    /// Whether its period may change: data does not release it.
    pub(super) is_periodic: bool,
    /// U, without the calls of operations.
    pub(super) utilisation: f64,
}

impl TuneUnit<'_> {
    /// The least period to which it may be shortened, in nanoseconds.
    pub(super) fn least_period(&self) -> u64 {
        least_period(self.of, self.has_deadline).as_nanos()
    }
}

/// Values for the units, by their index.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TunePlan {
    pub(super) priorities: Vec<u32>,
    /// One CPU; none where the CPUs stay as they are.
    pub(super) cpus: Vec<Option<CpuSet>>,
    pub(super) periods: Vec<Option<Time>>,
    /// The units that count as if they did not exist.
    pub(super) left_out: Vec<bool>,
    /// An activity, and the time to which the execution of its jobs is limited.
    pub(super) cap: Option<(usize, Time)>,
}

impl TunePlan {
    /// Returns the units that exist.
    pub(super) fn present(&self) -> Vec<usize> {
        (0..self.left_out.len()).filter(|unit| !self.left_out[*unit]).collect()
    }
}

/// The analysis of a plan.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    /// The least relative slack of each unit; see [`slack_of`].
    pub(super) slack: Vec<i64>,
    /// The least of the activities that do not change.
    fixed: i64,
}

impl Trial {
    /// Returns whether every deadline is met.
    pub(super) fn is_met(&self, plan: &TunePlan) -> bool {
        self.fixed >= 0 && plan.present().into_iter().all(|unit| self.slack[unit] >= 0)
    }
}

/// How good a plan is: the greatest is the best.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Score {
    /// The number of activities that do not meet their deadline, negated.
    missed: i64,
    /// By the aim.
    value: i128,
    second: i128,
}

impl Score {
    pub(super) fn is_met(self) -> bool {
        self.missed == 0
    }
}

/// The best plan that a search has found so far.
pub(super) struct Best {
    pub(super) plan: TunePlan,
    pub(super) score: Score,
    pub(super) search: SearchKind,
    /// The units that are left where Audsley's algorithm finds none for the next priority.
    pub(super) stuck: Vec<usize>,
}

impl Best {
    /// Begins with a plan. None where the budget is exhausted.
    pub(super) fn of(trials: &Trials<'_>, plan: &TunePlan) -> Option<Best> {
        let score = trials.score(plan)?;
        Some(Best { plan: plan.clone(), score, search: SearchKind::Exact, stuck: Vec::new() })
    }

    /// Takes another plan if it is better.
    pub(super) fn consider(&mut self, other: Best) {
        if other.score > self.score {
            (self.plan, self.score) = (other.plan, other.score);
        }
    }

    /// Makes one change after another, as long as something gets better. `changed` returns the solved plan with a change, if it is
    /// possible; its outer none: the budget is exhausted.
    pub(super) fn improve<C>(
        &mut self,
        trials: &Trials<'_>,
        changes: &[C],
        changed: impl Fn(&TunePlan, &C) -> Option<Option<Best>>,
    ) -> Option<()> {
        loop {
            let before = self.score;
            for change in changes {
                changed(&self.plan, change)?.into_iter().for_each(|it| self.consider(it));
                if trials.is_enough(self.score) {
                    return Some(());
                }
            }
            if self.score == before {
                return Some(());
            }
        }
    }
}

/// No slack: the response time has no bound, or is not known.
const UNBOUNDED: i64 = i64::MIN / 4;
const NOT_ANALYSED: i64 = i64::MIN / 2;

/// The search's view of a deployment.
pub(super) struct Trials<'db> {
    pub(super) variants: Variants<'db>,
    pub(super) request: TuneRequest,
    pub(super) units: Vec<TuneUnit<'db>>,
    /// The priorities and CPUs of what runs beside the units and stays: gateways, other real-time work.
    pub(super) fixed: Vec<(u32, CpuSet)>,
    /// The gateways.
    fixed_activities: Vec<usize>,
    /// The units whose deadlines count as met.
    pub(super) given_up: Vec<usize>,
    /// The tasks with the present values, and priorities where they are missing.
    pub(super) tasks: Tasks,
    /// Whether the budget of an analysis was exhausted, so that its bound may depend on the order of priorities.
    is_exhausted: Cell<bool>,
}

impl<'db> Trials<'db> {
    pub(super) fn new(
        variants: Variants<'db>,
        request: &TuneRequest,
    ) -> Result<Trials<'db>, Vec<Untunable<'db>>> {
        let Variants { db, project, deployment: of, system, .. } = variants;
        deployment(db, of).ok_or_else(Vec::new)?;
        let others = others_of(db, project.workspace(db), system.cpus);
        let gateways = || system.activities.iter().enumerate().filter(|(_, it)| it.gateway.is_some());
        let fixed = gateways().map(|(_, it)| &it.task).chain(&others);
        let fixed = fixed.filter_map(|it| Some((it.priority.real_time()?, it.cpus.unwrap_or(CpuSet::ALL))));
        let mut trials = Trials {
            variants,
            request: request.clone(),
            units: units(db, (project, of), system, request),
            fixed: fixed.collect(),
            fixed_activities: gateways().map(|(index, _)| index).collect(),
            given_up: Vec::new(),
            tasks: Tasks::default(),
            is_exhausted: Cell::new(false),
        };
        let start = trials.start();
        // With a priority, an activity has the CPUs that it may use.
        let (known, deployed) = trials.variants.with_fields(&trials.fields(&start));
        let untunable = trials.untunable(&deployed);
        if !untunable.is_empty() {
            return Err(untunable);
        }
        for unit in &mut trials.units {
            let first = unit.members.first().and_then(|it| known.activities.get(*it));
            unit.cpus = first.and_then(|it| it.cpus).unwrap_or(CpuSet::NONE);
            let share = |member: &usize| {
                let task = deployed.tasks.activities().get(*member)?;
                let mean = task.demand.machine()?.greatest_cycle_mean();
                Some(Utilisation::new([(mean, task.period?)]).as_f64())
            };
            unit.utilisation = unit.members.iter().filter_map(share).sum();
        }
        trials.tasks = deployed.tasks;
        Ok(trials)
    }

    /// Returns why activities are not analysed, whatever their values.
    fn untunable(&self, deployed: &DeployedTasks<'db>) -> Vec<Untunable<'db>> {
        let mut found = Vec::new();
        if !deployed.not_analysed.is_empty() {
            found.push(Untunable { instance: None, refusals: deployed.not_analysed.clone() });
        }
        for report in deployed.reports.iter().filter(|it| it.task.priority != Priority::Background) {
            let is_lasting = |reason: &Reason<'_>| !matches!(reason, Reason::Middleware(_));
            let refusals: Vec<_> =
                report.reasons.iter().filter(|it| is_lasting(&it.reason)).cloned().collect();
            if !refusals.is_empty() {
                found.push(Untunable { instance: Some(report.instance.clone()), refusals });
            }
        }
        found
    }

    /// Returns the present values. Where priorities are missing, all are deadline-monotonic.
    pub(super) fn start(&self) -> TunePlan {
        let count = self.units.len();
        let mut priorities: Vec<u32> = self.units.iter().filter_map(|it| it.priority).collect();
        if priorities.len() < count {
            let mut order: Vec<usize> = (0..count).collect();
            // Of equal deadlines, the first one gets the higher priority: texts follow the way of the data.
            order.sort_by_key(|it| Reverse((self.units[*it].of.deadline, *it)));
            priorities = vec![1; count];
            for (number, unit) in (1..=99).chain(std::iter::repeat(99)).zip(order) {
                let pinned = self.units[unit].priority.filter(|_| self.units[unit].is_pinned);
                priorities[unit] = pinned.unwrap_or(number);
            }
        }
        TunePlan {
            priorities,
            cpus: vec![None; count],
            periods: vec![None; count],
            left_out: vec![false; count],
            cap: None,
        }
    }

    /// Returns whether a priority is missing.
    pub(super) fn lacks_priorities(&self) -> bool {
        self.units.iter().any(|it| it.priority.is_none())
    }

    /// Returns the CPUs of a unit in a plan.
    pub(super) fn cpus(&self, plan: &TunePlan, unit: usize) -> CpuSet {
        plan.cpus[unit].unwrap_or(self.units[unit].cpus)
    }

    /// Returns the values of a plan that are not those of the text.
    pub(super) fn fields(&self, plan: &TunePlan) -> Vec<WhatIfField> {
        let hosts = self.hosts();
        let mut fields = Vec::new();
        for (index, unit) in self.units.iter().enumerate() {
            let cpu = plan.cpus[index].filter(|cpu| *cpu != unit.cpus).map(|cpu| hosts.local(cpu).1.0);
            fields.extend(cpu.map(|cpu| WhatIfField::new(unit.of, ActivityField::Affinity, cpu)));
            let priority = Some(plan.priorities[index]).filter(|it| Some(*it) != unit.priority);
            fields.extend(priority.map(|it| WhatIfField::new(unit.of, ActivityField::Priority, it)));
            let period = plan.periods[index].filter(|it| Some(*it) != unit.of.period);
            fields.extend(period.into_iter().flat_map(|it| other_period(unit.of, unit.has_deadline, it)));
        }
        fields
    }

    fn hosts(&self) -> &'db Hosts {
        hosts_of(self.variants.db, self.variants.project.workspace(self.variants.db))
    }

    /// Analyses a plan. None where the budget is exhausted.
    pub(super) fn analyse(&self, plan: &TunePlan) -> Option<Trial> {
        let count = plan.left_out.iter().filter(|it| !**it).count() + self.fixed_activities.len();
        if self.variants.spend(count).is_none() {
            self.variants.left.set(0);
            return None;
        }
        let (_, deployed) = self.variants.with_fields(&self.fields(plan));
        let responses = self.variants.responses(&self.remaining(plan, &deployed.tasks), false);
        let slack = |index: usize| {
            let refused = deployed.reports.get(index).is_none_or(|it| !it.reasons.is_empty());
            match (deployed.tasks.activities().get(index), responses.get(index)) {
                (Some(task), Some(response)) if !refused && deployed.not_analysed.is_empty() => {
                    slack_of(task.deadline, response)
                }
                _ => NOT_ANALYSED,
            }
        };
        let of_unit = |(index, unit): (usize, &TuneUnit<'_>)| match self.given_up.contains(&index) {
            true => i64::MAX,
            false => unit.members.iter().map(|it| slack(*it)).min().unwrap_or_default(),
        };
        let is_exhausted = responses.iter().any(|it| it.is_exhausted);
        self.is_exhausted.set(self.is_exhausted.get() | is_exhausted);
        Some(Trial {
            slack: self.units.iter().enumerate().map(of_unit).collect(),
            fixed: self.fixed_activities.iter().map(|it| slack(*it)).min().unwrap_or(i64::MAX),
        })
    }

    /// Analyses a plan, and says how good it is.
    pub(super) fn score(&self, plan: &TunePlan) -> Option<Score> {
        let before = self.variants.left.get();
        let trial = self.analyse(plan)?;
        let slacks = || plan.present().into_iter().map(|unit| trial.slack[unit]).chain([trial.fixed]);
        let missed = slacks().filter(|it| *it < 0).count();
        let mut score = Score { missed: -i64::try_from(missed).unwrap_or(i64::MAX), value: 0, second: 0 };
        if missed > 0 {
            // What is late by less is better.
            score.value = slacks().map(|it| i128::from(it.min(0))).sum();
            return Some(score);
        }
        match self.request.aim {
            TuneAim::Deadlines => {}
            TuneAim::Slack => score.value = i128::from(slacks().min().unwrap_or_default()),
            TuneAim::Latency => {
                let (found, steps) = latencies_of(&self.variants, &self.fields(plan));
                // It analyses the plan once more.
                let left = self.variants.left.get();
                self.variants.left.set(left.saturating_sub(before - left + steps));
                let (worst, sum) = latency(&found);
                (score.value, score.second) = (-worst, -sum);
            }
        }
        Some(score)
    }

    /// Returns whether nothing better is requested.
    pub(super) fn is_enough(&self, score: Score) -> bool {
        score.is_met() && self.request.aim == TuneAim::Deadlines
    }

    /// Gives another search a quarter of the budget at least.
    pub(super) fn refill(&self) {
        self.variants.left.set(self.variants.left.get().max(self.request.most_steps / 4));
    }

    /// Returns whether the budget is exhausted.
    pub(super) fn is_spent(&self) -> bool {
        self.variants.left.get() == 0
    }

    /// Returns whether a response time depends only on which activities have higher priorities, and becomes no greater if there are
    /// fewer of them: then Audsley's algorithm is optimal. With waits, operations, or several CPUs, it depends on other response
    /// times; with a lock without a protocol, on the order of its users.
    pub(super) fn is_order_free(&self, plan: &TunePlan) -> bool {
        let is_simple = |unit: &usize| {
            let mut tasks =
                self.units[*unit].members.iter().filter_map(|it| self.tasks.activities().get(*it));
            self.cpus(plan, *unit).is_one() && tasks.all(|it| it.waits.is_none() && it.offset.is_none())
        };
        let locks = || self.tasks.locks.iter().filter(|it| it.users.len() > 1);
        let fixed = &self.fixed_activities;
        let mut fixed = fixed.iter().filter_map(|it| self.tasks.activities().get(*it));
        plan.present().iter().all(is_simple)
            && fixed.all(|it| it.cpus.is_some_and(CpuSet::is_one))
            && self.tasks.operations.is_empty()
            && locks().all(|it| it.protocol != Protocol::None)
            && !self.is_exhausted.get()
    }

    /// Returns whether the response times on one CPU depend on nothing on another.
    pub(super) fn has_separate_cpus(&self) -> bool {
        let fixed = self.fixed_activities.iter().filter_map(|it| self.tasks.activities().get(*it));
        let mut pinned = self.units.iter().filter(|it| it.is_pinned);
        let mut fixed = fixed.filter_map(|it| it.cpus);
        self.tasks.operations.is_empty()
            && pinned.all(|it| it.cpus.is_one())
            && fixed.all(CpuSet::is_one)
            && self.fixed.iter().all(|(_, cpus)| cpus.is_one() || *cpus == self.variants.system.cpus)
    }

    /// Returns the tasks without those that are left out, and with what the cap leaves.
    fn remaining(&self, plan: &TunePlan, tasks: &Tasks) -> Tasks {
        let mut left = tasks.clone();
        if let Some((capped, most)) = plan.cap
            && let Some(task) = left.activities_mut().get_mut(capped)
        {
            limit(task, most);
        }
        if !plan.left_out.contains(&true) {
            return left;
        }
        let out = self.units.iter().zip(&plan.left_out).filter(|(_, out)| **out);
        let out: Vec<usize> = out.flat_map(|(unit, _)| unit.members.iter().copied()).collect();
        for task in &out {
            if let Some(task) = left.activities_mut().get_mut(*task) {
                task.priority = Priority::Background;
            }
        }
        for lock in &mut left.locks {
            lock.users.retain(|user| !out.contains(&user.task));
        }
        // What an operation that is left out sends is left out too.
        let mut kept: Vec<Option<usize>> = Vec::new();
        let mut operations = Vec::new();
        for operation in &left.operations {
            let during = operation.during.map(|it| kept.get(it).copied().flatten());
            let is_out = [operation.provider, operation.client].iter().any(|it| out.contains(it));
            if is_out || during == Some(None) {
                kept.push(None);
                continue;
            }
            kept.push(Some(operations.len()));
            operations.push(mauve_timing::TaskOperation { during: during.flatten(), ..operation.clone() });
        }
        left.operations = operations;
        left
    }

    /// Returns the greatest execution time of the jobs of an activity, without their waits.
    pub(super) fn time_of(&self, activity: usize) -> Option<Time> {
        self.tasks.activities().get(activity)?.executed().map(StateMachine::greatest_cost)
    }

    /// Returns a unit whose own time exceeds its deadline: it misses that with any priority, on any CPU of its host.
    pub(super) fn hopeless(&self, plan: &TunePlan) -> Option<usize> {
        let is_late = |member: &usize| {
            let task = self.tasks.activities().get(*member);
            task.is_some_and(|it| it.greatest_cost() > it.deadline && it.deadline.is_some())
        };
        let units = plan.present().into_iter().filter(|unit| !self.given_up.contains(unit));
        units.into_iter().find(|unit| self.units[*unit].members.iter().any(is_late))
    }

    /// Returns the tasks of the units that take a lock together: those have to be on one CPU.
    pub(super) fn sharing_locks(&self) -> Vec<Vec<usize>> {
        let unit_of = |task: usize| self.units.iter().position(|it| it.members.contains(&task));
        let units = |lock: &mauve_timing::Lock| lock.users.iter().filter_map(|it| unit_of(it.task)).collect();
        self.tasks.locks.iter().filter(|it| it.users.len() > 1).map(units).collect()
    }

    /// Returns the CPUs of the host of a unit.
    pub(super) fn cpus_of_host(&self, unit: &TuneUnit<'_>) -> CpuSet {
        unit.of.host.and_then(|it| self.hosts().all.get(it)).map_or(self.variants.system.cpus, |it| it.cpus)
    }
}

/// Lets the jobs of a task execute no longer than `most`. They wait as before.
fn limit(task: &mut Task, most: Time) {
    let Demand::Machine { machine, whole } = &task.demand else { return };
    let executed = task.executed().unwrap_or(machine);
    let wait = |index: usize| {
        let cost = |of: &StateMachine| of.edges().get(index).map(|it| it.cost).unwrap_or_default();
        cost(machine).checked_sub(cost(executed)).unwrap_or_default()
    };
    let with = |wait: &dyn Fn(usize) -> Time| {
        let edges = executed.edges().iter().enumerate();
        let edges = edges.map(|(index, edge)| {
            Some(Edge { cost: edge.cost.min(most).checked_add(wait(index))?, ..edge.clone() })
        });
        StateMachine::new(executed.states(), edges.collect::<Option<_>>()?).ok()
    };
    let longest = (0..executed.edges().len()).map(wait).max().unwrap_or_default();
    let whole = whole.map(|it| most.checked_add(longest).map_or(it, |most| it.min(most)));
    let (Some(machine), Some(executed)) = (with(&wait), with(&|_| Time::ZERO)) else { return };
    task.waits = task.waits.as_ref().map(|it| Arc::new(Waits { executed, times: it.times }));
    task.demand = Demand::Machine { machine, whole };
}

/// Returns the relative slack, 1 − R/D, in billionths; negative exactly if the deadline is not met.
fn slack_of(deadline: Option<Time>, response: &Response) -> i64 {
    match (&response.bound, deadline) {
        (Bound::Response(time), Some(deadline)) => {
            let (response, deadline) = (i128::from(time.as_nanos()), i128::from(deadline.as_nanos().max(1)));
            let slack = ((deadline - response) * 1_000_000_000).div_euclid(deadline);
            i64::try_from(slack).unwrap_or(UNBOUNDED).max(UNBOUNDED + 1)
        }
        (Bound::Background, _) => 1_000_000_000,
        (Bound::Unbounded { .. } | Bound::NoBound(_), _) => UNBOUNDED,
        _ => NOT_ANALYSED,
    }
}

/// Returns the worst part of a limit in billionths, and the sum of the latencies in nanoseconds.
fn latency(found: &[LimitedLatency]) -> (i128, i128) {
    let (mut worst, mut sum) = (0, 0);
    for (limit, latency) in found {
        // A latency without a bound is longer than any other.
        let latency = latency.map_or(i128::from(u64::MAX), |it| i128::from(it.as_nanos()));
        if let Some(limit) = limit {
            worst = worst.max(latency * 1_000_000_000 / i128::from(limit.as_nanos().max(1)));
        }
        sum += latency;
    }
    (worst, sum)
}

/// Returns the units of a deployment.
fn units<'db>(
    db: &'db dyn ModelDb,
    (project, of): (Project<'db>, Decl<'db>),
    system: &'db System<'db>,
    request: &TuneRequest,
) -> Vec<TuneUnit<'db>> {
    let written = activities_of(db, of);
    let threads = declared_threads(db, project.workspace(db));
    let mut units: Vec<TuneUnit<'db>> = Vec::new();
    for (index, activity) in system.activities.iter().enumerate() {
        let Some(declared) = written.get(&activity.instance) else { continue };
        // An entry of several groups stays: others would change, too.
        let entry = activity.declared_thread.and_then(|(index, _)| threads.all.get(index));
        let is_pinned = request.pins.iter().any(|it| *it == activity.instance || *it == activity.activity)
            || entry.is_some_and(DeclaredThread::is_wildcard);
        // A thread of a file gets a policy with its priority.
        let may_rise = activity.declared_thread.is_some() && activity.period.is_some() && !is_pinned;
        if activity.gateway.is_some() || activity.priority == Priority::Background && !may_rise {
            continue;
        }
        let is_it =
            |it: &&mut TuneUnit<'_>| it.of.activity == activity.activity || it.of.is_queued_with(activity);
        if let Some(unit) = units.iter_mut().find(is_it) {
            // The thread has one priority, and each of its activities a period of its own.
            unit.is_periodic &= !unit.of.is_queued_with(activity);
            unit.members.push(index);
            unit.is_pinned |= is_pinned;
            continue;
        }
        units.push(TuneUnit {
            of: activity,
            members: vec![index],
            has_deadline: declared.field(ActivityField::Deadline).is_some(),
            priority: activity.priority.real_time(),
            cpus: activity.cpus.unwrap_or(CpuSet::NONE),
            is_placed: activity.declared_thread.is_some()
                || PLACES.iter().any(|it| declared.field(*it).is_some()),
            is_pinned,
            is_periodic: activity.is_periodic() && PERIODS.iter().any(|it| declared.field(*it).is_some()),
            utilisation: 0.0,
        });
    }
    units
}
