//! A master and some of our own nodes on one bus, on virtual time.

use core::time::Duration;
use std::collections::VecDeque;

use canopen::{DcfEntry, Event, Frame, Master, MasterEvent, NmtState, Router, encode_dcf};
use od::{Access, Address, DataType, Dictionary, Entry, Instant, Object, Schema};

use crate::bench::{Bench, device};

const MASTER: u16 = 0;

/// The parameters of a master by address; what is not said is zero.
pub(crate) fn parameters(values: &[(u16, u8, u32)], dcfs: &[(u8, Vec<u8>)]) -> Dictionary {
    let entry = |sub| Entry::new(sub, "Entry", DataType::Unsigned32, Access::ReadWrite);
    let by_node = |index| Object::array(index, "By Node-ID", (1..=127).map(entry).collect());
    let domain = |sub| Entry::new(sub, "Concise DCF", DataType::Domain, Access::ReadWrite);
    let mut objects: Vec<Object> =
        [0x1F26, 0x1F27, 0x1F81, 0x1F84, 0x1F85, 0x1F86, 0x1F87, 0x1F88, 0x1F8A].map(by_node).to_vec();
    objects.push(Object::array(0x1F22, "Concise DCF", (1..=127).map(domain).collect()));
    objects.push(Object::array(0x1016, "Heartbeat consumer", (1..=4).map(entry).collect()));
    objects.extend([0x1F80, 0x1F89].map(|index| Object::var(index, entry(0))));
    let mut dictionary = Dictionary::new(Schema::new(objects).unwrap().into(), 127);
    let slot = |dictionary: &Dictionary, index, sub| dictionary.find(Address::new(index, sub)).unwrap();
    for (index, sub, value) in values {
        let slot = slot(&dictionary, *index, *sub);
        dictionary.set(slot, (*value).into());
    }
    for (node_id, dcf) in dcfs {
        let slot = slot(&dictionary, 0x1F22, *node_id);
        dictionary.set_bytes(slot, dcf);
    }
    dictionary
}

/// A master and some nodes on one bus.
pub(crate) struct Network {
    pub(crate) master: Master,
    pub(crate) nodes: Vec<(u8, Bench)>,
    pub(crate) router: Router,
    pub(crate) now: Instant,
    /// Everything that was sent.
    pub(crate) log: Vec<String>,
}

impl Network {
    pub(crate) fn new(parameters: &Dictionary, node_ids: &[u8]) -> Self {
        let more = Object::array(
            0x1020,
            "Verify configuration",
            (1..=2).map(|sub| Entry::new(sub, "Part", DataType::Unsigned32, Access::ReadWrite)).collect(),
        );
        let node =
            |id: &u8| (*id, Bench::as_node(*id, device::communication_with(vec![more.clone()])).started());
        let nodes = node_ids.iter().map(node).collect();
        let master = Master::new(parameters);
        let mut router = Router::default();
        router.subscribe(MASTER, master.subscriptions());
        let mut network = Self { master, nodes, router, now: Instant::ZERO, log: Vec::new() };
        network.resubscribe();
        network
    }

    /// The same with a master that was started.
    pub(crate) fn started(parameters: &Dictionary, node_ids: &[u8]) -> Self {
        let mut network = Self::new(parameters, node_ids);
        network.master.start(network.now);
        network.settle(Vec::new());
        network
    }

    pub(crate) fn resubscribe(&mut self) {
        for (id, bench) in &mut self.nodes {
            if bench.events().contains(&Event::Subscriptions) {
                self.router.subscribe((*id).into(), bench.node.subscriptions());
            }
        }
    }

    /// Lets frames reach whom they concern until none is left; `sent` by these nodes.
    pub(crate) fn settle(&mut self, sent: Vec<(u16, Frame)>) {
        let mut wire: VecDeque<(u16, Frame)> = sent.into();
        loop {
            wire.extend(core::iter::from_fn(|| self.master.poll_transmit()).map(|frame| (MASTER, frame)));
            let Some((sender, frame)) = wire.pop_front() else { break };
            self.log.push(frame.to_string());
            for receiver in self.router.receivers(frame.id).to_vec() {
                if receiver == MASTER && sender != MASTER {
                    self.master.handle_frame(self.now, &frame);
                } else if let Some((id, bench)) =
                    self.nodes.iter_mut().find(|(id, _)| u16::from(*id) == receiver && receiver != sender)
                {
                    bench.now = self.now;
                    wire.extend(bench.handle(&frame).into_iter().map(|frame| ((*id).into(), frame)));
                }
            }
            self.resubscribe();
        }
    }

    /// Lets time pass and serves every deadline in it.
    pub(crate) fn pass(&mut self, millis: u64) {
        let end = self.now + Duration::from_millis(millis);
        loop {
            let nodes = self.nodes.iter().filter_map(|(_, bench)| bench.node.poll_timeout());
            let next = nodes.chain(self.master.poll_timeout()).min();
            let Some(next) = next.filter(|next| *next <= end) else { break };
            self.now = self.now.max(next);
            self.master.handle_timeout(self.now);
            assert!(self.master.poll_timeout().is_none_or(|next| next > self.now), "a past time");
            let mut sent = Vec::new();
            for (id, bench) in &mut self.nodes {
                let time = self.now.saturating_since(bench.now);
                sent.extend(bench.pass(time).into_iter().map(|frame| (u16::from(*id), frame)));
            }
            self.settle(sent);
        }
        self.now = end;
    }

    pub(crate) fn events(&mut self) -> Vec<MasterEvent> {
        core::iter::from_fn(|| self.master.poll_event()).collect()
    }

    pub(crate) fn node(&mut self, node_id: u8) -> &mut Bench {
        &mut self.nodes.iter_mut().find(|(id, _)| *id == node_id).unwrap().1
    }

    pub(crate) fn state(&self, node_id: u8) -> NmtState {
        self.nodes.iter().find(|(id, _)| *id == node_id).unwrap().1.node.state()
    }

    /// A node is switched on, or off and on.
    pub(crate) fn power_on(&mut self, node_id: u8) {
        let mut bench = Bench::as_node(node_id, device::communication());
        bench.now = self.now;
        bench.node.start(self.now, &bench.device);
        let sent = bench.settle().into_iter().map(|frame| (u16::from(node_id), frame)).collect();
        self.nodes.retain(|(id, _)| *id != node_id);
        self.nodes.push((node_id, bench));
        self.resubscribe();
        self.settle(sent);
    }

    /// A node is gone, without a word.
    pub(crate) fn power_off(&mut self, node_id: u8) {
        self.nodes.retain(|(id, _)| *id != node_id);
        self.router.subscribe(node_id.into(), []);
    }

    /// What was sent since the last call.
    pub(crate) fn sent(&mut self) -> Vec<String> {
        core::mem::take(&mut self.log)
    }
}

pub(crate) fn dcf(entries: &[(u16, u8, &[u8])]) -> Vec<u8> {
    let entry = |&(index, sub, data)| DcfEntry { address: Address::new(index, sub), data };
    encode_dcf(&entries.iter().map(entry).collect::<Vec<_>>())
}
