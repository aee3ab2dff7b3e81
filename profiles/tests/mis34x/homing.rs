//! The zero search by MODE_REG 13 and 14, and the homing methods of CiA 402.

use axis::{PlantConfig, Position};
use od::AbortCode;
use profiles::State;

use crate::bench::Bench;
use crate::commands::store;
use crate::motor::{error, range, reg, status};

/// The home switch from 200000 to 260000, limit switches at 600000 on both sides, the index at 100000.
fn machine(plant: &mut PlantConfig) {
    plant.home_switch = range(200_000.0, 260_000.0);
    plant.positive_switch = Some(Position(600_000.0));
    plant.negative_switch = Some(Position(-600_000.0));
    plant.index = Position(100_000.0);
}

/// With the home switch at IN3, the limit switches at IN1 and IN2.
fn bench(start: f64) -> Bench {
    let mut bench = Bench::mis_with(|plant| {
        machine(plant);
        plant.start = Position(start);
    });
    bench.fast();
    bench.set_regs(&[
        (reg::HOME_MASK, 0b100),
        (reg::NL_MASK, 0b001),
        (reg::PL_MASK, 0b010),
        (reg::V_HOME, 10_000),
    ]);
    bench
}

/// Where the zero point of P_IST is, in counts of the encoder, after a search.
fn zero(bench: &mut Bench, mode: i64) -> f64 {
    bench.set_reg(reg::MODE_REG, mode);
    bench.run(5);
    assert_eq!(bench.reg(reg::MODE_REG), mode, "the mode is shown while it searches");
    bench.until(reg::MODE_REG, |shown| shown != mode);
    assert!(bench.has(status::ZERO_SEARCH_DONE), "errors {:X}", bench.reg(reg::ERR_BITS));
    bench.run(300);
    bench.plant().motor_position().0 - bench.reg(reg::ENCODER_POS) as f64
}

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 60.0, "{found} is not {expected}");
}

#[test]
fn the_zero_point_is_the_edge_of_the_sensor() {
    for mode in [13, 14] {
        let zero = zero(&mut bench(0.0), mode);
        assert_near(zero, 200_000.0);
    }
}

#[test]
fn v_home_gives_the_direction() {
    let mut bench = bench(400_000.0);
    bench.set_reg(reg::V_HOME, -10_000);
    assert_near(zero(&mut bench, 13), 260_000.0);
}

#[test]
fn a_motor_on_the_sensor_leaves_it_first() {
    for mode in [13, 14] {
        assert_near(zero(&mut bench(230_000.0), mode), 200_000.0);
    }
}

#[test]
fn p_home_is_the_number_of_the_zero_point() {
    let mut bench = bench(0.0);
    bench.set_reg(reg::P_HOME, 5_000);
    assert_near(zero(&mut bench, 13), 195_000.0);
}

#[test]
fn bit_2_takes_the_far_side_of_the_sensor() {
    for mode in [13, 14] {
        let mut bench = bench(0.0);
        bench.set_reg(reg::ZERO_SEARCH_BITS, 1 << 2);
        assert_near(zero(&mut bench, mode), 260_000.0);
    }
}

#[test]
fn bit_0_goes_on_to_the_index_and_bit_4_to_that_alone() {
    let mut bench_0 = bench(0.0);
    bench_0.set_reg(reg::ZERO_SEARCH_BITS, 1 << 0);
    assert_near(zero(&mut bench_0, 13), 509_600.0);
    let mut bench_4 = bench(0.0);
    bench_4.set_reg(reg::ZERO_SEARCH_BITS, 1 << 4);
    assert_near(zero(&mut bench_4, 13), 100_000.0);
}

#[test]
fn bit_1_turns_round_at_a_limit_switch() {
    let mut turning = bench(400_000.0);
    turning.set_reg(reg::ZERO_SEARCH_BITS, 1 << 1);
    assert_near(zero(&mut turning, 13), 260_000.0);
    let mut failing = bench(400_000.0);
    failing.set_reg(reg::MODE_REG, 13);
    failing.run_until(|b| b.reg(reg::MODE_REG) == 0);
    assert_eq!(failing.reg(reg::ERR_BITS), error::GENERAL | error::POSITION_LIMIT);
    assert!(!failing.has(status::ZERO_SEARCH_DONE));
}

#[test]
fn after_the_search_the_motor_is_in_its_start_mode_where_it_is() {
    let mut bench = bench(0.0);
    bench.set_regs(&[(reg::STARTMODE, 2), (reg::P_SOLL, 123_456)]);
    zero(&mut bench, 14);
    assert_eq!(bench.reg(reg::MODE_REG), 2);
    assert_eq!((bench.reg(reg::P_SOLL), bench.reg(reg::V_IST)), (bench.reg(reg::P_IST), 0));
    bench.go_to(0);
    bench.run(300);
    assert_near(bench.plant().motor_position().0, 200_000.0);
}

#[test]
fn the_search_by_cyclic_data_ends_with_in_position_in_start_mode_position() {
    // The steps of section 3.6.4.
    let mut bench = bench(0.0);
    bench.set_regs(&[(reg::STARTMODE, 2), (reg::MODE_REG, 13)]);
    bench.until(reg::MODE_REG, |mode| mode == 13);
    bench.run_until(|b| b.has(status::IN_POSITION | status::ZERO_SEARCH_DONE));
}

#[test]
fn fastmac_70_starts_the_search_of_homemode_or_13() {
    for (homemode, mode) in [(0, 13), (13, 13), (14, 14)] {
        let mut bench = bench(0.0);
        bench.set_reg(reg::HOMEMODE, homemode);
        bench.set_reg(reg::COMMAND, 0x70);
        bench.run(5);
        assert_eq!(bench.reg(reg::MODE_REG), mode);
    }
}

#[test]
fn homemode_starts_the_search_at_power_on() {
    let mut bench = bench(0.0);
    bench.set_regs(&[(reg::HOMEMODE, 14), (reg::STARTMODE, 2), (reg::COMMAND, 268)]);
    store(&mut bench);
    bench.run(20);
    assert_eq!(bench.reg(reg::MODE_REG), 14);
    bench.until(reg::MODE_REG, |mode| mode == 2);
    assert!(bench.has(status::ZERO_SEARCH_DONE));
}

#[test]
fn position_limits_do_not_bound_a_search() {
    let mut bench = bench(0.0);
    bench.set_regs(&[(reg::MIN_P_IST, -1_000), (reg::MAX_P_IST, 1_000)]);
    assert_near(zero(&mut bench, 13), 200_000.0);
}

#[test]
fn without_a_home_mask_there_is_no_sensor() {
    let mut bench = bench(0.0);
    bench.set_regs(&[(reg::HOME_MASK, 0), (reg::MODE_REG, 13)]);
    bench.run_until(|b| b.reg(reg::ERR_BITS) != 0);
    assert!(bench.plant().motor_position().0 > 600_000.0, "past the sensor to the limit switch");
}

#[test]
fn cia_402_has_the_methods_20_22_and_35_and_no_others() {
    let mut bench = Bench::mis();
    for method in -128..=127_i64 {
        let result = bench.batch(&[(0x6098, 0, method & 0xFF)]);
        let expected = if [0, 20, 22, 35].contains(&method) { Ok(()) } else { Err(AbortCode::InvalidValue) };
        assert_eq!(result, expected, "{method}");
    }
}

#[test]
fn homing_by_methods_20_and_22_finds_the_same_edges() {
    for (method, start, edge) in [(20, 0.0, 200_000.0), (22, 400_000.0, 260_000.0)] {
        let mut bench = bench(start);
        bench.batch(&[(0x6099, 1, 200_000), (0x6099, 2, 20_000), (0x609A, 0, 4_000_000)]).unwrap();
        bench.set(0x6098, method);
        bench.enable(6);
        bench.control(0x1F);
        bench.run_until(|b| b.statusword() & 0x3400 == 0x1400);
        bench.run(300);
        assert_near(bench.plant().motor_position().0, edge);
        assert!(bench.position().abs() < 60);
        assert_eq!(bench.state(), State::OperationEnabled);
    }
}

#[test]
fn method_35_calls_the_present_place_home() {
    let mut bench = bench(50_000.0);
    bench.set(0x6098, 35);
    bench.enable(6);
    bench.control(0x1F);
    bench.run_until(|b| b.statusword() & 0x3400 == 0x1400);
    assert!(bench.position().abs() < 60);
    assert_eq!(bench.reg(reg::P_IST), 0);
}
