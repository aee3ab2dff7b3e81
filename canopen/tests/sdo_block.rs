//! Block transfer (CiA 301 v4.2, sections 7.2.4.3.8-15). CCT 2.19-2.27.

mod bench;

use core::time::Duration;

use bench::Bench;
use bench::device::{DOMAIN_LENGTH, LARGE_DOMAIN_LENGTH};
use canopen::{Frame, Id};

const REQUEST: Id = Id::Standard(0x601);
const DOMAIN: u16 = 0x200F;
const LARGE_DOMAIN: u16 = 0x210A;

/// The CRC of CiA 301 v4.2, section 7.2.4.3.16, bit by bit as printed there.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc, byte| {
        (0..8).fold(
            crc ^ u16::from(*byte) << 8,
            |crc, _| {
                if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x1021 }
            },
        )
    })
}

fn pattern(len: usize) -> Vec<u8> {
    (0..len).map(|i| (i * 7 + i / 256) as u8).collect()
}

/// A client that writes a DOMAIN and loses the segments that `is_lost` picks by their number on the wire.
fn download(bench: &mut Bench, index: u16, data: &[u8], mut is_lost: impl FnMut(usize) -> bool) {
    let [a, b, c, d] = (data.len() as u32).to_le_bytes();
    let [low, high] = index.to_le_bytes();
    let answer = bench.handle(&Frame::new(REQUEST, &[0xC6, low, high, 0, a, b, c, d]));
    let [0xA4, _, _, _, mut size, ..] = answer[0].eight().unwrap() else { panic!("{answer:?}") };
    let segments: Vec<&[u8]> = data.chunks(7).collect();
    let (mut position, mut on_wire) = (0, 0);
    while position < segments.len() {
        let block = &segments[position..segments.len().min(position + usize::from(size))];
        let mut answer = Vec::new();
        for (sequence, segment) in (1_u8..).zip(block) {
            let is_last = position + usize::from(sequence) == segments.len();
            let mut message = [u8::from(is_last) << 7 | sequence, 0, 0, 0, 0, 0, 0, 0];
            message[1..=segment.len()].copy_from_slice(segment);
            on_wire += 1;
            if !is_lost(on_wire) {
                answer.extend(bench.handle(&Frame::new(REQUEST, &message)));
            }
        }
        if answer.is_empty() {
            answer = bench.pass(Duration::from_millis(500));
        }
        let [answer] = answer[..] else { panic!("a block has one answer: {answer:?}") };
        let [0xA2, sequence, next, ..] = answer.eight().unwrap() else { panic!("{answer}") };
        position += usize::from(sequence);
        size = next;
    }
    let unused = (7 - (data.len() - 1) % 7 - 1) as u8;
    let [low, high] = crc(data).to_le_bytes();
    let end = bench.handle(&Frame::new(REQUEST, &[0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0]));
    assert_eq!(end, [bench::frame_of("581#A100000000000000")]);
}

/// A client that reads the DOMAIN and acknowledges fewer segments than it got where `lost` says so.
fn upload(bench: &mut Bench, index: u16, block_size: u8, mut lost: impl FnMut(usize) -> u8) -> Vec<u8> {
    let [low, high] = index.to_le_bytes();
    let answer = bench.handle(&Frame::new(REQUEST, &[0xA4, low, high, 0, block_size, 0, 0, 0]));
    let [0xC6, _, _, _, size @ ..] = answer[0].eight().unwrap() else { panic!("{answer:?}") };
    let size = u32::from_le_bytes(size) as usize;
    let mut data = Vec::new();
    let mut block = bench.handle(&Frame::new(REQUEST, &[0xA3, 0, 0, 0, 0, 0, 0, 0]));
    for number in 0.. {
        assert!(block.len() <= usize::from(block_size));
        let good = block.len() - usize::from(lost(number)).min(block.len() - 1);
        for (sequence, segment) in (1_u8..).zip(&block[..good]) {
            let [head, bytes @ ..] = segment.eight().unwrap();
            assert_eq!(head & 0x7F, sequence);
            data.extend_from_slice(&bytes);
        }
        block = bench.handle(&Frame::new(REQUEST, &[0xA2, good as u8, block_size, 0, 0, 0, 0, 0]));
        if let [end] = block[..]
            && data.len() >= size
        {
            let [head, low, high, ..] = end.eight().unwrap();
            data.truncate(data.len() - usize::from(head >> 2 & 7));
            assert_eq!(head & 0xE3, 0xC1);
            assert_eq!(u16::from_le_bytes([low, high]), crc(&data));
            break;
        }
    }
    assert_eq!(bench.handle(&Frame::new(REQUEST, &[0xA1, 0, 0, 0, 0, 0, 0, 0])), []);
    assert_eq!(bench.node.poll_timeout(), None, "the transfer is over");
    data
}

#[test]
fn a_string_is_read_in_one_block() {
    // CCT 2.22, 2.23
    Bench::new().talk(
        "
        > 601#A40810007F000000
        < 581#C60810000C000000
        > 601#A300000000000000
        < 581#0142656E63682064 // 'Bench d'
        < 581#8265766963650000 // 'evice'
        > 601#A2027F0000000000
        < 581#C943870000000000 // two bytes too many, CRC 8743
        > 601#A100000000000000
        ",
    );
}

#[test]
fn an_object_of_four_bytes_is_read_in_one_block() {
    // CCT 2.19: without a CRC there is zero in its place
    Bench::new().talk(
        "
        > 601#A00010007F000000
        < 581#C600100004000000
        > 601#A300000000000000
        < 581#8192010200000000
        > 601#A2017F0000000000
        < 581#CD00000000000000
        > 601#A100000000000000
        ",
    );
}

#[test]
fn the_heartbeat_time_is_written_in_a_block_with_and_without_a_size_and_a_crc() {
    // CCT 2.21, 2.25
    Bench::new().talk(
        "
        > 601#C017100000000000
        < 581#A41710007F000000
        > 601#81E8030000000000
        < 581#A2017F0000000000
        > 601#D500000000000000 // five bytes too many, no CRC
        < 581#A100000000000000
        + 1s
        < 701#7F
        > 601#C617100002000000
        < 581#A41710007F000000
        > 601#8100000000000000
        < 581#A2017F0000000000
        > 601#D500000000000000
        < 581#A100000000000000
        + 2s
        ",
    );
}

#[test]
fn a_wrong_block_size_is_refused_05040002() {
    // CCT 2.26
    Bench::new().talk(
        "
        > 601#A408100080000000
        < 581#8008100002000405
        > 601#A408100000000000
        < 581#8008100002000405
        > 601#A40810007F000000
        < 581#C60810000C000000
        > 601#A300000000000000
        < 581#0142656E63682064
        < 581#8265766963650000
        > 601#A202800000000000
        < 581#8008100002000405
        ",
    );
}

#[test]
fn a_wrong_sequence_number_is_refused_05040003() {
    // CCT 2.27
    Bench::new().talk(
        "
        > 601#A40810007F000000
        < 581#C60810000C000000
        > 601#A300000000000000
        < 581#0142656E63682064
        < 581#8265766963650000
        > 601#A2037F0000000000
        < 581#8008100003000405
        > 601#C617100002000000
        < 581#A41710007F000000
        > 601#0000000000000000
        < 581#8017100003000405
        ",
    );
}

#[test]
fn a_wrong_crc_is_refused_05040004_and_changes_nothing() {
    let mut bench = Bench::new();
    bench.talk(
        "
        > 601#C217100002000000
        < 581#A41710007F000000
        > 601#81E8030000000000
        < 581#A2017F0000000000
        > 601#D5FFFF0000000000 // the client made none: not looked at
        < 581#A100000000000000
        > 601#C417100000000000
        < 581#A41710007F000000
        > 601#81E9030000000000
        < 581#A2017F0000000000
        > 601#D5FFFF0000000000
        < 581#8017100004000405
        > 601#4017100000000000
        < 581#4B171000E8030000
        ",
    );
}

#[test]
fn what_the_gate_refuses_is_refused_in_a_block_too() {
    Bench::new().talk(
        "
        > 601#C600100004000000
        < 581#8000100002000106 // read only
        > 601#C617100003000000
        < 581#8017100012000706 // too long
        > 601#C617100001000000
        < 581#8017100013000706 // too short
        > 601#C4FF5F0000000000
        < 581#80FF5F0000000206 // no object
        > 601#C017100000000000
        < 581#A41710007F000000
        > 601#0101000000000000
        > 601#8202000000000000
        < 581#8017100012000706 // eight bytes for two
        > 601#C017100000000000
        < 581#A41710007F000000
        > 601#8101020304000000
        < 581#A2017F0000000000
        > 601#CD00000000000000 // four bytes for two
        < 581#8017100012000706
        ",
    );
}

#[test]
fn a_short_upload_may_come_the_ordinary_way() {
    Bench::new().talk(
        "
        > 601#A40010007F040000
        < 581#4300100092010200
        > 601#A40810007F0C0000
        < 581#410810000C000000
        > 601#6000000000000000
        < 581#0042656E63682064
        > 601#7000000000000000
        < 581#1565766963650000
        > 601#A40810007F0B0000 // more than the threshold
        < 581#C60810000C000000
        > 601#8008100000000008
        ",
    );
}

#[test]
fn silence_ends_a_block_transfer_05040000() {
    Bench::new().talk(
        "
        > 601#A40810007F000000
        < 581#C60810000C000000
        + 1s
        < 581#8008100000000405
        > 601#C617100002000000
        < 581#A41710007F000000
        + 1s
        < 581#8017100000000405
        ",
    );
}

#[test]
fn messages_out_of_turn_are_refused_05040001() {
    Bench::new().talk(
        "
        > 601#A300000000000000
        < 581#8000000001000405
        > 601#A2017F0000000000
        < 581#8000000001000405
        > 601#A100000000000000
        < 581#8000000001000405
        > 601#C100000000000000
        < 581#8000000001000405
        > 601#A40810007F000000
        < 581#C60810000C000000
        > 601#A2007F0000000000 // not started
        < 581#8008100001000405
        ",
    );
}

#[test]
fn either_side_may_abort_between_segments() {
    let mut bench = Bench::new();
    bench.talk(
        "
        > 601#C60810000C000000
        < 581#8008100002000106
        > 601#C617100002000000
        < 581#A41710007F000000
        > 601#8017100000000008
        > 601#4017100000000000
        < 581#4B17100000000000
        ",
    );
    assert_eq!(bench.node.poll_timeout(), None);
}

#[test]
fn a_whole_domain_goes_down_and_up() {
    let data = pattern(DOMAIN_LENGTH);
    let mut bench = Bench::new();
    download(&mut bench, DOMAIN, &data, |_| false);
    for block_size in [127, 1, 33] {
        assert!(upload(&mut bench, DOMAIN, block_size, |_| 0) == data, "in blocks of {block_size}");
    }
}

#[test]
fn lost_segments_are_sent_again() {
    let data = pattern(5_000);
    let mut bench = Bench::new();
    download(&mut bench, DOMAIN, &data, |on_wire| on_wire % 50 == 3);
    assert!(upload(&mut bench, DOMAIN, 127, |_| 0) == data);
    assert!(upload(&mut bench, DOMAIN, 100, |block| (block % 4 * 30) as u8) == data);
}

#[test]
fn every_length_keeps_its_bytes() {
    let mut bench = Bench::new();
    for len in 1..=40 {
        let data = pattern(len);
        download(&mut bench, DOMAIN, &data, |_| false);
        assert_eq!(upload(&mut bench, DOMAIN, 5, |_| 0), data, "{len} bytes");
    }
}

#[test]
fn a_block_whose_last_segment_is_lost_is_acknowledged_after_half_the_time_out() {
    Bench::new().talk(
        "
        > 601#C60A20000C000000
        < 581#A40A20007F000000
        > 601#0101020304050607
        + 499999us
        + 1us
        < 581#A2017F0000000000
        > 601#8108090A0B0C0000 // the lost one again, in a block of its own
        < 581#A2017F0000000000
        > 601#C900000000000000
        < 581#800A200004000405 // the CRC that the client got wrong
        > 601#C20A20000C000000
        < 581#A40A20007F000000
        > 601#0101020304050607
        + 500ms
        < 581#A2017F0000000000
        > 601#8108090A0B0C0000
        < 581#A2017F0000000000
        > 601#C900000000000000
        < 581#A100000000000000
        > 601#400A200000000000
        < 581#410A20000C000000
        > 601#6000000000000000
        < 581#0001020304050607
        > 601#7000000000000000
        < 581#1508090A0B0C0000
        ",
    );
}

#[test]
fn a_client_that_stays_silent_is_reminded_once_and_then_given_up() {
    let mut bench = Bench::new();
    bench.talk(
        "
        > 601#C60A20000C000000
        < 581#A40A20007F000000
        > 601#0101020304050607
        + 1s
        < 581#A2017F0000000000
        < 581#800A200000000405
        + 1s
        ",
    );
    assert_eq!(bench.node.poll_timeout(), None);
}

#[test]
fn a_client_that_pauses_between_two_blocks_is_not_disturbed() {
    let segments = |range: core::ops::RangeInclusive<u8>| {
        range.map(|sequence| format!("> 601#{sequence:02X}01020304050607\n")).collect::<String>()
    };
    Bench::new().talk(&format!(
        "
        > 601#C40F200000000000
        < 581#A40F20007F000000
        + 999ms
        {}
        < 581#A27F7F0000000000
        + 999ms
        > 601#8100000000000000
        < 581#A2017F0000000000
        ",
        segments(1..=127)
    ));
}

#[test]
fn segments_get_lost_anywhere() {
    let data = pattern(20_000);
    let mut bench = Bench::new();
    download(&mut bench, DOMAIN, &data, |on_wire| on_wire % 20 == 0);
    assert!(upload(&mut bench, DOMAIN, 127, |_| 0) == data);
}

#[test]
fn four_megabytes_go_down_and_up() {
    let data = pattern(LARGE_DOMAIN_LENGTH);
    let mut bench = Bench::new();
    download(&mut bench, LARGE_DOMAIN, &data, |_| false);
    assert!(upload(&mut bench, LARGE_DOMAIN, 127, |_| 0) == data);
}
