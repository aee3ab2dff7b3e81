//! What an axis can be told to do.

use core::num::NonZeroU32;

use crate::inputs::Switch;
use crate::profile::Profile;
use crate::units::{Acceleration, Position, Torque, Velocity};

/// One motion, given by [`Axis::order`](crate::Axis::order) at once or by [`Axis::then`](crate::Axis::then) after
/// those before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Move to a position, from any state of motion. A target beyond a limit is cut to it, one that is not a
    /// number is a stop. On a circular axis the target lies within a turn, see [`Travel`](crate::Travel).
    MoveTo(Position, Profile),
    /// Move by a distance, on a circular axis by any number of turns.
    MoveBy {
        /// How far.
        distance: Position,
        /// From where.
        from: Base,
        /// How fast.
        profile: Profile,
    },
    /// Run at a velocity, cut to the profile velocity, until told otherwise or stopped by a limit.
    RunAt(Velocity, Profile),
    /// Ramp down and hold; a zero deceleration is the axis maximum.
    Stop(Acceleration),
    /// Ramp down with the emergency deceleration and hold.
    Brake,
    /// Be at a position so many raster steps from now, in a straight line, and stay; only the axis maxima bound
    /// the motion. On a circular axis the nearest repetition of the position.
    TrackPosition {
        /// Where to be.
        target: Position,
        /// When.
        over: NonZeroU32,
    },
    /// Have a velocity so many raster steps from now, and keep it; only the axis maxima bound the motion.
    TrackVelocity {
        /// How fast to be.
        target: Velocity,
        /// When.
        over: NonZeroU32,
    },
    /// Give a torque. The speed stays below the axis maximum; where a stop would pass a position limit, the axis
    /// brakes and holds.
    Push {
        /// The torque, cut to the limit.
        torque: Torque,
        /// Its change per second from the present torque on; zero or not a number is at once.
        slope: Torque,
    },
    /// Put out a share of the full scale, -1 to 1, past generator and controller: the test of the wiring. A limit
    /// switch or position limit switches the power off.
    Output(f64),
    /// Look for a mark.
    Seek(Seek),
}

/// From where a relative move counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Base {
    /// The target of the last move, or the demand position if another kind of motion came between.
    #[default]
    Target,
    /// The demand position.
    Demand,
    /// The actual position.
    Actual,
}

/// The primitive of homing: run until a mark is found, then come to rest. [`Status::mark`](crate::Status::mark) tells
/// where it was.
///
/// The limit switch that is looked for does not end the search in failure, as the other one and a position limit do;
/// beyond it the axis brakes with the emergency deceleration at least, as at every limit switch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seek {
    /// What to look for.
    pub mark: Mark,
    /// How fast, and by its sign in which direction.
    pub velocity: Velocity,
    /// Rate at which the speed rises; zero is the axis maximum.
    pub acceleration: Acceleration,
    /// Rate at which the speed falls; zero is the axis maximum.
    pub deceleration: Acceleration,
    /// How to come to rest.
    pub finish: Finish,
}

/// What a search ends at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mark {
    /// A switch that is actuated or not; one that is so at the start is found at once.
    Switch {
        /// Which.
        switch: Switch,
        /// The state looked for.
        actuated: bool,
    },
    /// The next index pulse.
    Index,
    /// A torque, for so many raster steps on end: a mechanical stop. The motor gives no more than that.
    Torque {
        /// The torque, a magnitude.
        limit: Torque,
        /// For how long.
        steps: NonZeroU32,
    },
}

/// How a search comes to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Finish {
    /// By the ramp, wherever that ends: the coarse search.
    #[default]
    Ramp,
    /// As fast as the axis can, as from a justification velocity; at a mechanical stop always.
    Abrupt,
    /// By the ramp, then back to the exact place of the mark: the fine search.
    Return,
}

/// How far a search has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SeekState {
    /// There was none since the last other order.
    #[default]
    None,
    /// On the way.
    Searching,
    /// The mark was found; with [`Status::done`](crate::Status::done) the axis has come to rest as it should.
    Found,
    /// A limit came first.
    Failed,
}
