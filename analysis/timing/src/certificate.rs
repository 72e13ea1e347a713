//! Certificates: why deadlines are met, so that a checker that does not trust this analysis can follow.
//!
//! A certificate has the task set, and a claim for each response time: the rule, the method, and for each job of its busy windows a time at
//! which it has ended for sure. The claims are those of [`Method::Ibf`], as a checker cannot follow a search over combinations of
//! paths. A response time that is more by that method may still be within its deadline.

use serde_json::{Map, Value, json};

use crate::cycle_mean::Adjacency;
use crate::lane::{Counts, Lane, least_common_multiple};
use crate::response_time::Lanes;
use crate::trace_bound::Recurrence;
use crate::{
    Bound, CpuRule, CpuSet, Method, Options, Priority, Protocol, Response, SetAnalysis, StateMachine, Status,
    Task, TaskKind, Tasks, Time,
};

/// The most jobs in the windows of a claim.
const MOST_JOBS: usize = 1 << 14;
/// The steps of each fixed point.
const BUDGET: u64 = 1 << 23;
/// The steps until the closed form of a demand must be found.
const MOST_STEPS: u64 = 1 << 14;

/// Busy windows, and what executes in the one of the greatest response: tasks, jobs and time.
type Windows = (Vec<Value>, Vec<(usize, u64, u64)>);

/// (m, c, K): from m jobs on, c jobs more demand K more, by state.
type Growth = (u64, u64, Vec<u64>);

impl Tasks {
    /// Returns the certificate of the deadlines of the activities that are met: the objects `tasks`, `locks`, `operations`, `claims` and
    /// `not_certified`. To cancel, `interrupt` unwinds.
    pub fn certificate(&self, is_met: &dyn Fn(usize) -> bool, interrupt: &dyn Fn()) -> Map<String, Value> {
        let options = Options { method: Method::Ibf, horizon: None, is_brief: false };
        let found = self.response_times(&options, interrupt);
        let growth = |task: &Task| growth(task.demand.machine()?, interrupt);
        let growths: Vec<Option<Growth>> = found.tasks.all.iter().map(growth).collect();
        let lanes = Lanes::new(&found.tasks.all, &options, interrupt);
        let mut writer = Writer { found: &found, growths: &growths, lanes };
        let (mut claims, mut left_out) = (Vec::new(), Vec::new());
        for task in 0..self.all.len() {
            let claim =
                if self.kind(task) == TaskKind::Throttling { None } else { writer.claim(task, is_met(task)) };
            let is_proved = claim.as_ref().is_some_and(|claim| claim["met"] == true);
            if self.kind(task) == TaskKind::Activity && is_met(task) && !is_proved {
                let reason = match claim {
                    Some(_) => "combinations-of-paths",
                    None => "too-many-jobs",
                };
                left_out.push(json!({ "task": task, "reason": reason }));
            }
            claims.extend(claim);
        }
        let executed = |task: &Task| growth_of_executed(task, interrupt);
        let tasks = (0..self.all.len()).map(|it| {
            let growths = (&growths[it], executed(&found.tasks.all[it]));
            task_value(self, it, growths)
        });
        let mut parts = Map::new();
        parts.insert("tasks".to_owned(), tasks.collect());
        parts.insert("locks".to_owned(), self.locks.iter().map(lock_value).collect());
        parts.insert("operations".to_owned(), operation_values(self, &found));
        parts.insert("claims".to_owned(), claims.into());
        parts.insert("not_certified".to_owned(), left_out.into());
        parts
    }
}

fn growth_of_executed(task: &Task, interrupt: &dyn Fn()) -> Option<Growth> {
    growth(&task.waits.as_ref()?.executed, interrupt)
}

/// Returns the closed form of the demand of a machine, by the state in which its jobs end; none if it is not found.
fn growth(machine: &StateMachine, interrupt: &dyn Fn()) -> Option<Growth> {
    if machine.states() == 1 {
        return Some((0, 1, vec![machine.greatest_cost().as_nanos()]));
    }
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

struct Writer<'a> {
    found: &'a SetAnalysis,
    growths: &'a [Option<Growth>],
    lanes: Lanes<'a>,
}

impl Writer<'_> {
    fn claim(&mut self, task: usize, is_met: bool) -> Option<Value> {
        let response = self.found.responses.get(task)?;
        let of = self.found.tasks.all.get(task)?;
        let Bound::Response(time) = response.bound else { return None };
        let window = response.window.as_ref()?;
        let late = |(task, _): &(usize, Time)| Some((*task, response_of(self.found, *task)?));
        let late: Vec<(usize, Time)> = window.late.iter().map(late).collect::<Option<_>>()?;
        let is_global = matches!(response.rule, CpuRule::Global(_));
        let late: &[(usize, Time)] = if is_global { &[] } else { &late };
        let method = if !late.is_empty() { Method::Psm } else { response.method.min(Method::Ibf) };
        let clock = window.start.map(|_| window.clock);
        let (windows, interference) = match is_global {
            true => (vec![json!({ "start": null, "ends": [window.length.as_nanos()] })], Vec::new()),
            false => self.windows(task, response, (method, late, clock))?,
        };
        let rule = match response.rule {
            CpuRule::Cpu(cpu) => json!({ "cpu": cpu }),
            CpuRule::Linked(cpus) => json!({ "linked": cpu_values(cpus) }),
            CpuRule::Global(cpus) => json!({ "global": cpu_values(cpus) }),
        };
        Some(json!({
            "task": task,
            "response": time.as_nanos(),
            "met": is_met && response.status(of.deadline) == Status::Met,
            "rule": rule,
            "method": if method == Method::Psm { "psm" } else { "ibf" },
            "blocking": of.blocking.as_nanos(),
            "late": late.iter().map(|it| it.0).collect::<Vec<_>>(),
            "clock": clock,
            "windows": windows,
            "interference": interference,
        }))
    }

    /// Returns the busy windows, and what executes in that of the greatest response.
    fn windows(
        &mut self,
        task: usize,
        response: &Response,
        (method, late, clock): (Method, &[(usize, Time)], Option<u32>),
    ) -> Option<Windows> {
        let (plan, place) = self.lanes.find(task, response.rule)?;
        let growths = self.growths;
        let mut lane = self.lanes.lane(plan);
        for at in 0..lane.members.len() {
            let member = lane.members.at(at);
            member.late = late.iter().find(|it| it.0 == member.index).map(|it| it.1.as_nanos());
        }
        let starts = match clock {
            Some(clock) => lane.known_starts(place, clock)?.into_iter().map(Some).collect(),
            None => vec![None],
        };
        let (mut windows, mut worst, mut jobs) = (Some(Vec::new()), None, 0);
        for start in &starts {
            lane.begin_at(start.zip(clock), starts.len());
            let Some((window, greatest)) = window(&mut lane, place, method, growths) else {
                windows = None;
                break;
            };
            jobs += window["ends"].as_array().map_or(0, Vec::len);
            let is_worse = worst.as_ref().is_none_or(|(most, _)| greatest.0 > *most);
            if is_worse {
                worst = Some((greatest.0, interference(&mut lane, place, greatest.1, method)));
            }
            windows = windows.filter(|_| jobs <= MOST_JOBS);
            let Some(all) = &mut windows else { break };
            let mut window = window;
            window["start"] = json!(start);
            all.push(window);
        }
        lane.begin_at(None, 1);
        (0..lane.members.len()).for_each(|at| lane.members.at(at).late = None);
        Some((windows?, worst?.1))
    }
}

/// Returns a window, and the greatest response in it with its end.
fn window(
    lane: &mut Lane<'_, '_>,
    place: usize,
    method: Method,
    growths: &[Option<Growth>],
) -> Option<(Value, (u64, u64))> {
    let others = lane.interfering(place);
    let mut counts = Counts::new(lane.members.len());
    others.iter().for_each(|other| counts.include(*other, &mut lane.members, method));
    let has_mates = !lane.mates(place, 1).is_empty();
    let has_late = !lane.late_members(place).is_empty();
    let lap = if method == Method::Psm && !has_late { lap(lane, place, growths) } else { None };
    let (mut ends, mut greatest, mut regular) = (Vec::new(), None, None);
    loop {
        let job = ends.len() as u64 + 1;
        if ends.len() >= MOST_JOBS {
            return None;
        }
        let own = lane.demand(place, job, false).ok()?;
        let end = lane.window(place, job, own, &mut counts, method, &mut BUDGET.clone()).ok()?;
        ends.push(end);
        let member = lane.members.get(place);
        let (jitter, period, burst) = (member.jitter, member.period, member.task.burst());
        let (release, next) = (member.release(job).ok()?, member.release(job + 1).ok()?);
        let response = end.checked_add(jitter)?.saturating_sub(release);
        if greatest.is_none_or(|(most, _)| response > most) {
            greatest = Some((response, end));
        }
        let mut closes = None;
        if has_mates {
            let whole = lane.demand(place, job, true).ok()?;
            closes = Some(lane.window(place, job, whole, &mut counts, method, &mut BUDGET.clone()).ok()?);
        }
        if closes.unwrap_or(end).checked_add(jitter)? <= next {
            return Some((json!({ "ends": ends, "closes": closes }), greatest?));
        }
        let Some(lap) = lap else { continue };
        if regular.is_none() && is_regular(lane, place, (job, end), growths) {
            regular = Some(job);
        }
        if let Some(from) = regular.filter(|from| job >= from - 1 + lap / period * burst) {
            return Some((json!({ "ends": ends, "repeats": [from, lap] }), greatest?));
        }
    }
}

/// Returns the time after which all demands repeat together, if they take all of it.
fn lap(lane: &Lane<'_, '_>, place: usize, growths: &[Option<Growth>]) -> Option<u64> {
    let growth = |of: usize| {
        let member = lane.members.get(of);
        let (_, length, gains) = growths.get(member.index)?.as_ref()?;
        let time = length.checked_mul(member.period)?;
        Some((time, u128::from(gains.iter().copied().max()?) * u128::from(member.task.burst())))
    };
    let own = lane.priority(place);
    let all = || (0..lane.members.len()).filter(|it| lane.priority(*it) >= own).map(growth);
    let lap = all().try_fold(1, |lap, it| least_common_multiple(lap, it?.0))?;
    let demand =
        all().try_fold(0u128, |sum, it| sum.checked_add(u128::from(lap / it?.0).checked_mul(it?.1)?))?;
    (demand == u128::from(lap)).then_some(lap)
}

/// Whether the closed forms of all demands hold from this job on.
fn is_regular(lane: &Lane<'_, '_>, place: usize, (job, end): (u64, u64), growths: &[Option<Growth>]) -> bool {
    let holds = |of: usize, jobs: u64| {
        growths.get(lane.members.get(of).index).and_then(Option::as_ref).is_some_and(|it| jobs >= it.0)
    };
    let thread = lane.mates(place, job).into_iter().map(|it| it.0).chain([place]);
    let others = lane.interfering(place).into_iter();
    let mut others = others.map(|it| (it, lane.members.get(it).jobs_released(end, None).unwrap_or(0)));
    thread.map(|it| (it, job - 1)).all(|(it, jobs)| holds(it, jobs))
        && others.all(|(it, jobs)| holds(it, jobs))
}

fn interference(lane: &mut Lane<'_, '_>, place: usize, end: u64, method: Method) -> Vec<(usize, u64, u64)> {
    let mut found = Vec::new();
    for other in lane.interfering(place) {
        let member = lane.members.at(other);
        if let Ok(part) = member.contribution(end, method, None)
            && part.jobs > 0
        {
            found.push((member.index, part.jobs, part.time));
        }
    }
    found.sort_unstable();
    found
}

fn response_of(found: &SetAnalysis, task: usize) -> Option<Time> {
    if let Bound::Response(time) = found.responses.get(task)?.bound { Some(time) } else { None }
}

fn cpu_values(cpus: CpuSet) -> Vec<u32> {
    cpus.iter().collect()
}

fn task_value(tasks: &Tasks, index: usize, growths: (&Option<Growth>, Option<Growth>)) -> Value {
    let task = &tasks.all[index];
    let nanos = |time: Option<Time>| time.map(Time::as_nanos);
    let growth = |it: &Option<Growth>| {
        it.as_ref().map(|(from, period, gains)| json!({ "from": from, "period": period, "gains": gains }))
    };
    let machine = task.demand.machine().zip(task.executed()).map(|(machine, executed)| {
        let edges = machine.edges().iter().zip(executed.edges()).map(|(with, edge)| {
            let wait = with.cost.as_nanos().saturating_sub(edge.cost.as_nanos());
            (edge.source, edge.target, edge.cost.as_nanos(), wait)
        });
        json!({
            "states": machine.states(),
            "edges": edges.collect::<Vec<_>>(),
            "waits": task.waits.as_ref().and_then(|waits| waits.times),
            "growth": growth(growths.0),
            "growth_executed": growth(&growths.1),
        })
    });
    json!({
        "name": tasks.name(index),
        "kind": match tasks.kind(index) {
            TaskKind::Activity => "activity",
            TaskKind::Other => "other",
            TaskKind::Throttling => "throttling",
        },
        "priority": match task.priority {
            Priority::Background => json!("background"),
            Priority::RealTime(priority) => json!(priority),
            Priority::Unknown => json!("highest"),
        },
        "period": nanos(task.period),
        "deadline": nanos(task.deadline),
        "jitter": task.jitter.as_nanos(),
        "burst": task.burst(),
        "sporadic": task.is_sporadic,
        "thread": task.thread,
        "offset": nanos(task.offset),
        "clock": task.clock,
        "cpus": task.cpus.map(cpu_values),
        "machine": machine,
    })
}

fn lock_value(lock: &crate::Lock) -> Value {
    let protocol = match lock.protocol {
        Protocol::Inheritance => "inheritance",
        Protocol::Ceiling => "ceiling",
        Protocol::None => "none",
    };
    let users: Vec<(usize, Option<u64>)> =
        lock.users.iter().map(|user| (user.task, user.held.map(Time::as_nanos))).collect();
    json!({ "name": &*lock.name, "protocol": protocol, "users": users })
}

fn operation_values(tasks: &Tasks, found: &SetAnalysis) -> Value {
    let operations = tasks.operations.iter().enumerate().map(|(index, it)| {
        json!({
            "provider": it.provider,
            "client": it.client,
            "sends": it.sends,
            "time": it.time.as_nanos(),
            "during": it.during,
            "calls": found.calls.get(index).copied().flatten(),
        })
    });
    operations.collect()
}
