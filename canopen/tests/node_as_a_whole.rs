//! Whatever happens on the bus, a node does only what CiA 301 allows, at once or at a time to come, and a recorded
//! bus replays to the same frames.

mod bench;

use core::time::Duration;
use std::sync::Arc;

use bench::{Bench, device};
use canopen::{BusState, CobId, Emergency, ErrorRegister, Frame, Id, NmtState, TimeOfDay};
use od::{Address, Dictionary, Direction, PdoTraits, Scan, Schema};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

#[derive(Clone, Debug)]
enum Step {
    /// This frame comes from the bus.
    Frame(Frame),
    /// Time passes, every deadline in it is served.
    Pass(Duration),
    /// Time passes, nobody serves the deadlines in it.
    Sleep(Duration),
    /// An input of the device changes.
    Show(u8, u64),
    /// The owner tells the time.
    Tell(TimeOfDay),
    /// An error comes.
    Raise(u16),
    /// An error goes.
    Clear(u16),
    /// The state of the CAN controller changes.
    Bus(BusState),
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let short = prop_oneof![
        (0..20_000_u64).prop_map(Duration::from_micros),
        (0..100_u64).prop_map(Duration::from_millis),
    ];
    let long = prop_oneof![Just(Duration::from_secs(1)), (0..100_000_u64).prop_map(Duration::from_millis)];
    let step = prop_oneof![
        20 => frame().prop_map(Step::Frame),
        4 => short.prop_map(Step::Pass),
        1 => long.prop_map(Step::Sleep),
        3 => (1..=8_u8, 0..4_u64).prop_map(|(sub, value)| Step::Show(sub, value)),
        1 => (0..0x1000_0000_u32, any::<u16>()).prop_map(|(millis, days)| Step::Tell(TimeOfDay { days, millis })),
        1 => (1..40_u16).prop_map(Step::Raise),
        1 => (1..40_u16).prop_map(Step::Clear),
        1 => select(vec![BusState::Active, BusState::Passive, BusState::Off]).prop_map(Step::Bus),
    ];
    vec(step, 1..200)
}

fn frame() -> impl Strategy<Value = Frame> {
    let known =
        select(vec![0x080, 0x081, 0x181, 0x201, 0x281, 0x301, 0x381, 0x401, 0x481, 0x501, 0x601, 0x701]);
    let id = prop_oneof![
        8 => known.prop_map(Id::Standard),
        1 => (0..0x800_u16).prop_map(Id::Standard),
        1 => (0..0x2000_0000_u32).prop_map(Id::Extended),
    ];
    let nmt = (select(vec![1, 1, 1, 2, 0x80, 0x81, 0x82, 0]), select(vec![0, 1, 2]));
    prop_oneof![
        2 => nmt.prop_map(|(command, node_id)| Frame::new(Id::Standard(0), &[command, node_id])),
        2 => Just(Frame::new(Id::Standard(0x080), &[])),
        1 => (0..=5_u8).prop_map(|counter| Frame::new(Id::Standard(0x080), &[counter])),
        2 => (0x701..=0x704_u16, select(vec![0, 4, 5, 0x7F])).prop_map(|(id, state)| Frame::new(Id::Standard(id), &[state])),
        2 => (id.clone(), 0..=8_u8).prop_map(|(id, len)| Frame::remote(id, len)),
        4 => (id, vec(any::<u8>(), 0..=8)).prop_map(|(id, payload)| Frame::new(id, &payload)),
        12 => sdo().prop_map(|message| Frame::new(Id::Standard(0x601), &message)),
        4 => sdo().prop_map(|message| Frame::new(Id::Standard(0x6D0), &message)),
        4 => select(SWITCHES.to_vec()).prop_map(bench::frame_of),
    ]
}

/// What switches on services that two or more parameters stand for.
const SWITCHES: [&str; 10] = [
    "601#2305100080000040", // produce SYNC
    "601#2306100064000000", // every 100 us
    "601#2306100010270000", // every 10 ms
    "601#2306100000000000", // never
    "601#2F19100003000000", // count to 3
    "601#2307100032000000", // a window of 50 us
    "601#23121000000100C0", // consume and produce TIME
    "601#23011201D0060000", // requests of the second SDO server
    "601#23011202D1060000", // and its answers
    "100#010203040506",
];

fn sdo() -> impl Strategy<Value = [u8; 8]> {
    let addresses = |schema: Schema| schema.entries().map(|(address, _)| address).collect::<Vec<_>>();
    let pdos: Vec<Address> =
        addresses(device::communication()).into_iter().filter(|a| a.index >= 0x1400).collect();
    let address = prop_oneof![
        select(addresses(device::communication())),
        select(pdos),
        select(addresses(device::application())),
    ];
    let cob_id = (select(vec![0_u32, 0x2000_0000, 0x4000_0000, 0x8000_0000]), 0..=5_u32)
        .prop_map(|(flags, n)| flags | (0x81 + 0x100 * n));
    let mapped =
        vec![0x6000_0108, 0x6000_0208, 0x6200_0108, 0x2001_0001, 0x2010_0018, 0x201B_0040, 0x0005_0008];
    let value = prop_oneof![
        2 => cob_id,
        2 => select(mapped),
        2 => (1..=4_u32, 1..2000_u32).prop_map(|(producer, millis)| producer << 16 | millis),
        2 => 0..3_u32,
        1 => 0..300_u32,
        1 => any::<u32>(),
    ];
    let initiate = prop_oneof![
        4 => select(vec![0x23, 0x27, 0x2B, 0x2F, 0x22]),
        1 => select(vec![0x20, 0x21]),
        2 => Just(0x40),
        1 => any::<u8>(),
    ];
    let segment = (select(vec![0x00, 0x10, 0x01, 0x11, 0x60, 0x70, 0x0D, 0x80]), any::<[u8; 7]>());
    prop_oneof![
        6 => (initiate, address, value).prop_map(|(command, Address { index, sub }, value)| {
            let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
            [command, low, high, sub, a, b, c, d]
        }),
        2 => segment.prop_map(|(command, [a, b, c, d, e, f, g])| [command, a, b, c, d, e, f, g]),
    ]
}

/// Takes one step and checks every frame that comes out of it.
fn take(bench: &mut Bench, step: &Step) -> Vec<Frame> {
    let before = answer_ids(bench.node.communication());
    let sent = match step {
        Step::Frame(frame) => bench.handle(frame),
        Step::Pass(time) => pass(bench, *time),
        Step::Sleep(time) => {
            bench.now = bench.now + *time;
            vec![]
        }
        Step::Show(sub, value) => {
            bench.show(&format!("6000:{sub:02X}"), *value);
            vec![]
        }
        Step::Tell(time) => {
            bench.node.produce_time(*time);
            vec![]
        }
        Step::Raise(code) => {
            bench.node.raise(Emergency { code: *code, register: ErrorRegister::CURRENT, detail: [0; 5] });
            vec![]
        }
        Step::Clear(code) => {
            bench.node.clear(*code);
            vec![]
        }
        Step::Bus(state) => {
            bench.node.set_bus_state(bench.now, *state);
            vec![]
        }
    };
    if !matches!(step, Step::Pass(_)) {
        assert!(sent.len() <= MOST_AT_ONCE, "{} frames after {step:?}", sent.len());
        let answers = sent.iter().filter(|frame| frame.id == Id::Standard(0x581)).count();
        assert!(answers <= 1, "{answers} answers to {step:?}");
        sent.iter().filter(|frame| !before.contains(&frame.id)).for_each(|frame| check(frame, bench));
    }
    bench.node.handle_timeout(bench.now, &mut bench.device);
    let late = bench.settle();
    assert!(late.len() <= MOST_AT_ONCE, "{} frames after {step:?}", late.len());
    assert!(bench.node.poll_timeout().is_none_or(|next| next > bench.now), "busy after {step:?}");
    late.iter().filter(|frame| !before.contains(&frame.id)).for_each(|frame| check(frame, bench));
    [sent, late].concat()
}

/// Lets time pass, and checks what comes out at each deadline in the state that it leads to.
fn pass(bench: &mut Bench, time: Duration) -> Vec<Frame> {
    let end = bench.now + time;
    let mut all = vec![];
    while bench.now < end {
        let next = bench.node.poll_timeout().map_or(end, |next| next.min(end));
        let sent = bench.pass(next.saturating_since(bench.now));
        sent.iter().for_each(|frame| check(frame, bench));
        all.extend(sent);
    }
    all
}

/// Four TPDOs, 16 that have waited for a slow device, 16 emergency messages, an SDO answer, three SDO aborts, SYNC, TIME, a
/// heartbeat and a boot-up message.
const MOST_AT_ONCE: usize = 28 + 16;

/// A node whose device takes its time for some of its PDOs, or does not.
fn bench(is_slow: bool) -> Bench {
    let micros = Duration::from_micros;
    let (entry, switch) = (Address::new(0x6000, 1), Address::new(0x6200, 1));
    let scan = Some(Scan { entry, switch, bit: 0, time: micros(300) });
    let traits = |direction, number, time| PdoTraits { direction, number, length: 0, time, scan: None };
    let pdos = [
        traits(Direction::Receive, 1, micros(21_000)),
        traits(Direction::Receive, 2, micros(900)),
        PdoTraits { scan, ..traits(Direction::Transmit, 1, micros(12_500)) },
        traits(Direction::Transmit, 2, micros(3_000)),
    ];
    let mut bench = Bench::off();
    let schema = Arc::clone(bench.device.schema());
    bench.node.shape_pdos(&pdos, &schema, is_slow);
    bench.started()
}

fn check(frame: &Frame, bench: &Bench) {
    assert!(!frame.is_remote, "{frame}");
    let is_legal = match frame.id {
        Id::Standard(0x581) => is_sdo_answer(frame),
        Id::Standard(0x701) => is_error_control(frame, bench.node.state()),
        _ => {
            let communication = bench.node.communication();
            is_emcy(frame, communication)
                || is_tpdo(frame, bench)
                || is_sync(frame, communication)
                || is_time(frame, communication)
                || answer_ids(communication).contains(&frame.id) && is_sdo_answer(frame)
        }
    };
    assert!(is_legal, "{frame} in {:?}", bench.node.state());
}

fn is_sdo_answer(frame: &Frame) -> bool {
    let Some([command, ..]) = frame.eight() else { return false };
    match command {
        0x80 | 0x60 | 0x20 | 0x30 | 0x41 | 0x43 | 0x47 | 0x4B | 0x4F => true,
        0xA1 | 0xA2 | 0xA4 | 0xC6 => true,
        _ if command & 0xE3 == 0xC1 => true, // the end of a block upload
        _ => matches!(command & 0x7F, 1..=127) || command & 0xE0 == 0, // a segment
    }
}

fn is_error_control(frame: &Frame, state: NmtState) -> bool {
    // With the toggle bit as an answer to guarding.
    matches!(frame.payload(), [0]) || matches!(frame.payload(), [byte] if byte & 0x7F == state as u8)
}

fn parameter(communication: &Dictionary, index: u16, sub: u8) -> u32 {
    communication.raw(communication.find(Address::new(index, sub)).unwrap()) as u32
}

/// What the further SDO servers answer with.
fn answer_ids(communication: &Dictionary) -> Vec<Id> {
    let cob_ids = [0x1201, 0x1202].map(|index| [1, 2].map(|sub| CobId(parameter(communication, index, sub))));
    let on = cob_ids.into_iter().filter(|[request, answer]| request.is_valid() && answer.is_valid());
    on.map(|[_, answer]| answer.id()).collect()
}

fn is_sync(frame: &Frame, communication: &Dictionary) -> bool {
    let cob_id = parameter(communication, 0x1005, 0);
    let len = usize::from(parameter(communication, 0x1019, 0) > 0);
    cob_id & 1 << 30 != 0 && CobId(cob_id).id() == frame.id && frame.len() == len
}

fn is_time(frame: &Frame, communication: &Dictionary) -> bool {
    let cob_id = parameter(communication, 0x1012, 0);
    cob_id & 1 << 30 != 0 && CobId(cob_id).id() == frame.id && frame.len() == 6
}

fn is_emcy(frame: &Frame, communication: &Dictionary) -> bool {
    let cob_id = CobId(parameter(communication, 0x1014, 0));
    cob_id.is_valid() && cob_id.id() == frame.id && frame.len() == 8
}

fn is_tpdo(frame: &Frame, bench: &Bench) -> bool {
    let communication = bench.node.communication();
    bench.node.state() == NmtState::Operational
        && (0..4).any(|number| {
            let cob_id = CobId(parameter(communication, 0x1800 + number, 1));
            let count = parameter(communication, 0x1A00 + number, 0) as u8;
            let mapped = (1..=count).map(|sub| parameter(communication, 0x1A00 + number, sub) & 0xFF);
            let bits: u32 = mapped.sum();
            cob_id.is_valid() && cob_id.id() == frame.id && frame.len() == bits.div_ceil(8) as usize
        })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, ..ProptestConfig::default() })]

    #[test]
    fn a_node_sends_only_what_is_legal_and_the_same_again(steps in steps(), is_slow: bool) {
        let run = || {
            let mut bench = bench(is_slow);
            let frames: Vec<Vec<Frame>> = steps.iter().map(|step| take(&mut bench, step)).collect();
            (frames, bench.events(), bench.node.counters())
        };
        prop_assert_eq!(run(), run());
    }

    #[test]
    fn a_reset_leaves_no_trace(steps in steps(), is_slow: bool) {
        let mut bench = bench(is_slow);
        steps.iter().for_each(|step| drop(take(&mut bench, step)));
        bench.node.set_bus_state(bench.now, BusState::Active); // that is of the bus, not of the node
        bench.settle();
        prop_assert_eq!(bench.send("000#8101"), [bench::frame_of("701#00")]);
        bench.now = bench.now + Duration::from_secs(10);
        let fresh = Bench::new();
        let (node, new) = (&bench.node, &fresh.node);
        for (address, _) in new.communication().schema().entries() {
            let value = |dictionary: &Dictionary| dictionary.value(dictionary.find(address).unwrap()).cloned();
            prop_assert_eq!(value(node.communication()), value(new.communication()), "{}", address);
        }
        prop_assert!(node.subscriptions().eq(new.subscriptions()));
        prop_assert_eq!(node.poll_timeout(), None);
    }
}
