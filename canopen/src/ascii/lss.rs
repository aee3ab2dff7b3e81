//! The LSS master of a network, for all clients: one exchange at a time.

use core::time::Duration;
use std::collections::VecDeque;

use od::Instant;

use super::answer::{Answer, GatewayError};
use super::client::Ticket;
use super::command::Lss;
use crate::lss::{LssAddress, REQUEST, command as specifier};
use crate::lss_master::with_number;
use crate::{Frame, Id, LssMaster, LssStep, LssTask};

/// How long a slave has for an answer; it may have to write to a disk.
const PATIENCE: Duration = Duration::from_secs(3);
/// Parts of an address.
const PARTS: u8 = 4;

/// What a slave is asked, and what is made of its answer.
#[derive(Clone, Debug)]
struct Exchange {
    ticket: Ticket,
    /// The command specifier of the answer.
    expects: u8,
    /// When the answer comes too late.
    deadline: Instant,
    then: Then,
}

/// What the answer of a slave says.
#[derive(Clone, Debug)]
enum Then {
    /// That it is so.
    Done,
    /// This is told once it is so.
    Told(LssAddress),
    /// Its error code: one is this error.
    Code(GatewayError),
    /// The Node-ID.
    NodeId,
    /// A part of the address.
    Part,
    /// A part of the address, behind which others are asked for.
    Parts(Vec<u32>),
}

#[derive(Debug)]
enum Operation {
    Exchange(Exchange),
    Scan { ticket: Ticket, master: LssMaster, wake: Instant },
}

impl Operation {
    fn ticket(&self) -> Ticket {
        match self {
            Self::Exchange(Exchange { ticket, .. }) | Self::Scan { ticket, .. } => *ticket,
        }
    }
}

/// What is under way, and what waits for that.
#[derive(Debug, Default)]
pub(super) struct Services {
    current: Option<Operation>,
    waiting: VecDeque<(Ticket, Lss)>,
    /// What is to be sent, and for which client.
    frames: VecDeque<(u64, Frame)>,
}

type Ended = Option<(Ticket, Answer)>;

impl Services {
    /// Does this after what is to be done already; what has no answer has ended at once.
    pub(super) fn add(&mut self, now: Instant, ticket: Ticket, request: Lss) -> Ended {
        self.waiting.push_back((ticket, request));
        self.begin(now)
    }

    /// Forgets what this client waits for. A scan ends; slaves wait again then.
    pub(super) fn forget(&mut self, client: u64) {
        self.waiting.retain(|(ticket, _)| ticket.client != client);
        let own = self.current.take_if(|operation| operation.ticket().client == client);
        if let Some(Operation::Scan { .. }) = own {
            self.send(client, [specifier::SWITCH_GLOBAL, 0, 0, 0, 0, 0, 0, 0]);
        }
    }

    /// The next frame to send, and for which client.
    pub(super) fn poll_transmit(&mut self) -> Option<(u64, Frame)> {
        self.frames.pop_front()
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.current.as_ref().map(|operation| match operation {
            Operation::Exchange(exchange) => exchange.deadline,
            Operation::Scan { wake, .. } => *wake,
        })
    }

    /// Takes what a slave says.
    pub(super) fn handle_answer(&mut self, now: Instant, answer: [u8; 8]) -> Ended {
        match self.current.take() {
            Some(Operation::Exchange(exchange)) if answer.first() == Some(&exchange.expects) => {
                self.conclude(now, exchange, answer)
            }
            Some(Operation::Scan { ticket, master, .. }) => self.scan(now, ticket, master, Some(answer)),
            other => {
                // Somebody says what was not asked.
                self.current = other;
                None
            }
        }
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) -> Ended {
        if self.poll_timeout().is_none_or(|deadline| deadline > now) {
            return None;
        }
        match self.current.take()? {
            Operation::Exchange(exchange) => Some((exchange.ticket, Answer::Failed(GatewayError::TimedOut))),
            Operation::Scan { ticket, master, .. } => self.scan(now, ticket, master, None),
        }
    }

    /// Begins what waits, once nothing is under way.
    pub(super) fn begin(&mut self, now: Instant) -> Ended {
        if self.current.is_some() {
            return None;
        }
        let (ticket, request) = self.waiting.pop_front()?;
        let client = ticket.client;
        let code = |error| Then::Code(error);
        let one = |byte: u8, argument: u8| [byte, argument, 0, 0, 0, 0, 0, 0];
        match request {
            Lss::SwitchGlobal { to_configuration } => {
                self.send(client, one(specifier::SWITCH_GLOBAL, to_configuration.into()));
                return Some((ticket, Answer::Done));
            }
            Lss::ActivateBitRate { delay_ms } => {
                let [low, high] = delay_ms.to_le_bytes();
                self.send(client, [specifier::ACTIVATE_BIT_TIMING, low, high, 0, 0, 0, 0, 0]);
                return Some((ticket, Answer::Done));
            }
            Lss::SwitchSelective(address) => self.select(now, ticket, address, Then::Done),
            Lss::SetNodeId(node_id) => {
                self.send(client, one(specifier::CONFIGURE_NODE_ID, node_id));
                self.expect(now, ticket, specifier::CONFIGURE_NODE_ID, code(GatewayError::LssNodeId));
            }
            Lss::SetBitRate { table, index } => {
                self.send(client, [specifier::CONFIGURE_BIT_TIMING, table, index, 0, 0, 0, 0, 0]);
                self.expect(now, ticket, specifier::CONFIGURE_BIT_TIMING, code(GatewayError::LssBitRate));
            }
            Lss::Store => {
                self.send(client, one(specifier::STORE, 0));
                self.expect(now, ticket, specifier::STORE, code(GatewayError::LssStore));
            }
            Lss::InquirePart(part) => self.inquire(now, ticket, part, Then::Part),
            Lss::InquireAddress => self.inquire(now, ticket, 0, Then::Parts(Vec::new())),
            Lss::InquireNodeId => {
                self.send(client, one(specifier::INQUIRE_NODE_ID, 0));
                self.expect(now, ticket, specifier::INQUIRE_NODE_ID, Then::NodeId);
            }
            Lss::Identify(bounds) => {
                for (number, bound) in (specifier::IDENTIFY..).zip(bounds) {
                    self.send(client, with_number(number, bound));
                }
                self.expect(now, ticket, specifier::IDENTIFIED, Then::Done);
            }
            Lss::IdentifyUnconfigured => {
                self.send(client, one(specifier::IDENTIFY_UNCONFIGURED, 0));
                self.expect(now, ticket, specifier::UNCONFIGURED_IDENTIFIED, Then::Done);
            }
            Lss::Fastscan(window) => {
                let master = LssMaster::new(LssTask::Scan);
                let master = window.map_or(master.clone(), |window| master.with_window(window));
                return self.scan(now, ticket, master, None);
            }
        }
        None
    }

    fn send(&mut self, client: u64, message: [u8; 8]) {
        self.frames.push_back((client, Frame::new(Id::Standard(REQUEST), &message)));
    }

    fn expect(&mut self, now: Instant, ticket: Ticket, expects: u8, then: Then) {
        self.current =
            Some(Operation::Exchange(Exchange { ticket, expects, deadline: now + PATIENCE, then }));
    }

    fn select(&mut self, now: Instant, ticket: Ticket, address: LssAddress, then: Then) {
        for (number, part) in (specifier::SWITCH_SELECTIVE..).zip(address) {
            self.send(ticket.client, with_number(number, part));
        }
        self.expect(now, ticket, specifier::SWITCHED, then);
    }

    fn inquire(&mut self, now: Instant, ticket: Ticket, part: u8, then: Then) {
        let number = specifier::INQUIRE.saturating_add(part);
        self.send(ticket.client, [number, 0, 0, 0, 0, 0, 0, 0]);
        self.expect(now, ticket, number, then);
    }

    fn conclude(&mut self, now: Instant, exchange: Exchange, answer: [u8; 8]) -> Ended {
        let Exchange { ticket, then, .. } = exchange;
        let [_, first, b, c, d, ..] = answer;
        let number = u32::from_le_bytes([first, b, c, d]);
        let told = match then {
            Then::Done => Answer::Done,
            Then::Told(address) => Answer::Value(address_text(&address)),
            Then::Code(_) if first == 0 => Answer::Done,
            Then::Code(error @ GatewayError::LssStore) if matches!(first, 1 | 2) => Answer::Failed(error),
            Then::Code(error) if first == 1 => Answer::Failed(error),
            Then::Code(_) => Answer::Failed(GatewayError::Lss),
            Then::NodeId => Answer::Value(first.to_string()),
            Then::Part => Answer::Value(format!("0x{number:08X}")),
            Then::Parts(mut parts) => {
                parts.push(number);
                let next = parts.len() as u8;
                if next < PARTS {
                    self.inquire(now, ticket, next, Then::Parts(parts));
                    return None;
                }
                Answer::Value(address_text(&parts))
            }
        };
        Some((ticket, told))
    }

    /// Goes on with a scan; the slave that is found is selected.
    fn scan(
        &mut self,
        now: Instant,
        ticket: Ticket,
        mut master: LssMaster,
        mut answer: Option<[u8; 8]>,
    ) -> Ended {
        loop {
            match master.next(now, answer.take()) {
                LssStep::Send(frame) => self.frames.push_back((ticket.client, frame)),
                LssStep::Wait(wake) => {
                    self.current = Some(Operation::Scan { ticket, master, wake });
                    return None;
                }
                LssStep::Done(Ok(found)) => {
                    self.select(now, ticket, found.address, Then::Told(found.address));
                    return None;
                }
                LssStep::Done(Err(_)) => return Some((ticket, Answer::Failed(GatewayError::TimedOut))),
            }
        }
    }
}

fn address_text(parts: &[u32]) -> String {
    let parts: Vec<String> = parts.iter().map(|part| format!("0x{part:08X}")).collect();
    parts.join(" ")
}
