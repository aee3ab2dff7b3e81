//! Trapezoids in discrete time.
//!
//! Acceleration is constant within a raster step, so a step from velocity `v` to `w` covers `(v + w)/2 · T`.
//! Braking by at most `q` counts/s a step, a stop from `w = n·q + r` (`0 <= r < q`) takes `n` full steps and
//! one of `r`. Each step the generator takes the highest velocity from which such a stop still ends at or
//! before the target, and before every position limit. So nothing is planned ahead, and any change on the
//! fly is just another step.

use super::{Generator, Goal, STANDSTILL, sign};
use crate::limits::PositionRange;
use crate::profile::{Profile, SetPoint};
use crate::units::{Acceleration, Position, Velocity};

/// Share of the braking rate that planning leaves unused, to make up for rounding.
const RESERVE: f64 = 1e-9;

/// What a goal asks of one step: a direction (±1), the highest speed in it, and where to end.
pub(super) struct Wish {
    pub(super) direction: f64,
    pub(super) speed: f64,
    pub(super) end: Option<f64>,
}

/// The highest changes of speed in one step, in counts/s.
pub(super) struct Ramps {
    pub(super) up: f64,
    pub(super) down: f64,
}

impl Generator {
    /// What the goal asks of this step.
    pub(super) fn wish(&self, profile: &Profile, ramps: &Ramps, range: PositionRange) -> Wish {
        let velocity = self.now.velocity.0;
        match self.goal {
            Goal::MoveTo(target) => {
                let end = range.nearest(target).0;
                let way = end - self.now.position.0;
                let direction = sign(if way == 0.0 { velocity } else { way });
                let stoppable = self.stoppable(velocity * direction, way.abs(), ramps.down);
                Wish { direction, speed: stoppable.min(profile.velocity.0), end: Some(end) }
            }
            Goal::RunAt(wanted) => {
                let speed = wanted.0.abs().min(profile.velocity.0);
                Wish { direction: sign(wanted.0), speed, end: None }
            }
            Goal::Stop => Wish { direction: sign(velocity), speed: 0.0, end: None },
        }
    }

    /// The velocity after this step that comes nearest to the wish within the ramps.
    pub(super) fn follow(&self, wish: &Wish, ramps: &Ramps) -> Velocity {
        let speed = self.now.velocity.0 * wish.direction;
        let highest = if speed >= 0.0 {
            speed + ramps.up
        } else if speed + ramps.down <= 0.0 {
            speed + ramps.down
        } else {
            ramps.up * (1.0 + speed / ramps.down)
        };
        let lowest = speed - ramps.down;
        Velocity(wish.direction * wish.speed.min(highest).max(lowest))
    }

    /// `wanted`, cut so that a stop within `range` stays possible.
    pub(super) fn contain(&self, wanted: Velocity, down: f64, range: PositionRange) -> Velocity {
        let (position, velocity) = (self.now.position.0, self.now.velocity.0);
        let below = self.cut(wanted.0, velocity, range.max().0 - position, down);
        Velocity(-self.cut(-below, -velocity, position - range.min().0, down))
    }

    /// `wanted`, cut so that a stop within `room` in positive direction stays possible: braking by `down` a
    /// step or, when that is too late, by as much as it takes and the axis can.
    fn cut(&self, wanted: f64, velocity: f64, room: f64, down: f64) -> f64 {
        let most = self.limits.acceleration.0 * self.period;
        let rate = self.required(velocity, room).min(most).max(down);
        let highest = self.stoppable(velocity, room, rate);
        wanted.min(highest.max(velocity - rate))
    }

    /// The highest speed after this step, coming from `speed`, from which braking by `rate` a step stops
    /// within `room`; zero when there is none.
    fn stoppable(&self, speed: f64, room: f64, rate: f64) -> f64 {
        let rate = rate * (1.0 - RESERVE);
        let way = room / self.period - speed / 2.0;
        if way <= 0.0 {
            return 0.0;
        }
        let full_steps = (((1.0 + 8.0 * way / rate).sqrt() - 1.0) / 2.0).floor();
        let rest = (way - rate * full_steps * (full_steps + 1.0) / 2.0) / (full_steps + 1.0);
        (full_steps * rate + rest).max(0.0)
    }

    /// The least change of speed a step that stops `speed` within `room`; infinite when none does.
    fn required(&self, speed: f64, room: f64) -> f64 {
        if speed <= 0.0 {
            return 0.0;
        }
        let way = room / self.period;
        let full_steps = (2.0 * way / speed).floor();
        if full_steps < 1.0 {
            return f64::INFINITY;
        }
        ((2.0 * full_steps + 1.0) * speed - 2.0 * way) / (full_steps * (full_steps + 1.0))
    }

    /// Whether the target lies outside of `range`.
    pub(super) fn reaches_beyond(&self, range: PositionRange) -> bool {
        matches!(self.goal, Goal::MoveTo(target) if !range.contains(target))
    }

    /// Moves on to `velocity`; coming to rest within rounding of the target or a limit, exactly there.
    pub(super) fn advance(&mut self, velocity: Velocity, end: Option<f64>, range: PositionRange) {
        let before = self.now;
        let velocity = velocity + STANDSTILL; // makes a negative zero positive
        let position = before.position.0 + (before.velocity + velocity).0 / 2.0 * self.period;
        let close = 1e-9 + position.abs() * (16.0 * f64::EPSILON);
        let is_close = |place: &f64| (position - place).abs() <= close;
        let stops = [end, Some(range.min().0), Some(range.max().0)];
        let stop = stops.into_iter().flatten().find(is_close);
        let slow = velocity.abs().0 * self.period <= close;
        let (position, velocity) = match stop {
            Some(place) if slow => (place, STANDSTILL),
            Some(_) | None => (position, velocity),
        };
        self.now = SetPoint {
            position: Position(position),
            velocity,
            acceleration: Acceleration((velocity - before.velocity).0 / self.period),
        };
    }
}
