//! Profile position mode: targets, the set-point handshake, halt, limits.

mod bench;

use bench::Bench;
use profiles::State;

const IMMEDIATELY: i64 = 1 << 5;
const RELATIVE: i64 = 1 << 6;
const HALT: i64 = 1 << 8;
const PROFILES: [&str; 2] = ["jvl-mac00-fc4", "cia402-servo"];

fn enabled(profile: &str) -> Bench {
    let mut bench = Bench::new(profile);
    bench.fast_profile();
    bench.enable(1);
    bench
}

#[test]
fn a_move_ends_at_its_target_and_says_so() {
    for profile in PROFILES {
        let mut bench = enabled(profile);
        for target in [10_000, 0, -333] {
            bench.move_to(target, 0);
            assert!(!bench.is_set(10), "{profile}: not reached on starting");
            bench.run_until(|b| b.is_set(10));
            assert!((bench.position() - target).abs() <= 1, "{profile}: {} for {target}", bench.position());
        }
    }
}

#[test]
fn velocity_and_acceleration_stay_below_the_profile() {
    let mut bench = enabled("cia402-servo");
    bench.move_to(30_000, 0);
    let (mut fastest, mut last) = (0, 0);
    while !bench.is_set(10) {
        bench.run(1);
        let velocity = bench.get(0x606B);
        assert!((velocity - last).abs() <= 101, "from {last} to {velocity} in 1 ms");
        last = velocity;
        fastest = fastest.max(velocity);
    }
    assert_eq!(fastest, 20_000);
}

#[test]
fn a_relative_target_counts_from_the_last_one() {
    let mut bench = enabled("jvl-mac00-fc4");
    for expected in [1_000, 2_000, 3_000] {
        bench.move_to(1_000, RELATIVE);
        bench.run_until(|b| b.is_set(10));
        assert!((bench.position() - expected).abs() <= 1);
    }
}

#[test]
fn a_second_set_point_waits_for_the_first() {
    let mut bench = enabled("jvl-mac00-fc4");
    bench.move_to(5_000, 0);
    bench.set(0x607A, 0);
    bench.control(0x1F);
    assert!(bench.is_set(12));
    bench.control(0x0F);
    assert!(bench.is_set(12), "acknowledged while the buffer is full");
    bench.set(0x607A, 9_999);
    bench.control(0x1F);
    let mut furthest = 0;
    while !bench.is_set(10) {
        bench.run(1);
        furthest = furthest.max(bench.position());
    }
    assert!((4_999..=5_005).contains(&furthest), "the first target was reached: {furthest}");
    assert!(bench.position().abs() <= 1, "then the second; the third was not taken: {}", bench.position());
}

#[test]
fn change_immediately_replaces_the_move_under_way() {
    let mut bench = enabled("cia402-servo");
    bench.move_to(100_000, 0);
    bench.run(300);
    bench.move_to(-1_000, IMMEDIATELY);
    let turned = bench.position();
    bench.run_until(|b| b.is_set(10));
    assert!(turned < 10_000);
    assert!((bench.position() + 1_000).abs() <= 1);
}

#[test]
fn a_set_point_needs_a_rising_edge() {
    let mut bench = enabled("cia402-servo");
    bench.set(0x607A, 500);
    bench.control(0x1F);
    bench.run_until(|b| b.is_set(10));
    bench.set(0x607A, 900);
    bench.control(0x1F);
    bench.run(500);
    assert!((bench.position() - 500).abs() <= 1);
    assert!(bench.is_set(12));
    bench.control(0x0F);
    assert!(!bench.is_set(12));
}

#[test]
fn halt_stops_and_its_end_goes_on_to_the_target() {
    let mut bench = enabled("jvl-mac00-fc4");
    bench.move_to(20_000, 0);
    bench.run(300);
    bench.control(0x0F | HALT);
    bench.run_until(|b| b.is_set(10));
    let halted = bench.position();
    assert!(halted > 1_000 && halted < 15_000);
    bench.run(200);
    assert!((bench.position() - halted).abs() <= 1);
    bench.control(0x0F);
    assert!(!bench.is_set(10));
    bench.run_until(|b| b.is_set(10));
    assert!((bench.position() - 20_000).abs() <= 1);
}

#[test]
fn a_target_beyond_the_software_limit_ends_at_the_limit() {
    let mut bench = enabled("cia402-servo");
    bench.batch(&[(0x607D, 1, -1_000), (0x607D, 2, 2_000)]).unwrap();
    bench.move_to(10_000, 0);
    bench.run_until(|b| b.is_set(10));
    assert!((bench.position() - 2_000).abs() <= 1);
    assert!(bench.is_set(11), "internal limit active");
    bench.move_to(0, 0);
    bench.run_until(|b| b.is_set(10));
    assert!(!bench.is_set(11));
}

#[test]
fn disable_operation_ramps_down_first_and_disable_voltage_coasts() {
    let mut bench = enabled("cia402-servo");
    bench.move_to(1_000_000, 0);
    bench.run(500);
    bench.control(0x07);
    assert_eq!(bench.state(), State::OperationEnabled);
    bench.run_until(|b| b.state() == State::SwitchedOn);
    assert!(bench.velocity().abs() < 100);

    let mut bench = enabled("cia402-servo");
    bench.move_to(1_000_000, 0);
    bench.run(500);
    let before = bench.velocity();
    bench.control(0x00);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    bench.run(10);
    assert!(bench.velocity() > before * 9 / 10, "friction alone does not stop it in 10 ms");
    bench.run_until(|b| b.device.is_quiet());
}

#[test]
fn shutting_the_daemon_down_ramps_down_and_obeys_nobody_any_more() {
    let mut bench = enabled("jvl-mac00-fc4");
    bench.move_to(1_000_000, 0);
    bench.run(500);
    let now = bench.now;
    bench.device.shut_down(now);
    bench.control(0x1F);
    bench.run_until(|b| b.device.is_quiet());
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    let stopped_after = bench.now.saturating_since(now).as_millis();
    assert!(stopped_after < 300, "20000 counts/s at 200000 counts/s²: {stopped_after} ms");
    assert!(!bench.is_set(9), "not remote any more");
}

#[test]
fn an_axis_that_does_not_come_to_rest_at_the_end_loses_its_power_for_good_and_coasts() {
    let mut bench = enabled("jvl-mac00-fc4");
    bench.set(0x6085, 1);
    bench.move_to(10_000_000, 0);
    bench.run(500);
    let now = bench.now;
    bench.device.shut_down(now);
    bench.run(5000);
    let before = bench.velocity();
    assert!(before > 15_000, "its ramp takes hours: {before}");
    assert_eq!(bench.state(), State::OperationEnabled);

    let now = bench.now;
    bench.device.cut_power(now);

    assert_eq!(bench.state(), State::SwitchOnDisabled);
    bench.run(10);
    assert!(bench.velocity() > before * 9 / 10, "friction alone does not stop it in 10 ms");
    for controlword in [0x06, 0x07, 0x0F] {
        bench.control(controlword);
        bench.run(50);
    }
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    bench.run_until(|b| b.device.is_quiet());
}

#[test]
fn a_following_error_is_a_fault_after_its_time_and_shown_in_bit_13() {
    let faulted_after = |millis| {
        let mut bench = enabled("cia402-servo");
        bench.batch(&[(0x6065, 0, 500), (0x6066, 0, millis), (0x6072, 0, 0)]).unwrap();
        bench.move_to(1_000_000, 0);
        let start = bench.now;
        bench.run_until(|b| b.state() == State::Fault);
        assert!(bench.is_set(13));
        assert_eq!(bench.get(0x603F), 0x8611);
        let millis = bench.now.saturating_since(start).as_millis();
        bench.control(0x80);
        assert!(!bench.is_set(13));
        millis
    };
    let at_once = faulted_after(0);
    assert!((100..=104).contains(&at_once), "500 counts at 100 000 counts/s²: {at_once} ms");
    assert_eq!(faulted_after(40), at_once + 40);
}

#[test]
fn the_internal_demand_is_in_increments() {
    let mut bench = enabled("cia402-servo");
    bench.move_to(-1_234, 0);
    bench.run_until(|b| b.is_set(10));
    assert_eq!((bench.get(0x60FC), bench.get(0x6062)), (-1_234, -1_234));
}
