//! MODE_REG: what a MAC motor is doing (JVL Ethernet manual, sections 11.2.1 and 11.3.1).

/// A mode of a MAC motor, by its number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Mode {
    /// No power.
    #[default]
    Passive = 0,
    /// V_SOLL.
    Velocity = 1,
    /// P_SOLL.
    Position = 2,
    /// The external encoder, count for count.
    GearPosition = 3,
    /// A torque by the analogue input.
    AnalogTorque = 4,
    /// A velocity by the analogue input.
    AnalogVelocity = 5,
    /// The external encoder, and a velocity by the analogue input on top.
    AnalogVelocityGear = 6,
    /// A current that the current loop is given by hand; not simulated.
    ManualCurrent = 7,
    /// A test of the factory; not simulated.
    StepResponse = 8,
    /// A test of the factory; not simulated.
    InternalTest = 9,
    /// To rest as in an emergency, and held.
    Brake = 10,
    /// To rest by the ramp, and held.
    Stop = 11,
    /// Zero search against a mechanical stop.
    TorqueSearch = 12,
    /// Zero search to a sensor.
    ForwardSearch = 13,
    /// Zero search to a sensor and back over its edge.
    TwoWaySearch = 14,
    /// Safe mode: no power.
    Safe = 15,
    /// A velocity by the analogue input, none around zero.
    AnalogVelocityDeadband = 16,
    /// A torque by the analogue input, up to a velocity.
    LimitedAnalogTorque = 17,
    /// The external encoder, the gear ratio by the analogue input.
    AnalogGear = 18,
    /// A coil on the motor's output; not simulated.
    Coil = 19,
    /// P1 or P2, by the analogue input.
    AnalogBiPosition = 20,
    /// A position by the analogue input.
    AnalogPosition = 21,
    /// A test of the factory; not simulated.
    InternalTest2 = 22,
    /// A test of the factory; not simulated.
    InternalTest3 = 23,
    /// The velocity of the external encoder.
    GearFollow = 24,
    /// Zero search to the index.
    IndexSearch = 25,
}

impl Mode {
    const ALL: [Self; 26] = [
        Self::Passive,
        Self::Velocity,
        Self::Position,
        Self::GearPosition,
        Self::AnalogTorque,
        Self::AnalogVelocity,
        Self::AnalogVelocityGear,
        Self::ManualCurrent,
        Self::StepResponse,
        Self::InternalTest,
        Self::Brake,
        Self::Stop,
        Self::TorqueSearch,
        Self::ForwardSearch,
        Self::TwoWaySearch,
        Self::Safe,
        Self::AnalogVelocityDeadband,
        Self::LimitedAnalogTorque,
        Self::AnalogGear,
        Self::Coil,
        Self::AnalogBiPosition,
        Self::AnalogPosition,
        Self::InternalTest2,
        Self::InternalTest3,
        Self::GearFollow,
        Self::IndexSearch,
    ];

    /// The mode with this number; `None` for the special operations 256 to 258, whose meaning nobody prints, and for
    /// what is no mode.
    pub(crate) fn from_number(number: i32) -> Option<Self> {
        Self::ALL.get(usize::try_from(number).ok()?).copied()
    }

    /// Its number.
    pub(crate) const fn number(self) -> i32 {
        self as i32
    }

    /// Whether the motor looks for its zero point.
    pub(crate) const fn is_search(self) -> bool {
        matches!(self, Self::TorqueSearch | Self::ForwardSearch | Self::TwoWaySearch | Self::IndexSearch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_modes_from_0_to_25() {
        for number in -300..300 {
            let mode = Mode::from_number(number);
            assert_eq!(mode.is_some(), (0..=25).contains(&number), "{number}");
            assert!(mode.is_none_or(|mode| mode.number() == number));
        }
    }
}
