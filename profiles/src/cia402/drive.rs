//! One drive: the state machine and the modes over one axis.

use axis::{Acceleration, DriveFault, DriveState, Motion};

use super::fault::Fault;
use super::modes::{Active, ModeBits};
use super::options::{self, AbortConnection, QuickStopOption, Ramp};
use super::watch::{SpeedWatch, warns};
use super::{Command, Context, Controlword, Mode, SetPoints, State, Statusword, Transition, View};
use crate::{Binding, Dialect};

/// One drive of a device.
#[derive(Debug)]
pub(crate) struct Drive402 {
    dialect: Dialect,
    state: State,
    word: Controlword,
    mode: Active,
    /// The power stage was asked to come on for transition 4.
    is_enabling: bool,
    /// The axis ramps down before this transition.
    leaving: Option<Transition>,
    /// The axis ramps down before it changes its mode.
    is_changing: bool,
    /// The operator stops the drive: no command is obeyed any more.
    is_shutting_down: bool,
    /// A fault reset is under way: the next raster step tells whether the cause is gone.
    is_resetting: bool,
    fault: Option<Fault>,
    speed: SpeedWatch,
    /// A limit switch is actuated.
    is_at_limit: bool,
}

impl Drive402 {
    pub(crate) fn new(dialect: Dialect) -> Self {
        Self {
            dialect,
            state: Transition::Start.target(),
            word: Controlword::empty(),
            mode: Active::None,
            is_enabling: false,
            leaving: None,
            is_changing: false,
            is_shutting_down: false,
            is_resetting: false,
            fault: None,
            speed: SpeedWatch::default(),
            is_at_limit: false,
        }
    }

    pub(crate) fn state(&self) -> State {
        self.state
    }

    pub(crate) fn mode(&self) -> Mode {
        self.mode.mode()
    }

    /// The set-points that the mode takes cycle by cycle.
    pub(crate) fn cyclic(&self) -> SetPoints {
        self.mode.cyclic()
    }

    /// Records that wait to be interpolated to.
    pub(crate) fn waiting_records(&self) -> usize {
        self.mode.waiting_records()
    }

    /// The fault that the drive is in.
    pub(crate) fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Acts on new units: the limits follow them, and nothing moves.
    #[expect(clippy::unused_self, reason = "one of the drive's verbs")]
    pub(crate) fn handle_units(&self, context: &mut Context<'_>) {
        context.apply_limits();
    }

    /// Acts on objects that were written, the controlword aside.
    pub(crate) fn handle_parameters(&mut self, context: &mut Context<'_>) {
        context.apply_limits();
        options::guard_axis(context);
        self.change_mode(context);
        if self.is_operating() {
            self.mode.update(self.word, context);
        }
    }

    /// Acts on the controlword, which was written.
    pub(crate) fn handle_controlword(&mut self, context: &mut Context<'_>) {
        let new = Controlword::from_bits_retain(context.parameters.or(Binding::Controlword, 0) as u16);
        let old = core::mem::replace(&mut self.word, new);
        if self.is_shutting_down {
            return;
        }
        let is_reset = new.contains(Controlword::FAULT_RESET) && !old.contains(Controlword::FAULT_RESET);
        if is_reset && self.state == State::Fault {
            return self.reset_fault(context);
        }
        self.obey(Command::decode(new), context);
        if self.state == State::OperationEnabled {
            self.handle_halt(old, context);
            if !self.is_ramping_down() {
                self.mode.control(old, new, context);
            }
        }
    }

    /// Looks on after a raster step of an axis that somebody else commands: its faults are those of the drive, too.
    pub(crate) fn look_on(&mut self, context: &mut Context<'_>) {
        self.watch_axis(context);
        if let Some(transition) = self.automatic(context) {
            self.perform(transition, context);
        }
    }

    /// Resets a fault because somebody else was told to.
    pub(crate) fn acknowledge(&mut self, context: &mut Context<'_>) {
        if self.state == State::Fault {
            self.reset_fault(context);
        }
    }

    /// Follows the axis after a raster step.
    pub(crate) fn step(&mut self, context: &mut Context<'_>) {
        self.watch(context);
        if let Some(transition) = self.automatic(context) {
            self.perform(transition, context);
        }
        self.change_mode(context);
        if self.state == State::OperationEnabled && !self.is_ramping_down() {
            self.mode.step(self.word, context);
            if self.mode.takes_set_point_back(context) {
                self.word.remove(Controlword::NEW_SET_POINT);
            }
        }
    }

    /// 0x6040 as the drive has it: without a bit that it has taken back.
    pub(crate) fn controlword(&self) -> Controlword {
        self.word
    }

    /// Ramps down, switches off and obeys no more commands.
    pub(crate) fn shut_down(&mut self, context: &mut Context<'_>) {
        self.is_shutting_down = true;
        self.is_enabling = false;
        if self.state == State::OperationEnabled {
            self.leaving = Some(Transition::DisableVoltageEnabled);
            context.axis.stop(context.quick_stop_ramp());
            self.mode.suspend();
        } else if !matches!(self.state, State::QuickStopActive | State::FaultReactionActive) {
            context.power_off();
        }
    }

    /// Ends what still moves after [`Drive402::shut_down`]: no state with power is left.
    pub(crate) fn switch_off(&mut self, context: &mut Context<'_>) {
        match self.state {
            State::OperationEnabled => self.perform(Transition::DisableVoltageEnabled, context),
            State::QuickStopActive => self.perform(Transition::QuickStopDone, context),
            State::FaultReactionActive => self.perform(Transition::FaultReacted, context),
            State::NotReadyToSwitchOn
            | State::SwitchOnDisabled
            | State::ReadyToSwitchOn
            | State::SwitchedOn
            | State::Fault => {}
        }
    }

    /// Reacts to a lost connection, if there is power or about to be.
    pub(crate) fn lose_master(&mut self, reaction: AbortConnection, context: &mut Context<'_>) {
        let has_power = matches!(self.state, State::OperationEnabled | State::QuickStopActive);
        if self.is_shutting_down || !(has_power || self.is_enabling) {
            return;
        }
        match reaction {
            AbortConnection::NoAction => {}
            AbortConnection::Fault => self.raise(Fault::connection_lost(self.dialect), context),
            AbortConnection::DisableVoltage => self.obey(Command::DisableVoltage, context),
            AbortConnection::QuickStop => self.obey(Command::QuickStop, context),
        }
    }

    /// Goes to FAULT REACTION ACTIVE, unless there is a fault already.
    pub(crate) fn raise(&mut self, fault: Fault, context: &mut Context<'_>) {
        if !self.has_failed() {
            self.fault = Some(fault);
            self.perform(Transition::FaultOccurred, context);
        }
    }

    /// Goes to FAULT REACTION ACTIVE with a fault that the motor has found, unless there is one already. The motor
    /// brakes with `ramp`, or coasts.
    pub(crate) fn fail(&mut self, fault: Fault, ramp: Option<Acceleration>, context: &mut Context<'_>) {
        if self.has_failed() {
            return;
        }
        self.fault = Some(fault);
        self.go_to(Transition::FaultOccurred);
        match ramp {
            Some(ramp) if context.axis.status().motion != Motion::Off => context.axis.stop(ramp),
            Some(_) | None => context.axis.cut_power(),
        }
    }

    /// Whether the operator has stopped the drive, so that nobody is obeyed any more.
    pub(crate) fn is_shutting_down(&self) -> bool {
        self.is_shutting_down
    }

    /// Whether the drive is in a fault, or about to be.
    pub(crate) fn has_failed(&self) -> bool {
        matches!(self.state, State::FaultReactionActive | State::Fault)
    }

    /// Whether the drive moves the axis, or brings it to rest.
    pub(crate) fn operates(&self) -> bool {
        matches!(self.state, State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive)
    }

    /// Resets an error of the motor, as the motor itself can; not that of a limit switch.
    pub(crate) fn reset_motor_error(&mut self, context: &mut Context<'_>) {
        if self.state == State::Fault && self.fault != Some(Fault::limit_switch()) && !self.is_shutting_down {
            self.reset_fault(context);
        }
    }

    /// Resets this fault and no other, as JVL's modules can.
    pub(crate) fn reset_only(&mut self, fault: Fault, context: &mut Context<'_>) {
        if self.state == State::Fault && self.fault == Some(fault) && !self.is_shutting_down {
            self.reset_fault(context);
        }
    }

    /// 0x6041.
    pub(crate) fn statusword(&self, view: View<'_>) -> Statusword {
        let status = view.axis.status();
        let mut word = Statusword::of(self.state);
        word.set(Statusword::VOLTAGE, status.voltage.0 > 0.0);
        word.set(Statusword::REMOTE, !self.is_shutting_down);
        word.set(Statusword::WARNING, warns(view));
        if self.state == State::QuickStopActive {
            word.set(Statusword::INTERNAL_LIMIT, status.limited);
            word.set(Statusword::TARGET_REACHED, status.done && view.is_standing());
        }
        if self.state == State::OperationEnabled {
            word.set(Statusword::INTERNAL_LIMIT, status.limited);
            let bits = if self.is_ramping_down() { ModeBits::default() } else { self.mode.bits(view) };
            let ModeBits { is_reached, bit_12, bit_13 } = bits;
            let is_halted = self.word.contains(Controlword::HALT);
            word.set(Statusword::TARGET_REACHED, if is_halted { status.done } else { is_reached });
            word.set(Statusword::MODE_12, bit_12);
            word.set(Statusword::MODE_13, bit_13);
        } else if status.fault == Some(axis::Fault::FollowingError) && self.mode().tells_following_error() {
            word.insert(Statusword::MODE_13);
        }
        word
    }

    fn obey(&mut self, command: Command, context: &mut Context<'_>) {
        if self.is_enabling && command != Command::EnableOperation {
            self.is_enabling = false;
            context.power_off();
        }
        if command == Command::EnableOperation && self.leaving.take().is_some() {
            self.begin(context);
        }
        // Switch on and enable operation in one command take two transitions.
        while let Some(transition) = self.state.on(command) {
            match transition {
                Transition::EnableOperation => {
                    self.is_enabling = true;
                    context.axis.power_on();
                    return;
                }
                Transition::DisableOperation => {
                    let ramp = options::disable_operation_ramp(context.parameters);
                    return self.leave(transition, ramp, context);
                }
                Transition::ShutdownEnabled => {
                    let ramp = options::shutdown_ramp(context.parameters);
                    return self.leave(transition, ramp, context);
                }
                transition => self.perform(transition, context),
            }
        }
    }

    /// Ramps down before a transition, if it has a ramp. A command that is repeated does not begin anew.
    fn leave(&mut self, transition: Transition, ramp: Option<Ramp>, context: &mut Context<'_>) {
        match ramp {
            Some(ramp) if self.leaving.replace(transition).is_none() => {
                context.axis.stop(ramp.rate(context));
                self.mode.suspend();
            }
            Some(_) => {}
            None => self.perform(transition, context),
        }
    }

    /// Looks for faults after a raster step, and whether one that was reset is gone.
    fn watch(&mut self, context: &mut Context<'_>) {
        if self.watch_axis(context) {
            return;
        }
        if self.speed.step(context) {
            self.raise(Fault::over_speed(self.dialect), context);
        } else if self.meets_limit_switch(context) {
            self.raise(Fault::limit_switch(), context);
        }
    }

    /// Looks for a fault of the axis; whether there is one.
    fn watch_axis(&mut self, context: &mut Context<'_>) -> bool {
        let cause = context.axis.status().fault;
        *context.is_referenced &= !cause.is_some_and(loses_reference);
        let fault = cause.map(|fault| Fault::new(fault, self.dialect));
        if core::mem::take(&mut self.is_resetting) {
            match fault {
                // The cause lasts, or another one has come to light.
                Some(_) => self.fault = fault,
                None => self.perform(Transition::FaultReset, context),
            }
        }
        if let Some(fault) = fault {
            self.raise(fault, context);
        }
        fault.is_some()
    }

    /// Whether a limit switch has just been met that is an error: with JVL's modules, unless they look for it.
    fn meets_limit_switch(&mut self, context: &Context<'_>) -> bool {
        let status = context.axis.status();
        let is_at = status.switches.negative_limit || status.switches.positive_limit;
        let was_at = core::mem::replace(&mut self.is_at_limit, is_at);
        let is_error =
            self.dialect == Dialect::Jvl && context.minds_limit_switches && self.mode() != Mode::Homing;
        is_error && is_at && !was_at && status.motion != Motion::Off
    }

    /// Resets the fault. Where the cause may last, the next raster step tells whether it does.
    fn reset_fault(&mut self, context: &mut Context<'_>) {
        if self.is_resetting {
            return;
        }
        let may_last = match context.axis.status().fault {
            Some(
                axis::Fault::Drive(_)
                | axis::Fault::Lost
                | axis::Fault::EmergencyStop
                | axis::Fault::DriveSignal,
            ) => true,
            Some(axis::Fault::FollowingError | axis::Fault::Supervision) | None => false,
        };
        context.axis.reset_fault();
        if may_last {
            self.is_resetting = true;
        } else {
            self.perform(Transition::FaultReset, context);
        }
    }

    /// Reacts to a fault: by the axis itself where it has noticed it, by the ramp of 0x605E otherwise.
    fn react(&self, context: &mut Context<'_>) {
        let status = context.axis.status();
        let brakes_at_limit = self.fault == Some(Fault::limit_switch()) && status.limited;
        let ramp = options::fault_ramp(context.parameters, self.dialect);
        if status.fault.is_some() || (brakes_at_limit && ramp.is_some()) {
            return;
        }
        match ramp {
            Some(ramp) if context.axis.status().motion != Motion::Off => {
                context.axis.stop(ramp.rate(context));
            }
            Some(_) | None => context.axis.cut_power(),
        }
    }

    /// The transition that is due without a command.
    fn automatic(&self, context: &Context<'_>) -> Option<Transition> {
        let status = context.axis.status();
        match self.state {
            State::NotReadyToSwitchOn => {
                (status.drive != DriveState::NotReady).then_some(Transition::Initialised)
            }
            State::SwitchedOn if self.is_enabling && status.drive == DriveState::Enabled => {
                Some(Transition::EnableOperation)
            }
            State::OperationEnabled => self.leaving.filter(|_| status.done),
            State::QuickStopActive => {
                let leaves = self.is_shutting_down || !QuickStopOption::of(context.parameters).stays;
                (status.done && leaves).then_some(Transition::QuickStopDone)
            }
            State::FaultReactionActive => {
                let is_done = status.motion == Motion::Off || (status.fault.is_none() && status.done);
                is_done.then_some(Transition::FaultReacted)
            }
            State::SwitchOnDisabled | State::ReadyToSwitchOn | State::SwitchedOn | State::Fault => None,
        }
    }

    fn go_to(&mut self, transition: Transition) {
        self.state = transition.target();
        self.leaving = None;
        self.is_changing = false;
        self.is_enabling = false;
    }

    fn perform(&mut self, transition: Transition, context: &mut Context<'_>) {
        self.go_to(transition);
        match transition {
            Transition::Start | Transition::Initialised => {}
            Transition::EnableOperation | Transition::Resume => {
                context.take_over();
                self.begin(context);
            }
            Transition::QuickStop => match QuickStopOption::of(context.parameters).ramp {
                Some(ramp) => context.axis.stop(ramp.rate(context)),
                None => self.perform(Transition::QuickStopDone, context),
            },
            Transition::FaultOccurred => self.react(context),
            Transition::FaultReset => self.fault = None,
            Transition::Shutdown
            | Transition::SwitchOn
            | Transition::DisableOperation
            | Transition::ShutdownSwitchedOn
            | Transition::DisableVoltageReady
            | Transition::ShutdownEnabled
            | Transition::DisableVoltageEnabled
            | Transition::DisableVoltageSwitchedOn
            | Transition::QuickStopDone
            | Transition::FaultReacted => context.power_off(),
        }
    }

    fn is_operating(&self) -> bool {
        let is_halted = self.word.contains(Controlword::HALT);
        self.state == State::OperationEnabled && !self.is_ramping_down() && !is_halted
    }

    /// Whether a motion ends that its mode does not lead any more.
    fn is_ramping_down(&self) -> bool {
        self.leaving.is_some() || self.is_changing
    }

    /// Takes over 0x6060. JVL's drives wait until they are disabled, but for the way from a completed homing to profile
    /// position mode (module manual, section 4.3.22); others ramp the old mode's motion down first.
    fn change_mode(&mut self, context: &mut Context<'_>) {
        let requested =
            Mode::from_code(context.parameters.or(Binding::ModesOfOperation, 0)).unwrap_or(self.mode.mode());
        if requested == self.mode.mode() {
            // The change was taken back while the axis ramped down for it.
            if self.is_changing {
                self.begin(context);
            }
        } else if self.state != State::OperationEnabled {
            self.mode = Active::new(requested);
        } else if self.leaving.is_none() && self.may_change_to(requested) {
            if context.axis.status().done && context.axis.status().demand.velocity.0 == 0.0 {
                self.is_changing = false;
                self.mode = Active::new(requested);
                self.mode.begin(self.word, context);
            } else if !self.is_changing {
                self.is_changing = true;
                self.mode.suspend();
                context.axis.stop(context.slow_down_ramp());
            }
        }
    }

    /// Whether the mode may change while the drive operates.
    fn may_change_to(&self, requested: Mode) -> bool {
        match self.dialect {
            Dialect::Cia402 | Dialect::Mac4(_) => true,
            Dialect::Jvl => requested == Mode::ProfilePosition && self.mode.is_homed(),
        }
    }

    /// Starts the mode in OPERATION ENABLED.
    fn begin(&mut self, context: &mut Context<'_>) {
        self.is_changing = false;
        context.axis.stop(context.slow_down_ramp());
        self.mode.begin(self.word, context);
    }

    fn handle_halt(&mut self, old: Controlword, context: &mut Context<'_>) {
        let (was, is) = (old.contains(Controlword::HALT), self.word.contains(Controlword::HALT));
        if is && !was {
            context.axis.stop(options::halt_ramp(context.parameters).rate(context));
            self.mode.halt(context);
        } else if was && !is && !self.is_ramping_down() {
            self.mode.resume(self.word, context);
        }
    }
}

/// Whether an axis with this fault no longer knows where it is.
fn loses_reference(fault: axis::Fault) -> bool {
    matches!(fault, axis::Fault::Lost | axis::Fault::Drive(DriveFault::Encoder))
}
