//! What clients of the control socket say: lines of JSON, and in them names of objects, values and faults.

use std::sync::LazyLock;

use daemon::control::Request;
use daemon::objects;
use od::Address;
use profiles::{PlantFault, Profile, Repair};

/// Objects of every data type.
static PROFILE: LazyLock<Profile> =
    LazyLock::new(|| Profile::embedded("canopen-reference", None).expect("shipped").expect("valid"));

/// Reads `bytes` as requests, and each of their lines as whatever may stand in one.
pub fn run(bytes: &[u8]) {
    for line in bytes.split(|byte| *byte == b'\n') {
        if let Ok(request) = serde_json::from_slice::<Request>(line) {
            let again = serde_json::to_vec(&request).expect("a request has its JSON");
            assert_eq!(serde_json::from_slice::<Request>(&again).ok(), Some(request));
        }
        if let Ok(text) = str::from_utf8(line) {
            find(text);
            break_and_repair(text);
        }
    }
}

/// `text` names an object, and behind a blank a value to be written.
fn find(text: &str) {
    let areas = [&*PROFILE.communication, &*PROFILE.application];
    let (object, value) = text.split_once(' ').unwrap_or((text, ""));
    let Ok(found) = objects::find(&areas, object) else { return };
    for address in found.addresses {
        check_value(address, value);
    }
}

/// What is read as a value has the length of its type, and can be shown.
fn check_value(Address { index, sub }: Address, value: &str) {
    let areas = [&PROFILE.communication, &PROFILE.application];
    let entries = areas.into_iter().flat_map(|area| area.entries());
    let (_, entry) = entries
        .into_iter()
        .find(|(address, _)| *address == Address::new(index, sub))
        .expect("an entry that was found is there");
    if let Ok(bytes) = objects::parse(entry.data_type, value) {
        assert!(entry.data_type.bytes().is_none_or(|length| length == bytes.len()), "{bytes:02X?}");
        assert!(!objects::text(entry.data_type, &bytes).is_empty() || bytes.is_empty());
        let _ = objects::json(entry.data_type, &bytes);
    }
}

/// A fault that was read is written in a way that is the same fault.
fn break_and_repair(text: &str) {
    if let Ok(fault) = text.parse::<PlantFault>() {
        assert_eq!(
            fault.to_string().parse::<PlantFault>().ok().map(|fault| fault.to_string()),
            Some(fault.to_string())
        );
    }
    let _ = text.parse::<Repair>();
}
