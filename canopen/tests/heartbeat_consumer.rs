//! Heartbeat consumer (CiA 301 v4.2, sections 7.2.8.3.2.2 and 7.5.2.18).

mod bench;

use core::time::Duration;

use bench::{Bench, device};
use canopen::{Cause, Event, Frame, Id, NmtState};
use od::{Access, DataType, Entry, Object, Schema};

/// A node that supervises node 2 with 100 ms.
fn supervising() -> Bench {
    let mut bench = Bench::new();
    bench.configure("1016:01", 0x0002_0064);
    bench.events();
    bench
}

// CCT 7.104
#[test]
fn a_producer_is_supervised_by_one_entry_at_most_06040043() {
    Bench::new().talk(
        "
        > 601#2316100134120500
        < 581#6016100100000000
        > 601#2316100234120500
        < 581#8016100243000406
        > 601#2316100135120500 // the entry itself may change
        < 581#6016100100000000
        > 601#2316100100000500
        < 581#6016100100000000
        > 601#2316100234120500 // now the other one is free
        < 581#6016100200000000
        ",
    );
}

#[test]
fn entries_without_a_node_or_a_time_are_not_used() {
    let mut bench = Bench::new();
    for unused in [0x0000_0064, 0x0080_0064, 0x00FF_0064, 0x0002_0000] {
        bench.configure("1016:01", unused);
        bench.configure("1016:02", unused);
        assert!(!bench.node.subscriptions().any(|id| id == Id::Standard(0x702)));
    }
}

// CCT 7.105
#[test]
fn heartbeats_that_come_in_time_change_nothing() {
    let mut bench = supervising();
    bench.send("000#0101");
    bench.events();
    for state in ["05", "7F", "04"].iter().cycle().take(100) {
        assert_eq!(bench.send(&format!("702#{state}")), []);
        assert_eq!(bench.pass(Duration::from_micros(99_999)), []);
    }
    assert_eq!(bench.events(), []);
}

// CCT 7.106
#[test]
fn supervision_starts_with_the_first_heartbeat_and_each_delay_is_told_once() {
    supervising().talk(
        "
        + 60s
        > 702#7F
        + 99999us
        + 1us
        < 081#3081110200000000
        > 601#4001100000000000 // the error register
        < 581#4F01100011000000
        > 601#4003100100000000 // the history
        < 581#4303100130810200
        + 60s
        > 702#7F
        < 081#0000000000000000
        > 601#4001100000000000
        < 581#4F01100000000000
        + 99999us
        + 1us
        < 081#3081110200000000
        ",
    );
}

// CCT 7.107
#[test]
fn an_operational_node_becomes_pre_operational() {
    let mut bench = supervising();
    bench.send("000#0101");
    bench.events();
    bench.talk(
        "
        > 702#05
        + 100ms
        < 081#3081110200000000
        ",
    );
    assert_eq!(
        bench.events(),
        [Event::ConnectionLost(Cause::Heartbeat(2)), Event::Nmt(NmtState::PreOperational)]
    );
    bench.talk(
        "
        > 702#05
        < 081#0000000000000000
        ",
    );
    assert_eq!(bench.node.state(), NmtState::PreOperational); // the way back is the master's
}

#[test]
fn every_producer_has_an_error_of_its_own() {
    let mut bench = supervising();
    bench.configure("1016:04", 0x0003_0064);
    bench.talk(
        "
        > 702#7F
        > 703#05
        + 100ms
        < 081#3081110200000000
        < 081#3081110300000000
        > 703#05
        < 081#0000110000000000
        + 50ms
        > 702#7F
        < 081#0000000000000000
        + 50ms
        < 081#3081110300000000
        ",
    );
}

#[test]
fn an_entry_that_is_written_waits_for_the_first_heartbeat_again() {
    let mut bench = supervising();
    bench.talk(
        "
        > 702#7F
        + 50ms
        > 601#23161001C8000200 // 200 ms
        < 581#6016100100000000
        + 10s
        > 702#7F
        + 200ms
        < 081#3081110200000000
        > 601#2316100100000000 // none
        < 581#6016100100000000
        < 081#0000000000000000
        > 702#7F
        + 10s
        ",
    );
}

#[test]
fn a_boot_up_message_neither_starts_a_supervision_nor_ends_an_error() {
    supervising().talk(
        "
        > 702#00
        + 10s
        > 702#7F
        + 50ms
        > 702#00 // it lives
        + 99999us
        + 1us
        < 081#3081110200000000
        > 702#00
        > 702#7F
        < 081#0000000000000000
        ",
    );
}

#[test]
fn what_is_no_heartbeat_does_not_count() {
    let mut bench = supervising();
    bench.talk(
        "
        > 702#7F
        + 50ms
        > 702#
        > 702#0505
        > 702#85 // the toggle bit of guarding
        > 702#03
        > 702#R1
        + 50ms
        < 081#3081110200000000
        ",
    );
    assert_eq!(bench.node.counters().malformed, 5);
}

#[test]
fn a_stopped_node_supervises_and_tells_later() {
    let mut bench = supervising();
    bench.talk(
        "
        > 000#0201
        > 702#7F
        + 1s
        > 000#8001
        < 081#3081110200000000
        ",
    );
}

#[test]
fn a_reset_of_the_communication_ends_every_supervision() {
    let mut bench = supervising();
    bench.talk(
        "
        > 702#7F
        + 100ms
        < 081#3081110200000000
        > 000#8201
        < 701#00
        > 702#7F
        + 10s
        > 601#4001100000000000
        < 581#4F01100000000000
        ",
    );
}

#[test]
fn as_many_producers_as_there_are_nodes_may_be_supervised() {
    let mut objects = device::communication_objects();
    objects.retain(|object| object.index != 0x1016);
    let entry = |sub| Entry::new(sub, format!("Node {sub}"), DataType::Unsigned32, Access::ReadWrite);
    objects.push(Object::array(0x1016, "Consumer heartbeat time", (1..=127).map(entry).collect()));
    let mut bench = Bench::with(Schema::new(objects).unwrap()).started();
    for node in 1..=127 {
        bench.configure(&format!("1016:{node:02X}"), node << 16 | 100);
    }
    bench.events();
    for node in 2..=127 {
        bench.handle(&Frame::new(Id::Standard(0x700 + node), &[5]));
    }
    bench.pass(Duration::from_millis(100));
    let lost: Vec<Event> = (2..=127).map(|node| Event::ConnectionLost(Cause::Heartbeat(node))).collect();
    assert_eq!(bench.events(), lost);
}
