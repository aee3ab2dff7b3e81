//! What the status says of a core on virtual time.

mod common;

use std::sync::Arc;
use std::time::Duration;

use canopen::BusState;
use common::{Bench, LINK};
use daemon::status::{Bus, Device, Event, Status, devices, text};
use profiles::Profile;

const SECOND: Duration = Duration::from_secs(1);

/// Two reference devices, nodes 1 and 2.
fn pair() -> Bench {
    let profile = Arc::new(Profile::embedded("canopen-reference", None).unwrap().unwrap());
    Bench::of(&profile, &[&[(0, 1)], &[(0, 2)]])
}

fn status_of(bench: &Bench) -> Vec<Device> {
    devices(bench.now, &bench.core, ["can0", "can1"].into_iter())
}

/// What `axisctl status` prints of the devices, on a bus where all is well.
fn shown(bench: &Bench) -> String {
    let bus = Bus {
        name: "can0".to_owned(),
        state: "error active".to_owned(),
        bits_per_s: 12_400,
        ..Bus::default()
    };
    text(&Status { buses: vec![bus], devices: status_of(bench), ..Status::default() })
}

fn event(age_ms: u64, code: u32, text: &str) -> Event {
    Event { age_ms, code: Some(code), text: text.to_owned(), ..Event::default() }
}

#[test]
fn a_device_shows_state_mode_position_and_velocity_of_its_axis() {
    let mut bench = Bench::new(&[&[(0, 1), (1, 9)]]);
    bench.turn(0x1000);
    bench.send("000#0101");
    bench.run(SECOND);

    let device = &status_of(&bench)[0];

    assert_eq!((device.name.as_str(), device.profile.as_str()), ("x", "jvl-mac00-fc4"));
    let nodes: Vec<_> = device.nodes.iter().map(|n| (n.bus.as_str(), n.node_id, n.state.as_str())).collect();
    assert_eq!(nodes, [("can0", 1, "OPERATIONAL"), ("can1", 9, "PRE-OPERATIONAL")]);
    let [axis] = &device.axes[..] else { panic!("one axis: {device:?}") };
    assert_eq!((axis.state.as_str(), axis.mode.as_str()), ("OPERATION ENABLED", "profile velocity"));
    assert!((axis.velocity_counts_s - 4096.0).abs() < 50.0, "{axis:?}");
    assert!(axis.position_counts > 3000.0, "{axis:?}");
    assert_eq!(axis.fault, None);
}

#[test]
fn every_abort_is_told_with_its_words_its_object_and_its_age() {
    let mut bench = pair();
    bench.send("601#4000500000000000");
    bench.now = bench.now + SECOND;
    bench.send("601#2F00100001000000");

    let aborts = &status_of(&bench)[0].nodes[0].aborts;

    let object = |event: Event, object: &str| Event { object: Some(object.to_owned()), ..event };
    let read_only = event(0, 0x0601_0002, "attempt to write a read only object");
    let missing = event(1000, 0x0602_0000, "object does not exist in the object dictionary");
    assert_eq!(aborts.count, 2);
    assert_eq!(aborts.last, [object(read_only, "0x1000:00"), object(missing, "0x5000:00")]);
    assert_eq!(status_of(&bench)[1].nodes[0].aborts.count, 0);
}

#[test]
fn emergencies_are_told_in_words_where_they_are_sent_and_where_they_are_heard() {
    let mut bench = pair();
    bench.write(2, 0x1028, 1, &0x81_u32.to_le_bytes());
    bench.send("000#0100");
    bench.send("201#11");
    bench.now = bench.now + SECOND;

    let [left, right] = &status_of(&bench)[..] else { panic!("two devices") };

    let told = event(1000, 0x8210, "PDO not processed, too short");
    let (left, right) = (&left.nodes[0], &right.nodes[0]);
    assert_eq!((left.emergencies.count, left.emergencies.last.as_slice()), (1, [told.clone()].as_slice()));
    assert_eq!(right.heard.last, [Event { from: Some(1), ..told }]);
    assert_eq!(left.errors.iter().map(|error| error.code).collect::<Vec<_>>(), [0x8210]);
    assert_eq!(left.counters.short_rpdos, 1);

    bench.send("201#1122334455667788");
    let left = &status_of(&bench)[0].nodes[0];
    assert_eq!((left.errors.as_slice(), left.emergencies.count), ([].as_slice(), 2));
}

#[test]
fn a_vendors_code_has_the_vendors_words() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x6007, 0, &1_u16.to_le_bytes());
    bench.turn(0x1000);
    bench.core.set_bus_state(bench.now, LINK, BusState::Off);
    bench.run(SECOND);
    let device = &status_of(&bench)[0];
    let fault = device.axes[0].fault.as_ref().unwrap();
    assert_eq!((fault.code, fault.text.as_str()), (0x1001, "motor error"));
    let lost: Vec<_> =
        device.nodes[0].lost_connections.last.iter().map(|event| event.text.as_str()).collect();
    assert_eq!(lost, ["off the bus"]);
}

#[test]
fn the_text_has_a_line_for_every_node_and_says_what_went_wrong() {
    let mut bench = pair();
    bench.send("000#0101");
    bench.send("201#11");
    bench.now = bench.now + 61 * SECOND;
    bench.send("601#4000500000000000");

    assert_eq!(
        shown(&bench),
        "\
DEVICE  NODE    NMT              STATE  MODE  POSITION  VELOCITY  ERROR                                BUS STATE        BUS LOAD
x       can0/1  OPERATIONAL      -      -            -         -  0x8210 PDO not processed, too short  error active  12.4 kbit/s
y       can0/2  PRE-OPERATIONAL  -      -            -         -  -                                    error active  12.4 kbit/s

BUS   LINK  STATE                LOAD  IN  OUT  LOST  UNSENT  ERRORS
can0        error active  12.4 kbit/s   0    0     0       0       0

x, node 1 on can0:
  error: 0x8210 PDO not processed, too short
  EMCY sent: 1
       1 min ago  0x8210 PDO not processed, too short
  SDO aborted: 1
        0 ms ago  0x06020000 object does not exist in the object dictionary, 0x5000:00
  RPDOs too short, not taken: 1
"
    );
}

#[test]
fn what_is_told_survives_the_way_as_json() {
    let mut bench = pair();
    bench.send("601#4000500000000000");
    let status = Status { devices: status_of(&bench), ..Status::default() };
    let json = serde_json::to_string(&status).unwrap();
    assert!(!json.contains('\n'));
    assert_eq!(serde_json::from_str::<Status>(&json).unwrap(), status);
}

#[test]
fn a_bus_that_is_off_says_who_ends_that() {
    let shown = |state: &str, restart_ms| {
        let (name, link) = ("can0".to_owned(), "socketcan:can7".to_owned());
        let bus = Bus { name, link, state: state.to_owned(), restart_ms, ..Bus::default() };
        text(&Status { buses: vec![bus], ..Status::default() })
    };
    let manual = "\ncan0: off until somebody does `ip link set can7 type can restart`\n";
    assert!(shown("bus off", Some(0)).contains(manual));
    assert!(
        shown("bus off", Some(100)).contains("\ncan0: off, the interface restarts by itself after 100 ms\n")
    );
    for (state, restart_ms) in [("bus off", None), ("error active", Some(0)), ("error passive", Some(100))] {
        assert!(!shown(state, restart_ms).contains("can0: off"));
    }
}

#[test]
fn a_bus_without_room_says_what_waits_and_what_was_replaced() {
    let shown = |waiting, replaced| {
        let bus = Bus { name: "can0".to_owned(), waiting, replaced, ..Bus::default() };
        text(&Status { buses: vec![bus], ..Status::default() })
    };
    let expected =
        "\ncan0: 3 frames wait for the interface, 40 PDOs and heartbeats were replaced by newer ones\n";
    assert!(shown(3, 40).contains(expected));
    assert!(!shown(0, 0).contains("wait"));
}
