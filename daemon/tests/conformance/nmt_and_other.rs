//! 8.1-8.10: other; 9.1-9.4: NMT states; 10.1-10.4: NMT transitions.

use od::AbortCode;

use crate::tool::Tool;

/// Commands to node 1 that lead to a state, and its heartbeat value.
const PRE_OPERATIONAL: (&str, &str) = ("000#8001", "701#7F");
const OPERATIONAL: (&str, &str) = ("000#0101", "701#05");
const STOPPED: (&str, &str) = ("000#0201", "701#04");

/// The communication parameters that the tool changes before it stores or restores.
const PARAMETERS: [u16; 4] = [0x1005, 0x1006, 0x1015, 0x1017];
const CHANGED: [u64; 4] = [0x200, 5000, 1000, 20_000];
const DEFAULTS: [u64; 4] = [0x80, 0, 0, 0];

/// No signature: 'wron' as the tool writes it, the number 0x77726F6E.
const WRONG: &[u8] = b"norw";

/// The device with changed parameters, not stored.
fn changed() -> Tool {
    let mut tool = Tool::new();
    for (index, value) in PARAMETERS.into_iter().zip(CHANGED) {
        let length = tool.read(index, 0).unwrap().len();
        tool.write(index, 0, &value.to_le_bytes()[..length]).unwrap();
    }
    tool
}

/// The device with changed parameters that are stored.
fn saved() -> Tool {
    let mut tool = changed();
    tool.write(0x1010, 1, b"save").unwrap();
    tool
}

/// The parameters that the device has after a reset.
fn after_reset(mut tool: Tool) -> [u64; 4] {
    assert_eq!(tool.send("000#8101"), ["701#00"]);
    PARAMETERS.map(|index| tool.number(index, 0))
}

#[test]
fn cct_8_01_a_wrong_signature_saves_nothing() {
    let mut tool = changed();
    assert_eq!(tool.write(0x1010, 1, WRONG), Err(AbortCode::CannotStore));
    assert_eq!(after_reset(tool), DEFAULTS);
}

#[test]
fn cct_8_02_saved_parameters_stay_after_a_reset() {
    let mut tool = changed();
    tool.write(0x1010, 1, b"save").unwrap();
    assert_eq!(after_reset(tool), CHANGED);
}

#[test]
fn cct_8_03_a_wrong_signature_restores_nothing() {
    let mut tool = saved();
    assert_eq!(tool.write(0x1011, 1, WRONG), Err(AbortCode::CannotStore));
    assert_eq!(after_reset(tool), CHANGED);
}

#[test]
fn cct_8_04_restored_defaults_are_there_after_a_reset() {
    let mut tool = saved();
    tool.write(0x1011, 1, b"load").unwrap();
    assert_eq!(after_reset(tool), DEFAULTS);
}

#[test]
fn cct_8_05_a_wrong_signature_saves_no_communication_parameters() {
    let mut tool = changed();
    assert_eq!(tool.write(0x1010, 2, WRONG), Err(AbortCode::CannotStore));
    assert_eq!(after_reset(tool), DEFAULTS);
}

#[test]
fn cct_8_06_saved_communication_parameters_stay_after_a_reset() {
    let mut tool = changed();
    tool.write(0x1010, 2, b"save").unwrap();
    assert_eq!(after_reset(tool), CHANGED);
}

#[test]
fn cct_8_07_a_wrong_signature_restores_no_communication_parameters() {
    let mut tool = saved();
    assert_eq!(tool.write(0x1011, 2, WRONG), Err(AbortCode::CannotStore));
    assert_eq!(after_reset(tool), CHANGED);
}

#[test]
fn cct_8_08_restored_communication_defaults_are_there_after_a_reset() {
    let mut tool = saved();
    tool.write(0x1011, 2, b"load").unwrap();
    assert_eq!(after_reset(tool), DEFAULTS);
}

#[test]
fn cct_8_09_date_and_time_of_a_saved_configuration_stay_after_a_reset() {
    let mut tool = Tool::new();
    tool.write(0x1020, 1, &15_000_u32.to_le_bytes()).unwrap();
    tool.write(0x1020, 2, &43_200_000_u32.to_le_bytes()).unwrap();
    tool.write(0x1010, 2, b"save").unwrap();
    assert_eq!(tool.send("000#8101"), ["701#00"]);
    assert_eq!((tool.number(0x1020, 1), tool.number(0x1020, 2)), (15_000, 43_200_000));
}

#[test]
fn cct_8_10_restricted_can_ids_are_refused() {
    let mut tool = Tool::new();
    let restricted =
        [0x000_u32, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x701, 0x77F, 0x7FF];
    for (index, sub) in [(0x1005, 0), (0x1014, 0), (0x1400, 1), (0x1800, 1)] {
        for id in restricted {
            let refused = tool.write(index, sub, &id.to_le_bytes());
            assert_eq!(refused, Err(AbortCode::InvalidValue), "0x{id:03X} in 0x{index:04X}");
        }
    }
}

#[test]
fn cct_9_01_a_reset_boots_with_the_defaults() {
    let mut tool = Tool::off();
    assert_eq!(tool.power_on(), ["701#00"]);
    tool.write(0x1017, 0, &[100, 0]).unwrap();
    tool.write(0x2007, 0, &[1, 2, 3, 4]).unwrap();
    assert_eq!(tool.send("000#8101"), ["701#00"]);
    assert_eq!((tool.number(0x1017, 0), tool.number(0x2007, 0)), (0, 0));
}

#[test]
fn cct_9_02_after_boot_up_the_device_is_pre_operational() {
    let mut tool = Tool::off();
    assert_eq!(tool.power_on(), ["701#00"]);
    tool.write(0x1017, 0, &[100, 0]).unwrap();
    assert_eq!(tool.pass(100), ["701#7F"]);
    assert_eq!(tool.send("080#"), [""; 0]);
    assert_eq!(tool.send("201#0102030405060708"), [""; 0]);
    assert_eq!(tool.number(0x2110, 1), 0);
}

#[test]
fn cct_9_03_an_operational_device_has_sdos_and_pdos() {
    let mut tool = Tool::with_tpdo(1, 0);
    tool.send(OPERATIONAL.0);
    tool.send("201#0102030405060708");
    assert_eq!(tool.number(0x2110, 1), 0x0403_0201);
    assert_eq!(tool.send("080#"), ["181#0102030405060708"]);
}

#[test]
fn cct_9_04_a_stopped_device_has_only_its_heartbeat() {
    let mut tool = Tool::with_tpdo(1, 0);
    tool.write(0x1017, 0, &[100, 0]).unwrap();
    tool.send(STOPPED.0);
    for frame in ["601#4000100000000000", "080#", "201#0102030405060708", "181#R8"] {
        assert_eq!(tool.send(frame), [""; 0], "{frame}");
    }
    assert_eq!(tool.pass(100), ["701#04"]);
    tool.send(PRE_OPERATIONAL.0);
    assert_eq!(tool.number(0x2110, 1), 0);
}

/// From every state `command`, to this node and to all, leads to the state with this heartbeat.
fn leads_to(command: &str, heartbeat: &str) {
    for (from, _) in [PRE_OPERATIONAL, OPERATIONAL, STOPPED] {
        for command in [command.to_owned(), format!("{}00", &command[..6])] {
            let mut tool = Tool::with_tpdo(1, 0);
            tool.write(0x1017, 0, &[100, 0]).unwrap();
            tool.send(from);
            tool.send(&command);
            assert_eq!(tool.pass(100), [heartbeat], "{from}, {command}");
        }
    }
}

#[test]
fn cct_10_01_both_resets_boot_from_every_state() {
    for (from, _) in [PRE_OPERATIONAL, OPERATIONAL, STOPPED] {
        for (command, kept) in [("000#8101", 0), ("000#8201", 0x0403_0201), ("000#8100", 0)] {
            let mut tool = Tool::with_tpdo(1, 0);
            tool.write(0x2007, 0, &[1, 2, 3, 4]).unwrap();
            tool.write(0x1015, 0, &[1, 0]).unwrap();
            tool.send(from);
            assert_eq!(tool.send(command), ["701#00"], "{from}, {command}");
            assert_eq!((tool.number(0x1015, 0), tool.number(0x2007, 0)), (0, kept), "{from}, {command}");
        }
    }
}

#[test]
fn cct_10_02_enter_pre_operational_leads_there_from_every_state() {
    leads_to(PRE_OPERATIONAL.0, PRE_OPERATIONAL.1);
}

#[test]
fn cct_10_03_start_remote_node_leads_to_operational_from_every_state() {
    leads_to(OPERATIONAL.0, OPERATIONAL.1);
}

#[test]
fn cct_10_04_stop_remote_node_leads_to_stopped_from_every_state() {
    leads_to(STOPPED.0, STOPPED.1);
}
