//! Emergency producer (CiA 301 v4.2, section 7.2.7).

mod bench;

use bench::Bench;
use canopen::{Emergency, ErrorRegister};

const UNDERVOLTAGE: Emergency =
    Emergency { code: 0x3220, register: ErrorRegister::VOLTAGE, detail: [1, 2, 3, 4, 5] };
const TOO_HOT: Emergency =
    Emergency { code: 0x4310, register: ErrorRegister::TEMPERATURE, detail: [6, 7, 8, 9, 10] };

// CCT 5.1, 5.2, 5.4, 5.5
#[test]
fn an_error_is_told_once_and_its_end_too() {
    let mut bench = Bench::new();
    bench.talk(
        "
        > 601#4014100000000000
        < 581#4314100081000000
        > 601#4001100000000000
        < 581#4F01100000000000
        ",
    );
    bench.node.raise(UNDERVOLTAGE);
    bench.node.raise(UNDERVOLTAGE);
    bench.talk(
        "
        < 081#2032050102030405
        > 601#4001100000000000
        < 581#4F01100005000000
        ",
    );
    bench.node.raise(TOO_HOT);
    bench.talk(
        "
        < 081#10430D060708090A
        > 601#4001100000000000
        < 581#4F0110000D000000
        ",
    );
    bench.node.clear(UNDERVOLTAGE.code);
    bench.node.clear(UNDERVOLTAGE.code);
    bench.node.clear(0x1234);
    bench.talk("< 081#0000090000000000");
    bench.node.clear(TOO_HOT.code);
    bench.talk(
        "
        < 081#0000000000000000
        > 601#4001100000000000
        < 581#4F01100000000000
        + 10s
        ",
    );
}

// CCT 5.3, 5.6
#[test]
fn the_history_has_the_newest_error_first() {
    let mut bench = Bench::new();
    bench.node.raise(UNDERVOLTAGE);
    bench.node.raise(TOO_HOT);
    bench.talk(
        "
        < 081#2032050102030405
        < 081#10430D060708090A
        > 601#4003100000000000
        < 581#4F03100002000000
        > 601#4003100100000000
        < 581#4303100110430607
        > 601#4003100200000000
        < 581#4303100220320102
        > 601#4003100300000000
        < 581#8003100324000008
        ",
    );
    bench.node.clear(TOO_HOT.code); // no entry
    bench.talk(
        "
        < 081#0000050000000000
        > 601#4003100000000000
        < 581#4F03100002000000
        ",
    );
}

#[test]
fn the_history_keeps_the_newest_and_zero_clears_it() {
    let mut bench = Bench::new();
    for code in 0x5001..=0x5006 {
        bench.node.raise(Emergency { code, ..UNDERVOLTAGE });
    }
    bench.settle();
    bench.talk(
        "
        > 601#4003100000000000
        < 581#4F03100004000000
        > 601#4003100100000000
        < 581#4303100106500102
        > 601#4003100400000000
        < 581#4303100403500102
        > 601#2F03100001000000
        < 581#8003100030000906
        > 601#2F03100000000000
        < 581#6003100000000000
        > 601#4003100100000000
        < 581#8003100124000008
        ",
    );
    bench.node.raise(TOO_HOT);
    bench.talk(
        "
        < 081#10430D060708090A
        > 601#4003100000000000
        < 581#4F03100001000000
        > 601#4003100100000000
        < 581#4303100110430607
        > 601#4003100200000000
        < 581#8003100224000008
        ",
    );
}

#[test]
fn the_inhibit_time_keeps_messages_apart() {
    let mut bench = Bench::new();
    bench.configure("1015:00", 100);
    bench.node.raise(UNDERVOLTAGE);
    bench.node.raise(TOO_HOT);
    bench.node.clear(TOO_HOT.code);
    bench.talk(
        "
        < 081#2032050102030405
        + 9999us
        + 1us
        < 081#10430D060708090A
        + 9999us
        + 1us
        < 081#0000050000000000
        + 10s
        ",
    );
}

#[test]
fn a_stopped_node_tells_its_errors_later() {
    let mut bench = Bench::new();
    bench.send("000#0201");
    bench.node.raise(UNDERVOLTAGE);
    bench.talk(
        "
        + 10s
        > 000#8001
        < 081#2032050102030405
        ",
    );
}

#[test]
fn emcy_may_have_another_identifier_or_none() {
    let mut bench = Bench::new();
    bench.talk(
        "
        > 601#2314100082000080
        < 581#6014100000000000
        ",
    );
    bench.node.raise(UNDERVOLTAGE);
    bench.node.raise(TOO_HOT);
    bench.talk(
        "
        + 1s
        > 601#2314100082000000
        < 581#6014100000000000
        + 1s
        > 601#4003100000000000 // the history knows
        < 581#4F03100002000000
        ",
    );
    bench.node.clear(TOO_HOT.code);
    bench.talk("< 082#0000050000000000");
}

#[test]
fn an_error_that_stands_is_told_again_after_a_reset_of_the_communication() {
    let mut bench = Bench::new();
    bench.node.raise(UNDERVOLTAGE);
    bench.talk(
        "
        < 081#2032050102030405
        > 080#01
        < 081#4082150100000000
        > 000#8201
        < 701#00
        < 081#2032050102030405
        > 601#4003100000000000
        < 581#4F03100001000000
        ",
    );
}

#[test]
fn an_error_before_power_on_is_told_after_the_boot_up() {
    let mut bench = Bench::off();
    bench.node.raise(UNDERVOLTAGE);
    bench.node.start(bench.now, &bench.device);
    bench.talk(
        "
        < 701#00
        < 081#2032050102030405
        ",
    );
}

#[test]
fn a_reset_of_the_node_forgets_every_error() {
    let mut bench = Bench::new();
    bench.node.raise(UNDERVOLTAGE);
    bench.talk(
        "
        < 081#2032050102030405
        > 000#8101
        < 701#00
        > 601#4001100000000000
        < 581#4F01100000000000
        > 601#4003100000000000
        < 581#4F03100000000000
        ",
    );
    bench.node.raise(UNDERVOLTAGE);
    bench.talk("< 081#2032050102030405");
}

#[test]
fn of_a_flood_of_errors_32_stand_and_the_last_16_are_told() {
    let mut bench = Bench::new();
    bench.configure("1015:00", 10);
    for code in 1..=1000 {
        bench.node.raise(Emergency { code, ..UNDERVOLTAGE });
    }
    let sent = bench.pass(core::time::Duration::from_secs(10));
    let expected: Vec<_> =
        (17..=32).map(|code| bench::frame_of(&format!("081#{code:02X}00050102030405"))).collect();
    assert_eq!(sent, expected);
}
