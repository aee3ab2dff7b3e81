//! What a MIS stepper watches: its errors and warnings, and how it reacts to them.

use axis::{Motion, Temperature};

use super::bits::{Errors, Flags, Setup, Warnings};
use super::{Active, MisMotor, Mode, Sample, limits, modes, reset_faults, units};
use crate::{Fault, Role};

/// Above this the temperature "has been high" (our choice, the manual prints "xx").
const WARM: Temperature = Temperature(80.0);

/// The supply is low, but no error, up to so much of MIN_BUSVOL (our choice: that of the MAC050 to 141).
const NEARLY_LOW: f64 = 1.25;

impl MisMotor {
    /// Whether the CiA 402 drive is to take a limit switch for an error. While a mode runs the axis, that is for the
    /// mode to say.
    pub(crate) fn minds_limit_switches(&self) -> bool {
        !self.runs_axis() && !self.ignores_limits
    }

    /// Looks for errors and warnings after a raster step, and whether those of before were reset.
    pub(super) fn watch(&mut self, sample: &mut Sample<'_, '_>) {
        self.ignores_limits = sample.setup().contains(Setup::NO_LIMIT_ERROR);
        if let Some(fault) = sample.axis().status().fault {
            self.errors |= Errors::of(fault);
        } else if sample.scope.drive.fault() == Some(Fault::limit_switch()) {
            self.errors |= Errors::POSITION_LIMIT;
        } else if !sample.scope.drive.has_failed() {
            self.errors = Errors::empty();
        } else if self.errors.is_empty() {
            // A fault that only CiA 402 has a name for, such as a lost connection.
            self.errors = Errors::GENERAL;
        }
        self.warn(sample);
        if !(self.has_power || sample.scope.drive.operates()) {
            return;
        }
        let supply = sample.axis().status().voltage;
        if supply < units::voltage(sample.register(Role::MinBusvol)) {
            self.fail(Fault::motor(), Errors::LOW_VOLTAGE, sample);
        }
        let most = f64::from(sample.register(Role::Flwerrmax)).abs();
        if most > 0.0 && self.counters.following_error(sample).abs().0 > most {
            self.fail(Fault::motor(), Errors::FOLLOW, sample);
        }
        self.watch_travel(sample);
    }

    /// Tells an error of the motor, which brakes with ACC_EMERG and is passive then.
    pub(super) fn fail(&mut self, fault: Fault, error: Errors, sample: &mut Sample<'_, '_>) {
        if sample.scope.drive.has_failed() {
            return;
        }
        self.errors |= error;
        let ramp = sample.acceleration(Role::AccEmerg);
        let (drive, mut context) = sample.scope.drive();
        drive.fail(fault, Some(ramp), &mut context);
        if self.runs_axis() {
            self.leave(sample);
        }
    }

    /// ERR_BITS was written: errors whose bits are zero are cleared, none is set.
    pub(super) fn handle_errors(&mut self, value: i32, sample: &mut Sample<'_, '_>) {
        self.errors &= Errors::from_bits_truncate(value);
        if self.errors.is_empty() {
            reset_faults(sample);
        }
    }

    /// WARN_BITS was written: warnings of what has been whose bits are zero are cleared.
    pub(super) fn handle_warnings(&mut self, value: i32) {
        self.warnings &= Warnings::from_bits_truncate(value);
    }

    /// Clears errors, those of the CiA 402 drive and of the axis too, and warnings.
    pub(super) fn reset_errors(&mut self, sample: &mut Sample<'_, '_>) {
        self.warnings = Warnings::empty();
        self.errors = Errors::empty();
        reset_faults(sample);
    }

    /// WARN_BITS.
    pub(super) fn shown_warnings(&self, sample: &Sample<'_, '_>) -> i32 {
        let mut shown = self.warnings | limit_warnings(sample);
        let low = units::voltage(sample.register(Role::MinBusvol)).0 * NEARLY_LOW;
        shown.set(Warnings::LOW_VOLTAGE, sample.axis().status().voltage.0 < low);
        shown.bits()
    }

    /// STATUSBITS.
    pub(super) fn shown_flags(&self, sample: &Sample<'_, '_>) -> i32 {
        let mut shown = self.flags - self.reset_flags;
        shown.set(Flags::ZERO_SEARCH_DONE, self.is_homed);
        shown.set(Flags::ENCODER_ERROR, self.errors.contains(Errors::ENCODER));
        let corrects = matches!(&self.active, Some(Active::Position(mode)) if mode.is_correcting());
        shown.set(Flags::AUTO_CORRECTION, corrects);
        let has_target = matches!(&self.active, Some(Active::Position(_)));
        let is_there = has_target && modes::is_physically_there(&self.counters, sample);
        shown.set(Flags::PHYSICAL_POSITION, is_there);
        shown.bits()
    }

    /// Follows what the motor is doing.
    pub(super) fn measure(&mut self, sample: &Sample<'_, '_>) {
        let status = sample.axis().status();
        let mut flags = Flags::empty();
        flags.set(Flags::ACCELERATING, status.motion == Motion::Accelerating);
        flags.set(Flags::DECELERATING, status.motion == Motion::Decelerating);
        flags.set(Flags::AT_VELOCITY, self.is_at_velocity(sample));
        flags.set(Flags::IN_POSITION, self.is_there(sample));
        // What was reset stays so until it comes anew.
        self.reset_flags &= flags;
        self.flags = flags;
    }

    /// Turns "in position", "accelerating" and "decelerating" off.
    pub(super) fn reset_flags(&mut self) {
        self.reset_flags = Flags::IN_POSITION | Flags::ACCELERATING | Flags::DECELERATING;
    }

    fn is_at_velocity(&self, sample: &Sample<'_, '_>) -> bool {
        let status = sample.axis().status();
        match &self.active {
            Some(Active::Velocity) => self.has_power && status.done,
            _ => status.motion == Motion::Constant,
        }
    }

    fn is_there(&self, sample: &Sample<'_, '_>) -> bool {
        let status = sample.axis().status();
        match &self.active {
            Some(active) if active.mode() == Some(Mode::Position) => {
                let is_physical = sample.setup().contains(Setup::PHYSICAL_POSITION);
                let is_near = !is_physical || modes::is_physically_there(&self.counters, sample);
                self.has_power && status.done && is_near && modes::is_at_target(sample)
            }
            Some(_) => false,
            None => sample.scope.drive.operates() && status.on_target,
        }
    }

    fn warn(&mut self, sample: &Sample<'_, '_>) {
        let now = limit_warnings(sample);
        let seen = [
            (Warnings::POSITIVE_LIMIT, Warnings::POSITIVE_LIMIT_SEEN),
            (Warnings::NEGATIVE_LIMIT, Warnings::NEGATIVE_LIMIT_SEEN),
        ];
        for (limit, seen) in seen {
            self.warnings.set(seen, self.warnings.contains(seen) || now.contains(limit));
        }
        let is_warm = sample.axis().status().temperature > WARM;
        self.warnings
            .set(Warnings::TEMPERATURE_SEEN, self.warnings.contains(Warnings::TEMPERATURE_SEEN) || is_warm);
    }

    /// A limit switch that is met, or a position limit that ends a motion, is an error unless SETUP_BITS say
    /// otherwise. A zero search knows by itself.
    fn watch_travel(&mut self, sample: &mut Sample<'_, '_>) {
        let searches = self.active.as_ref().is_some_and(Active::is_search);
        let status = sample.axis().status();
        if !self.has_power || self.active.is_none() || searches || self.ignores_limits || !status.limited {
            return;
        }
        if status.switches.negative_limit || status.switches.positive_limit {
            self.fail(Fault::limit_switch(), Errors::POSITION_LIMIT, sample);
        } else if status.done && limits::range(sample).is_some() {
            self.fail(Fault::motor(), Errors::POSITION_LIMIT, sample);
        }
    }
}

/// The limit switches as registers name them.
fn limit_warnings(sample: &Sample<'_, '_>) -> Warnings {
    let switches = sample.axis().status().switches;
    let (negative, positive) = if sample.is_reversed() {
        (switches.positive_limit, switches.negative_limit)
    } else {
        (switches.negative_limit, switches.positive_limit)
    };
    let mut warnings = Warnings::empty();
    warnings.set(Warnings::NEGATIVE_LIMIT, negative);
    warnings.set(Warnings::POSITIVE_LIMIT, positive);
    warnings
}
