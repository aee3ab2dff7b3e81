//! What a device speaks beside CiA 402: the vocabulary of its vendor, one for each axis.
//!
//! Every vocabulary has the same verbs. It works with the axis and the CiA 402 drive of its unit through a [`Scope`].

use axis::{Axis, Voltage};
use od::{Dictionary, Slot};

use crate::cia402::units::Units;
use crate::cia402::{Context, Drive402, SetPoints, View};
use crate::slots::{Parameters, Slots};
use crate::{Binding, Dialect, Motor, RegisterFile, Role, jvl};

/// The vocabulary of one axis.
#[derive(Debug)]
pub(crate) enum Vendor {
    /// CiA 402 and nothing else.
    None,
    /// JVL's modules and motors.
    Jvl(jvl::Module),
}

/// What a vocabulary works with.
pub(crate) struct Scope<'a> {
    pub(crate) dictionary: &'a mut Dictionary,
    pub(crate) slots: &'a Slots,
    pub(crate) registers: &'a RegisterFile,
    pub(crate) units: &'a Units,
    pub(crate) axis: &'a mut Axis,
    pub(crate) drive: &'a mut Drive402,
    pub(crate) motor: &'a Motor,
    pub(crate) dialect: Dialect,
    /// The axis knows its home position.
    pub(crate) is_referenced: &'a mut bool,
    /// At the analogue input of the motor.
    pub(crate) analog_input: Voltage,
}

impl Scope<'_> {
    pub(crate) fn parameters(&self) -> Parameters<'_> {
        Parameters { dictionary: self.dictionary, slots: self.slots, units: self.units }
    }

    pub(crate) fn view(&self) -> View<'_> {
        View { parameters: self.parameters(), axis: self.axis }
    }

    /// The CiA 402 drive, and what it works with.
    pub(crate) fn drive(&mut self) -> (&mut Drive402, Context<'_>) {
        let mode = self.drive.mode();
        let context = Context {
            parameters: Parameters { dictionary: self.dictionary, slots: self.slots, units: self.units },
            axis: self.axis,
            motor: self.motor,
            written: SetPoints::empty(),
            dialect: self.dialect,
            is_referenced: self.is_referenced,
            mode,
        };
        (self.drive, context)
    }

    /// Shows `value` at `binding`, if this device has it.
    pub(crate) fn show(&mut self, binding: Binding, value: i64) {
        self.slots.show(self.dictionary, binding, value);
    }

    /// Shows `value` in the register with this role, if this device has it.
    pub(crate) fn show_register(&mut self, role: Role, value: i32) {
        self.registers.show(self.dictionary, role, value);
    }
}

impl Vendor {
    pub(crate) fn new(dialect: Dialect) -> Self {
        match dialect {
            Dialect::Cia402 => Self::None,
            Dialect::Jvl => Self::Jvl(jvl::Module::default()),
        }
    }

    /// Notes that a bus has written the entry at `slot`, which is bound to `binding`; whether that is for this
    /// vocabulary alone.
    pub(crate) fn note(&mut self, _slot: Slot, binding: Binding) -> bool {
        match self {
            Self::None => false,
            Self::Jvl(module) => module.note(binding),
        }
    }

    /// Acts on what was noted.
    pub(crate) fn act(&mut self, scope: &mut Scope<'_>) {
        match self {
            Self::None => {}
            Self::Jvl(module) => module.act(scope),
        }
    }

    /// Follows the axis after a raster step.
    pub(crate) fn step(&mut self, _scope: &mut Scope<'_>) {
        match self {
            Self::None | Self::Jvl(_) => {}
        }
    }

    /// Shows the state of the axis in the vendor's words.
    pub(crate) fn show(&mut self, scope: &mut Scope<'_>) {
        match self {
            Self::None => {}
            Self::Jvl(module) => module.show(scope),
        }
    }

    /// What the digital outputs give, `standard` being what 0x60FE says.
    pub(crate) fn outputs(&self, drive: &Drive402, view: View<'_>, standard: u32) -> u32 {
        match self {
            Self::None => standard,
            Self::Jvl(_) => jvl::outputs(drive, view, standard),
        }
    }
}
