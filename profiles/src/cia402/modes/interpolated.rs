//! Interpolated position mode.

use super::ModeBits;
use crate::cia402::{Context, Controlword, View};

/// Interpolated position mode.
#[derive(Debug, Default)]
pub(crate) struct Interpolated {}

impl Interpolated {
    pub(super) fn begin(&mut self, _word: Controlword, _context: &mut Context<'_>) {}

    pub(super) fn update(&mut self, _word: Controlword, _context: &mut Context<'_>) {}

    pub(super) fn control(&mut self, _old: Controlword, _new: Controlword, _context: &mut Context<'_>) {}

    pub(super) fn halt(&mut self, _context: &mut Context<'_>) {}

    pub(super) fn resume(&mut self, _word: Controlword, _context: &mut Context<'_>) {}

    pub(super) fn step(&mut self, _word: Controlword, _context: &mut Context<'_>) {}

    pub(super) fn bits(&self, _view: View<'_>) -> ModeBits {
        ModeBits::default()
    }
}
