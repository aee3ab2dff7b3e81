//! What a MIS stepper does when its registers are written, and its commands (JVL Ethernet manual, sections 8.2.12 and
//! 11.4).

use axis::Position;

use super::{Active, MisMotor, Mode, Sample, units};
use crate::jvl::fastmac::FastMac;
use crate::jvl::groups::Group;
use crate::vendor::Wish;
use crate::{Binding, Role, Space};

/// Numbers in the command register from 256 on; the others do nothing here.
const SYNCHRONISE: u32 = 257;
const RESET: u32 = 267;
const SAVE_AND_RESET: u32 = 268;
const SAVE: u32 = 269;

impl MisMotor {
    /// Acts on the register with this role, which was written.
    pub(super) fn handle_written(&mut self, role: Role, sample: &mut Sample<'_, '_>) {
        let value = sample.register(role);
        match role {
            Role::ModeReg => {
                if let Some(mode) = Mode::from_number(value) {
                    self.set_mode(mode, sample);
                }
            }
            Role::PIst => self.set_p_ist(value, sample),
            Role::EncoderPos => self.counters.set_encoder(value, sample),
            Role::ExtEncoder => self.counters.set_external(value),
            Role::ErrStat => self.handle_errors(value, sample),
            Role::WarnBits => self.handle_warnings(value),
            Role::RunCurrent | Role::MinPIst | Role::MaxPIst => show_registers_in_objects(sample),
            Role::Command => {
                sample.set(Role::Command, 0);
                self.obey(value.cast_unsigned(), sample);
            }
            _ => {}
        }
    }

    /// Carries out a number in the command register.
    pub(super) fn obey(&mut self, number: u32, sample: &mut Sample<'_, '_>) {
        match number {
            SYNCHRONISE => {
                self.counters.synchronise(sample);
                self.reorder();
            }
            RESET => Wish::Reset.join(&mut self.wishes),
            SAVE_AND_RESET => self.store(true),
            SAVE => self.store(false),
            0..=127 => {
                if let Some(command) = FastMac::from_number(number as u8) {
                    self.execute(command, sample);
                }
            }
            _ => {}
        }
    }

    fn store(&mut self, then_reset: bool) {
        Wish::Store { space: Space::Motor, then_reset }.join(&mut self.wishes);
    }

    /// Carries out a FastMac command. What only MAC motors have does nothing.
    pub(super) fn execute(&mut self, command: FastMac, sample: &mut Sample<'_, '_>) {
        match command {
            FastMac::None
            | FastMac::ZeroPFnc
            | FastMac::ZeroTSoll
            | FastMac::BackBy(_)
            | FastMac::RelativePFnc => {}
            FastMac::ResetErrors => self.reset_errors(sample),
            FastMac::ZeroPSoll => sample.set(Role::PSoll, 0),
            FastMac::ZeroPIst => self.set_p_ist(0, sample),
            FastMac::ZeroVSoll => sample.set(Role::VSoll, 0),
            FastMac::ResetFlags => self.reset_flags(),
            FastMac::Activate(number) => self.activate(u32::from(number) + 1, sample),
            FastMac::ZeroSearch => self.set_mode(commanded_search(sample), sample),
            FastMac::MoveBy(distance) => {
                let place = sample.counter(self.counters.p_ist(sample));
                let target = place.wrapping_add(sample.register(distance.role()));
                sample.set(Role::PSoll, target);
            }
            FastMac::Absolute => self.is_relative = false,
            FastMac::RelativePSoll => self.is_relative = true,
            FastMac::SyncAbsolute => {
                let new = sample.register(Role::PNew);
                sample.set(Role::PSoll, new);
                self.set_p_ist(new, sample);
            }
            FastMac::SyncRelative => {
                let new = sample.register(Role::PNew);
                let target = sample.register(Role::PSoll).wrapping_add(new);
                let place = sample.counter(self.counters.p_ist(sample)).wrapping_add(new);
                sample.set(Role::PSoll, target);
                self.set_p_ist(place, sample);
            }
        }
    }

    /// Activates the registers number `number` of P, V, A and T.
    fn activate(&mut self, number: u32, sample: &mut Sample<'_, '_>) {
        for group in [Group::Position, Group::Velocity, Group::Acceleration, Group::Torque] {
            let (Some(role), Some(target)) = (group.register(number), target(group)) else { continue };
            let value = sample.register(role);
            let is_way = group == Group::Position && self.is_relative;
            let base = if is_way { sample.register(target) } else { 0 };
            sample.set(target, base.wrapping_add(value));
            self.handle_written(target, sample);
        }
    }

    fn set_p_ist(&mut self, value: i32, sample: &mut Sample<'_, '_>) {
        let before = sample.demand();
        self.counters.set_p_ist(value, sample);
        let by = sample.demand() - before;
        self.active.iter_mut().for_each(|active| active.shift(by));
        self.reorder();
    }

    /// The axis has got other numbers: its order is another one now. A search goes on.
    fn reorder(&mut self) {
        if !self.active.as_ref().is_some_and(Active::is_search) {
            self.wanted = None;
        }
    }
}

/// The set-point that a group gives.
const fn target(group: Group) -> Option<Role> {
    match group {
        Group::Position => Some(Role::PSoll),
        Group::Velocity => Some(Role::VSoll),
        Group::Acceleration => Some(Role::ASoll),
        Group::Torque => Some(Role::RunCurrent),
        Group::Load | Group::Window | Group::Mode => None,
    }
}

/// The zero search that a command starts: that of HOMEMODE, else 13.
fn commanded_search(sample: &Sample<'_, '_>) -> Mode {
    let chosen = Mode::from_number(sample.register(Role::Homemode)).filter(|mode| mode.is_search());
    chosen.unwrap_or(Mode::ForwardSearch)
}

/// Whether a register shows the object that is bound so.
pub(super) const fn is_shown(binding: Binding) -> bool {
    matches!(binding, Binding::JvlRunCurrent | Binding::MinPositionLimit | Binding::MaxPositionLimit)
}

/// Shows an object that a bus has written in its register.
pub(super) fn show_object(binding: Binding, sample: &mut Sample<'_, '_>) {
    let parameters = sample.scope.parameters();
    let value = parameters.or(binding, 0);
    let place = |value| units::counter(parameters.units.position(value, Position(0.0)));
    match binding {
        Binding::JvlRunCurrent => sample.set(Role::RunCurrent, units::current(value)),
        Binding::MinPositionLimit => {
            let shown = place(value);
            sample.set(Role::MinPIst, shown);
        }
        Binding::MaxPositionLimit => {
            let shown = place(value);
            sample.set(Role::MaxPIst, shown);
        }
        _ => {}
    }
}

/// Shows the registers that are objects in these: 0x2204 is RUN_CURRENT in mA, 0x607D are MIN_P_IST and MAX_P_IST in user
/// units.
pub(super) fn show_registers_in_objects(sample: &mut Sample<'_, '_>) {
    let scope = &mut *sample.scope;
    let place = |role| scope.units.shown_position(Position(f64::from(scope.register(role))));
    let (min, max) = (place(Role::MinPIst), place(Role::MaxPIst));
    let milliamperes = units::milliamperes(scope.register(Role::RunCurrent));
    scope.show(Binding::JvlRunCurrent, milliamperes);
    scope.show(Binding::MinPositionLimit, min);
    scope.show(Binding::MaxPositionLimit, max);
    let (_, mut context) = scope.drive();
    context.apply_limits();
}
