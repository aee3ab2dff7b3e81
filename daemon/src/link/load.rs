//! How busy a bus is.

use core::time::Duration;

use canopen::{Frame, Id};
use od::Instant;

/// How long is counted before it is told.
const WINDOW: Duration = Duration::from_secs(1);

/// Counts bits in windows of a second.
#[derive(Debug, Default)]
pub(crate) struct Load {
    end: Instant,
    bits: u64,
    last: u64,
}

impl Load {
    /// Counts a frame that was on the bus at `at`.
    pub(crate) fn count(&mut self, at: Instant, frame: &Frame) {
        if at >= self.end {
            self.turn(at);
        }
        self.bits += bits(frame);
    }

    /// Bits in the last whole window, which is bits per second.
    pub(crate) fn bits_per_second(&self, now: Instant) -> u64 {
        if now < self.end {
            self.last
        } else if now < self.end + WINDOW {
            self.bits
        } else {
            0
        }
    }

    /// Begins the window that `at` is in.
    fn turn(&mut self, at: Instant) {
        self.last = if at < self.end + WINDOW { self.bits } else { 0 };
        self.bits = 0;
        // Of windows in a row the edges stay where they are.
        self.end = if at < self.end + WINDOW { self.end + WINDOW } else { at + WINDOW };
    }
}

/// Bits of a frame on the wire with the space behind it and without stuff bits (ISO 11898-1): 44 or 64 beside the data,
/// and 3.
fn bits(frame: &Frame) -> u64 {
    let data = 8 * frame.payload().len() as u64;
    match frame.id {
        Id::Standard(_) => 47 + data,
        Id::Extended(_) => 67 + data,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(millis)
    }

    #[test]
    fn the_load_is_that_of_the_last_whole_second() {
        let mut load = Load::default();
        let frame = Frame::new(Id::Standard(0x181), &[0; 8]);
        assert_eq!(load.bits_per_second(at(0)), 0);
        for millis in 0..3000 {
            load.count(at(millis), &frame);
        }
        assert_eq!(load.bits_per_second(at(2999)), 111_000);
        assert_eq!(load.bits_per_second(at(3500)), 111_000);
        assert_eq!(load.bits_per_second(at(4000)), 0, "nothing for a second");
        load.count(at(10_000), &frame);
        assert_eq!(load.bits_per_second(at(10_500)), 0);
        assert_eq!(load.bits_per_second(at(11_500)), 111);
    }

    #[test]
    fn frames_have_as_many_bits_as_the_standard_says() {
        let cases = [
            (Frame::new(Id::Standard(0x80), &[]), 47),
            (Frame::new(Id::Extended(0x80), &[0; 8]), 131),
            (Frame::remote(Id::Standard(0x701), 1), 47),
        ];
        for (frame, expected) in cases {
            assert_eq!(bits(&frame), expected, "{frame}");
        }
    }
}
