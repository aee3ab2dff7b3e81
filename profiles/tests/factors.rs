//! User units: the factor group, polarity and the position range.

mod bench;

use std::sync::Arc;

use bench::Bench;
use od::{AbortCode, Instant};
use profiles::{Device, Profile};
use proptest::prelude::*;

const PP: i64 = 1;
const PV: i64 = 3;

/// Every part of a fraction, of both profiles.
const FRACTIONS: [u16; 9] = [0x608F, 0x6090, 0x6091, 0x6092, 0x6093, 0x6094, 0x6096, 0x6097, 0x60A2];

fn with_motor(motor: &str) -> Bench {
    let profile = Profile::embedded("jvl-mac00-fc4", Some(motor)).unwrap().unwrap();
    let device = Device::new(Arc::new(profile), 1, Instant::ZERO);
    let mut bench = Bench { device, now: Instant::ZERO };
    bench.run(10);
    bench
}

/// Where the axis is, in counts.
fn counts(bench: &Bench) -> f64 {
    bench.device.axes().next().unwrap().position.0
}

/// How fast it is, in counts/s.
fn speed(bench: &Bench) -> f64 {
    bench.device.axes().next().unwrap().velocity.0
}

fn belt_drive(bench: &mut Bench) {
    bench.batch(&[(0x6091, 1, 35), (0x6091, 2, 10), (0x6092, 1, 38_956), (0x6092, 2, 100)]).unwrap();
}

/// Runs at `velocity` user units; the velocity reached, in counts/s.
fn run_at(bench: &mut Bench, velocity: i64) -> f64 {
    bench.batch(&[(0x6083, 0, 1_000_000), (0x60FF, 0, velocity)]).unwrap();
    bench.enable(PV);
    bench.run(3000);
    speed(bench)
}

#[test]
fn from_factory_one_unit_is_one_count() {
    for name in ["cia402-servo", "jvl-mac00-fc4"] {
        let mut bench = Bench::new(name);
        bench.fast_profile();
        bench.enable(PP);
        bench.move_to(1234, 0);
        bench.run(2000);
        assert!((counts(&bench) - 1234.0).abs() <= 1.0, "{name}: {}", counts(&bench));
        assert_eq!(bench.position(), counts(&bench) as i64);
    }
}

#[test]
fn the_belt_drive_of_the_module_manual_counts_millimetres() {
    let mut bench = with_motor("mac800");
    belt_drive(&mut bench);
    // 8000 * 35/10 * 100/38956 = 71.876 counts a millimetre.
    assert_eq!((bench.get_sub(0x6093, 1), bench.get_sub(0x6093, 2)), (700_000, 9739));
    bench.batch(&[(0x6081, 0, 20_000), (0x6083, 0, 100_000)]).unwrap();
    bench.enable(PP);
    bench.move_to(100, 0);
    bench.run(2000);
    assert!((counts(&bench) - 7187.6).abs() <= 1.0, "{}", counts(&bench));
    assert_eq!(bench.position(), 100);
}

#[test]
fn the_belt_drive_on_4096_counts_has_36_8_a_millimetre() {
    let mut bench = with_motor("mac140");
    belt_drive(&mut bench);
    let ratio = bench.get_sub(0x6093, 1) as f64 / bench.get_sub(0x6093, 2) as f64;
    assert!((ratio - 36.800_5).abs() < 1e-4, "{ratio}");
}

#[test]
fn the_first_velocity_example_of_the_module_manual_counts_rpm() {
    let mut bench = with_motor("mac800");
    bench.batch(&[(0x6094, 1, 8000), (0x6094, 2, 60)]).unwrap();
    let reached = run_at(&mut bench, 600);
    assert!((reached - 80_000.0).abs() < 100.0, "{reached}");
    assert!((bench.velocity() - 600).abs() <= 1);
}

#[test]
fn the_second_velocity_example_of_the_module_manual_needs_its_fraction_the_other_way_round() {
    let mut right = with_motor("mac800");
    right.batch(&[(0x6094, 1, 1_000_000), (0x6094, 2, 13_913)]).unwrap();
    let reached = run_at(&mut right, 100);
    // 100 mm/s are 0.257 turns of the shaft and 0.898 of the motor a second.
    assert!((reached - 7187.5).abs() < 60.0, "{reached}");
    assert!((right.velocity() - 100).abs() <= 1);

    // As printed a unit is 0.0139 counts/s: a hundred of them hardly move.
    let mut printed = with_motor("mac800");
    printed.batch(&[(0x6094, 1, 13_913), (0x6094, 2, 1_000_000)]).unwrap();
    run_at(&mut printed, 100);
    assert!(counts(&printed).abs() < 6.0, "{}", counts(&printed));
}

#[test]
fn the_acceleration_examples_of_the_module_manual_count_rpm_and_millimetres_a_second() {
    for (factor, acceleration, after_half_a_second) in [
        ([8000, 60], 600, 40_000.0),          // 600 rpm/s
        ([1_000_000, 13_913], 500, 17_968.8), // 500 mm/s²
    ] {
        let mut bench = with_motor("mac800");
        bench.batch(&[(0x6097, 1, factor[0]), (0x6097, 2, factor[1])]).unwrap();
        bench.batch(&[(0x6083, 0, acceleration), (0x60FF, 0, 200_000)]).unwrap();
        bench.enable(PV);
        bench.run(500);
        let error = (speed(&bench) / after_half_a_second - 1.0).abs();
        assert!(error < 0.02, "{factor:?}: {}", speed(&bench));
    }
}

#[test]
fn a_written_position_factor_holds_until_gear_or_feed_are_written() {
    let mut bench = with_motor("mac140");
    let factor = |bench: &Bench| (bench.get_sub(0x6093, 1), bench.get_sub(0x6093, 2));
    bench.batch(&[(0x6093, 1, 7), (0x6093, 2, 3), (0x6091, 1, 2)]).unwrap();
    assert_eq!(factor(&bench), (7, 3));
    bench.batch(&[(0x6097, 1, 9), (0x6090, 1, 9)]).unwrap();
    assert_eq!(factor(&bench), (7, 3));
    bench.batch(&[(0x6091, 2, 3)]).unwrap();
    assert_eq!(factor(&bench), (2, 3));
}

#[test]
fn the_motor_registers_count_in_counts_whatever_the_factors() {
    let mut bench = with_motor("mac140");
    bench.batch(&[(0x6093, 1, 100)]).unwrap();
    bench.set(0x607E, 0x80);
    bench.batch(&[(0x6081, 0, 20_000), (0x6083, 0, 100_000)]).unwrap();
    bench.enable(PP);
    bench.move_to(-20, 0);
    bench.run(2000);
    assert_eq!(bench.position(), -20);
    assert!((bench.get_sub(0x2012, 10) - 2000).abs() <= 1, "{}", bench.get_sub(0x2012, 10));
}

#[test]
fn a_zero_in_a_factor_is_refused_alone_and_in_a_batch() {
    for name in ["cia402-servo", "jvl-mac00-fc4"] {
        let mut bench = Bench::new(name);
        let has = |bench: &Bench, index| bench.device.dictionary().find(od::Address::new(index, 1)).is_ok();
        let indices: Vec<u16> = FRACTIONS.into_iter().filter(|index| has(&bench, *index)).collect();
        assert_eq!(indices.len(), 7, "{name}");
        for (index, sub) in indices.into_iter().flat_map(|index| [(index, 1), (index, 2)]) {
            assert_eq!(bench.batch(&[(index, sub, 0)]), Err(AbortCode::InvalidValue), "{index:04X}:{sub}");
            let batch = [(0x607E, 0, 0x80), (index, sub, 5), (index, 3 - sub, 0)];
            assert_eq!(bench.batch(&batch), Err(AbortCode::InvalidValue), "{index:04X}:{sub}");
            assert_ne!(bench.get_sub(index, sub), 0);
        }
        assert_eq!(bench.get(0x607E), 0, "nothing of a refused batch is kept");
    }
}

#[test]
fn a_reserved_bit_of_the_polarity_is_refused() {
    for name in ["cia402-servo", "jvl-mac00-fc4"] {
        let mut bench = Bench::new(name);
        for value in [0x01, 0x20, 0xC1] {
            assert_eq!(bench.batch(&[(0x607E, 0, value)]), Err(AbortCode::InvalidValue));
        }
        bench.set(0x607E, 0xC0);
    }
}

/// A spindle of 5 mm a turn behind a gear of 4:1, in micrometres: 4096 * 4 / 5000 = 3.2768 counts a unit.
fn spindle() -> Bench {
    let mut bench = Bench::new("cia402-servo");
    bench.set(0x6065, 0xFFFF_FFFF);
    bench.batch(&[(0x6091, 1, 4), (0x6092, 1, 5000)]).unwrap();
    bench
}

#[test]
fn gear_and_feed_make_the_units_of_a_neutral_drive() {
    let mut bench = spindle();
    bench.fast_profile();
    bench.enable(PP);
    bench.move_to(10_000, 0);
    bench.run(100);
    // 100000 um/s² for a tenth of a second.
    assert!((speed(&bench) - 32_768.0).abs() < 700.0, "{}", speed(&bench));
    assert!((bench.velocity() - 10_000).abs() < 200);
    bench.run(3000);
    assert!((counts(&bench) - 32_768.0).abs() <= 1.0, "{}", counts(&bench));
    assert_eq!(bench.position(), 10_000);
}

#[test]
fn the_velocity_factor_makes_units_of_their_own() {
    let mut bench = spindle();
    // mm/s and m/s².
    bench.batch(&[(0x6096, 1, 1000), (0x6097, 1, 1_000_000)]).unwrap();
    bench.batch(&[(0x6083, 0, 1), (0x60FF, 0, 12)]).unwrap();
    bench.enable(PV);
    bench.run(500);
    assert!((speed(&bench) - 39_321.6).abs() < 100.0, "{}", speed(&bench));
    assert_eq!(bench.velocity(), 12);
}

#[test]
fn moves_by_a_unit_that_is_no_whole_number_of_counts_add_up() {
    let mut bench = spindle();
    bench.fast_profile();
    bench.enable(PP);
    for _ in 0..30 {
        bench.move_to(1, 0x40);
        bench.run(100);
    }
    // Three counts each would be 90, four 120.
    assert!((counts(&bench) - 98.304).abs() <= 1.0, "{}", counts(&bench));
    assert_eq!(bench.position(), 30);
}

#[test]
fn new_factors_move_nothing() {
    let benches = || {
        let mut bench = Bench::new("cia402-servo");
        bench.fast_profile();
        bench.set(0x6065, 0xFFFF_FFFF);
        bench
    };
    for mode in [PP, PV] {
        let (mut changed, mut same) = (benches(), benches());
        for bench in [&mut changed, &mut same] {
            bench.set(0x60FF, 15_000);
            bench.enable(mode);
            if mode == PP {
                bench.move_to(30_000, 0);
                bench.move_to(25_000, 0);
            }
            bench.run(300);
        }
        // Twice as many units a turn, and the other way round.
        changed.batch(&[(0x6092, 1, 8192), (0x607E, 0, 0xC0)]).unwrap();
        for _ in 0..50 {
            assert_eq!(counts(&changed).to_bits(), counts(&same).to_bits(), "mode {mode}");
            assert!((changed.position() + 2 * same.position()).abs() <= 1);
            assert!((changed.velocity() + 2 * same.velocity()).abs() <= 1);
            changed.run(50);
            same.run(50);
        }
        assert!(counts(&same) > 10_000.0);
    }
}

#[test]
fn polarity_turns_positions_and_velocities_round() {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.set(0x607E, 0x80);
    bench.enable(PP);
    bench.move_to(-1000, 0);
    bench.run(2000);
    assert!((counts(&bench) - 1000.0).abs() <= 1.0);
    assert_eq!(bench.position(), -1000);
    assert!(bench.is_set(10), "a window has no polarity");
    bench.move_to(300, 0x40);
    bench.run(2000);
    assert!((counts(&bench) - 700.0).abs() <= 1.0);

    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.batch(&[(0x607E, 0, 0x40), (0x60FF, 0, -5000)]).unwrap();
    bench.enable(PV);
    bench.run(1000);
    assert!(speed(&bench) > 4900.0 && bench.velocity() < -4900);
    assert!(bench.position() > 0, "positions have a bit of their own");
}

#[test]
fn an_endless_axis_is_shown_in_its_range_and_a_target_lies_in_the_present_turn() {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    // Tenths of a degree.
    bench.batch(&[(0x6092, 1, 3600), (0x607B, 1, 0), (0x607B, 2, 3599), (0x60FF, 0, 5000)]).unwrap();
    bench.enable(PV);
    for _ in 0..300 {
        bench.run(10);
        assert!((0..3600).contains(&bench.position()), "{}", bench.position());
    }
    assert!(counts(&bench) > 4.0 * 4096.0 && !bench.is_set(11));
    bench.set(0x60FF, 0);
    bench.run(1000);
    let turn = (counts(&bench) / 4096.0).floor();
    bench.set(0x6060, PP);
    bench.run(10);
    bench.move_to(900, 0);
    bench.run(3000);
    assert_eq!(bench.position(), 900);
    assert!((counts(&bench) - (turn + 0.25) * 4096.0).abs() <= 1.0);
}

#[test]
fn a_reset_brings_the_units_of_the_factory_back() {
    let mut bench = spindle();
    bench.fast_profile();
    bench.enable(PP);
    bench.move_to(100, 0);
    bench.run(1000);
    assert_eq!(bench.position(), 100);
    bench.device.reset(bench.now);
    assert_eq!(bench.position(), 328);
}

fn factor() -> impl Strategy<Value = i64> {
    prop_oneof![1_i64..100, Just(i64::from(u32::MAX)), 0..=i64::from(u32::MAX)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn no_factors_whatever_bring_a_drive_down(
        writes in prop::collection::vec((0..FRACTIONS.len(), 1..3_u8, factor(), any::<i32>()), 1..30),
        is_jvl: bool,
        mode in prop::sample::select(vec![PP, PV]),
    ) {
        let mut bench = Bench::new(if is_jvl { "jvl-mac00-fc4" } else { "cia402-servo" });
        bench.enable(mode);
        for (object, sub, value, target) in writes {
            let index = FRACTIONS[object];
            if bench.device.dictionary().find(od::Address::new(index, sub)).is_err() {
                continue;
            }
            let written = bench.batch(&[(index, sub, value), (0x607E, 0, value & 0xC0)]);
            prop_assert_eq!(written.is_ok(), value != 0);
            let objects =
                [(0x607A, 0, target.into()), (0x60FF, 0, target.into()), (0x607D, 1, -value.min(1 << 30))];
            bench.batch(&objects).unwrap();
            bench.control(0x0F);
            bench.control(0x3F);
            bench.run(20);
            prop_assert!(counts(&bench).is_finite() && speed(&bench).is_finite());
        }
    }
}
