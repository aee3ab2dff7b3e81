//! Who listens to which CAN-ID on one link.

use std::collections::BTreeMap;

use crate::Id;

/// The receivers of every CAN-ID on a link. A receiver is a number that the owner of the nodes chose.
#[derive(Clone, Debug)]
pub struct Router {
    standard: Vec<Vec<u16>>,
    extended: BTreeMap<u32, Vec<u16>>,
    subscriptions: BTreeMap<u16, Vec<Id>>,
}

impl Default for Router {
    fn default() -> Self {
        Self { standard: vec![Vec::new(); 0x800], extended: BTreeMap::new(), subscriptions: BTreeMap::new() }
    }
}

impl Router {
    /// Makes `ids` the only identifiers that `receiver` hears.
    pub fn subscribe(&mut self, receiver: u16, ids: impl IntoIterator<Item = Id>) {
        let mut subscription = self.subscriptions.remove(&receiver).unwrap_or_default();
        for id in subscription.drain(..) {
            self.list(id).into_iter().for_each(|receivers| receivers.retain(|r| *r != receiver));
        }
        self.extended.retain(|_, receivers| !receivers.is_empty());
        for id in ids {
            if let Some(receivers) = self.list(id).filter(|r| !r.contains(&receiver)) {
                receivers.push(receiver);
                subscription.push(id);
            }
        }
        self.subscriptions.insert(receiver, subscription);
    }

    /// The receivers of `id`, to be changed.
    fn list(&mut self, id: Id) -> Option<&mut Vec<u16>> {
        match id {
            Id::Standard(id) => self.standard.get_mut(usize::from(id)),
            Id::Extended(id) => Some(self.extended.entry(id).or_default()),
        }
    }

    /// Who hears `id`.
    #[must_use]
    pub fn receivers(&self, id: Id) -> &[u16] {
        match id {
            Id::Standard(id) => self.standard.get(usize::from(id)),
            Id::Extended(id) => self.extended.get(&id),
        }
        .map_or(&[], Vec::as_slice)
    }

    /// Every identifier that somebody hears, in ascending order, standard ones first.
    pub fn ids(&self) -> impl Iterator<Item = Id> {
        let standard =
            (0..).zip(&self.standard).filter(|(_, r)| !r.is_empty()).map(|(id, _)| Id::Standard(id));
        standard.chain(self.extended.keys().map(|id| Id::Extended(*id)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_subscription_replaces_the_old_one() {
        let mut router = Router::default();
        router.subscribe(1, [Id::Standard(0x80), Id::Standard(0x601)]);
        router.subscribe(2, [Id::Standard(0x80), Id::Extended(0x80)]);
        assert_eq!(router.receivers(Id::Standard(0x80)), [1, 2]);
        assert_eq!(router.receivers(Id::Extended(0x80)), [2]);
        router.subscribe(2, [Id::Standard(0x602), Id::Standard(0x602)]);
        assert_eq!(router.receivers(Id::Standard(0x80)), [1]);
        assert_eq!(router.receivers(Id::Extended(0x80)), [0_u16; 0]);
        let ids: Vec<Id> = router.ids().collect();
        assert_eq!(ids, [0x80, 0x601, 0x602].map(Id::Standard));
    }
}
