//! Emergency producer: EMCY messages, error register 0x1001 and history 0x1003 (CiA 301 v4.2, section 7.2.7).

use std::collections::VecDeque;

use bitflags::bitflags;
use od::{Address, Dictionary, Instant};

use crate::Frame;
use crate::communication::{COB_ID_EMCY, ERROR_FIELD, ERROR_REGISTER, INHIBIT_TIME_EMCY, cob_id, parameter};
use crate::pdo::inhibit_time;

bitflags! {
    /// The error register, 0x1001.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct ErrorRegister: u8 {
        /// Set while there is any error.
        const GENERIC = 1 << 0;
        /// Current.
        const CURRENT = 1 << 1;
        /// Voltage.
        const VOLTAGE = 1 << 2;
        /// Temperature.
        const TEMPERATURE = 1 << 3;
        /// Communication: overrun, error state.
        const COMMUNICATION = 1 << 4;
        /// Device profile specific.
        const PROFILE = 1 << 5;
        /// Manufacturer specific.
        const MANUFACTURER = 1 << 7;
    }
}

/// An error condition of this device or another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// Emergency error code. Zero only comes from others: an error of theirs is over.
    pub code: u16,
    /// Bits of the error register that it sets, beside `GENERIC`.
    pub register: ErrorRegister,
    /// Manufacturer-specific information.
    pub detail: [u8; 5],
}

impl Emergency {
    /// A frame was not processed because it was too short for its PDO (CiA 301 v4.2, table 26).
    pub(crate) const PDO_TOO_SHORT: u16 = 0x8210;
    /// A frame was longer than its PDO.
    pub(crate) const PDO_TOO_LONG: u16 = 0x8220;
    /// An MPDO was not processed because the node cannot take what it is addressed to.
    pub(crate) const DESTINATION: u16 = 0x8230;
    /// A SYNC had an unexpected length.
    pub(crate) const SYNC_LENGTH: u16 = 0x8240;
    /// The CAN controller is error passive.
    pub(crate) const ERROR_PASSIVE: u16 = 0x8120;
    /// A heartbeat or a guarding request was missing.
    pub(crate) const LIFE_GUARD: u16 = 0x8130;
    /// The CAN controller was off the bus.
    pub(crate) const BUS_OFF: u16 = 0x8140;
    /// An RPDO was missing.
    pub(crate) const RPDO_TIMEOUT: u16 = 0x8250;

    /// A communication error with the given code and detail.
    pub(crate) fn communication(code: u16, detail: [u8; 5]) -> Self {
        Self { code, register: ErrorRegister::COMMUNICATION, detail }
    }

    /// Whether it came from the node, not from the device behind it.
    fn is_of_this_node(&self) -> bool {
        matches!(
            self.code,
            Self::PDO_TOO_SHORT
                | Self::PDO_TOO_LONG
                | Self::DESTINATION
                | Self::SYNC_LENGTH
                | Self::ERROR_PASSIVE
                | Self::LIFE_GUARD
                | Self::BUS_OFF
                | Self::RPDO_TIMEOUT
        )
    }

    /// Whether it is the same error. Of those that several others may cause, each has its own.
    fn is(&self, other: &Self) -> bool {
        let is_by_cause = matches!(self.code, Self::LIFE_GUARD | Self::RPDO_TIMEOUT);
        self.code == other.code && (!is_by_cause || self.detail == other.detail)
    }

    /// The message of another device.
    pub(crate) fn decode([low, high, register, detail @ ..]: [u8; 8]) -> Self {
        let register = ErrorRegister::from_bits_retain(register);
        Self { code: u16::from_le_bytes([low, high]), register, detail }
    }
}

/// Errors that may stand at the same time; further ones are not told apart.
const MAX_ACTIVE: usize = 32;
/// Messages that may wait for the inhibit time; older ones are dropped.
const MAX_WAITING: usize = 16;

/// What is wrong, and what is still to be told of it.
#[derive(Debug, Default)]
pub(crate) struct Producer {
    active: Vec<Emergency>,
    waiting: VecDeque<[u8; 8]>,
    not_before: Instant,
}

impl Producer {
    /// Notes an error. It is told once, until [`Producer::clear`] ends it.
    pub(crate) fn raise(&mut self, communication: &mut Dictionary, emergency: Emergency) {
        let is_known = self.active.iter().any(|a| a.is(&emergency));
        if is_known || self.active.len() == MAX_ACTIVE {
            return;
        }
        self.active.push(emergency);
        record(communication, emergency);
        self.announce(communication, emergency.code, emergency.detail);
    }

    /// Ends the error `code`, if it stands.
    pub(crate) fn clear(&mut self, communication: &mut Dictionary, code: u16) {
        self.end_all(communication, |a| a.code == code);
    }

    /// Ends this one error, if it stands.
    pub(crate) fn end(&mut self, communication: &mut Dictionary, emergency: Emergency) {
        self.end_all(communication, |a| a.is(&emergency));
    }

    fn end_all(&mut self, communication: &mut Dictionary, is_over: impl Fn(&Emergency) -> bool) {
        let before = self.active.len();
        self.active.retain(|a| !is_over(a));
        if self.active.len() < before {
            self.announce(communication, 0, [0; 5]);
        }
    }

    /// Starts anew, as on power-on and on a reset of the communication: what is wrong with the device still is, and
    /// is told again.
    pub(crate) fn restart(&mut self, communication: &mut Dictionary) {
        let before = core::mem::take(self);
        let standing = before.active.into_iter().filter(|emergency| !emergency.is_of_this_node());
        standing.for_each(|emergency| self.raise(communication, emergency));
    }

    /// What stands.
    pub(crate) fn active(&self) -> &[Emergency] {
        &self.active
    }

    fn announce(&mut self, communication: &mut Dictionary, code: u16, detail: [u8; 5]) {
        let register = self.register();
        if let Ok(slot) = communication.find(Address::new(ERROR_REGISTER, 0)) {
            communication.set(slot, u64::from(register.bits()));
        }
        let [low, high] = code.to_le_bytes();
        let [a, b, c, d, e] = detail;
        if self.waiting.len() == MAX_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back([low, high, register.bits(), a, b, c, d, e]);
    }

    fn register(&self) -> ErrorRegister {
        let any = if self.active.is_empty() { ErrorRegister::empty() } else { ErrorRegister::GENERIC };
        self.active.iter().fold(any, |all, a| all | a.register)
    }

    /// The next message that may be sent now.
    pub(crate) fn poll(&mut self, now: Instant, communication: &Dictionary) -> Option<Frame> {
        if self.waiting.is_empty() || now < self.not_before {
            return None;
        }
        let Some(cob_id) = cob_id(communication, COB_ID_EMCY).filter(|cob_id| cob_id.is_valid()) else {
            self.waiting.clear();
            return None;
        };
        self.not_before = now + inhibit_time(parameter(communication, INHIBIT_TIME_EMCY, 0));
        self.waiting.pop_front().map(|message| Frame::new(cob_id.id(), &message))
    }

    /// When the next message may be sent.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        (!self.waiting.is_empty()).then_some(self.not_before)
    }
}

/// Puts an error in front of the history 0x1003.
fn record(communication: &mut Dictionary, emergency: Emergency) {
    let [a, b, ..] = emergency.detail;
    let entry = u64::from(emergency.code) | u64::from(a) << 16 | u64::from(b) << 24;
    let slot = |sub| communication.find(Address::new(ERROR_FIELD, sub)).ok();
    let slots: Vec<_> = (1..=254).map_while(slot).collect();
    let Some(count) = slot(0) else { return };
    let known = communication.raw(count).min(slots.len() as u64);
    for pair in slots.windows(2).rev() {
        if let [newer, older] = *pair {
            communication.set(older, communication.raw(newer));
        }
    }
    if let Some(newest) = slots.first() {
        communication.set(*newest, entry);
        communication.set(count, (known + 1).min(slots.len() as u64));
    }
}
