//! The bits of controlword and statusword (IEC 61800-7-201, sections on 0x6040 and 0x6041).

use bitflags::bitflags;

use super::State;

bitflags! {
    /// 0x6040.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct Controlword: u16 {
        /// Switch on.
        const SWITCH_ON = 1 << 0;
        /// Enable voltage.
        const ENABLE_VOLTAGE = 1 << 1;
        /// Quick stop; active when clear.
        const QUICK_STOP = 1 << 2;
        /// Enable operation.
        const ENABLE_OPERATION = 1 << 3;
        /// pp: a new set-point is there.
        const NEW_SET_POINT = 1 << 4;
        /// pp: do not wait for the end of the move under way.
        const CHANGE_IMMEDIATELY = 1 << 5;
        /// pp: the target is relative.
        const RELATIVE = 1 << 6;
        /// vl: the ramp leads the velocity.
        const ENABLE_RAMP = 1 << 4;
        /// vl: the output of the ramp follows its input.
        const UNLOCK_RAMP = 1 << 5;
        /// vl: the input of the ramp is the target.
        const REFERENCE_RAMP = 1 << 6;
        /// Fault reset, by its rising edge.
        const FAULT_RESET = 1 << 7;
        /// Halt.
        const HALT = 1 << 8;
        /// pp: begin where the target before is passed.
        const CHANGE_ON_SET_POINT = 1 << 9;
    }
}

impl Controlword {
    /// hm: start homing or go on with it.
    pub const HOMING_START: Self = Self::NEW_SET_POINT;
}

bitflags! {
    /// 0x6041.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct Statusword: u16 {
        /// Ready to switch on.
        const READY = 1 << 0;
        /// Switched on.
        const SWITCHED_ON = 1 << 1;
        /// Operation enabled.
        const ENABLED = 1 << 2;
        /// Fault.
        const FAULT = 1 << 3;
        /// High voltage is applied to the drive.
        const VOLTAGE = 1 << 4;
        /// Quick stop; active when clear.
        const QUICK_STOP = 1 << 5;
        /// Switch on disabled.
        const SWITCH_ON_DISABLED = 1 << 6;
        /// Warning.
        const WARNING = 1 << 7;
        /// The controlword is obeyed.
        const REMOTE = 1 << 9;
        /// Target reached, or standing still while halted.
        const TARGET_REACHED = 1 << 10;
        /// An internal limit changes the motion.
        const INTERNAL_LIMIT = 1 << 11;
        /// pp: set-point acknowledge; pv: speed is zero; hm: homing attained.
        const MODE_12 = 1 << 12;
        /// pp: following error; pv: slippage above its maximum; hm: homing error.
        const MODE_13 = 1 << 13;
    }
}

impl Statusword {
    /// The bits that tell the state.
    #[must_use]
    pub const fn of(state: State) -> Self {
        match state {
            State::NotReadyToSwitchOn => Self::empty(),
            State::SwitchOnDisabled => Self::SWITCH_ON_DISABLED,
            State::ReadyToSwitchOn => Self::READY.union(Self::QUICK_STOP),
            State::SwitchedOn => Self::READY.union(Self::SWITCHED_ON).union(Self::QUICK_STOP),
            State::OperationEnabled => {
                Self::READY.union(Self::SWITCHED_ON).union(Self::ENABLED).union(Self::QUICK_STOP)
            }
            State::QuickStopActive => Self::READY.union(Self::SWITCHED_ON).union(Self::ENABLED),
            State::FaultReactionActive => {
                Self::READY.union(Self::SWITCHED_ON).union(Self::ENABLED).union(Self::FAULT)
            }
            State::Fault => Self::FAULT,
        }
    }
}
