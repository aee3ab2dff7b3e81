//! Fault codes and what stands for them in the status words (section 6.3).

use super::status::{OverallStatus, UserStatus};

/// What a response bears instead of the instruction code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum FaultCode {
    /// 6.3.1: there is no such axis.
    FalseAxis = 160,
    /// 6.3.2: there is no such instruction.
    Syntax = 161,
    /// 6.3.3: a value outside of its limits.
    LimitValue = 162,
    /// 6.3.4 and 6.3.7-6.3.9: drive fault, logical error, position measurement, following error.
    Logical = 163,
    /// 6.3.6: the watchdog has acted.
    Watchdog = 164,
    /// 6.3.5: the emergency stop.
    EmergencyStop = 165,
}

impl FaultCode {
    /// The code with which an instruction is answered while these errors are not acknowledged; `None` without any.
    pub(super) fn pending(user: UserStatus, overall: OverallStatus) -> Option<Self> {
        if overall.contains(OverallStatus::H_STOP) {
            Some(Self::EmergencyStop)
        } else if overall.contains(OverallStatus::WATCH_F) {
            Some(Self::Watchdog)
        } else if overall.contains(OverallStatus::AXIS_F) {
            Some(Self::FalseAxis)
        } else {
            user.intersects(UserStatus::ERRORS).then_some(Self::Logical)
        }
    }

    /// Whether its response shows the overall status instead of the user status.
    pub(super) fn concerns_all(self) -> bool {
        match self {
            Self::FalseAxis | Self::Watchdog | Self::EmergencyStop => true,
            Self::Syntax | Self::LimitValue | Self::Logical => false,
        }
    }
}

/// The bits of the user status that stand for a fault of the axis; none for one that the overall status shows.
pub(super) fn user_bits(fault: axis::Fault) -> UserStatus {
    match fault {
        axis::Fault::FollowingError => UserStatus::FERR_F,
        axis::Fault::Drive(axis::DriveFault::Encoder) => UserStatus::ENCODER_F | UserStatus::LOGO_F,
        axis::Fault::Drive(_) | axis::Fault::Lost | axis::Fault::DriveSignal => UserStatus::DR_F,
        axis::Fault::EmergencyStop | axis::Fault::Supervision => UserStatus::empty(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_concerns_all_axes_is_told_first() {
        let code = |user, overall| FaultCode::pending(user, overall).map(|code| code as u8);
        let none = OverallStatus::empty();
        assert_eq!(code(UserStatus::HWL_P, OverallStatus::SERV_EN), None);
        for error in UserStatus::ERRORS.iter() {
            assert_eq!(code(error, none), Some(163));
        }
        assert_eq!(code(UserStatus::DR_F, OverallStatus::AXIS_F), Some(160));
        assert_eq!(code(UserStatus::DR_F, OverallStatus::WATCH_F), Some(164));
        assert_eq!(code(UserStatus::DR_F, OverallStatus::all()), Some(165));
    }
}
