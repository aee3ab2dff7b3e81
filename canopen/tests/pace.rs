//! A device that takes its time for its PDOs, and whose PDOs have reserved bytes.

mod bench;

use core::time::Duration;

use bench::Bench;
use canopen::{Event, Frame};
use od::{Address, Direction, PdoTraits, Scan};

use Direction::{Receive, Transmit};

const MS: Duration = Duration::from_millis(1);

fn traits(direction: Direction, number: u16, time: Duration) -> PdoTraits {
    PdoTraits { direction, number, length: 0, time, scan: None }
}

/// RPDO 1 takes 21 ms and RPDO 2, synchronous, 8 ms; TPDO 2, with every SYNC, 12 ms, or 1 ms while its value is scanned,
/// and TPDO 3 10 ms. TPDO 1 and the other RPDOs take none.
fn slow() -> Vec<PdoTraits> {
    let (entry, switch) = (Address::new(0x6200, 3), Address::new(0x6200, 8));
    let scan = Some(Scan { entry, switch, bit: 1, time: MS });
    vec![
        traits(Receive, 1, 21 * MS),
        traits(Receive, 2, 8 * MS),
        PdoTraits { scan, ..traits(Transmit, 2, 12 * MS) },
        traits(Transmit, 3, 10 * MS),
    ]
}

/// A node in PRE-OPERATIONAL whose device has these PDOs.
fn with(traits: &[PdoTraits], takes_time: bool) -> Bench {
    let mut bench = Bench::off();
    let schema = std::sync::Arc::clone(bench.device.schema());
    bench.node.shape_pdos(traits, &schema, takes_time);
    bench.started()
}

/// The same in OPERATIONAL.
fn operational(traits: &[PdoTraits], takes_time: bool) -> Bench {
    let mut bench = with(traits, takes_time);
    bench.send("000#0101");
    bench.events();
    bench
}

fn text(frames: &[Frame]) -> Vec<String> {
    frames.iter().map(ToString::to_string).collect()
}

/// What a node sends at a SYNC and within a second after it.
fn answers(bench: &mut Bench) -> Vec<String> {
    let mut sent = bench.send("080#");
    sent.extend(bench.pass(Duration::from_secs(1)));
    text(&sent)
}

#[test]
fn an_rpdo_acts_when_it_has_been_processed() {
    let mut bench = operational(&slow(), true);
    bench.send("201#1122");
    bench.pass(21 * MS - Duration::from_nanos(1));
    assert_eq!(bench.value("6200:01"), 0);
    bench.pass(Duration::from_nanos(1));
    assert_eq!((bench.value("6200:01"), bench.value("6200:02")), (0x11, 0x22));
}

#[test]
fn a_synchronous_rpdo_begins_with_its_sync() {
    let mut bench = operational(&slow(), true);
    bench.configure("1801:01", 0x8000_0281);
    bench.send("301#33");
    bench.pass(50 * MS);
    bench.send("080#");
    bench.pass(7 * MS);
    assert_eq!(bench.value("6200:03"), 0);
    bench.pass(MS);
    assert_eq!(bench.value("6200:03"), 0x33);
}

#[test]
fn pdos_are_processed_one_after_the_other_in_the_order_of_their_coming() {
    let mut bench = operational(&slow(), true);
    bench.send("201#0100");
    bench.send("080#"); // TPDO 2
    bench.pass(5 * MS);
    bench.send("201#0200");
    bench.pass(15 * MS);
    assert_eq!(bench.value("6200:01"), 0);
    bench.pass(MS);
    assert_eq!(bench.value("6200:01"), 1, "after 21 ms");
    assert_eq!(bench.pass(11 * MS), []);
    assert_eq!(text(&bench.pass(MS)), ["281#00"], "12 ms later");
    bench.pass(20 * MS);
    assert_eq!(bench.value("6200:01"), 1);
    bench.pass(MS);
    assert_eq!(bench.value("6200:01"), 2, "21 ms later");
}

#[test]
fn a_late_call_does_not_shift_what_waits() {
    let mut bench = operational(&slow(), true);
    bench.send("201#0100");
    bench.send("201#0200");
    bench.now = bench.now + 30 * MS;
    bench.node.handle_timeout(bench.now, &mut bench.device);
    assert_eq!(bench.value("6200:01"), 1);
    bench.pass(12 * MS);
    assert_eq!(bench.value("6200:01"), 2, "42 ms after both came");
}

#[test]
fn a_tpdo_carries_the_values_of_the_moment_it_goes() {
    let mut bench = operational(&slow(), true);
    bench.show("6200:03", 0x11);
    bench.talk(
        "
        > 080#
        + 11999us
        = 6200:03 22
        + 1us
        < 281#22
        + 1s
        ",
    );
}

#[test]
fn a_pdo_without_a_processing_time_acts_and_goes_at_once() {
    let mut bench = operational(&slow(), true);
    bench.map(0x1402, 0x401, 255, &[0x6200_0408]);
    bench.send("201#0100");
    bench.send("401#44");
    assert_eq!((bench.value("6200:01"), bench.value("6200:04")), (0, 0x44));
    bench.show("6000:01", 1);
    assert_eq!(text(&bench.settle()), ["181#0100"]);
}

#[test]
fn without_processing_times_every_pdo_acts_and_goes_at_once() {
    let mut bench = operational(&slow(), false);
    bench.send("201#1122");
    assert_eq!(bench.value("6200:01"), 0x11);
    assert_eq!(text(&bench.send("080#")), ["281#00"]);
    assert_eq!(bench.events(), []);
}

/// Sends RPDO 1 every `period` for `time`; gives how many did not act.
fn lost(period: Duration, time: Duration) -> u64 {
    let mut bench = operational(&slow(), true);
    for _ in 0..time.as_nanos() / period.as_nanos() {
        bench.send("201#0000");
        bench.pass(period);
    }
    assert_eq!(bench.events().contains(&Event::QueueOverflow), bench.node.counters().overflows > 0);
    bench.node.counters().overflows
}

#[test]
fn rpdos_as_fast_as_they_are_processed_are_taken_for_an_hour_and_faster_ones_overflow() {
    const HOUR: Duration = Duration::from_secs(3600);
    assert_eq!(lost(21 * MS, HOUR), 0);
    // When the last of 3000 comes, after 59.98 s, 2856 are processed, and 16 have room.
    assert_eq!(lost(20 * MS, Duration::from_secs(60)), 3000 - 2856 - 16);
    assert!(lost(21 * MS - Duration::from_micros(10), HOUR) > 0);
}

/// Sends so many SYNCs every `period` to TPDOs 2 (12 ms) and 3 (10 ms); gives how many TPDOs were lost.
fn lost_by_sync(bench: &mut Bench, period: Duration, syncs: u32) -> u64 {
    let mut sent = 0;
    for _ in 0..syncs {
        sent += bench.send("080#").len();
        sent += bench.pass(period).len();
    }
    let lost = bench.node.counters().overflows;
    assert!(sent as u64 + lost <= 2 * u64::from(syncs));
    lost
}

#[test]
fn syncs_must_leave_the_time_of_all_active_tpdos_together() {
    let both = || {
        let mut bench = with(&slow(), true);
        bench.map(0x1802, 0x381, 1, &[0x6200_0408]);
        bench.send("000#0101");
        bench
    };
    assert_eq!(lost_by_sync(&mut both(), 22 * MS, 20_000), 0);
    assert!(lost_by_sync(&mut both(), 21 * MS, 1_000) > 0);
    let one = || operational(&slow(), true);
    assert_eq!(lost_by_sync(&mut one(), 12 * MS, 20_000), 0);
    assert!(lost_by_sync(&mut one(), 11 * MS, 1_000) > 0);
}

#[test]
fn a_tpdo_with_every_second_sync_takes_half_the_time() {
    let mut bench = with(&slow(), true);
    bench.configure("1801:02", 2);
    bench.send("000#0101");
    assert_eq!(lost_by_sync(&mut bench, 6 * MS, 20_000), 0);
}

#[test]
fn rpdos_and_tpdos_share_one_queue() {
    for (period, is_lost) in [(33 * MS, false), (32 * MS, true)] {
        let mut bench = operational(&slow(), true);
        for _ in 0..1000 {
            bench.send("201#0000");
            bench.send("080#");
            bench.pass(period);
        }
        assert_eq!(bench.node.counters().overflows > 0, is_lost, "21 ms and 12 ms every {period:?}");
    }
}

#[test]
fn an_overflow_is_told_each_time_and_its_end_once() {
    let mut bench = operational(&slow(), true);
    for _ in 0..16 {
        bench.send("201#0000");
    }
    assert_eq!(bench.events(), [], "16 have room");
    bench.send("201#0100");
    assert_eq!(bench.events(), [Event::QueueOverflow]);
    bench.send("201#0100");
    assert_eq!(bench.events(), [Event::QueueOverflow]);
    bench.pass(16 * 21 * MS - Duration::from_nanos(1));
    assert_eq!(bench.events(), []);
    bench.pass(Duration::from_nanos(1));
    assert_eq!(bench.events(), [Event::QueueDrained]);
    assert_eq!((bench.node.counters().overflows, bench.value("6200:01")), (2, 0), "what had no room is lost");
    bench.pass(Duration::from_secs(1));
    assert_eq!(bench.events(), []);
}

#[test]
fn a_scanned_value_goes_soon_and_is_the_one_that_was_read_last() {
    let mut bench = operational(&slow(), true);
    bench.map(0x1801, 0x281, 1, &[0x6200_0408, 0x6200_0308]);
    bench.show("6200:08", 0x02);
    bench.settle();
    bench.talk(
        "
        = 6200:03 11 // the first reading is over
        = 6200:04 44
        + 5ms
        > 080#
        + 999us
        = 6200:04 55 // what is not scanned is of the moment
        + 1us
        < 281#5500
        + 6ms // the next reading
        = 6200:03 22
        > 080#
        + 1ms
        < 281#5511
        = 6200:08 00 // as before
        > 080#
        + 11999us
        + 1us
        < 281#5522
        ",
    );
}

#[test]
fn scanning_leaves_time_for_more_syncs() {
    let mut bench = operational(&slow(), true);
    bench.show("6200:08", 0x02);
    assert_eq!(lost_by_sync(&mut bench, MS, 20_000), 0);
    bench.show("6200:08", 0x00);
    assert!(lost_by_sync(&mut bench, MS, 100) > 0);
}

#[test]
fn what_waits_is_forgotten_outside_operational() {
    let mut bench = operational(&slow(), true);
    for _ in 0..17 {
        bench.send("201#0100");
    }
    bench.send("080#");
    bench.send("000#8001");
    assert_eq!(bench.node.poll_timeout(), None);
    bench.send("000#0101");
    bench.pass(Duration::from_secs(1));
    assert_eq!(bench.value("6200:01"), 0);
    let events = bench.events();
    assert!(events.ends_with(&[Event::Nmt(canopen::NmtState::Operational)]), "{events:?}");
    assert!(events.contains(&Event::QueueDrained), "{events:?}");
    bench.send("201#0100");
    bench.pass(21 * MS);
    assert_eq!(bench.value("6200:01"), 1, "it starts anew");
}

#[test]
fn what_waits_is_forgotten_with_the_old_parameters() {
    let mut bench = operational(&slow(), true);
    bench.send("201#0100");
    bench.send("080#");
    bench.configure("1400:01", 0x8000_0201);
    bench.map(0x1401, 0x301, 255, &[0x6200_0408]);
    bench.send("301#44");
    bench.pass(21 * MS + 12 * MS - Duration::from_nanos(1));
    assert_eq!(bench.value("6200:04"), 0);
    assert_eq!(text(&bench.pass(Duration::from_nanos(1))), ["281#00"], "the time in work runs on");
    bench.pass(8 * MS);
    assert_eq!((bench.value("6200:01"), bench.value("6200:04")), (0, 0x44));
}

#[test]
fn what_the_gate_refuses_after_its_time_is_counted() {
    let mut bench = with(&slow(), true);
    bench.map(0x1400, 0x201, 255, &[0x2103_0010]);
    bench.send("000#0101");
    bench.send("201#FF00");
    assert_eq!(bench.node.counters().refused_rpdos, 0);
    bench.pass(21 * MS);
    assert_eq!((bench.node.counters().refused_rpdos, bench.value("2103:00")), (1, 0));
}

/// RPDO 1 and TPDO 2 have eight bytes.
fn long() -> Vec<PdoTraits> {
    let length = 8;
    [(Receive, 1), (Transmit, 2)]
        .map(|(direction, number)| PdoTraits { length, ..traits(direction, number, Duration::ZERO) })
        .to_vec()
}

#[test]
fn an_rpdo_may_have_its_reserved_bytes_or_not() {
    let mut bench = operational(&long(), true);
    for (frame, value) in [("201#0102", 1), ("201#0302FFFFFFFFFFFF", 3), ("201#0402FFFF", 4)] {
        assert_eq!(bench.send(frame), [], "no emergency");
        assert_eq!(bench.value("6200:01"), value);
    }
    assert_eq!(text(&bench.send("201#01")), ["081#1082110100010000"], "one byte is too short");
    assert_eq!(bench.node.counters().long_rpdos, 0);
}

#[test]
fn a_tpdo_has_its_reserved_bytes_and_they_are_zero() {
    let mut bench = operational(&long(), true);
    bench.show("6200:03", 0x33);
    assert_eq!(answers(&mut bench), ["281#3300000000000000"]);
}

#[test]
fn pdos_that_a_master_has_mapped_anew_have_no_reserved_bytes() {
    let mut bench = operational(&long(), true);
    bench.map(0x1400, 0x201, 255, &[0x6200_0408]);
    bench.map(0x1801, 0x281, 1, &[0x6200_0408]);
    assert_eq!(text(&bench.send("201#4400")), ["081#2082110100020000"], "one byte too many");
    assert_eq!(answers(&mut bench), ["281#44"]);
    bench.map(0x1801, 0x281, 1, &[0x6200_0308]);
    assert_eq!(answers(&mut bench), ["281#0000000000000000"], "as before");
}
