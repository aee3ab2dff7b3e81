//! The position controller: a lead/lag filter with an integrator beside it, from the position error to the
//! word of a digital-to-analogue converter.
//!
//! With `e(k)` the position error and `k` the sampling period (MACCON MAC4 User Manual, section 5.16.1):
//!
//! ```text
//! u1(k) = K·e(k) - K·A·e(k-1) - B·u1(k-1)        lead/lag K(1 - A/z)/(1 + B/z)
//! u2(k) = C·e(k-1) + u2(k-1)                     integrator C/z/(1 - 1/z)
//! u(k)  = u1(k) + u2(k)
//! ```
//!
//! Fixed point: both parts are kept with [`FRACTION_BITS`] bits after the point. All products are exact at
//! that resolution except `B·u1`, which is rounded to the nearest, as is the output to whole counts; ties
//! go away from zero, so the negative error gives the negative output. Sums are formed in 128 bits, where
//! nothing overflows whatever the error and the coefficients are, and limited before they are kept.
//!
//! Limits: `u2` stays within the output limit (the manual's anti wind-up). The manual is silent on `u1`;
//! here `u1(k-1)` is what was put out, the part above the limit is forgotten. So while the output is not
//! limited the formulas hold, and an unstable pole saturates.

/// Bits after the binary point of the two parts: what `C·e` needs at the largest shift.
const FRACTION_BITS: u32 = 24;

/// Largest output of a 12 bit converter, ±10 V, that is the same in both directions (MACCON MAC4 User
/// Manual, section 7.4).
const FULL_SCALE: i32 = 2047;

/// The coefficients as whole numbers (MACCON MAC4 User Manual, section 5.16.1, which gives no ranges: any
/// value is taken).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coefficients {
    /// Gain, `4·K` (`<ga>`).
    pub gain: i16,
    /// Zero of the lead/lag filter, `256·A` (`<ze>`).
    pub zero: i16,
    /// Pole of the lead/lag filter, `256·B` (`<po>`); unstable from ±256 on.
    pub pole: i16,
    /// Integral gain before its shift, `256·C·2^shift` (`<ki>`).
    pub integral: i16,
    /// Halvings of the integral gain, 0 to 16 (`<ki_sc>`); more count as 16.
    pub integral_shift: u8,
}

impl Coefficients {
    /// Largest shift at which the integrator is exact.
    const MAX_SHIFT: u8 = 16;
}

impl Default for Coefficients {
    /// No gain at all; the shift is the default of the manual, 8.
    fn default() -> Self {
        Self { gain: 0, zero: 0, pole: 0, integral: 0, integral_shift: 8 }
    }
}

/// A position controller, to be stepped once a sampling period.
#[derive(Clone, Debug)]
pub struct PositionController {
    coefficients: Coefficients,
    limit: i32,
    last_error: Option<i64>,
    lead_lag: i64,
    integral: i64,
}

impl PositionController {
    /// A controller at rest that uses the whole range of a 12 bit converter, ±2047 counts.
    #[must_use]
    pub fn new(coefficients: Coefficients) -> Self {
        Self { coefficients, limit: FULL_SCALE, last_error: None, lead_lag: 0, integral: 0 }
    }

    /// Replaces the coefficients. Both parts keep their values, so the integral part does not jump.
    pub fn set_coefficients(&mut self, coefficients: Coefficients) {
        self.coefficients = coefficients;
    }

    /// Replaces the output limit, 0 to 2047 converter counts (torque or force limitation); anything else is
    /// cut to that.
    pub fn set_limit(&mut self, limit: i32) {
        self.limit = limit.clamp(0, FULL_SCALE);
    }

    /// The output limit in converter counts.
    #[must_use]
    pub fn limit(&self) -> i32 {
        self.limit
    }

    /// Forgets the past: both parts are zero, and the next error is taken as one that has stood, so that its
    /// appearance is no change for the filter to amplify.
    pub fn reset(&mut self) {
        *self = Self { limit: self.limit, ..Self::new(self.coefficients) };
    }

    /// The output in converter counts, within ± the limit, for a position error (demanded minus actual) in
    /// counts.
    pub fn step(&mut self, error: i64) -> i32 {
        let last_error = self.last_error.replace(error).unwrap_or(error);
        let limit = i128::from(self.limit) << FRACTION_BITS;
        self.integral = kept(self.integrate(last_error).clamp(-limit, limit));
        let integral = i128::from(self.integral);
        let output = (self.filter(error, last_error) + integral).clamp(-limit, limit);
        self.lead_lag = kept(output - integral);
        i32::try_from(shift_right(output, FRACTION_BITS)).unwrap_or(self.limit)
    }

    /// `u2(k)`.
    fn integrate(&self, last_error: i64) -> i128 {
        let shift = u32::from(self.coefficients.integral_shift.min(Coefficients::MAX_SHIFT));
        let growth = i128::from(self.coefficients.integral) * i128::from(last_error);
        i128::from(self.integral) + (growth << (FRACTION_BITS - 8 - shift))
    }

    /// `u1(k)`.
    fn filter(&self, error: i64, last_error: i64) -> i128 {
        let Coefficients { gain, zero, pole, .. } = self.coefficients;
        let change = 256 * i128::from(error) - i128::from(zero) * i128::from(last_error);
        let feedback = shift_right(i128::from(pole) * i128::from(self.lead_lag), 8);
        ((i128::from(gain) * change) << (FRACTION_BITS - 10)) - feedback
    }
}

/// `value / 2^bits`, rounded to the nearest, ties away from zero.
fn shift_right(value: i128, bits: u32) -> i128 {
    value.signum() * ((value.abs() + (1 << (bits - 1))) >> bits)
}

/// A part that has been limited to at most twice the full scale, which takes 36 bits.
fn kept(part: i128) -> i64 {
    i64::try_from(part).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// MACCON MAC4 User Manual, section 7.2, MAC4-INC: K = 20, A = 0.5, C = 41/256/8.
    const FIRST: Coefficients =
        Coefficients { gain: 80, zero: 128, pole: 0, integral: 41, integral_shift: 3 };

    /// MACCON MAC4 User Manual, section 7.2, MAC4-SSI: K = 50, A = 253/256, C = 13/256.
    const SECOND: Coefficients =
        Coefficients { gain: 200, zero: 253, pole: 0, integral: 13, integral_shift: 0 };

    /// The formulas of the manual in exact binary fractions of 2^-24, for `B = 0`.
    fn exact(c: Coefficients, errors: &[i64]) -> Vec<i128> {
        let mut integral = 0;
        let mut last = errors[0];
        let output = |&error: &i64| {
            integral += (i128::from(c.integral) * i128::from(last)) << (16 - c.integral_shift);
            let change = 256 * i128::from(error) - i128::from(c.zero) * i128::from(last);
            last = error;
            ((i128::from(c.gain) * change) << 14) + integral
        };
        errors.iter().map(output).collect()
    }

    /// The formulas of the manual in floating point.
    fn real(c: Coefficients, errors: &[i64]) -> Vec<f64> {
        let (gain, zero, pole) =
            (f64::from(c.gain) / 4.0, f64::from(c.zero) / 256.0, f64::from(c.pole) / 256.0);
        let rate = f64::from(c.integral) / 256.0 / f64::from(1_u32 << c.integral_shift);
        let (mut lead_lag, mut integral, mut last) = (0.0, 0.0, errors[0] as f64);
        let output = |&error: &i64| {
            let error = error as f64;
            lead_lag = gain * error - gain * zero * last - pole * lead_lag;
            integral += rate * last;
            last = error;
            lead_lag + integral
        };
        errors.iter().map(output).collect()
    }

    fn outputs(c: Coefficients, errors: &[i64]) -> Vec<i32> {
        let mut controller = PositionController::new(c);
        errors.iter().map(|&error| controller.step(error)).collect()
    }

    fn coefficients() -> impl Strategy<Value = Coefficients> {
        (any::<i16>(), any::<i16>(), any::<i16>(), any::<i16>(), any::<u8>()).prop_map(
            |(gain, zero, pole, integral, integral_shift)| Coefficients {
                gain,
                zero,
                pole,
                integral,
                integral_shift,
            },
        )
    }

    /// Coefficients and errors with which the output seldom reaches its limit.
    fn calm() -> impl Strategy<Value = (Coefficients, Vec<i64>)> {
        let coefficients = (-200..200_i16, -256..=256_i16, -250..=250_i16, -30..30_i16, 0..=16_u8).prop_map(
            |(gain, zero, pole, integral, integral_shift)| Coefficients {
                gain,
                zero,
                pole,
                integral,
                integral_shift,
            },
        );
        (coefficients, prop::collection::vec(-10..=10_i64, 1..100))
    }

    proptest! {
        #[test]
        fn without_a_pole_the_output_is_the_exact_sum_rounded((c, errors) in calm()) {
            let c = Coefficients { pole: 0, ..c };
            let expected = exact(c, &errors);
            let full = i128::from(FULL_SCALE) << FRACTION_BITS;
            let free = expected.iter().take_while(|u| u.abs() <= full / 2).count();
            for (output, exact) in outputs(c, &errors).into_iter().zip(expected).take(free) {
                prop_assert_eq!(i128::from(output), shift_right(exact, FRACTION_BITS));
            }
        }

        #[test]
        fn with_a_pole_the_output_follows_the_recursive_formulas((c, errors) in calm()) {
            let expected = real(c, &errors);
            let full = f64::from(FULL_SCALE);
            let free = expected.iter().take_while(|u| u.abs() < full / 2.0).count();
            for (output, real) in outputs(c, &errors).into_iter().zip(expected).take(free) {
                prop_assert!((f64::from(output) - real).abs() < 0.5 + 1e-4, "{} {}", output, real);
            }
        }

        #[test]
        fn nothing_drives_the_output_beyond_its_limit(
            c in coefficients(),
            limit in 0..=FULL_SCALE,
            errors in prop::collection::vec(any::<i64>(), 1..100),
        ) {
            let mut controller = PositionController::new(c);
            controller.set_limit(limit);
            for error in errors {
                prop_assert!(controller.step(error).abs() <= limit);
            }
        }

        #[test]
        fn the_negative_error_gives_the_negative_output((c, errors) in calm()) {
            let negative: Vec<i64> = errors.iter().map(|error| -error).collect();
            let expected: Vec<i32> = outputs(c, &errors).iter().map(|output| -output).collect();
            prop_assert_eq!(outputs(c, &negative), expected);
        }
    }

    #[test]
    fn the_first_example_configuration_answers_as_calculated_by_hand() {
        // A step to 10 counts: 20·10 = 200, from then on 200 - 100 = 100; the integrator adds 0.2002 a period.
        let mut errors = [10; 13];
        errors[0] = 0;
        let expected = [0, 200, 100, 100, 101, 101, 101, 101, 101, 102, 102, 102, 102];
        assert_eq!(outputs(FIRST, &errors), expected);
    }

    #[test]
    fn the_second_example_configuration_answers_as_calculated_by_hand() {
        // A step to 10 counts: 50·10 = 500, from then on 500 - 494.14 = 5.86; the integrator adds 0.508.
        assert_eq!(outputs(SECOND, &[0, 10, 10, 10, 10, 10]), [0, 500, 6, 7, 7, 8]);
    }

    #[test]
    fn a_half_count_is_rounded_away_from_zero() {
        let c = Coefficients { gain: 2, ..Coefficients::default() };
        assert_eq!(outputs(c, &[1, -1, 3, -3]), [1, -1, 2, -2]);
    }

    #[test]
    fn the_shift_halves_the_integral_gain() {
        // MACCON MAC4 User Manual, section 5.16.1: 8 with a shift of 2 is 8/(256·2·2).
        let c = Coefficients { integral: 8, integral_shift: 2, ..Coefficients::default() };
        assert_eq!(outputs(c, &[128; 4]), [1, 2, 3, 4]);
    }

    #[test]
    fn the_integral_part_winds_up_to_the_limit_and_no_further() {
        let mut controller = PositionController::new(FIRST);
        controller.set_limit(500);
        (0..100_000).for_each(|_| assert!(controller.step(1000) <= 500));
        // Without an error the filter kicks back once, then the integral part alone is left.
        assert_eq!([controller.step(0), controller.step(0)], [-500, 500]);
        // It comes down as it went up, 20.02 a period: 500.5 in 25 periods.
        (0..25).for_each(|_| assert_eq!(controller.step(-1000), -500));
        assert_eq!([controller.step(0), controller.step(0)], [500, 0]);
    }

    #[test]
    fn a_lowered_limit_holds_from_the_next_step_on() {
        let mut controller = PositionController::new(SECOND);
        (0..1000).for_each(|_| {
            controller.step(100);
        });
        assert_eq!(controller.step(100), 2047);
        controller.set_limit(5000);
        assert_eq!(controller.limit(), 2047);
        controller.set_limit(120);
        assert_eq!(controller.step(100), 120);
        controller.set_limit(-1);
        assert_eq!(controller.step(100), 0);
    }

    #[test]
    fn a_slow_filter_leaves_the_limit_as_soon_as_the_error_turns() {
        // A pole of -255/256 remembers for some 256 periods what it has put out, but not what was cut off.
        let c = Coefficients { gain: 400, pole: -255, ..Coefficients::default() };
        let mut controller = PositionController::new(c);
        (0..1000).for_each(|_| {
            controller.step(1000);
        });
        assert_eq!(controller.step(0), 2039);
    }

    #[test]
    fn an_unstable_pole_saturates() {
        let c = Coefficients { gain: 4, pole: -512, ..Coefficients::default() };
        let mut errors = [0; 20];
        errors[1] = 1;
        let grown = outputs(c, &errors);
        assert_eq!(grown[..5], [0, 1, 2, 4, 8]);
        assert_eq!(grown[12..], [2047; 8]);
    }

    #[test]
    fn after_a_reset_nothing_of_the_past_is_left_but_the_limit() {
        let c = Coefficients { pole: -200, ..SECOND };
        let mut controller = PositionController::new(c);
        controller.set_limit(1000);
        (0..100).for_each(|step| {
            controller.step(step);
        });
        controller.reset();
        assert_eq!(controller.limit(), 1000);
        assert_eq!(controller.step(0), 0);
    }

    #[test]
    fn a_standing_error_at_a_reset_is_no_jump_to_amplify() {
        let mut controller = PositionController::new(SECOND);
        controller.reset();
        assert_eq!(controller.step(10), 6);
    }
}
