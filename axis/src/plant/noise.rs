//! Noise that every run repeats.

/// What the running power stage couples into the sensors. At rest without torque there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// Amplitude at the encoder, in counts.
    pub encoder: f64,
    /// Amplitude of the measured velocity, in counts/s.
    pub velocity: f64,
    /// Where the random numbers start; the same seed gives the same bits.
    pub seed: u64,
}

/// A SplitMix64 generator (Steele, Lea, Flood: "Fast splittable pseudorandom number generators", 2014).
#[derive(Clone, Debug)]
pub(super) struct Random(u64);

impl Random {
    const INCREMENT: u64 = 0x9E37_79B9_7F4A_7C15;

    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A number from -1 to 1, all equally likely.
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(Self::INCREMENT);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        let high = u32::try_from((mixed ^ mixed >> 31) >> 32).unwrap_or(0);
        f64::from(high) / 2_147_483_648.0 - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_numbers_fill_their_range_evenly() {
        let mut random = Random::new(1);
        let numbers: Vec<_> = (0..10_000).map(|_| random.next()).collect();
        assert!(numbers.iter().all(|n| (-1.0..=1.0).contains(n)));
        let below = numbers.iter().filter(|n| **n < -0.5).count();
        assert!((2300..2700).contains(&below), "{below}");
    }

    #[test]
    fn a_seed_gives_its_own_sequence_again_and_again() {
        let sequence = |seed| {
            let mut random = Random::new(seed);
            [random.next(), random.next(), random.next()].map(f64::to_bits)
        };
        assert_eq!(sequence(7), sequence(7));
        assert_ne!(sequence(7), sequence(8));
    }
}
