//! A Modbus server before a servo: whatever comes in, in whatever segments, it answers the same and never panics.
#![no_main]

use std::sync::{Arc, LazyLock};

use libfuzzer_sys::fuzz_target;
use modbus::{Dialect, Framing, Identification, Map, Permissions, Server, Target, WordOrder};
use od::{Address, Bus, Dictionary, Instant, Origin};
use profiles::Profile;

const ORIGIN: Origin = Origin { bus: Bus::Modbus, link: 0, client: 0 };
const UNIT: u8 = 1;

static PROFILE: LazyLock<Profile> =
    LazyLock::new(|| Profile::embedded("cia402-servo", None).unwrap().unwrap());

/// The answers to `stream`, which comes in segments of the lengths given, the last one again and again.
fn answers(dialect: Dialect, stream: &[u8], segments: &[u8]) -> (Vec<u8>, u64) {
    let schema = &PROFILE.application;
    let slot = |index, sub| schema.slot(Address::new(index, sub)).unwrap();
    let registers = (1..=40).map(|number| (number, slot(0x6040, 0)));
    let map = Map::new(dialect, WordOrder::LowFirst)
        .with_jvl(schema, registers.clone(), registers, None)
        .with_application(schema, &[slot(0x60FE, 1)], &[slot(0x60FD, 0)]);
    let mut dictionary = Dictionary::new(Arc::clone(schema), UNIT);
    let identification = Identification::default();
    let mut server =
        Server::new(Instant::ZERO, Framing::Tcp, ORIGIN, Arc::new(Permissions::default()), None);
    let (mut out, mut rest) = (Vec::new(), stream);
    let mut lengths = segments.iter().map(|length| usize::from(*length).max(1));
    while !rest.is_empty() {
        let segment = &rest[..lengths.next().unwrap_or(rest.len()).min(rest.len())];
        rest = &rest[server.handle_bytes(Instant::ZERO, segment)..];
        while let Some(unit) = server.poll_request() {
            let communication = None;
            let target = Target { map: &map, dictionary: &mut dictionary, communication, identification: &identification };
            server.answer(Instant::ZERO, (unit == UNIT).then_some(target));
            assert!(server.output().len() <= 8 * modbus::MAX_ADU);
            out.extend_from_slice(server.output());
            server.sent(server.output().len());
        }
    }
    (out, dictionary.revision())
}

fuzz_target!(|input: &[u8]| {
    let Some(([dialect, count], rest)) = input.split_first_chunk() else { return };
    let dialect = if dialect & 1 == 1 { Dialect::Jvl } else { Dialect::Full };
    let (segments, stream) = rest.split_at(usize::from(*count).min(rest.len()));
    assert_eq!(answers(dialect, stream, segments), answers(dialect, stream, &[]));
});
