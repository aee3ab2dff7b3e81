//! The ASCII gateway on virtual time: lines of clients, and frames as on the wire.

use std::time::Duration;

use canopen::ascii::{AsciiGateway, LONGEST_LINE, Outgoing, Told};
use canopen::{Frame, Id};
use od::Instant;
use proptest::prelude::*;

const CLIENT: u64 = 1;
const NET: u16 = 1;

/// A gateway with one client, and the time.
struct Bench {
    gateway: AsciiGateway,
    now: Instant,
}

impl Bench {
    fn new() -> Self {
        Self::with_networks(&[NET])
    }

    fn with_networks(networks: &[u16]) -> Self {
        let mut gateway = AsciiGateway::new(networks.iter().copied());
        gateway.connect(CLIENT);
        Self { gateway, now: Instant::ZERO }
    }

    /// What comes of a line: frames, then lines.
    fn say(&mut self, line: &str) -> Vec<String> {
        self.gateway.handle_line(self.now, CLIENT, line.as_bytes());
        self.output()
    }

    /// What comes of a frame, written as `id#data`.
    fn hear(&mut self, frame: &str) -> Vec<String> {
        self.gateway.handle_frame(self.now, NET, &parse(frame));
        self.output()
    }

    /// What comes of time.
    fn pass(&mut self, millis: u64) -> Vec<String> {
        let end = self.now + Duration::from_millis(millis);
        let mut output = Vec::new();
        while let Some(due) = self.gateway.poll_timeout().filter(|due| *due <= end) {
            self.now = due.max(self.now);
            self.gateway.handle_timeout(self.now);
            output.extend(self.output());
        }
        self.now = end;
        output
    }

    fn output(&mut self) -> Vec<String> {
        let frames = std::iter::from_fn(|| self.gateway.poll_transmit());
        let mut output: Vec<String> = frames
            .map(|Outgoing { network, frame, .. }| match network {
                NET => frame.to_string(),
                net => format!("{net}: {frame}"),
            })
            .collect();
        while let Some((client, told)) = self.gateway.poll_line() {
            let (Told::Answer(text) | Told::Event(text)) = told;
            output.push(if client == CLIENT { text } else { format!("{client}: {text}") });
        }
        output
    }
}

fn parse(frame: &str) -> Frame {
    let (id, data) = frame.split_once('#').unwrap();
    let id = Id::Standard(u16::from_str_radix(id, 16).unwrap());
    if let Some(length) = data.strip_prefix('R') {
        return Frame::remote(id, length.parse().unwrap());
    }
    let byte = |place: usize| u8::from_str_radix(&data[place..place + 2], 16).unwrap();
    Frame::new(id, &(0..data.len()).step_by(2).map(byte).collect::<Vec<_>>())
}

#[test]
fn objects_are_read_and_written() {
    let mut bench = Bench::new();
    assert_eq!(bench.say("[1] 5 read 0x1018 1 u32"), ["605#4018100100000000"]);
    assert_eq!(bench.hear("585#4318100117010000"), ["[1] 279"]);
    assert_eq!(bench.say("[2] 1 5 w 0x6060 0 i8 -3"), ["605#2F606000FD000000"]);
    assert_eq!(bench.hear("585#6060600000000000"), ["[2] OK"]);
    assert_eq!(bench.say("[3] 5 r 0x6040 9 u16"), ["605#4040600900000000"]);
    assert_eq!(bench.hear("585#8040600911000906"), ["[3] ERROR:0x06090011 #sub-index does not exist"]);
    assert_eq!(bench.say("[4] 5 r 0x1008 0 vs"), ["605#4008100000000000"]);
    assert_eq!(bench.hear("585#4108100005000000"), ["605#6000000000000000"]);
    assert_eq!(bench.hear("585#05415822207A2F00"), ["[4] \"AX\"\" z\""]);
    assert_eq!(bench.say("[5] 5 w 0x2000 0 vs \"a # b\" # a comment"), ["605#2100200005000000"]);
    assert_eq!(bench.hear("585#6000200000000000"), ["605#0561202320620000"]);
    assert_eq!(bench.hear("585#2000000000000000"), ["[5] OK"]);
    assert_eq!(bench.say("[6] 5 r 0x1000 0"), ["605#4000100000000000"]);
    assert_eq!(bench.hear("585#4300100092010200"), ["[6] 92 01 02 00"]);
    assert_eq!(bench.say("[7] 5 r 0x1000 0 u16"), ["605#4000100000000000"]);
    let wrong = "[7] ERROR:0x06070010 #data type does not match, length of service parameter does not match";
    assert_eq!(bench.hear("585#4300100092010200"), [wrong]);
}

#[test]
fn a_silent_node_is_a_time_out_of_sdo_and_a_command_may_end_before() {
    let mut bench = Bench::new();
    assert_eq!(bench.say("[1] 5 r 0x1000 0 u32").len(), 1);
    assert_eq!(bench.pass(499), [""; 0]);
    assert_eq!(bench.pass(1), ["605#8000100000000405", "[1] ERROR:0x05040000 #SDO protocol timed out"]);
    assert_eq!(bench.say("[2] set sdo_timeout 2000"), ["[2] OK"]);
    assert_eq!(bench.say("[3] set command_timeout 300"), ["[3] OK"]);
    assert_eq!(bench.say("[4] 5 r 0x1000 0 u32").len(), 1);
    assert_eq!(bench.pass(299), [""; 0]);
    assert_eq!(bench.pass(1), ["605#8000100000000405", "[4] ERROR:103 #time-out"]);
    assert_eq!(bench.hear("585#4300100092010200"), [""; 0], "nobody waits for that any more");
    assert_eq!(bench.say("[5] set command_timeout 0"), ["[5] OK"]);
    assert_eq!(bench.say("[6] 5 r 0x1000 0 u32").len(), 1);
    assert_eq!(bench.hear("585#4300100092010200"), ["[6] 131474"]);
}

#[test]
fn blocks_are_transferred_where_a_client_wants_them() {
    let mut bench = Bench::new();
    assert_eq!(bench.say("[1] set sdo_block 1"), ["[1] OK"]);
    assert_eq!(bench.say("[2] 5 r 0x1008 0 vs"), ["605#A40810007F000000"]);
    assert_eq!(bench.hear("585#C208100002000000"), ["605#A300000000000000"]);
    assert_eq!(bench.hear("585#8158590000000000"), ["605#A2017F0000000000"]);
    assert_eq!(bench.hear("585#D500000000000000"), ["605#A100000000000000", "[2] \"XY\""]);
}

#[test]
fn a_node_has_one_channel_for_all_clients() {
    let mut bench = Bench::new();
    bench.gateway.connect(2);
    assert_eq!(bench.say("[1] 5 r 0x1000 0 u32"), ["605#4000100000000000"]);
    assert!(bench.gateway.handle_line(bench.now, 2, b"[9] 5 r 0x1001 0 u8"));
    assert_eq!(bench.output(), [""; 0], "the second waits for the first");
    assert!(!bench.gateway.handle_line(bench.now, CLIENT, b"[2] 6 start"), "it waits for an answer");
    assert_eq!(bench.hear("585#4300100092010200"), ["605#4001100000000000", "[1] 131474"]);
    assert_eq!(bench.hear("585#4F01100000000000"), ["2: [9] 0"]);
    assert_eq!(bench.say("[2] 5 r 0x1000 0 u32").len(), 1);
    bench.gateway.disconnect(bench.now, CLIENT);
    assert_eq!(bench.output(), ["605#8000100000000405"], "what a client has begun ends with it");
}

#[test]
fn nodes_are_commanded() {
    let mut bench = Bench::new();
    for (line, frame) in [
        ("[1] 5 start", "000#0105"),
        ("[1] 5 STOP", "000#0205"),
        ("[1] 5 preop", "000#8005"),
        ("[1] 5 preoperational", "000#8005"),
        ("[1] 5 reset node", "000#8105"),
        ("[1] 5 reset comm", "000#8205"),
        ("[1] 5 reset communication", "000#8205"),
        ("[1] 1 0 start", "000#0100"),
    ] {
        assert_eq!(bench.say(line), [frame, "[1] OK"], "{line}");
    }
    assert_eq!(bench.say("[2] start"), ["[2] ERROR:105 #no default node set"]);
    assert_eq!(bench.say("[3] set node 7"), ["[3] OK"]);
    assert_eq!(bench.say("[4] start"), ["000#0107", "[4] OK"]);
}

#[test]
fn networks_have_numbers() {
    let mut bench = Bench::with_networks(&[NET, 4]);
    assert_eq!(bench.say("[1] 5 start"), ["[1] ERROR:104 #no default net set"]);
    assert_eq!(bench.say("[2] 4 5 start"), ["4: 000#0105", "[2] OK"]);
    assert_eq!(bench.say("[3] 3 5 start"), ["[3] ERROR:106 #unsupported net"]);
    assert_eq!(bench.say("[4] set network 3"), ["[4] ERROR:106 #unsupported net"]);
    assert_eq!(bench.say("[5] set network 4"), ["[5] OK"]);
    assert_eq!(bench.say("[6] 5 start"), ["4: 000#0105", "[6] OK"]);
    assert_eq!(bench.say("[7] 1 lss_switch_glob 1"), ["7E5#0401000000000000", "[7] OK"]);
}

#[test]
fn what_is_no_command_is_a_syntax_error_with_its_sequence() {
    let mut bench = Bench::new();
    for (line, answer) in [
        ("hello", "[0] ERROR:101 #syntax error"),
        ("[x] 5 start", "[0] ERROR:101 #syntax error"),
        ("[1 5 start", "[0] ERROR:101 #syntax error"),
        ("[4294967296] 5 start", "[0] ERROR:101 #syntax error"),
        ("[1]", "[1] ERROR:101 #syntax error"),
        ("[1] 5", "[1] ERROR:101 #syntax error"),
        ("[1] 5 start now", "[1] ERROR:101 #syntax error"),
        ("[1] 5 r 0x10000 0 u8", "[1] ERROR:101 #syntax error"),
        ("[1] 5 r 0x1000 256 u8", "[1] ERROR:101 #syntax error"),
        ("[1] 5 r 0x1000 0 u128", "[1] ERROR:101 #syntax error"),
        ("[1] 5 w 0x1000 0 u8", "[1] ERROR:101 #syntax error"),
        ("[1] 5 w 0x1000 0 u8 256", "[1] ERROR:101 #syntax error"),
        ("[1] 5 w 0x1000 0 vs two words", "[1] ERROR:101 #syntax error"),
        ("[1] 1 2 3 start", "[1] ERROR:101 #syntax error"),
        ("[1] 1 5 set sdo_block 1", "[1] ERROR:101 #syntax error"),
        ("[1] set sdo_block 2", "[1] ERROR:101 #syntax error"),
        ("[1] set sdo_timeout 0", "[1] ERROR:101 #syntax error"),
        ("[1] enable guarding 0 3", "[1] ERROR:101 #syntax error"),
        ("[1] 1 set network 1", "[1] ERROR:101 #syntax error"),
        ("[1] 128 start", "[1] ERROR:107 #unsupported node"),
        ("[1] 0 r 0x1000 0 u32", "[1] ERROR:107 #unsupported node"),
        ("[1] set node 0", "[1] ERROR:107 #unsupported node"),
        ("[1] lss_set_node 128", "[1] ERROR:107 #unsupported node"),
        ("[1] init 3", "[1] ERROR:100 #request not supported"),
        ("[1] set command_size 65537", "[1] ERROR:100 #request not supported"),
        ("[1] r p 1", "[1] ERROR:102 #not processed due to internal state"),
        ("[1] set heartbeat 100", "[1] ERROR:102 #not processed due to internal state"),
        ("[1]info version#", "[1] 0 0 0.1 0 3 2.0 0.1"),
    ] {
        let answer = if line.contains("guarding") { "[1] ERROR:105 #no default node set" } else { answer };
        assert_eq!(bench.say(line), [answer], "{line}");
    }
    for nothing in ["", "   ", "# a comment", "  # [1] 5 start"] {
        assert_eq!(bench.say(nothing), [""; 0], "{nothing}");
        assert!(!bench.gateway.handle_line(bench.now, CLIENT, nothing.as_bytes()));
    }
    assert!(bench.gateway.handle_line(bench.now, CLIENT, &[b'[', 0xFF]));
    assert_eq!(bench.output(), ["[0] ERROR:101 #syntax error"]);
    assert_eq!(bench.say("[1] set command_size 12"), ["[1] OK"]);
    assert_eq!(bench.gateway.longest_line(CLIENT), 12);
    assert_eq!(bench.say("[1] 5 start #long"), ["[0] ERROR:101 #syntax error"]);
    assert_eq!(bench.say(&format!("[1] {}", "x".repeat(LONGEST_LINE))), ["[0] ERROR:101 #syntax error"]);
}

#[test]
fn clients_are_told_what_happens() {
    let mut bench = Bench::new();
    bench.gateway.connect(2);
    assert!(bench.gateway.handle_line(bench.now, 2, b"[1] boot_up_indication Disable"));
    assert_eq!(bench.output(), ["2: [1] OK"]);
    assert_eq!(bench.hear("705#00"), ["1 5 BOOT_UP"]);
    let emergency = "1 5 EMCY 8130 11 1 2 3 4 255";
    assert_eq!(bench.hear("085#30811101020304FF"), [emergency.to_owned(), format!("2: {emergency}")]);
    for silent in
        ["085#3081", "705#05", "080#", "585#4300100092010200", "385#0102", "7E4#5000000000000000", "705#R1"]
    {
        assert_eq!(bench.hear(silent), [""; 0], "{silent}");
    }
}

#[test]
fn a_heartbeat_is_watched() {
    let mut bench = Bench::new();
    assert_eq!(bench.say("[1] 5 enable heartbeat 200"), ["[1] OK"]);
    assert_eq!(bench.pass(1000), [""; 0], "it has not begun");
    assert_eq!(bench.hear("705#05"), ["1 5 ERROR 202 #heartbeat started"]);
    assert_eq!(bench.pass(199), [""; 0]);
    assert_eq!(bench.hear("705#05"), [""; 0]);
    assert_eq!(bench.pass(200), ["1 5 ERROR 203 #heartbeat lost"]);
    assert_eq!(bench.pass(1000), [""; 0]);
    assert_eq!(bench.hear("705#7F"), ["1 5 ERROR 202 #heartbeat started"]);
    assert_eq!(bench.say("[2] 5 disable heartbeat"), ["[2] OK"]);
    assert_eq!(bench.pass(1000), [""; 0]);
}

#[test]
fn a_node_is_guarded() {
    let mut bench = Bench::new();
    assert_eq!(bench.say("[1] 5 enable guarding 100 2"), ["[1] OK"]);
    assert_eq!(bench.pass(0), ["705#R1"]);
    assert_eq!(bench.hear("705#05"), [""; 0]);
    assert_eq!(bench.pass(100), ["705#R1"]);
    assert_eq!(bench.hear("705#85"), [""; 0]);
    assert_eq!(bench.pass(100), ["705#R1"]);
    assert_eq!(bench.hear("705#85"), [""; 0], "an old answer counts for none");
    assert_eq!(bench.pass(100), ["705#R1"]);
    assert_eq!(bench.pass(100), ["705#R1", "1 5 ERROR 200 #lost guarding message"]);
    assert_eq!(bench.hear("705#05"), [""; 0]);
    assert_eq!(bench.say("[2] 5 disable heartbeat"), ["[2] OK"]);
    assert_eq!(bench.pass(100), ["705#R1"], "that was something else");
    bench.gateway.disconnect(bench.now, CLIENT);
    assert_eq!(bench.pass(1000), [""; 0], "it ends with its client");
}

#[test]
fn the_gateway_tells_that_it_lives() {
    let mut bench = Bench::new();
    assert_eq!(bench.say("[1] set id 127"), ["[1] OK"]);
    assert_eq!(bench.say("[2] set heartbeat 100"), ["[2] OK"]);
    assert_eq!(bench.pass(250), ["77F#05"; 3]);
    assert_eq!(bench.say("[3] set heartbeat 0"), ["[3] OK"]);
    assert_eq!(bench.pass(1000), [""; 0]);
}

#[test]
fn pdos_are_received() {
    let mut bench = Bench::new();
    assert_eq!(bench.say("[1] set rpdo 1 0x185 event 3 0x6041 0 u16 0x6061 0 i8 b"), ["[1] OK"]);
    assert_eq!(bench.say("[2] read pdo 1"), ["[2] ERROR:102 #not processed due to internal state"]);
    assert_eq!(bench.hear("185#37020301"), ["1 pdo 1 3 0x237 0x3 0x1"]);
    assert_eq!(bench.say("[3] r p 1"), ["[3] 1 pdo 1 3 0x237 0x3 0x1"]);
    assert_eq!(bench.hear("185#3702"), [""; 0], "one that is too short is none");
    assert_eq!(bench.say("[4] set rpdo 2 0x285 rtr 1 u16"), ["[4] OK"]);
    assert_eq!(bench.say("[5] r p 2"), ["285#R2"]);
    assert_eq!(bench.hear("285#3412"), ["[5] 1 pdo 2 1 0x1234"]);
    assert_eq!(bench.say("[6] r p 2"), ["285#R2"]);
    assert_eq!(bench.pass(1000), ["[6] ERROR:103 #time-out"]);
}

#[test]
fn pdos_are_sent() {
    let mut bench = Bench::new();
    assert_eq!(bench.say("[1] w p 1 1 5"), ["[1] ERROR:102 #not processed due to internal state"]);
    assert_eq!(bench.say("[1] set tpdo 1 0x205 event 2 0x6040 0 u16 0x6060 0 i8"), ["[1] OK"]);
    assert_eq!(bench.say("[2] w p 1 2 0x000F 255"), ["205#0F00FF", "[2] OK"]);
    assert_eq!(bench.say("[3] w p 1 1 6"), ["[3] ERROR:101 #syntax error"]);
    assert_eq!(bench.say("[3] w p 1 3 6 1 1"), ["[3] ERROR:401 #PDO length exceeded"]);
    assert_eq!(bench.say("[4] set tpdo 2 0x305 sync0 1 u8"), ["[4] OK"]);
    assert_eq!(bench.say("[5] write pdo 2 1 7"), ["[5] OK"]);
    assert_eq!(bench.hear("080#"), ["305#07"]);
    assert_eq!(bench.hear("080#"), [""; 0], "it was written once");
    assert_eq!(bench.say("[6] set tpdo 3 0x405 sync2 1 u8"), ["[6] OK"]);
    assert_eq!(bench.say("[7] w p 3 1 9"), ["[7] OK"]);
    assert_eq!([bench.hear("080#01"), bench.hear("080#02"), bench.hear("080#03")].concat(), ["405#09"]);
    assert_eq!(bench.say("[8] set tpdo 4 0x505 rtr 1 u8"), ["[8] OK"]);
    assert_eq!(bench.hear("505#R1"), [""; 0], "it has no value");
    assert_eq!(bench.say("[9] w p 4 1 8"), ["[9] OK"]);
    assert_eq!(bench.hear("505#R1"), ["505#08"]);
    for (line, answer) in [
        ("[1] set tpdo 0 0x205 event 0", "[1] ERROR:101 #syntax error"),
        ("[1] set tpdo 513 0x205 event 0", "[1] ERROR:101 #syntax error"),
        ("[1] set tpdo 1 0x800 event 0", "[1] ERROR:101 #syntax error"),
        ("[1] set tpdo 1 0x205 sync241 0", "[1] ERROR:101 #syntax error"),
        ("[1] set tpdo 1 0x205 never 0", "[1] ERROR:101 #syntax error"),
        ("[1] set tpdo 1 0x205 event 1 vs", "[1] ERROR:101 #syntax error"),
        ("[1] set tpdo 1 0x205 event 2 u8", "[1] ERROR:101 #syntax error"),
        ("[1] set tpdo 1 0x205 event 2 u64 b", "[1] ERROR:401 #PDO length exceeded"),
    ] {
        assert_eq!(bench.say(line), [answer], "{line}");
    }
}

#[test]
fn slaves_are_configured_by_lss() {
    let mut bench = Bench::new();
    assert_eq!(bench.say("[1] lss_switch_glob 1"), ["7E5#0401000000000000", "[1] OK"]);
    let selection =
        ["7E5#4017010000000000", "7E5#4100010000000000", "7E5#4203000100000000", "7E5#4304000000000000"];
    assert_eq!(bench.say("[2] lss_switch_sel 279 0x100 0x10003 4"), selection);
    assert_eq!(bench.hear("7E4#4400000000000000"), ["[2] OK"]);
    for (line, request, answer, told) in [
        ("lss_set_node 5", "7E5#1105000000000000", "7E4#1100000000000000", "OK"),
        (
            "lss_set_node 5",
            "7E5#1105000000000000",
            "7E4#1101000000000000",
            "ERROR:502 #LSS node-ID not supported",
        ),
        ("lss_conf_bitrate 0 2", "7E5#1300020000000000", "7E4#1300000000000000", "OK"),
        (
            "lss_conf_bitrate 0 5",
            "7E5#1300050000000000",
            "7E4#1301000000000000",
            "ERROR:503 #LSS bit-rate not supported",
        ),
        ("lss_store", "7E5#1700000000000000", "7E4#1700000000000000", "OK"),
        (
            "lss_store",
            "7E5#1700000000000000",
            "7E4#1702000000000000",
            "ERROR:504 #LSS parameter storing failed",
        ),
        (
            "lss_store",
            "7E5#1700000000000000",
            "7E4#17FF000000000000",
            "ERROR:501 #LSS implementation- or manufacturer-specific error",
        ),
        ("lss_get_node", "7E5#5E00000000000000", "7E4#5E05000000000000", "5"),
        ("lss_inquire_addr 1", "7E5#5B00000000000000", "7E4#5B78563412000000", "0x12345678"),
        ("lss_inquire_addr 0x5D", "7E5#5D00000000000000", "7E4#5D01000000000000", "0x00000001"),
        ("lss_ident_nonconf", "7E5#4C00000000000000", "7E4#5000000000000000", "OK"),
    ] {
        assert_eq!(bench.say(&format!("[3] {line}")), [request], "{line}");
        assert_eq!(bench.hear("7E4#4F00000000000000"), [""; 0], "that was not asked");
        assert_eq!(bench.hear(answer), [format!("[3] {told}")], "{line}");
    }
    assert_eq!(bench.say("[4] lss_activate_bitrate 1000"), ["7E5#15E8030000000000", "[4] OK"]);
    assert_eq!(bench.say("[5] lss_identity 1 2 3 4 5 6").len(), 6);
    assert_eq!(bench.hear("7E4#4F00000000000000"), ["[5] OK"]);
    assert_eq!(bench.say("[6] lss_inquire_addr"), ["7E5#5A00000000000000"]);
    assert_eq!(bench.hear("7E4#5A01000000000000"), ["7E5#5B00000000000000"]);
    assert_eq!(bench.hear("7E4#5B02000000000000"), ["7E5#5C00000000000000"]);
    assert_eq!(bench.hear("7E4#5C03000000000000"), ["7E5#5D00000000000000"]);
    assert_eq!(bench.hear("7E4#5D04000000000000"), ["[6] 0x00000001 0x00000002 0x00000003 0x00000004"]);
    assert_eq!(bench.say("[7] lss_get_node").len(), 1);
    assert_eq!(bench.pass(3000), ["[7] ERROR:103 #time-out"]);
}

/// A slave without a Node-ID that is scanned and then selected.
struct Slave {
    address: [u32; 4],
    part: usize,
}

impl Slave {
    fn answer(&mut self, frame: &str) -> Option<&'static str> {
        let data = parse(frame).eight()?;
        let number = u32::from_le_bytes(data[1..5].try_into().unwrap());
        match data {
            [0x51, _, _, _, _, 0x80, ..] => {
                self.part = 0;
                Some("7E4#4F00000000000000")
            }
            [0x51, _, _, _, _, bit, part, next] => {
                let is_equal = (number ^ self.address[usize::from(part)]) >> bit == 0;
                if is_equal && bit == 0 {
                    self.part = next.into();
                }
                is_equal.then_some("7E4#4F00000000000000")
            }
            [0x5E, ..] => Some("7E4#5EFF000000000000"),
            [0x43, ..] => (number == self.address[3]).then_some("7E4#4400000000000000"),
            _ => None,
        }
    }
}

#[test]
fn a_slave_without_a_node_id_is_found_and_selected() {
    for line in ["[1] _lss_fastscan", "[1] _lss_fastscan 500"] {
        let mut bench = Bench::new();
        let mut slave = Slave { address: [0x117, 0x100, 0x0001_0003, 0xA0C2_8D1F], part: 0 };
        let mut output = bench.say(line);
        let mut questions = 0;
        let told = loop {
            let mut next = Vec::new();
            for heard in std::mem::take(&mut output) {
                if !heard.starts_with("7E5#") {
                    next.push(heard);
                    continue;
                }
                questions += 1;
                next.extend(slave.answer(&heard).map(|answer| bench.hear(answer)).into_iter().flatten());
            }
            if next.first().is_some_and(|line| line.starts_with("[1]")) {
                break next;
            }
            output = next;
            output.extend(bench.pass(5));
            assert!(bench.now < Instant::ZERO + Duration::from_secs(60), "{questions} questions");
        };
        assert_eq!(told, ["[1] 0x00000117 0x00000100 0x00010003 0xA0C28D1F"], "{line}");
        assert!(questions > 130, "{questions}");
    }
    let mut bench = Bench::new();
    assert!(!bench.say("[2] _lss_fastscan").is_empty());
    let told = bench.pass(5000);
    assert_eq!(told.last().map(String::as_str), Some("[2] ERROR:103 #time-out"), "there is nobody");
}

#[test]
fn a_scan_ends_with_its_client() {
    let mut bench = Bench::new();
    bench.gateway.connect(2);
    assert!(!bench.say("[1] _lss_fastscan 60000").is_empty());
    assert_eq!(bench.pass(100), ["7E5#5100000000800000"]);
    assert!(bench.gateway.handle_line(bench.now, 2, b"[8] lss_get_node"));
    bench.gateway.disconnect(bench.now, CLIENT);
    assert_eq!(bench.output(), ["7E5#0400000000000000", "7E5#5E00000000000000"]);
}

#[test]
fn two_clients_share_the_lss_master() {
    let mut bench = Bench::new();
    bench.gateway.connect(2);
    assert_eq!(bench.say("[1] lss_get_node").len(), 1);
    assert!(bench.gateway.handle_line(bench.now, 2, b"[8] lss_switch_glob 0"));
    assert_eq!(bench.output(), [""; 0]);
    assert_eq!(bench.hear("7E4#5E05000000000000"), ["7E5#0400000000000000", "[1] 5", "2: [8] OK"]);
}

#[test]
fn each_frame_says_for_which_client_it_is_also_if_that_had_to_wait() {
    let mut bench = Bench::new();
    bench.gateway.connect(2);
    let sent = |bench: &mut Bench| {
        let sent = std::iter::from_fn(|| bench.gateway.poll_transmit());
        sent.map(|out| (out.client, out.frame.to_string())).collect::<Vec<_>>()
    };
    let by = |client, frame: &str| (Some(client), frame.to_owned());
    let say = |bench: &mut Bench, client, line: &str| {
        bench.gateway.handle_line(bench.now, client, line.as_bytes());
    };
    say(&mut bench, CLIENT, "[1] 5 start");
    assert_eq!(sent(&mut bench), [by(CLIENT, "000#0105")]);
    // One waits for the LSS master, and then for the SDO channel, that the other one has.
    say(&mut bench, CLIENT, "[2] lss_set_node 5");
    say(&mut bench, 2, "[3] lss_store");
    assert_eq!(sent(&mut bench), [by(CLIENT, "7E5#1105000000000000")]);
    bench.gateway.handle_frame(bench.now, NET, &parse("7E4#1100000000000000"));
    assert_eq!(sent(&mut bench), [by(2, "7E5#1700000000000000")]);
    bench.gateway.handle_frame(bench.now, NET, &parse("7E4#1700000000000000"));
    say(&mut bench, 2, "[4] 5 write 0x1017 0 u16 100");
    say(&mut bench, CLIENT, "[5] 5 read 0x1000 0 u32");
    assert_eq!(sent(&mut bench), [by(2, "605#2B17100064000000")]);
    bench.gateway.handle_frame(bench.now, NET, &parse("585#6017100000000000"));
    assert_eq!(sent(&mut bench), [by(CLIENT, "605#4000100000000000")]);
    // The heartbeat is the gateway's own.
    say(&mut bench, 2, "[6] set id 9");
    say(&mut bench, 2, "[7] set heartbeat 100");
    bench.gateway.handle_timeout(bench.now);
    assert_eq!(sent(&mut bench), [(None, "709#05".to_owned())]);
}

proptest! {
    #[test]
    fn any_line_is_answered_once_and_any_frame_survived(
        lines in prop::collection::vec("\\[[0-9]{1,3}\\] ?[0-9]{0,3} ?[0-9]{0,3} ?(r|w|read|write|set|start|enable|lss_switch_sel|_lss_fastscan|[a-z_]{0,12}) ?.{0,40}", 1..20),
        frames in prop::collection::vec((0_u16..0x800, prop::collection::vec(any::<u8>(), 0..=8), any::<bool>()), 0..40),
    ) {
        let mut bench = Bench::new();
        for line in &lines {
            let waits = bench.gateway.handle_line(bench.now, CLIENT, line.as_bytes());
            let mut answers = 0;
            let mut count = |bench: &mut Bench| {
                while bench.gateway.poll_transmit().is_some() {}
                while let Some((_, told)) = bench.gateway.poll_line() {
                    answers += usize::from(matches!(told, Told::Answer(_)));
                }
            };
            count(&mut bench);
            for (id, data, is_remote) in &frames {
                let frame = if *is_remote { Frame::remote(Id::Standard(*id), 8) } else { Frame::new(Id::Standard(*id), data) };
                bench.gateway.handle_frame(bench.now, NET, &frame);
            }
            // Sixty-six seconds is the longest time-out, and a scan with such a window takes hours.
            for _ in 0..400 {
                let Some(due) = bench.gateway.poll_timeout() else { break };
                bench.now = due.max(bench.now);
                bench.gateway.handle_timeout(bench.now);
                count(&mut bench);
            }
            prop_assert_eq!(answers, usize::from(waits), "{}", line);
        }
    }
}
