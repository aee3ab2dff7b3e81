//! Who commands an axis: the MAC4 vocabulary or CiA 402. The one that has switched the axis on; the other one's moving
//! commands are refused until it is off.

use axis::{Level, Levels};
use od::{AbortCode, Address, Dictionary, Slot};

use super::record::{Look, Record};
use super::{Instruction, Mode};
use crate::cia402::{Command, Controlword, Statusword};

/// The controlword and the statusword of the first axis, and how far those of the next are.
const CONTROLWORD: u16 = 0x6040;
const STATUSWORD: u16 = 0x6041;
const STRIDE: u16 = 0x800;

/// Objects to a controlword that commands more than "disable voltage" while the MAC4 vocabulary has the axis.
pub(crate) fn check_controlword(dictionary: &Dictionary, slot: Slot, raw: u64) -> Result<(), AbortCode> {
    let word = Controlword::from_bits_retain(raw as u16);
    let axis = dictionary.schema().address(slot).and_then(|at| at.index.checked_sub(CONTROLWORD));
    let axis = axis.and_then(|distance| u8::try_from(distance / STRIDE).ok()).unwrap_or(0);
    let mode = Look::of_axis(dictionary, axis).get(Instruction::RBS) & 0xFF;
    if mode != Mode::Disable as i64 && Command::decode(word) != Command::DisableVoltage {
        return Err(AbortCode::DeviceState);
    }
    Ok(())
}

/// Whether CiA 402 has the axis: SWITCHED ON or beyond, where bit 1 of the statusword is set.
pub(super) fn is_with_cia402(look: &Look<'_>) -> bool {
    let address = Address::new(STATUSWORD + STRIDE * u16::from(look.axis), 0);
    let word = Statusword::from_bits_retain(look.at_address(address) as u16);
    word.contains(Statusword::SWITCHED_ON)
}

/// The active levels of the inputs (section 4.5). The emergency stop is always low active, the general inputs are the
/// signals FC, which nobody interprets (section 2.2.3).
pub(super) fn levels(record: &Record, dictionary: &Dictionary) -> Levels {
    let level = |instruction| match record.get(dictionary, instruction) {
        OFF => Level::Unused,
        ACTIVE_LOW => Level::Low,
        _ => Level::High,
    };
    Levels {
        positive_limit: level(Instruction::UWPS),
        negative_limit: level(Instruction::UWNS),
        home: level(Instruction::UWRS),
        drive_fault: level(Instruction::UWSO),
        emergency_stop: Level::Low,
        ..Levels::default()
    }
}

/// What UWPS, UWNS, UWRS and UWSO may say beside "active high".
pub(super) const OFF: i64 = 0;
const ACTIVE_LOW: i64 = 1;
