//! The simulated mechanics: a motor with a load, friction, an encoder, switches and hard stops.

use core::f64::consts::TAU;

use crate::drive::Switches;
use crate::limits::PositionRange;
use crate::units::{Position, Torque, Velocity};

/// Speed below which friction holds what no torque drives, in counts/s.
const REST: f64 = 1e-3;

/// What the plant is made of. A value that makes no sense (not a number, not positive where it has to be)
/// counts as its default.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantConfig {
    /// Encoder resolution.
    pub counts_per_revolution: u32,
    /// Torque that is 1000 per mille, in N·m.
    pub rated_torque_nm: f64,
    /// Highest torque of the motor.
    pub peak_torque: Torque,
    /// Inertia of the rotor, in kg·m².
    pub motor_inertia_kgm2: f64,
    /// Inertia of the load as the motor sees it, in kg·m².
    pub load_inertia_kgm2: f64,
    /// Friction torque in proportion to speed, in N·m·s/rad.
    pub viscous_friction_nms: f64,
    /// Friction torque that only has a direction, in N·m.
    pub coulomb_friction_nm: f64,
    /// Where the plant stands at the start.
    pub start: Position,
    /// Where in a revolution the index pulse is.
    pub index: Position,
    /// The positive limit switch is actuated from here on upwards.
    pub positive_switch: Option<Position>,
    /// The negative limit switch is actuated from here on downwards.
    pub negative_switch: Option<Position>,
    /// The home switch is actuated in this range.
    pub home_switch: Option<PositionRange>,
    /// Hard stops: the plant cannot leave this range.
    pub stops: Option<PositionRange>,
}

impl Default for PlantConfig {
    /// A 400 W servo motor with a load of about three times its own inertia.
    fn default() -> Self {
        Self {
            counts_per_revolution: 8192,
            rated_torque_nm: 1.27,
            peak_torque: Torque(3000.0),
            motor_inertia_kgm2: 3e-5,
            load_inertia_kgm2: 1e-4,
            viscous_friction_nms: 1e-4,
            coulomb_friction_nm: 0.03,
            start: Position(0.0),
            index: Position(0.0),
            positive_switch: None,
            negative_switch: None,
            home_switch: None,
            stops: None,
        }
    }
}

/// The mechanics in motion. Its position is continuous; the encoder shows whole counts of it.
#[derive(Clone, Debug)]
pub struct Plant {
    peak: f64,
    /// Acceleration by one per mille of torque, in counts/s².
    gain: f64,
    /// Coulomb friction as a deceleration, in counts/s².
    coulomb: f64,
    /// Viscous friction as a deceleration per velocity, in 1/s.
    viscous: f64,
    counts: f64,
    index_at: f64,
    stops: PositionRange,
    config: PlantConfig,
    position: f64,
    velocity: f64,
    index: Option<Position>,
}

impl Plant {
    /// A plant at rest at its start.
    #[must_use]
    pub fn new(config: PlantConfig) -> Self {
        let default = PlantConfig::default();
        let inertia = within(config.motor_inertia_kgm2, 1e-9, 1e6, default.motor_inertia_kgm2)
            + within(config.load_inertia_kgm2, 0.0, 1e6, default.load_inertia_kgm2);
        let rated = within(config.rated_torque_nm, 1e-6, 1e6, default.rated_torque_nm);
        let counts = f64::from(config.counts_per_revolution.max(1));
        let coulomb = within(config.coulomb_friction_nm, 0.0, 1e6, default.coulomb_friction_nm);
        let stops = config.stops.unwrap_or(PositionRange::EXACT);
        Self {
            peak: within(config.peak_torque.0, 0.0, 1e6, default.peak_torque.0),
            gain: rated / 1000.0 / inertia * counts / TAU,
            coulomb: coulomb / inertia * counts / TAU,
            viscous: within(config.viscous_friction_nms, 0.0, 1e6, default.viscous_friction_nms) / inertia,
            counts,
            index_at: within(config.index.0, -1e9, 1e9, default.index.0),
            position: stops.nearest(Position(within(config.start.0, -1e15, 1e15, default.start.0))).0,
            velocity: 0.0,
            index: None,
            stops,
            config,
        }
    }

    /// Lets `torque` (at most the peak torque) work for `seconds`; friction and stops work along.
    pub fn step(&mut self, torque: Torque, seconds: f64) {
        let drive = torque.0.max(-self.peak).min(self.peak) * self.gain;
        let free = (self.velocity + drive * seconds) / (1.0 + self.viscous * seconds);
        let friction = self.coulomb * seconds;
        let rubbed = if free > 0.0 { (free - friction).max(0.0) } else { (free + friction).min(0.0) };
        let before = self.position;
        self.velocity = if drive.abs() > 0.0 || rubbed.abs() > REST { rubbed } else { 0.0 };
        self.position += self.velocity * seconds;
        self.hit_stops();
        self.pass_index(before);
    }

    /// What the encoder shows: the nearest whole count.
    #[must_use]
    pub fn encoder(&self) -> Position {
        Position((self.position + 0.5).floor())
    }

    /// The velocity, as an ideal tachometer shows it.
    #[must_use]
    pub fn velocity(&self) -> Velocity {
        Velocity(self.velocity)
    }

    /// The exact place of the last index passage.
    #[must_use]
    pub fn index(&self) -> Option<Position> {
        self.index
    }

    /// The switches at the present place.
    #[must_use]
    pub fn switches(&self) -> Switches {
        let place = self.encoder();
        Switches {
            positive_limit: self.config.positive_switch.is_some_and(|from| place >= from),
            negative_limit: self.config.negative_switch.is_some_and(|from| place <= from),
            home: self.config.home_switch.is_some_and(|range| range.contains(place)),
        }
    }

    /// The torque that accelerates the plant by `acceleration` (counts/s²) while it moves at `velocity`
    /// (counts/s).
    #[must_use]
    pub(crate) fn torque_for(&self, acceleration: f64, velocity: f64) -> Torque {
        let direction = if velocity == 0.0 { 0.0 } else { velocity.signum() };
        Torque((acceleration + self.viscous * velocity + self.coulomb * direction) / self.gain)
    }

    fn hit_stops(&mut self) {
        let free = Position(self.position);
        if !self.stops.contains(free) {
            self.position = self.stops.nearest(free).0;
            self.velocity = 0.0;
        }
    }

    fn pass_index(&mut self, before: f64) {
        let revolution = |position: f64| ((position - self.index_at) / self.counts).floor();
        let (from, to) = (revolution(before), revolution(self.position));
        let at = |revolution: f64| Some(Position(revolution * self.counts + self.index_at));
        if to > from {
            self.index = at(to);
        } else if to < from {
            self.index = at(to + 1.0);
        }
    }
}

/// `value` when it is a number from `min` to `max`, else `default`.
fn within(value: f64, min: f64, max: f64, default: f64) -> f64 {
    if (min..=max).contains(&value) { value } else { default }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 125e-6;

    fn run(plant: &mut Plant, torque: f64, steps: u32) {
        (0..steps).for_each(|_| plant.step(Torque(torque), STEP));
    }

    #[test]
    fn torque_below_the_friction_moves_nothing() {
        let mut plant = Plant::new(PlantConfig::default());
        run(&mut plant, 23.0, 1000);
        assert_eq!(plant.velocity(), Velocity(0.0));
        run(&mut plant, 24.0, 1000);
        assert!(plant.velocity() > Velocity(0.0));
    }

    #[test]
    fn rated_torque_accelerates_the_inertia() {
        let config =
            PlantConfig { coulomb_friction_nm: 0.0, viscous_friction_nms: 0.0, ..PlantConfig::default() };
        let mut plant = Plant::new(config);
        run(&mut plant, 1000.0, 80);
        let expected = 1.27 / 1.3e-4 / TAU * 8192.0 * 0.01;
        assert!((plant.velocity().0 - expected).abs() < 1e-6 * expected);
    }

    #[test]
    fn coasting_slows_down_by_friction_only_and_ends_at_rest() {
        let mut plant = Plant::new(PlantConfig::default());
        run(&mut plant, 500.0, 800);
        let mut last = plant.velocity().0;
        let coulomb = 0.03 / 1.3e-4 / TAU * 8192.0 * STEP;
        while last > 0.0 {
            run(&mut plant, 0.0, 1);
            let lost = last - plant.velocity().0;
            let viscous = last * 1e-4 / 1.3e-4 * STEP;
            assert!(lost > 0.0 && lost <= coulomb + viscous + 1e-9);
            last = plant.velocity().0;
        }
        let rest = plant.position;
        run(&mut plant, 0.0, 100);
        assert_eq!(plant.position.to_bits(), rest.to_bits());
    }

    #[test]
    fn the_index_is_latched_exactly_in_both_directions() {
        let mut plant = Plant::new(PlantConfig { index: Position(100.0), ..PlantConfig::default() });
        assert_eq!(plant.index(), None);
        while plant.encoder() < Position(9000.0) {
            run(&mut plant, 200.0, 1);
        }
        assert_eq!(plant.index(), Some(Position(8292.0)));
        while plant.encoder() > Position(50.0) {
            run(&mut plant, -200.0, 1);
        }
        assert_eq!(plant.index(), Some(Position(100.0)));
    }

    #[test]
    fn switches_and_hard_stops_are_where_they_were_put() {
        let range = |min, max| PositionRange::new(Position(min), Position(max));
        let mut plant = Plant::new(PlantConfig {
            positive_switch: Some(Position(900.0)),
            negative_switch: Some(Position(-900.0)),
            home_switch: range(-10.0, 10.0),
            stops: range(-1000.0, 1000.0),
            ..PlantConfig::default()
        });
        assert_eq!(plant.switches(), Switches { home: true, ..Switches::default() });
        run(&mut plant, 100.0, 4000);
        assert_eq!(plant.switches(), Switches { positive_limit: true, ..Switches::default() });
        assert_eq!((plant.encoder(), plant.velocity()), (Position(1000.0), Velocity(0.0)));
        run(&mut plant, -100.0, 4000);
        assert_eq!(plant.switches(), Switches { negative_limit: true, ..Switches::default() });
    }

    #[test]
    fn a_plant_of_nonsense_is_the_default_one() {
        let nan = f64::NAN;
        let mut plant = Plant::new(PlantConfig {
            counts_per_revolution: 0,
            rated_torque_nm: nan,
            peak_torque: Torque(nan),
            motor_inertia_kgm2: 0.0,
            load_inertia_kgm2: -1.0,
            viscous_friction_nms: f64::INFINITY,
            coulomb_friction_nm: nan,
            start: Position(nan),
            index: Position(nan),
            ..PlantConfig::default()
        });
        run(&mut plant, f64::NAN, 10);
        run(&mut plant, f64::INFINITY, 100);
        assert!(plant.velocity().0.is_finite() && plant.encoder().0.is_finite());
    }
}
