//! A device with as many PDOs as CiA 301 allows: 512 each way.

mod common;

use std::sync::Arc;

use common::Bench;
use profiles::Profile;

const PDOS: u32 = 512;

/// A profile with one process value each way for each of its PDOs, all of them synchronous.
fn profile() -> Arc<Profile> {
    const VALUES_IN_ARRAY: u32 = 128;
    let mut text =
        String::from("name = \"a\"\ndescription = \"b\"\nvendor = \"c\"\nproduct = \"d\"\nobject = [\n");
    text += "{ index = 0x1005, name = \"COB-ID SYNC\", type = \"U32\", default = 0x80 },\n";
    for array in 0..PDOS / VALUES_IN_ARRAY {
        let index = 0x2000 + array;
        text += &format!(
            "{{ index = {index}, name = \"v\", array = {VALUES_IN_ARRAY}, type = \"U32\", pdo = \"both\" }},\n"
        );
    }
    text += "]\n";
    for (kind, first_cob_id) in [("rpdo", 0x2000_1000_u32), ("tpdo", 0x2000_2000)] {
        text += &format!("{kind} = [\n");
        for number in 0..PDOS {
            let (index, sub) = (0x2000 + number / VALUES_IN_ARRAY, number % VALUES_IN_ARRAY + 1);
            let cob_id = first_cob_id + number;
            text += &format!(
                "{{ number = {}, cob_id = {cob_id}, map = [\"0x{index:X}:{sub:02X}\"], transmission = 1 }},\n",
                number + 1
            );
        }
        text += "]\n";
    }
    Arc::new(Profile::parse("many.toml", &text, None).unwrap_or_else(|wrong| panic!("{wrong}")))
}

fn operational() -> Bench {
    let mut bench = Bench::of(&profile(), &[&[(0, 1)]]);
    assert_eq!(bench.send("000#0100"), [""; 0]);
    bench
}

#[test]
fn all_tpdos_go_with_a_sync_and_carry_what_the_rpdos_brought() {
    let mut bench = operational();
    for number in 0..PDOS {
        assert_eq!(bench.send(&format!("{:08X}#{number:08X}", 0x1000 + number)), [""; 0]);
    }
    let expected = (0..PDOS).map(|number| format!("{:08X}#{number:08X}", 0x2000 + number));
    assert_eq!(bench.send("080#"), expected.collect::<Vec<_>>());
    assert_eq!(bench.core.nodes().next().unwrap().counters(), canopen::Counters::default());
}
