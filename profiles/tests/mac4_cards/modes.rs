//! Each mode ends as its section says.

use axis::{Position, PositionRange};
use profiles::{CardType, Mac4Mode, UserStatus};

use crate::bench::{CARDS, Card};

#[test]
fn positioning_ends_at_its_target_on_every_card() {
    for kind in CARDS {
        let mut card = Card::enabled(kind);
        let start = card.position(0);
        for way in [3_000, -1_000, 1] {
            card.set(0, "WAP", start + way);
            card.execute(0, "MP");
            assert_eq!(card.mode(0), Mac4Mode::Positioning);
            assert!(!card.has(0, UserStatus::POS_END));
            card.run_until(|card| card.has(0, UserStatus::POS_END));
            assert!((card.position(0) - start - way).abs() <= 5, "{kind:?}: {}", card.describe());
        }
    }
}

#[test]
fn speed_is_held_until_another_mode_on_every_card() {
    for kind in CARDS {
        let mut card = Card::enabled(kind);
        for speed in [40, -40] {
            card.set(0, "WSV", speed);
            card.execute(0, "MS");
            card.run(3_000);
            // In Inc/SP of four SSP, or in Hz of which 0.032 are a step in an SP.
            let command = if kind == CardType::Stp { (speed as f64 * 0.032).round() as i64 } else { speed };
            assert_eq!(card.get(0, "RPS"), command, "{kind:?}");
        }
        card.execute(0, "MB");
        card.run(500);
        assert_eq!((card.get(0, "RPS"), card.mode(0)), (0, Mac4Mode::Brake));
        assert!(card.has(0, UserStatus::DR_EN));
    }
}

#[test]
fn tracking_follows_each_value_of_the_host_on_every_card() {
    for kind in CARDS {
        let mut card = Card::enabled(kind);
        card.execute(0, "VT");
        let start = card.position(0);
        card.set(0, "WVT", if kind == CardType::Stp { 1_000 } else { 20 });
        card.run(1_000);
        card.set(0, "WVT", 0);
        card.run(1_000);
        let way = card.position(0) - start;
        let expected = if kind == CardType::Stp { 1_000 } else { 2_000 };
        assert!((way - expected).abs() < 100, "{kind:?}: {way}");
        card.execute(0, "MB");
        card.run(200);
        let start = card.position(0);
        card.set(0, "WAT", start);
        card.execute(0, "PT");
        for step in 1..=50 {
            card.set(0, "WAT", start + 10 * step);
            card.run(40);
        }
        card.run(1_000);
        assert!((card.position(0) - start - 500).abs() <= 5, "{kind:?}: {}", card.describe());
        card.set(0, "WAT_R", -100);
        card.run(1_000);
        assert!((card.position(0) - start - 400).abs() <= 5, "{kind:?}: {}", card.describe());
        assert_eq!(card.mode(0), Mac4Mode::PositionTracking);
    }
}

#[test]
fn test_puts_out_its_value_and_a_limit_switch_switches_it_off_on_every_card() {
    for kind in CARDS {
        let base = if kind == CardType::Ssi { 8_388_608.0 } else { 0.0 };
        let mut card =
            Card::arranged(kind, |_, plant| plant.positive_switch = Some(Position(base + 3_000.0)));
        card.give(0, "INIT");
        card.give(0, "USR");
        card.set(0, "WDA", if kind == CardType::Stp { 500 } else { 204 });
        card.execute(0, "UE");
        assert_eq!(card.mode(0), Mac4Mode::Test);
        card.run(1_000);
        assert!(card.motor(0) - base > 300.0, "USR has no effect: {kind:?} {}", card.describe());
        card.run_until(|card| card.mode(0) == Mac4Mode::Disable);
        assert!(card.has(0, UserStatus::HWL_P) && !card.has(0, UserStatus::DR_EN));
        card.run(500);
        // It can be returned to "test" and driven in either direction.
        card.execute(0, "UE");
        card.set(0, "WDA", if kind == CardType::Stp { -500 } else { -204 });
        card.run_until(|card| !card.has(0, UserStatus::HWL_P));
        card.execute(0, "MD");
        card.run(10);
        assert_eq!(card.mode(0), Mac4Mode::Disable);
    }
}

/// A card whose first axis has a reference switch from 2000 to 2600, limit switches 10,000 away on either side, and
/// an index at 500 in each turn.
fn with_switches(kind: CardType) -> (Card, i64) {
    let base = if kind == CardType::Ssi { 8_388_608 } else { 0 };
    let at = |place: i64| Position((base + place) as f64);
    let mut card = Card::arranged(kind, |_, plant| {
        plant.home_switch = PositionRange::new(at(2_000), at(2_600));
        plant.positive_switch = Some(at(10_000));
        plant.negative_switch = Some(at(-10_000));
        plant.index = Position(500.0);
    });
    if kind == CardType::Ssi {
        card.set(0, "UWET", 2);
    }
    let mut card = card.on();
    card.set(0, "WLV", if kind == CardType::Stp { 50 } else { 1 });
    (card, base)
}

fn justified(card: &mut Card) -> i64 {
    card.run_until(|card| card.has(0, UserStatus::JUS_END) || card.mode(0) == Mac4Mode::Brake);
    assert!(card.has(0, UserStatus::JUS_END), "{}", card.describe());
    card.run(500);
    card.position(0)
}

#[test]
fn find_edge_ends_at_the_edge_that_was_found_first_on_every_card() {
    for kind in CARDS {
        let speed = if kind == CardType::Stp { 600 } else { 20 };
        for (start, velocity, edge) in
            [(0, speed, 2_000), (4_000, -speed, 2_600), (2_300, speed, 2_600), (2_300, -speed, 2_000)]
        {
            let (mut card, base) = with_switches(kind);
            card.set(0, "WAP", base + start);
            card.execute(0, "MP");
            card.run_until(|card| card.has(0, UserStatus::POS_END));
            card.execute(0, "MB");
            card.run(100);
            card.set(0, "WFV", velocity);
            card.execute(0, "MF");
            assert_eq!(card.mode(0), Mac4Mode::FindEdge);
            let place = justified(&mut card) - base;
            assert!((place - edge).abs() <= 12, "{kind:?} from {start}: {place}, not {edge}");
        }
    }
}

#[test]
fn find_edge_finds_the_limit_switches_on_every_card() {
    for kind in CARDS {
        let speed = if kind == CardType::Stp { 1_000 } else { 20 };
        for (which, edge) in [(1, -10_000), (2, 10_000)] {
            let (mut card, base) = with_switches(kind);
            card.set(0, "WDL", which);
            card.set(0, "WFV", speed);
            card.execute(0, "MF");
            let place = justified(&mut card) - base;
            assert!((place - edge).abs() <= 6, "{kind:?}: {place}, not {edge}");
            assert_eq!(card.mode(0), Mac4Mode::FindEdge);
            // Once more from the switch itself: away from it and back.
            card.execute(0, "MF");
            let place = justified(&mut card) - base;
            assert!((place - edge).abs() <= 30, "{kind:?}: {place}, not {edge}");
        }
    }
}

#[test]
fn home_ends_at_the_index_right_of_the_left_edge() {
    for kind in [CardType::Inc, CardType::Stp] {
        let speed = if kind == CardType::Stp { 600 } else { 20 };
        for (start, velocity) in [(0, speed), (4_000, -speed), (2_300, speed)] {
            let (mut card, base) = with_switches(kind);
            card.set(0, "WAP", base + start);
            card.execute(0, "MP");
            card.run_until(|card| card.has(0, UserStatus::POS_END));
            card.execute(0, "MB");
            card.run(100);
            card.set(0, "WHV", velocity);
            card.execute(0, "MH");
            assert_eq!(card.mode(0), Mac4Mode::Home);
            let place = justified(&mut card);
            assert!((place - 2_500).abs() <= 6, "{kind:?} from {start}: {place}");
        }
    }
}

#[test]
fn the_index_is_found_coarsely_and_exactly() {
    for kind in [CardType::Inc, CardType::Stp] {
        let speed = if kind == CardType::Stp { 600 } else { 20 };
        for (velocity, index) in [(speed, 500), (-speed, -1_500)] {
            let (mut card, _) = with_switches(kind);
            card.set(0, "WCV", velocity);
            card.set(0, "WIV", velocity);
            card.execute(0, "MC");
            let coarse = justified(&mut card);
            assert!((coarse - index) * velocity.signum() > 0, "{kind:?}: {coarse} is behind {index}");
            assert!((coarse - index).abs() < 600, "{kind:?}: {coarse}");
            let (mut card, _) = with_switches(kind);
            card.set(0, "WIV", velocity);
            card.execute(0, "MI");
            let fine = justified(&mut card);
            assert!((fine - index).abs() <= 2, "{kind:?}: {fine}, not {index}");
        }
    }
}
