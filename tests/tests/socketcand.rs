//! The demo over its socketcand port: no CAN in the kernel is needed.

use std::net::{Ipv4Addr, TcpListener};

use tests::{Bus, Client, Daemon, Master, axisd, config, free_port, run_python};

const PROFILE: &str = "jvl-mac00-fc4";

fn demo() -> (Daemon, Master) {
    let port = free_port();
    (Daemon::demo(port), Master::at(port, PROFILE))
}

#[test]
fn python_canopen_drives_an_axis() {
    let (_daemon, master) = demo();

    let log = master.run("drive402", &[]);

    insta::with_settings!({ prepend_module_to_snapshot => false }, { insta::assert_snapshot!("drive402", log) });
}

#[test]
fn python_canopen_drives_a_drive_of_the_plain_standard() {
    let port = free_port();
    let _daemon = Daemon::start(&config(Bus::Socketcand(port), &[("axis1", "cia402-servo", 1)]));

    let log = Master::at(port, "cia402-servo").run("drive402", &[]);

    insta::with_settings!({ prepend_module_to_snapshot => false }, { insta::assert_snapshot!("drive402", log) });
}

#[test]
fn python_canopen_takes_a_drive_through_every_mode() {
    let port = free_port();
    let _daemon = Daemon::start(&config(Bus::Socketcand(port), &[("axis1", "cia402-servo", 1)]));

    let log = Master::at(port, "cia402-servo").run("modes402", &[]);

    insta::with_settings!({ prepend_module_to_snapshot => false }, { insta::assert_snapshot!("modes402", log) });
}

#[test]
fn python_canopen_moves_the_four_axes_of_a_card_by_the_pdos_of_each() {
    for card in ["maccon-mac4-inc", "maccon-mac4-ssi", "maccon-mac4-stp"] {
        let port = free_port();
        let _daemon = Daemon::start(&config(Bus::Socketcand(port), &[("card", card, 1)]));

        let log = Master::at(port, card).run("mac4", &[]);

        insta::with_settings!({ prepend_module_to_snapshot => false }, { insta::assert_snapshot!("mac4", log) });
    }
}

#[test]
fn two_axes_move_at_once() {
    let (_daemon, master) = demo();

    let log = master.run("two_drives", &[]);

    insta::assert_snapshot!(log, @r"
    both moved at once
    node 1: target reached at +40000
    node 2: target reached at -40000
    ");
}

#[test]
fn a_reset_is_answered_by_a_boot_up_message() {
    let (_daemon, master) = demo();

    assert_eq!(master.run("cia301", &["boot-up"]), "0x00, then PRE-OPERATIONAL\n");
}

#[test]
fn nmt_commands_lead_to_their_states() {
    let (_daemon, master) = demo();

    let states = "OPERATIONAL\nSTOPPED\nOPERATIONAL\nPRE-OPERATIONAL\n";
    assert_eq!(master.run("cia301", &["nmt"]), states);
}

#[test]
fn the_heartbeat_keeps_its_period_until_switched_off() {
    let (_daemon, master) = demo();

    assert_eq!(master.run("cia301", &["heartbeat"]), "every 100 ms, then none\n");
}

#[test]
fn a_short_rpdo_earns_an_emergency() {
    let (_daemon, master) = demo();

    assert_eq!(master.run("cia301", &["emergency"]), "0x8210\n");
}

#[test]
fn a_stopped_node_answers_no_sdo() {
    let (_daemon, master) = demo();

    assert_eq!(master.run("cia301", &["stopped"]), "no answer\n0x1000 = 0x00020192\n");
}

#[test]
fn a_tpdo_is_mapped_anew_by_sdo() {
    let (_daemon, master) = demo();

    let log = "mapped anew: 6 bytes, velocity and statusword as by SDO\nafter reset: the default mapping\n";
    assert_eq!(master.run("cia301", &["mapping"]), log);
}

#[test]
fn the_lines_that_the_demo_offers_to_try_work() {
    let mut daemon = Daemon::demo(free_port());
    let printed = daemon.printed_until("print(");
    let code = printed.split_once("\nimport ").expect("the demo offers lines of Python").1;

    assert_eq!(run_python(&format!("import {code}")), "MAC00-FC4\n");
}

#[test]
fn a_megabyte_goes_down_and_up_by_block_transfer() {
    let port = free_port();
    let _daemon = Daemon::start(&config(Bus::Socketcand(port), &[("node1", "canopen-reference", 1)]));

    let log = Master::at(port, "canopen-reference").run("reference", &["block"]);

    assert_eq!(log, "1000000 bytes down and up\n");
}

#[test]
fn a_bus_with_as_many_nodes_as_there_are_ids_boots_and_answers() {
    let port = free_port();
    let names: Vec<String> = (1..=127).map(|id| format!("node{id}")).collect();
    let devices: Vec<_> =
        names.iter().map(String::as_str).zip(1..).map(|(n, id)| (n, "canopen-reference", id)).collect();
    let _daemon = Daemon::start(&config(Bus::Socketcand(port), &devices));

    let log = Master::at(port, "canopen-reference").run("reference", &["many"]);

    assert_eq!(log, "127 boot-up messages\n127 answers\n");
}

#[test]
fn a_taken_port_is_a_clear_error() {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("bind to any port");
    let address = listener.local_addr().expect("a bound socket has an address").to_string();

    let output = axisd(&["run", "--demo", "--socketcand", &address]);

    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && stderr.contains(&address) && stderr.contains("in use"), "{stderr}");
}

#[test]
fn frames_pass_socketcand_as_its_protocol_writes_them() {
    let port = free_port();
    let _daemon = Daemon::demo(port);
    let mut client = Client::raw(port);

    client.send("< send 601 8 40 0 10 0 0 0 0 0 >");

    assert_eq!(client.frame(), "581 4300100092010200");
}

#[test]
fn a_boot_up_message_has_an_id_of_three_digits() {
    let port = free_port();
    let _daemon = Daemon::demo(port);
    let mut client = Client::raw(port);

    client.send("< send 000 2 81 1 >");

    assert_eq!(client.frame(), "701 00");
}

#[test]
fn an_extended_id_passes_between_clients_with_eight_digits() {
    let port = free_port();
    let _daemon = Daemon::demo(port);
    let (mut sender, mut receiver) = (Client::raw(port), Client::raw(port));

    sender.send("< send 00000601 2 AB c >");

    assert_eq!(receiver.frame(), "00000601 AB0C");
}

#[test]
fn an_unknown_bus_is_refused() {
    let port = free_port();
    let _daemon = Daemon::demo(port);
    let mut client = Client::connect(port);
    client.expect("< hi >");

    client.send("< open can7 >");

    assert!(client.receive().starts_with("< error "));
}
