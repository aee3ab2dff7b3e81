//! The simulated plant: a motor with a load, its sensors and switches, its supply and its faults.
//!
//! What a configuration does not use costs nothing: the mechanics, the index and the switches run always,
//! everything else only where it is modelled.

mod amplifier;
mod config;
mod encoder;
mod faults;
mod heat;
mod mechanics;
mod noise;
mod stepper;
mod supply;
mod switches;

pub use amplifier::{Amplifier, AmplifierConfig, AmplifierMode};
pub use config::PlantConfig;
pub use encoder::EncoderBreak;
pub use faults::{PlantFault, ScheduledFault};
pub use heat::{Overload, Thermal};
pub use mechanics::Load;
pub use noise::Noise;
pub use stepper::{Stepper, StepperConfig};
pub use supply::{DcLink, Supply};

use encoder::{Index, Sensor};
use faults::Schedule;
use heat::Heat;
use mechanics::Mechanics;
use supply::Feed;
use switches::Switches;

use crate::drive::{DriveFault, Feedback};
use crate::inputs::{Input, Inputs, Latches};
use crate::limits::PositionRange;
use crate::units::{Position, Temperature, Torque, Velocity, Voltage, rounded};

/// The plant in motion. Its position is continuous; the encoder shows whole counts of it.
#[derive(Clone, Debug)]
pub struct Plant {
    mechanics: Mechanics,
    index: Index,
    switches: Switches,
    latches: Latches,
    /// Anything else has to be stepped.
    has_more: bool,
    /// Something was changed from outside since the last step.
    is_touched: bool,
    /// What the power electronics trip on.
    fault: Option<DriveFault>,
    injected_fault: Option<DriveFault>,
    monitors_encoder: bool,
    /// Whether anything passes between the drive and whoever commands it.
    is_connected: bool,
    sensor: Sensor,
    feed: Feed,
    heat: Heat,
    schedule: Schedule,
}

impl Plant {
    /// Longest step, in seconds.
    const LONGEST: f64 = 1.0;

    /// A plant at rest at its start.
    #[must_use]
    pub fn new(config: PlantConfig) -> Self {
        let mechanics = Mechanics::new(&config);
        let counts = f64::from(config.counts_per_revolution.max(1));
        let mut new = Self {
            index: Index::new(within(config.index.0, -1e9, 1e9, 0.0), counts, mechanics.position()),
            switches: Switches::new(&config, mechanics.load_position()),
            latches: Latches::default(),
            has_more: false,
            is_touched: true,
            fault: None,
            injected_fault: None,
            monitors_encoder: config.monitors_encoder,
            is_connected: true,
            sensor: Sensor::new(config.noise, config.encoder_break, counts),
            feed: Feed::new(config.supply),
            heat: Heat::new(config.ambient, config.thermal, config.overload),
            schedule: Schedule::new(config.faults),
            mechanics,
        };
        new.touch();
        new
    }

    /// Lets `torque` (at most the peak torque) work for `seconds`; everything else works along. A torque that
    /// is not a number and a time that is not from 0 to 1 count as zero.
    #[inline]
    pub fn step(&mut self, torque: Torque, seconds: f64) {
        let torque = if torque.0.is_nan() { no_torque() } else { torque };
        let seconds = within(seconds, 0.0, Self::LONGEST, 0.0);
        self.is_touched = false;
        if self.has_more {
            self.apply_schedule(seconds);
        }
        self.mechanics.step(torque, seconds);
        if let Some(index) = self.index.pass(self.mechanics.position()) {
            self.latches.index = Some(index);
        }
        self.switches.pass(self.mechanics.load_position(), self.mechanics.gap(), &mut self.latches);
        if self.has_more {
            self.step_more(torque, seconds);
        }
    }

    /// What the encoder shows: the nearest whole count.
    #[must_use]
    pub fn encoder(&self) -> Position {
        if self.has_more {
            self.sensor.position(self.mechanics.position())
        } else {
            Position(rounded(self.mechanics.position()))
        }
    }

    /// The velocity of the motor, as its encoder shows it.
    #[must_use]
    pub fn velocity(&self) -> Velocity {
        if self.has_more {
            self.sensor.velocity(self.mechanics.velocity())
        } else {
            Velocity(self.mechanics.velocity())
        }
    }

    /// Where the motor truly is, also between counts.
    #[must_use]
    pub fn motor_position(&self) -> Position {
        Position(self.mechanics.position())
    }

    /// Where the load truly is, also between counts.
    #[must_use]
    pub fn load_position(&self) -> Position {
        Position(self.mechanics.load_position())
    }

    /// How fast the motor truly is.
    #[must_use]
    pub fn motor_velocity(&self) -> Velocity {
        Velocity(self.mechanics.velocity())
    }

    /// The levels of the inputs.
    #[must_use]
    pub fn inputs(&self) -> Inputs {
        self.switches.levels(self.fault.is_some())
    }

    /// Where signals changed since the last call.
    pub fn take_latches(&mut self) -> Latches {
        core::mem::take(&mut self.latches)
    }

    /// The supply of the power stage.
    #[must_use]
    pub fn supply(&self) -> Voltage {
        self.feed.voltage()
    }

    /// The temperature of the motor.
    #[must_use]
    pub fn temperature(&self) -> Temperature {
        self.heat.temperature()
    }

    /// What a drive on this plant reports, but for its own part.
    #[must_use]
    pub(crate) fn feedback(&self) -> Feedback {
        Feedback {
            valid: self.is_connected,
            voltage: self.supply(),
            temperature: self.temperature(),
            overload: self.overload(),
            inputs: self.inputs(),
            ..Feedback::default()
        }
    }

    /// The part of the overload capacity (I²t) that is used up; 1 is the limit.
    #[must_use]
    pub fn overload(&self) -> f64 {
        self.heat.utilisation()
    }

    /// What the power electronics trip on, as long as it lasts.
    #[must_use]
    pub fn fault(&self) -> Option<DriveFault> {
        self.fault
    }

    /// Whether the drive and whoever commands it hear each other.
    #[must_use]
    pub(crate) fn is_connected(&self) -> bool {
        self.is_connected
    }

    /// Whether another step without torque would change nothing but the temperature; for that there is
    /// [`Plant::rest`].
    #[must_use]
    pub fn is_settled(&self) -> bool {
        let is_over = self.mechanics.is_at_rest() && self.schedule.is_over();
        is_over && !self.is_touched && self.feed.is_settled()
    }

    /// Hangs another load on the motor, also on the move; what makes no sense counts as zero.
    pub fn set_load(&mut self, load: Load) {
        self.mechanics.set_load(&load);
        self.touch();
    }

    /// Puts the cam of a position switch or a general input somewhere else, or takes it away.
    pub fn set_cam(&mut self, input: Input, range: Option<PositionRange>) {
        self.switches.set_cam(input, range, self.mechanics.load_position());
        self.touch();
    }

    /// Lets time pass in which the plant is settled: it cools down.
    pub fn rest(&mut self, seconds: f64) {
        self.heat.rest(within(seconds, 0.0, f64::MAX, 0.0));
        self.touch();
    }

    /// Breaks something.
    pub fn inject(&mut self, fault: PlantFault) {
        self.change(fault, true);
    }

    /// Repairs it, whatever the fault's voltage, level or cause.
    pub fn clear(&mut self, fault: PlantFault) {
        self.change(fault, false);
    }

    /// What is broken now, by order or by schedule.
    pub fn faults(&self) -> impl Iterator<Item = PlantFault> {
        let encoder = self.sensor.is_broken().then_some(PlantFault::EncoderBreak);
        let shaft = self.mechanics.is_blocked().then_some(PlantFault::BlockedShaft);
        let drive = self.injected_fault.map(PlantFault::DriveFault);
        let supply = self.feed.dip().map(PlantFault::SupplyDip);
        let stuck = self.switches.stuck().map(|(input, level)| PlantFault::StuckSwitch(input, level));
        let connection = (!self.is_connected).then_some(PlantFault::ConnectionLoss);
        [encoder, shaft, drive, supply, connection].into_iter().flatten().chain(stuck)
    }

    /// The torque that accelerates motor and load by `acceleration` (counts/s²) while they move at
    /// `velocity` (counts/s).
    #[must_use]
    pub(crate) fn torque_for(&self, acceleration: f64, velocity: f64) -> Torque {
        self.mechanics.torque_for(acceleration, velocity)
    }

    /// The highest torque of the motor.
    #[must_use]
    pub fn peak_torque(&self) -> Torque {
        self.mechanics.limited(Torque(f64::MAX))
    }

    /// The motor's part of the whole inertia, where there is play between motor and load.
    #[must_use]
    pub(crate) fn loose_motor(&self) -> Option<f64> {
        self.mechanics.loose_motor()
    }

    fn change(&mut self, fault: PlantFault, is_on: bool) {
        match fault {
            PlantFault::EncoderBreak => {
                let place = self.encoder();
                self.sensor.break_at(is_on.then_some(place));
            }
            PlantFault::StuckSwitch(input, level) => {
                let place = self.encoder();
                self.switches.stick(input, is_on.then_some(level), place, &mut self.latches);
            }
            PlantFault::BlockedShaft => self.mechanics.set_blocked(is_on),
            PlantFault::DriveFault(cause) => self.injected_fault = is_on.then_some(cause),
            PlantFault::SupplyDip(voltage) => self.feed.set_dip(is_on.then_some(voltage)),
            PlantFault::ConnectionLoss => self.is_connected = !is_on,
        }
        self.touch();
    }

    fn touch(&mut self) {
        self.is_touched = true;
        let has_power = self.feed.is_modelled() || self.heat.is_modelled();
        self.has_more = has_power || self.sensor.is_disturbed() || !self.schedule.is_over();
        self.fault = self.find_fault();
    }

    #[inline(never)]
    fn apply_schedule(&mut self, seconds: f64) {
        while let Some(change) = self.schedule.take_due(seconds) {
            self.change(change.fault, change.begins);
        }
        self.schedule.pass(seconds);
        self.is_touched = false;
    }

    #[inline(never)]
    fn step_more(&mut self, torque: Torque, seconds: f64) {
        let applied = self.mechanics.limited(torque);
        self.feed.step(self.mechanics.power(applied), applied.0 / 1000.0, seconds);
        self.heat.step(applied.0, seconds);
        self.sensor.sample(torque.0 == 0.0 && self.mechanics.is_at_rest());
        self.fault = self.find_fault();
    }

    fn find_fault(&self) -> Option<DriveFault> {
        let encoder = (self.monitors_encoder && self.sensor.is_broken()).then_some(DriveFault::Encoder);
        self.injected_fault.or(encoder).or_else(|| self.feed.fault()).or_else(|| self.heat.fault())
    }
}

/// What a torque that is no number counts as. Rare: as a branch of its own it costs the others nothing.
#[cold]
fn no_torque() -> Torque {
    Torque(0.0)
}

/// `value` when it is a number from `min` to `max`, else `default`.
fn within(value: f64, min: f64, max: f64, default: f64) -> f64 {
    if (min..=max).contains(&value) { value } else { default }
}

#[cfg(test)]
pub(crate) mod tests;
