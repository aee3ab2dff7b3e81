//! The engine's objections to a write into its own objects, after the checks of the gate.

use od::{AbortCode, Address, Slot};

use crate::CobId;
use crate::communication::{COB_ID_EMCY, COB_ID_SYNC, ERROR_FIELD, Objects};
use crate::pdo::{Pdos, check_cob_id};

/// Whether the communication entry at `address` may become `raw`.
pub(crate) fn check(
    pdos: &Pdos,
    objects: &Objects<'_>,
    address: Address,
    slot: Slot,
    raw: u64,
) -> Result<(), AbortCode> {
    let new = CobId(raw as u32);
    match address.index {
        COB_ID_SYNC => check_sync(new),
        COB_ID_EMCY => check_cob_id(CobId(objects.communication.raw(slot) as u32), new),
        // Writing zero clears the history; nothing else may be written (CiA 301 v4.2, section 7.5.2.4).
        ERROR_FIELD if raw != 0 => Err(AbortCode::InvalidValue),
        _ => pdos.check(objects.communication, objects.application.schema(), address, raw),
    }
}

/// This device consumes SYNC and does not produce it (bit 30).
fn check_sync(new: CobId) -> Result<(), AbortCode> {
    const GENERATES: u32 = 1 << 30;
    if new.0 & GENERATES == 0 && new.is_configurable() { Ok(()) } else { Err(AbortCode::InvalidValue) }
}
