//! UIT: how hot the brake resistor is (JVL Ethernet manual, registers 18 and 19).
//!
//! The manual gives the limit and no model. Ours: the resistor takes the rated power of the motor for two seconds and
//! cools with a time constant of twenty.

use axis::Actual;

use crate::Motor;

/// The brake resistor.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BrakeResistor {
    /// Part of its capacity that is used up.
    used: f64,
}

/// How long it takes the rated power, in seconds.
const CAPACITY: f64 = 2.0;
/// In how long it cools to 37 %, in seconds.
const COOLING: f64 = 20.0;
/// Less than this is nothing: UIT shows zero.
const COLD: f64 = 1e-4;

impl BrakeResistor {
    /// The motor moves like this for `seconds`.
    pub(super) fn step(&mut self, actual: &Actual, motor: &Motor, seconds: f64) {
        let most = f64::from(motor.max_speed_rpm) / 60.0 * f64::from(motor.counts_per_revolution);
        // In multiples of the rated power; positive while it brakes.
        let power = -actual.torque.0 / 1000.0 * actual.velocity.0 / most;
        self.used += power.max(0.0) * seconds / CAPACITY;
        self.rest(seconds);
    }

    /// Nothing brakes for `seconds`.
    pub(super) fn rest(&mut self, seconds: f64) {
        self.used *= COOLING / (COOLING + seconds);
    }

    /// Whether it is still warm enough to show.
    pub(super) fn is_warm(&self) -> bool {
        self.used > COLD
    }

    /// Part of its capacity that is used up; 1 is the limit.
    pub(super) fn used(&self) -> f64 {
        self.used
    }
}

#[cfg(test)]
mod tests {
    use axis::{Position, Torque, Velocity};

    use super::*;

    fn motor() -> Motor {
        let profile = crate::Profile::embedded("jvl-mac00-fc4", Some("mac140")).unwrap().unwrap();
        profile.motor.unwrap()
    }

    fn braking(torque: f64) -> Actual {
        let velocity = Velocity(4000.0 / 60.0 * 4096.0);
        Actual { position: Position(0.0), velocity, torque: Torque(torque) }
    }

    #[test]
    fn rated_power_fills_it_in_two_seconds_and_driving_not_at_all() {
        let mut resistor = BrakeResistor::default();
        (0..1000).for_each(|_| resistor.step(&braking(1000.0), &motor(), 2e-3));
        assert!(resistor.used().abs() < 1e-9);
        (0..1050).for_each(|_| resistor.step(&braking(-1000.0), &motor(), 2e-3));
        assert!((resistor.used() - 1.0).abs() < 0.01, "{}", resistor.used());
        (0..10_000).for_each(|_| resistor.rest(2e-3));
        assert!((resistor.used() - (-1.0_f64).exp()).abs() < 0.01);
    }
}
