//! Profile-driven motion of limited jerk: a curve that is planned once and then read raster step by raster step.
//!
//! A new course, profile or limit plans anew from the present position, velocity and acceleration.

use super::Course;
use super::scurve::{Bounds, Curve, Fence, State};
use super::start::Step;
use crate::limits::Limits;
use crate::profile::{Profile, SetPoint};
use crate::units::{Acceleration, Jerk, Position, Velocity, cut};

/// The jerk of an axis that has no maximum: the acceleration changes within a step.
const ABRUPT: f64 = 1e18;

/// What a curve was planned for.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plan {
    course: Course,
    profile: Profile,
    limits: Limits,
}

/// A curve under way.
#[derive(Clone, Debug)]
pub(super) struct Ride {
    /// What the curve is for; none while it is to be planned anew.
    plan: Option<Plan>,
    curve: Curve,
    /// Raster steps since it was planned.
    steps: u32,
    now: State,
}

impl Ride {
    /// A ride that begins at the set-point `now`.
    pub(super) fn new(now: &SetPoint, limits: &Limits) -> Self {
        let now = state(now, limits);
        Self { plan: None, curve: Curve::new(&now), steps: 0, now }
    }

    /// Follows `course`. A ride for just this course, profile and limits goes on; any other is planned from its
    /// present state.
    pub(super) fn follow(&mut self, course: Course, profile: &Profile, limits: &Limits) {
        let plan = Plan { course, profile: *profile, limits: *limits };
        if self.plan != Some(plan) || self.steps == u32::MAX {
            self.curve = plan.curve(&self.now);
            self.plan = Some(plan);
            self.steps = 0;
        }
    }

    /// Moves the coordinate system.
    pub(super) fn shift(&mut self, by: Position) {
        self.now.position += by.0;
        self.plan = None;
    }

    /// The next raster step of `seconds`.
    pub(super) fn step(&mut self, seconds: f64) -> Step {
        self.steps = self.steps.saturating_add(1);
        let time = f64::from(self.steps) * seconds;
        let before = core::mem::replace(&mut self.now, self.curve.at(time));
        let now = &self.now;
        let set_point = SetPoint {
            position: Position(now.position),
            velocity: Velocity(now.velocity + 0.0), // makes a negative zero positive
            acceleration: Acceleration((now.velocity - before.velocity) / seconds),
        };
        let is_over = time >= self.curve.duration();
        let (is_done, is_cut) = self.plan.map_or((is_over, false), |plan| plan.judge(&before, now, is_over));
        Step { set_point, is_straight: false, is_done, is_cut }
    }
}

/// Whether the axis can stop within its position limits as fast as it can, jerk included.
pub(super) fn can_stop(now: &SetPoint, profile: &Profile, limits: &Limits) -> bool {
    fence(profile, limits).holds(&state(now, limits))
}

/// The state after a motion that no jerk bounded: with as much of its acceleration as can be taken back before the
/// highest speed.
fn state(now: &SetPoint, limits: &Limits) -> State {
    let SetPoint { position, velocity, acceleration: Acceleration(acceleration) } = *now;
    let room = limits.velocity.0 - if acceleration < 0.0 { -velocity.0 } else { velocity.0 };
    let jerk = limits.jerk.map_or(ABRUPT, |jerk| jerk.0);
    let most = (2.0 * jerk * room.max(0.0)).sqrt().min(limits.acceleration.0);
    State { position: position.0, velocity: velocity.0, acceleration: cut(acceleration, most) }
}

fn fence(profile: &Profile, limits: &Limits) -> Fence {
    let jerk = limits.jerk.map_or(ABRUPT, |jerk| jerk.0);
    Fence {
        profile: Bounds {
            velocity: profile.velocity.0,
            acceleration: profile.acceleration.0,
            deceleration: profile.deceleration.0,
            jerk: profile.jerk.map_or(ABRUPT, |Jerk(jerk)| jerk),
        },
        axis: Bounds {
            velocity: limits.velocity.0,
            acceleration: limits.acceleration.0,
            deceleration: limits.braking().0,
            jerk,
        },
        min: limits.range().min().0,
        max: limits.range().max().0,
    }
}

impl Plan {
    fn curve(&self, from: &State) -> Curve {
        let fence = fence(&self.profile, &self.limits);
        match self.course {
            Course::MoveTo(target) => fence.move_to(from, target.0),
            Course::RunAt(velocity) => fence.run_at(from, velocity.0),
            Course::Stop => fence.run_at(from, 0.0),
        }
    }

    /// Whether a step has reached the goal, and whether a position limit keeps it from it.
    fn judge(&self, before: &State, now: &State, is_over: bool) -> (bool, bool) {
        let Course::RunAt(wanted) = self.course else { return (is_over, false) };
        let speed = wanted.abs().0.min(self.profile.velocity.0);
        let ahead = |state: &State| if wanted.0 < 0.0 { -state.velocity } else { state.velocity };
        let close = speed * 1e-9;
        let is_there = (ahead(now) - speed).abs() <= close;
        // A run only slows down from its speed, or stops for good, because of a limit.
        let is_braked = ahead(now) < ahead(before) && ahead(before) <= speed + close;
        let is_stopped = is_over && speed > 0.0;
        (is_there, is_stopped || (is_braked && !is_there))
    }
}
