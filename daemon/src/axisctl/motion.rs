//! `axisctl move`, `jog`, `home` and `stop`: asks for it, shows how far it is, and ends with it.
//!
//! An interrupt (Ctrl-C) halts the axis before this program ends. One that is killed leaves that to the daemon.

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::io::{self, IsTerminal, Write};
use std::sync::Arc;
use std::time::Instant;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

use super::client::{Client, Connection, Heard};
use super::{Output, json, refusal};
use crate::cli::Failure;
use crate::commands::print;
use crate::control::{Ended, Progress, Request, Response};

/// How often a sign of life is given.
const SIGN_OF_LIFE: Duration = Duration::from_millis(250);
/// How long nothing may come of a daemon that tells the progress five times a second.
const MOST_SILENCES: u32 = 40;

pub(super) fn run(client: &Client, output: Output, request: &Request) -> Result<(), Failure> {
    let interrupted = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        // The second one ends this program at once; the daemon then halts the axis.
        let registered = flag::register_conditional_default(signal, Arc::clone(&interrupted))
            .and_then(|_| flag::register(signal, Arc::clone(&interrupted)));
        registered.map_err(|error| Failure::Other(error.to_string()))?;
    }
    let mut connection = client.connect(request)?;
    follow(&mut connection, output, &interrupted)
}

fn follow(connection: &mut Connection, output: Output, interrupted: &AtomicBool) -> Result<(), Failure> {
    let mut line = Line::default();
    let (mut silences, mut is_ending) = (0, false);
    loop {
        if interrupted.load(Ordering::Relaxed) && !is_ending {
            is_ending = true;
            connection.fall_silent();
        }
        let heard = connection.hear(SIGN_OF_LIFE)?;
        if !is_ending {
            connection.live();
        }
        silences = if matches!(heard, Heard::Nothing) { silences + 1 } else { 0 };
        match heard {
            Heard::Nothing if silences > MOST_SILENCES => {
                return Err(Failure::Other("the daemon does not answer".to_owned()));
            }
            Heard::Nothing => {}
            Heard::End => return Err(Failure::Other("the daemon has ended".to_owned())),
            Heard::Response(response) => {
                if output.is_json {
                    print(&(json(&response)? + "\n"))?;
                }
                match *response {
                    Response::Progress(_) if output.is_json => {}
                    Response::Progress(progress) => line.show(&progress),
                    Response::Done(_) if output.is_json => return Ok(()),
                    Response::Done(ended) => {
                        line.end();
                        return print(&ended.iter().map(told).collect::<String>());
                    }
                    other => {
                        line.end();
                        return Err(refusal(other));
                    }
                }
            }
        }
    }
}

fn told(Ended { device, axis, position, text }: &Ended) -> String {
    format!("{device}, axis {axis}: {text}; position {position}\n")
}

/// The progress, on standard error: on a terminal in one line that is written again and again.
#[derive(Debug, Default)]
struct Line {
    is_open: bool,
    told: Option<Instant>,
}

/// Time between two lines where each stays.
const BETWEEN_LINES: Duration = Duration::from_secs(1);

impl Line {
    fn show(&mut self, progress: &Progress) {
        let Progress { device, axis, state, position, velocity, remaining } = progress;
        let remaining = remaining.map(|remaining| format!(", {remaining} to go")).unwrap_or_default();
        let velocity = velocity.map(|velocity| format!(" at {velocity}")).unwrap_or_default();
        let text = format!("{device}, axis {axis}: position {position}{velocity}{remaining}, {state}");
        let mut stderr = io::stderr();
        // Progress that nobody can read is no failure.
        let _ = if stderr.is_terminal() {
            self.is_open = true;
            write!(stderr, "\r\x1b[K{text}").and_then(|()| stderr.flush())
        } else if self.told.is_none_or(|told| told.elapsed() >= BETWEEN_LINES) {
            self.told = Some(Instant::now());
            writeln!(stderr, "{text}")
        } else {
            Ok(())
        };
    }

    fn end(&mut self) {
        if core::mem::take(&mut self.is_open) {
            eprintln!();
        }
    }
}
