//! A device: one object dictionary and the axes behind it.

mod plant;

use std::collections::VecDeque;
use std::sync::Arc;

use core::time::Duration;

use axis::{Axis, Period, Plant, PlantConfig, Position, ServoConfig, SimulatedServo, Velocity, Voltage};
use od::{Dictionary, Instant, Schema, Slot};

use crate::cia402::units::{self, Units, factors};
use crate::cia402::{Context, Drive402, Fault, Mode, RpmUnits, SetPoints, State, Statusword, View};
use crate::cia402::{inputs_outputs, touch_probe::TouchProbe};
use crate::raster::Alignment;
use crate::simulated::servo;
use crate::slots::{Parameters, Slots};
use crate::{Binding, Dialect, Motor, PlantSetup, Profile, jvl};

pub use plant::NoPlant;

/// Simulated time that one call of [`Device::advance`] catches up at most.
const MAX_CATCH_UP: Duration = Duration::from_millis(20);

/// What the buses of a device are to tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceEvent {
    /// A fault has come.
    Raised(Fault),
    /// The fault with this error code is gone.
    Cleared(u16),
}

/// One axis of a device, for display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisStatus {
    /// State of the drive.
    pub state: State,
    /// Mode in effect.
    pub mode: Mode,
    /// 0x6041.
    pub statusword: Statusword,
    /// Actual position.
    pub position: Position,
    /// Actual velocity.
    pub velocity: Velocity,
    /// The fault, if any.
    pub fault: Option<Fault>,
    /// The digital outputs in bits, as 0x60FE numbers them.
    pub outputs: u32,
}

/// A device with its axes. It sees time only as an argument: between calls it has no life of its own.
pub struct Device {
    profile: Arc<Profile>,
    dictionary: Dictionary,
    /// What every slot is bound to, sorted.
    bound: Vec<(Slot, u8, Binding)>,
    units: Vec<Unit>,
    events: VecDeque<DeviceEvent>,
    dropped_steps: u64,
}

/// What becomes of 0x6093 when factors were written.
#[derive(Clone, Copy, Debug, Default)]
struct PositionFactor {
    /// What it is calculated from was written.
    is_due: bool,
    /// It was written itself.
    is_given: bool,
}

/// One axis with its drive and its place in the dictionary.
struct Unit {
    slots: Slots,
    units: Units,
    position_factor: PositionFactor,
    dialect: Dialect,
    motor: Motor,
    axis: Axis,
    drive: Drive402,
    /// The axis knows its home position.
    is_referenced: bool,
    touch_probe: TouchProbe,
    analog_input: Voltage,
    /// When it was stepped last, or made.
    stepped: Instant,
    /// When the next raster step is due; none while the axis is off and at rest.
    next: Option<Instant>,
    alignment: Alignment,
    /// Set-points that were written since the drive last acted.
    written: SetPoints,
    shown_fault: Option<Fault>,
}

impl Device {
    /// A device of this profile, powered on at `now`; `node_id` only matters for defaults that depend on it.
    #[must_use]
    pub fn new(profile: Arc<Profile>, node_id: u8, now: Instant) -> Self {
        Self::with_plant(profile, node_id, now, &PlantSetup::default())
    }

    /// The same with another plant behind each of its axes.
    #[must_use]
    pub fn with_plant(profile: Arc<Profile>, node_id: u8, now: Instant, plant: &PlantSetup) -> Self {
        Self::arranged(profile, node_id, now, |_, config| *config = plant.apply(config.clone()))
    }

    /// As [`Device::new`], with the plant behind each axis, by number, as `arrange` leaves it: where its switches and
    /// stops are, what it moves.
    #[must_use]
    pub fn arranged(
        profile: Arc<Profile>,
        node_id: u8,
        now: Instant,
        arrange: impl Fn(u8, &mut PlantConfig),
    ) -> Self {
        let schema = Arc::clone(&profile.application);
        let mut bound: Vec<_> = profile
            .bindings
            .iter()
            .filter_map(|b| Some((schema.slot(b.address)?, b.axis, b.binding)))
            .collect();
        bound.sort_unstable();
        let axes = profile.motor.iter().flat_map(|motor| (0..profile.axes()).map(move |axis| (axis, motor)));
        let unit = |(axis, motor)| {
            let mut servo = servo(motor);
            arrange(axis, &mut servo.plant);
            Unit::new(&profile, motor, servo, &schema, axis, now)
        };
        let units = axes.map(unit).collect();
        let dictionary = Dictionary::new(schema, node_id);
        let mut device =
            Self { profile, dictionary, bound, units, events: VecDeque::new(), dropped_steps: 0 };
        device.reset(now);
        device
    }

    /// What kind of device it is.
    #[must_use]
    pub fn profile(&self) -> &Arc<Profile> {
        &self.profile
    }

    /// The objects from 0x2000 on.
    #[must_use]
    pub fn dictionary(&self) -> &Dictionary {
        &self.dictionary
    }

    /// The objects from 0x2000 on, for a bus to write through the gate; [`Device::apply`] acts on it.
    pub fn dictionary_mut(&mut self) -> &mut Dictionary {
        &mut self.dictionary
    }

    /// Acts on what buses have written. Parameters act before the controlword of the same batch.
    pub fn apply(&mut self, now: Instant) {
        let mut commanded = 0_u8;
        let mut changed = 0_u8;
        let mut rescaled = 0_u8;
        let mut module = 0_u8;
        while let Some(slot) = self.dictionary.take_written() {
            let Ok(position) = self.bound.binary_search_by_key(&slot, |(bound, ..)| *bound) else { continue };
            let Some((_, axis, binding)) = self.bound.get(position) else { continue };
            if let Some(unit) = self.units.get_mut(usize::from(*axis)) {
                unit.written |= SetPoints::of(*binding);
            }
            let mask = 1_u8.checked_shl(u32::from(*axis)).unwrap_or(0);
            match binding {
                Binding::Controlword => commanded |= mask,
                Binding::JvlCommand => module |= mask,
                factor if factors::is_factor(*factor) => {
                    rescaled |= mask;
                    if let Some(unit) = self.units.get_mut(usize::from(*axis)) {
                        unit.note_factor(*factor);
                    }
                }
                _ => changed |= mask,
            }
        }
        if commanded | changed | rescaled | module == 0 {
            return;
        }
        for (number, unit) in (0_u32..).zip(&mut self.units) {
            let is_in = |mask: u8| mask >> number & 1 == 1;
            if is_in(rescaled) {
                unit.rescale(&mut self.dictionary);
            }
            let (drive, touch_probe, mut context) = unit.split(&self.dictionary);
            if is_in(rescaled) {
                drive.handle_units(&mut context);
            }
            if is_in(changed) {
                drive.handle_parameters(&mut context);
                touch_probe.update(context.parameters);
            }
            if is_in(module) && context.parameters.or(Binding::JvlCommand, 0) == jvl::RESET_LIMIT_ERROR {
                drive.reset_limit_error(&mut context);
            }
            if is_in(commanded) {
                drive.handle_controlword(&mut context);
            }
            unit.align(now);
            unit.wake(now);
        }
        self.publish();
    }

    /// Runs the raster steps that are due at `now`. An axis that is further behind than 20 ms loses the rest.
    pub fn advance(&mut self, now: Instant) {
        let mut has_stepped = false;
        for unit in &mut self.units {
            let period = Duration::from_nanos(unit.axis.period().nanos());
            let mut simulated = Duration::ZERO;
            while let Some(due) = unit.next.filter(|due| *due <= now) {
                if simulated > MAX_CATCH_UP {
                    self.dropped_steps +=
                        now.saturating_since(due).as_nanos() as u64 / unit.axis.period().nanos() + 1;
                    unit.next = Some(now + period);
                    break;
                }
                simulated += period;
                unit.axis.step();
                unit.stepped = due;
                let (drive, touch_probe, mut context) = unit.split(&self.dictionary);
                touch_probe.step(context.parameters, context.axis.status());
                drive.step(&mut context);
                unit.next = (!unit.axis.is_quiet()).then(|| due + period);
                has_stepped = true;
            }
        }
        if has_stepped {
            self.publish();
        }
    }

    /// When [`Device::advance`] is due next; none while all axes are off and at rest.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.units.iter().filter_map(|u| u.next).min()
    }

    /// The next thing to tell.
    pub fn poll_event(&mut self) -> Option<DeviceEvent> {
        self.events.pop_front()
    }

    /// Back to power-on, as NMT reset node demands: default values, power off. The axes keep their places and
    /// coast.
    pub fn reset(&mut self, now: Instant) {
        self.dictionary.reset();
        self.events.clear();
        for unit in &mut self.units {
            unit.reset(&self.profile);
            unit.read_units(&self.dictionary);
            let (drive, _, mut context) = unit.split(&self.dictionary);
            drive.handle_parameters(&mut context);
            unit.wake(now);
        }
        self.publish();
    }

    /// Ramps every axis down and switches it off; no command is obeyed any more. Done when
    /// [`Device::is_quiet`].
    pub fn shut_down(&mut self, now: Instant) {
        for unit in &mut self.units {
            let (drive, _, mut context) = unit.split(&self.dictionary);
            drive.shut_down(&mut context);
            unit.wake(now);
        }
        self.publish();
    }

    /// Lets every axis react to the loss of its master, as its 0x6007 says.
    pub fn connection_lost(&mut self, now: Instant) {
        for unit in &mut self.units {
            let (drive, _, mut context) = unit.split(&self.dictionary);
            drive.connection_lost(&mut context);
            unit.wake(now);
        }
        self.publish();
    }

    /// The simulated plant behind an axis, to change it or to break something; it acts with the next raster step,
    /// which is due after `now`.
    pub fn plant(&mut self, axis: usize, now: Instant) -> Option<&mut Plant> {
        let unit = self.units.get_mut(axis)?;
        unit.schedule(now);
        unit.axis.plant()
    }

    /// Puts a voltage on the analogue input of an axis, if there is such an axis.
    pub fn set_analog_input(&mut self, axis: usize, voltage: Voltage) {
        if let Some(unit) = self.units.get_mut(axis) {
            unit.analog_input = voltage;
            self.publish();
        }
    }

    /// Whether all axes are off and at rest.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        self.units.iter().all(|u| u.axis.is_quiet())
    }

    /// Raster steps that were lost because the device was called too late.
    #[must_use]
    pub fn dropped_steps(&self) -> u64 {
        self.dropped_steps
    }

    /// The axes, for display.
    pub fn axes(&self) -> impl Iterator<Item = AxisStatus> {
        self.units.iter().map(|unit| {
            let parameters =
                Parameters { dictionary: &self.dictionary, slots: &unit.slots, units: &unit.units };
            AxisStatus {
                state: unit.drive.state(),
                mode: unit.drive.mode(),
                statusword: unit.drive.statusword(View { parameters, axis: &unit.axis }),
                position: unit.axis.status().actual.position,
                velocity: unit.axis.status().actual.velocity,
                fault: unit.drive.fault(),
                outputs: unit.outputs(parameters),
            }
        })
    }

    fn publish(&mut self) {
        for unit in &mut self.units {
            unit.publish(&mut self.dictionary, self.profile.dialect);
        }
        for number in 0..self.units.len() {
            self.tell_fault(number);
        }
    }

    /// Tells that the fault of an axis has come or gone. One with the same code on another axis stands on.
    fn tell_fault(&mut self, number: usize) {
        let has_several = self.units.len() > 1;
        let Some(unit) = self.units.get_mut(number) else { return };
        let axis = if has_several { number as u8 + 1 } else { 0 };
        let fault = unit.drive.fault().map(|fault| fault.on_axis(axis));
        let shown = core::mem::replace(&mut unit.shown_fault, fault);
        if shown == fault {
            return;
        }
        let stands = |code: u16| self.units.iter().any(|u| u.shown_fault.is_some_and(|f| f.code == code));
        let gone = shown.map(|f| f.code).filter(|code| !stands(*code));
        self.events.extend(gone.map(DeviceEvent::Cleared));
        self.events.extend(fault.map(DeviceEvent::Raised));
    }
}

impl Unit {
    fn new(
        profile: &Profile,
        motor: &Motor,
        servo: ServoConfig,
        schema: &Schema,
        axis: u8,
        now: Instant,
    ) -> Self {
        let period = Period::from_nanos(motor.raster_ns).unwrap_or(Period::MILLISECOND);
        let drive = SimulatedServo::new(period, servo);
        Self {
            slots: Slots::new(schema, &profile.bindings, axis),
            units: Units::default(),
            position_factor: PositionFactor::default(),
            dialect: profile.dialect,
            motor: motor.clone(),
            axis: Axis::new(period, crate::cia402::limits_of(motor), Box::new(drive)),
            drive: Drive402::new(profile.dialect),
            is_referenced: false,
            touch_probe: TouchProbe::default(),
            analog_input: Voltage(0.0),
            stepped: now,
            next: Some(now + Duration::from_nanos(period.nanos())),
            alignment: Alignment::default(),
            written: SetPoints::empty(),
            shown_fault: None,
        }
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
            written: self.written,
            dialect: self.dialect,
            mode,
            is_referenced: &mut self.is_referenced,
        };
        (&mut self.drive, &mut self.touch_probe, context)
    }

    /// Takes the set-points for acted on, and moves the raster if the mode takes them cycle by cycle.
    fn align(&mut self, now: Instant) {
        let written = core::mem::take(&mut self.written);
        if written.intersects(self.drive.cyclic()) {
            let period = Duration::from_nanos(self.axis.period().nanos());
            self.next = self.next.map(|next| self.alignment.align(next, now, period));
        }
    }

    /// Notes that a factor was written.
    fn note_factor(&mut self, binding: Binding) {
        self.position_factor.is_due |= factors::makes_position_factor(binding);
        self.position_factor.is_given |= factors::is_position_factor(binding);
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
        self.units = Units::read(self.dialect, |binding| self.slots.integer(dictionary, binding));
    }

    /// Schedules the next step if the axis may do anything.
    fn wake(&mut self, now: Instant) {
        if !self.axis.is_quiet() {
            self.schedule(now);
        }
    }

    /// Schedules the next step. An axis that has slept meanwhile has cooled down.
    fn schedule(&mut self, now: Instant) {
        if self.next.is_none() {
            self.axis.rest(now.saturating_since(self.stepped).as_secs_f64());
            self.next = Some(now + Duration::from_nanos(self.axis.period().nanos()));
        }
    }

    fn reset(&mut self, profile: &Profile) {
        self.axis.power_off();
        self.axis.reset_fault();
        self.drive = Drive402::new(profile.dialect);
        self.is_referenced = false;
        self.touch_probe = TouchProbe::default();
        self.shown_fault = None;
    }

    /// Shows the state of the axis in the dictionary.
    fn publish(&self, dictionary: &mut Dictionary, dialect: Dialect) {
        let status = self.axis.status();
        let parameters = Parameters { dictionary, slots: &self.slots, units: &self.units };
        let statusword = self.drive.statusword(View { parameters, axis: &self.axis });
        let position = self.units.shown_position(status.actual.position);
        let velocity = self.units.shown_velocity(status.actual.velocity);
        let rpm = RpmUnits::of(parameters, &self.motor);
        let motor_status = self.motor_status(statusword);
        let inputs = jvl::inputs(parameters, &status.inputs);
        if !dictionary.has_written() {
            // Without the bits that the drive has taken back.
            self.slots.show(dictionary, Binding::Controlword, i64::from(self.drive.controlword().bits()));
        }
        let shown = |position| self.units.shown_position(position);
        self.touch_probe.show(dictionary, &self.slots, shown);
        let mut show = |binding, value| self.slots.show(dictionary, binding, value);
        show(Binding::Statusword, i64::from(statusword.bits()));
        show(Binding::ModesOfOperationDisplay, self.drive.mode() as i64);
        show(Binding::ErrorCode, self.drive.fault().map_or(0, |f| i64::from(f.code)));
        show(Binding::VlVelocityDemand, rpm.shown(status.demand.velocity));
        show(Binding::VlVelocityActual, rpm.shown(status.actual.velocity));
        show(Binding::PositionDemandInternal, units::counter(status.demand.position));
        show(Binding::PositionDemand, self.units.shown_position(status.demand.position));
        show(Binding::PositionActual, position);
        show(Binding::FollowingErrorActual, self.units.shown_way(status.following_error));
        show(Binding::VelocityDemand, self.units.shown_velocity(status.demand.velocity));
        show(Binding::VelocitySensorActual, velocity);
        show(Binding::VelocityActual, velocity);
        show(Binding::TorqueDemand, self.units.shown_torque(self.axis.torque_demand()));
        show(Binding::InterpolationBufferPosition, self.drive.waiting_records() as i64);
        show(Binding::TorqueActual, self.units.shown_torque(status.actual.torque));
        show(Binding::DigitalInputs, i64::from(inputs_outputs::digital_inputs(status.switches)));
        if dialect == Dialect::Jvl {
            show(Binding::JvlMotorStatus, i64::from(motor_status.bits()));
            show(Binding::JvlInputs, i64::from(inputs));
            show(Binding::JvlAnalogInput, i64::from(jvl::analog_input(self.analog_input)));
            show(Binding::JvlPIst, units::counter(status.actual.position));
            show(Binding::JvlVIst, units::whole(per_sample(status.actual.velocity, self.axis.period())));
        }
    }
}

impl Unit {
    /// What the digital outputs give.
    fn outputs(&self, parameters: Parameters<'_>) -> u32 {
        let standard = inputs_outputs::digital_outputs(parameters);
        match self.dialect {
            Dialect::Cia402 => standard,
            Dialect::Jvl => {
                let statusword = self.drive.statusword(View { parameters, axis: &self.axis });
                jvl::outputs(parameters, standard, self.motor_status(statusword))
            }
        }
    }

    fn motor_status(&self, statusword: Statusword) -> jvl::MotorStatus {
        jvl::motor_status(self.drive.state(), self.drive.fault(), statusword, self.axis.status())
    }
}

/// Counts per raster step, the motor's own unit of velocity.
fn per_sample(velocity: Velocity, period: Period) -> f64 {
    velocity.0 * period.seconds()
}
