//! 5.1-5.6: emergencies; 6.1-6.10: SYNC.

use od::AbortCode;

use crate::tool::Tool;

#[test]
fn cct_5_01_the_emergency_cob_id_is_that_of_the_pre_defined_connection_set() {
    assert_eq!(Tool::new().number(0x1014, 0), 0x81);
}

#[test]
fn cct_5_02_at_first_there_is_no_error() {
    assert_eq!(Tool::new().number(0x1001, 0), 0);
}

#[test]
fn cct_5_03_at_first_the_history_is_empty() {
    let mut tool = Tool::new();
    assert_eq!((tool.number(0x1003, 0), tool.read(0x1003, 1)), (0, Err(AbortCode::NoData)));
}

/// The device after an RPDO that is too short.
fn with_error() -> Tool {
    let mut tool = Tool::new();
    tool.send("000#0101");
    assert_eq!(tool.send("201#07"), ["081#1082110100010000"]);
    tool
}

#[test]
fn cct_5_04_an_error_is_told_by_an_emergency_message() {
    with_error();
}

#[test]
fn cct_5_05_an_error_stands_in_the_error_register() {
    assert_eq!(with_error().number(0x1001, 0), 0x11);
}

#[test]
fn cct_5_06_an_error_stands_in_the_history() {
    let mut tool = with_error();
    assert_eq!((tool.number(0x1003, 0), tool.number(0x1003, 1) & 0xFFFF), (1, 0x8210));
}

#[test]
fn cct_6_01_the_sync_cob_id_is_that_of_the_pre_defined_connection_set() {
    assert_eq!(Tool::new().number(0x1005, 0), 0x80);
}

/// The device as the producer of a SYNC every 10 ms, with this counter overflow value.
fn producer(overflow: u8) -> Tool {
    let mut tool = Tool::new();
    tool.write(0x1019, 0, &[overflow]).unwrap();
    tool.write(0x1006, 0, &10_000_u32.to_le_bytes()).unwrap();
    tool.write(0x1005, 0, &0x4000_0080_u32.to_le_bytes()).unwrap();
    tool
}

#[test]
fn cct_6_02_a_producer_sends_a_sync_in_every_period() {
    assert_eq!(producer(0).pass(1000), ["080#"; 100]);
}

#[test]
fn cct_6_03_there_are_as_many_tpdos_as_the_syncs_make() {
    let mut tool = Tool::with_tpdo(4, 0);
    tool.send("000#0101");
    let sent: usize = (0..1000).map(|_| tool.send("080#").len()).sum();
    assert_eq!(sent, 250);
}

#[test]
fn cct_6_04_a_consumer_sends_no_sync() {
    let mut tool = producer(0);
    tool.pass(55);
    tool.write(0x1005, 0, &0x80_u32.to_le_bytes()).unwrap();
    tool.write(0x1006, 0, &[0; 4]).unwrap();
    assert_eq!(tool.pass(1000), [""; 0]);
}

#[test]
fn cct_6_05_an_invalid_overflow_value_is_refused() {
    let mut tool = Tool::new();
    for overflow in [1, 241, 255] {
        assert_eq!(tool.write(0x1019, 0, &[overflow]), Err(AbortCode::InvalidValue));
    }
}

#[test]
fn cct_6_06_an_overflow_value_of_zero_is_taken() {
    let mut tool = Tool::new();
    for overflow in [2, 240, 0] {
        tool.write(0x1019, 0, &[overflow]).unwrap();
        assert_eq!(tool.number(0x1019, 0), u64::from(overflow));
    }
}

#[test]
fn cct_6_07_the_counter_goes_from_1_to_its_overflow_value() {
    assert_eq!(producer(3).pass(40), ["080#01", "080#02", "080#03", "080#01"]);
}

#[test]
fn cct_6_08_a_saved_producer_counts_from_1_after_a_reset() {
    let mut tool = producer(3);
    tool.pass(25);
    tool.write(0x1010, 1, b"save").unwrap();
    assert_eq!(tool.send("000#8101"), ["701#00"]);
    assert_eq!(tool.pass(40), ["080#01", "080#02", "080#03", "080#01"]);

    tool.write(0x1011, 1, b"load").unwrap();
    assert_eq!(tool.send("000#8101"), ["701#00"]);
    assert_eq!(tool.pass(1000), [""; 0]);
}

#[test]
fn cct_6_09_the_overflow_value_stays_while_there_is_a_period() {
    assert_eq!(producer(3).write(0x1019, 0, &[4]), Err(AbortCode::DeviceState));
}

#[test]
fn cct_6_10_saved_sync_values_stay_after_a_reset() {
    let mut tool = Tool::new();
    tool.write(0x1005, 0, &0x80_u32.to_le_bytes()).unwrap();
    tool.write(0x1006, 0, &[0; 4]).unwrap();
    tool.write(0x1019, 0, &[5]).unwrap();
    tool.write(0x1010, 1, b"save").unwrap();
    assert_eq!(tool.send("000#8101"), ["701#00"]);
    let values = [0x1005, 0x1006, 0x1019].map(|index| tool.number(index, 0));
    assert_eq!(values, [0x80, 0, 5]);
}
