//! `axisd check --explain`: what comes of a configuration, with everything that it leaves to profiles, motors and defaults.

use core::time::Duration;
use std::fmt::Write;
use std::path::Path;

use config::{Gateway, LIMITS, Link, ModbusDialect, Owner, UNCONFIGURED, WhenFull, WordOrder};
use od::{Address, Entry, Initial, Schema, Value};
use profiles::{MotorKind, OwnDefault, PlantSetup, Profile, Timing};
use serde::Serialize;
use serde_json::Value as Json;

use crate::{audit, control};

/// All of it, in the order in which it is shown.
#[derive(Debug, Serialize)]
pub(crate) struct Explanation {
    buses: Vec<Bus>,
    devices: Vec<Device>,
    modbus: Vec<Listener>,
    storage: Option<String>,
    control: Vec<String>,
    log: Log,
    realtime: Realtime,
    metrics: Option<String>,
    audit: Option<Audit>,
}

#[derive(Debug, Serialize)]
struct Bus {
    name: String,
    link: String,
    bit_rate_kbit_s: Option<u16>,
    socketcand: Option<String>,
    gateway: Option<String>,
}

#[derive(Debug, Serialize)]
struct Device {
    name: String,
    profile: String,
    product: String,
    identity: Identity,
    axes: u8,
    motor: Option<Motor>,
    nodes: Vec<Node>,
    unit_id: Option<u8>,
    modbus: View,
    owner: String,
    sdo_timeout_ms: Option<u64>,
    timing: &'static str,
    /// Power-on values, which stored ones come before.
    limits: Vec<Entered>,
    objects: Vec<Entered>,
    /// What differs from the plant of the motor.
    plant: Vec<String>,
}

/// How a device looks to Modbus clients, and who may command it.
#[derive(Debug, Serialize)]
struct View {
    dialect: &'static str,
    word_order: &'static str,
    timeout_ms: Option<u64>,
}

#[derive(Debug, Serialize)]
struct Listener {
    listen: Vec<String>,
    device: Option<String>,
    max_clients: u16,
    when_full: &'static str,
    idle_timeout_s: Option<u64>,
    allow: Vec<String>,
    read_only: Vec<String>,
    write_ranges: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Identity {
    vendor_id: u32,
    product_code: u32,
    revision: u32,
    serial: u32,
}

#[derive(Debug, Serialize)]
struct Motor {
    name: String,
    kind: &'static str,
    counts_per_revolution: u32,
    raster_ns: u64,
    max_speed_rpm: u32,
    rated_torque_nm: f64,
    peak_torque_factor: f64,
    rotor_inertia_kg_m2: f64,
}

#[derive(Debug, Serialize)]
struct Node {
    bus: String,
    node_id: Option<u8>,
}

#[derive(Debug, Serialize)]
struct Entered {
    object: String,
    name: String,
    value: String,
}

#[derive(Debug, Serialize)]
struct Log {
    level: &'static str,
    format: &'static str,
    modules: serde_json::Map<String, Json>,
}

#[derive(Debug, Serialize)]
struct Realtime {
    priority: Option<u8>,
    cpus: Vec<u16>,
    lock_memory: bool,
}

#[derive(Debug, Serialize)]
struct Audit {
    path: String,
    file_kib: u32,
    files: u8,
}

impl Explanation {
    /// What comes of `gateway`; `storage` is where devices store, if anywhere.
    pub(crate) fn new(gateway: &Gateway, storage: Option<&Path>) -> Self {
        let service = &gateway.service;
        let audit = audit::directory(gateway, storage);
        let places = gateway.control.clone().map_or_else(control::places_to_serve, |path| vec![path]);
        let modules = service.log.modules.iter();
        Self {
            buses: gateway.buses.iter().map(bus).collect(),
            devices: gateway.devices.iter().map(|own| device(own, gateway)).collect(),
            modbus: gateway.modbus.iter().map(|own| listener(own, gateway)).collect(),
            storage: storage.map(shown),
            control: places.iter().map(|path| shown(path)).collect(),
            log: Log {
                level: service.log.level.name(),
                format: service.log.format.name(),
                modules: modules.map(|(module, level)| ((*module).to_owned(), level.name().into())).collect(),
            },
            realtime: Realtime {
                priority: service.realtime.priority,
                cpus: service.realtime.cpus.clone(),
                lock_memory: service.realtime.lock_memory,
            },
            metrics: service.metrics.map(|address| format!("http://{address}/metrics")),
            audit: audit.map(|path| Audit {
                path: shown(&path),
                file_kib: service.audit.file_kib,
                files: service.audit.files,
            }),
        }
    }

    /// It as text for people.
    ///
    /// # Errors
    /// None that is expected: it is plain data.
    pub(crate) fn text(&self) -> serde_json::Result<String> {
        let mut text = String::new();
        write(&serde_json::to_value(self)?, 0, &mut text);
        Ok(text)
    }
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

fn bus(bus: &config::Bus) -> Bus {
    let link = match &bus.link {
        Link::Virtual => "virtual".to_owned(),
        Link::SocketCan(interface) => format!("socketcan:{interface}"),
    };
    Bus {
        name: bus.name.clone(),
        link,
        bit_rate_kbit_s: bus.bit_rate_kbit_s,
        socketcand: bus.socketcand.map(|address| address.to_string()),
        gateway: bus.gateway.as_ref().map(ToString::to_string),
    }
}

fn device(own: &config::Device, gateway: &Gateway) -> Device {
    let profile = &*own.profile;
    let identity = |sub| profile.identity(sub);
    let node = |place: &config::Attachment| Node {
        bus: gateway.buses.get(place.bus).map(|bus| bus.name.clone()).unwrap_or_default(),
        node_id: (place.node_id != UNCONFIGURED).then_some(place.node_id),
    };
    let bound = LIMITS.iter().flat_map(|(_, binding)| profile.bound_to(*binding));
    Device {
        name: own.name.clone(),
        profile: profile.name.clone(),
        product: profile.product.clone(),
        identity: Identity {
            vendor_id: identity(1),
            product_code: identity(2),
            revision: identity(3),
            serial: own.serial.unwrap_or_else(|| identity(4)),
        },
        axes: profile.axes(),
        motor: profile.motor.as_ref().map(motor),
        nodes: own.on.iter().map(node).collect(),
        unit_id: own.unit_id,
        modbus: view(own.modbus),
        owner: owner(own.owner, gateway),
        sdo_timeout_ms: own.sdo_timeout.map(millis),
        timing: match own.timing {
            Timing::Immediate => "immediate",
            Timing::Authentic => "authentic",
        },
        limits: bound.filter_map(|address| entered(profile, address)).collect(),
        objects: own.defaults.iter().filter_map(|own: &OwnDefault| entered(profile, own.address)).collect(),
        plant: plant(&own.plant),
    }
}

fn view(view: config::ModbusView) -> View {
    View {
        dialect: match view.dialect {
            ModbusDialect::Jvl => "jvl",
            ModbusDialect::Full => "full",
        },
        word_order: match view.word_order {
            WordOrder::LowFirst => "low-first",
            WordOrder::HighFirst => "high-first",
        },
        timeout_ms: view.timeout.map(millis),
    }
}

fn owner(owner: Option<Owner>, gateway: &Gateway) -> String {
    match owner {
        None => "any".to_owned(),
        Some(Owner::Modbus) => "modbus".to_owned(),
        Some(Owner::Bus(bus)) => gateway.buses.get(bus).map(|bus| bus.name.clone()).unwrap_or_default(),
    }
}

fn listener(own: &config::Listener, gateway: &Gateway) -> Listener {
    let shown = |networks: &[config::Network]| networks.iter().map(ToString::to_string).collect();
    Listener {
        listen: own.listen.iter().map(ToString::to_string).collect(),
        device: own.device.and_then(|device| gateway.devices.get(device)).map(|device| device.name.clone()),
        max_clients: own.max_clients,
        when_full: match own.when_full {
            WhenFull::Refuse => "refuse",
            WhenFull::Replace => "replace",
        },
        idle_timeout_s: own.idle_timeout.map(|time| time.as_secs()),
        allow: shown(&own.allow),
        read_only: shown(&own.read_only),
        write_ranges: own.write.iter().map(|r| format!("0x{:04X}-0x{:04X}", r.start(), r.end())).collect(),
    }
}

fn millis(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

fn motor(motor: &profiles::Motor) -> Motor {
    Motor {
        name: motor.name.clone(),
        kind: match motor.kind {
            MotorKind::Servo => "servo",
            MotorKind::Stepper(_) => "stepper",
        },
        counts_per_revolution: motor.counts_per_revolution,
        raster_ns: motor.raster_ns,
        max_speed_rpm: motor.max_speed_rpm,
        rated_torque_nm: motor.rated_torque_nm,
        peak_torque_factor: motor.peak_torque_factor,
        rotor_inertia_kg_m2: motor.rotor_inertia_kg_m2,
    }
}

/// An entry with its default.
fn entered(profile: &Profile, address: Address) -> Option<Entered> {
    let areas: [&Schema; 2] = [&profile.communication, &profile.application];
    let entry = areas.iter().find_map(|area| area.entry(area.slot(address)?))?;
    Some(Entered { object: address.to_string(), name: entry.name.clone(), value: initial(entry) })
}

fn initial(entry: &Entry) -> String {
    match &entry.initial {
        Initial::PlusNodeId(base) => format!("$NODEID+0x{base:X}"),
        Initial::Value(Value::Bytes(bytes)) => String::from_utf8_lossy(bytes).into_owned(),
        Initial::Value(Value::Fixed(raw)) => match Value::as_real(entry.data_type, *raw) {
            Some(real) => real.to_string(),
            None => entry.data_type.integer(*raw).to_string(),
        },
    }
}

/// What a user has made of the plant, each with its key.
fn plant(setup: &PlantSetup) -> Vec<String> {
    let PlantSetup { supply, noise, .. } = setup;
    let numbers = [
        ("load_inertia_kg_m2", setup.load_inertia_kg_m2),
        ("load_torque_nm", setup.load_torque_nm),
        ("friction_nm", setup.friction_nm),
        ("viscous_friction_nms_per_rad", setup.viscous_friction_nms),
        ("backlash_counts", setup.backlash.map(|place| place.0)),
        ("start_counts", setup.start.map(|place| place.0)),
        ("index_counts", setup.index.map(|place| place.0)),
        ("negative_limit_counts", setup.negative_limit.map(|place| place.0)),
        ("positive_limit_counts", setup.positive_limit.map(|place| place.0)),
        ("limit_switch_width_counts", setup.limit_switch_width.map(|place| place.0)),
        ("hysteresis_counts", setup.hysteresis.map(|place| place.0)),
        ("supply_v", supply.voltage.map(|voltage| voltage.0)),
        ("under_voltage_v", supply.under_voltage.map(|voltage| voltage.0)),
        ("over_voltage_v", supply.over_voltage.map(|voltage| voltage.0)),
        ("chopper_v", supply.chopper.map(|voltage| voltage.0)),
        ("dc_link_capacitance_f", supply.capacitance_f),
        ("encoder_noise_counts", noise.encoder),
        ("velocity_noise_counts_per_s", noise.velocity),
    ];
    let ranges = [("home_counts", setup.home), ("stops_counts", setup.stops)];
    let mut lines: Vec<String> =
        numbers.iter().filter_map(|(key, number)| Some(format!("{key} = {}", (*number)?))).collect();
    lines.extend(ranges.iter().filter_map(|(key, range)| {
        let range = (*range)?;
        Some(format!("{key} = [{}, {}]", range.min().0, range.max().0))
    }));
    lines.extend(noise.seed.map(|seed| format!("noise_seed = {seed}")));
    if !setup.active_low.is_empty() {
        lines.push(format!("active_low = {} inputs", setup.active_low.len()));
    }
    if !setup.faults.is_empty() {
        lines.push(format!("faults = {} by schedule", setup.faults.len()));
    }
    lines
}

/// A tree as indented lines; what is not there is `-`.
fn write(json: &Json, depth: usize, text: &mut String) {
    let Json::Object(fields) = json else { return };
    for (key, value) in fields {
        let indent = "  ".repeat(depth);
        match value {
            Json::Object(fields) if !fields.is_empty() => {
                let _ = writeln!(text, "{indent}{key}:");
                write(value, depth + 1, text);
            }
            Json::Array(items) if items.iter().any(Json::is_object) => {
                let _ = writeln!(text, "{indent}{key}:");
                items.iter().for_each(|item| write_item(item, depth + 1, text));
            }
            value => {
                let _ = writeln!(text, "{indent}{key}: {}", scalar(value));
            }
        }
    }
}

/// An item of a list: on one line, if nothing is in it that has parts.
fn write_item(item: &Json, depth: usize, text: &mut String) {
    let indent = "  ".repeat(depth);
    let Json::Object(fields) = item else { return };
    if fields.values().any(|value| value.is_object() || value.is_array()) {
        let _ = writeln!(text, "{indent}-");
        return write(item, depth + 1, text);
    }
    let parts: Vec<_> = fields.iter().map(|(key, value)| format!("{key}: {}", scalar(value))).collect();
    let _ = writeln!(text, "{indent}- {}", parts.join(", "));
}

fn scalar(json: &Json) -> String {
    match json {
        Json::Null => "-".to_owned(),
        Json::String(text) => text.clone(),
        Json::Array(items) if items.is_empty() => "-".to_owned(),
        Json::Array(items) => items.iter().map(scalar).collect::<Vec<_>>().join(", "),
        Json::Object(_) => "-".to_owned(),
        Json::Bool(_) | Json::Number(_) => json.to_string(),
    }
}
