//! `[device.identity]`: who a device says it is (0x1018).

use core::ops::RangeInclusive;
use std::sync::Arc;

use profiles::reader::{Node, Table};
use profiles::{Identity, Profile};

const NUMBERS: RangeInclusive<u32> = 0..=u32::MAX;

/// Reads the table, if there is one, and gives the profile with what it says.
pub(crate) fn read(device: &mut Table<'_, '_>, profile: Option<Arc<Profile>>) -> Option<Arc<Profile>> {
    let Some(node) = device.get::<Node>("identity") else { return profile };
    let mut table = node.open(device.report);
    let identity = Identity {
        vendor_id: table.get_in("vendor_id", NUMBERS),
        product_code: table.get_in("product_code", NUMBERS),
        revision: table.get_in("revision", NUMBERS),
        serial: table.get_in("serial", NUMBERS),
    };
    table.finish();
    profile.map(|profile| Arc::new(Profile::clone(&profile).with_identity(identity)))
}
