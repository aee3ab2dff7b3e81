//! One raster step: set-point to the drive, feedback from it, and what follows from both.

use super::fence::{Change, Side};
use super::seek::{Sample, Seeking};
use super::{Axis, Reaction, Task};
use crate::drive::{Command, Demand, DriveState, Feedback};
use crate::generator::Goal;
use crate::inputs::Latches;
use crate::limits::TorqueLimit;
use crate::order::{Finish, SeekState};
use crate::profile::{FeedForward, Profile, SetPoint};
use crate::status::{Fault, Motion};
use crate::units::{Acceleration, Position, Torque, Velocity};

impl Axis {
    /// Runs one raster period.
    pub fn step(&mut self) {
        let was_running = self.is_running();
        if was_running {
            self.generate();
        }
        self.stand();
        let command = self.drive_command();
        self.reset = false;
        let feedback = self.drive.step(&command);
        self.status.steps = self.status.steps.wrapping_add(1);
        self.read(&feedback);
        self.power.step(self.is_enabled);
        self.supervise(&feedback, was_running);
        self.watch_switches();
        if was_running && self.is_running() {
            self.advance();
        } else {
            self.task = Task::Follow;
            self.feed_forward = FeedForward::default();
            self.barred = None;
            self.lead = 0;
            self.is_motion_ordered = false;
            self.place_at_actual();
        }
        self.normalise();
        self.report();
        self.arrive();
        self.go_on();
    }

    fn generate(&mut self) {
        match &mut self.task {
            Task::Follow | Task::Seek(_) | Task::Brake { .. } => match self.lead.checked_sub(1) {
                Some(left) => self.lead = left,
                None => self.generator.step(),
            },
            Task::Push(push) => push.step(),
            Task::Output(_) => {}
        }
    }

    fn drive_command(&self) -> Command {
        let mut torque_limit = self.allowed_torque();
        let demand = match &self.task {
            Task::Push(push) => Demand::Torque(push.torque()),
            Task::Output(share) => Demand::Output(*share),
            Task::Follow | Task::Seek(_) | Task::Brake { .. } => {
                let demand = self.demand();
                Demand::Position(SetPoint { position: demand.position - self.offset, ..demand })
            }
        };
        if let Some(limit) = self.pushes() {
            torque_limit = torque_limit.least(TorqueLimit::both(limit));
        }
        if let Some(limit) = self.standing.limit() {
            torque_limit = torque_limit.least(limit);
        }
        Command {
            enable: self.power.is_on(),
            demand,
            feed_forward: self.feed_forward,
            moving: self.is_running() && self.is_moving(),
            torque_limit,
            velocity_limit: self.limits.velocity,
            reset_fault: self.reset,
        }
    }

    /// The torque of a search that pushes against something. A search that begins on the move brakes to its velocity
    /// with all that the axis has; what that takes is not yet the torque looked for.
    fn pushes(&self) -> Option<Torque> {
        let Task::Seek(seeking) = &self.task else { return None };
        match Motion::of(&self.demand()) {
            Motion::Decelerating => None,
            Motion::Off | Motion::Standstill | Motion::Accelerating | Motion::Constant => seeking.pushes(),
        }
    }

    fn read(&mut self, feedback: &Feedback) {
        self.is_enabled = feedback.state == DriveState::Enabled;
        self.status.drive = feedback.state;
        self.sample.latches = Latches::default();
        self.status.latches = Latches::default();
        if !feedback.valid {
            return;
        }
        self.sample = Sample {
            switches: self.guard.levels.read(&feedback.inputs),
            latches: self.guard.levels.turn(feedback.latches.map(|place| Some(place + self.offset))),
            torque: feedback.torque,
            position: feedback.position + self.offset,
        };
        self.status.actual.velocity = feedback.velocity;
        self.status.actual.torque = feedback.torque;
        self.status.voltage = feedback.voltage;
        self.status.temperature = feedback.temperature;
        self.status.overload = feedback.overload;
        self.status.inputs = feedback.inputs;
        self.status.switches = self.sample.switches;
        self.status.latches = self.sample.latches.map(|place| Some(self.travel.wrap(place)));
        self.status.index = self.status.latches.index.or(self.status.index);
    }

    fn supervise(&mut self, feedback: &Feedback, was_running: bool) {
        match feedback.state {
            DriveState::Fault(cause) => self.trip(Fault::Drive(cause), Reaction::Coast),
            DriveState::Lost => self.trip(Fault::Lost, Reaction::Coast),
            DriveState::NotReady | DriveState::Disabled | DriveState::Enabling | DriveState::Enabled => {}
        }
        if self.sample.switches.emergency_stop {
            self.trip(Fault::EmergencyStop, Reaction::Coast);
        }
        if !self.power.is_on() {
            self.straying = 0;
            return;
        }
        if self.sample.switches.drive_fault {
            self.trip(Fault::DriveSignal, self.guard.drive_signal);
        }
        if self.supervision.is_expired(self.status.steps) {
            self.trip(Fault::Supervision, self.guard.supervision);
        }
        if self.has_strayed(was_running) {
            if self.status.fault.is_none() {
                self.place_at_actual();
            }
            self.trip(Fault::FollowingError, self.guard.following_error);
        }
    }

    /// Whether the axis has been too far from its demand for longer than is tolerated.
    fn has_strayed(&mut self, was_running: bool) -> bool {
        let strays = was_running && self.strays();
        self.straying = if strays { self.straying.saturating_add(1) } else { 0 };
        self.straying > self.following_error_time
    }

    /// Whether the axis is too far from its demand. One that pushes or brakes after a fault may be.
    fn strays(&self) -> bool {
        let may_stray = match &self.task {
            Task::Follow | Task::Brake { off: false } => false,
            Task::Seek(seeking) => seeking.pushes().is_some(),
            Task::Push(_) | Task::Output(_) | Task::Brake { off: true } => true,
        };
        let error = self.demand().position - self.sample.position;
        !may_stray && self.following_error_limit.is_some_and(|limit| error.abs() > limit.abs())
    }

    pub(super) fn trip(&mut self, fault: Fault, reaction: Reaction) {
        let is_first = self.status.fault.is_none();
        self.status.fault.get_or_insert(fault);
        self.queue.clear();
        match reaction {
            Reaction::Brake if self.is_running() && !matches!(self.task, Task::Output(_)) => {
                if is_first {
                    self.brake(true);
                }
            }
            Reaction::Brake | Reaction::Coast => self.power.cut(),
        }
    }

    fn watch_switches(&mut self) {
        let Sample { switches, position, .. } = self.sample;
        for change in self.fence.watch(&switches, position, self.guard.behind_limit) {
            match change {
                Change::Opened => self.apply_limits(),
                Change::Closed(side) if self.is_running() => self.close(side),
                Change::Closed(_) => {}
            }
        }
    }

    /// A limit switch was met.
    fn close(&mut self, side: Side) {
        match &self.task {
            Task::Seek(seeking) if seeking.is_after(side) => {}
            Task::Brake { .. } => {}
            Task::Output(_) => {
                self.is_blocked = true;
                self.power.cut();
            }
            Task::Seek(_) if side.is_ahead(self.demand().velocity) => {
                self.status.seek = SeekState::Failed;
                self.block();
            }
            Task::Follow if side.is_ahead(self.demand().velocity) => self.block(),
            Task::Push(push)
                if side.is_ahead(self.status.actual.velocity) || side.is_ahead(push.direction()) =>
            {
                self.block();
            }
            Task::Follow | Task::Seek(_) | Task::Push(_) => self.settle(),
        }
    }

    /// Ends what was ordered because a limit stands in the way.
    pub(super) fn block(&mut self) {
        self.queue.clear();
        self.brake(false);
        self.is_blocked = true;
    }

    fn advance(&mut self) {
        match self.task {
            Task::Follow => {}
            Task::Seek(seeking) => self.advance_search(seeking),
            Task::Push(_) | Task::Output(_) => {
                self.place_at_actual();
                self.stay_inside();
            }
            Task::Brake { off } => {
                if self.generator.is_done() {
                    self.task = Task::Follow;
                    self.settle();
                    if off {
                        self.power.switch_off(true);
                    }
                }
            }
        }
    }

    fn advance_search(&mut self, mut seeking: Seeking) {
        if seeking.is_finishing {
            if self.generator.is_done() {
                self.task = Task::Follow;
                self.settle();
            }
            return;
        }
        let is_braking = seeking.pushes().is_some() && self.pushes().is_none();
        let torque = if is_braking { Torque(0.0) } else { self.sample.torque };
        if let Some(mark) = seeking.look(&Sample { torque, ..self.sample }) {
            self.status.seek = SeekState::Found;
            self.status.mark = Some(self.travel.wrap(mark));
            self.finish(&seeking, mark);
            seeking.is_finishing = true;
        } else if self.generator.is_limited() {
            self.status.seek = SeekState::Failed;
            self.block();
            return;
        }
        self.task = Task::Seek(seeking);
    }

    fn finish(&mut self, seeking: &Seeking, mark: Position) {
        let mut profile = seeking.profile();
        if seeking.is_after_limit() {
            profile.deceleration = self.harder(profile.deceleration, self.guard.emergency_deceleration);
        }
        match seeking.finish() {
            Finish::Ramp => self.ramp_down(profile.deceleration),
            Finish::Abrupt => {
                if seeking.pushes().is_some() {
                    self.place_at_actual();
                }
                self.ramp_down(Acceleration(0.0));
            }
            Finish::Return => self.generator.command(Goal::MoveTo(mark), profile),
        }
    }

    /// The harder of two ramps, of which zero is the axis maximum.
    fn harder(&self, one: Acceleration, other: Acceleration) -> Acceleration {
        let rate =
            |ramp| self.limits.clamp(Profile { deceleration: ramp, ..Profile::default() }).deceleration;
        if rate(one) > rate(other) { one } else { other }
    }

    /// Keeps an axis without a demand position inside the position limits: it brakes where a stop with the
    /// highest deceleration would end at one.
    fn stay_inside(&mut self) {
        if !self.would_leave(self.status.actual.velocity) {
            return;
        }
        match self.task {
            Task::Output(_) => {
                self.is_blocked = true;
                self.power.cut();
            }
            Task::Push(push) => self.bar(push.torque()),
            Task::Follow | Task::Seek(_) | Task::Brake { .. } => self.block(),
        }
    }

    /// Whether a stop with the highest deceleration from this velocity here would end beyond a position limit.
    pub(super) fn would_leave(&self, velocity: Velocity) -> bool {
        let (speed, range) = (velocity.abs().0, self.range());
        let way = speed * speed / (2.0 * self.limits.braking().0) + 2.0 * speed * self.period.seconds();
        let end = self.sample.position + Position(if velocity.0 < 0.0 { -way } else { way });
        (velocity.0 > 0.0 && end > range.max()) || (velocity.0 < 0.0 && end < range.min())
    }

    /// Takes whole turns off a position that has become large.
    fn normalise(&mut self) {
        let excess = self.travel.excess(self.sample.position);
        if excess.0 != 0.0 {
            self.shift(-excess);
        }
    }

    pub(super) fn report(&mut self) {
        let demand = self.demand();
        let is_running = self.is_running();
        self.status.actual.position = self.travel.wrap(self.sample.position);
        self.status.demand = SetPoint { position: self.travel.wrap(demand.position), ..demand };
        self.status.following_error = demand.position - self.sample.position;
        self.status.motion = if is_running { Motion::of(&demand) } else { Motion::Off };
        self.status.done = is_running
            && match &self.task {
                Task::Follow => self.generator.is_done(),
                Task::Push(push) => push.is_done(),
                Task::Output(_) => true,
                Task::Seek(_) | Task::Brake { .. } => false,
            };
        self.status.limited = is_running && (self.is_blocked || self.generator.is_limited());
        if is_running && self.power.is_opening() {
            self.status.drive = DriveState::Enabling;
        }
    }

    /// Tells whether the axis has arrived where its demand is.
    fn arrive(&mut self) {
        self.status.on_target = self.status.done
            && self.arrival.as_mut().is_none_or(|arrival| arrival.step(self.status.following_error));
    }

    /// Goes on with the next order that waits, once the present one is done.
    fn go_on(&mut self) {
        if self.status.on_target
            && self.takes_orders()
            && let Some(order) = self.queue.pop()
        {
            self.execute(order);
        }
        self.status.queued = self.queue.len();
    }
}
