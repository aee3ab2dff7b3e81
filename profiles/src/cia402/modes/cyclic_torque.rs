//! Cyclic synchronous torque mode (IEC 61800-7-201).

use axis::{Order, Torque};

use super::ModeBits;
use super::cyclic::{Lapse, Stream, time_of, torque_offset};
use crate::Binding;
use crate::cia402::{Context, Controlword, SetPoints, View};

/// How old the last torque is.
#[derive(Debug, Default)]
pub(crate) struct CyclicTorque {
    stream: Stream,
}

impl CyclicTorque {
    /// The axis holds where it is until a set-point comes.
    pub(super) fn begin(&mut self, word: Controlword, _: &mut Context<'_>) {
        if word.contains(Controlword::HALT) {
            self.suspend();
        }
    }

    /// A torque that was written is a set-point, also with the value it had.
    pub(super) fn update(&mut self, _: Controlword, context: &mut Context<'_>) {
        if self.stream.is_open() && context.written.contains(SetPoints::TORQUE) {
            let over = self.stream.arrive(time_of(context));
            let Context { parameters, axis, .. } = context;
            let target = parameters.units.torque(parameters.or(Binding::TargetTorque, 0));
            let torque = target + torque_offset(*parameters);
            let time = f64::from(over.get()) * axis.period().seconds();
            let slope = Torque((torque - axis.torque_demand()).abs().0 / time);
            axis.order(Order::Push { torque, slope });
        }
    }

    #[expect(clippy::unused_self, reason = "the same verbs for every mode")]
    pub(super) fn control(&mut self, _: Controlword, _: Controlword, _: &mut Context<'_>) {}

    pub(super) fn suspend(&mut self) {
        self.stream.shut();
    }

    pub(super) fn halt(&mut self, _: &mut Context<'_>) {
        self.suspend();
    }

    /// The axis stands until the next set-point.
    pub(super) fn resume(&mut self, _: Controlword, _: &mut Context<'_>) {
        self.stream.open();
    }

    /// Follows the axis after a raster step. A stream that goes on keeps its torque, which the axis does by itself.
    pub(super) fn step(&mut self, _: Controlword, context: &mut Context<'_>) {
        if self.stream.step() == Lapse::Break {
            context.axis.stop(context.quick_stop_ramp());
        }
    }

    /// Bit 12: the drive follows its set-points. Bit 10 is reserved.
    pub(super) fn bits(&self, _: View<'_>) -> ModeBits {
        ModeBits { bit_12: self.stream.is_followed(), ..ModeBits::default() }
    }
}
