//! Who may command an axis: what the configuration says, until somebody claims it.

use od::{Bus, Commanded, Instant, Origin, Owner, Slot};
use profiles::Device;
use thiserror::Error;

use super::audit::{AuditEntry, Item, What};
use super::modbus::Modbus;
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
    pub fn claim(&mut self, now: Instant, device: usize, axis: usize, owner: Owner) -> Result<(), NoAxis> {
        self.give(device, axis, |_| Some(owner))?;
        self.note_owner(now, device, axis, Some(owner));
        Ok(())
    }

    /// Gives an axis back to whom the configuration names.
    ///
    /// # Errors
    /// There is no such axis.
    pub fn release(&mut self, now: Instant, device: usize, axis: usize) -> Result<(), NoAxis> {
        self.give(device, axis, |unit| unit.owner)?;
        self.note_owner(now, device, axis, None);
        Ok(())
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

    /// Takes note of the commands that were just written to a device, and of those that it refused.
    pub(super) fn note_commands(&mut self, now: Instant, unit: usize) {
        let Self { units, modbus, audit, .. } = self;
        let Some(Unit { device, trail, .. }) = units.get_mut(unit) else { return };
        while let Some(commanded) = device.dictionary_mut().take_commanded() {
            let Commanded { origin, slot, raw, .. } = commanded;
            let Some(item) = item(device, origin, slot, Some(raw)) else { continue };
            let who = who(modbus, origin);
            if commanded.has_changed {
                trail.note(now, who, item.address, commanded.raw);
            }
            audit.note_command((now, who, unit), &commanded, item);
        }
        while let Some(refused) = device.dictionary_mut().take_refused() {
            let Some(item) = item(device, refused.origin, refused.slot, refused.raw) else { continue };
            let (who, what) = (who(modbus, refused.origin), What::Refused(item, refused.code));
            let (device, peer) = (Some(unit), audit.peer);
            audit.note(AuditEntry { at: now, device, who, peer, what, again: None });
        }
    }
}

/// Who an access comes from.
fn who(modbus: &Modbus, Origin { bus, link, client }: Origin) -> Who {
    match bus {
        Bus::CanOpen => Who::CanOpen(LinkId(link)),
        Bus::Modbus => modbus.peer(client).map_or(Who::ModbusGone, Who::Modbus),
        Bus::Local => Who::Local,
    }
}

/// What was written to a device.
fn item(device: &Device, origin: Origin, slot: Slot, raw: Option<u64>) -> Option<Item> {
    let schema = device.dictionary().schema();
    let data_type = schema.entry(slot)?.data_type;
    // The client of CANopen is the Node-ID.
    let node_id = (origin.bus == Bus::CanOpen).then_some(origin.client as u8);
    Some(Item { node_id, address: schema.address(slot)?, value: raw.map(|raw| data_type.integer(raw)) })
}
