//! Axes claimed for somebody and released.

use od::{Bus, Instant, Owner};
use serde::{Deserialize, Serialize};

use super::axes::{change, find, list};
use crate::core::{Core, LinkId};
use crate::status::{owner_name, table};

/// An axis of a device, or all of them, to be commanded by somebody else than now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Claim {
    /// Name of the device.
    pub device: String,
    /// Number of the axis, from 1; all of the device without it.
    pub axis: Option<usize>,
    /// Who alone may command it: a bus of the device, `modbus`, or `local` for whoever is on this machine. Without it, who
    /// may by the configuration.
    pub owner: Option<String>,
}

/// Who commands an axis.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisOwner {
    /// Name of the device.
    pub device: String,
    /// Number of the axis, from 1.
    pub axis: usize,
    /// Who alone may command it: a bus, `modbus`, `local`, or `any`.
    pub owner: String,
}

impl Claim {
    /// Does it in `core`, whose buses have these names, and tells who then commands each axis of the device. A wrong claim
    /// changes nothing.
    ///
    /// # Errors
    /// There is no such device or axis, or whom it names does not reach the device.
    pub fn carry_out(&self, now: Instant, core: &mut Core, buses: &[&str]) -> Result<Vec<AxisOwner>, String> {
        let Self { device: name, axis, owner } = self;
        let device = find(core, name)?;
        let owner = owner.as_deref().map(|owner| claimant(core, (device, name), owner, buses)).transpose()?;
        change(core, name, *axis, |core, device, axis| match owner {
            Some(owner) => core.claim(now, device, axis, owner),
            None => core.release(now, device, axis),
        })?;
        list(core, Some(name), |name, _, axis| {
            let owner = owner_name(core.owner(device, axis), buses);
            Some(AxisOwner { device: name.to_owned(), axis: axis + 1, owner })
        })
    }

    /// What it changes, for the log.
    pub(crate) fn change(&self) -> String {
        let what = self.axis.map_or_else(|| "all axes".to_owned(), |axis| format!("axis {axis}"));
        match &self.owner {
            Some(owner) => format!("{what} claimed for {owner}"),
            None => format!("{what} released"),
        }
    }
}

/// The owners of axes as a table for people.
#[must_use]
pub fn owners_text(axes: &[AxisOwner]) -> String {
    let row =
        |AxisOwner { device, axis, owner }: &AxisOwner| [device.clone(), axis.to_string(), owner.clone()];
    table(&["DEVICE", ">AXIS", "OWNER"], &axes.iter().map(row).collect::<Vec<_>>())
}

/// Who `name` is for the write gate; it has to be somebody who reaches the device.
fn claimant(
    core: &Core,
    (device, device_name): (usize, &str),
    name: &str,
    buses: &[&str],
) -> Result<Owner, String> {
    match name {
        "local" => return Ok(Owner { bus: Bus::Local, link: None }),
        "modbus" if core.is_on_modbus(device) => return Ok(Owner { bus: Bus::Modbus, link: None }),
        "modbus" => return Err(format!("no Modbus client reaches device `{device_name}`")),
        _ => {}
    }
    let bus_name = |LinkId(link): LinkId| buses.get(usize::from(link)).copied();
    let mut own = core.nodes_of(device).map(|(link, _)| link);
    match own.find(|link| bus_name(*link) == Some(name)) {
        Some(LinkId(link)) => Ok(Owner { bus: Bus::CanOpen, link: Some(link) }),
        None => {
            let modbus = core.is_on_modbus(device).then_some("modbus");
            let own = core.nodes_of(device).filter_map(|(link, _)| bus_name(link));
            let known: Vec<&str> = own.chain(modbus).chain(["local"]).collect();
            Err(format!("`{name}` cannot command device `{device_name}`; who can: {}", known.join(", ")))
        }
    }
}
