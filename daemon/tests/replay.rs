//! A recorded bus replays: `recorded/reference.log` is what candump saw of python-canopen and a device of the profile
//! `canopen-reference`, node 1.

mod common;

use std::sync::Arc;
use std::time::Duration;

use canopen::Frame;
use common::{Bench, LINK, parse};
use profiles::Profile;

const RECORDED: &str = include_str!("recorded/reference.log");
/// What a device of Node-ID 1 sends: EMCY, TPDOs 1 to 4, SDO answers, heartbeat.
const FROM_DEVICE: [&str; 7] = ["081", "181", "281", "381", "481", "581", "701"];

/// Time since the first line, and frame, of every line `(1700000000.123456) can0 601#4000100000000000`.
fn recorded() -> Vec<(Duration, &'static str)> {
    let read = |line: &'static str| {
        let [stamp, _, frame] = line.split(' ').collect::<Vec<_>>()[..] else { panic!("{line}") };
        let (seconds, micros) = stamp.trim_matches(['(', ')']).split_once('.').unwrap();
        (Duration::new(seconds.parse().unwrap(), 1000 * micros.parse::<u32>().unwrap()), frame)
    };
    let lines: Vec<_> = RECORDED.lines().map(read).collect();
    let start = lines[0].0;
    lines.into_iter().map(|(at, frame)| (at - start, frame)).collect()
}

fn is_from_device(frame: &str) -> bool {
    FROM_DEVICE.iter().any(|id| frame.starts_with(id))
}

/// What the device sends when it hears what the master sent, as candump shows it.
fn replay() -> String {
    let profile = Arc::new(Profile::embedded("canopen-reference", None).unwrap().unwrap());
    let mut bench = Bench::of(&profile, &[&[(0, 1)]]);
    let start = bench.now;
    let mut log = String::new();
    let mut write = |bench: &Bench, frames: Vec<String>| {
        let at = bench.now.saturating_since(start);
        let stamp = format!("({}.{:06})", at.as_secs(), at.subsec_micros());
        log.extend(frames.iter().map(|frame| format!("{stamp} can0 {frame}\n")));
    };
    for (at, frame) in recorded().into_iter().filter(|(_, frame)| !is_from_device(frame)) {
        let end = start + at;
        while let Some(deadline) = bench.core.poll_timeout().filter(|deadline| *deadline <= end) {
            let sent = bench.run(deadline.saturating_since(bench.now));
            write(&bench, sent);
        }
        bench.now = end;
        let frame: Frame = parse(frame);
        bench.core.handle_frame(bench.now, LINK, &frame);
        let sent = bench.sent_on(LINK);
        write(&bench, sent);
    }
    log
}

#[test]
fn a_recorded_bus_replays_to_the_same_bytes() {
    let first = replay();
    assert!(first.lines().count() > 300);
    assert_eq!(first, replay());
}

#[test]
fn a_recorded_bus_replays_to_what_was_recorded() {
    let replayed = replay();
    // Only heartbeats depend on when exactly a thread woke up.
    for id in FROM_DEVICE.into_iter().filter(|id| *id != "701") {
        let is_meant = |frame: &&str| frame.starts_with(id);
        let expected: Vec<_> = recorded().into_iter().map(|(_, frame)| frame).filter(is_meant).collect();
        let actual: Vec<_> = replayed.lines().filter_map(|l| l.rsplit(' ').next()).filter(is_meant).collect();
        assert_eq!(actual, expected, "{id}");
        assert!(!expected.is_empty(), "{id}");
    }
}
