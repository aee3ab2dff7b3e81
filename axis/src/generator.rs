//! The set-point generator: goals in, one set-point a raster step out.
//!
//! What a profile drives (a move, a velocity, a stop) has a shape: the trapezoid, the curve of limited jerk or
//! the pulses of a stepper. What a master shapes step by step is tracked. Trapezoid, pulses and tracking look at
//! the present set-point only, so any change of goal, profile, limits or shape on the fly is just another step;
//! a curve is planned anew.

mod braking;
mod pulses;
mod ride;
mod scurve;
mod start;
mod stretch;
mod tracking;
mod trapezoid;

use core::num::NonZeroU32;

pub use self::pulses::{Creep, Stepping};

use self::braking::Brake;
use self::ride::Ride;
use self::start::{Start, Step};
use self::stretch::Stretch;
use self::tracking::Track;

use crate::limits::{Limits, PositionRange};
use crate::profile::{Profile, SetPoint};
use crate::units::{Acceleration, Period, Position, Velocity};

const STANDSTILL: Velocity = Velocity(0.0);

/// What the set-points are to reach.
///
/// Tracking is for a master that gives a target each cycle of its own (CiA 402 cyclic synchronous modes; MAC4
/// manual, sections 5.11 and 5.12). It takes no profile and keeps the axis maxima only, jerk excepted; a
/// velocity is constant within a raster step and changes at once between two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Stand at a position.
    MoveTo(Position),
    /// Run at a velocity, cut to the profile velocity.
    RunAt(Velocity),
    /// Ramp down and stand.
    Stop,
    /// Pass a position at a time, on a straight line from the target before; then hold it.
    TrackPosition {
        /// Where to be.
        target: Position,
        /// When, in raster steps from now.
        over: NonZeroU32,
    },
    /// Have a velocity at a time, changed evenly until then; then keep it. It is cut to the axis maximum.
    TrackVelocity {
        /// How fast to be.
        target: Velocity,
        /// When, in raster steps from now.
        over: NonZeroU32,
    },
}

/// Generates one set-point a raster step.
#[derive(Clone, Debug)]
pub struct Generator {
    /// Raster period in seconds.
    period: f64,
    /// Raster steps of a cycle of profile-driven motion.
    cycle: NonZeroU32,
    limits: Limits,
    profile: Profile,
    stepping: Option<Stepping>,
    task: Task,
    now: SetPoint,
    /// The cycle in progress, when it has several raster steps.
    stretch: Option<Stretch>,
    /// The curve in progress, when the jerk is limited.
    ride: Option<Ride>,
    /// The last step may have come nearer to a limit than the shape of a profile does.
    is_near: bool,
    done: bool,
    /// The cycle before this one had reached the goal already.
    was_done: bool,
    limited: bool,
}

/// A goal in work.
#[derive(Clone, Copy, Debug)]
enum Task {
    Profile(Course),
    Track(Track),
}

/// What is asked of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
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
            cycle: NonZeroU32::MIN,
            limits: limits.sanitised(),
            profile: Profile::default(),
            stepping: None,
            task: Task::Profile(Course::Stop),
            now: SetPoint::default(),
            stretch: None,
            ride: None,
            is_near: false,
            done: true,
            was_done: true,
            limited: false,
        }
    }

    /// The same with a cycle of `steps` raster steps: what a profile drives is generated at the beginning of a
    /// cycle, for its end; the set-points between follow the parabola or line to it. A command acts with the
    /// next cycle. Tracking is generated every raster step.
    #[must_use]
    pub fn with_cycle(self, steps: NonZeroU32) -> Self {
        Self { cycle: steps, ..self }
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
        self.stretch = None;
        self.ride = None;
        self.command(Goal::Stop, Profile::default());
    }

    /// Replaces the goal and the profile; valid in any state of motion.
    ///
    /// A target is cut to ±2^53 counts. A goal that is not a number is a stop.
    pub fn command(&mut self, goal: Goal, profile: Profile) {
        self.task = self.task(goal);
        self.profile = match self.task {
            Task::Profile(_) => profile,
            Task::Track(_) => Profile::default(),
        };
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
    /// cycle, jumps from standstill to its start/stop velocity and back, tracking included, and stops on whole
    /// counts; a jerk limit does not apply. To be set at standstill: on the move, a jump that was planned is then a ramp.
    pub fn set_stepping(&mut self, stepping: Option<Stepping>) {
        self.stepping = stepping.map(Stepping::sanitised);
        self.is_near = true;
    }

    /// Moves the coordinate system: the present place and the target get `by` added.
    pub fn shift(&mut self, by: Position) {
        self.now.position = self.now.position + by;
        if let Some(ride) = &mut self.ride {
            ride.shift(by);
        }
        if let Some(stretch) = &mut self.stretch {
            stretch.shift(by);
        }
        match &mut self.task {
            Task::Profile(Course::MoveTo(target)) => *target = PositionRange::EXACT.nearest(*target + by),
            Task::Profile(Course::RunAt(_) | Course::Stop) => {}
            Task::Track(track) => track.shift(by),
        }
    }

    /// The present set-point.
    #[must_use]
    pub fn set_point(&self) -> &SetPoint {
        &self.now
    }

    /// Whether the last step has reached the goal, or come as near as the position limits allow. Tracking has
    /// reached its goal when it is at the target in time or has caught up since.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.done && (self.was_done || self.stretch.is_none())
    }

    /// Whether a position limit has changed or stopped the motion since the last command.
    #[must_use]
    pub fn is_limited(&self) -> bool {
        self.limited
    }

    /// Goes on by one raster step. A motion that a position limit has stopped takes a new command to go on.
    pub fn step(&mut self) {
        if self.stretch.is_none() {
            self.generate();
        }
        if let Some(stretch) = &mut self.stretch {
            self.now = stretch.advance();
            self.stretch = self.stretch.take().filter(|stretch| stretch.left() > 0);
        }
    }

    /// Begins the next cycle; one of a single raster step is complete with it.
    fn generate(&mut self) {
        let range = self.range();
        let ((step, cycle), is_beyond) = match self.task {
            Task::Profile(course) => (self.drive(course), course.reaches_beyond(range)),
            Task::Track(track) => (self.track(track), track.reaches_beyond(range)),
        };
        self.take(&step, cycle, is_beyond);
    }

    /// One raster step of tracking. Where a stop by raster steps would end beyond a limit, as it may after a
    /// cycle of pulses, another such cycle brakes.
    fn track(&mut self, mut track: Track) -> (Step, NonZeroU32) {
        let from_pulses = self.stepping.is_some() && !self.is_near;
        if from_pulses && !self.fits(NonZeroU32::MIN) {
            track.pass(self.cycle);
            self.task = Task::Track(track);
            let (step, cycle) = self.drive(Course::Stop);
            return (Step { is_done: false, is_cut: true, ..step }, cycle);
        }
        self.ride = None;
        let step = track.step(&self.start(NonZeroU32::MIN), pulses::start_stop(self.stepping));
        self.task = Task::Track(track);
        self.is_near = true;
        (step, NonZeroU32::MIN)
    }

    /// One cycle of profile-driven motion, and its raster steps.
    ///
    /// Where a stop in the shape of the profile would end beyond a limit, as it may after another shape, the
    /// motion goes on raster step by raster step at constant velocities.
    fn drive(&mut self, course: Course) -> (Step, NonZeroU32) {
        let profile = self.limits.clamp(self.profile);
        let is_smooth = profile.jerk.is_some() && self.stepping.is_none();
        let cycle = if is_smooth { NonZeroU32::MIN } else { self.cycle };
        if is_smooth && self.ride.is_some() {
            return (self.ride(course, &profile), cycle);
        }
        self.is_near |= self.ride.take().is_some();
        let fits = |generator: &Self| match is_smooth {
            true => ride::can_stop(&generator.now, &profile, &generator.limits),
            false => generator.fits(cycle),
        };
        self.is_near = self.is_near && !fits(self);
        if self.is_near {
            let start = self.start(NonZeroU32::MIN);
            return (pulses::step(&start, &profile, course, self.stepping), NonZeroU32::MIN);
        }
        let step = match self.stepping {
            Some(_) => pulses::step(&self.start(cycle), &profile, course, self.stepping),
            None if is_smooth => self.ride(course, &profile),
            None => trapezoid::step(&self.start(cycle), &profile, course),
        };
        (step, cycle)
    }

    /// One raster step of a curve of limited jerk.
    fn ride(&mut self, course: Course, profile: &Profile) -> Step {
        let ride = self.ride.get_or_insert_with(|| Ride::new(&self.now, &self.limits));
        ride.follow(course, profile, &self.limits);
        ride.step(self.period)
    }

    /// Whether the axis can stop within the position limits in the shape of a profile and cycles of `steps`.
    fn fits(&self, steps: NonZeroU32) -> bool {
        let start = self.start(steps);
        let lead = if self.stepping.is_some() { 0.0 } else { trapezoid::lead(&start) };
        let velocity = start.velocity();
        let end = if velocity < 0.0 { start.range.min() } else { start.range.max() };
        let way = (start.way_to(end) - lead) * sign(velocity);
        Brake::new(start.most_down(), pulses::start_stop(self.stepping)).can_stop(velocity.abs(), way)
    }

    fn take(&mut self, step: &Step, cycle: NonZeroU32, is_beyond: bool) {
        let is_blocked = step.is_cut || is_beyond;
        let before = core::mem::replace(&mut self.now, step.set_point);
        self.was_done = core::mem::replace(&mut self.done, step.is_done);
        self.limited |= is_blocked;
        if is_blocked && before.velocity == STANDSTILL && self.now.velocity == STANDSTILL {
            self.task = Task::Profile(Course::Stop);
        }
        if cycle > NonZeroU32::MIN {
            let stretch = Stretch::new(before, step.set_point, step.is_straight, cycle.get(), self.period);
            self.stretch = Some(stretch);
        }
    }

    fn task(&self, goal: Goal) -> Task {
        match goal {
            Goal::MoveTo(target) | Goal::TrackPosition { target, .. } if target.0.is_nan() => {
                Task::Profile(Course::Stop)
            }
            Goal::RunAt(target) | Goal::TrackVelocity { target, .. } if target.0.is_nan() => {
                Task::Profile(Course::Stop)
            }
            Goal::MoveTo(target) => Task::Profile(Course::MoveTo(PositionRange::EXACT.nearest(target))),
            Goal::RunAt(velocity) => Task::Profile(Course::RunAt(velocity)),
            Goal::Stop => Task::Profile(Course::Stop),
            Goal::TrackPosition { target, over } => {
                let target = PositionRange::EXACT.nearest(target);
                Task::Track(Track::Position { target, line: self.line(), left: self.left(over) })
            }
            Goal::TrackVelocity { target, over } => {
                Task::Track(Track::Velocity { target, left: self.left(over) })
            }
        }
    }

    /// Where the line to a new target begins.
    fn line(&self) -> Position {
        match self.task {
            Task::Track(Track::Position { line, .. }) => line,
            Task::Track(Track::Velocity { .. }) | Task::Profile(_) => {
                self.stretch.as_ref().map_or(self.now.position, |stretch| stretch.end().position)
            }
        }
    }

    /// What of `over` raster steps is left at the end of the cycle in progress; at least one.
    fn left(&self, over: NonZeroU32) -> u32 {
        let wait = self.stretch.as_ref().map_or(0, Stretch::left);
        over.get().saturating_sub(wait).max(1)
    }

    /// The state before a cycle of `steps` raster steps.
    fn start(&self, steps: NonZeroU32) -> Start<'_> {
        let time = self.period * f64::from(steps.get());
        Start { now: self.now, time, limits: &self.limits, range: self.range() }
    }

    fn range(&self) -> PositionRange {
        self.limits.range().including(self.now.position)
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
