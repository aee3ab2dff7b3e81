//! What of the core may be looked at.

use canopen::Node;
use profiles::Device;

use super::{Core, Counters, LinkId, Unit};

impl Core {
    /// Whether all axes are at rest and off.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        self.units.iter().all(|(_, unit)| unit.device.is_quiet())
    }

    /// What was lost on the way.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// How much waits in each of the core's queues, by their names.
    pub fn queues(&self) -> impl Iterator<Item = (&'static str, usize)> {
        [
            ("wire", self.wire.len()),
            ("outbox", self.outbox.len()),
            ("notices", self.notices.len()),
            ("store-orders", self.orders.len()),
        ]
        .into_iter()
    }

    /// Frames on `link` that did not reach our nodes because too many were under way.
    #[must_use]
    pub fn dropped_on_wire(&self, link: LinkId) -> u64 {
        self.dropped_on_wire.get(usize::from(link.0)).copied().unwrap_or(0)
    }

    /// The devices, in the order of their positions.
    pub fn devices(&self) -> impl Iterator<Item = &Device> {
        self.units.iter().map(|(_, unit)| &unit.device)
    }

    /// The names of the devices with their positions, in the order of their places ([`Core::arrange`]).
    pub fn names(&self) -> impl Iterator<Item = (usize, &str)> {
        let mut units: Vec<(usize, &Unit)> = self.units.iter().collect();
        units.sort_by_key(|(_, unit)| unit.place);
        units.into_iter().map(|(device, unit)| (device, unit.name()))
    }

    /// The device at position `device`.
    #[must_use]
    pub fn device(&self, device: usize) -> Option<&Device> {
        self.units.get(device).map(|unit| &unit.device)
    }

    /// The nodes, in the order of their devices.
    pub fn nodes(&self) -> impl Iterator<Item = &Node> {
        self.units.iter().flat_map(|(_, unit)| &unit.members).map(|member| &member.node)
    }

    /// The nodes of the device at position `device`, and their links.
    pub fn nodes_of(&self, device: usize) -> impl Iterator<Item = (LinkId, &Node)> {
        let own = self.units.get(device).map_or(&[][..], |unit| &unit.members);
        own.iter().map(|member| (member.link, &member.node))
    }
}
