//! Registers: function codes 3, 4, 6, 16, 22 and 23.
//!
//! A request that reads may cover a part of a value; one that writes covers all of it, because half a value would be
//! another value for as long as the other half is missing.

use od::{AbortCode, Slot};

use super::{FORBIDDEN, Outcome, Service};
use crate::map::{Window, Word};
use crate::{Dialect, Exception, Target};

impl<'t> Service<'_, 't> {
    pub(super) fn read_registers(&mut self, start: u16, quantity: u16) -> Outcome {
        let window = self.readable(start, quantity)?;
        self.append(window);
        Ok(())
    }

    pub(super) fn write_register(&mut self, address: u16, value: [u8; 2]) -> Outcome {
        self.store(address, &value)?;
        self.say(&[address, u16::from_be_bytes(value)]);
        Ok(())
    }

    pub(super) fn write_registers(&mut self, start: u16, values: &[u8]) -> Outcome {
        self.store(start, values)?;
        self.say(&[start, (values.len() / 2) as u16]);
        Ok(())
    }

    pub(super) fn mask_write(&mut self, address: u16, and: u16, or: u16) -> Outcome {
        let window = self.readable(address, 1)?;
        let shown = |word: &Word| word.part(self.target.dictionary.shown(word.slot));
        let present = window.words.iter().flatten().next().map_or(0, shown);
        self.store(address, &(present & and | or & !and).to_be_bytes())?;
        self.say(&[address, and, or]);
        Ok(())
    }

    /// What cannot be read is refused before anything is written.
    pub(super) fn read_write(
        &mut self,
        read_start: u16,
        read_quantity: u16,
        write_start: u16,
        values: &[u8],
    ) -> Outcome {
        let window = self.readable(read_start, read_quantity)?;
        self.store(write_start, values)?;
        self.append(window);
        Ok(())
    }

    fn window(&self, start: u16, quantity: u16) -> Result<Window<'t>, Exception> {
        let map = self.target.map;
        // JVL's registers have 32 bits and begin at even addresses.
        if map.dialect() == Dialect::Jvl && !start.is_multiple_of(2) {
            return Err(Exception::IllegalDataAddress);
        }
        map.window(self.target.dictionary, start, quantity).ok_or(Exception::IllegalDataAddress)
    }

    /// The window, if everything in it may be read. In JVL's registers what may only be written reads as zero.
    fn readable(&self, start: u16, quantity: u16) -> Result<Window<'t>, Exception> {
        let window = self.window(start, quantity)?;
        let is_secret = |word: &Word| self.target.dictionary.read(word.slot).is_err();
        if window.is_exact && window.words.iter().flatten().any(is_secret) {
            return Err(Exception::IllegalDataAddress);
        }
        Ok(window)
    }

    fn append(&mut self, window: Window<'_>) {
        self.answer.push((2 * window.words.len()) as u8);
        let first = self.answer.len();
        self.answer.resize(first + 2 * window.words.len(), 0);
        let Service { target: Target { dictionary, .. }, answer, .. } = self;
        let (places, _) = answer.get_mut(first..).unwrap_or_default().as_chunks_mut();
        // Neighbours mostly belong to one value.
        let mut last: Option<(Slot, u64)> = None;
        for (place, word) in places.iter_mut().zip(window.words) {
            let Some(word) = *word else { continue };
            let value = match last {
                Some((slot, value)) if slot == word.slot => value,
                _ => dictionary.shown(word.slot),
            };
            last = Some((word.slot, value));
            *place = word.part(value).to_be_bytes();
        }
    }

    /// Writes all `values` from `start` on, or none.
    fn store(&mut self, start: u16, values: &[u8]) -> Outcome {
        let quantity = (values.len() / 2) as u16;
        let Window { words, is_exact } = self.window(start, quantity)?;
        if !self.client.permissions.may_write(start, usize::from(quantity)) {
            return Err(self.forbid(words, values));
        }
        let (values, _) = values.as_chunks();
        let mut at = 0;
        while let Some(word) = words.get(at) {
            let Some(word) = *word else {
                at += 1;
                continue;
            };
            let next = at + usize::from(word.count);
            let Some(given) = values.get(at..next).filter(|_| word.index == 0) else {
                return Err(self.misfit(words, word, AbortCode::LengthMismatch));
            };
            let value = self.target.map.joined(given);
            if is_exact && !fits(word, value) {
                return Err(self.misfit(words, word, AbortCode::ValueTooHigh));
            }
            self.collect(word.slot, value);
            at = next;
        }
        self.commit()
    }

    /// Refuses values for registers that the client may not write: of these, the first that is a command.
    #[cold]
    fn forbid(&mut self, words: &[Option<Word>], values: &[u8]) -> Exception {
        let is_command = |word: &Word| self.target.dictionary.is_command(word.slot);
        let mut known = words.iter().enumerate().filter_map(|(at, word)| Some((at, (*word)?)));
        let Some((at, first)) = known.find(|(_, word)| is_command(word)) else { return FORBIDDEN.into() };
        let (values, _) = values.as_chunks();
        let given = values.get(at..at + usize::from(first.count)).filter(|_| first.index == 0);
        let raw = given.map(|given| self.target.map.joined(given));
        self.refuse(true, first.slot, raw, FORBIDDEN)
    }

    /// Refuses values for `words`, of which the one for `word` is none of it.
    #[cold]
    fn misfit(&mut self, words: &[Option<Word>], word: Word, code: AbortCode) -> Exception {
        let is_command = words.iter().flatten().any(|word| self.target.dictionary.is_command(word.slot));
        self.refuse(is_command, word.slot, None, code)
    }
}

/// Whether `value`, which has as many bits as the registers of `word`, is one of its type: what the type does not have
/// is zero or the sign.
fn fits(word: Word, value: u64) -> bool {
    let width = 16 * u32::from(word.count);
    let unused = 64 - width;
    let extended = word.data_type.integer(value) as u64;
    // A pattern with zeros above a negative number is the same bits, as PDOs carry them.
    let bits = u32::from(word.data_type.bits().unwrap_or(0));
    let is_plain = bits >= 64 || value >> bits == 0;
    is_plain || (extended << unused) >> unused == value
}
