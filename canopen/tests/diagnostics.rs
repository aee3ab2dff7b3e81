//! What a node remembers of what went wrong, for whoever asks it.

mod bench;

use core::time::Duration;

use bench::Bench;
use canopen::{Abort, BusState, Cause, Emergency, ErrorRegister, Recent};
use od::{AbortCode, Address};

const UNDERVOLTAGE: Emergency =
    Emergency { code: 0x3220, register: ErrorRegister::VOLTAGE, detail: [1, 2, 3, 4, 5] };

/// What happened, newest first, without its times.
fn all<T: Copy>(recent: &Recent<T>) -> Vec<T> {
    recent.iter().map(|(_, what)| what).collect()
}

fn abort(index: u16, sub: u8, code: AbortCode) -> Abort {
    Abort { address: Address::new(index, sub), code }
}

#[test]
fn every_abort_is_counted_and_the_last_ones_are_kept_with_their_times() {
    let mut bench = Bench::new();
    let start = bench.now;
    bench.send("601#4000500000000000");
    bench.talk(
        "
        + 5ms
        > 601#2F00100001000000
        < 581#8000100002000106
        > 601#4008100000000000
        < 581#410810000C000000
        + 1s
        < 581#8008100000000405
        ",
    );
    let aborts = bench.node.diagnostics().aborts;
    let expected = [
        abort(0x1008, 0, AbortCode::TimedOut),
        abort(0x1000, 0, AbortCode::ReadOnly),
        abort(0x5000, 0, AbortCode::NoObject),
    ];
    assert_eq!((aborts.count(), all(&aborts).as_slice()), (3, expected.as_slice()));
    let times: Vec<_> = aborts.iter().map(|(at, _)| at.saturating_since(start).as_millis()).collect();
    assert_eq!(times, [1005, 5, 0]);
}

#[test]
fn good_answers_and_segments_are_no_aborts() {
    let mut bench = Bench::new();
    for request in ["601#4000100000000000", "601#A00810007F000000", "601#A300000000000000"] {
        assert_ne!(bench.send(request), []);
    }
    assert_eq!(bench.node.diagnostics().aborts, Recent::default());
}

#[test]
fn of_many_the_last_five_are_kept_and_all_are_counted() {
    let mut bench = Bench::new();
    for sub in 0..9 {
        bench.send(&format!("601#400050{sub:02X}00000000"));
    }
    let aborts = bench.node.diagnostics().aborts;
    let expected: Vec<_> = (4..9).rev().map(|sub| abort(0x5000, sub, AbortCode::NoObject)).collect();
    assert_eq!((aborts.count(), all(&aborts)), (9, expected));
}

#[test]
fn emergencies_are_noted_when_they_are_sent_and_errors_stand_until_they_are_over() {
    let mut bench = Bench::new();
    bench.node.set_bus_state(bench.now, BusState::Off);
    bench.node.raise(UNDERVOLTAGE);
    bench.settle();
    let codes =
        |bench: &Bench| all(&bench.node.diagnostics().sent).iter().map(|e| e.code).collect::<Vec<_>>();
    let standing = |bench: &Bench| bench.node.errors().iter().map(|e| e.code).collect::<Vec<_>>();
    assert_eq!((codes(&bench), standing(&bench)), (vec![], vec![0x8140, 0x3220]));

    bench.node.set_bus_state(bench.now, BusState::Active);
    bench.settle();
    assert_eq!((codes(&bench), standing(&bench)), (vec![0, 0x3220, 0x8140], vec![0x3220]));

    bench.node.clear(UNDERVOLTAGE.code);
    bench.settle();
    assert_eq!((codes(&bench), standing(&bench)), (vec![0, 0, 0x3220, 0x8140], vec![]));
}

#[test]
fn emergencies_of_others_are_noted_with_their_producer() {
    let mut bench = Bench::new();
    bench.configure("1028:02", 0x82);
    bench.send("082#2032040102030405");
    let heard = all(&bench.node.diagnostics().heard);
    assert_eq!(heard, [(2, UNDERVOLTAGE)]);
}

#[test]
fn lost_connections_are_noted_with_their_cause() {
    let mut bench = Bench::new();
    bench.configure("1016:01", 0x0002_0064);
    bench.send("702#05");
    bench.talk("+ 100ms\n< 081#3081110200000000");
    bench.node.set_bus_state(bench.now, BusState::Off);
    let lost = all(&bench.node.diagnostics().lost);
    assert_eq!(lost, [Cause::BusOff, Cause::Heartbeat(2)]);
}

#[test]
fn rpdos_of_a_wrong_length_are_counted() {
    let mut bench = Bench::operational();
    for frame in ["201#11", "201#11", "201#112233"] {
        bench.send(frame);
    }
    let counters = bench.node.counters();
    assert_eq!((counters.short_rpdos, counters.long_rpdos), (2, 1));
}

#[test]
fn a_reset_forgets_nothing_of_it() {
    let mut bench = Bench::new();
    bench.send("601#4000500000000000");
    bench.now = bench.now + Duration::from_secs(1);
    bench.send("000#8101");
    assert_eq!(bench.node.diagnostics().aborts.count(), 1);
}
