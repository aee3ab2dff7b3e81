//! FastMac and the command register.

use profiles::DeviceEvent;

use crate::bench::Bench;
use crate::motor::{TURN, reg, status};

/// The ways to a FastMac command: its object, its MAC number there, the motor's and the module's command register.
const WAYS: [fn(&mut Bench, u8); 4] = [
    |bench, number| bench.set(0x2013, i64::from(number)),
    |bench, number| bench.set(0x2013, i64::from(number | 0x80)),
    |bench, number| bench.set_reg(reg::COMMAND, i64::from(number)),
    |bench, number| module(bench, 0x8000_0000 | u32::from(number)),
];

/// Writes the command register of the module, module register 15, anew.
fn module(bench: &mut Bench, value: u32) {
    bench.command_module(0).unwrap();
    bench.command_module(value).unwrap();
}

/// Stores what the device wants, as the core does.
pub(crate) fn store(bench: &mut Bench) -> usize {
    let mut stored = 0;
    while let Some(event) = bench.device.poll_event() {
        let DeviceEvent::Store(order) = event else { continue };
        let saved = bench.device.to_store(order);
        assert_eq!(bench.device.dictionary_mut().set_saved(saved), 0);
        bench.device.stored(bench.now, true);
        stored += 1;
    }
    stored
}

#[test]
fn every_way_to_a_command_does_the_same() {
    for way in WAYS {
        let mut bench = Bench::mis();
        bench.set_regs(&[(reg::V_SOLL, 5), (reg::P_SOLL, 5), (reg::P_IST, 5)]);
        way(&mut bench, 0x65);
        assert_eq!(bench.reg(reg::V_SOLL), 0, "V_SOLL = 0");
        way(&mut bench, 0x62);
        assert_eq!(bench.reg(reg::P_SOLL), 0, "P_SOLL = 0");
        way(&mut bench, 0x63);
        assert_eq!(bench.reg(reg::P_IST), 0, "P_IST = 0");
        bench.set_regs(&[(reg::P1, 11), (reg::V1, 22), (reg::A1, 33), (reg::T1, 44)]);
        way(&mut bench, 0x6C);
        let active = [reg::P_SOLL, reg::V_SOLL, reg::A_SOLL, reg::RUN_CURRENT].map(|r| bench.reg(r));
        assert_eq!(active, [11, 22, 33, 44]);
        assert_eq!(bench.get(0x2204), 258, "44 x 5.87 mA");
    }
}

#[test]
fn the_four_groups_are_activated_each_by_its_command() {
    let mut bench = Bench::mis();
    for group in 0..4_u8 {
        let number = i64::from(group) + 1;
        bench.set_regs(&[
            (reg::P1 + 2 * group, 10 * number),
            (reg::V1 + group, 20 * number),
            (reg::A1 + group, 30 * number),
            (reg::T1 + group, 40 * number),
        ]);
    }
    for group in 0..4 {
        bench.set(0x2013, 0x6C + group);
        let active = [reg::P_SOLL, reg::V_SOLL, reg::A_SOLL, reg::RUN_CURRENT].map(|r| bench.reg(r));
        assert_eq!(active, [10, 20, 30, 40].map(|base| base * (group + 1)));
    }
}

#[test]
fn in_relative_mode_a_position_register_is_added_to_p_soll() {
    let mut bench = Bench::mis();
    bench.set_regs(&[(reg::P_SOLL, 1_000), (reg::P1, 50)]);
    bench.set(0x2013, 0x75);
    bench.set(0x2013, 0x6C);
    assert_eq!(bench.reg(reg::P_SOLL), 1_050);
    bench.set(0x2013, 0x74);
    bench.set(0x2013, 0x6C);
    assert_eq!(bench.reg(reg::P_SOLL), 50);
}

#[test]
fn p7_and_p8_move_by_a_distance() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::P7, 100_000), (reg::P8, -30_000), (reg::MODE_REG, 2)]);
    bench.run(5);
    for (command, place) in [(0x71, 100_000), (0x71, 200_000), (0x72, 170_000)] {
        bench.set_reg(reg::COMMAND, command);
        bench.run(2);
        assert_eq!(bench.reg(reg::P_SOLL), place);
        bench.run_until(|b| b.has(status::IN_POSITION));
        assert_eq!(bench.reg(reg::P_IST), place);
    }
}

#[test]
fn a_module_command_that_stays_in_its_register_is_executed_once() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::P7, 1_000), (reg::MODE_REG, 2)]);
    bench.run(5);
    for _ in 0..5 {
        bench.command_module(0x8000_0071).unwrap();
        bench.run(100);
    }
    assert_eq!(bench.reg(reg::P_IST), 1_000);
    module(&mut bench, 0x8000_0071);
    bench.run(100);
    assert_eq!(bench.reg(reg::P_IST), 2_000);
}

#[test]
fn p_new_becomes_or_is_added_to_both_positions() {
    let mut bench = Bench::mis();
    bench.set_regs(&[(reg::P_SOLL, 100), (reg::P_IST, 100), (reg::P_NEW, 5_000)]);
    bench.set(0x2013, 0x77);
    assert_eq!((bench.reg(reg::P_IST), bench.reg(reg::P_SOLL)), (5_000, 5_000));
    bench.set_regs(&[(reg::P_SOLL, 100), (reg::P_IST, 100)]);
    bench.set(0x2013, 0x78);
    assert_eq!((bench.reg(reg::P_IST), bench.reg(reg::P_SOLL)), (5_100, 5_100));
}

#[test]
fn p_new_moves_nothing_in_position_mode() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.go_to(10_000);
    bench.run(300);
    let place = bench.plant().motor_position();
    bench.set_reg(reg::P_NEW, 3 * TURN);
    bench.set(0x2013, 0x77);
    bench.run(300);
    assert!((bench.plant().motor_position() - place).0.abs() < 2.0);
    assert_eq!(bench.reg(reg::P_IST), 3 * TURN);
}

#[test]
fn flags_that_are_reset_come_back_with_the_next_motion() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.go_to(10_000);
    bench.set(0x2013, 0x67);
    bench.run(5);
    assert!(!bench.has(status::IN_POSITION));
    bench.set_reg(reg::P_SOLL, 20_000);
    bench.run(3);
    bench.run_until(|b| b.has(status::IN_POSITION));
}

#[test]
fn command_257_takes_p_ist_from_the_encoder() {
    let mut bench = Bench::mis();
    bench.set_reg(reg::ENCODER_POS, 1_234);
    bench.set_reg(reg::COMMAND, 257);
    bench.run(2);
    assert_eq!(
        (bench.reg(reg::P_IST), bench.reg(reg::ENCODER_POS), bench.reg(reg::FLWERR)),
        (1_234, 1_234, 0)
    );
}

#[test]
fn commands_read_back_as_zero_and_unknown_ones_do_nothing() {
    let mut bench = Bench::mis();
    bench.set_regs(&[(reg::V_SOLL, 5), (reg::P_SOLL, 5)]);
    for command in [0, 1, 95, 0x60, 0x64, 0x66, 0x73, 0x7F, 128, 0xE5, 255, 256, 259, 300, 321, 322, -1] {
        bench.set_reg(reg::COMMAND, command);
        bench.run(1);
        assert_eq!(bench.reg(reg::COMMAND), 0, "{command}");
        assert_eq!((bench.reg(reg::V_SOLL), bench.reg(reg::P_SOLL)), (5, 5), "{command}");
    }
}

#[test]
fn a_reset_gives_the_registers_their_power_on_values() {
    for way in [|b: &mut Bench| b.set_reg(reg::COMMAND, 267), |b: &mut Bench| module(b, 0x8000_010B)] {
        let mut bench = Bench::mis();
        bench.fast();
        bench.set_reg(reg::MODE_REG, 1);
        bench.run(500);
        way(&mut bench);
        bench.run(100);
        let registers = [reg::MODE_REG, reg::V_SOLL, reg::RUN_CURRENT, reg::V_IST].map(|r| bench.reg(r));
        assert_eq!(registers, [0, 10_000, 511, 0]);
        assert_eq!(bench.get(0x2204), 3000);
        assert!(bench.reg(reg::TICKS) < 200);
    }
}

#[test]
fn saved_registers_are_there_after_a_reset_and_the_start_mode_too() {
    for way in [|b: &mut Bench| b.set_reg(reg::COMMAND, 268), |b: &mut Bench| module(b, 0x8000_010C)] {
        let mut bench = Bench::mis();
        bench.set_regs(&[(reg::V_SOLL, 12_345), (reg::STARTMODE, 1), (reg::RUN_CURRENT, 1_000)]);
        way(&mut bench);
        assert_eq!(store(&mut bench), 1);
        bench.run(500);
        let registers = [reg::MODE_REG, reg::V_SOLL, reg::RUN_CURRENT].map(|r| bench.reg(r));
        assert_eq!(registers, [1, 12_345, 1_000]);
        assert!((bench.reg(reg::V_IST) - 12_345).abs() < 10);
        assert_eq!(bench.get(0x2204), 5870);
    }
}

#[test]
fn command_269_saves_and_the_motor_runs_on() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::V_SOLL, 12_345), (reg::MODE_REG, 1)]);
    bench.run(300);
    bench.set_reg(reg::COMMAND, 269);
    assert_eq!(store(&mut bench), 1);
    bench.run(300);
    assert!((bench.reg(reg::V_IST) - 12_345).abs() < 10);
    bench.set_reg(reg::V_SOLL, 0);
    bench.set_reg(reg::COMMAND, 267);
    bench.run(100);
    assert_eq!((bench.reg(reg::MODE_REG), bench.reg(reg::V_SOLL)), (0, 12_345));
}
