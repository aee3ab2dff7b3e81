//! Commands to a MAC motor, by whatever way they come: 0x2013, the motor's command register, that of the module. And
//! what storing and resetting does.

mod bench;

use bench::Bench;
use od::AbortCode;
use profiles::{DeviceEvent, Keep, Space, State, StoreOrder};

const MODE: u8 = 2;
const P_SOLL: u8 = 3;
const V_SOLL: u8 = 5;
const A_SOLL: u8 = 6;
const P_IST: u8 = 10;
const STARTMODE: u8 = 37;
const COMMAND: u8 = 211;

const FAMILIES: [&str; 2] = ["mac140", "mac800"];

/// Every register, after a motor on the move has got a command.
fn after(motor: &str, command: impl Fn(&mut Bench)) -> Vec<i32> {
    let mut bench = Bench::motor(motor);
    bench.write(&[(61, 1500), (63, -700), (51, 4000), (65, 900), (66, 1100), (73, 44), (74, 55)]);
    bench.write(&[(77, 700), (78, 800), (42, 25 << 8), (A_SOLL, 200), (V_SOLL, 1000), (P_SOLL, 6000)]);
    bench.write(&[(if motor == "mac140" { 163 } else { 4 }, 333), (MODE, 2)]);
    bench.run(100);
    command(&mut bench);
    bench.run(100);
    let not_the_command = (1..=254).filter(|number| *number != COMMAND);
    not_the_command.map(|number| bench.register(number)).collect()
}

#[test]
fn a_fastmac_command_does_the_same_by_all_ways() {
    for motor in FAMILIES {
        let none = after(motor, |_| {});
        let mut acting = 0;
        for number in 96..=127_u32 {
            let fastmac = after(motor, |bench| bench.fastmac(number.into()));
            let motor_register = after(motor, |bench| bench.write(&[(COMMAND, (number | 0x80).into())]));
            let module = after(motor, |bench| bench.command_module(0x8000_0080 | number).unwrap());
            assert_eq!(fastmac, motor_register, "{motor} {number}");
            assert_eq!(fastmac, module, "{motor} {number}");
            acting += u32::from(fastmac != none);
        }
        assert!(acting >= 15, "{motor}: only {acting} commands do anything");
    }
}

#[test]
fn numbers_that_are_no_command_do_nothing() {
    for motor in FAMILIES {
        let none = after(motor, |_| {});
        for number in [0, 1, 2, 16, 95] {
            assert_eq!(after(motor, |bench| bench.fastmac(number)), none, "{motor} {number}");
        }
        for number in [0, 3, 95, 127, 128, 223, 256, 0x10000] {
            assert_eq!(after(motor, |bench| bench.write(&[(COMMAND, number)])), none, "{motor} {number}");
        }
        for number in [0, 1, 0x11, 0x13, 0x14, 0x60, 0xF1, 0x8000_0060, 0x8000_010B] {
            assert_eq!(
                after(motor, |bench| bench.command_module(number).unwrap()),
                none,
                "{motor} {number:X}"
            );
        }
    }
}

#[test]
fn a_command_that_is_held_in_the_module_acts_once_and_again_after_a_zero() {
    let mut bench = Bench::motor("mac140");
    bench.write(&[(61, 1000), (P_IST, 50)]);
    let p_soll = |bench: &mut Bench, command| {
        bench.command_module(command).unwrap();
        bench.register(P_SOLL)
    };
    assert_eq!(p_soll(&mut bench, 0x8000_00F1), 1050);
    bench.write(&[(P_SOLL, 7)]);
    assert_eq!(p_soll(&mut bench, 0x8000_00F1), 7, "held");
    assert_eq!(p_soll(&mut bench, 0), 7);
    assert_eq!(p_soll(&mut bench, 0x8000_00F1), 1050);
}

#[test]
fn the_command_register_reads_zero_afterwards() {
    let mut bench = Bench::motor("mac800");
    bench.write(&[(COMMAND, 0xE5)]);
    assert_eq!((bench.register(COMMAND), bench.register(V_SOLL)), (0, 0));
}

#[test]
fn extended_registers_are_written_and_read_through_230_and_231() {
    const XREG_ADDR: u8 = 230;
    const XREG_DATA: u8 = 231;
    let mut bench = Bench::motor("mac800");
    let extended = |bench: &Bench, number: u16| {
        let registers = &bench.device.profile().registers;
        registers.read_number(bench.device.dictionary(), number)
    };
    bench.write(&[(XREG_DATA, -70_000), (XREG_ADDR, 5)]);
    assert_eq!((extended(&bench, 260), bench.register(XREG_ADDR)), (Some(-70_000), 0));
    bench.write(&[(XREG_DATA, 1), (XREG_ADDR, 254)]);
    assert_eq!(extended(&bench, 509), Some(1));
    bench.write(&[(XREG_ADDR, -5)]);
    assert_eq!((bench.register(XREG_DATA), bench.register(XREG_ADDR)), (-70_000, 0));
    // There are none beyond.
    for number in [255, -255, i64::from(i32::MAX), i64::from(i32::MIN), 0] {
        bench.write(&[(XREG_ADDR, number)]);
        assert_eq!((bench.register(XREG_DATA), bench.register(XREG_ADDR)), (-70_000, 0), "{number}");
    }
}

/// Stores what the device wants, as the core does.
fn store(bench: &mut Bench) -> Vec<StoreOrder> {
    let mut orders = Vec::new();
    while let Some(event) = bench.device.poll_event() {
        let DeviceEvent::Store(order) = event else { continue };
        let saved = bench.device.to_store(order);
        assert_eq!(bench.device.dictionary_mut().set_saved(saved), 0);
        bench.device.stored(bench.now, true);
        orders.push(order);
    }
    orders
}

const PRESENT: StoreOrder = StoreOrder { space: Space::Motor, keep: Keep::Present };

#[test]
fn a_reset_forgets_what_was_not_saved() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        let before = bench.register(V_SOLL);
        bench.write(&[(V_SOLL, 999), (MODE, 1)]);
        bench.run(200);
        bench.write(&[(COMMAND, 1)]);
        assert_eq!((bench.register(V_SOLL), bench.register(MODE)), (before, 0), "{motor}");
        bench.run(10_000);
        assert_eq!(bench.register(12), 0, "the motor has coasted");
        assert!(store(&mut bench).is_empty());
    }
}

#[test]
fn save_and_reset_keeps_the_registers_and_starts_in_the_start_mode() {
    for (motor, by_module) in [("mac140", false), ("mac800", true)] {
        let mut bench = Bench::motor(motor);
        bench.write(&[(V_SOLL, 700), (STARTMODE, 1), (61, 123_456)]);
        bench.set(0x6085, 77_777);
        if by_module {
            bench.command_module(0x8000_0002).unwrap();
        } else {
            bench.write(&[(COMMAND, 2)]);
        }
        bench.write(&[(V_SOLL, 1)]);
        assert_eq!(store(&mut bench), [PRESENT]);
        // What was written before it was stored is stored, and it has taken effect.
        assert_eq!((bench.register(V_SOLL), bench.register(61)), (1, 123_456));
        bench.run(300);
        assert_eq!(bench.register(MODE), 1, "{motor}: the start mode");
        bench.write(&[(V_SOLL, 700)]);
        bench.run(300);
        assert!(bench.register(12) > 40);
        // Power off and on: the registers are there, the objects of the drive are not.
        bench.device.reset(bench.now);
        assert_eq!((bench.register(V_SOLL), bench.register(61)), (1, 123_456));
        assert_ne!(bench.get(0x6085), 77_777);
        bench.run(300);
        assert_eq!(bench.register(MODE), 1);
    }
}

#[test]
fn a_store_that_fails_resets_nothing() {
    let mut bench = Bench::motor("mac140");
    bench.write(&[(V_SOLL, 700), (COMMAND, 2)]);
    assert_eq!(bench.device.poll_event(), Some(DeviceEvent::Store(PRESENT)));
    bench.write(&[(MODE, 1)]);
    bench.run(100);
    bench.device.stored(bench.now, false);
    assert_eq!((bench.register(MODE), bench.register(V_SOLL)), (1, 700));
    bench.device.reset(bench.now);
    assert_ne!(bench.register(V_SOLL), 700);
}

#[test]
fn orders_to_store_wait_for_each_other_and_equal_ones_are_one() {
    let mut bench = Bench::motor("mac140");
    for command in [0x110, 0x10, 0x110, 0x12, 0, 0x12] {
        bench.command_module(command).unwrap();
    }
    let module = |keep| StoreOrder { space: Space::Module, keep };
    assert_eq!(store(&mut bench), [PRESENT, module(Keep::Present), PRESENT, module(Keep::Defaults)]);
}

#[test]
fn the_module_keeps_its_registers_apart_from_those_of_the_motor() {
    let mut bench = Bench::motor("mac140");
    bench.write(&[(V_SOLL, 700)]);
    bench.set_sub(0x2011, 7, 0x30);
    bench.command_module(0x10).unwrap();
    store(&mut bench);
    bench.device.reset(bench.now);
    assert_ne!(bench.register(V_SOLL), 700);
    bench.write(&[(V_SOLL, 700)]);
    bench.command_module(0x110).unwrap();
    store(&mut bench);
    bench.device.reset(bench.now);
    assert_eq!(bench.register(V_SOLL), 700);
}

#[test]
fn a_zero_search_at_power_on() {
    let stops = axis::PositionRange::new(axis::Position(-3000.0), axis::Position(1e6));
    let mut bench = Bench::motor_with("mac800", |plant| plant.stops = stops);
    bench.write(&[(42, 12), (40, -300), (41, 100), (38, -1000), (STARTMODE, 2), (COMMAND, 2)]);
    store(&mut bench);
    bench.run(30);
    assert_eq!(bench.register(MODE), 12);
    bench.run_until(|b| b.register(MODE) == 2);
    bench.run(500);
    assert!(bench.register(P_IST).abs() <= 4);
    assert_eq!(bench.register(42) >> 16, 1);
    // With bits 15 to 8 all set it starts passive.
    bench.write(&[(42, 0xFF << 8), (COMMAND, 2)]);
    store(&mut bench);
    bench.run(100);
    assert_eq!((bench.register(MODE), bench.register(42) >> 16), (0, 0));
}

#[test]
fn cia_402_takes_the_axis_over_from_a_mode() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(A_SOLL, 300), (V_SOLL, 1600), (MODE, 1)]);
        bench.run(300);
        bench.set(0x6060, 3);
        bench.batch(&[(0x6081, 0, 50_000), (0x60FF, 0, 20_000), (0x6083, 0, 200_000)]).unwrap();
        // Up to SWITCHED ON the mode goes on.
        for word in [0x06, 0x07] {
            bench.control(word);
            bench.run(100);
            assert_eq!(bench.register(MODE), 1, "{motor}");
            assert!((bench.register(12) - 100).abs() <= 1, "{motor}: {}", bench.register(12));
        }
        bench.control(0x0F);
        bench.run(500);
        assert_eq!(bench.state(), State::OperationEnabled);
        assert!((bench.velocity() - 20_000).abs() < 600, "{motor}: {}", bench.velocity());
        assert_eq!(bench.register(MODE), 1, "what the module sets for profile velocity");
        bench.set(0x6060, 1);
        bench.control(0x07);
        bench.run(2000);
        assert_eq!(bench.register(MODE), 0, "{motor}: disabled is passive");
        bench.control(0x0F);
        bench.run(100);
        assert_eq!(bench.register(MODE), 2);
    }
}

#[test]
fn what_moves_the_motor_is_refused_while_cia_402_operates() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.enable(1);
        let refused = Err(AbortCode::DeviceState);
        for mode in [0, 1, 2, 12] {
            assert_eq!(bench.batch(&[(0x2012, MODE, mode)]), refused);
        }
        for command in [1, 2, 0xF0] {
            assert_eq!(bench.batch(&[(0x2012, COMMAND, command)]), refused, "{command}");
            assert_eq!(bench.command_module(0x8000_0000 | command as u32), refused);
        }
        assert_eq!(bench.batch(&[(0x2013, 0, 0x70)]), refused);
        assert_eq!(bench.command_module(0x101), refused);
        // As part of an RPDO the whole of it has no effect.
        assert_eq!(bench.batch(&[(0x2012, V_SOLL, 5), (0x2012, MODE, 1)]), refused);
        assert_ne!(bench.register(V_SOLL), 5);
        // What moves nothing is taken.
        bench.write(&[(V_SOLL, 6), (A_SOLL, 7), (43, 1)]);
        bench.fastmac(0x6C);
        bench.command_module(0x8000_00E5).unwrap();
        assert_eq!(bench.state(), State::OperationEnabled);
        // In QUICK STOP ACTIVE, too; and no longer once the drive is disabled.
        bench.set(0x605A, 6);
        bench.control(0x02);
        assert_eq!(bench.state(), State::QuickStopActive);
        assert_eq!(bench.batch(&[(0x2012, MODE, 1)]), refused);
        bench.control(0x00);
        bench.run(10);
        bench.write(&[(MODE, 1)]);
        bench.run(50);
        assert_eq!(bench.register(MODE), 1, "{motor}");
    }
}

#[test]
fn hardware_inputs_do_not_take_the_axis_from_cia_402() {
    let mut bench = Bench::motor("mac800");
    // Mode 1 whatever the input is.
    bench.write(&[(89, 1), (93, 0x0001_0101)]);
    bench.run(50);
    assert_eq!(bench.register(MODE), 1);
    bench.set(0x6060, 1);
    for word in [0x06, 0x07, 0x0F] {
        bench.control(word);
    }
    bench.run_until(|b| b.state() == State::OperationEnabled);
    bench.run(3000);
    assert_eq!((bench.register(MODE), bench.register(12)), (2, 0));
}

#[test]
fn a_lost_connection_ends_a_mode_as_0x6007_says() {
    // Option code, error action of the module; the mode after it, and the state of the drive.
    let cases = [
        (0, 0, 1, State::SwitchOnDisabled),
        (1, 0, 0, State::Fault),
        (1, 0x40, 0, State::Fault),
        (2, 0, 0, State::SwitchOnDisabled),
        (3, 0, 0, State::SwitchOnDisabled),
        (3, 0x40, 10, State::SwitchOnDisabled),
    ];
    for motor in FAMILIES {
        for (option, action, mode, state) in cases {
            let mut bench = Bench::motor(motor);
            bench.set(0x6007, option);
            bench.set_sub(0x2011, 8, action);
            bench.write(&[(A_SOLL, 300), (V_SOLL, 1600), (MODE, 1)]);
            bench.run(300);
            bench.device.connection_lost(bench.now);
            bench.run(20_000);
            let expected = (mode, state);
            assert_eq!((bench.register(MODE), bench.state()), expected, "{motor} {option} {action:X}");
            assert_eq!(bench.register(12) != 0, option == 0, "{motor} {option}");
        }
    }
}

#[test]
fn a_limit_switch_that_acts_stops_a_mode() {
    let mut bench = Bench::motor_with("mac800", |plant| plant.positive_switch = Some(axis::Position(5000.0)));
    bench.set_sub(0x2011, 7, 0x20);
    bench.write(&[(A_SOLL, 300), (V_SOLL, 800), (MODE, 1)]);
    bench.run(3000);
    assert_eq!((bench.state(), bench.register(MODE), bench.register(12)), (State::Fault, 0, 0));
    assert_eq!(bench.get(0x603F), 0x1002);
    // FastMac resets errors of the motor only; the module has its own command for this one.
    bench.fastmac(0x61);
    bench.run(20);
    assert_eq!(bench.state(), State::Fault);
    bench.set(0x2010, 1);
    bench.run(20);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
}

#[test]
fn a_shut_down_ramps_a_mode_down_and_ends_all_obedience() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(A_SOLL, 300), (V_SOLL, 1600), (MODE, 1)]);
        bench.run(300);
        bench.device.shut_down(bench.now);
        bench.run(10);
        assert!(bench.register(12) > 0, "{motor}: no jump");
        bench.run(500);
        assert!(bench.device.is_quiet(), "{motor}");
        bench.write(&[(MODE, 1)]);
        bench.run(300);
        assert_eq!((bench.register(MODE), bench.register(12)), (0, 0));
    }
}

#[test]
fn a_motor_that_is_still_braking_when_its_time_is_over_loses_its_power_for_good() {
    for motor in FAMILIES {
        let mut bench = Bench::motor(motor);
        bench.write(&[(A_SOLL, 300), (V_SOLL, 1600), (MODE, 1)]);
        bench.run(300);
        bench.device.shut_down(bench.now);
        bench.run(2);
        let before = bench.register(12);
        bench.device.cut_power(bench.now);
        bench.run(2);
        assert!(bench.register(12) > before * 9 / 10, "{motor}: it coasts, {before}");
        bench.write(&[(MODE, 1)]);
        bench.run(5000);
        assert_eq!((bench.register(12), bench.device.is_quiet()), (0, true), "{motor}");
    }
}

#[test]
fn a_fault_of_the_drive_is_an_error_of_the_motor_and_both_are_reset_by_either() {
    for (motor, bit, by_drive) in
        [("mac140", 11, false), ("mac140", 11, true), ("mac800", 12, false), ("mac800", 12, true)]
    {
        let mut bench = Bench::motor(motor);
        bench.write(&[(V_SOLL, 500), (MODE, 1)]);
        bench.run(100);
        bench.plant().inject(axis::PlantFault::DriveFault(axis::DriveFault::OverCurrent));
        bench.run(10);
        assert_eq!((bench.register(MODE), bench.register(35) >> bit & 1), (0, 1), "{motor}");
        assert_eq!(bench.state(), State::Fault);
        bench.plant().clear(axis::PlantFault::DriveFault(axis::DriveFault::OverCurrent));
        if by_drive {
            bench.control(0x80);
        } else {
            bench.write(&[(35, 0)]);
        }
        bench.run(10);
        assert_eq!((bench.state(), bench.register(35) >> bit & 1), (State::SwitchOnDisabled, 0), "{motor}");
        bench.write(&[(MODE, 1)]);
        bench.run(300);
        assert!(bench.register(12) > 10);
    }
}
