//! A device that is nothing but its data sheet: what the sheet says of the bus, it does.

mod common;

use std::sync::Arc;
use std::time::Duration;

use common::Bench;
use od::Address;
use profiles::Profile;

/// An input and output module, node 1 of a network.
fn bench() -> Bench {
    let sheet = include_bytes!("../../profiles/tests/data_sheets/sheets/io_module.eds");
    let (profile, findings) = Profile::from_data_sheet("io-module.eds", sheet);
    assert!(findings.0.is_empty(), "{findings}");
    Bench::of(&Arc::new(profile.unwrap()), &[&[(0, 1)]])
}

#[test]
fn its_heartbeat_comes_as_the_sheet_says() {
    let mut bench = bench();
    assert_eq!(bench.run(Duration::from_millis(500)), ["701#7F", "701#7F"]);
    bench.write(1, 0x1017, 0, &100_u16.to_le_bytes());
    assert_eq!(bench.run(Duration::from_millis(300)).len(), 3);
}

#[test]
fn its_objects_are_read_and_written_within_access_and_limits() {
    let mut bench = bench();
    // -5 at 0x2003:00, and the Node-ID plus 0x10 at 0x2006:00.
    assert_eq!(bench.send("601#4003200000000000"), ["581#4B032000FBFF0000"]);
    assert_eq!(bench.send("601#4006200000000000"), ["581#4F06200011000000"]);
    bench.write(1, 0x2003, 0, &100_i16.to_le_bytes());
    // 101 is too high, a constant is not written, what is write-only is not read.
    assert_eq!(bench.send("601#2B03200065000000"), ["581#8003200031000906"]);
    assert_eq!(bench.send("601#2F06200001000000"), ["581#8006200002000106"]);
    assert_eq!(bench.send("601#4004200000000000"), ["581#8004200001000106"]);
    assert_eq!(bench.send("601#4007200000000000"), ["581#8007200000000206"]);
}

#[test]
fn its_tpdos_go_as_the_sheet_says() {
    let mut bench = bench();
    assert_eq!(bench.send("000#0101"), ["181#A53412"]);
    let sent = bench.send("601#2F0060015A000000");
    assert_eq!(sent, ["581#6000600100000000", "181#5A3412"]);
    // TPDO 2 goes with every SYNC once it is valid.
    bench.write(1, 0x1801, 1, &0x281_u32.to_le_bytes());
    assert_eq!(bench.send("080#"), ["281#9CFF"]);
}

#[test]
fn its_rpdo_sets_its_outputs() {
    let mut bench = bench();
    bench.send("000#0101");
    bench.send("201#81");
    assert_eq!(bench.send("601#4000620100000000"), ["581#4F00620181000000"]);
}

#[test]
fn a_master_maps_what_the_sheet_says_can_be_mapped() {
    let mut bench = bench();
    bench.map(1, 0x1801, 0x281, 0x2003_0010);
    bench.send("000#0101");
    bench.write(1, 0x2003, 0, &[7, 0]);
    // The string at 0x2001:00 cannot be.
    bench.write(1, 0x1801, 1, &0x8000_0281_u32.to_le_bytes());
    bench.write(1, 0x1A01, 0, &[0]);
    assert_eq!(bench.send("601#23011A0108000120"), ["581#80011A0141000406"]);
}

#[test]
fn its_parameters_are_stored_and_restored() {
    let mut bench = bench();
    bench.write(1, 0x2003, 0, &[9, 0]);
    bench.send("601#2310100173617665");
    let (device, parameters) = bench.core.poll_store().unwrap();
    assert_eq!(parameters.application.get(Address::new(0x2003, 0)), Some(&[9, 0][..]));
    bench.core.stored(bench.now, device, Ok(()));
    bench.write(1, 0x2003, 0, &[8, 0]);
    bench.send("000#8101");
    assert_eq!(bench.send("601#4003200000000000"), ["581#4B03200009000000"]);
    bench.send("601#231110016C6F6164");
    let (device, _) = bench.core.poll_store().unwrap();
    bench.core.stored(bench.now, device, Ok(()));
    bench.send("000#8101");
    assert_eq!(bench.send("601#4003200000000000"), ["581#4B032000FBFF0000"]);
}
