//! Malformed and boundary requests, with what the standard (Modbus Application Protocol V1.1b3, Messaging on TCP/IP
//! V1.0b) has for them beside what comes. An answer is a PDU, "-" is none, "closed" the end of the connection.

mod bench;

use std::fmt::Write as _;

use bench::{Bench, UNIT, bytes, hex};
use modbus::{Dialect, tcp_adu};

/// What is wrong, the PDU, and the standard's answer.
type Case = (&'static str, &'static str, &'static str);

const PDUS: [Case; 78] = [
    ("1: no coil", "01 00 00 00 00", "81 03"),
    ("1: 2001 coils", "01 00 00 07 D1", "81 03"),
    ("1: 2000 coils, of which there are 32", "01 00 00 07 D0", "81 02"),
    ("1: the last coil", "01 00 1F 00 01", "01 01 00"),
    ("1: one coil too far", "01 00 1F 00 02", "81 02"),
    ("1: coil 65535 and the next", "01 FF FF 00 02", "81 02"),
    ("1: a byte is missing", "01 00 00 00", "81 03"),
    ("1: a byte too many", "01 00 00 00 01 00", "81 03"),
    ("1: the function code alone", "01", "81 03"),
    ("2: no input", "02 00 00 00 00", "82 03"),
    ("2: 2001 inputs", "02 00 00 07 D1", "82 03"),
    ("2: one input too far", "02 00 20 00 01", "82 02"),
    ("3: no register", "03 10 00 00 00", "83 03"),
    ("3: 126 registers", "03 00 00 00 7E", "83 03"),
    ("3: 65535 registers", "03 00 00 FF FF", "83 03"),
    ("3: a count of 16 bits that is 2 in its low byte", "03 00 00 01 02", "83 03"),
    ("3: the end of a range", "03 80 7E 00 02", "03 04 00 00 00 00"),
    ("3: across the end of a range", "03 80 7E 00 03", "83 02"),
    ("3: across the end of all", "03 FF FF 00 02", "83 02"),
    ("3: register 65535", "03 FF FF 00 01", "83 02"),
    ("3: nothing there", "03 0F FF 00 01", "83 02"),
    ("3: write only", "03 10 2A 00 01", "83 02"),
    ("3: a byte is missing", "03 10 00 00", "83 03"),
    ("3: a byte too many", "03 10 00 00 01 00", "83 03"),
    ("3: the function code alone", "03", "83 03"),
    ("4: no register", "04 10 00 00 00", "84 03"),
    ("4: 126 registers", "04 00 00 00 7E", "84 03"),
    ("4: nothing there", "04 0F FF 00 01", "84 02"),
    ("5: neither on nor off", "05 00 00 00 01", "85 03"),
    ("5: on with a bit too many", "05 00 00 FF 01", "85 03"),
    ("5: one coil too far", "05 00 20 FF 00", "85 02"),
    ("5: a byte is missing", "05 00 00 FF", "85 03"),
    ("5: a byte too many", "05 00 00 FF 00 00", "85 03"),
    ("6: nothing there", "06 0F FF 00 00", "86 02"),
    ("6: read only", "06 10 30 00 00", "86 02"),
    ("6: out of range", "06 10 2E 00 00", "86 03"),
    ("6: the first value of the range", "06 10 2E 00 01", "06 10 2E 00 01"),
    ("6: more bits than the value has", "06 10 31 01 00", "86 03"),
    ("6: a truth of 2", "06 10 2B 00 02", "86 03"),
    ("6: a byte is missing", "06 10 2E 00", "86 03"),
    ("6: a byte too many", "06 10 2E 00 01 00", "86 03"),
    ("7: read exception status, serial line only", "07", "87 01"),
    ("8: an unknown sub-function", "08 00 02 00 00", "88 01"),
    ("8: no data", "08 00 00", "88 03"),
    ("8: half a word of data", "08 00 00 A5", "88 03"),
    ("11: get comm event counter, serial line only", "0B", "8B 01"),
    ("15: no coil", "0F 00 00 00 00 00", "8F 03"),
    ("15: 1969 coils", "0F 00 00 07 B1 F7", "8F 03"),
    ("15: a byte count too low", "0F 00 00 00 09 01 00 00", "8F 03"),
    ("15: a byte count too high", "0F 00 00 00 08 02 00 00", "8F 03"),
    ("15: a byte is missing", "0F 00 00 00 09 02 00", "8F 03"),
    ("15: one coil too far", "0F 00 1F 00 02 01 00", "8F 02"),
    ("16: no register", "10 10 34 00 00 00", "90 03"),
    ("16: 124 registers", "10 00 00 00 7C F8", "90 03"),
    ("16: a byte count too low", "10 10 34 00 02 03 00 00 00", "90 03"),
    ("16: a byte count too high", "10 10 34 00 02 05 00 00 00 00 00", "90 03"),
    ("16: a byte is missing", "10 10 34 00 02 04 00 00 00", "90 03"),
    ("16: a byte too many", "10 10 34 00 02 04 00 00 00 00 00", "90 03"),
    ("16: no byte count", "10 10 34 00 02", "90 03"),
    ("16: across the end of a range", "10 80 7E 00 04 08 00 00 00 00 00 00 00 00", "90 02"),
    ("16: read only among others", "10 10 2F 00 02 04 00 01 00 01", "90 02"),
    ("17: a byte too many", "11 00", "91 03"),
    ("20: read file record", "14 07 06 00 01 00 00 00 01", "94 01"),
    ("21: write file record", "15 09 06 00 01 00 00 00 01 00 00", "95 01"),
    ("22: a byte is missing", "16 10 2E 00 00 00", "96 03"),
    ("22: nothing there", "16 0F FF 00 00 00 00", "96 02"),
    ("22: out of range", "16 10 2E 00 00 00 65", "96 03"),
    ("23: no register to read", "17 10 34 00 00 10 34 00 02 04 00 00 00 00", "97 03"),
    ("23: 126 registers to read", "17 10 34 00 7E 10 34 00 02 04 00 00 00 00", "97 03"),
    ("23: no register to write", "17 10 34 00 02 10 34 00 00 00", "97 03"),
    ("23: 122 registers to write", "17 10 34 00 02 10 34 00 7A F4", "97 03"),
    ("23: a byte count too low", "17 10 34 00 02 10 34 00 02 02 00 00 00 00", "97 03"),
    ("23: nothing there to read", "17 0F FF 00 01 10 34 00 02 04 00 00 00 00", "97 02"),
    ("23: nothing there to write", "17 10 34 00 02 0F FF 00 01 02 00 00", "97 02"),
    ("24: read FIFO queue", "18 00 00", "98 01"),
    ("43: no MEI type", "2B", "AB 03"),
    ("43: an unknown MEI type", "2B 0C 00", "AB 01"),
    ("43/14: an unknown code", "2B 0E 05 00", "AB 03"),
];

/// What is wrong, the frame, and the standard's answer.
const FRAMES: [Case; 11] = [
    ("a unit that nobody has", "00 07 00 00 00 06 02 03 10 00 00 01", "00 07 00 00 00 03 02 83 0B"),
    (
        "an exception of it, whatever else is wrong",
        "00 07 00 00 00 03 02 63 00",
        "00 07 00 00 00 03 02 E3 0B",
    ),
    ("another protocol", "00 07 00 01 00 06 01 03 10 00 00 01", "-"),
    ("a length of 0", "00 07 00 00 00 00", "-"),
    ("a length of 1", "00 07 00 00 00 01 01", "-"),
    ("a length of 2: a function code alone", "00 07 00 00 00 02 01 03", "00 07 00 00 00 03 01 83 03"),
    ("a length of 255", "00 07 00 00 00 FF 01 03 10 00 00 01", "closed"),
    ("a length of 65535", "00 07 00 00 FF FF 01 03 10 00 00 01", "closed"),
    (
        "a length that says less than is there",
        "00 07 00 00 00 05 01 03 10 00 00 01",
        "00 07 00 00 00 03 01 83 03",
    ),
    ("a length that says more than is there", "00 07 00 00 00 07 01 03 10 00 00 01", "-"),
    ("function code 0", "00 07 00 00 00 02 01 00", "00 07 00 00 00 03 01 80 01"),
];

/// Function codes 0x80 and above are none (section 4.1).
#[test]
fn codes_of_exceptions_are_no_functions() {
    for code in 0x80..=0xFF_u8 {
        assert_eq!(
            Bench::new(Dialect::Full).ask(&format!("{code:02X} 00 00 00 01")),
            format!("{code:02X} 01")
        );
    }
}

#[test]
fn every_wrong_request_has_the_answer_of_the_standard() {
    let mut table = format!("{:<50} {:<45} {:<28} {}\n", "case", "request", "standard", "ours");
    let mut line = |what: &str, request: &str, standard: &str, ours: &str| {
        let verdict = if standard == ours { "as the standard" } else { "DIFFERS" };
        writeln!(table, "{what:<50} {request:<45} {standard:<28} {ours:<28} {verdict}").unwrap();
    };
    for (what, pdu, standard) in PDUS {
        let answer = Bench::new(Dialect::Full).send(&tcp_adu(1, UNIT, &bytes(pdu)));
        line(what, pdu, standard, &hex(&answer[7..]));
    }
    for (what, frame, standard) in FRAMES {
        let mut bench = Bench::new(Dialect::Full);
        let answer = bench.exchange(frame);
        let answer = match answer.as_str() {
            "" if bench.server.is_closing() => "closed",
            "" => "-",
            answer => answer,
        };
        line(what, frame, standard, answer);
    }
    assert_eq!(table.lines().skip(1).filter(|line| line.ends_with("DIFFERS")).collect::<Vec<_>>(), [""; 0]);
    insta::assert_snapshot!(table);
}

/// After every wrong request that leaves the connection open the next right one is answered.
#[test]
fn a_wrong_request_does_not_upset_the_next_one() {
    let right = "00 08 00 00 00 06 01 03 80 06 00 02";
    let answer = "00 08 00 00 00 07 01 03 04 64 01 C0 A8";
    for (what, pdu, _) in PDUS {
        let mut bench = Bench::new(Dialect::Full);
        bench.send(&tcp_adu(1, UNIT, &bytes(pdu)));
        assert_eq!(bench.exchange(right), answer, "{what}");
    }
}
