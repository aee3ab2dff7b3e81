//! The simulated drive behind an axis, by the data of its motor.

use axis::{DcLink, Load, Overload, PlantConfig, ServoConfig, Supply, Temperature, Thermal, Torque, Voltage};

use crate::Motor;

/// At this temperature of the motor the drive trips.
pub(crate) const HOTTEST: Temperature = Temperature(100.0);

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

/// The simulated drive of a motor: a load as heavy as the rotor, friction of a hundredth of the rated torque. Rated
/// torque may last for ever, twice of it for 3 s (I²t).
pub(crate) fn servo(motor: &Motor) -> ServoConfig {
    let plant = PlantConfig {
        counts_per_revolution: motor.counts_per_revolution,
        rated_torque_nm: motor.rated_torque_nm,
        peak_torque: Torque(1000.0 * motor.peak_torque_factor),
        motor_inertia_kgm2: motor.rotor_inertia_kg_m2,
        load: Load { inertia_kgm2: motor.rotor_inertia_kg_m2, ..Load::default() },
        coulomb_friction_nm: motor.rated_torque_nm / 100.0,
        viscous_friction_nms: motor.rated_torque_nm / 100_000.0,
        supply: supply(motor),
        thermal: Some(Thermal { limit: HOTTEST, ..Thermal::default() }),
        overload: Some(Overload::default()),
        ..PlantConfig::default()
    };
    ServoConfig { plant, ..ServoConfig::default() }
}

/// 48 V up to 350 W, rectified mains above. The source loses a twentieth of its voltage at peak power. The capacitor
/// takes one and a half times the energy of motor and default load at the highest speed, so that only a heavier load
/// brakes the drive into an over-voltage.
fn supply(motor: &Motor) -> Supply {
    const LOW_POWER_W: f64 = 350.0;
    let speed = f64::from(motor.max_speed_rpm) / 60.0 * core::f64::consts::TAU;
    let rated = motor.rated_torque_nm * speed;
    let supply = if rated <= LOW_POWER_W { LOW } else { HIGH };
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
