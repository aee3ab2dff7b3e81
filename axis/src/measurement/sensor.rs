//! A position sensor: what its register holds at which place.

/// How the bits of a word stand for a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Powers of two.
    Binary,
    /// Reflected Gray code: one bit changes from a number to the next, and over an overflow when the range
    /// is a power of two.
    Gray,
}

/// What an axis takes from a reading (MACCON MAC4 User Manual, section 4.4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counting {
    /// Only the change since the last reading; the counter may overflow.
    Relative,
    /// The value; the counting range is never left.
    Absolute,
}

/// A position sensor as its register shows it (MACCON MAC4 User Manual, section 4.4.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorConfig {
    /// Significant bits, 1 to 32 (`<eb>`); those above are ignored.
    pub bits: u8,
    /// Counting range, 2 to 2^bits (`<ec>`): the values are 0 to `range - 1`.
    pub range: u64,
    /// Binary shifts to the right that bring the lowest significant bit to place 0 (`<sc>`).
    pub shift: u8,
    /// Coding of the significant bits.
    pub coding: Coding,
    /// What the axis takes from a reading.
    pub counting: Counting,
}

impl SensorConfig {
    /// Bits of a register.
    const WIDTH: u8 = 32;

    /// Clock pulses of one SSI transmission, thus bits of its word (MACCON MAC4 User Manual, section 2.3.2).
    pub const SSI_CLOCKS: u8 = 26;

    /// A counter of output steps or of the increments of an encoder, `bits` wide, that wraps.
    #[must_use]
    pub fn incremental(bits: u8) -> Self {
        let range = 1_u64.checked_shl(u32::from(bits)).unwrap_or(u64::MAX);
        Self { bits, range, shift: 0, coding: Coding::Binary, counting: Counting::Relative }.sanitised()
    }

    /// An absolute encoder with SSI, `bits` wide, whose lowest bit comes `shift` clocks before the last.
    #[must_use]
    pub fn ssi(bits: u8, shift: u8, coding: Coding) -> Self {
        let shift = shift.min(Self::SSI_CLOCKS - 1);
        let bits = bits.min(Self::SSI_CLOCKS - shift);
        Self { shift, coding, counting: Counting::Absolute, ..Self::incremental(bits) }
    }

    /// The configuration with every value pulled into its range: the significant bits within the register,
    /// the counting range within the significant bits.
    #[must_use]
    pub fn sanitised(self) -> Self {
        let shift = self.shift.min(Self::WIDTH - 1);
        let bits = self.bits.clamp(1, Self::WIDTH - shift);
        Self { bits, shift, range: self.range.clamp(2, 1 << bits), ..self }
    }

    /// The number in a word. The Gray code is resolved after the bits that do not count have been dropped.
    pub(super) fn decode(&self, word: u32) -> u32 {
        let significant = (word >> self.shift) & self.mask();
        match self.coding {
            Coding::Binary => significant,
            Coding::Gray => from_gray(significant),
        }
    }

    /// The way from one number to another, in increments, from minus half the range to less than plus half.
    pub(super) fn shorter_way(&self, from: u32, to: u32) -> i64 {
        let range = self.range();
        let forward = (i64::from(to) - i64::from(from)).rem_euclid(range);
        if 2 * forward >= range { forward - range } else { forward }
    }

    fn encode(&self, value: u32) -> u32 {
        let significant = match self.coding {
            Coding::Binary => value,
            Coding::Gray => to_gray(value),
        };
        significant << self.shift
    }

    fn mask(&self) -> u32 {
        u32::MAX >> (Self::WIDTH - self.bits)
    }

    fn range(&self) -> i64 {
        i64::try_from(self.range).unwrap_or(i64::MAX)
    }
}

/// A sensor to be simulated.
#[derive(Clone, Copy, Debug)]
pub struct Sensor {
    config: SensorConfig,
}

impl Sensor {
    /// A sensor; see [`SensorConfig::sanitised`].
    #[must_use]
    pub fn new(config: SensorConfig) -> Self {
        Self { config: config.sanitised() }
    }

    /// The word in its register at a place in increments: the place is wrapped at the counting range, coded
    /// and shifted; bits that are not significant are zero.
    #[must_use]
    pub fn word(&self, increments: i64) -> u32 {
        let value = increments.rem_euclid(self.config.range());
        self.config.encode(u32::try_from(value).unwrap_or_default())
    }
}

fn to_gray(number: u32) -> u32 {
    number ^ (number >> 1)
}

fn from_gray(code: u32) -> u32 {
    [16, 8, 4, 2, 1].into_iter().fold(code, |sum, shift| sum ^ (sum >> shift))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_first_gray_codes_are_the_reflected_ones() {
        let codes: Vec<u32> = (0..8).map(to_gray).collect();
        assert_eq!(codes, [0b000, 0b001, 0b011, 0b010, 0b110, 0b111, 0b101, 0b100]);
    }

    #[test]
    fn a_word_has_its_number_at_the_shift_and_nothing_elsewhere() {
        let sensor = Sensor::new(SensorConfig::ssi(12, 5, Coding::Binary));
        assert_eq!(sensor.word(0xABC), 0xABC << 5);
        assert_eq!(sensor.word(0x1000), 0);
        assert_eq!(sensor.word(-1), 0xFFF << 5);
    }

    #[test]
    fn an_ssi_word_has_no_more_bits_than_clocks() {
        assert_eq!(SensorConfig::ssi(32, 0, Coding::Gray).bits, 26);
        assert_eq!(SensorConfig::ssi(24, 4, Coding::Gray).bits, 22);
        assert_eq!(Sensor::new(SensorConfig::ssi(32, 99, Coding::Gray)).word(-1), 1 << 25);
    }

    #[test]
    fn a_configuration_of_nonsense_is_pulled_into_its_range() {
        let wild = SensorConfig { bits: 0, range: 0, shift: 255, ..SensorConfig::incremental(16) };
        let tame = wild.sanitised();
        assert_eq!((tame.bits, tame.range, tame.shift), (1, 2, 31));
        let wide = SensorConfig::incremental(200);
        assert_eq!((wide.bits, wide.range), (32, 1 << 32));
    }

    proptest! {
        #[test]
        fn gray_codes_round_trip(number in any::<u32>()) {
            prop_assert_eq!(from_gray(to_gray(number)), number);
            prop_assert_eq!(to_gray(from_gray(number)), number);
        }

        #[test]
        fn gray_neighbours_differ_in_one_bit_over_the_overflow_too(bits in 1..=26_u8, place in any::<i32>()) {
            let sensor = Sensor::new(SensorConfig::ssi(bits, 0, Coding::Gray));
            let place = i64::from(place);
            prop_assert_eq!((sensor.word(place) ^ sensor.word(place + 1)).count_ones(), 1);
            let full = (1 << bits) - 1;
            prop_assert_eq!((sensor.word(full) ^ sensor.word(full + 1)).count_ones(), 1);
        }
    }
}
