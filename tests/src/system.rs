//! A Debian system of its own that systemd has booted (`scripts/clean-system`), with the package of axisd (`$AXISD_DEB`).
//!
//! There is one for all tests of a program, which therefore run one after the other.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use nix::unistd::Pid;

use crate::daemon::Stall;

/// How long a service may take for anything: its watchdog and the end of a user-mode Linux's patience count.
const PATIENCE: Duration = Duration::from_secs(90);
const POLL_PERIOD: Duration = Duration::from_millis(50);

static SYSTEM: Mutex<()> = Mutex::new(());

/// The system, for one test. When that is over, every axisd is stopped and as it was before its first start.
#[derive(Debug)]
pub struct System(#[allow(dead_code)] MutexGuard<'static, ()>);

impl System {
    /// The system as it is, for a test that installs or removes.
    #[must_use]
    pub fn new() -> Self {
        // A test that has failed leaves it in order, too.
        let guard = SYSTEM.lock().unwrap_or_else(PoisonError::into_inner);
        let first = fs::read("/proc/1/environ").expect("root may read it");
        let is_ours = first.split(|byte| *byte == 0).any(|variable| variable == b"container=axisd-test");
        assert!(is_ours, "this would change your machine: scripts/test runs it in a system of its own");
        Self(guard)
    }

    /// The system with the package.
    #[must_use]
    pub fn installed() -> Self {
        let system = Self::new();
        if !Path::new("/usr/bin/axisd").exists() {
            install();
        }
        system
    }

    /// Removes the package and all that belongs to it, if it is there.
    pub fn purge(&self) {
        if Path::new("/usr/bin/axisd").exists() {
            run("dpkg", &["--purge", "axisd"]);
        }
    }

    /// `axisd.service` with this configuration, or with the one that came with the package; not started.
    #[must_use]
    pub fn service(&self, config: Option<&str>) -> Service<'_> {
        let config = config.map(|text| Config::write("/etc/axisd/axisd.toml", text));
        Service::new(self, "axisd.service".to_owned(), config)
    }

    /// `axisd@NAME.service` with this configuration; not started.
    #[must_use]
    pub fn instance(&self, name: &str, config: &str) -> Service<'_> {
        let config = Config::write(&format!("/etc/axisd/{name}.toml"), config);
        Service::new(self, format!("axisd@{name}.service"), Some(config))
    }
}

impl Default for System {
    fn default() -> Self {
        Self::new()
    }
}

/// Installs the package, or the same one over it, and gives what dpkg says.
pub fn install() -> String {
    let package = env::var("AXISD_DEB").expect("AXISD_DEB is the package");
    run("dpkg", &["--install", &package])
}

/// Runs a program to its end, which has to be with status 0, and gives its standard output.
pub fn run(program: &str, arguments: &[&str]) -> String {
    let output = attempt(program, arguments);
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{program} {arguments:?}: {}\n{out}{err}", output.status);
    out.into_owned()
}

/// Runs a program to its end.
#[must_use]
pub fn attempt(program: &str, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).output().unwrap_or_else(|error| panic!("run {program}: {error}"))
}

/// A unit of systemd's that runs an axisd.
#[derive(Debug)]
pub struct Service<'a> {
    unit: String,
    config: Option<Config>,
    drop_in: Option<PathBuf>,
    /// When it was configured.
    since: Duration,
    _system: &'a System,
}

impl<'a> Service<'a> {
    fn new(system: &'a System, unit: String, config: Option<Config>) -> Self {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).expect("it is after 1970");
        Self { unit, config, drop_in: None, since, _system: system }
    }

    /// Adds lines to its `[Service]`, before its first start.
    #[must_use]
    pub fn with(mut self, lines: &str) -> Self {
        let directory = PathBuf::from(format!("/etc/systemd/system/{}.d", self.unit));
        fs::create_dir_all(&directory).expect("make the directory");
        fs::write(directory.join("test.conf"), format!("[Service]\n{lines}\n")).expect("write a drop-in");
        self.drop_in = Some(directory);
        run("systemctl", &["daemon-reload"]);
        self
    }

    /// Starts it, and returns once it is ready.
    pub fn start(&self) {
        let started = attempt("systemctl", &["start", &self.unit]);
        assert!(started.status.success(), "{} does not start:\n{}", self.unit, self.journal());
    }

    /// Starts it, which has to fail.
    pub fn fail_to_start(&self) {
        let started = attempt("systemctl", &["start", &self.unit]);
        assert!(!started.status.success(), "{} starts:\n{}", self.unit, self.journal());
    }

    /// Gives its configuration file another text, which it does not take by itself.
    pub fn configure(&self, config: &str) {
        let file = self.config.as_ref().expect("it has a file of its own");
        fs::write(&file.path, config).expect("write the configuration");
    }

    /// Lets it take its configuration file.
    pub fn reload(&self) {
        run("systemctl", &["reload", &self.unit]);
    }

    /// The same, which has to fail.
    pub fn fail_to_reload(&self) {
        let reloaded = attempt("systemctl", &["reload", &self.unit]);
        assert!(!reloaded.status.success(), "{} reloads:\n{}", self.unit, self.journal());
    }

    /// Stops it, and returns once it has ended.
    pub fn stop(&self) {
        run("systemctl", &["stop", &self.unit]);
    }

    /// Sends it this signal.
    pub fn kill(&self, signal: &str) {
        run("systemctl", &["kill", "--signal", signal, &self.unit]);
    }

    /// Stalls the core thread of its daemon until the guard is dropped.
    #[must_use]
    pub fn stall_core(&self) -> Stall {
        Stall::core_of(Pid::from_raw(self.pid()))
    }

    /// Process id of the daemon.
    #[must_use]
    pub fn pid(&self) -> i32 {
        self.show("MainPID").parse().expect("a process id is an i32")
    }

    /// A property, as `systemctl show` tells it.
    #[must_use]
    pub fn show(&self, property: &str) -> String {
        let value = run("systemctl", &["show", &self.unit, "--value", "--property", property]);
        value.trim_end().to_owned()
    }

    /// Waits until a property has this value.
    pub fn wait_until(&self, property: &str, value: &str) {
        let deadline = Instant::now() + PATIENCE;
        while self.show(property) != value {
            let late = Instant::now() > deadline;
            assert!(!late, "{} has {property}={}:\n{}", self.unit, self.show(property), self.journal());
            thread::sleep(POLL_PERIOD);
        }
    }

    /// What it, and systemd about it, has logged.
    #[must_use]
    pub fn journal(&self) -> String {
        run("journalctl", &["--sync"]);
        let since = format!("@{}", self.since.as_secs());
        run("journalctl", &["--no-pager", "--output=cat", "--since", &since, "--unit", &self.unit])
    }
}

impl Drop for Service<'_> {
    fn drop(&mut self) {
        // A test that removes the package has left no unit.
        let _ = attempt("systemctl", &["stop", &self.unit]);
        let _ = attempt("systemctl", &["disable", &self.unit]);
        let _ = attempt("systemctl", &["reset-failed", &self.unit]);
        if let Some(directory) = &self.drop_in {
            let _ = fs::remove_dir_all(directory);
            let _ = attempt("systemctl", &["daemon-reload"]);
        }
        if self.config.is_some() {
            let _ = fs::remove_dir_all("/var/lib/axisd");
        }
    }
}

/// A file of configuration. When it is dropped, what was there before is there again.
#[derive(Debug)]
struct Config {
    path: PathBuf,
    before: Option<String>,
}

impl Config {
    fn write(path: &str, text: &str) -> Self {
        let path = PathBuf::from(path);
        let before = fs::read_to_string(&path).ok();
        fs::write(&path, text).unwrap_or_else(|error| panic!("write {}: {error}", path.display()));
        Self { path, before }
    }
}

impl Drop for Config {
    fn drop(&mut self) {
        // A test that purges the package has left no directory.
        let _ = match &self.before {
            Some(text) => fs::write(&self.path, text),
            None => fs::remove_file(&self.path),
        };
    }
}
