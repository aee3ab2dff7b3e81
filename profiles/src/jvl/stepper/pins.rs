//! The eight inputs and outputs of a MIS stepper: IOSETUP, the masks, INPUTS and OUTPUTS (JVL Ethernet manual, section
//! 11.4, registers 18, 19, 89 to 96, 125 and 129 to 138).
//!
//! The switches of the plant are wired to the inputs that the masks name, so that a program finds its sensors where it
//! looks for them; the two general inputs are the first pins that are left. A bit of IOSETUP that is set means active
//! low, or an output (our reading: the manual calls the bits active level and output enable).

use axis::{Level, Levels, Voltage};

use super::Sample;
use super::units;
use crate::Role;
use crate::jvl::levels;

/// How many there are.
const PINS: usize = 8;

/// The inputs as the filter sees them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pins {
    /// Active inputs after the filter, in bits.
    shown: u8,
    /// Active inputs of the last sample.
    seen: u8,
    /// For how long each has been as it is, in seconds.
    stable: [f64; PINS],
}

impl Pins {
    /// Follows the inputs for one sample.
    pub(super) fn step(&mut self, sample: &Sample<'_, '_>) {
        let now = active_inputs(sample);
        let filtered = sample.register(Role::InputFilterMask) as u8;
        let needed = f64::from(sample.register(Role::InputFilterCnt).max(0)) / 1000.0;
        for (pin, stable) in self.stable.iter_mut().enumerate() {
            let bit = 1 << pin;
            *stable = if (now ^ self.seen) & bit == 0 { *stable + sample.raster() } else { 0.0 };
            if filtered & bit == 0 || *stable >= needed {
                self.shown = self.shown & !bit | now & bit;
            }
        }
        self.seen = now;
    }

    /// INPUTS.
    pub(super) fn inputs(&self) -> u8 {
        self.shown
    }
}

/// What IOSETUP and the masks make of the pins.
struct Wiring {
    active_low: u8,
    outputs: u8,
    negative_limit: u8,
    positive_limit: u8,
    home: u8,
    general: [u8; 2],
}

impl Wiring {
    fn of(sample: &Sample<'_, '_>) -> Self {
        let setup = sample.register(Role::IoSetup);
        let [active_low, outputs, ..] = setup.to_le_bytes();
        let mask = |role| sample.register(role) as u8 & !outputs;
        let [negative, positive] = [mask(Role::NlMask), mask(Role::PlMask)];
        let home = mask(Role::HomeMask);
        let mut free = !(outputs | negative | positive | home);
        let mut next = || {
            let pin = lowest(free);
            free &= !pin;
            pin
        };
        let general = [next(), next()];
        // A motor that turns the other way round meets the other switch first.
        let (negative_limit, positive_limit) =
            if sample.is_reversed() { (positive, negative) } else { (negative, positive) };
        Self { active_low, outputs, negative_limit, positive_limit, home, general }
    }

    /// How the axis reads the signal at these pins; the lowest one counts.
    fn level(&self, pins: u8) -> Level {
        match lowest(pins) {
            0 => Level::Unused,
            pin if self.active_low & pin != 0 => Level::Low,
            _ => Level::High,
        }
    }

    /// The signals at the inputs, in bits that are high.
    fn high(&self, sample: &Sample<'_, '_>) -> u8 {
        let inputs = sample.axis().status().inputs;
        let [first, second] = self.general;
        let pins = [
            (self.negative_limit, inputs.negative_limit),
            (self.positive_limit, inputs.positive_limit),
            (self.home, inputs.home),
            (first, inputs.probe_1),
            (second, inputs.probe_2),
        ];
        pins.into_iter().filter(|(_, is_high)| *is_high).fold(0, |high, (pin, _)| high | pin)
    }
}

/// The lowest of these pins.
const fn lowest(pins: u8) -> u8 {
    pins & pins.wrapping_neg()
}

/// The inputs that are active.
fn active_inputs(sample: &Sample<'_, '_>) -> u8 {
    let wiring = Wiring::of(sample);
    (wiring.high(sample) ^ wiring.active_low) & !wiring.outputs
}

/// What the axis makes of its inputs: what the masks name, beside what the module says (0x2011:07).
pub(super) fn axis_levels(sample: &Sample<'_, '_>) -> Levels {
    let wiring = Wiring::of(sample);
    let module = levels(sample.scope.parameters());
    let or = |pins, otherwise| match wiring.level(pins) {
        Level::Unused => otherwise,
        level @ (Level::High | Level::Low) => level,
    };
    let [first, second] = wiring.general;
    Levels {
        negative_limit: or(wiring.negative_limit, module.negative_limit),
        positive_limit: or(wiring.positive_limit, module.positive_limit),
        home: wiring.level(wiring.home),
        probe_1: or(first, module.probe_1),
        probe_2: or(second, module.probe_2),
        ..module
    }
}

/// What the outputs give: OUTPUTS and 0x60FE, but where a mask names one for "in position" or "error". In bits that are
/// high.
pub(super) fn outputs(is_in_position: bool, has_error: bool, standard: u32, sample: &Sample<'_, '_>) -> u8 {
    let wiring = Wiring::of(sample);
    let mut active = sample.register(Role::Outputs) as u8 | standard as u8;
    for (role, is_active) in [(Role::InposMask, is_in_position), (Role::ErrorMask, has_error)] {
        let pins = sample.register(role) as u8;
        active = if is_active { active | pins } else { active & !pins };
    }
    (active ^ wiring.active_low) & wiring.outputs
}

/// The voltage at each pin as its analogue input has it: the first has the analogue signal of the plant on top, a pin
/// that is high is beyond the range.
pub(super) fn analog_inputs(sample: &Sample<'_, '_>) -> [i32; PINS] {
    const HIGH: Voltage = Voltage(24.0);
    let high = Wiring::of(sample).high(sample);
    let mut voltages = [Voltage(0.0); PINS];
    for (pin, voltage) in voltages.iter_mut().enumerate() {
        if high >> pin & 1 == 1 {
            *voltage = HIGH;
        }
    }
    let [first, ..] = &mut voltages;
    first.0 = first.0.max(sample.scope.analog_input.0);
    voltages.map(units::analog)
}
