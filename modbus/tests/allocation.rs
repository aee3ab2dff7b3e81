//! From a request to its answer no memory is allocated.

mod bench;

use allocation_counter::measure;
use bench::{Bench, bytes};
use modbus::{Dialect, tcp_adu};

#[test]
fn a_warm_server_answers_without_allocating() {
    let mut bench = Bench::new(Dialect::Full);
    let requests: Vec<Vec<u8>> = [
        "03 80 00 00 7C",
        "04 10 00 00 20",
        "01 00 00 00 20",
        "05 00 10 FF 00",
        "06 10 2F 00 0F",
        "10 00 04 00 04 08 00 02 00 00 4B 40 00 4C",
        "17 80 06 00 02 00 06 00 02 04 56 78 12 34",
        "16 10 2F 00 00 00 0F",
        "11",
        "2B 0E 02 00",
        "2B 0D 00 00 00 60 41 00 00 00 00 02",
        "03 FF FF 00 02",
    ]
    .iter()
    .map(|pdu| tcp_adu(1, bench::UNIT, &bytes(pdu)))
    .collect();
    let mut round = || {
        for request in &requests {
            bench.server.handle_bytes(bench.now, request);
            assert!(bench.serve_one());
            bench.server.sent(bench.server.output().len());
            while bench.dictionary.take_written().is_some() {}
        }
    };
    round();
    let allocations = measure(|| (0..100).for_each(|_| round()));
    assert_eq!(allocations.count_total, 0);
}
