//! What becomes of an order.

use super::fence::Side;
use super::push::Push;
use super::seek::Seeking;
use super::{Axis, Task};
use crate::generator::Goal;
use crate::order::{Base, Order, Seek, SeekState};
use crate::profile::{FeedForward, Profile};
use crate::units::{Acceleration, Position, Torque, Velocity, cut};

impl Axis {
    /// Begins `order`, from whatever was under way.
    pub(super) fn execute(&mut self, order: Order) {
        self.begin();
        let was_moving = self.is_moving();
        let target = core::mem::take(&mut self.target);
        self.barred = self.barred.take().filter(|_| matches!(order, Order::Push { .. }));
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
        self.feed_forward = FeedForward::default();
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
        self.feed_forward = FeedForward::default();
        self.task = Task::Brake { off };
    }

    fn push(&mut self, torque: Torque, slope: Torque) {
        let torque = self.allowed_torque().cut(torque);
        if self.fence.blocks(torque.0) || self.is_barred(torque) {
            self.block();
        } else if self.leads_out(torque) {
            self.bar(torque);
        } else {
            self.barred = None;
            let slope = slope.0 * self.period.seconds();
            self.task = Task::Push(Push::new(torque, slope, self.status.actual.torque));
        }
    }

    /// Whether the axis has been stopped at a position limit and this torque does not lead away from it. So one that
    /// brakes there goes on braking, and then holds, whatever torques are ordered meanwhile.
    fn is_barred(&self, torque: Torque) -> bool {
        self.barred.is_some_and(|side| !side.is_ahead(Velocity(-torque.0)))
    }

    /// Whether the way the axis is on, or a raster step of this torque, leads out of the position limits.
    fn leads_out(&self, torque: Torque) -> bool {
        let velocity = self.status.actual.velocity;
        let gain = if torque.0 == 0.0 { 0.0 } else { torque.0.signum() };
        let gain = Velocity(gain * self.limits.acceleration.0 * self.period.seconds());
        self.would_leave(velocity) || self.would_leave(velocity + gain)
    }

    /// Stops an axis that gives this torque at the position limit ahead.
    pub(super) fn bar(&mut self, torque: Torque) {
        let Velocity(velocity) = self.status.actual.velocity;
        let ahead = Velocity(if velocity == 0.0 { torque.0 } else { velocity });
        self.barred = Some(if Side::Negative.is_ahead(ahead) { Side::Negative } else { Side::Positive });
        self.block();
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
