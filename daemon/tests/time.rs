//! TIME production by the core (0x1012, bit 30), with a wall clock that the test plays.

mod common;

use std::time::Duration;

use canopen::TimeOfDay;
use common::{Bench, LINK};
use daemon::core::LinkId;
use od::Instant;

const PRODUCER: [u8; 4] = 0x4000_0100_u32.to_le_bytes();
const CONSUMER: [u8; 4] = 0x8000_0100_u32.to_le_bytes();
/// 1 January 2024, noon, when the bench starts.
const NOON: Duration = Duration::from_secs(1_704_110_400);

/// Lets time pass as the core loop does; gives the TIMEs that were sent on `link`, with the ms since the start.
fn run(bench: &mut Bench, link: LinkId, time: Duration) -> Vec<(u128, String)> {
    let (start, end) = (bench.now, bench.now + time);
    let mut sent = Vec::new();
    while let Some(deadline) = bench.core.poll_timeout().filter(|deadline| *deadline <= end) {
        assert!(deadline > bench.now, "the core asks for the past");
        bench.now = deadline;
        bench.core.handle_timeout(bench.now);
        if bench.core.poll_time_wanted() {
            let wall = NOON + bench.now.saturating_since(Instant::from_nanos(1_000_000_000));
            bench.core.produce_time(bench.now, TimeOfDay::from_unix(wall).unwrap());
        }
        let times = bench.sent_on(link).into_iter().filter(|frame| frame.starts_with("100#"));
        sent.extend(times.map(|frame| (bench.now.saturating_since(start).as_millis(), frame)));
    }
    bench.now = end;
    sent
}

#[test]
fn a_producer_tells_the_time_of_day_once_a_second() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x1012, 0, &PRODUCER);

    let sent = run(&mut bench, LINK, Duration::from_millis(3500));

    // Milliseconds after midnight and days since 1984: 43 201 000 and 14 610.
    let expected = ["100#E83193021239", "100#D03593021239", "100#B83993021239"];
    let expected: Vec<_> = (1..).zip(expected).map(|(second, f)| (1000 * second, f.to_owned())).collect();
    assert_eq!(sent, expected);
}

#[test]
fn another_node_of_ours_consumes_it() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.write(2, 0x1012, 0, &CONSUMER);
    bench.write(1, 0x1012, 0, &PRODUCER);
    run(&mut bench, LINK, Duration::from_secs(1));
    let (_, time) = bench.core.nodes().nth(1).unwrap().network_time().unwrap();
    assert_eq!(time, TimeOfDay { days: 14_610, millis: 43_201_000 });
}

#[test]
fn every_network_has_its_producer() {
    let mut bench = Bench::new(&[&[(0, 1), (1, 9)]]);
    bench.send_on(LinkId(1), "609#2312100000010040");
    assert_eq!(run(&mut bench, LinkId(1), Duration::from_secs(2)).len(), 2);
    assert_eq!(run(&mut bench, LINK, Duration::from_secs(2)).len(), 0);
}

#[test]
fn a_node_that_produces_no_time_any_more_is_silent_and_asks_for_nothing() {
    for end in ["601#2312100000010000", "000#0201", "000#8201"] {
        let mut bench = Bench::new(&[&[(0, 1)]]);
        bench.write(1, 0x1012, 0, &PRODUCER);
        run(&mut bench, LINK, Duration::from_secs(1));
        bench.send(end);
        assert_eq!(run(&mut bench, LINK, Duration::from_secs(10)), [], "{end}");
        assert_eq!(bench.core.poll_timeout(), None, "{end}");
    }
}

#[test]
fn after_a_stop_the_time_is_told_again() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x1012, 0, &PRODUCER);
    bench.send("000#0201");
    run(&mut bench, LINK, Duration::from_secs(5));
    bench.send("000#0101");
    assert_eq!(run(&mut bench, LINK, Duration::from_secs(2)).len(), 2);
}

#[test]
fn a_core_that_was_asleep_tells_the_time_once() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x1012, 0, &PRODUCER);
    bench.now = bench.now + Duration::from_secs(60);
    bench.core.handle_timeout(bench.now);
    assert!(bench.core.poll_time_wanted());
    assert!(!bench.core.poll_time_wanted());
    bench.core.handle_timeout(bench.now);
    assert!(!bench.core.poll_time_wanted());
}
