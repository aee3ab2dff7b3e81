//! The communication objects of a node, 0x1000-0x1FFF: `od` data that the engine owns.

use od::{AbortCode, Address, Data, Dictionary, Entry, Origin, RefusedCommand, Slot, Value, Write};

use crate::CobId;

/// Where the communication area ends; behind it are the device's own objects.
const END: u16 = 0x2000;

/// Whether `index` belongs to the communication area.
pub(crate) const fn is_communication(index: u16) -> bool {
    index < END
}

/// The SYNC COB-ID.
pub(crate) const COB_ID_SYNC: u16 = 0x1005;
/// Communication cycle period, in us.
pub(crate) const COMMUNICATION_CYCLE: u16 = 0x1006;
/// Synchronous window length, in us.
pub(crate) const SYNC_WINDOW: u16 = 0x1007;
/// The TIME COB-ID.
pub(crate) const COB_ID_TIME: u16 = 0x1012;
/// The EMCY COB-ID.
pub(crate) const COB_ID_EMCY: u16 = 0x1014;
/// Pre-defined error field.
pub(crate) const ERROR_FIELD: u16 = 0x1003;
/// Guard time, in ms.
pub(crate) const GUARD_TIME: u16 = 0x100C;
/// Life time factor.
pub(crate) const LIFE_TIME_FACTOR: u16 = 0x100D;
/// EMCY inhibit time, in 100 us.
pub(crate) const INHIBIT_TIME_EMCY: u16 = 0x1015;
/// Store parameters.
pub(crate) const STORE_PARAMETERS: u16 = 0x1010;
/// Restore default parameters.
pub(crate) const RESTORE_PARAMETERS: u16 = 0x1011;
/// Identity object.
pub(crate) const IDENTITY: u16 = 0x1018;
/// Verify configuration.
pub(crate) const VERIFY_CONFIGURATION: u16 = 0x1020;
/// Heartbeat consumer times, by producer.
pub(crate) const HEARTBEAT_CONSUMER: u16 = 0x1016;
/// Heartbeat producer time, in ms.
pub(crate) const HEARTBEAT_PRODUCER: u16 = 0x1017;
/// Synchronous counter overflow value.
pub(crate) const SYNC_COUNTER_OVERFLOW: u16 = 0x1019;
/// EMCY COB-IDs of others, by Node-ID.
pub(crate) const EMCY_CONSUMER: u16 = 0x1028;
/// What errors do to the NMT state.
pub(crate) const ERROR_BEHAVIOUR: u16 = 0x1029;
/// NMT startup (CiA 302-2).
pub(crate) const NMT_STARTUP: u16 = 0x1F80;
/// Error register.
pub(crate) const ERROR_REGISTER: u16 = 0x1001;
/// Communication parameters of RPDO 1.
pub(crate) const RPDO_COMMUNICATION: u16 = 0x1400;
/// Mapping parameters of RPDO 1.
pub(crate) const RPDO_MAPPING: u16 = 0x1600;
/// Communication parameters of TPDO 1.
pub(crate) const TPDO_COMMUNICATION: u16 = 0x1800;
/// Mapping parameters of TPDO 1.
pub(crate) const TPDO_MAPPING: u16 = 0x1A00;
/// PDOs a device may have each way.
pub(crate) const MAX_PDOS: u16 = 512;

/// The unsigned value at `index:sub`; zero when the profile does not have it.
pub(crate) fn parameter(dictionary: &Dictionary, index: u16, sub: u8) -> u64 {
    dictionary.find(Address::new(index, sub)).map_or(0, |slot| dictionary.raw(slot))
}

/// The COB-ID parameter `index`, if the profile has it.
pub(crate) fn cob_id(dictionary: &Dictionary, index: u16) -> Option<CobId> {
    dictionary.find(Address::new(index, 0)).ok().map(|slot| CobId(dictionary.raw(slot) as u32))
}

/// The nodes whose emergencies this node listens to, with their COB-IDs: the sub-index is the Node-ID
/// (CiA 301 v4.2, section 7.5.2.25).
pub(crate) fn emcy_producers(dictionary: &Dictionary) -> impl Iterator<Item = (u8, CobId)> {
    let cob_id = |producer| {
        let slot = dictionary.find(Address::new(EMCY_CONSUMER, producer)).ok()?;
        Some((producer, CobId(dictionary.raw(slot) as u32)))
    };
    (1..=127).filter_map(cob_id).filter(|(_, cob_id)| cob_id.is_valid())
}

/// Both dictionaries of a device, as an SDO client sees them: one.
pub(crate) struct Objects<'a> {
    pub(crate) communication: &'a mut Dictionary,
    pub(crate) application: &'a mut Dictionary,
}

impl Objects<'_> {
    /// The dictionary that holds `index`.
    pub(crate) fn area(&self, index: u16) -> &Dictionary {
        if is_communication(index) { self.communication } else { self.application }
    }

    /// What a client reads at `address`.
    ///
    /// An empty place of the error history has no data (CiA 301 v4.2, section 7.5.2.4).
    pub(crate) fn read(&self, address: Address) -> Result<(&Entry, &Value), AbortCode> {
        let area = self.area(address.index);
        let found = area.read(area.find(address)?)?;
        let is_empty =
            address.index == ERROR_FIELD && u64::from(address.sub) > parameter(area, ERROR_FIELD, 0);
        if is_empty { Err(AbortCode::NoData) } else { Ok(found) }
    }

    /// Writes one entry through its gate; `owner` is the engine's objection to its own objects.
    pub(crate) fn write(
        &mut self,
        origin: Origin,
        address: Address,
        bytes: &[u8],
        owner: impl FnOnce(&Objects<'_>, Slot, u64) -> Result<(), AbortCode>,
    ) -> Result<(), AbortCode> {
        let slot = self.area(address.index).find(address)?;
        let write = Write { slot, data: Data::Bytes(bytes) };
        if is_communication(address.index) {
            self.communication.check(origin, &write)?;
            owner(self, slot, od::bits::from_le(bytes))?;
        }
        let area =
            if is_communication(address.index) { &mut *self.communication } else { &mut *self.application };
        area.write(origin, &[write]).map_err(|refusal| refusal.code)
    }

    /// Takes note of a download that did not get as far as the gate, if it is of a command: none of those is the engine's.
    pub(crate) fn note_refused(&mut self, origin: Origin, address: Address, code: AbortCode) {
        let Ok(slot) = self.application.find(address) else { return };
        if !is_communication(address.index) && self.application.is_command(slot) {
            self.application.note_refused(RefusedCommand { origin, slot, raw: None, code });
        }
    }
}
