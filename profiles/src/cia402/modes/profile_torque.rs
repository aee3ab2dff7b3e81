//! Profile torque mode (IEC 61800-7-201, profile torque mode).

use axis::{Order, Torque};

use super::ModeBits;
use crate::Binding;
use crate::cia402::{Context, Controlword, View};

/// The torque that was ordered, and its change per second.
#[derive(Debug, Default)]
pub(crate) struct ProfileTorque {
    commanded: Option<(Torque, Torque)>,
    rest: Rest,
}

/// Whether the mode gives a torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Rest {
    /// It does.
    #[default]
    No,
    /// The torque goes to zero; then the axis stops.
    Easing,
    /// The axis stops or stands.
    Yes,
}

impl ProfileTorque {
    /// How near to its target a torque is reached, in per mille of the rated torque.
    const WINDOW: Torque = Torque(5.0);

    pub(super) fn begin(&mut self, word: Controlword, context: &mut Context<'_>) {
        if word.contains(Controlword::HALT) {
            self.suspend();
        } else {
            self.command(context);
        }
    }

    /// Target and slope take effect at once.
    pub(super) fn update(&mut self, _: Controlword, context: &mut Context<'_>) {
        self.command(context);
    }

    #[expect(clippy::unused_self, reason = "the same verbs for every mode")]
    pub(super) fn control(&mut self, _: Controlword, _: Controlword, _: &mut Context<'_>) {}

    pub(super) fn suspend(&mut self) {
        *self = Self { commanded: None, rest: Rest::Yes };
    }

    /// With 0x605D = 1 the torque goes to zero by its slope before the axis stops; otherwise it stops at once, as it has
    /// been told.
    pub(super) fn halt(&mut self, context: &mut Context<'_>) {
        let is_pushing = self.commanded.is_some();
        self.suspend();
        if is_pushing && context.parameters.or(Binding::HaltOption, 1) == 1 {
            context.axis.order(Order::Push { torque: Torque(0.0), slope: slope(context) });
            self.rest = Rest::Easing;
        }
    }

    pub(super) fn resume(&mut self, _: Controlword, context: &mut Context<'_>) {
        *self = Self::default();
        self.command(context);
    }

    /// Follows the axis after a raster step.
    pub(super) fn step(&mut self, _: Controlword, context: &mut Context<'_>) {
        if self.rest == Rest::Easing && context.axis.status().done {
            self.rest = Rest::Yes;
            context.axis.stop(context.slow_down_ramp());
        }
    }

    /// Bit 10: the torque is at its target, as far as the torque limit lets it.
    pub(super) fn bits(&self, view: View<'_>) -> ModeBits {
        let status = view.axis.status();
        let is_given = (view.axis.torque_demand() - status.actual.torque).abs() <= Self::WINDOW;
        let is_reached = self.rest == Rest::No && status.done && !status.limited && is_given;
        ModeBits { is_reached, ..ModeBits::default() }
    }

    /// Orders the torque if it or its slope has changed.
    fn command(&mut self, context: &mut Context<'_>) {
        if self.rest != Rest::No {
            return;
        }
        let torque = context.parameters.units.torque(context.parameters.or(Binding::TargetTorque, 0));
        let slope = slope(context);
        if self.commanded != Some((torque, slope)) {
            self.commanded = Some((torque, slope));
            context.axis.order(Order::Push { torque, slope });
        }
    }
}

/// 0x6087, in per mille of the rated torque per second; zero is at once.
fn slope(context: &Context<'_>) -> Torque {
    context.parameters.units.torque(context.parameters.or(Binding::TorqueSlope, 0))
}
