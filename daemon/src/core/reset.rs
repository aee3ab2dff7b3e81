//! The reset of a whole network, node by node: it takes some of them 40 us each, and meanwhile steps of others fall due.

use std::collections::VecDeque;

use canopen::{Frame, Id, NmtCommand};
use od::Instant;

use super::wire::Passing;
use super::{Core, SOON};

/// Nodes that are reset at once.
pub(super) const AT_ONCE: usize = 2;

/// A reset that some nodes have still to hear of.
#[derive(Debug)]
pub(super) struct Resetting {
    pub(super) passing: Passing,
    pub(super) hearers: VecDeque<u16>,
}

/// Whether a frame resets every node of its network (CiA 301 v4.2, section 7.2.8.3.1).
pub(super) fn resets_all(frame: &Frame) -> bool {
    const NMT: Id = Id::Standard(0x000);
    const ALL: u8 = 0;
    let resets = [NmtCommand::ResetNode, NmtCommand::ResetCommunication];
    frame.id == NMT && resets.iter().any(|command| *frame.payload() == [*command as u8, ALL])
}

impl Core {
    /// Lets the next nodes hear of it. What is due elsewhere comes before the rest, and before other frames.
    pub(super) fn reset_some(&mut self, now: Instant) {
        let Some(mut resetting) = self.resetting.take() else { return };
        let some = AT_ONCE.min(resetting.hearers.len());
        for hearer in resetting.hearers.drain(..some) {
            let peer = core::mem::replace(&mut self.audit.peer, resetting.passing.sender.peer());
            self.hear(now, usize::from(hearer), &resetting.passing.frame);
            self.audit.peer = peer;
            self.speak_for(now, hearer);
        }
        self.resetting = Some(resetting).filter(|resetting| !resetting.hearers.is_empty());
        self.resume = Some(now + SOON);
    }
}
