//! The factor group: which objects make which ratio.

use super::ratio::Ratio;
use super::{Turn, Units};
use crate::{Binding, Dialect};

/// The numerator and the divisor of a fraction.
type Fraction = (Binding, Binding);

/// 0x608F: what the position encoder gives.
const POSITION_ENCODER: Fraction = (Binding::PositionEncoderIncrements, Binding::PositionEncoderRevolutions);
/// 0x6090: what the velocity encoder gives.
const VELOCITY_ENCODER: Fraction = (Binding::VelocityEncoderIncrements, Binding::VelocityEncoderRevolutions);
/// 0x6091: turns of the motor in turns of the shaft.
const GEAR: Fraction = (Binding::GearMotorRevolutions, Binding::GearShaftRevolutions);
/// 0x6092, the other way round: turns of the shaft in position units.
const SHAFT: Fraction = (Binding::FeedShaftRevolutions, Binding::Feed);
/// 0x6093.
const POSITION: Fraction = (Binding::PositionFactorNumerator, Binding::PositionFactorDivisor);
/// 0x6094.
const VELOCITY_COUNTS: Fraction =
    (Binding::VelocityEncoderFactorNumerator, Binding::VelocityEncoderFactorDivisor);
/// 0x6096.
const VELOCITY: Fraction = (Binding::VelocityFactorNumerator, Binding::VelocityFactorDivisor);
/// 0x6097.
const ACCELERATION: Fraction = (Binding::AccelerationFactorNumerator, Binding::AccelerationFactorDivisor);
/// 0x60A2.
const JERK: Fraction = (Binding::JerkFactorNumerator, Binding::JerkFactorDivisor);

const ALL: [Fraction; 9] = [
    POSITION_ENCODER,
    VELOCITY_ENCODER,
    GEAR,
    SHAFT,
    POSITION,
    VELOCITY_COUNTS,
    VELOCITY,
    ACCELERATION,
    JERK,
];

/// 0x607E.
const POSITION_POLARITY: i64 = 1 << 7;
const VELOCITY_POLARITY: i64 = 1 << 6;

/// Whether `binding` is a part of a fraction, which is never zero.
pub(crate) fn is_fraction(binding: Binding) -> bool {
    ALL.iter().any(|(numerator, divisor)| [*numerator, *divisor].contains(&binding))
}

/// Whether the units of an axis depend on `binding`.
pub(crate) fn is_factor(binding: Binding) -> bool {
    let others = [Binding::Polarity, Binding::MinPositionRange, Binding::MaxPositionRange];
    is_fraction(binding) || others.contains(&binding)
}

/// Whether 0x6093 is calculated from `binding`.
pub(crate) fn makes_position_factor(binding: Binding) -> bool {
    [POSITION_ENCODER, GEAR, SHAFT].iter().any(|(above, below)| [*above, *below].contains(&binding))
}

/// Whether `binding` is 0x6093.
pub(crate) fn is_position_factor(binding: Binding) -> bool {
    [POSITION.0, POSITION.1].contains(&binding)
}

/// 0x6093 as it follows from encoder, gear and feed (module manual, section 4.3.21).
pub(crate) fn position_factor(get: impl Fn(Binding) -> Option<i64>) -> [(Binding, u32); 2] {
    let (numerator, divisor) = ratio(&get, &[POSITION_ENCODER, GEAR, SHAFT]).parts();
    [(POSITION.0, numerator), (POSITION.1, divisor)]
}

impl Units {
    /// The units that the objects behind `get` choose.
    pub(crate) fn read(dialect: Dialect, get: impl Fn(Binding) -> Option<i64>) -> Self {
        let ratio = |fractions: &[Fraction]| ratio(&get, fractions);
        let polarity = get(Binding::Polarity).unwrap_or(0);
        let units = Self {
            is_position_reversed: polarity & POSITION_POLARITY != 0,
            is_velocity_reversed: polarity & VELOCITY_POLARITY != 0,
            turn: turn(&get),
            ..Self::default()
        };
        match dialect {
            Dialect::Cia402 | Dialect::Mac4(_) => Self {
                position: ratio(&[POSITION_ENCODER, GEAR, SHAFT]),
                velocity: ratio(&[VELOCITY_ENCODER, GEAR, SHAFT, VELOCITY]),
                acceleration: ratio(&[VELOCITY_ENCODER, GEAR, SHAFT, ACCELERATION]),
                jerk: ratio(&[VELOCITY_ENCODER, GEAR, SHAFT, JERK]),
                ..units
            },
            Dialect::Jvl => Self {
                position: ratio(&[POSITION]),
                velocity: ratio(&[VELOCITY_COUNTS]),
                acceleration: ratio(&[ACCELERATION]),
                ..units
            },
        }
    }
}

fn ratio(get: &impl Fn(Binding) -> Option<i64>, fractions: &[Fraction]) -> Ratio {
    let part = |binding| get(binding).map_or(1, |value| u32::try_from(value).unwrap_or(0));
    let factors = fractions.iter().map(|(numerator, divisor)| (part(*numerator), part(*divisor)));
    Ratio::product(&factors.collect::<Vec<_>>())
}

/// 0x607B; a range that holds one place or none is that of 32 bits.
fn turn(get: &impl Fn(Binding) -> Option<i64>) -> Turn {
    let ends = get(Binding::MinPositionRange).zip(get(Binding::MaxPositionRange));
    ends.filter(|(min, max)| min < max).map_or(Turn::default(), |(min, max)| Turn { min, max })
}
