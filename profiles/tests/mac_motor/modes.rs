//! What MODE_REG chooses, but for the modes that follow a signal or search.

use crate::bench::Bench;
use crate::motor::{A_SOLL, FAMILIES, MODE, P_IST, P_SOLL, T_SOLL, V_IST, V_SOLL, go, torque};

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
