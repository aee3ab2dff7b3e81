//! The inputs of a module: levels, limit switches, the analogue one (module manual, sections 4.3.5, 4.3.10 and 4.3.11).

use axis::{Level, Levels, Voltage};
use bitflags::bitflags;

use crate::Binding;
use crate::slots::Parameters;

bitflags! {
    /// The inputs as 0x2011:01, :06 and :07 number them.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    struct Inputs: u8 {
        const IN1 = 1 << 0;
        const IN2 = 1 << 1;
        const NL = 1 << 4;
        const PL = 1 << 5;
    }
}

/// 0x2011:01: which inputs are active, by 0x2011:06; IN1 and IN2 are the general inputs of the axis.
pub(super) fn active(parameters: Parameters<'_>, levels: &axis::Inputs) -> u8 {
    let mut bits = Inputs::empty();
    let pins = [
        (Inputs::IN1, levels.probe_1),
        (Inputs::IN2, levels.probe_2),
        (Inputs::NL, levels.negative_limit),
        (Inputs::PL, levels.positive_limit),
    ];
    for (input, is_high) in pins {
        bits.set(input, level(parameters, input).reads(is_high));
    }
    bits.bits()
}

/// What the axis makes of its inputs: the limit switches act only where 0x2011:07 says so (module manual, section
/// 4.3.11).
pub(crate) fn levels(parameters: Parameters<'_>) -> Levels {
    let setup = Inputs::from_bits_truncate(parameters.or(Binding::JvlInputSetup, 0) as u8);
    let limit = |input| if setup.contains(input) { level(parameters, input) } else { Level::Unused };
    Levels {
        negative_limit: limit(Inputs::NL),
        positive_limit: limit(Inputs::PL),
        probe_1: level(parameters, Inputs::IN1),
        probe_2: level(parameters, Inputs::IN2),
        ..Levels::default()
    }
}

/// 0x2101: 1023 at 10 V (JVL Ethernet module manual, object 0x2101).
pub(super) fn analog(voltage: Voltage) -> i16 {
    (voltage.0 / 10.0 * 1023.0).round().clamp(-1023.0, 1023.0) as i16
}

/// The active level of an input, 0x2011:06.
fn level(parameters: Parameters<'_>, input: Inputs) -> Level {
    let highs = Inputs::from_bits_truncate(parameters.or(Binding::JvlInputLevel, 0x3F) as u8);
    if highs.contains(input) { Level::High } else { Level::Low }
}
