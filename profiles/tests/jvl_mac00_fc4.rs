//! The profile of JVL's MAC00-FC4 against the object lists and PDO tables of the module's manual
//! (4.3.3, 4.3.12, 4.3.15, 4.3.16, 4.3.20, 4.3.26).

use od::{Address, Initial, Value};
use profiles::{Profile, Space};

fn profile(motor: &str) -> Profile {
    Profile::embedded("jvl-mac00-fc4", Some(motor)).unwrap().unwrap()
}

/// The default of an entry: numbers signed as their type, text as it is, `+` and a number for $NODEID.
fn default(profile: &Profile, index: u16, sub: u8) -> String {
    let schema = if index < 0x2000 { &profile.communication } else { &profile.application };
    let slot = schema.slot(Address::new(index, sub)).unwrap_or_else(|| panic!("no {index:04X}:{sub:02X}"));
    let entry = schema.entry(slot).unwrap();
    match &entry.initial {
        Initial::PlusNodeId(base) => format!("+{base:X}"),
        Initial::Value(Value::Fixed(raw)) => entry.data_type.integer(*raw).to_string(),
        Initial::Value(Value::Bytes(text)) => String::from_utf8(text.to_vec()).unwrap(),
    }
}

/// Index, sub-index, type, read only. Typed from the manual; the manual prints 0x603F without the mark.
const OBJECTS: &[(u16, u8, &str, bool)] = &[
    (0x2010, 0, "U8", false),
    (0x2011, 0, "U8", true),
    (0x2011, 1, "U8", true),
    (0x2011, 2, "U8", false),
    (0x2011, 3, "U8", true),
    (0x2011, 4, "U16", true),
    (0x2011, 5, "U8", false),
    (0x2011, 6, "U8", false),
    (0x2011, 7, "U8", false),
    (0x2011, 8, "U8", false),
    (0x2012, 0, "U8", true),
    (0x2013, 0, "U8", false),
    (0x2100, 0, "U16", false),
    (0x6402, 0, "U16", true),
    (0x6403, 0, "STRING", true),
    (0x6404, 0, "STRING", true),
    (0x6405, 0, "STRING", true),
    (0x6502, 0, "U32", true),
    (0x6503, 0, "STRING", true),
    (0x6504, 0, "STRING", true),
    (0x6505, 0, "STRING", true),
    (0x60FD, 0, "U32", true),
    (0x60FE, 0, "U8", true),
    (0x60FE, 1, "U32", false),
    (0x60FE, 2, "U32", false),
    (0x6007, 0, "I16", false),
    (0x603F, 0, "U16", true),
    (0x6040, 0, "U16", false),
    (0x6041, 0, "U16", true),
    (0x605A, 0, "I16", false),
    (0x6060, 0, "I8", false),
    (0x6061, 0, "I8", true),
    (0x6064, 0, "I32", true),
    (0x607A, 0, "I32", false),
    (0x607D, 0, "U8", true),
    (0x607D, 1, "I32", false),
    (0x607D, 2, "I32", false),
    (0x6067, 0, "U32", false),
    (0x6068, 0, "U16", false),
    (0x6080, 0, "U32", false),
    (0x6081, 0, "U32", false),
    (0x6083, 0, "U32", false),
    (0x6085, 0, "U32", false),
    (0x6086, 0, "I16", false),
    (0x6069, 0, "I32", true),
    (0x606B, 0, "I32", true),
    (0x606C, 0, "I32", true),
    (0x606D, 0, "U16", false),
    (0x606E, 0, "U16", false),
    (0x60FF, 0, "I32", false),
    (0x6072, 0, "U16", false),
    (0x607C, 0, "I32", false),
    (0x6098, 0, "I8", false),
    (0x6099, 0, "U8", true),
    (0x6099, 1, "U32", false),
    (0x6099, 2, "U32", false),
    (0x609A, 0, "U32", false),
    (0x6089, 0, "I8", false),
    (0x608A, 0, "U8", false),
    (0x608B, 0, "I8", false),
    (0x608C, 0, "U8", false),
    (0x608D, 0, "I8", false),
    (0x608E, 0, "U8", false),
    (0x608F, 0, "U8", true),
    (0x608F, 1, "U32", false),
    (0x608F, 2, "U32", false),
    (0x6090, 0, "U8", true),
    (0x6090, 1, "U32", false),
    (0x6090, 2, "U32", false),
    (0x6091, 0, "U8", true),
    (0x6091, 1, "U32", false),
    (0x6091, 2, "U32", false),
    (0x6092, 0, "U8", true),
    (0x6092, 1, "U32", false),
    (0x6092, 2, "U32", false),
    (0x6093, 0, "U8", true),
    (0x6093, 1, "U32", false),
    (0x6093, 2, "U32", false),
    (0x6094, 0, "U8", true),
    (0x6094, 1, "U32", false),
    (0x6094, 2, "U32", false),
    (0x6097, 0, "U8", true),
    (0x6097, 1, "U32", false),
    (0x6097, 2, "U32", false),
    (0x607E, 0, "U8", false),
];

#[test]
fn it_has_the_objects_of_the_manual_with_their_types_and_access() {
    let profile = profile("mac140");
    let is_read_only = |n: u8| !profile.register(Space::Motor, n.into()).unwrap().access.is_writable();
    let registers = (1..=254).map(|n| (0x2012, n, "U32", is_read_only(n)));
    let mut expected: Vec<_> = OBJECTS.iter().copied().chain(registers).collect();
    expected.sort_unstable();
    let entries = profile.application.entries().filter(|(_, entry)| !entry.is_local);
    let found: Vec<_> = entries
        .map(|(at, e)| (at.index, at.sub, e.data_type.short_name(), !e.access.is_writable()))
        .collect();
    assert_eq!(found, expected);
}

#[test]
fn it_has_the_defaults_of_the_manual() {
    let profile = profile("mac140");
    let printed = [
        (0x2011, 0, "8"), // 7 in the manual's table, which leaves out the sub-index that 4.3.12 describes
        (0x2012, 0, "254"),
        (0x2100, 0, "1000"),
        (0x6402, 0, "10"),
        (0x6403, 0, "MACxxx"),
        (0x6404, 0, "JVL A/S"),
        (0x6405, 0, "www.jvl.dk"),
        (0x6502, 0, "45"),
        (0x6503, 0, "MACxxx"),
        (0x6504, 0, "JVL A/S"),
        (0x6505, 0, "www.jvl.dk"),
    ];
    let from_the_ethernet_manual = [
        (0x605A, 0, "2"),
        (0x6067, 0, "100"),
        (0x6068, 0, "6"),
        (0x606D, 0, "100"),
        (0x606E, 0, "6"),
        (0x6072, 0, "1000"),
        (0x607C, 0, "0"),
        (0x607D, 1, "0"),
        (0x607D, 2, "0"),
        (0x607E, 0, "0"),
        (0x6081, 0, "100"),
        (0x6083, 0, "15000"),
        (0x6085, 0, "50000"),
        (0x6086, 0, "0"),
        (0x608F, 2, "1"),
        (0x6091, 1, "1"),
        (0x6091, 2, "1"),
        (0x6092, 2, "1"),
        (0x6099, 1, "50"),
        (0x6099, 2, "50"),
        (0x609A, 0, "5000"),
    ];
    let communication = [
        (0x1000, 0, "131474"), // 0x00020192
        (0x1005, 0, "128"),
        (0x1014, 0, "+80"),
        (0x1018, 1, "279"), // 0x0117
        (0x1018, 2, "256"),
        (0x1200, 1, "+600"),
        (0x1200, 2, "+580"),
    ];
    for (index, sub, text) in printed.iter().chain(&from_the_ethernet_manual).chain(&communication) {
        assert_eq!(default(&profile, *index, *sub), *text, "{index:04X}:{sub:02X}");
    }
}

#[test]
fn one_user_unit_is_one_count_of_the_chosen_motor() {
    for (motor, counts) in [("mac050", "4096"), ("mac800", "8000"), ("mac3000", "8192")] {
        let profile = profile(motor);
        assert_eq!(default(&profile, 0x608F, 1), counts);
        assert_eq!(default(&profile, 0x6092, 1), counts);
    }
}

/// PDO number, COB-ID, transmission type, mapped entries.
type Pdo = (u16, &'static str, &'static str, &'static [u32]);

fn assert_pdos(communication: u16, mapping: u16, expected: &[Pdo]) {
    let profile = profile("mac140");
    for (number, cob_id, transmission, map) in expected {
        let (communication, mapping) = (communication + number - 1, mapping + number - 1);
        assert_eq!(default(&profile, communication, 1), *cob_id, "COB-ID of PDO {number}");
        assert_eq!(default(&profile, communication, 2), *transmission, "transmission type of PDO {number}");
        assert_eq!(default(&profile, mapping, 0), map.len().to_string(), "entries of PDO {number}");
        for (position, parameter) in map.iter().enumerate() {
            let sub = u8::try_from(position).unwrap() + 1;
            assert_eq!(default(&profile, mapping, sub), parameter.to_string(), "entry {sub} of PDO {number}");
        }
    }
    let objects = profile.communication.objects();
    let count = objects.filter(|(index, ..)| (communication..communication + 512).contains(index)).count();
    assert_eq!(count, expected.len());
}

#[test]
fn its_receive_pdos_are_those_of_the_manual() {
    let disabled = "2147483648"; // 0x80000000
    assert_pdos(
        0x1400,
        0x1600,
        &[
            (1, "+200", "255", &[0x6040_0010]),
            (2, "+300", "255", &[0x6040_0010, 0x6060_0008]),
            (3, "+400", "255", &[0x6040_0010, 0x607A_0020]),
            (4, "+500", "255", &[0x6040_0010, 0x60FF_0020]),
            (7, disabled, "255", &[0x6040_0010, 0x60FE_0120]),
            (21, disabled, "255", &[0x2012_0320]),
            (22, disabled, "255", &[0x2012_0510, 0x2012_0610, 0x2012_0710, 0x2012_0210]),
            (23, disabled, "255", &[0x2013_0008]),
            (24, disabled, "255", &[0x2011_0208]),
        ],
    );
}

#[test]
fn torque_and_analogue_input_are_mapped_where_the_motor_has_them() {
    let table = [
        ("mac050", [0x2012_7910_u32, 0x2012_7A10]),
        ("mac141", [0x2012_7910, 0x2012_7A10]),
        ("mac400", [0x2012_A910, 0x2012_AA10]),
        ("mac800", [0x2012_A910, 0x2012_AA10]),
        ("mac3000", [0x2012_A910, 0x2012_AA10]),
    ];
    for (motor, expected) in table {
        let profile = profile(motor);
        let mapped = [0x1A16, 0x1A17].map(|mapping| default(&profile, mapping, 1));
        assert_eq!(mapped, expected.map(|parameter| parameter.to_string()), "{motor}");
    }
}

#[test]
fn its_pdos_21_to_25_have_the_bytes_and_times_of_the_manual() {
    use od::Direction::{Receive, Transmit};
    let profile = profile("mac140");
    let micros = |pdo: &od::PdoTraits| pdo.time.as_micros();
    let found: Vec<_> =
        profile.pdos.iter().map(|p| (p.direction, p.number, p.length, micros(p), p.scan.is_some())).collect();
    let expected = [
        (Receive, 21, 8, 8_500, false),
        (Receive, 22, 8, 21_000, false),
        (Receive, 23, 8, 900, false),
        (Receive, 24, 8, 900, false),
        (Transmit, 21, 8, 12_500, true),
        (Transmit, 22, 8, 10_500, true),
        (Transmit, 23, 8, 10_500, false),
        (Transmit, 24, 8, 10_500, false),
        (Transmit, 25, 8, 900, false),
    ];
    assert_eq!(found, expected);
    let scans: Vec<_> = profile.pdos.iter().filter_map(|p| p.scan).collect();
    let shown: Vec<_> = scans.iter().map(|s| (s.entry, s.switch, s.bit, s.time.as_micros())).collect();
    let (p_ist, v_ist) = (Address::new(0x2012, 10), Address::new(0x2012, 12));
    let setup_bits = Address::new(0x2011, 8);
    assert_eq!(shown, [(p_ist, setup_bits, 0, 900), (v_ist, setup_bits, 1, 900)]);
}

#[test]
fn its_transmit_pdos_are_those_of_the_manual() {
    let disabled = "3221225472"; // 0xC0000000
    assert_pdos(
        0x1800,
        0x1A00,
        &[
            (1, "+40000180", "255", &[0x6041_0010]),
            (2, "+40000280", "255", &[0x6041_0010, 0x6061_0008]),
            (3, "+40000380", "1", &[0x6041_0010, 0x6064_0020]),
            (4, "+40000480", "1", &[0x6041_0010, 0x606C_0020]),
            (7, disabled, "255", &[0x6041_0010, 0x60FD_0020]),
            (21, disabled, "1", &[0x2012_0A20, 0x2011_0308, 0x2011_0108]),
            (22, disabled, "1", &[0x2012_0C10]),
            (23, disabled, "1", &[0x2012_7910]),
            (24, disabled, "1", &[0x2012_7A10]),
            (25, disabled, "255", &[0x2011_0308, 0x2011_0108, 0x2011_0410]),
        ],
    );
}
