//! What a line asks for (CiA 309-3, command syntax).

use core::time::Duration;

use od::Address;

use super::LONGEST_LINE;
use super::answer::GatewayError;
use super::pdo::{self, Setup};
use super::value::Form;
use super::words::{Words, unsigned};
use crate::lss::{LssAddress, command as specifier};
use crate::{NmtCommand, UNCONFIGURED};

/// A line that asks for something.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Line {
    /// What the answer begins with.
    pub(super) sequence: u32,
    pub(super) request: Result<Request, GatewayError>,
}

/// A command and whom it is for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Request {
    /// The numbers before the command.
    pub(super) target: Target,
    pub(super) command: Command,
}

/// The numbers before a command: one is a node before a command to a node, and else a net.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    None,
    One(u64),
    Two(u64, u64),
}

/// Whom a command can be for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scope {
    Gateway,
    Net,
    Node,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Command {
    Read {
        address: Address,
        form: Form,
    },
    Write {
        address: Address,
        data: Vec<u8>,
    },
    Nmt(NmtCommand),
    EnableGuarding {
        period: Duration,
        factor: u8,
    },
    DisableGuarding,
    EnableHeartbeat(Duration),
    DisableHeartbeat,
    SetSdoTimeout(Duration),
    SetSdoBlock(bool),
    SetRpdo(Setup),
    SetTpdo(Setup),
    ReadPdo(u16),
    WritePdo {
        number: u16,
        values: Vec<u64>,
    },
    SetNodeId(u8),
    SetHeartbeat(Duration),
    SetNode(u8),
    BootUpIndication(bool),
    SetNetwork(u16),
    SetCommandTimeout(Duration),
    SetCommandSize(usize),
    Version,
    Lss(Lss),
    /// It is known and not there: the bit rate is that of an interface, which the gateway only uses.
    Initialise,
}

/// A service of the LSS master (CiA 305).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lss {
    SwitchGlobal {
        to_configuration: bool,
    },
    SwitchSelective(LssAddress),
    SetNodeId(u8),
    SetBitRate {
        table: u8,
        index: u8,
    },
    ActivateBitRate {
        delay_ms: u16,
    },
    Store,
    /// One part of the address, from 0.
    InquirePart(u8),
    InquireAddress,
    InquireNodeId,
    /// Vendor-ID and product code, then lowest and highest revision and serial number.
    Identify([u32; 6]),
    IdentifyUnconfigured,
    /// Not of the standard: find a slave without a Node-ID and select it. Such a question waits so long for an answer.
    Fastscan(Option<Duration>),
}

/// Reads a line; `None` if it asks for nothing.
pub(super) fn parse(line: &str) -> Option<Line> {
    let mut words = Words::new(line);
    words.peek()?;
    Some(match sequence(&mut words) {
        Some(sequence) => Line { sequence, request: request(&mut words) },
        None => Line { sequence: 0, request: Err(GatewayError::Syntax) },
    })
}

/// The number in brackets, behind which a blank may be missing.
fn sequence(words: &mut Words<'_>) -> Option<u32> {
    let rest = words.rest().strip_prefix('[')?;
    let (number, rest) = rest.split_once(']')?;
    *words = Words::new(rest);
    u32::try_from(unsigned(number.trim())?).ok()
}

fn request(words: &mut Words<'_>) -> Result<Request, GatewayError> {
    let mut number = || {
        let number = unsigned(words.peek()?)?;
        words.next();
        Some(number)
    };
    let target = match (number(), number()) {
        (None, _) => Target::None,
        (Some(one), None) => Target::One(one),
        (Some(one), Some(two)) => Target::Two(one, two),
    };
    let command = command(words)?;
    words.end()?;
    Ok(Request { target, command })
}

fn command(words: &mut Words<'_>) -> Result<Command, GatewayError> {
    let word = words.next().ok_or(GatewayError::Syntax)?.to_ascii_lowercase();
    Ok(match word.as_str() {
        "r" | "read" if is_pdo(words) => Command::ReadPdo(pdo::number(words)?),
        "r" | "read" => {
            let address = address(words)?;
            let form = words.next().map_or(Some(Form::Bytes), Form::from_word);
            Command::Read { address, form: form.ok_or(GatewayError::Syntax)? }
        }
        "w" | "write" if is_pdo(words) => {
            let (number, count) = (pdo::number(words)?, words.number::<u8>()?);
            let values = (0..count).map(|_| words.number::<u64>()).collect::<Result<_, _>>()?;
            Command::WritePdo { number, values }
        }
        "w" | "write" => {
            let address = address(words)?;
            let form = words.next().and_then(Form::from_word).ok_or(GatewayError::Syntax)?;
            Command::Write { address, data: form.parse(words).ok_or(GatewayError::Syntax)? }
        }
        "start" => Command::Nmt(NmtCommand::Start),
        "stop" => Command::Nmt(NmtCommand::Stop),
        "preop" | "preoperational" => Command::Nmt(NmtCommand::EnterPreOperational),
        "reset" => match keyword(words)?.as_str() {
            "node" => Command::Nmt(NmtCommand::ResetNode),
            "comm" | "communication" => Command::Nmt(NmtCommand::ResetCommunication),
            _ => return Err(GatewayError::Syntax),
        },
        "enable" => match keyword(words)?.as_str() {
            "guarding" => Command::EnableGuarding { period: millis(words)?, factor: words.number()? },
            "heartbeat" => Command::EnableHeartbeat(millis(words)?),
            _ => return Err(GatewayError::Syntax),
        },
        "disable" => match keyword(words)?.as_str() {
            "guarding" => Command::DisableGuarding,
            "heartbeat" => Command::DisableHeartbeat,
            _ => return Err(GatewayError::Syntax),
        },
        "set" => setting(words)?,
        "boot_up_indication" => match keyword(words)?.as_str() {
            "enable" => Command::BootUpIndication(true),
            "disable" => Command::BootUpIndication(false),
            _ => return Err(GatewayError::Syntax),
        },
        "info" if keyword(words)? == "version" => Command::Version,
        "init" => {
            words.rest();
            Command::Initialise
        }
        lss => Command::Lss(self::lss(lss, words)?),
    })
}

fn setting(words: &mut Words<'_>) -> Result<Command, GatewayError> {
    Ok(match keyword(words)?.as_str() {
        "network" => Command::SetNetwork(words.number()?),
        "node" => Command::SetNode(words.number()?),
        "id" => Command::SetNodeId(node_id(words)?),
        "sdo_timeout" => Command::SetSdoTimeout(millis(words)?),
        "sdo_block" => Command::SetSdoBlock(flag(words)?),
        "command_timeout" => Command::SetCommandTimeout(millis(words)?),
        "command_size" => {
            let size = words.number::<usize>()?;
            let is_possible = (1..=LONGEST_LINE).contains(&size);
            Command::SetCommandSize(is_possible.then_some(size).ok_or(GatewayError::NotSupported)?)
        }
        "heartbeat" => Command::SetHeartbeat(millis(words)?),
        "rpdo" => Command::SetRpdo(Setup::parse(words)?),
        "tpdo" => Command::SetTpdo(Setup::parse(words)?),
        _ => return Err(GatewayError::Syntax),
    })
}

fn lss(word: &str, words: &mut Words<'_>) -> Result<Lss, GatewayError> {
    Ok(match word {
        "lss_switch_glob" => Lss::SwitchGlobal { to_configuration: flag(words)? },
        "lss_switch_sel" => Lss::SwitchSelective(numbers(words)?),
        "lss_set_node" => Lss::SetNodeId(node_id(words)?),
        "lss_conf_bitrate" => Lss::SetBitRate { table: words.number()?, index: words.number()? },
        "lss_activate_bitrate" => Lss::ActivateBitRate { delay_ms: words.number()? },
        "lss_store" => Lss::Store,
        "lss_inquire_addr" if words.peek().is_none() => Lss::InquireAddress,
        "lss_inquire_addr" => {
            // The part by its number, or by the command specifier that asks for it.
            let part = words.number::<u8>()?;
            let part = part.checked_sub(specifier::INQUIRE).unwrap_or(part);
            Lss::InquirePart(Some(part).filter(|part| *part < 4).ok_or(GatewayError::Syntax)?)
        }
        "lss_get_node" => Lss::InquireNodeId,
        "lss_identity" => Lss::Identify(numbers(words)?),
        "lss_ident_nonconf" => Lss::IdentifyUnconfigured,
        "_lss_fastscan" if words.peek().is_none() => Lss::Fastscan(None),
        "_lss_fastscan" => Lss::Fastscan(Some(millis(words)?)),
        _ => return Err(GatewayError::Syntax),
    })
}

impl Command {
    pub(super) const fn scope(&self) -> Scope {
        match self {
            Self::Read { .. }
            | Self::Write { .. }
            | Self::Nmt(_)
            | Self::EnableGuarding { .. }
            | Self::DisableGuarding
            | Self::EnableHeartbeat(_)
            | Self::DisableHeartbeat => Scope::Node,
            Self::SetSdoTimeout(_)
            | Self::SetSdoBlock(_)
            | Self::SetRpdo(_)
            | Self::SetTpdo(_)
            | Self::ReadPdo(_)
            | Self::WritePdo { .. }
            | Self::SetNodeId(_)
            | Self::SetHeartbeat(_)
            | Self::SetNode(_)
            | Self::BootUpIndication(_)
            | Self::Initialise
            | Self::Lss(_) => Scope::Net,
            Self::SetNetwork(_) | Self::SetCommandTimeout(_) | Self::SetCommandSize(_) | Self::Version => {
                Scope::Gateway
            }
        }
    }
}

fn is_pdo(words: &mut Words<'_>) -> bool {
    let is_pdo =
        words.peek().is_some_and(|word| ["p", "pdo"].iter().any(|pdo| word.eq_ignore_ascii_case(pdo)));
    if is_pdo {
        words.next();
    }
    is_pdo
}

fn keyword(words: &mut Words<'_>) -> Result<String, GatewayError> {
    words.next().map(str::to_ascii_lowercase).ok_or(GatewayError::Syntax)
}

fn address(words: &mut Words<'_>) -> Result<Address, GatewayError> {
    Ok(Address::new(words.number()?, words.number()?))
}

fn flag(words: &mut Words<'_>) -> Result<bool, GatewayError> {
    match words.number::<u8>()? {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(GatewayError::Syntax),
    }
}

/// A time in ms, up to 18 hours.
fn millis(words: &mut Words<'_>) -> Result<Duration, GatewayError> {
    words.number::<u16>().map(|millis| Duration::from_millis(millis.into()))
}

/// 1 to 127, or 255 for none.
fn node_id(words: &mut Words<'_>) -> Result<u8, GatewayError> {
    let node_id = words.number::<u8>()?;
    let is_one = (1..=127).contains(&node_id) || node_id == UNCONFIGURED;
    is_one.then_some(node_id).ok_or(GatewayError::UnsupportedNode)
}

fn numbers<const N: usize>(words: &mut Words<'_>) -> Result<[u32; N], GatewayError> {
    let mut numbers = [0; N];
    for number in &mut numbers {
        *number = words.number()?;
    }
    Ok(numbers)
}
