//! What a master can set up on the reference device and not on the drives.

mod common;

use std::sync::Arc;
use std::time::Duration;

use common::{Bench, LINK};
use od::Address;
use profiles::Profile;

const SAVE_ALL: &str = "601#2310100173617665";

fn profile() -> Arc<Profile> {
    Arc::new(Profile::embedded("canopen-reference", None).unwrap().unwrap())
}

#[test]
fn its_second_sdo_server_is_off_until_it_has_identifiers() {
    let mut bench = Bench::of(&profile(), &[&[(0, 1)]]);
    assert_eq!(bench.send("6D0#4000100000000000"), [""; 0]);
    bench.write(1, 0x1201, 1, &0x6D0_u32.to_le_bytes());
    bench.write(1, 0x1201, 2, &0x6D1_u32.to_le_bytes());
    assert_eq!(bench.send("6D0#4000100000000000"), ["6D1#4300100000000000"]);
    assert_eq!(bench.send("601#4000100000000000"), ["581#4300100000000000"]);
}

#[test]
fn it_starts_by_itself_once_that_is_stored() {
    let mut bench = Bench::of(&profile(), &[&[(0, 1)]]);
    bench.write(1, 0x1017, 0, &100_u16.to_le_bytes());
    bench.write(1, 0x1F80, 0, &8_u32.to_le_bytes());
    bench.send(SAVE_ALL);
    let (device, parameters) = bench.core.poll_store().unwrap();
    bench.core.stored(bench.now, device, Ok(()));
    bench.sent_on(LINK);
    assert_eq!(parameters.nodes[0].communication.get(Address::new(0x1F80, 0)), Some(&[8, 0, 0, 0][..]));

    // Boot-up, the event-driven TPDOs of OPERATIONAL and a heartbeat that says so.
    let mut sent = bench.send("000#8101");
    sent.extend(bench.run(Duration::from_millis(100)));

    assert_eq!(sent.first().map(String::as_str), Some("701#00"));
    assert_eq!(sent.last().map(String::as_str), Some("701#05"));
}

#[test]
fn it_sends_and_takes_multiplexed_pdos_by_its_lists() {
    let mut bench = Bench::of(&profile(), &[&[(0, 1)], &[(0, 2)]]);
    // TPDO 5 of node 1 sends 0x2110:01-02, RPDO 5 of node 2 takes them to 0x2110:03-04.
    bench.write(1, 0x1FA0, 1, &0x0221_1001_u32.to_le_bytes());
    bench.write(1, 0x1A04, 0, &[0xFE]);
    bench.write(1, 0x1804, 1, &0x1E0_u32.to_le_bytes());
    for message in ["602#21D01F0108000000", "602#0001011021031021", "602#1D02000000000000"] {
        bench.send(message);
    }
    bench.write(2, 0x1604, 0, &[0xFE]);
    bench.write(2, 0x1404, 1, &0x1E0_u32.to_le_bytes());
    bench.send("000#0100");

    let sent = bench.send("601#2310210277000000");

    assert!(sent.contains(&"1E0#0110210277000000".into()), "{sent:?}");
    let read = bench.send("602#4010210400000000");
    assert!(read.contains(&"582#4310210477000000".into()), "{read:?}");
}
