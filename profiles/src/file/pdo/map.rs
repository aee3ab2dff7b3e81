//! What a PDO carries: the `map` of its table, entries such as `0x6040:00`, motor registers by role such as
//! `$REGISTER.p_ist`, or the low bits of either such as `$REGISTER.v_ist/16`.

use od::{Address, DataType, Direction, Entry};

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
    let (whole, bits) = text.split_once('/').map_or((text, None), |(whole, bits)| (whole, Some(bits)));
    let address = place(whole, span, objects, report)?;
    if kind.direction == Direction::Receive
        && address.sub == 0
        && bits.is_none()
        && let Some(dummy) = DataType::from_code(address.index)
    {
        return dummy.bits().map(|bits| (address, bits));
    }
    let entry = entry(address, span, objects, report)?;
    let allowed = match kind.direction {
        Direction::Receive => entry.mappable.receive(),
        Direction::Transmit => entry.mappable.transmit(),
    };
    let Some(whole) = entry.data_type.bits().filter(|_| allowed && address.index >= FIRST_OF_APPLICATION)
    else {
        let help = "`pdo = ` of the entry says which PDOs may carry it".to_owned();
        report.error(span, format!("an {} cannot carry {address}", kind.name), help);
        return None;
    };
    let width = bits.map_or(Some(whole), |bits| part(bits, entry));
    if width.is_none() {
        let help = "`halves = ` of an object says of which registers a PDO may carry 16 bits".to_owned();
        report.error(span, format!("a PDO cannot carry `{text}`"), help);
    }
    width.map(|width| (address, width))
}

/// The entry of the device that `text` stands for.
pub(super) fn known(text: &str, span: &Span, objects: &Objects, report: &mut Report) -> Option<Address> {
    let address = place(text, span, objects, report)?;
    entry(address, span, objects, report).map(|_| address)
}

fn entry<'o>(address: Address, span: &Span, objects: &'o Objects, report: &mut Report) -> Option<&'o Entry> {
    let entry = objects.entry(address);
    // An entry that could not be read is reported already.
    if entry.is_none() && !objects.spans.contains_key(&address) {
        report.error(span, format!("there is no entry {address}"), None);
    }
    entry
}

/// The width of the part of `entry` that has so many bits.
fn part(bits: &str, entry: &Entry) -> Option<u8> {
    let bits = bits.parse().ok()?;
    (entry.part?.bits() == Some(bits)).then_some(bits)
}

/// Where the entry stands that `0x6040:00` or `$REGISTER.p_ist` names.
fn place(text: &str, span: &Span, objects: &Objects, report: &mut Report) -> Option<Address> {
    if text.starts_with(default::REGISTER) {
        return default::register(text, span, objects.lists.motor.as_ref()?, report)?.place;
    }
    let address = address(text);
    if address.is_none() {
        let help = "write index and sub-index in hexadecimal, such as `0x6040:00`".to_owned();
        report.error(span, format!("`{text}` is no entry"), help);
    }
    address.map(|address| objects.of_axis(address))
}

/// The entry that `0x6040:00` stands for.
pub(in crate::file) fn address(text: &str) -> Option<Address> {
    let (index, sub) = text.strip_prefix("0x")?.split_once(':')?;
    let is_hex = |digits: &str| digits.bytes().all(|c| c.is_ascii_hexdigit());
    let address = Address::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?);
    (is_hex(index) && is_hex(sub)).then_some(address)
}
