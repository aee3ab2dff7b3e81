//! The search for the home position, leg by leg.
//!
//! A switch is looked for at high speed. The axis returns to the edge that was found, backs out to the near side and
//! crosses it once more at low speed: the place latched then counts, and the first index pulse strictly behind it. A
//! switch that is too narrow for the low speed is an error.

use core::num::NonZeroU32;

use axis::{Acceleration, Axis, Finish, Mark, Order, Period, Position, Seek, SeekState, Torque, Velocity};

use super::method::{Direction, Edge, Method, SwitchMethod};

/// How long a torque must last to be a mechanical stop, in ns.
const PUSH_NANOS: u64 = 50_000_000;

/// Revolutions within which there must be an index pulse.
const INDEX_REVOLUTIONS: f64 = 1.5;

/// How to move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// 0x6099:01.
    pub(super) fast: Velocity,
    /// 0x6099:02.
    pub(super) slow: Velocity,
    /// 0x609A, both ways.
    pub(super) ramp: Acceleration,
    /// The torque that tells a mechanical stop.
    pub(super) torque: Torque,
    /// The way from one index pulse to the next.
    pub(super) revolution: Position,
}

/// What has become of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outcome {
    /// It goes on.
    Pending,
    /// Home is here.
    Found(Position),
    /// There is no home; the axis stops.
    Lost,
    /// Someone else commands the axis.
    Interrupted,
}

/// A part of the search.
#[derive(Clone, Copy, Debug)]
enum Leg {
    /// The axis comes to rest before anything else.
    Start,
    /// To an edge of a switch.
    Edge(SwitchMethod, EdgeLeg),
    /// To the index behind this place.
    Index(Direction, Position),
    /// Against the mechanical stop, perhaps with the index to follow.
    Push(Direction, bool),
}

/// A part of the search for an edge.
#[derive(Clone, Copy, Debug)]
enum EdgeLeg {
    /// To where the switch is actuated.
    Find(Direction, Velocity),
    /// To where it is not.
    Leave(Direction, Velocity),
    /// Back to the far edge of a switch that was narrower than a raster step, found in this direction.
    ReturnToFar(Direction),
    /// Back to the edge looked for.
    Return,
    /// From the edge to its near side.
    BackOut,
    /// Over the edge.
    Cross,
    /// Back to the edge.
    ReturnToHome,
}

/// A search under way.
#[derive(Debug)]
pub(super) struct Search {
    method: Method,
    pace: Pace,
    leg: Leg,
    is_turned: bool,
    /// The edge looked for, as found at high speed.
    edge: Position,
}

impl Search {
    /// A search that begins once the axis stands; none if a speed it needs is zero.
    pub(super) fn new(method: Method, pace: Pace) -> Option<Self> {
        let is_zero = |velocity: Velocity| velocity.0 == 0.0;
        let is_stuck = match method {
            Method::Switch(_) | Method::Stop { index: true, .. } => is_zero(pace.fast) || is_zero(pace.slow),
            Method::Index(_) => is_zero(pace.slow),
            Method::Stop { index: false, .. } => is_zero(pace.fast),
            Method::Here => false,
        };
        let new = Self { method, pace, leg: Leg::Start, is_turned: false, edge: Position(0.0) };
        (!is_stuck).then_some(new)
    }

    /// Follows the axis after a raster step.
    pub(super) fn step(&mut self, axis: &mut Axis) -> Outcome {
        if matches!(self.leg, Leg::Start) {
            return if axis.status().done { self.start(axis) } else { Outcome::Pending };
        }
        match axis.status().seek {
            SeekState::None => Outcome::Interrupted,
            SeekState::Searching => self.watch(axis),
            SeekState::Found => self.proceed(axis),
            SeekState::Failed => self.turn(axis),
        }
    }

    fn start(&mut self, axis: &mut Axis) -> Outcome {
        let here = axis.status().actual.position;
        match self.method {
            Method::Switch(method) => self.look_for(method, method.initial, axis),
            Method::Index(direction) => self.go(Leg::Index(direction, here), axis),
            Method::Stop { direction, index } => self.go(Leg::Push(direction, index), axis),
            Method::Here => Outcome::Found(here),
        }
    }

    /// Looks for the switch in `direction`. Out of an actuated switch the way leads over the edge looked for.
    fn look_for(&mut self, method: SwitchMethod, direction: Direction, axis: &mut Axis) -> Outcome {
        let leg = if method.switch.is_actuated(&axis.status().switches) {
            EdgeLeg::Leave(method.edge.way_out(), self.pace.fast)
        } else {
            EdgeLeg::Find(direction, self.pace.fast)
        };
        self.go(Leg::Edge(method, leg), axis)
    }

    /// Gives up when there is no index.
    fn watch(&self, axis: &mut Axis) -> Outcome {
        let Leg::Index(direction, from) = self.leg else { return Outcome::Pending };
        let way = (axis.status().actual.position - from).0 * direction.sign();
        if way <= INDEX_REVOLUTIONS * self.pace.revolution.0 {
            return Outcome::Pending;
        }
        self.give_up(axis)
    }

    /// A limit came first: the search goes the other way, once, if the method wants that.
    fn turn(&mut self, axis: &mut Axis) -> Outcome {
        let Leg::Edge(method, leg) = self.leg else { return Outcome::Lost };
        let is_coarse = matches!(leg, EdgeLeg::Find(..) | EdgeLeg::Return | EdgeLeg::ReturnToFar(_));
        if !method.turns || self.is_turned || !is_coarse {
            return Outcome::Lost;
        }
        if !axis.status().done {
            return Outcome::Pending;
        }
        self.is_turned = true;
        self.look_for(method, method.initial.reversed(), axis)
    }

    /// The mark of this leg is found.
    fn proceed(&mut self, axis: &mut Axis) -> Outcome {
        let status = axis.status();
        let (mark, is_at_rest) = (status.mark.unwrap_or(status.actual.position), status.done);
        match self.leg {
            Leg::Start => Outcome::Pending,
            Leg::Edge(method, leg) => self.proceed_to_edge(method, leg, mark, axis),
            Leg::Index(direction, from) if (mark - from).0 * direction.sign() > 0.0 => Outcome::Found(mark),
            Leg::Index(..) => self.go(self.leg, axis),
            Leg::Push(_, false) => Outcome::Found(mark),
            Leg::Push(direction, true) if is_at_rest => self.go(Leg::Index(direction.reversed(), mark), axis),
            Leg::Push(_, true) => Outcome::Pending,
        }
    }

    fn proceed_to_edge(
        &mut self,
        method: SwitchMethod,
        leg: EdgeLeg,
        mark: Position,
        axis: &mut Axis,
    ) -> Outcome {
        let status = axis.status();
        let (is_on, is_at_rest) = (method.switch.is_actuated(&status.switches), status.done);
        let next = match leg {
            EdgeLeg::Find(direction, speed) => {
                self.edge = mark;
                after_finding(method, direction, speed, is_on)
            }
            EdgeLeg::Leave(..) => {
                self.edge = mark;
                EdgeLeg::Return
            }
            // Passed as a whole: the last edge was latched, not the one looked for.
            EdgeLeg::Cross if is_on != method.is_actuated_after() => return self.give_up(axis),
            EdgeLeg::Cross if !method.index => return Outcome::Found(mark),
            EdgeLeg::Cross => EdgeLeg::ReturnToHome,
            EdgeLeg::ReturnToFar(_) | EdgeLeg::Return | EdgeLeg::BackOut | EdgeLeg::ReturnToHome
                if !is_at_rest =>
            {
                return Outcome::Pending;
            }
            EdgeLeg::ReturnToFar(direction) => EdgeLeg::Find(direction.reversed(), self.pace.slow),
            EdgeLeg::Return => EdgeLeg::BackOut,
            EdgeLeg::BackOut if is_on != method.is_actuated_after() => EdgeLeg::Cross,
            EdgeLeg::BackOut if self.is_before_edge(method, axis) => return self.give_up(axis),
            EdgeLeg::BackOut => EdgeLeg::BackOut,
            EdgeLeg::ReturnToHome => return self.go(Leg::Index(method.side, mark), axis),
        };
        self.go(Leg::Edge(method, next), axis)
    }

    /// Whether the axis is more than a count's jitter before the edge. If its switch says otherwise, the axis has backed
    /// out through the whole of it.
    fn is_before_edge(&self, method: SwitchMethod, axis: &Axis) -> bool {
        (self.edge - axis.status().actual.position).0 * method.side.sign() > 1.0
    }

    fn give_up(&self, axis: &mut Axis) -> Outcome {
        axis.stop(self.pace.ramp);
        Outcome::Lost
    }

    /// Begins a leg, by an order of its own or with the axis on its way already.
    fn go(&mut self, leg: Leg, axis: &mut Axis) -> Outcome {
        self.leg = leg;
        let Pace { fast, slow, .. } = self.pace;
        let search = match leg {
            Leg::Start => None,
            Leg::Edge(method, leg) => self.edge_search(method, leg),
            Leg::Index(direction, _) => Some((Mark::Index, direction, slow, Finish::Return)),
            Leg::Push(direction, _) => Some((self.push(axis.period()), direction, fast, Finish::Abrupt)),
        };
        if let Some((mark, direction, speed, finish)) = search {
            axis.order(Order::Seek(Seek {
                mark,
                velocity: Velocity(direction.sign() * speed.0),
                acceleration: self.pace.ramp,
                deceleration: self.pace.ramp,
                finish,
            }));
        }
        Outcome::Pending
    }

    fn edge_search(&self, method: SwitchMethod, leg: EdgeLeg) -> Option<(Mark, Direction, Velocity, Finish)> {
        let (slow, after) = (self.pace.slow, method.is_actuated_after());
        let (actuated, direction, speed, finish) = match leg {
            EdgeLeg::Find(direction, speed) => (true, direction, speed, Finish::Return),
            EdgeLeg::Leave(direction, speed) => (false, direction, speed, Finish::Return),
            EdgeLeg::BackOut => (!after, method.side.reversed(), slow, Finish::Abrupt),
            EdgeLeg::Cross => (after, method.side, slow, Finish::Return),
            EdgeLeg::Return | EdgeLeg::ReturnToFar(_) | EdgeLeg::ReturnToHome => return None,
        };
        Some((Mark::Switch { switch: method.switch, actuated }, direction, speed, finish))
    }

    fn push(&self, period: Period) -> Mark {
        let steps = u32::try_from(PUSH_NANOS.div_ceil(period.nanos())).unwrap_or(u32::MAX);
        Mark::Torque { limit: self.pace.torque, steps: NonZeroU32::new(steps).unwrap_or(NonZeroU32::MIN) }
    }
}

/// The leg after the switch was found. One that is not actuated at the end of the step was passed as a whole.
fn after_finding(method: SwitchMethod, direction: Direction, speed: Velocity, is_on: bool) -> EdgeLeg {
    if Edge::passed(direction, is_on) == method.edge {
        EdgeLeg::Return
    } else if is_on {
        EdgeLeg::Leave(direction, speed)
    } else {
        EdgeLeg::ReturnToFar(direction)
    }
}
