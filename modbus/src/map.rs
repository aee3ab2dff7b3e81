//! Which registers, coils and discrete inputs stand for which entries of a dictionary.
//!
//! Registers lie in regions that do not touch. An entry takes as many registers as its bits need; the word order of the
//! device says whether the low or the high one comes first.

use core::ops::RangeInclusive;

use od::{DataType, Dictionary, Schema, Slot};

use crate::function;

/// First register of the application dictionary.
const APPLICATION: u16 = 0x1000;
/// Last register the application dictionary may take; JVL's module registers follow.
const APPLICATION_LAST: u16 = 0x7FFF;
/// First of JVL's module registers (Ethernet manual, section 7.3.1).
pub const JVL_MODULE: u16 = 0x8000;
/// First register of their mirror (section 8.2.6).
pub const JVL_MIRROR: u16 = 0x0300;
/// JVL's motor registers (section 7.2.4): 0-255. Registers that no list names are reserved.
const JVL_MOTOR_REGISTERS: u8 = 255;
/// JVL's module registers: 0-63.
const JVL_MODULE_REGISTERS: u8 = 63;

/// Which functions and limits a unit has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dialect {
    /// What JVL's modules have (Ethernet manual, section 7.2.4): function codes 3, 16 and 23, even quantities,
    /// exceptions 1, 2 and 3.
    Jvl,
    /// All functions with the limits of the standard.
    #[default]
    Full,
}

impl Dialect {
    pub(crate) const fn serves(self, code: u8) -> bool {
        match self {
            Self::Jvl => matches!(
                code,
                function::READ_HOLDING_REGISTERS
                    | function::WRITE_MULTIPLE_REGISTERS
                    | function::READ_WRITE_MULTIPLE_REGISTERS
            ),
            Self::Full => true,
        }
    }

    /// Whether `quantity` registers may be read at once.
    pub(crate) const fn may_read(self, quantity: u16) -> bool {
        match self {
            Self::Jvl => is_even(quantity, 124),
            Self::Full => 1 <= quantity && quantity <= 125,
        }
    }

    /// Whether `quantity` registers may be written at once.
    pub(crate) const fn may_write(self, quantity: u16) -> bool {
        match self {
            Self::Jvl => is_even(quantity, 32),
            Self::Full => 1 <= quantity && quantity <= 123,
        }
    }

    /// Whether `quantity` registers may be written by a request that also reads.
    pub(crate) const fn may_read_and_write(self, quantity: u16) -> bool {
        match self {
            Self::Jvl => is_even(quantity, 32),
            Self::Full => 1 <= quantity && quantity <= 121,
        }
    }
}

const fn is_even(quantity: u16, most: u16) -> bool {
    0 < quantity && quantity <= most && quantity.is_multiple_of(2)
}

/// The order of the registers of one value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WordOrder {
    /// The low word has the lower address, as with JVL.
    #[default]
    LowFirst,
    /// The high word has the lower address.
    HighFirst,
}

/// A bit of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flag {
    /// The entry.
    pub slot: Slot,
    /// Number of the bit.
    pub bit: u8,
}

/// How the registers of a region treat values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Style {
    /// Every register has 32 bits. What an entry has less is sign-extended, and cut off when written.
    Jvl,
    /// A register must fit its entry.
    Exact,
}

/// One register of 16 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Word {
    pub(crate) slot: Slot,
    pub(crate) data_type: DataType,
    /// Position in the value, by address.
    pub(crate) index: u8,
    /// Registers the value has.
    pub(crate) count: u8,
    /// Position in the value, by significance: the number of the bit that is its lowest.
    shift: u8,
}

impl Word {
    /// The registers of a value, by address.
    fn all(slot: Slot, data_type: DataType, count: u8, order: WordOrder) -> impl Iterator<Item = Self> {
        (0..count).map(move |index| {
            let shift = match order {
                WordOrder::LowFirst => 16 * index,
                WordOrder::HighFirst => 16 * (count - 1 - index),
            };
            Self { slot, data_type, index, count, shift }
        })
    }

    /// The part of `value` that the register holds.
    pub(crate) fn part(self, value: u64) -> u16 {
        (value >> (self.shift & 63)) as u16
    }
}

#[derive(Clone, Debug)]
struct Region {
    first: u16,
    style: Style,
    /// What must be set for the region to be there.
    only_if: Option<Flag>,
    /// Registers that are reserved are `None`.
    words: Vec<Option<Word>>,
}

/// Registers that a request covers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window<'m> {
    pub(crate) words: &'m [Option<Word>],
    pub(crate) is_exact: bool,
}

/// The registers of one entry, as a listing shows them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Listed {
    /// Address of the first register on the wire.
    pub first: u16,
    /// Number of registers.
    pub count: u8,
    /// The entry.
    pub slot: Slot,
}

/// The registers, coils and discrete inputs of a device. Devices of a kind share one.
#[derive(Clone, Debug, Default)]
pub struct Map {
    dialect: Dialect,
    order: WordOrder,
    regions: Vec<Region>,
    coils: Vec<Slot>,
    inputs: Vec<Slot>,
    /// Entries of the application that found no room.
    left_out: usize,
}

impl Map {
    /// A map without registers.
    #[must_use]
    pub fn new(dialect: Dialect, order: WordOrder) -> Self {
        Self { dialect, order, ..Self::default() }
    }

    /// Adds JVL's registers, each given by its number and its entry: motor registers from 0x0000 on, module registers
    /// from 0x8000 on, and these again from 0x0300 on while `mirror` is set.
    #[must_use]
    pub fn with_jvl(
        mut self,
        schema: &Schema,
        motor: impl IntoIterator<Item = (u8, Slot)>,
        module: impl IntoIterator<Item = (u8, Slot)>,
        mirror: Option<Flag>,
    ) -> Self {
        let motor = registers(schema, motor, JVL_MOTOR_REGISTERS, self.order);
        let module = registers(schema, module, JVL_MODULE_REGISTERS, self.order);
        self.add(0, Style::Jvl, None, motor);
        if mirror.is_some() {
            self.add(JVL_MIRROR, Style::Jvl, mirror, module.clone());
        }
        self.add(JVL_MODULE, Style::Jvl, None, module);
        self
    }

    /// Adds every entry of `schema` that has a fixed length and is no local one, in the order of the addresses: from 0x1000 on, each in as
    /// many registers as it needs, and at an even address if these are more than one. Coils and discrete inputs are
    /// the bits of the outputs and inputs given, 32 of each.
    #[must_use]
    pub fn with_application(mut self, schema: &Schema, outputs: &[Slot], inputs: &[Slot]) -> Self {
        let room = usize::from(APPLICATION_LAST - APPLICATION) + 1;
        let mut words = Vec::new();
        for (address, entry) in schema.entries() {
            let (Some(slot), Some(bits)) = (schema.slot(address), entry.data_type.bits()) else { continue };
            if entry.is_local {
                continue;
            }
            let count = bits.div_ceil(16);
            let pad = usize::from(count > 1 && words.len() % 2 == 1);
            if words.len() + pad + usize::from(count) > room {
                self.left_out += 1;
                continue;
            }
            words.extend(core::iter::repeat_n(None, pad));
            words.extend(Word::all(slot, entry.data_type, count, self.order).map(Some));
        }
        self.add(APPLICATION, Style::Exact, None, words);
        self.coils.extend(outputs);
        self.inputs.extend(inputs);
        self
    }

    fn add(&mut self, first: u16, style: Style, only_if: Option<Flag>, words: Vec<Option<Word>>) {
        self.regions.push(Region { first, style, only_if, words });
    }

    /// Functions and limits of the unit.
    #[must_use]
    pub fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// Entries of the application that found no room.
    #[must_use]
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// Every entry that has registers, in the order of the registers; mirrored ones are not repeated.
    pub fn listing(&self) -> impl Iterator<Item = Listed> {
        let regions = self.regions.iter().filter(|region| region.only_if.is_none());
        regions.flat_map(|region| {
            (region.first..).zip(&region.words).filter_map(|(first, word)| {
                let Word { slot, count, .. } = (*word)?;
                word.is_some_and(|word| word.index == 0).then_some(Listed { first, count, slot })
            })
        })
    }

    /// The registers that stand for `slot`: the first, and how many.
    pub(crate) fn registers_of(&self, slot: Slot) -> impl Iterator<Item = (u16, usize)> {
        self.listing().filter(move |listed| listed.slot == slot).map(|l| (l.first, usize::from(l.count)))
    }

    /// The `quantity` registers from `start` on, if all are there.
    pub(crate) fn window(&self, dictionary: &Dictionary, start: u16, quantity: u16) -> Option<Window<'_>> {
        self.regions.iter().find_map(|region| {
            let from = usize::from(start.checked_sub(region.first)?);
            let words = region.words.get(from..from + usize::from(quantity))?;
            let is_there =
                region.only_if.is_none_or(|flag| dictionary.raw(flag.slot) >> (flag.bit & 63) & 1 == 1);
            is_there.then_some(Window { words, is_exact: region.style == Style::Exact })
        })
    }

    /// The value whose registers hold `words`, as they stand on the wire.
    pub(crate) fn joined(&self, words: &[[u8; 2]]) -> u64 {
        let join = |value, word: &[u8; 2]| value << 16 | u64::from(u16::from_be_bytes(*word));
        match self.order {
            WordOrder::LowFirst => words.iter().rfold(0, join),
            WordOrder::HighFirst => words.iter().fold(0, join),
        }
    }

    /// The coils `bits`, which must all be there.
    pub(crate) fn coils(&self, bits: &RangeInclusive<usize>) -> Option<&[Slot]> {
        covered(&self.coils, bits)
    }

    /// The discrete inputs `bits`, which must all be there.
    pub(crate) fn inputs(&self, bits: &RangeInclusive<usize>) -> Option<&[Slot]> {
        covered(&self.inputs, bits)
    }
}

/// Coils and discrete inputs that one entry holds.
pub(crate) const BITS_OF_A_SLOT: usize = 32;

fn covered<'s>(slots: &'s [Slot], bits: &RangeInclusive<usize>) -> Option<&'s [Slot]> {
    (*bits.end() < slots.len() * BITS_OF_A_SLOT).then_some(slots)
}

/// Registers 0 to `last`, two words each; those that are not given are reserved.
fn registers(
    schema: &Schema,
    given: impl IntoIterator<Item = (u8, Slot)>,
    last: u8,
    order: WordOrder,
) -> Vec<Option<Word>> {
    let mut words = vec![None; 2 * (usize::from(last) + 1)];
    for (number, slot) in given {
        let Some(data_type) = schema.entry(slot).map(|entry| entry.data_type) else { continue };
        let place = words.get_mut(2 * usize::from(number)..2 * usize::from(number) + 2);
        let value = Word::all(slot, data_type, 2, order);
        place.into_iter().flatten().zip(value).for_each(|(place, word)| *place = Some(word));
    }
    words
}
