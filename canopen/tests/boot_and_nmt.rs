//! Boot-up and NMT commands (CiA 301 v4.2, sections 7.2.8 and 7.3.2).

mod bench;

use bench::{Bench, frame_of};
use canopen::{Event, NmtState};

// CCT 9.1, 9.2
#[test]
fn a_node_boots_into_pre_operational() {
    let mut bench = Bench::off();
    assert_eq!(bench.node.state(), NmtState::Initialising);
    bench.talk("> 601#4000100000000000"); // no answer before power-on
    bench.node.start(bench.now, &bench.device);
    assert_eq!(bench.node.state(), NmtState::PreOperational);
    assert_eq!(bench.events(), [Event::Subscriptions, Event::Nmt(NmtState::PreOperational)]);
    bench.talk(
        "
        < 701#00
        > 601#4000100000000000
        < 581#4300100092010200
        + 60s
        ",
    );
}

// CCT 9.2, 9.3, 9.4, 10.2, 10.3, 10.4
#[test]
fn every_command_leads_to_its_state() {
    let mut bench = Bench::new();
    let commands = [
        ("000#0101", NmtState::Operational),
        ("000#0201", NmtState::Stopped),
        ("000#8001", NmtState::PreOperational),
        ("000#0200", NmtState::Stopped),
        ("000#0100", NmtState::Operational),
        ("000#8000", NmtState::PreOperational),
        ("000#0101", NmtState::Operational),
        ("000#8101", NmtState::PreOperational),
        ("000#0201", NmtState::Stopped),
        ("000#8200", NmtState::PreOperational),
    ];
    for (command, state) in commands {
        bench.send(command);
        assert_eq!(bench.node.state(), state, "{command}");
    }
}

// CCT 9.4
#[test]
fn a_stopped_node_hears_only_nmt() {
    let mut bench = Bench::operational();
    bench.talk(
        "
        > 000#0201
        > 601#4000100000000000
        > 080#
        > 181#R
        > 201#1122
        = 6000:01 2A
        ",
    );
    assert_eq!(bench.value("6200:01"), 0);
    bench.talk(
        "
        > 000#0101
        < 181#2A00
        ",
    );
}

#[test]
fn a_pre_operational_node_has_no_pdos() {
    let mut bench = Bench::new();
    bench.talk(
        "
        > 201#1122
        > 181#R
        > 080#
        = 6000:01 2A
        > 601#4000100000000000
        < 581#4300100092010200
        ",
    );
    assert_eq!(bench.value("6200:01"), 0);
}

#[test]
fn a_command_that_changes_nothing_does_nothing() {
    let mut bench = Bench::operational();
    bench.events();
    bench.talk("> 000#0101");
    assert_eq!(bench.events(), []);
}

#[test]
fn commands_to_others_and_unknown_ones_are_ignored() {
    let mut bench = Bench::operational();
    bench.talk(
        "
        > 000#0202
        > 000#8102
        > 000#0301
        > 000#FF01
        > 000#8000FF // three bytes
        > 000#80
        > 000#
        > 000#R2
        > 00000000#0201 // 29 bits
        ",
    );
    assert_eq!(bench.node.state(), NmtState::Operational);
    assert_eq!(bench.node.counters().malformed, 4);
}

// CCT 9.1, 10.1
#[test]
fn both_resets_boot_again_with_the_default_parameters() {
    for reset in ["000#8101", "000#8200"] {
        let mut bench = Bench::operational();
        bench.configure("1017:00", 100);
        bench.configure("1801:01", 0x8000_0281);
        bench.configure("1005:00", 0x81);
        bench.talk(&format!(
            "
            > {reset}
            < 701#00
            + 500ms
            > 601#4017100000000000
            < 581#4B17100000000000
            > 601#4001180100000000
            < 581#4301180181020000
            > 601#4005100000000000
            < 581#4305100080000000
            > 000#0101
            < 181#0000
            > 080#
            < 281#00
            "
        ));
    }
}

#[test]
fn only_a_reset_of_the_node_resets_the_application() {
    let mut bench = Bench::new();
    bench.events();
    bench.send("000#8201");
    assert_eq!(bench.events(), [Event::Subscriptions, Event::Nmt(NmtState::PreOperational)]);
    bench.send("000#8101");
    assert_eq!(bench.events(), [Event::Reset, Event::Subscriptions, Event::Nmt(NmtState::PreOperational)]);
}

#[test]
fn the_last_event_tells_the_last_state() {
    let mut bench = Bench::new();
    for command in ["000#0101", "000#0201", "000#0101", "000#8001", "000#0101"] {
        bench.send(command);
    }
    assert_eq!(bench.events().last(), Some(&Event::Nmt(NmtState::Operational)));
    for _ in 0..1000 {
        bench.send("000#8101");
        bench.send("000#0201");
    }
    let events = bench.events();
    assert!(events.len() <= 6, "{events:?}");
    assert_eq!(events.last(), Some(&Event::Nmt(NmtState::Stopped)));
}

/// A node whose 0x1F80 starts with `startup`.
fn with_startup(startup: u64) -> Bench {
    let mut objects = bench::device::communication_objects();
    for object in objects.iter_mut().filter(|object| object.index == 0x1F80) {
        object.entries[0].initial = od::Initial::Value(od::Value::Fixed(startup));
    }
    Bench::with(od::Schema::new(objects).unwrap())
}

#[test]
fn a_node_may_start_itself() {
    for (startup, state) in [
        (0x08, NmtState::Operational),
        (0x0C, NmtState::PreOperational),
        (0x04, NmtState::PreOperational),
        (0x00, NmtState::PreOperational),
    ] {
        let mut bench = with_startup(startup).started();
        assert_eq!(bench.node.state(), state, "{startup:02X}");
        bench.send("000#8001");
        assert_eq!(bench.node.state(), NmtState::PreOperational);
        bench.send("000#8201");
        assert_eq!(bench.node.state(), state, "{startup:02X}");
    }
}

#[test]
fn of_the_startup_only_what_concerns_a_slave_may_be_written() {
    let mut bench = Bench::new();
    for startup in [0x00, 0x04, 0x08, 0x0C] {
        bench.configure("1F80:00", startup);
    }
    bench.talk(
        "
        > 601#23801F0001000000 // NMT master
        < 581#80801F0030000906
        > 601#23801F0002000000
        < 581#80801F0030000906
        ",
    );
}

#[test]
fn a_sync_before_the_start_is_none_for_the_tpdos() {
    let mut bench = Bench::new();
    for frame in ["080#", "000#0101"] {
        bench.node.handle_frame(bench.now, &frame_of(frame), &mut bench.device);
    }
    bench.talk("< 181#0000"); // not 281#00
}

#[test]
fn a_reset_drops_what_was_not_sent_yet() {
    let mut bench = Bench::new();
    for frame in ["601#4000100000000000", "000#8201"] {
        bench.node.handle_frame(bench.now, &frame_of(frame), &mut bench.device);
    }
    bench.talk("< 701#00");
}

// CCT 2.12
#[test]
fn the_default_identifiers_follow_from_the_node_id() {
    Bench::new().talk(
        "
        > 601#4000120100000000
        < 581#4300120101060000
        > 601#4000120200000000
        < 581#4300120281050000
        > 601#4014100000000000
        < 581#4314100081000000
        ",
    );
}
