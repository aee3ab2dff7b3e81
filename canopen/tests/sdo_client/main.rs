//! The SDO client (CiA 301 v4.2, section 7.2.4.3): byte for byte, against our own server whatever the bus does to their frames,
//! and against servers that mean no good.

#[path = "../bench/mod.rs"]
mod bench;
mod pair;

use core::time::Duration;

use bench::{Bench, frame_of};
use canopen::{Frame, Id, SdoClient, SdoError, SdoEvent, SdoMode};
use od::{AbortCode, Access, Address, DataType, Dictionary, Entry, Instant, Object, Schema, Value};
use pair::{Fate, Pair};
use proptest::collection::vec;
use proptest::prelude::*;

const DOMAIN: Address = Address::new(0x200F, 0);
const BLOCKS: SdoMode = SdoMode::Block { threshold: 0 };
const LIMIT: usize = 100_000;

fn pattern(len: usize) -> Vec<u8> {
    (0..len).map(|i| (i * 7 + i / 256) as u8).collect()
}

fn all_is_well(_: bool, _: &Frame) -> Fate {
    Fate::Arrives
}

fn uploaded(data: &[u8]) -> SdoEvent {
    SdoEvent::Uploaded { address: DOMAIN, data: data.to_vec() }
}

const DOWNLOADED: SdoEvent = SdoEvent::Downloaded { address: DOMAIN };

/// A client alone: what it sends, and what it is sent (`<`).
fn talk(client: &mut SdoClient, script: &str) {
    let now = Instant::ZERO;
    for line in script.lines().map(|line| line.split("//").next().unwrap().trim()).filter(|l| !l.is_empty()) {
        match line.split_once(' ').unwrap() {
            ("<", frame) => client.handle_frame(now, &frame_of(frame)),
            (_, frame) => assert_eq!(client.poll_transmit(), Some(frame_of(frame)), "{line}"),
        }
    }
    assert_eq!(client.poll_transmit(), None);
}

#[test]
fn a_short_value_is_read_and_written_in_one_message_each() {
    let mut client = SdoClient::of_node(1);
    let address = Address::new(0x1017, 0);
    assert!(client.upload(Instant::ZERO, address, 8, SdoMode::Ordinary));
    talk(&mut client, "> 601#4017100000000000\n< 581#4B171000E8030000");
    assert_eq!(client.poll_event(), Some(SdoEvent::Uploaded { address, data: vec![0xE8, 0x03] }));
    assert!(client.download(Instant::ZERO, address, vec![0xE8, 0x03], SdoMode::Ordinary));
    talk(&mut client, "> 601#2B171000E8030000\n< 581#6017100000000000");
    assert_eq!(client.poll_event(), Some(SdoEvent::Downloaded { address }));
    assert_eq!(client.poll_timeout(), None);
}

#[test]
fn a_server_that_does_not_tell_the_size_of_a_short_value_is_taken_to_mean_four_bytes() {
    let mut client = SdoClient::of_node(1);
    let address = Address::new(0x1000, 0);
    assert!(client.upload(Instant::ZERO, address, 8, SdoMode::Ordinary));
    talk(&mut client, "> 601#4000100000000000\n< 581#4200100092010200");
    assert_eq!(client.poll_event(), Some(SdoEvent::Uploaded { address, data: vec![0x92, 1, 2, 0] }));
}

#[test]
fn a_string_is_read_and_written_in_segments() {
    let mut client = SdoClient::of_node(1);
    let address = Address::new(0x1008, 0);
    assert!(client.upload(Instant::ZERO, address, 12, SdoMode::Ordinary));
    talk(
        &mut client,
        "
        > 601#4008100000000000
        < 581#410810000C000000
        > 601#6000000000000000
        < 581#0042656E63682064 // 'Bench d'
        > 601#7000000000000000
        < 581#1565766963650000 // 'evice'
        ",
    );
    let data = b"Bench device".to_vec();
    assert_eq!(client.poll_event(), Some(SdoEvent::Uploaded { address, data: data.clone() }));
    assert!(client.download(Instant::ZERO, address, data, SdoMode::Ordinary));
    talk(
        &mut client,
        "
        > 601#210810000C000000
        < 581#6008100000000000
        > 601#0042656E63682064
        < 581#2000000000000000
        > 601#1565766963650000
        < 581#3000000000000000
        ",
    );
    assert_eq!(client.poll_event(), Some(SdoEvent::Downloaded { address }));
}

#[test]
fn a_string_is_read_and_written_in_one_block() {
    let mut client = SdoClient::of_node(1);
    let address = Address::new(0x1008, 0);
    assert!(client.upload(Instant::ZERO, address, 12, BLOCKS));
    talk(
        &mut client,
        "
        > 601#A40810007F000000
        < 581#C60810000C000000
        > 601#A300000000000000
        < 581#0142656E63682064
        < 581#8265766963650000
        > 601#A2027F0000000000
        < 581#C943870000000000 // two bytes too many, CRC 8743
        > 601#A100000000000000
        ",
    );
    let data = b"Bench device".to_vec();
    assert_eq!(client.poll_event(), Some(SdoEvent::Uploaded { address, data: data.clone() }));
    assert!(client.download(Instant::ZERO, address, data, BLOCKS));
    talk(
        &mut client,
        "
        > 601#C60810000C000000
        < 581#A408100001000000 // one segment in a block
        > 601#0142656E63682064
        < 581#A201020000000000 // two in the next
        > 601#8165766963650000
        < 581#A201020000000000
        > 601#C943870000000000
        < 581#A100000000000000
        ",
    );
    assert_eq!(client.poll_event(), Some(SdoEvent::Downloaded { address }));
}

#[test]
fn a_server_may_send_a_short_value_the_ordinary_way() {
    let mut client = SdoClient::of_node(1);
    let address = Address::new(0x1000, 0);
    assert!(client.upload(Instant::ZERO, address, 4, SdoMode::Block { threshold: 4 }));
    talk(&mut client, "> 601#A40010007F040000\n< 581#4300100092010200");
    assert_eq!(client.poll_event(), Some(SdoEvent::Uploaded { address, data: vec![0x92, 1, 2, 0] }));
}

#[test]
fn every_size_goes_both_ways_in_every_mode() {
    let modes = [SdoMode::Ordinary, BLOCKS, SdoMode::Block { threshold: 40 }];
    for size in (0..=150).chain([889, 890, 896, 1778, 7000, LIMIT]) {
        let data = pattern(size);
        for mode in modes {
            let mut pair = Pair::new();
            assert_eq!(pair.download(&data, mode, all_is_well), DOWNLOADED, "{size} {mode:?}");
            assert_eq!(pair.stored(), data, "{size} {mode:?}");
            assert_eq!(pair.upload(mode, all_is_well), uploaded(&data), "{size} {mode:?}");
            pair.run_out();
        }
    }
}

#[test]
fn every_block_size_works() {
    let data = pattern(2000);
    for segments in 1..=127 {
        let mut pair = Pair::server_with(&data);
        pair.client.set_block_size(segments);
        assert_eq!(pair.upload(BLOCKS, all_is_well), uploaded(&data), "{segments}");
    }
}

#[test]
fn any_lost_segment_of_a_block_is_asked_for_again() {
    let data = pattern(7 * 60);
    for lost in 0..60 {
        let mut pair = Pair::server_with(&data);
        pair.client.set_block_size(20);
        let mut count = 0;
        let fate = |is_request: bool, frame: &Frame| {
            // The answers that begin and end the transfer have higher numbers.
            let is_segment = !is_request && frame.payload()[0] & 0x7F <= 20;
            count += u32::from(is_segment);
            if is_segment && count == lost + 1 { Fate::IsLost } else { Fate::Arrives }
        };
        assert_eq!(pair.upload(BLOCKS, fate), uploaded(&data), "upload without segment {lost}");
        let (mut pair, mut count) = (Pair::new(), 0);
        let fate = |is_request: bool, frame: &Frame| {
            let is_segment = is_request && frame.payload()[0] != 0xC6 && frame.payload()[0] & 0xE3 != 0xC1;
            count += u32::from(is_segment);
            if is_segment && count == lost + 1 { Fate::IsLost } else { Fate::Arrives }
        };
        assert_eq!(pair.download(&data, BLOCKS, fate), DOWNLOADED, "download without segment {lost}");
        assert_eq!(pair.stored(), data);
    }
}

#[test]
fn a_silent_server_is_told_that_the_client_gives_up_in_time() {
    let starts: [fn(&mut SdoClient) -> bool; 3] = [
        |client| client.upload(Instant::ZERO, DOMAIN, 8, SdoMode::Ordinary),
        |client| client.download(Instant::ZERO, DOMAIN, vec![1; 20], SdoMode::Ordinary),
        |client| client.download(Instant::ZERO, DOMAIN, vec![1; 20], BLOCKS),
    ];
    for start in starts {
        let mut client = SdoClient::of_node(1);
        client.set_timeout(Duration::from_millis(300));
        assert!(start(&mut client));
        assert!(client.poll_transmit().is_some());
        let deadline = client.poll_timeout().unwrap();
        assert_eq!(deadline, Instant::ZERO + Duration::from_millis(300));
        client.handle_timeout(Instant::from_nanos(deadline.as_nanos() - 1));
        assert_eq!(client.poll_event(), None);
        client.handle_timeout(deadline);
        assert_eq!(client.poll_transmit(), Some(frame_of("601#800F200000000405")));
        let error = SdoError::Client(AbortCode::TimedOut);
        assert_eq!(client.poll_event(), Some(SdoEvent::Failed { address: DOMAIN, error }));
        assert_eq!(client.poll_timeout(), None);
    }
}

#[test]
fn an_abort_of_the_server_ends_the_transfer_with_its_code() {
    let cases = [
        ("581#800F200011000906", Some(0x0609_0011)),
        ("581#8000000001000405", Some(0x0504_0001)), // a server that knows no transfer
        ("581#800F2000EFBEADDE", Some(0xDEAD_BEEF)), // no code of the standard
        ("581#8001100000000206", None),              // about something else
    ];
    for (abort, code) in cases {
        let mut client = SdoClient::of_node(1);
        assert!(client.upload(Instant::ZERO, DOMAIN, 8, SdoMode::Ordinary));
        client.handle_frame(Instant::ZERO, &frame_of(abort));
        let failed = |code| SdoEvent::Failed { address: DOMAIN, error: SdoError::Server(code) };
        assert_eq!(client.poll_event(), code.map(failed), "{abort}");
    }
    let told = SdoError::Server(0x0609_0011).to_string();
    assert_eq!(told, "the server refuses: 0x06090011 (sub-index does not exist)");
    assert_eq!(SdoError::Server(0xDEAD_BEEF).to_string(), "the server refuses: 0xDEADBEEF");
}

#[test]
fn an_answer_that_comes_too_late_does_not_disturb_the_next_transfer() {
    let mut client = SdoClient::of_node(1);
    let address = Address::new(0x1017, 0);
    assert!(client.upload(Instant::ZERO, address, 8, SdoMode::Ordinary));
    talk(
        &mut client,
        "
        > 601#4017100000000000
        < 581#4300100092010200 // of 0x1000, asked for before
        < 581#4B171000E8030000
        ",
    );
    assert_eq!(client.poll_event(), Some(SdoEvent::Uploaded { address, data: vec![0xE8, 0x03] }));
}

#[test]
fn a_value_without_an_announced_size_may_not_pass_the_limit_either() {
    for (limit, is_taken) in [(14, true), (13, false)] {
        let mut client = SdoClient::of_node(1);
        assert!(client.upload(Instant::ZERO, DOMAIN, limit, SdoMode::Ordinary));
        for answer in ["400F200000000000", "0001020304050607", "1101020304050607"] {
            client.handle_frame(Instant::ZERO, &frame_of(&format!("581#{answer}")));
        }
        let error = SdoError::Client(AbortCode::OutOfMemory);
        let expected = if is_taken {
            uploaded(&[1, 2, 3, 4, 5, 6, 7, 1, 2, 3, 4, 5, 6, 7])
        } else {
            SdoEvent::Failed { address: DOMAIN, error }
        };
        assert_eq!(client.poll_event(), Some(expected), "{limit}");
    }
}

#[test]
fn an_owner_may_end_a_transfer() {
    let mut client = SdoClient::of_node(1);
    client.abort(AbortCode::General);
    assert_eq!((client.poll_transmit(), client.poll_event()), (None, None));
    assert!(client.upload(Instant::ZERO, DOMAIN, 8, SdoMode::Ordinary));
    client.abort(AbortCode::General);
    assert_eq!(client.poll_transmit(), Some(frame_of("601#800F200000000008")), "and no request before it");
    assert_eq!(client.poll_transmit(), None);
    let error = SdoError::Client(AbortCode::General);
    assert_eq!(client.poll_event(), Some(SdoEvent::Failed { address: DOMAIN, error }));
}

#[test]
fn one_transfer_at_a_time() {
    let mut client = SdoClient::of_node(1);
    assert!(client.upload(Instant::ZERO, DOMAIN, 8, SdoMode::Ordinary));
    assert!(!client.upload(Instant::ZERO, DOMAIN, 8, SdoMode::Ordinary));
    assert!(!client.download(Instant::ZERO, DOMAIN, vec![1], SdoMode::Ordinary));
    client.abort(AbortCode::General);
    assert!(!client.upload(Instant::ZERO, DOMAIN, 8, SdoMode::Ordinary), "the event was not taken");
    assert!(client.poll_event().is_some());
    assert!(client.upload(Instant::ZERO, DOMAIN, 8, SdoMode::Ordinary));
}

/// What a server does wrong, and the abort code that it gets.
#[test]
fn what_a_server_does_wrong_ends_the_transfer_with_the_code_of_the_standard() {
    let cases: [(&str, SdoMode, &[&str], AbortCode); 11] = [
        ("wrong toggle", SdoMode::Ordinary, &["410F200008000000", "1000000000000000"], AbortCode::ToggleBit),
        ("too much announced", SdoMode::Ordinary, &["410F200065000000"], AbortCode::OutOfMemory),
        (
            "more than announced",
            SdoMode::Ordinary,
            &["410F200005000000", "0000000000000000"],
            AbortCode::TooLong,
        ),
        (
            "less than announced",
            SdoMode::Ordinary,
            &["410F200009000000", "0100000000000000"],
            AbortCode::TooShort,
        ),
        (
            "segments for ever",
            SdoMode::Ordinary,
            &["400F200000000000", "0E00000000000000"],
            AbortCode::LengthMismatch,
        ),
        ("another service", SdoMode::Ordinary, &["600F200000000000"], AbortCode::UnknownCommand),
        ("a block unasked", SdoMode::Ordinary, &["C60F200008000000"], AbortCode::UnknownCommand),
        ("no command at all", SdoMode::Ordinary, &["E00F200008000000"], AbortCode::UnknownCommand),
        ("too large a block", BLOCKS, &["C60F200065000000"], AbortCode::OutOfMemory),
        ("segment zero", BLOCKS, &["C60F200008000000", "0000000000000000"], AbortCode::SequenceNumber),
        ("wrong CRC", BLOCKS, &["C60F200002000000", "8101020000000000", "D500000000000000"], AbortCode::Crc),
    ];
    for (name, mode, answers, code) in cases {
        let mut client = SdoClient::of_node(1);
        assert!(client.upload(Instant::ZERO, DOMAIN, 100, mode));
        for answer in answers {
            assert!(
                client.poll_transmit().is_some() || answer.starts_with("00") || answer.starts_with("81"),
                "{name}"
            );
            assert_eq!(client.poll_event(), None, "{name}");
            client.handle_frame(Instant::ZERO, &frame_of(&format!("581#{answer}")));
        }
        let [a, b, c, d] = code.code().to_le_bytes();
        let abort = Frame::new(Id::Standard(0x601), &[0x80, 0x0F, 0x20, 0, a, b, c, d]);
        assert_eq!(client.poll_transmit(), Some(abort), "{name}");
        let error = SdoError::Client(code);
        assert_eq!(client.poll_event(), Some(SdoEvent::Failed { address: DOMAIN, error }), "{name}");
    }
}

#[test]
fn a_server_that_takes_no_segment_is_not_served_for_ever() {
    let mut client = SdoClient::of_node(1);
    assert!(client.download(Instant::ZERO, DOMAIN, pattern(14), BLOCKS));
    talk(&mut client, "> 601#C60F20000E000000");
    client.handle_frame(Instant::ZERO, &frame_of("581#A40F20007F000000"));
    for _ in 0..3 {
        assert_eq!(core::iter::from_fn(|| client.poll_transmit()).count(), 2);
        client.handle_frame(Instant::ZERO, &frame_of("581#A2007F0000000000"));
        assert_eq!(client.poll_event(), None);
    }
    client.handle_frame(Instant::ZERO, &frame_of("581#A2007F0000000000"));
    assert_eq!(client.poll_transmit(), Some(frame_of("601#800F200000000405")));
    let error = SdoError::Client(AbortCode::TimedOut);
    assert_eq!(client.poll_event(), Some(SdoEvent::Failed { address: DOMAIN, error }));
}

#[test]
fn the_parameters_of_a_client_are_those_of_its_record() {
    let cob_id = |sub, value| {
        Entry::new(sub, "COB-ID", DataType::Unsigned32, Access::ReadWrite).with_value(Value::Fixed(value))
    };
    let record = |index, request, answer| {
        let node_id = Entry::new(3, "Node-ID", DataType::Unsigned8, Access::ReadWrite);
        Object::record(index, "SDO client", vec![cob_id(1, request), cob_id(2, answer), node_id])
    };
    let schema = Schema::new(vec![
        record(0x1280, 0x6E0, 0x5E0),
        record(0x1281, 0x8000_06E0, 0x5E0),
        record(0x1282, 0x6E0, 0x8000_05E0),
    ]);
    let communication = Dictionary::new(schema.unwrap().into(), 1);
    let mut client = SdoClient::configured(&communication, 0x1280).unwrap();
    assert_eq!(client.subscription(), Id::Standard(0x5E0));
    assert!(client.upload(Instant::ZERO, DOMAIN, 8, SdoMode::Ordinary));
    assert_eq!(client.poll_transmit().unwrap().id, Id::Standard(0x6E0));
    for index in [0x1281, 0x1282, 0x1283, 0x1200, 0x127F, 0x1300] {
        assert!(SdoClient::configured(&communication, index).is_none(), "{index:04X}");
    }
}

#[test]
fn the_identifiers_of_a_client_change_while_they_are_not_valid() {
    let cob_id = |sub| Entry::new(sub, "COB-ID", DataType::Unsigned32, Access::ReadWrite);
    let record = Object::record(0x1280, "SDO client", vec![cob_id(1), cob_id(2)]);
    let mut bench = Bench::off_with(vec![record]).started();
    bench.configure("1280:01", 0x8000_0000);
    bench.configure("1280:01", 0x6C0);
    let write = |bench: &mut Bench, value: u32| bench.download(Address::new(0x1280, 1), &value.to_le_bytes());
    assert_eq!(write(&mut bench, 0x6C1), Err(AbortCode::DeviceState));
    assert_eq!(write(&mut bench, 0x8000_06C1), Ok(()));
    assert_eq!(write(&mut bench, 0x601), Err(AbortCode::InvalidValue), "restricted");
    bench.configure("1280:02", 0x8000_0000);
    bench.configure("1280:02", 0x580);
    assert!(SdoClient::configured(bench.node.communication(), 0x1280).is_none(), "one is not valid");
    bench.configure("1280:01", 0x6C1);
    let client = SdoClient::configured(bench.node.communication(), 0x1280).unwrap();
    assert_eq!(client.subscription(), Id::Standard(0x580));
}

fn fate() -> impl Strategy<Value = Fate> {
    prop_oneof![
        20 => Just(Fate::Arrives),
        1 => Just(Fate::IsLost),
        1 => Just(Fate::ComesTwice),
        1 => Just(Fate::IsOvertaken),
    ]
}

fn mode() -> impl Strategy<Value = SdoMode> {
    prop_oneof![Just(SdoMode::Ordinary), (0..=255_u8).prop_map(|threshold| SdoMode::Block { threshold }),]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn whatever_happens_to_the_frames_data_are_right_or_it_is_said(
        size in 0..1500_usize,
        mode in mode(),
        block_size in 1..=127_u8,
        fates in vec(fate(), 1..80),
    ) {
        let data = pattern(size);
        let mut fates_of_both = fates.iter().copied().cycle();
        let mut fate = |_, _: &Frame| fates_of_both.next().unwrap();
        let mut pair = Pair::server_with(&data);
        pair.client.set_block_size(block_size);
        match pair.upload(mode, &mut fate) {
            SdoEvent::Failed { address, .. } => prop_assert_eq!(address, DOMAIN),
            event => prop_assert_eq!(event, uploaded(&data)),
        }
        let mut pair = Pair::new();
        match pair.download(&data, mode, &mut fate) {
            SdoEvent::Failed { address, .. } => prop_assert_eq!(address, DOMAIN),
            event => {
                prop_assert_eq!(event, DOWNLOADED);
                prop_assert_eq!(pair.stored(), data.clone());
            }
        }
        // Both sides are ready for the next one when what was sent has arrived and time-outs are over.
        pair.wire.clear();
        pair.server.pass(Duration::from_secs(2));
        prop_assert_eq!(pair.download(&data, mode, all_is_well), DOWNLOADED);
        prop_assert_eq!(pair.stored(), data);
    }

    #[test]
    fn a_hostile_server_gets_an_end_and_no_memory(
        answers in vec((any::<[u8; 8]>(), 0..12_u8, 0..300_u64), 1..300),
        mode in mode(),
        is_upload: bool,
    ) {
        let mut client = SdoClient::of_node(1);
        let started = if is_upload {
            client.upload(Instant::ZERO, DOMAIN, 64, mode)
        } else {
            client.download(Instant::ZERO, DOMAIN, pattern(300), mode)
        };
        prop_assert!(started);
        let mut now = Instant::ZERO;
        for (mut answer, kind, millis) in answers {
            // Most answers look like one.
            const COMMANDS: [u8; 10] = [0x00, 0x10, 0x41, 0x43, 0x60, 0x20, 0x30, 0xA4, 0xA2, 0xC6];
            if let Some(command) = COMMANDS.get(usize::from(kind)) {
                answer[..4].copy_from_slice(&[*command, 0x0F, 0x20, 0]);
            }
            client.handle_frame(now, &Frame::new(Id::Standard(0x581), &answer));
            let sent = core::iter::from_fn(|| client.poll_transmit()).count();
            prop_assert!(sent <= 128, "a block and a word");
            now = now + Duration::from_millis(millis);
            if client.poll_timeout().is_some_and(|deadline| deadline <= now) {
                client.handle_timeout(now);
            }
            match client.poll_event() {
                None => prop_assert!(client.is_busy() && client.poll_timeout().is_some()),
                Some(SdoEvent::Uploaded { data, .. }) => {
                    prop_assert!(data.len() <= 64 && data.capacity() <= 256);
                    return Ok(());
                }
                Some(_) => return Ok(()),
            }
        }
    }
}
