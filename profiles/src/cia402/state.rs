//! The drive state machine (IEC 61800-7-201, figure of the power drive system FSA), transitions by number.

use super::Controlword;

/// The eight states.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// The drive starts up.
    #[default]
    NotReadyToSwitchOn,
    /// Parameters may be set, power may not be switched on.
    SwitchOnDisabled,
    /// Power may be switched on.
    ReadyToSwitchOn,
    /// Power is there, the drive function is off.
    SwitchedOn,
    /// The drive follows its mode.
    OperationEnabled,
    /// A quick stop is under way or done.
    QuickStopActive,
    /// A fault is being reacted to.
    FaultReactionActive,
    /// A fault; the drive function is off.
    Fault,
}

/// What the controlword asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// xxx0 or, as far as voltage is concerned, no power.
    DisableVoltage,
    /// x01x
    QuickStop,
    /// x110
    Shutdown,
    /// 0111: switch on, or disable operation where it is enabled.
    SwitchOn,
    /// 1111
    EnableOperation,
}

impl Command {
    /// The command in the low bits of a controlword.
    #[must_use]
    pub fn decode(word: Controlword) -> Self {
        if !word.contains(Controlword::ENABLE_VOLTAGE) {
            Self::DisableVoltage
        } else if !word.contains(Controlword::QUICK_STOP) {
            Self::QuickStop
        } else if !word.contains(Controlword::SWITCH_ON) {
            Self::Shutdown
        } else if word.contains(Controlword::ENABLE_OPERATION) {
            Self::EnableOperation
        } else {
            Self::SwitchOn
        }
    }
}

/// The transitions; the discriminant is the standard's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Transition {
    /// Power-on: the drive starts up.
    Start = 0,
    /// The drive is up.
    Initialised = 1,
    /// SWITCH ON DISABLED to READY TO SWITCH ON.
    Shutdown = 2,
    /// READY TO SWITCH ON to SWITCHED ON.
    SwitchOn = 3,
    /// SWITCHED ON to OPERATION ENABLED.
    EnableOperation = 4,
    /// OPERATION ENABLED to SWITCHED ON.
    DisableOperation = 5,
    /// SWITCHED ON to READY TO SWITCH ON.
    ShutdownSwitchedOn = 6,
    /// READY TO SWITCH ON to SWITCH ON DISABLED.
    DisableVoltageReady = 7,
    /// OPERATION ENABLED to READY TO SWITCH ON.
    ShutdownEnabled = 8,
    /// OPERATION ENABLED to SWITCH ON DISABLED.
    DisableVoltageEnabled = 9,
    /// SWITCHED ON to SWITCH ON DISABLED.
    DisableVoltageSwitchedOn = 10,
    /// OPERATION ENABLED to QUICK STOP ACTIVE.
    QuickStop = 11,
    /// QUICK STOP ACTIVE to SWITCH ON DISABLED.
    QuickStopDone = 12,
    /// A fault, from any state.
    FaultOccurred = 13,
    /// The reaction to the fault is done.
    FaultReacted = 14,
    /// FAULT to SWITCH ON DISABLED.
    FaultReset = 15,
    /// QUICK STOP ACTIVE to OPERATION ENABLED.
    Resume = 16,
}

impl Transition {
    /// The state it leads to.
    #[must_use]
    pub const fn target(self) -> State {
        match self {
            Self::Start => State::NotReadyToSwitchOn,
            Self::Initialised
            | Self::DisableVoltageReady
            | Self::DisableVoltageEnabled
            | Self::DisableVoltageSwitchedOn
            | Self::QuickStopDone
            | Self::FaultReset => State::SwitchOnDisabled,
            Self::Shutdown | Self::ShutdownSwitchedOn | Self::ShutdownEnabled => State::ReadyToSwitchOn,
            Self::SwitchOn | Self::DisableOperation => State::SwitchedOn,
            Self::EnableOperation | Self::Resume => State::OperationEnabled,
            Self::QuickStop => State::QuickStopActive,
            Self::FaultOccurred => State::FaultReactionActive,
            Self::FaultReacted => State::Fault,
        }
    }
}

impl State {
    /// The standard's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotReadyToSwitchOn => "NOT READY TO SWITCH ON",
            Self::SwitchOnDisabled => "SWITCH ON DISABLED",
            Self::ReadyToSwitchOn => "READY TO SWITCH ON",
            Self::SwitchedOn => "SWITCHED ON",
            Self::OperationEnabled => "OPERATION ENABLED",
            Self::QuickStopActive => "QUICK STOP ACTIVE",
            Self::FaultReactionActive => "FAULT REACTION ACTIVE",
            Self::Fault => "FAULT",
        }
    }

    /// The transition that `command` triggers in this state, if any.
    #[must_use]
    pub const fn on(self, command: Command) -> Option<Transition> {
        use Command::{DisableVoltage, EnableOperation, QuickStop, Shutdown, SwitchOn};
        match (self, command) {
            (Self::SwitchOnDisabled, Shutdown) => Some(Transition::Shutdown),
            (Self::ReadyToSwitchOn, SwitchOn | EnableOperation) => Some(Transition::SwitchOn),
            (Self::ReadyToSwitchOn, DisableVoltage | QuickStop) => Some(Transition::DisableVoltageReady),
            (Self::SwitchedOn, EnableOperation) => Some(Transition::EnableOperation),
            (Self::SwitchedOn, Shutdown) => Some(Transition::ShutdownSwitchedOn),
            (Self::SwitchedOn, DisableVoltage | QuickStop) => Some(Transition::DisableVoltageSwitchedOn),
            (Self::OperationEnabled, SwitchOn) => Some(Transition::DisableOperation),
            (Self::OperationEnabled, Shutdown) => Some(Transition::ShutdownEnabled),
            (Self::OperationEnabled, DisableVoltage) => Some(Transition::DisableVoltageEnabled),
            (Self::OperationEnabled, QuickStop) => Some(Transition::QuickStop),
            (Self::QuickStopActive, DisableVoltage) => Some(Transition::QuickStopDone),
            (Self::QuickStopActive, EnableOperation) => Some(Transition::Resume),
            (Self::SwitchOnDisabled, DisableVoltage | QuickStop | SwitchOn | EnableOperation)
            | (Self::ReadyToSwitchOn, Shutdown)
            | (Self::SwitchedOn, SwitchOn)
            | (Self::OperationEnabled, EnableOperation)
            | (Self::QuickStopActive, QuickStop | Shutdown | SwitchOn)
            | (Self::NotReadyToSwitchOn | Self::FaultReactionActive | Self::Fault, _) => None,
        }
    }
}
