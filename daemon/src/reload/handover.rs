//! Between the thread that reloads and the core loop: one step at a time, and neither waits for a lock of the other.

use std::collections::{BTreeMap, VecDeque};
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use ::socketcan::CanSocket;
use od::Owner;
use tokio::sync::broadcast;

use super::{Report, Stopping};
use crate::alarm::Bell;
use crate::core::{LinkId, ModbusPlan, Unit};
use crate::link::Gauge;
use crate::modbus_tcp::{Change, Sockets};
use crate::socketcand::Passed;

/// What the core loop is to do.
pub(crate) enum Step {
    /// Let devices ramp down, and take them out and then buses.
    Leave { devices: Vec<String>, links: Vec<LinkId> },
    /// Take in what is new, and change what stays.
    Join(Box<Arrivals>),
    /// Take note of what came of a reload.
    Tell(Arc<Report>),
}

/// What the core loop has done.
pub(crate) enum Done {
    /// These are out, and so are the buses with these sockets. They are dropped elsewhere.
    Left(Vec<Unit>, Vec<CanSocket>),
    /// All is in; the interfaces that are new, with what measures how busy they are, and what has gone with it.
    Joined(Vec<(String, Arc<Gauge>)>, Gone),
}

/// What takes its time to be dropped, and is dropped elsewhere.
#[derive(Debug, Default)]
pub(crate) struct Gone {
    /// Sockets where Modbus clients connected.
    pub(crate) listeners: Vec<TcpListener>,
    /// What Modbus clients saw of devices.
    pub(crate) views: Vec<ModbusPlan>,
}

/// What joins, and what changes with it.
#[derive(Default)]
pub(crate) struct Arrivals {
    /// New buses.
    pub(crate) links: VecDeque<NewLink>,
    /// Who hears buses that stay, and whether any by socketcand.
    pub(crate) clients: VecDeque<(LinkId, Option<broadcast::Sender<Passed>>, bool)>,
    /// Devices, each with what Modbus clients see of it.
    pub(crate) units: VecDeque<(Unit, Option<ModbusPlan>)>,
    pub(crate) adjustments: Vec<Adjustment>,
    /// What Modbus listeners need, if there was none before.
    pub(crate) sockets: Option<Sockets>,
    pub(crate) listeners: Vec<Change>,
    /// The device that each Modbus listener stands for, by name.
    pub(crate) stands_for: Vec<Option<String>>,
    /// The links in the order of their buses.
    pub(crate) order: Vec<LinkId>,
    /// Where devices stand, by their names.
    pub(crate) places: BTreeMap<String, usize>,
}

/// A bus that comes; its link is made by the core loop, whose thread it stays on.
pub(crate) struct NewLink {
    pub(crate) id: LinkId,
    pub(crate) bus: config::Bus,
    /// Whether the time is taken of how long SDO clients wait.
    pub(crate) is_timed: bool,
    pub(crate) clients: Option<broadcast::Sender<Passed>>,
}

/// A device that is reached or commanded otherwise.
pub(crate) struct Adjustment {
    /// Its name.
    pub(crate) device: String,
    /// What Modbus clients see of it.
    pub(crate) view: Option<ModbusPlan>,
    /// Who may command it, if that changes.
    pub(crate) owner: Option<Option<Owner>>,
}

/// The end of the core loop.
pub(crate) struct Steps {
    steps: Receiver<Step>,
    done: SyncSender<Done>,
}

/// The end of the thread that reloads.
pub(crate) struct Handover {
    steps: SyncSender<Step>,
    done: Receiver<Done>,
    bell: Bell,
}

/// Both ends; `bell` wakes the core loop.
pub(crate) fn steps(bell: Bell) -> (Steps, Handover) {
    let (to_core, steps) = sync_channel(1);
    let (done, from_core) = sync_channel(1);
    (Steps { steps, done }, Handover { steps: to_core, done: from_core, bell })
}

impl Steps {
    /// The next step, if there is one.
    pub(crate) fn poll(&self) -> Option<Step> {
        self.steps.try_recv().ok()
    }

    /// Tells that a step is done.
    pub(crate) fn done(&self, done: Done) {
        // There is one step at a time, so there is room; and a thread that has ended wants to know nothing.
        let _ = self.done.try_send(done);
    }
}

impl Handover {
    /// Lets devices and buses leave, and waits until they have.
    pub(super) fn leave(&self, devices: Vec<String>, links: Vec<LinkId>) -> Result<(), Stopping> {
        if devices.is_empty() && links.is_empty() {
            return Ok(());
        }
        self.place(Step::Leave { devices, links })?;
        match self.done.recv() {
            Ok(Done::Left(units, sockets)) => {
                // This is where their memory is given back, not on the way of a frame.
                drop((units, sockets));
                Ok(())
            }
            Ok(Done::Joined(..)) | Err(_) => Err(Stopping),
        }
    }

    /// Lets what is new join, and waits until it has; the interfaces that are new, with what measures how busy they are.
    pub(super) fn join(&self, arrivals: Arrivals) -> Result<Vec<(String, Arc<Gauge>)>, Stopping> {
        self.place(Step::Join(Box::new(arrivals)))?;
        match self.done.recv() {
            Ok(Done::Joined(gauges, gone)) => {
                drop(gone);
                Ok(gauges)
            }
            Ok(Done::Left(..)) | Err(_) => Err(Stopping),
        }
    }

    /// Tells what came of a reload.
    pub(super) fn tell(&self, report: Report) -> Result<(), Stopping> {
        self.place(Step::Tell(Arc::new(report)))
    }

    fn place(&self, step: Step) -> Result<(), Stopping> {
        self.steps.send(step).map_err(|_| Stopping)?;
        self.bell.ring();
        Ok(())
    }
}
