//! What a file means at a level, and what is wrong with it.

use std::cmp::Reverse;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::{
    LockEntry, LockUserEntry, MOST_OPERATIONS, MOST_TASKS, NotAnalysed, Notation, Number, Numbers,
    OperationEntry, TaskEntry, TaskSet, TaskSetError, TriggerEntry, WriterEntry,
};
use crate::level::MOST_LEVELS;
use crate::{
    CpuSet, Demand, Edge, Level, Lock, LockUser, Method, Order, PortWriter, Priority, Rounding, StateMachine,
    Task, TaskOperation, TaskTrigger, Tasks, Time, Waits,
};

type Result<T> = std::result::Result<T, TaskSetError>;

impl TaskSet {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// The text is not in this notation, a key is missing or unknown, or a value is invalid or inconsistent.
    pub fn parse(text: &str, notation: Notation) -> Result<TaskSet> {
        let set = notation.read(text)?;
        check(&set)?;
        Ok(set)
    }

    /// Returns the tasks at a level, by a method.
    ///
    /// # Errors
    ///
    /// There are no times at the level. A set that [`TaskSet::parse`] gives has no other error.
    pub fn at(&self, level: Level, method: Method) -> Result<Tasks> {
        TaskSetReader::new(self, level, method)?.set()
    }

    /// Returns what the jobs of a task execute at a level, as far as the file says, analysed or not.
    pub fn demand(&self, task: &TaskEntry, level: Level) -> (Demand, Option<Arc<Waits>>) {
        let reader = TaskSetReader::new(self, level, Method::Psm);
        reader.and_then(|reader| reader.demand(task)).unwrap_or_default()
    }

    /// Returns the codels of a task whose time is assumed, with it.
    pub fn assumed(&self, task: &TaskEntry) -> Vec<(String, Time)> {
        let time = |time| time_of(self, "assumed", time, Rounding::Up).ok();
        task.assumed.iter().filter_map(|(codel, assumed)| Some((codel.clone(), time(assumed)?))).collect()
    }
}

/// Reads the entries of a file at one level.
struct TaskSetReader<'a> {
    set: &'a TaskSet,
    level: Level,
    /// The index of the level in each list of times.
    column: usize,
    method: Method,
    /// The CPUs that there are.
    cpus: CpuSet,
}

impl<'a> TaskSetReader<'a> {
    fn new(set: &'a TaskSet, level: Level, method: Method) -> Result<TaskSetReader<'a>> {
        let column = set.levels.iter().position(|it| *it == level).or(set.levels.is_empty().then_some(0));
        let column = column.ok_or_else(|| TaskSetError::NoLevel { level, levels: set.levels.clone() })?;
        let cpus = match &set.cpus {
            Some(number) => CpuSet::first_few(cpu(number)? + 1),
            None => {
                let named =
                    set.task.iter().chain(&set.other).filter_map(|it| cpu_set(it.cpus.as_ref()?).ok());
                Some(named.collect::<CpuSet>()).filter(|it| !it.is_empty()).unwrap_or(CpuSet::of(0))
            }
        };
        Ok(TaskSetReader { set, level, column, method, cpus })
    }

    /// Reads the whole set.
    fn set(&self) -> Result<Tasks> {
        let indices: HashMap<&str, usize> =
            self.set.task.iter().map(|it| it.name.as_str()).zip(0..).collect();
        let all = |section, entries: &'a [TaskEntry], read: fn(&Self, &TaskEntry) -> Result<Task>| {
            let read = move |entry| read(self, entry).map_err(|error| error.of(section, &entry.name));
            entries.iter().map(read).collect::<Result<Vec<Task>>>()
        };
        let operation = |(number, entry): (usize, &OperationEntry)| {
            self.operation(number, entry, &indices).map_err(|error| error.of("operation", &entry.name))
        };
        let mut activities = all("task", &self.set.task, Self::task)?;
        self.order(&mut activities);
        for (entry, task) in self.set.task.iter().zip(&activities) {
            let first = task.thread.and_then(|first| activities.get(first as usize)).unwrap_or(task);
            check_mates(entry, task, first).map_err(|error| error.of("task", &entry.name))?;
        }
        let others = all("other", &self.set.other, Self::other)?;
        let mut read = Tasks::new(activities).with_platform(others, self.set.rt_throttling == Some(true));
        read.operations = self.set.operation.iter().enumerate().map(operation).collect::<Result<_>>()?;
        for (operation, entry) in read.operations.iter().zip(&self.set.operation) {
            if let Some(provider) = read.all.get_mut(operation.provider).filter(|_| entry.waits) {
                *provider = provider.clone().waiting_in_calls();
            }
        }
        let lock =
            |entry: &LockEntry| self.lock(entry, &indices).map_err(|error| error.of("lock", &entry.name));
        read.locks = self.set.lock.iter().map(lock).collect::<Result<_>>()?;
        for entry in &self.set.trigger {
            let trigger = self.trigger(entry, &indices, read.activities());
            read.triggers.push(trigger.map_err(|error| error.of("trigger", &entry.task))?);
        }
        let tasks = (0..).zip(&self.set.task);
        let refused = tasks.filter(|(_, entry)| self.has_reason(entry, self.method));
        refused.for_each(|(task, _)| read.refuse(task));
        Ok(read)
    }

    fn task(&self, entry: &TaskEntry) -> Result<Task> {
        let time = |key, number: &Option<Number>| match number {
            Some(number) => time_of(self.set, key, number, Rounding::Exact).map(Some),
            None => Ok(None),
        };
        let (period, offset) = (time("period", &entry.period)?, time("offset", &entry.offset)?);
        let mut deadline = time("deadline", &entry.deadline)?;
        for (key, time) in [("period", period), ("deadline", deadline)] {
            if time == Some(Time::ZERO) {
                return Err(TaskSetError::Zero(key));
            }
        }
        if period.is_some() && offset >= period {
            return Err(TaskSetError::LateOffset);
        }
        let burst = u64::from(count("burst", &entry.burst, 1)?);
        if entry.sporadic || burst > 1 {
            let is_list = entry.thread.is_some() && entry.order == Some(Order::List);
            let has = [("offset", entry.offset.is_some()), ("thread", is_list)];
            if let Some((key, _)) = has.into_iter().find(|(_, has)| *has) {
                return Err(TaskSetError::NotPeriodic(key));
            }
        }
        let priority = entry.priority.as_ref().map_or(Ok(Priority::Unknown), priority)?;
        let mut cpus = entry.cpus.as_ref().map(cpu_set).transpose()?;
        let (demand, waits) = self.demand(entry)?;
        let wake_up = entry.wake_up.as_ref().map(|it| self.time_at("wake_up", it)).transpose()?;
        if priority != Priority::Background
            && self.set.not_analysed.is_empty()
            && !self.has_reason(entry, Method::Psm)
        {
            let known = [
                ("period", period.is_some()),
                ("time", demand != Demand::Unknown),
                ("priority", priority != Priority::Unknown),
            ];
            if let Some((key, _)) = known.into_iter().find(|(_, is_known)| !is_known) {
                return Err(TaskSetError::Missing { key, level: self.level });
            }
            // Without it, the classic method would use the machine alone.
            if entry.classic_time.is_some()
                && matches!(demand, Demand::Machine { whole: None, .. })
                && !self.has_reason(entry, Method::Classic)
            {
                return Err(TaskSetError::Missing { key: "classic_time", level: self.level });
            }
            deadline = deadline.or(period);
            cpus = cpus.or(Some(self.cpus));
            if let Some(last) = cpus.and_then(|cpus| (cpus - self.cpus).iter().last()) {
                return Err(TaskSetError::NoCpu((last + 1).to_string()));
            }
        }
        Ok(Task {
            name: entry.name.as_str().into(),
            priority,
            period,
            deadline,
            jitter: time("jitter", &entry.jitter)?.unwrap_or_default(),
            burst,
            is_sporadic: entry.sporadic,
            thread: self.thread(entry),
            is_not_preempted: entry.preemptive == Some(false),
            wake_up: wake_up.flatten().unwrap_or_default(),
            offset,
            clock: count("clock", &entry.clock, 0)?,
            cpus,
            demand: if self.has_reason(entry, self.method) { Demand::Unknown } else { demand },
            waits,
            ..Task::default()
        })
    }

    /// Returns the number of the thread of a task: that of its first task.
    fn thread(&self, entry: &TaskEntry) -> Option<u32> {
        let thread = entry.thread.as_ref()?;
        let first = self.set.task.iter().position(|it| it.thread.as_ref() == Some(thread));
        first.and_then(|first| u32::try_from(first).ok())
    }

    /// Enters the order of each thread: where it is left out, a list if the thread can release its tasks together, otherwise any.
    fn order(&self, tasks: &mut [Task]) {
        for (index, entry) in self.set.task.iter().enumerate() {
            let Some(of) = tasks.get(index).filter(|of| of.thread.is_some()).cloned() else { continue };
            let mut mates = self.set.task.iter().zip(tasks.iter()).filter(|(_, it)| it.thread == of.thread);
            let is_list = mates.all(|(entry, it)| {
                let has_releases = (it.period, it.jitter) == (of.period, of.jitter) && it.is_periodic();
                entry.order.is_none() && (has_releases || it.period.is_none() || of.period.is_none())
            });
            let left_out = if is_list { Order::List } else { Order::Any };
            tasks[index].order = entry.order.unwrap_or(left_out);
        }
    }

    fn lock(&self, entry: &LockEntry, indices: &HashMap<&str, usize>) -> Result<Lock> {
        let user = |user: &LockUserEntry| {
            let task = indices.get(user.task.as_str()).copied();
            let task = task.ok_or_else(|| TaskSetError::NoTask(user.task.clone()))?;
            let held = user.held.as_ref().map(|held| self.time_at("held", held)).transpose()?;
            Ok(LockUser { task, held: held.flatten() })
        };
        let users: Vec<LockUser> = entry.user.iter().map(user).collect::<Result<_>>()?;
        let mut seen = HashSet::new();
        if let Some(twice) = entry.user.iter().find(|user| !seen.insert(&user.task)) {
            return Err(TaskSetError::Repeated("user", twice.task.clone()));
        }
        Ok(Lock { name: entry.name.as_str().into(), protocol: entry.protocol, users })
    }

    fn trigger(
        &self,
        entry: &TriggerEntry,
        indices: &HashMap<&str, usize>,
        activities: &[Task],
    ) -> Result<TaskTrigger> {
        let index = |name: &String| {
            indices.get(name.as_str()).copied().ok_or_else(|| TaskSetError::NoTask(name.clone()))
        };
        let writer =
            |writer: &WriterEntry| Ok(PortWriter { task: index(&writer.task)?, writes: writer.writes });
        let task = index(&entry.task)?;
        if activities.get(task).is_none_or(Task::is_periodic) {
            return Err(TaskSetError::Missing { key: "sporadic", level: self.level });
        }
        let ports = entry.ports.iter().map(|port| port.iter().map(writer).collect::<Result<_>>().map(Some));
        Ok(TaskTrigger { task, needs: entry.needs, ports: ports.collect::<Result<_>>()? })
    }

    /// Does the file say of the task why it is not analysed?
    fn has_reason(&self, entry: &TaskEntry, method: Method) -> bool {
        entry.not_analysed.iter().any(|it| it.holds(self.level, method))
    }

    fn other(&self, entry: &TaskEntry) -> Result<Task> {
        let missing = |key| TaskSetError::Missing { key, level: self.level };
        let task = self.task(entry)?;
        let priority = task.priority.real_time().ok_or_else(|| missing("priority"))?;
        let period = task.period.ok_or_else(|| missing("period"))?;
        // With a reason of its own, nothing says what it takes at most.
        let time = task.demand.own(Method::Classic).filter(|_| entry.not_analysed.is_empty());
        let time = time.ok_or_else(|| missing("time"))?;
        if entry.thread.is_some() {
            return Err(TaskSetError::NotPeriodic("thread"));
        }
        let cpus = task.cpus.or(Some(self.cpus));
        let single = Task::new(priority, period, StateMachine::single(time));
        let (burst, is_sporadic) = (task.burst, task.is_sporadic);
        Ok(Task { name: task.name, jitter: task.jitter, burst, is_sporadic, cpus, ..single })
    }

    fn operation(
        &self,
        number: usize,
        entry: &OperationEntry,
        indices: &HashMap<&str, usize>,
    ) -> Result<TaskOperation> {
        let index = |name: &String| {
            indices.get(name.as_str()).copied().ok_or_else(|| TaskSetError::NoTask(name.clone()))
        };
        let is_sender = |during: usize| {
            let sender = self.set.operation.get(during).filter(|_| during < number);
            sender.is_some_and(|sender| sender.provider == entry.client)
        };
        if let Some(during) = entry.during.filter(|during| !is_sender(*during)) {
            return Err(TaskSetError::NoOperation(during));
        }
        let missing = TaskSetError::Missing { key: "time", level: self.level };
        Ok(TaskOperation {
            provider: index(&entry.provider)?,
            client: index(&entry.client)?,
            sends: entry.sends,
            every: entry.every.unwrap_or_default(),
            starting: entry.starting.unwrap_or_default(),
            pending: entry.pending,
            time: self.time_at("time", &entry.time)?.ok_or(missing)?,
            during: entry.during,
        })
    }

    /// Returns what the jobs of a task execute at the level, as far as the file says, analysed or not.
    fn demand(&self, entry: &TaskEntry) -> Result<(Demand, Option<Arc<Waits>>)> {
        let Some(executed) = self.machine(entry)? else { return Ok(Default::default()) };
        let whole =
            entry.classic_time.as_ref().map(|times| self.time_at("classic_time", times)).transpose()?;
        let of_edges = entry.machine.iter().flatten().map(|edge| &edge.wait);
        let of_entry = entry.machine.is_none().then_some(&entry.wait);
        let wait = |wait: &Option<Numbers>| match wait {
            // Known where the execution time is, or nothing is known.
            Some(wait) => self.time_at("wait", wait),
            None => Ok(Some(Time::ZERO)),
        };
        let waits: Option<Vec<Time>> = of_edges.chain(of_entry).map(wait).collect::<Result<_>>()?;
        let Some(waits) = waits else { return Ok(Default::default()) };
        let no_count = |text: String| TaskSetError::NoCount { key: "waits", text, least: 0 };
        let times = entry.waits.as_ref().map(|it| it.whole().ok_or_else(|| no_count(it.to_string())));
        Waits::with_demand(executed, &waits, times.transpose()?, whole.flatten())
            .map_err(TaskSetError::Machine)
    }

    fn machine(&self, entry: &TaskEntry) -> Result<Option<StateMachine>> {
        let Some(edges) = &entry.machine else {
            let Some(time) = &entry.time else { return Ok(None) };
            return Ok(self.time_at("time", time)?.map(StateMachine::single));
        };
        if entry.time.is_some() || entry.wait.is_some() {
            return Err(TaskSetError::TimeAndMachine);
        }
        let numbers: HashMap<&str, u32> = entry.states().into_iter().zip(0..).collect();
        let number = |state: &String| {
            numbers.get(state.as_str()).copied().ok_or_else(|| TaskSetError::NoState(state.clone()))
        };
        entry.initial.as_ref().map(number).transpose()?;
        let edges: Result<Option<Vec<Edge>>> = edges
            .iter()
            .map(|edge| {
                let (source, target) = (number(&edge.from)?, number(&edge.to)?);
                let cost = self.time_at("time", &edge.time)?;
                Ok(cost.map(|cost| Edge { source, target, cost }))
            })
            .collect();
        let states = u32::try_from(numbers.len()).unwrap_or(u32::MAX);
        edges?.map(|edges| StateMachine::new(states, edges)).transpose().map_err(TaskSetError::Machine)
    }

    /// Returns the execution time at the level.
    fn time_at(&self, key: &'static str, times: &Numbers) -> Result<Option<Time>> {
        let number = match times {
            Numbers::One(number) => Some(number),
            Numbers::List(times) => times.get(self.column).and_then(Option::as_ref),
        };
        number.map(|number| time_of(self.set, key, number, Rounding::Up)).transpose()
    }
}

/// Checks what no level shows alone, then each level.
fn check(set: &TaskSet) -> Result<()> {
    let tasks = set.task.len().saturating_add(set.other.len());
    for (what, count, most) in [
        ("tasks", tasks, MOST_TASKS),
        ("operations", set.operation.len(), MOST_OPERATIONS),
        ("levels", set.levels.len(), MOST_LEVELS),
    ] {
        if count > most {
            return Err(TaskSetError::TooMany { what, count, most });
        }
    }
    let mut seen = HashSet::new();
    if let Some(level) = set.levels.iter().find(|level| !seen.insert(**level)) {
        return Err(TaskSetError::Repeated("level", level.to_string()));
    }
    set.not_analysed.iter().chain(&set.name).chain(&set.times).try_for_each(|it| one_line(it))?;
    for (section, entries) in [("task", &set.task), ("other", &set.other)] {
        // Two may have one name only where neither is analysed.
        let mut known: HashMap<&str, bool> = HashMap::new();
        for (number, entry) in (1..).zip(entries) {
            if entry.name.is_empty() {
                return Err(TaskSetError::NoName { section, number });
            }
            check_entry(set, entry).map_err(|error| error.of(section, &entry.name))?;
            let always = |it: &NotAnalysed| it.levels.is_none() && !it.classic_only;
            let is_excused = !set.not_analysed.is_empty() || entry.not_analysed.iter().any(always);
            if known.insert(&entry.name, is_excused).is_some_and(|other| !(other && is_excused)) {
                return Err(TaskSetError::Repeated(section, entry.name.clone()));
            }
        }
    }
    for entry in &set.lock {
        let mut held = entry.user.iter().filter_map(|user| user.held.as_ref());
        let names = entry.user.iter().map(|user| &user.task).chain([&entry.name]);
        let mut check = || {
            names.clone().try_for_each(|name| one_line(name))?;
            held.try_for_each(|held| check_list(set, "held", held))
        };
        check().map_err(|error| error.of("lock", &entry.name))?;
    }
    for entry in &set.operation {
        // One that takes no time at a level has 0 there.
        let check = || one_line(&entry.name).and_then(|()| check_count(set, "time", &entry.time));
        check().map_err(|error| error.of("operation", &entry.name))?;
    }
    let any = [set.level()];
    let levels = if set.levels.is_empty() { &any } else { set.levels.as_slice() };
    levels.iter().try_for_each(|level| TaskSetReader::new(set, *level, Method::Psm)?.set().map(drop))
}

fn check_entry(set: &TaskSet, entry: &TaskEntry) -> Result<()> {
    let edges = || entry.machine.iter().flatten();
    let of_edges = edges().flat_map(|edge| [Some(&edge.from), edge.name.as_ref()]).flatten();
    let of_entry = [&entry.name, &entry.component].into_iter().chain(entry.assumed.keys());
    let reasons = entry.not_analysed.iter().map(|it| &it.reason);
    of_entry.chain(of_edges).chain(reasons).try_for_each(|text| one_line(text))?;
    let of_reasons = entry.not_analysed.iter().flat_map(|it| &it.levels).flatten();
    if let Some(other) = of_reasons.into_iter().find(|level| !set.levels.contains(level)) {
        return Err(TaskSetError::ReasonForOtherLevel(*other));
    }
    for time in entry.assumed.values() {
        time_of(set, "assumed", time, Rounding::Up)?;
    }
    edges().try_for_each(|edge| check_list(set, "time", &edge.time))?;
    let waits = edges().map(|edge| &edge.wait).chain([&entry.wait]).flatten();
    waits.into_iter().try_for_each(|wait| check_list(set, "wait", wait))?;
    entry.wake_up.iter().try_for_each(|it| check_list(set, "wake_up", it))?;
    entry.time.iter().try_for_each(|times| check_list(set, "time", times))?;
    entry.classic_time.iter().try_for_each(|times| check_list(set, "classic_time", times))
}

/// A terminal obeys control characters.
fn one_line(text: &str) -> Result<()> {
    match text.chars().any(char::is_control) {
        true => Err(TaskSetError::ControlCharacter(text.to_owned())),
        false => Ok(()),
    }
}

/// A list has a time for each level.
fn check_count(set: &TaskSet, key: &'static str, times: &Numbers) -> Result<()> {
    match times {
        Numbers::List(times) if times.len() != set.levels.len() => {
            Err(TaskSetError::OtherCount { key, times: times.len(), levels: set.levels.len() })
        }
        _ => Ok(()),
    }
}

/// The same; what is exceeded more rarely is not shorter.
fn check_list(set: &TaskSet, key: &'static str, times: &Numbers) -> Result<()> {
    check_count(set, key, times)?;
    let Numbers::List(times) = times else { return Ok(()) };
    let mut known: Vec<(Reverse<Level>, Time)> = Vec::new();
    for (level, number) in set.levels.iter().zip(times) {
        if let Some(number) = number {
            known.push((Reverse(*level), time_of(set, key, number, Rounding::Up)?));
        }
    }
    known.sort();
    match known.is_sorted_by_key(|(_, time)| *time) {
        true => Ok(()),
        false => Err(TaskSetError::FallingTimes(key)),
    }
}

/// The tasks of a thread have what the thread has, as far as it is known: its order, priority and CPUs, and its releases where it
/// executes them as a list.
fn check_mates(entry: &TaskEntry, task: &Task, first: &Task) -> Result<()> {
    let differs = |key: Option<bool>| key == Some(true);
    let priorities = task.priority.real_time().zip(first.priority.real_time());
    let is_list = task.order == Order::List;
    let differing = [
        ("order", task.order != first.order),
        ("period", is_list && differs(task.period.zip(first.period).map(|(one, other)| one != other))),
        ("jitter", is_list && task.jitter != first.jitter),
        ("priority", differs(priorities.map(|(one, other)| one != other))),
        ("cpus", differs(task.cpus.zip(first.cpus).map(|(one, other)| one != other))),
    ];
    match (differing.into_iter().find(|(_, differs)| *differs), &entry.thread) {
        (Some((key, _)), Some(thread)) => Err(TaskSetError::OtherInThread { key, thread: thread.clone() }),
        _ => Ok(()),
    }
}

/// Returns a whole number; 0, if it is left out.
fn count(key: &'static str, number: &Option<Number>, least: u32) -> Result<u32> {
    let Some(number) = number else { return Ok(0) };
    let whole = number.whole().and_then(|whole| u32::try_from(whole).ok()).filter(|whole| *whole >= least);
    whole.ok_or_else(|| TaskSetError::NoCount { key, text: number.to_string(), least })
}

fn time_of(set: &TaskSet, key: &'static str, number: &Number, rounding: Rounding) -> Result<Time> {
    if number.is_inexact() {
        return Err(TaskSetError::ManyDigits(key));
    }
    let (text, unit) = (number.to_string(), set.unit);
    let time = Time::parse(&text, unit, rounding);
    time.map_err(|error| TaskSetError::InvalidTime { key, text, unit, error })
}

fn priority(number: &Number) -> Result<Priority> {
    match (number.to_string(), number.whole()) {
        (word, _) if word == "background" => Ok(Priority::Background),
        (_, Some(number @ 1..=99)) => Ok(Priority::RealTime(number as u32)),
        (text, _) => Err(TaskSetError::NoPriority(text)),
    }
}

/// Returns the CPUs of these numbers.
fn cpu_set(numbers: &Numbers) -> Result<CpuSet> {
    match numbers {
        Numbers::One(number) => cpu(number).map(CpuSet::of),
        Numbers::List(numbers) if numbers.is_empty() => Err(no_cpu("[]")),
        Numbers::List(numbers) => {
            let cpu = |number: &Option<Number>| number.as_ref().map_or_else(|| Err(no_cpu("null")), cpu);
            numbers.iter().map(cpu).collect()
        }
    }
}

fn no_cpu(text: &str) -> TaskSetError {
    TaskSetError::NoCpu(text.to_owned())
}

/// Returns the index of a CPU.
fn cpu(number: &Number) -> Result<u32> {
    let index = number.whole().and_then(|number| u32::try_from(number.checked_sub(1)?).ok());
    index.filter(|index| *index < CpuSet::MOST).ok_or_else(|| no_cpu(&number.to_string()))
}
