//! Our NMT master (CiA 302-2) boots nodes of two daemons on one bus, configures one by a concise DCF, and refuses another
//! device than it expects; a stranger's master looks at what has come of that.

use std::time::{Duration, Instant as Clock};

use canopen::{BootStatus, DcfEntry, Frame, Id, Loss, Master, MasterEvent, encode_dcf};
use od::{Access, Address, DataType, Dictionary, Entry, Instant, Object, Schema};
use tests::{Bus, Daemon, Vcan, Wire, config};

const PROFILE: &str = "cia402-servo";
const OF_MASTER: u8 = 127;
const SLAVE: u8 = 1;
const STRANGER: u8 = 2;

/// 0x1F81: a slave that is booted, and one without which the network does not start.
const BOOTED: u32 = 0x05;
const MANDATORY: u32 = 0x08;

/// Consumer heartbeat time; the slave sends one every 100 ms.
const HEARTBEAT_TIME: u32 = 60_000;
/// The clock of the master goes so much slower, so that no time-out of its depends on the speed of this machine.
const SLOWNESS: u32 = 60;
/// How long it may take to boot a node.
const BOOT_PATIENCE: Duration = Duration::from_secs(150);
/// How long the master listens at a time.
const TURN: Duration = Duration::from_millis(20);

const LOG: &str = "configured and started, and the other one left alone\n";

#[test]
fn our_master_configures_a_node_by_dcf_refuses_another_device_and_boots_one_again_that_vanished() {
    let interface = Vcan::new();
    let slave = || {
        let config = config(Bus::Interface(&interface), &[("axis1", PROFILE, SLAVE)]);
        Daemon::start(&format!("{config}\n[device.identity]\nserial = 42\n"))
    };
    let mut daemon = slave();
    let heartbeat = "[device.objects]\n\"0x1017:00\" = 100\n";
    let stranger = config(Bus::Interface(&interface), &[("axis2", PROFILE, STRANGER)]);
    let _stranger = Daemon::start(&format!("{stranger}\n{heartbeat}"));
    let mut manager = Manager::start(&interface);

    let refused = BootStatus::ProductCode;
    manager.expect(|event| matches!(event, MasterEvent::BootFailed { node_id: STRANGER, status, .. } if status == refused));
    manager.expect(|event| event == MasterEvent::Booted { node_id: SLAVE, was_operational: false });
    manager.expect(|event| event == MasterEvent::Started { enters_operational: true });
    let judge = tests::Master::on(&interface, PROFILE);
    assert_eq!(judge.run("configured", &[]), LOG);

    daemon.kill();
    manager.miss_heartbeats_until(MasterEvent::Lost { node_id: SLAVE, loss: Loss::Heartbeat });
    let _daemon = slave();

    manager.expect(|event| event == MasterEvent::Booted { node_id: SLAVE, was_operational: false });
    assert_eq!(judge.run("configured", &[]), LOG);
}

/// The master of the library on a wire.
struct Manager {
    master: Master,
    wire: Wire,
    begin: Clock,
    skipped: Duration,
    events: Vec<MasterEvent>,
}

impl Manager {
    fn start(interface: &Vcan) -> Self {
        let (master, wire) = (Master::new(&parameters()), Wire::on(interface));
        let mut manager =
            Self { master, wire, begin: Clock::now(), skipped: Duration::ZERO, events: Vec::new() };
        manager.master.start(manager.now());
        manager
    }

    fn now(&self) -> Instant {
        Instant::ZERO + self.begin.elapsed() / SLOWNESS + self.skipped
    }

    /// Runs until an event comes that is wanted. Others stay until they are.
    fn expect(&mut self, is_wanted: impl Fn(MasterEvent) -> bool) {
        let deadline = Clock::now() + BOOT_PATIENCE;
        while !self.take(&is_wanted) {
            assert!(Clock::now() < deadline, "not among {:?}", self.events);
            self.turn();
        }
    }

    /// Lets the master think that much time has passed, again and again, for there may still be heartbeats that it has not
    /// heard.
    fn miss_heartbeats_until(&mut self, event: MasterEvent) {
        let deadline = Clock::now() + BOOT_PATIENCE;
        while !self.take(|other| other == event) {
            assert!(Clock::now() < deadline, "not among {:?}", self.events);
            self.skipped += Duration::from_millis(HEARTBEAT_TIME.into());
            self.turn();
        }
    }

    fn take(&mut self, is_wanted: impl Fn(MasterEvent) -> bool) -> bool {
        let position = self.events.iter().position(|event| is_wanted(*event));
        position.map(|position| self.events.remove(position)).is_some()
    }

    fn turn(&mut self) {
        if let Some(text) = self.wire.next(Clock::now() + TURN) {
            self.master.handle_frame(self.now(), &read(&text));
        }
        if self.master.poll_timeout().is_some_and(|deadline| deadline <= self.now()) {
            self.master.handle_timeout(self.now());
        }
        while let Some(frame) = self.master.poll_transmit() {
            self.wire.send(&frame.to_string());
        }
        self.events.extend(std::iter::from_fn(|| self.master.poll_event()));
    }
}

/// What the master is told of its network.
fn parameters() -> Dictionary {
    let values = [
        (0x1F80, 0, 1), // it is the master
        (0x1F81, SLAVE, BOOTED | MANDATORY),
        (0x1F84, SLAVE, 0x0002_0192),
        (0x1F86, SLAVE, 0x0402),
        (0x1F87, SLAVE, 0x0000_0001),
        (0x1F88, SLAVE, 42),
        (0x1F81, STRANGER, BOOTED),
        (0x1F86, STRANGER, 0x0403),
        (0x1016, 1, u32::from(SLAVE) << 16 | HEARTBEAT_TIME),
    ];
    let entry = |sub, data_type| Entry::new(sub, "Entry", data_type, Access::ReadWrite);
    let number = |sub| entry(sub, DataType::Unsigned32);
    let by_node = |index| Object::array(index, "By Node-ID", (1..=127).map(number).collect());
    let mut objects = [0x1F81, 0x1F84, 0x1F86, 0x1F87, 0x1F88, 0x1016].map(by_node).to_vec();
    objects.push(Object::var(0x1F80, number(0)));
    objects.push(Object::array(0x1F22, "Concise DCF", vec![entry(SLAVE, DataType::Domain)]));
    let schema = Schema::new(objects).expect("objects of the standard");
    let mut dictionary = Dictionary::new(schema.into(), OF_MASTER);
    let slot = |index, sub| dictionary.find(Address::new(index, sub)).expect("it is there");
    let (values, dcf) = (values.map(|(index, sub, value)| (slot(index, sub), value)), slot(0x1F22, SLAVE));
    values.into_iter().for_each(|(slot, value)| dictionary.set(slot, value.into()));
    dictionary.set_bytes(dcf, &configuration());
    dictionary
}

/// A heartbeat each 100 ms; TPDO 1 with statusword and position after each SYNC; the profile acceleration.
fn configuration() -> Vec<u8> {
    let writes: [(u16, u8, &[u8]); 9] = [
        (0x1017, 0, &100_u16.to_le_bytes()),
        (0x1800, 1, &0x8000_0181_u32.to_le_bytes()),
        (0x1A00, 0, &[0]),
        (0x1A00, 1, &0x6041_0010_u32.to_le_bytes()),
        (0x1A00, 2, &0x6064_0020_u32.to_le_bytes()),
        (0x1A00, 0, &[2]),
        (0x1800, 2, &[1]),
        (0x1800, 1, &0x0000_0181_u32.to_le_bytes()),
        (0x6083, 0, &12_345_u32.to_le_bytes()),
    ];
    encode_dcf(&writes.map(|(index, sub, data)| DcfEntry { address: Address::new(index, sub), data }))
}

/// A data frame as `candump` writes it, `701#05`.
fn read(text: &str) -> Frame {
    let (id, digits) = text.split_once('#').expect("an identifier and data");
    let id = u16::from_str_radix(id, 16).expect("a standard identifier");
    let digits: Vec<char> = digits.chars().collect();
    let bytes = digits.chunks(2).map(|digits| u8::from_str_radix(&String::from_iter(digits), 16));
    Frame::new(Id::Standard(id), &bytes.collect::<Result<Vec<u8>, _>>().expect("bytes"))
}
