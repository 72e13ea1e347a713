//! # chain-late
//!
//! Data takes longer from one end of a chain to the other than `latency` in `mauve.toml` allows. The message is at the connection
//! to the component that contributes most.
//!
//! ```mauve
//! codel look(out n: int): void
//! codel drive(in n: int): void
//! shell Eye { output port seen: int }
//! shell Leg { input port goal: int }
//! core EyeCore(Eye) { var n: int = 0  update = { look(n); write(seen, n); } }
//! core LegCore(Leg) { var n: int = 0  update = { read(goal, n); drive(n); } }
//! component Camera(Eye, EyeCore)
//! component Base(Leg, LegCore)
//! architecture Robot { instance camera: Camera  instance base: Base
//!   connection camera.seen -> base.goal   // error
//! }
//! deployment Bench {
//!   architecture Robot
//!   activity camera { priority = 2  period = 10 }
//!   activity base { priority = 1  period = 50 }
//! }
//! //- /mauve.toml
//! assume.codel = "1 ms"
//! [chains.follow]
//! from = "look"
//! to = "drive"
//! latency = "50 ms"
//! ```
//!
//! A component contributes the time until its release after a write, the periods until it writes, the values before it in a buffer,
//! and its response time. Shorten the greatest of these, or raise the limit. `mauve chains` shows all of them.

use super::*;
use super::figure::{TIGHT_SLACK, chain_figure};
use mauve_wcrt::chains::{ChainReport, ChainStepReport};

pub(super) fn report<'db>(
    at: Location<'db>,
    chain: &ChainReport<'db>,
    greatest: &ChainStepReport<'db>,
    (latency, limit): (Time, Time),
    declared: &Location<'db>,
    is_throttled: bool,
) -> Diagnostic<'db> {
    let (name, instance, part) = (&chain.name, &greatest.instance, &greatest.part);
    let advice = [
        (part.wait, "release it more often, as with a shorter period"),
        (part.buffer, "connect it with a smaller buffer, or read it more often"),
        (part.periods, "write in fewer periods"),
        (part.run, "shorten its response time"),
    ];
    let advice = advice.into_iter().rev().max_by_key(|(time, _)| *time).map_or("", |(_, advice)| advice);
    let sum: Vec<String> = chain.steps.iter().map(|it| format!("{} {}", it.instance, it.total())).collect();
    let runs = chain.steps.iter().any(|it| it.part.run > Time::ZERO);
    let throttling = match is_throttled && runs {
        true => "; real-time throttling is in the response times: set `kernel.sched_rt_runtime_us=-1` and `[platform] rt_throttling = false`",
        false => "",
    };
    let message = format!(
        "chain `{name}` is too slow: {}; largest part: `{instance}`, {} of {latency} ({}): {advice}{throttling}",
        chain_figure((Some(latency), Some(limit)), "", TIGHT_SLACK).text(),
        greatest.total(),
        sum.join(", ")
    );
    Diagnostic::new(&CHAIN_LATE, at, message).related(declared, format!("the limit of `{name}` is {limit}"))
}
