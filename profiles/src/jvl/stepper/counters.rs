//! Where a MIS stepper counts itself: P_IST, ENCODER_POS, FLWERR, EXT_ENCODER and TICKS.
//!
//! P_IST counts the steps that the motor is given, the encoder those that it has done (our reading: "actual position" and
//! "encoder deviation from P_IST"). A new P_IST takes ENCODER_POS along, so FLWERR stays; a new ENCODER_POS does not
//! change P_IST. Without an encoder ENCODER_POS and FLWERR are zero.
//!
//! While the motor is passive P_IST stays, whatever turns the shaft. With power it goes on from there, or from where the
//! encoder is where SETUP_BITS say so.

use axis::{Motion, Position};

use super::Sample;
use super::bits::Setup;
use super::units;

/// The counters of one motor, beside the one in the axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counters {
    /// ENCODER_POS minus the actual position of the axis.
    encoder_offset: Position,
    /// P_IST, as a place on the axis, of a motor that has become passive and does not follow its encoder.
    kept: Option<Position>,
    /// P_IST of the last raster step with power, as a place on the axis.
    powered: Option<Position>,
    external: Position,
    /// Time since the reset, in seconds.
    time: f64,
}

impl Counters {
    /// Follows one raster step.
    pub(super) fn step(&mut self, sample: &Sample<'_, '_>) {
        let raster = sample.raster();
        self.time += raster;
        self.external = self.external + Position(sample.external_velocity().0 * raster);
        let has_power = sample.axis().status().motion != Motion::Off;
        if has_power {
            self.kept = None;
            self.powered = Some(self.p_ist(sample));
        } else if let Some(place) = self.powered.take() {
            let follows = sample.setup().contains(Setup::SYNC_AFTER_PASSIVE);
            self.kept = Some(place).filter(|_| sample.stepper.has_encoder && !follows);
        }
    }

    /// Lets time pass in which the axis slept.
    pub(super) fn rest(&mut self, seconds: f64) {
        self.time += seconds;
    }

    /// The motor is about to get power: the axis takes the place that was kept.
    pub(super) fn wake(&mut self, sample: &mut Sample<'_, '_>) {
        if let Some(place) = self.kept.take() {
            self.shift_past_encoder(place - sample.demand(), sample);
        }
    }

    /// P_IST as a place on the axis.
    pub(super) fn p_ist(&self, sample: &Sample<'_, '_>) -> Position {
        let status = sample.axis().status();
        if sample.setup().contains(Setup::ENCODER_TO_P_IST) {
            status.actual.position
        } else {
            self.kept.unwrap_or(status.demand.position)
        }
    }

    /// ENCODER_POS as a place on the axis; that of P_IST without an encoder.
    pub(super) fn encoder(&self, sample: &Sample<'_, '_>) -> Position {
        if sample.stepper.has_encoder {
            sample.axis().status().actual.position + self.encoder_offset
        } else {
            self.p_ist(sample)
        }
    }

    /// How far the encoder is from P_IST.
    pub(super) fn following_error(&self, sample: &Sample<'_, '_>) -> Position {
        self.encoder(sample) - self.p_ist(sample)
    }

    /// Calls the present place `value`; nothing moves by that alone.
    pub(super) fn set_p_ist(&mut self, value: i32, sample: &mut Sample<'_, '_>) {
        let here = self.p_ist(sample);
        let by = sample.place(value, here) - here;
        if let Some(kept) = &mut self.kept {
            *kept = *kept + by;
            self.encoder_offset = self.encoder_offset + by;
        } else {
            self.shift(by, sample);
        }
    }

    /// Calls the place of the encoder `value`.
    pub(super) fn set_encoder(&mut self, value: i32, sample: &Sample<'_, '_>) {
        if sample.stepper.has_encoder {
            let here = self.encoder(sample);
            self.encoder_offset = self.encoder_offset + (sample.place(value, here) - here);
        }
    }

    /// P_IST becomes ENCODER_POS.
    pub(super) fn synchronise(&mut self, sample: &mut Sample<'_, '_>) {
        let by = self.following_error(sample);
        if let Some(kept) = &mut self.kept {
            *kept = *kept + by;
        } else {
            self.shift_past_encoder(by, sample);
        }
    }

    /// EXT_ENCODER.
    pub(super) fn external(&self) -> i32 {
        units::counter(self.external)
    }

    pub(super) fn set_external(&mut self, value: i32) {
        self.external = Position(f64::from(value));
    }

    /// TICKS.
    pub(super) fn ticks(&self) -> i32 {
        (self.time * 1000.0).round() as i64 as i32
    }

    /// Calls the present place larger by `by`, and leaves ENCODER_POS alone.
    fn shift_past_encoder(&mut self, by: Position, sample: &mut Sample<'_, '_>) {
        self.shift(by, sample);
        self.encoder_offset = self.encoder_offset - by;
    }

    fn shift(&mut self, by: Position, sample: &mut Sample<'_, '_>) {
        let actual = sample.axis().status().actual.position;
        sample.axis_mut().set_position(actual + by);
        self.powered = self.powered.map(|place| place + by);
    }
}
