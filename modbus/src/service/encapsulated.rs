//! Function codes 17, 43/13 and 43/14: who a unit is, and its objects by index and sub-index.

use od::{Address, Data, Value, Write};

use super::{Outcome, Service};
use crate::pdu::{MEI_IDENTIFICATION, sdo_answer};
use crate::{Exception, IdentificationCode, MAX_PDU, SdoRequest};

/// The unit runs (section 6.13).
const RUN: u8 = 0xFF;
/// Extended identification, all at once or one by one (section 6.21).
const CONFORMITY: u8 = 0x83;
/// Where the application dictionary begins.
const APPLICATION: u16 = 0x2000;
/// Bytes of a PDU before the data of an SDO, and before the objects of an identification.
const SDO_HEADER: usize = 12;
const IDENTIFICATION_HEADER: usize = 7;

impl Service<'_, '_> {
    /// The server identifier is the unit identifier; vendor, product and revision follow in words.
    pub(super) fn report_server_id(&mut self) {
        let position = self.answer.len();
        self.answer.extend([0, self.client.unit, RUN]);
        let identity = self.target.identification;
        let longest = position + MAX_PDU - 1;
        for text in [&identity.vendor_name, " ", &identity.product_code, " ", &identity.revision] {
            self.answer.extend(text.as_bytes());
        }
        self.answer.truncate(longest);
        let count = self.answer.len() - position - 1;
        if let Some(place) = self.answer.get_mut(position) {
            *place = count as u8;
        }
    }

    pub(super) fn sdo(&mut self, request: &SdoRequest<'_>) -> Outcome {
        match *request {
            SdoRequest::Upload { address, offset, length } => self.upload(request, address, offset, length),
            SdoRequest::Download { address, data } => self.download(request, address, data),
        }
    }

    fn upload(&mut self, request: &SdoRequest<'_>, address: Address, offset: u16, length: u16) -> Outcome {
        let Self { target, answer, .. } = self;
        let dictionary = match target.communication {
            Some(communication) if address.index < APPLICATION => communication,
            Some(_) | None => &*target.dictionary,
        };
        let slot = dictionary.find(address)?;
        let (entry, value) = dictionary.read(slot)?;
        let raw = value.raw().to_le_bytes();
        let bytes: &[u8] = match value {
            Value::Bytes(bytes) => bytes.get(usize::from(offset)..).unwrap_or_default(),
            Value::Fixed(_) => {
                let bytes = entry.data_type.bytes().and_then(|size| raw.get(..size)).unwrap_or_default();
                let is_whole = offset == 0 && usize::from(length) == bytes.len();
                if is_whole { bytes } else { return Err(Exception::IllegalDataValue) }
            }
        };
        let most = usize::from(length).min(MAX_PDU - SDO_HEADER);
        let bytes = bytes.get(..most).unwrap_or(bytes);
        sdo_answer(answer, request, bytes.len() as u16);
        answer.extend(bytes);
        Ok(())
    }

    fn download(&mut self, request: &SdoRequest<'_>, address: Address, data: &[u8]) -> Outcome {
        if address.index < APPLICATION && self.target.communication.is_some() {
            return Err(Exception::IllegalDataAddress);
        }
        let slot = self.target.dictionary.find(address)?;
        let entry = self.target.dictionary.schema().entry(slot);
        let is_whole = entry.is_some_and(|entry| entry.data_type.bytes() == Some(data.len()));
        self.check_permission(slot, is_whole.then(|| od::bits::from_le(data)))?;
        let batch = [Write { slot, data: Data::Bytes(data) }];
        self.target.dictionary.write(self.client.origin, &batch).map_err(|refusal| refusal.code)?;
        sdo_answer(self.answer, request, 0);
        Ok(())
    }

    pub(super) fn identify(&mut self, code: IdentificationCode, object: u8) -> Outcome {
        let identity = self.target.identification;
        let is_known = identity.object(object).is_some();
        let is_single = code == IdentificationCode::Individual;
        if is_single && !is_known {
            return Err(Exception::IllegalDataAddress);
        }
        // A stream that is to begin nowhere begins at the beginning.
        let begins = identity.objects(code, object).next().is_some_and(|(first, _)| first == object);
        let first = if begins { object } else { 0 };
        let answer = &mut *self.answer;
        let start = answer.len() - 1;
        answer.extend([MEI_IDENTIFICATION, code as u8, CONFORMITY, 0, 0, 0]);
        let (mut count, mut more) = (0, None);
        for (id, text) in identity.objects(code, first) {
            if answer.len() - start + 2 + text.len() > MAX_PDU {
                more = Some(id);
                break;
            }
            answer.extend([id, text.len() as u8]);
            answer.extend(text);
            count += 1;
        }
        let header = answer.get_mut(start..start + IDENTIFICATION_HEADER);
        if let Some([.., more_follows, next, objects]) = header {
            (*more_follows, *next, *objects) =
                (if more.is_some() { 0xFF } else { 0 }, more.unwrap_or(0), count);
        }
        Ok(())
    }
}
