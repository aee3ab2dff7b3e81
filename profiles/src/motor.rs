//! The motor behind an axis.

use crate::reader::Table;

/// Within which bounds the data of a motor are, here and in profile files.
pub(crate) mod limits {
    use core::ops::RangeInclusive;

    pub(crate) const COUNTS: RangeInclusive<u32> = 1..=u32::MAX;
    pub(crate) const RASTER: RangeInclusive<u64> = 1..=1_000_000_000;
    pub(crate) const SPEED: RangeInclusive<u32> = 1..=1_000_000;
    pub(crate) const TORQUE: RangeInclusive<f64> = 1e-6..=1e6;
    pub(crate) const PEAK: RangeInclusive<f64> = 1.0..=100.0;
    pub(crate) const INERTIA: RangeInclusive<f64> = 1e-12..=1e6;
}

/// Data of a motor, as its data sheet gives them.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// Name by which a configuration chooses it, such as `mac140`.
    pub name: String,
    /// Encoder counts per revolution of the motor, 1 or more.
    pub counts_per_revolution: u32,
    /// Raster period of the controller in nanoseconds, 1 to 10^9.
    pub raster_ns: u64,
    /// Highest speed in revolutions per minute, 1 or more.
    pub max_speed_rpm: u32,
    /// Rated torque in newton metres, more than zero: that of a stepper with which it holds at its rated current.
    pub rated_torque_nm: f64,
    /// Peak torque as a multiple of the rated torque, 1 or more.
    pub peak_torque_factor: f64,
    /// Inertia of the rotor in kg·m², more than zero.
    pub rotor_inertia_kg_m2: f64,
    /// How it is driven.
    pub kind: MotorKind,
    /// The number by which its register list calls it, zero if that has none.
    pub type_code: u32,
    /// Name of its register list, if it has registers.
    pub registers: Option<String>,
}

/// How a motor is driven.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MotorKind {
    /// In a closed loop of current, velocity and position.
    #[default]
    Servo,
    /// By steps.
    Stepper(StepperMotor),
}

/// What a stepper motor has beside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepperMotor {
    /// Full steps per revolution, 1 or more.
    pub full_steps_per_revolution: u32,
    /// Current of the rated torque in milliamperes, 1 or more.
    pub rated_current_ma: u32,
    /// An encoder tells where the motor is; otherwise the steps are counted.
    pub has_encoder: bool,
}

impl Motor {
    /// What it has beside if it is a stepper.
    #[must_use]
    pub fn stepper(&self) -> Option<&StepperMotor> {
        match &self.kind {
            MotorKind::Servo => None,
            MotorKind::Stepper(stepper) => Some(stepper),
        }
    }
}

/// What a device has otherwise than the data sheet of its motor; what is `None` stays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorData {
    /// See [`Motor::counts_per_revolution`].
    pub counts_per_revolution: Option<u32>,
    /// See [`Motor::raster_ns`].
    pub raster_ns: Option<u64>,
    /// See [`Motor::max_speed_rpm`].
    pub max_speed_rpm: Option<u32>,
    /// See [`Motor::rated_torque_nm`].
    pub rated_torque_nm: Option<f64>,
    /// See [`Motor::peak_torque_factor`].
    pub peak_torque_factor: Option<f64>,
    /// See [`Motor::rotor_inertia_kg_m2`].
    pub rotor_inertia_kg_m2: Option<f64>,
}

impl MotorData {
    /// Reads what `table` gives, within the bounds that hold for the motors of a profile.
    #[must_use]
    pub fn read(table: &mut Table<'_, '_>) -> Self {
        Self {
            counts_per_revolution: table.get_in("counts_per_revolution", limits::COUNTS),
            raster_ns: table.get_in("raster_ns", limits::RASTER),
            max_speed_rpm: table.get_in("max_speed_rpm", limits::SPEED),
            rated_torque_nm: table.get_in("rated_torque_nm", limits::TORQUE),
            peak_torque_factor: table.get_in("peak_torque_factor", limits::PEAK),
            rotor_inertia_kg_m2: table.get_in("rotor_inertia_kg_m2", limits::INERTIA),
        }
    }

    /// `motor` with these data.
    #[must_use]
    pub fn apply(self, motor: Motor) -> Motor {
        Motor {
            counts_per_revolution: self.counts_per_revolution.unwrap_or(motor.counts_per_revolution),
            raster_ns: self.raster_ns.unwrap_or(motor.raster_ns),
            max_speed_rpm: self.max_speed_rpm.unwrap_or(motor.max_speed_rpm),
            rated_torque_nm: self.rated_torque_nm.unwrap_or(motor.rated_torque_nm),
            peak_torque_factor: self.peak_torque_factor.unwrap_or(motor.peak_torque_factor),
            rotor_inertia_kg_m2: self.rotor_inertia_kg_m2.unwrap_or(motor.rotor_inertia_kg_m2),
            ..motor
        }
    }
}
