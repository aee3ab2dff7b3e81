use proptest::prelude::*;

use super::*;
use crate::{Binding, Dialect};

/// The units that these objects choose; what is not given is 1, or zero.
fn units(dialect: Dialect, objects: &[(Binding, i64)]) -> Units {
    Units::read(dialect, |binding| objects.iter().find(|(bound, _)| *bound == binding).map(|(_, v)| *v))
}

fn reversed() -> Units {
    units(Dialect::Cia402, &[(Binding::Polarity, 0xC0)])
}

fn rotary() -> Units {
    units(Dialect::Cia402, &[(Binding::MinPositionRange, 0), (Binding::MaxPositionRange, 3599)])
}

#[test]
fn positions_wrap_and_a_target_is_meant_in_the_present_turn() {
    let units = Units::default();
    assert_eq!(units.shown_position(Position(2_147_483_648.0)), i64::from(i32::MIN));
    let position = |value, near| units.position(value, Position(near));
    let meant = [
        position(i32::MIN.into(), 2_147_483_650.0),
        position(2_000_000_000, -2_000_000_000.0),
        position(-5, 7.0),
    ];
    assert_eq!(meant, [2_147_483_648.0, 2_000_000_000.0, -5.0].map(Position));
}

#[test]
fn a_position_range_wraps_at_its_ends() {
    let units = rotary();
    let shown = [0.0, 3599.0, 3600.0, -1.0, 7201.0].map(|p| units.shown_position(Position(p)));
    assert_eq!(shown, [0, 3599, 0, 3599, 1]);
    assert_eq!(units.position(10, Position(7300.0)), Position(7210.0));
    assert_eq!(units.position(3610, Position(7300.0)), Position(7210.0));
    assert_eq!(units.position(3599, Position(-5.0)), Position(-1.0));
}

#[test]
fn a_range_of_one_place_or_none_is_that_of_32_bits() {
    for (min, max) in [(0, 0), (5, -5)] {
        let objects = [(Binding::MinPositionRange, min), (Binding::MaxPositionRange, max)];
        assert_eq!(units(Dialect::Cia402, &objects), Units::default());
    }
}

#[test]
fn polarity_turns_positions_and_velocities_round_but_no_widths_and_speeds() {
    let units = reversed();
    assert_eq!(units.shown_position(Position(100.0)), -100);
    assert_eq!(units.position(-100, Position(0.0)), Position(100.0));
    assert_eq!((units.way(5), units.distance(5)), (Position(-5.0), Position(5.0)));
    assert_eq!((units.target_velocity(5), units.velocity(5)), (Velocity(-5.0), Velocity(5.0)));
    assert_eq!((units.shown_way(Position(3.0)), units.shown_velocity(Velocity(3.0))), (-3, -3));
    let half = self::units(Dialect::Cia402, &[(Binding::Polarity, 0x40)]);
    assert_eq!((half.shown_position(Position(3.0)), half.shown_velocity(Velocity(3.0))), (3, -3));
}

#[test]
fn polarity_swaps_the_ends_of_a_range() {
    let range = reversed().range(-100, 300, 0).unwrap();
    assert_eq!((range.min(), range.max()), (Position(-300.0), Position(100.0)));
    let range = reversed().range(-100, i32::MAX.into(), 0).unwrap();
    assert_eq!((range.min(), range.max()), (PositionRange::EXACT.min(), Position(100.0)));
}

#[test]
fn an_end_at_the_end_of_the_turn_does_not_bind_and_an_offset_shifts_both() {
    let units = rotary();
    assert_eq!(units.range(0, 3599, 0), None);
    assert_eq!(units.range(i32::MIN.into(), i32::MAX.into(), 0), None);
    assert_eq!(units.range(50, 50, 0), None);
    assert_eq!(units.range(60, 50, 0), None);
    let range = units.range(100, 200, 30).unwrap();
    assert_eq!((range.min(), range.max()), (Position(70.0), Position(170.0)));
    assert_eq!(units.range(100, 3599, 0).unwrap().max(), PositionRange::EXACT.max());
}

#[test]
fn velocities_and_distances_saturate_and_round_halves_away_from_zero() {
    let units = Units::default();
    assert_eq!(units.shown_velocity(Velocity(1e12)), i64::from(i32::MAX));
    assert_eq!(units.shown_velocity(Velocity(-2.5)), -3);
    assert_eq!(units.shown_way(Position(-1e12)), i64::from(i32::MIN));
    assert_eq!(units.shown_torque(Torque(1e9)), i64::from(i16::MAX));
}

#[test]
fn each_standard_factor_relates_its_unit_to_that_of_positions() {
    let units = units(
        Dialect::Cia402,
        &[
            (Binding::PositionEncoderIncrements, 4096),
            (Binding::VelocityEncoderIncrements, 4096),
            (Binding::GearMotorRevolutions, 5),
            (Binding::Feed, 10),
            (Binding::VelocityFactorNumerator, 10),
            (Binding::VelocityFactorDivisor, 60),
            (Binding::AccelerationFactorNumerator, 1000),
            (Binding::JerkFactorNumerator, 3),
        ],
    );
    // 10 units a turn of the shaft, which is 5 of the motor.
    assert_eq!(units.way(1), Position(2048.0));
    // 10 units a minute are one turn of the shaft a minute.
    assert_eq!(units.velocity(60), Velocity(5.0 * 4096.0));
    assert_eq!(units.acceleration(1), Acceleration(2_048_000.0));
    assert_eq!(units.jerk(1), Jerk(6144.0));
}

/// Factors as a machine may have them, from a thousandth of a count a unit to a million.
fn machines() -> impl Strategy<Value = Units> {
    let part = || 1..1000_i64;
    (part(), part(), 1..1000_i64, part(), any::<bool>()).prop_map(
        |(motor, shaft, encoder, feed, is_turned)| {
            let objects = [
                (Binding::PositionEncoderIncrements, encoder),
                (Binding::GearMotorRevolutions, motor),
                (Binding::GearShaftRevolutions, shaft),
                (Binding::Feed, feed),
                (Binding::Polarity, if is_turned { 0xC0 } else { 0 }),
            ];
            units(Dialect::Cia402, &objects)
        },
    )
}

proptest! {
    #[test]
    fn a_target_is_shown_as_it_was_written(
        units in machines(), value in any::<i32>(), near in any::<i32>(),
    ) {
        let near = units.way(near.into());
        prop_assert_eq!(units.shown_position(units.position(value.into(), near)), i64::from(value));
    }

    #[test]
    fn what_is_shown_is_where_the_axis_is_within_half_a_unit(units in machines(), counts in -1e9..1e9_f64) {
        let at = Position(counts);
        let shown = units.position(units.shown_position(at), at);
        let half = units.distance(1).0 / 2.0;
        prop_assert!((shown - at).abs().0 <= half + 1e-3, "{shown:?} {at:?}");
    }

    #[test]
    fn a_shown_position_is_always_in_its_range(
        min in any::<i32>(), max in any::<i32>(), counts in prop::num::f64::ANY,
    ) {
        let ends = [(Binding::MinPositionRange, min.into()), (Binding::MaxPositionRange, max.into())];
        let shown = units(Dialect::Cia402, &ends).shown_position(Position(counts));
        let (min, max) = if min < max { (min, max) } else { (i32::MIN, i32::MAX) };
        prop_assert!((i64::from(min)..=i64::from(max)).contains(&shown));
    }
}
