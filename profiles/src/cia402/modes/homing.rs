//! Homing mode: start, interruption and result (IEC 61800-7-201, homing mode).
//!
//! The zero position is the home position plus the home offset 0x607C, so the home position is shown as minus the
//! offset. The axis ends at the home position; JVL's ends at the zero position, as their manual wants an offset that
//! leads away from the end limit (module manual, section 4.3.25).

mod method;
mod search;

use axis::{Acceleration, Limits, Position, Profile, Torque, TorqueLimit, Velocity};

use super::ModeBits;
use crate::cia402::{Context, Controlword, View};
use crate::{Binding, Dialect};

use method::Method;
use search::{Outcome, Pace, Search};

pub(crate) use method::is_method;

/// How far homing is.
#[derive(Debug, Default)]
pub(crate) struct Homing {
    phase: Phase,
    /// The limits are those of homing.
    has_own_limits: bool,
}

#[derive(Debug)]
enum Phase {
    /// Not started, or interrupted.
    Waiting {
        /// The result of an earlier start still holds.
        is_attained: bool,
    },
    Searching(Search),
    /// Goes on after the halt, from its beginning.
    Halted,
    /// The home position is known.
    Attained {
        /// Where the axis comes to rest.
        end: Position,
        is_there: bool,
    },
    Failed,
}

impl Default for Phase {
    fn default() -> Self {
        Self::Waiting { is_attained: false }
    }
}

impl Homing {
    /// Homing waits for a rising edge of its start bit. An earlier one may have left its limits behind.
    pub(super) fn begin(&mut self, _: Controlword, context: &mut Context<'_>) {
        self.phase = Phase::Waiting { is_attained: *context.is_referenced };
        context.apply_limits();
    }

    /// Parameters act with the next start; limits that were written do not change those of homing.
    pub(super) fn update(&mut self, _: Controlword, context: &mut Context<'_>) {
        if self.has_own_limits {
            apply_own_limits(context);
        }
    }

    /// A rising start bit starts, a falling one interrupts the search. Once home is found the bit no longer matters.
    pub(super) fn control(&mut self, old: Controlword, new: Controlword, context: &mut Context<'_>) {
        let (was, is) = (old.contains(Controlword::HOMING_START), new.contains(Controlword::HOMING_START));
        if is && !was && new.contains(Controlword::HALT) {
            self.phase = Phase::Halted;
        } else if is && !was {
            self.start(context);
        } else if was && !is {
            match self.phase {
                Phase::Searching(_) => {
                    context.axis.stop(ramp(context));
                    self.phase = Phase::default();
                }
                Phase::Halted => self.phase = Phase::default(),
                Phase::Waiting { .. } | Phase::Attained { .. } | Phase::Failed => {}
            }
        }
    }

    /// The search is given up.
    pub(super) fn halt(&mut self, _: &mut Context<'_>) {
        if matches!(self.phase, Phase::Searching(_)) {
            self.phase = Phase::Halted;
        }
    }

    /// Starts again, or goes on to where homing ends.
    pub(super) fn resume(&mut self, word: Controlword, context: &mut Context<'_>) {
        match self.phase {
            Phase::Halted if word.contains(Controlword::HOMING_START) => self.start(context),
            Phase::Attained { end, is_there: false } => go_to(end, context),
            Phase::Halted
            | Phase::Waiting { .. }
            | Phase::Searching(_)
            | Phase::Attained { .. }
            | Phase::Failed => {}
        }
    }

    /// Follows the axis after a raster step.
    pub(super) fn step(&mut self, word: Controlword, context: &mut Context<'_>) {
        let is_done = context.axis.status().done;
        match &mut self.phase {
            Phase::Searching(search) => match search.step(context.axis) {
                Outcome::Pending => {}
                Outcome::Found(mark) => self.attain(mark, context),
                Outcome::Lost => self.phase = Phase::Failed,
                Outcome::Interrupted => self.phase = Phase::default(),
            },
            Phase::Attained { is_there, .. } => *is_there |= is_done && !word.contains(Controlword::HALT),
            Phase::Waiting { .. } | Phase::Halted | Phase::Failed => {}
        }
        if self.has_own_limits && is_done && !self.is_under_way() {
            self.has_own_limits = false;
            context.apply_limits();
        }
    }

    /// Bits 10, 12 and 13 by the standard's table: in progress (none), interrupted or not started (10), attained
    /// (12) and completed (10 and 12), error while moving (13) and at standstill (10 and 13).
    pub(super) fn bits(&self, view: View<'_>) -> ModeBits {
        let is_done = view.axis.status().done;
        let (is_reached, bit_12, bit_13) = match self.phase {
            Phase::Searching(_) => (false, false, false),
            Phase::Waiting { is_attained } => (is_done, is_attained, false),
            Phase::Halted => (is_done, false, false),
            Phase::Attained { is_there, .. } => (is_there, true, false),
            Phase::Failed => (is_done, false, true),
        };
        ModeBits { is_reached, bit_12, bit_13 }
    }

    /// Whether the home position is known and the axis has come to rest.
    pub(super) fn is_completed(&self) -> bool {
        matches!(self.phase, Phase::Waiting { is_attained: true } | Phase::Attained { is_there: true, .. })
    }

    fn is_under_way(&self) -> bool {
        match self.phase {
            Phase::Searching(_) | Phase::Attained { is_there: false, .. } => true,
            Phase::Waiting { .. } | Phase::Halted | Phase::Attained { .. } | Phase::Failed => false,
        }
    }

    fn start(&mut self, context: &mut Context<'_>) {
        *context.is_referenced = false;
        let method = Method::of(context.parameters.or(Binding::HomingMethod, 0));
        let search = method.and_then(|method| Search::new(method, pace(context)));
        context.axis.stop(ramp(context));
        self.phase = search.map_or(Phase::Failed, Phase::Searching);
        self.has_own_limits = true;
        apply_own_limits(context);
    }

    /// Home is at `mark`: the axis gets its coordinates and goes where homing ends.
    fn attain(&mut self, mark: Position, context: &mut Context<'_>) {
        const ORIGIN: Position = Position(0.0);
        let Context { parameters, axis, dialect, .. } = context;
        let offset = parameters.or(Binding::HomeOffset, 0);
        let home = parameters.units.position(-offset, ORIGIN);
        axis.set_position(axis.status().actual.position - mark + home);
        *context.is_referenced = true;
        let end = match dialect {
            Dialect::Cia402 | Dialect::Mac4(_) => home,
            Dialect::Jvl => parameters.units.position(0, ORIGIN),
        };
        go_to(end, context);
        self.phase = Phase::Attained { end, is_there: false };
    }
}

fn go_to(end: Position, context: &mut Context<'_>) {
    let ramp = ramp(context);
    let profile =
        Profile { velocity: pace(context).fast, acceleration: ramp, deceleration: ramp, jerk: None };
    context.axis.move_to(end, profile);
}

/// Lifts the position limits, as they count from a home position yet to be found, and limits the torque as JVL's
/// drives do.
fn apply_own_limits(context: &mut Context<'_>) {
    let Context { parameters, axis, .. } = context;
    let limits = Limits { position: None, ..*axis.limits() };
    axis.set_limits(limits);
    if let Some(torque) = parameters.get(Binding::JvlHomingTorque) {
        axis.set_torque_limit(TorqueLimit::both(parameters.units.torque(torque)));
    }
}

fn ramp(context: &Context<'_>) -> Acceleration {
    context.parameters.units.acceleration(context.parameters.or(Binding::HomingAcceleration, 0))
}

fn pace(context: &Context<'_>) -> Pace {
    let Context { parameters, motor, .. } = context;
    let speed = |binding| -> Velocity { parameters.units.velocity(parameters.or(binding, 0)).abs() };
    let most = context.axis.limits().torque;
    let torque =
        parameters.get(Binding::JvlHomingTorque).map_or(most, |limit| parameters.units.torque(limit));
    Pace {
        fast: speed(Binding::HomingSwitchSpeed),
        slow: speed(Binding::HomingZeroSpeed),
        ramp: ramp(context),
        torque: Torque(torque.0.min(most.0)),
        revolution: Position(f64::from(motor.counts_per_revolution)),
    }
}
