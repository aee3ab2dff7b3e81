//! Gateway files as a whole.

use std::fs;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use config::{
    Attachment, Diagnostics, Endpoint, Gateway, Link, Listener, ModbusDialect, Network, Owner, WhenFull,
    WordOrder, load,
};
use profiles::{
    Input, NoiseSetup, PlantFault, PlantSetup, Position, PositionRange, ScheduledFault, SupplySetup, Timing,
    Velocity, Voltage,
};
use proptest::prelude::*;

/// A machine with one broken and one good profile file of its own.
fn read(path: &Path) -> io::Result<Vec<u8>> {
    let own =
        include_str!("../../profiles/devices/cia402-servo.toml").replace("CiA 402 servo drive", "My drive");
    match path.to_str() {
        Some("/gateway/devices/broken.toml") => Ok("name = \"broken\"\nmotor = 1\n".into()),
        Some("/gateway/my-drive.toml" | "/etc/axisd/devices/cia402-servo.toml") => Ok(own.into()),
        _ => Err(io::ErrorKind::NotFound.into()),
    }
}

fn load_text(text: &str) -> Result<Gateway, Diagnostics> {
    load("/gateway/gateway.toml", text, &read)
}

/// On a machine without profile files.
fn load_plainly(text: &str) -> Gateway {
    load("gateway.toml", text, &|_| Err(io::ErrorKind::NotFound.into())).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn everything_that_is_wrong_with_a_file_is_reported_at_once() {
    insta::assert_snapshot!(load_text(include_str!("bad.toml")).unwrap_err());
}

#[test]
fn a_text_that_is_no_toml_is_one_finding_with_its_position() {
    let wrong = load_text("[[bus]]\nname = \"can0\"\nlink = virtual\n").unwrap_err();
    assert_eq!(wrong.0.len(), 1);
    assert_eq!((wrong.0[0].line, wrong.0[0].column), (3, 8));
}

#[test]
fn the_demo_has_two_motors_on_a_virtual_bus() {
    let gateway = load_plainly(config::DEMO);
    assert_eq!(gateway.buses.len(), 1);
    assert_eq!(gateway.buses[0].link, Link::Virtual);
    assert_eq!(gateway.buses[0].socketcand, Some("127.0.0.1:29536".parse().unwrap()));
    let devices: Vec<_> = gateway.devices.iter().map(|d| (d.name.as_str(), d.on.as_slice())).collect();
    let on = |node_id| [Attachment { bus: 0, node_id }];
    assert_eq!(devices, [("axis1", on(1).as_slice()), ("axis2", on(2).as_slice())]);
}

#[test]
fn every_example_loads() {
    let vcan0 = load_plainly(include_str!("../examples/vcan0.toml"));
    assert_eq!(vcan0.buses[0].link, Link::SocketCan("vcan0".to_owned()));
    assert_eq!(vcan0.devices[1].profile.motor.as_ref().unwrap().name, "mac800");
    let reference = load_plainly(include_str!("../examples/reference.toml"));
    assert_eq!(reference.devices[0].profile.axes(), 0);
    let two = load_plainly(include_str!("../examples/two-buses.toml"));
    let clamp = [Attachment { bus: 0, node_id: 5 }, Attachment { bus: 1, node_id: 5 }];
    assert_eq!(two.devices[2].on, clamp);
    let modules = load_plainly(include_str!("../examples/jvl-modules.toml"));
    let node_ids: Vec<u8> = modules.devices.iter().map(|device| device.on[0].node_id).collect();
    assert_eq!((node_ids, modules.buses[0].bit_rate_kbit_s), (vec![5, 12], Some(500)));
    assert!(modules.devices.iter().all(|device| device.timing == Timing::Authentic));
    let lines = load_plainly(include_str!("../examples/ascii-gateway.toml"));
    assert_eq!(lines.buses[0].gateway, Some(Endpoint::Tcp("127.0.0.1:6001".parse().unwrap())));
}

#[test]
fn every_file_among_the_examples_is_good_where_it_lies() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let files = fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    let mut count = 0;
    for file in files.filter(|file| file.extension().is_some_and(|ending| ending == "toml")) {
        let text = fs::read_to_string(&file).unwrap();
        let gateway = load(file.to_str().unwrap(), &text, &|path| fs::read(path));
        let gateway = gateway.unwrap_or_else(|wrong| panic!("{wrong}"));
        assert!(gateway.warnings.0.is_empty(), "{}", gateway.warnings);
        count += 1;
    }
    assert!(count > 9, "only {count} files");
}

#[test]
fn the_example_of_a_data_sheet_serves_its_objects_beside_an_axis() {
    let sheet = include_str!("../examples/io-module.eds");
    let read = |path: &Path| match path.to_str() {
        Some("/gateway/io-module.eds") => Ok(sheet.into()),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    let text = include_str!("../examples/data-sheet.toml");
    let gateway = load("/gateway/gateway.toml", text, &read).unwrap();
    let io = &gateway.devices[1];
    assert_eq!((io.profile.axes(), io.on[0].node_id), (0, 12));
    let device = profiles::Device::new(Arc::clone(&io.profile), 12, od::Instant::ZERO);
    let inputs = device.dictionary().find(od::Address::new(0x6000, 1)).unwrap();
    assert_eq!(device.dictionary().raw(inputs), 0b101);
    let tpdo = &io.profile.communication;
    let mapping = tpdo.find(od::Address::new(0x1A00, 1)).unwrap();
    assert_eq!(od::Dictionary::new(Arc::clone(tpdo), 12).raw(mapping), 0x6000_0108);
}

#[test]
fn devices_with_the_same_profile_and_motor_share_it() {
    let gateway = load_plainly(
        r#"
        device = [
            { name = "a", profile = "jvl-mac00-fc4", unit_id = 1 },
            { name = "b", profile = "jvl-mac00-fc4", unit_id = 2, motor = "mac140" },
            { name = "c", profile = "jvl-mac00-fc4", unit_id = 3, motor = "mac050" },
            { name = "d", profile = "jvl-mac00-fc4", unit_id = 4, motor = "mac050" },
        ]
        "#,
    );
    let share = |a: usize, b: usize| Arc::ptr_eq(&gateway.devices[a].profile, &gateway.devices[b].profile);
    assert!(share(0, 1) && share(2, 3) && !share(0, 2));
}

#[test]
fn a_profile_file_of_this_machine_comes_before_the_shipped_one() {
    let gateway = load_text(
        r#"
        device = [
            { name = "a", profile = "cia402-servo", unit_id = 1 },
            { name = "b", profile = "my-drive.toml", unit_id = 2 },
            { name = "c", profile = "jvl-mac00-fc4", unit_id = 3 },
        ]
        "#,
    );
    let products: Vec<_> = gateway.unwrap().devices.iter().map(|d| d.profile.product.clone()).collect();
    assert_eq!(products, ["My drive", "My drive", "MAC00-FC4"]);
}

#[test]
fn a_unit_id_is_by_default_the_node_id_and_only_modbus_needs_them_to_differ() {
    let text = r#"
        bus = [{ name = "x", link = "virtual" }, { name = "y", link = "virtual" }]
        device = [
            { name = "a", profile = "cia402-servo", bus = "x", node_id = 9 },
            { name = "b", profile = "cia402-servo", bus = "y", node_id = 9 },
        ]
        "#;
    let units: Vec<_> = load_plainly(text).devices.iter().map(|d| d.unit_id).collect();
    assert_eq!(units, [Some(9), Some(9)]);
    let wrong = load_text(&format!("{text}\nmodbus = {{ listen = \"0.0.0.0:502\" }}")).unwrap_err();
    assert_eq!(wrong.0.len(), 1);
    assert_eq!(wrong.0[0].message, "Modbus unit 9 is device `a` already");
}

#[test]
fn a_node_without_a_node_id_has_255_and_several_may_have_none() {
    let text = r#"
        bus = [{ name = "x", link = "virtual" }]
        device = [
            { name = "a", profile = "cia402-servo", bus = "x", node_id = 255 },
            { name = "b", profile = "cia402-servo", bus = "x", node_id = 255, identity = { serial = 7 } },
        ]
        "#;
    let devices = load_plainly(text).devices;
    assert!(devices.iter().all(|d| d.on == [Attachment { bus: 0, node_id: config::UNCONFIGURED }]));
    assert_eq!(devices.iter().map(|d| d.unit_id).collect::<Vec<_>>(), [None, None]);
    assert_eq!(devices[0].serial, Some(0xE40C_292C), "FNV-1a of the name");
    assert_eq!(devices[1].serial, None, "the profile has it");
    let wrong = load_text(&text.replace("255", "128")).unwrap_err();
    assert_eq!(wrong.0[0].message, "128 is no Node-ID");
}

#[test]
fn modbus_clients_are_64_of_anybody_unless_the_file_says_otherwise() {
    let plain = &load_plainly("[modbus]\nlisten = \"0.0.0.0:502\"\n").modbus[..];
    let expected = Listener {
        listen: vec!["0.0.0.0:502".parse().unwrap()],
        max_clients: 64,
        when_full: WhenFull::Refuse,
        idle_timeout: None,
        allow: vec![],
        read_only: vec![],
        write: vec![],
        device: None,
        is_own: false,
    };
    assert_eq!(plain, [expected]);
}

#[test]
fn modbus_has_limits_for_clients_and_what_they_write() {
    let gateway = load_plainly(include_str!("../examples/modbus.toml"));
    let network = |text: &str| text.parse::<Network>().unwrap();
    let common = &gateway.modbus[0];
    assert_eq!(common.listen, ["0.0.0.0:502", "[::]:502"].map(|address| address.parse().unwrap()));
    assert_eq!((common.max_clients, common.when_full), (16, WhenFull::Refuse));
    assert_eq!(common.idle_timeout, Some(Duration::from_secs(300)));
    assert_eq!(common.allow, [network("192.168.1.0/24"), network("127.0.0.1/32")]);
    assert_eq!(common.read_only, [network("192.168.1.128/25")]);
    assert_eq!(common.write, [0x1000..=0x1FFF, 0x8000..=0x807F]);
    assert_eq!((common.device, common.is_own), (Some(0), false));
    let own = &gateway.modbus[1];
    assert_eq!((own.device, own.is_own), (Some(1), true));
    assert_eq!((own.max_clients, own.when_full), (1, WhenFull::Replace));
    let [servo, motor] = &gateway.devices[..] else { panic!("two devices") };
    assert_eq!((servo.unit_id, motor.unit_id), (Some(1), Some(7)));
    assert_eq!((servo.modbus.dialect, motor.modbus.dialect), (ModbusDialect::Full, ModbusDialect::Jvl));
    assert_eq!(
        (servo.modbus.word_order, motor.modbus.word_order),
        (WordOrder::HighFirst, WordOrder::LowFirst)
    );
    assert_eq!((servo.modbus.timeout, motor.modbus.timeout), (Some(Duration::from_millis(500)), None));
    assert_eq!((servo.owner, motor.owner), (Some(Owner::Bus(0)), Some(Owner::Modbus)));
}

#[test]
fn units_0_and_255_are_the_only_device_or_the_one_that_is_named() {
    let device = |name: &str, unit: u8| {
        format!("[[device]]\nname = \"{name}\"\nprofile = \"cia402-servo\"\nunit_id = {unit}\n")
    };
    let default = |text: String| load_plainly(&text).modbus[0].device;
    let modbus = |more: &str| format!("[modbus]\nlisten = \"0.0.0.0:502\"\n{more}");
    assert_eq!(default(modbus("") + &device("a", 1)), Some(0));
    assert_eq!(default(modbus("") + &device("a", 1) + &device("b", 2)), None);
    assert_eq!(default(modbus("device = \"b\"\n") + &device("a", 1) + &device("b", 2)), Some(1));
}

#[test]
fn a_listener_of_its_own_is_enough_to_reach_a_device() {
    let text =
        "[[device]]\nname = \"a\"\nprofile = \"cia402-servo\"\nmodbus = { listen = \"0.0.0.0:502\" }\n";
    let gateway = load_plainly(text);
    assert_eq!((gateway.devices[0].unit_id, gateway.modbus[0].device), (None, Some(0)));
}

#[test]
fn an_owner_is_a_bus_of_the_device_or_modbus_or_anybody() {
    let text = |owner: &str| {
        format!(
            "bus = [{{ name = \"x\", link = \"virtual\" }}, {{ name = \"y\", link = \"virtual\" }}]\n\
             [[device]]\nname = \"a\"\nprofile = \"cia402-servo\"\nbus = \"x\"\nnode_id = 1\nowner = \"{owner}\"\n"
        )
    };
    let owner = |name: &str| load_text(&text(name)).map(|gateway| gateway.devices[0].owner);
    assert_eq!(owner("any").unwrap(), None);
    assert_eq!(owner("x").unwrap(), Some(Owner::Bus(0)));
    assert_eq!(owner("y").unwrap_err().0[0].help.as_deref(), Some("did you mean `x`? known: any, modbus, x"));
    assert_eq!(owner("modbus").unwrap_err().0[0].message, "no Modbus client reaches this device");
}

#[test]
fn the_control_socket_may_have_a_place_of_its_own() {
    let gateway = load_plainly("[control]\nsocket = \"/run/axisd/line-1.sock\"\n");
    assert_eq!(gateway.control, Some("/run/axisd/line-1.sock".into()));
    assert_eq!(load_plainly("").control, None);
    let wrong = load_text("[control]\nsocket = \"\"\n").unwrap_err();
    assert_eq!(wrong.0[0].message, "the control socket needs a path");
    assert_eq!((wrong.0[0].line, wrong.0[0].column), (2, 10));
}

#[test]
fn a_device_may_wait_longer_or_shorter_for_its_sdo_clients() {
    let text =
        |more: &str| format!("[[device]]\nname = \"a\"\nprofile = \"cia402-servo\"\nunit_id = 1\n{more}");
    let time_out = |more: &str| load_plainly(&text(more)).devices[0].sdo_timeout;
    assert_eq!(time_out(""), None);
    assert_eq!(time_out("sdo_timeout_ms = 10\n"), Some(Duration::from_millis(10)));
    assert_eq!(time_out("sdo_timeout_ms = 600_000\n"), Some(Duration::from_secs(600)));
    for value in ["9", "600_001", "-1", "0.5", "\"1s\""] {
        let wrong = load_text(&text(&format!("sdo_timeout_ms = {value}\n"))).unwrap_err();
        assert_eq!((wrong.0.len(), wrong.0[0].line, wrong.0[0].column), (1, 5, 18), "{value}");
        assert_eq!(wrong.0[0].help.as_deref(), Some("write a number from 10 to 600000"), "{value}");
    }
}

/// A module with these switches on.
fn module(more: &str) -> String {
    format!(
        "[[bus]]\nname = \"can0\"\nlink = \"virtual\"\n\n\
         [[device]]\nname = \"a\"\nprofile = \"jvl-mac00-fc4\"\nbus = \"can0\"\n{more}"
    )
}

#[test]
fn the_switches_of_jvls_modules_say_node_id_and_bit_rate_as_in_the_manual() {
    // The rows of the manual's tables: Node-ID and switches 7 to 1, bit rate and switches 10 to 8.
    let node_ids = [
        (1, "0000001"),
        (2, "0000010"),
        (31, "0011111"),
        (32, "0100000"),
        (63, "0111111"),
        (64, "1000000"),
        (96, "1100000"),
        (111, "1101111"),
        (126, "1111110"),
    ];
    let bit_rates = [
        (1000, "000"),
        (500, "001"),
        (250, "010"),
        (125, "011"),
        (100, "100"),
        (50, "101"),
        (20, "110"),
        (10, "111"),
    ];
    for (node_id, low) in node_ids {
        for (bit_rate, high) in bit_rates {
            let switches = format!("{high}{low}");
            let on = switches.bytes().rev().zip(1..).filter(|(state, _)| *state == b'1');
            let numbers: Vec<String> = on.map(|(_, number): (u8, u8)| number.to_string()).collect();
            let gateway = load_plainly(&module(&format!("switches = [{}]\n", numbers.join(", "))));
            assert_eq!(gateway.devices[0].on, [Attachment { bus: 0, node_id }]);
            assert_eq!(gateway.buses[0].bit_rate_kbit_s, Some(bit_rate));
        }
    }
}

#[test]
fn with_switches_1_to_7_on_the_node_id_is_the_address_of_the_motor() {
    for address in [1, 12, 127] {
        let switches = format!("switches = [7, 6, 5, 4, 3, 2, 1, 9]\nmotor_address = {address}\n");
        let gateway = load_plainly(&module(&switches));
        assert_eq!(gateway.devices[0].on, [Attachment { bus: 0, node_id: address }]);
        assert_eq!(gateway.devices[0].unit_id, Some(address));
        assert_eq!(gateway.buses[0].bit_rate_kbit_s, Some(250));
    }
}

#[test]
fn a_bus_has_one_bit_rate() {
    let plain = load_plainly(&module("node_id = 1\n"));
    assert_eq!(plain.buses[0].bit_rate_kbit_s, None);
    let rate = |more: &str| {
        let text = module("switches = [1, 8]\n").replace("link", &format!("{more}\nlink"));
        load_text(&text).map(|gateway| gateway.buses[0].bit_rate_kbit_s)
    };
    assert_eq!(rate("bit_rate_kbit_s = 500"), Ok(Some(500)));
    let wrong = rate("bit_rate_kbit_s = 800").unwrap_err();
    assert_eq!(wrong.0[0].message, "the switches say 500 kbit/s, the bus says 800");
    assert_eq!((wrong.0.len(), wrong.0[0].line, wrong.0[0].column), (1, 10, 1));
}

#[test]
fn a_jvl_device_takes_its_time_if_it_is_told_to() {
    let timing = |more: &str| load_plainly(&module(&format!("node_id = 1\n{more}"))).devices[0].timing;
    assert_eq!(timing(""), Timing::Immediate);
    assert_eq!(timing("timing = \"immediate\"\n"), Timing::Immediate);
    assert_eq!(timing("timing = \"authentic\"\n"), Timing::Authentic);
    let device = "[[device]]\nname = \"a\"\nprofile = \"cia402-servo\"\nunit_id = 1\n";
    let wrong = load_text(&format!("{device}timing = \"authentic\"\n")).unwrap_err();
    assert_eq!(wrong.0[0].message, "`cia402-servo` has no processing times");
    assert_eq!((wrong.0.len(), wrong.0[0].line, wrong.0[0].column), (1, 5, 1));
}

#[test]
fn a_machine_may_have_a_plant_of_its_own_and_faults_in_it() {
    let machine = load_plainly(include_str!("../examples/machine.toml"));
    let range = |min, max| PositionRange::new(Position(min), Position(max));
    let fault = |text: &str, from_seconds, until_seconds| {
        let PlantFault(fault) = text.parse().unwrap();
        ScheduledFault { fault, from_seconds, until_seconds: Some(until_seconds) }
    };
    let expected = PlantSetup {
        load_inertia_kg_m2: Some(4e-5),
        load_torque_nm: Some(0.0),
        friction_nm: Some(0.02),
        viscous_friction_nms: Some(1e-5),
        backlash: Some(Position(6.0)),
        start: Some(Position(2000.0)),
        index: Some(Position(100.0)),
        positive_limit: Some(Position(50_000.0)),
        negative_limit: Some(Position(-50_000.0)),
        limit_switch_width: Some(Position(20_000.0)),
        home: range(-500.0, 500.0),
        hysteresis: Some(Position(20.0)),
        stops: range(-60_000.0, 60_000.0),
        active_low: Vec::new(),
        analog_input: Some(Voltage(2.5)),
        external_encoder: Some(Velocity(-1000.0)),
        supply: SupplySetup {
            voltage: Some(Voltage(48.0)),
            under_voltage: Some(Voltage(20.0)),
            over_voltage: Some(Voltage(75.0)),
            chopper: Some(Voltage(60.0)),
            capacitance_f: None,
        },
        noise: NoiseSetup { encoder: Some(1.0), velocity: Some(50.0), seed: Some(1) },
        faults: vec![
            fault("supply-dip:10", 60.0, 70.0),
            fault("stuck-switch:positive-limit=high", 120.0, 130.0),
        ],
    };
    assert_eq!(machine.devices[0].plant, expected);
    assert_eq!(load_plainly(config::DEMO).devices[0].plant, PlantSetup::default());
}

#[test]
fn wires_may_be_low_while_actuated_and_faults_may_stay() {
    let device = "[[device]]\nname = \"a\"\nprofile = \"cia402-servo\"\nunit_id = 1\n";
    let plant = "active_low = [\"home\", \"emergency-stop\"]\n\
                 dc_link_capacitance_f = 1\n\
                 faults = [{ what = \"encoder-break\", from_s = 0.5 }]\n";
    let plant = load_plainly(&format!("{device}[device.plant]\n{plant}")).devices[0].plant.clone();
    assert_eq!(plant.active_low, [Input::Home, Input::EmergencyStop]);
    assert_eq!(plant.supply.capacitance_f, Some(1.0));
    assert_eq!((plant.faults[0].from_seconds, plant.faults[0].until_seconds), (0.5, None));
}

#[test]
fn devices_store_in_a_directory_if_there_is_one() {
    let gateway = load_plainly("[storage]\npath = \"/var/lib/axisd\"\n");
    assert_eq!(gateway.storage, Some("/var/lib/axisd".into()));
    assert_eq!(load_plainly("").storage, None);
    let wrong = load_text("[storage]\npath = \"\"\n").unwrap_err();
    assert_eq!(wrong.0[0].message, "the storage needs a directory");
}

#[test]
fn a_device_may_have_an_identity_of_its_own() {
    let device = |more: &str| {
        let head = "[[device]]\nname = \"x\"\nprofile = \"cia402-servo\"\nunit_id = 1\n";
        format!("{head}{more}")
    };
    let own = load_plainly(&device("[device.identity]\nvendor_id = 0x1234\nserial = 77\n"));
    let plain = load_plainly(&device(""));
    let identity = |gateway: &Gateway| [1, 2, 3, 4].map(|sub| gateway.devices[0].profile.identity(sub));
    let [_, product, revision, _] = identity(&plain);
    assert_eq!(identity(&own), [0x1234, product, revision, 77]);
    assert!(
        own.devices[0].profile.eds().contains("VendorNumber=0x00001234"),
        "{}",
        own.devices[0].profile.eds()
    );
    let wrong = load_text(&device("[device.identity]\nvendor_id = -1\n")).unwrap_err();
    assert_eq!((wrong.0[0].line, wrong.0[0].column), (6, 13));
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused(text in any::<String>()) {
        let _ = load_text(&text);
    }

    #[test]
    fn any_change_to_a_valid_file_is_read_or_refused(
        text in prop::sample::select(&[
            include_str!("../examples/two-buses.toml"),
            include_str!("../examples/machine.toml"),
            include_str!("../examples/jvl-modules.toml"),
            include_str!("../examples/modbus.toml"),
            include_str!("../examples/service.toml"),
        ]),
        from in 0.0..1.0, length in 0..30_usize, instead in "[ -~\\n]{0,8}",
    ) {
        let start = (text.len() as f64 * from) as usize;
        let end = (start + length).min(text.len());
        if let Err(wrong) = load_text(&[&text[..start], &instead, &text[end..]].concat()) {
            prop_assert!(!wrong.0.is_empty());
        }
    }
}

#[test]
fn a_gateway_is_at_an_address_or_at_a_path() {
    let bus =
        |gateway: &str| format!("[[bus]]\nname = \"can0\"\nlink = \"virtual\"\ngateway = \"{gateway}\"\n");
    let endpoint = |gateway: &str| load_plainly(&bus(gateway)).buses.remove(0).gateway.unwrap();
    assert_eq!(endpoint("127.0.0.1:6001"), Endpoint::Tcp("127.0.0.1:6001".parse().unwrap()));
    assert_eq!(endpoint("/run/axisd/can0.gateway"), Endpoint::Unix("/run/axisd/can0.gateway".into()));
    let wrong = load_text(&bus("can0.gateway")).unwrap_err().to_string();
    assert!(wrong.contains(":4:11: error: `can0.gateway` is no socket address"), "{wrong}");
    assert!(
        wrong.contains("such as \"127.0.0.1:6001\", or a path such as \"/run/axisd/can0.gateway\""),
        "{wrong}"
    );
}
