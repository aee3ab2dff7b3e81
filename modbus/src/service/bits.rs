//! Coils and discrete inputs: function codes 1, 2, 5 and 15.

use core::ops::RangeInclusive;

use od::{Dictionary, Slot};

use super::{Outcome, Service};
use crate::map::BITS_OF_A_SLOT;
use crate::{Bits, Exception};

/// What function code 5 calls on (section 6.5).
const ON: u16 = 0xFF00;

impl Service<'_, '_> {
    pub(super) fn read_bits(&mut self, table: Bits, start: u16, quantity: u16) -> Outcome {
        let bits = covered(start, quantity);
        let map = self.target.map;
        let slots = match table {
            Bits::Coils => map.coils(&bits),
            Bits::DiscreteInputs => map.inputs(&bits),
        };
        let slots = slots.ok_or(Exception::IllegalDataAddress)?;
        self.answer.push(quantity.div_ceil(8) as u8);
        for first in bits.clone().step_by(8) {
            let last = (first + 7).min(*bits.end());
            let byte = (first..=last)
                .rev()
                .fold(0, |byte, bit| byte << 1 | u8::from(bit_of(self.target.dictionary, slots, bit)));
            self.answer.push(byte);
        }
        Ok(())
    }

    pub(super) fn write_coil(&mut self, address: u16, on: bool) -> Outcome {
        self.switch(address, 1, &[u8::from(on)])?;
        self.say(&[address, if on { ON } else { 0 }]);
        Ok(())
    }

    pub(super) fn write_coils(&mut self, start: u16, quantity: u16, states: &[u8]) -> Outcome {
        self.switch(start, quantity, states)?;
        self.say(&[start, quantity]);
        Ok(())
    }

    /// Gives `quantity` coils from `start` on the states given, lowest bit first; the others stay.
    fn switch(&mut self, start: u16, quantity: u16, states: &[u8]) -> Outcome {
        let bits = covered(start, quantity);
        let slots = self.target.map.coils(&bits).ok_or(Exception::IllegalDataAddress)?;
        for (number, slot) in slots.iter().enumerate() {
            let first = number * BITS_OF_A_SLOT;
            let own = first.max(*bits.start())..=(first + BITS_OF_A_SLOT - 1).min(*bits.end());
            if own.is_empty() {
                continue;
            }
            let value = own.fold(self.target.dictionary.raw(*slot), |value, bit| {
                let mask = 1 << (bit - first);
                let is_on = od::bits::get(states, bit - bits.start(), 1) == 1;
                if is_on { value | mask } else { value & !mask }
            });
            self.check_permission(*slot, Some(value))?;
            self.collect(*slot, value);
        }
        self.commit()
    }
}

/// The numbers of `quantity` bits, of which there is at least one.
fn covered(start: u16, quantity: u16) -> RangeInclusive<usize> {
    usize::from(start)..=usize::from(start) + usize::from(quantity) - 1
}

fn bit_of(dictionary: &Dictionary, slots: &[Slot], bit: usize) -> bool {
    let slot = slots.get(bit / BITS_OF_A_SLOT);
    slot.is_some_and(|slot| dictionary.raw(*slot) >> (bit % BITS_OF_A_SLOT) & 1 == 1)
}
