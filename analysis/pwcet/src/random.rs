//! Random numbers: the same for the same seed, on each machine and in each version.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// Returns a generator for one purpose: different streams of one seed are independent.
pub(crate) fn generator(seed: u64, stream: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed ^ stream.wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// Returns a number in (0, 1).
pub(crate) fn uniform(random: &mut impl Rng) -> f64 {
    // 52 bits and a half: neither end is possible.
    ((random.next_u64() >> 12) as f64 + 0.5) / (1_u64 << 52) as f64
}
