//! The gear modes: the motor follows the external encoder by GEARF1 / GEARF2, within V_SOLL and A_SOLL.
//!
//! What the limits keep the motor from is made up for later, but not in gear follow, which has the velocity alone.

use axis::{Position, Velocity};

use super::Demand;
use crate::Role;
use crate::jvl::follower::Follower;
use crate::jvl::motor::Sample;
use crate::jvl::motor::mode::Mode;
use crate::jvl::units::MacUnits;

/// How the motor is coupled to the external encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coupling {
    /// Count for count.
    Fixed,
    /// The same, and a velocity by the analogue input on top.
    WithVelocity,
    /// The analogue input multiplies the ratio.
    Variable,
    /// By its velocity; what the limits take away is gone.
    VelocityOnly,
}

/// A gear mode.
#[derive(Debug)]
pub(crate) struct Gear {
    coupling: Coupling,
    /// Where the motor would be without limits.
    ideal: Position,
    /// How fast that moves.
    pace: Velocity,
}

impl Gear {
    /// The mode from where the axis is: the two are engaged now.
    pub(super) fn new(coupling: Coupling, sample: &Sample<'_, '_>) -> Self {
        Self { coupling, ideal: sample.axis().status().demand.position, pace: Velocity(0.0) }
    }

    pub(super) fn mode(&self) -> Mode {
        match self.coupling {
            Coupling::Fixed => Mode::GearPosition,
            Coupling::WithVelocity => Mode::AnalogVelocityGear,
            Coupling::Variable => Mode::AnalogGear,
            Coupling::VelocityOnly => Mode::GearFollow,
        }
    }

    pub(super) fn ideal(&self) -> Position {
        self.ideal
    }

    pub(super) fn shift(&mut self, distance: Position) {
        self.ideal = self.ideal + distance;
    }

    /// Follows the external encoder for one raster step.
    pub(super) fn step(&mut self, sample: &mut Sample<'_, '_>) {
        self.pace = self.pace_of(sample);
        if self.coupling == Coupling::VelocityOnly {
            self.ideal = sample.axis().status().demand.position;
        }
        self.ideal = self.ideal + Position(self.pace.0 * sample.raster());
    }

    pub(super) fn demand(&mut self, sample: &mut Sample<'_, '_>) -> Demand {
        let demand = sample.axis().status().demand;
        let follower = Follower {
            raster: sample.raster(),
            speed: sample.velocity(Role::VSoll).abs().0,
            ramp: sample.acceleration(Role::ASoll).0,
        };
        let behind = self.ideal - demand.position;
        Demand::Follow(follower.next(behind, self.pace, demand.velocity))
    }

    fn pace_of(&self, sample: &Sample<'_, '_>) -> Velocity {
        let share = MacUnits::share(sample.analog);
        let Velocity(geared) = Velocity(sample.external_encoder().0 * ratio(sample));
        Velocity(match self.coupling {
            Coupling::Fixed | Coupling::VelocityOnly => geared,
            Coupling::WithVelocity => geared + share * sample.velocity(Role::VSoll).0,
            Coupling::Variable => geared * share,
        })
    }
}

/// Counts of the motor for one of the external encoder; none where GEARF2 is zero.
pub(in crate::jvl::motor) fn ratio(sample: &Sample<'_, '_>) -> f64 {
    let (input, output) = (sample.register(Role::Gearf1), sample.register(Role::Gearf2));
    if output == 0 { 0.0 } else { f64::from(input) / f64::from(output) }
}
