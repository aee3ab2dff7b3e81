//! Cyclic synchronous velocity mode (IEC 61800-7-201).

use axis::{FeedForward, Order};

use super::ModeBits;
use super::cyclic::{Lapse, Stream, time_of, torque_offset, velocity_offset};
use crate::Binding;
use crate::cia402::{Context, Controlword, SetPoints, View};

/// How old the last velocity is.
#[derive(Debug, Default)]
pub(crate) struct CyclicVelocity {
    stream: Stream,
}

impl CyclicVelocity {
    /// The axis stands until a set-point comes.
    pub(super) fn begin(&mut self, word: Controlword, _: &mut Context<'_>) {
        if word.contains(Controlword::HALT) {
            self.suspend();
        }
    }

    /// A velocity that was written is a set-point, also with the value it had.
    pub(super) fn update(&mut self, _: Controlword, context: &mut Context<'_>) {
        if !self.stream.is_open() {
            return;
        }
        if context.written.contains(SetPoints::VELOCITY) {
            let over = self.stream.arrive(time_of(context));
            let Context { parameters, axis, .. } = context;
            let target = parameters.units.target_velocity(parameters.or(Binding::TargetVelocity, 0));
            axis.order(Order::TrackVelocity { target: target + velocity_offset(*parameters), over });
        }
        if self.stream.is_followed() {
            let torque = torque_offset(context.parameters);
            context.axis.feed_forward(FeedForward { torque, ..FeedForward::default() });
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

    /// Follows the axis after a raster step. A stream that goes on keeps its velocity, which the axis does by itself.
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
