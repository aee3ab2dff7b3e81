//! The ratio of a sensor's increments to motor steps.

/// How many motor steps as many increments are, exactly (MACCON MAC4 User Manual, section 4.4.2.3).
///
/// Places are converted, never changes, so nothing drifts. Results are rounded to the nearest whole number,
/// ties upwards, which makes every revolution look the same; they are cut to what an `i64` holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    increments: u64,
    steps: u64,
}

impl Scale {
    /// A sensor that counts motor steps.
    pub const ONE: Self = Self { increments: 1, steps: 1 };

    /// Increments of one encoder line, by the phase of its two tracks.
    const QUADRATURE: u64 = 4;

    /// An encoder of `lines` lines (`<es>`) while the motor makes `steps` steps (`<ms>`): four times the
    /// lines are as many increments. `None` when either is zero.
    #[must_use]
    pub fn of_encoder(lines: u32, steps: u32) -> Option<Self> {
        let scale = Self { increments: u64::from(lines) * Self::QUADRATURE, steps: u64::from(steps) };
        (lines > 0 && steps > 0).then_some(scale)
    }

    /// The motor steps nearest to a place in increments.
    #[must_use]
    pub fn steps(self, increments: i64) -> i64 {
        scaled(increments, self.steps, self.increments)
    }

    /// The increment nearest to a place in motor steps.
    #[must_use]
    pub fn increments(self, steps: i64) -> i64 {
        scaled(steps, self.increments, self.steps)
    }
}

/// `place * factor / divisor`, the divisor not being zero.
fn scaled(place: i64, factor: u64, divisor: u64) -> i64 {
    if factor == divisor {
        return place;
    }
    let (factor, divisor) = (i128::from(factor), i128::from(divisor));
    let nearest = (2 * i128::from(place) * factor + divisor).div_euclid(2 * divisor);
    let saturated = if place < 0 { i64::MIN } else { i64::MAX };
    i64::try_from(nearest).unwrap_or(saturated)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn both_examples_of_the_manual_convert_exactly() {
        let direct = Scale::of_encoder(1_000, 25_000).unwrap();
        assert_eq!(direct.steps(4_000), 25_000);
        assert_eq!(direct.steps(4), 25); // 6.25 steps an increment
        assert_eq!(direct.increments(25), 4); // 0.16 increments a step
        let geared = Scale::of_encoder(625, 125_000).unwrap();
        assert_eq!(geared.steps(2_500), 125_000);
        assert_eq!(geared.steps(1), 50);
        assert_eq!(geared.increments(50), 1); // 0.02 increments a step
    }

    #[test]
    fn halves_are_rounded_upwards_on_both_sides_of_zero() {
        let scale = Scale::of_encoder(1, 2).unwrap();
        let steps: Vec<i64> = (-4..=4).map(|increments| scale.steps(increments)).collect();
        assert_eq!(steps, [-2, -1, -1, 0, 0, 1, 1, 2, 2]);
    }

    #[test]
    fn a_ratio_of_nothing_is_none() {
        assert_eq!(Scale::of_encoder(0, 1), None);
        assert_eq!(Scale::of_encoder(1, 0), None);
    }

    #[test]
    fn what_an_i64_does_not_hold_is_cut() {
        let scale = Scale::of_encoder(1, u32::MAX).unwrap();
        assert_eq!(scale.steps(i64::MAX), i64::MAX);
        assert_eq!(scale.steps(i64::MIN), i64::MIN);
    }

    proptest! {
        #[test]
        fn every_revolution_looks_the_same(
            lines in 1..100_000_u32,
            steps in 1..1_000_000_u32,
            place in any::<i32>(),
            turns in -1_000_000..1_000_000_i64,
        ) {
            let scale = Scale::of_encoder(lines, steps).unwrap();
            let further = i64::from(place) + turns * 4 * i64::from(lines);
            prop_assert_eq!(scale.steps(further), scale.steps(i64::from(place)) + turns * i64::from(steps));
        }
    }
}
