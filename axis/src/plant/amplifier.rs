//! A servo amplifier with an analogue ±10 V input.

use super::{Plant, within};
use crate::units::{Torque, Velocity, Voltage, cut};

/// What 10 V at the input of an amplifier ask for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AmplifierMode {
    /// A velocity, held by a PI controller.
    Velocity {
        /// Velocity at 10 V.
        full_scale: Velocity,
        /// How long the motor takes to follow, in seconds: 0.5 ms to 1000 s.
        time_constant_seconds: f64,
    },
    /// A torque.
    Torque {
        /// Torque at 10 V.
        full_scale: Torque,
    },
}

/// What an amplifier is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmplifierConfig {
    /// What the input means.
    pub mode: AmplifierMode,
    /// Highest torque in either direction.
    pub peak: Torque,
}

/// Turns a voltage into the torque for [`Plant::step`].
#[derive(Clone, Debug)]
pub struct Amplifier {
    mode: AmplifierMode,
    peak: f64,
    /// Acceleration the integral part adds, in counts/s².
    integral: f64,
}

impl Amplifier {
    /// The input cannot be higher, in volts.
    const FULL_SCALE: f64 = 10.0;
    /// Shortest time constant: four steps of 125 µs.
    const FASTEST: f64 = 0.5e-3;
    /// Time of the integral part, in time constants.
    const INTEGRAL_TIME: f64 = 4.0;

    /// An amplifier that has not integrated anything yet. What makes no sense counts as zero.
    #[must_use]
    pub fn new(config: AmplifierConfig) -> Self {
        let mode = match config.mode {
            AmplifierMode::Velocity { full_scale, time_constant_seconds: seconds } => {
                AmplifierMode::Velocity {
                    full_scale: Velocity(within(full_scale.0, -1e12, 1e12, 0.0)),
                    time_constant_seconds: within(seconds, Self::FASTEST, 1e3, Self::FASTEST),
                }
            }
            AmplifierMode::Torque { full_scale } => {
                AmplifierMode::Torque { full_scale: Torque(within(full_scale.0, -1e6, 1e6, 0.0)) }
            }
        };
        Self { mode, peak: within(config.peak.0, 0.0, 1e6, 0.0), integral: 0.0 }
    }

    /// The torque for the next `seconds` at `input`, which is cut to ±10 V; what is not a number is 0 V.
    pub fn torque(&mut self, input: Voltage, plant: &Plant, seconds: f64) -> Torque {
        let volts = if input.0.is_nan() { 0.0 } else { cut(input.0, Self::FULL_SCALE) };
        let share = volts / Self::FULL_SCALE;
        match self.mode {
            AmplifierMode::Torque { full_scale } => self.limited(Torque(share * full_scale.0)),
            AmplifierMode::Velocity { full_scale, time_constant_seconds } => {
                self.follow(share * full_scale.0, time_constant_seconds, plant, seconds)
            }
        }
    }

    fn follow(&mut self, wanted: f64, time_constant: f64, plant: &Plant, seconds: f64) -> Torque {
        let proportional = (wanted - plant.velocity().0) / time_constant;
        let integral = self.integral + proportional * seconds / (Self::INTEGRAL_TIME * time_constant);
        let torque = plant.torque_for(proportional + integral, wanted);
        let limited = self.limited(torque);
        if torque == limited {
            self.integral = integral;
        }
        limited
    }

    fn limited(&self, torque: Torque) -> Torque {
        Torque(cut(torque.0, self.peak))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Load, PlantConfig};

    const STEP: f64 = 125e-6;

    fn velocity_amplifier(seconds: f64) -> Amplifier {
        let mode =
            AmplifierMode::Velocity { full_scale: Velocity(200_000.0), time_constant_seconds: seconds };
        Amplifier::new(AmplifierConfig { mode, peak: Torque(3000.0) })
    }

    fn run(amplifier: &mut Amplifier, plant: &mut Plant, volts: f64, steps: u32) -> f64 {
        let mut highest = 0.0_f64;
        for _ in 0..steps {
            let torque = amplifier.torque(Voltage(volts), plant, STEP);
            plant.step(torque, STEP);
            highest = highest.max(plant.velocity().0.abs());
        }
        highest
    }

    #[test]
    fn a_voltage_is_a_velocity_whatever_the_load() {
        for (inertia_kgm2, gravity_nm) in [(0.0, 0.0), (1e-4, 0.5), (3e-4, -0.5)] {
            let load = Load { inertia_kgm2, gravity_nm, ..Load::default() };
            let mut plant = Plant::new(PlantConfig { load, ..PlantConfig::default() });
            let mut amplifier = velocity_amplifier(2e-3);
            let highest = run(&mut amplifier, &mut plant, 5.0, 8000);
            assert!((plant.velocity().0 - 100_000.0).abs() < 1.0, "{:?}", plant.velocity());
            assert!(highest < 130_000.0, "{highest}");
            run(&mut amplifier, &mut plant, -20.0, 8000);
            assert!((plant.velocity().0 + 200_000.0).abs() < 1.0, "{:?}", plant.velocity());
        }
    }

    #[test]
    fn a_voltage_is_a_torque_up_to_the_peak() {
        let mode = AmplifierMode::Torque { full_scale: Torque(2000.0) };
        let plant = Plant::new(PlantConfig::default());
        let mut amplifier = Amplifier::new(AmplifierConfig { mode, peak: Torque(1500.0) });
        let mut at = |volts| amplifier.torque(Voltage(volts), &plant, STEP);
        assert_eq!([at(-5.0), at(7.5), at(10.0)], [Torque(-1000.0), Torque(1500.0), Torque(1500.0)]);
        assert_eq!(at(f64::NAN), Torque(0.0));
    }

    #[test]
    fn no_configuration_makes_a_torque_that_is_no_number() {
        for value in [f64::NAN, f64::INFINITY, -1.0, f64::MAX] {
            let mode = AmplifierMode::Velocity { full_scale: Velocity(value), time_constant_seconds: value };
            let mut amplifier = Amplifier::new(AmplifierConfig { mode, peak: Torque(value) });
            let mut plant = Plant::new(PlantConfig::default());
            run(&mut amplifier, &mut plant, 10.0, 1000);
            assert!(plant.velocity().0.is_finite(), "{value}");
        }
    }
}
