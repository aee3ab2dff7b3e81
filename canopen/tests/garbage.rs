//! Frames that mean nothing: an exact answer or none, and nothing changes.

mod bench;

use bench::{Bench, frame_of};
use canopen::{Frame, Id, NmtState};

/// Everything a bus can see of a node.
fn picture(bench: &Bench) -> (NmtState, u64, u64, Vec<Id>) {
    let node = &bench.node;
    let communication = node.communication().revision();
    (node.state(), communication, bench.device.revision(), node.subscriptions().collect())
}

#[test]
fn an_sdo_message_has_eight_bytes() {
    let mut bench = Bench::operational();
    let before = picture(&bench);
    for len in 0..8 {
        let message = Frame::new(Id::Standard(0x601), &[0x2F, 0x05, 0x20, 0, 0x11, 0, 0, 0][..len]);
        assert_eq!(bench.handle(&message), [], "{message}");
        let remote = Frame::remote(Id::Standard(0x601), len as u8);
        assert_eq!(bench.handle(&remote), [], "{remote}");
    }
    assert_eq!(picture(&bench), before);
    assert_eq!(bench.node.counters().malformed, 16);
}

#[test]
fn a_message_of_a_wrong_length_does_not_disturb_a_transfer() {
    Bench::new().talk(
        "
        > 601#4008100000000000
        < 581#410810000C000000
        > 601#6000
        > 601#R8
        > 601#6000000000000000
        < 581#0042656E63682064
        ",
    );
}

#[test]
fn every_command_byte_has_an_answer_but_abort() {
    for command in 0..=255_u8 {
        let mut bench = Bench::new();
        let request = Frame::new(Id::Standard(0x601), &[command, 0xFF, 0x5F, 0, 0, 0, 0, 0]);
        let answer: Vec<String> = bench.handle(&request).iter().map(ToString::to_string).collect();
        let expected: &[&str] = match command >> 5 {
            0 | 3 => &["581#8000000001000405"], // segment of no transfer
            1 | 2 => &["581#80FF5F0000000206"], // no object
            4 => &[],
            5 if command & 3 == 0 => &["581#80FF5F0000000206"], // no object for a block upload
            6 if command & 1 == 0 => &["581#80FF5F0000000206"], // no object for a block download
            5 | 6 => &["581#8000000001000405"],                 // block of no transfer
            _ => &["581#80FF5F0001000405"],                     // unknown
        };
        assert_eq!(answer, expected, "{request}");
        assert_eq!(bench.node.poll_timeout(), None);
    }
}

#[test]
fn other_identifiers_are_not_for_this_node() {
    let mut bench = Bench::operational();
    let before = picture(&bench);
    let heard: Vec<Id> = bench.node.subscriptions().collect();
    for id in (0..0x800).map(Id::Standard).chain([0, 0x80, 0x201, 0x601, 0x1FFF_FFFF].map(Id::Extended)) {
        if heard.contains(&id) {
            continue;
        }
        for payload in [&[][..], &[1], &[0x81, 0], &[0x2F, 0x05, 0x20, 0, 0x11, 0, 0, 0]] {
            assert_eq!(bench.handle(&Frame::new(id, payload)), [], "{id}");
        }
        assert_eq!(bench.handle(&Frame::remote(id, 8)), [], "{id}");
    }
    assert_eq!(picture(&bench), before);
    assert_eq!(bench.node.counters(), canopen::Counters::default());
}

#[test]
fn remote_frames_ask_for_tpdos_and_the_state_only() {
    let mut bench = Bench::operational();
    let before = picture(&bench);
    for id in ["000", "080", "081", "201", "301", "581", "601"] {
        assert_eq!(bench.send(&format!("{id}#R")), [], "{id}");
        assert_eq!(bench.send(&format!("{id}#R8")), [], "{id}");
    }
    assert_eq!(picture(&bench), before);
    assert_eq!(bench.send("181#R8"), [frame_of("181#0000")]);
    assert_eq!(bench.send("701#R1"), [frame_of("701#05")]);
}

#[test]
fn a_frame_carries_at_most_eight_bytes() {
    assert_eq!(Frame::new(Id::Standard(1), &[7; 64]).payload(), [7; 8]);
    assert_eq!(Frame::remote(Id::Standard(1), 64).len(), 8);
    assert_eq!(Frame::remote(Id::Standard(1), 8).payload(), []);
    assert_eq!(Frame::remote(Id::Standard(0x181), 2).to_string(), "181#R2");
}

#[test]
fn before_power_on_nothing_is_heard_or_sent() {
    let mut bench = Bench::off();
    bench.talk(
        "
        > 000#0101
        > 601#4000100000000000
        > 080#
        + 10s
        ",
    );
    assert_eq!(bench.node.state(), NmtState::Initialising);
    assert_eq!(bench.node.poll_timeout(), None);
}

#[test]
fn a_link_that_is_down_does_not_fill_the_memory() {
    let mut bench = Bench::operational();
    let request = frame_of("601#4000100000000000");
    for _ in 0..100_000 {
        bench.node.handle_frame(bench.now, &request, &mut bench.device);
    }
    let waiting = core::iter::from_fn(|| bench.node.poll_transmit()).count();
    assert_eq!(waiting, 1024);
    assert_eq!(bench.node.counters().dropped, 100_000 - 1024);
}
