//! Error codes in words: what 0x603F shows, 0x1003 remembers and EMCY messages carry.

use crate::Dialect;

/// What error `code` means on a device that speaks `dialect`. A code that the tables do not have is described by the
/// group it belongs to.
#[must_use]
pub fn error_text(code: u16, dialect: Dialect) -> &'static str {
    let own = match dialect {
        Dialect::Cia402 | Dialect::Mac4(_) => None,
        Dialect::Jvl => find(&JVL, code),
    };
    let groups = [0xFFFF, 0xFFF0, 0xFF00, 0xF000].map(|mask| code & mask);
    own.or_else(|| groups.into_iter().find_map(|group| find(&STANDARD, group))).unwrap_or("unknown error")
}

fn find(table: &[(u16, &'static str)], code: u16) -> Option<&'static str> {
    let position = table.binary_search_by_key(&code, |(known, _)| *known).ok()?;
    table.get(position).map(|(_, text)| *text)
}

/// JVL's module manual, section 4.3.18.
const JVL: [(u16, &str); 4] = [
    (0x1001, "motor error"),
    (0x1002, "limit switch error"),
    (0x1003, "internal communication error"),
    (0x1004, "overflow of the communication queue"),
];

/// CiA 301 v4.2, table 26 (communication: 0x81xx and 0x82xx), and IEC 61800-7-201, error codes of 0x603F (the others).
const STANDARD: [(u16, &str); 201] = [
    (0x0000, "no error any more"),
    (0x1000, "generic error"),
    (0x2000, "current"),
    (0x2100, "current on the input side"),
    (0x2110, "short circuit or earth leakage on the input side"),
    (0x2120, "earth leakage on the input side"),
    (0x2121, "earth leakage of phase L1"),
    (0x2122, "earth leakage of phase L2"),
    (0x2123, "earth leakage of phase L3"),
    (0x2130, "short circuit on the input side"),
    (0x2131, "short circuit of phases L1-L2"),
    (0x2132, "short circuit of phases L2-L3"),
    (0x2133, "short circuit of phases L3-L1"),
    (0x2200, "internal current"),
    (0x2211, "internal current no. 1"),
    (0x2212, "internal current no. 2"),
    (0x2213, "over-current in the ramp function"),
    (0x2214, "over-current in the sequence"),
    (0x2220, "continuous over-current inside the device"),
    (0x2221, "continuous over-current no. 1 inside the device"),
    (0x2222, "continuous over-current no. 2 inside the device"),
    (0x2230, "short circuit or earth leakage inside the device"),
    (0x2240, "earth leakage inside the device"),
    (0x2250, "short circuit inside the device"),
    (0x2300, "current on the output side"),
    (0x2310, "continuous over-current on the output side"),
    (0x2311, "continuous over-current no. 1 on the output side"),
    (0x2312, "continuous over-current no. 2 on the output side"),
    (0x2320, "short circuit or earth leakage on the motor side"),
    (0x2330, "earth leakage on the motor side"),
    (0x2331, "earth leakage of phase U"),
    (0x2332, "earth leakage of phase V"),
    (0x2333, "earth leakage of phase W"),
    (0x2340, "short circuit on the motor side"),
    (0x2341, "short circuit of phases U-V"),
    (0x2342, "short circuit of phases V-W"),
    (0x2343, "short circuit of phases W-U"),
    (0x2350, "overload of the motor or drive (I2t), fault"),
    (0x2351, "overload of the motor or drive (I2t), warning"),
    (0x3000, "voltage"),
    (0x3100, "mains voltage"),
    (0x3110, "mains over-voltage"),
    (0x3111, "mains over-voltage of phase L1"),
    (0x3112, "mains over-voltage of phase L2"),
    (0x3113, "mains over-voltage of phase L3"),
    (0x3120, "mains under-voltage"),
    (0x3121, "mains under-voltage of phase L1"),
    (0x3122, "mains under-voltage of phase L2"),
    (0x3123, "mains under-voltage of phase L3"),
    (0x3130, "phase failure"),
    (0x3131, "failure of phase L1"),
    (0x3132, "failure of phase L2"),
    (0x3133, "failure of phase L3"),
    (0x3134, "phase sequence"),
    (0x3140, "mains frequency"),
    (0x3141, "mains frequency too high"),
    (0x3142, "mains frequency too low"),
    (0x3200, "DC link voltage"),
    (0x3210, "DC link over-voltage"),
    (0x3211, "DC link over-voltage no. 1"),
    (0x3212, "DC link over-voltage no. 2"),
    (0x3220, "DC link under-voltage"),
    (0x3221, "DC link under-voltage no. 1"),
    (0x3222, "DC link under-voltage no. 2"),
    (0x3230, "load error"),
    (0x3300, "output voltage"),
    (0x3310, "output over-voltage"),
    (0x3311, "output over-voltage of phase U"),
    (0x3312, "output over-voltage of phase V"),
    (0x3313, "output over-voltage of phase W"),
    (0x3320, "armature circuit"),
    (0x3321, "armature circuit interrupted"),
    (0x3330, "field circuit"),
    (0x3331, "field circuit interrupted"),
    (0x4000, "temperature"),
    (0x4100, "ambient temperature"),
    (0x4110, "ambient temperature too high"),
    (0x4120, "ambient temperature too low"),
    (0x4130, "temperature of the supply air"),
    (0x4140, "temperature of the air outlet"),
    (0x4200, "temperature of the device"),
    (0x4210, "temperature of the device too high"),
    (0x4220, "temperature of the device too low"),
    (0x4300, "temperature of the drive"),
    (0x4310, "temperature of the drive too high"),
    (0x4320, "temperature of the drive too low"),
    (0x4400, "temperature of the supply"),
    (0x4410, "temperature of the supply too high"),
    (0x4420, "temperature of the supply too low"),
    (0x5000, "hardware of the device"),
    (0x5100, "supply"),
    (0x5110, "low voltage of the supply"),
    (0x5111, "supply of +/-15 V"),
    (0x5112, "supply of +24 V"),
    (0x5113, "supply of +5 V"),
    (0x5120, "supply of the intermediate circuit"),
    (0x5200, "control hardware"),
    (0x5210, "measurement circuit"),
    (0x5220, "computing circuit"),
    (0x5300, "operating unit"),
    (0x5400, "power section"),
    (0x5410, "output stages"),
    (0x5420, "chopper"),
    (0x5430, "input stages"),
    (0x5440, "contacts"),
    (0x5441, "contact 1 (safe torque off)"),
    (0x5442, "contact 2"),
    (0x5443, "contact 3"),
    (0x5444, "contact 4"),
    (0x5445, "contact 5"),
    (0x5450, "fuses"),
    (0x5451, "fuse of phase L1"),
    (0x5452, "fuse of phase L2"),
    (0x5453, "fuse of phase L3"),
    (0x5500, "memory"),
    (0x5510, "working memory"),
    (0x5520, "program memory"),
    (0x5530, "non-volatile data memory"),
    (0x6000, "software of the device"),
    (0x6010, "software reset by the watchdog"),
    (0x6100, "internal software"),
    (0x6200, "user software"),
    (0x6300, "data record"),
    (0x6301, "data record no. 1"),
    (0x6302, "data record no. 2"),
    (0x6303, "data record no. 3"),
    (0x6304, "data record no. 4"),
    (0x6305, "data record no. 5"),
    (0x6306, "data record no. 6"),
    (0x6307, "data record no. 7"),
    (0x6308, "data record no. 8"),
    (0x6309, "data record no. 9"),
    (0x630A, "data record no. 10"),
    (0x630B, "data record no. 11"),
    (0x630C, "data record no. 12"),
    (0x630D, "data record no. 13"),
    (0x630E, "data record no. 14"),
    (0x630F, "data record no. 15"),
    (0x6310, "loss of parameters"),
    (0x6320, "error in parameters"),
    (0x7000, "additional modules"),
    (0x7100, "power of additional modules"),
    (0x7110, "brake chopper"),
    (0x7111, "failure of the brake chopper"),
    (0x7112, "over-current of the brake chopper"),
    (0x7113, "protective circuit of the brake chopper"),
    (0x7120, "motor"),
    (0x7121, "motor blocked"),
    (0x7122, "motor error or commutation fault"),
    (0x7123, "motor tilted"),
    (0x7200, "measurement circuit of additional modules"),
    (0x7300, "sensor"),
    (0x7301, "tacho fault"),
    (0x7302, "tacho with wrong polarity"),
    (0x7303, "resolver 1 fault"),
    (0x7304, "resolver 2 fault"),
    (0x7305, "incremental encoder 1 fault"),
    (0x7306, "incremental encoder 2 fault"),
    (0x7307, "incremental encoder 3 fault"),
    (0x7310, "speed"),
    (0x7320, "position"),
    (0x7400, "computing circuit of additional modules"),
    (0x7500, "communication with additional modules"),
    (0x7510, "serial interface no. 1"),
    (0x7520, "serial interface no. 2"),
    (0x7600, "data storage"),
    (0x8000, "monitoring"),
    (0x8100, "communication"),
    (0x8110, "CAN overrun, objects lost"),
    (0x8120, "CAN controller error passive"),
    (0x8130, "life guard or heartbeat missing"),
    (0x8140, "recovered from bus off"),
    (0x8150, "collision of CAN-IDs"),
    (0x8200, "protocol error"),
    (0x8210, "PDO not processed, too short"),
    (0x8220, "PDO too long"),
    (0x8230, "DAM MPDO not processed, destination object not available"),
    (0x8240, "unexpected length of SYNC"),
    (0x8250, "RPDO missing"),
    (0x8300, "torque control"),
    (0x8311, "excess torque"),
    (0x8312, "difficult start"),
    (0x8313, "standstill torque"),
    (0x8321, "insufficient torque"),
    (0x8331, "torque fault"),
    (0x8400, "velocity controller"),
    (0x8500, "position controller"),
    (0x8600, "positioning controller"),
    (0x8611, "following error"),
    (0x8612, "reference limit"),
    (0x8700, "synchronisation controller"),
    (0x8800, "winding controller"),
    (0x8900, "monitoring of process data"),
    (0x8A00, "monitoring of control"),
    (0x9000, "external error"),
    (0xF000, "additional functions"),
    (0xF001, "deceleration"),
    (0xF002, "sub-synchronous run"),
    (0xF003, "stroke operation"),
    (0xF004, "additional control functions"),
    (0xFF00, "device-specific error"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_are_in_order() {
        let is_in_order = |table: &[(u16, &str)]| table.is_sorted_by(|a, b| a.0 < b.0);
        assert!(is_in_order(&STANDARD) && is_in_order(&JVL));
    }

    #[test]
    fn a_code_without_a_text_of_its_own_has_that_of_its_group() {
        let text = |code| error_text(code, Dialect::Cia402);
        assert_eq!(text(0x8130), "life guard or heartbeat missing");
        assert_eq!(text(0x8139), "life guard or heartbeat missing");
        assert_eq!(text(0x4242), "temperature of the device");
        assert_eq!(text(0x4999), "temperature");
        assert_eq!(text(0xFF42), "device-specific error");
        assert_eq!(text(0xA000), "unknown error");
        assert_eq!(text(0), "no error any more");
    }

    #[test]
    fn a_vendors_own_codes_have_its_words() {
        assert_eq!(error_text(0x1002, Dialect::Jvl), "limit switch error");
        assert_eq!(error_text(0x1002, Dialect::Cia402), "generic error");
        assert_eq!(error_text(0x8130, Dialect::Jvl), "life guard or heartbeat missing");
    }
}
