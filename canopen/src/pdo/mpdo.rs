//! Multiplexed PDOs: one value with its address in each frame (CiA 301 v4.2, section 7.2.2.4, objects 0x1FA0-0x1FFF).
//!
//! A device takes MPDOs if it has an object dispatching list, and sends them if it has an object scanner list.

use core::time::Duration;

use od::{AbortCode, Address, Dictionary, Direction, Instant, Mapping, Schema, Slot};

/// Object scanner lists: what a producer sends in source address mode.
const SCANNER_LISTS: core::ops::RangeInclusive<u16> = 0x1FA0..=0x1FCF;
/// Object dispatching lists: what a consumer takes in source address mode.
const DISPATCHING_LISTS: core::ops::RangeInclusive<u16> = 0x1FD0..=0x1FFF;
/// The last sub-index of a list.
const LAST: u8 = 254;
/// Objects that a producer scans, at most.
const MAX_SCANNED: usize = 64;
/// Widest value in bits.
const WIDEST: u8 = 32;

/// Whose address an MPDO carries: the number of mapped objects that stands for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    /// The producer's: source address mode.
    Source = 0xFE,
    /// The consumer's: destination address mode.
    Destination = 0xFF,
}

impl Mode {
    /// The mode that a number of mapped objects stands for.
    pub(crate) fn of(count: u64) -> Option<Self> {
        [Self::Source, Self::Destination].into_iter().find(|mode| *mode as u64 == count)
    }
}

/// An MPDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Message {
    pub(crate) mode: Mode,
    /// Of the producer or the consumer; 0 is for all consumers.
    pub(crate) node_id: u8,
    pub(crate) address: Address,
    pub(crate) data: [u8; 4],
}

impl Message {
    pub(crate) fn decode([head, low, high, sub, data @ ..]: [u8; 8]) -> Self {
        let mode = if head & 0x80 == 0 { Mode::Source } else { Mode::Destination };
        let address = Address::new(u16::from_le_bytes([low, high]), sub);
        Self { mode, node_id: head & 0x7F, address, data }
    }

    pub(crate) fn encode(self) -> [u8; 8] {
        let head = match self.mode {
            Mode::Source => self.node_id & 0x7F,
            Mode::Destination => 0x80 | self.node_id & 0x7F,
        };
        let ([low, high], [a, b, c, d]) = (self.address.index.to_le_bytes(), self.data);
        [head, low, high, self.address.sub, a, b, c, d]
    }
}

/// Whether a mapping may become one of this mode: the device must have the lists, and one TPDO at most scans.
pub(crate) fn check_mode(
    mode: Mode,
    direction: Direction,
    communication: &Dictionary,
    is_scanning: bool,
) -> Result<(), AbortCode> {
    let mut lists = match direction {
        Direction::Receive => DISPATCHING_LISTS,
        Direction::Transmit => SCANNER_LISTS,
    };
    if !lists.any(|index| communication.schema().has_object(index)) {
        return Err(AbortCode::PdoLength);
    }
    let is_second = mode == Mode::Source && direction == Direction::Transmit && is_scanning;
    if is_second { Err(AbortCode::ParameterIncompatible) } else { Ok(()) }
}

/// Whether `index` is one of the lists.
pub(crate) fn is_list(index: u16) -> bool {
    SCANNER_LISTS.contains(&index) || DISPATCHING_LISTS.contains(&index)
}

/// Whether the entry at `address` of a list may become `raw`; zero is an empty place.
pub(crate) fn check_entry(
    communication: &Dictionary,
    application: &Schema,
    address: Address,
    raw: u64,
) -> Result<(), AbortCode> {
    if raw == 0 {
        return Ok(());
    }
    if DISPATCHING_LISTS.contains(&address.index) {
        return Dispatch::decode(raw).ok_or(AbortCode::InvalidValue)?.check(application);
    }
    let new = Block::decode(raw).ok_or(AbortCode::InvalidValue)?;
    new.check(application, Direction::Transmit)?;
    let others = entries(communication, SCANNER_LISTS).filter(|(other, _)| *other != address);
    let others: usize = others.filter_map(|(_, raw)| Block::decode(raw)).map(|b| usize::from(b.count)).sum();
    if others + usize::from(new.count) > MAX_SCANNED { Err(AbortCode::OutOfMemory) } else { Ok(()) }
}

/// Every entry of the lists with these indices.
fn entries(
    communication: &Dictionary,
    lists: core::ops::RangeInclusive<u16>,
) -> impl Iterator<Item = (Address, u64)> {
    let lists = lists.filter(|index| communication.schema().has_object(*index));
    let addresses = lists.flat_map(|index| (1..=LAST).map(move |sub| Address::new(index, sub)));
    addresses.filter_map(|address| Some((address, communication.raw(communication.find(address).ok()?))))
}

/// Entries of one object that follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Block {
    first: Address,
    count: u8,
}

impl Block {
    /// An entry of a scanner list: sub-index, index and number, from the low bits up.
    fn decode(raw: u64) -> Option<Self> {
        let [sub, low, high, count, ..] = raw.to_le_bytes();
        Self::new(Address::new(u16::from_le_bytes([low, high]), sub), count)
    }

    fn new(first: Address, count: u8) -> Option<Self> {
        let has_room = first.sub.checked_add(count).is_some();
        (count > 0 && has_room).then_some(Self { first, count })
    }

    fn addresses(self) -> impl Iterator<Item = Address> {
        (0..self.count).map(move |offset| self.at(offset))
    }

    fn at(self, offset: u8) -> Address {
        Address::new(self.first.index, self.first.sub.saturating_add(offset))
    }

    fn check(self, application: &Schema, direction: Direction) -> Result<(), AbortCode> {
        self.addresses().try_for_each(|address| field(application, direction, address).map(|_| ()))
    }
}

/// The entry that an MPDO may carry this way, and its width.
pub(crate) fn field(
    application: &Schema,
    direction: Direction,
    address: Address,
) -> Result<(Slot, u8), AbortCode> {
    let slot = application.find(address).map_err(|_| AbortCode::NoObject)?;
    let bits = application.entry(slot).and_then(|entry| entry.data_type.bits());
    let width = bits.filter(|bits| *bits <= WIDEST).ok_or(AbortCode::NotMappable)?;
    let parameter = u32::from(address.index) << 16 | u32::from(address.sub) << 8 | u32::from(width);
    Mapping::field(application, direction, parameter)?;
    Ok((slot, width))
}

/// An entry of a dispatching list: the objects of a producer and where their values go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Dispatch {
    node_id: u8,
    remote: Block,
    local: Block,
}

impl Dispatch {
    /// From the low bits up: Node-ID, sub-index and index of the producer, sub-index and index here, number.
    fn decode(raw: u64) -> Option<Self> {
        let [node_id, sub, low, high, local_sub, local_low, local_high, count] = raw.to_le_bytes();
        let remote = Block::new(Address::new(u16::from_le_bytes([low, high]), sub), count)?;
        let local = Block::new(Address::new(u16::from_le_bytes([local_low, local_high]), local_sub), count)?;
        (1..=127).contains(&node_id).then_some(Self { node_id, remote, local })
    }

    fn check(self, application: &Schema) -> Result<(), AbortCode> {
        self.local.check(application, Direction::Receive)
    }

    /// Where the value of this producer's object goes.
    fn target(self, message: &Message) -> Option<Address> {
        let is_its = message.node_id == self.node_id && message.address.index == self.remote.first.index;
        let offset = message.address.sub.checked_sub(self.remote.first.sub)?;
        (is_its && offset < self.remote.count).then(|| self.local.at(offset))
    }
}

/// The lists of a node, and what of them was sent.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    dispatches: Vec<Dispatch>,
    scanned: Vec<Scanned>,
    /// Where the search for a change goes on, so that all get their turn.
    turn: usize,
    /// Whether there may be a change that was not sent.
    is_due: bool,
    not_before: Instant,
}

#[derive(Debug)]
struct Scanned {
    address: Address,
    slot: Slot,
    /// What was sent last.
    last: Option<u64>,
}

impl Lists {
    /// Takes over the lists as they are now.
    pub(crate) fn reload(&mut self, communication: &Dictionary, application: &Schema) {
        let dispatches = entries(communication, DISPATCHING_LISTS);
        self.dispatches.clear();
        self.dispatches.extend(dispatches.filter_map(|(_, raw)| Dispatch::decode(raw)));
        let blocks = entries(communication, SCANNER_LISTS).filter_map(|(_, raw)| Block::decode(raw));
        let scanned = blocks.flat_map(Block::addresses).filter_map(|address| {
            let (slot, _) = field(application, Direction::Transmit, address).ok()?;
            Some(Scanned { address, slot, last: None })
        });
        self.scanned.clear();
        self.scanned.extend(scanned.take(MAX_SCANNED));
        self.start();
    }

    /// Starts anew, as on entering OPERATIONAL: everything is sent once.
    pub(crate) fn start(&mut self) {
        self.scanned.iter_mut().for_each(|scanned| scanned.last = None);
        self.turn = 0;
        self.is_due = !self.scanned.is_empty();
    }

    /// Where the value in an MPDO of source address mode goes: nowhere, or to one place for each entry that has it.
    pub(crate) fn targets(&self, message: Message) -> impl Iterator<Item = Address> {
        self.dispatches.iter().filter_map(move |dispatch| dispatch.target(&message))
    }

    /// Looks whether something may have changed.
    pub(crate) fn notice(&mut self, has_changed: bool) {
        self.is_due |= has_changed && !self.scanned.is_empty();
    }

    /// The next value that has changed, if one may be sent; `inhibit` between two of them.
    pub(crate) fn poll(
        &mut self,
        now: Instant,
        node_id: u8,
        inhibit: Duration,
        application: &Dictionary,
    ) -> Option<Message> {
        if !self.is_due || now < self.not_before {
            return None;
        }
        let count = self.scanned.len();
        for position in (0..count).map(|offset| (self.turn + offset) % count) {
            let Some(Scanned { address, slot, last }) = self.scanned.get_mut(position) else { continue };
            let raw = application.raw(*slot);
            if *last != Some(raw) {
                *last = Some(raw);
                self.turn = position + 1;
                self.not_before = now + inhibit;
                let data = (raw as u32).to_le_bytes();
                return Some(Message { mode: Mode::Source, node_id, address: *address, data });
            }
        }
        self.is_due = false;
        None
    }

    /// When something may be sent that waits.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.is_due.then_some(self.not_before)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_lists_are_read_as_the_standard_prints_them() {
        let block = Block { first: Address::new(0x6000, 1), count: 3 };
        assert_eq!(Block::decode(0x0360_0001), Some(block));
        let local = Block { first: Address::new(0x6200, 5), count: 3 };
        let dispatch = Dispatch { node_id: 0x22, remote: block, local };
        assert_eq!(Dispatch::decode(0x0362_0005_6000_0122), Some(dispatch));
        for bad in [0x0060_0001, 0xFF60_0001, 0] {
            assert_eq!(Block::decode(bad), None, "{bad:08X}");
        }
        for bad in [0x0362_0005_6000_0100, 0x0362_0005_6000_0180, 0x0062_0005_6000_0122] {
            assert_eq!(Dispatch::decode(bad), None, "{bad:016X}");
        }
    }

    proptest! {
        #[test]
        fn a_message_keeps_every_bit(message: [u8; 8]) {
            prop_assert_eq!(Message::decode(message).encode(), message);
        }
    }
}
