//! What JVL's modules show beside the CiA 402 objects (module manual, sections 4.3.5 and 4.3.7).

use std::collections::VecDeque;

use axis::{DriveState, Motion, Status};
use bitflags::bitflags;
use od::Dictionary;

use super::command::Command;
use super::fastmac::FastMac;
use super::inputs;
use super::mirror::{self, Mirror};
use super::motor::MacMotor;
use super::stepper::MisMotor;
use super::traffic::Traffic;

use crate::cia402::units;
use crate::cia402::{AbortConnection, Drive402, View};
use crate::slots::Parameters;
use crate::vendor::{Scope, Wish};
use crate::{Binding, Fault, Motor, MotorKind, RegisterFile, Role, Space, State, Statusword};

/// The module of one axis, and the motor behind it.
#[derive(Debug)]
pub(crate) struct Module {
    /// 0x2010 was written.
    is_commanded: bool,
    /// 0x2013 was written.
    has_fastmac: bool,
    /// What the command register of the module was last.
    command: u32,
    motor: Registers,
    /// A PDO was dropped because too many waited for the motor.
    has_overflowed: bool,
    wishes: VecDeque<Wish>,
    last_error: LastError,
    mirror: Mirror,
    /// O1 and O2, if they are those of the motor.
    outputs: Option<u32>,
    traffic: Traffic,
}

/// The last fatal error of the motor.
#[derive(Clone, Copy, Debug, Default)]
struct LastError {
    /// ERR_STAT when it came.
    status: u32,
    /// It lasts.
    is_present: bool,
}

/// Whose registers are alive.
#[derive(Debug)]
enum Registers {
    /// Nobody's but the two that every motor has.
    Plain,
    Mac(Box<MacMotor>),
    Mis(Box<MisMotor>),
}

/// Calls the verb of the motor, or says what it comes to for one without live registers.
macro_rules! of_motor {
    ($motor:expr, $plain:expr, $alive:ident => $call:expr) => {
        match $motor {
            Registers::Plain => $plain,
            Registers::Mac($alive) => $call,
            Registers::Mis($alive) => $call,
        }
    };
}

impl Module {
    /// A module on this motor, just switched on.
    pub(crate) fn new(motor: &Motor) -> Self {
        let motor = match motor.kind {
            MotorKind::Servo => {
                MacMotor::of(motor).map_or(Registers::Plain, |motor| Registers::Mac(Box::new(motor)))
            }
            MotorKind::Stepper(_) => {
                MisMotor::of(motor).map_or(Registers::Plain, |motor| Registers::Mis(Box::new(motor)))
            }
        };
        Self {
            is_commanded: false,
            has_fastmac: false,
            command: 0,
            motor,
            has_overflowed: false,
            wishes: VecDeque::new(),
            last_error: LastError::default(),
            mirror: Mirror::default(),
            outputs: None,
            traffic: Traffic::default(),
        }
    }

    /// Notes that `binding` was written; whether that is for the module alone.
    pub(crate) fn note(&mut self, binding: Binding) -> bool {
        let is_command = binding == Binding::JvlCommand;
        let is_fastmac = binding == Binding::JvlFastMac;
        self.is_commanded |= is_command;
        self.has_fastmac |= is_fastmac;
        if let Registers::Mis(motor) = &mut self.motor {
            motor.note_object(binding);
        }
        is_command || is_fastmac
    }

    /// Notes that the register with this role was written; whether there is something to do about it now.
    #[inline]
    pub(crate) fn note_register(&mut self, role: Role) -> bool {
        of_motor!(&mut self.motor, true, motor => motor.note(role))
    }

    /// Notes that the queue between module and motor has overflowed, or is empty again.
    pub(crate) fn set_overflow(&mut self, has_overflowed: bool) {
        self.has_overflowed = has_overflowed;
        if has_overflowed {
            self.traffic.drop_one();
        }
    }

    /// Passes so many registers on to the motor.
    pub(crate) fn pass(&mut self, registers: u32, scope: &mut Scope<'_>) {
        self.traffic.pass(registers);
        self.traffic.show_frames(scope);
    }

    /// Whether an input is not yet taken for stable.
    pub(crate) fn is_settling(&self) -> bool {
        self.mirror.is_settling()
    }

    /// The error that stands beside the fault of the drive.
    pub(crate) fn error(&self) -> Option<Fault> {
        self.has_overflowed.then(Fault::queue_overflow)
    }

    /// The fault with the motor's ERR_STAT, if it is an error of the motor.
    pub(crate) fn detailed(&self, fault: Fault) -> Fault {
        if fault == Fault::motor() { fault.with_motor_status(self.last_error.status) } else { fault }
    }

    /// Whether the motor runs the axis by its registers.
    pub(crate) fn runs_axis(&self) -> bool {
        of_motor!(&self.motor, false, motor => motor.runs_axis())
    }

    /// Whether the motor turns the other way round.
    pub(crate) fn turns_back(&self, registers: &RegisterFile, dictionary: &Dictionary) -> bool {
        matches!(self.motor, Registers::Mis(_)) && super::stepper::turns_back(registers, dictionary)
    }

    /// Whether a limit switch that is met is an error for the CiA 402 drive.
    pub(crate) fn minds_limit_switches(&self) -> bool {
        match &self.motor {
            Registers::Plain | Registers::Mac(_) => true,
            Registers::Mis(motor) => motor.minds_limit_switches(),
        }
    }

    /// Acts on registers that were written, then on commands.
    pub(crate) fn act(&mut self, scope: &mut Scope<'_>) {
        of_motor!(&mut self.motor, (), motor => motor.act(scope));
        if core::mem::take(&mut self.is_commanded) {
            self.reset(scope);
        }
        let fastmac = scope.parameters().or(Binding::JvlFastMac, 0) as u8;
        if core::mem::take(&mut self.has_fastmac)
            && let Some(command) = FastMac::from_number(fastmac)
        {
            self.traffic.pass(1);
            of_motor!(&mut self.motor, (), motor => motor.command(command, scope));
        }
        self.obey(scope);
        self.mirror.look(0.0, scope);
    }

    /// Carries out the command of 0x2010.
    fn reset(&mut self, scope: &mut Scope<'_>) {
        let command = scope.parameters().or(Binding::JvlCommand, 0);
        let (drive, mut context) = scope.drive();
        match command {
            RESET_LIMIT_ERROR => drive.reset_only(Fault::limit_switch(), &mut context),
            RESET_COMMUNICATION_ERROR => {
                drive.reset_only(Fault::motor_lost(), &mut context);
                self.has_overflowed = false;
            }
            _ => {}
        }
    }

    /// Carries out the command register, if it has changed.
    fn obey(&mut self, scope: &mut Scope<'_>) {
        let command = scope.register(Role::ModuleCommand).cast_unsigned();
        if core::mem::replace(&mut self.command, command) == command {
            return;
        }
        match Command::of(command) {
            Command::None => {}
            Command::SaveModule => self.store(Space::Module),
            Command::RestoreModule => Wish::Restore(Space::Module).join(&mut self.wishes),
            Command::ResetModule => Wish::ResetModule.join(&mut self.wishes),
            Command::ResetBoth => {
                Wish::Reset.join(&mut self.wishes);
                Wish::ResetModule.join(&mut self.wishes);
            }
            Command::SaveMotor => self.store(Space::Motor),
            Command::Motor(number) => {
                self.traffic.pass(1);
                of_motor!(&mut self.motor, (), motor => motor.handle_command(number, scope));
            }
        }
    }

    fn store(&mut self, space: Space) {
        Wish::Store { space, then_reset: false }.join(&mut self.wishes);
    }

    /// Follows the axis after a raster step. The error of a lost motor is over when the motor is heard again.
    pub(crate) fn step(&mut self, scope: &mut Scope<'_>) {
        self.traffic.step(scope.axis.status().drive);
        if scope.axis.status().drive != DriveState::Lost {
            let (drive, mut context) = scope.drive();
            drive.reset_only(Fault::motor_lost(), &mut context);
        }
        of_motor!(&mut self.motor, (), motor => motor.step(scope));
        self.mirror.look(scope.axis.period().seconds(), scope);
    }

    /// Starts the module anew; its registers have their power-on values. Which command was the last one it knows still,
    /// so that one that is held does not act again.
    pub(crate) fn restart_module(&mut self, scope: &mut Scope<'_>) {
        self.has_overflowed = false;
        self.last_error.status = 0;
        self.mirror = Mirror::default();
        self.traffic.restart();
        scope.show_register(Role::ModuleCommand, self.command.cast_signed());
        self.mirror.look(0.0, scope);
    }

    /// Whether the motor is still cooling down, or shows the time.
    pub(crate) fn is_changing(&self) -> bool {
        match &self.motor {
            Registers::Plain => false,
            Registers::Mac(motor) => motor.is_warm(),
            Registers::Mis(_) => true,
        }
    }

    /// Lets time pass in which the axis slept.
    pub(crate) fn rest(&mut self, seconds: f64) {
        of_motor!(&mut self.motor, (), motor => motor.rest(seconds));
    }

    /// Reacts to the loss of the master; after a stop the motor `holds` or becomes passive.
    pub(crate) fn lose_master(&mut self, reaction: AbortConnection, holds: bool, scope: &mut Scope<'_>) {
        if !scope.drive.is_shutting_down() {
            self.end(reaction, holds, scope);
        }
    }

    /// Ramps down and switches off. That no command is obeyed any more the drive knows.
    pub(crate) fn shut_down(&mut self, scope: &mut Scope<'_>) {
        self.end(AbortConnection::QuickStop, false, scope);
    }

    /// Ends what the motor does by its registers.
    fn end(&mut self, reaction: AbortConnection, holds: bool, scope: &mut Scope<'_>) {
        if self.runs_axis() {
            of_motor!(&mut self.motor, (), motor => motor.end(reaction, holds, scope));
        }
    }

    /// Starts the motor anew; its registers have their power-on values.
    pub(crate) fn restart(&mut self, scope: &mut Scope<'_>) {
        of_motor!(&mut self.motor, (), motor => motor.restart(scope));
    }

    /// The next thing that the device is to do.
    pub(crate) fn poll_wish(&mut self) -> Option<Wish> {
        let of_motor = of_motor!(&mut self.motor, None, motor => motor.poll_wish());
        of_motor.or_else(|| self.wishes.pop_front())
    }

    /// Shows the module's objects and the motor's live registers.
    pub(crate) fn show(&mut self, scope: &mut Scope<'_>) {
        let motor_status = self.status(scope.drive, scope.view());
        let inputs = inputs::active(scope.parameters(), &scope.axis.status().inputs);
        let limits = i32::from(inputs >> 4 & 0b11);
        let is_lost = i32::from(scope.axis.status().drive == DriveState::Lost);
        let actual = scope.axis.status().actual;
        let per_sample = actual.velocity.0 * scope.axis.period().seconds();
        scope.show(Binding::JvlMotorStatus, i64::from(motor_status.bits()));
        scope.show(Binding::JvlInputs, i64::from(inputs));
        scope.show(Binding::JvlAnalogInput, i64::from(inputs::analog(scope.analog_input)));
        scope.show_register(Role::ModuleInputs, i32::from(inputs & 0b1111));
        scope.show_register(Role::ModuleStatusBits, limits << NEGATIVE_LIMIT_BIT | is_lost << LOST_BIT);
        self.traffic.show(scope);
        self.mirror.show(scope);
        match &mut self.motor {
            Registers::Plain => {
                scope.show_register(Role::PIst, units::counter(actual.position) as i32);
                scope.show_register(Role::VIst, units::whole(per_sample) as i32);
            }
            Registers::Mac(motor) => motor.show(scope),
            Registers::Mis(motor) => motor.show(scope),
        }
        self.show_last_error(scope);
        let takes_outputs = self.mirror.takes_outputs();
        self.outputs = takes_outputs.then(|| mirror::outputs(self.motor_status(scope)));
    }

    /// Keeps ERR_STAT when a fatal error of the motor comes, and shows it (module manual, section 4.3.8).
    fn show_last_error(&mut self, scope: &mut Scope<'_>) {
        let is_present = scope.drive.fault() == Some(Fault::motor());
        if is_present && !self.last_error.is_present {
            self.last_error.status = self.motor_status(scope);
        }
        self.last_error.is_present = is_present;
        scope.show(Binding::JvlLastError, i64::from(self.last_error.status as u16));
    }

    /// ERR_STAT of the motor.
    fn motor_status(&self, scope: &mut Scope<'_>) -> u32 {
        match &self.motor {
            Registers::Plain => 0,
            Registers::Mac(motor) => motor.error_status(scope),
            Registers::Mis(_) => scope.register(Role::ErrStat).cast_unsigned(),
        }
    }

    /// O1 and O2: 0x2011:02 or what the motor gives them, or "in position" and "error" where 0x2011:05 says so (module manual, sections 4.3.6 and
    /// 4.3.9). The standard's outputs 0x60FE are the same two.
    pub(crate) fn outputs(&self, drive: &Drive402, view: View<'_>, standard: u32) -> u32 {
        if let Registers::Mis(motor) = &self.motor {
            return u32::from(motor.outputs());
        }
        let (parameters, status) = (view.parameters, self.status(drive, view));
        let commanded = parameters.or(Binding::JvlOutputs, 0) as u32 | standard;
        let own = self.outputs.unwrap_or(commanded);
        let setup = parameters.or(Binding::JvlOutputSetup, 0) as u32;
        let in_position = u32::from(status.contains(MotorStatus::IN_POSITION));
        let errors = MotorStatus::MOTOR_ERROR | MotorStatus::DISCONNECTED | MotorStatus::LIMIT_SWITCH_ERROR;
        let error = u32::from(status.intersects(errors));
        ((own & !setup) | ((in_position | error << 1) & setup)) & 0b11
    }

    /// 0x2011:03.
    fn status(&self, drive: &Drive402, view: View<'_>) -> MotorStatus {
        let mut bits = motor_status(drive.state(), drive.fault(), drive.statusword(view), view.axis.status());
        if self.runs_axis() {
            let is_there = of_motor!(&self.motor, false, motor => motor.is_in_position());
            bits.set(MotorStatus::IN_POSITION, is_there);
        }
        bits
    }
}

bitflags! {
    /// 0x2011:03.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    struct MotorStatus: u8 {
        /// A fatal motor error.
        const MOTOR_ERROR = 1 << 0;
        /// The module does not hear the motor.
        const DISCONNECTED = 1 << 1;
        /// A limit switch has been activated.
        const LIMIT_SWITCH_ERROR = 1 << 2;
        /// The motor is in the commanded position.
        const IN_POSITION = 1 << 4;
        /// The velocity is increasing.
        const ACCELERATION = 1 << 5;
        /// The velocity is decreasing.
        const DECELERATION = 1 << 6;
    }
}

/// Bits of module register 48 that show that the motor is not heard, and the negative limit switch; the positive one is
/// next (Ethernet module manual, section 8.2.18).
const LOST_BIT: u32 = 7;
const NEGATIVE_LIMIT_BIT: u32 = 14;

/// Commands of 0x2010 (module manual, section 4.3.4).
const RESET_LIMIT_ERROR: i64 = 1;
const RESET_COMMUNICATION_ERROR: i64 = 2;

/// 0x2011:03 from the drive's state, fault and motion.
fn motor_status(state: State, fault: Option<Fault>, statusword: Statusword, axis: &Status) -> MotorStatus {
    let is_limit = fault == Some(Fault::limit_switch());
    let is_lost = fault == Some(Fault::motor_lost());
    let mut bits = MotorStatus::empty();
    bits.set(MotorStatus::MOTOR_ERROR, state == State::Fault && !is_limit && !is_lost);
    bits.set(MotorStatus::DISCONNECTED, axis.drive == DriveState::Lost);
    bits.set(MotorStatus::LIMIT_SWITCH_ERROR, is_limit);
    bits.set(MotorStatus::IN_POSITION, statusword.contains(Statusword::TARGET_REACHED));
    bits.set(MotorStatus::ACCELERATION, axis.motion == Motion::Accelerating);
    bits.set(MotorStatus::DECELERATION, axis.motion == Motion::Decelerating);
    bits
}

/// Whether the error action is a stop: 0x2011:08, bit 6; otherwise the motor becomes passive.
pub(crate) fn stops_on_error(parameters: Parameters<'_>) -> bool {
    parameters.or(Binding::JvlSetup, 0) >> 6 & 1 == 1
}

/// Whether relative set-points of profile position mode move the numbers of the places instead of the actual position:
/// 0x2011:08, bit 7.
pub(crate) fn is_endless(parameters: Parameters<'_>) -> bool {
    parameters.or(Binding::JvlSetup, 0) >> 7 & 1 == 1
}
