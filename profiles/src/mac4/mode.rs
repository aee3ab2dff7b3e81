//! The operating modes and the changes between them (section 5, diagram 1.2, appendix 7.1.1).

use super::Instruction;

/// An operating mode; its number is that of bits 0-7 of the user status.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
    /// No power.
    #[default]
    Disable = 0,
    /// Power; the axis holds its place.
    Enable = 1,
    /// On the way to somewhere near the next index pulse.
    SearchIndexCoarse = 2,
    /// On the way to the next index pulse.
    SearchIndex = 3,
    /// Reference switch, its left edge, then the next index pulse.
    Home = 4,
    /// On the way to the edge of a switch.
    FindEdge = 5,
    /// Running at a velocity.
    Speed = 6,
    /// Stopped by the emergency ramp, or on the way to that.
    Brake = 7,
    /// On the way to a position, or there.
    Positioning = 8,
    /// Following velocities that the host gives.
    VelocityTracking = 9,
    /// Putting out a value past profile generator and controller.
    Test = 10,
    /// Following positions that the host gives.
    PositionTracking = 11,
    /// Braking before the basic initialisation.
    Reset = 12,
}

impl Mode {
    /// Every mode, by its number.
    pub const ALL: [Self; 13] = [
        Self::Disable,
        Self::Enable,
        Self::SearchIndexCoarse,
        Self::SearchIndex,
        Self::Home,
        Self::FindEdge,
        Self::Speed,
        Self::Brake,
        Self::Positioning,
        Self::VelocityTracking,
        Self::Test,
        Self::PositionTracking,
        Self::Reset,
    ];

    /// The mode of this number.
    #[must_use]
    pub fn from_code(code: i64) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| *mode as i64 == code)
    }

    /// The mode that an instruction chooses. MR does not wait for E and chooses none.
    #[must_use]
    pub fn of(instruction: Instruction) -> Option<Self> {
        match instruction {
            Instruction::MD => Some(Self::Disable),
            Instruction::ME => Some(Self::Enable),
            Instruction::UE => Some(Self::Test),
            Instruction::MB => Some(Self::Brake),
            Instruction::MC => Some(Self::SearchIndexCoarse),
            Instruction::MF => Some(Self::FindEdge),
            Instruction::MH => Some(Self::Home),
            Instruction::MI => Some(Self::SearchIndex),
            Instruction::MP => Some(Self::Positioning),
            Instruction::MS => Some(Self::Speed),
            Instruction::PT => Some(Self::PositionTracking),
            Instruction::VT => Some(Self::VelocityTracking),
            _ => None,
        }
    }

    /// Whether it moves the axis: "Move" in diagram 1.2.
    #[must_use]
    pub fn is_motion(self) -> bool {
        match self {
            Self::SearchIndexCoarse
            | Self::SearchIndex
            | Self::Home
            | Self::FindEdge
            | Self::Speed
            | Self::Positioning
            | Self::VelocityTracking
            | Self::PositionTracking => true,
            Self::Disable | Self::Enable | Self::Brake | Self::Test | Self::Reset => false,
        }
    }

    /// Whether what follows waits for its end off-fly (section 5.15).
    #[must_use]
    pub fn has_end(self) -> bool {
        self.is_justification() || self == Self::Positioning
    }

    /// Whether it justifies the axis: to an index pulse or a switch.
    #[must_use]
    pub fn is_justification(self) -> bool {
        match self {
            Self::SearchIndexCoarse | Self::SearchIndex | Self::Home | Self::FindEdge => true,
            Self::Disable
            | Self::Enable
            | Self::Speed
            | Self::Brake
            | Self::Positioning
            | Self::VelocityTracking
            | Self::Test
            | Self::PositionTracking
            | Self::Reset => false,
        }
    }

    /// Whether the axis may change from `before` to this mode (diagram 1.2; section 6.3.7). Every mode may be executed
    /// again, with other parameters.
    #[must_use]
    pub fn may_follow(self, before: Self) -> bool {
        match self {
            Self::Disable => before != Self::Reset,
            Self::Enable => matches!(before, Self::Disable | Self::Enable | Self::Brake),
            Self::Test => matches!(before, Self::Disable | Self::Test),
            Self::Brake => before.is_motion() || matches!(before, Self::Enable | Self::Brake),
            Self::Reset => false,
            motion => before == motion || matches!(before, Self::Enable | Self::Brake),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_the_appendix() {
        for (code, mode) in (0..).zip(Mode::ALL) {
            assert_eq!((mode as i64, Mode::from_code(code)), (code, Some(mode)));
        }
        assert_eq!(Mode::from_code(13), None);
    }

    /// Diagram 1.2 as a table: which modes (by number) each one may be changed to.
    #[test]
    fn the_changes_are_those_of_the_diagram() {
        let allowed: [&[u8]; 13] = [
            &[0, 1, 10],
            &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 11],
            &[0, 2, 7],
            &[0, 3, 7],
            &[0, 4, 7],
            &[0, 5, 7],
            &[0, 6, 7],
            &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 11],
            &[0, 7, 8],
            &[0, 7, 9],
            &[0, 10],
            &[0, 7, 11],
            &[],
        ];
        for (before, allowed) in Mode::ALL.into_iter().zip(allowed) {
            let found: Vec<u8> =
                Mode::ALL.into_iter().filter(|mode| mode.may_follow(before)).map(|mode| mode as u8).collect();
            assert_eq!(found, allowed, "{before:?}");
        }
    }
}
