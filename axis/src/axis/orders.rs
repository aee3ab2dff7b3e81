//! What becomes of an order.

use super::push::Push;
use super::seek::Seeking;
use super::{Axis, Task};
use crate::generator::Goal;
use crate::order::{Base, Order, Seek, SeekState};
use crate::profile::Profile;
use crate::units::{Acceleration, Position, Torque, cut};

impl Axis {
    /// Begins `order`, from whatever was under way.
    pub(super) fn execute(&mut self, order: Order) {
        self.begin();
        let was_moving = self.is_moving();
        let target = core::mem::take(&mut self.target);
        match order {
            Order::MoveTo(place, profile) => {
                self.aim(self.travel.target(place, self.demand().position), profile);
            }
            Order::MoveBy { distance, from, profile } => {
                let start = match from {
                    Base::Target => target.unwrap_or(self.demand().position),
                    Base::Demand => self.demand().position,
                    Base::Actual => self.sample.position,
                };
                self.aim(start + distance, profile);
            }
            Order::RunAt(velocity, profile) => self.generator.command(Goal::RunAt(velocity), profile),
            Order::Stop(deceleration) => self.ramp_down(deceleration),
            Order::Brake => self.brake(false),
            Order::TrackPosition { target, over } => {
                let target = self.travel.nearest(target, self.demand().position);
                self.generator.command(Goal::TrackPosition { target, over }, Profile::default());
            }
            Order::TrackVelocity { target, over } => {
                self.generator.command(Goal::TrackVelocity { target, over }, Profile::default());
            }
            Order::Push { torque, slope } => self.push(torque, slope),
            Order::Output(share) => self.put_out(share),
            Order::Seek(seek) => self.seek(seek),
        }
        self.is_motion_ordered = self.is_motion(&order);
        if self.is_motion_ordered && !was_moving {
            self.lead = self.drive.capabilities().lead;
        }
    }

    /// Whether `order`, which has begun, moves an axis that stands.
    fn is_motion(&self, order: &Order) -> bool {
        match order {
            Order::MoveTo(..) | Order::MoveBy { .. } => self.target != Some(self.demand().position),
            Order::RunAt(velocity, _) | Order::TrackVelocity { target: velocity, .. } => velocity.0 != 0.0,
            Order::TrackPosition { target, .. } => *target != self.travel.wrap(self.demand().position),
            Order::Seek(_) => true,
            Order::Stop(_) | Order::Brake | Order::Push { .. } | Order::Output(_) => false,
        }
    }

    /// Leaves what was under way.
    fn begin(&mut self) {
        self.task = Task::Follow;
        self.is_blocked = false;
        self.status.done = false;
        self.status.limited = false;
        self.status.on_target = false;
        self.status.seek = SeekState::None;
        if let Some(arrival) = &mut self.arrival {
            arrival.restart();
        }
        self.settle();
    }

    fn aim(&mut self, target: Position, profile: Profile) {
        self.target = Some(target);
        self.generator.command(Goal::MoveTo(target), profile);
    }

    pub(super) fn ramp_down(&mut self, deceleration: Acceleration) {
        self.generator.command(Goal::Stop, Profile { deceleration, ..Profile::default() });
    }

    pub(super) fn brake(&mut self, off: bool) {
        self.ramp_down(self.guard.emergency_deceleration);
        self.task = Task::Brake { off };
    }

    fn push(&mut self, torque: Torque, slope: Torque) {
        let limit = self.torque_limit.0.min(self.limits.torque.0);
        let torque = Torque(if torque.0.is_nan() { 0.0 } else { cut(torque.0, limit) });
        if self.fence.blocks(torque.0) {
            self.block();
        } else {
            let slope = slope.0 * self.period.seconds();
            self.task = Task::Push(Push::new(torque, slope, self.status.actual.torque));
        }
    }

    fn put_out(&mut self, share: f64) {
        self.task = Task::Output(if share.is_nan() { 0.0 } else { cut(share, 1.0) });
    }

    fn seek(&mut self, seek: Seek) {
        let seeking = Seeking::new(seek);
        self.generator.command(Goal::RunAt(seek.velocity), seeking.profile());
        self.task = Task::Seek(seeking);
        self.status.seek = SeekState::Searching;
    }
}
