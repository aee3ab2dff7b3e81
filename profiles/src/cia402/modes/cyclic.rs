//! What the cyclic modes share: when the next set-point is due, and what holds when it does not come.
//!
//! A set-point is to be reached an interpolation time (0x60C2) after its arrival. Set-points that come in time, one after
//! the other, are a stream; each is then due an interpolation time after the one before it, so that a motion stays
//! even when one comes early or late. When a stream breaks off, it is taken to go on as it did for another interpolation
//! time; then the drive brakes with the quick stop ramp and no longer follows (bit 12) until a set-point comes. One
//! that stands alone is no stream: a master that writes now and then gets what it wrote and nothing more.

use core::num::NonZeroU32;

use axis::{FeedForward, Period, Torque, Velocity};

use crate::Binding;
use crate::cia402::Context;
use crate::slots::Parameters;

/// The age of the set-points of a mode.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stream {
    course: Course,
    /// Raster steps of the interpolation time.
    time: NonZeroU32,
    /// Raster steps until the last set-point is due; negative when it is past.
    left: i32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Course {
    /// No set-point counts.
    Shut,
    /// None has come yet: the axis holds.
    Waiting,
    /// One has come by itself.
    Alone,
    /// They come in time.
    Steady,
    /// The last one is past; it goes on as it did.
    Extended,
    /// None came for too long.
    Broken,
}

/// What a raster step makes of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lapse {
    /// All is in time.
    None,
    /// The set-points are to go on as they did for another interpolation time.
    Extend(NonZeroU32),
    /// The axis is to stop.
    Break,
}

impl Default for Stream {
    fn default() -> Self {
        Self { course: Course::Waiting, time: NonZeroU32::MIN, left: 0 }
    }
}

impl Stream {
    /// Lets no set-point count until [`Stream::open`].
    pub(super) fn shut(&mut self) {
        self.course = Course::Shut;
    }

    /// Waits for the first set-point.
    pub(super) fn open(&mut self) {
        *self = Self::default();
    }

    /// Whether set-points count.
    pub(super) fn is_open(&self) -> bool {
        self.course != Course::Shut
    }

    /// Whether the drive follows the command value: bit 12.
    pub(super) fn is_followed(&self) -> bool {
        !matches!(self.course, Course::Shut | Course::Broken)
    }

    /// Takes a set-point with this interpolation time. In how many raster steps it is due.
    pub(super) fn arrive(&mut self, time: NonZeroU32) -> NonZeroU32 {
        let steps = i32::try_from(time.get()).unwrap_or(i32::MAX);
        let slack = steps / 2;
        let is_in_time = match self.course {
            Course::Shut | Course::Waiting | Course::Broken => false,
            Course::Alone => self.left >= -slack,
            Course::Steady | Course::Extended => true,
        };
        let left = if is_in_time { self.left.clamp(1 - steps, slack) } else { 0 };
        self.course = if is_in_time { Course::Steady } else { Course::Alone };
        self.time = time;
        self.left = steps.saturating_add(left);
        NonZeroU32::new(self.left.unsigned_abs()).unwrap_or(NonZeroU32::MIN)
    }

    /// Whether the last set-point came in time after another one.
    pub(super) fn is_steady(&self) -> bool {
        self.course == Course::Steady
    }

    /// Goes on by a raster step.
    pub(super) fn step(&mut self) -> Lapse {
        let time = i32::try_from(self.time.get()).unwrap_or(i32::MAX);
        self.left = self.left.saturating_sub(1);
        match self.course {
            Course::Steady if self.left <= 0 => {
                self.course = Course::Extended;
                Lapse::Extend(self.time)
            }
            Course::Extended if self.left <= -time => {
                self.course = Course::Broken;
                Lapse::Break
            }
            Course::Shut
            | Course::Waiting
            | Course::Alone
            | Course::Steady
            | Course::Extended
            | Course::Broken => Lapse::None,
        }
    }
}

/// The interpolation time 0x60C2 in raster steps, one at least.
pub(super) fn interpolation_time(parameters: Parameters<'_>, period: Period) -> NonZeroU32 {
    let value = parameters.or(Binding::InterpolationTimeValue, 1).max(1);
    let index = parameters.or(Binding::InterpolationTimeIndex, -3).clamp(-9, 0);
    let unit = 10_u64.pow(u32::try_from(index + 9).unwrap_or(0));
    let nanos = unit.saturating_mul(value.unsigned_abs());
    let steps = nanos.saturating_add(period.nanos() / 2) / period.nanos();
    u32::try_from(steps).ok().and_then(NonZeroU32::new).unwrap_or(NonZeroU32::MIN)
}

/// 0x60B1 and 0x60B2 as feed-forward. A velocity of zero leaves it to the drive, which knows that of its set-points.
pub(super) fn feed_forward(parameters: Parameters<'_>) -> FeedForward {
    let velocity = Some(velocity_offset(parameters)).filter(|velocity| velocity.0 != 0.0);
    FeedForward { velocity, torque: torque_offset(parameters) }
}

/// 0x60B1.
pub(super) fn velocity_offset(parameters: Parameters<'_>) -> Velocity {
    parameters.units.target_velocity(parameters.or(Binding::VelocityOffset, 0))
}

/// 0x60B2.
pub(super) fn torque_offset(parameters: Parameters<'_>) -> Torque {
    parameters.units.torque(parameters.or(Binding::TorqueOffset, 0))
}

/// The interpolation time of a drive's axis in raster steps.
pub(super) fn time_of(context: &Context<'_>) -> NonZeroU32 {
    interpolation_time(context.parameters, context.axis.period())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(count: u32) -> NonZeroU32 {
        NonZeroU32::new(count).unwrap()
    }

    /// Set-points with so many raster steps before each; in how many each is due.
    fn due(time: u32, waits: &[u32]) -> Vec<u32> {
        let mut stream = Stream::default();
        let mut arrive = |wait: &u32| {
            (0..*wait).for_each(|_| _ = stream.step());
            stream.arrive(steps(time)).get()
        };
        waits.iter().map(&mut arrive).collect()
    }

    #[test]
    fn set_points_in_time_are_due_evenly_however_they_come() {
        assert_eq!(due(4, &[9, 4, 4, 5, 4, 3, 4]), [4, 4, 4, 3, 3, 4, 4]);
        assert_eq!(due(4, &[0, 3, 5, 1, 1]), [4, 5, 4, 6, 6], "two early ones do not pile up");
        assert_eq!(due(1, &[0, 1, 0, 2, 1]), [1, 1, 1, 1, 1]);
    }

    #[test]
    fn a_broken_stream_goes_on_for_one_interpolation_time_and_stops() {
        let mut stream = Stream::default();
        stream.arrive(steps(3));
        (0..3).for_each(|_| _ = stream.step());
        stream.arrive(steps(3));
        let lapses: Vec<_> = (0..8).map(|_| stream.step()).collect();
        let none = Lapse::None;
        assert_eq!(lapses, [none, none, Lapse::Extend(steps(3)), none, none, Lapse::Break, none, none]);
        assert!(!stream.is_followed());
        stream.arrive(steps(3));
        assert!(stream.is_followed() && !stream.is_steady());
    }

    #[test]
    fn a_set_point_alone_is_no_stream() {
        let mut stream = Stream::default();
        for _ in 0..10 {
            stream.arrive(steps(2));
            assert!((0..100).all(|_| stream.step() == Lapse::None));
            assert!(stream.is_followed());
        }
    }
}
