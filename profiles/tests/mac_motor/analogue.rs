//! The analogue inputs: modes that follow them, and the functions of the hardware inputs.

use axis::Voltage;

use crate::bench::Bench;
use crate::motor::{A_SOLL, FAMILIES, MODE, P_IST, P_SOLL, T_SOLL, V_IST, V_SOLL, arrive};

#[test]
fn the_analogue_modes_follow_the_input() {
    let speed = |mode: i64, volts: f64| {
        let mut bench = Bench::motor("mac800");
        bench.device.set_analog_input(0, Voltage(volts), bench.now);
        bench.write(&[(A_SOLL, 2000), (V_SOLL, 2771), (MODE, mode)]);
        bench.run(500);
        bench.register(11)
    };
    let near = |speed: i32, wanted: i32| assert!((speed - wanted).abs() <= 4, "{speed} for {wanted}");
    near(speed(5, 10.0), 2771);
    near(speed(5, -5.0), -1387);
    near(speed(16, 0.4), 0);
    near(speed(16, -10.0), -2771);
    near(speed(16, 5.25), 1387);
}

#[test]
fn analogue_torque_pushes_and_a_limited_one_only_up_to_v_soll() {
    let mut bench = Bench::motor("mac140");
    bench.device.set_analog_input(0, Voltage(2.0), bench.now);
    bench.write(&[(T_SOLL, 341), (V_SOLL, 1000), (MODE, 4)]);
    bench.run(40);
    assert_eq!(bench.register(121), 68, "a fifth of T_SOLL");
    bench.run(1000);
    assert!(bench.register(V_IST) > 100, "no end but that of the motor");
    // One that is faster already is not braked.
    bench.write(&[(MODE, 11)]);
    bench.run(1000);
    bench.write(&[(MODE, 17)]);
    bench.run(2000);
    let speed = bench.register(V_IST);
    assert!((50..=70).contains(&speed), "V_SOLL are 62.5 counts a sample, not {speed}");
    bench.device.set_analog_input(0, Voltage(0.0), bench.now);
    bench.run(20);
    assert!(bench.register(121).abs() <= 10, "{}", bench.register(121));
}

#[test]
fn the_offset_is_taken_off_the_analogue_input() {
    let mut bench = Bench::motor("mac140");
    bench.device.set_analog_input(0, Voltage(1.0), bench.now);
    assert_eq!(bench.register(122), 102);
    bench.write(&[(123, 102)]);
    assert_eq!(bench.register(122), 0);
}

#[test]
fn a_level_of_the_analogue_input_chooses_between_two_positions() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(49, -3000), (51, 4000), (A_SOLL, 500), (V_SOLL, 4000), (MODE, 20)]);
        arrive(&mut bench);
        assert!((bench.register(P_IST) + 3000).abs() <= 4, "{motor}: {}", bench.register(P_IST));
        bench.device.set_analog_input(0, Voltage(8.0), bench.now);
        arrive(&mut bench);
        assert!((bench.register(P_IST) - 4000).abs() <= 4, "{motor}: {}", bench.register(P_IST));
        assert_eq!(bench.register(P_SOLL), 4000);
    }
}

#[test]
fn a_voltage_is_a_share_of_p_soll() {
    let mut bench = Bench::motor("mac800");
    bench.device.set_analog_input(0, Voltage(-5.0), bench.now);
    bench.write(&[(P_SOLL, 10_230), (A_SOLL, 500), (V_SOLL, 4000), (MODE, 21)]);
    arrive(&mut bench);
    assert!((bench.register(P_IST) + 5120).abs() <= 4, "{}", bench.register(P_IST));
}

#[test]
fn hardware_input_functions_jog_the_motor() {
    // The manual's example: IN1 jogs with +100, IN2 with -100; without them mode 3 at 3000 (here 2).
    let mut bench = Bench::motor("mac800");
    bench.write(&[(89, 1), (90, 2), (65, 3000), (66, 400), (67, -400), (A_SOLL, 500)]);
    let copy = |input: i64, target: i64, on: i64, off: i64| on << 16 | off << 8 | input << 4 | target;
    bench.write(&[
        (93, copy(0, 1, 1, 2)),
        (94, copy(0, 2, 2, 1)),
        (95, copy(1, 1, 1, 0)),
        (96, copy(1, 2, 3, 0)),
    ]);
    assert_eq!((bench.register(MODE), bench.register(V_SOLL)), (2, 3000));
    let stick = |bench: &mut Bench, input, level| {
        bench.plant().inject(axis::PlantFault::StuckSwitch(input, level));
        bench.run(300);
    };
    stick(&mut bench, axis::Input::Probe1, true);
    assert_eq!((bench.register(MODE), bench.register(V_SOLL)), (1, 400));
    assert!(bench.register(V_IST) > 20);
    assert_eq!(bench.register(106) & 0b11, 0b01, "MAC00_1");
    stick(&mut bench, axis::Input::Probe2, true);
    assert_eq!(bench.register(V_SOLL), -400, "the later one has the last word");
    assert!(bench.register(V_IST) < -20);
    stick(&mut bench, axis::Input::Probe2, false);
    stick(&mut bench, axis::Input::Probe1, false);
    assert_eq!(bench.register(MODE), 2);
}

#[test]
fn a_hardware_input_function_copies_any_register_to_any_other() {
    let mut bench = Bench::motor("mac800");
    let function = 3_i64 << 24 | 49 << 16 | 51 << 8 | 8 << 4 | 7;
    bench.write(&[(49, 111), (51, 222), (93, function)]);
    assert_eq!(bench.register(P_SOLL), 222);
    bench.device.set_analog_input(0, Voltage(6.0), bench.now);
    assert_eq!(bench.register(P_SOLL), 111, "also while the motor is asleep");
    // Never a reset or a store.
    bench.write(&[(93, 211 << 24 | 49 << 16 | 49 << 8 | 7), (49, 2)]);
    bench.run(20);
    assert_eq!(bench.events(), []);
}

#[test]
fn a_register_of_a_group_waits_for_a_command_unless_an_input_copies_it() {
    let mut bench = Bench::motor("mac800");
    let asleep = bench.register(V_SOLL);
    bench.write(&[(65, 300)]);
    assert_eq!(bench.register(V_SOLL), asleep);
    // V1 becomes V_SOLL while IN1 is off.
    bench.write(&[(93, 1 << 8 | 2)]);
    assert_eq!(bench.register(V_SOLL), 300);
    bench.write(&[(65, 400)]);
    assert_eq!(bench.register(V_SOLL), 400, "at once, also while the motor is asleep");
    bench.write(&[(93, 0)]);
    bench.write(&[(65, 500)]);
    assert_eq!(bench.register(V_SOLL), 400);
}

#[test]
fn two_distances_by_the_analogue_input_add_up_once_for_each_change() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(49, 500), (51, 2000), (A_SOLL, 500), (V_SOLL, 4000)]);
        bench.fastmac(0x75);
        bench.write(&[(MODE, 20)]);
        bench.run(500);
        assert_eq!(bench.register(P_SOLL), 500, "{motor}: the begin activates P1");
        for (volts, target) in [(8.0, 2500), (9.0, 2500), (1.0, 3000), (6.0, 5000)] {
            bench.device.set_analog_input(0, Voltage(volts), bench.now);
            bench.run(500);
            assert_eq!(bench.register(P_SOLL), target, "{motor}: {volts} V");
            assert!((bench.register(P_IST) - target).abs() <= 4, "{motor}");
        }
    }
}
