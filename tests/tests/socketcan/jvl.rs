//! JVL's PDOs 21, 22, 24 and 25 as `candump` sees them (module manual, sections 4.3.15 and 4.3.16).

use std::time::Instant;

use tests::{Bus, Daemon, PATIENCE, Vcan, Wire, config};

use crate::PROFILE;

/// COB-IDs of RPDOs 21, 22, 24 and TPDOs 21, 22, 25, which have none of their own.
const COB_IDS: [&str; 6] = [
    "601#2314140121020000",
    "601#2315140122020000",
    "601#2317140124020000",
    "601#23141801A1020040",
    "601#23151801A2020040",
    "601#23181801A5020040",
];

/// A motor in OPERATIONAL whose master has given it the COB-IDs.
fn motor(interface: &Vcan) -> (Daemon, Wire) {
    let mut wire = Wire::on(interface);
    let daemon = Daemon::start(&config(Bus::Interface(interface), &[("axis1", PROFILE, 1)]));
    for request in COB_IDS {
        let answer = wire.ask(request, "581");
        assert!(answer.starts_with("581#60"), "{request}: {answer}");
    }
    wire.send("000#0101");
    (daemon, wire)
}

/// P_IST, motor status and inputs, as TPDO 21 answers a SYNC.
fn sync(wire: &mut Wire) -> (i32, u8, u8) {
    let answer = wire.ask("080#", "2A1");
    let raw = u64::from_str_radix(&answer["2A1#".len()..], 16).expect("eight bytes").swap_bytes();
    let [a, b, c, d, status, inputs, reserved @ ..] = raw.to_le_bytes();
    assert_eq!(reserved, [0, 0]);
    (i32::from_le_bytes([a, b, c, d]), status, inputs)
}

#[test]
fn a_motor_positions_by_pdos_21_and_22_and_tells_it_by_25() {
    const IN_POSITION: u8 = 1 << 4;
    // Four seconds away, so that also a slow machine asks on the way.
    const TARGET: i32 = 200_000;
    let interface = Vcan::new();
    let (_daemon, mut wire) = motor(&interface);

    // V_SOLL 1000, A_SOLL 50, T_SOLL 1023, MODE_REG 2 (position); then P_SOLL.
    wire.send("222#E8033200FF030200");
    wire.send("221#400D030000000000");
    let deadline = Instant::now() + PATIENCE;
    let mut places = Vec::new();
    while Instant::now() < deadline {
        let (place, status, inputs) = sync(&mut wire);
        assert_eq!(inputs, 0);
        places.push(place);
        if (place - TARGET).abs() <= 2 && status & IN_POSITION != 0 {
            break;
        }
    }

    let last = *places.last().expect("a SYNC was answered");
    assert!((last - TARGET).abs() <= 2, "{last}");
    assert!(places.is_sorted_by(|before, after| after - before >= -2), "straight there: {places:?}");
    let frames = wire.finish();
    let told: Vec<u8> = frames.iter().filter_map(|frame| status_of(frame)).collect();
    let has_told = |bit: u8| told.iter().any(|status| status & bit != 0);
    assert!(has_told(1 << 5) && has_told(1 << 6) && has_told(IN_POSITION), "{told:02X?}");
    let speeds: Vec<i16> = frames.iter().filter_map(|frame| speed_of(frame)).collect();
    // 1000 / 16 counts a sample.
    assert!(speeds.iter().any(|speed| (55..=70).contains(speed)), "{speeds:?}");
    assert_eq!(frames.iter().filter(|frame| frame.starts_with("081#")).count(), 0);
}

/// The motor status in TPDO 25.
fn status_of(frame: &str) -> Option<u8> {
    u8::from_str_radix(frame.strip_prefix("2A5#")?.get(..2)?, 16).ok()
}

/// V_IST in TPDO 22.
fn speed_of(frame: &str) -> Option<i16> {
    let digits = frame.strip_prefix("2A2#")?.get(..4)?;
    u16::from_str_radix(digits, 16).ok().map(|raw| raw.swap_bytes().cast_signed())
}

#[test]
fn a_master_commands_a_motor_by_pdos_21_to_25() {
    let interface = Vcan::new();
    let (_daemon, mut wire) = motor(&interface);

    // V_SOLL -100, A_SOLL 50, T_SOLL 1023, MODE_REG 0; P_SOLL; outputs.
    wire.send("222#9CFF3200FF030000");
    wire.send("221#7856341200000000");
    wire.send("224#0300000000000000");

    let register = |wire: &mut Wire, sub: &str| wire.ask(&format!("601#401220{sub}00000000"), "581");
    assert_eq!(register(&mut wire, "05"), "581#431220059CFFFFFF", "V_SOLL, a negative number");
    assert_eq!(register(&mut wire, "06"), "581#4312200632000000", "A_SOLL");
    assert_eq!(register(&mut wire, "07"), "581#43122007FF030000", "T_SOLL");
    assert_eq!(register(&mut wire, "02"), "581#4312200200000000", "MODE_REG");
    assert_eq!(register(&mut wire, "03"), "581#4312200378563412", "P_SOLL");
    assert_eq!(wire.ask("601#4011200200000000", "581"), "581#4F11200203000000", "outputs");

    // Motor status and inputs behind P_IST; V_IST.
    assert_eq!(wire.ask("080#", "2A1"), "2A1#0000000000000000");
    wire.expect("2A2#0000000000000000");
    // PL counts as active while its pin is low.
    assert_eq!(wire.ask("601#2F1120061F000000", "581"), "581#6011200600000000");
    wire.expect("2A5#0020000000000000");
    assert_eq!(wire.ask("080#", "2A1"), "2A1#0000000000200000");

    let frames = wire.finish();
    let pdos = frames.iter().filter(|frame| frame.starts_with('2'));
    let once: Vec<&String> =
        pdos.filter(|frame| frame.starts_with("2A5") || frame.starts_with("22")).collect();
    let expected = [
        "2A5#0000000000000000",
        "222#9CFF3200FF030000",
        "221#7856341200000000",
        "224#0300000000000000",
        "2A5#0020000000000000",
    ];
    assert_eq!(once, expected.map(str::to_owned).iter().collect::<Vec<_>>(), "each once");
    let emergencies = frames.iter().filter(|frame| frame.starts_with("081#")).count();
    assert_eq!(emergencies, 0, "reserved bytes are no error");
}
