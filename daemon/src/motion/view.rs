//! What of an axis is looked at.

use od::Address;
use profiles::{State, Statusword};

/// Objects of the first axis; those of the next ones follow at [`DISTANCE`] (CiA 402-1, object ranges of axes).
pub(super) const ERROR_CODE: u16 = 0x603F;
pub(super) const CONTROLWORD: u16 = 0x6040;
pub(super) const STATUSWORD: u16 = 0x6041;
pub(super) const MODE: u16 = 0x6060;
pub(super) const MODE_DISPLAY: u16 = 0x6061;
pub(super) const POSITION_DEMAND: u16 = 0x6062;
pub(super) const POSITION_ACTUAL: u16 = 0x6064;
pub(super) const VELOCITY_ACTUAL: u16 = 0x606C;
pub(super) const TARGET_POSITION: u16 = 0x607A;
pub(super) const PROFILE_VELOCITY: u16 = 0x6081;
pub(super) const PROFILE_ACCELERATION: u16 = 0x6083;
pub(super) const PROFILE_DECELERATION: u16 = 0x6084;
pub(super) const HOMING_METHOD: u16 = 0x6098;
pub(super) const TARGET_VELOCITY: u16 = 0x60FF;

/// Distance of the objects of two axes.
const DISTANCE: u16 = 0x800;

/// What is read of an axis for each [`View`], in this order; what a device does not have reads as nothing.
pub const READ: [u16; 7] =
    [STATUSWORD, CONTROLWORD, MODE_DISPLAY, POSITION_ACTUAL, POSITION_DEMAND, VELOCITY_ACTUAL, ERROR_CODE];

/// The object of axis number `axis`, from 0, that is `index` of the first one.
#[must_use]
pub fn part(index: u16, axis: u8) -> Address {
    Address::new(index + DISTANCE * u16::from(axis & 7), 0)
}

/// An axis at one moment, in user units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct View {
    /// 0x6041.
    pub statusword: u16,
    /// 0x6040, as it was last written.
    pub controlword: u16,
    /// 0x6061.
    pub mode: i64,
    /// 0x6064.
    pub position: i64,
    /// 0x6062, if the device has it.
    pub demand: Option<i64>,
    /// 0x606C, if the device has it.
    pub velocity: Option<i64>,
    /// 0x603F, zero if the device has none.
    pub error: u16,
}

impl View {
    /// The view that these values of [`READ`] give; `None` if the axis has no statusword, mode or position.
    #[must_use]
    pub fn new(values: &[Option<i64>]) -> Option<Self> {
        let value = |position: usize| values.get(position).copied().flatten();
        Some(Self {
            statusword: value(0)? as u16,
            controlword: value(1).unwrap_or(0) as u16,
            mode: value(2)?,
            position: value(3)?,
            demand: value(4),
            velocity: value(5),
            error: value(6).unwrap_or(0) as u16,
        })
    }

    /// The state that the statusword tells.
    #[must_use]
    pub fn state(&self) -> State {
        const STATES: [State; 8] = [
            State::NotReadyToSwitchOn,
            State::SwitchOnDisabled,
            State::ReadyToSwitchOn,
            State::SwitchedOn,
            State::OperationEnabled,
            State::QuickStopActive,
            State::FaultReactionActive,
            State::Fault,
        ];
        // The quick stop bit tells nothing in the states that have none of the first three bits.
        let told = |mask: u16| self.statusword & mask;
        let known = |state: &State| {
            let word = Statusword::of(*state).bits();
            let mask = if word & 0x07 == 0 { 0x4F } else { 0x6F };
            told(mask) == word & mask
        };
        STATES.into_iter().find(known).unwrap_or(State::NotReadyToSwitchOn)
    }

    pub(super) fn has(&self, bit: Statusword) -> bool {
        self.statusword & bit.bits() != 0
    }

    /// Where the axis is to be, as far as that is known.
    pub(super) fn commanded(&self) -> i64 {
        self.demand.filter(|_| self.state() == State::OperationEnabled).unwrap_or(self.position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_statusword_tells_the_state_whatever_else_it_says() {
        let state = |statusword| View { statusword, ..View::default() }.state();
        for (word, expected) in [
            (0x0000, State::NotReadyToSwitchOn),
            (0x0020, State::NotReadyToSwitchOn),
            (0x0650, State::SwitchOnDisabled),
            (0x0670, State::SwitchOnDisabled),
            (0x0631, State::ReadyToSwitchOn),
            (0x0633, State::SwitchedOn),
            (0x1637, State::OperationEnabled),
            (0x0617, State::QuickStopActive),
            (0x061F, State::FaultReactionActive),
            (0x0618, State::Fault),
            (0x0638, State::Fault),
        ] {
            assert_eq!(state(word), expected, "{word:04X}");
        }
    }

    #[test]
    fn objects_of_the_next_axes_follow_at_a_distance() {
        assert_eq!([0, 1, 3].map(|axis| part(STATUSWORD, axis).index), [0x6041, 0x6841, 0x7841]);
    }
}
