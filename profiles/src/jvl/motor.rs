//! A MAC servo motor behind its module: the live behaviour of its registers.
//!
//! A mode that has power runs the axis, as long as the CiA 402 drive does not: [`Drive402::operates`] is the end of it.
//! Registers have no memory of their own here; what a mode needs it reads in each sample, so that all of them act at
//! once.
//!
//! [`Drive402::operates`]: crate::cia402::Drive402::operates

mod commands;
mod errors;
mod groups;
mod heat;
mod hwi;
mod inputs;
mod limits;
mod mode;
mod modes;
mod sample;
mod show;
mod watch;

use std::collections::VecDeque;

use axis::Temperature;

use crate::cia402::AbortConnection;
use crate::jvl::fastmac::FastMac;
use crate::jvl::units::{Family, MacUnits};
use crate::vendor::{Scope, Wish};
use crate::{Fault, Motor, Role};

use errors::{Errors, Flags};
use groups::Relative;
use heat::BrakeResistor;
use mode::Mode;
use modes::{Active, Demand, Outcome};
use sample::Sample;
use show::Average;

/// The motor of one axis.
#[derive(Debug)]
pub(crate) struct MacMotor {
    family: Family,
    /// The mode that runs the axis.
    active: Option<Active>,
    /// The mode without power, while there is none with it.
    passive: Mode,
    /// What the axis was last ordered to do in this mode.
    commanded: Option<Demand>,
    /// The axis has had power in a raster step of this mode.
    has_power: bool,
    /// The motor becomes passive as soon as it rests.
    ends_passive: bool,
    /// What position registers are, on a motor that keeps that in ERR_STAT.
    relative: Relative,
    errors: Errors,
    /// What it is doing, as of the last sample.
    flags: Flags,
    /// The outputs that a program of the motor has set.
    outputs: Flags,
    /// The position limits are off until the motor is within them.
    has_limits_off: bool,
    /// Samples on end within the in-position window.
    samples_inside: u32,
    /// Some hardware-input function is in use, as far as anybody has looked.
    follows_inputs: bool,
    is_homed: bool,
    velocities: Average,
    resistor: BrakeResistor,
    /// Temperature and overload changed with the last sample.
    is_cooling: bool,
    heat: (Temperature, f64),
    /// Registers that a bus has written, in that order.
    written: Vec<Role>,
    wishes: VecDeque<Wish>,
    /// The motor has just been switched on.
    is_starting: bool,
}

impl MacMotor {
    /// The motor whose register list `motor` names, if it is one of the two families.
    pub(crate) fn of(motor: &Motor) -> Option<Self> {
        Some(Self::new(match motor.registers.as_deref()? {
            "mac050-141" => Family::Small,
            "mac400-3000" => Family::Large,
            _ => return None,
        }))
    }

    fn new(family: Family) -> Self {
        Self {
            family,
            active: None,
            passive: Mode::Passive,
            commanded: None,
            has_power: false,
            ends_passive: false,
            relative: Relative::No,
            errors: Errors::empty(),
            flags: Flags::empty(),
            outputs: Flags::empty(),
            has_limits_off: false,
            samples_inside: 0,
            follows_inputs: true,
            is_homed: false,
            velocities: Average::default(),
            resistor: BrakeResistor::default(),
            is_cooling: false,
            heat: (Temperature(0.0), 0.0),
            written: Vec::new(),
            wishes: VecDeque::new(),
            is_starting: true,
        }
    }

    /// Whether a mode runs the axis.
    pub(crate) fn runs_axis(&self) -> bool {
        self.active.is_some()
    }

    /// ERR_STAT as it is now.
    pub(crate) fn error_status(&self, scope: &mut Scope<'_>) -> u32 {
        self.status(&self.sample(scope)).cast_unsigned()
    }

    /// Whether the motor is where, or as fast as, it should be.
    pub(crate) fn is_in_position(&self) -> bool {
        self.flags.contains(Flags::IN_POSITION)
    }

    /// Notes that a bus has written the register with this role; whether there is something to do about it now.
    /// Registers of groups wait for a command, unless inputs choose among them.
    #[inline]
    pub(crate) fn note(&mut self, role: Role) -> bool {
        if role.is_in_group() && !self.follows_inputs {
            return false;
        }
        if !self.written.contains(&role) {
            self.written.push(role);
        }
        true
    }

    /// Acts on what was written, and on inputs that have changed.
    pub(crate) fn act(&mut self, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        let mut written = core::mem::take(&mut self.written);
        written.drain(..).for_each(|role| self.handle_written(role, sample));
        self.written = written;
        self.follow_inputs(sample);
        self.run(sample);
    }

    /// Carries out a FastMac command.
    pub(crate) fn command(&mut self, command: FastMac, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        self.execute(command, sample);
        self.run(sample);
    }

    /// Carries out a number in the motor's command register (register 211): 1 is a reset, 2 saves before, the others are
    /// FastMac commands with bit 7 set.
    pub(crate) fn handle_command(&mut self, number: u32, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        self.obey(number, sample);
        self.run(sample);
    }

    /// Follows the axis after a raster step.
    pub(crate) fn step(&mut self, scope: &mut Scope<'_>) {
        let raster = scope.axis.period().seconds();
        let actual = scope.axis.status().actual;
        self.resistor.step(&actual, scope.motor, raster);
        self.velocities.take(actual.velocity);
        let heat = (scope.axis.status().temperature, scope.axis.status().overload);
        self.is_cooling = core::mem::replace(&mut self.heat, heat) != heat;
        let sample = &mut self.sample(scope);
        self.start(sample);
        self.follow_inputs(sample);
        self.watch(sample);
        if let Some(active) = &mut self.active {
            let had_power = core::mem::replace(&mut self.has_power, sample.scope.has_power());
            if self.has_power && !had_power {
                // It begins where the axis is now.
                *active = Active::new(active.mode(), sample).unwrap_or(Active::REST);
            }
            if self.has_power {
                active.step(sample);
            }
        }
        self.run(sample);
        self.measure(sample);
    }

    /// Whether I2T, UIT or DEGC still fall.
    pub(crate) fn is_warm(&self) -> bool {
        self.is_cooling || self.resistor.is_warm()
    }

    /// Lets time pass in which the axis slept.
    pub(crate) fn rest(&mut self, seconds: f64) {
        self.resistor.rest(seconds);
    }

    /// Ends the mode that runs the axis as told; after a quick stop the motor `holds` or becomes passive.
    pub(crate) fn end(&mut self, reaction: AbortConnection, holds: bool, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        match reaction {
            AbortConnection::NoAction => {}
            AbortConnection::Fault => {
                let fault = Fault::connection_lost(sample.scope.dialect);
                let (drive, mut context) = sample.scope.drive();
                drive.raise(fault, &mut context);
                self.leave(sample);
            }
            AbortConnection::DisableVoltage => self.go_passive(sample),
            AbortConnection::QuickStop => {
                self.brake(!holds, sample);
                self.run(sample);
            }
        }
    }

    /// Starts anew, as after power-on.
    pub(crate) fn restart(&mut self, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        if self.runs_axis() {
            self.go_passive(sample);
        }
        self.reset_errors(sample);
        *self = Self::new(self.family);
    }

    /// The next thing that the device is to do.
    pub(crate) fn poll_wish(&mut self) -> Option<Wish> {
        self.wishes.pop_front()
    }

    /// Shows the motor in its registers.
    pub(crate) fn show(&mut self, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        self.show_registers(sample);
    }

    fn sample<'s, 'a>(&self, scope: &'s mut Scope<'a>) -> Sample<'s, 'a> {
        Sample::new(self.family, self.relative, scope)
    }

    /// Leaves power-on once the drive is there: a zero search or the start mode.
    fn start(&mut self, sample: &mut Sample<'_, '_>) {
        if sample.scope.is_ready() && core::mem::take(&mut self.is_starting) {
            self.set_mode(sample.first_mode(), sample);
        }
    }

    /// Begins `mode`, from whatever was under way; one that runs already goes on. Nothing but passive is to be had
    /// while there is a fault, or while the CiA 402 drive has the axis.
    fn set_mode(&mut self, mode: Mode, sample: &mut Sample<'_, '_>) {
        let is_same = self.active.as_ref().is_some_and(|active| active.mode() == mode);
        if sample.scope.is_taken() || sample.scope.drive.is_shutting_down() || (is_same && !self.ends_passive)
        {
            return;
        }
        match Active::new(mode, sample) {
            Some(active) => {
                self.begin(active);
                sample.axis_mut().power_on();
            }
            None if self.runs_axis() => {
                self.go_passive(sample);
                self.passive = mode;
            }
            None => self.passive = mode,
        }
    }

    fn begin(&mut self, active: Active) {
        self.has_limits_off |= active.mode().is_search();
        self.active = Some(active);
        self.commanded = None;
        self.ends_passive = false;
        self.samples_inside = 0;
    }

    /// Brakes with ACC_EMERG and holds, or switches off then.
    fn brake(&mut self, ends_passive: bool, sample: &mut Sample<'_, '_>) {
        if self.has_power {
            self.begin(Active::REST);
            self.ends_passive = ends_passive;
        } else {
            self.go_passive(sample);
        }
    }

    /// Takes the power away.
    fn go_passive(&mut self, sample: &mut Sample<'_, '_>) {
        sample.axis_mut().power_off();
        self.leave(sample);
        sample.scope.restore_limits();
    }

    /// The axis is no longer run by a mode.
    fn leave(&mut self, sample: &mut Sample<'_, '_>) {
        self.active = None;
        self.passive = Mode::Passive;
        self.commanded = None;
        self.has_power = false;
        self.ends_passive = false;
        self.samples_inside = 0;
        sample.scope.give_back();
    }

    /// Has the axis do what the mode demands now.
    fn run(&mut self, sample: &mut Sample<'_, '_>) {
        if self.active.is_some() && sample.scope.is_taken() {
            return self.leave(sample);
        }
        let Some(active) = self.active.as_mut().filter(|_| self.has_power) else { return };
        limits::apply(active.mode(), self.has_limits_off, sample);
        let demand = active.demand(sample);
        if self.commanded.replace(demand) != Some(demand)
            && let Some(order) = demand.order()
        {
            sample.axis_mut().order(order);
            return;
        }
        match active.outcome() {
            Some(Outcome::Found(mark)) => self.finish_search(mark, sample),
            Some(Outcome::Failed) => self.fail(Errors::POSITION_LIMIT, true, sample),
            None if self.ends_passive && sample.axis().status().done => self.go_passive(sample),
            None => {}
        }
    }

    /// The zero point is found: positions count from it, and the motor goes on in its start mode.
    fn finish_search(&mut self, mark: axis::Position, sample: &mut Sample<'_, '_>) {
        let home = f64::from(sample.register(Role::PHome));
        sample.show_index_offset(mark);
        let actual = sample.axis().status().actual.position;
        self.set_position(axis::Position((actual - mark).0 + home), sample);
        sample.set(Role::PSoll, 0);
        *sample.scope.is_referenced = true;
        self.is_homed = true;
        let mode = Mode::from_number(sample.register(Role::Startmode)).filter(|mode| !mode.is_search());
        self.set_mode(mode.unwrap_or_default(), sample);
    }

    /// Calls the present place `position`; nothing moves by that alone.
    fn set_position(&mut self, position: axis::Position, sample: &mut Sample<'_, '_>) {
        let by = position - sample.axis().status().actual.position;
        sample.axis_mut().set_position(position);
        if let Some(active) = &mut self.active {
            active.shift(by);
            active.retarget(sample);
            if !active.mode().is_search() {
                self.commanded = self.commanded.and(Some(Demand::Ordered));
            }
        }
    }
}
