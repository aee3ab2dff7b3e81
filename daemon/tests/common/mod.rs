//! A core on virtual time, seen from its links.
#![allow(dead_code, reason = "every test file uses a part of it")]

pub(crate) mod gateway;

use std::sync::Arc;
use std::time::Duration;

use canopen::{Frame, Id};
use daemon::core::{Core, LinkId, Plan};
use od::Instant;
use profiles::{PlantSetup, Profile};

/// The first link.
pub(crate) const LINK: LinkId = LinkId(0);

/// What the devices of a bench are called.
const NAMES: [&str; 4] = ["x", "y", "z", "w"];

/// A device of this profile and name with the given nodes.
pub(crate) fn plan(name: &str, profile: &Arc<Profile>, nodes: &[(u16, u8)]) -> Plan {
    Plan {
        name: name.into(),
        profile: Arc::clone(profile),
        nodes: nodes.iter().map(|(link, node_id)| (LinkId(*link), *node_id)).collect(),
        plant: PlantSetup::default(),
        serial: None,
    }
}

/// A core whose links are watched.
pub(crate) struct Bench {
    pub(crate) core: Core,
    pub(crate) now: Instant,
}

impl Bench {
    /// Devices with the given nodes, started; their boot-up messages are taken.
    pub(crate) fn new(devices: &[&[(u16, u8)]]) -> Self {
        Self::silent(devices).started()
    }

    /// The same with devices of this profile.
    pub(crate) fn of(profile: &Arc<Profile>, devices: &[&[(u16, u8)]]) -> Self {
        Self::built(profile, devices).started()
    }

    fn started(self) -> Self {
        let mut bench = self;
        for link in 0..2 {
            bench.core.start(bench.now, LinkId(link));
        }
        while bench.core.poll_transmit().is_some() {}
        bench
    }

    /// The same, not started.
    pub(crate) fn silent(devices: &[&[(u16, u8)]]) -> Self {
        Self::built(&Arc::new(Profile::embedded("jvl-mac00-fc4", None).unwrap().unwrap()), devices)
    }

    fn built(profile: &Arc<Profile>, devices: &[&[(u16, u8)]]) -> Self {
        let plans: Vec<Plan> =
            NAMES.iter().zip(devices).map(|(name, nodes)| plan(name, profile, nodes)).collect();
        assert_eq!(plans.len(), devices.len());
        let now = Instant::from_nanos(1_000_000_000);
        Self { core: Core::new(2, &plans, now).unwrap(), now }
    }

    /// Sends a frame, written as `601#40001000`, on the first link. Gives what is answered there.
    pub(crate) fn send(&mut self, frame: &str) -> Vec<String> {
        self.send_on(LINK, frame);
        self.sent_on(LINK)
    }

    /// Sends a frame on `link`.
    pub(crate) fn send_on(&mut self, link: LinkId, frame: &str) {
        self.core.handle_frame(self.now, link, &parse(frame));
    }

    /// What was sent on `link`; what was sent on the other is lost.
    pub(crate) fn sent_on(&mut self, link: LinkId) -> Vec<String> {
        let sent = std::iter::from_fn(|| self.core.poll_transmit());
        sent.filter(|(on, _)| *on == link).map(|(_, frame)| frame.to_string()).collect()
    }

    /// Lets time pass as a loop would that is always in time; gives what was sent meanwhile on the first link.
    pub(crate) fn run(&mut self, time: Duration) -> Vec<String> {
        let end = self.now + time;
        let mut sent = Vec::new();
        while let Some(deadline) = self.core.poll_timeout().filter(|deadline| *deadline <= end) {
            assert!(deadline > self.now, "the core asks for the past");
            self.now = deadline;
            self.core.handle_timeout(self.now);
            sent.extend(self.sent_on(LINK));
        }
        self.now = end;
        sent
    }

    /// Writes an object of `node` on the first link by SDO.
    pub(crate) fn write(&mut self, node: u8, index: u16, sub: u8, bytes: &[u8]) {
        let command = 0x23 | (4 - bytes.len()) << 2;
        let data: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        let [low, high] = index.to_le_bytes();
        let answers = self.send(&format!(
            "{:03X}#{command:02X}{low:02X}{high:02X}{sub:02X}{data:0<8}",
            0x600 + u16::from(node)
        ));
        let good = format!("{:03X}#60{low:02X}{high:02X}{sub:02X}00000000", 0x580 + u16::from(node));
        assert!(answers.contains(&good), "0x{index:04X}:{sub:02X}: {answers:?}");
    }

    /// Enables the axis of node 1 in mode profile velocity and gives it this target.
    pub(crate) fn turn(&mut self, velocity: u32) {
        self.run(Duration::from_millis(100));
        self.write(1, 0x6060, 0, &[3]);
        for controlword in [0x06, 0x07, 0x0F_u16] {
            self.write(1, 0x6040, 0, &controlword.to_le_bytes());
            self.run(Duration::from_millis(60));
        }
        self.write(1, 0x60FF, 0, &velocity.to_le_bytes());
    }

    /// Makes PDO `number` (from 1) of `node` carry one object.
    pub(crate) fn map(&mut self, node: u8, communication: u16, cob_id: u32, object: u32) {
        let mapping = communication + 0x200;
        self.write(node, communication, 1, &(cob_id | 1 << 31).to_le_bytes());
        self.write(node, mapping, 0, &[0]);
        self.write(node, mapping, 1, &object.to_le_bytes());
        self.write(node, mapping, 0, &[1]);
        self.write(node, communication, 2, &[255]);
        self.write(node, communication, 1, &cob_id.to_le_bytes());
    }
}

/// A frame as `candump -L` shows it.
pub(crate) fn parse(text: &str) -> Frame {
    let (id, data) = text.split_once('#').unwrap();
    let number = u32::from_str_radix(id, 16).unwrap();
    let id = if id.len() == 8 { Id::Extended(number) } else { Id::Standard(number as u16) };
    let byte = |at: usize| u8::from_str_radix(&data[at..at + 2], 16).unwrap();
    let payload: Vec<u8> = (0..data.len()).step_by(2).map(byte).collect();
    Frame::new(id, &payload)
}
