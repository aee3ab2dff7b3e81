//! What an axis reports.

use crate::drive::{DriveFault, DriveState};
use crate::inputs::{Inputs, Latches, Switches};
use crate::order::SeekState;
use crate::profile::SetPoint;
use crate::units::{Position, Temperature, Torque, Velocity, Voltage};

/// The state of an axis at the end of a raster step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Status {
    /// Raster steps since the axis was made.
    pub steps: u64,
    /// Where the axis should be; follows `actual` while the axis is off.
    pub demand: SetPoint,
    /// Where the axis is.
    pub actual: Actual,
    /// Demand position minus actual position.
    pub following_error: Position,
    /// State of the drive's power stage.
    pub drive: DriveState,
    /// What the demand is doing.
    pub motion: Motion,
    /// The demand has arrived: at the target, at the velocity or at standstill. With `limited`, as near to
    /// it as the position limits allow. False from a command to the next step, and while the axis is off.
    pub done: bool,
    /// A position limit or a limit switch has changed or stopped the motion asked for; until the next command.
    pub limited: bool,
    /// The actual position has been near enough to the target for long enough, see
    /// [`Axis::set_target_window`](crate::Axis::set_target_window).
    pub on_target: bool,
    /// How far the last search has come.
    pub seek: SeekState,
    /// Exact place of the mark that the last search has found.
    pub mark: Option<Position>,
    /// Orders that wait for the present one.
    pub queued: usize,
    /// Supply of the power stage.
    pub voltage: Voltage,
    /// Temperature of the motor.
    pub temperature: Temperature,
    /// Part of the overload capacity (I²t) that is used up; at 1 the drive trips.
    pub overload: f64,
    /// The electrical levels of the inputs.
    pub inputs: Inputs,
    /// What the inputs mean.
    pub switches: Switches,
    /// Where index and inputs changed in the last step, the edges by what the inputs say.
    pub latches: Latches,
    /// Exact place of the last index passage; `None` until the first.
    pub index: Option<Position>,
    /// Why the axis is off, until it is reset.
    pub fault: Option<Fault>,
}

/// Measured values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actual {
    /// Encoder position.
    pub position: Position,
    /// Velocity of the motor.
    pub velocity: Velocity,
    /// Torque of the motor.
    pub torque: Torque,
}

/// What the demand of an axis is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Motion {
    /// No power: the demand follows the actual position.
    #[default]
    Off,
    /// Held in place.
    Standstill,
    /// Speed rising, or reversing into the new direction.
    Accelerating,
    /// Moving at constant speed.
    Constant,
    /// Speed falling.
    Decelerating,
}

impl Motion {
    /// The motion of an axis with power, from the step that led to `now`.
    pub(crate) fn of(now: &SetPoint) -> Self {
        let (velocity, acceleration) = (now.velocity.0, now.acceleration.0);
        if acceleration * velocity > 0.0 {
            Self::Accelerating
        } else if acceleration.abs() > 0.0 {
            Self::Decelerating
        } else if velocity.abs() > 0.0 {
            Self::Constant
        } else {
            Self::Standstill
        }
    }
}

/// Why an axis has switched off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The actual position was too far from the demand.
    FollowingError,
    /// The drive reported a fault.
    Drive(DriveFault),
    /// The drive no longer answers.
    Lost,
    /// The emergency stop was actuated.
    EmergencyStop,
    /// The drive signalled a fault at its input.
    DriveSignal,
    /// Whoever commands the axis gave no sign of life in time.
    Supervision,
}
