//! Taking another configuration while the daemon runs: on SIGHUP, and on demand of `axisctl reload`.
//!
//! A thread of its own reads the file, finds out what is different ([`config::Changes`]), and builds what is new. The core
//! loop is told in two steps ([`Step`]): who leaves, and when they have, who joins. What joins is complete by then, so it
//! costs the core loop no more than a few frames would, and those that stay notice nothing. Whatever can fail is tried
//! before the first step, so a reload is taken as a whole or not at all.

mod handover;
mod prepare;
mod report;

use std::collections::BTreeMap;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use config::Gateway;
use sd_notify::NotifyState;
use tokio::runtime::Handle;
use tokio::sync::oneshot;
use tracing::{error, info, warn};

use crate::alarm::{Alarm, Bell};
use crate::build;
use crate::clock::Clock;
use crate::link::measure;
use crate::log::Dial;
use crate::log::module::SERVICE;
use crate::service_manager::ServiceManager;
use crate::socketcand::{self, Bus, Listening, Port, ToCore};

pub(crate) use handover::{Adjustment, Arrivals, Done, Gone, NewLink, Step, Steps, steps};
use prepare::{PortPlan, Prepared, Whose};
pub use report::Report;

/// Who wants to know what comes of the next reload, at most.
const MAX_ASKING: usize = 16;

/// Asks for a reload.
#[derive(Clone, Debug)]
pub struct Asker {
    asking: SyncSender<oneshot::Sender<Report>>,
    bell: Bell,
}

impl Asker {
    /// Asks for a reload; what came of it.
    ///
    /// # Errors
    /// Too many ask, or the daemon stops.
    pub async fn ask(&self) -> Result<Report, String> {
        let (report, answer) = oneshot::channel();
        self.asking.try_send(report).map_err(|_| "too many ask for a reload".to_owned())?;
        self.bell.ring();
        answer.await.map_err(|_| "the daemon stops".to_owned())
    }
}

/// The daemon stops: there is nobody any more who could take a configuration.
#[derive(Clone, Copy, Debug)]
struct Stopping;

/// What the daemon was started with, and who is told of changes.
pub(crate) struct Reloader {
    pub(crate) file: PathBuf,
    /// The configuration in effect.
    pub(crate) running: Gateway,
    /// The names of the buses by their links.
    pub(crate) links: Vec<Option<String>>,
    /// Whose the Modbus listeners are, by their numbers.
    pub(crate) listeners: Vec<Option<Whose>>,
    /// Whether the core loop has what Modbus listeners need.
    pub(crate) has_sockets: bool,
    /// Buses that are served by socketcand or a gateway, by their names.
    pub(crate) served: BTreeMap<String, Bus>,
    pub(crate) ports: BTreeMap<SocketAddr, Port>,
    pub(crate) services: Handle,
    pub(crate) to_core: ToCore,
    /// Where devices store.
    pub(crate) storage: Option<PathBuf>,
    pub(crate) dial: Dial,
    pub(crate) manager: ServiceManager,
    pub(crate) clock: Clock,
    pub(crate) handover: handover::Handover,
}

impl Reloader {
    /// Reloads whenever `alarm` rings, from when all `is_ready` on, on a thread of its own, until the core loop ends.
    ///
    /// # Errors
    /// The operating system has no thread left.
    pub(crate) fn start(
        mut self,
        alarm: Alarm,
        asking: Receiver<oneshot::Sender<Report>>,
        is_ready: Receiver<()>,
    ) -> io::Result<()> {
        let run = move || {
            if is_ready.recv().is_err() {
                return;
            }
            while alarm.wait().is_ok() {
                // What rings from now on, or asks, wants another one: the file may have changed meanwhile.
                let asking: Vec<_> = asking.try_iter().collect();
                let Ok(report) = self.reload() else { return };
                for who in asking {
                    // Whoever has left does not want to know.
                    let _ = who.send(report.clone());
                }
            }
        };
        thread::Builder::new().name("reload".to_owned()).spawn(run).map(drop)
    }

    fn reload(&mut self) -> Result<Report, Stopping> {
        let moment = NotifyState::monotonic_usec_now();
        let states: Vec<_> = core::iter::once(NotifyState::Reloading).chain(moment.ok()).collect();
        self.manager.tell(&states);
        info!(target: SERVICE, "reload: reading {}", self.file.display());
        let report = match self.prepare() {
            Ok(prepared) => self.carry_out(prepared)?,
            Err(errors) => Report::refused(errors),
        };
        for line in report.lines() {
            match report.is_refused() {
                true => error!(target: SERVICE, "reload: {line}"),
                false if line.starts_with(report::RESTART) => warn!(target: SERVICE, "reload: {line}"),
                false => info!(target: SERVICE, "reload: {line}"),
            }
        }
        self.handover.tell(report.clone())?;
        self.manager.tell(&[NotifyState::Ready]);
        Ok(report)
    }

    /// Takes what was prepared, of which nothing can be wrong any more.
    fn carry_out(&mut self, prepared: Prepared) -> Result<Report, Stopping> {
        let Prepared { changes, links, names, removed_links, ports, served, listeners, mut arrivals } =
            prepared;
        let report = Report::of(&changes);
        let replaced = changes.replaced.iter().filter_map(|device| changes.next.devices.get(*device));
        let leaving = changes.removed.iter().cloned().chain(replaced.map(|device| device.name.clone()));
        self.handover.leave(leaving.collect(), removed_links)?;
        let now = self.clock.now();
        for device in changes.replaced.iter().chain(&changes.added) {
            let Some(device) = changes.next.devices.get(*device) else { continue };
            match build::unit(device, &links, now) {
                Ok(mut unit) => {
                    // Only now: those that leave may have stored until then.
                    if let Some(directory) = &self.storage {
                        build::load_parameters(&mut unit, now, directory);
                    }
                    arrivals.units.push_back((unit, self.view(&changes.next, device)));
                }
                Err(wrong) => error!(target: SERVICE, "reload: {}: {wrong}", device.name),
            }
        }
        let gauges = self.handover.join(arrivals)?;
        let _services = self.services.enter();
        gauges.into_iter().for_each(|(interface, gauge)| measure(interface, &gauge));
        self.serve(ports);
        if changes.log
            && let Err(closed) = self.dial.reset(&changes.next.service.log)
        {
            warn!(target: SERVICE, "reload: {closed}");
        }
        (self.running, self.links, self.served, self.listeners) = (changes.next, names, served, listeners);
        Ok(report)
    }

    /// Serves these buses on these ports, and no others.
    fn serve(&mut self, ports: Vec<PortPlan>) {
        let mut before = core::mem::take(&mut self.ports);
        for (address, listener, buses) in ports {
            let port = match (before.remove(&address), listener) {
                (Some(port), _) => {
                    port.serve(buses);
                    port
                }
                (None, Some(listener)) => {
                    let (listening, port) = Listening::new(listener, buses);
                    if let Err(wrong) = socketcand::serve(vec![listening], &self.to_core, self.clock) {
                        error!(target: SERVICE, "reload: socketcand on {address}: {wrong}");
                    }
                    port
                }
                (None, None) => continue,
            };
            self.ports.insert(address, port);
        }
    }
}

/// A way to ask for reloads, which `alarm` tells of, and its other end.
pub(crate) fn asker(alarm: &Alarm) -> (Asker, Receiver<oneshot::Sender<Report>>) {
    let (asking, asked) = sync_channel(MAX_ASKING);
    (Asker { asking, bell: alarm.bell() }, asked)
}

/// The names of the buses by their links, which are their positions at first.
pub(crate) fn names(gateway: &Gateway) -> Vec<Option<String>> {
    gateway.buses.iter().map(|bus| Some(bus.name.clone())).collect()
}

/// Whose the Modbus listeners are, by their numbers, which are their positions at first.
pub(crate) fn listeners(gateway: &Gateway) -> Vec<Option<Whose>> {
    gateway.modbus.iter().map(|listener| Some(Whose::of(gateway, listener))).collect()
}
