//! The units of the MAC motors: counts per sample, and what else their registers count in (JVL Ethernet manual,
//! sections 11.2 and 11.3). The only place that converts them.
//!
//! A *sample* is one turn of the motor's velocity loop: 1.92 ms on the MAC050 to 141, 1/770 s above. Velocities are
//! sixteenths of a count per sample, accelerations sixteenths of a count per sample and sample. With OUTLOOPDIV = 2 a
//! sample takes twice as long, so the numbers of velocities double and those of accelerations are four times as large.
//!
//! What comes in becomes the double nearest to it. What is shown is rounded to the nearest whole unit, halves away from
//! zero. Positions wrap around at the ends of 32 bits, everything else saturates; a register of 16 bits saturates there.

use axis::{Acceleration, Position, Temperature, Torque, Velocity, Voltage};

use crate::cia402::units::whole;

/// Who counts how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    /// MAC050, 095, 140 and 141: many registers have 16 bits.
    Small,
    /// MAC400, 800, 1500 and 3000: all registers have 32 bits.
    Large,
}

/// The units of one motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MacUnits {
    family: Family,
    /// Of one sample, in seconds.
    sample: f64,
}

/// Fractions of a count that velocities, accelerations and the function position have.
const FRACTIONS: f64 = 16.0;
/// T_SOLL of the peak torque, three times the rated one.
const PEAK: f64 = 1023.0;
/// VF_OUT of the peak torque.
const PEAK_OUT: f64 = 1024.0;
/// The peak torque, in per mille of the rated one.
const PEAK_PER_MILLE: f64 = 3000.0;
/// ANINP at 10 V (JVL Ethernet manual, object 0x2101).
const FULL_ANALOG: f64 = 1023.0;
const FULL_VOLTAGE: f64 = 10.0;
/// U_BUS counts 0.888 V (register 198).
const BUS_VOLTS: f64 = 0.888;
/// DEGC counts so much a degree: DEGCMAX is 690 at 84 degrees (register 31).
const PER_DEGREE: f64 = 690.0 / 84.0;

impl MacUnits {
    /// The units of a motor of this family whose OUTLOOPDIV is `divider`.
    pub(crate) fn new(family: Family, divider: i32) -> Self {
        let sample = match family {
            Family::Small => 1.92e-3,
            Family::Large if divider == 2 => 2.0 / 770.0,
            Family::Large => 1.0 / 770.0,
        };
        Self { family, sample }
    }

    pub(crate) fn family(&self) -> Family {
        self.family
    }

    /// V_SOLL and its like.
    pub(crate) fn velocity(&self, value: i32) -> Velocity {
        Velocity(f64::from(value) / FRACTIONS / self.sample)
    }

    /// A velocity in the unit of V_SOLL.
    pub(crate) fn fine_velocity(&self, velocity: Velocity) -> i32 {
        whole32(velocity.0 * self.sample * FRACTIONS)
    }

    /// A velocity in whole counts per sample, as V_IST has it.
    pub(crate) fn coarse_velocity(&self, velocity: Velocity) -> i32 {
        whole32(velocity.0 * self.sample)
    }

    /// The width of a window around a velocity, which INPOSWIN counts like V_IST.
    pub(crate) fn velocity_window(&self, value: i32) -> Velocity {
        Velocity(f64::from(value).abs() / self.sample)
    }

    /// A_SOLL and its like: a magnitude, and one unit at least, so that what moves can stop.
    pub(crate) fn acceleration(&self, value: i32) -> Acceleration {
        Acceleration(f64::from(value).abs().max(1.0) / FRACTIONS / (self.sample * self.sample))
    }

    /// T_SOLL and its like: a magnitude, and three times the rated torque at most.
    pub(crate) fn torque(value: i32) -> Torque {
        Torque(f64::from(value).abs().min(PEAK) / PEAK * PEAK_PER_MILLE)
    }

    /// A torque as VF_OUT has it.
    pub(crate) fn shown_torque(torque: Torque) -> i32 {
        whole32(torque.0 / PEAK_PER_MILLE * PEAK_OUT)
    }

    /// The counter of 32 bits in which positions are.
    pub(crate) fn counter(position: Position) -> i32 {
        wrapped(position.0)
    }

    /// The place that the number `value` of that counter means for an axis at `near`: the nearest one.
    pub(crate) fn place(value: i32, near: Position) -> Position {
        let near_count = Self::counter(near);
        Position(near.0.round() + f64::from(value.wrapping_sub(near_count)))
    }

    /// A position as P_FNC has it, in sixteenths.
    pub(crate) fn function_position(position: Position) -> i32 {
        wrapped(position.0 * FRACTIONS)
    }

    /// The place that P_FNC means.
    pub(crate) fn of_function_position(value: i32) -> Position {
        Position(f64::from(value) / FRACTIONS)
    }

    /// The voltage as ANINP has it, `offset` taken off.
    pub(crate) fn analog(voltage: Voltage, offset: i32) -> i32 {
        let value = (voltage.0 / FULL_VOLTAGE * FULL_ANALOG).round().clamp(-FULL_ANALOG, FULL_ANALOG);
        (value as i32).saturating_sub(offset).clamp(-(FULL_ANALOG as i32), FULL_ANALOG as i32)
    }

    /// ANINP as a share of its full scale, -1 to 1.
    pub(crate) fn share(analog: i32) -> f64 {
        (f64::from(analog) / FULL_ANALOG).clamp(-1.0, 1.0)
    }

    /// The supply as U_SUPPLY (tenths of a volt, our choice) or U_BUS has it.
    pub(crate) fn supply(&self, voltage: Voltage) -> i32 {
        match self.family {
            Family::Small => whole32(voltage.0 * 10.0),
            Family::Large => whole32(voltage.0 / BUS_VOLTS),
        }
    }

    /// The temperature as DEGC has it.
    pub(crate) fn shown_temperature(temperature: Temperature) -> i32 {
        whole32(temperature.0 * PER_DEGREE)
    }
}

fn whole32(value: f64) -> i32 {
    whole(value) as i32
}

fn wrapped(value: f64) -> i32 {
    value.round() as i64 as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// V_SOLL of a speed in revolutions per minute.
    fn v_soll(units: &MacUnits, counts: f64, rpm: f64) -> f64 {
        units.sample * FRACTIONS * rpm / 60.0 * counts
    }

    fn near(value: f64, printed: f64, digit: f64) {
        assert!((value - printed).abs() <= digit, "{value} is not {printed}");
    }

    const SMALL: MacUnits = MacUnits { family: Family::Small, sample: 1.92e-3 };

    #[test]
    fn the_factors_are_those_of_the_manual() {
        let large = MacUnits::new(Family::Large, 1);
        near(v_soll(&large, 8000.0, 1.0), 2.770_563, 5e-7);
        near(v_soll(&large, 8192.0, 1.0), 2.837_056, 5e-7);
        near(v_soll(&SMALL, 4096.0, 1.0), 2.0971, 6e-5);
        // 100 RPM and 1000 RPM of a MAC800, 1200 RPM of a MAC400.
        near(v_soll(&large, 8000.0, 100.0), 277.0, 0.5);
        near(v_soll(&large, 8192.0, 1200.0), 3404.0, 0.5);
        // 1000 V_SOLL are 477 RPM on a MAC140, 8000 are 2820 RPM on a MAC400.
        near(1000.0 / v_soll(&SMALL, 4096.0, 1.0), 477.0, 0.5);
        near(8000.0 / v_soll(&large, 8192.0, 1.0), 2820.0, 0.5);
    }

    #[test]
    fn accelerations_are_those_of_the_manual() {
        let large = MacUnits::new(Family::Large, 1);
        let rpm_per_second = |value, counts: f64| large.acceleration(value).0 / counts * 60.0;
        near(1000.0 / rpm_per_second(1, 8000.0), 3.598_133, 5e-7);
        near(rpm_per_second(1, 8192.0), 271.41, 5e-3);
        near(rpm_per_second(18, 8000.0), 5003.0, 0.5);
        near(rpm_per_second(2, 8192.0), 543.0, 0.5);
        near(100_000.0 / rpm_per_second(1, 8000.0), 360.0, 0.5);
        near(100_000.0 / rpm_per_second(1, 8192.0), 369.0, 1.0);
        // The same units with the sample of the small motors.
        near(SMALL.acceleration(1).0 / 4096.0 * 60.0, 248.4, 0.05);
    }

    #[test]
    fn an_acceleration_is_never_zero_nor_negative() {
        for value in [0, -1, 1] {
            assert_eq!(SMALL.acceleration(value), SMALL.acceleration(1));
        }
        assert!(SMALL.acceleration(i32::MIN).0 > 0.0);
    }

    #[test]
    fn half_the_loop_rate_doubles_velocities_and_quadruples_accelerations() {
        let (fast, slow) = (MacUnits::new(Family::Large, 1), MacUnits::new(Family::Large, 2));
        let speed = Velocity(100_000.0);
        assert_eq!((fast.fine_velocity(speed), slow.fine_velocity(speed)), (2078, 4156));
        near(fast.acceleration(100).0 / slow.acceleration(100).0, 4.0, 1e-9);
        assert_eq!(MacUnits::new(Family::Small, 2), SMALL);
    }

    #[test]
    fn velocities_are_shown_to_the_nearest_unit_and_saturate() {
        let large = MacUnits::new(Family::Large, 1);
        let speed = large.velocity(3404);
        assert_eq!((large.fine_velocity(speed), large.coarse_velocity(speed)), (3404, 213));
        assert_eq!(large.fine_velocity(-speed), -3404);
        assert_eq!(large.fine_velocity(Velocity(1e18)), i32::MAX);
        assert_eq!(large.velocity_window(-100), large.velocity(1600));
    }

    #[test]
    fn torques_are_shares_of_three_times_the_rated_one() {
        let torques = [341, 1023, 2000, -1023].map(MacUnits::torque);
        assert_eq!(torques, [1000.0, 3000.0, 3000.0, 3000.0].map(Torque));
        assert_eq!(MacUnits::shown_torque(Torque(3000.0)), 1024);
        assert_eq!(MacUnits::shown_torque(Torque(-1500.0)), -512);
    }

    #[test]
    fn positions_wrap_around_and_targets_are_the_nearest_repetition() {
        assert_eq!(MacUnits::counter(Position(2_147_483_648.0)), i32::MIN);
        let turn = 4_294_967_296.0;
        assert_eq!(MacUnits::place(5, Position(turn + 2.0)), Position(turn + 5.0));
        assert_eq!(MacUnits::place(-5, Position(3.0)), Position(-5.0));
        assert_eq!(MacUnits::place(i32::MIN, Position(f64::from(i32::MAX))), Position(2_147_483_648.0));
        assert_eq!(MacUnits::function_position(Position(100.5)), 1608);
        assert_eq!(MacUnits::of_function_position(1608), Position(100.5));
    }

    #[test]
    fn the_analogue_input_has_its_offset_and_its_ends() {
        let analog = |volts, offset| MacUnits::analog(Voltage(volts), offset);
        assert_eq!([analog(10.0, 0), analog(-5.0, 0), analog(5.0, 12)], [1023, -512, 500]);
        assert_eq!([analog(10.0, -20), analog(f64::NAN, 0), analog(0.0, i32::MIN)], [1023, 0, 1023]);
        near(MacUnits::share(-512), -512.0 / 1023.0, 1e-12);
    }

    #[test]
    fn supply_and_temperature_have_their_scales() {
        assert_eq!(SMALL.supply(Voltage(48.0)), 480);
        assert_eq!(MacUnits::new(Family::Large, 1).supply(Voltage(325.0)), 366);
        assert_eq!(MacUnits::shown_temperature(Temperature(84.0)), 690);
    }
}
