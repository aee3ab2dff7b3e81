//! Velocity mode (vl): target, amounts, factors, ramps, and the bits that lead the ramp.

mod bench;

use bench::Bench;
use profiles::State;

/// 1 rpm of the generic motor, which has 4096 counts a revolution, in counts/s.
const RPM: f64 = 4096.0 / 60.0;
const HALT: i64 = 1 << 8;
/// Enabled, unlocked, with the reference.
const RUN: i64 = 0x7F;

fn enabled(target: i64) -> Bench {
    let mut bench = Bench::new("cia402-servo");
    bench.batch(&[(0x6042, 0, target), (0x6048, 1, 1_000), (0x6049, 1, 2_000)]).unwrap();
    bench.enable(2);
    bench
}

/// The demand velocity in rpm.
fn rpm(bench: &Bench) -> f64 {
    bench.get(0x606B) as f64 / RPM
}

fn settled(bench: &mut Bench) -> f64 {
    bench.run_until(|b| b.is_set(10));
    rpm(bench)
}

#[track_caller]
fn assert_near(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1.0, "{value} instead of {expected}");
}

#[test]
fn the_target_is_in_revolutions_per_minute() {
    for target in [600, -600] {
        let mut bench = enabled(target);
        bench.control(RUN);
        assert!(!bench.is_set(10));
        assert_near(settled(&mut bench), target as f64);
        assert_eq!(bench.get(0x6043), target);
        assert!((bench.get(0x6044) - target).abs() <= 2, "{}", bench.get(0x6044));
    }
}

#[test]
fn the_ramps_are_a_change_of_speed_in_a_time() {
    let mut bench = enabled(1_000);
    bench.control(RUN);
    bench.run(500);
    assert_near(rpm(&bench), 500.0);
    bench.run(600);
    assert_near(rpm(&bench), 1_000.0);
    bench.batch(&[(0x6042, 0, 0), (0x6049, 2, 4)]).unwrap();
    bench.run(1_000);
    assert_near(rpm(&bench), 500.0);
}

#[test]
fn without_the_bits_the_ramp_stands_still() {
    let mut bench = enabled(600);
    for word in [0x0F, 0x1F, 0x2F, 0x3F, 0x4F, 0x5F, 0x6F] {
        bench.control(word);
        bench.run(100);
        assert_near(rpm(&bench), 0.0);
    }
}

#[test]
fn a_locked_ramp_keeps_its_output_and_an_unlocked_one_goes_on() {
    let mut bench = enabled(1_000);
    bench.control(RUN);
    bench.run(300);
    bench.control(0x5F);
    bench.run(500);
    assert_near(rpm(&bench), 300.0);
    bench.set(0x6042, 0);
    bench.run(100);
    assert_near(rpm(&bench), 300.0);
    assert!(!bench.is_set(10));
    bench.set(0x6042, 400);
    bench.control(RUN);
    assert_near(settled(&mut bench), 400.0);
}

#[test]
fn without_the_reference_or_the_ramp_it_runs_down() {
    for word in [0x3F, 0x6F] {
        let mut bench = enabled(1_000);
        bench.control(RUN);
        settled(&mut bench);
        bench.control(word);
        bench.run(250);
        assert_near(rpm(&bench), 500.0);
        assert_near(settled(&mut bench), 0.0);
    }
}

#[test]
fn halt_stops_and_its_end_runs_on() {
    let mut bench = enabled(1_000);
    bench.control(RUN);
    settled(&mut bench);
    bench.control(RUN | HALT);
    bench.run(250);
    assert_near(rpm(&bench), 500.0);
    bench.run_until(|b| b.is_set(10));
    bench.set(0x6042, 500);
    bench.run(100);
    assert_near(rpm(&bench), 0.0);
    bench.control(RUN);
    bench.run(1);
    assert_near(settled(&mut bench), 500.0);
}

#[test]
fn amounts_bound_the_target_on_either_side() {
    for (target, expected) in
        [(50, 100.0), (-50, -100.0), (400, 300.0), (-400, -300.0), (200, 200.0), (0, 0.0)]
    {
        let mut bench = enabled(target);
        bench.batch(&[(0x6046, 1, 100), (0x6046, 2, 300)]).unwrap();
        bench.control(RUN);
        bench.run(1);
        assert_near(settled(&mut bench), expected);
    }
}

#[test]
fn factors_scale_the_target_and_what_is_shown() {
    let mut bench = enabled(300);
    bench.batch(&[(0x604B, 1, 2), (0x604B, 2, 3), (0x604C, 1, 5), (0x604C, 2, 2)]).unwrap();
    bench.control(RUN);
    bench.run(1);
    assert_near(settled(&mut bench), 500.0);
    assert_eq!(bench.get(0x6043), 300);
    bench.batch(&[(0x604B, 1, -2), (0x604C, 2, 0)]).unwrap();
    bench.set(0x6042, 150);
    assert_near(settled(&mut bench), -500.0);
    assert_eq!(bench.get(0x6043), 150);
}

#[test]
fn the_quick_stop_ramp_is_that_of_the_mode() {
    let mut bench = enabled(1_000);
    bench.batch(&[(0x604A, 1, 4_000), (0x605A, 0, 6), (0x6085, 0, 1)]).unwrap();
    bench.control(RUN);
    settled(&mut bench);
    bench.control(0x02);
    bench.run(125);
    assert_near(rpm(&bench), 500.0);
    assert_eq!(bench.state(), State::QuickStopActive);
    bench.run(200);
    assert_near(rpm(&bench), 0.0);
}
