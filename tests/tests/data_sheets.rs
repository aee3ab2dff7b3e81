//! EDS files of others as profiles.

use std::fs;
use std::path::{Path, PathBuf};

use tests::{Daemon, Master, TempDir, axisd, free_port, run_peer};

const IO_MODULE: &str = include_str!("../../profiles/tests/data_sheets/sheets/io_module.eds");

/// A configuration with one device of this profile on a bus of its own.
fn configuration(profile: &Path, socketcand: &str) -> String {
    let profile = profile.display();
    format!(
        "[[bus]]\nname = \"can0\"\nlink = \"virtual\"\n{socketcand}\n\
         [[device]]\nname = \"device\"\nprofile = \"{profile}\"\nbus = \"can0\"\nnode_id = 5\n"
    )
}

/// What a short command prints about such a device: standard output and standard error.
fn ask(dir: &TempDir, profile: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let file = dir.write("axisd.toml", &configuration(profile, ""));
    let file = file.to_str().expect("temporary paths are UTF-8");
    let arguments: Vec<&str> =
        arguments.iter().map(|word| if *word == "FILE" { file } else { word }).collect();
    let output = axisd(&arguments);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).replace(file, "axisd.toml");
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// The sheet that we write of a device whose profile is the sheet `profile`, compared with that.
fn compared(dir: &TempDir, profile: &Path) -> String {
    let (status, sheet, wrong) = ask(dir, profile, &["eds", "--config", "FILE", "--device", "device"]);
    assert_eq!(status, Some(0), "{wrong}");
    let ours = dir.write("ours.eds", &sheet);
    run_peer("same_sheet", &[profile.display().to_string(), ours.display().to_string()])
}

#[test]
fn python_canopen_finds_in_a_device_what_its_data_sheet_says() {
    let dir = TempDir::new();
    let sheet = dir.write("io_module.eds", IO_MODULE);
    let port = free_port();
    let _daemon = Daemon::start(&configuration(&sheet, &format!("socketcand = \"127.0.0.1:{port}\"")));

    let log = Master::with_file(port, &sheet).run("data_sheet", &[]);

    insta::assert_snapshot!(log, @r"
    53 entries have their defaults
    TPDO 2 carries what was mapped
    RPDO 1 sets the outputs
    ");
}

#[test]
fn the_data_sheet_that_comes_out_says_what_went_in() {
    let dir = TempDir::new();
    let sheet = dir.write("io_module.eds", IO_MODULE);

    // What python-canopen makes of an array in one section is its own.
    insta::assert_snapshot!(compared(&dir, &sheet), @r"
    0x6401:00 name: 'Number of entries' becomes 'NrOfObjects'
    0x6401:00 access_type: 'rw' becomes 'ro'
    62 entries
    ");
}

#[test]
fn check_tells_what_is_odd_about_a_data_sheet_and_what_cannot_be_served() {
    let dir = TempDir::new();
    let sheet = dir.write("odd.eds", &IO_MODULE.replace("DefaultValue=250", "DefaultValue=often"));
    let shown = |text: String| text.replace(&dir.path().display().to_string(), "");

    let (status, out, odd) = ask(&dir, &sheet, &["check", "FILE"]);
    assert_eq!((status, out.as_str()), (Some(0), "axisd.toml: ok (1 bus, 1 device, 1 warning)\n"));
    insta::assert_snapshot!(shown(odd), @r"
    /odd.eds:183:14: warning: `DefaultValue`: `often` is no value of UNSIGNED16 and is left out
      help: it holds 0 to 65535
    ");

    let (status, json, _) = ask(&dir, &sheet, &["check", "--json", "FILE"]);
    assert_eq!(status, Some(0));
    insta::assert_snapshot!(shown(json), @r#"
    [
      {
        "severity": "warning",
        "file": "/odd.eds",
        "line": 183,
        "column": 14,
        "message": "`DefaultValue`: `often` is no value of UNSIGNED16 and is left out",
        "help": "it holds 0 to 65535"
      }
    ]
    "#);

    let none = dir.write("none.eds", "[FileInfo]\nFileName=none.eds\n");
    let (status, out, wrong) = ask(&dir, &none, &["check", "FILE"]);
    assert_eq!((status, out.as_str()), (Some(78), ""));
    insta::assert_snapshot!(shown(wrong), @r"
    /none.eds:1:1: error: the file describes no object
      help: an EDS describes objects in sections such as [1000]
    ");
}

#[test]
fn check_explains_a_device_of_a_data_sheet() {
    let dir = TempDir::new();
    let sheet = dir.write("io_module.eds", IO_MODULE);

    let (status, out, wrong) = ask(&dir, &sheet, &["check", "--explain", "FILE"]);

    assert_eq!((status, wrong.as_str()), (Some(0), ""));
    assert!(out.contains("profile: io_module") && out.contains("product: IO 8/8"), "{out}");
}

/// The EDS files in Python packages, which `scripts/test` unpacks.
fn packaged() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.venv/sheets");
    let mut files: Vec<PathBuf> = fs::read_dir(&folder)
        .expect("scripts/test unpacks the EDS files")
        .map(|file| file.expect("a readable directory").path())
        .filter(|file| file.extension().is_some_and(|ending| ending == "eds"))
        .collect();
    files.sort_unstable();
    files
}

#[test]
fn data_sheets_of_other_packages_are_served() {
    let dir = TempDir::new();
    let mut story = String::new();
    for file in packaged() {
        let name = file.file_name().expect("a file").to_string_lossy().into_owned();
        let folder = file.parent().expect("a directory").display().to_string();
        let (status, out, odd) = ask(&dir, &file, &["check", "FILE"]);
        let odd = odd.replace(&format!("{folder}/"), "");
        story += &format!("== {name}: status {}\n{odd}{out}", status.expect("an end of its own"));
        story += &format!("== {name}: what comes out\n{}", compared(&dir, &file));
    }
    insta::assert_snapshot!(story);
}
