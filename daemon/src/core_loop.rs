//! The core thread: it alone owns devices, nodes and links, and nobody else is on the way of a frame.
//!
//! One turn: sleep, take what has come, answer it, then do what is due. With a single CAN interface and nothing
//! due soon it sleeps in the receiving system call itself, so that an answer costs two system calls.

mod departure;
mod errands;
mod modbus;
mod reload;
mod share;

use core::time::Duration;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use canopen::{BusState, TimeOfDay};
use od::Instant;
use sd_notify::NotifyState;
use tokio::sync::mpsc;

use crate::alarm::Alarm;
use crate::audit::Trail;
use crate::clock::Clock;
use crate::control::{Inbox, ObjectTask, Publisher};
use crate::core::{Core, LinkId};
use crate::link::{Kind, LONGEST_BLOCK, Link, Patience, Received, SocketCan};
use crate::modbus_tcp::Sockets;
use crate::reporter::Reporter;
use crate::service_manager::{ServiceManager, Watchdog};
use crate::socketcand::Inbound;
use crate::status;
use crate::storage::{Done, Storage};
use crate::sys::{self, BATCH};
use crate::wait::{Woken, wait, wake_punctually};

use departure::{Departure, Then};
pub(crate) use modbus::Times;
pub(crate) use reload::Reloads;
pub(crate) use share::Share;

/// Frames of clients that are taken before everything else has its turn again.
const CLIENT_BATCH: usize = 64;
/// How much later than [`LONGEST_BLOCK`] a deadline must be for a sleep in the receiving system call, whose
/// time-out is only as fine as the kernel's tick.
const MARGIN: Duration = Duration::from_millis(50);
/// Turns that may take their time from the receiving system call: a turn takes microseconds, and what has a
/// deadline within [`LONGEST_BLOCK`] gets the clock.
const MAX_TURNS_WITHOUT_CLOCK: u32 = 16;

/// What the core thread works with.
pub(crate) struct CoreLoop {
    pub(crate) core: Core,
    pub(crate) links: Vec<Link>,
    /// What socketcand clients send.
    pub(crate) clients: mpsc::Receiver<Inbound>,
    /// Where Modbus clients are, if any may connect.
    pub(crate) modbus: Option<Sockets>,
    pub(crate) clock: Clock,
    pub(crate) alarm: Alarm,
    /// Set when the loop is to end; the alarm rings then.
    pub(crate) stop: Arc<AtomicBool>,
    pub(crate) reporter: Reporter,
    /// Who watches this loop, and nothing else of the process.
    pub(crate) manager: ServiceManager,
    pub(crate) storage: Storage,
    /// Where it is kept who commanded what, if anywhere.
    pub(crate) audit: Option<Trail>,
    /// Where the status goes, if there is a control socket.
    pub(crate) publisher: Option<Publisher>,
    /// Where orders come from, if there is a control socket.
    pub(crate) inbox: Option<Inbox>,
    /// Who waits for parameters of a device to be stored.
    pub(crate) storing: Vec<(usize, ObjectTask)>,
    /// Until when another errand is likely, so that the alarm must be able to wake the loop.
    pub(crate) attentive_until: Instant,
    pub(crate) turns_without_clock: u32,
    pub(crate) times: Times,
    pub(crate) reloads: Reloads,
    /// What Modbus clients may take of the processor, if the thread keeps it from others.
    pub(crate) share: Option<Share>,
}

/// How to sleep.
enum Sleep {
    /// In the receiving system call of the only link.
    InReceive,
    /// Until any link or the alarm wakes us or this time is over.
    Until(Option<Duration>),
}

impl CoreLoop {
    /// Runs until it is stopped and the axes have come to rest. `ready` is called when everything is served that
    /// can be.
    ///
    /// # Errors
    /// The operating system does not let it sleep.
    pub(crate) fn run(mut self, ready: impl FnOnce()) -> io::Result<()> {
        wake_punctually();
        let mut news = Vec::with_capacity(BATCH);
        let mut now = self.clock.now();
        self.start(now);
        ready();
        self.manager.tell(&[NotifyState::Ready]);
        let mut has_backlog = false;
        let mut end = None;
        loop {
            match self.how_to_sleep(now, has_backlog, end.as_ref().map(Departure::until)) {
                Sleep::InReceive => {
                    let outcome = self.receive(0, Patience::Block, &mut news);
                    now = self.after_receive(now, outcome.as_ref().ok().copied().flatten());
                    self.take(now, 0, outcome, &mut news);
                }
                Sleep::Until(time_out) => {
                    let modbus = self.modbus.as_ref().filter(|_| self.rest(now).is_none());
                    let Woken { links, modbus } = wait(&self.links, modbus, &self.alarm, time_out)?;
                    now = self.clock.now();
                    self.times.wake(now, has_backlog);
                    for position in links {
                        let outcome = self.receive(position, Patience::Try, &mut news);
                        self.take(now, position, outcome, &mut news);
                    }
                    self.take_from_sockets(now, modbus);
                }
            }
            has_backlog = self.take_from_clients(now);
            self.transmit(now);
            self.note_answers(now);
            self.do_what_is_due(now);
            now = self.serve_modbus(now, &mut news);
            has_backlog |= self.may_serve_modbus(now);
            has_backlog |= self.carry_out_errands(now);
            self.serve_storage(now);
            has_backlog |= end.is_none() && self.reload(now);
            let is_over = self.stop.load(Ordering::Relaxed) && self.stop_axes(now, &mut end);
            self.reporter.report(now, &mut self.core, &self.links);
            self.keep_audit();
            self.publish(now);
            self.manager.feed_watchdog(now);
            self.time_turn(now);
            if is_over {
                return Ok(());
            }
        }
    }

    /// Leaves others some of the processor if the calling thread, which is to run the loop, has real-time priority.
    pub(crate) fn share_processor(&mut self) {
        let share = Share::new(self.clock.now(), Clock::of_thread());
        self.share = Some(share).filter(|_| sys::has_real_time_priority());
    }

    /// Lets the axes come to rest; whether they have, or had their time.
    fn stop_axes(&mut self, now: Instant, end: &mut Option<Departure>) -> bool {
        let is_quiet = self.core.is_quiet();
        let end = end.get_or_insert_with(|| {
            self.manager.tell(&[NotifyState::Stopping]);
            if !is_quiet {
                self.core.shut_down(now);
                self.transmit(now);
            }
            Departure::begin(now, is_quiet)
        });
        match end.next(now, self.core.is_quiet()) {
            Then::Wait => false,
            Then::CutPower => {
                self.core.cut_power(now);
                self.transmit(now);
                false
            }
            Then::Over => true,
        }
    }

    /// Powers on the nodes of all links that are there.
    fn start(&mut self, now: Instant) {
        for position in 0..self.links.len() {
            match self.links.get(position).map(|link| link.interface.is_some()) {
                Some(true) => self.open(now, position),
                Some(false) => self.core.start(now, link_id(position)),
                None => {}
            }
        }
        self.transmit(now);
    }

    fn how_to_sleep(&self, now: Instant, has_backlog: bool, end: Option<Instant>) -> Sleep {
        if has_backlog || self.stop.load(Ordering::Relaxed) && end.is_none() {
            return Sleep::Until(Some(Duration::ZERO));
        }
        let interfaces = self.links.iter().filter_map(|link| link.interface.as_ref());
        let modbus = self.modbus.as_ref().and_then(Sockets::poll_timeout);
        let reload = self.reloads.deadline().filter(|deadline| *deadline > now);
        let own = [self.core.poll_timeout(), end, modbus, reload, self.rest(now)];
        let deadlines = interfaces.map(SocketCan::poll_timeout).chain(own);
        let deadline = deadlines.flatten().min();
        let watchdog = self.manager.watchdog();
        let is_far = |deadline: Instant| deadline > now + LONGEST_BLOCK + MARGIN;
        let is_far = deadline.is_none_or(is_far) && watchdog.map(Watchdog::latest).is_none_or(is_far);
        let is_alone = match &*self.links {
            [Link { interface: Some(interface), clients: None, .. }] => {
                interface.fd().is_some() && self.modbus.is_none()
            }
            _ => false,
        };
        let is_attentive = now < self.attentive_until || self.links.iter().any(|link| !link.taps.is_empty());
        if is_far && is_alone && !is_attentive && self.storage.is_idle() {
            return Sleep::InReceive;
        }
        let deadline = deadline.into_iter().chain(watchdog.map(Watchdog::due)).min();
        Sleep::Until(deadline.map(|deadline| deadline.saturating_since(self.clock.now())))
    }

    fn receive(
        &mut self,
        position: usize,
        patience: Patience,
        news: &mut Vec<Received>,
    ) -> io::Result<Option<Duration>> {
        let interface = self.links.get_mut(position).and_then(|link| link.interface.as_mut());
        interface.map_or(Ok(None), |interface| interface.receive(patience, news))
    }

    /// The time after a receiving call that began soon after `before` and took `time`. It is behind the clock by
    /// what the last turns took, so the clock is read after a few of them.
    fn after_receive(&mut self, before: Instant, time: Option<Duration>) -> Instant {
        match time {
            Some(time) if self.turns_without_clock < MAX_TURNS_WITHOUT_CLOCK => {
                self.turns_without_clock += 1;
                before + time
            }
            Some(_) | None => {
                self.turns_without_clock = 0;
                self.clock.now()
            }
        }
    }

    /// Hands what an interface has received to the core.
    fn take(
        &mut self,
        now: Instant,
        position: usize,
        outcome: io::Result<Option<Duration>>,
        news: &mut Vec<Received>,
    ) {
        for news in news.drain(..) {
            let Some(link) = self.links.get_mut(position) else { continue };
            match news {
                Received::Frame(frame) => {
                    self.times.arrived_unseen();
                    link.receive(now, &frame);
                    self.core.handle_frame(now, link_id(position), &frame);
                }
                Received::State(state) => {
                    self.reporter.bus_state(now, position, &link.name, state);
                    self.core.set_bus_state(now, link_id(position), state);
                }
            }
        }
        if let Err(error) = outcome {
            self.lose(now, position, &error);
        }
    }

    /// Puts frames of clients on their buses. Whether there may be more.
    fn take_from_clients(&mut self, now: Instant) -> bool {
        for _ in 0..CLIENT_BATCH {
            let Ok(Inbound { link, client, sender, at, frame }) = self.clients.try_recv() else {
                return false;
            };
            self.times.arrived(at);
            if let Some(link) = self.links.get_mut(usize::from(link.0)) {
                link.pass_on(now, client, &frame);
            }
            self.core.handle_frame_of(now, link, sender, &frame);
        }
        true
    }

    /// Sends what the nodes have to say, also about a link that is lost by that.
    fn transmit(&mut self, now: Instant) {
        while self.try_to_transmit(now) {}
    }

    /// Sends what the nodes have to say; whether a link was lost. New subscriptions act first: an answer may be the
    /// cue for more frames.
    fn try_to_transmit(&mut self, now: Instant) -> bool {
        while let Some(link) = self.core.poll_resubscribed() {
            self.subscribe(now, usize::from(link.0));
            self.show_nodes(link);
        }
        let mut is_lost = false;
        while let Some((number, frame)) = self.core.poll_transmit() {
            let position = usize::from(number.0);
            let Some(link) = self.links.get_mut(position) else { continue };
            let is_present = link.is_stuck() && self.core.tells_present(number, &frame);
            link.send(now, &frame, if is_present { Kind::Present } else { Kind::Ours });
            if link.is_full() {
                is_lost |= self.flush(now, position);
            }
        }
        for position in 0..self.links.len() {
            is_lost |= self.flush(now, position);
        }
        is_lost
    }

    /// Hands what waits to the interface of a link; whether that was lost.
    fn flush(&mut self, now: Instant, position: usize) -> bool {
        let interface = self.links.get_mut(position).and_then(|link| link.interface.as_mut());
        let Some(Err(error)) = interface.map(|interface| interface.flush(now)) else { return false };
        self.lose(now, position, &error);
        true
    }

    fn do_what_is_due(&mut self, now: Instant) {
        let is_due = |deadline: Option<Instant>| deadline.is_some_and(|deadline| deadline <= now);
        if let Some(deadline) = self.core.poll_timeout().filter(|deadline| *deadline <= now) {
            self.times.lateness.record(now.saturating_since(deadline));
            self.core.handle_timeout(now);
            if self.core.poll_time_wanted()
                && let Some(time) = TimeOfDay::from_unix(Clock::wall())
            {
                self.core.produce_time(now, time);
            }
            self.transmit(now);
        }
        if let Self { modbus: Some(modbus), core, .. } = self {
            modbus.handle_timeout(now, core);
        }
        for position in 0..self.links.len() {
            let interface = self.links.get(position).and_then(|link| link.interface.as_ref());
            if interface.is_some_and(|interface| interface.fd().is_none() && is_due(interface.poll_timeout()))
            {
                self.open(now, position);
                self.transmit(now);
            }
        }
    }

    /// Passes orders to store on, and what became of earlier ones back.
    fn serve_storage(&mut self, now: Instant) {
        loop {
            while let Some((device, parameters)) = self.core.poll_store() {
                if let Some(name) = self.core.name(device) {
                    self.storage.submit(device, name, parameters);
                }
            }
            let Some(Done { device, outcome }) = self.storage.poll() else { return };
            self.reporter.stored(now, &self.core, device, outcome.as_ref().err());
            let outcome = outcome.map_err(|failure| failure.code());
            self.core.stored(now, device, outcome);
            self.conclude_storing(device, outcome);
            self.transmit(now);
        }
    }

    /// Hands on what is to be kept of who commanded what.
    fn keep_audit(&mut self) {
        let Self { core, audit: Some(audit), .. } = self else { return };
        while let Some(entry) = core.poll_audit() {
            audit.submit(entry);
        }
        audit.lost_before(core.lost_audit());
    }

    /// Gives the status to whoever wants it.
    fn publish(&mut self, now: Instant) {
        let Self { publisher, core, links, reporter, modbus, times, clients, audit, reloads, .. } = self;
        if let Some(publisher) = publisher.as_mut().filter(|publisher| publisher.is_wanted(now)) {
            let around = status::Around {
                links,
                reporter,
                listeners: modbus.as_ref().map_or(&[], Sockets::addresses),
                answers: &times.answers,
                lateness: &times.lateness,
                turns: times.turns.as_ref(),
                waiting_clients: clients.len(),
                reload: reloads.last.as_deref(),
                lost_audit: audit.as_ref().map(Trail::lost),
            };
            publisher.publish(now, status::status(now, core, &around));
        }
    }

    /// Takes the time of a turn that began at `now`, if somebody wants to know.
    fn time_turn(&mut self, now: Instant) {
        if let Some(turns) = &mut self.times.turns {
            turns.record(self.clock.now().saturating_since(now));
        }
    }

    fn open(&mut self, now: Instant, position: usize) {
        let Some(Link { name, interface: Some(interface), .. }) = self.links.get_mut(position) else {
            return;
        };
        let outcome = interface.open(now);
        self.reporter.interface(now, position, name, interface.interface(), outcome.as_ref().err());
        if outcome.is_ok() {
            self.core.start(now, link_id(position));
            self.core.set_bus_state(now, link_id(position), BusState::Active);
            self.subscribe(now, position);
        }
    }

    fn subscribe(&mut self, now: Instant, position: usize) {
        let interface = self.links.get_mut(position).and_then(|link| link.interface.as_mut());
        let subscriptions = self.core.subscriptions(link_id(position));
        if let Some(Err(error)) = interface.map(|interface| interface.subscribe(subscriptions)) {
            self.lose(now, position, &error);
        }
    }

    /// Gives up an interface until it can be opened again. For the nodes on it that is a bus-off.
    fn lose(&mut self, now: Instant, position: usize, error: &io::Error) {
        let Some(Link { name, interface: Some(interface), .. }) = self.links.get_mut(position) else {
            return;
        };
        if interface.fd().is_some() {
            interface.close(now);
            self.reporter.interface(now, position, name, interface.interface(), Some(error));
            self.core.set_bus_state(now, link_id(position), BusState::Off);
        }
    }
}

fn link_id(position: usize) -> LinkId {
    LinkId(position as u16)
}
