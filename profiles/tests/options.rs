//! The option codes 0x605A-0x605E and 0x6007 with all their values (IEC 61800-7-201).

mod bench;

use bench::Bench;
use od::AbortCode;
use profiles::State;

const SPEED: i64 = 20_000;

/// Ramps in counts/s²; the last one is that of the axis.
const SLOW_DOWN: i64 = 50_000;
const QUICK_STOP: i64 = 200_000;
const AXIS: i64 = 1_000_000;

/// An axis that runs at 20,000 counts/s in profile velocity mode.
fn running() -> Bench {
    let mut bench = Bench::new("cia402-servo");
    bench
        .batch(&[
            (0x6083, 0, 400_000),
            (0x6084, 0, SLOW_DOWN),
            (0x6085, 0, QUICK_STOP),
            (0x60C5, 0, AXIS),
            (0x60C6, 0, AXIS),
        ])
        .unwrap();
    bench.enable(3);
    bench.set(0x60FF, SPEED);
    bench.run_until(|b| b.is_set(10));
    bench
}

/// How hard the demand brakes over the next ten milliseconds, in counts/s².
fn braking(bench: &mut Bench) -> i64 {
    bench.run(2);
    let before = bench.get(0x606B);
    bench.run(10);
    (before - bench.get(0x606B)) * 100
}

fn assert_ramp(bench: &mut Bench, expected: i64, case: &str) {
    let rate = braking(bench);
    assert!((rate - expected).abs() <= expected / 50, "{case}: {rate} instead of {expected}");
}

/// No power: only friction brakes.
fn assert_coasting(bench: &mut Bench, case: &str) {
    bench.run(5);
    assert_eq!(bench.get(0x6077), 0, "{case}");
    assert!(bench.velocity() > SPEED * 9 / 10, "{case}");
}

#[test]
fn a_quick_stop_brakes_and_ends_as_its_option_says() {
    let ramps = [SLOW_DOWN, QUICK_STOP, AXIS, AXIS];
    for option in 1..=8 {
        let case = format!("0x605A is {option}");
        let mut bench = running();
        bench.set(0x605A, option);
        bench.control(0x02);
        assert_eq!(bench.state(), State::QuickStopActive, "{case}");
        assert_ramp(&mut bench, ramps[(option as usize - 1) % 4], &case);
        bench.run(1_000);
        let end = if option <= 4 { State::SwitchOnDisabled } else { State::QuickStopActive };
        assert_eq!((bench.state(), bench.velocity()), (end, 0), "{case}");
        bench.control(0x0F);
        bench.run(100);
        let end = if option <= 4 { State::SwitchOnDisabled } else { State::OperationEnabled };
        assert_eq!(bench.state(), end, "{case}");
    }
}

#[test]
fn a_quick_stop_of_option_0_switches_off_at_once() {
    let mut bench = running();
    bench.set(0x605A, 0);
    bench.control(0x02);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    assert_coasting(&mut bench, "0x605A is 0");
}

#[test]
fn an_option_that_is_changed_while_the_drive_stands_still_decides_whether_it_stays() {
    let mut bench = running();
    bench.set(0x605A, 6);
    bench.control(0x02);
    bench.run(1_000);
    assert_eq!(bench.state(), State::QuickStopActive);
    bench.set(0x605A, 2);
    bench.run(2);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
}

#[test]
fn shutdown_and_disable_operation_coast_or_ramp_down() {
    for (index, word, end) in [(0x605B, 0x06, State::ReadyToSwitchOn), (0x605C, 0x07, State::SwitchedOn)] {
        let mut bench = running();
        bench.set(index, 0);
        bench.control(word);
        assert_eq!(bench.state(), end, "{index:04X}");
        assert_coasting(&mut bench, "off");

        let mut bench = running();
        bench.set(index, 1);
        bench.control(word);
        assert_eq!(bench.state(), State::OperationEnabled, "{index:04X}: it ramps down first");
        assert_ramp(&mut bench, SLOW_DOWN, "on the way");
        for _ in 0..500 {
            bench.control(word);
            bench.run(1);
        }
        assert_eq!((bench.state(), bench.velocity()), (end, 0), "{index:04X}, repeated all the time");
    }
}

#[test]
fn a_shutdown_is_taken_back_while_it_ramps_down() {
    let mut bench = running();
    bench.set(0x605B, 1);
    bench.control(0x06);
    bench.run(100);
    bench.control(0x0F);
    bench.run_until(|b| b.is_set(10));
    assert_eq!(bench.state(), State::OperationEnabled);
    assert!((bench.velocity() - SPEED).abs() < 500);
}

#[test]
fn a_quick_stop_overrides_a_shutdown_that_ramps_down() {
    let mut bench = running();
    bench.set(0x605B, 1);
    bench.control(0x06);
    bench.run(50);
    bench.control(0x02);
    assert_eq!(bench.state(), State::QuickStopActive);
    assert_ramp(&mut bench, QUICK_STOP, "quick stop");
}

#[test]
fn halt_brakes_as_its_option_says_and_stays_enabled() {
    for (option, ramp) in [(1, SLOW_DOWN), (2, QUICK_STOP), (3, AXIS), (4, AXIS)] {
        let case = format!("0x605D is {option}");
        let mut bench = running();
        bench.set(0x605D, option);
        bench.control(0x10F);
        assert_ramp(&mut bench, ramp, &case);
        bench.run(1_000);
        assert_eq!((bench.state(), bench.velocity()), (State::OperationEnabled, 0), "{case}");
        assert!(bench.is_set(10), "{case}: halted and standing");
        bench.control(0x0F);
        bench.run_until(|b| (b.velocity() - SPEED).abs() < 500);
    }
}

#[test]
fn a_fault_brakes_as_its_option_says_and_the_reaction_lasts_as_long() {
    for (option, ramp) in [(1, SLOW_DOWN), (2, QUICK_STOP), (3, AXIS), (4, AXIS)] {
        let case = format!("0x605E is {option}");
        let mut bench = running();
        bench.batch(&[(0x605E, 0, option), (0x6007, 0, 1)]).unwrap();
        let now = bench.now;
        bench.device.connection_lost(now);
        assert_eq!(bench.state(), State::FaultReactionActive, "{case}");
        assert_ramp(&mut bench, ramp, &case);
        bench.run((1_000 * SPEED / ramp - 14).unsigned_abs());
        assert_eq!(bench.state(), State::FaultReactionActive, "{case}: not yet");
        bench.run(6);
        assert_eq!((bench.state(), bench.get(0x606B)), (State::Fault, 0), "{case}");
    }
}

#[test]
fn a_fault_of_option_0_coasts() {
    let mut bench = running();
    bench.batch(&[(0x605E, 0, 0), (0x6007, 0, 1)]).unwrap();
    let now = bench.now;
    bench.device.connection_lost(now);
    bench.run(1);
    assert_eq!(bench.state(), State::Fault);
    assert_coasting(&mut bench, "0x605E is 0");
}

#[test]
fn a_following_error_ramps_down_as_0x605e_says() {
    for (option, lasts) in [(0, false), (1, true), (2, true)] {
        let mut bench = running();
        bench.set(0x605E, option);
        bench.batch(&[(0x6065, 0, 5), (0x6072, 0, 0)]).unwrap();
        bench.run_until(|b| b.is_set(3));
        bench.set(0x6072, 3_000);
        bench.run(5);
        assert_eq!(bench.state() == State::FaultReactionActive, lasts, "{option}: {:?}", bench.state());
        bench.run(1_000);
        assert_eq!((bench.state(), bench.get(0x603F)), (State::Fault, 0x8611), "{option}");
    }
}

#[test]
fn a_lost_connection_acts_in_every_mode_as_0x6007_says() {
    for mode in [0, 1, 2, 3, 4, 6, 7, 8, 9, 10] {
        for (option, end) in [
            (0, State::OperationEnabled),
            (1, State::Fault),
            (2, State::SwitchOnDisabled),
            (3, State::SwitchOnDisabled),
        ] {
            let mut bench = running();
            let here = bench.position();
            bench.batch(&[(0x6065, 0, 0xFFFF_FFFF), (0x607A, 0, here), (0x6060, 0, mode)]).unwrap();
            bench.run(1_000);
            assert_eq!((bench.state(), bench.get(0x6061)), (State::OperationEnabled, mode));
            bench.set(0x6007, option);
            let now = bench.now;
            bench.device.connection_lost(now);
            bench.run(1_000);
            assert_eq!(bench.state(), end, "mode {mode}, option {option}");
        }
    }
}

#[test]
fn a_lost_connection_in_a_quick_stop_that_stays_acts_on_the_power() {
    for (option, end) in [
        (0, State::QuickStopActive),
        (1, State::Fault),
        (2, State::SwitchOnDisabled),
        (3, State::QuickStopActive),
    ] {
        let mut bench = running();
        bench.batch(&[(0x605A, 0, 6), (0x6007, 0, option)]).unwrap();
        bench.control(0x02);
        bench.run(20);
        let now = bench.now;
        bench.device.connection_lost(now);
        bench.run(1_000);
        assert_eq!((bench.state(), bench.velocity()), (end, 0), "option {option}");
    }
}

#[test]
fn values_the_standard_does_not_have_are_refused() {
    let mut bench = Bench::new("cia402-servo");
    let ranges =
        [(0x605A, 0, 8), (0x605B, 0, 1), (0x605C, 0, 1), (0x605D, 1, 4), (0x605E, 0, 4), (0x6007, 0, 3)];
    for (index, min, max) in ranges {
        for value in -3..=10 {
            let expected = if value < min {
                Err(AbortCode::ValueTooLow)
            } else if value > max {
                Err(AbortCode::ValueTooHigh)
            } else {
                Ok(())
            };
            assert_eq!(bench.batch(&[(index, 0, value)]), expected, "{index:04X} = {value}");
        }
    }
}
