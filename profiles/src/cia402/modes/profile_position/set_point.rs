//! What a set-point of profile position mode asks for, and where it waits.

use axis::{Base, Position, Profile, Velocity};

use crate::cia402::{Context, Controlword, ramps};
use crate::{Binding, Dialect, jvl};

/// A set-point as it was when the new-set-point bit rose.
#[derive(Clone, Copy, Debug)]
pub(super) struct SetPoint {
    pub(super) aim: Aim,
    pub(super) start: Start,
    pub(super) profile: Profile,
    /// 0x6082: how fast the target is passed when another set-point follows.
    pub(super) end_velocity: Velocity,
}

/// Where a set-point leads.
#[derive(Clone, Copy, Debug)]
pub(super) enum Aim {
    /// To a place.
    At(Position),
    /// By a distance, counted when the set-point comes into force.
    By(Position, Base),
    /// By a distance, at whose end the axis is called what it was called before (JVL module manual, section 4.3.12).
    Endless(Position),
}

/// When a set-point comes into force (IEC 61800-7-201, profile position mode, bits 9, 5 and 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Start {
    /// When the target before it is reached.
    Reached,
    /// When the target before it is passed, at the profile velocity.
    Passed,
    /// At once; what was in work or waiting is given up.
    Immediately,
}

/// When the drive takes the new-set-point bit back by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Response {
    /// Never: the master does.
    Master,
    /// When the target is reached.
    Reached,
    /// As soon as another set-point can be taken.
    Free,
}

/// 0x60F2; a drive without that object has zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Options(i64);

impl Options {
    pub(super) fn read(context: &Context<'_>) -> Self {
        Self(context.parameters.or(Binding::PositioningOption, 0))
    }

    /// Bits 4 and 5: request-response option.
    pub(super) fn response(self) -> Response {
        match self.0 >> 4 & 3 {
            1 => Response::Reached,
            2 => Response::Free,
            _ => Response::Master,
        }
    }

    /// Bits 0 and 1: relative option.
    fn base(self) -> Base {
        match self.0 & 3 {
            1 => Base::Demand,
            2 => Base::Actual,
            _ => Base::Target,
        }
    }

    /// Bits 2 and 3: change-immediately option.
    fn waits_for_the_target(self) -> bool {
        self.0 >> 2 & 3 == 1
    }
}

impl SetPoint {
    /// Reads a set-point from the objects; `None` if it is a place and places have no lasting numbers.
    pub(super) fn read(word: Controlword, context: &Context<'_>) -> Option<Self> {
        let Context { parameters, axis, .. } = context;
        let options = Options::read(context);
        let value = parameters.or(Binding::TargetPosition, 0);
        let aim = match (word.contains(Controlword::RELATIVE), jvl::is_endless(*parameters)) {
            (true, true) => Aim::Endless(parameters.units.way(value)),
            (true, false) => Aim::By(parameters.units.way(value), options.base()),
            (false, true) => return None,
            (false, false) => Aim::At(parameters.units.position(value, axis.status().demand.position)),
        };
        let velocity = parameters.units.velocity(parameters.or(Binding::ProfileVelocity, 0));
        Some(Self {
            aim,
            start: Start::of(word, options),
            profile: ramps::profile(*parameters, velocity),
            end_velocity: parameters.units.velocity(parameters.or(Binding::EndVelocity, 0)),
        })
    }

    /// Whether it moves the numbers of the places.
    pub(super) fn is_endless(&self) -> bool {
        matches!(self.aim, Aim::Endless(_))
    }

    /// Which way it leads from `from`: ±1 or 0.
    pub(super) fn direction(&self, from: Position) -> f64 {
        match self.aim {
            Aim::At(target) => direction(target - from),
            Aim::By(distance, _) | Aim::Endless(distance) => direction(distance),
        }
    }
}

impl Start {
    fn of(word: Controlword, options: Options) -> Self {
        let is_immediate = word.contains(Controlword::CHANGE_IMMEDIATELY);
        if is_immediate && !options.waits_for_the_target() {
            Self::Immediately
        } else if is_immediate || word.contains(Controlword::CHANGE_ON_SET_POINT) {
            Self::Passed
        } else {
            Self::Reached
        }
    }
}

/// The sign of a distance; zero for none.
pub(super) fn direction(distance: Position) -> f64 {
    if distance.0 == 0.0 { 0.0 } else { distance.0.signum() }
}

/// Set-points that wait, first in, first out.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Buffer([Option<SetPoint>; Self::MOST]);

impl Buffer {
    const MOST: usize = 2;

    /// The one that is next.
    pub(super) fn first(&self) -> Option<&SetPoint> {
        self.0.first().and_then(Option::as_ref)
    }

    /// Takes the one that is next.
    pub(super) fn pop(&mut self) -> Option<SetPoint> {
        self.0.rotate_left(1);
        self.0.last_mut().and_then(Option::take)
    }

    /// Adds one at the end, if a drive of this dialect has room for it.
    pub(super) fn push(&mut self, set_point: SetPoint, dialect: Dialect) -> bool {
        let free = self.0.iter_mut().take(room(dialect)).find(|place| place.is_none());
        free.map(|place| *place = Some(set_point)).is_some()
    }

    /// Whether a drive of this dialect can take no more.
    pub(super) fn is_full(&self, dialect: Dialect) -> bool {
        self.0.iter().take(room(dialect)).all(Option::is_some)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.first().is_none()
    }
}

/// Set-points that may wait. JVL's modules have one "accepted but not activated" (module manual, section 4.3.23).
const fn room(dialect: Dialect) -> usize {
    match dialect {
        Dialect::Cia402 | Dialect::Mac4(_) => Buffer::MOST,
        Dialect::Jvl => 1,
    }
}
