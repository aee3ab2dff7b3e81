//! A device whose plant is another than the motor's own, and breaks.

mod bench;

use std::sync::Arc;

use bench::Bench;
use od::Instant;
use profiles::{
    Device, DeviceEvent, NoPlant, PlantFault, PlantSetup, Position, PositionRange, Profile, Repair,
    ScheduledFault, State, Velocity, Voltage,
};

const PROFILE_VELOCITY: i64 = 3;
const FAULT_RESET: i64 = 0x80;

fn bench(setup: &PlantSetup) -> Bench {
    let profile = Arc::new(Profile::embedded("cia402-servo", None).unwrap().unwrap());
    let mut bench =
        Bench { device: Device::with_plant(profile, 1, Instant::ZERO, setup), now: Instant::ZERO };
    bench.run(10);
    bench
}

/// An axis that runs at 20,000 counts/s.
fn running() -> Bench {
    let mut bench = bench(&PlantSetup::default());
    bench.fast_profile();
    bench.enable(PROFILE_VELOCITY);
    bench.set(0x60FF, 20_000);
    bench.run_until(|b| (b.velocity() - 20_000).abs() < 200);
    bench
}

fn fault(text: &str) -> PlantFault {
    text.parse().unwrap()
}

fn inject(bench: &mut Bench, text: &str) {
    bench.device.inject(bench.now, 0, fault(text)).unwrap();
}

fn repair(bench: &mut Bench, repair: Repair) {
    bench.device.repair(bench.now, 0, repair).unwrap();
}

/// The codes of the faults that came.
fn raised(bench: &mut Bench) -> Vec<u16> {
    let code = |event| match event {
        DeviceEvent::Raised(fault) => Some(fault.code),
        DeviceEvent::Cleared(_) | DeviceEvent::Store(_) => None,
    };
    bench.events().into_iter().filter_map(code).collect()
}

#[test]
fn a_drive_that_breaks_while_it_runs_tells_so_coasts_and_works_again_once_repaired() {
    // Error codes of IEC 61800-7-201, 0x603F.
    for (text, code) in
        [("drive-fault:over-temperature", 0x4310), ("supply-dip:10", 0x3220), ("encoder-break", 0x7305)]
    {
        let mut bench = running();
        inject(&mut bench, text);
        // The capacitors bridge a dip of the supply for a while.
        bench.run_until(|b| b.state() == State::Fault);
        assert_eq!(raised(&mut bench), [code], "{text}");
        bench.run(5000);
        assert_eq!(bench.velocity(), 0, "{text}");
        assert!(bench.device.is_quiet(), "{text}");

        bench.control(FAULT_RESET);
        bench.run(2);
        assert_eq!(bench.state(), State::Fault, "{text}: it is still broken");

        repair(&mut bench, Repair::All);
        bench.control(0);
        // The capacitors fill up again.
        bench.run(200);
        bench.control(FAULT_RESET);
        bench.run(2);
        assert_eq!(bench.state(), State::SwitchOnDisabled, "{text}");
        bench.enable(PROFILE_VELOCITY);
        bench.run_until(|b| (b.velocity() - 20_000).abs() < 200);
    }
}

#[test]
fn an_axis_that_sleeps_wakes_for_a_fault_and_for_its_repair() {
    let mut bench = bench(&PlantSetup::default());
    bench.run(1000);
    assert_eq!(bench.device.poll_timeout(), None);

    inject(&mut bench, "stuck-switch:home=high");
    assert!(bench.device.poll_timeout().is_some());
    bench.run(10);
    assert_eq!(bench.get(0x60FD), 0b100);
    assert_eq!(bench.device.poll_timeout(), None);

    repair(&mut bench, "stuck-switch:home".parse().unwrap());
    bench.run(10);
    assert_eq!((bench.get(0x60FD), bench.device.poll_timeout()), (0, None));
}

#[test]
fn a_device_tells_what_is_broken_until_it_is_repaired() {
    let mut bench = bench(&PlantSetup::default());
    let faults = |bench: &Bench| bench.device.plant_faults(0).map(|f| f.to_string()).collect::<Vec<_>>();
    for text in ["supply-dip:10", "supply-dip:12", "blocked-shaft", "stuck-switch:home=low"] {
        inject(&mut bench, text);
    }
    assert_eq!(faults(&bench), ["blocked-shaft", "supply-dip:12", "stuck-switch:home=low"]);
    repair(&mut bench, "supply-dip".parse().unwrap());
    assert_eq!(faults(&bench), ["blocked-shaft", "stuck-switch:home=low"]);
    repair(&mut bench, Repair::All);
    assert_eq!(faults(&bench), [""; 0]);
}

#[test]
fn what_has_no_axis_has_no_plant() {
    let mut bench = bench(&PlantSetup::default());
    let now = bench.now;
    assert_eq!(bench.device.inject(now, 1, fault("blocked-shaft")), Err(NoPlant));
    assert_eq!(bench.device.repair(now, 1, Repair::All), Err(NoPlant));
    assert_eq!(bench.device.plant_faults(1).count(), 0);
    let mut reference = Bench::new("canopen-reference");
    assert_eq!(reference.device.inject(now, 0, fault("blocked-shaft")), Err(NoPlant));
}

#[test]
fn a_machine_has_its_switches_and_stops_where_the_setup_says() {
    let range = |min, max| PositionRange::new(Position(min), Position(max));
    let mut bench = bench(&PlantSetup {
        start: Some(Position(-500.0)),
        positive_limit: Some(Position(9000.0)),
        home: range(-600.0, -400.0),
        stops: range(-20_000.0, 10_000.0),
        ..PlantSetup::default()
    });
    assert_eq!((bench.position(), bench.get(0x60FD)), (-500, 0b100));
    // Whatever the limit switch does to the motion, the load cannot leave the machine.
    bench.fast_profile();
    bench.enable(PROFILE_VELOCITY);
    bench.set(0x60FF, 20_000);
    bench.run_until(|b| b.position() > 0);
    assert_eq!(bench.get(0x60FD), 0);
    bench.run_until(|b| b.get(0x60FD) == 0b10);
    bench.run(2000);
    assert!((9000..=10_000).contains(&bench.position()), "{}", bench.position());
}

#[test]
fn a_scheduled_fault_comes_and_goes_by_itself() {
    let scheduled =
        ScheduledFault { fault: fault("supply-dip:10").0, from_seconds: 2.0, until_seconds: Some(30.0) };
    let mut bench = bench(&PlantSetup { faults: vec![scheduled], ..PlantSetup::default() });
    bench.run(1980);
    assert_eq!((bench.state(), bench.device.plant_faults(0).count()), (State::SwitchOnDisabled, 0));
    bench.run_until(|b| b.state() == State::Fault);
    assert_eq!(raised(&mut bench), [0x3220]);
    bench.run(30_000);
    assert_eq!(bench.device.plant_faults(0).count(), 0);
    bench.control(FAULT_RESET);
    bench.run(2);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    bench.run(10);
    assert!(bench.device.poll_timeout().is_none(), "nothing is to come any more");
}

#[test]
fn the_analogue_and_gear_modes_of_a_motor_follow_the_signals_of_its_plant() {
    const GEAR: i64 = 3;
    const ANALOGUE_VELOCITY: i64 = 5;
    let setup = PlantSetup {
        analog_input: Some(Voltage(5.0)),
        external_encoder: Some(Velocity(-4_000.0)),
        ..PlantSetup::default()
    };
    // GEARF1/GEARF2 are 4 from factory; half of V_SOLL, which is 1000 sixteenths of counts in 1.92 ms.
    for (mode, velocity) in [(GEAR, -16_000), (ANALOGUE_VELOCITY, 16_276)] {
        let profile = Arc::new(Profile::embedded("jvl-mac00-fc4", Some("mac140")).unwrap().unwrap());
        let device = Device::with_plant(profile, 1, Instant::ZERO, &setup);
        let mut bench = Bench { device, now: Instant::ZERO };
        bench.run(10);
        assert_eq!(bench.register(122), 512, "ANINP");
        bench.write(&[(5, 1_000), (2, mode)]);
        bench.run(2_000);
        assert!((bench.velocity() - velocity).abs() <= 50, "mode {mode}: {}", bench.velocity());
    }
}
