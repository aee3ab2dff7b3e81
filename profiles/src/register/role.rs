//! What a motor or module register means, whatever its number in a family.

use core::fmt;
use core::str::FromStr;

use thiserror::Error;

macro_rules! roles {
    ($($(#[$doc:meta])+ $variant:ident = $name:literal,)*) => {
        /// What a register means. Its number differs between the families of motors.
        ///
        /// The discriminants count from zero, so `role as usize` indexes an array of [`Role::COUNT`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(usize)]
        pub enum Role {
            $($(#[$doc])+ $variant,)*
        }

        impl Role {
            /// Every role, in the order of the discriminants.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// How many roles there are.
            pub const COUNT: usize = Self::ALL.len();

            /// The name that register lists use.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }
        }
    };
}

roles! {
    // Mode and set-points.
    /// Firmware version.
    ProgVersion = "prog_version",
    /// Operating mode; zero is passive.
    ModeReg = "mode_reg",
    /// Target position in counts.
    PSoll = "p_soll",
    /// Position that the synchronisation commands give to actual position and target.
    PNew = "p_new",
    /// Velocity limit or set-point, in the motor's unit of velocity.
    VSoll = "v_soll",
    /// Acceleration limit, in the motor's unit of acceleration.
    ASoll = "a_soll",
    /// Torque limit: 1023 is 300 %.
    TSoll = "t_soll",
    /// Position of the internal generator, in sixteenths of counts.
    PFnc = "p_fnc",
    /// Position of the zero point within a turn of the encoder.
    IndexOffset = "index_offset",

    // What is measured.
    /// Actual position in counts.
    PIst = "p_ist",
    /// Actual velocity: counts per sample (MAC), 0.01 RPM (MIS).
    VIst = "v_ist",
    /// Actual velocity in the unit of V_SOLL, over 16 samples.
    VIst16 = "v_ist_16",
    /// Actual position, updated more often.
    PQuick = "p_quick",
    /// Actual position within the turn of a rotary table.
    PIstTurntab = "p_ist_turntab",
    /// Turns of the rotary table.
    TurntabCount = "turntab_count",
    /// Position within a turn of the encoder.
    IndexIst = "index_ist",
    /// Zero adjustment of an absolute encoder.
    POffset = "p_offset",
    /// Position of an absolute multi-turn encoder.
    PMultiturn = "p_multiturn",
    /// Highest velocity so far.
    VIstMax = "v_ist_max",
    /// Velocity of the external encoder.
    VExt = "v_ext",
    /// The same times the gear factor.
    GvExt = "gv_ext",
    /// Output of the function generator.
    FncOut = "fnc_out",
    /// Actual torque: 1024 is 300 %.
    VfOut = "vf_out",
    /// Analogue input: 1023 is 10 V.
    Aninp = "aninp",
    /// Offset of the analogue input, also its switching threshold.
    AninpOffset = "aninp_offset",
    /// First unconditioned analogue input.
    Aninp1 = "aninp1",
    /// Its offset.
    Aninp1Offset = "aninp1_offset",
    /// Second unconditioned analogue input.
    Aninp2 = "aninp2",
    /// Its offset.
    Aninp2Offset = "aninp2_offset",
    /// Supply voltage (MAC050-141).
    USupply = "u_supply",
    /// Lowest tolerated supply voltage (MAC050-141).
    MinUSup = "min_u_sup",
    /// Control voltage (MAC400 and larger).
    U24v = "u_24v",
    /// DC bus voltage, 0.888 V a unit (MAC400 and larger).
    UBus = "u_bus",
    /// Temperature of the drive.
    Degc = "degc",
    /// Highest tolerated temperature, in the same unit.
    Degcmax = "degcmax",

    // Load, gear, limits and supervision.
    /// Ratio of total inertia and rotor inertia.
    Kvout = "kvout",
    /// Numerator of the gear factor.
    Gearf1 = "gearf1",
    /// Denominator of the gear factor.
    Gearf2 = "gearf2",
    /// Heating of the windings.
    I2t = "i2t",
    /// Its limit.
    I2tlim = "i2tlim",
    /// Heating of the brake resistor.
    Uit = "uit",
    /// Its limit.
    Uitlim = "uitlim",
    /// Following error in counts.
    Flwerr = "flwerr",
    /// Its limit; zero for none.
    Flwerrmax = "flwerrmax",
    /// Distance behind the ideal motion in counts.
    Fncerr = "fncerr",
    /// Its limit; zero for none.
    Fncerrmax = "fncerrmax",
    /// Lower position limit; zero for none.
    MinPIst = "min_p_ist",
    /// Upper position limit; zero for none.
    MaxPIst = "max_p_ist",
    /// Deceleration of an emergency stop.
    AccEmerg = "acc_emerg",
    /// How near to the target counts as in position.
    Inposwin = "inposwin",
    /// For how many samples.
    Inposcnt = "inposcnt",
    /// Reaction to an under-voltage.
    UvHandle = "uv_handle",
    /// Smoothness of the ramps, 0-8.
    SOrder = "s_order",
    /// Divider of the velocity loop.
    Outloopdiv = "outloopdiv",

    // Errors and control bits.
    /// Errors and states in bits.
    ErrStat = "err_stat",
    /// Warnings in bits (MIS).
    WarnBits = "warn_bits",
    /// States in bits (MIS and MAC050-141).
    StatusBits = "status_bits",
    /// Control bits.
    CntrlBits = "cntrl_bits",
    /// Setup bits.
    SetupBits = "setup_bits",
    /// Hardware setup bits.
    HwSetup = "hw_setup",

    // Zero search.
    /// Mode after power-on and after a zero search.
    Startmode = "startmode",
    /// Position that the zero point gets.
    PHome = "p_home",
    /// Velocity of the zero search; its sign is the direction.
    VHome = "v_home",
    /// Torque limit of the zero search.
    THome = "t_home",
    /// Zero search at power-on and by command.
    Homemode = "homemode",
    /// A zero search has completed.
    HomingDone = "homing_done",
    /// Details of the zero search (MIS).
    ZeroSearchBits = "zero_search_bits",

    // Register groups.
    /// Chooses the position register that is copied to P_SOLL.
    PRegP = "p_reg_p",
    /// Chooses the velocity register that is copied to V_SOLL.
    VRegP = "v_reg_p",
    /// Chooses the acceleration register that is copied to A_SOLL.
    ARegP = "a_reg_p",
    /// Chooses the torque register that is copied to T_SOLL.
    TRegP = "t_reg_p",
    /// Chooses the load register that is copied to KVOUT.
    LRegP = "l_reg_p",
    /// Chooses the window register that is copied to INPOSWIN.
    ZRegP = "z_reg_p",
    /// Position register P1.
    Pos0 = "pos0",
    /// Position register P2.
    Pos1 = "pos1",
    /// Position register P3.
    Pos2 = "pos2",
    /// Position register P4.
    Pos3 = "pos3",
    /// Position register P5.
    Pos4 = "pos4",
    /// Position register P6.
    Pos5 = "pos5",
    /// Position register P7.
    Pos6 = "pos6",
    /// Position register P8.
    Pos7 = "pos7",
    /// Velocity register V1.
    Vel0 = "vel0",
    /// Velocity register V2.
    Vel1 = "vel1",
    /// Velocity register V3.
    Vel2 = "vel2",
    /// Velocity register V4.
    Vel3 = "vel3",
    /// Velocity register V5.
    Vel4 = "vel4",
    /// Velocity register V6.
    Vel5 = "vel5",
    /// Velocity register V7.
    Vel6 = "vel6",
    /// Velocity register V8.
    Vel7 = "vel7",
    /// Acceleration register A1.
    Acc0 = "acc0",
    /// Acceleration register A2.
    Acc1 = "acc1",
    /// Acceleration register A3.
    Acc2 = "acc2",
    /// Acceleration register A4.
    Acc3 = "acc3",
    /// Torque (MIS: current) register T1.
    Tq0 = "tq0",
    /// Torque (MIS: current) register T2.
    Tq1 = "tq1",
    /// Torque (MIS: current) register T3.
    Tq2 = "tq2",
    /// Torque (MIS: current) register T4.
    Tq3 = "tq3",
    /// Load register L1.
    Load0 = "load0",
    /// Load register L2.
    Load1 = "load1",
    /// Load register L3.
    Load2 = "load2",
    /// Load register L4.
    Load3 = "load3",
    /// Window register Z1.
    Zero0 = "zero0",
    /// Window register Z2.
    Zero1 = "zero1",
    /// Window register Z3.
    Zero2 = "zero2",
    /// Window register Z4.
    Zero3 = "zero3",
    /// Mode register M1.
    Mode0 = "mode0",
    /// Mode register M2.
    Mode1 = "mode1",
    /// Mode register M3.
    Mode2 = "mode2",
    /// Mode register M4.
    Mode3 = "mode3",

    // Inputs and outputs of a MAC motor.
    /// What hardware input function 0 does.
    Hwi0 = "hwi0",
    /// What hardware input function 1 does.
    Hwi1 = "hwi1",
    /// What hardware input function 2 does.
    Hwi2 = "hwi2",
    /// What hardware input function 3 does.
    Hwi3 = "hwi3",
    /// What hardware input function 4 does.
    Hwi4 = "hwi4",
    /// What hardware input function 5 does.
    Hwi5 = "hwi5",
    /// What hardware input function 6 does.
    Hwi6 = "hwi6",
    /// What hardware input function 7 does.
    Hwi7 = "hwi7",
    /// What hardware input function 8 does.
    Hwi8 = "hwi8",
    /// What hardware input function 9 does.
    Hwi9 = "hwi9",
    /// What hardware input function 10 does.
    Hwi10 = "hwi10",
    /// What hardware input function 11 does.
    Hwi11 = "hwi11",
    /// Inputs in bits (MAC400 and larger).
    Mac001 = "mac00_1",
    /// State of the module's outputs.
    Mac002 = "mac00_2",
    /// Outputs of the module in bits.
    Mac008 = "mac00_8",
    /// Outputs as they were written.
    Mac009 = "mac00_9",
    /// Inverted inputs and outputs.
    InputLevels = "input_levels",
    /// Inputs that are position limits.
    Hardwarelim = "hardwarelim",
    /// Inverted and user-controlled outputs (MAC050-141).
    InvOutput = "inv_output",
    /// Outputs under the user's control (MAC050-141).
    OutputCtrl = "output_ctrl",
    /// Outputs under the user's control (MAC400 and larger).
    Useroutval = "useroutval",

    // Identity and communication.
    /// Commands: FastMac, reset, save.
    Command = "command",
    /// Extended register to write (positive) or read (negative).
    XregAddr = "xreg_addr",
    /// Value for or of it.
    XregData = "xreg_data",
    /// Address of the motor.
    MyAddr = "my_addr",
    /// Type of the motor as a number.
    MotorType = "motor_type",
    /// Serial number of the motor.
    SerialNumber = "serial_number",
    /// Hardware version of the motor.
    HwVersion = "hw_version",
    /// Checksum of the firmware.
    Checksum = "checksum",
    /// Address of the fieldbus module.
    FieldbusAddr = "fieldbus_addr",
    /// Bit rate of the fieldbus module.
    FieldbusSpeed = "fieldbus_speed",

    // Steppers (MIS).
    /// Current while running, 5.87 mA a unit.
    RunCurrent = "run_current",
    /// Time in ms until the standby current.
    StandbyTime = "standby_time",
    /// Current at standstill, 5.87 mA a unit.
    StandbyCurrent = "standby_current",
    /// Velocity at which ramps start, in 0.01 RPM.
    VStart = "v_start",
    /// Position of the encoder in steps.
    EncoderPos = "encoder_pos",
    /// Position within a turn of the encoder in steps.
    AbsEncPos = "abs_enc_pos",
    /// Inputs in bits.
    Inputs = "inputs",
    /// Outputs in bits.
    Outputs = "outputs",
    /// Active levels, and which pins are outputs.
    IoSetup = "io_setup",
    /// Bus voltage, 26.525 mV a unit.
    Busvol = "busvol",
    /// Lowest tolerated bus voltage, 26.525 mV a unit.
    MinBusvol = "min_busvol",
    /// Control voltage.
    CviVoltage = "cvi_voltage",
    /// Temperature of the motor.
    Temp = "temp",
    /// Analogue input 1, filtered, 1.221 mV a unit.
    AnalogFiltered0 = "analog_filtered0",
    /// Analogue input 2, filtered, 1.221 mV a unit.
    AnalogFiltered1 = "analog_filtered1",
    /// Analogue input 3, filtered, 1.221 mV a unit.
    AnalogFiltered2 = "analog_filtered2",
    /// Analogue input 4, filtered, 1.221 mV a unit.
    AnalogFiltered3 = "analog_filtered3",
    /// Analogue input 5, filtered, 1.221 mV a unit.
    AnalogFiltered4 = "analog_filtered4",
    /// Analogue input 6, filtered, 1.221 mV a unit.
    AnalogFiltered5 = "analog_filtered5",
    /// Analogue input 7, filtered, 1.221 mV a unit.
    AnalogFiltered6 = "analog_filtered6",
    /// Analogue input 8, filtered, 1.221 mV a unit.
    AnalogFiltered7 = "analog_filtered7",
    /// Analogue input 1, 1.221 mV a unit.
    AnalogInput0 = "analog_input0",
    /// Analogue input 2, 1.221 mV a unit.
    AnalogInput1 = "analog_input1",
    /// Analogue input 3, 1.221 mV a unit.
    AnalogInput2 = "analog_input2",
    /// Analogue input 4, 1.221 mV a unit.
    AnalogInput3 = "analog_input3",
    /// Analogue input 5, 1.221 mV a unit.
    AnalogInput4 = "analog_input4",
    /// Analogue input 6, 1.221 mV a unit.
    AnalogInput5 = "analog_input5",
    /// Analogue input 7, 1.221 mV a unit.
    AnalogInput6 = "analog_input6",
    /// Analogue input 8, 1.221 mV a unit.
    AnalogInput7 = "analog_input7",
    /// Direction of a turn table.
    TurntabMode = "turntab_mode",
    /// Size of a turn table in steps.
    TurntabSize = "turntab_size",
    /// Input that is the negative limit.
    NlMask = "nl_mask",
    /// Input that is the positive limit.
    PlMask = "pl_mask",
    /// Input that is the home switch.
    HomeMask = "home_mask",
    /// Inputs that are filtered.
    InputFilterMask = "input_filter_mask",
    /// How long a filtered input must be stable, in ms.
    InputFilterCnt = "input_filter_cnt",
    /// Output that shows "in position".
    InposMask = "inpos_mask",
    /// Output that shows an error.
    ErrorMask = "error_mask",
    /// External encoder in counts.
    ExtEncoder = "ext_encoder",
    /// Its velocity in counts per 16 ms.
    ExtEncoderVel = "ext_encoder_vel",
    /// Highest voltage and current of the motor.
    MaxVoltageCurrent = "max_voltage_current",
    /// Milliseconds since the reset.
    Ticks = "ticks",
    /// 0x6040.
    Controlword = "controlword",
    /// 0x6041.
    Statusword = "statusword",
    /// 0x6060.
    ModesOfOperation = "modes_of_operation",
    /// 0x6061.
    ModesOfOperationDisplay = "modes_of_operation_display",
    /// 0x607A.
    TargetPosition = "target_position",
    /// 0x6064.
    ActualPosition = "actual_position",
    /// 0x60FF.
    TargetVelocity = "target_velocity",
    /// 0x606C.
    ActualVelocity = "actual_velocity",
    /// Low 16 bits of 0x60FE:01.
    DigitalOutputs = "digital_outputs",
    /// Low 16 bits of 0x60FD.
    DigitalInputs = "digital_inputs",

    // Registers of the module.
    /// High 16 bits of the MAC address.
    ModuleMacHigh = "module_mac_high",
    /// Low 32 bits of the MAC address.
    ModuleMacLow = "module_mac_low",
    /// IP address, first octet in the highest byte.
    ModuleIp = "module_ip",
    /// Net mask.
    ModuleNetMask = "module_net_mask",
    /// Gateway.
    ModuleGateway = "module_gateway",
    /// Setup bits.
    ModuleSetupBits = "module_setup_bits",
    /// Outputs in bits.
    ModuleOutputs = "module_outputs",
    /// Bus cycles per cycle of the motor.
    ModulePollDivision = "module_poll_division",
    /// EtherCAT station alias.
    ModuleStationAlias = "module_station_alias",
    /// Modbus time-out in multiples of 100 ms; zero for none.
    ModuleTimeout = "module_timeout",
    /// Inputs that are limit switches.
    ModuleInputMask = "module_input_mask",
    /// Commands to module and motor.
    ModuleCommand = "module_command",
    /// Register at position 1 of the data that the master reads in cycles.
    ModuleRead0 = "module_read0",
    /// Register at position 2 of the data that the master reads in cycles.
    ModuleRead1 = "module_read1",
    /// Register at position 3 of the data that the master reads in cycles.
    ModuleRead2 = "module_read2",
    /// Register at position 4 of the data that the master reads in cycles.
    ModuleRead3 = "module_read3",
    /// Register at position 5 of the data that the master reads in cycles.
    ModuleRead4 = "module_read4",
    /// Register at position 6 of the data that the master reads in cycles.
    ModuleRead5 = "module_read5",
    /// Register at position 7 of the data that the master reads in cycles.
    ModuleRead6 = "module_read6",
    /// Register at position 8 of the data that the master reads in cycles.
    ModuleRead7 = "module_read7",
    /// Register at position 1 of the data that the master writes in cycles.
    ModuleWrite0 = "module_write0",
    /// Register at position 2 of the data that the master writes in cycles.
    ModuleWrite1 = "module_write1",
    /// Register at position 3 of the data that the master writes in cycles.
    ModuleWrite2 = "module_write2",
    /// Register at position 4 of the data that the master writes in cycles.
    ModuleWrite3 = "module_write3",
    /// Register at position 5 of the data that the master writes in cycles.
    ModuleWrite4 = "module_write4",
    /// Register at position 6 of the data that the master writes in cycles.
    ModuleWrite5 = "module_write5",
    /// Register at position 7 of the data that the master writes in cycles.
    ModuleWrite6 = "module_write6",
    /// Register at position 8 of the data that the master writes in cycles.
    ModuleWrite7 = "module_write7",
    /// Serial number of the module.
    ModuleSerial = "module_serial",
    /// Hardware version of the module.
    ModuleHwVersion = "module_hw_version",
    /// Software version of the module.
    ModuleSwVersion = "module_sw_version",
    /// Time-outs on the way to the motor.
    ModuleTimeouts = "module_timeouts",
    /// Frames to the motor that were repeated.
    ModuleRetries = "module_retries",
    /// Frames to the motor that were given up.
    ModuleDiscarded = "module_discarded",
    /// Frames to the motor.
    ModuleFrames = "module_frames",
    /// Errors on the way to the motor's hardware.
    ModuleCrcErrors = "module_crc_errors",
    /// Inputs IN1-IN4 in bits.
    ModuleInputs = "module_inputs",
    /// Status bits.
    ModuleStatusBits = "module_status_bits",
    /// Protocol of the module.
    ModuleProtocol = "module_protocol",
}

/// A name that no role has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("there is no such role")]
pub struct UnknownRole;

impl FromStr for Role {
    type Err = UnknownRole;

    fn from_str(name: &str) -> Result<Self, UnknownRole> {
        Self::ALL.iter().copied().find(|role| role.name() == name).ok_or(UnknownRole)
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Role {
    /// Whether what is written there moves the motor, or changes how it moves: its owner alone may do that.
    #[must_use]
    pub fn commands(self) -> bool {
        [
            Self::ModeReg,
            Self::PSoll,
            Self::PNew,
            Self::VSoll,
            Self::ASoll,
            Self::TSoll,
            Self::PRegP,
            Self::VRegP,
            Self::ARegP,
            Self::TRegP,
            Self::LRegP,
            Self::ZRegP,
            Self::Command,
            Self::ModuleCommand,
        ]
        .contains(&self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_role_is_found_by_its_name_and_indexes_an_array() {
        for (position, role) in Role::ALL.iter().enumerate() {
            assert_eq!(role.name().parse(), Ok(*role));
            assert_eq!(*role as usize, position);
        }
        assert_eq!("warp".parse::<Role>(), Err(UnknownRole));
    }
}
