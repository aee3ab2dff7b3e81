//! Times every kind of work that the core does between two looks at what is due: `cargo run --release -p daemon --example
//! pieces`.
//!
//! Each piece is done again and again on virtual time, always the same one on a core in the same state, and the shortest of
//! these times counts: whatever stops the thread in between, kernel or hypervisor, only makes some of them longer. Of
//! kinds with many members, such as reads of registers, the longest of the shortest times. Times are without system calls.

use std::collections::BTreeMap;
use std::error::Error;
use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant as Wall};

use canopen::{Frame, Id};
use daemon::core::{ClientId, Core, LinkId, ListenerPlan, ModbusPlan, Plan, identification, map};
use daemon::status;
use modbus::{Dialect, WordOrder, tcp_adu};
use od::Instant;
use profiles::{PlantSetup, Profile};

const LINK: LinkId = LinkId(0);
/// How often each piece is done.
const TIMES: usize = 200;
const RASTER: Duration = Duration::from_millis(1);
const MOMENT: Duration = Duration::from_nanos(1);
/// Registers of the dictionary.
const APPLICATION: std::ops::Range<u16> = 0x1000..0x8000;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// A core of devices of one profile, which a Modbus client reaches.
struct Bench {
    core: Core,
    now: Instant,
    client: ClientId,
    profile: Arc<Profile>,
}

/// The longest piece of each kind, with what it is.
#[derive(Default)]
struct Found(BTreeMap<String, (Duration, String)>);

impl Found {
    fn note(&mut self, kind: &str, time: Duration, what: impl FnOnce() -> String) {
        let longest = self.0.entry(kind.to_owned()).or_default();
        if time >= longest.0 {
            *longest = (time, what());
        }
    }
}

fn main() -> Outcome<()> {
    for profile in ["jvl-mac00-fc4", "jvl-mis34x", "cia402-servo", "canopen-reference", "maccon-mac4-inc"] {
        let mut found = Found::default();
        let mut bench = Bench::new(profile, 1)?;
        registers(&mut bench, &mut found);
        objects(&mut bench, &mut found);
        orders(&mut bench, &mut found);
        frames(&mut bench, &mut found);
        print(&format!("{profile}, one device"), found);
    }
    for (profile, nodes) in
        [("jvl-mac00-fc4", 16), ("jvl-mac00-fc4", 127), ("canopen-reference", 127), ("maccon-mac4-inc", 32)]
    {
        let mut found = Found::default();
        crowd(&mut Bench::new(profile, nodes)?, &mut found);
        print(&format!("{profile}, {nodes} devices"), found);
    }
    Ok(())
}

fn print(title: &str, Found(found): Found) {
    println!("{title}");
    let mut found: Vec<_> = found.into_iter().collect();
    found.sort_by_key(|(_, (time, _))| std::cmp::Reverse(*time));
    for (kind, (time, what)) in found {
        println!("  {:>9.2} us  {kind}  {what}", time.as_nanos() as f64 / 1e3);
    }
}

impl Bench {
    fn new(name: &str, nodes: u8) -> Outcome<Self> {
        let profile =
            Arc::new(Profile::embedded(name, None).ok_or("no such profile")?.map_err(|e| format!("{e}"))?);
        let plan = |node: u8| Plan {
            name: format!("device {node}").as_str().into(),
            profile: Arc::clone(&profile),
            nodes: vec![(LINK, node)],
            plant: PlantSetup::default(),
            serial: None,
        };
        let plans: Vec<Plan> = (1..=nodes).map(plan).collect();
        let now = Instant::from_nanos(1_000_000_000);
        let mut core = Core::new(1, &plans, now)?;
        let registers = Arc::new(map(&profile, Dialect::Full, WordOrder::LowFirst));
        for unit in 1..=nodes {
            let (map, identification) = (Arc::clone(&registers), identification(&profile, "axis"));
            let plan = ModbusPlan { unit: Some(unit), map, identification, timeout: None };
            core.show_on_modbus(usize::from(unit) - 1, plan);
        }
        core.add_listener(ListenerPlan { max_clients: 64, ..ListenerPlan::default() });
        core.start(now, LINK);
        let client = core.connect(now, 0, ([10, 0, 0, 1], 1000).into(), false)?;
        let mut bench = Self { core, now, client, profile };
        bench.hear(0x000, &[0x01, 0x00]);
        bench.rest();
        Ok(bench)
    }

    /// Lets all be done that is due for a while, and takes what is told.
    fn rest(&mut self) {
        for _ in 0..3 {
            self.now = self.now + RASTER;
            self.core.handle_timeout(self.now);
        }
        // What goes on at once, such as a reset of all nodes.
        while self.core.poll_timeout().is_some_and(|deadline| deadline <= self.now + MOMENT) {
            self.now = self.now + MOMENT;
            self.core.handle_timeout(self.now);
        }
        self.take();
    }

    fn take(&mut self) {
        while self.core.poll_transmit().is_some() {}
        while self.core.poll_notice().is_some() {}
        while self.core.poll_resubscribed().is_some() {}
        while self.core.poll_changed().is_some() {}
        while let Some((device, _)) = self.core.poll_store() {
            self.core.stored(self.now, device, Ok(()));
        }
        while self.core.poll_transmit().is_some() {}
    }

    fn hear(&mut self, id: u16, payload: &[u8]) {
        self.core.handle_frame(self.now, LINK, &Frame::new(Id::Standard(id), payload));
    }

    /// The shortest time of a piece that is done so often.
    fn shortest(&mut self, times: usize, mut piece: impl FnMut(&mut Self)) -> Duration {
        let mut shortest = Duration::MAX;
        for _ in 0..times {
            self.rest();
            let begun = Wall::now();
            piece(self);
            shortest = shortest.min(begun.elapsed());
        }
        self.take();
        shortest
    }

    /// The shortest time of a request, and its answer.
    fn ask(&mut self, times: usize, pdu: &[u8]) -> (Duration, Vec<u8>) {
        let request = tcp_adu(1, 1, pdu);
        let mut answer = Vec::new();
        let time = self.shortest(times, |bench| {
            let Self { core, now, client, .. } = bench;
            core.receive(*now, *client, &request);
            core.serve(*now, *client);
            answer.clear();
            answer.extend_from_slice(core.output(*client));
            core.sent(*client, answer.len());
        });
        (time, answer.get(7..).unwrap_or_default().to_vec())
    }
}

fn pdu(function: u8, words: &[u16]) -> Vec<u8> {
    std::iter::once(function).chain(words.iter().flat_map(|word| word.to_be_bytes())).collect()
}

/// Every function code, all over the registers.
fn registers(bench: &mut Bench, found: &mut Found) {
    let starts: Vec<u16> =
        (0..0x0400).step_by(32).chain(APPLICATION.step_by(120)).chain((0x8000..0x8080).step_by(32)).collect();
    for start in starts {
        for function in [1, 2, 3, 4] {
            let count = if function < 3 { 2000 } else { 125 };
            let (time, _) = bench.ask(20, &pdu(function, &[start, count]));
            found.note(&format!("Modbus {function}"), time, || format!("from {start:04X}"));
        }
        // What is there is written back, as much of it as goes.
        for count in [123, 64, 32, 8, 2, 1] {
            let (_, values) = bench.ask(1, &pdu(3, &[start, count]));
            let Some(values) = values.get(2..).filter(|_| values.first() == Some(&3)) else { continue };
            let mut write = pdu(16, &[start, count]);
            write.push(2 * count as u8);
            write.extend(values);
            let (time, answer) = bench.ask(20, &write);
            let what = || format!("{count} from {start:04X}: {answer:02X?}");
            found.note(
                if answer.first() == Some(&16) { "Modbus 16" } else { "Modbus 16, refused" },
                time,
                what,
            );
            if count <= 121 {
                let mut write = pdu(23, &[start, 125, start, count]);
                write.push(2 * count as u8);
                write.extend(values);
                let (time, _) = bench.ask(20, &write);
                found.note("Modbus 23", time, || format!("{count} from {start:04X}"));
            }
        }
    }
    for start in APPLICATION.step_by(3).take(1500) {
        let (time, _) = bench.ask(5, &pdu(22, &[start, 0xFFFF, 0]));
        found.note("Modbus 22", time, || format!("{start:04X}"));
    }
    let coils = [&pdu(15, &[0, 32])[..], &[4, 0xFF, 0, 0xFF, 0]].concat();
    let (echo, sdo) =
        ([&[8, 0, 0][..], &[7; 250]].concat(), [0x2B, 0x0D, 0, 0, 0, 0x10, 0x18, 1, 0, 0, 0, 4]);
    for (name, request) in [
        ("Modbus 5", pdu(5, &[0, 0xFF00])),
        ("Modbus 15", coils),
        ("Modbus 8", echo),
        ("Modbus 17", vec![17]),
        ("Modbus 43/14", vec![0x2B, 0x0E, 3, 0]),
        ("Modbus 43/13", sdo.to_vec()),
        ("Modbus, unknown function", vec![99]),
    ] {
        let (time, answer) = bench.ask(TIMES, &request);
        found.note(name, time, || format!("{} bytes", answer.len()));
    }
    let junk = [0, 1, 0, 9, 0, 2, 1, 3].repeat(256);
    let time = bench.shortest(TIMES, |bench| {
        bench.core.receive(bench.now, bench.client, &junk);
        black_box(bench.core.serve(bench.now, bench.client));
    });
    found.note("Modbus, 256 frames of another protocol", time, String::new);
}

/// What JVL's modules are told by their command register, which acts when it changes.
fn orders(bench: &mut Bench, found: &mut Found) {
    const REGISTER: u16 = 0x8000 + 2 * 15;
    if bench.profile.module_registers.is_none() {
        return;
    }
    for command in [0x01, 0x10, 0x12, 0x101, 0x110, 0x8000_010B, 0x8000_010C_u32] {
        let write = |value: u32| {
            let mut write = pdu(16, &[REGISTER, 2]);
            write.extend([4, (value >> 8) as u8, value as u8, (value >> 24) as u8, (value >> 16) as u8]);
            write
        };
        let mut shortest = Duration::MAX;
        for _ in 0..TIMES {
            bench.ask(1, &write(0));
            shortest = shortest.min(bench.ask(1, &write(command)).0);
        }
        found.note("Modbus 16, commands of JVL's modules", shortest, || format!("{command:X}"));
    }
}

/// Every entry by 43/13, read and written back.
fn objects(bench: &mut Bench, found: &mut Found) {
    let profile = Arc::clone(&bench.profile);
    for area in [&profile.communication, &profile.application] {
        for (index, _, _, entries) in area.objects() {
            for entry in entries {
                let [high, low] = index.to_be_bytes();
                let length = entry.data_type.bytes().unwrap_or(240) as u8;
                let mut request = vec![0x2B, 0x0D, 0, 0, 0, high, low, entry.sub, 0, 0, 0, length];
                let (time, answer) = bench.ask(10, &request);
                let what = format!("{index:04X}:{:02X}", entry.sub);
                found.note("Modbus 43/13, read", time, || what.clone());
                let Some(value) = answer.get(12..).filter(|_| answer.first() == Some(&0x2B)) else {
                    continue;
                };
                request[2] = 1;
                request[11] = value.len() as u8;
                request.extend(value);
                let (time, answer) = bench.ask(10, &request);
                found.note("Modbus 43/13, written", time, || format!("{what} {answer:02X?}"));
            }
        }
    }
}

/// Frames to one node.
fn frames(bench: &mut Bench, found: &mut Found) {
    let sdo = 0x601;
    for (name, id, payload) in [
        ("SDO upload", sdo, &[0x40, 0x41, 0x60, 0, 0, 0, 0, 0][..]),
        ("SDO upload of a text", sdo, &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]),
        ("SDO block upload begins", sdo, &[0xA0, 0x08, 0x10, 0, 127, 0, 0, 0]),
        ("SDO download of a parameter", sdo, &[0x23, 0x81, 0x60, 0, 0, 4, 0, 0]),
        ("SDO download of a command", sdo, &[0x2B, 0x40, 0x60, 0, 6, 0, 0, 0]),
        ("SDO store all parameters", sdo, &[0x23, 0x10, 0x10, 1, 0x73, 0x61, 0x76, 0x65]),
        ("SDO restore all parameters", sdo, &[0x23, 0x11, 0x10, 1, 0x6C, 0x6F, 0x61, 0x64]),
        ("SYNC", 0x080, &[]),
        ("NMT reset node", 0x000, &[0x81, 1]),
        ("NMT reset communication", 0x000, &[0x82, 1]),
        ("NMT start", 0x000, &[0x01, 1]),
        ("RPDO 1", 0x201, &[6, 0, 0, 0, 0, 0, 0, 0]),
        ("RPDO 2", 0x301, &[6, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        let time = bench.shortest(TIMES, |bench| bench.hear(id, payload));
        found.note(name, time, String::new);
    }
    let mut shortest = [Duration::MAX; 2];
    for _ in 0..TIMES {
        bench.rest();
        bench.hear(0x601, &[0x23, 0x10, 0x10, 1, 0x73, 0x61, 0x76, 0x65]);
        let begun = Wall::now();
        let order = bench.core.poll_store();
        shortest[0] = shortest[0].min(begun.elapsed());
        let begun = Wall::now();
        if let Some((device, _)) = order {
            bench.core.stored(bench.now, device, Ok(()));
        }
        shortest[1] = shortest[1].min(begun.elapsed());
    }
    found.note("parameters handed to the thread that stores", shortest[0], String::new);
    found.note("parameters are stored", shortest[1], String::new);
}

/// What is done for all devices at once.
fn crowd(bench: &mut Bench, found: &mut Found) {
    for (name, id, payload) in [
        ("SYNC", 0x080, &[][..]),
        ("NMT reset of all nodes", 0x000, &[0x81, 0]),
        ("NMT reset communication of all nodes", 0x000, &[0x82, 0]),
        ("NMT start of all nodes", 0x000, &[0x01, 0]),
    ] {
        let time = bench.shortest(TIMES, |bench| bench.hear(id, payload));
        found.note(name, time, String::new);
    }
    let mut last = Vec::new();
    let time =
        bench.shortest(TIMES, |bench| last = status::devices(bench.now, &bench.core, ["can0"].into_iter()));
    found.note("status of all devices, the one before given back", time, String::new);
    let time = bench
        .shortest(TIMES, |bench| last.extend(status::devices(bench.now, &bench.core, ["can0"].into_iter())));
    found.note("status of all devices", time, String::new);
    let mut clones: Vec<od::Dictionary> = Vec::new();
    let time = bench.shortest(20, |bench| {
        clones.extend(bench.core.network(LINK).map(|(_, node)| node.communication().clone()));
    });
    found.note("communication objects of all nodes copied", time, String::new);
    let time =
        bench.shortest(TIMES, |bench| bench.core.set_bus_state(bench.now, LINK, canopen::BusState::Off));
    found.note("bus-off", time, String::new);
    bench.core.set_bus_state(bench.now, LINK, canopen::BusState::Active);
    let time = bench.shortest(TIMES, |bench| {
        black_box(bench.core.subscriptions(LINK).count());
    });
    found.note("identifiers listed", time, String::new);
}
