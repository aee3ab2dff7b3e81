//! The zero searches: against a mechanical stop, to a sensor at the analogue input, to the index.
//!
//! The sensor is the home switch of the plant. V_HOME is speed and direction, A_SOLL the ramp, T_HOME the torque; its
//! minus sign means the falling edge of the sensor.

use core::num::NonZeroU32;

use axis::{Finish, Mark, Order, Position, Seek, SeekState, Switch, Velocity};

use super::Demand;
use crate::Role;
use crate::jvl::motor::Sample;
use crate::jvl::motor::mode::Mode;
use crate::jvl::units::MacUnits;

/// What is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A mechanical stop.
    Torque,
    /// The sensor.
    Forward,
    /// The sensor, and its edge again on the way back.
    TwoWay,
    /// The index.
    Index,
}

/// A zero search.
#[derive(Debug)]
pub(crate) struct Search {
    kind: Kind,
    leg: Leg,
    outcome: Option<Outcome>,
}

/// How a search has ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::jvl::motor) enum Outcome {
    /// The zero point is here.
    Found(Position),
    /// A limit came first.
    Failed,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Leg {
    /// Nothing is ordered yet.
    Start,
    /// To the mark.
    There,
    /// Back over the edge of the sensor.
    Back,
}

/// How long the torque has to last, as in the torque homing of the CiA 402 drive.
const PUSH_SECONDS: f64 = 0.05;

/// By how much slower the motor goes back over the edge (our choice, no manual prints it).
const SLOWER: f64 = 16.0;

impl Search {
    pub(super) fn new(kind: Kind) -> Self {
        Self { kind, leg: Leg::Start, outcome: None }
    }

    pub(super) fn mode(&self) -> Mode {
        match self.kind {
            Kind::Torque => Mode::TorqueSearch,
            Kind::Forward => Mode::ForwardSearch,
            Kind::TwoWay => Mode::TwoWaySearch,
            Kind::Index => Mode::IndexSearch,
        }
    }

    pub(super) fn outcome(&self) -> Option<Outcome> {
        self.outcome
    }

    /// Goes on with the next leg once the axis has done one.
    pub(super) fn demand(&mut self, sample: &mut Sample<'_, '_>) -> Demand {
        let status = *sample.axis().status();
        match (self.leg, status.seek) {
            (Leg::Start, _) => self.go(Leg::There, sample),
            (Leg::There | Leg::Back, SeekState::Searching) => {}
            (Leg::There, SeekState::Found) if status.done && self.kind == Kind::TwoWay => {
                self.go(Leg::Back, sample);
            }
            (Leg::There | Leg::Back, SeekState::Found) => {
                self.outcome = status.mark.filter(|_| status.done).map(Outcome::Found);
            }
            (Leg::There | Leg::Back, SeekState::None | SeekState::Failed) => {
                self.outcome = Some(Outcome::Failed);
            }
        }
        Demand::Ordered
    }

    fn go(&mut self, leg: Leg, sample: &mut Sample<'_, '_>) {
        self.leg = leg;
        let velocity = sample.velocity(Role::VHome);
        let back = Velocity(-velocity.0 / SLOWER);
        let ramp = sample.acceleration(Role::ASoll);
        let seek = Seek {
            mark: self.mark(sample),
            velocity: if leg == Leg::Back { back } else { velocity },
            acceleration: ramp,
            deceleration: ramp,
            finish: if self.kind == Kind::Index { Finish::Return } else { Finish::Ramp },
        };
        sample.axis_mut().order(Order::Seek(seek));
    }

    fn mark(&self, sample: &Sample<'_, '_>) -> Mark {
        let torque = sample.register(Role::THome);
        match self.kind {
            Kind::Torque => {
                let steps = (PUSH_SECONDS / sample.raster()).ceil() as u32;
                let steps = NonZeroU32::new(steps).unwrap_or(NonZeroU32::MIN);
                Mark::Torque { limit: MacUnits::torque(torque), steps }
            }
            Kind::Index => Mark::Index,
            Kind::Forward | Kind::TwoWay => {
                let is_rising = torque >= 0;
                Mark::Switch { switch: Switch::Home, actuated: is_rising == (self.leg != Leg::Back) }
            }
        }
    }
}
