//! What a motor shows of itself in its registers.

use axis::Velocity;

use super::errors::{self, Flags};
use super::groups::Relative;
use super::{Family, MacMotor, MacUnits, Mode, Sample, modes, watch};
use crate::Role;
use crate::jvl::scope::is_shown_as_velocity;

/// The velocities of the last 16 samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Average {
    velocities: [Velocity; Self::SAMPLES],
    next: usize,
}

impl Average {
    const SAMPLES: usize = 16;

    pub(super) fn take(&mut self, velocity: Velocity) {
        if let Some(place) = self.velocities.get_mut(self.next) {
            *place = velocity;
        }
        self.next = (self.next + 1) % Self::SAMPLES;
    }

    fn mean(&self) -> Velocity {
        let sum: f64 = self.velocities.iter().map(|velocity| velocity.0).sum();
        Velocity(sum / Self::SAMPLES as f64)
    }
}

impl MacMotor {
    /// Shows the registers. Those that a bus may write are left alone while it has written something that nobody has
    /// looked at yet.
    pub(super) fn show_registers(&self, sample: &mut Sample<'_, '_>) {
        self.show_measured(sample);
        if sample.scope.dictionary.has_written() {
            return;
        }
        let status = *sample.axis().status();
        let lag = self.active.as_ref().map_or(status.following_error, |active| active.lag(sample));
        let mode = self.shown_mode(sample);
        sample.set(Role::ModeReg, mode.number());
        sample.set(Role::PIst, MacUnits::counter(status.actual.position));
        sample.set(Role::PFnc, MacUnits::function_position(status.demand.position));
        sample.set(Role::Flwerr, MacUnits::counter(status.following_error));
        sample.set(Role::Fncerr, MacUnits::counter(lag));
        sample.set(Role::VfOut, MacUnits::shown_torque(status.actual.torque));
        sample.set(Role::Aninp, sample.analog);
        let unconditioned = MacUnits::analog(sample.scope.analog_input, sample.register(Role::Aninp1Offset));
        sample.set(Role::Aninp1, unconditioned);
        let inputs = sample.inputs();
        sample.set(Role::Mac001, inputs.cast_signed());
        let shown = self.status(sample);
        sample.set(Role::ErrStat, shown);
        self.show_homed(sample);
        let fastest = sample.register(Role::VIstMax).max(sample.register(Role::VIst).saturating_abs());
        sample.set(Role::VIstMax, fastest);
    }

    /// The registers that no bus writes.
    fn show_measured(&self, sample: &mut Sample<'_, '_>) {
        let status = *sample.axis().status();
        let units = sample.units;
        sample.set(Role::VIst, units.coarse_velocity(status.actual.velocity));
        sample.set(Role::VIst16, units.fine_velocity(self.velocities.mean()));
        sample.set(Role::PQuick, MacUnits::counter(status.actual.position));
        sample.set(Role::IndexIst, sample.scope.single_turn(status.actual.position));
        let external = sample.external_encoder();
        let geared = Velocity(external.0 * modes::gear_ratio(sample));
        sample.set(Role::VExt, units.coarse_velocity(external));
        sample.set(Role::GvExt, units.coarse_velocity(geared));
        sample.set(Role::FncOut, units.coarse_velocity(status.demand.velocity));
        let i2t = self.i2t(sample).round() as i32;
        sample.set(Role::I2t, i2t);
        let uit = f64::from(sample.register(Role::Uitlim)) * self.resistor.used();
        sample.set(Role::Uit, uit.round() as i32);
        sample.set(Role::USupply, units.supply(status.voltage));
        sample.set(Role::UBus, units.supply(status.voltage));
        sample.set(Role::Degc, MacUnits::shown_temperature(status.temperature));
    }

    /// ERR_STAT.
    pub(super) fn status(&self, sample: &Sample<'_, '_>) -> i32 {
        errors::status(self.errors, self.flags(sample), self.family)
    }

    fn flags(&self, sample: &Sample<'_, '_>) -> Flags {
        let mut flags = self.flags | watch::supply_flags(sample);
        flags.set(Flags::RELATIVE_P_SOLL, self.relative == Relative::PSoll);
        flags.set(Flags::RELATIVE_P_FNC, self.relative == Relative::PFnc);
        flags.set(Flags::LIMITS_OFF, self.has_limits_off);
        flags |= self.outputs;
        flags
    }

    /// MODE_REG: that of the registers, or what the module sets while CiA 402 operates.
    fn shown_mode(&self, sample: &Sample<'_, '_>) -> Mode {
        match &self.active {
            Some(active) => active.mode(),
            None if !sample.scope.drive.operates() => self.passive,
            None if is_shown_as_velocity(sample.scope.drive.mode()) => Mode::Velocity,
            None => Mode::Position,
        }
    }

    /// Whether a zero search was completed since power-on: HOMING_DONE, or bit 16 of HOME_MODE.
    fn show_homed(&self, sample: &mut Sample<'_, '_>) {
        const HOMED: i32 = 1 << 16;
        sample.set(Role::HomingDone, i32::from(self.is_homed));
        if self.family == Family::Large {
            let rest = sample.register(Role::Homemode) & !HOMED;
            sample.set(Role::Homemode, if self.is_homed { rest | HOMED } else { rest });
        }
    }
}
