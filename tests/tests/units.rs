//! The units of systemd as files; `tests/package` runs them.

use std::fs;
use std::path::Path;

fn unit(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../systemd").join(name);
    fs::read_to_string(path).expect("the unit is there")
}

#[test]
fn the_unit_of_an_instance_differs_in_its_names_only() {
    let of_instance = unit("axisd.service")
        .replace("Motion axes on fieldbuses", "Motion axes on fieldbuses (%i)")
        .replace("/etc/axisd/axisd.toml", "/etc/axisd/%i.toml")
        .replace("StateDirectory=axisd\n", "StateDirectory=axisd/%i\n")
        .replace(" Those of the instances are in it, so it stays.", "")
        .replace("RuntimeDirectory=axisd\nRuntimeDirectoryPreserve=yes\n", "RuntimeDirectory=axisd/%i\n");

    assert_eq!(unit("axisd@.service"), of_instance);
}
