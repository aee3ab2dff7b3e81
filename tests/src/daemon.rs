//! `axisd`, as a service and as a command.

use std::env;
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::thread;

use nix::sys::ptrace;
use nix::sys::signal::Signal;
use nix::sys::wait::{WaitPidFlag, waitpid};
use nix::unistd::Pid;

use crate::process::{Line, Process, Stream};
use crate::{PATIENCE, ServiceManager, TempDir, Vcan};

/// A running daemon. On drop it is stopped by SIGTERM and has to end with status 0.
#[derive(Debug)]
pub struct Daemon {
    process: Process,
    stopped: bool,
    config: TempDir,
}

impl Daemon {
    /// Starts `axisd run` with a configuration file of this text and waits until it is ready. Unless the text says where
    /// its control socket is, that is nowhere that others look.
    #[must_use]
    pub fn start(config: &str) -> Self {
        Self::run(config, &mut Command::new(binary()))
    }

    /// As [`start`](Self::start), under this service manager.
    #[must_use]
    pub fn supervised(config: &str, manager: &ServiceManager) -> Self {
        Self::run(config, Command::new(binary()).envs(manager.environment()))
    }

    fn run(config: &str, command: &mut Command) -> Self {
        let dir = TempDir::new();
        let file = configure(&dir, config);
        Self::spawn(dir, command.args(["run", "--config"]).arg(file))
    }

    /// Gives its configuration file another text, which it does not take by itself.
    pub fn configure(&self, config: &str) {
        configure(&self.config, config);
    }

    /// Asks it by SIGHUP to take its configuration file as it now is, and returns at once.
    pub fn hang_up(&self) {
        self.process.signal(Signal::SIGHUP);
    }

    /// Where its control socket is, unless the text of its configuration says another place.
    #[must_use]
    pub fn socket(&self) -> String {
        self.config.path().join("control.sock").display().to_string()
    }

    /// Starts `axisd run --demo` with its socketcand server on this port.
    #[must_use]
    pub fn demo(port: u16) -> Self {
        let address = format!("127.0.0.1:{port}");
        Self::spawn(TempDir::new(), Command::new(binary()).args(["run", "--demo", "--socketcand", &address]))
    }

    fn spawn(config: TempDir, command: &mut Command) -> Self {
        let mut process = Process::spawn("axisd", command);
        let ready = Line { stream: Stream::Err, text: "axisd ready".to_owned() };
        process.wait_for("line \"axisd ready\"", PATIENCE, |line| *line == ready);
        Self { process, stopped: false, config }
    }

    /// All it has printed, once there is a line with this beginning.
    pub fn printed_until(&mut self, beginning: &str) -> String {
        self.process.wait_for(&format!("line {beginning:?}..."), PATIENCE, |line| {
            line.stream == Stream::Out && line.text.starts_with(beginning)
        });
        self.process.stdout()
    }

    /// Waits until its log has a line with this text.
    pub fn logged(&mut self, text: &str) {
        self.process.wait_for(&format!("log line {text:?}"), PATIENCE, |line| {
            line.stream == Stream::Err && line.text.contains(text)
        });
    }

    /// Stalls its core thread, and no other one, until the guard is dropped.
    #[must_use]
    pub fn stall_core(&self) -> Stall {
        Stall::core_of(self.process.pid())
    }

    /// Stops all of it by SIGSTOP, until [`resume`](Self::resume).
    pub fn pause(&self) {
        self.process.signal(Signal::SIGSTOP);
    }

    /// Lets it go on after [`pause`](Self::pause).
    pub fn resume(&self) {
        self.process.signal(Signal::SIGCONT);
    }

    /// All that it has said so far.
    #[must_use]
    pub fn printed(&self) -> String {
        self.process.printed()
    }

    /// Its process id.
    #[must_use]
    pub fn id(&self) -> i32 {
        self.process.pid().as_raw()
    }

    /// Asks it to stop, and returns at once.
    pub fn terminate(&mut self) {
        self.process.signal(Signal::SIGTERM);
        self.stopped = true;
    }

    /// Ends it by SIGKILL, wherever it is.
    pub fn kill(&mut self) {
        self.process.signal(Signal::SIGKILL);
        self.stopped = true;
    }

    /// Waits until it has ended after [`terminate`](Self::terminate), which has to be with status 0.
    pub fn wait_until_stopped(&mut self) {
        let status = self.process.wait(PATIENCE);
        if !status.success() {
            self.process.give_up(&format!("ended with {status}"));
        }
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        if !self.stopped && !thread::panicking() {
            self.terminate();
            self.wait_until_stopped();
        }
    }
}

/// Writes the configuration file. Unless its text says where the control socket is, that is nowhere that others look.
fn configure(dir: &TempDir, config: &str) -> PathBuf {
    let socket = dir.path().join("control.sock");
    let control = format!("\n[control]\nsocket = \"{}\"\n", socket.display());
    let control = if config.contains("[control]") { "" } else { &control };
    dir.write("axisd.toml", &format!("{config}{control}"))
}

/// A core thread that is stalled. It goes on when this is dropped.
#[derive(Debug)]
pub struct Stall(Pid);

impl Stall {
    /// Stalls the core thread of the daemon with this process id, and no other one.
    ///
    /// A debugger's interrupt does that from outside: the thread that runs the core loop is the one that has the id of
    /// the process. So the daemon needs no order for it that somebody could give in production.
    pub(crate) fn core_of(core: Pid) -> Self {
        ptrace::seize(core, ptrace::Options::empty()).expect("become its debugger");
        ptrace::interrupt(core).expect("interrupt the core thread");
        waitpid(core, Some(WaitPidFlag::__WALL)).expect("wait for the core thread to stop");
        Self(core)
    }
}

impl Drop for Stall {
    fn drop(&mut self) {
        if ptrace::detach(self.0, None).is_err() {
            // It has ended, and its own parent is not told before its debugger has seen it.
            let _ = waitpid(self.0, Some(WaitPidFlag::__WALL | WaitPidFlag::WNOHANG));
        }
    }
}

/// Runs `axisd` with these arguments to its end.
#[must_use]
pub fn axisd(arguments: &[&str]) -> Output {
    Command::new(binary()).args(arguments).output().expect("run axisd")
}

/// Runs `axisctl` with these arguments to its end.
#[must_use]
pub fn axisctl(arguments: &[&str]) -> Output {
    axisctl_command(arguments).output().expect("run axisctl")
}

/// `axisctl` with these arguments, not yet run.
#[must_use]
pub fn axisctl_command(arguments: &[&str]) -> Command {
    let mut command = Command::new(binary().with_file_name("axisctl"));
    command.args(arguments);
    command
}

/// A configuration: one bus `can0` and, on it, devices given as name, profile and node-ID.
#[must_use]
pub fn config(bus: Bus<'_>, devices: &[(&str, &str, u8)]) -> String {
    let keys = match bus {
        Bus::Interface(interface) => format!("link = \"socketcan:{}\"", interface.name()),
        Bus::Virtual => "link = \"virtual\"".to_owned(),
        Bus::Socketcand(port) => format!("link = \"virtual\"\nsocketcand = \"127.0.0.1:{port}\""),
    };
    let mut text = format!("[[bus]]\nname = \"can0\"\n{keys}\n");
    for (name, profile, node_id) in devices {
        text += &format!(
            "\n[[device]]\nname = \"{name}\"\nprofile = \"{profile}\"\nbus = \"can0\"\nnode_id = {node_id}\n"
        );
    }
    text
}

/// What the bus of a configuration is.
#[derive(Debug, Clone, Copy)]
pub enum Bus<'a> {
    /// A CAN interface of the kernel.
    Interface(&'a Vcan),
    /// Nothing outside the daemon.
    Virtual,
    /// A virtual bus that this TCP port leads to.
    Socketcand(u16),
}

/// A TCP port of 127.0.0.1 that nobody listens on.
#[must_use]
pub fn free_port() -> u16 {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("bind to any port");
    listener.local_addr().expect("a bound socket has an address").port()
}

/// The daemon under test: `$AXISD_BIN`, else the one beside this test program, which is built first if it is out
/// of date (`cargo test` builds no programs of other packages).
pub(crate) fn binary() -> &'static Path {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    BINARY.get_or_init(|| env::var_os("AXISD_BIN").map_or_else(build, PathBuf::from))
}

fn build() -> PathBuf {
    let test = env::current_exe().expect("this program has a path");
    let [_, _, profile, target] = *test.ancestors().take(4).collect::<Vec<_>>() else {
        panic!("{} is not in a target directory", test.display());
    };
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--quiet", "--package=daemon", "--bins", "--target-dir"]).arg(target);
    if profile.ends_with("release") {
        cargo.arg("--release");
    }
    let status = cargo.current_dir(env!("CARGO_MANIFEST_DIR")).status().expect("run cargo");
    assert!(status.success(), "the daemon does not build");
    profile.join("axisd")
}
