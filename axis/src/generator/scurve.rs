//! Planned motions of limited jerk: S-curves.
//!
//! A velocity change is the quickest one its bounds allow (`ramp`). A move to a position first compares the
//! place where an immediate stop would end with the one wanted. That tells the direction; the move then
//! heads for the highest speed in that direction, and at some moment begins to stop. The later that moment,
//! the farther the move gets, so that moment is searched for; when even the highest speed is reached too
//! early, the move cruises. Bounds that the present state exceeds are come back to as fast as the jerk
//! allows.
//!
//! A curve is a list of pieces of constant jerk, each from its exact start state, so that reading one is a
//! search and a polynomial. Positions are kept relative to the start of the curve: rounding grows with the
//! way, not with the place.

mod fence;
mod ramp;
#[cfg(test)]
mod tests;

pub(crate) use fence::Fence;
use ramp::Phase;

/// A moment of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct State {
    /// Counts.
    pub(crate) position: f64,
    /// Counts/s.
    pub(crate) velocity: f64,
    /// Counts/s².
    pub(crate) acceleration: f64,
}

/// What a motion keeps; magnitudes, finite and above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    /// Highest speed, counts/s; zero stands still.
    pub(crate) velocity: f64,
    /// Highest rate at which the speed rises, counts/s².
    pub(crate) acceleration: f64,
    /// Highest rate at which the speed falls, counts/s².
    pub(crate) deceleration: f64,
    /// Highest rate at which the acceleration changes, counts/s³.
    pub(crate) jerk: f64,
}

/// A planned motion: pieces of constant jerk, and then constant velocity for ever.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pieces: [Piece; Self::CAPACITY],
    count: usize,
    /// Position at the start, counts.
    origin: f64,
    /// Where the last piece leads, position relative to the origin.
    last: State,
    /// Position at the end of the last piece, counts.
    end: f64,
    /// When the last piece ends, seconds.
    duration: f64,
    /// Set-points are cut to these positions, to take the rounding off.
    range: (f64, f64),
}

/// A time of constant jerk.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    /// Seconds since the start of the curve.
    begin: f64,
    seconds: f64,
    jerk: f64,
    /// Position relative to the origin of the curve.
    start: State,
}

impl Curve {
    /// A ramp to the highest speed, the cruise, a stop; and another stop before all that.
    const CAPACITY: usize = 3 * ramp::PHASES + 1;

    /// The longest cruise in seconds, so that no product overflows.
    const FOREVER: f64 = 1e100;

    /// The quickest move that stands at `end`, exactly. (With a highest speed of zero: that stands.)
    pub(crate) fn to_position(from: &State, end: f64, bounds: &Bounds) -> Self {
        let way = end - from.position;
        let stop = Self::to_velocity(from, 0.0, bounds);
        let missing = way - stop.last.position;
        if missing.abs() <= rounding(from.position, end) {
            return stop.ending_at(end);
        }
        if bounds.velocity <= 0.0 {
            return stop;
        }
        let direction = sign(missing);
        let speed = direction * bounds.velocity;
        let mut curve = Self::to_velocity(from, speed, bounds);
        let rest = way - stopped(&curve.last, bounds);
        if rest * direction >= 0.0 {
            let seconds = (rest / speed).min(Self::FOREVER);
            curve.push(&Phase { jerk: 0.0, seconds, acceleration: 0.0 });
        } else {
            curve.cut_to_stop(way, direction, bounds);
        }
        curve.ramp(0.0, bounds);
        curve.ending_at(end)
    }

    /// The quickest change to `velocity`, which is then held for ever.
    pub(crate) fn to_velocity(from: &State, velocity: f64, bounds: &Bounds) -> Self {
        let mut curve = Self::new(from);
        curve.ramp(velocity, bounds);
        curve
    }

    /// The state `seconds` after the start.
    pub(crate) fn at(&self, seconds: f64) -> State {
        let state = if seconds >= self.duration {
            let last = State { position: self.end, ..self.last };
            last.after(0.0, seconds - self.duration)
        } else {
            let state = self.before_end(seconds);
            State { position: self.origin + state.position, ..state }
        };
        let (min, max) = self.range;
        State { position: state.position.max(min).min(max), ..state }
    }

    /// Seconds until the final state.
    pub(crate) fn duration(&self) -> f64 {
        self.duration
    }

    /// The lowest and the highest position until the final state.
    pub(crate) fn extent(&self) -> (f64, f64) {
        let ends = (self.origin.min(self.end), self.origin.max(self.end));
        self.pieces().iter().flat_map(Piece::places).fold(ends, |(min, max), place| {
            let position = self.origin + place;
            (min.min(position), max.max(position))
        })
    }

    /// The highest speed until the final state: one between pieces, as no acceleration changes its sign
    /// within one.
    fn fastest(&self) -> f64 {
        self.pieces()
            .iter()
            .fold(self.last.velocity.abs(), |most, piece| most.max(piece.start.velocity.abs()))
    }

    /// A curve without any piece.
    pub(crate) fn new(from: &State) -> Self {
        Self {
            pieces: [Piece::default(); Self::CAPACITY],
            count: 0,
            origin: from.position,
            last: State { position: 0.0, ..*from },
            end: from.position,
            duration: 0.0,
            range: (f64::NEG_INFINITY, f64::INFINITY),
        }
    }

    /// This curve and, from its final state, `next`.
    fn then(mut self, next: &Self) -> Self {
        let (offset, begin) = (self.last.position, self.duration);
        let moved = |state: &State| State { position: offset + state.position, ..*state };
        let free = self.pieces.iter_mut().skip(self.count);
        for (free, piece) in free.zip(next.pieces()) {
            *free = Piece { begin: begin + piece.begin, start: moved(&piece.start), ..*piece };
        }
        self.count += next.count;
        self.last = moved(&next.last);
        self.duration += next.duration;
        self.ending_at(next.end)
    }

    /// The curve with its final position replaced by one within rounding of it.
    fn ending_at(self, end: f64) -> Self {
        Self { end, ..self }
    }

    /// The curve with every set-point cut to a range.
    fn within(self, range: (f64, f64)) -> Self {
        Self { range, ..self }
    }

    /// Drops everything after the last moment to begin a stop that ends `way` from the origin, coming up to
    /// it in `direction`. Searched for within one piece, whose times are finer than those of the whole.
    fn cut_to_stop(&mut self, way: f64, direction: f64, bounds: &Bounds) {
        let spare = |state: &State| (way - stopped(state, bounds)) * direction;
        let Some(index) = self.pieces().iter().rposition(|piece| spare(&piece.start) >= 0.0) else { return };
        let Some(piece) = self.pieces.get(index).copied() else { return };
        let close = 8.0 * f64::EPSILON * (way.abs() + spare(&piece.start));
        let moment = zero(0.0, piece.seconds, close, |moment| spare(&piece.start.after(piece.jerk, moment)));
        self.count = index;
        self.duration = piece.begin;
        self.last = piece.start;
        let acceleration = piece.start.after(piece.jerk, moment).acceleration;
        self.push(&Phase { jerk: piece.jerk, seconds: moment, acceleration });
    }

    /// The state at a moment before the end, position relative to the origin.
    fn before_end(&self, seconds: f64) -> State {
        match self.pieces().iter().rfind(|piece| piece.begin <= seconds) {
            Some(piece) => piece.start.after(piece.jerk, (seconds - piece.begin).min(piece.seconds)),
            None => self.pieces().first().map_or(self.last, |first| first.start),
        }
    }

    /// Goes on with a change to `velocity`.
    fn ramp(&mut self, velocity: f64, bounds: &Bounds) {
        for phase in ramp::phases(&self.last, velocity, bounds) {
            self.push(&phase);
        }
        self.last = State { velocity, acceleration: 0.0, ..self.last };
    }

    fn push(&mut self, phase: &Phase) {
        if phase.seconds <= 0.0 {
            return;
        }
        if let Some(free) = self.pieces.get_mut(self.count) {
            *free =
                Piece { begin: self.duration, seconds: phase.seconds, jerk: phase.jerk, start: self.last };
            self.count += 1;
        }
        self.last = phase.run(&self.last);
        self.duration += phase.seconds;
        self.end = self.origin + self.last.position;
    }

    fn pieces(&self) -> &[Piece] {
        self.pieces.get(..self.count).unwrap_or_default()
    }
}

impl State {
    /// The state after some time of constant jerk.
    fn after(&self, jerk: f64, seconds: f64) -> Self {
        let Self { position, velocity, acceleration } = *self;
        let half = seconds / 2.0;
        Self {
            position: position + (velocity + (acceleration + jerk * seconds / 3.0) * half) * seconds,
            velocity: velocity + (acceleration + jerk * half) * seconds,
            acceleration: acceleration + jerk * seconds,
        }
    }
}

impl Piece {
    /// The positions at the start and where the direction turns: one of them is the lowest or highest.
    fn places(&self) -> impl Iterator<Item = f64> + use<> {
        [Some(self.start.position), self.turn()].into_iter().flatten()
    }

    /// Where the direction turns: once at most, as the acceleration keeps its sign.
    fn turn(&self) -> Option<f64> {
        let State { velocity, acceleration, .. } = self.start;
        if velocity * self.start.after(self.jerk, self.seconds).velocity >= 0.0 {
            return None;
        }
        let inner = acceleration * acceleration - 2.0 * self.jerk * velocity;
        let twice = -(acceleration + sign(acceleration) * inner.max(0.0).sqrt());
        let zeros = [twice / self.jerk, 2.0 * velocity / twice];
        let zero = zeros.into_iter().find(|zero| (0.0..=self.seconds).contains(zero))?;
        Some(self.start.after(self.jerk, zero).position)
    }
}

/// Where an immediate stop ends.
fn stopped(from: &State, bounds: &Bounds) -> f64 {
    let stop = ramp::phases(from, 0.0, bounds);
    stop.iter().fold(*from, |state, phase| phase.run(&state)).position
}

/// Where between `high` and `low` the function, not below zero at `high` and below it at `low`, comes down
/// to zero; found once its value is between zero and `close`.
///
/// Every other step halves the interval, so that any function is searched in time; the ones in between go
/// where a straight line would have its zero.
fn zero(high: f64, low: f64, close: f64, function: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 256; // halve down to values 38 decades below the first ones
    let value = |at| (at, function(at) - close / 2.0);
    let (mut high, mut low) = (value(high), value(low));
    for step in 0..STEPS {
        if high.1 <= close / 2.0 {
            break;
        }
        let halves = step % 2 == 1;
        let share = if halves { 0.5 } else { high.1 / (high.1 - low.1) };
        let middle = value(high.0 + (low.0 - high.0) * share);
        if halves && (middle.0 - high.0) * (middle.0 - low.0) >= 0.0 {
            break; // there is nothing between the two
        }
        if middle.1 >= -close / 2.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    high.0
}

/// How far apart places may be that are meant to be one, between two positions.
fn rounding(one: f64, other: f64) -> f64 {
    1e-9 + 8.0 * f64::EPSILON * one.abs().max(other.abs())
}

fn sign(value: f64) -> f64 {
    if value < 0.0 { -1.0 } else { 1.0 }
}
