//! Each method from each region of the axis, against the figures of IEC 61800-7-201.

use proptest::prelude::*;

use crate::machine::{COMPLETED, FAILED, Machine, RAMP, home, place};

/// On and next to everything there is, and in between.
const STARTS: [i64; 15] = [
    -6_600, -6_000, -5_950, -1_000, 999, 2_950, 3_000, 3_050, 3_600, 4_150, 4_200, 4_250, 7_000, 9_950,
    10_600,
];

/// Where the figure of a method puts home: at which edge, and to which side of it the index counts.
fn figure(machine: &Machine, method: i64) -> i64 {
    let (negative, positive) = (machine.negative.unwrap_or(0), machine.positive.unwrap_or(0));
    let (left, right) = machine.home.unwrap_or((0, 0));
    let (edge, is_above) = match if method > 16 { method - 16 } else { method } {
        1 => (negative, true),
        2 => (positive, false),
        // Left edge: outside, inside. A positive home switch has no other.
        3 | 7 | 14 => (left, false),
        4 | 8 | 13 => (left, true),
        // Right edge: inside, outside. A negative home switch has no other.
        6 | 9 | 12 => (right, false),
        5 | 10 | 11 => (right, true),
        _ => panic!("no method with a switch"),
    };
    match (method, is_above) {
        (17..=30, _) => edge,
        (_, true) => machine.index_above(edge),
        (_, false) => machine.index_below(edge),
    }
}

/// The kind of home switch that a method is made for.
fn made_for(method: i64) -> Machine {
    let home = match method {
        3 | 4 | 19 | 20 => Some((3_000, 50_000)),
        5 | 6 | 21 | 22 => Some((-50_000, 4_200)),
        _ => Machine::MIDDLE.home,
    };
    Machine { home, ..Machine::MIDDLE }
}

fn check(machine: Machine, method: i64, expected: i64) {
    let mut bench = machine.enabled("cia402-servo");
    bench.set(0x607C, 123);
    let case = format!("method {method}, {machine:?}");
    assert_eq!(home(&mut bench, method), COMPLETED, "{case}");
    let error = place(&mut bench) - expected;
    assert!(error.abs() <= 1, "{case}: {error} from the figure");
    assert_eq!(bench.get(0x6062), -123, "{case}: zero is the offset above home");
    let shown = bench.position() + 123 - place(&mut bench);
    assert_eq!(shown, -expected, "{case}: home to the count");
}

#[test]
fn every_method_with_a_switch_ends_where_its_figure_says_from_everywhere() {
    for method in (1..=14).chain(17..=30) {
        for start in STARTS {
            let machine = made_for(method).at(start);
            check(machine, method, figure(&machine, method));
        }
    }
}

#[test]
fn the_next_index_in_its_direction_is_home() {
    for start in [-2_000, 0, 998, 1_002, 5_000] {
        let machine = Machine::MIDDLE.at(start);
        check(machine, 33, machine.index_below(start));
        check(machine, 34, machine.index_above(start));
    }
}

#[test]
fn the_present_position_is_home() {
    for start in [-6_500, 17, 3_500] {
        check(Machine::MIDDLE.at(start), 35, start);
        check(Machine::MIDDLE.at(start), 37, start);
    }
}

#[test]
fn an_index_at_the_edge_does_not_count_but_the_next_one() {
    for (index, method) in [(3_000, 7), (3_000, 8), (4_200, 9), (4_200, 10), (-6_000, 1), (10_000, 2)] {
        let machine = Machine { index, home: Some((3_000, 4_200)), ..Machine::MIDDLE };
        check(machine, method, figure(&machine, method));
    }
}

#[test]
fn narrow_switches_are_found_from_either_side() {
    for width in [2, 10, 40] {
        for method in (7..=14).chain(23..=30) {
            for start in [-1_000, 3_000, 7_000] {
                let machine = Machine { home: Some((3_000, 3_000 + width)), start, ..Machine::MIDDLE };
                check(machine, method, figure(&machine, method));
            }
        }
    }
}

#[test]
fn a_switch_lets_go_where_it_lets_go() {
    let (left, right, hysteresis) = (3_000, 4_200, 25);
    for (method, edge) in [
        (17, -6_000 + hysteresis),
        (18, 10_000 - hysteresis),
        (23, left - hysteresis),
        (24, left),
        (25, right),
        (26, right + hysteresis),
        (27, right + hysteresis),
        (28, right),
        (29, left),
        (30, left - hysteresis),
    ] {
        for start in STARTS {
            check(Machine { hysteresis, ..Machine::MIDDLE.at(start) }, method, edge);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn homing_ends_at_the_right_place_or_says_that_it_failed(
        method in prop::sample::select((1..=14).chain(17..=30).collect::<Vec<i64>>()),
        (low, width, index) in (-4_000_i64..8_000, 1_i64..3_000, 0_i64..4_096),
        start in -6_500_i64..10_500,
        (fast, slow) in (100_i64..60_000, 50_i64..3_000),
    ) {
        let machine = Machine { home: Some((low, low + width)), index, start, ..Machine::MIDDLE };
        let mut bench = machine.enabled("cia402-servo");
        bench.batch(&[(0x6099, 1, fast), (0x6099, 2, slow), (0x609A, 0, 4 * RAMP)]).unwrap();
        crate::machine::start(&mut bench, method);
        // One period at full speed until the switch is seen, one until the brakes act, and some control error.
        let braking = fast * fast / (2 * 4 * RAMP) + 2 * fast / 1000 + 20;
        let (lowest, highest) = (start.min(-6_000) - braking, start.max(10_000) + braking);
        for _ in 0..400_000 {
            bench.run(1);
            let now = place(&mut bench);
            prop_assert!((lowest..=highest).contains(&now), "{now}, braking {braking}");
            if bench.is_set(10) {
                break;
            }
        }
        bench.run(50);
        let now = crate::machine::bits(&bench);
        prop_assert!(now == COMPLETED || now == FAILED, "{now:?}");
        if now == COMPLETED {
            let expected = figure(&machine, method);
            prop_assert!((place(&mut bench) - expected).abs() <= 1, "{} for {expected}", place(&mut bench));
        } else if !matches!(method, 3..=6 | 19..=22) {
            // Without an index to look for and with room on both sides there is no reason to fail.
            let has_room = low - braking > -6_000 && low + width + braking < 10_000;
            prop_assert!(!has_room || method < 15, "failed without a reason");
        }
    }
}
