//! Modbus clients of a core, on virtual time.

mod common;

use std::time::Duration;

use common::gateway::{Gateway, listener, peer};
use daemon::control::{AxisOwner, Claim};
use daemon::core::{AuditEntry, Item, ListenerPlan, Notice, Refused, What, WhenFull, Who};
use modbus::Permissions;
use od::{AbortCode, Address, Bus, Owner};
use profiles::State;

const MODBUS: Owner = Owner { bus: Bus::Modbus, link: None };
const CAN: Owner = Owner { bus: Bus::CanOpen, link: Some(0) };
/// "Abort because of the present device state" for 0x6040:00 of node 1.
const REFUSED: &str = "581#8040600022000008";

#[test]
fn an_axis_moves_by_registers_alone() {
    let mut gateway = Gateway::new(&[1]);
    let client = gateway.connect();
    gateway.write16(client, 0x6060, 1);
    for controlword in [0x06, 0x07, 0x0F] {
        gateway.write16(client, 0x6040, controlword);
        gateway.bench.run(Duration::from_millis(100));
    }
    gateway.write32(client, 0x607A, 10_000);
    gateway.write16(client, 0x6040, 0x1F);
    gateway.bench.run(Duration::from_millis(100));
    let under_way = gateway.read32(client, 0x6064);
    assert!((1..9_000).contains(&under_way), "{under_way}");
    // What the axis shows between two requests is what it is then: nothing else had the raster run.
    gateway.bench.now = gateway.bench.now + Duration::from_millis(10);
    assert!(gateway.read32(client, 0x6064) > under_way);
    gateway.bench.run(Duration::from_secs(10));
    assert!((9_990..=10_010).contains(&gateway.read32(client, 0x6064)));
}

#[test]
fn what_a_client_writes_is_seen_on_the_bus_and_the_other_way_round() {
    let mut gateway = Gateway::new(&[1]);
    let client = gateway.connect();
    gateway.write32(client, 0x607A, 0x0102_0304);
    assert_eq!(gateway.bench.send("601#407A600000000000"), ["581#437A600004030201"]);
    gateway.bench.write(1, 0x607A, 0, &[5, 0, 0, 0]);
    assert_eq!(gateway.read32(client, 0x607A), 5);
}

#[test]
fn a_unit_is_a_node_and_0_and_255_are_the_one_that_is_configured() {
    let mut gateway = Gateway::new(&[1, 2]);
    let client = gateway.connect();
    for (unit, value) in [(1, 11), (2, 22)] {
        let at = gateway.at(0x607A, 0);
        gateway.ask(client, unit, &format!("10 {at} 00 02 04 00 {value} 00 00"));
    }
    let at = gateway.at(0x607A, 0);
    let read = format!("03 {at} 00 01");
    for (unit, answer) in [(1, "03 02 00 11"), (2, "03 02 00 22"), (0, "03 02 00 11"), (255, "03 02 00 11")] {
        assert_eq!(gateway.ask(client, unit, &read), answer, "unit {unit}");
    }
    for unit in [3, 127, 254] {
        assert_eq!(gateway.ask(client, unit, &read), "83 0B", "unit {unit}");
    }
}

#[test]
fn a_node_id_given_by_lss_is_the_unit_where_none_is_configured() {
    let mut gateway = Gateway::with(&[255], ListenerPlan { device: None, ..listener() }, None);
    let client = gateway.connect();
    let statusword = format!("03 {} 00 01", gateway.at(0x6041, 0));
    let units = |gateway: &mut Gateway| {
        let is_there = |unit: &u8| gateway.ask(client, *unit, &statusword).starts_with("03");
        (0..=255).filter(is_there).collect::<Vec<_>>()
    };
    assert!(units(&mut gateway).is_empty());
    // Switch state global, configure Node-ID, and back to the waiting state.
    let configure = |gateway: &mut Gateway, node_id: &str| {
        for frame in ["0401000000000000", &format!("11{node_id}000000000000"), "0400000000000000"] {
            gateway.bench.send(&format!("7E5#{frame}"));
        }
    };
    configure(&mut gateway, "0A");
    assert_eq!(units(&mut gateway), [10]);
    configure(&mut gateway, "0B");
    assert_eq!(units(&mut gateway), [10], "it takes another one when its communication is reset");
    gateway.bench.send("000#820A");
    assert_eq!(units(&mut gateway), [11]);
}

#[test]
fn units_0_and_255_are_nobody_among_several_unless_configured() {
    let mut gateway = Gateway::with(&[1, 2], ListenerPlan { device: None, ..listener() }, None);
    let client = gateway.connect();
    for unit in [0, 255] {
        assert_eq!(gateway.ask(client, unit, "03 10 00 00 01"), "83 0B");
    }
}

#[test]
fn on_a_listener_of_its_own_a_device_is_every_unit() {
    let own = ListenerPlan { device: Some(1), is_own: true, ..listener() };
    let mut gateway = Gateway::with(&[1, 2], own, None);
    let client = gateway.connect();
    gateway.bench.write(2, 0x607A, 0, &[7, 0, 0, 0]);
    let at = gateway.at(0x607A, 0);
    for unit in [0, 1, 2, 99, 255] {
        assert_eq!(gateway.ask(client, unit, &format!("03 {at} 00 01")), "03 02 00 07", "unit {unit}");
    }
}

#[test]
fn a_full_listener_sends_the_next_client_away() {
    let mut gateway = Gateway::with(&[1], ListenerPlan { max_clients: 1, ..listener() }, None);
    let first = gateway.connect();
    let second = gateway.bench.core.connect(gateway.bench.now, 0, peer(2), false);
    assert_eq!(second, Err(Refused));
    gateway.bench.core.disconnect(first);
    assert!(gateway.bench.core.connect(gateway.bench.now, 0, peer(2), false).is_ok());
    let counters = gateway.bench.core.modbus_listeners().next().unwrap();
    assert_eq!((counters.clients, counters.accepted, counters.refused), (1, 2, 1));
}

#[test]
fn or_the_next_client_takes_the_place_of_the_longest_silent_one() {
    let plan = ListenerPlan { max_clients: 2, when_full: WhenFull::Replace, ..listener() };
    let mut gateway = Gateway::with(&[1], plan, None);
    let (first, second) = (gateway.connect(), gateway.connect());
    gateway.bench.now = gateway.bench.now + Duration::from_secs(1);
    gateway.ask(first, 1, "03 10 00 00 01");
    let third = gateway.connect();
    assert_eq!(gateway.bench.core.poll_closed(), Some(second));
    assert!(gateway.bench.core.is_closing(second) && !gateway.bench.core.is_closing(first));
    gateway.bench.core.disconnect(second);
    assert_eq!(gateway.bench.core.poll_closed(), None);
    gateway.ask(third, 1, "03 10 00 00 01");
    let counters = gateway.bench.core.modbus_listeners().next().unwrap();
    assert_eq!((counters.clients, counters.replaced), (2, 1));
}

#[test]
fn a_client_that_asks_for_nothing_is_sent_away() {
    let idle = Duration::from_secs(60);
    let mut gateway = Gateway::with(&[1], ListenerPlan { idle_timeout: Some(idle), ..listener() }, None);
    let (busy, silent) = (gateway.connect(), gateway.connect());
    gateway.bench.run(Duration::from_secs(30));
    gateway.ask(busy, 1, "03 10 00 00 01");
    gateway.bench.run(Duration::from_secs(29));
    assert_eq!(gateway.bench.core.poll_closed(), None);
    gateway.bench.run(Duration::from_secs(1));
    assert_eq!(gateway.bench.core.poll_closed(), Some(silent));
    gateway.bench.run(Duration::from_secs(30));
    assert_eq!(gateway.bench.core.poll_closed(), Some(busy));
    assert_eq!(gateway.bench.core.modbus_listeners().next().unwrap().idle, 2);
    assert_eq!(gateway.bench.core.modbus_listeners().next().unwrap().clients, 0);
}

#[test]
fn clients_that_may_only_read_and_registers_that_may_not_be_written() {
    let permissions = Permissions { read_only: false, write: vec![0x7000..=0x7001] };
    let mut gateway = Gateway::with(&[1], ListenerPlan { permissions, ..listener() }, None);
    let client = gateway.connect();
    assert_eq!(gateway.write16(client, 0x6040, 6), "86 02");
    let mut gateway = Gateway::new(&[1]);
    let reader = gateway.bench.core.connect(gateway.bench.now, 0, peer(2), true).unwrap();
    assert_eq!(gateway.write16(reader, 0x6040, 6), "86 02");
    assert_eq!(gateway.read32(reader, 0x6064), 0);
}

#[test]
fn only_the_configured_owner_commands_and_everybody_reads() {
    let mut gateway = Gateway::new(&[1]);
    let client = gateway.connect();
    gateway.bench.core.set_owner(0, Some(MODBUS));
    assert_eq!(gateway.bench.send("601#2B40600006000000"), [REFUSED]);
    assert_eq!(gateway.bench.send("601#4040600000000000"), ["581#4B40600000000000"]);
    assert!(gateway.write16(client, 0x6040, 6).starts_with("06"));
    gateway.bench.core.set_owner(0, Some(CAN));
    assert_eq!(gateway.write16(client, 0x6040, 7), "86 04");
    gateway.bench.write(1, 0x6040, 0, &[7, 0]);
    // A parameter is no command.
    assert!(gateway.write32(client, 0x6081, 100).starts_with("10"));
}

#[test]
fn a_command_of_a_client_that_is_refused_is_kept_with_its_address() {
    let mut gateway = Gateway::new(&[1]);
    let client = gateway.connect();
    gateway.bench.core.keep_audit();
    gateway.bench.core.set_owner(0, Some(CAN));
    assert_eq!(gateway.write16(client, 0x6040, 7), "86 04");
    let Some(AuditEntry { who, what, .. }) = gateway.bench.core.poll_audit() else { panic!("an entry") };
    let item = Item { node_id: None, address: Address::new(0x6040, 0), value: Some(7) };
    assert_eq!(what, What::Refused(item, AbortCode::DeviceState));
    assert!(matches!(who, Who::Modbus(_)), "{who:?}");
    assert_eq!(gateway.bench.core.poll_audit(), None);
}

#[test]
fn an_axis_is_claimed_and_released() {
    let mut gateway = Gateway::new(&[1]);
    let client = gateway.connect();
    gateway.bench.core.claim(gateway.bench.now, 0, 0, MODBUS).unwrap();
    assert_eq!(gateway.bench.core.owner(0, 0), Some(MODBUS));
    assert_eq!(gateway.bench.send("601#2B40600006000000"), [REFUSED]);
    gateway.bench.core.claim(gateway.bench.now, 0, 0, CAN).unwrap();
    assert_eq!(gateway.write16(client, 0x6040, 6), "86 04");
    gateway.bench.core.release(gateway.bench.now, 0, 0).unwrap();
    assert!(gateway.write16(client, 0x6040, 6).starts_with("06"));
    // Released is as configured.
    gateway.bench.core.set_owner(0, Some(CAN));
    gateway.bench.core.claim(gateway.bench.now, 0, 0, MODBUS).unwrap();
    gateway.bench.core.release(gateway.bench.now, 0, 0).unwrap();
    assert_eq!(gateway.bench.core.owner(0, 0), Some(CAN));
    assert!(gateway.bench.core.claim(gateway.bench.now, 0, 1, MODBUS).is_err());
    assert!(gateway.bench.core.release(gateway.bench.now, 1, 0).is_err());
}

#[test]
fn an_axis_is_claimed_by_names_for_who_reaches_it() {
    let mut gateway = Gateway::new(&[1, 2]);
    let now = gateway.bench.now;
    let core = &mut gateway.bench.core;
    let mut claim = |device: &str, axis, owner: Option<&str>| {
        let claim = Claim { device: device.to_owned(), axis, owner: owner.map(str::to_owned) };
        let owners = claim.carry_out(now, core, &["can0", "can1"]);
        owners.map(|owners| owners.into_iter().map(|axis| axis.owner).collect::<Vec<_>>())
    };
    for owner in ["modbus", "local", "can0"] {
        assert_eq!(claim("y", None, Some(owner)), Ok(vec![owner.to_owned()]));
    }
    for (axis, owner, error) in [
        (None, Some("can1"), "`can1` cannot command device `y`; who can: can0, modbus, local"),
        (None, Some("any"), "`any` cannot command device `y`; who can: can0, modbus, local"),
        (Some(2), Some("local"), "device `y` has no axis 2, only axis 1"),
        (Some(0), None, "device `y` has no axis 0, only axis 1"),
    ] {
        assert_eq!(claim("y", axis, owner).unwrap_err(), error);
    }
    assert_eq!(claim("z", None, None).unwrap_err(), "no device `z`; there are: x, y");
    assert_eq!((gateway.bench.core.owner(0, 0), gateway.bench.core.owner(1, 0)), (None, Some(CAN)));
    gateway.bench.core.set_owner(1, Some(MODBUS));
    let release = Claim { device: "y".to_owned(), axis: Some(1), owner: None };
    gateway.bench.core.claim(gateway.bench.now, 1, 0, CAN).unwrap();
    let released = release.carry_out(gateway.bench.now, &mut gateway.bench.core, &["can0"]).unwrap();
    assert_eq!(released, [AxisOwner { device: "y".to_owned(), axis: 1, owner: "modbus".to_owned() }]);
}

#[test]
fn no_axis_is_claimed_for_modbus_where_no_client_reaches_it() {
    let mut bench = common::Bench::new(&[&[(0, 1)]]);
    let claim = Claim { device: "x".to_owned(), axis: None, owner: Some("modbus".to_owned()) };
    let refused = claim.carry_out(bench.now, &mut bench.core, &["can0"]);
    assert_eq!(refused, Err("no Modbus client reaches device `x`".to_owned()));
}

#[test]
fn a_reset_of_the_node_leaves_the_owner() {
    let mut gateway = Gateway::new(&[1]);
    gateway.bench.core.claim(gateway.bench.now, 0, 0, MODBUS).unwrap();
    gateway.bench.send("000#8101");
    assert_eq!(gateway.bench.send("601#2B40600006000000"), [REFUSED]);
}

#[test]
fn one_trail_tells_who_commanded_what() {
    let mut gateway = Gateway::new(&[1]);
    let client = gateway.connect();
    gateway.bench.write(1, 0x6040, 0, &[6, 0]);
    gateway.bench.now = gateway.bench.now + Duration::from_millis(1);
    for target in 1..=3 {
        gateway.write32(client, 0x607A, target);
    }
    let trail = gateway.bench.core.commands(0);
    let told: Vec<_> = trail.iter().map(|c| (c.who, c.address.index, c.raw, c.count)).collect();
    let can = Who::CanOpen(common::LINK);
    assert_eq!(told, [(Who::Modbus(peer(1)), 0x607A, 3, 3), (can, 0x6040, 6, 1)]);
}

#[test]
fn silent_clients_are_a_lost_master() {
    let mut gateway = Gateway::with(&[1], listener(), Some(Duration::from_millis(800)));
    let client = gateway.connect();
    gateway.turn(client);
    gateway.bench.run(Duration::from_millis(100));
    assert_eq!(gateway.state(), State::OperationEnabled);
    gateway.read32(client, 0x6064);
    gateway.notices();
    gateway.bench.run(Duration::from_millis(799));
    assert_eq!(gateway.state(), State::OperationEnabled);
    gateway.bench.run(Duration::from_millis(1));
    // 0x6007 says what then happens: by default a fault.
    assert_ne!(gateway.state(), State::OperationEnabled);
    assert!(gateway.notices().contains(&Notice::ModbusLost));
    // It is told once, and again only after another request.
    gateway.bench.run(Duration::from_secs(10));
    assert!(!gateway.notices().contains(&Notice::ModbusLost));
    gateway.read32(client, 0x6064);
    gateway.bench.run(Duration::from_secs(1));
    assert!(gateway.notices().contains(&Notice::ModbusLost));
}

#[test]
fn silence_means_nothing_before_the_first_request_and_to_an_axis_of_somebody_else() {
    let mut gateway = Gateway::with(&[1], listener(), Some(Duration::from_millis(200)));
    gateway.connect();
    gateway.bench.run(Duration::from_secs(1));
    assert!(!gateway.notices().contains(&Notice::ModbusLost));
    gateway.bench.core.set_owner(0, Some(CAN));
    let client = gateway.connect();
    gateway.read32(client, 0x6064);
    gateway.bench.run(Duration::from_secs(1));
    assert!(!gateway.notices().contains(&Notice::ModbusLost));
}

#[test]
fn a_request_that_was_not_served_does_not_end_the_silence() {
    let mut gateway = Gateway::with(&[1], listener(), Some(Duration::from_millis(200)));
    let client = gateway.connect();
    gateway.read32(client, 0x6064);
    // Half a request, and one for nobody.
    gateway.bench.run(Duration::from_millis(150));
    gateway.ask(client, 99, "03 10 00 00 01");
    gateway.bench.core.receive(gateway.bench.now, client, &[0, 1, 0, 0]);
    gateway.bench.run(Duration::from_millis(50));
    assert!(gateway.notices().contains(&Notice::ModbusLost));
}

#[test]
fn what_is_due_on_a_device_runs_before_a_request_and_its_node_speaks_after_it() {
    let mut gateway = Gateway::new(&[1]);
    let client = gateway.connect();
    gateway.bench.map(1, 0x1800, 0x181, 0x607A_0020);
    gateway.bench.send("000#0101");
    gateway.write32(client, 0x607A, 0x11);
    let sent = gateway.bench.sent_on(common::LINK);
    assert!(sent.contains(&"181#11000000".to_owned()), "{sent:?}");
}
