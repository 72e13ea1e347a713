//! Significance levels.

use std::fmt;

/// A significance level: the probability, between 0 and 1, with which one execution takes longer than its time says.
///
/// Ordered by the probability: `1e-9` < `1e-3`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Level {
    /// Of a positive `f64`, the bits are ordered as the value.
    bits: u64,
}

/// A table or a task set has no more levels.
pub const MOST_LEVELS: usize = 64;

impl Level {
    /// 10⁻⁴.
    pub const TEN_TO_MINUS_FOUR: Level = Level { bits: 1e-4_f64.to_bits() };

    /// `None` unless 0 < `probability` < 1.
    pub fn from_f64(probability: f64) -> Option<Level> {
        (probability > 0.0 && probability < 1.0).then(|| Level { bits: probability.to_bits() })
    }

    /// The probability.
    pub fn as_f64(self) -> f64 {
        f64::from_bits(self.bits)
    }
}

/// `1e-4`, `2.5e-3`.
impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:e}", self.as_f64())
    }
}
