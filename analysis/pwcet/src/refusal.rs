//! Why there is no tail, or why a level has no bound: values that others say in words.

/// Why no tail gives bounds. Levels that can be counted have theirs nevertheless.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EstimateRefusal {
    /// Fewer executions than [`LEAST_EXECUTIONS`](crate::LEAST_EXECUTIONS).
    TooFew {
        /// How many there are.
        count: usize,
    },
    /// All executions took the same time, in nanoseconds.
    Constant {
        /// That time.
        time: u64,
    },
    /// There are too few distinct times for a distribution, or too few in its tail.
    TooCoarse {
        /// How many distinct times there are.
        distinct: usize,
        /// The resolution of the clock, in nanoseconds.
        resolution: u64,
    },
    /// No distribution fits the longest executions.
    NoFit,
    /// The longest executions are a mode of their own, too few to fit and too many for the tail of the others.
    RareMode {
        /// How many they are.
        slow: usize,
    },
    /// The tail is so heavy that it has no mean: ξ ≥ 1.
    InfiniteMean {
        /// ξ.
        shape: f64,
    },
    /// The bound of this level is more than [`greatest_ratio`] times the greatest execution.
    Absurd {
        /// The bound divided by the greatest execution.
        ratio: f64,
    },
}

/// Returns by which factor the bound of a level may exceed the greatest execution, where `depth` executions should exceed it.
///
/// The greatest of n executions is exceeded with a probability of about 1/n, p · n = `depth` times as often as the time of the level p. A tail
/// with the shape ξ grows by (1/depth)^ξ in between; from ξ = 1/2 on, it has no variance. So a bound of 10 times that growth, for what the
/// greatest execution may be too short, is not a time of a codel: the executions say too little. No bound of 1000 times is one.
pub fn greatest_ratio(depth: f64) -> f64 {
    (10.0 * depth.recip().sqrt()).clamp(10.0, 1000.0)
}

/// Why a level has no bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoBound {
    /// Why the tail gives none.
    pub refusal: EstimateRefusal,
    /// With so many executions, the level is counted and needs no tail.
    pub needed: u64,
}

/// No tail fits the executions.
#[derive(Debug, Clone, PartialEq)]
pub struct NoEstimate {
    /// Why.
    pub refusal: EstimateRefusal,
    /// For each level of the options, the bound in nanoseconds that is counted without a tail.
    pub bounds: Vec<Result<f64, NoBound>>,
}
