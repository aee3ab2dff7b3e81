//! One node with the test device on virtual time, talked to as with `cansend` and `candump`.
#![allow(dead_code, reason = "every test file uses a part of it")]

pub(crate) mod device;

use std::sync::Arc;

use core::time::Duration;

use canopen::{Event, Frame, Id, Node};
use od::{AbortCode, Address, Dictionary, Instant, Object, Schema};

/// A node with Node-ID 1.
pub(crate) struct Bench {
    pub(crate) node: Node,
    pub(crate) device: Dictionary,
    pub(crate) now: Instant,
}

impl Bench {
    /// A node that is not powered yet.
    pub(crate) fn off() -> Self {
        Self::with(device::communication())
    }

    /// The same with more communication objects.
    pub(crate) fn off_with(more: Vec<Object>) -> Self {
        Self::with(device::communication_with(more))
    }

    /// The same with other communication objects.
    pub(crate) fn with(communication: Schema) -> Self {
        Self::as_node(1, communication)
    }

    /// The same with another Node-ID.
    pub(crate) fn as_node(node_id: u8, communication: Schema) -> Self {
        let application = device::application();
        let node = Node::new(node_id, 0, Arc::new(communication), &application).unwrap();
        Self { node, device: Dictionary::new(Arc::new(application), node_id), now: Instant::ZERO }
    }

    /// A node in PRE-OPERATIONAL whose boot-up message is gone.
    pub(crate) fn new() -> Self {
        Self::off().started()
    }

    /// The same node after power-on.
    pub(crate) fn started(mut self) -> Self {
        self.node.start(self.now, &self.device);
        self.settle();
        self
    }

    /// A node in OPERATIONAL that has sent its event-driven TPDO.
    pub(crate) fn operational() -> Self {
        let mut bench = Self::new();
        bench.send("000#0101");
        bench
    }

    /// Runs a dialogue and compares it with what really happens. Lines are
    ///
    /// * `> 601#4000100000000000`: this frame comes from the bus;
    /// * `+ 10ms`: time passes (`us`, `ms`, `s`), with every deadline in it;
    /// * `= 6000:01 2A`: the device shows this value;
    /// * `< 581#4300100092010200`: the node sends this. Every frame must be there, in this order.
    ///
    /// Frames that the node owes from before come first. Behind `//` is a comment.
    pub(crate) fn talk(&mut self, script: &str) {
        let lines = script.lines().map(|line| line.split("//").next().unwrap_or_default().trim());
        let expected: Vec<&str> = lines.filter(|line| !line.is_empty()).collect();
        let mut actual: Vec<String> = answers(self.settle());
        for line in expected.iter().filter(|line| !line.starts_with('<')) {
            actual.push((*line).into());
            actual.extend(answers(self.run(line)));
        }
        let (actual, expected) = (actual.join("\n"), expected.join("\n"));
        assert!(actual == expected, "what happened:\n{actual}\n\nwhat was expected:\n{expected}\n");
    }

    fn run(&mut self, line: &str) -> Vec<Frame> {
        match line.split_once(' ').expect("a command and its operand") {
            (">", frame) => self.handle(&frame_of(frame)),
            ("+", time) => self.pass(duration(time)),
            ("=", what) => {
                let (address, value) = what.split_once(' ').expect("an address and a value");
                self.show(address, u64::from_str_radix(value, 16).unwrap());
                self.settle()
            }
            _ => panic!("unknown command: {line}"),
        }
    }

    /// Takes a frame given as `601#4000100000000000`; gives what the node sends then.
    pub(crate) fn send(&mut self, frame: &str) -> Vec<Frame> {
        self.handle(&frame_of(frame))
    }

    /// Takes a frame; gives what the node sends then.
    pub(crate) fn handle(&mut self, frame: &Frame) -> Vec<Frame> {
        self.node.handle_frame(self.now, frame, &mut self.device);
        self.settle()
    }

    /// Lets the node catch up with the device; gives what it sends then.
    pub(crate) fn settle(&mut self) -> Vec<Frame> {
        while self.device.take_written().is_some() {}
        self.node.sample(self.now, &self.device);
        core::iter::from_fn(|| self.node.poll_transmit()).collect()
    }

    /// Lets time pass and serves every deadline in it; gives what the node sends then.
    pub(crate) fn pass(&mut self, time: Duration) -> Vec<Frame> {
        let end = self.now + time;
        let mut sent = Vec::new();
        while let Some(deadline) = self.node.poll_timeout().filter(|deadline| *deadline <= end) {
            self.now = self.now.max(deadline);
            self.node.handle_timeout(self.now, &mut self.device);
            sent.extend(self.settle());
            let is_past = self.node.poll_timeout().is_some_and(|next| next <= self.now);
            assert!(!is_past, "the node asks for a time that is not to come");
        }
        self.now = end;
        sent
    }

    /// The events since the last call.
    pub(crate) fn events(&mut self) -> Vec<Event> {
        core::iter::from_fn(|| self.node.poll_event()).collect()
    }

    /// The device shows `value` at `address`, given as `6000:01`.
    pub(crate) fn show(&mut self, address: &str, value: u64) {
        let slot = self.device.find(address_of(address)).unwrap();
        self.device.set(slot, value);
    }

    /// What the device has at `address`.
    pub(crate) fn value(&self, address: &str) -> u64 {
        self.device.raw(self.device.find(address_of(address)).unwrap())
    }

    /// Writes a communication parameter by SDO and expects that to succeed; gives what the node sends beside.
    pub(crate) fn configure(&mut self, address: &str, value: u32) -> Vec<Frame> {
        let Address { index, sub } = address_of(address);
        let schema = self.node.communication().schema();
        let entry = schema.slot(Address::new(index, sub)).and_then(|slot| schema.entry(slot)).unwrap();
        let size = entry.data_type.bytes().unwrap();
        let request = initiate(expedited(size), Address::new(index, sub), value.to_le_bytes());
        let mut sent = self.handle(&request);
        let [low, high] = index.to_le_bytes();
        let answer = Frame::new(ANSWER, &[0x60, low, high, sub, 0, 0, 0, 0]);
        assert_eq!(sent.first(), Some(&answer), "{request} is answered by {sent:?}");
        sent.remove(0);
        sent
    }

    /// Reads by SDO, in segments where the node wants that.
    pub(crate) fn upload(&mut self, address: Address) -> Result<Vec<u8>, AbortCode> {
        let [command, _, _, _, data @ ..] = self.ask(&initiate(0x40, address, [0; 4]))?;
        if command & 0x02 != 0 {
            return Ok(data[..4 - usize::from(command >> 2 & 3)].to_vec());
        }
        let mut bytes = Vec::new();
        for toggle in [0x00, 0x10].into_iter().cycle() {
            let [command, segment @ ..] =
                self.ask(&Frame::new(REQUEST, &[0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]))?;
            assert_eq!(command & 0xF0, toggle);
            bytes.extend_from_slice(&segment[..7 - usize::from(command >> 1 & 7)]);
            if command & 1 != 0 {
                break;
            }
        }
        assert_eq!(bytes.len(), u32::from_le_bytes(data) as usize, "as announced");
        Ok(bytes)
    }

    /// Writes by SDO, in segments where there are more than four bytes or none.
    pub(crate) fn download(&mut self, address: Address, bytes: &[u8]) -> Result<(), AbortCode> {
        if (1..=4).contains(&bytes.len()) {
            let mut data = [0; 4];
            data[..bytes.len()].copy_from_slice(bytes);
            return self.ask(&initiate(expedited(bytes.len()), address, data)).map(|_| ());
        }
        self.ask(&initiate(0x21, address, (bytes.len() as u32).to_le_bytes()))?;
        let last = bytes.len().div_ceil(7).max(1) - 1;
        for (number, toggle) in (0..=last).zip([0x00, 0x10].into_iter().cycle()) {
            let segment = bytes.chunks(7).nth(number).unwrap_or_default();
            let unused = (7 - segment.len() as u8) << 1;
            let mut message = [toggle | unused | u8::from(number == last), 0, 0, 0, 0, 0, 0, 0];
            message[1..=segment.len()].copy_from_slice(segment);
            let answer = self.ask(&Frame::new(REQUEST, &message))?;
            assert_eq!(answer, [0x20 | toggle, 0, 0, 0, 0, 0, 0, 0]);
        }
        Ok(())
    }

    /// Sends an SDO request and takes its one answer.
    fn ask(&mut self, request: &Frame) -> Result<[u8; 8], AbortCode> {
        let [answer] = self.handle(request)[..] else { panic!("{request} has one answer") };
        assert_eq!(answer.id, ANSWER);
        let [command, _, _, _, code @ ..] = answer.eight().unwrap();
        let code = u32::from_le_bytes(code);
        match AbortCode::ALL.iter().find(|known| known.code() == code) {
            Some(known) if command == 0x80 => Err(*known),
            _ => Ok(answer.eight().unwrap()),
        }
    }

    /// Gives a PDO a new mapping and transmission type by the procedure of CiA 301 v4.2, section 7.5.2.36, and makes
    /// it valid; `number` is the index of its communication record. Gives what the node sends beside.
    pub(crate) fn map(&mut self, number: u16, cob_id: u32, transmission: u8, mapped: &[u32]) -> Vec<Frame> {
        let mapping = number + 0x200;
        let mut sent = self.configure(&format!("{number:04X}:01"), cob_id | 1 << 31);
        sent.extend(self.configure(&format!("{number:04X}:02"), transmission.into()));
        sent.extend(self.configure(&format!("{mapping:04X}:00"), 0));
        for (sub, parameter) in (1..).zip(mapped) {
            sent.extend(self.configure(&format!("{mapping:04X}:{sub:02X}"), *parameter));
        }
        sent.extend(self.configure(&format!("{mapping:04X}:00"), mapped.len() as u32));
        sent.extend(self.configure(&format!("{number:04X}:01"), cob_id));
        sent
    }
}

const REQUEST: Id = Id::Standard(0x601);
const ANSWER: Id = Id::Standard(0x581);

fn initiate(command: u8, Address { index, sub }: Address, [a, b, c, d]: [u8; 4]) -> Frame {
    let [low, high] = index.to_le_bytes();
    Frame::new(REQUEST, &[command, low, high, sub, a, b, c, d])
}

/// The command of an expedited download of `size` bytes.
fn expedited(size: usize) -> u8 {
    0x23 | (4 - size as u8) << 2
}

fn answers(frames: Vec<Frame>) -> Vec<String> {
    frames.into_iter().map(|frame| format!("< {frame}")).collect()
}

/// The frame written as `601#4000100000000000`, `181#R` or `00000181#` (29 bits).
pub(crate) fn frame_of(text: &str) -> Frame {
    let (id, data) = text.split_once('#').expect("ID#DATA");
    let number = u32::from_str_radix(id, 16).unwrap();
    let id = if id.len() == 8 { Id::Extended(number) } else { Id::Standard(number as u16) };
    if let Some(len) = data.strip_prefix('R') {
        return Frame::remote(id, len.parse().unwrap_or(0));
    }
    let bytes: Vec<u8> =
        (0..data.len()).step_by(2).map(|i| u8::from_str_radix(&data[i..i + 2], 16).unwrap()).collect();
    Frame::new(id, &bytes)
}

fn address_of(text: &str) -> Address {
    let (index, sub) = text.split_once(':').expect("INDEX:SUB");
    Address::new(u16::from_str_radix(index, 16).unwrap(), u8::from_str_radix(sub, 16).unwrap())
}

fn duration(text: &str) -> Duration {
    let unit = text.find(|c: char| !c.is_ascii_digit()).expect("a unit");
    let count = text[..unit].parse().unwrap();
    match &text[unit..] {
        "us" => Duration::from_micros(count),
        "ms" => Duration::from_millis(count),
        "s" => Duration::from_secs(count),
        other => panic!("unknown unit: {other}"),
    }
}
