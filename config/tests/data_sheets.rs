//! Devices whose profile is an EDS or a DCF.

use std::io;
use std::path::Path;

use config::{Diagnostics, Gateway, load};

const SHEET: &str = include_str!("../../profiles/tests/data_sheets/sheets/io_module.eds");

/// A machine with a few such files.
fn read(path: &Path) -> io::Result<Vec<u8>> {
    let commissioned = || format!("{SHEET}\n[DeviceComissioning]\nNodeID=17\nBaudrate=250\n");
    match path.to_str() {
        Some(
            "/gateway/io.eds"
            | "/gateway/./io.eds"
            | "/gateway/sheets/IO.EDS"
            | "/etc/axisd/devices/local.eds",
        ) => Ok(SHEET.into()),
        Some("/gateway/io.dcf") => Ok(commissioned().into()),
        Some("/gateway/odd.eds") => Ok(SHEET.replace("DefaultValue=250", "DefaultValue=often").into()),
        Some("/gateway/empty.eds") => Ok(b"nothing\n".into()),
        Some("/gateway/latin.toml") => Ok(b"name = \"\xE4\"\n".into()),
        _ => Err(io::ErrorKind::NotFound.into()),
    }
}

fn load_device(device: &str) -> Result<Gateway, Diagnostics> {
    let text = format!(
        "[[bus]]\nname = \"can0\"\nlink = \"virtual\"\nbit_rate_kbit_s = 500\n[[device]]\n{device}\n"
    );
    load("/gateway/axisd.toml", &text, &read)
}

fn findings(device: &str) -> String {
    load_device(device).map_or_else(|wrong| wrong, |gateway| gateway.warnings).to_string()
}

#[test]
fn a_data_sheet_stands_beside_the_file_or_in_the_directory_of_profiles() {
    for file in ["io.eds", "./io.eds", "sheets/IO.EDS", "local.eds"] {
        let gateway = load_device(&format!("name = 'io'\nprofile = '{file}'\nbus = 'can0'\nnode_id = 3"));
        let gateway = gateway.unwrap_or_else(|wrong| panic!("{file}: {wrong}"));
        assert_eq!(gateway.devices[0].profile.product, "IO 8/8");
        assert!(gateway.warnings.0.is_empty(), "{}", gateway.warnings);
    }
    let missing = findings("name = 'io'\nprofile = 'none.eds'\nbus = 'can0'\nnode_id = 3");
    let told = "cannot read /gateway/none.eds or /etc/axisd/devices/none.eds: entity not found";
    assert_eq!(missing, format!("/gateway/axisd.toml:7:11: error: {told}"));
}

#[test]
fn a_configuration_file_gives_the_node_id_that_is_not_given_here() {
    let gateway = load_device("name = 'io'\nprofile = 'io.dcf'\nbus = 'can0'").unwrap();
    assert_eq!(gateway.devices[0].on[0].node_id, 17);
    let told =
        "/gateway/axisd.toml:8:1: warning: the device configuration file says 250 kbit/s, the bus says 500";
    assert_eq!(gateway.warnings.to_string(), told);
    let gateway = load_device("name = 'io'\nprofile = 'io.dcf'\nbus = 'can0'\nnode_id = 3").unwrap();
    assert_eq!(gateway.devices[0].on[0].node_id, 3);
    let conflict = "/gateway/axisd.toml:9:1: warning: the device configuration file says 17; it is node 3";
    assert!(gateway.warnings.to_string().ends_with(conflict), "{}", gateway.warnings);
    assert!(findings("name = 'io'\nprofile = 'io.eds'\nbus = 'can0'").contains("`node_id` is missing"));
}

#[test]
fn what_is_odd_about_a_data_sheet_is_a_warning_with_its_place() {
    let gateway = load_device("name = 'io'\nprofile = 'odd.eds'\nbus = 'can0'\nnode_id = 3").unwrap();
    let line = SHEET.lines().position(|line| line == "DefaultValue=250").unwrap() + 1;
    let told = format!(
        "/gateway/odd.eds:{line}:14: warning: `DefaultValue`: `often` is no value of UNSIGNED16 and is left out\n  \
         help: it holds 0 to 65535"
    );
    assert_eq!(gateway.warnings.to_string(), told);
}

#[test]
fn a_file_that_is_no_data_sheet_is_an_error_with_its_place() {
    let told = findings("name = 'io'\nprofile = 'empty.eds'\nbus = 'can0'\nnode_id = 3");
    assert!(told.contains("/gateway/empty.eds:1:1: error: the file describes no object"), "{told}");
    let told = findings("name = 'io'\nprofile = 'latin.toml'\nbus = 'can0'\nnode_id = 3");
    assert_eq!(told, "/gateway/axisd.toml:7:11: error: /gateway/latin.toml is no UTF-8 text");
}

#[test]
fn a_device_of_a_data_sheet_has_objects_of_its_own_but_no_motor() {
    let io = "name = 'io'\nprofile = 'io.eds'\nbus = 'can0'\nnode_id = 3\n";
    let gateway = load_device(&format!("{io}[device.objects]\n'Offset' = 7\n")).unwrap();
    assert_eq!(gateway.devices[0].defaults.len(), 1);
    for (key, wrong) in [
        ("motor = 'mac050'", "unknown motor `mac050`"),
        ("motor_data = { raster_ns = 1 }", "a device without an axis has no motor"),
        ("plant = { load_torque_nm = 1 }", "a device without an axis has no plant"),
        ("limits = { max_position = 1 }", "the profile io has no such limit"),
        ("timing = 'authentic'", "`io` has no processing times"),
    ] {
        let told = findings(&format!("{io}{key}\n"));
        assert!(told.contains(wrong), "{key}: {told}");
    }
}
