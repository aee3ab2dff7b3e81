//! The modes of a MIS stepper that have power.

use core::num::NonZeroU32;

use axis::{Acceleration, Base, Order, Position, Profile, Velocity};

use super::Sample;
use super::counters::Counters;
use super::mode::Mode;
use super::sample::Turning;
use super::search::Search;
use crate::Role;
use crate::jvl::follower::Follower;

/// The mode with power, with what it has to remember.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Active {
    Velocity,
    Position(Positioning),
    Gear(Gear),
    Search(Search),
    /// Braking, and then holding or passive.
    Rest {
        ends_passive: bool,
    },
}

/// What the axis is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wanted {
    /// Be there.
    Place(Position, Profile),
    /// Turn the table to this number.
    Turn(i32, Turning, Profile),
    /// Run like that.
    Speed(Velocity, Profile),
    /// Have this velocity from the next raster step on.
    Follow(Velocity),
    /// Come to rest and hold.
    Rest(Acceleration),
}

impl Wanted {
    /// The order that does it.
    pub(super) fn order(self, sample: &Sample<'_, '_>) -> Order {
        match self {
            Self::Place(place, profile) => Order::MoveTo(place, profile),
            Self::Turn(value, turning, profile) => {
                Order::MoveBy { distance: way(value, turning, sample), from: Base::Demand, profile }
            }
            Self::Speed(velocity, profile) => Order::RunAt(velocity, profile),
            Self::Follow(target) => Order::TrackVelocity { target, over: NonZeroU32::MIN },
            Self::Rest(deceleration) => Order::Stop(deceleration),
        }
    }
}

/// The way of a turn table to the number `value`.
fn way(value: i32, turning: Turning, sample: &Sample<'_, '_>) -> Position {
    let Some((turn, _)) = sample.turn_table() else { return Position(0.0) };
    let length = turn.length().0;
    let from = sample.units.way(sample.demand()).0.rem_euclid(length);
    let ahead = (f64::from(value).rem_euclid(length) - from).rem_euclid(length);
    let is_there = ahead == 0.0;
    let goes_back = match turning {
        Turning::Positive => false,
        Turning::Negative => !is_there,
        Turning::Shortest => ahead + ahead > length,
    };
    sample.units.way(Position(if goes_back { ahead - length } else { ahead }))
}

impl Active {
    /// `mode` from the start, if it has power.
    pub(super) fn new(mode: Mode) -> Option<Self> {
        Some(match mode {
            Mode::Passive => return None,
            Mode::Velocity => Self::Velocity,
            Mode::Position => Self::Position(Positioning::default()),
            Mode::Gear => Self::Gear(Gear::default()),
            Mode::ForwardSearch | Mode::TwoWaySearch => Self::Search(Search::new(mode)),
        })
    }

    /// Which mode it is; none while the motor only brakes.
    pub(super) fn mode(&self) -> Option<Mode> {
        match self {
            Self::Velocity => Some(Mode::Velocity),
            Self::Position(_) => Some(Mode::Position),
            Self::Gear(_) => Some(Mode::Gear),
            Self::Search(search) => Some(search.mode()),
            Self::Rest { .. } => None,
        }
    }

    pub(super) fn is_search(&self) -> bool {
        matches!(self, Self::Search(_))
    }

    /// Follows one raster step; whether what is wanted has to be ordered anew.
    pub(super) fn step(&mut self, counters: &mut Counters, sample: &mut Sample<'_, '_>) -> bool {
        match self {
            Self::Velocity | Self::Search(_) | Self::Rest { .. } => false,
            Self::Position(mode) => mode.step(counters, sample),
            Self::Gear(mode) => {
                mode.step(sample);
                false
            }
        }
    }

    /// What the axis is to do now; a search gives its own orders.
    pub(super) fn wanted(&self, ramp: Acceleration, sample: &Sample<'_, '_>) -> Option<Wanted> {
        let profile = sample.profile(ramp);
        Some(match self {
            Self::Velocity => Wanted::Speed(sample.velocity(Role::VSoll), profile),
            Self::Position(_) => {
                let target = sample.register(Role::PSoll);
                match sample.turn_table() {
                    Some((_, turning)) => Wanted::Turn(target, turning, profile),
                    None => Wanted::Place(sample.place(target, sample.demand()), profile),
                }
            }
            Self::Gear(mode) => Wanted::Follow(mode.velocity(ramp, sample)),
            Self::Rest { .. } => Wanted::Rest(sample.acceleration(Role::AccEmerg)),
            Self::Search(_) => return None,
        })
    }

    /// The axis has got other numbers by `by`.
    pub(super) fn shift(&mut self, by: Position) {
        match self {
            Self::Gear(mode) => mode.shift(by),
            Self::Velocity | Self::Position(_) | Self::Search(_) | Self::Rest { .. } => {}
        }
    }
}

/// Position mode: AutoCorrection turns a motor that has not got where it should by the encoder once more.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Positioning {
    /// P_SOLL of the attempts.
    target: i32,
    attempts: i32,
    /// How long the motor has stood, in seconds.
    resting: f64,
    is_correcting: bool,
}

impl Positioning {
    /// How long the rotor may swing before the encoder is asked (our choice; JVL's SettlingTime is not supported).
    const SETTLING: f64 = 0.1;

    pub(super) fn is_correcting(&self) -> bool {
        self.is_correcting
    }

    fn step(&mut self, counters: &mut Counters, sample: &mut Sample<'_, '_>) -> bool {
        let target = sample.register(Role::PSoll);
        if target != self.target {
            *self = Self { target, ..Self::default() };
        }
        let is_done = sample.axis().status().done && is_at_target(sample);
        self.resting = if is_done { self.resting + sample.raster() } else { 0.0 };
        let most = sample.register(Role::Inposcnt);
        if self.resting < Self::SETTLING || !sample.stepper.has_encoder || most <= 0 {
            return false;
        }
        self.is_correcting = !is_physically_there(counters, sample) && self.attempts < most;
        if self.is_correcting {
            self.attempts += 1;
            self.resting = 0.0;
            counters.synchronise(sample);
        }
        self.is_correcting
    }
}

/// Whether the motor has been given all the steps to P_SOLL.
pub(super) fn is_at_target(sample: &Sample<'_, '_>) -> bool {
    let demand = sample.demand();
    sample.counter(demand) == sample.counter(sample.place(sample.register(Role::PSoll), demand))
}

/// Whether the encoder is within the window around P_SOLL.
pub(super) fn is_physically_there(counters: &Counters, sample: &Sample<'_, '_>) -> bool {
    let encoder = counters.encoder(sample);
    let target = sample.place(sample.register(Role::PSoll), encoder);
    let nearest = sample.travel().nearest(target, encoder);
    (nearest - encoder).abs().0 <= f64::from(sample.register(Role::Inposwin)).abs()
}

/// Gear mode: the motor follows the external encoder by GEAR1 / GEAR2, within V_SOLL and A_SOLL. What these keep it
/// from is made up for later.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Gear {
    /// How far it is behind where it would be without limits; engaged where it stood.
    behind: Position,
    pace: Velocity,
    last: Option<Position>,
}

impl Gear {
    fn step(&mut self, sample: &Sample<'_, '_>) {
        let (multiplier, divider) = (sample.register(Role::Gearf1), sample.register(Role::Gearf2));
        let ratio = if divider == 0 { 0.0 } else { f64::from(multiplier) / f64::from(divider) };
        let Position(pace) = sample.units.way(Position(sample.external_velocity().0 * ratio));
        self.pace = Velocity(pace);
        let now = sample.demand();
        let done = sample.travel().nearest(now, self.last.unwrap_or(now)) - self.last.unwrap_or(now);
        self.last = Some(now);
        self.behind = self.behind - done + Position(pace * sample.raster());
    }

    fn shift(&mut self, by: Position) {
        self.last = self.last.map(|last| last + by);
    }

    fn velocity(&self, ramp: Acceleration, sample: &Sample<'_, '_>) -> Velocity {
        let speed = sample.velocity(Role::VSoll).abs().0;
        let follower = Follower { raster: sample.raster(), speed, ramp: ramp.0 };
        follower.next(self.behind, self.pace, sample.axis().status().demand.velocity)
    }
}

/// A_SOLL of the motion under way: a change takes effect when the motor stops or turns round.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ramp {
    /// Of the motion, and whether that is in positive direction; none at standstill.
    taken: Option<(i32, bool)>,
}

impl Ramp {
    pub(super) fn step(&mut self, sample: &Sample<'_, '_>) {
        let Velocity(velocity) = sample.axis().status().demand.velocity;
        let is_positive = velocity > 0.0;
        if velocity == 0.0 {
            self.taken = None;
        } else if self.taken.is_none_or(|(_, was_positive)| was_positive != is_positive) {
            self.taken = Some((sample.register(Role::ASoll), is_positive));
        }
    }

    pub(super) fn acceleration(&self, sample: &Sample<'_, '_>) -> Acceleration {
        let taken = self.taken.map_or(sample.register(Role::ASoll), |(value, _)| value);
        sample.units.acceleration(taken)
    }
}
