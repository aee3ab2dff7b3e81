//! Whatever is commanded, by whom and in whatever order: set-points keep the limits, an axis without power coasts, and
//! errors stand in the way until they are acknowledged.

use axis::{DriveFault, Input, PlantFault};
use od::{AbortCode, Address};
use profiles::{Instruction, Mac4Mode, UserStatus};
use proptest::prelude::*;

use crate::bench::{CARDS, Card};

/// Software limits of the first axis.
const LIMIT: i64 = 3_000;

/// Something that happens to the first two axes.
#[derive(Clone, Debug)]
enum Event {
    /// An instruction with any value.
    Give(u8, usize, i64),
    /// A mode and E, by a batch or one after the other.
    Execute(u8, usize, bool),
    /// A message of anything.
    Message(i64, i64, i64),
    Stop(i64),
    Controlword(u8, i64),
    Break(u8, PlantFault),
    Repair(u8, PlantFault),
    Wait(u64),
}

const MODES: [&str; 12] = ["MD", "ME", "UE", "MB", "MC", "MF", "MH", "MI", "MP", "MS", "PT", "VT"];

const FAULTS: [PlantFault; 5] = [
    PlantFault::StuckSwitch(Input::DriveFault, false),
    PlantFault::StuckSwitch(Input::EmergencyStop, false),
    PlantFault::StuckSwitch(Input::PositiveLimit, false),
    PlantFault::DriveFault(DriveFault::OverCurrent),
    PlantFault::EncoderBreak,
];

fn events() -> impl Strategy<Value = Vec<Event>> {
    let axis = 0_u8..2;
    let value = prop_oneof![-100..100_i64, -5_000..5_000_i64, any::<i32>().prop_map(i64::from)];
    let fault = prop::sample::select(FAULTS.to_vec());
    let event = prop_oneof![
        6 => (axis.clone(), 0..Instruction::ALL.len(), value.clone()).prop_map(|(a, i, v)| Event::Give(a, i, v)),
        6 => (axis.clone(), 0..MODES.len(), any::<bool>()).prop_map(|(a, m, b)| Event::Execute(a, m, b)),
        1 => (-1..6_i64, 0..200_i64, value).prop_map(|(a, c, v)| Event::Message(a, c, v)),
        1 => (0..256_i64).prop_map(Event::Stop),
        2 => (axis.clone(), 0..32_i64).prop_map(|(a, w)| Event::Controlword(a, w)),
        1 => (axis.clone(), fault.clone()).prop_map(|(a, f)| Event::Break(a, f)),
        2 => (axis.clone(), fault).prop_map(|(a, f)| Event::Repair(a, f)),
        8 => (1..400_u64).prop_map(Event::Wait),
    ];
    prop::collection::vec(event, 1..80)
}

fn apply(card: &mut Card, event: &Event) {
    let now = card.now;
    match event {
        // WIRQ.. and the rest may be refused; that is a part of the traffic.
        Event::Give(axis, position, value) => {
            let mnemonic = Instruction::ALL[*position].mnemonic();
            let leaves_limits = ["UWLP", "UWLN", "UWSH", "UWAO", "WZP", "MR", "POS", "FLAG", "UWEA", "UWET"];
            if !leaves_limits.contains(&mnemonic) {
                let _ = card.try_set(*axis, mnemonic, *value);
            }
        }
        Event::Execute(axis, mode, at_once) => {
            let mode = MODES[*mode];
            if *at_once {
                let items = [mode, "E"].map(|mnemonic| (card.address(*axis, mnemonic).unwrap(), 1));
                let _ = card.batch(&items);
            } else if card.try_give(*axis, mode).is_ok() {
                let _ = card.try_give(*axis, "E");
            }
        }
        // Instruction 2 to 5, 20 to 46 and 102 would move the limits or their place.
        Event::Message(_, 20..=46 | 50 | 102, _) => {}
        Event::Message(axis, code, value) => {
            card.message(*axis & 0xFF, *code, *value);
        }
        Event::Stop(bits) => card.write(Address::new(0x2180, 1), *bits).unwrap(),
        Event::Controlword(axis, word) => {
            let _ = card.write(Address::new(0x6040 + 0x800 * u16::from(*axis), 0), *word);
        }
        Event::Break(axis, fault) => {
            card.device.plant(usize::from(*axis), now).unwrap().inject(*fault);
        }
        Event::Repair(axis, fault) => {
            card.device.plant(usize::from(*axis), now).unwrap().clear(*fault);
            card.give(*axis, "C");
        }
        Event::Wait(_) => {}
    }
}

/// What holds for an axis after every raster step.
struct Watch {
    demand: i64,
    was_on: bool,
    /// Looks since the power went, 2 ms apart.
    off: u32,
    /// Looks for which power has stayed that an error stands in the way of.
    lingers: u32,
}

impl Watch {
    fn look(&mut self, card: &Card, axis: u8) -> Result<(), TestCaseError> {
        let demand = card.object(0x60FC + 0x800 * u16::from(axis), 0);
        let (mode, user) = (card.mode(axis), card.user(axis));
        let is_on = user.contains(UserStatus::DR_EN);
        // In the mode "test" there is no set-point; CiA 402 has limits of its own.
        if is_on && self.was_on && mode.is_motion() {
            let beyond = |place: i64| (place.abs() - LIMIT).max(0);
            prop_assert!(beyond(demand) <= beyond(self.demand), "{mode:?} {} to {demand}", self.demand);
        }
        let off = if is_on { 0 } else { self.off + 1 };
        // The torque that is shown is that of the raster step, of up to 8 ms, at whose end the power went.
        if off > 5 {
            prop_assert_eq!(card.object(0x6077 + 0x800 * u16::from(axis), 0), 0, "without power no torque");
        }
        let is_with_cia402 = card.object(0x6041 + 0x800 * u16::from(axis), 0) & 2 != 0;
        let is_lingering =
            mode == Mac4Mode::Disable && user.intersects(UserStatus::ERRORS) && is_on && !is_with_cia402;
        let lingers = if is_lingering { self.lingers + 1 } else { 0 };
        // Power that CiA 402 gives back goes with the next raster step, of up to 8 ms.
        prop_assert!(lingers <= 5, "power that nobody may have");
        *self = Self { demand, was_on: is_on, off, lingers };
        Ok(())
    }
}

fn check(kind: profiles::CardType, events: &[Event]) -> Result<(), TestCaseError> {
    let mut card = Card::new(kind);
    for axis in 0..2 {
        card.set(axis, "UWLP", LIMIT);
        card.set(axis, "UWLN", -LIMIT);
        card.give(axis, "INIT");
        card.set(axis, "WSV", if kind == CARDS[2] { 10_000 } else { 200 });
        card.set(axis, "WFV", if kind == CARDS[2] { -2_000 } else { -50 });
        card.set(axis, "WSA", 500);
        card.execute(axis, "ME");
    }
    card.run(50);
    let mut watches =
        [0, 1].map(|axis| Watch { demand: card.position(axis), was_on: false, off: 0, lingers: 0 });
    for event in events {
        apply(&mut card, event);
        let millis = if let Event::Wait(millis) = event { *millis } else { 3 };
        for _ in 0..millis.div_ceil(2) {
            card.run(2);
            for (axis, watch) in [0, 1].into_iter().zip(&mut watches) {
                watch.look(&card, axis)?;
            }
        }
        for axis in 0..2 {
            if card.get(axis, "ERR") != 0 {
                prop_assert_eq!(card.try_set(axis, "WDL", 0), Err(AbortCode::DeviceState));
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

    #[test]
    fn any_traffic_on_a_card_with_encoders_keeps_the_limits(events in events()) {
        check(CARDS[0], &events)?;
    }

    #[test]
    fn any_traffic_on_a_card_with_absolute_encoders_keeps_the_limits(events in events()) {
        check(CARDS[1], &events)?;
    }

    #[test]
    fn any_traffic_on_a_card_for_steppers_keeps_the_limits(events in events()) {
        check(CARDS[2], &events)?;
    }
}
