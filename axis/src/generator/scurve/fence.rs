//! Motions that stay within position limits.
//!
//! A motion runs as its profile says as long as that keeps it inside. Where it does not, it first brakes
//! harder: just as hard as it takes to stay inside, at most as hard as the axis can. While every motion of an
//! axis is planned so, its state can always be stopped inside.

use super::ramp::Phase;
use super::{Bounds, Curve, State, rounding, sign};

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
        match self.inside(go_on(self.ease(from))) {
            Some(inside) => inside,
            None => go_on(self.brake(from)),
        }
    }

    /// A change to `velocity`, cut to the one of the profile, and a stop at the limit.
    pub(crate) fn run_at(&self, from: &State, velocity: f64) -> Curve {
        let speed = velocity.abs().min(self.profile.velocity);
        if speed <= 0.0 {
            return self.brake(from);
        }
        let profile = Bounds { velocity: speed, ..self.profile };
        let end = if velocity < 0.0 { self.min.min(from.position) } else { self.max.max(from.position) };
        Self { profile, min: self.min.min(end), max: self.max.max(end), ..*self }.move_to(from, end)
    }

    /// The acceleration taken back, if that takes a higher jerk than the one of the profile to keep the
    /// velocity below the maximum of the axis; else nothing.
    fn ease(&self, from: &State) -> Curve {
        let State { velocity, acceleration, .. } = *from;
        let room = self.fastest() - velocity * sign(acceleration);
        let needed = if room > 0.0 { acceleration * acceleration / (2.0 * room) } else { f64::INFINITY };
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
        let braking = |share| Curve::to_velocity(from, 0.0, &self.hardened(share));
        let kept = |share| self.inside(braking(share)).filter(|curve| curve.fastest() <= self.fastest());
        if let Some(soft) = kept(0.0) {
            return soft;
        }
        let Some(mut best) = kept(1.0) else { return braking(1.0) };
        let (mut soft, mut hard) = (0.0, 1.0);
        for _ in 0..f64::MANTISSA_DIGITS {
            let share = (soft + hard) / 2.0;
            match kept(share) {
                Some(inside) => (best, hard) = (inside, share),
                None => soft = share,
            }
        }
        best
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

    /// The curve if it stays inside but for rounding, cut to the limits. Who starts outside may stay there,
    /// but goes no farther.
    fn inside(&self, curve: Curve) -> Option<Curve> {
        let (min, max) = (self.min.min(curve.origin), self.max.max(curve.origin));
        let (lowest, highest) = curve.extent();
        let beyond = (min - lowest).max(highest - max);
        (beyond <= rounding(lowest, highest)).then(|| curve.within((min, max)))
    }
}
