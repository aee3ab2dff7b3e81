//! Linear and circular axes (MACCON MAC4 User Manual, section 4.3).
//!
//! Inside, every axis is a straight line. On a circular one a place repeats with each turn: what is reported is
//! wrapped into one turn, and a target stands for all its repetitions, of which a rule chooses one.

use crate::units::Position;

/// How positions of an axis repeat.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Travel {
    /// Not at all; software limits may bound the axis.
    #[default]
    Linear,
    /// Every turn. A target is approached within the turn the axis is in, so never across the origin.
    Circular(Turn),
    /// Every turn. A target is approached the shortest way, in positive direction if both are equal.
    CircularOptimised(Turn),
}

/// The length of a turn: 1 to 2^40 whole counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn(f64);

impl Turn {
    const LONGEST: f64 = 1_099_511_627_776.0;

    /// A turn of so many counts; `None` when that is no whole number in the range.
    #[must_use]
    pub fn new(counts: Position) -> Option<Self> {
        let is_whole = Position(counts.0.floor()) == counts;
        (is_whole && (1.0..=Self::LONGEST).contains(&counts.0)).then_some(Self(counts.0))
    }

    /// The length of the turn.
    #[must_use]
    pub fn length(self) -> Position {
        Position(self.0)
    }

    /// The place within a turn, from 0 up to but not including its length.
    fn place(self, position: Position) -> Position {
        let rest = position.0 - self.turns(position);
        let rest = if rest < 0.0 { rest + self.0 } else { rest };
        Position(if rest < self.0 { rest } else { 0.0 })
    }

    /// The whole turns below a position, in counts.
    fn turns(self, position: Position) -> f64 {
        (position.0 / self.0).floor() * self.0
    }
}

impl Travel {
    /// The turn of a circular axis.
    #[must_use]
    pub fn turn(&self) -> Option<Turn> {
        match self {
            Self::Linear => None,
            Self::Circular(turn) | Self::CircularOptimised(turn) => Some(*turn),
        }
    }

    /// The position as it is reported.
    #[must_use]
    pub fn wrap(&self, position: Position) -> Position {
        self.turn().map_or(position, |turn| turn.place(position))
    }

    /// Where on the straight line an absolute target lies for an axis that is at `from`.
    #[must_use]
    pub fn target(&self, target: Position, from: Position) -> Position {
        match self {
            Self::Linear => target,
            Self::Circular(turn) => turn.place(target) + Position(turn.turns(from)),
            Self::CircularOptimised(_) => self.nearest(target, from),
        }
    }

    /// The repetition of `place` nearest to `from`.
    #[must_use]
    pub fn nearest(&self, place: Position, from: Position) -> Position {
        let Some(turn) = self.turn() else { return place };
        let ahead = turn.place(turn.place(place) - turn.place(from));
        let way = if ahead.0 + ahead.0 > turn.0 { ahead.0 - turn.0 } else { ahead.0 };
        let base = turn.turns(from) + turn.place(from).0 + way;
        // Whole places stay whole, whatever fraction `from` has.
        let repetition = ((base - turn.place(place).0) / turn.0 + 0.5).floor();
        turn.place(place) + Position(repetition * turn.0)
    }

    /// Whole turns to take off a position that has become large, so that counts stay exact; zero otherwise.
    pub(crate) fn excess(&self, position: Position) -> Position {
        let is_large = position.abs().0 > Turn::LONGEST;
        Position(self.turn().filter(|_| is_large).map_or(0.0, |turn| turn.turns(position)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn turn(counts: f64) -> Turn {
        Turn::new(Position(counts)).unwrap()
    }

    #[test]
    fn a_turn_is_a_whole_number_of_counts() {
        for counts in [0.0, -1.0, 0.5, 3.5, f64::NAN, f64::INFINITY, 2e12] {
            assert_eq!(Turn::new(Position(counts)), None, "{counts}");
        }
        assert_eq!(turn(36_000.0).length(), Position(36_000.0));
    }

    #[test]
    fn the_counter_wraps_at_the_turn_and_below_zero() {
        let travel = Travel::Circular(turn(1000.0));
        let wrapped = [0.0, 999.0, 1000.0, -1.0, 2500.0, -1e-18].map(|p| travel.wrap(Position(p)));
        assert_eq!(wrapped, [0.0, 999.0, 0.0, 999.0, 500.0, 0.0].map(Position));
        assert_eq!(Travel::Linear.wrap(Position(-1.0)), Position(-1.0));
    }

    #[test]
    fn a_circular_axis_stays_in_its_turn_and_an_optimised_one_crosses_it() {
        let (plain, optimised) = (Travel::Circular(turn(1000.0)), Travel::CircularOptimised(turn(1000.0)));
        let from = Position(2900.0);
        assert_eq!(plain.target(Position(100.0), from), Position(2100.0));
        assert_eq!(optimised.target(Position(100.0), from), Position(3100.0));
        assert_eq!(optimised.target(Position(400.0), from), Position(3400.0));
        assert_eq!(optimised.target(Position(401.0), from), Position(2401.0));
    }

    proptest! {
        #[test]
        fn the_shortest_way_is_that_of_brute_force(
            counts in 1_u32..100_000, target in -300_000_i32..300_000, from in -900_000_i32..900_000,
        ) {
            let travel = Travel::CircularOptimised(turn(f64::from(counts)));
            let (counts, target) = (i64::from(counts), i64::from(target).rem_euclid(i64::from(counts)));
            let from = i64::from(from);
            let around = from.div_euclid(counts) - 2;
            let best = (around..around + 5)
                .map(|k| target + k * counts)
                .min_by_key(|place| ((place - from).abs(), from - place))
                .unwrap();
            let chosen = travel.target(Position(target as f64), Position(from as f64));
            prop_assert_eq!(chosen, Position(best as f64));
        }

        #[test]
        fn a_target_is_a_repetition_of_itself_wherever_the_axis_is(
            counts in 1_u32..100_000, target in 0_u32..100_000, from in -1e9..1e9_f64,
        ) {
            let turn = turn(f64::from(counts));
            let place = Position(f64::from(target % counts));
            for travel in [Travel::Circular(turn), Travel::CircularOptimised(turn)] {
                let chosen = travel.target(place, Position(from));
                prop_assert_eq!(travel.wrap(chosen), place);
                prop_assert!((chosen.0 - from).abs() <= f64::from(counts));
            }
            let nearest = Travel::CircularOptimised(turn).target(place, Position(from));
            prop_assert!((nearest.0 - from).abs() <= f64::from(counts) / 2.0 + 1e-6);
        }

        #[test]
        fn a_wrapped_position_lies_in_the_turn(counts in 1_u64..1_000_000_000_000, at in -9e15..9e15_f64) {
            let turn = turn(counts as f64);
            let wrapped = Travel::Circular(turn).wrap(Position(at));
            prop_assert!((0.0..counts as f64).contains(&wrapped.0), "{wrapped:?}");
        }
    }
}
