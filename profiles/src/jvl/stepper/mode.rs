//! MODE_REG of a MIS stepper (JVL Ethernet manual, section 11.4; the page of the register itself is lost, the numbers
//! are those of STARTMODE and HOMEMODE).

/// A mode of a MIS stepper, by its number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Mode {
    /// No power.
    #[default]
    Passive = 0,
    /// V_SOLL.
    Velocity = 1,
    /// P_SOLL.
    Position = 2,
    /// The external encoder, by the gear ratio.
    Gear = 3,
    /// Zero search to a sensor.
    ForwardSearch = 13,
    /// Zero search to a sensor and back over its edge.
    TwoWaySearch = 14,
}

impl Mode {
    const ALL: [Self; 6] =
        [Self::Passive, Self::Velocity, Self::Position, Self::Gear, Self::ForwardSearch, Self::TwoWaySearch];

    /// The mode with this number, if a stepper has it.
    pub(super) fn from_number(number: i32) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.number() == number)
    }

    pub(super) const fn number(self) -> i32 {
        self as i32
    }

    /// Whether the motor looks for its zero point.
    pub(super) const fn is_search(self) -> bool {
        matches!(self, Self::ForwardSearch | Self::TwoWaySearch)
    }
}
