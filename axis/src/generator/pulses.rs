//! The motion of a stepper: pulses of one frequency throughout a step.
//!
//! A step at velocity `w` covers `w · T`. From standstill the axis jumps to the start/stop velocity, and it
//! stops from there at once; above it there are ramps. Each step takes the highest velocity from which such a
//! stop still ends at or before the target, and before every position limit; what is left of the way goes in
//! a last step of lower frequency (MACCON MAC4 manual, sections 4.1.2, 5.6 and 5.14, diagram 5.2).

use super::braking::Brake;
use super::start::{Start, Step};
use super::{Course, sign};
use crate::profile::Profile;
use crate::units::{Position, Velocity, magnitude};

/// What of a count may be missing where a motion ends, so that no step is made for it.
const CLOSE: f64 = 1e-7;

/// How a stepper starts and stops.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stepping {
    /// Highest jump of velocity from standstill and to it (MAC4 `<ssf>`); a sign is dropped.
    pub start_stop: Velocity,
    /// How the last steps of a move are made.
    pub creep: Option<Creep>,
}

/// The slow end of a move, after the braking ramp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Creep {
    /// Length (MAC4 `<stc>`), in counts; the next step time begins it, so it may be longer by the way of one.
    pub distance: Position,
    /// Velocity (MAC4 `<lv>`), cut to the start/stop velocity.
    pub velocity: Velocity,
}

impl Stepping {
    /// The same with plain numbers in it and no creep faster than the start/stop velocity (MAC4 manual,
    /// section 4.8.3), nor one without speed.
    pub(super) fn sanitised(self) -> Self {
        let start_stop = Velocity(magnitude(self.start_stop.0, 1e12));
        let creep = self.creep.map(|creep| Creep {
            distance: Position(magnitude(creep.distance.0, f64::MAX)),
            velocity: Velocity(magnitude(creep.velocity.0, start_stop.0)),
        });
        Self { start_stop, creep: creep.filter(|creep| creep.velocity > Velocity(0.0)) }
    }
}

/// What one step works with; changes of speed in counts/s.
struct Pulses<'a> {
    start: &'a Start<'a>,
    stepping: Option<Stepping>,
    top: f64,
    up: f64,
    brake: Brake,
}

/// One step on `course`. Without `stepping` there is no start/stop velocity, and any place is a step.
pub(super) fn step(start: &Start<'_>, profile: &Profile, course: Course, stepping: Option<Stepping>) -> Step {
    let down = profile.deceleration.0 * start.time;
    let pulses = Pulses {
        start,
        stepping,
        top: profile.velocity.0,
        up: profile.acceleration.0 * start.time,
        brake: Brake::new(down, start_stop(stepping)),
    };
    pulses.step(course)
}

/// The start/stop velocity, in counts/s.
pub(super) fn start_stop(stepping: Option<Stepping>) -> f64 {
    stepping.map_or(0.0, |stepping| stepping.start_stop.0)
}

impl Pulses<'_> {
    fn step(&self, course: Course) -> Step {
        match course {
            Course::MoveTo(target) => self.move_to(target),
            Course::RunAt(wanted) => self.run_at(sign(wanted.0) * wanted.0.abs().min(self.top)),
            Course::Stop => self.run_at(0.0),
        }
    }

    fn move_to(&self, target: Position) -> Step {
        let end = self.start.range.nearest(target);
        let way = self.start.way_to(end);
        let direction = sign(if way == 0.0 { self.start.velocity() } else { way });
        let speed = self.approach(way.abs()).min(self.top);
        let step = self.go(self.follow(direction, speed), Some(end.0));
        let is_done = step.set_point.velocity == Velocity(0.0) && step.set_point.position == end;
        Step { is_done, ..step }
    }

    fn run_at(&self, velocity: f64) -> Step {
        let before = self.start.velocity();
        let wanted = self.follow(sign(if velocity == 0.0 { before } else { velocity }), velocity.abs());
        let step = match self.next_count().filter(|_| wanted == 0.0) {
            Some(count) => self.go(self.fill(count), Some(count.0)),
            None => self.go(wanted, None),
        };
        Step { is_done: step.set_point.velocity == Velocity(velocity), ..step }
    }

    /// Goes on at `wanted` as far as the position limits allow.
    fn go(&self, wanted: f64, end: Option<f64>) -> Step {
        let allowed = self.start.contain(wanted, 0.0, self.brake);
        let set_point = self.start.straight(allowed, end, CLOSE);
        let is_cut = Velocity(allowed) != Velocity(wanted);
        Step { set_point, is_straight: true, is_done: false, is_cut }
    }

    /// The highest speed that ends `way` ahead: ramping down to the beginning of the creep, or creeping.
    fn approach(&self, way: f64) -> f64 {
        match self.stepping.and_then(|stepping| stepping.creep) {
            Some(Creep { distance, velocity }) => {
                let ahead = way - distance.0 / self.start.time;
                self.brake.highest(ahead).max(velocity.0.min(way))
            }
            None => self.brake.highest(way),
        }
    }

    /// The velocity nearest to `speed` in `direction` (±1) within the ramps; a reversal passes standstill.
    fn follow(&self, direction: f64, speed: f64) -> f64 {
        let present = self.start.velocity() * direction;
        if present < 0.0 {
            return -direction * self.brake.lowest(-present);
        }
        direction * speed.min(self.highest(present)).max(self.brake.lowest(present))
    }

    fn highest(&self, speed: f64) -> f64 {
        (speed + self.up).max(start_stop(self.stepping))
    }

    /// The whole count ahead where a stepper can stop.
    fn next_count(&self) -> Option<Position> {
        let (position, velocity) = (self.start.position(), self.start.velocity());
        let direction = sign(velocity);
        let count = Position(-direction * (-direction * position).floor());
        (self.stepping.is_some() && velocity != 0.0 && count != self.start.now.position).then_some(count)
    }

    /// The velocity that completes the count, in this step or by more.
    fn fill(&self, count: Position) -> f64 {
        let velocity = self.start.velocity();
        let most = self.highest(velocity.abs()).min(self.brake.drop()).min(self.start.limits.velocity.0);
        sign(velocity) * self.start.way_to(count).abs().min(most)
    }
}
