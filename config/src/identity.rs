//! `[device.identity]`: who a device says it is (0x1018).

use core::ops::RangeInclusive;
use std::sync::Arc;

use profiles::reader::{Node, Table};
use profiles::{Identity, Profile};

const NUMBERS: RangeInclusive<u32> = 0..=u32::MAX;

/// Reads the table, if there is one, and gives the profile with what it says, and whether it has a serial number.
pub(crate) fn read(
    device: &mut Table<'_, '_>,
    profile: Option<Arc<Profile>>,
) -> (Option<Arc<Profile>>, bool) {
    let Some(node) = device.get::<Node>("identity") else { return (profile, false) };
    let mut table = node.open(device.report);
    let identity = Identity {
        vendor_id: table.get_in("vendor_id", NUMBERS),
        product_code: table.get_in("product_code", NUMBERS),
        revision: table.get_in("revision", NUMBERS),
        serial: table.get_in("serial", NUMBERS),
    };
    table.finish();
    let profile = profile.map(|profile| Arc::new(Profile::clone(&profile).with_identity(identity)));
    (profile, identity.serial.is_some())
}

/// The serial number of a device with this name: FNV-1a of 32 bits.
pub(crate) fn serial_of(name: &str) -> u32 {
    const OFFSET_BASIS: u32 = 0x811C_9DC5;
    const PRIME: u32 = 0x0100_0193;
    name.bytes().fold(OFFSET_BASIS, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(PRIME))
}
