//! The digital inputs of an axis: electrical levels, the exact places at which they changed, and what they mean.

use crate::units::Position;

/// Electrical levels of a drive's inputs; `true` is high. Whether high means actuated is a matter of wiring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// End of travel in positive direction.
    pub positive_limit: bool,
    /// End of travel in negative direction.
    pub negative_limit: bool,
    /// Reference switch.
    pub home: bool,
    /// The power electronics have tripped.
    pub drive_fault: bool,
    /// The emergency stop button.
    pub emergency_stop: bool,
    /// First general input.
    pub probe_1: bool,
    /// Second general input.
    pub probe_2: bool,
}

/// Names one of the [`Inputs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// End of travel in positive direction.
    PositiveLimit,
    /// End of travel in negative direction.
    NegativeLimit,
    /// Reference switch.
    Home,
    /// The power electronics have tripped.
    DriveFault,
    /// The emergency stop button.
    EmergencyStop,
    /// First general input.
    Probe1,
    /// Second general input.
    Probe2,
}

/// Where signals changed since the last report, in raw encoder coordinates; `None` where nothing changed.
/// Of several changes of one signal the last one counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Latches {
    /// The index pulse that was passed.
    pub index: Option<Position>,
    /// Edge of the positive limit switch.
    pub positive_limit: Option<Position>,
    /// Edge of the negative limit switch.
    pub negative_limit: Option<Position>,
    /// Edge of the reference switch.
    pub home: Option<Position>,
    /// Edges of the first general input.
    pub probe_1: Edges,
    /// Edges of the second general input.
    pub probe_2: Edges,
}

/// The last edge of either kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Edges {
    /// From low to high; of a [`Switches`] input, from idle to actuated.
    pub rising: Option<Position>,
    /// From high to low.
    pub falling: Option<Position>,
}

impl Edges {
    /// The edges of the signal the other way round.
    #[must_use]
    pub(crate) fn inverted(self) -> Self {
        Self { rising: self.falling, falling: self.rising }
    }

    /// These edges, and where there is none those `before`.
    pub(crate) fn after(self, before: Self) -> Self {
        Self { rising: self.rising.or(before.rising), falling: self.falling.or(before.falling) }
    }

    fn map(self, convert: impl Fn(Position) -> Option<Position>) -> Self {
        Self { rising: self.rising.and_then(&convert), falling: self.falling.and_then(&convert) }
    }
}

impl Latches {
    /// The same signals, each place as `convert` sees it.
    pub(crate) fn map(&self, convert: impl Fn(Position) -> Option<Position>) -> Self {
        Self {
            index: self.index.and_then(&convert),
            positive_limit: self.positive_limit.and_then(&convert),
            negative_limit: self.negative_limit.and_then(&convert),
            home: self.home.and_then(&convert),
            probe_1: self.probe_1.map(&convert),
            probe_2: self.probe_2.map(&convert),
        }
    }
}

/// Which level of an input is the active one (MACCON MAC4 User Manual, section 4.5).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Level {
    /// Nothing is connected: never active.
    Unused,
    /// Active when high.
    #[default]
    High,
    /// Active when low, as with a normally closed contact: a broken wire counts as active.
    Low,
}

impl Level {
    /// Whether an input at this electrical level is active.
    #[must_use]
    pub fn reads(self, is_high: bool) -> bool {
        match self {
            Self::Unused => false,
            Self::High => is_high,
            Self::Low => !is_high,
        }
    }

    /// Where the input has changed, if it is connected.
    fn latch(self, place: Option<Position>) -> Option<Position> {
        place.filter(|_| self != Self::Unused)
    }

    /// Edges of the signal as edges of its meaning.
    fn edges(self, edges: Edges) -> Edges {
        match self {
            Self::Unused => Edges::default(),
            Self::High => edges,
            Self::Low => edges.inverted(),
        }
    }
}

/// The active level of each input; all active high unless told otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Levels {
    /// End of travel in positive direction.
    pub positive_limit: Level,
    /// End of travel in negative direction.
    pub negative_limit: Level,
    /// Reference switch.
    pub home: Level,
    /// Fault signal of the drive.
    pub drive_fault: Level,
    /// Emergency stop.
    pub emergency_stop: Level,
    /// First general input.
    pub probe_1: Level,
    /// Second general input.
    pub probe_2: Level,
}

impl Levels {
    /// What the inputs say.
    #[must_use]
    pub fn read(&self, inputs: &Inputs) -> Switches {
        Switches {
            positive_limit: self.positive_limit.reads(inputs.positive_limit),
            negative_limit: self.negative_limit.reads(inputs.negative_limit),
            home: self.home.reads(inputs.home),
            drive_fault: self.drive_fault.reads(inputs.drive_fault),
            emergency_stop: self.emergency_stop.reads(inputs.emergency_stop),
            probe_1: self.probe_1.reads(inputs.probe_1),
            probe_2: self.probe_2.reads(inputs.probe_2),
        }
    }

    /// The latches with the edges of what the inputs say; what is not connected has none.
    pub(crate) fn turn(&self, latches: Latches) -> Latches {
        Latches {
            positive_limit: self.positive_limit.latch(latches.positive_limit),
            negative_limit: self.negative_limit.latch(latches.negative_limit),
            home: self.home.latch(latches.home),
            probe_1: self.probe_1.edges(latches.probe_1),
            probe_2: self.probe_2.edges(latches.probe_2),
            index: latches.index,
        }
    }
}

/// The meaning of the inputs; `true` is actuated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Switches {
    /// End of travel in positive direction.
    pub positive_limit: bool,
    /// End of travel in negative direction.
    pub negative_limit: bool,
    /// Reference switch.
    pub home: bool,
    /// The drive signals a fault.
    pub drive_fault: bool,
    /// Emergency stop: the power is cut.
    pub emergency_stop: bool,
    /// First general input.
    pub probe_1: bool,
    /// Second general input.
    pub probe_2: bool,
}

/// A position switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Switch {
    /// End of travel in positive direction.
    PositiveLimit,
    /// End of travel in negative direction.
    NegativeLimit,
    /// Reference switch.
    Home,
}

impl Switch {
    /// Whether it is actuated.
    #[must_use]
    pub fn is_actuated(self, switches: &Switches) -> bool {
        match self {
            Self::PositiveLimit => switches.positive_limit,
            Self::NegativeLimit => switches.negative_limit,
            Self::Home => switches.home,
        }
    }

    pub(crate) fn latch(self, latches: &Latches) -> Option<Position> {
        match self {
            Self::PositiveLimit => latches.positive_limit,
            Self::NegativeLimit => latches.negative_limit,
            Self::Home => latches.home,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_input_is_read_by_its_own_level() {
        let levels = Levels {
            positive_limit: Level::Low,
            negative_limit: Level::Unused,
            emergency_stop: Level::Low,
            probe_2: Level::Unused,
            ..Levels::default()
        };
        let off = Switches { positive_limit: true, emergency_stop: true, ..Switches::default() };
        assert_eq!(levels.read(&Inputs::default()), off);
        let all = Inputs {
            positive_limit: true,
            negative_limit: true,
            home: true,
            drive_fault: true,
            emergency_stop: true,
            probe_1: true,
            probe_2: true,
        };
        let on = Switches { home: true, drive_fault: true, probe_1: true, ..Switches::default() };
        assert_eq!(levels.read(&all), on);
    }

    #[test]
    fn the_edges_of_an_input_that_is_active_low_are_the_other_way_round() {
        let levels = Levels { probe_1: Level::Low, probe_2: Level::Unused, ..Levels::default() };
        let up = Edges { rising: Some(Position(5.0)), falling: None };
        let home = Some(Position(7.0));
        let latches = levels.turn(Latches { home, probe_1: up, probe_2: up, ..Latches::default() });
        assert_eq!((latches.home, Levels { home: Level::Unused, ..levels }.turn(latches).home), (home, None));
        assert_eq!(latches.probe_1, Edges { rising: None, falling: Some(Position(5.0)) });
        assert_eq!(latches.probe_2, Edges::default());
    }
}
