//! The units of the MIS steppers: steps, 0.01 RPM, RPM/s, 5.87 mA (JVL Ethernet manual, section 11.4). The only place
//! that converts them.
//!
//! What comes in becomes the double nearest to it. What is shown is rounded to the nearest whole unit, halves away from
//! zero. Positions wrap around at the ends of 32 bits, everything else saturates.

use axis::{Acceleration, Position, Temperature, Torque, Velocity, Voltage};

use crate::cia402::units::{from_rpm, whole};
use crate::{Motor, StepperMotor};

/// Velocities count hundredths of a revolution per minute.
const PER_RPM: f64 = 100.0;
/// Currents, in mA.
const CURRENT_MA: f64 = 5.87;
/// BUSVOL and MIN_BUSVOL, in V.
const BUS_VOLTS: f64 = 0.026_525;
/// The analogue inputs, in V.
const ANALOG_VOLTS: f64 = 0.001_221;
/// Highest number of a converter of 12 bits.
const FULL_SCALE: f64 = 4095.0;
/// TEMP, in degrees.
const DEGREES: f64 = 2.27;

/// The units of one motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StepUnits {
    /// Counts/s at one revolution per minute.
    counts_at_rpm: f64,
    /// 1, or -1 for a motor that is told to turn the other way round.
    sign: f64,
}

impl StepUnits {
    pub(super) fn new(motor: &Motor, is_reversed: bool) -> Self {
        let Velocity(counts_at_rpm) = from_rpm(1, motor.counts_per_revolution);
        Self { counts_at_rpm, sign: if is_reversed { -1.0 } else { 1.0 } }
    }

    /// The velocity that a register means.
    pub(super) fn velocity(&self, value: i32) -> Velocity {
        Velocity(self.sign * self.speed(value))
    }

    /// A velocity as V_IST has it.
    pub(super) fn shown_velocity(&self, velocity: Velocity) -> i32 {
        whole32(self.sign * velocity.0 / self.counts_at_rpm * PER_RPM)
    }

    /// The same whatever the direction, with the sign of the register.
    pub(super) fn speed(&self, value: i32) -> f64 {
        f64::from(value) / PER_RPM * self.counts_at_rpm
    }

    /// A_SOLL and its like: a magnitude, and one unit at least, so that what moves can stop.
    pub(super) fn acceleration(&self, value: i32) -> Acceleration {
        Acceleration(f64::from(value).abs().max(1.0) * self.counts_at_rpm)
    }

    /// The place on the axis that the number `value` of a counter of 32 bits means for one at `near`: the nearest one.
    pub(super) fn place(&self, value: i32, near: Position) -> Position {
        let near = Position(self.sign * near.0);
        Position(self.sign * (near.0.round() + f64::from(value.wrapping_sub(counter(near)))))
    }

    /// A place on the axis as that counter has it.
    pub(super) fn counter(&self, place: Position) -> i32 {
        counter(self.way(place))
    }

    /// A way on the axis as registers count it, or back.
    pub(super) fn way(&self, way: Position) -> Position {
        Position(self.sign * way.0)
    }
}

/// The torque of a current in a stepper's windings.
pub(super) fn torque(value: i32, stepper: &StepperMotor) -> Torque {
    let rated = f64::from(stepper.rated_current_ma);
    Torque(f64::from(value.max(0)) * CURRENT_MA / rated * 1000.0)
}

/// The current of a register in mA, as 0x2204 has it.
pub(super) fn milliamperes(value: i32) -> i64 {
    i64::from(whole32(f64::from(value.max(0)) * CURRENT_MA))
}

/// The register of a current in mA.
pub(super) fn current(milliamperes: i64) -> i32 {
    whole32(milliamperes as f64 / CURRENT_MA)
}

/// The supply as BUSVOL has it.
pub(super) fn bus_voltage(voltage: Voltage) -> i32 {
    whole32((voltage.0 / BUS_VOLTS).clamp(0.0, FULL_SCALE))
}

/// The supply that MIN_BUSVOL means.
pub(super) fn voltage(value: i32) -> Voltage {
    Voltage(f64::from(value) * BUS_VOLTS)
}

/// The voltage at an analogue input as its register has it.
pub(super) fn analog(voltage: Voltage) -> i32 {
    whole32((voltage.0 / ANALOG_VOLTS).clamp(0.0, FULL_SCALE))
}

/// The temperature as TEMP has it.
pub(super) fn temperature(temperature: Temperature) -> i32 {
    whole32(temperature.0 / DEGREES)
}

/// A number of the motor, as a counter of 32 bits has it.
pub(super) fn counter(number: Position) -> i32 {
    number.0.round() as i64 as i32
}

/// A number that saturates.
pub(super) fn whole32(value: f64) -> i32 {
    whole(value) as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MotorKind, StepperMotor};

    const STEPPER: StepperMotor =
        StepperMotor { full_steps_per_revolution: 200, rated_current_ma: 9000, has_encoder: true };

    fn units(is_reversed: bool) -> StepUnits {
        let motor = Motor {
            name: "mis340".to_owned(),
            counts_per_revolution: 409_600,
            raster_ns: 1_000_000,
            max_speed_rpm: 3000,
            rated_torque_nm: 3.0,
            peak_torque_factor: 1.0,
            rotor_inertia_kg_m2: 1.4e-4,
            kind: MotorKind::Stepper(STEPPER),
            type_code: 81,
            registers: None,
        };
        StepUnits::new(&motor, is_reversed)
    }

    #[test]
    fn velocities_are_hundredths_of_revolutions_per_minute() {
        // 100 RPM of 409600 steps.
        assert_eq!(units(false).velocity(10_000), Velocity(682_666.666_666_666_7));
        assert_eq!(units(true).velocity(10_000), Velocity(-682_666.666_666_666_7));
        for value in [-300_000, -1, 0, 1, 12_345, 300_000] {
            for units in [units(false), units(true)] {
                assert_eq!(units.shown_velocity(units.velocity(value)), value);
            }
        }
        assert_eq!(units(false).shown_velocity(Velocity(1e30)), i32::MAX);
    }

    #[test]
    fn accelerations_are_revolutions_per_minute_in_a_second_and_never_zero() {
        assert_eq!(units(false).acceleration(60), Acceleration(409_600.0));
        for value in [0, 1, -1] {
            assert_eq!(units(true).acceleration(value), units(false).acceleration(1));
        }
    }

    #[test]
    fn the_currents_are_those_of_the_manual() {
        assert_eq!([milliamperes(511), milliamperes(1533), milliamperes(-1)], [3000, 8999, 0]);
        assert_eq!([current(3000), current(9000), current(0)], [511, 1533, 0]);
        assert!((torque(511, &STEPPER).0 - 1000.0 / 3.0).abs() < 0.1);
        assert_eq!(torque(-511, &STEPPER), Torque(0.0));
    }

    #[test]
    fn voltages_and_temperature_have_their_scales() {
        assert_eq!([bus_voltage(Voltage(48.0)), bus_voltage(Voltage(500.0))], [1810, 4095]);
        assert!((voltage(15).0 - 0.397_875).abs() < 1e-9);
        assert_eq!([5.0, 10.0, -3.0, f64::NAN].map(|v| analog(Voltage(v))), [4095, 4095, 0, 0]);
        assert_eq!(temperature(Temperature(45.4)), 20);
    }

    #[test]
    fn positions_wrap_around_and_a_number_means_the_nearest_place() {
        let turn = 4_294_967_296.0;
        for (units, sign) in [(units(false), 1.0), (units(true), -1.0)] {
            assert_eq!(units.counter(Position(sign * 2_147_483_648.0)), i32::MIN);
            assert_eq!(units.place(5, Position(sign * (turn + 2.0))), Position(sign * (turn + 5.0)));
            assert_eq!(units.place(-5, Position(sign * 3.0)), Position(sign * -5.0));
            assert_eq!(units.counter(units.place(-7, Position(1e6))), -7);
        }
    }
}
