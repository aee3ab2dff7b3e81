//! What went wrong, as a bus tells it.

use axis::DriveFault;

use crate::Dialect;

/// A fault of the device for 0x603F and EMCY.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Error code.
    pub code: u16,
    /// Bits of the error register 0x1001 beside the generic one.
    pub register: u8,
    /// Manufacturer-specific information.
    pub detail: [u8; 5],
}

const CURRENT: u8 = 1 << 1;
const VOLTAGE: u8 = 1 << 2;
const TEMPERATURE: u8 = 1 << 3;
const COMMUNICATION: u8 = 1 << 4;
const PROFILE: u8 = 1 << 5;

impl Fault {
    /// The fault of an axis in the words of `dialect`.
    pub(crate) fn new(fault: axis::Fault, dialect: Dialect) -> Self {
        if fault == axis::Fault::Lost && dialect == Dialect::Jvl {
            return Self::motor_lost();
        }
        let (code, register) = standard(fault);
        Self::told(code, register, dialect)
    }

    /// The master is gone, and 0x6007 calls that a fault.
    pub(crate) fn connection_lost(dialect: Dialect) -> Self {
        const GENERIC_COMMUNICATION: u16 = 0x8100;
        Self::told(GENERIC_COMMUNICATION, COMMUNICATION, dialect)
    }

    /// The motor runs faster than 0x6080 allows.
    pub(crate) fn over_speed(dialect: Dialect) -> Self {
        const VELOCITY_CONTROL: u16 = 0x8400;
        Self::told(VELOCITY_CONTROL, PROFILE, dialect)
    }

    /// A limit switch that JVL's module was told to watch (module manual, sections 4.3.11 and 4.3.18).
    pub(crate) fn limit_switch() -> Self {
        Self { code: 0x1002, register: 0, detail: [0; 5] }
    }

    /// An error that JVL's motor has found (module manual, section 4.3.18).
    pub(crate) fn motor() -> Self {
        Self { code: 0x1001, register: 0, detail: [0; 5] }
    }

    /// The same fault with what the motor's ERR_STAT was, in the order of JVL's CANopen modules: bits 15-8, 7-0, 23-16
    /// and 31-24.
    pub(crate) fn with_motor_status(mut self, status: u32) -> Self {
        let [lowest, low, high, highest] = status.to_le_bytes();
        self.detail = [low, lowest, high, highest, 0];
        self
    }

    /// JVL's module does not hear its motor any more: "Internal communication error" (module manual, section 4.3.18).
    pub(crate) fn motor_lost() -> Self {
        Self { code: 0x1003, register: 0, detail: [0; 5] }
    }

    /// JVL's module has had to drop a PDO: "Queue overflow in communication queue" (module manual, section 4.3.18).
    pub(crate) fn queue_overflow() -> Self {
        Self { code: 0x1004, register: 0, detail: [0; 5] }
    }

    /// The same fault with the number of its axis, from 1 on, in the first byte of the detail: for devices with
    /// several axes.
    pub(crate) fn on_axis(mut self, number: u8) -> Self {
        let [axis, ..] = &mut self.detail;
        *axis = number;
        self
    }

    fn told(code: u16, register: u8, dialect: Dialect) -> Self {
        match dialect {
            Dialect::Cia402 | Dialect::Mac4(_) => Self { code, register, detail: [0; 5] },
            // "Generic error - Motor error", whatever it is (module manual, section 4.3.18).
            Dialect::Jvl => Self { code: 0x1001, register: 0, detail: [0; 5] },
        }
    }
}

/// Error code (IEC 61800-7-201, table of 0x603F) and error register bit.
const fn standard(fault: axis::Fault) -> (u16, u8) {
    match fault {
        axis::Fault::FollowingError => (0x8611, PROFILE),
        axis::Fault::Lost => (0x7500, 0),
        axis::Fault::EmergencyStop => (0x9000, 0),
        axis::Fault::DriveSignal => (0x5000, 0),
        axis::Fault::Supervision => (0x8100, COMMUNICATION),
        axis::Fault::Drive(cause) => match cause {
            DriveFault::OverCurrent => (0x2310, CURRENT),
            DriveFault::OverVoltage => (0x3210, VOLTAGE),
            DriveFault::UnderVoltage => (0x3220, VOLTAGE),
            DriveFault::OverTemperature => (0x4310, TEMPERATURE),
            DriveFault::Overload => (0x2350, CURRENT),
            DriveFault::Encoder => (0x7305, 0),
            DriveFault::SafeTorqueOff => (0x5441, 0),
            DriveFault::Internal => (0x5000, 0),
        },
    }
}
