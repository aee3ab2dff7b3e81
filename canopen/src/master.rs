//! NMT master: boots the slaves of a network and watches over them (CiA 302-2).

mod assignment;
mod dcf;
mod guard;
mod slave;

use std::collections::VecDeque;

use od::{AbortCode, Address, Dictionary, Instant};

use crate::cob_id::NMT;
use crate::heartbeat::Consumer;
use crate::{Frame, Id, NmtCommand, NmtState, SdoError};
use assignment::{Assignment, Startup};
use slave::{Outcome, Slave};

pub use dcf::{DcfEntry, DcfError, decode_dcf, encode_dcf};

/// How the boot procedure of a slave has ended; the discriminant is the letter of CiA 302-2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum BootStatus {
    /// 0x1F81 does not have the node as a slave.
    NotListed = b'A',
    /// It did not answer when its device type was read.
    NoResponse = b'B',
    /// Its device type is not that of 0x1F84.
    DeviceType = b'C',
    /// Its Vendor-ID is not that of 0x1F85.
    VendorId = b'D',
    /// Its heartbeat, which was to tell whether it is OPERATIONAL, did not come.
    Heartbeat = b'E',
    /// It did not answer to guarding, which was to tell whether it is OPERATIONAL.
    Guarding = b'F',
    /// Its program is to be verified, and there is nothing to do it with.
    ProgramNotConfigured = b'G',
    /// Its configuration was refused, or is no concise DCF, or is missing.
    Configuration = b'J',
    /// Its heartbeat did not come when it was to be supervised.
    HeartbeatStart = b'K',
    /// It was OPERATIONAL before and was left so. This is no error.
    WasOperational = b'L',
    /// Its product code is not that of 0x1F86.
    ProductCode = b'M',
    /// Its revision number is not that of 0x1F87.
    RevisionNumber = b'N',
    /// Its serial number is not that of 0x1F88.
    SerialNumber = b'O',
}

impl BootStatus {
    /// The letter of the standard.
    #[must_use]
    pub const fn letter(self) -> char {
        self as u8 as char
    }
}

/// How a slave that had booted was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// Its heartbeat did not come in time (0x1016).
    Heartbeat,
    /// It did not answer to guarding as often as 0x1F81 tolerates.
    Guarding,
    /// It has booted without being told to.
    BootUp,
}

/// What the owner of a master is to know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MasterEvent {
    /// A slave has booted; it was started if 0x1F80 says so.
    Booted {
        /// The slave.
        node_id: u8,
        /// Whether it was OPERATIONAL before ([`BootStatus::WasOperational`]).
        was_operational: bool,
    },
    /// A slave could not be booted. Unless the network is halted, its next boot-up message begins the procedure anew.
    BootFailed {
        /// The slave.
        node_id: u8,
        /// Why.
        status: BootStatus,
        /// The SDO transfer that failed, if that is why.
        transfer: Option<(Address, SdoError)>,
    },
    /// A slave that had booted is lost.
    Lost {
        /// The slave.
        node_id: u8,
        /// How.
        loss: Loss,
    },
    /// All mandatory slaves have booted.
    Started {
        /// Whether the node of the master is to enter OPERATIONAL now (0x1F80, bit 2).
        enters_operational: bool,
    },
    /// A mandatory slave has failed, or all were stopped after one was lost: the network is not started any further.
    Halted,
}

/// How far the network is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Network {
    /// The master was not started, or is none.
    Idle,
    /// Mandatory slaves are missing, which may take so long.
    Booting(Option<Instant>),
    /// All mandatory slaves have booted.
    Started,
    /// It is not started any further.
    Halted,
}

/// Frames and events that may wait.
const MAX_WAITING: usize = 1024;

/// What waits to be sent and told.
#[derive(Debug, Default)]
struct Outbox {
    frames: VecDeque<Frame>,
    events: VecDeque<MasterEvent>,
    dropped: u64,
}

impl Outbox {
    fn send(&mut self, frame: Frame) {
        push(&mut self.frames, frame, &mut self.dropped);
    }

    /// Sends an NMT command; Node-ID 0 is for all.
    fn command(&mut self, command: NmtCommand, node_id: u8) {
        self.send(Frame::new(Id::Standard(NMT), &[command as u8, node_id]));
    }

    fn tell(&mut self, event: MasterEvent) {
        push(&mut self.events, event, &mut self.dropped);
    }
}

fn push<T>(queue: &mut VecDeque<T>, item: T, dropped: &mut u64) {
    if queue.len() < MAX_WAITING {
        queue.push_back(item);
    } else {
        *dropped += 1;
    }
}

/// Sub-index of 0x1F82 that stands for all nodes.
const ALL_NODES: u8 = 0x80;

/// The NMT master of a network, an engine that stands beside the [`crate::Node`] of the same device: it does not hear what its
/// node sends, and its node does not hear it.
///
/// Each slave is asked by its default SDO server. Whoever drives the master hands it the frames with
/// [`Master::subscriptions`], serves its deadlines, sends what it yields and lets its node follow [`MasterEvent::Started`].
#[derive(Debug)]
pub struct Master {
    startup: Startup,
    slaves: Vec<Slave>,
    consumer: Consumer,
    network: Network,
    outbox: Outbox,
}

impl Master {
    /// A master that does what these communication parameters say now: 0x1016, 0x1F22, 0x1F26, 0x1F27, 0x1F80, 0x1F81 and
    /// 0x1F84-0x1F8A, the latter by Node-ID. Those that are missing are as zero. It is silent until [`Master::start`].
    #[must_use]
    pub fn new(parameters: &Dictionary) -> Self {
        let mut consumer = Consumer::default();
        consumer.reload_all(parameters);
        let others = (1..=127).filter(|node_id| *node_id != parameters.node_id());
        let assignments = others.filter_map(|node_id| Assignment::read(parameters, node_id));
        let slaves = assignments.map(|slave| {
            let heartbeat = consumer.time(slave.node_id);
            Slave::new(slave, heartbeat)
        });
        Self {
            startup: Startup::read(parameters),
            slaves: slaves.collect(),
            consumer,
            network: Network::Idle,
            outbox: Outbox::default(),
        }
    }

    /// The identifiers that it listens to: SDO answers and error control of its slaves.
    pub fn subscriptions(&self) -> impl Iterator<Item = Id> {
        self.slaves.iter().flat_map(Slave::subscriptions)
    }

    /// Starts the network: resets the communication of the slaves, but of those that are to be kept alive, and boots them.
    /// Does nothing if this device is no master (0x1F80, bit 0).
    pub fn start(&mut self, now: Instant) {
        if !self.startup.is_master() {
            return;
        }
        let is_any_kept = self.slaves.iter().any(|slave| slave.assignment.is_kept_alive());
        if !is_any_kept {
            self.outbox.command(NmtCommand::ResetCommunication, 0);
        }
        for position in 0..self.slaves.len() {
            let Some(slave) = self.slaves.get_mut(position) else { continue };
            let Assignment { node_id, .. } = slave.assignment;
            if !slave.assignment.is_kept_alive() {
                if is_any_kept {
                    self.outbox.command(NmtCommand::ResetCommunication, node_id);
                }
                self.await_slave(now, position);
            } else if slave.assignment.is_booted() {
                slave.boot(now);
            }
        }
        self.begin(now);
    }

    /// Boots one slave, as an application does with those that are not booted by themselves (0x1F81, bit 2).
    pub fn boot(&mut self, now: Instant, node_id: u8) {
        if let Some(slave) = self.slaves.iter_mut().find(|slave| slave.assignment.node_id == node_id) {
            slave.boot(now);
        } else {
            let (status, transfer) = (BootStatus::NotListed, None);
            self.outbox.tell(MasterEvent::BootFailed { node_id, status, transfer });
        }
    }

    /// What sub-index `sub` of 0x1F82 shows: the NMT state of a slave, 0 if it is not known, 1 if the slave is missing.
    ///
    /// # Errors
    /// [`AbortCode::NoSubIndex`].
    pub fn state(&self, sub: u8) -> Result<u8, AbortCode> {
        match sub {
            1..=127 => {
                let slave = self.position(sub).and_then(|position| self.slaves.get(position));
                Ok(slave.map_or(UNKNOWN, |slave| match slave.state() {
                    Some(state) => state as u8,
                    None if slave.is_missing() => MISSING,
                    None => UNKNOWN,
                }))
            }
            _ => Err(AbortCode::NoSubIndex),
        }
    }

    /// What a write of `value` to sub-index `sub` of 0x1F82 does: 4 stops the node, 5 starts it, 6 resets it, 7 resets its
    /// communication, 127 makes it PRE-OPERATIONAL; sub-index 0x80 is for all nodes. A reset begins a boot.
    ///
    /// # Errors
    /// [`AbortCode::NoSubIndex`], [`AbortCode::InvalidValue`], or [`AbortCode::DeviceState`] if this device is no master.
    pub fn request(&mut self, now: Instant, sub: u8, value: u8) -> Result<(), AbortCode> {
        let node_id = match sub {
            1..=127 => sub,
            ALL_NODES => 0,
            _ => return Err(AbortCode::NoSubIndex),
        };
        let command = match value {
            4 => NmtCommand::Stop,
            5 => NmtCommand::Start,
            6 => NmtCommand::ResetNode,
            7 => NmtCommand::ResetCommunication,
            127 => NmtCommand::EnterPreOperational,
            _ => return Err(AbortCode::InvalidValue),
        };
        if !self.startup.is_master() {
            return Err(AbortCode::DeviceState);
        }
        self.command(now, command, node_id);
        Ok(())
    }

    /// Takes a frame; those that are not from its slaves are ignored.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if frame.is_remote {
            return;
        }
        let hears = |slave: &Slave| slave.subscriptions().contains(&frame.id);
        let Some(position) = self.slaves.iter().position(hears) else { return };
        let Some(slave) = self.slaves.get_mut(position) else { return };
        let [answers, _] = slave.subscriptions();
        let outcome = match *frame.payload() {
            _ if frame.id == answers => slave.handle_answer(now, frame, &mut self.outbox),
            [byte] => {
                let outcome = slave.handle_error_control(now, byte, &mut self.outbox);
                self.feed(now, frame);
                outcome
            }
            _ => None,
        };
        self.conclude(now, position, outcome);
    }

    /// Does what is due at `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        while let Some(producer) = self.consumer.expire(now) {
            let position = self.position(producer);
            let is_booted = |p: &usize| self.slaves.get(*p).is_some_and(Slave::has_booted);
            if let Some(position) = position.filter(is_booted) {
                self.conclude(now, position, Some(Outcome::Lost(Loss::Heartbeat)));
            }
        }
        for position in 0..self.slaves.len() {
            while let Some(slave) = self.slaves.get_mut(position)
                && slave.poll_timeout().is_some_and(|deadline| deadline <= now)
            {
                let outcome = slave.handle_timeout(now, &mut self.outbox);
                self.conclude(now, position, outcome);
            }
        }
        if matches!(self.network, Network::Booting(Some(deadline)) if deadline <= now) {
            self.give_up();
        }
    }

    /// When it wants [`Master::handle_timeout`] to be called.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let network = match self.network {
            Network::Booting(deadline) => deadline,
            Network::Idle | Network::Started | Network::Halted => None,
        };
        let slaves = self.slaves.iter().filter_map(Slave::poll_timeout);
        slaves.chain(network).chain(self.consumer.poll_timeout()).min()
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self) -> Option<Frame> {
        self.outbox.frames.pop_front().or_else(|| self.slaves.iter_mut().find_map(Slave::poll_transmit))
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<MasterEvent> {
        self.outbox.events.pop_front()
    }

    /// Frames and events dropped because nobody took those that were waiting.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.outbox.dropped
    }
}

/// What 0x1F82 shows of a slave that nothing is known of.
const UNKNOWN: u8 = 0;
/// What 0x1F82 shows of a slave that does not answer.
const MISSING: u8 = 1;

impl Master {
    fn position(&self, node_id: u8) -> Option<usize> {
        self.slaves.iter().position(|slave| slave.assignment.node_id == node_id)
    }

    /// Waits for the mandatory slaves.
    fn begin(&mut self, now: Instant) {
        self.network = Network::Booting(self.startup.boot_time.map(|time| now + time));
        self.look_at_mandatory();
    }

    /// After a reset of a slave: waits for its boot-up message if it is to be booted.
    fn await_slave(&mut self, now: Instant, position: usize) {
        match self.slaves.get_mut(position) {
            Some(slave) if slave.assignment.is_booted() => slave.await_boot_up(now),
            Some(slave) => slave.stop(),
            None => {}
        }
    }

    fn command(&mut self, now: Instant, command: NmtCommand, node_id: u8) {
        self.outbox.command(command, node_id);
        let is_reset = matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication);
        for position in 0..self.slaves.len() {
            let Some(slave) = self.slaves.get_mut(position) else { continue };
            if node_id != 0 && slave.assignment.node_id != node_id {
                continue;
            }
            slave.is_commanded();
            if is_reset {
                self.await_slave(now, position);
            }
        }
        if is_reset && node_id == 0 {
            self.begin(now);
        }
    }

    /// Feeds the supervision of heartbeats.
    fn feed(&mut self, now: Instant, frame: &Frame) {
        let Some(state) = NmtState::decode(frame.payload()) else { return };
        let position = self.consumer.ids().find(|(_, id)| *id == frame.id).map(|(position, _)| position);
        if let Some(position) = position {
            // That an error is over is told by the boot that follows.
            let _ = self.consumer.receive(now, position, state);
        }
    }

    /// Draws the conclusions from what has become of the slave at `position`.
    fn conclude(&mut self, now: Instant, position: usize, outcome: Option<Outcome>) {
        let Some((outcome, slave)) = outcome.zip(self.slaves.get_mut(position)) else { return };
        let node_id = slave.assignment.node_id;
        match outcome {
            Outcome::Booted { is_kept } => {
                let is_started = !self.startup.starts_all_at_once() || self.network == Network::Started;
                if !is_kept && self.startup.starts_slaves() && is_started {
                    slave.is_commanded();
                    self.outbox.command(NmtCommand::Start, node_id);
                }
                self.outbox.tell(MasterEvent::Booted { node_id, was_operational: is_kept });
                self.look_at_mandatory();
            }
            Outcome::Failed { status, transfer } => {
                let is_needed = slave.assignment.is_mandatory();
                self.outbox.tell(MasterEvent::BootFailed { node_id, status, transfer });
                if is_needed && matches!(self.network, Network::Booting(_)) {
                    self.halt();
                }
            }
            Outcome::Lost(loss) => {
                self.outbox.tell(MasterEvent::Lost { node_id, loss });
                self.react(now, position, loss);
            }
        }
    }

    /// What follows when a slave is lost (CiA 302-2, "error handler").
    fn react(&mut self, now: Instant, position: usize, loss: Loss) {
        let Some(slave) = self.slaves.get_mut(position) else { return };
        let node_id = slave.assignment.node_id;
        slave.stop();
        if slave.assignment.is_mandatory() && self.startup.stops_all() {
            self.command(now, NmtCommand::Stop, 0);
            return self.halt();
        }
        if slave.assignment.is_mandatory() && self.startup.resets_all() {
            return self.command(now, NmtCommand::ResetNode, 0);
        }
        match loss {
            Loss::Heartbeat | Loss::Guarding => self.command(now, NmtCommand::ResetCommunication, node_id),
            // It has just done that.
            Loss::BootUp if slave.assignment.is_booted() => slave.boot(now),
            Loss::BootUp => {}
        }
    }

    fn look_at_mandatory(&mut self) {
        let is_missing = |slave: &Slave| slave.assignment.is_mandatory() && !slave.has_booted();
        if !matches!(self.network, Network::Booting(_)) || self.slaves.iter().any(is_missing) {
            return;
        }
        self.network = Network::Started;
        if self.startup.starts_all_at_once() && self.startup.starts_slaves() {
            self.slaves.iter_mut().for_each(Slave::is_commanded);
            self.outbox.command(NmtCommand::Start, 0);
        }
        let enters_operational = self.startup.enters_operational();
        self.outbox.tell(MasterEvent::Started { enters_operational });
    }

    /// The boot time is over: tells who is missing.
    fn give_up(&mut self) {
        let is_missing = |slave: &&Slave| slave.assignment.is_mandatory() && !slave.has_booted();
        for slave in self.slaves.iter().filter(is_missing) {
            let (node_id, status, transfer) = (slave.assignment.node_id, BootStatus::NoResponse, None);
            self.outbox.tell(MasterEvent::BootFailed { node_id, status, transfer });
        }
        self.halt();
    }

    fn halt(&mut self) {
        self.network = Network::Halted;
        self.slaves.iter_mut().filter(|slave| !slave.has_booted()).for_each(Slave::stop);
        self.outbox.tell(MasterEvent::Halted);
    }
}
