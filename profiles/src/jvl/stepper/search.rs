//! The zero search of a MIS stepper (MODE_REG 13 and 14; JVL Ethernet manual, section 11.4, registers 38, 40, 122 and
//! 132).
//!
//! V_HOME is speed and direction, A_SOLL the ramp. A motor that begins on the sensor leaves it first, so that the zero
//! point is always the same edge. Mode 14 goes back over that edge, a sixteenth as fast (our choice).

use axis::{Acceleration, Finish, Mark, Order, Position, Seek, SeekState, Switch, Velocity};

use super::Sample;
use super::bits::ZeroSearch;
use super::mode::Mode;
use crate::Role;

/// By how much slower the motor goes back over the edge.
const SLOWER: f64 = 16.0;

/// A zero search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Search {
    mode: Mode,
    leg: Leg,
    /// A limit switch has turned it around.
    has_turned: bool,
}

/// How a search goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// As it does.
    Pending,
    /// With this order.
    Order(Order),
    /// The zero point is here.
    Found(Position),
    /// A limit came first.
    Failed,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Leg {
    /// Nothing is ordered yet.
    Start,
    /// Off the sensor that is active at the start.
    Off,
    /// To the sensor.
    There,
    /// To its far side.
    Past,
    /// Back over its edge.
    Back,
    /// To the index.
    Index,
}

impl Search {
    pub(super) fn new(mode: Mode) -> Self {
        Self { mode, leg: Leg::Start, has_turned: false }
    }

    pub(super) fn mode(&self) -> Mode {
        self.mode
    }

    /// Goes on once the axis has done a leg.
    pub(super) fn step(&mut self, ramp: Acceleration, sample: &Sample<'_, '_>) -> Step {
        let status = sample.axis().status();
        match (self.leg, status.seek) {
            (Leg::Start, _) => {
                let leg = self.first(sample);
                self.go(leg, ramp, sample)
            }
            (_, SeekState::Searching) => Step::Pending,
            (_, SeekState::Found) if !status.done => Step::Pending,
            (leg, SeekState::Found) => match (self.after(leg, sample), status.mark) {
                (Some(next), _) => self.go(next, ramp, sample),
                (None, Some(mark)) => Step::Found(mark),
                (None, None) => Step::Failed,
            },
            (leg, SeekState::Failed) if self.may_turn(sample) => {
                if !status.switches.negative_limit && !status.switches.positive_limit {
                    return Step::Failed;
                }
                if status.demand.velocity.0 != 0.0 {
                    return Step::Pending;
                }
                self.has_turned = true;
                self.go(leg, ramp, sample)
            }
            (_, SeekState::None | SeekState::Failed) => Step::Failed,
        }
    }

    fn may_turn(&self, sample: &Sample<'_, '_>) -> bool {
        !self.has_turned && sample.zero_search().contains(ZeroSearch::TURNS_ON_LIMIT)
    }

    fn first(&self, sample: &Sample<'_, '_>) -> Leg {
        if sample.zero_search().contains(ZeroSearch::INDEX_ONLY) {
            Leg::Index
        } else if sample.axis().status().switches.home {
            Leg::Off
        } else {
            Leg::There
        }
    }

    fn after(&self, leg: Leg, sample: &Sample<'_, '_>) -> Option<Leg> {
        let bits = sample.zero_search();
        let index = bits.contains(ZeroSearch::INDEX).then_some(Leg::Index);
        match leg {
            Leg::Start | Leg::Off => Some(Leg::There),
            Leg::There if bits.contains(ZeroSearch::OPPOSITE_SIDE) => Some(Leg::Past),
            Leg::There | Leg::Past if self.mode == Mode::TwoWaySearch => Some(Leg::Back),
            Leg::There | Leg::Past | Leg::Back => index,
            Leg::Index => None,
        }
    }

    fn go(&mut self, leg: Leg, ramp: Acceleration, sample: &Sample<'_, '_>) -> Step {
        let Velocity(home) = sample.velocity(Role::VHome);
        let towards = Velocity(if self.has_turned { -home } else { home });
        let bits = sample.zero_search();
        let switch = |actuated| Mark::Switch { switch: Switch::Home, actuated };
        let (mark, velocity) = match leg {
            Leg::Start | Leg::There => (switch(true), towards),
            Leg::Off => (switch(false), -towards),
            Leg::Past => (switch(false), towards),
            Leg::Back => {
                let is_far = bits.contains(ZeroSearch::OPPOSITE_SIDE);
                (switch(is_far), Velocity(-towards.0 / SLOWER))
            }
            Leg::Index => (Mark::Index, towards),
        };
        self.leg = leg;
        Step::Order(Order::Seek(Seek {
            mark,
            velocity,
            acceleration: ramp,
            deceleration: ramp,
            finish: Finish::Ramp,
        }))
    }
}
