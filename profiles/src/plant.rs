//! What a user makes of the simulated plant behind an axis, and how it is broken.

mod fault;
mod signal;

use axis::{
    DcLink, Input, Noise, PlantConfig, Position, PositionRange, ScheduledFault, Supply, Velocity, Voltage,
};

pub use fault::{INPUT_WORDS, PlantFault, Repair, UnknownFault};
pub use signal::{ANALOG_INPUT_V, EXTERNAL_ENCODER_COUNTS_PER_S, Signal, UnknownSignal};

/// Differences from the plant that belongs to the motor; what is `None` stays as it is there. Places are those of
/// the motor's encoder and, like all lengths, in counts. What makes no sense counts as not given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlantSetup {
    /// Inertia of the load as seen from the motor, in kg·m², 0 or more; it is that of the rotor otherwise.
    pub load_inertia_kg_m2: Option<f64>,
    /// Constant torque of the load in positive direction, such as the weight of a vertical axis, in N·m. Without
    /// power and without a stop such an axis falls for ever.
    pub load_torque_nm: Option<f64>,
    /// Friction of the load that only has a direction, in N·m, 0 or more. The motor has its own.
    pub friction_nm: Option<f64>,
    /// Friction of the load in proportion to speed, in N·m·s/rad, 0 or more. The motor has its own.
    pub viscous_friction_nms: Option<f64>,
    /// Play between motor and load, in counts, 0 or more.
    pub backlash: Option<Position>,
    /// Where the plant stands at the start.
    pub start: Option<Position>,
    /// Where in a revolution the index pulse is.
    pub index: Option<Position>,
    /// The positive limit switch is actuated from here on upwards.
    pub positive_limit: Option<Position>,
    /// The negative limit switch is actuated from here on downwards.
    pub negative_limit: Option<Position>,
    /// How far behind its edge a limit switch remains actuated, 0 or more; for ever otherwise.
    pub limit_switch_width: Option<Position>,
    /// The home switch is actuated in this range.
    pub home: Option<PositionRange>,
    /// How much further a switch must move to let go than to be actuated, 0 or more.
    pub hysteresis: Option<Position>,
    /// Hard stops: the load cannot leave this range.
    pub stops: Option<PositionRange>,
    /// The inputs that are low while actuated. The drive has to be told so, too.
    pub active_low: Vec<Input>,
    /// Voltage at the analogue input.
    pub analog_input: Option<Voltage>,
    /// Speed of the encoder that gear modes follow.
    pub external_encoder: Option<Velocity>,
    /// Supply of the power stage.
    pub supply: SupplySetup,
    /// Noise of the sensors while the power stage runs.
    pub noise: NoiseSetup,
    /// Faults that come by themselves, in the time of the plant.
    pub faults: Vec<ScheduledFault>,
}

/// Differences from the supply that belongs to the motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SupplySetup {
    /// Voltage of the source. The thresholds that are not given scale with it.
    pub voltage: Option<Voltage>,
    /// The power stage trips below this.
    pub under_voltage: Option<Voltage>,
    /// The power stage trips above this.
    pub over_voltage: Option<Voltage>,
    /// Capacitance between source and motor, in farads.
    pub capacitance_f: Option<f64>,
    /// Voltage above which a brake chopper burns the energy; there is none otherwise.
    pub chopper: Option<Voltage>,
}

/// Differences from sensors without noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoiseSetup {
    /// Amplitude at the encoder, in counts, 0 or more.
    pub encoder: Option<f64>,
    /// Amplitude of the measured velocity, in counts/s, 0 or more.
    pub velocity: Option<f64>,
    /// Where the random numbers start; the same seed gives the same bits.
    pub seed: Option<u64>,
}

impl PlantSetup {
    /// The plant with the differences.
    #[must_use]
    pub fn apply(&self, plant: PlantConfig) -> PlantConfig {
        let mut plant = plant;
        self.apply_to_mechanics(&mut plant);
        self.apply_to_switches(&mut plant);
        plant.supply = self.supply.apply(plant.supply);
        plant.noise = self.noise.apply(plant.noise);
        plant.faults.extend(&self.faults);
        plant
    }

    fn apply_to_mechanics(&self, plant: &mut PlantConfig) {
        let load = &mut plant.load;
        set(&mut load.inertia_kgm2, self.load_inertia_kg_m2);
        set(&mut load.gravity_nm, self.load_torque_nm);
        set(&mut load.coulomb_friction_nm, self.friction_nm);
        set(&mut load.viscous_friction_nms, self.viscous_friction_nms);
        set(&mut plant.backlash, self.backlash);
        set(&mut plant.start, self.start);
        set(&mut plant.index, self.index);
        plant.stops = self.stops.or(plant.stops);
    }

    fn apply_to_switches(&self, plant: &mut PlantConfig) {
        plant.positive_switch = self.positive_limit.or(plant.positive_switch);
        plant.negative_switch = self.negative_limit.or(plant.negative_switch);
        plant.limit_switch_width = self.limit_switch_width.or(plant.limit_switch_width);
        plant.home_switch = self.home.or(plant.home_switch);
        set(&mut plant.hysteresis, self.hysteresis);
        let wiring = &mut plant.active_low;
        for input in &self.active_low {
            match input {
                Input::PositiveLimit => wiring.positive_limit = true,
                Input::NegativeLimit => wiring.negative_limit = true,
                Input::Home => wiring.home = true,
                Input::DriveFault => wiring.drive_fault = true,
                Input::EmergencyStop => wiring.emergency_stop = true,
                Input::Probe1 => wiring.probe_1 = true,
                Input::Probe2 => wiring.probe_2 = true,
            }
        }
    }
}

impl SupplySetup {
    /// The supply with the differences.
    #[must_use]
    pub fn apply(&self, supply: Supply) -> Supply {
        let voltage = self.voltage.unwrap_or(supply.voltage);
        let scaled = |threshold: Voltage| Voltage(threshold.0 * voltage.0 / supply.voltage.0);
        let mut dc_link = supply.dc_link;
        if self.capacitance_f.is_some() || self.chopper.is_some() {
            let link = dc_link.get_or_insert(DcLink::default());
            set(&mut link.capacitance_f, self.capacitance_f);
            link.chopper = self.chopper.or(link.chopper);
        }
        Supply {
            voltage,
            under_voltage: self.under_voltage.unwrap_or_else(|| scaled(supply.under_voltage)),
            over_voltage: self.over_voltage.unwrap_or_else(|| scaled(supply.over_voltage)),
            dc_link,
        }
    }
}

impl NoiseSetup {
    fn apply(&self, noise: Noise) -> Noise {
        let mut noise = noise;
        set(&mut noise.encoder, self.encoder);
        set(&mut noise.velocity, self.velocity);
        set(&mut noise.seed, self.seed);
        noise
    }
}

fn set<T>(value: &mut T, given: Option<T>) {
    if let Some(given) = given {
        *value = given;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axis::{Inputs, Load};

    fn range(min: f64, max: f64) -> Option<PositionRange> {
        PositionRange::new(Position(min), Position(max))
    }

    #[test]
    fn what_is_not_given_stays() {
        let plant = PlantConfig { start: Position(5.0), stops: range(-9.0, 9.0), ..PlantConfig::default() };
        assert_eq!(PlantSetup::default().apply(plant.clone()), plant);
    }

    #[test]
    fn what_is_given_is_set_in_its_place() {
        let setup = PlantSetup {
            load_inertia_kg_m2: Some(1.0),
            load_torque_nm: Some(-2.0),
            friction_nm: Some(3.0),
            viscous_friction_nms: Some(4.0),
            backlash: Some(Position(5.0)),
            start: Some(Position(6.0)),
            index: Some(Position(7.0)),
            positive_limit: Some(Position(8.0)),
            negative_limit: Some(Position(-9.0)),
            limit_switch_width: Some(Position(10.0)),
            home: range(11.0, 12.0),
            hysteresis: Some(Position(13.0)),
            stops: range(-14.0, 15.0),
            active_low: vec![Input::Home, Input::PositiveLimit],
            analog_input: None,
            external_encoder: None,
            supply: SupplySetup::default(),
            noise: NoiseSetup { encoder: Some(16.0), velocity: Some(17.0), seed: Some(18) },
            faults: Vec::new(),
        };
        let expected = PlantConfig {
            load: Load {
                inertia_kgm2: 1.0,
                gravity_nm: -2.0,
                coulomb_friction_nm: 3.0,
                viscous_friction_nms: 4.0,
            },
            backlash: Position(5.0),
            start: Position(6.0),
            index: Position(7.0),
            positive_switch: Some(Position(8.0)),
            negative_switch: Some(Position(-9.0)),
            limit_switch_width: Some(Position(10.0)),
            home_switch: range(11.0, 12.0),
            hysteresis: Position(13.0),
            stops: range(-14.0, 15.0),
            active_low: Inputs { home: true, positive_limit: true, ..Inputs::default() },
            noise: Noise { encoder: 16.0, velocity: 17.0, seed: 18 },
            ..PlantConfig::default()
        };
        assert_eq!(setup.apply(PlantConfig::default()), expected);
    }

    #[test]
    fn thresholds_that_are_not_given_scale_with_the_voltage() {
        let setup = SupplySetup { voltage: Some(Voltage(96.0)), ..SupplySetup::default() };
        let supply = setup.apply(Supply::default());
        assert_eq!((supply.under_voltage, supply.over_voltage), (Voltage(40.0), Voltage(150.0)));
        let setup = SupplySetup { under_voltage: Some(Voltage(50.0)), ..setup };
        assert_eq!(setup.apply(Supply::default()).under_voltage, Voltage(50.0));
    }

    #[test]
    fn a_chopper_or_a_capacitor_makes_the_motor_move_the_voltage() {
        assert_eq!(SupplySetup::default().apply(Supply::default()).dc_link, None);
        let chopper = SupplySetup { chopper: Some(Voltage(60.0)), ..SupplySetup::default() };
        let link = DcLink { chopper: Some(Voltage(60.0)), ..DcLink::default() };
        assert_eq!(chopper.apply(Supply::default()).dc_link, Some(link));
        let capacitor = SupplySetup { capacitance_f: Some(0.01), ..SupplySetup::default() };
        let link = DcLink { capacitance_f: 0.01, ..DcLink::default() };
        assert_eq!(capacitor.apply(Supply::default()).dc_link, Some(link));
    }

    #[test]
    fn scheduled_faults_come_on_top() {
        let at = |from_seconds| ScheduledFault {
            fault: axis::PlantFault::BlockedShaft,
            from_seconds,
            until_seconds: None,
        };
        let plant = PlantConfig { faults: vec![at(1.0)], ..PlantConfig::default() };
        let setup = PlantSetup { faults: vec![at(2.0)], ..PlantSetup::default() };
        assert_eq!(setup.apply(plant).faults, [at(1.0), at(2.0)]);
    }
}
