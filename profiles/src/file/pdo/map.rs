//! What a PDO carries: the `map` of its table.

use od::{Address, DataType, Direction};

use super::Kind;
use crate::file::object::Objects;
use crate::file::reader::Spanned;
use crate::file::{FIRST_OF_APPLICATION, default};
use crate::{Report, Span};

const PAYLOAD_BITS: u32 = 64;

/// The mapping parameters (0xIIIISSBB) of the entries in `map`.
pub(super) fn parameters(
    map: &[Spanned<&str>],
    capacity: u8,
    kind: Kind,
    objects: &Objects,
    report: &mut Report,
) -> Vec<u32> {
    let mut parameters = Vec::new();
    let mut bits = 0;
    for text in map {
        let Some((address, width)) = field(text.get_ref(), &text.span(), kind, objects, report) else {
            continue;
        };
        bits += u32::from(width);
        if bits > PAYLOAD_BITS || parameters.len() >= usize::from(capacity) {
            let message = format!("{address} does not fit any more");
            report.error(&text.span(), message, format!("this PDO carries 8 bytes and {capacity} entries"));
        }
        parameters.push(u32::from(address.index) << 16 | u32::from(address.sub) << 8 | u32::from(width));
    }
    parameters
}

fn field(
    text: &str,
    span: &Span,
    kind: Kind,
    objects: &Objects,
    report: &mut Report,
) -> Option<(Address, u8)> {
    let address = if text.starts_with(default::REGISTER) {
        default::register(text, span, objects.lists.motor.as_ref()?, report)?.place?
    } else if let Some(address) = address(text) {
        address
    } else {
        let help = "write index and sub-index in hexadecimal, such as `0x6040:00`".to_owned();
        report.error(span, format!("`{text}` is no entry"), help);
        return None;
    };
    if kind.direction == Direction::Receive
        && address.sub == 0
        && let Some(dummy) = DataType::from_code(address.index)
    {
        return dummy.bits().map(|bits| (address, bits));
    }
    let Some(entry) = objects.entry(address) else {
        // An entry that could not be read is reported already.
        if !objects.spans.contains_key(&address) {
            report.error(span, format!("there is no entry {address}"), None);
        }
        return None;
    };
    let allowed = match kind.direction {
        Direction::Receive => entry.mappable.receive(),
        Direction::Transmit => entry.mappable.transmit(),
    };
    match entry.data_type.bits() {
        Some(bits) if allowed && address.index >= FIRST_OF_APPLICATION => Some((address, bits)),
        Some(_) | None => {
            let help = "`pdo = ` of the entry says which PDOs may carry it".to_owned();
            report.error(span, format!("an {} cannot carry {address}", kind.name), help);
            None
        }
    }
}

/// The entry that `0x6040:00` stands for.
pub(in crate::file) fn address(text: &str) -> Option<Address> {
    let (index, sub) = text.strip_prefix("0x")?.split_once(':')?;
    let is_hex = |digits: &str| digits.bytes().all(|c| c.is_ascii_hexdigit());
    let address = Address::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?);
    (is_hex(index) && is_hex(sub)).then_some(address)
}
