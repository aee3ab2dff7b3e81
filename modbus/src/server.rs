//! One connection.

use std::sync::Arc;

use core::time::Duration;

use od::{Instant, Origin, Write};

use crate::framing::{Found, Frame, Framer};
use crate::service::{self, Client};
use crate::{Exception, Framing, MAX_ADU, Permissions, Target};

/// Bytes of requests that may wait to be answered.
const INPUT: usize = 8 * MAX_ADU;
/// Bytes of answers that may wait to be sent; a request is taken only if its answer has room.
const OUTPUT: usize = 8 * MAX_ADU;
/// Most values one request writes (function code 16 with 123 registers).
const LARGEST_BATCH: usize = 123;

/// What a connection has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Requests that were answered, exceptions included.
    pub requests: u64,
    /// Requests that were answered by an exception.
    pub exceptions: u64,
    /// Frames of another protocol or with a wrong length or checksum, which were skipped.
    pub malformed: u64,
}

/// One connection. See the crate's documentation for how it is driven.
#[derive(Debug)]
pub struct Server {
    framer: Framer,
    origin: Origin,
    permissions: Arc<Permissions>,
    input: Vec<u8>,
    /// Bytes of the input that are done with.
    done: usize,
    /// Bytes still to come that are of no use.
    skip: usize,
    /// The request that is to be answered next.
    frame: Option<Frame>,
    output: Vec<u8>,
    /// Bytes of the output that have left.
    left: usize,
    batch: Vec<Write<'static>>,
    idle_timeout: Option<Duration>,
    /// When the client has asked for nothing for too long.
    idle_deadline: Option<Instant>,
    is_closing: bool,
    last_exception: Option<Exception>,
    counters: Counters,
}

impl Server {
    /// A connection that begins at `now`. What it writes comes from `origin`. With an idle time-out it is closed when no
    /// whole request has come for that long.
    #[must_use]
    pub fn new(
        now: Instant,
        framing: Framing,
        origin: Origin,
        permissions: Arc<Permissions>,
        idle_timeout: Option<Duration>,
    ) -> Self {
        Self {
            framer: Framer::new(framing),
            origin,
            permissions,
            input: Vec::with_capacity(INPUT),
            done: 0,
            skip: 0,
            frame: None,
            output: Vec::with_capacity(OUTPUT),
            left: 0,
            batch: Vec::with_capacity(LARGEST_BATCH),
            idle_timeout,
            idle_deadline: idle_timeout.map(|timeout| now + timeout),
            is_closing: false,
            last_exception: None,
            counters: Counters::default(),
        }
    }

    /// Makes these its permissions, from its next request on.
    pub fn set_permissions(&mut self, permissions: Arc<Permissions>) {
        self.permissions = permissions;
    }

    /// Bytes that [`Server::handle_bytes`] takes now.
    #[must_use]
    pub fn room(&self) -> usize {
        INPUT - (self.input.len() - self.done)
    }

    /// Takes bytes from the client, as many as there is room for; the number that was taken.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) -> usize {
        let taken = if self.is_closing { bytes } else { bytes.get(..self.room()).unwrap_or(bytes) };
        if self.is_closing || taken.is_empty() {
            return taken.len();
        }
        self.framer.handle_bytes(now, self.input.len() - self.done);
        let useful = taken.get(self.skip..).unwrap_or_default();
        self.skip -= taken.len() - useful.len();
        if self.input.len() + useful.len() > INPUT {
            self.input.drain(..self.done);
            self.done = 0;
        }
        self.input.extend_from_slice(useful);
        taken.len()
    }

    /// Does what is due at `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.framer.handle_timeout(now, self.input.len() - self.done);
        if self.idle_deadline.is_some_and(|deadline| deadline <= now) {
            self.close();
        }
    }

    /// When [`Server::handle_timeout`] is to be called next.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        [self.framer.poll_timeout(), self.idle_deadline].into_iter().flatten().min()
    }

    /// The unit that the next request is for, if a whole one is there and its answer has room.
    pub fn poll_request(&mut self) -> Option<u8> {
        if OUTPUT - (self.output.len() - self.left) < MAX_ADU || self.is_closing {
            return None;
        }
        while self.frame.is_none() {
            match self.framer.find(self.input.get(self.done..).unwrap_or_default()) {
                Found::Part => return None,
                Found::Frame(frame) => self.frame = Some(frame),
                Found::Junk(length) => {
                    self.counters.malformed += 1;
                    self.skip(length);
                }
                Found::Lost => {
                    self.counters.malformed += 1;
                    self.close();
                    return None;
                }
            }
        }
        self.frame.map(|frame| frame.unit)
    }

    /// Answers the request that [`Server::poll_request`] found; `target` is its unit, if there is one.
    pub fn answer(&mut self, now: Instant, target: Option<Target<'_>>) {
        let Some(frame) = self.frame.take() else { return };
        self.idle_deadline = self.idle_timeout.map(|timeout| now + timeout);
        self.counters.requests += 1;
        self.make_room();
        let (first, length) = frame.pdu;
        let pdu = self.input.get(self.done + first..self.done + first + length).unwrap_or_default();
        let client = Client { origin: self.origin, permissions: &self.permissions, unit: frame.unit };
        let is_answered = self.framer.answers(frame.unit, target.is_some());
        let start = self.output.len();
        self.framer.begin(&frame, &mut self.output);
        self.last_exception = service::serve(client, target, pdu, &mut self.batch, &mut self.output);
        self.counters.exceptions += u64::from(self.last_exception.is_some());
        if is_answered {
            self.framer.end(start, &mut self.output);
        } else {
            self.output.truncate(start);
        }
        self.skip(frame.length);
    }

    /// The bytes that are to be sent.
    #[must_use]
    pub fn output(&self) -> &[u8] {
        self.output.get(self.left..).unwrap_or_default()
    }

    /// Takes note that the first `length` bytes of the output have left.
    pub fn sent(&mut self, length: usize) {
        self.left = (self.left + length).min(self.output.len());
        if self.left == self.output.len() {
            self.output.clear();
            self.left = 0;
        }
    }

    /// Takes no more requests: what is in the output may still be sent, then the connection is to be closed.
    pub fn close(&mut self) {
        self.is_closing = true;
        self.idle_deadline = None;
        self.frame = None;
        self.input.clear();
        self.done = 0;
    }

    /// Whether the connection is to be closed when the output is sent.
    #[must_use]
    pub fn is_closing(&self) -> bool {
        self.is_closing
    }

    /// What the last request was refused with, if it was.
    #[must_use]
    pub fn last_exception(&self) -> Option<Exception> {
        self.last_exception
    }

    /// What the connection has done.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Where what it writes comes from.
    #[must_use]
    pub fn origin(&self) -> Origin {
        self.origin
    }

    /// Forgets the next `length` bytes of the input; those that have not come yet are skipped when they come.
    fn skip(&mut self, length: usize) {
        let here = length.min(self.input.len() - self.done);
        self.skip += length - here;
        self.done += here;
        self.framer.consumed(here);
        if self.done == self.input.len() {
            self.input.clear();
            self.done = 0;
        }
    }

    /// Moves the output to the front if the next answer would make it grow.
    fn make_room(&mut self) {
        if OUTPUT - self.output.len() < MAX_ADU {
            self.output.drain(..self.left);
            self.left = 0;
        }
    }
}
