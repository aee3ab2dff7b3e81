//! The command line.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};

use crate::{commands, run};

/// EX_CONFIG of `sysexits.h`: something is wrong with the configuration.
const CONFIGURATION_ERROR: u8 = 78;

/// Puts motion axes on fieldbuses.
#[derive(Debug, Parser)]
#[command(name = "axisd", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Serve the devices of a configuration until SIGTERM or SIGINT; SIGHUP reloads it
    Run(Run),
    /// Say everything that is wrong with a configuration
    Check {
        /// Configuration file
        file: PathBuf,
        /// Print the findings as JSON, for editors and other programs
        #[arg(long)]
        json: bool,
        /// Print what comes of it, with all that it leaves to profiles, motors and defaults
        #[arg(long)]
        explain: bool,
    },
    /// Print the electronic data sheet of a device
    Eds {
        /// Configuration file
        #[arg(long, value_name = "FILE")]
        config: PathBuf,
        /// Name of the device
        #[arg(long, value_name = "NAME")]
        device: String,
        /// What to make of it
        #[arg(long, value_enum, default_value_t = Form::Eds)]
        format: Form,
    },
    /// Print the Modbus registers of a device
    Registers {
        /// Configuration file
        #[arg(long, value_name = "FILE")]
        config: PathBuf,
        /// Name of the device
        #[arg(long, value_name = "NAME")]
        device: String,
    },
}

/// A form of the data sheet.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Form {
    /// Text, by CiA 306
    Eds,
    /// XML, by CiA 311
    Xdd,
}

impl Form {
    const fn writer(self) -> fn(&od::Sheet<'_>) -> String {
        match self {
            Self::Eds => od::eds::write,
            Self::Xdd => od::xdd::write,
        }
    }
}

#[derive(Args, Debug)]
struct Run {
    #[command(flatten)]
    source: Source,
    /// Where the demo listens for socketcand clients
    #[arg(long, value_name = "ADDR:PORT", conflicts_with = "config")]
    socketcand: Option<SocketAddr>,
}

#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
struct Source {
    /// Configuration file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Two motors on a virtual bus, reached by TCP: no CAN hardware is needed
    #[arg(long)]
    demo: bool,
}

/// Why a command failed; the text is for standard error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    /// The configuration is wrong.
    Configuration(String),
    /// The configuration is wrong, and standard output has said so.
    ConfigurationShown,
    /// Anything else.
    Other(String),
}

impl Failure {
    /// The text; none where it is shown already.
    pub(crate) fn into_text(self) -> String {
        match self {
            Self::Configuration(text) | Self::Other(text) => text,
            Self::ConfigurationShown => String::new(),
        }
    }
}

/// The command line of `axisd`, for its manual and the completion of shells.
#[must_use]
pub fn command() -> clap::Command {
    Cli::command()
}

/// Runs the command that the process was started with.
pub fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Run(Run { source: Source { config: Some(file), .. }, .. }) => run::file(&file),
        Command::Run(Run { source: Source { config: None, .. }, socketcand }) => run::demo(socketcand),
        Command::Check { file, json, explain } => commands::check(&file, json, explain),
        Command::Eds { config, device, format } => commands::eds(&config, &device, format.writer()),
        Command::Registers { config, device } => commands::registers(&config, &device),
    };
    conclude("axisd", done)
}

/// The exit code of `program`; why it failed goes to standard error.
pub(crate) fn conclude(program: &str, done: Result<(), Failure>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Configuration(text)) => {
            eprintln!("{text}");
            ExitCode::from(CONFIGURATION_ERROR)
        }
        Err(Failure::ConfigurationShown) => ExitCode::from(CONFIGURATION_ERROR),
        Err(Failure::Other(text)) => {
            eprintln!("{program}: {text}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn run_needs_either_a_file_or_the_demo() {
        let parse = |line: &str| Cli::try_parse_from(line.split(' ')).is_ok();
        assert!(parse("axisd run --config x.toml"));
        assert!(parse("axisd run --demo --socketcand 127.0.0.1:1234"));
        assert!(!parse("axisd run"));
        assert!(!parse("axisd run --demo --config x.toml"));
        assert!(!parse("axisd run --config x.toml --socketcand 127.0.0.1:1234"));
    }
}
