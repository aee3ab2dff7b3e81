//! The simulated drives behind the cards (sections 2.2 to 2.4).

use axis::{
    AmplifierConfig, AmplifierMode, AnalogConfig, Coding, Overload, PlantConfig, Position, Scale,
    SensorConfig, StepConfig, StepFeedback, StepperConfig, Torque,
};

use super::CardType;
use crate::Motor;
use crate::simulated::{self, Simulated};

/// Bits of the counters of increments and of steps.
pub(super) const COUNTER_BITS: u8 = 16;
/// Bits of the SSI encoder: with 26 clocks the lowest one comes two before the last.
pub(super) const SSI_BITS: u8 = 24;
const SSI_SHIFT: u8 = 2;
/// Jumper J1 is open on every axis (table 2.9).
pub(super) const SSI_CODING: Coding = Coding::Gray;

/// The drive of one axis of a card: what 10 V or the pulses turn.
pub(crate) fn simulated(card: CardType, motor: &Motor) -> Simulated {
    match card {
        CardType::Inc => Simulated::Analog(analog(motor, SensorConfig::incremental(COUNTER_BITS))),
        CardType::Ssi => {
            let mut config = analog(motor, SensorConfig::ssi(SSI_BITS, SSI_SHIFT, SSI_CODING));
            // In the middle of the range, from where it can turn both ways.
            config.plant.start = Position(f64::from(1_u32 << (SSI_BITS - 1)));
            Simulated::Analog(config)
        }
        CardType::Stp => Simulated::Stepper(stepper(motor)),
    }
}

/// An amplifier that turns the motor at its highest speed for 10 V.
fn analog(motor: &Motor, sensor: SensorConfig) -> AnalogConfig {
    let full_scale = crate::cia402::limits_of(motor).velocity;
    AnalogConfig {
        plant: PlantConfig { overload: Some(Overload::default()), ..plant(motor) },
        amplifier: AmplifierConfig {
            mode: AmplifierMode::Velocity { full_scale, time_constant_seconds: 0.002 },
            peak: Torque(1000.0 * motor.peak_torque_factor),
        },
        sensor,
        ..AnalogConfig::default()
    }
}

/// A motor of 200 full steps, damped; a step at the input is a count of the encoder at its shaft.
fn stepper(motor: &Motor) -> StepConfig {
    const FULL_STEPS: u32 = 200;
    let plant = PlantConfig { viscous_friction_nms: 5e-3, ..plant(motor) };
    StepConfig {
        plant,
        motor: StepperConfig {
            full_steps_per_revolution: FULL_STEPS,
            microsteps: (motor.counts_per_revolution / FULL_STEPS).max(1),
            counts_per_revolution: motor.counts_per_revolution,
            ..StepperConfig::default()
        },
        feedback: StepFeedback::Encoder {
            sensor: SensorConfig::incremental(COUNTER_BITS),
            scale: Scale::ONE,
        },
        ..StepConfig::default()
    }
}

/// The plant of the motor, its switches wired as the manual has them: low when actuated (tables 2.4, 2.10 and 2.14).
fn plant(motor: &Motor) -> PlantConfig {
    let mut plant = simulated::plant(motor);
    plant.active_low.positive_limit = true;
    plant.active_low.negative_limit = true;
    plant.active_low.home = true;
    plant.active_low.drive_fault = true;
    plant.active_low.emergency_stop = true;
    plant
}
