//! The justifications: searches in phases (sections 5.7 to 5.10).

use axis::{Acceleration, Axis, Base, Finish, Mark, Order, Profile, Seek, Switch, Switches, Velocity};

use super::Mode;
use super::job::Job;

/// A justification under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Justification {
    job: Job,
    phase: Phase,
    /// The direction of the first phase.
    is_negative: bool,
    /// Whether the switch was on at the beginning.
    was_on: bool,
}

/// How far it has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The mark is looked for with the velocity of the mode.
    Search,
    /// The axis has run over the whole switch: back onto it with the justification velocity.
    Recross,
    /// To the edge of the switch with the justification velocity.
    Edge,
    /// To the next index pulse in positive direction with the justification velocity.
    Index,
    /// Back to the index pulse that was found.
    Return,
}

impl Justification {
    /// Begins; yields what the axis is to do first.
    pub(super) fn begin(job: Job, switches: &Switches) -> (Self, Order) {
        let was_on = job.switch.is_actuated(switches);
        let is_negative = match (job.mode, job.switch) {
            (Mode::FindEdge, Switch::NegativeLimit) => !was_on,
            (Mode::FindEdge, Switch::PositiveLimit) => was_on,
            (_, _) => job.velocity.0 < 0.0,
        };
        let new = Self { job, phase: Phase::Search, is_negative, was_on };
        let mark = match job.mode {
            Mode::Home => Mark::Switch { switch: Switch::Home, actuated: true },
            Mode::FindEdge => Mark::Switch { switch: job.switch, actuated: !was_on },
            _ => Mark::Index,
        };
        let seek = Seek {
            mark,
            velocity: signed(job.velocity, is_negative),
            acceleration: job.profile.acceleration,
            deceleration: job.profile.deceleration,
            finish: Finish::Ramp,
        };
        (new, Order::Seek(seek))
    }

    /// What the axis is to do next, now that it has come to rest at what it was looking for; `None` when it is
    /// justified.
    pub(super) fn next(&mut self, axis: &Axis) -> Option<Order> {
        let (phase, order) = match (self.job.mode, self.phase) {
            (Mode::SearchIndex, Phase::Search) => (Phase::Return, self.back_to_mark(axis)?),
            (Mode::Home, Phase::Search | Phase::Recross) => self.left_edge(&axis.status().switches),
            (Mode::Home, Phase::Edge) => (Phase::Index, self.slowly(Mark::Index, false)),
            (Mode::FindEdge, Phase::Search | Phase::Recross) => self.first_edge(&axis.status().switches),
            (_, _) => return None,
        };
        self.phase = phase;
        Some(order)
    }

    /// Home: to the edge of the reference switch that is nearest to the negative end of travel.
    fn left_edge(&self, switches: &Switches) -> (Phase, Order) {
        let mark = |actuated| Mark::Switch { switch: Switch::Home, actuated };
        if switches.home {
            (Phase::Edge, self.slowly(mark(false), true))
        } else if self.is_negative {
            (Phase::Edge, self.slowly(mark(true), false))
        } else {
            (Phase::Recross, self.slowly(mark(true), true))
        }
    }

    /// Find edge: back over the edge that was found first.
    fn first_edge(&self, switches: &Switches) -> (Phase, Order) {
        let switch = self.job.switch;
        let has_overrun = switch.is_actuated(switches) == self.was_on;
        let (phase, actuated) =
            if has_overrun { (Phase::Recross, !self.was_on) } else { (Phase::Edge, self.was_on) };
        (phase, self.slowly(Mark::Switch { switch, actuated }, !self.is_negative))
    }

    /// A search with the justification velocity, which ends without a ramp (section 4.8.3).
    fn slowly(&self, mark: Mark, is_negative: bool) -> Order {
        Order::Seek(Seek {
            mark,
            velocity: signed(self.job.slow, is_negative),
            acceleration: Acceleration(0.0),
            deceleration: Acceleration(0.0),
            finish: Finish::Abrupt,
        })
    }

    /// The shortest way back to the mark, with the justification velocity.
    fn back_to_mark(&self, axis: &Axis) -> Option<Order> {
        let from = axis.status().demand.position;
        let distance = axis.travel().nearest(axis.status().mark?, from) - from;
        let profile = Profile { velocity: self.job.slow, ..Profile::default() };
        Some(Order::MoveBy { distance, from: Base::Demand, profile })
    }
}

fn signed(velocity: Velocity, is_negative: bool) -> Velocity {
    let speed = velocity.abs();
    if is_negative { -speed } else { speed }
}
