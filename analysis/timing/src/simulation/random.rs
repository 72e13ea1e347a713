//! Random numbers that are the same on every machine.

/// SplitMix64 (Steele, Lea, Flood: *Fast Splittable Pseudorandom Number Generators*, OOPSLA 2014): a generator with 64 bits of
/// state. Two generators with one seed give the same numbers, on every machine. Not for secrets.
///
/// ```
/// let mut random = mauve_timing::Random::new(1);
/// assert_eq!(random.bits(), 0x910a_2dec_8902_5cc1);
/// assert!(random.up_to(5) <= 5);
/// ```
#[derive(Clone, Default, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// Creates a generator.
    pub fn new(seed: u64) -> Random {
        Random { state: seed }
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Returns a number from 0 to `greatest`. Each has the same probability, up to a relative error of `greatest` / 2⁶⁴.
    pub fn up_to(&mut self, greatest: u64) -> u64 {
        ((u128::from(self.bits()) * (u128::from(greatest) + 1)) >> 64) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_the_reference_implementation() {
        // splitmix64.c by Sebastiano Vigna, with the seed 1234567.
        let mut random = Random::new(1_234_567);
        let found = [(); 5].map(|()| random.bits());
        let expected = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn every_number_of_a_range() {
        let mut random = Random::new(3);
        let mut counts = [0; 6];
        (0..6000).for_each(|_| counts[random.up_to(5) as usize] += 1);
        assert!(counts.iter().all(|count| (850..1150).contains(count)), "{counts:?}");
        assert_eq!(random.up_to(0), 0);
        assert!((0..100).any(|_| random.up_to(u64::MAX) > u64::MAX / 2));
    }
}
