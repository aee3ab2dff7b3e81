//! Devices and buses that leave and join between two turns, while everything else goes on.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use od::Instant;

use super::{CoreLoop, FAREWELL, LONGEST_RAMP, link_id};
use crate::build;
use crate::core::{LinkId, ModbusPlan, Unit};
use crate::link::{Gauge, Link, SocketCan};
use crate::reload::{Adjustment, Arrivals, Done, NewLink, Report, Step, Steps};

/// Where a reload stands.
#[derive(Default)]
pub(crate) enum Stage {
    /// There is none, or it prepares something beside the loop.
    #[default]
    Idle,
    /// Axes ramp down.
    Leaving {
        devices: Vec<usize>,
        links: Vec<LinkId>,
        /// When they are out, as SIGTERM would leave them.
        until: Instant,
        /// All are at rest, and masters can still see that.
        is_farewell: bool,
    },
    /// Devices join, one each turn.
    Joining {
        units: VecDeque<(Unit, Option<ModbusPlan>)>,
        stands_for: Vec<Option<String>>,
        places: BTreeMap<String, usize>,
        gauges: Vec<(String, Arc<Gauge>)>,
    },
}

/// What the loop has to do with reloads.
pub(crate) struct Reloads {
    pub(crate) steps: Option<Steps>,
    pub(crate) stage: Stage,
    /// What came of the last one.
    pub(crate) last: Option<Arc<Report>>,
}

impl Reloads {
    /// Nothing so far.
    pub(crate) fn new(steps: Option<Steps>) -> Self {
        Self { steps, stage: Stage::Idle, last: None }
    }

    /// When devices that leave are out at the latest.
    pub(super) fn deadline(&self) -> Option<Instant> {
        match &self.stage {
            Stage::Leaving { until, .. } => Some(*until),
            Stage::Idle | Stage::Joining { .. } => None,
        }
    }

    fn done(&mut self, done: Done) {
        self.stage = Stage::Idle;
        if let Some(steps) = &self.steps {
            steps.done(done);
        }
    }
}

impl CoreLoop {
    /// Goes on with a reload, if there is one. Whether there is more to do at once.
    pub(super) fn reload(&mut self, now: Instant) -> bool {
        match &mut self.reloads.stage {
            Stage::Idle => match self.reloads.steps.as_ref().and_then(Steps::poll) {
                None => false,
                Some(step) => {
                    self.begin(now, step);
                    true
                }
            },
            Stage::Leaving { .. } => {
                self.let_leave(now);
                false
            }
            Stage::Joining { units, stands_for, places, gauges } => {
                match units.pop_front() {
                    Some((unit, view)) => self.let_join(now, unit, view),
                    None => {
                        let (stands_for, gauges) = (core::mem::take(stands_for), core::mem::take(gauges));
                        self.core.arrange(places);
                        for (listener, device) in stands_for.into_iter().enumerate() {
                            let device = device.and_then(|device| self.core.find(&device));
                            self.core.set_listener_device(listener, device);
                        }
                        self.reloads.done(Done::Joined(gauges));
                    }
                }
                true
            }
        }
    }

    fn begin(&mut self, now: Instant, step: Step) {
        match step {
            Step::Leave { devices, links } => {
                let devices: Vec<usize> = devices.iter().filter_map(|name| self.core.find(name)).collect();
                let is_quiet = devices.iter().all(|device| self.core.is_at_rest(*device));
                // Of what is at rest nobody has to see that it is.
                let until = if is_quiet { now } else { now + LONGEST_RAMP };
                devices.iter().for_each(|device| self.core.shut_down_device(now, *device));
                self.transmit(now);
                self.reloads.stage = Stage::Leaving { devices, links, until, is_farewell: is_quiet };
            }
            Step::Join(arrivals) => {
                let Arrivals {
                    links,
                    clients,
                    units,
                    adjustments,
                    sockets,
                    listeners,
                    stands_for,
                    order,
                    places,
                } = *arrivals;
                let gauges = links.into_iter().filter_map(|link| self.open_link(now, link)).collect();
                for (place, LinkId(link)) in order.into_iter().enumerate() {
                    self.links.get_mut(usize::from(link)).into_iter().for_each(|link| link.place = place);
                }
                for (LinkId(link), clients) in clients {
                    if let Some(known) = self.links.get_mut(usize::from(link)) {
                        known.set_clients(clients);
                        self.subscribe(now, usize::from(link));
                    }
                }
                adjustments.into_iter().for_each(|adjustment| self.adjust(adjustment));
                self.modbus = self.modbus.take().or(sockets);
                if let Some(modbus) = self.modbus.as_mut().filter(|_| !listeners.is_empty()) {
                    modbus.change(now, &mut self.core, listeners);
                }
                self.reloads.stage = Stage::Joining { units, stands_for, places, gauges };
            }
            Step::Tell(report) => {
                self.audit.iter_mut().for_each(|audit| audit.note_reload(now, &report));
                self.reloads.last = Some(report);
            }
        }
    }

    /// Takes devices out that are at rest or had time enough for it, and then buses.
    fn let_leave(&mut self, now: Instant) {
        let Stage::Leaving { devices, until, is_farewell, .. } = &mut self.reloads.stage else { return };
        if !*is_farewell && devices.iter().all(|device| self.core.is_at_rest(*device)) {
            *is_farewell = true;
            *until = (*until).min(now + FAREWELL);
        }
        // What is being stored is not torn off: its end wakes the loop.
        if now < *until || devices.iter().any(|device| self.core.is_storing(*device)) {
            return;
        }
        let Stage::Leaving { devices, links, .. } = core::mem::take(&mut self.reloads.stage) else { return };
        devices.iter().for_each(|device| self.core.conclude_audit(*device));
        self.reporter.report(now, &mut self.core, &self.links);
        self.keep_audit();
        let units = devices.into_iter().filter_map(|device| self.core.leave(device)).collect();
        self.transmit(now);
        for link in links {
            let gone = self.links.get_mut(usize::from(link.0));
            gone.into_iter().for_each(|gone| *gone = Link::gone(link));
        }
        self.reloads.done(Done::Left(units));
    }

    /// Adds a bus, at the place of one that has gone or behind the others; its interface and what measures it.
    fn open_link(&mut self, now: Instant, new: NewLink) -> Option<(String, Arc<Gauge>)> {
        let NewLink { id, bus, is_timed, clients } = new;
        let mut link = build::link(&bus, id, is_timed, now);
        link.set_clients(clients);
        let gauge = link.gauge();
        let position = usize::from(id.0);
        self.core.open_link(id);
        self.audit.iter_mut().for_each(|audit| audit.name_bus(position, &bus.name));
        self.reporter.open_link(position);
        while self.links.len() <= position {
            let next = link_id(self.links.len());
            self.links.push(Link::gone(next));
        }
        if let Some(place) = self.links.get_mut(position) {
            *place = link;
        }
        self.open(now, position);
        gauge
    }

    fn let_join(&mut self, now: Instant, unit: Unit, view: Option<ModbusPlan>) {
        let device = self.core.join(unit);
        if let (Some(audit), Some(name), Some(profile)) =
            (&mut self.audit, self.core.name(device), self.core.profile(device))
        {
            audit.name_device(device, name, profile);
        }
        view.into_iter().for_each(|view| self.core.show_on_modbus(device, view));
        let links: Vec<LinkId> = self.core.nodes_of(device).map(|(link, _)| link).collect();
        for link in links {
            let interface = self.links.get(usize::from(link.0)).map(|link| link.interface.as_ref());
            match interface {
                // It starts when the interface is there.
                None => {}
                Some(Some(interface)) if interface.fd().is_none() => {}
                Some(interface) => {
                    let state = interface.map(SocketCan::state);
                    self.core.start(now, link);
                    state.into_iter().for_each(|state| self.core.set_bus_state(now, link, state));
                }
            }
        }
        self.transmit(now);
    }

    fn adjust(&mut self, Adjustment { device, view, owner }: Adjustment) {
        let Some(device) = self.core.find(&device) else { return };
        match view {
            Some(view) => self.core.show_on_modbus(device, view),
            None => self.core.hide_from_modbus(device),
        }
        owner.into_iter().for_each(|owner| self.core.set_owner(device, owner));
    }
}
