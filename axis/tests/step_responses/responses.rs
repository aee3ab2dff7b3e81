//! What is drawn: the answers of the simulated drives and of the generator, computed step by step.

use std::num::NonZeroU32;

use axis::{
    Acceleration, AnalogConfig, AnalogDrive, Axis, Coefficients, Command, Creep, Demand, Drive, Feedback,
    Generator, Goal, Jerk, Limits, Load, Order, Period, Position, Profile, ServoConfig, SetPoint,
    SimulatedServo, StepConfig, StepDrive, Stepping, Torque, TorqueLimit, Velocity,
};

use crate::chart::{Chart, Panel, Series};

/// All pictures with the names of their files.
pub(crate) fn pictures() -> Vec<(&'static str, Chart)> {
    vec![
        ("analogue-default", analogue("K = 0.5, A = 0.5, B = 0, C = 1/256", AnalogConfig::default())),
        ("analogue-proportional", analogue("K = 0.75, A = 0, B = 0, C = 0", proportional())),
        ("servo", servo()),
        ("stepper-creep", stepper()),
        ("limited-jerk", limited_jerk()),
        ("trapezoids", trapezoids()),
    ]
}

/// How long a response is looked at: the demand steps after the first part, the load comes half-way.
struct Span {
    period: Period,
    steps: u32,
}

const MILLISECOND: Span = Span { period: Period::MILLISECOND, steps: 400 };

/// A weight that is hung on the motor: a third of its rated torque.
const WEIGHT_NM: f64 = 0.4;

/// The controller without its memory and its integral part.
fn proportional() -> AnalogConfig {
    let coefficients = Coefficients { gain: 3, zero: 0, pole: 0, integral: 0, integral_shift: 0 };
    AnalogConfig { coefficients, ..AnalogConfig::default() }
}

/// The answer of an analogue drive, with the sampling period of the MAC4-INC (MACCON MAC4 User Manual, section 7.4).
fn analogue(coefficients: &str, config: AnalogConfig) -> Chart {
    let span = Span { period: period(2_500_000), steps: 400 };
    let mut drive = AnalogDrive::new(span.period, config);
    let answers = respond(&mut drive, &span, |drive| f64::from(drive.output()));
    let output = line("output", &answers, |point| point.output);
    let mut panels = positions_and_torque(&answers);
    panels.insert(1, panel("Output, converter counts", vec![output]));
    chart(format!("Analogue drive, 2.5 ms, {coefficients}"), panels)
}

fn servo() -> Chart {
    let mut drive =
        SimulatedServo::new(MILLISECOND.period, ServoConfig { enabling_steps: 0, ..ServoConfig::default() });
    let answers = respond(&mut drive, &MILLISECOND, |_| 0.0);
    chart("Servo drive, 1 ms".to_owned(), positions_and_torque(&answers))
}

/// The answer of a drive to a step of the demand and then to a weight on its shaft.
fn respond<D: Drive>(drive: &mut D, span: &Span, output: impl Fn(&D) -> f64) -> Vec<Point> {
    const STEP: f64 = 500.0;
    let step = |number: u32| {
        if number == span.steps / 2
            && let Some(plant) = drive.plant()
        {
            plant.set_load(Load { gravity_nm: WEIGHT_NM, ..Load::default() });
        }
        let demand = if number < span.steps / 20 { 0.0 } else { STEP };
        let Feedback { position, torque, .. } = drive.step(&command(Position(demand)));
        let seconds = f64::from(number) * span.period.seconds();
        let (actual, output) = (position.0, output(drive));
        Point { seconds, position: demand, actual, torque: torque.0, output, ..Point::default() }
    };
    (0..span.steps).map(step).collect()
}

fn command(position: Position) -> Command {
    Command {
        enable: true,
        demand: Demand::Position(SetPoint { position, ..SetPoint::default() }),
        torque_limit: TorqueLimit::both(Torque(3000.0)),
        ..Command::default()
    }
}

fn positions_and_torque(answers: &[Point]) -> Vec<Panel> {
    let demanded = line("demanded", answers, |point| point.position);
    let actual = line("actual", answers, |point| point.actual);
    let torque = line("torque", answers, |point| point.torque);
    vec![
        panel("Position, counts", vec![demanded, actual]),
        panel("Torque, per mille of rated torque", vec![torque]),
    ]
}

/// A move of a stepper that starts and stops in jumps and creeps to its end.
fn stepper() -> Chart {
    let period = period(8_000_000);
    let drive = Box::new(StepDrive::new(period, StepConfig::default()));
    let cycle = NonZeroU32::new(4).unwrap_or(NonZeroU32::MIN);
    let mut axis = Axis::with_generator_cycle(period, cycle, Limits::default(), drive);
    let creep = Some(Creep { distance: Position(60.0), velocity: Velocity(200.0) });
    axis.set_stepping(Some(Stepping { start_stop: Velocity(400.0), creep }));
    let profile = profile(4000.0, 10_000.0, None);
    let points = run_axis(&mut axis, Order::MoveTo(Position(3000.0), profile), 250);
    let lag = |point: &Point| point.position - point.actual * STEPS_PER_COUNT;
    let panels = vec![
        panel("Velocity, steps/s", vec![line("demanded", &points, |point| point.velocity)]),
        panel("Position, steps", vec![line("demanded", &points, |point| point.position)]),
        panel("Demanded position minus that of the rotor, steps", vec![line("lag", &points, lag)]),
    ];
    chart("Stepper, start/stop at 400 steps/s, creep of 60 steps at 200 steps/s".to_owned(), panels)
}

/// 3200 microsteps and 8192 counts a revolution.
const STEPS_PER_COUNT: f64 = 3200.0 / 8192.0;

/// The same move of a servo with and without a limit of jerk.
fn limited_jerk() -> Chart {
    let runs = [("trapezoid", None), ("limited jerk", Some(Jerk(2e7)))].map(|(name, jerk)| {
        let config = ServoConfig { enabling_steps: 0, ..ServoConfig::default() };
        let drive = Box::new(SimulatedServo::new(Period::MILLISECOND, config));
        let mut axis = Axis::new(Period::MILLISECOND, Limits::default(), drive);
        let order = Order::MoveTo(Position(20_000.0), profile(100_000.0, 1e6, jerk));
        (name, run_axis(&mut axis, order, 450))
    });
    let of = |value: fn(&Point) -> f64| runs.iter().map(|(name, points)| line(name, points, value)).collect();
    let panels = vec![
        panel("Velocity, counts/s", of(|point| point.velocity)),
        panel("Acceleration, counts/s²", of(|point| point.acceleration)),
        panel("Torque, per mille of rated torque", of(|point| point.torque)),
    ];
    chart("Servo axis, 1 ms: trapezoid, and jerk of 2·10⁷ counts/s³".to_owned(), panels)
}

/// A long and a short move, and one whose target is drawn nearer on the way.
fn trapezoids() -> Chart {
    let moves =
        [("trapezoid", 8000.0, None), ("triangle", 2000.0, None), ("on the fly", 8000.0, Some(3000.0))];
    let runs = moves.map(|(name, target, then)| (name, run_generator(target, then)));
    let of = |value: fn(&Point) -> f64| runs.iter().map(|(name, points)| line(name, points, value)).collect();
    let panels = vec![
        panel("Velocity, counts/s", of(|point| point.velocity)),
        panel("Position, counts", of(|point| point.position)),
    ];
    chart("Generator, 10 ms raster".to_owned(), panels)
}

/// A set-point at its time, and what came of it.
#[derive(Default)]
struct Point {
    seconds: f64,
    position: f64,
    velocity: f64,
    acceleration: f64,
    torque: f64,
    /// Place of the motor, in counts of its encoder.
    actual: f64,
    /// What a controller puts out.
    output: f64,
}

/// Switches an axis on and carries out one order.
fn run_axis(axis: &mut Axis, order: Order, steps: u32) -> Vec<Point> {
    axis.power_on();
    (0..5).for_each(|_| axis.step());
    axis.order(order);
    let go_on = |step: u32| {
        axis.step();
        let status = *axis.status();
        Point {
            seconds: f64::from(step) * axis.period().seconds(),
            position: status.demand.position.0,
            velocity: status.demand.velocity.0,
            acceleration: status.demand.acceleration.0,
            torque: status.actual.torque.0,
            actual: axis.plant().map_or(0.0, |plant| plant.motor_position().0),
            output: 0.0,
        }
    };
    (0..steps).map(go_on).collect()
}

/// A move of a generator to `target`, which becomes `then` after 0.6 s.
fn run_generator(target: f64, then: Option<f64>) -> Vec<Point> {
    const STEPS: u32 = 200;
    let period = period(10_000_000);
    let profile = Profile { deceleration: Acceleration(16_000.0), ..profile(8000.0, 20_000.0, None) };
    let mut generator = Generator::new(period, Limits::default());
    let go_on = |step: u32| {
        let seconds = f64::from(step) * period.seconds();
        match (step, then) {
            (0, _) => generator.command(Goal::MoveTo(Position(target)), profile),
            (60, Some(then)) => generator.command(Goal::MoveTo(Position(then)), profile),
            _ => {}
        }
        let now = *generator.set_point();
        generator.step();
        Point { seconds, velocity: now.velocity.0, position: now.position.0, ..Point::default() }
    };
    (0..STEPS).map(go_on).collect()
}

fn profile(velocity: f64, ramp: f64, jerk: Option<Jerk>) -> Profile {
    let (acceleration, deceleration) = (Acceleration(ramp), Acceleration(ramp));
    Profile { velocity: Velocity(velocity), acceleration, deceleration, jerk }
}

fn period(nanos: u64) -> Period {
    Period::from_nanos(nanos).unwrap_or(Period::MILLISECOND)
}

fn chart(title: String, panels: Vec<Panel>) -> Chart {
    Chart { title, x_label: "s".to_owned(), panels }
}

fn panel(label: &str, series: Vec<Series>) -> Panel {
    Panel { label: label.to_owned(), series }
}

fn line(name: &str, points: &[Point], value: impl Fn(&Point) -> f64) -> Series {
    let points = points.iter().map(|point| (point.seconds, value(point))).collect();
    Series { name: name.to_owned(), points }
}
