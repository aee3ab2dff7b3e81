//! Profile position mode: the set-point handshake (IEC 61800-7-201, profile position mode).
//!
//! A rising new-set-point bit takes a set-point over with all that belongs to it; later changes of the objects are
//! those of the next one. One set-point is in work, others may wait for it. One that changes on the set-point, or
//! follows on an end velocity, makes the one in work pass its target: the axis is sent beyond, to where a stop from
//! the wanted velocity would end, and on to the next target in the raster step in which its demand passes this one.
//! Where the way turns back there, it stops first.

mod set_point;

use axis::{Axis, Base, Position, Profile, Velocity};

use self::set_point::{Aim, Buffer, Options, Response, SetPoint, Start, direction};
use super::ModeBits;
use crate::Binding;
use crate::cia402::window::Window;
use crate::cia402::{Context, Controlword, View};
use crate::{Dialect, slots::Parameters};

/// The set-point in work, those that wait for it, and what was said of them.
#[derive(Debug, Default)]
pub(crate) struct ProfilePosition {
    active: Option<Move>,
    waiting: Buffer,
    is_acknowledged: bool,
    window: Window,
}

/// A set-point in work.
#[derive(Clone, Copy, Debug)]
struct Move {
    target: Position,
    profile: Profile,
    end_velocity: Velocity,
    /// The direction (±1) in which the target will be passed without a stop.
    passing: Option<f64>,
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

    /// Takes the changes of the controlword: a rising new-set-point bit takes a set-point over.
    pub(super) fn control(&mut self, old: Controlword, new: Controlword, context: &mut Context<'_>) {
        let (was, is) = (old.contains(Controlword::NEW_SET_POINT), new.contains(Controlword::NEW_SET_POINT));
        if is && !was {
            self.take(new, context);
        }
        self.release(new, context.dialect);
    }

    /// The axis stops; the set-points remain for later.
    pub(super) fn halt(&mut self, _: &mut Context<'_>) {
        if let Some(active) = &mut self.active {
            active.passing = None;
        }
    }

    /// Goes on after a halt.
    pub(super) fn resume(&mut self, _: Controlword, context: &mut Context<'_>) {
        self.window.restart();
        self.run(context.axis);
    }

    /// Follows the axis after a raster step.
    pub(super) fn step(&mut self, word: Controlword, context: &mut Context<'_>) {
        self.window.step(self.is_near(context.parameters, context.axis));
        if !word.contains(Controlword::HALT) && self.is_free(context.parameters, context.axis) {
            self.go_on(word, context.axis);
        }
        self.release(word, context.dialect);
    }

    /// Whether the drive takes the new-set-point bit back by itself now (0x60F2, request-response option).
    pub(super) fn takes_bit_back(&mut self, context: &Context<'_>) -> bool {
        let is_over = match Options::read(context).response() {
            Response::Master => false,
            Response::Reached => self.is_reached(context.parameters, context.axis),
            Response::Free => !self.waiting.is_full(context.dialect),
        };
        is_over && core::mem::take(&mut self.is_acknowledged)
    }

    /// Bit 10: the axis has been at the target for the window time, with nothing left to do. Bit 12: a set-point is
    /// acknowledged, or no other one can be taken. Bit 13, the following error, is a fault and shown with it.
    pub(super) fn bits(&self, view: View<'_>) -> ModeBits {
        let is_reached = self.is_reached(view.parameters, view.axis);
        ModeBits { is_reached, bit_12: self.is_acknowledged, bit_13: false }
    }

    fn take(&mut self, word: Controlword, context: &mut Context<'_>) {
        let Some(next) = SetPoint::read(word, context) else { return };
        // What moves the numbers of the places moves that of the home position, too.
        *context.is_referenced &= !next.is_endless();
        if next.start == Start::Immediately {
            self.waiting = Buffer::default();
            self.is_acknowledged = true;
            self.engage(&next, word, context.axis);
        } else if self.waiting.push(next, context.dialect) {
            self.is_acknowledged = true;
            if self.is_free(context.parameters, context.axis) {
                self.go_on(word, context.axis);
            } else if !word.contains(Controlword::HALT) {
                self.run(context.axis);
            }
        }
    }

    /// The acknowledgement ends when the bit is back and another set-point could be taken.
    fn release(&mut self, word: Controlword, dialect: Dialect) {
        if !word.contains(Controlword::NEW_SET_POINT) && !self.waiting.is_full(dialect) {
            self.is_acknowledged = false;
        }
    }

    /// Goes on to the set-point that waits, if one does.
    fn go_on(&mut self, word: Controlword, axis: &mut Axis) {
        if let Some(next) = self.waiting.pop() {
            self.engage(&next, word, axis);
        }
    }

    /// Brings a set-point into force; while halted it stays at rest until that is over.
    fn engage(&mut self, next: &SetPoint, word: Controlword, axis: &mut Axis) {
        let target = self.target(next.aim, axis);
        let SetPoint { profile, end_velocity, .. } = *next;
        self.active = Some(Move { target, profile, end_velocity, passing: None });
        self.window.restart();
        if !word.contains(Controlword::HALT) {
            self.run(axis);
        }
    }

    fn target(&self, aim: Aim, axis: &mut Axis) -> Position {
        let (demand, actual) = (axis.status().demand.position, axis.status().actual.position);
        let before = self.active.map_or(demand, |active| active.target);
        match aim {
            Aim::At(target) => target,
            Aim::By(distance, Base::Target) => before + distance,
            Aim::By(distance, Base::Demand) => demand + distance,
            Aim::By(distance, Base::Actual) => actual + distance,
            Aim::Endless(distance) => {
                axis.set_position(actual - distance);
                before
            }
        }
    }

    /// Sends the axis to the target in work, or past it if the next set-point says so.
    fn run(&mut self, axis: &mut Axis) {
        let Some(active) = &mut self.active else { return };
        let passing = self.waiting.first().and_then(|next| active.passing(next, axis));
        active.passing = passing.map(|(direction, _)| direction);
        axis.move_to(passing.map_or(active.target, |(_, end)| end), active.profile);
    }

    /// Whether the next set-point may come into force.
    fn is_free(&self, parameters: Parameters<'_>, axis: &Axis) -> bool {
        let Some(active) = &self.active else { return true };
        let status = axis.status();
        match active.passing {
            Some(direction) => (status.demand.position - active.target).0 * direction >= 0.0 || status.done,
            // A limit that has ended the motion must not keep the next one from leading away.
            None => self.is_in_window(parameters, axis) || (status.done && status.limited),
        }
    }

    fn is_reached(&self, parameters: Parameters<'_>, axis: &Axis) -> bool {
        self.waiting.is_empty() && self.is_in_window(parameters, axis)
    }

    /// Whether the axis has been at its target for the window time.
    fn is_in_window(&self, parameters: Parameters<'_>, axis: &Axis) -> bool {
        self.window.is_reached(parameters.or(Binding::PositionWindowTime, 0), axis.period().nanos())
    }

    fn is_near(&self, parameters: Parameters<'_>, axis: &Axis) -> bool {
        let status = axis.status();
        let target = self.active.map_or(status.demand.position, |m| axis.limits().range().nearest(m.target));
        let distance = (status.actual.position - target).abs();
        // 0xFFFFFFFF switches the window off (IEC 61800-7-201, 0x6067).
        let width = parameters.get(Binding::PositionWindow).filter(|w| *w != i64::from(u32::MAX));
        status.done && width.is_none_or(|width| distance <= parameters.units.distance(width))
    }
}

impl Move {
    /// In which direction the target is passed on the way to `next`, and where a stop would end; `None` if the axis
    /// stops at the target.
    fn passing(&self, next: &SetPoint, axis: &Axis) -> Option<(f64, Position)> {
        let wanted = match next.start {
            Start::Reached => self.end_velocity,
            Start::Passed | Start::Immediately => self.profile.velocity,
        };
        let profile = axis.limits().clamp(self.profile);
        let speed = wanted.abs().0.min(profile.velocity.0);
        let ahead = direction(self.target - axis.status().demand.position);
        let goes_on = speed > 0.0 && next.direction(self.target) * ahead > 0.0;
        // A circular axis takes its targets within a turn, and what lies beyond a limit is not passed.
        let range = axis.limits().range();
        if !goes_on || axis.travel().turn().is_some() || !range.contains(self.target) {
            return None;
        }
        // One raster step more, so that the stop has not begun in the step that passes the target.
        let way = way_left(speed, &profile) + speed * axis.period().seconds();
        Some((ahead, range.nearest(self.target + Position(ahead * way))))
    }
}

/// The way that is left of a stop from the profile velocity when it is down to `speed`, in counts; with a limited
/// jerk, of one that is in its first corner, on its slope or in its last corner.
fn way_left(speed: f64, profile: &Profile) -> f64 {
    let Some(jerk) = profile.jerk else { return speed * speed / (2.0 * profile.deceleration.0) };
    let (from, jerk) = (profile.velocity.0, jerk.0);
    let slope = profile.deceleration.0.min((from * jerk).sqrt());
    let corner = slope * slope / (2.0 * jerk);
    if from - speed < corner {
        let seconds = (2.0 * (from - speed) / jerk).sqrt();
        let whole = from / 2.0 * (from / slope + slope / jerk);
        whole - from * seconds + jerk * seconds * seconds * seconds / 6.0
    } else if speed > corner {
        (speed * speed - corner * corner) / (2.0 * slope) + slope * slope * slope / (6.0 * jerk * jerk)
    } else {
        speed * (2.0 * speed / jerk).sqrt() / 3.0
    }
}

#[cfg(test)]
mod tests {
    use axis::{Acceleration, Jerk};

    use super::*;

    /// The ways left of a stop, by small steps in time, with the speeds they belong to.
    fn stop(profile: &Profile) -> Vec<(f64, f64)> {
        const STEP: f64 = 1e-6;
        let (rate, jerk) = (profile.deceleration.0, profile.jerk.unwrap().0);
        let (mut speed, mut slope, mut way) = (profile.velocity.0, 0.0_f64, 0.0);
        let mut passed = vec![(speed, way)];
        while speed > 0.01 {
            let ends = slope * slope / (2.0 * jerk) >= speed;
            slope = if ends { slope - jerk * STEP } else { (slope + jerk * STEP).min(rate) };
            speed -= slope * STEP;
            way += speed * STEP;
            passed.push((speed, way));
        }
        passed.into_iter().map(|(speed, passed)| (speed, way - passed)).collect()
    }

    #[test]
    fn the_way_left_is_that_of_the_stop() {
        for (velocity, rate, jerk) in [(20_000.0, 1e5, 2e6), (2_000.0, 1e5, 2e6), (20_000.0, 1e5, 1e8)] {
            let profile = Profile {
                velocity: Velocity(velocity),
                deceleration: Acceleration(rate),
                jerk: Some(Jerk(jerk)),
                ..Profile::default()
            };
            for (speed, left) in stop(&profile).into_iter().step_by(1_000) {
                let way = way_left(speed, &profile);
                assert!((way - left).abs() < 0.5 + left / 200.0, "{velocity} {jerk}: {speed} {way} {left}");
            }
        }
    }
}
