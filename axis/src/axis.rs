//! One axis: orders in, set-points to the drive, status out.

mod fence;
mod orders;
mod power;
mod push;
mod queue;
mod seek;
mod standby;
mod step;
mod supervision;
mod window;

use core::num::NonZeroU32;

use crate::drive::{Drive, DriveState, Setting, Signals};
use crate::generator::{Generator, Stepping};
use crate::inputs::Levels;
use crate::limits::{Limits, PositionRange, TorqueLimit};
use crate::order::Order;
use crate::plant::Plant;
use crate::profile::{FeedForward, Profile, SetPoint};
use crate::status::{Fault, Status};
use crate::travel::Travel;
use crate::units::{Acceleration, Period, Position, Torque, Velocity};

use fence::{Fence, Side};
use power::Power;
use push::Push;
use queue::Queue;
use seek::{Sample, Seeking};
use standby::Standing;
use supervision::Supervision;
use window::Arrival;

pub use fence::BehindLimit;
pub use power::PowerDelays;
pub use queue::QueueFull;
pub use standby::Standby;
pub use window::TargetWindow;

/// What an axis does about trouble.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Guard {
    /// The active levels of the inputs.
    pub levels: Levels,
    /// What holds behind a limit switch.
    pub behind_limit: BehindLimit,
    /// Ramp of [`Order::Brake`] and of every braking below; zero is the axis maximum.
    pub emergency_deceleration: Acceleration,
    /// On a following error above the limit.
    pub following_error: Reaction,
    /// When the drive signals a fault at its input.
    pub drive_signal: Reaction,
    /// When no sign of life came in time.
    pub supervision: Reaction,
}

/// How an axis gets from a fault to power off. An emergency stop and a fault or loss of the drive always cut the
/// power.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reaction {
    /// Power off at once: the motor coasts.
    #[default]
    Coast,
    /// Ramp down with the emergency deceleration, then power off.
    Brake,
}

/// A motion axis with its drive.
///
/// Orders are taken while the drive is enabled and ignored otherwise. When the drive goes off, by command or
/// by a fault, the motor coasts; the demand follows it, so that power comes back without a jump.
///
/// Inside, positions count on a straight line; on a circular axis they are wrapped for the [`Status`] only.
pub struct Axis {
    period: Period,
    drive: Box<dyn Drive>,
    generator: Generator,
    travel: Travel,
    /// Axis position minus raw position of the drive.
    offset: Position,
    /// As they were set, before switches narrow them.
    limits: Limits,
    torque_limit: TorqueLimit,
    standing: Standing,
    following_error_limit: Option<Position>,
    /// Raster steps for which a larger following error is tolerated.
    following_error_time: u32,
    /// Raster steps on end with a larger following error.
    straying: u32,
    guard: Guard,
    fence: Fence,
    power: Power,
    supervision: Supervision,
    arrival: Option<Arrival>,
    task: Task,
    feed_forward: FeedForward,
    /// Where the last move was to end.
    target: Option<Position>,
    queue: Queue,
    /// Raster steps in which the drive still prepares for a motion.
    lead: u32,
    /// The present order moves the axis.
    is_motion_ordered: bool,
    /// A limit switch or a position limit has ended what was ordered.
    is_blocked: bool,
    /// The side to which a position limit lets no torque lead any more, until one leads away from it.
    barred: Option<Side>,
    is_enabled: bool,
    reset: bool,
    sample: Sample,
    status: Status,
}

/// What an axis with power is at.
#[derive(Clone, Copy, Debug)]
enum Task {
    /// It follows the generator.
    Follow,
    /// It looks for a mark, following the generator.
    Seek(Seeking),
    /// It gives a torque.
    Push(Push),
    /// It puts out a share of the full scale.
    Output(f64),
    /// It ramps down in an emergency.
    Brake {
        /// To switch off then.
        off: bool,
    },
}

impl Axis {
    /// A linear axis without power, its origin that of the drive. It knows nothing of the drive before the first
    /// step.
    #[must_use]
    pub fn new(period: Period, limits: Limits, drive: Box<dyn Drive>) -> Self {
        Self::with_generator_cycle(period, NonZeroU32::MIN, limits, drive)
    }

    /// An axis whose generator runs every `cycle` raster steps only; in between its set-points are interpolated.
    #[must_use]
    pub fn with_generator_cycle(
        period: Period,
        cycle: NonZeroU32,
        limits: Limits,
        drive: Box<dyn Drive>,
    ) -> Self {
        let limits = limits.sanitised();
        Self {
            period,
            drive,
            generator: Generator::new(period, limits).with_cycle(cycle),
            travel: Travel::Linear,
            offset: Position(0.0),
            limits,
            torque_limit: TorqueLimit::both(limits.torque),
            standing: Standing::default(),
            following_error_limit: None,
            following_error_time: 0,
            straying: 0,
            guard: Guard::default(),
            fence: Fence::default(),
            power: Power::default(),
            supervision: Supervision::default(),
            arrival: None,
            task: Task::Follow,
            feed_forward: FeedForward::default(),
            target: None,
            queue: Queue::new(),
            lead: 0,
            is_motion_ordered: false,
            is_blocked: false,
            barred: None,
            is_enabled: false,
            reset: false,
            sample: Sample::default(),
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
        if self.status.fault.is_none() {
            if !self.power.is_on() {
                self.supervision.refresh(self.status.steps);
            }
            self.power.switch_on();
        }
    }

    /// Switches the power off, after the delay for the brake if there is one; then the motor coasts.
    pub fn power_off(&mut self) {
        self.queue.clear();
        if self.is_running() && self.power.delays.off > 0 {
            self.brake(false);
        }
        self.power.switch_off(self.is_running());
    }

    /// Cuts the power at once.
    pub fn cut_power(&mut self) {
        self.queue.clear();
        self.power.cut();
    }

    /// Cuts the power at once and for good: whoever switches it on, it stays off.
    pub fn retire(&mut self) {
        self.queue.clear();
        self.power.retire();
    }

    /// Sets the time a holding brake takes.
    pub fn set_power_delays(&mut self, delays: PowerDelays) {
        self.power.delays = delays;
    }

    /// Reacts to a fault that was noticed outside of the axis as to its own of the same kind; one that stands already
    /// counts more.
    pub fn raise(&mut self, fault: Fault) {
        let reaction = match fault {
            Fault::FollowingError => self.guard.following_error,
            Fault::DriveSignal => self.guard.drive_signal,
            Fault::Supervision => self.guard.supervision,
            Fault::Drive(_) | Fault::Lost | Fault::EmergencyStop => Reaction::Coast,
        };
        self.trip(fault, reaction);
    }

    /// Clears a fault, also in the drive. The axis stays off; a cause that persists is a new fault.
    pub fn reset_fault(&mut self) {
        self.reset = true;
        self.status.fault = None;
    }

    /// Does `order` now, on the fly; whatever was under way or waiting is given up.
    pub fn order(&mut self, order: Order) {
        if self.takes_orders() {
            self.queue.clear();
            self.execute(order);
        }
    }

    /// Does `order` when the present one and all that wait are done; ignored without power.
    ///
    /// # Errors
    /// 16 orders are waiting.
    pub fn then(&mut self, order: Order) -> Result<(), QueueFull> {
        if !self.takes_orders() {
            return Ok(());
        }
        self.queue.push(order)?;
        self.status.queued = self.queue.len();
        Ok(())
    }

    /// [`Order::MoveTo`], now.
    pub fn move_to(&mut self, target: Position, profile: Profile) {
        self.order(Order::MoveTo(target, profile));
    }

    /// [`Order::RunAt`], now.
    pub fn run_at(&mut self, velocity: Velocity, profile: Profile) {
        self.order(Order::RunAt(velocity, profile));
    }

    /// [`Order::Stop`], now.
    pub fn stop(&mut self, deceleration: Acceleration) {
        self.order(Order::Stop(deceleration));
    }

    /// Gives the drive this beside the set-points of the present order, until the next order or the end of this one by a
    /// limit or without power. What is not finite is left out.
    pub fn feed_forward(&mut self, feed_forward: FeedForward) {
        if self.takes_orders() && matches!(self.task, Task::Follow) {
            self.feed_forward = feed_forward.sanitised();
        }
    }

    /// The torque that is asked of the motor: the one ordered, or what the controllers of the drive make of a place.
    #[must_use]
    pub fn torque_demand(&self) -> Torque {
        match &self.task {
            Task::Push(push) if self.is_running() => push.torque(),
            Task::Follow | Task::Seek(_) | Task::Push(_) | Task::Output(_) | Task::Brake { .. } => {
                self.status.actual.torque
            }
        }
    }

    /// Calls the present actual position `position`. Nothing moves: demand, target, index and mark get the same
    /// offset, only the position limits keep their numbers. What is not within ±2^53 counts is ignored.
    pub fn set_position(&mut self, position: Position) {
        if PositionRange::EXACT.contains(position) {
            self.shift(position - self.travel.wrap(self.sample.position));
            self.report();
        }
    }

    /// Axis position minus position of the drive (MACCON MAC4 User Manual, section 4.3.2).
    #[must_use]
    pub fn offset(&self) -> Position {
        self.offset
    }

    /// Replaces the offset, as [`Axis::set_position`] does by way of the position.
    pub fn set_offset(&mut self, offset: Position) {
        if PositionRange::EXACT.contains(offset) {
            self.shift(offset - self.offset);
            self.report();
        }
    }

    /// How the positions of this axis repeat.
    #[must_use]
    pub fn travel(&self) -> Travel {
        self.travel
    }

    /// Makes the axis linear or circular. A circular one has no position limits.
    pub fn set_travel(&mut self, travel: Travel) {
        self.travel = travel;
        self.apply_limits();
        self.report();
    }

    /// The axis maxima.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Replaces the axis maxima, also on the move.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits.sanitised();
        self.barred = None;
        self.apply_limits();
    }

    /// Moves the axis as a stepper motor needs it, or no longer; see [`Stepping`].
    pub fn set_stepping(&mut self, stepping: Option<Stepping>) {
        self.generator.set_stepping(stepping);
    }

    /// Limits the torque further than the axis maximum does; signs are dropped, what is not a number allows none.
    pub fn set_torque_limit(&mut self, limit: TorqueLimit) {
        let side = |limit: Torque| TorqueLimit::both(limit).positive;
        self.torque_limit = TorqueLimit { positive: side(limit.positive), negative: side(limit.negative) };
    }

    /// The largest following error that is no fault; `None` allows any.
    pub fn set_following_error_limit(&mut self, limit: Option<Position>) {
        self.following_error_limit = limit;
    }

    /// For how many raster steps on end a larger following error is no fault yet; zero, as from the start, for none.
    pub fn set_following_error_time(&mut self, steps: u32) {
        self.following_error_time = steps;
    }

    /// When the axis counts as arrived at a target, and goes on to the next order; `None`: with its demand.
    pub fn set_target_window(&mut self, window: Option<TargetWindow>) {
        self.arrival = window.map(Arrival::new);
    }

    /// What the axis does about trouble.
    #[must_use]
    pub fn guard(&self) -> &Guard {
        &self.guard
    }

    /// Replaces what the axis does about trouble. Other levels of the inputs are told at once.
    pub fn set_guard(&mut self, guard: Guard) {
        if guard.levels != self.guard.levels {
            self.sample.switches = guard.levels.read(&self.status.inputs);
            self.status.switches = self.sample.switches;
        }
        self.guard = guard;
    }

    /// Expects [`Axis::confirm`] at least every so many raster steps while there is power; `None` expects nothing.
    pub fn set_supervision(&mut self, timeout: Option<NonZeroU32>) {
        self.supervision.expect(timeout, self.status.steps);
    }

    /// A sign of life of whoever commands the axis.
    pub fn confirm(&mut self) {
        self.supervision.refresh(self.status.steps);
    }

    /// Changes how the drive is set up, see [`Setting`]. A new source of the position makes the axis be there, its
    /// demand with it.
    pub fn configure(&mut self, setting: Setting) {
        self.drive.configure(setting);
        if matches!(setting, Setting::Source(_)) {
            self.sample.position = self.drive.signals().place + self.offset;
            self.status.actual.velocity = Velocity(0.0);
            self.place_at_actual();
            self.report();
        }
    }

    /// What a controller card shows of its connections.
    #[must_use]
    pub fn signals(&self) -> Signals {
        self.drive.signals()
    }

    /// Lets time pass in which the axis was not stepped because it [is quiet](Axis::is_quiet).
    pub fn rest(&mut self, seconds: f64) {
        self.drive.rest(seconds);
    }

    /// The simulated plant behind the drive, to change its load or to break something; real drives have none.
    pub fn plant(&mut self) -> Option<&mut Plant> {
        self.drive.plant()
    }

    /// The same plant, to look at.
    #[must_use]
    pub fn plant_view(&self) -> Option<&Plant> {
        self.drive.plant_view()
    }

    /// The state at the end of the last step.
    #[must_use]
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Powered off and mechanically at rest, nothing pending: another step would only count itself, and cool the
    /// motor as [`Axis::rest`] does.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        let off = match self.status.drive {
            DriveState::Disabled | DriveState::Fault(_) => true,
            DriveState::NotReady | DriveState::Enabling | DriveState::Enabled | DriveState::Lost => false,
        };
        let at_rest = self.status.actual.velocity.0 == 0.0;
        off && at_rest && !self.power.is_on() && !self.reset && self.drive.capabilities().sleeps
    }

    fn demand(&self) -> SetPoint {
        *self.generator.set_point()
    }

    fn is_running(&self) -> bool {
        self.power.is_on() && self.is_enabled
    }

    /// Whether a motion is going on or about to begin.
    fn is_moving(&self) -> bool {
        let is_pending = self.is_motion_ordered && !self.generator.is_done();
        self.lead > 0 || is_pending || self.demand().velocity.0 != 0.0
    }

    /// Whether an order is taken now: there is power, and neither a fault nor the end of it under way.
    #[must_use]
    pub fn takes_orders(&self) -> bool {
        let is_leaving = matches!(self.task, Task::Brake { off: true });
        self.is_running() && self.power.is_ready() && self.status.fault.is_none() && !is_leaving
    }

    fn place_at_actual(&mut self) {
        self.generator.place(self.sample.position, self.status.actual.velocity);
    }

    /// Lets the set-points of closed sides end where the demand is now.
    fn settle(&mut self) {
        if self.fence.settle(self.demand().position) {
            self.apply_limits();
        }
    }

    /// The highest torque as things stand.
    fn allowed_torque(&self) -> TorqueLimit {
        self.torque_limit.least(TorqueLimit::both(self.limits.torque))
    }

    /// Where set-points may be.
    fn range(&self) -> PositionRange {
        let software = match self.travel.turn() {
            None => self.limits.range(),
            Some(_) => PositionRange::EXACT,
        };
        self.fence.cut(software)
    }

    fn apply_limits(&mut self) {
        self.generator.set_limits(Limits { position: Some(self.range()), ..self.limits });
    }

    fn shift(&mut self, by: Position) {
        let shifted = |place: Option<Position>| place.map(|place| self.travel.wrap(place + by));
        self.status.index = shifted(self.status.index);
        self.status.mark = shifted(self.status.mark);
        self.offset = self.offset + by;
        self.sample.position = self.sample.position + by;
        self.target = self.target.map(|target| target + by);
        self.generator.shift(by);
        self.fence.shift(by);
        self.apply_limits();
    }
}
