//! Certificates: why deadlines are met, so that a checker that does not trust this analysis can follow.
//!
//! A certificate has the task set, and a claim for each response time: for each job of a busy window that begins at any instant, a time at
//! which it has ended for sure. The claims are those of [`Method::Ibf`] on one CPU, with waits that count as execution: a checker cannot
//! follow a search over combinations of paths, and it knows no clocks; nor does it know in which order a thread executes jobs of several
//! periods, or when a job begins. A response time that is more by that method may still be
//! within its deadline.

use std::cell::LazyCell;
use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value, json};

use crate::cycle_mean::Adjacency;
use crate::lane::JobCounts;
use crate::operations::counts;
use crate::response_time::Lanes;
use crate::trace_bound::Recurrence;
use crate::{
    Bound, CpuRule, Method, Options, Order, Priority, SetAnalysis, StateMachine, TaskKind, Tasks, Time,
};

/// The most jobs in the window of a claim.
const MOST_JOBS: usize = 1 << 14;
/// The steps of the fixed points of a claim.
const BUDGET: u64 = 1 << 23;
/// The steps until the closed form of a demand must be found.
const MOST_STEPS: u64 = 1 << 14;
/// Throttling delays all priorities.
const THROTTLING: u64 = 1 << 32;

type Claims = BTreeMap<usize, TaskClaim>;

/// No job ends later than this.
struct TaskClaim {
    response: u64,
    cpu: Option<u32>,
    ends: Vec<u64>,
    closes: Option<u64>,
    /// The tasks whose demand counts.
    members: Vec<usize>,
}

impl Tasks {
    /// Returns the certificate of the deadlines of the activities that are met: the objects `tasks`, `locks`, `operations`, `claims` and
    /// `not_certified`. To cancel, `interrupt` unwinds.
    pub fn certificate(&self, is_met: &dyn Fn(usize) -> bool, interrupt: &dyn Fn()) -> Map<String, Value> {
        let options = Options { method: Method::Ibf, is_brief: false };
        let mut set = self.clone();
        // Nor does it know who writes the data that releases tasks.
        set.all.iter_mut().for_each(|task| (task.offset, task.arrivals) = (None, None));
        set.triggers.clear();
        let found = set.response_times(&options, interrupt);
        let with_triggers = LazyCell::new(|| {
            let followed = Tasks { triggers: self.triggers.clone(), ..set.clone() };
            followed.response_times(&options, interrupt)
        });
        let mut lanes = Lanes::new(&found.tasks.all, &options, interrupt);
        let claim = |task: usize| Some((task, claim(&mut lanes, &found, task)?));
        let mut claims: Claims = (0..self.all.len()).filter_map(claim).collect();
        // What locks leave without a bound has a known demand all the same.
        let demands = found.tasks.all.iter().zip(&self.all).map(|(with, it)| {
            let machine = with.demand.machine().or(it.demand.machine());
            growth(machine?, interrupt)
        });
        let growths: Vec<_> = demands.collect();
        let calls = found.keep_proved(&mut claims, &growths);
        let (mut all, mut left_out) = (Vec::new(), Vec::new());
        for (task, of) in self.all.iter().enumerate() {
            let (claim, deadline) = (claims.get(&task), of.deadline.filter(|_| is_met(task)));
            let met = claim.zip(deadline).is_some_and(|(claim, it)| claim.response <= it.as_nanos());
            if let Some(claim) = claim {
                all.push(json!({
                    "task": task,
                    "response": claim.response,
                    "met": met,
                    "cpu": claim.cpu,
                    "blocking": found.tasks.all[task].blocking.as_nanos(),
                    "ends": claim.ends,
                    "closes": claim.closes,
                }));
            }
            if deadline.is_some() && !met {
                let bound = |of: &SetAnalysis| of.responses[task].bound.clone();
                let follows_writers = !self.triggers.is_empty() && bound(&with_triggers) != bound(&found);
                let reason = match (claim, found.responses[task].rule) {
                    _ if follows_writers => "by-writers",
                    (Some(_), _) => "no-form",
                    (None, CpuRule::Global(_)) => "several-cpus",
                    _ => "too-many-jobs",
                };
                left_out.push((&*of.name, reason));
            }
        }
        let tasks = growths.iter().enumerate().map(|(task, growth)| self.task_value(task, growth.as_ref()));
        let operations = self.operations.iter().zip(&calls).map(|(of, calls)| {
            json!({
                "provider": of.provider,
                "client": of.client,
                "sends": of.sends,
                "every": of.every,
                "starting": of.starting,
                "pending": of.pending,
                "time": of.time.as_nanos(),
                "calls": calls,
            })
        });
        let parts = [
            ("tasks", tasks.collect::<Value>()),
            ("locks", self.locks.iter().map(lock_value).collect()),
            ("operations", operations.collect()),
            ("claims", all.into()),
            ("not_certified", json!(left_out)),
        ];
        parts.map(|(key, value)| (key.to_owned(), value)).into_iter().collect()
    }

    fn task_value(&self, index: usize, growth: Option<&Growth>) -> Value {
        let (task, kind) = (&self.all[index], self.kind(index));
        let machine = task.demand.machine().zip(task.executed()).zip(growth);
        let machine = machine.map(|((machine, executed), (from, period, gains))| {
            let edges = machine.edges().iter().zip(executed.edges()).map(|(with, edge)| {
                let wait = with.cost.as_nanos().saturating_sub(edge.cost.as_nanos());
                (edge.source, edge.target, edge.cost.as_nanos(), wait)
            });
            json!({
                "states": machine.states(),
                "edges": edges.collect::<Vec<_>>(),
                "waits": task.waits.as_ref().map_or(Some(0), |waits| waits.times),
                "from": from,
                "period": period,
                "gains": gains,
            })
        });
        json!({
            "name": &*task.name,
            "is_activity": kind == TaskKind::Activity,
            "is_real_time": task.priority != Priority::Background,
            "priority": match task.priority {
                Priority::RealTime(priority) => Some(u64::from(priority)),
                _ => Some(THROTTLING).filter(|_| task.is_throttling),
            },
            "period": task.period.map(Time::as_nanos),
            "deadline": task.deadline.map(Time::as_nanos),
            "jitter": task.jitter.as_nanos(),
            "burst": task.burst(),
            "sporadic": task.is_sporadic,
            "throttling": task.is_throttling,
            "thread": task.thread.filter(|_| task.order == Order::List),
            "not_preempted": task.is_not_preempted,
            "cpus": task.cpus.map(|cpus| cpus.iter().collect::<Vec<u32>>()),
            "machine": machine,
        })
    }
}

impl SetAnalysis {
    /// Leaves out the claims that rely on what is not claimed, and returns how many calls of each operation a job counts; none if
    /// that is not proved.
    fn keep_proved(&self, claims: &mut Claims, growths: &[Option<Growth>]) -> Vec<Option<u64>> {
        let operations = &self.tasks.operations;
        loop {
            let response = |task| claims.get(&task).map(|it| Time::from_nanos(it.response));
            let least = counts(&self.tasks, &(0..self.tasks.all.len()).map(response).collect::<Vec<_>>());
            let proved = operations.iter().zip(&self.calls).zip(least).map(|((of, calls), least)| {
                calls.filter(|it| of.during.is_none() && least.is_some_and(|least| *it >= least))
            });
            let calls: Vec<Option<u64>> = proved.collect();
            let of_unknown = operations.iter().zip(&calls).filter(|it| it.1.is_none());
            let unknown: BTreeSet<usize> = of_unknown.map(|it| it.0.provider).collect();
            let number = claims.len();
            claims.retain(|_, it| {
                it.members.iter().all(|task| growths[*task].is_some() && !unknown.contains(task))
            });
            if claims.len() == number {
                return calls;
            }
        }
    }
}

/// (m, c, K): from m jobs on, c jobs more demand K more, by state.
type Growth = (u64, u64, Vec<u64>);

/// Returns the closed form of the demand of a machine, by the state in which its jobs end; none if it is not found.
fn growth(machine: &StateMachine, interrupt: &dyn Fn()) -> Option<Growth> {
    machine.greatest_cost().as_nanos().checked_mul(MOST_STEPS)?;
    let mut recurrence = Recurrence::new(Adjacency::reversed(machine));
    for _ in 0..MOST_STEPS {
        recurrence.step(interrupt).ok()?;
        if let Some(period) = recurrence.look_for_period() {
            let (base, length, gains) = period.form();
            return Some((base, length, gains.get(..machine.states() as usize)?.to_vec()));
        }
    }
    None
}

fn claim(lanes: &mut Lanes<'_>, found: &SetAnalysis, task: usize) -> Option<TaskClaim> {
    let of = found.responses.get(task).filter(|it| matches!(it.bound, Bound::Response(_)))?;
    let cpu = match of.rule {
        CpuRule::Cpu(cpu) => Some(cpu),
        CpuRule::Linked(_) => None,
        CpuRule::Global(_) => return None,
    };
    let (plan, place) = lanes.find(task, of.rule)?;
    let (mut lane, method) = (lanes.lane(plan), Method::Ibf);
    let others = lane.interfering(place);
    let mut counts = JobCounts::new(lane.members.len());
    others.iter().for_each(|other| counts.include(*other, &mut lane.members, method));
    let mates = lane.mates(place, 1).into_iter().map(|it| it.0);
    let places: Vec<usize> = others.into_iter().chain(mates).chain([place]).collect();
    let members = places.into_iter().map(|it| lane.members.get(it).index).collect();
    let (mut claim, mut budget) =
        (TaskClaim { response: 0, cpu, ends: Vec::new(), closes: None, members }, BUDGET);
    while claim.ends.len() < MOST_JOBS {
        let job = claim.ends.len() as u64 + 1;
        let own = lane.demand(place, job, false).ok()?;
        let end = lane.window(place, job, own, &mut counts, method, &mut budget).ok()?;
        claim.ends.push(end);
        let member = lane.members.get(place);
        let (jitter, release, next) =
            (member.jitter, member.release(job).ok()?, member.release(job + 1).ok()?);
        claim.response = claim.response.max(end.checked_add(jitter)?.saturating_sub(release));
        let whole = lane.demand(place, job, true).ok()?;
        let closes = lane.window(place, job, whole, &mut counts, method, &mut budget).ok()?;
        claim.closes = Some(closes).filter(|it| *it != end);
        if closes.checked_add(jitter)? <= next {
            return Some(claim);
        }
    }
    None
}

fn lock_value(lock: &crate::Lock) -> Value {
    let users: Vec<_> = lock.users.iter().map(|user| (user.task, user.held.map(Time::as_nanos))).collect();
    json!({ "name": &*lock.name, "protocol": lock.protocol, "users": users })
}
