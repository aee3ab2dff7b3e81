//! How busy the bus behind an interface is, by the counters of the kernel: they know every frame, also those that our
//! nodes do not listen to. It is measured on the thread of [`crate::services`], beside the core.

use core::time::Duration;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use ::socketcan::CanInterface;
use tokio::time::{Instant, MissedTickBehavior, interval};

/// How often it is measured.
const PERIOD: Duration = Duration::from_secs(1);
/// Bits of a standard frame on the wire beside its data, with the space behind it and without stuff bits.
const FRAME: u64 = 47;

/// What was measured last.
#[derive(Debug)]
pub(crate) struct Gauge {
    bits_per_s: AtomicU64,
    /// Zero if the interface has none.
    bit_rate: AtomicU32,
    /// [`UNKNOWN`] if the interface tells none.
    restart_ms: AtomicU64,
}

/// No time of 32 bits.
const UNKNOWN: u64 = u64::MAX;

impl Default for Gauge {
    fn default() -> Self {
        let (bits_per_s, bit_rate) = (AtomicU64::default(), AtomicU32::default());
        Self { bits_per_s, bit_rate, restart_ms: AtomicU64::new(UNKNOWN) }
    }
}

impl Gauge {
    /// Bits per second, without stuff bits, and the bit rate of the interface, if it has one.
    pub(crate) fn read(&self) -> (u64, Option<u32>) {
        let bit_rate = self.bit_rate.load(Ordering::Relaxed);
        (self.bits_per_s.load(Ordering::Relaxed), Some(bit_rate).filter(|bit_rate| *bit_rate != 0))
    }

    /// How long the interface stays in bus-off before the kernel restarts it, in ms, 0 for ever; if it tells.
    pub(crate) fn restart_ms(&self) -> Option<u32> {
        u32::try_from(self.restart_ms.load(Ordering::Relaxed)).ok()
    }
}

/// Measures `interface` once a second, in the runtime that this is called in, until nobody has the gauge any more.
pub(crate) fn measure(interface: String, gauge: &Arc<Gauge>) {
    let gauge = Arc::downgrade(gauge);
    tokio::spawn(async move {
        let mut ticks = interval(PERIOD);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut before = None;
        loop {
            let now = ticks.tick().await;
            let Some(gauge) = gauge.upgrade() else { return };
            let bits = counted(Path::new("/sys/class/net"), &interface);
            gauge.bits_per_s.store(rate(before, bits.map(|bits| (now, bits))), Ordering::Relaxed);
            before = bits.map(|bits| (now, bits));
            let (bit_rate, restart_ms) = parameters(&interface).unwrap_or_default();
            gauge.bit_rate.store(bit_rate.unwrap_or(0), Ordering::Relaxed);
            gauge.restart_ms.store(restart_ms.map_or(UNKNOWN, u64::from), Ordering::Relaxed);
        }
    });
}

/// Bits per second between two measurements; zero without them, and when the interface has begun anew.
fn rate(before: Option<(Instant, u64)>, after: Option<(Instant, u64)>) -> u64 {
    let (Some((begin, before)), Some((end, after))) = (before, after) else { return 0 };
    let millis = u64::try_from(end.duration_since(begin).as_millis()).unwrap_or(u64::MAX).max(1);
    after.saturating_sub(before).saturating_mul(1000) / millis
}

/// Bits that the frames of an interface have had so far.
fn counted(directory: &Path, interface: &str) -> Option<u64> {
    let directory = directory.join(interface);
    let number = |name: &str| {
        fs::read_to_string(directory.join("statistics").join(name)).ok()?.trim().parse::<u64>().ok()
    };
    let bits = |frames: &str, bytes: &str| Some(number(frames)? * FRAME + number(bytes)? * 8);
    let sent = bits("tx_packets", "tx_bytes")?;
    // On an interface without a device all that is received was sent by this machine, and is counted already.
    if directory.join("device").exists() { Some(sent + bits("rx_packets", "rx_bytes")?) } else { Some(sent) }
}

/// Bit rate and restart time of an interface, as far as it has them.
fn parameters(interface: &str) -> Option<(Option<u32>, Option<u32>)> {
    let can = CanInterface::open(interface).ok()?.details().ok()?.can;
    Some((can.bit_timing.map(|timing| timing.bitrate), can.restart_ms))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn bits_of_the_time_between_two_measurements_are_the_load() {
        let begin = Instant::now();
        assert_eq!(rate(Some((begin, 1000)), Some((begin + PERIOD, 112_000))), 111_000);
        assert_eq!(rate(Some((begin, 0)), Some((begin + 2 * PERIOD, 1000))), 500);
        assert_eq!(rate(None, Some((begin, 1000))), 0);
        assert_eq!(rate(Some((begin, 1000)), Some((begin + PERIOD, 10))), 0, "a new interface of that name");
    }

    #[test]
    fn a_virtual_interface_counts_what_is_sent_and_a_device_both_ways() {
        let directory = std::env::temp_dir().join(format!("axisd-gauge-{}", std::process::id()));
        let statistics = directory.join("can0/statistics");
        fs::create_dir_all(&statistics).unwrap();
        for (name, number) in
            [("tx_packets", "10"), ("tx_bytes", "80"), ("rx_packets", "2"), ("rx_bytes", "0")]
        {
            fs::write(statistics.join(name), format!("{number}\n")).unwrap();
        }
        assert_eq!(counted(&directory, "can0"), Some(10 * 47 + 640));
        fs::create_dir(directory.join("can0/device")).unwrap();
        assert_eq!(counted(&directory, "can0"), Some(12 * 47 + 640));
        assert_eq!(counted(&directory, "can1"), None);
        fs::remove_dir_all(&directory).unwrap();
    }
}
