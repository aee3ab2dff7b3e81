//! Limits and errors, and what the motor does about them.

use std::time::Duration;

use axis::{Position, PositionRange, Velocity, Voltage};
use profiles::{DeviceEvent, State};

use crate::bench::Bench;
use crate::motor::{A_SOLL, ERR_STAT, FAMILIES, MODE, P_IST, P_SOLL, T_SOLL, V_IST, V_SOLL, go};

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
