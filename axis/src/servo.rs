//! A simulated drive: the plant under a cascaded controller.

use crate::drive::{Capabilities, Command, Demand, Drive, Feedback};
use crate::limits::TorqueLimit;
use crate::plant::{Plant, PlantConfig};
use crate::power_stage::PowerStage;
use crate::profile::{FeedForward, SetPoint};
use crate::units::{Period, Torque, Velocity, cut};

/// Longest period of the inner controller, in ns.
const INNER_NANOS: u64 = 250_000;

/// What a simulated drive is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct ServoConfig {
    /// Everything but the controller.
    pub plant: PlantConfig,
    /// Raster steps from the enable command to power on.
    pub enabling_steps: u32,
}

impl Default for ServoConfig {
    /// The default plant, enabled after 10 steps.
    fn default() -> Self {
        Self { plant: PlantConfig::default(), enabling_steps: 10 }
    }
}

/// A drive that is all simulation.
#[derive(Clone, Debug)]
pub struct SimulatedServo {
    plant: Plant,
    controller: Controller,
    inner_steps: u32,
    inner_seconds: f64,
    stage: PowerStage,
    steps: u64,
    torque: Torque,
}

impl SimulatedServo {
    /// A drive stepped once every `period`; it starts disabled and at rest.
    #[must_use]
    pub fn new(period: Period, config: ServoConfig) -> Self {
        let inner_steps = u32::try_from(period.nanos().div_ceil(INNER_NANOS)).unwrap_or(u32::MAX);
        Self {
            plant: Plant::new(config.plant),
            controller: Controller::default(),
            inner_steps,
            inner_seconds: period.seconds() / f64::from(inner_steps),
            stage: PowerStage::new(config.enabling_steps),
            steps: 0,
            torque: Torque(0.0),
        }
    }

    fn obey(&mut self, command: &Command) {
        let limit = command.torque_limit;
        match &command.demand {
            Demand::Position(set_point) => self.drive(set_point, &command.feed_forward, limit),
            Demand::Torque(torque) => self.push(*torque, limit, command.velocity_limit),
            Demand::Output(share) => {
                let torque = Torque(share * self.plant.peak_torque().0);
                self.push(torque, limit, Velocity(f64::MAX));
            }
        }
    }

    /// Follows the set-point, until the power electronics trip.
    fn drive(&mut self, set_point: &SetPoint, feed_forward: &FeedForward, limit: TorqueLimit) {
        let gains = Gains::of(&self.plant, self.inner_seconds);
        let limit = limit.least(TorqueLimit::both(self.plant.peak_torque()));
        for left in (1..=self.inner_steps).rev() {
            if !self.stage.is_on() {
                return self.coast(left);
            }
            let mut target = earlier(set_point, f64::from(left), self.inner_seconds);
            target.velocity = feed_forward.velocity.unwrap_or(target.velocity);
            let torque = self.controller.torque(&self.plant, &gains, &target, feed_forward.torque, limit);
            self.advance(torque);
        }
    }

    /// Gives a torque that drives the motor to the highest speed at most, until the power electronics trip.
    #[inline(never)]
    fn push(&mut self, torque: Torque, limit: TorqueLimit, highest: Velocity) {
        self.controller = Controller::default();
        let torque = limit.cut(torque);
        let direction = if torque.0 < 0.0 { -1.0 } else { 1.0 };
        for left in (1..=self.inner_steps).rev() {
            if !self.stage.is_on() {
                return self.coast(left);
            }
            let room = (highest.0 - direction * self.plant.velocity().0) / self.inner_seconds;
            let most = direction * self.plant.torque_for(direction * room, direction * highest.0).0;
            self.advance(Torque(direction * torque.abs().0.min(most.max(0.0))));
        }
    }

    #[inline(never)]
    fn coast(&mut self, inner_steps: u32) {
        (0..inner_steps).for_each(|_| self.advance(Torque(0.0)));
    }

    /// One inner step; a fault in it counts however short it is.
    #[inline(always)]
    fn advance(&mut self, torque: Torque) {
        self.torque = torque;
        self.plant.step(torque, self.inner_seconds);
        if let Some(cause) = self.plant.fault() {
            self.stage.trip(cause);
        }
    }

    fn feedback(&mut self) -> Feedback {
        Feedback {
            step: self.steps,
            state: self.stage.state(),
            position: self.plant.encoder(),
            velocity: self.plant.velocity(),
            torque: self.torque,
            latches: self.plant.take_latches(),
            ..self.plant.feedback()
        }
    }
}

impl Drive for SimulatedServo {
    fn step(&mut self, command: &Command) -> Feedback {
        self.steps = self.steps.wrapping_add(1);
        let is_powered = self.stage.is_on() && command.enable;
        if self.stage.switch(command, &self.plant) {
            self.controller = Controller::default();
        }
        if is_powered {
            self.obey(command);
        } else {
            self.coast(self.inner_steps);
        }
        self.feedback()
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { sleeps: self.plant.is_settled(), ..Capabilities::default() }
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

/// How hard the controller works.
#[derive(Clone, Copy, Debug)]
struct Gains {
    /// Torque per velocity error, in per mille per count/s.
    velocity: f64,
    /// Velocity per position error, in 1/s.
    position: f64,
    /// Growth of the integral part per velocity error and inner step, in 1/s.
    integral: f64,
}

impl Gains {
    /// Velocity gain where motor and load are one, in 1/s.
    const RIGID: f64 = 1000.0;
    /// Part of a velocity error that may be corrected in one step while the motor moves alone in its play.
    const LOOSE: f64 = 0.8;

    /// Gains that are stable on this plant at this step.
    fn of(plant: &Plant, seconds: f64) -> Self {
        let loose = plant.loose_motor().map_or(f64::MAX, |share| Self::LOOSE * share / seconds);
        let velocity = Self::RIGID.min(loose);
        let position = velocity / 5.0;
        Self {
            velocity: plant.torque_for(velocity, 0.0).0,
            position,
            integral: velocity * position / 4.0 * seconds,
        }
    }
}

/// Position, then velocity with an integral part, on top of feed-forward torque.
#[derive(Clone, Debug, Default)]
struct Controller {
    /// Acceleration the integral part adds, in counts/s².
    integral: f64,
}

impl Controller {
    /// Position error that quantisation hides, in counts.
    const DEAD_BAND: f64 = 0.5;

    fn torque(
        &mut self,
        plant: &Plant,
        gains: &Gains,
        target: &SetPoint,
        extra: Torque,
        limit: TorqueLimit,
    ) -> Torque {
        let lag = (target.position - plant.encoder()).0;
        let lag = lag - cut(lag, Self::DEAD_BAND);
        let catch_up = gains.position * lag;
        let slip = target.velocity.0 - plant.velocity().0 + catch_up;
        let wanted = target.velocity.0 + catch_up;
        let steady = plant.torque_for(target.acceleration.0 + self.integral, wanted);
        let torque = Torque(steady.0 + gains.velocity * slip + extra.0);
        let given = limit.cut(torque);
        if given == torque {
            self.integral += gains.integral * slip;
        }
        given
    }
}

/// The set-point as it was so many `steps` of `seconds` before its time; the velocity half a step earlier,
/// where the plant has it: its position grows by velocity times step.
fn earlier(set_point: &SetPoint, steps: f64, seconds: f64) -> SetPoint {
    let (velocity, acceleration, time) = (set_point.velocity.0, set_point.acceleration.0, steps * seconds);
    let mut then = *set_point;
    then.velocity.0 = velocity - acceleration * (time + seconds / 2.0);
    then.position.0 -= (velocity - acceleration * time / 2.0) * time;
    then
}

#[cfg(test)]
mod tests;
