//! Convergence: how the estimates change as the sample grows.

use crate::order::SortedTimes;
use crate::tail::Tail;

/// The estimates from the first executions.
#[derive(Debug, Clone, PartialEq)]
pub struct Convergence {
    /// How many executions.
    pub count: usize,
    /// For each level, the estimate and its upper bound, in nanoseconds.
    pub levels: Vec<(f64, f64)>,
}

/// Returns the estimates from parts of the sample that are large enough, without the whole sample.
pub(crate) fn convergence(times: &SortedTimes, levels: &[f64]) -> Vec<Convergence> {
    let counts = [2, 4, 6, 8, 9].into_iter().map(|tenths| times.count() * tenths / 10);
    let at = |count: usize| {
        let first = times.first(count);
        let tail = Tail::select(&first).ok()?;
        let levels =
            levels.iter().map(|&level| (tail.exceeded_with(&first, level), tail.upper_bound(&first, level)));
        Some(Convergence { count, levels: levels.collect() })
    };
    counts.filter(|&count| count >= crate::tail::LEAST_EXECUTIONS).filter_map(at).collect()
}
