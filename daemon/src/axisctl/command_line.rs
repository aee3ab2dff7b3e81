//! The command line of `axisctl`, in one place: man pages and shell completions are made of it.

use core::str::FromStr;
use core::time::Duration;
use std::path::PathBuf;

use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};

use crate::control::Request;

/// The command line, for whoever makes man pages or completions of it.
#[must_use]
pub fn command() -> clap::Command {
    Cli::command()
}

/// Asks a running axisd, and commands its axes
#[derive(Debug, Parser)]
#[command(name = "axisctl", version, about)]
pub(super) struct Cli {
    /// Control socket of the daemon [default: /run/axisd/control.sock, then $XDG_RUNTIME_DIR/axisd/control.sock]
    #[arg(long, global = true, value_name = "PATH")]
    pub(super) socket: Option<PathBuf>,
    /// Ask the service axisd@NAME
    #[arg(long, global = true, value_name = "NAME", conflicts_with = "socket")]
    pub(super) instance: Option<String>,
    /// Print JSON, for programs: one line for each answer
    #[arg(long, global = true)]
    pub(super) json: bool,
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Show devices and buses, and what went wrong
    Status,
    /// Show the status again and again, until interrupted or the daemon ends
    Watch {
        /// Time between two looks, in seconds
        #[arg(long, value_name = "SECONDS", default_value = "0.5")]
        interval: Seconds,
        /// End after so many looks
        #[arg(long, value_name = "N")]
        count: Option<u64>,
    },
    /// Read and write objects of a device
    #[command(subcommand)]
    Od(Od),
    /// Move an axis to a position and wait until it is there
    Move(Move),
    /// Run an axis at a velocity until interrupted; it stops when this program ends, however it ends
    Jog(Jog),
    /// Find the origin of an axis and wait until it is found
    Home(Home),
    /// Stop axes by the quick stop and wait until they are at rest
    Stop(Stop),
    /// Let one alone command an axis, until it is released or claimed again; everybody reads, and stop always works
    Claim(Claim),
    /// Give an axis back to whom the configuration names
    Release(Release),
    /// Send an NMT command
    Nmt(Nmt),
    /// Give Node-IDs by LSS
    #[command(subcommand)]
    Lss(Lss),
    /// Show CAN traffic in words, live or from a log of candump
    Dump(Dump),
    /// Break and repair the simulated machine behind the axes
    #[command(subcommand)]
    Fault(Fault),
    /// Set and show what comes to simulated axes from outside: analogue inputs, external encoders
    #[command(subcommand)]
    Signal(Signal),
    /// Take the configuration as its file now says, and show what that changed; what did not change is not touched
    Reload,
    /// Show how much is logged, or change it while the daemon runs
    Log {
        /// A level for all modules (off, error, warn, info, debug, trace), or MODULE=LEVEL [default: change nothing]
        change: Option<String>,
    },
    /// Show the last entries of the audit trail: who commanded what
    Audit {
        /// How many, at most 1000
        #[arg(long, short = 'n', value_name = "N", default_value_t = 20)]
        count: usize,
    },
    /// Show the version of the running daemon
    Version,
}

/// How an object is named.
const OBJECT: &str = "Entry by number, such as 0x6040:00 or 6040 (hexadecimal), or by name, such as controlword or \
                      \"identity object:serial number\"; a name may be cut short";

#[derive(Debug, Subcommand)]
pub(super) enum Od {
    /// List the objects of a device with their values
    List {
        /// Name of the device
        device: String,
        /// Only those whose name holds this, without case
        filter: Option<String>,
        /// Bus whose communication objects are meant [default: the first of the device]
        #[arg(long)]
        bus: Option<String>,
    },
    /// Read an entry, or all entries of an object
    Read {
        /// Name of the device
        device: String,
        #[arg(help = OBJECT)]
        object: String,
        /// Bus whose communication objects are meant [default: the first of the device]
        #[arg(long)]
        bus: Option<String>,
    },
    /// Write an entry and show what it then holds
    #[command(allow_negative_numbers = true)]
    Write {
        /// Name of the device
        device: String,
        #[arg(help = OBJECT)]
        object: String,
        /// Value: decimal, 0x hexadecimal, 0b binary, a real, true or false, a text, or bytes in hexadecimal
        value: String,
        /// Bus whose communication objects are meant [default: the first of the device]
        #[arg(long)]
        bus: Option<String>,
    },
    /// Print the data sheet of a device, or with it how the device is configured now
    Export {
        /// Name of the device
        device: String,
        /// What to make of it
        #[arg(long, value_enum, default_value_t = SheetFormat::Dcf)]
        format: SheetFormat,
        /// Bus whose communication objects are meant [default: the first of the device]
        #[arg(long)]
        bus: Option<String>,
    },
}

/// The forms of a data sheet.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum SheetFormat {
    /// What the kind of device is, as text (CiA 306)
    Eds,
    /// Also the Node-ID and the values of all parameters (CiA 306)
    Dcf,
    /// As eds, in XML (CiA 311)
    Xdd,
    /// As dcf, in XML (CiA 311)
    Xdc,
}

impl SheetFormat {
    /// The word of the protocol.
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Eds => "eds",
            Self::Dcf => "dcf",
            Self::Xdd => "xdd",
            Self::Xdc => "xdc",
        }
    }
}

#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub(super) struct Move {
    /// Name of the device
    device: String,
    /// Target in user units of the device, or with --relative how far from where the axis is to be now
    position: i64,
    /// Number of the axis, from 1
    #[arg(long, value_name = "N", default_value_t = 1)]
    axis: usize,
    /// Move by a distance
    #[arg(long)]
    relative: bool,
    /// Profile velocity (0x6081) [default: as it is]
    #[arg(long, value_name = "VELOCITY")]
    velocity: Option<i64>,
    /// Profile acceleration and deceleration (0x6083, 0x6084) [default: as they are]
    #[arg(long, value_name = "ACCELERATION")]
    acceleration: Option<i64>,
}

#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub(super) struct Jog {
    /// Name of the device
    device: String,
    /// Target velocity (0x60FF) in user units of the device
    velocity: i64,
    /// Number of the axis, from 1
    #[arg(long, value_name = "N", default_value_t = 1)]
    axis: usize,
    /// Profile acceleration and deceleration (0x6083, 0x6084) [default: as they are]
    #[arg(long, value_name = "ACCELERATION")]
    acceleration: Option<i64>,
    /// End after so many seconds
    #[arg(long, value_name = "SECONDS")]
    time: Option<Seconds>,
}

#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub(super) struct Home {
    /// Name of the device
    device: String,
    /// Number of the axis, from 1
    #[arg(long, value_name = "N", default_value_t = 1)]
    axis: usize,
    /// Homing method (0x6098) [default: as it is]
    #[arg(long, value_name = "METHOD")]
    method: Option<i64>,
}

#[derive(Args, Debug)]
pub(super) struct Stop {
    /// Name of the device
    #[arg(required_unless_present = "all", conflicts_with = "all")]
    device: Option<String>,
    /// Number of the axis, from 1 [default: every axis of the device]
    #[arg(long, value_name = "N", conflicts_with = "all")]
    axis: Option<usize>,
    /// Stop every axis of every device
    #[arg(long)]
    all: bool,
}

#[derive(Args, Debug)]
pub(super) struct Claim {
    /// Name of the device
    device: String,
    /// Number of the axis, from 1 [default: every axis of the device]
    #[arg(long, value_name = "N")]
    axis: Option<usize>,
    /// Who is to command it: a bus of the device, modbus, or local for axisctl
    #[arg(long = "for", value_name = "BUS|modbus|local")]
    owner: String,
}

#[derive(Args, Debug)]
pub(super) struct Release {
    /// Name of the device
    device: String,
    /// Number of the axis, from 1 [default: every axis of the device]
    #[arg(long, value_name = "N")]
    axis: Option<usize>,
}

#[derive(Args, Debug)]
pub(super) struct Nmt {
    /// Name of a device, a Node-ID from 1 to 127 that need not be ours, or all
    #[arg(value_name = "DEVICE|NODE|all")]
    pub(super) target: String,
    /// What to do
    pub(super) command: NmtWord,
    /// Bus to send it on [default: those of the device, or the only one]
    #[arg(long)]
    pub(super) bus: Option<String>,
}

/// NMT commands.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum NmtWord {
    /// Enter OPERATIONAL
    Start,
    /// Enter STOPPED
    Stop,
    /// Enter PRE-OPERATIONAL
    Preop,
    /// Reset node
    Reset,
    /// Reset communication
    ResetComm,
}

impl NmtWord {
    /// The word of the protocol.
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Stop => "stop",
            Self::Preop => "preop",
            Self::Reset => "reset",
            Self::ResetComm => "reset-comm",
        }
    }
}

/// How an LSS slave is named.
const ADDRESS: &str =
    "Vendor-ID, product code, revision and serial number (0x1018), such as 279:256:0x10003:1";

#[derive(Debug, Subcommand)]
pub(super) enum Lss {
    /// Find a slave without a Node-ID by fastscan
    Scan {
        /// Bus [default: the only one]
        #[arg(long)]
        bus: Option<String>,
    },
    /// Ask a slave for its Node-ID
    Inquire {
        #[arg(value_name = "ADDRESS", help = ADDRESS)]
        address: LssAddress,
        /// Bus [default: the only one]
        #[arg(long)]
        bus: Option<String>,
    },
    /// Give a slave a Node-ID and let it store that
    Configure {
        /// Node-ID from 1 to 127, or 255 to take it away
        node_id: u8,
        #[arg(long, value_name = "ADDRESS", help = format!("{ADDRESS} [default: one without a Node-ID, by fastscan]"))]
        address: Option<LssAddress>,
        /// Bus [default: the only one]
        #[arg(long)]
        bus: Option<String>,
    },
}

/// The four numbers that an LSS slave is known by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LssAddress([u32; 4]);

impl FromStr for LssAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |word: &str| match word.strip_prefix("0x") {
            Some(digits) => u32::from_str_radix(digits, 16).ok().filter(|_| !digits.starts_with('+')),
            None => word.parse().ok(),
        };
        let numbers: Option<Vec<u32>> = text.split(':').map(number).collect();
        let numbers = numbers.and_then(|numbers| <[u32; 4]>::try_from(numbers).ok());
        numbers.map(Self).ok_or_else(|| "give four numbers with colons between them".to_owned())
    }
}

impl From<Lss> for Request {
    fn from(lss: Lss) -> Self {
        let (action, address, node_id, bus) = match lss {
            Lss::Scan { bus } => ("scan", None, None, bus),
            Lss::Inquire { address, bus } => ("inquire", Some(address), None, bus),
            Lss::Configure { node_id, address, bus } => ("configure", address, Some(node_id), bus),
        };
        Self::Lss { action: action.to_owned(), address: address.map(|address| address.0), node_id, bus }
    }
}

#[derive(Args, Debug)]
pub(super) struct Dump {
    /// Name of the bus [default: all]
    pub(super) bus: Option<String>,
    /// Decode this log of candump, plain or of candump -L, instead of live traffic; - is standard input
    #[arg(long, value_name = "CANDUMP.log")]
    pub(super) file: Option<PathBuf>,
    /// Configuration that says which nodes the log is of
    #[arg(long, value_name = "FILE", requires = "file")]
    pub(super) config: Option<PathBuf>,
    /// End after so many frames
    #[arg(long, value_name = "N")]
    pub(super) count: Option<u64>,
}

#[derive(Debug, Subcommand)]
pub(super) enum Fault {
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

#[derive(Debug, Subcommand)]
pub(super) enum Signal {
    /// Set a signal: analog-input:VOLTS, external-encoder:COUNTS_PER_SECOND
    Set {
        /// Name of the device
        device: String,
        /// What it is to be, such as analog-input:2.5
        signal: String,
        /// Number of the axis, from 1 [default: every axis of the device]
        #[arg(long, value_name = "N")]
        axis: Option<usize>,
    },
    /// Show what comes to axes
    List {
        /// Name of the device [default: every device]
        device: Option<String>,
    },
}

/// A time, given in seconds: up to a day, at least a hundredth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seconds(pub(super) Duration);

impl FromStr for Seconds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const ALLOWED: core::ops::RangeInclusive<f64> = 0.01..=86_400.0;
        let seconds = text.parse::<f64>().ok().filter(|seconds| ALLOWED.contains(seconds));
        let seconds = seconds.ok_or_else(|| "give seconds, from 0.01 to 86400".to_owned())?;
        Ok(Self(Duration::from_secs_f64(seconds)))
    }
}

impl From<Move> for Request {
    fn from(Move { device, position, axis, relative, velocity, acceleration }: Move) -> Self {
        Self::Move { device, axis: Some(axis), position, relative, velocity, acceleration }
    }
}

impl From<Jog> for Request {
    fn from(Jog { device, velocity, axis, acceleration, time }: Jog) -> Self {
        let time_ms = time.map(|time| u64::try_from(time.0.as_millis()).unwrap_or(u64::MAX));
        Self::Jog { device, axis: Some(axis), velocity, acceleration, time_ms }
    }
}

impl From<Home> for Request {
    fn from(Home { device, axis, method }: Home) -> Self {
        Self::Home { device, axis: Some(axis), method }
    }
}

impl From<Stop> for Request {
    fn from(Stop { device, axis, all: _ }: Stop) -> Self {
        Self::Stop { device, axis }
    }
}

impl From<Claim> for Request {
    fn from(Claim { device, axis, owner }: Claim) -> Self {
        Self::Claim { device, axis, owner }
    }
}

impl From<Release> for Request {
    fn from(Release { device, axis }: Release) -> Self {
        Self::Release { device, axis }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::NMT_COMMANDS;

    fn parse(line: &str) -> Result<Command, String> {
        Cli::try_parse_from(line.split(' ')).map(|cli| cli.command).map_err(|error| error.to_string())
    }

    #[test]
    fn the_command_line_is_consistent() {
        command().debug_assert();
    }

    #[test]
    fn numbers_may_be_negative() {
        let Ok(Command::Move(order)) = parse("axisctl move x -500 --relative --velocity 10") else {
            panic!()
        };
        assert_eq!((order.position, order.relative, order.velocity), (-500, true, Some(10)));
        assert!(parse("axisctl jog x -500 --time 0.5").is_ok());
        assert!(parse("axisctl home x --method -1").is_ok());
        assert!(parse("axisctl od write x 607A -1").is_ok());
    }

    #[test]
    fn stop_wants_a_device_or_all() {
        assert!(parse("axisctl stop x").is_ok() && parse("axisctl stop --all").is_ok());
        assert!(parse("axisctl stop").is_err() && parse("axisctl stop x --all").is_err());
    }

    #[test]
    fn a_claim_says_for_whom() {
        assert!(parse("axisctl claim x --for modbus").is_ok() && parse("axisctl release x --axis 2").is_ok());
        assert!(parse("axisctl claim x").is_err() && parse("axisctl release x --for modbus").is_err());
    }

    #[test]
    fn an_lss_address_has_four_numbers() {
        assert_eq!("279:256:0x10003:1".parse(), Ok(LssAddress([279, 256, 0x1_0003, 1])));
        for wrong in ["", "1:2:3", "1:2:3:4:5", "1:2:3:x", "1:2:3:-4", "1:2:3:0x100000000", "1:2:3:0x+1"] {
            assert!(wrong.parse::<LssAddress>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_are_seconds() {
        assert_eq!("0.25".parse(), Ok(Seconds(Duration::from_millis(250))));
        for wrong in ["0", "-1", "nan", "inf", "1e9", "x"] {
            assert!(wrong.parse::<Seconds>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_words_of_nmt_are_those_of_the_protocol() {
        let words = NmtWord::value_variants().iter().map(|word| word.word());
        assert_eq!(words.collect::<Vec<_>>(), NMT_COMMANDS.map(|(word, _)| word));
    }
}
