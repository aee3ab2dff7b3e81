//! Devices that join and leave a running core, on virtual time.

mod common;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use canopen::BusState;
use common::gateway::Gateway;
use common::{Bench, LINK, plan};
use daemon::core::{Admission, Core, LinkId, ListenerPlan, Notice, Unit};
use daemon::status::devices;
use profiles::Profile;
use proptest::prelude::*;

const MILLISECOND: Duration = Duration::from_millis(1);
const SECOND: Duration = Duration::from_secs(1);
const READ_DEVICE_TYPE_1: &str = "601#4000100000000000";
const DEVICE_TYPE_1: &str = "581#4300100092010200";

fn profile(name: &str) -> Arc<Profile> {
    Arc::new(Profile::embedded(name, None).unwrap().unwrap())
}

/// Lets a device of this name join, and its nodes on the first two links start; its position.
fn join(bench: &mut Bench, name: &str, profile: &Arc<Profile>, nodes: &[(u16, u8)]) -> usize {
    let unit = Unit::new(&plan(name, profile, nodes), bench.now).unwrap();
    let device = bench.core.join(unit);
    for link in [0, 1] {
        bench.core.start(bench.now, LinkId(link));
    }
    device
}

fn leave(bench: &mut Bench, name: &str) -> usize {
    let device = bench.core.find(name).unwrap();
    assert!(bench.core.leave(device).is_some_and(|unit| unit.name() == name));
    device
}

fn ids(core: &Core) -> Vec<String> {
    core.subscriptions(LINK).map(|id| id.to_string()).collect()
}

#[test]
fn a_device_that_joins_boots_and_answers_beside_the_others() {
    let mut bench = Bench::new(&[&[(0, 1)]]);

    let device = join(&mut bench, "new", &profile("cia402-servo"), &[(0, 7)]);

    assert_eq!((device, bench.core.find("new"), bench.core.find("newer")), (1, Some(1), None));
    assert_eq!(bench.sent_on(LINK), ["707#00"]);
    assert_eq!(bench.send("607#4000100000000000"), ["587#4300100092010200"]);
    assert_eq!(bench.send(READ_DEVICE_TYPE_1), [DEVICE_TYPE_1]);
}

#[test]
fn nobody_hears_a_device_that_has_left_and_its_identifiers_are_given_up() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.write(2, 0x1017, 0, &100_u16.to_le_bytes());
    while bench.core.poll_resubscribed().is_some() {}
    assert!(ids(&bench.core).contains(&"602".to_owned()));

    leave(&mut bench, "y");

    assert_eq!(bench.core.poll_resubscribed(), Some(LINK));
    assert!(!ids(&bench.core).contains(&"602".to_owned()), "{:?}", ids(&bench.core));
    assert!(ids(&bench.core).contains(&"601".to_owned()));
    assert_eq!(bench.send("602#4000100000000000"), [""; 0]);
    assert_eq!(bench.run(SECOND), [""; 0], "no heartbeat any more");
    assert_eq!(bench.core.names().collect::<Vec<_>>(), [(0, "x")]);
    assert_eq!(bench.send(READ_DEVICE_TYPE_1), [DEVICE_TYPE_1]);
}

#[test]
fn devices_are_listed_in_the_order_that_is_given_whichever_places_were_free() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    let servo = profile("cia402-servo");
    leave(&mut bench, "x");
    assert_eq!(join(&mut bench, "z", &servo, &[(0, 3)]), 0);
    assert_eq!(join(&mut bench, "a", &servo, &[(0, 4)]), 2);
    bench.sent_on(LINK);
    let listed = |bench: &Bench| -> Vec<String> {
        devices(bench.now, &bench.core, ["can0"].into_iter()).into_iter().map(|device| device.name).collect()
    };
    assert_eq!(listed(&bench), ["y", "z", "a"], "as they have joined");

    bench.core.arrange(&["a", "z", "y"].map(str::to_owned).into_iter().zip(0..).collect());

    assert_eq!(listed(&bench), ["a", "z", "y"]);
    assert_eq!(bench.core.names().collect::<Vec<_>>(), [(2, "a"), (0, "z"), (1, "y")]);
    let order = daemon::control::Order::List { device: None };
    let faults = order.carry_out(bench.now, &mut bench.core).unwrap();
    assert_eq!(faults.iter().map(|axis| &*axis.device).collect::<Vec<_>>(), ["a", "z", "y"]);
    assert_eq!(bench.send("602#4000100000000000"), ["582#4300100092010200"], "nothing else is otherwise");
}

#[test]
fn a_device_that_comes_back_boots_again_with_its_defaults() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.write(2, 0x607A, 0, &[7, 0, 0, 0]);
    bench.write(1, 0x607A, 0, &[7, 0, 0, 0]);
    let position = leave(&mut bench, "y");

    assert_eq!(join(&mut bench, "y", &profile("jvl-mac00-fc4"), &[(0, 2)]), position);

    assert_eq!(bench.sent_on(LINK), ["702#00"]);
    assert_eq!(bench.send("602#407A600000000000"), ["582#437A600000000000"]);
    assert_eq!(
        bench.send("601#407A600000000000"),
        ["581#437A600007000000"],
        "the other one keeps what it has"
    );
}

#[test]
fn a_node_that_joins_takes_its_place_behind_those_that_wait_for_its_link() {
    let mut bench = Bench::silent(&[&[(0, 1)]]);
    bench.core.start(bench.now, LINK);
    bench.sent_on(LINK);
    let unit = Unit::new(&plan("new", &profile("cia402-servo"), &[(1, 9)]), bench.now).unwrap();
    bench.core.join(unit);
    assert!(std::iter::from_fn(|| bench.core.poll_transmit()).next().is_none(), "its link is not there yet");
    bench.core.start(bench.now, LinkId(1));
    bench.core.set_bus_state(bench.now, LinkId(1), BusState::Active);
    assert_eq!(bench.sent_on(LinkId(1)), ["709#00"]);
}

#[test]
fn a_segmented_transfer_goes_on_while_others_come_and_go() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    let servo = profile("cia402-servo");
    // The name of the device (0x1008) has more than four bytes.
    let first = bench.send("601#4008100000000000").remove(0);
    let length = u8::from_str_radix(&first[12..14], 16).unwrap();
    let mut text = String::new();
    for segment in 0..length.div_ceil(7) {
        leave(&mut bench, "y");
        join(&mut bench, "z", &servo, &[(0, 3)]);
        leave(&mut bench, "z");
        join(&mut bench, "y", &servo, &[(0, 2)]);
        bench.sent_on(LINK);
        let answer = bench.send(
            &format!("601#{}000000000000 00", if segment % 2 == 0 { "60" } else { "70" }).replace(' ', ""),
        );
        let bytes = &answer[0][6..];
        text.extend(
            (0..14).step_by(2).map(|at| char::from(u8::from_str_radix(&bytes[at..at + 2], 16).unwrap())),
        );
    }
    assert!(text.starts_with("MAC00-FC4"), "{text:?}");
}

/// Velocities of the axis at position `device`, one each millisecond until it is at rest.
fn velocities(bench: &mut Bench, device: usize) -> Vec<f64> {
    let mut velocities = Vec::new();
    while !bench.core.is_at_rest(device) {
        assert!(velocities.len() < 5000, "it does not come to rest");
        bench.run(MILLISECOND);
        velocities.push(bench.core.device(device).unwrap().axes().next().unwrap().velocity.0);
    }
    velocities
}

#[test]
fn a_moving_axis_that_leaves_ramps_down_and_the_other_one_runs_on() {
    let mut bench = Bench::of(&profile("cia402-servo"), &[&[(0, 1)], &[(0, 2)]]);
    // The second one runs, too.
    for (index, bytes) in [(0x6060, &[3][..]), (0x6040, &[6, 0]), (0x6040, &[7, 0]), (0x6040, &[15, 0])] {
        bench.write(2, index, 0, bytes);
        bench.run(60 * MILLISECOND);
    }
    bench.write(2, 0x60FF, 0, &5000_u32.to_le_bytes());
    bench.write(1, 0x6085, 0, &20_000_u32.to_le_bytes());
    bench.turn(5000);
    bench.run(SECOND);
    let other = |bench: &Bench| bench.core.device(1).unwrap().axes().next().unwrap();
    assert!((other(&bench).velocity.0 - 5000.0).abs() < 100.0, "{:?}", other(&bench));
    assert!(!bench.core.may_leave(0));

    bench.core.shut_down_device(bench.now, 0);
    // No master gets it to run again.
    for controlword in ["06", "07", "0F"] {
        bench.send(&format!("601#2B406000{controlword}000000"));
    }
    let told = velocities(&mut bench, 0);

    assert!(told.len() > 100, "{} ms to rest", told.len());
    let steepest = told.windows(2).map(|pair| (pair[0] - pair[1]).abs()).fold(0.0, f64::max);
    assert!(steepest < 300.0, "a jump of {steepest} counts/s in a millisecond");
    assert!(bench.core.may_leave(0));
    assert!((other(&bench).velocity.0 - 5000.0).abs() < 100.0, "{:?}", other(&bench));
    leave(&mut bench, "x");
    bench.run(SECOND);
    assert!((other(&bench).velocity.0 - 5000.0).abs() < 100.0, "{:?}", other(&bench));
    assert_eq!(bench.core.device(1).unwrap().dropped_steps(), 0);
}

#[test]
fn an_axis_that_does_not_come_to_rest_coasts_and_masters_see_that() {
    let mut bench = Bench::of(&profile("cia402-servo"), &[&[(0, 1)], &[(0, 2)]]);
    bench.turn(5000);
    bench.run(SECOND);
    bench.write(1, 0x6085, 0, &1_u32.to_le_bytes());
    bench.core.shut_down_device(bench.now, 0);
    bench.run(5 * SECOND);
    let moving = |bench: &Bench| bench.core.device(0).unwrap().axes().next().unwrap().velocity.0;
    let before = moving(&bench);
    assert!(before > 4900.0, "{before}");
    while bench.core.poll_notice().is_some() {}

    bench.core.cut_power(bench.now);
    bench.core.cut_power(bench.now);

    // SWITCH ON DISABLED, not remote any more.
    let statusword = bench.send("601#4041600000000000").remove(0);
    assert_eq!(u8::from_str_radix(&statusword[12..14], 16).unwrap() & 0x6F, 0x40, "{statusword}");
    let notices: Vec<_> = std::iter::from_fn(|| bench.core.poll_notice()).collect();
    assert_eq!(notices, [(0, Notice::PowerCut); 2], "it moves still; what is at rest is left alone");
    bench.run(2 * MILLISECOND);
    assert!(moving(&bench) > 0.9 * before, "{}", moving(&bench));
    for controlword in ["06", "07", "0F"] {
        bench.send(&format!("601#2B406000{controlword}000000"));
        bench.run(100 * MILLISECOND);
        assert!(moving(&bench) <= before);
    }
    velocities(&mut bench, 0);
    assert!(bench.core.may_leave(0) && bench.core.may_leave(1));
}

#[test]
fn what_is_being_stored_holds_a_device_until_it_is() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.run(SECOND);
    assert!(bench.core.may_leave(1));
    assert_eq!(bench.send("602#2310100173617665"), [""; 0]);
    assert!(!bench.core.may_leave(1) && bench.core.is_storing(1) && bench.core.is_at_rest(1));
    let (device, _) = bench.core.poll_store().unwrap();
    bench.core.stored(bench.now, device, Ok(()));
    assert_eq!(bench.sent_on(LINK), ["582#6010100100000000"]);
    assert!(bench.core.may_leave(1));
}

#[test]
fn an_order_to_store_is_forgotten_with_its_device() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.send("602#2310100173617665");
    leave(&mut bench, "y");
    join(&mut bench, "z", &profile("jvl-mac00-fc4"), &[(0, 2)]);
    assert!(bench.core.poll_store().is_none());
    bench.sent_on(LINK);
    bench.core.stored(bench.now, 1, Ok(()));
    assert_eq!(bench.sent_on(LINK), [""; 0], "nobody has ordered that");
}

#[test]
fn a_link_that_another_bus_gets_begins_anew() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(1, 2)]]);
    leave(&mut bench, "y");
    bench.core.open_link(LinkId(1));
    bench.core.open_link(LinkId(3));
    let servo = profile("cia402-servo");
    bench.core.join(Unit::new(&plan("z", &servo, &[(3, 4), (1, 5)]), bench.now).unwrap());
    for (link, boot_up) in [(3, "704#00"), (1, "705#00")] {
        bench.core.start(bench.now, LinkId(link));
        assert_eq!(bench.sent_on(LinkId(link)), [boot_up]);
    }
    bench.send_on(LinkId(3), "604#4000100000000000");
    assert_eq!(bench.sent_on(LinkId(3)), ["584#4300100092010200"]);
}

#[test]
fn modbus_clients_stay_while_the_device_behind_their_unit_is_another_one() {
    let mut gateway = Gateway::new(&[1, 2]);
    let client = gateway.connect();
    let at = gateway.at(0x6041, 0);
    let read = format!("03 {at} 00 01");
    assert!(gateway.ask(client, 2, &read).starts_with("03 02"));

    leave(&mut gateway.bench, "y");

    assert_eq!(gateway.ask(client, 2, &read), "83 0B", "nobody is there");
    assert!(gateway.ask(client, 1, &read).starts_with("03 02"));
    let device = join(&mut gateway.bench, "y", &profile("cia402-servo"), &[(0, 2)]);
    gateway.show(device, 2);
    gateway.bench.core.set_listener_device(0, Some(device));
    assert!(gateway.ask(client, 2, &read).starts_with("03 02"));
}

#[test]
fn a_listener_that_changes_keeps_the_clients_that_may_stay() {
    let mut gateway = Gateway::new(&[1]);
    let (peers, core) = ([1, 2, 3], &mut gateway.bench.core);
    let clients = peers.map(|n| core.connect(gateway.bench.now, 0, common::gateway::peer(n), false).unwrap());
    let admission = |peer| match peer {
        peer if peer == common::gateway::peer(1) => Admission::Full,
        peer if peer == common::gateway::peer(2) => Admission::Reads,
        _ => Admission::Refused,
    };

    core.change_listener(0, ListenerPlan { device: Some(0), ..common::gateway::listener() }, admission);

    assert_eq!((core.poll_closed(), core.poll_closed()), (Some(clients[2]), None));
    core.disconnect(clients[2]);
    let write = format!("06 {} 00 06", gateway.at(0x6040, 0));
    assert_eq!(gateway.ask(clients[0], 1, &write), write);
    assert_eq!(gateway.ask(clients[1], 1, &write), "86 02", "it may only read now");
    assert_eq!(gateway.bench.core.modbus_listeners().next().unwrap().clients, 2);
}

/// What happens between two requests.
#[derive(Clone, Copy, Debug)]
enum Event {
    Join(u8),
    Leave(u8),
    Wait,
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![(2..8_u8).prop_map(Event::Join), (2..8_u8).prop_map(Event::Leave), Just(Event::Wait)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn whoever_comes_and_goes_untouched_nodes_answer_each_frame(events in prop::collection::vec(event(), 1..40)) {
        let mut bench = Bench::new(&[&[(0, 1)]]);
        bench.map(1, 0x1800, 0x181, 0x6041_0010);
        bench.write(1, 0x1800, 2, &[1]);
        bench.write(1, 0x1017, 0, &10_u16.to_le_bytes());
        bench.send("000#0101");
        let kinds = [profile("cia402-servo"), profile("canopen-reference")];
        let mut there = BTreeMap::new();
        for event in events {
            match event {
                Event::Join(node) if !there.contains_key(&node) => {
                    let kind = &kinds[usize::from(node % 2)];
                    let nodes: &[(u16, u8)] = if node < 5 { &[(0, node)] } else { &[(0, node), (1, node)] };
                    let name = format!("d{node}");
                    let device = join(&mut bench, &name, kind, nodes);
                    prop_assert!(device <= there.len() + 1, "places are given again");
                    there.insert(node, name);
                    prop_assert_eq!(bench.sent_on(LINK), [format!("70{node}#00")]);
                }
                Event::Leave(node) => {
                    there.remove(&node).into_iter().for_each(|name| { leave(&mut bench, &name); });
                }
                Event::Join(_) | Event::Wait => {}
            }
            // A heartbeat each 10 ms, whatever happens.
            let beats = bench.run(10 * MILLISECOND);
            prop_assert_eq!(beats.iter().filter(|frame| frame.starts_with("701#05")).count(), 1);
            prop_assert_eq!(bench.send(READ_DEVICE_TYPE_1), [DEVICE_TYPE_1]);
            let answers = bench.send("080#");
            prop_assert_eq!(answers.iter().filter(|frame| frame.starts_with("181#")).count(), 1);
            for node in there.keys() {
                let answer = bench.send(&format!("60{node}#4000100000000000"));
                prop_assert!(answer.len() == 1 && answer[0].starts_with(&format!("58{node}#430010")), "{:?}", answer);
            }
        }
    }
}

#[test]
fn a_thousand_reloads_take_no_more_places_than_one() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.core.keep_audit();
    let servo = profile("cia402-servo");
    for _ in 0..1000 {
        assert_eq!(leave(&mut bench, "y"), 1);
        assert_eq!(join(&mut bench, "y", &servo, &[(0, 2), (1, 2)]), 1);
        bench.sent_on(LINK);
        while bench.core.poll_notice().is_some() {}
    }
    assert_eq!(bench.core.names().count(), 2);
    assert_eq!(ids(&bench.core).iter().filter(|id| *id == "602").count(), 1);
    assert!(bench.core.queues().all(|(_, waiting)| waiting == 0));
    assert_eq!(bench.send(READ_DEVICE_TYPE_1), [DEVICE_TYPE_1]);
    assert_eq!(bench.send("602#4000100000000000"), ["582#4300100092010200"]);
}
