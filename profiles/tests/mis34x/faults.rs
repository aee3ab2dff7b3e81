//! ERR_BITS and WARN_BITS: what the motor watches, how it reacts, how errors are cleared.

use axis::{DriveFault, Load, PlantFault, Position, Voltage};
use profiles::{DeviceEvent, State};

use crate::bench::Bench;
use crate::motor::{error, reg, status};

#[test]
fn a_blocked_shaft_is_a_follow_error_by_the_encoder() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::FLWERRMAX, 10_000), (reg::V_SOLL, 20_000), (reg::MODE_REG, 1)]);
    bench.run(300);
    bench.block_shaft();
    bench.run_until(|b| b.reg(reg::ERR_BITS) != 0);
    assert_eq!(bench.reg(reg::ERR_BITS), error::GENERAL | error::FOLLOW);
    assert!(bench.reg(reg::FLWERR) < -9_000);
    bench.run(500);
    assert_eq!((bench.reg(reg::MODE_REG), bench.reg(reg::V_IST)), (0, 0), "passive");
    assert_eq!((bench.state(), bench.get(0x603F)), (State::Fault, 0x1001));
    let codes: Vec<_> = bench.events();
    assert!(matches!(codes.as_slice(), [DeviceEvent::Raised(fault)] if fault.code == 0x1001), "{codes:?}");
}

#[test]
fn without_flwerrmax_a_stall_goes_unnoticed_but_flwerr_tells() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::V_SOLL, 20_000), (reg::MODE_REG, 1)]);
    bench.run(300);
    bench.block_shaft();
    bench.run(500);
    assert_eq!(bench.reg(reg::ERR_BITS), 0);
    assert!(bench.reg(reg::FLWERR) < -100_000);
}

#[test]
fn an_error_brakes_with_acc_emerg_and_then_the_motor_is_passive() {
    let mut bench = Bench::mis();
    bench.fast();
    // 1000 RPM in half a second.
    bench.set_regs(&[(reg::ACC_EMERG, 2_000), (reg::MODE_REG, 1)]);
    bench.run(300);
    bench.set_regs(&[(reg::FLWERRMAX, 1), (reg::ENCODER_POS, 0)]);
    bench.run(252);
    let half = bench.reg(reg::V_IST);
    assert!((half - 50_000).abs() < 1_000, "{half}");
    bench.run(300);
    assert_eq!(bench.reg(reg::V_IST), 0);
}

#[test]
fn errors_are_cleared_by_fastmac_61_and_by_writing_zero() {
    for clear in [|b: &mut Bench| b.set(0x2013, 0x61), |b: &mut Bench| b.set_reg(reg::ERR_BITS, 0)] {
        let mut bench = Bench::mis();
        bench.fast();
        bench.set_regs(&[(reg::FLWERRMAX, 5_000), (reg::ENCODER_POS, 50_000), (reg::MODE_REG, 2)]);
        bench.run(100);
        assert_eq!(bench.reg(reg::ERR_BITS), error::GENERAL | error::FOLLOW);
        bench.set_reg(reg::MODE_REG, 2);
        bench.run(10);
        assert_eq!(bench.reg(reg::MODE_REG), 0, "no power while there is an error");
        bench.set_reg(reg::ENCODER_POS, 0);
        bench.events();
        clear(&mut bench);
        bench.run(10);
        assert_eq!(bench.reg(reg::ERR_BITS), 0);
        assert_eq!(bench.events(), [DeviceEvent::Cleared(0x1001)]);
        bench.go_to(1_000);
    }
}

#[test]
fn a_cause_that_lasts_is_an_error_again() {
    let mut bench = Bench::mis();
    bench.plant().inject(PlantFault::DriveFault(DriveFault::OverCurrent));
    bench.set_reg(reg::MODE_REG, 2);
    bench.run(50);
    assert_eq!(bench.reg(reg::ERR_BITS), error::GENERAL | 1 << 2, "output driver");
    bench.set(0x2013, 0x61);
    bench.run(10);
    assert_eq!(bench.reg(reg::ERR_BITS), error::GENERAL | 1 << 2);
    bench.plant().clear(PlantFault::DriveFault(DriveFault::OverCurrent));
    bench.set(0x2013, 0x61);
    bench.run(10);
    assert_eq!(bench.reg(reg::ERR_BITS), 0);
}

#[test]
fn every_fault_of_the_drive_has_its_bit() {
    let faults = [
        (DriveFault::OverCurrent, 1 << 2),
        (DriveFault::Overload, 1 << 2),
        (DriveFault::UnderVoltage, error::LOW_VOLTAGE),
        (DriveFault::OverVoltage, error::OVER_VOLTAGE),
        (DriveFault::OverTemperature, error::TEMPERATURE),
        (DriveFault::Internal, 1 << 7),
        (DriveFault::SafeTorqueOff, 1 << 7),
        (DriveFault::Encoder, error::ENCODER),
    ];
    for (fault, bit) in faults {
        let mut bench = Bench::mis();
        bench.set_reg(reg::MODE_REG, 2);
        bench.run(20);
        bench.plant().inject(PlantFault::DriveFault(fault));
        bench.run(20);
        assert_eq!(bench.reg(reg::ERR_BITS), error::GENERAL | bit, "{fault:?}");
        assert_eq!(bench.has(1 << 9), fault == DriveFault::Encoder, "magnetic encoder error");
    }
}

#[test]
fn min_busvol_is_the_under_voltage_trip_point() {
    let mut bench = Bench::mis();
    bench.set_reg(reg::MODE_REG, 2);
    bench.run(20);
    // 36.6 V.
    bench.set_reg(reg::MIN_BUSVOL, 1_380);
    bench.run(20);
    assert_eq!((bench.reg(reg::ERR_BITS), bench.reg(reg::WARN_BITS)), (0, 0));
    bench.plant().inject(PlantFault::SupplyDip(Voltage(40.0)));
    bench.run(1_000);
    assert_eq!((bench.reg(reg::ERR_BITS), bench.reg(reg::WARN_BITS)), (0, 1 << 4), "nearly");
    bench.plant().inject(PlantFault::SupplyDip(Voltage(35.0)));
    bench.run(1_000);
    assert_eq!(bench.reg(reg::ERR_BITS), error::GENERAL | error::LOW_VOLTAGE);
}

#[test]
fn a_position_limit_ends_a_motion_and_is_an_error() {
    for (no_error, errors, mode) in [(0, error::GENERAL | error::POSITION_LIMIT, 0), (1 << 17, 0, 1)] {
        let mut bench = Bench::mis();
        bench.fast();
        bench.set_regs(&[(reg::MAX_P_IST, 300_000), (reg::SETUP_BITS, no_error), (reg::MODE_REG, 1)]);
        let mut highest = 0;
        for _ in 0..1_000 {
            bench.run(1);
            highest = highest.max(bench.reg(reg::P_IST));
        }
        assert_eq!(highest, 300_000);
        assert_eq!((bench.reg(reg::ERR_BITS), bench.reg(reg::MODE_REG)), (errors, mode));
    }
}

#[test]
fn a_limit_switch_ends_a_motion_and_is_an_error_and_a_warning() {
    for (no_error, errors) in [(0, error::GENERAL | error::POSITION_LIMIT), (1 << 17, 0)] {
        let mut bench = Bench::mis_with(|plant| plant.positive_switch = Some(Position(100_000.0)));
        bench.fast();
        bench.set_regs(&[(reg::PL_MASK, 1), (reg::ACC_EMERG, 100_000), (reg::SETUP_BITS, no_error)]);
        bench.set_reg(reg::MODE_REG, 1);
        bench.run(1_000);
        let place = bench.reg(reg::P_IST);
        assert!((100_000..150_000).contains(&place), "{place}");
        assert_eq!(bench.reg(reg::ERR_BITS), errors);
        assert_eq!(bench.reg(reg::WARN_BITS), 0b0101, "active, and has been");
        bench.set(0x2013, 0x61);
        bench.run(5);
        bench.set_regs(&[(reg::V_SOLL, -100_000), (reg::MODE_REG, 1)]);
        bench.run(300);
        assert_eq!(bench.reg(reg::WARN_BITS), 0b0100, "it has been");
        assert!(bench.reg(reg::P_IST) < 100_000, "the way back is free");
        bench.set_reg(reg::WARN_BITS, 0);
        bench.run(5);
        assert_eq!(bench.reg(reg::WARN_BITS), 0);
    }
}

#[test]
fn auto_correction_makes_up_for_lost_steps() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::IN_POSITION_COUNT, 3), (reg::IN_POSITION_WINDOW, 500)]);
    bench.set_regs(&[(reg::P_SOLL, 500_000), (reg::MODE_REG, 2)]);
    bench.run(60);
    bench.block_shaft();
    bench.run(60);
    bench.free_shaft();
    bench.run_until(|b| b.has(status::AUTO_CORRECTION));
    bench.run_until(|b| {
        b.has(status::PHYSICAL_POSITION | status::IN_POSITION) && !b.has(status::AUTO_CORRECTION)
    });
    bench.run(500);
    let place = bench.plant().motor_position().0;
    assert!((place - 500_000.0).abs() < 600.0, "{place}");
}

#[test]
fn auto_correction_gives_up_after_its_attempts_and_is_off_by_default() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.go_to(1_000);
    bench.run(300);
    bench.block_shaft();
    bench.set_reg(reg::P_SOLL, 50_000);
    bench.run(1_000);
    assert!(!bench.has(status::AUTO_CORRECTION) && bench.has(status::IN_POSITION));
    bench.set_regs(&[(reg::IN_POSITION_COUNT, 2), (reg::P_SOLL, 60_000)]);
    bench.run(3_000);
    assert!(!bench.has(status::AUTO_CORRECTION) && !bench.has(status::PHYSICAL_POSITION));
    let attempt = bench.reg(reg::FLWERR);
    assert!(attempt < -50_000, "the last attempt left it: {attempt}");
}

#[test]
fn setup_bit_6_makes_in_position_physical() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_reg(reg::SETUP_BITS, 1 << 6);
    bench.go_to(1_000);
    bench.run(300);
    bench.plant().set_load(Load { inertia_kgm2: 1.4e-4, gravity_nm: -0.3, ..Load::default() });
    bench.run(500);
    assert!(!bench.has(status::IN_POSITION) && !bench.has(status::PHYSICAL_POSITION));
}
