//! Virtual CAN interfaces of the kernel, and can-utils on them.

use std::path::Path;
use std::process::{Command, ExitStatus};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;

use crate::PATIENCE;
use crate::capture::statusword;
use crate::process::Process;

static NEXT: AtomicU32 = AtomicU32::new(1);

/// A COB-ID that CiA 301 reserves (table 38), so that no node minds it.
const MARK_ID: &str = "7FF";
/// Bytes: enough for thousands of frames, while a slow machine does other things.
const RECEIVE_BUFFER: &str = "16777216";
const REPEAT_PERIOD: Duration = Duration::from_millis(200);

/// A virtual CAN interface of its own for one test. It goes away on drop.
#[derive(Debug)]
pub struct Vcan(String);

impl Vcan {
    /// A new interface, up.
    #[must_use]
    pub fn new() -> Self {
        let interface = Self::absent();
        interface.create();
        interface
    }

    /// Two interfaces, up, with a wire between them: what one sends the other one receives.
    #[must_use]
    pub fn pair() -> (Self, Self) {
        let (near, far) = (Self::absent(), Self::absent());
        run("ip", &["link", "add", near.name(), "type", "vxcan", "peer", "name", far.name()]);
        for end in [&near, &far] {
            run("ip", &["link", "set", end.name(), "up"]);
        }
        (near, far)
    }

    /// Gives its transmit queue room for so many frames, each of which takes this long to leave.
    pub fn choke(&self, room: u32, delay: Duration) {
        let (room, delay) = (room.to_string(), format!("{}us", delay.as_micros()));
        run("tc", &["qdisc", "replace", "dev", &self.0, "root", "netem", "delay", &delay, "limit", &room]);
    }

    /// Ends [`choke`](Self::choke). What is in the transmit queue is lost.
    pub fn free(&self) {
        run("tc", &["qdisc", "delete", "dev", &self.0, "root"]);
    }

    /// The name of an interface that does not exist yet.
    #[must_use]
    pub fn absent() -> Self {
        Self(format!("vtest{}", NEXT.fetch_add(1, Ordering::Relaxed)))
    }

    /// An interface that somebody else has made.
    #[must_use]
    pub fn found(name: &str) -> Self {
        Self(name.to_owned())
    }

    /// Makes the interface and sets it up.
    pub fn create(&self) {
        run("ip", &["link", "add", &self.0, "type", "vcan"]);
        run("ip", &["link", "set", &self.0, "up"]);
    }

    /// Sets the interface down, and up again.
    pub fn bounce(&self) {
        run("ip", &["link", "set", &self.0, "down"]);
        run("ip", &["link", "set", &self.0, "up"]);
    }

    /// Removes the interface from under whoever has it open.
    pub fn remove(&self) {
        run("ip", &["link", "delete", &self.0]);
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.0
    }
}

impl Default for Vcan {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Vcan {
    fn drop(&mut self) {
        // A test may have left it removed.
        let _ = Command::new("ip").args(["link", "delete", &self.0]).output();
    }
}

/// The bus as seen from outside: `candump` records, `cansend` sends. Frames are text as both tools write it.
#[derive(Debug)]
pub struct Wire {
    interface: String,
    candump: Process,
    frames: Vec<String>,
}

impl Wire {
    /// Starts to record and returns once it does.
    #[must_use]
    pub fn on(interface: &Vcan) -> Self {
        let arguments = ["-L", "-r", RECEIVE_BUFFER, interface.name()];
        let candump = Process::spawn("candump", Command::new("candump").args(arguments));
        let mut wire = Self { interface: interface.0.clone(), candump, frames: Vec::new() };
        wire.catch_up();
        wire
    }

    /// Sends one frame, for example `601#4000100000000000`.
    pub fn send(&self, frame: &str) {
        run("cansend", &[&self.interface, frame]);
    }

    /// Plays a log as `candump` writes it, each frame at its time, and returns after the last one.
    pub fn play(&self, log: &Path) {
        let file = log.to_str().expect("temporary paths are UTF-8");
        run("canplayer", &["-I", file]);
    }

    /// Waits until this frame has been on the bus, after those that were already waited for.
    pub fn expect(&mut self, frame: &str) {
        self.wait(frame, |seen| seen == frame);
    }

    /// Waits until TPDO1 of node 1 has shown a statusword whose bits under `mask` are `bits`.
    pub fn expect_statusword(&mut self, mask: u16, bits: u16) {
        self.wait(&format!("statusword {bits:#06X}"), |seen| {
            seen.strip_prefix("181#").and_then(statusword).is_some_and(|word| word & mask == bits)
        });
    }

    /// Sends a request and gives the next frame of this COB-ID, after those that were already waited for.
    pub fn ask(&mut self, request: &str, answer_id: &str) -> String {
        self.send(request);
        self.wait(&format!("answer to {request}"), |seen| seen.split('#').next() == Some(answer_id))
    }

    /// Sends a request again and again until this answer comes.
    pub fn ask_until(&mut self, request: &str, answer: &str) {
        let deadline = Instant::now() + PATIENCE;
        while Instant::now() < deadline {
            self.send(request);
            let again = Instant::now() + REPEAT_PERIOD;
            while let Some(frame) = self.next(again) {
                if frame == answer {
                    return;
                }
            }
        }
        self.candump.give_up(&format!("no {answer} within {PATIENCE:?}"));
    }

    /// Every frame from the start of the recording until now, in bus order.
    #[must_use]
    pub fn finish(mut self) -> Vec<String> {
        self.catch_up();
        self.candump.signal(Signal::SIGTERM);
        self.candump.wait(PATIENCE);
        self.frames
    }

    /// Every frame since the last call, in bus order.
    pub fn take(&mut self) -> Vec<String> {
        self.catch_up();
        std::mem::take(&mut self.frames)
    }

    /// Reads on until a mark of our own comes by: all that was on the bus before it has then been seen.
    fn catch_up(&mut self) {
        let mark = format!("{MARK_ID}#{:08X}", NEXT.fetch_add(1, Ordering::Relaxed));
        let deadline = Instant::now() + PATIENCE;
        while Instant::now() < deadline {
            self.send(&mark);
            let again = Instant::now() + REPEAT_PERIOD;
            while let Some(frame) = self.raw(again) {
                if frame == mark {
                    return;
                }
                self.keep(frame);
            }
        }
        self.candump.give_up("does not see the bus");
    }

    fn wait(&mut self, what: &str, wanted: impl Fn(&str) -> bool) -> String {
        let deadline = Instant::now() + PATIENCE;
        while let Some(frame) = self.next(deadline) {
            if wanted(&frame) {
                return frame;
            }
        }
        self.candump.give_up(&format!("no {what} within {PATIENCE:?}"))
    }

    /// The next frame, if one comes until `deadline`.
    pub fn next(&mut self, deadline: Instant) -> Option<String> {
        while let Some(frame) = self.raw(deadline) {
            if self.keep(frame.clone()) {
                return Some(frame);
            }
        }
        None
    }

    fn keep(&mut self, frame: String) -> bool {
        let ours = frame.starts_with(MARK_ID);
        if !ours {
            self.frames.push(frame);
        }
        !ours
    }

    /// The frame of the next line, which reads `(1700000000.123456) vcan0 181#3706`.
    fn raw(&mut self, deadline: Instant) -> Option<String> {
        let line = self.candump.try_line(deadline)?;
        match line.text.split(' ').collect::<Vec<_>>()[..] {
            [_, _, frame] => Some(frame.to_owned()),
            _ => self.candump.give_up("printed something that is no frame"),
        }
    }
}

fn run(program: &str, arguments: &[&str]) -> ExitStatus {
    let output = Command::new(program).args(arguments).output();
    let output = output.unwrap_or_else(|e| panic!("run {program}: {e}"));
    assert!(output.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output.status
}
