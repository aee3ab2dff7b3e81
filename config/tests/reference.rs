//! docs/configuration.md lists every key, and no other one.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::Path;

use config::load;

/// A key that no table has, and that resembles none.
const NONE: &str = "zzzzzzzz";

/// The reference, and where its tables are in a file that has each once.
const PLACES: [(&str, &str); 17] = [
    ("[[bus]]", "[[bus]]\n"),
    ("[[device]]", "[[device]]\n"),
    ("[[device.on]]", "[[device]]\n[[device.on]]\n"),
    ("[device.identity]", "[[device]]\n[device.identity]\n"),
    ("[device.limits]", "[[device]]\nprofile = \"cia402-servo\"\n[device.limits]\n"),
    ("[device.motor_data]", "[[device]]\n[device.motor_data]\n"),
    ("[device.plant]", "[[device]]\n[device.plant]\n"),
    ("A fault", "[[device]]\n[[device.plant.faults]]\n"),
    ("[storage]", "[storage]\n"),
    ("[control]", "[control]\n"),
    ("[log]", "[log]\n"),
    ("[log.modules]", "[log.modules]\n"),
    ("[realtime]", "[realtime]\n"),
    ("[metrics]", "[metrics]\n"),
    ("[audit]", "[audit]\n"),
    ("[modbus]", "[modbus]\n"),
    ("[device.modbus]", "[[device]]\n[device.modbus]\n"),
];

fn root(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)).expect("it is there")
}

/// What is wrong with a file, as text.
fn wrong(text: &str) -> String {
    let none = |_: &Path| Err(io::ErrorKind::NotFound.into());
    load("t.toml", text, &none).err().map(|wrong| wrong.to_string()).unwrap_or_default()
}

/// The keys that the reference lists behind this heading or line.
fn listed(place: &str) -> BTreeSet<String> {
    let text = root("docs/configuration.md");
    let heading = if place.starts_with('[') { format!("## {place}") } else { place.to_owned() };
    let behind = text.lines().skip_while(|line| !line.starts_with(&heading)).skip(1);
    let table = behind.skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|'));
    table.filter_map(|line| Some(line.strip_prefix("| `")?.split('`').next()?.to_owned())).collect()
}

/// The keys that the reader knows in a table; `None` if they are too many for it to list.
fn known(header: &str) -> Option<BTreeSet<String>> {
    let findings = wrong(&format!("{header}{NONE} = 1\n"));
    let help = findings.lines().skip_while(|line| !line.contains(&format!("unknown key `{NONE}`"))).nth(1)?;
    let keys = help.strip_prefix("  help: known: ")?;
    Some(keys.split(", ").map(str::to_owned).collect())
}

#[test]
fn the_reference_lists_every_key_of_every_table() {
    let mut compared = 0;
    for (place, header) in PLACES {
        let listed = listed(place);
        assert!(!listed.is_empty(), "{place} lists nothing");
        if let Some(known) = known(header) {
            assert_eq!(listed, known, "{place}");
            compared += 1;
        }
    }
    assert_eq!(compared, PLACES.len(), "some table has more keys than the reader lists");
    let tables: BTreeSet<_> = known("").expect("they are few").into_iter().collect();
    let text = root("docs/configuration.md");
    for table in tables {
        assert!(
            text.contains(&format!("## [{table}]")) || text.contains(&format!("## [[{table}]]")),
            "{table}"
        );
    }
}

#[test]
fn every_key_of_the_reference_is_known_to_the_reader() {
    for (place, header) in PLACES {
        for key in listed(place) {
            let findings = wrong(&format!("{header}{key} = 2026-01-01\n"));
            assert!(!findings.contains("unknown key"), "{place} {key}: {findings}");
        }
    }
}

#[test]
fn every_key_of_the_example_of_a_machine_is_in_the_reference() {
    let example = root("config/examples/machine.toml");
    let plant = example.lines().skip_while(|line| *line != "[device.plant]").skip(1);
    let listed = listed("[device.plant]");
    let mut found = 0;
    for line in plant {
        let Some((key, _)) = line.trim_start_matches("# ").split_once(" = ") else { continue };
        if key.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_') {
            assert!(listed.contains(key), "{key}");
            found += 1;
        }
    }
    assert_eq!(found, listed.len(), "the example shows all of them");
}

#[test]
fn every_shipped_profile_is_in_the_reference() {
    let text = root("docs/configuration.md");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../profiles/devices");
    for entry in fs::read_dir(folder).expect("it is there") {
        let name = entry.expect("a readable directory").file_name().into_string().expect("UTF-8");
        let profile = name.strip_suffix(".toml");
        assert!(profile.is_none_or(|profile| text.contains(&format!("`{profile}`"))), "{name}");
    }
}

#[test]
fn every_key_of_the_example_of_a_service_is_in_the_reference() {
    let example = root("config/examples/service.toml");
    let mut place = String::new();
    let mut found = 0;
    for line in example.lines() {
        if line.starts_with('[') {
            place = line.split_whitespace().next().unwrap_or_default().to_owned();
        } else if let Some((key, _)) = line.split_once(" = ").filter(|(key, _)| !key.starts_with(['#', '"']))
        {
            assert!(listed(&place).contains(key), "{place} {key}");
            found += 1;
        }
    }
    assert!(found > 30, "only {found} keys");
}
