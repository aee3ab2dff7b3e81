//! The set-point generator: goals in, one set-point a raster step out.
//!
//! What a profile drives (a move, a velocity, a stop) has a shape: the trapezoid or the pulses of a stepper.
//! A shape looks at the present set-point only, so any change of
//! goal, profile, limits or shape on the fly is just another step.

mod braking;
mod pulses;
mod start;
mod trapezoid;

pub use self::pulses::{Creep, Stepping};

use self::start::{Start, Step};
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
    /// Raster period in seconds.
    period: f64,
    limits: Limits,
    profile: Profile,
    stepping: Option<Stepping>,
    course: Course,
    now: SetPoint,
    done: bool,
    limited: bool,
}

/// What is asked of a shape.
#[derive(Clone, Copy, Debug)]
enum Course {
    MoveTo(Position),
    RunAt(Velocity),
    Stop,
}

impl Generator {
    /// A generator that stands at position 0.
    #[must_use]
    pub fn new(period: Period, limits: Limits) -> Self {
        Self {
            period: period.seconds(),
            limits: limits.sanitised(),
            profile: Profile::default(),
            stepping: None,
            course: Course::Stop,
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
        self.course = course(goal);
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

    /// Makes this the generator of a stepper, or (`None`) no longer. A stepper has one velocity throughout a
    /// step, jumps from standstill to its start/stop velocity and back, and stops on whole
    /// counts; a jerk limit does not apply. To be set at standstill: on the move, a jump that was planned is then a ramp.
    pub fn set_stepping(&mut self, stepping: Option<Stepping>) {
        self.stepping = stepping.map(Stepping::sanitised);
    }

    /// Moves the coordinate system: the present place and the target get `by` added.
    pub fn shift(&mut self, by: Position) {
        self.now.position = self.now.position + by;
        if let Course::MoveTo(target) = &mut self.course {
            *target = PositionRange::EXACT.nearest(*target + by);
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
        let is_beyond = self.course.reaches_beyond(self.range());
        let step = self.drive();
        self.take(&step, is_beyond);
    }

    /// One step in the shape of the profile.
    fn drive(&self) -> Step {
        let profile = self.limits.clamp(self.profile);
        let start = self.start();
        // The shape of a profile with a jerk belongs here; without it, such a profile is a trapezoid.
        match self.stepping {
            Some(_) => pulses::step(&start, &profile, self.course, self.stepping),
            None => trapezoid::step(&start, &profile, self.course),
        }
    }

    fn take(&mut self, step: &Step, is_beyond: bool) {
        let is_blocked = step.is_cut || is_beyond;
        let before = core::mem::replace(&mut self.now, step.set_point);
        self.done = step.is_done;
        self.limited |= is_blocked;
        if is_blocked && before.velocity == STANDSTILL && self.now.velocity == STANDSTILL {
            self.course = Course::Stop;
        }
    }

    /// The state before a step.
    fn start(&self) -> Start<'_> {
        Start { now: self.now, time: self.period, limits: &self.limits, range: self.range() }
    }

    fn range(&self) -> PositionRange {
        self.limits.range().including(self.now.position)
    }
}

fn course(goal: Goal) -> Course {
    match goal {
        Goal::MoveTo(target) if target.0.is_nan() => Course::Stop,
        Goal::RunAt(velocity) if velocity.0.is_nan() => Course::Stop,
        Goal::MoveTo(target) => Course::MoveTo(PositionRange::EXACT.nearest(target)),
        Goal::RunAt(velocity) => Course::RunAt(velocity),
        Goal::Stop => Course::Stop,
    }
}

impl Course {
    /// Whether the target lies outside of `range`.
    fn reaches_beyond(self, range: PositionRange) -> bool {
        match self {
            Self::MoveTo(target) => !range.contains(target),
            Self::RunAt(_) | Self::Stop => false,
        }
    }
}

fn sign(value: f64) -> f64 {
    if value < 0.0 { -1.0 } else { 1.0 }
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}
