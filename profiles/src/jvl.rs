//! What JVL's modules show beside the CiA 402 objects (module manual, sections 4.3.5 and 4.3.7).

use axis::{Motion, Status, Switches};
use bitflags::bitflags;

use crate::{State, Statusword};

bitflags! {
    /// 0x2011:03.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(crate) struct MotorStatus: u8 {
        /// A fatal motor error.
        const MOTOR_ERROR = 1 << 0;
        /// The motor is in the commanded position.
        const IN_POSITION = 1 << 4;
        /// The velocity is increasing.
        const ACCELERATION = 1 << 5;
        /// The velocity is decreasing.
        const DECELERATION = 1 << 6;
    }
}

/// 0x2011:03 from the drive's state and motion.
pub(crate) fn motor_status(state: State, statusword: Statusword, axis: &Status) -> MotorStatus {
    let mut bits = MotorStatus::empty();
    bits.set(MotorStatus::MOTOR_ERROR, state == State::Fault);
    bits.set(MotorStatus::IN_POSITION, statusword.contains(Statusword::TARGET_REACHED));
    bits.set(MotorStatus::ACCELERATION, axis.motion == Motion::Accelerating);
    bits.set(MotorStatus::DECELERATION, axis.motion == Motion::Decelerating);
    bits
}

/// 0x2011:01: IN1-IN4 in bits 0-3, NL in bit 4, PL in bit 5.
pub(crate) fn inputs(switches: Switches) -> u8 {
    u8::from(switches.negative_limit) << 4 | u8::from(switches.positive_limit) << 5
}
