//! One axis of a card: instructions in, orders to the axis, status words out.

mod show;
mod work;

use std::collections::VecDeque;

use axis::{Motion, Order, Position, Setting};
use od::{Dictionary, Schema, Slot};

use super::instruction::Kind;
use super::job::{self, Job};
use super::justify::Justification;
use super::record::Record;
use super::setup::{MOST_WAITING, Setup};
use super::status::UserStatus;
use super::units::Units;
use super::{CardType, Instruction, Mode, errors};
use crate::cia402::AbortConnection;
use crate::vendor::Scope;

/// Bit 15 of the interlocking flag: the host has written a position (section 3.5.2).
const POSITION_IS_NEW: i64 = 1 << 15;

/// One axis of a card.
#[derive(Debug)]
pub(crate) struct Controller {
    record: Record,
    card: CardType,
    axis: u8,
    /// Instructions that were written, a bit for each in the order of the codes.
    written: u128,
    is_initialised: bool,
    is_reversed: bool,
    is_on_fly: bool,
    /// The place of the drive that is called `<ao>`.
    origin: Position,
    mode: Mode,
    /// Chosen for the next E.
    chosen: Option<Mode>,
    /// The mode in which the axis is when all that was executed is done.
    next: Mode,
    work: Work,
    waiting: VecDeque<Job>,
    leaving: Option<Leaving>,
    /// Raster steps that the demand has stood before the power goes.
    settling: u32,
    /// Errors to be acknowledged.
    errors: UserStatus,
    pos_end: bool,
    jus_end: bool,
    /// The fault of the axis that was told last.
    seen: Option<axis::Fault>,
    interrupts: u8,
    vector: u8,
    outcome: Outcome,
}

/// What an axis is at.
#[derive(Clone, Copy, Debug)]
enum Work {
    /// Nothing that ends.
    Idle,
    /// It waits for power.
    Starting(Job),
    /// On the way to a position.
    Moving,
    /// Moving until told otherwise.
    Running,
    /// Being justified.
    Justifying(Justification),
}

/// What comes when the power is off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Leaving {
    /// Mode "disable".
    Off,
    /// The initialisation is taken back, too.
    Deinit,
    /// The basic initialisation.
    Reset,
}

/// What concerns more than this axis.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Outcome {
    /// C: what all axes share is acknowledged, too.
    pub(crate) acknowledges: bool,
    /// MR: all axes are reset.
    pub(crate) resets: bool,
    /// A parameter of all axes was written here.
    pub(crate) shares: bool,
    /// A fault that concerns all axes.
    pub(crate) fault: Option<axis::Fault>,
}

impl Controller {
    pub(crate) fn new(card: CardType, schema: &Schema, axis: u8) -> Self {
        Self {
            record: Record::new(schema, axis),
            card,
            axis,
            written: 0,
            is_initialised: false,
            is_reversed: false,
            is_on_fly: true,
            origin: Position(0.0),
            mode: Mode::Disable,
            chosen: None,
            next: Mode::Disable,
            work: Work::Idle,
            waiting: VecDeque::with_capacity(MOST_WAITING),
            leaving: None,
            settling: 0,
            errors: UserStatus::empty(),
            pos_end: false,
            jus_end: false,
            seen: None,
            interrupts: 0,
            vector: 0,
            outcome: Outcome::default(),
        }
    }

    /// Whether the MAC4 vocabulary has the axis, rather than CiA 402.
    pub(crate) fn has_axis(&self) -> bool {
        self.mode != Mode::Disable || self.leaving.is_some()
    }

    pub(crate) fn record(&self) -> &Record {
        &self.record
    }

    /// What concerns more than this axis, since this was last asked.
    pub(crate) fn take_outcome(&mut self) -> Outcome {
        core::mem::take(&mut self.outcome)
    }

    /// After power-on: the axis knows the levels of its inputs.
    pub(crate) fn start(&mut self, scope: &mut Scope<'_>) {
        self.setup().apply_guard(scope);
    }

    /// Notes that the entry at `slot` was written.
    pub(crate) fn note(&mut self, slot: Slot) {
        if let Some(instruction) = self.record.instruction(slot) {
            self.written |= bit(instruction);
        }
    }

    /// Acts on what was noted: values before commands, and E after what it executes.
    pub(crate) fn act(&mut self, scope: &mut Scope<'_>) {
        let written = core::mem::take(&mut self.written);
        if scope.drive.is_shutting_down() {
            return;
        }
        let mut ordered: Vec<Instruction> =
            Instruction::ALL.iter().copied().filter(|instruction| written & bit(*instruction) != 0).collect();
        ordered.sort_by_key(|instruction| turn(*instruction));
        ordered.into_iter().for_each(|instruction| self.perform(instruction, scope));
    }

    fn perform(&mut self, instruction: Instruction, scope: &mut Scope<'_>) {
        match instruction.kind() {
            Kind::Command => self.command(instruction, scope),
            Kind::ModeChange => self.choose(instruction),
            Kind::System => self.set_system(instruction, scope),
            Kind::Relative(of) => self.add(instruction, of, scope),
            Kind::Live => self.follow(instruction, scope),
            Kind::Parameter => self.settle(instruction, scope),
            Kind::Reading => {}
        }
    }

    fn get(&self, scope: &Scope<'_>, instruction: Instruction) -> i64 {
        self.record.get(scope.dictionary, instruction)
    }

    fn setup(&self) -> Setup<'_> {
        Setup { record: &self.record, card: self.card, axis: self.axis }
    }

    fn command(&mut self, instruction: Instruction, scope: &mut Scope<'_>) {
        match instruction {
            Instruction::INIT => self.initialise(scope),
            Instruction::E => self.execute(scope),
            Instruction::C => self.acknowledge(scope),
            Instruction::DEINIT => self.leave(Leaving::Deinit, scope),
            Instruction::FLYON => self.is_on_fly = true,
            Instruction::FLYOFF => self.is_on_fly = false,
            Instruction::WZP => {
                scope.axis.set_position(Units::position(self.get(scope, Instruction::WZP)));
                let offset = scope.axis.offset() + self.origin;
                let shown = Units::shown_position(offset);
                self.record.show(scope.dictionary, Instruction::UWAO, shown);
            }
            Instruction::MR => self.outcome.resets = true,
            _ => {}
        }
    }

    fn initialise(&mut self, scope: &mut Scope<'_>) {
        if self.has_axis() {
            return self.report(UserStatus::LOGO_F);
        }
        self.origin = self.setup().initialise(scope, self.is_reversed);
        self.setup().apply_guard(scope);
        self.is_initialised = true;
    }

    /// Clears errors, those of the axis and of the CiA 402 drive with them.
    fn acknowledge(&mut self, scope: &mut Scope<'_>) {
        self.errors = UserStatus::empty();
        self.outcome.acknowledges = true;
        self.clear_fault(scope);
    }

    /// Clears the fault of the axis; a cause that lasts is a new one.
    pub(crate) fn clear_fault(&mut self, scope: &mut Scope<'_>) {
        self.seen = None;
        if scope.axis.status().fault.is_some() {
            scope.axis.reset_fault();
        }
        let (drive, mut context) = scope.drive();
        drive.acknowledge(&mut context);
    }

    /// Takes an error that has to be acknowledged.
    pub(crate) fn report(&mut self, error: UserStatus) {
        self.errors |= error;
    }

    fn choose(&mut self, instruction: Instruction) {
        match Mode::of(instruction) {
            Some(mode) if self.is_initialised && mode.may_follow(self.next) => self.chosen = Some(mode),
            Some(_) | None => self.report(UserStatus::LOGO_F),
        }
    }

    /// System parameters that need no new measurement act in the mode "disable" at once.
    fn set_system(&mut self, instruction: Instruction, scope: &mut Scope<'_>) {
        match instruction {
            Instruction::USN => self.is_reversed = false,
            Instruction::USR => self.is_reversed = true,
            _ => {}
        }
        if self.is_initialised && !self.has_axis() {
            scope.axis.configure(Setting::Reversed(self.is_reversed));
            self.setup().apply_guard(scope);
        }
    }

    fn add(&mut self, relative: Instruction, of: Instruction, scope: &mut Scope<'_>) {
        let sum = self.get(scope, of).saturating_add(self.get(scope, relative));
        self.record.show(scope.dictionary, of, sum);
        self.perform(of, scope);
    }

    /// A parameter that others follow (section 4.8.3).
    fn settle(&mut self, instruction: Instruction, scope: &mut Scope<'_>) {
        let highest = self.get(scope, Instruction::WSSF);
        if instruction == Instruction::WSSF && self.get(scope, Instruction::WLV) > highest {
            self.record.show(scope.dictionary, Instruction::WLV, highest);
        }
    }

    fn follow(&mut self, instruction: Instruction, scope: &mut Scope<'_>) {
        let is_running = matches!(self.work, Work::Running);
        match instruction {
            Instruction::WVT if is_running && self.mode == Mode::VelocityTracking => {
                let order = self.tracking(scope);
                scope.axis.order(order);
            }
            Instruction::WAT if is_running && self.mode == Mode::PositionTracking => {
                let order = job::track_position(self.get(scope, Instruction::WAT));
                scope.axis.order(order);
            }
            Instruction::WDA if is_running && self.mode == Mode::Test => {
                let order = self.output(scope);
                scope.axis.order(order);
            }
            Instruction::WWD | Instruction::WIRQ5 => self.outcome.shares = true,
            Instruction::POS | Instruction::FLAG => self.take_word(scope),
            _ => {}
        }
    }

    /// Reads the position that the host has written, if its flag says so.
    fn take_word(&mut self, scope: &mut Scope<'_>) {
        if self.get(scope, Instruction::FLAG) & POSITION_IS_NEW != 0 {
            let word = self.get(scope, Instruction::POS) as u32;
            scope.axis.configure(Setting::Word(word));
            self.record.show(scope.dictionary, Instruction::FLAG, 0);
        }
    }

    /// E: what was chosen, or the present mode once more with other parameters.
    fn execute(&mut self, scope: &mut Scope<'_>) {
        let mode = self.chosen.take().unwrap_or(self.next);
        if !self.is_initialised || self.leaving.is_some() || !mode.may_follow(self.next) {
            return self.report(UserStatus::LOGO_F);
        }
        let job = Job::new(mode, &self.record, scope.dictionary, self.setup().units(scope));
        if !self.is_on_fly && self.is_busy() {
            if self.waiting.len() >= MOST_WAITING {
                return self.report(UserStatus::LOGO_F);
            }
            self.waiting.push_back(job);
        } else {
            self.waiting.clear();
            self.begin(job, scope);
        }
        self.next = mode;
    }

    /// Whether something is under way that others wait for off-fly.
    fn is_busy(&self) -> bool {
        match self.work {
            Work::Starting(job) => job.mode.has_end(),
            Work::Moving | Work::Justifying(_) => true,
            Work::Idle | Work::Running => false,
        }
    }

    /// Stops and switches off, to go on from there.
    fn leave(&mut self, leaving: Leaving, scope: &mut Scope<'_>) {
        self.forget();
        let is_braking = self.leaving.replace(leaving).is_some();
        let was_testing = core::mem::replace(&mut self.mode, leaving.mode()) == Mode::Test;
        let is_moving = scope.axis.status().motion != Motion::Off;
        if was_testing {
            scope.axis.cut_power();
        } else if is_moving && !is_braking && scope.axis.takes_orders() {
            scope.axis.order(Order::Brake);
        } else if !is_moving {
            scope.axis.power_off();
        }
        self.finish_leaving(scope);
    }

    /// Gives up what was under way, chosen or waiting.
    fn forget(&mut self) {
        self.work = Work::Idle;
        self.waiting.clear();
        self.chosen = None;
        self.next = Mode::Disable;
    }

    /// Switches off an axis that leaves, once it stands, and goes on once there is no power.
    fn finish_leaving(&mut self, scope: &mut Scope<'_>) {
        let Some(leaving) = self.leaving else { return };
        let status = scope.axis.status();
        if status.motion != Motion::Off {
            if status.done && status.fault.is_none() && self.has_settled(scope) {
                scope.axis.power_off();
            }
            return;
        }
        self.settling = 0;
        self.leaving = None;
        self.mode = Mode::Disable;
        match leaving {
            Leaving::Off => {}
            Leaving::Deinit => self.is_initialised = false,
            Leaving::Reset => self.start_anew(scope),
        }
    }

    /// Whether the axis itself has come to where its demand stands: within the target radius, or as near as it gets.
    fn has_settled(&mut self, scope: &Scope<'_>) -> bool {
        const LONGEST: u32 = 200;
        self.settling = self.settling.saturating_add(1);
        let radius = Units::position(self.get(scope, Instruction::WTR));
        self.settling > LONGEST || scope.axis.status().following_error.abs() <= radius
    }

    /// The basic initialisation.
    fn start_anew(&mut self, scope: &mut Scope<'_>) {
        self.clear_fault(scope);
        self.record.reset(scope.dictionary);
        *self = Self::new(self.card, scope.dictionary.schema(), self.axis);
        self.outcome.shares = true;
        self.start(scope);
    }

    /// MR, for this axis.
    pub(crate) fn reset(&mut self, scope: &mut Scope<'_>) {
        self.leave(Leaving::Reset, scope);
    }

    /// The operator ends whatever the axis does.
    pub(crate) fn shut_down(&mut self, scope: &mut Scope<'_>) {
        if self.has_axis() {
            self.leave(Leaving::Off, scope);
        }
    }

    /// A lost master is a host that is silent, unless no action is to be taken.
    pub(crate) fn lose_master(&mut self, reaction: AbortConnection, scope: &mut Scope<'_>) {
        if self.has_axis() && reaction != AbortConnection::NoAction {
            scope.axis.raise(axis::Fault::Supervision);
        }
    }

    /// A stop bit was set: the mode "brake" at once, and what waits is forgotten (section 3.5.1).
    pub(crate) fn stop(&mut self, scope: &mut Scope<'_>) {
        if self.leaving.is_some() || self.mode == Mode::Disable {
            return;
        }
        if self.mode == Mode::Test {
            return self.leave(Leaving::Off, scope);
        }
        self.forget();
        self.mode = Mode::Brake;
        self.next = Mode::Brake;
        scope.axis.order(Order::Brake);
    }

    /// What the drive is to follow in the mode "velocity tracking".
    fn tracking(&self, scope: &Scope<'_>) -> Order {
        let turbo = scope.axis.signals().turbo;
        job::track_velocity(self.get(scope, Instruction::WVT), self.setup().units(scope), turbo)
    }

    /// What the mode "test" puts out.
    fn output(&self, scope: &Scope<'_>) -> Order {
        let turbo = scope.axis.signals().turbo;
        Order::Output(self.setup().units(scope).share(self.get(scope, Instruction::WDA), turbo))
    }

    /// Takes a fault of the axis for its own: what was under way ends, and the axis goes off as the fault has it.
    fn fail(&mut self, fault: axis::Fault, scope: &Scope<'_>) {
        self.errors |= errors::user_bits(fault);
        self.outcome.fault = Some(fault).filter(|fault| errors::user_bits(*fault).is_empty());
        self.forget();
        if self.has_axis() && self.leaving.is_none() {
            self.leaving = Some(Leaving::Off);
            self.mode = Leaving::Off.mode();
        }
        let number = match fault {
            axis::Fault::EmergencyStop => Instruction::WIRQ5,
            axis::Fault::DriveSignal | axis::Fault::Drive(_) | axis::Fault::Lost => Instruction::WIRQ3,
            axis::Fault::FollowingError | axis::Fault::Supervision => return,
        };
        self.interrupt(number, scope.dictionary);
    }

    /// Generates an interrupt, unless its vector is zero (section 4.6).
    pub(crate) fn interrupt(&mut self, number: Instruction, dictionary: &Dictionary) {
        if let Ok(vector @ 1..) = u8::try_from(self.record.get(dictionary, number)) {
            self.vector = vector;
            self.interrupts = self.interrupts.wrapping_add(1);
        }
    }
}

impl Leaving {
    /// The mode that is shown meanwhile.
    fn mode(self) -> Mode {
        match self {
            Self::Off | Self::Deinit => Mode::Brake,
            Self::Reset => Mode::Reset,
        }
    }
}

fn bit(instruction: Instruction) -> u128 {
    Instruction::ALL.binary_search(&instruction).map_or(0, |position| 1 << position)
}

/// When an instruction has its turn among those that were written at once.
fn turn(instruction: Instruction) -> u8 {
    match (instruction, instruction.kind()) {
        (Instruction::C, _) => 0,
        (Instruction::DEINIT, _) => 3,
        (Instruction::INIT, _) => 4,
        (Instruction::E, _) => 7,
        (Instruction::MR, _) => 8,
        (_, Kind::System | Kind::Parameter | Kind::Live | Kind::Relative(_) | Kind::Reading) => 1,
        (_, Kind::Command) => 5,
        (_, Kind::ModeChange) => 6,
    }
}
