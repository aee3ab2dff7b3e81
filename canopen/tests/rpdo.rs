//! Process data into the device (CiA 301 v4.2, section 7.2.2).

mod bench;

use bench::Bench;

#[test]
fn an_event_driven_rpdo_acts_at_once() {
    let mut bench = Bench::operational();
    bench.talk("> 201#1122");
    assert_eq!((bench.value("6200:01"), bench.value("6200:02")), (0x11, 0x22));
}

#[test]
fn all_of_an_rpdo_is_written_before_the_device_looks() {
    let mut bench = Bench::operational();
    bench.node.handle_frame(bench.now, &bench::frame_of("201#1122"), &mut bench.device);
    let mut written = Vec::new();
    while let Some(slot) = bench.device.take_written() {
        written.push(bench.device.raw(slot));
    }
    assert_eq!(written, [0x11, 0x22]);
}

#[test]
fn a_synchronous_rpdo_waits_for_the_next_sync_and_the_last_one_wins() {
    for transmission in [0, 1, 240] {
        let mut bench = Bench::operational();
        bench.configure("1401:02", transmission);
        bench.configure("1801:02", 255); // TPDO 2 would answer the SYNC
        bench.talk(
            "
            > 301#11
            > 301#22
            + 1s
            ",
        );
        assert_eq!(bench.value("6200:03"), 0, "type {transmission}");
        bench.send("080#");
        assert_eq!(bench.value("6200:03"), 0x22, "type {transmission}");
        let slot = bench.device.find(od::Address::new(0x6200, 3)).unwrap();
        bench.device.set(slot, 0);
        bench.send("080#");
        assert_eq!(bench.value("6200:03"), 0, "it acts once");
    }
}

#[test]
fn what_waits_for_a_sync_is_forgotten_outside_operational() {
    let mut bench = Bench::operational();
    for line in ["301#11", "000#8001", "000#0101", "080#"] {
        bench.send(line);
    }
    assert_eq!(bench.value("6200:03"), 0);
}

#[test]
fn what_waits_for_a_sync_is_forgotten_with_the_old_parameters() {
    let mut bench = Bench::operational();
    bench.send("301#11");
    bench.map(0x1401, 0x301, 1, &[0x6200_0408]);
    bench.send("080#");
    assert_eq!((bench.value("6200:03"), bench.value("6200:04")), (0, 0));
}

#[test]
fn bits_and_odd_widths_are_unpacked_low_first() {
    let mut bench = Bench::operational();
    // BOOLEAN, a dummy of 8 bits, INTEGER24, BOOLEAN: 34 bits
    bench.map(0x1402, 0x401, 255, &[0x2001_0001, 0x0005_0008, 0x2010_0018, 0x2001_0001]);
    bench.talk("> 401#01FEFFFF02");
    assert_eq!(bench.value("2010:00"), 0x7F_FFFF);
    assert_eq!(bench.value("2001:00"), 1);
}

#[test]
fn a_whole_frame_may_be_one_value() {
    let mut bench = Bench::operational();
    bench.map(0x1402, 0x401, 254, &[0x201B_0040]);
    bench.talk("> 401#0102030405060708");
    assert_eq!(bench.value("201B:00"), 0x0807_0605_0403_0201);
}

#[test]
fn an_object_may_be_written_only_by_rpdo() {
    let mut bench = Bench::operational();
    bench.map(0x1402, 0x401, 255, &[0x2108_0010]);
    bench.talk("> 401#3412");
    assert_eq!(bench.value("2108:00"), 0x1234);
}

#[test]
fn a_refused_value_drops_the_whole_rpdo() {
    let mut bench = Bench::operational();
    bench.map(0x1402, 0x401, 255, &[0x6200_0408, 0x2103_0010]);
    bench.talk("> 401#110B00"); // 11 where 10 is the most
    assert_eq!(bench.value("6200:04"), 0);
    assert_eq!(bench.node.counters().refused_rpdos, 1);
    bench.talk("> 401#110A00");
    assert_eq!((bench.value("6200:04"), bench.value("2103:00")), (0x11, 10));
}

#[test]
fn a_short_rpdo_is_dropped_and_reported_once() {
    let mut bench = Bench::operational();
    bench.talk(
        "
        > 201#11
        < 081#1082110100010000
        > 201#11
        > 201#
        ",
    );
    assert_eq!(bench.value("6200:01"), 0);
    bench.talk(
        "
        > 201#1122
        < 081#0000000000000000
        > 201#1122
        > 201#11
        < 081#1082110100010000
        ",
    );
}

#[test]
fn a_long_rpdo_is_taken_and_reported_once() {
    let mut bench = Bench::operational();
    bench.talk(
        "
        > 201#112233
        < 081#2082110100030000
        > 201#4455667788990011
        ",
    );
    assert_eq!((bench.value("6200:01"), bench.value("6200:02")), (0x44, 0x55));
    bench.talk(
        "
        > 201#1122
        < 081#0000000000000000
        ",
    );
}

#[test]
fn a_good_rpdo_does_not_excuse_another_one() {
    let mut bench = Bench::operational();
    bench.configure("1401:02", 255);
    bench.talk(
        "
        > 201#11
        < 081#1082110100010000
        > 301#11
        > 201#11
        > 301#
        > 201#1122 // RPDO 2 is still short
        > 301#22
        < 081#0000000000000000
        ",
    );
}

#[test]
fn an_rpdo_that_is_not_valid_any_more_accuses_no_longer() {
    let mut bench = Bench::operational();
    bench.configure("1401:02", 255);
    bench.send("201#11");
    bench.configure("1400:01", 0x8000_0201);
    bench.talk(
        "
        > 301#
        > 301#22
        < 081#0000000000000000
        ",
    );
}

#[test]
fn a_reset_acquits_every_rpdo() {
    let mut bench = Bench::operational();
    bench.send("201#11");
    bench.send("000#8201");
    bench.configure("1401:02", 255);
    bench.send("000#0101");
    bench.talk(
        "
        > 301#
        < 081#1082110200000000
        > 301#22
        < 081#0000000000000000
        ",
    );
}

#[test]
fn a_short_rpdo_may_become_a_long_one() {
    Bench::operational().talk(
        "
        > 201#11
        < 081#1082110100010000
        > 201#112233
        < 081#2082110100030000
        < 081#0000110000000000
        > 201#1122
        < 081#0000000000000000
        ",
    );
}

#[test]
fn an_rpdo_that_carries_nothing_hears_nothing() {
    let mut bench = Bench::operational();
    bench.map(0x1402, 0x401, 255, &[]);
    bench.talk("> 401#11");
    assert!(!bench.node.subscriptions().any(|id| id == canopen::Id::Standard(0x401)));
}

#[test]
fn an_rpdo_that_is_not_valid_hears_nothing() {
    let mut bench = Bench::operational();
    bench.configure("1400:01", 0x8000_0201);
    bench.talk("> 201#1122");
    assert_eq!(bench.value("6200:01"), 0);
    bench.configure("1400:01", 0x0000_0202);
    bench.talk(
        "
        > 201#1122
        > 202#3344
        ",
    );
    assert_eq!(bench.value("6200:01"), 0x33);
}

#[test]
fn two_rpdos_may_share_an_identifier() {
    let mut bench = Bench::operational();
    bench.map(0x1402, 0x201, 255, &[0x6200_0508, 0x6200_0608]);
    bench.talk("> 201#1122");
    assert_eq!((bench.value("6200:01"), bench.value("6200:05")), (0x11, 0x11));
}

#[test]
fn an_identifier_may_have_29_bits() {
    let mut bench = Bench::operational();
    bench.map(0x1402, 0x2000_0401, 255, &[0x6200_0508]);
    bench.talk(
        "
        > 401#11
        > 00000401#22
        ",
    );
    assert_eq!(bench.value("6200:05"), 0x22);
}

#[test]
fn a_missing_rpdo_is_told_once_from_the_first_one_on() {
    let mut bench = Bench::new();
    bench.configure("1400:05", 100);
    bench.configure("1029:01", 1); // no change of the state
    bench.talk(
        "
        > 000#0101
        < 181#0000
        + 60s
        > 201#1122
        + 99999us
        > 201#1122
        + 99999us
        + 1us
        < 081#5082110100000000
        + 60s
        > 201#1122
        < 081#0000000000000000
        + 99999us
        + 1us
        < 081#5082110100000000
        ",
    );
}

#[test]
fn every_missing_rpdo_has_an_error_of_its_own() {
    let mut bench = Bench::operational();
    bench.configure("1029:01", 1);
    bench.configure("1400:05", 100);
    bench.configure("1401:05", 150); // a synchronous one
    bench.talk(
        "
        > 201#1122
        > 301#33
        + 150ms
        < 081#5082110100000000
        < 081#5082110200000000
        > 201#11 // too short to count
        < 081#1082110100010000
        > 201#1122
        < 081#0000110000000000
        < 081#0000110000000000
        > 301#33
        < 081#0000000000000000
        ",
    );
}

#[test]
fn an_rpdo_is_missed_in_operational_only() {
    let mut bench = Bench::operational();
    bench.configure("1400:05", 100);
    bench.talk(
        "
        > 201#1122
        > 000#8001
        + 60s
        > 000#0101
        < 181#0000
        + 60s
        > 201#1122
        + 100ms
        < 081#5082110100000000 // and leaves OPERATIONAL
        + 60s
        > 000#0101
        < 181#0000
        + 60s
        > 201#1122
        < 081#0000000000000000
        ",
    );
}

#[test]
fn new_parameters_end_the_supervision_of_an_rpdo() {
    let mut bench = Bench::operational();
    bench.configure("1029:01", 1);
    bench.configure("1400:05", 100);
    bench.talk(
        "
        > 201#1122
        + 50ms
        > 601#2B00140564000000
        < 581#6000140500000000
        + 60s
        > 201#1122
        + 100ms
        < 081#5082110100000000
        > 601#2B00140500000000
        < 581#6000140500000000
        < 081#0000000000000000
        > 201#1122
        + 60s
        ",
    );
}
