//! The set-point generator: goals in, one set-point a raster step out.

mod trapezoid;

use self::trapezoid::Ramps;
use crate::limits::{Limits, PositionRange};
use crate::profile::{Profile, SetPoint};
use crate::units::{Acceleration, Period, Position, Velocity};

const STANDSTILL: Velocity = Velocity(0.0);

/// What the set-points are to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Stand at a position.
    MoveTo(Position),
    /// Run at a velocity, cut to the profile velocity.
    RunAt(Velocity),
    /// Ramp down and stand.
    Stop,
}

/// Generates one set-point a raster step.
#[derive(Clone, Debug)]
pub struct Generator {
    period: f64,
    limits: Limits,
    profile: Profile,
    goal: Goal,
    now: SetPoint,
    done: bool,
    limited: bool,
}

impl Generator {
    /// A generator that stands at position 0.
    #[must_use]
    pub fn new(period: Period, limits: Limits) -> Self {
        Self {
            period: period.seconds(),
            limits: limits.sanitised(),
            profile: Profile::default(),
            goal: Goal::Stop,
            now: SetPoint::default(),
            done: true,
            limited: false,
        }
    }

    /// Starts over from a place and a velocity, to ramp down at the axis maximum. What is not finite counts
    /// as zero; the velocity is cut to the axis maximum.
    pub fn place(&mut self, position: Position, velocity: Velocity) {
        let speed = velocity.0.clamp(-self.limits.velocity.0, self.limits.velocity.0);
        self.now = SetPoint {
            position: Position(finite(position.0)),
            velocity: Velocity(finite(speed)),
            acceleration: Acceleration(0.0),
        };
        self.command(Goal::Stop, Profile::default());
    }

    /// Replaces the goal and the profile; valid in any state of motion.
    ///
    /// A target is cut to ±2^53 counts. A goal that is not a number is a stop.
    pub fn command(&mut self, goal: Goal, profile: Profile) {
        self.goal = match goal {
            Goal::MoveTo(target) if target.0.is_nan() => Goal::Stop,
            Goal::RunAt(velocity) if velocity.0.is_nan() => Goal::Stop,
            Goal::MoveTo(target) => Goal::MoveTo(PositionRange::EXACT.nearest(target)),
            Goal::RunAt(_) | Goal::Stop => goal,
        };
        self.profile = profile;
        self.done = false;
        self.limited = false;
    }

    /// Replaces the axis maxima. What a motion in progress cannot keep any more (a velocity, a position) it
    /// approaches as fast as the axis can.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits.sanitised();
    }

    /// The axis maxima.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Moves the coordinate system: the present place and the target get `by` added.
    pub fn shift(&mut self, by: Position) {
        self.now.position = self.now.position + by;
        if let Goal::MoveTo(target) = self.goal {
            self.goal = Goal::MoveTo(PositionRange::EXACT.nearest(target + by));
        }
    }

    /// The present set-point.
    #[must_use]
    pub fn set_point(&self) -> &SetPoint {
        &self.now
    }

    /// Whether the last step has reached the goal, or come as near as the position limits allow.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.done
    }

    /// Whether a position limit has changed or stopped the motion since the last command.
    #[must_use]
    pub fn is_limited(&self) -> bool {
        self.limited
    }

    /// Goes on by one raster step. A motion that a position limit has stopped takes a new command to go on.
    pub fn step(&mut self) {
        let profile = self.limits.clamp(self.profile);
        let ramps =
            Ramps { up: profile.acceleration.0 * self.period, down: profile.deceleration.0 * self.period };
        let range = self.limits.range().including(self.now.position);
        let wish = self.wish(&profile, &ramps, range);
        let wanted = self.follow(&wish, &ramps);
        let allowed = self.contain(wanted, ramps.down, range);

        let blocked = allowed != wanted || self.reaches_beyond(range);
        self.limited |= blocked;
        if blocked && self.stands() && allowed == STANDSTILL {
            self.goal = Goal::Stop;
        }
        self.advance(allowed, wish.end, range);
        self.done = match wish.end {
            Some(end) => self.stands() && self.now.position == Position(end),
            None => self.now.velocity == Velocity(wish.direction * wish.speed),
        };
    }

    fn stands(&self) -> bool {
        self.now.velocity == STANDSTILL
    }
}

fn sign(value: f64) -> f64 {
    if value < 0.0 { -1.0 } else { 1.0 }
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}
