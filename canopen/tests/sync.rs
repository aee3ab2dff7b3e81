//! SYNC (CiA 301 v4.2, section 7.2.5): the order of things.

mod bench;

use std::sync::Arc;

use bench::{Bench, device};
use canopen::{Id, Node};
use od::{Access, DataType, Dictionary, Entry, Instant, Object, Schema};

#[test]
fn an_rpdo_before_a_sync_acts_before_the_tpdos_of_that_sync_are_sampled() {
    Bench::operational().talk(
        "
        > 080#
        < 281#00
        > 301#2A
        > 080#
        < 281#2A
        > 301#55
        > 301#66
        > 080#
        < 281#66
        ",
    );
}

#[test]
fn the_device_may_act_between_a_sync_and_its_tpdos() {
    let mut bench = Bench::operational();
    bench.map(0x1801, 0x281, 1, &[0x6000_0108]);
    bench.send("301#2A");
    bench.node.handle_frame(bench.now, &bench::frame_of("080#"), &mut bench.device);
    while let Some(slot) = bench.device.take_written() {
        let value = bench.device.raw(slot) + 1;
        bench.show("6000:03", value);
        bench.show("6000:01", value);
    }
    bench.talk(
        "
        < 181#2B00
        < 281#2B
        ",
    );
}

#[test]
fn tpdos_go_in_the_order_of_their_numbers() {
    let mut bench = Bench::operational();
    bench.map(0x1802, 0x182, 1, &[0x6000_0308]);
    bench.map(0x1803, 0x80, 1, &[0x6000_0408]); // not even the SYNC's own identifier matters
    bench.talk(
        "
        > 080#
        < 281#00
        < 182#00
        < 080#00
        ",
    );
}

// CCT 6.1
#[test]
fn the_sync_identifier_is_0x080_and_may_be_another() {
    Bench::operational().talk(
        "
        > 601#4005100000000000
        < 581#4305100080000000
        > 601#2305100081000000
        < 581#6005100000000000
        > 080#
        > 081#
        < 281#00
        > 601#2305100080000020 // 29 bits
        < 581#6005100000000000
        > 081#
        > 00000080#
        < 281#00
        ",
    );
}

#[test]
fn a_sync_with_data_is_reported_and_not_taken() {
    Bench::operational().talk(
        "
        > 301#2A
        > 080#01
        < 081#4082110100000000
        > 080#02
        > 080#
        < 081#0000000000000000
        < 281#2A
        > 080#R
        ",
    );
}

#[test]
fn sync_is_heard_in_pre_operational_without_effect() {
    let mut bench = Bench::new();
    bench.talk(
        "
        > 080#
        > 080#01
        < 081#4082110100000000
        ",
    );
}

#[test]
fn a_profile_without_sync_and_emcy_hears_nmt_only_and_never_sends_with_identifier_zero() {
    let number = Entry::new(0, "Error register", DataType::Unsigned8, Access::ReadOnly);
    let communication = Schema::new(vec![Object::var(0x1001, number)]).unwrap();
    let application = device::application();
    let mut bench = Bench {
        node: Node::new(1, 0, Arc::new(communication), &application).unwrap(),
        device: Dictionary::new(Arc::new(application), 1),
        now: Instant::ZERO,
    };
    bench.node.start(bench.now, &bench.device);
    assert_eq!(bench.node.subscriptions().collect::<Vec<_>>(), [0x000, 0x601, 0x7E5].map(Id::Standard));
    bench.talk(
        "
        < 701#00
        > 000#0101
        ",
    );
    bench.node.raise(canopen::Emergency {
        code: 0x3210,
        register: canopen::ErrorRegister::VOLTAGE,
        detail: [0; 5],
    });
    bench.talk(
        "
        + 1s
        > 601#4001100000000000
        < 581#4F01100005000000
        ",
    );
}

/// A node in OPERATIONAL with a synchronous window of 1 ms, RPDO 2 and TPDO 2 with every SYNC.
fn with_window() -> Bench {
    let mut bench = Bench::operational();
    bench.configure("1007:00", 1000);
    bench
}

#[test]
fn a_synchronous_rpdo_that_misses_the_window_is_dropped() {
    let mut bench = with_window();
    bench.talk(
        "
        > 301#11 // no window before the first SYNC
        > 080#
        < 281#11
        + 1ms
        > 301#22 // just in time
        > 080#
        < 281#22
        + 1001us
        > 301#33
        > 201#4455 // not synchronous
        > 080#
        < 281#22
        > 301#66
        > 080#
        < 281#66
        ",
    );
    assert_eq!(bench.node.counters().late_rpdos, 1);
    assert_eq!((bench.value("6200:01"), bench.value("6200:02")), (0x44, 0x55));
}

#[test]
fn a_tpdo_that_is_not_sampled_in_the_window_is_not_sent() {
    let mut bench = with_window();
    bench.map(0x1802, 0x381, 0, &[0x6000_0308]);
    bench.map(0x1803, 0x481, 2, &[0x6000_0308]);
    let sync = |bench: &mut Bench, late: u64| {
        bench.node.handle_frame(bench.now, &bench::frame_of("080#"), &mut bench.device);
        bench.now = bench.now + core::time::Duration::from_micros(late);
        bench.settle().iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert_eq!(sync(&mut bench, 1000), ["281#00", "381#00"]);
    bench.show("6000:03", 7);
    assert_eq!(sync(&mut bench, 1001), [""; 0]);
    assert_eq!(sync(&mut bench, 0), ["281#00", "381#07"]); // the acyclic one still has its change
    assert_eq!(sync(&mut bench, 0), ["281#00", "481#07"]); // and the cyclic one its count
}

#[test]
fn without_a_window_nothing_is_late() {
    let mut bench = with_window();
    bench.send("080#");
    bench.configure("1007:00", 0);
    bench.talk(
        "
        + 1s
        > 301#11
        > 080#
        < 281#11
        ",
    );
}
