//! The motor of these tests: 409600 steps a turn, 3 Nm at 9 A.

use axis::{PlantConfig, PlantFault};
use profiles::PositionRange;

use crate::bench::Bench;

/// Steps a turn.
pub(crate) const TURN: i64 = 409_600;

/// Registers by their names in the manual.
pub(crate) mod reg {
    pub(crate) const MODE_REG: u8 = 2;
    pub(crate) const P_SOLL: u8 = 3;
    pub(crate) const V_SOLL: u8 = 5;
    pub(crate) const A_SOLL: u8 = 6;
    pub(crate) const RUN_CURRENT: u8 = 7;
    pub(crate) const STANDBY_TIME: u8 = 8;
    pub(crate) const STANDBY_CURRENT: u8 = 9;
    pub(crate) const P_IST: u8 = 10;
    pub(crate) const V_IST: u8 = 12;
    pub(crate) const V_START: u8 = 13;
    pub(crate) const GEAR1: u8 = 14;
    pub(crate) const GEAR2: u8 = 15;
    pub(crate) const ENCODER_POS: u8 = 16;
    pub(crate) const INPUTS: u8 = 18;
    pub(crate) const OUTPUTS: u8 = 19;
    pub(crate) const FLWERR: u8 = 20;
    pub(crate) const FLWERRMAX: u8 = 22;
    pub(crate) const COMMAND: u8 = 24;
    pub(crate) const STATUSBITS: u8 = 25;
    pub(crate) const TEMP: u8 = 26;
    pub(crate) const MIN_P_IST: u8 = 28;
    pub(crate) const MAX_P_IST: u8 = 30;
    pub(crate) const ACC_EMERG: u8 = 32;
    pub(crate) const IN_POSITION_WINDOW: u8 = 33;
    pub(crate) const IN_POSITION_COUNT: u8 = 34;
    pub(crate) const ERR_BITS: u8 = 35;
    pub(crate) const WARN_BITS: u8 = 36;
    pub(crate) const STARTMODE: u8 = 37;
    pub(crate) const P_HOME: u8 = 38;
    pub(crate) const V_HOME: u8 = 40;
    pub(crate) const HOMEMODE: u8 = 42;
    pub(crate) const V_REG_P: u8 = 44;
    pub(crate) const ABS_ENC_POS: u8 = 46;
    pub(crate) const P1: u8 = 49;
    pub(crate) const P7: u8 = 61;
    pub(crate) const P8: u8 = 63;
    pub(crate) const V1: u8 = 65;
    pub(crate) const A1: u8 = 73;
    pub(crate) const T1: u8 = 77;
    pub(crate) const ANALOG_INPUT_1: u8 = 89;
    pub(crate) const BUSVOL: u8 = 97;
    pub(crate) const MIN_BUSVOL: u8 = 98;
    pub(crate) const ZERO_SEARCH_BITS: u8 = 122;
    pub(crate) const SETUP_BITS: u8 = 124;
    pub(crate) const IOSETUP: u8 = 125;
    pub(crate) const TURNTAB_MODE: u8 = 126;
    pub(crate) const TURNTAB_SIZE: u8 = 127;
    pub(crate) const NL_MASK: u8 = 129;
    pub(crate) const PL_MASK: u8 = 130;
    pub(crate) const HOME_MASK: u8 = 132;
    pub(crate) const INPUT_FILTER_MASK: u8 = 135;
    pub(crate) const INPUT_FILTER_CNT: u8 = 136;
    pub(crate) const INPOS_MASK: u8 = 137;
    pub(crate) const ERROR_MASK: u8 = 138;
    pub(crate) const P_NEW: u8 = 144;
    pub(crate) const EXT_ENCODER: u8 = 170;
    pub(crate) const EXT_ENCODER_VEL: u8 = 172;
    pub(crate) const CONTROL_WORD: u8 = 180;
    pub(crate) const STATUS_WORD: u8 = 181;
    pub(crate) const MODE_OF_OPERATION: u8 = 182;
    pub(crate) const MODE_DISPLAY: u8 = 183;
    pub(crate) const TARGET_POSITION: u8 = 184;
    pub(crate) const ACTUAL_POSITION: u8 = 186;
    pub(crate) const TARGET_VELOCITY: u8 = 188;
    pub(crate) const ACTUAL_VELOCITY: u8 = 190;
    pub(crate) const DIGITAL_OUTPUTS: u8 = 192;
    pub(crate) const TICKS: u8 = 202;
}

/// Bits of STATUSBITS.
pub(crate) mod status {
    pub(crate) const AUTO_CORRECTION: i64 = 1 << 1;
    pub(crate) const PHYSICAL_POSITION: i64 = 1 << 2;
    pub(crate) const AT_VELOCITY: i64 = 1 << 3;
    pub(crate) const IN_POSITION: i64 = 1 << 4;
    pub(crate) const ACCELERATING: i64 = 1 << 5;
    pub(crate) const DECELERATING: i64 = 1 << 6;
    pub(crate) const ZERO_SEARCH_DONE: i64 = 1 << 7;
}

/// Bits of ERR_BITS.
pub(crate) mod error {
    pub(crate) const GENERAL: i64 = 1 << 0;
    pub(crate) const FOLLOW: i64 = 1 << 1;
    pub(crate) const POSITION_LIMIT: i64 = 1 << 3;
    pub(crate) const LOW_VOLTAGE: i64 = 1 << 4;
    pub(crate) const OVER_VOLTAGE: i64 = 1 << 5;
    pub(crate) const TEMPERATURE: i64 = 1 << 6;
    pub(crate) const ENCODER: i64 = 1 << 10;
}

impl Bench {
    pub(crate) fn mis() -> Self {
        Self::new("jvl-mis34x")
    }

    pub(crate) fn mis_with(arrange: impl Fn(&mut PlantConfig)) -> Self {
        Self::with_plant("jvl-mis34x", arrange)
    }

    /// Register `number`, signed.
    pub(crate) fn reg(&self, number: u8) -> i64 {
        i64::from(self.get_sub(0x2012, number) as i32)
    }

    pub(crate) fn set_reg(&mut self, number: u8, value: i64) {
        self.set_regs(&[(number, value)]);
    }

    /// Writes registers in one batch.
    pub(crate) fn set_regs(&mut self, values: &[(u8, i64)]) {
        let items: Vec<_> =
            values.iter().map(|(number, value)| (0x2012, *number, i64::from(*value as u32))).collect();
        self.batch(&items).unwrap();
    }

    pub(crate) fn has(&self, bits: i64) -> bool {
        self.reg(reg::STATUSBITS) & bits == bits
    }

    pub(crate) fn until(&mut self, number: u8, done: impl Fn(i64) -> bool) {
        self.run_until(|b| done(b.reg(number)));
    }

    /// Fast enough for tests: 1000 RPM, 10000 RPM/s, all the current.
    pub(crate) fn fast(&mut self) {
        self.set_regs(&[(reg::V_SOLL, 100_000), (reg::A_SOLL, 10_000), (reg::RUN_CURRENT, 1533)]);
    }

    /// Moves to a place in position mode, and waits for it.
    pub(crate) fn go_to(&mut self, place: i64) {
        self.set_regs(&[(reg::P_SOLL, place), (reg::MODE_REG, 2)]);
        self.run(2);
        self.run_until(|b| b.has(status::IN_POSITION));
    }

    pub(crate) fn block_shaft(&mut self) {
        self.plant().inject(PlantFault::BlockedShaft);
    }

    pub(crate) fn free_shaft(&mut self) {
        self.plant().clear(PlantFault::BlockedShaft);
    }
}

pub(crate) fn range(min: f64, max: f64) -> Option<PositionRange> {
    PositionRange::new(axis::Position(min), axis::Position(max))
}
