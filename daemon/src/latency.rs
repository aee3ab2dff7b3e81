//! How long things take in the core loop: a histogram that costs one addition for each.

use core::time::Duration;

/// Up to this many microseconds each has a bucket of its own.
const FINE: usize = 512;
/// Above, each power of two has eight.
const PER_OCTAVE: u32 = 8;
const COARSE: usize = 23 * PER_OCTAVE as usize;

/// Bounds that programs are told: where buckets end.
const BOUNDS_US: [u64; 20] = [
    10, 20, 50, 75, 100, 125, 150, 200, 300, 500, 1024, 2048, 4096, 8192, 16_384, 32_768, 65_536, 131_072,
    262_144, 1_048_576,
];

/// Times in microseconds; what is longer than an hour counts as an hour.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Histogram {
    buckets: Vec<u64>,
    count: u64,
    sum: Duration,
    max_us: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { buckets: vec![0; FINE + COARSE], count: 0, sum: Duration::ZERO, max_us: 0 }
    }
}

impl Histogram {
    /// Takes note of a time.
    pub fn record(&mut self, time: Duration) {
        let micros = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        if let Some(bucket) = self.buckets.get_mut(bucket(micros)) {
            *bucket += 1;
        }
        self.count += 1;
        self.sum = self.sum.saturating_add(time);
        self.max_us = self.max_us.max(micros);
    }

    /// How many were noted.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// How long they took together.
    #[must_use]
    pub fn sum(&self) -> Duration {
        self.sum
    }

    /// Bounds in us, each with how many were below it. Buckets end at all of them.
    pub fn below(&self) -> impl Iterator<Item = (u64, u64)> {
        let (mut next, mut seen) = (0, 0);
        BOUNDS_US.into_iter().map(move |bound| {
            let end = bucket(bound);
            let buckets = self.buckets.get(next..end).unwrap_or_default();
            next = end;
            seen += buckets.iter().sum::<u64>();
            (bound, seen)
        })
    }

    /// How many were below `micros`, to an eighth above half a millisecond.
    #[must_use]
    pub fn below_us(&self, micros: u64) -> u64 {
        self.buckets.iter().take(bucket(micros)).sum()
    }

    /// The longest, in us.
    #[must_use]
    pub fn max_us(&self) -> u64 {
        self.max_us
    }

    /// The time in us that so many per mille do not exceed, to an eighth.
    #[must_use]
    pub fn per_mille_us(&self, per_mille: u64) -> u64 {
        let wanted = self.count.saturating_mul(per_mille).div_ceil(1000);
        let mut seen = 0;
        let found = self.buckets.iter().position(|bucket| {
            seen += bucket;
            seen >= wanted
        });
        found.map_or(0, |bucket| upper_end(bucket).min(self.max_us))
    }
}

fn bucket(micros: u64) -> usize {
    let fine = FINE as u64;
    if micros < fine {
        return micros as usize;
    }
    let octave = micros.ilog2() - fine.ilog2();
    let eighth = (micros >> (micros.ilog2() - PER_OCTAVE.ilog2())) as u32 & (PER_OCTAVE - 1);
    (FINE + (octave * PER_OCTAVE + eighth) as usize).min(FINE + COARSE - 1)
}

/// The longest time in us that a bucket holds.
fn upper_end(bucket: usize) -> u64 {
    let Some(coarse) = bucket.checked_sub(FINE) else { return bucket as u64 };
    let (octave, eighth) = (coarse as u64 / u64::from(PER_OCTAVE), coarse as u64 % u64::from(PER_OCTAVE));
    let begin = (FINE as u64) << octave;
    begin + (begin / u64::from(PER_OCTAVE)) * (eighth + 1) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_lies_in_its_bucket_to_an_eighth() {
        for micros in (0..5000).chain((0..30).map(|bit| 1_u64 << bit)) {
            let end = upper_end(bucket(micros));
            assert!(end >= micros && end - micros <= micros / 8 + 1, "{micros} us in a bucket up to {end}");
        }
        assert_eq!(bucket(u64::MAX), FINE + COARSE - 1);
    }

    #[test]
    fn bounds_part_what_is_below_from_the_rest() {
        assert!(BOUNDS_US.iter().all(|bound| upper_end(bucket(bound - 1)) == bound - 1));
        let mut histogram = Histogram::default();
        BOUNDS_US.iter().for_each(|bound| histogram.record(Duration::from_micros(bound - 1)));
        BOUNDS_US.iter().for_each(|bound| histogram.record(Duration::from_micros(*bound)));
        let below: Vec<u64> = histogram.below().map(|(_, below)| below).collect();
        assert_eq!(below, (0..20).map(|bound| 2 * bound + 1).collect::<Vec<_>>());
        assert_eq!(histogram.sum(), Duration::from_micros(2 * BOUNDS_US.iter().sum::<u64>() - 20));
    }

    #[test]
    fn percentiles_are_those_of_what_was_noted() {
        let mut histogram = Histogram::default();
        assert_eq!((histogram.per_mille_us(990), histogram.max_us()), (0, 0));
        (1..=100).for_each(|micros| histogram.record(Duration::from_micros(micros)));
        assert_eq!([500, 990, 1000].map(|p| histogram.per_mille_us(p)), [50, 99, 100]);
        histogram.record(Duration::from_secs(2));
        assert_eq!((histogram.count(), histogram.max_us()), (101, 2_000_000));
        assert_eq!(histogram.per_mille_us(1000), 2_000_000);
    }
}
