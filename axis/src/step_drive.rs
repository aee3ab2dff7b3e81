//! A stepper motor under a pulse output (MACCON MAC4 User Manual, sections 2.4, 4.1 and 4.4).
//!
//! The axis counts in the steps of the pulse output. Where it is tells the count of pulses, or an encoder whose
//! increments are converted to steps; then the following error shows lost steps.
//!
//! A drive that is built into its motor makes its pulses inside, with a factor to the frequencies of the MAC4.

use core::num::NonZeroU32;

use crate::drive::{Capabilities, Command, Demand, Drive, DriveFault, Feedback, Setting, Signals};
use crate::inputs::Latches;
use crate::limits::TorqueLimit;
use crate::measurement::{Reader, Scale, SensorConfig, Source};
use crate::plant::{Plant, PlantConfig, Stepper, StepperConfig};
use crate::power_stage::PowerStage;
use crate::pulses::{PulseOutput, Pulses};
use crate::units::{Period, Position, Torque, Velocity, cut, rounded};

/// Longest step of the simulation, in ns.
const INNER_NANOS: u64 = 250_000;

/// What a stepper drive is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct StepConfig {
    /// The mechanics.
    pub plant: PlantConfig,
    /// The motor.
    pub motor: StepperConfig,
    /// What tells where it is.
    pub feedback: StepFeedback,
    /// Ten times the frequencies.
    pub turbo: bool,
    /// What all frequencies are multiplied by beside, see [`Pulses::with_factor`].
    pub frequency_factor: NonZeroU32,
    /// How long BOOST is on before a motion, in ns; rounded up to whole raster steps.
    pub boost_lead_nanos: u64,
    /// Raster steps from the enable command to power on.
    pub enabling_steps: u32,
}

impl Default for StepConfig {
    /// The default motor with the viscous friction of a damped one; pulses are counted.
    fn default() -> Self {
        Self {
            plant: PlantConfig { viscous_friction_nms: 5e-3, ..PlantConfig::default() },
            motor: StepperConfig::default(),
            feedback: StepFeedback::Counter,
            turbo: false,
            frequency_factor: NonZeroU32::MIN,
            boost_lead_nanos: 0,
            enabling_steps: 0,
        }
    }
}

/// What tells where a stepper motor is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepFeedback {
    /// The pulses put out.
    Counter,
    /// An encoder; its increments are the counts of the plant.
    Encoder {
        /// Its register.
        sensor: SensorConfig,
        /// Increments to steps.
        scale: Scale,
    },
}

/// A simulated stepper drive; the raster period is the sampling period of its pulse output.
#[derive(Clone, Debug)]
pub struct StepDrive {
    plant: Plant,
    motor: Stepper,
    pulses: Pulses,
    reader: Reader,
    /// What went to the motor in the last period.
    output: PulseOutput,
    /// Steps in the last period.
    way: Position,
    sign: f64,
    /// Where the motor is told to be when the pulses are at step 0.
    motor_zero: Position,
    stage: PowerStage,
    lead: u32,
    period_nanos: u64,
    inner_steps: u32,
    inner_seconds: f64,
    period_seconds: f64,
    /// Place of the pulses minus measured place, as it was when the power came on.
    bias: Position,
    steps: u64,
    position: Position,
    velocity: Velocity,
    torque: Torque,
}

impl StepDrive {
    /// A drive stepped once every `period`, at rest and without power.
    #[must_use]
    pub fn new(period: Period, config: StepConfig) -> Self {
        let inner_steps = u32::try_from(period.nanos().div_ceil(INNER_NANOS)).unwrap_or(u32::MAX);
        let mut pulses = Pulses::with_factor(period, config.frequency_factor);
        pulses.set_boost_lead(config.boost_lead_nanos);
        // At rest nothing is refused.
        let _ = pulses.set_turbo(config.turbo);
        let plant = Plant::new(config.plant);
        let reader = match config.feedback {
            StepFeedback::Counter => Reader::new(SensorConfig::incremental(16), Source::Counter),
            StepFeedback::Encoder { sensor, scale } => Reader::new(sensor, Source::Own(sensor, scale)),
        };
        let mut new = Self {
            motor: Stepper::new(config.motor, plant.motor_position()),
            plant,
            pulses,
            reader,
            output: PulseOutput::default(),
            way: Position(0.0),
            sign: 1.0,
            motor_zero: Position(0.0),
            stage: PowerStage::new(config.enabling_steps),
            lead: lead(config.boost_lead_nanos, period.nanos()),
            period_nanos: period.nanos(),
            inner_steps,
            inner_seconds: period.seconds() / f64::from(inner_steps),
            period_seconds: period.seconds(),
            bias: Position(0.0),
            steps: 0,
            position: Position(0.0),
            velocity: Velocity(0.0),
            torque: Torque(0.0),
        };
        new.measure(0);
        new
    }

    /// Where the pulses are to be after this period.
    fn target(&self, demand: &Demand) -> Position {
        match demand {
            Demand::Position(set_point) => set_point.position + self.bias,
            Demand::Output(share) => {
                let highest = self.pulses.highest_hz();
                self.pulses.place() + Position(cut(*share, 1.0) * highest * self.period_seconds)
            }
            // A stepper motor has no torque to set.
            Demand::Torque(_) => self.pulses.place(),
        }
    }

    /// Turns from one place of the motor to another, in steps.
    fn advance(&mut self, from: Position, to: Position, limit: TorqueLimit) {
        let share = 1.0 / f64::from(self.inner_steps);
        let rate = (to - from).0 / self.period_seconds;
        // The torque of an inner step is that of its beginning, where rotor and field are known.
        for inner in 0..self.inner_steps {
            let place = from.0 + (to - from).0 * f64::from(inner) * share;
            self.torque = if self.stage.is_on() {
                limit.cut(self.motor.torque(rounded(place), rate, &self.plant))
            } else {
                Torque(0.0)
            };
            self.plant.step(self.torque, self.inner_seconds);
            if let Some(cause) = self.plant.fault() {
                self.stage.trip(cause);
            }
        }
    }

    /// Where the motor is told to be at a place of the pulses.
    fn motor_place(&self, pulses: Position) -> Position {
        Position(self.sign * pulses.0) + self.motor_zero
    }

    /// The way of the motor while the pulses go from one place to another. The direct output is not reversed.
    fn motor_way(&mut self, from: Position, to: Position, demand: &Demand) -> (Position, Position) {
        let start = self.motor_place(from);
        if self.sign < 0.0 && matches!(demand, Demand::Output(_)) {
            self.motor_zero = self.motor_zero + (to - from) + (to - from);
        }
        (start, self.motor_place(to))
    }

    /// Takes the count of pulses, or reads the encoder; with an encoder also the latches.
    fn measure(&mut self, pulses: i64) -> Latches {
        let raw = self.plant.take_latches();
        if self.reader.is_counter() {
            // A signal is where the pulses are when it changes.
            self.position = Position(pulses as f64);
            return raw.map(|_| Some(self.position));
        }
        let latches = self.reader.latches(raw);
        match self.reader.read(self.plant.encoder()) {
            Ok(position) => self.position = position,
            Err(_) => self.stage.trip(DriveFault::Encoder),
        }
        latches
    }
}

impl Drive for StepDrive {
    fn step(&mut self, command: &Command) -> Feedback {
        self.steps = self.steps.wrapping_add(1);
        let is_powered = self.stage.is_on() && command.enable;
        self.stage.switch(command, &self.plant);
        let from = self.pulses.place();
        self.output = if is_powered {
            self.pulses.step(self.target(&command.demand), command.moving)
        } else {
            self.bias = from - self.position;
            self.pulses.step(from, false)
        };
        let to = self.pulses.place();
        self.way = to - from;
        let (from, to) = self.motor_way(from, to, &command.demand);
        self.advance(from, to, if is_powered { command.torque_limit } else { TorqueLimit::default() });
        self.velocity = Velocity(self.way.0 / self.period_seconds);
        let latches = self.measure(self.output.steps);
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
            Setting::Reversed(reversed) => {
                let place = self.motor_place(self.pulses.place());
                self.sign = if reversed { -1.0 } else { 1.0 };
                self.motor_zero = self.motor_zero + place - self.motor_place(self.pulses.place());
            }
            Setting::Source(source) => {
                self.reader.set_source(source);
                self.measure(self.output.steps);
                self.velocity = Velocity(0.0);
                self.bias = self.pulses.place() - self.position;
            }
            Setting::Word(word) => self.reader.supply(word),
            Setting::Turbo(turbo) => {
                // In motion it stays as it is.
                let _ = self.pulses.set_turbo(turbo);
            }
            Setting::BoostLead(nanos) => {
                self.pulses.set_boost_lead(nanos);
                self.lead = lead(nanos, self.period_nanos);
            }
            Setting::Coefficients(_) | Setting::OutputLimit(_) => {}
        }
    }

    fn signals(&self) -> Signals {
        let is_counter = self.reader.is_counter();
        let pulses = self.output.steps as u32;
        Signals {
            place: self.position,
            word: if is_counter { pulses } else { self.reader.word() },
            count: if is_counter { pulses } else { self.reader.count() },
            output: rounded(self.way.0) as i32,
            boost: self.output.boost,
            boost_ready: self.output.ready,
            turbo: self.pulses.is_turbo(),
        }
    }

    fn capabilities(&self) -> Capabilities {
        let sleeps = self.plant.is_settled() && !self.reader.is_pending();
        Capabilities { sleeps, lead: self.lead, ..Capabilities::default() }
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

/// Raster steps that BOOST leads by.
fn lead(nanos: u64, period_nanos: u64) -> u32 {
    u32::try_from(nanos.div_ceil(period_nanos)).unwrap_or(u32::MAX)
}
