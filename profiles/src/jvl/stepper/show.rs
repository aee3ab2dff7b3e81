//! What a MIS stepper shows of itself in its registers.

use axis::Velocity;

use super::{Active, Flags, MisMotor, Mode, Sample, pins, units};
use crate::jvl::objects::OBJECTS;
use crate::jvl::scope::is_shown_as_velocity;
use crate::{Binding, Role};

/// The time in which EXT_ENCODER_VEL counts, in seconds.
const EXTERNAL_SECONDS: f64 = 0.016;

impl MisMotor {
    /// Shows the registers. Those that a bus may write are left alone while it has written something that nobody has
    /// looked at yet.
    pub(super) fn show_registers(&mut self, sample: &mut Sample<'_, '_>) {
        let standard = sample.scope.parameters().or(Binding::DigitalOutputs, 0);
        let mask = sample.scope.parameters().or(Binding::DigitalOutputsMask, 0);
        let (in_position, has_error) = (self.flags.contains(Flags::IN_POSITION), !self.errors.is_empty());
        self.outputs = pins::outputs(in_position, has_error, (standard & mask) as u32, sample);
        self.show_measured(sample);
        if sample.scope.dictionary.has_written() {
            return;
        }
        let p_ist = self.counters.p_ist(sample);
        let encoder = self.encoder_pos(sample);
        let mode = self.shown_mode(sample).number();
        let errors = self.errors.shown();
        let warnings = self.shown_warnings(sample);
        sample.set(Role::ModeReg, mode);
        sample.set(Role::PIst, sample.counter(p_ist));
        sample.set(Role::EncoderPos, encoder);
        sample.set(Role::ExtEncoder, self.counters.external());
        sample.set(Role::ErrStat, errors);
        sample.set(Role::WarnBits, warnings);
        for (role, binding, mask) in OBJECTS {
            if let Some(value) = sample.scope.parameters().get(binding) {
                sample.set(role, (value & mask) as i32);
            }
        }
    }

    /// The registers that no bus writes.
    fn show_measured(&self, sample: &mut Sample<'_, '_>) {
        let status = *sample.axis().status();
        let error = sample.units.counter(self.counters.following_error(sample));
        let flags = self.shown_flags(sample);
        let Velocity(external) = sample.external_velocity();
        sample.set(Role::VIst, sample.units.shown_velocity(status.actual.velocity));
        sample.set(Role::Flwerr, error);
        sample.set(Role::StatusBits, flags);
        sample.set(Role::Inputs, i32::from(self.pins.inputs()));
        sample.set(Role::Temp, units::temperature(status.temperature));
        sample.set(Role::Busvol, units::bus_voltage(status.voltage));
        sample.set(Role::ExtEncoderVel, units::whole32(external * EXTERNAL_SECONDS));
        sample.set(Role::Ticks, self.counters.ticks());
        if sample.stepper.has_encoder {
            let place = sample.scope.single_turn(status.actual.position);
            sample.set(Role::AbsEncPos, place);
        }
        for (role, value) in Role::ANALOG_INPUTS.into_iter().zip(pins::analog_inputs(sample)) {
            sample.set(role, value);
        }
    }

    fn encoder_pos(&self, sample: &Sample<'_, '_>) -> i32 {
        if sample.stepper.has_encoder { sample.counter(self.counters.encoder(sample)) } else { 0 }
    }

    /// MODE_REG: that of the registers, or what the CiA 402 drive does while it operates.
    fn shown_mode(&self, sample: &Sample<'_, '_>) -> Mode {
        match &self.active {
            Some(Active::Rest { .. }) => Mode::Velocity,
            Some(active) => active.mode().unwrap_or_default(),
            None if !sample.scope.drive.operates() => Mode::Passive,
            None if is_shown_as_velocity(sample.scope.drive.mode()) => Mode::Velocity,
            None => Mode::Position,
        }
    }
}
