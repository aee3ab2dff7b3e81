//! The write gate: the only way from a bus into a dictionary.
//!
//! The order of checks is fixed, so that the abort code of a wrong access is predictable: the entry exists
//! (that is [`Dictionary::find`]), access, length, range, owner, veto.

use crate::{AbortCode, DataType, Dictionary, Entry, Slot, bits};

/// Where an access comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Origin {
    /// The kind of bus.
    pub bus: Bus,
    /// Which link of that kind, by its number in the configuration.
    pub link: u16,
    /// Which client on that link: an SDO server number, a connection.
    pub client: u16,
}

/// Who alone may command an axis: whoever is on a bus, not a single client of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Owner {
    /// The kind of bus.
    pub bus: Bus,
    /// Which link of that kind; `None` for all of them.
    pub link: Option<u16>,
}

impl Owner {
    /// Whether what comes from `origin` comes from the owner.
    #[must_use]
    pub fn is(self, origin: Origin) -> bool {
        self.bus == origin.bus && self.link.is_none_or(|link| link == origin.link)
    }
}

/// A command that the gate let through: who wrote what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Commanded {
    /// Who.
    pub origin: Origin,
    /// The entry.
    pub slot: Slot,
    /// What it holds now.
    pub raw: u64,
    /// Whether it held something else before.
    pub has_changed: bool,
    /// Whether it came with cyclic data.
    pub is_cyclic: bool,
}

/// A command that was refused, and with it the batch that it came in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RefusedCommand {
    /// Who.
    pub origin: Origin,
    /// The entry that was refused.
    pub slot: Slot,
    /// What it was to hold; none if what came has not the length of the entry.
    pub raw: Option<u64>,
    /// Why.
    pub code: AbortCode,
}

/// The kinds of bus an access may come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Bus {
    /// A CANopen network.
    CanOpen,
    /// Modbus clients.
    Modbus,
    /// The operator on this machine.
    Local,
}

/// What is to be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Data<'a> {
    /// Bytes as an SDO carries them: little endian, the length says the size.
    Bytes(&'a [u8]),
    /// A bit pattern that already has the width of the entry, as unpacked from a PDO.
    Raw(u64),
}

impl Data<'_> {
    pub(crate) fn raw(self) -> u64 {
        match self {
            Self::Raw(raw) => raw,
            Self::Bytes(bytes) => bits::from_le(bytes),
        }
    }
}

/// One item of a batch.
#[derive(Clone, Copy, Debug)]
pub struct Write<'a> {
    /// The entry.
    pub slot: Slot,
    /// What it is to hold.
    pub data: Data<'a>,
}

/// Why a batch was dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Position of the refused item in the batch.
    pub item: usize,
    /// The reason.
    pub code: AbortCode,
}

impl Dictionary {
    /// Writes the whole batch, or nothing.
    ///
    /// # Errors
    /// The first item that was refused, and why.
    pub fn write(&mut self, origin: Origin, batch: &[Write<'_>]) -> Result<(), Refusal> {
        self.pass(origin, batch, false)
    }

    /// As [`Dictionary::write`], for data that come again and again: a PDO.
    ///
    /// # Errors
    /// The first item that was refused, and why.
    pub fn write_cyclic(&mut self, origin: Origin, batch: &[Write<'_>]) -> Result<(), Refusal> {
        self.pass(origin, batch, true)
    }

    fn pass(&mut self, origin: Origin, batch: &[Write<'_>], is_cyclic: bool) -> Result<(), Refusal> {
        for (item, write) in batch.iter().enumerate() {
            if self.is_free(write) {
                continue;
            }
            if let Err(code) = self.check(origin, write) {
                if !is_cyclic && batch.iter().any(|write| self.is_command(write.slot)) {
                    let is_whole = !matches!(code, AbortCode::TooLong | AbortCode::TooShort);
                    let raw = is_whole.then(|| write.data.raw());
                    self.note_refused(RefusedCommand { origin, slot: write.slot, raw, code });
                }
                return Err(Refusal { item, code });
            }
        }
        for write in batch {
            self.commit(origin, write, is_cyclic);
        }
        Ok(())
    }

    /// [`Dictionary::write`], whoever owns the axes: for somebody on this machine who brings them to rest.
    ///
    /// # Errors
    /// The first item that was refused for another reason than its owner.
    pub fn write_for_any_owner(&mut self, origin: Origin, batch: &[Write<'_>]) -> Result<(), Refusal> {
        let owners = core::mem::take(&mut self.owners);
        let outcome = self.write(origin, batch);
        self.owners = owners;
        outcome
    }

    /// The first checks of the gate for a transfer whose data are still to come: access and, as far as it was
    /// announced, length. Returns the most bytes that the transfer may have.
    ///
    /// # Errors
    /// [`AbortCode::ReadOnly`], [`AbortCode::TooLong`] or [`AbortCode::TooShort`].
    pub fn admit(&self, slot: Slot, announced: Option<usize>) -> Result<usize, AbortCode> {
        let entry = self.schema().entry(slot).ok_or(AbortCode::NoObject)?;
        if !entry.access.is_writable() {
            return Err(AbortCode::ReadOnly);
        }
        announced.map_or(Ok(()), |length| check_length(entry, length))?;
        Ok(length_limits(entry).1)
    }

    /// Whether [`Dictionary::write`] would take this item: every check, no change.
    ///
    /// # Errors
    /// The abort code of the first check that fails.
    pub fn check(&self, origin: Origin, write: &Write<'_>) -> Result<(), AbortCode> {
        let entry = self.schema().entry(write.slot).ok_or(AbortCode::NoObject)?;
        if !entry.access.is_writable() {
            return Err(AbortCode::ReadOnly);
        }
        if let Data::Bytes(bytes) = write.data {
            check_length(entry, bytes.len())?;
        }
        check_value(entry, write.data)?;
        let owner = entry.command.and_then(|axis| *self.owners.get(usize::from(axis))?);
        if owner.is_some_and(|owner| !owner.is(origin)) {
            return Err(AbortCode::DeviceState);
        }
        entry.veto.map_or(Ok(()), |veto| veto(self, write.slot, write.data.raw()))
    }

    /// Whether no check can refuse this item, whoever writes it.
    #[inline]
    fn is_free(&self, write: &Write<'_>) -> bool {
        matches!(write.data, Data::Raw(_)) && self.schema.rule(write.slot).is_some_and(|rule| rule.is_free)
    }

    /// The checks that concern the data alone, whoever writes them: length, range, veto.
    pub(crate) fn check_stored(&self, slot: Slot, entry: &Entry, bytes: &[u8]) -> Result<(), AbortCode> {
        let data = Data::Bytes(bytes);
        check_length(entry, bytes.len())?;
        check_value(entry, data)?;
        entry.veto.map_or(Ok(()), |veto| veto(self, slot, data.raw()))
    }
}

fn check_length(entry: &Entry, length: usize) -> Result<(), AbortCode> {
    let (shortest, longest) = length_limits(entry);
    if length > longest {
        Err(AbortCode::TooLong)
    } else if length < shortest {
        Err(AbortCode::TooShort)
    } else {
        Ok(())
    }
}

/// Fewest and most bytes that may be written.
fn length_limits(entry: &Entry) -> (usize, usize) {
    entry.data_type.bytes().map_or((0, entry.max_length), |size| (size, size))
}

fn check_value(entry: &Entry, data: Data<'_>) -> Result<(), AbortCode> {
    match (entry.data_type, data) {
        (data_type, Data::Raw(_)) if data_type.bits().is_none() => Err(AbortCode::LengthMismatch),
        (DataType::Boolean, _) if data.raw() > 1 => Err(AbortCode::ValueTooHigh),
        (DataType::VisibleString, Data::Bytes(text))
            if !text.iter().all(|c| matches!(c, 0 | 0x20..=0x7E)) =>
        {
            Err(AbortCode::InvalidValue)
        }
        (data_type, _) => entry.range.map_or(Ok(()), |range| range.check(data_type, data.raw())),
    }
}
