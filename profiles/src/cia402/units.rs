//! User units of CiA 402 to counts and back: the only place that converts them.
//!
//! With factory factors one user unit is one count, one count/s, one count/s². The ratios are exact fractions. What
//! comes in becomes the double nearest to it, so whole counts where the ratio is whole, and a fraction of a count is
//! kept: moves by a unit that is no whole number of counts add up. What is shown is rounded to the nearest whole
//! unit, halves away from zero. Shown positions wrap around at the ends of their range, everything else saturates.

pub(crate) mod factors;
mod ratio;

use axis::{Acceleration, Jerk, Position, PositionRange, Torque, Velocity};

use ratio::Ratio;

/// The units that the objects of one axis choose.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Units {
    /// Counts a position unit.
    position: Ratio,
    /// Counts/s a velocity unit.
    velocity: Ratio,
    /// Counts/s² an acceleration unit.
    acceleration: Ratio,
    /// Counts/s³ a jerk unit.
    jerk: Ratio,
    is_position_reversed: bool,
    is_velocity_reversed: bool,
    turn: Turn,
}

/// The range in which positions are shown, ends included (0x607B), in user units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Turn {
    min: i64,
    max: i64,
}

impl Default for Turn {
    /// The counter of 32 bits.
    fn default() -> Self {
        Self { min: i32::MIN.into(), max: i32::MAX.into() }
    }
}

impl Turn {
    fn length(self) -> i128 {
        i128::from(self.max) - i128::from(self.min) + 1
    }

    /// The whole turns between the range and `place`, in user units.
    fn turns(self, place: i128) -> i128 {
        let length = self.length();
        place.saturating_sub(self.min.into()).div_euclid(length).saturating_mul(length)
    }

    /// `place` as it is shown. Most are in the range, and a division of 128 bits takes longer than all the rest.
    fn wrap(self, place: i128) -> i128 {
        if (self.min.into()..=self.max.into()).contains(&place) {
            return place;
        }
        place.saturating_sub(self.min.into()).rem_euclid(self.length()) + i128::from(self.min)
    }
}

impl Default for Units {
    /// Counts.
    fn default() -> Self {
        Self {
            position: Ratio::ONE,
            velocity: Ratio::ONE,
            acceleration: Ratio::ONE,
            jerk: Ratio::ONE,
            is_position_reversed: false,
            is_velocity_reversed: false,
            turn: Turn::default(),
        }
    }
}

impl Units {
    /// The position as 0x6064 shows it.
    pub(crate) fn shown_position(&self, position: Position) -> i64 {
        fixed(self.turn.wrap(self.place(position)))
    }

    /// The place that the number `value` means for an axis at `near`: in its present turn.
    pub(crate) fn position(&self, value: i64, near: Position) -> Position {
        let turns = self.turn.turns(self.place(near));
        self.counts(turns.saturating_add(self.turn.wrap(value.into())))
    }

    /// The signed distance that `value` means, such as that of a relative move.
    pub(crate) fn way(&self, value: i64) -> Position {
        self.counts(value.into())
    }

    /// The signed distance as 0x60F4 shows it.
    pub(crate) fn shown_way(&self, way: Position) -> i64 {
        saturate(self.place(way))
    }

    /// The width that `value` means, such as that of a window, whatever the polarity.
    pub(crate) fn distance(&self, value: i64) -> Position {
        Position(self.position.counts(value.into()))
    }

    /// The places from `min` to `max`, in turn zero. An end that lies at the end of the turn or beyond is none; equal
    /// or reversed ends are no range. `offset` is taken off both ends.
    pub(crate) fn range(&self, min: i64, max: i64, offset: i64) -> Option<PositionRange> {
        let end = |value: i64| self.counts(i128::from(value) - i128::from(offset));
        let least = if min > self.turn.min { Some(end(min)) } else { None };
        let most = if max < self.turn.max { Some(end(max)) } else { None };
        let (low, high) = if self.is_position_reversed { (most, least) } else { (least, most) };
        if min >= max || (low, high) == (None, None) {
            return None;
        }
        PositionRange::new(
            low.unwrap_or(Position(f64::NEG_INFINITY)),
            high.unwrap_or(Position(f64::INFINITY)),
        )
    }

    /// The velocity as 0x606C shows it.
    pub(crate) fn shown_velocity(&self, velocity: Velocity) -> i64 {
        saturate(signed(self.velocity.units(velocity.0), self.is_velocity_reversed))
    }

    /// The velocity that a target such as 0x60FF means.
    pub(crate) fn target_velocity(&self, value: i64) -> Velocity {
        Velocity(self.velocity.counts(signed(value.into(), self.is_velocity_reversed)))
    }

    /// The speed that 0x6081 and its like mean, whatever the polarity.
    pub(crate) fn velocity(&self, value: i64) -> Velocity {
        Velocity(self.velocity.counts(value.into()))
    }

    /// The acceleration that 0x6083 and its like mean.
    pub(crate) fn acceleration(&self, value: i64) -> Acceleration {
        Acceleration(self.acceleration.counts(value.into()))
    }

    /// The jerk that 0x60A4 means.
    pub(crate) fn jerk(&self, value: i64) -> Jerk {
        Jerk(self.jerk.counts(value.into()))
    }

    /// The torque as 0x6077 shows it, in per mille of the rated torque.
    pub(crate) fn shown_torque(&self, torque: Torque) -> i64 {
        i64::from(torque.0.round() as i16)
    }

    /// The torque that 0x6072 means.
    pub(crate) fn torque(&self, value: i64) -> Torque {
        Torque(value as f64)
    }

    /// The user unit nearest to `position`, in whatever turn.
    fn place(&self, position: Position) -> i128 {
        signed(self.position.units(position.0), self.is_position_reversed)
    }

    fn counts(&self, units: i128) -> Position {
        Position(self.position.counts(signed(units, self.is_position_reversed)))
    }
}

/// The position as 0x60FC and the counter of 32 bits in the motor have it: in increments of the encoder whatever the
/// factors.
pub(crate) fn counter(position: Position) -> i64 {
    i64::from(position.0.round() as i64 as i32)
}

/// A number of the motor's own unit, to 32 bits.
pub(crate) fn whole(value: f64) -> i64 {
    i64::from(value.round() as i32)
}

/// The velocity that 0x6080 means: revolutions of the motor per minute, whatever the factors.
pub(crate) fn from_rpm(rpm: i64, counts_per_revolution: u32) -> Velocity {
    Velocity(rpm as f64 / 60.0 * f64::from(counts_per_revolution))
}

fn signed(value: i128, is_reversed: bool) -> i128 {
    if is_reversed { value.saturating_neg() } else { value }
}

fn saturate(value: i128) -> i64 {
    fixed(value.clamp(i32::MIN.into(), i32::MAX.into()))
}

/// A number that fits.
fn fixed(value: i128) -> i64 {
    i64::try_from(value).unwrap_or_default()
}

#[cfg(test)]
mod tests;
