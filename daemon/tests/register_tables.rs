//! The register tables in `docs/modbus` are what the profiles say. `UPDATE_DOCS=1` writes them anew.

use std::path::Path;

use daemon::registers::{is_complete, page};
use profiles::Profile;

#[test]
fn the_register_tables_are_up_to_date() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/modbus");
    for name in Profile::names() {
        let profile = Profile::embedded(name, None).unwrap().unwrap();
        let (file, expected) = (directory.join(format!("{name}.md")), page(&profile));
        if std::env::var_os("UPDATE_DOCS").is_some() {
            std::fs::create_dir_all(&directory).unwrap();
            std::fs::write(&file, &expected).unwrap();
        }
        let found = std::fs::read_to_string(&file).unwrap_or_default();
        assert!(found == expected, "{name}.md is not what the profile says; UPDATE_DOCS=1 writes it anew");
    }
}

#[test]
fn every_object_of_a_shipped_profile_has_registers() {
    for name in Profile::names() {
        assert!(is_complete(&Profile::embedded(name, None).unwrap().unwrap()), "{name}");
    }
}
