//! `struct can_frame` of Linux (`linux/can.h`) as bytes: identifier with flags, length, three bytes of no meaning
//! for classic frames, eight data bytes. Error frames (`linux/can/error.h`) have the same shape.

use canopen::{BusState, Frame, Id};

/// Size of a classic frame, CAN_MTU.
pub(crate) const SIZE: usize = 16;

/// CAN_EFF_FLAG: a 29-bit identifier.
pub(super) const EXTENDED: u32 = 1 << 31;
/// CAN_RTR_FLAG.
pub(super) const REMOTE: u32 = 1 << 30;
/// CAN_ERR_FLAG: no frame of the bus, but news of the controller.
const ERROR: u32 = 1 << 29;
/// CAN_EFF_MASK.
pub(super) const EXTENDED_MASK: u32 = 0x1FFF_FFFF;
/// CAN_SFF_MASK.
pub(super) const STANDARD_MASK: u32 = 0x7FF;

/// CAN_ERR_CRTL: something about the controller, byte 1 says what.
const CONTROLLER: u32 = 1 << 2;
/// CAN_ERR_BUSOFF.
const BUS_OFF: u32 = 1 << 6;
/// CAN_ERR_RESTARTED: the end of a bus-off.
const RESTARTED: u32 = 1 << 8;
/// The classes of error frames that tell a state. Not CAN_ERR_CNT, the error counters: it accompanies every single
/// bus error, of which there may be thousands a second.
pub(super) const STATE_CLASSES: u32 = CONTROLLER | BUS_OFF | RESTARTED;

/// CAN_ERR_CRTL_RX_PASSIVE and CAN_ERR_CRTL_TX_PASSIVE: a counter is above 127.
const PASSIVE: u8 = 0x10 | 0x20;
/// CAN_ERR_CRTL_RX_WARNING, CAN_ERR_CRTL_TX_WARNING and CAN_ERR_CRTL_ACTIVE: none is.
const ACTIVE: u8 = 0x04 | 0x08 | 0x40;

/// What the kernel delivers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Message {
    /// A frame of the bus.
    Frame(Frame),
    /// The controller is in this state now.
    State(BusState),
    /// An error that changes no state.
    Error,
}

/// The message that `bytes` hold; `None` for lengths above eight.
pub(crate) fn decode(bytes: &[u8; SIZE]) -> Option<Message> {
    let [i0, i1, i2, i3, length, _, _, _, data @ ..] = *bytes;
    let raw = u32::from_ne_bytes([i0, i1, i2, i3]);
    let id = if raw & EXTENDED != 0 {
        Id::Extended(raw & EXTENDED_MASK)
    } else {
        Id::Standard((raw & STANDARD_MASK) as u16)
    };
    let payload = data.get(..usize::from(length))?;
    if raw & ERROR != 0 {
        let status = payload.get(1).copied().unwrap_or(0);
        return Some(state(raw, status).map_or(Message::Error, Message::State));
    }
    let frame = if raw & REMOTE != 0 { Frame::remote(id, length) } else { Frame::new(id, payload) };
    Some(Message::Frame(frame))
}

/// The state that an error frame of these classes tells. Of contradictions the worst counts.
fn state(classes: u32, status: u8) -> Option<BusState> {
    let status = if classes & CONTROLLER != 0 { status } else { 0 };
    if classes & BUS_OFF != 0 {
        Some(BusState::Off)
    } else if status & PASSIVE != 0 {
        Some(BusState::Passive)
    } else if classes & RESTARTED != 0 || status & ACTIVE != 0 {
        Some(BusState::Active)
    } else {
        None
    }
}

/// `frame` as bytes.
pub(crate) fn encode(frame: &Frame) -> [u8; SIZE] {
    let id = match frame.id {
        Id::Standard(id) => u32::from(id) & STANDARD_MASK,
        Id::Extended(id) => id & EXTENDED_MASK | EXTENDED,
    };
    let mut bytes = [0; SIZE];
    let (head, data) = bytes.split_at_mut(SIZE / 2);
    let raw = id | if frame.is_remote { REMOTE } else { 0 };
    for (to, from) in head.iter_mut().zip(raw.to_ne_bytes().into_iter().chain([frame.len() as u8])) {
        *to = from;
    }
    for (to, from) in data.iter_mut().zip(frame.payload()) {
        *to = *from;
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn frames_survive_the_way_through_the_kernel() {
        for frame in [
            Frame::new(Id::Standard(0x601), &[0x40, 0, 0x10, 0, 0, 0, 0, 0]),
            Frame::new(Id::Standard(0x80), &[]),
            Frame::new(Id::Extended(0x1FFF_FFFF), &[1, 2, 3]),
            Frame::remote(Id::Standard(0x181), 4),
            Frame::remote(Id::Extended(0x181), 0),
        ] {
            assert_eq!(decode(&encode(&frame)), Some(Message::Frame(frame)));
        }
    }

    proptest! {
        #[test]
        fn whatever_the_kernel_delivers_is_a_frame_or_none(bytes: [u8; SIZE]) {
            if let Some(Message::Frame(frame)) = decode(&bytes) {
                prop_assert_eq!(decode(&encode(&frame)), Some(Message::Frame(frame)));
            }
        }

        #[test]
        fn an_error_frame_is_never_a_frame_of_the_bus(mut bytes: [u8; SIZE], raw: u32) {
            bytes[..4].copy_from_slice(&(raw | ERROR).to_ne_bytes());
            prop_assert!(!matches!(decode(&bytes), Some(Message::Frame(_))));
        }
    }

    #[test]
    fn more_than_eight_bytes_are_none() {
        for mut bytes in [encode(&Frame::new(Id::Standard(0x601), &[1])), error_frame(0x040, 0)] {
            bytes[4] = 9;
            assert_eq!(decode(&bytes), None);
        }
    }

    #[test]
    fn an_error_frame_tells_the_state_of_the_controller_or_none() {
        let state = |classes, status| decode(&error_frame(classes, status));
        let is = |state| Some(Message::State(state));
        assert_eq!(state(0x040, 0x00), is(BusState::Off));
        assert_eq!(state(0x100, 0x00), is(BusState::Active));
        for (status, expected) in [
            (0x04, BusState::Active), // warnings, which a recovering controller passes, too
            (0x08, BusState::Active),
            (0x40, BusState::Active),
            (0x10, BusState::Passive),
            (0x20, BusState::Passive),
            (0x30, BusState::Passive),
            (0x18, BusState::Passive), // one counter passive, the other only high
        ] {
            assert_eq!(state(0x004, status), is(expected), "{status:#04X}");
            assert_eq!(state(0x204, status), is(expected), "{status:#04X}, with the counters");
        }
        // Contradictions.
        assert_eq!(state(0x044, 0x40), is(BusState::Off));
        assert_eq!(state(0x140, 0x00), is(BusState::Off));
        assert_eq!(state(0x104, 0x10), is(BusState::Passive));
        // Overflows of buffers, other classes, and byte 1 where it means something else or nothing.
        for (classes, status) in [(0x004, 0x00), (0x004, 0x03), (0x002, 0x10), (0x288, 0x40), (0, 0x40)] {
            assert_eq!(state(classes, status), Some(Message::Error), "{classes:#05X} {status:#04X}");
        }
        let mut short = error_frame(0x004, 0x10);
        short[4] = 1;
        assert_eq!(decode(&short), Some(Message::Error));
    }

    fn error_frame(classes: u32, status: u8) -> [u8; SIZE] {
        let mut bytes = [0; SIZE];
        bytes[..4].copy_from_slice(&(ERROR | classes).to_ne_bytes());
        (bytes[4], bytes[9]) = (8, status);
        bytes
    }
}
