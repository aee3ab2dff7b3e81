use proptest::prelude::*;

use super::*;
use crate::units::Acceleration;

const STEP: f64 = 125e-6;

fn run(mechanics: &mut Mechanics, torque: f64, steps: u32) {
    (0..steps).for_each(|_| mechanics.step(Torque(torque), STEP));
}

fn loose(backlash: f64, load: Load) -> Mechanics {
    Mechanics::new(&PlantConfig { backlash: Position(backlash), load, ..PlantConfig::default() })
}

#[test]
fn torque_below_the_friction_moves_nothing() {
    let mut mechanics = Mechanics::new(&PlantConfig::default());
    run(&mut mechanics, 23.0, 1000);
    assert_eq!(mechanics.velocity().to_bits(), 0);
    run(&mut mechanics, 24.0, 1000);
    assert!(mechanics.velocity() > 0.0);
}

#[test]
fn friction_of_motor_and_load_add_up_also_across_a_closed_gap() {
    let load = Load { coulomb_friction_nm: 0.1, ..Load::default() };
    for backlash in [0.0, 50.0] {
        let mut mechanics = loose(backlash, load);
        run(&mut mechanics, 100.0, 16_000);
        assert_eq!(mechanics.velocity().to_bits(), 0, "{backlash}");
        assert!((mechanics.gap() - backlash / 2.0).abs() < 1e-9);
        run(&mut mechanics, 105.0, 1000);
        assert!(mechanics.velocity() > 0.0, "{backlash}");
    }
}

#[test]
fn rated_torque_accelerates_the_inertia() {
    let config =
        PlantConfig { coulomb_friction_nm: 0.0, viscous_friction_nms: 0.0, ..PlantConfig::default() };
    let mut mechanics = Mechanics::new(&config);
    run(&mut mechanics, 1000.0, 80);
    let expected = 1.27 / 1.3e-4 / TAU * 8192.0 * 0.01;
    assert!((mechanics.velocity() - expected).abs() < 1e-6 * expected);
    assert!((mechanics.torque_for(expected * 100.0, 0.0).0 - 1000.0).abs() < 1e-6);
}

#[test]
fn coasting_slows_down_by_friction_only_and_ends_at_rest() {
    let mut mechanics = Mechanics::new(&PlantConfig::default());
    run(&mut mechanics, 500.0, 800);
    let mut last = mechanics.velocity();
    let coulomb = 0.03 / 1.3e-4 / TAU * 8192.0 * STEP;
    while last > 0.0 {
        run(&mut mechanics, 0.0, 1);
        let lost = last - mechanics.velocity();
        let viscous = last * 1e-4 / 1.3e-4 * STEP;
        assert!(lost > 0.0 && lost <= coulomb + viscous + 1e-9);
        last = mechanics.velocity();
    }
    let rest = mechanics.position();
    run(&mut mechanics, 0.0, 100);
    assert_eq!(mechanics.position().to_bits(), rest.to_bits());
}

#[test]
fn gravity_pulls_a_load_that_nothing_holds_and_no_other() {
    let with_gravity = |gravity_nm, coulomb_friction_nm| {
        loose(0.0, Load { gravity_nm, coulomb_friction_nm, ..Load::default() })
    };
    let mut held = with_gravity(-0.5, 0.48);
    run(&mut held, 0.0, 1000);
    assert_eq!(held.position().to_bits(), 0);
    let mut falling = with_gravity(-0.5, 0.0);
    run(&mut falling, 0.0, 80);
    let speed = 0.47 / 1.3e-4 / TAU * 8192.0 * 0.01;
    assert!((falling.velocity() + speed).abs() < 0.01 * speed, "{}", falling.velocity());
}

#[test]
fn the_motor_turns_alone_through_the_backlash() {
    let mut mechanics = loose(100.0, Load { coulomb_friction_nm: 0.01, ..Load::default() });
    run(&mut mechanics, 100.0, 2000);
    run(&mut mechanics, 0.0, 20_000);
    let load = mechanics.load_position();
    assert!(mechanics.is_at_rest());
    mechanics.position -= mechanics.gap - 50.0;
    mechanics.gap = 50.0;
    let start = mechanics.position();
    while mechanics.gap() > -50.0 {
        run(&mut mechanics, -30.0, 1);
        assert!(mechanics.gap() <= -50.0 || (mechanics.load_position() - load).abs() < 1e-6);
    }
    assert!((start - mechanics.position() - 100.0).abs() < 5.0, "{}", mechanics.position());
}

#[test]
fn a_load_on_a_hard_stop_leaves_the_motor_its_backlash() {
    let stops = PositionRange::new(Position(-1000.0), Position(1000.0));
    let config = PlantConfig { backlash: Position(40.0), stops, ..PlantConfig::default() };
    let mut mechanics = Mechanics::new(&config);
    run(&mut mechanics, 200.0, 4000);
    assert_eq!((mechanics.load_position(), mechanics.position()), (1000.0, 1020.0));
    assert!(mechanics.velocity() == 0.0 && mechanics.is_at_rest());
    run(&mut mechanics, -200.0, 4000);
    assert_eq!((mechanics.load_position(), mechanics.position()), (-1000.0, -1020.0));
}

#[test]
fn a_blocked_shaft_stands_whatever_the_torque() {
    let mut mechanics = Mechanics::new(&PlantConfig::default());
    run(&mut mechanics, 500.0, 800);
    let place = mechanics.position();
    mechanics.set_blocked(true);
    run(&mut mechanics, 3000.0, 100);
    assert_eq!((mechanics.position(), mechanics.velocity()), (place, 0.0));
    mechanics.set_blocked(false);
    run(&mut mechanics, 500.0, 100);
    assert!(mechanics.position() > place);
}

#[test]
fn another_load_is_another_acceleration_at_the_same_velocity() {
    let mut mechanics = Mechanics::new(&PlantConfig::default());
    run(&mut mechanics, 500.0, 80);
    let before = mechanics.velocity();
    mechanics.set_load(&Load { inertia_kgm2: 1.0e-3, ..Load::default() });
    assert_eq!(mechanics.velocity().to_bits(), before.to_bits());
    run(&mut mechanics, 500.0, 80);
    let (light, heavy) = (before, mechanics.velocity() - before);
    assert!((light / heavy / (1.03 / 0.13) - 1.0).abs() < 0.02, "{light} {heavy}");
}

fn masses() -> impl Strategy<Value = PlantConfig> {
    let load = (0.0..1e-3_f64, prop_oneof![Just(0.0), -1.0..1.0_f64], 0.0..1e-3_f64, 0.0..0.2_f64).prop_map(
        |(inertia_kgm2, gravity_nm, viscous_friction_nms, coulomb_friction_nm)| Load {
            inertia_kgm2,
            gravity_nm,
            viscous_friction_nms,
            coulomb_friction_nm,
        },
    );
    let motor = (1e-6..1e-3_f64, 0.0..1e-3_f64, 0.0..0.2_f64);
    (load, motor, prop_oneof![Just(0.0), 0.5..500.0_f64]).prop_map(
        |(load, (motor_inertia_kgm2, viscous_friction_nms, coulomb_friction_nm), backlash)| PlantConfig {
            motor_inertia_kgm2,
            viscous_friction_nms,
            coulomb_friction_nm,
            load,
            backlash: Position(backlash),
            stops: PositionRange::new(Position(-20_000.0), Position(20_000.0)),
            ..PlantConfig::default()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn without_torque_only_gravity_adds_energy(
        config in masses(),
        torques in prop::collection::vec(-3000.0..3000.0_f64, 1..10),
    ) {
        let mut mechanics = Mechanics::new(&config);
        torques.iter().for_each(|torque| run(&mut mechanics, *torque, 40));
        mechanics.set_load(&Load { gravity_nm: 0.0, ..config.load });
        let mut last = mechanics.energy();
        for _ in 0..2000 {
            run(&mut mechanics, 0.0, 1);
            let now = mechanics.energy();
            prop_assert!(now <= last * (1.0 + 1e-9), "{last} {now}");
            last = now;
        }
    }

    #[test]
    fn no_torque_drives_the_load_beyond_a_stop_or_the_gap_beyond_the_backlash(
        config in masses(),
        torques in prop::collection::vec((-3000.0..3000.0_f64, 1..2000_u32), 1..10),
    ) {
        let mut mechanics = Mechanics::new(&config);
        for (torque, steps) in torques {
            for _ in 0..steps {
                run(&mut mechanics, torque, 1);
                prop_assert!(mechanics.load_position().abs() <= 20_000.0 + 1e-9);
                prop_assert!(mechanics.gap().abs() <= config.backlash.0 / 2.0 + 1e-9);
            }
        }
    }

    #[test]
    fn coasting_against_friction_ends_at_rest_and_stays_there(
        config in masses(),
        torque in -3000.0..3000.0_f64,
    ) {
        let config = PlantConfig { coulomb_friction_nm: 0.05, ..config };
        let load = Load { gravity_nm: 0.0, coulomb_friction_nm: 0.05, ..config.load };
        let mut mechanics = Mechanics::new(&PlantConfig { load, ..config });
        run(&mut mechanics, torque, 400);
        let fastest = mechanics.velocity().abs() + mechanics.load_velocity.abs();
        let inertia = config.motor_inertia_kgm2 + load.inertia_kgm2;
        let deceleration = 0.05 / inertia * mechanics.counts_per_radian;
        run(&mut mechanics, 0.0, (4.0 * fastest / deceleration / STEP) as u32 + 10_000);
        prop_assert!(mechanics.is_at_rest(), "{mechanics:?}");
        let rest = mechanics.position().to_bits();
        run(&mut mechanics, 0.0, 100);
        prop_assert_eq!(mechanics.position().to_bits(), rest);
    }

    #[test]
    fn with_a_load_a_torque_and_a_velocity_the_acceleration_is_what_the_controller_asked_for(
        config in masses(),
        acceleration in 1e5..1e6_f64,
    ) {
        // A step must be short beside the viscous friction, and the acceleration more than what it misjudges then.
        let inertia = config.motor_inertia_kgm2 + config.load.inertia_kgm2;
        let most = 0.01 * inertia / STEP;
        let coulomb_nm = config.coulomb_friction_nm + config.load.coulomb_friction_nm;
        let coulomb = coulomb_nm / inertia * f64::from(config.counts_per_revolution) / TAU;
        let acceleration = acceleration.max(0.4 * coulomb);
        let config = PlantConfig {
            load: Load {
                gravity_nm: 0.0,
                viscous_friction_nms: config.load.viscous_friction_nms.min(most),
                ..config.load
            },
            viscous_friction_nms: config.viscous_friction_nms.min(most),
            backlash: Position(0.0),
            peak_torque: Torque(1e6),
            ..config
        };
        let mut mechanics = Mechanics::new(&config);
        for _ in 0..40 {
            let torque = mechanics.torque_for(acceleration, mechanics.velocity().max(1e-9));
            mechanics.step(torque, STEP);
        }
        let reached = Acceleration(mechanics.velocity() / (40.0 * STEP));
        prop_assert!((reached.0 / acceleration - 1.0).abs() < 0.15, "{reached:?} {acceleration}");
    }
}
