//! The general inputs as an axis sees them.

mod bench;

use axis::{
    Axis, Edges, Guard, Level, Levels, PlantConfig, Position, PositionRange, Profile, Temperature, Thermal,
    Velocity,
};

const PROFILE: Profile = Profile {
    velocity: Velocity(150_000.0),
    acceleration: axis::Acceleration(2e6),
    deceleration: axis::Acceleration(2e6),
    jerk: None,
};

/// Every edge of the first general input on the way to `target`.
fn edges(axis: &mut Axis, target: f64) -> Vec<Edges> {
    axis.move_to(Position(target), PROFILE);
    let mut seen = Vec::new();
    for _ in 0..1000 {
        axis.step();
        let latched = axis.status().latches.probe_1;
        seen.extend((latched != Edges::default()).then_some(latched));
    }
    assert!(axis.status().done);
    seen
}

fn with_cam() -> Axis {
    let cam = PositionRange::new(Position(20_000.0), Position(20_003.0));
    bench::enabled_on(PlantConfig { probe_switches: [cam, None], ..PlantConfig::default() })
}

#[test]
fn edges_are_told_once_at_their_exact_place_in_axis_coordinates() {
    let mut axis = with_cam();
    axis.set_position(Position(1_000.0));
    let up = Edges { rising: Some(Position(21_000.0)), falling: Some(Position(21_003.0)) };
    assert_eq!(edges(&mut axis, 40_000.0), [up]);
    let down = Edges { rising: Some(Position(21_003.0)), falling: Some(Position(21_000.0)) };
    assert_eq!(edges(&mut axis, 0.0), [down]);
}

#[test]
fn the_edges_are_those_of_the_meaning_not_of_the_level() {
    let mut axis = with_cam();
    let levels = Levels { probe_1: Level::Low, ..Levels::default() };
    axis.set_guard(Guard { levels, ..Guard::default() });
    axis.step();
    assert!(axis.status().switches.probe_1 && !axis.status().inputs.probe_1);
    let turned = Edges { rising: Some(Position(20_003.0)), falling: Some(Position(20_000.0)) };
    assert_eq!(edges(&mut axis, 40_000.0), [turned]);
}

#[test]
fn an_axis_that_sleeps_cools_down() {
    let thermal = Some(Thermal { time_constant_seconds: 10.0, ..Thermal::default() });
    let mut axis = bench::enabled_on(PlantConfig { thermal, ..PlantConfig::default() });
    (0..20).for_each(|n| drop(edges(&mut axis, if n % 2 == 0 { 50_000.0 } else { 0.0 })));
    axis.power_off();
    (0..100).for_each(|_| axis.step());
    assert!(axis.is_quiet() && axis.status().temperature > Temperature(25.2), "{:?}", axis.status());
    axis.rest(100.0);
    axis.step();
    assert!(axis.status().temperature < Temperature(25.1), "{:?}", axis.status().temperature);
}
