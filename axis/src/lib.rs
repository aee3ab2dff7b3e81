//! The controller core: one motion axis in counts and raster steps.
//!
//! An [`Axis`] owns a [`Drive`] and is stepped once a raster [`Period`]. It turns goals (a position, a
//! velocity, standstill) into set-points that keep every limit, and reports what the drive answers.
//! Its only time is the number of steps; all arithmetic is `+ - * /`, `sqrt` and `floor`, so two runs of
//! the same commands agree to the last bit on every machine.

#![forbid(unsafe_code)]

mod axis;
mod controller;
mod drive;
mod generator;
mod inputs;
mod limits;
mod measurement;
mod plant;
mod profile;
mod pulses;
mod servo;
mod status;
mod units;

pub use axis::Axis;
pub use controller::{Coefficients, PositionController};
pub use drive::{Capabilities, Command, Drive, DriveFault, DriveState, Feedback, Switches};
pub use inputs::{Input, Inputs, Latches};
pub use generator::{Creep, Generator, Goal, Stepping};
pub use limits::{Limits, PositionRange};
pub use measurement::{Coding, Counting, Measurement, OutOfRange, Scale, Sensor, SensorConfig};
pub use plant::{
    Amplifier, AmplifierConfig, AmplifierMode, DcLink, EncoderBreak, Load, Noise, Overload, Plant,
    PlantConfig, PlantFault, ScheduledFault, Stepper, StepperConfig, Supply, Thermal,
};
pub use profile::{Profile, SetPoint};
pub use pulses::{InMotion, MAX_QUANTA, PulseOutput, Pulses};
pub use servo::{ServoConfig, SimulatedServo};
pub use status::{Actual, Fault, Motion, Status};
pub use units::{Acceleration, Jerk, Period, Position, Temperature, Torque, Velocity, Voltage};
