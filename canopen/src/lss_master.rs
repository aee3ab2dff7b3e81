//! The LSS master (CiA 305 v3.0) without I/O: one task at a time, frames and the time in, frames and the outcome out.
//!
//! Any number of slaves may answer a question that is put to all of them, so the master waits a while for each answer to
//! such a question and only then goes on; the task "fastscan" puts up to 133 of them.

use core::fmt;
use core::time::Duration;

use od::Instant;

use crate::lss::command::{
    CONFIGURE_NODE_ID, FASTSCAN, IDENTIFIED, INQUIRE_NODE_ID, STORE, SWITCH_GLOBAL, SWITCH_SELECTIVE,
    SWITCHED,
};
use crate::lss::{LssAddress, REQUEST};
use crate::{Frame, Id};

/// How long slaves have for an answer to a question that is put to all of them.
const WINDOW: Duration = Duration::from_millis(25);
/// How long the one that is selected has; it may have to write to a disk.
const PATIENCE: Duration = Duration::from_secs(3);

/// What is to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LssTask {
    /// Find a slave without a Node-ID by fastscan.
    Scan,
    /// Give a slave this Node-ID, 1-127, and let it store that: the slave with this address (0x1018), or by fastscan one
    /// without a Node-ID.
    Configure {
        /// Node-ID.
        node_id: u8,
        /// Vendor-ID, product code, revision number and serial number.
        address: Option<LssAddress>,
    },
    /// Ask the slave with this address for its Node-ID.
    Inquire(LssAddress),
}

/// What a task has come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LssFound {
    /// Vendor-ID, product code, revision number and serial number.
    pub address: LssAddress,
    /// The Node-ID that the slave has or gets, [`crate::UNCONFIGURED`] if none.
    pub node_id: u8,
}

/// Why a task has failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LssFailure {
    /// No slave answers to that.
    NoSlave,
    /// A slave that had answered answers no more.
    Lost,
    /// The slave refuses the Node-ID, with this error code.
    NodeIdRefused(u8),
    /// The slave cannot store, with this error code.
    NotStored(u8),
}

impl fmt::Display for LssFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSlave => write!(f, "no slave answers"),
            Self::Lost => write!(f, "the slave answers no more"),
            Self::NodeIdRefused(code) => write!(f, "the slave refuses the Node-ID, error code {code}"),
            Self::NotStored(code) => write!(f, "the slave does not store the Node-ID, error code {code}"),
        }
    }
}

/// What is to be done now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LssStep {
    /// Send this and call again.
    Send(Frame),
    /// Call again at this time, or with the next answer.
    Wait(Instant),
    /// The task is over.
    Done(Result<LssFound, LssFailure>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// All slaves are to wait.
    Begin,
    /// Whether there is anybody to scan for.
    Probe,
    /// Whether this bit, of the part of this number, is zero.
    Scan {
        part: u8,
        bit: u8,
    },
    /// Whether this part is right.
    Confirm {
        part: u8,
    },
    /// The address goes out part by part.
    Select {
        part: u8,
    },
    Inquire,
    Configure,
    Store,
    /// All slaves are to wait again; this is the outcome.
    End(Result<LssFound, LssFailure>),
    Over,
}

/// A master with a task.
#[derive(Clone, Debug)]
pub struct LssMaster {
    task: LssTask,
    phase: Phase,
    address: LssAddress,
    /// How long the present question may be answered; `None` if it is still to be put.
    patience: Option<Duration>,
    /// Until when; `None` until it is sent.
    deadline: Option<Instant>,
    is_answered: bool,
    /// How long slaves have for an answer to a question that is put to all of them.
    window: Duration,
}

impl LssMaster {
    /// A master that is to do this.
    #[must_use]
    pub fn new(task: LssTask) -> Self {
        let address = match task {
            LssTask::Configure { address: Some(address), .. } | LssTask::Inquire(address) => address,
            LssTask::Scan | LssTask::Configure { address: None, .. } => [0; 4],
        };
        let phase = Phase::Begin;
        Self { task, phase, address, patience: None, deadline: None, is_answered: false, window: WINDOW }
    }

    /// The same one that waits so long for the first answer to a question that is put to all slaves, for networks or
    /// machines that are slow. Once there is one it waits for others as ever.
    #[must_use]
    pub fn with_window(mut self, window: Duration) -> Self {
        self.window = window.max(WINDOW);
        self
    }

    /// What is to be done at `now`; `answer` is what a slave has said since, if one has (0x7E4, eight bytes).
    pub fn next(&mut self, now: Instant, answer: Option<[u8; 8]>) -> LssStep {
        let Some(patience) = self.patience else { return self.ask() };
        // The time runs from when the question was sent, however long that took.
        let deadline = *self.deadline.get_or_insert(now + patience);
        if let Some([specifier, first, ..]) = answer {
            match (self.phase, specifier) {
                (Phase::Probe | Phase::Scan { .. } | Phase::Confirm { .. }, IDENTIFIED) => {
                    if !core::mem::replace(&mut self.is_answered, true) {
                        self.deadline = Some(deadline.min(now + WINDOW));
                    }
                }
                (Phase::Select { part: 3 }, SWITCHED) => {
                    return self.go_on(Phase::after_selection(self.task));
                }
                (Phase::Inquire, INQUIRE_NODE_ID) => return self.end(Ok(first)),
                (Phase::Configure, CONFIGURE_NODE_ID) if first == 0 => return self.go_on(Phase::Store),
                (Phase::Configure, CONFIGURE_NODE_ID) => {
                    return self.end(Err(LssFailure::NodeIdRefused(first)));
                }
                (Phase::Store, STORE) if first == 0 => return self.end(Ok(self.node_id())),
                (Phase::Store, STORE) => return self.end(Err(LssFailure::NotStored(first))),
                // Somebody answers what was not asked.
                (_, _) => {}
            }
        }
        let deadline = self.deadline.unwrap_or(deadline);
        if now < deadline { LssStep::Wait(deadline) } else { self.expire() }
    }

    /// The time for answers is over.
    fn expire(&mut self) -> LssStep {
        let is_answered = core::mem::take(&mut self.is_answered);
        match self.phase {
            Phase::Begin => self.go_on(Phase::first(self.task)),
            Phase::Probe if is_answered => self.go_on(Phase::Scan { part: 0, bit: 31 }),
            Phase::Probe | Phase::Select { part: 3 } => self.end(Err(LssFailure::NoSlave)),
            Phase::Scan { part, bit } => {
                if let Some(number) = self.address.get_mut(usize::from(part)).filter(|_| !is_answered) {
                    *number |= 1 << bit;
                }
                let next =
                    bit.checked_sub(1).map_or(Phase::Confirm { part }, |bit| Phase::Scan { part, bit });
                self.go_on(next)
            }
            Phase::Confirm { .. } if !is_answered => self.end(Err(LssFailure::Lost)),
            Phase::Confirm { part: 3 } => self.go_on(Phase::after_selection(self.task)),
            Phase::Confirm { part } => self.go_on(Phase::Scan { part: part + 1, bit: 31 }),
            Phase::Select { part } => self.go_on(Phase::Select { part: part + 1 }),
            Phase::Inquire | Phase::Configure | Phase::Store => self.end(Err(LssFailure::Lost)),
            Phase::End(outcome) => {
                self.phase = Phase::Over;
                LssStep::Done(outcome)
            }
            Phase::Over => LssStep::Done(Err(LssFailure::Lost)),
        }
    }

    fn go_on(&mut self, phase: Phase) -> LssStep {
        (self.phase, self.deadline, self.is_answered) = (phase, None, false);
        self.ask()
    }

    /// Lets all slaves wait again; one that was configured starts with its Node-ID by that.
    fn end(&mut self, outcome: Result<u8, LssFailure>) -> LssStep {
        let found = outcome.map(|node_id| LssFound { address: self.address, node_id });
        self.go_on(Phase::End(found))
    }

    fn node_id(&self) -> u8 {
        match self.task {
            LssTask::Configure { node_id, .. } => node_id,
            LssTask::Scan | LssTask::Inquire(_) => crate::UNCONFIGURED,
        }
    }

    /// Puts the question of the present phase.
    fn ask(&mut self) -> LssStep {
        let number = |part: u8| self.address.get(usize::from(part)).copied().unwrap_or(0);
        let (message, time) = match self.phase {
            Phase::Begin | Phase::End(_) => ([SWITCH_GLOBAL, 0, 0, 0, 0, 0, 0, 0], WINDOW),
            Phase::Probe => (fastscan(0, 0x80, 0, 0), self.window),
            Phase::Scan { part, bit } => (fastscan(number(part), bit, part, part), self.window),
            Phase::Confirm { part } => (fastscan(number(part), 0, part, (part + 1) % 4), self.window),
            Phase::Select { part: 3 } => (with_number(SWITCH_SELECTIVE + 3, number(3)), PATIENCE),
            Phase::Select { part } => (with_number(SWITCH_SELECTIVE + part, number(part)), Duration::ZERO),
            Phase::Inquire => ([INQUIRE_NODE_ID, 0, 0, 0, 0, 0, 0, 0], PATIENCE),
            Phase::Configure => ([CONFIGURE_NODE_ID, self.node_id(), 0, 0, 0, 0, 0, 0], PATIENCE),
            Phase::Store => ([STORE, 0, 0, 0, 0, 0, 0, 0], PATIENCE),
            Phase::Over => return LssStep::Done(Err(LssFailure::Lost)),
        };
        self.patience = Some(time);
        LssStep::Send(Frame::new(Id::Standard(REQUEST), &message))
    }
}

impl Phase {
    fn first(task: LssTask) -> Self {
        match task {
            LssTask::Scan | LssTask::Configure { address: None, .. } => Self::Probe,
            LssTask::Configure { address: Some(_), .. } | LssTask::Inquire(_) => Self::Select { part: 0 },
        }
    }

    fn after_selection(task: LssTask) -> Self {
        match task {
            LssTask::Configure { .. } => Self::Configure,
            LssTask::Scan | LssTask::Inquire(_) => Self::Inquire,
        }
    }
}

pub(crate) fn with_number(specifier: u8, number: u32) -> [u8; 8] {
    let [a, b, c, d] = number.to_le_bytes();
    [specifier, a, b, c, d, 0, 0, 0]
}

fn fastscan(number: u32, bit: u8, part: u8, next: u8) -> [u8; 8] {
    let [a, b, c, d] = number.to_le_bytes();
    [FASTSCAN, a, b, c, d, bit, part, next]
}
