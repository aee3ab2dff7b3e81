//! Which frames a node wants, and several nodes on one link.

mod bench;

use bench::{Bench, device, frame_of};
use canopen::{Event, Frame, Id, Node, Router};
use od::{Dictionary, Instant};

use std::sync::Arc;

fn ids(bench: &Bench) -> Vec<String> {
    bench.node.subscriptions().map(|id| id.to_string()).collect()
}

#[test]
fn a_node_subscribes_to_what_its_parameters_say() {
    let mut bench = Bench::new();
    assert_eq!(ids(&bench), ["000", "080", "181", "201", "281", "301", "601", "701", "7E5"]);
    bench.events();
    bench.configure("1400:01", 0x8000_0201);
    bench.configure("1800:01", 0xC000_0181);
    bench.configure("1800:01", 0x4000_0181);
    bench.configure("1005:00", 0x2000_0123);
    assert_eq!(bench.events(), [Event::Subscriptions]);
    assert_eq!(ids(&bench), ["000", "281", "301", "601", "701", "7E5", "00000123"]);
    bench.send("000#8201");
    assert_eq!(ids(&bench), ["000", "080", "181", "201", "281", "301", "601", "701", "7E5"]);
}

#[test]
fn other_parameters_change_no_subscription() {
    let mut bench = Bench::new();
    bench.events();
    bench.configure("1017:00", 100);
    bench.configure("1015:00", 100);
    bench.configure("1014:00", 0x8000_0081);
    bench.configure("1003:00", 0);
    assert_eq!(bench.events(), []);
}

/// Nodes on one link: what one of them sends, the others hear.
struct Link {
    nodes: Vec<(Node, Dictionary)>,
    router: Router,
}

impl Link {
    fn new(node_ids: impl IntoIterator<Item = u8>) -> Self {
        let communication = Arc::new(device::communication());
        let application = Arc::new(device::application());
        let node = |id| {
            let mut node = Node::new(id, 0, Arc::clone(&communication), &application).unwrap();
            let device = Dictionary::new(Arc::clone(&application), id);
            node.start(Instant::ZERO, &device);
            (node, device)
        };
        let mut link = Self { nodes: node_ids.into_iter().map(node).collect(), router: Router::default() };
        link.settle();
        link
    }

    /// Gives a frame from outside to those who want it; gives all that is on the link then.
    fn send(&mut self, frame: &str) -> Vec<String> {
        let mut frames = vec![frame_of(frame)];
        let mut all = Vec::new();
        while !frames.is_empty() {
            frames.iter().for_each(|frame| self.deliver(frame));
            all.extend(frames.iter().map(ToString::to_string));
            frames = self.settle();
        }
        all
    }

    fn deliver(&mut self, frame: &Frame) {
        for receiver in self.router.receivers(frame.id).to_vec() {
            let (node, device) = &mut self.nodes[usize::from(receiver)];
            node.handle_frame(Instant::ZERO, frame, device);
        }
    }

    fn settle(&mut self) -> Vec<Frame> {
        let mut sent = Vec::new();
        for (receiver, (node, device)) in (0..).zip(&mut self.nodes) {
            node.sample(Instant::ZERO, device);
            while let Some(event) = node.poll_event() {
                if event == Event::Subscriptions {
                    self.router.subscribe(receiver, node.subscriptions());
                }
            }
            sent.extend(core::iter::from_fn(|| node.poll_transmit()));
        }
        sent
    }
}

#[test]
fn a_router_brings_each_frame_to_its_node() {
    let mut link = Link::new([1, 2, 127]);
    assert_eq!(link.send("602#4018100400000000"), ["602#4018100400000000", "582#431810042A000000"]);
    assert_eq!(link.send("67F#4018100400000000"), ["67F#4018100400000000", "5FF#431810042A000000"]);
    assert_eq!(link.send("000#0100"), ["000#0100", "181#0000", "182#0000", "1FF#0000"]);
    assert_eq!(link.send("080#"), ["080#", "281#00", "282#00", "2FF#00"]);
    assert_eq!(link.router.receivers(Id::Standard(0x080)), [0, 1, 2]);
}

#[test]
fn the_tpdo_of_one_node_is_the_rpdo_of_another() {
    let mut link = Link::new([1, 2]);
    for request in ["602#2300140102020080", "602#2300140181010000"] {
        link.send(request);
    }
    link.send("000#0100");
    let (_, device) = &mut link.nodes[0];
    let slot = device.find(od::Address::new(0x6000, 1)).unwrap();
    device.set(slot, 0x2A);
    assert_eq!(link.send("000#0100"), ["000#0100", "181#2A00"]);
    let (_, device) = &link.nodes[1];
    assert_eq!(device.raw(device.find(od::Address::new(0x6200, 1)).unwrap()), 0x2A);
}
