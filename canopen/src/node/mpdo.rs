//! Multiplexed PDOs of a node (CiA 301 v4.2, section 7.2.2.4).

use od::{AbortCode, Address, Data, Dictionary, Direction, Instant, Write};

use super::{Node, queue};
use crate::pdo::{self, Message, Mode, Reception, Tpdo};
use crate::{Cause, Emergency, Frame, NmtState};

impl Node {
    /// Sends `data` to `address` of the node `consumer`, of all nodes if that is 0, by TPDO `number` (from 1), which must be a
    /// valid one of destination address mode. That the consumer takes it is not confirmed.
    ///
    /// # Errors
    /// [`AbortCode::NoObject`] if there is no such TPDO, [`AbortCode::InvalidValue`] for a consumer above 127,
    /// [`AbortCode::DeviceState`] outside OPERATIONAL, within the inhibit time, and if the TPDO is another one.
    pub fn send_to(
        &mut self,
        now: Instant,
        number: u16,
        consumer: u8,
        address: Address,
        data: [u8; 4],
    ) -> Result<(), AbortCode> {
        let is_meant = |tpdo: &&mut Tpdo| Some(tpdo.parameters.number) == number.checked_sub(1);
        let tpdo = self.pdos.transmit.iter_mut().find(is_meant).ok_or(AbortCode::NoObject)?;
        if consumer > 127 {
            return Err(AbortCode::InvalidValue);
        }
        let message = Message { mode: Mode::Destination, node_id: consumer, address, data };
        let is_operational = self.state == NmtState::Operational;
        let frame = is_operational.then(|| tpdo.send_multiplexed(now, message)).flatten();
        queue(&mut self.outbox, &mut self.counters, frame.ok_or(AbortCode::DeviceState)?);
        Ok(())
    }

    /// Sends what has changed of the objects in the scanner lists.
    pub(super) fn send_scanned(&mut self, now: Instant, application: &Dictionary, has_changed: bool) {
        let Self { pdos, outbox, counters, node_id, .. } = self;
        for frame in pdos.scan(now, *node_id, application, has_changed) {
            queue(outbox, counters, frame);
        }
    }

    /// Takes a frame of the RPDO at `position`, which is a multiplexed one.
    pub(super) fn handle_mpdo(
        &mut self,
        now: Instant,
        position: usize,
        mode: Mode,
        frame: &Frame,
        application: &mut Dictionary,
    ) {
        let Some(rpdo) = self.pdos.receive.get_mut(position) else { return };
        let number = rpdo.number();
        let before = rpdo.reception;
        let (message, is_back) = rpdo.receive_multiplexed(now, frame);
        if is_back {
            self.restore_connection(Cause::Rpdo(number));
        }
        self.note_reception(position, before, frame.len());
        match message.filter(|message| message.mode == mode) {
            Some(message) if mode == Mode::Destination => self.take_addressed(message, application),
            Some(message) => {
                for next in 0.. {
                    let Some(target) = self.pdos.lists.targets(message).nth(next) else { break };
                    let is_taken = self.take_value(target, message.data, application).is_ok();
                    self.counters.refused_rpdos += u64::from(!is_taken);
                }
            }
            None => {}
        }
    }

    /// A value for this node, or for all: one that it cannot take is an error (CiA 301 v4.2, table 26).
    fn take_addressed(&mut self, message: Message, application: &mut Dictionary) {
        if message.node_id != 0 && message.node_id != self.node_id {
            return;
        }
        if self.take_value(message.address, message.data, application).is_ok() {
            self.clear(Emergency::DESTINATION);
            return;
        }
        self.counters.refused_rpdos += 1;
        let Address { index, sub } = message.address;
        let [low, high] = index.to_le_bytes();
        self.raise(Emergency::communication(Emergency::DESTINATION, [low, high, sub, 0, 0]));
    }

    fn take_value(
        &mut self,
        address: Address,
        data: [u8; 4],
        application: &mut Dictionary,
    ) -> Result<(), AbortCode> {
        let (slot, width) = pdo::field(application.schema(), Direction::Receive, address)?;
        let raw = od::bits::get(&data, 0, width);
        let write = Write { slot, data: Data::Raw(raw) };
        application.write(self.origin, &[write]).map_err(|refusal| refusal.code)
    }

    /// Tells an RPDO of a wrong length, and that there is none any more. `before` is what became of the one before.
    pub(super) fn note_reception(&mut self, position: usize, before: Reception, length: usize) {
        let Some(rpdo) = self.pdos.receive.get(position) else { return };
        let after = rpdo.reception;
        let [low, high] = rpdo.number().to_le_bytes();
        self.counters.short_rpdos += u64::from(after == Reception::TooShort);
        self.counters.long_rpdos += u64::from(after == Reception::TooLong);
        if let Some(code) = after.error() {
            self.raise(Emergency::communication(code, [low, high, length as u8, 0, 0]));
        }
        if let Some(code) = before.error()
            && self.pdos.receive.iter().all(|r| r.reception != before || !r.is_active())
        {
            self.clear(code);
        }
    }
}
