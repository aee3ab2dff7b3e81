//! Who may command an axis: what the configuration says, until somebody claims it.

use od::{Instant, Origin, Owner};
use thiserror::Error;

use super::audit::{AuditEntry, What};
use super::trail::{Command, Who};
use super::{Core, LinkId, Unit};

/// There is no such device or axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("there is no such axis")]
pub struct NoAxis;

impl Core {
    /// Makes `owner` the one who may command the axes of `device` whenever nobody has claimed them; `None` for everybody.
    pub fn set_owner(&mut self, device: usize, owner: Option<Owner>) {
        self.units.get_mut(device).into_iter().for_each(|unit| unit.set_owner(owner));
    }

    /// Claims an axis of a device for `owner`; nobody else commands it until it is released or claimed again.
    ///
    /// # Errors
    /// There is no such axis.
    pub fn claim(&mut self, device: usize, axis: usize, owner: Owner) -> Result<(), NoAxis> {
        self.give(device, axis, |_| Some(owner))
    }

    /// Gives an axis back to whom the configuration names.
    ///
    /// # Errors
    /// There is no such axis.
    pub fn release(&mut self, device: usize, axis: usize) -> Result<(), NoAxis> {
        self.give(device, axis, |unit| unit.owner)
    }

    /// Who alone may command an axis; `None` for everybody.
    #[must_use]
    pub fn owner(&self, device: usize, axis: usize) -> Option<Owner> {
        let dictionary = self.units.get(device)?.device.dictionary();
        dictionary.owner(u8::try_from(axis).ok()?)
    }

    /// The last commands that a device was given, the newest first.
    #[must_use]
    pub fn commands(&self, device: usize) -> Vec<Command> {
        self.units.get(device).map(|unit| unit.trail.commands()).unwrap_or_default()
    }

    fn give(
        &mut self,
        device: usize,
        axis: usize,
        owner: impl FnOnce(&Unit) -> Option<Owner>,
    ) -> Result<(), NoAxis> {
        let unit = self.units.get_mut(device).ok_or(NoAxis)?;
        let number = u8::try_from(axis).map_err(|_| NoAxis)?;
        if number >= unit.device.profile().axes() {
            return Err(NoAxis);
        }
        let owner = owner(unit);
        unit.device.dictionary_mut().set_owner(number, owner);
        Ok(())
    }

    /// Takes note of the commands that were just written to a device.
    pub(super) fn note_commands(&mut self, now: Instant, unit: usize) {
        let Self { units, modbus, audit, .. } = self;
        let Some(Unit { device, trail, .. }) = units.get_mut(unit) else { return };
        while let Some(commanded) = device.dictionary_mut().take_commanded() {
            let Origin { bus, link, client } = commanded.origin;
            let who = match bus {
                od::Bus::CanOpen => Who::CanOpen(LinkId(link)),
                od::Bus::Modbus => modbus.peer(client).map_or(Who::ModbusGone, Who::Modbus),
                od::Bus::Local => Who::Local,
            };
            let dictionary = device.dictionary();
            let Some(address) = dictionary.schema().address(commanded.slot) else { continue };
            if commanded.has_changed {
                trail.note(now, who, address, commanded.raw);
            }
            let data_type = dictionary.schema().entry(commanded.slot).map(|entry| entry.data_type);
            let entry = AuditEntry {
                at: now,
                device: unit,
                who,
                node_id: (bus == od::Bus::CanOpen).then_some(client as u8),
                address,
                value: data_type.map_or(0, |data_type| data_type.integer(commanded.raw)),
                what: What::Write,
            };
            audit.note(&commanded, entry);
        }
    }
}
