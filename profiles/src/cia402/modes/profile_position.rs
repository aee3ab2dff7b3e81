//! Profile position mode: the set-point handshake (IEC 61800-7-201, profile position mode).

use axis::{Axis, Position, Profile};

use super::ModeBits;
use crate::Binding;
use crate::cia402::window::Window;
use crate::cia402::{Context, Controlword, View};
use crate::slots::Parameters;

/// A set-point that was taken over.
#[derive(Clone, Copy, Debug)]
struct Move {
    target: Position,
    profile: Profile,
}

/// The set-point under way, the one that waits for it, and what was said of them.
#[derive(Debug, Default)]
pub(crate) struct ProfilePosition {
    active: Option<Move>,
    waiting: Option<Move>,
    is_acknowledged: bool,
    window: Window,
}

impl ProfilePosition {
    /// Starts without any set-point: the axis holds where it is.
    #[expect(clippy::unused_self, reason = "the same verbs for every mode")]
    pub(super) fn begin(&mut self, _: Controlword, context: &mut Context<'_>) {
        context.axis.stop(context.slow_down_ramp());
    }

    /// Parameters act with the next set-point.
    #[expect(clippy::unused_self, reason = "the same verbs for every mode")]
    pub(super) fn update(&mut self, _: Controlword, _: &mut Context<'_>) {}

    /// Takes the changes of the controlword: a rising new-set-point bit takes a set-point over, a falling one
    /// ends the acknowledgement as soon as another set-point could be taken.
    pub(super) fn control(&mut self, old: Controlword, new: Controlword, context: &mut Context<'_>) {
        let (was, is) = (old.contains(Controlword::NEW_SET_POINT), new.contains(Controlword::NEW_SET_POINT));
        if is && !was && !self.is_acknowledged {
            self.take(new, context.parameters, context.axis);
        } else if !is && self.waiting.is_none() {
            self.is_acknowledged = false;
        }
    }

    /// The axis stops; the set-point remains for later.
    #[expect(clippy::unused_self, reason = "the same verbs for every mode")]
    pub(super) fn halt(&mut self, _: &mut Context<'_>) {}

    /// Goes on after a halt.
    pub(super) fn resume(&mut self, _: Controlword, context: &mut Context<'_>) {
        if let Some(active) = self.active {
            self.start(active, context.axis);
        }
    }

    /// Follows the axis after a raster step.
    pub(super) fn step(&mut self, word: Controlword, context: &mut Context<'_>) {
        let Context { parameters, axis, .. } = context;
        if !word.contains(Controlword::HALT)
            && !self.is_moving(axis)
            && let Some(next) = self.waiting.take()
        {
            self.start(next, axis);
            self.is_acknowledged = word.contains(Controlword::NEW_SET_POINT);
            return;
        }
        let status = axis.status();
        let target = self.active.map_or(status.demand.position, |m| axis.limits().range().nearest(m.target));
        let distance = (status.actual.position - target).abs();
        // 0xFFFFFFFF switches the window off (IEC 61800-7-201, 0x6067).
        let width = parameters.get(Binding::PositionWindow).filter(|w| *w != i64::from(u32::MAX));
        let is_near = width.is_none_or(|width| distance <= parameters.units.distance(width));
        self.window.step(status.done && is_near);
    }

    /// Bit 10: the axis has been at the target for the window time, with nothing left to do. Bit 12: a set-point is
    /// acknowledged and no other one can be taken.
    pub(super) fn bits(&self, view: View<'_>) -> ModeBits {
        let time = view.parameters.or(Binding::PositionWindowTime, 0);
        let is_reached = self.waiting.is_none() && self.window.is_reached(time, view.axis.period().nanos());
        ModeBits { is_reached, bit_12: self.is_acknowledged, bit_13: false }
    }

    fn take(&mut self, word: Controlword, parameters: Parameters<'_>, axis: &mut Axis) {
        let next = Move { target: self.target(word, parameters, axis), profile: profile(parameters) };
        self.is_acknowledged = true;
        if word.contains(Controlword::HALT)
            || (self.is_moving(axis) && !word.contains(Controlword::CHANGE_IMMEDIATELY))
        {
            self.waiting = Some(next);
        } else {
            self.waiting = None;
            self.start(next, axis);
        }
    }

    /// Where a new set-point leads; a relative one counts from the one before it.
    fn target(&self, word: Controlword, parameters: Parameters<'_>, axis: &Axis) -> Position {
        let value = parameters.or(Binding::TargetPosition, 0);
        let demand = axis.status().demand.position;
        if word.contains(Controlword::RELATIVE) {
            let last = self.waiting.or(self.active).map_or(demand, |m| m.target);
            last + parameters.units.distance(value)
        } else {
            parameters.units.position(value, demand)
        }
    }

    fn start(&mut self, next: Move, axis: &mut Axis) {
        self.active = Some(next);
        self.window.restart();
        axis.move_to(next.target, next.profile);
    }

    fn is_moving(&self, axis: &Axis) -> bool {
        self.active.is_some() && !axis.status().done
    }
}

/// The profile of a positioning; without 0x6084 the deceleration equals the acceleration.
fn profile(parameters: Parameters<'_>) -> Profile {
    let acceleration = parameters.or(Binding::ProfileAcceleration, 0);
    Profile {
        velocity: parameters.units.velocity(parameters.or(Binding::ProfileVelocity, 0)),
        acceleration: parameters.units.acceleration(acceleration),
        deceleration: parameters
            .units
            .acceleration(parameters.or(Binding::ProfileDeceleration, acceleration)),
        jerk: None,
    }
}
