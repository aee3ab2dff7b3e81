//! What one raster step of each kind of axis costs, on the move and with everything that belongs to it: generator,
//! limits, controller, measurement and plant. `cargo bench -p axis`.

use std::hint::black_box;
use std::num::NonZeroU32;

use axis::{
    Acceleration, AnalogConfig, AnalogDrive, Axis, Coding, Creep, Drive, Jerk, Limits, Order, Period,
    Position, Profile, Scale, SensorConfig, ServoConfig, SimulatedServo, StepConfig, StepDrive, StepFeedback,
    Stepping, Travel, Turn, Velocity,
};
use criterion::{Criterion, criterion_group, criterion_main};

const PROFILE: Profile = Profile {
    velocity: Velocity(20_000.0),
    acceleration: Acceleration(200_000.0),
    deceleration: Acceleration(200_000.0),
    jerk: None,
};

/// An axis with power.
fn enabled(nanos: u64, cycle: u32, drive: impl FnOnce(Period) -> Box<dyn Drive>) -> Axis {
    let period = Period::from_nanos(nanos).unwrap_or(Period::MILLISECOND);
    let cycle = NonZeroU32::new(cycle).unwrap_or(NonZeroU32::MIN);
    let mut axis = Axis::with_generator_cycle(period, cycle, Limits::default(), drive(period));
    axis.power_on();
    (0..20).for_each(|_| axis.step());
    axis
}

fn servo(nanos: u64) -> Axis {
    enabled(nanos, 1, |period| Box::new(SimulatedServo::new(period, ServoConfig::default())))
}

fn analog(config: AnalogConfig) -> Axis {
    enabled(2_500_000, 4, |period| Box::new(AnalogDrive::new(period, config)))
}

fn stepper(config: StepConfig) -> Axis {
    let mut axis = enabled(8_000_000, 4, |period| Box::new(StepDrive::new(period, config)));
    let creep = Some(Creep { distance: Position(20.0), velocity: Velocity(200.0) });
    axis.set_stepping(Some(Stepping { start_stop: Velocity(400.0), creep }));
    axis
}

fn circular(mut axis: Axis) -> Axis {
    axis.set_travel(Turn::new(Position(36_000.0)).map_or(Travel::Linear, Travel::CircularOptimised));
    axis
}

/// Moves back and forth for ever.
fn measure(criterion: &mut Criterion, name: &str, mut axis: Axis, profile: Profile) {
    let mut target = 20_000.0;
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| {
            if axis.status().done {
                target = 25_000.0 - target;
                axis.order(Order::MoveTo(Position(target), profile));
            }
            axis.step();
            black_box(axis.status().actual.position)
        });
    });
}

fn axis_step(criterion: &mut Criterion) {
    let jerk = Some(Jerk(2e6));
    measure(criterion, "servo, 1 ms, trapezoid", servo(1_000_000), PROFILE);
    measure(criterion, "servo, 1 ms, limited jerk", servo(1_000_000), Profile { jerk, ..PROFILE });
    measure(criterion, "servo, 250 us, trapezoid", servo(250_000), PROFILE);
    measure(criterion, "servo, 1 ms, circular", circular(servo(1_000_000)), PROFILE);
    measure(criterion, "analogue, encoder, 2.5 ms", analog(AnalogConfig::default()), PROFILE);
    let sensor = SensorConfig::ssi(24, 2, Coding::Gray);
    measure(
        criterion,
        "analogue, SSI, 2.5 ms",
        analog(AnalogConfig { sensor, ..AnalogConfig::default() }),
        PROFILE,
    );
    measure(criterion, "stepper, counter, 8 ms", stepper(StepConfig::default()), PROFILE);
    let scale = Scale::of_encoder(2048, 3200).unwrap_or(Scale::ONE);
    let feedback = StepFeedback::Encoder { sensor: SensorConfig::incremental(16), scale };
    measure(
        criterion,
        "stepper, encoder, 8 ms",
        stepper(StepConfig { feedback, ..StepConfig::default() }),
        PROFILE,
    );
}

criterion_group!(benches, axis_step);
criterion_main!(benches);
