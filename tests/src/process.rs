//! A child process whose lines can be waited for.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

const POLL_PERIOD: Duration = Duration::from_millis(5);

/// One of the two outputs of a child.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stream {
    Out,
    Err,
}

/// One line of a child's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Line {
    pub(crate) stream: Stream,
    pub(crate) text: String,
}

/// A running child. It is killed on drop: end it properly before that.
#[derive(Debug)]
pub(crate) struct Process {
    name: String,
    child: Child,
    lines: Receiver<Line>,
    seen: Vec<Line>,
}

impl Process {
    pub(crate) fn spawn(name: &str, command: &mut Command) -> Self {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|e| panic!("start {name}: {e}"));
        let (sender, lines) = channel();
        read_lines(child.stdout.take(), Stream::Out, sender.clone());
        read_lines(child.stderr.take(), Stream::Err, sender);
        Self { name: name.to_owned(), child, lines, seen: Vec::new() }
    }

    /// Waits until it has said a line that `wanted` takes.
    pub(crate) fn wait_for(&mut self, what: &str, patience: Duration, wanted: impl Fn(&Line) -> bool) {
        let deadline = Instant::now() + patience;
        let mut is_said = self.seen.iter().any(&wanted);
        while !is_said {
            is_said = match self.next_line(deadline) {
                Ok(line) => wanted(&line),
                Err(RecvTimeoutError::Timeout) => self.give_up(&format!("no {what} within {patience:?}")),
                Err(RecvTimeoutError::Disconnected) => self.give_up(&format!("ended before {what}")),
            };
        }
    }

    /// The next line at all, if one comes until `deadline`.
    pub(crate) fn try_line(&mut self, deadline: Instant) -> Option<Line> {
        self.next_line(deadline).ok()
    }

    pub(crate) fn pid(&self) -> Pid {
        Pid::from_raw(i32::try_from(self.child.id()).expect("a process id is an i32"))
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill(self.pid(), signal).unwrap_or_else(|e| panic!("signal {}: {e}", self.name));
    }

    /// Waits for the end and reads what was still to be read.
    pub(crate) fn wait(&mut self, patience: Duration) -> ExitStatus {
        let deadline = Instant::now() + patience;
        while self.next_line(deadline).is_ok() {}
        loop {
            match self.child.try_wait().expect("wait for a child") {
                Some(status) => return status,
                None if Instant::now() > deadline => self.give_up(&format!("still runs after {patience:?}")),
                None => thread::sleep(POLL_PERIOD),
            }
        }
    }

    /// Everything on standard output so far.
    pub(crate) fn stdout(&self) -> String {
        self.said(|stream| stream == Stream::Out)
    }

    /// Everything on either output so far.
    pub(crate) fn printed(&self) -> String {
        self.said(|_| true)
    }

    /// Fails the test with all that was said so far.
    pub(crate) fn give_up(&mut self, why: &str) -> ! {
        while self.try_line(Instant::now()).is_some() {}
        panic!("{}: {why}. It said:\n{}", self.name, self.said(|_| true));
    }

    fn said(&self, by: impl Fn(Stream) -> bool) -> String {
        self.seen.iter().filter(|line| by(line.stream)).map(|line| format!("{}\n", line.text)).collect()
    }

    fn next_line(&mut self, deadline: Instant) -> Result<Line, RecvTimeoutError> {
        let line = self.lines.recv_timeout(deadline.saturating_duration_since(Instant::now()))?;
        self.seen.push(line.clone());
        Ok(line)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Both fail on a child that has ended, which is the usual case.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn read_lines(pipe: Option<impl Read + Send + 'static>, stream: Stream, lines: Sender<Line>) {
    let pipe = BufReader::new(pipe.expect("the child's output is a pipe"));
    thread::spawn(move || {
        for line in pipe.lines() {
            let text = line.expect("the child speaks UTF-8");
            if lines.send(Line { stream, text }).is_err() {
                return;
            }
        }
    });
}
