//! Velocity mode (vl), as frequency converters have it (IEC 61800-7-201, velocity mode).
//!
//! Controlword bits 4 to 6 lead the ramp: without *enable ramp* the special function is in force, which is to run
//! down to standstill; without *unlock ramp* the output is locked where it is; without *reference ramp* the input is
//! zero.

use axis::{Acceleration, Profile, Velocity};

use super::ModeBits;
use crate::Binding;
use crate::cia402::rpm::RpmUnits;
use crate::cia402::{Context, Controlword, View};

/// What the ramp was last told.
#[derive(Debug, Default)]
pub(crate) struct VelocityMode {
    commanded: Option<(Velocity, Profile)>,
    is_locked: bool,
}

impl VelocityMode {
    pub(super) fn begin(&mut self, word: Controlword, context: &mut Context<'_>) {
        self.command(word, context);
    }

    /// Target and ramps take effect at once in this mode.
    pub(super) fn update(&mut self, word: Controlword, context: &mut Context<'_>) {
        self.command(word, context);
    }

    pub(super) fn control(&mut self, _: Controlword, new: Controlword, context: &mut Context<'_>) {
        self.command(new, context);
    }

    pub(super) fn halt(&mut self, _: &mut Context<'_>) {
        self.commanded = None;
        self.is_locked = false;
    }

    pub(super) fn resume(&mut self, word: Controlword, context: &mut Context<'_>) {
        self.command(word, context);
    }

    #[expect(clippy::unused_self, reason = "the same verbs for every mode")]
    pub(super) fn step(&mut self, _: Controlword, _: &mut Context<'_>) {}

    /// Bit 10: the output of the ramp has arrived at its input.
    pub(super) fn bits(&self, view: View<'_>) -> ModeBits {
        let is_reached = self.commanded.is_some() && !self.is_locked && view.axis.status().done;
        ModeBits { is_reached, ..ModeBits::default() }
    }

    /// Commands the axis if the input of the ramp or its slopes have changed.
    fn command(&mut self, word: Controlword, context: &mut Context<'_>) {
        if word.contains(Controlword::HALT) {
            return;
        }
        let input = self.input(word, context);
        let velocity = context.axis.limits().velocity;
        let [acceleration, deceleration] = [acceleration(context), deceleration(context)];
        let profile = Profile { velocity, acceleration, deceleration, jerk: None };
        if self.commanded != Some((input, profile)) {
            self.commanded = Some((input, profile));
            context.axis.run_at(input, profile);
        }
    }

    fn input(&mut self, word: Controlword, context: &Context<'_>) -> Velocity {
        let is_enabled = word.contains(Controlword::ENABLE_RAMP);
        let was_locked = self.is_locked;
        self.is_locked = is_enabled && !word.contains(Controlword::UNLOCK_RAMP);
        if self.is_locked {
            let locked = self.commanded.filter(|_| was_locked).map(|(velocity, _)| velocity);
            locked.unwrap_or(context.axis.status().demand.velocity)
        } else if is_enabled && word.contains(Controlword::REFERENCE_RAMP) {
            target(context)
        } else {
            Velocity(0.0)
        }
    }
}

/// The deceleration of the ramp, 0x6049.
pub(crate) fn deceleration(context: &Context<'_>) -> Acceleration {
    ramp(context, Binding::VlDecelerationSpeed, Binding::VlDecelerationTime)
}

/// The deceleration of a quick stop, 0x604A.
pub(crate) fn quick_stop(context: &Context<'_>) -> Acceleration {
    ramp(context, Binding::VlQuickStopSpeed, Binding::VlQuickStopTime)
}

fn acceleration(context: &Context<'_>) -> Acceleration {
    ramp(context, Binding::VlAccelerationSpeed, Binding::VlAccelerationTime)
}

fn ramp(context: &Context<'_>, speed: Binding, time: Binding) -> Acceleration {
    let units = RpmUnits::of(context.parameters, context.motor);
    units.ramp(context.parameters.or(speed, 0), context.parameters.or(time, 0))
}

fn target(context: &Context<'_>) -> Velocity {
    let value = |binding, assumed| context.parameters.or(binding, assumed);
    let amounts = (value(Binding::VlMinAmount, 0), value(Binding::VlMaxAmount, i64::from(u32::MAX)));
    RpmUnits::of(context.parameters, context.motor).target(value(Binding::VlTargetVelocity, 0), amounts)
}
