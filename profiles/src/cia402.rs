//! The drive as IEC 61800-7-201 (CiA 402-2) describes it: state machine, modes, units.

mod drive;
mod fault;
mod limits;
mod position;
mod state;
pub(crate) mod units;
mod velocity;
mod window;
mod word;

pub(crate) use drive::{Context, Drive402};
pub use fault::Fault;
pub(crate) use limits::of_motor as limits_of;
pub use state::{Command, State, Transition};
pub use word::{Controlword, Statusword};

/// Modes of operation, by their number in 0x6060.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(i8)]
pub enum Mode {
    /// None chosen: the axis holds.
    #[default]
    None = 0,
    /// pp
    ProfilePosition = 1,
    /// pv
    ProfileVelocity = 3,
}

impl Mode {
    /// The mode with number `code`, if this version has it.
    #[must_use]
    pub fn from_code(code: i64) -> Option<Self> {
        [Self::None, Self::ProfilePosition, Self::ProfileVelocity].into_iter().find(|m| *m as i64 == code)
    }
}
