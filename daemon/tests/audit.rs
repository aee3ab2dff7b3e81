//! What is kept of who commanded what, on virtual time.

mod common;

use std::sync::Arc;
use std::time::Duration;

use canopen::{NetworkOrder, NmtCommand};
use common::gateway::{Gateway, peer};
use common::{Bench, LINK};
use daemon::core::{Again, AuditEntry, Authority, Item, LinkId, Peer, Sender, What, Who};
use daemon::motion::Goal;
use od::{AbortCode, Address, Bus, Owner};
use profiles::{PlantFault, Profile, Repair, Signal};

fn bench(profile: &str) -> Bench {
    let profile = Arc::new(Profile::embedded(profile, None).unwrap().unwrap());
    let mut bench = Bench::of(&profile, &[&[(0, 1)], &[(0, 2)]]);
    bench.core.keep_audit();
    bench
}

/// What is to be kept since the last time.
fn entries(bench: &mut Bench) -> Vec<AuditEntry> {
    std::iter::from_fn(|| bench.core.poll_audit()).collect()
}

/// The same: what it is, of which device, and how often.
fn kept(bench: &mut Bench) -> Vec<(Option<usize>, What, Option<Again>)> {
    entries(bench).into_iter().map(|entry| (entry.device, entry.what, entry.again)).collect()
}

/// An entry written by `node_id`.
fn item(node_id: u8, index: u16, sub: u8, value: i128) -> Item {
    Item { node_id: Some(node_id), address: Address::new(index, sub), value: Some(value) }
}

fn again(times: u64, lasted: Duration) -> Option<Again> {
    Some(Again { times, lasted })
}

#[test]
fn every_acyclic_command_is_kept_even_one_that_changes_nothing() {
    let mut bench = bench("cia402-servo");
    bench.write(1, 0x6040, 0, &[6, 0]);
    bench.write(1, 0x6040, 0, &[6, 0]);
    bench.write(2, 0x607A, 0, &(-5_i32).to_le_bytes());
    bench.write(1, 0x6065, 0, &[9, 0, 0, 0]);
    bench.send("601#2B40600007000000");
    let entries = entries(&mut bench);
    let expected = [
        (Some(0), What::Write(item(1, 0x6040, 0, 6))),
        (Some(0), What::Write(item(1, 0x6040, 0, 6))),
        (Some(1), What::Write(item(2, 0x607A, 0, -5))),
        (Some(0), What::Write(item(1, 0x6040, 0, 7))),
    ];
    let told: Vec<_> = entries.iter().map(|e| (e.device, e.what)).collect();
    assert_eq!(told, expected, "0x6065 moves nothing");
    assert!(entries.iter().all(|e| e.who == Who::CanOpen(LinkId(0)) && e.at == bench.now));
}

#[test]
fn a_command_that_is_refused_is_kept_with_its_reason_and_a_flood_of_them_is_two_entries() {
    let mut bench = bench("cia402-servo");
    bench.core.claim(bench.now, 0, 0, Owner { bus: Bus::Modbus, link: None }).unwrap();
    entries(&mut bench);
    let began = bench.now;
    for value in 0..100_u8 {
        let answers = bench.send(&format!("601#2B406000{value:02X}000000"));
        assert_eq!(answers, ["581#8040600022000008"]);
        bench.run(Duration::from_millis(10));
    }
    // No such mode, whoever asks; 0x6065 moves nothing, and 0x1017 is none of the drive.
    bench.send("602#2F60600063000000");
    bench.send("602#23656000FFFFFFFF");
    bench.send("602#2F17100001000000");
    let refused = |value| What::Refused(item(1, 0x6040, 0, value), AbortCode::DeviceState);
    let no_mode = What::Refused(item(2, 0x6060, 0, 99), AbortCode::InvalidValue);
    assert_eq!(kept(&mut bench), [(Some(0), refused(0), None), (Some(1), no_mode, None)]);
    let lasted = bench.now.saturating_since(began) - Duration::from_millis(10);
    bench.run(Duration::from_millis(980));
    assert_eq!(kept(&mut bench), [], "it may still go on");
    bench.run(Duration::from_secs(10));
    assert_eq!(kept(&mut bench), [(Some(0), refused(99), again(99, lasted))], "the other came once");
}

/// An entry of node 1 that was refused before its value was known.
fn unknown(index: u16, code: AbortCode) -> (Option<usize>, What, Option<Again>) {
    let item = Item { node_id: Some(1), address: Address::new(index, 0), value: None };
    (Some(0), What::Refused(item, code), None)
}

#[test]
fn sdo_downloads_of_a_wrong_length_are_kept_once_for_each_kind() {
    let mut bench = bench("cia402-servo");
    let too_long = unknown(0x607A, AbortCode::TooLong);
    let too_short = unknown(0x607A, AbortCode::TooShort);
    for (download, told) in [
        // Expedited: two bytes of four.
        (&["601#2B7A600001000000"][..], too_short),
        // Segmented: eight bytes are announced; or none, and seven come; or four, and three come.
        (&["601#217A600008000000"], too_long),
        (&["601#207A600000000000", "601#0101020304050607"], too_long),
        (&["601#217A600004000000", "601#0901020300000000"], too_short),
        // By blocks: eight bytes are announced; or none, and seven come; or two.
        (&["601#C27A600008000000"], too_long),
        (&["601#C07A600000000000", "601#8101020304050607", "601#C100000000000000"], too_long),
        (&["601#C07A600000000000", "601#8101020000000000", "601#D500000000000000"], too_short),
    ] {
        for _ in 0..3 {
            let last = download.iter().flat_map(|frame| bench.send(frame)).last().unwrap();
            let code = if told == too_long { "12000706" } else { "13000706" };
            assert_eq!(last, format!("581#807A6000{code}"), "{download:?}");
        }
        assert_eq!(kept(&mut bench), [told], "{download:?}");
        bench.run(Duration::from_secs(2));
        let times = kept(&mut bench)[0].2.map(|again| again.times);
        assert_eq!(times, Some(2), "{download:?}");
    }
    // Not an axis is moved by 0x6065; a client that gives up or breaks the protocol has written nothing.
    for nothing in
        ["601#2B65600001000000", "601#217A600004000000", "601#807A600000000405", "601#1101020304000000"]
    {
        bench.send(nothing);
    }
    assert_eq!(kept(&mut bench), []);
}

#[test]
fn what_a_modbus_client_may_not_write_is_kept_and_a_flood_of_it_is_two_entries() {
    let mut gateway = Gateway::new(&[1]);
    gateway.bench.core.keep_audit();
    let reader = gateway.bench.core.connect(gateway.bench.now, 0, peer(2), true).unwrap();
    for value in 0..100 {
        assert_eq!(gateway.write16(reader, 0x6040, value), "86 02");
        gateway.bench.run(Duration::from_millis(10));
    }
    // This moves nothing.
    gateway.write32(reader, 0x6065, 9);
    gateway.bench.run(Duration::from_secs(2));
    let told = entries(&mut gateway.bench);
    assert!(told.iter().all(|entry| (entry.device, entry.who) == (Some(0), Who::Modbus(peer(2)))));
    let refused = |value| {
        let item = Item { node_id: None, address: Address::new(0x6040, 0), value: Some(value) };
        What::Refused(item, AbortCode::UnsupportedAccess)
    };
    let told: Vec<_> = told.iter().map(|e| (e.what, e.again.map(|again| again.times))).collect();
    assert_eq!(told, [(refused(0), None), (refused(99), Some(99))]);
}

#[test]
fn a_flood_of_refused_commands_is_told_each_minute() {
    let mut bench = bench("cia402-servo");
    for _ in 0..3700 {
        bench.send("601#2F60600063000000");
        bench.run(Duration::from_millis(50));
    }
    let told = kept(&mut bench);
    assert_eq!(told.len(), 7, "185 seconds are three minutes and a rest: {told:?}");
    let times: u64 = told.iter().map(|(_, _, again)| again.map_or(1, |again| again.times)).sum();
    bench.run(Duration::from_secs(2));
    let rest = kept(&mut bench)[0].2.map_or(0, |again| again.times);
    assert_eq!(times + rest, 3700);
}

#[test]
fn refused_commands_of_very_many_kinds_cost_entries() {
    const MOST: usize = 64;
    // Four axes on each of two cards.
    let mut bench = bench("maccon-mac4-inc");
    let owner = Some(Owner { bus: Bus::Modbus, link: None });
    (0..2).for_each(|device| bench.core.set_owner(device, owner));
    bench.run(Duration::from_secs(2));
    entries(&mut bench);
    // Kinds differ by device, entry and reason, not by value.
    let schema = Arc::clone(&bench.core.profile(0).unwrap().application);
    let commands = schema.entries().filter(|(_, entry)| entry.command.is_some() && !entry.is_local);
    let commands: Vec<Address> = commands.map(|(address, _)| address).collect();
    for (node, Address { index, sub }) in (1..=2).flat_map(|node| commands.iter().map(move |c| (node, *c))) {
        let [low, high] = index.to_le_bytes();
        for value in ["00000000", "01000000"] {
            // Without a length: as many bytes as the entry has.
            bench.send(&format!("{:03X}#22{low:02X}{high:02X}{sub:02X}{value}", 0x600 + node));
        }
    }
    let kinds = 2 * commands.len();
    assert!(kinds > MOST, "{kinds}");
    assert_eq!(kept(&mut bench).len(), MOST);
    // Each was refused twice; those that found no room are lost both times.
    assert_eq!(bench.core.lost_audit(), 2 * (kinds - MOST) as u64);
    bench.run(Duration::from_secs(2));
    assert_eq!(kept(&mut bench).len(), MOST, "how often more");
    bench.send("601#2F60600063000000");
    assert_eq!(kept(&mut bench).len(), 1, "there is room again");
}

#[test]
fn nmt_commands_that_change_a_node_are_kept() {
    let mut bench = bench("cia402-servo");
    let nmt = |command, node_id| What::Network(LINK, NetworkOrder::Nmt { command, node_id });
    bench.send("000#0102");
    // It is OPERATIONAL; there is no node 9; no command.
    for nothing in ["000#0102", "000#0109", "000#0302", "000#01"] {
        bench.send(nothing);
    }
    bench.send("000#8000");
    bench.send("000#8100");
    let told = entries(&mut bench);
    assert!(told.iter().all(|entry| entry.who == Who::CanOpen(LINK)));
    let told: Vec<_> = told.iter().map(|entry| (entry.device, entry.what)).collect();
    let expected = [
        (Some(1), nmt(NmtCommand::Start, 2)),
        (Some(1), nmt(NmtCommand::EnterPreOperational, 0)),
        (None, nmt(NmtCommand::ResetNode, 0)),
    ];
    assert_eq!(told, expected, "node 1 was PRE-OPERATIONAL, and both are reset");
}

#[test]
fn what_lss_configures_is_kept_and_what_it_asks_is_not() {
    let mut bench = bench("cia402-servo");
    // Nobody is selected.
    bench.send("7E5#1107000000000000");
    bench.send("7E5#0401000000000000");
    bench.send("7E5#5E00000000000000");
    assert_eq!(kept(&mut bench), []);
    bench.send("7E5#1107000000000000");
    bench.send("7E5#1300020000000000");
    bench.send("7E5#1700000000000000");
    let lss = |order| (None, What::Network(LINK, order), None);
    let timing = NetworkOrder::LssBitTiming { table: 0, entry: 2 };
    let expected = [lss(NetworkOrder::LssNodeId(7)), lss(timing), lss(NetworkOrder::LssStore)];
    assert_eq!(kept(&mut bench), expected, "both nodes are selected");
}

#[test]
fn what_an_operator_orders_is_kept_whatever_comes_of_it() {
    let mut bench = bench("cia402-servo");
    let now = bench.now;
    let axis = 0;
    let fault: PlantFault = "supply-dip:40".parse().unwrap();
    let owner = Owner { bus: Bus::Modbus, link: None };
    bench.core.inject(now, 1, axis, fault).unwrap();
    bench.core.repair(now, 1, axis, Repair::All).unwrap();
    let signal: Signal = "analog-input:2.5".parse().unwrap();
    bench.core.set_signal(now, 1, axis, signal).unwrap();
    bench.core.claim(now, 1, axis, owner).unwrap();
    bench.core.release(now, 1, axis).unwrap();
    bench.core.note_motion(now, 1, axis, Goal::Stop);
    // Nobody here listens to it.
    bench.core.handle_own_frame(now, LINK, &common::parse("000#0163"));
    assert!(bench.core.inject(now, 1, 7, fault).is_err() && bench.core.claim(now, 9, 0, owner).is_err());
    let told = entries(&mut bench);
    assert!(told.iter().all(|entry| entry.who == Who::Local));
    let told: Vec<_> = told.iter().map(|entry| (entry.device, entry.what)).collect();
    let start = NetworkOrder::Nmt { command: NmtCommand::Start, node_id: 99 };
    let expected = [
        (Some(1), What::Inject(axis, fault)),
        (Some(1), What::Repair(axis, Repair::All)),
        (Some(1), What::Signal(axis, signal)),
        (Some(1), What::Claim(axis, owner)),
        (Some(1), What::Release(axis, None)),
        (Some(1), What::Motion(axis, Goal::Stop)),
        (None, What::Network(LINK, start)),
    ];
    assert_eq!(told, expected);
}

#[test]
fn whoever_is_on_this_machine_is_kept_with_each_order_and_a_flood_of_one_user_is_two_entries() {
    let mut bench = bench("cia402-servo");
    let by = |uid, pid| Some(Peer::Process { uid, pid: Some(pid) });
    let (now, controlword) = (bench.now, Address::new(0x6040, 0));
    let write = |bench: &mut Bench, value: u8| {
        let write = [(controlword, vec![value, 0])];
        bench.core.write(now, 0, 0, &write, Authority::Owner).is_ok()
    };
    bench.core.act_for(by(1000, 7));
    assert!(write(&mut bench, 6));
    bench.core.note_motion(now, 0, 0, Goal::Stop);
    bench.core.handle_own_frame(now, LINK, &common::parse("000#0101"));
    bench.core.claim(now, 0, 0, Owner { bus: Bus::Modbus, link: None }).unwrap();
    bench.core.act_for(None);
    bench.send("601#2B40600006000000");
    let told: Vec<_> = entries(&mut bench).into_iter().map(|entry| (entry.who, entry.peer)).collect();
    let local = (Who::Local, by(1000, 7));
    assert_eq!(told, [local, local, local, local, (Who::CanOpen(LINK), None)]);
    // It belongs to Modbus now. Each try is a process of its own, and another user tries, too.
    for pid in 8..20 {
        bench.core.act_for(by(1000, pid));
        assert!(!write(&mut bench, 7));
    }
    bench.core.act_for(by(0, 20));
    assert!(!write(&mut bench, 7));
    bench.core.act_for(None);
    bench.run(Duration::from_secs(3));
    let told: Vec<_> =
        entries(&mut bench).into_iter().map(|entry| (entry.peer, entry.again.map(|a| a.times))).collect();
    assert_eq!(told, [(by(1000, 8), None), (by(0, 20), None), (by(1000, 19), Some(11))]);
}

#[test]
fn what_a_client_of_the_ascii_gateway_orders_is_kept_with_its_address_whoever_obeys() {
    let mut bench = bench("cia402-servo");
    bench.send("000#0101");
    entries(&mut bench);
    let client = |port| Peer::Address(([10, 0, 0, 7], port).into());
    let send = |bench: &mut Bench, sender, frame: &str| {
        bench.core.handle_frame_of(bench.now, LINK, sender, &common::parse(frame));
    };
    let gateway = Sender::Gateway(Some(client(4000)));
    // Ours, one of somebody else's; LSS to both of ours; SDO; controlword and target by RPDO 3, which are cyclic.
    for frame in ["000#0202", "000#0163", "7E5#0401000000000000", "7E5#1107000000000000"] {
        send(&mut bench, gateway, frame);
    }
    send(&mut bench, gateway, "601#2B40600006000000");
    send(&mut bench, gateway, "401#070005000000");
    let nmt = |command, node_id| What::Network(LINK, NetworkOrder::Nmt { command, node_id });
    let told: Vec<_> = entries(&mut bench).into_iter().map(|e| (e.who, e.device, e.what, e.peer)).collect();
    let (bus, by) = (Who::CanOpen(LINK), Some(client(4000)));
    let expected = [
        (bus, Some(1), nmt(NmtCommand::Stop, 2), by),
        (bus, None, nmt(NmtCommand::Start, 99), by),
        (bus, None, What::Network(LINK, NetworkOrder::LssNodeId(7)), by),
        (bus, Some(0), What::Write(item(1, 0x6040, 0, 6)), by),
        (bus, Some(0), What::Change(item(1, 0x6040, 0, 7)), None),
        (bus, Some(0), What::StreamStart(item(1, 0x607A, 0, 5)), None),
    ];
    assert_eq!(told, expected);
    // A client of socketcand is on the bus: what nobody here obeys is not kept of it. Nor of the gateway's own frames.
    for (sender, kept) in [(Sender::Client(client(4001)), 0), (Sender::Bus, 0), (Sender::Gateway(None), 1)] {
        send(&mut bench, sender, "000#0162");
        assert_eq!(entries(&mut bench).len(), kept, "{sender:?}");
    }
    send(&mut bench, Sender::Client(client(4001)), "000#0102");
    assert_eq!(entries(&mut bench)[0].peer, Some(client(4001)));
}

#[test]
fn a_flood_of_one_client_is_two_entries_however_often_it_connects() {
    let mut bench = bench("cia402-servo");
    for port in 1000..1100 {
        let client = Sender::Gateway(Some(Peer::Address(([10, 0, 0, 7], port).into())));
        bench.core.handle_frame_of(bench.now, LINK, client, &common::parse("000#0163"));
    }
    let other = Sender::Gateway(Some(Peer::Address(([10, 0, 0, 8], 1000).into())));
    bench.core.handle_frame_of(bench.now, LINK, other, &common::parse("000#0163"));
    bench.run(Duration::from_secs(3));
    let times: Vec<_> = kept(&mut bench).into_iter().map(|(_, _, again)| again.map(|a| a.times)).collect();
    assert_eq!(times, [None, None, Some(99)]);
}

#[test]
fn of_cyclic_data_changes_of_the_controlword_and_the_ends_of_a_stream_are_kept() {
    let mut bench = bench("cia402-servo");
    bench.send("000#0100");
    entries(&mut bench);
    let began = bench.now;
    // RPDO 3 is controlword and target position.
    for target in 0..100_u8 {
        bench.send(&format!("401#0600{target:02X}000000"));
        bench.run(Duration::from_millis(10));
    }
    bench.send("401#070063000000");
    let position = |value| item(1, 0x607A, 0, value);
    let controlword = |value| item(1, 0x6040, 0, value);
    assert_eq!(
        kept(&mut bench),
        [
            (Some(0), What::Change(controlword(6)), None),
            (Some(0), What::StreamStart(position(0)), None),
            (Some(0), What::Change(controlword(7)), None),
        ]
    );
    let lasted = bench.now.saturating_since(began);
    bench.run(Duration::from_millis(990));
    assert_eq!(kept(&mut bench), [], "it may still go on");
    bench.run(Duration::from_millis(20));
    assert_eq!(kept(&mut bench), [(Some(0), What::StreamEnd(position(99)), again(101, lasted))]);
    bench.run(Duration::from_secs(10));
    assert_eq!(kept(&mut bench), []);
}

#[test]
fn streams_to_several_devices_end_each_for_itself_however_long_they_last() {
    let mut bench = bench("cia402-servo");
    bench.send("000#0100");
    entries(&mut bench);
    bench.send("401#000001000000");
    bench.send("402#000002000000");
    for _ in 0..700 {
        bench.run(Duration::from_millis(100));
        bench.send("402#000002000000");
    }
    let (one, two) = (item(1, 0x607A, 0, 1), item(2, 0x607A, 0, 2));
    let expected = [
        (Some(0), What::StreamStart(one), None),
        (Some(1), What::StreamStart(two), None),
        (Some(0), What::StreamEnd(one), again(1, Duration::ZERO)),
    ];
    assert_eq!(kept(&mut bench), expected);
    bench.run(Duration::from_secs(2));
    let end = (Some(1), What::StreamEnd(two), again(701, Duration::from_secs(70)));
    assert_eq!(kept(&mut bench), [end]);
}

#[test]
fn registers_that_move_a_motor_are_commands_and_those_that_tune_it_are_none() {
    let mut bench = bench("jvl-mac00-fc4");
    // P_SOLL, MODE_REG, and INPOSWIN of a MAC140.
    bench.write(1, 0x2012, 3, &1000_u32.to_le_bytes());
    bench.write(1, 0x2012, 2, &2_u32.to_le_bytes());
    bench.write(1, 0x2012, 33, &7_u32.to_le_bytes());
    let write = |sub, value| (Some(0), What::Write(item(1, 0x2012, sub, value)), None);
    assert_eq!(kept(&mut bench), [write(3, 1000), write(2, 2)]);
}

#[test]
fn what_nobody_takes_is_lost_and_counted_and_without_a_keeper_nothing_is() {
    let mut bench = bench("cia402-servo");
    (0..1030).for_each(|_| bench.write(1, 0x6040, 0, &[6, 0]));
    assert_eq!(bench.core.lost_audit(), 6);
    assert_eq!(kept(&mut bench).len(), 1024);
    let profile = Arc::new(Profile::embedded("cia402-servo", None).unwrap().unwrap());
    let mut silent = Bench::of(&profile, &[&[(0, 1)]]);
    (0..1030).for_each(|_| silent.write(1, 0x6040, 0, &[6, 0]));
    silent.send("601#2F60600063000000");
    silent.send("000#0100");
    assert_eq!((silent.core.lost_audit(), silent.core.poll_audit()), (0, None));
}
