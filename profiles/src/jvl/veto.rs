//! One axis, two vocabularies: what moves the motor by its registers is refused while the CiA 402 drive has it.
//!
//! JVL warns that mixing both "can corrupt the behaviour" (module manual, section 4.3.19); here it cannot.

use od::{AbortCode, Address, Dictionary, Slot, Veto};

use super::command::Command;
use super::fastmac::FastMac;
use crate::Role;

const STATUSWORD: Address = Address::new(0x6041, 0);

/// What the module objects to in the register with this role of a servo or a stepper.
pub(crate) fn of_register(role: Role, is_stepper: bool) -> Option<Veto> {
    match (role, is_stepper) {
        (Role::ModeReg, _) => Some(|dictionary, _, _| check(dictionary, true)),
        (Role::Command, false) => Some(|dictionary, _, raw| check(dictionary, moves_servo(raw as u32))),
        (Role::Command, true) => Some(|dictionary, _, raw| check(dictionary, moves_stepper(raw as u32))),
        (Role::ModuleCommand, false) => {
            Some(|dictionary, _, raw| check(dictionary, goes_on(raw, moves_servo)))
        }
        (Role::ModuleCommand, true) => {
            Some(|dictionary, _, raw| check(dictionary, goes_on(raw, moves_stepper)))
        }
        _ => None,
    }
}

/// Whether the module's command `raw` resets the motor, or is one for it that `moves`.
fn goes_on(raw: u64, moves: fn(u32) -> bool) -> bool {
    match Command::of(raw as u32) {
        Command::Motor(number) => moves(number),
        Command::ResetBoth => true,
        Command::None
        | Command::ResetModule
        | Command::SaveModule
        | Command::RestoreModule
        | Command::SaveMotor => false,
    }
}

/// What the module objects to in 0x2013.
pub(crate) fn of_fastmac(dictionary: &Dictionary, _: Slot, raw: u64) -> Result<(), AbortCode> {
    check(dictionary, FastMac::from_number(raw as u8) == Some(FastMac::ZeroSearch))
}

/// Whether this number in the command register of a MAC motor moves the motor, or takes its power.
fn moves_servo(number: u32) -> bool {
    const RESETS: [u32; 2] = [1, 2];
    let command = u8::try_from(number).ok().filter(|number| *number >= 128).and_then(FastMac::from_number);
    RESETS.contains(&number) || command == Some(FastMac::ZeroSearch)
}

/// The same for a MIS stepper.
fn moves_stepper(number: u32) -> bool {
    const RESETS: [u32; 2] = [267, 268];
    let command = u8::try_from(number).ok().filter(|number| *number < 128).and_then(FastMac::from_number);
    RESETS.contains(&number) || command == Some(FastMac::ZeroSearch)
}

fn check(dictionary: &Dictionary, is_motion: bool) -> Result<(), AbortCode> {
    if is_motion && is_operated(dictionary) { Err(AbortCode::DeviceState) } else { Ok(()) }
}

/// Whether 0x6041 shows OPERATION ENABLED, QUICK STOP ACTIVE or FAULT REACTION ACTIVE (IEC 61800-7-201, table of 0x6041).
fn is_operated(dictionary: &Dictionary) -> bool {
    let word = dictionary.schema().slot(STATUSWORD).map_or(0, |slot| dictionary.raw(slot));
    matches!(word & 0x6F, 0x27 | 0x07) || word & 0x4F == 0x0F
}
