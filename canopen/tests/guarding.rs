//! Node guarding and life guarding (CiA 301 v4.2, section 7.2.8.3.2.1).

mod bench;

use bench::{Bench, device};
use canopen::{Cause, Event, NmtState};
use od::Schema;

/// A node with a guard time of 100 ms and a life time factor of 3.
fn guarded() -> Bench {
    let mut bench = Bench::new();
    bench.configure("100C:00", 100);
    bench.configure("100D:00", 3);
    bench.events();
    bench
}

// CCT 7.2, 7.3, 7.203
#[test]
fn a_request_is_answered_with_the_state_and_a_toggle_bit() {
    Bench::new().talk(
        "
        > 701#R1
        < 701#7F
        > 701#R1
        < 701#FF
        > 000#0101
        < 181#0000
        > 701#R1
        < 701#05
        > 701#R0
        < 701#85
        > 000#0201
        > 701#R1
        < 701#04
        + 60s
        > 701#R1
        < 701#84
        ",
    );
}

#[test]
fn only_a_reset_of_the_communication_resets_the_toggle_bit() {
    for reset in ["000#8201", "000#8101"] {
        Bench::new().talk(&format!(
            "
            > 701#R1
            < 701#7F
            > 000#8001
            > 000#0201
            > 701#R1
            < 701#84
            > 701#R1
            < 701#04
            > {reset}
            < 701#00
            > 701#R1
            < 701#7F
            "
        ));
    }
}

// CCT 7.4
#[test]
fn requests_for_others_are_not_answered() {
    let mut bench = Bench::new();
    for id in (0x700..=0x7FF).filter(|id| *id != 0x701) {
        assert_eq!(bench.send(&format!("{id:03X}#R1")), [], "{id:03X}");
    }
}

// CCT 2.14, 7.1, 7.5
#[test]
fn guard_time_and_life_time_factor_may_be_written() {
    Bench::new().talk(
        "
        > 601#400C100000000000
        < 581#4B0C100000000000
        > 601#400D100000000000
        < 581#4F0D100000000000
        > 601#2B0C1000E8030000
        < 581#600C100000000000
        > 601#2F0D100003000000
        < 581#600D100000000000
        > 601#400C100000000000
        < 581#4B0C1000E8030000
        ",
    );
}

// CCT 7.6
#[test]
fn life_guarding_starts_with_the_first_request_and_its_end_is_told_once() {
    guarded().talk(
        "
        + 60s
        > 701#R1
        < 701#7F
        + 299999us
        > 701#R1
        < 701#FF
        + 299999us
        + 1us
        < 081#3081110000000000
        + 60s
        > 701#R1
        < 701#7F
        < 081#0000000000000000
        + 299999us
        + 1us
        < 081#3081110000000000
        ",
    );
}

#[test]
fn an_operational_node_that_is_not_guarded_any_more_becomes_pre_operational() {
    let mut bench = guarded();
    bench.send("000#0101");
    bench.send("701#R1");
    bench.events();
    bench.talk(
        "
        + 300ms
        < 081#3081110000000000
        ",
    );
    assert_eq!(
        bench.events(),
        [Event::ConnectionLost(Cause::LifeGuarding), Event::Nmt(NmtState::PreOperational)]
    );
}

#[test]
fn without_guard_time_or_factor_there_is_no_life_guarding() {
    for zero in ["100C:00", "100D:00"] {
        let mut bench = guarded();
        bench.configure(zero, 0);
        bench.talk(
            "
            > 701#R1
            < 701#7F
            + 60s
            ",
        );
    }
}

#[test]
fn a_new_life_time_counts_from_the_moment_it_is_written() {
    guarded().talk(
        "
        > 701#R1
        < 701#7F
        + 200ms
        > 601#2F0D100002000000
        < 581#600D100000000000
        + 199999us
        + 1us
        < 081#3081110000000000
        > 601#2F0D100005000000 // the error stands
        < 581#600D100000000000
        > 601#2F0D100000000000 // nobody has to ask any more
        < 581#600D100000000000
        < 081#0000000000000000
        ",
    );
}

// CCT 7.202, 7.204, 7.205, 7.206, 7.207
#[test]
fn a_node_with_a_heartbeat_is_not_guarded() {
    guarded().talk(
        "
        > 701#R1
        < 701#7F
        > 601#2B171000E8030000
        < 581#6017100000000000
        > 701#R1
        + 1s
        < 701#7F
        > 701#R1
        + 1s
        < 701#7F
        > 601#2B17100000000000
        < 581#6017100000000000
        + 10s
        > 701#R1
        < 701#FF
        + 300ms
        < 081#3081110000000000
        > 601#2B171000E8030000 // that ends the error, too
        < 581#6017100000000000
        < 081#0000000000000000
        ",
    );
}

#[test]
fn a_node_without_0x100c_answers_no_request() {
    let mut objects = device::communication_objects();
    objects.retain(|object| !matches!(object.index, 0x100C | 0x100D));
    Bench::with(Schema::new(objects).unwrap()).started().talk("> 701#R1");
}
