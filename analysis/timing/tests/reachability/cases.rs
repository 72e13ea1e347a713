//! Small systems whose greatest response times are known by hand.

use mauve_timing::{Method, Protocol};

use super::explore::{Outcome, explore, greatest_responses, schedule_above};
use super::system::{Calls, Served, System, Task, simple, task};

/// The exploration finds these greatest response times, and notices each limit that is 1 ns lower.
fn check(system: &System, greatest: &[u64]) {
    assert_eq!(greatest_responses(system), greatest);
    for lower in 0..greatest.len() {
        let mut limits: Vec<_> = greatest.iter().copied().map(Some).collect();
        assert_eq!(explore(system, &limits), Outcome::Greatest(limits.clone()));
        limits[lower] = Some(greatest[lower] - 1);
        assert_eq!(explore(system, &limits), Outcome::Above { task: lower });
    }
}

#[test]
fn paths_that_do_not_start_together_with_the_greatest_edge() {
    let system = System::new(vec![
        task(2, 4, &[(0, 0, 1), (1, 1, 2), (2, 2, 1), (0, 1, 0), (1, 2, 3), (2, 0, 1)]),
        simple(1, 8, 2),
    ]);
    assert_eq!(system.bounds(Method::Psm), [Some(3), Some(7)]);
    assert_eq!(system.bounds(Method::Exact), [Some(3), Some(6)]);
    check(&system, &[3, 6]);
    check(&system.early(), &[3, 6]);
}

#[test]
fn an_edge_that_is_longer_than_the_period() {
    let system = System::new(vec![
        task(2, 3, &[(0, 1, 2), (1, 1, 1), (1, 2, 1), (2, 0, 4), (2, 2, 2)]),
        simple(1, 5, 1),
    ]);
    assert_eq!(system.bounds(Method::Psm), [Some(4), Some(10)]);
    assert_eq!(system.bounds(Method::Ibf), [Some(4), Some(9)]);
    assert_eq!(system.bounds(Method::Exact), [Some(4), Some(8)]);
    check(&system, &[4, 8]);
    check(&system.early(), &[4, 8]);
}

#[test]
fn full_load_without_an_end_of_the_window() {
    let system = System::new(vec![task(1, 3, &[(0, 0, 3), (0, 1, 4), (1, 0, 2), (1, 1, 1)])]);
    assert_eq!(system.bounds(Method::Psm), [Some(4)]);
    check(&system, &[4]);
    check(&system.early(), &[4]);
}

#[test]
fn tasks_of_equal_priority() {
    check(&System::new(vec![task(1, 5, &[(0, 1, 1), (1, 0, 2)]), simple(1, 9, 3)]), &[5, 5]);
}

#[test]
fn a_release_that_is_late() {
    check(&System::new(vec![simple(1, 10, 1).jitter(2)]), &[3]);
    // The late job and the next one: 2 from 0 to 2, and from 7 to 9.
    check(&System::new(vec![simple(2, 10, 2).jitter(3), simple(1, 20, 5)]), &[5, 7]);
    check(&System::new(vec![simple(2, 10, 2).jitter(3), simple(1, 20, 6)]), &[5, 10]);
}

#[test]
fn a_release_that_is_later_than_the_next_nominal_one() {
    check(&System::new(vec![simple(1, 3, 1).jitter(7)]), &[8]);
    // The jobs of 0, 3 and 6 are released at 7; the first ends at 9, the next ones earlier after their nominal releases.
    check(&System::new(vec![simple(1, 3, 2).jitter(7)]), &[9]);
    // Two jobs are released together, and one three later.
    check(&System::new(vec![simple(2, 4, 1).jitter(5), simple(1, 20, 2)]), &[6, 5]);
}

#[test]
fn releases_that_never_meet() {
    let tasks = |first: u64, second: u64| {
        System::new(vec![simple(2, 10, 4).offset(first), simple(1, 10, 5).offset(second)])
    };
    check(&tasks(0, 4), &[4, 5]);
    check(&tasks(0, 3), &[4, 6]);
    check(&tasks(3, 1), &[4, 9]);
    // The second may begin at 3, 1 before the first.
    let late =
        |jitter| System::new(vec![simple(2, 10, 4).offset(4), simple(1, 10, 4).offset(0).jitter(jitter)]);
    check(&late(0), &[4, 4]);
    check(&late(3), &[4, 11]);
    // The third task, of any phase, delays either: the second has then not ended before the next release of the first.
    let mut three = tasks(0, 5);
    three.tasks.push(simple(3, 20, 1));
    check(&three, &[5, 10, 1]);
}

/// The second never meets the first, and both meet the third, whose clock has any phase.
#[test]
fn releases_of_two_clocks() {
    let tasks = |clock| {
        vec![simple(3, 10, 3).offset(0), simple(2, 10, 3).offset(5), simple(1, 20, 2).offset(0).clock(clock)]
    };
    check(&System::new(tasks(0)), &[3, 3, 5]);
    check(&System::new(tasks(1)), &[3, 3, 5]);
    let late = |clock| {
        let mut tasks = tasks(clock);
        (tasks[2].offset, tasks[1].offset) = (Some(3), Some(3));
        System::new(tasks)
    };
    check(&late(0), &[3, 3, 5]);
    check(&late(1), &[3, 3, 8]);
}

#[test]
fn a_task_on_two_cpus() {
    let others = [simple(3, 5, 2).cpus(0b01), simple(2, 6, 3).cpus(0b10)];
    let on_both = |cost| {
        let mut tasks = others.to_vec();
        tasks.push(simple(1, 10, cost).cpus(0b11));
        System::new(tasks)
    };
    check(&on_both(1), &[2, 3, 3]);
    // It waits from 0 to 2 and from 5 to 7, where both others execute.
    check(&on_both(4), &[2, 3, 8]);
}

#[test]
fn three_tasks_of_equal_priority_on_two_cpus() {
    check(&System::new(vec![simple(1, 10, 2).cpus(0b11); 3]), &[4, 4, 4]);
    check(&System::new(vec![simple(1, 10, 2).cpus(0b11); 2]), &[2, 2]);
}

#[test]
fn different_masks_that_share_a_cpu() {
    let tasks = vec![simple(3, 10, 2).cpus(0b011), simple(2, 10, 2).cpus(0b110)];
    // Three CPUs: the second task may wait, although a CPU is idle.
    check(&System::new(tasks.clone()), &[2, 4]);
    // Equal masks: it may not.
    let [first, second] = &tasks[..] else { unreachable!() };
    check(&System::new(vec![first.clone(), second.clone().cpus(0b011)]), &[2, 2]);
    // Two CPUs: it waits only where the first task is on its only CPU.
    check(&System::new(vec![first.clone(), second.clone().cpus(0b010)]), &[2, 4]);
    check(&System::new(vec![first.clone().cpus(0b001), second.clone().cpus(0b011)]), &[2, 2]);
    // A task of lower priority makes the masks of the others different as well.
    let lower =
        vec![simple(3, 10, 2).cpus(0b011), simple(2, 10, 2).cpus(0b011), simple(1, 10, 2).cpus(0b110)];
    check(&System::new(lower), &[2, 4, 6]);
}

#[test]
fn a_task_without_a_limit_delays_others() {
    // It is overloaded on CPU 0, and the other task waits for it for ever, or never.
    let system = |cpus| System::new(vec![simple(2, 2, 3), simple(1, 10, 1).cpus(cpus)]);
    assert_eq!(explore(&system(0b01), &[None, Some(100)]), Outcome::Above { task: 1 });
    assert_eq!(explore(&system(0b11), &[None, Some(100)]), Outcome::Greatest(vec![None, Some(1)]));
    assert_eq!(explore(&system(0b10), &[None, Some(100)]), Outcome::Greatest(vec![None, Some(1)]));
}

#[test]
fn a_task_of_unknown_demand_has_no_bound() {
    let system = System::new(vec![simple(1, 10, 1).unknown(), simple(2, 10, 1)]);
    assert_eq!(system.bounds(Method::Exact), [None, Some(1)]);
    check(&system, &[2, 1]);
}

fn served(provider: usize, client: usize, time: u64) -> Served {
    Served { provider, client, sends: 1, time, wait: 0 }
}

#[test]
fn a_call_delays_the_job_of_the_provider() {
    // Client from 0 to 2, call from 2 to 4, own edge until 5.
    let tasks = vec![simple(1, 4, 1), simple(2, 8, 2)];
    for calls in [Calls::AtNextPeriod, Calls::BetweenPeriods] {
        check(&System::new(tasks.clone()).serving(calls, &[served(0, 1, 2)]), &[5, 2]);
    }
    check(&System::new(tasks), &[3, 2]);
}

#[test]
fn calls_that_wait_for_the_next_period() {
    let tasks = vec![simple(2, 20, 1), simple(3, 5, 1), simple(1, 20, 3)];
    // Of the client's jobs at 5, 10, 15 and 20, each sends a call. The provider begins at 21, and executes for 5; the
    // next job of the client preempts it. The third task executes from 27 to 30.
    let system = System::new(tasks.clone()).serving(Calls::AtNextPeriod, &[served(0, 1, 1)]);
    check(&system, &[7, 1, 10]);
    // Each call is executed soon. The third task executes from 3 to 5, and after the next job and call from 7 to 8.
    let system = System::new(tasks).serving(Calls::BetweenPeriods, &[served(0, 1, 1)]);
    check(&system, &[3, 1, 8]);
}

#[test]
fn a_call_between_periods_is_not_preempted_by_the_next_job() {
    // The client, on another CPU, sends a call, and the release follows immediately: the call, then the jobs.
    let tasks = vec![simple(1, 10, 1), simple(1, 10, 1).cpus(0b10), simple(0, 10, 1)];
    let operations = [served(0, 1, 3)];
    check(&System::new(tasks.clone()).serving(Calls::BetweenPeriods, &operations), &[4, 1, 5]);
    // Here two calls may wait: one is sent at the end of a job of the client, just after the provider has begun, and
    // the other at the start of the next job, just before the provider begins.
    check(&System::new(tasks).serving(Calls::AtNextPeriod, &operations), &[7, 1, 8]);
}

#[test]
fn a_schedule_above_a_limit_is_shown() {
    let system = System::new(vec![simple(2, 4, 1), simple(1, 6, 2)]);
    let schedule = schedule_above(&system, &[Some(1), Some(2)]);
    let lines: Vec<&str> = schedule.lines().collect();
    assert_eq!(
        lines,
        [
            "Above { task: 1 } in the nanosecond after the last of these states:",
            "   0 | release in 0, 0 jobs | release in 0, 0 jobs",
            "   1 | release in 3, 0 jobs | release in 5, 1 jobs",
        ]
    );
}

#[test]
fn tasks_of_one_thread_take_turns() {
    let thread = |tasks: [Task; 2]| tasks.map(|task| task.thread(1)).to_vec();
    let system = System::new(thread([simple(1, 10, 2), simple(1, 10, 3)]));
    check(&system, &[2, 5]);
    assert_eq!(system.bounds(Method::Exact), [Some(2), Some(5)]);
    // The second job of the thread is not over before the next release, at 6: the first one then ends at 9.
    let mut late = thread([simple(1, 6, 2), simple(1, 6, 1)]);
    late.push(simple(2, 12, 4));
    let system = System::new(late);
    check(&system, &[6, 7, 4]);
    assert_eq!(system.bounds(Method::Exact), [Some(6), Some(7), Some(4)]);
}

#[test]
fn a_burst_of_releases() {
    let system = System::new(vec![simple(2, 10, 2).burst(3), simple(1, 20, 3)]);
    check(&system, &[6, 9]);
    assert_eq!(system.bounds(Method::Exact), [Some(6), Some(9)]);
    // The second job ends at 11, after the next two are released at 10. The last of these ends at 22.
    let system = System::new(vec![simple(2, 15, 3), simple(1, 10, 4).burst(2)]);
    check(&system, &[3, 12]);
    assert_eq!(system.bounds(Method::Exact), [Some(3), Some(12)]);
}

#[test]
fn a_job_that_waits() {
    check(&System::new(vec![simple(1, 10, 2).waits(&[3], Some(1))]), &[5]);
    // The first task executes late, after a wait, and again soon after that: the second one responds in 7. With a period between
    // the two, it would respond in 5.
    let system = System::new(vec![simple(2, 6, 2).waits(&[2], Some(1)), simple(1, 20, 3)]);
    check(&system, &[4, 7]);
    assert_eq!(system.bounds(Method::Psm), [Some(4), Some(7)]);
}

#[test]
fn a_lower_priority_that_holds_a_lock() {
    let tasks = || vec![simple(3, 10, 1), simple(2, 20, 4), simple(1, 20, 3)];
    let users = [(0, 1), (2, 3)];
    check(&System::new(tasks()).sharing(Protocol::Inheritance, &users), &[4, 8, 8]);
    check(&System::new(tasks()).sharing(Protocol::Ceiling, &users), &[4, 8, 8]);
    let system = System::new(tasks()).sharing(Protocol::None, &users);
    assert_eq!(greatest_responses(&system), [8, 5, 8]);
    assert_eq!(system.bounds(Method::Exact), [None, None, None]);
}

/// While the second task holds a lock without a protocol, the third one has its priority because of another lock.
#[test]
fn a_ceiling_that_is_the_priority_of_a_holder() {
    let tasks = vec![simple(2, 8, 2), simple(1, 8, 1), simple(0, 16, 1)];
    let system = System::new(tasks)
        .sharing(Protocol::None, &[(0, 2), (1, 1)])
        .sharing(Protocol::Ceiling, &[(1, 1), (2, 1)]);
    assert_eq!(system.bounds(Method::Exact), [Some(4), Some(4), Some(4)]);
    check(&system, &[4, 4, 4]);
}

/// While the first task holds a lock, it may have the priority of the last one, on another CPU.
#[test]
fn a_lock_on_several_cpus_raises_its_users() {
    let cpu_1 = |task: Task| task.cpus(0b10);
    // The second task is between, and has no bound. The first one has none for another reason as well.
    let tasks =
        vec![simple(2, 20, 5), simple(3, 20, 1), simple(2, 20, 1), simple(1, 20, 1), cpu_1(simple(4, 20, 1))];
    let system = System::new(tasks)
        .sharing(Protocol::None, &[(0, 1), (3, 1)])
        .sharing(Protocol::Inheritance, &[(0, 5), (4, 1)]);
    assert_eq!(system.bounds(Method::Exact), [None; 5]);
    // The second task waits for the third one, and the first one is between if it is raised.
    let tasks = vec![simple(1, 6, 2), simple(4, 6, 1), simple(2, 6, 1), cpu_1(simple(3, 6, 1))];
    let system = System::new(tasks)
        .sharing(Protocol::None, &[(1, 1), (2, 1)])
        .sharing(Protocol::Inheritance, &[(0, 2), (3, 1)]);
    assert_eq!(system.bounds(Method::Exact), [None; 4]);
    assert_eq!(explore(&system, &[None, Some(3), None, None]), Outcome::Above { task: 1 });
    // The second task waits for the first one, and the third one is between unless the first one is raised.
    let tasks = vec![simple(1, 6, 2), simple(4, 6, 1), simple(2, 6, 1), cpu_1(simple(3, 6, 1))];
    let system = System::new(tasks)
        .sharing(Protocol::None, &[(0, 1), (1, 1)])
        .sharing(Protocol::Inheritance, &[(0, 1), (3, 1)]);
    assert_eq!(system.bounds(Method::Exact), [None; 4]);
    assert_eq!(explore(&system, &[None, Some(2), None, None]), Outcome::Above { task: 1 });
}

#[test]
fn a_task_in_the_background_that_holds_a_lock() {
    let tasks = vec![simple(2, 10, 1), simple(0, 10, 3).background(), simple(0, 10, 2).background()];
    let system = System::new(tasks);
    let users = [(0, 1), (1, 3), (2, 2)];
    for protocol in [Protocol::Inheritance, Protocol::Ceiling] {
        let system = system.clone().sharing(protocol, &users);
        assert_eq!(system.bounds(Method::Exact), [Some(4), None, None]);
        assert_eq!(greatest_responses(&system)[0], 4);
    }
    // Without a protocol, the third task delays the second one, which holds the lock.
    let system = system.sharing(Protocol::None, &users);
    assert_eq!(system.bounds(Method::Exact), [None; 3]);
    assert_eq!(greatest_responses(&system)[0], 6);
}

/// Before the first job and while it is throttled, the task in the background takes the lock.
#[test]
fn the_background_takes_a_lock_while_tasks_are_throttled() {
    let tasks = vec![simple(2, 20, 3), simple(0, 2, 2).background(), simple(9, 20, 3).throttling()];
    for protocol in [Protocol::Inheritance, Protocol::Ceiling] {
        let system = System::new(tasks.clone()).sharing(protocol, &[(0, 1), (1, 2)]);
        // 3 of its own, 3 throttled, and the lock twice.
        let bounds = vec![Some(10), None, Some(3)];
        assert_eq!(system.bounds(Method::Exact), bounds);
        assert_eq!(explore(&system, &bounds), Outcome::Greatest(bounds), "{protocol:?}");
    }
}

/// From the first lock to the second: each is held for at most 4 until the job has left both, and 6 together.
#[test]
fn ceilings_from_hand_to_hand() {
    let nested = Task { nests: true, ..simple(1, 20, 6) };
    let users = [(0, 1), (1, 4)];
    let of = |task: Task| {
        let system = System::new(vec![simple(2, 20, 2), task]);
        system.sharing(Protocol::Ceiling, &users).sharing(Protocol::Ceiling, &users)
    };
    assert_eq!(of(nested.clone()).bounds(Method::Exact), [Some(6), Some(8)]);
    check(&of(nested), &[6, 8]);
    check(&of(simple(1, 20, 6)), &[6, 8]);
}
