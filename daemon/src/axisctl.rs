//! `axisctl`: asks a running daemon by its control socket.

use core::time::Duration;
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use crate::cli::{Failure, conclude};
use crate::commands::print;
use crate::control::{self, Request, Response, place_of_instance, places_to_ask};
use crate::status::{self, Status};

/// How long the daemon may take.
const PATIENCE: Duration = Duration::from_secs(10);

/// Asks a running axisd.
#[derive(Debug, Parser)]
#[command(name = "axisctl", version, about)]
struct Cli {
    /// Control socket of the daemon [default: /run/axisd/control.sock, then $XDG_RUNTIME_DIR/axisd/control.sock]
    #[arg(long, global = true, value_name = "PATH")]
    socket: Option<PathBuf>,
    /// Ask the service axisd@NAME
    #[arg(long, global = true, value_name = "NAME", conflicts_with = "socket")]
    instance: Option<String>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Show devices and buses, and what went wrong
    Status {
        /// Print it as JSON, for programs
        #[arg(long)]
        json: bool,
    },
    /// Break and repair the simulated machine behind the axes
    #[command(subcommand)]
    Fault(Fault),
}

#[derive(Debug, Subcommand)]
enum Fault {
    /// Break something: encoder-break, blocked-shaft, stuck-switch:INPUT=LEVEL, drive-fault:CAUSE, supply-dip:VOLTS,
    /// connection-loss
    Inject {
        /// Name of the device
        device: String,
        /// What breaks, such as blocked-shaft or stuck-switch:positive-limit=high
        fault: String,
        /// Number of the axis, from 1 [default: every axis of the device]
        #[arg(long, value_name = "N")]
        axis: Option<usize>,
    },
    /// Repair something; its voltage, level or cause may be left out
    Clear {
        /// Name of the device
        device: String,
        /// What is repaired, such as supply-dip, or all
        fault: String,
        /// Number of the axis, from 1 [default: every axis of the device]
        #[arg(long, value_name = "N")]
        axis: Option<usize>,
    },
    /// Show what is broken
    List {
        /// Name of the device [default: every device]
        device: Option<String>,
    },
}

/// The command line of `axisctl`, for its manual and the completion of shells.
#[must_use]
pub fn command() -> clap::Command {
    Cli::command()
}

/// Runs the command that the process was started with.
pub fn main() -> ExitCode {
    let Cli { socket, instance, command } = Cli::parse();
    let place = socket.or_else(|| instance.as_deref().map(place_of_instance));
    let places = place.map_or_else(places_to_ask, |place| vec![place]);
    let done = match command {
        Command::Status { json } => show_status(&places, json),
        Command::Fault(fault) => show_faults(&places, fault),
    };
    conclude("axisctl", done)
}

fn show_status(places: &[PathBuf], as_json: bool) -> Result<(), Failure> {
    let status = match ask(places, &Request::Status {})? {
        Response::Status(status) => status,
        other => return Err(refusal(other)),
    };
    let text = if as_json { json(&status)? } else { status::text(&status) };
    print(&text)
}

/// Does what is asked and shows what is then broken.
fn show_faults(places: &[PathBuf], fault: Fault) -> Result<(), Failure> {
    let request = match fault {
        Fault::Inject { device, fault, axis } => Request::FaultInject { device, axis, fault },
        Fault::Clear { device, fault, axis } => Request::FaultClear { device, axis, fault },
        Fault::List { device } => Request::FaultList { device },
    };
    match ask(places, &request)? {
        Response::Faults(faults) => print(&control::text(&faults)),
        other => Err(refusal(other)),
    }
}

/// Why there is no answer to what was asked.
fn refusal(response: Response) -> Failure {
    match response {
        Response::Error(error) => Failure::Other(error),
        Response::Status(_) | Response::Faults(_) => {
            Failure::Other("the daemon answers something else than it was asked".to_owned())
        }
    }
}

fn json(status: &Status) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(status).map_err(|error| Failure::Other(error.to_string()))?;
    Ok(text + "\n")
}

/// The answer of the first daemon that there is.
fn ask(places: &[PathBuf], request: &Request) -> Result<Response, Failure> {
    let mut tried = Vec::new();
    for place in places {
        match ask_at(place, request) {
            Ok(response) => return Ok(response),
            Err(error) => tried.push(format!("{}: {error}", place.display())),
        }
    }
    Err(Failure::Other(format!("no daemon answers; tried {}", tried.join(", "))))
}

fn ask_at(place: &Path, request: &Request) -> io::Result<Response> {
    let mut stream = UnixStream::connect(place)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut line = serde_json::to_string(request)?;
    line.push('\n');
    // A daemon that has no place for one more client says so and leaves before it reads.
    let written = stream.write_all(line.as_bytes());
    let mut answer = String::new();
    BufReader::new(stream).read_line(&mut answer)?;
    if answer.is_empty() {
        written?;
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(serde_json::from_str(&answer)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
