//! A device that is its network's TIME producer.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use tests::{Bus, Client, Daemon, config, free_port};

/// Milliseconds since 1970.
fn wall() -> u128 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO).as_millis()
}

/// Milliseconds since 1970 at the moment in a TIME frame, `100 E83193021239`: milliseconds after midnight, then days
/// since 1 January 1984, both low byte first.
fn moment(frame: &str) -> u128 {
    const DAYS_TO_1984: u128 = 5113;
    let data = frame.strip_prefix("100 ").unwrap_or_else(|| panic!("no TIME: {frame}"));
    assert_eq!(data.len(), 12, "{data}");
    let bytes = u64::from_str_radix(data, 16).expect("hexadecimal digits").swap_bytes() >> 16;
    let (millis, days) = (u128::from(bytes & 0xFFFF_FFFF), u128::from(bytes >> 32));
    assert!(millis < 86_400_000, "{data}");
    (days + DAYS_TO_1984) * 86_400_000 + millis
}

#[test]
fn a_producer_tells_date_and_time_every_second() {
    let port = free_port();
    let _daemon = Daemon::start(&config(Bus::Socketcand(port), &[("axis1", "cia402-servo", 1)]));
    let mut client = Client::raw(port);

    client.send("< send 601 8 23 12 10 0 0 1 0 40 >"); // 0x1012: 0x100, producer

    assert_eq!(client.frame(), "581 6012100000000000");
    let mut last = None;
    for _ in 0..2 {
        let before = wall();
        let told = moment(&client.frame());
        assert!((before..=wall()).contains(&told), "{told} was told after {before}");
        let period = last.map(|last| told - last);
        assert!(period.is_none_or(|period| (500..5000).contains(&period)), "{period:?} ms");
        last = Some(told);
    }
}
