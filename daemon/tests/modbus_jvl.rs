//! JVL's registers by Modbus, in JVL's dialect, with the shipped profile.

mod common;

use std::time::Duration;

use common::gateway::{Gateway, listener};
use daemon::core::{ClientId, ListenerPlan, Notice};
use modbus::Dialect;
use profiles::State;

fn motor() -> (Gateway, ClientId) {
    let own = ListenerPlan { is_own: true, ..listener() };
    let mut gateway = Gateway::of(("jvl-mac00-fc4", Dialect::Jvl), &[1], own, None);
    let client = gateway.connect();
    (gateway, client)
}

/// Sends a request to unit 1.
fn ask((gateway, client): &mut (Gateway, ClientId), pdu: &str) -> String {
    gateway.ask(*client, 1, pdu)
}

/// Enables the drive over CANopen; it then turns.
fn turn((gateway, _): &mut (Gateway, ClientId)) {
    gateway.bench.turn(1000);
    gateway.bench.run(Duration::from_millis(500));
    assert_eq!(gateway.state(), State::OperationEnabled);
}

/// Module register 10.
const TIMEOUT_OF_3500_MS: &str = "10 80 14 00 02 04 00 23 00 00";
const READ_P_IST: &str = "03 00 14 00 02";

#[test]
fn the_ip_address_is_that_of_the_factory_and_can_be_changed() {
    let mut motor = motor();
    // 192.168.0.1, the low word first.
    assert_eq!(ask(&mut motor, "03 80 06 00 02"), "03 04 00 01 C0 A8");
    assert_eq!(ask(&mut motor, "10 80 06 00 02 04 64 01 C0 A8"), "10 80 06 00 02");
    assert_eq!(ask(&mut motor, "03 80 06 00 02"), "03 04 64 01 C0 A8");
}

#[test]
fn p_soll_is_register_3_at_address_6() {
    let mut motor = motor();
    assert_eq!(ask(&mut motor, "10 00 06 00 02 04 56 78 12 34"), "10 00 06 00 02");
    assert_eq!(ask(&mut motor, "03 00 06 00 02"), "03 04 56 78 12 34");
    let by_sdo = motor.0.bench.send("601#4012200300000000");
    assert_eq!(by_sdo, ["581#4312200378563412"]);
}

#[test]
fn a_register_of_16_bits_is_sign_extended_from_its_low_word() {
    let mut motor = motor();
    // V_SOLL.
    assert_eq!(ask(&mut motor, "10 00 0A 00 02 04 FF 38 12 34"), "10 00 0A 00 02");
    assert_eq!(ask(&mut motor, "03 00 0A 00 02"), "03 04 FF 38 FF FF");
}

#[test]
fn every_register_is_there_and_none_beyond() {
    let mut motor = motor();
    for first in (0..256_u16).step_by(32) {
        let [high, low] = (2 * first).to_be_bytes();
        let answer = ask(&mut motor, &format!("03 {high:02X} {low:02X} 00 40"));
        assert!(answer.starts_with("03 80"), "registers {first} on: {answer}");
    }
    for first in (0..64).step_by(32) {
        assert!(ask(&mut motor, &format!("03 80 {:02X} 00 40", 2 * first)).starts_with("03 80"));
    }
    for address in ["02 00", "10 00", "80 80"] {
        assert_eq!(ask(&mut motor, &format!("03 {address} 00 02")), "83 02");
    }
}

#[test]
fn module_registers_are_mirrored_at_0300_by_setup_bit_5() {
    let mut motor = motor();
    assert_eq!(ask(&mut motor, "03 03 06 00 02"), "83 02");
    ask(&mut motor, "10 80 0C 00 02 04 00 20 00 00");
    assert_eq!(ask(&mut motor, "03 03 06 00 02"), "03 04 00 01 C0 A8");
}

#[test]
fn silence_longer_than_module_register_10_makes_the_motor_passive() {
    let mut motor = motor();
    turn(&mut motor);
    ask(&mut motor, TIMEOUT_OF_3500_MS);
    for _ in 0..3 {
        motor.0.bench.run(Duration::from_millis(3499));
        assert_eq!(motor.0.state(), State::OperationEnabled);
        ask(&mut motor, READ_P_IST);
    }
    motor.0.notices();
    motor.0.bench.run(Duration::from_millis(3500));
    assert!(motor.0.notices().contains(&Notice::ModbusLost));
    assert_eq!(motor.0.state(), State::SwitchOnDisabled);
}

#[test]
fn or_stops_it_when_setup_bit_0_is_set() {
    let mut motor = motor();
    turn(&mut motor);
    ask(&mut motor, "10 80 0C 00 02 04 00 01 00 00");
    ask(&mut motor, TIMEOUT_OF_3500_MS);
    motor.0.bench.run(Duration::from_millis(3501));
    assert_eq!(motor.0.state(), State::QuickStopActive);
}

#[test]
fn or_does_nothing_when_setup_bit_1_is_set() {
    let mut motor = motor();
    turn(&mut motor);
    ask(&mut motor, "10 80 0C 00 02 04 00 02 00 00");
    ask(&mut motor, TIMEOUT_OF_3500_MS);
    motor.0.bench.run(Duration::from_secs(10));
    assert_eq!(motor.0.state(), State::OperationEnabled);
}

#[test]
fn a_time_out_of_zero_is_none() {
    let mut motor = motor();
    turn(&mut motor);
    ask(&mut motor, TIMEOUT_OF_3500_MS);
    ask(&mut motor, "10 80 14 00 02 04 00 00 00 00");
    motor.0.bench.run(Duration::from_secs(60));
    assert_eq!(motor.0.state(), State::OperationEnabled);
}

/// As section 7.4.1 of the Ethernet manual does it, on a motor of 2.0971 counts/sample for each rpm.
#[test]
fn a_motor_turns_by_its_registers_alone_until_nobody_polls_any_more() {
    let mut motor = motor();
    ask(&mut motor, TIMEOUT_OF_3500_MS);
    // A_SOLL, T_SOLL and V_SOLL, then velocity mode.
    ask(&mut motor, "10 00 0A 00 06 0C 03 E8 00 00 00 20 00 00 03 FF 00 00");
    assert_eq!(ask(&mut motor, "10 00 04 00 02 04 00 01 00 00"), "10 00 04 00 02");
    motor.0.bench.run(Duration::from_secs(3));
    // V_IST is V_SOLL / 16.
    let answer = common::gateway::bytes(&ask(&mut motor, "03 00 18 00 02"));
    let velocity = i16::from_be_bytes([answer[2], answer[3]]);
    assert!((56..=69).contains(&velocity), "{velocity}");
    motor.0.notices();
    motor.0.bench.run(Duration::from_millis(3500));
    assert!(motor.0.notices().contains(&Notice::ModbusLost));
    // Passive.
    assert_eq!(ask(&mut motor, "03 00 04 00 02"), "03 04 00 00 00 00");
}

#[test]
fn registers_that_move_the_motor_are_its_owners() {
    let can = od::Owner { bus: od::Bus::CanOpen, link: None };
    let mut motor = motor();
    motor.0.bench.core.set_owner(0, Some(can));
    // MODE_REG, P_SOLL, V_SOLL and the command register of the module; P7 is nobody's.
    for address in ["00 04", "00 06", "00 0A", "80 1E"] {
        assert_eq!(ask(&mut motor, &format!("10 {address} 00 02 04 00 01 00 00")), "90 03", "{address}");
    }
    assert_eq!(ask(&mut motor, "10 00 6E 00 02 04 00 01 00 00"), "10 00 6E 00 02");
    motor.0.bench.core.set_owner(0, Some(od::Owner { bus: od::Bus::Modbus, link: None }));
    assert_eq!(ask(&mut motor, "10 00 06 00 02 04 00 01 00 00"), "10 00 06 00 02");
    for object in ["122002", "122003", "102000", "132000"] {
        let command = if object.starts_with("12") { "23" } else { "2F" };
        let refusal = format!("581#80{object}22000008");
        assert_eq!(motor.0.bench.send(&format!("601#{command}{object}01000000")), [refusal]);
    }
}
