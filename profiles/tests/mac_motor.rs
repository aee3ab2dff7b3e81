//! The registers of a MAC motor at work: the examples of JVL's Ethernet manual, and what its register list says.
//!
//! Registers are reached by 0x2012, as over CANopen.

mod bench;

use std::time::Duration;

use axis::{Position, PositionRange, Velocity, Voltage};
use bench::Bench;
use profiles::{DeviceEvent, State};

const MODE: u8 = 2;
const P_SOLL: u8 = 3;
const V_SOLL: u8 = 5;
const A_SOLL: u8 = 6;
const T_SOLL: u8 = 7;
const P_FNC: u8 = 8;
const P_IST: u8 = 10;
const V_IST: u8 = 12;
const ERR_STAT: u8 = 35;
const CNTRL_BITS: u8 = 36;
const IN_POS: i32 = 1 << 4;

const FAMILIES: [&str; 2] = ["mac140", "mac800"];

/// The number of P_NEW.
fn p_new(motor: &str) -> u8 {
    if motor == "mac140" { 163 } else { 4 }
}

fn in_position(bench: &Bench) -> bool {
    bench.register(ERR_STAT) & IN_POS != 0
}

/// Waits until the motor is in position, and has come to rest there.
fn arrive(bench: &mut Bench) {
    bench.run(20);
    bench.run_until(in_position);
    bench.run(300);
}

/// Writes the registers and waits until the motor is in position.
fn go(bench: &mut Bench, registers: &[(u8, i64)]) {
    bench.write(registers);
    arrive(bench);
}

/// VF_OUT.
fn torque(bench: &Bench, motor: &str) -> i32 {
    bench.register(if motor == "mac140" { 121 } else { 169 })
}

#[test]
fn example_1200_rpm() {
    let mut bench = Bench::motor("mac400");
    bench.write(&[(V_SOLL, 3404), (A_SOLL, 369)]);
    bench.write(&[(MODE, 1)]);
    bench.run(1000);
    let rpm = bench.get(0x606C) as f64 / 8192.0 * 60.0;
    assert!((rpm - 1200.0).abs() < 1.0, "{rpm}");
    assert_eq!(bench.register(V_IST), 213);
    assert!((bench.register(11) - 3404).abs() <= 3, "V_IST_16 is {}", bench.register(11));
    assert_eq!((bench.register(MODE), bench.register(A_SOLL)), (1, 369));
    assert!(in_position(&bench), "at velocity");
}

#[test]
fn example_5_000_000_counts() {
    let mut bench = Bench::motor("mac400");
    bench.write(&[(V_SOLL, 8000), (A_SOLL, 400)]);
    bench.write(&[(MODE, 2)]);
    bench.write(&[(P_SOLL, 5_000_000)]);
    bench.run(13_500);
    assert!(in_position(&bench));
    assert!((bench.register(P_IST) - 5_000_000).abs() <= 2);
    assert!((bench.register(P_FNC) - 80_000_000).abs() <= 16);
}

#[test]
fn example_1000_are_477_rpm_on_a_mac140() {
    let mut bench = Bench::motor("mac140");
    bench.write(&[(T_SOLL, 1023), (V_SOLL, 1000), (MODE, 1)]);
    bench.run(1000);
    let rpm = bench.get(0x606C) as f64 / 4096.0 * 60.0;
    assert!((rpm - 477.0).abs() < 1.0, "{rpm}");
    assert_eq!(bench.register(V_IST), 63, "62.5 counts a sample");
}

#[test]
fn example_relative_move_by_p7() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(MODE, 2), (61, 1000)]);
        bench.run(50);
        for moved in [1000, 2000] {
            let actual = bench.register(P_IST);
            let error = if motor == "mac140" { 0 } else { bench.register(20) };
            bench.fastmac(0x71);
            assert_eq!(bench.register(P_SOLL), actual + 1000 - error, "{motor}");
            arrive(&mut bench);
            assert!((bench.register(P_IST) - moved).abs() <= 4, "{motor}: {}", bench.register(P_IST));
        }
    }
}

#[test]
fn example_p_new() {
    for motor in FAMILIES {
        for (command, expected) in [(119, 5000), (120, 5100)] {
            let mut bench = Bench::motor(motor);
            bench.write(&[(P_IST, 100), (P_SOLL, 100), (p_new(motor), 5000)]);
            bench.fastmac(command);
            assert_eq!((bench.register(P_IST), bench.register(P_SOLL)), (expected, expected), "{motor}");
            assert_eq!(bench.register(P_FNC), expected * 16);
        }
    }
}

#[test]
fn p_new_while_the_motor_holds_a_position_moves_nothing() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(MODE, 2)]);
        go(&mut bench, &[(P_SOLL, 3000)]);
        let place = bench.get(0x6064);
        bench.write(&[(p_new(motor), -70_000)]);
        bench.fastmac(120);
        let shifted = bench.register(P_IST);
        assert_eq!(i64::from(shifted), place - 70_000, "{motor}");
        bench.run(500);
        assert!((bench.register(P_IST) - shifted).abs() <= 4, "{motor}: the motor stays where it is");
        assert_eq!(bench.register(P_SOLL), -67_000);
    }
}

#[test]
fn the_control_bit_synchronises_as_the_commands_do_and_is_taken_back() {
    let mut bench = Bench::motor("mac800");
    bench.write(&[(P_IST, 100), (P_SOLL, 100), (4, 5000), (CNTRL_BITS, 1 << 5 | 1 << 6 | 1 << 8)]);
    assert_eq!((bench.register(P_IST), bench.register(P_SOLL)), (5100, 5100));
    assert_eq!(bench.register(CNTRL_BITS), 1 << 5 | 1 << 8);
    let mut bench = Bench::motor("mac140");
    bench.write(&[(P_IST, 100), (P_SOLL, 100), (163, 5000), (CNTRL_BITS, 1 << 10)]);
    assert_eq!((bench.register(P_IST), bench.register(P_SOLL)), (5000, 5000));
    assert_eq!(bench.register(CNTRL_BITS), 0);
}

#[test]
fn example_command_table() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(P_SOLL, 900), (P_IST, 800), (V_SOLL, 700), (T_SOLL, 600)]);
        bench.fastmac(0x62);
        assert_eq!(bench.register(P_SOLL), 0);
        bench.fastmac(0x63);
        assert_eq!(bench.register(P_IST), 0);
        bench.fastmac(0x65);
        assert_eq!(bench.register(V_SOLL), 0);
        bench.fastmac(0x66);
        assert_eq!(bench.register(T_SOLL), 0, "{motor}");
    }
}

#[test]
fn example_register_groups() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(67, 1234), (44, 3)]);
        assert_eq!((bench.register(V_SOLL), bench.register(44)), (1234, 0));
        bench.write(&[
            (63, -77),
            (43, 8),
            (74, 55),
            (45, 2),
            (79, 500),
            (46, 3),
            (84, 9),
            (47, 4),
            (85, 12),
            (48, 1),
        ]);
        let copied = [P_SOLL, A_SOLL, T_SOLL, 13, 33].map(|number| bench.register(number));
        assert_eq!(copied, [-77, 55, 500, 9, 12], "{motor}");
        bench.write(&[(43, 9), (44, 200), (45, 5)]);
        assert_eq!(
            [P_SOLL, V_SOLL, A_SOLL, 43, 44, 45].map(|number| bench.register(number)),
            [-77, 1234, 55, 0, 0, 0]
        );
    }
}

#[test]
fn one_command_activates_a_register_of_every_group() {
    for motor in FAMILIES {
        for index in 0..4_u8 {
            let mut bench = Bench::motor(motor);
            let at = |first: u8, wide: u8| first + index * wide;
            bench.write(&[(at(49, 2), 11), (at(65, 1), 22), (at(73, 1), 33)]);
            bench.write(&[(at(77, 1), 44), (at(81, 1), 55), (at(85, 1), 66)]);
            bench.fastmac(0x6C + i64::from(index));
            let copied = [P_SOLL, V_SOLL, A_SOLL, T_SOLL, 13, 33].map(|number| bench.register(number));
            assert_eq!(copied, [11, 22, 33, 44, 55, 66], "{motor} {index}");
        }
    }
}

#[test]
fn positions_are_activated_as_places_or_distances() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(MODE, 2), (49, 2000), (65, 4000), (73, 100), (77, 1023), (85, 100)]);
        let mut activate = |command: i64, p_soll: i32, p_ist: i32| {
            bench.fastmac(command);
            bench.fastmac(0x6C);
            arrive(&mut bench);
            assert_eq!(bench.register(P_SOLL), p_soll, "{motor} {command:X}");
            assert!((bench.register(P_IST) - p_ist).abs() <= 4, "{motor}: {}", bench.register(P_IST));
        };
        activate(0x74, 2000, 2000);
        activate(0x75, 4000, 4000);
        activate(0x75, 6000, 6000);
        // For the generator alone: P_SOLL stays, the motor goes on.
        activate(0x76, 6000, 8000);
        activate(0x76, 6000, 10_000);
        activate(0x74, 2000, 2000);
    }
}

#[test]
fn p_fnc_moves_by_p7_where_the_target_is_zero() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(MODE, 2), (61, 3000)]);
        bench.run(50);
        let before = bench.device.plant(0, bench.now).unwrap().encoder();
        bench.fastmac(0x68);
        assert_eq!(bench.register(P_IST), -3000);
        arrive(&mut bench);
        let after = bench.device.plant(0, bench.now).unwrap().encoder();
        assert!(((after - before).0 - 3000.0).abs() <= 4.0, "{motor}: the motor has moved by P7");
        assert!(bench.register(P_IST).abs() <= 4, "and is at P_SOLL");
    }
}

#[test]
fn set_points_act_at_once_in_their_mode() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(A_SOLL, 2000), (V_SOLL, 1600), (MODE, 1)]);
        bench.run(300);
        assert!((bench.register(V_IST) - 100).abs() <= 1, "{motor}: {}", bench.register(V_IST));
        bench.write(&[(V_SOLL, -800)]);
        bench.run(300);
        assert!((bench.register(V_IST) + 50).abs() <= 1, "{motor}: {}", bench.register(V_IST));
        bench.write(&[(V_SOLL, 0)]);
        bench.run(300);
        assert_eq!(bench.register(V_IST), 0);
        // From mode to mode on the move.
        bench.write(&[(V_SOLL, 1600)]);
        bench.run(300);
        go(&mut bench, &[(P_SOLL, 50_000), (MODE, 2)]);
        go(&mut bench, &[(P_SOLL, -500)]);
        assert!((bench.register(P_IST) + 500).abs() <= 4);
        // A negative speed is no direction here.
        go(&mut bench, &[(V_SOLL, -1600), (P_SOLL, 500)]);
        assert!((bench.register(P_IST) - 500).abs() <= 4);
    }
}

#[test]
fn the_ramp_is_a_soll() {
    let mut bench = Bench::motor("mac800");
    bench.write(&[(A_SOLL, 36), (V_SOLL, 2771), (MODE, 1)]);
    bench.run(30);
    let early = bench.get(0x606B) as f64 / 8000.0 * 60.0;
    bench.run(50);
    let late = bench.get(0x606B) as f64 / 8000.0 * 60.0;
    // 36 are 10005 RPM/s.
    let slope = (late - early) / 0.05;
    assert!((slope - 10_005.0).abs() < 400.0, "{slope}");
}

#[test]
fn t_soll_limits_the_torque() {
    let mut bench = Bench::motor("mac140");
    bench.write(&[(T_SOLL, 100), (A_SOLL, 32_000), (V_SOLL, 6000), (MODE, 1)]);
    for _ in 0..200 {
        bench.run(2);
        assert!(bench.register(121).abs() <= 101, "{}", bench.register(121));
    }
    assert!(bench.register(121) > 90 || bench.register(V_IST) > 300);
}

#[test]
fn passive_takes_the_power_and_the_motor_coasts() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(A_SOLL, 2000), (V_SOLL, 1600), (MODE, 1)]);
        bench.run(300);
        bench.write(&[(MODE, 0)]);
        bench.run(4);
        assert_eq!(torque(&bench, motor), 0, "no torque");
        assert!(bench.register(V_IST) > 90, "{motor}: it rolls on");
        bench.run(60_000);
        assert_eq!((bench.register(V_IST), bench.register(MODE)), (0, 0));
        assert!(bench.device.is_quiet());
    }
}

#[test]
fn tests_of_the_factory_are_shown_and_leave_the_axis_free() {
    let mut bench = Bench::motor("mac800");
    for mode in [7, 8, 9, 15, 19, 22, 23] {
        bench.write(&[(MODE, 1)]);
        bench.run(100);
        bench.write(&[(MODE, mode)]);
        bench.run(20);
        assert_eq!((i64::from(bench.register(MODE)), torque(&bench, "mac800")), (mode, 0));
    }
    for mode in [26, 255, 256, 257, 258, 0xFFFF] {
        bench.write(&[(MODE, 1)]);
        bench.run(20);
        bench.write(&[(MODE, mode)]);
        assert_eq!(bench.register(MODE), 1, "{mode} is no mode");
    }
}

#[test]
fn stop_and_brake_come_to_rest_and_hold() {
    for (mode, millis) in [(11, 450), (10, 100)] {
        let mut bench = Bench::motor("mac800");
        // 1000 RPM; A_SOLL 3000 RPM/s.
        bench.write(&[(A_SOLL, 11), (V_SOLL, 2771), (MODE, 1)]);
        bench.run(1000);
        bench.write(&[(MODE, mode)]);
        bench.run(20);
        assert!(bench.register(V_IST) > 0);
        bench.run(millis);
        assert_eq!(bench.register(V_IST), 0, "mode {mode}");
        let place = bench.register(P_IST);
        bench.run(500);
        assert!((bench.register(P_IST) - place).abs() <= 2, "it holds");
        assert_eq!(i64::from(bench.register(MODE)), mode);
    }
}

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
fn the_gear_follows_the_external_encoder() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(14, 3), (15, 2), (A_SOLL, 2000), (V_SOLL, 4000), (MODE, 3)]);
        bench.run(20);
        let start = bench.register(P_IST);
        bench.device.set_external_encoder(0, Velocity(10_000.0), bench.now);
        bench.run(2000);
        let speed = bench.get(0x606C);
        assert!((speed - 15_000).abs() <= 600, "{motor}: {speed}");
        bench.device.set_external_encoder(0, Velocity(0.0), bench.now);
        bench.run(500);
        let moved = bench.register(P_IST) - start;
        assert!((moved - 30_000).abs() <= 60, "{motor}: {moved} counts for 20000");
        assert!(in_position(&bench));
    }
}

#[test]
fn what_the_limits_keep_a_gear_from_is_made_up_but_not_in_gear_follow() {
    for (mode, made_up) in [(3, true), (24, false)] {
        let mut bench = Bench::motor("mac800");
        bench.write(&[(14, 1), (15, 1), (A_SOLL, 500), (V_SOLL, 1000), (MODE, mode)]);
        bench.run(20);
        // V_SOLL are 48125 counts/s.
        bench.device.set_external_encoder(0, Velocity(60_000.0), bench.now);
        bench.run(1000);
        let fncerr = bench.register(24);
        bench.device.set_external_encoder(0, Velocity(0.0), bench.now);
        bench.run(2000);
        let moved = bench.register(P_IST);
        if made_up {
            assert!(fncerr > 10_000, "behind by {fncerr}");
            assert!((moved - 60_000).abs() <= 80, "{moved}");
        } else {
            assert!(fncerr.abs() < 500, "{fncerr}");
            assert!((46_000..50_000).contains(&moved), "{moved}");
        }
    }
}

#[test]
fn the_analogue_input_turns_the_gear_or_adds_to_it() {
    let speed = |mode: i64| {
        let mut bench = Bench::motor("mac800");
        bench.device.set_analog_input(0, Voltage(5.0), bench.now);
        bench.device.set_external_encoder(0, Velocity(-10_000.0), bench.now);
        bench.write(&[(14, 2), (15, 1), (A_SOLL, 2000), (V_SOLL, 1000), (MODE, mode)]);
        bench.run(500);
        bench.get(0x606C)
    };
    let (geared, added) = (speed(18), speed(6));
    assert!((geared + 10_010).abs() < 300, "{geared}");
    assert!((added - 4086).abs() < 300, "-20000 and half of V_SOLL: {added}");
}

#[test]
fn the_torque_search_finds_the_stop_and_goes_on_in_the_start_mode() {
    for motor in FAMILIES {
        let stops = PositionRange::new(Position(-9000.0), Position(1e6));
        let mut bench = Bench::motor_with(motor, |plant| plant.stops = stops);
        bench.write(&[
            (37, 2),
            (38, -5000),
            (40, -400),
            (41, 100),
            (V_SOLL, 2000),
            (P_SOLL, 777),
            (MODE, 12),
        ]);
        bench.run(20);
        assert_eq!(bench.register(MODE), 12);
        bench.run_until(|b| b.register(MODE) == 2);
        assert_eq!(bench.register(P_SOLL), 0);
        arrive(&mut bench);
        assert!(bench.register(P_IST).abs() <= 4);
        let place = bench.device.plant(0, bench.now).unwrap().encoder().0;
        assert!((place + 4000.0).abs() < 60.0, "{motor}: zero is 5000 counts off the stop, here {place}");
        let homed = if motor == "mac140" { bench.register(168) } else { bench.register(42) >> 16 };
        assert_eq!(homed & 1, 1);
    }
}

#[test]
fn the_sensor_searches_find_their_edge() {
    // Mode, T_HOME, the zero point.
    for (mode, torque, zero) in
        [(13, 341, -2000.0), (13, -341, -2600.0), (14, 341, -2000.0), (14, -341, -2600.0)]
    {
        let switch = PositionRange::new(Position(-2600.0), Position(-2000.0));
        let mut bench = Bench::motor_with("mac800", |plant| plant.home_switch = switch);
        bench.write(&[(37, 2), (38, 0), (40, -200), (41, torque), (A_SOLL, 200), (MODE, mode)]);
        if torque < 0 {
            // The falling edge is the far one: the sensor must be actuated first.
            bench.write(&[(MODE, 0)]);
            bench.write(&[(P_SOLL, -2300), (MODE, 2)]);
            bench.run(500);
            bench.write(&[(MODE, mode)]);
        }
        bench.run(20);
        bench.run_until(|b| b.register(MODE) == 2);
        arrive(&mut bench);
        let place = bench.device.plant(0, bench.now).unwrap().encoder().0;
        assert!((place - zero).abs() <= 6.0, "mode {mode}, T_HOME {torque}: {place}");
    }
}

#[test]
fn the_index_search_ends_at_the_index() {
    let mut bench = Bench::motor_with("mac800", |plant| plant.index = Position(1234.0));
    bench.write(&[(37, 0), (40, 200), (A_SOLL, 200), (MODE, 25)]);
    bench.run(20);
    bench.run_until(|b| b.register(MODE) == 0);
    bench.run(500);
    let place = bench.device.plant(0, bench.now).unwrap().encoder().0;
    assert!((place - 1234.0).abs() <= 6.0, "{place}");
    assert_eq!(bench.register(9), 1234, "INDEX_OFFSET");
    assert!(bench.register(P_IST).abs() <= 6);
}

#[test]
fn a_command_starts_the_search_that_home_mode_names() {
    let stops = || PositionRange::new(Position(-900.0), Position(1e6));
    for (home_mode, expected) in [(0, 0), (12, 12), (13 << 8, 13), (14 << 8 | 12, 14), (0xFF << 8, 0)] {
        let mut bench = Bench::motor_with("mac800", |plant| plant.stops = stops());
        bench.write(&[(42, home_mode)]);
        bench.fastmac(0x70);
        bench.run(5);
        assert_eq!(bench.register(MODE), expected, "{home_mode:X}");
    }
}

#[test]
fn a_software_limit_stops_the_motor_and_is_an_error() {
    for motor in FAMILIES {
        for (mode, target) in [(1, 0), (2, 90_000)] {
            let mut bench = Bench::motor(motor);
            bench.write(&[
                (28, 0),
                (30, 20_000),
                (A_SOLL, 300),
                (V_SOLL, 3000),
                (P_SOLL, target),
                (MODE, mode),
            ]);
            bench.run_until(|b| b.register(ERR_STAT) & 1 << 7 != 0);
            bench.run(50);
            assert_eq!(bench.register(MODE), 0, "{motor}: passive");
            let end = bench.register(P_IST);
            assert!((19_980..=20_040).contains(&end), "{motor}: {end}");
            assert_eq!(bench.state(), State::Fault);
            // Not before the error is cleared.
            bench.write(&[(MODE, 2), (P_SOLL, 100)]);
            bench.run(50);
            assert_eq!(bench.register(MODE), 0);
            bench.fastmac(0x61);
            assert_eq!(bench.register(ERR_STAT) & 1 << 7, 0);
            bench.run(10);
            go(&mut bench, &[(MODE, 2)]);
            assert!((bench.register(P_IST) - 100).abs() <= 4, "{motor}: the way back is free");
        }
    }
}

#[test]
fn a_follow_error_above_its_limit_stops_the_motor() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(22, 300), (T_SOLL, 5), (A_SOLL, 2000), (V_SOLL, 3000), (MODE, 1)]);
        bench.run_until(|b| b.register(ERR_STAT) & 1 << 1 != 0);
        bench.run(1000);
        assert_eq!((bench.register(MODE), bench.register(V_IST)), (0, 0), "{motor}");
        assert_eq!(bench.state(), State::Fault);
        assert!(matches!(bench.events()[..], [DeviceEvent::Raised(fault)] if fault.code == 0x1001));
        bench.fastmac(0xE1);
        bench.run(10);
        assert_eq!(bench.events(), [DeviceEvent::Cleared(0x1001)]);
        assert_eq!(bench.state(), State::SwitchOnDisabled);
        assert_eq!(bench.register(ERR_STAT) & 0xF, 0);
    }
}

#[test]
fn a_function_error_above_its_limit_stops_the_motor() {
    let mut bench = Bench::motor("mac800");
    bench.write(&[(14, 1), (15, 1), (26, 4000), (A_SOLL, 500), (V_SOLL, 500), (MODE, 3)]);
    bench.device.set_external_encoder(0, Velocity(60_000.0), bench.now);
    bench.run_until(|b| b.register(ERR_STAT) & 1 << 2 != 0);
    bench.run(500);
    assert_eq!((bench.register(MODE), bench.register(V_IST)), (0, 0));
}

#[test]
fn an_overload_makes_the_motor_passive() {
    for motor in FAMILIES {
        let stops = PositionRange::new(Position(-500.0), Position(500.0));
        let mut bench = Bench::motor_with(motor, |plant| plant.stops = stops);
        bench.write(&[(V_SOLL, 1000), (MODE, 1)]);
        bench.run(500);
        let load = bench.register(16);
        assert!(load > 0 && load < bench.register(17), "{motor}: I2T is {load}");
        bench.run_until(|b| b.register(ERR_STAT) & 1 != 0);
        assert_eq!(bench.register(MODE), 0);
        bench.run(20_000);
        assert_eq!(bench.register(16), 0, "it has cooled down");
    }
}

#[test]
fn a_low_supply_does_what_uv_handle_says() {
    let dip = |motor: &str, handle: u8, number: i64, volts: f64| {
        let mut bench = Bench::motor(motor);
        bench.write(&[(handle, number), (V_SOLL, 1600), (A_SOLL, 300), (MODE, 1)]);
        if motor == "mac140" {
            bench.write(&[(152, 300)]);
        }
        bench.run(300);
        bench.plant().inject(axis::PlantFault::SupplyDip(Voltage(volts)));
        bench.run(1500);
        bench
    };
    let small = |number| dip("mac140", 160, number, 28.0);
    let large = |number| dip("mac800", 23, number, 240.0);
    let bench = small(0);
    assert_eq!(bench.register(151), 280, "U_SUPPLY in tenths of a volt");
    assert_eq!((bench.register(MODE), bench.register(ERR_STAT) & 1 << 12), (1, 0));
    assert_ne!(bench.register(ERR_STAT) & 1 << 13, 0, "UV_DETECT");
    let bench = small(1);
    assert_eq!(bench.register(MODE), 1, "an error bit alone");
    assert_ne!(bench.register(ERR_STAT) & 1 << 12, 0);
    assert_eq!(small(2).register(MODE), 0);
    let bench = small(8);
    assert_eq!((bench.register(MODE), bench.register(V_SOLL), bench.register(V_IST)), (1, 0, 0));
    let bench = large(1);
    assert_eq!((bench.register(MODE), bench.register(ERR_STAT) >> 9 & 1), (1, 1));
    assert_eq!(bench.register(198), 270, "U_BUS");
    let bench = large(2);
    assert_eq!((bench.register(MODE), bench.register(V_IST)), (0, 0));
    let bench = large(4);
    assert_eq!((bench.register(MODE), bench.register(V_SOLL), bench.register(V_IST)), (1, 0, 0));
}

#[test]
fn a_hot_drive_becomes_passive() {
    let mut bench = Bench::motor("mac800");
    assert_eq!(bench.register(29), 205, "25 degrees");
    bench.write(&[(31, 200), (MODE, 1)]);
    bench.run(20);
    assert_eq!((bench.register(MODE), bench.register(ERR_STAT) >> 8 & 1), (0, 1));
}

#[test]
fn in_position_lasts_inposcnt_samples() {
    let mut bench = Bench::motor("mac800");
    bench.write(&[(33, 50), (34, 100), (P_SOLL, 2000), (A_SOLL, 500), (V_SOLL, 3000), (MODE, 2)]);
    bench.run_until(|b| (b.register(P_IST) - 2000).abs() < 50);
    let near = bench.now;
    bench.run_until(in_position);
    let after = bench.now.saturating_since(near);
    assert!(after >= Duration::from_millis(125) && after < Duration::from_millis(140), "{after:?}");
    bench.fastmac(0x67);
    assert!(!in_position(&bench), "reset, and to be reached anew");
    bench.run(200);
    assert!(in_position(&bench));
}

#[test]
fn acceleration_and_deceleration_are_shown() {
    let flags = |bench: &Bench| bench.register(ERR_STAT) >> 5 & 0b11;
    let mut bench = Bench::motor("mac140");
    bench.write(&[(A_SOLL, 20), (V_SOLL, -2000), (MODE, 1)]);
    bench.run(50);
    assert_eq!(flags(&bench), 0b01, "the speed rises");
    bench.run(1000);
    assert_eq!(flags(&bench), 0);
    bench.write(&[(V_SOLL, 0)]);
    bench.run(50);
    assert_eq!(flags(&bench), 0b10);
    let mut bench = Bench::motor("mac800");
    bench.write(&[(A_SOLL, 20), (V_SOLL, -2000), (MODE, 1)]);
    bench.run(50);
    assert_eq!(flags(&bench), 0b10, "the velocity falls");
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

#[test]
fn every_motor_runs_at_the_speed_of_its_family() {
    // Counts a turn, V_SOLL of 600 RPM, V_IST then.
    let small = (4096.0, 1258, 79);
    let motors = [
        ("mac050", small),
        ("mac095", small),
        ("mac140", small),
        ("mac141", small),
        ("mac400", (8192.0, 1702, 106)),
        ("mac800", (8000.0, 1662, 104)),
        ("mac1500", (8192.0, 1702, 106)),
        ("mac3000", (8192.0, 1702, 106)),
    ];
    for (motor, (counts, v_soll, v_ist)) in motors {
        let mut bench = Bench::motor(motor);
        bench.write(&[(V_SOLL, v_soll), (A_SOLL, 100), (MODE, 1)]);
        bench.run(1000);
        let rpm = bench.get(0x606C) as f64 / counts * 60.0;
        assert!((rpm - 600.0).abs() < 1.5, "{motor}: {rpm}");
        assert!((bench.register(V_IST) - v_ist).abs() <= 1, "{motor}: {}", bench.register(V_IST));
        bench.write(&[(A_SOLL, 4), (V_SOLL, -v_soll)]);
        bench.run(50);
        let early = bench.get(0x606B) as f64 / counts * 60.0;
        bench.run(150);
        let late = bench.get(0x606B) as f64 / counts * 60.0;
        let slope = (early - late) / 0.15;
        let unit = if motor == "mac800" {
            277.92
        } else if counts < 5000.0 {
            248.35
        } else {
            271.41
        };
        assert!((slope - 4.0 * unit).abs() < 25.0, "{motor}: {slope}");
    }
}

#[test]
fn a_motor_that_cools_down_sleeps_but_for_a_look_ten_times_a_second() {
    let stops = PositionRange::new(Position(-500.0), Position(500.0));
    let mut bench = Bench::motor_with("mac140", |plant| plant.stops = stops);
    bench.write(&[(V_SOLL, 1000), (MODE, 1)]);
    bench.run(500);
    bench.write(&[(MODE, 0)]);
    bench.run(3000);
    let warm = bench.register(16);
    assert!(warm > 0 && bench.device.is_quiet());
    let next = bench.device.poll_timeout().expect("it is warm");
    assert!(next.saturating_since(bench.now) <= Duration::from_millis(100));
    bench.run(200);
    assert!(bench.register(16) < warm);
    // An order does not wait for the next look.
    bench.write(&[(MODE, 2)]);
    let next = bench.device.poll_timeout().expect("it is on");
    assert!(next.saturating_since(bench.now) <= Duration::from_millis(2));
    bench.write(&[(MODE, 0)]);
    bench.run(3 * 3_600_000);
    assert_eq!((bench.device.poll_timeout(), bench.register(16)), (None, 0), "cold and asleep");
}
