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

/// The state a drive settles in when the low bits of the controlword are written in `state`: the standard's words,
/// not its numbers. Written by hand, without regard to the code.
fn settled(state: State, word: i64) -> State {
    use State::{
        Fault, FaultReactionActive, NotReadyToSwitchOn, OperationEnabled, QuickStopActive, ReadyToSwitchOn,
        SwitchOnDisabled, SwitchedOn,
    };
    let [switch_on, voltage, no_quick_stop, operate] = [0, 1, 2, 3].map(|bit| word >> bit & 1 == 1);
    match state {
        // It comes up by itself, whatever is written.
        NotReadyToSwitchOn => SwitchOnDisabled,
        // Its reaction ends by itself.
        FaultReactionActive => Fault,
        Fault if word & 0x80 != 0 => SwitchOnDisabled,
        Fault => Fault,
        SwitchOnDisabled if voltage && no_quick_stop && !switch_on => ReadyToSwitchOn,
        SwitchOnDisabled => SwitchOnDisabled,
        ReadyToSwitchOn | SwitchedOn | OperationEnabled | QuickStopActive if !voltage => SwitchOnDisabled,
        ReadyToSwitchOn | SwitchedOn if !no_quick_stop => SwitchOnDisabled,
        OperationEnabled if !no_quick_stop => QuickStopActive,
        ReadyToSwitchOn | SwitchedOn | OperationEnabled if !switch_on => ReadyToSwitchOn,
        ReadyToSwitchOn | SwitchedOn | OperationEnabled if !operate => SwitchedOn,
        ReadyToSwitchOn | SwitchedOn | OperationEnabled => OperationEnabled,
        QuickStopActive if no_quick_stop && switch_on && operate => OperationEnabled,
        QuickStopActive => QuickStopActive,
    }
}

/// A drive in `state`, its controlword free of the fault reset bit.
fn in_state(state: State) -> Bench {
    let mut bench = Bench::powered_on("cia402-servo");
    if state == State::NotReadyToSwitchOn {
        return bench;
    }
    bench.run(10);
    bench.fast_profile();
    bench.set(0x605A, 6);
    bench.set(0x605E, 1);
    bench.set(0x6060, 3);
    bench.set(0x60FF, 20_000);
    let words: &[i64] = match state {
        State::NotReadyToSwitchOn | State::SwitchOnDisabled => &[0x00],
        State::ReadyToSwitchOn => &[0x06],
        State::SwitchedOn => &[0x06, 0x07],
        State::OperationEnabled | State::FaultReactionActive | State::Fault => &[0x06, 0x07, 0x0F],
        State::QuickStopActive => &[0x06, 0x07, 0x0F, 0x02],
    };
    for word in words {
        bench.control(*word);
        bench.run(400);
    }
    if matches!(state, State::FaultReactionActive | State::Fault) {
        bench.set(0x6007, 1);
        let now = bench.now;
        bench.device.connection_lost(now);
    }
    if state == State::Fault {
        bench.run(400);
    }
    assert_eq!(bench.state(), state);
    bench
}

const STATES: [State; 8] = [
    State::NotReadyToSwitchOn,
    State::SwitchOnDisabled,
    State::ReadyToSwitchOn,
    State::SwitchedOn,
    State::OperationEnabled,
    State::QuickStopActive,
    State::FaultReactionActive,
    State::Fault,
];

#[test]
fn every_controlword_in_every_state_ends_where_the_standard_says() {
    for state in STATES {
        for low in 0..32 {
            let word = low & 0xF | (low & 0x10) << 3;
            let mut bench = in_state(state);
            bench.control(word);
            bench.run(1_000);
            assert_eq!(bench.state(), settled(state, word), "{word:02X} in {state:?}");
        }
    }
}

#[test]
fn the_other_bits_of_the_controlword_command_nothing() {
    for state in STATES {
        for word in [0x00, 0x02, 0x06, 0x07, 0x0F] {
            let mut bench = in_state(state);
            bench.control(word | 0xFE70);
            bench.run(1_000);
            assert_eq!(bench.state(), settled(state, word), "{word:02X} in {state:?}");
        }
    }
}

#[test]
fn a_command_that_is_repeated_changes_nothing() {
    for state in STATES {
        let mut bench = in_state(state);
        let word = bench.get(0x6040);
        for _ in 0..50 {
            bench.control(word);
            bench.run(1);
        }
        let expected = match state {
            State::NotReadyToSwitchOn => State::SwitchOnDisabled,
            other => other,
        };
        assert_eq!(bench.state(), expected, "{state:?}");
    }
}

#[test]
fn the_statusword_tells_the_state_and_the_bits_that_belong_to_it() {
    // Bits 0-3, 5 and 6 by the standard's table; where bit 5 may be anything it is left out.
    let table: [(State, i64, i64); 8] = [
        (State::NotReadyToSwitchOn, 0x4F, 0x00),
        (State::SwitchOnDisabled, 0x4F, 0x40),
        (State::ReadyToSwitchOn, 0x6F, 0x21),
        (State::SwitchedOn, 0x6F, 0x23),
        (State::OperationEnabled, 0x6F, 0x27),
        (State::QuickStopActive, 0x6F, 0x07),
        (State::FaultReactionActive, 0x4F, 0x0F),
        (State::Fault, 0x4F, 0x08),
    ];
    for (state, mask, bits) in table {
        let bench = in_state(state);
        assert_eq!(bench.statusword() & mask, bits, "{state:?}");
        assert!(bench.is_set(9), "remote in {state:?}");
        assert_eq!(bench.is_set(4), state != State::NotReadyToSwitchOn, "voltage in {state:?}");
        let moves_at_its_target = state == State::OperationEnabled;
        assert_eq!(bench.is_set(10), moves_at_its_target || state == State::QuickStopActive, "{state:?}");
        assert!(!bench.is_set(7) && !bench.is_set(11), "{state:?}");
    }
}

#[test]
fn a_quick_stop_has_reached_its_target_when_the_axis_stands() {
    let mut bench = in_state(State::OperationEnabled);
    bench.control(0x02);
    bench.run(50);
    assert_eq!(bench.state(), State::QuickStopActive);
    assert!(!bench.is_set(10) && bench.velocity() > 5_000);
    bench.run(100);
    assert!(bench.is_set(10) && bench.velocity() == 0);
}

#[test]
fn leaving_a_quick_stop_while_it_brakes_goes_on_with_the_mode() {
    let mut bench = in_state(State::OperationEnabled);
    bench.control(0x02);
    bench.run(50);
    bench.control(0x0F);
    assert_eq!(bench.state(), State::OperationEnabled);
    bench.run_until(|b| b.is_set(10));
    assert!((bench.velocity() - 20_000).abs() < 500);
}

#[test]
fn disable_voltage_during_a_quick_stop_cuts_the_power() {
    let mut bench = in_state(State::OperationEnabled);
    bench.control(0x02);
    bench.run(20);
    bench.control(0x00);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    let before = bench.velocity();
    bench.run(20);
    assert!(before - bench.velocity() < 20 * 140, "it coasts");
}

#[test]
fn the_fault_reset_bit_works_by_its_edge_alone() {
    let mut bench = in_state(State::OperationEnabled);
    bench.control(0x8F);
    bench.set(0x6007, 1);
    let now = bench.now;
    bench.device.connection_lost(now);
    bench.run_until(|b| b.state() == State::Fault);
    bench.control(0x80);
    bench.run(10);
    assert_eq!(bench.state(), State::Fault, "the bit was set before");
    bench.control(0x00);
    bench.control(0x80);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
}

#[test]
fn a_fault_reset_during_the_reaction_is_lost() {
    let mut bench = in_state(State::FaultReactionActive);
    bench.control(0x80);
    bench.run(1_000);
    assert_eq!(bench.state(), State::Fault);
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
