//! What a plant is made of.

use super::{EncoderBreak, Load, Noise, Overload, ScheduledFault, Supply, Thermal};
use crate::inputs::Inputs;
use crate::limits::PositionRange;
use crate::units::{Position, Temperature, Torque};

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
    /// Friction torque of the motor in proportion to speed, in N·m·s/rad.
    pub viscous_friction_nms: f64,
    /// Friction torque of the motor that only has a direction, in N·m.
    pub coulomb_friction_nm: f64,
    /// What the motor moves.
    pub load: Load,
    /// Play between motor and load.
    pub backlash: Position,
    /// Where the plant stands at the start.
    pub start: Position,
    /// Where in a revolution the index pulse is.
    pub index: Position,
    /// The positive limit switch is actuated from here on upwards.
    pub positive_switch: Option<Position>,
    /// The negative limit switch is actuated from here on downwards.
    pub negative_switch: Option<Position>,
    /// How far behind its edge a limit switch remains actuated; `None` is without an end.
    pub limit_switch_width: Option<Position>,
    /// The home switch is actuated in this range.
    pub home_switch: Option<PositionRange>,
    /// The two general inputs are actuated in these ranges.
    pub probe_switches: [Option<PositionRange>; 2],
    /// How much further a switch must move to let go than to be actuated.
    pub hysteresis: Position,
    /// The inputs that are low while actuated.
    pub active_low: Inputs,
    /// Hard stops: the load cannot leave this range.
    pub stops: Option<PositionRange>,
    /// Supply of the power stage.
    pub supply: Supply,
    /// Temperature of the surroundings.
    pub ambient: Temperature,
    /// How torque warms the motor; `None` is not at all.
    pub thermal: Option<Thermal>,
    /// How long the motor may give more than its rated torque; `None` is for ever.
    pub overload: Option<Overload>,
    /// Noise of the sensors.
    pub noise: Noise,
    /// What a broken encoder shows.
    pub encoder_break: EncoderBreak,
    /// The drive notices a broken encoder.
    pub monitors_encoder: bool,
    /// Faults that come by themselves.
    pub faults: Vec<ScheduledFault>,
}

impl Default for PlantConfig {
    /// A 400 W servo motor with a load of about three times its own inertia; no backlash, switches, stops,
    /// noise or faults.
    fn default() -> Self {
        Self {
            counts_per_revolution: 8192,
            rated_torque_nm: 1.27,
            peak_torque: Torque(3000.0),
            motor_inertia_kgm2: 3e-5,
            viscous_friction_nms: 1e-4,
            coulomb_friction_nm: 0.03,
            load: Load::default(),
            backlash: Position(0.0),
            start: Position(0.0),
            index: Position(0.0),
            positive_switch: None,
            negative_switch: None,
            limit_switch_width: None,
            home_switch: None,
            probe_switches: [None; 2],
            hysteresis: Position(0.0),
            active_low: Inputs::default(),
            stops: None,
            supply: Supply::default(),
            ambient: Temperature(25.0),
            thermal: None,
            overload: None,
            noise: Noise::default(),
            encoder_break: EncoderBreak::default(),
            monitors_encoder: true,
            faults: Vec::new(),
        }
    }
}
