//! Per-cycle set-points: a master shapes the motion, the axis follows it step by step.
//!
//! A step at velocity `w` covers `w · T`. No profile counts and no jerk limit, only the maxima of the axis. As
//! long as they allow it, every set-point is exactly on the line to the target. When they do not, the axis
//! falls behind and catches up: seen from the line, which has a velocity of its own, each step takes the
//! highest velocity from which a stop still ends on it.

use core::num::NonZeroU32;

use super::braking::{Brake, RESERVE};
use super::start::{Start, Step};
use crate::limits::PositionRange;
use crate::units::{Position, Velocity};

/// A target and the line to it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Track {
    Position {
        target: Position,
        /// Where the line has come to.
        line: Position,
        /// Steps until the target.
        left: u32,
    },
    Velocity {
        target: Velocity,
        /// Steps until the target.
        left: u32,
    },
}

impl Track {
    /// Moves the coordinate system.
    pub(super) fn shift(&mut self, by: Position) {
        match self {
            Self::Position { target, line, .. } => {
                *target = PositionRange::EXACT.nearest(*target + by);
                *line = *line + by;
            }
            Self::Velocity { .. } => {}
        }
    }

    /// Whether the target lies outside of `range`.
    pub(super) fn reaches_beyond(self, range: PositionRange) -> bool {
        match self {
            Self::Position { target, .. } => !range.contains(target),
            Self::Velocity { .. } => false,
        }
    }

    /// Lets `steps` go by in which the axis does not follow.
    pub(super) fn pass(&mut self, steps: NonZeroU32) {
        let steps = steps.get();
        match self {
            Self::Position { target, line, left } => {
                let share = f64::from(steps.min(*left)) / f64::from((*left).max(1));
                *line = if *left > steps { Position(line.0 + (target.0 - line.0) * share) } else { *target };
                *left = left.saturating_sub(steps);
            }
            Self::Velocity { left, .. } => *left = left.saturating_sub(steps),
        }
    }

    /// Goes on by one step; an axis with a start/stop velocity may jump within it.
    pub(super) fn step(&mut self, start: &Start<'_>, start_stop: f64) -> Step {
        let pace = Pace { start, start_stop };
        match self {
            Self::Position { target, line, left } => {
                let end = start.range.nearest(*target);
                let next = part(line.0, end.0, *left);
                let step = pace.to_line(line.0, next);
                *line = Position(next);
                *left = left.saturating_sub(1);
                Step { is_done: *left == 0 && step.set_point.position == end, ..step }
            }
            Self::Velocity { target, left } => {
                let end = pace.cut(target.0);
                let step = pace.go(part(start.velocity(), end, *left), None);
                *left = left.saturating_sub(1);
                Step { is_done: *left == 0 && step.set_point.velocity == Velocity(end), ..step }
            }
        }
    }
}

/// The next value on the way from one to another in `left` steps; exactly the other in the last.
fn part(from: f64, to: f64, left: u32) -> f64 {
    if left <= 1 { to } else { from + (to - from) / f64::from(left) }
}

/// How a step may go on.
struct Pace<'a> {
    start: &'a Start<'a>,
    start_stop: f64,
}

impl Pace<'_> {
    /// One step of the axis while the line goes on from `line` to `next`.
    fn to_line(&self, line: f64, next: f64) -> Step {
        let own = (next - line) / self.start.time;
        let behind = self.start.way_to(Position(next)) - own;
        let most = self.start.most_up().min(self.start.most_down());
        let closing = Brake::new(most, 0.0).highest(behind.abs());
        self.go(own + closing.copysign(behind), Some(next))
    }

    /// Goes on at `wanted` as far as the axis and its limits allow.
    fn go(&self, wanted: f64, end: Option<f64>) -> Step {
        let (lowest, highest) = self.reach();
        let wanted = self.cut(wanted).max(lowest).min(highest);
        let allowed = self.start.contain(wanted, 0.0, Brake::new(self.start.most_down(), self.start_stop));
        let set_point = self.start.straight(allowed, end, 0.0);
        let is_cut = (allowed - wanted).abs() > wanted.abs() * RESERVE;
        Step { set_point, is_straight: true, is_done: false, is_cut }
    }

    /// The velocities that may follow on the present one.
    fn reach(&self) -> (f64, f64) {
        let velocity = self.start.velocity();
        let low = if velocity > 0.0 { 0.0 } else { -self.start_stop };
        let high = if velocity < 0.0 { 0.0 } else { self.start_stop };
        let can_jump = velocity.abs() <= self.start_stop;
        let (lowest, highest) = (-self.highest(-velocity), self.highest(velocity));
        if can_jump { (lowest.min(low), highest.max(high)) } else { (lowest, highest) }
    }

    /// The highest velocity that may follow on `velocity`; what is left of a step that brakes to standstill speeds
    /// the axis up.
    fn highest(&self, velocity: f64) -> f64 {
        let up = self.start.most_up() * (1.0 + RESERVE);
        let down = self.start.most_down() * (1.0 + RESERVE);
        if velocity >= 0.0 {
            velocity + up
        } else if velocity + down <= 0.0 {
            velocity + down
        } else {
            up * (1.0 + velocity / down)
        }
    }

    fn cut(&self, velocity: f64) -> f64 {
        let most = self.start.limits.velocity.0;
        velocity.clamp(-most, most)
    }
}
