//! Profile torque mode.

mod bench;

use bench::Bench;
use profiles::State;

const TQ: i64 = 4;
const HALT: i64 = 1 << 8;
const REACHED: u32 = 10;
const LIMITED: u32 = 11;

/// A drive that gives a torque of `target` with a slope of 1000 a second.
fn pushing(target: i64) -> Bench {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.batch(&[(0x6071, 0, target), (0x6087, 0, 1_000)]).unwrap();
    bench.enable(TQ);
    bench
}

#[test]
fn the_torque_rises_by_its_slope_and_says_when_it_is_there() {
    for target in [120, -120] {
        let mut bench = pushing(target);
        bench.run(60);
        assert!((58..=62).contains(&bench.get(0x6074).abs()), "{}", bench.get(0x6074));
        assert!(!bench.is_set(REACHED));
        bench.run(65);
        assert_eq!((bench.get(0x6074), bench.get(0x6077)), (target, target));
        assert!(bench.is_set(REACHED) && !bench.is_set(LIMITED));
        assert!(bench.velocity() * target.signum() > 0, "it runs to where it is pushed");
        bench.set(0x6071, 0);
        assert!(!bench.is_set(REACHED));
        bench.run(125);
        assert_eq!(bench.get(0x6074), 0);
        assert!(bench.is_set(REACHED));
    }
}

#[test]
fn no_slope_is_at_once() {
    let mut bench = pushing(0);
    bench.batch(&[(0x6071, 0, 300), (0x6087, 0, 0)]).unwrap();
    bench.run(1);
    assert_eq!(bench.get(0x6074), 300);
}

#[test]
fn no_more_than_the_torque_limit_is_given() {
    let mut bench = pushing(500);
    bench.set(0x6072, 100);
    bench.set(0x6071, 501);
    bench.run(150);
    assert_eq!((bench.get(0x6074), bench.get(0x6077)), (100, 100));
}

#[test]
fn the_speed_stays_below_the_highest_one_and_the_target_is_not_reached() {
    let mut bench = pushing(500);
    bench.set(0x6080, 600);
    bench.run(2_000);
    let highest = 600 * 4096 / 60;
    assert!((highest - 200..=highest + 10).contains(&bench.velocity()), "{}", bench.velocity());
    assert!(bench.get(0x6077) < 100, "only friction is left to overcome: {}", bench.get(0x6077));
    assert!(!bench.is_set(REACHED));
}

#[test]
fn the_axis_stops_at_a_position_limit() {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.batch(&[(0x607D, 1, -1_000_000), (0x607D, 2, 20_000), (0x6071, 0, 200), (0x6087, 0, 0)]).unwrap();
    bench.enable(TQ);
    bench.run(1_500);
    assert!((15_000..=20_000).contains(&bench.position()), "{}", bench.position());
    assert!(bench.is_set(LIMITED) && !bench.is_set(REACHED));
    bench.set(0x6071, -200);
    bench.run(20);
    assert!(bench.velocity() < 0, "back it may go");
    assert!(!bench.is_set(LIMITED));
}

#[test]
fn a_halt_takes_the_torque_off_by_its_slope_or_stops_as_the_option_says() {
    for (option, eases) in [(1, true), (2, false), (3, false), (4, false)] {
        let mut bench = pushing(100);
        bench.set(0x605D, option);
        bench.run(150);
        bench.control(0x0F | HALT);
        bench.run(50);
        if eases {
            assert!((48..=52).contains(&bench.get(0x6074)), "{}", bench.get(0x6074));
            assert!(!bench.is_set(REACHED));
        }
        bench.run_until(|b| b.is_set(REACHED));
        bench.run(100);
        assert!(bench.velocity().abs() <= 100, "option {option}");
        assert_eq!(bench.state(), State::OperationEnabled);
        bench.set(0x6071, 80);
        bench.run(50);
        assert!(bench.velocity().abs() <= 100, "halted whatever the target");
        bench.control(0x0F);
        bench.run(100);
        assert_eq!(bench.get(0x6074), 80);
    }
}

#[test]
fn another_mode_begins_at_rest() {
    let mut bench = pushing(300);
    bench.run(500);
    assert!(bench.velocity() > 10_000);
    bench.set(0x6060, 1);
    bench.set(0x6071, 400);
    bench.run_until(|b| b.get(0x6061) == 1);
    assert!(bench.velocity().abs() <= 100);
    let place = bench.get(0x6062);
    bench.run(200);
    assert_eq!(bench.get(0x6062), place);
}
