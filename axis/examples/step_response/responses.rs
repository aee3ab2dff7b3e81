//! What is drawn: the answers of controllers and generators, computed step by step.

use axis::{
    Acceleration, Coefficients, Generator, Goal, Limits, Period, Position, PositionController, Profile,
    Velocity,
};

use crate::chart::{Chart, Panel, Series};

/// All pictures with the names of their files.
pub(crate) fn pictures() -> Vec<(&'static str, Chart)> {
    vec![
        ("position-controller-gain-20", response("K = 20, A = 0.5, B = 0, C = 41/2048", GAIN_20)),
        ("position-controller-gain-50", response("K = 50, A = 253/256, B = 0, C = 13/256", GAIN_50)),
        ("trapezoids", trapezoids()),
    ]
}

/// MACCON MAC4 User Manual, section 7.2, example of the MAC4-INC.
const GAIN_20: Coefficients = Coefficients { gain: 80, zero: 128, pole: 0, integral: 41, integral_shift: 3 };

/// MACCON MAC4 User Manual, section 7.2, example of the MAC4-SSI.
const GAIN_50: Coefficients = Coefficients { gain: 200, zero: 253, pole: 0, integral: 13, integral_shift: 0 };

/// The sampling period of the MAC4-INC and MAC4-SSI (MACCON MAC4 User Manual, section 7.4).
const SAMPLING_SECONDS: f64 = 0.0025;

/// A motor on a velocity amplifier: a first-order lag with an integrator behind it.
#[derive(Default)]
struct VelocityDrive {
    velocity: f64,
    position: f64,
}

impl VelocityDrive {
    /// Velocity per converter count, in counts/s.
    const GAIN: f64 = 6.0;
    /// Time constant of the velocity loop.
    const LAG_SECONDS: f64 = 0.01;

    fn step(&mut self, output: f64) {
        self.velocity += (Self::GAIN * output - self.velocity) * (SAMPLING_SECONDS / Self::LAG_SECONDS);
        self.position += self.velocity * SAMPLING_SECONDS;
    }

    /// What the encoder shows.
    fn count(&self) -> i64 {
        self.position.floor() as i64
    }
}

/// The answer to a step of the demand and, half-way, of an offset of the amplifier.
fn response(coefficients: &str, values: Coefficients) -> Chart {
    const STEP: i64 = 1000;
    const OFFSET: f64 = 200.0;
    const PERIODS: u32 = 800;
    let (mut controller, mut drive) = (PositionController::new(values), VelocityDrive::default());
    let (mut demands, mut positions, mut outputs) = (Vec::new(), Vec::new(), Vec::new());
    for period in 0..PERIODS {
        let time = f64::from(period) * SAMPLING_SECONDS;
        let demand = if period < PERIODS / 40 { 0 } else { STEP };
        let output = controller.step(demand - drive.count());
        demands.push((time, demand as f64));
        positions.push((time, drive.count() as f64));
        outputs.push((time, f64::from(output)));
        drive.step(f64::from(output) + if period < PERIODS / 2 { 0.0 } else { OFFSET });
    }
    Chart {
        title: format!("Position controller, {coefficients}"),
        x_label: "s".to_owned(),
        panels: vec![
            panel("Position, counts", vec![series("demanded", demands), series("actual", positions)]),
            panel("Output, converter counts", vec![series("output", outputs)]),
        ],
    }
}

/// A long and a short move, and one whose target is drawn nearer on the way.
fn trapezoids() -> Chart {
    let moves =
        [("trapezoid", 8000.0, None), ("triangle", 2000.0, None), ("on the fly", 8000.0, Some(3000.0))];
    let runs = moves.map(|(name, target, then)| (name, run(target, then)));
    let of = |value: fn(&Point) -> f64| {
        let line = |(name, points): &(&str, Vec<Point>)| {
            series(name, points.iter().map(|point| (point.time, value(point))).collect())
        };
        runs.iter().map(line).collect()
    };
    Chart {
        title: "Generator, 10 ms raster".to_owned(),
        x_label: "s".to_owned(),
        panels: vec![
            panel("Velocity, counts/s", of(|point| point.velocity)),
            panel("Position, counts", of(|point| point.position)),
        ],
    }
}

/// A set-point at its time.
struct Point {
    time: f64,
    velocity: f64,
    position: f64,
}

/// A move to `target`, which becomes `then` after 0.6 s.
fn run(target: f64, then: Option<f64>) -> Vec<Point> {
    const STEPS: u32 = 200;
    const RASTER_NANOS: u64 = 10_000_000;
    let period = Period::from_nanos(RASTER_NANOS).unwrap_or(Period::MILLISECOND);
    let profile = Profile {
        velocity: Velocity(8000.0),
        acceleration: Acceleration(20_000.0),
        deceleration: Acceleration(16_000.0),
        jerk: None,
    };
    let mut generator = Generator::new(period, Limits::default());
    let go_on = |step: u32| {
        let time = f64::from(step) * period.seconds();
        match (step, then) {
            (0, _) => generator.command(Goal::MoveTo(Position(target)), profile),
            (60, Some(then)) => generator.command(Goal::MoveTo(Position(then)), profile),
            _ => {}
        }
        let now = *generator.set_point();
        generator.step();
        Point { time, velocity: now.velocity.0, position: now.position.0 }
    };
    (0..STEPS).map(go_on).collect()
}

fn panel(label: &str, series: Vec<Series>) -> Panel {
    Panel { label: label.to_owned(), series }
}

fn series(name: &str, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.to_owned(), points }
}
