//! Further SDO servers and the time-out of all (CiA 301 v4.2, section 7.5.2.33). CCT 2.12, 2.28, 2.29.

mod bench;

use core::time::Duration;

use bench::{Bench, frame_of};
use canopen::Id;

/// A node in PRE-OPERATIONAL whose second SDO server listens to 0x6D0 and answers with 0x6D1.
fn with_second_server() -> Bench {
    let mut bench = Bench::new();
    bench.configure("1201:01", 0x6D0);
    bench.configure("1201:02", 0x6D1);
    bench
}

// CCT 2.12, 2.28
#[test]
fn the_default_server_is_fixed_and_the_further_ones_are_off() {
    Bench::new().talk(
        "
        > 601#4000120100000000
        < 581#4300120101060000
        > 601#4000120200000000
        < 581#4300120281050000
        > 601#23001201D0060000
        < 581#8000120102000106
        > 601#4001120100000000
        < 581#4301120100000080
        > 601#4001120200000000
        < 581#4301120200000080
        > 601#4003120000000000
        < 581#8003120000000206
        ",
    );
}

#[test]
fn a_server_is_on_when_both_its_identifiers_are_valid() {
    Bench::new().talk(
        "
        > 601#23011201D0060000
        < 581#6001120100000000
        > 6D0#4000100000000000
        > 601#23011202D1060000
        < 581#6001120200000000
        > 6D0#4000100000000000
        < 6D1#4300100092010200
        > 6D0#23011202D1060080 // switches itself off, with an answer
        < 6D1#6001120200000000
        > 6D0#4000100000000000
        > 601#4000100000000000
        < 581#4300100092010200
        ",
    );
}

#[test]
fn an_identifier_changes_only_while_it_is_not_valid() {
    let mut bench = with_second_server();
    bench.talk(
        "
        > 601#23011201D2060000
        < 581#8001120122000008
        > 601#23011202D2060000
        < 581#8001120222000008
        > 601#23011201D2060080
        < 581#6001120100000000
        > 601#23011201D2060000
        < 581#6001120100000000
        > 6D2#4000100000000000
        < 6D1#4300100092010200
        ",
    );
}

#[test]
fn subscriptions_follow() {
    let mut bench = with_second_server();
    assert!(bench.node.subscriptions().any(|id| id == Id::Standard(0x6D0)));
    assert_eq!(bench.send("000#8201"), [frame_of("701#00")]);
    assert!(bench.node.subscriptions().all(|id| id != Id::Standard(0x6D0)));
}

#[test]
fn every_server_has_a_transfer_of_its_own() {
    with_second_server().talk(
        "
        > 601#4008100000000000
        < 581#410810000C000000
        > 6D0#4009200000000000
        < 6D1#4109200000000000
        > 6D0#2109200008000000
        < 6D1#6009200000000000
        > 601#6000000000000000
        < 581#0042656E63682064
        > 6D0#0041424344454647
        < 6D1#2000000000000000
        > 601#7000000000000000
        < 581#1565766963650000
        > 6D0#1D48000000000000
        < 6D1#3000000000000000
        > 6D0#A409200002000000
        < 6D1#C609200008000000
        > 6D0#A300000000000000
        < 6D1#0141424344454647
        < 6D1#8248000000000000
        ",
    );
}

#[test]
fn each_server_has_a_time_out_of_its_own() {
    with_second_server().talk(
        "
        > 601#4008100000000000
        < 581#410810000C000000
        + 400ms
        > 6D0#4008100000000000
        < 6D1#410810000C000000
        + 1s
        < 581#8008100000000405
        < 6D1#8008100000000405
        ",
    );
}

#[test]
fn a_stopped_node_has_no_sdo_servers() {
    with_second_server().talk(
        "
        > 6D0#4008100000000000
        < 6D1#410810000C000000
        > 000#0201
        > 6D0#6000000000000000
        > 000#0101
        < 181#0000
        > 6D0#6000000000000000
        < 6D1#8000000001000405
        ",
    );
}

#[test]
fn the_time_out_may_be_another() {
    let mut bench = with_second_server();
    bench.node.set_sdo_timeout(Duration::from_millis(200));
    bench.talk(
        "
        > 601#4008100000000000
        < 581#410810000C000000
        > 6D0#C40A200000000000
        < 6D1#A40A20007F000000
        > 6D0#0101020304050607
        + 199999us
        < 6D1#A2017F0000000000 // after half the time
        + 1us
        < 581#8008100000000405
        < 6D1#800A200000000405
        ",
    );
}
