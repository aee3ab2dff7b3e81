//! Roles that belong together, in the order of their numbers.

use super::Role;

impl Role {
    /// Whether it is a register of a group: one of a set that a command or an input makes the present one.
    #[must_use]
    pub const fn is_in_group(self) -> bool {
        matches!(
            self,
            Self::Pos0
                | Self::Pos1
                | Self::Pos2
                | Self::Pos3
                | Self::Pos4
                | Self::Pos5
                | Self::Pos6
                | Self::Pos7
                | Self::Vel0
                | Self::Vel1
                | Self::Vel2
                | Self::Vel3
                | Self::Vel4
                | Self::Vel5
                | Self::Vel6
                | Self::Vel7
                | Self::Acc0
                | Self::Acc1
                | Self::Acc2
                | Self::Acc3
                | Self::Tq0
                | Self::Tq1
                | Self::Tq2
                | Self::Tq3
                | Self::Load0
                | Self::Load1
                | Self::Load2
                | Self::Load3
                | Self::Zero0
                | Self::Zero1
                | Self::Zero2
                | Self::Zero3
                | Self::Mode0
                | Self::Mode1
                | Self::Mode2
                | Self::Mode3
        )
    }

    /// Position registers P1-P8.
    pub const POSITIONS: [Self; 8] =
        [Self::Pos0, Self::Pos1, Self::Pos2, Self::Pos3, Self::Pos4, Self::Pos5, Self::Pos6, Self::Pos7];

    /// Velocity registers V1-V8.
    pub const VELOCITIES: [Self; 8] =
        [Self::Vel0, Self::Vel1, Self::Vel2, Self::Vel3, Self::Vel4, Self::Vel5, Self::Vel6, Self::Vel7];

    /// Acceleration registers A1-A4.
    pub const ACCELERATIONS: [Self; 4] = [Self::Acc0, Self::Acc1, Self::Acc2, Self::Acc3];

    /// Torque registers T1-T4.
    pub const TORQUES: [Self; 4] = [Self::Tq0, Self::Tq1, Self::Tq2, Self::Tq3];

    /// Load registers L1-L4.
    pub const LOADS: [Self; 4] = [Self::Load0, Self::Load1, Self::Load2, Self::Load3];

    /// Window registers Z1-Z4.
    pub const WINDOWS: [Self; 4] = [Self::Zero0, Self::Zero1, Self::Zero2, Self::Zero3];

    /// Mode registers M1-M4.
    pub const MODES: [Self; 4] = [Self::Mode0, Self::Mode1, Self::Mode2, Self::Mode3];

    /// Hardware input functions, in the order in which they are executed.
    pub const INPUT_FUNCTIONS: [Self; 12] = [
        Self::Hwi0,
        Self::Hwi1,
        Self::Hwi2,
        Self::Hwi3,
        Self::Hwi4,
        Self::Hwi5,
        Self::Hwi6,
        Self::Hwi7,
        Self::Hwi8,
        Self::Hwi9,
        Self::Hwi10,
        Self::Hwi11,
    ];

    /// Filtered analogue inputs 1-8.
    pub const ANALOG_FILTERED: [Self; 8] = [
        Self::AnalogFiltered0,
        Self::AnalogFiltered1,
        Self::AnalogFiltered2,
        Self::AnalogFiltered3,
        Self::AnalogFiltered4,
        Self::AnalogFiltered5,
        Self::AnalogFiltered6,
        Self::AnalogFiltered7,
    ];

    /// Analogue inputs 1-8.
    pub const ANALOG_INPUTS: [Self; 8] = [
        Self::AnalogInput0,
        Self::AnalogInput1,
        Self::AnalogInput2,
        Self::AnalogInput3,
        Self::AnalogInput4,
        Self::AnalogInput5,
        Self::AnalogInput6,
        Self::AnalogInput7,
    ];

    /// What the master reads in cycles.
    pub const MODULE_READS: [Self; 8] = [
        Self::ModuleRead0,
        Self::ModuleRead1,
        Self::ModuleRead2,
        Self::ModuleRead3,
        Self::ModuleRead4,
        Self::ModuleRead5,
        Self::ModuleRead6,
        Self::ModuleRead7,
    ];

    /// What the master writes in cycles.
    pub const MODULE_WRITES: [Self; 8] = [
        Self::ModuleWrite0,
        Self::ModuleWrite1,
        Self::ModuleWrite2,
        Self::ModuleWrite3,
        Self::ModuleWrite4,
        Self::ModuleWrite5,
        Self::ModuleWrite6,
        Self::ModuleWrite7,
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_registers_of_groups_are_those_of_the_seven_sets() {
        let sets: [&[Role]; 7] = [
            &Role::POSITIONS,
            &Role::VELOCITIES,
            &Role::ACCELERATIONS,
            &Role::TORQUES,
            &Role::LOADS,
            &Role::WINDOWS,
            &Role::MODES,
        ];
        for role in Role::ALL.iter().copied() {
            assert_eq!(role.is_in_group(), sets.iter().any(|set| set.contains(&role)), "{role}");
        }
    }
}
