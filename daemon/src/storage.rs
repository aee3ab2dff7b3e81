//! Storing parameters on disk: one file per device, written by a thread of its own so that no frame waits for it.
//!
//! [`encode`] tells what a file looks like, [`Replacement`] how it is replaced. An order of [`crate::core::Core`] is
//! done when its file would survive a power cut.

mod claim;
mod file;
mod format;

use core::fmt;
use std::collections::VecDeque;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use od::AbortCode;

use crate::alarm::Bell;
use crate::core::Parameters;

pub use claim::Claim;
pub use file::{Replacement, file_name, load, replace};
pub use format::{Corrupt, decode, encode};

/// How an order ended.
#[derive(Debug)]
pub struct Done {
    /// Position of the device.
    pub device: usize,
    /// Whether its parameters are on disk.
    pub outcome: Result<(), Failure>,
}

/// Why parameters are not on disk.
#[derive(Debug)]
pub enum Failure {
    /// The configuration has no `[storage]`.
    Nowhere,
    /// The file could not be written.
    File(io::Error),
}

impl Failure {
    /// What the client is told (CiA 301 v4.2, section 7.5.2.13).
    #[must_use]
    pub fn code(&self) -> AbortCode {
        match self {
            Self::Nowhere => AbortCode::CannotStore,
            Self::File(_) => AbortCode::Hardware,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nowhere => f.write_str("the configuration has no [storage]"),
            Self::File(error) => error.fmt(f),
        }
    }
}

/// Where orders go.
#[derive(Debug, Default)]
pub struct Storage {
    writer: Option<Writer>,
    /// Orders that ended at once.
    ended: VecDeque<Done>,
}

#[derive(Debug)]
struct Writer {
    /// No more than there are devices: one waits for its order to end before it gives another.
    jobs: Sender<Job>,
    done: Receiver<Done>,
    /// Orders under way.
    waiting: usize,
}

#[derive(Debug)]
struct Job {
    device: usize,
    name: Arc<str>,
    parameters: Parameters,
}

impl Storage {
    /// Stores in a directory what devices have; the bell rings when an order has ended.
    ///
    /// # Errors
    /// The operating system has no thread left.
    pub fn start(claim: Claim, bell: Bell) -> io::Result<Self> {
        let (jobs, orders) = channel();
        let (results, done) = channel();
        let write_all = move || {
            for Job { device, name, parameters } in orders {
                let outcome = write(claim.directory(), &file_name(&name), &parameters).map_err(Failure::File);
                if results.send(Done { device, outcome }).is_err() {
                    return;
                }
                bell.ring();
            }
        };
        thread::Builder::new().name("storage".to_owned()).spawn(write_all)?;
        Ok(Self { writer: Some(Writer { jobs, done, waiting: 0 }), ended: VecDeque::new() })
    }

    /// Takes an order of the device at this position, and of this name. Without a directory there is never anything stored: an order to store nothing is done.
    pub fn submit(&mut self, device: usize, name: &Arc<str>, parameters: Parameters) {
        let outcome = match &mut self.writer {
            None if parameters.is_empty() => Ok(()),
            None => Err(Failure::Nowhere),
            Some(writer) => match writer.jobs.send(Job { device, name: Arc::clone(name), parameters }) {
                Ok(()) => {
                    writer.waiting += 1;
                    return;
                }
                Err(error) => Err(Failure::File(io::Error::other(error.to_string()))),
            },
        };
        self.ended.push_back(Done { device, outcome });
    }

    /// The next order that has ended.
    pub fn poll(&mut self) -> Option<Done> {
        let ended = self.ended.pop_front();
        ended.or_else(|| {
            let writer = self.writer.as_mut().filter(|writer| writer.waiting > 0)?;
            let done = writer.done.try_recv().ok()?;
            writer.waiting -= 1;
            Some(done)
        })
    }

    /// Whether no order is under way.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.ended.is_empty() && self.writer.as_ref().is_none_or(|writer| writer.waiting == 0)
    }
}

fn write(directory: &Path, name: &str, parameters: &Parameters) -> io::Result<()> {
    replace(directory, name, encode(parameters).as_bytes())
}
