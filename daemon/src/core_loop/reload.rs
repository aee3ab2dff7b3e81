//! Devices and buses that leave and join one by one between two turns, while everything else goes on.

use std::collections::VecDeque;
use std::sync::Arc;

use ::socketcan::CanSocket;
use od::Instant;

use super::chores::Piece;
use super::departure::Then;
use super::{CoreLoop, Departure, link_id};
use crate::build;
use crate::core::{LinkId, ModbusPlan, Unit};
use crate::link::{Gauge, Link, SocketCan};
use crate::reload::{Adjustment, Arrivals, Done, Gone, NewLink, Report, Step, Steps};

/// Where a reload stands.
#[derive(Default)]
pub(crate) enum Stage {
    /// There is none, or it prepares something beside the loop.
    #[default]
    Idle,
    /// Axes ramp down.
    Leaving {
        devices: VecDeque<usize>,
        links: Vec<LinkId>,
        /// They come to rest as at the end of the daemon.
        departure: Departure,
    },
    /// They are out, and go one by one.
    Going { devices: VecDeque<usize>, links: Vec<LinkId>, units: Vec<Unit> },
    /// What is new joins, one each turn.
    Joining(Box<Joining>),
}

/// What is still to join, and what is to be told of it.
#[derive(Default)]
pub(crate) struct Joining {
    arrivals: Arrivals,
    gauges: Vec<(String, Arc<Gauge>)>,
    gone: Gone,
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
            Stage::Leaving { departure, .. } => Some(departure.until()),
            Stage::Idle | Stage::Going { .. } | Stage::Joining(_) => None,
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
    /// Does the next piece of a reload, if there is one that need not wait for anything.
    pub(super) fn reload(&mut self, now: Instant) -> Piece {
        match &self.reloads.stage {
            Stage::Idle => match self.reloads.steps.as_ref().and_then(Steps::poll) {
                None => Piece::None,
                Some(step) => {
                    self.begin(now, step);
                    Piece::Done
                }
            },
            Stage::Leaving { .. } => self.let_leave(now),
            Stage::Going { .. } => self.let_go(now),
            Stage::Joining(_) => {
                self.let_join(now);
                Piece::Done
            }
        }
    }

    fn begin(&mut self, now: Instant, step: Step) {
        match step {
            Step::Leave { devices, links } => {
                let devices: VecDeque<usize> =
                    devices.iter().filter_map(|name| self.core.find(name)).collect();
                let is_quiet = devices.iter().all(|device| self.core.is_at_rest(*device));
                devices.iter().for_each(|device| self.core.shut_down_device(now, *device));
                self.transmit(now);
                self.reloads.stage =
                    Stage::Leaving { devices, links, departure: Departure::begin(now, is_quiet) };
            }
            Step::Join(arrivals) => {
                self.reloads.stage = Stage::Joining(Box::new(Joining {
                    arrivals: *arrivals,
                    gauges: Vec::new(),
                    gone: Gone::default(),
                }));
            }
            Step::Tell(report) => {
                self.audit.iter_mut().for_each(|audit| audit.note_reload(now, &report));
                self.reloads.last = Some(report);
            }
        }
    }

    /// Lets devices go that are at rest or had time enough for it.
    fn let_leave(&mut self, now: Instant) -> Piece {
        let Stage::Leaving { devices, departure, .. } = &mut self.reloads.stage else { return Piece::None };
        match departure.next(now, devices.iter().all(|device| self.core.is_at_rest(*device))) {
            Then::Wait => return Piece::None,
            Then::CutPower => {
                devices.iter().for_each(|device| self.core.cut_power_of_device(now, *device));
                self.transmit(now);
                return Piece::Done;
            }
            Then::Over => {}
        }
        let Stage::Leaving { devices, links, .. } = core::mem::take(&mut self.reloads.stage) else {
            return Piece::None;
        };
        self.reloads.stage = Stage::Going { devices, links, units: Vec::new() };
        Piece::Done
    }

    /// Takes the next device out, and in the end the buses.
    fn let_go(&mut self, now: Instant) -> Piece {
        let Stage::Going { devices, links, units } = &mut self.reloads.stage else { return Piece::None };
        let Some(device) = devices.front().copied() else {
            let (units, links) = (core::mem::take(units), core::mem::take(links));
            let sockets = links.into_iter().filter_map(|link| self.close_link(link)).collect();
            self.reloads.done(Done::Left(units, sockets));
            return Piece::Done;
        };
        // What is being stored is not torn off: its end wakes the loop.
        if self.core.is_storing(device) {
            return Piece::None;
        }
        // What the device has told is told before its number may be another's.
        if self.core.has_notices() {
            return Piece::Done;
        }
        devices.pop_front();
        self.core.conclude_audit(device);
        let unit = self.core.leave(device);
        if let Stage::Going { units, .. } = &mut self.reloads.stage {
            units.extend(unit);
        }
        while self.keep_audit(now) == Piece::Done {}
        self.transmit(now);
        Piece::Done
    }

    /// Makes the place of a bus free; its socket is to be closed elsewhere, which may wait for others in the kernel.
    fn close_link(&mut self, link: LinkId) -> Option<CanSocket> {
        let place = self.links.get_mut(usize::from(link.0))?;
        core::mem::replace(place, Link::gone(link)).interface?.into_socket()
    }

    /// Takes in the next that is new.
    fn let_join(&mut self, now: Instant) {
        let Stage::Joining(mut joining) = core::mem::take(&mut self.reloads.stage) else { return };
        let Joining { arrivals, gauges, gone } = &mut *joining;
        if let Some(link) = arrivals.links.pop_front() {
            gauges.extend(self.open_link(now, link));
        } else if let Some((LinkId(link), clients, has_socketcand)) = arrivals.clients.pop_front() {
            if let Some(known) = self.links.get_mut(usize::from(link)) {
                known.set_clients(clients, has_socketcand);
                self.subscribe(now, usize::from(link));
            }
        } else if !arrivals.adjustments.is_empty() || !arrivals.listeners.is_empty() {
            // All at once: no request finds one device changed and another not.
            let adjustments = core::mem::take(&mut arrivals.adjustments);
            gone.views.extend(adjustments.into_iter().filter_map(|adjustment| self.adjust(adjustment)));
            self.modbus = self.modbus.take().or_else(|| arrivals.sockets.take());
            let listeners = core::mem::take(&mut arrivals.listeners);
            if let Some(modbus) = self.modbus.as_mut().filter(|_| !listeners.is_empty()) {
                gone.listeners = modbus.change(now, &mut self.core, listeners);
            }
        } else if let Some((unit, view)) = arrivals.units.pop_front() {
            self.let_in(now, unit, view);
        } else {
            for (place, LinkId(link)) in arrivals.order.drain(..).enumerate() {
                self.links.get_mut(usize::from(link)).into_iter().for_each(|link| link.place = place);
            }
            self.core.arrange(&arrivals.places);
            for (listener, device) in arrivals.stands_for.drain(..).enumerate() {
                let device = device.and_then(|device| self.core.find(&device));
                self.core.set_listener_device(listener, device);
            }
            let (gauges, gone) = (core::mem::take(gauges), core::mem::take(gone));
            return self.reloads.done(Done::Joined(gauges, gone));
        }
        self.reloads.stage = Stage::Joining(joining);
    }

    /// Adds a bus, at the place of one that has gone or behind the others; its interface and what measures it.
    fn open_link(&mut self, now: Instant, new: NewLink) -> Option<(String, Arc<Gauge>)> {
        let NewLink { id, bus, is_timed, clients } = new;
        let mut link = build::link(&bus, id, is_timed, now);
        link.set_clients(clients, bus.socketcand.is_some());
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

    fn let_in(&mut self, now: Instant, unit: Unit, view: Option<ModbusPlan>) {
        let device = self.core.join(unit);
        if let (Some(audit), Some(name), Some(profile)) =
            (&mut self.audit, self.core.name(device), self.core.profile(device))
        {
            audit.name_device(device, name, profile);
        }
        view.into_iter().for_each(|view| _ = self.core.show_on_modbus(device, view));
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

    /// Makes a change to a device; how Modbus clients saw it until now.
    fn adjust(&mut self, Adjustment { device, view, owner }: Adjustment) -> Option<ModbusPlan> {
        let device = self.core.find(&device)?;
        owner.into_iter().for_each(|owner| self.core.set_owner(device, owner));
        match view {
            Some(view) => self.core.show_on_modbus(device, view),
            None => self.core.hide_from_modbus(device),
        }
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use od::Address;
    use profiles::{AxisStatus, State};

    use super::*;
    use crate::core::{Authority, Notice};
    use crate::core_loop::fixture::turning;

    const MILLISECOND: Duration = Duration::from_millis(1);

    fn axis(core_loop: &CoreLoop) -> Option<AxisStatus> {
        core_loop.core.device(0)?.axes().next()
    }

    /// Lets a loop turn for so many milliseconds from `now` on, one turn each; the time then.
    fn run(core_loop: &mut CoreLoop, mut now: Instant, millis: u32) -> Instant {
        for _ in 0..millis {
            now = now + MILLISECOND;
            core_loop.core.handle_timeout(now);
            while core_loop.reload(now) == Piece::Done && !core_loop.core.has_notices() {}
        }
        now
    }

    /// A loop whose axis turns and brakes with so many user units, at rest after seconds or never, and the time.
    fn braking_with(deceleration: u32) -> (CoreLoop, Instant) {
        let mut core_loop = turning();
        let begun = core_loop.clock.now();
        let now = run(&mut core_loop, begun, 500);
        let ramp = [(Address::new(0x6085, 0), deceleration.to_le_bytes().to_vec())];
        core_loop.core.write(now, 0, 0, &ramp, Authority::Owner).unwrap();
        while core_loop.core.poll_notice().is_some() {}
        core_loop.begin(now, Step::Leave { devices: vec!["axis 1".to_owned()], links: Vec::new() });
        (core_loop, now)
    }

    #[test]
    fn an_axis_that_does_not_come_to_rest_in_its_time_loses_its_power_and_leaves() {
        let (mut core_loop, now) = braking_with(1);
        let before = axis(&core_loop).unwrap();
        let now = run(&mut core_loop, now, 4_999);
        let braking = axis(&core_loop).unwrap();
        assert_eq!(braking.state, State::OperationEnabled);
        assert!(braking.velocity.0 > 0.9 * before.velocity.0, "{braking:?}");
        assert_eq!(core_loop.core.poll_notice(), None);

        let now = run(&mut core_loop, now, 1);

        assert_eq!(axis(&core_loop).unwrap().state, State::SwitchOnDisabled);
        assert_eq!(core_loop.core.poll_notice(), Some((0, Notice::PowerCut)));
        let now = run(&mut core_loop, now, 2);
        let coasting = axis(&core_loop).unwrap();
        assert!(coasting.velocity.0 > 0.9 * braking.velocity.0, "no jump: {coasting:?}");
        // Nobody switches it on again.
        for controlword in [6, 7, 15] {
            let write = [(Address::new(0x6040, 0), vec![controlword, 0])];
            core_loop.core.write(now, 0, 0, &write, Authority::Owner).unwrap();
        }
        let now = run(&mut core_loop, now, 97);
        assert_eq!(axis(&core_loop).unwrap().state, State::SwitchOnDisabled, "masters can see it");
        run(&mut core_loop, now, 1);
        assert!(axis(&core_loop).is_none() && matches!(core_loop.reloads.stage, Stage::Idle));
    }

    #[test]
    fn an_axis_that_comes_to_rest_in_time_keeps_its_power_until_then() {
        let (mut core_loop, mut now) = braking_with(1_000);
        while axis(&core_loop).unwrap().state == State::OperationEnabled {
            now = run(&mut core_loop, now, 1);
        }
        let end = axis(&core_loop).unwrap();
        assert!(end.velocity.0.abs() < 100.0, "it was at rest before: {end:?}");
        run(&mut core_loop, now, 5_000);
        assert!(axis(&core_loop).is_none());
        assert!(core::iter::from_fn(|| core_loop.core.poll_notice()).all(|(_, n)| n != Notice::PowerCut));
    }
}
