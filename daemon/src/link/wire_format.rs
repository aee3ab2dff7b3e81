//! `struct can_frame` of Linux (`linux/can.h`) as bytes: identifier with flags, length, three bytes of no meaning
//! for classic frames, eight data bytes.

use canopen::{Frame, Id};

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

/// The frame that `bytes` hold; `None` for error frames and for lengths above eight.
pub(crate) fn decode(bytes: &[u8; SIZE]) -> Option<Frame> {
    let [i0, i1, i2, i3, length, _, _, _, data @ ..] = *bytes;
    let raw = u32::from_ne_bytes([i0, i1, i2, i3]);
    if raw & ERROR != 0 {
        return None;
    }
    let id = if raw & EXTENDED != 0 {
        Id::Extended(raw & EXTENDED_MASK)
    } else {
        Id::Standard((raw & STANDARD_MASK) as u16)
    };
    let payload = data.get(..usize::from(length))?;
    Some(if raw & REMOTE != 0 { Frame::remote(id, length) } else { Frame::new(id, payload) })
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
            assert_eq!(decode(&encode(&frame)), Some(frame));
        }
    }

    proptest! {
        #[test]
        fn whatever_the_kernel_delivers_is_a_frame_or_none(bytes: [u8; SIZE]) {
            if let Some(frame) = decode(&bytes) {
                prop_assert_eq!(decode(&encode(&frame)), Some(frame));
            }
        }
    }

    #[test]
    fn what_is_no_frame_of_the_bus_is_none() {
        let mut bytes = encode(&Frame::new(Id::Standard(0x601), &[1]));
        bytes[4] = 9;
        assert_eq!(decode(&bytes), None);
        let mut error = [0; SIZE];
        error[..4].copy_from_slice(&(ERROR | 4).to_ne_bytes());
        error[4] = 8;
        assert_eq!(decode(&error), None);
    }
}
