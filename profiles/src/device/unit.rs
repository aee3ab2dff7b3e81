//! One axis of a device with its drive and its place in the dictionary.

mod foreign;
mod show;

use std::sync::Arc;

use core::time::Duration;

use axis::{Axis, Period, Velocity, Voltage};
use od::{Dictionary, Instant, Schema, Slot};

use crate::cia402::touch_probe::TouchProbe;
use crate::cia402::units::{Units, factors};
use crate::cia402::{AbortConnection, Context, Drive402, Fault, SetPoints};
use crate::raster::Alignment;
use crate::simulated::Simulated;
use crate::slots::{Parameters, Slots};
use crate::vendor::{Mover, Scope, Vendor, Wish};
use crate::{Binding, Dialect, Motor, Profile, RegisterFile, Role, jvl};

/// Simulated time that one call of [`Unit::advance`] catches up at most.
const MAX_CATCH_UP: Duration = Duration::from_millis(20);

/// How often an axis that sleeps is looked at, if its vendor shows something that changes meanwhile.
const DOZE: Duration = Duration::from_millis(100);

/// 0x607E of positions and velocities that count the other way.
const REVERSED: i64 = 0xC0;

/// What becomes of 0x6093 when factors were written.
#[derive(Clone, Copy, Debug, Default)]
struct PositionFactor {
    /// What it is calculated from was written.
    is_due: bool,
    /// It was written itself.
    is_given: bool,
}

/// What buses have written since the unit last acted.
#[derive(Clone, Copy, Debug, Default)]
struct Written {
    factors: bool,
    parameters: bool,
    vendor: bool,
    controlword: bool,
}

impl Written {
    fn any(self) -> bool {
        self.factors || self.parameters || self.vendor || self.controlword
    }
}

/// One axis with its drive and its place in the dictionary.
pub(super) struct Unit {
    pub(super) slots: Slots,
    registers: Arc<RegisterFile>,
    pub(super) units: Units,
    position_factor: PositionFactor,
    dialect: Dialect,
    motor: Motor,
    /// Number of the axis, from 0 on.
    number: u8,
    pub(super) axis: Axis,
    pub(super) drive: Drive402,
    pub(super) vendor: Vendor,
    /// Who moves the axis, as of the last time that the vendor's vocabulary acted.
    mover: Mover,
    /// The axis knows its home position.
    is_referenced: bool,
    touch_probe: TouchProbe,
    pub(super) analog_input: Voltage,
    /// Speed of the encoder that gear modes follow.
    pub(super) external_encoder: Velocity,
    /// When it was stepped last, or made.
    stepped: Instant,
    /// When the next raster step is due; none while the axis is off and at rest.
    pub(super) next: Option<Instant>,
    /// That step is far off: the axis sleeps but for looking how warm it is.
    is_dozing: bool,
    alignment: Alignment,
    written: Written,
    /// Set-points that were written since the drive last acted.
    set_points: SetPoints,
    pub(super) shown_fault: Option<Fault>,
    pub(super) shown_error: Option<Fault>,
}

/// How far [`Unit::advance`] has come.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Advanced {
    /// It has made at least one raster step.
    pub(super) has_stepped: bool,
    /// Raster steps that were lost because they were too many.
    pub(super) dropped: u64,
}

impl Unit {
    pub(super) fn new(
        profile: &Profile,
        motor: &Motor,
        drive: Simulated,
        schema: &Schema,
        axis: u8,
        now: Instant,
    ) -> Self {
        let period = Period::from_nanos(motor.raster_ns).unwrap_or(Period::MILLISECOND);
        let (cycle, limits) = (profile.dialect.generator_cycle(), crate::cia402::limits_of(motor));
        Self {
            slots: Slots::new(schema, &profile.bindings, axis),
            registers: Arc::clone(&profile.registers),
            units: Units::default(),
            position_factor: PositionFactor::default(),
            dialect: profile.dialect,
            motor: motor.clone(),
            number: axis,
            axis: Axis::with_generator_cycle(period, cycle, limits, drive.build(period)),
            drive: Drive402::new(profile.dialect),
            vendor: Vendor::new(profile.dialect, motor, schema, axis),
            mover: Mover::Cia402,
            is_referenced: false,
            touch_probe: TouchProbe::default(),
            analog_input: Voltage(0.0),
            external_encoder: Velocity(0.0),
            stepped: now,
            next: Some(now + Duration::from_nanos(period.nanos())),
            is_dozing: false,
            alignment: Alignment::default(),
            written: Written::default(),
            set_points: SetPoints::empty(),
            shown_fault: None,
            shown_error: None,
        }
    }

    /// Notes that a bus has written the entry at `slot`, which is bound to `binding`.
    pub(super) fn note(&mut self, slot: Slot, binding: Binding) {
        self.set_points |= SetPoints::of(binding);
        if binding == Binding::Controlword {
            self.written.controlword = true;
        } else if self.vendor.note(slot, binding) {
            self.written.vendor = true;
        } else if factors::is_factor(binding) {
            self.written.factors = true;
            self.position_factor.is_due |= factors::makes_position_factor(binding);
            self.position_factor.is_given |= factors::is_position_factor(binding);
        } else {
            self.written.parameters = true;
        }
    }

    /// Notes that a bus has written the register with this role, which the vendor's vocabulary has to do something about.
    /// One that is an object is taken for that.
    pub(super) fn note_register(&mut self, role: Role, dictionary: &mut Dictionary) {
        self.written.vendor = true;
        self.written.factors |= role == Role::SetupBits;
        let Some(binding) = jvl::object_of(role) else { return };
        let value = i64::from(self.registers.get(dictionary, role).unwrap_or(0));
        if let Some(slot) = self.slots.get(binding)
            && let Some(value) = jvl::taken(binding, value, self.slots.integer(dictionary, binding))
        {
            self.slots.show(dictionary, binding, value);
            self.note(slot, binding);
        }
    }

    /// Lets the module pass so many registers on to its motor.
    pub(super) fn pass(&mut self, registers: u32, dictionary: &mut Dictionary) {
        let (vendor, mut scope) = self.scope(dictionary);
        vendor.pass(registers, &mut scope);
    }

    /// The signals at the inputs of the motor are others now.
    pub(super) fn handle_signals(&mut self, dictionary: &mut Dictionary, now: Instant) {
        self.written.vendor = true;
        self.act(dictionary, now);
    }

    /// Acts on what was written, if anything was: parameters before the controlword.
    pub(super) fn act(&mut self, dictionary: &mut Dictionary, now: Instant) -> bool {
        let written = core::mem::take(&mut self.written);
        if !written.any() {
            return false;
        }
        if written.factors {
            self.rescale(dictionary);
        }
        let is_foreign = self.mover == Mover::Foreign;
        let (drive, touch_probe, mut context) = self.split(dictionary);
        if written.factors && !is_foreign {
            drive.handle_units(&mut context);
        }
        if written.parameters {
            if !is_foreign {
                drive.handle_parameters(&mut context);
            }
            touch_probe.update(context.parameters);
        }
        if written.vendor || written.parameters || written.factors {
            let (vendor, mut scope) = self.scope(dictionary);
            vendor.act(&mut scope);
            self.hand_over(dictionary);
        }
        if written.controlword {
            let (drive, _, mut context) = self.split(dictionary);
            drive.handle_controlword(&mut context);
        }
        self.align(now);
        self.wake(now);
        true
    }

    /// Runs the raster steps that are due at `now`; those that are further behind than 20 ms are lost.
    pub(super) fn advance(&mut self, dictionary: &mut Dictionary, now: Instant) -> Advanced {
        let period = Duration::from_nanos(self.axis.period().nanos());
        let mut advanced = Advanced::default();
        let mut simulated = Duration::ZERO;
        while let Some(due) = self.next.filter(|due| *due <= now) {
            if simulated > MAX_CATCH_UP {
                let late = now.saturating_since(due).as_nanos() as u64;
                advanced.dropped = late / self.axis.period().nanos() + 1;
                self.next = Some(now + period);
                break;
            }
            simulated += period;
            self.step(dictionary, due);
            let is_quiet = self.axis.is_quiet() && !self.vendor.is_settling();
            self.is_dozing = is_quiet && self.vendor.is_changing();
            let pause = if self.is_dozing { DOZE } else { period };
            self.next = (!is_quiet || self.is_dozing).then(|| due + pause);
            advanced.has_stepped = true;
        }
        advanced
    }

    fn step(&mut self, dictionary: &mut Dictionary, due: Instant) {
        if core::mem::take(&mut self.is_dozing) {
            // The step itself is the last raster period of the pause.
            self.rest(due, Duration::from_nanos(self.axis.period().nanos()));
        }
        self.axis.step();
        self.stepped = due;
        let mover = self.mover;
        let (drive, touch_probe, mut context) = self.split(dictionary);
        touch_probe.step(context.parameters, context.axis.status());
        match mover {
            Mover::Cia402 | Mover::Lent => drive.step(&mut context),
            Mover::Foreign => drive.look_on(&mut context),
        }
        let (vendor, mut scope) = self.scope(dictionary);
        vendor.step(&mut scope);
        self.hand_over(dictionary);
    }

    /// Back to power-on; the axis keeps its place and coasts.
    pub(super) fn reset(&mut self, dictionary: &mut Dictionary, now: Instant) {
        self.axis.power_off();
        self.axis.reset_fault();
        self.drive = Drive402::new(self.dialect);
        self.vendor = Vendor::new(self.dialect, &self.motor, dictionary.schema(), self.number);
        self.mover = Mover::Cia402;
        self.is_referenced = false;
        self.touch_probe = TouchProbe::default();
        self.shown_fault = None;
        self.shown_error = None;
        self.written = Written::default();
        self.set_points = SetPoints::empty();
        self.read_units(dictionary);
        let (vendor, mut scope) = self.scope(dictionary);
        vendor.start(&mut scope);
        let (drive, _, mut context) = self.split(dictionary);
        drive.handle_parameters(&mut context);
        self.schedule(now);
    }

    /// Ramps down, switches off and obeys no more commands. The drive goes first, since the vendor's vocabulary asks it.
    pub(super) fn shut_down(&mut self, dictionary: &mut Dictionary, now: Instant) {
        let (drive, _, mut context) = self.split(dictionary);
        drive.shut_down(&mut context);
        let (vendor, mut scope) = self.scope(dictionary);
        vendor.shut_down(&mut scope);
        self.wake(now);
    }

    /// Cuts the power for good, whoever has the axis: it coasts.
    pub(super) fn cut_power(&mut self, dictionary: &mut Dictionary, now: Instant) {
        let (drive, _, mut context) = self.split(dictionary);
        drive.switch_off(&mut context);
        self.axis.retire();
        self.wake(now);
    }

    /// Stops an axis that runs by the words of its vendor; whether it did.
    pub(super) fn halt(&mut self, dictionary: &mut Dictionary, now: Instant) -> bool {
        let (vendor, mut scope) = self.scope(dictionary);
        let is_running = scope.mover.is_vendor();
        if is_running {
            vendor.halt(&mut scope);
            self.wake(now);
        }
        is_running
    }

    /// Reacts to the loss of the master as 0x6007 says.
    pub(super) fn connection_lost(&mut self, dictionary: &mut Dictionary, now: Instant) {
        let parameters = Parameters { dictionary, slots: &self.slots, units: &self.units };
        let (reaction, holds) = (AbortConnection::of(parameters), jvl::stops_on_error(parameters));
        self.lose_master(reaction, holds, dictionary, now);
    }

    fn lose_master(
        &mut self,
        reaction: AbortConnection,
        holds: bool,
        dictionary: &mut Dictionary,
        now: Instant,
    ) {
        let (drive, _, mut context) = self.split(dictionary);
        drive.lose_master(reaction, &mut context);
        let (vendor, mut scope) = self.scope(dictionary);
        vendor.lose_master(reaction, holds, &mut scope);
        self.wake(now);
    }

    /// Starts the motor anew; its registers have their power-on values.
    pub(super) fn restart_motor(&mut self, dictionary: &mut Dictionary, now: Instant) {
        let (vendor, mut scope) = self.scope(dictionary);
        vendor.restart(&mut scope);
        self.read_units(dictionary);
        self.schedule(now);
    }

    /// Starts the module of the motor anew; its registers have their power-on values.
    pub(super) fn restart_module(&mut self, dictionary: &mut Dictionary, now: Instant) {
        let (vendor, mut scope) = self.scope(dictionary);
        vendor.restart_module(&mut scope);
        let (drive, _, mut context) = self.split(dictionary);
        drive.handle_parameters(&mut context);
        self.schedule(now);
    }

    /// The next thing that the vendor's vocabulary wants of the device.
    pub(super) fn poll_wish(&mut self) -> Option<Wish> {
        self.vendor.poll_wish()
    }

    /// Reacts to the silence of all Modbus clients: as the setup bits of JVL's module say, or else as to any other loss.
    pub(super) fn modbus_lost(&mut self, dictionary: &mut Dictionary, now: Instant) {
        match self.registers.get(dictionary, Role::ModuleSetupBits) {
            Some(setup) => self.lose_master(jvl::reaction_to_silence(setup), true, dictionary, now),
            None => self.connection_lost(dictionary, now),
        }
    }

    /// The vocabulary of the vendor, and what it works with.
    fn scope<'a>(&'a mut self, dictionary: &'a mut Dictionary) -> (&'a mut Vendor, Scope<'a>) {
        let scope = Scope {
            dictionary,
            slots: &self.slots,
            registers: &self.registers,
            units: &self.units,
            axis: &mut self.axis,
            drive: &mut self.drive,
            motor: &self.motor,
            dialect: self.dialect,
            is_referenced: &mut self.is_referenced,
            analog_input: self.analog_input,
            external_encoder: self.external_encoder,
            mover: self.vendor.mover(),
            minds_limit_switches: self.vendor.minds_limit_switches(),
        };
        (&mut self.vendor, scope)
    }

    /// The drive, its touch probes, and what they work with.
    fn split<'a>(
        &'a mut self,
        dictionary: &'a Dictionary,
    ) -> (&'a mut Drive402, &'a mut TouchProbe, Context<'a>) {
        let parameters = Parameters { dictionary, slots: &self.slots, units: &self.units };
        let mode = self.drive.mode();
        let context = Context {
            parameters,
            axis: &mut self.axis,
            motor: &self.motor,
            written: self.set_points,
            dialect: self.dialect,
            mode,
            is_referenced: &mut self.is_referenced,
            mover: self.vendor.mover(),
            minds_limit_switches: self.vendor.minds_limit_switches(),
        };
        (&mut self.drive, &mut self.touch_probe, context)
    }

    /// Takes the set-points for acted on, and moves the raster if the mode takes them cycle by cycle.
    fn align(&mut self, now: Instant) {
        let written = core::mem::take(&mut self.set_points);
        if written.intersects(self.drive.cyclic()) {
            let period = Duration::from_nanos(self.axis.period().nanos());
            self.next = self.next.map(|next| self.alignment.align(next, now, period));
        }
    }

    /// Follows factors that were written. 0x6093 is calculated from the others unless it was written with them.
    fn rescale(&mut self, dictionary: &mut Dictionary) {
        let PositionFactor { is_due, is_given } = core::mem::take(&mut self.position_factor);
        if is_due && !is_given {
            let get = |binding| self.slots.integer(dictionary, binding);
            for (binding, value) in factors::position_factor(get) {
                self.slots.show(dictionary, binding, value.into());
            }
        }
        self.read_units(dictionary);
    }

    fn read_units(&mut self, dictionary: &Dictionary) {
        let turns_back = self.vendor.turns_back(&self.registers, dictionary);
        self.units = Units::read(self.dialect, |binding| {
            let value = self.slots.integer(dictionary, binding)?;
            Some(if turns_back && binding == Binding::Polarity { value ^ REVERSED } else { value })
        });
    }

    /// Schedules the next step if the axis may do anything.
    pub(super) fn wake(&mut self, now: Instant) {
        if !self.axis.is_quiet() || self.vendor.is_settling() {
            self.schedule(now);
        }
    }

    /// Schedules the next step.
    pub(super) fn schedule(&mut self, now: Instant) {
        if self.next.is_none() || core::mem::take(&mut self.is_dozing) {
            self.rest(now, Duration::ZERO);
            self.next = Some(now + Duration::from_nanos(self.axis.period().nanos()));
        }
    }

    /// An axis that has slept until `now`, but for `still`, has cooled down.
    fn rest(&mut self, now: Instant, still: Duration) {
        let seconds = now.saturating_since(self.stepped).saturating_sub(still).as_secs_f64();
        self.axis.rest(seconds);
        self.vendor.rest(seconds);
    }
}
