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
    for (profile, modes) in [("cia402-servo", [5, 11, -1]), ("jvl-mac00-fc4", [2, 4, 8])] {
        let mut bench = Bench::new(profile);
        for mode in modes {
            assert_eq!(bench.batch(&[(0x6060, 0, mode)]), Err(AbortCode::InvalidValue), "{profile} {mode}");
        }
        assert_eq!(bench.get(0x6060), 0);
    }
}

#[test]
fn the_speed_counts_as_zero_until_it_is_above_the_threshold_for_the_threshold_time() {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.batch(&[(0x606F, 0, 2_000), (0x6070, 0, 50), (0x60FF, 0, 10_000)]).unwrap();
    bench.enable(3);
    let start = bench.now;
    bench.run_until(|b| b.velocity() > 2_000);
    assert!(bench.is_set(12));
    let above = bench.now;
    bench.run_until(|b| !b.is_set(12));
    assert!((48..=51).contains(&bench.now.saturating_since(above).as_millis()));
    assert!(bench.now > start);
    bench.set(0x60FF, 0);
    bench.run_until(|b| b.is_set(12));
    assert!((1_500..=2_000).contains(&bench.velocity()), "at once below: {}", bench.velocity());
}

#[test]
fn a_slippage_above_its_maximum_is_told_and_stops_nothing() {
    let mut bench = running("cia402-servo", 15_000);
    assert!(!bench.is_set(13));
    bench.batch(&[(0x6072, 0, 0), (0x6065, 0, 0xFFFF_FFFF), (0x60F8, 0, 500)]).unwrap();
    bench.set(0x60FF, 0);
    bench.run(50);
    assert!(bench.is_set(13), "without torque it does not follow the ramp");
    assert_eq!(bench.state(), State::OperationEnabled);
    bench.set(0x6072, 3_000);
    bench.run_until(|b| b.is_set(10));
    assert!(!bench.is_set(13));
}

#[test]
fn a_jerk_limited_profile_rounds_its_corners() {
    let steepest_change = |shape| {
        let mut bench = Bench::new("cia402-servo");
        bench.fast_profile();
        bench
            .batch(&[(0x6086, 0, shape), (0x60A3, 0, 2), (0x60A4, 1, 5_000_000), (0x60A4, 2, 2_000_000)])
            .unwrap();
        bench.set(0x60FF, 15_000);
        bench.enable(3);
        let mut velocities = vec![0, 0];
        for _ in 0..400 {
            bench.run(1);
            velocities.push(bench.get(0x606B));
        }
        assert_eq!(velocities.last(), Some(&15_000));
        velocities.windows(3).map(|v| (v[2] - 2 * v[1] + v[0]).abs()).max().unwrap()
    };
    assert_eq!(steepest_change(0), 100, "the acceleration is there at once");
    assert!(
        (2..=4).contains(&steepest_change(3)),
        "2 000 000 counts/s^3 are 2 counts/s in a ms: the smaller one"
    );
}

#[test]
fn a_mode_change_on_the_move_says_nothing_for_the_old_mode() {
    let mut bench = running("cia402-servo", 10_000);
    bench.set(0x6060, 1);
    assert_eq!((bench.get(0x6061), bench.is_set(10)), (3, false));
    bench.set(0x60FF, 15_000);
    bench.run(50);
    assert!(bench.get(0x606B) < 6_000, "the old mode leads no more");
    bench.run_until(|b| b.get(0x6061) == 1);
    assert_eq!(bench.get(0x606B), 0);
}

#[test]
fn a_drive_that_is_being_disabled_is_not_at_its_target() {
    let mut bench = running("cia402-servo", 10_000);
    bench.control(0x07);
    bench.run(50);
    assert_eq!((bench.state(), bench.is_set(10)), (State::OperationEnabled, false));
}

#[test]
fn a_mode_change_that_is_taken_back_on_the_move_goes_on() {
    let mut bench = running("cia402-servo", 10_000);
    bench.set(0x6060, 1);
    bench.run(50);
    bench.set(0x6060, 3);
    bench.run_until(|b| b.is_set(10));
    assert_eq!((bench.get(0x6061), bench.get(0x606B)), (3, 10_000));
}

#[test]
fn the_end_of_a_halt_does_not_revive_a_mode_that_is_being_left() {
    let mut bench = running("cia402-servo", 10_000);
    bench.control(0x0F | HALT);
    bench.run(20);
    bench.set(0x6060, 1);
    bench.control(0x0F);
    bench.run_until(|b| b.get(0x6061) == 1);
    assert_eq!(bench.get(0x606B), 0);
}

#[test]
fn a_neutral_drive_takes_every_mode_in_every_state() {
    let mut bench = Bench::new("cia402-servo");
    for word in [0x00, 0x06, 0x07, 0x0F, 0x02] {
        bench.control(word);
        bench.run(100);
        for mode in [1, 2, 3, 4, 6, 7, 8, 9, 10, 0] {
            bench.set(0x6060, mode);
            bench.run(100);
            assert_eq!(bench.get(0x6061), mode, "in {:?}", bench.state());
        }
    }
}
