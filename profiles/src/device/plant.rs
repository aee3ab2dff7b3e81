//! Breaking and repairing the simulated plants of a device, and what comes to its axes from outside.

use od::Instant;
use thiserror::Error;

use super::Device;
use crate::{PlantFault, Repair, Signal, Velocity, Voltage};

/// There is no such axis, or it is no simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the device has no simulated axis of this number")]
pub struct NoPlant;

impl Device {
    /// Breaks something behind the axis of this number (from 0); the axis meets it in its next raster step, for which
    /// it wakes if it sleeps.
    ///
    /// # Errors
    /// Nothing is simulated there.
    pub fn inject(&mut self, now: Instant, axis: usize, fault: PlantFault) -> Result<(), NoPlant> {
        let unit = self.units.get_mut(axis).ok_or(NoPlant)?;
        unit.axis.plant().ok_or(NoPlant)?.inject(fault.0);
        unit.schedule(now);
        Ok(())
    }

    /// Repairs what is broken behind the axis of this number (from 0). What is whole stays so.
    ///
    /// # Errors
    /// Nothing is simulated there.
    pub fn repair(&mut self, now: Instant, axis: usize, repair: Repair) -> Result<(), NoPlant> {
        let unit = self.units.get_mut(axis).ok_or(NoPlant)?;
        let plant = unit.axis.plant().ok_or(NoPlant)?;
        match repair {
            Repair::One(PlantFault(fault)) => plant.clear(fault),
            Repair::All => {
                let broken: Vec<_> = plant.faults().collect();
                broken.into_iter().for_each(|fault| plant.clear(fault));
            }
        }
        unit.schedule(now);
        Ok(())
    }

    /// Sets what comes to the axis of this number (from 0) from outside of its machine.
    ///
    /// # Errors
    /// There is no such axis.
    pub fn set_signal(&mut self, now: Instant, axis: usize, signal: Signal) -> Result<(), NoPlant> {
        if axis >= self.units.len() {
            return Err(NoPlant);
        }
        match signal {
            Signal::AnalogInput(voltage) => self.set_analog_input(axis, voltage, now),
            Signal::ExternalEncoder(velocity) => self.set_external_encoder(axis, velocity, now),
        }
        Ok(())
    }

    /// The voltage at the analogue input of the axis of this number (from 0), and the speed of its external encoder.
    #[must_use]
    pub fn signals(&self, axis: usize) -> Option<(Voltage, Velocity)> {
        self.units.get(axis).map(|unit| (unit.analog_input, unit.external_encoder))
    }

    /// What is broken behind the axis of this number (from 0), by order or by schedule.
    pub fn plant_faults(&self, axis: usize) -> impl Iterator<Item = PlantFault> {
        let plant = self.units.get(axis).and_then(|unit| unit.axis.plant_view());
        plant.into_iter().flat_map(|plant| plant.faults().map(PlantFault))
    }
}
