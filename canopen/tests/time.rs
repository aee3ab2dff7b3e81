//! TIME (CiA 301 v4.2, sections 7.2.6 and 7.5.2.15).

mod bench;

use bench::{Bench, frame_of};
use canopen::{Event, TimeOfDay};

// 1 January 2024, noon
const NOON: TimeOfDay = TimeOfDay { days: 14_610, millis: 43_200_000 };
const NOON_FRAME: &str = "100#002E93021239";

#[test]
fn a_consumer_knows_the_last_time_and_when_it_came() {
    let mut bench = Bench::new();
    bench.configure("1012:00", 0x8000_0100);
    bench.events();
    assert_eq!(bench.node.network_time(), None);
    assert_eq!(bench.send("100#010000000000"), []);
    bench.talk("+ 5ms");
    assert_eq!(bench.send(NOON_FRAME), []);
    assert_eq!(bench.node.network_time(), Some((bench.now, NOON)));
    assert_eq!(bench.events(), [Event::Time]);
    bench.send("000#8101");
    assert_eq!(bench.node.network_time(), None);
}

#[test]
fn what_is_no_time_is_counted() {
    let mut bench = Bench::new();
    bench.configure("1012:00", 0x8000_0100);
    bench.send("100#0102030405");
    bench.send("100#R6");
    assert_eq!(bench.node.network_time(), None);
    assert_eq!(bench.node.counters().malformed, 2);
}

#[test]
fn time_is_consumed_only_if_bit_31_says_so_and_the_node_is_not_stopped() {
    let mut bench = Bench::new();
    bench.send(NOON_FRAME);
    assert_eq!(bench.node.network_time(), None);
    bench.configure("1012:00", 0x8000_0100);
    bench.send("000#0201");
    bench.send(NOON_FRAME);
    assert_eq!(bench.node.network_time(), None);
    bench.send("000#0101");
    bench.send(NOON_FRAME);
    assert!(bench.node.network_time().is_some());
}

#[test]
fn a_producer_tells_the_time_that_its_owner_gives() {
    let mut bench = Bench::new();
    assert!(!bench.node.produces_time() && !bench.node.produce_time(NOON));
    bench.configure("1012:00", 0x4000_0100);
    assert!(bench.node.produces_time() && bench.node.produce_time(NOON));
    assert_eq!(bench.settle(), [frame_of(NOON_FRAME)]);
    bench.send("000#0201");
    assert!(!bench.node.produces_time() && !bench.node.produce_time(NOON));
    assert_eq!(bench.settle(), []);
    bench.send("000#8201");
    assert!(!bench.node.produces_time(), "the default again");
}

#[test]
fn the_identifier_stays_while_time_is_consumed_or_produced() {
    Bench::new().talk(
        "
        > 601#2312100081000000
        < 581#6012100000000000
        > 601#2312100000010080 // 0x100, consumer
        < 581#6012100000000000
        > 601#2312100081000080
        < 581#8012100022000008
        > 601#23121000000100C0 // producer too
        < 581#6012100000000000
        > 601#2312100081000040
        < 581#8012100022000008
        > 601#2312100081000000 // neither
        < 581#6012100000000000
        ",
    );
}
