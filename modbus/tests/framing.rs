//! How requests are told apart on TCP and on a serial line.

mod bench;

use core::time::Duration;

use bench::{Bench, bytes, hex};
use modbus::{Dialect, Framing, Permissions, WordOrder, crc16, rtu_adu};

const READ: &str = "00 01 00 00 00 06 01 03 80 06 00 02";
const ANSWER: &str = "00 01 00 00 00 07 01 03 04 64 01 C0 A8";
/// 3.5 characters above 19200 bit/s (Modbus over Serial Line V1.02, section 2.5.1.1).
const SILENCE: Duration = Duration::from_micros(1750);

fn tcp() -> Bench {
    Bench::new(Dialect::Full)
}

fn serial(framing: Framing) -> Bench {
    Bench::with(Dialect::Full, WordOrder::LowFirst, framing, Permissions::default(), None)
}

#[test]
fn a_request_may_come_byte_by_byte() {
    let mut bench = tcp();
    let request = bytes(READ);
    for byte in &request[..request.len() - 1] {
        assert_eq!(bench.send(&[*byte]), []);
    }
    assert_eq!(hex(&bench.send(&request[request.len() - 1..])), ANSWER);
}

#[test]
fn requests_in_one_segment_are_answered_in_order() {
    let mut bench = tcp();
    let requests = "00 01 00 00 00 06 01 03 80 06 00 02 \
                    00 09 00 00 00 06 07 03 80 06 00 02 \
                    00 02 00 00 00 06 01 03 80 80 00 02 \
                    00 03 00 00 00 06 01 03 80 06 00 01 00";
    let answers = "00 01 00 00 00 07 01 03 04 64 01 C0 A8 \
                   00 09 00 00 00 03 07 83 0B \
                   00 02 00 00 00 03 01 83 02 \
                   00 03 00 00 00 05 01 03 02 64 01";
    assert_eq!(bench.exchange(requests), answers);
    // The last byte was the first of another request.
    assert_eq!(bench.exchange(&READ[3..]), ANSWER);
}

#[test]
fn a_frame_of_another_protocol_is_skipped_as_a_whole() {
    let mut bench = tcp();
    // What it carries looks like a request that would write.
    let foreign = "00 01 00 01 00 0F 00 02 00 00 00 0B 01 10 00 06 00 02 04 56 78";
    assert_eq!(bench.exchange(foreign), "");
    assert_eq!(bench.exchange(READ), ANSWER);
    assert_eq!(bench.raw(0x2012, 3), 0);
    assert_eq!(bench.server.counters().malformed, 1);
}

#[test]
fn a_frame_too_short_for_a_function_code_is_skipped() {
    let mut bench = tcp();
    assert_eq!(bench.exchange(&format!("00 01 00 00 00 00 {READ}")), ANSWER);
    assert_eq!(bench.exchange(&format!("00 01 00 00 00 01 01 {READ}")), ANSWER);
    assert_eq!(bench.server.counters().malformed, 2);
}

#[test]
fn a_length_that_no_frame_has_ends_the_connection() {
    for length in ["00 FF", "01 00", "FF FF"] {
        let mut bench = tcp();
        assert_eq!(bench.exchange(&format!("{READ} 00 02 00 00 {length} 01 03 {READ}")), ANSWER);
        assert!(bench.server.is_closing());
        assert_eq!(bench.server.poll_request(), None);
        assert_eq!(bench.exchange(READ), "");
    }
}

#[test]
fn the_longest_frame_is_answered() {
    let mut bench = tcp();
    let data = "A5 ".repeat(250);
    let pdu = format!("08 00 00 {data}");
    assert_eq!(bench.ask(&pdu), pdu.trim());
}

#[test]
fn requests_wait_until_the_answers_before_them_have_left() {
    let mut bench = tcp();
    let request = bytes("00 01 00 00 00 06 01 03 10 00 00 32");
    let (mut given, mut answered) = (0, 0);
    for _ in 0..10_000 {
        given += bench.server.handle_bytes(bench.now, &request[given % request.len()..]);
        answered += usize::from(bench.serve_one());
    }
    assert!(bench.server.output().len() <= 8 * 260);
    assert!(given < 6000, "{given} bytes wait");
    // Once the answers leave, all come out.
    for _ in 0..10_000 {
        bench.take_output();
        answered += usize::from(bench.serve_one());
    }
    assert_eq!(answered, given / request.len());
}

#[test]
fn the_checksum_is_that_of_the_standard() {
    // Modbus over Serial Line V1.02, appendix B: 02 07 has the checksum 1241h, sent as 41 12.
    assert_eq!(crc16(&[0x02, 0x07]), 0x1241);
    assert_eq!(hex(&rtu_adu(2, &[7])), "02 07 41 12");
}

#[test]
fn a_frame_on_a_serial_line_ends_with_silence() {
    let mut bench = serial(Framing::Rtu { silence: SILENCE });
    let frame = rtu_adu(1, &bytes("03 80 06 00 02"));
    for byte in &frame {
        assert_eq!(bench.send(&[*byte]), []);
        bench.now = bench.now + SILENCE / 4;
    }
    assert!(bench.server.poll_timeout().unwrap() > bench.now);
    assert!(!bench.serve_one());
    bench.now = bench.server.poll_timeout().unwrap();
    bench.server.handle_timeout(bench.now);
    assert!(bench.serve_one());
    assert_eq!(bench.take_output(), rtu_adu(1, &bytes("03 04 64 01 C0 A8")));
    assert_eq!(bench.server.poll_timeout(), None);
}

#[test]
fn a_frame_that_comes_after_the_silence_is_another_one() {
    let mut bench = serial(Framing::Rtu { silence: SILENCE });
    let frame = rtu_adu(1, &bytes("03 80 06 00 02"));
    // Half a frame, silence, a whole one, silence.
    bench.send(&frame[..4]);
    bench.now = bench.now + SILENCE;
    bench.send(&frame);
    bench.now = bench.now + SILENCE;
    bench.server.handle_timeout(bench.now);
    assert!(bench.serve_one());
    assert_eq!(bench.take_output(), rtu_adu(1, &bytes("03 04 64 01 C0 A8")));
    assert_eq!(bench.server.counters().malformed, 1);
}

#[test]
fn on_a_serial_line_others_and_everybody_are_not_answered() {
    let mut bench = serial(Framing::Rtu { silence: SILENCE });
    for unit in [2, 0] {
        bench.send(&rtu_adu(unit, &bytes("03 80 06 00 02")));
        bench.now = bench.now + SILENCE;
        bench.server.handle_timeout(bench.now);
        assert!(bench.serve_one());
        assert_eq!(bench.take_output(), []);
    }
}

#[test]
fn rtu_over_tcp_takes_a_frame_as_soon_as_it_is_whole() {
    let mut bench = serial(Framing::RtuOverTcp { silence: SILENCE });
    let frames: Vec<u8> = [
        "03 80 06 00 02",
        "10 00 06 00 02 04 56 78 12 34",
        "17 80 06 00 02 00 06 00 02 04 56 78 12 34",
        "16 80 06 00 00 00 00",
        "11",
    ]
    .iter()
    .flat_map(|pdu| rtu_adu(1, &bytes(pdu)))
    .collect();
    let answers: Vec<u8> = frames.iter().flat_map(|byte| bench.send(&[*byte])).collect();
    let expected: Vec<u8> = ["03 04 64 01 C0 A8", "10 00 06 00 02", "17 04 64 01 C0 A8", "96 03"]
        .iter()
        .flat_map(|pdu| rtu_adu(1, &bytes(pdu)))
        .collect();
    assert_eq!(hex(&answers[..expected.len()]), hex(&expected));
    assert_eq!(answers[expected.len()..][..2], [0x01, 0x11]);
}

#[test]
fn rtu_over_tcp_takes_a_frame_of_unknown_length_after_silence() {
    let mut bench = serial(Framing::RtuOverTcp { silence: SILENCE });
    assert_eq!(bench.send(&rtu_adu(1, &bytes("2B 0D 00 00 00 60 41 00 00 00 00 02"))), []);
    bench.now = bench.now + SILENCE;
    bench.server.handle_timeout(bench.now);
    assert!(bench.serve_one());
    assert_eq!(bench.take_output(), rtu_adu(1, &bytes("2B 0D 00 00 00 60 41 00 00 00 00 02 16 02")));
}

#[test]
fn rtu_over_tcp_listens_again_after_a_wrong_checksum_and_silence() {
    let mut bench = serial(Framing::RtuOverTcp { silence: SILENCE });
    let good = rtu_adu(1, &bytes("03 80 06 00 02"));
    let mut bad = good.clone();
    bad[3] ^= 1;
    assert_eq!(bench.send(&bad), []);
    assert_eq!(bench.send(&good), []);
    bench.now = bench.now + SILENCE;
    bench.server.handle_timeout(bench.now);
    assert_eq!(bench.send(&good), rtu_adu(1, &bytes("03 04 64 01 C0 A8")));
}

#[test]
fn an_endless_frame_on_a_serial_line_is_dropped() {
    for framing in [Framing::Rtu { silence: SILENCE }, Framing::RtuOverTcp { silence: SILENCE }] {
        let mut bench = serial(framing);
        for _ in 0..10_000 {
            assert_eq!(bench.send(&[0x41; 7]), []);
        }
        assert!(bench.server.room() > 1000);
        bench.now = bench.now + SILENCE;
        bench.server.handle_timeout(bench.now);
        bench.serve_one();
        assert_eq!(bench.take_output(), []);
    }
}
