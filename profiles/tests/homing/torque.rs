//! JVL's homing: torque methods, offset, torque limit (module manual, section 4.3.25).

use axis::PositionRange;

use crate::bench::Bench;
use crate::machine::{COMPLETED, Machine, RAMP, bits, home, place, start};

/// Hard stops where the limit switches of [`Machine::MIDDLE`] are, and no switches.
const BARE: Machine = Machine { negative: None, positive: None, home: None, ..Machine::MIDDLE };
const STOPS: (i64, i64) = (-6_000, 10_000);

fn bare(offset: i64) -> Bench {
    let mut bench = Bench::with_plant("jvl-mac00-fc4", |plant| {
        let (low, high) = STOPS;
        plant.index = axis::Position(BARE.index as f64);
        plant.stops = PositionRange::new(axis::Position(low as f64), axis::Position(high as f64));
    });
    bench.batch(&[(0x6099, 1, 4_000), (0x6099, 2, 1_000), (0x609A, 0, RAMP), (0x607C, 0, offset)]).unwrap();
    bench.set(0x2100, 300);
    bench.enable(6);
    bench
}

#[test]
fn the_motor_pushes_against_its_stop_and_moves_away_by_the_offset() {
    for (method, offset) in [(-3, 5_000), (-4, -5_000)] {
        let mut bench = bare(offset);
        assert_eq!(home(&mut bench, method), COMPLETED, "{method}");
        let stop = if method == -3 { STOPS.0 } else { STOPS.1 };
        let away = place(&mut bench) - stop;
        assert!((away - offset).abs() <= 3, "{method}: {away} from the stop");
        assert!(bench.position().abs() <= 1, "the zero position");
    }
}

#[test]
fn the_index_on_the_way_back_is_home_if_the_method_wants_it() {
    for (method, offset) in [(-1, 0), (-2, 0), (-1, 700), (-2, -700)] {
        let mut bench = bare(offset);
        assert_eq!(home(&mut bench, method), COMPLETED, "{method}");
        let index = if method == -1 { BARE.index_above(STOPS.0) } else { BARE.index_below(STOPS.1) };
        assert!((place(&mut bench) - index - offset).abs() <= 1, "{method}");
        assert!(bench.position().abs() <= 1, "the zero position");
    }
}

#[test]
fn the_torque_of_homing_has_its_own_limit() {
    // More than the motor gives is what it gives.
    for limit in [200, 5_000] {
        let mut bench = bare(5_000);
        bench.batch(&[(0x2100, 0, limit), (0x6072, 0, 100)]).unwrap();
        start(&mut bench, -3);
        bench.run(500);
        // Written on the way, it changes nothing: with so little torque the stop would never be felt.
        bench.set(0x6072, 110);
        bench.run_until(|b| b.is_set(10));
        assert_eq!(bits(&bench), COMPLETED, "limit {limit}");
    }
}

#[test]
fn methods_with_a_switch_end_at_the_zero_position_too() {
    let mut bench = Machine::MIDDLE.enabled("jvl-mac00-fc4");
    bench.set(0x607C, 250);
    assert_eq!(home(&mut bench, 23), COMPLETED);
    assert!((place(&mut bench) - 3_250).abs() <= 1);
    assert!(bench.position().abs() <= 1);
}
