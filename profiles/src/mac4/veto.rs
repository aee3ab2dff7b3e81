//! What the gate refuses (section 6.3): instructions that the state of the axis does not allow, and values outside of
//! limits that other parameters give. Fixed limits are those of the entries.

use od::{AbortCode, Address, DataType, Dictionary, Slot, Veto};

use super::instruction::Kind;
use super::record::Look;
use super::setup::{Axes, EncoderType, MOST_WAITING, range};
use super::status::{OverallStatus, UserStatus};
use super::units::{HIGHEST_FREQUENCY, HIGHEST_TURBO_FREQUENCY};
use super::{Instruction, Mode, owner, record};

/// The objection to what is written at an entry of an axis.
pub(crate) fn veto(address: Address) -> Option<Veto> {
    let (_, instruction) = record::of_address(address)?;
    (instruction.kind() != Kind::Reading).then_some(check as Veto)
}

fn check(dictionary: &Dictionary, slot: Slot, raw: u64) -> Result<(), AbortCode> {
    let Some((look, instruction)) = Look::at(dictionary, slot) else { return Ok(()) };
    // No entry of the records is wider than 32 bits or unsigned beyond them.
    let data_type = dictionary.schema().entry(slot).map_or(DataType::Integer32, |entry| entry.data_type);
    let value = data_type.integer(raw) as i64;
    if instruction == Instruction::C || !look.takes_part(instruction) {
        return Ok(());
    }
    if look.has_errors() {
        return Err(AbortCode::DeviceState);
    }
    match instruction.kind() {
        Kind::Command => check_command(&look, instruction, value),
        Kind::ModeChange => check_mode(&look, instruction),
        Kind::System => check_system(&look, instruction, value),
        Kind::Parameter | Kind::Live => check_value(&look, instruction, value),
        Kind::Relative(of) => check_value(&look, of, look.get(of).saturating_add(value)),
        Kind::Reading => Ok(()),
    }
}

/// The answer where the state forbids.
fn allowed(is_allowed: bool) -> Result<(), AbortCode> {
    if is_allowed { Ok(()) } else { Err(AbortCode::DeviceState) }
}

fn within(value: i64, min: i64, max: i64) -> Result<(), AbortCode> {
    if value < min {
        Err(AbortCode::ValueTooLow)
    } else if value > max {
        Err(AbortCode::ValueTooHigh)
    } else {
        Ok(())
    }
}

impl Look<'_> {
    fn user(&self) -> UserStatus {
        UserStatus::from_bits_truncate(self.get(Instruction::RBS) as u32)
    }

    fn mode(&self, instruction: Instruction) -> Mode {
        Mode::from_code(self.get(instruction) & 0xFF).unwrap_or_default()
    }

    /// Whether an error has to be acknowledged first.
    fn has_errors(&self) -> bool {
        let overall = OverallStatus::from_bits_truncate(self.get(Instruction::RAS) as u32);
        self.user().intersects(UserStatus::ERRORS) || overall.intersects(OverallStatus::ERRORS)
    }

    fn is_initialised(&self) -> bool {
        self.user().contains(UserStatus::INIT)
    }

    /// Whether nobody has switched the axis on.
    fn is_off(&self) -> bool {
        self.mode(Instruction::RBS) == Mode::Disable && !owner::is_with_cia402(self)
    }

    /// Whether errors and modes matter to an instruction: the words of an external sensor come whatever is.
    fn takes_part(&self, instruction: Instruction) -> bool {
        !matches!(instruction, Instruction::POS | Instruction::FLAG)
    }
}

fn check_system(look: &Look<'_>, instruction: Instruction, value: i64) -> Result<(), AbortCode> {
    allowed(look.is_off())?;
    if instruction == Instruction::UWET && !has_sensor(look, EncoderType::of(value)) {
        return Err(AbortCode::InvalidValue);
    }
    let is_absolute = EncoderType::of(look.get(Instruction::UWET)).is_absolute();
    let is_circular = Axes::of(look.get(Instruction::UWSH)) != Axes::Linear;
    allowed(!(instruction == Instruction::UWEC && is_absolute && is_circular))
}

fn check_command(look: &Look<'_>, instruction: Instruction, value: i64) -> Result<(), AbortCode> {
    match instruction {
        Instruction::INIT => {
            allowed(look.is_off())?;
            let is_linear = Axes::of(look.get(Instruction::UWSH)) == Axes::Linear;
            let has_range = look.get(Instruction::UWLP) > look.get(Instruction::UWLN);
            if is_linear && !has_range { Err(AbortCode::MaxBelowMin) } else { Ok(()) }
        }
        Instruction::E => {
            let mode = look.mode(Instruction::SEL);
            allowed(look.get(Instruction::QUE) < MOST_WAITING as i64)?;
            check_change(look, mode)?;
            if mode == Mode::Positioning {
                check_target(look, look.get(Instruction::WAP))?;
            }
            Ok(())
        }
        Instruction::WZP => {
            let stands = look.get(Instruction::RPS) == 0 && look.get(Instruction::RAV) == 0;
            allowed(look.is_initialised() && stands)?;
            check_place(look, value)
        }
        Instruction::DEINIT => allowed(look.is_initialised()),
        _ => Ok(()),
    }
}

fn check_mode(look: &Look<'_>, instruction: Instruction) -> Result<(), AbortCode> {
    Mode::of(instruction).map_or(Ok(()), |mode| check_change(look, mode))
}

/// Whether the axis can go to a mode (sections 6.3.7, 5.7-5.10).
fn check_change(look: &Look<'_>, mode: Mode) -> Result<(), AbortCode> {
    allowed(look.is_initialised() && !owner::is_with_cia402(look))?;
    allowed(mode.may_follow(look.mode(Instruction::NEXT)))?;
    let switch_is_on = |instruction| look.get(instruction) != owner::OFF;
    let is_justified = match mode {
        Mode::SearchIndexCoarse | Mode::SearchIndex => has_index(look),
        Mode::Home => has_index(look) && switch_is_on(Instruction::UWRS),
        Mode::FindEdge => {
            let edge = look.get(Instruction::WDL);
            let is_circular = Axes::of(look.get(Instruction::UWSH)) != Axes::Linear;
            let switch = match edge {
                1 => Instruction::UWNS,
                2 => Instruction::UWPS,
                _ => Instruction::UWRS,
            };
            switch_is_on(switch) && !(is_circular && edge != 0)
        }
        Mode::Disable
        | Mode::Enable
        | Mode::Speed
        | Mode::Brake
        | Mode::Positioning
        | Mode::VelocityTracking
        | Mode::Test
        | Mode::PositionTracking
        | Mode::Reset => true,
    };
    allowed(is_justified)
}

/// Whether the card can measure so (table 4.2).
fn has_sensor(look: &Look<'_>, encoder: EncoderType) -> bool {
    match encoder {
        EncoderType::StepCounter => look.has(Instruction::WSSF),
        EncoderType::Absolute => look.has(Instruction::UWSC),
        EncoderType::Relative | EncoderType::ExternalRelative | EncoderType::ExternalAbsolute => true,
    }
}

/// Whether an incremental encoder is specified at the connector P2; an SSI card has none.
fn has_index(look: &Look<'_>) -> bool {
    !look.has(Instruction::UWSC) && EncoderType::of(look.get(Instruction::UWET)) == EncoderType::Relative
}

/// Limits that other parameters give.
fn check_value(look: &Look<'_>, instruction: Instruction, value: i64) -> Result<(), AbortCode> {
    let highest = if look.get(Instruction::TURBO) == 0 { HIGHEST_FREQUENCY } else { HIGHEST_TURBO_FREQUENCY };
    let is_stepper = look.has(Instruction::WSSF);
    match instruction {
        Instruction::WAP | Instruction::WAT => check_target(look, value),
        Instruction::WSSF => within(value, 1, highest),
        Instruction::WLV if is_stepper => within(value, 1, look.get(Instruction::WSSF)),
        Instruction::WDA if is_stepper => within(value, -highest, highest),
        Instruction::WDA => within(value, -2047, 2047),
        _ => Ok(()),
    }
}

/// Whether a position lies within the software limits or the turn, and within the range of an absolute sensor.
fn check_target(look: &Look<'_>, target: i64) -> Result<(), AbortCode> {
    let encoder = EncoderType::of(look.get(Instruction::UWET));
    let is_linear = Axes::of(look.get(Instruction::UWSH)) == Axes::Linear;
    check_place(look, target)?;
    if encoder.is_absolute() && is_linear {
        let (given, bits) = (look.get(Instruction::UWEC), look.get(Instruction::UWEB));
        let range = range(given, encoder, bits, look.has(Instruction::UWSC));
        let (offset, last) = (look.get(Instruction::UWAO), i64::try_from(range).unwrap_or(i64::MAX) - 1);
        within(target, offset, offset.saturating_add(last))?;
    }
    Ok(())
}

/// Whether a position lies within the software limits or the turn.
fn check_place(look: &Look<'_>, place: i64) -> Result<(), AbortCode> {
    match Axes::of(look.get(Instruction::UWSH)) {
        Axes::Linear => within(place, look.get(Instruction::UWLN), look.get(Instruction::UWLP)),
        Axes::Circular | Axes::CircularOptimised => within(place, 0, look.get(Instruction::UWCR) - 1),
    }
}
