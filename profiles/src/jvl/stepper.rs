//! A MIS stepper: the live behaviour of its registers (JVL Ethernet manual, section 11.4).
//!
//! A mode that has power runs the axis, as long as the CiA 402 drive does not: [`Drive402::operates`] is the end of it.
//! What a mode needs it reads in each sample, so that all registers act at once, but for A_SOLL: that of a motion is
//! what it was when the motion began.
//!
//! [`Drive402::operates`]: crate::cia402::Drive402::operates

mod bits;
mod commands;
mod counters;
mod limits;
mod mode;
mod modes;
mod pins;
mod sample;
mod search;
mod show;
mod units;
mod watch;

use std::collections::VecDeque;

use axis::Order;
use od::Dictionary;

use crate::cia402::AbortConnection;
use crate::jvl::fastmac::FastMac;
use crate::vendor::{Scope, Wish};
use crate::{Binding, Fault, Motor, RegisterFile, Role, StepperMotor};

use bits::{Errors, Flags, Setup, Warnings};
use counters::Counters;
use mode::Mode;
use modes::{Active, Ramp, Wanted};
use pins::Pins;
use sample::Sample;
use search::Step;

/// The motor of one axis.
#[derive(Debug)]
pub(crate) struct MisMotor {
    stepper: StepperMotor,
    /// The mode that runs the axis.
    active: Option<Active>,
    /// What the axis was last ordered to do in this mode.
    wanted: Option<Wanted>,
    /// The axis has had power in a raster step of this mode.
    has_power: bool,
    ramp: Ramp,
    /// V_START as the axis has it.
    v_start: Option<i32>,
    counters: Counters,
    pins: Pins,
    /// Position registers are distances for P_SOLL.
    is_relative: bool,
    errors: Errors,
    /// Warnings of what has been.
    warnings: Warnings,
    /// What it is doing, as of the last sample.
    flags: Flags,
    /// The flags that are off until they come anew.
    reset_flags: Flags,
    /// A travel limit is no error.
    ignores_limits: bool,
    is_homed: bool,
    /// What the outputs give.
    outputs: u8,
    /// Registers that a bus has written, in that order.
    written: Vec<Role>,
    /// Objects that a bus has written and registers show, in that order.
    objects: Vec<Binding>,
    wishes: VecDeque<Wish>,
    /// The motor has just been switched on.
    is_starting: bool,
}

impl MisMotor {
    /// The motor, just switched on; `None` if it is no stepper with registers.
    pub(crate) fn of(motor: &Motor) -> Option<Self> {
        motor.registers.as_deref().filter(|list| *list == "mis34x")?;
        motor.stepper().copied().map(Self::new)
    }

    fn new(stepper: StepperMotor) -> Self {
        Self {
            stepper,
            active: None,
            wanted: None,
            has_power: false,
            ramp: Ramp::default(),
            v_start: None,
            counters: Counters::default(),
            pins: Pins::default(),
            is_relative: false,
            errors: Errors::empty(),
            warnings: Warnings::empty(),
            flags: Flags::empty(),
            reset_flags: Flags::empty(),
            ignores_limits: false,
            is_homed: false,
            outputs: 0,
            written: Vec::new(),
            objects: Vec::new(),
            wishes: VecDeque::new(),
            is_starting: true,
        }
    }

    /// Whether a mode runs the axis.
    pub(crate) fn runs_axis(&self) -> bool {
        self.active.is_some()
    }

    /// Whether the motor is where it should be.
    pub(crate) fn is_in_position(&self) -> bool {
        self.flags.contains(Flags::IN_POSITION)
    }

    /// What the outputs give, in bits that are high.
    pub(crate) fn outputs(&self) -> u8 {
        self.outputs
    }

    /// Notes that a bus has written the register with this role; whether there is something to do about it now.
    /// Registers of groups wait for a command.
    pub(crate) fn note(&mut self, role: Role) -> bool {
        if role.is_in_group() {
            return false;
        }
        if !self.written.contains(&role) {
            self.written.push(role);
        }
        true
    }

    /// Notes that a bus has written the object that is bound so.
    pub(crate) fn note_object(&mut self, binding: Binding) {
        if commands::is_shown(binding) && !self.objects.contains(&binding) {
            self.objects.push(binding);
        }
    }

    /// Acts on what was written.
    pub(crate) fn act(&mut self, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        for binding in core::mem::take(&mut self.objects) {
            commands::show_object(binding, sample);
        }
        for role in core::mem::take(&mut self.written) {
            self.handle_written(role, sample);
        }
        self.run(sample);
    }

    /// Carries out a FastMac command.
    pub(crate) fn command(&mut self, command: FastMac, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        self.execute(command, sample);
        self.run(sample);
    }

    /// Carries out a number in the command register.
    pub(crate) fn handle_command(&mut self, number: u32, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        self.obey(number, sample);
        self.run(sample);
    }

    /// Follows the axis after a raster step.
    pub(crate) fn step(&mut self, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        self.start(sample);
        self.counters.step(sample);
        self.pins.step(sample);
        self.ramp.step(sample);
        self.watch(sample);
        if let Some(active) = &mut self.active {
            self.has_power = sample.scope.has_power();
            if self.has_power && active.step(&mut self.counters, sample) {
                self.wanted = None;
            }
        }
        self.run(sample);
        self.measure(sample);
    }

    /// Lets time pass in which the axis slept.
    pub(crate) fn rest(&mut self, seconds: f64) {
        self.counters.rest(seconds);
    }

    /// Ends the mode that runs the axis as told; after a quick stop the motor `holds` or becomes passive.
    pub(crate) fn end(&mut self, reaction: AbortConnection, holds: bool, scope: &mut Scope<'_>) {
        let sample = &mut self.sample(scope);
        match reaction {
            AbortConnection::NoAction => {}
            AbortConnection::Fault => {
                let fault = Fault::connection_lost(sample.scope.dialect);
                self.fail(fault, Errors::INTERNAL, sample);
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
        reset_faults(sample);
        *self = Self::new(self.stepper);
        commands::show_registers_in_objects(sample);
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
        Sample::new(self.stepper, scope)
    }

    /// Leaves power-on once the drive is there: the zero search of HOMEMODE or the mode of STARTMODE.
    fn start(&mut self, sample: &mut Sample<'_, '_>) {
        if !sample.scope.is_ready() || !core::mem::take(&mut self.is_starting) {
            return;
        }
        commands::show_registers_in_objects(sample);
        let search = Mode::from_number(sample.register(Role::Homemode)).filter(|mode| mode.is_search());
        self.set_mode(search.unwrap_or(start_mode(sample)), sample);
    }

    /// Begins `mode`, from whatever was under way; one that runs already goes on. Nothing is to be had while there is
    /// a fault, or while the CiA 402 drive has the axis.
    fn set_mode(&mut self, mode: Mode, sample: &mut Sample<'_, '_>) {
        let is_same = self.active.as_ref().is_some_and(|active| active.mode() == Some(mode));
        if sample.scope.is_taken() || sample.scope.drive.is_shutting_down() || is_same {
            return;
        }
        match Active::new(mode) {
            Some(active) => {
                self.begin(active);
                self.counters.wake(sample);
                sample.axis_mut().power_on();
            }
            None if self.runs_axis() => self.go_passive(sample),
            None => {}
        }
    }

    fn begin(&mut self, active: Active) {
        self.active = Some(active);
        self.wanted = None;
    }

    /// Brakes with ACC_EMERG and holds, or switches off then.
    fn brake(&mut self, ends_passive: bool, sample: &mut Sample<'_, '_>) {
        if self.has_power {
            self.begin(Active::Rest { ends_passive });
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
        self.wanted = None;
        self.has_power = false;
        sample.scope.give_back();
    }

    /// Has the axis do what the mode wants now.
    fn run(&mut self, sample: &mut Sample<'_, '_>) {
        limits::take_start_velocity(&mut self.v_start, sample);
        limits::apply_to_both(sample);
        if self.active.is_none() {
            return;
        }
        if sample.scope.is_taken() {
            return self.leave(sample);
        }
        let Some(active) = self.active.as_mut().filter(|_| self.has_power) else { return };
        limits::apply(active.is_search(), sample);
        let ramp = self.ramp.acceleration(sample);
        if let Active::Search(search) = active {
            match search.step(ramp, sample) {
                Step::Pending => {}
                Step::Order(order) => sample.axis_mut().order(order),
                Step::Found(mark) => self.finish_search(mark, sample),
                Step::Failed => self.fail(Fault::motor(), Errors::POSITION_LIMIT, sample),
            }
            return;
        }
        let wanted = active.wanted(ramp, sample);
        let order = wanted.and_then(|wanted| self.order(wanted, sample));
        if let Some(order) = order {
            sample.axis_mut().order(order);
        } else if matches!(self.active, Some(Active::Rest { ends_passive: true }))
            && sample.axis().status().done
        {
            self.go_passive(sample);
        }
    }

    /// The order for what is wanted, if that is something else than before.
    fn order(&mut self, wanted: Wanted, sample: &Sample<'_, '_>) -> Option<Order> {
        let is_new = self.wanted.replace(wanted) != Some(wanted);
        is_new.then(|| wanted.order(sample))
    }

    /// The zero point is found: it gets the number P_HOME, and the motor goes on in its start mode where it is.
    fn finish_search(&mut self, mark: axis::Position, sample: &mut Sample<'_, '_>) {
        let home = sample.units.way(axis::Position(f64::from(sample.register(Role::PHome))));
        let actual = sample.axis().status().actual.position;
        sample.axis_mut().set_position(actual - mark + home);
        let place = sample.counter(sample.demand());
        sample.set(Role::PSoll, place);
        *sample.scope.is_referenced = true;
        self.is_homed = true;
        self.set_mode(start_mode(sample), sample);
    }
}

/// Whether SETUP_BITS let the motor turn the other way round.
pub(crate) fn turns_back(registers: &RegisterFile, dictionary: &Dictionary) -> bool {
    let setup = registers.get(dictionary, Role::SetupBits).unwrap_or(0);
    Setup::from_bits_truncate(setup).contains(Setup::REVERSED)
}

/// The mode of STARTMODE.
fn start_mode(sample: &Sample<'_, '_>) -> Mode {
    let mode = Mode::from_number(sample.register(Role::Startmode)).filter(|mode| !mode.is_search());
    mode.unwrap_or_default()
}

/// Resets the faults of the axis and of the CiA 402 drive.
fn reset_faults(sample: &mut Sample<'_, '_>) {
    let (drive, mut context) = sample.scope.drive();
    drive.reset_motor_error(&mut context);
    drive.reset_only(Fault::limit_switch(), &mut context);
}
