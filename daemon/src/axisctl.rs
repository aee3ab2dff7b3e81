//! `axisctl`: asks a running daemon by its control socket.

use core::time::Duration;
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::cli::{Failure, conclude};
use crate::commands::print;
use crate::control::{Request, Response, default_places};
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
}

/// Runs the command that the process was started with.
pub fn main() -> ExitCode {
    let Cli { socket, command } = Cli::parse();
    let places = socket.map_or_else(default_places, |socket| vec![socket]);
    let done = match command {
        Command::Status { json } => show_status(&places, json),
    };
    conclude("axisctl", done)
}

fn show_status(places: &[PathBuf], as_json: bool) -> Result<(), Failure> {
    let status = match ask(places, &Request::Status {})? {
        Response::Status(status) => status,
        Response::Error(error) => return Err(Failure::Other(error)),
    };
    let text = if as_json { json(&status)? } else { status::text(&status) };
    print(&text)
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
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
