//! Objects of the devices, read and written from this machine, and who listens to which network.

use std::sync::Arc;

use canopen::Node;
use od::{AbortCode, Address, Bus, Data, Dictionary, Instant, Origin, Slot, Value, Write};
use profiles::Profile;

use super::{Core, LinkId, Member, Unit};

/// Where the objects of a device from 0x2000 on begin; those before belong to its nodes.
const APPLICATION: u16 = 0x2000;
/// Somebody on this machine.
pub const LOCAL: Origin = Origin { bus: Bus::Local, link: 0, client: 0 };

/// Whether somebody on this machine who writes has to own the axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Authority {
    /// Commands are for their owner.
    Owner,
    /// The writes bring axes to rest: that the operator may do, whoever owns them.
    Stop,
}

/// A write that was refused; nothing of it has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WriteRefused {
    /// The entry.
    pub address: Address,
    /// Why.
    pub code: AbortCode,
}

impl Core {
    /// What a bus reads at `address` of a device, by its position; `node` is that of its node whose communication objects
    /// are meant.
    ///
    /// # Errors
    /// The abort code that an SDO client would get.
    pub fn read(&self, device: usize, node: usize, address: Address) -> Result<Value, AbortCode> {
        let Unit { device, members, .. } = self.units.get(device).ok_or(AbortCode::NoObject)?;
        if address.index < APPLICATION {
            let Member { node, .. } = members.get(node).ok_or(AbortCode::NoObject)?;
            return node.read(address).map(|(_, value)| value.clone());
        }
        let dictionary = device.dictionary();
        dictionary.read(find(dictionary, address)?).map(|(_, value)| value.clone())
    }

    /// Writes to a device, by its position, through the write gate: those of its objects from 0x2000 on as one batch, the
    /// communication objects of its node `node` one after the other before them. What is due runs first. Returns whether
    /// parameters are to be stored, which is done at [`Core::stored`].
    ///
    /// # Errors
    /// The first write that was refused. What belongs to the device itself has then not changed at all.
    pub fn write(
        &mut self,
        now: Instant,
        device: usize,
        node: usize,
        writes: &[(Address, Vec<u8>)],
        authority: Authority,
    ) -> Result<bool, WriteRefused> {
        if self.deadlines.is_due(device, now) {
            self.run_due(now, device);
        }
        let outcome = self.write_all(now, (device, node), writes, authority);
        self.settle(now, device);
        self.speak(now, device);
        self.pass(now);
        outcome.and_then(|order| order.map_or(Ok(false), |order| self.check_storing(device, node, order)))
    }

    /// Writes; the entry that ordered to store, if one did.
    fn write_all(
        &mut self,
        now: Instant,
        (device, number): (usize, usize),
        writes: &[(Address, Vec<u8>)],
        authority: Authority,
    ) -> Result<Option<Address>, WriteRefused> {
        let refused = |address: Address| move |code| WriteRefused { address, code };
        let Some(Unit { device, members, .. }) = self.units.get_mut(device) else { return Ok(None) };
        let mut order = None;
        let is_communication = |(address, _): &&(Address, Vec<u8>)| address.index < APPLICATION;
        for (address, bytes) in writes.iter().filter(is_communication) {
            let member = members.get_mut(number).ok_or(AbortCode::NoObject).map_err(refused(*address))?;
            let written = member.node.write(now, LOCAL, *address, bytes, device.dictionary_mut());
            if written.map_err(refused(*address))? {
                order = Some(*address);
            }
        }
        let dictionary = device.dictionary_mut();
        let mut batch = Vec::with_capacity(writes.len());
        for (address, bytes) in writes.iter().filter(|write| !is_communication(write)) {
            let slot = find(dictionary, *address).map_err(refused(*address))?;
            batch.push((*address, Write { slot, data: Data::Bytes(bytes) }));
        }
        if authority == Authority::Stop {
            // One that its vendor's words run is stopped by them.
            batch.retain(|(address, _)| !device.halt(now, axis_of(*address)));
        }
        let dictionary = device.dictionary_mut();
        let items: Vec<Write<'_>> = batch.iter().map(|(_, write)| *write).collect();
        let written = match authority {
            Authority::Owner => dictionary.write(LOCAL, &items),
            Authority::Stop => dictionary.write_for_any_owner(LOCAL, &items),
        };
        written.map_err(|refusal| WriteRefused {
            address: batch.get(refusal.item).map_or(Address::new(0, 0), |(address, _)| *address),
            code: refusal.code,
        })?;
        Ok(order)
    }

    /// Whether it is this node whose parameters are being stored: another one of the device may have been first.
    fn check_storing(&self, device: usize, node: usize, address: Address) -> Result<bool, WriteRefused> {
        let storing = self.units.get(device).is_some_and(|unit| unit.is_storing_for(node));
        if storing { Ok(true) } else { Err(WriteRefused { address, code: AbortCode::DeviceState }) }
    }

    /// The profile of a device, by its position.
    #[must_use]
    pub fn profile(&self, device: usize) -> Option<&Arc<Profile>> {
        self.units.get(device).map(|unit| unit.device.profile())
    }

    /// Our nodes on `link`, each with the position of its device.
    pub fn network(&self, link: LinkId) -> impl Iterator<Item = (usize, &Node)> {
        let members =
            self.units.iter().flat_map(|(device, unit)| unit.members.iter().map(move |m| (device, m)));
        members.filter(move |(_, member)| member.link == link).map(|(device, member)| (device, &member.node))
    }
}

/// Where an entry is: somebody on this machine also sees those that are not on CANopen.
fn find(dictionary: &Dictionary, address: Address) -> Result<Slot, AbortCode> {
    dictionary.schema().slot(address).map_or_else(|| dictionary.find(address), Ok)
}

/// The axis, from 0, that an object of a drive belongs to (CiA 402-1, object ranges of axes).
fn axis_of(Address { index, .. }: Address) -> usize {
    const FIRST: u16 = 0x6000;
    const DISTANCE: u16 = 0x800;
    usize::from(index.saturating_sub(FIRST) / DISTANCE)
}
