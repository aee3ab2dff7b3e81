//! Segmented SDO transfer: seven bytes a message (CiA 301 v4.2, section 7.2.4.3).

mod bench;

use core::time::Duration;

use bench::Bench;
use bench::device::{DOMAIN_LENGTH, LARGE_DOMAIN_LENGTH};
use od::{AbortCode, Address};

// CCT 2.16, 2.18
#[test]
fn a_string_is_read_in_segments_with_alternating_toggle_bit() {
    Bench::new().talk(
        "
        > 601#4008100000000000
        < 581#410810000C000000
        > 601#6000000000000000
        < 581#0042656E63682064 // Bench d
        > 601#7000000000000000
        < 581#1565766963650000 // evice
        ",
    );
}

#[test]
fn a_last_segment_may_be_full() {
    let mut bench = Bench::new();
    let slot = bench.device.find(Address::new(0x200A, 0)).unwrap();
    bench.device.set_bytes(slot, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14]);
    bench.talk(
        "
        > 601#400A200000000000
        < 581#410A20000E000000
        > 601#6000000000000000
        < 581#0001020304050607
        > 601#7000000000000000
        < 581#1108090A0B0C0D0E
        ",
    );
}

#[test]
fn an_empty_string_is_one_segment_without_data() {
    Bench::new().talk(
        "
        > 601#4009200000000000
        < 581#4109200000000000
        > 601#6000000000000000
        < 581#0F00000000000000
        > 601#6000000000000000 // that was all
        < 581#8000000001000405
        ",
    );
}

#[test]
fn every_type_of_more_than_four_bytes_is_written_and_read_back() {
    Bench::new().talk(
        "
        > 601#211B200008000000 // UNSIGNED64, size indicated
        < 581#601B200000000000
        > 601#0001020304050607
        < 581#2000000000000000
        > 601#1D08000000000000
        < 581#3000000000000000
        > 601#401B200000000000
        < 581#411B200008000000
        > 601#6000000000000000
        < 581#0001020304050607
        > 601#7000000000000000
        < 581#1D08000000000000
        > 601#200C200000000000 // TIME_OF_DAY, 48 bits, size not indicated
        < 581#600C200000000000
        > 601#0301020304050600
        < 581#2000000000000000
        > 601#400C200000000000
        < 581#410C200006000000
        > 601#6000000000000000
        < 581#0301020304050600
        > 601#2118200005000000 // UNSIGNED40
        < 581#6018200000000000
        > 601#0501020304050000
        < 581#2000000000000000
        > 601#4018200000000000
        < 581#4118200005000000
        > 601#6000000000000000
        < 581#0501020304050000
        ",
    );
}

// CCT 2.15
#[test]
fn the_heartbeat_time_is_written_segmented() {
    Bench::new().talk(
        "
        > 601#2117100002000000
        < 581#6017100000000000
        > 601#0BE8030000000000
        < 581#2000000000000000
        + 1s
        < 701#7F
        ",
    );
}

// CCT 2.13
#[test]
fn an_object_of_four_bytes_is_read_expedited_whatever_the_client_intends() {
    // Upload of 0x1000 by a client that is ready for segments: the server alone decides.
    Bench::new().talk(
        "
        > 601#4000100000000000
        < 581#4300100092010200
        ",
    );
}

#[test]
fn an_empty_string_is_written_by_an_empty_last_segment() {
    Bench::new().talk(
        "
        > 601#230A200001020304
        < 581#600A200000000000
        > 601#210A200000000000
        < 581#600A200000000000
        > 601#0F00000000000000
        < 581#2000000000000000
        > 601#400A200000000000
        < 581#410A200000000000
        > 601#6000000000000000
        < 581#0F00000000000000
        ",
    );
}

#[test]
fn segments_may_be_short_and_the_value_changes_with_the_last_one() {
    let mut bench = Bench::new();
    bench.talk(
        "
        > 601#2106200002000000
        < 581#6006200000000000
        > 601#0C34000000000000 // one byte, more follow
        < 581#2000000000000000
        > 601#1E00000000000000 // none
        < 581#3000000000000000
        ",
    );
    assert_eq!(bench.value("2006:00"), 0);
    bench.talk(
        "
        > 601#0D12000000000000
        < 581#2000000000000000
        ",
    );
    assert_eq!(bench.value("2006:00"), 0x1234);
}

#[test]
fn an_upload_shows_the_value_of_its_beginning() {
    let mut bench = Bench::new();
    let slot = bench.device.find(Address::new(0x200A, 0)).unwrap();
    bench.device.set_bytes(slot, &[1, 2, 3, 4, 5, 6, 7, 8]);
    bench.talk(
        "
        > 601#400A200000000000
        < 581#410A200008000000
        > 601#6000000000000000
        < 581#0001020304050607
        ",
    );
    bench.device.set_bytes(slot, &[9; 16]);
    bench.talk(
        "
        > 601#7000000000000000
        < 581#1D08000000000000
        ",
    );
}

#[test]
fn a_new_request_takes_the_place_of_the_old_transfer() {
    let mut bench = Bench::new();
    bench.talk(
        "
        > 601#210A200008000000
        < 581#600A200000000000
        > 601#0001020304050607
        < 581#2000000000000000
        > 601#4008100000000000
        < 581#410810000C000000
        > 601#6000000000000000
        < 581#0042656E63682064
        > 601#400A200000000000 // nothing of the download came through
        < 581#410A200000000000
        ",
    );
}

#[test]
fn an_expedited_request_ends_the_transfer_too() {
    Bench::new().talk(
        "
        > 601#4008100000000000
        < 581#410810000C000000
        > 601#2F05200011000000
        < 581#6005200000000000
        > 601#6000000000000000
        < 581#8000000001000405
        > 601#4008100000000000
        < 581#410810000C000000
        > 601#4005200000000000
        < 581#4F05200011000000
        > 601#6000000000000000
        < 581#8000000001000405
        + 5s
        ",
    );
}

#[test]
fn the_client_may_abort() {
    Bench::new().talk(
        "
        > 601#4008100000000000
        < 581#410810000C000000
        > 601#8008100000000008
        > 601#6000000000000000
        < 581#8000000001000405
        + 5s
        ",
    );
}

#[test]
fn stopping_the_node_or_resetting_it_ends_the_transfer() {
    for command in ["000#0201", "000#8101", "000#8201"] {
        let mut bench = Bench::new();
        bench.send("601#4008100000000000");
        bench.send(command);
        assert_eq!(bench.pass(Duration::from_secs(5)), []);
        bench.send("000#8001");
        bench.talk(
            "
            > 601#6000000000000000
            < 581#8000000001000405
            ",
        );
    }
}

#[test]
fn a_hundred_thousand_bytes_go_down_and_up() {
    let mut bench = Bench::new();
    let domain = Address::new(0x200F, 0);
    let data: Vec<u8> = (0..DOMAIN_LENGTH).map(|i| (i % 251) as u8).collect();
    assert_eq!(bench.download(domain, &data), Ok(()));
    assert_eq!(bench.upload(domain), Ok(data));
    assert_eq!(bench.download(domain, &[0; DOMAIN_LENGTH + 1]), Err(AbortCode::TooLong));
    assert_eq!(bench.node.poll_timeout(), None, "the transfers are over");
}

#[test]
fn four_megabytes_go_down_and_up() {
    let data: Vec<u8> = (0..LARGE_DOMAIN_LENGTH).map(|i| (i * 7 + i / 256) as u8).collect();
    let mut bench = Bench::new();
    let address = Address::new(0x210A, 0);
    assert_eq!(bench.download(address, &data), Ok(()));
    assert!(bench.upload(address).as_ref() == Ok(&data));
}
