//! What the core loop does beside frames, due steps and Modbus clients: never much of it between two looks at these.

use std::collections::VecDeque;

use od::Instant;

use super::CoreLoop;
use crate::audit::Trail;
use crate::core::Parameters;
use crate::link::Received;
use crate::modbus_tcp::Sockets;
use crate::status;
use crate::storage::Done;

/// Lines for the log that are written at once.
const NOTICES_AT_ONCE: usize = 8;
/// Entries of the audit trail that are handed on at once.
const ENTRIES_AT_ONCE: usize = 64;
/// Devices that a status is collected of at once.
const DEVICES_AT_ONCE: usize = 4;

/// What came of a look for something to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Piece {
    /// There was nothing.
    None,
    /// A piece of it is done, and there may be more.
    Done,
}

/// The devices of a status that is being collected.
#[derive(Debug, Default)]
pub(crate) struct Collecting {
    devices: Vec<status::Device>,
    /// Those that are still to come, by their positions, once it has begun.
    waiting: Option<VecDeque<usize>>,
}

impl CoreLoop {
    /// Does a piece of each chore, and after each of them what has come and fallen due meanwhile; the time after that, and
    /// whether there may be more to do.
    pub(super) fn do_chores(
        &mut self,
        mut now: Instant,
        is_ending: bool,
        news: &mut Vec<Received>,
    ) -> (Instant, bool) {
        type Chore = fn(&mut CoreLoop, Instant) -> Piece;
        let chores: [Option<Chore>; 6] = [
            Some(Self::carry_out_errand),
            Some(Self::serve_storage),
            Some(Self::reload as Chore).filter(|_| !is_ending),
            Some(Self::report),
            Some(Self::keep_audit),
            Some(Self::publish),
        ];
        let mut has_more = false;
        for chore in chores.into_iter().flatten() {
            if chore(self, now) == Piece::Done {
                has_more = true;
                now = self.attend(news);
            }
        }
        (now, has_more)
    }

    /// Hands on all that is to be told of what has happened.
    pub(super) fn tell_all(&mut self, now: Instant) {
        while self.report(now) == Piece::Done {}
        while self.keep_audit(now) == Piece::Done {}
    }

    /// Passes an order to store on, or what became of an earlier one back.
    fn serve_storage(&mut self, now: Instant) -> Piece {
        if let Some((device, parameters)) = self.core.poll_store() {
            self.store(device, parameters);
            return Piece::Done;
        }
        let Some(Done { device, outcome }) = self.storage.poll() else { return Piece::None };
        self.reporter.stored(now, &self.core, device, outcome.as_ref().err());
        let outcome = outcome.map_err(|failure| failure.code());
        self.core.stored(now, device, outcome);
        self.conclude_storing(device, outcome);
        self.transmit(now);
        Piece::Done
    }

    fn store(&mut self, device: usize, parameters: Parameters) {
        if let Some(name) = self.core.name(device) {
            self.storage.submit(device, name, parameters);
        }
    }

    /// Writes to the log what has happened. So few lines that others need not wait for more are no piece of work.
    fn report(&mut self, now: Instant) -> Piece {
        let Self { reporter, core, links, .. } = self;
        if reporter.report(now, core, links, NOTICES_AT_ONCE) { Piece::Done } else { Piece::None }
    }

    /// Hands on what is to be kept of who commanded what. So few entries are no piece of work, either.
    pub(super) fn keep_audit(&mut self, _: Instant) -> Piece {
        let Self { core, audit: Some(audit), .. } = self else { return Piece::None };
        let mut count = 0;
        while let Some(entry) = core.poll_audit() {
            audit.submit(entry);
            count += 1;
            if count == ENTRIES_AT_ONCE {
                return Piece::Done;
            }
        }
        audit.lost_before(core.lost_audit());
        Piece::None
    }

    /// Collects the status for whoever wants it, some devices at a time.
    fn publish(&mut self, now: Instant) -> Piece {
        if self.publisher.as_ref().is_none_or(|publisher| !publisher.is_wanted(now)) {
            return Piece::None;
        }
        let Self { collecting: Collecting { devices, waiting }, core, links, .. } = self;
        let waiting = waiting.get_or_insert_with(|| core.names().map(|(number, _)| number).collect());
        if !waiting.is_empty() {
            let buses: Vec<&str> = links.iter().map(|link| link.name.as_str()).collect();
            let some = waiting.drain(..DEVICES_AT_ONCE.min(waiting.len()));
            devices.extend(some.filter_map(|number| status::device(now, core, number, &buses)));
            return Piece::Done;
        }
        let devices = core::mem::take(&mut self.collecting).devices;
        let status = self.status(now, devices);
        if let Some(publisher) = &mut self.publisher {
            publisher.publish(now, status);
        }
        Piece::Done
    }

    /// All of it, with these devices.
    fn status(&self, now: Instant, devices: Vec<status::Device>) -> status::Status {
        let Self { core, links, reporter, modbus, times, clients, audit, reloads, .. } = self;
        let around = status::Around {
            links,
            reporter,
            listeners: modbus.as_ref().map_or(&[], Sockets::addresses),
            times,
            waiting_clients: clients.len(),
            reload: reloads.last.as_deref(),
            lost_audit: audit.as_ref().map(Trail::lost),
        };
        status::status(now, core, devices, &around)
    }
}

#[cfg(test)]
mod tests {
    use tokio::runtime::Builder;

    use super::*;
    use crate::control::{Errand, board, orders};
    use crate::core::Authority;
    use crate::core_loop::fixture::{TICK, turning, with_devices};
    use od::Address;

    /// Does chores until there are none, and gives how often it looked at what is due meanwhile.
    fn looks(core_loop: &mut CoreLoop) -> u128 {
        let mut now = core_loop.clock.now();
        let begun = now;
        let mut has_more = true;
        while has_more {
            (now, has_more) = core_loop.do_chores(now, false, &mut Vec::new());
        }
        now.saturating_since(begun).as_nanos() / TICK.as_nanos()
    }

    #[test]
    fn a_status_is_collected_some_devices_at_a_time_with_a_look_at_what_is_due_after_each() {
        const DEVICES: u8 = 50;
        let mut core_loop = with_devices(DEVICES);
        assert_eq!(looks(&mut core_loop), 0, "nobody wants anything");
        let (publisher, mut reader) = board(core_loop.alarm.bell());
        core_loop.publisher = Some(publisher);
        let runtime = Builder::new_current_thread().enable_time().build().unwrap();
        let reading = runtime.spawn(async move { reader.read().await });
        runtime.block_on(tokio::task::yield_now());
        let pieces = usize::from(DEVICES).div_ceil(DEVICES_AT_ONCE) + 1;
        assert_eq!(looks(&mut core_loop), pieces as u128);
        let status = runtime.block_on(reading).unwrap().unwrap();
        let names: Vec<String> = status.devices.into_iter().map(|device| device.name).collect();
        assert_eq!(names, (1..=DEVICES).map(|number| format!("axis {number}")).collect::<Vec<_>>());
        let late = core_loop.times.lateness.max_us();
        assert!(u128::from(late) <= TICK.as_micros(), "{late} us");
    }

    #[test]
    fn errands_are_done_one_at_a_time_with_a_look_at_what_is_due_after_each() {
        const ERRANDS: usize = 10;
        let mut core_loop = turning();
        let (inbox, orders) = orders(core_loop.alarm.bell());
        core_loop.inbox = Some(inbox);
        let runtime = Builder::new_current_thread().enable_time().build().unwrap();
        let place = |_| {
            let orders = orders.clone();
            runtime.spawn(async move { orders.place(Errand::Describe, None).await })
        };
        let placed: Vec<_> = (0..ERRANDS).map(place).collect();
        runtime.block_on(tokio::task::yield_now());
        assert_eq!(looks(&mut core_loop), ERRANDS as u128);
        for task in placed {
            assert_eq!(runtime.block_on(task).unwrap().unwrap().unwrap()[0].device, "axis 1");
        }
    }

    #[test]
    fn parameters_are_stored_and_the_log_is_written_a_piece_at_a_time() {
        const DEVICES: u8 = 20;
        let mut core_loop = with_devices(DEVICES);
        let now = core_loop.clock.now();
        core_loop.core.start(now, crate::core::LinkId(0));
        // Each has told that it is PRE-OPERATIONAL.
        assert!(core_loop.core.has_notices());
        assert_eq!(looks(&mut core_loop), u128::from(DEVICES) / NOTICES_AT_ONCE as u128);
        for device in 0..3 {
            let save = (Address::new(0x1010, 1), b"save".to_vec());
            core_loop.core.write(now, device, 0, &[save], Authority::Owner).unwrap();
        }
        // One by one they are handed on, and, as there is no place to store, fail.
        assert_eq!(looks(&mut core_loop), 2 * 3);
        assert!((0..3).all(|device| !core_loop.core.is_storing(device)));
    }
}
