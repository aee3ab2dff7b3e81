//! What stands in for the tool: a bus on virtual time with one device, Node-ID 1, and an SDO client.

use std::sync::Arc;
use std::time::Duration;

use canopen::{Frame, Id};
use daemon::core::{Core, LinkId, Plan};
use od::{AbortCode, Address, Entry, Instant};
use profiles::{PlantSetup, Profile};

const LINK: LinkId = LinkId(0);

pub(crate) struct Tool {
    pub(crate) profile: Arc<Profile>,
    core: Core,
    now: Instant,
}

impl Tool {
    /// The device in PRE-OPERATIONAL, its boot-up message seen.
    pub(crate) fn new() -> Self {
        let mut tool = Self::off();
        tool.core.start(tool.now, LINK);
        assert_eq!(tool.sent(), ["701#00"]);
        tool
    }

    /// The device before power-on.
    pub(crate) fn off() -> Self {
        let profile = Arc::new(Profile::embedded("canopen-reference", None).unwrap().unwrap());
        let plan = Plan {
            name: "x".into(),
            profile: Arc::clone(&profile),
            nodes: vec![(LINK, 1)],
            plant: PlantSetup::default(),
            serial: None,
        };
        let now = Instant::from_nanos(1_000_000_000);
        Self { profile, core: Core::new(1, &[plan], now).unwrap(), now }
    }

    pub(crate) fn power_on(&mut self) -> Vec<String> {
        self.core.start(self.now, LINK);
        self.sent()
    }

    /// Every entry of the device.
    pub(crate) fn entries(&self) -> Vec<(Address, Entry)> {
        let schemas = [&self.profile.communication, &self.profile.application];
        let entries = schemas.into_iter().flat_map(|schema| schema.entries());
        entries.map(|(address, entry)| (address, entry.clone())).collect()
    }

    /// Puts a frame, written as `601#4000100000000000` or `181#R8`, on the bus; gives what is answered.
    pub(crate) fn send(&mut self, frame: &str) -> Vec<String> {
        self.core.handle_frame(self.now, LINK, &parse(frame));
        self.sent()
    }

    /// Lets time pass; gives what is sent meanwhile.
    pub(crate) fn pass(&mut self, millis: u64) -> Vec<String> {
        let end = self.now + Duration::from_millis(millis);
        let mut sent = Vec::new();
        while let Some(deadline) = self.core.poll_timeout().filter(|deadline| *deadline <= end) {
            self.now = deadline;
            self.core.handle_timeout(self.now);
            sent.extend(self.sent());
        }
        self.now = end;
        sent
    }

    fn sent(&mut self) -> Vec<String> {
        self.frames().iter().map(Frame::to_string).collect()
    }

    /// What the device sends, its parameters being stored where it wants that.
    fn frames(&mut self) -> Vec<Frame> {
        while let Some((device, _)) = self.core.poll_store() {
            self.core.stored(self.now, device, Ok(()));
        }
        std::iter::from_fn(|| self.core.poll_transmit()).map(|(_, frame)| frame).collect()
    }

    /// Runs a dialogue: `> FRAME` is sent, `< FRAME` has to be answered, `+ N` lets N milliseconds pass. Every
    /// answer must be there, in this order. Behind `//` is a comment.
    pub(crate) fn talk(&mut self, script: &str) {
        let lines = script.lines().map(|line| line.split("//").next().unwrap_or_default().trim());
        let expected: Vec<&str> = lines.filter(|line| !line.is_empty()).collect();
        let mut actual: Vec<String> = Vec::new();
        for line in expected.iter().filter(|line| !line.starts_with('<')) {
            actual.push((*line).to_owned());
            let answers = match line.split_once(' ') {
                Some((">", frame)) => self.send(frame),
                Some(("+", millis)) => self.pass(millis.parse().unwrap()),
                _ => panic!("neither sent nor answered: {line}"),
            };
            actual.extend(answers.into_iter().map(|frame| format!("< {frame}")));
        }
        let (actual, expected) = (actual.join("\n"), expected.join("\n"));
        assert!(actual == expected, "what happened:\n{actual}\n\nwhat was expected:\n{expected}\n");
    }

    /// Reads by SDO, in segments where the device wants that.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, AbortCode> {
        let [command, _, _, _, data @ ..] = self.ask(request(0x40, index, sub, [0; 4]))?;
        if command & 0x02 != 0 {
            return Ok(data[..4 - usize::from(command >> 2 & 3)].to_vec());
        }
        let mut bytes = Vec::new();
        for toggle in [0x00, 0x10].into_iter().cycle() {
            let [command, segment @ ..] = self.ask([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0])?;
            bytes.extend_from_slice(&segment[..7 - usize::from(command >> 1 & 7)]);
            if command & 1 != 0 {
                break;
            }
        }
        assert_eq!(bytes.len(), u32::from_le_bytes(data) as usize, "as announced");
        Ok(bytes)
    }

    /// Reads an unsigned number of at most 64 bits.
    pub(crate) fn number(&mut self, index: u16, sub: u8) -> u64 {
        od::bits::from_le(&self.read(index, sub).unwrap())
    }

    /// Writes by SDO, in segments where there are more than four bytes or none.
    pub(crate) fn write(&mut self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), AbortCode> {
        if (1..=4).contains(&bytes.len()) {
            let mut data = [0; 4];
            data[..bytes.len()].copy_from_slice(bytes);
            let command = 0x23 | (4 - bytes.len() as u8) << 2;
            return self.ask(request(command, index, sub, data)).map(drop);
        }
        self.ask(request(0x21, index, sub, (bytes.len() as u32).to_le_bytes()))?;
        let last = bytes.len().div_ceil(7).max(1) - 1;
        for (number, toggle) in (0..=last).zip([0x00, 0x10].into_iter().cycle()) {
            let segment = bytes.chunks(7).nth(number).unwrap_or_default();
            let unused = (7 - segment.len() as u8) << 1;
            let mut message = [toggle | unused | u8::from(number == last), 0, 0, 0, 0, 0, 0, 0];
            message[1..=segment.len()].copy_from_slice(segment);
            self.ask(message)?;
        }
        Ok(())
    }

    /// Sends an SDO request and takes its one answer; other frames are lost.
    fn ask(&mut self, message: [u8; 8]) -> Result<[u8; 8], AbortCode> {
        self.core.handle_frame(self.now, LINK, &Frame::new(Id::Standard(0x601), &message));
        let sent = self.frames().into_iter().filter(|frame| frame.id == Id::Standard(0x581));
        let answers: Vec<[u8; 8]> = sent.map(|frame| frame.eight().unwrap()).collect();
        let [answer] = answers[..] else { panic!("{message:02X?} has answers {answers:02X?}") };
        let [command, _, _, _, code @ ..] = answer;
        let code = u32::from_le_bytes(code);
        match AbortCode::ALL.iter().find(|known| known.code() == code) {
            Some(known) if command == 0x80 => Err(*known),
            _ => Ok(answer),
        }
    }

    /// Gives a PDO a new mapping by the procedure of CiA 301 v4.2, section 7.5.2.36, and makes it valid again.
    pub(crate) fn map(&mut self, communication: u16, mapped: &[u32]) -> Result<(), AbortCode> {
        let cob_id = self.invalidate(communication);
        let mapping = communication + 0x200;
        self.write(mapping, 0, &[0])?;
        for (sub, parameter) in (1..).zip(mapped) {
            self.write(mapping, sub, &parameter.to_le_bytes())?;
        }
        self.write(mapping, 0, &[mapped.len() as u8])?;
        self.write(communication, 1, &cob_id.to_le_bytes())
    }

    /// Makes a PDO not valid; gives the COB-ID that would make it valid again.
    pub(crate) fn invalidate(&mut self, communication: u16) -> u32 {
        let cob_id = self.number(communication, 1) as u32;
        self.write(communication, 1, &(cob_id | 1 << 31).to_le_bytes()).unwrap();
        cob_id
    }

    /// The device with TPDO 1 alone, of this transmission type and event timer; a remote frame may ask for it.
    pub(crate) fn with_tpdo(transmission: u8, event_timer: u16) -> Self {
        let mut tool = Self::new();
        for communication in 0x1800..0x1804 {
            tool.invalidate(communication);
        }
        tool.write(0x1800, 2, &[transmission]).unwrap();
        tool.write(0x1800, 5, &event_timer.to_le_bytes()).unwrap();
        tool.write(0x1800, 1, &0x181_u32.to_le_bytes()).unwrap();
        tool
    }
}

fn request(command: u8, index: u16, sub: u8, [a, b, c, d]: [u8; 4]) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    [command, low, high, sub, a, b, c, d]
}

fn parse(text: &str) -> Frame {
    let (id, data) = text.split_once('#').unwrap();
    let id = Id::Standard(u16::from_str_radix(id, 16).unwrap());
    if let Some(length) = data.strip_prefix('R') {
        return Frame::remote(id, length.parse().unwrap_or(0));
    }
    let byte = |at: usize| u8::from_str_radix(&data[at..at + 2], 16).unwrap();
    Frame::new(id, &(0..data.len()).step_by(2).map(byte).collect::<Vec<_>>())
}
