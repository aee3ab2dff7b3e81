//! What a motion is made of.

use crate::units::{Acceleration, Jerk, Position, Torque, Velocity};

/// How fast a motion may run and how hard and how smoothly it may ramp; magnitudes.
///
/// An axis reads the values with its own maxima applied ([`Limits::clamp`](crate::Limits::clamp)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Profile {
    /// Highest speed; zero stands still.
    pub velocity: Velocity,
    /// Rate at which the speed rises; zero means the axis maximum.
    pub acceleration: Acceleration,
    /// Rate at which the speed falls; zero means the axis maximum.
    pub deceleration: Acceleration,
    /// Rate at which the acceleration changes; `None` or zero means the axis maximum.
    pub jerk: Option<Jerk>,
}

/// Where the axis has to be at the end of a raster step, how fast, and the acceleration that led there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SetPoint {
    /// Place at the end of the step.
    pub position: Position,
    /// Velocity at the end of the step.
    pub velocity: Velocity,
    /// Acceleration throughout the step.
    pub acceleration: Acceleration,
}

/// What whoever commands an axis knows of the motion beside its place. It helps the controllers; the place stays what
/// the set-point says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeedForward {
    /// Velocity for the velocity controller; `None` is that of the set-point.
    pub velocity: Option<Velocity>,
    /// Torque on top of what the controllers give.
    pub torque: Torque,
}

impl FeedForward {
    /// The same without what is not finite.
    pub(crate) fn sanitised(self) -> Self {
        let torque = if self.torque.0.is_finite() { self.torque } else { Torque(0.0) };
        Self { velocity: self.velocity.filter(|velocity| velocity.0.is_finite()), torque }
    }
}
