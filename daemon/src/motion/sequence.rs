//! The steps to a goal.

use core::time::Duration;

use od::{Address, Instant};
use profiles::{Controlword, Mode, State, Statusword};

use super::view::{
    CONTROLWORD, HOMING_METHOD, MODE, PROFILE_ACCELERATION, PROFILE_DECELERATION, PROFILE_VELOCITY,
    TARGET_POSITION, TARGET_VELOCITY, View, part,
};

/// How long the drive may take for a transition, an acknowledgement or a change of mode.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long a drive may take to change its mode while it is enabled. One that has not then does it without power only.
const CHANGE_OF_MODE: Duration = Duration::from_millis(500);
/// How long an axis on its way may show the same position.
const LONGEST_REST: Duration = Duration::from_secs(5);

/// What an axis is to do, in user units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// Go to a position, or by a distance from where it is.
    Move {
        /// 0x607A, or how far.
        position: i64,
        /// Whether it is a distance.
        is_relative: bool,
        /// 0x6081, if not as it is.
        velocity: Option<i64>,
        /// 0x6083 and 0x6084, if not as they are.
        acceleration: Option<i64>,
    },
    /// Run until interrupted or for a time.
    Jog {
        /// 0x60FF.
        velocity: i64,
        /// 0x6083 and 0x6084, if not as they are.
        acceleration: Option<i64>,
        /// For how long; without it, until interrupted.
        time: Option<Duration>,
    },
    /// Find its origin.
    Home {
        /// 0x6098, if not as it is.
        method: Option<i64>,
    },
    /// Stop by the quick stop.
    Stop,
}

/// An object and the number that is to be written to it.
pub type Setting = (Address, i64);

/// Whether a device may do without the object of its axis `axis`: not all drives have a deceleration of their own.
#[must_use]
pub fn is_optional(address: Address, axis: u8) -> bool {
    address == part(PROFILE_DECELERATION, axis)
}

/// What is to be done now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Next {
    /// Look again later.
    Wait,
    /// Write these in this order and look again.
    Write(Vec<Setting>),
    /// The goal is reached: how it ended, in words.
    Done(String),
    /// It is not, for this reason.
    Failed(String),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Parameters are still to be written.
    Begin,
    /// On the way to OPERATION ENABLED; the state that was last acted on, and until when it may last.
    Enabling(Option<State>, Instant),
    /// The new-set-point or homing bit has to be off first.
    Clearing(Instant),
    /// A set-point waits for its acknowledgement.
    Setting(Instant),
    /// The acknowledgement has to end.
    Settling(Instant),
    /// The axis is on its way.
    Running,
    /// A halt or quick stop has to bring it to rest.
    Halting(Instant),
    /// It is all over.
    Over,
}

/// One axis on its way to a goal. See the module's documentation.
#[derive(Debug)]
pub struct Sequence {
    goal: Goal,
    axis: u8,
    phase: Phase,
    /// Absolute target of a move, once it is known.
    target: Option<i64>,
    is_interrupted: bool,
    /// Why it is given up, if it is.
    reason: Option<String>,
    /// When a jog ends.
    end: Option<Instant>,
    /// The last position that was another one, and since when.
    rest: Option<(i64, Instant)>,
    /// The drive to be stopped had no power.
    had_no_power: bool,
    /// And its axis moved nevertheless.
    runs_without_power: bool,
}

impl Sequence {
    /// The way to `goal` of axis number `axis`, from 0.
    #[must_use]
    pub fn new(goal: Goal, axis: u8) -> Self {
        let (phase, target, end, rest) = (Phase::Begin, None, None, None);
        Self {
            goal,
            axis,
            phase,
            target,
            is_interrupted: false,
            reason: None,
            end,
            rest,
            had_no_power: false,
            runs_without_power: false,
        }
    }

    /// Halts the axis as soon as it runs, and ends.
    pub fn interrupt(&mut self) {
        self.is_interrupted = true;
    }

    /// Whether what it writes now brings the axis to rest.
    #[must_use]
    pub fn is_halting(&self) -> bool {
        matches!(self.phase, Phase::Halting(_))
    }

    /// Whether it runs until somebody ends it.
    #[must_use]
    pub fn is_jog(&self) -> bool {
        matches!(self.goal, Goal::Jog { .. })
    }

    /// How far it is to the target, if there is one.
    #[must_use]
    pub fn remaining(&self, view: &View) -> Option<i64> {
        self.target.map(|target| target.saturating_sub(view.position))
    }

    /// What is to be done at `now`, when the axis is as `view` shows it.
    pub fn next(&mut self, now: Instant, view: &View) -> Next {
        let is_ending = matches!(self.phase, Phase::Halting(_) | Phase::Over) || self.goal == Goal::Stop;
        let next = match self.is_interrupted && !is_ending {
            true => self.give_up(now, view, "interrupted"),
            false => self.act(now, view),
        };
        match next {
            // It must not go on for ever after a failure.
            Next::Failed(reason) if !is_ending && view.state() == State::OperationEnabled => {
                self.give_up(now, view, &reason)
            }
            Next::Done(_) | Next::Failed(_) => {
                self.phase = Phase::Over;
                next
            }
            Next::Wait | Next::Write(_) => next,
        }
    }

    fn act(&mut self, now: Instant, view: &View) -> Next {
        let state = view.state();
        match self.phase {
            Phase::Begin => self.begin(now, view),
            Phase::Enabling(acted, deadline) => self.enable(now, view, acted, deadline),
            Phase::Halting(deadline) => self.halt(now, view, deadline),
            Phase::Over => Next::Failed("it is over".to_owned()),
            Phase::Clearing(_) | Phase::Setting(_) | Phase::Settling(_) | Phase::Running
                if state != State::OperationEnabled =>
            {
                Next::Failed(lost(view))
            }
            Phase::Clearing(deadline) if view.has(Statusword::MODE_12) && self.is_move() => {
                wait(now, deadline, "set-point")
            }
            Phase::Clearing(_) => self.start(now),
            Phase::Setting(deadline) if !view.has(Statusword::MODE_12) => wait(now, deadline, "set-point"),
            Phase::Setting(_) => {
                self.phase = Phase::Settling(now + PATIENCE);
                Next::Write(vec![self.control(ENABLE)])
            }
            Phase::Settling(deadline) if view.has(Statusword::MODE_12) => wait(now, deadline, "set-point"),
            Phase::Settling(_) => {
                self.phase = Phase::Running;
                self.run(now, view)
            }
            Phase::Running => self.run(now, view),
        }
    }

    /// Writes parameters; the controlword follows.
    fn begin(&mut self, now: Instant, view: &View) -> Next {
        let state = view.state();
        if self.goal == Goal::Stop {
            return match state {
                State::OperationEnabled => {
                    self.phase = Phase::Halting(now + PATIENCE);
                    Next::Write(vec![self.control(QUICK_STOP)])
                }
                State::QuickStopActive | State::FaultReactionActive => {
                    self.phase = Phase::Halting(now + PATIENCE);
                    Next::Wait
                }
                State::NotReadyToSwitchOn
                | State::SwitchOnDisabled
                | State::ReadyToSwitchOn
                | State::SwitchedOn
                | State::Fault => {
                    self.had_no_power = true;
                    // It may run by the words of its vendor, which stop it then.
                    self.runs_without_power = view.velocity.is_some_and(|velocity| velocity != 0);
                    self.phase = Phase::Halting(now + PATIENCE);
                    Next::Write(vec![self.control(QUICK_STOP)])
                }
            };
        }
        if matches!(state, State::Fault | State::FaultReactionActive) {
            return Next::Failed(lost(view));
        }
        self.phase = Phase::Enabling(None, now + PATIENCE);
        match self.parameters(view) {
            Some(settings) => Next::Write(settings),
            None => Next::Failed("the distance leads out of what a position can be".to_owned()),
        }
    }

    fn parameters(&mut self, view: &View) -> Option<Vec<Setting>> {
        let ramps = |rate: Option<i64>| {
            let both = [PROFILE_ACCELERATION, PROFILE_DECELERATION];
            rate.into_iter().flat_map(move |rate| both.map(|index| (index, rate)))
        };
        let mut settings = Vec::new();
        match self.goal {
            Goal::Move { position, is_relative, velocity, acceleration } => {
                let from = if is_relative { view.commanded() } else { 0 };
                let target = from.checked_add(position)?;
                self.target = Some(target);
                settings.push((MODE, Mode::ProfilePosition as i64));
                settings.extend(velocity.map(|velocity| (PROFILE_VELOCITY, velocity)));
                settings.extend(ramps(acceleration));
                settings.push((TARGET_POSITION, target));
            }
            Goal::Jog { velocity, acceleration, .. } => {
                settings.extend(ramps(acceleration));
                settings.extend([(TARGET_VELOCITY, velocity), (MODE, Mode::ProfileVelocity as i64)]);
            }
            Goal::Home { method } => {
                settings.push((MODE, Mode::Homing as i64));
                settings.extend(method.map(|method| (HOMING_METHOD, method)));
            }
            Goal::Stop => {}
        }
        Some(settings.into_iter().map(|(index, number)| (part(index, self.axis), number)).collect())
    }

    /// The next command on the way to OPERATION ENABLED in the mode that is wanted.
    fn enable(&mut self, now: Instant, view: &View, acted: Option<State>, deadline: Instant) -> Next {
        let state = view.state();
        let command = match state {
            State::OperationEnabled if view.mode == self.mode() as i64 => {
                self.phase = Phase::Clearing(now + PATIENCE);
                // A halt stays until there is a new set-point: what it has stopped must not go on.
                let halt = view.controlword & Controlword::HALT.bits();
                return Next::Write(vec![self.control(ENABLE | halt)]);
            }
            State::OperationEnabled if now + PATIENCE >= deadline + CHANGE_OF_MODE => Some(SWITCH_ON),
            State::OperationEnabled | State::NotReadyToSwitchOn => None,
            State::SwitchOnDisabled => Some(SHUTDOWN),
            State::ReadyToSwitchOn => Some(SWITCH_ON),
            State::SwitchedOn => Some(ENABLE),
            State::QuickStopActive => Some(DISABLE),
            State::FaultReactionActive | State::Fault => return Next::Failed(lost(view)),
        };
        if now >= deadline {
            let what = if state == State::OperationEnabled { "change its mode" } else { "switch on" };
            return Next::Failed(format!("the drive does not {what}"));
        }
        match command.filter(|_| acted != Some(state)) {
            Some(command) => {
                self.phase = Phase::Enabling(Some(state), now + PATIENCE);
                Next::Write(vec![self.control(command)])
            }
            None => Next::Wait,
        }
    }

    /// The command that lets the axis go.
    fn start(&mut self, now: Instant) -> Next {
        let word = match self.goal {
            Goal::Move { .. } => {
                self.phase = Phase::Setting(now + PATIENCE);
                ENABLE | (Controlword::NEW_SET_POINT | Controlword::CHANGE_IMMEDIATELY).bits()
            }
            Goal::Home { .. } => {
                self.phase = Phase::Running;
                ENABLE | Controlword::HOMING_START.bits()
            }
            Goal::Jog { time, .. } => {
                self.phase = Phase::Running;
                self.end = time.map(|time| now + time);
                ENABLE
            }
            Goal::Stop => ENABLE,
        };
        Next::Write(vec![self.control(word)])
    }

    fn run(&mut self, now: Instant, view: &View) -> Next {
        let is_reached = view.has(Statusword::TARGET_REACHED);
        let has_rested = self.has_rested(now, view);
        match self.goal {
            Goal::Move { .. } if is_reached => self.arrive(view),
            Goal::Home { .. } if view.has(Statusword::MODE_13) => {
                Next::Failed("the drive tells a homing error".to_owned())
            }
            Goal::Home { .. } if is_reached && view.has(Statusword::MODE_12) => {
                Next::Done("homed".to_owned())
            }
            Goal::Jog { .. } if self.end.is_some_and(|end| end <= now) => self.halt_axis(now),
            Goal::Move { .. } | Goal::Home { .. } | Goal::Jog { .. } if has_rested => {
                let limit = view.has(Statusword::INTERNAL_LIMIT);
                let cause = if limit { "a limit is active" } else { "the target is not reached" };
                Next::Failed(format!("nothing has moved for {} s, {cause}", LONGEST_REST.as_secs()))
            }
            Goal::Move { .. } | Goal::Home { .. } | Goal::Jog { .. } | Goal::Stop => Next::Wait,
        }
    }

    /// The drive says that the target is reached; it also does at a limit before it.
    fn arrive(&self, view: &View) -> Next {
        let missing = self.target.map_or(0, |target| target.saturating_sub(view.commanded()));
        if view.has(Statusword::INTERNAL_LIMIT) && missing.unsigned_abs() > 1 {
            return Next::Failed(format!("a limit is in the way, {missing} before the target"));
        }
        Next::Done("target reached".to_owned())
    }

    /// Whether the position has been the same for too long. A jog at zero may rest.
    fn has_rested(&mut self, now: Instant, view: &View) -> bool {
        if matches!(self.goal, Goal::Jog { velocity: 0, .. }) {
            return false;
        }
        match self.rest {
            Some((position, since)) if position == view.position => now >= since + LONGEST_REST,
            Some(_) | None => {
                self.rest = Some((view.position, now));
                false
            }
        }
    }

    /// Halts an axis that runs, and takes the power from one that does not run yet: it must not begin when nobody looks.
    fn give_up(&mut self, now: Instant, view: &View, reason: &str) -> Next {
        if self.phase == Phase::Begin {
            return Next::Failed(reason.to_owned());
        }
        self.reason = Some(reason.to_owned());
        match view.state() {
            State::OperationEnabled => self.halt_axis(now),
            State::QuickStopActive | State::FaultReactionActive => {
                self.phase = Phase::Halting(now + PATIENCE);
                Next::Wait
            }
            State::NotReadyToSwitchOn
            | State::SwitchOnDisabled
            | State::ReadyToSwitchOn
            | State::SwitchedOn
            | State::Fault => {
                self.phase = Phase::Halting(now + PATIENCE);
                Next::Write(self.at_rest(DISABLE))
            }
        }
    }

    fn halt_axis(&mut self, now: Instant) -> Next {
        self.phase = Phase::Halting(now + PATIENCE);
        Next::Write(self.at_rest(ENABLE | Controlword::HALT.bits()))
    }

    /// A controlword and, after a jog, a target velocity of zero: whoever ends the halt finds an axis at rest.
    fn at_rest(&self, word: u16) -> Vec<Setting> {
        let target = self.is_jog().then(|| (part(TARGET_VELOCITY, self.axis), 0));
        target.into_iter().chain([self.control(word)]).collect()
    }

    fn halt(&mut self, now: Instant, view: &View, deadline: Instant) -> Next {
        let is_at_rest = match view.state() {
            // Bit 10 tells the end of a halt and of a quick stop that holds (IEC 61800-7-201, 0x6041).
            State::OperationEnabled | State::QuickStopActive => view.has(Statusword::TARGET_REACHED),
            State::FaultReactionActive => false,
            State::NotReadyToSwitchOn
            | State::SwitchOnDisabled
            | State::ReadyToSwitchOn
            | State::SwitchedOn
            | State::Fault => !self.runs_without_power || self.has_rested(now, view),
        };
        // A ramp may take long; an axis that still moves is not given up.
        if !is_at_rest && (now < deadline || !self.has_rested(now, view)) {
            return Next::Wait;
        }
        let state = view.state().name();
        match (&self.reason, self.goal) {
            _ if !is_at_rest => Next::Failed(format!("the axis does not come to rest: {state}")),
            // A jog ends in this way.
            (Some(reason), Goal::Move { .. } | Goal::Home { .. }) => {
                Next::Failed(format!("{reason}; {state}"))
            }
            (Some(reason), Goal::Jog { .. }) if !self.is_interrupted => {
                Next::Failed(format!("{reason}; {state}"))
            }
            (None, Goal::Stop) if self.had_no_power && !self.runs_without_power => {
                Next::Done(format!("has no power: {state}"))
            }
            (Some(_) | None, _) => Next::Done(format!("stopped, {state}")),
        }
    }

    fn mode(&self) -> Mode {
        match self.goal {
            Goal::Move { .. } => Mode::ProfilePosition,
            Goal::Jog { .. } => Mode::ProfileVelocity,
            Goal::Home { .. } => Mode::Homing,
            Goal::Stop => Mode::None,
        }
    }

    fn is_move(&self) -> bool {
        matches!(self.goal, Goal::Move { .. })
    }

    fn control(&self, word: u16) -> Setting {
        (part(CONTROLWORD, self.axis), i64::from(word))
    }
}

/// Commands of the controlword (IEC 61800-7-201, 0x6040).
const DISABLE: u16 = 0x0000;
const QUICK_STOP: u16 = 0x0002;
const SHUTDOWN: u16 = 0x0006;
const SWITCH_ON: u16 = 0x0007;
const ENABLE: u16 = 0x000F;

fn wait(now: Instant, deadline: Instant, what: &str) -> Next {
    if now < deadline {
        Next::Wait
    } else {
        Next::Failed(format!("the drive does not acknowledge the {what}"))
    }
}

/// Why an axis does not do what it should.
fn lost(view: &View) -> String {
    match view.state() {
        State::Fault | State::FaultReactionActive => {
            format!("the axis is in {}, error 0x{:04X}", view.state().name(), view.error)
        }
        state => format!("the axis has left OPERATION ENABLED: {}", state.name()),
    }
}
