//! The limits of a drive, in user units.

mod bench;

use bench::Bench;

const PP: i64 = 1;
const PV: i64 = 3;

fn servo() -> Bench {
    let mut bench = Bench::new("cia402-servo");
    bench.set(0x6065, 0xFFFF_FFFF);
    bench.fast_profile();
    bench
}

fn counts(bench: &Bench) -> f64 {
    bench.device.axes().next().unwrap().position.0
}

fn speed(bench: &Bench) -> f64 {
    bench.device.axes().next().unwrap().velocity.0
}

/// Milliseconds until the speed is `wanted` counts/s.
fn time_to(bench: &mut Bench, wanted: f64) -> i64 {
    let start = bench.now;
    bench.run_until(|b| (speed(b) - wanted).abs() < 60.0);
    bench.now.saturating_since(start).as_millis() as i64
}

#[test]
fn the_highest_profile_velocity_is_in_user_units() {
    let mut bench = servo();
    // Two counts a unit.
    bench.batch(&[(0x6092, 1, 2048), (0x607F, 0, 5000), (0x60FF, 0, 100_000)]).unwrap();
    bench.enable(PV);
    bench.run(1000);
    assert!((speed(&bench) - 10_000.0).abs() < 60.0, "{}", speed(&bench));
    // The limit follows the factor, and the axis the limit.
    bench.batch(&[(0x6092, 1, 4096)]).unwrap();
    bench.run(1000);
    assert!((speed(&bench) - 5000.0).abs() < 60.0, "{}", speed(&bench));
}

#[test]
fn the_highest_motor_speed_is_in_revolutions_per_minute_whatever_the_factors() {
    for feed in [4096, 360, 1_000_000] {
        let mut bench = servo();
        bench.batch(&[(0x6092, 1, feed), (0x607F, 0, 0xFFFF_FFFF), (0x6080, 0, 90)]).unwrap();
        bench.batch(&[(0x6083, 0, 8_000_000), (0x60FF, 0, 0x7FFF_FFFF)]).unwrap();
        bench.enable(PV);
        bench.run(2000);
        assert!((speed(&bench) - 6144.0).abs() < 60.0, "{feed}: {}", speed(&bench));
    }
}

#[test]
fn accelerations_and_decelerations_have_limits_of_their_own() {
    for polarity in [0, 0xC0] {
        let mut bench = servo();
        bench.batch(&[(0x6083, 0, 1_000_000), (0x6084, 0, 1_000_000), (0x607E, 0, polarity)]).unwrap();
        bench.batch(&[(0x60C5, 0, 100_000), (0x60C6, 0, 40_000)]).unwrap();
        bench.enable(PV);
        bench.set(0x60FF, 20_000);
        let full = if polarity == 0 { 20_000.0 } else { -20_000.0 };
        let up = time_to(&mut bench, full);
        assert!((up - 200).abs() <= 5, "{up}");
        bench.run(100);
        bench.set(0x60FF, 0);
        let down = time_to(&mut bench, 0.0);
        assert!((down - 500).abs() <= 5, "{down}");
    }
}

#[test]
fn a_ramp_limit_of_zero_is_none() {
    let mut bench = servo();
    bench.batch(&[(0x60C5, 0, 0), (0x60C6, 0, 0), (0x60FF, 0, 20_000)]).unwrap();
    bench.enable(PV);
    let up = time_to(&mut bench, 20_000.0);
    assert!((up - 200).abs() <= 15, "{up}");
}

/// The highest torque shown to either side while the axis is driven hard to and fro.
fn torques(objects: &[(u16, u8, i64)]) -> (i64, i64) {
    let mut bench = servo();
    bench.batch(&[(0x6083, 0, 4_000_000), (0x6084, 0, 4_000_000), (0x6067, 0, 0xFFFF_FFFF)]).unwrap();
    bench.batch(objects).unwrap();
    bench.enable(PV);
    let (mut least, mut most) = (0, 0);
    for target in [100_000, -100_000, 100_000, 0] {
        bench.set(0x60FF, target);
        for _ in 0..300 {
            bench.run(1);
            least = bench.get(0x6077).min(least);
            most = bench.get(0x6077).max(most);
        }
    }
    (least, most)
}

#[test]
fn each_side_has_a_torque_limit_of_its_own_below_that_of_both() {
    assert_eq!(torques(&[(0x60E0, 0, 300), (0x60E1, 0, 120)]), (-120, 300));
    assert_eq!(torques(&[(0x60E0, 0, 300), (0x60E1, 0, 120), (0x6072, 0, 200)]), (-120, 200));
    let (least, most) = torques(&[]);
    assert!(least < -300 && most > 300, "{least} {most}");
}

#[test]
fn the_rated_torque_is_that_of_the_motor_and_cannot_be_written() {
    let mut bench = servo();
    assert_eq!(bench.get(0x6076), 1000);
    assert_eq!(bench.batch(&[(0x6076, 0, 5)]), Err(od::AbortCode::ReadOnly));
}

/// Where moves far to both sides end, in counts.
fn ends(bench: &mut Bench) -> (f64, f64) {
    bench.enable(PP);
    let mut ends = [-100_000, 100_000].map(|target| {
        bench.move_to(target, 0x20);
        bench.run(8000);
        assert!(bench.is_set(11), "internal limit active");
        counts(bench).round()
    });
    ends.sort_by(f64::total_cmp);
    (ends[0], ends[1])
}

fn is_at(ends: (f64, f64), low: f64, high: f64) -> bool {
    (ends.0 - low).abs() <= 1.0 && (ends.1 - high).abs() <= 1.0
}

#[test]
fn software_limits_are_in_user_units_and_swap_with_the_polarity() {
    let mut bench = servo();
    bench.batch(&[(0x6092, 1, 2048), (0x607D, 1, -1000), (0x607D, 2, 4000)]).unwrap();
    let plain = ends(&mut bench);
    assert!(is_at(plain, -2000.0, 8000.0), "{plain:?}");
    let mut bench = servo();
    bench.batch(&[(0x6092, 1, 2048), (0x607E, 0, 0x80), (0x607D, 1, -1000), (0x607D, 2, 4000)]).unwrap();
    let turned = ends(&mut bench);
    assert!(is_at(turned, -8000.0, 2000.0), "{turned:?}");
}

#[test]
fn software_limits_count_from_the_machine_home_position() {
    let mut bench = servo();
    bench.batch(&[(0x607C, 0, 500), (0x607D, 1, -1000), (0x607D, 2, 4000)]).unwrap();
    let ends = ends(&mut bench);
    assert!(is_at(ends, -1500.0, 3500.0), "{ends:?}");
}

#[test]
fn software_limits_follow_the_factors() {
    let mut bench = servo();
    bench.batch(&[(0x607D, 1, -1000), (0x607D, 2, 4000)]).unwrap();
    bench.batch(&[(0x6091, 1, 2)]).unwrap();
    let ends = ends(&mut bench);
    assert!(is_at(ends, -2000.0, 8000.0), "{ends:?}");
}

#[test]
fn equal_or_reversed_software_limits_are_none() {
    for (min, max) in [(0, 0), (100, 100), (300, -300)] {
        let mut bench = servo();
        bench.batch(&[(0x607D, 1, min), (0x607D, 2, max)]).unwrap();
        bench.enable(PP);
        bench.move_to(5000, 0);
        bench.run(2000);
        assert!(!bench.is_set(11) && bench.is_set(10), "{min} {max}");
        assert!((counts(&bench) - 5000.0).abs() <= 1.0);
    }
}
