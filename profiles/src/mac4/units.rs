//! The units of the cards, the only place where they are converted.
//!
//! INC and SSI: velocities in increments per SP, ramps in Inc/SP², SP being the sampling period of the profile
//! generator, 10 ms. STP: velocities in Hz, ramps in Hz per SP of 32 ms. `<sf>` divides both by 2^sf (section 4.8.4).
//! Positions are in increments or steps, which are counts of the axis. Times are in ms.
//!
//! What is given is converted exactly, but for the last bit of a floating-point number; times are rounded up to whole
//! sampling periods. What is shown is rounded to the nearest whole number, halves away from zero, and cut to 32 bits.

use axis::{Acceleration, Period, Position, Velocity};

use super::CardType;

/// Sampling periods of the controller in one of the generator (section 7.4: 2.5 and 10 ms, 8 and 32 ms).
pub(crate) const CYCLE: u32 = 4;

/// The units of one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Units {
    card: CardType,
    /// System sampling period, the raster of the axis.
    ssp: Period,
    /// `<sf>`.
    scaling: u32,
}

impl Units {
    pub(super) fn new(card: CardType, ssp: Period, scaling: i64) -> Self {
        Self { card, ssp, scaling: u32::try_from(scaling).unwrap_or(0) }
    }

    /// Generator sampling period in seconds.
    fn sp(&self) -> f64 {
        self.ssp.seconds() * f64::from(CYCLE)
    }

    fn scaled(&self, value: i64) -> f64 {
        value as f64 / (1_u64 << self.scaling.min(63)) as f64
    }

    /// A velocity that was given, with its sign.
    pub(super) fn velocity(&self, value: i64) -> Velocity {
        match self.card {
            CardType::Inc | CardType::Ssi => Velocity(self.scaled(value) / self.sp()),
            CardType::Stp => Velocity(self.scaled(value)),
        }
    }

    /// A frequency in Hz that is not scaled: `<ssf>`.
    pub(super) fn frequency(hertz: i64) -> Velocity {
        Velocity(hertz as f64)
    }

    /// A ramp that was given.
    pub(super) fn ramp(&self, value: i64) -> Acceleration {
        match self.card {
            CardType::Inc | CardType::Ssi => Acceleration(self.scaled(value) / (self.sp() * self.sp())),
            CardType::Stp => Acceleration(self.scaled(value) / self.sp()),
        }
    }

    /// A position that was given.
    pub(super) fn position(value: i64) -> Position {
        Position(value as f64)
    }

    /// A time in ms, in sampling periods of the controller.
    pub(super) fn periods(&self, millis: i64) -> u32 {
        periods(millis, self.ssp)
    }

    /// A time in ms, in nanoseconds.
    pub(super) fn nanos(millis: i64) -> u64 {
        millis.unsigned_abs().saturating_mul(1_000_000)
    }

    /// Share of the full scale that the value of the mode "test" is: of 2047 counts of the converter, or of the highest
    /// frequency.
    pub(super) fn share(&self, value: i64, turbo: bool) -> f64 {
        let full_scale = match (self.card, turbo) {
            (CardType::Inc | CardType::Ssi, _) => 2047.0,
            (CardType::Stp, false) => HIGHEST_FREQUENCY as f64,
            (CardType::Stp, true) => HIGHEST_TURBO_FREQUENCY as f64,
        };
        value as f64 / full_scale
    }

    /// RAV: in a system sampling period.
    pub(super) fn shown_actual(&self, velocity: Velocity) -> i64 {
        shown(velocity.0 * self.ssp.seconds())
    }

    /// RPS: in a generator sampling period.
    pub(super) fn shown_command(&self, velocity: Velocity) -> i64 {
        shown(velocity.0 * self.sp())
    }

    /// RCP, RFE.
    pub(super) fn shown_position(position: Position) -> i64 {
        shown(position.0)
    }
}

/// Highest frequency of the pulse output in Hz (table 4.1).
pub(super) const HIGHEST_FREQUENCY: i64 = 50_000;
/// The same in TURBO operation.
pub(super) const HIGHEST_TURBO_FREQUENCY: i64 = 500_000;

/// A time in ms, in sampling periods of the controller.
pub(crate) fn periods(millis: i64, ssp: Period) -> u32 {
    u32::try_from(Units::nanos(millis).div_ceil(ssp.nanos())).unwrap_or(u32::MAX)
}

fn shown(value: f64) -> i64 {
    value.round().clamp(f64::from(i32::MIN), f64::from(i32::MAX)) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units(card: CardType, scaling: i64) -> Units {
        let nanos = if card == CardType::Stp { 8_000_000 } else { 2_500_000 };
        Units::new(card, Period::from_nanos(nanos).unwrap(), scaling)
    }

    #[test]
    fn servo_velocities_are_increments_in_10_ms_and_ramps_that_again() {
        let servo = units(CardType::Inc, 0);
        assert_eq!(servo.velocity(-20), Velocity(-2_000.0));
        assert!((servo.ramp(5_000).0 - 5e7).abs() < 1e-3);
        assert_eq!(servo.shown_actual(Velocity(-4_000.0)), -10);
        assert_eq!(servo.shown_command(Velocity(-4_000.0)), -40);
    }

    #[test]
    fn stepper_velocities_are_hertz_and_ramps_hertz_in_32_ms() {
        let stepper = units(CardType::Stp, 0);
        assert_eq!(stepper.velocity(30), Velocity(30.0));
        assert!((stepper.ramp(2_000).0 - 62_500.0).abs() < 1e-6);
        assert_eq!(stepper.shown_actual(Velocity(1_000.0)), 8);
        assert_eq!(stepper.shown_command(Velocity(1_000.0)), 32);
        assert!((stepper.share(5_000, false) - 0.1).abs() < 1e-12);
        assert!((stepper.share(5_000, true) - 0.01).abs() < 1e-12);
    }

    #[test]
    fn the_binary_scaling_halves_velocities_and_ramps() {
        let scaled = units(CardType::Ssi, 3);
        assert_eq!(scaled.velocity(20), Velocity(250.0));
        assert!((scaled.ramp(8).0 - 10_000.0).abs() < 1e-6);
    }

    #[test]
    fn times_are_rounded_up_to_sampling_periods() {
        let servo = units(CardType::Inc, 0);
        let periods = [0, 1, 2, 3, 5, 60_000].map(|millis| servo.periods(millis));
        assert_eq!(periods, [0, 1, 1, 2, 2, 24_000]);
        assert_eq!(servo.periods(i64::MAX), u32::MAX);
    }

    #[test]
    fn what_is_shown_is_the_nearest_whole_number_of_32_bits() {
        let values = [0.4, -0.5, 1.5, 1e12, -1e12].map(|value| Units::shown_position(Position(value)));
        assert_eq!(values, [0, -1, 2, i64::from(i32::MAX), i64::from(i32::MIN)]);
    }
}
