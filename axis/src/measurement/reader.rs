//! What a drive reads its place from: its own sensor, one elsewhere, or words that a host supplies.

use super::{Measurement, OutOfRange, Scale, Sensor, SensorConfig};
use crate::inputs::Latches;
use crate::units::Position;

/// Where the position of an axis comes from (MACCON MAC4 User Manual, section 4.4.1).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Source {
    /// The count of the pulses put out; a drive without pulses takes its own sensor as a counter of 16 bits.
    #[default]
    Counter,
    /// The sensor that is connected to the drive, its words read like this.
    Own(SensorConfig, Scale),
    /// Another sensor at the same motor that shows its place exactly as it is read.
    Elsewhere(SensorConfig, Scale),
    /// Whatever words the host supplies by [`Setting::Word`](crate::Setting::Word), read like this.
    Host(SensorConfig, Scale),
}

impl Source {
    /// How its words are read.
    fn reading(self) -> (SensorConfig, Scale) {
        match self {
            Self::Counter => (SensorConfig::incremental(16), Scale::ONE),
            Self::Own(config, scale) | Self::Elsewhere(config, scale) | Self::Host(config, scale) => {
                (config, scale)
            }
        }
    }
}

/// Reads the place of the motor as its drive sees it.
#[derive(Clone, Debug)]
pub(crate) struct Reader {
    /// The sensor that is connected to the drive.
    own: Sensor,
    source: Source,
    /// The sensor the words come from.
    sensor: Sensor,
    measurement: Measurement,
    /// The last word.
    word: u32,
    from_host: u32,
    /// A word of the host was not read yet.
    is_pending: bool,
}

impl Reader {
    /// A reader of this sensor, which is connected to the drive.
    pub(crate) fn new(own: SensorConfig, source: Source) -> Self {
        let (config, scale) = source.reading();
        let own = Sensor::new(own);
        let sensor = match source {
            Source::Counter | Source::Own(..) | Source::Host(..) => own,
            Source::Elsewhere(config, _) => Sensor::new(config),
        };
        Self {
            own,
            source,
            sensor,
            measurement: Measurement::new(config, scale),
            word: 0,
            from_host: 0,
            is_pending: false,
        }
    }

    /// Reads from another source from now on; nothing has been read of it yet.
    pub(crate) fn set_source(&mut self, source: Source) {
        let from_host = self.from_host;
        *self = Self { own: self.own, from_host, ..Self::new(SensorConfig::incremental(16), source) };
        if matches!(source, Source::Counter | Source::Own(..)) {
            self.sensor = self.own;
        }
    }

    /// Whether pulses are counted.
    pub(crate) fn is_counter(&self) -> bool {
        self.source == Source::Counter
    }

    /// Takes a word of the host.
    pub(crate) fn supply(&mut self, word: u32) {
        self.from_host = word;
        self.is_pending = true;
    }

    /// Whether a word of the host was not read yet.
    pub(crate) fn is_pending(&self) -> bool {
        self.is_pending
    }

    /// Where the axis is while the encoder of the plant shows `place`.
    ///
    /// # Errors
    /// An absolute value outside of the counting range.
    pub(crate) fn read(&mut self, place: Position) -> Result<Position, OutOfRange> {
        self.word = self.word_at(place);
        self.is_pending = false;
        self.measurement.update(self.word).map(|place| Position(place as f64))
    }

    /// Signals at these places of the plant, as the axis sees them; to be asked before the next reading.
    pub(crate) fn latches(&self, raw: Latches) -> Latches {
        raw.map(|place| {
            let latched = self.measurement.latched(self.word_at(place)).ok();
            latched.map(|place| Position(place as f64))
        })
    }

    /// The last word as it was read.
    pub(crate) fn word(&self) -> u32 {
        self.word
    }

    /// The number in the last word, after the bits that do not count have been dropped.
    pub(crate) fn count(&self) -> u32 {
        self.source.reading().0.sanitised().decode(self.word)
    }

    fn word_at(&self, place: Position) -> u32 {
        match self.source {
            Source::Host(..) => self.from_host,
            Source::Counter | Source::Own(..) | Source::Elsewhere(..) => self.sensor.word(place.0 as i64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Coding;
    use super::*;

    #[test]
    fn a_wrong_shift_reads_the_own_sensor_wrongly_and_the_right_one_repairs_it() {
        let own = SensorConfig::ssi(12, 5, Coding::Gray);
        let mut reader = Reader::new(own, Source::Own(SensorConfig::ssi(12, 4, Coding::Gray), Scale::ONE));
        assert_ne!(reader.read(Position(100.0)), Ok(Position(100.0)));
        reader.set_source(Source::Own(own, Scale::ONE));
        assert_eq!(reader.read(Position(100.0)), Ok(Position(100.0)));
        assert_eq!(reader.count(), 100);
        assert_eq!(reader.word(), (100 ^ 50) << 5);
    }

    #[test]
    fn a_value_beyond_the_counting_range_is_an_error() {
        let own = SensorConfig::ssi(14, 0, Coding::Binary);
        let read = SensorConfig { range: 10_000, ..own };
        let mut reader = Reader::new(own, Source::Own(read, Scale::ONE));
        assert_eq!(reader.read(Position(9_999.0)), Ok(Position(9_999.0)));
        assert_eq!(reader.read(Position(10_000.0)), Err(OutOfRange { value: 10_000 }));
    }

    #[test]
    fn a_host_says_where_the_axis_is() {
        let config = SensorConfig::incremental(16);
        let mut reader = Reader::new(config, Source::Host(config, Scale::ONE));
        assert_eq!(reader.read(Position(77.0)), Ok(Position(0.0)));
        reader.supply(500);
        assert_eq!(reader.read(Position(77.0)), Ok(Position(500.0)));
        reader.set_source(Source::Elsewhere(config, Scale::ONE));
        assert_eq!(reader.read(Position(77.0)), Ok(Position(0.0)), "a relative sensor begins at zero");
        assert_eq!(reader.read(Position(80.0)), Ok(Position(3.0)));
    }
}
