//! The Python scripts of `tests/peers`, run by the virtual environment that `scripts/test` makes.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::process::{Line, Process, Stream};
use crate::{Bus, TempDir, Vcan, axisd, config};

const SCRIPT_PATIENCE: Duration = Duration::from_secs(180);

/// A CANopen master for the drives on one bus: it knows the way there and has their EDS.
#[derive(Debug)]
pub struct Master {
    arguments: Vec<String>,
    _eds: TempDir,
}

impl Master {
    /// On a kernel interface, for drives of this profile.
    #[must_use]
    pub fn on(interface: &Vcan, profile: &str) -> Self {
        Self::new(&["--interface=socketcan", "--channel", interface.name()], profile)
    }

    /// On the bus `can0` of a socketcand server on this machine, for drives of this profile.
    #[must_use]
    pub fn at(port: u16, profile: &str) -> Self {
        Self::new(&["--interface=socketcand", "--channel=can0", "--port", &port.to_string()], profile)
    }

    /// As [`at`](Self::at), for a drive that this file describes.
    #[must_use]
    pub fn with_file(port: u16, file: &Path) -> Self {
        let way = ["--interface=socketcand", "--channel=can0", "--port", &port.to_string()];
        Self::described(&way, TempDir::new(), file)
    }

    fn new(way: &[&str], profile: &str) -> Self {
        let dir = TempDir::new();
        let file = write_eds(&dir, profile);
        Self::described(way, dir, &file)
    }

    fn described(way: &[&str], dir: TempDir, file: &Path) -> Self {
        let eds = ["--eds".to_owned(), file.display().to_string()];
        Self { arguments: way.iter().map(|&word| word.to_owned()).chain(eds).collect(), _eds: dir }
    }

    /// Runs `tests/peers/{name}.py` to its end, which has to be with status 0, and gives what it printed.
    #[must_use]
    pub fn run(&self, name: &str, more: &[&str]) -> String {
        self.start(name, more).finish()
    }

    /// Starts `tests/peers/{name}.py`.
    #[must_use]
    pub fn start(&self, name: &str, more: &[&str]) -> Peer<'_> {
        let arguments = self.arguments.iter().map(String::as_str).chain(more.iter().copied());
        Peer { process: script(name, arguments), _master: self }
    }
}

/// A peer script that runs beside the test.
#[derive(Debug)]
pub struct Peer<'a> {
    process: Process,
    _master: &'a Master,
}

impl Peer<'_> {
    /// Waits until it has printed this line.
    pub fn wait_for(&mut self, line: &str) {
        let wanted = Line { stream: Stream::Out, text: line.to_owned() };
        self.process.wait_for(&format!("line {line:?}"), SCRIPT_PATIENCE, |line| *line == wanted);
    }

    /// Waits for its end, which has to be with status 0, and gives all it printed.
    #[must_use]
    pub fn finish(self) -> String {
        finish(self.process)
    }
}

/// Runs a piece of Python where python-canopen is, and gives what it printed.
#[must_use]
pub fn run_python(code: &str) -> String {
    finish(Process::spawn("python", python().args(["-c", code])))
}

/// Runs `tests/peers/{name}.py`, which needs no CANopen master, with these arguments and gives what it printed.
#[must_use]
pub fn run_peer(name: &str, arguments: &[String]) -> String {
    finish(script(name, arguments.iter().map(String::as_str)))
}

/// What python-canopen reads in the EDS of a profile.
#[must_use]
pub fn objects_in_eds(profile: &str) -> String {
    let dir = TempDir::new();
    let file = write_eds(&dir, profile);
    finish(script("check_eds", file.to_str().into_iter()))
}

fn script<'a>(name: &str, arguments: impl Iterator<Item = &'a str>) -> Process {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers").join(name).with_extension("py");
    Process::spawn(name, python().arg("-B").arg(file).args(arguments))
}

fn python() -> Command {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.venv/bin/python");
    assert!(python.exists(), "no .venv with the Python peers: scripts/test makes it");
    Command::new(python)
}

fn finish(mut script: Process) -> String {
    let status = script.wait(SCRIPT_PATIENCE);
    if !status.success() {
        script.give_up(&format!("ended with {status}"));
    }
    script.stdout()
}

fn write_eds(dir: &TempDir, profile: &str) -> PathBuf {
    let file = dir.write("axisd.toml", &config(Bus::Virtual, &[("axis1", profile, 1)]));
    let file = file.to_str().expect("temporary paths are UTF-8");
    let output = axisd(&["eds", "--config", file, "--device", "axis1"]);
    assert!(output.status.success(), "axisd eds: {}", String::from_utf8_lossy(&output.stderr));
    dir.write("axis1.eds", &String::from_utf8_lossy(&output.stdout))
}
