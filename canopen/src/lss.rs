//! The LSS slave (CiA 305 v3.0): a master gives a node its Node-ID and bit timing, and finds nodes that have none.
//!
//! The slave is in one of two states, waiting or configuration. What it is told is pending until the communication is
//! reset; what it is told to store is what it starts with.

/// The Node-ID of a node that has none.
pub const UNCONFIGURED: u8 = 0xFF;

/// From the master to the slaves.
pub(crate) const REQUEST: u16 = 0x7E5;
/// From a slave to the master.
pub(crate) const ANSWER: u16 = 0x7E4;

/// What an LSS master can store in a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LssSetting {
    /// 1-127, or [`UNCONFIGURED`].
    pub node_id: u8,
    /// Index in the table of bit timings (CiA 305 v3.0, section 4.2.4.2: 0 is 1000 kbit/s), if one was chosen.
    pub bit_timing: Option<u8>,
}

impl Default for LssSetting {
    fn default() -> Self {
        Self { node_id: UNCONFIGURED, bit_timing: None }
    }
}

impl LssSetting {
    /// The chosen bit rate in kbit/s; 0 stands for automatic detection.
    #[must_use]
    pub fn kbit_per_s(self) -> Option<u16> {
        BIT_RATES.get(usize::from(self.bit_timing?)).copied().flatten()
    }

    /// Whether a node can have this setting.
    #[must_use]
    pub fn is_valid(self) -> bool {
        is_node_id(self.node_id) && self.bit_timing.is_none_or(has_bit_timing)
    }
}

/// Bit timing table 0 in kbit/s; the last one is automatic detection.
const BIT_RATES: [Option<u16>; 10] =
    [Some(1000), Some(800), Some(500), Some(250), Some(125), None, Some(50), Some(20), Some(10), Some(0)];
/// The table that CiA 301 defines, the only one there is here.
const STANDARD_TABLE: u8 = 0;

/// Vendor-ID, product code, revision number and serial number: 0x1018.
pub type LssAddress = [u32; 4];

/// What the slave wants of its node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reaction {
    /// Nothing.
    None,
    /// Send this.
    Answer([u8; 8]),
    /// Store this, then call [`Slave::stored`].
    Store(LssSetting),
    /// Start with the pending Node-ID: the node had none.
    Start,
}

/// Command specifiers (CiA 305 v3.0, section 4.3).
pub(crate) mod command {
    pub(crate) const SWITCH_GLOBAL: u8 = 0x04;
    pub(crate) const CONFIGURE_NODE_ID: u8 = 0x11;
    pub(crate) const CONFIGURE_BIT_TIMING: u8 = 0x13;
    pub(crate) const ACTIVATE_BIT_TIMING: u8 = 0x15;
    pub(crate) const STORE: u8 = 0x17;
    /// To 0x43: one part of the address each.
    pub(crate) const SWITCH_SELECTIVE: u8 = 0x40;
    pub(crate) const SWITCHED: u8 = 0x44;
    /// To 0x4B: bounds of the parts of the address.
    pub(crate) const IDENTIFY: u8 = 0x46;
    pub(crate) const IDENTIFY_UNCONFIGURED: u8 = 0x4C;
    pub(crate) const IDENTIFIED: u8 = 0x4F;
    pub(crate) const UNCONFIGURED_IDENTIFIED: u8 = 0x50;
    pub(crate) const FASTSCAN: u8 = 0x51;
    /// To 0x5D: one part of the address each.
    pub(crate) const INQUIRE: u8 = 0x5A;
    pub(crate) const INQUIRE_NODE_ID: u8 = 0x5E;
}

/// Error codes of the answers.
mod error {
    pub(super) const NONE: u8 = 0;
    /// The Node-ID or bit timing is not supported.
    pub(super) const OUT_OF_RANGE: u8 = 1;
    /// What is to be stored could not be.
    pub(super) const STORAGE: u8 = 2;
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Mode {
    #[default]
    Waiting,
    Configuration,
}

/// One LSS slave.
#[derive(Debug, Default)]
pub(crate) struct Slave {
    mode: Mode,
    pending: LssSetting,
    /// Parts of the own address that the present switch selective has matched.
    selected: u8,
    /// Bounds of the own address that the present identification has met.
    identified: u8,
    /// The part of the address that fastscan looks at next.
    scanned: u8,
}

impl Slave {
    /// A slave that would start its node with this setting.
    pub(crate) fn new(pending: LssSetting) -> Self {
        Self { pending, ..Self::default() }
    }

    /// What takes effect when the communication is reset.
    pub(crate) fn pending(&self) -> LssSetting {
        self.pending
    }

    /// Whether it is in the state in which it takes a configuration.
    pub(crate) fn is_selected(&self) -> bool {
        self.mode == Mode::Configuration
    }

    /// Takes a message of the master to a node with this Node-ID and address.
    pub(crate) fn handle(&mut self, message: [u8; 8], node_id: u8, address: &LssAddress) -> Reaction {
        let [specifier, first, second, ..] = message;
        let number = number(message);
        match specifier {
            command::SWITCH_GLOBAL => self.switch(first, node_id),
            command::SWITCH_SELECTIVE..=0x43 => {
                self.select(specifier - command::SWITCH_SELECTIVE, number, address)
            }
            command::IDENTIFY..=0x4B => self.identify(specifier - command::IDENTIFY, number, address),
            command::IDENTIFY_UNCONFIGURED if self.is_unconfigured(node_id) => {
                answer(command::UNCONFIGURED_IDENTIFIED)
            }
            command::FASTSCAN if self.mode == Mode::Waiting && self.is_unconfigured(node_id) => {
                self.scan(message, address)
            }
            _ if self.mode == Mode::Waiting => Reaction::None,
            command::CONFIGURE_NODE_ID => self.configure_node_id(first),
            command::CONFIGURE_BIT_TIMING => self.configure_bit_timing(first, second),
            command::STORE => Reaction::Store(self.pending),
            command::INQUIRE..=0x5D => {
                let part = address.get(usize::from(specifier - command::INQUIRE)).copied().unwrap_or(0);
                let [a, b, c, d] = part.to_le_bytes();
                Reaction::Answer([specifier, a, b, c, d, 0, 0, 0])
            }
            command::INQUIRE_NODE_ID => Reaction::Answer([specifier, node_id, 0, 0, 0, 0, 0, 0]),
            // Activate bit timing among them: the rate of an interface is its owner's.
            _ => Reaction::None,
        }
    }

    /// The answer to the order to store, after it was tried.
    pub(crate) fn stored(is_stored: bool) -> [u8; 8] {
        let code = if is_stored { error::NONE } else { error::STORAGE };
        [command::STORE, code, 0, 0, 0, 0, 0, 0]
    }

    fn is_unconfigured(&self, node_id: u8) -> bool {
        node_id == UNCONFIGURED && self.pending.node_id == UNCONFIGURED
    }

    /// Switch state global. A node that has got its first Node-ID starts with it when it leaves configuration
    /// (CiA 305 v3.0, section 4.2.3).
    fn switch(&mut self, mode: u8, node_id: u8) -> Reaction {
        let was = self.mode;
        self.mode = match mode {
            0 => Mode::Waiting,
            1 => Mode::Configuration,
            _ => return Reaction::None,
        };
        (self.selected, self.identified) = (0, 0);
        let has_left = was == Mode::Configuration && self.mode == Mode::Waiting;
        if has_left && node_id == UNCONFIGURED && self.pending.node_id != UNCONFIGURED {
            return Reaction::Start;
        }
        Reaction::None
    }

    /// Switch state selective: the whole address, in order, selects the slave.
    fn select(&mut self, part: u8, number: u32, address: &LssAddress) -> Reaction {
        if self.mode != Mode::Waiting {
            return Reaction::None;
        }
        let is_next = part == 0 || part == self.selected;
        let matches = address.get(usize::from(part)) == Some(&number);
        self.selected = if is_next && matches { part + 1 } else { 0 };
        if usize::from(self.selected) < address.len() {
            return Reaction::None;
        }
        (self.selected, self.mode) = (0, Mode::Configuration);
        answer(command::SWITCHED)
    }

    /// Identify remote slave: vendor, product, and lowest and highest revision and serial number, in order.
    fn identify(&mut self, step: u8, number: u32, address: &LssAddress) -> Reaction {
        const LAST: u8 = 5;
        let [vendor, product, revision, serial] = *address;
        let is_met = match step {
            0 => vendor == number,
            1 => product == number,
            2 => revision >= number,
            3 => revision <= number,
            4 => serial >= number,
            _ => serial <= number,
        };
        let is_next = step == 0 || step == self.identified;
        self.identified = if is_next && is_met { step + 1 } else { 0 };
        if self.identified <= LAST {
            return Reaction::None;
        }
        self.identified = 0;
        answer(command::IDENTIFIED)
    }

    /// Fastscan (CiA 305 v3.0, section 4.2.8): the bits of one part of the address above `bit`, then the next part.
    fn scan(&mut self, message: [u8; 8], address: &LssAddress) -> Reaction {
        /// Whoever has no Node-ID is to answer, and the scan begins anew.
        const BEGIN: u8 = 0x80;
        let [_, _, _, _, _, bit, part, next] = message;
        if bit == BEGIN {
            self.scanned = 0;
            return answer(command::IDENTIFIED);
        }
        let Some(own) = address.get(usize::from(part)).filter(|_| part == self.scanned && bit < 32) else {
            return Reaction::None;
        };
        if (own ^ number(message)) & (u32::MAX << bit) != 0 {
            return Reaction::None;
        }
        self.scanned = next;
        if bit == 0 && next < part {
            self.mode = Mode::Configuration;
        }
        answer(command::IDENTIFIED)
    }

    fn configure_node_id(&mut self, node_id: u8) -> Reaction {
        let is_valid = is_node_id(node_id);
        if is_valid {
            self.pending.node_id = node_id;
        }
        outcome(command::CONFIGURE_NODE_ID, is_valid)
    }

    fn configure_bit_timing(&mut self, table: u8, timing: u8) -> Reaction {
        let is_valid = table == STANDARD_TABLE && has_bit_timing(timing);
        if is_valid {
            self.pending.bit_timing = Some(timing);
        }
        outcome(command::CONFIGURE_BIT_TIMING, is_valid)
    }
}

fn is_node_id(node_id: u8) -> bool {
    matches!(node_id, 1..=127 | UNCONFIGURED)
}

fn has_bit_timing(timing: u8) -> bool {
    BIT_RATES.get(usize::from(timing)).is_some_and(Option::is_some)
}

/// Bytes 1 to 4.
fn number(message: [u8; 8]) -> u32 {
    let [_, a, b, c, d, ..] = message;
    u32::from_le_bytes([a, b, c, d])
}

fn answer(specifier: u8) -> Reaction {
    Reaction::Answer([specifier, 0, 0, 0, 0, 0, 0, 0])
}

fn outcome(specifier: u8, is_done: bool) -> Reaction {
    let code = if is_done { error::NONE } else { error::OUT_OF_RANGE };
    Reaction::Answer([specifier, code, 0, 0, 0, 0, 0, 0])
}
