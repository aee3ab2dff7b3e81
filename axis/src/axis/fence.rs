//! What the limit switches forbid (MACCON MAC4 User Manual, sections 2.2.3 and 6.3).
//!
//! An actuated limit switch closes its direction. The axis brakes; from then on its set-points may only lead away.

use crate::inputs::Switches;
use crate::limits::PositionRange;
use crate::units::{Position, Velocity};

/// What holds when an axis has passed a limit switch that is not actuated over the whole forbidden range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BehindLimit {
    /// The direction stays closed until the axis has come back over the switch.
    #[default]
    Closed,
    /// The direction is open again, as on controllers that do not remember.
    Open,
}

/// A direction of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Positive,
    Negative,
}

impl Side {
    /// Whether a motion at `velocity` goes to this side.
    pub(super) fn is_ahead(self, velocity: Velocity) -> bool {
        self.of(velocity.0) > 0.0
    }

    /// `value`, counted towards this side.
    fn of(self, value: f64) -> f64 {
        match self {
            Self::Positive => value,
            Self::Negative => -value,
        }
    }
}

/// A closed direction.
#[derive(Clone, Copy, Debug)]
struct Barrier {
    /// Where the axis was when its switch was first seen actuated.
    seen: Position,
    /// Where set-points end; none while the axis comes to rest first.
    end: Option<Position>,
}

/// What has become of a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    Closed(Side),
    Opened,
}

/// Both directions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fence {
    positive: Option<Barrier>,
    negative: Option<Barrier>,
}

impl Fence {
    /// Looks at the switches with the axis at `actual`; yields the sides that have just changed.
    pub(super) fn watch(
        &mut self,
        switches: &Switches,
        actual: Position,
        behind: BehindLimit,
    ) -> impl Iterator<Item = Change> + use<> {
        let positive = update(&mut self.positive, Side::Positive, switches.positive_limit, actual, behind);
        let negative = update(&mut self.negative, Side::Negative, switches.negative_limit, actual, behind);
        positive.into_iter().chain(negative)
    }

    /// Ends the set-points of closed sides at `demand`; whether anything changed.
    pub(super) fn settle(&mut self, demand: Position) -> bool {
        let mut is_changed = false;
        for barrier in [&mut self.positive, &mut self.negative].into_iter().flatten() {
            is_changed |= barrier.end.is_none();
            barrier.end.get_or_insert(demand);
        }
        is_changed
    }

    /// Whether a push to this direction leads into a closed side.
    pub(super) fn blocks(&self, direction: f64) -> bool {
        (direction > 0.0 && self.positive.is_some()) || (direction < 0.0 && self.negative.is_some())
    }

    /// `range` without what is closed. Where nothing of it is left, the axis stays at the closed side.
    pub(super) fn cut(&self, range: PositionRange) -> PositionRange {
        let end = |side: &Option<Barrier>| side.as_ref().and_then(|barrier| barrier.end);
        let (lowest, highest) = (end(&self.negative), end(&self.positive));
        let max = highest.map_or(range.max().0, |end| end.0.min(range.max().0));
        let min = lowest.map_or(range.min().0, |end| end.0.max(range.min().0));
        let (min, max) = if highest.is_some() { (min.min(max), max) } else { (min, max.max(min)) };
        PositionRange::new(Position(min), Position(max)).unwrap_or(range)
    }

    /// Moves the coordinates.
    pub(super) fn shift(&mut self, by: Position) {
        for barrier in [&mut self.positive, &mut self.negative].into_iter().flatten() {
            barrier.seen = barrier.seen + by;
            barrier.end = barrier.end.map(|end| end + by);
        }
    }
}

/// Follows one switch.
fn update(
    barrier: &mut Option<Barrier>,
    side: Side,
    is_actuated: bool,
    actual: Position,
    behind: BehindLimit,
) -> Option<Change> {
    match barrier {
        None if is_actuated => {
            *barrier = Some(Barrier { seen: actual, end: None });
            return Some(Change::Closed(side));
        }
        Some(known) if !is_actuated => {
            let is_back = side.of((known.seen - actual).0) >= 0.0;
            if is_back || behind == BehindLimit::Open {
                *barrier = None;
                return Some(Change::Opened);
            }
        }
        None | Some(_) => {}
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSITIVE: Switches = Switches {
        positive_limit: true,
        negative_limit: false,
        home: false,
        drive_fault: false,
        emergency_stop: false,
        probe_1: false,
        probe_2: false,
    };

    fn closed_at(seen: f64, end: f64) -> Fence {
        let mut fence = Fence::default();
        let changes: Vec<_> = fence.watch(&POSITIVE, Position(seen), BehindLimit::Closed).collect();
        assert_eq!(changes, [Change::Closed(Side::Positive)]);
        assert!(fence.settle(Position(end)));
        fence
    }

    /// Whether the side opens when its switch is released at this place.
    fn opens(fence: &mut Fence, at: f64, behind: BehindLimit) -> bool {
        fence.watch(&Switches::default(), Position(at), behind).eq([Change::Opened])
    }

    #[test]
    fn a_closed_side_ends_the_range_where_the_axis_came_to_rest() {
        let mut fence = closed_at(100.0, 120.0);
        assert_eq!(fence.cut(PositionRange::EXACT).max(), Position(120.0));
        assert!(fence.blocks(1.0) && !fence.blocks(-1.0));
        assert!(!fence.settle(Position(0.0)), "it stays where it is");
        fence.shift(Position(-20.0));
        assert_eq!(fence.cut(PositionRange::EXACT).max(), Position(100.0));
    }

    #[test]
    fn coming_back_over_the_switch_opens_it() {
        let mut fence = closed_at(100.0, 120.0);
        assert!(opens(&mut fence, 99.0, BehindLimit::Closed));
        assert!(!fence.blocks(1.0));
    }

    #[test]
    fn a_switch_that_lets_go_where_it_was_met_was_no_end_of_travel() {
        assert!(opens(&mut closed_at(100.0, 120.0), 100.0, BehindLimit::Closed));
    }

    #[test]
    fn a_position_limit_behind_a_closed_side_does_not_lead_through_it() {
        let fence = closed_at(100.0, 120.0);
        let beyond = |min: f64, max: f64| PositionRange::new(Position(min), Position(max)).unwrap();
        assert_eq!(fence.cut(beyond(200.0, 300.0)), beyond(120.0, 120.0));
        let mirrored = Fence { positive: None, negative: fence.positive };
        assert_eq!(mirrored.cut(beyond(-300.0, -200.0)), beyond(120.0, 120.0));
    }

    #[test]
    fn behind_a_narrow_switch_it_stays_closed_or_not_as_configured() {
        let mut fence = closed_at(100.0, 140.0);
        assert!(!opens(&mut fence, 140.0, BehindLimit::Closed));
        assert!(fence.blocks(1.0));
        assert!(opens(&mut fence, 140.0, BehindLimit::Open));
    }
}
