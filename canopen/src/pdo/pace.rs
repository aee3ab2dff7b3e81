//! PDOs that take their time. A device whose values lie behind a connection of its own processes one PDO after the
//! other; those that come meanwhile wait in one queue.

use core::time::Duration;
use std::collections::VecDeque;

use od::{Dictionary, Direction, Instant, Slot};

use super::Tpdo;
use super::shape::Scan;
use crate::deadline::following;

/// PDOs that are in work or wait: twice as many as there are PDOs with a processing time in any device so far, so that
/// only a rate overflows the queue, never a coincidence.
const CAPACITY: usize = 16;

/// What is to be done with a PDO when it has been processed.
#[derive(Debug)]
enum Job {
    /// Write what the RPDO at this position has brought.
    Receive(usize, [u8; 8]),
    /// Send the TPDO at this position.
    Transmit(usize),
    /// Nothing any more: the parameters of the PDO have changed.
    Void,
}

/// The queue between a node and its device.
#[derive(Debug, Default)]
pub(crate) struct Pace {
    /// Each with the time it takes; the first one is in work.
    jobs: VecDeque<(Job, Duration)>,
    /// When the first one is done.
    done: Option<Instant>,
    /// Positions of the TPDOs that have been processed and not been sent.
    ready: VecDeque<usize>,
    has_overflowed: bool,
    scans: Vec<Scanner>,
}

/// The value of a TPDO that is read again and again.
#[derive(Debug)]
struct Scanner {
    /// Position of the TPDO.
    position: usize,
    scan: Scan,
    period: Duration,
    value: u64,
    /// When it is read next; none while the scan is off.
    due: Option<Instant>,
}

impl Pace {
    /// An empty queue, for a node with these TPDOs.
    pub(crate) fn new(transmit: &[Tpdo]) -> Self {
        let scanner = |(position, tpdo): (usize, &Tpdo)| {
            let (scan, period) = (tpdo.shape.scan?, tpdo.shape.longest_time());
            Some(Scanner { position, scan, period, value: 0, due: None })
        };
        Self { scans: transmit.iter().enumerate().filter_map(scanner).collect(), ..Self::default() }
    }

    /// Lets what an RPDO has brought wait for its turn; false if there is no room.
    #[must_use]
    pub(crate) fn receive(
        &mut self,
        now: Instant,
        position: usize,
        payload: [u8; 8],
        time: Duration,
    ) -> bool {
        self.push(now, Job::Receive(position, payload), time)
    }

    /// Lets a TPDO wait for its turn; false if there is no room.
    #[must_use]
    pub(crate) fn transmit(&mut self, now: Instant, position: usize, time: Duration) -> bool {
        self.push(now, Job::Transmit(position), time)
    }

    fn push(&mut self, now: Instant, job: Job, time: Duration) -> bool {
        let has_room = self.jobs.len() < CAPACITY;
        if has_room {
            self.done = self.done.or_else(|| Some(now + time));
            self.jobs.push_back((job, time));
        }
        self.has_overflowed |= !has_room;
        has_room
    }

    /// The next RPDO that has been processed by `now`, and what it has brought; TPDOs before it are ready.
    pub(crate) fn take_received(&mut self, now: Instant) -> Option<(usize, [u8; 8])> {
        while self.done.is_some_and(|done| done <= now) {
            let (job, _) = self.jobs.pop_front()?;
            // The next one begins in the same moment.
            let next = self.jobs.front().map(|(_, time)| *time);
            self.done = self.done.zip(next).map(|(done, time)| done + time);
            match job {
                Job::Receive(position, payload) => return Some((position, payload)),
                Job::Transmit(position) => self.ready.push_back(position),
                Job::Void => {}
            }
        }
        None
    }

    /// The next TPDO that is ready to be sent.
    pub(crate) fn take_ready(&mut self) -> Option<usize> {
        self.ready.pop_front()
    }

    /// Whether the queue has become empty after an overflow; told once.
    pub(crate) fn take_drained(&mut self) -> bool {
        let is_drained = self.has_overflowed && self.jobs.is_empty();
        self.has_overflowed &= !is_drained;
        is_drained
    }

    /// Reads the values that are scanned, when they are due.
    pub(crate) fn scan(&mut self, now: Instant, application: &Dictionary) {
        for Scanner { scan, period, value, due, .. } in &mut self.scans {
            if !scan.is_on(application) {
                *due = None;
            } else if due.is_none_or(|due| due <= now) {
                *value = application.raw(scan.slot);
                *due = Some(due.map_or(now + *period, |due| following(due, *period, now)));
            }
        }
    }

    /// What the scan has read last for the TPDO at this position, if it is on.
    pub(crate) fn scanned(&self, position: usize) -> Option<(Slot, u64)> {
        let mut scans = self.scans.iter().filter(|scanner| scanner.due.is_some());
        let scanner = scans.find(|scanner| scanner.position == position)?;
        Some((scanner.scan.slot, scanner.value))
    }

    /// When the next one is processed or scanned.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.scans.iter().filter_map(|scanner| scanner.due).chain(self.done).min()
    }

    /// Forgets what waits of the PDO at this position; the time of what is in work runs on.
    pub(crate) fn forget(&mut self, direction: Direction, position: usize) {
        self.ready.retain(|ready| (Direction::Transmit, *ready) != (direction, position));
        for (job, _) in &mut self.jobs {
            let (its_direction, its_position) = match job {
                Job::Receive(position, _) => (Direction::Receive, *position),
                Job::Transmit(position) => (Direction::Transmit, *position),
                Job::Void => continue,
            };
            if (its_direction, its_position) == (direction, position) {
                *job = Job::Void;
            }
        }
    }

    /// Forgets all that waits.
    pub(crate) fn stop(&mut self) {
        self.jobs.clear();
        self.ready.clear();
        self.done = None;
        self.scans.iter_mut().for_each(|scanner| scanner.due = None);
    }
}
