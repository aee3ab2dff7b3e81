//! Stored parameters in the core, on virtual time.

mod common;

use std::time::Duration;

use common::{Bench, LINK};
use daemon::core::{LinkId, NodeParameters, Parameters};
use od::{AbortCode, Address, Saved};

const SAVE_ALL: &str = "601#2310100173617665";
const LOAD_ALL: &str = "601#231110016C6F6164";

/// Takes the order of the only device and ends it.
fn obey(bench: &mut Bench) -> Parameters {
    let (device, parameters) = bench.core.poll_store().expect("an order");
    assert_eq!(device, 0);
    bench.core.stored(bench.now, device, Ok(()));
    parameters
}

/// A device on `nodes` that has `parameters` in store; what it sends when it is powered on, on the first link.
fn start_with(nodes: &[(u16, u8)], parameters: Parameters) -> (Bench, Vec<String>) {
    let mut bench = Bench::silent(&[nodes]);
    assert_eq!(bench.core.load(bench.now, 0, parameters), 0);
    bench.core.start(bench.now, LINK);
    let sent = bench.sent_on(LINK);
    bench.core.start(bench.now, LinkId(1));
    bench.sent_on(LINK);
    (bench, sent)
}

#[test]
fn what_was_saved_is_there_after_the_power_was_cut() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x1015, 0, &[0x39, 0x30]);
    bench.write(1, 0x6081, 0, &[1, 2, 3, 4]);
    assert!(bench.send(SAVE_ALL).is_empty(), "the answer waits");
    let parameters = obey(&mut bench);
    assert_eq!(bench.sent_on(LINK), ["581#6010100100000000"]);
    assert_eq!(parameters.application.get(Address::new(0x6081, 0)), Some(&[1, 2, 3, 4][..]));
    assert_eq!(parameters.nodes[0].communication.get(Address::new(0x1015, 0)), Some(&[0x39, 0x30][..]));

    let (mut bench, _) = start_with(&[(0, 1)], parameters);
    assert_eq!(bench.send("601#4015100000000000"), ["581#4B15100039300000"]);
    assert_eq!(bench.send("601#4081600000000000"), ["581#4381600001020304"]);
}

#[test]
fn a_reset_of_the_node_goes_back_to_what_was_saved() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x6081, 0, &[1, 2, 3, 4]);
    bench.send(SAVE_ALL);
    obey(&mut bench);
    bench.sent_on(LINK);
    bench.write(1, 0x6081, 0, &[9, 9, 0, 0]);
    bench.send("000#8101");
    assert_eq!(bench.send("601#4081600000000000"), ["581#4381600001020304"]);
}

#[test]
fn saved_parameters_of_an_axis_act() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x6080, 0, &60_u32.to_le_bytes()); // 1/min, 4096 counts a revolution
    bench.send(SAVE_ALL);
    let parameters = obey(&mut bench);
    let (mut bench, _) = start_with(&[(0, 1)], parameters);
    bench.turn(100_000);
    bench.run(Duration::from_secs(2));
    let velocity = bench.core.devices().next().unwrap().axes().next().unwrap().velocity.0;
    assert!((4000.0..4200.0).contains(&velocity), "{velocity}");
}

#[test]
fn what_could_not_be_stored_is_not_in_effect() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x6081, 0, &[1, 2, 3, 4]);
    bench.send(SAVE_ALL);
    bench.core.poll_store().unwrap();
    bench.core.stored(bench.now, 0, Err(AbortCode::Hardware));
    assert_eq!(bench.sent_on(LINK), ["581#8010100100000606"]);
    bench.send("000#8101");
    assert_eq!(bench.send("601#4081600000000000"), ["581#4381600064000000"], "the default");
}

#[test]
fn restored_defaults_are_nothing_stored() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x6081, 0, &[1, 2, 3, 4]);
    bench.send(SAVE_ALL);
    assert!(!obey(&mut bench).is_empty());
    bench.sent_on(LINK);
    bench.send(LOAD_ALL);
    assert!(obey(&mut bench).is_empty());
    assert_eq!(bench.sent_on(LINK), ["581#6011100100000000"]);
}

#[test]
fn each_node_of_a_device_saves_its_own_communication() {
    let mut bench = Bench::new(&[&[(0, 1), (1, 7)]]);
    bench.write(1, 0x1015, 0, &[1, 0]);
    bench.send(SAVE_ALL);
    let first = obey(&mut bench);
    assert_eq!(first.nodes.len(), 2);
    assert!(first.nodes[1].is_empty() && !first.nodes[0].is_empty());
    bench.sent_on(LINK);

    bench.send_on(LinkId(1), "607#2310100173617665");
    let both = obey(&mut bench);
    assert_eq!(bench.sent_on(LinkId(1)), ["587#6010100100000000"]);
    assert_eq!(both.nodes[0], first.nodes[0]);
    assert!(!both.nodes[1].is_empty());

    let (mut bench, _) = start_with(&[(0, 1), (1, 7)], both);
    assert_eq!(bench.send("601#4015100000000000"), ["581#4B15100001000000"]);
}

#[test]
fn a_device_has_one_order_at_a_time() {
    let mut bench = Bench::new(&[&[(0, 1), (1, 7)]]);
    bench.send(SAVE_ALL);
    bench.send_on(LinkId(1), "607#2310100173617665");
    assert_eq!(bench.sent_on(LinkId(1)), ["587#8010100122000008"]);
    obey(&mut bench);
    assert_eq!(bench.sent_on(LINK), ["581#6010100100000000"]);
    assert!(bench.core.poll_store().is_none());
}

// EMCY 6310h: loss of parameters.
#[test]
fn lost_parameters_are_told_until_there_are_others() {
    let mut bench = Bench::silent(&[&[(0, 1)]]);
    bench.core.lose_parameters(0);
    bench.core.start(bench.now, LINK);
    assert_eq!(bench.sent_on(LINK), ["701#00", "081#1063010000000000"]);
    bench.send(SAVE_ALL);
    obey(&mut bench);
    assert_eq!(bench.sent_on(LINK), ["581#6010100100000000", "081#0000000000000000"]);
}

#[test]
fn nothing_stored_is_no_emergency() {
    let (_, sent) = start_with(&[(0, 1)], Parameters::default());
    assert_eq!(sent, ["701#00"]);
}

#[test]
fn values_that_fit_no_more_are_counted() {
    let mut application = Saved::default();
    application.insert(Address::new(0x6081, 0), vec![1, 2, 3, 4]);
    application.insert(Address::new(0x6082, 0), vec![1, 2, 3, 4]);
    let mut communication = Saved::default();
    communication.insert(Address::new(0x1017, 0), vec![1]);
    let parameters =
        Parameters { application, nodes: [communication.clone(), communication].map(node).into() };
    let mut bench = Bench::silent(&[&[(0, 1)]]);
    assert_eq!(bench.core.load(bench.now, 0, parameters), 3, "no such object, too short, no such node");
    bench.core.start(bench.now, LINK);
    bench.sent_on(LINK);
    assert_eq!(bench.send("601#4081600000000000"), ["581#4381600001020304"]);
}

/// V_SOLL of the motor.
fn v_soll(bench: &mut Bench) -> Vec<String> {
    bench.send("601#4012200500000000")
}

#[test]
fn a_motor_that_is_told_to_save_and_reset_does_both_and_its_client_need_not_wait() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x2012, 5, &[0x39, 0x05, 0, 0]);
    bench.write(1, 0x6081, 0, &[1, 2, 3, 4]);
    assert_eq!(bench.send("601#231220D302000000"), ["581#601220D300000000"]);
    bench.write(1, 0x2012, 6, &[77, 0, 0, 0]);
    let parameters = obey(&mut bench);
    assert_eq!(parameters.application.get(Address::new(0x2012, 5)), Some(&[0x39, 5, 0, 0][..]));
    assert_eq!(parameters.application.get(Address::new(0x6081, 0)), None, "the motor's registers alone");
    assert_eq!(v_soll(&mut bench), ["581#4312200539050000"]);
    assert_eq!(
        bench.send("601#4012200600000000"),
        ["581#4312200614000000"],
        "reset: what came later is gone"
    );
    assert_eq!(bench.send("601#4081600000000000"), ["581#4381600001020304"], "the module was not reset");

    let (mut bench, _) = start_with(&[(0, 1)], parameters);
    assert_eq!(v_soll(&mut bench), ["581#4312200539050000"]);
}

#[test]
fn a_motor_waits_until_a_node_has_stored() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x2012, 5, &[0x39, 0x05, 0, 0]);
    bench.send(SAVE_ALL);
    bench.send("601#231220D302000000");
    obey(&mut bench);
    let of_motor = obey(&mut bench);
    assert!(of_motor.application.get(Address::new(0x2012, 5)).is_some());
    assert!(bench.core.poll_store().is_none());
}

#[test]
fn a_motor_that_could_not_be_saved_runs_on() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x2012, 5, &[0x39, 0x05, 0, 0]);
    bench.send("601#231220D302000000");
    bench.core.poll_store().unwrap();
    bench.core.stored(bench.now, 0, Err(AbortCode::Hardware));
    assert_eq!(v_soll(&mut bench), ["581#4312200539050000"]);
    bench.send("000#8101");
    assert_eq!(v_soll(&mut bench), ["581#43122005D2000000"], "the default");
}

fn node(communication: Saved) -> NodeParameters {
    NodeParameters { communication, ..NodeParameters::default() }
}
