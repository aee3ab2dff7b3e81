//! Faults: each by the condition in the plant that raises it, told once, gone once (IEC 61800-7-201, 0x603F).

mod bench;

use axis::{DriveFault, Input, Load, PlantFault, Voltage};
use bench::Bench;
use profiles::{DeviceEvent, State};

const SERVO: &str = "cia402-servo";
const JVL: &str = "jvl-mac00-fc4";

/// Bits of 0x1001 (CiA 301 v4.2, section 7.5.2.2).
const CURRENT: u8 = 1 << 1;
const VOLTAGE: u8 = 1 << 2;
const TEMPERATURE: u8 = 1 << 3;
const COMMUNICATION: u8 = 1 << 4;
const PROFILE: u8 = 1 << 5;

fn running(profile: &str) -> Bench {
    let mut bench = Bench::new(profile);
    bench.fast_profile();
    bench.enable(3);
    bench.set(0x60FF, 20_000);
    bench.run_until(|b| (b.velocity() - 20_000).abs() < 200);
    bench
}

/// Waits for FAULT: 0x603F and the EMCY must say `code` and `register`, once.
fn assert_fault(bench: &mut Bench, code: u16, register: u8) {
    assert_fault_with(bench, code, register, [0; 5]);
}

/// The same with `detail` in the EMCY.
fn assert_fault_with(bench: &mut Bench, code: u16, register: u8, detail: [u8; 5]) {
    bench.run_until(|b| b.state() == State::Fault);
    assert_eq!(bench.get(0x603F), i64::from(code));
    assert_eq!(bench.statusword() & 0x4F, 0x08);
    bench.run(200);
    let events = bench.events();
    let [DeviceEvent::Raised(fault)] = events.as_slice() else { panic!("{events:?}") };
    assert_eq!((fault.code, fault.register, fault.detail), (code, register, detail));
}

/// The cause is gone: the reset works and is told once.
fn assert_reset(bench: &mut Bench, code: u16) {
    bench.run(10);
    bench.control(0x00);
    bench.control(0x80);
    bench.run(5);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    assert_eq!(bench.get(0x603F), 0);
    bench.run(200);
    assert_eq!(bench.events(), [DeviceEvent::Cleared(code)]);
}

#[test]
fn each_fault_of_the_power_electronics_has_its_code_and_cuts_the_power() {
    let table = [
        (DriveFault::OverCurrent, 0x2310, CURRENT),
        (DriveFault::OverVoltage, 0x3210, VOLTAGE),
        (DriveFault::UnderVoltage, 0x3220, VOLTAGE),
        (DriveFault::OverTemperature, 0x4310, TEMPERATURE),
        (DriveFault::Overload, 0x2350, CURRENT),
        (DriveFault::Encoder, 0x7305, 0),
        (DriveFault::SafeTorqueOff, 0x5441, 0),
        (DriveFault::Internal, 0x5000, 0),
    ];
    for (cause, code, register) in table {
        let mut bench = running(SERVO);
        bench.plant().inject(PlantFault::DriveFault(cause));
        bench.run(2);
        assert_eq!((bench.state(), bench.get(0x6077)), (State::Fault, 0), "{cause:?}: no ramp");
        assert!(bench.velocity() > 15_000, "{cause:?}: it coasts");
        assert_fault(&mut bench, code, register);
        bench.plant().clear(PlantFault::DriveFault(cause));
        assert_reset(&mut bench, code);
    }
}

#[test]
fn a_fault_whose_cause_lasts_cannot_be_reset() {
    let mut bench = running(SERVO);
    bench.plant().inject(PlantFault::SupplyDip(Voltage(5.0)));
    assert_fault(&mut bench, 0x3220, VOLTAGE);
    bench.run(3_000);
    bench.control(0x80);
    bench.run(10);
    assert_eq!((bench.state(), bench.get(0x603F)), (State::Fault, 0x3220));
    assert_eq!(bench.events(), [], "nothing has come or gone");
    bench.plant().clear(PlantFault::SupplyDip(Voltage(0.0)));
    assert_reset(&mut bench, 0x3220);
}

#[test]
fn a_second_reset_before_the_next_raster_step_does_not_reset_a_fault_whose_cause_lasts() {
    let mut bench = running(SERVO);
    bench.plant().inject(PlantFault::DriveFault(DriveFault::OverCurrent));
    assert_fault(&mut bench, 0x2310, CURRENT);
    for word in [0x80, 0x00, 0x80] {
        bench.control(word);
    }
    bench.run(10);
    assert_eq!((bench.state(), bench.events()), (State::Fault, vec![]));
}

#[test]
fn a_reset_that_brings_another_cause_to_light_tells_that_one() {
    let mut bench = running(SERVO);
    bench.plant().inject(PlantFault::DriveFault(DriveFault::OverCurrent));
    assert_fault(&mut bench, 0x2310, CURRENT);
    bench.plant().inject(PlantFault::StuckSwitch(Input::EmergencyStop, true));
    bench.plant().clear(PlantFault::DriveFault(DriveFault::OverCurrent));
    bench.run(10);
    bench.control(0x80);
    bench.run(10);
    assert_eq!((bench.state(), bench.get(0x603F)), (State::Fault, 0x9000));
    let events = bench.events();
    let [DeviceEvent::Cleared(0x2310), DeviceEvent::Raised(fault)] = events.as_slice() else {
        panic!("{events:?}")
    };
    assert_eq!(fault.code, 0x9000);
}

#[test]
fn a_broken_encoder_is_a_fault_that_coasts_whatever_0x605e_says() {
    let mut bench = running(SERVO);
    bench.set(0x605E, 1);
    bench.plant().inject(PlantFault::EncoderBreak);
    bench.run(2);
    assert_eq!((bench.state(), bench.get(0x6077)), (State::Fault, 0));
    assert_fault(&mut bench, 0x7305, 0);
}

#[test]
fn an_emergency_stop_is_a_fault_that_coasts_whatever_0x605e_says() {
    let mut bench = running(SERVO);
    bench.set(0x605E, 1);
    bench.plant().inject(PlantFault::StuckSwitch(Input::EmergencyStop, true));
    bench.run(2);
    assert_eq!((bench.state(), bench.get(0x6077)), (State::Fault, 0));
    assert!(bench.get(0x60FD) >> 3 & 1 == 1, "the interlock");
    assert_fault(&mut bench, 0x9000, 0);
    bench.control(0x80);
    bench.run(10);
    assert_eq!(bench.state(), State::Fault, "the button is still pressed");
    bench.plant().clear(PlantFault::StuckSwitch(Input::EmergencyStop, true));
    assert_reset(&mut bench, 0x9000);
}

#[test]
fn an_axis_that_is_blocked_strays_from_its_demand() {
    let mut bench = running(SERVO);
    bench.plant().inject(PlantFault::BlockedShaft);
    assert_fault(&mut bench, 0x8611, PROFILE);
    assert_reset(&mut bench, 0x8611);
}

#[test]
fn pushing_against_a_block_for_too_long_is_an_overload_after_a_warning() {
    let mut bench = running(SERVO);
    bench.set(0x6065, 0xFFFF_FFFF);
    bench.set(0x6072, 2_000);
    bench.plant().inject(PlantFault::BlockedShaft);
    bench.run(2_200);
    assert!(!bench.is_set(7), "twice the rated torque may last for 3 s");
    bench.run(600);
    assert!(bench.is_set(7) && bench.state() == State::OperationEnabled, "a warning above 80 %");
    bench.run(400);
    assert_fault(&mut bench, 0x2350, CURRENT);
    assert!(!bench.is_set(7));
    bench.run(3_000);
    assert_reset(&mut bench, 0x2350);
    assert_eq!(bench.device.poll_timeout(), None, "a warm motor may sleep");
    bench.run(20_000);
    bench.enable(3);
    bench.run(2_200);
    assert!(!bench.is_set(7), "it has recovered while it slept");
    assert_eq!(bench.get(0x6077).abs(), 2_000);
}

#[test]
fn braking_a_heavy_load_is_an_over_voltage_but_the_default_load_is_not() {
    for (times, is_fault) in [(1.0, false), (10.0, true)] {
        let mut bench = Bench::new(SERVO);
        let inertia_kgm2 = times * 5.0e-5;
        bench.plant().set_load(Load { inertia_kgm2, ..Load::default() });
        bench.set(0x6065, 0xFFFF_FFFF);
        bench.enable(3);
        bench.batch(&[(0x6083, 0, 2_000_000), (0x6085, 0, 8_000_000), (0x60FF, 0, 200_000)]).unwrap();
        bench.run_until(|b| b.velocity() > 199_000);
        bench.run(500);
        bench.control(0x02);
        bench.run(2_000);
        let expected = if is_fault { State::Fault } else { State::SwitchOnDisabled };
        assert_eq!(bench.state(), expected, "{times}");
        assert_eq!(bench.get(0x603F), if is_fault { 0x3210 } else { 0 });
    }
}

#[test]
fn a_load_that_drives_the_motor_too_fast_is_an_over_speed() {
    let mut bench = Bench::new(SERVO);
    bench.batch(&[(0x6065, 0, 0xFFFF_FFFF), (0x6080, 0, 500)]).unwrap();
    bench.enable(3);
    bench.set(0x6072, 0);
    bench.plant().set_load(Load { inertia_kgm2: 5.0e-5, gravity_nm: -0.5, ..Load::default() });
    bench.run_until(|b| b.is_set(3));
    // 500 r/min are 34,133 counts/s.
    assert!((37_500..43_000).contains(&bench.velocity().abs()), "{}", bench.velocity());
    bench.plant().set_load(Load::default());
    bench.set(0x6072, 3_000);
    assert_fault(&mut bench, 0x8400, PROFILE);
    assert_reset(&mut bench, 0x8400);
}

#[test]
fn lowering_the_highest_speed_on_the_move_is_no_over_speed() {
    let mut bench = running(SERVO);
    bench.set(0x6080, 60);
    bench.run(2_000);
    assert_eq!(bench.state(), State::OperationEnabled);
    assert!((bench.velocity() - 4_096).abs() < 100, "{}", bench.velocity());
}

#[test]
fn a_following_error_of_more_than_half_the_window_is_a_warning() {
    let mut bench = running(SERVO);
    bench.set(0x60FF, 0);
    bench.run(500);
    bench.batch(&[(0x6065, 0, 1_000), (0x6072, 0, 0)]).unwrap();
    bench.plant().set_load(Load { inertia_kgm2: 5.0e-5, gravity_nm: -0.05, ..Load::default() });
    bench.run_until(|b| b.get(0x60F4).abs() > 450);
    let mut warned = false;
    while bench.state() == State::OperationEnabled {
        let error = bench.get(0x60F4).abs();
        assert_eq!(bench.is_set(7), error > 500, "{error}");
        warned |= bench.is_set(7);
        bench.run(1);
    }
    assert!(warned);
    assert_eq!(bench.get(0x603F), 0x8611);
}

#[test]
fn a_limit_switch_stops_a_drive_and_is_no_fault() {
    let mut bench = running(SERVO);
    let from = bench.position() + 5_000;
    let cam = axis::PositionRange::new(axis::Position(from as f64), axis::Position(f64::INFINITY));
    bench.plant().set_cam(Input::PositiveLimit, cam);
    bench.run(1_000);
    assert_eq!((bench.state(), bench.velocity()), (State::OperationEnabled, 0));
    assert!(bench.is_set(11), "internal limit active");
    assert_eq!(bench.get(0x60FD) & 0b111, 0b010);
    // 20,000 counts/s by 200,000 counts/s^2, the quick stop ramp.
    assert!((from..from + 1_100).contains(&bench.position()), "{}", bench.position() - from);
    bench.set(0x60FF, -20_000);
    bench.run(100);
    assert!(bench.velocity() < -5_000 && !bench.is_set(11));
    assert_eq!(bench.events(), []);
}

#[test]
fn a_limit_switch_is_an_error_of_jvls_module_where_it_is_enabled() {
    for (setup, bits, is_error) in [(0x00, 0x00, false), (0x20, 0x00, true), (0x20, 0x40, true)] {
        let mut bench = running(JVL);
        bench.batch(&[(0x2011, 7, setup), (0x2011, 8, bits)]).unwrap();
        let from = bench.position() + 5_000;
        let cam = axis::PositionRange::new(axis::Position(from as f64), axis::Position(f64::INFINITY));
        bench.plant().set_cam(Input::PositiveLimit, cam);
        bench.run(300);
        assert_eq!(bench.get_sub(0x2011, 1), 0x20, "the input is seen at any rate");
        if !is_error {
            assert_eq!((bench.state(), bench.get(0x603F)), (State::OperationEnabled, 0));
            continue;
        }
        assert_eq!(bench.state() == State::FaultReactionActive, bits == 0x40, "passive, or a stop first");
        assert_fault(&mut bench, 0x1002, 0);
        assert_eq!(bench.get_sub(0x2011, 3) & 0b101, 0b100, "limit switch error");
        assert_reset(&mut bench, 0x1002);
    }
}

#[test]
fn the_reset_command_of_jvls_module_resets_a_limit_error_alone() {
    let mut bench = running(JVL);
    bench.batch(&[(0x2011, 7, 0x20)]).unwrap();
    bench.plant().inject(PlantFault::StuckSwitch(Input::PositiveLimit, true));
    assert_fault(&mut bench, 0x1002, 0);
    bench.set(0x2010, 2);
    assert_eq!(bench.state(), State::Fault);
    bench.set(0x2010, 1);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    bench.plant().inject(PlantFault::DriveFault(DriveFault::Internal));
    bench.run(5);
    bench.set(0x2010, 1);
    bench.run(5);
    assert_eq!(bench.state(), State::Fault);
}

#[test]
fn every_other_fault_is_a_motor_error_of_jvls_module() {
    let mut bench = running(JVL);
    bench.plant().inject(PlantFault::DriveFault(DriveFault::OverCurrent));
    // IX_ERR, and nothing else of ERR_STAT.
    assert_fault_with(&mut bench, 0x1001, 0, [0x08, 0, 0, 0, 0]);
    assert_eq!(bench.get_sub(0x2011, 3) & 0b101, 0b001);
}

#[test]
fn a_module_that_does_not_hear_its_motor_tells_it_until_it_does_again() {
    let mut bench = running(JVL);
    let (position, setup) = (bench.position(), bench.get_sub(0x2011, 6));
    bench.plant().inject(PlantFault::ConnectionLoss);
    assert_fault(&mut bench, 0x1003, 0);
    assert_eq!(bench.get_sub(0x2011, 3) & 0b111, 0b010, "disconnected, and no motor error");
    assert!((bench.position() - position).abs() < 200, "what it heard last");
    bench.set(0x2010, 2);
    bench.control(0x80);
    bench.run(10);
    assert_eq!((bench.state(), bench.get(0x603F)), (State::Fault, 0x1003), "the cause lasts");
    assert_eq!(bench.events(), []);
    bench.set_sub(0x2011, 6, setup);
    bench.plant().clear(PlantFault::ConnectionLoss);
    bench.run(20);
    assert_eq!((bench.state(), bench.get(0x603F)), (State::SwitchOnDisabled, 0));
    assert_eq!(bench.get_sub(0x2011, 3) & 0b111, 0);
    assert_eq!(bench.events(), [DeviceEvent::Cleared(0x1003)]);
    assert!((bench.position() - position).abs() > 200, "it has coasted meanwhile");
    bench.enable(3);
}

#[test]
fn a_motor_that_its_registers_run_coasts_while_nobody_hears_it_and_is_passive_then() {
    const MODE: u8 = 2;
    const V_SOLL: u8 = 5;
    const ERR_STAT: u8 = 35;
    for motor in ["mac140", "mac800"] {
        let mut bench = Bench::motor(motor);
        let healthy = bench.register(ERR_STAT);
        bench.write(&[(V_SOLL, 1_000), (MODE, 1)]);
        bench.run(1_000);
        bench.events();
        bench.plant().inject(PlantFault::ConnectionLoss);
        assert_fault(&mut bench, 0x1003, 0);
        assert_eq!(bench.get_sub(0x2011, 3) & 0b111, 0b010, "{motor}: disconnected");
        bench.plant().clear(PlantFault::ConnectionLoss);
        bench.run(3_000);
        assert_eq!(bench.events(), [DeviceEvent::Cleared(0x1003)], "{motor}");
        assert_eq!((bench.register(MODE), bench.velocity()), (0, 0), "{motor}: passive");
        assert_eq!(bench.register(ERR_STAT) & !0x70, healthy & !0x70, "{motor}: no error of the motor");
        bench.write(&[(MODE, 1)]);
        bench.run(1_000);
        assert!(bench.velocity() > 10_000, "{motor}: it turns again, {}", bench.velocity());
    }
}

#[test]
fn a_motor_whose_supply_fails_while_nobody_hears_it_tells_that_when_it_is_heard_again() {
    let mut bench = running(JVL);
    bench.plant().inject(PlantFault::ConnectionLoss);
    assert_fault(&mut bench, 0x1003, 0);
    bench.plant().inject(PlantFault::DriveFault(DriveFault::UnderVoltage));
    bench.plant().clear(PlantFault::ConnectionLoss);
    bench.run(20);
    assert_eq!((bench.state(), bench.get(0x603F)), (State::Fault, 0x1001));
    let events = bench.events();
    assert!(matches!(events[..], [DeviceEvent::Cleared(0x1003), DeviceEvent::Raised(_)]), "{events:?}");
}

#[test]
fn a_lost_drive_of_the_plain_standard_stays_a_fault_until_it_is_reset() {
    let mut bench = running(SERVO);
    bench.plant().inject(PlantFault::ConnectionLoss);
    assert_fault(&mut bench, 0x7500, 0);
    bench.plant().clear(PlantFault::ConnectionLoss);
    bench.run(20);
    assert_eq!(bench.state(), State::Fault);
    assert_reset(&mut bench, 0x7500);
}

#[test]
fn an_overflow_of_jvls_queue_is_an_error_until_it_is_empty_or_the_error_is_reset() {
    let ends: [fn(&mut Bench); 2] = [|bench| bench.device.set_overflow(false), |bench| bench.set(0x2010, 2)];
    for end in ends {
        let mut bench = running(JVL);
        bench.device.set_overflow(true);
        bench.device.set_overflow(true);
        bench.run(50);
        let events = bench.events();
        let [DeviceEvent::Raised(fault)] = events.as_slice() else { panic!("told once: {events:?}") };
        assert_eq!((fault.code, fault.register), (0x1004, 0));
        assert_eq!((bench.state(), bench.get(0x603F)), (State::OperationEnabled, 0), "the motor turns");
        for other in [0, 1, 3, 255] {
            bench.set(0x2010, other);
        }
        assert_eq!(bench.events(), []);
        end(&mut bench);
        end(&mut bench);
        assert_eq!(bench.events(), [DeviceEvent::Cleared(0x1004)]);
    }
}

#[test]
fn the_reserved_commands_of_jvls_module_are_taken_and_do_nothing() {
    let mut bench = running(JVL);
    bench.batch(&[(0x2011, 7, 0x20)]).unwrap();
    bench.plant().inject(PlantFault::StuckSwitch(Input::PositiveLimit, true));
    assert_fault(&mut bench, 0x1002, 0);
    for command in (0..=255).filter(|command| *command != 1) {
        bench.set(0x2010, command);
    }
    assert_eq!((bench.state(), bench.events()), (State::Fault, vec![]));
}

#[test]
fn a_lost_connection_is_a_communication_error() {
    let mut bench = running(SERVO);
    bench.set(0x6007, 1);
    let now = bench.now;
    bench.device.connection_lost(now);
    assert_fault(&mut bench, 0x8100, COMMUNICATION);
    assert_reset(&mut bench, 0x8100);
}

#[test]
fn a_fault_of_a_drive_that_is_off_is_told_as_well() {
    let mut bench = Bench::new(SERVO);
    assert_eq!(bench.device.poll_timeout(), None);
    bench.plant().inject(PlantFault::DriveFault(DriveFault::Internal));
    assert_fault(&mut bench, 0x5000, 0);
}
