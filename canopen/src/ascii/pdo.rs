//! The PDOs that a client exchanges: which it receives and what of them, and which it sends.
//!
//! As in CiA 309 an RPDO is one that the gateway receives, a TPDO one that it sends.

use od::{DataType, bits};

use super::answer::GatewayError;
use super::value::Form;
use super::words::{Words, unsigned};
use crate::{Frame, Id};

/// Numbers of PDOs.
const NUMBERS: core::ops::RangeInclusive<u16> = 1..=512;
/// Bits in a frame.
const MOST_BITS: usize = 64;
/// Values in a PDO.
const MOST_VALUES: u8 = 64;
/// The highest identifier of 11 bits.
const HIGHEST_ID: u16 = 0x7FF;

/// The number of a PDO.
pub(super) fn number(words: &mut Words<'_>) -> Result<u16, GatewayError> {
    words.number().ok().filter(|number| NUMBERS.contains(number)).ok_or(GatewayError::Syntax)
}

/// When a PDO is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Transmission {
    /// When a client writes it.
    Event,
    /// With the next SYNC after a client has written it.
    Acyclic,
    /// With every so-many-th SYNC.
    Cyclic(u8),
    /// When somebody asks for it by a remote frame.
    Remote,
}

/// What a client says of a PDO.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Setup {
    pub(super) number: u16,
    pub(super) id: u16,
    pub(super) transmission: Transmission,
    /// Bits of each value, in their order.
    pub(super) widths: Vec<u8>,
}

impl Setup {
    /// `number cob-id type count [index sub-index] data-type ...`; a gateway has no objects, so what stands before a data
    /// type is read and means nothing.
    pub(super) fn parse(words: &mut Words<'_>) -> Result<Self, GatewayError> {
        let (number, id) = (number(words)?, words.number::<u16>()?);
        let transmission = words.next().and_then(transmission).ok_or(GatewayError::Syntax)?;
        let count = words.number::<u8>()?;
        if id > HIGHEST_ID || count > MOST_VALUES {
            return Err(GatewayError::Syntax);
        }
        let mut widths = Vec::new();
        for _ in 0..count {
            if words.peek().is_some_and(|word| unsigned(word).is_some()) {
                let (_, _) = (words.number::<u16>()?, words.number::<u8>()?);
            }
            let form = words.next().and_then(Form::from_word).ok_or(GatewayError::Syntax)?;
            let is_number = !matches!(form, Form::Plain(DataType::TimeOfDay | DataType::TimeDifference));
            widths.push(form.bits().filter(|_| is_number).ok_or(GatewayError::Syntax)?);
        }
        let bits: usize = widths.iter().map(|width| usize::from(*width)).sum();
        if bits > MOST_BITS {
            Err(GatewayError::PdoLength)
        } else {
            Ok(Self { number, id, transmission, widths })
        }
    }

    fn bytes(&self) -> usize {
        self.widths.iter().map(|width| usize::from(*width)).sum::<usize>().div_ceil(8)
    }
}

fn transmission(word: &str) -> Option<Transmission> {
    let word = word.to_ascii_lowercase();
    match word.as_str() {
        "event" => Some(Transmission::Event),
        "rtr" => Some(Transmission::Remote),
        word => match word.strip_prefix("sync")?.parse().ok()? {
            0 => Some(Transmission::Acyclic),
            number @ 1..=240 => Some(Transmission::Cyclic(number)),
            _ => None,
        },
    }
}

/// A PDO that is received.
#[derive(Clone, Debug)]
pub(super) struct Rpdo {
    setup: Setup,
    /// What came last, if anything did.
    values: Option<Vec<u64>>,
}

impl Rpdo {
    pub(super) fn new(setup: Setup) -> Self {
        Self { setup, values: None }
    }

    /// Takes a frame. Whether it is this PDO, with all its bytes.
    pub(super) fn take(&mut self, frame: &Frame) -> bool {
        let is_it = frame.id == Id::Standard(self.setup.id) && !frame.is_remote;
        if !is_it || frame.len() < self.setup.bytes() {
            return false;
        }
        let mut offset = 0;
        let value = |width: &u8| {
            let value = bits::get(frame.payload(), offset, *width);
            offset += usize::from(*width);
            value
        };
        self.values = Some(self.setup.widths.iter().map(value).collect());
        true
    }

    /// The remote frame by which it is asked for, if it is one of those.
    pub(super) fn request(&self) -> Option<Frame> {
        let length = u8::try_from(self.setup.bytes()).ok()?;
        let is_remote = self.setup.transmission == Transmission::Remote;
        is_remote.then(|| Frame::remote(Id::Standard(self.setup.id), length))
    }

    /// `pdo number count value ...`, if there are values.
    pub(super) fn text(&self) -> Option<String> {
        let values = self.values.as_ref()?;
        let text = format!("pdo {} {}", self.setup.number, values.len());
        Some(values.iter().fold(text, |text, value| format!("{text} 0x{value:X}")))
    }
}

/// A PDO that is sent.
#[derive(Clone, Debug)]
pub(super) struct Tpdo {
    setup: Setup,
    data: [u8; 8],
    is_written: bool,
    /// SYNCs since it was sent last.
    syncs: u8,
}

impl Tpdo {
    pub(super) fn new(setup: Setup) -> Self {
        Self { setup, data: [0; 8], is_written: false, syncs: 0 }
    }

    /// Takes values, of which the low bits count; the frame that is to be sent now, if one is.
    pub(super) fn write(&mut self, values: &[u64]) -> Result<Option<Frame>, GatewayError> {
        match values.len().cmp(&self.setup.widths.len()) {
            core::cmp::Ordering::Less => return Err(GatewayError::Syntax),
            core::cmp::Ordering::Greater => return Err(GatewayError::PdoLength),
            core::cmp::Ordering::Equal => {}
        }
        let mut offset = 0;
        for (value, width) in values.iter().zip(&self.setup.widths) {
            bits::put(&mut self.data, offset, *width, *value);
            offset += usize::from(*width);
        }
        self.is_written = true;
        Ok((self.setup.transmission == Transmission::Event).then(|| self.frame()))
    }

    /// Takes a SYNC; the frame that is to be sent with it, if one is.
    pub(super) fn sync(&mut self) -> Option<Frame> {
        let is_due = match self.setup.transmission {
            Transmission::Event | Transmission::Remote => false,
            Transmission::Acyclic => core::mem::take(&mut self.is_written),
            Transmission::Cyclic(number) => {
                self.syncs = self.syncs.saturating_add(1);
                self.is_written && self.syncs >= number
            }
        };
        is_due.then(|| {
            self.syncs = 0;
            self.frame()
        })
    }

    /// Takes a remote frame; what answers it, if it asks for this PDO.
    pub(super) fn requested(&self, frame: &Frame) -> Option<Frame> {
        let is_asked = frame.is_remote && frame.id == Id::Standard(self.setup.id);
        let is_remote = self.setup.transmission == Transmission::Remote && self.is_written;
        (is_asked && is_remote).then(|| self.frame())
    }

    fn frame(&self) -> Frame {
        Frame::new(Id::Standard(self.setup.id), self.data.get(..self.setup.bytes()).unwrap_or_default())
    }
}
