//! A CAN interface of the kernel.
//!
//! The interface may come and go: whoever drives this opens it again and again, and what is to be sent meanwhile
//! is dropped and counted.

use core::time::Duration;
use std::io::{self, IoSlice};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};
use std::sync::Arc;

use ::socketcan::{CanFilter, CanSocket, Socket, SocketOptions};
use canopen::{BusState, Frame, Id};
use nix::errno::Errno;
use nix::sys::socket::sockopt::RcvBufForce;
use nix::sys::socket::{MsgFlags, MultiHeaders, send, sendmmsg, setsockopt};
use od::Instant;

use super::filters::{Filter, filters};
use super::gauge::Gauge;
use super::queue::{Kind, Queue};
use super::stopwatch::Stopwatch;
use super::wire_format::{self, Message, SIZE, STATE_CLASSES};
use crate::latency::Histogram;
use crate::sys::{self, BATCH};

/// How long [`Patience::Block`] waits for a frame at most.
pub(crate) const LONGEST_BLOCK: Duration = Duration::from_millis(500);

/// When a full transmit queue is tried again.
const RETRY_SEND: Duration = Duration::from_millis(1);
/// When an interface that is not there is tried again.
const RETRY_OPEN: Duration = Duration::from_millis(500);
/// Room for a burst, or for what comes while a busy machine lets nobody read: some seconds of a full bus.
const RECEIVE_BUFFER: usize = 4 << 20;

/// Whether to wait for a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Patience {
    /// Until one comes, a signal, or [`LONGEST_BLOCK`] is over.
    Block,
    /// Not at all.
    Try,
}

/// What was lost of that which came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Losses {
    /// What the kernel delivered and is no classic data, remote or error frame.
    pub(crate) malformed: u64,
    /// Error frames that told no state of the controller.
    pub(crate) errors: u64,
}

/// What comes from an interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Received {
    /// A frame of the bus.
    Frame(Frame),
    /// The state of the controller has changed to this one.
    State(BusState),
}

/// What the kernel is to deliver.
#[derive(Debug, PartialEq, Eq)]
enum Subscription {
    /// Every frame.
    All,
    /// Those with these identifiers.
    Ids(Vec<Id>),
}

/// See the module's documentation.
#[derive(Debug)]
pub(crate) struct SocketCan {
    interface: String,
    socket: Option<CanSocket>,
    /// When to open it again, or to send on.
    deadline: Option<Instant>,
    queue: Queue,
    headers: MultiHeaders<()>,
    hears_all: bool,
    /// Whether somebody watches the bus, so that every frame is taken.
    is_watched: bool,
    /// What the kernel delivers to the open socket, if that was said.
    subscribed: Option<Subscription>,
    gauge: Arc<Gauge>,
    /// What the controller told last.
    state: BusState,
    losses: Losses,
    /// Times SDO clients, if somebody wants to know.
    stopwatch: Option<Stopwatch>,
}

impl SocketCan {
    /// The interface of that name, not opened. `hears_all`: take every frame, not only those subscribed to.
    pub(crate) fn new(interface: &str, hears_all: bool, now: Instant) -> Self {
        Self {
            interface: interface.to_owned(),
            socket: None,
            deadline: Some(now),
            queue: Queue::new(),
            headers: MultiHeaders::preallocate(BATCH, None),
            hears_all,
            is_watched: false,
            subscribed: None,
            gauge: Arc::default(),
            state: BusState::Active,
            losses: Losses::default(),
            stopwatch: None,
        }
    }

    /// The same interface with an eye on how long SDO clients wait.
    pub(crate) fn timed(self) -> Self {
        Self { stopwatch: Some(Stopwatch::new()), ..self }
    }

    /// How long SDO clients waited, if somebody wants to know.
    pub(crate) fn sdo_times(&self) -> Option<&Histogram> {
        self.stopwatch.as_ref().map(Stopwatch::times)
    }

    /// What waits to be sent.
    pub(crate) fn waiting(&self) -> &Queue {
        &self.queue
    }

    /// Name of the interface.
    pub(crate) fn interface(&self) -> &str {
        &self.interface
    }

    /// The open socket.
    pub(crate) fn fd(&self) -> Option<BorrowedFd<'_>> {
        self.socket.as_ref().map(AsFd::as_fd)
    }

    /// What the controller told last.
    pub(crate) fn state(&self) -> BusState {
        self.state
    }

    /// What was lost since the start.
    pub(crate) fn losses(&self) -> Losses {
        self.losses
    }

    /// Where somebody beside the core writes how busy the bus is.
    pub(crate) fn gauge(&self) -> &Arc<Gauge> {
        &self.gauge
    }

    /// Takes every frame while somebody watches, once [`SocketCan::subscribe`] is called. Whether that is a change.
    pub(crate) fn set_watched(&mut self, is_watched: bool) -> bool {
        core::mem::replace(&mut self.is_watched, is_watched) != is_watched
    }

    /// Takes every frame, or only those subscribed to, once [`SocketCan::subscribe`] is called. Whether that is a change.
    pub(crate) fn set_hears_all(&mut self, hears_all: bool) -> bool {
        core::mem::replace(&mut self.hears_all, hears_all) != hears_all
    }

    /// Gives the interface up for good; its socket, if it is open.
    pub(crate) fn into_socket(self) -> Option<CanSocket> {
        self.socket
    }

    /// When [`SocketCan::open`] (if it is not open) or [`SocketCan::flush`] is to be called next.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.deadline
    }

    /// Tries to open the interface.
    pub(crate) fn open(&mut self, now: Instant) -> io::Result<()> {
        self.deadline = Some(now + RETRY_OPEN);
        let socket = CanSocket::open(&self.interface)?;
        // An interface that is there but down is bound, and says so in this way.
        socket.as_raw_socket().take_error()?.map_or(Ok(()), Err)?;
        make_room(&socket);
        socket.set_read_timeout(LONGEST_BLOCK)?;
        socket.set_error_filter(STATE_CLASSES)?;
        if self.stopwatch.is_some() {
            sys::stamp_arrivals(&socket)?;
        }
        self.socket = Some(socket);
        self.subscribed = None;
        self.state = BusState::Active;
        self.deadline = None;
        Ok(())
    }

    /// Gives up the socket after an error; what waits is lost.
    pub(crate) fn close(&mut self, now: Instant) {
        self.socket = None;
        self.queue.lose();
        self.stopwatch.iter_mut().for_each(Stopwatch::lose);
        self.deadline = Some(now + RETRY_OPEN);
    }

    /// Makes the kernel deliver the frames with these identifiers, and others only as far as [`filters`] cannot keep them out.
    /// If it does already, as after most resets of nodes, nothing is done: with many identifiers that takes its time.
    pub(crate) fn subscribe(&mut self, ids: impl Iterator<Item = Id>) -> io::Result<()> {
        let Some(socket) = &self.socket else { return Ok(()) };
        let hears_all = self.hears_all || self.is_watched;
        let wanted = if hears_all { Subscription::All } else { Subscription::Ids(ids.collect()) };
        if self.subscribed.as_ref() == Some(&wanted) {
            return Ok(());
        }
        match &wanted {
            Subscription::All => socket.set_filter_accept_all()?,
            Subscription::Ids(ids) => {
                let filters = filters(ids.iter().copied()).into_iter();
                let filters: Vec<_> = filters.map(|Filter { id, mask }| CanFilter::new(id, mask)).collect();
                socket.set_filters(&filters)?;
            }
        }
        self.subscribed = Some(wanted);
        Ok(())
    }

    /// Adds what has come, at most [`BATCH`], to `news`; how long that took, if there was anything.
    pub(crate) fn receive(
        &mut self,
        patience: Patience,
        news: &mut Vec<Received>,
    ) -> io::Result<Option<Duration>> {
        let Some(socket) = self.fd() else { return Ok(None) };
        let flags = match patience {
            Patience::Block => MsgFlags::MSG_WAITFORONE,
            Patience::Try => MsgFlags::MSG_DONTWAIT,
        };
        let (mut messages, mut lengths) = ([[0; SIZE]; BATCH], [0; BATCH]);
        let mut stamps = self.stopwatch.is_some().then_some([Duration::ZERO; BATCH]);
        let outcome = sys::receive(socket, &mut messages, &mut lengths, flags, stamps.as_mut());
        let (received, time) = match outcome {
            Ok(received) => received,
            Err(Errno::EAGAIN | Errno::EINTR) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        let mut stamps = stamps.into_iter().flatten();
        for (message, length) in messages.iter().zip(lengths).take(received) {
            let stamp = stamps.next();
            match wire_format::decode(message).filter(|_| length == SIZE) {
                Some(message) => {
                    self.time(&message, stamp);
                    news.extend(self.sift(message));
                }
                None => self.losses.malformed += 1,
            }
        }
        Ok(Some(time))
    }

    /// Begins to time the answer to a message that came at `stamp`.
    fn time(&mut self, message: &Message, stamp: Option<Duration>) {
        if let (Some(stopwatch), Message::Frame(frame), Some(stamp)) = (&mut self.stopwatch, message, stamp) {
            stopwatch.receive(frame, stamp);
        }
    }

    /// What in a message is news.
    fn sift(&mut self, message: Message) -> Option<Received> {
        match message {
            Message::Frame(frame) => Some(Received::Frame(frame)),
            Message::State(state) => {
                let before = core::mem::replace(&mut self.state, state);
                (before != state).then_some(Received::State(state))
            }
            Message::Error => {
                self.losses.errors += 1;
                None
            }
        }
    }

    /// Puts a frame where its `kind` says among those that are to be sent.
    pub(crate) fn queue(&mut self, frame: &Frame, kind: Kind) {
        if self.socket.is_none() {
            self.queue.refuse();
        } else if self.queue.push(frame, kind) {
            self.stopwatch.iter_mut().for_each(|stopwatch| stopwatch.queue(frame));
        }
    }

    /// Sends what waits, [`BATCH`] at most: the rest is due at once. What the interface has no room for waits on.
    pub(crate) fn flush(&mut self, now: Instant) -> io::Result<()> {
        let mut is_first = true;
        while !self.queue.is_empty() {
            if !core::mem::take(&mut is_first) {
                self.deadline = Some(now);
                return Ok(());
            }
            match self.send() {
                Ok(sent) => self.queue.sent(sent),
                Err(Errno::EINTR) => {}
                Err(Errno::EAGAIN | Errno::ENOBUFS) => {
                    self.queue.stick();
                    self.deadline = Some(now + RETRY_SEND);
                    return Ok(());
                }
                Err(error) => return Err(error.into()),
            }
        }
        self.stopwatch.iter_mut().for_each(Stopwatch::flush);
        if self.socket.is_some() {
            self.deadline = None;
        }
        Ok(())
    }

    /// Sends at most [`BATCH`] of the frames that wait; how many went.
    fn send(&mut self) -> nix::Result<usize> {
        let Some(socket) = &self.socket else { return Err(Errno::ENETDOWN) };
        let socket = socket.as_raw_fd();
        let flags = MsgFlags::MSG_DONTWAIT;
        let mut frames = self.queue.front();
        if let (1, Some(frame)) = (frames.len(), frames.next()) {
            return send(socket, frame, flags).map(|_| 1);
        }
        let mut slices = [[IoSlice::new(&[])]; BATCH];
        let mut count = 0;
        for ([slice], frame) in slices.iter_mut().zip(self.queue.front()) {
            *slice = IoSlice::new(frame);
            count += 1;
        }
        let nowhere = [None; BATCH];
        sendmmsg(socket, &mut self.headers, slices.iter().take(count), nowhere, [], flags)
            .map(Iterator::count)
    }
}

/// Asks for a large receive buffer: beyond `net.core.rmem_max` with CAP_NET_ADMIN, up to it without.
fn make_room(socket: &CanSocket) {
    if setsockopt(socket, RcvBufForce, &RECEIVE_BUFFER).is_err() {
        // A kernel that grants less serves shorter bursts.
        let _ = socket.as_raw_socket().set_recv_buffer_size(RECEIVE_BUFFER);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_of_state_stay_between_the_frames_they_came_between() {
        let mut interface = SocketCan::new("none", false, Instant::ZERO);
        let frame = Frame::new(Id::Standard(0x80), &[]);
        let messages = [
            Message::Frame(frame),
            Message::State(BusState::Active),
            Message::State(BusState::Off),
            Message::State(BusState::Off),
            Message::Frame(frame),
            Message::Error,
            Message::State(BusState::Active),
            Message::Frame(frame),
        ];

        let news: Vec<_> = messages.into_iter().filter_map(|message| interface.sift(message)).collect();

        let frame = Received::Frame(frame);
        let (off, active) = (Received::State(BusState::Off), Received::State(BusState::Active));
        assert_eq!(news, [frame, off, frame, active, frame]);
        assert_eq!(interface.losses().errors, 1);
    }
}
