//! The option codes: how a drive leaves a motion, and what it does when it stands (IEC 61800-7-201, 0x605A-0x605E
//! and 0x6007).
//!
//! Every value of the standard is taken; the range of the entry refuses all others. "On the current limit" and "on
//! the voltage limit" are both the hardest ramp that the axis can do.

use axis::{Acceleration, Guard, Reaction};

use super::Context;
use crate::slots::Parameters;
use crate::{Binding, Dialect, jvl};

/// How hard an axis brakes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ramp {
    /// The deceleration of the mode, 0x6084.
    SlowDown,
    /// The quick stop deceleration, 0x6085.
    QuickStop,
    /// On the current limit or on the voltage limit.
    Hardest,
}

impl Ramp {
    /// Its rate; zero is the axis maximum.
    pub(crate) fn rate(self, context: &Context<'_>) -> Acceleration {
        match self {
            Self::SlowDown => context.slow_down_ramp(),
            Self::QuickStop => context.quick_stop_ramp(),
            Self::Hardest => Acceleration(0.0),
        }
    }
}

/// 0x605A.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct QuickStopOption {
    /// How to brake; `None` switches off at once.
    pub(crate) ramp: Option<Ramp>,
    /// Whether the drive stays in QUICK STOP ACTIVE.
    pub(crate) stays: bool,
}

impl QuickStopOption {
    /// As the object says; 2 where there is none.
    pub(crate) fn of(parameters: Parameters<'_>) -> Self {
        let code = parameters.or(Binding::QuickStopOption, 2);
        let ramp = match code {
            0 => None,
            1 | 5 => Some(Ramp::SlowDown),
            3 | 4 | 7 | 8 => Some(Ramp::Hardest),
            _ => Some(Ramp::QuickStop),
        };
        Self { ramp, stays: (5..=8).contains(&code) }
    }
}

/// The ramp before a shutdown from OPERATION ENABLED (0x605B), if there is one.
pub(crate) fn shutdown_ramp(parameters: Parameters<'_>) -> Option<Ramp> {
    (parameters.or(Binding::ShutdownOption, 0) == 1).then_some(Ramp::SlowDown)
}

/// The ramp before operation is disabled (0x605C), if there is one.
pub(crate) fn disable_operation_ramp(parameters: Parameters<'_>) -> Option<Ramp> {
    (parameters.or(Binding::DisableOperationOption, 1) == 1).then_some(Ramp::SlowDown)
}

/// The ramp of the halt bit (0x605D).
pub(crate) fn halt_ramp(parameters: Parameters<'_>) -> Ramp {
    match parameters.or(Binding::HaltOption, 1) {
        2 => Ramp::QuickStop,
        3 | 4 => Ramp::Hardest,
        _ => Ramp::SlowDown,
    }
}

/// The ramp of a fault that leaves the power stage alive (0x605E); `None` coasts. JVL's modules have the error action
/// of 0x2011:08 instead.
pub(crate) fn fault_ramp(parameters: Parameters<'_>, dialect: Dialect) -> Option<Ramp> {
    let assumed = match dialect {
        Dialect::Cia402 | Dialect::Mac4(_) => 2,
        Dialect::Jvl => i64::from(jvl::stops_on_error(parameters)),
    };
    match parameters.or(Binding::FaultReactionOption, assumed) {
        0 => None,
        1 => Some(Ramp::SlowDown),
        3 | 4 => Some(Ramp::Hardest),
        _ => Some(Ramp::QuickStop),
    }
}

/// Lets the axis react to its own faults, and to limit switches, as 0x605E says. Where that coasts, a limit switch
/// brakes with the quick stop ramp.
pub(crate) fn guard_axis(context: &mut Context<'_>) {
    let ramp = fault_ramp(context.parameters, context.dialect);
    let reaction = if ramp.is_some() { Reaction::Brake } else { Reaction::Coast };
    let guard = Guard {
        levels: match context.dialect {
            Dialect::Cia402 | Dialect::Mac4(_) => context.axis.guard().levels,
            Dialect::Jvl => jvl::levels(context.parameters),
        },
        emergency_deceleration: ramp.unwrap_or(Ramp::QuickStop).rate(context),
        following_error: reaction,
        drive_signal: reaction,
        supervision: reaction,
        ..*context.axis.guard()
    };
    if *context.axis.guard() != guard {
        context.axis.set_guard(guard);
    }
}

/// What a lost connection does (0x6007).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AbortConnection {
    /// Motion goes on.
    NoAction,
    /// It is a fault.
    Fault,
    /// The command disable voltage.
    DisableVoltage,
    /// The command quick stop.
    QuickStop,
}

impl AbortConnection {
    /// As the object says; a drive without it stops, too.
    pub(crate) fn of(parameters: Parameters<'_>) -> Self {
        match parameters.or(Binding::AbortConnectionOption, 3) {
            0 => Self::NoAction,
            1 => Self::Fault,
            2 => Self::DisableVoltage,
            _ => Self::QuickStop,
        }
    }
}
