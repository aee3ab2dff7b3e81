//! The processing times of JVL's module (manual, section 4.3.17) on virtual time.

mod common;

use std::sync::Arc;
use std::time::Duration;

use common::{Bench, LINK};
use profiles::{PlantFault, Profile, Repair, Timing};

const MS: Duration = Duration::from_millis(1);
const MICRO: Duration = Duration::from_micros(1);

/// COB-IDs that a master gives to RPDOs and TPDOs 21-25.
const RPDO_21: u32 = 0x221;
const TPDO_21: u32 = 0x1A1;

const OVERFLOW: &str = "081#0410010000000000";
const NO_ERROR: &str = "081#0000000000000000";

/// A motor in OPERATIONAL that takes its time, with these RPDOs and TPDOs switched on.
fn motor(timing: Timing, rpdos: &[u16], tpdos: &[u16]) -> Bench {
    let mut bench = Bench::silent(&[&[(0, 1)]]);
    bench.core.set_timing(0, timing);
    bench.core.start(bench.now, LINK);
    bench.run(100 * MS);
    for (base, cob_id, numbers) in [(0x1400, RPDO_21, rpdos), (0x1800, TPDO_21, tpdos)] {
        for number in numbers {
            let cob_id = cob_id + u32::from(*number) - 21;
            bench.write(1, base + number - 1, 1, &cob_id.to_le_bytes());
        }
    }
    bench.send("000#0101");
    bench.run(MS);
    bench
}

fn authentic(rpdos: &[u16], tpdos: &[u16]) -> Bench {
    motor(Timing::Authentic, rpdos, tpdos)
}

fn read(bench: &mut Bench, sub: u8) -> String {
    let answers = bench.send(&format!("601#401220{sub:02X}00000000"));
    answers.iter().find_map(|frame| frame.strip_prefix(&format!("581#431220{sub:02X}"))).unwrap().to_owned()
}

/// Whether the queue overflows when `frame` comes `times` times, once in every `period`.
fn overflows(bench: &mut Bench, frame: &str, period: Duration, times: u32) -> bool {
    let mut sent = Vec::new();
    for _ in 0..times {
        sent.extend(bench.send(frame));
        sent.extend(bench.run(period));
    }
    let told = sent.iter().filter(|frame| *frame == OVERFLOW).count();
    assert!(told <= 1, "told once");
    told == 1
}

#[test]
fn received_pdos_may_come_as_fast_as_they_are_processed_and_no_faster() {
    let nothing = "0000000000000000";
    let micros = [(21, 8_500), (22, 21_000), (23, 900), (24, 900)];
    for (number, micros) in micros {
        let frame = format!("{:03X}#{nothing}", RPDO_21 + u32::from(number) - 21);
        let period = micros * MICRO;
        assert!(!overflows(&mut authentic(&[number], &[]), &frame, period, 5_000), "RPDO {number}");
        assert!(overflows(&mut authentic(&[number], &[]), &frame, period * 20 / 21, 1_000), "RPDO {number}");
        assert!(!overflows(&mut motor(Timing::Immediate, &[number], &[]), &frame, MICRO, 1_000));
    }
}

#[test]
fn rpdo_22_every_21_ms_is_fine_for_minutes_and_every_20_ms_overflows_within_seconds() {
    let frame = "222#0000000000000000";
    assert!(!overflows(&mut authentic(&[22], &[]), frame, 21 * MS, 600_000 / 21));
    assert!(overflows(&mut authentic(&[22], &[]), frame, 20 * MS, 500));
}

#[test]
fn a_sync_must_leave_the_time_of_all_active_tpdos() {
    let table: [(&[u16], u32); 6] = [
        (&[21], 12_500),
        (&[22], 10_500),
        (&[23], 10_500),
        (&[24], 10_500),
        (&[21, 22], 23_000),
        (&[21, 22, 23, 24], 44_000),
    ];
    for (numbers, micros) in table {
        let period = micros * MICRO;
        assert!(!overflows(&mut authentic(&[], numbers), "080#", period, 1_000), "{numbers:?}");
        assert!(overflows(&mut authentic(&[], numbers), "080#", period - 500 * MICRO, 1_000), "{numbers:?}");
        assert!(!overflows(&mut motor(Timing::Immediate, &[], numbers), "080#", MS, 1_000), "{numbers:?}");
    }
}

#[test]
fn a_scanned_position_and_velocity_allow_a_sync_every_2_ms() {
    let mut bench = authentic(&[], &[21, 22]);
    bench.write(1, 0x2011, 8, &[0x03]);
    assert!(!overflows(&mut bench, "080#", 2 * MS, 5_000));
    bench.write(1, 0x2011, 8, &[0x01]);
    assert!(overflows(&mut bench, "080#", 2 * MS, 100), "10.5 ms for the velocity");
}

#[test]
fn pdos_act_and_go_when_they_have_been_processed() {
    let mut bench = authentic(&[21], &[22]);
    bench.send("221#78563412");
    bench.run(8_499 * MICRO);
    assert_eq!(read(&mut bench, 3), "00000000");
    bench.run(MICRO);
    assert_eq!(read(&mut bench, 3), "78563412");

    // The manual gives no times for PDOs 1-7.
    assert_eq!(bench.send("080#"), ["381#500200000000", "481#500200000000"]);
    assert_eq!(bench.run(10_499 * MICRO), [""; 0]);
    assert_eq!(bench.run(MICRO), ["1A2#0000000000000000"]);
}

/// Runs a motor at a steady velocity and gives what TPDO 21 brings at a SYNC, with P_IST at the SYNC and when TPDO 21 came.
fn positions(setup: u8) -> (i32, i32, i32) {
    let mut bench = authentic(&[], &[21]);
    bench.write(1, 0x2011, 8, &[setup]);
    bench.turn(40_960);
    bench.run(Duration::from_secs(4));
    let number = |digits: &str| u32::from_str_radix(digits, 16).unwrap().swap_bytes().cast_signed();
    let before = number(&read(&mut bench, 10));
    bench.send("080#");
    let sent = bench.run(13 * MS);
    let tpdo = sent.iter().find_map(|frame| frame.strip_prefix("1A1#")).unwrap();
    assert_eq!(tpdo.len(), 16, "eight bytes");
    (before, number(&tpdo[..8]), number(&read(&mut bench, 10)))
}

#[test]
fn a_position_that_is_read_is_new_and_one_that_is_scanned_is_the_last_one() {
    // 40.96 counts/ms.
    let (before, read, after) = positions(0x00);
    assert!((before + 400..=after).contains(&read), "read 12.5 ms after the SYNC: {before} {read} {after}");
    let (before, scanned, _) = positions(0x01);
    assert!((before - 13 * 41..=before + 41).contains(&scanned), "at most 12.5 ms old: {before} {scanned}");
}

#[test]
fn an_overflow_ends_when_the_queue_is_empty_or_by_command_2() {
    let mut bench = authentic(&[22], &[]);
    let fill = |bench: &mut Bench| {
        (0..17).flat_map(|_| bench.send("222#0000000000000000")).filter(|f| f.starts_with("081")).collect()
    };
    let told: Vec<String> = fill(&mut bench);
    assert_eq!(told, [OVERFLOW]);
    assert_eq!(bench.run(16 * 21 * MS - MICRO), [""; 0]);
    assert_eq!(bench.run(MICRO), [NO_ERROR]);

    let told: Vec<String> = fill(&mut bench);
    assert_eq!(told, [OVERFLOW]);
    let answers = bench.send("601#2F10200002000000");
    assert_eq!(answers, ["581#6010200000000000", NO_ERROR]);
    assert_eq!(bench.send("222#0000000000000000"), [OVERFLOW], "there is still no room");
}

#[test]
fn tpdo_25_tells_a_lost_motor_at_once_in_immediate_timing() {
    let mut bench = motor(Timing::Immediate, &[], &[25]);
    let broken: PlantFault = "connection-loss".parse().unwrap();
    bench.core.inject(bench.now, 0, 0, broken).unwrap();
    let told = bench.run(5 * MS);
    let of = |frames: &[String], id: &str| -> Vec<String> {
        frames.iter().filter(|frame| frame.starts_with(id)).cloned().collect()
    };
    assert_eq!(of(&told, "081"), ["081#0310010000000000"]);
    assert_eq!(of(&told, "1A5"), ["1A5#0200000000000000"], "disconnected");
    bench.core.repair(bench.now, 0, 0, Repair::All).unwrap();
    let told = bench.run(10 * MS);
    assert_eq!(of(&told, "081"), [NO_ERROR]);
    assert_eq!(of(&told, "1A5"), ["1A5#0000000000000000"]);
}

#[test]
fn a_profile_without_processing_times_has_none() {
    let profile = Arc::new(Profile::embedded("cia402-servo", None).unwrap().unwrap());
    assert!(!profile.has_processing_times());
    let mut bench = Bench::of(&profile, &[&[(0, 1)]]);
    bench.send("000#0101");
    bench.run(100 * MS);
    assert!(!bench.send("080#").is_empty());
}
