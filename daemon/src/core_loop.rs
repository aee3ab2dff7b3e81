//! The core thread: it alone owns devices, nodes and links, and nobody else is on the way of a frame.
//!
//! One turn: sleep, take what has come, answer it, then do what is due. With a single CAN interface and nothing
//! due soon it sleeps in the receiving system call itself, so that an answer costs two system calls; without CAN
//! interfaces it sleeps in the one that tells of Modbus clients. All other work is done
//! in pieces ([`modbus`], [`chores`]), and after each the loop looks at frames and what is due.

mod chores;
mod departure;
mod errands;
#[cfg(test)]
mod fixture;
mod modbus;
mod reload;
mod share;
mod times;

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
use crate::storage::Storage;
use crate::sys::{self, BATCH};
use crate::wait::{Woken, wait, wake_punctually};

pub(crate) use chores::Collecting;
use departure::{Departure, Then};
pub(crate) use reload::Reloads;
pub(crate) use share::Share;
pub(crate) use times::Times;

/// Frames that are taken before what is due has its turn again.
const FRAMES_AT_ONCE: usize = 8;
/// How much later than [`LONGEST_BLOCK`] a deadline must be for a sleep in the receiving system call, whose
/// time-out is only as fine as the kernel's tick.
const MARGIN: Duration = Duration::from_millis(50);
/// What the system call that tells of Modbus clients counts time-outs in.
const COARSE: Duration = Duration::from_millis(1);
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
    pub(crate) collecting: Collecting,
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
    /// In the system call that tells of Modbus clients, until this time is over.
    AmongClients(Option<Duration>),
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
        now = self.clock.now();
        self.times.wake(now, false);
        let mut has_backlog = false;
        let mut end = None;
        loop {
            match self.how_to_sleep(now, has_backlog, end.as_ref().map(Departure::until)) {
                Sleep::InReceive => {
                    let outcome = self.receive(0, Patience::Block, &mut news);
                    now = self.after_receive(now, outcome.as_ref().ok().copied().flatten());
                    self.times.wake(now, false);
                    now = self.take(now, 0, outcome, &mut news);
                }
                Sleep::AmongClients(time_out) => {
                    let Self { modbus: Some(modbus), alarm, .. } = &mut self else { continue };
                    modbus.sleep(alarm, time_out)?;
                    now = self.clock.now();
                    self.times.wake(now, false);
                }
                Sleep::Until(time_out) => {
                    let modbus = self.modbus.as_ref().filter(|_| self.rest(now).is_none());
                    let Woken { links, modbus } = wait(&self.links, modbus, &self.alarm, time_out)?;
                    now = self.clock.now();
                    self.times.wake(now, has_backlog);
                    for position in links {
                        let outcome = self.receive(position, Patience::Try, &mut news);
                        now = self.take(now, position, outcome, &mut news);
                    }
                    self.take_from_sockets(modbus);
                }
            }
            let begun = now;
            has_backlog = self.take_from_clients(now);
            self.transmit(now);
            self.note_answers(now);
            self.do_what_is_due(now);
            now = self.serve_modbus(now, &mut news);
            let has_chores;
            (now, has_chores) = self.do_chores(now, end.is_some(), &mut news);
            has_backlog |= has_chores | self.may_serve_modbus(now);
            let is_over = self.stop.load(Ordering::Relaxed) && self.stop_axes(now, &mut end);
            self.manager.feed_watchdog(now);
            self.time_turn(begun);
            if is_over {
                self.tell_all(now);
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

    fn how_to_sleep(&mut self, now: Instant, has_backlog: bool, end: Option<Instant>) -> Sleep {
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
        let time_out = deadline.map(|deadline| {
            let now = self.clock.now();
            self.times.sleep(now);
            deadline.saturating_since(now)
        });
        let mut interfaces = self.links.iter().filter_map(|link| link.interface.as_ref());
        let hears_clients = self.modbus.is_some() && self.rest(now).is_none();
        if hears_clients
            && interfaces.all(|interface| interface.fd().is_none())
            && time_out.is_none_or(|time_out| time_out >= COARSE)
        {
            return Sleep::AmongClients(time_out);
        }
        Sleep::Until(time_out)
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

    /// Hands what an interface has received to the core. What falls due while that goes on has its turn; the time after that.
    fn take(
        &mut self,
        mut now: Instant,
        position: usize,
        outcome: io::Result<Option<Duration>>,
        news: &mut Vec<Received>,
    ) -> Instant {
        for (count, news) in news.drain(..).enumerate() {
            if count > 0 && count.is_multiple_of(FRAMES_AT_ONCE) {
                now = self.clock.now();
                self.times.work(now);
                self.transmit(now);
                self.do_what_is_due(now);
            }
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
        now
    }

    /// Puts frames of clients on their buses. Whether there may be more.
    fn take_from_clients(&mut self, now: Instant) -> bool {
        for _ in 0..FRAMES_AT_ONCE {
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
        }
        while let Some((link, device)) = self.core.poll_changed() {
            self.show_node(link, device);
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
            self.times.late(now, deadline);
            self.core.handle_timeout(now);
            if self.core.poll_time_wanted()
                && let Some(time) = TimeOfDay::from_unix(Clock::wall())
            {
                self.core.produce_time(now, time);
            }
            self.transmit(now);
        }
        self.modbus.iter_mut().for_each(|modbus| modbus.handle_timeout(now));
        // One at a time: the others are due at once again.
        let is_closed = |link: &Link| {
            let interface = link.interface.as_ref().filter(|interface| interface.fd().is_none());
            interface.is_some_and(|interface| is_due(interface.poll_timeout()))
        };
        if let Some(position) = self.links.iter().position(is_closed) {
            self.open(now, position);
            self.transmit(now);
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
