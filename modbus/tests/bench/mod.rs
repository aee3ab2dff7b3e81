//! A connection to a device, on virtual time. Frames are written as they stand on the wire, in hexadecimal.
#![allow(dead_code, unreachable_pub, reason = "not every test needs all of it")]

pub mod device;

use core::time::Duration;
use std::fmt::Write as _;
use std::sync::Arc;

use modbus::{Dialect, Framing, Identification, Map, Permissions, Server, Target, WordOrder, tcp_adu};
use od::{Address, Bus, Dictionary, Instant, Origin};

/// The only unit there is.
pub const UNIT: u8 = 1;

pub const ORIGIN: Origin = Origin { bus: Bus::Modbus, link: 0, client: 7 };

pub struct Bench {
    pub now: Instant,
    pub server: Server,
    pub map: Map,
    pub dictionary: Dictionary,
    pub communication: Dictionary,
    pub identification: Identification,
}

impl Bench {
    pub fn new(dialect: Dialect) -> Self {
        Self::with(dialect, WordOrder::LowFirst, Framing::Tcp, Permissions::default(), None)
    }

    pub fn with(
        dialect: Dialect,
        order: WordOrder,
        framing: Framing,
        permissions: Permissions,
        idle_timeout: Option<Duration>,
    ) -> Self {
        let now = Instant::from_nanos(1_000_000_000);
        let dictionary = device::dictionary();
        Self {
            now,
            server: Server::new(now, framing, ORIGIN, Arc::new(permissions), idle_timeout),
            map: device::map(&dictionary, dialect, order),
            dictionary,
            communication: device::communication(),
            identification: device::identification(),
        }
    }

    /// Answers one request, if one is there.
    pub fn serve_one(&mut self) -> bool {
        let Some(unit) = self.server.poll_request() else { return false };
        let target = (unit == UNIT).then_some(Target {
            map: &self.map,
            dictionary: &mut self.dictionary,
            communication: Some(&self.communication),
            identification: &self.identification,
        });
        self.server.answer(self.now, target);
        true
    }

    /// Takes what the server has to say.
    pub fn take_output(&mut self) -> Vec<u8> {
        let output = self.server.output().to_vec();
        self.server.sent(output.len());
        output
    }

    /// Sends bytes and answers everything; what comes back.
    pub fn send(&mut self, mut bytes: &[u8]) -> Vec<u8> {
        let mut answers = Vec::new();
        while !bytes.is_empty() {
            let taken = self.server.handle_bytes(self.now, bytes);
            bytes = &bytes[taken..];
            while self.serve_one() {
                answers.extend(self.take_output());
            }
        }
        answers
    }

    /// Sends a frame, or several, and gives what comes back.
    pub fn exchange(&mut self, request: &str) -> String {
        let bytes = bytes(request);
        hex(&self.send(&bytes))
    }

    /// Sends a PDU to the unit and gives the PDU that comes back.
    pub fn ask(&mut self, pdu: &str) -> String {
        let answer = self.send(&tcp_adu(0x0A0B, UNIT, &bytes(pdu)));
        assert_eq!(answer.get(..2), Some(&[0x0A, 0x0B][..]), "the transaction identifier comes back");
        assert_eq!(answer.get(6), Some(&UNIT), "the unit identifier comes back");
        hex(&answer[7..])
    }

    pub fn raw(&self, index: u16, sub: u8) -> u64 {
        self.dictionary.raw(self.dictionary.find(Address::new(index, sub)).unwrap())
    }

    pub fn set(&mut self, index: u16, sub: u8, raw: u64) {
        let slot = self.dictionary.find(Address::new(index, sub)).unwrap();
        self.dictionary.set(slot, raw);
    }

    /// The first register of an entry in the range of the application.
    pub fn register(&self, index: u16, sub: u8) -> u16 {
        let slot = self.dictionary.find(Address::new(index, sub)).unwrap();
        self.map.listing().find(|l| l.slot == slot && (0x1000..0x8000).contains(&l.first)).unwrap().first
    }
}

/// The bytes that a text in hexadecimal stands for; spaces mean nothing.
pub fn bytes(text: &str) -> Vec<u8> {
    let digits: Vec<u8> =
        text.chars().filter(|c| !c.is_whitespace()).map(|c| c.to_digit(16).unwrap() as u8).collect();
    assert!(digits.len().is_multiple_of(2), "half a byte in {text}");
    digits.chunks_exact(2).map(|pair| pair[0] << 4 | pair[1]).collect()
}

pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let separator = if text.is_empty() { "" } else { " " };
        write!(text, "{separator}{byte:02X}").unwrap();
        text
    })
}
