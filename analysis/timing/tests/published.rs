//! The response times of the paper's Table 3, which are no bounds: its traces end with the hyperperiod.

use mauve_timing::{CpuSet, Priority, Task, Time, TraceBound};

/// The maximum number of iterations for one task.
const MOST_ITERATIONS: u32 = 100_000;

/// Returns the response time of each task as the paper's Table 3 gives it: **unsafe**, to compare with that table only.
///
/// It is the fixed point of equations 19 and 20 for the first job, with Mⱼ(min(⌈n/Tⱼ⌉, H/Tⱼ)) as the demand of each task of hp(i): after
/// the hyperperiod H, interfering tasks execute nothing. `None` for a background task, where a period or a demand is unknown, and
/// where a number exceeds 64 bits or the iterations their limit.
pub(crate) fn published_response_times(tasks: &[Task]) -> Vec<Option<Time>> {
    let period = |task: &Task| task.period.map(Time::as_nanos).filter(|it| *it > 0);
    let mut real_time = tasks.iter().filter(|task| task.priority != Priority::Background);
    let hyperperiod = real_time.try_fold(1, |all: u64, task| common_multiple(all, period(task)?));
    let bounds = tasks.iter().map(|task| Some((period(task)?, TraceBound::new(task.demand.machine()?))));
    let mut bounds: Vec<Option<(u64, TraceBound<'_>)>> = bounds.collect();
    let cpus = |task: &Task| task.cpus.unwrap_or(CpuSet::ALL);
    let mut first_job = |of: &Task, index: usize| {
        if of.priority == Priority::Background {
            return None;
        }
        let hyperperiod = hyperperiod?;
        let interferes = |other: &Task| other.priority >= of.priority && cpus(other).meets(cpus(of));
        let others = tasks.iter().enumerate().filter(|(other, task)| *other != index && interferes(task));
        let others: Vec<usize> = others.map(|(other, _)| other).collect();
        let own = bounds[index].as_mut()?.1.demand(1).ok()?.as_nanos();
        let mut window = own.max(1);
        for _ in 0..MOST_ITERATIONS {
            let mut demand = own;
            for &other in &others {
                let (period, bound) = bounds[other].as_mut()?;
                let jobs = window.div_ceil(*period).min(hyperperiod / *period);
                demand = demand.checked_add(bound.demand(jobs).ok()?.as_nanos())?;
            }
            if demand <= window {
                return Some(Time::from_nanos(demand));
            }
            window = demand;
        }
        None
    };
    tasks.iter().enumerate().map(|(index, task)| first_job(task, index)).collect()
}

fn common_multiple(one: u64, other: u64) -> Option<u64> {
    let (mut divisor, mut rest) = (one, other);
    while rest > 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    (one / divisor).checked_mul(other)
}
