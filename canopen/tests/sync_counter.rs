//! SYNC with a counter (CiA 301 v4.2, sections 7.2.5 and 7.5.2.22). CCT 6.5-6.9.

mod bench;

use bench::Bench;

/// A node in PRE-OPERATIONAL that produces a SYNC every 10 ms and counts to 3.
fn producer() -> Bench {
    let mut bench = Bench::new();
    bench.configure("1019:00", 3);
    bench.configure("1006:00", 10_000);
    bench.configure("1005:00", 0x4000_0080);
    bench
}

// CCT 6.7
#[test]
fn the_counter_goes_from_1_to_its_overflow_value_and_again() {
    producer().talk(
        "
        + 50ms
        < 080#01
        < 080#02
        < 080#03
        < 080#01
        < 080#02
        ",
    );
}

#[test]
fn the_counter_starts_at_1_after_a_stop_only() {
    producer().talk(
        "
        + 10ms
        < 080#01
        > 000#0101
        < 181#0000
        + 10ms
        < 080#02
        < 281#00
        > 000#8001
        + 10ms
        < 080#03
        > 000#0201
        > 000#0101
        < 181#0000
        + 10ms
        < 080#01
        < 281#00
        ",
    );
}

// CCT 6.5, 6.6
#[test]
fn the_overflow_value_is_0_or_2_to_240() {
    Bench::new().talk(
        "
        > 601#2F19100001000000
        < 581#8019100030000906
        > 601#2F191000F1000000
        < 581#8019100030000906
        > 601#2F191000FF000000
        < 581#8019100030000906
        > 601#2F19100002000000
        < 581#6019100000000000
        > 601#2F191000F0000000
        < 581#6019100000000000
        > 601#2F19100000000000
        < 581#6019100000000000
        ",
    );
}

// CCT 6.9
#[test]
fn the_overflow_value_stays_while_there_is_a_period() {
    Bench::new().talk(
        "
        > 601#2306100010270000
        < 581#6006100000000000
        > 601#2F1910000A000000
        < 581#8019100022000008
        > 601#2F19100000000000
        < 581#8019100022000008
        > 601#2306100000000000
        < 581#6006100000000000
        > 601#2F1910000A000000
        < 581#6019100000000000
        ",
    );
}

#[test]
fn a_consumer_with_a_counter_takes_a_sync_of_one_byte_only() {
    let mut bench = Bench::operational();
    bench.configure("1019:00", 10);
    bench.talk(
        "
        > 301#2A
        > 080#
        < 081#4082110000000000 // 8240h, no byte
        > 080#0102
        > 080#01
        < 081#0000000000000000
        < 281#2A
        ",
    );
}
