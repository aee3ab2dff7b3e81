//! JVL's PDOs 21, 22, 24 and 25 as `candump` sees them (module manual, sections 4.3.15 and 4.3.16).

use tests::{Bus, Daemon, Vcan, Wire, config};

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

#[test]
fn a_master_commands_a_motor_by_pdos_21_to_25() {
    let interface = Vcan::new();
    let mut wire = Wire::on(&interface);
    let _daemon = Daemon::start(&config(Bus::Interface(&interface), &[("axis1", PROFILE, 1)]));
    for request in COB_IDS {
        let answer = wire.ask(request, "581");
        assert!(answer.starts_with("581#60"), "{request}: {answer}");
    }
    wire.send("000#0101");

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
