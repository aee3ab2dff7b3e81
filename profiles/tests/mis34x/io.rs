//! Inputs, outputs, masks, filter and analogue inputs.

use axis::Voltage;

use crate::bench::Bench;
use crate::motor::{range, reg};

#[test]
fn the_switches_are_at_the_inputs_that_the_masks_name() {
    let mut bench = Bench::mis_with(|plant| {
        plant.home_switch = range(-10.0, 10.0);
        plant.positive_switch = Some(axis::Position(-10.0));
        plant.probe_switches = [range(-10.0, 10.0), None];
    });
    bench.run(5);
    assert_eq!(bench.reg(reg::INPUTS), 0b1, "no mask: the first general input");
    bench.set_regs(&[(reg::HOME_MASK, 1 << 0), (reg::PL_MASK, 1 << 5), (reg::NL_MASK, 1 << 6)]);
    bench.run(5);
    assert_eq!(bench.reg(reg::INPUTS), 0b10_0011);
}

#[test]
fn iosetup_inverts_inputs_and_makes_outputs() {
    let mut bench = Bench::mis_with(|plant| plant.home_switch = range(-10.0, 10.0));
    bench.set_regs(&[(reg::HOME_MASK, 1), (reg::IOSETUP, 0x0000_C0F1)]);
    bench.run(5);
    // IN1 is high and active low; IN5 and IN6 are low and active low; the outputs are no inputs.
    assert_eq!(bench.reg(reg::INPUTS), 0b0011_0000);
}

#[test]
fn outputs_follow_their_register_or_in_position_and_error() {
    let outputs = |bench: &Bench| bench.device.axes().next().unwrap().outputs;
    let mut bench = Bench::mis();
    bench.fast();
    bench.set_regs(&[(reg::IOSETUP, 0xFF00), (reg::OUTPUTS, 0b1010_0000)]);
    bench.run(2);
    assert_eq!(outputs(&bench), 0b1010_0000);
    bench.set_sub(0x60FE, 1, 0b0001);
    bench.run(2);
    assert_eq!(outputs(&bench), 0b1010_0001, "0x60FE is the same outputs");
    bench.set_regs(&[(reg::INPOS_MASK, 0b0100), (reg::ERROR_MASK, 0b1000_0000)]);
    bench.run(2);
    assert_eq!(outputs(&bench), 0b0010_0001);
    bench.go_to(10_000);
    assert_eq!(outputs(&bench), 0b0010_0101);
    bench.set_regs(&[(reg::FLWERRMAX, 1), (reg::ENCODER_POS, 0)]);
    bench.run(50);
    assert_eq!(outputs(&bench), 0b1010_0001);
    bench.set_reg(reg::IOSETUP, 0x0300);
    bench.run(2);
    assert_eq!(outputs(&bench), 0b0001, "only what is an output");
    bench.set_reg(reg::IOSETUP, 0x03FF);
    bench.run(2);
    assert_eq!(outputs(&bench), 0b0010, "active low");
}

#[test]
fn a_filtered_input_must_be_stable() {
    let mut bench =
        Bench::mis_with(|plant| plant.probe_switches = [range(1_000.0, 1e9), range(1_000.0, 1e9)]);
    bench.fast();
    bench.set_regs(&[(reg::INPUT_FILTER_MASK, 0b10), (reg::INPUT_FILTER_CNT, 20), (reg::MODE_REG, 2)]);
    bench.run(5);
    bench.set_reg(reg::P_SOLL, 50_000);
    bench.run_until(|b| b.reg(reg::INPUTS) != 0);
    assert_eq!(bench.reg(reg::INPUTS), 0b01, "the first is not filtered");
    bench.run(15);
    assert_eq!(bench.reg(reg::INPUTS), 0b01);
    bench.run(10);
    assert_eq!(bench.reg(reg::INPUTS), 0b11);
}

#[test]
fn analogue_inputs_count_1_221_mv() {
    let mut bench = Bench::mis_with(|plant| plant.probe_switches = [None, range(-10.0, 10.0)]);
    let inputs = |bench: &Bench| (0..8).map(|n| bench.reg(reg::ANALOG_INPUT_1 + n)).collect::<Vec<_>>();
    bench.device.set_analog_input(0, Voltage(2.5), bench.now);
    bench.run(2);
    assert_eq!(inputs(&bench), [2048, 4095, 0, 0, 0, 0, 0, 0], "2.5 V, and a signal of 24 V");
    bench.device.set_analog_input(0, Voltage(-3.0), bench.now);
    bench.run(2);
    assert_eq!(bench.reg(reg::ANALOG_INPUT_1), 0);
}
