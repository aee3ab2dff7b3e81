//! The short commands of `axisd`: check and eds.

use tests::{Bus, TempDir, axisd, config, objects_in_eds};

#[test]
fn check_names_every_error_with_its_place() {
    let dir = TempDir::new();
    let file = dir.write(
        "bad.toml",
        r#"[[bus]]
name = "can0"
link = "socketcan:vcan0"

[[device]]
name = "axis1"
profile = "no-such-profile"
bus = "can0"
node_id = 1

[[device]]
name = "axis2"
profile = "cia402-servo"
bus = "can9"
node_id = 128
"#,
    );
    let file = file.to_str().expect("temporary paths are UTF-8");

    let output = axisd(&["check", file]);

    let errors = String::from_utf8_lossy(&output.stderr).replace(file, "bad.toml");
    assert_eq!(output.status.code(), Some(78), "{errors}");
    insta::assert_snapshot!(errors, @r"
    bad.toml:7:11: error: unknown profile `no-such-profile`
      help: known: canopen-reference, cia402-servo, jvl-mac00-fc2, jvl-mac00-fc4, jvl-mis34x, maccon-mac4-inc, maccon-mac4-ssi, maccon-mac4-stp
    bad.toml:14:7: error: unknown bus `can9`
      help: did you mean `can0`? known: can0
    bad.toml:15:1: error: 128 is no Node-ID
      help: write a number from 1 to 127, or 255 for a node that an LSS master configures
    ");
}

#[test]
fn check_speaks_json_to_programs() {
    let dir = TempDir::new();
    let file = dir.write("bad.toml", "[[bus]]\nname = 3\nlink = \"virtual\"\n");
    let file = file.to_str().expect("temporary paths are UTF-8");

    let output = axisd(&["check", "--json", file]);

    assert_eq!(output.status.code(), Some(78));
    let findings = String::from_utf8_lossy(&output.stdout).replace(file, "bad.toml");
    insta::assert_snapshot!(findings, @r#"
    [
      {
        "severity": "error",
        "file": "bad.toml",
        "line": 2,
        "column": 8,
        "message": "`name` cannot be 3",
        "help": "write a string"
      }
    ]
    "#);
}

#[test]
fn check_accepts_a_good_configuration() {
    let dir = TempDir::new();
    let file = dir.write("good.toml", &config(Bus::Virtual, &[("axis1", "jvl-mac00-fc4", 1)]));
    let file = file.to_str().expect("temporary paths are UTF-8");

    let output = axisd(&["check", file]);

    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn check_tells_the_bit_rate_that_switches_say() {
    let dir = TempDir::new();
    let file = dir.write("good.toml", include_str!("../../config/examples/jvl-modules.toml"));
    let file = file.to_str().expect("temporary paths are UTF-8");

    let output = axisd(&["check", file]);

    let told = String::from_utf8_lossy(&output.stdout).replace(file, "good.toml");
    let rate = "bus `can0`: 500 kbit/s; axisd leaves its interface as it is\n";
    assert_eq!(told, format!("good.toml: ok (1 bus, 2 devices)\n{rate}"));
}

#[test]
fn python_canopen_reads_the_eds_of_the_jvl_module() {
    insta::assert_snapshot!(objects_in_eds("jvl-mac00-fc4"));
}

#[test]
fn python_canopen_reads_the_eds_of_the_servo() {
    insta::assert_snapshot!(objects_in_eds("cia402-servo"));
}

#[test]
fn python_canopen_reads_the_eds_of_the_reference_device() {
    insta::assert_snapshot!(objects_in_eds("canopen-reference"));
}
