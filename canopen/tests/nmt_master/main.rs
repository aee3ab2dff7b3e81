//! The NMT master (CiA 302-2) on one bus with our own nodes, on virtual time.

#[path = "../bench/mod.rs"]
mod bench;
mod network;

use core::time::Duration;

use bench::frame_of;
use canopen::{BootStatus, Frame, Loss, Master, MasterEvent, NmtState, SdoError};
use network::{Network, dcf, parameters};
use od::{AbortCode, Address, Instant};
use proptest::collection::vec;
use proptest::prelude::*;

/// 0x1F81: a slave that is booted.
const SLAVE: u32 = 0x05;
const MANDATORY: u32 = 0x08;
const KEPT_ALIVE: u32 = 0x10;

const fn booted(node_id: u8) -> MasterEvent {
    MasterEvent::Booted { node_id, was_operational: false }
}

const fn failed(node_id: u8, status: BootStatus) -> MasterEvent {
    MasterEvent::BootFailed { node_id, status, transfer: None }
}

const STARTED: MasterEvent = MasterEvent::Started { enters_operational: true };

#[test]
fn a_network_of_three_is_booted_configured_and_started() {
    // Node 1 has to be and is to be configured, node 2 is another product, node 3 is not there.
    let values = [
        (0x1F80, 0, 0x01),
        (0x1F81, 1, SLAVE | MANDATORY),
        (0x1F81, 2, SLAVE),
        (0x1F81, 3, SLAVE),
        (0x1F84, 1, 0x0002_0192),
        (0x1F85, 1, 0x04D2),
        (0x1F86, 1, 0x0402),
        (0x1F87, 1, 0x0001_0002),
        (0x1F88, 1, 0x2A),
        (0x1F86, 2, 0x0403),
        (0x1016, 1, 0x0001_00FA), // node 1 within 250 ms
    ];
    let configuration =
        dcf(&[(0x1017, 0, &[100, 0]), (0x2107, 0, &[0x34, 0x12]), (0x200F, 0, b"a longer value")]);
    let mut network = Network::started(&parameters(&values, &[(1, configuration)]), &[1, 2]);
    network.pass(3000);
    let error = SdoError::Client(AbortCode::TimedOut);
    let missing = MasterEvent::BootFailed {
        node_id: 3,
        status: BootStatus::NoResponse,
        transfer: Some((Address::new(0x1000, 0), error)),
    };
    assert_eq!(network.events(), [failed(2, BootStatus::ProductCode), booted(1), STARTED, missing]);
    assert_eq!(network.state(1), NmtState::Operational);
    assert_eq!(network.state(2), NmtState::PreOperational);
    assert_eq!(network.node(1).value("2107:00"), 0x1234);
    assert_eq!(network.node(2).value("2107:00"), 0);
    let states: Vec<u8> = (1..=4).map(|node_id| network.master.state(node_id).unwrap()).collect();
    assert_eq!(states, [0x05, 0x7F, 0x01, 0x00], "operational, pre-operational, missing, unknown");
    let log = network.sent();
    let of_node_1 = ["000#", "581#", "601#", "701#"];
    let log: Vec<&str> = log
        .iter()
        .filter(|f| of_node_1.iter().any(|id| f.starts_with(id)))
        .map(String::as_str)
        .take(31)
        .collect();
    let expected = [
        "000#8200", // reset communication, all nodes
        "701#00",
        "601#4000100000000000", // device type
        "581#4300100092010200",
        "601#4018100100000000", // Vendor-ID
        "581#43181001D2040000",
        "601#4018100200000000", // product code
        "581#4318100202040000",
        "601#4018100300000000", // revision number
        "581#4318100302000100",
        "601#4018100400000000", // serial number
        "581#431810042A000000",
        "601#2B17100064000000", // the DCF: heartbeat each 100 ms
        "581#6017100000000000",
        "601#2B07210034120000", // an object of the device
        "581#6007210000000000",
        "601#210F20000E000000", // and one in segments
        "581#600F200000000000",
        "601#0061206C6F6E6765",
        "581#2000000000000000",
        "601#11722076616C7565",
        "581#3000000000000000",
        "701#7F",   // the first heartbeat
        "000#0101", // start
        "701#05",
    ];
    assert_eq!(log[..expected.len()], expected);
}

#[test]
fn each_difference_in_the_identity_has_its_letter() {
    let cases = [
        (0x1F84, BootStatus::DeviceType, 'C'),
        (0x1F85, BootStatus::VendorId, 'D'),
        (0x1F86, BootStatus::ProductCode, 'M'),
        (0x1F87, BootStatus::RevisionNumber, 'N'),
        (0x1F88, BootStatus::SerialNumber, 'O'),
    ];
    for (index, status, letter) in cases {
        let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE | MANDATORY), (index, 1, 0x7777)];
        let mut network = Network::started(&parameters(&values, &[]), &[1]);
        assert_eq!(network.events(), [failed(1, status), MasterEvent::Halted]);
        assert_eq!(status.letter(), letter);
        assert_eq!(network.state(1), NmtState::PreOperational);
    }
}

#[test]
fn a_mandatory_slave_is_waited_for_until_the_boot_time_is_over() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE), (0x1F81, 2, SLAVE | MANDATORY), (0x1F89, 0, 10_000)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    assert_eq!(network.events(), [booted(1)]);
    network.pass(9_999);
    assert_eq!(network.events(), []);
    assert_eq!(network.master.state(2), Ok(1), "missing");
    network.pass(1);
    assert_eq!(network.events(), [failed(2, BootStatus::NoResponse), MasterEvent::Halted]);
    network.power_on(2);
    network.pass(5_000);
    assert_eq!(network.events(), []);
    assert_eq!(network.master.poll_timeout(), None);
}

#[test]
fn a_mandatory_slave_that_comes_in_time_completes_the_network() {
    let values = [(0x1F80, 0, 1), (0x1F81, 2, SLAVE | MANDATORY), (0x1F89, 0, 10_000)];
    let mut network = Network::started(&parameters(&values, &[]), &[]);
    network.pass(9_000);
    network.power_on(2);
    assert_eq!(network.events(), [booted(2), STARTED]);
    assert_eq!(network.state(2), NmtState::Operational);
    network.pass(10_000);
    assert_eq!(network.events(), []);
}

#[test]
fn an_optional_slave_is_booted_whenever_it_comes() {
    let values = [(0x1F80, 0, 1), (0x1F81, 2, SLAVE)];
    let mut network = Network::started(&parameters(&values, &[]), &[]);
    assert_eq!(network.events(), [STARTED], "nobody is mandatory");
    network.pass(5_000);
    assert_eq!(network.events().len(), 1, "no response");
    network.power_on(2);
    assert_eq!(network.events(), [booted(2)]);
    assert_eq!(network.state(2), NmtState::Operational);
}

#[test]
fn the_bits_of_0x1f80_say_who_is_started_by_whom() {
    // (0x1F80, what is sent after the boots, whether the master enters OPERATIONAL)
    let cases: [(u32, &[&str], bool); 5] = [
        (0b0001, &["000#0101", "000#0102"], true),
        (0b0011, &["000#0100"], true),
        (0b0101, &["000#0101", "000#0102"], false),
        (0b1001, &[], true),
        (0b1011, &[], true),
    ];
    for (startup, commands, enters_operational) in cases {
        let values = [(0x1F80, 0, startup), (0x1F81, 1, SLAVE | MANDATORY), (0x1F81, 2, SLAVE | MANDATORY)];
        let mut network = Network::started(&parameters(&values, &[]), &[1, 2]);
        let sent: Vec<String> = network.sent().into_iter().filter(|f| f.starts_with("000#01")).collect();
        assert_eq!(sent, commands, "{startup:04b}");
        assert_eq!(network.events(), [booted(1), booted(2), MasterEvent::Started { enters_operational }]);
    }
}

#[test]
fn a_device_that_is_no_master_does_nothing() {
    let values = [(0x1F80, 0, 0x0C), (0x1F81, 1, SLAVE)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    network.power_on(1);
    assert_eq!(network.sent(), ["701#00"]);
    assert_eq!(network.events(), []);
    assert_eq!(network.master.request(Instant::ZERO, 1, 5), Err(AbortCode::DeviceState));
}

#[test]
fn a_slave_that_is_not_to_be_booted_waits_for_the_application() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, 0x01)];
    let mut network = Network::started(&parameters(&values, &[]), &[1, 2]);
    assert_eq!(network.sent(), ["000#8200", "701#00", "702#00"]);
    network.master.boot(network.now, 1);
    network.master.boot(network.now, 2);
    network.settle(Vec::new());
    assert_eq!(network.events(), [STARTED, failed(2, BootStatus::NotListed), booted(1)]);
}

#[test]
fn a_slave_that_is_operational_and_kept_alive_is_left_so() {
    let guarded = 0x0064_0300; // each 100 ms, three times
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE | KEPT_ALIVE | guarded), (0x1F81, 2, SLAVE)];
    let mut network = Network::new(&parameters(&values, &[(1, dcf(&[(0x2107, 0, &[1, 0])]))]), &[1, 2]);
    network.settle(vec![(99, frame_of("000#0101"))]);
    network.sent();
    network.master.start(network.now);
    network.settle(Vec::new());
    assert_eq!(network.sent()[..3], ["000#8202", "601#4000100000000000", "702#00"], "only node 2 is reset");
    network.pass(1);
    let kept = MasterEvent::Booted { node_id: 1, was_operational: true };
    let events = network.events();
    assert!(events.contains(&kept) && events.contains(&booted(2)), "{events:?}");
    assert_eq!(network.node(1).value("2107:00"), 0, "it is not configured");
    assert!(!network.sent().contains(&"000#0101".into()), "it is not started");
    assert_eq!(network.state(1), NmtState::Operational);
}

#[test]
fn a_slave_that_is_kept_alive_but_not_operational_is_reset_and_booted() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE | KEPT_ALIVE | 0x0064_0300)];
    let mut network = Network::started(&parameters(&values, &[(1, dcf(&[(0x2107, 0, &[1, 0])]))]), &[1]);
    network.pass(1);
    assert!(network.sent().contains(&"000#8201".into()));
    assert_eq!(network.events(), [STARTED, booted(1)]);
    assert_eq!(network.node(1).value("2107:00"), 1);
    // Now it is OPERATIONAL, and a boot by the application leaves it so.
    network.master.boot(network.now, 1);
    network.settle(Vec::new());
    network.pass(1);
    assert_eq!(network.events(), [MasterEvent::Booted { node_id: 1, was_operational: true }]);
}

#[test]
fn a_kept_slave_that_does_not_tell_its_state_is_an_error() {
    // Neither a heartbeat nor an answer to guarding, as node 1 has no heartbeat to start with.
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE | KEPT_ALIVE), (0x1016, 1, 0x0001_0064)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    network.pass(100);
    assert_eq!(network.events(), [STARTED, failed(1, BootStatus::Heartbeat)]);
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE | KEPT_ALIVE | 0x0064_0300)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    network.node(1).configure("1017:00", 60_000); // a heartbeat, so no guarding
    network.pass(300);
    assert_eq!(network.events(), [STARTED, failed(1, BootStatus::Guarding)]);
}

#[test]
fn a_heartbeat_that_does_not_come_ends_the_boot() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE), (0x1016, 1, 0x0001_0064)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    network.pass(99);
    assert_eq!(network.events(), [STARTED]);
    network.pass(1);
    assert_eq!(network.events(), [failed(1, BootStatus::HeartbeatStart)]);
    assert_eq!(network.state(1), NmtState::PreOperational);
}

#[test]
fn a_configuration_that_is_refused_or_broken_ends_the_boot() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE)];
    let mut network =
        Network::started(&parameters(&values, &[(1, dcf(&[(0x2100, 0, &[1, 0, 0, 0])]))]), &[1]);
    let refused = MasterEvent::BootFailed {
        node_id: 1,
        status: BootStatus::Configuration,
        transfer: Some((Address::new(0x2100, 0), SdoError::Server(AbortCode::ReadOnly.code()))),
    };
    assert_eq!(network.events(), [STARTED, refused]);
    let mut network = Network::started(&parameters(&values, &[(1, vec![1, 0, 0, 0, 0])]), &[1]);
    assert_eq!(network.events(), [STARTED, failed(1, BootStatus::Configuration)]);
}

#[test]
fn a_slave_with_the_expected_configuration_is_not_configured_again() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE), (0x1F26, 1, 14_000), (0x1F27, 1, 77)];
    let configuration = dcf(&[
        (0x2107, 0, &[1, 0]),
        (0x1020, 1, &14_000_u32.to_le_bytes()),
        (0x1020, 2, &77_u32.to_le_bytes()),
    ]);
    let mut network = Network::started(&parameters(&values, &[(1, configuration)]), &[1]);
    assert_eq!(network.events(), [STARTED, booted(1)]);
    let writes = |network: &mut Network| network.sent().iter().filter(|f| f.starts_with("601#2")).count();
    assert_eq!(writes(&mut network), 3);
    // The application boots it again: now it has what it should have.
    network.master.boot(network.now, 1);
    network.settle(Vec::new());
    assert_eq!(network.events(), [booted(1)]);
    assert_eq!(writes(&mut network), 0);
    // Only the time differs.
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE), (0x1F26, 1, 0), (0x1F27, 1, 78)];
    let mut network = Network::started(&parameters(&values, &[(1, dcf(&[(0x2107, 0, &[1, 0])]))]), &[1]);
    assert_eq!(network.events(), [STARTED, booted(1)]);
    assert_eq!(writes(&mut network), 1);
    // With another date and no DCF there is nothing to do it with.
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE), (0x1F26, 1, 14_001)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    assert_eq!(network.events(), [STARTED, failed(1, BootStatus::Configuration)]);
}

#[test]
fn defaults_are_restored_before_a_configuration_where_that_is_asked_for() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE | 0x80), (0x1F8A, 1, 1)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    let refused = MasterEvent::BootFailed {
        node_id: 1,
        status: BootStatus::Configuration,
        transfer: Some((Address::new(0x1011, 1), SdoError::Server(AbortCode::NoObject.code()))),
    };
    // This node has nothing to restore, so the request shows.
    assert!(network.sent().contains(&"601#231110016C6F6164".into()));
    assert_eq!(network.events(), [STARTED, refused]);
    // One that has is reset and booted anew, once.
    let values = [(0x1F80, 0, 1), (0x1F81, 5, SLAVE | 0x80), (0x1F8A, 5, 1)];
    let mut network = Network::started(&parameters(&values, &[(5, dcf(&[(0x2107, 0, &[1, 0])]))]), &[]);
    let answers =
        ["705#00", "585#4300100000000000", "585#6011100100000000", "705#00", "585#4300100000000000"];
    network.settle(answers.map(|frame| (5, frame_of(frame))).to_vec());
    let sent = network.sent();
    let sent: Vec<&str> =
        sent.iter().map(String::as_str).filter(|f| f.starts_with("605") || f.starts_with("000")).collect();
    let expected = [
        "000#8200",
        "605#4000100000000000",
        "605#231110016C6F6164",
        "000#8105",
        "605#4000100000000000",
        "605#2B07210001000000",
    ];
    assert_eq!(sent, expected);
}

#[test]
fn a_program_that_is_to_be_verified_is_not() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE | 0x20)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    assert_eq!(network.events(), [STARTED, failed(1, BootStatus::ProgramNotConfigured)]);
}

#[test]
fn a_slave_whose_heartbeat_stops_is_lost_reset_and_booted_when_it_is_back() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE), (0x1016, 1, 0x0001_00FA)];
    let configuration = dcf(&[(0x1017, 0, &[100, 0])]);
    let mut network = Network::started(&parameters(&values, &[(1, configuration)]), &[1]);
    network.pass(1000);
    assert_eq!(network.events(), [STARTED, booted(1)]);
    network.power_off(1);
    network.sent();
    network.pass(260);
    assert_eq!(network.events(), [MasterEvent::Lost { node_id: 1, loss: Loss::Heartbeat }]);
    assert_eq!(network.sent(), ["000#8201"]);
    network.pass(5000);
    assert!(matches!(network.events()[..], [MasterEvent::BootFailed { status: BootStatus::NoResponse, .. }]));
    network.power_on(1);
    network.pass(1000);
    assert_eq!(network.events(), [booted(1)]);
    assert_eq!(network.master.state(1), Ok(5));
}

#[test]
fn a_slave_that_does_not_answer_to_guarding_is_lost() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE | 0x0064_0300)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    network.sent();
    network.pass(250);
    assert_eq!(network.sent(), ["701#R1", "701#05", "701#R1", "701#85", "701#R1", "701#05"]);
    assert_eq!(network.events(), [STARTED, booted(1)]);
    network.power_off(1);
    network.pass(349);
    assert_eq!(network.events(), []);
    network.pass(1);
    assert_eq!(network.events(), [MasterEvent::Lost { node_id: 1, loss: Loss::Guarding }]);
}

#[test]
fn a_retry_factor_of_zero_tolerates_no_missing_answer() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE | 0x0064_0000)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    network.pass(950);
    assert_eq!(network.events(), [STARTED, booted(1)]);
    network.power_off(1);
    network.pass(150);
    assert_eq!(network.events(), [MasterEvent::Lost { node_id: 1, loss: Loss::Guarding }]);
}

#[test]
fn a_guarded_slave_that_stops_all_is_lost_once() {
    let values = [(0x1F80, 0, 0x41), (0x1F81, 1, SLAVE | MANDATORY | 0x0064_0200)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    network.power_off(1);
    network.pass(10_000);
    let lost = MasterEvent::Lost { node_id: 1, loss: Loss::Guarding };
    assert_eq!(network.events(), [booted(1), STARTED, lost, MasterEvent::Halted]);
    assert_eq!(network.master.poll_timeout(), None);
}

#[test]
fn a_slave_that_never_booted_cannot_be_lost() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE), (0x1F86, 1, 7), (0x1016, 1, 0x0001_00FA)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    network.node(1).configure("1017:00", 100);
    network.pass(1000);
    network.power_off(1);
    network.pass(1000);
    assert_eq!(network.events(), [STARTED, failed(1, BootStatus::ProductCode)]);
}

#[test]
fn an_optional_slave_whose_boot_up_message_was_lost_is_booted_when_it_is_heard() {
    let values = [(0x1F80, 0, 1), (0x1F81, 2, SLAVE)];
    let mut network = Network::started(&parameters(&values, &[]), &[]);
    network.pass(5_000);
    network.sent();
    network.settle(vec![(2, frame_of("702#7F"))]);
    assert_eq!(network.sent(), ["702#7F", "602#4000100000000000"]);
    assert_eq!(network.master.state(2), Ok(0x7F));
}

#[test]
fn a_slave_that_boots_without_being_told_is_booted_again() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE)];
    let mut network = Network::started(&parameters(&values, &[]), &[1]);
    network.power_on(1);
    let lost = MasterEvent::Lost { node_id: 1, loss: Loss::BootUp };
    assert_eq!(network.events(), [STARTED, booted(1), lost, booted(1)]);
    assert_eq!(network.state(1), NmtState::Operational);
}

#[test]
fn a_mandatory_slave_that_is_lost_takes_all_with_it_where_0x1f80_says_so() {
    // (0x1F80, what is sent, whether the network is halted)
    let lost = MasterEvent::Lost { node_id: 1, loss: Loss::BootUp };
    for (startup, command, state) in [
        (0x41, "000#0200", NmtState::Stopped),
        (0x51, "000#0200", NmtState::Stopped),
        (0x11, "000#8100", NmtState::Operational),
    ] {
        let values = [(0x1F80, 0, startup), (0x1F81, 1, SLAVE | MANDATORY), (0x1F81, 2, SLAVE)];
        let mut network = Network::started(&parameters(&values, &[]), &[1, 2]);
        network.events();
        network.sent();
        network.power_on(1);
        assert_eq!(network.sent()[1], command, "{startup:02X}");
        let events = network.events();
        assert_eq!(events[0], lost);
        assert_eq!(events.contains(&MasterEvent::Halted), state == NmtState::Stopped);
        assert_eq!(events.contains(&STARTED), state == NmtState::Operational, "booted anew");
        assert_eq!([network.state(1), network.state(2)], [state; 2]);
    }
}

#[test]
fn the_request_nmt_object_commands_and_shows_states() {
    let values = [(0x1F80, 0, 1), (0x1F81, 1, SLAVE), (0x1016, 1, 0x0001_00FA)];
    let configuration = dcf(&[(0x1017, 0, &[100, 0])]);
    let mut network = Network::started(&parameters(&values, &[(1, configuration)]), &[1, 2]);
    network.pass(1000);
    network.events();
    for (value, state) in
        [(4, NmtState::Stopped), (5, NmtState::Operational), (127, NmtState::PreOperational)]
    {
        for sub in [1, 0x80] {
            assert_eq!(network.master.request(network.now, sub, value), Ok(()));
            network.settle(Vec::new());
            assert_eq!(network.state(1), state);
            network.pass(100);
            assert_eq!(network.master.state(1), Ok(state as u8));
        }
    }
    for value in [6, 7] {
        network.sent();
        assert_eq!(network.master.request(network.now, 1, value), Ok(()));
        network.settle(Vec::new());
        assert_eq!(network.sent()[0], format!("000#8{}01", value - 5));
        network.pass(1000);
        assert_eq!(network.events(), [booted(1)], "a reset begins a boot");
    }
    for (sub, value, refusal) in
        [(0, 4, AbortCode::NoSubIndex), (0x81, 4, AbortCode::NoSubIndex), (1, 3, AbortCode::InvalidValue)]
    {
        assert_eq!(network.master.request(network.now, sub, value), Err(refusal));
    }
    assert_eq!(network.master.state(0x80), Err(AbortCode::NoSubIndex));
}

proptest! {
    #[test]
    fn whatever_slaves_send_a_master_keeps_its_times_and_its_memory(
        startup in 0..0x80_u32,
        assignments in vec(any::<u32>(), 3),
        frames in vec((1..=4_u16, 0..8_usize, any::<[u8; 8]>(), 0..2000_u64), 1..200),
    ) {
        let mut values = vec![(0x1F80, 0, startup | 1), (0x1016, 1, 0x0001_00C8), (0x1F26, 2, 5), (0x1F89, 0, 20_000)];
        values.extend((1..).zip(assignments).map(|(node_id, bits)| (0x1F81, node_id, bits | 1)));
        let configuration = dcf(&[(0x1017, 0, &[100, 0])]);
        let mut master = Master::new(&parameters(&values, &[(1, configuration.clone()), (2, configuration)]));
        let mut now = Instant::ZERO;
        master.start(now);
        for (node, kind, mut data, millis) in frames {
            let id = if kind < 4 { 0x700 } else { 0x580 } + node;
            let states = [0x00, 0x05, 0x7F, 0x85];
            if let Some(state) = states.get(kind) {
                data[0] = *state;
            }
            let length = if kind < 4 { 1 } else { 8 };
            master.handle_frame(now, &Frame::new(canopen::Id::Standard(id), &data[..length]));
            let end = now + Duration::from_millis(millis);
            let mut count = 0;
            while let Some(deadline) = master.poll_timeout().filter(|deadline| *deadline <= end) {
                now = now.max(deadline);
                master.handle_timeout(now);
                prop_assert!(master.poll_timeout().is_none_or(|next| next > now), "a past time");
                count += core::iter::from_fn(|| master.poll_transmit()).count();
            }
            now = end;
            count += core::iter::from_fn(|| master.poll_transmit()).count();
            prop_assert!(count < 20_000);
            prop_assert!(core::iter::from_fn(|| master.poll_event()).count() <= 20);
        }
        prop_assert_eq!(master.dropped(), 0);
    }
}
