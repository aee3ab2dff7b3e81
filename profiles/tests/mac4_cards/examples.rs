//! The example configurations of appendix 7.2, typed as they stand there, and the message of section 7.3.

use profiles::{CardType, Mac4Mode, UserStatus};

use crate::bench::{Card, Response};

/// Moves the first axis to places one after the other.
fn move_to(card: &mut Card, targets: &[i64]) {
    for target in targets {
        card.set(0, "WTRT", 200);
        card.set(0, "WAP", *target);
        card.execute(0, "MP");
        assert!(!card.has(0, UserStatus::POS_END));
        card.run_until(|card| card.has(0, UserStatus::POS_END));
        let distance = card.position(0) - target;
        assert!(distance.abs() <= card.get(0, "WTR"), "{distance} from {target}");
        assert_eq!(card.mode(0), Mac4Mode::Positioning);
    }
}

#[test]
fn the_stepper_of_the_appendix_runs() {
    let mut card = Card::new(CardType::Stp);
    card.set(0, "UWMS", 500);
    card.set(0, "WSSF", 30);
    card.set(0, "WBT", 80);
    card.set(0, "UWSH", 1);
    card.set(0, "UWLP", 1_000_000);
    card.set(0, "UWLN", 0);
    card.set(0, "UWET", 0);
    card.set(0, "WIRQ3", 0xA0);
    card.set(0, "WMF", 1_000);
    card.set(0, "WAA", 2_000);
    card.set(0, "WLV", 8);
    card.give(0, "INIT");
    let mut card = card.on();
    card.set(0, "WPV", 2_000);
    card.set(0, "WPA", 100);
    card.set(0, "WPD", 100);
    card.set(0, "WTR", 0);
    move_to(&mut card, &[4_000, 10, 1_234]);
    assert_eq!(card.position(0), 1_234, "a stepper is on its step");
}

#[test]
fn the_incremental_axis_of_the_appendix_runs() {
    // Its switches are wired active high.
    let mut card = Card::arranged(CardType::Inc, |_, plant| {
        plant.active_low = axis::Inputs { emergency_stop: true, ..axis::Inputs::default() };
    });
    card.give(0, "USR");
    card.set(0, "UWSH", 1);
    card.set(0, "UWLP", 2_000_000);
    card.set(0, "UWLN", -2_000_000);
    for switch in ["UWPS", "UWNS", "UWRS", "UWSO"] {
        card.set(0, switch, 2);
    }
    card.set(0, "WIRQ3", 0xA2);
    card.set(0, "WIRQ4", 0xA4);
    card.give(0, "FLYON");
    card.set(0, "WMF", 2_000);
    card.set(0, "WGA", 80);
    card.set(0, "WZE", 128);
    card.set(0, "WPO", 0);
    card.set(0, "UWKISC", 3);
    card.set(0, "WKI", 41);
    card.set(0, "WAA", 5_000);
    card.set(0, "WLV", 20);
    card.give(0, "INIT");
    assert!(card.has(0, UserStatus::REV_O | UserStatus::INIT | UserStatus::ON_FLY));
    // The motor turns in anti-clockwise direction for a positive output, and the encoder counts down: a sensor that is
    // turned round would be needed for a closed loop, and without one the axis runs away and is caught.
    card.enable(0);
    card.set(0, "WAP", 20_000);
    card.execute(0, "MP");
    card.run_until(|card| card.has(0, UserStatus::FERR_F));
    card.run_until(|card| card.mode(0) == Mac4Mode::Disable);
    card.give(0, "C");
    card.run(2_000);
    card.give(0, "USN");
    card.give(0, "INIT");
    card.enable(0);
    move_to(&mut card, &[20_000, -5_000, 0]);
    assert_eq!(card.get(0, "IRQ") & 0xFF, 0xA4);
}

#[test]
fn the_absolute_axis_of_the_appendix_runs() {
    let mut card = Card::new(CardType::Ssi);
    card.set(0, "UWSH", 2);
    card.set(0, "UWCR", 10_000);
    card.set(0, "UWET", 4);
    card.set(0, "UWEA", 0x80_C000);
    card.set(0, "UWEB", 14);
    for switch in ["UWPS", "UWNS", "UWRS", "UWSO"] {
        card.set(0, switch, 0);
    }
    card.give(0, "FLYOFF");
    card.set(0, "WMF", 500);
    card.set(0, "WGA", 200);
    card.set(0, "WZE", 253);
    card.set(0, "WPO", 0);
    card.set(0, "UWKISC", 0);
    card.set(0, "WKI", 13);
    card.set(0, "WAA", 5_000);
    card.set(0, "WWD", 60_000);
    let mut card = card.on();
    // The sensor elsewhere has 10,000 places a turn; half the range of the card's own is at 8608 of them.
    assert_eq!(card.position(0), 8_388_608 % 10_000);
    card.set(0, "WPV", 30);
    card.set(0, "WPA", 1);
    card.set(0, "WPD", 1);
    move_to(&mut card, &[5_000, 9_900, 100]);
}

/// Section 7.3: the axis is at 1000, and the target is 16.
#[test]
fn the_messages_of_the_appendix_are_answered_as_it_says() {
    let mut card = Card::enabled(CardType::Inc);
    card.set(0, "WZP", 1_000);
    // $02000101 also has the bit "init", which the appendix leaves out, although nothing runs without it.
    let enabled = (UserStatus::ON_FLY | UserStatus::DR_EN | UserStatus::INIT).bits();
    let status = |mode: u32, more: UserStatus| i64::from(enabled | more.bits() | mode);
    let expect = |code, parameter| Response { axis: 0, code, parameter };
    assert_eq!(card.message(0, 70, 16), expect(70, status(1, UserStatus::empty())));
    assert_eq!(card.message(0, 59, 0), expect(59, status(1, UserStatus::empty())));
    assert_eq!(card.message(0, 3, 0), expect(3, status(8, UserStatus::empty())));
    assert_eq!(card.message(0, 116, 0), expect(116, 1_000));
    assert_eq!(card.message(0, 1, 0), expect(161, status(8, UserStatus::SYN_F)));
}
