//! The MBAP header (Messaging on TCP/IP V1.0b, section 3.1.3): transaction identifier, protocol identifier, length of
//! what follows, unit identifier.

use super::{Found, Frame};
use crate::MAX_PDU;

/// Bytes of the header before and up to the unit identifier.
const PREFIX: usize = 6;
const HEADER: usize = 7;
/// Protocol identifier of Modbus.
const MODBUS: u16 = 0;

/// What stands at the beginning of `input`.
///
/// A frame of another protocol is skipped as a whole, and so is one that is too short for a PDU: where the next one
/// begins is still known. A length that no frame has says nothing that could be trusted, so the connection is lost;
/// looking for something that resembles a header would take data for requests.
pub(super) fn find(input: &[u8]) -> Found {
    let Some(([t0, t1, p0, p1, l0, l1], rest)) = input.split_first_chunk::<PREFIX>() else {
        return Found::Part;
    };
    let length = usize::from(u16::from_be_bytes([*l0, *l1]));
    if length > MAX_PDU + 1 {
        return Found::Lost;
    }
    if u16::from_be_bytes([*p0, *p1]) != MODBUS || length < 2 {
        return Found::Junk(PREFIX + length);
    }
    match rest.first() {
        Some(unit) if rest.len() >= length => Found::Frame(Frame {
            transaction: u16::from_be_bytes([*t0, *t1]),
            unit: *unit,
            pdu: (HEADER, length - 1),
            length: PREFIX + length,
        }),
        Some(_) | None => Found::Part,
    }
}

pub(super) fn begin(transaction: u16, unit: u8, out: &mut Vec<u8>) {
    let [t0, t1] = transaction.to_be_bytes();
    out.extend([t0, t1, 0, 0, 0, 0, unit]);
}

pub(super) fn end(start: usize, out: &mut [u8]) {
    let length = (out.len() - start - PREFIX) as u16;
    if let Some([.., l0, l1]) = out.get_mut(start..start + PREFIX) {
        [*l0, *l1] = length.to_be_bytes();
    }
}

/// The frame of `pdu` for `unit`.
#[must_use]
pub fn tcp_adu(transaction: u16, unit: u8, pdu: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEADER + pdu.len());
    begin(transaction, unit, &mut out);
    out.extend(pdu);
    end(0, &mut out);
    out
}
