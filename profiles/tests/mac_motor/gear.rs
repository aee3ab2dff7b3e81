//! The modes that follow an external encoder.

use axis::{Velocity, Voltage};

use crate::bench::Bench;
use crate::motor::{A_SOLL, FAMILIES, MODE, P_IST, V_SOLL, in_position};

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
