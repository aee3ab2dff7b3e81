//! A lower torque at standstill, as stepper motors have it so that they stay cool.

use super::{Axis, Task};
use crate::limits::TorqueLimit;
use crate::units::Torque;

/// When the torque falls at standstill, and to what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standby {
    /// Raster steps without a motion, after which it falls.
    pub after: u32,
    /// The highest torque then, a magnitude.
    pub limit: Torque,
}

/// How long an axis has stood, with what it gives then.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Standing {
    pub(super) standby: Option<Standby>,
    steps: u32,
}

impl Standing {
    /// The torque at standstill, if it has fallen.
    pub(super) fn limit(&self) -> Option<TorqueLimit> {
        let standby = self.standby.filter(|standby| self.steps > standby.after)?;
        Some(TorqueLimit::both(standby.limit))
    }
}

impl Axis {
    /// Lets the torque fall at standstill, or no longer. A motion that begins has its full torque from the start.
    pub fn set_standby(&mut self, standby: Option<Standby>) {
        self.standing.standby = standby;
    }

    /// Counts the raster steps that the axis holds its place with power.
    pub(super) fn stand(&mut self) {
        let holds = match &self.task {
            Task::Follow => self.is_running() && !self.is_moving(),
            Task::Seek(_) | Task::Push(_) | Task::Output(_) | Task::Brake { .. } => false,
        };
        self.standing.steps = if holds { self.standing.steps.saturating_add(1) } else { 0 };
    }
}
