//! Logs of candump in words.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use canopen::{Frame, Id};
use daemon::dump::{Decoder, Known, log_line};
use od::Dictionary;
use profiles::Profile;
use proptest::prelude::*;

/// The profiles that come with the program, read once.
fn profiles() -> &'static BTreeMap<&'static str, Arc<Profile>> {
    static PROFILES: OnceLock<BTreeMap<&'static str, Arc<Profile>>> = OnceLock::new();
    let read = |name| (name, Arc::new(Profile::embedded(name, None).unwrap().unwrap()));
    PROFILES.get_or_init(|| Profile::names().map(read).collect())
}

/// A decoder that knows one node on `can0`.
fn decoder(profile: &str, node_id: u8) -> Decoder {
    let profile = profiles()[profile].clone();
    let communication = Dictionary::new(Arc::clone(&profile.communication), node_id);
    let mut decoder = Decoder::default();
    decoder.learn("can0", Known { node_id, device: "x-axis".to_owned(), profile, communication });
    decoder
}

/// Every frame of a log and what it says.
fn told(log: &str, mut decoder: Decoder) -> String {
    let line = |line: &str| {
        let read = log_line(line).unwrap_or_else(|why| panic!("{line}: {why}"))?;
        let decoded = decoder.decode(&read.interface, &read.frame);
        Some(format!("{:<22} {}", read.frame.to_string(), decoded.text).trim_end().to_owned() + "\n")
    };
    log.lines().filter_map(line).collect()
}

#[test]
fn every_service_is_told_in_words() {
    insta::assert_snapshot!(told(include_str!("recorded/services.log"), decoder("cia402-servo", 2)));
}

#[test]
fn a_session_of_python_canopen_is_told_in_words() {
    insta::assert_snapshot!(told(include_str!("recorded/reference.log"), decoder("canopen-reference", 1)));
}

#[test]
fn of_nodes_that_nobody_knows_the_predefined_connections_are_told() {
    let log = include_str!("recorded/reference.log");
    let told = told(log, Decoder::default());
    assert!(told.contains("SDO to node 1 read 0x1008:00 Manufacturer device name\n"), "{told}");
    assert!(told.contains("TPDO1 node 1\n"), "{told}");
    assert!(told.lines().all(|line| line.len() > 23), "everything is something");
}

#[test]
fn a_value_that_is_longer_than_anything_is_cut() {
    let mut decoder = Decoder::default();
    let mut say = |id: u16, data: [u8; 8]| decoder.decode("can0", &Frame::new(Id::Standard(id), &data)).text;
    say(0x601, [0x20, 0x08, 0x20, 0, 0, 0, 0, 0]);
    for _ in 0..20_000 {
        say(0x601, [0x00, 1, 2, 3, 4, 5, 6, 7]);
    }
    assert_eq!(say(0x601, [0x01; 8]), "SDO to node 1 write 0x2008:00, 140007 bytes");
}

/// Frames that mostly belong to CANopen.
fn frame() -> impl Strategy<Value = Frame> {
    let id = prop_oneof![
        Just(0x000_u16),
        Just(0x080),
        Just(0x100),
        Just(0x602),
        Just(0x582),
        Just(0x182),
        Just(0x202),
        Just(0x702),
        Just(0x7E4),
        Just(0x7E5),
        0_u16..0x800
    ];
    let data = proptest::collection::vec(any::<u8>(), 0..=8);
    (id, data, any::<bool>(), 0_u8..20).prop_map(|(id, data, is_extended, remote)| {
        let id = if is_extended && remote == 1 { Id::Extended(id.into()) } else { Id::Standard(id) };
        if remote == 0 { Frame::remote(id, data.len() as u8) } else { Frame::new(id, &data) }
    })
}

proptest! {
    #[test]
    fn whatever_passes_is_told(frames in proptest::collection::vec(frame(), 0..200)) {
        let mut decoder = decoder("cia402-servo", 2);
        for frame in &frames {
            let decoded = decoder.decode("can0", frame);
            prop_assert!(decoded.text.len() < 2000);
        }
    }
}
