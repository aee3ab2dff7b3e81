//! What an axis is at: how a job begins, goes on and ends.

use axis::{Motion, Order, SeekState};

use super::{Controller, Leaving, Work};
use crate::mac4::job::{self, Job};
use crate::mac4::justify::Justification;
use crate::mac4::units::CYCLE;
use crate::mac4::{Instruction, Mode};
use crate::vendor::Scope;

impl Controller {
    /// Begins a job: its mode and the parameters act.
    pub(super) fn begin(&mut self, job: Job, scope: &mut Scope<'_>) {
        self.pos_end = false;
        self.jus_end = false;
        self.work = Work::Idle;
        if job.mode == Mode::Disable {
            return self.leave(Leaving::Off, scope);
        }
        self.mode = job.mode;
        self.setup().apply(scope);
        match job.mode {
            Mode::Enable => scope.axis.power_on(),
            Mode::Brake => scope.axis.order(Order::Brake),
            Mode::Test => {
                scope.axis.power_on();
                self.work = Work::Starting(job);
                self.set_off(scope);
            }
            Mode::SearchIndexCoarse
            | Mode::SearchIndex
            | Mode::Home
            | Mode::FindEdge
            | Mode::Speed
            | Mode::Positioning
            | Mode::VelocityTracking
            | Mode::PositionTracking => {
                self.work = Work::Starting(job);
                self.set_off(scope);
            }
            Mode::Disable | Mode::Reset => {}
        }
    }

    /// Gives the order of a job that waits for power, if there is power.
    fn set_off(&mut self, scope: &mut Scope<'_>) {
        let Work::Starting(job) = self.work else { return };
        if !scope.axis.takes_orders() {
            return;
        }
        let (work, order) = match job.mode {
            Mode::Positioning => (Work::Moving, Order::MoveTo(job.target, job.profile)),
            Mode::Speed => (Work::Running, Order::RunAt(job.velocity, job.profile)),
            Mode::VelocityTracking => (Work::Running, self.tracking(scope)),
            Mode::PositionTracking => (Work::Running, job::track_position(self.get(scope, Instruction::WAT))),
            Mode::Test => (Work::Running, self.output(scope)),
            Mode::SearchIndexCoarse | Mode::SearchIndex | Mode::Home | Mode::FindEdge => {
                let (justification, order) = Justification::begin(job, &scope.axis.status().switches);
                (Work::Justifying(justification), order)
            }
            Mode::Disable | Mode::Enable | Mode::Brake | Mode::Reset => return self.work = Work::Idle,
        };
        self.work = work;
        scope.axis.order(order);
    }

    /// Follows the axis after a raster step.
    pub(crate) fn step(&mut self, scope: &mut Scope<'_>) {
        let fault = scope.axis.status().fault;
        if let Some(fault) = fault.filter(|_| self.seen != fault) {
            self.fail(fault, scope);
        }
        self.seen = fault;
        if self.leaving.is_some() {
            return self.finish_leaving(scope);
        }
        match self.work {
            Work::Idle => {}
            Work::Starting(_) => self.set_off(scope),
            Work::Moving => self.watch_move(scope),
            Work::Running => self.watch_run(scope),
            Work::Justifying(justification) => self.watch_justification(justification, scope),
        }
    }

    /// Ends a positioning move at its target, or where a limit has stopped it.
    fn watch_move(&mut self, scope: &mut Scope<'_>) {
        let status = scope.axis.status();
        if status.limited && status.done {
            self.stop_at_limit(scope);
        } else if status.on_target {
            self.pos_end = true;
            self.end(scope);
        }
    }

    /// Watches a motion without an end. A limit ends it; in the mode "test" it cuts the power (section 5.13).
    fn watch_run(&mut self, scope: &mut Scope<'_>) {
        let status = scope.axis.status();
        let is_tracking = matches!(self.mode, Mode::VelocityTracking | Mode::PositionTracking);
        if status.motion == Motion::Off {
            self.leave(Leaving::Off, scope);
        } else if status.limited && status.done && self.mode != Mode::Test {
            self.stop_at_limit(scope);
        } else if is_tracking && status.steps.is_multiple_of(u64::from(CYCLE)) {
            self.interrupt(Instruction::WIRQ6, scope.dictionary);
        }
    }

    fn watch_justification(&mut self, mut justification: Justification, scope: &mut Scope<'_>) {
        let status = scope.axis.status();
        if !status.done {
            return;
        }
        if status.seek == SeekState::Failed || status.limited && status.seek != SeekState::Found {
            return self.stop_at_limit(scope);
        }
        match justification.next(scope.axis) {
            Some(order) => {
                scope.axis.order(order);
                self.work = Work::Justifying(justification);
            }
            None => {
                self.jus_end = true;
                self.end(scope);
            }
        }
    }

    /// The end of a job that has one: the interrupt, and the next that waits.
    fn end(&mut self, scope: &mut Scope<'_>) {
        self.work = Work::Idle;
        self.interrupt(Instruction::WIRQ4, scope.dictionary);
        if let Some(job) = self.waiting.pop_front() {
            self.begin(job, scope);
        }
    }

    /// The axis stands at a limit. Behind a switch it is in the mode "brake"; at a software limit it is switched off
    /// (section 4.3.1.1).
    fn stop_at_limit(&mut self, scope: &mut Scope<'_>) {
        let switches = scope.axis.status().switches;
        if switches.positive_limit || switches.negative_limit {
            self.forget();
            self.mode = Mode::Brake;
            self.next = Mode::Brake;
        } else {
            self.leave(Leaving::Off, scope);
        }
    }
}
