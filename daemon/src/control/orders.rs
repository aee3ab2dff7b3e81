//! The queue by which orders reach the core, and their outcomes come back.
//!
//! It is bounded, and neither end ever waits for the other: a client whose order finds no place is told so, and the core
//! looks in each of its turns whether there is one. While nobody orders anything, that look is all.

use core::time::Duration;

use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::{mpsc, oneshot};
use tokio::time::timeout;

use super::errand::Errand;
use crate::alarm::Bell;
use crate::core::Peer;

/// Orders that may wait.
const CAPACITY: usize = 16;
/// How long the core may take: more than it ever sleeps in a receiving system call.
const PATIENCE: Duration = Duration::from_secs(3);

/// The core's end.
#[derive(Debug)]
pub struct Inbox(mpsc::Receiver<Placed>);

/// An order whose outcome somebody waits for.
#[derive(Debug)]
pub struct Task<O, T> {
    /// What is to be done.
    pub order: O,
    outcome: oneshot::Sender<T>,
}

/// An order that has reached the core.
#[derive(Debug)]
pub struct Placed {
    /// Who is at the other end of the connection that it came by.
    pub by: Option<Peer>,
    /// The order.
    pub errand: Errand,
}

/// The end of whoever orders.
#[derive(Clone, Debug)]
pub struct Orders {
    placed: mpsc::Sender<Placed>,
    bell: Bell,
    by: Option<Peer>,
}

/// Both ends; `bell` wakes the core.
#[must_use]
pub fn orders(bell: Bell) -> (Inbox, Orders) {
    let (placed, inbox) = mpsc::channel(CAPACITY);
    (Inbox(inbox), Orders { placed, bell, by: None })
}

impl Inbox {
    /// The next order, if there is one.
    pub fn poll(&mut self) -> Option<Placed> {
        // Nobody to order anything any more is as good as no order.
        self.0.try_recv().ok()
    }
}

impl<O, T> Task<O, T> {
    /// Tells what came of it.
    pub fn conclude(self, outcome: T) {
        // Whoever has left does not want to know.
        let _ = self.outcome.send(outcome);
    }
}

impl Orders {
    /// The same for whoever is at the other end of a connection.
    #[must_use]
    pub fn of(self, by: Option<Peer>) -> Self {
        Self { by, ..self }
    }

    /// What comes of `order`, which is of the given kind.
    ///
    /// # Errors
    /// Too many wait, or the core does not answer; what has no answer may be done later.
    pub async fn place<O, T>(&self, kind: fn(Task<O, T>) -> Errand, order: O) -> Result<T, String> {
        let (outcome, answer) = oneshot::channel();
        let no_answer = || Err("the core does not answer".to_owned());
        match self.placed.try_send(Placed { by: self.by, errand: kind(Task { order, outcome }) }) {
            Ok(()) => self.bell.ring(),
            Err(TrySendError::Full(_)) => return Err("too many orders wait".to_owned()),
            Err(TrySendError::Closed(_)) => return no_answer(),
        }
        match timeout(PATIENCE, answer).await {
            Ok(Ok(outcome)) => Ok(outcome),
            Ok(Err(_)) | Err(_) => no_answer(),
        }
    }
}
