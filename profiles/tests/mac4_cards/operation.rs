//! How a card is operated: initialisation, on the fly and off, stop bits, reset, messages, sensors, signals.

use axis::{Input, PlantFault, Position};
use od::{AbortCode, Address};
use profiles::{CardType, Instruction, Mac4Mode, SystemStatus, UserStatus};

use crate::bench::{CARDS, Card, name};

fn system(card: &Card) -> SystemStatus {
    SystemStatus::from_bits_truncate(card.get(0, "RSS") as u32)
}

#[test]
fn every_instruction_is_an_entry_with_its_mnemonic_and_code_on_every_axis() {
    for kind in CARDS {
        let card = Card::new(kind);
        for instruction in Instruction::ALL {
            let mnemonic = instruction.mnemonic();
            let only = match mnemonic {
                "UWKISC" | "WGA" | "WZE" | "WPO" | "WKI" | "WTL" => kind != CardType::Stp,
                "UWSC" => kind == CardType::Ssi,
                "TURBO" | "UWES" | "UWMS" | "WSSF" | "WBT" | "WSTC" | "RCPI" => kind == CardType::Stp,
                _ => true,
            };
            for axis in 0..4 {
                let address = card.address(axis, mnemonic);
                assert_eq!(address.is_some(), only, "{kind:?} {mnemonic}");
                let Some(address) = address else { continue };
                let dictionary = card.device.dictionary();
                let entry = dictionary.schema().entry(dictionary.find(address).unwrap()).unwrap();
                assert_eq!((entry.name.as_str(), entry.sub), (mnemonic, *instruction as u8));
            }
        }
        let records = 0x2100..0x2140;
        let schema = card.device.dictionary().schema();
        for (address, _) in schema.entries().filter(|(at, _)| records.contains(&at.index) && at.sub > 0) {
            assert!(Instruction::from_code(address.sub.into()).is_some(), "{} {address}", name(kind));
        }
    }
}

#[test]
fn the_version_tells_card_hardware_and_software() {
    for (kind, version) in CARDS.into_iter().zip([0x0044_0402, 0x0141_0402, 0x0241_0202]) {
        let mut card = Card::new(kind);
        assert_eq!(card.get(2, "VER"), version);
        assert_eq!(card.message(2, 113, 0).parameter, version);
    }
}

#[test]
fn the_device_and_its_axes_tell_their_types() {
    for kind in CARDS {
        let card = Card::new(kind);
        let communication = &card.device.profile().communication;
        let slot = communication.slot(Address::new(0x1000, 0)).unwrap();
        let od::Initial::Value(value) = &communication.entry(slot).unwrap().initial else { panic!() };
        assert_eq!(value.raw(), 0xFFFF_0192);
        for axis in 0..4 {
            let expected = if kind == CardType::Stp { 0x0004_0192 } else { 0x0002_0192 };
            assert_eq!(card.object(0x67FF + 0x800 * axis, 0), expected);
        }
    }
}

#[test]
fn before_its_initialisation_an_axis_shows_nothing_and_obeys_nothing() {
    for kind in CARDS {
        let mut card = Card::arranged(kind, |_, plant| {
            plant.home_switch = axis::PositionRange::new(Position(-1e9), Position(1e9));
        });
        assert_eq!(card.user(0) - UserStatus::GRAY, UserStatus::ON_FLY);
        assert_eq!(card.position(0), 0);
        for command in ["ME", "MP", "UE", "E", "WZP", "DEINIT"] {
            assert_eq!(card.try_give(0, command), Err(AbortCode::DeviceState), "{command}");
        }
        card.give(0, "INIT");
        assert!(card.has(0, UserStatus::INIT | UserStatus::REF));
        card.give(0, "ME");
        assert_eq!((card.mode(0), card.get(0, "SEL")), (Mac4Mode::Disable, 1), "it waits for E");
        card.give(0, "E");
        assert_eq!(card.mode(0), Mac4Mode::Enable);
    }
}

#[test]
fn deinit_stops_the_axis_and_switches_it_off() {
    for kind in CARDS {
        let mut card = Card::enabled(kind);
        card.set(0, "WSV", if kind == CardType::Stp { 2_000 } else { 40 });
        card.set(0, "WAA", if kind == CardType::Stp { 100 } else { 2 });
        card.execute(0, "MS");
        card.run(1_000);
        card.give(0, "DEINIT");
        card.run(50);
        assert!(card.has(0, UserStatus::DR_EN), "it brakes");
        card.run(5_000);
        assert!(!card.has(0, UserStatus::DR_EN) && !card.has(0, UserStatus::INIT));
        assert_eq!(card.get(0, "RAV"), 0);
        card.set(0, "UWLP", 1_000_000);
    }
}

#[test]
fn an_initialisation_begins_to_count_at_the_axis_offset_and_an_absolute_encoder_does_not() {
    for (kind, relative) in [(CardType::Inc, true), (CardType::Stp, true), (CardType::Ssi, false)] {
        let mut card = Card::new(kind);
        if !relative {
            card.set(0, "UWET", 2);
        }
        card.set(0, "UWAO", 500);
        let mut card = card.on();
        let start = if relative { 500 } else { 8_388_608 + 500 };
        assert_eq!(card.position(0), start, "{kind:?}");
        card.set(0, "WTRT", 300);
        card.set(0, "WAP", start + 1_000);
        card.execute(0, "MP");
        card.run_until(|card| card.has(0, UserStatus::POS_END));
        card.execute(0, "MD");
        card.run(2_000);
        let reached = card.position(0);
        card.give(0, "INIT");
        let expected = if relative { 500 } else { reached };
        assert_eq!(card.position(0), expected, "{kind:?}");
        card.set(0, "WZP", 7);
        card.run(20);
        assert_eq!(card.position(0), 7);
        assert_eq!(card.get(0, "UWAO"), 500 + 7 - expected);
    }
}

/// Section 5.15, second example.
#[test]
fn on_the_fly_a_new_target_is_taken_at_once_and_off_the_fly_after_the_first() {
    for kind in CARDS {
        for off_fly in [false, true] {
            let mut card = Card::enabled(kind);
            card.give(0, if off_fly { "FLYOFF" } else { "FLYON" });
            assert_eq!(card.has(0, UserStatus::ON_FLY), !off_fly);
            let start = card.position(0);
            card.set(0, "WPV", if kind == CardType::Stp { 5_000 } else { 60 });
            card.set(0, "WTRT", 300);
            card.set(0, "WAP", start + 8_000);
            card.execute(0, "MP");
            card.run(200);
            card.set(0, "WAP", start + 4_000);
            card.give(0, "E");
            assert_eq!(card.get(0, "QUE"), i64::from(off_fly));
            let mut highest = 0;
            for _ in 0..4_000 {
                card.run(5);
                highest = highest.max(card.position(0) - start);
            }
            assert!((card.position(0) - start - 4_000).abs() <= 5, "{kind:?}: {}", card.describe());
            assert_eq!(highest > 7_900, off_fly, "{kind:?}: {highest}");
            assert!(card.has(0, UserStatus::POS_END));
        }
    }
}

/// Section 5.15, first example.
#[test]
fn off_the_fly_brake_waits_for_the_switch_and_the_stop_bit_does_not() {
    for kind in CARDS {
        let base = if kind == CardType::Ssi { 8_388_608.0 } else { 0.0 };
        let start = |off_fly| {
            let mut card =
                Card::arranged(kind, |_, plant| plant.positive_switch = Some(Position(base + 3_000.0))).on();
            card.give(0, if off_fly { "FLYOFF" } else { "FLYON" });
            card.set(0, "WLV", if kind == CardType::Stp { 50 } else { 1 });
            card.set(0, "WFV", if kind == CardType::Stp { 1_000 } else { 20 });
            card.set(0, "WDL", 2);
            card.execute(0, "MF");
            card.run(500);
            card
        };
        let mut card = start(false);
        card.execute(0, "MB");
        assert_eq!(card.mode(0), Mac4Mode::Brake);
        card.run(3_000);
        assert!(!card.has(0, UserStatus::JUS_END | UserStatus::HWL_P));

        let mut card = start(true);
        card.execute(0, "MB");
        assert_eq!((card.mode(0), card.get(0, "QUE")), (Mac4Mode::FindEdge, 1));
        card.run_until(|card| card.mode(0) == Mac4Mode::Brake);
        let distance = card.motor(0) - base - 3_000.0;
        assert!(distance.abs() < 30.0, "{kind:?}: {distance}");

        let mut card = start(true);
        card.execute(0, "MB");
        card.write(Address::new(0x2180, 1), 1 << 1).unwrap();
        assert_eq!((card.mode(0), card.get(0, "QUE")), (Mac4Mode::Brake, 0));
        assert_eq!(card.object(0x2180, 1), 0, "the controller takes the bit back");
        card.run(2_000);
        assert!(card.motor(0) - base < 2_900.0 && card.has(0, UserStatus::DR_EN));
    }
}

#[test]
fn instructions_wait_in_their_order_and_no_more_than_nine() {
    let mut card = Card::enabled(CardType::Stp);
    card.give(0, "FLYOFF");
    card.set(0, "WPV", 5_000);
    card.set(0, "WPA", 500);
    card.set(0, "WPD", 500);
    card.set(0, "WIRQ4", 9);
    for target in 1..=10 {
        card.set(0, "WAP", 100 * (target % 4));
        card.execute(0, "MP");
    }
    assert_eq!(card.get(0, "QUE"), 9);
    assert_eq!(card.try_give(0, "E"), Err(AbortCode::DeviceState));
    let mut places = Vec::new();
    let mut told = 0;
    for _ in 0..4_000 {
        card.run(8);
        let ends = card.get(0, "IRQ") >> 8;
        if ends != told {
            places.push(card.position(0));
            told = ends;
        }
    }
    assert_eq!(places, [100, 200, 300, 0, 100, 200, 300, 0, 100, 200]);
}

#[test]
fn a_stop_bit_stops_its_axis_and_disables_one_that_is_tested() {
    for kind in CARDS {
        let mut card = Card::new(kind);
        for axis in 0..4 {
            card.give(axis, "INIT");
        }
        card.set(3, "WDA", 100);
        card.execute(3, "UE");
        for axis in 0..3 {
            card.enable(axis);
            card.set(axis, "WSV", 20);
            card.execute(axis, "MS");
        }
        card.run(100);
        card.write(Address::new(0x2180, 1), 0b1000_1000).unwrap();
        card.run(20);
        let modes = [0, 1, 2, 3].map(|axis| card.mode(axis));
        assert_eq!(modes, [Mac4Mode::Speed, Mac4Mode::Brake, Mac4Mode::Speed, Mac4Mode::Disable]);
    }
}

#[test]
fn a_reset_brakes_all_axes_and_gives_every_parameter_its_default() {
    for kind in CARDS {
        let mut card = Card::new(kind);
        for axis in 0..2 {
            card.give(axis, "INIT");
            card.enable(axis);
            card.set(axis, "WAA", if kind == CardType::Stp { 50 } else { 1 });
            card.set(axis, "WSV", if kind == CardType::Stp { 2_000 } else { 30 });
            card.execute(axis, "MS");
        }
        card.set(2, "WMF", 77);
        card.set(0, "WWD", 9_000);
        card.run(500);
        card.give(0, "MR");
        card.run(50);
        assert_eq!([card.mode(0), card.mode(1)], [Mac4Mode::Reset; 2], "{}", card.describe());
        assert!(card.has(1, UserStatus::DR_EN));
        card.run(5_000);
        for axis in 0..4 {
            assert_eq!(card.mode(axis), Mac4Mode::Disable, "{}", card.describe());
            assert!(!card.has(axis, UserStatus::INIT) && !card.has(axis, UserStatus::DR_EN));
            assert_eq!([card.get(axis, "WSV"), card.get(axis, "WMF"), card.get(axis, "WWD")], [0, 1_000, 0]);
        }
    }
}

#[test]
fn what_a_parameter_acts_on_waits_for_e() {
    let mut card = Card::enabled(CardType::Inc);
    card.set(0, "WSV", 20);
    card.execute(0, "MS");
    card.run(500);
    card.set(0, "WSV", 40);
    card.run(500);
    assert_eq!(card.get(0, "RPS"), 20);
    card.give(0, "E");
    card.run(500);
    assert_eq!(card.get(0, "RPS"), 40);
}

#[test]
fn the_binary_scaling_halves_velocities() {
    for kind in CARDS {
        let mut card = Card::enabled(kind);
        let full = if kind == CardType::Stp { 8_000 } else { 160 };
        card.set(0, "WSV", full);
        card.set(0, "WSA", 1_000);
        card.set(0, "WSF", 2);
        card.execute(0, "MS");
        card.run(3_000);
        let expected = if kind == CardType::Stp { 2_000 * 32 / 1_000 } else { 40 };
        assert_eq!(card.get(0, "RPS"), expected, "{kind:?}");
    }
}

#[test]
fn relative_instructions_add_to_their_parameter_within_its_limits() {
    let mut card = Card::new(CardType::Inc);
    card.set(0, "UWLP", 100);
    let mut card = card.on();
    card.set(0, "WAP", 60);
    card.set(0, "WAP_R", -10);
    assert_eq!(card.get(0, "WAP"), 50);
    assert_eq!(card.try_set(0, "WAP_R", 51), Err(AbortCode::ValueTooHigh));
    assert_eq!(card.message(0, 71, 50).code, 71);
    assert_eq!(card.get(0, "WAP"), 100);
    assert_eq!(card.message(0, 70 + 256, 0).parameter, 100, "256 more reads");
}

#[test]
fn the_justification_velocity_of_a_stepper_stays_below_its_start_stop_frequency() {
    let mut card = Card::new(CardType::Stp);
    card.set(0, "WSSF", 200);
    assert_eq!(card.try_set(0, "WLV", 201), Err(AbortCode::ValueTooHigh));
    card.set(0, "WLV", 200);
    card.set(0, "WSSF", 150);
    assert_eq!(card.get(0, "WLV"), 150);
    assert_eq!(card.try_set(0, "WSSF", 50_001), Err(AbortCode::ValueTooHigh));
    card.set(0, "TURBO", 1);
    card.set(0, "WSSF", 50_001);
}

#[test]
fn boost_leads_a_motion_and_ends_with_it() {
    let mut card = Card::new(CardType::Stp);
    card.set(0, "WBT", 80);
    let mut card = card.on();
    assert!(!system(&card).intersects(SystemStatus::BOOST | SystemStatus::BOOST_LOCK));
    card.set(0, "WAP", -500);
    card.execute(0, "MP");
    card.run(40);
    assert!(system(&card).contains(SystemStatus::BOOST | SystemStatus::BOOST_LOCK));
    assert_eq!(card.position(0), 0);
    card.run(200);
    assert!(system(&card).contains(SystemStatus::BOOST | SystemStatus::BOOST_EN | SystemStatus::DIRECTION));
    card.run_until(|card| card.has(0, UserStatus::POS_END));
    card.run(200);
    assert!(!system(&card).contains(SystemStatus::BOOST));
    for _ in 0..100 {
        card.run(16);
        assert!(!system(&card).contains(SystemStatus::BOOST), "it stays off at rest");
    }
    assert!(system(&card).contains(SystemStatus::IN_POS | SystemStatus::SERVO_ON | SystemStatus::M_RDY));
}

#[test]
fn turbo_reaches_frequencies_that_are_not_there_otherwise_and_counts_tracking_ten_times() {
    let mut card = Card::new(CardType::Stp);
    card.set(0, "UWET", 0);
    card.set(0, "TURBO", 1);
    card.set(0, "WMF", 100_000);
    let mut card = card.on();
    assert!(system(&card).contains(SystemStatus::TURBO));
    card.execute(0, "VT");
    card.set(0, "WVT", 20_000);
    card.run(20_000);
    assert_eq!(card.get(0, "RPS"), 200_000 * 32 / 1_000, "{}", card.describe());
    card.execute(0, "MD");
}

#[test]
fn the_creep_phase_is_slow_and_the_way_before_it_is_not() {
    let mut card = Card::new(CardType::Stp);
    card.set(0, "WSSF", 200);
    card.set(0, "WLV", 100);
    card.set(0, "WSTC", 50);
    card.set(0, "WPV", 3_000);
    card.set(0, "WPA", 200);
    card.set(0, "WPD", 200);
    let mut card = card.on();
    card.set(0, "WAP", 3_000);
    card.execute(0, "MP");
    card.run_until(|card| card.position(0) >= 2_955);
    card.run(100);
    let before = card.position(0);
    card.run(80);
    assert!((card.position(0) - before - 8).abs() <= 1, "100 Hz: {}", card.position(0) - before);
    card.run_until(|card| card.has(0, UserStatus::POS_END));
    assert_eq!(card.position(0), 3_000);
}

/// Section 3.5.2: the host writes the position and sets the flag; the controller reads it and takes the flag back.
#[test]
fn an_axis_follows_the_positions_that_its_host_supplies() {
    for kind in CARDS {
        let mut card = Card::new(kind);
        for axis in [0, 2] {
            card.set(axis, "UWET", 4);
            card.set(axis, "UWEA", 0x330A + 0x400 * i64::from(axis));
            card.set(axis, "UWEB", 16);
            card.give(axis, "INIT");
            card.set(axis, "POS", 1_234);
            card.run(20);
            assert_eq!(card.position(axis), 0, "the flag is not set");
            card.set(axis, "FLAG", 0x8000);
            assert_eq!(card.get(axis, "FLAG"), 0);
            card.run(20);
            assert_eq!([card.get(axis, "RED"), card.get(axis, "RCT")], [1_234, 1_234]);
            assert_eq!(card.position(axis), 1_234, "{kind:?}");
        }
    }
}

#[test]
fn the_word_of_the_ssi_sensor_is_shown_before_and_after_its_shift() {
    let mut card = Card::new(CardType::Ssi);
    card.set(0, "UWET", 2);
    card.give(0, "INIT");
    let place: i64 = 8_388_608;
    assert_eq!(card.get(0, "RED"), (place ^ place >> 1) << 2, "Gray, two clocks after the lowest bit");
    assert_eq!([card.get(0, "RCT"), card.position(0)], [place, place]);
    assert!(card.has(0, UserStatus::GRAY));
    card.set(0, "UWSC", 3);
    card.give(0, "INIT");
    assert_ne!(card.position(0), place, "a false shift");
}

#[test]
fn the_position_of_a_stepper_is_shown_in_steps_and_in_increments() {
    let mut card = Card::new(CardType::Stp);
    card.set(0, "UWES", 500);
    card.set(0, "UWMS", 4_000);
    let mut card = card.on();
    card.set(0, "WMF", 10_000);
    card.set(0, "WZP", 4_000);
    card.run(20);
    assert_eq!([card.get(0, "RCP"), card.get(0, "RCPI")], [4_000, 2_000]);
}

#[test]
fn an_optimised_circular_axis_goes_the_shortest_way() {
    for (kind, code, way) in
        [(CardType::Inc, 2, 3_000), (CardType::Inc, 3, -1_000), (CardType::Stp, 3, -1_000)]
    {
        let mut card = Card::new(kind);
        card.set(0, "UWSH", code);
        card.set(0, "UWCR", 4_000);
        let mut card = card.on();
        let before = card.motor(0);
        card.set(0, "WPV", if kind == CardType::Stp { 2_000 } else { 40 });
        card.set(0, "WTRT", 200);
        card.set(0, "WAP", 3_000);
        card.execute(0, "MP");
        card.run_until(|card| card.has(0, UserStatus::POS_END));
        let moved = card.motor(0) - before;
        assert!((moved - f64::from(way)).abs() < 20.0, "{kind:?}: {moved}");
        assert!((card.position(0) - 3_000).abs() <= 5);
        assert_eq!(card.try_set(0, "WAP", 4_000), Err(AbortCode::ValueTooHigh));
    }
}

#[test]
fn the_signals_fc_are_shown_whatever_the_axes_do() {
    let mut card = Card::new(CardType::Inc);
    for (axis, input, bit) in [(0, Input::Probe1, 3), (0, Input::Probe2, 4), (1, Input::Probe1, 5)] {
        let now = card.now;
        card.device.plant(axis, now).unwrap().inject(PlantFault::StuckSwitch(input, true));
        card.run(20);
        assert_eq!(card.object(0x2180, 2) >> bit & 1, 1);
        assert_eq!(card.get(3, "RAS"), card.object(0x2180, 2));
    }
}

#[test]
fn the_interrupt_of_tracking_asks_for_each_value() {
    let mut card = Card::enabled(CardType::Inc);
    card.set(0, "WIRQ6", 0x66);
    card.execute(0, "VT");
    card.run(100);
    let before = card.get(0, "IRQ") >> 8;
    card.run(100);
    assert_eq!(card.get(0, "IRQ"), (before + 10) << 8 | 0x66, "one in each SP of 10 ms");
}
