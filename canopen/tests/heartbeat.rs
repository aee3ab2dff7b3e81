//! Heartbeat producer (CiA 301 v4.2, section 7.2.8.3.2.2).

mod bench;

use core::time::Duration;

use bench::{Bench, frame_of};
use canopen::is_boot_up;

// CCT 7.101, 7.102
#[test]
fn the_heartbeat_shows_the_state_in_every_period() {
    let mut bench = Bench::new();
    bench.talk(
        "
        + 3s
        > 601#2B17100064000000
        < 581#6017100000000000
        + 99999us
        + 1us
        < 701#7F
        + 99999us
        > 000#0101
        < 181#0000
        + 1us
        < 701#05
        > 000#0201
        + 200ms
        < 701#04
        < 701#04
        ",
    );
}

// CCT 7.103
#[test]
fn a_producer_time_of_zero_ends_it() {
    Bench::new().talk(
        "
        > 601#2B17100001000000
        < 581#6017100000000000
        + 2ms
        < 701#7F
        < 701#7F
        > 601#2B17100000000000
        < 581#6017100000000000
        + 60s
        ",
    );
}

#[test]
fn a_late_call_does_not_shift_the_following_beats() {
    let mut bench = Bench::new();
    bench.configure("1017:00", 100);
    bench.now = bench.now + Duration::from_millis(130);
    bench.node.handle_timeout(bench.now, &mut bench.device);
    bench.talk(
        "
        < 701#7F
        + 69999us
        + 1us
        < 701#7F
        ",
    );
}

#[test]
fn beats_that_were_missed_are_not_made_up_for() {
    let mut bench = Bench::new();
    bench.configure("1017:00", 100);
    bench.now = bench.now + Duration::from_millis(1050);
    bench.node.handle_timeout(bench.now, &mut bench.device);
    bench.talk(
        "
        < 701#7F
        + 99999us
        + 1us
        < 701#7F
        ",
    );
}

#[test]
fn the_producer_time_reaches_to_65535_ms() {
    Bench::new().talk(
        "
        > 601#2B171000FFFF0000
        < 581#6017100000000000
        + 65534999us
        + 1us
        < 701#7F
        ",
    );
}

#[test]
fn a_request_for_the_heartbeat_is_not_answered() {
    let mut bench = Bench::new();
    bench.configure("1017:00", 100);
    bench.talk("> 701#R1"); // that would be node guarding
}

#[test]
fn an_hour_has_36000_beats_of_100_ms() {
    let mut bench = Bench::new();
    bench.configure("1017:00", 100);
    assert_eq!(bench.pass(Duration::from_secs(3600)).len(), 36_000);
}

#[test]
fn what_the_next_heartbeat_tells_anew_is_a_heartbeat_and_nothing_else_of_its_cob_id() {
    let mut bench = Bench::new();
    let is_heartbeat = |bench: &Bench, frame| bench.node.is_heartbeat(&frame_of(frame));
    assert!(!is_heartbeat(&bench, "701#7F"), "it may be the answer to a node-guarding request");
    bench.configure("1017:00", 100);
    for state in ["701#7F", "701#05", "701#04"] {
        assert!(is_heartbeat(&bench, state), "{state}");
    }
    for other in ["701#00", "701#", "701#7F00", "702#7F", "081#7F", "00000701#7F", "701#R1"] {
        assert!(!is_heartbeat(&bench, other), "{other}");
    }
    bench.configure("1017:00", 0);
    assert!(!is_heartbeat(&bench, "701#7F"));
}

#[test]
fn a_boot_up_message_is_known_by_itself() {
    let boot_ups = ["701#00", "77F#00"];
    let others =
        ["700#00", "780#00", "701#05", "701#7F", "701#0000", "701#", "701#R1", "00000701#00", "081#00"];
    assert!(boot_ups.into_iter().all(|frame| is_boot_up(&frame_of(frame))));
    assert!(!others.into_iter().any(|frame| is_boot_up(&frame_of(frame))));
}
