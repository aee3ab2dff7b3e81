//! Every fault of section 6.3: its cause, its code, its bit, its effect, and its acknowledgement.

use axis::{DriveFault, Input, PlantFault, Position};
use od::AbortCode;
use profiles::{CardType, DeviceEvent, Mac4Mode, OverallStatus, UserStatus};

use crate::bench::{CARDS, Card};

const E: i64 = 3;
const C: i64 = 4;
const WAP: i64 = 70;
const WDL: i64 = 90;
const RCP: i64 = 116;

fn overall(card: &Card) -> OverallStatus {
    OverallStatus::from_bits_truncate(card.object(0x2180, 2) as u32)
}

/// All four axes enabled, running at a third of their speed.
fn running(kind: CardType) -> Card {
    let mut card = Card::new(kind);
    for axis in 0..4 {
        card.give(axis, "INIT");
        card.enable(axis);
        card.set(axis, "WSV", if kind == CardType::Stp { 3_000 } else { 25 });
        card.set(axis, "WSA", if kind == CardType::Stp { 200 } else { 2 });
        card.set(axis, "WAA", if kind == CardType::Stp { 100 } else { 2 });
        card.execute(axis, "MS");
    }
    card.run(1_000);
    card
}

fn inject(card: &mut Card, axis: u8, fault: PlantFault) {
    let now = card.now;
    card.device.plant(usize::from(axis), now).unwrap().inject(fault);
}

fn repair(card: &mut Card, axis: u8, fault: PlantFault) {
    let now = card.now;
    card.device.plant(usize::from(axis), now).unwrap().clear(fault);
}

/// The axis neither takes an instruction before C nor forgets to after it; readings are always executed.
fn acknowledge(card: &mut Card, axis: u8, code: i64) {
    let number = i64::from(axis);
    assert_eq!(card.get(axis, "ERR"), code);
    assert_eq!(card.message(number, WAP, 0).code, code, "{}", card.describe());
    assert_eq!(card.message(number, RCP, 0).code, RCP);
    assert_eq!(card.try_give(axis, "ME"), Err(AbortCode::DeviceState));
    assert_eq!(card.message(number, C, 0).code, C);
    card.run(100);
    assert_eq!(card.get(axis, "ERR"), 0, "{}", card.describe());
    card.execute(axis, "ME");
    card.run(100);
    assert!(card.has(axis, UserStatus::DR_EN), "{}", card.describe());
}

#[test]
fn a_false_axis_number_stops_all_axes_from_taking_instructions_until_any_is_acknowledged() {
    let mut card = Card::enabled(CardType::Inc);
    card.set(1, "WIRQ2", 0x77);
    let last_valid = card.message(1, RCP, 0);
    assert_eq!((last_valid.axis, card.get(1, "IRQ")), (1, 1 << 8 | 0x77));
    let response = card.message(4, WAP, 0);
    assert_eq!((response.axis, response.code), (4, 160));
    assert_eq!(response.parameter & 2, 2, "the overall status");
    assert!(overall(&card).contains(OverallStatus::AXIS_F));
    assert_eq!(card.get(1, "IRQ"), 2 << 8 | 0x77, "the interrupt of the last valid axis");
    assert_eq!(card.message(0, WAP, 0).code, 160);
    assert_eq!(card.try_give(2, "INIT"), Err(AbortCode::DeviceState));
    assert_eq!(card.message(0, RCP, 0).code, RCP);
    card.give(3, "C");
    assert!(overall(&card).is_empty() || overall(&card) == OverallStatus::SERV_EN);
    assert_eq!(card.message(0, WAP, 5).code, WAP);
    assert_eq!(card.get(0, "WAP"), 5);
}

#[test]
fn an_instruction_that_does_not_exist_is_a_syntax_error() {
    for kind in CARDS {
        // 10 is TURBO, 104 is WGA: each belongs to other cards only.
        let foreign = if kind == CardType::Stp { 104 } else { 10 };
        for code in [1, 160, 200, 5_000, foreign] {
            let mut card = Card::enabled(kind);
            assert_eq!(card.message(0, code, 1).code, 161, "{code}");
            assert!(card.has(0, UserStatus::SYN_F));
            assert!(!card.has(1, UserStatus::SYN_F));
            assert_eq!(card.message(0, WAP, 0).code, 163, "not acknowledged");
            card.give(0, "C");
            assert!(!card.has(0, UserStatus::SYN_F | UserStatus::LOGO_F));
            assert_eq!(card.message(0, WDL, 1).code, WDL);
        }
    }
}

#[test]
fn a_value_outside_of_its_limits_is_a_limit_value_error_and_changes_nothing() {
    for kind in CARDS {
        let mut card = Card::new(kind);
        card.set(0, "UWLP", 1_000);
        card.set(0, "UWLN", -1_000);
        let mut card = card.on();
        assert_eq!(card.try_set(0, "WAP", 1_001), Err(AbortCode::ValueTooHigh));
        assert_eq!(card.try_set(0, "WAP", -1_001), Err(AbortCode::ValueTooLow));
        assert_eq!(card.try_set(0, "WDL", 3), Err(AbortCode::ValueTooHigh));
        assert_eq!(card.get(0, "ERR"), 0, "an abort code has said it");
        for (code, value) in [(WAP, 1_001), (WAP, -1_001), (WDL, 3), (WDL, -1), (WDL, 300)] {
            let response = card.message(0, code, value);
            assert_eq!(response.code, 162, "{code} {value}");
            assert!(card.has(0, UserStatus::LIMIT_F));
            acknowledge(&mut card, 0, 163);
        }
        assert_eq!((card.get(0, "WAP"), card.get(0, "WDL")), (0, 0));
    }
}

#[test]
fn a_position_outside_of_the_range_of_an_absolute_encoder_is_a_limit_value_error() {
    let mut card = Card::new(CardType::Ssi);
    card.set(0, "UWET", 2);
    let mut card = card.on();
    assert_eq!(card.try_set(0, "WAP", -1), Err(AbortCode::ValueTooLow));
    assert_eq!(card.try_set(0, "WAP", 1 << 24), Err(AbortCode::ValueTooHigh));
    card.set(0, "WAP", (1 << 24) - 1);
}

#[test]
fn the_drive_fault_signal_brakes_and_disables_its_axis_alone() {
    for kind in CARDS {
        let mut card = running(kind);
        card.set(1, "WIRQ3", 0xA2);
        // The signal is wired low active.
        let fault = PlantFault::StuckSwitch(Input::DriveFault, false);
        inject(&mut card, 1, fault);
        card.run(20);
        assert!(card.has(1, UserStatus::DR_F | UserStatus::DR_EN), "it brakes: {}", card.describe());
        assert_eq!(card.get(1, "IRQ"), 1 << 8 | 0xA2);
        card.run(2_000);
        assert_eq!(card.mode(1), Mac4Mode::Disable);
        assert_eq!([0, 2, 3].map(|axis| card.mode(axis)), [Mac4Mode::Speed; 3]);
        let events = card.events();
        let [DeviceEvent::Raised(told)] = events.as_slice() else { panic!("{events:?}") };
        assert_eq!((told.code, told.detail[0]), (0x5000, 2), "EMCY tells the axis");
        // As long as the signal is on, C alone does not help.
        card.give(1, "C");
        card.run(50);
        assert_eq!(card.message(1, WAP, 0).code, 163);
        repair(&mut card, 1, fault);
        card.run(50);
        acknowledge(&mut card, 1, 163);
        assert_eq!(card.events(), [DeviceEvent::Cleared(0x5000)]);
    }
}

#[test]
fn an_amplifier_that_trips_is_a_drive_fault_and_its_motor_coasts() {
    for kind in CARDS {
        let mut card = running(kind);
        let fault = PlantFault::DriveFault(DriveFault::OverCurrent);
        inject(&mut card, 0, fault);
        card.run(20);
        assert!(card.has(0, UserStatus::DR_F) && !card.has(0, UserStatus::DR_EN));
        assert_eq!(card.mode(0), Mac4Mode::Disable);
        repair(&mut card, 0, fault);
        card.run(3_000);
        acknowledge(&mut card, 0, 163);
    }
}

#[test]
fn the_emergency_stop_disables_all_axes_without_a_ramp() {
    for kind in CARDS {
        let mut card = running(kind);
        card.set(0, "WIRQ5", 0x55);
        assert_eq!(card.get(3, "WIRQ5"), 0x55, "it is that of all axes");
        let fault = PlantFault::StuckSwitch(Input::EmergencyStop, false);
        inject(&mut card, 2, fault);
        card.run(20);
        assert!(overall(&card).contains(OverallStatus::H_STOP));
        for axis in 0..4 {
            assert_eq!(card.mode(axis), Mac4Mode::Disable, "{}", card.describe());
            assert!(!card.has(axis, UserStatus::DR_EN));
            assert_eq!(card.get(axis, "IRQ") & 0xFF, 0x55);
        }
        assert_eq!(card.message(0, WAP, 0).code, 165);
        card.give(0, "C");
        card.run(50);
        assert_eq!(card.message(0, WAP, 0).code, 165, "the switch is still on");
        repair(&mut card, 2, fault);
        card.run(3_000);
        acknowledge(&mut card, 1, 165);
        for axis in [0, 2, 3] {
            card.execute(axis, "ME");
            card.run(50);
            assert!(card.has(axis, UserStatus::DR_EN), "{}", card.describe());
        }
    }
}

#[test]
fn a_silent_host_lets_all_axes_brake_and_disables_them() {
    for kind in CARDS {
        let mut card = running(kind);
        card.set(3, "WWD", 500);
        assert_eq!(card.get(0, "WWD"), 500, "it is that of all axes");
        card.run(490);
        assert_eq!(overall(&card), OverallStatus::SERV_EN);
        // Any write is a sign of life, a message that reads as well.
        card.message(0, RCP, 0);
        card.run(490);
        assert_eq!(overall(&card), OverallStatus::SERV_EN);
        card.run(30);
        assert!(overall(&card).contains(OverallStatus::WATCH_F));
        assert!((0..4).all(|axis| card.has(axis, UserStatus::DR_EN)), "they brake: {}", card.describe());
        card.run(3_000);
        for axis in 0..4 {
            assert_eq!(card.mode(axis), Mac4Mode::Disable);
            assert!(!card.has(axis, UserStatus::DR_EN));
        }
        acknowledge(&mut card, 2, 164);
    }
}

#[test]
fn a_logical_error_is_an_abort_code_to_an_sdo_and_code_163_to_a_message() {
    type Cause = fn(&mut Card) -> &'static str;
    let causes: [(CardType, Cause); 11] = [
        // A system parameter while the axis is neither deinitialised nor disabled.
        (CardType::Inc, |_| "UWLP"),
        (CardType::Inc, |_| "USR"),
        (CardType::Inc, |_| "INIT"),
        // No incremental encoder at the connector P2.
        (CardType::Ssi, |_| "MI"),
        (CardType::Ssi, |_| "MH"),
        (CardType::Stp, |card| {
            again(card, &[("UWET", 0)]);
            "MC"
        }),
        // A motion mode from another one.
        (CardType::Inc, |card| {
            card.execute(0, "MS");
            "MP"
        }),
        // A circular axis to a limit switch.
        (CardType::Inc, |card| {
            again(card, &[("UWSH", 2), ("UWCR", 5_000), ("WDL", 1)]);
            "MF"
        }),
        // The position while the axis moves.
        (CardType::Stp, |card| {
            card.set(0, "WSV", 1_000);
            card.execute(0, "MS");
            card.run(500);
            "WZP"
        }),
        // A switch that is declared off.
        (CardType::Inc, |card| {
            again(card, &[("UWPS", 0), ("WDL", 2)]);
            "MF"
        }),
        (CardType::Inc, |card| {
            again(card, &[("UWRS", 0)]);
            "MH"
        }),
    ];
    for (kind, cause) in causes {
        let mut card = Card::enabled(kind);
        let mnemonic = cause(&mut card);
        let before = card.mode(0);
        assert_eq!(card.try_give(0, mnemonic), Err(AbortCode::DeviceState), "{kind:?} {mnemonic}");
        assert_eq!(card.get(0, "ERR"), 0, "an abort code has said it");
        let code = i64::from(card.address(0, mnemonic).unwrap().sub);
        assert_eq!(card.message(0, code, 1).code, 163, "{mnemonic}");
        assert!(card.has(0, UserStatus::LOGO_F));
        assert_eq!(card.mode(0), before, "the command is ignored");
        card.give(0, "C");
        assert!(!card.has(0, UserStatus::LOGO_F));
    }
}

/// Switches the first axis off, sets parameters and switches it on again.
fn again(card: &mut Card, parameters: &[(&str, i64)]) {
    card.execute(0, "MD");
    card.run(200);
    for (mnemonic, value) in parameters {
        card.set(0, mnemonic, *value);
    }
    card.give(0, "INIT");
    card.enable(0);
}

#[test]
fn the_range_of_an_absolute_encoder_on_a_circular_axis_is_its_turn() {
    let mut card = Card::new(CardType::Ssi);
    card.set(0, "UWET", 2);
    card.set(0, "UWEC", 1 << 20);
    card.set(0, "UWSH", 2);
    assert_eq!(card.try_set(0, "UWEC", 1 << 20), Err(AbortCode::DeviceState));
}

#[test]
fn a_card_measures_only_as_it_can() {
    for (kind, sensors) in CARDS.into_iter().zip([[1, 3, 4, 9], [1, 2, 3, 4], [0, 1, 3, 4]]) {
        let mut card = Card::new(kind);
        for code in 0..=4 {
            let expected = if sensors.contains(&code) { Ok(()) } else { Err(AbortCode::InvalidValue) };
            assert_eq!(card.try_set(0, "UWET", code), expected, "{kind:?} {code}");
        }
    }
}

#[test]
fn the_positive_limit_has_to_lie_above_the_negative_one() {
    let mut card = Card::new(CardType::Inc);
    card.set(0, "UWLP", -5);
    card.set(0, "UWLN", -5);
    assert_eq!(card.try_give(0, "INIT"), Err(AbortCode::MaxBelowMin));
    assert_eq!(card.message(0, 2, 0).code, 162);
    card.give(0, "C");
    card.set(0, "UWLP", -4);
    card.give(0, "INIT");
}

#[test]
fn a_word_beyond_the_range_of_the_sensor_disables_the_axis_without_a_ramp() {
    let mut card = Card::new(CardType::Ssi);
    card.set(0, "UWET", 2);
    card.set(0, "UWEC", (1 << 23) + 3_000);
    let mut card = card.on();
    card.set(0, "WSV", 20);
    card.execute(0, "MS");
    card.run_until(|card| card.has(0, UserStatus::ENCODER_F));
    assert!(card.has(0, UserStatus::LOGO_F));
    card.run(10);
    assert!(!card.has(0, UserStatus::DR_EN));
    assert_eq!(card.mode(0), Mac4Mode::Disable);
    assert_eq!(card.message(0, E, 0).code, 163);
    card.run(3_000);
    // Another range, and the axis is initialised anew.
    card.give(0, "C");
    card.set(0, "UWEC", 0);
    card.give(0, "INIT");
    card.give(0, "C");
    card.run(50);
    card.enable(0);
}

#[test]
fn a_following_error_brakes_and_disables_the_axis() {
    for kind in CARDS {
        let mut card = Card::enabled(kind);
        card.set(0, "WMF", 30);
        card.set(0, "WSV", if kind == CardType::Stp { 3_000 } else { 60 });
        card.set(0, "WSA", 1_000);
        if kind == CardType::Stp {
            // The pulses go on, the motor does not: only its encoder tells.
            inject(&mut card, 0, PlantFault::BlockedShaft);
        }
        card.execute(0, "MS");
        card.run_until(|card| card.has(0, UserStatus::FERR_F));
        card.run(3_000);
        assert_eq!(card.mode(0), Mac4Mode::Disable, "{}", card.describe());
        let told = card.events().into_iter().find_map(|event| match event {
            DeviceEvent::Raised(fault) => Some((fault.code, fault.detail[0])),
            DeviceEvent::Cleared(_) | DeviceEvent::Store(_) => None,
        });
        assert_eq!(told, Some((0x8611, 1)));
        repair(&mut card, 0, PlantFault::BlockedShaft);
        card.run(500);
        acknowledge(&mut card, 0, 163);
    }
}

#[test]
fn a_limit_switch_brakes_and_the_axis_may_only_go_back() {
    for kind in CARDS {
        let base = if kind == CardType::Ssi { 8_388_608.0 } else { 0.0 };
        let mut card =
            Card::arranged(kind, |_, plant| plant.positive_switch = Some(Position(base + 2_000.0))).on();
        card.set(0, "WSV", if kind == CardType::Stp { 2_000 } else { 25 });
        card.execute(0, "MS");
        card.run_until(|card| card.has(0, UserStatus::HWL_P));
        card.run_until(|card| card.mode(0) == Mac4Mode::Brake);
        assert!(card.has(0, UserStatus::DR_EN));
        card.run(500);
        let behind = card.motor(0);
        card.execute(0, "MS");
        card.run(500);
        assert!((card.motor(0) - behind).abs() < 5.0, "{}", card.describe());
        card.set(0, "WSV", if kind == CardType::Stp { -2_000 } else { -25 });
        card.run_until(|card| card.mode(0) == Mac4Mode::Brake);
        card.execute(0, "MS");
        card.run_until(|card| !card.has(0, UserStatus::HWL_P));
    }
}

#[test]
fn a_software_limit_stops_the_axis_before_it_and_disables_it() {
    for kind in CARDS {
        let mut card = Card::new(kind);
        card.set(0, "UWLP", 2_000);
        let mut card = card.on();
        card.set(0, "WSV", if kind == CardType::Stp { 2_000 } else { 25 });
        card.execute(0, "MS");
        card.run_until(|card| card.mode(0) == Mac4Mode::Disable);
        card.run(100);
        assert!((card.position(0) - 2_000).abs() < 6, "{}", card.describe());
        assert!(!card.has(0, UserStatus::DR_EN));
        assert_eq!(card.get(0, "ERR"), 0);
    }
}
