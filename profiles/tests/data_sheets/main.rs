//! EDS and DCF files as device profiles.

mod broken;
mod hostile;
mod meaning;
mod shipped;

use od::{Address, Initial, Schema, Value};
use profiles::{Diagnostics, Profile, Severity};

/// The profile of a file that can be used, and what was found.
fn read(text: &str) -> (Profile, Diagnostics) {
    let (profile, findings) = Profile::from_data_sheet("device.eds", text.as_bytes());
    (profile.unwrap_or_else(|| panic!("{findings}")), findings)
}

/// The profile of a file about which there is nothing to say.
fn read_clean(text: &str) -> Profile {
    let (profile, findings) = read(text);
    assert!(findings.0.is_empty(), "{findings}");
    profile
}

/// What was found about `objects` in a file that is right otherwise, without the file's name.
fn findings(objects: &str) -> Vec<String> {
    let (_, findings) = read(&with(objects));
    assert!(findings.0.iter().all(|finding| finding.severity == Severity::Warning));
    findings.0.iter().map(|finding| finding.message.clone()).collect()
}

/// A right file with further objects, which stand in its lists.
fn with(objects: &str) -> String {
    let is_object = |line: &&str| line.starts_with('[') && !line.contains("sub") && line.len() == 6;
    let mut text = include_str!("sheets/minimal.eds").to_owned();
    let indices: Vec<&str> = objects.lines().filter(is_object).collect();
    text += &format!("\n[OptionalObjects]\nSupportedObjects={}\n", indices.len());
    for (number, index) in indices.iter().enumerate() {
        text += &format!("{}=0x{}\n", number + 1, index.trim_matches(['[', ']']));
    }
    text + objects
}

/// A VAR with these lines.
fn var(index: u16, lines: &str) -> String {
    format!("[{index:04X}]\nParameterName=Object\nObjectType=0x7\n{}\n", lines.replace(", ", "\n"))
}

fn schema(profile: &Profile, index: u16) -> &Schema {
    if index < 0x2000 { &profile.communication } else { &profile.application }
}

fn entry(profile: &Profile, index: u16, sub: u8) -> &od::Entry {
    let schema = schema(profile, index);
    let slot = schema.slot(Address::new(index, sub)).unwrap_or_else(|| panic!("no 0x{index:04X}:{sub:02X}"));
    schema.entry(slot).unwrap()
}

fn number(profile: &Profile, index: u16, sub: u8) -> u64 {
    match &entry(profile, index, sub).initial {
        Initial::Value(Value::Fixed(raw)) => *raw,
        other => panic!("{other:?}"),
    }
}
