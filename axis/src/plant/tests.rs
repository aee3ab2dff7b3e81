use proptest::prelude::*;

use super::*;
use crate::inputs::{Edges, Input};
use crate::limits::PositionRange;

const STEP: f64 = 125e-6;

fn run(plant: &mut Plant, torque: f64, steps: u32) {
    (0..steps).for_each(|_| plant.step(Torque(torque), STEP));
}

fn range(min: f64, max: f64) -> Option<PositionRange> {
    PositionRange::new(Position(min), Position(max))
}

/// Moves slowly until the motor has reached `place`.
fn go(plant: &mut Plant, place: f64) {
    let velocity = if plant.motor_position() < Position(place) { 10_000.0 } else { -10_000.0 };
    while (plant.motor_position().0 - place) * velocity < 0.0 {
        let torque = plant.torque_for((velocity - plant.motor_velocity().0) * 1000.0, velocity);
        plant.step(torque, STEP);
    }
}

#[test]
fn the_index_is_latched_exactly_in_both_directions() {
    let mut plant = Plant::new(PlantConfig { index: Position(100.0), ..PlantConfig::default() });
    assert_eq!(plant.take_latches().index, None);
    go(&mut plant, 8200.0);
    assert_eq!(plant.take_latches().index, Some(Position(100.0)));
    go(&mut plant, 9000.0);
    assert_eq!(plant.take_latches().index, Some(Position(8292.0)));
    go(&mut plant, 50.0);
    assert_eq!(plant.take_latches().index, Some(Position(100.0)));
    assert_eq!(plant.take_latches(), Latches::default());
}

#[test]
fn switches_and_hard_stops_are_where_they_were_put() {
    let mut plant = Plant::new(PlantConfig {
        positive_switch: Some(Position(900.0)),
        negative_switch: Some(Position(-900.0)),
        home_switch: range(-10.0, 10.0),
        stops: range(-1000.0, 1000.0),
        ..PlantConfig::default()
    });
    assert_eq!(plant.inputs(), Inputs { home: true, ..Inputs::default() });
    run(&mut plant, 100.0, 4000);
    assert_eq!(plant.inputs(), Inputs { positive_limit: true, ..Inputs::default() });
    assert_eq!((plant.encoder(), plant.velocity()), (Position(1000.0), Velocity(0.0)));
    run(&mut plant, -100.0, 4000);
    assert_eq!(plant.inputs(), Inputs { negative_limit: true, ..Inputs::default() });
}

#[test]
fn a_general_input_latches_both_edges_however_near_they_are() {
    let mut plant = Plant::new(PlantConfig {
        probe_switches: [range(1000.0, 1002.0), None],
        active_low: Inputs { probe_2: true, ..Inputs::default() },
        ..PlantConfig::default()
    });
    plant.set_cam(Input::Probe2, range(1000.0, 1002.0));
    assert!(!plant.inputs().probe_1 && plant.inputs().probe_2);
    go(&mut plant, 1500.0);
    let up = Edges { rising: Some(Position(1000.0)), falling: Some(Position(1002.0)) };
    let latches = plant.take_latches();
    assert_eq!((latches.probe_1, latches.probe_2), (up, up.inverted()));
    go(&mut plant, 900.0);
    assert_eq!(plant.take_latches().probe_1, up.inverted());
    plant.set_cam(Input::Probe1, None);
    go(&mut plant, 1500.0);
    assert_eq!(plant.take_latches().probe_1, Edges::default());
}

#[test]
fn a_switch_lets_go_a_hysteresis_later_than_it_takes() {
    let mut plant = Plant::new(PlantConfig {
        home_switch: range(1000.0, 2000.0),
        hysteresis: Position(50.0),
        ..PlantConfig::default()
    });
    let mut edge_at = |place| {
        go(&mut plant, place);
        (plant.inputs().home, plant.take_latches().home)
    };
    assert_eq!(edge_at(990.0), (false, None));
    assert_eq!(edge_at(1010.0), (true, Some(Position(1000.0))));
    assert_eq!(edge_at(960.0), (true, None));
    assert_eq!(edge_at(940.0), (false, Some(Position(950.0))));
    assert_eq!(edge_at(2040.0), (true, Some(Position(1000.0))));
    assert_eq!(edge_at(2060.0), (false, Some(Position(2050.0))));
    assert_eq!(edge_at(2010.0), (false, None));
    assert_eq!(edge_at(1990.0), (true, Some(Position(2000.0))));
}

#[test]
fn a_limit_switch_may_end_behind() {
    let mut plant = Plant::new(PlantConfig {
        positive_switch: Some(Position(900.0)),
        negative_switch: Some(Position(-900.0)),
        limit_switch_width: Some(Position(200.0)),
        ..PlantConfig::default()
    });
    let mut limits_at = |place| {
        go(&mut plant, place);
        (plant.inputs().negative_limit, plant.inputs().positive_limit)
    };
    assert_eq!([1000.0, 1150.0, 1000.0].map(&mut limits_at), [(false, true), (false, false), (false, true)]);
    assert_eq!([-1000.0, -1150.0].map(limits_at), [(true, false), (false, false)]);
}

#[test]
fn switches_sit_on_the_load_and_are_latched_where_the_encoder_is() {
    let mut plant = Plant::new(PlantConfig {
        positive_switch: Some(Position(900.0)),
        backlash: Position(40.0),
        load: Load { coulomb_friction_nm: 0.05, ..Load::default() },
        ..PlantConfig::default()
    });
    go(&mut plant, 915.0);
    assert!(!plant.inputs().positive_limit);
    go(&mut plant, 925.0);
    assert!(plant.inputs().positive_limit);
    assert_eq!(plant.take_latches().positive_limit, Some(Position(920.0)));
}

#[test]
fn the_wiring_turns_levels_around() {
    let all = Inputs {
        positive_limit: true,
        negative_limit: true,
        home: true,
        drive_fault: true,
        emergency_stop: true,
        probe_1: true,
        probe_2: true,
    };
    let mut plant = Plant::new(PlantConfig {
        active_low: all,
        home_switch: range(-10.0, 10.0),
        ..PlantConfig::default()
    });
    assert_eq!(plant.inputs(), Inputs { home: false, ..all });
    plant.inject(PlantFault::StuckSwitch(Input::EmergencyStop, false));
    plant.inject(PlantFault::DriveFault(DriveFault::Internal));
    assert_eq!(plant.inputs(), Inputs { home: false, drive_fault: false, emergency_stop: false, ..all });
}

#[test]
fn a_stuck_switch_keeps_its_level_until_it_is_repaired() {
    let config = PlantConfig { positive_switch: Some(Position(900.0)), ..PlantConfig::default() };
    let mut plant = Plant::new(config);
    let fault = PlantFault::StuckSwitch(Input::PositiveLimit, false);
    plant.inject(fault);
    go(&mut plant, 1000.0);
    assert_eq!((plant.inputs(), plant.take_latches()), (Inputs::default(), Latches::default()));
    plant.clear(fault);
    assert!(plant.inputs().positive_limit);
    assert_eq!(plant.take_latches().positive_limit, Some(plant.encoder()));
}

#[test]
fn a_broken_encoder_trips_the_drive_if_it_is_monitored() {
    for monitors_encoder in [true, false] {
        let mut plant = Plant::new(PlantConfig { monitors_encoder, ..PlantConfig::default() });
        go(&mut plant, 500.0);
        let shown = plant.encoder();
        plant.inject(PlantFault::EncoderBreak);
        go(&mut plant, 5000.0);
        assert_eq!((plant.encoder(), plant.velocity()), (shown, Velocity(0.0)));
        assert_eq!(plant.fault(), monitors_encoder.then_some(DriveFault::Encoder));
        plant.clear(PlantFault::EncoderBreak);
        assert_eq!((plant.encoder().0, plant.fault()), (plant.motor_position().0.round(), None));
    }
}

#[test]
fn a_broken_encoder_may_show_anything_near() {
    let config = PlantConfig { encoder_break: EncoderBreak::Garbage, ..PlantConfig::default() };
    let mut plant = Plant::new(config);
    plant.inject(PlantFault::EncoderBreak);
    let mut seen = Vec::new();
    for _ in 0..100 {
        run(&mut plant, 10.0, 1);
        seen.push(plant.encoder().0);
    }
    assert!(seen.iter().all(|place| place.abs() <= 8192.0));
    assert!(seen.iter().any(|place| *place > 4096.0) && seen.iter().any(|place| *place < -4096.0));
}

#[test]
fn a_supply_dip_trips_under_voltage_as_long_as_it_lasts() {
    let mut plant = Plant::new(PlantConfig::default());
    let dip = PlantFault::SupplyDip(Voltage(12.0));
    plant.inject(dip);
    assert_eq!((plant.supply(), plant.fault()), (Voltage(12.0), Some(DriveFault::UnderVoltage)));
    assert!(plant.inputs().drive_fault);
    plant.clear(dip);
    assert_eq!((plant.supply(), plant.fault()), (Voltage(48.0), None));
}

/// Brakes a heavy load from 3000 min⁻¹.
fn brake(chopper: Option<Voltage>) -> Plant {
    let link = DcLink { chopper, ..DcLink::default() };
    let mut plant = Plant::new(PlantConfig {
        load: Load { inertia_kgm2: 1e-3, ..Load::default() },
        supply: Supply { dc_link: Some(link), ..Supply::default() },
        ..PlantConfig::default()
    });
    while plant.velocity() < Velocity(409_600.0) {
        run(&mut plant, 1000.0, 1);
        assert_eq!(plant.fault(), None);
    }
    while plant.velocity() > Velocity(0.0) && plant.fault().is_none() {
        run(&mut plant, -1000.0, 1);
    }
    plant
}

#[test]
fn braking_a_heavy_load_needs_a_chopper() {
    assert_eq!(brake(None).fault(), Some(DriveFault::OverVoltage));
    assert_eq!(brake(Some(Voltage(60.0))).fault(), None);
}

#[test]
fn scheduled_faults_come_and_go_by_themselves() {
    let fault = PlantFault::BlockedShaft;
    let faults = vec![ScheduledFault { fault, from_seconds: 0.1, until_seconds: Some(0.2) }];
    let mut plant = Plant::new(PlantConfig { faults, ..PlantConfig::default() });
    run(&mut plant, 100.0, 800);
    assert!(plant.velocity() > Velocity(0.0));
    run(&mut plant, 100.0, 1);
    assert_eq!(plant.velocity(), Velocity(0.0));
    run(&mut plant, 0.0, 798);
    assert!(!plant.is_settled());
    run(&mut plant, 0.0, 1);
    assert!(!plant.is_settled());
    run(&mut plant, 0.0, 1);
    assert!(plant.is_settled());
    run(&mut plant, 100.0, 1);
    assert!(plant.velocity() > Velocity(0.0));
}

#[test]
fn a_plant_tells_what_is_broken_until_it_is_repaired() {
    let all = [
        PlantFault::EncoderBreak,
        PlantFault::BlockedShaft,
        PlantFault::DriveFault(DriveFault::Overload),
        PlantFault::SupplyDip(Voltage(10.0)),
        PlantFault::StuckSwitch(Input::NegativeLimit, false),
        PlantFault::StuckSwitch(Input::EmergencyStop, true),
    ];
    let mut plant = Plant::new(PlantConfig::default());
    all.into_iter().rev().for_each(|fault| plant.inject(fault));
    assert!(plant.faults().eq(all));
    for (repaired, fault) in (1..).zip(all) {
        plant.clear(fault);
        assert!(plant.faults().eq(all.into_iter().skip(repaired)));
    }
}

#[test]
fn a_plant_is_settled_when_nothing_is_left_to_happen() {
    let config = PlantConfig {
        thermal: Some(Thermal { time_constant_seconds: 1.0, ..Thermal::default() }),
        supply: Supply { dc_link: Some(DcLink::default()), ..Supply::default() },
        noise: Noise { encoder: 3.0, velocity: 100.0, seed: 1 },
        ..PlantConfig::default()
    };
    let mut plant = Plant::new(config);
    run(&mut plant, 0.0, 1000);
    assert!(plant.is_settled());
    run(&mut plant, 500.0, 800);
    while plant.motor_velocity() > Velocity(0.0) {
        run(&mut plant, 0.0, 1);
    }
    run(&mut plant, 0.0, 8000);
    assert!(plant.is_settled() && plant.velocity() == Velocity(0.0));
    let warm = plant.temperature();
    assert!(warm > Temperature(25.1));
    plant.rest(60.0);
    assert!(plant.temperature() < Temperature(25.1), "it cools while nobody steps it");
    plant.set_load(Load::default());
    assert!(!plant.is_settled());
}

#[test]
fn noise_stays_within_its_amplitude_and_ends_with_the_motion() {
    let noise = Noise { encoder: 3.0, velocity: 100.0, seed: 1 };
    let mut plant = Plant::new(PlantConfig { noise, ..PlantConfig::default() });
    let mut errors = Vec::new();
    for _ in 0..1000 {
        run(&mut plant, 100.0, 1);
        errors.push((plant.encoder() - plant.motor_position()).0);
        assert!((plant.velocity() - plant.motor_velocity()).abs() <= Velocity(100.0));
    }
    assert!(errors.iter().all(|error| error.abs() <= 3.5));
    assert!(errors.iter().any(|error| *error > 2.0) && errors.iter().any(|error| *error < -2.0));
}

#[test]
fn a_plant_of_nonsense_is_the_default_one() {
    let nan = f64::NAN;
    let mut plant = Plant::new(PlantConfig {
        counts_per_revolution: 0,
        rated_torque_nm: nan,
        peak_torque: Torque(nan),
        motor_inertia_kgm2: 0.0,
        load: Load { inertia_kgm2: -1.0, gravity_nm: nan, ..Load::default() },
        viscous_friction_nms: f64::INFINITY,
        coulomb_friction_nm: nan,
        start: Position(nan),
        index: Position(nan),
        ..PlantConfig::default()
    });
    run(&mut plant, f64::NAN, 10);
    assert_eq!(plant.motor_position(), Position(0.0));
    run(&mut plant, f64::INFINITY, 100);
    assert!(plant.velocity().0.is_finite() && plant.encoder().0.is_finite());
}

/// A number that a configuration should not hold, or an extreme one that it may.
pub(crate) fn wild() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(f64::MAX),
        Just(f64::MIN_POSITIVE),
        Just(0.0),
        -1e7..1e7_f64,
        0.0..1.0_f64,
    ]
}

fn wild_load() -> impl Strategy<Value = Load> {
    [wild(), wild(), wild(), wild()].prop_map(|[inertia_kgm2, gravity_nm, viscous, coulomb]| Load {
        inertia_kgm2,
        gravity_nm,
        viscous_friction_nms: viscous,
        coulomb_friction_nm: coulomb,
    })
}

pub(crate) fn wild_config() -> impl Strategy<Value = PlantConfig> {
    let numbers = prop::collection::vec(wild(), 36);
    (numbers, wild_load(), any::<(u32, bool, u64)>()).prop_map(|(n, load, (counts, is_garbage, seed))| {
        let link = DcLink {
            resistance_ohm: n[0],
            capacitance_f: n[1],
            losses_at_rated_w: n[2],
            idle_w: n[3],
            chopper: Some(Voltage(n[4])),
        };
        let volts = [n[5], n[6], n[7]].map(Voltage);
        PlantConfig {
            counts_per_revolution: counts,
            rated_torque_nm: n[8],
            peak_torque: Torque(n[9]),
            motor_inertia_kgm2: n[10],
            viscous_friction_nms: n[11],
            coulomb_friction_nm: n[12],
            load,
            backlash: Position(n[13]),
            start: Position(n[14]),
            index: Position(n[15]),
            positive_switch: Some(Position(n[16])),
            negative_switch: Some(Position(n[17])),
            limit_switch_width: Some(Position(n[18])),
            home_switch: range(n[19], n[20]),
            probe_switches: [range(n[32], n[33]), range(n[34], n[35])],
            hysteresis: Position(n[21]),
            active_low: Inputs::default(),
            stops: range(n[22], n[23]),
            supply: Supply {
                voltage: volts[0],
                under_voltage: volts[1],
                over_voltage: volts[2],
                dc_link: Some(link),
            },
            ambient: Temperature(n[24]),
            thermal: Some(Thermal {
                rise_at_rated: n[25],
                time_constant_seconds: n[26],
                limit: Temperature(n[27]),
            }),
            overload: Some(Overload { rated: Torque(n[28]), seconds: n[29] }),
            noise: Noise { encoder: n[30], velocity: n[31], seed },
            encoder_break: if is_garbage { EncoderBreak::Garbage } else { EncoderBreak::Stuck },
            monitors_encoder: true,
            faults: vec![ScheduledFault {
                fault: PlantFault::SupplyDip(Voltage(n[0])),
                from_seconds: n[1],
                until_seconds: Some(n[2]),
            }],
        }
    })
}

/// Everything a plant shows, as bits.
fn shown(plant: &mut Plant) -> [u64; 8] {
    let latches = plant.take_latches();
    [
        plant.encoder().0,
        plant.velocity().0,
        plant.motor_position().0,
        plant.load_position().0,
        plant.supply().0,
        plant.temperature().0,
        plant.overload(),
        latches.index.or(latches.home).or(latches.positive_limit).unwrap_or_default().0,
    ]
    .map(f64::to_bits)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_the_configuration_every_number_is_finite(
        config in wild_config(),
        load in wild_load(),
        steps in prop::collection::vec((wild(), prop_oneof![Just(STEP), wild()]), 1..200),
    ) {
        let mut plant = Plant::new(config);
        for (number, (torque, seconds)) in steps.into_iter().enumerate() {
            plant.step(Torque(torque), seconds);
            if number == 50 {
                plant.set_load(load);
                plant.inject(PlantFault::EncoderBreak);
            }
            let shown = shown(&mut plant).map(f64::from_bits);
            prop_assert!(shown.into_iter().all(f64::is_finite), "{shown:?}");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_bits(
        seed in any::<u64>(),
        torques in prop::collection::vec(-3000.0..3000.0_f64, 1..50),
    ) {
        let trace = |seed| {
            let noise = Noise { encoder: 3.0, velocity: 100.0, seed };
            let mut plant = Plant::new(PlantConfig {
                noise,
                backlash: Position(30.0),
                supply: Supply { dc_link: Some(DcLink::default()), ..Supply::default() },
                thermal: Some(Thermal::default()),
                overload: Some(Overload::default()),
                home_switch: range(-500.0, 500.0),
                ..PlantConfig::default()
            });
            let step = |torque: &f64| {
                run(&mut plant, *torque, 20);
                shown(&mut plant)
            };
            torques.iter().map(step).collect::<Vec<_>>()
        };
        prop_assert_eq!(trace(seed), trace(seed));
        prop_assert_ne!(trace(seed), trace(seed ^ 1));
    }
}
