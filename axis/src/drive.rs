//! What an axis needs from a drive, simulated or real.

use crate::controller::Coefficients;
use crate::inputs::{Inputs, Latches};
use crate::limits::TorqueLimit;
use crate::measurement::Source;
use crate::plant::Plant;
use crate::profile::{FeedForward, SetPoint};
use crate::units::{Position, Temperature, Torque, Velocity, Voltage};

/// A drive with its motor and encoder, in its own raw coordinates.
///
/// A drive never moves its origin: the axis keeps the offset between raw and axis coordinates.
pub trait Drive: Send {
    /// Runs one raster period under `command` and samples the result at its end.
    fn step(&mut self, command: &Command) -> Feedback;

    /// What the drive does by itself.
    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }

    /// Changes how the drive is set up; what it does not have changes nothing.
    fn configure(&mut self, _setting: Setting) {}

    /// What a controller card shows of its connections.
    fn signals(&self) -> Signals {
        Signals::default()
    }

    /// Time passes while the drive sleeps, see [`Capabilities::sleeps`].
    fn rest(&mut self, _seconds: f64) {}

    /// The plant of a simulated drive, to break and to repair it.
    fn plant(&mut self) -> Option<&mut Plant> {
        None
    }

    /// The same plant, to look at.
    fn plant_view(&self) -> Option<&Plant> {
        None
    }
}

/// What can be changed in a drive under a controller card (MACCON MAC4 User Manual, sections 4.1 to 4.4 and 5.16).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting {
    /// The coefficients of the sampled position controller.
    Coefficients(Coefficients),
    /// The highest output of that controller, 0 to 2047 counts of the converter.
    OutputLimit(i32),
    /// The motor turns the other way, but for [`Demand::Output`]. At standstill only: the place of the motor stays.
    Reversed(bool),
    /// Where the position comes from. The drive reads it at once; without power only, as the place may jump.
    Source(Source),
    /// A word of the host, see [`Source::Host`].
    Word(u32),
    /// Ten times the frequencies of a pulse output; refused in motion.
    Turbo(bool),
    /// How long BOOST leads a motion, in ns.
    BoostLead(u64),
}

/// What a controller card shows of its connections.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Signals {
    /// The place as measured, in the coordinates of the drive.
    pub place: Position,
    /// The last word of the position sensor.
    pub word: u32,
    /// The number in it.
    pub count: u32,
    /// Counts of the converter, or steps in the last raster period.
    pub output: i32,
    /// The BOOST signal.
    pub boost: bool,
    /// BOOST has led for long enough: pulses are possible.
    pub boost_ready: bool,
    /// TURBO is on.
    pub turbo: bool,
}

/// What the axis asks of the drive for one raster period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Keep the power stage on, or switch it on.
    pub enable: bool,
    /// What to follow while the drive is enabled.
    pub demand: Demand,
    /// What a drive with a velocity controller adds to the set-points of [`Demand::Position`].
    pub feed_forward: FeedForward,
    /// A motion is going on or about to begin, see [`Capabilities::lead`].
    pub moving: bool,
    /// Highest torque the motor may give.
    pub torque_limit: TorqueLimit,
    /// Highest speed to which a torque may drive the motor.
    pub velocity_limit: Velocity,
    /// Clear a fault; set for one period. A drive that needs longer reports `NotReady` meanwhile.
    pub reset_fault: bool,
}

/// What a drive follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// Where to be at the end of the period.
    Position(SetPoint),
    /// The torque to give.
    Torque(Torque),
    /// The output of the power stage as a share of its full scale, -1 to 1, past all controllers.
    Output(f64),
}

impl Default for Demand {
    fn default() -> Self {
        Self::Position(SetPoint::default())
    }
}

/// What the drive reports at the end of a raster period; every number is finite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Feedback {
    /// When the sample was taken, in raster steps since the drive started.
    pub step: u64,
    /// Whether the measured values below are from this step; the state always is.
    pub valid: bool,
    /// State of the power stage.
    pub state: DriveState,
    /// Encoder position.
    pub position: Position,
    /// Velocity of the motor.
    pub velocity: Velocity,
    /// Torque of the motor.
    pub torque: Torque,
    /// Supply of the power stage.
    pub voltage: Voltage,
    /// Temperature of the motor.
    pub temperature: Temperature,
    /// Part of the overload capacity (I²t) that is used up; at 1 the drive trips.
    pub overload: f64,
    /// Levels of the inputs.
    pub inputs: Inputs,
    /// Where index and switches changed since the last sample.
    pub latches: Latches,
}

/// State of a drive's power stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DriveState {
    /// Starting up; nothing can be asked of it yet.
    #[default]
    NotReady,
    /// Power off, ready to be enabled.
    Disabled,
    /// On the way to `Enabled`; gives no torque yet.
    Enabling,
    /// Power on: follows its set-points.
    Enabled,
    /// Power off because of a fault, until the fault is reset.
    Fault(DriveFault),
    /// The drive no longer answers.
    Lost,
}

/// Why a drive has switched itself off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveFault {
    /// The motor drew more current than the power stage stands.
    OverCurrent,
    /// The supply is too high.
    OverVoltage,
    /// The supply is too low.
    UnderVoltage,
    /// The power stage or the motor is too hot.
    OverTemperature,
    /// The motor gave more than its rated torque for too long.
    Overload,
    /// The encoder signal is missing or makes no sense.
    Encoder,
    /// A safety input has taken the torque off.
    SafeTorqueOff,
    /// Anything else inside the drive.
    Internal,
}

/// What a drive does by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Capabilities {
    /// Runs positioning profiles itself.
    pub profiles_itself: bool,
    /// Finds its reference position itself.
    pub homes_itself: bool,
    /// Raster steps before a motion from standstill in which it wants to know of it (BOOST, for one).
    pub lead: u32,
    /// Needs no steps while it is off and at rest; not while anything else still changes in it. A drive
    /// behind a bus needs every one.
    pub sleeps: bool,
}
