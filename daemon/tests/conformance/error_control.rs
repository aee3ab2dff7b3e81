//! 7.1-7.207: guarding and heartbeat.

use od::AbortCode;

use crate::tool::Tool;

const GUARD_TIME: u16 = 0x100C;
const LIFE_TIME_FACTOR: u16 = 0x100D;
const CONSUMER_TIME: u16 = 0x1016;
const HEARTBEAT_TIME: u16 = 0x1017;

fn with_heartbeat(millis: u16) -> Tool {
    let mut tool = Tool::new();
    tool.write(HEARTBEAT_TIME, 0, &millis.to_le_bytes()).unwrap();
    tool
}

/// Has the master ask at least every 3 times 100 ms.
fn guard(tool: &mut Tool) {
    tool.write(GUARD_TIME, 0, &[100, 0]).unwrap();
    tool.write(LIFE_TIME_FACTOR, 0, &[3]).unwrap();
}

#[test]
fn cct_7_01_at_first_there_is_no_life_guarding() {
    let mut tool = Tool::new();
    assert_eq!((tool.number(GUARD_TIME, 0), tool.number(LIFE_TIME_FACTOR, 0)), (0, 0));
}

#[test]
fn cct_7_02_a_request_is_answered_with_the_state() {
    for (command, answer) in [("000#8001", "701#7F"), ("000#0101", "701#05"), ("000#0201", "701#04")] {
        let mut tool = Tool::with_tpdo(1, 0);
        tool.send(command);
        assert_eq!(tool.send("701#R1"), [answer]);
    }
}

#[test]
fn cct_7_03_the_toggle_bit_changes_with_every_answer() {
    let mut tool = Tool::new();
    for answer in ["701#7F", "701#FF", "701#7F", "701#FF"] {
        assert_eq!(tool.send("701#R1"), [answer]);
    }
    tool.send("000#8201");
    assert_eq!(tool.send("701#R1"), ["701#7F"]);
}

#[test]
fn cct_7_04_requests_for_other_nodes_are_not_answered() {
    let mut tool = Tool::new();
    for id in (0x700..=0x7FF).filter(|id| *id != 0x701) {
        assert_eq!(tool.send(&format!("{id:03X}#R1")), [""; 0], "0x{id:03X}");
    }
}

#[test]
fn cct_7_05_guard_time_and_life_time_factor_are_written() {
    let mut tool = Tool::new();
    guard(&mut tool);
    assert_eq!((tool.number(GUARD_TIME, 0), tool.number(LIFE_TIME_FACTOR, 0)), (100, 3));
}

#[test]
fn cct_7_06_a_master_that_does_not_ask_any_more_is_told() {
    let mut tool = Tool::with_tpdo(1, 0);
    guard(&mut tool);
    tool.send("000#0101");
    assert_eq!(tool.pass(10_000), [""; 0], "nobody has asked yet");
    for answer in ["701#05", "701#85"].iter().cycle().take(50) {
        assert_eq!(tool.send("701#R1"), [*answer]);
        assert_eq!(tool.pass(299), [""; 0]);
    }
    assert_eq!(tool.pass(1), ["081#3081110000000000"]);
    assert_eq!(tool.send("701#R1"), ["701#7F", "081#0000000000000000"]);
}

#[test]
fn cct_7_101_the_heartbeat_time_is_written() {
    assert_eq!(with_heartbeat(1000).number(HEARTBEAT_TIME, 0), 1000);
}

#[test]
fn cct_7_102_heartbeats_come_in_their_period_and_tell_the_state() {
    let mut tool = with_heartbeat(100);
    assert_eq!(tool.pass(1000), ["701#7F"; 10]);
    tool.send("000#0201");
    assert_eq!(tool.pass(1000), ["701#04"; 10]);
}

#[test]
fn cct_7_103_a_period_of_zero_ends_the_heartbeat() {
    let mut tool = with_heartbeat(100);
    tool.pass(250);
    tool.write(HEARTBEAT_TIME, 0, &[0, 0]).unwrap();
    assert_eq!(tool.pass(10_000), [""; 0]);
}

/// Starts the device and has it supervise `producer` with 1000 ms.
fn supervise(tool: &mut Tool, sub: u8, producer: u8) {
    tool.write(CONSUMER_TIME, sub, &[0xE8, 0x03, producer, 0]).unwrap();
    tool.send("000#0101");
    assert_eq!(tool.pass(10_000), [""; 0], "the first heartbeat has not come yet");
}

#[test]
fn cct_7_104_a_producer_is_in_one_entry_at_most() {
    let mut tool = Tool::new();
    tool.write(CONSUMER_TIME, 1, &[0x34, 0x12, 5, 0]).unwrap();
    let twice = tool.write(CONSUMER_TIME, 2, &[0x34, 0x12, 5, 0]);
    assert_eq!(twice, Err(AbortCode::ParameterIncompatible));
}

#[test]
fn cct_7_105_heartbeats_that_come_in_time_change_nothing() {
    for sub in 1..=4 {
        let mut tool = Tool::with_tpdo(1, 0);
        supervise(&mut tool, sub, 9);
        for _ in 0..10 {
            assert_eq!(tool.send("709#7F"), [""; 0]);
            assert_eq!(tool.pass(999), [""; 0]);
        }
        assert_eq!(tool.send("701#R1"), ["701#05"]);
    }
}

#[test]
fn cct_7_106_every_heartbeat_that_comes_late_is_told() {
    for sub in 1..=4 {
        let mut tool = Tool::with_tpdo(1, 0);
        supervise(&mut tool, sub, 9);
        tool.send("709#7F");
        for _ in 0..10 {
            assert_eq!(tool.pass(1500), ["081#3081110900000000"]);
            assert_eq!(tool.send("709#7F"), ["081#0000000000000000"]);
        }
    }
}

#[test]
fn cct_7_107_after_a_reset_a_late_heartbeat_leads_to_pre_operational() {
    for sub in 1..=4 {
        let mut tool = Tool::with_tpdo(1, 0);
        supervise(&mut tool, sub, 8);
        assert_eq!(tool.send("000#8101"), ["701#00"]);
        assert_eq!(tool.number(CONSUMER_TIME, sub), 0);
        for communication in 0x1800..0x1804 {
            tool.invalidate(communication);
        }
        supervise(&mut tool, sub, 0x47);
        tool.send("747#7F");
        assert_eq!(tool.pass(999), [""; 0]);
        assert_eq!(tool.send("701#R1"), ["701#05"]);
        assert_eq!(tool.pass(1), ["081#3081114700000000"]);
        assert_eq!(tool.send("701#R1"), ["701#FF"]);
    }
}

#[test]
fn cct_7_201_there_are_heartbeat_and_guarding_and_both_are_off() {
    let mut tool = Tool::new();
    let values = [HEARTBEAT_TIME, GUARD_TIME, LIFE_TIME_FACTOR].map(|index| tool.number(index, 0));
    assert_eq!(values, [0, 0, 0]);
}

#[test]
fn cct_7_202_the_heartbeat_is_switched_off_beside_guarding() {
    let mut tool = with_heartbeat(100);
    guard(&mut tool);
    tool.write(HEARTBEAT_TIME, 0, &[0, 0]).unwrap();
    assert_eq!(tool.pass(10_000), [""; 0]);
}

#[test]
fn cct_7_203_without_a_heartbeat_the_device_is_guarded() {
    let mut tool = with_heartbeat(100);
    guard(&mut tool);
    tool.write(HEARTBEAT_TIME, 0, &[0, 0]).unwrap();
    assert_eq!(tool.send("701#R1"), ["701#7F"]);
    assert_eq!(tool.send("701#R1"), ["701#FF"]);
    assert_eq!(tool.pass(300), ["081#3081110000000000"]);
}

#[test]
fn cct_7_204_a_heartbeat_takes_the_place_of_guarding() {
    let mut tool = Tool::new();
    guard(&mut tool);
    assert_eq!(tool.send("701#R1"), ["701#7F"]);
    tool.write(GUARD_TIME, 0, &[0, 0]).unwrap();
    tool.write(LIFE_TIME_FACTOR, 0, &[0]).unwrap();
    tool.write(HEARTBEAT_TIME, 0, &[100, 0]).unwrap();
    assert_eq!(tool.pass(1000), ["701#7F"; 10]);
}

#[test]
fn cct_7_205_with_a_heartbeat_remote_frames_are_not_answered() {
    let mut tool = with_heartbeat(100);
    assert_eq!(tool.send("701#R1"), [""; 0]);
    assert_eq!(tool.pass(300), ["701#7F"; 3]);
}

#[test]
fn cct_7_206_beside_guarding_heartbeats_come_in_their_period() {
    let mut tool = with_heartbeat(100);
    guard(&mut tool);
    assert_eq!(tool.pass(1000), ["701#7F"; 10]);
}

#[test]
fn cct_7_207_a_heartbeat_takes_precedence_over_guarding() {
    let mut tool = with_heartbeat(100);
    guard(&mut tool);
    for _ in 0..10 {
        assert_eq!(tool.send("701#R1"), [""; 0]);
        assert_eq!(tool.pass(100), ["701#7F"]);
    }
    assert_eq!(tool.pass(1000), ["701#7F"; 10], "nobody has to ask");
}
