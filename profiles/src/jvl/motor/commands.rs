//! What registers and commands do at the moment they are written.

use axis::Position;

use super::errors::{Errors, Flags};
use super::groups::{self, Relative};
use super::hwi::Copy;
use super::sample::ControlBits;
use super::{MacMotor, Mode, Sample};
use crate::jvl::fastmac::FastMac;
use crate::jvl::groups::Group;
use crate::jvl::units::{Family, MacUnits};
use crate::vendor::Wish;
use crate::{Role, Space};

/// Numbers in the motor's command register that are no FastMac command.
const RESET: u32 = 1;
const SAVE_AND_RESET: u32 = 2;

impl MacMotor {
    /// Acts on the register with this role, which a bus has written.
    pub(super) fn handle_written(&mut self, role: Role, sample: &mut Sample<'_, '_>) {
        let value = sample.register(role);
        match role {
            Role::ModeReg => {
                if let Some(mode) = Mode::from_number(value) {
                    self.set_mode(mode, sample);
                }
            }
            Role::PSoll => {
                if let Some(active) = &mut self.active {
                    active.retarget(sample);
                }
            }
            Role::PIst => self.set_position(Position(f64::from(value)), sample),
            Role::PFnc => self.set_function_position(value, sample),
            Role::ErrStat => self.handle_status(value, sample),
            Role::CntrlBits => self.handle_control_bits(value, sample),
            Role::XregAddr => exchange_extended(value, sample),
            Role::Command => {
                sample.set(Role::Command, 0);
                self.obey(value.cast_unsigned(), sample);
            }
            _ => {
                if let Some(group) = Group::ACTIVATED.into_iter().find(|group| group.selector() == Some(role))
                {
                    groups::select(sample, group);
                }
            }
        }
    }

    /// Carries out a number in the command register.
    pub(super) fn obey(&mut self, number: u32, sample: &mut Sample<'_, '_>) {
        match number {
            RESET => Wish::Reset.join(&mut self.wishes),
            SAVE_AND_RESET => {
                Wish::Store { space: Space::Motor, then_reset: true }.join(&mut self.wishes);
            }
            128..=255 => {
                if let Some(command) = FastMac::from_number(number as u8) {
                    self.execute(command, sample);
                }
            }
            _ => {}
        }
    }

    /// Carries out a FastMac command (JVL Ethernet manual, section 8.2.12).
    pub(super) fn execute(&mut self, command: FastMac, sample: &mut Sample<'_, '_>) {
        match command {
            FastMac::None => {}
            FastMac::ResetErrors => self.reset_errors(sample),
            FastMac::ZeroPSoll => self.set_target(0, sample),
            FastMac::ZeroPIst => self.set_position(Position(0.0), sample),
            FastMac::ZeroPFnc => self.set_function_position(0, sample),
            FastMac::ZeroVSoll => sample.set(Role::VSoll, 0),
            FastMac::ZeroTSoll => sample.set(Role::TSoll, 0),
            FastMac::ResetFlags => self.reset_flags(),
            // P_FNC = (FLWERR - P7) * 16 puts the actual position at -P7.
            FastMac::BackBy(distance) => {
                let way = f64::from(sample.register(distance.role()));
                self.set_position(Position(-way), sample);
            }
            FastMac::Activate(number) => self.activate(u32::from(number) + 1, sample),
            FastMac::ZeroSearch => {
                if let Some(mode) = sample.commanded_search() {
                    self.set_mode(mode, sample);
                }
            }
            FastMac::MoveBy(distance) => self.move_by(distance.role(), sample),
            FastMac::Absolute => self.set_relative(Relative::No, sample),
            FastMac::RelativePSoll => self.set_relative(Relative::PSoll, sample),
            FastMac::RelativePFnc => self.set_relative(Relative::PFnc, sample),
            FastMac::SyncAbsolute => self.synchronise(false, sample),
            FastMac::SyncRelative => self.synchronise(true, sample),
        }
    }

    /// Lets the hardware-input functions copy, in their order.
    pub(super) fn follow_inputs(&mut self, sample: &mut Sample<'_, '_>) {
        self.follows_inputs = false;
        for role in Role::INPUT_FUNCTIONS {
            let function = sample.register(role);
            if function == 0 {
                continue;
            }
            self.follows_inputs = true;
            match Copy::of(function, sample.inputs()) {
                Copy::None => {}
                Copy::FromGroup(Group::Mode, number) => {
                    let mode = Group::Mode.register(number).map(|role| sample.register(role));
                    if let Some(mode) = mode.and_then(Mode::from_number) {
                        self.set_mode(mode, sample);
                    }
                }
                Copy::FromGroup(group, number) => {
                    groups::copy(sample, group, number);
                }
                Copy::Register { from, to } => self.copy_register(from, to, sample),
            }
        }
    }

    /// Copies any register to any other. One that acts when it is written does so when its value changes.
    fn copy_register(&mut self, from: u16, to: u16, sample: &mut Sample<'_, '_>) {
        let scope = &mut *sample.scope;
        let read = |number| scope.registers.read_number(scope.dictionary, number);
        let (Some(value), Some(before)) = (read(from), read(to)) else { return };
        if value == before {
            return;
        }
        let role = scope.registers.role_of_number(to);
        scope.registers.show_number(scope.dictionary, to, value);
        // A search of inputs may not make the motor forget or restart itself in each sample.
        if let Some(role) = role.filter(|role| *role != Role::Command) {
            self.handle_written(role, sample);
        }
    }

    /// Activates the registers number `number` of all groups.
    fn activate(&mut self, number: u32, sample: &mut Sample<'_, '_>) {
        for group in Group::ACTIVATED {
            if group == Group::Position {
                let Some(role) = group.register(number) else { continue };
                let distance = groups::activate_place(sample, role);
                if let Some(active) = &mut self.active {
                    match sample.relative {
                        Relative::PFnc => active.extend(distance),
                        Relative::No | Relative::PSoll => active.retarget(sample),
                    }
                }
            } else {
                groups::copy(sample, group, number);
            }
        }
    }

    /// P_SOLL = P_IST + P7; the large motors take FLWERR off.
    fn move_by(&mut self, distance: Role, sample: &mut Sample<'_, '_>) {
        let status = sample.axis().status();
        let actual = MacUnits::counter(status.actual.position);
        let error = match self.family {
            Family::Small => 0,
            Family::Large => MacUnits::counter(status.following_error),
        };
        let target = actual.wrapping_add(sample.register(distance)).wrapping_sub(error);
        self.set_target(target, sample);
    }

    /// P_SOLL as if a bus had written it.
    fn set_target(&mut self, value: i32, sample: &mut Sample<'_, '_>) {
        sample.set(Role::PSoll, value);
        self.handle_written(Role::PSoll, sample);
    }

    /// The function position, which is the demand, is called so. The actual position is as far from it as before.
    fn set_function_position(&mut self, value: i32, sample: &mut Sample<'_, '_>) {
        let error = sample.axis().status().following_error;
        self.set_position(MacUnits::of_function_position(value) - error, sample);
    }

    /// P_NEW becomes, or is added to, the present place and P_SOLL.
    fn synchronise(&mut self, is_relative: bool, sample: &mut Sample<'_, '_>) {
        let new = sample.register(Role::PNew);
        let actual = sample.axis().status().actual.position;
        let (place, target) = if is_relative {
            (actual + Position(f64::from(new)), sample.register(Role::PSoll).wrapping_add(new))
        } else {
            (Position(f64::from(new)), new)
        };
        sample.set(Role::PSoll, target);
        self.set_position(place, sample);
    }

    fn set_relative(&mut self, relative: Relative, sample: &mut Sample<'_, '_>) {
        self.relative = relative;
        if self.family == Family::Large {
            let control = ControlBits::of(self.family);
            let bits = sample.register(Role::CntrlBits) & !(control.relative_p_soll | control.relative_p_fnc);
            let set = match relative {
                Relative::No => 0,
                Relative::PSoll => control.relative_p_soll,
                Relative::PFnc => control.relative_p_fnc,
            };
            sample.set(Role::CntrlBits, bits | set);
        }
        sample.relative = relative;
    }

    fn reset_flags(&mut self) {
        self.samples_inside = 0;
        self.flags -= Flags::IN_POSITION | Flags::ACCELERATING | Flags::DECELERATING;
    }

    /// ERR_STAT was written: errors whose bits are zero are cleared, none is set. Bits 30 and 31 of the large motors are
    /// outputs. On the small motors it also says what
    /// position registers are, and whether the position limits are off.
    fn handle_status(&mut self, value: i32, sample: &mut Sample<'_, '_>) {
        let flags = Flags::from_status(value, self.family);
        if !flags.contains(Flags::IN_POSITION) {
            self.samples_inside = 0;
        }
        self.has_limits_off = flags.contains(Flags::LIMITS_OFF);
        self.outputs = flags & (Flags::OUTPUT_1 | Flags::OUTPUT_2);
        if self.family == Family::Small {
            let relative = if flags.contains(Flags::RELATIVE_P_SOLL) {
                Relative::PSoll
            } else if flags.contains(Flags::RELATIVE_P_FNC) {
                Relative::PFnc
            } else {
                Relative::No
            };
            self.set_relative(relative, sample);
        }
        self.errors &= Errors::from_status(value, self.family);
        if self.errors.is_empty() {
            self.reset_errors(sample);
        }
    }

    /// CNTRL_BITS were written: "synchronise now" is done and taken back.
    fn handle_control_bits(&mut self, value: i32, sample: &mut Sample<'_, '_>) {
        let control = ControlBits::of(self.family);
        if value & control.sync_now != 0 {
            self.synchronise(value & control.sync_relative != 0, sample);
            sample.set(Role::CntrlBits, value & !control.sync_now);
        }
    }
}

/// XREG_ADDR was written: XREG_DATA goes to the extended register of a positive number, and is that of a negative one.
fn exchange_extended(number: i32, sample: &mut Sample<'_, '_>) {
    // Extended register n is register n + 255 (JVL Ethernet manual, section 3.4.11).
    const BEFORE: u32 = 255;
    let scope = &mut *sample.scope;
    let register = u16::try_from(number.unsigned_abs().saturating_add(BEFORE)).unwrap_or(u16::MAX);
    if number > 0 {
        let data = scope.register(Role::XregData);
        scope.registers.show_number(scope.dictionary, register, data);
    } else if number < 0
        && let Some(data) = scope.registers.read_number(scope.dictionary, register)
    {
        scope.show_register(Role::XregData, data);
    }
    scope.show_register(Role::XregAddr, 0);
}
