//! What a request does to a unit.

mod bits;
mod encapsulated;
mod registers;

use od::{AbortCode, Data, Dictionary, Origin, Refusal, RefusedCommand, Slot, Write};

use crate::{Dialect, Exception, Identification, MAX_PDU, Map, Permissions, Request, function};

/// The unit that a request is for.
#[derive(Debug)]
pub struct Target<'a> {
    /// Its registers.
    pub map: &'a Map,
    /// Its objects from 0x2000 on.
    pub dictionary: &'a mut Dictionary,
    /// Its objects below, which SDOs may read.
    pub communication: Option<&'a Dictionary>,
    /// Who it is.
    pub identification: &'a Identification,
}

/// On whose behalf a request is served.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Client<'a> {
    pub(crate) origin: Origin,
    pub(crate) permissions: &'a Permissions,
    pub(crate) unit: u8,
}

/// What a client may not write at all is another access than it has.
const FORBIDDEN: AbortCode = AbortCode::UnsupportedAccess;

/// What is wrong with a request, or nothing.
type Outcome = Result<(), Exception>;

/// Serves one request and appends the PDU of the answer to `answer`. The exception, if it was one.
pub(crate) fn serve(
    client: Client<'_>,
    target: Option<Target<'_>>,
    request: &[u8],
    batch: &mut Vec<Write<'static>>,
    answer: &mut Vec<u8>,
) -> Option<Exception> {
    let start = answer.len();
    let code = request.first().copied().unwrap_or(0);
    answer.push(code);
    let dialect = target.as_ref().map(|target| target.map.dialect());
    let outcome = target.ok_or(Exception::GatewayTargetFailedToRespond).and_then(|target| {
        let request = Request::decode(request, target.map.dialect())?;
        batch.clear();
        Service { client, target, batch, answer }.perform(&request)
    });
    debug_assert!(answer.len() - start <= MAX_PDU, "an answer longer than a PDU");
    let exception = outcome.err().map(|exception| match (dialect, exception) {
        // JVL's modules have no 4 (Ethernet manual, section 7.2.4).
        (Some(Dialect::Jvl), Exception::ServerDeviceFailure) => Exception::IllegalDataValue,
        (_, exception) => exception,
    });
    if let Some(exception) = exception {
        answer.truncate(start);
        answer.extend([code | function::EXCEPTION, exception.code()]);
    }
    exception
}

/// A request being served.
struct Service<'s, 't> {
    client: Client<'s>,
    target: Target<'t>,
    batch: &'s mut Vec<Write<'static>>,
    answer: &'s mut Vec<u8>,
}

impl Service<'_, '_> {
    fn perform(&mut self, request: &Request<'_>) -> Outcome {
        match *request {
            Request::ReadBits { table, start, quantity } => self.read_bits(table, start, quantity),
            Request::ReadRegisters { start, quantity, .. } => self.read_registers(start, quantity),
            Request::WriteCoil { address, on } => self.write_coil(address, on),
            Request::WriteRegister { address, value } => self.write_register(address, value),
            Request::ReturnQueryData { data } => {
                self.answer.extend([0, 0]);
                self.answer.extend(data);
                Ok(())
            }
            Request::WriteCoils { start, quantity, states } => self.write_coils(start, quantity, states),
            Request::WriteRegisters { start, values } => self.write_registers(start, values),
            Request::ReportServerId => {
                self.report_server_id();
                Ok(())
            }
            Request::MaskWrite { address, and, or } => self.mask_write(address, and, or),
            Request::ReadWrite { read_start, read_quantity, write_start, values } => {
                self.read_write(read_start, read_quantity, write_start, values)
            }
            Request::Sdo(request) => self.sdo(&request),
            Request::Identification { code, object } => self.identify(code, object),
        }
    }

    /// Appends words as they stand on the wire.
    fn say(&mut self, words: &[u16]) {
        words.iter().for_each(|word| self.answer.extend(word.to_be_bytes()));
    }

    /// Puts an item into the batch.
    fn collect(&mut self, slot: Slot, raw: u64) {
        self.batch.push(Write { slot, data: Data::Raw(raw) });
    }

    /// Writes what was collected, or nothing.
    fn commit(&mut self) -> Outcome {
        let refused = |Refusal { code, .. }| Exception::from(code);
        self.target.dictionary.write(self.client.origin, self.batch).map_err(refused)
    }

    /// Whether the client may write the entry `slot`, which is to hold `raw`, by other means than its registers.
    fn check_permission(&mut self, slot: Slot, raw: Option<u64>) -> Outcome {
        let Client { permissions, .. } = self.client;
        let has_permitted_registers = || {
            let registers = self.target.map.registers_of(slot);
            registers.into_iter().any(|(first, count)| permissions.may_write(first, count))
        };
        if permissions.is_unrestricted() || has_permitted_registers() {
            return Ok(());
        }
        Err(self.refuse(self.target.dictionary.is_command(slot), slot, raw, FORBIDDEN))
    }

    /// Refuses what does not get as far as the write gate; who keeps the refusals of the gate has this one among them, if it
    /// is of a command.
    fn refuse(&mut self, is_command: bool, slot: Slot, raw: Option<u64>, code: AbortCode) -> Exception {
        if is_command {
            let origin = self.client.origin;
            self.target.dictionary.note_refused(RefusedCommand { origin, slot, raw, code });
        }
        code.into()
    }
}
