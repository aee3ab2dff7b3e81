//! The drive state machine of IEC 61800-7-201: every state, every command, every transition by its number.

mod bench;

use bench::Bench;
use profiles::{Command, DeviceEvent, State, Transition};

/// Rows: states; columns: DisableVoltage, QuickStop, Shutdown, SwitchOn, EnableOperation; the standard's numbers.
const TABLE: [(State, [Option<u8>; 5]); 8] = [
    (State::NotReadyToSwitchOn, [None, None, None, None, None]),
    (State::SwitchOnDisabled, [None, None, Some(2), None, None]),
    (State::ReadyToSwitchOn, [Some(7), Some(7), None, Some(3), Some(3)]),
    (State::SwitchedOn, [Some(10), Some(10), Some(6), None, Some(4)]),
    (State::OperationEnabled, [Some(9), Some(11), Some(8), Some(5), None]),
    (State::QuickStopActive, [Some(12), None, None, None, Some(16)]),
    (State::FaultReactionActive, [None, None, None, None, None]),
    (State::Fault, [None, None, None, None, None]),
];

const COMMANDS: [Command; 5] = [
    Command::DisableVoltage,
    Command::QuickStop,
    Command::Shutdown,
    Command::SwitchOn,
    Command::EnableOperation,
];

#[test]
fn every_command_in_every_state_triggers_the_standards_transition() {
    for (state, row) in TABLE {
        for (command, expected) in COMMANDS.into_iter().zip(row) {
            assert_eq!(state.on(command).map(|t| t as u8), expected, "{command:?} in {state:?}");
        }
    }
}

#[test]
fn every_transition_leads_where_the_standard_says() {
    use State::{
        Fault, FaultReactionActive, NotReadyToSwitchOn, OperationEnabled, QuickStopActive, ReadyToSwitchOn,
        SwitchOnDisabled, SwitchedOn,
    };
    let targets = [
        (Transition::Start, NotReadyToSwitchOn),
        (Transition::Initialised, SwitchOnDisabled),
        (Transition::Shutdown, ReadyToSwitchOn),
        (Transition::SwitchOn, SwitchedOn),
        (Transition::EnableOperation, OperationEnabled),
        (Transition::DisableOperation, SwitchedOn),
        (Transition::ShutdownSwitchedOn, ReadyToSwitchOn),
        (Transition::DisableVoltageReady, SwitchOnDisabled),
        (Transition::ShutdownEnabled, ReadyToSwitchOn),
        (Transition::DisableVoltageEnabled, SwitchOnDisabled),
        (Transition::DisableVoltageSwitchedOn, SwitchOnDisabled),
        (Transition::QuickStop, QuickStopActive),
        (Transition::QuickStopDone, SwitchOnDisabled),
        (Transition::FaultOccurred, FaultReactionActive),
        (Transition::FaultReacted, Fault),
        (Transition::FaultReset, SwitchOnDisabled),
        (Transition::Resume, OperationEnabled),
    ];
    for (number, (transition, target)) in targets.into_iter().enumerate() {
        assert_eq!(transition as usize, number);
        assert_eq!(transition.target(), target, "transition {number}");
    }
}

#[test]
fn a_drive_goes_up_and_down_one_state_at_a_time() {
    let mut bench = Bench::new("jvl-mac00-fc4");
    let mask = |bench: &Bench| bench.statusword() & 0x6F;
    assert_eq!(mask(&bench) & 0x4F, 0x40, "switch on disabled");
    bench.control(0x06);
    assert_eq!(mask(&bench), 0x21, "ready to switch on");
    bench.control(0x07);
    assert_eq!(mask(&bench), 0x23, "switched on");
    bench.control(0x0F);
    assert_eq!(mask(&bench), 0x23, "the power stage takes its time");
    bench.run(50);
    assert_eq!(mask(&bench), 0x27, "operation enabled");
    bench.control(0x07);
    bench.run(5);
    assert_eq!(mask(&bench), 0x23, "switched on again");
    bench.control(0x06);
    assert_eq!(mask(&bench), 0x21);
    bench.control(0x00);
    assert_eq!(mask(&bench) & 0x4F, 0x40);
}

#[test]
fn enable_operation_from_ready_passes_through_switched_on() {
    let mut bench = Bench::new("cia402-servo");
    bench.control(0x06);
    bench.control(0x0F);
    assert_eq!(bench.state(), State::SwitchedOn);
    bench.run(50);
    assert_eq!(bench.state(), State::OperationEnabled);
}

#[test]
fn a_command_taken_back_while_the_power_comes_on_is_taken_back() {
    let mut bench = Bench::new("cia402-servo");
    bench.control(0x06);
    bench.control(0x0F);
    bench.control(0x07);
    bench.run(100);
    assert_eq!(bench.state(), State::SwitchedOn);
    assert!(bench.device.is_quiet());
}

#[test]
fn a_following_error_is_a_fault_that_only_a_rising_edge_resets() {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.set(0x6065, 50);
    bench.set(0x6072, 0);
    bench.enable(1);
    bench.move_to(10_000, 0);
    bench.run_until(|b| b.state() == State::Fault);
    assert_eq!(bench.statusword() & 0x4F, 0x08);
    assert_eq!(bench.get(0x603F), 0x8611);
    let events = bench.events();
    assert!(matches!(events.as_slice(), [DeviceEvent::Raised(fault)] if fault.code == 0x8611), "{events:?}");
    for word in [0x06, 0x0F, 0x00] {
        bench.control(word);
        assert_eq!(bench.state(), State::Fault);
    }
    bench.control(0x80);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    assert_eq!(bench.get(0x603F), 0);
    assert_eq!(bench.events(), [DeviceEvent::Cleared(0x8611)]);
}

#[test]
fn reset_node_switches_off_and_restores_the_defaults() {
    let mut bench = Bench::new("jvl-mac00-fc4");
    bench.fast_profile();
    bench.enable(1);
    let now = bench.now;
    bench.device.reset(now);
    bench.run(20);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    assert_eq!(bench.get(0x6081), 100);
    assert!(bench.device.is_quiet());
}

#[test]
fn a_drive_at_rest_asks_for_no_time_at_all() {
    let mut bench = Bench::new("jvl-mac00-fc4");
    assert_eq!(bench.device.poll_timeout(), None);
    bench.enable(1);
    assert!(bench.device.poll_timeout().is_some());
    bench.control(0x00);
    bench.run(2_000);
    assert_eq!(bench.device.poll_timeout(), None);
}
