//! Breaking and repairing what is simulated behind the axes, and what comes to them from outside.

use od::Instant;
use profiles::{Device, NoPlant, PlantFault, Repair, Signal};

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
        self.change_plant(now, device, |device| device.inject(now, axis, fault))?;
        self.note_fault(now, device, axis, fault);
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
        self.change_plant(now, device, |device| device.repair(now, axis, repair))?;
        self.note_repair(now, device, axis, repair);
        Ok(())
    }

    /// Sets what comes from outside to the axis of this number (from 0) of a device, by its position.
    ///
    /// # Errors
    /// There is no such axis.
    pub fn set_signal(
        &mut self,
        now: Instant,
        device: usize,
        axis: usize,
        signal: Signal,
    ) -> Result<(), NoPlant> {
        self.change_plant(now, device, |device| device.set_signal(now, axis, signal))?;
        self.note_signal(now, device, axis, signal);
        Ok(())
    }

    /// Runs what is due before the change, and schedules the steps that it makes necessary.
    fn change_plant(
        &mut self,
        now: Instant,
        number: usize,
        change: impl FnOnce(&mut Device) -> Result<(), NoPlant>,
    ) -> Result<(), NoPlant> {
        if self.deadlines.is_due(number, now) {
            self.run_due(now, number);
        }
        let Unit { device, .. } = self.units.get_mut(number).ok_or(NoPlant)?;
        change(device)?;
        self.speak(now, number);
        self.pass(now);
        Ok(())
    }
}
