//! The engine's objections to a write into its own objects, after the checks of the gate.

use od::{AbortCode, Address, Slot};

use crate::communication::{
    COB_ID_EMCY, COB_ID_SYNC, COB_ID_TIME, COMMUNICATION_CYCLE, EMCY_CONSUMER, ERROR_BEHAVIOUR, ERROR_FIELD,
    HEARTBEAT_CONSUMER, NMT_STARTUP, Objects, SYNC_COUNTER_OVERFLOW,
};
use crate::pdo::{Pdos, check_cob_id};
use crate::{CobId, heartbeat, sdo, sync, time};

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
        COB_ID_SYNC => sync::check_cob_id(objects.communication, new),
        COMMUNICATION_CYCLE => sync::check_cycle(raw),
        SYNC_COUNTER_OVERFLOW => sync::check_overflow(objects.communication, raw),
        COB_ID_TIME => time::check_cob_id(objects.communication, new),
        COB_ID_EMCY | EMCY_CONSUMER => check_cob_id(CobId(objects.communication.raw(slot) as u32), new),
        _ if sdo::is_cob_id(address) => check_cob_id(CobId(objects.communication.raw(slot) as u32), new),
        HEARTBEAT_CONSUMER => heartbeat::check(objects.communication, address.sub, raw),
        ERROR_BEHAVIOUR if raw > STOPPED => Err(AbortCode::InvalidValue),
        NMT_STARTUP if raw & !SELF_STARTING != 0 => Err(AbortCode::InvalidValue),
        // Writing zero clears the history; nothing else may be written (CiA 301 v4.2, section 7.5.2.4).
        ERROR_FIELD if raw != 0 => Err(AbortCode::InvalidValue),
        _ => pdos.check(objects.communication, objects.application.schema(), address, raw),
    }
}

/// The last behaviour that 0x1029 knows (CiA 301 v4.2, section 7.5.2.26).
const STOPPED: u64 = 2;
/// The bits of 0x1F80 that concern a device which is no NMT master.
const SELF_STARTING: u64 = 1 << 2 | 1 << 3;
