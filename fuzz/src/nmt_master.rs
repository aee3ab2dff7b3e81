//! An NMT master and slaves that say anything at any time: it sends only what is legal, in bounded numbers, and asks for no
//! past time.

use std::time::Duration;

use canopen::{Frame, Id, Master};
use od::{Access, Address, DataType, Dictionary, Entry, Instant, Object, Schema};

const SLAVES: [u8; 2] = [1, 2];
const OF_MASTER: u8 = 127;
/// Frames that one event may lead to: an NMT command for each slave and one for all, and an SDO request to each.
const MOST_AT_ONCE: usize = 8;
/// Deadlines that are served in one step.
const MOST_DEADLINES: usize = 1000;

/// Lets a master meet `story`: its parameters, then times, commands and frames.
pub fn run(story: &[u8]) {
    let mut bytes = story.iter().copied();
    let mut stage = Stage { master: Master::new(&parameters(&mut bytes)), now: Instant::ZERO };
    stage.master.start(stage.now);
    stage.settle();
    while let Some(step) = bytes.next() {
        stage.take(step, &mut bytes);
    }
}

/// How the network is started, and for each slave its assignment, what is expected of it and its concise DCF.
fn parameters(bytes: &mut impl Iterator<Item = u8>) -> Dictionary {
    let entry = |data_type| move |sub| Entry::new(sub, "Entry", data_type, Access::ReadWrite);
    let array = |index, data_type| {
        Object::array(index, "By Node-ID", SLAVES.into_iter().map(entry(data_type)).collect())
    };
    let indices = [0x1016, 0x1F26, 0x1F27, 0x1F81, 0x1F84, 0x1F86, 0x1F88, 0x1F8A];
    let mut objects = indices.map(|index| array(index, DataType::Unsigned32)).to_vec();
    objects.push(array(0x1F22, DataType::Domain));
    objects.extend([0x1F80, 0x1F89].map(|index| Object::var(index, entry(DataType::Unsigned32)(0))));
    let schema = Schema::new(objects).expect("objects of the standard");
    let mut dictionary = Dictionary::new(schema.into(), OF_MASTER);
    let mut next = || bytes.next().unwrap_or(0);
    let slot =
        |dictionary: &Dictionary, index, sub| dictionary.find(Address::new(index, sub)).expect("it is there");
    for (index, value) in [(0x1F80, u64::from(next())), (0x1F89, u64::from(next()) * 100)] {
        let slot = slot(&dictionary, index, 0);
        dictionary.set(slot, value);
    }
    for node_id in SLAVES {
        let guarding = [next(), next(), next()];
        let [bits, retries, period] = guarding.map(u64::from);
        let heartbeat = (u64::from(node_id) << 16) | (u64::from(next()) * 10);
        let expected = u64::from(next() % 4);
        let values = [
            (0x1F81, period << 16 | (retries & 3) << 8 | bits | 1),
            (0x1016, heartbeat),
            (0x1F84, expected),
            (0x1F86, expected),
            (0x1F26, u64::from(next() % 2)),
            (0x1F8A, 1),
        ];
        for (index, value) in values {
            let slot = slot(&dictionary, index, node_id);
            dictionary.set(slot, value);
        }
        let length = usize::from(next()) % 64;
        let dcf: Vec<u8> = (0..length).map(|_| next()).collect();
        let slot = slot(&dictionary, 0x1F22, node_id);
        dictionary.set_bytes(slot, &dcf);
    }
    dictionary
}

struct Stage {
    master: Master,
    now: Instant,
}

impl Stage {
    fn take(&mut self, step: u8, bytes: &mut impl Iterator<Item = u8>) {
        let mut next = || bytes.next().unwrap_or(0);
        match step % 8 {
            0 | 1 => self.pass(Duration::from_millis(u64::from(next()) * 4)),
            // Refused unless it is a request that the standard knows.
            2 => _ = self.master.request(self.now, next(), next()),
            3 => self.master.boot(self.now, next() % 4),
            4 => {
                let node_id = u16::from(next() % 4);
                let payload = [next()];
                self.master.handle_frame(self.now, &Frame::new(Id::Standard(0x700 + node_id), &payload));
            }
            5 => {
                let id = u16::from_le_bytes([next(), next()]) & 0x7FF;
                let payload = [next(), next()];
                self.master.handle_frame(self.now, &Frame::new(Id::Standard(id), &payload));
            }
            _ => {
                let node_id = u16::from(next() % 4);
                let message: [u8; 8] = core::array::from_fn(|_| next());
                let length = message.len() - usize::from(step >> 6 == 3);
                let payload = message.get(..length).unwrap_or_default();
                self.master.handle_frame(self.now, &Frame::new(Id::Standard(0x580 + node_id), payload));
            }
        }
        self.settle();
    }

    fn pass(&mut self, time: Duration) {
        let end = self.now + time;
        for _ in 0..MOST_DEADLINES {
            let Some(deadline) = self.master.poll_timeout().filter(|deadline| *deadline <= end) else {
                break;
            };
            self.now = self.now.max(deadline);
            self.master.handle_timeout(self.now);
            self.settle();
            assert!(
                self.master.poll_timeout().is_none_or(|next| next > self.now),
                "a deadline that is not to come"
            );
        }
        self.now = end;
    }

    fn settle(&mut self) {
        while self.master.poll_event().is_some() {}
        for count in 0.. {
            let Some(frame) = self.master.poll_transmit() else { break };
            assert!(count < MOST_AT_ONCE, "too many frames at once");
            let is_slave =
                |base| SLAVES.map(|node_id| Id::Standard(base + u16::from(node_id))).contains(&frame.id);
            let is_command = frame.id == Id::Standard(0) && frame.len() == 2;
            let is_guarding = frame.is_remote && is_slave(0x700);
            assert!(is_command || is_guarding || frame.len() == 8 && is_slave(0x600), "{frame}");
        }
        for sub in SLAVES {
            assert!(self.master.state(sub).is_ok());
        }
    }
}
