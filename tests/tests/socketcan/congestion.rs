//! An interface that has no room for what the nodes have to say: `netem` in front of one end of a wire answers ENOBUFS, and
//! at the other end arrives what was kept.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

use tests::{Bus, Daemon, Master, PATIENCE, TempDir, Vcan, Wire, config};

use crate::READ_DEVICE_TYPE;
use crate::watching::number;

const REFERENCE: &str = "canopen-reference";
const NODES: [u8; 3] = [1, 2, 3];
/// Frames in the transmit queue and how long each of them is there: forty leave in a second.
const ROOM: u32 = 2;
const DELAY: Duration = Duration::from_millis(50);
/// What the nodes answer to a cycle, six PDOs, comes twenty times as fast, so that it is too much from a slow machine, too.
const CYCLE: Duration = Duration::from_micros(7_500);
const CYCLES: u32 = 200;
/// So often each node gets an RPDO that is too short, and tells it, and then that it is over.
const MISTAKES: u32 = 4;

const DEVICE_TYPE: &str = "581#4300100000000000";
const SHORT_RPDO: &str = "1082";
const NO_ERROR: &str = "0000";

#[test]
fn while_an_interface_has_no_room_nothing_is_reordered_or_lost_but_pdos_that_newer_ones_replace() {
    let ((near, far), dir) = (Vcan::pair(), TempDir::new());
    let socket = dir.path().join("control.sock").display().to_string();
    let devices = NODES.map(|node_id| (format!("n{node_id}"), node_id));
    let devices = devices.each_ref().map(|(name, node_id)| (name.as_str(), REFERENCE, *node_id));
    // The device waits longer for its SDO client, which is slow on a busy machine.
    let config = config(Bus::Interface(&near), &devices).replace("bus =", "sdo_timeout_ms = 30000\nbus =");
    let _daemon = Daemon::start(&format!("[control]\nsocket = \"{socket}\"\n\n{config}"));
    let mut wire = Wire::on(&far);
    wire.ask_until(READ_DEVICE_TYPE, DEVICE_TYPE);
    wire.send("000#0100");
    // Its answer comes behind those to what was asked too often.
    wire.send("601#40FF5F0000000000");
    wire.expect("581#80FF5F0000000206");
    let _ = wire.take();
    let (sent_before, load) = (number(&socket, "sent"), load(&dir, &far));
    let master = Master::on(&far, REFERENCE);
    near.choke(ROOM, DELAY);

    let log = thread::scope(|scope| {
        let transfer = scope.spawn(|| master.run("reference", &["small"]));
        wire.play(&load);
        transfer.join().expect("the script succeeds")
    });
    assert_eq!(log, "300 bytes down and up\n");

    let deadline = Instant::now() + PATIENCE;
    while number(&socket, "waiting") > 0 {
        assert!(Instant::now() < deadline, "frames still wait");
    }
    // Its answer comes behind all that was in the transmit queue.
    let _ = wire.ask(READ_DEVICE_TYPE, "581");
    let frames = wire.take();
    let (replaced, unsent) = (number(&socket, "replaced"), number(&socket, "unsent"));
    println!("{} frames arrived, {replaced} PDOs were replaced", frames.len());
    assert!(replaced > 0 && unsent == 0, "{replaced} replaced, {unsent} lost");
    let ours = frames.iter().filter(|frame| is_of_a_node(frame)).count() as u64;
    assert_eq!(number(&socket, "sent") - sent_before, ours + replaced, "all is accounted for");
    for node in NODES {
        assert_in_order(&frames, node);
    }

    near.free();
    wire.play(&load);
    let _ = wire.ask(READ_DEVICE_TYPE, "581");
    let frames = wire.take();
    for node in NODES {
        assert_eq!(payloads(&frames, 0x280, node).count(), CYCLES as usize, "each SYNC has its answer again");
        assert_in_order(&frames, node);
    }
    assert_eq!((number(&socket, "replaced"), number(&socket, "unsent")), (replaced, 0));
}

/// What a master sends: in each cycle an event-driven and a synchronous RPDO for each node with the number of the cycle, which
/// the node sends back by TPDO 1 and 2, and SYNC.
fn load(dir: &TempDir, interface: &Vcan) -> PathBuf {
    let mut log = String::new();
    for cycle in 1..=CYCLES {
        let value = format!("{:08X}00000000", cycle.swap_bytes());
        // The next one ends the error.
        let is_mistake = cycle % (CYCLES / MISTAKES) == 1;
        let event_driven = if is_mistake { "0102" } else { &value };
        let rpdos = NODES.iter().map(|node| format!("20{node}#{event_driven}"));
        let frames =
            rpdos.chain(NODES.iter().map(|node| format!("30{node}#{value}"))).chain(["080#".to_owned()]);
        let time = CYCLE * cycle;
        for frame in frames {
            let (seconds, micros) = (time.as_secs(), time.subsec_micros());
            writeln!(log, "({seconds}.{micros:06}) {} {frame}", interface.name()).expect("a string takes it");
        }
    }
    dir.write("master.log", &log)
}

/// The payloads of a node's frames with the COB-ID `base` plus its Node-ID.
fn payloads(frames: &[String], base: u16, node: u8) -> impl Iterator<Item = &str> {
    let head = format!("{:03X}#", base + u16::from(node));
    frames.iter().filter_map(move |frame| frame.strip_prefix(&head))
}

fn is_of_a_node(frame: &str) -> bool {
    const FUNCTIONS: [u16; 7] = [0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700];
    let id = frame.split('#').next().and_then(|id| u16::from_str_radix(id, 16).ok()).expect("an identifier");
    NODES.iter().any(|node| FUNCTIONS.map(|base| base + u16::from(*node)).contains(&id))
}

/// Of each PDO the numbers rise up to the last one, and each error is told and then its end.
fn assert_in_order(frames: &[String], node: u8) {
    for base in [0x180, 0x280] {
        let value = |payload: &str| payload.get(..8).and_then(|digits| u32::from_str_radix(digits, 16).ok());
        let values =
            payloads(frames, base, node).map(|payload| value(payload).expect("a value").swap_bytes());
        let values: Vec<u32> = values.collect();
        assert!(values.is_sorted_by(|a, b| a < b), "TPDO {base:03X} of node {node}: {values:?}");
        assert_eq!(values.last(), Some(&CYCLES), "the last value arrives");
    }
    let told: Vec<&str> = payloads(frames, 0x080, node).filter_map(|payload| payload.get(..4)).collect();
    assert_eq!(told, [SHORT_RPDO, NO_ERROR].repeat(MISTAKES as usize), "node {node}");
}
