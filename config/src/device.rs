//! `[[device]]`: a device, what it is and where it stands.

use core::time::Duration;
use std::net::SocketAddr;
use std::sync::Arc;

use profiles::reader::{Node, Spanned, Table};
use profiles::{MotorData, OwnDefault, PlantSetup, Profile, Report, Span, Timing};

use crate::bus::BusDraft;
use crate::defaults;
use crate::gateway::unique_name;
use crate::identity;
use crate::modbus::{self, Listener, ModbusView};
use crate::plant;
use crate::resolve::Resolver;
use crate::switches::{self, MOTOR_ADDRESS, SWITCHES};

/// One device.
#[derive(Clone, Debug)]
pub struct Device {
    /// Name, unique among the devices.
    pub name: String,
    /// What it is; devices with the same profile and motor, and nothing of their own, share one.
    pub profile: Arc<Profile>,
    /// The text of the profile file: devices of equal texts, motors and own values are equal.
    pub profile_text: Arc<str>,
    /// Where it stands; empty if only Modbus reaches it.
    pub on: Vec<Attachment>,
    /// Modbus unit identifier: the given one or the first Node-ID; none if an LSS master is to give that.
    pub unit_id: Option<u8>,
    /// Silence of an SDO client after which its transfer is aborted, if not the usual second.
    pub sdo_timeout: Option<Duration>,
    /// 0x1018:04, unless `[device.identity]` gives it: a number that follows from the name, so that LSS tells equal
    /// devices apart and finds the same ones again.
    pub serial: Option<u32>,
    /// When it takes and gives its process data.
    pub timing: Timing,
    /// How it looks to Modbus clients.
    pub modbus: ModbusView,
    /// Who may command its axes; everybody without a word.
    pub owner: Option<Owner>,
    /// Defaults that its objects have otherwise than in its profile file.
    pub defaults: Vec<OwnDefault>,
    /// What its motor has otherwise than in its profile file; that profile has it already.
    pub motor_data: MotorData,
    /// What the simulated plant of each of its axes has otherwise than its motor says.
    pub plant: PlantSetup,
}

/// The Node-ID of a node that waits for an LSS master to give it one (CiA 305 v3.0).
pub const UNCONFIGURED: u8 = 255;

/// Who may command the axes of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// Whoever is on the bus of this position in [`crate::Gateway::buses`].
    Bus(usize),
    /// Modbus clients.
    Modbus,
}

/// A place on a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Position of the bus in [`crate::Gateway::buses`].
    pub bus: usize,
    /// Node-ID, 1-127, unique on that bus; [`UNCONFIGURED`] for one that an LSS master gives.
    pub node_id: u8,
}

/// Reads devices one after the other and knows what the former ones have taken.
pub(crate) struct Devices<'b, 'r> {
    buses: &'b [BusDraft],
    resolver: &'b mut Resolver<'r>,
    has_modbus: bool,
    read: Vec<Option<Device>>,
    names: Vec<String>,
    places: Vec<(Attachment, String)>,
    /// The bit rate of each bus by the switches of the first device on it that has such, and that device.
    bit_rates: Vec<Option<(u16, String)>>,
    units: Vec<(u8, String)>,
    /// Addresses that Modbus listeners have.
    listening: Vec<SocketAddr>,
    /// Modbus listeners of devices.
    own: Vec<Listener>,
}

impl<'b, 'r> Devices<'b, 'r> {
    /// No devices yet. With Modbus, Node-IDs serve as unit identifiers and must differ across buses.
    pub(crate) fn new(
        buses: &'b [BusDraft],
        resolver: &'b mut Resolver<'r>,
        has_modbus: bool,
        listening: Vec<SocketAddr>,
    ) -> Self {
        let (read, names, places, units) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let bit_rates = vec![None; buses.len()];
        let own = Vec::new();
        Self { buses, resolver, has_modbus, read, names, places, bit_rates, units, listening, own }
    }

    /// The names of all devices, in the order of the file.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// The devices, `None` if any of them is wrong, whose own listeners join the others, and the bit rates of the buses in
    /// kbit/s by their switches.
    pub(crate) fn finish(self, listeners: &mut Vec<Listener>) -> (Option<Vec<Device>>, Vec<Option<u16>>) {
        listeners.extend(self.own);
        let bit_rates = self.bit_rates.into_iter().map(|known| known.map(|(rate, _)| rate)).collect();
        (self.read.into_iter().collect(), bit_rates)
    }

    /// Reads one device.
    pub(crate) fn read(&mut self, node: Node<'_>, report: &mut Report) {
        let mut table = node.open(report);
        let name = unique_name(&mut table, "device", |name| self.names.iter().any(|other| other == name));
        let profile = table.require::<Spanned<&str>>("profile");
        let motor = table.get::<Spanned<&str>>("motor");
        let own_motor = defaults::motor_data(&mut table);
        let found = profile.and_then(|profile| {
            self.resolver.find(&profile, motor.as_ref(), own_motor.as_ref(), table.report)
        });
        let (profile, text) = found.unzip();
        let label = name.clone().unwrap_or_default();
        let on = self.attachments(&mut table, &label, profile.as_deref());
        let unit_id = self.unit_id(&mut table, on.as_deref(), &label);
        let sdo_timeout = sdo_timeout(&mut table);
        let timing = timing(&mut table, profile.as_deref());
        let dialect = profile.as_ref().map(|profile| profile.dialect);
        let modbus = ModbusView::read(&mut table, dialect);
        let own = modbus::read(&mut table, &mut self.listening);
        let has_modbus = self.has_modbus || own.is_some();
        self.own.extend(own.map(|own| own.own(self.read.len(), table.report)));
        let owner = self.owner(&mut table, on.as_deref(), has_modbus);
        let (profile, defaults) = defaults::read(&mut table, profile);
        let (profile, has_serial) = identity::read(&mut table, profile);
        let serial = (!has_serial).then(|| identity::serial_of(&label));
        let plant = plant::read(&mut table);
        let is_without_axis = profile.as_ref().is_some_and(|profile| profile.axes() == 0);
        for (key, what) in [("plant", "plant"), ("motor_data", "motor")] {
            if table.has(key) && is_without_axis {
                let message = format!("a device without an axis has no {what}");
                table.report.error(&table.key_span(key), message, "leave it out".to_owned());
            }
        }
        table.finish();
        self.names.push(label);
        self.read.push(name.zip(profile.zip(text)).zip(on).map(|((name, (profile, profile_text)), on)| {
            Device {
                name,
                profile,
                profile_text,
                on,
                unit_id,
                sdo_timeout,
                serial,
                timing,
                modbus,
                owner,
                defaults,
                motor_data: own_motor.map(|own| own.data).unwrap_or_default(),
                plant,
            }
        }));
    }

    /// `owner`: a bus that the device is on, Modbus or anybody.
    fn owner(&self, table: &mut Table<'_, '_>, on: Option<&[Attachment]>, has_modbus: bool) -> Option<Owner> {
        let name = table.get::<Spanned<&str>>("owner")?;
        let places = on?;
        let own = || places.iter().filter_map(|place| self.buses.get(place.bus)?.name.as_deref());
        match *name.get_ref() {
            "any" => None,
            "modbus" if has_modbus => Some(Owner::Modbus),
            "modbus" => {
                let help = "add a table `modbus` with `listen = `".to_owned();
                table.report.error(&name.span(), "no Modbus client reaches this device", help);
                None
            }
            bus => {
                let is_bus = |place: &&Attachment| {
                    self.buses.get(place.bus).is_some_and(|known| known.name.as_deref() == Some(bus))
                };
                let place = places.iter().find(is_bus);
                if place.is_none() {
                    table.report.unknown(
                        &name.span(),
                        "owner",
                        bus,
                        ["any", "modbus"].into_iter().chain(own()),
                    );
                }
                place.map(|place| Owner::Bus(place.bus))
            }
        }
    }

    /// `bus` with `node_id` or `switches`, or the `[[device.on]]` tables; `None` if any of them is wrong.
    fn attachments(
        &mut self,
        table: &mut Table<'_, '_>,
        device: &str,
        profile: Option<&Profile>,
    ) -> Option<Vec<Attachment>> {
        if table.has("bus") && !table.has("on") {
            return Some(vec![self.attachment(table, device, profile)?]);
        }
        table.ignore(&["bus", "node_id", SWITCHES, MOTOR_ADDRESS]);
        if table.has("bus") {
            let help = "leave out `bus` and `node_id` and add one more `[[device.on]]`".to_owned();
            table.report.error(&table.key_span("bus"), "`bus` and `on` exclude each other", help);
        } else {
            for key in ["node_id", SWITCHES, MOTOR_ADDRESS] {
                if table.has(key) {
                    let help = "add `bus = ` with the name of a bus".to_owned();
                    table.report.error(&table.key_span(key), format!("`{key}` needs a `bus`"), help);
                }
            }
        }
        let nodes = table.get::<Vec<Node>>("on").unwrap_or_default();
        let read = |node: Node<'_>| {
            let mut place = node.open(table.report);
            let attachment = self.attachment(&mut place, device, profile);
            place.finish();
            attachment
        };
        let places: Vec<Option<Attachment>> = nodes.into_iter().map(read).collect();
        places.into_iter().collect()
    }

    fn attachment(
        &mut self,
        table: &mut Table<'_, '_>,
        device: &str,
        profile: Option<&Profile>,
    ) -> Option<Attachment> {
        let name = table.require::<Spanned<&str>>("bus");
        let setting = switches::are_in(table).then(|| switches::read(table, profile));
        let node_id = match setting {
            Some(setting) => setting.map(|setting| setting.node_id),
            None => node_id(table, profile.and_then(|profile| profile.commissioning.node_id)),
        };
        let name = name?;
        let Some(bus) = self.buses.iter().position(|b| b.name.as_deref() == Some(*name.get_ref())) else {
            let known = self.buses.iter().filter_map(|b| b.name.as_deref());
            table.report.unknown(&name.span(), "bus", name.get_ref(), known);
            return None;
        };
        if let Some(setting) = setting.flatten() {
            self.compare_bit_rate(bus, setting.bit_rate_kbit_s, device, table);
        } else if let Some(rate) = profile.and_then(|profile| profile.commissioning.bit_rate_kbit_s)
            && let Some(own) = self.buses.get(bus).and_then(|bus| bus.bit_rate_kbit_s)
            && rate != own
        {
            let message = format!("the device configuration file says {rate} kbit/s, the bus says {own}");
            table.report.warn(&table.key_span("bus"), message, None);
        }
        let place = Attachment { bus, node_id: node_id? };
        if place.node_id == UNCONFIGURED {
            return Some(place);
        }
        if let Some((_, other)) = self.places.iter().find(|(taken, _)| *taken == place) {
            let message =
                format!("node {} on bus `{}` is device `{other}` already", place.node_id, name.get_ref());
            let help = "give every device on a bus a Node-ID of its own".to_owned();
            table.report.error(&node_id_span(table), message, help);
            return None;
        }
        self.places.push((place, device.to_owned()));
        Some(place)
    }

    /// One bus has one bit rate, whoever says it.
    fn compare_bit_rate(&mut self, bus: usize, rate: u16, device: &str, table: &mut Table<'_, '_>) {
        let of_bus = self.buses.get(bus).and_then(|bus| bus.bit_rate_kbit_s);
        let Some(known) = self.bit_rates.get_mut(bus) else { return };
        let other = of_bus.map(|rate| (rate, "the bus".to_owned()));
        let other =
            other.or_else(|| known.clone().map(|(rate, device)| (rate, format!("device `{device}`"))));
        if let Some((other, who)) = other.filter(|(other, _)| *other != rate) {
            let message = format!("the switches say {rate} kbit/s, {who} says {other}");
            let help = "set switches 8-10 for the bit rate of the bus".to_owned();
            table.report.error(&table.key_span(SWITCHES), message, help);
        }
        known.get_or_insert_with(|| (rate, device.to_owned()));
    }

    fn unit_id(&mut self, table: &mut Table<'_, '_>, on: Option<&[Attachment]>, device: &str) -> Option<u8> {
        let given = table.get::<Spanned<u8>>("unit_id");
        let mut node_ids = on.unwrap_or_default().iter().map(|place| place.node_id);
        let first = node_ids.find(|node_id| *node_id != UNCONFIGURED);
        let is_placed = table.has("node_id") || table.has("modbus") || switches::are_in(table);
        if on.is_some_and(<[_]>::is_empty) && !table.has("unit_id") && !is_placed {
            let help = "add `bus = ` and `node_id = `, or `unit_id = ` for Modbus".to_owned();
            table.report.error(&table.span(), "nothing reaches this device", help);
        }
        let unit_id = given.as_ref().map(|given| *given.get_ref()).or(first)?;
        if given.is_some() || self.has_modbus {
            let span = given.map_or_else(|| node_id_span(table), |given| given.span());
            self.claim_unit(unit_id, device, &span, table.report);
        }
        Some(unit_id)
    }

    fn claim_unit(&mut self, unit_id: u8, device: &str, span: &Span, report: &mut Report) {
        if let Some((_, other)) = self.units.iter().find(|(taken, _)| *taken == unit_id) {
            let message = format!("Modbus unit {unit_id} is device `{other}` already");
            report.error(span, message, "add `unit_id = ` with another number from 0 to 255".to_owned());
        }
        self.units.push((unit_id, device.to_owned()));
    }
}

/// What says the Node-ID.
fn node_id_span(table: &Table<'_, '_>) -> Span {
    table.key_span(if switches::are_in(table) { SWITCHES } else { "node_id" })
}

/// `node_id`: 1 to 127, or [`UNCONFIGURED`]; without it the one that a device configuration file gives.
fn node_id(table: &mut Table<'_, '_>, commissioned: Option<u8>) -> Option<u8> {
    const HIGHEST_NODE_ID: u8 = 127;
    table.ignore(&[SWITCHES, MOTOR_ADDRESS]);
    if let Some(commissioned) = commissioned.filter(|_| !table.has("node_id")) {
        table.ignore(&["node_id"]);
        return Some(commissioned);
    }
    let node_id = table.require_in("node_id", 1..=UNCONFIGURED)?;
    if node_id <= HIGHEST_NODE_ID || node_id == UNCONFIGURED {
        if let Some(other) = commissioned.filter(|other| *other != node_id) {
            let message = format!("the device configuration file says {other}; it is node {node_id}");
            table.report.warn(&table.key_span("node_id"), message, None);
        }
        return Some(node_id);
    }
    let message = format!("{node_id} is no Node-ID");
    let help = "write a number from 1 to 127, or 255 for a node that an LSS master configures".to_owned();
    table.report.error(&table.key_span("node_id"), message, help);
    None
}

/// `timing`, for devices whose profile knows times.
fn timing(table: &mut Table<'_, '_>, profile: Option<&Profile>) -> Timing {
    let parse = |word: &str| match word {
        "immediate" => Some(Timing::Immediate),
        "authentic" => Some(Timing::Authentic),
        _ => None,
    };
    let timing = table.word("timing", parse, ["immediate", "authentic"]);
    if table.has("timing")
        && let Some(profile) = profile.filter(|profile| !profile.has_processing_times())
    {
        let message = format!("`{}` has no processing times", profile.name);
        let help = "leave `timing` out: only JVL's CANopen modules take their time".to_owned();
        table.report.error(&table.key_span("timing"), message, help);
    }
    timing.map_or(Timing::default(), Spanned::into_inner)
}

/// `sdo_timeout_ms`: 10 ms, which a client can just keep, to ten minutes.
fn sdo_timeout(table: &mut Table<'_, '_>) -> Option<Duration> {
    table.get_in("sdo_timeout_ms", 10..=600_000).map(Duration::from_millis)
}
