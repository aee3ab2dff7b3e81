//! One drive: the state machine and the modes over one axis.

use axis::{Acceleration, Axis, DriveState};

use super::fault::Fault;
use super::position::Positioning;
use super::velocity::Running;
use super::{Command, Controlword, Mode, State, Statusword, Transition, limits, units};
use crate::slots::Parameters;
use crate::{Binding, Dialect, Motor};

/// What a drive works with: its objects and its axis.
pub(crate) struct Context<'a> {
    pub(crate) parameters: Parameters<'a>,
    pub(crate) axis: &'a mut Axis,
    pub(crate) motor: &'a Motor,
}

/// One drive of a device.
#[derive(Debug)]
pub(crate) struct Drive402 {
    dialect: Dialect,
    state: State,
    word: Controlword,
    mode: Mode,
    /// The power stage was asked to come on for transition 4.
    is_enabling: bool,
    /// The axis ramps down before this transition.
    leaving: Option<Transition>,
    /// The operator stops the drive: no command is obeyed any more.
    is_shutting_down: bool,
    positioning: Positioning,
    running: Running,
    fault: Option<Fault>,
}

impl Drive402 {
    pub(crate) fn new(dialect: Dialect) -> Self {
        Self {
            dialect,
            state: Transition::Start.target(),
            word: Controlword::empty(),
            mode: Mode::None,
            is_enabling: false,
            leaving: None,
            is_shutting_down: false,
            positioning: Positioning::default(),
            running: Running::default(),
            fault: None,
        }
    }

    pub(crate) fn state(&self) -> State {
        self.state
    }

    pub(crate) fn mode(&self) -> Mode {
        self.mode
    }

    /// The fault that the drive is in.
    pub(crate) fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Acts on objects that were written, the controlword aside.
    pub(crate) fn handle_parameters(&mut self, context: &mut Context<'_>) {
        limits::apply(context.motor, context.parameters, context.axis);
        self.change_mode(context);
        if self.is_operating() && self.mode == Mode::ProfileVelocity {
            self.running.update(context.parameters, context.axis);
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
            self.perform(Transition::FaultReset, context);
            return;
        }
        self.obey(Command::decode(new), context);
        if self.state == State::OperationEnabled {
            self.handle_halt(old, context);
            if self.mode == Mode::ProfilePosition && self.leaving.is_none() {
                self.positioning.handshake(old, new, context.parameters, context.axis);
            }
        }
    }

    /// Follows the axis after a raster step.
    pub(crate) fn step(&mut self, context: &mut Context<'_>) {
        if context.axis.status().fault.is_some()
            && !matches!(self.state, State::FaultReactionActive | State::Fault)
        {
            self.perform(Transition::FaultOccurred, context);
        }
        if let Some(transition) = self.automatic(context) {
            self.perform(transition, context);
        }
        self.change_mode(context);
        if self.state == State::OperationEnabled {
            match self.mode {
                Mode::None => {}
                Mode::ProfilePosition => self.positioning.step(self.word, context.parameters, context.axis),
                Mode::ProfileVelocity => self.running.step(context.parameters, context.axis),
            }
        }
    }

    /// Ramps down, switches off and obeys no more commands.
    pub(crate) fn shut_down(&mut self, context: &mut Context<'_>) {
        self.is_shutting_down = true;
        self.is_enabling = false;
        if self.state == State::OperationEnabled {
            self.leaving = Some(Transition::DisableVoltageEnabled);
            context.axis.stop(quick_stop_ramp(context.parameters));
        } else if self.state != State::QuickStopActive {
            context.axis.power_off();
        }
    }

    /// Reacts to a lost connection as 0x6007 says (IEC 61800-7-201), if it operates or is about to. A drive without
    /// that object stops, too.
    pub(crate) fn connection_lost(&mut self, context: &mut Context<'_>) {
        if self.is_shutting_down || !(self.state == State::OperationEnabled || self.is_enabling) {
            return;
        }
        match context.parameters.or(Binding::AbortConnectionOption, 3) {
            0 => {}
            1 => {
                self.perform(Transition::FaultOccurred, context);
                self.fault = Some(Fault::connection_lost(self.dialect));
            }
            2 => self.obey(Command::DisableVoltage, context),
            _ => self.obey(Command::QuickStop, context),
        }
    }

    /// 0x6041.
    pub(crate) fn statusword(&self, parameters: Parameters<'_>, axis: &Axis) -> Statusword {
        let mut word = Statusword::of(self.state);
        word.set(Statusword::VOLTAGE, axis.status().voltage.0 > 0.0);
        word.set(Statusword::REMOTE, !self.is_shutting_down);
        if self.state == State::OperationEnabled {
            word.set(Statusword::INTERNAL_LIMIT, axis.status().limited);
            word |= self.mode_bits(parameters, axis);
        }
        word
    }

    fn mode_bits(&self, parameters: Parameters<'_>, axis: &Axis) -> Statusword {
        let is_halted = self.word.contains(Controlword::HALT) && axis.status().done;
        let (is_reached, is_bit_12) = match self.mode {
            Mode::None => (false, false),
            Mode::ProfilePosition => {
                (self.positioning.is_reached(parameters, axis), self.positioning.is_acknowledged())
            }
            Mode::ProfileVelocity => {
                (self.running.is_reached(parameters, axis), is_standing(parameters, axis))
            }
        };
        let mut bits = Statusword::empty();
        let is_halt_asked = self.word.contains(Controlword::HALT);
        bits.set(Statusword::TARGET_REACHED, if is_halt_asked { is_halted } else { is_reached });
        bits.set(Statusword::MODE_12, is_bit_12);
        bits
    }

    fn obey(&mut self, command: Command, context: &mut Context<'_>) {
        if self.is_enabling && command != Command::EnableOperation {
            self.is_enabling = false;
            context.axis.power_off();
        }
        if command == Command::EnableOperation && self.leaving.take().is_some() {
            self.begin_mode(context);
        }
        // Switch on and enable operation in one command take two transitions.
        while let Some(transition) = self.state.on(command) {
            match transition {
                Transition::EnableOperation => {
                    self.is_enabling = true;
                    context.axis.power_on();
                    return;
                }
                Transition::DisableOperation | Transition::ShutdownEnabled
                    if ramps_down(transition, context.parameters) =>
                {
                    self.leaving = Some(transition);
                    context.axis.stop(slow_down_ramp(context.parameters));
                    return;
                }
                transition => self.perform(transition, context),
            }
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
                let leaves = self.is_shutting_down || !stays_stopped(context.parameters);
                (status.done && leaves).then_some(Transition::QuickStopDone)
            }
            State::FaultReactionActive => Some(Transition::FaultReacted),
            State::SwitchOnDisabled | State::ReadyToSwitchOn | State::SwitchedOn | State::Fault => None,
        }
    }

    fn perform(&mut self, transition: Transition, context: &mut Context<'_>) {
        self.state = transition.target();
        self.leaving = None;
        self.is_enabling = false;
        match transition {
            Transition::Start | Transition::Initialised | Transition::FaultReacted => {}
            Transition::EnableOperation | Transition::Resume => self.begin_mode(context),
            Transition::QuickStop => match quick_stop_deceleration(context.parameters) {
                Some(deceleration) => context.axis.stop(deceleration),
                None => self.perform(Transition::QuickStopDone, context),
            },
            Transition::FaultOccurred => {
                context.axis.power_off();
                let fault = context.axis.status().fault.unwrap_or(axis::Fault::Lost);
                self.fault = Some(Fault::new(fault, self.dialect));
            }
            Transition::FaultReset => {
                context.axis.reset_fault();
                self.fault = None;
            }
            Transition::Shutdown
            | Transition::SwitchOn
            | Transition::DisableOperation
            | Transition::ShutdownSwitchedOn
            | Transition::DisableVoltageReady
            | Transition::ShutdownEnabled
            | Transition::DisableVoltageEnabled
            | Transition::DisableVoltageSwitchedOn
            | Transition::QuickStopDone => context.axis.power_off(),
        }
    }

    fn is_operating(&self) -> bool {
        let is_halted = self.word.contains(Controlword::HALT);
        self.state == State::OperationEnabled && self.leaving.is_none() && !is_halted
    }

    /// Takes over 0x6060. JVL's drives wait until they are disabled (module manual, section 4.3.22); others
    /// ramp the old mode's motion down first.
    fn change_mode(&mut self, context: &mut Context<'_>) {
        let requested =
            Mode::from_code(context.parameters.or(Binding::ModesOfOperation, 0)).unwrap_or(self.mode);
        if requested == self.mode {
            return;
        }
        if self.state != State::OperationEnabled {
            self.mode = requested;
        } else if self.dialect == Dialect::Cia402 && self.leaving.is_none() {
            if context.axis.status().done && context.axis.status().demand.velocity.0 == 0.0 {
                self.mode = requested;
                self.begin_mode(context);
            } else {
                context.axis.stop(slow_down_ramp(context.parameters));
            }
        }
    }

    /// Starts the mode in OPERATION ENABLED.
    fn begin_mode(&mut self, context: &mut Context<'_>) {
        self.positioning.restart();
        self.running.restart();
        if self.is_operating() && self.mode == Mode::ProfileVelocity {
            self.running.update(context.parameters, context.axis);
        } else {
            context.axis.stop(slow_down_ramp(context.parameters));
        }
    }

    fn handle_halt(&mut self, old: Controlword, context: &mut Context<'_>) {
        let (was, is) = (old.contains(Controlword::HALT), self.word.contains(Controlword::HALT));
        if is && !was {
            context.axis.stop(halt_ramp(context.parameters));
        } else if was && !is && self.leaving.is_none() {
            match self.mode {
                Mode::None => {}
                Mode::ProfilePosition => self.positioning.resume(context.axis),
                Mode::ProfileVelocity => {
                    self.running.restart();
                    self.running.update(context.parameters, context.axis);
                }
            }
        }
    }
}

/// Whether the actual velocity counts as zero.
fn is_standing(parameters: Parameters<'_>, axis: &Axis) -> bool {
    axis.status().actual.velocity.abs() <= units::to_velocity(parameters.or(Binding::VelocityWindow, 0))
}

/// Whether an option code asks for the slow-down ramp before this transition (0x605B, 0x605C).
fn ramps_down(transition: Transition, parameters: Parameters<'_>) -> bool {
    let (option, assumed) = match transition {
        Transition::DisableOperation => (Binding::DisableOperationOption, 1),
        _ => (Binding::ShutdownOption, 0),
    };
    parameters.or(option, assumed) == 1
}

/// Whether the drive stays in QUICK STOP ACTIVE (0x605A is 5 or more).
fn stays_stopped(parameters: Parameters<'_>) -> bool {
    parameters.or(Binding::QuickStopOption, 2) >= 5
}

/// How hard a quick stop brakes (0x605A); `None` to switch off at once. A zero deceleration is the axis maximum.
fn quick_stop_deceleration(parameters: Parameters<'_>) -> Option<Acceleration> {
    match parameters.or(Binding::QuickStopOption, 2) {
        1 | 5 => Some(slow_down_ramp(parameters)),
        2 | 6 => Some(quick_stop_ramp(parameters)),
        3 | 4 | 7 | 8 => Some(Acceleration(0.0)),
        _ => None,
    }
}

/// How hard a halt brakes (0x605D).
fn halt_ramp(parameters: Parameters<'_>) -> Acceleration {
    match parameters.or(Binding::HaltOption, 1) {
        1 => slow_down_ramp(parameters),
        2 => quick_stop_ramp(parameters),
        _ => Acceleration(0.0),
    }
}

fn slow_down_ramp(parameters: Parameters<'_>) -> Acceleration {
    let acceleration = parameters.or(Binding::ProfileAcceleration, 0);
    units::to_acceleration(parameters.or(Binding::ProfileDeceleration, acceleration))
}

fn quick_stop_ramp(parameters: Parameters<'_>) -> Acceleration {
    units::to_acceleration(parameters.or(Binding::QuickStopDeceleration, 0))
}
