//! Profile velocity mode, quick stop with its option codes, and changes of the mode.

mod bench;

use bench::Bench;
use od::AbortCode;
use profiles::State;

const HALT: i64 = 1 << 8;

fn running(profile: &str, velocity: i64) -> Bench {
    let mut bench = Bench::new(profile);
    bench.fast_profile();
    bench.set(0x60FF, velocity);
    bench.enable(3);
    bench.run_until(|b| b.is_set(10));
    bench
}

#[test]
fn the_axis_runs_at_its_target_velocity_and_says_so() {
    for profile in ["jvl-mac00-fc4", "cia402-servo"] {
        for velocity in [15_000, -15_000] {
            let mut bench = running(profile, velocity);
            assert!((bench.velocity() - velocity).abs() <= 100, "{profile}: {}", bench.velocity());
            assert!(!bench.is_set(12), "not standing");
            bench.set(0x60FF, 0);
            bench.run_until(|b| b.is_set(10));
            assert!(bench.is_set(12), "speed is zero");
        }
    }
}

#[test]
fn a_new_target_acts_at_once() {
    let mut bench = running("cia402-servo", 10_000);
    bench.set(0x60FF, -5_000);
    assert!(!bench.is_set(10));
    bench.run_until(|b| b.is_set(10));
    assert!((bench.velocity() + 5_000).abs() <= 100);
}

#[test]
fn halt_stops_and_its_end_runs_on() {
    let mut bench = running("jvl-mac00-fc4", 10_000);
    bench.control(0x0F | HALT);
    bench.run_until(|b| b.is_set(10));
    assert!(bench.velocity().abs() <= 100);
    bench.set(0x60FF, 8_000);
    bench.run(100);
    assert!(bench.velocity().abs() <= 100, "halted whatever the target");
    bench.control(0x0F);
    bench.run_until(|b| b.is_set(10));
    assert!((bench.velocity() - 8_000).abs() <= 100);
}

#[test]
fn a_quick_stop_leaves_or_stays_by_its_option_code() {
    for (option, stays) in
        [(1, false), (2, false), (3, false), (4, false), (5, true), (6, true), (7, true), (8, true)]
    {
        let mut bench = running("cia402-servo", 15_000);
        bench.set(0x605A, option);
        bench.control(0x02);
        assert_eq!(bench.state(), State::QuickStopActive);
        bench.run(1_000);
        let expected = if stays { State::QuickStopActive } else { State::SwitchOnDisabled };
        assert_eq!(bench.state(), expected, "option {option}");
        assert!(bench.velocity().abs() <= 100);
        if stays {
            bench.control(0x0F);
            assert_eq!(bench.state(), State::OperationEnabled, "transition 16");
            bench.run_until(|b| b.is_set(10));
            assert!((bench.velocity() - 15_000).abs() <= 100);
        }
    }
}

#[test]
fn a_quick_stop_with_option_zero_switches_off_at_once() {
    let mut bench = running("cia402-servo", 15_000);
    bench.set(0x605A, 0);
    bench.control(0x02);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    bench.run(5);
    assert!(bench.velocity() > 10_000, "coasting");
}

#[test]
fn the_quick_stop_ramp_is_its_own() {
    let mut bench = running("cia402-servo", 15_000);
    bench.set(0x6085, 300_000);
    bench.control(0x02);
    bench.run_until(|b| b.state() == State::SwitchOnDisabled);
    let mut slow = running("cia402-servo", 15_000);
    slow.batch(&[(0x6085, 0, 300_000), (0x605A, 0, 1)]).unwrap();
    let start = slow.now;
    slow.control(0x02);
    slow.run(60);
    assert_eq!(slow.state(), State::QuickStopActive, "100000 counts/s² take 150 ms");
    slow.run_until(|b| b.state() == State::SwitchOnDisabled);
    assert!((145..160).contains(&slow.now.saturating_since(start).as_millis()));
}

#[test]
fn a_jvl_drive_changes_its_mode_only_while_disabled() {
    let mut bench = running("jvl-mac00-fc4", 10_000);
    bench.set(0x6060, 1);
    bench.run(100);
    assert_eq!(bench.get(0x6061), 3);
    bench.control(0x07);
    bench.run_until(|b| b.state() == State::SwitchedOn);
    assert_eq!(bench.get(0x6061), 1);
}

#[test]
fn a_neutral_drive_ramps_down_before_it_changes_its_mode() {
    let mut bench = running("cia402-servo", 10_000);
    bench.set(0x6060, 1);
    assert_eq!(bench.get(0x6061), 3);
    bench.run_until(|b| b.get(0x6061) == 1);
    assert!(bench.velocity().abs() <= 100);
    bench.move_to(0, 0);
    bench.run_until(|b| b.is_set(10));
    assert!(bench.position().abs() <= 1);
}

#[test]
fn a_mode_that_the_drive_does_not_have_is_refused() {
    let mut bench = Bench::new("cia402-servo");
    assert_eq!(bench.batch(&[(0x6060, 0, 5)]), Err(AbortCode::InvalidValue));
    assert_eq!(bench.batch(&[(0x6060, 0, -1)]), Err(AbortCode::InvalidValue));
    assert_eq!(bench.get(0x6060), 0);
}
