//! Interpolated position mode (IEC 61800-7-201): positions from a buffer, joined by straight lines.
//!
//! Each record is reached an interpolation time (0x60C2) after the one before it. An empty buffer means hold. Bit 4 of the
//! controlword lets it run; records that come before wait, and taking the bit back stops the axis and empties the
//! buffer.

use std::collections::VecDeque;

use axis::{Order, Position};

use super::ModeBits;
use super::cyclic::time_of;
use crate::Binding;
use crate::cia402::{Context, Controlword, SetPoints, View};
use crate::slots::Parameters;

/// Bit 4 of the controlword in this mode.
const ENABLE: Controlword = Controlword::NEW_SET_POINT;

/// The buffer, and how far the line to the last record has come.
#[derive(Debug, Default)]
pub(crate) struct Interpolated {
    records: VecDeque<i64>,
    is_active: bool,
    is_shut: bool,
    /// Raster steps until the last record is reached.
    left: u32,
}

impl Interpolated {
    /// Records that the longest buffer holds.
    const LONGEST: usize = 16;

    pub(super) fn begin(&mut self, word: Controlword, _: &mut Context<'_>) {
        self.is_shut = word.contains(Controlword::HALT);
        self.is_active = word.contains(ENABLE) && !self.is_shut;
    }

    /// Buffers a record that was written.
    pub(super) fn update(&mut self, _: Controlword, context: &mut Context<'_>) {
        if context.parameters.or(Binding::InterpolationBufferClear, 1) == 0 {
            self.records.clear();
        } else if !self.is_shut && context.written.contains(SetPoints::RECORD) {
            self.buffer(context.parameters);
            self.go_on(context);
        }
    }

    pub(super) fn control(&mut self, old: Controlword, new: Controlword, context: &mut Context<'_>) {
        let (was, is) = (old.contains(ENABLE), new.contains(ENABLE));
        if is && !new.contains(Controlword::HALT) && !self.is_active {
            self.is_active = true;
            self.go_on(context);
        } else if was && !is {
            self.suspend();
            self.is_shut = false;
            context.axis.stop(context.slow_down_ramp());
        }
    }

    pub(super) fn suspend(&mut self) {
        *self = Self { is_shut: true, ..Self::default() };
    }

    pub(super) fn halt(&mut self, _: &mut Context<'_>) {
        self.suspend();
    }

    pub(super) fn resume(&mut self, word: Controlword, context: &mut Context<'_>) {
        self.begin(word, context);
    }

    /// Follows the axis after a raster step.
    pub(super) fn step(&mut self, _: Controlword, context: &mut Context<'_>) {
        self.left = self.left.saturating_sub(1);
        self.go_on(context);
    }

    /// Bit 10: the last record is reached. Bit 12: the mode is active.
    pub(super) fn bits(&self, view: View<'_>) -> ModeBits {
        let is_over = self.left == 0 && self.records.is_empty();
        ModeBits { is_reached: is_over && view.axis.status().done, bit_12: self.is_active, bit_13: false }
    }

    /// How many records wait.
    pub(super) fn waiting(&self) -> usize {
        self.records.len()
    }

    /// A full buffer gives up its oldest record as a ring, otherwise its newest one.
    fn buffer(&mut self, parameters: Parameters<'_>) {
        const RING: i64 = 1;
        let size = usize::try_from(parameters.or(Binding::InterpolationBufferSize, 1)).unwrap_or(1);
        let is_ring = parameters.or(Binding::InterpolationBufferOrganisation, 0) == RING;
        while self.records.len() >= size.clamp(1, Self::LONGEST) {
            let _ = if is_ring { self.records.pop_front() } else { self.records.pop_back() };
        }
        self.records.push_back(parameters.or(Binding::InterpolationRecord, 0));
    }

    /// Begins the line to the next record once the one before is done.
    fn go_on(&mut self, context: &mut Context<'_>) {
        if !self.is_active || self.left > 0 {
            return;
        }
        let Some(record) = self.records.pop_front() else { return };
        let over = time_of(context);
        let Context { parameters, axis, .. } = context;
        let target: Position = parameters.units.position(record, axis.status().demand.position);
        axis.order(Order::TrackPosition { target, over });
        self.left = over.get();
    }
}
