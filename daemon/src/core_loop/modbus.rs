//! The turn of Modbus clients, and what it costs the others.

use od::Instant;

use super::CoreLoop;
use crate::clock::Clock;
use crate::link::{Patience, Received};

impl CoreLoop {
    /// Takes note of what is ready at the Modbus sockets, if any `is_ready`.
    pub(super) fn take_from_sockets(&mut self, is_ready: bool) {
        if let Some(modbus) = self.modbus.as_mut().filter(|_| is_ready) {
            modbus.take_events();
        }
    }

    /// Whether there is a client that waits and need not wait longer.
    pub(super) fn may_serve_modbus(&self, now: Instant) -> bool {
        self.modbus_clients_waiting() > 0 && self.rest(now).is_none()
    }

    fn modbus_clients_waiting(&self) -> usize {
        self.modbus.as_ref().map_or(0, |modbus| modbus.ready(&self.core))
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

    /// Serves one request of each Modbus client that is ready, and lets in who wants to be and closes what is over; the time
    /// after that. CAN and what is due have their turn after each piece of it.
    pub(super) fn serve_modbus(&mut self, mut now: Instant, news: &mut Vec<Received>) -> Instant {
        for _ in 0..self.modbus_clients_waiting() {
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
    pub(super) fn attend(&mut self, news: &mut Vec<Received>) -> Instant {
        let mut now = self.clock.now();
        self.times.work(now);
        for position in 0..self.links.len() {
            let outcome = self.receive(position, Patience::Try, news);
            now = self.take(now, position, outcome, news);
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
        if let Some(arrived) = times.answered(looked).filter(|_| modbus.is_some()) {
            times.answers.record(clock.now().saturating_since(arrived));
        }
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;
    use std::io::{Read, Write};
    use std::net::TcpStream;

    use modbus::tcp_adu;

    use super::*;
    use crate::core::Core;
    use crate::core_loop::fixture::{CLIENTS, RASTER, TICK, turning};
    use crate::core_loop::{Share, Sleep};

    const REQUESTS: usize = 40;

    fn connect(core_loop: &CoreLoop) -> TcpStream {
        TcpStream::connect(&core_loop.modbus.as_ref().unwrap().addresses()[0][0]).unwrap()
    }

    /// Clients that have sent all their requests.
    fn flood(core_loop: &CoreLoop) -> Vec<TcpStream> {
        // Ten of the registers of the application.
        let requests = tcp_adu(1, 1, &[3, 0x10, 0, 0, 10]).repeat(REQUESTS);
        let client = |_| {
            let mut stream = connect(core_loop);
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
            core_loop.take_from_sockets(true);
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
    fn clients_who_come_and_go_delay_no_due_step_by_more_than_one_of_them() {
        let mut core_loop = turning();
        let begun = core_loop.clock.now();
        let mut now = begun;
        let mut staying = None;
        // Each has asked for something and left before it is let in, but for the last.
        for _ in 0..300 {
            let mut stream = connect(&core_loop);
            stream.write_all(&tcp_adu(1, 1, &[3, 0x10, 0, 0, 10])).unwrap();
            staying = Some(stream);
            core_loop.take_from_sockets(true);
            now = core_loop.serve_modbus(now, &mut Vec::new());
        }
        let counters = |core_loop: &CoreLoop| core_loop.core.modbus_listeners().next().unwrap();
        while counters(&core_loop).accepted < 300 || counters(&core_loop).clients > 1 {
            core_loop.take_from_sockets(true);
            now = core_loop.serve_modbus(now, &mut Vec::new());
        }
        drop(staying);
        let lateness = &core_loop.times.lateness;
        assert!(lateness.count() > 10 && lateness.max_us() <= TICK.as_micros() as u64, "{lateness:?}");
        // Every one was let in by one piece of work and closed by another, with a look at what is due after each.
        let looks = now.saturating_since(begun).as_nanos() / TICK.as_nanos();
        assert!(looks >= 2 * 300 - 1, "{looks}");
    }

    #[test]
    fn a_burst_of_frames_delays_no_due_step_by_more_than_some_of_them() {
        const FRAMES: usize = 1000;
        let mut core_loop = turning();
        let frame = canopen::Frame::new(canopen::Id::Standard(0x80), &[]);
        let mut burst: Vec<Received> = core::iter::repeat_n(Received::Frame(frame), FRAMES).collect();
        let begun = core_loop.clock.now();
        let end = core_loop.take(begun, 0, Ok(None), &mut burst);
        let looks = end.saturating_since(begun).as_nanos() / TICK.as_nanos();
        assert_eq!(looks as usize, (FRAMES - 1) / super::super::FRAMES_AT_ONCE);
        let lateness = &core_loop.times.lateness;
        assert!(lateness.count() >= 2 && lateness.max_us() <= TICK.as_micros() as u64, "{lateness:?}");
        assert_eq!(core_loop.links[0].received, FRAMES as u64);
    }

    #[test]
    fn a_client_and_the_alarm_end_a_sleep_among_clients() {
        let CoreLoop { core, modbus, alarm, .. } = &mut turning();
        let sockets = modbus.as_mut().unwrap();
        alarm.bell().ring();
        sockets.sleep(alarm, None).unwrap();
        assert_eq!(sockets.ready(core), 0);
        // It rings no more.
        sockets.sleep(alarm, Some(Duration::from_millis(1))).unwrap();
        let _client = TcpStream::connect(&sockets.addresses()[0][0]).unwrap();
        sockets.sleep(alarm, None).unwrap();
        assert_eq!(sockets.ready(core), 1);
        // A ring that comes amid other work is not lost.
        alarm.bell().ring();
        sockets.take_events();
        sockets.sleep(alarm, None).unwrap();
    }

    #[test]
    fn the_loop_sleeps_among_clients_if_it_listens_to_them_and_no_step_is_due_soon() {
        let mut core_loop = turning();
        let sleeps_among_clients = |core_loop: &mut CoreLoop| {
            let now = core_loop.clock.now();
            matches!(core_loop.how_to_sleep(now, false, None), Sleep::AmongClients(_))
        };
        assert!(!sleeps_among_clients(&mut core_loop), "a step is due within a millisecond");
        core_loop.core = Core::new(1, &[], core_loop.clock.now()).unwrap();
        assert!(sleeps_among_clients(&mut core_loop));
        let mut share = Share::new(core_loop.clock.now(), Duration::ZERO);
        share.look(core_loop.clock.now(), Duration::from_secs(1));
        core_loop.share = Some(share);
        assert!(!sleeps_among_clients(&mut core_loop), "they have to wait");
        (core_loop.share, core_loop.modbus) = (None, None);
        assert!(!sleeps_among_clients(&mut core_loop), "there are none");
    }

    #[test]
    fn while_the_loop_rests_clients_wait_and_steps_do_not() {
        let mut core_loop = turning();
        let clients = flood(&core_loop);
        while answered(&core_loop) < clients.len() as u64 {
            let now = core_loop.clock.now();
            core_loop.take_from_sockets(true);
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
