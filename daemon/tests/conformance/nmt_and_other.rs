//! 8.1-8.10: other; 9.1-9.4: NMT states; 10.1-10.4: NMT transitions.

use od::AbortCode;

use crate::tool::Tool;

/// Commands to node 1 that lead to a state, and its heartbeat value.
const PRE_OPERATIONAL: (&str, &str) = ("000#8001", "701#7F");
const OPERATIONAL: (&str, &str) = ("000#0101", "701#05");
const STOPPED: (&str, &str) = ("000#0201", "701#04");

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
