//! `[[bus]]`: a network and how it is reached.

use core::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;

use profiles::Report;
use profiles::reader::{Node, Spanned, Table};

use crate::gateway::{address, unique_name};

/// A CANopen network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bus {
    /// Name, unique among the buses.
    pub name: String,
    /// How the network is reached.
    pub link: Link,
    /// Its bit rate in kbit/s, as far as the file or the switches of its devices say; nothing sets it.
    pub bit_rate_kbit_s: Option<u16>,
    /// Where clients may join the network by the socketcand protocol.
    pub socketcand: Option<SocketAddr>,
    /// Where clients may use the network by lines of text (CiA 309-3).
    pub gateway: Option<Endpoint>,
}

impl Bus {
    /// Whether clients hear what passes on it.
    #[must_use]
    pub fn has_clients(&self) -> bool {
        self.socketcand.is_some() || self.gateway.is_some()
    }
}

/// Where clients connect.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Endpoint {
    /// By TCP.
    Tcp(SocketAddr),
    /// By a Unix socket in the file system.
    Unix(PathBuf),
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(address) => address.fmt(f),
            Self::Unix(path) => path.display().fmt(f),
        }
    }
}

/// How a network is reached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Link {
    /// By nothing: the network exists inside the gateway only.
    Virtual,
    /// By the CAN interface of this name, 1-15 bytes.
    SocketCan(String),
}

/// Reads all buses. A bus that is wrong stays in the list by its name, so that devices find it.
pub(crate) fn read_all(file: &mut Table<'_, '_>) -> Vec<BusDraft> {
    let mut buses = Vec::new();
    for node in file.get::<Vec<Node>>("bus").unwrap_or_default() {
        let draft = read(node, &buses, file.report);
        buses.push(draft);
    }
    buses
}

/// A bus as far as it could be read.
pub(crate) struct BusDraft {
    pub(crate) name: Option<String>,
    link: Option<Link>,
    pub(crate) bit_rate_kbit_s: Option<u16>,
    socketcand: Option<SocketAddr>,
    gateway: Option<Endpoint>,
}

impl BusDraft {
    /// The bus, if everything it needs was read; `bit_rate_kbit_s` is what the switches of its devices say.
    pub(crate) fn finish(self, bit_rate_kbit_s: Option<u16>) -> Option<Bus> {
        let bit_rate_kbit_s = self.bit_rate_kbit_s.or(bit_rate_kbit_s);
        let Self { name, link, socketcand, gateway, .. } = self;
        Some(Bus { name: name?, link: link?, bit_rate_kbit_s, socketcand, gateway })
    }
}

fn read(node: Node<'_>, others: &[BusDraft], report: &mut Report) -> BusDraft {
    let mut table = node.open(report);
    let name = unique_name(&mut table, "bus", |name| others.iter().any(|b| b.name.as_deref() == Some(name)));
    let text = table.require::<Spanned<&str>>("link");
    let link = text.as_ref().and_then(|text| link(text, table.report));
    if let (Some(text), Some(Link::SocketCan(interface))) = (text, &link)
        && let Some(other) = others.iter().find(|b| b.link == link)
    {
        let message =
            format!("interface `{interface}` is bus `{}` already", other.name.as_deref().unwrap_or_default());
        table.report.error(&text.span(), message, "put all devices of one network on one bus".to_owned());
    }
    let bit_rate_kbit_s = table.get_in("bit_rate_kbit_s", 10..=1000);
    let socketcand = table.get::<Spanned<&str>>("socketcand");
    let socketcand = socketcand.and_then(|text| address(&text, "127.0.0.1:29536", table.report));
    let gateway = table.get::<Spanned<&str>>("gateway");
    let gateway = gateway.and_then(|text| endpoint(&text, table.report));
    table.finish();
    BusDraft { name, link, bit_rate_kbit_s, socketcand, gateway }
}

/// An absolute path, or an address with a port.
fn endpoint(text: &Spanned<&str>, report: &mut Report) -> Option<Endpoint> {
    if text.get_ref().starts_with('/') {
        return Some(Endpoint::Unix(PathBuf::from(*text.get_ref())));
    }
    address(text, "127.0.0.1:6001\", or a path such as \"/run/axisd/can0.gateway", report).map(Endpoint::Tcp)
}

fn link(text: &Spanned<&str>, report: &mut Report) -> Option<Link> {
    const LONGEST_INTERFACE: usize = 15;
    if *text.get_ref() == "virtual" {
        return Some(Link::Virtual);
    }
    let Some(interface) = text.get_ref().strip_prefix("socketcan:") else {
        let message = format!("`{}` is no link", text.get_ref());
        let help = "write \"virtual\" or \"socketcan:\" and an interface, such as \"socketcan:can0\"";
        report.error(&text.span(), message, help.to_owned());
        return None;
    };
    let is_name = (1..=LONGEST_INTERFACE).contains(&interface.len())
        && !interface.contains(|c: char| c == '/' || c.is_whitespace() || c.is_control())
        && !matches!(interface, "." | "..");
    if is_name {
        return Some(Link::SocketCan(interface.to_owned()));
    }
    let message = format!("`{interface}` cannot be an interface");
    let help = "an interface has 1-15 bytes, none of them a space or `/`".to_owned();
    report.error(&text.span(), message, help);
    None
}
