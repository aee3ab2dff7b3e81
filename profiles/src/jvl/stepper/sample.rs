//! What a stepper works with in one sample: its registers in their units, and its axis.

use axis::{Acceleration, Axis, Position, Profile, Travel, Turn, Velocity};

use super::bits::{Setup, ZeroSearch};
use super::units::{self, StepUnits};
use crate::vendor::Scope;
use crate::{Role, StepperMotor};

/// A stepper's surroundings at one moment.
pub(super) struct Sample<'s, 'a> {
    pub(super) scope: &'s mut Scope<'a>,
    pub(super) units: StepUnits,
    pub(super) stepper: StepperMotor,
}

/// Which way a turn table goes to its target (TURNTAB_MODE).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turning {
    Positive,
    Negative,
    Shortest,
}

impl<'s, 'a> Sample<'s, 'a> {
    pub(super) fn new(stepper: StepperMotor, scope: &'s mut Scope<'a>) -> Self {
        let is_reversed = scope.register(Role::SetupBits) & Setup::REVERSED.bits() != 0;
        let units = StepUnits::new(scope.motor, is_reversed);
        Self { scope, units, stepper }
    }

    pub(super) fn register(&self, role: Role) -> i32 {
        self.scope.register(role)
    }

    pub(super) fn set(&mut self, role: Role, value: i32) {
        self.scope.show_register(role, value);
    }

    pub(super) fn setup(&self) -> Setup {
        Setup::from_bits_truncate(self.register(Role::SetupBits))
    }

    pub(super) fn zero_search(&self) -> ZeroSearch {
        ZeroSearch::from_bits_truncate(self.register(Role::ZeroSearchBits))
    }

    pub(super) fn is_reversed(&self) -> bool {
        self.setup().contains(Setup::REVERSED)
    }

    pub(super) fn velocity(&self, role: Role) -> Velocity {
        self.units.velocity(self.register(role))
    }

    pub(super) fn acceleration(&self, role: Role) -> Acceleration {
        self.units.acceleration(self.register(role))
    }

    /// V_SOLL without its sign, and this ramp both ways.
    pub(super) fn profile(&self, ramp: Acceleration) -> Profile {
        Profile {
            velocity: self.velocity(Role::VSoll).abs(),
            acceleration: ramp,
            deceleration: ramp,
            jerk: None,
        }
    }

    pub(super) fn axis(&self) -> &Axis {
        self.scope.axis
    }

    pub(super) fn axis_mut(&mut self) -> &mut Axis {
        self.scope.axis
    }

    /// Where the axis ought to be, and whole: the steps that the motor has been given.
    pub(super) fn demand(&self) -> Position {
        self.axis().status().demand.position
    }

    /// Time of one raster step, in seconds.
    pub(super) fn raster(&self) -> f64 {
        self.axis().period().seconds()
    }

    /// Velocity of the external encoder; none while its input is off.
    pub(super) fn external_velocity(&self) -> Velocity {
        let setup = self.setup();
        if !setup.intersects(Setup::QUADRATURE | Setup::PULSE_DIRECTION) {
            return Velocity(0.0);
        }
        let velocity = self.scope.external_encoder;
        if setup.contains(Setup::EXTERNAL_REVERSED) { -velocity } else { velocity }
    }

    /// The turn of a turn table and the way to its targets, if the motor drives one.
    pub(super) fn turn_table(&self) -> Option<(Turn, Turning)> {
        let turning = match self.register(Role::TurntabMode) {
            1 => Turning::Positive,
            2 => Turning::Negative,
            3 => Turning::Shortest,
            _ => return None,
        };
        Some((Turn::new(Position(f64::from(self.register(Role::TurntabSize))))?, turning))
    }

    /// How positions of the motor repeat.
    pub(super) fn travel(&self) -> Travel {
        self.turn_table().map_or(Travel::Linear, |(turn, _)| Travel::Circular(turn))
    }

    /// A place on the axis as P_IST has it.
    pub(super) fn counter(&self, place: Position) -> i32 {
        match self.turn_table() {
            Some((turn, _)) => {
                let within = self.units.way(place).0.round().rem_euclid(turn.length().0);
                units::counter(Position(within))
            }
            None => self.units.counter(place),
        }
    }

    /// The place on the axis that a position register means for one at `near`.
    pub(super) fn place(&self, value: i32, near: Position) -> Position {
        match self.turn_table() {
            Some((turn, _)) => {
                Position(self.units.way(Position(f64::from(value))).0.rem_euclid(turn.length().0))
            }
            None => self.units.place(value, near),
        }
    }
}
