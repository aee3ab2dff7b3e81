//! One axis, two vocabularies: registers and CiA 402.

use axis::Position;
use od::AbortCode;
use profiles::State;

use crate::bench::Bench;
use crate::motor::{reg, status};

#[test]
fn while_cia_402_operates_what_moves_by_registers_is_refused() {
    let mut bench = Bench::mis();
    bench.enable(1);
    let refused = [(2, 1), (2, 0), (24, 0x70), (24, 267), (24, 268)];
    for (number, value) in refused {
        let result = bench.batch(&[(0x2012, number, value)]);
        assert_eq!(result, Err(AbortCode::DeviceState), "register {number} = {value}");
    }
    assert_eq!(bench.batch(&[(0x2013, 0, 0x70)]), Err(AbortCode::DeviceState));
    assert_eq!(bench.command_module(0x8000_0070), Err(AbortCode::DeviceState));
    for (number, value) in [(3, 5_000), (5, 100), (24, 0x6C), (24, 0x62)] {
        bench.batch(&[(0x2012, number, value)]).unwrap();
    }
    bench.run(100);
    assert_eq!((bench.state(), bench.velocity()), (State::OperationEnabled, 0));
    assert_eq!(bench.reg(reg::MODE_REG), 2, "shown while profile position operates");
}

#[test]
fn enabling_cia_402_takes_the_axis_over_with_power() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_reg(reg::MODE_REG, 1);
    bench.run(300);
    bench.batch(&[(0x6083, 0, 4_000_000), (0x6085, 0, 4_000_000)]).unwrap();
    bench.set(0x6060, 3);
    for word in [0x06, 0x07] {
        bench.control(word);
        bench.run(5);
        assert!((bench.reg(reg::V_IST) - 100_000).abs() < 50, "the registers run it until then");
    }
    bench.control(0x0F);
    bench.run_until(|b| b.state() == State::OperationEnabled);
    bench.run(3_000);
    assert_eq!((bench.reg(reg::MODE_REG), bench.velocity()), (1, 0));
    bench.set(0x60FF, 409_600);
    bench.run(500);
    assert!((bench.reg(reg::V_IST) - 6_000).abs() < 10, "60 RPM: {}", bench.reg(reg::V_IST));
    bench.control(0x00);
    bench.run(500);
    assert_eq!(bench.reg(reg::MODE_REG), 0);
    bench.go_to(bench.reg(reg::P_IST) + 1_000);
}

#[test]
fn pp_and_pv_move_a_stepper_by_objects() {
    let mut bench = Bench::mis();
    bench.set_reg(reg::RUN_CURRENT, 1533);
    bench.batch(&[(0x6081, 0, 2_000_000), (0x6083, 0, 20_000_000)]).unwrap();
    bench.enable(1);
    bench.move_to(300_001, 0);
    bench.run_until(|b| b.is_set(10));
    bench.run(300);
    assert_eq!(bench.reg(reg::P_IST), 300_001);
    assert!((bench.position() - 300_001).abs() < 100);
}

#[test]
fn object_2204_bounds_the_torque_of_cia_402_too() {
    // 0.5 Nm need 1.5 A.
    for (milliamperes, slips) in [(3000, false), (1000, true)] {
        let mut bench = Bench::mis();
        bench.set(0x2204, milliamperes);
        bench.set_reg(reg::STANDBY_CURRENT, 1533);
        bench.enable(1);
        bench.plant().set_load(axis::Load {
            inertia_kgm2: 1.4e-4,
            gravity_nm: -0.5,
            ..axis::Load::default()
        });
        bench.run(1_000);
        assert_eq!(bench.reg(reg::FLWERR) < -4_000, slips, "{milliamperes} mA");
    }
}

#[test]
fn object_6073_bounds_it_in_per_mille_of_6075() {
    for (per_mille, slips) in [(1000, false), (100, true), (0, false)] {
        let mut bench = Bench::mis();
        bench.set_reg(reg::STANDBY_CURRENT, 1533);
        bench.batch(&[(0x6073, 0, per_mille), (0x6075, 0, 9000)]).unwrap();
        bench.enable(1);
        bench.plant().set_load(axis::Load {
            inertia_kgm2: 1.4e-4,
            gravity_nm: -0.5,
            ..axis::Load::default()
        });
        bench.run(1_000);
        assert_eq!(bench.reg(reg::FLWERR) < -4_000, slips, "{per_mille}");
    }
}

#[test]
fn the_registers_180_to_194_are_the_objects() {
    let mut bench = Bench::mis();
    bench.set_reg(reg::RUN_CURRENT, 1533);
    bench.batch(&[(0x6081, 0, 2_000_000), (0x6083, 0, 20_000_000)]).unwrap();
    bench.set_reg(reg::MODE_OF_OPERATION, 1);
    for word in [0x06, 0x07, 0x0F] {
        bench.set_reg(reg::CONTROL_WORD, word);
        bench.run(5);
    }
    assert_eq!((bench.state(), bench.get(0x6040)), (State::OperationEnabled, 0x0F));
    assert_eq!(bench.reg(reg::STATUS_WORD), bench.statusword());
    assert_eq!(bench.reg(reg::MODE_DISPLAY), 1);
    bench.set_regs(&[(reg::TARGET_POSITION, -200_000), (reg::CONTROL_WORD, 0x1F)]);
    assert_eq!(bench.get(0x607A), -200_000);
    bench.run_until(|b| b.is_set(10));
    bench.run(300);
    assert_eq!(bench.reg(reg::ACTUAL_POSITION), bench.position());
    assert!((bench.position() + 200_000).abs() < 100);
    bench.set_regs(&[(reg::CONTROL_WORD, 0x06), (reg::MODE_OF_OPERATION, 3)]);
    bench.run(200);
    for word in [0x07, 0x0F] {
        bench.set_reg(reg::CONTROL_WORD, word);
        bench.run(5);
    }
    bench.set_reg(reg::TARGET_VELOCITY, 100_000);
    bench.run(300);
    assert_eq!((bench.get(0x60FF), bench.reg(reg::MODE_DISPLAY)), (100_000, 3));
    assert!((bench.reg(reg::ACTUAL_VELOCITY) - 100_000).abs() < 1_000);
    bench.set_reg(reg::MODE_OF_OPERATION, 8);
    bench.run(5);
    assert_eq!(
        (bench.get(0x6060), bench.reg(reg::MODE_OF_OPERATION)),
        (3, 3),
        "a mode that it does not have"
    );
    bench.set_reg(reg::DIGITAL_OUTPUTS, 0x15);
    bench.run(5);
    assert_eq!(bench.get_sub(0x60FE, 1), 0x15);
}

#[test]
fn a_fault_of_the_registers_is_reset_by_the_controlword_too() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::FLWERRMAX, 100), (reg::ENCODER_POS, 5_000), (reg::MODE_REG, 2)]);
    bench.run(100);
    assert_eq!(bench.state(), State::Fault);
    bench.set_reg(reg::FLWERRMAX, 0);
    bench.control(0x80);
    bench.run(5);
    assert_eq!((bench.state(), bench.reg(reg::ERR_BITS)), (State::SwitchOnDisabled, 0));
}

#[test]
fn flwerrmax_is_watched_while_cia_402_operates() {
    let mut bench = Bench::mis();
    bench.set_reg(reg::FLWERRMAX, 5_000);
    bench.enable(1);
    bench.block_shaft();
    bench.batch(&[(0x6081, 0, 200_000), (0x6083, 0, 2_000_000)]).unwrap();
    bench.move_to(300_000, 0);
    bench.run_until(|b| b.state() == State::Fault);
    assert_eq!(bench.reg(reg::ERR_BITS), 0b11);
}

#[test]
fn a_lost_master_stops_the_registers_as_6007_says() {
    // No action, disable voltage, quick stop.
    for (option, mode, moves) in [(0, 1, true), (2, 0, false), (3, 0, false)] {
        let mut bench = Bench::mis();
        bench.fast();
        bench.set(0x6007, option);
        bench.set_reg(reg::MODE_REG, 1);
        bench.run(300);
        bench.device.connection_lost(bench.now);
        bench.run(2_000);
        assert_eq!((bench.reg(reg::MODE_REG), bench.reg(reg::V_IST) != 0), (mode, moves), "{option}");
    }
}

#[test]
fn a_fault_that_only_cia_402_has_is_a_general_error() {
    let mut bench = Bench::mis();
    bench.set(0x6007, 1);
    bench.enable(3);
    bench.device.connection_lost(bench.now);
    bench.run(100);
    assert_eq!((bench.state(), bench.reg(reg::ERR_BITS)), (State::Fault, 1));
}

#[test]
fn a_device_that_leaves_ramps_down_first() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_reg(reg::MODE_REG, 1);
    bench.run(300);
    bench.device.shut_down(bench.now);
    bench.run(20);
    let velocity = bench.reg(reg::V_IST);
    assert!(velocity > 50_000 && velocity < 100_000, "by the ramp: {velocity}");
    bench.run(1_000);
    assert!(bench.device.is_quiet());
    bench.set_reg(reg::MODE_REG, 1);
    bench.run(100);
    assert_eq!(bench.reg(reg::V_IST), 0, "nothing is obeyed any more");
}

#[test]
fn the_drive_of_cia_402_meets_limit_switches_that_the_masks_name() {
    let mut bench = Bench::mis_with(|plant| plant.positive_switch = Some(Position(100_000.0)));
    bench.set_reg(reg::PL_MASK, 1);
    bench.batch(&[(0x6083, 0, 4_000_000), (0x6085, 0, 4_000_000)]).unwrap();
    bench.enable(3);
    bench.set(0x60FF, 200_000);
    bench.run_until(|b| b.state() == State::Fault);
    assert_eq!(bench.get(0x603F), 0x1002);
    assert_eq!(bench.reg(reg::ERR_BITS), 0b1001);
    assert!(!bench.has(status::IN_POSITION));
}
