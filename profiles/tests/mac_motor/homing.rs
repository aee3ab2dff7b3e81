//! The zero searches.

use axis::{Position, PositionRange};

use crate::bench::Bench;
use crate::motor::{A_SOLL, FAMILIES, MODE, P_IST, P_SOLL, V_SOLL, arrive};

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
