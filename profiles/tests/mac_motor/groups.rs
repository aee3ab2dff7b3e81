//! The groups of registers: positions, velocities, accelerations and torques that a command activates.

use crate::bench::Bench;
use crate::motor::{A_SOLL, FAMILIES, MODE, P_IST, P_SOLL, T_SOLL, V_SOLL, arrive};

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
