//! The homing methods as data (IEC 61800-7-201, homing mode, figures of the methods; JVL module manual, section 4.3.25).
//!
//! A method with a switch ends at one edge of the switch, crossed at low speed towards one side: methods 17-30 right
//! there, methods 1-14 at the first index pulse further to that side.

use axis::Switch;

use crate::Dialect;

use Direction::{Negative, Positive};
use Edge::{Lower, Upper};

/// Where to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    Positive,
    Negative,
}

impl Direction {
    /// 1 or -1.
    pub(super) fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }

    pub(super) fn reversed(self) -> Self {
        match self {
            Self::Positive => Self::Negative,
            Self::Negative => Self::Positive,
        }
    }
}

/// An end of the range in which a switch is actuated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edge {
    Lower,
    Upper,
}

impl Edge {
    /// The edge that a motion has just passed, after which the switch is actuated or not.
    pub(super) fn passed(direction: Direction, is_actuated: bool) -> Self {
        match (direction, is_actuated) {
            (Positive, true) | (Negative, false) => Self::Lower,
            (Positive, false) | (Negative, true) => Self::Upper,
        }
    }

    /// Where a motion out of the switch passes it.
    pub(super) fn way_out(self) -> Direction {
        match self {
            Self::Lower => Negative,
            Self::Upper => Positive,
        }
    }
}

/// A search for the edge of a switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SwitchMethod {
    pub(super) switch: Switch,
    /// Where to go first while the switch is not actuated.
    pub(super) initial: Direction,
    /// The edge looked for.
    pub(super) edge: Edge,
    /// To which side it is crossed at low speed, and where the index is looked for.
    pub(super) side: Direction,
    /// A limit switch on the way turns the search around; otherwise it is an error.
    pub(super) turns: bool,
    /// Ends at the index pulse.
    pub(super) index: bool,
}

impl SwitchMethod {
    /// Whether the switch is actuated behind the edge.
    pub(super) fn is_actuated_after(self) -> bool {
        self.edge.way_out() != self.side
    }
}

/// What a method looks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    /// An edge of a switch, and perhaps the index behind it.
    Switch(SwitchMethod),
    /// The next index pulse.
    Index(Direction),
    /// A mechanical stop, and perhaps the next index pulse on the way back.
    Stop { direction: Direction, index: bool },
    /// Nothing: home is where the axis is.
    Here,
}

/// Methods 1-14: switch, initial direction, edge, side, whether a limit switch turns it around.
const BY_SWITCH: [(Switch, Direction, Edge, Direction, bool); 14] = [
    (Switch::NegativeLimit, Negative, Upper, Positive, false),
    (Switch::PositiveLimit, Positive, Lower, Negative, false),
    (Switch::Home, Positive, Lower, Negative, false),
    (Switch::Home, Positive, Lower, Positive, false),
    (Switch::Home, Negative, Upper, Positive, false),
    (Switch::Home, Negative, Upper, Negative, false),
    (Switch::Home, Positive, Lower, Negative, true),
    (Switch::Home, Positive, Lower, Positive, true),
    (Switch::Home, Positive, Upper, Negative, true),
    (Switch::Home, Positive, Upper, Positive, true),
    (Switch::Home, Negative, Upper, Positive, true),
    (Switch::Home, Negative, Upper, Negative, true),
    (Switch::Home, Negative, Lower, Positive, true),
    (Switch::Home, Negative, Lower, Negative, true),
];

impl Method {
    /// The method with this number in 0x6098; none for 0, "no homing", and what is reserved.
    pub(super) fn of(number: i64) -> Option<Self> {
        match number {
            1..=14 => by_switch(number, true),
            17..=30 => by_switch(number - 16, false),
            33 => Some(Self::Index(Negative)),
            34 => Some(Self::Index(Positive)),
            // 37 has replaced 35 in later editions.
            35 | 37 => Some(Self::Here),
            -1 => Some(Self::Stop { direction: Negative, index: true }),
            -2 => Some(Self::Stop { direction: Positive, index: true }),
            -3 => Some(Self::Stop { direction: Negative, index: false }),
            -4 => Some(Self::Stop { direction: Positive, index: false }),
            _ => None,
        }
    }
}

fn by_switch(number: i64, index: bool) -> Option<Method> {
    let (switch, initial, edge, side, turns) = *BY_SWITCH.get(usize::try_from(number - 1).ok()?)?;
    Some(Method::Switch(SwitchMethod { switch, initial, edge, side, turns, index }))
}

/// Whether a drive of this dialect takes the method; 0, "no homing", always. JVL's modules have those "from 3-34" and
/// four of their own.
pub(crate) fn is_method(number: i64, dialect: Dialect) -> bool {
    let is_offered = match dialect {
        Dialect::Cia402 | Dialect::Mac4(_) => number > 0,
        Dialect::Jvl => (-4..=34).contains(&number) && !(1..=2).contains(&number),
    };
    number == 0 || (is_offered && Method::of(number).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(dialect: Dialect) -> Vec<i64> {
        (-128..=127).filter(|number| is_method(*number, dialect)).collect()
    }

    #[test]
    fn each_dialect_has_its_methods() {
        let neutral: Vec<i64> = (0..=14).chain(17..=30).chain([33, 34, 35, 37]).collect();
        assert_eq!(of(Dialect::Cia402), neutral);
        let jvl: Vec<i64> = (-4..=0).chain(3..=14).chain(17..=30).chain([33, 34]).collect();
        assert_eq!(of(Dialect::Jvl), jvl);
    }

    #[test]
    fn methods_with_and_without_index_differ_in_nothing_else() {
        for number in 1..=14 {
            let Some(Method::Switch(with)) = Method::of(number) else { panic!("{number}") };
            let without = Method::Switch(SwitchMethod { index: false, ..with });
            assert!(with.index);
            assert_eq!(Method::of(number + 16), Some(without));
        }
    }
}
