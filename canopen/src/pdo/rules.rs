//! What a bus may change of a PDO's parameters, and when (CiA 301 v4.2, sections 7.5.2.35-38).

use od::{AbortCode, Address, Dictionary, Mapping, Schema};

use super::parameters::{Parameters, Transmission, inhibit_time};
use crate::CobId;
use crate::sync::is_start_value;

/// Whether a COB-ID parameter may change from `old` to `new`: an identifier changes only while it is not valid,
/// and a valid one is not one of the restricted CAN-IDs.
pub(crate) fn check_cob_id(old: CobId, new: CobId) -> Result<(), AbortCode> {
    if !new.is_valid() {
        return Ok(());
    }
    if !new.is_configurable() {
        return Err(AbortCode::InvalidValue);
    }
    if old.is_valid() && !old.has_identifier_of(new) { Err(AbortCode::DeviceState) } else { Ok(()) }
}

/// Whether sub-index `sub` of a communication record may become `raw`.
pub(crate) fn check_communication(
    parameters: &Parameters,
    communication: &Dictionary,
    sub: u8,
    raw: u64,
) -> Result<(), AbortCode> {
    let cob_id = parameters.cob_id(communication);
    match sub {
        1 => check_cob_id(cob_id, CobId(raw as u32)),
        2 => Transmission::decode(raw as u8, parameters.direction).map(|_| ()).ok_or(AbortCode::InvalidValue),
        3 if cob_id.is_valid() && inhibit_time(raw) != parameters.inhibit(communication) => {
            Err(AbortCode::DeviceState)
        }
        6 if !is_start_value(raw) => Err(AbortCode::InvalidValue),
        6 if cob_id.is_valid() && raw != u64::from(parameters.sync_start(communication)) => {
            Err(AbortCode::DeviceState)
        }
        _ => Ok(()),
    }
}

/// A mapping changes only while its PDO is not valid.
pub(crate) fn check_mapping_change(
    parameters: &Parameters,
    communication: &Dictionary,
) -> Result<(), AbortCode> {
    if parameters.cob_id(communication).is_valid() { Err(AbortCode::UnsupportedAccess) } else { Ok(()) }
}

/// Whether sub-index `sub` of a mapping record may become `raw`: only while the PDO is not valid, entries only
/// while none is mapped, and only what exists, may be mapped and fits.
pub(crate) fn check_mapping(
    parameters: &Parameters,
    communication: &Dictionary,
    application: &Schema,
    sub: u8,
    raw: u64,
) -> Result<(), AbortCode> {
    check_mapping_change(parameters, communication)?;
    if sub == 0 {
        return parameters.mapping(communication, application, raw).map(|_| ());
    }
    if parameters.count(communication) != 0 {
        return Err(AbortCode::UnsupportedAccess);
    }
    if raw == 0 {
        return Ok(());
    }
    let [_, mapped_sub, low, high] = (raw as u32).to_le_bytes();
    let mapped = Address::new(u16::from_le_bytes([low, high]), mapped_sub);
    match Mapping::field(application, parameters.direction, raw as u32) {
        Err(AbortCode::NoObject) if communication.find(mapped).is_ok() => Err(AbortCode::NotMappable),
        result => result.map(|_| ()),
    }
}
