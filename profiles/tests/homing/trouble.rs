//! What homing does when there is no home to be found.

use axis::{Input, PlantFault};

use crate::bench::Bench;
use crate::machine::{COMPLETED, FAILED, FAILING, Machine, REVOLUTION, RUNNING, bits, home, place, start};

const SERVO: &str = "cia402-servo";
const NO_SWITCH: Machine = Machine { home: None, ..Machine::MIDDLE };

#[test]
fn both_limits_or_the_first_one_end_a_search_without_a_switch() {
    for method in (3..=14).chain(19..=30) {
        let mut bench = NO_SWITCH.enabled(SERVO);
        bench.events();
        assert_eq!(home(&mut bench, method), FAILED, "method {method}");
        let goes_up_first = matches!(method, 3 | 4 | 7..=10 | 19 | 20 | 23..=26);
        let turns = matches!(method, 7..=14 | 23..=30);
        let end = place(&mut bench);
        let is_up = end > 9_900;
        assert!(is_up || end < -5_900, "method {method}: {end}");
        assert_eq!(is_up, goes_up_first != turns, "method {method}: {end}");
        assert_eq!(bench.events(), [], "no fault: the drive goes on operating");
    }
}

#[test]
fn a_failed_homing_can_be_started_again() {
    let mut bench = NO_SWITCH.enabled(SERVO);
    assert_eq!(home(&mut bench, 3), FAILED);
    assert_eq!(home(&mut bench, 17), COMPLETED);
    assert!((place(&mut bench) + 6_000).abs() <= 1);
}

#[test]
fn a_search_for_an_index_ends_after_a_revolution_and_a_half() {
    for (method, direction, from) in [(34, 1, 0), (33, -1, 0), (10, 1, 4_200), (14, -1, 3_000)] {
        let mut bench = Bench::with_plant(SERVO, |plant| {
            // One pulse in ten revolutions of the motor is none.
            plant.counts_per_revolution = 40_960;
            plant.index = axis::Position(20_000.0);
            plant.home_switch = axis::PositionRange::new(axis::Position(3_000.0), axis::Position(4_200.0));
        });
        bench.batch(&[(0x6099, 1, 4_000), (0x6099, 2, 2_000), (0x609A, 0, 100_000)]).unwrap();
        bench.enable(6);
        let begin = if method == 14 { 8_000 } else { 0 };
        if begin != 0 {
            bench.set(0x6060, 1);
            bench.run(20);
            bench.fast_profile();
            bench.move_to(begin, 0);
            bench.run_until(|b| b.is_set(10));
            bench.set(0x6060, 6);
            bench.run(20);
        }
        start(&mut bench, method);
        bench.run_until(|b| b.is_set(13));
        assert_eq!(bits(&bench), FAILING, "still moving");
        bench.run_until(|b| b.is_set(10));
        assert_eq!(bits(&bench), FAILED);
        let way = (place(&mut bench) - from) * direction;
        assert!((REVOLUTION * 3 / 2..REVOLUTION * 3 / 2 + 60).contains(&way), "method {method}: {way}");
    }
}

#[test]
fn without_method_or_speed_nothing_moves() {
    for (method, fast, slow) in [(0, 1_000, 1_000), (7, 0, 1_000), (7, 1_000, 0), (33, 1_000, 0)] {
        let mut bench = Machine::MIDDLE.enabled(SERVO);
        bench.batch(&[(0x6099, 1, fast), (0x6099, 2, slow)]).unwrap();
        assert_eq!(home(&mut bench, method), FAILED, "method {method}, speeds {fast}, {slow}");
        assert_eq!(place(&mut bench), 0);
    }
}

#[test]
fn a_switch_narrower_than_a_raster_step_is_found_to_the_count_or_an_error() {
    // Out of it and into it, at 60 counts a raster step.
    for method in [23, 24, 25, 26] {
        let mut bench = Machine { home: Some((3_000, 3_001)), ..Machine::MIDDLE }.enabled(SERVO);
        bench.batch(&[(0x6099, 1, 60_000), (0x6099, 2, 60_000)]).unwrap();
        let end = home(&mut bench, method);
        let error = place(&mut bench) - if method < 25 { 3_000 } else { 3_001 };
        assert!(end == FAILED || error.abs() <= 1, "method {method}: {error}");
    }
}

#[test]
fn broken_wires_of_both_limit_switches_hold_the_axis() {
    let mut bench = Machine::MIDDLE.enabled(SERVO);
    for input in [Input::PositiveLimit, Input::NegativeLimit] {
        bench.device.plant(0, bench.now).unwrap().inject(PlantFault::StuckSwitch(input, true));
    }
    bench.run(10);
    assert_eq!(home(&mut bench, 7), FAILED);
    assert!(place(&mut bench).abs() <= 1);
}

#[test]
fn an_index_behind_the_limit_switch_is_out_of_reach() {
    let machine = Machine { home: Some((8_000, 9_200)), index: 1_900, ..Machine::MIDDLE };
    let mut bench = machine.enabled(SERVO);
    assert_eq!(home(&mut bench, 10), FAILED, "the next index is at 10092");
}

#[test]
fn software_limits_count_from_home_and_hold_afterwards() {
    let mut bench = Machine::MIDDLE.at(-5_000).enabled(SERVO);
    bench.batch(&[(0x607D, 1, -100), (0x607D, 2, 2_000)]).unwrap();
    start(&mut bench, 23);
    bench.run(100);
    // Writing them on the way does not stop the search.
    bench.batch(&[(0x607D, 2, 1_500)]).unwrap();
    assert_eq!(bits(&bench), RUNNING);
    bench.run_until(|b| b.is_set(10));
    assert_eq!(bits(&bench), COMPLETED);
    bench.set(0x6060, 1);
    bench.run(20);
    bench.fast_profile();
    bench.move_to(9_000, 0);
    bench.run_until(|b| b.is_set(10));
    assert_eq!(bench.get(0x6062), 1_500);
}

#[test]
fn software_limits_hold_after_an_interruption_too() {
    let mut bench = Machine::MIDDLE.enabled(SERVO);
    bench.batch(&[(0x607D, 1, -100), (0x607D, 2, 2_000)]).unwrap();
    start(&mut bench, 23);
    bench.run(100);
    bench.control(0x0B);
    bench.run(200);
    bench.enable(1);
    bench.fast_profile();
    bench.move_to(9_000, 0);
    bench.run_until(|b| b.is_set(10));
    assert_eq!(bench.get(0x6062), 2_000);
}
