//! Every object, by what the schema says of it.

mod bench;

use bench::Bench;
use od::{AbortCode, Access, Address, Entry, Value};

/// Every entry of both areas.
fn entries(bench: &Bench) -> Vec<(Address, Entry)> {
    let communication = bench.node.communication().schema().entries();
    let all = communication.chain(bench.device.schema().entries());
    all.map(|(address, entry)| (address, entry.clone())).collect()
}

fn is_empty_history(address: Address) -> bool {
    address.index == 0x1003 && address.sub > 0
}

// CCT 4.1, 4.2, 4.4, 4.7
#[test]
fn every_readable_entry_shows_its_default() {
    let mut bench = Bench::new();
    for (address, entry) in entries(&bench) {
        let area = if address.index < 0x2000 { bench.node.communication() } else { &bench.device };
        let value = area.value(area.find(address).unwrap()).cloned().unwrap();
        let expected = match value {
            _ if entry.access == Access::WriteOnly => Err(AbortCode::WriteOnly),
            _ if is_empty_history(address) => Err(AbortCode::NoData),
            Value::Fixed(raw) => Ok(raw.to_le_bytes()[..entry.data_type.bytes().unwrap()].to_vec()),
            Value::Bytes(bytes) => Ok(bytes.to_vec()),
        };
        assert_eq!(bench.upload(address), expected, "{address}");
    }
}

// CCT 4.3
#[test]
fn every_entry_that_is_read_only_refuses_what_it_shows() {
    let mut bench = Bench::new();
    for (address, entry) in entries(&bench) {
        if matches!(entry.access, Access::ReadOnly | Access::Const) {
            let shown = bench.upload(address).unwrap_or(vec![0; 4]);
            assert_eq!(bench.download(address, &shown), Err(AbortCode::ReadOnly), "{address}");
        }
    }
}

// CCT 4.9
#[test]
fn every_entry_that_may_be_written_takes_back_what_it_shows() {
    let mut bench = Bench::new();
    for (address, entry) in entries(&bench) {
        let is_mapping = matches!(address.index, 0x1600..=0x1601 | 0x1A00..=0x1A01);
        if entry.access == Access::ReadWrite {
            let shown = bench.upload(address).unwrap();
            let expected = if is_mapping { Err(AbortCode::UnsupportedAccess) } else { Ok(()) };
            assert_eq!(bench.download(address, &shown), expected, "{address}");
            assert_eq!(bench.upload(address), Ok(shown), "{address}");
        }
    }
}

// CCT 2.8, 2.9
#[test]
fn every_entry_of_fixed_length_refuses_another_one() {
    let mut bench = Bench::new();
    for (address, entry) in entries(&bench) {
        let Some(size) = entry.data_type.bytes().filter(|_| entry.access == Access::ReadWrite) else {
            continue;
        };
        assert_eq!(bench.download(address, &[0; 9][..=size]), Err(AbortCode::TooLong), "{address}");
        assert_eq!(bench.download(address, &[0; 9][..size - 1]), Err(AbortCode::TooShort), "{address}");
    }
}

/// What may not have a restricted CAN-ID.
const RESTRICTED: [(u16, u8); 10] = [
    (0x1005, 0),
    (0x1012, 0),
    (0x1014, 0),
    (0x1028, 1),
    (0x1201, 1),
    (0x1201, 2),
    (0x1400, 1),
    (0x1800, 1),
    (0x1402, 1),
    (0x1802, 1),
];

// CCT 8.10
#[test]
fn restricted_identifiers_are_refused_everywhere() {
    let restricted = (0x000..=0x07F_u32)
        .chain(0x101..=0x180)
        .chain(0x581..=0x5FF)
        .chain(0x601..=0x67F)
        .chain(0x6E0..=0x6FF)
        .chain(0x701..=0x7FF);
    let mut bench = Bench::new();
    for identifier in restricted {
        for (index, sub) in RESTRICTED {
            let refused = bench.download(Address::new(index, sub), &identifier.to_le_bytes());
            assert_eq!(refused, Err(AbortCode::InvalidValue), "{index:04X} {identifier:03X}");
        }
    }
}
