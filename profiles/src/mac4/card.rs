//! What the axes of a card share: messages and their responses, errors of all axes, stop bits (sections 3.4, 3.5, 6.3).

use od::{AbortCode, Address, Bus, Data, DataType, Dictionary, Origin, Slot, Value, Write};

use super::Instruction;
use super::errors::FaultCode;
use super::instruction::Kind;
use super::record::{self, Record, integer, show};
use super::status::{OverallStatus, UserStatus};

/// A message writes through the gate as anybody does.
const MESSAGE: Origin = Origin { bus: Bus::Local, link: 0, client: u16::MAX };

/// Added to the code of a parameter's W instruction, it is that of its R instruction.
const READ: u16 = 0x100;

/// What the axes of a card share.
#[derive(Debug, Default)]
pub(crate) struct Card {
    /// Errors to be acknowledged.
    errors: OverallStatus,
    is_stopping: bool,
    has_message: bool,
    /// The axis of the last message that named one.
    last_axis: u8,
    responses: u8,
}

/// A message of the host.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Message {
    /// Number of the axis, from 0 on.
    pub(crate) axis: u8,
    code: u16,
    parameter: i64,
}

/// What a message has come to.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Answer {
    /// This was read.
    Value(i64),
    /// It was written, and the axis has to act.
    Done,
    /// It was refused.
    Refused(Refused),
}

/// Why a message was refused.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refused(FaultCode);

impl Refused {
    /// The bit of the user status that a refusal sets.
    pub(crate) fn user_bit(self) -> UserStatus {
        match self.0 {
            FaultCode::Syntax => UserStatus::SYN_F,
            FaultCode::LimitValue => UserStatus::LIMIT_F,
            FaultCode::Logical => UserStatus::LOGO_F,
            FaultCode::FalseAxis | FaultCode::Watchdog | FaultCode::EmergencyStop => UserStatus::empty(),
        }
    }
}

impl Card {
    /// Notes that the object of the card at `address` was written.
    pub(crate) fn note(&mut self, address: Address) {
        self.is_stopping |= address == record::STOP;
        self.has_message |= address == record::MESSAGE_CODE;
    }

    /// The axes whose stop bits were set; the bits are taken back.
    pub(crate) fn take_stops(&mut self, dictionary: &mut Dictionary) -> impl Iterator<Item = usize> + use<> {
        let bits = if core::mem::take(&mut self.is_stopping) { integer(dictionary, record::STOP) } else { 0 };
        show(dictionary, record::STOP, 0);
        // Bit 1 is that of axis 1, bit 7 that of axis 4 (table 3.2).
        (0..4).filter(move |axis| bits >> (2 * axis + 1) & 1 == 1)
    }

    /// The message that has come.
    pub(crate) fn take_message(&mut self, dictionary: &Dictionary) -> Option<Message> {
        core::mem::take(&mut self.has_message).then(|| Message {
            axis: u8::try_from(integer(dictionary, record::MESSAGE_AXIS)).unwrap_or(u8::MAX),
            code: u16::try_from(integer(dictionary, record::MESSAGE_CODE)).unwrap_or(0),
            parameter: integer(dictionary, record::MESSAGE_PARAMETER),
        })
    }

    /// Takes errors that concern all axes.
    pub(crate) fn report(&mut self, errors: OverallStatus) {
        self.errors |= errors;
    }

    /// C, whatever axis it was given for.
    pub(crate) fn acknowledge(&mut self) {
        self.errors = OverallStatus::empty();
    }

    /// There is no such axis: nobody goes on before that is acknowledged (section 6.3.1).
    pub(crate) fn refuse_axis(&mut self) -> Answer {
        self.report(OverallStatus::AXIS_F);
        Answer::Refused(Refused(FaultCode::FalseAxis))
    }

    /// The axis that the last message named.
    pub(crate) fn last_axis(&mut self, message: &Message, is_valid: bool) -> u8 {
        if is_valid {
            self.last_axis = message.axis;
        }
        self.last_axis
    }

    /// Shows the response to a message.
    pub(crate) fn respond(&mut self, message: &Message, answer: Answer, dictionary: &mut Dictionary) {
        self.responses = self.responses.wrapping_add(1);
        let user = record::slot(dictionary.schema(), message.axis, Instruction::RBS);
        let user = user.map_or(0, |slot| dictionary.integer(slot) as i64);
        let overall = integer(dictionary, record::OVERALL);
        let (code, parameter) = match answer {
            Answer::Value(value) => (i64::from(message.code), value),
            Answer::Done => (i64::from(message.code), user),
            Answer::Refused(Refused(code)) => (code as i64, if code.concerns_all() { overall } else { user }),
        };
        show(dictionary, record::RESPONSE_AXIS, i64::from(message.axis));
        show(dictionary, record::RESPONSE_CODE, code);
        show(dictionary, record::RESPONSE_PARAMETER, parameter);
        show(dictionary, record::RESPONSE_COUNT, i64::from(self.responses));
    }

    /// Shows the overall status on the card and on every axis.
    pub(crate) fn show<'r>(
        &self,
        live: OverallStatus,
        records: impl Iterator<Item = &'r Record>,
        dictionary: &mut Dictionary,
    ) {
        let bits = i64::from((self.errors | live).bits());
        show(dictionary, record::OVERALL, bits);
        records.for_each(|record| record.show(dictionary, Instruction::RAS, bits));
    }
}

impl Message {
    /// Reads what it asks for, or writes through the gate what it says.
    pub(crate) fn deliver(&self, dictionary: &mut Dictionary) -> Answer {
        let plain = Instruction::from_code(self.code & !READ);
        let slot = plain.and_then(|instruction| record::slot(dictionary.schema(), self.axis, instruction));
        let (Some(instruction), Some(slot)) = (plain, slot) else {
            return Answer::Refused(Refused(FaultCode::Syntax));
        };
        let is_read = instruction.kind() == Kind::Reading || self.code & READ != 0;
        match (is_read, dictionary.read(slot).is_ok()) {
            (true, true) => Answer::Value(dictionary.integer(slot) as i64),
            (true, false) => Answer::Refused(Refused(FaultCode::Syntax)),
            (false, _) => match self.write(instruction, slot, dictionary) {
                Ok(()) => Answer::Done,
                Err(code) => Answer::Refused(Refused(self.fault_code(code, dictionary))),
            },
        }
    }

    fn write(
        &self,
        instruction: Instruction,
        slot: Slot,
        dictionary: &mut Dictionary,
    ) -> Result<(), AbortCode> {
        let data_type = dictionary.schema().entry(slot).map_or(DataType::Unsigned8, |entry| entry.data_type);
        // The parameter of an instruction without one may be anything.
        let has_parameter = !matches!(instruction.kind(), Kind::Command | Kind::ModeChange)
            || instruction == Instruction::WZP;
        let has_parameter = has_parameter && !matches!(instruction, Instruction::USN | Instruction::USR);
        let parameter = if has_parameter { self.parameter } else { 1 };
        let value = Value::integer(data_type, parameter.into()).ok_or(AbortCode::ValueTooHigh)?;
        let write = Write { slot, data: Data::Raw(value.raw()) };
        dictionary.write(MESSAGE, &[write]).map_err(|refusal| refusal.code)
    }

    /// What stands for an abort code in a response.
    fn fault_code(&self, code: AbortCode, dictionary: &Dictionary) -> FaultCode {
        let value = |instruction| {
            let slot = record::slot(dictionary.schema(), self.axis, instruction);
            slot.map_or(0, |slot| dictionary.integer(slot) as u32)
        };
        let user = UserStatus::from_bits_truncate(value(Instruction::RBS));
        let overall = OverallStatus::from_bits_truncate(value(Instruction::RAS));
        match code {
            AbortCode::ValueTooHigh
            | AbortCode::ValueTooLow
            | AbortCode::InvalidValue
            | AbortCode::MaxBelowMin => FaultCode::LimitValue,
            _ => FaultCode::pending(user, overall).unwrap_or(FaultCode::Logical),
        }
    }
}
