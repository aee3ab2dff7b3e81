//! The gateway file as a whole.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use profiles::reader::{Document, Node, Spanned, Table};
use profiles::{Diagnostics, Report};

use crate::bus::{self, Bus};
use crate::device::{Device, Devices};
use crate::modbus::{self, Listener};
use crate::resolve::{ReadFile, Resolver};
use crate::service::{self, Service};

/// What a gateway file says, checked.
#[derive(Clone, Debug)]
pub struct Gateway {
    /// The networks, in the order of the file.
    pub buses: Vec<Bus>,
    /// The devices, in the order of the file.
    pub devices: Vec<Device>,
    /// Where Modbus TCP clients may connect: that of the gateway first, then those of devices.
    pub modbus: Vec<Listener>,
    /// Directory for what devices store; without one they cannot store anything.
    pub storage: Option<PathBuf>,
    /// Path of the control socket; without one the daemon looks for a place.
    pub control: Option<PathBuf>,
    /// What concerns the daemon itself.
    pub service: Service,
    /// What is odd about the file or those that it names, and keeps nothing from working.
    pub warnings: Diagnostics,
}

/// Reads the gateway file `text`, which stands at `file`; profile files are read by `read`.
///
/// A profile is looked for as a path (relative to the directory of `file`) if it has a `/` or ends with `.toml`, `.eds` or
/// `.dcf`, otherwise in [`crate::PROFILE_DIRECTORY`] and then among the shipped ones. The latter two endings without a `/`
/// are also looked for in [`crate::PROFILE_DIRECTORY`].
///
/// # Errors
/// Everything that is wrong with the file and with the profile files it names.
pub fn load(file: &str, text: &str, read: ReadFile<'_>) -> Result<Gateway, Diagnostics> {
    let mut report = Report::default();
    let mut resolver = Resolver::new(Path::new(file).parent().unwrap_or(Path::new("")), read);
    let document = Document::parse(text, &mut report);
    let read = document.and_then(|document| read_gateway(document.root(&mut report), &mut resolver));
    let (gateway, mut findings) = report.judge(file, text, read);
    findings.0.append(&mut resolver.findings);
    match gateway {
        Some(gateway) => Ok(Gateway { warnings: findings, ..gateway }),
        None => Err(findings),
    }
}

fn read_gateway(mut file: Table<'_, '_>, resolver: &mut Resolver<'_>) -> Option<Gateway> {
    let mut listening = Vec::new();
    let has_modbus = file.has("modbus");
    let modbus = modbus::read(&mut file, &mut listening);
    let storage = section(&mut file, "storage", |table| {
        path(table, "path", "storage needs a directory", "/var/lib/axisd")
    });
    let control = section(&mut file, "control", |table| {
        path(table, "socket", "control socket needs a path", "/run/axisd/control.sock")
    });
    let service = service::read(&mut file);
    let buses = bus::read_all(&mut file);
    let nodes = file.get::<Vec<Node>>("device").unwrap_or_default();
    let mut devices = Devices::new(&buses, resolver, has_modbus, listening);
    for node in nodes {
        devices.read(node, file.report);
    }
    let mut listeners: Vec<_> =
        modbus.map(|draft| draft.common(devices.names(), file.report)).into_iter().collect();
    let (devices, bit_rates) = devices.finish(&mut listeners);
    file.finish();
    let buses = buses.into_iter().zip(bit_rates).map(|(bus, rate)| bus.finish(rate));
    let buses = buses.collect::<Option<_>>()?;
    let (devices, warnings) = (devices?, Diagnostics::default());
    Some(Gateway { buses, devices, modbus: listeners, storage, control, service, warnings })
}

/// The path at `key`, which must not be empty; a relative one is from where the program runs. `example` is a good one.
pub(crate) fn path(
    table: &mut Table<'_, '_>,
    key: &'static str,
    need: &str,
    example: &str,
) -> Option<PathBuf> {
    let path = table.require::<Spanned<&str>>(key)?;
    if path.get_ref().is_empty() {
        let help = format!("write one, such as \"{example}\"");
        table.report.error(&path.span(), format!("the {need}"), help);
    }
    Some(PathBuf::from(path.into_inner()))
}

/// What `read` makes of the table `key`, if there is one.
pub(crate) fn section<T>(
    file: &mut Table<'_, '_>,
    key: &'static str,
    read: impl FnOnce(&mut Table<'_, '_>) -> Option<T>,
) -> Option<T> {
    let node = file.get::<Node>(key)?;
    let mut table = node.open(file.report);
    let value = read(&mut table);
    table.finish();
    value
}

/// The `name` of something, which no other of its kind has.
pub(crate) fn unique_name(
    table: &mut Table<'_, '_>,
    kind: &str,
    is_taken: impl FnOnce(&str) -> bool,
) -> Option<String> {
    let name = table.require::<Spanned<&str>>("name")?;
    if name.get_ref().is_empty() {
        table.report.error(&name.span(), format!("a {kind} needs a name"), None);
    } else if is_taken(name.get_ref()) {
        let message = format!("there is a {kind} `{}` already", name.get_ref());
        table.report.error(&name.span(), message, format!("give every {kind} a name of its own"));
    }
    Some(name.into_inner().to_owned())
}

/// The socket address that `text` is; `example` shows one that would be right.
pub(crate) fn address(text: &Spanned<&str>, example: &str, report: &mut Report) -> Option<SocketAddr> {
    let address = text.get_ref().parse().ok();
    if address.is_none() {
        let message = format!("`{}` is no socket address", text.get_ref());
        report.error(&text.span(), message, format!("write address and port, such as \"{example}\""));
    }
    address
}
