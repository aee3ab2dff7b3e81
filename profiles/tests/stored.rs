//! What 0x1010 stores of the shipped profiles, and the sheet in 0x1021.

use od::{Access, Address, Value};
use profiles::Profile;

fn profile(name: &str) -> Profile {
    Profile::embedded(name, None).unwrap().unwrap()
}

/// What a master can write and 0x1010 does not store.
fn passing(profile: &Profile) -> Vec<String> {
    let entries = profile.communication.entries().chain(profile.application.entries());
    let passing = entries.filter(|(_, entry)| entry.access == Access::ReadWrite && !entry.is_parameter());
    passing.map(|(address, _)| address.to_string()).collect()
}

const COMMUNICATION: [&str; 7] =
    ["0x1003:00", "0x1010:01", "0x1010:02", "0x1010:03", "0x1011:01", "0x1011:02", "0x1011:03"];

#[test]
fn commands_targets_and_the_mode_are_not_stored() {
    let commands = [
        "0x6040:00",
        "0x6042:00",
        "0x6060:00",
        "0x6071:00",
        "0x607A:00",
        "0x60B0:00",
        "0x60B1:00",
        "0x60B2:00",
        "0x60B8:00",
        "0x60C1:01",
        "0x60FE:01",
        "0x60FF:00",
    ];
    assert_eq!(passing(&profile("cia402-servo")), [&COMMUNICATION[..], &commands].concat());
}

#[test]
fn outputs_and_motor_registers_of_the_jvl_module_are_not_stored() {
    let passing = passing(&profile("jvl-mac00-fc4"));
    for address in ["0x1010:04", "0x2010:00", "0x2011:02", "0x2012:03", "0x2013:00", "0x60FE:01", "0x6040:00"]
    {
        assert!(passing.iter().any(|known| known == address), "{address}");
    }
    for address in ["0x1017:00", "0x1020:01", "0x1600:01", "0x2011:06", "0x60FE:02", "0x6081:00"] {
        assert!(passing.iter().all(|known| known != address), "{address}");
    }
}

#[test]
fn the_device_holds_its_own_data_sheet() {
    for name in Profile::names() {
        let profile = profile(name);
        let dictionary = od::Dictionary::new(profile.communication.clone(), 1);
        let slot = dictionary.find(Address::new(0x1021, 0)).unwrap();
        let sheet = profile.eds();
        assert_eq!(dictionary.value(slot), Some(&Value::bytes(sheet.clone())));
        assert!(sheet.contains(
            "[1021]\nParameterName=Store EDS\nObjectType=0x7\nDataType=0x000F\nAccessType=ro\nPDOMapping=0"
        ));
        assert!(sheet.is_ascii(), "format 0");
    }
}
