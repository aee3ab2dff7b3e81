//! The power stage of a simulated drive: on, off, and tripped.

use crate::drive::{Command, DriveFault, DriveState};
use crate::plant::Plant;

/// Follows the enable command, which takes its time, and keeps a fault until it is reset.
#[derive(Clone, Debug)]
pub(crate) struct PowerStage {
    state: DriveState,
    enabling_steps: u32,
    enabling_left: u32,
}

impl PowerStage {
    /// A stage that is off; switching it on takes so many raster steps.
    pub(crate) fn new(enabling_steps: u32) -> Self {
        Self { state: DriveState::Disabled, enabling_steps, enabling_left: 0 }
    }

    /// Obeys the command, as far as it comes through, with the electronics tripping on the fault of `plant`; whether the
    /// power has just come on. When the connection is there again the stage is off.
    pub(crate) fn switch(&mut self, command: &Command, plant: &Plant) -> bool {
        let can_reset = command.reset_fault && plant.fault().is_none();
        let before = self.state;
        self.state = match (self.state, command.enable) {
            (_, _) if !plant.is_connected() => DriveState::Lost,
            (DriveState::Fault(_), _) if can_reset => DriveState::Disabled,
            (fault @ DriveState::Fault(_), _) => fault,
            (DriveState::Lost, _) => DriveState::Disabled,
            (_, false) => DriveState::Disabled,
            (DriveState::Enabled, true) => DriveState::Enabled,
            (DriveState::NotReady | DriveState::Disabled, true) => self.enable(self.enabling_steps),
            (DriveState::Enabling, true) => self.enable(self.enabling_left),
        };
        self.is_on() && before != DriveState::Enabled
    }

    /// Switches off because of `cause`, unless it did so before.
    pub(crate) fn trip(&mut self, cause: DriveFault) {
        self.state = match self.state {
            kept @ (DriveState::Fault(_) | DriveState::Lost) => kept,
            DriveState::NotReady | DriveState::Disabled | DriveState::Enabling | DriveState::Enabled => {
                DriveState::Fault(cause)
            }
        };
    }

    /// Whether there is power.
    pub(crate) fn is_on(&self) -> bool {
        self.state == DriveState::Enabled
    }

    /// What the drive reports.
    pub(crate) fn state(&self) -> DriveState {
        self.state
    }

    fn enable(&mut self, left: u32) -> DriveState {
        match left.checked_sub(1) {
            Some(left) => {
                self.enabling_left = left;
                DriveState::Enabling
            }
            None => DriveState::Enabled,
        }
    }
}
