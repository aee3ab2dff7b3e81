//! A drive with an analogue input under a sampled position controller: what a controller card with ±10 V
//! outputs makes of an amplifier, a motor and an encoder (MACCON MAC4 User Manual, sections 2.2, 2.3, 5.16).

use crate::controller::{Coefficients, PositionController};
use crate::drive::{Capabilities, Command, Demand, Drive, DriveFault, Feedback, Setting, Signals};
use crate::inputs::Latches;
use crate::limits::TorqueLimit;
use crate::measurement::{Reader, Scale, SensorConfig, Source};
use crate::plant::{Amplifier, AmplifierConfig, AmplifierMode, Plant, PlantConfig};
use crate::power_stage::PowerStage;
use crate::units::{Period, Position, Torque, Velocity, Voltage, cut};

/// Longest step of the simulation, in ns.
const INNER_NANOS: u64 = 250_000;

/// Output of the converter at 10 V, in counts.
const FULL_SCALE: i32 = 2047;

/// What an analogue drive is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct AnalogConfig {
    /// The mechanics.
    pub plant: PlantConfig,
    /// The amplifier.
    pub amplifier: AmplifierConfig,
    /// The sensor; its increments are the counts of the plant.
    pub sensor: SensorConfig,
    /// The position controller.
    pub coefficients: Coefficients,
    /// Highest output of the controller, in counts of the converter: 0 to 2047.
    pub output_limit: i32,
    /// The output has the other sign, but for [`Demand::Output`].
    pub reversed: bool,
    /// Raster steps from the enable command to power on.
    pub enabling_steps: u32,
}

impl Default for AnalogConfig {
    /// The default plant behind a velocity amplifier of 50 rev/s at 10 V, a 16-bit counter of increments, and a
    /// controller of moderate gain that is stable at 2.5 ms.
    fn default() -> Self {
        Self {
            plant: PlantConfig::default(),
            amplifier: AmplifierConfig {
                mode: AmplifierMode::Velocity {
                    full_scale: Velocity(409_600.0),
                    time_constant_seconds: 0.002,
                },
                peak: Torque(3000.0),
            },
            sensor: SensorConfig::incremental(16),
            coefficients: Coefficients { gain: 2, zero: 128, pole: 0, integral: 1, integral_shift: 0 },
            output_limit: FULL_SCALE,
            reversed: false,
            enabling_steps: 0,
        }
    }
}

/// A simulated drive with an analogue input; the raster period is the sampling period of its controller.
#[derive(Clone, Debug)]
pub struct AnalogDrive {
    plant: Plant,
    amplifier: Amplifier,
    mode: AmplifierMode,
    reader: Reader,
    controller: PositionController,
    sign: i32,
    stage: PowerStage,
    inner_steps: u32,
    inner_seconds: f64,
    period_seconds: f64,
    /// Where to be at the beginning of this step.
    due: Position,
    steps: u64,
    position: Position,
    velocity: Velocity,
    torque: Torque,
    output: i32,
}

impl AnalogDrive {
    /// A drive stepped once every `period`, at rest and without power.
    #[must_use]
    pub fn new(period: Period, config: AnalogConfig) -> Self {
        let inner_steps = u32::try_from(period.nanos().div_ceil(INNER_NANOS)).unwrap_or(u32::MAX);
        let mut controller = PositionController::new(config.coefficients);
        controller.set_limit(config.output_limit);
        let mut new = Self {
            plant: Plant::new(config.plant),
            amplifier: Amplifier::new(config.amplifier),
            mode: config.amplifier.mode,
            reader: Reader::new(config.sensor, Source::Own(config.sensor, Scale::ONE)),
            controller,
            sign: if config.reversed { -1 } else { 1 },
            stage: PowerStage::new(config.enabling_steps),
            inner_steps,
            inner_seconds: period.seconds() / f64::from(inner_steps),
            period_seconds: period.seconds(),
            due: Position(0.0),
            steps: 0,
            position: Position(0.0),
            velocity: Velocity(0.0),
            torque: Torque(0.0),
            output: 0,
        };
        new.measure();
        new.velocity = Velocity(0.0);
        new
    }

    /// Output of the converter, in counts: ±2047 are ±10 V.
    #[must_use]
    pub fn output(&self) -> i32 {
        self.output
    }

    /// What goes to the converter.
    fn control(&mut self, command: &Command) -> i32 {
        let full_scale = f64::from(FULL_SCALE);
        let share = match (&command.demand, self.mode) {
            (Demand::Position(set_point), _) => {
                let error = (self.due - self.position).0;
                self.due = set_point.position;
                return self.sign * self.controller.step((error + 0.5).floor() as i64);
            }
            (Demand::Output(share), _) => *share,
            (Demand::Torque(torque), AmplifierMode::Torque { full_scale }) => {
                f64::from(self.sign) * torque.0 / full_scale.0
            }
            (Demand::Torque(_), AmplifierMode::Velocity { .. }) => 0.0,
        };
        self.controller.reset();
        self.due = self.position;
        (cut(share, 1.0) * full_scale) as i32
    }

    fn advance(&mut self, limit: TorqueLimit) {
        let input = Voltage(f64::from(self.output) * 10.0 / f64::from(FULL_SCALE));
        for _ in 0..self.inner_steps {
            self.torque = if self.stage.is_on() {
                limit.cut(self.amplifier.torque(input, &self.plant, self.inner_seconds))
            } else {
                Torque(0.0)
            };
            self.plant.step(self.torque, self.inner_seconds);
            if let Some(cause) = self.plant.fault() {
                self.stage.trip(cause);
            }
        }
    }

    /// Reads the sensor and, before its count goes on, the latches.
    fn measure(&mut self) -> Latches {
        let latches = self.reader.latches(self.plant.take_latches());
        match self.reader.read(self.plant.encoder()) {
            Ok(position) => {
                self.velocity = Velocity((position - self.position).0 / self.period_seconds);
                self.position = position;
            }
            Err(_) => self.stage.trip(DriveFault::Encoder),
        }
        latches
    }
}

impl Drive for AnalogDrive {
    fn step(&mut self, command: &Command) -> Feedback {
        self.steps = self.steps.wrapping_add(1);
        let is_powered = self.stage.is_on() && command.enable;
        if self.stage.switch(command, &self.plant) {
            self.controller.reset();
        }
        if is_powered {
            self.output = self.control(command);
        } else {
            self.output = 0;
            self.due = self.position;
        }
        self.advance(if is_powered { command.torque_limit } else { TorqueLimit::default() });
        let latches = self.measure();
        Feedback {
            step: self.steps,
            state: self.stage.state(),
            position: self.position,
            velocity: self.velocity,
            torque: self.torque,
            latches,
            ..self.plant.feedback()
        }
    }

    fn configure(&mut self, setting: Setting) {
        match setting {
            Setting::Coefficients(coefficients) => self.controller.set_coefficients(coefficients),
            Setting::OutputLimit(limit) => self.controller.set_limit(limit),
            Setting::Reversed(reversed) => self.sign = if reversed { -1 } else { 1 },
            Setting::Source(source) => {
                self.reader.set_source(source);
                self.measure();
                self.velocity = Velocity(0.0);
                self.due = self.position;
            }
            Setting::Word(word) => self.reader.supply(word),
            Setting::Turbo(_) | Setting::BoostLead(_) => {}
        }
    }

    fn signals(&self) -> Signals {
        Signals {
            place: self.position,
            word: self.reader.word(),
            count: self.reader.count(),
            output: self.output,
            ..Signals::default()
        }
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities {
            sleeps: self.plant.is_settled() && !self.reader.is_pending(),
            ..Capabilities::default()
        }
    }

    fn rest(&mut self, seconds: f64) {
        self.plant.rest(seconds);
    }

    fn plant(&mut self) -> Option<&mut Plant> {
        Some(&mut self.plant)
    }

    fn plant_view(&self) -> Option<&Plant> {
        Some(&self.plant)
    }
}
