//! The pulse output of a stepper controller: a frequency a sampling period, on whole multiples of a quantum.
//!
//! Each period it is told where to be. It puts out the multiple of the frequency quantum that comes nearest
//! to there; what is left is carried to the next period. So a frequency between two quanta becomes the
//! alternation of both, exact in the long term (MACCON MAC4 User Manual, section 4.1.3: "rounding effects
//! with a minimum of modulation"), and the place put out is never further from the demanded one than half
//! of what a quantum covers in a period, unless the highest frequency was not enough.
//!
//! Fixed point: the place is a whole number of the 65536·20000th part of a step, in which every quantum
//! covers a whole number in a period of whole nanoseconds. A pulse falls where the place crosses the middle
//! between two steps, so at rest the number of pulses is the step demanded. (In TURBO with a period of more
//! than 131 ms a quantum covers more than a step, and the rest may be a few steps beside.)

use core::fmt;
use core::num::NonZeroU32;

use crate::limits::PositionRange;
use crate::units::{Period, Position};

/// The highest frequency in quanta: 50 kHz are 65536 x 0.7629 Hz, TURBO 500 kHz are 65536 x 7.629 Hz (MACCON
/// MAC4 User Manual, table 4.1).
pub const MAX_QUANTA: i32 = 65_536;

/// The same in Hz, without TURBO.
const HIGHEST_HZ: f64 = 50_000.0;

/// Parts of a step: a quantum of 50 kHz / 65536 covers one a nanosecond.
const STEP: i128 = 65_536 * 20_000;

/// What TURBO multiplies frequencies by.
const TURBO: i128 = 10;

/// The pulse output of one axis.
#[derive(Clone, Debug)]
pub struct Pulses {
    period: Period,
    /// What all frequencies are multiplied by, TURBO aside.
    factor: NonZeroU32,
    lead_periods: u64,
    turbo: bool,
    boost: Boost,
    quanta: i32,
    place: i128,
}

/// What is put out during one period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PulseOutput {
    /// Pulses so far, forward minus backward: the step at the end of the period.
    pub steps: i64,
    /// The frequency, in quanta of 0.7629 Hz, in TURBO of 7.629 Hz; negative is backwards.
    pub frequency_quanta: i32,
    /// The BOOST signal.
    pub boost: bool,
    /// Whether pulses are possible: false while BOOST leads, and at rest without it.
    pub ready: bool,
    /// Whether the demand was above the highest frequency.
    pub limited: bool,
    /// Demanded minus generated place, in steps.
    pub lag: Position,
}

/// The BOOST signal: off at standstill, on for a time before a motion and until its end (MACCON MAC4 User
/// Manual, sections 4.1.4 and 5.14).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Boost {
    Off,
    /// On, with the periods still to go before the first pulse.
    Leading(u64),
    On,
}

/// The refusal to change the range of frequencies during a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InMotion;

impl fmt::Display for InMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the pulse output is in motion")
    }
}

impl core::error::Error for InMotion {}

impl Pulses {
    /// An output at rest at step 0, in normal operation and without a lead of BOOST.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self::with_factor(period, NonZeroU32::MIN)
    }

    /// The same with all frequencies and their quantum multiplied by `factor`: a drive that makes its pulses inside
    /// is not bound to what a cable carries. Where a quantum covers more than a step in a period, the place put out
    /// may be a few steps beside the demanded one.
    #[must_use]
    pub fn with_factor(period: Period, factor: NonZeroU32) -> Self {
        Self { period, factor, lead_periods: 0, turbo: false, boost: Boost::Off, quanta: 0, place: 0 }
    }

    /// Sets how long BOOST is on before a motion (`<bt>`), in ns, rounded up to whole periods; it counts
    /// from the next motion on.
    pub fn set_boost_lead(&mut self, nanos: u64) {
        self.lead_periods = nanos.div_ceil(self.period.nanos());
    }

    /// Switches TURBO: ten times the frequencies and their quantum.
    ///
    /// # Errors
    ///
    /// During a motion, its BOOST included, nothing is switched.
    pub fn set_turbo(&mut self, on: bool) -> Result<(), InMotion> {
        if on != self.turbo && self.is_moving() {
            return Err(InMotion);
        }
        self.turbo = on;
        Ok(())
    }

    /// Whether TURBO is on.
    #[must_use]
    pub fn is_turbo(&self) -> bool {
        self.turbo
    }

    /// The highest frequency, in Hz.
    #[must_use]
    pub fn highest_hz(&self) -> f64 {
        let turbo = if self.turbo { TURBO } else { 1 };
        HIGHEST_HZ * f64::from(self.factor.get()) * turbo as f64
    }

    /// Whether a motion is going on or BOOST leads one.
    #[must_use]
    pub fn is_moving(&self) -> bool {
        self.quanta != 0 || self.boost != Boost::Off
    }

    /// The place put out so far in steps, with the fraction on the way to the next pulse; to demand it stops
    /// the pulses at once.
    #[must_use]
    pub fn place(&self) -> Position {
        steps(self.place)
    }

    /// Goes on by one period, at the end of which the motor has to be at `target`, in steps; the target may
    /// lie between two steps, and is cut to ±2^53. What is not a number stops the pulses.
    ///
    /// `moving` tells that a motion is about to begin or has not ended. From its first period on BOOST is
    /// on; the caller holds the target until the output is ready. A target that changes all the same begins
    /// a motion too, and is caught up with after the lead.
    pub fn step(&mut self, target: Position, moving: bool) -> PulseOutput {
        let target = if target.0.is_nan() { self.place } else { parts(target) };
        let way = target - self.place;
        let wanted = nearest(way, self.quantum());
        self.boost = self.next_boost(moving || wanted != 0);
        self.quanta = match self.boost {
            Boost::Off | Boost::Leading(_) => 0,
            Boost::On => cut(wanted),
        };
        self.place += i128::from(self.quanta) * self.quantum();
        PulseOutput {
            steps: i64::try_from(nearest_step(self.place)).unwrap_or_default(),
            frequency_quanta: self.quanta,
            boost: self.boost != Boost::Off,
            ready: self.boost == Boost::On,
            limited: wanted.abs() > i128::from(MAX_QUANTA),
            lag: steps(target - self.place),
        }
    }

    fn next_boost(&self, wanted: bool) -> Boost {
        match (self.boost, wanted) {
            (_, false) => Boost::Off,
            (Boost::Off, true) => leading(self.lead_periods),
            (Boost::Leading(left), true) => leading(left.saturating_sub(1)),
            (Boost::On, true) => Boost::On,
        }
    }

    /// What a quantum covers in a period, in parts of a step.
    fn quantum(&self) -> i128 {
        let turbo = if self.turbo { TURBO } else { 1 };
        i128::from(self.period.nanos()) * i128::from(self.factor.get()) * turbo
    }
}

fn leading(periods: u64) -> Boost {
    if periods > 0 { Boost::Leading(periods) } else { Boost::On }
}

/// The number of quanta that come nearest to `way`; of two, the smaller.
fn nearest(way: i128, quantum: i128) -> i128 {
    way.signum() * ((2 * way.abs() + quantum - 1) / (2 * quantum))
}

fn cut(quanta: i128) -> i32 {
    let highest = i128::from(MAX_QUANTA);
    i32::try_from(quanta.clamp(-highest, highest)).unwrap_or_default()
}

/// The whole step nearest to a place; the middle belongs to the upper one.
fn nearest_step(place: i128) -> i128 {
    (place + STEP / 2).div_euclid(STEP)
}

/// A place in parts of a step, rounded down.
fn parts(place: Position) -> i128 {
    let place = PositionRange::EXACT.nearest(place).0;
    let whole = place.floor();
    whole as i128 * STEP + ((place - whole) * STEP as f64).floor() as i128
}

/// A place in steps, from its parts.
fn steps(place: i128) -> Position {
    let (whole, part) = (place.div_euclid(STEP), place.rem_euclid(STEP));
    Position(whole as f64 + part as f64 / STEP as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The sampling period of the MAC4-STP (MACCON MAC4 User Manual, section 7.4).
    const PERIOD: Period = match Period::from_nanos(8_000_000) {
        Some(period) => period,
        None => Period::MILLISECOND,
    };

    /// Steps a quantum covers in that period.
    const QUANTUM: f64 = 50_000.0 / 65_536.0 * 0.008;

    fn output(turbo: bool) -> Pulses {
        let mut pulses = Pulses::new(PERIOD);
        pulses.set_turbo(turbo).unwrap();
        pulses
    }

    fn factor(turbo: bool) -> f64 {
        if turbo { 10.0 } else { 1.0 }
    }

    /// A walk in whole steps that the highest frequency can follow.
    fn walks() -> impl Strategy<Value = Vec<i64>> {
        prop::collection::vec(-400..=400_i64, 1..200).prop_map(|changes| {
            let add = |place: &mut i64, change| {
                *place += change;
                Some(*place)
            };
            changes.into_iter().scan(0, add).collect()
        })
    }

    proptest! {
        #[test]
        fn every_target_is_met_on_the_step(turbo in any::<bool>(), walk in walks()) {
            let mut pulses = output(turbo);
            for target in walk {
                let now = pulses.step(Position(target as f64), true);
                prop_assert_eq!(now.steps, target);
                prop_assert!(!now.limited && now.lag.abs().0 <= QUANTUM * factor(turbo) / 2.0);
                prop_assert_eq!(pulses.place() + now.lag, Position(target as f64));
            }
        }

        #[test]
        fn the_pulses_are_those_of_the_frequencies_put_out(turbo in any::<bool>(), walk in walks()) {
            let mut pulses = output(turbo);
            let mut place = 0.0;
            for target in walk {
                let now = pulses.step(Position(target as f64), true);
                // Both factors are dyadic, so the sum is exact.
                place += f64::from(now.frequency_quanta) * QUANTUM * factor(turbo);
                prop_assert_eq!(now.steps, (place + 0.5).floor() as i64);
            }
        }

        #[test]
        fn a_velocity_between_two_quanta_alternates_between_both(
            turbo in any::<bool>(),
            velocity in -49_000.0..49_000.0_f64,
        ) {
            let mut pulses = output(turbo);
            let quanta = velocity / (50_000.0 / 65_536.0 * factor(turbo));
            let mut sum = 0;
            for period in 1..=1000 {
                let target = velocity * 0.008 * f64::from(period);
                let now = pulses.step(Position(target), true);
                prop_assert!((f64::from(now.frequency_quanta) - quanta).abs() < 1.001);
                sum += now.frequency_quanta;
                prop_assert!((f64::from(sum) - quanta * f64::from(period)).abs() < 0.501);
            }
        }

        #[test]
        fn no_frequency_is_above_the_highest_and_what_was_cut_is_caught_up_with(
            turbo in any::<bool>(),
            target in -10_000_000..10_000_000_i64,
        ) {
            let mut pulses = output(turbo);
            let target_place = Position(target as f64);
            let reach = (400.0 * factor(turbo)) as u64;
            for _ in 0..target.unsigned_abs() / reach {
                let now = pulses.step(target_place, true);
                prop_assert_eq!(now.frequency_quanta.abs(), MAX_QUANTA);
                prop_assert_eq!(now.lag, target_place - Position(now.steps as f64));
            }
            let last = pulses.step(target_place, true);
            prop_assert_eq!((last.steps, last.limited), (target, false));
            prop_assert_eq!(pulses.step(target_place, false).frequency_quanta, 0);
        }

        #[test]
        fn no_pulse_is_given_while_boost_leads(
            lead in 0..200_000_000_u64,
            announced in any::<bool>(),
            target in prop_oneof![-1000..-1_i64, 1..1000_i64],
        ) {
            let mut pulses = output(false);
            pulses.set_boost_lead(lead);
            let start = Position(if announced { 0.0 } else { target as f64 });
            for _ in 0..lead.div_ceil(8_000_000) {
                let now = pulses.step(start, announced);
                prop_assert_eq!((now.boost, now.ready, now.frequency_quanta, now.steps), (true, false, 0, 0));
            }
            let now = pulses.step(Position(target as f64), true);
            prop_assert!(now.boost && now.ready && now.frequency_quanta != 0);
        }

        #[test]
        fn no_demand_whatever_overflows(
            nanos in 1..=1_000_000_000_u64,
            targets in prop::collection::vec(prop::num::f64::ANY, 1..50),
        ) {
            let mut pulses = Pulses::new(Period::from_nanos(nanos).unwrap());
            for target in targets {
                let now = pulses.step(Position(target), false);
                prop_assert!(now.frequency_quanta.abs() <= MAX_QUANTA && now.lag.0.is_finite());
            }
        }
    }

    #[test]
    fn the_highest_frequencies_are_50_and_500_khz() {
        for (turbo, steps) in [(false, 400), (true, 4_000)] {
            let now = output(turbo).step(Position(1e9), true);
            assert_eq!((now.frequency_quanta, now.steps, now.limited), (MAX_QUANTA, steps, true));
            let backwards = output(turbo).step(Position(-1e9), true);
            assert_eq!((backwards.frequency_quanta, backwards.steps), (-MAX_QUANTA, -steps));
        }
    }

    #[test]
    fn a_slow_motion_is_one_steady_frequency() {
        let mut pulses = output(false);
        for period in 1..=10_000 {
            let now = pulses.step(Position(QUANTUM * f64::from(period)), true);
            assert_eq!((now.frequency_quanta, now.boost), (1, true));
        }
        assert_eq!(pulses.place(), Position(QUANTUM * 10_000.0));
    }

    #[test]
    fn half_of_what_a_quantum_covers_is_left_standing() {
        let mut pulses = output(false);
        for way in [-0.5, 0.5] {
            assert_eq!(pulses.step(Position(way * QUANTUM), false).frequency_quanta, 0);
        }
        assert_eq!(pulses.step(Position(0.51 * QUANTUM), false).frequency_quanta, 1);
    }

    #[test]
    fn boost_is_on_from_the_announcement_to_the_end_of_the_motion() {
        // MACCON MAC4 User Manual, section 7.2: 80 ms, ten periods.
        let mut pulses = output(false);
        pulses.set_boost_lead(80_000_000);
        let demand = |period: i32| Position(f64::from((period - 10).clamp(0, 5) * 100));
        let trace: Vec<_> = (0..17)
            .map(|period| pulses.step(demand(period), period < 15))
            .map(|now| (now.boost, now.ready, now.steps))
            .collect();
        assert_eq!(trace[..10], [(true, false, 0); 10]);
        assert_eq!(trace[10..14].iter().map(|now| now.2).collect::<Vec<_>>(), [0, 100, 200, 300]);
        assert_eq!(trace[14..], [(true, true, 400), (true, true, 500), (false, false, 500)]);
    }

    #[test]
    fn a_withdrawn_announcement_ends_boost_and_the_next_leads_anew() {
        let mut pulses = output(false);
        pulses.set_boost_lead(16_000_001);
        let ready: Vec<bool> =
            [true, true, false, true, true, true, true].map(|m| pulses.step(Position(0.0), m).ready).into();
        assert_eq!(ready, [false, false, false, false, false, false, true]);
    }

    #[test]
    fn turbo_is_switched_at_standstill_only() {
        let mut pulses = output(false);
        pulses.step(Position(0.0), true);
        assert_eq!(pulses.set_turbo(true), Err(InMotion));
        assert_eq!(pulses.set_turbo(false), Ok(()));
        pulses.step(Position(100.0), true);
        assert_eq!((pulses.set_turbo(true), pulses.is_turbo()), (Err(InMotion), false));
        pulses.step(Position(100.0), false);
        assert_eq!((pulses.set_turbo(true), pulses.is_turbo()), (Ok(()), true));
    }

    #[test]
    fn to_demand_the_present_place_stops_the_pulses_at_once() {
        let mut pulses = output(false);
        pulses.step(Position(1000.0), true);
        let here = pulses.place();
        let now = pulses.step(here, false);
        assert_eq!((now.steps, now.frequency_quanta, now.boost), (400, 0, false));
        assert_eq!(pulses.step(Position(f64::NAN), false), now);
    }
}
