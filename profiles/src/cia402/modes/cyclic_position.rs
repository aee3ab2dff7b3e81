//! Cyclic synchronous position mode (IEC 61800-7-201): the master shapes the motion, the drive interpolates.

use axis::{Order, Position};

use super::ModeBits;
use super::cyclic::{Lapse, Stream, feed_forward, time_of};
use crate::Binding;
use crate::cia402::{Context, Controlword, SetPoints, View};

/// The last set-point and how it changed.
#[derive(Debug, Default)]
pub(crate) struct CyclicPosition {
    stream: Stream,
    target: Option<Position>,
    /// From the set-point before it to the last one.
    change: Position,
}

impl CyclicPosition {
    /// The axis holds where it is until a set-point comes.
    pub(super) fn begin(&mut self, word: Controlword, _: &mut Context<'_>) {
        if word.contains(Controlword::HALT) {
            self.suspend();
        }
    }

    /// A target that was written is a set-point, also with the value it had.
    pub(super) fn update(&mut self, _: Controlword, context: &mut Context<'_>) {
        if !self.stream.is_open() {
            return;
        }
        if context.written.contains(SetPoints::POSITION) {
            self.take(context);
        }
        if self.stream.is_followed() {
            context.axis.feed_forward(feed_forward(context.parameters));
        }
    }

    #[expect(clippy::unused_self, reason = "the same verbs for every mode")]
    pub(super) fn control(&mut self, _: Controlword, _: Controlword, _: &mut Context<'_>) {}

    pub(super) fn suspend(&mut self) {
        self.stream.shut();
        self.target = None;
    }

    pub(super) fn halt(&mut self, _: &mut Context<'_>) {
        self.suspend();
    }

    /// The axis stands until the next set-point.
    pub(super) fn resume(&mut self, _: Controlword, _: &mut Context<'_>) {
        self.stream.open();
    }

    /// Follows the axis after a raster step.
    pub(super) fn step(&mut self, _: Controlword, context: &mut Context<'_>) {
        match self.stream.step() {
            Lapse::None => {}
            Lapse::Extend(over) => {
                if let Some(target) = self.target {
                    context.axis.order(Order::TrackPosition { target: target + self.change, over });
                    context.axis.feed_forward(feed_forward(context.parameters));
                }
            }
            Lapse::Break => {
                self.target = None;
                context.axis.stop(context.quick_stop_ramp());
            }
        }
    }

    /// Bit 12: the drive follows its set-points. Bit 13: they are too far ahead of the axis. Bit 10 is reserved.
    pub(super) fn bits(&self, view: View<'_>) -> ModeBits {
        ModeBits { is_reached: false, bit_12: self.stream.is_followed(), bit_13: has_following_error(view) }
    }

    fn take(&mut self, context: &mut Context<'_>) {
        let over = self.stream.arrive(time_of(context));
        let Context { parameters, axis, .. } = context;
        let place = parameters
            .units
            .position(parameters.or(Binding::TargetPosition, 0), axis.status().demand.position);
        let target = place + parameters.units.way(parameters.or(Binding::PositionOffset, 0));
        let before = self.target.replace(target).filter(|_| self.stream.is_steady());
        self.change = before.map_or(Position(0.0), |before| target - before);
        axis.order(Order::TrackPosition { target, over });
    }
}

/// Whether the axis is further behind than 0x6065 allows.
fn has_following_error(view: View<'_>) -> bool {
    let window = view.parameters.get(Binding::FollowingErrorWindow).filter(|w| *w != i64::from(u32::MAX));
    let error = view.axis.status().following_error.abs();
    window.is_some_and(|window| error > view.parameters.units.distance(window))
}
