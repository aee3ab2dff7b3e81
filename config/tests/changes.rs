//! What a new configuration changes while the daemon runs.

use std::path::Path;

use config::{Changes, Gateway};

const TWO: &str = r#"
[[bus]]
name = "can0"
link = "virtual"
socketcand = "127.0.0.1:29536"

[[bus]]
name = "can1"
link = "socketcan:can1"

[[device]]
name = "x"
profile = "cia402-servo"
bus = "can0"
node_id = 1

[[device]]
name = "y"
profile = "jvl-mac00-fc4"
bus = "can1"
node_id = 2
"#;
const Z: &str = "[[device]]\nname = \"z\"\nprofile = \"cia402-servo\"\nbus = \"can0\"\nnode_id = 3\n";
/// A profile of this machine.
const OWN: &str = "name = \"own\"\ndescription = \"d\"\nproduct = \"p\"\nextends = \"cia402-servo\"\n";

fn gateway(text: &str) -> Gateway {
    with_profile(text, OWN)
}

fn with_profile(text: &str, own: &str) -> Gateway {
    let read = |path: &Path| match path.ends_with("own.toml") {
        true => Ok(own.into()),
        false => Err(std::io::ErrorKind::NotFound.into()),
    };
    config::load("axisd.toml", text, &read).unwrap_or_else(|wrong| panic!("{wrong}"))
}

/// The changes from one text to another, in one line.
fn between(old: &str, new: &str) -> String {
    told(&Changes::between(&gateway(old), gateway(new)))
}

fn told(changes: &Changes) -> String {
    let name = |position: &usize| changes.next.devices[*position].name.as_str();
    let mut told: Vec<String> = Vec::new();
    told.extend(changes.buses_removed.iter().map(|bus| format!("-{bus}")));
    told.extend(changes.buses_added.iter().map(|bus| format!("+{}", changes.next.buses[*bus].name)));
    told.extend(changes.removed.iter().map(|name| format!("-{name}")));
    told.extend(changes.replaced.iter().map(|device| format!("*{}", name(device))));
    told.extend(changes.added.iter().map(|device| format!("+{}", name(device))));
    told.extend(changes.adjusted.iter().map(|device| format!("~{}", name(device))));
    let live = [(changes.socketcand, "socketcand"), (changes.modbus, "modbus"), (changes.log, "log")];
    told.extend(live.iter().filter(|(is_changed, _)| *is_changed).map(|(_, what)| (*what).to_owned()));
    told.extend(changes.restart.iter().map(|key| format!("{key}!")));
    assert_eq!(changes.is_empty(), told.is_empty());
    told.join(" ")
}

#[test]
fn what_is_written_otherwise_is_no_change() {
    assert_eq!(between(TWO, TWO), "");
    let (buses, devices) = TWO.split_at(TWO.find("[[device]]").unwrap());
    let (x, y) = devices.split_at(devices.rfind("[[device]]").unwrap());
    let other = format!("# a comment\n{buses}{y}{x}").replace("node_id = 1", "node_id = 0x01 # one");
    assert_eq!(between(TWO, &other), "", "order, comments and spelling");
    // The buses have other positions now.
    let swapped =
        format!("{}{}", &buses[buses.rfind("[[bus]]").unwrap()..], &buses[..buses.rfind("[[bus]]").unwrap()]);
    assert_eq!(between(TWO, &format!("{swapped}{devices}")), "");
    assert_eq!(
        between(TWO, &TWO.replacen("link = \"virtual\"", "link = \"virtual\"\nbit_rate_kbit_s = 500", 1)),
        ""
    );
}

#[test]
fn devices_are_known_by_their_names() {
    assert_eq!(between(TWO, &format!("{TWO}{Z}")), "+z");
    assert_eq!(between(&format!("{TWO}{Z}"), TWO), "-z");
    assert_eq!(between(TWO, &TWO.replace("\"x\"", "\"w\"")), "-x +w");
}

#[test]
fn a_device_that_is_built_otherwise_is_replaced() {
    let others = [
        ("node_id = 1", "node_id = 4"),
        ("profile = \"cia402-servo\"", "profile = \"canopen-reference\""),
        ("bus = \"can0\"", "bus = \"can1\""),
        (
            "node_id = 1\n",
            "[[device.on]]\nbus = \"can0\"\nnode_id = 1\n[[device.on]]\nbus = \"can1\"\nnode_id = 1\n",
        ),
        ("node_id = 1", "node_id = 1\nsdo_timeout_ms = 500"),
        ("node_id = 1", "node_id = 1\n[device.identity]\nserial = 7"),
        ("node_id = 1", "node_id = 1\n[device.identity]\nrevision = 7"),
        ("node_id = 1", "node_id = 1\n[device.objects]\n\"0x6081\" = 5"),
        ("node_id = 1", "node_id = 1\n[device.limits]\nmax_profile_velocity = 5"),
        ("node_id = 1", "node_id = 1\n[device.plant]\nsupply_v = 40.0"),
        ("node_id = 1", "node_id = 1\n[device.motor_data]\nrated_torque_nm = 0.1"),
    ];
    for (old, new) in others {
        let mut text = TWO.replacen(old, new, 1);
        if new.contains("device.on") {
            text = text.replacen("bus = \"can0\"\n[[device.on]]", "[[device.on]]", 1);
        }
        assert_eq!(between(TWO, &text), "*x", "{new}");
    }
    let text = TWO.replacen("node_id = 2", "node_id = 2\ntiming = \"authentic\"", 1);
    assert_eq!(between(TWO, &text), "*y");
}

#[test]
fn another_text_of_its_profile_file_makes_another_device() {
    let text = TWO.replacen("cia402-servo", "./own.toml", 1);
    let old = gateway(&text);
    assert_eq!(told(&Changes::between(&old, gateway(&text))), "");
    let own = format!("vendor = \"somebody\"\n{OWN}");
    assert_eq!(told(&Changes::between(&old, with_profile(&text, &own))), "*x");
}

#[test]
fn a_bus_that_is_reached_otherwise_goes_and_comes_and_so_do_its_devices() {
    let other = TWO.replace("socketcan:can1", "socketcan:can7");
    assert_eq!(between(TWO, &other), "-can1 +can1 *y");
    let renamed = TWO.replace("\"can1\"", "\"line\"");
    assert_eq!(between(TWO, &renamed), "-can1 +line *y");
    let more = format!("{TWO}[[bus]]\nname = \"can2\"\nlink = \"virtual\"\n");
    assert_eq!(between(TWO, &more), "+can2");
    assert_eq!(between(&more, TWO), "-can2");
}

#[test]
fn who_joins_a_bus_by_socketcand_is_of_no_concern_to_its_devices() {
    assert_eq!(between(TWO, &TWO.replace(":29536", ":29537")), "socketcand");
    assert_eq!(between(TWO, &TWO.replace("socketcand = \"127.0.0.1:29536\"", "")), "socketcand");
}

#[test]
fn how_a_device_looks_to_modbus_clients_changes_while_it_runs() {
    let modbus = |more: &str| format!("[modbus]\nlisten = \"127.0.0.1:1502\"\n{more}{TWO}");
    assert_eq!(between(TWO, &modbus("")), "~x ~y modbus");
    assert_eq!(between(&modbus(""), TWO), "~x ~y modbus");
    assert_eq!(between(&modbus(""), &modbus("allow = \"10.0.0.0/8\"\n")), "modbus");
    assert_eq!(between(&modbus("device = \"x\"\n"), &modbus("device = \"y\"\n")), "modbus");
    let x = |more: &str| modbus("").replacen("node_id = 1", &format!("node_id = 1\n{more}"), 1);
    for more in
        ["unit_id = 9", "word_order = \"high-first\"", "modbus_timeout_ms = 500", "owner = \"modbus\""]
    {
        assert_eq!(between(&modbus(""), &x(more)), "~x", "{more}");
    }
    assert_eq!(between(&x("owner = \"modbus\""), &x("owner = \"can0\"")), "~x");
    assert_eq!(between(&modbus(""), &x("[device.modbus]\nlisten = \"127.0.0.1:1503\"")), "modbus");
    // The only device there is stands for units 0 and 255.
    let one = &TWO[..TWO.rfind("[[device]]").unwrap()];
    let listen = "[modbus]\nlisten = \"127.0.0.1:1502\"\n";
    assert_eq!(between(&format!("{listen}{one}"), &format!("{listen}{TWO}")), "+y modbus");
}

#[test]
fn what_needs_a_restart_is_told_and_stays_as_it_is() {
    let more = format!(
        "[log]\nformat = \"json\"\nlevel = \"debug\"\n[realtime]\npriority = 5\n[metrics]\nlisten = \"127.0.0.1:9464\"\n\
         [audit]\nenabled = false\n[storage]\npath = \"/s\"\n[control]\nsocket = \"/c\"\n{TWO}{Z}"
    );
    let (old, new) = (gateway(TWO), gateway(&more));

    let changes = Changes::between(&old, new.clone());

    assert_eq!(told(&changes), "+z log storage! control! log.format! realtime! metrics! audit!");
    let Gateway { storage, control, service, .. } = &changes.next;
    assert_eq!((storage, control, service.metrics), (&None, &None, None));
    assert_eq!((&service.realtime, &service.audit), (&old.service.realtime, &old.service.audit));
    assert_eq!(service.log.level, config::Level::Debug, "that is taken");
    assert_eq!(service.log.format, old.service.log.format);
    // It is told each time, until there is a restart or the file is as it was.
    let again = Changes::between(&changes.next, new);
    assert_eq!(told(&again), "storage! control! log.format! realtime! metrics! audit!");
    assert_eq!(
        told(&Changes::between(&changes.next, gateway(&format!("[log]\nlevel = \"debug\"\n{TWO}{Z}")))),
        ""
    );
}

#[test]
fn gateways_stay_as_they_are_until_a_restart() {
    let with = |keys: &str| gateway(&TWO.replacen("link = ", &format!("{keys}link = "), 1));
    let (none, one, other) = (with(""), with("gateway = \"/a\"\n"), with("gateway = \"/b\"\n"));
    for (old, new) in [(&none, &one), (&one, &none), (&one, &other)] {
        let changes = Changes::between(old, new.clone());
        assert_eq!(told(&changes), "bus.gateway!");
        assert_eq!(changes.next.buses[0].gateway, old.buses[0].gateway);
        assert_eq!(told(&Changes::between(&changes.next, new.clone())), "bus.gateway!");
    }
    assert_eq!(told(&Changes::between(&one, one.clone())), "");
    let mut otherwise = one.clone();
    otherwise.buses[0].link = config::Link::SocketCan("vcan9".to_owned());
    let changes = Changes::between(&one, otherwise);
    assert!(told(&changes).contains("bus.gateway!"), "{}", told(&changes));
    assert_eq!(changes.next.buses[0].gateway, None, "it is another bus");
}
