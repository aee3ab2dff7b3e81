//! A cycle of several raster steps: one generated set-point, and those on the way to it.

use crate::profile::SetPoint;
use crate::units::{Position, Velocity};

/// The way from one generated set-point to the next.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    from: SetPoint,
    to: SetPoint,
    is_straight: bool,
    /// Raster steps done.
    passed: u32,
    /// Raster steps to do.
    left: u32,
    /// Raster period in seconds.
    time: f64,
}

impl Stretch {
    /// A stretch of `steps` raster steps of `time` seconds, at constant velocity or constant acceleration.
    pub(super) fn new(from: SetPoint, to: SetPoint, is_straight: bool, steps: u32, time: f64) -> Self {
        Self { from, to, is_straight, passed: 0, left: steps, time }
    }

    /// Where the stretch ends.
    pub(super) fn end(&self) -> &SetPoint {
        &self.to
    }

    /// Raster steps to go.
    pub(super) fn left(&self) -> u32 {
        self.left
    }

    /// Moves the coordinate system.
    pub(super) fn shift(&mut self, by: Position) {
        self.from.position = self.from.position + by;
        self.to.position = self.to.position + by;
    }

    /// The set-point of the next raster step.
    pub(super) fn advance(&mut self) -> SetPoint {
        self.passed = self.passed.saturating_add(1);
        self.left = self.left.saturating_sub(1);
        if self.left == 0 { self.to } else { self.within(f64::from(self.passed) * self.time) }
    }

    fn within(&self, seconds: f64) -> SetPoint {
        let (before, after) = (self.from.velocity.0, self.to.velocity.0);
        let now = before + self.to.acceleration.0 * seconds;
        let (mean, velocity) = if self.is_straight { (after, after) } else { ((before + now) / 2.0, now) };
        let position = Position(self.from.position.0 + mean * seconds);
        SetPoint { position, velocity: Velocity(velocity), ..self.to }
    }
}
