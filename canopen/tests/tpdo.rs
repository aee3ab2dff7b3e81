//! Process data out of the device (CiA 301 v4.2, section 7.2.2).

mod bench;

use core::time::Duration;

use bench::Bench;
use canopen::Id;

/// A node in OPERATIONAL with TPDO 3 as told, carrying input 3, and no other TPDO.
fn with_tpdo(transmission: u8, inhibit: u32, event_timer: u32) -> Bench {
    let mut bench = Bench::new();
    bench.configure("1800:01", 0x8000_0181);
    bench.configure("1801:01", 0x8000_0281);
    bench.configure("1802:03", inhibit);
    bench.configure("1802:05", event_timer);
    bench.map(0x1802, 0x381, transmission, &[0x6000_0308]);
    bench
}

// CCT 3.4, 3.10, 3.16
#[test]
fn an_event_driven_tpdo_goes_on_entering_operational_and_then_on_change_only() {
    for transmission in [254, 255] {
        let mut bench = with_tpdo(transmission, 0, 0);
        bench.talk(
            "
            = 6000:03 11
            > 000#0101
            < 381#11
            + 10s
            = 6000:03 22
            < 381#22
            = 6000:03 22
            = 6000:04 01 // not mapped
            > 080#
            > 000#0101
            > 000#8001
            = 6000:03 33
            > 000#0101
            < 381#33
            ",
        );
    }
}

// CCT 3.5, 3.11, 3.17
#[test]
fn the_event_timer_is_the_longest_time_between_two_transmissions() {
    let mut bench = with_tpdo(255, 0, 100);
    bench.talk(
        "
        > 000#0101
        < 381#00
        + 99999us
        + 1us
        < 381#00
        + 60ms
        = 6000:03 22
        < 381#22
        + 99999us
        + 1us
        < 381#22
        > 000#0201
        + 10s
        ",
    );
}

#[test]
fn a_late_call_does_not_shift_the_event_timer() {
    let mut bench = with_tpdo(255, 0, 100);
    bench.send("000#0101");
    bench.now = bench.now + Duration::from_millis(130);
    bench.node.handle_timeout(bench.now, &mut bench.device);
    bench.talk(
        "
        < 381#00
        + 69999us
        + 1us
        < 381#00
        ",
    );
    bench.now = bench.now + Duration::from_millis(1050);
    bench.node.handle_timeout(bench.now, &mut bench.device);
    bench.talk(
        "
        < 381#00
        + 99999us
        + 1us
        < 381#00
        ",
    );
}

#[test]
fn the_inhibit_time_is_the_shortest_time_between_two_transmissions() {
    with_tpdo(255, 100, 0).talk(
        "
        > 000#0101
        < 381#00
        = 6000:03 11
        + 9999us
        = 6000:03 22
        + 1us
        < 381#22 // the newest value, once
        + 1s
        = 6000:03 33
        < 381#33
        > 000#8001
        > 000#0101
        + 9999us
        + 1us
        < 381#33
        + 10s
        ",
    );
}

#[test]
fn the_inhibit_time_holds_back_the_event_timer_too() {
    with_tpdo(254, 200, 10).talk(
        "
        > 000#0101
        < 381#00
        + 19999us
        + 1us
        < 381#00
        + 40ms
        < 381#00
        < 381#00
        ",
    );
}

#[test]
fn the_inhibit_time_holds_back_requests() {
    with_tpdo(255, 100, 0).talk(
        "
        > 000#0101
        < 381#00
        > 381#R
        > 381#R
        + 9999us
        + 1us
        < 381#00
        + 1s
        > 381#R
        < 381#00
        ",
    );
}

// CCT 3.6, 3.12, 3.18
#[test]
fn a_cyclic_tpdo_goes_with_every_nth_sync() {
    with_tpdo(3, 0, 0).talk(
        "
        > 000#0101
        > 080#
        > 080#
        > 080#
        < 381#00
        = 6000:03 11
        > 080#
        > 080#
        > 080#
        < 381#11
        > 080#
        > 000#8001
        > 080#
        > 000#0101 // the count starts anew
        > 080#
        > 080#
        > 080#
        < 381#11
        ",
    );
}

#[test]
fn every_cyclic_type_keeps_its_count() {
    for transmission in 1..=240 {
        let mut bench = with_tpdo(transmission, 0, 0);
        bench.send("000#0101");
        let sent: Vec<usize> = (1..=600).filter(|_| !bench.send("080#").is_empty()).collect();
        let expected: Vec<usize> = (1..=600).filter(|n| n % usize::from(transmission) == 0).collect();
        assert_eq!(sent, expected, "type {transmission}");
    }
}

// CCT 3.7, 3.13, 3.19
#[test]
fn an_acyclic_tpdo_goes_with_the_sync_after_a_change() {
    with_tpdo(0, 0, 0).talk(
        "
        > 000#0101
        + 1s
        > 080#
        < 381#00
        > 080#
        = 6000:03 11
        + 1s
        > 080#
        < 381#11
        > 080#
        ",
    );
}

// CCT 3.3, 3.15
#[test]
fn type_252_answers_a_request_with_what_the_last_sync_sampled() {
    with_tpdo(252, 0, 0).talk(
        "
        = 6000:03 11
        > 000#0101
        > 381#R // no SYNC yet
        > 080#
        = 6000:03 22
        > 381#R
        < 381#11
        > 381#R1
        < 381#11
        > 080#
        > 381#R
        < 381#22
        ",
    );
}

// CCT 3.3, 3.15
#[test]
fn type_253_answers_a_request_with_what_is_now() {
    with_tpdo(253, 0, 0).talk(
        "
        > 000#0101
        = 6000:03 22
        > 080#
        > 381#R
        < 381#22
        + 10s
        ",
    );
}

#[test]
fn every_other_type_answers_requests_too() {
    for transmission in [0, 1, 240, 254, 255] {
        let mut bench = with_tpdo(transmission, 0, 0);
        bench.send("000#0101");
        bench.talk(
            "
            > 381#R
            < 381#00
            + 1s
            ",
        );
    }
}

#[test]
fn a_tpdo_that_forbids_requests_answers_none() {
    let mut bench = with_tpdo(255, 0, 0);
    bench.configure("1802:01", 0xC000_0381);
    bench.configure("1802:01", 0x4000_0381);
    bench.talk(
        "
        > 000#0101
        < 381#00
        > 381#R
        > 381#00 // nor is data an answer
        ",
    );
}

// CCT 3.9
#[test]
fn requests_are_answered_in_operational_only() {
    with_tpdo(253, 0, 0).talk(
        "
        > 381#R
        > 000#0101
        > 000#0201
        > 381#R
        > 000#0101
        > 381#R
        < 381#00
        ",
    );
}

#[test]
fn a_tpdo_that_carries_nothing_or_is_not_valid_is_silent() {
    let mut bench = with_tpdo(255, 0, 10);
    bench.map(0x1802, 0x381, 255, &[]);
    bench.talk(
        "
        > 000#0101
        > 381#R
        = 6000:03 11
        + 1s
        ",
    );
    let mut bench = with_tpdo(255, 0, 10);
    bench.configure("1802:01", 0x8000_0381);
    bench.talk(
        "
        > 000#0101
        > 381#R
        = 6000:03 11
        + 1s
        ",
    );
}

#[test]
fn bits_and_odd_widths_are_packed_low_first() {
    let mut bench = with_tpdo(255, 0, 0);
    bench.map(0x1802, 0x381, 255, &[0x2001_0001, 0x2002_0008, 0x2010_0018, 0x2001_0001]);
    bench.show("2001:00", 1);
    bench.show("2002:00", 0xFF);
    bench.show("2010:00", 0x80_0001);
    bench.talk(
        "
        > 000#0101
        < 381#FF03000003
        = 2001:00 0
        < 381#FE03000001
        = 2010:00 0
        < 381#FE01000000
        ",
    );
}

#[test]
fn eight_bytes_fill_the_frame() {
    let mut bench = with_tpdo(255, 0, 0);
    bench.map(0x1802, 0x381, 255, &[0x2007_0020, 0x2006_0010, 0x6000_0108, 0x6000_0208]);
    bench.talk(
        "
        = 2007:00 04030201
        = 2006:00 0605
        = 6000:01 07
        = 6000:02 08
        > 000#0101
        < 381#0102030405060708
        ",
    );
}

#[test]
fn a_new_event_time_counts_from_its_writing() {
    let mut bench = with_tpdo(255, 0, 1000);
    bench.send("000#0101");
    bench.talk(
        "
        + 500ms
        > 601#2B021805C8000000
        < 581#6002180500000000
        < 381#00
        + 199999us
        + 1us
        < 381#00
        > 601#2B02180500000000
        < 581#6002180500000000
        < 381#00
        + 10s
        ",
    );
}

#[test]
fn the_event_timer_is_for_event_driven_tpdos_only() {
    for transmission in [0, 1, 252, 253] {
        let mut bench = with_tpdo(transmission, 0, 10);
        bench.talk(
            "
            > 000#0101
            + 1s
            ",
        );
    }
}

#[test]
fn an_identifier_may_have_29_bits() {
    let mut bench = with_tpdo(255, 0, 0);
    bench.map(0x1802, 0x2000_0381, 255, &[0x6000_0308]);
    bench.talk(
        "
        > 000#0101
        < 00000381#00
        > 381#R
        > 00000381#R
        < 00000381#00
        ",
    );
}

/// A node in OPERATIONAL whose TPDO 3 goes with every `every`-th SYNC and starts with the SYNC that counts `start`.
fn with_start_value(every: u8, start: u32, overflow: u32) -> Bench {
    let mut bench = with_tpdo(every, 0, 0);
    bench.configure("1019:00", overflow);
    bench.configure("1802:01", 0x8000_0381);
    bench.configure("1802:06", start);
    bench.configure("1802:01", 0x381);
    bench.send("000#0101");
    bench
}

// CCT 3.8, 3.14, 3.20
#[test]
fn a_cyclic_tpdo_starts_with_the_sync_that_counts_its_start_value() {
    with_start_value(1, 3, 4).talk(
        "
        > 080#01
        > 080#02
        > 080#03
        < 381#00
        > 080#04
        < 381#00
        > 080#01
        < 381#00
        > 000#8001
        > 000#0101 // and waits for it again
        > 080#02
        > 080#03
        < 381#00
        ",
    );
}

// CCT 3.8, 3.14, 3.20
#[test]
fn the_sync_with_the_start_value_counts_as_the_first() {
    with_start_value(2, 2, 4).talk(
        "
        > 080#04 // the counter is past the start value: one more round
        > 080#01
        > 080#02
        > 080#03
        < 381#00
        > 080#04
        > 080#01
        < 381#00
        ",
    );
}

#[test]
fn without_a_counter_the_start_value_does_not_matter() {
    with_start_value(2, 9, 0).talk(
        "
        > 080#
        > 080#
        < 381#00
        ",
    );
}

#[test]
fn the_start_value_of_a_valid_tpdo_stays() {
    Bench::new().talk(
        "
        > 601#2F00180602000000
        < 581#8000180622000008
        > 601#2F00180600000000 // the same is no change
        < 581#6000180600000000
        > 601#2F021806F0000000 // 240
        < 581#6002180600000000
        > 601#2F021806F1000000
        < 581#8002180630000906
        ",
    );
}

#[test]
fn only_what_carries_nothing_but_the_values_of_one_tpdo_may_be_replaced_by_a_newer_one() {
    let mut bench = with_tpdo(255, 0, 0);
    let is_tpdo = |bench: &Bench, id| bench.node.is_tpdo(Id::Standard(id));
    assert!(is_tpdo(&bench, 0x381));
    for id in [0x000, 0x080, 0x081, 0x181, 0x281, 0x201, 0x581, 0x701] {
        assert!(!is_tpdo(&bench, id), "{id:03X}");
    }
    // An identifier that two services share.
    bench.configure("1802:01", 0x8000_0381);
    bench.configure("1802:01", 0x81);
    assert!(!is_tpdo(&bench, 0x81));
    bench.configure("1014:00", 0x8000_0081);
    bench.configure("1014:00", 0x82);
    assert!(is_tpdo(&bench, 0x81));
    bench.configure("1800:01", 0x81);
    assert!(!is_tpdo(&bench, 0x81));
}
