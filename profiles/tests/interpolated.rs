//! Interpolated position mode: records, their buffer and the bits.

mod bench;

use bench::Bench;
use od::AbortCode;

const IP: i64 = 7;
const RUN: i64 = 0x1F;
const HOLD: i64 = 0x0F;
const HALT: i64 = 1 << 8;
const REACHED: u32 = 10;
const ACTIVE: u32 = 12;

/// A drive with an interpolation time of 4 ms and room for so many records.
fn with_buffer(size: i64) -> Bench {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.batch(&[(0x60C2, 1, 4), (0x60C4, 2, size)]).unwrap();
    bench.enable(IP);
    assert_eq!(bench.get(0x6061), IP);
    bench
}

fn record(bench: &mut Bench, position: i64) {
    bench.set_sub(0x60C1, 1, position);
}

#[test]
fn records_are_joined_by_straight_lines_once_bit_4_says_so() {
    let mut bench = with_buffer(8);
    for position in [20, 48, 76] {
        record(&mut bench, position);
    }
    bench.run(50);
    assert_eq!((bench.get(0x6062), bench.get_sub(0x60C4, 4)), (0, 3), "they wait");
    assert!(!bench.is_set(ACTIVE));
    bench.control(RUN);
    assert!(bench.is_set(ACTIVE) && !bench.is_set(REACHED));
    let places: Vec<_> = (0..14)
        .map(|_| {
            bench.run(1);
            bench.get(0x6062)
        })
        .collect();
    assert_eq!(places, [5, 10, 15, 20, 27, 34, 41, 48, 55, 62, 69, 76, 76, 76]);
    bench.run(50);
    assert!(bench.is_set(REACHED) && bench.is_set(ACTIVE), "an empty buffer means hold");
    record(&mut bench, 60);
    bench.run(2);
    assert_eq!((bench.get(0x6062), bench.is_set(REACHED)), (68, false));
    bench.run(2);
    assert_eq!(bench.get(0x6062), 60);
}

#[test]
fn a_record_each_period_makes_an_even_motion() {
    let mut bench = with_buffer(1);
    bench.control(RUN);
    for cycle in 1..=100 {
        record(&mut bench, cycle * 80);
        bench.run(4);
        if cycle > 10 {
            assert!((bench.get(0x606B) - 20_000).abs() <= 1, "{} in cycle {cycle}", bench.get(0x606B));
        }
    }
}

#[test]
fn a_full_buffer_gives_up_its_newest_record_or_as_a_ring_its_oldest() {
    for (organisation, left) in [(0, [10, 20, 50]), (1, [30, 40, 50])] {
        let mut bench = with_buffer(3);
        bench.set_sub(0x60C4, 3, organisation);
        for position in [10, 20, 30, 40, 50] {
            record(&mut bench, position);
        }
        assert_eq!(bench.get_sub(0x60C4, 4), 3);
        bench.control(RUN);
        let reached = left.map(|_| {
            bench.run(4);
            bench.get(0x6062)
        });
        assert_eq!(reached, left);
    }
}

#[test]
fn the_buffer_is_emptied_and_locked() {
    let mut bench = with_buffer(4);
    record(&mut bench, 100);
    bench.set_sub(0x60C4, 6, 0);
    assert_eq!(bench.get_sub(0x60C4, 4), 0);
    record(&mut bench, 200);
    bench.control(RUN);
    bench.run(50);
    assert_eq!(bench.get(0x6062), 0);
    bench.set_sub(0x60C4, 6, 1);
    bench.run(50);
    assert_eq!(bench.get(0x6062), 0, "what came while it was locked is gone");
    record(&mut bench, 300);
    bench.run(50);
    assert_eq!(bench.get(0x6062), 300);
}

#[test]
fn without_bit_4_or_halted_the_axis_ramps_down_and_forgets_its_records() {
    for word in [HOLD, RUN | HALT] {
        let mut bench = with_buffer(16);
        for n in 1..=16 {
            record(&mut bench, n * 80);
        }
        bench.control(RUN);
        bench.run(30);
        bench.control(word);
        assert!(!bench.is_set(ACTIVE));
        bench.run(300);
        assert_eq!(bench.get(0x606B), 0);
        let place = bench.get(0x6062);
        bench.control(RUN);
        bench.run(100);
        assert!(bench.is_set(ACTIVE));
        assert_eq!(bench.get(0x6062), place);
        record(&mut bench, 0);
        bench.run(300);
        assert_eq!(bench.get(0x6062), 0);
    }
}

#[test]
fn a_record_beyond_a_limit_ends_at_the_limit() {
    let mut bench = with_buffer(2);
    bench.batch(&[(0x607D, 1, -500), (0x607D, 2, 700)]).unwrap();
    bench.control(RUN);
    record(&mut bench, 5_000);
    bench.run(300);
    assert_eq!(bench.get(0x6062), 700);
    assert!(bench.is_set(11));
}

#[test]
fn what_the_drive_does_not_have_is_refused() {
    let mut bench = with_buffer(1);
    for (index, sub, value) in [(0x60C0, 0, 1), (0x60C4, 2, 17), (0x60C4, 3, 2), (0x60C4, 5, 8)] {
        assert_eq!(bench.batch(&[(index, sub, value)]), Err(AbortCode::ValueTooHigh), "{index:X}:{sub}");
    }
}
