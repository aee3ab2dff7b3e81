//! Device profiles: which objects a device has, and what each of them does.
//!
//! A [`Profile`] is read from a TOML file in `devices/`: the objects with type, access and default, the
//! behaviour ([`Binding`]) behind each that has one, the PDOs and the motors to choose from. Adding a device
//! is adding a file. Nothing in here reads files or clocks: the text comes in as an argument.

#![forbid(unsafe_code)]
#![warn(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

mod binding;
mod cia402;
mod defaults;
mod device;
mod diagnostics;
mod eds;
mod error_code;
mod file;
mod jvl;
mod mac4;
mod motor;
mod plant;
mod profile;
mod raster;
mod register;
mod simulated;
mod slots;
mod vendor;

pub use axis::{Input, Position, PositionRange, ScheduledFault, Supply, Velocity, Voltage};
pub use binding::{Binding, UnknownBinding};
pub use cia402::{Command, Controlword, Fault, Mode, State, Statusword, Transition};
pub use defaults::{NoEntry, OwnDefault};
pub use device::{AxisStatus, Device, DeviceEvent, Keep, NoPlant, StoreOrder};
pub use diagnostics::{Diagnostic, Diagnostics, Report, Severity, Span, line_and_column};
pub use error_code::error_text;
pub use file::reader;
pub use mac4::{CardType, Instruction, Mode as Mac4Mode, OverallStatus, SystemStatus, UserStatus};
pub use motor::{Motor, MotorData, MotorKind, StepperMotor};
pub use plant::{
    ANALOG_INPUT_V, EXTERNAL_ENCODER_COUNTS_PER_S, INPUT_WORDS, NoiseSetup, PlantFault, PlantSetup, Repair,
    Signal, SupplySetup, UnknownFault, UnknownSignal,
};
pub use profile::{Bound, Commissioning, Dialect, Identity, Later, Profile, Timing};
pub use register::{Behind, Format, Register, RegisterFile, RegisterList, Role, Space, UnknownRole};
