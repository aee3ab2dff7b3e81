//! The controller core: one motion axis in counts and raster steps.
//!
//! An [`Axis`] owns a [`Drive`] and is stepped once a raster [`Period`]. It turns goals (a position, a
//! velocity, standstill) into set-points that keep every limit, and reports what the drive answers.
//! Its only time is the number of steps; all arithmetic is `+ - * /`, `sqrt` and `floor`, so two runs of
//! the same commands agree to the last bit on every machine.

#![forbid(unsafe_code)]

mod analog;
mod axis;
mod controller;
mod drive;
mod generator;
mod inputs;
mod limits;
mod measurement;
mod order;
mod plant;
mod power_stage;
mod profile;
mod pulses;
mod servo;
mod status;
mod step_drive;
mod travel;
mod units;

pub use analog::{AnalogConfig, AnalogDrive};
pub use axis::{Axis, BehindLimit, Guard, PowerDelays, QueueFull, Reaction, Standby, TargetWindow};
pub use controller::{Coefficients, PositionController};
pub use drive::{Capabilities, Command, Demand, Drive, DriveFault, DriveState, Feedback, Setting, Signals};
pub use generator::{Creep, Generator, Goal, Stepping};
pub use inputs::{Edges, Input, Inputs, Latches, Level, Levels, Switch, Switches};
pub use limits::{Limits, PositionRange, TorqueLimit};
pub use measurement::{Coding, Counting, Measurement, OutOfRange, Scale, Sensor, SensorConfig, Source};
pub use order::{Base, Finish, Mark, Order, Seek, SeekState};
pub use plant::{
    Amplifier, AmplifierConfig, AmplifierMode, DcLink, EncoderBreak, Load, Noise, Overload, Plant,
    PlantConfig, PlantFault, ScheduledFault, Stepper, StepperConfig, Supply, Thermal,
};
pub use profile::{FeedForward, Profile, SetPoint};
pub use pulses::{InMotion, MAX_QUANTA, PulseOutput, Pulses};
pub use servo::{ServoConfig, SimulatedServo};
pub use status::{Actual, Fault, Motion, Status};
pub use step_drive::{StepConfig, StepDrive, StepFeedback};
pub use travel::{Travel, Turn};
pub use units::{Acceleration, Jerk, Period, Position, Temperature, Torque, Velocity, Voltage};
