//! The quantities of an axis, each with its unit in its type.

use core::num::NonZeroU64;
use core::ops::{Add, Neg, Sub};

/// Declares a quantity: a number that only mixes with its own kind.
macro_rules! quantity {
    ($(#[$meaning:meta])* $name:ident) => {
        $(#[$meaning])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
        pub struct $name(pub f64);

        impl $name {
            /// The same quantity without its sign.
            #[must_use]
            pub fn abs(self) -> Self {
                Self(self.0.abs())
            }
        }

        impl Add for $name {
            type Output = Self;
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }

        impl Sub for $name {
            type Output = Self;
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }

        impl Neg for $name {
            type Output = Self;
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }
    };
}

quantity! {
    /// A place or a distance, in counts; whole counts are exact up to ±2^53.
    Position
}
quantity! {
    /// A velocity, in counts per second.
    Velocity
}
quantity! {
    /// An acceleration, in counts per second squared.
    Acceleration
}
quantity! {
    /// A jerk, in counts per second cubed.
    Jerk
}
quantity! {
    /// A torque, in per mille of the rated torque.
    Torque
}
quantity! {
    /// A voltage, in volts.
    Voltage
}
quantity! {
    /// A temperature, in degrees Celsius.
    Temperature
}

/// The raster period of an axis: 1 ns to 1 s, in whole nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Period(NonZeroU64);

impl Period {
    /// One millisecond.
    pub const MILLISECOND: Self = match Self::from_nanos(1_000_000) {
        Some(period) => period,
        None => Self(NonZeroU64::MIN),
    };

    const MAX_NANOS: u64 = 1_000_000_000;

    /// A period of `nanos` nanoseconds; `None` when that is zero or more than a second.
    #[must_use]
    pub const fn from_nanos(nanos: u64) -> Option<Self> {
        match NonZeroU64::new(nanos) {
            Some(valid) if nanos <= Self::MAX_NANOS => Some(Self(valid)),
            Some(_) | None => None,
        }
    }

    /// The period in nanoseconds, never zero.
    #[must_use]
    pub const fn nanos(self) -> u64 {
        self.0.get()
    }

    /// The period in seconds.
    #[must_use]
    pub const fn seconds(self) -> f64 {
        self.0.get() as f64 / 1e9
    }
}

/// `value` without its sign and at most `max`; what is not a number counts as zero.
pub(crate) fn magnitude(value: f64, max: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value.abs().min(max) }
}

/// `value` cut to ±`most`; what is not a number stays so. Two instructions, unlike `max` and `min`.
pub(crate) fn cut(value: f64, most: f64) -> f64 {
    let below = if value > most { most } else { value };
    if below < -most { -most } else { below }
}

/// The whole number nearest to `value`.
pub(crate) fn rounded(value: f64) -> f64 {
    /// Numbers of this size have no fraction, so that adding it rounds: 1.5 · 2^52.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    /// Below this a sum with it is that large: 2^51.
    const MOST: f64 = 2_251_799_813_685_248.0;
    if value.abs() < MOST { value + WHOLE - WHOLE } else { (value + 0.5).floor() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_is_between_one_nanosecond_and_one_second() {
        assert_eq!(Period::from_nanos(0), None);
        assert_eq!(Period::from_nanos(1_000_000_001), None);
        assert_eq!(Period::from_nanos(2_500_000).map(Period::nanos), Some(2_500_000));
        assert_eq!(Period::MILLISECOND.nanos(), 1_000_000);
    }

    #[test]
    fn a_magnitude_is_always_a_number_within_its_bound() {
        assert_eq!(magnitude(f64::NAN, 5.0).to_bits(), 0.0_f64.to_bits());
        assert_eq!(magnitude(f64::NEG_INFINITY, 5.0).to_bits(), 5.0_f64.to_bits());
        assert_eq!(magnitude(-3.0, 5.0).to_bits(), 3.0_f64.to_bits());
    }

    #[test]
    fn a_cut_keeps_what_fits() {
        let cuts = [-3.0, -2.0, 0.5, 7.0].map(|value| Torque(cut(value, 2.0)));
        assert_eq!(cuts, [-2.0, -2.0, 0.5, 2.0].map(Torque));
        assert!(cut(f64::NAN, 2.0).is_nan());
    }

    #[test]
    fn rounding_goes_to_the_nearest_whole_number_of_any_size() {
        for value in [0.0, 0.4999, -0.4999, 1.75, -1e9 - 0.25, 2_251_799_813_685_247.5, 9e15, -9e15, 1e300] {
            assert!((rounded(value) - value).abs() <= 0.5, "{value}");
            assert_eq!(rounded(value).to_bits(), rounded(value).floor().to_bits());
        }
    }
}
