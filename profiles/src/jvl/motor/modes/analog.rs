//! What the analogue input does in the modes that are named after it.
//!
//! 10 V stand for the whole of V_SOLL or T_SOLL, negative voltages for the other direction.

use axis::{Torque, Velocity};

use crate::Role;
use crate::jvl::motor::Sample;
use crate::jvl::units::MacUnits;

/// Half the width of the dead band, as a share of the full scale: 0.5 V (our choice, no manual prints it).
const DEADBAND: f64 = 0.05;

/// What the input does to V_SOLL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Input {
    /// Nothing.
    Ignored,
    /// It multiplies.
    Whole,
    /// It multiplies outside a dead band.
    OutsideDeadband,
}

/// V_SOLL as the input makes it.
pub(super) fn velocity(input: Input, sample: &Sample<'_, '_>) -> Velocity {
    let share = MacUnits::share(sample.analog);
    let factor = match input {
        Input::Ignored => 1.0,
        Input::Whole => share,
        Input::OutsideDeadband => outside(share),
    };
    Velocity(factor * sample.velocity(Role::VSoll).0)
}

/// The torque that the input stands for.
pub(super) fn torque(sample: &Sample<'_, '_>) -> Torque {
    let most = MacUnits::torque(sample.register(Role::TSoll));
    Torque(MacUnits::share(sample.analog) * most.0)
}

/// `share` without the dead band: it begins at zero at its edge and reaches the full scale at its end.
fn outside(share: f64) -> f64 {
    let beyond = (share.abs() - DEADBAND).max(0.0) / (1.0 - DEADBAND);
    beyond.copysign(share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dead_band_is_left_without_a_jump() {
        assert_eq!([0.04, -0.05, 1.0, -1.0].map(outside).map(Torque), [0.0, 0.0, 1.0, -1.0].map(Torque));
        assert!((outside(0.06) - 0.010_526).abs() < 1e-6);
    }
}
