//! A hundred axes of all kinds, each with its own peculiarities.
#![allow(dead_code, reason = "each test uses a part of it")]

mod operator;

use std::num::NonZeroU32;

use axis::{
    Acceleration, AnalogConfig, AnalogDrive, Axis, BehindLimit, Coding, Creep, Drive, Guard, Jerk, Limits,
    Noise, Overload, Period, PlantConfig, Position, PositionRange, PowerDelays, Reaction, Scale,
    SensorConfig, ServoConfig, SimulatedServo, StepConfig, StepDrive, StepFeedback, Stepping, TargetWindow,
    Thermal, Travel, Turn, Velocity,
};

pub(crate) use operator::Operator;

/// What an axis is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A servo with this raster period in ns.
    Servo(u64),
    Incremental,
    Ssi,
    StepCounter,
    StepEncoder,
}

/// One axis of the fleet; all about it follows from kind and number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    pub(crate) kind: Kind,
    pub(crate) number: u32,
}

/// How fast and how far an axis goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size {
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
    pub(crate) way: f64,
}

const SERVO: Size = Size { velocity: 200_000.0, acceleration: 4e6, jerk: 2e8, way: 100_000.0 };
const ANALOG: Size = Size { velocity: 80_000.0, acceleration: 4e5, jerk: 2e7, way: 60_000.0 };
const STEPPER: Size = Size { velocity: 10_000.0, acceleration: 5e4, jerk: 5e5, way: 8_000.0 };

impl Member {
    /// The raster period.
    pub(crate) fn period(&self) -> Period {
        let nanos = match self.kind {
            Kind::Servo(nanos) => nanos,
            Kind::Incremental | Kind::Ssi => 2_500_000,
            Kind::StepCounter | Kind::StepEncoder => 8_000_000,
        };
        Period::from_nanos(nanos).unwrap()
    }

    pub(crate) fn size(&self) -> Size {
        match self.kind {
            Kind::Servo(_) => SERVO,
            Kind::Incremental | Kind::Ssi => ANALOG,
            Kind::StepCounter | Kind::StepEncoder => STEPPER,
        }
    }

    /// Who commands it.
    pub(crate) fn operator(&self) -> Operator {
        Operator::new(u64::from(self.number), self.size(), self.period())
    }

    /// The axis without power.
    pub(crate) fn axis(&self) -> Axis {
        let cycle = match self.kind {
            Kind::Servo(_) => NonZeroU32::MIN,
            Kind::Incremental | Kind::Ssi | Kind::StepCounter | Kind::StepEncoder => {
                NonZeroU32::new(4).unwrap()
            }
        };
        let mut axis = Axis::with_generator_cycle(self.period(), cycle, self.limits(), self.drive());
        axis.set_offset(Position(0.0 - self.start()));
        axis.set_travel(self.travel());
        axis.set_guard(self.guard());
        axis.set_following_error_limit(Some(Position(self.size().way / 4.0)));
        axis.set_power_delays(PowerDelays { on: self.number % 3, off: self.number % 5 });
        axis.set_target_window(self.is_even().then_some(TargetWindow { radius: Position(20.0), steps: 5 }));
        axis.set_stepping(self.stepping());
        axis
    }

    fn is_even(&self) -> bool {
        self.number.is_multiple_of(2)
    }

    fn is_stepper(&self) -> bool {
        matches!(self.kind, Kind::StepCounter | Kind::StepEncoder)
    }

    fn stepping(&self) -> Option<Stepping> {
        let creep = Creep { distance: Position(20.0), velocity: Velocity(200.0) };
        let creep = self.is_even().then_some(creep);
        self.is_stepper().then_some(Stepping { start_stop: Velocity(400.0), creep })
    }

    fn limits(&self) -> Limits {
        let Size { velocity, acceleration, jerk, way } = self.size();
        Limits {
            velocity: Velocity(velocity),
            acceleration: Acceleration(acceleration),
            jerk: (self.number % 5 == 2).then_some(Jerk(jerk)),
            position: PositionRange::new(Position(-way), Position(way)).filter(|_| self.is_even()),
            ..Limits::default()
        }
    }

    fn travel(&self) -> Travel {
        let turn = Turn::new(Position(36_000.0)).unwrap();
        match self.number % 3 {
            0 => Travel::Linear,
            1 => Travel::Circular(turn),
            _ => Travel::CircularOptimised(turn),
        }
    }

    fn guard(&self) -> Guard {
        let is_odd = !self.is_even();
        let reaction = if is_odd { Reaction::Brake } else { Reaction::Coast };
        Guard {
            behind_limit: if is_odd { BehindLimit::Open } else { BehindLimit::Closed },
            emergency_deceleration: Acceleration(self.size().acceleration / 2.0),
            following_error: reaction,
            drive_signal: reaction,
            supervision: reaction,
            ..Guard::default()
        }
    }

    /// Where the plant starts: in the middle of the range of an absolute encoder.
    fn start(&self) -> f64 {
        if self.kind == Kind::Ssi { 131_072.0 } else { 0.0 }
    }

    fn plant(&self) -> PlantConfig {
        let (way, number) = (self.size().way, self.number);
        let has_switches = number.is_multiple_of(3);
        let place = |share: f64| Position(self.start() + way * share);
        let end = |share: f64| has_switches.then_some(place(share));
        let noise = Noise { encoder: 1.5, velocity: 40.0, seed: u64::from(number) };
        PlantConfig {
            start: Position(self.start()),
            positive_switch: end(0.9),
            negative_switch: end(-0.9),
            limit_switch_width: number.is_multiple_of(6).then_some(Position(way / 50.0)),
            home_switch: PositionRange::new(place(0.1), place(0.12)),
            hysteresis: Position(3.0),
            stops: PositionRange::new(place(-1.5), place(1.5)).filter(|_| has_switches),
            backlash: Position(if number % 7 == 3 { 12.0 } else { 0.0 }),
            noise: if number % 4 == 1 { noise } else { Noise::default() },
            thermal: (number % 4 == 1).then(Thermal::default),
            overload: (number % 4 == 1).then(Overload::default),
            ..PlantConfig::default()
        }
    }

    fn drive(&self) -> Box<dyn Drive> {
        let (period, plant) = (self.period(), self.plant());
        match self.kind {
            Kind::Servo(_) => {
                Box::new(SimulatedServo::new(period, ServoConfig { plant, ..ServoConfig::default() }))
            }
            Kind::Incremental | Kind::Ssi => Box::new(AnalogDrive::new(period, self.analog(plant))),
            Kind::StepCounter | Kind::StepEncoder => Box::new(StepDrive::new(period, self.steps(plant))),
        }
    }

    fn analog(&self, plant: PlantConfig) -> AnalogConfig {
        let sensor = match self.number % 2 {
            _ if self.kind == Kind::Incremental => SensorConfig::incremental(16),
            0 => SensorConfig::ssi(24, 2, Coding::Gray),
            _ => SensorConfig::ssi(18, 0, Coding::Binary),
        };
        AnalogConfig { plant, sensor, enabling_steps: self.number % 4, ..AnalogConfig::default() }
    }

    fn steps(&self, plant: PlantConfig) -> StepConfig {
        let encoder = StepFeedback::Encoder {
            sensor: SensorConfig::incremental(16),
            scale: Scale::of_encoder(2048, 3200).unwrap(),
        };
        let standard = StepConfig::default();
        StepConfig {
            plant: PlantConfig { viscous_friction_nms: standard.plant.viscous_friction_nms, ..plant },
            feedback: if self.kind == Kind::StepEncoder { encoder } else { StepFeedback::Counter },
            turbo: self.number % 4 == 3,
            boost_lead_nanos: u64::from(self.number % 3) * 40_000_000,
            ..standard
        }
    }
}
