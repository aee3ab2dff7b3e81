//! A motor and its load in motion: inertia, friction, gravity, backlash and hard stops.
//!
//! Motor and load are one rigid body, or two with a gap between them. In the gap each moves by itself. Where
//! it closes, the velocities after the step follow from momentum and from the gap that is left, so that the
//! gap is never wider than the backlash, an impact never adds energy, and no step is too long to be stable.

use core::f64::consts::TAU;

use super::{PlantConfig, within};
use crate::limits::PositionRange;
use crate::units::{Position, Torque, cut};

/// Speed below which friction holds what no torque drives, in counts/s.
const REST: f64 = 1e-3;
/// A gap narrower than this is closed, in counts.
const CLOSED: f64 = 1e-9;

/// What the motor moves, as seen from its shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Inertia, in kg·m².
    pub inertia_kgm2: f64,
    /// Constant torque in positive direction, such as the weight of a vertical axis, in N·m.
    pub gravity_nm: f64,
    /// Friction torque in proportion to speed, in N·m·s/rad.
    pub viscous_friction_nms: f64,
    /// Friction torque that only has a direction, in N·m.
    pub coulomb_friction_nm: f64,
}

impl Default for Load {
    /// About three times the inertia of the default rotor, without friction of its own.
    fn default() -> Self {
        Self { inertia_kgm2: 1e-4, gravity_nm: 0.0, viscous_friction_nms: 0.0, coulomb_friction_nm: 0.0 }
    }
}

/// Inertia and friction of something that turns; N·m, kg·m², N·m·s/rad.
#[derive(Clone, Copy, Debug)]
struct Mass {
    inertia: f64,
    viscous: f64,
    coulomb: f64,
}

impl Mass {
    fn with(self, other: Self) -> Self {
        Self {
            inertia: self.inertia + other.inertia,
            viscous: self.viscous + other.viscous,
            coulomb: self.coulomb + other.coulomb,
        }
    }
}

/// A mass in counts and per mille of rated torque, prepared for steps of one length.
#[derive(Clone, Copy, Debug)]
struct Body {
    /// Change of velocity by one per mille of torque in one step, in counts/s.
    push: f64,
    /// Part of the velocity that viscous friction leaves.
    damping: f64,
    /// Velocity that Coulomb friction takes in one step, in counts/s.
    friction: f64,
}

impl Body {
    fn new(mass: Mass, counts_per_radian: f64, newton_metres: f64, seconds: f64) -> Self {
        let push = counts_per_radian / mass.inertia * seconds;
        let damping = 1.0 / (1.0 + mass.viscous / mass.inertia * seconds);
        Self { push: push * newton_metres * damping, damping, friction: mass.coulomb * push }
    }

    /// The velocity one step later under `torque` and `gravity`.
    fn next(&self, velocity: f64, torque: f64, gravity: f64) -> f64 {
        let free = velocity * self.damping + gravity * self.push + torque * self.push;
        let rubbed = free - cut(free, self.friction);
        if rubbed.abs() > REST { rubbed } else { creep(rubbed, torque + gravity) }
    }
}

/// A velocity that only a torque keeps up. Rare: as a branch of its own it costs the others nothing.
#[cold]
fn creep(velocity: f64, torque: f64) -> f64 {
    if torque == 0.0 { 0.0 } else { velocity }
}

/// How the load hangs on the motor.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Coupling {
    Rigid,
    Backlash,
    Blocked,
}

/// The moving masses. Positions are continuous, in counts; velocities in counts/s.
#[derive(Clone, Debug)]
pub(super) struct Mechanics {
    coupling: Coupling,
    joint: Body,
    position: f64,
    velocity: f64,
    /// N·m per per mille of rated torque.
    newton_metres: f64,
    peak: f64,
    /// In per mille.
    gravity: f64,
    seconds: f64,
    stops: PositionRange,
    feed_forward: FeedForward,
    motor: Body,
    load: Body,
    load_velocity: f64,
    /// Motor position minus load position, at most half the backlash.
    gap: f64,
    half_backlash: f64,
    /// Inertia of the motor as a part of both.
    motor_share: f64,
    counts_per_radian: f64,
    motor_mass: Mass,
    load_mass: Mass,
}

/// Torque in per mille for what a controller wants of the whole.
#[derive(Clone, Copy, Debug, Default)]
struct FeedForward {
    per_acceleration: f64,
    per_velocity: f64,
    coulomb: f64,
}

impl Mechanics {
    pub(super) fn new(config: &PlantConfig) -> Self {
        let default = PlantConfig::default();
        let rated = within(config.rated_torque_nm, 1e-6, 1e6, default.rated_torque_nm);
        let motor_mass = Mass {
            inertia: within(config.motor_inertia_kgm2, 1e-9, 1e6, default.motor_inertia_kgm2),
            viscous: within(config.viscous_friction_nms, 0.0, 1e6, default.viscous_friction_nms),
            coulomb: within(config.coulomb_friction_nm, 0.0, 1e6, default.coulomb_friction_nm),
        };
        let counts_per_radian = f64::from(config.counts_per_revolution.max(1)) / TAU;
        let stops = config.stops.unwrap_or(PositionRange::EXACT);
        let body = Body::new(motor_mass, counts_per_radian, rated / 1000.0, 0.0);
        let mut new = Self {
            coupling: Coupling::Rigid,
            joint: body,
            position: stops.nearest(Position(within(config.start.0, -1e15, 1e15, default.start.0))).0,
            velocity: 0.0,
            newton_metres: rated / 1000.0,
            peak: within(config.peak_torque.0, 0.0, 1e6, default.peak_torque.0),
            gravity: 0.0,
            seconds: 0.0,
            stops,
            feed_forward: FeedForward::default(),
            motor: body,
            load: body,
            load_velocity: 0.0,
            gap: 0.0,
            half_backlash: within(config.backlash.0, 0.0, 1e9, 0.0) / 2.0,
            motor_share: 1.0,
            counts_per_radian,
            motor_mass,
            load_mass: motor_mass,
        };
        new.set_blocked(false);
        new.set_load(&config.load);
        new
    }

    /// Lets `torque` (at most the peak torque) work for `seconds`, 0 to 1.
    #[inline]
    pub(super) fn step(&mut self, torque: Torque, seconds: f64) {
        if seconds.to_bits() != self.seconds.to_bits() {
            self.prepare(seconds);
        }
        let torque = self.limited(torque).0;
        match self.coupling {
            Coupling::Rigid => self.step_as_one(torque),
            Coupling::Backlash => self.step_as_two(torque),
            Coupling::Blocked => (self.velocity, self.load_velocity) = (0.0, 0.0),
        }
    }

    /// The motor's place.
    pub(super) fn position(&self) -> f64 {
        self.position
    }

    /// The load's place.
    pub(super) fn load_position(&self) -> f64 {
        self.position - self.gap
    }

    /// The motor's velocity.
    pub(super) fn velocity(&self) -> f64 {
        self.velocity
    }

    pub(super) fn is_at_rest(&self) -> bool {
        self.velocity == 0.0 && (self.coupling != Coupling::Backlash || self.load_velocity == 0.0)
    }

    /// Motor position minus load position.
    pub(super) fn gap(&self) -> f64 {
        self.gap
    }

    /// Whether motor and load have play between them, and the motor's part of the whole inertia.
    pub(super) fn loose_motor(&self) -> Option<f64> {
        (self.half_backlash > 0.0).then_some(self.motor_share)
    }

    /// What the motor can give of a torque.
    pub(super) fn limited(&self, torque: Torque) -> Torque {
        Torque(cut(torque.0, self.peak))
    }

    /// Mechanical power that the motor gives, in watts.
    pub(super) fn power(&self, torque: Torque) -> f64 {
        torque.0 * self.newton_metres * self.velocity / self.counts_per_radian
    }

    /// Kinetic energy, in joules.
    #[cfg(test)]
    pub(super) fn energy(&self) -> f64 {
        let load = if self.half_backlash > 0.0 { self.load_velocity } else { self.velocity };
        let of = |mass: Mass, velocity: f64| mass.inertia * (velocity / self.counts_per_radian).powi(2) / 2.0;
        of(self.motor_mass, self.velocity) + of(self.load_mass, load)
    }

    /// Whether the shaft is held where it is.
    pub(super) fn is_blocked(&self) -> bool {
        self.coupling == Coupling::Blocked
    }

    /// Holds the shaft where it is, or lets it go.
    pub(super) fn set_blocked(&mut self, blocked: bool) {
        self.coupling = match (blocked, self.half_backlash > 0.0) {
            (true, _) => Coupling::Blocked,
            (false, true) => Coupling::Backlash,
            (false, false) => Coupling::Rigid,
        };
    }

    /// Hangs another load on the motor; velocities stay. What makes no sense counts as zero.
    pub(super) fn set_load(&mut self, load: &Load) {
        // A load behind a gap needs some inertia to have a velocity of its own.
        let least = if self.half_backlash > 0.0 { 1e-9 } else { 0.0 };
        self.load_mass = Mass {
            inertia: within(load.inertia_kgm2, least, 1e6, least),
            viscous: within(load.viscous_friction_nms, 0.0, 1e6, 0.0),
            coulomb: within(load.coulomb_friction_nm, 0.0, 1e6, 0.0),
        };
        self.gravity = within(load.gravity_nm, -1e6, 1e6, 0.0) / self.newton_metres;
        let both = self.motor_mass.with(self.load_mass);
        self.motor_share = self.motor_mass.inertia / both.inertia;
        self.feed_forward = FeedForward {
            per_acceleration: both.inertia / self.counts_per_radian / self.newton_metres,
            per_velocity: both.viscous / self.counts_per_radian / self.newton_metres,
            coulomb: both.coulomb / self.newton_metres,
        };
        self.prepare(self.seconds);
    }

    /// The torque for an acceleration (counts/s²) at a velocity (counts/s), against friction.
    pub(super) fn torque_for(&self, acceleration: f64, velocity: f64) -> Torque {
        let FeedForward { per_acceleration, per_velocity, coulomb } = self.feed_forward;
        let friction = if velocity == 0.0 { 0.0 } else { coulomb.copysign(velocity) };
        Torque(velocity * per_velocity + friction + acceleration * per_acceleration)
    }

    #[cold]
    fn prepare(&mut self, seconds: f64) {
        self.seconds = seconds;
        let body = |mass| Body::new(mass, self.counts_per_radian, self.newton_metres, self.seconds);
        self.joint = body(self.motor_mass.with(self.load_mass));
        if self.half_backlash > 0.0 {
            (self.motor, self.load) = (body(self.motor_mass), body(self.load_mass));
        }
    }

    fn step_as_one(&mut self, torque: f64) {
        self.velocity = self.joint.next(self.velocity, torque, self.gravity);
        self.position += self.velocity * self.seconds;
        let free = Position(self.position);
        if !self.stops.contains(free) {
            self.position = self.stops.nearest(free).0;
            self.velocity = 0.0;
        }
    }

    #[inline(never)]
    fn step_as_two(&mut self, torque: f64) {
        let motor = self.motor.next(self.velocity, torque, 0.0);
        let load = self.load.next(self.load_velocity, 0.0, self.gravity);
        let gap = self.gap + (motor - load) * self.seconds;
        if gap.abs() <= self.half_backlash {
            (self.velocity, self.load_velocity, self.gap) = (motor, load, gap);
        } else {
            self.close(torque, self.half_backlash.copysign(gap));
        }
        self.position += self.velocity * self.seconds;
        self.stop_load();
    }

    /// A step at whose end the gap is `wall`: closed on one side.
    fn close(&mut self, torque: f64, wall: f64) {
        let (motor, load) = (self.motor_share, 1.0 - self.motor_share);
        let together = motor * self.velocity + load * self.load_velocity;
        let together = self.joint.next(together, torque, self.gravity);
        let left = wall - self.gap;
        let closing = if left.abs() > CLOSED && self.seconds > 0.0 { left / self.seconds } else { 0.0 };
        self.velocity = together + load * closing;
        self.load_velocity = together - motor * closing;
        self.gap = wall;
    }

    /// Ends the motion of the load at a hard stop, and that of the motor once it leans on the load.
    fn stop_load(&mut self) {
        let free = Position(self.load_position());
        if self.stops.contains(free) {
            return;
        }
        let stop = self.stops.nearest(free).0;
        self.load_velocity = 0.0;
        let gap = self.position - stop;
        self.gap = cut(gap, self.half_backlash);
        if gap.abs() > self.half_backlash {
            self.position = stop + self.gap;
            self.velocity = 0.0;
        }
    }
}

#[cfg(test)]
mod tests;
