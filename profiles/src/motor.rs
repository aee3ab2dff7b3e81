//! The motor behind an axis.

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
