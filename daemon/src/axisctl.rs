//! `axisctl`: asks a running daemon by its control socket, and commands its axes.

mod client;
mod command_line;
mod dump;
mod motion;
mod objects;
mod status;

use core::time::Duration;
use std::process::ExitCode;

use clap::Parser;
use serde::Serialize;

use crate::cli::{Failure, conclude};
use crate::commands::print;
use crate::control::{self, Request, Response, place_of_instance};
use crate::reload::Report;
use client::Client;
use command_line::{Cli, Command, Fault, Nmt, Signal};

pub use command_line::command;

/// Runs the command that the process was started with.
pub fn main() -> ExitCode {
    let Cli { socket, instance, json, command } = Cli::parse();
    let output = Output { is_json: json };
    let client = Client::new(socket.or_else(|| instance.as_deref().map(place_of_instance)));
    let done = match command {
        Command::Status => status::show(&client, output),
        Command::Watch { interval, count } => status::watch(&client, output, interval.0, count),
        Command::Od(od) => objects::run(&client, output, od),
        Command::Move(order) => motion::run(&client, output, &order.into()),
        Command::Jog(order) => motion::run(&client, output, &order.into()),
        Command::Home(order) => motion::run(&client, output, &order.into()),
        Command::Stop(order) => motion::run(&client, output, &order.into()),
        Command::Claim(claim) => show_owners(&client, output, &claim.into()),
        Command::Release(release) => show_owners(&client, output, &release.into()),
        Command::Nmt(nmt) => command_nodes(&client, output, nmt),
        Command::Lss(lss) => show_slave(&client, output, &lss.into()),
        Command::Dump(dump) => dump::run(&client, output, &dump),
        Command::Fault(fault) => show_faults(&client, output, fault),
        Command::Signal(signal) => show_signals(&client, output, signal),
        Command::Reload => reload(&client, output),
        Command::Log { change } => show_log(&client, output, change),
        Command::Audit { count } => show_audit(&client, output, count),
        Command::Version => show_version(&client, output),
    };
    conclude("axisctl", done)
}

/// How long an LSS task may take: a scan takes seconds, and a slave has seconds to store.
const LSS_PATIENCE: Duration = Duration::from_secs(30);

/// How long a reload may take: axes that leave ramp down for seconds, and what is being stored is waited for.
const RELOAD_PATIENCE: Duration = Duration::from_secs(60);

/// For whom the output is.
#[derive(Clone, Copy, Debug)]
struct Output {
    is_json: bool,
}

impl Output {
    /// Prints `value` for programs as one line, or `text` of it for people.
    fn print<T: Serialize>(self, value: &T, text: impl FnOnce(&T) -> String) -> Result<(), Failure> {
        if self.is_json { print(&(json(value)? + "\n")) } else { print(&text(value)) }
    }
}

/// Does what is asked and shows what is then broken.
fn show_faults(client: &Client, output: Output, fault: Fault) -> Result<(), Failure> {
    let request = match fault {
        Fault::Inject { device, fault, axis } => Request::FaultInject { device, axis, fault },
        Fault::Clear { device, fault, axis } => Request::FaultClear { device, axis, fault },
        Fault::List { device } => Request::FaultList { device },
    };
    match client.ask(&request)? {
        Response::Faults(faults) => output.print(&faults, |faults| control::text(faults)),
        other => Err(refusal(other)),
    }
}

/// Sets what is asked and shows what then comes to the axes.
fn show_signals(client: &Client, output: Output, signal: Signal) -> Result<(), Failure> {
    let request = match signal {
        Signal::Set { device, signal, axis } => Request::SignalSet { device, axis, signal },
        Signal::List { device } => Request::SignalList { device },
    };
    match client.ask(&request)? {
        Response::Signals(signals) => output.print(&signals, |signals| control::signals_text(signals)),
        other => Err(refusal(other)),
    }
}

fn show_owners(client: &Client, output: Output, request: &Request) -> Result<(), Failure> {
    match client.ask(request)? {
        Response::Owners(owners) => output.print(&owners, |owners| control::owners_text(owners)),
        other => Err(refusal(other)),
    }
}

fn command_nodes(client: &Client, output: Output, Nmt { target, command, bus }: Nmt) -> Result<(), Failure> {
    match client.ask(&Request::Nmt { target, command: command.word().to_owned(), bus })? {
        Response::Commanded(commanded) => output.print(&commanded, |commanded| status::commanded(commanded)),
        other => Err(refusal(other)),
    }
}

fn show_slave(client: &Client, output: Output, request: &Request) -> Result<(), Failure> {
    match client.connect(request)?.next(LSS_PATIENCE)? {
        Response::Lss(found) => output.print(&found, status::slave),
        other => Err(refusal(other)),
    }
}

/// Lets the daemon reload, and fails if it refuses the file.
fn reload(client: &Client, output: Output) -> Result<(), Failure> {
    match client.connect(&Request::Reload {})?.next(RELOAD_PATIENCE)? {
        Response::Reload(report) if report.is_refused() && output.is_json => {
            output.print(&report, Report::text)?;
            Err(Failure::ConfigurationShown)
        }
        Response::Reload(report) if report.is_refused() => Err(Failure::Configuration(report.text())),
        Response::Reload(report) => output.print(&report, Report::text),
        other => Err(refusal(other)),
    }
}

fn show_log(client: &Client, output: Output, change: Option<String>) -> Result<(), Failure> {
    match client.ask(&Request::Log { change })? {
        Response::Log(levels) => output.print(&levels, control::levels_text),
        other => Err(refusal(other)),
    }
}

fn show_audit(client: &Client, output: Output, count: usize) -> Result<(), Failure> {
    match client.ask(&Request::Audit { count })? {
        Response::Audit(entries) => output.print(&entries, |entries| control::audit_text(entries)),
        other => Err(refusal(other)),
    }
}

fn show_version(client: &Client, output: Output) -> Result<(), Failure> {
    match client.ask(&Request::Version {})? {
        Response::Version(version) => output.print(&version, |version| {
            format!("axisd {}, control protocol {}\n", version.daemon, version.protocol)
        }),
        other => Err(refusal(other)),
    }
}

/// Why there is no answer to what was asked.
fn refusal(response: Response) -> Failure {
    match response {
        Response::Error(error) => Failure::Other(error),
        Response::Version(_)
        | Response::Status(_)
        | Response::Faults(_)
        | Response::Signals(_)
        | Response::Reload(_)
        | Response::Log(_)
        | Response::Audit(_)
        | Response::Objects(_)
        | Response::Sheet(_)
        | Response::Progress(_)
        | Response::Done(_)
        | Response::Owners(_)
        | Response::Commanded(_)
        | Response::Lss(_)
        | Response::Watching(_)
        | Response::Frame(_)
        | Response::Dropped(_) => {
            Failure::Other("the daemon answers something else than it was asked".to_owned())
        }
    }
}

fn json<T: Serialize>(value: &T) -> Result<String, Failure> {
    serde_json::to_string(value).map_err(|error| Failure::Other(error.to_string()))
}
