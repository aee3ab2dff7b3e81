//! The modes that have power, a group of them in each file, all behind the same verbs.
//!
//! The motor calls [`Active::demand`] once the axis has power and then in each sample and whenever something was
//! written, and orders what is demanded if that has changed. So every register acts at once.

mod analog;
mod gear;
mod position;
mod search;
mod steady;

use axis::{Acceleration, Order, Position, Profile, Torque, Velocity};
use core::num::NonZeroU32;

use super::Sample;
use super::mode::Mode;

use analog::Input;
pub(super) use gear::ratio as gear_ratio;
use gear::{Coupling, Gear};
use position::{Goal, Positioning};
pub(super) use search::Outcome;
use search::{Kind, Search};
use steady::Steady;

/// What the axis is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Demand {
    /// Be there.
    Place(Position, Profile),
    /// Run like that.
    Speed(Velocity, Profile),
    /// Have this velocity from the next raster step on.
    Follow(Velocity),
    /// Give this torque.
    Torque(Torque),
    /// Come to rest and hold.
    Rest(Acceleration),
    /// Do as an order says that was given.
    Ordered,
}

impl Demand {
    /// The order that does it, if there is one to give.
    pub(super) fn order(self) -> Option<Order> {
        Some(match self {
            Self::Place(place, profile) => Order::MoveTo(place, profile),
            Self::Speed(velocity, profile) => Order::RunAt(velocity, profile),
            Self::Follow(target) => Order::TrackVelocity { target, over: NonZeroU32::MIN },
            Self::Torque(torque) => Order::Push { torque, slope: Torque(0.0) },
            Self::Rest(deceleration) => Order::Stop(deceleration),
            Self::Ordered => return None,
        })
    }
}

/// How far the motor is from where it should be, to tell whether it is in position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Distance {
    /// In a position mode.
    Way(Position),
    /// In a velocity mode.
    Speed(Velocity),
    /// The mode has no goal.
    None,
}

/// The mode with power, with what it has to remember.
#[derive(Debug)]
pub(super) enum Active {
    Steady(Steady),
    Position(Positioning),
    Gear(Gear),
    Search(Search),
}

impl Active {
    /// To rest as in an emergency.
    pub(super) const REST: Self = Self::Steady(Steady::Brake);

    /// `mode` from the start; `None` if it has no power. The tests of the factory set currents that a simulation does not
    /// have: they are shown, and the axis is free.
    pub(super) fn new(mode: Mode, sample: &Sample<'_, '_>) -> Option<Self> {
        let position = |kind| Self::Position(Positioning::new(kind, sample));
        let gear = |kind| Self::Gear(Gear::new(kind, sample));
        let search = |kind| Self::Search(Search::new(kind));
        Some(match mode {
            Mode::Velocity => Self::Steady(Steady::Velocity(Input::Ignored)),
            Mode::AnalogVelocity => Self::Steady(Steady::Velocity(Input::Whole)),
            Mode::AnalogVelocityDeadband => Self::Steady(Steady::Velocity(Input::OutsideDeadband)),
            Mode::AnalogTorque => Self::Steady(Steady::Torque { is_limited: false }),
            Mode::LimitedAnalogTorque => Self::Steady(Steady::Torque { is_limited: true }),
            Mode::Brake => Self::Steady(Steady::Brake),
            Mode::Stop => Self::Steady(Steady::Stop),
            Mode::Position => position(Goal::Target),
            Mode::AnalogBiPosition => position(Goal::OneOfTwo),
            Mode::AnalogPosition => position(Goal::Share),
            Mode::GearPosition => gear(Coupling::Fixed),
            Mode::AnalogVelocityGear => gear(Coupling::WithVelocity),
            Mode::AnalogGear => gear(Coupling::Variable),
            Mode::GearFollow => gear(Coupling::VelocityOnly),
            Mode::TorqueSearch => search(Kind::Torque),
            Mode::ForwardSearch => search(Kind::Forward),
            Mode::TwoWaySearch => search(Kind::TwoWay),
            Mode::IndexSearch => search(Kind::Index),
            Mode::Passive
            | Mode::ManualCurrent
            | Mode::StepResponse
            | Mode::InternalTest
            | Mode::Safe
            | Mode::Coil
            | Mode::InternalTest2
            | Mode::InternalTest3 => return None,
        })
    }

    /// Which mode it is.
    pub(super) fn mode(&self) -> Mode {
        match self {
            Self::Steady(mode) => mode.mode(),
            Self::Position(mode) => mode.mode(),
            Self::Gear(mode) => mode.mode(),
            Self::Search(mode) => mode.mode(),
        }
    }

    /// Notices what has changed since the last sample: the external encoder, the analogue input.
    pub(super) fn step(&mut self, sample: &mut Sample<'_, '_>) {
        match self {
            Self::Steady(_) | Self::Search(_) => {}
            Self::Position(mode) => mode.step(sample),
            Self::Gear(mode) => mode.step(sample),
        }
    }

    /// What the axis is to do now.
    pub(super) fn demand(&mut self, sample: &mut Sample<'_, '_>) -> Demand {
        match self {
            Self::Steady(mode) => mode.demand(sample),
            Self::Position(mode) => mode.demand(sample),
            Self::Gear(mode) => mode.demand(sample),
            Self::Search(mode) => mode.demand(sample),
        }
    }

    /// P_SOLL was written.
    pub(super) fn retarget(&mut self, sample: &Sample<'_, '_>) {
        if let Self::Position(mode) = self {
            mode.retarget(sample);
        }
    }

    /// The target lies farther on by `distance`, P_SOLL stays.
    pub(super) fn extend(&mut self, distance: i32) {
        if let Self::Position(mode) = self {
            mode.extend(distance);
        }
    }

    /// All positions are larger by `distance`.
    pub(super) fn shift(&mut self, distance: Position) {
        match self {
            Self::Steady(_) | Self::Position(_) | Self::Search(_) => {}
            Self::Gear(mode) => mode.shift(distance),
        }
    }

    /// What has become of the zero search, if it is one.
    pub(super) fn outcome(&self) -> Option<Outcome> {
        match self {
            Self::Search(mode) => mode.outcome(),
            Self::Steady(_) | Self::Position(_) | Self::Gear(_) => None,
        }
    }

    /// How far the motor is from its goal.
    pub(super) fn distance(&self, sample: &Sample<'_, '_>) -> Distance {
        let actual = sample.axis().status().actual;
        match self {
            Self::Position(mode) => Distance::Way(mode.target() - actual.position),
            Self::Gear(mode) => Distance::Way(mode.ideal() - actual.position),
            Self::Search(_) => Distance::None,
            Self::Steady(Steady::Velocity(input)) => {
                Distance::Speed(analog::velocity(*input, sample) - actual.velocity)
            }
            Self::Steady(Steady::Torque { .. } | Steady::Brake | Steady::Stop) => Distance::None,
        }
    }

    /// How far the motor is behind its ideal motion (FNCERR).
    pub(super) fn lag(&self, sample: &Sample<'_, '_>) -> Position {
        let status = sample.axis().status();
        match self {
            Self::Gear(mode) => mode.ideal() - status.actual.position,
            Self::Steady(_) | Self::Position(_) | Self::Search(_) => status.following_error,
        }
    }
}
