//! The maxima of an axis.

use crate::profile::Profile;
use crate::units::{Acceleration, Jerk, Position, Torque, Velocity, magnitude};

/// What an axis never exceeds, whatever it is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Highest speed, 0 to 10^12 counts/s.
    pub velocity: Velocity,
    /// Highest acceleration, 10^-3 to 10^15 counts/s².
    pub acceleration: Acceleration,
    /// Highest deceleration, 10^-3 to 10^15 counts/s²; `None` is the same as the acceleration.
    pub deceleration: Option<Acceleration>,
    /// Highest jerk of a profile, 10^-3 to 10^18 counts/s³; `None` is no limit.
    pub jerk: Option<Jerk>,
    /// Highest torque, 0 to 10^6 per mille of rated torque.
    pub torque: Torque,
    /// Software position limits; `None` is the whole exact range of counts.
    pub position: Option<PositionRange>,
}

impl Limits {
    const MAX_VELOCITY: f64 = 1e12;
    const MIN_ACCELERATION: f64 = 1e-3;
    const MAX_ACCELERATION: f64 = 1e15;
    const MIN_JERK: f64 = 1e-3;
    const MAX_JERK: f64 = 1e18;
    const MAX_TORQUE: f64 = 1e6;

    /// The limits with every value pulled into its range; what is not a number becomes the smallest value.
    #[must_use]
    pub fn sanitised(self) -> Self {
        let rate = |rate: Acceleration| {
            Acceleration(magnitude(rate.0, Self::MAX_ACCELERATION).max(Self::MIN_ACCELERATION))
        };
        Self {
            velocity: Velocity(magnitude(self.velocity.0, Self::MAX_VELOCITY)),
            acceleration: rate(self.acceleration),
            deceleration: self.deceleration.map(rate),
            jerk: self.jerk.map(|jerk| Jerk(magnitude(jerk.0, Self::MAX_JERK).max(Self::MIN_JERK))),
            torque: Torque(magnitude(self.torque.0, Self::MAX_TORQUE)),
            position: self.position,
        }
    }

    /// The profile as this axis runs it: no value above its maximum.
    ///
    /// Signs are dropped and a velocity that is not a number is zero. A ramp that is zero or not a number
    /// becomes the axis maximum, so that a motion can always be stopped; none is below 10^-3 counts/s². A
    /// jerk that is zero or not a number becomes the axis maximum, too.
    #[must_use]
    pub fn clamp(&self, profile: Profile) -> Profile {
        Profile {
            velocity: Velocity(magnitude(profile.velocity.0, self.velocity.0)),
            acceleration: ramp(profile.acceleration, self.acceleration),
            deceleration: ramp(profile.deceleration, self.braking()),
            jerk: self.jerk(profile.jerk),
        }
    }

    /// Highest deceleration.
    #[must_use]
    pub fn braking(&self) -> Acceleration {
        self.deceleration.unwrap_or(self.acceleration)
    }

    /// Where set-points may be.
    #[must_use]
    pub fn range(&self) -> PositionRange {
        self.position.unwrap_or(PositionRange::EXACT)
    }

    /// The smaller of `wanted` and the axis maximum; `None` when neither limits.
    fn jerk(&self, wanted: Option<Jerk>) -> Option<Jerk> {
        let most = self.jerk.map_or(f64::INFINITY, |jerk| jerk.0);
        let rate = magnitude(wanted.map_or(0.0, |jerk| jerk.0), most);
        let rate = if rate > 0.0 { rate.max(Self::MIN_JERK) } else { most };
        rate.is_finite().then_some(Jerk(rate))
    }
}

/// `wanted`, but not above `most` and not too small to end; zero and what is not a number are `most`.
fn ramp(wanted: Acceleration, most: Acceleration) -> Acceleration {
    let rate = magnitude(wanted.0, most.0);
    if rate > 0.0 { Acceleration(rate.max(Limits::MIN_ACCELERATION)) } else { most }
}

impl Default for Limits {
    /// 50 rev/s, 1000 rev/s² and three times the rated torque on the default plant; no limit of jerk or position.
    fn default() -> Self {
        Self {
            velocity: Velocity(409_600.0),
            acceleration: Acceleration(8_192_000.0),
            deceleration: None,
            jerk: None,
            torque: Torque(3000.0),
            position: None,
        }
    }
}

/// The highest torque to either side, 0 or more per mille of the rated torque.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TorqueLimit {
    /// Of a torque in positive direction.
    pub positive: Torque,
    /// Of a torque in negative direction, a magnitude.
    pub negative: Torque,
}

impl TorqueLimit {
    /// The same limit to both sides; a sign is dropped, what is not a number is zero.
    #[must_use]
    pub fn both(limit: Torque) -> Self {
        let limit = Torque(magnitude(limit.0, f64::INFINITY));
        Self { positive: limit, negative: limit }
    }

    /// The torque nearest to `torque` that is allowed; zero for what is not a number.
    #[must_use]
    pub fn cut(&self, torque: Torque) -> Torque {
        let most = if torque.0 < 0.0 { self.negative } else { self.positive };
        Torque(magnitude(torque.0, most.0.max(0.0)).copysign(torque.0))
    }

    /// The narrower limit on each side.
    #[must_use]
    pub fn least(self, other: Self) -> Self {
        Self {
            positive: Torque(self.positive.0.min(other.positive.0)),
            negative: Torque(self.negative.0.min(other.negative.0)),
        }
    }
}

/// A closed range of positions that holds at least one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionRange {
    min: Position,
    max: Position,
}

impl PositionRange {
    /// The range in which whole counts are exact: ±2^53.
    pub const EXACT: Self = Self { min: Position(-Self::BOUND), max: Position(Self::BOUND) };

    const BOUND: f64 = 9_007_199_254_740_992.0;

    /// The range from `min` to `max`, cut to ±2^53 (an infinite end is no limit on that side); `None` when
    /// an end is not a number or the range is empty.
    #[must_use]
    pub fn new(min: Position, max: Position) -> Option<Self> {
        let cut = |end: Position| Position(end.0.clamp(-Self::BOUND, Self::BOUND));
        (min <= max).then(|| Self { min: cut(min), max: cut(max) })
    }

    /// The lower end.
    #[must_use]
    pub const fn min(&self) -> Position {
        self.min
    }

    /// The upper end.
    #[must_use]
    pub const fn max(&self) -> Position {
        self.max
    }

    /// Whether `position` lies in the range, ends included.
    #[must_use]
    pub fn contains(&self, position: Position) -> bool {
        self.min <= position && position <= self.max
    }

    /// The place in the range nearest to `position`; the lower end for what is not a number.
    #[must_use]
    pub fn nearest(&self, position: Position) -> Position {
        Position(position.0.max(self.min.0).min(self.max.0))
    }

    /// The smallest range that holds this one and `position`.
    #[must_use]
    pub(crate) fn including(self, position: Position) -> Self {
        Self { min: Position(self.min.0.min(position.0)), max: Position(self.max.0.max(position.0)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_refuses_reversed_and_unordered_ends() {
        assert_eq!(PositionRange::new(Position(1.0), Position(0.0)), None);
        assert_eq!(PositionRange::new(Position(f64::NAN), Position(0.0)), None);
    }

    #[test]
    fn an_infinite_end_is_no_limit_on_that_side() {
        let range = PositionRange::new(Position(f64::NEG_INFINITY), Position(5.0)).unwrap();
        assert!(range.contains(Position(-1e15)));
        assert_eq!(range.nearest(Position(6.0)), Position(5.0));
    }

    #[test]
    fn a_profile_is_clamped_to_the_axis_maxima() {
        let limits = Limits::default();
        let wild = Profile {
            velocity: Velocity(f64::NAN),
            acceleration: Acceleration(f64::INFINITY),
            deceleration: Acceleration(-5.0),
            jerk: None,
        };
        let clamped = limits.clamp(wild);
        assert_eq!(clamped.velocity, Velocity(0.0));
        assert_eq!(clamped.acceleration, limits.acceleration);
        assert_eq!(clamped.deceleration, Acceleration(5.0));
        assert_eq!(limits.clamp(Profile::default()).deceleration, limits.acceleration);
    }

    #[test]
    fn a_deceleration_has_its_own_maximum_if_there_is_one() {
        let limits = Limits { deceleration: Some(Acceleration(500.0)), ..Limits::default() };
        let hard = Profile { deceleration: Acceleration(700.0), ..Profile::default() };
        assert_eq!(limits.clamp(hard).deceleration, Acceleration(500.0));
        assert_eq!(limits.clamp(hard).acceleration, limits.acceleration);
        assert_eq!(limits.clamp(Profile::default()).deceleration, Acceleration(500.0));
    }

    #[test]
    fn a_torque_is_cut_to_the_limit_of_its_side() {
        let limit = TorqueLimit { positive: Torque(300.0), negative: Torque(50.0) };
        let cuts = [-400.0, -20.0, 0.0, 299.0, f64::INFINITY].map(|torque| limit.cut(Torque(torque)).0);
        assert_eq!(cuts.map(Torque), [-50.0, -20.0, 0.0, 299.0, 300.0].map(Torque));
        assert_eq!(limit.cut(Torque(f64::NAN)).abs(), Torque(0.0));
        let both = TorqueLimit::both(Torque(-100.0));
        assert_eq!(both.least(limit), TorqueLimit { positive: Torque(100.0), negative: Torque(50.0) });
        assert_eq!(TorqueLimit::both(Torque(f64::NAN)), TorqueLimit::default());
    }

    #[test]
    fn limits_that_are_not_numbers_become_the_smallest_value() {
        let nan = f64::NAN;
        let wild = Limits {
            velocity: Velocity(nan),
            acceleration: Acceleration(nan),
            deceleration: Some(Acceleration(nan)),
            jerk: Some(Jerk(nan)),
            torque: Torque(nan),
            position: None,
        };
        let tame = wild.sanitised();
        assert_eq!(tame.velocity, Velocity(0.0));
        assert_eq!(tame.acceleration, Acceleration(1e-3));
        assert_eq!(tame.deceleration, Some(Acceleration(1e-3)));
        assert_eq!(tame.jerk, Some(Jerk(1e-3)));
        assert_eq!(tame.torque, Torque(0.0));
    }

    #[test]
    fn the_jerk_of_a_profile_is_the_smaller_one_if_there_is_any() {
        let jerk = |most: Option<f64>, wanted: Option<f64>| {
            let limits = Limits { jerk: most.map(Jerk), ..Limits::default() };
            limits.clamp(Profile { jerk: wanted.map(Jerk), ..Profile::default() }).jerk
        };
        assert_eq!(jerk(None, None), None);
        assert_eq!(jerk(None, Some(f64::INFINITY)), None);
        assert_eq!(jerk(None, Some(-7.0)), Some(Jerk(7.0)));
        assert_eq!(jerk(Some(5.0), Some(7.0)), Some(Jerk(5.0)));
        assert_eq!(jerk(Some(5.0), Some(4.0)), Some(Jerk(4.0)));
        assert_eq!(jerk(Some(5.0), Some(f64::NAN)), Some(Jerk(5.0)));
        assert_eq!(jerk(Some(5.0), None), Some(Jerk(5.0)));
    }
}
