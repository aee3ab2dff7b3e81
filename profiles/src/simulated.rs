//! The simulated drive behind an axis, by the data of its motor.

use core::num::NonZeroU32;

use axis::{
    AnalogConfig, AnalogDrive, DcLink, Drive, Load, Overload, Period, PlantConfig, Scale, SensorConfig,
    ServoConfig, SimulatedServo, StepConfig, StepDrive, StepFeedback, StepperConfig, Supply, Temperature,
    Thermal, Torque, Voltage,
};

use crate::{Dialect, Motor, MotorKind, StepperMotor, mac4};

/// At this temperature of the motor the drive trips.
pub(crate) const HOTTEST: Temperature = Temperature(100.0);

/// A step drive inside its motor makes up to 50 million steps a second.
const INNER_FREQUENCY_FACTOR: NonZeroU32 = match NonZeroU32::new(1000) {
    Some(factor) => factor,
    None => NonZeroU32::MIN,
};

/// At this supply the drive trips, for motors of low and of high power.
const LOW: Supply = Supply {
    voltage: Voltage(48.0),
    under_voltage: Voltage(20.0),
    over_voltage: Voltage(75.0),
    dc_link: None,
};
const HIGH: Supply = Supply {
    voltage: Voltage(325.0),
    under_voltage: Voltage(200.0),
    over_voltage: Voltage(430.0),
    dc_link: None,
};

/// The simulated drive of a motor, before it is built.
pub(crate) enum Simulated {
    Servo(ServoConfig),
    Analog(AnalogConfig),
    Stepper(StepConfig),
}

impl Simulated {
    /// The drive of a motor with a load as heavy as the rotor, and friction of a hundredth of the rated torque; on a card
    /// of the MAC4 what that has at its outputs.
    pub(crate) fn of(motor: &Motor, dialect: Dialect) -> Self {
        match (dialect, &motor.kind) {
            (Dialect::Mac4(card), _) => mac4::simulated(card, motor),
            (Dialect::Cia402 | Dialect::Jvl, MotorKind::Servo) => Self::Servo(servo(motor)),
            (Dialect::Cia402 | Dialect::Jvl, MotorKind::Stepper(stepper)) => {
                Self::Stepper(step_drive(motor, stepper))
            }
        }
    }

    /// What it turns.
    pub(crate) fn plant(&mut self) -> &mut PlantConfig {
        match self {
            Self::Servo(config) => &mut config.plant,
            Self::Analog(config) => &mut config.plant,
            Self::Stepper(config) => &mut config.plant,
        }
    }

    /// The drive, stepped once every `period`.
    pub(crate) fn build(self, period: Period) -> Box<dyn Drive> {
        match self {
            Self::Servo(config) => Box::new(SimulatedServo::new(period, config)),
            Self::Analog(config) => Box::new(AnalogDrive::new(period, config)),
            Self::Stepper(config) => Box::new(StepDrive::new(period, config)),
        }
    }
}

/// Rated torque may last for ever, twice of it for 3 s (I²t).
fn servo(motor: &Motor) -> ServoConfig {
    let plant = PlantConfig { overload: Some(Overload::default()), ..plant(motor) };
    ServoConfig { plant, ..ServoConfig::default() }
}

/// A drive in the motor: a count is a step, and its electronics damp the rotor half as much as would be critical.
/// The motor stands its whole current for as long as it stays cool enough.
fn step_drive(motor: &Motor, stepper: &StepperMotor) -> StepConfig {
    let full_steps = stepper.full_steps_per_revolution;
    let microsteps = (motor.counts_per_revolution / full_steps).max(1);
    // The torque rises to its highest within a full step.
    let holding_nm = motor.rated_torque_nm * motor.peak_torque_factor;
    let stiffness = holding_nm * f64::from(full_steps) / core::f64::consts::TAU;
    let inertia = 2.0 * motor.rotor_inertia_kg_m2;
    StepConfig {
        plant: plant(motor),
        motor: StepperConfig {
            full_steps_per_revolution: full_steps,
            microsteps,
            counts_per_revolution: motor.counts_per_revolution,
            holding_torque: Torque(1000.0 * motor.peak_torque_factor),
            damping_seconds: (inertia / stiffness).sqrt(),
        },
        feedback: if stepper.has_encoder {
            StepFeedback::Encoder { sensor: SensorConfig::incremental(32), scale: Scale::ONE }
        } else {
            StepFeedback::Counter
        },
        frequency_factor: INNER_FREQUENCY_FACTOR,
        ..StepConfig::default()
    }
}

/// What every plant has.
pub(crate) fn plant(motor: &Motor) -> PlantConfig {
    PlantConfig {
        counts_per_revolution: motor.counts_per_revolution,
        rated_torque_nm: motor.rated_torque_nm,
        peak_torque: Torque(1000.0 * motor.peak_torque_factor),
        motor_inertia_kgm2: motor.rotor_inertia_kg_m2,
        load: Load { inertia_kgm2: motor.rotor_inertia_kg_m2, ..Load::default() },
        coulomb_friction_nm: motor.rated_torque_nm / 100.0,
        viscous_friction_nms: motor.rated_torque_nm / 100_000.0,
        supply: supply(motor),
        thermal: Some(Thermal { limit: HOTTEST, ..Thermal::default() }),
        overload: None,
        ..PlantConfig::default()
    }
}

/// 48 V for steppers and up to 350 W, rectified mains above. The source loses a twentieth of its voltage at peak power. The capacitor
/// takes one and a half times the energy of motor and default load at the highest speed, so that only a heavier load
/// brakes the drive into an over-voltage.
fn supply(motor: &Motor) -> Supply {
    const LOW_POWER_W: f64 = 350.0;
    let speed = f64::from(motor.max_speed_rpm) / 60.0 * core::f64::consts::TAU;
    let rated = motor.rated_torque_nm * speed;
    let is_low = motor.stepper().is_some() || rated <= LOW_POWER_W;
    let supply = if is_low { LOW } else { HIGH };
    let (nominal, most) = (supply.voltage.0, supply.over_voltage.0);
    let energy = motor.rotor_inertia_kg_m2 * speed * speed;
    let link = DcLink {
        resistance_ohm: nominal * nominal / (20.0 * rated * motor.peak_torque_factor),
        capacitance_f: 3.0 * energy / (most * most - nominal * nominal),
        losses_at_rated_w: rated / 20.0,
        idle_w: rated / 100.0,
        chopper: None,
    };
    Supply { dc_link: Some(link), ..supply }
}
