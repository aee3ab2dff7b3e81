//! Data sheets: EDS, DCF and XDD, against what nodes say of themselves and as others read them.

use std::fs;
use std::path::{Path, PathBuf};

use tests::{Bus, Daemon, Master, TempDir, axisctl, axisd, config, free_port, run_peer};

/// Motors that are not the first of their profile, and have another dictionary than that.
const OTHER_MOTORS: [(&str, &str); 2] = [("jvl-mac00-fc4", "mac800"), ("jvl-mis34x", "mis342")];

/// Every shipped profile: each has its table of objects, which another test keeps.
fn profiles() -> Vec<String> {
    let tables = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/objects");
    let files = fs::read_dir(tables).expect("the tables are there");
    let names = files.map(|file| file.expect("a file").file_name().into_string().expect("ASCII"));
    let names = names.filter_map(|name| Some(name.strip_suffix(".md")?.to_owned()));
    let mut profiles: Vec<String> = names.filter(|name| !name.starts_with("registers-")).collect();
    profiles.sort_unstable();
    assert!(profiles.len() >= 8, "{profiles:?}");
    profiles
}

/// A device of each profile and some with other motors, with Node-IDs from 1, and their names.
fn all_devices(port: u16) -> (String, Vec<String>) {
    let profiles = profiles();
    let devices: Vec<(&str, &str, u8)> =
        profiles.iter().zip(1..).map(|(name, id)| (name.as_str(), name.as_str(), id)).collect();
    let mut text = config(Bus::Socketcand(port), &devices);
    let mut names = profiles.clone();
    for (profile, motor) in OTHER_MOTORS {
        let node_id = names.len() + 1;
        text += &format!(
            "\n[[device]]\nname = \"{motor}\"\nprofile = \"{profile}\"\nmotor = \"{motor}\"\nbus = \"can0\"\n\
             node_id = {node_id}\n"
        );
        names.push(motor.to_owned());
    }
    (text, names)
}

/// What a command prints on standard output.
fn printed(output: &std::process::Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The sheet of a device in a file of its own.
fn sheet(dir: &TempDir, device: &str, format: &str) -> PathBuf {
    let config = dir.path().join("axisd.toml").display().to_string();
    let arguments = ["eds", "--config", &config, "--device", device, "--format", format];
    dir.write(&format!("{device}.{format}"), &printed(&axisd(&arguments)))
}

#[test]
fn every_entry_of_every_profile_is_as_python_canopen_reads_it_in_the_eds() {
    let (port, dir) = (free_port(), TempDir::new());
    let (config, names) = all_devices(port);
    dir.write("axisd.toml", &config);
    let _daemon = Daemon::start(&config);
    let device = |(name, id): (&String, usize)| format!("{name}:{id}:{}", sheet(&dir, name, "eds").display());
    let devices = names.iter().zip(1..).map(device);

    let log = run_peer(
        "dictionary",
        &["--port".to_owned(), port.to_string()].into_iter().chain(devices).collect::<Vec<_>>(),
    );

    insta::assert_snapshot!(log);
}

#[test]
fn the_xdd_of_every_profile_has_the_entries_of_its_eds() {
    let dir = TempDir::new();
    let (config, names) = all_devices(free_port());
    dir.write("axisd.toml", &config);
    let pair = |name: &String| ["eds", "xdd"].map(|format| sheet(&dir, name, format).display().to_string());

    let log = run_peer("check_xdd", &names.iter().flat_map(pair).collect::<Vec<_>>());

    assert_eq!(log.lines().count(), names.len(), "{log}");
}

/// A daemon with one drive of this profile, on this port.
fn drive(profile: &str, port: u16, dir: &TempDir) -> Daemon {
    let socket = dir.path().join("socket").display().to_string();
    let devices = [("x", profile, 5)];
    Daemon::start(&format!("[control]\nsocket = \"{socket}\"\n{}", config(Bus::Socketcand(port), &devices)))
}

fn ctl(dir: &TempDir, arguments: &[&str]) -> String {
    let socket = dir.path().join("socket").display().to_string();
    printed(&axisctl(&[&["--socket", &socket], arguments].concat()))
}

#[test]
fn a_device_is_configured_like_another_one_by_its_dcf() {
    let (port, dir) = (free_port(), TempDir::new());
    let mut first = drive("cia402-servo", port, &dir);
    for (object, value) in [
        ("0x1017:00", "250"),
        ("0x1802:01", "0x8000038A"),
        ("0x1A02:00", "0"),
        ("0x1A02:01", "0x606C0020"),
        ("0x1A02:00", "1"),
        ("0x1802:02", "255"),
        ("0x1802:05", "30"),
        ("0x6083:00", "4321"),
        ("0x6098:00", "33"),
        ("0x607D:01", "-77777"),
    ] {
        ctl(&dir, &["od", "write", "x", object, value]);
    }
    let configuration = ctl(&dir, &["od", "export", "x"]);
    assert!(configuration.contains("[DeviceComissioning]\nNodeID=0x5\nNodeName=x\n"), "{configuration}");
    first.terminate();
    first.wait_until_stopped();
    let port = free_port();
    let _second = drive("cia402-servo", port, &dir);
    assert_ne!(ctl(&dir, &["od", "export", "x"]), configuration);

    let log = Master::with_file(port, &dir.write("x.dcf", &configuration)).run("configure", &[]);

    assert_eq!(log, "node 5 has all values of the file\n");
    assert_eq!(ctl(&dir, &["od", "export", "x"]), configuration);
    let described = ctl(&dir, &["od", "export", "x", "--format", "eds"]);
    let config = dir.write("axisd.toml", &config(Bus::Virtual, &[("x", "cia402-servo", 5)]));
    assert_eq!(
        described,
        printed(&axisd(&["eds", "--config", &config.display().to_string(), "--device", "x"]))
    );
    let values = |text: &str, mark: &str| text.matches(mark).count();
    let xml = ctl(&dir, &["od", "export", "x", "--format", "xdc"]);
    assert_eq!(values(&xml, " actualValue=\""), values(&configuration, "\nParameterValue="));
}

#[test]
fn the_dcf_of_a_motor_with_registers_is_taken_whole_and_commands_nothing() {
    for profile in ["jvl-mac00-fc4", "jvl-mis34x"] {
        let (port, dir) = (free_port(), TempDir::new());
        let _daemon = drive(profile, port, &dir);
        let configuration = ctl(&dir, &["od", "export", "x"]);
        // The mode of the motor is stored with its parameters, and moves it.
        let mode = configuration.split("\nParameterName=MODE_REG\n").nth(1).expect("it has a mode");
        assert!(
            mode.lines().take_while(|line| !line.is_empty()).all(|line| !line.starts_with("ParameterValue"))
        );

        let log = Master::with_file(port, &dir.write("x.dcf", &configuration)).run("configure", &[]);

        assert_eq!(log, "node 5 has all values of the file\n");
        assert_eq!(ctl(&dir, &["od", "export", "x"]), configuration, "{profile}");
    }
}
