//! The position modes: to P_SOLL, to P1 or P2 by the level of the analogue input, to a place by its voltage.

use axis::Position;

use super::Demand;
use crate::Role;
use crate::jvl::motor::mode::Mode;
use crate::jvl::motor::{Sample, groups};
use crate::jvl::units::MacUnits;

/// Where a position mode goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Goal {
    /// To P_SOLL.
    Target,
    /// To P1 or P2.
    OneOfTwo,
    /// To a share of P_SOLL.
    Share,
}

/// A position mode.
#[derive(Debug)]
pub(crate) struct Positioning {
    goal: Goal,
    /// Where the motor goes. It differs from P_SOLL by the distances that were for the generator alone.
    target: Position,
    /// P_SOLL when the target was taken from it.
    taken: i32,
    /// The level of the analogue input that P1 or P2 was chosen by.
    level: Option<bool>,
}

impl Positioning {
    /// The mode from where the axis is.
    pub(super) fn new(goal: Goal, sample: &Sample<'_, '_>) -> Self {
        let mut new = Self { goal, target: Position(0.0), taken: 0, level: None };
        new.retarget(sample);
        new
    }

    pub(super) fn mode(&self) -> Mode {
        match self.goal {
            Goal::Target => Mode::Position,
            Goal::OneOfTwo => Mode::AnalogBiPosition,
            Goal::Share => Mode::AnalogPosition,
        }
    }

    pub(super) fn target(&self) -> Position {
        self.target
    }

    /// Takes P_SOLL for the target.
    pub(super) fn retarget(&mut self, sample: &Sample<'_, '_>) {
        self.taken = sample.register(Role::PSoll);
        self.target = MacUnits::place(self.taken, sample.axis().status().demand.position);
    }

    /// The target lies farther on, P_SOLL stays.
    pub(super) fn extend(&mut self, distance: i32) {
        self.target = self.target + Position(f64::from(distance));
    }

    /// In bi-position mode a change of level activates P1 (low) or P2 (high), and so does the begin.
    pub(super) fn step(&mut self, sample: &mut Sample<'_, '_>) {
        if self.goal == Goal::OneOfTwo {
            let level = sample.is_analog_high;
            if self.level.replace(level) != Some(level) {
                let chosen = if level { Role::Pos1 } else { Role::Pos0 };
                match groups::activate_place(sample, chosen) {
                    0 => self.retarget(sample),
                    distance => self.extend(distance),
                }
            }
        }
    }

    pub(super) fn demand(&mut self, sample: &mut Sample<'_, '_>) -> Demand {
        if self.level.is_none() {
            self.step(sample);
        }
        if self.goal == Goal::Share {
            let whole = f64::from(sample.register(Role::PSoll));
            self.target = Position((whole * MacUnits::share(sample.analog)).round());
        } else {
            self.retarget_if_changed(sample);
        }
        Demand::Place(self.target, sample.profile())
    }

    fn retarget_if_changed(&mut self, sample: &Sample<'_, '_>) {
        if sample.register(Role::PSoll) != self.taken {
            self.retarget(sample);
        }
    }
}
