//! The gateway: clients on one side, networks on the other.

use core::time::Duration;
use std::collections::{BTreeMap, VecDeque};

use od::Instant;

use super::answer::{Answer, GatewayError};
use super::channel::{Job, Transfer};
use super::client::{Client, Pending, Ticket, Told};
use super::command::{Command, Line, Request, parse};
use super::network::{Event, Network};
use super::pdo::{Rpdo, Tpdo};
use crate::{Frame, Id, SdoMode, UNCONFIGURED};

/// NMT commands and SYNC.
const NMT: Id = Id::Standard(0x000);
const SYNC: Id = Id::Standard(0x080);
/// How long the answer to a remote frame may take, unless a client sets a time-out for commands.
const PDO_TIMEOUT: Duration = Duration::from_secs(1);
/// The class of a gateway with SDO, NMT, PDO and LSS services, and the version of the protocol (CiA 309-1).
const CLASS: u8 = 3;
const PROTOCOL: &str = "2.0";

/// A gateway between clients that speak in lines and networks, each with a number from 1.
///
/// Hand it what clients say, the frames of its networks and the time; send what [`AsciiGateway::poll_transmit`] yields, and
/// tell clients what [`AsciiGateway::poll_line`] does. A client has at most one command under way, whose answer is one
/// [`Told::Answer`]; it gives the next one after that.
#[derive(Debug, Default)]
pub struct AsciiGateway {
    networks: BTreeMap<u16, Network>,
    clients: BTreeMap<u64, Client>,
    commands: u64,
    lines: VecDeque<(u64, Told)>,
    frames: VecDeque<Outgoing>,
}

/// A frame that the gateway sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outgoing {
    /// On which network.
    pub network: u16,
    /// The client whose command it is of; none if it is of the gateway itself.
    pub client: Option<u64>,
    /// The frame.
    pub frame: Frame,
}

impl AsciiGateway {
    /// One for the networks with these numbers.
    #[must_use]
    pub fn new(networks: impl IntoIterator<Item = u16>) -> Self {
        let networks = networks.into_iter().map(|number| (number, Network::default())).collect();
        Self { networks, ..Self::default() }
    }

    /// Serves one more client. Where there is one network only, its commands are for that.
    pub fn connect(&mut self, client: u64) {
        let mut numbers = self.networks.keys();
        let only = numbers.next().copied().filter(|_| numbers.next().is_none());
        self.clients.insert(client, Client::new(only));
    }

    /// Ends what goes on for a client that has left.
    pub fn disconnect(&mut self, now: Instant, client: u64) {
        self.clients.remove(&client);
        self.networks.values_mut().for_each(|network| network.forget(now, client));
        self.settle(now, Vec::new());
    }

    /// The longest line that a client may send now, without its end.
    #[must_use]
    pub fn longest_line(&self, client: u64) -> usize {
        self.clients.get(&client).map_or(0, |client| client.longest_line)
    }

    /// Takes a line without its end. Whether there will be an answer: a line that asks for nothing has none, nor has one of a
    /// client that still waits for the answer to another.
    pub fn handle_line(&mut self, now: Instant, client: u64, line: &[u8]) -> bool {
        let Some(own) = self.clients.get_mut(&client).filter(|own| own.pending.is_none()) else {
            return false;
        };
        let too_long = line.len() > own.longest_line;
        let line = match str::from_utf8(line) {
            Ok(text) if !too_long => parse(text),
            Ok(_) | Err(_) => Some(Line { sequence: 0, request: Err(GatewayError::Syntax) }),
        };
        let Some(Line { sequence, request }) = line else { return false };
        self.commands += 1;
        let deadline = own.command_timeout.map(|time| now + time);
        own.pending = Some(Pending { number: self.commands, sequence, deadline, awaits_pdo: None });
        let ticket = Ticket { client, number: self.commands };
        let ended = match request.and_then(|request| self.begin(now, ticket, request)) {
            Ok(None) => Vec::new(),
            Ok(Some(answer)) => vec![(ticket, answer)],
            Err(error) => vec![(ticket, Answer::Failed(error))],
        };
        self.settle(now, ended);
        true
    }

    /// Takes a frame that was on a network and not sent by this gateway.
    pub fn handle_frame(&mut self, now: Instant, network: u16, frame: &Frame) {
        let mut ended = Vec::new();
        let Some(own) = self.networks.get_mut(&network) else { return };
        if let Some(event) = own.handle_frame(now, frame, &mut ended) {
            self.tell_all(network, event);
        }
        self.exchange_pdos(network, frame, &mut ended);
        self.settle(now, ended);
    }

    /// Does what is due at `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        let mut ended = Vec::new();
        let mut events = Vec::new();
        for (number, network) in &mut self.networks {
            events.extend(network.handle_timeout(now, &mut ended).into_iter().map(|event| (*number, event)));
        }
        events.into_iter().for_each(|(network, event)| self.tell_all(network, event));
        self.settle(now, ended);
        let late = self.clients.iter().filter_map(|(client, own)| {
            let pending = own.pending.filter(|p| p.deadline.is_some_and(|deadline| deadline <= now))?;
            Some(Ticket { client: *client, number: pending.number })
        });
        let late: Vec<Ticket> = late.collect();
        for ticket in late {
            self.networks.values_mut().for_each(|network| network.abandon(now, ticket.client));
            self.settle(now, vec![(ticket, Answer::Failed(GatewayError::TimedOut))]);
        }
    }

    /// When it wants [`AsciiGateway::handle_timeout`] to be called.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let networks = self.networks.values().filter_map(Network::poll_timeout);
        networks.chain(self.clients.values().filter_map(|client| client.pending?.deadline)).min()
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self) -> Option<Outgoing> {
        self.frames.pop_front()
    }

    /// The next line, without its end, and for which client.
    pub fn poll_line(&mut self) -> Option<(u64, Told)> {
        self.lines.pop_front()
    }
}

impl AsciiGateway {
    /// Begins what is asked; its answer, if it has one already.
    fn begin(
        &mut self,
        now: Instant,
        ticket: Ticket,
        request: Request,
    ) -> Result<Option<Answer>, GatewayError> {
        let Request { target, command } = request;
        let own = self.clients.get_mut(&ticket.client).ok_or(GatewayError::State)?;
        let (net, node_id) = own.resolve(command.scope(), target)?;
        match command {
            Command::SetNetwork(number) => {
                let is_known = self.networks.contains_key(&number);
                own.net = Some(is_known.then_some(number).ok_or(GatewayError::UnsupportedNet)?);
                Ok(Some(Answer::Done))
            }
            Command::SetCommandTimeout(time) => {
                own.command_timeout = Some(time).filter(|time| !time.is_zero());
                Ok(Some(Answer::Done))
            }
            Command::SetCommandSize(size) => {
                own.longest_line = size;
                Ok(Some(Answer::Done))
            }
            Command::Version => Ok(Some(Answer::Value(version()))),
            command => {
                let network = self.networks.get_mut(&net).ok_or(GatewayError::UnsupportedNet)?;
                let place = Place { now, ticket, net, node_id };
                place.begin(own, network, command)
            }
        }
    }

    /// PDOs that come and that are due with this frame, for every client.
    fn exchange_pdos(&mut self, network: u16, frame: &Frame, ended: &mut Vec<(Ticket, Answer)>) {
        for (client, own) in &mut self.clients {
            let awaited = own.pending.and_then(|pending| Some((pending.number, pending.awaits_pdo?)));
            for (place @ (_, _), rpdo) in own.rpdos.range_mut((network, 0)..=(network, u16::MAX)) {
                if !rpdo.take(frame) {
                    continue;
                }
                let Some(text) = rpdo.text() else { continue };
                let text = format!("{network} {text}");
                match awaited {
                    Some((number, awaited)) if awaited == *place => {
                        ended.push((Ticket { client: *client, number }, Answer::Value(text)));
                    }
                    Some(_) | None => self.lines.push_back((*client, Told::Event(text))),
                }
            }
            let is_sync = frame.id == SYNC && !frame.is_remote && frame.len() <= 1;
            for tpdo in own.tpdos.range_mut((network, 0)..=(network, u16::MAX)).map(|(_, tpdo)| tpdo) {
                let due = if is_sync { tpdo.sync() } else { tpdo.requested(frame) };
                self.frames.extend(due.map(|frame| Outgoing { network, client: Some(*client), frame }));
            }
        }
    }

    fn tell_all(&mut self, network: u16, event: Event) {
        let text = match event {
            Event::BootUp(node_id) => format!("{network} {node_id} BOOT_UP"),
            Event::Error(node_id, error) => format!("{network} {node_id} ERROR {error}"),
            Event::Emergency(node_id, emergency) => {
                let (code, register) = (emergency.code, emergency.register.bits());
                let detail = emergency.detail.map(|byte| byte.to_string()).join(" ");
                format!("{network} {node_id} EMCY {code:04X} {register:02X} {detail}")
            }
        };
        let is_boot_up = matches!(event, Event::BootUp(_));
        let told = self.clients.iter().filter(|(_, own)| own.tells_boot_up || !is_boot_up);
        self.lines.extend(told.map(|(client, _)| (*client, Told::Event(text.clone()))));
    }

    /// Answers what has ended, and takes what the networks have to send.
    fn settle(&mut self, now: Instant, mut ended: Vec<(Ticket, Answer)>) {
        for (number, network) in &mut self.networks {
            let frames = network.poll_transmit(now, &mut ended).into_iter();
            self.frames.extend(frames.map(|(client, frame)| Outgoing { network: *number, client, frame }));
        }
        for (ticket, answer) in ended {
            let Some(own) = self.clients.get_mut(&ticket.client) else { continue };
            // One that has been answered with a time-out is not told again.
            if let Some(pending) = own.pending.take_if(|pending| pending.number == ticket.number) {
                self.lines
                    .push_back((ticket.client, Told::Answer(format!("[{}] {answer}", pending.sequence))));
            }
        }
    }
}

/// Whom a command is from and for.
struct Place {
    now: Instant,
    ticket: Ticket,
    net: u16,
    node_id: u8,
}

impl Place {
    fn begin(
        self,
        own: &mut Client,
        network: &mut Network,
        command: Command,
    ) -> Result<Option<Answer>, GatewayError> {
        let Self { now, ticket, net, .. } = self;
        match command {
            Command::Read { address, form } => {
                let (node_id, transfer) = (self.one()?, Transfer::Upload(form));
                network.transfer(now, node_id, job(own, ticket, address, transfer));
                return Ok(None);
            }
            Command::Write { address, data } => {
                let (node_id, transfer) = (self.one()?, Transfer::Download(data));
                network.transfer(now, node_id, job(own, ticket, address, transfer));
                return Ok(None);
            }
            Command::Lss(request) => {
                return Ok(network.lss.add(now, ticket, request).map(|(_, answer)| answer));
            }
            Command::ReadPdo(number) => return read_pdo(now, own, network, (ticket.client, net, number)),
            Command::Nmt(command) => {
                network.send(ticket.client, Frame::new(NMT, &[command as u8, self.node_id]));
            }
            Command::EnableGuarding { period, .. } if period.is_zero() => return Err(GatewayError::Syntax),
            Command::EnableGuarding { period, factor } => {
                network.guard(now, ticket.client, self.one()?, (period, factor));
            }
            Command::EnableHeartbeat(time) if time.is_zero() => return Err(GatewayError::Syntax),
            Command::EnableHeartbeat(time) => network.expect_heartbeat(ticket.client, self.one()?, time),
            Command::DisableGuarding => network.unwatch(self.one()?, true),
            Command::DisableHeartbeat => network.unwatch(self.one()?, false),
            Command::SetSdoTimeout(time) if time.is_zero() => return Err(GatewayError::Syntax),
            Command::SetSdoTimeout(time) => own.sdo_timeout = time,
            Command::SetSdoBlock(is_on) => own.sdo_blocks = is_on,
            Command::SetNode(node_id @ 1..=127) => own.node = Some(node_id),
            Command::SetNode(_) => return Err(GatewayError::UnsupportedNode),
            Command::BootUpIndication(is_on) => own.tells_boot_up = is_on,
            Command::SetRpdo(setup) => _ = own.rpdos.insert((net, setup.number), Rpdo::new(setup)),
            Command::SetTpdo(setup) => _ = own.tpdos.insert((net, setup.number), Tpdo::new(setup)),
            Command::WritePdo { number, values } => {
                let tpdo = own.tpdos.get_mut(&(net, number)).ok_or(GatewayError::State)?;
                tpdo.write(&values)?.into_iter().for_each(|frame| network.send(ticket.client, frame));
            }
            Command::SetNodeId(node_id) => {
                network.set_node_id(Some(node_id).filter(|id| *id != UNCONFIGURED));
            }
            Command::SetHeartbeat(period) => network.set_heartbeat(now, period)?,
            Command::Initialise => return Err(GatewayError::NotSupported),
            // They are for no network, and done before.
            Command::SetNetwork(_)
            | Command::SetCommandTimeout(_)
            | Command::SetCommandSize(_)
            | Command::Version => return Err(GatewayError::State),
        }
        Ok(Some(Answer::Done))
    }

    /// The node that it is for; only NMT commands can be for all.
    fn one(&self) -> Result<u8, GatewayError> {
        Some(self.node_id).filter(|node_id| *node_id != 0).ok_or(GatewayError::UnsupportedNode)
    }
}

fn job(own: &Client, ticket: Ticket, address: od::Address, transfer: Transfer) -> Job {
    let mode = if own.sdo_blocks { SdoMode::Block { threshold: 0 } } else { SdoMode::Ordinary };
    Job { ticket, address, transfer, mode, timeout: own.sdo_timeout }
}

/// What came last; one that is sent when it is asked for is waited for.
fn read_pdo(
    now: Instant,
    own: &mut Client,
    network: &mut Network,
    (client, net, number): (u64, u16, u16),
) -> Result<Option<Answer>, GatewayError> {
    let place = (net, number);
    let rpdo = own.rpdos.get(&place).ok_or(GatewayError::State)?;
    if let (Some(request), Some(pending)) = (rpdo.request(), &mut own.pending) {
        pending.awaits_pdo = Some(place);
        pending.deadline = pending.deadline.or(Some(now + PDO_TIMEOUT));
        network.send(client, request);
        return Ok(None);
    }
    let text = rpdo.text().ok_or(GatewayError::State)?;
    Ok(Some(Answer::Value(format!("{net} {text}"))))
}

/// Vendor-ID, product code, revision and serial number of the gateway, its class, and the versions of protocol and
/// implementation.
fn version() -> String {
    let (major, minor) = (env!("CARGO_PKG_VERSION_MAJOR"), env!("CARGO_PKG_VERSION_MINOR"));
    format!("0 0 {major}.{minor} 0 {CLASS} {PROTOCOL} {major}.{minor}")
}
