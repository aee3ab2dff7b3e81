//! Tells what the machine itself takes from a thread: `stalls SECONDS`, with the processor and the scheduling that the
//! caller gives it.
//!
//! The thread does what a busy core loop does: it looks at the clock all the time and sleeps for a moment in each
//! millisecond. Where two looks are far apart, or a sleep lasts longer than it was to, nobody but kernel or hypervisor
//! had the processor. One line comes out: times in which that happened by more than 200 us, and the longest in us.

use std::error::Error;
use std::thread::sleep;
use std::time::{Duration, Instant};

const MILLISECOND: Duration = Duration::from_millis(1);
const AWAKE: Duration = Duration::from_micros(900);
const LATE: Duration = Duration::from_micros(200);

fn main() -> Result<(), Box<dyn Error>> {
    let seconds: f64 = std::env::args().nth(1).ok_or("usage: stalls SECONDS")?.parse()?;
    let mut last = Instant::now();
    let (end, mut next) = (last + Duration::from_secs_f64(seconds), last + MILLISECOND);
    let (mut late, mut longest) = (0, Duration::ZERO);
    while last < end {
        let mut expected = last;
        if last > next - MILLISECOND + AWAKE {
            sleep(next.saturating_duration_since(last));
            expected = next.max(last);
            next += MILLISECOND;
        }
        last = Instant::now();
        next = next.max(last);
        let stall = last - expected;
        longest = longest.max(stall);
        late += u32::from(stall > LATE);
    }
    println!("{late} {}", longest.as_micros());
    Ok(())
}
