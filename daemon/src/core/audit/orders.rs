//! What masters and operators order, for the trail.

use canopen::NetworkOrder;
use od::{Instant, Owner};
use profiles::{PlantFault, Repair, Signal};

use super::{AuditEntry, What};
use crate::core::{Core, Hearer, Passing, Sender, Who};
use crate::motion::Goal;

impl Core {
    /// Takes note of what an operator has an axis of a device do, both by their positions.
    pub fn note_motion(&mut self, now: Instant, device: usize, axis: usize, goal: Goal) {
        self.note_order(now, device, What::Motion(axis, goal));
    }

    pub(in crate::core) fn note_owner(
        &mut self,
        now: Instant,
        device: usize,
        axis: usize,
        claim: Option<Owner>,
    ) {
        let what = match claim {
            Some(owner) => What::Claim(axis, owner),
            None => What::Release(axis, self.owner(device, axis)),
        };
        self.note_order(now, device, what);
    }

    pub(in crate::core) fn note_fault(
        &mut self,
        now: Instant,
        device: usize,
        axis: usize,
        fault: PlantFault,
    ) {
        self.note_order(now, device, What::Inject(axis, fault));
    }

    pub(in crate::core) fn note_repair(&mut self, now: Instant, device: usize, axis: usize, repair: Repair) {
        self.note_order(now, device, What::Repair(axis, repair));
    }

    pub(in crate::core) fn note_signal(&mut self, now: Instant, device: usize, axis: usize, signal: Signal) {
        self.note_order(now, device, What::Signal(axis, signal));
    }

    fn note_order(&mut self, at: Instant, device: usize, what: What) {
        let (device, who, peer) = (Some(device), Who::Local, self.audit.peer);
        self.audit.note(AuditEntry { at, device, who, peer, what, again: None });
    }

    /// Takes note of a frame that these nodes are about to hear, if it is an order. Those of others on the bus that change
    /// nothing here are not kept.
    pub(in crate::core) fn note_network(&mut self, at: Instant, passing: &Passing, hearers: &[u16]) {
        if !self.audit.is_kept() {
            return;
        }
        let Some(order) = NetworkOrder::decode(&passing.frame) else { return };
        let mut obeying = hearers.iter().filter_map(|hearer| {
            let Hearer { unit, position } = *self.members.get(usize::from(*hearer))?;
            let member = self.units.get(unit)?.members.get(position)?;
            member.node.will_obey(order).then_some(unit)
        });
        let (first, second) = (obeying.next(), obeying.next());
        let who = match passing.sender {
            // What we are told to send is kept, whoever obeys.
            Sender::Operator(_) => Who::Local,
            Sender::Gateway(_) => Who::CanOpen(passing.link),
            Sender::Bus | Sender::Client(_) if first.is_some() => Who::CanOpen(passing.link),
            // Our nodes are no masters.
            Sender::Bus | Sender::Client(_) | Sender::Member(_) => return,
        };
        let device = first.filter(|_| second.is_none());
        let what = What::Network(passing.link, order);
        self.audit.note(AuditEntry { at, device, who, peer: passing.sender.peer(), what, again: None });
    }
}
