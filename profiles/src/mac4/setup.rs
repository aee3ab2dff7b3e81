//! From the parameters of an axis to its axis and drive: what INIT activates and what E does.

use axis::{
    BehindLimit, Coding, Coefficients, Counting, Creep, Guard, Limits, Position, PositionRange, Reaction,
    Scale, SensorConfig, Setting, Source, Stepping, TargetWindow, Travel, Turn,
};
use od::Dictionary;

use super::drive::{COUNTER_BITS, SSI_BITS, SSI_CODING};
use super::record::Record;
use super::units::{HIGHEST_FREQUENCY, HIGHEST_TURBO_FREQUENCY, Units};
use super::{CardType, Instruction, owner};
use crate::vendor::Scope;

/// Executed instructions that may wait: a queue of 10 elements holds one less (section 7.3.2).
pub(super) const MOST_WAITING: usize = 9;

/// `<sh>` (section 4.3.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axes {
    Linear,
    Circular,
    CircularOptimised,
}

impl Axes {
    pub(super) fn of(code: i64) -> Self {
        match code {
            2 => Self::Circular,
            3 => Self::CircularOptimised,
            _ => Self::Linear,
        }
    }
}

/// `<et>` (table 4.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EncoderType {
    StepCounter,
    Relative,
    Absolute,
    ExternalRelative,
    ExternalAbsolute,
}

impl EncoderType {
    pub(super) fn of(code: i64) -> Self {
        match code {
            0 => Self::StepCounter,
            1 => Self::Relative,
            2 => Self::Absolute,
            3 => Self::ExternalRelative,
            _ => Self::ExternalAbsolute,
        }
    }

    pub(super) fn is_absolute(self) -> bool {
        match self {
            Self::Absolute | Self::ExternalAbsolute => true,
            Self::StepCounter | Self::Relative | Self::ExternalRelative => false,
        }
    }

    fn is_external(self) -> bool {
        match self {
            Self::ExternalRelative | Self::ExternalAbsolute => true,
            Self::StepCounter | Self::Relative | Self::Absolute => false,
        }
    }
}

/// Significant bits of a sensor for `<eb>`; zero is what fits.
fn bits(encoder: EncoderType, given: i64, is_ssi: bool) -> u8 {
    const EXTERNAL_BITS: u8 = 32;
    match u8::try_from(given) {
        Ok(0) | Err(_) if encoder.is_external() => EXTERNAL_BITS,
        Ok(0) | Err(_) if is_ssi => SSI_BITS,
        Ok(0) | Err(_) => COUNTER_BITS,
        Ok(given) => given,
    }
}

/// Counting range of a sensor for `<ec>` and `<eb>`; zero is all that its bits hold.
pub(super) fn range(given: i64, encoder: EncoderType, bits_given: i64, is_ssi: bool) -> u64 {
    match u64::try_from(given) {
        Ok(0) | Err(_) => 1 << bits(encoder, bits_given, is_ssi).min(32),
        Ok(given) => given,
    }
}

/// What reads the parameters of an axis.
#[derive(Clone, Copy)]
pub(super) struct Setup<'a> {
    pub(super) record: &'a Record,
    pub(super) card: CardType,
    pub(super) axis: u8,
}

impl Setup<'_> {
    fn get(&self, dictionary: &Dictionary, instruction: Instruction) -> i64 {
        self.record.get(dictionary, instruction)
    }

    /// The units that `<sf>` chooses.
    pub(super) fn units(&self, scope: &Scope<'_>) -> Units {
        let scaling = self.get(scope.dictionary, Instruction::WSF);
        Units::new(self.card, scope.axis.period(), scaling)
    }

    /// INIT: direction, sensor, kind of axis. Yields the place of the drive that is called `<ao>`.
    pub(super) fn initialise(&self, scope: &mut Scope<'_>, is_reversed: bool) -> Position {
        scope.axis.configure(Setting::Reversed(is_reversed));
        let (encoder, source) = self.source(scope.dictionary);
        scope.axis.configure(Setting::Source(source));
        scope.axis.set_travel(self.travel(scope.dictionary));
        let signals = scope.axis.signals();
        // An absolute sensor on a circular axis is followed over the end of its range, from the value it shows.
        let is_followed = encoder.is_absolute() && scope.axis.travel().turn().is_some();
        let origin = match (encoder.is_absolute(), is_followed) {
            (true, false) => Position(0.0),
            (true, true) => signals.place - Position(f64::from(signals.count)),
            (false, _) => signals.place,
        };
        let offset = Units::position(self.get(scope.dictionary, Instruction::UWAO));
        scope.axis.set_offset(offset - origin);
        origin
    }

    /// Where the position comes from.
    fn source(&self, dictionary: &Dictionary) -> (EncoderType, Source) {
        let get = |instruction| self.get(dictionary, instruction);
        let encoder = EncoderType::of(get(Instruction::UWET));
        let is_ssi = self.card == CardType::Ssi;
        let is_circular = Axes::of(get(Instruction::UWSH)) != Axes::Linear;
        let turn = is_circular && encoder.is_absolute();
        let given = if turn { get(Instruction::UWCR) } else { get(Instruction::UWEC) };
        let is_own_ssi = is_ssi && !encoder.is_external();
        let config = SensorConfig {
            bits: bits(encoder, get(Instruction::UWEB), is_ssi),
            range: range(given, encoder, get(Instruction::UWEB), is_ssi),
            shift: if is_own_ssi { u8::try_from(get(Instruction::UWSC)).unwrap_or(0) } else { 0 },
            coding: if is_own_ssi { SSI_CODING } else { Coding::Binary },
            counting: if encoder.is_absolute() && !turn { Counting::Absolute } else { Counting::Relative },
        };
        let scale = self.scale(dictionary, encoder);
        let source = match encoder {
            EncoderType::StepCounter => Source::Counter,
            EncoderType::Relative | EncoderType::Absolute => Source::Own(config, scale),
            EncoderType::ExternalRelative | EncoderType::ExternalAbsolute
                if get(Instruction::UWEA) == host_address(self.axis) =>
            {
                Source::Host(config, scale)
            }
            EncoderType::ExternalRelative | EncoderType::ExternalAbsolute => Source::Elsewhere(config, scale),
        };
        (encoder, source)
    }

    /// Increments to steps (section 4.4.2.3): STP alone, and not where steps are counted.
    fn scale(&self, dictionary: &Dictionary, encoder: EncoderType) -> Scale {
        let number = |instruction| u32::try_from(self.get(dictionary, instruction)).unwrap_or(0);
        let is_scaled = self.card == CardType::Stp && encoder != EncoderType::StepCounter;
        let scale = Scale::of_encoder(number(Instruction::UWES), number(Instruction::UWMS));
        scale.filter(|_| is_scaled).unwrap_or(Scale::ONE)
    }

    /// A place in increments of the sensor.
    pub(super) fn increments(&self, dictionary: &Dictionary, place: Position) -> i64 {
        let encoder = EncoderType::of(self.get(dictionary, Instruction::UWET));
        self.scale(dictionary, encoder).increments(Units::shown_position(place))
    }

    fn travel(&self, dictionary: &Dictionary) -> Travel {
        let turn = Turn::new(Units::position(self.get(dictionary, Instruction::UWCR)));
        match (Axes::of(self.get(dictionary, Instruction::UWSH)), turn) {
            (Axes::Linear, _) | (_, None) => Travel::Linear,
            (Axes::Circular, Some(turn)) => Travel::Circular(turn),
            (Axes::CircularOptimised, Some(turn)) => Travel::CircularOptimised(turn),
        }
    }

    /// What E activates beside the mode: limits, guards, controller, the shape of a stepper's motion.
    pub(super) fn apply(&self, scope: &mut Scope<'_>) {
        self.apply_guard(scope);
        let units = self.units(scope);
        let get = |instruction| self.get(scope.dictionary, instruction);
        let (radius, error) = (get(Instruction::WTR), get(Instruction::WMF));
        let window =
            TargetWindow { radius: Units::position(radius), steps: units.periods(get(Instruction::WTRT)) };
        let range = PositionRange::new(
            Units::position(get(Instruction::UWLN)),
            Units::position(get(Instruction::UWLP)),
        );
        let of_motor = crate::cia402::limits_of(scope.motor);
        let velocity = match (self.card, get(Instruction::TURBO) != 0) {
            (CardType::Inc | CardType::Ssi, _) => of_motor.velocity,
            (CardType::Stp, false) => Units::frequency(HIGHEST_FREQUENCY),
            (CardType::Stp, true) => Units::frequency(HIGHEST_TURBO_FREQUENCY),
        };
        let limits = Limits { velocity, position: range, ..of_motor };
        let settings = [
            Setting::Coefficients(self.coefficients(scope.dictionary)),
            Setting::OutputLimit(i32::try_from(get(Instruction::WTL)).unwrap_or(0)),
            Setting::BoostLead(Units::nanos(get(Instruction::WBT))),
            Setting::Turbo(get(Instruction::TURBO) != 0),
        ];
        let stepping = self.stepping(scope.dictionary, units);
        settings.into_iter().for_each(|setting| scope.axis.configure(setting));
        scope.axis.set_limits(limits);
        scope.axis.set_torque_limit(axis::TorqueLimit::both(of_motor.torque));
        scope.axis.set_following_error_limit(Some(Units::position(error)));
        scope.axis.set_following_error_time(0);
        scope.axis.set_target_window(Some(window));
        scope.axis.set_stepping(stepping);
    }

    /// What the axis does about trouble (sections 4.8.2 and 6.3).
    pub(super) fn apply_guard(&self, scope: &mut Scope<'_>) {
        let ramp = self.units(scope).ramp(self.get(scope.dictionary, Instruction::WAA));
        scope.axis.set_guard(Guard {
            levels: owner::levels(self.record, scope.dictionary),
            behind_limit: BehindLimit::Closed,
            emergency_deceleration: ramp,
            following_error: Reaction::Brake,
            drive_signal: Reaction::Brake,
            supervision: Reaction::Brake,
        });
    }

    fn coefficients(&self, dictionary: &Dictionary) -> Coefficients {
        let number = |instruction| i16::try_from(self.get(dictionary, instruction)).unwrap_or(0);
        Coefficients {
            gain: number(Instruction::WGA),
            zero: number(Instruction::WZE),
            pole: number(Instruction::WPO),
            integral: number(Instruction::WKI),
            integral_shift: u8::try_from(self.get(dictionary, Instruction::UWKISC)).unwrap_or(0),
        }
    }

    /// The shape of a stepper's motion; `<stc>` zero is without a creep phase.
    fn stepping(&self, dictionary: &Dictionary, units: Units) -> Option<Stepping> {
        let get = |instruction| self.get(dictionary, instruction);
        let steps = get(Instruction::WSTC);
        let creep =
            Creep { distance: Units::position(steps), velocity: units.velocity(get(Instruction::WLV)) };
        (self.card == CardType::Stp).then(|| Stepping {
            start_stop: Units::frequency(get(Instruction::WSSF)),
            creep: (steps > 0).then_some(creep),
        })
    }
}

/// The address at which the host writes the position of an axis (table 3.3).
fn host_address(axis: u8) -> i64 {
    const FIRST: i64 = 0x330A;
    const STRIDE: i64 = 0x400;
    FIRST + STRIDE * i64::from(axis)
}
