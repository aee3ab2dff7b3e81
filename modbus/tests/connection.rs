//! The life of a connection.

mod bench;

use core::time::Duration;

use bench::Bench;
use modbus::{Dialect, Framing, Permissions, WordOrder};

const READ: &str = "00 01 00 00 00 06 01 03 80 06 00 02";
const IDLE: Duration = Duration::from_secs(60);

fn idle() -> Bench {
    Bench::with(Dialect::Full, WordOrder::LowFirst, Framing::Tcp, Permissions::default(), Some(IDLE))
}

#[test]
fn a_client_that_asks_for_nothing_is_closed_after_the_idle_time() {
    let mut bench = idle();
    bench.now = bench.now + IDLE / 2;
    bench.exchange(READ);
    assert_eq!(bench.server.poll_timeout(), Some(bench.now + IDLE));
    bench.now = bench.now + (IDLE - Duration::from_nanos(1));
    bench.server.handle_timeout(bench.now);
    assert!(!bench.server.is_closing());
    bench.now = bench.now + Duration::from_nanos(1);
    bench.server.handle_timeout(bench.now);
    assert!(bench.server.is_closing());
    assert_eq!(bench.server.poll_timeout(), None);
}

#[test]
fn bytes_that_never_become_a_request_do_not_keep_a_connection() {
    let mut bench = idle();
    for byte in bench::bytes(&READ[..READ.len() - 3]) {
        bench.send(&[byte]);
        bench.now = bench.now + IDLE / 10;
    }
    bench.server.handle_timeout(bench.now);
    assert!(bench.server.is_closing());
}

#[test]
fn a_connection_that_closes_still_has_its_answers_and_takes_no_requests() {
    let mut bench = idle();
    bench.server.handle_bytes(bench.now, &bench::bytes(READ));
    bench.serve_one();
    bench.server.close();
    assert_eq!(bench::hex(bench.server.output()), "00 01 00 00 00 07 01 03 04 64 01 C0 A8");
    assert_eq!(bench.server.handle_bytes(bench.now, &[0; 5000]), 5000);
    assert!(!bench.serve_one());
}

#[test]
fn requests_exceptions_and_junk_are_counted() {
    let mut bench = Bench::new(Dialect::Full);
    bench.exchange(READ);
    bench.ask("03 FF 00 00 02");
    bench.exchange("00 01 12 34 00 02 01 03");
    let counters = bench.server.counters();
    assert_eq!((counters.requests, counters.exceptions, counters.malformed), (2, 1, 1));
}
