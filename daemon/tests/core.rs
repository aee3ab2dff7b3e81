//! The core on virtual time, with devices of a shipped profile.

mod common;

use std::sync::Arc;
use std::time::{Duration, Instant};

use canopen::{BusState, Cause, Emergency, ErrorRegister, Frame, Id, NmtState};
use common::{Bench, LINK};
use daemon::core::{LinkId, Notice};
use profiles::{Profile, State};

const READ_DEVICE_TYPE_1: &str = "601#4000100000000000";
const HEARTBEAT: u16 = 0x1017;
const TARGET_POSITION: u32 = 0x607A_0020;

#[test]
fn every_node_of_a_link_boots_and_answers() {
    let mut bench = Bench::silent(&[&[(0, 1)], &[(0, 2)]]);
    assert_eq!(bench.send(READ_DEVICE_TYPE_1), [""; 0]);

    bench.core.start(bench.now, LINK);

    assert_eq!(bench.sent_on(LINK), ["701#00", "702#00"]);
    assert_eq!(bench.send(READ_DEVICE_TYPE_1), ["581#4300100092010200"]);
    assert_eq!(bench.send("602#4000100000000000"), ["582#4300100092010200"]);
    assert_eq!(bench.send("603#4000100000000000"), [""; 0]);
}

#[test]
fn pdos_and_heartbeats_of_nodes_on_a_link_tell_how_something_is_now() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(1, 2)]]);
    bench.write(1, HEARTBEAT, 0, &100_u16.to_le_bytes());
    let tells_present =
        |link, id, bytes: &[u8]| bench.core.tells_present(link, &Frame::new(Id::Standard(id), bytes));
    assert!(tells_present(LINK, 0x701, &[0x05]));
    assert!(tells_present(LINK, 0x181, &[0x27, 0x02]));
    for (id, bytes) in [(0x701, &[0x00][..]), (0x081, &[0; 8]), (0x581, &[0x60; 8]), (0x702, &[0x05])] {
        assert!(!tells_present(LINK, id, bytes), "{id:03X}");
    }
    assert!(!tells_present(LinkId(1), 0x701, &[0x05]), "that node is on another link");
}

#[test]
fn a_link_that_comes_again_does_not_boot_again() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.core.start(bench.now, LINK);
    assert_eq!(bench.sent_on(LINK), [""; 0]);
}

#[test]
fn a_node_is_heard_on_its_own_link_only() {
    let mut bench = Bench::new(&[&[(1, 1)]]);
    assert_eq!(bench.send(READ_DEVICE_TYPE_1), [""; 0]);
    bench.send_on(LinkId(1), READ_DEVICE_TYPE_1);
    assert_eq!(bench.sent_on(LinkId(1)), ["581#4300100092010200"]);
}

#[test]
fn a_frame_of_our_own_reaches_our_other_nodes() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    // The statusword of node 1 as target position of node 2.
    bench.map(1, 0x1800, 0x181, 0x6041_0010);
    bench.map(2, 0x1400, 0x181, 0x6040_0010);
    bench.send("000#0102");
    let started = bench.send("000#0101");

    let statusword = started.iter().find_map(|frame| frame.strip_prefix("181#")).unwrap();

    assert_eq!(bench.send("602#4040600000000000"), [format!("582#4B406000{statusword}0000")]);
}

#[test]
fn after_a_sync_every_node_has_heard_it_before_the_first_answers() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.map(1, 0x1802, 0x381, TARGET_POSITION);
    bench.map(2, 0x1802, 0x382, TARGET_POSITION);
    // Node 2 takes over, at the SYNC, what node 1 shows after it: of the SYNC before.
    bench.map(2, 0x1402, 0x381, TARGET_POSITION);
    for (node, index) in [(1, 0x1802), (2, 0x1802), (2, 0x1402)] {
        bench.write(node, index, 2, &[1]);
    }
    bench.write(1, 0x607A, 0, &[7, 0, 0, 0]);
    bench.send("000#0100");

    let mut sync = || -> Vec<String> {
        let answers = bench.send("080#");
        answers.into_iter().filter(|frame| frame.starts_with("38")).collect()
    };
    assert_eq!(sync(), ["381#07000000", "382#00000000"]);
    assert_eq!(sync(), ["381#07000000", "382#07000000"]);
}

#[test]
fn nodes_that_answer_each_other_for_ever_stop_nobody() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)], &[(0, 3)]]);
    // Two nodes exchange their target positions, which are never equal.
    bench.map(1, 0x1800, 0x181, TARGET_POSITION);
    bench.map(2, 0x1800, 0x182, TARGET_POSITION);
    bench.map(1, 0x1400, 0x182, TARGET_POSITION);
    bench.map(2, 0x1400, 0x181, TARGET_POSITION);
    bench.write(1, 0x607A, 0, &[1, 0, 0, 0]);
    bench.write(2, 0x607A, 0, &[2, 0, 0, 0]);

    // A few at a time, after which whatever else is due has its turn, and then a pause.
    let frames = bench.send("000#0100").len();
    assert!((16..32).contains(&frames), "{frames} frames in one turn");
    let frames = frames + bench.run(Duration::from_millis(1)).len();
    assert!((1000..1100).contains(&frames), "{frames} frames on end");

    // The same a second later, and nobody else is kept waiting for long.
    let frames = bench.run(Duration::from_secs(1)).len();
    assert!((50_000..60_000).contains(&frames), "{frames} frames in a second");
    let mut answers = bench.send("603#4000100000000000");
    answers.extend(bench.run(Duration::from_millis(40)));
    assert!(answers.contains(&"583#4300100092010200".to_owned()));
}

#[test]
fn a_reset_gives_the_device_its_power_on_values() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.write(1, 0x607A, 0, &[7, 0, 0, 0]);
    bench.write(2, 0x607A, 0, &[7, 0, 0, 0]);

    assert_eq!(bench.send("000#8101"), ["701#00"]);

    assert_eq!(bench.send("601#407A600000000000"), ["581#437A600000000000"]);
    assert_eq!(bench.send("602#407A600000000000"), ["582#437A600007000000"]);
    let notices: Vec<_> = std::iter::from_fn(|| bench.core.poll_notice()).collect();
    assert!(notices.contains(&(0, Notice::Reset)) && !notices.contains(&(1, Notice::Reset)), "{notices:?}");
}

#[test]
fn a_device_on_two_links_shows_both_the_same() {
    let mut bench = Bench::new(&[&[(0, 1), (1, 9)]]);
    bench.write(1, 0x607A, 0, &[7, 0, 0, 0]);

    bench.send_on(LinkId(1), "609#407A600000000000");

    assert_eq!(bench.sent_on(LinkId(1)), ["589#437A600007000000"]);
}

#[test]
fn what_changes_by_one_link_is_told_on_the_other() {
    let mut bench = Bench::new(&[&[(0, 1), (1, 9)]]);
    bench.run(Duration::from_millis(100));
    bench.send_on(LinkId(1), "000#0100");
    bench.sent_on(LinkId(1));

    bench.send_on(LINK, "601#2B40600006000000");

    // READY TO SWITCH ON, as TPDO1 of the other node.
    assert!(bench.sent_on(LinkId(1)).contains(&"189#3102".to_owned()));
}

#[test]
fn raster_steps_lie_between_frames_where_their_times_say() {
    // One loop wakes up for every step, the other only for the frames, up to 15 ms late.
    let [punctual, late] = [true, false].map(|is_punctual| {
        let mut bench = Bench::new(&[&[(0, 1)]]);
        let mut story = Vec::new();
        bench.turn(0x1000);
        for _ in 0..50 {
            let wait = Duration::from_millis(15);
            if is_punctual {
                bench.run(wait);
            } else {
                bench.now = bench.now + wait;
            }
            story.extend(
                bench.send("601#4064600000000000").into_iter().filter(|frame| frame.starts_with("581#")),
            );
        }
        story
    });
    assert_eq!(punctual, late);
    assert_ne!(punctual.last(), Some(&"581#4364600000000000".to_owned()), "the axis should have moved");
}

#[test]
fn hours_of_heartbeats_pass_in_no_time() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    for node in [1, 2] {
        bench.write(node, HEARTBEAT, 0, &1000_u16.to_le_bytes());
    }
    let start = Instant::now();

    let sent = bench.run(Duration::from_secs(3 * 3600));

    assert_eq!(sent.len(), 2 * 3 * 3600);
    assert!(sent.chunks(2).all(|pair| pair == ["701#7F", "702#7F"]));
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
}

#[test]
fn without_deadlines_the_core_asks_for_nothing() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.send("000#0100");
    bench.run(Duration::from_secs(1));
    assert_eq!(bench.core.poll_timeout(), None);
}

#[test]
fn shutting_down_ends_with_all_axes_quiet() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.turn(0x1000);
    assert!(!bench.core.is_quiet());

    bench.core.shut_down(bench.now);
    bench.run(Duration::from_secs(5));

    assert!(bench.core.is_quiet());
    assert_eq!(bench.send(READ_DEVICE_TYPE_1), ["581#4300100092010200"]);
}

#[test]
fn subscriptions_follow_the_cob_ids() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    while bench.core.poll_resubscribed().is_some() {}
    bench.write(1, 0x1400, 1, &(0x8000_0201_u32).to_le_bytes());
    bench.write(1, 0x1400, 1, &(0x0000_0321_u32).to_le_bytes());

    assert_eq!(bench.core.poll_resubscribed(), Some(LINK));
    let ids: Vec<String> = bench.core.subscriptions(LINK).map(|id| id.to_string()).collect();
    assert!(ids.contains(&"321".to_owned()) && !ids.contains(&"201".to_owned()), "{ids:?}");
}

/// The state and the speed of the first axis.
fn axis(bench: &Bench) -> (State, f64) {
    let axis = bench.core.devices().next().unwrap().axes().next().unwrap();
    (axis.state, axis.velocity.0)
}

fn notices(bench: &mut Bench) -> Vec<Notice> {
    std::iter::from_fn(|| bench.core.poll_notice()).map(|(_, notice)| notice).collect()
}

#[test]
fn a_missing_heartbeat_of_the_master_stops_the_axis() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x6085, 0, &200_000_u32.to_le_bytes());
    bench.write(1, 0x1016, 1, &0x007F_0064_u32.to_le_bytes()); // node 127 within 100 ms
    bench.turn(0x1000);
    bench.send("000#0101");
    for _ in 0..20 {
        bench.send("77F#05");
        bench.run(Duration::from_millis(90));
    }
    assert_eq!(axis(&bench).0, State::OperationEnabled);
    notices(&mut bench);

    bench.run(Duration::from_millis(9));
    assert_eq!(axis(&bench).0, State::OperationEnabled);
    let sent = bench.run(Duration::from_millis(1));

    assert!(sent.contains(&"081#3081117F00000000".to_owned()), "{sent:?}");
    assert_eq!(axis(&bench).0, State::QuickStopActive);
    assert_eq!(
        notices(&mut bench),
        [Notice::ConnectionLost(Cause::Heartbeat(127)), Notice::Nmt(NmtState::PreOperational)]
    );
    bench.run(Duration::from_secs(1));
    assert_eq!(axis(&bench), (State::SwitchOnDisabled, 0.0));
    assert!(bench.core.is_quiet());
}

#[test]
fn a_node_that_leaves_operational_stops_its_axis() {
    for command in ["000#0201", "000#8001", "000#8201", "000#8101"] {
        let mut bench = Bench::new(&[&[(0, 1)]]);
        bench.write(1, 0x6085, 0, &200_000_u32.to_le_bytes());
        bench.turn(0x1000);
        bench.send("000#0101");
        assert_eq!(axis(&bench).0, State::OperationEnabled);
        bench.send(command);
        bench.run(Duration::from_secs(10));
        assert_eq!(axis(&bench), (State::SwitchOnDisabled, 0.0), "{command}");
    }
}

#[test]
fn a_reset_of_the_communication_stops_an_axis_that_is_driven_by_sdo() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.turn(0x1000); // in PRE-OPERATIONAL
    bench.send("000#8201");
    assert_eq!(axis(&bench).0, State::QuickStopActive);
}

#[test]
fn a_link_that_comes_later_does_not_stop_the_axis() {
    let mut bench = Bench::silent(&[&[(0, 1), (1, 9)]]);
    bench.core.start(bench.now, LINK);
    bench.sent_on(LINK);
    bench.turn(0x1000);
    bench.core.start(bench.now, LinkId(1));
    bench.run(Duration::from_secs(1));
    assert_eq!(axis(&bench).0, State::OperationEnabled);
}

#[test]
fn a_bus_off_stops_the_axes_on_that_link() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.turn(0x1000);
    bench.core.set_bus_state(bench.now, LinkId(1), BusState::Off);
    assert_eq!(axis(&bench).0, State::OperationEnabled);
    bench.core.set_bus_state(bench.now, LINK, BusState::Off);
    assert_eq!(axis(&bench).0, State::QuickStopActive);
    bench.sent_on(LINK);

    bench.core.set_bus_state(bench.now, LINK, BusState::Active);

    let sent = bench.sent_on(LINK);
    assert_eq!(sent[..2], ["081#4081110000000000", "081#0000000000000000"]);
}

#[test]
fn one_node_supervises_the_heartbeat_of_another() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)]]);
    bench.write(1, 0x1016, 1, &0x0002_0064_u32.to_le_bytes());
    bench.write(2, HEARTBEAT, 0, &50_u16.to_le_bytes());
    // Node 1 hears the heartbeat of node 2 as on a wire.
    bench.run(Duration::from_secs(1));
    bench.write(2, HEARTBEAT, 0, &0_u16.to_le_bytes());
    let sent = bench.run(Duration::from_secs(1));
    assert_eq!(sent, ["081#3081110200000000"]);
}

#[test]
fn an_emergency_of_another_node_is_a_notice() {
    let profile = Arc::new(Profile::embedded("canopen-reference", None).unwrap().unwrap());
    let mut bench = Bench::of(&profile, &[&[(0, 1)], &[(0, 2)]]);
    bench.write(1, 0x1028, 2, &0x82_u32.to_le_bytes());
    bench.write(1, 0x1028, 5, &0x85_u32.to_le_bytes());

    // One of our own and a stranger.
    bench.send("000#0102");
    notices(&mut bench);
    bench.send("202#11");
    bench.send("085#1043090102030405");

    let tells = |producer, code, register, detail| {
        let register = ErrorRegister::from_bits_retain(register);
        Notice::Emergency { producer, emergency: Emergency { code, register, detail } }
    };
    let expected = [tells(2, 0x8210, 0x11, [1, 0, 1, 0, 0]), tells(5, 0x4310, 9, [1, 2, 3, 4, 5])];
    assert_eq!(notices(&mut bench), expected);
}

#[test]
fn a_reset_of_a_whole_network_reaches_some_nodes_at_a_time_and_what_is_due_comes_between() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)], &[(0, 3)]]);
    let boot_ups = |sent: &[String]| sent.iter().filter(|frame| frame.starts_with('7')).count();

    let first = bench.send("000#8100");
    assert_eq!(boot_ups(&first), 2, "{first:?}");
    // What follows on the network waits until all have heard it.
    assert_eq!(bench.send("601#4000100000000000"), [""; 0]);

    bench.now = bench.now + Duration::from_nanos(1);
    assert!(bench.core.poll_timeout().is_some_and(|deadline| deadline <= bench.now));
    bench.core.handle_timeout(bench.now);
    let last = bench.sent_on(LINK);
    assert_eq!(boot_ups(&last), 1, "{last:?}");
    bench.now = bench.now + Duration::from_nanos(1);
    bench.core.handle_timeout(bench.now);
    let answer = bench.sent_on(LINK);
    assert!(answer[0].starts_with("581#43001000"), "{answer:?}");
}

#[test]
fn a_node_that_leaves_in_the_midst_of_a_reset_of_its_network_has_no_part_in_it() {
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2)], &[(0, 3)]]);
    assert_eq!(bench.send("000#8200").iter().filter(|frame| frame.starts_with('7')).count(), 2);
    assert!(bench.core.leave(2).is_some());
    assert_eq!(bench.run(Duration::from_millis(1)), [""; 0]);
    assert!(bench.send("601#4000100000000000")[0].starts_with("581#43001000"));
}

#[test]
fn a_device_may_have_an_sdo_time_out_of_its_own_on_all_its_links() {
    let mut bench = Bench::new(&[&[(0, 1), (1, 9)], &[(0, 2)]]);
    bench.core.set_sdo_timeout(0, Duration::from_millis(200));
    for request in ["601#4008100000000000", "602#4008100000000000"] {
        bench.send(request);
    }
    bench.send_on(LinkId(1), "609#4008100000000000");
    bench.sent_on(LinkId(1));
    assert_eq!(bench.run(Duration::from_millis(199)), [""; 0]);
    bench.core.handle_timeout(bench.now + Duration::from_millis(1));
    let aborts: Vec<_> = std::iter::from_fn(|| bench.core.poll_transmit()).collect();
    let aborts: Vec<_> = aborts.iter().map(|(link, frame)| (link.0, frame.to_string())).collect();
    let expected = [(0, "581#8008100000000405"), (1, "589#8008100000000405")];
    assert_eq!(aborts, expected.map(|(link, frame)| (link, frame.to_owned())));
    assert_eq!(bench.run(Duration::from_secs(1)), ["582#8008100000000405"]);
}
