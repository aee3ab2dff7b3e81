//! A core loop on virtual time, for tests of what it does between two looks.

use core::time::Duration;
use std::net::TcpListener;
use std::sync::Arc;

use modbus::{Dialect, WordOrder};
use od::{Address, Instant};
use profiles::{PlantSetup, Profile};

use super::{Collecting, CoreLoop, Reloads, Times};
use crate::alarm::Alarm;
use crate::clock::Clock;
use crate::core::{Authority, Core, LinkId, ListenerPlan, ModbusPlan, Plan, identification, map};
use crate::link::Link;
use crate::modbus_tcp::{Listening, Sockets};
use crate::reporter::Reporter;
use crate::service_manager::ServiceManager;
use crate::socketcand::ToCore;
use crate::storage::Storage;

/// What a look at the clock takes here: as long as a piece of work takes at most, on any machine.
pub(super) const TICK: Duration = Duration::from_micros(20);
/// Raster of the axis.
pub(super) const RASTER: Duration = Duration::from_millis(1);
pub(super) const CLIENTS: usize = 16;

/// A loop with an axis that turns and a port for Modbus clients.
pub(super) fn turning() -> CoreLoop {
    with_devices(1)
}

/// The same with so many devices, of which the first turns.
pub(super) fn with_devices(devices: u8) -> CoreLoop {
    let profile = Arc::new(Profile::embedded("cia402-servo", None).unwrap().unwrap());
    let plan = |node: u8| Plan {
        name: format!("axis {node}").as_str().into(),
        profile: Arc::clone(&profile),
        nodes: vec![(LinkId(0), node)],
        plant: PlantSetup::default(),
        serial: None,
    };
    let plans: Vec<Plan> = (1..=devices).map(plan).collect();
    let mut now = Instant::ZERO;
    let mut core = Core::new(1, &plans, now).unwrap();
    let map = Arc::new(map(&profile, Dialect::Full, WordOrder::LowFirst));
    let identification = identification(&profile, "axis");
    core.show_on_modbus(0, ModbusPlan { unit: Some(1), map, identification, timeout: None });
    core.add_listener(ListenerPlan { max_clients: CLIENTS as u16, ..ListenerPlan::default() });
    let commands: [(u16, &[u8]); 5] =
        [(0x6060, &[3]), (0x6040, &[6, 0]), (0x6040, &[7, 0]), (0x6040, &[15, 0]), (0x60FF, &[0, 9, 0, 0])];
    for (index, value) in commands {
        (0..100).for_each(|_| {
            now = now + RASTER;
            core.handle_timeout(now);
        });
        core.write(now, 0, 0, &[(Address::new(index, 0), value.to_vec())], Authority::Owner).unwrap();
    }
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let listeners = vec![(listener.local_addr().unwrap(), listener)];
    let listening = Listening { listeners, allow: Vec::new(), read_only: Vec::new() };
    let clock = Clock::ticking(TICK);
    while clock.now() < now {}
    let alarm = Alarm::new().unwrap();
    CoreLoop {
        core,
        links: vec![Link::new(LinkId(0), "can0", None)],
        clients: ToCore::new(alarm.bell()).1,
        modbus: Some(Sockets::new(vec![listening]).unwrap()),
        clock,
        alarm,
        stop: Arc::default(),
        reporter: Reporter::new(1),
        manager: ServiceManager::from_environment(now),
        storage: Storage::default(),
        audit: None,
        publisher: None,
        collecting: Collecting::default(),
        inbox: None,
        storing: Vec::new(),
        attentive_until: Instant::ZERO,
        turns_without_clock: 0,
        times: Times::default(),
        reloads: Reloads::new(None),
        share: None,
    }
}
