//! A stepper motor: its rotor is pulled to where the steps have been counted to.

use super::{Plant, within};
use crate::units::{Position, Torque, cut, rounded};

/// What a stepper motor is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepperConfig {
    /// Full steps per revolution, such as 200.
    pub full_steps_per_revolution: u32,
    /// Steps at the input that make one full step.
    pub microsteps: u32,
    /// Encoder counts per revolution, as those of the plant.
    pub counts_per_revolution: u32,
    /// Highest torque with which it holds its place.
    pub holding_torque: Torque,
    /// How far the field leads a rotor that is slower than it, in seconds of the difference of speed, at most a full
    /// step: the damping by the electronics. Zero is none.
    pub damping_seconds: f64,
}

impl Default for StepperConfig {
    /// 200 full steps of 16 microsteps on the default plant, holding with its rated torque.
    fn default() -> Self {
        Self {
            full_steps_per_revolution: 200,
            microsteps: 16,
            counts_per_revolution: 8192,
            holding_torque: Torque(1000.0),
            damping_seconds: 0.0,
        }
    }
}

/// Turns a count of steps into the torque for [`Plant::step`].
///
/// The torque grows with the distance between rotor and step up to one full step, falls to nothing at two
/// and then pulls to the other side: a rotor that is two full steps behind slips, and settles a multiple of
/// four off.
#[derive(Clone, Debug)]
pub struct Stepper {
    full_steps_per_count: f64,
    full_steps_per_microstep: f64,
    holding_torque: f64,
    damping_seconds: f64,
    /// Where the rotor stands at step 0, in counts.
    origin: f64,
}

impl Stepper {
    /// Full steps after which the torque repeats itself.
    const PERIOD: f64 = 4.0;

    /// A stepper that is at step 0 with its rotor at `origin`.
    #[must_use]
    pub fn new(config: StepperConfig, origin: Position) -> Self {
        let number = |given: u32| f64::from(given.max(1));
        Self {
            full_steps_per_count: number(config.full_steps_per_revolution)
                / number(config.counts_per_revolution),
            full_steps_per_microstep: 1.0 / number(config.microsteps),
            holding_torque: within(config.holding_torque.0, 0.0, 1e6, 0.0),
            damping_seconds: within(config.damping_seconds, 0.0, 1.0, 0.0),
            origin: within(origin.0, -1e15, 1e15, 0.0),
        }
    }

    /// The torque on the rotor after `steps` (micro)steps in positive direction, put out at `rate` steps/s; none for
    /// what is not finite.
    #[must_use]
    pub fn torque(&self, steps: f64, rate: f64, plant: &Plant) -> Torque {
        let rotor = (plant.motor_position().0 - self.origin) * self.full_steps_per_count;
        let slip =
            rate * self.full_steps_per_microstep - plant.motor_velocity().0 * self.full_steps_per_count;
        let ahead = steps * self.full_steps_per_microstep - rotor + cut(slip * self.damping_seconds, 1.0);
        if !ahead.is_finite() {
            return Torque(0.0);
        }
        Torque(self.holding_torque * triangle(ahead / Self::PERIOD))
    }

    /// The place of the rotor after so many steps, when none is lost.
    #[must_use]
    pub fn place(&self, steps: f64) -> Position {
        Position(self.origin + steps * self.full_steps_per_microstep / self.full_steps_per_count)
    }
}

/// The sine of a triangle: period 1, from 0 up to 1 at a quarter, down to -1 at three quarters.
fn triangle(phase: f64) -> f64 {
    let phase = phase - rounded(phase);
    let rising = 4.0 * phase;
    rising.min(2.0 - rising).max(-2.0 - rising)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Load, PlantConfig};
    use crate::units::Velocity;

    const STEP: f64 = 125e-6;
    /// Counts per microstep and per four full steps.
    const MICROSTEP: f64 = 8192.0 / 3200.0;
    const SLIP: f64 = 8192.0 / 50.0;

    fn motor(gravity_nm: f64) -> (Stepper, Plant) {
        let load = Load { gravity_nm, ..Load::default() };
        let config =
            PlantConfig { load, viscous_friction_nms: 5e-3, start: Position(70.0), ..PlantConfig::default() };
        (Stepper::new(StepperConfig::default(), Position(70.0)), Plant::new(config))
    }

    /// Steps at `rate` microsteps/s for `seconds`, then waits a second.
    fn turn(stepper: &Stepper, plant: &mut Plant, rate: f64, seconds: f64) -> f64 {
        let mut steps = 0.0;
        let mut time = 0.0;
        while time < seconds + 1.0 {
            time += STEP;
            steps = (time.min(seconds) * rate).floor();
            plant.step(stepper.torque(steps, 0.0, plant), STEP);
        }
        steps
    }

    #[test]
    fn the_torque_is_a_triangle_over_four_full_steps() {
        let table =
            [(0.0, 0.0), (0.125, 0.5), (0.25, 1.0), (0.375, 0.5), (0.5, 0.0), (0.75, -1.0), (1.25, 1.0)];
        for (phase, height) in table {
            assert!((triangle(phase) - height).abs() < 1e-12, "{phase}");
            assert!((triangle(-phase) + height).abs() < 1e-12, "-{phase}");
        }
    }

    #[test]
    fn the_rotor_follows_every_step_it_can() {
        let (stepper, mut plant) = motor(0.0);
        let steps = turn(&stepper, &mut plant, 2000.0, 2.0);
        let error = plant.motor_position() - stepper.place(steps);
        assert!(steps >= 3999.0 && error.abs() <= Position(1.0), "{error:?}");
        assert!((stepper.place(steps).0 - 70.0 - steps * MICROSTEP).abs() < 1e-6);
    }

    #[test]
    fn damping_brings_the_rotor_to_rest() {
        let ringing = |damping_seconds: f64| {
            let config = StepperConfig { damping_seconds, ..StepperConfig::default() };
            let quiet =
                PlantConfig { viscous_friction_nms: 0.0, coulomb_friction_nm: 0.0, ..PlantConfig::default() };
            let (stepper, mut plant) = (Stepper::new(config, Position(0.0)), Plant::new(quiet));
            for _ in 0..1600 {
                plant.step(stepper.torque(8.0, 0.0, &plant), STEP);
            }
            (plant.motor_position() - stepper.place(8.0)).abs().0 + plant.motor_velocity().abs().0 / 100.0
        };
        assert!(ringing(2e-3) < 0.1, "{}", ringing(2e-3));
        assert!(ringing(0.0) > 10.0, "{}", ringing(0.0));
    }

    #[test]
    fn a_load_bends_it_and_a_heavier_one_turns_it() {
        let (stepper, mut plant) = motor(-0.635);
        turn(&stepper, &mut plant, 0.0, 0.0);
        let bent = 70.0 - plant.motor_position().0;
        assert!((bent - SLIP / 8.0).abs() < 2.0, "{bent}");
        plant.set_load(Load { gravity_nm: -1.4, ..Load::default() });
        turn(&stepper, &mut plant, 0.0, 0.0);
        assert!(plant.motor_position() < Position(70.0 - 2.0 * SLIP));
    }

    #[test]
    fn a_rotor_stepped_too_fast_loses_steps_by_fours() {
        let (stepper, mut plant) = motor(0.0);
        let steps = turn(&stepper, &mut plant, 400_000.0, 0.1);
        let lost = (stepper.place(steps) - plant.motor_position()).0 / SLIP;
        assert_eq!(plant.velocity(), Velocity(0.0));
        assert!(lost.abs() > 0.5 && (lost - lost.round()).abs() < 0.05, "{lost}");
    }
}
