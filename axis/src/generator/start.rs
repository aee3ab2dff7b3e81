//! What a step starts from, and what it comes to.

use super::braking::{Brake, RESERVE};
use crate::limits::{Limits, PositionRange};
use crate::profile::SetPoint;
use crate::units::{Acceleration, Position, Velocity};

/// The state before a step and what the step has to keep.
pub(super) struct Start<'a> {
    pub(super) now: SetPoint,
    /// Duration of the step in seconds.
    pub(super) time: f64,
    pub(super) limits: &'a Limits,
    /// The position limits, widened to where the set-point is.
    pub(super) range: PositionRange,
}

/// What a step has come to.
pub(super) struct Step {
    pub(super) set_point: SetPoint,
    /// The velocity is the same throughout the step.
    pub(super) is_straight: bool,
    pub(super) is_done: bool,
    /// A position limit has changed the step.
    pub(super) is_cut: bool,
}

impl Start<'_> {
    pub(super) fn position(&self) -> f64 {
        self.now.position.0
    }

    pub(super) fn velocity(&self) -> f64 {
        self.now.velocity.0
    }

    /// The most that a step may add to the speed, in counts/s.
    pub(super) fn most_up(&self) -> f64 {
        self.limits.acceleration.0 * self.time
    }

    /// The most that a step may take off the speed, in counts/s.
    pub(super) fn most_down(&self) -> f64 {
        self.limits.braking().0 * self.time
    }

    /// The velocity `wanted` after the step, cut so that a stop within the range stays possible. `lead` is the
    /// way of a step (over its time) that ends at standstill.
    pub(super) fn contain(&self, wanted: f64, lead: f64, brake: Brake) -> f64 {
        let (velocity, most) = (self.velocity(), self.most_down());
        if wanted > 0.0 {
            brake.cut(wanted, velocity, self.way_to(self.range.max()) - lead, most)
        } else if wanted < 0.0 {
            -brake.cut(-wanted, -velocity, lead - self.way_to(self.range.min()), most)
        } else {
            wanted
        }
    }

    /// The velocity that covers the way to `place` in this step.
    pub(super) fn way_to(&self, place: Position) -> f64 {
        (place.0 - self.position()) / self.time
    }

    /// The end of a step at constant `velocity`, exactly at `end` or a limit when it comes within rounding or
    /// `close` counts of it.
    pub(super) fn straight(&self, velocity: f64, end: Option<f64>, close: f64) -> SetPoint {
        let way = velocity * self.time;
        let position = self.position() + way;
        let stop = self.stop_near(position, end, close + rounding(position) + way.abs() * RESERVE);
        self.set_point(stop.unwrap_or(position), velocity)
    }

    /// The end of a step at constant acceleration; one that comes to rest within rounding of `end` or a limit
    /// is exactly there.
    pub(super) fn parabola(&self, velocity: f64, end: Option<f64>) -> SetPoint {
        let position = self.position() + (self.velocity() + velocity) / 2.0 * self.time;
        let close = rounding(position);
        match self.stop_near(position, end, close) {
            Some(place) if velocity.abs() * self.time <= close => self.set_point(place, 0.0),
            Some(_) | None => self.set_point(position, velocity),
        }
    }

    fn stop_near(&self, position: f64, end: Option<f64>, close: f64) -> Option<f64> {
        let stops = [end, Some(self.range.min().0), Some(self.range.max().0)];
        stops.into_iter().flatten().find(|place| (position - place).abs() <= close)
    }

    fn set_point(&self, position: f64, velocity: f64) -> SetPoint {
        let velocity = velocity + 0.0; // makes a negative zero positive
        SetPoint {
            position: Position(position),
            velocity: Velocity(velocity),
            acceleration: Acceleration((velocity - self.velocity()) / self.time),
        }
    }
}

/// The distance at which two places near `position` are the same, in counts.
fn rounding(position: f64) -> f64 {
    1e-9 + position.abs() * (16.0 * f64::EPSILON)
}
