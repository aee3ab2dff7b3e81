//! What a device says of a PDO beside the objects that hold its parameters.

use core::time::Duration;

use crate::{Address, Direction};

/// One PDO on the wire and on its way through the device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PdoTraits {
    /// RPDO or TPDO.
    pub direction: Direction,
    /// Its number, from 1.
    pub number: u16,
    /// The bytes that it has with the reserved ones behind its entries, at least: these are zero in a TPDO, and an RPDO
    /// may have them or not.
    pub length: u8,
    /// How long the device takes to process it; zero where it has the values at hand.
    pub time: Duration,
    /// What makes a TPDO faster, if anything does.
    pub scan: Option<Scan>,
}

/// A value that a device may read all the time, so that a TPDO need not wait for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scan {
    /// The value.
    pub entry: Address,
    /// The entry that says whether it is read all the time...
    pub switch: Address,
    /// ...by this bit of it.
    pub bit: u8,
    /// How long the device takes to process the TPDO then.
    pub time: Duration,
}
