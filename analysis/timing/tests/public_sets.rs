//! Published task sets: the response times are the published ones, or less.

use mauve_timing::{Bound, CpuSet, Method, Options, Priority, StateMachine, Task, Time, response_times};

/// Returns the response times of tasks by descending priority, each with C, T, D, J and B, on so many CPUs.
fn responses(rows: &[Vec<&str>], cpus: u32, unit: u64) -> Vec<String> {
    let task = |(place, row): (usize, &Vec<&str>)| {
        let time = |column: usize| Time::from_nanos(row[column].parse::<u64>().unwrap() * unit);
        Task {
            priority: Priority::RealTime(99 - place as u32),
            deadline: Some(time(2)),
            jitter: time(3),
            blocking: time(4),
            cpus: Some(CpuSet::first_few(cpus)),
            ..Task::new(1, time(1), StateMachine::single(time(0)))
        }
    };
    let tasks: Vec<Task> = rows.iter().enumerate().map(task).collect();
    let options = Options { method: Method::Exact, is_brief: false };
    let text = |bound: &Bound| match bound {
        Bound::Response(time) => (time.as_nanos() as f64 / unit as f64).to_string(),
        _ => "-".to_owned(),
    };
    response_times(&tasks, &options, &|| ()).responses.iter().map(|it| text(&it.bound)).collect()
}

#[test]
fn published_response_times() {
    let table = include_str!("public_sets.txt");
    let mut sets = 0;
    for set in table.split("\n\n").filter(|set| !set.starts_with('#')) {
        let (head, rows) = set.split_once('\n').unwrap();
        let [name, _source, cpus] = head.split(" | ").collect::<Vec<_>>()[..] else { panic!("{head}") };
        let rows: Vec<Vec<&str>> = rows.lines().map(|row| row.split_whitespace().collect()).collect();
        let found = responses(&rows, cpus.parse().unwrap(), 1);
        assert_eq!(found, rows.iter().map(|row| row[6]).collect::<Vec<_>>(), "{name}");
        for row in &rows {
            let [published, ours] = [5, 6].map(|column| row[column].parse::<f64>().unwrap());
            assert!(ours <= published, "{name}: {row:?}");
        }
        sets += 1;
    }
    assert_eq!(sets, 9);
}

/// The published analysis rounds to whole units. In a finer unit, it gives 15.999 instead of 15.
#[test]
fn a_finer_unit_gives_no_longer_response_times() {
    let rows = ["1 4 4 0 0", "1 5 5 0 0", "3 9 9 0 0", "9 18 18 0 0"];
    let rows: Vec<Vec<&str>> = rows.iter().map(|row| row.split(' ').collect()).collect();
    assert_eq!(responses(&rows, 2, 1_000_000), ["1", "1", "4", "14.5"]);
    assert_eq!(responses(&rows, 3, 1_000_000), ["1", "1", "3", "11"]);
}
