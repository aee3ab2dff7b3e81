//! Any bytes as a story that happens to a whole node and its device: frames, time that passes, time that is slept
//! through. Whatever the story, the node sends only what is legal, in bounded numbers, and asks for no past time.

use std::sync::{Arc, OnceLock};
use std::time::Duration;

use canopen::{CobId, Event, Frame, Id, NmtState, Node};
use od::{Address, Dictionary, Direction, Initial, Instant, Saved, Value};
use profiles::{Device, Profile};

const NODE_ID: u8 = 1;
const SDO_REQUEST: u16 = 0x600;
const SDO_ANSWER: u16 = 0x580;
const ERROR_CONTROL: u16 = 0x700;
const LSS_ANSWER: Id = Id::Standard(0x7E4);
/// What stands for a TPDO that sends the objects of the scanner list, in place of the number of mapped ones.
const MULTIPLEXED: u8 = 0xFE;
/// Frames that one event may lead to: a block of an SDO upload, 32 TPDOs and 16 that have waited for the device, 64 values
/// of the scanner list, 16 emergency messages and some single ones.
const MOST_AT_ONCE: usize = 127 + 32 + 16 + 64 + 16 + 8;
/// Deadlines that are served in one step: a SYNC may be produced in every microsecond.
const MOST_DEADLINES: usize = 1000;

/// Tells a story to a node of the profile that its first byte chooses; with the highest bit set it takes the processing
/// times of the profile for its PDOs.
pub fn tell(story: &[u8]) {
    let mut bytes = story.iter().copied();
    let names = ["canopen-reference", "canopen-reference", "canopen-reference", "jvl-mac00-fc4"];
    let first = bytes.next().unwrap_or(0);
    let name = names[usize::from(first) % names.len()];
    let mut stage = Stage::new(profile(name), first & 0x80 != 0);
    while let Some(step) = bytes.next() {
        stage.take(step, &mut bytes);
    }
    stage.check_memory();
}

/// Has a client send these SDO requests, eight bytes each, and nothing else.
pub fn request(messages: &[u8]) {
    let mut stage = Stage::new(profile("canopen-reference"), false);
    for message in messages.chunks(8) {
        stage.hear(&Frame::new(stage.own(SDO_REQUEST), message));
    }
    stage.check_memory();
}

fn profile(name: &'static str) -> Arc<Profile> {
    static LOADED: OnceLock<Vec<Arc<Profile>>> = OnceLock::new();
    let load = |name| Arc::new(Profile::embedded(name, None).expect("shipped").expect("valid"));
    let loaded = LOADED.get_or_init(|| Profile::names().map(load).collect());
    let found = loaded.iter().find(|profile| profile.name == name);
    Arc::clone(found.expect("shipped"))
}

struct Stage {
    node: Node,
    device: Device,
    now: Instant,
    /// What the node and the device want to have stored; that takes until time passes.
    order: Option<(Saved, Saved)>,
}

impl Stage {
    fn new(profile: Arc<Profile>, takes_time: bool) -> Self {
        let now = Instant::ZERO;
        let communication = Arc::clone(&profile.communication);
        let mut node = Node::new(NODE_ID, 0, communication, &profile.application).expect("a valid profile");
        node.shape_pdos(&profile.pdos, &profile.application, takes_time);
        let device = Device::new(profile, NODE_ID, now);
        node.start(now, device.dictionary());
        Self { node, device, now, order: None }
    }

    fn take(&mut self, step: u8, bytes: &mut impl Iterator<Item = u8>) {
        let mut next = || bytes.next().unwrap_or(0);
        match step % 16 {
            0..=5 => {
                let command = next();
                let message = self.access(command, [next(), next()], [next(), next(), next(), next()]);
                self.hear(&Frame::new(self.own(SDO_REQUEST), &message));
            }
            6 | 7 => {
                let message = [next(), next(), next(), next(), next(), next(), next(), next()];
                self.hear(&Frame::new(self.own(SDO_REQUEST), &message));
            }
            8 => self.hear(&Frame::new(Id::Standard(0), &[next(), next() % 2])),
            9 => self.hear(&Frame::new(Id::Standard(0x080), &[])),
            10 | 11 => {
                let id = self.heard(next());
                let length = usize::from(next() % 9);
                let payload: Vec<u8> = (0..length).map(|_| next()).collect();
                self.hear(&Frame::new(id, &payload));
            }
            12 => {
                let id = self.heard(next());
                self.hear(&Frame::remote(id, next() % 9));
            }
            13 => {
                let id = Id::Standard(u16::from_le_bytes([next(), next()]) & 0x7FF);
                self.hear(&Frame::new(id, &[next(), next()]));
            }
            14 => self.pass(Duration::from_millis(next().into())),
            _ => self.now = self.now + Duration::from_millis(u64::from(next()) << (next() % 24)),
        }
    }

    /// An SDO request to an entry that exists, in most cases.
    fn access(&self, command: u8, place: [u8; 2], data: [u8; 4]) -> [u8; 8] {
        const COMMANDS: [u8; 8] = [0x40, 0x23, 0x2B, 0x2F, 0x21, 0xA0, 0xC2, 0xC6];
        let command = COMMANDS.get(usize::from(command)).copied().unwrap_or(command);
        let area = [self.node.communication().schema(), self.device.dictionary().schema()];
        let number = usize::from(u16::from_le_bytes(place));
        let entries = area.into_iter().flat_map(|schema| schema.entries());
        let address = entries.map(|(address, _)| address).nth(number);
        let Address { index, sub } = address.unwrap_or(Address::new(number as u16, place[0]));
        let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), data);
        [command, low, high, sub, a, b, c, d]
    }

    /// The identifier of the pre-defined connection set that an LSS master may have moved.
    fn own(&self, base: u16) -> Id {
        Id::Standard(base + u16::from(self.node.node_id()))
    }

    /// One of the identifiers the node listens to.
    fn heard(&self, number: u8) -> Id {
        let ids: Vec<Id> = self.node.subscriptions().collect();
        ids.get(usize::from(number) % ids.len().max(1)).copied().unwrap_or(Id::Standard(0))
    }

    fn hear(&mut self, frame: &Frame) {
        self.node.handle_frame(self.now, frame, self.device.dictionary_mut());
        self.settle();
    }

    /// Lets time pass and serves the deadlines in it, as far as there are not too many.
    fn pass(&mut self, time: Duration) {
        let end = self.now + time;
        self.store();
        for _ in 0..MOST_DEADLINES {
            let Some(deadline) = self.deadline().filter(|deadline| *deadline <= end) else { break };
            self.now = self.now.max(deadline);
            self.device.advance(self.now);
            self.node.handle_timeout(self.now, self.device.dictionary_mut());
            self.settle();
            assert!(self.deadline().is_none_or(|next| next > self.now), "a deadline that is not to come");
        }
        self.now = end;
    }

    /// Ends what is under way, as its owner does.
    fn store(&mut self) {
        let Some((communication, application)) = self.order.take() else { return };
        assert_eq!(self.node.set_saved(communication), 0, "the node's own");
        assert_eq!(self.device.dictionary_mut().set_saved(application), 0, "the device's own");
        self.node.stored(self.now, Ok(()));
        self.settle();
    }

    fn deadline(&self) -> Option<Instant> {
        self.node.poll_timeout().into_iter().chain(self.device.poll_timeout()).min()
    }

    fn settle(&mut self) {
        self.device.apply(self.now);
        while let Some(event) = self.node.poll_event() {
            match event {
                Event::Reset => self.device.reset(self.now),
                Event::Storage(order) => {
                    assert!(self.order.is_none(), "a second order");
                    let wanted = [self.node.communication(), self.device.dictionary()];
                    self.order = Some(wanted.map(|dictionary| order.apply(dictionary)).into());
                }
                Event::NodeId(node_id) => self.device.dictionary_mut().set_node_id(node_id),
                Event::Nmt(_)
                | Event::Subscriptions
                | Event::Time
                | Event::ConnectionLost(_)
                | Event::QueueOverflow
                | Event::QueueDrained
                | Event::Emergency { .. } => {}
            }
        }
        self.node.sample(self.now, self.device.dictionary());
        for count in 0.. {
            let Some(frame) = self.node.poll_transmit() else { break };
            assert!(count < MOST_AT_ONCE, "too many frames at once");
            self.check(&frame);
        }
    }

    fn check(&self, frame: &Frame) {
        assert!(!frame.is_remote, "{frame}");
        let is_legal = match frame.id {
            LSS_ANSWER => frame.len() == 8,
            id if id == self.own(SDO_ANSWER) => frame.len() == 8,
            id if id == self.own(ERROR_CONTROL) => self.is_state(frame.payload()),
            _ => self.is_emcy(frame) || self.is_tpdo(frame) || self.is_sync(frame),
        };
        assert!(is_legal, "{frame} in {:?}", self.node.state());
    }

    /// A boot-up message, a heartbeat or, where there is no heartbeat, an answer to a guarding request.
    fn is_state(&self, payload: &[u8]) -> bool {
        let has_heartbeat = raw(self.node.communication(), 0x1017, 0) != 0;
        match payload {
            [0x00] => true,
            [0x04 | 0x05 | 0x7F] => has_heartbeat || self.is_guarded(),
            [0x84 | 0x85 | 0xFF] => !has_heartbeat && self.is_guarded(),
            _ => false,
        }
    }

    fn is_guarded(&self) -> bool {
        self.node.communication().find(Address::new(0x100C, 0)).is_ok()
    }

    fn is_emcy(&self, frame: &Frame) -> bool {
        let cob_id = CobId(raw(self.node.communication(), 0x1014, 0));
        cob_id.is_valid() && cob_id.id() == frame.id && frame.len() == 8
    }

    fn is_sync(&self, frame: &Frame) -> bool {
        const GENERATES: u32 = 1 << 30;
        let cob_id = CobId(raw(self.node.communication(), 0x1005, 0));
        cob_id.0 & GENERATES != 0 && cob_id.id() == frame.id && frame.len() <= 1
    }

    fn is_tpdo(&self, frame: &Frame) -> bool {
        let communication = self.node.communication();
        self.node.state() == NmtState::Operational
            && (0..512).any(|number| {
                let cob_id = CobId(raw(communication, 0x1800 + number, 1));
                let count = raw(communication, 0x1A00 + number, 0) as u8;
                let bits: u32 = match count {
                    MULTIPLEXED => 64,
                    _ => (1..=count).map(|sub| raw(communication, 0x1A00 + number, sub) & 0xFF).sum(),
                };
                let is_padded = frame.len() == 8 && self.is_padded(number + 1);
                let has_length = frame.len() == bits.div_ceil(8) as usize || is_padded;
                cob_id.is_valid() && cob_id.id() == frame.id && has_length
            })
    }

    /// Whether the TPDO has reserved bytes.
    fn is_padded(&self, number: u16) -> bool {
        let mut pdos = self.device.profile().pdos.iter();
        pdos.any(|pdo| pdo.direction == Direction::Transmit && pdo.number == number && pdo.length == 8)
    }

    /// No value may be longer than its entry allows or came with.
    fn check_memory(&self) {
        for dictionary in [self.node.communication(), self.device.dictionary()] {
            for (address, entry) in dictionary.schema().entries() {
                let slot = dictionary.schema().slot(address).expect("an entry of its own");
                let Some(Value::Bytes(bytes)) = dictionary.value(slot) else { continue };
                let initial = match &entry.initial {
                    Initial::Value(Value::Bytes(initial)) => initial.len(),
                    _ => 0,
                };
                assert!(bytes.len() <= entry.max_length.max(initial), "{address} is too long");
            }
        }
    }
}

fn raw(dictionary: &Dictionary, index: u16, sub: u8) -> u32 {
    dictionary.find(Address::new(index, sub)).map_or(0, |slot| dictionary.raw(slot) as u32)
}
