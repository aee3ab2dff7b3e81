//! User units of CiA 402 to counts and back: the only place that converts them.
//!
//! With factory factors one user unit is one count, one count/s, one count/s². Positions wrap around at 32 bits
//! like the counter of a real drive; everything else saturates. Values are rounded to the nearest whole one,
//! halves away from zero.

use axis::{Acceleration, Jerk, Position, Torque, Velocity};

/// Places that a 32-bit position can tell apart.
const TURN: f64 = 4_294_967_296.0;

/// The units that the objects of one axis choose.
#[derive(Clone, Debug, Default)]
pub(crate) struct Units {}

impl Units {
    /// The position as 0x6064 shows it.
    pub(crate) fn shown_position(&self, position: Position) -> i64 {
        i64::from(position.0.round() as i64 as i32)
    }

    /// The place that the 32-bit number `value` means for an axis at `near`.
    pub(crate) fn position(&self, value: i64, near: Position) -> Position {
        let turns = ((near.0 + TURN / 2.0) / TURN).floor();
        Position(turns * TURN + value as f64)
    }

    /// The distance that the 32-bit number `value` means.
    pub(crate) fn distance(&self, value: i64) -> Position {
        Position(value as f64)
    }

    /// The velocity as 0x606C shows it.
    pub(crate) fn shown_velocity(&self, velocity: Velocity) -> i64 {
        saturate(velocity.0)
    }

    /// The velocity that 0x60FF or 0x6081 means.
    pub(crate) fn velocity(&self, value: i64) -> Velocity {
        Velocity(value as f64)
    }

    /// The acceleration that 0x6083 and its like mean.
    pub(crate) fn acceleration(&self, value: i64) -> Acceleration {
        Acceleration(value as f64)
    }

    /// The jerk that 0x60A4 means.
    pub(crate) fn jerk(&self, value: i64) -> Jerk {
        Jerk(value as f64)
    }

    /// The torque as 0x6077 shows it, in per mille of the rated torque.
    pub(crate) fn shown_torque(&self, torque: Torque) -> i64 {
        saturate(torque.0).clamp(i64::from(i16::MIN), i64::from(i16::MAX))
    }

    /// The torque that 0x6072 means.
    pub(crate) fn torque(&self, value: i64) -> Torque {
        Torque(value as f64)
    }
}

/// The position as 0x60FC shows it: in increments of the encoder whatever the factors, wrapped at 32 bits.
pub(crate) fn shown_increments(position: Position) -> i64 {
    i64::from(position.0.round() as i64 as i32)
}

/// The velocity that 0x6080 means: revolutions per minute whatever the factors.
pub(crate) fn from_rpm(rpm: i64, counts_per_revolution: u32) -> Velocity {
    Velocity(rpm as f64 / 60.0 * f64::from(counts_per_revolution))
}

fn saturate(value: f64) -> i64 {
    i64::from(value.round() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_wrap_and_a_target_is_meant_in_the_present_turn() {
        assert_eq!(Units::default().shown_position(Position(2_147_483_648.0)), i64::from(i32::MIN));
        assert_eq!(
            Units::default().position(i64::from(i32::MIN), Position(2_147_483_650.0)),
            Position(2_147_483_648.0)
        );
        assert_eq!(
            Units::default().position(2_000_000_000, Position(-2_000_000_000.0)),
            Position(2_000_000_000.0)
        );
        assert_eq!(Units::default().position(-5, Position(7.0)), Position(-5.0));
    }

    #[test]
    fn velocities_saturate_and_round_halves_away_from_zero() {
        assert_eq!(Units::default().shown_velocity(Velocity(1e12)), i64::from(i32::MAX));
        assert_eq!(Units::default().shown_velocity(Velocity(-2.5)), -3);
    }
}
