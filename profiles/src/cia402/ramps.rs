//! The profile of a motion, from its objects (IEC 61800-7-201, sections on 0x6083 to 0x6086, 0x60A3 and 0x60A4).

use axis::{Acceleration, Jerk, Profile, Velocity};

use crate::Binding;
use crate::slots::Parameters;

/// Motion profile types, by their number in 0x6086.
pub(crate) const LINEAR: i64 = 0;
pub(crate) const JERK_LIMITED: i64 = 3;

/// The profile of a motion at `velocity`. Without 0x6084 the deceleration equals the acceleration.
pub(crate) fn profile(parameters: Parameters<'_>, velocity: Velocity) -> Profile {
    let acceleration = parameters.or(Binding::ProfileAcceleration, 0);
    let ramp = |value| -> Acceleration { parameters.units.acceleration(value) };
    Profile {
        velocity,
        acceleration: ramp(acceleration),
        deceleration: ramp(parameters.or(Binding::ProfileDeceleration, acceleration)),
        jerk: jerk(parameters),
    }
}

/// The jerk of a jerk-limited profile: the smallest of those in use, as an axis has one for all corners.
fn jerk(parameters: Parameters<'_>) -> Option<Jerk> {
    const JERKS: [Binding; 4] =
        [Binding::ProfileJerk1, Binding::ProfileJerk2, Binding::ProfileJerk3, Binding::ProfileJerk4];
    if parameters.or(Binding::MotionProfileType, LINEAR) != JERK_LIMITED {
        return None;
    }
    let used = usize::try_from(parameters.or(Binding::ProfileJerkUse, 1)).unwrap_or(1);
    let jerks = JERKS.into_iter().take(used).filter_map(|binding| parameters.get(binding));
    jerks.filter(|jerk| *jerk > 0).min().map(|jerk| parameters.units.jerk(jerk))
}
