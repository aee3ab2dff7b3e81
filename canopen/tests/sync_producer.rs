//! SYNC producer (CiA 301 v4.2, sections 7.2.5 and 7.5.2.5-6). CCT 6.1-6.4.

mod bench;

use core::time::Duration;
use std::sync::Arc;

use bench::{Bench, device, frame_of};
use canopen::Node;
use od::{Access, DataType, Dictionary, Entry, Instant, Object, Schema, Value};

/// A node in PRE-OPERATIONAL that produces a SYNC every 10 ms.
fn producer() -> Bench {
    let mut bench = Bench::new();
    bench.configure("1006:00", 10_000);
    bench.configure("1005:00", 0x4000_0080);
    bench
}

// CCT 6.2
#[test]
fn the_first_sync_comes_one_period_after_enabling_and_the_others_follow() {
    Bench::new().talk(
        "
        > 601#2306100010270000 // 10 ms
        < 581#6006100000000000
        + 1s
        > 601#2305100080000040
        < 581#6005100000000000
        + 9999us
        + 1us
        < 080#
        + 20ms
        < 080#
        < 080#
        > 601#2305100080000000
        < 581#6005100000000000
        + 1s
        ",
    );
}

// CCT 6.4
#[test]
fn a_period_of_zero_ends_the_production_and_another_one_begins_it_anew() {
    producer().talk(
        "
        + 5ms
        > 601#2306100000000000
        < 581#6006100000000000
        + 1s
        > 601#23061000E8030000 // 1 ms
        < 581#6006100000000000
        + 999us
        + 1us
        < 080#
        + 1ms
        < 080#
        ",
    );
}

#[test]
fn a_late_call_shifts_no_sync() {
    let mut bench = producer();
    bench.now = bench.now + Duration::from_millis(13);
    bench.node.handle_timeout(bench.now, &mut bench.device);
    bench.talk(
        "
        < 080#
        + 6999us
        + 1us
        < 080#
        ",
    );
    bench.now = bench.now + Duration::from_millis(45);
    bench.node.handle_timeout(bench.now, &mut bench.device);
    bench.talk(
        "
        < 080# // once: the missed ones are not made up for
        + 9999us
        + 1us
        < 080#
        ",
    );
}

#[test]
fn an_hour_of_syncs_has_no_drift() {
    let mut bench = producer();
    let sent = bench.pass(Duration::from_secs(3600));
    assert_eq!(sent.len(), 360_000);
    assert_eq!(bench.node.poll_timeout(), Some(bench.now + Duration::from_millis(10)));
}

// CCT 6.1
#[test]
fn the_identifier_stays_while_it_is_produced() {
    producer().talk(
        "
        > 601#2305100081000040
        < 581#8005100022000008
        > 601#2305100080000060 // 29 bits
        < 581#8005100022000008
        > 601#2305100080000040 // no change; begins anew
        < 581#6005100000000000
        + 10ms
        < 080#
        > 601#2305100081000000 // not produced any more
        < 581#6005100000000000
        > 601#2305100081000040
        < 581#6005100000000000
        + 10ms
        < 081#
        ",
    );
}

#[test]
fn a_period_that_no_bus_can_keep_is_refused() {
    Bench::new().talk(
        "
        > 601#2306100063000000 // 99 us
        < 581#8006100032000906
        > 601#2306100064000000
        < 581#6006100000000000
        ",
    );
}

// CCT 6.3
#[test]
fn a_nodes_own_sync_drives_its_own_pdos() {
    let mut bench = producer();
    bench.talk(
        "
        > 000#0101
        < 181#0000
        > 301#2A
        + 10ms
        < 080#
        < 281#2A
        > 301#55
        + 10ms
        < 080#
        < 281#55
        ",
    );
}

#[test]
fn a_stopped_node_produces_none_and_begins_anew_when_it_is_stopped_no_more() {
    producer().talk(
        "
        + 14ms
        < 080#
        > 000#0201
        + 1s
        > 000#8001
        + 9999us
        + 1us
        < 080#
        + 5ms
        > 000#0101 // that disturbs nothing
        < 181#0000
        + 4999us
        + 1us
        < 080#
        < 281#00
        ",
    );
}

#[test]
fn a_reset_ends_the_production() {
    let mut bench = producer();
    assert_eq!(bench.send("000#8201"), [frame_of("701#00")]);
    assert_eq!(bench.pass(Duration::from_secs(1)), []);
}

#[test]
fn a_device_without_a_communication_cycle_cannot_produce() {
    let sync = Entry::new(0, "COB-ID SYNC", DataType::Unsigned32, Access::ReadWrite);
    let communication = Schema::new(vec![Object::var(0x1005, sync.with_value(Value::Fixed(0x80)))]).unwrap();
    let application = device::application();
    let mut bench = Bench {
        node: Node::new(1, 0, Arc::new(communication), &application).unwrap(),
        device: Dictionary::new(Arc::new(application), 1),
        now: Instant::ZERO,
    };
    bench.node.start(bench.now, &bench.device);
    bench.talk(
        "
        < 701#00
        > 601#2305100080000040
        < 581#8005100030000906
        ",
    );
}
