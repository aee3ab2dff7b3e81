//! Trapezoids in discrete time.
//!
//! Acceleration is constant within a step, so a step from velocity `v` to `w` covers `(v + w)/2 · T`. Braking
//! by at most `q` counts/s a step, a stop from `w = n·q + r` (`0 <= r < q`) takes `n` full steps and one of
//! `r`. Each step takes the highest velocity from which such a stop still ends at or before the target, and
//! before every position limit. So nothing is planned ahead, and any change on the fly is just another step.

use super::braking::Brake;
use super::start::{Start, Step};
use super::{Course, sign};
use crate::profile::Profile;
use crate::units::{Position, Velocity};

/// What a goal asks of one step: a direction (±1), the highest speed in it, and where to end.
struct Wish {
    direction: f64,
    speed: f64,
    end: Option<f64>,
}

/// The highest changes of speed in one step, in counts/s.
struct Ramps {
    up: f64,
    down: f64,
}

/// One step on `course`.
pub(super) fn step(start: &Start<'_>, profile: &Profile, course: Course) -> Step {
    let ramps = Ramps { up: profile.acceleration.0 * start.time, down: profile.deceleration.0 * start.time };
    let wish = wish(start, profile, &ramps, course);
    let wanted = follow(start.velocity(), &wish, &ramps);
    let allowed = start.contain(wanted, lead(start), Brake::new(ramps.down, 0.0));
    let set_point = start.parabola(allowed, wish.end);
    let is_done = match wish.end {
        Some(end) => set_point.velocity == Velocity(0.0) && set_point.position == Position(end),
        None => set_point.velocity == Velocity(wish.direction * wish.speed),
    };
    Step { set_point, is_straight: false, is_done, is_cut: Velocity(allowed) != Velocity(wanted) }
}

/// The way of a step that ends at standstill, over its time.
pub(super) fn lead(start: &Start<'_>) -> f64 {
    start.velocity() / 2.0
}

/// What the goal asks of this step.
fn wish(start: &Start<'_>, profile: &Profile, ramps: &Ramps, course: Course) -> Wish {
    let velocity = start.velocity();
    match course {
        Course::MoveTo(target) => {
            let end = start.range.nearest(target);
            let way = start.way_to(end);
            let direction = sign(if way == 0.0 { velocity } else { way });
            let ahead = (way - lead(start)) * direction;
            let speed = Brake::new(ramps.down, 0.0).highest_below(profile.velocity.0, ahead);
            Wish { direction, speed, end: Some(end.0) }
        }
        Course::RunAt(wanted) => {
            let speed = wanted.0.abs().min(profile.velocity.0);
            Wish { direction: sign(wanted.0), speed, end: None }
        }
        Course::Stop => Wish { direction: sign(velocity), speed: 0.0, end: None },
    }
}

/// The velocity after this step that comes nearest to the wish within the ramps.
fn follow(velocity: f64, wish: &Wish, ramps: &Ramps) -> f64 {
    let speed = velocity * wish.direction;
    let highest = if speed >= 0.0 {
        speed + ramps.up
    } else if speed + ramps.down <= 0.0 {
        speed + ramps.down
    } else {
        ramps.up * (1.0 + speed / ramps.down)
    };
    let lowest = speed - ramps.down;
    wish.direction * wish.speed.min(highest).max(lowest)
}
