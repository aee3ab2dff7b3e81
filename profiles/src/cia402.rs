//! The drive as IEC 61800-7-201 (CiA 402-2) describes it: state machine, modes, units.

mod context;
mod drive;
mod fault;
pub(crate) mod inputs_outputs;
mod limits;
mod modes;
mod options;
mod ramps;
mod rpm;
mod set_points;
mod state;
pub(crate) mod touch_probe;
pub(crate) mod units;
mod watch;
mod window;
mod word;

pub(crate) use context::{Context, View};
pub(crate) use drive::Drive402;
pub use fault::Fault;
pub(crate) use limits::of_motor as limits_of;
pub use modes::Mode;
pub(crate) use modes::is_homing_method;
pub(crate) use options::AbortConnection;
pub(crate) use ramps::{JERK_LIMITED, LINEAR};
pub(crate) use rpm::RpmUnits;
pub(crate) use set_points::SetPoints;
pub use state::{Command, State, Transition};
pub use word::{Controlword, Statusword};
