//! What went wrong at a node, in plain values for display. Nothing in the node depends on it.

use od::{AbortCode, Address, Instant};

use super::{Cause, Node};
use crate::sdo::ABORT;
use crate::{Emergency, Frame, Recent};

/// What went wrong at a node since power-on; a reset by NMT forgets nothing of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics {
    /// Emergencies that the node sent; code zero: an error was over.
    pub sent: Recent<Emergency>,
    /// Emergencies of others (0x1028) and the Node-IDs that they came from.
    pub heard: Recent<(u8, Emergency)>,
    /// Transfers that its SDO servers aborted.
    pub aborts: Recent<Abort>,
    /// Connections that it lost.
    pub lost: Recent<Cause>,
}

/// The end of an SDO transfer by the server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abort {
    /// What the transfer was about.
    pub address: Address,
    /// Why it ended.
    pub code: AbortCode,
}

impl Abort {
    /// The abort in an answer of a server, if it is one.
    pub(super) fn of(answer: &Frame) -> Option<Self> {
        let [ABORT, low, high, sub, code @ ..] = answer.eight()? else { return None };
        let address = Address::new(u16::from_le_bytes([low, high]), sub);
        Some(Self { address, code: AbortCode::from_code(u32::from_le_bytes(code))? })
    }
}

impl Node {
    /// What went wrong since power-on.
    #[must_use]
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.diagnostics
    }

    /// The errors that stand now, in the order in which they came.
    #[must_use]
    pub fn errors(&self) -> &[Emergency] {
        self.emcy.active()
    }

    /// Sends an emergency.
    pub(super) fn send_emergency(&mut self, now: Instant, frame: Frame) {
        if let Some(message) = frame.eight() {
            self.diagnostics.sent.note(now, Emergency::decode(message));
        }
        self.send(frame);
    }

    /// Sends an answer of an SDO server.
    pub(super) fn send_answer(&mut self, now: Instant, answer: Frame) {
        if let Some(abort) = Abort::of(&answer) {
            self.diagnostics.aborts.note(now, abort);
        }
        self.traffic.sdo_answers += 1;
        self.send(answer);
    }
}
