//! From the configuration to devices and buses.

use std::path::Path;
use std::sync::Arc;

use canopen::NodeError;
use config::Gateway;
use od::Instant;
use tracing::warn;

use crate::cli::Failure;
use crate::core::{Core, LinkId, Plan, Unit};
use crate::link::{Link, SocketCan};
use crate::log::module::STORAGE;
use crate::modbus_tcp;
use crate::storage;

/// The devices of `gateway` on its buses, each of which has its position as its link.
pub(crate) fn core(gateway: &Gateway, now: Instant) -> Result<Core, Failure> {
    let wrong = |error: String| Failure::Configuration(error);
    let links: Vec<LinkId> = (0..gateway.buses.len()).map(|bus| LinkId(bus as u16)).collect();
    let mut core = Core::new(links.len() as u16, &[], now).map_err(|error| wrong(error.to_string()))?;
    for device in &gateway.devices {
        let unit = unit(device, &links, now);
        core.join(unit.map_err(|reason| wrong(format!("device `{}`: {reason}", device.name)))?);
    }
    Ok(core)
}

/// A device; `links` are those of the buses.
pub(crate) fn unit(device: &config::Device, links: &[LinkId], now: Instant) -> Result<Unit, NodeError> {
    let place = |place: &config::Attachment| Some((*links.get(place.bus)?, place.node_id));
    let plan = Plan {
        name: device.name.as_str().into(),
        profile: Arc::clone(&device.profile),
        nodes: device.on.iter().filter_map(place).collect(),
        plant: device.plant.clone(),
        serial: device.serial,
    };
    let mut unit = Unit::new(&plan, now)?;
    device.sdo_timeout.into_iter().for_each(|timeout| unit.set_sdo_timeout(timeout));
    unit.set_timing(device.timing);
    unit.set_owner(device.owner.map(|owner| modbus_tcp::owner(owner, links)));
    Ok(unit)
}

/// Gives a device that has not joined yet what it has stored in `directory`.
pub(crate) fn load_parameters(unit: &mut Unit, now: Instant, directory: &Path) {
    let device = unit.name().to_owned();
    match storage::load(directory, &device) {
        Ok(None) => {}
        Ok(Some(parameters)) => match unit.load(now, parameters) {
            0 => {}
            left_out => {
                warn!(target: STORAGE, device, "{device}: {left_out} stored values do not fit the profile and are left out");
            }
        },
        Err(error) => {
            let file = directory.join(storage::file_name(&device));
            warn!(target: STORAGE, device, "{device}: starts with the defaults, for {} cannot be used: {error}", file.display());
            unit.lose_parameters();
        }
    }
}

/// A bus; on an interface that is `timed`, the time is taken of how long SDO clients wait.
pub(crate) fn link(bus: &config::Bus, id: LinkId, is_timed: bool, now: Instant) -> Link {
    let interface = match &bus.link {
        config::Link::Virtual => None,
        config::Link::SocketCan(name) => {
            let interface = SocketCan::new(name, bus.socketcand.is_some(), now);
            Some(if is_timed { interface.timed() } else { interface })
        }
    };
    Link::new(id, &bus.name, interface)
}
