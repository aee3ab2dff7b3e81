//! Start, interruption and result, bit by bit.

use std::sync::Arc;

use axis::{DriveFault, PlantFault};
use od::AbortCode;
use profiles::{Device, Profile, State};

use crate::bench::Bench;
use crate::machine::{ATTAINED, COMPLETED, Machine, RUNNING, WAITING, bits, home, place, start};

const ENABLED: i64 = 0x0F;
const START: i64 = 1 << 4;
const HALT: i64 = 1 << 8;
const SERVO: &str = "cia402-servo";

/// Lets homing run until the switch is being looked for at full speed.
fn searching() -> Bench {
    let mut bench = Machine::MIDDLE.at(-5_000).enabled(SERVO);
    start(&mut bench, 7);
    bench.run(300);
    assert_eq!(bits(&bench), RUNNING);
    assert!(bench.velocity() > 8_000);
    bench
}

/// What the bits say while `millis` pass, each change once.
fn trace(bench: &mut Bench, millis: u64) -> Vec<[bool; 3]> {
    let mut seen = vec![bits(bench)];
    for _ in 0..millis {
        bench.run(1);
        seen.push(bits(bench));
    }
    seen.dedup();
    seen
}

#[test]
fn a_homing_runs_is_attained_and_completed() {
    let mut bench = Machine::MIDDLE.enabled(SERVO);
    assert_eq!(trace(&mut bench, 20), [RUNNING, WAITING], "once it stands");
    start(&mut bench, 7);
    assert_eq!(trace(&mut bench, 5_000), [RUNNING, ATTAINED, COMPLETED]);
}

#[test]
fn clearing_the_start_bit_interrupts_and_setting_it_starts_anew() {
    let mut bench = searching();
    bench.control(ENABLED);
    assert_eq!(trace(&mut bench, 500), [RUNNING, WAITING]);
    let stopped = place(&mut bench);
    assert!(stopped < 2_900, "on the way: {stopped}");
    bench.control(ENABLED | START);
    assert_eq!(trace(&mut bench, 5_000), [RUNNING, ATTAINED, COMPLETED]);
}

#[test]
fn once_attained_the_start_bit_no_longer_matters() {
    let mut bench = searching();
    bench.run_until(|b| b.is_set(12));
    bench.control(ENABLED);
    assert_eq!(trace(&mut bench, 500), [ATTAINED, COMPLETED]);
    let expected = Machine::MIDDLE.index_below(3_000);
    assert!((place(&mut bench) - expected).abs() <= 1);
}

#[test]
fn a_halt_interrupts_and_its_end_goes_on() {
    let mut bench = searching();
    bench.control(ENABLED | START | HALT);
    assert_eq!(trace(&mut bench, 500), [RUNNING, WAITING]);
    assert!(place(&mut bench) < 2_900);
    bench.control(ENABLED | START);
    assert_eq!(trace(&mut bench, 5_000), [RUNNING, ATTAINED, COMPLETED]);
}

#[test]
fn a_halt_after_home_was_found_only_delays_the_end() {
    let mut bench = searching();
    bench.run_until(|b| b.is_set(12));
    bench.control(ENABLED | START | HALT);
    bench.run(200);
    assert!(bench.is_set(12));
    bench.control(ENABLED | START);
    bench.run(200);
    assert_eq!(bits(&bench), COMPLETED);
    assert_eq!(bench.get(0x6062), 0);
}

#[test]
fn a_homing_given_up_during_a_halt_does_not_go_on() {
    let mut bench = searching();
    bench.control(ENABLED | START | HALT);
    bench.run(300);
    bench.control(ENABLED | HALT);
    bench.control(ENABLED);
    assert_eq!(trace(&mut bench, 500), [WAITING]);
    assert_eq!(bench.velocity(), 0);
}

#[test]
fn a_start_during_a_halt_waits_for_its_end() {
    let mut bench = Machine::MIDDLE.enabled(SERVO);
    bench.set(0x6098, 7);
    bench.control(ENABLED | HALT);
    bench.run(20);
    bench.control(ENABLED | START | HALT);
    assert_eq!(trace(&mut bench, 200), [WAITING]);
    bench.control(ENABLED | START);
    assert_eq!(trace(&mut bench, 5_000), [RUNNING, ATTAINED, COMPLETED]);
}

#[test]
fn a_start_bit_that_was_set_before_the_mode_starts_nothing() {
    let mut bench = Machine::MIDDLE.enabled(SERVO);
    bench.batch(&[(0x6060, 0, 1), (0x6098, 0, 7)]).unwrap();
    bench.run(20);
    bench.control(ENABLED | START);
    bench.set(0x6060, 6);
    bench.run(20);
    assert_eq!(bench.get(0x6061), 6);
    assert_eq!(trace(&mut bench, 200), [WAITING]);
}

#[test]
fn after_a_quick_stop_homing_waits_for_another_start() {
    let mut bench = searching();
    bench.batch(&[(0x605A, 0, 6), (0x6085, 0, 1_000_000)]).unwrap();
    bench.control(0x0B | START);
    bench.run(300);
    assert_eq!(bench.state(), State::QuickStopActive);
    bench.control(ENABLED | START);
    bench.run(10);
    assert_eq!(bench.state(), State::OperationEnabled);
    assert_eq!(trace(&mut bench, 300), [WAITING]);
    assert_eq!(home(&mut bench, 7), COMPLETED);
}

#[test]
fn a_change_of_the_mode_interrupts() {
    let mut bench = searching();
    bench.set(0x6060, 1);
    assert_eq!(bench.get(0x6061), 6, "it ramps down first");
    bench.run_until(|b| b.get(0x6061) == 1);
    assert!(place(&mut bench) < 2_900);
    bench.set(0x6060, 6);
    bench.run(20);
    assert_eq!(bits(&bench), WAITING);
}

#[test]
fn disabling_interrupts() {
    let mut bench = searching();
    bench.control(0x07);
    bench.run_until(|b| b.state() == State::SwitchedOn);
    bench.control(ENABLED | START);
    bench.run_until(|b| b.state() == State::OperationEnabled);
    assert_eq!(trace(&mut bench, 300).last(), Some(&WAITING));
}

#[test]
fn the_result_stays_until_the_next_start() {
    let mut bench = Machine::MIDDLE.enabled(SERVO);
    assert_eq!(home(&mut bench, 7), COMPLETED);
    bench.control(0x06);
    bench.run(20);
    bench.enable(6);
    bench.run(20);
    assert_eq!(bits(&bench), COMPLETED, "switched off and on");
    bench.set(0x6060, 1);
    bench.run(20);
    bench.move_to(2_000, 0);
    bench.run_until(|b| b.is_set(10));
    bench.set(0x6060, 6);
    bench.run(20);
    assert_eq!(bits(&bench), COMPLETED, "moved in another mode");
    start(&mut bench, 8);
    assert_eq!(trace(&mut bench, 5_000), [RUNNING, ATTAINED, COMPLETED]);
    start(&mut bench, 8);
    bench.run(10);
    bench.control(ENABLED);
    assert_eq!(trace(&mut bench, 500), [RUNNING, WAITING], "interrupted the second time");
}

#[test]
fn a_lost_encoder_and_a_reset_lose_the_reference_but_another_fault_does_not() {
    for (fault, keeps) in [(DriveFault::Encoder, false), (DriveFault::OverTemperature, true)] {
        let mut bench = Machine::MIDDLE.enabled(SERVO);
        assert_eq!(home(&mut bench, 37), COMPLETED);
        let fault = PlantFault::DriveFault(fault);
        bench.device.plant(0, bench.now).unwrap().inject(fault);
        bench.run(20);
        assert_eq!(bench.state(), State::Fault);
        bench.device.plant(0, bench.now).unwrap().clear(fault);
        bench.control(0x80);
        bench.run(20);
        bench.enable(6);
        bench.run(20);
        assert_eq!(bits(&bench), if keeps { COMPLETED } else { WAITING });
    }
    let mut bench = Machine::MIDDLE.enabled(SERVO);
    assert_eq!(home(&mut bench, 37), COMPLETED);
    bench.device.reset(bench.now);
    bench.run(100);
    bench.enable(6);
    bench.run(20);
    assert_eq!(bits(&bench), WAITING);
}

#[test]
fn the_gate_takes_the_methods_that_the_drive_lists() {
    let mut bench = Bench::new(SERVO);
    let count = u8::try_from(bench.get_sub(0x60E3, 0)).unwrap();
    let listed: Vec<i64> = (1..=count).map(|sub| bench.get_sub(0x60E3, sub)).collect();
    for method in -128..=127 {
        let answer = bench.batch(&[(0x6098, 0, method)]);
        let expected =
            if method == 0 || listed.contains(&method) { Ok(()) } else { Err(AbortCode::InvalidValue) };
        assert_eq!(answer, expected, "{method}");
    }
    let mut jvl = Bench::new("jvl-mac00-fc4");
    for method in [1, 2, 35, 37, -5, 15, 31] {
        assert_eq!(jvl.batch(&[(0x6098, 0, method)]), Err(AbortCode::InvalidValue), "{method}");
    }
    for method in [3, 14, 17, 30, 33, 34, -1, -4] {
        jvl.set(0x6098, method);
    }
}

#[test]
fn a_plant_of_its_own_stands_where_it_was_put() {
    let profile = Arc::new(Profile::embedded(SERVO, None).unwrap().unwrap());
    let place = axis::Position(77.0);
    let mut device = Device::arranged(profile, 1, od::Instant::ZERO, |_, plant| plant.start = place);
    assert_eq!(device.plant(0, od::Instant::ZERO).unwrap().encoder(), place);
    assert!(device.plant(1, od::Instant::ZERO).is_none());
}

#[test]
fn a_jvl_drive_goes_from_completed_homing_to_positioning_while_enabled() {
    let mut bench = Machine::MIDDLE.enabled("jvl-mac00-fc4");
    bench.set(0x6060, 1);
    bench.run(20);
    assert_eq!(bench.get(0x6061), 6, "not before homing is completed");
    bench.set(0x6060, 6);
    assert_eq!(home(&mut bench, 23), COMPLETED);
    bench.set(0x6060, 3);
    bench.run(20);
    assert_eq!(bench.get(0x6061), 6, "not to another mode");
    bench.set(0x6060, 1);
    bench.run(20);
    assert_eq!((bench.get(0x6061), bench.state()), (1, State::OperationEnabled));
    bench.set(0x6060, 6);
    bench.run(20);
    assert_eq!(bench.get(0x6061), 1, "and not back");
}
