//! Endless relative positioning of JVL's drives: 0x2011:08, bit 7 (module manual, section 4.3.12).

mod bench;

use bench::Bench;

const RELATIVE: i64 = 1 << 6;
const IMMEDIATELY: i64 = 1 << 5;
const ON_SET_POINT: i64 = 1 << 9;
const ENDLESS: i64 = 1 << 7;

fn enabled() -> Bench {
    let mut bench = Bench::new("jvl-mac00-fc4");
    bench.fast_profile();
    bench.set_sub(0x2011, 8, ENDLESS);
    bench.enable(1);
    bench
}

/// Where the shaft is, which no bus can rename.
fn place(bench: &mut Bench) -> i64 {
    bench.plant().motor_position().0.round() as i64
}

#[test]
fn the_shaft_goes_on_and_the_actual_position_is_what_it_was() {
    let mut bench = enabled();
    for (distance, end) in [(5_000, 5_000), (5_000, 10_000), (-3_000, 7_000), (100_000, 107_000)] {
        bench.move_to(distance, RELATIVE);
        assert!((bench.position() + distance).abs() <= 1, "{} at the start", bench.position());
        bench.run_until(|b| b.is_set(10));
        assert!(bench.position().abs() <= 1, "{} at the end", bench.position());
        let shaft = place(&mut bench);
        assert!((shaft - end).abs() <= 1, "{shaft} instead of {end}");
    }
}

#[test]
fn distances_add_up_whether_they_wait_or_act_at_once() {
    for flags in [RELATIVE, RELATIVE | IMMEDIATELY, RELATIVE | ON_SET_POINT] {
        let mut bench = enabled();
        bench.move_to(20_000, flags);
        bench.run(200);
        bench.move_to(4_000, flags);
        bench.run_until(|b| b.is_set(10));
        let shaft = place(&mut bench);
        assert!((shaft - 24_000).abs() <= 1, "{shaft}");
        assert!(bench.position().abs() <= 1, "{}", bench.position());
    }
}

#[test]
fn it_has_no_end_and_no_limits() {
    let mut bench = Bench::new("jvl-mac00-fc4");
    bench.batch(&[(0x6081, 0, 200_000), (0x6083, 0, 400_000)]).unwrap();
    bench.enable(1);
    bench.move_to(700, 0);
    bench.run_until(|b| b.is_set(10));
    bench.batch(&[(0x2011, 8, ENDLESS), (0x607D, 1, -10), (0x607D, 2, 10)]).unwrap();
    for turn in 1..=5 {
        bench.move_to(50_000, RELATIVE);
        bench.run_until(|b| b.is_set(10));
        assert!(!bench.is_set(11) && (bench.position() - 700).abs() <= 1, "{}", bench.position());
        assert!((place(&mut bench) - 700 - turn * 50_000).abs() <= 1);
    }
    // Without the bit the limits hold again, for the numbers of now.
    bench.set_sub(0x2011, 8, 0);
    bench.move_to(-50_000, RELATIVE);
    bench.run(1_000);
    assert!((bench.position() + 10).abs() <= 1, "{}", bench.position());
}

#[test]
fn an_absolute_set_point_is_not_taken() {
    let mut bench = enabled();
    bench.batch(&[(0x6040, 0, 0x0F), (0x607A, 0, 5_000)]).unwrap();
    bench.control(0x1F);
    assert!(!bench.is_set(12), "not acknowledged");
    bench.run(500);
    assert_eq!((place(&mut bench), bench.velocity()), (0, 0));
    bench.control(0x0F);
    bench.move_to(700, RELATIVE);
    bench.run_until(|b| b.is_set(10));
    assert!((place(&mut bench) - 700).abs() <= 1);
    bench.set_sub(0x2011, 8, 0);
    bench.move_to(500, 0);
    bench.run_until(|b| b.is_set(10));
    assert!((place(&mut bench) - 1_200).abs() <= 1, "absolute again, from the numbers of now");
}

#[test]
fn an_endless_move_forgets_the_home_position() {
    for (moves, is_homed) in [(false, true), (true, false)] {
        let mut bench = Bench::new("jvl-mac00-fc4");
        bench.fast_profile();
        bench.batch(&[(0x6098, 0, 33), (0x6099, 1, 5_000), (0x6099, 2, 5_000), (0x609A, 0, 50_000)]).unwrap();
        bench.enable(6);
        bench.control(0x1F);
        bench.run_until(|b| b.is_set(12));
        bench.control(0x0F);
        bench.set(0x6060, 1);
        bench.set_sub(0x2011, 8, ENDLESS);
        bench.run_until(|b| b.get(0x6061) == 1);
        if moves {
            bench.move_to(1_000, RELATIVE);
            bench.run_until(|b| b.is_set(10));
        }
        bench.control(0x06);
        bench.run(500);
        bench.enable(6);
        assert_eq!(bench.is_set(12), is_homed);
    }
}

#[test]
fn the_longest_distances_in_any_order_do_no_harm() {
    let mut bench = enabled();
    for round in 0..200_i64 {
        let distance = if round % 3 == 0 { i64::from(i32::MIN) } else { i64::from(i32::MAX) };
        bench.move_to(distance, RELATIVE | IMMEDIATELY);
        bench.run(20);
        assert!(bench.velocity().abs() <= 20_500, "{}", bench.velocity());
    }
    bench.control(0x0F | 1 << 8);
    bench.run(2_000);
    assert_eq!((bench.velocity(), bench.is_set(3)), (0, false));
}
