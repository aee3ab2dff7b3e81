//! 7.1-7.207: guarding and heartbeat.

use crate::tool::Tool;

const HEARTBEAT_TIME: u16 = 0x1017;

fn with_heartbeat(millis: u16) -> Tool {
    let mut tool = Tool::new();
    tool.write(HEARTBEAT_TIME, 0, &millis.to_le_bytes()).unwrap();
    tool
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

#[test]
fn cct_7_205_with_a_heartbeat_remote_frames_are_not_answered() {
    let mut tool = with_heartbeat(100);
    assert_eq!(tool.send("701#R1"), [""; 0]);
    assert_eq!(tool.pass(300), ["701#7F"; 3]);
}
