//! Emergency consumer (CiA 301 v4.2, sections 7.2.7 and 7.5.2.25).

mod bench;

use bench::Bench;
use canopen::{Emergency, ErrorRegister, Event, Id};

/// A node that listens to the emergencies of node 2.
fn listening() -> Bench {
    let mut bench = Bench::new();
    bench.configure("1028:02", 0x82);
    bench.events();
    bench
}

fn heard(code: u16, register: u8, detail: [u8; 5]) -> Event {
    let register = ErrorRegister::from_bits_retain(register);
    Event::Emergency { producer: 2, emergency: Emergency { code, register, detail } }
}

#[test]
fn the_errors_of_others_and_their_ends_are_heard() {
    let mut bench = listening();
    bench.talk(
        "
        > 082#2032050102030405
        > 082#0000000000000000
        > 083#2032050102030405 // nobody asked for it
        ",
    );
    assert_eq!(bench.events(), [heard(0x3220, 5, [1, 2, 3, 4, 5]), heard(0, 0, [0; 5])]);
}

#[test]
fn the_sub_index_is_the_node_whatever_the_identifier() {
    let mut bench = listening();
    bench.configure("1028:02", 0x8000_0082);
    bench.configure("1028:02", 0x2000_0123);
    bench.events();
    bench.talk(
        "
        > 082#2032050102030405
        > 00000123#1043090000000000
        ",
    );
    assert_eq!(bench.events(), [heard(0x4310, 9, [0; 5])]);
}

#[test]
fn an_identifier_changes_only_while_the_consumer_does_not_exist() {
    let mut bench = listening();
    bench.talk(
        "
        > 601#2328100283000000
        < 581#8028100222000008
        > 601#2328100282000080
        < 581#6028100200000000
        > 601#2328100283000000
        < 581#6028100200000000
        ",
    );
    let ids: Vec<Id> = bench.node.subscriptions().collect();
    assert!(ids.contains(&Id::Standard(0x83)) && !ids.contains(&Id::Standard(0x82)), "{ids:?}");
}

#[test]
fn a_stopped_node_hears_none() {
    let mut bench = listening();
    bench.send("000#0201");
    bench.events();
    bench.send("082#2032050102030405");
    assert_eq!(bench.events(), []);
}

#[test]
fn what_has_not_eight_bytes_is_no_emergency() {
    let mut bench = listening();
    for frame in ["082#", "082#20320501020304", "082#R8"] {
        bench.send(frame);
    }
    assert_eq!(bench.events(), []);
    assert_eq!(bench.node.counters().malformed, 3);
}

#[test]
fn a_flood_of_emergencies_is_bounded() {
    let mut bench = listening();
    for number in 0..1000 {
        bench.send(&format!("082#2032{:02X}0102030405", number % 256));
    }
    assert_eq!(bench.events().len(), 32);
    assert_eq!(bench.node.counters().dropped_events, 968);
}
