//! What E makes of the chosen mode: a job with the parameters as they are then.

use core::num::NonZeroU32;

use axis::{Order, Position, Profile, Switch, Velocity};
use od::Dictionary;

use super::units::{CYCLE, Units};
use super::{Instruction, Mode};
use crate::mac4::record::Record;

/// A mode with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Job {
    pub(super) mode: Mode,
    /// Velocity and ramps.
    pub(super) profile: Profile,
    /// The velocity with its direction.
    pub(super) velocity: Velocity,
    /// `<ap>`.
    pub(super) target: Position,
    /// `<lv>`.
    pub(super) slow: Velocity,
    /// `<dl>`.
    pub(super) switch: Switch,
}

/// The generator sampling period in raster steps.
const PERIOD: NonZeroU32 = match NonZeroU32::new(CYCLE) {
    Some(cycle) => cycle,
    None => NonZeroU32::MIN,
};

impl Job {
    /// The job of a mode, by the parameters of an axis.
    pub(super) fn new(mode: Mode, record: &Record, dictionary: &Dictionary, units: Units) -> Self {
        let get = |instruction| record.get(dictionary, instruction);
        let velocity = |[_, velocity, _]: [Instruction; 3]| units.velocity(get(velocity));
        let profile = |parameters @ [acceleration, _, deceleration]: [Instruction; 3]| Profile {
            velocity: velocity(parameters).abs(),
            acceleration: units.ramp(get(acceleration)),
            deceleration: units.ramp(get(deceleration)),
            jerk: None,
        };
        let parameters = parameters(mode);
        Self {
            mode,
            profile: parameters.map(profile).unwrap_or_default(),
            velocity: parameters.map(velocity).unwrap_or_default(),
            target: Units::position(get(Instruction::WAP)),
            slow: units.velocity(get(Instruction::WLV)).abs(),
            switch: match get(Instruction::WDL) {
                1 => Switch::NegativeLimit,
                2 => Switch::PositiveLimit,
                _ => Switch::Home,
            },
        }
    }
}

/// Acceleration, velocity and braking ramp of a mode that has them.
fn parameters(mode: Mode) -> Option<[Instruction; 3]> {
    match mode {
        Mode::Positioning => Some([Instruction::WPA, Instruction::WPV, Instruction::WPD]),
        Mode::SearchIndexCoarse => Some([Instruction::WCA, Instruction::WCV, Instruction::WCD]),
        Mode::SearchIndex => Some([Instruction::WIA, Instruction::WIV, Instruction::WID]),
        Mode::Home => Some([Instruction::WHA, Instruction::WHV, Instruction::WHD]),
        Mode::FindEdge => Some([Instruction::WFA, Instruction::WFV, Instruction::WFD]),
        Mode::Speed => Some([Instruction::WSA, Instruction::WSV, Instruction::WSD]),
        Mode::Disable
        | Mode::Enable
        | Mode::Brake
        | Mode::VelocityTracking
        | Mode::Test
        | Mode::PositionTracking
        | Mode::Reset => None,
    }
}

/// Follow a velocity of the host: it holds from the next generator sampling period on (section 5.11). In TURBO
/// operation it counts ten times (section 4.1.3).
pub(super) fn track_velocity(velocity: i64, units: Units, turbo: bool) -> Order {
    const TURBO: i64 = 10;
    let velocity = if turbo { velocity.saturating_mul(TURBO) } else { velocity };
    Order::TrackVelocity { target: units.velocity(velocity), over: PERIOD }
}

/// Be at a position of the host within the next generator sampling period (section 5.12).
pub(super) fn track_position(position: i64) -> Order {
    Order::TrackPosition { target: Units::position(position), over: PERIOD }
}
