//! A device: one object dictionary and the axes behind it.

mod card;
mod plant;
mod storage;
mod unit;

use std::collections::VecDeque;
use std::sync::Arc;

use axis::{Plant, PlantConfig, Position, Velocity, Voltage};
use od::{Dictionary, Instant, SlotTable};

use crate::cia402::{Fault, Mode, State, Statusword};
use crate::mac4::Card;
use crate::register::WrittenRegister;
use crate::simulated::Simulated;
use crate::{Binding, Dialect, PlantSetup, Profile, Space};

use storage::Storing;
use unit::Unit;

pub use plant::NoPlant;
pub use storage::{Keep, StoreOrder};

/// What the buses of a device are to tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceEvent {
    /// A fault has come.
    Raised(Fault),
    /// The fault with this error code is gone.
    Cleared(u16),
    /// The device itself wants its power-on values changed; [`Device::stored`] tells it what became of that.
    Store(StoreOrder),
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
    /// What entries are bound to, of which axis.
    bound: SlotTable<(u8, Binding)>,
    units: Vec<Unit>,
    /// What the axes of a MAC4 card share.
    card: Option<Card>,
    events: VecDeque<DeviceEvent>,
    /// What is being stored on the device's own order.
    storing: Option<Storing>,
    dropped_steps: u64,
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
        let mut device =
            Self::arranged(profile, node_id, now, |_, config| *config = plant.apply(config.clone()));
        for axis in 0..device.units.len() {
            if let Some(voltage) = plant.analog_input {
                device.set_analog_input(axis, voltage, now);
            }
            if let Some(velocity) = plant.external_encoder {
                device.set_external_encoder(axis, velocity, now);
            }
        }
        device
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
        let bound = profile.bindings.iter();
        let bound = bound.filter_map(|b| Some((schema.slot(b.address)?, (b.axis, b.binding)))).collect();
        let axes = profile.motor.iter().flat_map(|motor| (0..profile.axes()).map(move |axis| (axis, motor)));
        let unit = |(axis, motor)| {
            let mut drive = Simulated::of(motor, profile.dialect);
            arrange(axis, drive.plant());
            Unit::new(&profile, motor, drive, &schema, axis, now)
        };
        let units = axes.map(unit).collect();
        let dictionary = Dictionary::new(schema, node_id);
        let card = match profile.dialect {
            Dialect::Cia402 | Dialect::Jvl => None,
            Dialect::Mac4(_) => Some(Card::default()),
        };
        let mut device = Self {
            profile,
            dictionary,
            bound,
            units,
            card,
            events: VecDeque::new(),
            storing: None,
            dropped_steps: 0,
        };
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
        if self.dictionary.has_written() {
            self.confirm();
        }
        let mut passed = 0;
        while let Some(slot) = self.dictionary.take_written() {
            let register = self.profile.registers.normalise(&mut self.dictionary, slot);
            if let Some(WrittenRegister { space, role }) = register
                && let Some(unit) = self.units.first_mut()
            {
                passed += u32::from(space == Space::Motor);
                if let Some(role) = role.filter(|role| unit.vendor.note_register(*role)) {
                    unit.note_register(role, &mut self.dictionary);
                }
            }
            let Some((axis, binding)) = self.bound.get(slot) else { continue };
            if binding == Binding::Mac4Card {
                let address = self.dictionary.schema().address(slot);
                address.into_iter().for_each(|address| self.note_card(address));
            } else if let Some(unit) = self.units.get_mut(usize::from(axis)) {
                unit.note(slot, binding);
            }
        }
        if let Some(unit) = self.units.first_mut().filter(|_| passed > 0) {
            unit.pass(passed, &mut self.dictionary);
        }
        let mut has_acted = false;
        for unit in &mut self.units {
            has_acted |= unit.act(&mut self.dictionary, now);
        }
        has_acted |= self.act_card(now);
        if has_acted {
            self.grant_wishes(now);
            self.publish();
        }
    }

    /// Runs the raster steps that are due at `now`. An axis that is further behind than 20 ms loses the rest.
    pub fn advance(&mut self, now: Instant) {
        let mut has_stepped = false;
        for unit in &mut self.units {
            let advanced = unit.advance(&mut self.dictionary, now);
            self.dropped_steps += advanced.dropped;
            has_stepped |= advanced.has_stepped;
        }
        self.watch_card(now);
        if has_stepped {
            self.grant_wishes(now);
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
        self.profile.registers.refresh(&mut self.dictionary);
        self.events.clear();
        self.card = self.card.take().map(|_| Card::default());
        for unit in &mut self.units {
            unit.reset(&mut self.dictionary, now);
        }
        self.publish();
    }

    /// Ramps every axis down and switches it off; no command is obeyed any more. Done when
    /// [`Device::is_quiet`].
    pub fn shut_down(&mut self, now: Instant) {
        for unit in &mut self.units {
            unit.shut_down(&mut self.dictionary, now);
        }
        self.publish();
    }

    /// Cuts the power of axes that do not come to rest after [`Device::shut_down`], for good: they coast.
    pub fn cut_power(&mut self, now: Instant) {
        for unit in self.units.iter_mut().filter(|unit| !unit.axis.is_quiet()) {
            unit.cut_power(&mut self.dictionary, now);
        }
        self.publish();
    }

    /// Stops an axis, by number from 0, that runs by the words of its vendor: it brakes and holds. Whether it did run by
    /// them; a drive of CiA 402 is stopped by its controlword.
    pub fn halt(&mut self, now: Instant, axis: usize) -> bool {
        let Some(unit) = self.units.get_mut(axis) else { return false };
        let is_halted = unit.halt(&mut self.dictionary, now);
        if is_halted {
            self.publish();
        }
        is_halted
    }

    /// Lets every axis react to the loss of its master, as its 0x6007 says.
    pub fn connection_lost(&mut self, now: Instant) {
        for unit in &mut self.units {
            unit.connection_lost(&mut self.dictionary, now);
        }
        self.publish();
    }

    /// Notes that PDOs come faster than the device processes them, or that none waits any more.
    pub fn set_overflow(&mut self, has_overflowed: bool) {
        self.units.iter_mut().for_each(|unit| unit.vendor.set_overflow(has_overflowed));
        self.publish();
    }

    /// Lets every axis react to the silence of all Modbus clients: as JVL's module is set up, or as its 0x6007 says.
    pub fn modbus_lost(&mut self, now: Instant) {
        for unit in &mut self.units {
            unit.modbus_lost(&mut self.dictionary, now);
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
    pub fn set_analog_input(&mut self, axis: usize, voltage: Voltage, now: Instant) {
        if let Some(unit) = self.units.get_mut(axis) {
            unit.analog_input = voltage;
            unit.handle_signals(&mut self.dictionary, now);
            self.publish();
        }
    }

    /// Lets the encoder that gear modes of an axis follow turn at `velocity`, if there is such an axis.
    pub fn set_external_encoder(&mut self, axis: usize, velocity: Velocity, now: Instant) {
        if let Some(unit) = self.units.get_mut(axis) {
            unit.external_encoder = velocity;
            unit.handle_signals(&mut self.dictionary, now);
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
        self.units.iter().map(|unit| unit.status(&self.dictionary))
    }

    fn publish(&mut self) {
        self.show_card();
        for unit in &mut self.units {
            unit.publish(&mut self.dictionary);
        }
        for number in 0..self.units.len() {
            self.tell_fault(number);
            self.tell_error(number);
        }
    }

    /// Tells that an error of the vendor's vocabulary has come or gone.
    fn tell_error(&mut self, number: usize) {
        let Some(unit) = self.units.get_mut(number) else { return };
        let error = unit.vendor.error();
        let shown = core::mem::replace(&mut unit.shown_error, error);
        if shown != error {
            self.events.extend(shown.map(|error| DeviceEvent::Cleared(error.code)));
            self.events.extend(error.map(DeviceEvent::Raised));
        }
    }

    /// Tells that the fault of an axis has come or gone. One with the same code on another axis stands on.
    fn tell_fault(&mut self, number: usize) {
        let has_several = self.units.len() > 1;
        let Some(unit) = self.units.get_mut(number) else { return };
        let fault = unit.drive.fault().map(|fault| unit.vendor.detailed(fault));
        let fault = if has_several { fault.map(|fault| fault.on_axis(number as u8 + 1)) } else { fault };
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
