//! Position measurement: from the word in a sensor's register to a place in motor steps.
//!
//! MACCON MAC4 User Manual, section 4.4, knows a counter of output steps, a counter of encoder increments,
//! an SSI absolute encoder and a sensor behind another bus. To this module they are all a [`SensorConfig`]:
//! how the word is coded, how far it counts, and whether the axis takes its value or only its changes. A
//! [`Scale`] then turns increments into motor steps.

mod reader;
mod scale;
mod sensor;

pub(crate) use reader::Reader;
pub use reader::Source;
pub use scale::Scale;
pub use sensor::{Coding, Counting, Sensor, SensorConfig};

/// The error of a position measurement system: an absolute value beyond the counting range (MACCON MAC4
/// User Manual, section 6.3.8).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfRange {
    /// The value read, in increments.
    pub value: u32,
}

/// Turns the words of one sensor into a place.
#[derive(Clone, Debug)]
pub struct Measurement {
    config: SensorConfig,
    scale: Scale,
    last: Option<u32>,
    increments: i64,
}

impl Measurement {
    /// A measurement that has not read anything yet; see [`SensorConfig::sanitised`].
    #[must_use]
    pub fn new(config: SensorConfig, scale: Scale) -> Self {
        Self { config: config.sanitised(), scale, last: None, increments: 0 }
    }

    /// Takes a reading: the place in motor steps.
    ///
    /// Absolute: the value read. Relative: the sum of all changes since the first reading, which is place 0;
    /// each change is the shorter way round the counting range, half of it counts as backwards. Values are
    /// then taken modulo the range, so none is out of it.
    ///
    /// # Errors
    ///
    /// An absolute value outside of the counting range; the place stays as it was.
    pub fn update(&mut self, word: u32) -> Result<i64, OutOfRange> {
        self.increments = self.locate(word)?;
        self.last = Some(self.config.decode(word));
        Ok(self.position())
    }

    /// The place, in motor steps, that a latched register stood for; to be asked before the counter has gone
    /// on by half its range. Changes nothing.
    ///
    /// # Errors
    ///
    /// An absolute value outside of the counting range.
    pub fn latched(&self, word: u32) -> Result<i64, OutOfRange> {
        self.locate(word).map(|increments| self.scale.steps(increments))
    }

    /// The place after the last good reading, in motor steps; 0 before the first.
    #[must_use]
    pub fn position(&self) -> i64 {
        self.scale.steps(self.increments)
    }

    /// The place after the last good reading, in the sensor's own increments.
    #[must_use]
    pub fn increments(&self) -> i64 {
        self.increments
    }

    fn locate(&self, word: u32) -> Result<i64, OutOfRange> {
        let value = self.config.decode(word);
        match self.config.counting {
            Counting::Absolute if u64::from(value) >= self.config.range => Err(OutOfRange { value }),
            Counting::Absolute => Ok(i64::from(value)),
            Counting::Relative => {
                let change = self.config.shorter_way(self.last.unwrap_or(value), value);
                Ok(self.increments.saturating_add(change))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Sensors that count up to a power of two or less, anywhere in their word.
    fn sensors(counting: Counting) -> impl Strategy<Value = SensorConfig> {
        let codings = prop::sample::select(vec![Coding::Binary, Coding::Gray]);
        (2..=32_u8, 0..30_u8, codings, 0.5..=1.0_f64).prop_map(move |(bits, shift, coding, part)| {
            let range = ((2_f64.powi(i32::from(bits)) * part) as u64).max(3);
            SensorConfig { bits, range, shift: shift.min(32 - bits), coding, counting }
        })
    }

    /// A walk whose steps are up to the given part of half a range.
    fn walk(range: u64, parts: &[f64]) -> Vec<i64> {
        let most = (range as i64 - 1) / 2;
        let mut place = 0;
        let step = |part: &f64| {
            place += (part * most as f64) as i64;
            place
        };
        parts.iter().map(step).collect()
    }

    /// Words with anything in the bits that do not count.
    fn littered(config: SensorConfig, word: u32, litter: u32) -> u32 {
        let used = ((1_u64 << config.bits) - 1) << config.shift;
        word | (litter & !(used as u32))
    }

    fn scales() -> impl Strategy<Value = (u32, u32, Scale)> {
        (1..100_000_u32, 1..1_000_000_u32)
            .prop_map(|(lines, steps)| (lines, steps, Scale::of_encoder(lines, steps).unwrap()))
    }

    proptest! {
        #[test]
        fn relative_counting_follows_the_sensor_over_any_number_of_overflows(
            config in sensors(Counting::Relative),
            start in any::<i32>(),
            parts in prop::collection::vec(-1.0..=1.0_f64, 1..200),
            litter in any::<u32>(),
        ) {
            let (start, sensor) = (i64::from(start), Sensor::new(config));
            let mut measurement = Measurement::new(config, Scale::ONE);
            prop_assert_eq!(measurement.update(sensor.word(start)), Ok(0));
            for place in walk(config.range, &parts) {
                let word = littered(config, sensor.word(start + place), litter);
                prop_assert_eq!(measurement.latched(word), Ok(place));
                prop_assert_eq!(measurement.update(word), Ok(place));
            }
        }

        #[test]
        fn absolute_counting_shows_the_value_within_the_range(
            config in sensors(Counting::Absolute),
            places in prop::collection::vec(any::<i64>(), 1..50),
            litter in any::<u32>(),
        ) {
            let sensor = Sensor::new(config);
            let mut measurement = Measurement::new(config, Scale::ONE);
            for place in places {
                let word = littered(config, sensor.word(place), litter);
                prop_assert_eq!(measurement.update(word), Ok(place.rem_euclid(config.range as i64)));
            }
        }

        #[test]
        fn steps_of_an_encoder_never_drift_from_the_exact_ratio(
            (lines, steps, scale) in scales(),
            parts in prop::collection::vec(-1.0..=1.0_f64, 1..200),
        ) {
            let config = SensorConfig::incremental(16);
            let sensor = Sensor::new(config);
            let mut measurement = Measurement::new(config, scale);
            measurement.update(sensor.word(0)).unwrap();
            for place in walk(config.range, &parts) {
                let twice_error = 2 * (i128::from(measurement.update(sensor.word(place)).unwrap())
                    * i128::from(lines) * 4 - i128::from(place) * i128::from(steps));
                prop_assert!(twice_error.abs() <= 4 * i128::from(lines));
            }
        }
    }

    #[test]
    fn an_absolute_value_beyond_the_range_is_an_error_and_moves_nothing() {
        // MACCON MAC4 User Manual, section 7.2, MAC4-SSI: resolution 10,000 in 14 bits.
        let config = SensorConfig { range: 10_000, ..SensorConfig::ssi(14, 0, Coding::Binary) };
        let mut measurement = Measurement::new(config, Scale::ONE);
        assert_eq!(measurement.update(9_999), Ok(9_999));
        assert_eq!(measurement.update(10_000), Err(OutOfRange { value: 10_000 }));
        assert_eq!(measurement.latched(16_383), Err(OutOfRange { value: 16_383 }));
        assert_eq!(measurement.position(), 9_999);
        assert_eq!(measurement.update(16_384), Ok(0)); // the 15th bit is none of the value's
    }

    #[test]
    fn relative_counting_takes_the_shorter_way_round() {
        let config = SensorConfig { range: 10_000, ..SensorConfig::incremental(14) };
        let mut measurement = Measurement::new(config, Scale::ONE);
        assert_eq!(measurement.update(9_990), Ok(0));
        assert_eq!(measurement.update(10), Ok(20));
        assert_eq!(measurement.update(9_980), Ok(-10));
        assert_eq!(measurement.update(4_979), Ok(4_989));
        assert_eq!(measurement.update(9_979), Ok(-11)); // exactly half: backwards
    }

    #[test]
    fn a_shifted_gray_word_is_read_as_such_an_encoder_sends_it() {
        // 26 clocks: 24 bits of position, the last one a parity bit, then a one as a fault bit.
        let config = SensorConfig::ssi(24, 2, Coding::Gray);
        let mut measurement = Measurement::new(config, Scale::ONE);
        assert_eq!(measurement.update(0b110 << 2 | 0b01), Ok(4));
        assert_eq!(measurement.update(0b111 << 2 | 0b11), Ok(5));
        assert_eq!(measurement.update(0x80_0000 << 2), Ok(0xFF_FFFF));
    }

    #[test]
    fn the_index_is_latched_in_motor_steps() {
        // MACCON MAC4 User Manual, section 4.4.2.3, example 1: 6.25 steps an increment.
        let scale = Scale::of_encoder(1_000, 25_000).unwrap();
        let mut measurement = Measurement::new(SensorConfig::incremental(16), scale);
        measurement.update(65_000).unwrap();
        measurement.update(100).unwrap();
        assert_eq!(measurement.increments(), 636);
        assert_eq!(measurement.latched(65_400), Ok(2_500));
        assert_eq!(measurement.position(), 3_975);
    }
}
