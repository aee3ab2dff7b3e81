//! The modes of operation (IEC 61800-7-201, 0x6060): each in its file, all behind the same verbs.
//!
//! The drive calls [`Active::begin`] when it comes to OPERATION ENABLED or changes the mode there, and then, as
//! long as it is there: [`Active::update`] when objects were written, [`Active::control`] when the controlword was,
//! [`Active::step`] after each raster step, [`Active::halt`] and [`Active::resume`] with the halt bit. The axis
//! stands, or ramps down from the mode before, when a mode begins. [`Active::suspend`] comes when the axis ramps down to
//! leave the mode: until the next begin, no set-point counts.

mod cyclic;
mod cyclic_position;
mod cyclic_torque;
mod cyclic_velocity;
mod homing;
mod interpolated;
mod profile_position;
mod profile_torque;
mod profile_velocity;
mod velocity;

use super::{Context, Controlword, SetPoints, View};
use crate::Dialect;

use cyclic_position::CyclicPosition;
use cyclic_torque::CyclicTorque;
use cyclic_velocity::CyclicVelocity;
use homing::Homing;
pub(crate) use homing::is_method as is_homing_method;
use interpolated::Interpolated;
use profile_position::ProfilePosition;
use profile_torque::ProfileTorque;
use profile_velocity::ProfileVelocity;
pub(super) use velocity::{deceleration as vl_deceleration, quick_stop as vl_quick_stop};

use velocity::VelocityMode;

/// Modes of operation, by their number in 0x6060.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(i8)]
pub enum Mode {
    /// None chosen: the axis holds.
    #[default]
    None = 0,
    /// pp
    ProfilePosition = 1,
    /// vl
    Velocity = 2,
    /// pv
    ProfileVelocity = 3,
    /// tq
    ProfileTorque = 4,
    /// hm
    Homing = 6,
    /// ip
    Interpolated = 7,
    /// csp
    CyclicPosition = 8,
    /// csv
    CyclicVelocity = 9,
    /// cst
    CyclicTorque = 10,
}

impl Mode {
    /// Every mode.
    pub const ALL: [Self; 10] = [
        Self::None,
        Self::ProfilePosition,
        Self::Velocity,
        Self::ProfileVelocity,
        Self::ProfileTorque,
        Self::Homing,
        Self::Interpolated,
        Self::CyclicPosition,
        Self::CyclicVelocity,
        Self::CyclicTorque,
    ];

    /// The standard's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "no mode",
            Self::ProfilePosition => "profile position",
            Self::Velocity => "velocity",
            Self::ProfileVelocity => "profile velocity",
            Self::ProfileTorque => "profile torque",
            Self::Homing => "homing",
            Self::Interpolated => "interpolated position",
            Self::CyclicPosition => "cyclic synchronous position",
            Self::CyclicVelocity => "cyclic synchronous velocity",
            Self::CyclicTorque => "cyclic synchronous torque",
        }
    }

    /// The mode with number `code`, if this version has it.
    #[must_use]
    pub fn from_code(code: i64) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| *mode as i64 == code)
    }

    /// Whether statusword bit 13 is the following error.
    #[must_use]
    pub(crate) const fn tells_following_error(self) -> bool {
        matches!(self, Self::ProfilePosition | Self::CyclicPosition)
    }

    /// Whether drives of this dialect have the mode. JVL's modules have position, velocity and homing (module manual,
    /// section 4.3.19).
    #[must_use]
    pub fn is_in(self, dialect: Dialect) -> bool {
        match dialect {
            Dialect::Cia402 => true,
            // Neither the amplifier nor the pulses take a torque.
            Dialect::Mac4(_) => !matches!(self, Self::ProfileTorque | Self::CyclicTorque),
            Dialect::Jvl => {
                matches!(self, Self::None | Self::ProfilePosition | Self::ProfileVelocity | Self::Homing)
            }
        }
    }
}

/// What a mode says in the statusword.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ModeBits {
    /// Bit 10.
    pub(crate) is_reached: bool,
    /// Bit 12.
    pub(crate) bit_12: bool,
    /// Bit 13.
    pub(crate) bit_13: bool,
}

/// The mode in effect, with what it has to remember.
#[derive(Debug, Default)]
pub(crate) enum Active {
    /// The axis holds.
    #[default]
    None,
    ProfilePosition(ProfilePosition),
    Velocity(VelocityMode),
    ProfileVelocity(ProfileVelocity),
    ProfileTorque(ProfileTorque),
    Homing(Homing),
    Interpolated(Interpolated),
    CyclicPosition(CyclicPosition),
    CyclicVelocity(CyclicVelocity),
    CyclicTorque(CyclicTorque),
}

/// Calls the verb of the mode in effect.
macro_rules! of_mode {
    ($self:ident, $none:expr, $mode:ident => $call:expr) => {
        match $self {
            Self::None => $none,
            Self::ProfilePosition($mode) => $call,
            Self::Velocity($mode) => $call,
            Self::ProfileVelocity($mode) => $call,
            Self::ProfileTorque($mode) => $call,
            Self::Homing($mode) => $call,
            Self::Interpolated($mode) => $call,
            Self::CyclicPosition($mode) => $call,
            Self::CyclicVelocity($mode) => $call,
            Self::CyclicTorque($mode) => $call,
        }
    };
}

impl Active {
    /// The mode, with nothing to remember.
    pub(crate) fn new(mode: Mode) -> Self {
        match mode {
            Mode::None => Self::None,
            Mode::ProfilePosition => Self::ProfilePosition(ProfilePosition::default()),
            Mode::Velocity => Self::Velocity(VelocityMode::default()),
            Mode::ProfileVelocity => Self::ProfileVelocity(ProfileVelocity::default()),
            Mode::ProfileTorque => Self::ProfileTorque(ProfileTorque::default()),
            Mode::Homing => Self::Homing(Homing::default()),
            Mode::Interpolated => Self::Interpolated(Interpolated::default()),
            Mode::CyclicPosition => Self::CyclicPosition(CyclicPosition::default()),
            Mode::CyclicVelocity => Self::CyclicVelocity(CyclicVelocity::default()),
            Mode::CyclicTorque => Self::CyclicTorque(CyclicTorque::default()),
        }
    }

    /// Which mode it is.
    pub(crate) fn mode(&self) -> Mode {
        match self {
            Self::None => Mode::None,
            Self::ProfilePosition(_) => Mode::ProfilePosition,
            Self::Velocity(_) => Mode::Velocity,
            Self::ProfileVelocity(_) => Mode::ProfileVelocity,
            Self::ProfileTorque(_) => Mode::ProfileTorque,
            Self::Homing(_) => Mode::Homing,
            Self::Interpolated(_) => Mode::Interpolated,
            Self::CyclicPosition(_) => Mode::CyclicPosition,
            Self::CyclicVelocity(_) => Mode::CyclicVelocity,
            Self::CyclicTorque(_) => Mode::CyclicTorque,
        }
    }

    /// Whether it is homing, and that is completed.
    pub(crate) fn is_homed(&self) -> bool {
        matches!(self, Self::Homing(homing) if homing.is_completed())
    }

    /// Begins anew, with the controlword as it is.
    pub(crate) fn begin(&mut self, word: Controlword, context: &mut Context<'_>) {
        *self = Self::new(self.mode());
        of_mode!(self, (), mode => mode.begin(word, context));
    }

    /// Acts on objects that were written, the controlword aside.
    pub(crate) fn update(&mut self, word: Controlword, context: &mut Context<'_>) {
        of_mode!(self, (), mode => mode.update(word, context));
    }

    /// Acts on the controlword, which was written.
    pub(crate) fn control(&mut self, old: Controlword, new: Controlword, context: &mut Context<'_>) {
        of_mode!(self, (), mode => mode.control(old, new, context));
    }

    /// The axis ramps down to leave the mode.
    pub(crate) fn suspend(&mut self) {
        match self {
            Self::CyclicPosition(mode) => mode.suspend(),
            Self::CyclicVelocity(mode) => mode.suspend(),
            Self::CyclicTorque(mode) => mode.suspend(),
            Self::Interpolated(mode) => mode.suspend(),
            Self::ProfileTorque(mode) => mode.suspend(),
            Self::None
            | Self::ProfilePosition(_)
            | Self::Velocity(_)
            | Self::ProfileVelocity(_)
            | Self::Homing(_) => {}
        }
    }

    /// The set-points that it takes cycle by cycle.
    pub(crate) fn cyclic(&self) -> SetPoints {
        match self.mode() {
            Mode::CyclicPosition => SetPoints::POSITION,
            Mode::CyclicVelocity => SetPoints::VELOCITY,
            Mode::CyclicTorque => SetPoints::TORQUE,
            Mode::Interpolated => SetPoints::RECORD,
            Mode::None
            | Mode::ProfilePosition
            | Mode::Velocity
            | Mode::ProfileVelocity
            | Mode::ProfileTorque
            | Mode::Homing => SetPoints::empty(),
        }
    }

    /// Records that wait to be interpolated to.
    pub(crate) fn waiting_records(&self) -> usize {
        match self {
            Self::Interpolated(mode) => mode.waiting(),
            Self::None
            | Self::ProfilePosition(_)
            | Self::Velocity(_)
            | Self::ProfileVelocity(_)
            | Self::ProfileTorque(_)
            | Self::Homing(_)
            | Self::CyclicPosition(_)
            | Self::CyclicVelocity(_)
            | Self::CyclicTorque(_) => 0,
        }
    }

    /// The halt bit was set: the axis has been told to stop.
    pub(crate) fn halt(&mut self, context: &mut Context<'_>) {
        of_mode!(self, (), mode => mode.halt(context));
    }

    /// The halt bit was taken back.
    pub(crate) fn resume(&mut self, word: Controlword, context: &mut Context<'_>) {
        of_mode!(self, (), mode => mode.resume(word, context));
    }

    /// Follows the axis after a raster step.
    pub(crate) fn step(&mut self, word: Controlword, context: &mut Context<'_>) {
        of_mode!(self, (), mode => mode.step(word, context));
    }

    /// Whether the drive takes the new-set-point bit back by itself now.
    pub(crate) fn takes_set_point_back(&mut self, context: &Context<'_>) -> bool {
        if let Self::ProfilePosition(mode) = self { mode.takes_bit_back(context) } else { false }
    }

    /// What it says in the statusword.
    pub(crate) fn bits(&self, view: View<'_>) -> ModeBits {
        of_mode!(self, ModeBits::default(), mode => mode.bits(view))
    }
}
