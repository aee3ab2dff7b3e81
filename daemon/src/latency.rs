//! How long things take in the core loop: a histogram that costs one addition for each.

use core::time::Duration;

/// Up to this many microseconds each has a bucket of its own.
const FINE: usize = 512;
/// Above, each power of two has eight.
const PER_OCTAVE: u32 = 8;
const COARSE: usize = 23 * PER_OCTAVE as usize;

/// Times in microseconds; what is longer than an hour counts as an hour.
#[derive(Clone, Debug)]
pub struct Histogram {
    buckets: Vec<u64>,
    count: u64,
    max_us: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { buckets: vec![0; FINE + COARSE], count: 0, max_us: 0 }
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
        self.max_us = self.max_us.max(micros);
    }

    /// How many were noted.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
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
