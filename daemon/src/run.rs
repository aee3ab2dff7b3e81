//! `axisd run`: puts everything together and hands it to the core loop, which runs on the main thread because
//! that is where the kernel delivers signals.

use std::collections::BTreeMap;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use config::Gateway;
use od::Instant;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::{flag, low_level};
use tokio::sync::mpsc;
use tracing::{info, warn};

use crate::alarm::Alarm;
use crate::audit::{self, Files, Names, Trail};
use crate::cli::Failure;
use crate::clock::Clock;
use crate::commands;
use crate::control::{self, ControlSocket, Operation, Reader};
use crate::core::{Core, LinkId, Plan};
use crate::core_loop::{CoreLoop, Times};
use crate::demo;
use crate::link::{Gauge, Link, Load, SocketCan, measure};
use crate::log::Dial;
use crate::log::module::{SERVICE, STORAGE};
use crate::modbus_tcp::{self, Sockets};
use crate::realtime;
use crate::reporter::Reporter;
use crate::service_manager::ServiceManager;
use crate::services;
use crate::socketcand::{self, Bus, Inbound, Listening, ToCore};
use crate::storage::{self, Claim, Storage};
use crate::{log, metrics};

/// `axisd run --config FILE`.
pub(crate) fn file(file: &Path) -> Result<(), Failure> {
    let gateway = commands::load(file)?;
    serve(&gateway, "give `socketcand` another port", "")
}

/// `axisd run --demo`.
pub(crate) fn demo(socketcand: Option<SocketAddr>) -> Result<(), Failure> {
    let mut gateway = commands::parse("demo.toml", config::DEMO)
        .map_err(|wrong| Failure::Configuration(wrong.to_string()))?;
    for bus in &mut gateway.buses {
        bus.socketcand = socketcand.or(bus.socketcand);
    }
    serve(&gateway, "choose another by --socketcand ADDR:PORT", &demo::introduction(&gateway))
}

/// Serves `gateway` until a signal; `advice` is for a taken port, `introduction` for standard output.
fn serve(gateway: &Gateway, advice: &str, introduction: &str) -> Result<(), Failure> {
    let listening = listen(gateway, advice)?;
    let modbus = modbus_tcp::listen_all(gateway)?;
    let (log, dial) = log::start(&gateway.service.log);
    let outcome = run(gateway, listening, modbus, introduction, dial);
    info!(target: SERVICE, "stopped");
    drop(log);
    outcome
}

/// Runs until a signal; the control socket is in the file system until then.
fn run(
    gateway: &Gateway,
    listening: Vec<Listening>,
    modbus: Vec<modbus_tcp::Listening>,
    introduction: &str,
    dial: Dial,
) -> Result<(), Failure> {
    let (socket, listener) = control_socket(gateway)?.unzip();
    socket.iter().for_each(|socket| info!(target: SERVICE, "control socket {}", socket.path().display()));
    let mut core_loop = start(gateway, listening, listener, dial)?;
    modbus_tcp::introduce(&mut core_loop.core, gateway);
    if !modbus.is_empty() {
        let sockets = Sockets::new(modbus).map_err(|error| Failure::Other(error.to_string()))?;
        core_loop.modbus = Some(sockets);
    }
    realtime::apply(&gateway.service.realtime);
    let outcome = core_loop.run(|| announce(introduction));
    drop(socket);
    outcome.map_err(|error| Failure::Other(error.to_string()))
}

/// The core loop, ready to run.
fn start(
    gateway: &Gateway,
    listening: Vec<Listening>,
    control: Option<UnixListener>,
    dial: Dial,
) -> Result<CoreLoop, Failure> {
    let other = |error: io::Error| Failure::Other(error.to_string());
    let clock = Clock::start();
    let alarm = Alarm::new().map_err(other)?;
    let stop = stop_on_signal(&alarm).map_err(other)?;
    let links = links(gateway, &listening, clock);
    let mut core = core(gateway, clock.now())?;
    let (publisher, reader) = control::board(alarm.bell());
    let has_metrics = gateway.service.metrics.is_some();
    let metrics = gateway.service.metrics.map(listen_for_metrics).transpose()?;
    let publisher = (control.is_some() || metrics.is_some()).then_some(publisher);
    let metrics = metrics.map(|listener| (listener, reader.clone()));
    let (inbox, orders) = control::orders(alarm.bell());
    let inbox = control.is_some().then_some(inbox);
    let audit = audit::directory(gateway, storage_directory(gateway).as_deref());
    let operation = Operation { log: Some(dial), audit };
    let has_clients = publisher.is_some();
    let control = control.map(|listener| (listener, control::ToCore { reader, orders, operation, clock }));
    let gauges = if has_clients { gauges(&links) } else { Vec::new() };
    let clients = serve_clients(listening, control, metrics, gauges, &alarm, clock).map_err(other)?;
    let devices: Vec<String> = gateway.devices.iter().map(|device| device.name.clone()).collect();
    let storage = match storage_directory(gateway) {
        None => Storage::default(),
        Some(directory) => store_in(&directory, &mut core, clock.now(), &devices, &alarm)?,
    };
    let audit = keep_audit(gateway, &mut core, clock)?;
    let reporter = Reporter::new(links.len());
    Ok(CoreLoop {
        core,
        links,
        clients,
        modbus: None,
        clock,
        alarm,
        stop,
        reporter,
        manager: ServiceManager::from_environment(clock.now()),
        storage,
        publisher,
        inbox,
        storing: Vec::new(),
        attentive_until: Instant::ZERO,
        audit,
        turns_without_clock: 0,
        times: if has_metrics { Times::default().with_turns() } else { Times::default() },
    })
}

/// The devices of `gateway` on its buses.
pub(crate) fn core(gateway: &Gateway, now: Instant) -> Result<Core, Failure> {
    let mut core = Core::new(gateway.buses.len() as u16, &plans(gateway), now).map_err(|error| {
        let device = gateway.devices.get(error.device).map_or("?", |device| device.name.as_str());
        Failure::Configuration(format!("device `{device}`: {}", error.reason))
    })?;
    for (number, device) in gateway.devices.iter().enumerate() {
        device.sdo_timeout.into_iter().for_each(|timeout| core.set_sdo_timeout(number, timeout));
        core.set_timing(number, device.timing);
    }
    Ok(core)
}

/// Where it is kept who commanded what, if anywhere.
fn keep_audit(gateway: &Gateway, core: &mut Core, clock: Clock) -> Result<Option<Trail>, Failure> {
    let Some(directory) = audit::directory(gateway, storage_directory(gateway).as_deref()) else {
        return Ok(None);
    };
    let config::Audit { file_kib, files, .. } = gateway.service.audit;
    let names = Names {
        devices: gateway.devices.iter().map(|own| (own.name.clone(), Arc::clone(&own.profile))).collect(),
        buses: gateway.buses.iter().map(|bus| bus.name.clone()).collect(),
    };
    let files = Files::open(&directory, u64::from(file_kib) * 1024, files.into());
    let trail = files.and_then(|files| Trail::start(files, names, clock)).map_err(|error| {
        Failure::Other(format!("cannot keep the audit trail in {}: {error}", directory.display()))
    })?;
    core.keep_audit();
    Ok(Some(trail))
}

/// Where devices store their parameters: where the configuration says, else in the directory that the service manager has
/// made for this service, else nowhere.
pub(crate) fn storage_directory(gateway: &Gateway) -> Option<PathBuf> {
    gateway.storage.clone().or_else(|| control::directory_of_service("STATE_DIRECTORY"))
}

/// Claims the directory and gives every device what it has stored there.
fn store_in(
    directory: &Path,
    core: &mut Core,
    now: Instant,
    devices: &[String],
    alarm: &Alarm,
) -> Result<Storage, Failure> {
    let failed = |error: io::Error| {
        Failure::Other(format!("cannot store parameters in {}: {error}", directory.display()))
    };
    let claim = Claim::take(directory).map_err(failed)?;
    load_parameters(core, now, directory, devices);
    Storage::start(claim, devices, alarm.bell()).map_err(failed)
}

/// Gives every device what it has stored.
fn load_parameters(core: &mut Core, now: Instant, directory: &Path, devices: &[String]) {
    for (number, device) in devices.iter().enumerate() {
        match storage::load(directory, device) {
            Ok(None) => {}
            Ok(Some(parameters)) => match core.load(now, number, parameters) {
                0 => {}
                left_out => {
                    warn!(target: STORAGE, device, "{device}: {left_out} stored values do not fit the profile and are left out");
                }
            },
            Err(error) => {
                let file = directory.join(storage::file_name(device));
                warn!(target: STORAGE, device, "{device}: starts with the defaults, for {} cannot be used: {error}", file.display());
                core.lose_parameters(number);
            }
        }
    }
}

fn plans(gateway: &Gateway) -> Vec<Plan> {
    let plan = |device: &config::Device| Plan {
        name: device.name.as_str().into(),
        profile: Arc::clone(&device.profile),
        nodes: device.on.iter().map(|place| (LinkId(place.bus as u16), place.node_id)).collect(),
        plant: device.plant.clone(),
        serial: device.serial,
    };
    gateway.devices.iter().map(plan).collect()
}

/// Binds every port once, whichever buses share it.
fn listen(gateway: &Gateway, advice: &str) -> Result<Vec<Listening>, Failure> {
    let mut ports: BTreeMap<SocketAddr, Vec<Bus>> = BTreeMap::new();
    for (number, bus) in gateway.buses.iter().enumerate() {
        if let Some(address) = bus.socketcand {
            ports.entry(address).or_default().push(Bus::new(&bus.name, LinkId(number as u16)));
        }
    }
    let listen = |(address, buses)| {
        let listener = socketcand::listen(address).map_err(|error| {
            Failure::Other(format!("cannot serve socketcand on {address}: {error}; {advice}"))
        })?;
        Ok(Listening { listener, buses })
    };
    ports.into_iter().map(listen).collect()
}

fn links(gateway: &Gateway, listening: &[Listening], clock: Clock) -> Vec<Link> {
    let served = || listening.iter().flat_map(|port| &port.buses);
    let link = |(number, bus): (usize, &config::Bus)| {
        let clients = served().find(|served| usize::from(served.link.0) == number);
        let interface = match &bus.link {
            config::Link::Virtual => None,
            config::Link::SocketCan(name) => {
                let interface = SocketCan::new(name, clients.is_some(), clock.now());
                Some(if gateway.service.metrics.is_some() { interface.timed() } else { interface })
            }
        };
        let (name, clients) = (bus.name.clone(), clients.map(|clients| clients.frames.clone()));
        let (id, load, taps) = (LinkId(number as u16), Load::default(), Vec::new());
        Link { id, name, interface, clients, received: 0, sent: 0, load, taps, kinds: Default::default() }
    };
    gateway.buses.iter().enumerate().map(link).collect()
}

/// The interfaces whose load is measured while there is somebody to tell it to.
fn gauges(links: &[Link]) -> Vec<(String, Arc<Gauge>)> {
    let interfaces = links.iter().filter_map(|link| link.interface.as_ref());
    interfaces.map(|interface| (interface.interface().to_owned(), Arc::clone(interface.gauge()))).collect()
}

/// Listens where the configuration says. Without that the default places do, or none: whoever runs a demo may have no
/// place for it.
fn control_socket(gateway: &Gateway) -> Result<Option<(ControlSocket, UnixListener)>, Failure> {
    if let Some(path) = &gateway.control {
        return ControlSocket::bind(path).map(Some).map_err(|error| {
            Failure::Other(format!("cannot serve the control socket {}: {error}", path.display()))
        });
    }
    let bound = ControlSocket::bind_first(&control::places_to_serve());
    Ok(bound
        .map_err(|tried| warn!(target: SERVICE, "no control socket, axisctl finds nobody; tried {tried}"))
        .ok())
}

/// Serves the clients of the socketcand ports, of the control socket and of the metrics; what the former send comes out.
fn serve_clients(
    listening: Vec<Listening>,
    control: Option<(UnixListener, control::ToCore)>,
    metrics: Option<(TcpListener, Reader)>,
    gauges: Vec<(String, Arc<Gauge>)>,
    alarm: &Alarm,
    clock: Clock,
) -> io::Result<Option<mpsc::Receiver<Inbound>>> {
    let (to_core, clients) = ToCore::new(alarm.bell());
    let clients = (!listening.is_empty()).then_some(clients);
    if clients.is_some() || control.is_some() || metrics.is_some() {
        services::serve(|| {
            gauges.into_iter().for_each(|(interface, gauge)| measure(interface, gauge));
            socketcand::serve(listening, &to_core, clock)?;
            metrics.map_or(Ok(()), |(listener, reader)| metrics::serve(listener, reader))?;
            control.map_or(Ok(()), |(listener, to_core)| control::serve(listener, to_core))
        })?;
    }
    Ok(clients)
}

fn listen_for_metrics(address: SocketAddr) -> Result<TcpListener, Failure> {
    metrics::listen(address)
        .map_err(|error| Failure::Other(format!("cannot serve metrics on {address}: {error}")))
}

/// A flag that SIGTERM and SIGINT set; the second of them ends the process at once.
fn stop_on_signal(alarm: &Alarm) -> io::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGTERM, SIGINT] {
        flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&stop))?;
        flag::register(signal, Arc::clone(&stop))?;
        low_level::pipe::register(signal, alarm.descriptor()?)?;
    }
    Ok(stop)
}

/// Says that everything is served.
fn announce(introduction: &str) {
    // The demo serves, whether or not anybody reads what it says.
    let _ = commands::print(introduction);
    eprintln!("axisd ready");
}
