//! The vocabulary of MACCON's MAC4 axis controllers: INC, SSI and STP.
//!
//! Sections are those of the MAC4 User Manual. A card has four axes; each has a record of instructions
//! ([`Instruction`]) whose sub-indices are the instruction codes. What an instruction demands becomes a [`Job`](job::Job)
//! that E executes, and a job becomes orders for the axis. What an axis cannot know alone (a message with its
//! response, the watchdog, the emergency stop, the stop bits) is the matter of the [`Card`].

mod card;
mod controller;
mod drive;
mod errors;
mod instruction;
mod job;
mod justify;
mod mode;
mod owner;
mod record;
mod setup;
mod status;
mod units;
mod veto;

pub use instruction::Instruction;
pub use mode::Mode;
pub use status::{OverallStatus, SystemStatus, UserStatus};

pub(crate) use card::{Answer, Card, Message};
pub(crate) use controller::{Controller, Outcome};
pub(crate) use drive::simulated;
pub(crate) use owner::check_controlword;
pub(crate) use record::Record;
pub(crate) use units::{CYCLE, periods};
pub(crate) use veto::veto;

/// The kind of a card (section 1.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CardType {
    /// ±10 V outputs, incremental encoders.
    Inc,
    /// ±10 V outputs, absolute encoders with SSI.
    Ssi,
    /// Pulse outputs for stepper motors.
    Stp,
}

impl CardType {
    /// Whether the position controller is on the card (section 5.16).
    pub(crate) fn has_controller(self) -> bool {
        match self {
            Self::Inc | Self::Ssi => true,
            Self::Stp => false,
        }
    }

    /// Bits 24-31 of VER (section 6.1).
    fn number(self) -> u8 {
        match self {
            Self::Inc => 0,
            Self::Ssi => 1,
            Self::Stp => 2,
        }
    }
}
