//! The turn of Modbus clients, and what it costs the others.

use od::Instant;

use super::CoreLoop;
use crate::clock::Clock;
use crate::latency::Histogram;
use crate::link::{Patience, Received};
use crate::modbus_tcp::Sockets;

/// What the loop measures of itself.
#[derive(Debug, Default)]
pub(crate) struct Times {
    /// From the arrival of CAN frames to their answers. Measured where there are Modbus clients to compete with.
    pub(super) answers: Histogram,
    /// How late what was due was done.
    pub(super) lateness: Histogram,
    /// How long it works from one sleep to the next, if somebody wants to know.
    pub(super) turns: Option<Histogram>,
    /// When the loop last looked for frames, or woke up.
    looked: Instant,
    /// When the first frame came that was taken and not answered yet.
    waiting: Option<Instant>,
}

impl Times {
    /// The same with the time of each turn, which costs one more look at the clock.
    pub(crate) fn with_turns(self) -> Self {
        Self { turns: Some(Histogram::default()), ..self }
    }

    /// The loop looks for frames, after a sleep or, `in_between`, amid other work.
    pub(super) fn wake(&mut self, now: Instant, in_between: bool) {
        if !in_between {
            self.looked = now;
        }
    }

    /// A frame was taken that came at this time.
    pub(super) fn arrived(&mut self, at: Instant) {
        self.waiting = Some(self.waiting.map_or(at, |first| first.min(at)));
    }

    /// A frame was taken that came at a time nobody knows: since the last look, at worst.
    pub(super) fn arrived_unseen(&mut self) {
        self.arrived(self.looked);
    }
}

impl CoreLoop {
    /// Takes note of what is ready at the Modbus sockets, if any `is_ready`.
    pub(super) fn take_from_sockets(&mut self, now: Instant, is_ready: bool) {
        if let Self { modbus: Some(modbus), core, .. } = self
            && is_ready
        {
            modbus.take_events(now, core);
        }
    }

    /// Whether there is a client that waits and need not wait longer.
    pub(super) fn may_serve_modbus(&self, now: Instant) -> bool {
        self.modbus.as_ref().is_some_and(Sockets::has_ready) && self.rest(now).is_none()
    }

    /// Until when clients have to wait because the loop has worked for too long.
    pub(super) fn rest(&self, now: Instant) -> Option<Instant> {
        self.share.as_ref()?.rest(now)
    }

    fn look_at_share(&mut self, now: Instant) {
        if let Some(share) = self.share.as_mut().filter(|share| share.is_due(now)) {
            share.look(now, Clock::of_thread());
        }
    }

    /// Serves one request of each Modbus client that is ready; the time after the last. CAN and what is due have their
    /// turn after each.
    pub(super) fn serve_modbus(&mut self, mut now: Instant, news: &mut Vec<Received>) -> Instant {
        for _ in 0..self.modbus.as_ref().map_or(0, Sockets::ready) {
            self.look_at_share(now);
            if self.rest(now).is_some() {
                return now;
            }
            let Self { modbus: Some(modbus), core, .. } = self else { return now };
            modbus.serve_next(now, core);
            now = self.attend(news);
        }
        now
    }

    /// Answers the frames that have come meanwhile, and does what is due.
    fn attend(&mut self, news: &mut Vec<Received>) -> Instant {
        let now = self.clock.now();
        for position in 0..self.links.len() {
            let outcome = self.receive(position, Patience::Try, news);
            self.take(now, position, outcome, news);
        }
        self.take_from_clients(now);
        self.transmit(now);
        self.note_answers(now);
        self.do_what_is_due(now);
        now
    }

    /// Takes note of how long the frames waited that have just been answered. `looked` is when they were looked for.
    pub(super) fn note_answers(&mut self, looked: Instant) {
        let Self { times, clock, modbus, .. } = self;
        if let Some(arrived) = times.waiting.take().filter(|_| modbus.is_some()) {
            times.answers.record(clock.now().saturating_since(arrived));
        }
        times.looked = looked;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use core::time::Duration;
    use std::io::{Read, Write};
    use std::net::{TcpListener, TcpStream};
    use std::sync::Arc;

    use modbus::{Dialect, WordOrder, tcp_adu};
    use od::Address;
    use profiles::{PlantSetup, Profile};

    use super::*;
    use crate::alarm::Alarm;
    use crate::core::{Authority, Core, ListenerPlan, ModbusPlan, Plan, identification, map};
    use crate::core_loop::{Reloads, Share};
    use crate::modbus_tcp::Listening;
    use crate::reporter::Reporter;
    use crate::service_manager::ServiceManager;
    use crate::socketcand::ToCore;
    use crate::storage::Storage;

    /// What a look at the clock takes here: as long as a request is under way at most, on any machine.
    const TICK: Duration = Duration::from_micros(20);
    /// Raster of the axis.
    const RASTER: Duration = Duration::from_millis(1);
    const CLIENTS: usize = 16;
    const REQUESTS: usize = 40;

    /// A loop on virtual time with an axis that turns and a port for Modbus clients.
    pub(in crate::core_loop) fn turning() -> CoreLoop {
        let profile = Arc::new(Profile::embedded("cia402-servo", None).unwrap().unwrap());
        let (nodes, plant) = (Vec::new(), PlantSetup::default());
        let plan = Plan { name: "axis".into(), profile: Arc::clone(&profile), nodes, plant, serial: None };
        let mut now = Instant::ZERO;
        let mut core = Core::new(0, &[plan], now).unwrap();
        let map = Arc::new(map(&profile, Dialect::Full, WordOrder::LowFirst));
        let identification = identification(&profile, "axis");
        core.show_on_modbus(0, ModbusPlan { unit: Some(1), map, identification, timeout: None });
        core.add_listener(ListenerPlan { max_clients: CLIENTS as u16, ..ListenerPlan::default() });
        let commands: [(u16, &[u8]); 5] = [
            (0x6060, &[3]),
            (0x6040, &[6, 0]),
            (0x6040, &[7, 0]),
            (0x6040, &[15, 0]),
            (0x60FF, &[0, 9, 0, 0]),
        ];
        for (index, value) in commands {
            (0..100).for_each(|_| {
                now = now + RASTER;
                core.handle_timeout(now);
            });
            core.write(now, 0, 0, &[(Address::new(index, 0), value.to_vec())], Authority::Owner).unwrap();
        }
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let listeners = vec![(listener.local_addr().unwrap(), listener)];
        let listening = Listening { listeners, allow: Vec::new(), read_only: Vec::new() };
        let clock = Clock::ticking(TICK);
        while clock.now() < now {}
        let alarm = Alarm::new().unwrap();
        CoreLoop {
            core,
            links: Vec::new(),
            clients: ToCore::new(alarm.bell()).1,
            modbus: Some(Sockets::new(vec![listening]).unwrap()),
            clock,
            alarm,
            stop: Arc::default(),
            reporter: Reporter::new(0),
            manager: ServiceManager::from_environment(now),
            storage: Storage::default(),
            audit: None,
            publisher: None,
            inbox: None,
            storing: Vec::new(),
            attentive_until: Instant::ZERO,
            turns_without_clock: 0,
            times: Times::default(),
            reloads: Reloads::new(None),
            share: None,
        }
    }

    /// Clients that have sent all their requests.
    fn flood(core_loop: &CoreLoop) -> Vec<TcpStream> {
        let address = core_loop.modbus.as_ref().unwrap().addresses()[0][0].clone();
        // Ten of the registers of the application.
        let requests = tcp_adu(1, 1, &[3, 0x10, 0, 0, 10]).repeat(REQUESTS);
        let client = |_| {
            let mut stream = TcpStream::connect(&address).unwrap();
            stream.write_all(&requests).unwrap();
            stream
        };
        (0..CLIENTS).map(client).collect()
    }

    fn answered(core_loop: &CoreLoop) -> u64 {
        core_loop.core.modbus_clients().map(|client| client.counters.requests).sum()
    }

    #[test]
    fn a_flood_of_requests_delays_no_due_step_by_more_than_one_of_them() {
        let mut core_loop = turning();
        let mut clients = flood(&core_loop);
        let mut now = core_loop.clock.now();
        let begun = now;
        while answered(&core_loop) < (CLIENTS * REQUESTS) as u64 {
            core_loop.take_from_sockets(now, true);
            now = core_loop.serve_modbus(now, &mut Vec::new());
        }
        let lateness = &core_loop.times.lateness;
        let steps = now.saturating_since(begun).as_nanos() / RASTER.as_nanos();
        assert!(steps > 10 && u128::from(lateness.count()) + 1 >= steps, "{} of {steps}", lateness.count());
        assert!(lateness.max_us() <= TICK.as_micros() as u64, "{} us", lateness.max_us());
        for client in &mut clients {
            client.read_exact(&mut [0; 29 * REQUESTS]).unwrap();
        }
    }

    #[test]
    fn while_the_loop_rests_clients_wait_and_steps_do_not() {
        let mut core_loop = turning();
        let clients = flood(&core_loop);
        while answered(&core_loop) < clients.len() as u64 {
            let now = core_loop.clock.now();
            core_loop.take_from_sockets(now, true);
            core_loop.serve_modbus(now, &mut Vec::new());
        }
        let (served, steps) = (answered(&core_loop), core_loop.times.lateness.count());
        let mut end = Instant::ZERO;
        // Several rests on end, in which a step is due.
        while core_loop.times.lateness.count() == steps {
            let now = core_loop.clock.now();
            let mut share = Share::new(now, Duration::ZERO);
            share.look(now, Duration::from_secs(1));
            core_loop.share = Some(share);
            end = core_loop.rest(now).unwrap();
            let mut now = core_loop.attend(&mut Vec::new());
            while core_loop.rest(now).is_some() {
                core_loop.serve_modbus(now, &mut Vec::new());
                assert!(!core_loop.may_serve_modbus(now));
                now = core_loop.attend(&mut Vec::new());
            }
        }
        assert_eq!(answered(&core_loop), served);
        assert!(core_loop.may_serve_modbus(end));
        core_loop.serve_modbus(end, &mut Vec::new());
        assert!(answered(&core_loop) > served);
    }
}
