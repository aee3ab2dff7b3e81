//! Breaking and repairing what is simulated behind the axes.

use od::Instant;
use profiles::{NoPlant, PlantFault, Repair};

use super::{Core, Unit};

impl Core {
    /// Breaks something behind the axis of this number (from 0) of a device, by its position.
    ///
    /// # Errors
    /// Nothing is simulated there.
    pub fn inject(
        &mut self,
        now: Instant,
        device: usize,
        axis: usize,
        fault: PlantFault,
    ) -> Result<(), NoPlant> {
        self.catch_up(now, device);
        let Unit { device: unit, .. } = self.units.get_mut(device).ok_or(NoPlant)?;
        unit.inject(now, axis, fault)?;
        self.speak(now, device);
        self.pass(now);
        Ok(())
    }

    /// Repairs what is broken behind the axis of this number (from 0) of a device, by its position.
    ///
    /// # Errors
    /// Nothing is simulated there.
    pub fn repair(
        &mut self,
        now: Instant,
        device: usize,
        axis: usize,
        repair: Repair,
    ) -> Result<(), NoPlant> {
        self.catch_up(now, device);
        let Unit { device: unit, .. } = self.units.get_mut(device).ok_or(NoPlant)?;
        unit.repair(now, axis, repair)?;
        self.speak(now, device);
        self.pass(now);
        Ok(())
    }

    /// What is due before runs before.
    fn catch_up(&mut self, now: Instant, device: usize) {
        if self.deadlines.is_due(device, now) {
            self.run_due(now, device);
        }
    }
}
