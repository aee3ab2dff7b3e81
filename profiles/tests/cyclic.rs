//! The cyclic synchronous modes: set-points of a master with a clock of its own.

mod bench;

use std::time::Duration;

use bench::Bench;
use od::{AbortCode, Instant};
use proptest::prelude::*;

const CSP: i64 = 8;
const CSV: i64 = 9;
const CST: i64 = 10;
const HALT: i64 = 1 << 8;
const FOLLOWS: u32 = 12;
const MILLISECOND: u64 = 1_000_000;

/// A drive that is enabled in `mode`, away from any limit.
fn enabled(mode: i64) -> Bench {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.enable(mode);
    assert_eq!(bench.get(0x6061), mode);
    assert_eq!(bench.is_set(FOLLOWS), mode >= CSP, "it follows though nothing has come yet");
    bench
}

/// Lets time pass until `end`, calling the device exactly when it asks to be.
fn pass_until(bench: &mut Bench, end: Instant) {
    while let Some(due) = bench.device.poll_timeout().filter(|due| *due <= end) {
        bench.now = due;
        bench.device.advance(due);
    }
    bench.now = end;
}

/// A master's cycle that begins at the present time: `set_points` are written at its beginning, each cycle.
fn stream(bench: &mut Bench, object: u16, cycle: u64, set_points: impl IntoIterator<Item = i64>) {
    for value in set_points {
        bench.set(object, value);
        let end = bench.now + Duration::from_nanos(cycle);
        pass_until(bench, end);
    }
}

/// Numbers below one from a seed, as any master's clock might make them.
fn noise(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64
}

/// 0.5 Hz with 20000 counts: up to 62832 counts/s and 197392 counts/s².
fn sine(cycle: u64) -> i64 {
    let angle = cycle as f64 / 1000.0 * std::f64::consts::PI;
    (20_000.0 * angle.sin()).round() as i64
}

#[test]
fn for_a_minute_every_set_point_of_a_jittering_master_gets_its_step() {
    let mut bench = enabled(CSP);
    let (mut seed, start) = (402_u64, bench.now.as_nanos());
    let mut worst = 0;
    for cycle in 0..60_000_u64 {
        // Up to 300 us early or late.
        let jitter = (noise(&mut seed) * 600_000.0) as u64;
        pass_until(&mut bench, Instant::from_nanos(start + (cycle + 1) * MILLISECOND + jitter - 300_000));
        // The first hundred cycles are for the raster to find its place.
        if cycle > 100 {
            assert_eq!(
                bench.get(0x6062),
                sine(cycle - 1),
                "cycle {cycle}: the set-point before it is reached"
            );
            worst = worst.max(bench.get(0x60F4).abs());
        }
        bench.set(0x607A, sine(cycle));
        assert!(bench.is_set(FOLLOWS), "cycle {cycle}");
    }
    // A corner of the polygon that the set-points make changes the velocity by 197 counts/s and, since they are whole
    // counts, by another 1000 counts/s at most. At a position gain of 200/s that is an error of 6 counts.
    assert!(worst <= 6, "{worst}");
    assert_eq!(bench.device.dropped_steps(), 0);
}

#[test]
fn a_mode_begins_without_a_jump_and_the_axis_holds_until_a_set_point_comes() {
    let mut bench = enabled(1);
    bench.move_to(5_000, 0);
    bench.run_until(|b| b.is_set(10));
    bench.set(0x607A, -9_000);
    bench.set(0x6060, CSP);
    bench.run_until(|b| b.get(0x6061) == CSP);
    bench.run(200);
    assert_eq!(bench.get(0x6062), 5_000, "the target was written for another mode");
    bench.set(0x607A, -9_000);
    bench.run(500);
    assert_eq!(bench.get(0x6062), -9_000, "and now for this one");
    assert!(bench.is_set(FOLLOWS) && !bench.is_set(10));
}

#[test]
fn a_set_point_is_reached_on_a_straight_line_within_the_interpolation_time() {
    for (value, index, cycle) in [(8, -3, 8), (80, -4, 8), (4, -3, 4), (1, -9, 1)] {
        let mut bench = enabled(CSP);
        bench.batch(&[(0x60C2, 1, value), (0x60C2, 2, index)]).unwrap();
        let way = 8 * cycle as i64;
        stream(&mut bench, 0x607A, cycle * MILLISECOND, (1..=20).map(|n| n * way));
        assert_eq!((bench.get(0x6062), bench.get(0x606B)), (20 * way, 8_000), "{cycle} ms");
    }
}

#[test]
fn a_motion_stays_even_when_set_points_come_whole_steps_early_or_late() {
    let mut bench = enabled(CSP);
    bench.set_sub(0x60C2, 1, 10);
    let mut seed = 7;
    let start = bench.now.as_nanos();
    for cycle in 1..500_u64 {
        let jitter = (noise(&mut seed) * 5e6) as u64;
        pass_until(&mut bench, Instant::from_nanos(start + cycle * 10 * MILLISECOND + jitter));
        bench.set(0x607A, cycle as i64 * 100);
        if cycle > 10 {
            let velocity = bench.get(0x606B);
            assert!((9_000..=11_500).contains(&velocity), "cycle {cycle}: {velocity} counts/s");
            assert!(bench.is_set(FOLLOWS));
        }
    }
}

#[test]
fn an_interpolation_time_that_makes_no_sense_is_refused() {
    let mut bench = enabled(CSP);
    for (sub, value, code) in
        [(1, 0, AbortCode::ValueTooLow), (2, 1, AbortCode::ValueTooHigh), (2, -10, AbortCode::ValueTooLow)]
    {
        assert_eq!(bench.batch(&[(0x60C2, sub, value)]), Err(code), "{sub} {value}");
    }
}

/// Runs at 20000 counts/s in this mode until the stream breaks off.
fn broken_off(mode: i64) -> Bench {
    let mut bench = enabled(mode);
    match mode {
        CSP => stream(&mut bench, 0x607A, MILLISECOND, (1..=200).map(|n| n * 20)),
        _ => stream(&mut bench, 0x60FF, MILLISECOND, [20_000; 200]),
    }
    assert!(bench.is_set(FOLLOWS));
    bench
}

#[test]
fn one_set_point_may_be_missing() {
    let mut bench = broken_off(CSP);
    // The one for 201 is lost; at its time the axis is where it would have led.
    bench.run(1);
    assert_eq!(bench.get(0x6062), 4_020);
    stream(&mut bench, 0x607A, MILLISECOND, (202..=210).map(|n| n * 20));
    assert_eq!((bench.get(0x6062), bench.get(0x606B)), (4_200, 20_000));
}

#[test]
fn when_set_points_fail_to_come_the_axis_brakes_and_says_that_it_does_not_follow() {
    for mode in [CSP, CSV] {
        let mut bench = broken_off(mode);
        let start = bench.get(0x6062);
        bench.run(2);
        assert!(!bench.is_set(FOLLOWS));
        bench.run(150);
        // 20000 counts/s at 200000 counts/s²: 1000 counts, and those of at most three steps before.
        let way = bench.get(0x6062) - start;
        assert!((1_000..=1_060).contains(&way), "{way}");
        assert_eq!(bench.get(0x606B), 0);
        assert!(!bench.is_set(FOLLOWS));
        let place = bench.get(0x6062);
        match mode {
            CSP => stream(&mut bench, 0x607A, MILLISECOND, (1..=9).map(|n| place + 20 * n)),
            _ => stream(&mut bench, 0x60FF, MILLISECOND, [20_000; 9]),
        }
        assert_eq!(bench.get(0x606B), 20_000, "it follows again");
        assert!(bench.is_set(FOLLOWS));
    }
}

#[test]
fn what_is_written_now_and_then_is_no_stream_and_stays() {
    let mut bench = enabled(CSP);
    for target in [3_000, -2_000, 500] {
        bench.set(0x607A, target);
        bench.run(400);
        assert_eq!(bench.get(0x6062), target, "not past it");
        assert!(bench.is_set(FOLLOWS));
    }
    let mut bench = enabled(CSV);
    bench.set(0x60FF, 10_000);
    bench.run(2_000);
    assert_eq!(bench.get(0x606B), 10_000);
    assert!(bench.is_set(FOLLOWS));
}

#[test]
fn offsets_add_to_the_targets_of_the_cyclic_modes_only() {
    let mut bench = enabled(CSP);
    bench.batch(&[(0x607A, 0, 1_000), (0x60B0, 0, 250)]).unwrap();
    bench.run(300);
    assert_eq!(bench.get(0x6062), 1_250);

    let mut bench = enabled(CSV);
    bench.batch(&[(0x60FF, 0, 5_000), (0x60B1, 0, -2_000)]).unwrap();
    bench.run(300);
    assert_eq!(bench.get(0x606B), 3_000);

    let mut bench = enabled(CST);
    bench.batch(&[(0x6071, 0, 200), (0x60B2, 0, -50)]).unwrap();
    bench.run(3);
    assert_eq!((bench.get(0x6074), bench.get(0x6077)), (150, 150));

    let mut bench = enabled(1);
    bench.batch(&[(0x60B0, 0, 250), (0x60B1, 0, 999), (0x60B2, 0, 500)]).unwrap();
    bench.move_to(1_000, 0);
    bench.run_until(|b| b.is_set(10));
    assert_eq!(bench.get(0x6062), 1_000);
    bench.set(0x6060, 3);
    bench.set(0x60FF, 4_000);
    bench.run(500);
    assert_eq!(bench.get(0x606B), 4_000);
}

#[test]
fn a_torque_offset_is_fed_forward_and_the_place_stays_that_of_the_target() {
    let mut bench = enabled(CSP);
    bench.batch(&[(0x607A, 0, 0), (0x60B2, 0, 900)]).unwrap();
    bench.run(1);
    assert!(bench.get(0x6077) > 200, "not only what a position error brings about: {}", bench.get(0x6077));
    bench.run(500);
    assert!(bench.position().abs() <= 1, "{}", bench.position());
    bench.batch(&[(0x607A, 0, 0), (0x60B2, 0, 0)]).unwrap();
    bench.run(1);
    assert!(bench.get(0x6077) < -200, "{}", bench.get(0x6077));
}

#[test]
fn a_halted_drive_does_not_follow_and_waits_for_a_set_point_afterwards() {
    for mode in [CSP, CSV] {
        let mut bench = broken_off(mode);
        bench.control(0x0F | HALT);
        assert!(!bench.is_set(FOLLOWS));
        let object = if mode == CSP { 0x607A } else { 0x60FF };
        stream(&mut bench, object, MILLISECOND, [30_000; 500]);
        assert!(bench.is_set(10) && bench.get(0x606B) == 0, "halted whatever comes");
        let place = bench.get(0x6062);
        bench.control(0x0F);
        bench.run(50);
        assert!(bench.is_set(FOLLOWS));
        assert_eq!(bench.get(0x6062), place);
        bench.set(object, if mode == CSP { place + 10 } else { 100 });
        bench.run(100);
        assert_eq!(bench.get(0x6062), place + 10);
    }
}

#[test]
fn the_axis_ramps_down_before_another_mode_begins_though_set_points_still_come() {
    for mode in [CSP, CSV] {
        let mut bench = broken_off(mode);
        bench.set(0x6060, 1);
        match mode {
            CSP => stream(&mut bench, 0x607A, MILLISECOND, (201..=500).map(|n| n * 20)),
            _ => stream(&mut bench, 0x60FF, MILLISECOND, [20_000; 300]),
        }
        assert_eq!((bench.get(0x6061), bench.get(0x606B)), (1, 0));
    }
    let mut bench = broken_off(CSV);
    bench.set(0x6060, 1);
    bench.set(0x6060, CSV);
    stream(&mut bench, 0x60FF, MILLISECOND, [15_000; 300]);
    assert_eq!((bench.get(0x6061), bench.get(0x606B)), (CSV, 15_000), "taken back on the way");
}

#[test]
fn a_drive_that_is_being_disabled_ramps_down_though_set_points_still_come() {
    let mut bench = broken_off(CSV);
    bench.control(0x07);
    stream(&mut bench, 0x60FF, MILLISECOND, [20_000; 400]);
    assert_eq!(bench.state(), profiles::State::SwitchedOn);
}

#[test]
fn a_following_error_shows_in_bit_13() {
    let mut bench = enabled(CSP);
    // The drive may give no torque at all, and no following error is a fault.
    bench.batch(&[(0x6072, 0, 0), (0x6065, 0, 100_000)]).unwrap();
    stream(&mut bench, 0x607A, MILLISECOND, (1..=100).map(|n| n * 20));
    assert!(!bench.is_set(13));
    bench.set(0x6065, 1_000);
    assert!(bench.is_set(13));
}

#[test]
fn a_torque_does_not_drive_above_the_highest_speed() {
    let mut bench = enabled(CST);
    bench.set(0x6080, 300);
    stream(&mut bench, 0x6071, MILLISECOND, [500; 500]);
    let highest = 300 * 4096 / 60;
    assert!((highest - 100..=highest + 10).contains(&bench.velocity()), "{}", bench.velocity());
    bench.run(400);
    assert!(!bench.is_set(FOLLOWS));
    assert_eq!(bench.get(0x606B), 0, "braked when nothing more came");
}

const MIN: i64 = -3_000;
const MAX: i64 = 5_000;
const FASTEST: i64 = 50_000;
const HARDEST: i64 = 2_000_000;

fn limited(mode: i64) -> Bench {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.batch(&[(0x607D, 1, MIN), (0x607D, 2, MAX), (0x607F, 0, FASTEST)]).unwrap();
    bench.batch(&[(0x60C5, 0, HARDEST), (0x60C6, 0, HARDEST), (0x6065, 0, 0xFFFF_FFFF)]).unwrap();
    bench.enable(mode);
    bench
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn no_stream_passes_a_limit_and_the_axis_rests_when_it_ends(
        is_position: bool,
        set_points in prop::collection::vec(
            prop_oneof![any::<i32>(), -8_000..8_000_i32, -100..100_i32], 2..200),
        times in prop::collection::vec(prop_oneof![3 => Just(1_000_u64), 1 => 0_u64..8_000], 1..50),
        time in 1_i64..6,
    ) {
        let mut bench = limited(if is_position { CSP } else { CSV });
        bench.set_sub(0x60C2, 1, time);
        let object = if is_position { 0x607A } else { 0x60FF };
        let mut before = 0;
        for (value, wait) in set_points.iter().zip(times.iter().cycle()) {
            bench.set(object, i64::from(*value));
            let end = bench.now + Duration::from_micros(*wait);
            while let Some(due) = bench.device.poll_timeout().filter(|due| *due <= end) {
                pass_until(&mut bench, due);
                let (place, velocity) = (bench.get(0x6062), bench.get(0x606B));
                prop_assert!((MIN..=MAX).contains(&place), "place {}", place);
                prop_assert!(velocity.abs() <= FASTEST, "velocity {}", velocity);
                // A raster step changes the velocity by 2000 counts/s at most; both are shown rounded.
                prop_assert!((velocity - before).abs() <= HARDEST / 1_000 + 1, "{} after {}", velocity, before);
                before = velocity;
            }
            bench.now = end;
        }
        bench.run(2_000);
        prop_assert!(bench.get(0x606B) == 0 || !is_position && bench.is_set(FOLLOWS), "at rest");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 16, ..ProptestConfig::default() })]

    #[test]
    fn no_stream_of_torques_passes_a_limit_by_more_than_the_raster(
        torques in prop::collection::vec((-600..600_i64, 1..150_usize), 1..20),
    ) {
        let mut bench = limited(CST);
        for (torque, count) in torques {
            for _ in 0..count {
                stream(&mut bench, 0x6071, MILLISECOND, [torque]);
                // 50 counts in a raster step at the highest speed.
                prop_assert!((MIN - 200..=MAX + 200).contains(&bench.position()), "{}", bench.position());
                prop_assert!(bench.velocity().abs() <= FASTEST + 50, "{}", bench.velocity());
            }
        }
        bench.run(1_000);
        prop_assert!(bench.velocity().abs() <= 20 || bench.is_set(FOLLOWS), "at rest");
    }
}
