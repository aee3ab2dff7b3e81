//! Messages in words.

use canopen::{Emergency, ErrorRegister, Message, NmtCommand, NmtState, Pdo, SdoMessage, SdoStep};
use od::{AbortCode, Address, DataType, Direction};
use profiles::error_text;

use super::decoder::Names;
use super::{lss, time};
use crate::objects;

/// The longest value that is shown whole, in characters.
const LONGEST_VALUE: usize = 64;

/// What a message says.
pub(super) fn text(message: &Message, names: &Names) -> String {
    match message {
        Message::Nmt { specifier, node_id } => nmt(*specifier, *node_id, names),
        Message::Sync(None) => "SYNC".to_owned(),
        Message::Sync(Some(counter)) => format!("SYNC, counter {counter}"),
        Message::Time(time) => format!("TIME {}", time::text(*time)),
        Message::Emergency(node_id, emergency) => emcy(*node_id, *emergency, names),
        Message::Pdo(pdo) => process_data(pdo, names),
        Message::PdoRequest(node_id, number) => {
            format!("TPDO{number} {}, request", names.node(*node_id))
        }
        Message::Sdo(message) => sdo(message, names),
        Message::BootUp(node_id) => format!("boot-up {}", names.node(*node_id)),
        Message::State { node_id, state, toggle } => {
            let state = state.map_or("unknown state", NmtState::name);
            let what = if *toggle { "guarding" } else { "heartbeat" };
            let toggle = if *toggle { ", toggle bit set" } else { "" };
            format!("{what} {} {state}{toggle}", names.node(*node_id))
        }
        Message::Guard(node_id) => format!("guarding {}, request", names.node(*node_id)),
        Message::Lss { is_master, data } => lss::text(*is_master, *data),
        Message::Malformed(service) => format!("{service} of a wrong length"),
        Message::Unknown => String::new(),
    }
}

fn nmt(specifier: u8, node_id: u8, names: &Names) -> String {
    // Every command is decoded for the node that it names.
    let command = match NmtCommand::decode(&[specifier, node_id], node_id) {
        Some(NmtCommand::Start) => "start".to_owned(),
        Some(NmtCommand::Stop) => "stop".to_owned(),
        Some(NmtCommand::EnterPreOperational) => "enter PRE-OPERATIONAL".to_owned(),
        Some(NmtCommand::ResetNode) => "reset node".to_owned(),
        Some(NmtCommand::ResetCommunication) => "reset communication".to_owned(),
        None => format!("unknown command 0x{specifier:02X}"),
    };
    let whom = if node_id == 0 { "all nodes".to_owned() } else { names.node(node_id) };
    format!("NMT {command}, {whom}")
}

fn emcy(node_id: u8, Emergency { code, register, detail }: Emergency, names: &Names) -> String {
    let node = names.node(node_id);
    let words = if code == 0 { "no error" } else { error_text(code, names.dialect(node_id)) };
    let bits: Vec<String> =
        register.iter_names().map(|(name, _): (&str, ErrorRegister)| name.to_lowercase()).collect();
    let bits = if bits.is_empty() { String::new() } else { format!(" ({})", bits.join(", ")) };
    let register = register.bits();
    format!(
        "EMCY {node} 0x{code:04X} {words}, error register 0x{register:02X}{bits}, data {}",
        bytes(&detail)
    )
}

fn process_data(pdo: &Pdo, names: &Names) -> String {
    let Pdo { node_id, direction, number, fields, expected } = pdo;
    let kind = match direction {
        Direction::Receive => "RPDO",
        Direction::Transmit => "TPDO",
    };
    let head = format!("{kind}{number} {}", names.node(*node_id));
    let fields: Vec<String> = fields.iter().map(|field| mapped(*node_id, *field, names)).collect();
    match (fields.is_empty(), *expected) {
        (true, _) => head,
        (false, expected) => {
            let carried: usize = pdo.fields.iter().map(|(_, width, _)| usize::from(*width)).sum();
            let short = if carried.div_ceil(8) < expected { ", too short" } else { "" };
            format!("{head}: {}{short}", fields.join(", "))
        }
    }
}

fn mapped(node_id: u8, (address, width, raw): (Address, u8, u64), names: &Names) -> String {
    let (name, data_type) = names.entry(node_id, address);
    let name = name.unwrap_or_else(|| address.to_string());
    let size = usize::from(width).div_ceil(8);
    let le = raw.to_le_bytes();
    let data = le.get(..size).unwrap_or_default();
    format!("{name} = {}", value(data_type, data))
}

fn sdo(message: &SdoMessage, names: &Names) -> String {
    let SdoMessage { node_id, server, is_request, address, is_write, step } = message;
    let (name, data_type) = address.map_or((None, None), |address| names.entry(*node_id, address));
    let server = if *server == 0 { String::new() } else { format!(" server {}", server + 1) };
    let way = if *is_request { "to" } else { "from" };
    let mut text = format!("SDO {way} {}{server}", names.node(*node_id));
    text += match is_write {
        Some(true) => " write",
        Some(false) => " read",
        None => "",
    };
    if let Some(address) = address {
        text += &format!(" {address}");
    }
    if let Some(name) = name {
        text += &format!(" {name}");
    }
    text + &sdo_step(step, data_type)
}

fn sdo_step(step: &SdoStep, data_type: Option<DataType>) -> String {
    match step {
        SdoStep::Read => String::new(),
        SdoStep::ReadBlocks { block_size } => format!(" in blocks of {block_size}"),
        SdoStep::Announce(Some(size)) => format!(", {size} bytes follow"),
        SdoStep::Announce(None) => ", bytes follow".to_owned(),
        SdoStep::TakeBlocks { block_size } => format!(", ready for a block of {block_size}"),
        SdoStep::Part(count) => format!(", {count} bytes so far"),
        SdoStep::Value { bytes, of } if bytes.len() < *of => format!(", {of} bytes"),
        SdoStep::Value { bytes, .. } => format!(" = {}", value(data_type, bytes)),
        SdoStep::End => ", last part".to_owned(),
        SdoStep::Next => ", next part".to_owned(),
        SdoStep::Acknowledge { sequence, block_size } => {
            format!(", segments to {sequence} received, next block of {block_size}")
        }
        SdoStep::Start => ", start".to_owned(),
        SdoStep::Done => ", done".to_owned(),
        SdoStep::Abort(code) => {
            let words = AbortCode::from_code(*code).map_or("unknown abort code", AbortCode::text);
            format!(", abort 0x{code:08X} {words}")
        }
        SdoStep::Unknown => ", unknown command".to_owned(),
    }
}

/// A value by its type, or as bytes if it is not of that type; a long one is cut.
fn value(data_type: Option<DataType>, data: &[u8]) -> String {
    let fits = |data_type: &DataType| data_type.bytes().is_none_or(|size| size == data.len());
    let text = match data_type.filter(fits) {
        Some(data_type) => objects::text(data_type, data),
        None => bytes(data),
    };
    if text.chars().count() <= LONGEST_VALUE {
        return text;
    }
    let cut: String = text.chars().take(LONGEST_VALUE).collect();
    format!("{cut}... ({} bytes)", data.len())
}

fn bytes(data: &[u8]) -> String {
    data.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}
