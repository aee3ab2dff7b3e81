//! What a device speaks beside CiA 402: the vocabulary of its vendor, one for each axis.
//!
//! Every vocabulary has the same verbs. It works with the axis and the CiA 402 drive of its unit through a [`Scope`].

use std::collections::VecDeque;

use axis::{Axis, Velocity, Voltage};
use od::{Dictionary, Schema, Slot};

use crate::cia402::units::Units;
use crate::cia402::{AbortConnection, Context, Drive402, SetPoints, View};
use crate::slots::{Parameters, Slots};
use crate::{Binding, Dialect, Fault, Motor, RegisterFile, Role, Space, jvl, mac4};

/// The vocabulary of one axis.
#[derive(Debug)]
pub(crate) enum Vendor {
    /// CiA 402 and nothing else.
    None,
    /// JVL's modules and motors.
    Jvl(jvl::Module),
    /// MACCON's axis controllers.
    Mac4(Box<mac4::Controller>),
}

/// Who moves an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Mover {
    /// The CiA 402 drive, or nobody yet.
    #[default]
    Cia402,
    /// The vocabulary, as long as CiA 402 lets it: the drive follows all that happens, leaves the power alone, and takes the
    /// axis over when it is enabled or fails. So do JVL's registers.
    Lent,
    /// The vocabulary alone: the drive looks on until that gives the axis up. So does MACCON's controller.
    Foreign,
}

impl Mover {
    /// Whether it is the vocabulary of the vendor.
    pub(crate) const fn is_vendor(self) -> bool {
        match self {
            Self::Cia402 => false,
            Self::Lent | Self::Foreign => true,
        }
    }
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
    /// Speed of the encoder that gear modes follow.
    pub(crate) external_encoder: Velocity,
    pub(crate) mover: Mover,
    /// A limit switch that is met may be an error.
    pub(crate) minds_limit_switches: bool,
}

/// What a vocabulary wants of its device. Of equal wishes that wait there is only one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wish {
    /// Keep these registers, then perhaps reset the motor.
    Store {
        /// Which.
        space: Space,
        /// Whether the motor starts anew once they are kept.
        then_reset: bool,
    },
    /// Give these registers their defaults.
    Restore(Space),
    /// Let the motor start anew with the registers it has kept.
    Reset,
    /// Let its module start anew with the registers it has kept.
    ResetModule,
}

impl Wish {
    /// Adds it to those that wait.
    pub(crate) fn join(self, waiting: &mut VecDeque<Self>) {
        if !waiting.contains(&self) {
            waiting.push_back(self);
        }
    }
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
            mover: self.mover,
            minds_limit_switches: self.minds_limit_switches,
        };
        (self.drive, context)
    }

    /// Shows `value` at `binding`, if this device has it.
    pub(crate) fn show(&mut self, binding: Binding, value: i64) {
        self.slots.show(self.dictionary, binding, value);
    }

    /// What the register with this role holds; zero if this device has none.
    pub(crate) fn register(&self, role: Role) -> i32 {
        self.registers.get(self.dictionary, role).unwrap_or(0)
    }

    /// Shows `value` in the register with this role, if this device has it.
    pub(crate) fn show_register(&mut self, role: Role, value: i32) {
        self.registers.show(self.dictionary, role, value);
    }
}

impl Vendor {
    pub(crate) fn new(dialect: Dialect, motor: &Motor, schema: &Schema, axis: u8) -> Self {
        match dialect {
            Dialect::Cia402 => Self::None,
            Dialect::Jvl => Self::Jvl(jvl::Module::new(motor)),
            Dialect::Mac4(card) => Self::Mac4(Box::new(mac4::Controller::new(card, schema, axis))),
        }
    }

    /// After power-on.
    pub(crate) fn start(&mut self, scope: &mut Scope<'_>) {
        match self {
            Self::None | Self::Jvl(_) => {}
            Self::Mac4(controller) => controller.start(scope),
        }
    }

    /// Who moves the axis.
    pub(crate) fn mover(&self) -> Mover {
        match self {
            Self::Jvl(module) if module.runs_axis() => Mover::Lent,
            Self::Mac4(controller) if controller.has_axis() => Mover::Foreign,
            Self::None | Self::Jvl(_) | Self::Mac4(_) => Mover::Cia402,
        }
    }

    /// Notes that a bus has written the entry at `slot`, which is bound to `binding`; whether that is for this
    /// vocabulary alone.
    pub(crate) fn note(&mut self, slot: Slot, binding: Binding) -> bool {
        match self {
            Self::None => false,
            Self::Jvl(module) => module.note(binding),
            Self::Mac4(controller) => {
                let is_own = binding == Binding::Mac4Instruction;
                if is_own {
                    controller.note(slot);
                }
                is_own
            }
        }
    }

    /// Notes that a bus has written the register with this role; whether there is something to do about it now.
    #[inline]
    pub(crate) fn note_register(&mut self, role: Role) -> bool {
        match self {
            Self::None | Self::Mac4(_) => true,
            Self::Jvl(module) => module.note_register(role),
        }
    }

    /// Whether the motor turns the other way round, so that positions and velocities count so.
    pub(crate) fn turns_back(&self, registers: &RegisterFile, dictionary: &Dictionary) -> bool {
        match self {
            Self::None | Self::Mac4(_) => false,
            Self::Jvl(module) => module.turns_back(registers, dictionary),
        }
    }

    /// Whether a limit switch that is met is an error for the CiA 402 drive, if its dialect says so.
    pub(crate) fn minds_limit_switches(&self) -> bool {
        match self {
            Self::None | Self::Mac4(_) => true,
            Self::Jvl(module) => module.minds_limit_switches(),
        }
    }

    /// An operator stops the axis: it brakes and holds.
    pub(crate) fn halt(&mut self, scope: &mut Scope<'_>) {
        match self {
            Self::None => {}
            Self::Jvl(module) => module.lose_master(AbortConnection::QuickStop, true, scope),
            Self::Mac4(controller) => controller.stop(scope),
        }
    }

    /// Reacts to the loss of the master; after a stop the motor `holds` or becomes passive.
    pub(crate) fn lose_master(&mut self, reaction: AbortConnection, holds: bool, scope: &mut Scope<'_>) {
        match self {
            Self::None => {}
            Self::Jvl(module) => module.lose_master(reaction, holds, scope),
            Self::Mac4(controller) => controller.lose_master(reaction, scope),
        }
    }

    /// Ramps down, switches off and obeys no more commands.
    pub(crate) fn shut_down(&mut self, scope: &mut Scope<'_>) {
        match self {
            Self::None => {}
            Self::Jvl(module) => module.shut_down(scope),
            Self::Mac4(controller) => controller.shut_down(scope),
        }
    }

    /// Whether it shows something that changes while the axis is off and at rest, such as a temperature or the time.
    pub(crate) fn is_changing(&self) -> bool {
        match self {
            Self::None | Self::Mac4(_) => false,
            Self::Jvl(module) => module.is_changing(),
        }
    }

    /// Lets time pass in which the axis slept.
    pub(crate) fn rest(&mut self, seconds: f64) {
        match self {
            Self::None | Self::Mac4(_) => {}
            Self::Jvl(module) => module.rest(seconds),
        }
    }

    /// Starts the motor anew; its registers have their power-on values.
    pub(crate) fn restart(&mut self, scope: &mut Scope<'_>) {
        match self {
            Self::None | Self::Mac4(_) => {}
            Self::Jvl(module) => module.restart(scope),
        }
    }

    /// Starts the module anew; its registers have their power-on values.
    pub(crate) fn restart_module(&mut self, scope: &mut Scope<'_>) {
        match self {
            Self::None | Self::Mac4(_) => {}
            Self::Jvl(module) => module.restart_module(scope),
        }
    }

    /// Passes so many registers on to the motor.
    pub(crate) fn pass(&mut self, registers: u32, scope: &mut Scope<'_>) {
        match self {
            Self::None | Self::Mac4(_) => {}
            Self::Jvl(module) => module.pass(registers, scope),
        }
    }

    /// Whether it waits for something while the axis may be off and at rest.
    pub(crate) fn is_settling(&self) -> bool {
        match self {
            Self::None | Self::Mac4(_) => false,
            Self::Jvl(module) => module.is_settling(),
        }
    }

    /// The next thing that the device is to do.
    pub(crate) fn poll_wish(&mut self) -> Option<Wish> {
        match self {
            Self::None | Self::Mac4(_) => None,
            Self::Jvl(module) => module.poll_wish(),
        }
    }

    /// Acts on what was noted.
    pub(crate) fn act(&mut self, scope: &mut Scope<'_>) {
        match self {
            Self::None => {}
            Self::Jvl(module) => module.act(scope),
            Self::Mac4(controller) => controller.act(scope),
        }
    }

    /// Follows the axis after a raster step.
    pub(crate) fn step(&mut self, scope: &mut Scope<'_>) {
        match self {
            Self::None => {}
            Self::Jvl(module) => module.step(scope),
            Self::Mac4(controller) => controller.step(scope),
        }
    }

    /// Notes that PDOs come too fast for the device, or that none waits any more.
    pub(crate) fn set_overflow(&mut self, has_overflowed: bool) {
        match self {
            Self::None | Self::Mac4(_) => {}
            Self::Jvl(module) => module.set_overflow(has_overflowed),
        }
    }

    /// An error that stands beside the fault of the drive.
    pub(crate) fn error(&self) -> Option<Fault> {
        match self {
            Self::None | Self::Mac4(_) => None,
            Self::Jvl(module) => module.error(),
        }
    }

    /// The fault with what the vendor has to say of it.
    pub(crate) fn detailed(&self, fault: Fault) -> Fault {
        match self {
            Self::None | Self::Mac4(_) => fault,
            Self::Jvl(module) => module.detailed(fault),
        }
    }

    /// Shows the state of the axis in the vendor's words.
    pub(crate) fn show(&mut self, scope: &mut Scope<'_>) {
        match self {
            Self::None => {}
            Self::Jvl(module) => module.show(scope),
            Self::Mac4(controller) => controller.show(scope),
        }
    }

    /// What the digital outputs give, `standard` being what 0x60FE says.
    pub(crate) fn outputs(&self, drive: &Drive402, view: View<'_>, standard: u32) -> u32 {
        match self {
            Self::None | Self::Mac4(_) => standard,
            Self::Jvl(module) => module.outputs(drive, view, standard),
        }
    }
}
