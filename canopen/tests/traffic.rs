//! How much a node has to do, for whoever asks it.

mod bench;

use bench::Bench;
use canopen::{Id, Traffic};

#[test]
fn frames_are_counted_by_what_they_are_for() {
    let mut bench = Bench::new();
    let before = bench.node.traffic();
    assert_eq!(before, Traffic::default());
    // Start, two SYNCs, an upload that is answered at once, one of a string in blocks, and frames for others.
    for frame in ["000#0101", "080#", "080#", "601#4000100000000000", "602#4000100000000000", "701#05"] {
        bench.send(frame);
    }
    let sent = ["601#A00810007F000000", "601#A300000000000000"].map(|frame| bench.send(frame).len());
    let traffic = bench.node.traffic();
    assert_eq!((traffic.nmt, traffic.syncs), (1, 2));
    assert_eq!(traffic.sdo_requests, 3);
    assert_eq!(traffic.sdo_answers, 1 + (sent[0] + sent[1]) as u64);
    assert!(sent[1] > 1, "segments count each");
}

#[test]
fn pdos_count_both_ways_and_only_where_there_is_a_service() {
    let mut bench = Bench::new();
    bench.send("000#0101");
    let sent = bench.send("080#").iter().filter(|frame| frame.id == Id::Standard(0x181)).count() as u64;
    let before = bench.node.traffic();
    bench.send("201#0000000000000000");
    bench.send("202#0000000000000000");
    let after = bench.node.traffic();
    assert_eq!(after.rpdos - before.rpdos, 1, "{after:?}");
    assert!(after.tpdos >= sent);
}
