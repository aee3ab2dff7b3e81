//! The two vocabularies of an axis: who has switched it on has it.

use od::{AbortCode, Address};
use profiles::{CardType, Mac4Mode, State, UserStatus};

use crate::bench::{CARDS, Card};

fn object(index: u16, axis: u8) -> Address {
    Address::new(index + 0x800 * u16::from(axis), 0)
}

fn state(card: &Card, axis: usize) -> State {
    card.device.axes().nth(axis).unwrap().state
}

/// Takes an axis to OPERATION ENABLED by CiA 402.
fn operate(card: &mut Card, axis: u8, mode: i64) {
    card.write(object(0x6060, axis), mode).unwrap();
    for word in [0x06, 0x07, 0x0F] {
        card.write(object(0x6040, axis), word).unwrap();
    }
    card.run(100);
    assert_eq!(state(card, usize::from(axis)), State::OperationEnabled);
}

#[test]
fn while_the_mac4_vocabulary_has_the_axis_a_controlword_is_refused() {
    for kind in CARDS {
        let mut card = Card::enabled(kind);
        for word in [0x06, 0x07, 0x0F, 0x1F, 0x02] {
            assert_eq!(card.write(object(0x6040, 0), word), Err(AbortCode::DeviceState), "{word:#x}");
        }
        card.write(object(0x6040, 0), 0).unwrap();
        card.run(50);
        assert!(card.has(0, UserStatus::DR_EN), "it holds nothing");
        operate(&mut card, 1, 3);
        card.execute(0, "MD");
        card.run(200);
        operate(&mut card, 0, 3);
    }
}

#[test]
fn while_cia_402_has_the_axis_instructions_that_move_it_are_refused() {
    for kind in CARDS {
        let mut card = Card::new(kind);
        for axis in 0..4 {
            card.give(axis, "INIT");
        }
        operate(&mut card, 2, 3);
        for mnemonic in ["ME", "UE", "MD", "E", "INIT", "UWSH"] {
            assert_eq!(card.try_give(2, mnemonic), Err(AbortCode::DeviceState), "{mnemonic}");
        }
        assert_eq!(card.message(2, 52, 0).code, 163);
        card.give(2, "C");
        assert_eq!(card.mode(2), Mac4Mode::Disable);
        card.execute(1, "ME");
        // Readings show the axis, whoever has it.
        card.write(object(0x60FF, 2), 2_000).unwrap();
        card.run(1_000);
        assert!(card.position(2) > 1_000 && card.get(2, "RPS") != 0, "{}", card.describe());
        card.write(object(0x6040, 2), 0).unwrap();
        card.run(3_000);
        card.execute(2, "ME");
        card.run(100);
        assert!(card.has(2, UserStatus::DR_EN));
    }
}

#[test]
fn each_vocabulary_puts_its_own_limits_on_the_axis() {
    let mut card = Card::new(CardType::Inc);
    card.set(0, "UWLP", 1_000);
    let mut card = card.on();
    card.execute(0, "MD");
    card.run(200);
    card.write(Address::new(0x607D, 2), 3_000).unwrap();
    operate(&mut card, 0, 3);
    card.write(object(0x60FF, 0), 5_000).unwrap();
    card.run(5_000);
    assert!((card.position(0) - 3_000).abs() < 10, "0x607D: {}", card.describe());
    card.write(object(0x6040, 0), 0).unwrap();
    card.run(1_000);
    card.set(0, "WZP", 0);
    card.enable(0);
    card.set(0, "WSV", 20);
    card.execute(0, "MS");
    card.run_until(|card| card.mode(0) == Mac4Mode::Disable);
    card.run(1_000);
    assert!((card.position(0) - 1_000).abs() < 10, "UWLP: {}", card.describe());
}

#[test]
fn the_acknowledgement_of_one_resets_the_fault_of_the_other() {
    let mut card = Card::enabled(CardType::Inc);
    card.set(0, "WMF", 10);
    card.set(0, "WSV", 100);
    card.execute(0, "MS");
    card.run_until(|card| card.has(0, UserStatus::FERR_F));
    card.run(1_000);
    assert_eq!(state(&card, 0), State::Fault);
    card.give(0, "C");
    card.run(20);
    assert_eq!(state(&card, 0), State::SwitchOnDisabled);
}

#[test]
fn a_lost_master_is_a_silent_host_and_the_operator_lets_the_axis_brake() {
    for kind in CARDS {
        let start = || {
            let mut card = Card::enabled(kind);
            card.set(0, "WSV", if kind == CardType::Stp { 2_000 } else { 30 });
            card.set(0, "WAA", if kind == CardType::Stp { 50 } else { 1 });
            card.execute(0, "MS");
            card.run(500);
            card
        };
        let mut card = start();
        let now = card.now;
        card.device.connection_lost(now);
        card.run(50);
        assert!(card.has(0, UserStatus::DR_EN), "it brakes");
        card.run(5_000);
        assert_eq!((card.mode(0), card.get(0, "ERR")), (Mac4Mode::Disable, 164));

        let mut card = start();
        let now = card.now;
        card.device.shut_down(now);
        card.run(50);
        assert!(card.has(0, UserStatus::DR_EN), "it brakes");
        card.run(5_000);
        assert!(card.device.is_quiet(), "{}", card.describe());
        card.give(0, "ME");
        card.give(0, "E");
        card.run(100);
        assert!(!card.has(0, UserStatus::DR_EN), "nothing is obeyed any more");

        let mut card = start();
        let now = card.now;
        card.device.shut_down(now);
        card.run(50);
        assert!(card.has(0, UserStatus::DR_EN), "it brakes");
        let now = card.now;
        card.device.cut_power(now);
        card.run(50);
        assert!(!card.has(0, UserStatus::DR_EN), "it coasts: {}", card.describe());
        card.give(0, "ME");
        card.give(0, "E");
        card.run(5_000);
        assert!(card.device.is_quiet(), "{}", card.describe());

        let mut card = start();
        let now = card.now;
        card.device.reset(now);
        card.run(5_000);
        assert!(!card.has(0, UserStatus::INIT) && card.device.is_quiet());
    }
}
