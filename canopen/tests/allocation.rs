//! From a frame to its answer no memory is allocated.

mod bench;

use allocation_counter::measure;
use bench::{Bench, frame_of};
use canopen::Frame;
use core::time::Duration;

/// What a master and a device do all day.
fn traffic(bench: &mut Bench, frames: &[Frame]) -> usize {
    let slot = bench.device.find(od::Address::new(0x6000, 1)).unwrap();
    let mut sent = 0;
    for frame in frames {
        bench.device.set(slot, bench.device.raw(slot) + 1);
        bench.now = bench.now + Duration::from_millis(1);
        bench.node.handle_timeout(bench.now, &mut bench.device);
        bench.node.handle_frame(bench.now, frame, &mut bench.device);
        while bench.device.take_written().is_some() {}
        bench.node.sample(bench.now, &bench.device);
        while bench.node.poll_transmit().is_some() {
            sent += 1;
        }
        while bench.node.poll_event().is_some() {}
    }
    sent
}

#[test]
fn a_warm_node_answers_without_allocating() {
    let mut bench = Bench::operational();
    bench.configure("1017:00", 10);
    bench.configure("1012:00", 0x8000_0100);
    bench.configure("1007:00", 500);
    bench.configure("1006:00", 5000);
    bench.configure("1005:00", 0x4000_0080);
    bench.configure("1016:01", 0x0002_03E8);
    bench.configure("1028:02", 0x82);
    bench.configure("1400:05", 1000);
    let frames: Vec<Frame> = [
        "601#4000100000000000", // expedited upload
        "601#2F05200011000000", // and download
        "601#4008100000000000", // segmented upload
        "601#6000000000000000",
        "601#7000000000000000",
        "601#210A200008000000", // and download
        "601#0001020304050607",
        "601#1D08000000000000",
        "601#4000200000000000", // refusals
        "601#2F01200002000000",
        "201#1122",
        "301#33",
        "080#",
        "181#R",
        "100#010203040506",
        "702#05",
        "082#3081110100000000",
        "7FF#00",
        "000#0101",
    ]
    .map(frame_of)
    .into();
    traffic(&mut bench, &frames);
    let mut sent = 0;
    let allocations = measure(|| sent = (0..100).map(|_| traffic(&mut bench, &frames)).sum::<usize>());
    assert_eq!(allocations.count_total, 0);
    assert!(sent > 2500, "{sent}");
}
