//! Moves to places and at speeds, with the examples of the manual, and what the motor shows of them.

use std::time::Duration;

use crate::bench::Bench;
use crate::motor::{
    A_SOLL, CNTRL_BITS, ERR_STAT, FAMILIES, MODE, P_FNC, P_IST, P_SOLL, T_SOLL, V_IST, V_SOLL, arrive, go,
    in_position, p_new,
};

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
