//! Motions that stay within position limits.
//!
//! A motion runs as its profile says as long as that keeps it inside. Where it does not, it first brakes
//! harder: just as hard as it takes to stay inside, at most as hard as the axis can. While every motion of an
//! axis is planned so, its state can always be stopped, or turned back, inside.

use super::ramp::Phase;
use super::{Bounds, Curve, State, rounding, sign, zero};

/// Position limits, and how hard a motion may be braked to keep them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fence {
    /// What a motion keeps as long as the limits let it.
    pub(crate) profile: Bounds,
    /// What a motion always keeps: no bound is below the one of the profile.
    pub(crate) axis: Bounds,
    /// Lowest position, counts.
    pub(crate) min: f64,
    /// Highest position, counts; not below the lowest.
    pub(crate) max: f64,
}

impl Fence {
    /// A move to `end`, or to the limit before it.
    pub(crate) fn move_to(&self, from: &State, end: f64) -> Curve {
        let end = end.max(self.min).min(self.max);
        let go_on = |first: Curve| {
            let next = Curve::to_position(&first.at(first.duration()), end, &self.profile);
            first.then(&next)
        };
        let curve = go_on(self.ease(from));
        if self.room(&curve) >= 0.0 { self.cut(curve) } else { go_on(self.brake(from)) }
    }

    /// A change to `velocity`, cut to the one of the profile, and a stop at the limit.
    pub(crate) fn run_at(&self, from: &State, velocity: f64) -> Curve {
        let speed = velocity.abs().min(self.profile.velocity);
        if speed <= 0.0 {
            return self.brake(from);
        }
        let profile = Bounds { velocity: speed, ..self.profile };
        let (min, max) = self.range(from.position);
        Self { profile, min, max, ..*self }.move_to(from, if velocity < 0.0 { min } else { max })
    }

    /// Whether the hardest stop ends inside.
    pub(crate) fn holds(&self, from: &State) -> bool {
        self.room(&Curve::to_velocity(from, 0.0, &self.axis)) >= 0.0
    }

    /// The acceleration taken back, if that takes a higher jerk than the one of the profile to keep the
    /// velocity below the maximum of the axis, or to end a braking before it becomes an acceleration that is too
    /// high; else nothing.
    fn ease(&self, from: &State) -> Curve {
        let State { velocity, acceleration, .. } = *from;
        let ahead = velocity * sign(acceleration);
        let squared = acceleration * acceleration;
        let to_stay_slow = per_room(squared, self.fastest() - ahead);
        let excess = squared - self.axis.acceleration * self.axis.acceleration;
        let to_turn = if ahead < 0.0 && excess > 0.0 { per_room(excess, -ahead) } else { 0.0 };
        let needed = to_stay_slow.max(to_turn);
        let mut curve = Curve::new(from);
        if needed > self.profile.jerk {
            let jerk = needed.min(self.axis.jerk);
            let seconds = acceleration.abs() / jerk;
            curve.push(&Phase { jerk: -jerk * sign(acceleration), seconds, acceleration: 0.0 });
        }
        curve
    }

    /// A stop: as the profile says or, when that goes beyond a limit, just as much harder as it takes.
    fn brake(&self, from: &State) -> Curve {
        let eased = self.ease(from);
        let stop = |from: &State| self.brake_at_once(from);
        if eased.duration() > 0.0 {
            let curve = eased.at(eased.duration());
            let curve = eased.then(&stop(&curve));
            if self.room(&curve) >= 0.0 {
                return self.cut(curve);
            }
        }
        stop(from)
    }

    fn brake_at_once(&self, from: &State) -> Curve {
        let braking = |share| Curve::to_velocity(from, 0.0, &self.hardened(share));
        let spare = |curve: &Curve| self.room(curve).min(self.fastest() - curve.fastest());
        let (softest, hardest) = (braking(0.0), braking(1.0));
        if spare(&softest) >= 0.0 {
            return self.cut(softest);
        }
        if self.room(&hardest) < 0.0 {
            return self.turn_back(from, hardest);
        }
        if spare(&hardest) < 0.0 {
            return self.cut(hardest);
        }
        let close = rounding(from.position, hardest.end) / 2.0;
        self.cut(braking(zero(1.0, 0.0, close, |share| spare(&braking(share)))))
    }

    /// A stop after turning back at a limit, just as fast as it takes, for a state in which the hardest
    /// `stop` goes beyond that limit; or that stop, if turning back does not help.
    ///
    /// Such states are met where a curve turns: it need not end its acceleration at velocity zero.
    fn turn_back(&self, from: &State, stop: Curve) -> Curve {
        let (below, above) = self.rooms(&stop);
        let upwards = above < below;
        let turning = |speed: f64| {
            let mut curve = Curve::to_velocity(from, if upwards { -speed } else { speed }, &self.axis);
            curve.ramp(0.0, &self.axis);
            curve
        };
        let spare = |speed| {
            let (below, above) = self.rooms(&turning(speed));
            if upwards { above } else { below }
        };
        let close = rounding(from.position, stop.end) / 2.0;
        let turned = turning(zero(self.axis.velocity, 0.0, close, spare));
        if self.room(&turned) >= 0.0 { self.cut(turned) } else { stop }
    }

    /// The highest speed, with room for rounding.
    fn fastest(&self) -> f64 {
        self.axis.velocity * (1.0 + 1e-12)
    }

    /// The bounds of the profile, or (share 1) of the axis, or some in between.
    fn hardened(&self, share: f64) -> Bounds {
        let between = |soft: f64, hard: f64| (1.0 - share) * soft + share * hard;
        let (profile, axis) = (&self.profile, &self.axis);
        Bounds {
            velocity: profile.velocity,
            acceleration: between(profile.acceleration, axis.acceleration),
            deceleration: between(profile.deceleration, axis.deceleration),
            jerk: between(profile.jerk, axis.jerk),
        }
    }

    /// The curve without the rounding that goes beyond a limit.
    fn cut(&self, curve: Curve) -> Curve {
        let range = self.range(curve.origin);
        curve.within(range)
    }

    /// How far a curve stays away from the limits, or the rounding beyond them; below zero outside.
    fn room(&self, curve: &Curve) -> f64 {
        let (below, above) = self.rooms(curve);
        below.min(above)
    }

    /// The same, for the lower and the upper limit.
    fn rooms(&self, curve: &Curve) -> (f64, f64) {
        let (min, max) = self.range(curve.origin);
        let (lowest, highest) = curve.extent();
        let rounding = rounding(lowest, highest);
        (lowest - min + rounding, max - highest + rounding)
    }

    /// Where a curve may be. Who starts outside of the limits may stay there, but goes no farther.
    fn range(&self, origin: f64) -> (f64, f64) {
        (self.min.min(origin), self.max.max(origin))
    }
}

/// The jerk that takes so much off a squared acceleration while the velocity changes by `room`.
fn per_room(squared: f64, room: f64) -> f64 {
    if room > 0.0 { squared / (2.0 * room) } else { f64::INFINITY }
}
