//! The operations that tasks execute for others: how many calls a job of the provider counts, and what it takes for them. And the
//! rounds in which these numbers, the releases by data, and the response times are found, which depend on each other.

use std::sync::Arc;

use crate::releases::arrivals;
use crate::{
    Blocking, Bound, Demand, Method, Options, Order, PortWriter, Priority, Task, Tasks, Time, Waits,
    response_times,
};

/// The maximum number of iterations, before and after the providers whose numbers of calls, and writers whose response times, still
/// grow count as unknown.
const MOST_ROUNDS: u32 = 32;

/// Returns the tasks, each with the calls that it executes, what locks do to each of them, and for each operation the number of calls
/// that each job of its provider counts; `None` where it is unknown.
///
/// The provider executes a call in its own thread, and always in the same way: at the start of its next job, or at once when it is
/// idle. Each job of the provider counts k · ⌈(Tp + Rp + Rc)/Tc⌉ calls, with k the greatest number that one job of the client
/// sends. For the n = ⌈t/Tp⌉ jobs of a window of length t, that is not less than k · ⌈(n·Tp + Rp + Rc)/Tc⌉, the calls that jobs of
/// the client send in n·Tp + Rp. This is enough: *at the next job*, the n jobs execute what was sent between the start of the job
/// before the window and that of the last one, less than n·Tp + Rp apart; *at once*, nothing waits when the window begins, so
/// they execute what is sent in t. With bursts of b jobs, the client has b times as many jobs in each Tc; if each m successive ones
/// send k calls at most, j of them send k · ⌈j/m⌉. What the client sends when it starts is added once. Where the provider is one of
/// several tasks of a thread, Rp is the greatest of theirs: all of them are delayed by what it executes.
///
/// If at most q calls are pending at any instant, since the client sends no more until one has been executed, what the provider
/// executes in t was pending when the window began, or is sent in t: q + the calls of n·Tp + Rc, whatever Rp is. (Nothing is pending
/// before the start, and q at most just after it.) The less counts.
///
/// The response times R depend on the numbers of calls and on how often data releases tasks, and these on R. Every fixed point is
/// sound: suppose that all jobs up to some instant keep to R; then the calls and the data of that time are counted, and the next job
/// keeps to R too. The least fixed point is found by iteration from R = 0. Where a response time has no bound, the demand of the
/// provider is unknown, and so is how often a writer writes.
pub(crate) fn with_rounds(
    set: &Tasks,
    options: &Options,
    interrupt: &dyn Fn(),
) -> (Vec<Task>, Vec<Blocking>, Vec<Option<u64>>) {
    let options = Options { method: options.method.min(Method::Psm), ..*options };
    // In the background, an activity may respond arbitrarily late.
    let first = |task: &Task| (task.priority != Priority::Background).then_some(Time::ZERO);
    let mut responses: Vec<Option<Time>> = set.all.iter().map(first).collect();
    let mut counts = counts(set, &responses);
    let mut released = arrivals(set, &responses);
    let (_, own_blocking) = set.clone().with_blocking();
    let mut rounds = 0;
    loop {
        // A provider whose calls are unknown may hold its locks for ever.
        let mut all = executing(set, &mut counts);
        all.iter_mut().zip(&released).for_each(|(task, by)| task.arrivals.clone_from(by));
        let tasks = Tasks { all, ..set.clone() };
        let before = responses.clone();
        let (tasks, mut blocking) = tasks.with_blocking();
        for (known, found) in responses.iter_mut().zip(response_times(&tasks, &options, interrupt).responses)
        {
            // What has no bound once stays unknown, and what is counted never falls: so the iteration ends.
            *known = match found.bound {
                Bound::Response(time) => known.map(|known| known.max(time)),
                _ => None,
            };
        }
        let mut next = self::counts(set, &responses);
        let mut by_data = arrivals(set, &responses);
        if next == counts && by_data == released {
            // The reason of a task is that of its locks, not that its calls are unknown for it.
            let own = own_blocking.into_iter().zip(&mut blocking).filter(|(own, _)| !own.is_time());
            own.for_each(|(own, found)| *found = own);
            return (tasks, blocking, counts);
        }
        rounds += 1;
        if rounds >= MOST_ROUNDS {
            let changes = next.iter_mut().zip(&counts).filter(|(next, before)| next != before);
            changes.for_each(|(next, _)| *next = None);
            for (operation, _) in set.operations.iter().zip(&next).filter(|(_, count)| count.is_none()) {
                if let Some(known) = responses.get_mut(operation.provider) {
                    *known = None;
                }
            }
            let ports = set.triggers.iter().flat_map(|it| it.ports.iter().flatten());
            for &PortWriter { task, .. } in ports.flatten() {
                if responses.get(task) != before.get(task) {
                    responses[task] = None;
                }
            }
            by_data = arrivals(set, &responses);
        }
        (counts, released) = (next, by_data);
    }
}

/// Returns the number of calls of each operation that a job of its provider counts, with these response times of the tasks.
pub(crate) fn counts(set: &Tasks, responses: &[Option<Time>]) -> Vec<Option<u64>> {
    let mut counts: Vec<Option<u64>> = Vec::with_capacity(set.operations.len());
    for operation in &set.operations {
        let response = |task: usize| responses.get(task).copied().flatten();
        let period = |task: usize| set.all.get(task)?.period.filter(|period| *period > Time::ZERO);
        let of_thread = |provider: &Task| {
            let all = set.all.iter().zip(responses).filter(|(it, _)| it.is_mate(provider));
            all.map(|(_, response)| *response).reduce(|one, other| Some(one?.max(other?)))
        };
        let count = || {
            // Calls wait for its next job: without a clock, for ever, and any number of them.
            // In a thread whose tasks have releases of their own, other jobs come before a call.
            let of = set.all.get(operation.provider)?;
            let provider = Some(of).filter(|it| it.is_periodic() && it.order == Order::List)?;
            let sends = match operation.during {
                Some(during) => operation.sends.checked_mul(counts.get(during).copied().flatten()?)?,
                None => operation.sends,
            };
            if operation.sends == 0 {
                return response(operation.provider).map(|_| operation.starting);
            }
            let least = response(operation.client)?.checked_add(period(operation.provider)?)?;
            let sent_in = |window: Time| {
                let bursts = window.as_nanos().div_ceil(period(operation.client)?.as_nanos());
                let jobs = bursts.checked_mul(set.all.get(operation.client)?.burst())?;
                sends.checked_mul(jobs.div_ceil(operation.every.max(1)))
            };
            let of_provider = of_thread(provider).unwrap_or(response(operation.provider));
            let sent =
                of_provider.and_then(|it| sent_in(least.checked_add(it)?)?.checked_add(operation.starting));
            let pending = operation.pending.and_then(|it| it.checked_add(sent_in(least)?));
            sent.into_iter().chain(pending).min()
        };
        let count = count();
        counts.push(count);
    }
    counts
}

/// Returns the tasks, each with the calls that it executes in each job; of unknown demand where their number is unknown, or
/// becomes so, because they take too long.
fn executing(set: &Tasks, counts: &mut [Option<u64>]) -> Vec<Task> {
    let mut tasks = set.all.clone();
    for (operation, count) in set.operations.iter().zip(counts) {
        let Some(task) = tasks.get_mut(operation.provider) else { continue };
        if operation.time == Time::ZERO || task.priority == Priority::Background {
            continue;
        }
        // It may execute a call at any instant, not only from a release on.
        task.has_calls = true;
        let time = count.and_then(|count| operation.time.checked_mul(count));
        let demand = time.and_then(|time| match &task.demand {
            Demand::Machine { machine, whole } => Some(Demand::Machine {
                machine: machine.with_added(time)?,
                whole: match whole {
                    Some(whole) => Some(whole.checked_add(time)?),
                    None => None,
                },
            }),
            Demand::Unknown => None,
        });
        if let (Some(time), Some(waits)) = (time, &task.waits) {
            let executed = waits.executed.with_added(time);
            task.waits = executed.map(|executed| Arc::new(Waits { executed, times: waits.times }));
        }
        if demand.is_none() {
            *count = None;
        }
        task.demand = demand.unwrap_or_default();
    }
    for index in (0..tasks.len()).filter(|&index| tasks[index].has_calls).collect::<Vec<_>>() {
        let provider = tasks[index].clone();
        let of_thread = tasks.iter_mut().enumerate().filter(|(at, it)| *at == index || it.is_mate(&provider));
        of_thread.for_each(|(_, task)| task.offset = None);
    }
    tasks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Response, TaskOperation, testing};

    fn activity(priority: u32, period: u64, offset: Option<u64>, cost: u64) -> Task {
        Task { offset: offset.map(Time::from_nanos), ..testing::simple(priority, period, cost) }
    }

    fn operation(
        provider: usize,
        client: usize,
        sends: u64,
        time: u64,
        during: Option<usize>,
    ) -> TaskOperation {
        TaskOperation {
            provider,
            client,
            sends,
            time: Time::from_nanos(time),
            during,
            ..TaskOperation::default()
        }
    }

    fn set(activities: &[Task], operations: &[TaskOperation]) -> Tasks {
        Tasks { operations: operations.to_vec(), ..Tasks::new(activities.to_vec()) }
    }

    /// The bounds, and the numbers of calls.
    fn analyse(activities: &[Task], operations: &[TaskOperation]) -> (Vec<Option<u64>>, Vec<Option<u64>>) {
        let options = Options { method: Method::Psm, is_brief: false };
        let found = set(activities, operations).response_times(&options, &|| ());
        let bound = |response: &Response| match response.bound {
            Bound::Response(time) => Some(time.as_nanos()),
            _ => None,
        };
        (found.responses.iter().map(bound).collect(), found.calls)
    }

    #[test]
    fn calls_of_a_job() {
        let activities = [activity(2, 8, None, 1), activity(1, 10, None, 1), activity(1, 0, None, 1)];
        let operations = [
            operation(0, 1, 3, 1, None),
            operation(1, 0, 2, 1, Some(0)),
            operation(0, 2, 1, 1, None),
            operation(2, 0, 1, 1, Some(2)),
        ];
        let counts = |provider: Option<u64>, client: Option<u64>| {
            let responses = [provider, client, Some(0)].map(|time| time.map(Time::from_nanos));
            counts(&set(&activities, &operations), &responses)
        };
        // 8 + 2 + 10 is two periods of the client, and 10 + 2 + 10 three of the provider.
        assert_eq!(counts(Some(2), Some(10)), [Some(3 * 2), Some(2 * 6 * 3), None, None]);
        assert_eq!(counts(Some(3), Some(10)), [Some(3 * 3), Some(2 * 9 * 3), None, None]);
        assert_eq!(counts(Some(2), None), [None; 4]);
        assert_eq!(counts(Some(u64::MAX), Some(1)), [None; 4]);
    }

    #[test]
    fn calls_and_response_times_depend_on_each_other() {
        // With one call, the responses are 3 and 9; with two, 5 and 16: 10 + 5 + 16 is less than two periods of the client.
        let activities = [activity(2, 10, None, 1), activity(1, 20, None, 6)];
        let operations = [operation(0, 1, 1, 2, None)];
        assert_eq!(analyse(&activities, &operations), (vec![Some(5), Some(16)], vec![Some(2)]));
        // The calls take longer than the periods: the provider counts as unknown.
        let operations = [operation(0, 1, 1, 9, None)];
        assert_eq!(analyse(&activities, &operations), (vec![None, None], vec![None]));
    }

    /// A client that data releases calls no more often than a periodic one; its bursts do. A provider may not be released again.
    #[test]
    fn calls_of_tasks_that_data_releases() {
        let sporadic = |of: Task, burst| Task { is_sporadic: true, burst, ..of };
        let operations = [operation(0, 1, 1, 2, None)];
        let [provider, client] = [activity(2, 10, None, 1), activity(1, 100, None, 1)];
        let found = |provider: Task, client: Task| analyse(&[provider, client], &operations).1[0];
        assert_eq!(found(provider.clone(), client.clone()), Some(1));
        assert_eq!(found(provider.clone(), sporadic(client.clone(), 1)), Some(1));
        assert_eq!(found(provider.clone(), sporadic(client.clone(), 2)), Some(2));
        assert_eq!(found(sporadic(provider, 1), client), None);
    }

    /// Also where the provider is not analysed: its calls are unknown then.
    #[test]
    fn calls_of_a_start() {
        let starting = [TaskOperation { starting: 2, ..operation(0, 1, 0, 3, None) }];
        let [provider, client] = [activity(2, 20, None, 1), activity(1, 100, None, 1)];
        let found = |provider: Task| analyse(&[provider, client.clone()], &starting);
        assert_eq!(found(provider.clone()), (vec![Some(7), Some(8)], vec![Some(2)]));
        let unknown = Task { demand: Demand::Unknown, ..provider };
        assert_eq!(found(unknown), (vec![None, None], vec![None]));
    }

    #[test]
    fn a_provider_of_calls_that_take_time_has_any_phase() {
        let activities = [activity(2, 20, Some(0), 4), activity(1, 20, Some(10), 4)];
        let found = analyse(&activities, &[operation(0, 1, 1, 0, None)]);
        assert_eq!(found, (vec![Some(4), Some(4)], vec![Some(2)]));
        let found = analyse(&activities, &[operation(0, 1, 1, 1, None)]);
        assert_eq!(found, (vec![Some(6), Some(10)], vec![Some(2)]));
    }
}
