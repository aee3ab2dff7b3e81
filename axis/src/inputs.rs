//! The digital inputs of a drive, and the exact places at which they changed.

use crate::units::Position;

/// Electrical levels of a drive's inputs; `true` is high. Whether high means actuated is a matter of wiring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// End of travel in positive direction.
    pub positive_limit: bool,
    /// End of travel in negative direction.
    pub negative_limit: bool,
    /// Reference switch.
    pub home: bool,
    /// The power electronics have tripped.
    pub drive_fault: bool,
    /// The emergency stop button.
    pub emergency_stop: bool,
}

/// Names one of the [`Inputs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// End of travel in positive direction.
    PositiveLimit,
    /// End of travel in negative direction.
    NegativeLimit,
    /// Reference switch.
    Home,
    /// The power electronics have tripped.
    DriveFault,
    /// The emergency stop button.
    EmergencyStop,
}

/// Where signals changed since the last report, in raw encoder coordinates; `None` where nothing changed.
/// Of several changes of one signal the last one counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Latches {
    /// The index pulse that was passed.
    pub index: Option<Position>,
    /// Edge of the positive limit switch.
    pub positive_limit: Option<Position>,
    /// Edge of the negative limit switch.
    pub negative_limit: Option<Position>,
    /// Edge of the reference switch.
    pub home: Option<Position>,
}
