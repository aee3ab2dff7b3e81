//! What a lost connection does (CiA 301 v4.2, section 7.5.2.26), and errors of the CAN controller.

mod bench;

use core::time::Duration;

use bench::{Bench, device};
use canopen::{BusState, Cause, Event, NmtState};
use od::Schema;

/// Supervises node 2 and has 0x1029:01 at `behaviour`; heard node 2 once.
fn supervising(behaviour: u32) -> Bench {
    let mut bench = Bench::new();
    bench.configure("1016:01", 0x0002_0064);
    bench.configure("1029:01", behaviour);
    bench.send("702#05");
    bench
}

#[test]
fn the_error_behaviour_says_what_a_lost_connection_does_to_the_state() {
    use NmtState::{Operational, PreOperational, Stopped};
    let commands = [("000#0101", Operational), ("000#8001", PreOperational), ("000#0201", Stopped)];
    let outcomes = [
        (0, [PreOperational, PreOperational, Stopped]),
        (1, [Operational, PreOperational, Stopped]),
        (2, [Stopped, Stopped, Stopped]),
    ];
    for (behaviour, states) in outcomes {
        for ((command, before), after) in commands.into_iter().zip(states) {
            let mut bench = supervising(behaviour);
            bench.send(command);
            bench.pass(Duration::from_millis(100));
            assert_eq!(bench.node.state(), after, "{behaviour} in {before:?}");
            assert!(bench.events().contains(&Event::ConnectionLost(Cause::Heartbeat(2))));
        }
    }
}

#[test]
fn the_error_is_told_before_the_node_stops() {
    let mut bench = supervising(2);
    bench.send("000#0101");
    bench.configure("1017:00", 100);
    bench.talk(
        "
        + 100ms
        < 081#3081110200000000
        < 701#04
        > 601#4000100000000000
        ",
    );
}

#[test]
fn other_behaviours_do_not_exist_06090030() {
    for reserved in [0x03, 0x7F, 0x80, 0xFF] {
        Bench::new().talk(&format!(
            "
            > 601#2F291001{reserved:02X}000000
            < 581#8029100130000906
            "
        ));
    }
}

#[test]
fn without_0x1029_an_operational_node_becomes_pre_operational() {
    let mut objects = device::communication_objects();
    objects.retain(|object| object.index != 0x1029);
    let mut bench = Bench::with(Schema::new(objects).unwrap()).started();
    bench.configure("1016:01", 0x0002_0064);
    bench.send("702#05");
    bench.send("000#0101");
    bench.pass(Duration::from_millis(100));
    assert_eq!(bench.node.state(), NmtState::PreOperational);
}

#[test]
fn a_bus_off_is_told_when_the_bus_is_back() {
    let mut bench = Bench::operational();
    bench.events();
    bench.node.set_bus_state(bench.now, BusState::Off);
    assert_eq!(bench.events(), [Event::ConnectionLost(Cause::BusOff), Event::Nmt(NmtState::PreOperational)]);
    bench.talk("+ 10s");
    bench.node.set_bus_state(bench.now, BusState::Active);
    bench.talk(
        "
        < 081#4081110000000000
        < 081#0000000000000000
        > 601#4003100100000000
        < 581#4303100140810000
        > 601#4001100000000000
        < 581#4F01100000000000
        ",
    );
    assert_eq!(bench.events(), []);
}

#[test]
fn what_happens_while_the_bus_is_off_is_told_later() {
    let mut bench = supervising(0);
    bench.node.set_bus_state(bench.now, BusState::Off);
    bench.talk("+ 1s");
    bench.node.set_bus_state(bench.now, BusState::Active);
    bench.talk(
        "
        < 081#4081110000000000
        < 081#3081110200000000
        < 081#0000110000000000
        > 702#05
        < 081#0000000000000000
        ",
    );
}

#[test]
fn an_error_passive_controller_is_told_until_it_is_active_again() {
    let mut bench = Bench::operational();
    for state in [BusState::Passive, BusState::Passive] {
        bench.node.set_bus_state(bench.now, state);
    }
    bench.talk("< 081#2081110000000000");
    assert_eq!(bench.node.state(), NmtState::Operational);
    for reset in ["000#8201", "000#8101"] {
        bench.talk(&format!(
            "
            > {reset} // the bus is no better for it
            < 701#00
            < 081#2081110000000000
            "
        ));
    }
    bench.node.set_bus_state(bench.now, BusState::Active);
    bench.talk("< 081#0000000000000000");
}

#[test]
fn a_missing_rpdo_is_a_lost_connection() {
    let mut bench = Bench::operational();
    bench.configure("1400:05", 100);
    bench.configure("1029:01", 2);
    bench.send("201#1122");
    bench.events();
    bench.talk(
        "
        + 100ms
        < 081#5082110100000000
        ",
    );
    assert_eq!(bench.events(), [Event::ConnectionLost(Cause::Rpdo(1)), Event::Nmt(NmtState::Stopped)]);
}
