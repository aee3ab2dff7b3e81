//! Cyclic synchronous position: `canplayer` is the master that sends SYNC and set-points.
//!
//! Ten seconds at a cycle of 4 ms, which a user-mode Linux can keep on a busy machine; `CSP_SECONDS` and `CSP_MILLIS` say
//! otherwise.

use std::env;
use std::fmt::Write as _;

use tests::{Bus, Daemon, TempDir, Vcan, Wire, config};

use crate::{OPERATION_ENABLED, READY_TO_SWITCH_ON, STATE, SWITCH_ON_DISABLED, SWITCHED_ON};

/// RPDO3 (0x6040, 0x607A) acts with each SYNC; TPDO4 carries 0x60F4 and 0x6062 instead; csp.
const SET_UP: [&str; 8] = [
    "601#2F02140201000000",
    "601#23031801810400C0",
    "601#2F031A0000000000",
    "601#23031A012000F460",
    "601#23031A0220006260",
    "601#2F031A0002000000",
    "601#2303180181040040",
    "601#2F60600008000000",
];
const WRITTEN: &str = "581#60";

const SYNC: &str = "080#";
/// The first set-point again.
const BACK: &str = "401#0F0000000000";
/// Statusword bit 12: the drive follows its set-points.
const FOLLOWS: u16 = 1 << 12;

/// On virtual time it is 6 counts (`profiles/cyclic`). Here a machine that has no time for its master leaves set-points
/// out and gives several at once, which the axis then makes up for as fast as it can.
const LARGEST_ERROR: i32 = 200;

#[test]
fn an_axis_follows_a_sine_given_cycle_by_cycle_and_answers_every_sync() {
    let (seconds, millis) = (setting("CSP_SECONDS", 10), setting("CSP_MILLIS", 4));
    let cycles = seconds * 1_000 / millis;
    let interface = Vcan::new();
    let mut wire = Wire::on(&interface);
    let _daemon = Daemon::start(&config(Bus::Interface(&interface), &[("axis1", "cia402-servo", 1)]));
    enable(&mut wire, millis);
    wire.take();
    let dir = TempDir::new();

    wire.play(&dir.write("master.log", &master(&interface, cycles, millis)));

    // If this machine had no time for its master at the end, the stream broke off on the way.
    wire.send(BACK);
    wire.send(SYNC);
    // With an answer to this all that was asked before is answered.
    assert!((0..100).any(|_| demand(&mut wire).abs() <= 100), "it came back");
    let frames = wire.finish();
    let of = |id: &str| frames.iter().filter(|frame| frame.starts_with(id)).count();
    let samples: Vec<Sample> = frames.iter().filter_map(|frame| Sample::read(frame)).collect();
    let (words, errors) = (statuswords(&frames), samples.iter().map(|sample| sample.error.abs()));
    let worst = errors.max().expect("TPDO4 comes");
    let following = words.iter().filter(|word| *word & FOLLOWS != 0).count();
    println!("{} SYNCs, {following} times followed, following error {worst} counts", of(SYNC));
    assert_eq!(of(SYNC), cycles as usize + 1);
    assert_eq!((of("381#"), of("481#")), (of(SYNC), of(SYNC)), "each SYNC has its answers");
    assert!(words.iter().all(|word| word & STATE == OPERATION_ENABLED), "enabled throughout");
    assert!(worst <= LARGEST_ERROR, "{worst} counts");
    assert!(samples.iter().any(|sample| sample.demand > 39_000), "it went there");
}

/// One TPDO4.
struct Sample {
    error: i32,
    demand: i32,
}

impl Sample {
    fn read(frame: &str) -> Option<Self> {
        let raw = u64::from_str_radix(frame.strip_prefix("481#")?, 16).ok()?.swap_bytes();
        Some(Self { error: raw as u32 as i32, demand: (raw >> 32) as u32 as i32 })
    }
}

/// What each TPDO3 begins with.
fn statuswords(frames: &[String]) -> Vec<u16> {
    let word = |frame: &String| u16::from_str_radix(frame.strip_prefix("381#")?.get(..4)?, 16).ok();
    frames.iter().filter_map(word).map(u16::swap_bytes).collect()
}

/// 0x6062, read by SDO.
fn demand(wire: &mut Wire) -> i32 {
    let answer = wire.ask("601#4062600000000000", "581");
    let digits = answer.strip_prefix("581#43626000").expect("four bytes");
    u32::from_str_radix(digits, 16).expect("digits").swap_bytes().cast_signed()
}

fn enable(wire: &mut Wire, millis: u32) {
    let interpolation_time = format!("601#2FC26001{millis:02X}000000");
    for request in SET_UP.into_iter().chain([interpolation_time.as_str()]) {
        let answer = wire.ask(request, "581");
        assert!(answer.starts_with(WRITTEN), "{request}: {answer}");
    }
    wire.send("000#0101");
    wire.expect_statusword(STATE, SWITCH_ON_DISABLED);
    for (command, state) in
        [("201#0600", READY_TO_SWITCH_ON), ("201#0700", SWITCHED_ON), ("201#0F00", OPERATION_ENABLED)]
    {
        wire.send(command);
        wire.expect_statusword(STATE, state);
    }
}

fn setting(name: &str, default: u32) -> u32 {
    env::var(name).map_or(default, |text| text.parse().expect("a whole number"))
}

/// A SYNC in each cycle and, a third of one later, the set-point for the next: 20000 counts to and fro at 0.5 Hz, up to
/// 62832 counts/s.
fn master(interface: &Vcan, cycles: u32, millis: u32) -> String {
    let mut log = String::new();
    for cycle in 0..cycles {
        let angle = f64::from(cycle * millis) / 1_000.0 * std::f64::consts::PI;
        let target = (20_000.0 * (1.0 - angle.cos())).round() as i32;
        let (micros, target) = (cycle * millis * 1_000, target.cast_unsigned().swap_bytes());
        let frames = [(micros, SYNC.to_owned()), (micros + millis * 333, format!("401#0F00{target:08X}"))];
        for (micros, frame) in frames {
            let (whole, rest) = (micros / 1_000_000, micros % 1_000_000);
            writeln!(log, "({whole}.{rest:06}) {} {frame}", interface.name()).expect("a string takes it");
        }
    }
    log
}
