//! The behaviours an entry can be bound to, by the names that profile files use.

use core::fmt;
use core::str::FromStr;

use thiserror::Error;

macro_rules! bindings {
    ($($(#[$doc:meta])+ $variant:ident = $name:literal,)*) => {
        /// What an entry of a device does beyond storing a value.
        ///
        /// The discriminants count from zero, so `binding as usize` indexes an array of [`Binding::COUNT`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(usize)]
        pub enum Binding {
            $($(#[$doc])+ $variant,)*
        }

        impl Binding {
            /// Every behaviour, in the order of the discriminants.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// How many behaviours there are.
            pub const COUNT: usize = Self::ALL.len();

            /// The name that profile files use.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }
        }
    };
}

bindings! {
    /// 0x6040: commands of the drive state machine.
    Controlword = "controlword",
    /// 0x6041: state of the drive state machine.
    Statusword = "statusword",
    /// 0x603F: the last fault.
    ErrorCode = "error_code",
    /// 0x6007: reaction to a lost connection.
    AbortConnectionOption = "abort_connection_option",
    /// 0x605A: reaction to a quick stop.
    QuickStopOption = "quick_stop_option",
    /// 0x605B: reaction to a shutdown.
    ShutdownOption = "shutdown_option",
    /// 0x605C: reaction to leaving the enabled state.
    DisableOperationOption = "disable_operation_option",
    /// 0x605D: reaction to the halt bit.
    HaltOption = "halt_option",
    /// 0x605E: reaction to a fault.
    FaultReactionOption = "fault_reaction_option",
    /// 0x6060: the requested mode.
    ModesOfOperation = "modes_of_operation",
    /// 0x6061: the mode in effect.
    ModesOfOperationDisplay = "modes_of_operation_display",
    /// 0x6042: how fast to go in velocity mode.
    VlTargetVelocity = "vl_target_velocity",
    /// 0x6043: velocity after the ramp of velocity mode.
    VlVelocityDemand = "vl_velocity_demand",
    /// 0x6044: how fast the axis is, in the unit of velocity mode.
    VlVelocityActual = "vl_velocity_actual",
    /// 0x6046:01: smallest amount of the target in velocity mode.
    VlMinAmount = "vl_min_amount",
    /// 0x6046:02: largest amount of the target in velocity mode.
    VlMaxAmount = "vl_max_amount",
    /// 0x6048:01: change of the velocity in the time of 0x6048:02.
    VlAccelerationSpeed = "vl_acceleration_speed",
    /// 0x6048:02: time of that change.
    VlAccelerationTime = "vl_acceleration_time",
    /// 0x6049:01: change of the velocity in the time of 0x6049:02.
    VlDecelerationSpeed = "vl_deceleration_speed",
    /// 0x6049:02: time of that change.
    VlDecelerationTime = "vl_deceleration_time",
    /// 0x604A:01: change of the velocity in the time of 0x604A:02, at a quick stop.
    VlQuickStopSpeed = "vl_quick_stop_speed",
    /// 0x604A:02: time of that change.
    VlQuickStopTime = "vl_quick_stop_time",
    /// 0x604B:01: numerator of what targets in velocity mode are multiplied by.
    VlSetPointNumerator = "vl_set_point_numerator",
    /// 0x604B:02: its denominator.
    VlSetPointDenominator = "vl_set_point_denominator",
    /// 0x604C:01: numerator of the revolutions per minute in a unit of velocity mode.
    VlDimensionNumerator = "vl_dimension_numerator",
    /// 0x604C:02: its denominator.
    VlDimensionDenominator = "vl_dimension_denominator",
    /// 0x6062: where the axis ought to be.
    PositionDemand = "position_demand",
    /// 0x6064: where the axis is.
    PositionActual = "position_actual",
    /// 0x6065: largest tolerated following error.
    FollowingErrorWindow = "following_error_window",
    /// 0x60F4: demand minus actual position.
    FollowingErrorActual = "following_error_actual",
    /// 0x6066: how long a larger following error is tolerated.
    FollowingErrorTime = "following_error_time",
    /// 0x6067: how near to the target counts as reached.
    PositionWindow = "position_window",
    /// 0x6068: how long it must stay there.
    PositionWindowTime = "position_window_time",
    /// 0x6069: velocity as the sensor gives it.
    VelocitySensorActual = "velocity_sensor_actual",
    /// 0x606B: how fast the axis ought to be.
    VelocityDemand = "velocity_demand",
    /// 0x606C: how fast the axis is.
    VelocityActual = "velocity_actual",
    /// 0x606D: how near to the target velocity counts as reached.
    VelocityWindow = "velocity_window",
    /// 0x606E: how long it must stay there.
    VelocityWindowTime = "velocity_window_time",
    /// 0x6071: torque to give in the torque modes.
    TargetTorque = "target_torque",
    /// 0x606F: up to which velocity the axis stands.
    VelocityThreshold = "velocity_threshold",
    /// 0x6070: how long it must be faster to be moving.
    VelocityThresholdTime = "velocity_threshold_time",
    /// 0x6072: torque limit.
    MaxTorque = "max_torque",
    /// 0x6073: highest current of the motor, in per mille of the rated one.
    MaxCurrent = "max_current",
    /// 0x6075: rated current of the motor, in mA.
    MotorRatedCurrent = "motor_rated_current",
    /// 0x6074: torque asked of the motor.
    TorqueDemand = "torque_demand",
    /// 0x6077: torque of the motor.
    TorqueActual = "torque_actual",
    /// 0x607A: where to go in the position modes.
    TargetPosition = "target_position",
    /// 0x607B:01: lower end of the range in which positions are shown.
    MinPositionRange = "min_position_range",
    /// 0x607B:02: upper end of it.
    MaxPositionRange = "max_position_range",
    /// 0x607C: from the home position to the zero position.
    HomeOffset = "home_offset",
    /// 0x607D:01: lower software position limit.
    MinPositionLimit = "min_position_limit",
    /// 0x607D:02: upper software position limit.
    MaxPositionLimit = "max_position_limit",
    /// 0x607E: sign of positions and velocities.
    Polarity = "polarity",
    /// 0x607F: velocity limit of profiles.
    MaxProfileVelocity = "max_profile_velocity",
    /// 0x6080: speed limit of the motor.
    MaxMotorSpeed = "max_motor_speed",
    /// 0x6081: velocity of a positioning.
    ProfileVelocity = "profile_velocity",
    /// 0x6082: velocity at the target, when another one follows.
    EndVelocity = "end_velocity",
    /// 0x6083: acceleration of a profile.
    ProfileAcceleration = "profile_acceleration",
    /// 0x6084: deceleration of a profile.
    ProfileDeceleration = "profile_deceleration",
    /// 0x6085: deceleration of a quick stop.
    QuickStopDeceleration = "quick_stop_deceleration",
    /// 0x6098: how to find the home position.
    HomingMethod = "homing_method",
    /// 0x6099:01: speed of the search for a switch.
    HomingSwitchSpeed = "homing_switch_speed",
    /// 0x6099:02: speed of the search for an edge or the index.
    HomingZeroSpeed = "homing_zero_speed",
    /// 0x609A: acceleration and deceleration of homing.
    HomingAcceleration = "homing_acceleration",
    /// 0x6087: change of a torque per second.
    TorqueSlope = "torque_slope",
    /// 0x60B0: added to the target position of the cyclic modes.
    PositionOffset = "position_offset",
    /// 0x60B1: added to the target velocity of the cyclic modes, or velocity feed-forward.
    VelocityOffset = "velocity_offset",
    /// 0x60B2: added to the target torque of the cyclic modes, or torque feed-forward.
    TorqueOffset = "torque_offset",
    /// 0x60C1:01: a position to interpolate to.
    InterpolationRecord = "interpolation_record",
    /// 0x60C2:01: time between set-points, in units of the index.
    InterpolationTimeValue = "interpolation_time_value",
    /// 0x60C2:02: unit of that time, a power of ten of seconds.
    InterpolationTimeIndex = "interpolation_time_index",
    /// 0x60C4:02: how many records may wait.
    InterpolationBufferSize = "interpolation_buffer_size",
    /// 0x60C4:03: first in, first out, or ring.
    InterpolationBufferOrganisation = "interpolation_buffer_organisation",
    /// 0x60C4:04: how many records wait.
    InterpolationBufferPosition = "interpolation_buffer_position",
    /// 0x60C4:06: empties the buffer and locks or unlocks it.
    InterpolationBufferClear = "interpolation_buffer_clear",
    /// 0x6086: shape of the ramps.
    MotionProfileType = "motion_profile_type",
    /// 0x60A3: how many of the jerks are in use.
    ProfileJerkUse = "profile_jerk_use",
    /// 0x60A4:01: first jerk of a profile.
    ProfileJerk1 = "profile_jerk_1",
    /// 0x60A4:02: second jerk of a profile.
    ProfileJerk2 = "profile_jerk_2",
    /// 0x60A4:03: third jerk of a profile.
    ProfileJerk3 = "profile_jerk_3",
    /// 0x60A4:04: fourth jerk of a profile.
    ProfileJerk4 = "profile_jerk_4",
    /// 0x60F2: details of positioning.
    PositioningOption = "positioning_option",
    /// 0x60F8: how far the velocity may be from its demand.
    MaxSlippage = "max_slippage",
    /// 0x60FC: demand position in increments.
    PositionDemandInternal = "position_demand_internal",
    /// 0x608F:01: increments of the position encoder...
    PositionEncoderIncrements = "position_encoder_increments",
    /// 0x608F:02: ...in so many turns of the motor.
    PositionEncoderRevolutions = "position_encoder_revolutions",
    /// 0x6090:01: increments per second of the velocity encoder...
    VelocityEncoderIncrements = "velocity_encoder_increments",
    /// 0x6090:02: ...at so many turns of the motor per second.
    VelocityEncoderRevolutions = "velocity_encoder_revolutions",
    /// 0x6091:01: turns of the motor...
    GearMotorRevolutions = "gear_motor_revolutions",
    /// 0x6091:02: ...in so many turns of the shaft.
    GearShaftRevolutions = "gear_shaft_revolutions",
    /// 0x6092:01: feed in position units...
    Feed = "feed",
    /// 0x6092:02: ...in so many turns of the shaft.
    FeedShaftRevolutions = "feed_shaft_revolutions",
    /// 0x6093:01: position units to counts, numerator.
    PositionFactorNumerator = "position_factor_numerator",
    /// 0x6093:02: position units to counts, divisor.
    PositionFactorDivisor = "position_factor_divisor",
    /// 0x6094:01: velocity units to counts/s, numerator.
    VelocityEncoderFactorNumerator = "velocity_encoder_factor_numerator",
    /// 0x6094:02: velocity units to counts/s, divisor.
    VelocityEncoderFactorDivisor = "velocity_encoder_factor_divisor",
    /// 0x6096:01: velocity units to position units/s, numerator.
    VelocityFactorNumerator = "velocity_factor_numerator",
    /// 0x6096:02: velocity units to position units/s, divisor.
    VelocityFactorDivisor = "velocity_factor_divisor",
    /// 0x6097:01: acceleration units to position units/s² (JVL: counts/s²), numerator.
    AccelerationFactorNumerator = "acceleration_factor_numerator",
    /// 0x6097:02: acceleration units to position units/s² (JVL: counts/s²), divisor.
    AccelerationFactorDivisor = "acceleration_factor_divisor",
    /// 0x60A2:01: jerk units to position units/s³, numerator.
    JerkFactorNumerator = "jerk_factor_numerator",
    /// 0x60A2:02: jerk units to position units/s³, divisor.
    JerkFactorDivisor = "jerk_factor_divisor",
    /// 0x60E0: torque limit in positive direction.
    PositiveTorqueLimit = "positive_torque_limit",
    /// 0x60E1: torque limit in negative direction.
    NegativeTorqueLimit = "negative_torque_limit",
    /// 0x60FF: how fast to go in the velocity modes.
    TargetVelocity = "target_velocity",
    /// 0x60C5: acceleration limit.
    MaxAcceleration = "max_acceleration",
    /// 0x60C6: deceleration limit.
    MaxDeceleration = "max_deceleration",
    /// 0x60B8: what the touch probes do.
    TouchProbeFunction = "touch_probe_function",
    /// 0x60B9: what the touch probes have caught.
    TouchProbeStatus = "touch_probe_status",
    /// 0x60BA: position at the positive edge of touch probe 1.
    TouchProbe1Positive = "touch_probe_1_positive",
    /// 0x60BB: position at the negative edge of touch probe 1.
    TouchProbe1Negative = "touch_probe_1_negative",
    /// 0x60BC: position at the positive edge of touch probe 2.
    TouchProbe2Positive = "touch_probe_2_positive",
    /// 0x60BD: position at the negative edge of touch probe 2.
    TouchProbe2Negative = "touch_probe_2_negative",
    /// 0x60D0:01: signal of touch probe 1.
    TouchProbe1Source = "touch_probe_1_source",
    /// 0x60D0:02: signal of touch probe 2.
    TouchProbe2Source = "touch_probe_2_source",
    /// 0x60D5: positive edges that touch probe 1 has caught.
    TouchProbe1PositiveCounter = "touch_probe_1_positive_counter",
    /// 0x60D6: negative edges that touch probe 1 has caught.
    TouchProbe1NegativeCounter = "touch_probe_1_negative_counter",
    /// 0x60D7: positive edges that touch probe 2 has caught.
    TouchProbe2PositiveCounter = "touch_probe_2_positive_counter",
    /// 0x60D8: negative edges that touch probe 2 has caught.
    TouchProbe2NegativeCounter = "touch_probe_2_negative_counter",
    /// 0x60FD: switches and inputs.
    DigitalInputs = "digital_inputs",
    /// 0x60FE:01: outputs.
    DigitalOutputs = "digital_outputs",
    /// 0x60FE:02: which outputs 0x60FE:01 sets.
    DigitalOutputsMask = "digital_outputs_mask",
    /// JVL 0x2010: commands to the module.
    JvlCommand = "jvl_command",
    /// JVL: FastMac command to the motor.
    JvlFastMac = "jvl_fastmac",
    /// JVL 0x2204: current of a stepper while it runs, in mA.
    JvlRunCurrent = "jvl_run_current",
    /// JVL 0x2011:01: inputs of the module.
    JvlInputs = "jvl_inputs",
    /// JVL 0x2011:03: state of the motor in bits.
    JvlMotorStatus = "jvl_motor_status",
    /// JVL 0x2011:04: ERR_STAT of the motor at its last fatal error.
    JvlLastError = "jvl_last_error",
    /// JVL 0x2100: torque limit of homing.
    JvlHomingTorque = "jvl_homing_torque",
    /// JVL 0x2101: the analogue input of the motor.
    JvlAnalogInput = "jvl_analog_input",
    /// JVL 0x2011:02: outputs of the module.
    JvlOutputs = "jvl_outputs",
    /// JVL 0x2011:05: which outputs have their default function.
    JvlOutputSetup = "jvl_output_setup",
    /// JVL 0x2011:06: active levels of the inputs.
    JvlInputLevel = "jvl_input_level",
    /// JVL 0x2011:07: which limit switches act.
    JvlInputSetup = "jvl_input_setup",
    /// JVL 0x2011:08: setup of the module.
    JvlSetup = "jvl_setup",
    /// An instruction of a MAC4 axis; the sub-index is its code.
    Mac4Instruction = "mac4_instruction",
    /// What the axes of a MAC4 card share: messages, stop bits, overall status.
    Mac4Card = "mac4_card",
}

/// A name that no behaviour has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("there is no such behaviour")]
pub struct UnknownBinding;

impl Binding {
    /// Whether any number of entries of an axis may have the behaviour: those of a whole record.
    #[must_use]
    pub fn is_of_record(self) -> bool {
        matches!(self, Self::Mac4Instruction | Self::Mac4Card)
    }
}

impl FromStr for Binding {
    type Err = UnknownBinding;

    fn from_str(name: &str) -> Result<Self, UnknownBinding> {
        Self::ALL.iter().copied().find(|b| b.name() == name).ok_or(UnknownBinding)
    }
}

impl fmt::Display for Binding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_binding_is_found_by_its_name_and_indexes_an_array() {
        for (position, binding) in Binding::ALL.iter().enumerate() {
            assert_eq!(binding.name().parse(), Ok(*binding));
            assert_eq!(*binding as usize, position);
        }
        assert_eq!("warp_drive".parse::<Binding>(), Err(UnknownBinding));
    }
}
