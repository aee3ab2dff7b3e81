//! How long SDO clients wait: from the arrival of a request at the kernel until the answer has left.

use core::time::Duration;

use canopen::{Frame, Id};

use crate::clock::Clock;
use crate::latency::Histogram;

/// Node-IDs, zero among them, which no request has.
const NODES: usize = 128;
/// Requests to and answers of the default SDO servers less the Node-ID (CiA 301 v4.2, table 38).
const REQUEST: u16 = 0x600;
const ANSWER: u16 = 0x580;

/// Times the requests to default SDO servers on one interface.
#[derive(Debug)]
pub(crate) struct Stopwatch {
    /// For each node, when the request came that it has not answered, since 1970.
    asked: Box<[Option<Duration>; NODES]>,
    /// When the requests came whose answers wait to be sent.
    answered: Vec<Duration>,
    times: Histogram,
}

impl Stopwatch {
    /// None runs yet.
    pub(crate) fn new() -> Self {
        Self {
            asked: Box::new([None; NODES]),
            answered: Vec::with_capacity(NODES),
            times: Histogram::default(),
        }
    }

    /// A frame came at `arrival`.
    pub(crate) fn receive(&mut self, frame: &Frame, arrival: Duration) {
        if let Some(asked) = node(frame, REQUEST).and_then(|node| self.asked.get_mut(node)) {
            *asked = Some(arrival);
        }
    }

    /// A frame is about to be sent.
    pub(crate) fn queue(&mut self, frame: &Frame) {
        let asked = node(frame, ANSWER).and_then(|node| self.asked.get_mut(node)?.take());
        self.answered.extend(asked.filter(|_| self.answered.len() < NODES));
    }

    /// All that was about to be sent has left.
    pub(crate) fn flush(&mut self) {
        if self.answered.is_empty() {
            return;
        }
        let now = Clock::wall();
        let Self { answered, times, .. } = self;
        // The wall clock may have jumped.
        answered.drain(..).filter_map(|asked| now.checked_sub(asked)).for_each(|time| times.record(time));
    }

    /// What was about to be sent is lost.
    pub(crate) fn lose(&mut self) {
        self.answered.clear();
    }

    /// How long they waited.
    pub(crate) fn times(&self) -> &Histogram {
        &self.times
    }
}

/// The Node-ID in the identifier of `frame`, if it is one of those from `base` on.
fn node(frame: &Frame, base: u16) -> Option<usize> {
    let Id::Standard(id) = frame.id else { return None };
    id.checked_sub(base).map(usize::from).filter(|node| (1..NODES).contains(node))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_timed_until_its_answer_has_left() {
        let frame = |id| Frame::new(Id::Standard(id), &[0; 8]);
        let mut stopwatch = Stopwatch::new();
        let arrival = Clock::wall().checked_sub(Duration::from_millis(5)).unwrap();
        stopwatch.receive(&frame(0x605), arrival);
        stopwatch.receive(&frame(0x185), arrival);
        stopwatch.queue(&frame(0x586));
        stopwatch.flush();
        assert_eq!(stopwatch.times().count(), 0, "another node answers nothing of this");
        stopwatch.queue(&frame(0x585));
        stopwatch.queue(&frame(0x585));
        stopwatch.flush();
        stopwatch.flush();
        assert_eq!(stopwatch.times().count(), 1);
        stopwatch.receive(&frame(0x605), arrival);
        stopwatch.queue(&frame(0x585));
        stopwatch.lose();
        stopwatch.flush();
        assert_eq!(stopwatch.times().count(), 1, "an answer that was lost is none");
        assert!((5_000..5_000_000).contains(&stopwatch.times().max_us()), "{}", stopwatch.times().max_us());
    }
}
