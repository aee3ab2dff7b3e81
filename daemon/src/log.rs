//! The log: lines on standard error, written by a thread of their own so that nobody waits for the reader.

use core::time::Duration;
use std::collections::HashMap;
use std::env;
use std::io::{self, IsTerminal};

use od::Instant;
use tracing_appender::non_blocking::{NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::EnvFilter;

/// Lines that may wait for the reader of the log; more are dropped.
const MAX_WAITING: usize = 1024;

/// Starts the log. What waits is written when the guard is dropped.
pub(crate) fn start() -> WorkerGuard {
    let (writer, guard) =
        NonBlockingBuilder::default().buffered_lines_limit(MAX_WAITING).lossy(true).finish(io::stderr());
    let filter = EnvFilter::builder().with_default_directive(tracing::Level::INFO.into()).from_env_lossy();
    let lines = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(writer)
        .with_target(false)
        .with_ansi(io::stderr().is_terminal());
    // The journal has its own time stamps.
    if env::var_os("JOURNAL_STREAM").is_some() {
        lines.without_time().init();
    } else {
        lines.init();
    }
    guard
}

/// At most one line of each kind about each subject in this time.
const PERIOD: Duration = Duration::from_secs(1);

/// Decides which lines may be written.
#[derive(Debug, Default)]
pub(crate) struct Limiter {
    last: HashMap<(Subject, &'static str), Last>,
}

/// What a line is about, by its number in the configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Subject {
    Device(usize),
    Bus(usize),
}

#[derive(Debug)]
struct Last {
    written: Instant,
    suppressed: u32,
}

impl Limiter {
    /// Whether a line of this kind may be written at `now`, and how many were not since the last one.
    pub(crate) fn admit(&mut self, now: Instant, subject: Subject, kind: &'static str) -> Option<u32> {
        let Some(last) = self.last.get_mut(&(subject, kind)) else {
            self.last.insert((subject, kind), Last { written: now, suppressed: 0 });
            return Some(0);
        };
        if now < last.written + PERIOD {
            last.suppressed = last.suppressed.saturating_add(1);
            return None;
        }
        let suppressed = core::mem::take(&mut last.suppressed);
        last.written = now;
        Some(suppressed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_line_a_second_per_subject_and_kind() {
        let mut limiter = Limiter::default();
        let at = |millis: u64| Instant::from_nanos(millis * 1_000_000);
        assert_eq!(limiter.admit(at(0), Subject::Device(1), "fault"), Some(0));
        assert_eq!(limiter.admit(at(10), Subject::Device(1), "fault"), None);
        assert_eq!(limiter.admit(at(999), Subject::Device(1), "fault"), None);
        assert_eq!(limiter.admit(at(20), Subject::Device(1), "reset"), Some(0));
        assert_eq!(limiter.admit(at(20), Subject::Bus(1), "fault"), Some(0));
        assert_eq!(limiter.admit(at(1000), Subject::Device(1), "fault"), Some(2));
        assert_eq!(limiter.admit(at(1001), Subject::Device(1), "fault"), None);
    }
}
