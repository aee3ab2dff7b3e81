//! The boot procedure of one slave (CiA 302-2, "boot NMT slave") and the supervision that follows it.

use core::time::Duration;

use od::{AbortCode, Address, Instant};

use super::assignment::{Assignment, CHECKS};
use super::dcf::{self, decode_dcf};
use super::guard::{Due, Guarding};
use super::{BootStatus, Loss, Outbox};
use crate::cob_id::NMT_ERROR_CONTROL;
use crate::communication::{RESTORE_PARAMETERS, VERIFY_CONFIGURATION};
use crate::{Frame, Id, NmtCommand, NmtState, SdoClient, SdoError, SdoEvent, SdoMode};

/// How long a boot-up message is waited for before the slave is asked all the same, and before one that does not answer
/// is asked again.
const PATIENCE: Duration = Duration::from_secs(1);
/// What 0x1011 wants to be written: "load".
const LOAD: &[u8] = b"load";

/// How far a slave is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Nothing is done with it.
    Idle,
    /// Its boot-up message is waited for.
    BootUp,
    /// The entry with this number among [`CHECKS`] is read.
    Check(usize),
    /// What it does is waited for, as it may not be reset while it is OPERATIONAL.
    NodeState,
    /// This sub-index of 0x1020 is read.
    Verify(u8),
    /// Its defaults are restored.
    Restore,
    /// An entry of its concise DCF is written; the next one begins at this byte.
    Configure(usize),
    /// Its heartbeat is waited for; `is_kept` if it was OPERATIONAL before.
    ErrorControl { is_kept: bool },
    /// The procedure has ended well.
    Booted,
    /// It does not answer.
    Absent,
    /// The procedure has ended with an error.
    Failed,
}

/// What the network is to know of a slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// The procedure has ended well; `is_kept` if the slave was OPERATIONAL before.
    Booted { is_kept: bool },
    /// It has ended with an error.
    Failed { status: BootStatus, transfer: Option<(Address, SdoError)> },
    /// A slave that had booted is lost.
    Lost(Loss),
}

/// One slave.
#[derive(Debug)]
pub(super) struct Slave {
    pub(super) assignment: Assignment,
    client: SdoClient,
    step: Step,
    /// When the step has taken too long.
    deadline: Option<Instant>,
    /// The heartbeat consumer time (0x1016), if any.
    heartbeat: Option<Duration>,
    guarding: Option<Guarding>,
    /// What it has told last.
    state: Option<NmtState>,
    /// It has booted after this procedure began, so it cannot be OPERATIONAL by an older one.
    is_fresh: bool,
    is_restored: bool,
    /// It has not answered, and not been heard of since.
    is_missing: bool,
}

impl Slave {
    pub(super) fn new(assignment: Assignment, heartbeat: Option<Duration>) -> Self {
        Self {
            client: SdoClient::of_node(assignment.node_id),
            assignment,
            step: Step::Idle,
            deadline: None,
            heartbeat,
            guarding: None,
            state: None,
            is_fresh: false,
            is_restored: false,
            is_missing: false,
        }
    }

    /// Whether the procedure has ended well.
    pub(super) fn has_booted(&self) -> bool {
        self.step == Step::Booted
    }

    /// Whether it does not answer.
    pub(super) fn is_missing(&self) -> bool {
        self.is_missing
    }

    /// What it has told last.
    pub(super) fn state(&self) -> Option<NmtState> {
        self.state
    }

    /// The state is not known any more, as nothing would tell if it changed.
    pub(super) fn is_commanded(&mut self) {
        if self.heartbeat.is_none() && self.guarding.is_none() {
            self.state = None;
        }
    }

    /// The identifiers of its answers and of its error control.
    pub(super) fn subscriptions(&self) -> [Id; 2] {
        [self.client.subscription(), self.error_control()]
    }

    fn error_control(&self) -> Id {
        Id::Standard(NMT_ERROR_CONTROL + u16::from(self.assignment.node_id))
    }

    /// Leaves it alone.
    pub(super) fn stop(&mut self) {
        self.client.abort(AbortCode::General);
        // The event says what is known.
        let _ = self.client.poll_event();
        self.step = Step::Idle;
        self.deadline = None;
        self.guarding = None;
    }

    /// Waits for its boot-up message after a reset.
    pub(super) fn await_boot_up(&mut self, now: Instant) {
        self.stop();
        self.state = None;
        self.step = Step::BootUp;
        self.deadline = Some(now + PATIENCE);
    }

    /// Begins the procedure: reads what shows whether the slave is there and who it is.
    pub(super) fn boot(&mut self, now: Instant) {
        self.stop();
        self.check(now, 0);
    }

    /// Takes what its SDO server answers.
    pub(super) fn handle_answer(
        &mut self,
        now: Instant,
        frame: &Frame,
        outbox: &mut Outbox,
    ) -> Option<Outcome> {
        self.client.handle_frame(now, frame);
        self.take_transfer(now, outbox)
    }

    /// Takes a boot-up message, a heartbeat or an answer to guarding.
    pub(super) fn handle_error_control(
        &mut self,
        now: Instant,
        byte: u8,
        outbox: &mut Outbox,
    ) -> Option<Outcome> {
        let heard = match &mut self.guarding {
            Some(guarding) if byte != NmtState::Initialising as u8 => guarding.answer(byte),
            Some(_) | None => NmtState::decode(&[byte]),
        };
        let state = heard?;
        self.is_missing = false;
        if state == NmtState::Initialising {
            return self.take_boot_up(now);
        }
        self.state = Some(state);
        match self.step {
            Step::NodeState => self.take_node_state(now, state, outbox),
            Step::ErrorControl { is_kept } => self.finish(is_kept),
            Step::Absent => {
                self.boot(now);
                None
            }
            Step::Idle
            | Step::BootUp
            | Step::Check(_)
            | Step::Verify(_)
            | Step::Restore
            | Step::Configure(_)
            | Step::Booted
            | Step::Failed => None,
        }
    }

    fn take_boot_up(&mut self, now: Instant) -> Option<Outcome> {
        self.state = Some(NmtState::PreOperational);
        self.is_fresh = true;
        match self.step {
            Step::Booted => return Some(Outcome::Lost(Loss::BootUp)),
            Step::Idle => {}
            Step::BootUp
            | Step::Check(_)
            | Step::NodeState
            | Step::Verify(_)
            | Step::Restore
            | Step::Configure(_)
            | Step::ErrorControl { .. }
            | Step::Absent
            | Step::Failed => self.boot(now),
        }
        None
    }

    /// Does what is due at `now`.
    pub(super) fn handle_timeout(&mut self, now: Instant, outbox: &mut Outbox) -> Option<Outcome> {
        if self.client.poll_timeout().is_some_and(|deadline| deadline <= now) {
            self.client.handle_timeout(now);
            return self.take_transfer(now, outbox);
        }
        match self.guarding.as_mut().map_or(Due::Nothing, |guarding| guarding.poll(now)) {
            Due::Nothing => {}
            Due::Request => outbox.send(Frame::remote(self.error_control(), 1)),
            Due::Lost if self.has_booted() => return Some(Outcome::Lost(Loss::Guarding)),
            Due::Lost => return self.fail(BootStatus::Guarding, None),
        }
        self.deadline.take_if(|deadline| *deadline <= now)?;
        match self.step {
            Step::BootUp | Step::Absent => {
                self.boot(now);
                None
            }
            Step::NodeState => self.fail(BootStatus::Heartbeat, None),
            Step::ErrorControl { .. } => self.fail(BootStatus::HeartbeatStart, None),
            Step::Idle
            | Step::Check(_)
            | Step::Verify(_)
            | Step::Restore
            | Step::Configure(_)
            | Step::Booted
            | Step::Failed => None,
        }
    }

    /// When something is due.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let guarding = self.guarding.as_ref().map(Guarding::poll_timeout);
        [self.client.poll_timeout(), self.deadline, guarding].into_iter().flatten().min()
    }

    /// The next SDO request.
    pub(super) fn poll_transmit(&mut self) -> Option<Frame> {
        self.client.poll_transmit()
    }

    fn take_transfer(&mut self, now: Instant, outbox: &mut Outbox) -> Option<Outcome> {
        match self.client.poll_event()? {
            SdoEvent::Uploaded { data, .. } => self.take_value(now, &data, outbox),
            SdoEvent::Downloaded { .. } => self.take_confirmation(now, outbox),
            SdoEvent::Failed { address, error } => self.take_failure(now, address, error),
        }
    }

    fn take_value(&mut self, now: Instant, data: &[u8], outbox: &mut Outbox) -> Option<Outcome> {
        self.is_missing = false;
        let is = |expected: u32| data == expected.to_le_bytes().as_slice();
        match self.step {
            Step::Check(number) => {
                let expected = self.expected(number);
                if expected != 0 && !is(expected) {
                    return self.fail(status(number), None);
                }
                if self.check(now, number + 1) { None } else { self.take_identity(now, outbox) }
            }
            Step::Verify(sub) => {
                let [date, time] = self.assignment.configured;
                match sub {
                    1 if is(date) => self.verify(now, 2),
                    2 if is(time) => self.control_errors(now, false),
                    _ => self.update(now),
                }
            }
            Step::Idle
            | Step::BootUp
            | Step::NodeState
            | Step::Restore
            | Step::Configure(_)
            | Step::ErrorControl { .. }
            | Step::Booted
            | Step::Absent
            | Step::Failed => None,
        }
    }

    fn take_confirmation(&mut self, now: Instant, outbox: &mut Outbox) -> Option<Outcome> {
        match self.step {
            Step::Restore => {
                self.is_restored = true;
                outbox.command(NmtCommand::ResetNode, self.assignment.node_id);
                self.await_boot_up(now);
                None
            }
            Step::Configure(next) => self.configure(now, next),
            Step::Idle
            | Step::BootUp
            | Step::Check(_)
            | Step::NodeState
            | Step::Verify(_)
            | Step::ErrorControl { .. }
            | Step::Booted
            | Step::Absent
            | Step::Failed => None,
        }
    }

    fn take_failure(&mut self, now: Instant, address: Address, error: SdoError) -> Option<Outcome> {
        let transfer = Some((address, error));
        match self.step {
            Step::Check(0) => self.miss(now, transfer),
            Step::Check(number) => self.fail(status(number), transfer),
            Step::Verify(_) => self.update(now),
            Step::Restore | Step::Configure(_) => self.fail(BootStatus::Configuration, transfer),
            Step::Idle
            | Step::BootUp
            | Step::NodeState
            | Step::ErrorControl { .. }
            | Step::Booted
            | Step::Absent
            | Step::Failed => None,
        }
    }

    fn expected(&self, number: usize) -> u32 {
        self.assignment.expected.get(number).copied().unwrap_or(0)
    }

    /// Reads the next entry to be compared, from `number` on; the device type is read in any case, as it shows whether
    /// the slave is there. Returns whether there is one.
    fn check(&mut self, now: Instant, number: usize) -> bool {
        let mut entries = CHECKS.iter().enumerate().skip(number);
        let Some((next, (address, ..))) = entries.find(|(next, _)| *next == 0 || self.expected(*next) != 0)
        else {
            return false;
        };
        self.step = Step::Check(next);
        self.upload(now, *address);
        true
    }

    /// The slave is the one that was expected.
    fn take_identity(&mut self, now: Instant, outbox: &mut Outbox) -> Option<Outcome> {
        if !self.assignment.is_kept_alive() || self.is_fresh {
            return self.check_program(now);
        }
        self.step = Step::NodeState;
        match (self.heartbeat, self.assignment.guard) {
            (Some(time), _) => self.deadline = Some(now + time),
            (None, Some(times)) => self.guarding = Some(Guarding::new(times, now)),
            // Nothing tells what it does.
            (None, None) => return self.take_node_state(now, NmtState::PreOperational, outbox),
        }
        None
    }

    fn take_node_state(&mut self, now: Instant, state: NmtState, outbox: &mut Outbox) -> Option<Outcome> {
        if state == NmtState::Operational {
            return self.control_errors(now, true);
        }
        outbox.command(NmtCommand::ResetCommunication, self.assignment.node_id);
        self.await_boot_up(now);
        // Even if its boot-up message is lost, it is not reset again.
        self.is_fresh = true;
        None
    }

    fn check_program(&mut self, now: Instant) -> Option<Outcome> {
        if self.assignment.needs_program() {
            return self.fail(BootStatus::ProgramNotConfigured, None);
        }
        if self.assignment.configured == [0; 2] { self.update(now) } else { self.verify(now, 1) }
    }

    fn verify(&mut self, now: Instant, sub: u8) -> Option<Outcome> {
        self.step = Step::Verify(sub);
        self.upload(now, Address::new(VERIFY_CONFIGURATION, sub))
    }

    /// The configuration is not the expected one.
    fn update(&mut self, now: Instant) -> Option<Outcome> {
        if let Some(sub) = self.assignment.restore.filter(|_| !self.is_restored) {
            self.step = Step::Restore;
            return self.download(now, Address::new(RESTORE_PARAMETERS, sub), LOAD.to_vec());
        }
        if self.assignment.dcf().is_empty() && self.assignment.configured != [0; 2] {
            // It should be another one, and there is none.
            return self.fail(BootStatus::Configuration, None);
        }
        if decode_dcf(self.assignment.dcf()).is_err() {
            return self.fail(BootStatus::Configuration, None);
        }
        self.configure(now, dcf::FIRST)
    }

    /// Writes the entry of the concise DCF that begins at this byte, or goes on behind the last one.
    fn configure(&mut self, now: Instant, offset: usize) -> Option<Outcome> {
        let Some((entry, next)) = dcf::entry_at(self.assignment.dcf(), offset) else {
            return self.control_errors(now, false);
        };
        let (address, data) = (entry.address, entry.data.to_vec());
        self.step = Step::Configure(next);
        self.download(now, address, data)
    }

    fn control_errors(&mut self, now: Instant, is_kept: bool) -> Option<Outcome> {
        if let Some(time) = self.heartbeat {
            self.step = Step::ErrorControl { is_kept };
            self.deadline = Some(now + time);
            return None;
        }
        let guard = self.assignment.guard;
        self.guarding = self.guarding.or_else(|| guard.map(|times| Guarding::new(times, now)));
        self.finish(is_kept)
    }

    #[expect(clippy::unnecessary_wraps, reason = "the last step of many")]
    fn finish(&mut self, is_kept: bool) -> Option<Outcome> {
        self.conclude(Step::Booted);
        Some(Outcome::Booted { is_kept })
    }

    #[expect(clippy::unnecessary_wraps, reason = "the last step of many")]
    fn fail(&mut self, status: BootStatus, transfer: Option<(Address, SdoError)>) -> Option<Outcome> {
        self.stop();
        self.conclude(Step::Failed);
        Some(Outcome::Failed { status, transfer })
    }

    /// The procedure is over; the next one is a new one.
    fn conclude(&mut self, step: Step) {
        self.step = step;
        self.deadline = None;
        self.is_fresh = false;
        self.is_restored = false;
    }

    /// It does not answer: a mandatory one is asked again and again.
    fn miss(&mut self, now: Instant, transfer: Option<(Address, SdoError)>) -> Option<Outcome> {
        self.state = None;
        self.is_missing = true;
        self.step = Step::Absent;
        if self.assignment.is_mandatory() {
            self.deadline = Some(now + PATIENCE);
            return None;
        }
        Some(Outcome::Failed { status: BootStatus::NoResponse, transfer })
    }

    /// Begins to read; the procedure goes on with what comes.
    fn upload(&mut self, now: Instant, address: Address) -> Option<Outcome> {
        // The client is free: a transfer begins after the end of the one before, or after `stop`.
        let _ = self.client.upload(now, address, size_of::<u32>(), SdoMode::Ordinary);
        None
    }

    /// Begins to write; the procedure goes on with what comes.
    fn download(&mut self, now: Instant, address: Address, data: Vec<u8>) -> Option<Outcome> {
        // The client is free, as above.
        let _ = self.client.download(now, address, data, SdoMode::Ordinary);
        None
    }
}

/// What a difference in the entry with this number among [`CHECKS`] means.
fn status(number: usize) -> BootStatus {
    CHECKS.get(number).map_or(BootStatus::DeviceType, |(_, _, status)| *status)
}
