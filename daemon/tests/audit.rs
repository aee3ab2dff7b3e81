//! What is kept of who commanded what, on virtual time.

mod common;

use std::sync::Arc;
use std::time::Duration;

use common::Bench;
use daemon::core::{AuditEntry, LinkId, What, Who};
use profiles::Profile;

fn bench(profile: &str) -> Bench {
    let profile = Arc::new(Profile::embedded(profile, None).unwrap().unwrap());
    let mut bench = Bench::of(&profile, &[&[(0, 1)], &[(0, 2)]]);
    bench.core.keep_audit();
    bench
}

/// What is to be kept since the last time: device, object, value and kind.
fn kept(bench: &mut Bench) -> Vec<(usize, String, i128, What)> {
    let entries = std::iter::from_fn(|| bench.core.poll_audit());
    entries.map(|e| (e.device, e.address.to_string(), e.value, e.what)).collect()
}

#[test]
fn every_acyclic_command_is_kept_even_one_that_changes_nothing() {
    let mut bench = bench("cia402-servo");
    bench.write(1, 0x6040, 0, &[6, 0]);
    bench.write(1, 0x6040, 0, &[6, 0]);
    bench.write(2, 0x607A, 0, &(-5_i32).to_le_bytes());
    bench.write(1, 0x6065, 0, &[9, 0, 0, 0]);
    bench.send("601#2B40600007000000");
    let entries: Vec<AuditEntry> = std::iter::from_fn(|| bench.core.poll_audit()).collect();
    let told: Vec<_> = entries.iter().map(|e| (e.device, e.address.to_string(), e.value)).collect();
    let controlword = || "0x6040:00".to_owned();
    let expected = [
        (0, controlword(), 6),
        (0, controlword(), 6),
        (1, "0x607A:00".to_owned(), -5),
        (0, controlword(), 7),
    ];
    assert_eq!(told, expected, "0x6065 moves nothing");
    assert!(entries.iter().all(|e| e.what == What::Write && e.who == Who::CanOpen(LinkId(0))));
    assert_eq!(entries.iter().map(|e| e.node_id).collect::<Vec<_>>(), [Some(1), Some(1), Some(2), Some(1)]);
    assert!(entries.iter().all(|e| e.at == bench.now));
}

#[test]
fn a_command_that_is_refused_is_not_kept() {
    let mut bench = bench("cia402-servo");
    bench.send("601#2F60600005000000");
    bench.send("601#2B40600106000000");
    assert_eq!(kept(&mut bench), []);
}

#[test]
fn of_cyclic_data_changes_of_the_controlword_and_the_ends_of_a_stream_are_kept() {
    let mut bench = bench("cia402-servo");
    bench.send("000#0100");
    let began = bench.now;
    // RPDO 3 is controlword and target position.
    for target in 0..100_u8 {
        bench.send(&format!("401#0600{target:02X}000000"));
        bench.run(Duration::from_millis(10));
    }
    bench.send("401#070063000000");
    let position = || "0x607A:00".to_owned();
    let controlword = || "0x6040:00".to_owned();
    assert_eq!(
        kept(&mut bench),
        [
            (0, controlword(), 6, What::Change),
            (0, position(), 0, What::StreamStart),
            (0, controlword(), 7, What::Change),
        ]
    );
    let lasted = bench.now.saturating_since(began);
    bench.run(Duration::from_millis(990));
    assert_eq!(kept(&mut bench), [], "it may still go on");
    bench.run(Duration::from_millis(20));
    let end = What::StreamEnd { set_points: 101, lasted };
    assert_eq!(kept(&mut bench), [(0, position(), 99, end)]);
    bench.run(Duration::from_secs(10));
    assert_eq!(kept(&mut bench), []);
}

#[test]
fn streams_to_several_devices_end_each_for_itself() {
    let mut bench = bench("cia402-servo");
    bench.send("000#0100");
    bench.send("401#000001000000");
    bench.send("402#000002000000");
    for _ in 0..20 {
        bench.run(Duration::from_millis(100));
        bench.send("402#000002000000");
    }
    let told: Vec<_> =
        kept(&mut bench).into_iter().map(|(device, _, value, what)| (device, value, what)).collect();
    let once = What::StreamEnd { set_points: 1, lasted: Duration::ZERO };
    assert_eq!(told, [(0, 1, What::StreamStart), (1, 2, What::StreamStart), (0, 1, once)]);
    bench.run(Duration::from_secs(2));
    let lasted = Duration::from_secs(2);
    assert_eq!(kept(&mut bench)[0].3, What::StreamEnd { set_points: 21, lasted });
}

#[test]
fn registers_that_move_a_motor_are_commands_and_those_that_tune_it_are_none() {
    let mut bench = bench("jvl-mac00-fc4");
    // P_SOLL, MODE_REG, and INPOSWIN of a MAC140.
    bench.write(1, 0x2012, 3, &1000_u32.to_le_bytes());
    bench.write(1, 0x2012, 2, &2_u32.to_le_bytes());
    bench.write(1, 0x2012, 33, &7_u32.to_le_bytes());
    let told = kept(&mut bench);
    let expected = [("0x2012:03", 1000), ("0x2012:02", 2)];
    assert_eq!(told.len(), expected.len(), "{told:?}");
    for ((_, address, value, what), expected) in told.iter().zip(expected) {
        assert_eq!((&**address, *value, *what), (expected.0, expected.1, What::Write));
    }
}

#[test]
fn what_nobody_takes_is_lost_and_counted_and_without_a_keeper_nothing_is() {
    let mut bench = bench("cia402-servo");
    (0..1030).for_each(|_| bench.write(1, 0x6040, 0, &[6, 0]));
    assert_eq!(bench.core.lost_audit(), 6);
    assert_eq!(kept(&mut bench).len(), 1024);
    let profile = Arc::new(Profile::embedded("cia402-servo", None).unwrap().unwrap());
    let mut silent = Bench::of(&profile, &[&[(0, 1)]]);
    (0..1030).for_each(|_| silent.write(1, 0x6040, 0, &[6, 0]));
    assert_eq!((silent.core.lost_audit(), silent.core.poll_audit()), (0, None));
}
