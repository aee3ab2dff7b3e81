//! The search for a mark, the primitive of homing.

use super::fence::Side;
use crate::inputs::{Latches, Switch, Switches};
use crate::order::{Finish, Mark, Seek};
use crate::profile::Profile;
use crate::units::{Position, Torque};

/// What a search looks at in each raster step, in axis coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sample {
    pub(super) switches: Switches,
    pub(super) latches: Latches,
    pub(super) torque: Torque,
    pub(super) position: Position,
}

/// A search under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seeking {
    pub(super) seek: Seek,
    /// The mark is found, the axis comes to rest.
    pub(super) is_finishing: bool,
    /// Raster steps on end with the torque looked for.
    pushed: u32,
}

impl Seeking {
    pub(super) fn new(seek: Seek) -> Self {
        Self { seek, is_finishing: false, pushed: 0 }
    }

    /// How the axis runs.
    pub(super) fn profile(&self) -> Profile {
        Profile {
            velocity: self.seek.velocity.abs(),
            acceleration: self.seek.acceleration,
            deceleration: self.seek.deceleration,
            ..Profile::default()
        }
    }

    /// How the axis comes to rest; at a mechanical stop there is no room for a ramp.
    pub(super) fn finish(&self) -> Finish {
        match self.seek.mark {
            Mark::Torque { .. } => Finish::Abrupt,
            Mark::Switch { .. } | Mark::Index => self.seek.finish,
        }
    }

    /// Whether this side's limit switch, actuated, is the mark.
    pub(super) fn is_after(&self, side: Side) -> bool {
        let switch = match side {
            Side::Positive => Switch::PositiveLimit,
            Side::Negative => Switch::NegativeLimit,
        };
        self.seek.mark == Mark::Switch { switch, actuated: true }
    }

    /// Whether the mark is an end of travel.
    pub(super) fn is_after_limit(&self) -> bool {
        self.is_after(Side::Positive) || self.is_after(Side::Negative)
    }

    /// Whether the axis pushes against something: then it cannot follow its demand.
    pub(super) fn pushes(&self) -> Option<Torque> {
        match self.seek.mark {
            Mark::Torque { limit, .. } if !self.is_finishing => Some(limit.abs()),
            Mark::Torque { .. } | Mark::Switch { .. } | Mark::Index => None,
        }
    }

    /// Where the mark is, if this step has found it.
    pub(super) fn look(&mut self, sample: &Sample) -> Option<Position> {
        match self.seek.mark {
            Mark::Switch { switch, actuated } => {
                // A latch that changed without the state changing has seen a switch narrower than a step.
                let latch = switch.latch(&sample.latches);
                let is_found = switch.is_actuated(&sample.switches) == actuated || latch.is_some();
                is_found.then(|| latch.unwrap_or(sample.position))
            }
            Mark::Index => sample.latches.index,
            Mark::Torque { limit, steps } => {
                let is_pushing = sample.torque.abs() >= limit.abs();
                self.pushed = if is_pushing { self.pushed.saturating_add(1) } else { 0 };
                (self.pushed >= steps.get()).then_some(sample.position)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use core::num::NonZeroU32;

    use super::*;
    use crate::units::{Acceleration, Velocity};

    fn seeking(mark: Mark) -> Seeking {
        Seeking::new(Seek {
            mark,
            velocity: Velocity(-100.0),
            acceleration: Acceleration(0.0),
            deceleration: Acceleration(0.0),
            finish: Finish::Ramp,
        })
    }

    #[test]
    fn the_latch_is_preferred_to_the_place_of_the_sample() {
        let mut seeking = seeking(Mark::Switch { switch: Switch::Home, actuated: true });
        let mut sample = Sample { position: Position(50.0), ..Sample::default() };
        assert_eq!(seeking.look(&sample), None);
        sample.switches.home = true;
        assert_eq!(seeking.look(&sample), Some(Position(50.0)));
        sample.latches.home = Some(Position(47.0));
        assert_eq!(seeking.look(&sample), Some(Position(47.0)));
    }

    #[test]
    fn a_switch_narrower_than_a_step_is_not_missed() {
        let mut seeking = seeking(Mark::Switch { switch: Switch::Home, actuated: true });
        let latches = Latches { home: Some(Position(12.0)), ..Latches::default() };
        assert_eq!(seeking.look(&Sample { latches, ..Sample::default() }), Some(Position(12.0)));
    }

    #[test]
    fn a_torque_counts_when_it_lasts() {
        let steps = NonZeroU32::new(3).unwrap();
        let mut seeking = seeking(Mark::Torque { limit: Torque(200.0), steps });
        let torques = [-200.0, -250.0, -100.0, -200.0, -200.0, -200.0];
        let found = torques
            .map(|torque| seeking.look(&Sample { torque: Torque(torque), ..Sample::default() }).is_some());
        assert_eq!(found, [false, false, false, false, false, true]);
    }
}
