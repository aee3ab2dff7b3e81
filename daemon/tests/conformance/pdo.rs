//! 3.1-3.33: PDOs. The tool runs its cases of transmission in OPERATIONAL (3.3-3.8), STOPPED (3.9-3.14) and
//! PRE-OPERATIONAL (3.15-3.20).

use od::{AbortCode, Address, Direction, Mappable};

use crate::tool::Tool;

const EVENT_DRIVEN: u8 = 255;
const ACYCLIC: u8 = 0;
const ON_REQUEST: u8 = 253;
const PROCESS_VALUE_1: u16 = 0x2110;

fn scan(base: u16, cob_ids: [u64; 8]) {
    let mut tool = Tool::new();
    for (communication, cob_id) in (base..).zip(cob_ids) {
        assert_eq!(tool.number(communication, 1), cob_id);
        assert!(tool.read(communication, 2).is_ok() && tool.read(communication + 0x200, 0).is_ok());
    }
    assert_eq!(tool.read(base + 8, 1), Err(AbortCode::NoObject));
}

const NOT_VALID: u64 = 1 << 31;
const NO_RTR: u64 = 1 << 30;

#[test]
fn cct_3_01_there_are_eight_rpdos() {
    scan(0x1400, [0x201, 0x301, 0x401, 0x501, NOT_VALID, NOT_VALID, NOT_VALID, NOT_VALID]);
}

#[test]
fn cct_3_02_there_are_eight_tpdos() {
    let none = NOT_VALID | NO_RTR;
    let valid = [0x181, 0x281, 0x381, 0x481].map(|id| id | NO_RTR);
    scan(0x1800, [valid[0], valid[1], valid[2], valid[3], none, none, none, none]);
}

#[test]
fn cct_3_03_a_tpdo_is_asked_for_by_a_remote_frame() {
    Tool::with_tpdo(ON_REQUEST, 0).talk(
        "> 000#0101
         > 181#R8
         < 181#0000000000000000",
    );
    Tool::with_tpdo(252, 0).talk(
        "> 000#0101
         > 181#R8
         > 080#
         > 181#R8
         < 181#0000000000000000",
    );
}

#[test]
fn cct_3_04_an_event_driven_tpdo_goes_at_once_and_on_change() {
    for transmission in [254, EVENT_DRIVEN] {
        Tool::with_tpdo(transmission, 0).talk(
            "> 000#0101
             < 181#0000000000000000
             > 601#2310210107000000
             < 581#6010210100000000
             < 181#0700000000000000
             + 1000",
        );
    }
}

#[test]
fn cct_3_05_a_tpdo_goes_with_its_event_timer() {
    Tool::with_tpdo(EVENT_DRIVEN, 100).talk(
        "> 000#0101
         < 181#0000000000000000
         + 99
         + 1
         < 181#0000000000000000
         + 200
         < 181#0000000000000000
         < 181#0000000000000000",
    );
}

#[test]
fn cct_3_06_a_cyclic_tpdo_goes_with_every_nth_sync() {
    for every in [1, 2, 10, 240] {
        let mut tool = Tool::with_tpdo(every, 0);
        assert_eq!(tool.send("000#0101"), [""; 0]);
        for count in 1..=480 {
            let sent = tool.send("080#").len();
            assert_eq!(sent, usize::from(count % usize::from(every) == 0), "type {every}, SYNC {count}");
        }
    }
}

#[test]
fn cct_3_07_an_acyclic_tpdo_goes_with_the_sync_after_a_change() {
    Tool::with_tpdo(ACYCLIC, 0).talk(
        "> 000#0101
         > 080#
         < 181#0000000000000000
         > 080#
         > 601#2310210107000000
         < 581#6010210100000000
         > 080#
         < 181#0700000000000000
         > 080#",
    );
}

/// The device with a TPDO that goes with every SYNC from the one with counter 3 on.
fn with_start_value() -> Tool {
    let mut tool = Tool::with_tpdo(1, 0);
    let cob_id = tool.invalidate(0x1800);
    tool.write(0x1800, 6, &[3]).unwrap();
    tool.write(0x1800, 1, &cob_id.to_le_bytes()).unwrap();
    tool.write(0x1019, 0, &[10]).unwrap();
    tool
}

#[test]
fn cct_3_08_a_cyclic_tpdo_waits_for_its_sync_start_value() {
    with_start_value().talk(
        "> 000#0101
         > 080#01
         > 080#02
         > 080#03
         < 181#0000000000000000
         > 080#04
         < 181#0000000000000000",
    );
}

/// What makes a TPDO of each kind go in OPERATIONAL makes none in this state, which `command` leads to.
fn stays_silent(transmission: u8, event_timer: u16, command: &str) {
    let mut tool = Tool::with_tpdo(transmission, event_timer);
    tool.send("000#0101");
    assert_eq!(tool.send(command), [""; 0]);
    for occasion in ["181#R8", "080#", "080#"] {
        assert_eq!(tool.send(occasion), [""; 0], "{occasion}");
    }
    // A stopped device does not hear it.
    let answers = tool.send("601#2310210107000000");
    assert!(answers.iter().all(|frame| frame.starts_with("581#")), "{answers:?}");
    assert_eq!(tool.pass(1000), [""; 0]);
}

const STOP: &str = "000#0201";
const ENTER_PRE_OPERATIONAL: &str = "000#8001";

#[test]
fn cct_3_09_a_stopped_device_answers_no_request() {
    stays_silent(ON_REQUEST, 0, STOP);
}

#[test]
fn cct_3_10_a_stopped_device_sends_no_event_driven_tpdo() {
    stays_silent(EVENT_DRIVEN, 0, STOP);
}

#[test]
fn cct_3_11_a_stopped_device_has_no_event_timer() {
    stays_silent(EVENT_DRIVEN, 100, STOP);
}

#[test]
fn cct_3_12_a_stopped_device_sends_no_cyclic_tpdo() {
    stays_silent(1, 0, STOP);
}

#[test]
fn cct_3_13_a_stopped_device_sends_no_acyclic_tpdo() {
    stays_silent(ACYCLIC, 0, STOP);
}

#[test]
fn cct_3_14_a_stopped_device_sends_no_tpdo_with_a_sync_start_value() {
    let mut tool = with_start_value();
    tool.send("000#0101");
    for frame in [STOP, "080#03", "080#04"] {
        assert_eq!(tool.send(frame), [""; 0]);
    }
}

#[test]
fn cct_3_15_a_pre_operational_device_answers_no_request() {
    stays_silent(ON_REQUEST, 0, ENTER_PRE_OPERATIONAL);
}

#[test]
fn cct_3_16_a_pre_operational_device_sends_no_event_driven_tpdo() {
    stays_silent(EVENT_DRIVEN, 0, ENTER_PRE_OPERATIONAL);
}

#[test]
fn cct_3_17_a_pre_operational_device_has_no_event_timer() {
    stays_silent(EVENT_DRIVEN, 100, ENTER_PRE_OPERATIONAL);
}

#[test]
fn cct_3_18_a_pre_operational_device_sends_no_cyclic_tpdo() {
    stays_silent(1, 0, ENTER_PRE_OPERATIONAL);
}

#[test]
fn cct_3_19_a_pre_operational_device_sends_no_acyclic_tpdo() {
    stays_silent(ACYCLIC, 0, ENTER_PRE_OPERATIONAL);
}

#[test]
fn cct_3_20_a_pre_operational_device_sends_no_tpdo_with_a_sync_start_value() {
    let mut tool = with_start_value();
    tool.send("000#0101");
    for frame in [ENTER_PRE_OPERATIONAL, "080#03", "080#04"] {
        assert_eq!(tool.send(frame), [""; 0]);
    }
}

#[test]
fn cct_3_21_what_is_mapped_by_default_exists_and_may_be_mapped() {
    let mut tool = Tool::new();
    for mapping in (0x1600..0x1608).chain(0x1A00..0x1A08) {
        let count = tool.number(mapping, 0) as u8;
        for sub in 1..=count {
            let [width, sub, low, high] = (tool.number(mapping, sub) as u32).to_le_bytes();
            let address = Address::new(u16::from_le_bytes([low, high]), sub);
            let entries = tool.entries();
            let (_, entry) = entries.iter().find(|(known, _)| *known == address).unwrap();
            assert_eq!(entry.data_type.bits(), Some(width), "{address}");
            let is_receive = mapping < 0x1A00;
            let is_allowed = if is_receive { entry.mappable.receive() } else { entry.mappable.transmit() };
            assert!(is_allowed, "{address} in 0x{mapping:04X}");
        }
    }
}

#[test]
fn cct_3_22_the_procedure_gives_a_new_mapping() {
    let mut tool = Tool::with_tpdo(EVENT_DRIVEN, 0);
    tool.map(0x1800, &[0x2112_0108, 0x2111_0101, 0x2111_0201, 0x2110_0120]).unwrap();
    tool.map(0x1400, &[0x2110_0120, 0x2111_0201, 0x2111_0101, 0x0001_0001, 0x2112_0108]).unwrap();
    tool.talk(
        "> 000#0101
         < 181#000000000000 // 42 bits
         > 201#7856341201AB // 32 bits, bits 2, 1 and none, 8 bits from bit 35
         < 181#60E259D14800",
    );
}

#[test]
fn cct_3_23_without_the_procedure_the_mapping_stays() {
    let mut tool = Tool::new();
    for mapping in [0x1600, 0x1A00] {
        let refused = tool.write(mapping, 1, &0x2112_0108_u32.to_le_bytes());
        assert_eq!(refused, Err(AbortCode::UnsupportedAccess));
        // Nor while the PDO is not valid and something is mapped.
        tool.invalidate(mapping - 0x200);
        let refused = tool.write(mapping, 1, &0x2112_0108_u32.to_le_bytes());
        assert_eq!(refused, Err(AbortCode::UnsupportedAccess));
    }
}

#[test]
fn cct_3_24_a_valid_pdo_keeps_its_mapping() {
    let mut tool = Tool::new();
    for mapping in [0x1600, 0x1A00] {
        assert_eq!(tool.write(mapping, 0, &[0]), Err(AbortCode::UnsupportedAccess));
        assert_eq!(tool.number(mapping, 0), 2);
    }
}

#[test]
fn cct_3_25_too_many_objects_are_refused() {
    let mut tool = Tool::new();
    for communication in [0x1400, 0x1800] {
        let bits: Vec<u32> = (1..=64).map(|sub| 0x2111_0001 | sub << 8).collect();
        tool.map(communication, &bits).unwrap();
        tool.invalidate(communication);
        assert_eq!(tool.write(communication + 0x200, 0, &[65]), Err(AbortCode::PdoLength));
    }
}

#[test]
fn cct_3_26_too_long_objects_are_refused() {
    let mut tool = Tool::new();
    for communication in [0x1400, 0x1800] {
        let refused = tool.map(communication, &[0x201B_0040, 0x2112_0108]);
        assert_eq!(refused, Err(AbortCode::PdoLength));
    }
}

/// Maps every entry of this kind into PDO 1 of that direction, alone.
fn map_each(direction: Direction, is_meant: impl Fn(Mappable) -> bool, expected: Result<(), AbortCode>) {
    let communication = if direction == Direction::Receive { 0x1400 } else { 0x1800 };
    let mut tool = Tool::new();
    let mut mapped = 0;
    for (address, entry) in tool.entries() {
        let Some(width) = entry.data_type.bits().filter(|_| is_meant(entry.mappable)) else { continue };
        let parameter = u32::from(address.index) << 16 | u32::from(address.sub) << 8 | u32::from(width);
        assert_eq!(tool.map(communication, &[parameter]), expected, "{address}");
        mapped += 1;
    }
    assert!(mapped > 0);
}

#[test]
fn cct_3_27_process_outputs_are_mapped_into_an_rpdo() {
    map_each(Direction::Receive, |m| m == Mappable::Receive, Ok(()));
    let mut tool = Tool::new();
    tool.map(0x1400, &[0x2101_0420]).unwrap();
    tool.send("000#0101");
    tool.send("201#78563412");
    assert_eq!(tool.number(0x2101, 4), 0x1234_5678);
}

#[test]
fn cct_3_28_process_inputs_are_not_mapped_into_an_rpdo() {
    map_each(Direction::Receive, |m| m == Mappable::Transmit, Err(AbortCode::NotMappable));
}

#[test]
fn cct_3_29_what_is_not_mappable_is_not_mapped_into_an_rpdo() {
    map_each(Direction::Receive, |m| m == Mappable::No, Err(AbortCode::NotMappable));
}

#[test]
fn cct_3_30_process_inputs_are_mapped_into_a_tpdo() {
    map_each(Direction::Transmit, |m| m == Mappable::Transmit, Ok(()));
    let mut tool = Tool::with_tpdo(EVENT_DRIVEN, 0);
    tool.map(0x1800, &[0x2101_0120, 0x2101_0320]).unwrap();
    assert_eq!(tool.send("000#0101"), ["181#0200000003000000"]);
}

#[test]
fn cct_3_31_process_outputs_are_not_mapped_into_a_tpdo() {
    map_each(Direction::Transmit, |m| m == Mappable::Receive, Err(AbortCode::NotMappable));
}

#[test]
fn cct_3_32_what_is_not_mappable_is_not_mapped_into_a_tpdo() {
    map_each(Direction::Transmit, |m| m == Mappable::No, Err(AbortCode::NotMappable));
}

#[test]
fn cct_3_33_dummies_take_room_in_an_rpdo() {
    let mut tool = Tool::new();
    tool.map(0x1400, &[0x0005_0008, 0x0006_0010, 0x0007_0020, 0x2112_0108]).unwrap();
    tool.send("000#0101");
    tool.send("201#FFFFFFFFFFFFFF2A");
    assert_eq!((tool.number(0x2112, 1), tool.number(PROCESS_VALUE_1, 1)), (0x2A, 0));
    assert_eq!(tool.map(0x1800, &[0x0005_0008]), Err(AbortCode::NotMappable));
}
