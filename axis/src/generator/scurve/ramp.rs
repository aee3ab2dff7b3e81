//! The quickest change of velocity.
//!
//! Over the velocity, the square of the acceleration rises and falls by at most twice the jerk. Where it is
//! as high as the start, the end and the bounds allow, the change is the quickest there is. A bound holds on
//! each side of velocity zero, as speed falls before and rises after it; so a change through zero has two
//! legs that meet at the highest acceleration that both can have there.

use core::ops::Neg;

use super::{Bounds, State};

/// How many phases a change has.
pub(super) const PHASES: usize = 7;

/// A time of constant jerk; none when it takes no time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phase {
    pub(super) jerk: f64,
    pub(super) seconds: f64,
    /// The acceleration at the end, free of the rounding that a large change leaves behind.
    pub(super) acceleration: f64,
}

impl Phase {
    /// The state after this phase.
    pub(super) fn run(&self, from: &State) -> State {
        State { acceleration: self.acceleration, ..from.after(self.jerk, self.seconds) }
    }
}

impl Neg for Phase {
    type Output = Self;
    fn neg(self) -> Self {
        Self { jerk: -self.jerk, seconds: self.seconds, acceleration: -self.acceleration }
    }
}

/// The phases from a state to `goal`, held without acceleration.
pub(super) fn phases(from: &State, goal: f64, bounds: &Bounds) -> [Phase; PHASES] {
    let coasted = from.velocity + from.acceleration * from.acceleration.abs() / (2.0 * bounds.jerk);
    if goal < coasted {
        let [a, b, c, d, e, f, g] = rise(-from.velocity, -from.acceleration, -goal, bounds);
        [-a, -b, -c, -d, -e, -f, -g]
    } else {
        rise(from.velocity, from.acceleration, goal, bounds)
    }
}

/// The phases of a change to a `goal` above what the acceleration leads to by itself.
fn rise(velocity: f64, acceleration: f64, goal: f64, bounds: &Bounds) -> [Phase; PHASES] {
    let jerk = bounds.jerk;
    let opposing = acceleration.min(0.0);
    let velocity = velocity - opposing * opposing / (2.0 * jerk);
    let acceleration = acceleration.max(0.0);
    let back = Phase { jerk, seconds: -opposing / jerk, acceleration };

    let crossing = if velocity < 0.0 { crossing(velocity, acceleration, goal, bounds) } else { acceleration };
    let [a, b, c] = if velocity < 0.0 {
        leg((velocity, acceleration), (goal.min(0.0), crossing), bounds.deceleration, jerk)
    } else {
        [Phase { jerk: 0.0, seconds: 0.0, acceleration }; 3]
    };
    let [d, e, f] = if velocity >= 0.0 || goal > 0.0 {
        leg((velocity.max(0.0), crossing), (goal, 0.0), bounds.acceleration, jerk)
    } else {
        [Phase { jerk: 0.0, seconds: 0.0, acceleration: 0.0 }; 3]
    };
    [back, a, b, c, d, e, f]
}

/// The acceleration at velocity zero of a change from below it, zero when it does not go beyond.
fn crossing(velocity: f64, acceleration: f64, goal: f64, bounds: &Bounds) -> f64 {
    if goal <= 0.0 {
        return 0.0;
    }
    let before = acceleration * acceleration;
    let change = -2.0 * bounds.jerk * velocity;
    let bound = bounds.acceleration.min(bounds.deceleration);
    let highest = (before + change).min(2.0 * bounds.jerk * goal).min(bound * bound);
    highest.max(before - change).sqrt()
}

/// The phases from a velocity and acceleration to a higher velocity on the same side of zero: to a peak
/// acceleration, hold it, to the final one.
fn leg(from: (f64, f64), to: (f64, f64), bound: f64, jerk: f64) -> [Phase; 3] {
    let ((velocity, before), (goal, after)) = (from, to);
    let gain = (goal - velocity).max(0.0);
    let unbounded = (jerk * gain + (before * before + after * after) / 2.0).sqrt();
    let peak = unbounded.min(bound).max(after);
    let (up, down) = ((peak - before) / jerk, (peak - after) / jerk);
    let held = if unbounded > bound {
        let ramped = (before + peak) / 2.0 * up.abs() + (peak + after) / 2.0 * down;
        ((gain - ramped) / peak).max(0.0)
    } else {
        0.0
    };
    let turned = if up < 0.0 { -jerk } else { jerk };
    [
        Phase { jerk: turned, seconds: up.abs(), acceleration: peak },
        Phase { jerk: 0.0, seconds: held, acceleration: peak },
        Phase { jerk: -jerk, seconds: down, acceleration: after },
    ]
}
