//! The same chains by public research code, whose figures `dortmund.csv` has: single-state tasks on one CPU, written at their end.

use mauve_timing::{Bound, ChainLatency, ChainStep, Method, Options, StateMachine, Task, Tasks, Time};

const FIGURES: &str = include_str!("dortmund.csv");

/// A line of the figures; times in µs.
struct Line {
    /// By decreasing priority: period, execution time, response time.
    tasks: Vec<[u64; 3]>,
    chain: Vec<usize>,
    davare: u64,
    duerr: u64,
    duerr_age: u64,
    kloda: u64,
    guenzel: Option<u64>,
}

fn lines() -> Vec<Line> {
    let line = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |text: &str| text.parse::<u64>().unwrap();
        let task = |text: &str| text.split(':').map(number).collect::<Vec<_>>().try_into().unwrap();
        Line {
            tasks: fields[0].split(' ').map(task).collect(),
            chain: fields[1].split(' ').map(|task| task.parse().unwrap()).collect(),
            davare: number(fields[2]),
            duerr: number(fields[3]),
            duerr_age: number(fields[4]),
            kloda: number(fields[5]),
            guenzel: fields[6].parse().ok(),
        }
    };
    FIGURES.lines().filter(|text| text.contains(':') && !text.starts_with('#')).map(line).collect()
}

impl Line {
    fn tasks(&self, offset: Option<Time>) -> Tasks {
        let task = |(place, [period, cost, _]): (usize, &[u64; 3])| {
            let machine = StateMachine::single(us(*cost));
            Task { offset, ..Task::new(99 - place as u32, us(*period), machine) }
        };
        Tasks::new(self.tasks.iter().enumerate().map(task).collect())
    }

    fn latency(&self, offset: Option<Time>, uses_priorities: bool) -> ChainLatency {
        let step = |&task: &usize| {
            let response = us(self.tasks[task][2]);
            let (periods, gap) = (Some(0), Some(1));
            ChainStep { task, releases: 1, periods, write: response, response, gap, ..ChainStep::default() }
        };
        let chain: Vec<ChainStep> = self.chain.iter().map(step).collect();
        self.tasks(offset).latency(&chain, uses_priorities).unwrap()
    }

    /// Whether each task has written before the next one may start twice.
    fn is_within_periods(&self) -> bool {
        self.chain.windows(2).all(|pair| self.tasks[pair[0]][2] <= self.tasks[pair[1]][0])
    }
}

fn us(time: u64) -> Time {
    Time::from_nanos(time * 1000)
}

#[test]
fn as_by_davare_and_duerr() {
    let (mut all, mut less) = (0, 0);
    for line in lines() {
        let found = line.latency(None, true);
        assert_eq!(line.latency(None, false).latency, us(line.davare));
        assert_eq!(found.age_at_write, Some(us(line.duerr_age)));
        if line.is_within_periods() {
            assert_eq!(found.latency, us(line.duerr));
        }
        assert!(found.latency <= us(line.duerr));
        less += u64::from(found.latency < us(line.duerr));
        all += 1;
    }
    assert_eq!((all, less), (1000, 53));
}

/// All are released together: as Kloda follows them; Günzel takes the schedule itself, in which no job responds later.
#[test]
fn as_by_kloda_and_not_below_guenzel() {
    let mut attained = 0;
    for line in lines() {
        let found = line.latency(Some(Time::ZERO), true).latency;
        assert_eq!(found, us(line.kloda));
        assert!(line.guenzel.is_none_or(|guenzel| found >= us(guenzel)));
        attained += u64::from(line.guenzel.map(us) == Some(found));
    }
    assert_eq!(attained, 203);
}

#[test]
fn the_response_times_are_the_same() {
    let options = Options { method: Method::Psm, is_brief: false };
    for line in lines().iter().filter(|line| line.guenzel.is_some()) {
        let found = line.tasks(None).response_times(&options, &|| ());
        let found: Vec<_> = found.responses.into_iter().map(|it| it.bound).collect();
        let expected: Vec<_> =
            line.tasks.iter().map(|[_, _, response]| Bound::Response(us(*response))).collect();
        assert_eq!(found, expected);
    }
}
