//! 2.1-2.30: SDO.

use od::AbortCode;

use crate::tool::Tool;

#[test]
fn cct_2_01_the_device_type_is_read_expedited() {
    Tool::new().talk(
        "> 601#4000100000000000
         < 581#4300100000000000",
    );
}

#[test]
fn cct_2_02_rw_entries_of_the_communication_area_are_written_and_read() {
    let mut tool = Tool::new();
    let values: [(u16, u8, &[u8]); 5] = [
        (0x1015, 0, &[0xE8, 0x03]),
        (0x1017, 0, &[0x10, 0x27]),
        (0x1400, 2, &[240]),
        (0x1800, 5, &[0x64, 0]),
        (0x1A07, 1, &[0x20, 0x01, 0x10, 0x21]),
    ];
    for (index, sub, bytes) in values {
        tool.write(index, sub, bytes).unwrap();
        assert_eq!(tool.read(index, sub).unwrap(), bytes);
    }
}

#[test]
fn cct_2_03_the_device_type_is_not_written() {
    assert_eq!(Tool::new().write(0x1000, 0, &[1, 2, 3, 4]), Err(AbortCode::ReadOnly));
}

#[test]
fn cct_2_04_a_write_only_object_is_not_read() {
    assert_eq!(Tool::new().read(0x2100, 3), Err(AbortCode::WriteOnly));
}

#[test]
fn cct_2_05_a_sub_index_that_does_not_exist_is_refused() {
    assert_eq!(Tool::new().read(0x1000, 1), Err(AbortCode::NoSubIndex));
}

#[test]
fn cct_2_06_an_object_that_does_not_exist_is_refused() {
    assert_eq!(Tool::new().read(0x1004, 0), Err(AbortCode::NoObject));
}

#[test]
fn cct_2_07_a_wrong_command_specifier_is_refused() {
    Tool::new().talk(
        "> 601#E000100000000000
         < 581#8000100001000405",
    );
}

#[test]
fn cct_2_08_a_u32_to_a_u16_or_u8_is_refused() {
    let mut tool = Tool::new();
    assert_eq!(tool.write(0x1017, 0, &[1, 0, 0, 0]), Err(AbortCode::TooLong));
    assert_eq!(tool.write(0x2005, 0, &[1, 0, 0, 0]), Err(AbortCode::TooLong));
}

#[test]
fn cct_2_09_a_u8_to_a_u16_or_u32_is_refused() {
    let mut tool = Tool::new();
    assert_eq!(tool.write(0x1017, 0, &[1]), Err(AbortCode::TooShort));
    assert_eq!(tool.write(0x2007, 0, &[1]), Err(AbortCode::TooShort));
}

#[test]
fn cct_2_10_too_high_a_value_is_refused() {
    let mut tool = Tool::new();
    assert_eq!(tool.write(0x2103, 1, &[11]), Err(AbortCode::ValueTooHigh));
    assert_eq!(tool.write(0x2103, 2, &[101]), Err(AbortCode::ValueTooHigh));
}

#[test]
fn cct_2_11_too_low_a_value_is_refused() {
    let mut tool = Tool::new();
    assert_eq!(tool.write(0x2103, 1, &(-11_i8).to_le_bytes()), Err(AbortCode::ValueTooLow));
    assert_eq!(tool.write(0x2103, 2, &[0]), Err(AbortCode::ValueTooLow));
}

#[test]
fn cct_2_12_the_sdo_parameters_are_those_of_the_pre_defined_connection_set() {
    let mut tool = Tool::new();
    assert_eq!((tool.number(0x1200, 1), tool.number(0x1200, 2)), (0x601, 0x581));
}

#[test]
fn cct_2_13_four_bytes_have_no_segments() {
    // Which transfer an upload becomes is the server's choice.
    Tool::new().talk(
        "> 601#4000100000000000
         < 581#4300100000000000
         > 601#6000000000000000
         < 581#8000000001000405",
    );
}

#[test]
fn cct_2_14_the_guard_time_is_written_in_segments() {
    Tool::new().talk(
        "> 601#210C100002000000
         < 581#600C100000000000
         > 601#0BE8030000000000
         < 581#2000000000000000
         > 601#400C100000000000
         < 581#4B0C1000E8030000",
    );
}

#[test]
fn cct_2_15_the_heartbeat_time_is_written_in_segments() {
    Tool::new().talk(
        "> 601#2117100002000000
         < 581#6017100000000000
         > 601#0BE8030000000000
         < 581#2000000000000000
         > 601#4017100000000000
         < 581#4B171000E8030000",
    );
}

#[test]
fn cct_2_16_an_object_of_more_than_four_bytes_is_read_in_segments() {
    Tool::new().talk(
        "> 601#4009100000000000
         < 581#4109100009000000
         > 601#6000000000000000
         < 581#0073696D756C6174 // simulat
         > 601#7000000000000000
         < 581#1B65640000000000 // ed",
    );
}

#[test]
fn cct_2_17_a_wrong_toggle_bit_ends_the_upload() {
    Tool::new().talk(
        "> 601#4009100000000000
         < 581#4109100009000000
         > 601#7000000000000000
         < 581#8009100000000305",
    );
}

#[test]
fn cct_2_18_every_object_of_more_than_four_bytes_is_read_in_segments() {
    let mut tool = Tool::new();
    assert_eq!(tool.read(0x1008, 0).unwrap(), b"CANopen reference device");
    assert_eq!(tool.read(0x2102, 1).unwrap(), b"A string that takes segments");
    assert_eq!(tool.read(0x201B, 0).unwrap(), [0; 8]);
}

#[test]
fn cct_2_19_the_device_type_is_read_as_a_block_without_crc() {
    Tool::new().talk(
        "> 601#A00010007F000000
         < 581#C600100004000000
         > 601#A300000000000000
         < 581#8100000000000000
         > 601#A2017F0000000000
         < 581#CD00000000000000
         > 601#A100000000000000",
    );
}

#[test]
fn cct_2_20_the_guard_time_is_written_as_a_block_without_crc() {
    Tool::new().talk(
        "> 601#C20C100002000000
         < 581#A40C10007F000000
         > 601#81E8030000000000
         < 581#A2017F0000000000
         > 601#D500000000000000
         < 581#A100000000000000
         > 601#400C100000000000
         < 581#4B0C1000E8030000",
    );
}

#[test]
fn cct_2_21_the_heartbeat_time_is_written_as_a_block_without_crc() {
    Tool::new().talk(
        "> 601#C217100002000000
         < 581#A41710007F000000
         > 601#81E8030000000000
         < 581#A2017F0000000000
         > 601#D500000000000000
         < 581#A100000000000000
         > 601#4017100000000000
         < 581#4B171000E8030000",
    );
}

#[test]
fn cct_2_22_an_object_with_segments_is_read_as_a_block() {
    Tool::new().talk(
        "> 601#A00910007F000000
         < 581#C609100009000000
         > 601#A300000000000000
         < 581#0173696D756C6174
         < 581#8265640000000000
         > 601#A2027F0000000000
         < 581#D500000000000000 // no CRC was asked for
         > 601#A100000000000000",
    );
}

#[test]
fn cct_2_23_an_object_is_read_as_a_block_with_crc() {
    Tool::new().talk(
        "> 601#A40910007F000000
         < 581#C609100009000000
         > 601#A300000000000000
         < 581#0173696D756C6174
         < 581#8265640000000000
         > 601#A2027F0000000000
         < 581#D5076C0000000000
         > 601#A100000000000000",
    );
}

#[test]
fn cct_2_24_the_guard_time_is_written_as_a_block_with_crc() {
    Tool::new().talk(
        "> 601#C60C100002000000
         < 581#A40C10007F000000
         > 601#81E8030000000000
         < 581#A2017F0000000000
         > 601#D578A90000000000
         < 581#A100000000000000
         > 601#400C100000000000
         < 581#4B0C1000E8030000",
    );
}

#[test]
fn cct_2_25_the_heartbeat_time_is_written_as_a_block_with_crc() {
    Tool::new().talk(
        "> 601#C617100002000000
         < 581#A41710007F000000
         > 601#81E8030000000000
         < 581#A2017F0000000000
         > 601#D500000000000000 // a wrong CRC
         < 581#8017100004000405
         > 601#C617100002000000
         < 581#A41710007F000000
         > 601#81E8030000000000
         < 581#A2017F0000000000
         > 601#D578A90000000000
         < 581#A100000000000000",
    );
}

#[test]
fn cct_2_26_a_block_of_128_segments_is_refused() {
    Tool::new().talk(
        "> 601#A009100080000000
         < 581#8009100002000405",
    );
}

#[test]
fn cct_2_27_sequence_number_128_is_refused() {
    Tool::new().talk(
        "> 601#A00910007F000000
         < 581#C609100009000000
         > 601#A300000000000000
         < 581#0173696D756C6174
         < 581#8265640000000000
         > 601#A2807F0000000000
         < 581#8009100003000405",
    );
}

/// Reads the parameters of all further SDO servers: those there are, and of no others.
fn scan_servers(tool: &mut Tool) {
    for index in 0x1201..0x1280 {
        let is_there = tool.profile.communication.has_object(index);
        let expected = if is_there { None } else { Some(AbortCode::NoObject) };
        assert_eq!(tool.read(index, 1).err(), expected, "0x{index:04X}");
    }
}

#[test]
fn cct_2_28_further_servers_are_those_of_the_data_sheet() {
    scan_servers(&mut Tool::new());
}

#[test]
fn cct_2_29_further_servers_are_the_same_after_a_reset_of_the_communication() {
    let mut tool = Tool::new();
    assert_eq!(tool.send("000#8201"), ["701#00"]);
    scan_servers(&mut tool);
}

#[test]
fn cct_2_30_after_saving_and_a_reset_there_are_no_sdo_clients() {
    let mut tool = Tool::new();
    tool.write(0x1010, 1, b"save").unwrap();
    assert_eq!(tool.send("000#8201"), ["701#00"]);
    for index in 0x1280..0x1300 {
        assert_eq!(tool.read(index, 1), Err(AbortCode::NoObject), "0x{index:04X}");
    }
}
