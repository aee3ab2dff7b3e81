//! The encoder on the motor: counts, index, noise, and what is left of it when it breaks.

use super::noise::{Noise, Random};
use super::within;
use crate::units::{Position, Velocity, rounded};

/// What a broken encoder shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EncoderBreak {
    /// The place at which it broke, at standstill.
    #[default]
    Stuck,
    /// Anything within a revolution of that place.
    Garbage,
}

/// The index pulse, once a revolution.
#[derive(Clone, Debug)]
pub(super) struct Index {
    low: f64,
    high: f64,
    at: f64,
    counts: f64,
    revolution: f64,
}

impl Index {
    /// A pulse at `at` and every `counts` from there, the motor being at `place`.
    pub(super) fn new(at: f64, counts: f64, place: f64) -> Self {
        let mut new = Self { low: 0.0, high: 0.0, at, counts, revolution: 0.0 };
        new.turn(place);
        new
    }

    /// Moves the motor to `place`; the last pulse passed on the way.
    pub(super) fn pass(&mut self, place: f64) -> Option<Position> {
        if self.low <= place && place < self.high { None } else { self.turn(place) }
    }

    #[cold]
    fn turn(&mut self, place: f64) -> Option<Position> {
        let before = self.revolution;
        self.revolution = ((place - self.at) / self.counts).floor();
        self.low = self.revolution * self.counts + self.at;
        self.high = (self.revolution + 1.0) * self.counts + self.at;
        if self.revolution > before {
            Some(Position(self.low))
        } else {
            (self.revolution < before).then_some(Position(self.high))
        }
    }
}

/// The signals of the encoder as the drive evaluates them.
#[derive(Clone, Debug)]
pub(super) struct Sensor {
    noise: Noise,
    counts: f64,
    random: Random,
    when_broken: EncoderBreak,
    /// Where it broke.
    broken: Option<Position>,
    position_error: f64,
    velocity_error: f64,
}

impl Sensor {
    pub(super) fn new(noise: Noise, when_broken: EncoderBreak, counts: f64) -> Self {
        let amplitude = |wanted| within(wanted, 0.0, 1e9, 0.0);
        let noise = Noise { encoder: amplitude(noise.encoder), velocity: amplitude(noise.velocity), ..noise };
        let random = Random::new(noise.seed);
        Self { noise, counts, random, when_broken, broken: None, position_error: 0.0, velocity_error: 0.0 }
    }

    /// Whether it shows anything but the truth.
    pub(super) fn is_disturbed(&self) -> bool {
        self.noise.encoder > 0.0 || self.noise.velocity > 0.0 || self.broken.is_some()
    }

    pub(super) fn is_broken(&self) -> bool {
        self.broken.is_some()
    }

    pub(super) fn break_at(&mut self, place: Option<Position>) {
        self.broken = place;
        (self.position_error, self.velocity_error) = (0.0, 0.0);
    }

    /// Draws new errors; there are none while the power stage and the shaft rest.
    pub(super) fn sample(&mut self, is_idle: bool) {
        if !self.is_disturbed() {
            return;
        }
        let (position, velocity) = match (self.broken, self.when_broken) {
            (None, _) => (self.noise.encoder, self.noise.velocity),
            (Some(_), EncoderBreak::Stuck) => (0.0, 0.0),
            (Some(_), EncoderBreak::Garbage) => (self.counts, self.counts),
        };
        let of = if is_idle { 0.0 } else { 1.0 };
        self.position_error = of * position * self.random.next();
        self.velocity_error = of * velocity * self.random.next();
    }

    pub(super) fn position(&self, motor: f64) -> Position {
        let place = self.broken.map_or(motor, |place| place.0);
        Position(rounded(place + self.position_error))
    }

    pub(super) fn velocity(&self, motor: f64) -> Velocity {
        let velocity = if self.is_broken() { 0.0 } else { motor };
        Velocity(velocity + self.velocity_error)
    }
}
