//! Measures what one raster step of 1 ms costs: `cargo run --release -p axis --example step_time`.

use std::time::Instant;

use axis::{
    Command, DcLink, Drive, Noise, Overload, Period, PlantConfig, Position, ServoConfig, SetPoint,
    SimulatedServo, Supply, Thermal, Torque, Velocity,
};

const BATCHES: u32 = 500;
const STEPS: u32 = 5_000;

/// Nanoseconds per step of a drive that runs at 100 000 counts/s, in the batch that was disturbed least.
fn nanos_per_step(config: ServoConfig) -> f64 {
    let mut servo = SimulatedServo::new(Period::MILLISECOND, config);
    let set_point = SetPoint { velocity: Velocity(100_000.0), ..SetPoint::default() };
    let mut command = Command { enable: true, set_point, torque_limit: Torque(3000.0), reset_fault: false };
    let mut batch = || {
        let start = Instant::now();
        for _ in 0..STEPS {
            let place = servo.step(&command).position;
            command.set_point.position = place + Position(100.0);
        }
        start.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS)
    };
    (0..BATCHES).map(|_| batch()).fold(f64::INFINITY, f64::min)
}

/// Everything that a plant may have.
fn everything() -> PlantConfig {
    PlantConfig {
        backlash: Position(10.0),
        supply: Supply { dc_link: Some(DcLink::default()), ..Supply::default() },
        thermal: Some(Thermal::default()),
        overload: Some(Overload::default()),
        noise: Noise { encoder: 1.0, velocity: 100.0, seed: 1 },
        ..PlantConfig::default()
    }
}

fn main() {
    let loose = PlantConfig { backlash: Position(10.0), ..PlantConfig::default() };
    for (name, plant) in [("default", PlantConfig::default()), ("backlash", loose), ("all", everything())] {
        let config = ServoConfig { plant, ..ServoConfig::default() };
        println!("{name:10} {:7.1} ns", nanos_per_step(config));
    }
}
