//! MAC00_1: the inputs in bits, for the hardware-input functions (JVL Ethernet manual, register 106).

use axis::Voltage;
use bitflags::bitflags;

bitflags! {
    /// The inputs that a simulated motor has.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(super) struct Inputs: u32 {
        /// The analogue input, or the sensor at it.
        const ANALOG = 1 << 8;
        /// The same before it is conditioned.
        const ANALOG_1 = 1 << 9;
    }
}

/// An analogue input is high above this.
const HIGH: Voltage = Voltage(5.0);

/// Whether the analogue input counts as high: by its voltage, or because the sensor at it is actuated.
pub(super) fn is_high(voltage: Voltage, is_home: bool) -> bool {
    voltage > HIGH || is_home
}

/// MAC00_1: inputs of the module in bits 0 to 5, the analogue one above, those turned that `inverted` says.
pub(super) fn word(module: u8, is_high: bool, inverted: i32) -> u32 {
    let mut analog = Inputs::empty();
    analog.set(Inputs::ANALOG | Inputs::ANALOG_1, is_high);
    let inverted = inverted.cast_unsigned() & 0xFFFF;
    (u32::from(module) | analog.bits()) ^ inverted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_input_has_its_bit_and_can_be_turned() {
        assert_eq!(word(0b11_0001, true, 0), 0x331);
        assert_eq!(word(0b0000_0001, false, 0x0003), 0b10);
        assert_eq!(word(0, false, -1), 0xFFFF);
        assert!(!is_high(Voltage(5.0), false) && is_high(Voltage(5.1), false) && is_high(Voltage(0.0), true));
    }
}
