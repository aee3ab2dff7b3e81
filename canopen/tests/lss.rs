//! The LSS slave (CiA 305 v3.0).

mod bench;

use bench::{Bench, device};
use canopen::{Event, LssSetting, NmtState, Order, UNCONFIGURED};
use od::AbortCode;

fn unconfigured() -> Bench {
    Bench::as_node(UNCONFIGURED, device::communication()).started()
}

/// The four messages that select the test device: 0x1018:01 to :04.
fn select(bench: &mut Bench) {
    for (specifier, part) in (0x40..0x43).zip(identity(bench)) {
        assert_eq!(bench.send(&request(specifier, part)), [], "{specifier:02X}");
    }
    let [.., serial] = identity(bench);
    assert_eq!(text(bench.send(&request(0x43, serial))), ["7E4#4400000000000000"]);
}

fn identity(bench: &Bench) -> [u32; 4] {
    let communication = bench.node.communication();
    [1, 2, 3, 4]
        .map(|sub| communication.raw(communication.find(od::Address::new(0x1018, sub)).unwrap()) as u32)
}

fn request(specifier: u8, number: u32) -> String {
    format!("7E5#{specifier:02X}{:08X}000000", number.swap_bytes())
}

fn text(frames: impl IntoIterator<Item = canopen::Frame>) -> Vec<String> {
    frames.into_iter().map(|frame| frame.to_string()).collect()
}

#[test]
fn a_node_in_waiting_state_answers_to_nothing_but_its_own_address() {
    let mut bench = Bench::new();
    bench.talk(
        "> 7E5#1105000000000000
         > 7E5#1300020000000000
         > 7E5#1700000000000000
         > 7E5#5A00000000000000
         > 7E5#5E00000000000000",
    );
}

#[test]
fn a_selected_node_tells_its_address_and_node_id() {
    let mut bench = Bench::new();
    select(&mut bench);
    for (specifier, part) in (0x5A..).zip(identity(&bench)) {
        let answer = format!("7E4#{specifier:02X}{:08X}000000", part.swap_bytes());
        assert_eq!(text(bench.send(&request(specifier, 0))), [answer]);
    }
    bench.talk(
        "> 7E5#5E00000000000000
         < 7E4#5E01000000000000",
    );
}

#[test]
fn only_the_whole_address_in_order_selects() {
    for wrong in 0..4 {
        let mut bench = Bench::new();
        for (part, (specifier, number)) in (0x40..).zip(identity(&bench)).enumerate() {
            let number = number ^ u32::from(part == wrong);
            assert_eq!(bench.send(&request(specifier, number)), [], "part {wrong}");
        }
    }
    let mut bench = Bench::new();
    let [vendor, product, revision, serial] = identity(&bench);
    for (specifier, number) in [(0x40, vendor), (0x42, revision), (0x41, product), (0x43, serial)] {
        assert_eq!(bench.send(&request(specifier, number)), []);
    }
}

// The Node-ID is pending until the communication is reset (CiA 305 v3.0, section 4.2.4.1).
#[test]
fn a_new_node_id_takes_effect_with_the_reset_of_the_communication() {
    let mut bench = Bench::new();
    select(&mut bench);
    bench.events();
    bench.talk(
        "> 7E5#1105000000000000
         < 7E4#1100000000000000
         > 7E5#5E00000000000000
         < 7E4#5E01000000000000
         > 601#4000100000000000
         < 581#4300100092010200
         > 000#8201
         < 705#00
         > 601#4000100000000000
         > 605#4000100000000000
         < 585#4300100092010200
         > 605#4014100000000000
         < 585#4314100085000000
         > 000#0205",
    );
    assert!(bench.events().contains(&Event::NodeId(5)));
    assert_eq!((bench.node.node_id(), bench.node.state()), (5, NmtState::Stopped));
}

#[test]
fn node_ids_and_bit_timings_that_do_not_exist_are_refused() {
    let mut bench = Bench::new();
    select(&mut bench);
    bench.talk(
        "> 7E5#1100000000000000
         < 7E4#1101000000000000
         > 7E5#1180000000000000
         < 7E4#1101000000000000
         > 7E5#11FE000000000000
         < 7E4#1101000000000000
         > 7E5#11FF000000000000
         < 7E4#1100000000000000
         > 7E5#1300050000000000      // reserved
         < 7E4#1301000000000000
         > 7E5#13000A0000000000
         < 7E4#1301000000000000
         > 7E5#1301000000000000      // another table
         < 7E4#1301000000000000
         > 7E5#1300020000000000
         < 7E4#1300000000000000
         > 7E5#1564000000000000      // activate: not answered, and the rate of the interface is not ours
         > 7E5#9900000000000000",
    );
    assert_eq!(bench.node.lss_pending().kbit_per_s(), Some(500));
}

#[test]
fn what_is_to_be_stored_is_answered_when_it_is() {
    let mut bench = Bench::new();
    select(&mut bench);
    bench.send("7E5#1105000000000000");
    bench.events();
    let setting = LssSetting { node_id: 5, bit_timing: None };
    for (outcome, answer) in
        [(Err(AbortCode::Hardware), "7E4#1702000000000000"), (Ok(()), "7E4#1700000000000000")]
    {
        assert_eq!(bench.send("7E5#1700000000000000"), []);
        assert_eq!(bench.events(), [Event::Storage(Order::Lss(setting))]);
        let refused = bench.send("7E5#1700000000000000");
        assert_eq!(text(refused), ["7E4#1702000000000000"], "one order at a time");
        bench.node.stored(bench.now, outcome);
        assert_eq!(text(bench.settle()), [answer]);
    }
    assert_eq!(bench.node.lss_stored(), setting);
}

#[test]
fn a_node_that_was_given_its_node_id_keeps_it_at_power_on_whatever_is_stored() {
    let mut bench = Bench::off();
    bench.node.set_lss(LssSetting { node_id: 5, bit_timing: Some(2) });
    let mut bench = bench.started();
    assert_eq!((bench.node.node_id(), bench.node.lss_stored().node_id), (1, 5));
    bench.talk("> 000#8201\n < 701#00");
}

#[test]
fn a_stored_node_id_is_that_of_a_node_without_one() {
    let mut bench = Bench::as_node(UNCONFIGURED, device::communication());
    bench.node.set_lss(LssSetting { node_id: 5, bit_timing: None });
    bench.node.start(bench.now, &bench.device);
    bench.talk(
        "< 705#00
         > 605#4000100000000000
         < 585#4300100092010200",
    );
}

#[test]
fn a_node_without_a_node_id_hears_lss_and_nothing_else() {
    let mut bench = unconfigured();
    bench.talk(
        "> 000#0100
         > 000#8100
         > 080#
         > 6FF#4000100000000000
         + 10s",
    );
    assert_eq!(bench.node.subscriptions().map(|id| id.to_string()).collect::<Vec<_>>(), ["7E5"]);
    assert_eq!(bench.node.state(), NmtState::Initialising);
}

#[test]
fn a_node_that_gets_its_first_node_id_boots_when_the_master_leaves_it() {
    let mut bench = unconfigured();
    bench.talk(
        "> 7E5#4C00000000000000
         < 7E4#5000000000000000
         > 7E5#0401000000000000
         > 7E5#5E00000000000000
         < 7E4#5EFF000000000000
         > 7E5#1107000000000000
         < 7E4#1100000000000000
         > 7E5#4C00000000000000
         > 7E5#0400000000000000
         < 707#00
         > 000#0107
         < 187#0000
         > 607#4000100000000000
         < 587#4300100092010200",
    );
    assert_eq!(bench.node.state(), NmtState::Operational);
}

#[test]
fn a_node_whose_node_id_is_taken_away_falls_silent() {
    let mut bench = Bench::operational();
    bench.configure("1017:00", 100);
    select(&mut bench);
    bench.talk(
        "> 7E5#11FF000000000000
         < 7E4#1100000000000000
         > 7E5#0400000000000000
         + 100ms
         < 701#05
         > 000#8200
         + 10s
         > 601#4000100000000000
         > 7E5#4C00000000000000
         < 7E4#5000000000000000",
    );
}

#[test]
fn identify_remote_slave_asks_for_ranges_of_revision_and_serial_number() {
    let mut bench = Bench::new();
    let [vendor, product, revision, serial] = identity(&bench);
    let mut ask = |numbers: [u32; 6]| {
        let frames: Vec<_> = (0x46..)
            .zip(numbers)
            .flat_map(|(specifier, number)| bench.send(&request(specifier, number)))
            .collect();
        text(frames)
    };
    let met = ["7E4#4F00000000000000"];
    assert_eq!(ask([vendor, product, revision, revision, serial, serial]), met);
    assert_eq!(ask([vendor, product, 0, u32::MAX, 0, u32::MAX]), met);
    assert_eq!(ask([vendor, product, revision + 1, u32::MAX, 0, u32::MAX]), [""; 0]);
    assert_eq!(ask([vendor, product, 0, revision - 1, 0, u32::MAX]), [""; 0]);
    assert_eq!(ask([vendor, product, 0, u32::MAX, serial + 1, u32::MAX]), [""; 0]);
    assert_eq!(ask([vendor + 1, product, 0, u32::MAX, 0, u32::MAX]), [""; 0]);
}

/// What a master does in a fastscan: one bit after the other, then the next part.
fn fastscan(bench: &mut Bench) -> [u32; 4] {
    let mut scan = |number: u32, bit: u8, part: u8, next: u8| {
        let frame = format!("7E5#51{:08X}{bit:02X}{part:02X}{next:02X}", number.swap_bytes());
        match text(bench.send(&frame)).as_slice() {
            [] => false,
            [one] if one == "7E4#4F00000000000000" => true,
            other => panic!("{frame} is answered by {other:?}"),
        }
    };
    assert!(scan(0, 0x80, 0, 0), "somebody has no Node-ID");
    let mut address = [0; 4];
    for part in 0..4_u8 {
        let number = &mut address[usize::from(part)];
        for bit in (0..32_u8).rev() {
            if !scan(*number, bit, part, part) {
                *number |= 1 << bit;
            }
        }
        assert!(scan(*number, 0, part, (part + 1) % 4), "part {part}");
    }
    address
}

#[test]
fn fastscan_finds_the_address_and_leaves_the_node_in_configuration_state() {
    let mut bench = unconfigured();
    bench.node.set_serial(0xFEDC_BA98);
    assert_eq!(fastscan(&mut bench), identity(&bench));
    bench.talk(
        "> 7E5#5D00000000000000
         < 7E4#5D98BADCFE000000
         > 7E5#5100000000800000",
    );
}

#[test]
fn fastscan_does_not_concern_nodes_with_a_node_id() {
    let mut bench = Bench::new();
    bench.talk("> 7E5#5100000000800000\n > 7E5#4C00000000000000");
}

#[test]
fn fastscan_takes_the_parts_in_its_own_order_only() {
    let mut bench = unconfigured();
    bench.talk(
        "> 7E5#5100000000800000
         < 7E4#4F00000000000000
         > 7E5#51000000001F0101
         > 7E5#5100000000200000
         > 7E5#51000000001F0400",
    );
}

#[test]
fn messages_of_another_length_are_counted() {
    let mut bench = Bench::new();
    bench.talk("> 7E5#0401\n > 7E5#");
    assert_eq!(bench.node.counters().malformed, 2);
}
