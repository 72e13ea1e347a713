//! The robot of the paper (Table 2): every figure of its Tables 3 and 4, and what stands where a figure is no bound.

use mauve_timing::{
    Analysis, Bound, Breakdown, CpuSet, Demand, Edge, Method, Options, StateMachine, Status, Task, Time,
    response_times,
};

use super::published::published_response_times;

const LEVELS: [&str; 7] = ["1e-3", "1e-4", "1e-5", "1e-6", "1e-7", "1e-8", "1e-9"];

/// The tasks, in the order of Table 3: name, priority, period, CPU, execution time at each level, all in milliseconds.
const ROBOT: [(&str, u32, u64, u32, [u64; 7]); 9] = [
    ("p3dx_driver", 10, 100, 1, [8, 10, 11, 13, 17, 29, 55]),
    ("hokuyo", 9, 100, 1, [40, 43, 44, 45, 46, 46, 46]),
    ("switch", 8, 100, 1, [3, 3, 3, 5, 6, 9, 9]),
    ("pose", 7, 100, 1, [1; 7]),
    ("guidance", 6, 100, 1, [3; 7]),
    ("control", 5, 100, 1, [3; 7]),
    ("teleop", 4, 100, 1, [7; 7]),
    ("navigation", 2, 1000, 1, [297; 7]),
    ("gmapping", 3, 1000, 2, [789, 789, 791, 798, 839, 1069, 2333]),
];

/// Execution times of whole components, where they are greater than those of their greatest edge.
const WHOLE: [(&str, [u64; 7]); 2] = [("switch", [3, 4, 4, 6, 7, 10, 10]), ("navigation", [299; 7])];

const NAVIGATION: usize = 7;

/// Where `astar`, 297 of the 299 ms of navigation, is called.
#[derive(Clone, Copy)]
enum Astar {
    /// From `run` of the state Planning: it can repeat every period.
    InRun,
    /// From `entry` of the state Planning: the machine must leave the state before it can repeat.
    InEntry,
}

fn ms(milliseconds: u64) -> Time {
    Time::from_nanos(milliseconds * 1_000_000)
}

fn navigation(astar: Astar) -> StateMachine {
    let edge = |source, target, cost| Edge { source, target, cost: ms(cost) };
    let edges = match astar {
        Astar::InRun => vec![edge(0, 0, 2), edge(0, 1, 2), edge(1, 1, 297), edge(1, 0, 297)],
        Astar::InEntry => vec![edge(0, 0, 2), edge(0, 1, 297), edge(1, 1, 2), edge(1, 0, 2)],
    };
    StateMachine::new(2, edges).unwrap()
}

fn robot(level: usize, astar: Astar) -> Vec<Task> {
    let task = |&(name, priority, period, cpu, times): &(&str, u32, u64, u32, [u64; 7])| {
        let machine = match name {
            "navigation" => navigation(astar),
            _ => StateMachine::single(ms(times[level])),
        };
        let whole = WHOLE.iter().find(|(whole, _)| *whole == name).map(|(_, times)| ms(times[level]));
        Task {
            name: name.into(),
            cpus: Some(CpuSet::of(cpu)),
            demand: Demand::Machine { machine: machine.clone(), whole },
            ..Task::new(priority, ms(period), machine)
        }
    };
    ROBOT.iter().map(task).collect()
}

fn analyse(level: usize, astar: Astar, method: Method) -> (Vec<Task>, Analysis) {
    let tasks = robot(level, astar);
    let analysis = response_times(&tasks, &Options { method, is_brief: false }, &|| ());
    (tasks, analysis)
}

/// Compares `printed`, as in the paper, with the first jobs that `first_jobs` gives at each level; how many figures there are.
fn compare(printed: &str, first_jobs: impl Fn(usize) -> (Vec<Task>, Vec<Option<Time>>)) -> usize {
    let mut figures = 0;
    for line in printed.trim().lines() {
        let mut words = line.split_whitespace();
        let name = words.next().unwrap();
        for (level, printed) in words.enumerate() {
            let (tasks, found) = first_jobs(level);
            let task = tasks.iter().position(|task| *task.name == *name).unwrap();
            if printed != "-" {
                let expected = Some(ms(printed.parse().unwrap()));
                assert_eq!(found[task], expected, "{name} at {}", LEVELS[level]);
                figures += 1;
            }
        }
    }
    figures
}

/// The first jobs of the analysis.
fn first_jobs(level: usize, astar: Astar, method: Method) -> (Vec<Task>, Vec<Option<Time>>) {
    let (tasks, analysis) = analyse(level, astar, method);
    (tasks, analysis.responses.iter().map(|it| it.first_job).collect())
}

const TABLE_3: &str = "
p3dx_driver   8  10  11  13  17  29  55
hokuyo       48  53  55  58  63  75 156
switch       51  56  58  63  69  84   -
pose         52  57  59  64  70  85   -
guidance     55  60  62  67  73  88   -
control      58  63  65  70  76  91   -
teleop       65  70  72  77  83  98   -
navigation  882 997 1017 1067 1127 1277 -
gmapping    789 789 791 798 839 1069 2333
";

const TABLE_4: &str = "
p3dx_driver   8  10  11  13  17  29  55
hokuyo       48  53  55  58  63  75 156
switch       51  57  59  64  70  85   -
pose         52  58  60  65  71  86   -
guidance     55  61  63  68  74  89   -
control      58  64  66  71  77  92   -
teleop       65  71  73  78  84  99   -
navigation  884 1080 1175 1391 1895 29900 -
";

#[test]
fn table_3() {
    for astar in [Astar::InRun, Astar::InEntry] {
        let published = |level| {
            let tasks = robot(level, astar);
            let found = published_response_times(&tasks);
            (tasks, found)
        };
        assert_eq!(compare(TABLE_3, published), 57);
    }
}

#[test]
fn table_4() {
    assert_eq!(compare(TABLE_4, |level| first_jobs(level, Astar::InRun, Method::Classic)), 50);
}

/// Where interfering tasks execute after the hyperperiod, too.
#[test]
fn the_first_jobs_of_navigation_are_later_than_published() {
    let printed = "navigation 882 997 1089 1298 1791 14899 -";
    for astar in [Astar::InRun, Astar::InEntry] {
        assert_eq!(compare(printed, |level| first_jobs(level, astar, Method::Psm)), 6);
    }
}

#[test]
fn figures_that_meet_their_deadline_are_bounds() {
    for (method, table) in [(Method::Psm, TABLE_3), (Method::Classic, TABLE_4)] {
        for line in table.trim().lines() {
            let mut words = line.split_whitespace();
            let name = words.next().unwrap();
            for (level, printed) in words.enumerate() {
                let (tasks, analysis) = analyse(level, Astar::InRun, method);
                let task = tasks.iter().position(|task| *task.name == *name).unwrap();
                let Ok(printed) = printed.parse() else { continue };
                let printed = ms(printed);
                let response = &analysis.responses[task];
                if Some(printed) <= tasks[task].deadline {
                    assert_eq!(response.bound, Bound::Response(printed), "{name} at {}", LEVELS[level]);
                    assert_eq!(response.status(tasks[task].deadline), Status::Met);
                } else {
                    assert_ne!(response.status(tasks[task].deadline), Status::Met);
                }
            }
        }
    }
}

#[test]
fn navigation_with_astar_in_run() {
    let verdicts = |method| -> Vec<Status> {
        let verdict = |level| {
            let (tasks, analysis) = analyse(level, Astar::InRun, method);
            analysis.responses[NAVIGATION].status(tasks[NAVIGATION].deadline)
        };
        (0..LEVELS.len()).map(verdict).collect()
    };
    use Status::{Met, Unbounded};
    assert_eq!(verdicts(Method::Psm), [Met, Met, Unbounded, Unbounded, Unbounded, Unbounded, Unbounded]);
    assert_eq!(
        verdicts(Method::Classic),
        [Met, Unbounded, Unbounded, Unbounded, Unbounded, Unbounded, Unbounded]
    );
}

#[test]
fn navigation_with_astar_in_entry_cannot_repeat_it() {
    for (level, name) in LEVELS.into_iter().enumerate() {
        let (tasks, analysis) = analyse(level, Astar::InEntry, Method::Psm);
        let response = &analysis.responses[NAVIGATION];
        let status = response.status(tasks[NAVIGATION].deadline);
        let expected = match name {
            "1e-3" | "1e-4" => Status::Met,
            // Late, but never for long: 149.5 ms a period on average.
            "1e-5" | "1e-6" | "1e-7" => Status::Missed,
            _ => Status::Unbounded,
        };
        assert_eq!(analysis.cpus[0].utilisation.exceeds_one(), expected == Status::Unbounded);
        assert_eq!(status, expected, "{name}");
    }
}

#[test]
fn at_1e_9_hokuyo_and_all_below_are_unbounded() {
    let (tasks, analysis) = analyse(6, Astar::InRun, Method::Psm);
    for (task, response) in tasks.iter().zip(&analysis.responses) {
        let status = response.status(task.deadline);
        match &*task.name {
            "p3dx_driver" => assert_eq!(status, Status::Met),
            "gmapping" => assert_eq!(response.bound, Bound::Unbounded { cpu: 2 }),
            _ => assert_eq!(response.bound, Bound::Unbounded { cpu: 1 }),
        }
    }
    assert_eq!(analysis.responses[2].first_job, None);
}

#[test]
fn navigation_at_1e_4_is_explained() {
    let (tasks, analysis) = analyse(1, Astar::InRun, Method::Psm);
    let response = &analysis.responses[NAVIGATION];
    let options = Options { method: Method::Psm, is_brief: false };
    let mut breakdown = Breakdown::new(&tasks, &options, &|| ());
    let lines: Vec<String> = breakdown
        .of(NAVIGATION, response.rule, response.window.as_ref(), response.first_job)
        .iter()
        .map(|part| format!("{} {} jobs {}", tasks[part.task].name, part.jobs, part.time))
        .collect();
    assert_eq!(
        lines,
        [
            "p3dx_driver 10 jobs 100 ms",
            "hokuyo 10 jobs 430 ms",
            "switch 10 jobs 30 ms",
            "pose 10 jobs 10 ms",
            "guidance 10 jobs 30 ms",
            "control 10 jobs 30 ms",
            "teleop 10 jobs 70 ms",
        ]
    );
    let cpu = &analysis.cpus[0];
    assert_eq!((cpu.cpus, cpu.utilisation.exceeds_one(), cpu.complete), (CpuSet(2), false, true));
    assert!((cpu.utilisation.as_f64() - 0.997).abs() < 1e-12);
}
