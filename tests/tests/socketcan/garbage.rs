//! Frames that no master should send, made with `cansend`: they change nothing, and earn what CiA 301 names.

use tests::{Daemon, Vcan, Wire};

use crate::{
    DEVICE_TYPE, OPERATION_ENABLED, READ_DEVICE_TYPE, READY_TO_SWITCH_ON, STATE, SWITCHED_ON, one_drive,
};

/// Node 1 on a bus of its own, OPERATIONAL and its drive in OPERATION ENABLED.
struct Bench {
    wire: Wire,
    _daemon: Daemon,
    _interface: Vcan,
}

/// Reads of objects that garbage must not change.
const WATCHED: [&str; 9] = [
    "601#4016100100000000",
    "601#4017100000000000",
    "601#4000140100000000",
    "601#4000180200000000",
    "601#4041600000000000",
    "601#4061600000000000",
    "601#4064600000000000",
    "601#407A600000000000",
    "601#4081600000000000",
];

/// Garbage that earns no answer, and that python-canopen does not mistake for its own frames either: it takes an
/// extended id for a standard one, and a malformed NMT command for a good one.
pub(crate) const UNANSWERED: [&str; 8] = [
    "000#FF01",
    "000#0001",
    "080#R",
    "601#40001000",
    "601##44000100000000000",
    "00000601#4000100000000000",
    "6FF#DEADBEEF",
    "1FFFFFFF#R",
];

impl Bench {
    fn new() -> Self {
        let interface = Vcan::new();
        let daemon = one_drive(&interface);
        let mut wire = Wire::on(&interface);
        wire.send("000#0101");
        // Shutdown, switch on, enable operation.
        for (controlword, state) in
            [("0600", READY_TO_SWITCH_ON), ("0700", SWITCHED_ON), ("0F00", OPERATION_ENABLED)]
        {
            wire.send(&format!("201#{controlword}"));
            wire.expect_statusword(STATE, state);
        }
        Self { wire, _daemon: daemon, _interface: interface }
    }

    /// Sends each frame, and asserts that the frames beside it and no others are the answer, and that all is as
    /// before.
    fn assert_answers(mut self, exchanges: &[(&str, &[&str])]) {
        let before = self.watched();
        self.wire.take();
        for (frame, answers) in exchanges {
            self.wire.send(frame);
            for answer in *answers {
                self.wire.expect(answer);
            }
        }
        // The answer to a last request: all before it has been seen by the node.
        self.wire.send(READ_DEVICE_TYPE);
        self.wire.expect(DEVICE_TYPE);
        let last: (&str, &[&str]) = (READ_DEVICE_TYPE, &[DEVICE_TYPE]);
        let expected: Vec<&str> = exchanges
            .iter()
            .chain([&last])
            .flat_map(|(frame, answers)| [*frame].into_iter().chain(answers.iter().copied()))
            .collect();
        assert_eq!(self.wire.take(), expected);
        assert_eq!(self.watched(), before);
    }

    fn watched(&mut self) -> Vec<String> {
        WATCHED.iter().map(|request| self.wire.ask(request, "581")).collect()
    }
}

#[test]
fn malformed_nmt_commands_are_ignored() {
    Bench::new().assert_answers(&[
        ("000#", &[]),
        ("000#81", &[]),
        ("000#810100", &[]),
        ("000#8101000000000000", &[]),
        ("000#0001", &[]),
        ("000#FF01", &[]),
        ("000#8102", &[]),
        ("000#8181", &[]),
        ("000#R2", &[]),
        ("00000000#8101", &[]),
    ]);
}

#[test]
fn a_sync_with_data_it_should_not_have_is_reported_once() {
    Bench::new().assert_answers(&[
        ("080#0102", &["081#4082110200000000"]),
        ("080#01", &[]),
        // The next good one ends the error, and is answered by the synchronous TPDOs.
        ("080#", &["081#0000000000000000", "381#370200000000", "481#370200000000"]),
        ("080#R", &[]),
        ("00000080#", &[]),
    ]);
}

#[test]
fn an_rpdo_too_short_for_its_mapping_is_reported() {
    Bench::new().assert_answers(&[
        ("201#06", &["081#1082110100010000"]),
        // Once, until a good one ends the error.
        ("201#00", &[]),
        ("201#0F00", &["081#0000000000000000"]),
    ]);
}

#[test]
fn an_rpdo_too_long_for_its_mapping_is_used_and_reported() {
    Bench::new().assert_answers(&[
        // What it maps says what the drive does already.
        ("201#0F0000", &["081#2082110100030000"]),
        ("201#0F00", &["081#0000000000000000"]),
    ]);
}

#[test]
fn remote_requests_are_answered_by_guarding_and_by_a_tpdo_that_allows_them() {
    Bench::new().assert_answers(&[
        ("181#R2", &[]),
        // Bit 30 of the COB-ID forbids it; the PDO is disabled (bit 31) before that is changed.
        ("601#23001801810100C0", &["581#6000180100000000"]),
        // Enabled in OPERATIONAL, an event-driven TPDO is sent at once.
        ("601#2300180181010000", &["581#6000180100000000", "181#3702"]),
        ("181#R2", &["181#3702"]),
        ("00000181#R2", &[]),
        ("201#R2", &[]),
        ("581#R8", &[]),
        // Node guarding: OPERATIONAL, toggle bit 0.
        ("701#R1", &["701#05"]),
    ]);
}

#[test]
fn sdo_requests_of_less_than_eight_bytes_are_ignored() {
    Bench::new().assert_answers(&[
        ("601#", &[]),
        ("601#40", &[]),
        ("601#40001000", &[]),
        ("601#40001000000000", &[]),
        ("601#R8", &[]),
        ("00000601#4000100000000000", &[]),
        ("601##44000100000000000", &[]),
    ]);
}

#[test]
fn unknown_sdo_commands_are_aborted() {
    Bench::new().assert_answers(&[
        // Client command specifier 7 is none.
        ("601#E000100000000000", &["581#8000100001000405"]),
        // Segments outside a transfer.
        ("601#6000000000000000", &["581#8000000001000405"]),
        ("601#0000000000000000", &["581#8000000001000405"]),
        // An abort is not answered, whatever it names.
        ("601#8000100000000008", &[]),
    ]);
}

#[test]
fn sdo_access_to_what_is_not_there_is_aborted() {
    Bench::new().assert_answers(&[
        // No such object, no such sub-index, for reading and for writing.
        ("601#40FF5F0000000000", &["581#80FF5F0000000206"]),
        ("601#4000100100000000", &["581#8000100111000906"]),
        ("601#2FFF5F0001000000", &["581#80FF5F0000000206"]),
        ("601#2F00100101000000", &["581#8000100111000906"]),
    ]);
}

#[test]
fn sdo_writes_that_may_not_be_are_aborted() {
    Bench::new().assert_answers(&[
        // A read-only object.
        ("601#2300100000000000", &["581#8000100002000106"]),
        // Two bytes into the four of 0x6081, four into the two of 0x1017.
        ("601#2B81600001000000", &["581#8081600013000706"]),
        ("601#2317100001000000", &["581#8017100012000706"]),
    ]);
}

#[test]
fn an_sdo_segment_with_the_wrong_toggle_bit_is_aborted() {
    Bench::new().assert_answers(&[
        // 0x1008, the device name, is longer than an expedited answer.
        ("601#4008100000000000", &["581#4108100009000000"]),
        ("601#7000000000000000", &["581#8008100000000305"]),
    ]);
}

#[test]
fn cob_ids_of_nobody_are_ignored() {
    Bench::new().assert_answers(&[
        ("602#4000100000000000", &[]),
        ("202#0000", &[]),
        ("00000201#0000", &[]),
        ("581#4300100092010200", &[]),
        ("181#0000", &[]),
        ("081#0000000000000000", &[]),
        ("701#05", &[]),
        ("6FF#DEADBEEF", &[]),
        ("1FFFFFFF#R", &[]),
    ]);
}
