//! What a motor watches: its errors, and how it reacts to them (JVL Ethernet manual, section 11.3, registers 16 to 35).

use axis::{Acceleration, Position, Voltage};

use super::errors::{Errors, Flags};
use super::modes::Distance;
use super::{Active, MacMotor, Mode, Sample, limits};
use crate::jvl::units::{Family, MacUnits};
use crate::{Fault, Role};

/// The supply below which a large motor, which has no register for it, tells an under-voltage (our choice).
const LARGE_MIN_SUPPLY: Voltage = Voltage(250.0);

/// Bits of UV_HANDLE.
struct UvHandle {
    sets_error: bool,
    goes_passive: bool,
    stops: bool,
}

impl UvHandle {
    fn of(bits: i32, family: Family) -> Self {
        let stop = match family {
            Family::Small => 1 << 3,
            Family::Large => 1 << 2,
        };
        Self { sets_error: bits & 1 != 0, goes_passive: bits & 2 != 0, stops: bits & stop != 0 }
    }
}

impl MacMotor {
    /// Looks for errors after a raster step, and whether those of before were reset.
    pub(super) fn watch(&mut self, sample: &mut Sample<'_, '_>) {
        let fault = sample.axis().status().fault;
        if let Some(fault) = fault {
            self.errors |= Errors::of(fault);
        } else if !sample.scope.drive.has_failed() {
            self.errors &= Errors::UNDER_VOLTAGE;
        }
        self.watch_supply(sample);
        if self.resistor.used() >= 1.0 {
            self.fail(Errors::UIT, false, sample);
        }
        if is_too_warm(sample) {
            self.fail(Errors::TEMPERATURE, false, sample);
        }
        if let Some(limit) = limit_of(Role::I2tlim, sample)
            && self.i2t(sample) > limit
        {
            self.fail(Errors::I2T, false, sample);
        }
        self.watch_motion(sample);
        if self.has_limits_off && !self.searches() && is_within(sample) {
            self.has_limits_off = false;
        }
    }

    /// Tells an error of the motor, which brakes with ACC_EMERG or coasts, and is passive then.
    pub(super) fn fail(&mut self, error: Errors, brakes: bool, sample: &mut Sample<'_, '_>) {
        if sample.scope.drive.has_failed() {
            return;
        }
        self.errors |= error;
        let ramp = Some(sample.acceleration(Role::AccEmerg)).filter(|_| brakes);
        let (drive, mut context) = sample.scope.drive();
        drive.fail(Fault::motor(), ramp, &mut context);
        if self.runs_axis() {
            self.leave(sample);
        }
    }

    /// Clears all errors, also those of the CiA 402 drive and of the axis.
    pub(super) fn reset_errors(&mut self, sample: &mut Sample<'_, '_>) {
        self.errors = Errors::empty();
        let (drive, mut context) = sample.scope.drive();
        drive.reset_motor_error(&mut context);
    }

    /// How hot the windings are, in the unit of I2TLIM.
    pub(super) fn i2t(&self, sample: &Sample<'_, '_>) -> f64 {
        let whole = match self.family {
            Family::Small => 10_000.0,
            Family::Large => 100_000.0,
        };
        sample.axis().status().overload * whole
    }

    /// Follows what the motor is doing.
    pub(super) fn measure(&mut self, sample: &Sample<'_, '_>) {
        let is_near = match self.active.as_ref().filter(|_| self.has_power) {
            Some(active) => is_near(active, sample),
            None => sample.scope.drive.operates() && sample.axis().status().on_target,
        };
        self.samples_inside = if is_near { self.samples_inside.saturating_add(1) } else { 0 };
        let needed = sample.register(Role::Inposcnt).max(1).unsigned_abs();
        let mut flags = Flags::empty();
        flags.set(Flags::IN_POSITION, self.samples_inside >= needed);
        let Acceleration(acceleration) = sample.axis().status().demand.acceleration;
        let rises = match self.family {
            Family::Small => acceleration * sample.axis().status().demand.velocity.0.signum(),
            // Mathematically: also where a negative velocity becomes smaller.
            Family::Large => acceleration,
        };
        flags.set(Flags::ACCELERATING, rises > 0.0);
        flags.set(Flags::DECELERATING, rises < 0.0);
        self.flags = flags;
    }

    fn searches(&self) -> bool {
        self.active.as_ref().is_some_and(|active| active.mode().is_search())
    }

    fn watch_supply(&mut self, sample: &mut Sample<'_, '_>) {
        if !is_supply_low(sample, 1.0) {
            return;
        }
        let handle = UvHandle::of(sample.register(Role::UvHandle), self.family);
        if handle.stops {
            sample.set(Role::VSoll, 0);
        }
        if handle.sets_error {
            self.errors |= Errors::UNDER_VOLTAGE;
        }
        if !handle.goes_passive {
            return;
        }
        let brakes = self.family == Family::Large;
        if handle.sets_error {
            self.fail(Errors::UNDER_VOLTAGE, brakes, sample);
        } else if self.runs_axis() && !self.ends_passive {
            if brakes { self.brake(true, sample) } else { self.go_passive(sample) }
        }
    }

    /// The errors of a motion.
    fn watch_motion(&mut self, sample: &mut Sample<'_, '_>) {
        let is_pushing = matches!(&self.active, Some(active) if active.mode() == Mode::TorqueSearch);
        let operates = sample.scope.drive.operates();
        if is_pushing || !(operates || self.has_power) {
            return;
        }
        let behind = sample.axis().status().following_error;
        let lag = self.active.as_ref().map_or(behind, |active| active.lag(sample));
        let exceeds = |way: Position, role| limit_of(role, sample).is_some_and(|limit| way.0.abs() > limit);
        let (follows, functions) = (!exceeds(behind, Role::Flwerrmax), !exceeds(lag, Role::Fncerrmax));
        if !follows {
            self.fail(Errors::FOLLOW, true, sample);
        } else if !functions {
            self.fail(Errors::FUNCTION, true, sample);
        } else if !operates && !self.has_limits_off {
            self.watch_position(sample);
        }
    }

    /// A position limit that ends a motion is an error, once the axis has come to rest.
    fn watch_position(&mut self, sample: &mut Sample<'_, '_>) {
        let status = sample.axis().status();
        let is_stopped = status.limited && status.done;
        match limits::range(sample) {
            Ok(None) => {}
            Ok(Some(_)) if is_stopped && self.commanded.is_some() => {
                self.fail(Errors::POSITION_LIMIT, false, sample);
            }
            Ok(Some(_)) => {}
            Err(()) => self.fail(Errors::POSITION_LIMIT, true, sample),
        }
    }
}

/// The flags of the supply.
pub(super) fn supply_flags(sample: &Sample<'_, '_>) -> Flags {
    const NEAR: f64 = 1.25;
    let mut flags = Flags::empty();
    let factor = if sample.units.family() == Family::Small { NEAR } else { 1.0 };
    flags.set(Flags::LOW_SUPPLY, is_supply_low(sample, factor));
    flags.set(Flags::BUS_READY, !is_supply_low(sample, 1.0));
    flags
}

/// Whether the supply is below `factor` times the threshold. Before the first raster step nothing is known of it.
fn is_supply_low(sample: &Sample<'_, '_>, factor: f64) -> bool {
    let voltage = sample.axis().status().voltage;
    let is_known = sample.axis().status().steps > 0;
    let is_low = match sample.units.family() {
        Family::Small => {
            let least = f64::from(sample.register(Role::MinUSup));
            f64::from(sample.units.supply(voltage)) < factor * least
        }
        Family::Large => voltage.0 < factor * LARGE_MIN_SUPPLY.0,
    };
    is_known && is_low
}

fn is_too_warm(sample: &Sample<'_, '_>) -> bool {
    let limit = sample.register(Role::Degcmax);
    limit > 0 && MacUnits::shown_temperature(sample.axis().status().temperature) > limit
}

/// A limit of which zero is none.
fn limit_of(role: Role, sample: &Sample<'_, '_>) -> Option<f64> {
    Some(sample.register(role)).filter(|limit| *limit != 0).map(|limit| f64::from(limit).abs())
}

fn is_within(sample: &Sample<'_, '_>) -> bool {
    let actual = sample.axis().status().actual.position;
    limits::range(sample).is_ok_and(|range| range.is_none_or(|range| range.contains(actual)))
}

fn is_near(active: &Active, sample: &Sample<'_, '_>) -> bool {
    let window = sample.register(Role::Inposwin);
    match active.distance(sample) {
        Distance::Way(way) => way.0.abs() < f64::from(window),
        Distance::Speed(difference) => difference.abs() <= sample.units.velocity_window(window),
        Distance::None => false,
    }
}
