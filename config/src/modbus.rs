//! `[modbus]` and `[device.modbus]`: where Modbus TCP clients may connect, and what they may do there.

use core::ops::RangeInclusive;
use core::time::Duration;
use std::net::SocketAddr;

use profiles::Report;
use profiles::reader::{Node, OneOrMore, Spanned, Table};

use crate::Network;
use crate::gateway::address;

/// Addresses on which clients are served alike.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listener {
    /// Where clients may connect.
    pub listen: Vec<SocketAddr>,
    /// Clients at a time, 1-1024.
    pub max_clients: u16,
    /// What becomes of one more.
    pub when_full: WhenFull,
    /// How long a client may ask for nothing; for ever without it.
    pub idle_timeout: Option<Duration>,
    /// Who may connect; everybody if there is no network.
    pub allow: Vec<Network>,
    /// Who may read only.
    pub read_only: Vec<Network>,
    /// Registers that may be written; all if there is no range.
    pub write: Vec<RangeInclusive<u16>>,
    /// The device, by its position, that unit identifiers 0 and 255 stand for; on the listener of a device all of them
    /// do.
    pub device: Option<usize>,
    /// Whether it is the listener of `device` alone.
    pub is_own: bool,
}

/// What becomes of a client that is one too many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WhenFull {
    /// It is sent away.
    #[default]
    Refuse,
    /// It takes the place of the one that has been silent longest.
    Replace,
}

/// How a device looks to Modbus clients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModbusView {
    /// Functions and limits.
    pub dialect: ModbusDialect,
    /// Which word of a value comes first.
    pub word_order: WordOrder,
    /// Silence of all clients after which their connection counts as lost; never without it.
    pub timeout: Option<Duration>,
}

/// Functions and limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModbusDialect {
    /// Those of JVL's modules.
    Jvl,
    /// Those of the standard.
    Full,
}

/// The order of the registers of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WordOrder {
    /// The low word first.
    LowFirst,
    /// The high word first.
    HighFirst,
}

/// Clients of a listener unless it says otherwise.
const DEFAULT_CLIENTS: u16 = 64;
/// Ranges and networks one list may have.
const MOST: usize = 64;

impl ModbusView {
    /// What the keys of a device say.
    pub(crate) fn read(device: &mut Table<'_, '_>, profile: Option<profiles::Dialect>) -> Self {
        let dialect = device.word("dialect", dialect, ["jvl", "full"]).map(Spanned::into_inner);
        let default = match profile {
            Some(profiles::Dialect::Jvl) => ModbusDialect::Jvl,
            Some(profiles::Dialect::Cia402 | profiles::Dialect::Mac4(_)) | None => ModbusDialect::Full,
        };
        if dialect == Some(ModbusDialect::Jvl) && default == ModbusDialect::Full && profile.is_some() {
            let help = "leave it out, or write \"full\"".to_owned();
            device.report.error(&device.key_span("dialect"), "the device has none of JVL's registers", help);
        }
        let order = device.word("word_order", word_order, ["low-first", "high-first"]);
        Self {
            dialect: dialect.unwrap_or(default),
            word_order: order.map_or(WordOrder::LowFirst, Spanned::into_inner),
            timeout: device.get_in("modbus_timeout_ms", 1..=600_000).map(Duration::from_millis),
        }
    }
}

fn dialect(word: &str) -> Option<ModbusDialect> {
    match word {
        "jvl" => Some(ModbusDialect::Jvl),
        "full" => Some(ModbusDialect::Full),
        _ => None,
    }
}

fn word_order(word: &str) -> Option<WordOrder> {
    match word {
        "low-first" => Some(WordOrder::LowFirst),
        "high-first" => Some(WordOrder::HighFirst),
        _ => None,
    }
}

fn when_full(word: &str) -> Option<WhenFull> {
    match word {
        "refuse" => Some(WhenFull::Refuse),
        "replace" => Some(WhenFull::Replace),
        _ => None,
    }
}

/// Reads the table `modbus` of the file or of a device, if there is one. `taken` are the addresses of the others.
pub(crate) fn read(parent: &mut Table<'_, '_>, taken: &mut Vec<SocketAddr>) -> Option<Draft> {
    let node: Node<'_> = parent.get("modbus")?;
    let mut table = node.open(parent.report);
    let listen = listen(&mut table, taken);
    let max_clients = table.get_in("max_clients", 1..=1024);
    let when_full = table.word("when_full", when_full, ["refuse", "replace"]);
    let idle = table.get_in("idle_timeout_s", 1..=86_400_u64);
    let (allow, read_only) = (networks(&mut table, "allow"), networks(&mut table, "read_only"));
    let write = ranges(&mut table);
    let device = table
        .get::<Spanned<&str>>("device")
        .map(|name| Spanned::new(name.span(), (*name.get_ref()).to_owned()));
    table.finish();
    Some(Draft {
        device,
        listener: Listener {
            listen,
            max_clients: max_clients.unwrap_or(DEFAULT_CLIENTS),
            when_full: when_full.map(Spanned::into_inner).unwrap_or_default(),
            idle_timeout: idle.map(Duration::from_secs),
            allow,
            read_only,
            write,
            device: None,
            is_own: false,
        },
    })
}

/// A listener whose device is not looked up yet.
pub(crate) struct Draft {
    listener: Listener,
    device: Option<Spanned<String>>,
}

impl Draft {
    /// The listener of the whole gateway, whose devices have these names: units 0 and 255 are the one that is named, or
    /// the only one there is.
    pub(crate) fn common(self, names: &[String], report: &mut Report) -> Listener {
        let only = (names.len() == 1).then_some(0);
        let named = self.device.as_ref().and_then(|name| {
            let position = names.iter().position(|known| known == name.get_ref());
            if position.is_none() {
                let known = names.iter().map(String::as_str);
                report.unknown(&name.span(), "device", name.get_ref(), known);
            }
            position
        });
        Listener { device: named.or(only), ..self.listener }
    }

    /// The listener of one device.
    pub(crate) fn own(self, device: usize, report: &mut Report) -> Listener {
        if let Some(name) = self.device {
            let help = "leave it out".to_owned();
            report.error(&name.span(), "the listener of a device serves that device", help);
        }
        Listener { device: Some(device), is_own: true, ..self.listener }
    }
}

fn listen(table: &mut Table<'_, '_>, taken: &mut Vec<SocketAddr>) -> Vec<SocketAddr> {
    let Some(OneOrMore(texts)) = table.require::<OneOrMore<Spanned<&str>>>("listen") else {
        return Vec::new();
    };
    if texts.is_empty() {
        let help = "write one, such as \"0.0.0.0:502\"".to_owned();
        table.report.error(&table.key_span("listen"), "the listener needs an address", help);
    }
    let mut addresses = Vec::new();
    for text in texts {
        let Some(address) = address(&text, "0.0.0.0:502", table.report) else { continue };
        // Port 0 is one that is free, each time another.
        if taken.contains(&address) && address.port() != 0 {
            let message = format!("{address} is listened on already");
            table.report.error(&text.span(), message, "choose another port".to_owned());
        }
        taken.push(address);
        addresses.push(address);
    }
    addresses
}

fn networks(table: &mut Table<'_, '_>, key: &'static str) -> Vec<Network> {
    let texts = table.get::<OneOrMore<Spanned<&str>>>(key).map_or_else(Vec::new, |OneOrMore(texts)| texts);
    check_number(table, key, texts.len());
    let read = |text: Spanned<&str>| {
        let network = text.get_ref().parse();
        if network.is_err() {
            let message = format!("`{}` is no network", text.get_ref());
            let help =
                "write an address and the number of bits that count, such as \"192.168.1.0/24\"".to_owned();
            table.report.error(&text.span(), message, help);
        }
        network.ok()
    };
    texts.into_iter().filter_map(read).collect()
}

fn ranges(table: &mut Table<'_, '_>) -> Vec<RangeInclusive<u16>> {
    let ranges: Vec<Spanned<Vec<u16>>> = table.get("write_ranges").unwrap_or_default();
    check_number(table, "write_ranges", ranges.len());
    let read = |ends: Spanned<Vec<u16>>| match ends.get_ref().as_slice() {
        [first, last] if first <= last => Some(*first..=*last),
        _ => {
            let help = "write first and last register, such as [0x1000, 0x10FF]".to_owned();
            table.report.error(&ends.span(), "this is no range of registers", help);
            None
        }
    };
    ranges.into_iter().filter_map(read).collect()
}

fn check_number(table: &mut Table<'_, '_>, key: &'static str, number: usize) {
    if number > MOST {
        let help = format!("write at most {MOST}");
        table.report.error(&table.key_span(key), format!("`{key}` has too many elements"), help);
    }
}
