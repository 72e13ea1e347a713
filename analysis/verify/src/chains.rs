//! The latency of a chain: how long data takes through its steps.
//!
//! Each step adds the time until its next release, at most T; N − 1 further periods, if its state machine writes the data only in the
//! N-th job; and the time until the write. Before another step, that is the time from its release until the reader is released at
//! the latest without the data: R, or only J if the writer has a higher priority on the same CPU, so that the reader, released later, begins later too.
//! N is taken from the file: it belongs to the model.

use crate::certificate::{Chain, Step, System, Task};
use crate::demand::Check;
use crate::tasks::Tasks;

pub(crate) fn check_chain(tasks: &Tasks<'_>, system: &System, chain: &Chain, latency: u64) -> Check<()> {
    let mut sum = 0u128;
    for (index, step) in chain.steps.iter().enumerate() {
        let of = tasks.all.get(step.task).filter(|of| of.rank > 0 && of.period > 0);
        let of = of.ok_or("a step has no period, or is not real-time")?;
        let name = tasks.name(step.task);
        if of.task.sporadic || of.burst > 1 {
            return Err(format!("{name} is not released by a clock"));
        }
        let periods = u128::from(step.releases.max(1) - 1) * u128::from(of.period);
        if step.wait < of.period || u128::from(step.periods) < periods {
            let [wait, more] = [step.wait, step.periods];
            return Err(format!(
                "{name} may wait {} ns for its release, not {wait}, and {periods} ns for the one that writes, not {more}",
                of.period
            ));
        }
        let is_before = chain.steps.get(index + 1).is_some_and(|next| runs_before(tasks, system, step, next));
        let run = if is_before { of.task.jitter } else { tasks.response(step.task)? };
        if step.run < run {
            return Err(format!("{name} writes after {run} ns, not {}", step.run));
        }
        sum += [step.wait, step.periods, step.run].map(u128::from).iter().sum::<u128>();
    }
    match chain.limit {
        _ if chain.steps.is_empty() => Err("it has no steps".to_owned()),
        _ if sum > u128::from(latency) => Err(format!("its steps take {sum} ns together, not {latency}")),
        Some(limit) if latency > limit => {
            Err(format!("its latency {latency} ns exceeds its limit {limit} ns"))
        }
        _ => Ok(()),
    }
}

/// Whether a reader that is released after the writer begins after the write.
fn runs_before(tasks: &Tasks<'_>, system: &System, writer: &Step, reader: &Step) -> bool {
    let (Some(of), Some(next)) = (tasks.all.get(writer.task), tasks.all.get(reader.task)) else {
        return false;
    };
    // While a job of its thread waits, or a lock delays one, the reader may run before the writer.
    let is_of_thread = |index: usize, task: &Task| {
        index == writer.task || task.thread.is_some() && task.thread == of.task.thread
    };
    let is_user = |index: usize| system.locks.iter().flat_map(|it| &it.users).any(|user| user.0 == index);
    let all = tasks.all.iter().enumerate();
    let is_delayed =
        all.filter(|(index, it)| is_of_thread(*index, it.task)).any(|(index, it)| it.waits || is_user(index));
    let is_higher = of.rank > next.rank && of.rank < u64::MAX && next.rank > 0;
    is_higher && of.is_pinned() && of.cpus == next.cpus && !is_delayed
}
