//! Where the instructions of an axis and the objects of the card stand in the dictionary.

use od::{Address, Dictionary, Schema, Slot};

use super::Instruction;

/// The records of the first axis: what every card has, position controller, SSI, stepper. Those of the other axes
/// follow each.
const RECORDS: [u16; 4] = [0x2100, 0x2110, 0x2120, 0x2130];

/// Bits 1, 3, 5 and 7 stop an axis each (table 3.2).
pub(super) const STOP: Address = Address::new(0x2180, 1);
/// The overall status.
pub(super) const OVERALL: Address = Address::new(0x2180, 2);
/// A message of the host: number of the axis, from 0 on, instruction code, parameter (section 3.4).
pub(super) const MESSAGE_AXIS: Address = Address::new(0x2181, 1);
pub(super) const MESSAGE_CODE: Address = Address::new(0x2181, 2);
pub(super) const MESSAGE_PARAMETER: Address = Address::new(0x2181, 3);
/// The response to it, and how many there were.
pub(super) const RESPONSE_AXIS: Address = Address::new(0x2182, 1);
pub(super) const RESPONSE_CODE: Address = Address::new(0x2182, 2);
pub(super) const RESPONSE_PARAMETER: Address = Address::new(0x2182, 3);
pub(super) const RESPONSE_COUNT: Address = Address::new(0x2182, 4);

/// The axis and the instruction whose entry this is.
pub(super) fn of_address(address: Address) -> Option<(u8, Instruction)> {
    const MOST_AXES: u16 = 8;
    let axis = RECORDS.iter().find_map(|first| {
        let axis = address.index.checked_sub(*first)?;
        (axis < MOST_AXES).then_some(axis)
    })?;
    Some((u8::try_from(axis).ok()?, Instruction::from_code(address.sub.into())?))
}

/// The entry of an instruction, if the device has it.
pub(super) fn slot(schema: &Schema, axis: u8, instruction: Instruction) -> Option<Slot> {
    let place = |first: &u16| schema.slot(Address::new(first + u16::from(axis), instruction as u8));
    RECORDS.iter().find_map(place)
}

/// The instructions of one axis.
#[derive(Debug)]
pub(crate) struct Record {
    axis: u8,
    slots: Vec<Option<Slot>>,
}

impl Record {
    pub(super) fn new(schema: &Schema, axis: u8) -> Self {
        Self {
            axis,
            slots: Instruction::ALL.iter().map(|instruction| slot(schema, axis, *instruction)).collect(),
        }
    }

    /// The entry of an instruction, if this card has it.
    pub(super) fn slot(&self, instruction: Instruction) -> Option<Slot> {
        let position = Instruction::ALL.binary_search(&instruction).ok()?;
        self.slots.get(position).copied().flatten()
    }

    /// The instruction at `slot`.
    pub(super) fn instruction(&self, slot: Slot) -> Option<Instruction> {
        let position = self.slots.iter().position(|known| *known == Some(slot))?;
        Instruction::ALL.get(position).copied()
    }

    /// The value of an instruction, zero if this card does not have it.
    pub(crate) fn get(&self, dictionary: &Dictionary, instruction: Instruction) -> i64 {
        // No entry is wider than 32 bits.
        self.slot(instruction).map_or(0, |slot| dictionary.integer(slot) as i64)
    }

    /// Shows a value, if this card has the instruction.
    pub(crate) fn show(&self, dictionary: &mut Dictionary, instruction: Instruction, value: i64) {
        if let Some(slot) = self.slot(instruction) {
            dictionary.set(slot, value.cast_unsigned());
        }
    }

    /// Gives every instruction its power-on value again.
    pub(super) fn reset(&self, dictionary: &mut Dictionary) {
        let own = RECORDS.map(|first| first + u16::from(self.axis));
        dictionary.restart(|index| own.contains(&index));
    }
}

/// The values of one axis, for those who have nothing but an entry of it.
#[derive(Clone, Copy)]
pub(super) struct Look<'a> {
    dictionary: &'a Dictionary,
    pub(super) axis: u8,
}

impl<'a> Look<'a> {
    /// The axis of the entry at `slot`, and its instruction.
    pub(super) fn at(dictionary: &'a Dictionary, slot: Slot) -> Option<(Self, Instruction)> {
        let (axis, instruction) = of_address(dictionary.schema().address(slot)?)?;
        Some((Self { dictionary, axis }, instruction))
    }

    pub(super) fn of_axis(dictionary: &'a Dictionary, axis: u8) -> Self {
        Self { dictionary, axis }
    }

    pub(super) fn get(&self, instruction: Instruction) -> i64 {
        let slot = slot(self.dictionary.schema(), self.axis, instruction);
        slot.map_or(0, |slot| self.dictionary.integer(slot) as i64)
    }

    pub(super) fn has(&self, instruction: Instruction) -> bool {
        slot(self.dictionary.schema(), self.axis, instruction).is_some()
    }

    pub(super) fn at_address(&self, address: Address) -> i64 {
        integer(self.dictionary, address)
    }
}

/// The integer at an address, zero if there is none.
pub(super) fn integer(dictionary: &Dictionary, address: Address) -> i64 {
    dictionary.find(address).map_or(0, |slot| dictionary.integer(slot) as i64)
}

/// Shows a value at an address, if there is one.
pub(super) fn show(dictionary: &mut Dictionary, address: Address, value: i64) {
    if let Ok(slot) = dictionary.find(address) {
        dictionary.set(slot, value.cast_unsigned());
    }
}
