//! 4.1-4.9: the object dictionary against the data sheet, entry by entry.

use od::{AbortCode, Access, Address, Entry, Initial, Range, Value};

use crate::tool::Tool;

/// The bytes an SDO carries for a value of the entry.
fn bytes(entry: &Entry, value: &Value) -> Vec<u8> {
    match value {
        Value::Fixed(raw) => raw.to_le_bytes()[..entry.data_type.bytes().unwrap()].to_vec(),
        Value::Bytes(bytes) => bytes.to_vec(),
    }
}

/// An empty place of the error history has no data.
fn is_history(address: Address) -> bool {
    address.index == 0x1003 && address.sub > 0
}

/// The device with all PDOs out of use, so that all their parameters may be written.
fn configurable() -> Tool {
    let mut tool = Tool::new();
    for communication in (0x1400..0x1408).chain(0x1800..0x1808) {
        tool.invalidate(communication);
        tool.write(communication + 0x200, 0, &[0]).unwrap();
    }
    tool
}

/// Whether an entry takes a signature and reads something else (ObjFlags in an EDS).
fn is_order(address: Address) -> bool {
    matches!(address.index, 0x1010 | 0x1011) && address.sub > 0
}

#[test]
fn cct_4_01_and_4_07_every_entry_has_the_access_it_says() {
    let mut tool = configurable();
    for (address, entry) in tool.entries() {
        let Address { index, sub } = address;
        let value = tool.read(index, sub);
        let zero = bytes(&entry, &Value::zero(entry.data_type));
        let written = tool.write(index, sub, value.as_ref().unwrap_or(&zero));
        let (can_read, can_write) = match entry.access {
            Access::Const | Access::ReadOnly => (Ok(()), Err(AbortCode::ReadOnly)),
            Access::ReadWrite if is_order(address) => (Ok(()), Err(AbortCode::CannotStore)),
            Access::ReadWrite => (Ok(()), Ok(())),
            Access::WriteOnly => (Err(AbortCode::WriteOnly), Ok(())),
        };
        let can_read = if is_history(address) { Err(AbortCode::NoData) } else { can_read };
        assert_eq!((value.map(drop), written), (can_read, can_write), "{address}");
    }
}

#[test]
fn cct_4_02_and_4_08_every_entry_starts_with_its_default() {
    let mut tool = Tool::new();
    for (address, entry) in tool.entries() {
        if !entry.access.is_readable() || is_history(address) {
            continue;
        }
        let default = match &entry.initial {
            Initial::Value(value) => value.clone(),
            Initial::PlusNodeId(base) => Value::Fixed(u64::from(*base) + 1),
        };
        assert_eq!(tool.read(address.index, address.sub).unwrap(), bytes(&entry, &default), "{address}");
    }
}

#[test]
fn cct_4_03_what_is_read_only_is_not_written() {
    let mut tool = Tool::new();
    for (address, entry) in tool.entries() {
        if matches!(entry.access, Access::Const | Access::ReadOnly) {
            let length = entry.data_type.bytes().unwrap_or(4);
            let refused = tool.write(address.index, address.sub, &vec![0x20; length]);
            assert_eq!(refused, Err(AbortCode::ReadOnly), "{address}");
        }
    }
}

#[test]
fn cct_4_04_what_is_write_only_is_not_read() {
    let mut tool = Tool::new();
    for (address, _) in tool.entries().into_iter().filter(|(_, entry)| entry.access == Access::WriteOnly) {
        assert_eq!(tool.read(address.index, address.sub), Err(AbortCode::WriteOnly), "{address}");
    }
}

#[test]
fn cct_4_06_every_limit_is_kept() {
    let mut tool = Tool::new();
    let mut ranges = 0;
    for (address, entry) in tool.entries() {
        let Some(Range::Integer { min, max }) = entry.range else { continue };
        let mut write = |number: i128| {
            let Some(value) = Value::integer(entry.data_type, number) else { panic!("{number}") };
            tool.write(address.index, address.sub, &bytes(&entry, &value))
        };
        assert_eq!((write(min), write(max)), (Ok(()), Ok(())), "{address}");
        assert_eq!(write(min - 1), Err(AbortCode::ValueTooLow), "{address}");
        assert_eq!(write(max + 1), Err(AbortCode::ValueTooHigh), "{address}");
        ranges += 1;
    }
    assert!(ranges >= 7);
}

#[test]
fn cct_4_09_what_is_read_is_written_back_and_read_again() {
    let mut tool = configurable();
    for (address, entry) in tool.entries() {
        if entry.access == Access::ReadWrite && !is_order(address) {
            let value = tool.read(address.index, address.sub).unwrap();
            assert_eq!(tool.write(address.index, address.sub, &value), Ok(()), "{address}");
            assert_eq!(tool.read(address.index, address.sub), Ok(value), "{address}");
        }
    }
}
