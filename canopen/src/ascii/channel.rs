//! The one SDO channel to a node, for all clients.

use core::time::Duration;
use std::collections::VecDeque;

use od::{Address, Instant};

use super::answer::Answer;
use super::client::Ticket;
use super::value::Form;
use crate::{Frame, SdoClient, SdoError, SdoEvent, SdoMode};

/// The most bytes of an upload: a megabyte.
const MOST_BYTES: usize = 1 << 20;

/// What is to be transferred.
#[derive(Clone, Debug)]
pub(super) enum Transfer {
    Upload(Form),
    Download(Vec<u8>),
}

/// A transfer that somebody waits for.
#[derive(Clone, Debug)]
pub(super) struct Job {
    pub(super) ticket: Ticket,
    pub(super) address: Address,
    pub(super) transfer: Transfer,
    pub(super) mode: SdoMode,
    pub(super) timeout: Duration,
}

/// An SDO client and what it is to do.
#[derive(Debug)]
pub(super) struct Channel {
    client: SdoClient,
    /// Whose transfer is under way, and in which form its value is told.
    current: Option<(Ticket, Option<Form>)>,
    waiting: VecDeque<Job>,
}

impl Channel {
    /// That of the node with this Node-ID.
    pub(super) fn new(node_id: u8) -> Self {
        Self { client: SdoClient::of_node(node_id), current: None, waiting: VecDeque::new() }
    }

    pub(super) fn is_idle(&self) -> bool {
        self.current.is_none() && self.waiting.is_empty()
    }

    /// Does this after what is to be done already.
    pub(super) fn add(&mut self, now: Instant, job: Job) {
        self.waiting.push_back(job);
        self.begin(now);
    }

    /// Forgets what this client waits for; what is under way is aborted.
    pub(super) fn forget(&mut self, now: Instant, client: u64) {
        self.waiting.retain(|job| job.ticket.client != client);
        if self.current.is_some_and(|(ticket, _)| ticket.client == client) {
            self.client.abort(od::AbortCode::TimedOut);
            self.settle(now);
        }
    }

    pub(super) fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<(Ticket, Answer)> {
        self.client.handle_frame(now, frame);
        self.settle(now)
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) -> Option<(Ticket, Answer)> {
        self.client.handle_timeout(now);
        self.settle(now)
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.client.poll_timeout()
    }

    /// The next frame to send, and for which client.
    pub(super) fn poll_transmit(&mut self) -> Option<(Option<u64>, Frame)> {
        let client = self.current.map(|(ticket, _)| ticket.client);
        self.client.poll_transmit().map(|frame| (client, frame))
    }

    /// What has come of the transfer, if it is over; the next one begins then.
    fn settle(&mut self, now: Instant) -> Option<(Ticket, Answer)> {
        let event = self.client.poll_event()?;
        let (ticket, form) = self.current.take()?;
        self.begin(now);
        let answer = match event {
            SdoEvent::Uploaded { data, .. } => match form.unwrap_or(Form::Bytes).print(&data) {
                Ok(text) => Answer::Value(text),
                Err(_) => Answer::WRONG_TYPE,
            },
            SdoEvent::Downloaded { .. } => Answer::Done,
            SdoEvent::Failed { error: SdoError::Server(code), .. } => Answer::Aborted(code),
            SdoEvent::Failed { error: SdoError::Client(code), .. } => Answer::Aborted(code.code()),
        };
        Some((ticket, answer))
    }

    fn begin(&mut self, now: Instant) {
        if self.current.is_some() {
            return;
        }
        let Some(Job { ticket, address, transfer, mode, timeout }) = self.waiting.pop_front() else { return };
        self.client.set_timeout(timeout);
        // It is idle and its event was taken, and a line is shorter than what a download may have.
        let (form, _) = match transfer {
            Transfer::Upload(form) => (Some(form), self.client.upload(now, address, MOST_BYTES, mode)),
            Transfer::Download(data) => (None, self.client.download(now, address, data, mode)),
        };
        self.current = Some((ticket, form));
    }
}
