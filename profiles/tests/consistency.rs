//! Whatever is commanded and whatever breaks, in whatever order: state, statusword and power agree, and a fault ends
//! at rest.

mod bench;

use axis::{DriveFault, Input, PlantFault, Voltage};
use bench::Bench;
use profiles::{DeviceEvent, State, Statusword};
use proptest::prelude::*;

#[derive(Clone, Debug)]
enum Event {
    Control(i64),
    Write(u16, i64),
    Break(PlantFault),
    Repair(PlantFault),
    LoseConnection,
    Wait(u64),
}

fn fault() -> impl Strategy<Value = PlantFault> {
    prop::sample::select(vec![
        PlantFault::EncoderBreak,
        PlantFault::BlockedShaft,
        PlantFault::DriveFault(DriveFault::OverCurrent),
        PlantFault::SupplyDip(Voltage(5.0)),
        PlantFault::StuckSwitch(Input::EmergencyStop, true),
        PlantFault::StuckSwitch(Input::PositiveLimit, true),
        PlantFault::StuckSwitch(Input::NegativeLimit, true),
    ])
}

fn event() -> impl Strategy<Value = Event> {
    let word = prop_oneof![
        4 => prop::sample::select(vec![0x06_i64, 0x07, 0x0F, 0x1F, 0x3F, 0x10F, 0x02, 0x00, 0x80]),
        1 => 0_i64..0x1_0000,
    ];
    let write = prop_oneof![
        (-1_i64..9).prop_map(|option| Event::Write(0x605A, option)),
        (0_i64..2).prop_map(|option| Event::Write(0x605B, option)),
        (0_i64..2).prop_map(|option| Event::Write(0x605C, option)),
        (1_i64..5).prop_map(|option| Event::Write(0x605D, option)),
        (0_i64..5).prop_map(|option| Event::Write(0x605E, option)),
        (0_i64..4).prop_map(|option| Event::Write(0x6007, option)),
        prop::sample::select(vec![0_i64, 1, 3, 4, 6, 8, 9, 10]).prop_map(|mode| Event::Write(0x6060, mode)),
        (-100_000_i64..100_000).prop_map(|target| Event::Write(0x60FF, target)),
        (-100_000_i64..100_000).prop_map(|target| Event::Write(0x607A, target)),
        (0_i64..3_000).prop_map(|torque| Event::Write(0x6072, torque)),
    ];
    prop_oneof![
        6 => word.prop_map(Event::Control),
        4 => write,
        1 => fault().prop_map(Event::Break),
        2 => fault().prop_map(Event::Repair),
        1 => Just(Event::LoseConnection),
        5 => (0_u64..60).prop_map(Event::Wait),
    ]
}

/// What holds at any time.
fn check(bench: &Bench) -> Result<(), TestCaseError> {
    let (state, word) = (bench.state(), bench.statusword());
    prop_assert_eq!(word & 0x6F, i64::from(Statusword::of(state).bits()), "{:?}", state);
    let may_have_torque = match state {
        State::NotReadyToSwitchOn
        | State::SwitchOnDisabled
        | State::ReadyToSwitchOn
        | State::SwitchedOn
        | State::Fault => false,
        State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive => true,
    };
    prop_assert!(may_have_torque || word >> 10 & 1 == 0, "target reached in {:?}", state);
    let is_faulty = matches!(state, State::Fault | State::FaultReactionActive);
    prop_assert_eq!(bench.get(0x603F) != 0, is_faulty, "0x603F in {:?}", state);
    Ok(())
}

/// The power stage is off; a state that has just been left may have had torque in its last step.
fn check_torque(bench: &Bench, before: State) -> Result<(), TestCaseError> {
    let is_off = |state: State| {
        matches!(state, State::SwitchOnDisabled | State::ReadyToSwitchOn | State::SwitchedOn | State::Fault)
    };
    let torque = bench.get(0x6077);
    let is_bare = is_off(before) && is_off(bench.state());
    // In SWITCHED ON the power may just be coming on.
    let is_coming = bench.get(0x6040) & 0xF == 0xF;
    prop_assert!(!is_bare || is_coming || torque == 0, "{torque} in {:?}", bench.state());
    Ok(())
}

fn apply(bench: &mut Bench, event: &Event) -> Result<(), TestCaseError> {
    match event {
        Event::Control(word) => bench.control(*word),
        // What the gate refuses changes nothing.
        Event::Write(index, value) => drop(bench.batch(&[(*index, 0, *value)])),
        Event::Break(fault) => bench.plant().inject(*fault),
        Event::Repair(fault) => bench.plant().clear(*fault),
        Event::LoseConnection => {
            let now = bench.now;
            bench.device.connection_lost(now);
        }
        Event::Wait(millis) => {
            for _ in 0..*millis {
                let before = bench.state();
                bench.run(1);
                check(bench)?;
                check_torque(bench, before)?;
            }
        }
    }
    check(bench)
}

fn bench() -> Bench {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.set(0x60FF, 20_000);
    bench.enable(3);
    bench
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn state_statusword_and_power_always_agree(events in prop::collection::vec(event(), 1..80)) {
        let mut bench = bench();
        let mut standing = None;
        for event in &events {
            apply(&mut bench, event)?;
            for told in bench.events() {
                standing = match told {
                    DeviceEvent::Raised(fault) => {
                        prop_assert_eq!(standing, None, "a fault is told once");
                        Some(fault.code)
                    }
                    DeviceEvent::Cleared(code) => {
                        prop_assert_eq!(standing, Some(code), "what is cleared has stood");
                        None
                    }
                    DeviceEvent::Store(_) => standing,
                };
            }
        }
    }

    #[test]
    fn after_a_fault_the_axis_comes_to_rest_and_stays_in_fault(
        events in prop::collection::vec(event(), 1..40), cause in fault(), option in 0_i64..5,
    ) {
        let mut bench = bench();
        for event in &events {
            apply(&mut bench, event)?;
        }
        bench.batch(&[(0x605E, 0, option), (0x6040, 0, 0x00)]).unwrap();
        bench.plant().inject(cause);
        bench.plant().inject(PlantFault::DriveFault(DriveFault::Internal));
        bench.run(2);
        prop_assert_eq!(bench.state(), State::Fault);
        for _ in 0..5_000 {
            if bench.device.is_quiet() {
                break;
            }
            bench.control(0x0F);
            bench.run(1);
            prop_assert_eq!(bench.state(), State::Fault);
            prop_assert_eq!(bench.get(0x6077), 0);
        }
        prop_assert!(bench.device.is_quiet());
    }

    #[test]
    fn a_fault_that_ramps_down_ends_in_time(option in 0_i64..5, speed in -100_000_i64..100_000, mode in 0_usize..2) {
        let mut bench = bench();
        bench.batch(&[(0x60FF, 0, speed), (0x607A, 0, speed), (0x605E, 0, option), (0x6007, 0, 1)]).unwrap();
        bench.set(0x6060, [1, 3][mode]);
        bench.run(1_000);
        let now = bench.now;
        bench.device.connection_lost(now);
        // The slowest ramp is 100,000 counts/s^2, from 100,000 counts/s at most.
        bench.run(1_010);
        prop_assert_eq!(bench.state(), State::Fault);
        bench.run(4_000);
        prop_assert!(bench.device.is_quiet());
    }
}
