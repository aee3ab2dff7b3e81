//! What the registers count and in which units.

use axis::{PlantFault, Voltage};

use crate::bench::Bench;
use crate::motor::{TURN, reg};

#[test]
fn register_7_is_object_2204_in_5_87_ma() {
    let mut bench = Bench::mis();
    assert_eq!((bench.reg(reg::RUN_CURRENT), bench.get(0x2204)), (511, 3000), "3.0 A after power-on");
    for (register, milliamperes) in [(170, 998), (1533, 8999), (0, 0), (511, 3000)] {
        bench.set_reg(reg::RUN_CURRENT, register);
        assert_eq!(bench.get(0x2204), milliamperes, "{register}");
    }
    for (milliamperes, register) in [(1000, 170), (9000, 1533), (3000, 511)] {
        bench.set(0x2204, milliamperes);
        assert_eq!(bench.reg(reg::RUN_CURRENT), register, "{milliamperes} mA");
    }
}

#[test]
fn the_position_limits_are_object_607d() {
    let mut bench = Bench::mis();
    bench.set_regs(&[(reg::MIN_P_IST, -5_000), (reg::MAX_P_IST, 7_000)]);
    assert_eq!((bench.get_sub(0x607D, 1), bench.get_sub(0x607D, 2)), (-5_000, 7_000));
    bench.batch(&[(0x607D, 1, -1), (0x607D, 2, 2)]).unwrap();
    assert_eq!((bench.reg(reg::MIN_P_IST), bench.reg(reg::MAX_P_IST)), (-1, 2));
}

#[test]
fn the_bus_voltage_counts_26_525_mv() {
    let mut bench = Bench::mis();
    bench.run(20);
    assert!((bench.reg(reg::BUSVOL) - 1810).abs() <= 2, "48 V: {}", bench.reg(reg::BUSVOL));
    bench.plant().inject(PlantFault::SupplyDip(Voltage(30.0)));
    bench.run_until(|b| (b.reg(reg::BUSVOL) - 1131).abs() <= 2);
}

#[test]
fn the_temperature_counts_2_27_degrees() {
    let bench = Bench::mis();
    assert_eq!(bench.reg(reg::TEMP), 11, "25 degrees");
}

#[test]
fn ticks_are_milliseconds_also_while_nothing_moves() {
    let mut bench = Bench::mis();
    let before = bench.reg(reg::TICKS);
    bench.run(10_000);
    let passed = bench.reg(reg::TICKS) - before;
    assert!((passed - 10_000).abs() <= 100, "{passed}");
    bench.set_reg(reg::MODE_REG, 2);
    bench.run(1);
    let passed = bench.reg(reg::TICKS) - before;
    assert!((passed - 10_001).abs() <= 2, "{passed}");
}

#[test]
fn p_ist_may_be_changed_any_time_and_takes_the_encoder_along() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.go_to(50_000);
    bench.run(300);
    let error = bench.reg(reg::FLWERR);
    bench.set_regs(&[(reg::P_SOLL, -7), (reg::P_IST, -7)]);
    bench.run(100);
    assert_eq!((bench.reg(reg::P_IST), bench.reg(reg::V_IST)), (-7, 0));
    assert!((bench.reg(reg::FLWERR) - error).abs() <= 1);
    let place = bench.plant().motor_position().0;
    bench.set_reg(reg::P_IST, -10_007);
    bench.run(500);
    assert_eq!(bench.reg(reg::P_IST), -7, "the motor goes to P_SOLL");
    assert!((bench.plant().motor_position().0 - place - 10_000.0).abs() < 300.0);
}

#[test]
fn encoder_pos_may_be_changed_and_leaves_p_ist_alone() {
    let mut bench = Bench::mis();
    bench.set_reg(reg::ENCODER_POS, 1_000);
    bench.run(2);
    assert_eq!(
        (bench.reg(reg::ENCODER_POS), bench.reg(reg::P_IST), bench.reg(reg::FLWERR)),
        (1_000, 0, 1_000)
    );
    assert_eq!(bench.reg(reg::ABS_ENC_POS), 0, "a place of the shaft");
}

#[test]
fn positions_wrap_around_at_32_bits() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::P_SOLL, i64::from(i32::MAX)), (reg::P_IST, i64::from(i32::MAX))]);
    bench.go_to(i64::from(i32::MIN) + 9_999);
    assert_eq!(bench.reg(reg::P_IST), i64::from(i32::MIN) + 9_999);
    let way = bench.plant().motor_position().0;
    assert!((way - 10_000.0).abs() < 300.0, "the short way: {way}");
}

#[test]
fn abs_enc_pos_is_the_place_within_a_turn() {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_reg(reg::P_IST, 1_000);
    bench.go_to(TURN + 1_000 - 100);
    bench.run(300);
    let place = bench.reg(reg::ABS_ENC_POS);
    assert!((place - (TURN - 100)).abs() < 100, "{place}");
}

/// The shaft of a passive motor is turned by a load.
fn turned_while_passive(setup: i64) -> Bench {
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_reg(reg::SETUP_BITS, setup);
    bench.go_to(10_000);
    bench.run(200);
    bench.set_reg(reg::MODE_REG, 0);
    bench.run(10);
    bench.plant().set_load(axis::Load { inertia_kgm2: 1.4e-4, gravity_nm: 0.2, ..axis::Load::default() });
    bench.until(reg::ENCODER_POS, |p| p > 200_000);
    bench.plant().set_load(axis::Load {
        inertia_kgm2: 1.4e-4,
        coulomb_friction_nm: 1.0,
        ..axis::Load::default()
    });
    bench.run(1_000);
    bench
}

#[test]
fn p_ist_stays_while_the_shaft_of_a_passive_motor_is_turned() {
    let mut bench = turned_while_passive(0);
    assert_eq!(bench.reg(reg::P_IST), 10_000);
    let encoder = bench.reg(reg::ENCODER_POS);
    assert!(bench.reg(reg::FLWERR) > 190_000);
    bench.set_regs(&[(reg::P_SOLL, 10_000), (reg::MODE_REG, 2)]);
    bench.run(1_000);
    assert_eq!(bench.reg(reg::P_IST), 10_000);
    assert!((bench.reg(reg::ENCODER_POS) - encoder).abs() < 5_000, "nothing moves but the rotor to its step");
}

#[test]
fn setup_bit_5_takes_p_ist_from_the_encoder_after_passive() {
    let mut bench = turned_while_passive(1 << 5);
    let encoder = bench.reg(reg::ENCODER_POS);
    bench.set_regs(&[(reg::P_SOLL, encoder), (reg::MODE_REG, 2)]);
    bench.run(100);
    assert_eq!(bench.reg(reg::P_IST), encoder);
    bench.go_to(0);
    bench.run(500);
    let error = bench.reg(reg::FLWERR);
    assert!(error.abs() < 8_192, "a rotor between two of its places: {error}");
}

#[test]
fn setup_bit_10_lets_p_ist_follow_the_encoder() {
    let bench = turned_while_passive(1 << 10);
    assert_eq!(bench.reg(reg::P_IST), bench.reg(reg::ENCODER_POS));
    assert_eq!(bench.reg(reg::FLWERR), 0);
}

#[test]
fn what_jvl_does_not_support_yet_is_stored() {
    let mut bench = Bench::mis();
    bench.set_regs(&[(reg::V1 + 2, 7_777), (reg::V_REG_P, 3)]);
    bench.run(10);
    assert_eq!((bench.reg(reg::V_REG_P), bench.reg(reg::V_SOLL)), (3, 10_000));
    for number in [100, 108, 109, 110, 139, 146, 166] {
        bench.set_reg(number, 5);
        bench.run(2);
        assert_eq!(bench.reg(number), 5, "{number}");
    }
}

#[test]
fn reserved_registers_read_zero_and_ignore_writes() {
    let mut bench = Bench::mis();
    for number in [4, 11, 17, 128, 153, 203, 254] {
        bench.set_reg(number, 99);
        bench.run(1);
        assert_eq!(bench.reg(number), 0, "{number}");
    }
}
