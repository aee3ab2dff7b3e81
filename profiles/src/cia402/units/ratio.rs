//! Exact fractions: how many counts a user unit has.

/// Bits of a numerator or divisor; with [`Ratio::FRACTION`] more every sum below stays in 128 bits.
const BITS: u32 = 100;

/// A positive fraction in lowest terms. Up to 100 bits above and below the line it is exact; a longer one, which
/// takes four factors of 32 bits without a common divisor, loses its last bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ratio {
    numerator: u128,
    divisor: u128,
}

impl Ratio {
    pub(super) const ONE: Self = Self { numerator: 1, divisor: 1 };

    /// Bits behind the point with which counts are read.
    const FRACTION: u32 = 24;

    /// The product of at most four fractions `(numerator, divisor)`. One with a zero in it, which the gate refuses
    /// but a profile may start with, counts as 1.
    pub(super) fn product(factors: &[(u32, u32)]) -> Self {
        let whole = factors.iter().filter(|(numerator, divisor)| *numerator > 0 && *divisor > 0);
        let (numerator, divisor) = whole.fold((1_u128, 1_u128), |(above, below), (numerator, divisor)| {
            (above.saturating_mul((*numerator).into()), below.saturating_mul((*divisor).into()))
        });
        Self { numerator, divisor }.reduced().fitted(BITS)
    }

    /// Numerator and divisor as two objects of 32 bits show them: exact if they fit, otherwise the nearest below.
    pub(super) fn parts(self) -> (u32, u32) {
        let Self { numerator, divisor } = self.fitted(u32::BITS);
        let part = |value: u128| u32::try_from(value).unwrap_or(u32::MAX);
        (part(numerator), part(divisor))
    }

    /// The counts of so many units: the double nearest to the fraction, whole counts exactly up to 2^53.
    pub(super) fn counts(self, units: i128) -> f64 {
        if self == Self::ONE {
            return units as f64;
        }
        let (whole, rest) = multiply_divide(units.unsigned_abs(), self.numerator, self.divisor);
        let counts = whole as f64 + rest as f64 / self.divisor as f64;
        if units < 0 { -counts } else { counts }
    }

    /// The units nearest to so many counts, halves away from zero. Counts are read to 2^-24; what is no number
    /// is zero.
    pub(super) fn units(self, counts: f64) -> i128 {
        if self == Self::ONE {
            return counts.round() as i128;
        }
        let fine = (counts.abs() * f64::from(1_u32 << Self::FRACTION)).round() as u128;
        let unit = self.numerator << Self::FRACTION;
        let (whole, rest) = multiply_divide(fine, self.divisor, unit);
        let units = i128::try_from(whole.saturating_add((2 * rest >= unit).into())).unwrap_or(i128::MAX);
        if counts < 0.0 { -units } else { units }
    }

    fn reduced(self) -> Self {
        let common = common_divisor(self.numerator, self.divisor);
        Self { numerator: self.numerator / common, divisor: self.divisor / common }
    }

    fn fitted(self, bits: u32) -> Self {
        let used = u128::BITS - self.numerator.max(self.divisor).leading_zeros();
        let excess = used.saturating_sub(bits);
        Self { numerator: (self.numerator >> excess).max(1), divisor: (self.divisor >> excess).max(1) }
    }
}

/// The greatest common divisor of two numbers that are not both zero.
fn common_divisor(mut a: u128, mut b: u128) -> u128 {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// Quotient and remainder of `a * b / c`, with `c` from 1 to below 2^126; the quotient saturates.
fn multiply_divide(a: u128, b: u128, c: u128) -> (u128, u128) {
    if let Some(product) = a.checked_mul(b) {
        return (product / c, product % c);
    }
    // Bit by bit: the product is never formed.
    let (whole, part) = (b / c, b % c);
    let (mut quotient, mut rest) = (0_u128, 0_u128);
    for bit in (0..u128::BITS).rev() {
        quotient = quotient.saturating_mul(2);
        rest *= 2;
        if a >> bit & 1 == 1 {
            quotient = quotient.saturating_add(whole);
            rest += part;
        }
        quotient = quotient.saturating_add(rest / c);
        rest %= c;
    }
    (quotient, rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_fraction_is_in_lowest_terms_and_a_zero_in_it_counts_as_one() {
        assert_eq!(Ratio::product(&[(35, 10), (8000, 1), (100, 38_956)]).parts(), (700_000, 9739));
        assert_eq!(Ratio::product(&[(0, 5), (6, 4), (7, 0)]).parts(), (3, 2));
        assert_eq!(Ratio::product(&[]), Ratio::ONE);
    }

    #[test]
    fn halves_are_rounded_away_from_zero() {
        let half = Ratio::product(&[(2, 1)]);
        assert_eq!([1.0, -1.0, 3.0, 0.999, -3.0].map(|counts| half.units(counts)), [1, -1, 2, 0, -2]);
    }

    #[test]
    fn what_is_no_number_or_has_no_bounds_stays_in_them() {
        let third = Ratio::product(&[(1, 3)]);
        assert_eq!(third.units(f64::NAN), 0);
        assert!(third.units(f64::NEG_INFINITY) < i128::from(i64::MIN));
        assert_eq!(third.counts(i128::MIN).to_bits(), (-(2.0_f64.powi(127)) / 3.0).to_bits());
    }

    #[test]
    fn the_largest_factors_lose_their_last_bits_at_most() {
        let largest = (u32::MAX, u32::MAX - 1);
        let ratio = Ratio::product(&[largest, largest, largest, largest]);
        assert_eq!(ratio.units(1e9), 1_000_000_000 - 1);
        assert_eq!(Ratio::product(&[(u32::MAX, 1), (u32::MAX, 1)]).parts(), (u32::MAX - 1, 1));
    }

    fn factors() -> impl Strategy<Value = Vec<(u32, u32)>> {
        prop::collection::vec((1..=u32::MAX, 1..=u32::MAX), 0..4)
    }

    proptest! {
        #[test]
        fn a_product_is_divided_exactly_however_large_it_is(
            a in any::<u128>(), b in any::<u64>(), c in 1..u128::MAX >> 2,
        ) {
            let (quotient, rest) = multiply_divide(a, b.into(), c);
            prop_assert!(rest < c);
            if quotient < u128::MAX {
                // The sum holds modulo 2^128; the true one differs from it by less than that.
                let sum = quotient.wrapping_mul(c).wrapping_add(rest);
                prop_assert_eq!(sum, a.wrapping_mul(b.into()));
            }
        }

        #[test]
        fn units_come_back_from_their_counts(factors in factors(), units in -(1_i64 << 32)..1 << 32) {
            let ratio = Ratio::product(&factors);
            let counts = ratio.counts(units.into());
            // A unit has to be larger than what counts are read to, and than the distance of two doubles.
            let unit = ratio.counts(1);
            prop_assume!(unit > 1e-6 && counts.abs() < 1e15 * unit);
            prop_assert_eq!(ratio.units(counts), i128::from(units));
        }

        #[test]
        fn counts_come_back_within_half_a_unit(factors in factors(), counts in -1e12..1e12_f64) {
            let ratio = Ratio::product(&factors);
            let unit = ratio.counts(1);
            prop_assume!(unit > 1e-6);
            let shown = ratio.counts(ratio.units(counts));
            prop_assert!((shown - counts).abs() <= unit / 2.0 + 1e-3, "{} {}", shown, counts);
        }

        #[test]
        fn the_nearest_unit_is_that_of_whole_numbers(
            numerator in 1..u32::MAX, divisor in 1..u32::MAX, counts in any::<i32>(),
        ) {
            let ratio = Ratio::product(&[(numerator, divisor)]);
            let (above, below) = (i128::from(counts) * i128::from(divisor), i128::from(numerator));
            let nearest = above.signum() * ((2 * above.abs() + below) / (2 * below));
            prop_assert_eq!(ratio.units(counts.into()), nearest);
        }

        #[test]
        fn a_whole_number_of_counts_is_exact(counts in 1..u32::MAX, units in -(1_i32 << 21)..1 << 21) {
            let exact = i64::from(counts) * i64::from(units);
            let ratio = Ratio::product(&[(counts, 7), (7, 1)]);
            prop_assert_eq!(ratio.counts(units.into()).to_bits(), (exact as f64 + 0.0).to_bits());
        }
    }
}
