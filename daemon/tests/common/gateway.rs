//! A core whose devices are reached by Modbus clients.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use canopen::UNCONFIGURED;
use daemon::core::{ClientId, ListenerPlan, ModbusPlan, Notice, identification, map};
use modbus::{Dialect, WordOrder, tcp_adu};
use od::Address;
use profiles::{Profile, State};

use super::Bench;

/// A core whose devices, at the given nodes of the first link, are reached by Modbus.
pub(crate) struct Gateway {
    pub(crate) bench: Bench,
    profile: Arc<Profile>,
    map: modbus::Map,
}

pub(crate) fn peer(number: u8) -> SocketAddr {
    SocketAddr::from(([10, 0, 0, number], 1000))
}

pub(crate) fn listener() -> ListenerPlan {
    ListenerPlan { max_clients: 64, device: Some(0), ..ListenerPlan::default() }
}

impl Gateway {
    pub(crate) fn new(nodes: &[u8]) -> Self {
        Self::with(nodes, listener(), None)
    }

    pub(crate) fn with(nodes: &[u8], listener: ListenerPlan, timeout: Option<Duration>) -> Self {
        Self::of(("cia402-servo", Dialect::Full), nodes, listener, timeout)
    }

    /// The same with devices of another profile and dialect.
    pub(crate) fn of(
        (profile, dialect): (&str, Dialect),
        nodes: &[u8],
        listener: ListenerPlan,
        timeout: Option<Duration>,
    ) -> Self {
        let profile = Arc::new(Profile::embedded(profile, None).unwrap().unwrap());
        let places: Vec<Vec<(u16, u8)>> = nodes.iter().map(|node| vec![(0, *node)]).collect();
        let places: Vec<&[(u16, u8)]> = places.iter().map(Vec::as_slice).collect();
        let mut bench = Bench::of(&profile, &places);
        let map = map(&profile, dialect, WordOrder::LowFirst);
        for (device, node) in nodes.iter().enumerate() {
            let plan = ModbusPlan {
                unit: Some(*node).filter(|node| *node != UNCONFIGURED),
                map: Arc::new(map.clone()),
                identification: identification(&profile, "axis"),
                timeout,
            };
            bench.core.show_on_modbus(device, plan);
        }
        bench.core.add_listener(listener);
        // Until the axes have started.
        bench.run(Duration::from_millis(100));
        Self { bench, profile, map }
    }

    /// Lets clients reach a device that has joined, as this unit.
    pub(crate) fn show(&mut self, device: usize, unit: u8) {
        let plan = ModbusPlan {
            unit: Some(unit),
            map: Arc::new(self.map.clone()),
            identification: identification(&self.profile, "axis"),
            timeout: None,
        };
        self.bench.core.show_on_modbus(device, plan);
    }

    pub(crate) fn connect(&mut self) -> ClientId {
        self.bench.core.connect(self.bench.now, 0, peer(1), false).unwrap()
    }

    /// Sends a PDU to `unit` and gives the PDU that comes back.
    pub(crate) fn ask(&mut self, client: ClientId, unit: u8, pdu: &str) -> String {
        let core = &mut self.bench.core;
        core.receive(self.bench.now, client, &tcp_adu(1, unit, &bytes(pdu)));
        assert!(core.serve(self.bench.now, client));
        let answer = core.output(client).to_vec();
        core.sent(client, answer.len());
        assert_eq!(answer[6], unit);
        answer[7..].iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
    }

    /// The first register of an object, as it stands in a request.
    pub(crate) fn at(&self, index: u16, sub: u8) -> String {
        let slot = self.profile.application.slot(Address::new(index, sub)).unwrap();
        let first = self.map.listing().find(|listed| listed.slot == slot).unwrap().first;
        format!("{:02X} {:02X}", first >> 8, first & 0xFF)
    }

    pub(crate) fn write16(&mut self, client: ClientId, index: u16, value: u16) -> String {
        let at = self.at(index, 0);
        self.ask(client, 1, &format!("06 {at} {:02X} {:02X}", value >> 8, value & 0xFF))
    }

    pub(crate) fn write32(&mut self, client: ClientId, index: u16, value: u32) -> String {
        let at = self.at(index, 0);
        let [a, b, c, d] = value.to_be_bytes();
        self.ask(client, 1, &format!("10 {at} 00 02 04 {c:02X} {d:02X} {a:02X} {b:02X}"))
    }

    pub(crate) fn read32(&mut self, client: ClientId, index: u16) -> i32 {
        let at = self.at(index, 0);
        let answer = bytes(&self.ask(client, 1, &format!("03 {at} 00 02")));
        i32::from_be_bytes([answer[4], answer[5], answer[2], answer[3]])
    }

    /// Lets the axis of unit 1 turn in profile velocity mode.
    pub(crate) fn turn(&mut self, client: ClientId) {
        self.write16(client, 0x6060, 3);
        for controlword in [0x06, 0x07, 0x0F] {
            self.write16(client, 0x6040, controlword);
            self.bench.run(Duration::from_millis(100));
        }
        self.write32(client, 0x60FF, 5000);
        self.bench.run(Duration::from_millis(500));
        assert_eq!(self.state(), State::OperationEnabled);
    }

    pub(crate) fn state(&self) -> State {
        self.bench.core.devices().next().unwrap().axes().next().unwrap().state
    }

    pub(crate) fn notices(&mut self) -> Vec<Notice> {
        std::iter::from_fn(|| self.bench.core.poll_notice()).map(|(_, notice)| notice).collect()
    }
}

pub(crate) fn bytes(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}
