//! Keeps the log short: at most one line a second about each subject and kind.

use core::time::Duration;
use std::collections::HashMap;

use od::Instant;

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
