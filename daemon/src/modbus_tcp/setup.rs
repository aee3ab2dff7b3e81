//! From the configuration to listeners, maps and owners.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use ::modbus::{Dialect, Permissions, WordOrder};
use config::Gateway;
use od::{Bus, Owner};

use super::{Listening, listen};
use crate::cli::Failure;
use crate::core::{Core, LinkId, ListenerPlan, ModbusPlan, WhenFull, identification, map};

/// Binds every address.
///
/// # Errors
/// One of them cannot be listened on.
pub(crate) fn listen_all(gateway: &Gateway) -> Result<Vec<Listening>, Failure> {
    let listening = |listener: &config::Listener| {
        Ok(Listening {
            listeners: listener.listen.iter().copied().map(bind).collect::<Result<_, _>>()?,
            allow: listener.allow.clone(),
            read_only: listener.read_only.clone(),
        })
    };
    gateway.modbus.iter().map(listening).collect()
}

/// Binds an address.
///
/// # Errors
/// It cannot be listened on.
pub(crate) fn bind(address: SocketAddr) -> Result<(SocketAddr, TcpListener), Failure> {
    let bound = listen(address).map_err(|error| {
        let advice = "choose another port, or let the service use it";
        Failure::Other(format!("cannot serve Modbus on {address}: {error}; {advice}"))
    });
    Ok((address, bound?))
}

/// Tells the core of listeners and of the devices behind them.
pub(crate) fn introduce(core: &mut Core, gateway: &Gateway) {
    for listener in &gateway.modbus {
        core.add_listener(ListenerPlan { device: listener.device, ..plan(listener) });
    }
    for (number, device) in gateway.devices.iter().enumerate() {
        if !gateway.modbus.is_empty() {
            core.show_on_modbus(number, view(device));
        }
    }
}

/// What a listener does, but for the device that it stands for.
pub(crate) fn plan(listener: &config::Listener) -> ListenerPlan {
    ListenerPlan {
        max_clients: listener.max_clients,
        when_full: match listener.when_full {
            config::WhenFull::Refuse => WhenFull::Refuse,
            config::WhenFull::Replace => WhenFull::Replace,
        },
        idle_timeout: listener.idle_timeout,
        permissions: Permissions { read_only: false, write: listener.write.clone() },
        device: None,
        is_own: listener.is_own,
    }
}

/// Who that is for the write gate; `links` are those of the buses.
pub(crate) fn owner(owner: config::Owner, links: &[LinkId]) -> Owner {
    match owner {
        config::Owner::Bus(bus) => {
            Owner { bus: Bus::CanOpen, link: Some(links.get(bus).map_or(u16::MAX, |link| link.0)) }
        }
        config::Owner::Modbus => Owner { bus: Bus::Modbus, link: None },
    }
}

/// How a device looks to Modbus clients.
pub(crate) fn view(device: &config::Device) -> ModbusPlan {
    let dialect = dialect(device.modbus.dialect);
    let order = match device.modbus.word_order {
        config::WordOrder::LowFirst => WordOrder::LowFirst,
        config::WordOrder::HighFirst => WordOrder::HighFirst,
    };
    ModbusPlan {
        unit: device.unit_id,
        map: Arc::new(map(&device.profile, dialect, order)),
        identification: identification(&device.profile, &device.name),
        timeout: device.modbus.timeout,
    }
}

/// Functions and limits.
pub(crate) fn dialect(dialect: config::ModbusDialect) -> Dialect {
    match dialect {
        config::ModbusDialect::Jvl => Dialect::Jvl,
        config::ModbusDialect::Full => Dialect::Full,
    }
}
