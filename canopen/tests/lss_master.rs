//! The LSS master with slaves that are our own.

mod bench;

use std::collections::VecDeque;

use core::time::Duration;

use bench::{Bench, device};
use canopen::{Event, Id, LssFailure, LssFound, LssMaster, LssStep, LssTask, Order, UNCONFIGURED};
use od::{AbortCode, Address, Instant, Value};

/// A slave with this serial number.
fn slave(node_id: u8, serial: u64) -> Bench {
    let mut communication = device::communication();
    communication.set_initial(Address::new(0x1018, 4), Value::Fixed(serial));
    let mut bench = Bench::as_node(node_id, communication).started();
    bench.events();
    bench
}

fn address(serial: u32) -> [u32; 4] {
    [0x0000_04D2, 0x0000_0402, 0x0001_0002, serial]
}

/// Does the task with these slaves, which store with this outcome; also how long it took.
fn run(
    slaves: &mut [Bench],
    task: LssTask,
    stores: Result<(), AbortCode>,
) -> (Result<LssFound, LssFailure>, Duration) {
    let begin = Instant::ZERO + Duration::from_secs(1);
    let (mut master, mut now) = (LssMaster::new(task), begin);
    let mut answers = VecDeque::new();
    loop {
        match master.next(now, answers.pop_front()) {
            LssStep::Done(outcome) => return (outcome, now.saturating_since(begin)),
            LssStep::Wait(_) if !answers.is_empty() => {}
            LssStep::Wait(deadline) => now = deadline,
            LssStep::Send(frame) => {
                answers.clear();
                for slave in &mut *slaves {
                    let mut sent = slave.handle(&frame);
                    for event in slave.events() {
                        if matches!(event, Event::Storage(Order::Lss(_))) {
                            slave.node.stored(slave.now, stores);
                            sent.extend(slave.settle());
                        }
                    }
                    let own = sent.iter().filter(|frame| frame.id == Id::Standard(0x7E4));
                    answers.extend(own.filter_map(canopen::Frame::eight));
                }
            }
        }
    }
}

#[test]
fn slaves_without_a_node_id_are_found_and_configured_one_after_the_other() {
    let mut slaves = [0xFFFF_FFFF, 0, 0x1234_5678].map(|serial| slave(UNCONFIGURED, serial));
    let mut found = Vec::new();
    for node_id in 10..13 {
        let (outcome, time) = run(&mut slaves, LssTask::Configure { node_id, address: None }, Ok(()));
        let outcome = outcome.unwrap();
        assert_eq!(outcome.node_id, node_id);
        assert!(time < Duration::from_secs(4), "{time:?}");
        found.push(outcome.address);
    }
    // Zero bits come first.
    assert_eq!(found, [address(0), address(0x1234_5678), address(0xFFFF_FFFF)]);
    assert_eq!(slaves.each_ref().map(|slave| slave.node.node_id()), [12, 10, 11]);
    assert_eq!(run(&mut slaves, LssTask::Scan, Ok(())).0, Err(LssFailure::NoSlave));
}

#[test]
fn a_scan_tells_who_is_there_and_changes_nothing() {
    let mut slaves = [slave(UNCONFIGURED, 7), slave(5, 6)];
    let found = Ok(LssFound { address: address(7), node_id: UNCONFIGURED });
    assert_eq!(run(&mut slaves, LssTask::Scan, Ok(())).0, found);
    assert_eq!(run(&mut slaves, LssTask::Scan, Ok(())).0, found);
}

#[test]
fn a_slave_is_asked_and_configured_by_its_address() {
    let mut slaves = [slave(4, 7), slave(5, 6)];
    let found = |node_id| Ok(LssFound { address: address(6), node_id });
    assert_eq!(run(&mut slaves, LssTask::Inquire(address(6)), Ok(())).0, found(5));
    let task = LssTask::Configure { node_id: 9, address: Some(address(6)) };
    assert_eq!(run(&mut slaves, task, Ok(())).0, found(9));
    assert_eq!(slaves.each_ref().map(|slave| slave.node.lss_stored().node_id), [UNCONFIGURED, 9]);
    assert_eq!(run(&mut slaves, LssTask::Inquire(address(8)), Ok(())).0, Err(LssFailure::NoSlave));
}

#[test]
fn what_a_slave_refuses_is_told() {
    let mut slaves = [slave(5, 6)];
    let task = |node_id| LssTask::Configure { node_id, address: Some(address(6)) };
    assert_eq!(run(&mut slaves, task(0), Ok(())).0, Err(LssFailure::NodeIdRefused(1)));
    let (outcome, _) = run(&mut slaves, task(9), Err(AbortCode::CannotStore));
    assert!(matches!(outcome, Err(LssFailure::NotStored(_))), "{outcome:?}");
}

#[test]
fn nobody_is_waited_for_for_ever() {
    let (outcome, time) = run(&mut [], LssTask::Inquire(address(6)), Ok(()));
    assert_eq!(outcome, Err(LssFailure::NoSlave));
    assert!(time < Duration::from_secs(5), "{time:?}");
}
