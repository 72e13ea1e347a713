//! Measured execution times → probabilistic worst-case execution times (pWCET).
//!
//! [`trace`] reads recorded traces, [`samples`] keeps their execution times. [`estimate`] takes the execution times of one codel, in the order in which they were measured, and returns for each level the
//! time that an execution exceeds with that probability: a point estimate, and a 95 % upper confidence bound, which is the time for
//! timing tables. An [`Estimate`] also has all that the times rest on: tests, fits, a hold-out, the convergence, and warnings.
//! Each level has a bound or a [`NoBound`], which says why. Where the executions support no tail, the result is a [`NoEstimate`], with
//! the bounds that can be counted.
//!
//! **What a number claims.** A verdict is one of a level. Where more than about 3 of n independent executions should exceed a level's
//! time, the bound is counted: it is above the true quantile in at least 95 of 100 measurements, whatever the distribution. Other levels
//! have the bound of a fitted tail, which is never below the greatest execution, and [`Warning::Extrapolated`]. If the tail goes on as
//! it was seen, this bound is above the true quantile in at least 93 of 100 measurements, or refused: `tests/coverage.rs` counts it for
//! light and heavy tails, rare modes, coarse clocks, dependence and drift.
//!
//! **What it does not claim.** A mode that no execution showed is in no number. One of which n executions should show less than 3 (less
//! than 25 where its times are among those of the others) may be taken for the tail of the others: of 2000 executions, 1 % of them with
//! a scale that is five times as long, 15 of 100 bounds at 1e-4 are too low. A tail that becomes heavier beyond the executions is not
//! seen either: 14 of 100 bounds of Student's t with 6 degrees of freedom at 1e-9. No number of executions excludes both where the
//! level is not counted, and a bound for them would be no use: this is what the warning of the level says. If executions depend on each
//! other for longer than √n of them, less is claimed.
//!
//! **Why no more than 750 excesses.** A fit of 15 % of the executions has the error of the body; with more of them its interval would
//! narrow around that error. The number of excesses stays, so that the share falls as recordings grow, and the error with it.
//!
//! **Why ξ ≥ 0.** The tail of the model has no end. If an end is fitted as well (ξ < 0), the 95 % bounds at 1e-7 of light tails are too
//! low in up to half of all measurements, since an end is estimated from few excesses; with ξ ≥ 0, they hold.
//!
//! The crate must never know MAUVE's syntax, salsa, timing tables or prose: codels and programs are texts here, and what is wrong
//! with a measurement is a value that others say in words. Times are in nanoseconds; floating point is for statistics only. The same
//! seed gives the same numbers.
//!
//! | file | content |
//! |---|---|
//! | `measurement.rs` | [`measure`]: from sample files to the times of each codel |
//! | `estimate.rs` | [`estimate`]: from executions to times, with all checks |
//! | `tail.rs` | [`Tail`]: threshold, fit, quantiles and their bounds (peaks over threshold) |
//! | `gpd.rs` | [`Gpd`]: the generalised Pareto distribution, by maximum likelihood |
//! | `likelihood_region.rs` | confidence bounds by profile likelihood |
//! | `anderson_darling.rs` | the goodness of a fit |
//! | `checks.rs`, `distributions.rs` | [`Check`]: tests of the assumptions |
//! | `hold_out.rs`, `convergence.rs` | what the first half promises of the second, and how estimates change with n |
//! | `counted.rs` | [`counted_bounds`]: order statistics, where there is no tail |
//! | `refusal.rs` | [`EstimateRefusal`]: why there is no tail, or a level has no bound |
//! | `dependence.rs` | what dependent and changing executions are worth |
//! | `exceedances.rs` | [`exceedance_probability`]: whether executions keep the promise of a time |
//! | `program.rs` | [`program::program`]: the programs of other people, in the absolute folders of `PATH` |
//! | `order.rs`, `random.rs` | times without ties; random numbers with a seed |
//! | `trace.rs`, `trace/error.rs` | what a trace has, and why it cannot be read |
//! | `trace/reader.rs` | [`trace::TraceReader`]: recorded traces → [`trace::Span`]s, in one pass and in constant memory |
//! | `trace/source.rs` | [`trace::Source`]: what a path is; the chunks of a session of LTTng |
//! | `trace/cut.rs` | the complete packets of a recording of LTTng that a power failure cut |
//! | `trace/babeltrace.rs` | runs `babeltrace2`; what the tracer discarded |
//! | `trace/lines.rs` | the lines of a stream, without an allocation for each |
//! | `trace/event.rs` | an event of LTTng, from the text of `babeltrace2` |
//! | `trace/nesting.rs` | begins and ends → spans, across discarded events and damaged recordings |
//! | `trace/ros2.rs` | [`trace::Ros2Graph`]: nodes, callbacks and topics of a recording of `ros2_tracing` |
//! | `trace/observation.rs` | [`trace::Observation`]: the greatest time and wait of each codel |
//! | `trace/csv.rs`, `trace/column.rs` | files of executions, in comma-separated values |
//! | `trace/names.rs` | [`trace::SpanNames`]: codels, programs and instances, by number |
//! | `samples.rs`, `samples/error.rs` | [`samples::Samples`]: reads the sample file of all runs |
//! | `samples/writer.rs` | [`samples::SamplesWriter`]: appends runs, each of them completely or not at all |
//! | `samples/block.rs`, `samples/encoding.rs` | the blocks of a sample file, and the numbers in them |
//!
//! `tests/` compares with R, scipy and pyextremes, and counts how often bounds hold.

mod anderson_darling;
mod checks;
mod convergence;
mod counted;
mod dependence;
mod distributions;
mod estimate;
mod exceedances;
mod gpd;
mod hold_out;
mod likelihood_region;
mod measurement;
mod order;
pub mod program;
mod random;
mod refusal;
pub mod samples;
mod tail;
#[cfg(test)]
mod tests;
pub mod trace;

pub use checks::{Check, CheckKind};
pub use convergence::Convergence;
pub use counted::{counted_bounds, counted_from};
pub use estimate::{
    CurvePoint, Estimate, EstimateOptions, FAR, FEW_EXECUTIONS, LEAST_DISTINCT, LevelEstimate, Warning,
    estimate, rounded_up,
};
pub use exceedances::exceedance_probability;
pub use gpd::Gpd;
pub use hold_out::HoldOut;
pub use measurement::{InstanceMeasurement, Measurement, measure};
pub use refusal::{EstimateRefusal, NoBound, NoEstimate, greatest_ratio};
pub use tail::{LEAST_EXCESSES, LEAST_EXECUTIONS, Tail};
