//! Systems whose times are known by hand.

use std::collections::VecDeque;

use mauve_timing::{ChainBuffer, ChainStep, Tasks};

use super::core::{
    Core,
    Statement::{Clear, Compute, Move, Read, ReadOrSkip, Write},
    looping, machine,
};
use super::explore::{Greatest, explore};
use super::system::{Bounds, System, task};

/// Returns the bounds of a system and its greatest times. Checks that no time is above its bound.
fn bounds_and_greatest(system: &System) -> (Bounds, Greatest) {
    let bounds = system.bounds(true).unwrap();
    let found = explore(system, 100).unwrap();
    assert!(found.reaction <= bounds.latency, "{found:?} {bounds:?}");
    assert!(bounds.age_at_write.is_none_or(|bound| found.age_at_write <= bound), "{found:?} {bounds:?}");
    assert!(!bounds.keeps || found.age <= bounds.latency, "{found:?} {bounds:?}");
    (bounds, found)
}

/// Reads at its start, and writes at its end.
fn plain(cost: u8) -> Core {
    looping(&[&[Read(0), Compute(cost), Write(0)]])
}

/// Without D periods, the age at a write would be 4.
#[test]
fn a_machine_that_writes_a_period_later() {
    let late = machine(&[(0, 1, &[Read(0), Compute(1)]), (1, 0, &[Compute(1), Write(0)])]);
    let system = System::new(vec![task(0, 1, 2, plain(1)), task(1, 1, 5, late)]);
    let (bounds, found) = bounds_and_greatest(&system);
    assert_eq!((found.reaction, found.age, found.age_at_write), (19, 19, 9));
    assert_eq!((bounds.latency, bounds.age_at_write), (19, Some(9)));
}

#[test]
fn a_constant_that_overwrites() {
    let constant = looping(&[&[Read(0), Compute(1), Write(0), Clear(0), Compute(1), Write(0)]]);
    let system = System::new(vec![task(0, 1, 5, constant), task(1, 1, 5, plain(1))]);
    assert_eq!(system.bounds(true), None);
    assert_eq!((system.facts()[0].keeps, system.facts()[0].releases), (false, Some(1)));
    // At equal periods, the second task always reads the constant.
    assert_eq!(explore(&system, 100).unwrap().reaction, 100);
}

/// Another read takes the data, before that on which the write depends.
#[test]
fn a_second_read_in_a_job() {
    let twice = looping(&[&[Read(1), Compute(2), ReadOrSkip(0), Write(0), Compute(1)]]);
    for (period, seen) in [(4, 100), (3, 14)] {
        let system = System::new(vec![task(0, 1, period, plain(1)), task(1, 1, 4, twice.clone())]);
        assert_eq!((system.facts()[1].releases, system.bounds(true)), (None, None));
        // With N = 1, the latency would be 11 or 10.
        assert_eq!(explore(&system, 100).unwrap().reaction, seen, "{period}");
    }
}

/// At one instant, the reader on another CPU may be first; on the same CPU, the writer has a higher priority.
#[test]
fn a_release_at_the_instant_of_a_write() {
    for (cpu, reaction, age_at_write) in [(0, 6, 2), (1, 10, 6)] {
        let tasks = vec![task(0, 2, 4, plain(1)).offset(0), task(cpu, 1, 4, plain(1)).offset(1)];
        let (bounds, found) = bounds_and_greatest(&System::new(tasks));
        assert_eq!((found.reaction, found.age_at_write), (reaction, age_at_write));
        assert_eq!((bounds.latency, bounds.age_at_write), (reaction, Some(age_at_write)));
    }
}

/// The last task writes what it wrote a period ago: what is shown gets older than the reaction.
#[test]
fn older_data_after_newer() {
    let older = looping(&[&[Read(0), Compute(1), Write(0), Compute(1), Write(1), Move(0, 1)]]);
    let system = System::new(vec![task(0, 1, 3, plain(1)), task(1, 1, 5, older)]);
    let (bounds, found) = bounds_and_greatest(&system);
    assert_eq!((found.reaction, found.age, found.age_at_write), (10, 15, 11));
    assert_eq!((bounds.latency, bounds.age_at_write, bounds.keeps), (11, Some(11), false));
}

/// The response time counts from the nominal release: the jitter is in it once.
#[test]
fn jitter_counts_once() {
    let system = System::new(vec![task(0, 1, 4, plain(1)).jitter(2), task(1, 1, 5, plain(1)).jitter(1)]);
    let (bounds, found) = bounds_and_greatest(&system);
    assert_eq!((bounds.latency, found.reaction), (4 + 3 + 5 + 2, 14));
    // A job that reads late because of its jitter also writes late.
    assert_eq!((bounds.age_at_write, found.age_at_write), (Some(9), 8));
}

/// The jitter of the writer counts, as the reader has a lower priority: it may start before a late release.
#[test]
fn a_writer_of_higher_priority_that_is_late() {
    let system = System::new(vec![task(0, 2, 4, plain(1)).jitter(2), task(0, 1, 5, plain(1))]);
    let (bounds, found) = bounds_and_greatest(&system);
    assert_eq!((bounds.latency, found.reaction), (4 + 2 + 5 + 2, 12));
    assert_eq!(system.bounds(false).unwrap().latency, 4 + 3 + 5 + 2);
}

/// Data releases the second task: at once where it is as fast as the first one, otherwise 5 after the last release.
#[test]
fn tasks_that_data_releases() {
    let triggered = |period, least, reader: Core| {
        let tasks = vec![task(0, 1, period, plain(1)), task(1, 1, least, reader).triggered()];
        let (bounds, found) = bounds_and_greatest(&System::new(tasks));
        let part = bounds.found.parts[1];
        (part.wait.as_nanos(), part.periods.as_nanos(), bounds.latency, found.reaction)
    };
    assert_eq!(triggered(4, 4, plain(1)), (0, 0, 4 + 1 + 1, 6));
    assert_eq!(triggered(4, 5, plain(1)), (5, 0, 4 + 1 + 5 + 1, 11));
    // What it writes a job later waits for the next datum.
    let late = machine(&[(0, 1, &[Read(0), Compute(1)]), (1, 0, &[Compute(1), Write(0)])]);
    assert_eq!(triggered(5, 3, late), (0, 10, 5 + 1 + 10 + 1, 17));
}

/// What the first job leaves in the buffer releases the next one, for no datum of its own: all others are a release late.
#[test]
fn the_first_job_leaves_what_released_it() {
    let skips = machine(&[(0, 1, &[Compute(1)]), (1, 1, &[Read(0), Compute(1), Write(0)])]);
    let tasks = vec![task(0, 1, 4, plain(1)), task(1, 1, 4, skips).buffer(2).triggered()];
    let (bounds, found) = bounds_and_greatest(&System::new(tasks));
    assert_eq!((bounds.latency, found.reaction), (4 + 1 + 4 + 4 + 1, 10));
}

/// The first task releases the second, with which the chain begins: it looks at the world in each of its releases.
#[test]
fn a_chain_that_begins_where_data_releases_a_task() {
    let tasks = vec![task(0, 1, 4, plain(1)), task(1, 1, 2, plain(1)).triggered()];
    let system = System { first: 1, ..System::new(tasks) };
    let (bounds, found) = bounds_and_greatest(&system);
    // The job of the first task takes 1 at least.
    assert_eq!((bounds.latency, found.reaction), (4 + 1 + 1, 5));
}

/// Where the reader is as fast and the buffer is never full, it costs no time, however long it is.
#[test]
fn buffers() {
    let buffered = |size, write, read| {
        let tasks = vec![task(0, 1, write, plain(1)), task(1, 1, read, plain(1)).buffer(size)];
        let (bounds, found) = bounds_and_greatest(&System::new(tasks));
        (bounds.found.parts[1].stays_full, bounds.latency, found.reaction)
    };
    assert_eq!(buffered(2, 3, 3), (false, 8, 8));
    assert_eq!(buffered(3, 3, 3), (false, 8, 8));
    // Of one value, it is a connection without a buffer.
    assert_eq!(buffered(1, 3, 3), (false, 8, 8));
    // A reader that is slower than the writer: the values in the full buffer are as far apart as the writes.
    assert_eq!(buffered(2, 2, 4), (true, 10, 10));
    assert_eq!(buffered(3, 2, 4), (true, 12, 12));
    assert_eq!(buffered(3, 2, 5), (true, 13, 13));
}

/// Each job writes the sample before, and then its own: the reader takes one in each of its jobs.
#[test]
fn a_buffer_that_takes_two_values_of_a_job() {
    let both = looping(&[&[Read(0), Compute(1), Write(1), Move(0, 1), Write(0)]]);
    let system = System::new(vec![task(0, 1, 5, both), task(1, 1, 2, plain(1)).buffer(3)]);
    let (bounds, found) = bounds_and_greatest(&system);
    assert_eq!((bounds.latency, found.reaction), (5 + 1 + 2 + 2 + 1, 11));
}

/// The first job writes a constant late: the reader takes it one period before the data, which is written early.
#[test]
fn a_buffer_that_takes_something_late_before_data() {
    let first = machine(&[(0, 1, &[Compute(3), Write(1)]), (1, 1, &[Read(0), Compute(1), Write(0)])]);
    let system = System::new(vec![task(0, 1, 4, first), task(1, 1, 4, plain(1)).buffer(3)]);
    let (bounds, found) = bounds_and_greatest(&system);
    assert!(bounds.has_earlier_write);
    assert_eq!((bounds.latency, found.reaction), (4 + 3 + 4 + 1, 12));
}

/// A camera of 16 ms, whose tracker reads every 32 ms: when its buffer of 100 is full, each second image is dropped, and the oldest of
/// those in it is 99 images old.
#[test]
fn a_camera_at_twice_the_rate_of_its_reader() {
    let ms = |time: u64| mauve_timing::Time::from_nanos(time * 1_000_000);
    let task = |priority, period, cost| {
        let machine = mauve_timing::StateMachine::single(ms(cost));
        mauve_timing::Task::new(priority, ms(period), machine)
    };
    let step = |task, response| ChainStep {
        task,
        releases: 1,
        periods: Some(0),
        write: ms(response),
        response: ms(response),
        gap: Some(1),
        writes: Some(1),
        ..ChainStep::default()
    };
    let buffer = ChainBuffer { size: 100, reads: Some(1) };
    let chain = [step(0, 1), ChainStep { buffer: Some(buffer), ..step(1, 7) }];
    let found = Tasks::new(vec![task(20, 16, 1), task(10, 32, 5)]).latency(&chain, true).unwrap();
    // The writer writes within the first ms of its period, and the reader reads 1 ms later.
    let (mut images, mut ages) = (VecDeque::new(), Vec::new());
    for time in 0..20_000 {
        if time % 16 == 0 {
            images.push_back(time);
            images.drain(..images.len().saturating_sub(100));
        }
        if time % 32 == 1 {
            ages.push(time - images.pop_front().unwrap());
        }
    }
    let (first, last) = (ages[0], *ages.last().unwrap());
    assert_eq!((first, last), (1, 99 * 16 + 1));
    // The effect of a read, 6 ms later at most, shows an image until that of the next read.
    let seen = last + 6 + 32;
    assert_eq!((seen, found.latency), (1623, ms(16 + 1584 + 32 + 7)));
    assert!(found.parts[1].stays_full && ms(seen) <= found.latency);
}
