//! Faults of the simulated plant, ordered while a core runs on virtual time.

mod common;

use std::sync::Arc;
use std::time::Duration;

use common::Bench;
use daemon::control::{AxisFaults, AxisSignals, Order, Outcome, SignalOrder, signals_text, text};
use daemon::core::{Core, LinkId, Plan};
use daemon::status::{Status, devices};
use od::{Address, Instant};
use profiles::{PlantSetup, Profile, ScheduledFault};

const MILLISECOND: Duration = Duration::from_millis(1);
const SECOND: Duration = Duration::from_secs(1);
/// EMCY of node 1: "DC link under-voltage" (IEC 61800-7-201), generic and voltage error.
const UNDER_VOLTAGE: &str = "081#2032050000000000";
const OVER: &str = "081#0000000000000000";

fn profile(name: &str) -> Arc<Profile> {
    Arc::new(Profile::embedded(name, None).unwrap().unwrap())
}

fn drive() -> Bench {
    Bench::of(&profile("cia402-servo"), &[&[(0, 1)]])
}

fn order(bench: &mut Bench, order: &Order) -> Outcome {
    order.carry_out(bench.now, &mut bench.core)
}

fn inject(bench: &mut Bench, fault: &str) -> Outcome {
    order(bench, &Order::Inject { device: "x".to_owned(), axis: None, fault: fault.parse().unwrap() })
}

fn clear(bench: &mut Bench, repair: &str) -> Outcome {
    order(bench, &Order::Repair { device: "x".to_owned(), axis: None, repair: repair.parse().unwrap() })
}

fn told(faults: &[&str]) -> Outcome {
    let faults = faults.iter().map(ToString::to_string).collect();
    Ok(vec![AxisFaults { device: "x".to_owned(), axis: 1, faults }])
}

fn velocity(bench: &Bench) -> f64 {
    bench.core.devices().next().unwrap().axes().next().unwrap().velocity.0
}

fn state(bench: &Bench) -> &'static str {
    bench.core.devices().next().unwrap().axes().next().unwrap().state.name()
}

#[test]
fn a_fault_while_the_axis_runs_is_told_by_emcy_the_axis_coasts_and_can_be_reset_once_it_is_cleared() {
    let mut bench = drive();
    bench.turn(0x1000);
    bench.run(SECOND);
    let before = velocity(&bench);
    assert!((before - 4096.0).abs() < 50.0, "{before}");

    assert_eq!(inject(&mut bench, "drive-fault:under-voltage"), told(&["drive-fault:under-voltage"]));

    assert_eq!(bench.run(2 * MILLISECOND), [UNDER_VOLTAGE]);
    assert_eq!(state(&bench), "FAULT");
    assert!(0.0 < velocity(&bench) && velocity(&bench) < before, "it coasts");
    bench.run(5 * SECOND);
    assert!(velocity(&bench).abs() < f64::EPSILON);

    bench.write(1, 0x6040, 0, &0x80_u16.to_le_bytes());
    bench.run(10 * MILLISECOND);
    assert_eq!(state(&bench), "FAULT");

    assert_eq!(clear(&mut bench, "drive-fault"), told(&[]));
    bench.write(1, 0x6040, 0, &0_u16.to_le_bytes());
    let mut sent = bench.send("601#2B40600080000000"); // fault reset
    sent.extend(bench.run(10 * MILLISECOND));
    assert!(sent.iter().any(|frame| frame == OVER), "{sent:?}");
    assert_eq!(state(&bench), "SWITCH ON DISABLED");
}

#[test]
fn an_axis_that_sleeps_meets_a_fault_in_its_next_raster_step() {
    let mut bench = drive();
    bench.run(10 * SECOND);
    assert_eq!(bench.core.poll_timeout(), None);

    inject(&mut bench, "drive-fault:under-voltage").unwrap();

    assert_eq!(bench.run(2 * MILLISECOND), [UNDER_VOLTAGE]);
    bench.run(SECOND);
    assert_eq!(bench.core.poll_timeout(), None, "it sleeps again");
}

#[test]
fn steps_that_are_due_before_the_fault_run_before_it() {
    let positions = [0, 10].map(|late| {
        let mut bench = drive();
        bench.turn(0x1000);
        bench.run(100 * MILLISECOND);
        // A loop that wakes late.
        bench.now = bench.now + late * MILLISECOND;
        inject(&mut bench, "encoder-break").unwrap();
        bench.core.devices().next().unwrap().axes().next().unwrap().position.0
    });
    assert!((positions[1] - positions[0] - 40.96).abs() < 5.0, "10 ms at 4096 counts/s: {positions:?}");
}

#[test]
fn what_is_not_there_is_an_error_and_nothing_breaks() {
    let mut bench = drive();
    let fault = "blocked-shaft".parse().unwrap();
    let of = |device: &str, axis| Order::Inject { device: device.to_owned(), axis, fault };
    assert_eq!(order(&mut bench, &of("y", None)), Err("no device `y`; there are: x".to_owned()));
    for axis in [0, 2, usize::MAX] {
        let refused = order(&mut bench, &of("x", Some(axis)));
        assert_eq!(refused, Err(format!("device `x` has no axis {axis}, only axis 1")));
    }
    assert_eq!(order(&mut bench, &Order::List { device: Some("x".to_owned()) }), told(&[]));
    let unknown = order(&mut bench, &Order::List { device: Some("y".to_owned()) });
    assert_eq!(unknown, Err("no device `y`; there are: x".to_owned()));

    let mut reference = Bench::of(&profile("canopen-reference"), &[&[(0, 1)]]);
    assert_eq!(order(&mut reference, &of("x", None)), Err("device `x` has no axis".to_owned()));
    assert_eq!(order(&mut reference, &Order::List { device: None }), Ok(Vec::new()));
}

#[test]
fn faults_of_the_configuration_come_in_the_time_of_the_plant_and_are_told_like_others() {
    let fault = "drive-fault:under-voltage".parse::<profiles::PlantFault>().unwrap().0;
    let faults = vec![ScheduledFault { fault, from_seconds: 5.0, until_seconds: Some(6.0) }];
    let plan = Plan {
        name: "x".into(),
        profile: profile("cia402-servo"),
        nodes: vec![(LinkId(0), 1)],
        plant: PlantSetup { faults, ..PlantSetup::default() },
        serial: None,
    };
    let now = Instant::ZERO;
    let mut bench = Bench { core: Core::new(1, &[plan], now).unwrap(), now };
    bench.core.start(now, LinkId(0));
    bench.sent_on(LinkId(0));

    let list = Order::List { device: None };
    assert_eq!(bench.run(4990 * MILLISECOND), [""; 0]);
    assert_eq!(order(&mut bench, &list), told(&[]));
    assert_eq!(bench.run(20 * MILLISECOND), [UNDER_VOLTAGE]);
    assert_eq!(order(&mut bench, &list), told(&["drive-fault:under-voltage"]));
    bench.run(SECOND);
    assert_eq!(order(&mut bench, &list), told(&[]));
}

#[test]
fn the_status_shows_what_is_broken() {
    let mut bench = drive();
    let shown = |bench: &Bench| {
        let devices = devices(bench.now, &bench.core, ["can0", "can1"].into_iter());
        daemon::status::text(&Status { devices, ..Status::default() })
    };
    assert!(!shown(&bench).contains("simulated faults"));
    inject(&mut bench, "stuck-switch:home=high").unwrap();
    inject(&mut bench, "blocked-shaft").unwrap();
    let text = shown(&bench);
    let line = "\nx, axis 1: simulated faults: blocked-shaft, stuck-switch:home=high\n";
    assert!(text.contains(line), "{text}");
}

#[test]
fn the_list_is_a_table() {
    let axis = |device: &str, axis, faults: &[&str]| AxisFaults {
        device: device.to_owned(),
        axis,
        faults: faults.iter().map(ToString::to_string).collect(),
    };
    let axes = [axis("x-axis", 1, &["blocked-shaft", "supply-dip:10"]), axis("y", 2, &[])];
    assert_eq!(
        text(&axes),
        "DEVICE  AXIS  FAULTS\nx-axis     1  blocked-shaft, supply-dip:10\ny          2  -\n"
    );
}

#[test]
fn a_signal_that_is_set_reaches_the_motor_and_a_wrong_order_changes_nothing() {
    /// ANINP, 512 for 5 V.
    const ANALOG_INPUT: Address = Address::new(0x2012, 122);
    let mut bench = Bench::of(&profile("jvl-mac00-fc4"), &[&[(0, 1)]]);
    bench.run(100 * MILLISECOND);
    let mut set = |axis, signal: &str| {
        let order = SignalOrder::Set { device: "x".to_owned(), axis, signal: signal.parse().unwrap() };
        order.carry_out(bench.now, &mut bench.core)
    };
    let expected = AxisSignals {
        device: "x".to_owned(),
        axis: 1,
        analog_input_v: 5.0,
        external_encoder_counts_per_s: -4000.0,
    };
    assert_eq!(set(None, "external-encoder:-4000").map(|axes| axes.len()), Ok(1));
    assert_eq!(set(Some(2), "analog-input:1"), Err("device `x` has no axis 2, only axis 1".to_owned()));
    let told = set(Some(1), "analog-input:5").unwrap();
    assert_eq!(told, [expected]);
    assert_eq!(
        signals_text(&told),
        "DEVICE  AXIS  ANALOG INPUT  EXTERNAL ENCODER\nx          1           5 V           -4000/s\n"
    );
    bench.run(10 * MILLISECOND);
    assert_eq!(bench.core.read(0, 0, ANALOG_INPUT).unwrap().raw(), 512);
}
