//! What the gateway does on one network for all clients.

use core::time::Duration;
use std::collections::BTreeMap;

use od::Instant;

use super::answer::{Answer, GatewayError};
use super::channel::{Channel, Job};
use super::client::Ticket;
use super::lss::Services;
use crate::lss::ANSWER;
use crate::{Emergency, ErrorRegister, Frame, Id, NmtState};

/// Emergencies of a node, its SDO answers and its error control: these and the Node-ID (pre-defined connection set).
const EMCY: u16 = 0x080;
const SDO_ANSWER: u16 = 0x580;
const ERROR_CONTROL: u16 = 0x700;
/// The state in an error control message, and its toggle bit.
const STATE: u8 = 0x7F;
const TOGGLE: u8 = 0x80;

/// What has happened on a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    BootUp(u8),
    Emergency(u8, Emergency),
    Error(u8, GatewayError),
}

/// How a node is watched.
#[derive(Clone, Copy, Debug)]
enum Watched {
    Heartbeat {
        time: Duration,
    },
    Guarding {
        period: Duration,
        /// Requests without an answer that are too many.
        factor: u8,
        next: Instant,
        unanswered: u8,
        /// The toggle bit of the last answer.
        toggle: Option<bool>,
    },
}

#[derive(Clone, Copy, Debug)]
struct Watch {
    client: u64,
    kind: Watched,
    is_alive: bool,
    /// When a heartbeat is missing.
    deadline: Option<Instant>,
}

/// The heartbeat of the gateway itself.
#[derive(Clone, Copy, Debug)]
struct Producer {
    period: Duration,
    next: Instant,
}

#[derive(Debug, Default)]
pub(super) struct Network {
    channels: BTreeMap<u8, Channel>,
    pub(super) lss: Services,
    watches: BTreeMap<u8, Watch>,
    node_id: Option<u8>,
    producer: Option<Producer>,
    /// What is to be sent, and for which client; none if it is for the gateway itself.
    frames: Vec<(Option<u64>, Frame)>,
}

impl Network {
    /// Does a transfer with a node.
    pub(super) fn transfer(&mut self, now: Instant, node_id: u8, job: Job) {
        self.channels.entry(node_id).or_insert_with(|| Channel::new(node_id)).add(now, job);
    }

    /// Puts a frame of a client on the network.
    pub(super) fn send(&mut self, client: u64, frame: Frame) {
        self.frames.push((Some(client), frame));
    }

    /// Makes this the Node-ID of the gateway; without one it has no heartbeat.
    pub(super) fn set_node_id(&mut self, node_id: Option<u8>) {
        self.node_id = node_id;
        if node_id.is_none() {
            self.producer = None;
        }
    }

    /// Lets the gateway tell that it lives; zero ends that.
    pub(super) fn set_heartbeat(&mut self, now: Instant, period: Duration) -> Result<(), GatewayError> {
        self.node_id.ok_or(GatewayError::State)?;
        self.producer = (!period.is_zero()).then_some(Producer { period, next: now });
        Ok(())
    }

    /// Expects a heartbeat of a node at least so often.
    pub(super) fn expect_heartbeat(&mut self, client: u64, node_id: u8, time: Duration) {
        let kind = Watched::Heartbeat { time };
        self.watches.insert(node_id, Watch { client, kind, is_alive: false, deadline: None });
    }

    /// Asks a node for its state again and again.
    pub(super) fn guard(&mut self, now: Instant, client: u64, node_id: u8, (period, factor): (Duration, u8)) {
        let kind = Watched::Guarding { period, factor, next: now, unanswered: 0, toggle: None };
        self.watches.insert(node_id, Watch { client, kind, is_alive: true, deadline: None });
    }

    /// Watches a node no more, if it is watched in this way.
    pub(super) fn unwatch(&mut self, node_id: u8, is_guarding: bool) {
        let is_it = |watch: &Watch| matches!(watch.kind, Watched::Guarding { .. }) == is_guarding;
        if self.watches.get(&node_id).is_some_and(is_it) {
            self.watches.remove(&node_id);
        }
    }

    /// Ends what goes on for a client that has left.
    pub(super) fn forget(&mut self, now: Instant, client: u64) {
        self.watches.retain(|_, watch| watch.client != client);
        self.abandon(now, client);
    }

    /// Ends the command of a client.
    pub(super) fn abandon(&mut self, now: Instant, client: u64) {
        self.channels.values_mut().for_each(|channel| channel.forget(now, client));
        self.lss.forget(client);
    }

    /// Takes a frame that was on the network.
    pub(super) fn handle_frame(
        &mut self,
        now: Instant,
        frame: &Frame,
        ended: &mut Vec<(Ticket, Answer)>,
    ) -> Option<Event> {
        let Id::Standard(id) = frame.id else { return None };
        if frame.is_remote {
            return None;
        }
        if id == ANSWER {
            ended.extend(frame.eight().and_then(|answer| self.lss.handle_answer(now, answer)));
            return None;
        }
        let node_id = (id & 0x7F) as u8;
        match (id & 0x780, node_id) {
            (_, 0) => None,
            (EMCY, _) => emergency(frame).map(|emergency| Event::Emergency(node_id, emergency)),
            (SDO_ANSWER, _) => {
                let channel = self.channels.get_mut(&node_id)?;
                ended.extend(channel.handle_frame(now, frame));
                None
            }
            (ERROR_CONTROL, _) => match *frame.payload() {
                [0] => {
                    self.booted(now, node_id);
                    Some(Event::BootUp(node_id))
                }
                [state] => self.alive(now, node_id, state),
                _ => None,
            },
            _ => None,
        }
    }

    fn booted(&mut self, now: Instant, node_id: u8) {
        let Some(watch) = self.watches.get_mut(&node_id) else { return };
        match &mut watch.kind {
            Watched::Heartbeat { time } => watch.deadline = watch.is_alive.then_some(now + *time),
            Watched::Guarding { toggle, unanswered, .. } => (*toggle, *unanswered) = (None, 0),
        }
    }

    fn alive(&mut self, now: Instant, node_id: u8, state: u8) -> Option<Event> {
        NmtState::decode(&[state & STATE])?;
        let watch = self.watches.get_mut(&node_id)?;
        match &mut watch.kind {
            Watched::Heartbeat { time } => {
                watch.deadline = Some(now + *time);
                let is_new = !core::mem::replace(&mut watch.is_alive, true);
                is_new.then_some(Event::Error(node_id, GatewayError::HeartbeatStarted))
            }
            Watched::Guarding { unanswered, toggle, .. } => {
                let is_set = state & TOGGLE != 0;
                // One that does not toggle is an old one.
                if *toggle != Some(is_set) {
                    (*toggle, *unanswered, watch.is_alive) = (Some(is_set), 0, true);
                }
                None
            }
        }
    }

    /// Does what is due at `now`.
    pub(super) fn handle_timeout(&mut self, now: Instant, ended: &mut Vec<(Ticket, Answer)>) -> Vec<Event> {
        ended.extend(self.channels.values_mut().filter_map(|channel| channel.handle_timeout(now)));
        ended.extend(self.lss.handle_timeout(now));
        if let (Some(producer), Some(node_id)) = (&mut self.producer, self.node_id)
            && producer.next <= now
        {
            producer.next = following(producer.next, producer.period, now);
            let id = Id::Standard(ERROR_CONTROL + u16::from(node_id));
            self.frames.push((None, Frame::new(id, &[NmtState::Operational as u8])));
        }
        let mut events = Vec::new();
        for (node_id, watch) in &mut self.watches {
            let lost = watch.handle_timeout(now, *node_id, &mut self.frames);
            events.extend(lost.map(|error| Event::Error(*node_id, error)));
        }
        events
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let channels = self.channels.values().filter_map(Channel::poll_timeout);
        let watches = self.watches.values().filter_map(|watch| match watch.kind {
            Watched::Heartbeat { .. } => watch.deadline,
            Watched::Guarding { next, .. } => Some(next),
        });
        let own = self.producer.map(|producer| producer.next);
        channels.chain(watches).chain(own).chain(self.lss.poll_timeout()).min()
    }

    /// The frames to send, and for which client; channels that nobody uses any more are forgotten.
    pub(super) fn poll_transmit(
        &mut self,
        now: Instant,
        ended: &mut Vec<(Ticket, Answer)>,
    ) -> Vec<(Option<u64>, Frame)> {
        let mut frames = core::mem::take(&mut self.frames);
        // What waited for an exchange that is over begins; what has no answer is over at once.
        while let Some(over) = self.lss.begin(now) {
            ended.push(over);
        }
        let lss = core::iter::from_fn(|| self.lss.poll_transmit());
        frames.extend(lss.map(|(client, frame)| (Some(client), frame)));
        for channel in self.channels.values_mut() {
            frames.extend(core::iter::from_fn(|| channel.poll_transmit()));
        }
        self.channels.retain(|_, channel| !channel.is_idle());
        frames
    }
}

impl Watch {
    fn handle_timeout(
        &mut self,
        now: Instant,
        node_id: u8,
        frames: &mut Vec<(Option<u64>, Frame)>,
    ) -> Option<GatewayError> {
        match &mut self.kind {
            Watched::Heartbeat { .. } => {
                let is_lost = self.deadline.take_if(|deadline| *deadline <= now).is_some();
                self.is_alive &= !is_lost;
                is_lost.then_some(GatewayError::HeartbeatLost)
            }
            Watched::Guarding { period, factor, next, unanswered, .. } => {
                if *next > now {
                    return None;
                }
                let is_lost = self.is_alive && *unanswered >= (*factor).max(1);
                self.is_alive &= !is_lost;
                *unanswered = unanswered.saturating_add(1);
                *next = following(*next, *period, now);
                let request = Frame::remote(Id::Standard(ERROR_CONTROL + u16::from(node_id)), 1);
                frames.push((Some(self.client), request));
                is_lost.then_some(GatewayError::GuardingLost)
            }
        }
    }
}

/// When something that was due is due again; what was missed is left out.
fn following(due: Instant, period: Duration, now: Instant) -> Instant {
    let next = due + period;
    if next > now { next } else { now + period }
}

fn emergency(frame: &Frame) -> Option<Emergency> {
    let [low, high, register, detail @ ..] = frame.eight()?;
    let code = u16::from_le_bytes([low, high]);
    Some(Emergency { code, register: ErrorRegister::from_bits_retain(register), detail })
}
