//! One axis: goals in, set-points to the drive, status out.

use crate::drive::{Command, Drive, DriveState, Feedback, Switches};
use crate::generator::{Generator, Goal};
use crate::limits::{Limits, PositionRange};
use crate::profile::{Profile, SetPoint};
use crate::status::{Actual, Fault, Motion, Status};
use crate::units::{Acceleration, Period, Position, Torque, Velocity};

/// A motion axis with its drive.
///
/// Goals are taken while the drive is enabled and ignored otherwise. When the drive goes off, by command or
/// by a fault, the motor coasts; the demand follows it, so that power comes back without a jump.
pub struct Axis {
    period: Period,
    drive: Box<dyn Drive>,
    generator: Generator,
    /// Axis position minus raw position of the drive.
    offset: Position,
    torque_limit: Torque,
    following_error_limit: Option<Position>,
    enable: bool,
    reset: bool,
    status: Status,
}

impl Axis {
    /// An axis without power, its origin that of the drive. It knows nothing of the drive before the first
    /// step.
    #[must_use]
    pub fn new(period: Period, limits: Limits, drive: Box<dyn Drive>) -> Self {
        let generator = Generator::new(period, limits);
        let torque_limit = generator.limits().torque;
        Self {
            period,
            drive,
            generator,
            offset: Position(0.0),
            torque_limit,
            following_error_limit: None,
            enable: false,
            reset: false,
            status: Status::default(),
        }
    }

    /// The raster period.
    #[must_use]
    pub fn period(&self) -> Period {
        self.period
    }

    /// Switches the power on; ignored while there is a fault. The drive takes its time to be enabled.
    pub fn power_on(&mut self) {
        self.enable = self.status.fault.is_none();
    }

    /// Switches the power off: the motor coasts.
    pub fn power_off(&mut self) {
        self.enable = false;
    }

    /// Clears a fault, also in the drive. The axis stays off; a cause that persists is a new fault.
    pub fn reset_fault(&mut self) {
        self.reset = true;
        self.status.fault = None;
    }

    /// Moves to `target`, from any state of motion. A target beyond a position limit is cut to it, one that
    /// is not a number is a stop.
    pub fn move_to(&mut self, target: Position, profile: Profile) {
        self.command(Goal::MoveTo(target), profile);
    }

    /// Runs at `velocity`, cut to the profile velocity, until told otherwise or stopped by a position limit.
    pub fn run_at(&mut self, velocity: Velocity, profile: Profile) {
        self.command(Goal::RunAt(velocity), profile);
    }

    /// Ramps down and holds; a zero deceleration is the axis maximum.
    pub fn stop(&mut self, deceleration: Acceleration) {
        self.command(Goal::Stop, Profile { deceleration, ..Profile::default() });
    }

    /// Calls the present actual position `position`. Nothing moves: demand, target and index get the same
    /// offset, only the position limits keep their numbers. What is not within ±2^53 counts is ignored.
    pub fn set_position(&mut self, position: Position) {
        if !PositionRange::EXACT.contains(position) {
            return;
        }
        let by = position - self.status.actual.position;
        self.offset = self.offset + by;
        self.generator.shift(by);
        self.status.actual.position = position;
        self.status.demand.position = self.status.demand.position + by;
        self.status.index = self.status.index.map(|index| index + by);
    }

    /// The axis maxima.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        self.generator.limits()
    }

    /// Replaces the axis maxima, also on the move.
    pub fn set_limits(&mut self, limits: Limits) {
        self.generator.set_limits(limits);
    }

    /// Limits the torque further than the axis maximum does; a sign is dropped, what is not a number ignored.
    pub fn set_torque_limit(&mut self, limit: Torque) {
        if !limit.0.is_nan() {
            self.torque_limit = limit.abs();
        }
    }

    /// The largest following error that is no fault; `None` allows any.
    pub fn set_following_error_limit(&mut self, limit: Option<Position>) {
        self.following_error_limit = limit;
    }

    /// Runs one raster period.
    pub fn step(&mut self) {
        let was_running = self.is_running();
        if was_running {
            self.generator.step();
        }
        let command = self.drive_command();
        self.reset = false;
        let feedback = self.drive.step(&command);
        self.status.steps = self.status.steps.wrapping_add(1);
        self.read(&feedback);
        self.supervise(was_running);
        if !(was_running && self.is_running()) {
            let Actual { position, velocity, .. } = self.status.actual;
            self.generator.place(position, velocity);
        }
        self.report();
    }

    /// The state at the end of the last step.
    #[must_use]
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Powered off and mechanically at rest, nothing pending: another step would only count itself.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        let off = match self.status.drive {
            DriveState::Disabled | DriveState::Fault(_) => true,
            DriveState::NotReady | DriveState::Enabling | DriveState::Enabled | DriveState::Lost => false,
        };
        let at_rest = self.status.actual.velocity.0 == 0.0;
        off && at_rest && !self.enable && !self.reset && self.drive.capabilities().sleeps
    }

    fn command(&mut self, goal: Goal, profile: Profile) {
        if self.is_running() {
            self.generator.command(goal, profile);
            self.status.done = false;
            self.status.limited = false;
        }
    }

    fn is_running(&self) -> bool {
        self.enable && self.status.drive == DriveState::Enabled
    }

    fn drive_command(&self) -> Command {
        let demand = *self.generator.set_point();
        Command {
            enable: self.enable,
            set_point: SetPoint { position: demand.position - self.offset, ..demand },
            torque_limit: Torque(self.torque_limit.0.min(self.limits().torque.0)),
            reset_fault: self.reset,
        }
    }

    fn read(&mut self, feedback: &Feedback) {
        self.status.drive = feedback.state;
        if !feedback.valid {
            return;
        }
        self.status.actual = Actual {
            position: feedback.position + self.offset,
            velocity: feedback.velocity,
            torque: feedback.torque,
        };
        self.status.voltage = feedback.voltage;
        self.status.temperature = feedback.temperature;
        let inputs = feedback.inputs;
        self.status.switches = Switches {
            positive_limit: inputs.positive_limit,
            negative_limit: inputs.negative_limit,
            home: inputs.home,
        };
        if let Some(index) = feedback.latches.index {
            self.status.index = Some(index + self.offset);
        }
    }

    fn supervise(&mut self, was_running: bool) {
        let found = match self.status.drive {
            DriveState::Fault(cause) => Some(Fault::Drive(cause)),
            DriveState::Lost => Some(Fault::Lost),
            DriveState::Enabled if was_running && self.strays() => Some(Fault::FollowingError),
            DriveState::NotReady | DriveState::Disabled | DriveState::Enabling | DriveState::Enabled => None,
        };
        if let Some(fault) = found {
            self.enable = false;
            self.status.fault.get_or_insert(fault);
        }
    }

    fn strays(&self) -> bool {
        let error = self.generator.set_point().position - self.status.actual.position;
        self.following_error_limit.is_some_and(|limit| error.abs() > limit.abs())
    }

    fn report(&mut self) {
        let demand = *self.generator.set_point();
        let running = self.is_running();
        self.status.demand = demand;
        self.status.following_error = demand.position - self.status.actual.position;
        self.status.motion = if running { Motion::of(&demand) } else { Motion::Off };
        self.status.done = running && self.generator.is_done();
        self.status.limited = running && self.generator.is_limited();
    }
}
