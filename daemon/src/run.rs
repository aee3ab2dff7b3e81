//! `axisd run`: puts everything together and hands it to the core loop, which runs on the main thread because
//! that is where the kernel delivers signals.

use std::collections::BTreeMap;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::sync_channel;

use config::Gateway;
use od::Instant;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::{flag, low_level};
use tokio::runtime::Handle;
use tracing::{info, warn};

use crate::alarm::Alarm;
use crate::ascii_gateway::{self, Gateways};
use crate::audit::{self, Files, Names, Trail};
use crate::cli::Failure;
use crate::clock::Clock;
use crate::control::{self, ControlSocket, Operation};
use crate::core::{Core, LinkId};
use crate::core_loop::{Collecting, CoreLoop, Reloads, Times};
use crate::link::{Link, measure};
use crate::log::Dial;
use crate::log::module::SERVICE;
use crate::modbus_tcp::{self, Sockets};
use crate::reload::{self, Asker, Reloader};
use crate::reporter::Reporter;
use crate::service_manager::ServiceManager;
use crate::socketcand::{self, Bus, Listening, Port, ToCore};
use crate::storage::{Claim, Storage};
use crate::{build, commands, demo, log, metrics, realtime, services};

/// `axisd run --config FILE`.
pub(crate) fn file(file: &Path) -> Result<(), Failure> {
    let gateway = commands::load(file)?;
    serve(gateway, Some(file), "give `socketcand` another port", "")
}

/// `axisd run --demo`.
pub(crate) fn demo(socketcand: Option<SocketAddr>) -> Result<(), Failure> {
    let mut gateway = commands::parse("demo.toml", config::DEMO)
        .map_err(|wrong| Failure::Configuration(wrong.to_string()))?;
    for bus in &mut gateway.buses {
        bus.socketcand = socketcand.or(bus.socketcand);
    }
    let introduction = demo::introduction(&gateway);
    serve(gateway, None, "choose another by --socketcand ADDR:PORT", &introduction)
}

/// Serves `gateway`, which stands in `file`, until a signal; `advice` is for a taken port, `introduction` for standard output.
fn serve(gateway: Gateway, file: Option<&Path>, advice: &str, introduction: &str) -> Result<(), Failure> {
    let ports = Ports::listen(&gateway, advice)?;
    let gateways = Gateways::listen(&gateway, &ports.served)?;
    let modbus = modbus_tcp::listen_all(&gateway)?;
    let (log, dial) = log::start(&gateway.service.log);
    count_warnings(&gateway);
    let outcome = run(gateway, file, (ports, gateways), modbus, introduction, dial);
    info!(target: SERVICE, "stopped");
    drop(log);
    outcome
}

/// Says which files have something odd about them; `axisd check` says what.
fn count_warnings(gateway: &Gateway) {
    let mut files: BTreeMap<&str, usize> = BTreeMap::new();
    gateway.warnings.0.iter().for_each(|warning| *files.entry(&warning.file).or_default() += 1);
    for (file, number) in files {
        warn!(target: SERVICE, "{file} has something odd in {number} places; `axisd check` tells which");
    }
}

/// Runs until a signal; the control socket and those of gateways are in the file system until then.
fn run(
    gateway: Gateway,
    file: Option<&Path>,
    (ports, mut gateways): (Ports, Gateways),
    modbus: Vec<modbus_tcp::Listening>,
    introduction: &str,
    dial: Dial,
) -> Result<(), Failure> {
    let other = |error: io::Error| Failure::Other(error.to_string());
    let (socket, listener) = control_socket(&gateway)?.unzip();
    socket.iter().for_each(|socket| info!(target: SERVICE, "control socket {}", socket.path().display()));
    let hang_up = file.map(|_| reload_on_signal()).transpose().map_err(other)?;
    let (asker, asking) = hang_up.as_ref().map(reload::asker).unzip();
    let sockets = core::mem::take(&mut gateways.sockets);
    let (mut core_loop, around) = start(&gateway, (ports, gateways), listener, dial, asker)?;
    modbus_tcp::introduce(&mut core_loop.core, &gateway);
    let has_sockets = !modbus.is_empty();
    if has_sockets {
        core_loop.modbus = Some(Sockets::new(modbus).map_err(other)?);
    }
    let wanted = gateway.service.realtime.clone();
    // Whoever reloads waits until all is served.
    let (ready, is_ready) = sync_channel(1);
    if let (Some(file), Some(alarm), Some(asking)) = (file, hang_up, asking) {
        let reloader = reloader(file, gateway, around, &mut core_loop, has_sockets);
        reloader.and_then(|reloader| reloader.start(alarm, asking, is_ready)).map_err(other)?;
    }
    // Threads from before have no part in it.
    realtime::apply(&wanted);
    core_loop.share_processor();
    let outcome = core_loop.run(|| {
        announce(introduction);
        // Without a file there is nobody.
        let _ = ready.send(());
    });
    drop((socket, sockets));
    outcome.map_err(other)
}

/// What is beside the core loop.
struct Around {
    services: Handle,
    to_core: ToCore,
    ports: Ports,
    dial: Dial,
}

/// The core loop, ready to run, and what is beside it.
fn start(
    gateway: &Gateway,
    (mut ports, gateways): (Ports, Gateways),
    control: Option<UnixListener>,
    dial: Dial,
    reload: Option<Asker>,
) -> Result<(CoreLoop, Around), Failure> {
    let other = |error: io::Error| Failure::Other(error.to_string());
    let clock = Clock::start();
    let alarm = Alarm::new().map_err(other)?;
    let stop = stop_on_signal(&alarm).map_err(other)?;
    let links = links(gateway, &ports, clock);
    let mut core = build::core(gateway, clock.now())?;
    let (publisher, reader) = control::board(alarm.bell());
    let has_metrics = gateway.service.metrics.is_some();
    let metrics = gateway.service.metrics.map(listen_for_metrics).transpose()?;
    let publisher = (control.is_some() || metrics.is_some()).then_some(publisher);
    let metrics = metrics.map(|listener| (listener, reader.clone()));
    let (inbox, orders) = control::orders(alarm.bell());
    let inbox = (control.is_some() || !gateways.listening.is_empty()).then_some(inbox);
    let audit = audit::directory(gateway, storage_directory(gateway).as_deref());
    let operation = Operation { log: Some(dial.clone()), audit, reload };
    let control = control
        .map(|listener| (listener, control::ToCore { reader, orders: orders.clone(), operation, clock }));
    let (to_core, clients) = ToCore::new(alarm.bell());
    let services = services::serve(|| {
        links.iter().filter_map(Link::gauge).for_each(|(interface, gauge)| measure(interface, &gauge));
        socketcand::serve(core::mem::take(&mut ports.listening), &to_core, clock)?;
        ascii_gateway::serve(gateways.listening, &to_core, &orders, clock)?;
        metrics.map_or(Ok(()), |(listener, reader)| metrics::serve(listener, reader))?;
        control.map_or(Ok(()), |(listener, to_core)| control::serve(listener, to_core))
    });
    let around = Around { services: services.map_err(other)?, to_core, ports, dial };
    let storage = match storage_directory(gateway) {
        None => Storage::default(),
        Some(directory) => store_in(&directory, &mut core, clock.now(), &alarm)?,
    };
    let audit = keep_audit(gateway, &mut core, clock)?;
    let reporter = Reporter::new(links.len());
    let core_loop = CoreLoop {
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
        collecting: Collecting::default(),
        inbox,
        storing: Vec::new(),
        attentive_until: Instant::ZERO,
        audit,
        turns_without_clock: 0,
        times: if has_metrics { Times::default().with_turns() } else { Times::default() },
        reloads: Reloads::new(None),
        share: None,
    };
    Ok((core_loop, around))
}

/// Who reloads `file`, which says `gateway`.
fn reloader(
    file: &Path,
    gateway: Gateway,
    Around { services, to_core, ports, dial }: Around,
    core_loop: &mut CoreLoop,
    has_sockets: bool,
) -> io::Result<Reloader> {
    let (steps, handover) = reload::steps(core_loop.alarm.bell());
    core_loop.reloads = Reloads::new(Some(steps));
    Ok(Reloader {
        file: file.to_owned(),
        links: reload::names(&gateway),
        listeners: reload::listeners(&gateway),
        has_sockets,
        served: ports.served,
        ports: ports.ports,
        services,
        to_core,
        storage: storage_directory(&gateway),
        dial,
        manager: core_loop.manager.for_another_thread()?,
        clock: core_loop.clock,
        handover,
        running: gateway,
    })
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
fn store_in(directory: &Path, core: &mut Core, now: Instant, alarm: &Alarm) -> Result<Storage, Failure> {
    let failed = |error: io::Error| {
        Failure::Other(format!("cannot store parameters in {}: {error}", directory.display()))
    };
    let claim = Claim::take(directory).map_err(failed)?;
    core.units_mut().for_each(|unit| build::load_parameters(unit, now, directory));
    Storage::start(claim, alarm.bell()).map_err(failed)
}

/// The ports of socketcand and the buses behind them.
struct Ports {
    listening: Vec<Listening>,
    ports: BTreeMap<SocketAddr, Port>,
    /// The buses that they or gateways lead to, by their names.
    served: BTreeMap<String, Bus>,
}

impl Ports {
    /// Binds every port once, whichever buses share it.
    fn listen(gateway: &Gateway, advice: &str) -> Result<Self, Failure> {
        let mut buses: BTreeMap<SocketAddr, Vec<Bus>> = BTreeMap::new();
        let mut served = BTreeMap::new();
        for (number, bus) in gateway.buses.iter().enumerate() {
            if bus.has_clients() {
                let own = Bus::new(&bus.name, LinkId(number as u16));
                served.insert(bus.name.clone(), own.clone());
                bus.socketcand.into_iter().for_each(|port| buses.entry(port).or_default().push(own.clone()));
            }
        }
        let (mut listening, mut ports) = (Vec::new(), BTreeMap::new());
        for (address, buses) in buses {
            let listener = socketcand::listen(address).map_err(|error| {
                Failure::Other(format!("cannot serve socketcand on {address}: {error}; {advice}"))
            })?;
            let (own, port) = Listening::new(listener, buses);
            listening.push(own);
            ports.insert(address, port);
        }
        Ok(Self { listening, ports, served })
    }
}

fn links(gateway: &Gateway, ports: &Ports, clock: Clock) -> Vec<Link> {
    let is_timed = gateway.service.metrics.is_some();
    let link = |(number, bus): (usize, &config::Bus)| {
        let mut link = build::link(bus, LinkId(number as u16), is_timed, clock.now());
        let clients = ports.served.get(&bus.name).map(|served| served.frames.clone());
        link.set_clients(clients, bus.socketcand.is_some());
        link
    };
    gateway.buses.iter().enumerate().map(link).collect()
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

/// An alarm that SIGHUP rings.
fn reload_on_signal() -> io::Result<Alarm> {
    let alarm = Alarm::new()?;
    low_level::pipe::register(SIGHUP, alarm.descriptor()?)?;
    Ok(alarm)
}

/// Says that everything is served.
fn announce(introduction: &str) {
    // The demo serves, whether or not anybody reads what it says.
    let _ = commands::print(introduction);
    eprintln!("axisd ready");
}
