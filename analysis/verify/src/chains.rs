//! The latency of a chain: how long data takes through its steps.
//!
//! Each step adds the time until its next release, at most T; N − 1 further periods, if its state machine writes the data only in the
//! N-th job; and the time until the write. Before another step, that is the time from its release until the reader is released at
//! the latest without the data: R, or only J if the writer has a higher priority on the same CPU, so that the reader, released later, begins later too.
//! N is taken from the file: it belongs to the model. It holds while the instances are in the states of `while`, and if what is named in
//! `answers` answers: both are in the file, and in the summary.

use crate::certificate::CertifiedChain;
use crate::demand::Checks;
use crate::tasks::{CheckedTask, CheckedTasks};

/// Checks that the steps take no longer than the latency together.
pub(crate) fn check_chain(tasks: &CheckedTasks<'_>, chain: &CertifiedChain) -> Checks<()> {
    let mut sum = 0u128;
    for (index, &(task, releases)) in chain.steps.iter().enumerate() {
        let of = tasks.all.get(task).filter(|of| of.rank > 0 && of.period > 0);
        let of = of.ok_or("a step has no period, or is not real-time")?;
        if of.task.sporadic || of.burst > 1 {
            return Err(format!("{} is not released by a clock", tasks.name(task)));
        }
        tasks.work.spend(of.thread.len())?;
        let reader = chain.steps.get(index + 1).and_then(|next| tasks.all.get(next.0));
        let is_before = reader.is_some_and(|reader| runs_before(tasks, of, reader));
        let write = if is_before { of.task.jitter } else { tasks.response(task)? };
        let wait = u128::from(releases.max(1)) * u128::from(of.period);
        sum = sum.saturating_add(wait).saturating_add(write.into());
    }
    let latency = chain.latency;
    match chain.limit {
        _ if chain.steps.is_empty() => Err("it has no steps".to_owned()),
        _ if sum > latency.into() => Err(format!("its steps take {sum} ns together, not {latency}")),
        Some(limit) if latency > limit => {
            Err(format!("its latency {latency} ns exceeds its limit {limit} ns"))
        }
        _ => Ok(()),
    }
}

/// Whether a reader that is released after the writer begins after the write.
fn runs_before(tasks: &CheckedTasks<'_>, writer: &CheckedTask<'_>, reader: &CheckedTask<'_>) -> bool {
    // While a job of its thread waits, or a lock delays one, the reader may run before the writer.
    let is_delayed = |it: &usize| tasks.all[*it].waits > 0 || tasks.all[*it].has_locks;
    let is_higher = writer.rank > reader.rank && writer.rank < u64::MAX;
    is_higher && writer.is_pinned() && writer.cpus == reader.cpus && !writer.thread.iter().any(is_delayed)
}
