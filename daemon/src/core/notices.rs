//! What is worth telling of devices and nodes, for the log and for the buses.

use std::collections::VecDeque;

use canopen::{Cause, Emergency, ErrorRegister, NmtState};
use profiles::Fault;

use super::Member;

/// What may be worth a line in the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// The device has an error with this code.
    Fault(u16),
    /// The error with this code is over.
    FaultOver(u16),
    /// The node was reset over the bus.
    Reset,
    /// An LSS master has given the node this Node-ID; 255: taken it away.
    NodeId(u8),
    /// The NMT state is now this one.
    Nmt(NmtState),
    /// Somebody whom the node supervises is not there any more.
    ConnectionLost(Cause),
    /// Another node tells an error, or with code zero that one is over (0x1028).
    Emergency {
        /// The Node-ID of the other.
        producer: u8,
        /// What it tells.
        emergency: Emergency,
    },
    /// So many raster steps were dropped, because the device was served too late.
    DroppedSteps(u64),
    /// The Modbus clients were silent for too long.
    ModbusLost,
    /// An axis that was to stop did not come to rest in time: its power is cut.
    PowerCut,
}

/// What was lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Notices that nobody took.
    pub dropped_notices: u64,
}

/// Notices that may wait.
pub(super) const MAX_NOTICES: usize = 256;

/// Lets the nodes of a device tell its fault.
pub(super) fn raise(fault: Fault, members: &mut [Member]) -> Notice {
    let register = ErrorRegister::from_bits_retain(fault.register);
    let emergency = Emergency { code: fault.code, register, detail: fault.detail };
    members.iter_mut().for_each(|member| member.node.raise(emergency));
    Notice::Fault(fault.code)
}

/// Lets them tell that the one with this code is over.
pub(super) fn clear(code: u16, members: &mut [Member]) -> Notice {
    members.iter_mut().for_each(|member| member.node.clear(code));
    Notice::FaultOver(code)
}

/// Tells it, if there is room.
pub(super) fn note(
    notices: &mut VecDeque<(usize, Notice)>,
    counters: &mut Counters,
    unit: usize,
    notice: Notice,
) {
    if notices.len() < MAX_NOTICES {
        notices.push_back((unit, notice));
    } else {
        counters.dropped_notices += 1;
    }
}
