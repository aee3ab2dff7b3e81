//! What a device has otherwise than its profile, and what concerns the daemon itself.

use std::io;
use std::path::Path;

use config::{Audit, Diagnostics, Gateway, Level, Log, LogFormat, Realtime, load};
use od::{Address, Dictionary};

fn load_text(text: &str) -> Result<Gateway, Diagnostics> {
    load("gateway.toml", text, &|_: &Path| Err(io::ErrorKind::NotFound.into()))
}

fn load_plainly(text: &str) -> Gateway {
    load_text(text).unwrap_or_else(|e| panic!("{e}"))
}

/// A device of this profile, with more lines.
fn device(profile: &str, more: &str) -> String {
    format!("[[device]]\nname = \"x\"\nprofile = \"{profile}\"\nunit_id = 1\n{more}")
}

/// The power-on value of an entry of node 5.
fn power_on(gateway: &Gateway, index: u16, sub: u8) -> i128 {
    let profile = &gateway.devices[0].profile;
    let schema = if index < 0x2000 { &profile.communication } else { &profile.application };
    let dictionary = Dictionary::new(schema.clone(), 5);
    let slot = dictionary.find(Address::new(index, sub)).unwrap();
    dictionary.integer(slot)
}

/// Line, column, message and help of the only finding.
fn finding(text: &str) -> (usize, usize, String, Option<String>) {
    let Diagnostics(found) = load_text(text).unwrap_err();
    assert_eq!(found.len(), 1, "{found:?}");
    (found[0].line, found[0].column, found[0].message.clone(), found[0].help.clone())
}

#[test]
fn a_device_starts_with_the_values_that_its_table_of_objects_gives() {
    let gateway = load_plainly(include_str!("../examples/service.toml"));
    assert_eq!(power_on(&gateway, 0x6081, 0), 20_000);
    assert_eq!(power_on(&gateway, 0x1017, 0), 500);
    assert_eq!(power_on(&gateway, 0x6099, 1), 4096);
    assert_eq!(power_on(&gateway, 0x1400, 1), 0x205, "it follows the Node-ID");
    let own: Vec<_> = gateway.devices[0].defaults.iter().map(|own| own.address.to_string()).collect();
    assert_eq!(own.len(), 13);
    assert_eq!(own[..3], ["0x1017:00", "0x1400:01", "0x6072:00"]);
    assert!(gateway.devices[0].profile.eds().contains("DefaultValue=0x4E20"));
}

#[test]
fn limits_go_to_the_objects_that_hold_them_and_an_object_comes_before_a_limit() {
    let limits = "[device.limits]\nmin_position = -7\nmax_position = 8\nmax_motor_speed_rpm = 99\n";
    let gateway = load_plainly(&device("jvl-mac00-fc4", limits));
    assert_eq!([power_on(&gateway, 0x607D, 1), power_on(&gateway, 0x607D, 2)], [-7, 8]);
    assert_eq!(power_on(&gateway, 0x6080, 0), 99);
    let both = format!("{limits}[device.objects]\n\"0x607D:02\" = 9\n");
    let gateway = load_plainly(&device("jvl-mac00-fc4", &both));
    assert_eq!([power_on(&gateway, 0x607D, 1), power_on(&gateway, 0x607D, 2)], [-7, 9]);
    let (line, column, message, _) =
        finding(&device("jvl-mac00-fc4", "[device.limits]\nmax_acceleration = 5\n"));
    assert_eq!((line, column), (6, 1));
    assert_eq!(message, "the profile jvl-mac00-fc4 has no such limit");
}

#[test]
fn defaults_that_follow_from_the_motor_follow_its_own_data() {
    let gateway = load_plainly(&device("cia402-servo", "[device.motor_data]\nmax_speed_rpm = 1234\n"));
    let motor = gateway.devices[0].profile.motor.clone().unwrap();
    assert_eq!(motor.max_speed_rpm, 1234);
    assert_eq!(power_on(&gateway, 0x6080, 0), 1234);
    let plain = load_plainly(&device("cia402-servo", "")).devices[0].profile.motor.clone().unwrap();
    assert_eq!(motor.rated_torque_nm.to_bits(), plain.rated_torque_nm.to_bits());
    let (line, column, message, help) =
        finding(&device("cia402-servo", "[device.motor_data]\nraster_ns = 0\n"));
    assert_eq!((line, column, &*message), (6, 13, "`raster_ns` cannot be 0"));
    assert_eq!(help.unwrap(), "write a number from 1 to 1000000000");
    let (_, _, message, _) = finding(&device("canopen-reference", "[device.motor_data]\nraster_ns = 1\n"));
    assert_eq!(message, "a device without an axis has no motor");
}

#[test]
fn a_value_that_the_write_gate_would_refuse_is_refused_with_its_position() {
    let wrong = |line: &str| {
        let (number, column, message, help) =
            finding(&device("cia402-servo", &format!("[device.objects]\n{line}\n")));
        assert_eq!(number, 6, "{line}");
        (column, message, help.unwrap_or_default())
    };
    let told = |column, message: &str, help: &str| (column, message.to_owned(), help.to_owned());
    assert_eq!(
        wrong("\"0x6081:00\" = -1"),
        told(15, "this is no value of U32", "write an integer from 0 to 4294967295")
    );
    assert_eq!(
        wrong("\"0x6041\" = 1"),
        told(
            12,
            "0x6041:00 (Statusword) takes no default from here",
            "only what a bus may write has a default of its own"
        )
    );
    assert_eq!(
        wrong("Controlword = 15"),
        told(
            15,
            "0x6040:00 (Controlword) takes no default from here",
            "a controlword is an order of the moment"
        )
    );
    assert_eq!(
        wrong("\"0x6060:00\" = 5"),
        told(15, "0x6060:00 (Modes of operation) does not take this: invalid value for parameter", "")
    );
    assert_eq!(wrong("\"Profile velocty\" = 1").2, "did you mean `Profile velocity`?");
    let twice = device("cia402-servo", "[device.objects]\n\"0x6081\" = 1\n\"0x6081:00\" = 2\n");
    assert_eq!(finding(&twice).2, "0x6081:00 has a value already");
    assert_eq!(wrong("\"0x6081\" = [1]").1, "`0x6081` cannot be an array");
}

#[test]
fn what_concerns_the_daemon_is_read_in_full() {
    let service = load_plainly(include_str!("../examples/service.toml")).service;
    let modules = config::LOG_MODULES.map(|module| (module, Level::Info)).to_vec();
    assert_eq!(service.log, Log { level: Level::Info, modules, format: LogFormat::Auto });
    let realtime = Realtime { priority: Some(50), cpus: vec![1], lock_memory: true };
    assert_eq!(service.realtime, realtime);
    assert_eq!(service.metrics, Some("127.0.0.1:9464".parse().unwrap()));
    let path = Some("/var/lib/axisd/audit".into());
    assert_eq!(service.audit, Audit { is_on: true, path, file_kib: 1024, files: 8 });
    assert_eq!(load_plainly("").service, config::Service::default());
}

#[test]
fn what_is_wrong_about_the_daemon_is_said_with_its_position() {
    for (text, line, column, message) in [
        ("[log]\nlevel = \"loud\"\n", 2, 9, "unknown level `loud`"),
        ("[log.modules]\ndevices = \"info\"\n", 2, 1, "unknown key `devices`"),
        ("[log]\nformat = \"xml\"\n", 2, 10, "unknown format `xml`"),
        ("[realtime]\npriority = 0\n", 2, 12, "`priority` cannot be 0"),
        ("[realtime]\ncpus = [0, 1024]\n", 2, 12, "there is no processor 1024"),
        ("[metrics]\n", 1, 1, "`listen` is missing"),
        ("[metrics]\nlisten = \"9464\"\n", 2, 10, "`9464` is no socket address"),
        ("[audit]\npath = \"\"\n", 2, 8, "the audit trail needs a directory"),
        ("[audit]\nfiles = 1\n", 2, 9, "`files` cannot be 1"),
        ("[audit]\nfile_kib = 1\n", 2, 12, "`file_kib` cannot be 1"),
    ] {
        let found = finding(text);
        assert_eq!((found.0, found.1, &*found.2), (line, column, message), "{text}");
    }
}
