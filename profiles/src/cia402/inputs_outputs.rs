//! Digital inputs and outputs (IEC 61800-7-201, 0x60FD and 0x60FE).

use axis::Switches;
use bitflags::bitflags;

use crate::Binding;
use crate::slots::Parameters;

bitflags! {
    /// 0x60FD; the manufacturer's inputs begin at bit 16.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    struct DigitalInputs: u32 {
        /// Negative limit switch.
        const NEGATIVE_LIMIT = 1 << 0;
        /// Positive limit switch.
        const POSITIVE_LIMIT = 1 << 1;
        /// Home switch.
        const HOME = 1 << 2;
        /// Interlock: the emergency stop.
        const INTERLOCK = 1 << 3;
        /// First general input, that of touch probe 1.
        const PROBE_1 = 1 << 16;
        /// Second general input, that of touch probe 2.
        const PROBE_2 = 1 << 17;
    }
}

/// 0x60FD: which inputs are active.
pub(crate) fn digital_inputs(switches: Switches) -> u32 {
    let mut bits = DigitalInputs::empty();
    bits.set(DigitalInputs::NEGATIVE_LIMIT, switches.negative_limit);
    bits.set(DigitalInputs::POSITIVE_LIMIT, switches.positive_limit);
    bits.set(DigitalInputs::HOME, switches.home);
    bits.set(DigitalInputs::INTERLOCK, switches.emergency_stop);
    bits.set(DigitalInputs::PROBE_1, switches.probe_1);
    bits.set(DigitalInputs::PROBE_2, switches.probe_2);
    bits.bits()
}

/// What the outputs give: 0x60FE:1 where the mask 0x60FE:2 lets it through. Bit 0 would set the brake.
pub(crate) fn digital_outputs(parameters: Parameters<'_>) -> u32 {
    let mask = parameters.or(Binding::DigitalOutputsMask, 0);
    (parameters.or(Binding::DigitalOutputs, 0) & mask) as u32
}
