//! What a master is told of its network and its slaves (CiA 302-2, objects 0x1F80-0x1F8A; CiA 302-3, 0x1F22, 0x1F26, 0x1F27).

use core::time::Duration;

use od::{Address, Dictionary, Value};

use super::BootStatus;
use crate::communication::{IDENTITY, NMT_STARTUP, parameter};

/// Concise DCF, by Node-ID.
const CONCISE_DCF: u16 = 0x1F22;
/// Expected configuration date, by Node-ID.
const EXPECTED_DATE: u16 = 0x1F26;
/// Expected configuration time, by Node-ID.
const EXPECTED_TIME: u16 = 0x1F27;
/// Slave assignment, by Node-ID.
const ASSIGNMENT: u16 = 0x1F81;
/// Boot time, in ms.
const BOOT_TIME: u16 = 0x1F89;
/// The sub-index of 0x1011 that restores a slave, by Node-ID.
const RESTORE: u16 = 0x1F8A;
/// Device type.
const DEVICE_TYPE: u16 = 0x1000;

/// What is compared of a slave: where it has it, where the master has what it expects, and what a difference means.
pub(super) const CHECKS: [(Address, u16, BootStatus); 5] = [
    (Address::new(DEVICE_TYPE, 0), 0x1F84, BootStatus::DeviceType),
    (Address::new(IDENTITY, 1), 0x1F85, BootStatus::VendorId),
    (Address::new(IDENTITY, 2), 0x1F86, BootStatus::ProductCode),
    (Address::new(IDENTITY, 3), 0x1F87, BootStatus::RevisionNumber),
    (Address::new(IDENTITY, 4), 0x1F88, BootStatus::SerialNumber),
];

/// 0x1F80: how the network is started.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Startup {
    bits: u64,
    /// How long mandatory slaves may take; `None` for ever.
    pub(super) boot_time: Option<Duration>,
}

impl Startup {
    pub(super) fn read(parameters: &Dictionary) -> Self {
        let boot_time = parameter(parameters, BOOT_TIME, 0);
        let boot_time = (boot_time > 0).then(|| Duration::from_millis(boot_time));
        Self { bits: parameter(parameters, NMT_STARTUP, 0), boot_time }
    }

    const fn has(self, bit: u32) -> bool {
        self.bits >> bit & 1 == 1
    }

    /// Whether this device is the NMT master.
    pub(super) const fn is_master(self) -> bool {
        self.has(0)
    }

    /// Whether all nodes are started at once when the mandatory ones have booted, not each after its boot.
    pub(super) const fn starts_all_at_once(self) -> bool {
        self.has(1)
    }

    /// Whether the master itself enters OPERATIONAL then.
    pub(super) const fn enters_operational(self) -> bool {
        !self.has(2)
    }

    /// Whether the master starts slaves at all.
    pub(super) const fn starts_slaves(self) -> bool {
        !self.has(3)
    }

    /// Whether a mandatory slave that is lost has all nodes reset.
    pub(super) const fn resets_all(self) -> bool {
        self.has(4)
    }

    /// Whether a mandatory slave that is lost has all nodes stopped; that goes before the reset.
    pub(super) const fn stops_all(self) -> bool {
        self.has(6)
    }
}

/// How a slave is guarded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GuardTimes {
    pub(super) period: Duration,
    /// Requests without an answer after which the slave is lost, at least one.
    pub(super) retries: u8,
}

/// 0x1F81 and all else that concerns one slave.
#[derive(Clone, Debug)]
pub(super) struct Assignment {
    pub(super) node_id: u8,
    bits: u64,
    pub(super) guard: Option<GuardTimes>,
    /// The expected values of [`CHECKS`]; zero for whatever it is.
    pub(super) expected: [u32; CHECKS.len()],
    /// The expected date and time of the configuration; zeros for none.
    pub(super) configured: [u32; 2],
    dcf: Value,
    /// The sub-index of 0x1011 to restore before the configuration, if any.
    pub(super) restore: Option<u8>,
}

impl Assignment {
    /// What `parameters` say of a node; `None` unless it is a slave of this master.
    pub(super) fn read(parameters: &Dictionary, node_id: u8) -> Option<Self> {
        let bits = parameter(parameters, ASSIGNMENT, node_id);
        let value = |index| parameter(parameters, index, node_id) as u32;
        let dcf = parameters.find(Address::new(CONCISE_DCF, node_id)).ok();
        let [_, retries, low, high, ..] = bits.to_le_bytes();
        let period = Duration::from_millis(u16::from_le_bytes([low, high]).into());
        let assignment = Self {
            node_id,
            bits,
            guard: (!period.is_zero()).then_some(GuardTimes { period, retries: retries.max(1) }),
            expected: CHECKS.map(|(_, index, _)| value(index)),
            configured: [value(EXPECTED_DATE), value(EXPECTED_TIME)],
            dcf: dcf.and_then(|slot| parameters.value(slot)).cloned().unwrap_or(Value::Fixed(0)),
            restore: None,
        };
        let restore = assignment.has(7).then(|| value(RESTORE) as u8).filter(|sub| *sub > 0);
        assignment.has(0).then_some(Self { restore, ..assignment })
    }

    const fn has(&self, bit: u32) -> bool {
        self.bits >> bit & 1 == 1
    }

    /// Whether the master configures and starts it.
    pub(super) const fn is_booted(&self) -> bool {
        self.has(2)
    }

    /// Whether the network waits for it.
    pub(super) const fn is_mandatory(&self) -> bool {
        self.has(3)
    }

    /// Whether it may not be reset while it is OPERATIONAL.
    pub(super) const fn is_kept_alive(&self) -> bool {
        self.has(4)
    }

    /// Whether its program is to be verified.
    pub(super) const fn needs_program(&self) -> bool {
        self.has(5)
    }

    /// Its concise DCF, empty for none.
    pub(super) fn dcf(&self) -> &[u8] {
        match &self.dcf {
            Value::Bytes(bytes) => bytes,
            Value::Fixed(_) => &[],
        }
    }
}
