//! MODE_REG 0, 1, 2 and 3, and what shapes a motion.

use axis::{Load, Velocity};
use profiles::Profile;

use crate::bench::Bench;
use crate::motor::{TURN, reg, status};

#[test]
fn a_motor_is_passive_after_power_on_unless_startmode_says_otherwise() {
    let mut bench = Bench::mis();
    assert_eq!((bench.reg(reg::MODE_REG), bench.reg(reg::V_IST)), (0, 0));
    bench.set_regs(&[(reg::STARTMODE, 1), (reg::V_SOLL, 10_000)]);
    bench.run(1_000);
    assert_eq!(bench.reg(reg::V_IST), 0, "not before the next power-on");
}

#[test]
fn velocity_mode_turns_at_v_soll_in_hundredths_of_rpm() {
    let mut bench = Bench::mis();
    bench.set_regs(&[(reg::V_SOLL, 60_000), (reg::A_SOLL, 6_000), (reg::MODE_REG, 1)]);
    bench.run(50);
    assert!(bench.has(status::ACCELERATING) && !bench.has(status::AT_VELOCITY));
    bench.run(450);
    let (velocity, place) = (bench.reg(reg::V_IST), bench.reg(reg::P_IST));
    assert!((velocity - 60_000).abs() <= 10, "600 RPM: {velocity}");
    assert!(bench.has(status::AT_VELOCITY) && !bench.has(status::ACCELERATING));
    bench.run(1_000);
    assert!((bench.reg(reg::P_IST) - place - 10 * TURN).abs() < 10);
    bench.set_reg(reg::V_SOLL, -60_000);
    bench.run(20);
    assert!(bench.has(status::DECELERATING));
    bench.run(400);
    assert!((bench.reg(reg::V_IST) + 60_000).abs() <= 10);
}

#[test]
fn the_ramp_is_a_soll() {
    let mut bench = Bench::mis();
    bench.set_regs(&[(reg::V_SOLL, 100_000), (reg::A_SOLL, 2_000), (reg::MODE_REG, 1)]);
    bench.run(5);
    let before = bench.reg(reg::V_IST);
    bench.run(100);
    let gain = bench.reg(reg::V_IST) - before;
    assert!((gain - 20_000).abs() < 300, "200 RPM in 0.1 s: {gain}");
}

#[test]
fn a_change_of_a_soll_waits_until_the_motor_stops_or_turns_round() {
    let mut bench = Bench::mis();
    bench.set_regs(&[(reg::V_SOLL, 100_000), (reg::A_SOLL, 2_000), (reg::MODE_REG, 1)]);
    bench.run(100);
    bench.set_reg(reg::A_SOLL, 50_000);
    let before = bench.reg(reg::V_IST);
    bench.run(100);
    let gain = bench.reg(reg::V_IST) - before;
    assert!((gain - 20_000).abs() < 300, "as before: {gain}");
    bench.set_reg(reg::V_SOLL, -100_000);
    bench.until(reg::V_IST, |v| v < 0);
    bench.run(2);
    let before = bench.reg(reg::V_IST);
    bench.run(5);
    let gain = before - bench.reg(reg::V_IST);
    assert!(gain > 20_000, "250 RPM in 5 ms: {gain}");
}

#[test]
fn a_motion_starts_and_stops_with_v_start() {
    let mut bench = Bench::mis();
    bench.set_regs(&[
        (reg::V_START, 5_000),
        (reg::V_SOLL, 5_000),
        (reg::A_SOLL, 1),
        (reg::RUN_CURRENT, 1533),
    ]);
    bench.run(2);
    bench.set_reg(reg::MODE_REG, 1);
    bench.run(5);
    assert!((bench.reg(reg::V_IST) - 5_000).abs() <= 10, "{}", bench.reg(reg::V_IST));
}

#[test]
fn position_mode_goes_to_p_soll_and_holds_it() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::P_SOLL, 1_000_001), (reg::MODE_REG, 2)]);
    bench.run(20);
    assert!(bench.has(status::ACCELERATING) && !bench.has(status::IN_POSITION));
    bench.run_until(|b| b.has(status::IN_POSITION));
    assert_eq!(bench.reg(reg::P_IST), 1_000_001);
    bench.run(500);
    assert!(bench.has(status::PHYSICAL_POSITION));
    assert!((bench.reg(reg::ENCODER_POS) - 1_000_001).abs() < 100);
    bench.go_to(-5);
    assert_eq!(bench.reg(reg::P_IST), -5);
}

#[test]
fn a_target_on_the_fly_is_taken_at_once() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::P_SOLL, 4_000_000), (reg::MODE_REG, 2)]);
    bench.run(200);
    bench.set_reg(reg::P_SOLL, -1_000);
    bench.run_until(|b| b.has(status::IN_POSITION));
    assert_eq!(bench.reg(reg::P_IST), -1_000);
}

#[test]
fn a_slower_v_soll_is_obeyed_in_a_move() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::P_SOLL, 40_000_000), (reg::MODE_REG, 2)]);
    bench.run(300);
    assert!((bench.reg(reg::V_IST) - 100_000).abs() < 50);
    bench.set_reg(reg::V_SOLL, 20_000);
    bench.run(300);
    assert!((bench.reg(reg::V_IST) - 20_000).abs() < 50);
}

#[test]
fn mode_zero_takes_the_power_away() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_reg(reg::MODE_REG, 1);
    bench.run(500);
    bench.set_reg(reg::MODE_REG, 0);
    bench.run(100);
    assert_eq!((bench.reg(reg::MODE_REG), bench.reg(reg::V_IST)), (0, 0));
    bench.plant().set_load(Load { gravity_nm: 0.5, ..Load::default() });
    let place = bench.reg(reg::ENCODER_POS);
    bench.run(300);
    assert!(bench.reg(reg::ENCODER_POS) > place + 1_000, "the shaft is free");
}

#[test]
fn a_mode_that_a_stepper_does_not_have_changes_nothing() {
    let mut bench = Bench::mis();
    bench.set_reg(reg::MODE_REG, 2);
    bench.run(10);
    for mode in [4, 12, 15, 25, 256, -1] {
        bench.set_reg(reg::MODE_REG, mode);
        bench.run(2);
        assert_eq!(bench.reg(reg::MODE_REG), 2, "{mode}");
    }
}

#[test]
fn gear_mode_follows_the_external_encoder_by_the_ratio() {
    let mut bench = Bench::mis();
    bench.fast();
    // Quadrature; 1600 steps for 2000 counts.
    bench.set_regs(&[(reg::SETUP_BITS, 1 << 2), (reg::GEAR1, 1600), (reg::GEAR2, 2000), (reg::MODE_REG, 3)]);
    bench.run(10);
    let now = bench.now;
    bench.device.set_external_encoder(0, Velocity(500_000.0), now);
    bench.run(2_000);
    assert_eq!(bench.reg(reg::EXT_ENCODER_VEL), 8_000, "counts in 16 ms");
    bench.device.set_external_encoder(0, Velocity(0.0), bench.now);
    bench.run(500);
    let (external, place) = (bench.reg(reg::EXT_ENCODER), bench.reg(reg::P_IST));
    assert!((external - 1_000_000).abs() <= 1_000, "{external}");
    assert!((place - external * 4 / 5).abs() <= 2, "{place}");
    bench.set_reg(reg::EXT_ENCODER, 77);
    bench.run(2);
    assert_eq!(bench.reg(reg::EXT_ENCODER), 77);
}

#[test]
fn without_an_encoder_input_there_is_nothing_to_follow() {
    let mut bench = Bench::mis();
    bench.set_reg(reg::MODE_REG, 3);
    bench.run(10);
    bench.device.set_external_encoder(0, Velocity(500_000.0), bench.now);
    bench.run(200);
    assert_eq!((bench.reg(reg::EXT_ENCODER), bench.reg(reg::P_IST)), (0, 0));
}

#[test]
fn a_gear_ratio_without_divider_is_none() {
    let mut bench = Bench::mis();
    bench.set_regs(&[(reg::SETUP_BITS, 1 << 3), (reg::GEAR2, 0), (reg::MODE_REG, 3)]);
    bench.run(10);
    bench.device.set_external_encoder(0, Velocity(500_000.0), bench.now);
    bench.run(200);
    assert_eq!(bench.reg(reg::P_IST), 0);
}

#[test]
fn a_turn_table_goes_the_way_that_turntab_mode_says() {
    const SIZE: i64 = 100_000;
    // Mode, from, to, way.
    let ways = [
        (1, 90_000, 10_000, 20_000),
        (1, 10_000, 90_000, 80_000),
        (2, 10_000, 90_000, -20_000),
        (2, 90_000, 10_000, -80_000),
        (3, 90_000, 10_000, 20_000),
        (3, 10_000, 90_000, -20_000),
        (3, 10_000, 50_000, 40_000),
    ];
    for (mode, from, to, way) in ways {
        let mut bench = Bench::mis();
        bench.fast();
        bench.set_regs(&[(reg::TURNTAB_MODE, mode), (reg::TURNTAB_SIZE, SIZE)]);
        bench.go_to(from);
        let before = bench.plant().motor_position().0;
        bench.go_to(to);
        bench.run(300);
        let done = bench.plant().motor_position().0 - before;
        assert!((done - f64::from(way)).abs() < 300.0, "mode {mode} from {from} to {to}: {done}");
        assert_eq!(bench.reg(reg::P_IST), to);
    }
}

#[test]
fn a_turn_table_counts_within_its_size() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::TURNTAB_MODE, 3), (reg::TURNTAB_SIZE, 100_000), (reg::MODE_REG, 1)]);
    for _ in 0..500 {
        bench.run(3);
        let place = bench.reg(reg::P_IST);
        assert!((0..100_000).contains(&place), "{place}");
    }
}

#[test]
fn setup_bit_0_turns_the_motor_round_in_both_vocabularies() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_reg(reg::SETUP_BITS, 1);
    bench.go_to(100_000);
    bench.run(300);
    assert!((bench.plant().motor_position().0 + 100_000.0).abs() < 100.0);
    assert!((bench.reg(reg::ENCODER_POS) - 100_000).abs() < 100);
    assert!((bench.position() - 100_000).abs() < 100, "0x6064: {}", bench.position());
    bench.set_regs(&[(reg::V_SOLL, 30_000), (reg::MODE_REG, 1)]);
    bench.run(300);
    assert!((bench.reg(reg::V_IST) - 30_000).abs() < 20);
    assert!(bench.plant().motor_velocity().0 < 0.0);
}

#[test]
fn standby_current_holds_less() {
    // 3 Nm at 9 A: 1 A holds 0.33 Nm, 9 A all of it.
    for (load, slips) in [(-0.25, false), (-0.6, true)] {
        let mut bench = Bench::mis();
        bench.set_regs(&[
            (reg::RUN_CURRENT, 1533),
            (reg::STANDBY_CURRENT, 170),
            (reg::STANDBY_TIME, 300),
            (reg::MODE_REG, 2),
        ]);
        bench.run(20);
        bench.plant().set_load(Load { inertia_kgm2: 1.4e-4, gravity_nm: load, ..Load::default() });
        bench.run(250);
        assert!(bench.reg(reg::FLWERR).abs() < 2_000, "before STANDBY_TIME: {}", bench.reg(reg::FLWERR));
        bench.run(1_000);
        assert_eq!(bench.reg(reg::FLWERR) < -4_000, slips, "{}", bench.reg(reg::FLWERR));
    }
}

#[test]
fn run_current_is_the_torque() {
    // 0.5 Nm need 1.5 A.
    for (current, slips) in [(511, false), (200, true)] {
        let mut bench = Bench::mis();
        bench.set_regs(&[(reg::RUN_CURRENT, current), (reg::STANDBY_CURRENT, 1533), (reg::MODE_REG, 2)]);
        bench.run(20);
        bench.plant().set_load(Load { inertia_kgm2: 1.4e-4, gravity_nm: -0.5, ..Load::default() });
        bench.run(1_000);
        assert_eq!(bench.reg(reg::FLWERR) < -4_000, slips, "{current}: {}", bench.reg(reg::FLWERR));
    }
}

#[test]
fn every_motor_reaches_3000_rpm_without_losing_a_step() {
    for motor in ["mis340", "mis341", "mis342"] {
        let profile = Profile::embedded("jvl-mis34x", Some(motor)).unwrap().unwrap();
        let mut bench = Bench::of(profile);
        bench.run(10);
        bench.set_regs(&[
            (reg::V_SOLL, 300_000),
            (reg::A_SOLL, 3_000),
            (reg::RUN_CURRENT, 1533),
            (reg::MODE_REG, 1),
        ]);
        bench.run(1_500);
        assert!((bench.reg(reg::V_IST) - 300_000).abs() < 100, "{motor}: {}", bench.reg(reg::V_IST));
        assert!(bench.reg(reg::FLWERR).abs() < 2_048, "{motor}: {}", bench.reg(reg::FLWERR));
        bench.set_reg(reg::V_SOLL, 0);
        bench.run(2_000);
        assert_eq!(bench.reg(reg::V_IST), 0);
        assert!(bench.reg(reg::FLWERR).abs() < 200, "{motor}: {}", bench.reg(reg::FLWERR));
    }
}
