//! The simulated drive on every shipped motor: its default tuning is stable with any sensible load.

use axis::{
    Command, Demand, Drive, DriveState, Feedback, Load, Period, PlantConfig, Position, ServoConfig, SetPoint,
    SimulatedServo, Torque, TorqueLimit, Velocity,
};
use profiles::{Dialect, Motor, MotorKind, Profile};

const RATIOS: [f64; 6] = [0.0, 0.5, 1.0, 2.0, 5.0, 10.0];

/// The servo motors: a stepper is driven otherwise, and one on a controller card is tuned by its parameters.
fn shipped_motors() -> Vec<Motor> {
    let shipped = |name, motor: Option<&str>| Profile::embedded(name, motor).unwrap().unwrap();
    let named = |name| shipped(name, None).motors.into_iter().map(move |motor| shipped(name, Some(&motor)));
    let is_tuned = |profile: &Profile| !matches!(profile.dialect, Dialect::Mac4(_));
    let motors = Profile::names().flat_map(named).filter(is_tuned).filter_map(|profile| profile.motor);
    motors.filter(|motor| matches!(motor.kind, MotorKind::Servo)).collect()
}

/// The motor with a load of `ratio` times its inertia, gravity and backlash; friction as devices have it.
fn plant(motor: &Motor, ratio: f64, gravity: f64, backlash: f64) -> PlantConfig {
    let load = Load {
        inertia_kgm2: ratio * motor.rotor_inertia_kg_m2,
        gravity_nm: gravity * motor.rated_torque_nm,
        ..Load::default()
    };
    PlantConfig {
        counts_per_revolution: motor.counts_per_revolution,
        rated_torque_nm: motor.rated_torque_nm,
        peak_torque: Torque(1000.0 * motor.peak_torque_factor),
        motor_inertia_kgm2: motor.rotor_inertia_kg_m2,
        coulomb_friction_nm: motor.rated_torque_nm / 100.0,
        viscous_friction_nms: motor.rated_torque_nm / 100_000.0,
        load,
        backlash: Position(backlash),
        ..PlantConfig::default()
    }
}

/// An enabled drive that has settled at 0.
fn settled(motor: &Motor, plant: PlantConfig) -> SimulatedServo {
    let period = Period::from_nanos(motor.raster_ns).unwrap();
    let mut servo = SimulatedServo::new(period, ServoConfig { plant, ..ServoConfig::default() });
    let rest = (0..1000).map(|_| follow(&mut servo, SetPoint::default())).last().unwrap();
    assert_eq!(rest.state, DriveState::Enabled);
    assert!(rest.position.abs() <= Position(1.0), "{}: {rest:?}", motor.name);
    servo
}

fn follow(servo: &mut SimulatedServo, set_point: SetPoint) -> Feedback {
    servo.step(&Command {
        enable: true,
        demand: Demand::Position(set_point),
        torque_limit: TorqueLimit::both(Torque(3000.0)),
        ..Command::default()
    })
}

#[test]
fn a_jump_of_the_set_point_settles_on_every_motor_with_every_load() {
    let motors = shipped_motors();
    assert!(motors.len() >= 9);
    for motor in &motors {
        for ratio in RATIOS {
            for (gravity, backlash) in [(0.0, 0.0), (-0.4, 0.0), (0.0, 30.0), (0.2, 30.0)] {
                let mut servo = settled(motor, plant(motor, ratio, gravity, backlash));
                let target = SetPoint { position: Position(100.0), ..SetPoint::default() };
                let places: Vec<_> = (0..1000).map(|_| follow(&mut servo, target).position.0).collect();
                let (moving, resting) = places.split_at(500);
                let case = format!("{} {ratio} {gravity} {backlash}", motor.name);
                assert!(moving.iter().all(|place| (-1.0..=110.0).contains(place)), "{case}: {places:?}");
                assert!(resting.iter().all(|place| (99.0..=101.0).contains(place)), "{case}: {places:?}");
            }
        }
    }
}

#[test]
fn every_motor_reaches_its_highest_speed_with_every_load() {
    for motor in &shipped_motors() {
        let seconds = Period::from_nanos(motor.raster_ns).unwrap().seconds();
        let counts = f64::from(motor.counts_per_revolution);
        let highest = f64::from(motor.max_speed_rpm) / 60.0 * counts;
        for ratio in RATIOS {
            let inertia = (1.0 + ratio) * motor.rotor_inertia_kg_m2;
            let rated = motor.rated_torque_nm / inertia / core::f64::consts::TAU * counts;
            let steps = (highest / (0.8 * rated) / seconds).ceil();
            let acceleration = highest / (steps * seconds);
            let mut servo = settled(motor, plant(motor, ratio, 0.0, 0.0));
            let mut demand = SetPoint::default();
            let (mut actual, mut worst) = (Feedback::default(), 0.0_f64);
            for step in 0..steps as u32 + 500 {
                demand.acceleration.0 = if f64::from(step) < steps { acceleration } else { 0.0 };
                demand.position.0 += (demand.velocity.0 + demand.acceleration.0 * seconds / 2.0) * seconds;
                demand.velocity.0 += demand.acceleration.0 * seconds;
                actual = follow(&mut servo, demand);
                worst = worst.max((actual.position - demand.position).0.abs());
            }
            let short = Velocity(highest) - actual.velocity;
            let case = format!("{} {ratio}: {worst}", motor.name);
            assert!(short.abs().0 < 0.01 * highest && worst <= 3.0, "{case}");
        }
    }
}
