//! What the devices have stored, and what they want to be stored.
//!
//! A node that is told to store passes the order on. The core then takes a copy of everything that the device will
//! have stored, which its owner fetches by [`Core::poll_store`], stores as a whole and confirms by [`Core::stored`].
//! Only then is it what the next reset goes back to, and the client of the node has its answer.

use canopen::{Emergency, ErrorRegister, LssSetting, Order};
use od::{AbortCode, Instant, Saved};
use profiles::StoreOrder;

use super::{Core, Member, Unit};

/// Everything that one device has stored.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Parameters {
    /// Objects from 0x2000 on.
    pub application: Saved,
    /// Each node, in the order of the device's places.
    pub nodes: Vec<NodeParameters>,
}

/// Everything that one node has stored.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NodeParameters {
    /// Its communication objects.
    pub communication: Saved,
    /// What an LSS master has set.
    pub lss: LssSetting,
}

impl NodeParameters {
    /// Whether everything has its default.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.communication.is_empty() && self.lss == LssSetting::default()
    }
}

impl Parameters {
    /// Whether everything has its default.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.application.is_empty() && self.nodes.iter().all(NodeParameters::is_empty)
    }
}

/// An order under way.
#[derive(Debug)]
pub(super) struct Storing {
    /// The node that gave it, by its position; none if it was the device itself.
    member: Option<usize>,
    parameters: Parameters,
}

impl Unit {
    /// Whether an order of its node at this position is under way.
    pub(super) fn is_storing_for(&self, node: usize) -> bool {
        self.storing.as_ref().is_some_and(|storing| storing.member == Some(node))
    }

    /// Gives the device what it has stored, before it starts. Gives how many values do not fit it and are left out.
    pub fn load(&mut self, now: Instant, parameters: Parameters) -> usize {
        let Self { device, members, .. } = self;
        let mut left_out = device.dictionary_mut().set_saved(parameters.application);
        device.reset(now);
        let mut nodes = parameters.nodes.into_iter();
        for (Member { node, .. }, saved) in members.iter_mut().zip(&mut nodes) {
            left_out += node.set_saved(saved.communication);
            node.set_lss(saved.lss);
        }
        left_out + nodes.map(|saved| saved.communication.iter().count()).sum::<usize>()
    }

    /// What the device has stored cannot be read: it has its defaults, and its masters are told.
    pub fn lose_parameters(&mut self) {
        let register = ErrorRegister::empty();
        for Member { node, .. } in &mut self.members {
            node.raise(Emergency { code: PARAMETERS_LOST, register, detail: [0; 5] });
        }
    }
}

/// "Loss of parameters" (IEC 61800-7-201, error codes of 0x603F).
const PARAMETERS_LOST: u16 = 0x6310;

impl Core {
    /// Gives a device what it has stored; to be called before [`Core::start`]. Gives how many values do not fit the
    /// device and are left out.
    pub fn load(&mut self, now: Instant, device: usize, parameters: Parameters) -> usize {
        self.units.get_mut(device).map_or(0, |unit| unit.load(now, parameters))
    }

    /// What a device has stored cannot be read: it has its defaults, and its masters are told.
    pub fn lose_parameters(&mut self, device: usize) {
        self.units.get_mut(device).into_iter().for_each(Unit::lose_parameters);
    }

    /// The next device whose parameters are to be stored, by its position, and what it will then have stored.
    pub fn poll_store(&mut self) -> Option<(usize, Parameters)> {
        let unit = self.orders.pop_front()?;
        let storing = self.units.get(unit)?.storing.as_ref()?;
        Some((unit, storing.parameters.clone()))
    }

    /// What [`Core::poll_store`] gave for this device is stored or, for the given reason, not.
    pub fn stored(&mut self, now: Instant, device: usize, outcome: Result<(), AbortCode>) {
        let Some(unit) = self.units.get_mut(device) else { return };
        let Some(Storing { member, parameters }) = unit.storing.take() else { return };
        if outcome.is_ok() {
            // It was taken from this very device, so all of it fits.
            unit.device.dictionary_mut().set_saved(parameters.application);
            for (Member { node, .. }, saved) in unit.members.iter_mut().zip(parameters.nodes) {
                node.set_saved(saved.communication);
                node.clear(PARAMETERS_LOST);
            }
        }
        match member {
            Some(member) => {
                let member = unit.members.get_mut(member);
                member.into_iter().for_each(|Member { node, .. }| node.stored(now, outcome));
            }
            None => unit.device.stored(now, outcome.is_ok()),
        }
        if let Some(order) = self.units.get_mut(device).and_then(|unit| unit.wanted.take()) {
            self.order_of_device(device, order);
        }
        self.settle(now, device);
        self.speak(now, device);
        self.pass(now);
    }

    /// Takes the order that a node of `unit` has given.
    pub(super) fn order(&mut self, now: Instant, unit: usize, member: usize, order: Order) {
        let Some(Unit { device, members, storing, .. }) = self.units.get_mut(unit) else { return };
        let numbered = members.iter_mut().enumerate();
        if storing.is_some() {
            // Another node of this device was first.
            let own = numbered.filter(|(number, _)| *number == member);
            own.for_each(|(_, Member { node, .. })| node.stored(now, Err(AbortCode::DeviceState)));
            return;
        }
        let saved = |(number, Member { node, .. }): (usize, &mut Member)| {
            let kept = || node.communication().saved().clone();
            match order {
                _ if number != member => NodeParameters { communication: kept(), lss: node.lss_stored() },
                Order::Lss(lss) => NodeParameters { communication: kept(), lss },
                Order::Save(_) | Order::Restore(_) => NodeParameters {
                    communication: order.apply(node.communication()),
                    lss: node.lss_stored(),
                },
            }
        };
        let nodes = numbered.map(saved).collect();
        let application = order.apply(device.dictionary());
        *storing = Some(Storing { member: Some(member), parameters: Parameters { application, nodes } });
        self.orders.push_back(unit);
    }

    /// Takes the order that a device itself has given; it waits for one that is under way.
    pub(super) fn order_of_device(&mut self, unit: usize, order: StoreOrder) {
        let Some(Unit { device, members, storing, wanted, .. }) = self.units.get_mut(unit) else {
            return;
        };
        if storing.is_some() {
            *wanted = Some(order);
            return;
        }
        let kept = |Member { node, .. }: &Member| NodeParameters {
            communication: node.communication().saved().clone(),
            lss: node.lss_stored(),
        };
        let nodes = members.iter().map(kept).collect();
        let application = device.to_store(order);
        *storing = Some(Storing { member: None, parameters: Parameters { application, nodes } });
        self.orders.push_back(unit);
    }
}
